// SPDX-License-Identifier: Apache-2.0
// Interface robomosp.planner/1: a path of the joints from a start to a goal around obstacles
// (layer: contract, std only).
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include <robomosp/sdk/ik.h>
#include <robomosp/sdk/params.h>
#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

namespace robomosp {

/// What to plan. Joint vectors have dof entries [rad or m]. All borrowed for the call.
struct PlanProblem {
  std::uint32_t struct_size = sizeof(PlanProblem);  ///< see plugin.h
  std::size_t dof = 0;
  std::span<const double> lower, upper;  ///< finite: an unlimited turning joint is given two turns
  std::span<const double> weight;        ///< of each joint in distances; > 0
  std::span<const double> start;
  std::span<const double> goals;  ///< one or more joint vectors, row-major; any of them will do
  /// Whether a configuration is free of collision and within what else is asked. [calling thread]
  std::function<bool(std::span<const double> q)> is_free;
  /// Whether the straight joint motion from a to b is. [calling thread]
  std::function<bool(std::span<const double> a, std::span<const double> b)> is_free_between;
  double seconds = 10;     ///< greatest time to compute [s]
  std::uint64_t seed = 1;  ///< of random numbers: the same seed gives the same plan
  /// Distance of a configuration from obstacles; nullptr = not known to the host.
  const ClearanceField* clearance = nullptr;
};

/// Joint vectors row-major, from the start to one of the goals; the straight motions between them
/// are free.
struct Plan {
  std::vector<double> points;
  std::size_t goal = 0;  ///< which goal was reached
};

/// Interface robomosp.planner/1.
class Planner {
 public:
  using Interface = Planner;
  static constexpr const char* kInterfaceId = "robomosp.planner/1";
  virtual ~Planner() = default;
  /// What later versions of the SDK add, by its id (plugin.h); nullptr = not known.
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
  /// A start or goals in collision, and no path found in time, are errors. Cancelled by
  /// its progress. [any thread; the functions are called on the same one]
  virtual Result<Plan> plan(const PlanProblem&, const Params&, Progress&) const = 0;
};

}  // namespace robomosp
