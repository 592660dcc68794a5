// SPDX-License-Identifier: GPL-3.0-or-later
// The nodes of a scene view, shared by its parts (layer: GUI). Internal to
// viewer/scene/scene_view*.cpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <set>
#include <unordered_map>
#include <utility>

#include <osg/BlendFunc>
#include <osg/ColorMask>
#include <osg/CullFace>
#include <osg/Depth>
#include <osg/GLObjects>
#include <osg/Geode>
#include <osg/LineWidth>
#include <osg/MatrixTransform>
#include <osg/PolygonMode>
#include <osg/PolygonOffset>
#include <osg/Stencil>
#include <osgUtil/RenderBin>
#include <osgViewer/GraphicsWindow>
#include <osgViewer/Viewer>

#include "viewer/scene/hud.h"
#include "viewer/scene/lamps.h"
#include "viewer/scene/linear.h"
#include "viewer/scene/osg_geometry.h"
#include "viewer/scene/playback.h"
#include "viewer/scene/scene_view.h"
#include "viewer/scene/shadow_map.h"
#include "viewer/scene/surface.h"

namespace robomosp::viewer {

// Objects drawn by each camera.
constexpr unsigned kVisible = 1, kCaster = 2, kGlassCaster = 4, kGlassCaster2 = 8;
// Drawing order within the picture.
constexpr int kBodyBin = 1, kVeiledFrameBin = 2, kFrameBin = 3, kGroundBin = 4, kBackgroundBin = 5,
              kGroundFromBelowBin = 6, kEdgeBin = 7, kRibbonBin = 8, kVeilBin = 9,
              kGlassBin = 100,  // and the bins after it, one for each layer of glass
    kMarkBin = 1 << 20, kOutlineMaskBin = kMarkBin - 3, kOutlineBin = kMarkBin - 2,
              kHiddenOutlineBin = kMarkBin - 1, kHudBin = kMarkBin + 10;
/// Opacity of lines and outlines behind a body.
constexpr float kHiddenShare = 0.45F;
// Widths of lines and sizes in pixels of a picture 800 pixels high.
constexpr double kEdgeWidth = 1.15, kDrawnWidth = 2.0, kMeshWidth = 1.0, kDashPeriod = 9.0,
                 kHatchSpacing = 8.5, kBallRadius = 13.0;
/// Axes of a mass mark, smallest moment first, sRGB.
constexpr std::array<Colour, 3> kPrincipalColours{
    {{0.80F, 0.10F, 0.52F, 1}, {0.02F, 0.55F, 0.58F, 1}, {0.88F, 0.60F, 0.02F, 1}}};
/// Name of a render bin type that draws the nearest first, which OSG lacks.
inline constexpr const char* kNearestFirst = "NearestFirst";
constexpr osg::StateAttribute::GLMode kSectionMode = GL_CLIP_PLANE0;  // = GL_CLIP_DISTANCE0

// Direction to the lamp: above the left shoulder in the isometric view.
constexpr Vec3 kLamp{-0.20, -0.80, 1.02};
constexpr float kOpaque = 0.999F;

/// Coordinates outside of a shadow map everywhere: no shadow.
inline osg::Matrixf nowhere() {
  return osg::Matrixf::scale(0, 0, 0) * osg::Matrixf::translate(-1, -1, 0);
}

inline osg::Vec3f vec_of(const Vec3& v) {
  return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}

inline Vec3 unit(const Vec3& v) { return (1 / norm(v)) * v; }

inline std::array<Vec3, 8> corners(const Surface& s, const Pose& pose) {
  std::array<Vec3, 8> c;
  for (std::size_t i = 0; i < 8; ++i) {
    c[i] =
        transform(pose, {(i & 1U) != 0 ? s.high[0] : s.low[0], (i & 2U) != 0 ? s.high[1] : s.low[1],
                         (i & 4U) != 0 ? s.high[2] : s.low[2]});
  }
  return c;
}

inline void blend(osg::StateSet* state, osg::Depth::Function function = osg::Depth::LESS) {
  state->setMode(GL_BLEND, osg::StateAttribute::ON);
  // The colour in memory is multiplied by the opacity, so that passes can be averaged.
  state->setAttributeAndModes(
      new osg::BlendFunc(osg::BlendFunc::SRC_ALPHA, osg::BlendFunc::ONE_MINUS_SRC_ALPHA,
                         osg::BlendFunc::ONE, osg::BlendFunc::ONE_MINUS_SRC_ALPHA));
  state->setAttributeAndModes(new osg::Depth(function, 0, 1, false));
}

/// Culls these sides, overriding parent states.
inline void cull(osg::StateSet* state, osg::CullFace::Mode sides) {
  state->setAttributeAndModes(new osg::CullFace(sides),
                              osg::StateAttribute::ON | osg::StateAttribute::PROTECTED);
}

inline osg::ref_ptr<osg::Geode> geode_of(osg::Geometry* geometry, unsigned mask) {
  osg::ref_ptr<osg::Geode> geode = new osg::Geode;
  geode->addDrawable(geometry);
  geode->setNodeMask(mask);
  return geode;
}

/// Viewpoint of the last computation for an item.
struct Seen {
  Matrix4 view{};
  Pose pose;
  bool perspective = true;
};
inline bool same(const Seen& a, const Seen& b) {
  return a.view == b.view && a.pose.R == b.pose.R && a.pose.p == b.pose.p &&
         a.perspective == b.perspective;
}

/// A section with a unit normal.
struct Plane {
  Vec3 point{}, normal{};
  friend bool operator==(const Plane&, const Plane&) = default;
};

struct ItemNode {
  Item item;
  Surface surface;
  osg::ref_ptr<osg::MatrixTransform> place;
  osg::ref_ptr<osg::Geometry> triangles, segments, hull;
  bool is_seen = true;
  // Glass: the back and front sides and the edges, sorted by depth at each draw.
  osg::ref_ptr<osg::Geode> glass_back, glass_front, glass_edges, glass_caster;
  std::optional<Seen> glass_sorted;
  // Drawings: contours as seen from the camera.
  std::vector<MeshEdge> mesh_edges;
  std::vector<osg::ref_ptr<osg::Geode>> contours;
  std::optional<Seen> contours_seen;
  // Sections.
  osg::ref_ptr<osg::Group> cut;
  std::optional<Plane> cut_by;
  Pose cut_pose;
  std::vector<float> cut_points;
};

struct LineNode {
  Line line;
  osg::ref_ptr<osg::Group> group;
  bool is_seen = true;
};

struct TriadNode {
  Triad triad;
  osg::ref_ptr<osg::MatrixTransform> place;
  osg::ref_ptr<osg::Group> veiled;  ///< what bodies hide
  bool is_seen = true;
};

struct MarkNode {
  MassMark mark;
  osg::ref_ptr<osg::MatrixTransform> place, ball;
  bool is_seen = true;
};

inline bool same(const Colour& a, const Colour& b) {
  return a.r == b.r && a.g == b.g && a.b == b.b && a.a == b.a;
}

inline bool same(const Appearance& a, const Appearance& b) {
  const auto both = [](const std::optional<Colour>& x, const std::optional<Colour>& y) {
    return x.has_value() == y.has_value() && (!x || same(*x, *y));
  };
  return same(a.colour, b.colour) && a.shininess == b.shininess && a.metalness == b.metalness &&
         both(a.ambient, b.ambient) && both(a.specular, b.specular) && same(a.emission, b.emission);
}

inline osg::Vec3f rgb_of(const Colour& srgb) {
  const osg::Vec4f c = linear_of(srgb);
  return {c.x(), c.y(), c.z()};
}

inline bool same(const std::optional<Section>& a, const std::optional<Section>& b) {
  if (!a || !b) return a.has_value() == b.has_value();
  return a->point == b->point && a->normal == b->normal && same(a->colour, b->colour) &&
         a->hatch == b->hatch;
}

inline bool is_drawing(Style style) {
  return style == Style::wireframe || style == Style::hidden_line;
}

inline bool has_studio(const render::Look& look) {
  return look.background == Background::studio ||
         (look.background == Background::automatic && !is_drawing(look.style));
}

/// True for a studio with a dark colour, which commands give as background "dark".
inline bool asks_for_darkness(const render::Look& look) {
  const Colour& c = look.background_colour;
  return look.background == Background::studio && 0.21F * c.r + 0.72F * c.g + 0.07F * c.b < 0.5F;
}

inline bool same(const Line& a, const Line& b) {
  return a.points == b.points && same(a.colour, b.colour) && a.width == b.width;
}

/// Drops nodes that are not in the newest frame.
template <class Map, class Remove>
void sweep(Map& nodes, Remove&& remove) {
  for (auto i = nodes.begin(); i != nodes.end();) {
    if (std::exchange(i->second.is_seen, false)) {
      ++i;
    } else {
      remove(i->second);
      i = nodes.erase(i);
    }
  }
}

struct SceneView::Impl {
  Impl(Quality quality, Target target);

