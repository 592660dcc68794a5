// SPDX-License-Identifier: Apache-2.0
#include "stages.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace robomosp::retime_reachability {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kFar = 1e12;  ///< an x that nothing bounds
constexpr double kRounding = 1e-13;

}  // namespace

Stages::Stages(const RetimeProblem& p) : count_(p.s.size()) {
  const std::size_t n = p.dof;
  const bool has_torques = !p.torque_a.empty();
  rows_ = (has_torques ? 4 : 2) * n;
  step_.assign(count_, 0.0);
  most_.assign(count_, kInfinity);
  fewest_.assign(count_, 0.0);
  used_.assign(count_, 0);
  slope_.resize(count_ * rows_);
  low_.resize(count_ * rows_);
  high_.resize(count_ * rows_);
  for (std::size_t i = 0; i < count_; ++i) {
    if (i + 1 < count_) step_[i] = p.s[i + 1] - p.s[i];
    double rate = p.rate.empty() ? kInfinity : p.rate[i];
    for (std::size_t j = 0; j < n; ++j) {
      const double slope = std::fabs(p.q1[i * n + j]);
      if (slope > 0) rate = std::min(rate, p.velocity[j] / slope);
    }
    most_[i] = rate * rate;
    for (std::size_t j = 0; j < n; ++j) {
      const std::size_t k = i * n + j;
      add(i, p.q1[k], p.q2[k], 0, p.acceleration[j]);
      if (has_torques) add(i, p.torque_a[k], p.torque_b[k], p.torque_c[k], p.torque[j]);
      if (i + 1 == count_) continue;
      // The same rows at the end of the step, where the squared rate is x + 2 step u (Pham and
      // Pham, A new approach to time-optimal path parameterization based on reachability analysis,
      // IEEE T-RO 2018, the interpolation scheme).
      const std::size_t l = k + n;
      const double h = 2 * step_[i];
      add(i, p.q1[l] + h * p.q2[l], p.q2[l], 0, p.acceleration[j]);
      if (has_torques)
        add(i, p.torque_a[l] + h * p.torque_b[l], p.torque_b[l], p.torque_c[l], p.torque[j]);
    }
  }
}

/// |a u + b x + c| <= limit.
void Stages::add(std::size_t i, double a, double b, double c, double limit) {
  if (!(limit < kInfinity)) return;
  const double low = -limit - c, high = limit - c;
  if (a == 0) {
    if (b == 0) {
      if (low > 0 || high < 0) most_[i] = -1;
      return;
    }
    most_[i] = std::min(most_[i], std::max(low / b, high / b));
    fewest_[i] = std::max(fewest_[i], std::min(low / b, high / b));
    return;
  }
  const std::size_t row = i * rows_ + used_[i]++;
  slope_[row] = -b / a;
  low_[row] = std::min(low / a, high / a);
  high_[row] = std::max(low / a, high / a);
}

Stages::Tight Stages::tight(std::size_t i, double x, const Interval& next) const {
  const double *slope = slope_.data() + i * rows_, *low = low_.data() + i * rows_,
               *high = high_.data() + i * rows_;
  const double h = 2 * step_[i];
  Tight t;
  double lowest = -kInfinity, highest = kInfinity;  // at x
  if (h > 0) {
    t = {next.low / h, next.high / h, -1 / h, -1 / h};
    lowest = t.low - x / h, highest = t.high - x / h;
  }
  for (std::size_t k = 0; k < used_[i]; ++k) {
    const double along = slope[k] * x, l = low[k] + along, u = high[k] + along;
    if (l > lowest) lowest = l, t.low = low[k], t.low_slope = slope[k];
    if (u < highest) highest = u, t.high = high[k], t.high_slope = slope[k];
  }
  return t;
}

Interval Stages::changes(std::size_t i, double x) const {
  const Tight t = tight(i, x, {-kInfinity, kInfinity});
  return {t.low + t.low_slope * x, t.high + t.high_slope * x};
}

// The room high - low is a concave function of x, of straight pieces: the lines of the tight rows
// at x meet at or beyond its root, so that the way there from outside is monotone and ends after as
// many steps as there are pieces on it.
double Stages::bound(std::size_t i, const Interval& next, bool is_greatest) const {
  const double least = fewest_[i], most = std::min(most_[i], kFar);
  if (!(least <= most)) return -1;
  double x = is_greatest ? most : least;
  for (std::size_t k = 0; k <= 2 * used_[i] + 4; ++k) {
    const Tight t = tight(i, x, next);
    const double low = t.low_slope * x, high = t.high_slope * x;
    const double room = t.high + high - (t.low + low), slope = t.high_slope - t.low_slope;
    if (room >=
        -kRounding * (std::fabs(t.high) + std::fabs(high) + std::fabs(t.low) + std::fabs(low)))
      return x;
    if (is_greatest ? !(slope < 0) : !(slope > 0)) return -1;
    const double to = (t.low - t.high) / slope;
    if (is_greatest ? to >= x : to <= x) return x;  // as near as rounding lets it come
    if (!(to >= least && to <= most)) return -1;
    x = to;
  }
  return x;
}

double Stages::greatest(std::size_t i, const Interval& next) const { return bound(i, next, true); }
double Stages::least(std::size_t i, const Interval& next) const { return bound(i, next, false); }

}  // namespace robomosp::retime_reachability
