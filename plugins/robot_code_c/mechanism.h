// SPDX-License-Identifier: Apache-2.0
// A mechanism's kinematics and dynamics as expressions of its joint values (layer: plugin).
// Recursive Newton-Euler with the pseudo-inertia of Balafoutis and Patel (Dynamic Analysis of Robot
// Manipulators, 1991), composite bodies, and a factorization that keeps the zeros of branches
// (Featherstone, Rigid Body Dynamics Algorithms, 2008, section 6.5).
#pragma once

#include <span>
#include <string>
#include <vector>

#include <robomosp/sdk/result.h>
#include <robomosp/sdk/robot_model.h>

#include "closed_ending.h"
#include "ending.h"
#include "expression.h"

namespace robomosp::robot_code {

/// Input arrays of the functions.
enum Array : std::uint32_t { kQ = 0, kQd = 1, kQdd = 2, kTau = 3, kArrays = 4 };

/// Most operations of one function: at some 5,000 per second, compilers take too long for more.
inline constexpr std::size_t kMostOperations = 60'000;
/// Most operations for writing the inertia matrix and forward dynamics as expressions only; beyond,
/// their quadratic and cubic parts are loops.
inline constexpr std::size_t kMostWrittenOut = 4'000;

/// A function to be written: outputs as nodes of its graph, or as inputs of its final loops.
struct Function {
  std::string name;                   ///< "inverse_dynamics"
  std::string doc;                    ///< what it computes, a sentence or two
  std::vector<std::uint32_t> arrays;  ///< inputs, in order of its parameters
  std::string output;                 ///< name of the output array
  std::vector<Node> outputs;          ///< results, or inputs of the ending
  Graph graph;
  Ending ending = Ending::none;
  Columns columns;           ///< of the ending
  ClosedLoops loops;         ///< of the ending of a closed mechanism
  double stabilization = 0;  ///< of its accelerations [1/s]

  /// Length of the result.
  [[nodiscard]] std::size_t width() const {
    return ending == Ending::none ? outputs.size() : ending_width(ending, columns);
  }
  /// Results for given inputs, computed as written; not with endings of closed mechanisms.
  [[nodiscard]] std::vector<double> evaluate(std::span<const std::span<const double>> inputs) const;
};

/// Operations (not inputs, constants and loops) that the outputs of a function need.
[[nodiscard]] std::size_t operation_count(const Function& f);

/// Most velocities for which forward dynamics keep the inertia matrix on the stack (2 MB).
inline constexpr std::size_t kMostRows = 500;
/// The same for closed loops, with a dozen matrices on the stack (4 MB): limit of velocities and of
/// the loops' rows.
inline constexpr std::size_t kMostClosedRows = 200;

/// Rejects functions of more than kMostOperations, and endings of more than kMostRows rows.
[[nodiscard]] Result<void> check_size(const Function& f, const RobotModel& model);

/// Number of uses of each node by the outputs and the nodes they need.
[[nodiscard]] std::vector<std::uint32_t> use_counts(const Function& f);

/// Rejects models that violate their contract, and those without a tip.
Result<void> check_model(const RobotModel& model);

/// Poses of all tips in the base frame: 12 numbers each, the rotation matrix row by row, then the
/// origin.
Function forward_kinematics(const RobotModel& model);
/// Geometric Jacobian of the first tip, (v, w) in the base frame: 6 rows of dof() numbers.
Function jacobian(const RobotModel& model);
/// tau of all parts: gravity, inertial, velocity, friction, springs, motors.
Function inverse_dynamics(const RobotModel& model);
/// M(q) with motors, dof() rows of dof() numbers.
Function inertia(const RobotModel& model);
/// Rejects loops that constrain a single rotation, with the row of the rotation vector, by name.
[[nodiscard]] Result<void> check_loops(const RobotModel& model);
/// tau, M and qdd of a mechanism with closed loops, for samples that keep them closed: forces of
/// the motors and their effective inertia. `stabilization` [1/s]: rate at which gaps are closed.
Function closed_inverse_dynamics(const RobotModel& model);
Function closed_inertia(const RobotModel& model);
Result<Function> closed_forward_dynamics(const RobotModel& model, double stabilization);

/// qdd of the tree; the model has no loops. A joint that moves no inertia is an error that names
/// it.
Result<Function> forward_dynamics(const RobotModel& model);

}  // namespace robomosp::robot_code