  void build_item(ItemNode& node);
  void add_outline(ItemNode& node);
  void build_line(LineNode& node);
  void sync_items(const Frame& frame);
  void sync_lines(const Frame& frame);
  void sync_triads(const Frame& frame);
  [[nodiscard]] osg::ref_ptr<osg::Group> veiled_axes() const;
  void sync_marks(const Frame& frame);
  void sync_look(const Frame& frame);
  [[nodiscard]] osg::ref_ptr<osg::Geode> line_geode(osg::Geometry* segments, bool is_hidden) const;
  void update_cuts();
  void build_cut(ItemNode& node);
  void update_contours();
  void sort_glass();
  void sort_triangles(ItemNode& node) const;
  void place_marks(double scale);
  [[nodiscard]] double scale() const { return std::max(camera.height() / 800.0, 0.6); }
  [[nodiscard]] bool is_kept(const Vec3& p) const {
    return !plane || dot(plane->normal, p - plane->point) <= 0;
  }
  void place_ground();
  void show_darkness();
  void apply_camera(const Camera& wanted);
  void apply_time();
  void fit();
  void refit_if_untouched();
  [[nodiscard]] std::vector<Vec3> points_of_bodies(
      const std::set<std::uint64_t>& without = {}) const;
  /// Points that must be in the picture; frames, marks and labels far from all bodies are left out.
  [[nodiscard]] std::vector<Vec3> points_shown(const std::set<std::uint64_t>& without = {}) const;
  /// Items that are floors: flat, with the top at z = 0, below all else and several times as large.
  /// Pictures are fitted to the other items.
  [[nodiscard]] std::set<std::uint64_t> floors() const;
  [[nodiscard]] std::vector<Vec3> points_moved() const;
  [[nodiscard]] std::vector<Vec3> points_seen(const std::vector<Vec3>& casters_at) const;
  [[nodiscard]] Lamp light_of(const Pass& pass) const;
  [[nodiscard]] std::vector<Lamp> lights_of(const Pass& pass) const;
  void aim_sky(ShadowMap& map, const Pass::Sample& sample, unsigned mask, const std::string& suffix,
               std::span<const Vec3> casters_at, std::span<const Vec3> seen);
  void aim_lights(const Pass& pass);
  void place_camera(const Pass& pass);
  void prepare();

