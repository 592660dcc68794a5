// SPDX-License-Identifier: Apache-2.0
// Interface robomosp.ik/1: inverse kinematics of many targets in one call
// (layer: contract, std only).
#pragma once

#include <array>
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

/// What of a target counts, to be summed by `|`; directions are the target's own axes.
enum IkParts : std::uint32_t {
  kIkX = 1,
  kIkY = 2,
  kIkZ = 4,
  kIkRotX = 8,
  kIkRotY = 16,
  kIkRotZ = 32,
  kIkPosition = 7,
  kIkRotation = 56,
  kIkAxis = 24,  ///< the direction of the tip's z axis
  kIkPose = 63,
};

/// One of several aims that a configuration meets at once.
struct IkGoal {
  std::int32_t tip = 0;  ///< index into RobotModel::tips
  std::uint32_t parts = kIkPose;
  double weight = 1;  ///< against the other goals, where not all can be met [> 0]
};

/// What a redundant mechanism does with its freedom.
enum class IkObjective : std::int32_t {
  none = 0,            ///< stay near the seed
  centre = 1,          ///< joints near the middle of their limits
  manipulability = 2,  ///< far from singular
  limits = 3,          ///< away from limits that are near
  clearance = 4,       ///< away from obstacles (IkBatch::clearance)
};

/// How far a configuration is from its obstacles. [any thread]
class ClearanceField {
 public:
  virtual ~ClearanceField() = default;
  /// What later versions of the SDK add, by its id (plugin.h); nullptr = not known.
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
  /// Least distance [m] and its gradient with respect to the dof() velocities [m/rad or 1].
  virtual double distance(std::span<const double> q, std::span<double> gradient) const = 0;
};

/// What to solve. Made by the host; may gain fields at the end. A configuration has
/// RobotModel::coordinate_count() numbers.
struct IkBatch {
  std::uint32_t struct_size = sizeof(IkBatch);  ///< see plugin.h
  std::span<const Pose> targets;  ///< base_T_tip, one a sample; one a goal and sample, goal-fastest
  std::span<const double> seeds;  ///< one configuration a sample; or one for all; or empty
  IkTolerance tolerance;
  bool all_solutions = false;     ///< return every solution the solver can distinguish
  bool continuous = false;        ///< samples are one path: start each from the one before
  std::int32_t tip = 0;           ///< index into RobotModel::tips, when there are no goals
  std::span<const IkGoal> goals;  ///< empty = the whole pose of `tip`
  IkObjective objective = IkObjective::none;
  const ClearanceField* clearance = nullptr;
  /// The redundancy parameter of solvers with the tag "arm_angle" (elbow angle) [rad]: one a
  /// sample, one for all, or empty = the solver's choice.
  std::span<const double> arm_angles;

  [[nodiscard]] std::size_t samples() const {
    return goals.empty() ? targets.size() : targets.size() / goals.size();
  }
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
  std::vector<double> q;      ///< configurations one after the other, all within limits
  double position_error = 0;  ///< of the first solution [m]
  double rotation_error = 0;  ///< of the first solution [rad]
  std::int32_t iterations = 0;
  std::string detail;                ///< reason as text when not solved; may be empty
  double shortfall = 0;              ///< out of reach by this much at least [m]; 0 = not known
  std::int32_t limiting_joint = -1;  ///< the joint that prevents it by its limit; -1 = none known
  /// Unit twist (v, w) in the base frame that the tip has lost at q, when q is singular; else 0.
  std::array<double, 6> lost_direction{};
  Room room{};
};

/// Interface robomosp.ik/1.
class IkSolver {
 public:
  using Interface = IkSolver;
  static constexpr const char* kInterfaceId = "robomosp.ik/1";
  virtual ~IkSolver() = default;
  /// What later versions of the SDK add, by its id (plugin.h); nullptr = not known.
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
  /// Binds the solver to one mechanism; a mechanism it cannot solve is an error with the reason.
  /// The model outlives the solver. [application thread or job]
  virtual Result<void> prepare(const RobotModel& model, const Params& params) = 0;
  /// Solves results.size() == batch.samples() targets; a goal or objective that it cannot serve is
  /// an error of code unsupported. [any thread] after prepare.
  virtual Result<void> solve(const IkBatch& batch, std::span<IkResult> results,
                             Progress&) const = 0;
};

}  // namespace robomosp
