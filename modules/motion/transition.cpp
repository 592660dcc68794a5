// SPDX-License-Identifier: Apache-2.0
#include "motion/transition.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>

#include "kernel/text.h"
#include "spatial/jet.h"
#include "spatial/pose.h"
#include "spatial/quintic.h"
#include "spatial/rotation.h"
#include "spatial/vec.h"

namespace robomosp::motion {
namespace {

using spatial::add;
using spatial::norm;
using spatial::scale;
using spatial::sub;

/// Of a neighbour: how much of its time a corner may take at most.
constexpr double kMostCut = 0.45;
/// Without speeds to go by.
constexpr double kSpeed = 0.1;         ///< [m/s]
constexpr double kAngularSpeed = 0.5;  ///< [rad/s]

Result<PathSample> sample_at(const Segment& s, double t) {
  PathSample out;
  RMP_TRY(s.sample({&t, 1}, {&out, 1}));
  return out;
}

/// Length of the tool's path between two times, by Simpson's rule.
Result<double> length_between(const Segment& s, double from, double to) {
  constexpr std::size_t kIntervals = 256;
  std::vector<double> times(kIntervals + 1);
  for (std::size_t i = 0; i <= kIntervals; ++i)
    times[i] = from + (to - from) * static_cast<double>(i) / kIntervals;
  std::vector<PathSample> out(times.size());
  RMP_TRY(s.sample(times, out));
  double sum = 0;
  for (std::size_t i = 0; i <= kIntervals; ++i)
    sum += (i == 0 || i == kIntervals ? 1 : i % 2 ? 4 : 2) * norm(out[i].velocity);
  return sum * (to - from) / (3 * kIntervals);
}

/// A part of a segment.
class Trimmed final : public Segment {
 public:
  static Result<std::shared_ptr<const Segment>> of(std::shared_ptr<const Segment> segment,
                                                   double from, double to) {
    RMP_TRY_ASSIGN(const double length, length_between(*segment, from, to));
    return std::shared_ptr<const Segment>(new Trimmed(std::move(segment), from, to, length));
  }
  [[nodiscard]] double duration() const override { return to_ - from_; }
  [[nodiscard]] double length() const override { return length_; }
  Result<void> sample(std::span<const double> times, std::span<PathSample> out) const override {
    const double slack = 1e-12 * duration();
    std::array<double, 64> inner;
    for (std::size_t first = 0; first < times.size(); first += inner.size()) {
      const std::size_t n = std::min(inner.size(), times.size() - first);
      for (std::size_t i = 0; i < n; ++i)
        inner[i] = from_ + std::clamp(times[first + i], 0.0, duration());
      const auto chunk = out.subspan(first, n);
      RMP_TRY(segment_->sample(std::span<const double>(inner).first(n), chunk));
      for (std::size_t i = 0; i < n; ++i)
        if (times[first + i] < -slack || times[first + i] > duration() + slack)
          chunk[i].velocity = chunk[i].acceleration = chunk[i].angular_velocity =
              chunk[i].angular_acceleration = {};
    }
    return {};
  }

