// SPDX-License-Identifier: Apache-2.0
// Interface robomosp.ik/1: inverse kinematics of many targets in one call
// (layer: contract, std only).
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <robomosp/sdk/params.h>
#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>
#include <robomosp/sdk/robot_model.h>

namespace robomosp {

/// When a pose counts as reached.
struct IkTolerance {
  double position = 1e-9;  ///< [m]
  double rotation = 1e-9;  ///< angle of the rotation left [rad]
};

/// What to solve. Made by the host; may gain fields at the end.
struct IkBatch {
  std::span<const Pose> targets;  ///< base_T_tip, one a sample
  std::span<const double> seeds;  ///< targets.size() * dof, joint-fastest; or dof for all; or empty
  IkTolerance tolerance;
  bool all_solutions = false;  ///< return every solution the solver can tell apart
  bool continuous = false;     ///< samples are one path: start each from the one before
  std::int32_t tip = 0;        ///< index into RobotModel::tips
};

enum class IkStatus : std::int32_t {
  solved = 0,
  out_of_reach = 1,   ///< no configuration comes near enough; q holds the closest found
  joint_limit = 2,    ///< solvable only outside the limits; q holds the closest inside
  not_converged = 3,  ///< the iteration ended without an answer; q holds the closest found
};

/// Answer for one target. An unreachable target is not an error.
struct IkResult {
  IkStatus status = IkStatus::not_converged;
  std::vector<double> q;      ///< solutions one after the other, k * dof, all within limits
  double position_error = 0;  ///< of the first solution [m]
  double rotation_error = 0;  ///< of the first solution [rad]
  std::int32_t iterations = 0;
  std::string detail;  ///< reason in words when not solved; may be empty
};

/// Interface robomosp.ik/1.
class IkSolver {
 public:
  using Interface = IkSolver;
  static constexpr const char* kInterfaceId = "robomosp.ik/1";
  virtual ~IkSolver() = default;
  /// Binds the solver to one mechanism; a mechanism it cannot solve is an error that says why.
  /// The model outlives the solver. [application thread or job]
  virtual Result<void> prepare(const RobotModel& model, const Params& params) = 0;
  /// Solves results.size() == batch.targets.size() targets. [any thread] after prepare.
  virtual Result<void> solve(const IkBatch& batch, std::span<IkResult> results,
                             Progress&) const = 0;
};

}  // namespace robomosp
