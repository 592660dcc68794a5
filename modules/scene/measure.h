// SPDX-License-Identifier: Apache-2.0
// Measuring: bodies, faces, edges, corners and frames of what a frame shows, and distances and
// angles between them (layer: application, scene). [any thread]
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

#include "evaluation/derived.h"
#include "scene/frame.h"
#include "scene/origin.h"

namespace robomosp::scene {

/// What a measurement takes at one of its ends.
enum class MeasuredAs : std::uint8_t {
  point,   ///< the place itself
  corner,  ///< the corner of a body nearest to the place
  edge,    ///< its nearest edge
  face,    ///< its nearest face
  body,    ///< its whole surface
  frame,   ///< the frame of a member, a link or a base
  tool,    ///< the tool frame of a robot
};

/// One end of a measurement, as it is asked for.
struct MeasuredPlace {
  MeasuredAs as = MeasuredAs::point;
  /// A member, link or part: "table", "arm.elbow", "table.leg"; of a record that is no world
  /// without the member's name. "" = all that is shown.
  std::string body;
  std::optional<Vec3> place;  ///< in the frame of the record that is shown [m]
};

/// What was found there, in the frame of the record that is shown.
struct MeasuredFeature {
  enum class Kind : std::uint8_t {
    point,
    corner,
    line,
    circle,
    curve,
    plane,
    cylinder,
    cone,
    sphere,
    torus,
    surface,  ///< any other face
    body,
    frame,
  };
  Kind kind = Kind::point;
  std::string body;            ///< "arm.elbow"; "" of a point
  Vec3 point{};                ///< as CsgFeature::point; of a body, surface or curve: none
  Vec3 direction{};            ///< unit length; zero if it has none
  double radius = 0;           ///< [m]; 0 if it has none
  double length = 0;           ///< of an edge [m]
  double area = 0;             ///< of a face [m^2]
  double angle = 0;            ///< that the arc of a circle covers [rad]
  bool is_inward = false;      ///< the wall of a hole
  bool is_of_mesh = false;     ///< found in the triangles, since no engine knows the shape
  double bound = 0;            ///< greatest distance between its `pieces` and the exact shape [m]
  std::array<Vec3, 2> ends{};  ///< of an edge that is not closed; else equal
  std::optional<Pose> pose{};  ///< of a frame
  std::vector<std::array<Vec3, 3>>
      pieces{};  ///< triangles; sides of edges and points repeat a corner

  [[nodiscard]] bool is_plane() const { return kind == Kind::plane; }
  [[nodiscard]] bool has_axis() const {
    return kind == Kind::line || kind == Kind::circle || kind == Kind::cylinder ||
           kind == Kind::cone || kind == Kind::torus;
  }
  /// It has one place that is known exactly: a point, corner, centre or origin.
  [[nodiscard]] bool has_centre() const {
    return kind == Kind::point || kind == Kind::corner || kind == Kind::circle ||
           kind == Kind::sphere || kind == Kind::torus || kind == Kind::frame;
  }
};
[[nodiscard]] std::string_view word_of(MeasuredFeature::Kind kind);

/// The body that an origin of a pick is in, as MeasuredPlace::body takes it.
[[nodiscard]] std::string body_of(const Origin& origin);

/// Finds one end of a measurement. Shapes are those of the solids' engine; where it knows none, and
/// for generated and imported bodies, those of the triangles. `path` names the argument in errors.
[[nodiscard]] Result<MeasuredFeature> find_feature(const Frame&, evaluation::Derived&,
                                                   const MeasuredPlace&, std::string_view path,
                                                   Progress&);

/// From one feature to another.
struct Measurement {
  double distance = 0;  ///< least distance; 0 where they meet [m]
  Vec3 from{}, to{};    ///< the nearest points [m]
  double bound = 0;     ///< greatest error of the distance [m]
  /// Between two directions: axes or planes 0 to 90 degrees; of two frames the angle of the
  /// rotation between them [rad].
  std::optional<double> angle;
  std::optional<double> axis_distance;   ///< of two endless axes, or of an axis and a centre [m]
  std::optional<double> plane_distance;  ///< of a plane and what is parallel to it, or a centre [m]
  std::optional<double> centre_distance;  ///< of two centres [m]
};
[[nodiscard]] Result<Measurement> measure(const MeasuredFeature& from, const MeasuredFeature& to,
                                          Progress&);

}  // namespace robomosp::scene
