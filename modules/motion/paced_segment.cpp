// SPDX-License-Identifier: Apache-2.0
#include "motion/paced_segment.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "spatial/vec.h"

namespace robomosp::motion {
namespace {

using spatial::add;
using spatial::norm;
using spatial::scale;

/// The greatest slope of 3 x^2 - 2 x^3, and its greatest curvature.
constexpr double kEaseRate = 1.5, kEaseBend = 6;
/// Of a stretch: how much a change without limits takes at most.
constexpr double kMostFree = 0.45;
/// Rounding that limits allow.
constexpr double kPaceSlack = 1 + 1e-9;

/// The change of pace from a to b at the share x of its time: the own time done in units of the
/// change's duration, the pace, and d pace / dx.
std::array<double, 3> eased(double a, double b, double x) {
  return {a * x + (b - a) * x * x * x * (1 - x / 2), a + (b - a) * x * x * (3 - 2 * x),
          (b - a) * 6 * x * (1 - x)};
}

/// Whether a change of pace from `a` to `b` in `duration` keeps the limits, beginning at the
/// segment's own time `begin`.
Result<bool> keeps_limits(const PaceTask& task, double begin, double a, double b, double duration) {
  constexpr std::size_t kParts = 32;
  std::array<double, kParts + 1> times;
  std::array<std::array<double, 3>, kParts + 1> pace;
  std::array<PathSample, kParts + 1> samples;
  for (std::size_t i = 0; i <= kParts; ++i) {
    pace[i] = eased(a, b, static_cast<double>(i) / kParts);
    times[i] = std::clamp(begin + duration * pace[i][0], task.from, task.to);
  }
  RMP_TRY(task.segment->sample(times, samples));
  for (std::size_t i = 0; i <= kParts; ++i) {
    const double p = pace[i][1], change = pace[i][2] / duration;
    const PathSample& s = samples[i];
    const auto is_within = [&](const Vec3& rate, const Vec3& own, double limit) {
      const double most = std::max(limit, norm(own));
      return norm(add(scale(own, p * p), scale(rate, change))) <= kPaceSlack * most;
    };
    if (!is_within(s.velocity, s.acceleration, task.limits.acceleration) ||
        !is_within(s.angular_velocity, s.angular_acceleration, task.limits.angular_acceleration))
      return false;
  }
  return true;
}

/// The shortest duration of a change at one end of the task that keeps the limits; below 0 =
/// none within `room` of the segment's own time.
Result<double> change_time(const PaceTask& task, bool is_end, double a, double b, double room) {
  const double step = std::fabs(b - a), mean = (a + b) / 2;
  if (step == 0) return 0.0;
  const SegmentLimits& l = task.limits;
  const bool is_free =
      l.acceleration == SegmentLimits::kNone && l.angular_acceleration == SegmentLimits::kNone;
  double least = std::max({kEaseRate * step * task.peaks.speed / l.acceleration,
                           kEaseRate * step * task.peaks.turning / l.angular_acceleration,
                           std::sqrt(kEaseBend * step * task.peaks.speed / l.jerk),
                           std::sqrt(kEaseBend * step * task.peaks.turning / l.angular_jerk)});
  if (is_free) least = std::min(is_end ? task.ease_end : task.ease_start, kMostFree * room) / mean;
  if (!(least > 0)) least = 1e-3 * room / mean;
  constexpr double kGrowth = 1.1;
  for (double duration = least; duration * mean <= room; duration *= kGrowth) {
    const double begin = is_end ? task.to - duration * mean : task.from;
    RMP_TRY_ASSIGN(const bool is_kept, keeps_limits(task, begin, a, b, duration));
    if (is_kept) return duration;
  }
  return -1.0;
}

/// With this pace in the middle; nullopt = no room.
Result<std::optional<Pace>> pace_by(const PaceTask& task, double start, double middle, double end) {
  const double room = task.to - task.from;
  Pace out{start, middle, end, 0, 0};
  RMP_TRY_ASSIGN(out.first, change_time(task, false, start, middle, room));
  if (out.first < 0) return std::optional<Pace>();
  RMP_TRY_ASSIGN(out.last, change_time(task, true, middle, end, room));
  if (out.last < 0 || out.taken() > room * kPaceSlack) return std::optional<Pace>();
  return std::optional<Pace>(out);
}

}  // namespace

Result<SegmentPeaks> peaks_of(const Segment& segment) {
  constexpr std::size_t kParts = 64;
  std::array<double, kParts + 1> times;
  std::array<PathSample, kParts + 1> samples;
  for (std::size_t i = 0; i <= kParts; ++i)
    times[i] = segment.duration() * static_cast<double>(i) / kParts;
  RMP_TRY(segment.sample(times, samples));
  SegmentPeaks out;
  for (const PathSample& s : samples) {
    const double speed = norm(s.velocity);
    out.speed = std::max(out.speed, speed);
    out.turning = std::max(out.turning, norm(s.angular_velocity));
    out.spin = std::max(out.spin, norm(s.angular_acceleration));
    if (speed > 0)
      out.acceleration =
          std::max(out.acceleration, std::fabs(spatial::dot(s.velocity, s.acceleration)) / speed);
  }
  return out;
}

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

PacedSegment::PacedSegment(std::shared_ptr<const Segment> segment, double from, double to,
                           const Pace& pace, double length)
    : segment_(std::move(segment)),
      from_(from),
      to_(to),
      pace_(pace),
      cruise_(std::max(0.0, to - from - pace.taken()) / pace.middle),
      duration_(pace.is_own() ? to - from : pace.first + cruise_ + pace.last),
      length_(length) {}

Result<std::shared_ptr<const Segment>> PacedSegment::of(std::shared_ptr<const Segment> segment,
                                                        double from, double to, const Pace& pace) {
  RMP_TRY_ASSIGN(const double length, length_between(*segment, from, to));
  return std::shared_ptr<const Segment>(
      new PacedSegment(std::move(segment), from, to, pace, length));
}

std::array<double, 3> PacedSegment::own_time(double t) const {
  if (pace_.is_own()) return {t, 1, 0};
  if (t < pace_.first) {
    const auto e = eased(pace_.start, pace_.middle, t / pace_.first);
    return {pace_.first * e[0], e[1], e[2] / pace_.first};
  }
  const double behind = pace_.first * (pace_.start + pace_.middle) / 2;
  if (!(pace_.last > 0) || t <= pace_.first + cruise_)
    return {behind + (t - pace_.first) * pace_.middle, pace_.middle, 0};
  const auto e = eased(pace_.middle, pace_.end, (t - pace_.first - cruise_) / pace_.last);
  return {behind + cruise_ * pace_.middle + pace_.last * e[0], e[1], e[2] / pace_.last};
}

Result<void> PacedSegment::sample(std::span<const double> times, std::span<PathSample> out) const {
  const double slack = 1e-12 * duration_;
  constexpr std::size_t kChunk = 64;
  std::array<double, kChunk> inner;
  std::array<std::array<double, 3>, kChunk> own;
  for (std::size_t first = 0; first < times.size(); first += kChunk) {
    const std::size_t n = std::min(kChunk, times.size() - first);
    for (std::size_t i = 0; i < n; ++i) {
      own[i] = own_time(std::clamp(times[first + i], 0.0, duration_));
      inner[i] = std::clamp(from_ + own[i][0], from_, to_);
    }
    const auto chunk = out.subspan(first, n);
    RMP_TRY(segment_->sample(std::span<const double>(inner).first(n), chunk));
    for (std::size_t i = 0; i < n; ++i) {
      PathSample& s = chunk[i];
      if (times[first + i] < -slack || times[first + i] > duration_ + slack) {
        s.velocity = s.acceleration = s.angular_velocity = s.angular_acceleration = {};
        continue;
      }
      const auto [done, p, change] = own[i];
      if (p == 1 && change == 0) continue;
      s.acceleration = add(scale(s.acceleration, p * p), scale(s.velocity, change));
      s.angular_acceleration =
          add(scale(s.angular_acceleration, p * p), scale(s.angular_velocity, change));
      s.velocity = scale(s.velocity, p);
      s.angular_velocity = scale(s.angular_velocity, p);
    }
  }
  return {};
}

Result<bool> has_pace(const PaceTask& task, double start, double end) {
  const double most = std::max(start, end);
  RMP_TRY_ASSIGN(const auto found, pace_by(task, start, most, end));
  return found.has_value();
}

Result<std::optional<Pace>> find_pace(const PaceTask& task, double start, double end) {
  if (start == 1 && end == 1) return std::optional<Pace>(Pace{});
  RMP_TRY_ASSIGN(auto found, pace_by(task, start, 1, end));
  if (found) return found;
  double low = std::max(start, end), high = 1;
  RMP_TRY_ASSIGN(found, pace_by(task, start, low, end));
  if (!found) return found;
  constexpr int kHalvings = 20;
  for (int i = 0; i < kHalvings && high - low > 1e-6; ++i) {
    const double middle = (low + high) / 2;
    RMP_TRY_ASSIGN(auto better, pace_by(task, start, middle, end));
    if (better) found = better, low = middle;
    else high = middle;
  }
  return found;
}

}  // namespace robomosp::motion
