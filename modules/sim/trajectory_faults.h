// SPDX-License-Identifier: Apache-2.0
// Faults of a robot along a trajectory of a world: all of them, not only the first (layer:
// application, sim).
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "collision/collision.h"
#include "sim/simulate.h"

namespace robomosp::sim {

/// State of a sample, in ascending severity.
enum class PathState : std::uint8_t {
  good,
  limit,        ///< a joint exceeds its velocity, acceleration, jerk or torque limit
  collision,    ///< bodies touch
  unreachable,  ///< no joint values within the limits reach the pose
};
[[nodiscard]] std::string_view to_string(PathState);

/// Consecutive samples with the same fault.
struct PathFault {
  PathState kind = PathState::good;
  std::size_t first = 0, last = 0;  ///< samples, from 0
  std::size_t worst = 0;
  std::string why;          ///< of the worst, as the continuation of "sample 37 of 400: "
  std::int32_t joint = -1;  ///< the joint at fault, from 0; -1 = unknown
  double excess = 0;        ///< excess over the limit, distance out of reach, or penetration depth
                            ///< [unit]; 0 = unknown
  std::string unit;
  std::string a, b;  ///< touching bodies
  /// At the robot's configuration before the trajectory; the samples are 0, and `states` excludes
  /// it.
  bool is_start = false;
};

/// A trajectory sampled at `times`.
struct PathCheck {
  std::string robot, trajectory;  ///< names in the world
  std::vector<double> times;      ///< [s]
  std::vector<Pose> poses;        ///< desired world_T_tool of the trajectory
  std::size_t dof = 0;
  std::vector<double> q;  ///< times.size() * dof; the closest found if unreachable
  std::vector<PathState> states;
  std::vector<double> start;       ///< dof; the configuration before the trajectory
  std::vector<PathFault> faults;   ///< by their first sample
  std::vector<std::string> notes;  ///< checks that were not made, a sentence each
  /// The last good sample before the first fault; 0 if there is none.
  [[nodiscard]] std::size_t last_good() const;
};

/// Follows a trajectory by inverse kinematics and continues after failures. Where it is reached,
/// velocities, accelerations, jerks and torques are compared with the joints' limits, and with
/// `collisions` each reached stretch is checked for contact. A trajectory that cannot be built is
/// an error, and so are joint segments that cannot be followed.
[[nodiscard]] Result<PathCheck> check_path(const Simulator&, const Run&, bool collisions,
                                           Progress&);

}  // namespace robomosp::sim
