// SPDX-License-Identifier: Apache-2.0
// Loops at the end of a function of a robot with many joints: the inertia matrix and the solution
// of its equations, which need quadratically and cubically many operations, from inputs of linear
// size (layer: plugin). Composite bodies and M = L^T D L: Featherstone, Rigid Body Dynamics
// Algorithms, 2008, sections 6.2 and 6.5.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <robomosp/sdk/robot_model.h>

namespace robomosp::robot_code {

/// Result of the loops; for mechanisms with closed loops (closed_ending.h) the last three.
enum class Ending : std::uint8_t {
  none,
  inertia,
  accelerations,
  motor_forces,
  motor_inertia,
  closed_accelerations
};
[[nodiscard]] constexpr bool is_closed(Ending e) { return e >= Ending::motor_forces; }
/// True if `<name>_fill_inertia` is called.
[[nodiscard]] constexpr bool fills_inertia(Ending e) {
  return e != Ending::none && e != Ending::motor_forces;
}

/// Joints and the columns of their motion, one per velocity, as tables for the loops.
struct Columns {
  std::vector<std::int32_t> parent;    ///< of each joint; -1 = the base
  std::vector<std::size_t> first;      ///< of each joint its first column, then the column count
  std::vector<std::size_t> velocity;   ///< of each column its row of the matrix
  std::vector<std::size_t> component;  ///< of (force, moment) along each column: 0 to 5
  std::vector<double> ratio;           ///< of each column: its joint's coupling, or 1
  std::vector<double> motor;           ///< of each row: inertia of motors, added to the diagonal

  [[nodiscard]] std::size_t joints() const { return parent.size(); }
  [[nodiscard]] std::size_t columns() const { return velocity.size(); }
  [[nodiscard]] std::size_t rows() const { return motor.size(); }
};
[[nodiscard]] Columns columns_of(const RobotModel& model);

/// Numbers per joint and per column read by the loops: R (row by row) and p of the joint in its
/// parent; force and moment, about the joint's origin and in its axes, that a unit acceleration of
/// the column requires for all later bodies.
inline constexpr std::size_t kPlacementNumbers = 12, kWrenchNumbers = 6;

/// Length of the result: rows() * rows() or rows().
[[nodiscard]] std::size_t ending_width(Ending ending, const Columns& c);

/// Executes the loops, except those for closed mechanisms. `parts`: placements of all joints,
/// wrenches of all columns and, for accelerations, the forces of all rows.
[[nodiscard]] std::vector<double> run_ending(Ending ending, const Columns& c,
                                             std::span<const double> parts);

/// Most rows for computing batches side by side, since their matrices are on the stack.
inline constexpr std::size_t kMostRowsSideBySide = 64;

/// The loops that are called; `<name>_fill_inertia(part, m)` always is.
struct EndingUses {
  bool solve = false;        ///< `<name>_solve(m, x)`
  bool fill_block = false;   ///< `<name>_fill_inertia_block(part, m)`, samples side by side
  bool solve_block = false;  ///< `<name>_solve_block(m, x)`, the same
};
/// C99 of the tables and loops. `lanes`: the macro with the number of samples side by side.
[[nodiscard]] std::string ending_text(const std::string& name, const std::string& lanes,
                                      const Columns& c, const EndingUses& uses);

}  // namespace robomosp::robot_code
