// SPDX-License-Identifier: Apache-2.0
// Checks of whole joint paths.
#include <algorithm>
#include <cmath>
#include <utility>

#include "collision/collision.h"
#include "kernel/quiet_progress.h"
#include "robotics/kinematics.h"
#include "spatial/pose.h"
#include "spatial/vec.h"

namespace robomosp::collision {
namespace {

using namespace spatial;

/// Rotation from one unit quaternion to another: its angle [rad].
double angle_between_rotations(const double* a, const double* b) {
  double d = 0, aa = 0, bb = 0;
  for (int k = 0; k < 4; ++k) d += a[k] * b[k], aa += a[k] * a[k], bb += b[k] * b[k];
  return 2 * std::acos(std::clamp(std::fabs(d) / std::sqrt(aa * bb), 0.0, 1.0));
}

/// All joints evenly: angles and lengths linearly, quaternions along the shortest arc.
void between(const RobotModel& model, const double* from, const double* to, double s, double* out) {
  for (const JointModel& j : model.joints) {
    if (j.is_coupled()) continue;
    const std::int32_t i = j.q_index;
    const std::int32_t linear = j.type == JointType::spherical ? 0
                                : j.type == JointType::free    ? 3
                                                               : 1;
    for (std::int32_t k = i; k < i + linear; ++k) out[k] = from[k] + s * (to[k] - from[k]);
    if (coordinate_count(j.type) == 1) continue;
    const double *a = from + i + linear, *b = to + i + linear;
    double* o = out + i + linear;
    const double angle = angle_between_rotations(a, b) / 2;
    double d = 0;
    for (int k = 0; k < 4; ++k) d += a[k] * b[k];
    const double sign = d < 0 ? -1 : 1;
    const bool is_small = angle < 1e-9;
    const double wa = is_small ? 1 - s : std::sin((1 - s) * angle) / std::sin(angle);
    const double wb = is_small ? s : std::sin(s * angle) / std::sin(angle);
    for (int k = 0; k < 4; ++k) o[k] = wa * a[k] + sign * wb * b[k];
  }
}

/// The last joint that moves both bodies alike; -1 = none.
std::int32_t common_joint(const CollisionModel& model, const CollisionPair& pair) {
  const auto& a = model.bodies()[static_cast<std::size_t>(pair.a)];
  const auto& b = model.bodies()[static_cast<std::size_t>(pair.b)];
  if (a.robot != b.robot || a.robot < 0) return -1;
  const RobotModel& m = *model.robots()[static_cast<std::size_t>(a.robot)].model;
  // Parents have lower numbers than their children.
  std::int32_t i = a.joint, k = b.joint;
  while (i != k) {
    std::int32_t& later = i > k ? i : k;
    later = m.joints[static_cast<std::size_t>(later)].parent;
  }
  return i;
}

/// How far a point of a body can travel, at most, while all joints move evenly from one
/// configuration to another, against what the joint `up_to` carries (-1 = the world) [m].
double displacement_bound(const CollisionModel& model, const CollisionBody& body,
                          std::span<const double> from, std::span<const double> to,
                          std::int32_t up_to) {
  if (body.joint < 0) return 0;
  const CollisionRobot& robot = model.robots()[static_cast<std::size_t>(body.robot)];
  const double *q0 = from.data() + robot.first, *q1 = to.data() + robot.first;
  double moved = 0, arm = body.reach;  // from the joint's origin to the farthest point
  for (std::int32_t i = body.joint; i >= 0 && i != up_to;) {
    const JointModel& j = robot.model->joints[static_cast<std::size_t>(i)];
    const double *own0 = q0 + j.q_index, *own1 = q1 + j.q_index;
    switch (j.type) {
      case JointType::revolute:
        moved += std::fabs(joint_value(j, q1) - joint_value(j, q0)) * arm;
        break;
      case JointType::prismatic: {
        const double x0 = joint_value(j, q0), x1 = joint_value(j, q1);
        moved += std::fabs(x1 - x0);
        arm += std::max(std::fabs(x0), std::fabs(x1));
        break;
      }
      case JointType::spherical: moved += angle_between_rotations(own0, own1) * arm; break;
      case JointType::free: {
        const Vec3 p0{own0[0], own0[1], own0[2]}, p1{own1[0], own1[1], own1[2]};
        moved += angle_between_rotations(own0 + 3, own1 + 3) * arm + distance(p0, p1);
        arm += std::max(norm(p0), norm(p1));
        break;
      }
    }
    arm += norm(j.placement.p);
    i = j.parent;
  }
  return moved;
}

/// What a pair can move against each other, at most [m].
double motion_bound(const CollisionModel& model, const CollisionPair& pair,
                    std::span<const double> from, std::span<const double> to) {
  const std::int32_t shared = common_joint(model, pair);
  const auto& bodies = model.bodies();
  return displacement_bound(model, bodies[static_cast<std::size_t>(pair.a)], from, to, shared) +
         displacement_bound(model, bodies[static_cast<std::size_t>(pair.b)], from, to, shared);
}

Error stopped() { return error(ErrorCode::cancelled, "the path check was cancelled"); }

}  // namespace

/// One check of a joint path, segment by segment.
class PathChecker {
 public:
  PathChecker(const CollisionModel& model, double tolerance, Progress& progress)
      : model_(model),
        tolerance_(tolerance),
        progress_(progress),
        q_(model.coordinates_),
        grown_(model.bodies_.size()),
        from_(model.sample()),
        to_(model.sample()),
        middle_(model.sample()) {}

