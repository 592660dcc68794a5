// SPDX-License-Identifier: Apache-2.0
// Interface robomosp.renderer/2: pictures of meshes, lines and frames, drawn without a window
// (layer: contract, std only). Lengths in metres, world frame with z up, colours sRGB. Scene and
// Options grow at their ends, Look at its own (it is the last of Options), elements of a scene in
// their `room`; what lies within others by value (Camera, Section, Appearance) stays as it is.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>
#include <robomosp/sdk/types.h>

namespace robomosp::render {

/// How a surface looks.
struct Appearance {
  Colour colour;            ///< base colour, sRGB components as a designer writes them; a = opacity
  float shininess = 0.35F;  ///< 0 matt .. 1 mirror-like highlight
  float metalness = 0.0F;   ///< 0 paint or plastic .. 1 bare metal
  std::optional<Colour> ambient = std::nullopt;   ///< colour in the shade; none = the base colour
  std::optional<Colour> specular = std::nullopt;  ///< colour of highlights; none = by metalness
  Colour emission{0, 0, 0, 1};                    ///< emitted light
};

/// A mesh at a place. Items are matched between scenes by `id`.
struct Item {
  std::uint64_t id = 0;
  std::string name;
  std::shared_ptr<const Mesh> mesh;  ///< compared by pointer: same pointer, same geometry
  Pose pose;                         ///< world_T_item
  Appearance appearance;
  bool selected = false;
  Room room{};
};

/// A polyline in the world, such as a trajectory or the trace of a tool.
struct Line {
  std::uint64_t id = 0;
  std::vector<Vec3> points;  ///< world coordinates [m]
  Colour colour{0.95F, 0.45F, 0.10F, 1.0F};
  float width = 2.5F;  ///< pixels in a picture 800 pixels high; grows with the picture
  Room room{};
};

/// Red-green-blue axes of a coordinate frame.
struct Triad {
  std::uint64_t id = 0;
  Pose pose;            ///< world_T_frame
  double length = 0.1;  ///< [m]
  std::string label;    ///< drawn at the origin; may be empty
  bool on_top = false;  ///< drawn over what hides it
  Room room{};
};

/// Where the mass of a body is: a chequered ball at the centre of mass with the principal axes,
/// drawn over what hides them.
struct MassMark {
  std::uint64_t id = 0;
  Pose pose;          ///< world_T_principal: origin = centre of mass, axes = principal axes
  Vec3 gyration{};    ///< radii of gyration about the three axes: half the drawn lengths [m]
  std::string label;  ///< drawn beside the ball; may be empty
  Room room{};
};

/// Text at a place of the world.
struct Label {
  Vec3 place{};  ///< [m]
  std::string text;
  Room room{};
};

/// What the colours of a map mean: a bar of colours, from below to above, drawn over the picture.
struct Legend {
  /// A mark beside the bar.
  struct Tick {
    double share = 0;  ///< position on the bar, 0..1
    std::string text;
  };
  std::string title;            ///< drawn above the bar, with the unit
  std::vector<Colour> colours;  ///< bands of equal height, the lowest first
  std::vector<Tick> ticks;      ///< one at the middle of each band: kinds, as patches with names
  Room room{};
};

/// A lamp of the scene.
struct Light {
  enum class Kind : std::int32_t {
    sun,     ///< parallel light along -z of its frame
    point,   ///< from its origin to all sides
    spot,    ///< from its origin along -z of its frame, within `angle` of it
    ambient  ///< from all sides; 1 = as bright as the renderer's own surroundings
  };
  Kind kind = Kind::point;
  Pose pose;             ///< world_T_light
  Colour colour;         ///< sRGB; a is of no account
  double intensity = 1;  ///< 1 = as bright as the renderer's own lamp, at any distance; >= 0
  double angle = 0.5;    ///< half the opening of a spot [rad], 0..pi
  Room room{};
};

/// Everything that can be in one picture.
struct Scene {
  std::uint32_t struct_size = sizeof(Scene);  ///< see plugin.h
  std::vector<Item> items;
  std::vector<Line> lines;
  std::vector<Triad> triads;
  std::vector<MassMark> marks;
  std::vector<Label> labels;
  std::vector<Legend> legends;  ///< side by side, from the right edge of the picture
  std::vector<Light> lights;    ///< in place of the renderer's own lamp; none = that
};

/// Where the picture is taken from.
struct Camera {
  /// `isometric` is the three-quarter view from the front right, in parallel projection the true
  /// isometric one; `front` looks along +y, `top` has x to the right.
  enum class View : std::int32_t { isometric, front, back, left, right, top, bottom, custom };
  View view = View::isometric;
  bool perspective = true;
  std::optional<Vec3> eye, target;  ///< for View::custom [m]; z is up
  double zoom = 1.0;                ///< 1 = the scene fits the picture (custom: the given distance)

