// SPDX-License-Identifier: Apache-2.0
// The closed form of a 6R arm, recognised from its joint axes, and its constants (layer: plugin).
#pragma once

#include <array>
#include <string>

#include <robomosp/sdk/result.h>

#include "spatial/serial_arm.h"

namespace robomosp::ik_spherical_wrist {

/// Axes count as parallel or perpendicular below this sine or cosine of their angle, and as
/// intersecting below this distance per arm length.
inline constexpr double kSame = 1e-9;

enum class Form {
  two_parallel,    ///< axes 4, 5, 6 meet at right angles, 2 and 3 are parallel: one loop of lanes
  three_parallel,  ///< axes 2, 3, 4 are parallel, 5 and 6 meet, right angles: one loop of lanes
  general          ///< axes 4, 5, 6 meet: a quartic for joint 3 (Pieper 1968)
};

/// Constants of the two forms with parallel axes. Frames: `base` has z along axis 1, its origin on
/// it, and axis 2 in its y-z plane; the *plane* has z along axis 2 and x along the base's x.
struct ParallelArm {
  std::array<double, 9> base_R{};  ///< rows: x, y, z of frame `base` in the robot's base
  Vec3 origin{};
  double sin_tilt = 1, cos_tilt = 0;    ///< of the angle between axes 1 and 2
  double offset = 0;                    ///< of the wrist point along axis 2 [m]
  double at_x = 0, at_y = 0;            ///< axis 2 in the plane [m]
  double l2x = 0, l2y = 0;              ///< axis 2 to axis 3 at q = 0 [m]
  double l3x = 0, l3y = 0;              ///< axis 3 to the wrist point, or to axis 4 [m]
  double l4x = 0, l4y = 0;              ///< three parallel axes: axis 4 to the wrist point [m]
  double sign3 = 1, sign4 = 1;          ///< -1 where the axis points against axis 2
  std::array<double, 9> wrist_plane{};  ///< plane to wrist frame (z axis 4, y axis 5), row-major
  std::array<double, 9> tip_wrist{};    ///< wrist frame at q = 0 in the tip, row-major
  double bend = 0;                      ///< angle from axis 4 to axis 6 about axis 5 at q = 0 [rad]
  double reach = 1, length2 = 0, length3 = 0;  ///< arm length, |l2|, |l3| [m]
  bool three = false;
};

struct Family {
  Form form = Form::general;
  spatial::SerialArm arm;
  Vec3 wrist{};      ///< intersection of the wrist axes at q = 0, in the base [m]
  Vec3 tip_wrist{};  ///< the same point in the tip frame [m]
  ParallelArm lanes;
  bool right_wrist = false;  ///< axis 5 is perpendicular to axes 4 and 6
  bool names_arm = false;    ///< shoulder and elbow have signs: axes 2 and 3 are parallel
};

/// Recognises the arm of one tip; an error is one sentence with the violated condition.
[[nodiscard]] Result<Family> recognise(const RobotModel& model, std::size_t tip);

}  // namespace robomosp::ik_spherical_wrist
