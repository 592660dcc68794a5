// SPDX-License-Identifier: Apache-2.0
// Moves into frames that move, such as a part on a belt: the tool meets the frame with its speed,
// and stays with it until the next move of its robot begins.
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "kernel/text.h"
#include "model/placement.h"
#include "motion/cartesian_path.h"
#include "robotics/maker_axes.h"
#include "robotics/single_joints.h"
#include "sim/ik_reason.h"
#include "sim/joint_rates.h"
#include "spatial/passing.h"
#include "spatial/pose.h"
#include "spatial/quintic.h"
#include "spatial/rotation.h"
#include "task/members.h"
#include "task/task_executor.h"

namespace robomosp::task {
namespace {

using text::quote;

constexpr double kSameTime = 1e-9;     ///< [s]
constexpr double kSamePlace = 1e-9;    ///< poses nearer than this are one [m and rad]
constexpr double kFollowSpeed = 0.25;  ///< of straight moves that give none [m/s]
constexpr double kAssumedRate = 1;     ///< of joints without a limit [rad/s or m/s]
constexpr double kAssumedRise = 0.25;  ///< likewise: to full speed [s]
constexpr double kWithinLimits = 1 + 1e-6;
constexpr double kLongest = 3600;  ///< of a move that is to meet its frame [s]
constexpr int kMostRounds = 60;
/// Steps of the differences that give a pose's rates and accelerations [s].
constexpr double kRateStep = 1e-4, kAccelerationStep = 2e-3;

Pose between(const Pose& from, const Pose& to, double share) {
  Pose out;
  const Vec3 turn = spatial::rotation_log(spatial::compose(spatial::inverse(from), to).R);
  Pose part;
  part.R = spatial::rotation_exp(spatial::scale(turn, share));
  out.R = spatial::compose(from, part).R;
  for (std::size_t k = 0; k < 3; ++k) out.p[k] = from.p[k] + share * (to.p[k] - from.p[k]);
  return out;
}
/// Times at which the limits of a move are looked at while its duration is sought.
std::vector<double> parts_of(double from, double to) {
  if (!(to > from + kSameTime)) return {from};
  constexpr int kParts = 40;
  std::vector<double> out;
  for (int i = 0; i <= kParts; ++i) out.push_back(from + (to - from) * i / kParts);
  return out;
}
/// The joint that jumps from sample i - 1 to sample i: it goes far, and much farther than its rates
/// at both ends account for; n = none does.
std::size_t jumping_joint(const sim::RobotMotion& m, std::size_t n, std::size_t i) {
  constexpr double kFar = 0.3, kFarther = 3;  // [rad or m], times the way at the greater rate
  const double time = m.times[i] - m.times[i - 1];
  for (std::size_t j = 0; j < n; ++j) {
    const std::size_t now = i * n + j, before = now - n;
    const double by = std::fabs(m.q[now] - m.q[before]);
    const double rate = std::max(std::fabs(m.qd[now]), std::fabs(m.qd[before]));
    if (by > kFar && by > kFarther * rate * time) return j;
  }
  return n;
}
/// Shares of the way at which the rate or the acceleration of a joint is greatest or least.
std::vector<double> extremes_of(const spatial::Quintic& joint) {
  const auto& c = joint.coefficients();
  std::vector<double> bends;  // where the jerk 6 c3 + 24 c4 x + 60 c5 x^2 is 0
  const double a = 60 * c[5], b = 24 * c[4], d = 6 * c[3], root = b * b - 4 * a * d;
  if (std::fabs(a) < 1e-12 * std::fabs(b)) {
    bends.push_back(-d / b);
  } else if (root >= 0 && a != 0) {
    const double far = -0.5 * (b + std::copysign(std::sqrt(root), b));
    bends.push_back(far / a);
    if (far != 0) bends.push_back(d / far);
  }
  std::erase_if(bends, [](double x) { return !(x > 0 && x < 1); });
  std::sort(bends.begin(), bends.end());
  // Between those the acceleration rises or falls, so that it is 0 once at most.
  std::vector<double> out = bends, ends{0.0};
  ends.insert(ends.end(), bends.begin(), bends.end());
  ends.push_back(1);
  for (std::size_t i = 0; i + 1 < ends.size(); ++i) {
    double low = ends[i], high = ends[i + 1];
    const bool is_rising = joint.at(low).dd < 0;
    if ((joint.at(high).dd < 0) == is_rising) continue;
    for (int k = 0; k < 60; ++k) {
      const double middle = 0.5 * (low + high);
      ((joint.at(middle).dd < 0) == is_rising ? low : high) = middle;
    }
    out.push_back(low);
  }
  return out;
}
double turn_between(const Pose& a, const Pose& b) {
  return spatial::norm(spatial::rotation_log(spatial::compose(spatial::inverse(a), b).R));
}

}  // namespace

TaskExecutor::Anchor TaskExecutor::anchor(const std::string& frame_name, std::size_t who,
                                          const Pose& world_T_frame) const {
  Anchor out;
  out.at = world_T_frame;
  const auto it = thing_of_.find(frame_name);
  if (frame_name.empty() || frame_of_.contains(frame_name) || it == thing_of_.end()) return out;
  const Held& h = things_[it->second].history.back();
  if (!h.is_held || h.actor == who || h.joint < 0) return out;
  out.carrier = h.actor, out.joint = h.joint, out.at = h.pose;
  return out;
}

Pose TaskExecutor::pose_at(const Anchor& anchor, double t) const {
  if (!anchor.carrier) return anchor.at;
  return spatial::compose(world_T_joint(actors_[*anchor.carrier], anchor.joint, t), anchor.at);
}

bool TaskExecutor::moves_after(const Anchor& anchor, double t) const {
  return anchor.carrier && moved_until(actors_[*anchor.carrier]) > t + kSameTime;
}

std::array<double, 3> TaskExecutor::signature(const Anchor& anchor) const {
  if (!anchor.carrier) return {};
  const Actor& a = actors_[*anchor.carrier];
  if (a.moves.empty()) return {};
  return {static_cast<double>(a.moves.size()), a.moves.back().start, moved_until(a)};
}

double TaskExecutor::share_at(const Following& f, double t) const {
  if (!(f.end > f.start)) return t < f.start ? 0 : 1;
  const double x = std::clamp((t - f.start) / (f.end - f.start), 0.0, 1.0);
  return f.law.empty() ? spatial::ease(x).v : f.share(x);
}

double TaskExecutor::Following::share(double x) const {
  const double at = x * static_cast<double>(law.size() - 1);
  const auto i = std::min(static_cast<std::size_t>(at), law.size() - 2);
  const double u = at - static_cast<double>(i);
  const spatial::Jet s = spatial::cubic(law[i + 1].v - law[i].v, law[i].d, law[i + 1].d, 1.0, u);
  return law[i].v + s.v;
}

Result<Pose> TaskExecutor::wanted_pose(const Following& f, double t) const {
  const Pose to = pose_at(f.to, t);
  if (f.kind == Following::Kind::straight) return between(pose_at(f.from, t), to, share_at(f, t));
  if (f.kind != Following::Kind::along) return to;
  const double own = t - f.path_begin;
  PathSample s;
  RMP_TRY(f.path->sample(std::span(&own, 1), std::span(&s, 1)));
  return spatial::compose(to, s.pose);
}

Result<PathSample> TaskExecutor::wanted_sample(const Following& f, const Pose& world_T_base,
                                               double t) const {
  using namespace spatial;
  const Pose base_T_world = inverse(world_T_base);
  const auto at = [&](double time) -> Result<Pose> {
    RMP_TRY_ASSIGN(const Pose p, wanted_pose(f, time));
    return compose(base_T_world, p);
  };
  PathSample s;
  RMP_TRY_ASSIGN(s.pose, at(t));
  RMP_TRY_ASSIGN(const Pose ahead, at(t + kRateStep));
  RMP_TRY_ASSIGN(const Pose back, at(t - kRateStep));
  RMP_TRY_ASSIGN(const Pose far, at(t + kAccelerationStep));
  RMP_TRY_ASSIGN(const Pose before, at(t - kAccelerationStep));
  const auto turn = [](const Pose& from, const Pose& to) {
    return rotate(from, rotation_log(compose(inverse(from), to).R));
  };
  s.velocity = scale(sub(ahead.p, back.p), 0.5 / kRateStep);
  s.angular_velocity = scale(turn(back, ahead), 0.5 / kRateStep);
  const double h2 = kAccelerationStep * kAccelerationStep;
  s.acceleration = scale(sub(sub(far.p, s.pose.p), sub(s.pose.p, before.p)), 1 / h2);
  s.angular_acceleration = scale(sub(turn(s.pose, far), turn(before, s.pose)), 1 / h2);
  return s;
}

Result<void> TaskExecutor::solve(const Following& f, const Actor& a, std::span<const double> times,
                                 std::span<const double> seed, sim::RobotMotion& out) const {
  std::vector<PathSample> samples;
  std::vector<Pose> targets;
  for (const double t : times) {
    RMP_TRY_ASSIGN(const PathSample s, wanted_sample(f, a.world_T_base, t));
    samples.push_back(s);
    targets.push_back(s.pose);
  }
  IkBatch batch;
  batch.targets = targets, batch.seeds = seed, batch.continuous = true;
  RMP_TRY_ASSIGN(const auto results, sim::solve_ik(f.ik, batch, *f.progress));
  out = {};
  for (std::size_t i = 0; i < results.size(); ++i) {
    const IkResult& r = results[i];
    if (r.status != IkStatus::solved) {
      const std::span<const double> before =
          out.q.empty() ? seed : std::span<const double>(out.q).last(a.start.size());
      const std::string why = sim::ik_reason(sim_->registry, f.ik, a.record->ik, r, targets[i],
                                             before, *a.maker, *f.progress);
      if (times[i] > f.end + kSameTime && i > 0) {  // the frame leaves with nobody's order
        out.notes = {why.empty() ? "it is out of reach" : why};
        break;
      }
      return error(ErrorCode::unreachable,
                   "robot " + quote(a.placed->name) + " cannot meet " + f.name +
                       " at t = " + text::print_rounded(times[i]) +
                       " s: " + (why.empty() ? "it is out of reach there" : why),
                   "Start the move when the frame is within reach, or make it move more slowly.");
    }
    out.times.push_back(times[i]);
    out.q.insert(out.q.end(), r.q.begin(),
                 r.q.begin() + static_cast<std::ptrdiff_t>(a.start.size()));
  }
  out.qd.resize(out.q.size()), out.qdd.resize(out.q.size());
  sim::joint_rates(*f.ik.model, out.times, out.q, std::span(samples).first(out.times.size()),
                   out.qd, out.qdd);
  // At the end of a joint's range the solver goes on in another configuration.
  const std::size_t n = a.start.size();
  for (std::size_t i = 1; i < out.times.size(); ++i) {
    const std::size_t j = jumping_joint(out, n, i);
    if (j == n) continue;
    const std::string why =
        TaskExecutor::joint_words(a, j) + " would jump by " +
        text::print_rounded(std::fabs(out.q[i * n + j] - out.q[(i - 1) * n + j]), 3) +
        (TaskExecutor::is_rotary(a, j) ? " rad" : " m") + " into another configuration";
    if (out.times[i] > f.end + kSameTime) {
      out.times.resize(i);
      for (auto* table : {&out.q, &out.qd, &out.qdd}) table->resize(i * n);
      out.notes = {why};
      break;
    }
    return error(ErrorCode::unreachable,
                 "robot " + quote(a.placed->name) + " cannot follow " + f.name +
                     " at t = " + text::print_rounded(out.times[i]) + " s: " + why,
                 "Start the move from another configuration, or move the frame towards the middle "
                 "of the joint ranges.");
  }
  return {};
}

std::vector<double> TaskExecutor::row_times(const Following& f, double from, double to) const {
  std::vector<double> out{from};
  for (auto k = static_cast<std::size_t>(std::floor(from / step_)) + 1;; ++k) {
    const double t = step_ * static_cast<double>(k);
    if (t >= to - kSameTime) break;
    out.push_back(t);
  }
  out.push_back(to);
  for (const double t : {f.end, f.path_begin}) out.push_back(t);
  // Where a carrier begins or ends to move the rates of its frame have bends.
  for (const Anchor* anchor : {&f.from, &f.to})
    if (anchor->carrier)
      for (const Move& m : actors_[*anchor->carrier].moves) {
        out.push_back(m.start);
        out.push_back(m.start + m.motion.times.back());
      }
  std::erase_if(out, [&](double t) { return t < from || t > to; });
  std::sort(out.begin(), out.end());
  std::vector<double> rows;
  for (const double t : out)
    if (rows.empty() || t > rows.back() + kSameTime) rows.push_back(t);
  if (rows.back() < to) rows.back() = to;
  return rows;
}

double TaskExecutor::beyond_limits(const Actor& a, const sim::RobotMotion& m, double speed,
                                   std::size_t* joint, double* when) {
  const std::size_t n = a.start.size();
  double worst = 0;
  for (std::size_t k = 0; k < m.qd.size(); ++k) {
    const JointModel& j = a.model->joints[k % n];
    const double v = speed * (std::isfinite(j.max_velocity) ? j.max_velocity : kAssumedRate),
                 acc = std::isfinite(j.max_acceleration) ? j.max_acceleration : v / kAssumedRise;
    const double over = std::max(std::fabs(m.qd[k]) / v, std::sqrt(std::fabs(m.qdd[k]) / acc));
    if (over <= worst) continue;
    worst = over;
    if (joint) *joint = k % n;
    if (when) *when = m.times[k / n];
  }
  return worst;
}

Result<sim::RobotMotion> TaskExecutor::followed(const Following& f, std::size_t who, double t,
                                                bool is_search) const {
  const Actor& a = actors_[who];
  const std::size_t n = a.start.size();
  const JointState now = sample(a, t);
  const bool has_pose = f.goal.empty();
  // The joints go by polynomials up to `meets`, and from there on the tip goes as is wanted.
  const double meets = f.kind == Following::Kind::straight ? t
                       : f.kind == Following::Kind::along  ? std::max(t, f.path_begin)
                                                           : std::max(t, f.end);
  double until = f.end;
  if (has_pose && !is_search)
    for (const Anchor* anchor : {&f.to})
      if (anchor->carrier) until = std::max(until, moved_until(actors_[*anchor->carrier]));
  sim::RobotMotion out, tail;
  if (has_pose) {
    std::vector<double> times =
        is_search ? parts_of(meets, until) : row_times(f, meets, std::max(until, meets));
    const std::size_t wanted = times.size();
    if (wanted == 1) times.push_back(times.back() + step_);
    RMP_TRY(solve(f, a, times, now.q, tail));
    if (tail.times.size() > wanted) {
      tail.times.resize(wanted);
      for (auto* table : {&tail.q, &tail.qd, &tail.qdd}) table->resize(wanted * n);
    }
  } else {
    tail.times = {meets};
    tail.q = f.goal;
    tail.qd.assign(n, 0.0), tail.qdd.assign(n, 0.0);
  }
  if (meets > t + kSameTime) {
    const double way = meets - t;
    std::vector<spatial::Quintic> joints;
    for (std::size_t j = 0; j < n; ++j)
      joints.emplace_back(spatial::Jet{now.q[j], now.qd[j], now.qdd[j]},
                          spatial::Jet{tail.q[j], tail.qd[j], tail.qdd[j]}, way);
    std::vector<double> times = is_search ? parts_of(t, meets) : row_times(f, t, meets);
    if (is_search)
      for (const spatial::Quintic& joint : joints)
        for (const double share : extremes_of(joint)) times.push_back(t + share * way);
    std::sort(times.begin(), times.end());
    for (const double at : times) {
      if (at >= meets - kSameTime) break;
      out.times.push_back(at);
      for (std::size_t j = 0; j < n; ++j) {
        const spatial::Jet s = joints[j].at((at - t) / way);
        out.q.push_back(s.v), out.qd.push_back(s.d), out.qdd.push_back(s.dd);
      }
    }
  } else {
    std::copy(now.q.begin(), now.q.end(), tail.q.begin());
  }
  out.notes = tail.notes;
  out.times.insert(out.times.end(), tail.times.begin(), tail.times.end());
  out.q.insert(out.q.end(), tail.q.begin(), tail.q.end());
  out.qd.insert(out.qd.end(), tail.qd.begin(), tail.qd.end());
  out.qdd.insert(out.qdd.end(), tail.qdd.begin(), tail.qdd.end());
  for (std::size_t k = 0; k < out.q.size(); ++k) {
    const JointModel& joint = a.model->joints[k % n];
    if (out.q[k] >= joint.lower - kSamePlace && out.q[k] <= joint.upper + kSamePlace) continue;
    return error(ErrorCode::unreachable,
                 a.maker->before_place(k % n, std::span(out.q).subspan(k - k % n, n)) + "joint " +
                     quote(joint.name) + " of robot " + quote(a.placed->name) + " would come to " +
                     text::print_rounded(out.q[k]) + ", beyond its limits, on its path to " +
                     f.name,
                 "Give a longer duration, or start from another configuration.");
  }
  return out;
}

/// The shares of a straight move's way over its duration, and how long it takes [s].
Result<double> TaskExecutor::law_of_line(const model::TaskStep& step, Following& f,
                                         const Pose& from, const Pose& to) const {
  const double way = spatial::distance(from.p, to.p), turn = turn_between(from, to);
  f.law.clear();
  if (way < kSamePlace && turn < kSamePlace) return 0.0;
  model::Trajectory line;
  model::TrajectorySegment s;
  s.shape.name = "line";
  s.law.name = "trapezoidal";
  s.points = {model::placement(from), model::placement(to)};
  if (step.duration > 0) s.shape.params["duration"] = step.duration;
  else s.shape.params["speed"] = step.tool_speed > 0 ? step.tool_speed : kFollowSpeed;
  line.segments.push_back(std::move(s));
  RMP_TRY_ASSIGN(const auto path, motion::Path::build(sim_->registry, "move", line, {}));
  constexpr std::size_t kParts = 400;
  std::vector<double> times;
  for (std::size_t i = 0; i <= kParts; ++i)
    times.push_back(path->duration() * static_cast<double>(i) / kParts);
  std::vector<PathSample> samples(times.size());
  RMP_TRY(path->sample(times, samples));
  const double part = path->duration() / kParts;
  const Vec3 along = spatial::sub(to.p, from.p);
  for (const PathSample& one : samples) {
    spatial::Jet j;
    if (way >= kSamePlace) {
      j.v = spatial::dot(spatial::sub(one.pose.p, from.p), along) / (way * way);
      j.d = part * spatial::dot(one.velocity, along) / (way * way);
    } else {
      j.v = turn_between(from, one.pose) / turn;
      j.d = part * spatial::norm(one.angular_velocity) / turn;
    }
    f.law.push_back(j);
  }
  return path->duration();
}

Result<double> TaskExecutor::begin_following(Following f, std::size_t who, double t) {
  Actor& a = actors_[who];
  const model::TaskStep& step = f.step;
  f.start = f.end = f.path_begin = t;
  const Pose from = pose_at(f.from, t), to = pose_at(f.to, t);
  const bool is_together = f.from.carrier == f.to.carrier && f.from.joint == f.to.joint;
  const auto too_fast = [&] {
    return error(ErrorCode::unreachable,
                 "robot " + quote(a.placed->name) + " cannot catch up with " + f.name +
                     " within its speed limits",
                 "Give a higher speed, or start where the frame moves towards it.");
  };
  if (f.kind == Following::Kind::straight) {
    if (is_together && spatial::distance(from.p, to.p) < kSamePlace &&
        turn_between(from, to) < kSamePlace) {
      f.end = t;  // it is there, and stays
    } else {
      double time = 0;
      for (int round = 0;; ++round) {
        // The longer of the ways from one to the other at the start and at the end.
        const Pose late_from = pose_at(f.from, t + time), late_to = pose_at(f.to, t + time);
        const bool is_late =
            spatial::distance(late_from.p, late_to.p) > spatial::distance(from.p, to.p);
        RMP_TRY_ASSIGN(const double next,
                       law_of_line(step, f, is_late ? late_from : from, is_late ? late_to : to));
        const bool is_settled = std::fabs(next - time) < 1e-6;
        time = next;
        if (is_settled || step.duration > 0) break;
        if (round > 10 * kMostRounds || time > kLongest) return too_fast();
      }
      if (step.duration > 0) time = step.duration;
      if (!(time > 0)) time = kAssumedRise;
      for (int round = 0;; ++round) {
        f.end = t + time;
        RMP_TRY_ASSIGN(const auto m, followed(f, who, t, true));
        const double over = beyond_limits(a, m, 1);
        if (over <= kWithinLimits || step.duration > 0) break;
        if (round > kMostRounds || time > kLongest) return too_fast();
        time *= std::min(over, 2.0);
      }
    }
  } else {
    // Up to where the tip is at the frame the joints go as fast as they may.
    double time = f.kind == Following::Kind::joints && step.duration > 0 ? step.duration : 0;
    const double path_time = f.path ? f.path->duration() : 0;
    Pose begins = to;
    if (f.path) {
      RMP_TRY_ASSIGN(begins, wanted_pose(f, t));
    }
    const bool is_there = is_together && f.goal.empty() &&
                          spatial::distance(from.p, begins.p) < 1e-6 &&
                          turn_between(from, begins) < 1e-6;
    if (!is_there && !(time > 0)) {
      time = 1e-3;
      for (int round = 0;; ++round) {
        f.path_begin = f.end = t + time;
        if (f.path) f.end += path_time;
        RMP_TRY_ASSIGN(auto m, followed(f, who, t, true));
        if (f.path) {  // the path itself is as fast as it is given
          const auto rows = static_cast<std::size_t>(
              std::upper_bound(m.times.begin(), m.times.end(), f.path_begin) - m.times.begin());
          m.times.resize(rows);
          for (auto* table : {&m.qd, &m.qdd}) table->resize(rows * a.start.size());
        }
        const double over = beyond_limits(a, m, step.speed);
        if (over <= kWithinLimits) break;
        if (round > kMostRounds || time > kLongest) return too_fast();
        time *= std::min(over, 4.0);
      }
    }
    f.path_begin = f.end = t + time;
    if (f.path) f.end += path_time;
  }
  f.is_dynamic = true;
  a.following = std::move(f);
  RMP_TRY(follow_on(who, t));
  return a.following->end;
}

Result<void> TaskExecutor::give_time(Following& f, std::size_t who, double t) {
  if (f.kind != Following::Kind::joints || f.step.duration > 0 || t >= f.end - kSameTime) return {};
  Actor& a = actors_[who];
  const double before = f.end;
  for (int round = 0; round < kMostRounds; ++round) {
    RMP_TRY_ASSIGN(const auto m, followed(f, who, t, true));
    const double over = beyond_limits(a, m, f.step.speed);
    if (over <= kWithinLimits) break;
    f.end = f.path_begin = t + (f.end - t) * std::min(over, 4.0);
    if (f.end - t > kLongest) {
      f.end = f.path_begin = before;  // a note reports the limit
      break;
    }
  }
  a.busy_until = f.end;
  return {};
}

Result<void> TaskExecutor::follow_on(std::size_t who, double t) {
  Actor& a = actors_[who];
  Following& f = *a.following;
  f.seen = {signature(f.from), signature(f.to)};
  f.stops = std::numeric_limits<double>::infinity();
  RMP_TRY_ASSIGN(sim::RobotMotion m, followed(f, who, t, false));
  const std::vector<std::string> why = std::exchange(m.notes, {});
  if (f.goal.empty() && f.to.carrier) {
    const double until = std::max(f.end, moved_until(actors_[*f.to.carrier]));
    if (m.times.back() < until - kSameTime) {
      f.stops = m.times.back();
      f.why_it_stops = why.empty() ? "it is out of reach" : why.front();
    }
  }
  std::size_t joint = 0;
  double when = 0;
  const double over = beyond_limits(a, m, 1, &joint, &when);
  if (over > kWithinLimits)
    note(t, a.placed->name + " exceeds a limit of " + joint_words(a, joint) + " to follow " +
                f.name + ": " + text::print_rounded(100 * over, 4) +
                " % of its velocity, or of the root of its acceleration, at t = " +
                text::print_rounded(when) + " s");
  a.moves.erase(std::find_if(a.moves.begin(), a.moves.end(),
                             [&](const Move& move) { return move.start >= t; }),
                a.moves.end());
  if (m.times.size() < 2) return {};
  for (double& time : m.times) time -= t;
  m.times.front() = 0;
  a.moves.push_back({t, std::move(m)});
  return {};
}

Result<void> TaskExecutor::refresh_following(double t) {
  for (std::size_t round = 0; round <= actors_.size(); ++round) {
    bool is_changed = false;
    for (std::size_t who = 0; who < actors_.size(); ++who) {
      Actor& a = actors_[who];
      if (!a.following) continue;
      Following& f = *a.following;
      if (t >= f.stops - kSameTime) {  // it stands where the frame left its reach
        note(f.stops, a.placed->name + " stops following " + f.name + ": " + f.why_it_stops);
        a.following.reset();
        continue;
      }
      const std::array<std::array<double, 3>, 2> seen{signature(f.from), signature(f.to)};
      if (seen == f.seen) continue;
      f.seen = seen;
      if (!f.is_dynamic && t >= f.end - kSameTime) continue;  // it stood where the frame stood
      if (!f.is_dynamic && !moves_after(f.to, t)) continue;
      if (f.is_dynamic && !f.goal.empty() && t >= f.end - kSameTime) continue;
      if (!f.is_dynamic && f.kind == Following::Kind::along) {
        note(t, a.placed->name + " continues its trajectory where " + f.name +
                    " was, which moves from now on");
        a.following.reset();
        continue;
      }
      const std::string where = f.where;
      auto done = [&]() -> Result<void> {
        if (!f.is_dynamic) note(t, a.placed->name + " follows " + f.name);
        if (t <= f.start + kSameTime) {
          RMP_TRY_ASSIGN(a.busy_until, begin_following(Following(f), who, t));
          return {};
        }
        f.is_dynamic = true;
        RMP_TRY(give_time(f, who, t));
        return follow_on(who, t);
      }();
      if (!done.ok()) return std::move(done).error().in(where);
      is_changed = true;
    }
    if (!is_changed) return {};
  }
  return error(
      ErrorCode::conflict,
      "robots follow parts of each other in a cycle at t = " + text::print_rounded(t) + " s",
      "Make one of them move to a target in the world.");
}

Result<std::optional<TaskExecutor::Following>> TaskExecutor::following_of(
    const model::TaskStep& step, std::size_t who, const std::string& where, double t,
    Progress& progress) {
  Actor& a = actors_[who];
  Following f;
  f.step = step, f.where = where, f.progress = &progress;
  RMP_TRY_ASSIGN(f.tip, tip(who, step.link));
  const Pose world_T_tip = spatial::compose(world_T_joint(a, f.tip.joint, t), f.tip.joint_T_grip);
  // A tool that still goes with a frame sets out from there.
  f.from.at = world_T_tip;
  const bool leaves = a.following && a.following->is_dynamic && moves_after(a.following->to, t) &&
                      moved_until(a) > t + kSameTime;
  if (leaves) {
    f.from = a.following->to;
    f.from.at = spatial::compose(
        spatial::inverse(world_T_joint(actors_[*f.from.carrier], f.from.joint, t)), world_T_tip);
  }
  const bool has_target = step.target || step.trajectory;
  if (has_target) {
    RMP_TRY_ASSIGN(const Pose world_T_frame, frame(step.frame, t));
    f.to = anchor(step.frame, who, world_T_frame);
    if (step.target) f.to.at = spatial::compose(f.to.at, model::pose(*step.target));
  }
  if (!f.to.carrier && !leaves) return std::optional<Following>{};
  if (f.to.carrier) f.name = quote(step.frame) + " on " + actors_[*f.to.carrier].placed->name;
  else f.name = "its target";
  f.kind = step.trajectory                  ? Following::Kind::along
           : has_target && step.is_straight ? Following::Kind::straight
                                            : Following::Kind::joints;
  if (step.trajectory) {
    const model::Trajectory* stored = sim_->snapshot.get(step.trajectory);
    if (!stored)
      return error(ErrorCode::stale_handle, "its trajectory no longer exists", "Give another one.");
    if (leaves || moves_after(f.to, t)) {
      RMP_TRY_ASSIGN(f.path, motion::Path::build(sim_->registry,
                                                 sim_->snapshot.find(AnyId(step.trajectory))->name,
                                                 *stored, motion::stored_in(sim_->snapshot)));
    }
  } else if (!has_target) {
    f.goal = step.joints;
    if (f.goal.empty()) {
      RMP_TRY_ASSIGN(f.goal, named_pose(*a.record, a.placed->name, step.pose));
    }
    if (f.goal.size() != a.start.size())
      return error(ErrorCode::invalid_argument,
                   "it has " + std::to_string(f.goal.size()) + " joint values, but robot " +
                       quote(a.placed->name) + " has " + std::to_string(a.start.size()),
                   "Give one value per joint.");
  }
  if (a.axes) {
    if (leaves || moves_after(f.to, t))
      return error(ErrorCode::unsupported,
                   "robot " + quote(a.placed->name) + ": " +
                       robotics::why_not_single_joints(*a.model) + ", and cannot follow " + f.name +
                       " yet",
                   "Move it to joint values while the frame is at rest.");
    return std::optional<Following>{};
  }
  auto with_tool = std::make_shared<RobotModel>(*a.model);
  with_tool->tips = {{"tool", f.tip.joint, f.tip.joint_T_grip}};
  RMP_TRY_ASSIGN(f.ik, sim::bind_ik(sim_->registry, std::move(with_tool), a.record->ik));
  f.start = t;
  f.seen = {signature(f.from), signature(f.to)};
  f.is_dynamic = leaves || moves_after(f.to, t);
  return std::optional<Following>(std::move(f));
}

}  // namespace robomosp::task
