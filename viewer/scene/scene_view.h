// SPDX-License-Identifier: GPL-3.0-or-later
// SceneView: draws a Frame with OpenGL into the host's current context (layer: GUI; OSG stays
// behind the source file). Hosts: OffscreenRenderer, the Qt display widget. Belongs to the thread
// that owns the OpenGL context.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "viewer/frame.h"
#include "viewer/scene/orbit_camera.h"

namespace robomosp::viewer {

/// Cost and quality of a picture.
enum class Quality {
  fast,    ///< simple highlights, small shadow map: for interaction on software OpenGL
  quality  ///< physically based highlights, soft shadows: for stills and graphics cards
};

/// The object hit by a click in the picture.
struct Pick {
  std::uint64_t id = 0;  ///< of the item
  std::string name;      ///< of the item
  Vec3 point{};          ///< in world coordinates [m]
  double distance = 0;   ///< from the start of the view ray [m]
};

/// Destination of the pixels.
enum class Target {
  window,  ///< sRGB into a framebuffer of the host
  memory   ///< linear light into a float buffer, one of many averaged passes
};

/// Parameters of a pass of a still: sample position in the pixel, and sample points of the lamp and
/// directions of the sky. The default suits a window.
struct Pass {
  int number = 0, count = 1;        ///< index, and number of passes: rotates the lights
  double shift_x = 0, shift_y = 0;  ///< sub-pixel shift, -0.5 .. 0.5
  double map_x = 0, map_y = 0;      ///< shift of shadow maps within a texel, -0.5 .. 0.5
  /// One sample of lamp and sky; stills of Quality::quality use two per pass.
  struct Sample {
    std::array<double, 2> lamp{0, 0};  ///< point on the unit disk of the lamp
    std::optional<Vec3> sky;           ///< unit direction; needed for stills of Quality::quality
    double glass_shadow = 0.5;         ///< glass with less transparency casts a shadow
  };
  std::array<Sample, 2> samples;
  /// Uses the shadows of the last draw: of other views of the same scene with `all_shadows`.
  bool keeps_shadows = false;
  bool all_shadows = false;  ///< shadow maps hold everything, not only what this view shows
};

/// The picture of one Frame; updates cost only what changes.
class SceneView {
 public:
  SceneView(Quality quality, Target target);
  ~SceneView();
  SceneView(const SceneView&) = delete;
  SceneView& operator=(const SceneView&) = delete;

  /// Switches to a frame: items are matched by id, a new pose costs a matrix, a new mesh pointer
  /// new geometry. The camera follows `frame.camera` only if that differs from the last frame's.
  void sync(const Frame& frame);
  /// Takes the poses of moving items and triads from `playback`; an unusable one is ignored.
  void set_playback(std::shared_ptr<const Playback> playback);
  /// Moves everything to its pose at `time` [s].
  void set_time(double time);
  /// Outlines exactly these items.
  void select(const std::vector<std::uint64_t>& ids);

  /// The next `sync` uses the camera of its frame, even if it equals the last frame's.
  void forget_camera();
  [[nodiscard]] OrbitCamera& camera();
  [[nodiscard]] const OrbitCamera& camera() const;
  /// Size of the picture [device px]; refits a fitted view that the user has not moved since.
  void resize(int width, int height);
  /// Shows the studio with a dark floor and wall, and light texts.
  void set_dark(bool on);
  /// Colour of the outlines of selected items; orange at first.
  void set_accent(const Colour& colour);
  /// Fits everything into the picture, keeping the direction.
  void fit();
  /// Selects a named view and fits everything into the picture.
  void look(Camera::View view);
  /// The item at pixel (x, y), counted from the upper left corner; needs no OpenGL context.
  [[nodiscard]] std::optional<Pick> pick(double x_px, double y_px) const;
  /// The same as another camera sees it.
  [[nodiscard]] std::optional<Pick> pick(const OrbitCamera& from, double x_px, double y_px) const;

  /// Lower left corner of the picture in the framebuffer [px]; 0, 0 at first.
  void set_origin(int x_px, int y_px);
  /// Shifts the picture to the right [px]: the two pictures of a stereo pair meet so.
  void set_shift(double x_px);
  /// Enlarges texts over the picture, 0.5 .. 4; 1 at first.
  void set_zoom(double zoom);
  /// Labels over the last picture, and those left out for lack of space.
  [[nodiscard]] std::array<std::size_t, 2> label_counts() const;
  /// Names the window's framebuffer object (0 = the context's own surface). Call before each draw.
  void set_framebuffer(unsigned id);
  /// Draws one picture of the size of the camera's viewport into the current context.
  void draw(const Pass& pass = {});
  /// Linear RGBA of the last draw into memory, rows from bottom to top; empty before.
  [[nodiscard]] const std::vector<float>& pixels() const;
  /// Frees all OpenGL objects; the context must be current. Drawing is impossible afterwards.
  void release();

  /// Appearance requested by the last frame.
  [[nodiscard]] const render::Look& look() const;
  /// Number of active lights defined by the last frame.
  [[nodiscard]] std::size_t light_count() const;
  /// Number of times geometry was built since the start: a measure of the cost of `sync`.
  [[nodiscard]] std::size_t geometry_builds() const;
  /// Box around everything shown [m]: low and high corner.
  [[nodiscard]] std::array<Vec3, 2> bounds() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace robomosp::viewer
