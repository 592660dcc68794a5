// SPDX-License-Identifier: Apache-2.0
#include "motion/bridge.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "motion/paced_segment.h"
#include "spatial/jet.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"
#include "spatial/vec.h"

namespace robomosp::motion {
namespace {

using spatial::norm;
using spatial::sub;

/// Solves J x = b for the matrix that takes rates of a rotation vector to angular velocities.
Vec3 vector_rates(const Vec3& phi, const Vec3& b) {
  std::array<Vec3, 3> column;
  for (std::size_t k = 0; k < 3; ++k) {
    spatial::JetVector v{spatial::Jet{phi[0]}, spatial::Jet{phi[1]}, spatial::Jet{phi[2]}};
    v[k].d = 1;
    column[k] = spatial::turn_rates(v).velocity;
  }
  const Vec3 yz = spatial::cross(column[1], column[2]);
  const double det = spatial::dot(column[0], yz);
  return {spatial::dot(b, yz) / det, spatial::dot(b, spatial::cross(column[2], column[0])) / det,
          spatial::dot(b, spatial::cross(column[0], column[1])) / det};
}

spatial::JetVector jets_of(const std::array<spatial::Quintic, 3>& of, double share) {
  return {of[0].at(share), of[1].at(share), of[2].at(share)};
}

Vec3 values_of_jets(const spatial::JetVector& v) { return {v[0].v, v[1].v, v[2].v}; }

}  // namespace

Bridge::Bridge(const PathSample& from, const PathSample& to, double duration)
    : duration_(duration) {
  start_.R = from.pose.R;
  const Vec3 phi = spatial::rotation_difference(from.pose.R, to.pose.R);
  const Vec3 rate = vector_rates(phi, to.angular_velocity);
  // The angular acceleration is J phi'' and what the rates alone make.
  spatial::JetVector jet;
  for (std::size_t k = 0; k < 3; ++k) jet[k] = {phi[k], rate[k], 0};
  const Vec3 bend =
      vector_rates(phi, sub(to.angular_acceleration, Vec3(spatial::turn_rates(jet).acceleration)));
  for (std::size_t k = 0; k < 3; ++k) {
    way_[k] = spatial::Quintic({from.pose.p[k], from.velocity[k], from.acceleration[k]},
                               {to.pose.p[k], to.velocity[k], to.acceleration[k]}, duration);
    turn_[k] = spatial::Quintic({0, from.angular_velocity[k], from.angular_acceleration[k]},
                                {phi[k], rate[k], bend[k]}, duration);
  }
}

Result<void> Bridge::measure() {
  RMP_TRY_ASSIGN(length_, length_between(*this, 0, duration_));
  return {};
}

Result<void> Bridge::sample(std::span<const double> times, std::span<PathSample> out) const {
  const double slack = 1e-12 * duration_;
  for (std::size_t i = 0; i < times.size(); ++i) {
    const double x = std::clamp(times[i] / duration_, 0.0, 1.0);
    const spatial::JetVector p = jets_of(way_, x), phi = jets_of(turn_, x);
    PathSample& s = out[i];
    Pose turned;
    turned.R = spatial::rotation_exp(values_of_jets(phi));
    s.pose.R = spatial::compose(turned, start_).R;
    s.pose.p = values_of_jets(p);
    s.velocity = s.acceleration = s.angular_velocity = s.angular_acceleration = {};
    if (times[i] < -slack || times[i] > duration_ + slack) continue;
    s.velocity = {p[0].d, p[1].d, p[2].d};
    s.acceleration = {p[0].dd, p[1].dd, p[2].dd};
    const spatial::TurnRates rates = spatial::turn_rates(phi);
    s.angular_velocity = rates.velocity;
    s.angular_acceleration = rates.acceleration;
  }
  return {};
}

Vec3 Bridge::place(double share) const { return values_of_jets(jets_of(way_, share)); }
Vec3 Bridge::turn(double share) const { return values_of_jets(jets_of(turn_, share)); }
double Bridge::jerk(double share) const {
  return norm({way_[0].jerk(share), way_[1].jerk(share), way_[2].jerk(share)});
}

BridgePeaks peaks_of(const Bridge& bridge) {
  constexpr std::size_t kParts = 64;
  const double h = bridge.duration() / kParts;
  std::array<double, kParts + 1> times;
  std::array<PathSample, kParts + 1> samples;
  for (std::size_t i = 0; i <= kParts; ++i) times[i] = h * static_cast<double>(i);
  (void)bridge.sample(times, samples);  // polynomials do not fail
  std::size_t top = 0;
  // Between samples the greatest lies on the parabola through the highest and its neighbours.
  const auto greatest = [&](const auto& rate) {
    top = 0;
    for (std::size_t i = 1; i <= kParts; ++i)
      if (rate(i) > rate(top)) top = i;
    const double y = rate(top);
    if (top == 0 || top == kParts) return y;
    const double a = rate(top - 1), b = rate(top + 1), bend = a - 2 * y + b;
    return bend < 0 ? y - (b - a) * (b - a) / (8 * bend) : y;
  };
  BridgePeaks out;
  out.speed = greatest([&](std::size_t i) { return norm(samples[i].velocity); });
  out.turning = greatest([&](std::size_t i) { return norm(samples[i].angular_velocity); });
  out.spin = greatest([&](std::size_t i) { return norm(samples[i].angular_acceleration); });
  out.jerk = greatest([&](std::size_t i) {
    return bridge.jerk(static_cast<double>(i) / static_cast<double>(kParts));
  });
  for (std::size_t i = 1; i <= kParts; ++i)
    out.angular_jerk = std::max(
        out.angular_jerk,
        norm(sub(samples[i].angular_acceleration, samples[i - 1].angular_acceleration)) / h);
  out.acceleration = greatest([&](std::size_t i) { return norm(samples[i].acceleration); });
  out.acceleration_time = times[top];
  out.middle = norm(samples[kParts / 2].velocity);
  return out;
}

double outside_hull(const Vec3& p, std::span<const Vec3> points, double tolerance) {
  // Nearest point of the hull as a weighted mean of points, improved by moving weight from the
  // point farthest behind to the one farthest ahead (B. F. Mitchell, V. F. Demyanov, V. N.
  // Malozemov, SIAM J. Control 12, 1974); the farthest ahead gives a bound from below (E. G.
  // Gilbert, 1966).
  if (points.empty()) return 0;
  std::vector<double> weight(points.size());
  std::size_t start = 0;
  for (std::size_t i = 1; i < points.size(); ++i)
    if (spatial::distance(points[i], p) < spatial::distance(points[start], p)) start = i;
  weight[start] = 1;
  Vec3 near = points[start];
  double least = 0;
  constexpr int kSteps = 100;
  for (int step = 0; step < kSteps; ++step) {
    const Vec3 away = sub(p, near);
    const double distance = norm(away);
    if (distance <= tolerance) return 0;
    std::size_t ahead = 0, behind = start;
    double most = -std::numeric_limits<double>::infinity(), fewest = -most;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double along = spatial::dot(away, points[i]);
      if (along > most) most = along, ahead = i;
      if (weight[i] > 0 && along < fewest) fewest = along, behind = i;
    }
    least = std::max(least, (spatial::dot(away, p) - most) / distance);
    if (distance - least <= tolerance || least > 0.99 * distance) return least;
    const Vec3 way = sub(points[ahead], points[behind]);
    const double square = spatial::dot(way, way);
    if (!(square > 0)) return least;
    const double moved = std::clamp(spatial::dot(away, way) / square, 0.0, weight[behind]);
    if (!(moved > 0)) return least;
    weight[behind] -= moved;
    weight[ahead] += moved;
    near = spatial::add(near, spatial::scale(way, moved));
  }
  return least;
}

}  // namespace robomosp::motion
