// SPDX-License-Identifier: Apache-2.0
// Selection of the inverse kinematics solver for a robot without an explicit one, solvers that
// support an argument, and the names of branches (layer: application). [any thread]
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/ik_branches.h>

#include "sim/simulate.h"

namespace robomosp::sim {

/// The solver selected for a robot without an explicit one.
struct AutomaticIk {
  std::string provider;
  bool is_closed_form = false;
  /// Reasons why the program's closed forms for this number of joints do not fit, a sentence each.
  std::vector<std::string> refusals;
};

/// The first shipped closed form that supports every tip; if there is none, or if the program's
/// default was changed, the default. Not attempted for robots of more than 64 moving joints.
Result<AutomaticIk> automatic_ik(const Registry&, const RobotModel&);

/// The enabled solvers with a tag that support this robot.
std::vector<std::string> ik_solvers_with(const Registry&, const std::shared_ptr<const RobotModel>&,
                                         std::string_view tag);

/// The branches of one tip as named by a solver; without choices if it names none.
class BranchNames {
 public:
  BranchNames() = default;
  BranchNames(const Bound<IkSolver>& ik, std::int32_t tip);
  [[nodiscard]] bool empty() const { return choices_.empty(); }
  [[nodiscard]] std::span<const IkBranchChoice> choices() const { return choices_; }
  /// One number per choice and configuration, from -1 to 1; a plugin's NaN becomes 0.
  [[nodiscard]] std::vector<double> measure(std::span<const double> q) const;
  /// STATUS of programs for one configuration: 1 the shoulder, 2 the elbow, 4 the wrist, set for
  /// the second side; further choices follow. For an arm with a spherical wrist all three are
  /// determined geometrically (robotics::arm_status: behind, below, flipped), not by the solver's
  /// names, which depend on the direction of its axes. `known`: the bits that apply to the robot.
  [[nodiscard]] std::uint32_t status(std::span<const double> q, std::uint32_t& known) const;
  /// Words for the bits of status(): "front or behind, elbow up or down, no flip or flip".
  [[nodiscard]] std::string status_words() const;
  /// A configuration in terms of STATUS: "STATUS 4 (in front, elbow up, hand up)"; for other arms
  /// with the names of the solver's choices.
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

/// A measure below this is at the border between the two sides of a choice.
inline constexpr double kBranchesMeet = 1e-6;

/// A place where a path of configurations changes to another branch.
struct BranchChange {
  std::size_t at = 0;      ///< the first sample on the new branch
  std::size_t before = 0;  ///< the last sample before it that is not singular
  std::string from, to;    ///< names of the branches
};
/// The change for messages: "STATUS 0 (in front, elbow up, hand down) to STATUS 4 (...)", or the
/// solver's names of the branches if both have the same STATUS. `q`: the path of `change`.
[[nodiscard]] std::string configuration_change(const BranchNames&, std::span<const double> q,
                                               const BranchChange& change);
/// `q`: configurations one after the other. Samples at the border between two sides of a choice
/// count as the previous side. At most `most`.
std::vector<BranchChange> branch_changes(const BranchNames&, std::span<const double> q,
                                         std::size_t most);

}  // namespace robomosp::sim
