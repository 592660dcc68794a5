// SPDX-License-Identifier: Apache-2.0
#include "spatial/ramps.h"

#include <algorithm>
#include <cmath>

namespace robomosp::spatial {
namespace {

/// From one speed to another; the acceleration rises and falls with the limits.
void append_ramp(Ramps& out, double v0, double v1, const RampLimits& limits) {
  const double dv = std::fabs(v1 - v0), sign = v1 < v0 ? -1 : 1;
  if (!(dv > 0)) return;
  if (!(limits.j < std::numeric_limits<double>::infinity()))
    return out.append(dv / limits.a, sign * limits.a, 0);
  // The acceleration reaches its limit, or only as much as dv asks for.
  const double top = std::min(limits.a, std::sqrt(dv * limits.j)), rise = top / limits.j;
  out.append(rise, 0, sign * limits.j);
  out.append(std::max(0.0, dv / top - rise), sign * top, 0);
  out.append(rise, sign * top, -sign * limits.j);
}

/// Way of a ramp: it is symmetric about its mean speed.
double ramp_path(double v0, double v1, const RampLimits& limits) {
  return (v0 + v1) / 2 * ramp_time(std::fabs(v1 - v0), limits);
}
double ramps_path(double v0, double v1, double top, const RampLimits& limits) {
  return ramp_path(v0, top, limits) + ramp_path(top, v1, limits);
}

Ramps with_top(double way, double v0, double v1, double top, const RampLimits& limits) {
  Ramps out(0, v0);
  append_ramp(out, v0, top, limits);
  const double cruise = way - ramps_path(v0, v1, top, limits);
  if (top > 0) out.append(std::max(0.0, cruise / top), 0, 0);
  append_ramp(out, top, v1, limits);
  return out;
}

/// Root of a monotone function between low and high, to the last bit or two.
template <class Fn>
double bisect(double low, double high, Fn&& is_above) {
  for (int i = 0; i < 200; ++i) {
    const double middle = low + (high - low) / 2;
    if (middle <= low || middle >= high) break;
    (is_above(middle) ? high : low) = middle;
  }
  return low;
}

}  // namespace

void Ramps::append(double dt, double a, double j) {
  if (!(dt > 0) || count_ == kMost) return;
  pieces_[count_++] = {duration_, {last_.x, last_.v, a, j}};
  last_ = {last_.x + dt * (last_.v + dt * (a / 2 + dt * j / 6)), last_.v + dt * (a + dt * j / 2),
           a + dt * j, j};
  duration_ += dt;
}

Motion1 Ramps::at(double t) const {
  // Times this share of the duration beyond an end are that end: callers reach it by sums of steps.
  const double slack = 1e-12 * duration_;
  if (t < -slack) return {count_ ? pieces_[0].start.x : last_.x, 0, 0, 0};
  if (t > duration_ + slack || !count_) return {last_.x, 0, 0, 0};
  t = std::clamp(t, 0.0, duration_);
  std::size_t k = count_ - 1;
  while (k > 0 && t < pieces_[k].from) --k;
  const Motion1& s = pieces_[k].start;
  const double d = t - pieces_[k].from;
  return {s.x + d * (s.v + d * (s.a / 2 + d * s.j / 6)), s.v + d * (s.a + d * s.j / 2),
          s.a + d * s.j, s.j};
}

double ramp_time(double dv, const RampLimits& limits) {
  if (!(limits.j < std::numeric_limits<double>::infinity())) return dv / limits.a;
  const double top = std::min(limits.a, std::sqrt(dv * limits.j));
  return top > 0 ? dv / top + top / limits.j : 0;
}

double least_way(double v0, double v1, const RampLimits& limits) {
  return ramp_path(v0, v1, limits);
}

std::optional<Ramps> fastest_ramps(double way, double v0, double v1, const RampLimits& limits) {
  const double least = std::max(v0, v1);
  const auto is_too_long = [&](double top) { return ramps_path(v0, v1, top, limits) > way; };
  double top = limits.v;
  if (is_too_long(top)) {
    // A way that is exactly enough may come out a rounding short.
    if (ramps_path(v0, v1, least, limits) > way * (1 + 1e-12)) return {};
    top = is_too_long(least) ? least : bisect(least, limits.v, is_too_long);
  }
  return with_top(way, v0, v1, top, limits);
}

std::optional<Ramps> timed_ramps(double way, double v0, double v1, const RampLimits& limits,
                                 double duration) {
  const auto fastest = fastest_ramps(way, v0, v1, limits);
  if (!fastest || fastest->duration() > duration * (1 + 1e-12)) return {};
  // The slower in between, the later: down to a stop, if the way is long enough for that.
  const auto time_of = [&](double top) {
    const double cruise = way - ramps_path(v0, v1, top, limits);
    // Too fast for the way, or too little room to slow down so far.
    if (cruise < 0) return top < std::min(v0, v1) ? std::numeric_limits<double>::infinity() : 0.0;
    return ramp_time(std::fabs(top - v0), limits) + cruise / top +
           ramp_time(std::fabs(top - v1), limits);
  };
  double high = limits.v;
  if (ramps_path(v0, v1, high, limits) > way)
    high = bisect(std::max(v0, v1), limits.v,
                  [&](double top) { return ramps_path(v0, v1, top, limits) > way; });
  const double top = bisect(0, high, [&](double v) { return time_of(v) <= duration; });
  Ramps out = with_top(way, v0, v1, top, limits);
  if (std::fabs(out.duration() - duration) > 1e-9 * duration ||
      std::fabs(out.end().x - way) > 1e-9 * way)
    return {};
  return out;
}

}  // namespace robomosp::spatial
