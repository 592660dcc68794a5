// SPDX-License-Identifier: GPL-3.0-or-later
// SceneView: draws a Frame with OpenGL into whatever context the host has made current (layer: GUI;
// OSG stays behind the source file). Hosts: OffscreenRenderer, the Qt display widget.
// Belongs to one thread, the one that owns the OpenGL context.
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

/// How much work one picture may cost.
enum class Quality {
  fast,    ///< simple highlights, small shadow map: for interaction on software OpenGL
  quality  ///< physically based highlights, soft shadows: for stills and graphics cards
};

/// What a click in the picture met.
struct Pick {
  std::uint64_t id = 0;  ///< of the item
  std::string name;      ///< of the item
  Vec3 point{};          ///< where, in world coordinates [m]
  double distance = 0;   ///< from the start of the view ray [m]
};

/// Where the pixels go.
enum class Target {
  window,  ///< sRGB into a framebuffer of the host
  memory   ///< linear light into a float buffer, one pass of many that are averaged
};

/// What differs between the passes of a still: where in the pixel it samples, from which points of
/// the lamp and from which directions of the sky it is lit. The default suits a window.
struct Pass {
  int number = 0, count = 1;        ///< 0, 1, ... of how many: turns the lights
  double shift_x = 0, shift_y = 0;  ///< sub-pixel shift, -0.5 .. 0.5
  double map_x = 0, map_y = 0;      ///< shift of shadow maps within a texel, -0.5 .. 0.5
  /// One point of lamp and sky that it is lit from; stills of Quality::quality take two in a pass.
  struct Sample {
    std::array<double, 2> lamp{0, 0};  ///< point on the unit disk of the lamp
    std::optional<Vec3> sky;           ///< unit direction; needed for stills of Quality::quality
    double glass_shadow = 0.5;         ///< glass less clear than this casts a shadow
  };
  std::array<Sample, 2> samples;
};

/// The picture of one Frame that follows changes of it at the least cost.
class SceneView {
 public:
  SceneView(Quality quality, Target target);
  ~SceneView();
  SceneView(const SceneView&) = delete;
  SceneView& operator=(const SceneView&) = delete;

  /// Takes over a frame: items are matched by id, a new pose costs a matrix, a new mesh pointer new
  /// geometry. The camera follows `frame.camera` only when that differs from the last frame's.
  void sync(const Frame& frame);
  /// Takes the poses of moving items and triads from `playback`; an unusable one is ignored.
  void set_playback(std::shared_ptr<const Playback> playback);
  /// Moves everything to its pose at `time` [s].
  void set_time(double time);
  /// Highlights exactly these items.
  void select(const std::vector<std::uint64_t>& ids);

  /// The next `sync` takes the camera of its frame, even if that is the one of the last frame.
  void forget_camera();
  [[nodiscard]] OrbitCamera& camera();
  [[nodiscard]] const OrbitCamera& camera() const;
  /// Size of the picture [device px]; a view that was fitted and not touched since is fitted anew.
  void resize(int width, int height);
  /// Puts everything into the picture, keeping the direction.
  void fit();
  /// Chooses a named view and puts everything into the picture.
  void look(Camera::View view);
  /// The item at pixel (x, y), counted from the upper left corner; needs no OpenGL context.
  [[nodiscard]] std::optional<Pick> pick(double x_px, double y_px) const;

  /// Names the window's framebuffer object (0 = the context's own surface). Call before each draw.
  void set_framebuffer(unsigned id);
  /// Draws one picture of the size of the camera's viewport into the current context.
  void draw(const Pass& pass = {});
  /// Linear RGBA of the last draw into memory, rows from bottom to top; empty before.
  [[nodiscard]] const std::vector<float>& pixels() const;
  /// Frees what OpenGL holds; the context must be current. Nothing can be drawn afterwards.
  void release();

  /// How the last frame wanted to be shown.
  [[nodiscard]] const render::Look& look() const;
  /// How many lights of its own the last frame had that can shine.
  [[nodiscard]] std::size_t light_count() const;
  /// How many times geometry was built since the start: a measure of what `sync` cost.
  [[nodiscard]] std::size_t geometry_builds() const;
  /// Box around everything shown [m]: low and high corner.
  [[nodiscard]] std::array<Vec3, 2> bounds() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace robomosp::viewer