  /// The first contact on the segments from waypoint to waypoint.
  Result<std::optional<PathContact>> run(std::span<const double> waypoints) {
    const std::size_t n = model_.coordinates_;
    const std::size_t points = n == 0 ? 1 : waypoints.size() / n;
    const std::size_t segments = std::max<std::size_t>(points - 1, 1);
    for (std::size_t i = 0; i < segments; ++i) {
      if (progress_.cancelled()) return stopped();
      const Segment segment{i, waypoints.subspan(i * n, n),
                            waypoints.subspan(std::min(i + 1, points - 1) * n, n)};
      RMP_TRY(start(segment));
      if (tracks_.empty()) continue;
      RMP_TRY_ASSIGN(const auto contact, search(segment));
      if (contact) return contact;
      if (i + 1 == segments) return at_last_waypoint(segment);
    }
    return std::optional<PathContact>{};
  }

 private:
  struct Segment {
    std::size_t number = 0;
    std::span<const double> from, to;
  };
  /// A pair that can meet on the segment.
  struct Track {
    CollisionPair pair;
    double motion;  ///< of the two against each other on the segment, a bound [m]
  };
  struct Open {
    std::size_t track;
    PairDistance begin;
    double end;
  };
  /// A part of the segment with the pairs that could come near within.
  struct Interval {
    double begin, end;
    std::vector<Open> open;
  };

  /// The pairs whose boxes, grown by what each body can move, meet, and their distances at both
  /// ends of the segment.
  Result<void> start(const Segment& segment) {
    if (segment.number == 0) model_.place_moving(segment.from, from_);
    else std::swap(from_, to_);
    model_.place_moving(segment.to, to_);
    for (std::size_t b = 0; b < model_.bodies_.size(); ++b)
      grown_[b] = displacement_bound(model_, model_.bodies_[b], segment.from, segment.to, -1);
    model_.broad_.place(from_.poses, grown_, from_.boxes);
    tracks_.clear();
    const auto asked = model_.candidates(from_, model_.checked_, tolerance_);
    double most = tolerance_;
    for (const CollisionPair& p : asked) {
      tracks_.push_back({p, motion_bound(model_, p, segment.from, segment.to)});
      most = std::max(most, tracks_.back().motion);
    }
    if (tracks_.empty()) {
      reached_.clear();
      return {};
    }
    // Where the last segment ended this one begins.
    const std::vector<PairDistance> before = std::move(at_end_);
    std::vector<CollisionPair> unknown;
    std::vector<std::size_t> at_unknown;
    at_begin_.assign(asked.size(), {});
    for (std::size_t k = 0; k < asked.size(); ++k) {
      const auto known = std::lower_bound(reached_.begin(), reached_.end(), asked[k], comes_before);
      if (known != reached_.end() && !comes_before(asked[k], *known)) {
        at_begin_[k] = before[static_cast<std::size_t>(known - reached_.begin())];
      } else {
        unknown.push_back(asked[k]);
        at_unknown.push_back(k);
      }
    }
    std::vector<PairDistance> found(unknown.size());
    RMP_TRY(model_.ask(from_.poses, unknown, 1.001 * most, found, quiet_));
    for (std::size_t k = 0; k < found.size(); ++k) at_begin_[at_unknown[k]] = found[k];
    at_end_.assign(asked.size(), {});
    RMP_TRY(model_.ask(to_.poses, asked, 1.001 * most, at_end_, quiet_));
    reached_ = asked;
    return {};
  }