  bool is_still, has_two_samples, is_dark = false;
  int origin_x = 0, origin_y = 0;  // [px]
  double shift = 0;                // [px]
  OrbitCamera camera, fitted;
  std::optional<Camera> frame_camera;
  double frame_zoom = 1;
  bool is_fitted = false;
  render::Look look;
  std::optional<Plane> plane;
  std::vector<render::Label> labels;
  std::vector<Lamp> lights;  // of the frame, the brightest first
  osg::Vec3f surroundings{1, 1, 1};
  std::size_t builds = 0;
  std::unordered_map<std::uint64_t, ItemNode> items;
  std::unordered_map<std::uint64_t, LineNode> lines;
  std::unordered_map<std::uint64_t, TriadNode> triads;
  std::unordered_map<std::uint64_t, MarkNode> marks;
  std::shared_ptr<const Playback> playback;
  std::optional<double> time;
  double radius = 1;  // half the diagonal of the box around the frame [m]

  osg::ref_ptr<osg::Group> casters = new osg::Group;
  ShadowMap lamp, sky, lamp_2, sky_2;      // the second ones if a pass has two samples of each
  bool has_new_casters = true;             // something moved or looks different since the last map
  std::optional<osg::Matrixd> lamp_drawn;  // how the map of the lamp was drawn
  osg::ref_ptr<osg::Group> root = new osg::Group, ribbons = new osg::Group, frames = new osg::Group,
                           cuts = new osg::Group, balls = new osg::Group;
  osg::ref_ptr<osg::MatrixTransform> ground = new osg::MatrixTransform;
  osg::ref_ptr<osg::Geode> background;
  /// Programs of what the lamps light.
  struct LitPrograms {
    osg::ref_ptr<osg::Program> surface, flat, ground;
  };
  [[nodiscard]] const LitPrograms& lit_programs();
  std::map<int, LitPrograms> lit;  // by the number of lamps; 0 = the own one
  bool is_quality;
  osg::ref_ptr<osg::Program> surface_program, paper_program, cut_program, edge_program,
      outline_program, mask_program, ribbon_program, ball_program;
  osg::ref_ptr<osg::LineWidth> edge_width = new osg::LineWidth(1.0F),
                               drawn_width = new osg::LineWidth(1.0F),
                               mesh_width = new osg::LineWidth(1.0F);
  std::unique_ptr<Hud> hud;

  osg::ref_ptr<osgViewer::GraphicsWindowEmbedded> window;
  osgViewer::Viewer viewer;
  osg::ref_ptr<osg::Image> memory;
  std::vector<float> pixels;
  bool is_prepared = false, is_released = false;
};

}  // namespace robomosp::viewer
