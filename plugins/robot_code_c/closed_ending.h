// SPDX-License-Identifier: Apache-2.0
// C text of what ends a function of a robot with closed loops: forces of the tree carried to the
// motors, and accelerations that keep the loops closed (layer: plugin). The rules are those of
// robotics/loop_motion.h: equal work on every motion Z that the loops allow, J Z = 0 (Y. Nakamura,
// M. Ghodoussi, IEEE Trans. Robotics and Automation 5(3), 1989).
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace robomosp::robot_code {

/// What the loops of a mechanism hold, and which velocities have motors.
struct ClosedLoops {
  std::size_t rows = 0;                      ///< fixed directions
  std::vector<std::size_t> motors, passive;  ///< velocities
};

/// Numbers that the loops take behind those of the tree: J row by row, then the gaps; for
/// accelerations also the drift and the rates.
[[nodiscard]] std::size_t closed_numbers(const ClosedLoops& loops, std::size_t velocities,
                                         bool accelerations);

/// Which functions are called: `<name>_to_motors(loop, tau, sides)` (forces),
/// `<name>_inertia_to_motors(loop, m)` (needs forces, too) and
/// `<name>_closed_accelerations(loop, m, qdd)`.
struct ClosedUses {
  bool forces = false, inertia = false, accelerations = false;
};
/// C99 of these functions and what they share. `stabilization` [1/s]: how fast gaps are closed.
[[nodiscard]] std::string closed_text(const std::string& name, const ClosedLoops& loops,
                                      std::size_t velocities, const ClosedUses& uses,
                                      double stabilization);

}  // namespace robomosp::robot_code
