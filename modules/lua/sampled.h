// SPDX-License-Identifier: Apache-2.0
// Motions described by a script, sampled once: rates by differences, quintic interpolation between
// the samples (layer: application, lua, internal).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include <robomosp/sdk/trajectory.h>

#include "spatial/pose.h"
#include "spatial/quintic.h"
#include "spatial/rotation.h"

namespace robomosp::lua {

struct SampledMotion {
  double x = 0, v = 0, a = 0, j = 0;
};
/// Quintic Hermite interpolation at u in 0..1 over a step h.
inline SampledMotion hermite(const SampledMotion& s, const SampledMotion& e, double h, double u) {
  const spatial::Quintic piece({s.x, s.v, s.a}, {e.x, e.v, e.a}, h);
  const spatial::Jet m = piece.at(u);
  return {m.v, m.d, m.dd, piece.jerk(u)};
}

// Coefficients of fourth order on equidistant points: central ones inside, one-sided ones for the
// last two points at either end (`x` counted from that end). n >= 6.
template <class At>
double first_difference(const At& x, std::size_t i, std::size_t n, double h) {
  if (i >= 2 && i + 2 < n) return (x(i - 2) - 8 * x(i - 1) + 8 * x(i + 1) - x(i + 2)) / (12 * h);
  const bool at_start = i < 2;
  const auto y = [&](std::size_t k) { return x(at_start ? k : n - 1 - k); };
  const std::size_t k = at_start ? i : n - 1 - i;
  const double slope = k == 0 ? -25 * y(0) + 48 * y(1) - 36 * y(2) + 16 * y(3) - 3 * y(4)
                              : -3 * y(0) - 10 * y(1) + 18 * y(2) - 6 * y(3) + y(4);
  return (at_start ? slope : -slope) / (12 * h);
}
template <class At>
double second_difference(const At& x, std::size_t i, std::size_t n, double h) {
  if (i >= 2 && i + 2 < n)
    return (-x(i - 2) + 16 * x(i - 1) - 30 * x(i) + 16 * x(i + 1) - x(i + 2)) / (12 * h * h);
  const bool at_start = i < 2;
  const auto y = [&](std::size_t k) { return x(at_start ? k : n - 1 - k); };
  const std::size_t k = at_start ? i : n - 1 - i;
  const double bend = k == 0
                          ? 45 * y(0) - 154 * y(1) + 214 * y(2) - 156 * y(3) + 61 * y(4) - 10 * y(5)
                          : 10 * y(0) - 15 * y(1) - 4 * y(2) + 14 * y(3) - 6 * y(4) + y(5);
  return bend / (12 * h * h);
}

/// Values with their first two derivatives.
inline std::vector<SampledMotion> with_rates(const std::vector<double>& values, double h) {
  std::vector<SampledMotion> out(values.size());
  const auto at = [&](std::size_t j) { return values[j]; };
  for (std::size_t i = 0; i < values.size(); ++i)
    out[i] = {values[i], first_difference(at, i, values.size(), h),
              second_difference(at, i, values.size(), h), 0};
  return out;
}
/// Poses `h` apart with their velocities and accelerations.
inline std::vector<PathSample> with_rates(const std::vector<Pose>& poses, double h) {
  const std::size_t n = poses.size();
  std::vector<PathSample> out(n);
  for (std::size_t i = 0; i < n; ++i) {
    out[i].pose = poses[i];
    for (std::size_t k = 0; k < 3; ++k) {
      const auto at = [&](std::size_t j) { return poses[j].p[k]; };
      out[i].velocity[k] = first_difference(at, i, n, h);
      out[i].acceleration[k] = second_difference(at, i, n, h);
      // Orientation as the rotation vector from this sample to its neighbours.
      const auto turned = [&](std::size_t j) {
        return spatial::rotation_difference(poses[i].R, poses[j].R)[k];
      };
      out[i].angular_velocity[k] = first_difference(turned, i, n, h);
      out[i].angular_acceleration[k] = second_difference(turned, i, n, h);
    }
  }
  return out;
}

/// Interpolates at the fraction u in 0..1 between one sample and the next, `h` later.
inline PathSample between(const PathSample& a, const PathSample& b, double h, double u) {
  PathSample out;
  for (std::size_t k = 0; k < 3; ++k) {
    const SampledMotion m = hermite({a.pose.p[k], a.velocity[k], a.acceleration[k]},
                                    {b.pose.p[k], b.velocity[k], b.acceleration[k]}, h, u);
    out.pose.p[k] = m.x;
    out.velocity[k] = m.v;
    out.acceleration[k] = m.a;
  }
  // The turn within one step is small, so its rotation vector may be treated as a position.
  const Vec3 turn = spatial::rotation_difference(a.pose.R, b.pose.R);
  Vec3 part{};
  for (std::size_t k = 0; k < 3; ++k) {
    const SampledMotion m =
        hermite({0, a.angular_velocity[k], a.angular_acceleration[k]},
                {turn[k], b.angular_velocity[k], b.angular_acceleration[k]}, h, u);
    part[k] = m.x;
    out.angular_velocity[k] = m.v;
    out.angular_acceleration[k] = m.a;
  }
  Pose delta, start;
  delta.R = spatial::rotation_exp(part);
  start.R = a.pose.R;
  out.pose.R = spatial::compose(delta, start).R;
  return out;
}

/// The step that contains a position in 0..count - 1 steps.
inline std::size_t step_at(double place, std::size_t samples) {
  return std::min(static_cast<std::size_t>(std::max(place, 0.0)), samples - 2);
}
/// Samples 2 ms apart, within 201..20001.
inline std::size_t sample_count(double duration) {
  return static_cast<std::size_t>(std::clamp(std::ceil(duration / 0.002), 200.0, 20000.0)) + 1;
}

}  // namespace robomosp::lua
