// SPDX-License-Identifier: Apache-2.0
// What a solver of robomosp.ik/1 may know besides its solutions: the names of its branches
// (layer: contract, std only).
#pragma once

#include <cstdint>
#include <span>

#include <robomosp/sdk/types.h>

namespace robomosp {

/// A choice that distinguishes configurations of one pose: two branches that meet where the
/// arm is singular. Constant data of the solver.
struct IkBranchChoice {
  const char* name = nullptr;      ///< "shoulder"
  const char* positive = nullptr;  ///< word for a measure above 0: "right"; no two words are equal
  const char* negative = nullptr;  ///< word for a measure below 0: "left"
  Room room{};
};

/// What IkSolver::extension(kExtensionId) points to, as `const IkBranches*`, where the solver names
/// its branches. It lives as long as the solver. [any thread] after prepare.
class IkBranches {
 public:
  static constexpr const char* kExtensionId = "robomosp.ik_branches/1";
  virtual ~IkBranches() = default;
  /// What later versions of the SDK add, by its id (plugin.h); nullptr = not known.
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
  /// The choices for one tip (index into RobotModel::tips); empty if its branches have no names.
  [[nodiscard]] virtual std::span<const IkBranchChoice> choices(std::int32_t tip) const = 0;
  /// Of configurations of RobotModel::coordinate_count() numbers one after the other: a number from
  /// -1 to 1 per choice: its sign is the branch, 0 where both meet. The sign changes along a motion
  /// only where the arm passes such a singular configuration. `out` has space for
  /// choices(tip).size() numbers a configuration.
  virtual void measure(std::int32_t tip, std::span<const double> q,
                       std::span<double> out) const = 0;
};

}  // namespace robomosp
