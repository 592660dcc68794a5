// SPDX-License-Identifier: Apache-2.0
// Interface robomosp.retimer/1: the fastest motion along a given joint path (layer: contract, std
// only).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <robomosp/sdk/params.h>
#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

namespace robomosp {

/// A joint path q(s) on a rising grid of s, and what bounds the motion along it. Tables are
/// row-major, one row a grid point, dof entries a row. [rad or m, s]
struct RetimeProblem {
  std::uint32_t struct_size = sizeof(RetimeProblem);  ///< see plugin.h
  std::size_t dof = 0;
  std::span<const double> s;             ///< grid, at least two entries
  std::span<const double> q, q1, q2;     ///< the path and its derivatives with respect to s
  std::span<const double> velocity;      ///< |qd| of each joint; infinity = none
  std::span<const double> acceleration;  ///< |qdd|; infinity = none
  /// Torques along the path are a s'' + b s'^2 + c; empty tables = no torque limits.
  std::span<const double> torque_a, torque_b, torque_c;
  std::span<const double> torque;       ///< |tau| of each joint [N m or N]; infinity = none
  std::span<const double> rate;         ///< greatest s' at each grid point; empty = none
  double start_rate = 0, end_rate = 0;  ///< s' at the ends
};

/// s' and time on the grid; s'^2 is linear in s between grid points.
struct Retiming {
  std::vector<double> rate, time;  ///< [1/s], [s]
};

/// Interface robomosp.retimer/1.
class Retimer {
 public:
  using Interface = Retimer;
  static constexpr const char* kInterfaceId = "robomosp.retimer/1";
  virtual ~Retimer() = default;
  /// What later versions of the SDK add, by its id (plugin.h); nullptr = not known.
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
  /// A path that cannot be run (a torque limit that gravity alone exceeds, a start rate too great)
  /// is an error that names the place on the path, the joint and by how much. [any thread]
  virtual Result<Retiming> retime(const RetimeProblem&, const Params&, Progress&) const = 0;
};

}  // namespace robomosp
