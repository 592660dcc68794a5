// SPDX-License-Identifier: Apache-2.0
// Motions whose path is in what additional axes move.
#include <algorithm>
#include <cmath>
#include <set>

#include "task/program_cell.h"

namespace robomosp::task {

PathSample ProgramCell::carried(const PathSample& frame, const PathSample& s) {
  using namespace spatial;
  const Vec3 r = rotate(frame.pose, s.pose.p), v = rotate(frame.pose, s.velocity),
             turns = rotate(frame.pose, s.angular_velocity);
  const Vec3 &w = frame.angular_velocity, &wd = frame.angular_acceleration;
  PathSample out;
  out.pose = compose(frame.pose, s.pose);
  out.velocity = add(frame.velocity, add(cross(w, r), v));
  out.angular_velocity = add(w, turns);
  out.acceleration =
      add(frame.acceleration, add(add(cross(wd, r), cross(w, cross(w, r))),
                                  add(scale(cross(w, v), 2), rotate(frame.pose, s.acceleration))));
  out.angular_acceleration =
      add(wd, add(rotate(frame.pose, s.angular_acceleration), cross(w, turns)));
  return out;
}

PathSample ProgramCell::moving(const RobotModel& model, std::int32_t joint, const Pose& joint_T_at,
                               std::span<const double> from, std::span<const double> to,
                               const spatial::Jet& share) {
  std::vector<std::size_t> chain;
  for (std::int32_t j = joint; j >= 0; j = model.joints[static_cast<std::size_t>(j)].parent)
    chain.push_back(static_cast<std::size_t>(j));
  PathSample out, still;
  for (std::size_t i = chain.size(); i-- > 0;) {
    const JointModel& one = model.joints[chain[i]];
    const double way = to[chain[i]] - from[chain[i]], q = from[chain[i]] + share.v * way;
    still.pose = one.placement;
    out = carried(out, still);
    PathSample by;
    if (one.type == JointType::prismatic) {
      by.pose.p = {0, 0, q};
      by.velocity = {0, 0, share.d * way}, by.acceleration = {0, 0, share.dd * way};
    } else {
      by.pose.R = spatial::from_quaternion({std::cos(q / 2), 0, 0, std::sin(q / 2)});
      by.angular_velocity = {0, 0, share.d * way};
      by.angular_acceleration = {0, 0, share.dd * way};
    }
    out = carried(out, by);
  }
  still.pose = joint_T_at;
  return carried(out, still);
}

double ProgramCell::least_time(const RobotModel& model, std::span<const double> from,
                               std::span<const double> to) {
  double out = 0;
  for (std::size_t j = 0; j < to.size(); ++j) {
    const JointModel& joint = model.joints[j];
    const double way = std::fabs(to[j] - from[j]);
    const double v = std::isfinite(joint.max_velocity) ? joint.max_velocity : 1;
    const double a = std::isfinite(joint.max_acceleration) ? joint.max_acceleration : 4 * v;
    out = std::max({out, 1.875 * way / v, std::sqrt(10 / std::sqrt(3.0) * way / a)});
  }
  return out;
}

Result<double> ProgramCell::begin_tied(const Beginning& b, const std::vector<double>& q0,
                                       const TaskExecutor::Drive& d, double start, double time) {
  const std::size_t who = b.use->actor, rail = b.rail_to.size();
  const TaskExecutor::Actor& robot = x_.actors_[who];
  std::shared_ptr<const motion::Path> path;
  if (!d.trajectory.segments.empty()) {
    RMP_TRY_ASSIGN(path, motion::Path::build(x_.sim_->registry, "motion", d.trajectory, {}));
  }
  std::optional<motion::Weaving> weaving;
  if (path && d.weave) {
    RMP_TRY_ASSIGN(weaving, motion::Weaving::over(path, *d.weave));
  }
  double total = std::max({path ? path->duration() : 0.0, time,
                           least_time(*robot.model, std::span(q0).first(rail), b.rail_to)});
  for (const Along& one : b.along) {
    const TaskExecutor::Actor& other = x_.actors_[one.actor];
    total = std::max(total, least_time(*other.model, TaskExecutor::sample(other, start).q, one.to));
  }
  if (!(total > kSame)) return 0.0;
  // The path takes as long as the slowest axis.
  const double rate = path ? path->duration() / total : 1;
  RMP_TRY_ASSIGN(const std::vector<double> times, x_.sample_times(start, total, d));
  std::vector<PathSample> samples(times.size());
  if (path) {
    std::vector<double> own = times;
    for (double& t : own) t *= rate;
    RMP_TRY(path->sample(own, samples));
    if (weaving) RMP_TRY(weaving->move(own, samples));
    for (PathSample& s : samples) {
      s.velocity = spatial::scale(s.velocity, rate);
      s.angular_velocity = spatial::scale(s.angular_velocity, rate);
      s.acceleration = spatial::scale(s.acceleration, rate * rate);
      s.angular_acceleration = spatial::scale(s.angular_acceleration, rate * rate);
    }
  } else {
    const Pose stays =
        spatial::compose(spatial::inverse(b.reference_from), base_T_tip(who, b.tip, q0));
    for (PathSample& s : samples) s.pose = stays;
  }
  const auto share = [&](double t) {
    spatial::Jet s = spatial::ease(std::clamp(t / total, 0.0, 1.0));
    s.d /= total, s.dd /= total * total;
    return s;
  };
  const auto last_of_rail = static_cast<std::int32_t>(rail) - 1;
  std::vector<double> rail_from(q0.begin(), q0.begin() + static_cast<std::ptrdiff_t>(rail));
  const bool is_in_carriage = !b.device && b.reference_is_carriage;
  std::vector<Pose> targets;
  for (std::size_t i = 0; i < times.size(); ++i) {
    PathSample& s = samples[i];
    if (is_in_carriage) {
      targets.push_back(s.pose);
      continue;
    }
    if (b.device) {
      const TaskExecutor::Actor& device = x_.actors_[*b.device];
      PathSample base;
      base.pose = spatial::compose(spatial::inverse(robot.world_T_base), device.world_T_base);
      s = carried(carried(base, moving(*device.model, b.device_tip.joint, b.device_tip.joint_T_grip,
                                       b.device_from, b.device_to, share(times[i]))),
                  s);
    }
    if (rail > 0)
      s = sim::seen_from(
          moving(*robot.model, last_of_rail, Pose{}, rail_from, b.rail_to, share(times[i])), s);
    targets.push_back(s.pose);
  }
  Result<void> failed;
  const auto solves = solver(who, b.tip, failed);
  if (!solves) return std::move(failed).error();
  IkBatch batch;
  const std::vector<double> seed(q0.begin() + static_cast<std::ptrdiff_t>(rail), q0.end());
  batch.targets = targets;
  batch.seeds = seed;
  batch.continuous = true;
  RMP_TRY_ASSIGN(const auto results, sim::solve_ik(solves->ik, batch, progress_));
  const std::size_t n = seed.size();
  std::vector<double> q, qd(times.size() * n), qdd(times.size() * n);
  for (std::size_t i = 0; i < results.size(); ++i) {
    const IkResult& r = results[i];
    if (r.status != IkStatus::solved) {
      trouble_ = {};
      trouble_.joint =
          r.limiting_joint < 0 ? -1 : r.limiting_joint + static_cast<std::int32_t>(rail);
      trouble_.excess = std::max(r.shortfall, r.position_error);
      return error(ErrorCode::unreachable,
                   "robot " + quote(robot.placed->name) + " cannot follow at t = " +
                       text::print_rounded(times[i]) + " s of the motion, while additional axes " +
                       "move: " + why_not(who, *solves, r, targets[i], seed),
                   "Move the target or the robot, or move the axes elsewhere.");
    }
    q.insert(q.end(), r.q.begin(), r.q.begin() + static_cast<std::ptrdiff_t>(n));
  }
  sim::joint_rates(*arm_of(who, b.tip), times, q, samples, qd, qdd);
  const auto all = [&](std::size_t actor, std::span<const double> from, std::span<const double> to,
                       bool has_arm) {
    sim::RobotMotion m;
    m.times = times;
    for (std::size_t i = 0; i < times.size(); ++i) {
      const spatial::Jet s = share(times[i]);
      for (std::size_t j = 0; j < to.size(); ++j) {
        m.q.push_back(from[j] + s.v * (to[j] - from[j]));
        m.qd.push_back(s.d * (to[j] - from[j]));
        m.qdd.push_back(s.dd * (to[j] - from[j]));
      }
      for (std::size_t j = 0; has_arm && j < n; ++j) {
        m.q.push_back(q[i * n + j]);
        m.qd.push_back(qd[i * n + j]);
        m.qdd.push_back(qdd[i * n + j]);
      }
    }
    x_.push(actor, start, std::move(m));
  };
  for (const Along& one : b.along) {
    const auto from = TaskExecutor::sample(x_.actors_[one.actor], start).q;
    all(one.actor, from, one.to, false);
  }
  all(who, rail_from, b.rail_to, true);
  return total;
}

}  // namespace robomosp::task