  /// Halves intervals in the order of time; a pair stays open while it could come near within.
  Result<std::optional<PathContact>> search(const Segment& segment) {
    Interval whole{0, 1, {}};
    for (std::size_t k = 0; k < tracks_.size(); ++k)
      whole.open.push_back({k, at_begin_[k], at_end_[k].distance});
    std::vector<Interval> stack{std::move(whole)};
    while (!stack.empty()) {
      Interval now = std::move(stack.back());
      stack.pop_back();
      if (const Open* nearest = nearest_at_begin(now))
        return std::optional(
            PathContact{segment.number, now.begin, {tracks_[nearest->track].pair, nearest->begin}});
      double most = tolerance_;
      std::erase_if(now.open, [&](const Open& o) {
        const double motion = tracks_[o.track].motion * (now.end - now.begin);
        if (o.begin.distance + std::max(o.end, 0.0) > motion) return true;
        most = std::max(most, motion);
        return false;
      });
      if (now.open.empty()) continue;
      if (++steps_ % 64 == 0 && progress_.cancelled()) return stopped();
      RMP_TRY(halve(segment, std::move(now), most, stack));
    }
    return std::optional<PathContact>{};
  }

  [[nodiscard]] const Open* nearest_at_begin(const Interval& interval) const {
    const Open* nearest = nullptr;
    for (const Open& o : interval.open)
      if (o.begin.distance <= tolerance_ &&
          (!nearest || o.begin.distance < nearest->begin.distance))
        nearest = &o;
    return nearest;
  }

  Result<void> halve(const Segment& segment, Interval now, double most,
                     std::vector<Interval>& stack) {
    const double half = 0.5 * (now.begin + now.end);
    for (const CollisionRobot& r : model_.robots_)
      between(*r.model, &segment.from[r.first], &segment.to[r.first], half, &q_[r.first]);
    model_.place_moving(q_, middle_);
    std::vector<CollisionPair> open;
    for (const Open& o : now.open) open.push_back(tracks_[o.track].pair);
    std::vector<PairDistance> d(open.size());
    RMP_TRY(model_.ask(middle_.poses, open, 1.001 * most, d, quiet_));
    Interval first{now.begin, half, now.open}, second{half, now.end, std::move(now.open)};
    for (std::size_t k = 0; k < d.size(); ++k) {
      first.open[k].end = d[k].distance;
      second.open[k].begin = d[k];
    }
    stack.push_back(std::move(second));
    stack.push_back(std::move(first));
    return {};
  }

  [[nodiscard]] std::optional<PathContact> at_last_waypoint(const Segment& segment) const {
    const auto last =
        std::min_element(at_end_.begin(), at_end_.end(),
                         [](const auto& x, const auto& y) { return x.distance < y.distance; });
    if (last->distance > tolerance_) return std::nullopt;
    const auto track = static_cast<std::size_t>(last - at_end_.begin());
    return PathContact{segment.number, 1.0, {tracks_[track].pair, *last}};
  }

  const CollisionModel& model_;
  double tolerance_;
  Progress& progress_;
  QuietProgress quiet_{progress_};  // of questions about one configuration
  std::vector<double> q_, grown_;
  CollisionModel::Sample from_, to_, middle_;
  std::vector<Track> tracks_;
  std::vector<CollisionPair> reached_;  ///< the pairs of at_end_
  std::vector<PairDistance> at_begin_, at_end_;
  std::size_t steps_ = 0;
};

Result<std::optional<PathContact>> CollisionModel::check_path(std::span<const double> waypoints,
                                                              double tolerance,
                                                              Progress& progress) const {
  if (!(tolerance > 0) || !std::isfinite(tolerance))
    return error(ErrorCode::invalid_argument, "the tolerance is not positive",
                 "Give a length above 0, such as 1e-4.");
  RMP_TRY(check(waypoints));
  if (pairs_.empty()) return std::optional<PathContact>{};
  // How long a check takes goes with the way: this much is some minutes.
  constexpr double kMostWay = 1e4;
  std::size_t width = 0;
  for (const CollisionRobot& r : robots_)
    width = std::max(width, r.first + r.model->coordinate_count());
  for (std::size_t i = width; width > 0 && i < waypoints.size(); ++i)
    if (const double way = std::fabs(waypoints[i] - waypoints[i - width]); way > kMostWay)
      return error(ErrorCode::invalid_argument,
                   "from waypoint " + std::to_string(i / width) + " to the next a joint moves by " +
                       text::print_rounded(way) + " rad or m",
                   "Give waypoints that are at most " + text::print_rounded(kMostWay) + " apart.");
  return PathChecker(*this, tolerance, progress).run(waypoints);
}

}  // namespace robomosp::collision