  friend bool operator==(const Camera&, const Camera&) = default;
};

/// How surfaces are drawn.
enum class Style : std::int32_t {
  smooth,      ///< shaded, with the normals of the mesh
  flat,        ///< shaded, every triangle plane
  wireframe,   ///< lines only, nothing hides anything
  hidden_line  ///< a drawing: white faces, dark edges and contours, hidden lines left out
};

/// A plane that cuts the items open: what lies on the side its normal points to is taken away and
/// closed bodies show a cut face. Lines, frames and marks stay whole.
struct Section {
  Vec3 point{};                              ///< [m]
  Vec3 normal{0, 1, 0};                      ///< any length but zero
  Colour colour{0.90F, 0.50F, 0.20F, 1.0F};  ///< of cut faces; opaque
  bool hatch = true;                         ///< lines across the cut faces
};

/// What is behind everything.
enum class Background : std::int32_t {
  automatic,   ///< studio for shaded styles, white for drawings
  studio,      ///< a wall, and a floor that takes shadows
  plain,       ///< one colour, no floor
  transparent  ///< nothing: the pixels keep their opacity
};

/// How a scene is shown.
struct Look {
  Camera camera;
  Style style = Style::smooth;
  bool feature_edges = true;  ///< dark lines along the edges of solids
  bool hidden_edges = false;  ///< Style::hidden_line: hidden edges dashed instead of left out
  std::optional<Section> section;
  Background background = Background::automatic;
  Colour background_colour{1, 1, 1, 1};  ///< of Background::plain; a dark studio if that is dark
  bool grid = true;                      ///< lines on the floor
  bool world_axes = true;                ///< axes on the floor and in the corner
  std::string caption;                   ///< small text in the lower left corner; may be empty
};

/// How much work a picture may cost.
enum class Quality : std::int32_t {
  draft,   ///< simple light, a few samples a pixel: tests, examples, interaction
  normal,  ///< physically based light and soft shadows
  high     ///< the same with more samples: for print
};

struct Options {
  std::uint32_t struct_size = sizeof(Options);  ///< see plugin.h
  int width = 800, height = 600;                ///< [px], 16..8192
  Quality quality = Quality::normal;
  Look look;
};

/// Eight-bit sRGB picture, rows from top to bottom, four bytes per pixel (red, green, blue,
/// opacity; colours not multiplied by the opacity), no padding.
struct Image {
  int width = 0, height = 0;  ///< [px]
  std::vector<std::uint8_t> rgba;
  /// clip_T_world, row-major: the projection the picture was taken with. A point p of the world is
  /// at pixel ((x/w + 1)/2 width, (1 - y/w)/2 height) for (x, y, z, w) = clip_T_world (p, 1).
  std::array<double, 16> clip_T_world{};
};

/// Interface robomosp.renderer/2. [any thread]
class Renderer {
 public:
  using Interface = Renderer;
  static constexpr const char* kInterfaceId = "robomosp.renderer/2";
  virtual ~Renderer() = default;
  /// What later versions of the SDK add, by its id (plugin.h); nullptr = not known.
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
  /// Draws a scene. Unusable items (no mesh, numbers that are not finite) are left out. Fails on a
  /// size out of range, a section without direction, and where the system has no OpenGL.
  virtual Result<Image> draw(const Scene& scene, const Options& options, Progress&) const = 0;
  /// A picture as the bytes of a PNG file; without opacity channel when every pixel is opaque.
  virtual Result<std::string> png(const Image& image) const = 0;
};

}  // namespace robomosp::render
