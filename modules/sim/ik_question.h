// SPDX-License-Identifier: Apache-2.0
// Questions to a solver of inverse kinematics: solutions with their branches, what joint limits
// take away, and sentences about both (layer: application, sim). [any thread]
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "robotics/joint_limits.h"
#include "robotics/maker_axes.h"
#include "sim/ik_choice.h"

namespace robomosp::sim {

/// A side for each of some of a solver's choices.
struct BranchWish {
  std::vector<int> ways;  ///< one per choice: 1, -1, 0 = any
  std::string words;      ///< "left up"
  /// True if a configuration is on such a branch, or on the border of its two sides.
  [[nodiscard]] bool is_met(std::span<const double> measures) const;
};

/// A configuration, with the measures of its branch and the joint farthest beyond its limit.
struct IkSolution {
  std::vector<double> q;         ///< [rad or m], coordinate_count() of the robot
  std::vector<double> measures;  ///< one per choice of the solver, from -1 to 1
  robotics::LimitExcess excess;  ///< joint < 0: within the limits
};

/// The robot, its solver, and what is asked of every target.
struct IkQuestion {
  std::shared_ptr<const RobotModel> model;
  std::size_t tip = 0;
  model::ProviderChoice choice;
  Bound<IkSolver> bound;
  std::vector<std::string> tags;  ///< of the solver
  BranchNames names;
  std::optional<BranchWish> wish;
  bool is_ignoring = false;  ///< joint limits
  robotics::MakerAxes axes;
  std::string where;  ///< `robot "arm"`

  [[nodiscard]] bool has_tag(std::string_view tag) const;
  /// A joint beyond its limit at q, and the maker's axis where that is known; "" = none is.
  [[nodiscard]] std::string excess_words(const robotics::LimitExcess&,
                                         std::span<const double> q) const;
  /// What the solver would not use is refused, with those solvers of this robot that do.
  [[nodiscard]] Result<void> refuse_unused(const Registry&, bool has_arm_angle,
                                           bool has_branch) const;
  /// The same solver for the robot without limits of position.
  [[nodiscard]] Result<Bound<IkSolver>> unlimited(const Registry&) const;
};

/// Completes a solver's result: for a solution near a singular configuration (least rate below 1e-3
/// of the greatest), sets the lost direction among the requested parts.
void report_singular(const RobotModel& m, std::size_t tip, std::uint32_t parts, IkResult& result);

/// Why a solver has no solution, a sentence without a full stop.
[[nodiscard]] std::string_view status_sentence(IkStatus);

/// The solutions of one target.
struct IkAnswer {
  IkResult result;  ///< of the solver; detail names the maker's axes
  /// On the wanted branch; the nearest configuration if it is not solved.
  std::vector<IkSolution> found;
  std::vector<IkSolution> beyond;  ///< that limits took away or, ignored, would take away
  std::string limits;  ///< "2 of 8 solutions are beyond the joint limits: ..."; "" = none is
};

/// Solves one target. `batch` has one target (base_T_tip), tolerances, the arm angle and the seed,
/// none or coordinate_count() values. All solutions where `wants_all`, else the first one. An error
/// of code unreachable if none is on the wanted branch; a target that is out of reach is none.
[[nodiscard]] Result<IkAnswer> solve_one(const Registry&, const IkQuestion&, IkBatch batch,
                                         bool wants_all, Progress&);

/// The answer to one of many targets.
struct IkRow {
  IkResult result;        ///< q: coordinate_count() values, zeros if there is no configuration
  bool is_other = false;  ///< solved, but on no branch that was asked for
  bool is_within = true;  ///< with limits ignored: within them
};

/// Solves many targets. `batch` as for solve_one(), with one seed for all or one each, and
/// `continuous` for samples of one path, which then begins on the wanted branch.
[[nodiscard]] Result<std::vector<IkRow>> solve_many(const Registry&, const IkQuestion&,
                                                    IkBatch batch, Progress&);

}  // namespace robomosp::sim
