// SPDX-License-Identifier: Apache-2.0
// Which solver of inverse kinematics serves a robot that names none, which ones take an argument,
// and the names of branches (layer: application). [any thread]
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/ik_branches.h>

#include "sim/simulate.h"

namespace robomosp::sim {

/// The solver of a robot that names none.
struct AutomaticIk {
  std::string provider;
  bool is_closed_form = false;
  /// Why the program's closed forms for as many joints do not serve it, a sentence each.
  std::vector<std::string> refusals;
};

/// The first closed form that came with the program and serves every tip; where there is none, or
/// where another default was chosen than the program's own, the default. Robots of more than 64
/// moving joints are not looked at.
Result<AutomaticIk> automatic_ik(const Registry&, const RobotModel&);

/// The enabled solvers with a tag that serve this robot.
std::vector<std::string> ik_solvers_with(const Registry&, const std::shared_ptr<const RobotModel>&,
                                         std::string_view tag);

/// What of the branches of one tip a solver names; without choices where it names none.
class BranchNames {
 public:
  BranchNames() = default;
  BranchNames(const Bound<IkSolver>& ik, std::int32_t tip);
  [[nodiscard]] bool empty() const { return choices_.empty(); }
  [[nodiscard]] std::span<const IkBranchChoice> choices() const { return choices_; }
  /// One number a choice and configuration, from -1 to 1; a plugin's NaN is 0.
  [[nodiscard]] std::vector<double> measure(std::span<const double> q) const;
  /// STATUS of programs of one configuration: 1 the shoulder, 2 the elbow, 4 the wrist, set where
  /// it is the second way; choices of other names follow. Of an arm with a spherical wrist all
  /// three are geometry (robotics::arm_status: behind, below, flipped), not the solver's names,
  /// which depend on the sense of its axes. `known`: the bits that the robot has.
  [[nodiscard]] std::uint32_t status(std::span<const double> q, std::uint32_t& known) const;
  /// Words for the bits of status(): "front or behind, elbow up or down, no flip or flip".
  [[nodiscard]] std::string status_words() const;
  /// A configuration in the terms of STATUS: "STATUS 4 (in front, elbow up, hand up)"; of arms
  /// whose STATUS is not geometry with the names of the solver's choices.
  [[nodiscard]] std::string configuration(std::span<const double> q) const;
  /// "left up no flip".
  [[nodiscard]] std::string name(std::span<const double> measures) const;
  /// All words: "right or left, up or down, no flip or flip".
  [[nodiscard]] std::string words() const;

 private:
  Bound<IkSolver> ik_;  ///< keeps the solver alive
  std::int32_t tip_ = 0;
  const IkBranches* branches_ = nullptr;
  std::vector<IkBranchChoice> choices_;
};

/// Below this a measure counts as the place where both ways of a choice meet.
inline constexpr double kBranchesMeet = 1e-6;

/// Where a path of configurations goes over to another branch.
struct BranchChange {
  std::size_t at = 0;      ///< the first sample on the new branch
  std::size_t before = 0;  ///< the last sample before it that is not singular
  std::string from, to;    ///< names of the branches
};
/// The change for messages: "STATUS 0 (in front, elbow up, hand down) to STATUS 4 (...)", or the
/// solver's names of the branches if both have the same STATUS. `q`: the path of `change`.
[[nodiscard]] std::string configuration_change(const BranchNames&, std::span<const double> q,
                                               const BranchChange& change);
/// `q`: configurations one after the other. Samples in which both ways of a choice meet count as
/// the way before. At most `most`.
std::vector<BranchChange> branch_changes(const BranchNames&, std::span<const double> q,
                                         std::size_t most);

}  // namespace robomosp::sim
