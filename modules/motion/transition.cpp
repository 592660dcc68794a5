// SPDX-License-Identifier: Apache-2.0
#include "motion/transition.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <string>

#include "kernel/text.h"
#include "motion/bridge.h"
#include "motion/paced_segment.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"
#include "spatial/vec.h"

namespace robomosp::motion {
namespace {

using spatial::norm;
using spatial::scale;
using spatial::sub;

/// Of a neighbour: how much of its time a corner may take at most.
constexpr double kMostCut = 0.45;
/// Without speeds to go by.
constexpr double kSpeed = 0.1;         ///< [m/s]
constexpr double kAngularSpeed = 0.5;  ///< [rad/s]
/// Excess of a limit, and way out of a hull, that notes tell of.
constexpr double kToldExcess = 1e-3;
constexpr double kToldWay = 1e-6;   ///< [m]
constexpr double kToldTurn = 1e-3;  ///< [rad]

Result<PathSample> state_at(const Segment& s, double t) {
  PathSample out;
  RMP_TRY(s.sample({&t, 1}, {&out, 1}));
  return out;
}

/// The time, counted from one end of a segment inwards, at which the tool is `distance` from there;
/// at most kMostCut of its duration.
Result<double> cut_time(const Segment& s, bool is_end, double distance) {
  const double T = s.duration(), most = kMostCut * T;
  const auto time = [&](double cut) { return is_end ? T - cut : cut; };
  RMP_TRY_ASSIGN(const PathSample corner, state_at(s, time(0)));
  const auto is_far = [&](double cut) -> Result<bool> {
    RMP_TRY_ASSIGN(const PathSample there, state_at(s, time(cut)));
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

/// How a segment is entered or left.
struct End {
  PathSample state;
  bool is_resting = false;  ///< no velocities; the accelerations of the state are zero then
};
End end_of(const PathSample& state, const SegmentPeaks& peaks) {
  constexpr double kRests = 1e-9;
  End out{state, norm(state.velocity) <= kRests * peaks.speed &&
                     norm(state.angular_velocity) <= kRests * peaks.turning};
  if (out.is_resting)
    out.state.velocity = out.state.angular_velocity = out.state.acceleration =
        out.state.angular_acceleration = {};
  return out;
}
/// At a part of the speed.
PathSample slowed(PathSample s, double pace) {
  s.velocity = scale(s.velocity, pace);
  s.angular_velocity = scale(s.angular_velocity, pace);
  s.acceleration = scale(s.acceleration, pace * pace);
  s.angular_acceleration = scale(s.angular_acceleration, pace * pace);
  return s;
}
PathSample unforced(PathSample s) {
  s.acceleration = s.angular_acceleration = {};
  return s;
}

/// What a bridge keeps [SI].
struct Bounds {
  SegmentLimits limits;
  double middle = SegmentLimits::kNone;  ///< speed half way [m/s]
};

/// The greatest pace in 0..1 at which a bridge and its ends keep the bounds: rates scale with the
/// pace, accelerations with its square, jerks with its cube, and the curve stays.
double kept_pace(const BridgePeaks& p, const Bounds& b) {
  const auto share = [](double limit, double peak) { return peak > limit ? limit / peak : 1.0; };
  const double pace =
      std::min({share(b.limits.speed, p.speed), share(b.limits.angular_speed, p.turning),
                share(b.middle, p.middle), std::sqrt(share(b.limits.acceleration, p.acceleration)),
                std::sqrt(share(b.limits.angular_acceleration, p.spin)),
                std::cbrt(share(b.limits.jerk, p.jerk)),
                std::cbrt(share(b.limits.angular_jerk, p.angular_jerk))});
  return pace > 1 - 1e-9 ? 1 : pace;
}

/// Places and rotation vectors that a bridge is to stay within the hulls of.
struct Hulls {
  std::vector<Vec3> places, turns;
  double size = 0, turn = 0;  ///< greatest distances from the first [m, rad]

  void add(const PathSample& s, const PathSample& first) {
    places.push_back(s.pose.p);
    turns.push_back(spatial::rotation_difference(first.pose.R, s.pose.R));
    size = std::max(size, spatial::distance(places.back(), places.front()));
    turn = std::max(turn, spatial::distance(turns.back(), turns.front()));
  }
  /// Greatest distances of the bridge from the hulls [m, rad].
  [[nodiscard]] std::array<double, 2> left_by(const Bridge& bridge) const {
    constexpr int kParts = 32;
    std::array<double, 2> out{};
    for (int i = 1; i < kParts; ++i) {
      const double x = static_cast<double>(i) / kParts;
      out[0] = std::max(out[0], outside_hull(bridge.place(x), places, place_slack()));
      if (turn > kJoinRotation)
        out[1] = std::max(out[1], outside_hull(bridge.turn(x), turns, turn_slack()));
    }
    return out;
  }
  [[nodiscard]] double place_slack() const { return 1e-9 + 1e-7 * size; }
  [[nodiscard]] double turn_slack() const { return 1e-9 + 1e-3 * turn; }
  [[nodiscard]] bool is_kept(const std::array<double, 2>& left) const {
    return left[0] <= 2 * place_slack() && left[1] <= 2 * turn_slack();
  }
};
/// Samples of a part of a segment; of a straight one its ends.
Result<void> add_part(Hulls& hulls, const Segment& s, double from, double to,
                      const PathSample& first) {
  constexpr std::size_t kParts = 16;
  std::array<double, kParts + 1> times;
  std::array<PathSample, kParts + 1> samples;
  for (std::size_t i = 0; i <= kParts; ++i)
    times[i] = from + (to - from) * static_cast<double>(i) / kParts;
  RMP_TRY(s.sample(times, samples));
  const Vec3 chord = sub(samples.back().pose.p, samples.front().pose.p);
  const double length = norm(chord);
  bool is_straight = true;
  for (const PathSample& p : samples) {
    const Vec3 from_start = sub(p.pose.p, samples.front().pose.p);
    is_straight = is_straight && norm(spatial::cross(chord, from_start)) <= 1e-12 * length * length;
  }
  const bool has_turn = norm(spatial::rotation_difference(samples.front().pose.R,
                                                          samples.back().pose.R)) > kJoinRotation ||
                        norm(samples[kParts / 2].angular_velocity) > 0;
  const std::size_t step = is_straight && !has_turn ? kParts : 1;
  for (std::size_t i = 0; i <= kParts; i += step) hulls.add(samples[i], first);
  return {};
}

/// A bridge's time, and what it costs.
struct Choice {
  double duration = 0;
  double pace = 0;                ///< that it and its ends need
  std::array<double, 2> left{};   ///< how far it leaves the hulls [m, rad]
  bool is_within = false;         ///< it does not
  bool has_accelerations = true;  ///< those of its ends
};

/// The shortest bridge that keeps bounds and hull, else the one that slows its ends down least.
class Search {
 public:
  Search(const PathSample& from, const PathSample& to, const Bounds& bounds, const Hulls& hulls)
      : from_(from), to_(to), bounds_(bounds), hulls_(hulls) {}

  /// Around the time `least` for a corner, from it on for a gap.
  [[nodiscard]] Choice find(double least, bool is_corner) const {
    const Choice kept = is_corner ? corner(least, true) : gap(least, true);
    const bool has_accelerations = norm(from_.acceleration) + norm(to_.acceleration) +
                                       norm(from_.angular_acceleration) +
                                       norm(to_.angular_acceleration) >
                                   0;
    if ((kept.is_within && kept.pace >= 1) || !has_accelerations) return kept;
    const Choice free = is_corner ? corner(least, false) : gap(least, false);
    return is_better(free, kept) ? free : kept;
  }

 private:
  static bool is_better(const Choice& a, const Choice& b) {
    constexpr double kWorth = 1.05;  // for accelerations that do not jump
    if (a.is_within != b.is_within) return a.is_within;
    return a.pace > kWorth * b.pace || (a.pace >= b.pace && a.left[0] < b.left[0] / kWorth);
  }
  [[nodiscard]] Bridge bridge(double duration, bool has_accelerations) const {
    return has_accelerations ? Bridge(from_, to_, duration)
                             : Bridge(unforced(from_), unforced(to_), duration);
  }
  [[nodiscard]] Choice at(double duration, bool has_accelerations) const {
    const Bridge b = bridge(duration, has_accelerations);
    Choice out{duration, kept_pace(peaks_of(b), bounds_), hulls_.left_by(b), false,
               has_accelerations};
    out.is_within = hulls_.is_kept(out.left);
    return out;
  }
  /// The shortest of the times in between whose bridge keeps the bounds; `high` does.
  [[nodiscard]] Choice shortest(double low, const Choice& high) const {
    constexpr int kHalvings = 40;
    double kept = high.duration;
    for (int i = 0; i < kHalvings && kept - low > 1e-12 * kept; ++i) {
      const double middle = (low + kept) / 2;
      const BridgePeaks p = peaks_of(bridge(middle, high.has_accelerations));
      (kept_pace(p, bounds_) >= 1 ? kept : low) = middle;
    }
    return at(kept, high.has_accelerations);
  }

  [[nodiscard]] Choice gap(double least, bool has_accelerations) const {
    constexpr int kScan = 120;
    constexpr double kGrowth = 1.06;
    Choice best;
    double low = least;
    for (int i = 0; i < kScan; ++i) {
      const double T = least * std::pow(kGrowth, i);
      const Choice next = at(T, has_accelerations);
      if (next.pace >= 1) return i == 0 ? next : shortest(low, next);
      if (i == 0 || next.pace > best.pace) best = next;
      low = T;
    }
    return best;
  }

  [[nodiscard]] Choice corner(double least, bool has_accelerations) const {
    constexpr int kScan = 60;
    constexpr double kGrowth = 1.04, kShrink = 0.9;
    const Choice first = at(least, has_accelerations);
    Choice best = first;
    if (first.is_within) {
      double low = least;
      for (int i = 1; i <= kScan && best.pace < 1; ++i) {
        const Choice next = at(least * std::pow(kGrowth, i), has_accelerations);
        if (!next.is_within) break;
        if (next.pace >= 1) return shortest(low, next);
        if (next.pace > best.pace) best = next;
        low = next.duration;
      }
      return best;
    }
    bool is_found = false;
    for (int i = 1; i <= kScan; ++i) {
      const Choice next = at(least * std::pow(kShrink, i), has_accelerations);
      if (!next.is_within) {
        if (!is_found && next.left[0] < best.left[0]) best = next;
        continue;
      }
      if (is_found && next.pace <= best.pace) break;
      best = next;
      is_found = true;
    }
    return best;
  }

  const PathSample &from_, &to_;
  const Bounds& bounds_;
  const Hulls& hulls_;
};

/// The shortest straight bridge from rest to rest: x^3 (10 - 15 x + 6 x^2).
double rest_to_rest(double way, double turn, const SegmentLimits& l) {
  constexpr double kRate = 15.0 / 8, kBend = 5.773502691896258, kJerk = 60;
  return std::max({kRate * way / l.speed, std::sqrt(kBend * way / l.acceleration),
                   std::cbrt(kJerk * way / l.jerk), kRate * turn / l.angular_speed,
                   std::sqrt(kBend * turn / l.angular_acceleration),
                   std::cbrt(kJerk * turn / l.angular_jerk)});
}

/// Between two segments.
struct Junction {
  bool has_bridge = false;
  double before = 0, after = 0;  ///< time cut away from the neighbours [s]
  End from, to;                  ///< at the cuts
  Bounds bounds;
  Choice choice;
  double pace = 1;         ///< of the neighbours' ends and the bridge
  bool is_coupled = true;  ///< both ends go at that pace; else the one that moves
};

class Joiner {
 public:
  explicit Joiner(std::span<const SegmentInLine> line) : line_(line) {}

  Result<JoinedSegments> join() {
    for (std::size_t i = 0; i < line_.size(); ++i) {
      RMP_TRY_ASSIGN(const bool has_part, takes_part(i));
      if (!has_part) continue;
      parts_.push_back(i);
      RMP_TRY_ASSIGN(const SegmentPeaks peaks, motion::peaks_of(*line_[i].segment));
      peaks_.push_back(peaks);
    }
    junctions_.resize(parts_.empty() ? 0 : parts_.size() - 1);
    for (std::size_t k = 0; k < junctions_.size(); ++k) RMP_TRY(plan(k));
    RMP_TRY(look_ahead());
    return assemble();
  }

 private:
  /// Whether a segment lasts, or is a place of its own to go to.
  Result<bool> takes_part(std::size_t i) const {
    const Segment& segment = *line_[i].segment;
    if (segment.duration() > 0) return true;
    const Segment* beside = nullptr;
    double t = 0;
    if (!parts_.empty()) beside = line_[parts_.back()].segment.get(), t = beside->duration();
    else if (i + 1 < line_.size()) beside = line_[i + 1].segment.get();
    if (!beside) return false;
    RMP_TRY_ASSIGN(const PathSample there, state_at(*beside, t));
    RMP_TRY_ASSIGN(const PathSample here, state_at(segment, 0));
    return spatial::distance(here.pose.p, there.pose.p) > kJoinPosition ||
           norm(spatial::rotation_difference(here.pose.R, there.pose.R)) > kJoinRotation;
  }

  [[nodiscard]] const SegmentInLine& part(std::size_t k) const { return line_[parts_[k]]; }
  /// Segments are counted from 1 in messages.
  [[nodiscard]] std::string name(std::size_t k) const {
    return "segment " + std::to_string(parts_[k] + 1);
  }

  /// The transition that leads to part k + 1: where segments of no time lie between, any of theirs
  /// may forbid it.
  [[nodiscard]] model::Transition transition_to(std::size_t k) const {
    model::Transition out = part(k + 1).transition;
    for (std::size_t i = parts_[k] + 1; i < parts_[k + 1]; ++i)
      out.is_smooth = out.is_smooth && line_[i].transition.is_smooth;
    return out;
  }

  Result<void> plan(std::size_t k) {
    const Segment &last = *part(k).segment, &next = *part(k + 1).segment;
    const model::Transition transition = transition_to(k);
    Junction& j = junctions_[k];
    RMP_TRY_ASSIGN(const PathSample end, state_at(last, last.duration()));
    RMP_TRY_ASSIGN(const PathSample start, state_at(next, 0));
    j.from = end_of(end, peaks_[k]), j.to = end_of(start, peaks_[k + 1]);
    const double gap = spatial::distance(end.pose.p, start.pose.p);
    const double turn = norm(spatial::rotation_difference(end.pose.R, start.pose.R));
    const bool is_joined = gap <= kJoinPosition && turn <= kJoinRotation;
    if (!is_joined && !transition.is_smooth) {
      const std::string names = name(k) + " ends and " + name(k + 1) + " starts ";
      return error(ErrorCode::invalid_argument,
                   gap > kJoinPosition
                       ? names + text::print_rounded(gap) + " m apart"
                       : names + "with orientations " + text::print_rounded(turn) + " rad apart",
                   "Give the second segment the first one's last pose, or allow a transition.");
    }
    const bool is_resting = j.from.is_resting && j.to.is_resting;
    const bool is_even = same_rate(end.velocity, start.velocity) &&
                         same_rate(end.angular_velocity, start.angular_velocity);
    j.is_coupled = is_even && !is_resting;
    if (is_joined && (!transition.is_smooth || is_even || is_resting)) return {};
    j.has_bridge = true;
    j.is_coupled = !j.from.is_resting && !j.to.is_resting;
    if (gap <= kJoinPosition && !is_resting) RMP_TRY(cut(k, transition));
    return bridge(k, transition);
  }

  /// A corner: the neighbours are left and entered a distance from it.
  Result<void> cut(std::size_t k, const model::Transition& transition) {
    Junction& j = junctions_[k];
    const Segment &last = *part(k).segment, &next = *part(k + 1).segment;
    double distance = transition.distance;
    if (!(distance > 0)) distance = std::min(last.length(), next.length()) / 10;
    const auto time = [&](const Segment& s, bool is_end) -> Result<double> {
      return s.length() > kJoinPosition && distance > 0 ? cut_time(s, is_end, distance)
                                                        : Result<double>(s.duration() / 10);
    };
    RMP_TRY_ASSIGN(j.before, time(last, true));
    RMP_TRY_ASSIGN(j.after, time(next, false));
    RMP_TRY_ASSIGN(const PathSample from, state_at(last, last.duration() - j.before));
    RMP_TRY_ASSIGN(const PathSample to, state_at(next, j.after));
    j.from = end_of(from, peaks_[k]), j.to = end_of(to, peaks_[k + 1]);
    j.is_coupled = !j.from.is_resting && !j.to.is_resting;
    return {};
  }

  /// The bounds of the bridge; those of its neighbours where their own motion passes them.
  [[nodiscard]] Bounds bounds_of(std::size_t k, double speed, double way) const {
    const Junction& j = junctions_[k];
    const SegmentLimits &a = part(k).limits, &b = part(k + 1).limits;
    const SegmentPeaks &pa = peaks_[k], &pb = peaks_[k + 1];
    const auto raised = [](double limit, double own) { return std::max(limit, own); };
    Bounds out;
    SegmentLimits& l = out.limits;
    l.acceleration =
        std::min(raised(a.acceleration, pa.acceleration), raised(b.acceleration, pb.acceleration));
    l.acceleration =
        std::max({l.acceleration, norm(j.from.state.acceleration), norm(j.to.state.acceleration)});
    l.jerk = std::min(a.jerk, b.jerk);
    // What turns in neither neighbour may turn at a rate of ours.
    const double turning = std::max(pa.turning, pb.turning),
                 given =
                     std::min(a.angular_speed, b.angular_speed) == SegmentLimits::kNone
                         ? kAngularSpeed
                         : std::max(a.angular_speed == SegmentLimits::kNone ? 0 : a.angular_speed,
                                    b.angular_speed == SegmentLimits::kNone ? 0 : b.angular_speed);
    l.angular_speed = std::max(turning, given);
    l.angular_acceleration =
        std::min(raised(a.angular_acceleration, pa.spin), raised(b.angular_acceleration, pb.spin));
    l.angular_acceleration =
        std::max({l.angular_acceleration, norm(j.from.state.angular_acceleration),
                  norm(j.to.state.angular_acceleration)});
    l.angular_jerk = std::min(a.angular_jerk, b.angular_jerk);
    const double faster = std::max(norm(j.from.state.velocity), norm(j.to.state.velocity)),
                 fastest = std::max(pa.speed, pb.speed);
    // From rest to rest as fast as its neighbours are somewhere.
    double own = faster;
    if (!(own > 0) && way > 0) own = fastest > 0 ? fastest : kSpeed;
    const double asked = speed > 0 ? speed : own;
    l.speed = std::max(asked, faster);
    out.middle = asked;
    if (!(l.speed > 0)) l.speed = out.middle = SegmentLimits::kNone;  // it turns only
    return out;
  }

  Result<void> bridge(std::size_t k, const model::Transition& transition) {
    Junction& j = junctions_[k];
    const PathSample &from = j.from.state, &to = j.to.state;
    const double way = spatial::distance(from.pose.p, to.pose.p),
                 turn = norm(spatial::rotation_difference(from.pose.R, to.pose.R));
    j.bounds = bounds_of(k, transition.speed, way);
    if (j.from.is_resting && j.to.is_resting) {
      j.choice = {rest_to_rest(way, turn, j.bounds.limits), 1, {}, true, true};
      return {};
    }
    Hulls hulls;
    const Segment &last = *part(k).segment, &next = *part(k + 1).segment;
    const bool is_corner = j.before > 0 || j.after > 0;
    hulls.add(from, from);
    RMP_TRY(
        add_part(hulls, last, is_corner ? last.duration() - j.before : 0, last.duration(), from));
    RMP_TRY(add_part(hulls, next, 0, is_corner ? j.after : next.duration(), from));
    double least = j.before + j.after;
    const double faster = std::max(norm(from.velocity), norm(to.velocity));
    // A corner takes the time cut away, or less for a speed above its neighbours'.
    if (!is_corner)
      least = std::max(way / j.bounds.limits.speed, turn / j.bounds.limits.angular_speed);
    else if (faster > 0 && transition.speed > faster) least *= faster / transition.speed;
    j.choice = Search(from, to, j.bounds, hulls).find(least, is_corner);
    j.pace = j.choice.pace;
    return {};
  }

  /// Of part k, at the pace of its ends.
  [[nodiscard]] PaceTask task(std::size_t k) const {
    PaceTask out;
    out.segment = part(k).segment;
    out.to = out.segment->duration();
    if (k > 0) out.from = junctions_[k - 1].after, out.ease_start = junctions_[k - 1].after;
    if (k < junctions_.size()) out.to -= junctions_[k].before, out.ease_end = junctions_[k].before;
    // Without times that were cut away, a tenth.
    if (!(out.ease_start > 0)) out.ease_start = (out.to - out.from) / 10;
    if (!(out.ease_end > 0)) out.ease_end = (out.to - out.from) / 10;
    out.peaks = peaks_[k];
    out.limits = part(k).limits;
    const auto borrow = [&](const Junction& j) {
      if (j.pace == 1 || !j.has_bridge) return;
      const auto take = [](double& own, double theirs) {
        if (own == SegmentLimits::kNone) own = theirs;
      };
      take(out.limits.acceleration, j.bounds.limits.acceleration);
      take(out.limits.angular_acceleration, j.bounds.limits.angular_acceleration);
      take(out.limits.jerk, j.bounds.limits.jerk);
      take(out.limits.angular_jerk, j.bounds.limits.angular_jerk);
    };
    if (k > 0) borrow(junctions_[k - 1]);
    if (k < junctions_.size()) borrow(junctions_[k]);
    return out;
  }
  /// Paces at the ends of the parts, as the bridges ask for them.
  void begin_paces() {
    start_.assign(parts_.size(), 1.0), end_.assign(parts_.size(), 1.0);
    for (std::size_t k = 0; k < junctions_.size(); ++k) {
      const Junction& j = junctions_[k];
      if (j.is_coupled || (j.has_bridge && !j.from.is_resting)) end_[k] = j.pace;
      if (j.is_coupled || (j.has_bridge && !j.to.is_resting)) start_[k + 1] = j.pace;
    }
  }
  void set_start(std::size_t k, double pace) {
    start_[k] = pace;
    if (k == 0) return;
    Junction& j = junctions_[k - 1];
    if (j.is_coupled) end_[k - 1] = pace;
    if (j.is_coupled || (j.has_bridge && !j.to.is_resting)) j.pace = pace;
  }
  void set_end(std::size_t k, double pace) {
    end_[k] = pace;
    if (k == junctions_.size()) return;
    Junction& j = junctions_[k];
    if (j.is_coupled) start_[k + 1] = pace;
    if (j.is_coupled || (j.has_bridge && !j.from.is_resting)) j.pace = pace;
  }

  /// Where a segment is too short to slow down for its end, it begins more slowly; and likewise
  /// where it is too short to come up to what follows.
  Result<void> look_ahead() {
    begin_paces();
    for (std::size_t k = parts_.size(); k-- > 0;) {
      if (!(start_[k] > end_[k])) continue;
      RMP_TRY_ASSIGN(const double kept, nearest_pace(k, start_[k], end_[k], true));
      if (kept < start_[k]) set_start(k, kept);
    }
    for (std::size_t k = 0; k < parts_.size(); ++k) {
      if (!(end_[k] > start_[k])) continue;
      RMP_TRY_ASSIGN(const double kept, nearest_pace(k, start_[k], end_[k], false));
      if (kept < end_[k]) set_end(k, kept);
    }
    return {};
  }
  /// The greatest pace of the faster end that has room for the change.
  Result<double> nearest_pace(std::size_t k, double start, double end, bool is_start) const {
    const PaceTask t = task(k);
    const auto fits = [&](double pace) {
      return is_start ? has_pace(t, pace, end) : has_pace(t, start, pace);
    };
    double low = is_start ? end : start, high = is_start ? start : end;
    RMP_TRY_ASSIGN(const bool is_free, fits(high));
    if (is_free) return high;
    constexpr int kHalvings = 24;
    for (int i = 0; i < kHalvings; ++i) {
      const double middle = (low + high) / 2;
      RMP_TRY_ASSIGN(const bool has_room, fits(middle));
      (has_room ? low : high) = middle;
    }
    return low;
  }

  Result<JoinedSegments> assemble() {
    JoinedSegments out;
    double t = 0;
    std::size_t next_standing = 0;
    const auto add_standing = [&](std::size_t until) {
      for (; next_standing < until; ++next_standing)
        out.pieces.push_back({line_[next_standing].segment, next_standing, false});
    };
    for (std::size_t k = 0; k < parts_.size(); ++k) {
      add_standing(parts_[k]);
      if (k > 0 && junctions_[k - 1].has_bridge) {
        RMP_TRY_ASSIGN(auto piece, made_bridge(k - 1, t, out.notes));
        t += piece->duration();
        out.pieces.push_back({std::move(piece), parts_[k], true});
      }
      RMP_TRY_ASSIGN(auto piece, made_part(k, t, out.notes));
      t += piece->duration();
      out.pieces.push_back({std::move(piece), parts_[k], false});
      next_standing = parts_[k] + 1;
    }
    add_standing(line_.size());
    return out;
  }

  Result<std::shared_ptr<const Segment>> made_part(std::size_t k, double when,
                                                   std::vector<std::string>& notes) const {
    const PaceTask t = task(k);
    RMP_TRY_ASSIGN(const std::optional<Pace> found, find_pace(t, start_[k], end_[k]));
    Pace pace;
    if (found) {
      pace = *found;
    } else {
      pace = {start_[k], start_[k], end_[k], 0, (t.to - t.from) / ((start_[k] + end_[k]) / 2)};
      notes.push_back(name(k) + " changes its speed between t = " + text::print_rounded(when) +
                      " s and " + text::print_rounded(when + pace.last) +
                      " s with more than its acceleration: it is too short for the transitions at "
                      "its ends. Give these a smaller distance, or a lower speed.");
    }
    if (pace.is_own() && t.from == 0 && t.to == t.segment->duration()) return t.segment;
    return PacedSegment::of(t.segment, t.from, t.to, pace);
  }

  Result<std::shared_ptr<const Segment>> made_bridge(std::size_t k, double t,
                                                     std::vector<std::string>& notes) const {
    const Junction& j = junctions_[k];
    PathSample from = slowed(j.from.state, j.pace), to = slowed(j.to.state, j.pace);
    if (!j.choice.has_accelerations) from = unforced(from), to = unforced(to);
    auto made = std::make_shared<Bridge>(from, to, j.choice.duration / j.pace);
    RMP_TRY(made->measure());
    tell(k, *made, t, notes);
    return std::shared_ptr<const Segment>(std::move(made));
  }

  void tell(std::size_t k, const Bridge& made, double t, std::vector<std::string>& notes) const {
    const Junction& j = junctions_[k];
    const std::string start = "the transition to " + name(k + 1) + " ";
    const BridgePeaks p = peaks_of(made);
    const SegmentLimits& l = j.bounds.limits;
    if (p.acceleration > (1 + kToldExcess) * l.acceleration)
      notes.push_back(start + "reaches " + text::print_rounded(p.acceleration) +
                      " m/s^2 at t = " + text::print_rounded(t + p.acceleration_time) +
                      " s, above " + text::print_rounded(l.acceleration) +
                      " m/s^2. Give it a larger distance, or lower the speeds.");
    if (p.speed > (1 + kToldExcess) * l.speed)
      notes.push_back(start + "reaches " + text::print_rounded(p.speed) +
                      " m/s between t = " + text::print_rounded(t) + " s and " +
                      text::print_rounded(t + made.duration()) + " s, above " +
                      text::print_rounded(l.speed) + " m/s.");
    if (!j.choice.is_within && j.choice.left[0] > kToldWay)
      notes.push_back(start + "leaves the hull of both segments by " +
                      text::print_rounded(j.choice.left[0]) +
                      " m between t = " + text::print_rounded(t) + " s and " +
                      text::print_rounded(t + made.duration()) +
                      " s: the tool arrives or leaves at speed across the gap. Make the segments "
                      "end and start at rest there, or add a segment between them.");
    else if (!j.choice.is_within && j.choice.left[1] > kToldTurn)
      notes.push_back(
          start + "turns " + text::print_rounded(j.choice.left[1]) +
          " rad beyond the orientations of both segments, between t = " + text::print_rounded(t) +
          " s and " + text::print_rounded(t + made.duration()) +
          " s. Rotate the tool more slowly before and after it.");
  }

  std::span<const SegmentInLine> line_;
  std::vector<std::size_t> parts_;   ///< segments that last
  std::vector<SegmentPeaks> peaks_;  ///< of each of them
  std::vector<Junction> junctions_;  ///< behind each of them but the last
  std::vector<double> start_, end_;  ///< paces at the ends of each part
};

}  // namespace

Result<JoinedSegments> join(std::span<const SegmentInLine> line) { return Joiner(line).join(); }

}  // namespace robomosp::motion
