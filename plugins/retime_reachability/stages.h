// SPDX-License-Identifier: Apache-2.0
// What bounds the motion at each grid point of a path, as lines in the plane of the squared rate
// x = s'^2 and the change of rate u = s'' (layer: plugin).
#pragma once

#include <cstddef>
#include <limits>
#include <vector>

#include <robomosp/sdk/retimer.h>

namespace robomosp::retime_reachability {

/// All u between low and high at some x; empty when low > high.
struct Interval {
  double low, high;
};

/// Bounds low[k] <= u - slope[k] x <= high[k] of all rows of one stage, and of x alone.
class Stages {
 public:
  explicit Stages(const RetimeProblem&);

  [[nodiscard]] std::size_t count() const { return count_; }
  /// Greatest x by velocities and what else bounds x alone.
  [[nodiscard]] double most(std::size_t i) const { return most_[i]; }
  /// The u allowed at x at grid point i; the rows as they are at both ends of the step there.
  [[nodiscard]] Interval changes(std::size_t i, double x) const;
  /// The greatest (or least) x at grid point i from which some u leads into `next`; negative =
  /// none.
  [[nodiscard]] double greatest(std::size_t i, const Interval& next) const;
  [[nodiscard]] double least(std::size_t i, const Interval& next) const;
  [[nodiscard]] double step(std::size_t i) const { return step_[i]; }

 private:
  /// The two tightest rows at some x: low + low_slope x <= u <= high + high_slope x.
  struct Tight {
    double low = -std::numeric_limits<double>::infinity();
    double high = std::numeric_limits<double>::infinity();
    double low_slope = 0, high_slope = 0;
  };
  [[nodiscard]] double bound(std::size_t i, const Interval& next, bool is_greatest) const;
  [[nodiscard]] Tight tight(std::size_t i, double x, const Interval& next) const;
  void add(std::size_t i, double a, double b, double c, double limit);

  std::size_t count_ = 0, rows_ = 0;  ///< rows of a stage
  std::vector<double> step_, most_, fewest_;
  std::vector<std::size_t> used_;  ///< rows in use of each stage
  std::vector<double> slope_, low_, high_;
};

}  // namespace robomosp::retime_reachability
