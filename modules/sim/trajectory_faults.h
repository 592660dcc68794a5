// SPDX-License-Identifier: Apache-2.0
// Where along a trajectory of a world a robot cannot follow, and why: all places, not only the
// first (layer: application, sim).
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "collision/collision.h"
#include "sim/simulate.h"

namespace robomosp::sim {

/// How a sample is met, the worse the later.
enum class PathState : std::uint8_t {
  good,
  limit,        ///< a joint goes beyond its velocity, acceleration, jerk or torque limit
  collision,    ///< bodies touch
  unreachable,  ///< no joint values within the limits bring the tool there
};
[[nodiscard]] std::string_view to_string(PathState);

/// Samples in a row that have the same fault.
struct PathFault {
  PathState kind = PathState::good;
  std::size_t first = 0, last = 0;  ///< samples, from 0
  std::size_t worst = 0;
  std::string why;          ///< of the worst, as it goes on after "sample 37 of 400: "
  std::int32_t joint = -1;  ///< that is at fault, from 0; -1 = none known
  double excess = 0;  ///< beyond the limit, out of reach by, or how deep [unit]; 0 = not known
  std::string unit;
  std::string a, b;  ///< bodies that touch
  /// Where the robot stands before the trajectory; the samples are 0, and `states` do not count it.
  bool is_start = false;
};

/// A trajectory sampled at `times`.
struct PathCheck {
  std::string robot, trajectory;  ///< names in the world
  std::vector<double> times;      ///< [s]
  std::vector<Pose> poses;        ///< world_T_tool as the trajectory wants it
  std::size_t dof = 0;
  std::vector<double> q;  ///< times.size() * dof; where unreachable the closest that was found
  std::vector<PathState> states;
  std::vector<double> start;       ///< dof; where the robot stands before it
  std::vector<PathFault> faults;   ///< by their first sample
  std::vector<std::string> notes;  ///< what was not checked, a sentence each
  /// The last good sample before the first fault; 0 where there is none.
  [[nodiscard]] std::size_t last_good() const;
};

/// Follows a trajectory by inverse kinematics without stopping where it fails. Where it is reached,
/// velocities, accelerations, jerks and torques are compared with the joints' limits, and with
/// `collisions` each stretch that is reached is checked for contact. A trajectory that cannot be
/// built is an error; so is one with joint segments that cannot be followed.
[[nodiscard]] Result<PathCheck> check_path(const Simulator&, const Run&, bool collisions,
                                           Progress&);

}  // namespace robomosp::sim
