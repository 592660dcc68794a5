// SPDX-License-Identifier: GPL-3.0-or-later
// Frame: the immutable description of one picture, and Playback: how it moves (layer: GUI, but free
// of OSG and Qt). The application builds it; the scene draws it on screen or offscreen.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <robomosp/sdk/types.h>

namespace robomosp::viewer {

/// How a surface looks.
struct Appearance {
  Colour colour;            ///< base colour, sRGB components as a designer writes them
  float shininess = 0.35F;  ///< 0 matt .. 1 mirror-like highlight
  float metalness = 0.0F;   ///< 0 paint or plastic .. 1 bare metal
};

/// A mesh at a place. Items are matched between frames by `id`.
struct Item {
  std::uint64_t id = 0;
  std::string name;
  std::shared_ptr<const Mesh> mesh;  ///< compared by pointer: same pointer, same geometry
  Pose pose;                         ///< world_T_item
  Appearance appearance;
  bool selected = false;
};

/// A polyline in the world, such as a trajectory or the trace of a tool.
struct Line {
  std::uint64_t id = 0;
  std::vector<Vec3> points;  ///< world coordinates [m]
  Colour colour{0.95F, 0.45F, 0.10F, 1.0F};
  float width = 2.5F;  ///< pixels in a picture 800 pixels high; grows with the picture
};

/// Red-green-blue axes of a coordinate frame.
struct Triad {
  std::uint64_t id = 0;
  Pose pose;            ///< world_T_frame
  double length = 0.1;  ///< [m]
  std::string label;    ///< drawn at the origin; may be empty
};

/// Where the picture is taken from.
struct Camera {
  /// `isometric` is the three-quarter view from the front right; `front` looks along +y.
  enum class View { isometric, front, back, left, right, top, bottom, custom };
  View view = View::isometric;
  bool perspective = true;
  std::optional<Vec3> eye, target;  ///< for View::custom [m]; z is up
  double zoom = 1.0;                ///< 1 = the scene fits the picture (custom: the given distance)

  friend bool operator==(const Camera&, const Camera&) = default;
};

/// Everything in one picture.
struct Frame {
  std::vector<Item> items;
  std::vector<Line> lines;
  std::vector<Triad> triads;
  Camera camera;
  bool grid = true;
  bool world_axes = true;
  bool feature_edges = true;
  std::string caption;  ///< small text in the lower left corner; may be empty
};

/// How the items and triads of a frame move over time.
struct Playback {
  std::vector<double> times;       ///< [s], increasing
  std::vector<std::uint64_t> ids;  ///< the moving items and triads
  std::vector<Pose> poses;         ///< times.size() * ids.size(), time-major
};

}  // namespace robomosp::viewer