 private:
  Trimmed(std::shared_ptr<const Segment> segment, double from, double to, double length)
      : segment_(std::move(segment)), from_(from), to_(to), length_(length) {}
  std::shared_ptr<const Segment> segment_;
  double from_, to_, length_;
};

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

/// From one state of the tool to another in a given time: polynomials of fifth degree for the
/// position and for the rotation vector from the first orientation.
class Bridge final : public Segment {
 public:
  Bridge(const PathSample& from, const PathSample& to, double duration) : duration_(duration) {
    start_.R = from.pose.R;
    const Vec3 phi = spatial::rotation_difference(from.pose.R, to.pose.R);
    const Vec3 rate = vector_rates(phi, to.angular_velocity);
    // The angular acceleration is J phi'' and what the rates alone make.
    spatial::JetVector jet;
    for (std::size_t k = 0; k < 3; ++k) jet[k] = {phi[k], rate[k], 0};
    const Vec3 bend = vector_rates(
        phi, sub(to.angular_acceleration, Vec3(spatial::turn_rates(jet).acceleration)));
    for (std::size_t k = 0; k < 3; ++k) {
      way_[k] = spatial::Quintic({from.pose.p[k], from.velocity[k], from.acceleration[k]},
                                 {to.pose.p[k], to.velocity[k], to.acceleration[k]}, duration);
      turn_[k] = spatial::Quintic({0, from.angular_velocity[k], from.angular_acceleration[k]},
                                  {phi[k], rate[k], bend[k]}, duration);
    }
  }
  Result<void> measure() {
    RMP_TRY_ASSIGN(length_, length_between(*this, 0, duration_));
    return {};
  }
  [[nodiscard]] double duration() const override { return duration_; }
  [[nodiscard]] double length() const override { return length_; }
  Result<void> sample(std::span<const double> times, std::span<PathSample> out) const override {
    const double slack = 1e-12 * duration_;
    for (std::size_t i = 0; i < times.size(); ++i) {
      const double x = std::clamp(times[i] / duration_, 0.0, 1.0);
      const spatial::JetVector p = sample_at(way_, x), phi = sample_at(turn_, x);
      PathSample& s = out[i];
      Pose turned;
      turned.R = spatial::rotation_exp({phi[0].v, phi[1].v, phi[2].v});
      s.pose.R = spatial::compose(turned, start_).R;
      s.pose.p = {p[0].v, p[1].v, p[2].v};
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

 private:
  using Quintics = std::array<spatial::Quintic, 3>;
  static spatial::JetVector sample_at(const Quintics& of, double share) {
    return {of[0].at(share), of[1].at(share), of[2].at(share)};
  }
  double duration_, length_ = 0;
  Quintics way_, turn_;
  Pose start_;
};

/// The time, counted from one end of a segment inwards, at which the tool is `distance` from there;
/// at most kMostCut of its duration.
Result<double> cut_time(const Segment& s, bool is_end, double distance) {
  const double T = s.duration(), most = kMostCut * T;
  const auto time = [&](double cut) { return is_end ? T - cut : cut; };
  RMP_TRY_ASSIGN(const PathSample corner, sample_at(s, time(0)));
  const auto is_far = [&](double cut) -> Result<bool> {
    RMP_TRY_ASSIGN(const PathSample there, sample_at(s, time(cut)));
    return spatial::distance(there.pose.p, corner.pose.p) >= distance;
  };
  constexpr int kScan = 64;
  double low = 0, high = most;
  for (int i = 1; i <= kScan; ++i) {
    const double cut = most * i / kScan;
    RMP_TRY_ASSIGN(const bool beyond, is_far(cut));
    if (!beyond) {
      low = cut;
      continue;
    }
    high = cut;
    break;
  }
  if (low >= most) return most;
  for (int i = 0; i < 50; ++i) {
    const double middle = (low + high) / 2;
    RMP_TRY_ASSIGN(const bool beyond, is_far(middle));
    (beyond ? high : low) = middle;
  }
  return high;
}

bool same_rate(const Vec3& a, const Vec3& b) {
  return norm(sub(a, b)) <= kJoinRate * (1 + norm(a) + norm(b));
}

/// Greatest speeds within a bridge, and the speed in its middle [m/s, rad/s].
struct Speeds {
  double moving = 0, turning = 0, middle = 0;
};
Speeds speeds_of(const Bridge& bridge) {
  constexpr std::size_t kParts = 64;
  const double h = bridge.duration() / kParts;
  std::array<double, kParts + 1> times;
  std::array<PathSample, kParts + 1> samples;
  for (std::size_t i = 0; i <= kParts; ++i) times[i] = h * static_cast<double>(i);
  (void)bridge.sample(times, samples);  // polynomials do not fail
  // Between samples the greatest lies on the parabola through the highest and its neighbours.
  const auto greatest = [&](const auto& rate) {
    std::size_t top = 0;
    for (std::size_t i = 1; i <= kParts; ++i)
      if (rate(samples[i]) > rate(samples[top])) top = i;
    const double y = rate(samples[top]);
    if (top == 0 || top == kParts) return y;
    const double a = rate(samples[top - 1]), b = rate(samples[top + 1]), bend = a - 2 * y + b;
    return bend < 0 ? y - (b - a) * (b - a) / (8 * bend) : y;
  };
  return {greatest([](const PathSample& s) { return norm(s.velocity); }),
          greatest([](const PathSample& s) { return norm(s.angular_velocity); }),
          norm(samples[kParts / 2].velocity)};
}

/// What a bridge must keep: its greatest speeds, and that in its middle where the tool comes faster
/// than it is to go round the corner.
struct Bounds {
  double moving = 0, turning = 0, middle = 0;
  [[nodiscard]] bool holds(const Speeds& s) const {
    constexpr double kSlack = 1 + 1e-9;
    return s.moving <= kSlack * moving && s.turning <= kSlack * turning &&
           s.middle <= kSlack * middle;
  }
};

/// The shortest duration from `least` on for which a bridge keeps the bounds; 0 = there is none up
/// to some times that.
double shortest_time(const PathSample& from, const PathSample& to, double least,
                     const Bounds& bounds) {
  constexpr int kScan = 60, kHalvings = 40;
  constexpr double kGrowth = 1.04;
  const auto holds = [&](double T) { return bounds.holds(speeds_of(Bridge(from, to, T))); };
  double low = least, high = least;
  for (int i = 0; !holds(high); ++i) {
    if (i == kScan) return 0;
    low = high;
    high *= kGrowth;
  }
  for (int i = 0; i < kHalvings && high - low > 1e-12 * high; ++i) {
    const double middle = (low + high) / 2;
    (holds(middle) ? high : low) = middle;
  }
  return high;
}

/// How long the bridge takes. `cut` is the time cut away from a corner, 0 over a gap.
Result<double> bridge_time(const PathSample& from, const PathSample& to, double cut, double speed,
                           std::size_t number) {
  const double way = spatial::distance(from.pose.p, to.pose.p),
               turn = norm(spatial::rotation_difference(from.pose.R, to.pose.R));
  const double faster = std::max(norm(from.velocity), norm(to.velocity));
  const double turning =
      std::max({norm(from.angular_velocity), norm(to.angular_velocity), kAngularSpeed});
  const double asked = speed > 0 ? speed : cut > 0 ? faster : std::max(faster, kSpeed);
  Bounds bounds{std::max(asked, faster), turning, asked};
  double least = cut;
  // A corner takes the time cut away, or less for a speed above its neighbours'.
  if (!(cut > 0)) least = std::max(way / bounds.moving, turn / turning);
  else if (faster > 0 && speed > faster) least *= faster / speed;
  double T = shortest_time(from, to, least, bounds);
  bounds.turning = std::numeric_limits<double>::infinity();
  if (!(T > 0)) T = shortest_time(from, to, least, bounds);
  if (T > 0) return T;
  if (!(speed > 0)) return cut > 0 ? cut : 15.0 / 8 * least;  // as from rest to rest
  return error(ErrorCode::invalid_argument,
               "no transition from segment " + std::to_string(number - 1) + " at " +
                   text::print_rounded(norm(from.velocity)) + " m/s to segment " +
                   std::to_string(number) + " at " + text::print_rounded(norm(to.velocity)) +
                   " m/s keeps to " + text::print_rounded(speed) + " m/s",
               "Give a greater speed or distance, or run the segments more slowly.");
}

}  // namespace

Result<void> follow(std::vector<std::shared_ptr<const Segment>>& pieces,
                    std::shared_ptr<const Segment> next, const model::Transition& transition,
                    std::size_t number) {
  if (pieces.empty()) {
    pieces.push_back(std::move(next));
    return {};
  }
  const Segment& last = *pieces.back();
  RMP_TRY_ASSIGN(const PathSample end, sample_at(last, last.duration()));
  RMP_TRY_ASSIGN(const PathSample start, sample_at(*next, 0));
  const double gap = spatial::distance(end.pose.p, start.pose.p);
  const double turn = norm(spatial::rotation_difference(end.pose.R, start.pose.R));
  const bool is_joined = gap <= kJoinPosition && turn <= kJoinRotation;
  if (!is_joined && !transition.is_smooth) {
    const std::string names = "segment " + std::to_string(number - 1) + " ends and segment " +
                              std::to_string(number) + " starts ";
    return error(ErrorCode::invalid_argument,
                 gap > kJoinPosition
                     ? names + text::print_rounded(gap) + " m apart"
                     : names + "with orientations " + text::print_rounded(turn) + " rad apart",
                 "Give the second segment the first one's last pose, or allow a transition.");
  }
  if (is_joined &&
      (!transition.is_smooth || (same_rate(end.velocity, start.velocity) &&
                                 same_rate(end.angular_velocity, start.angular_velocity)))) {
    pieces.push_back(std::move(next));
    return {};
  }
  double before = 0, after = 0;  // time cut away
  if (is_joined) {
    double distance = transition.distance;
    if (!(distance > 0)) distance = std::min(last.length(), next->length()) / 10;
    const auto cut = [&](const Segment& s, bool is_end) -> Result<double> {
      return s.length() > kJoinPosition && distance > 0 ? cut_time(s, is_end, distance)
                                                        : Result<double>(s.duration() / 10);
    };
    RMP_TRY_ASSIGN(before, cut(last, true));
    RMP_TRY_ASSIGN(after, cut(*next, false));
  }
  const double T = last.duration();
  RMP_TRY_ASSIGN(const PathSample from, sample_at(last, T - before));
  RMP_TRY_ASSIGN(const PathSample to, sample_at(*next, after));
  RMP_TRY_ASSIGN(const double duration,
                 bridge_time(from, to, before + after, transition.speed, number));
  auto bridge = std::make_shared<Bridge>(from, to, duration);
  RMP_TRY(bridge->measure());
  if (before > 0) {
    RMP_TRY_ASSIGN(pieces.back(), Trimmed::of(pieces.back(), 0, T - before));
  }
  pieces.push_back(std::move(bridge));
  if (after > 0) {
    RMP_TRY_ASSIGN(next, Trimmed::of(next, after, next->duration()));
  }
  pieces.push_back(std::move(next));
  return {};
}

}  // namespace robomosp::motion
