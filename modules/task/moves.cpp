// SPDX-License-Identifier: Apache-2.0
// Moves of robots in tasks, also of those with followers and closed loops.
#include <algorithm>
#include <cmath>

#include "kernel/text.h"
#include "model/placement.h"
#include "robotics/closure.h"
#include "robotics/kinematics.h"
#include "robotics/single_joints.h"
#include "sim/recording_columns.h"
#include "spatial/pose.h"
#include "task/lead.h"
#include "task/members.h"
#include "task/task_executor.h"

namespace robomosp::task {
namespace {

using text::quote;

constexpr double kSameMove = 1e-9;   ///< joint values and times this near are the same
constexpr double kToolSpeed = 0.25;  ///< of straight moves that give none [m/s]
/// A goal's values of joints without motors may be off by this [rad or m].
constexpr double kSameBranch = 0.01;

/// A move to where the joints are: the time asked for, or nothing.
sim::RobotMotion standing_motion(const std::vector<double>& q, double duration) {
  sim::RobotMotion out;
  if (!(duration > 0)) return out;
  out.times = {0, duration};
  for (int i = 0; i < 2; ++i) out.q.insert(out.q.end(), q.begin(), q.end());
  out.qd.assign(out.q.size(), 0.0), out.qdd.assign(out.q.size(), 0.0);
  return out;
}

}  // namespace

Result<model::Trajectory> TaskExecutor::trajectory_of(const model::TaskStep& step, const Actor& a,
                                                      const Grip& tip, double t,
                                                      Pose& world_T_trajectory) const {
  RMP_TRY_ASSIGN(world_T_trajectory, frame(step.frame, t));
  model::Trajectory out;
  if (step.trajectory) {
    const model::Trajectory* stored = sim_->snapshot.get(step.trajectory);
    if (!stored)
      return error(ErrorCode::stale_handle, "its trajectory no longer exists", "Give another one.");
    if (step.target)
      world_T_trajectory = spatial::compose(world_T_trajectory, model::pose(*step.target));
    return *stored;
  }
  model::TrajectorySegment s;
  if (step.is_straight) {
    const Pose now = spatial::compose(world_T_joint(a, tip.joint, t), tip.joint_T_grip);
    const Pose from = spatial::compose(spatial::inverse(world_T_trajectory), now);
    s.shape.name = "line";
    s.law.name = "trapezoidal";
    s.points = {model::placement(from), *step.target};
    if (step.duration > 0) s.shape.params["duration"] = step.duration;
    else s.shape.params["speed"] = step.tool_speed > 0 ? step.tool_speed : kToolSpeed;
  } else {
    if (step.profile == "time_optimal") {
      s.shape.name = step.profile;
    } else {
      s.shape.name = "ptp";
      s.shape.params["profile"] = step.profile.empty() ? std::string("quintic") : step.profile;
    }
    s.shape.params["speed_share"] = step.speed;
    if (step.duration > 0) s.shape.params["duration"] = step.duration;
    if (step.target) {
      s.points = {*step.target};
    } else if (!step.joints.empty()) {
      s.joints = {step.joints};
    } else {
      RMP_TRY_ASSIGN(auto pose, named_pose(*a.record, a.placed->name, step.pose));
      s.joints = {std::move(pose)};
    }
  }
  out.segments.push_back(std::move(s));
  return out;
}

Result<void> TaskExecutor::complete(const Actor& a, model::Trajectory& trajectory,
                                    const std::vector<double>& now) {
  std::vector<std::size_t> motors;
  for (std::size_t j = 0; j < now.size(); ++j)
    if (!a.axes->joints[j].passive) motors.push_back(j);
  for (model::TrajectorySegment& s : trajectory.segments) {
    if (s.joints.empty() || !s.points.empty() || s.stored)
      return error(ErrorCode::unsupported,
                   "robot " + quote(a.placed->name) + ": " +
                       robotics::why_not_single_joints(*a.model) +
                       ", and tasks cannot move its tool to a pose or along a path yet",
                   "Move it to joint values or to a named pose.");
    for (std::vector<double>& q : s.joints) {
      if (q.size() != motors.size() || q.size() == now.size()) continue;
      std::vector<double> all = now;
      for (std::size_t k = 0; k < motors.size(); ++k) all[motors[k]] = q[k];
      q = std::move(all);
    }
  }
  return {};
}

Result<void> TaskExecutor::close(const Actor& a, const std::vector<double>& goal,
                                 sim::RobotMotion& m) {
  const std::size_t n = a.start.size();
  std::vector<bool> held(n);
  for (std::size_t j = 0; j < n; ++j) held[j] = !a.axes->joints[j].passive;
  std::vector<double> at(m.q.begin(), m.q.begin() + static_cast<std::ptrdiff_t>(n));
  for (std::size_t i = 0; i < m.times.size(); ++i) {
    const std::span<double> row = std::span(m.q).subspan(i * n, n);
    std::vector<double> target = at;
    for (std::size_t j = 0; j < n; ++j)
      if (held[j]) target[j] = row[j];
    const robotics::Closure c = robotics::close_loops(*a.model, at, target, held);
    if (!c.is_closed)
      return error(ErrorCode::unreachable,
                   "robot " + quote(a.placed->name) + " cannot continue " +
                       text::print_rounded(m.times[i]) + " s after the move began: its loop " +
                       quote(a.model->loops[c.worst_loop].name) + " would open by " +
                       text::print_rounded(c.residual),
                   "Move its motors less; mark joints without a motor as passive.");
    at = c.q;
    std::copy(at.begin(), at.end(), row.begin());
  }
  for (std::size_t j = 0; j < n; ++j) {
    if (held[j]) continue;
    if (goal.size() == n && std::fabs(at[j] - goal[j]) > kSameBranch)
      return error(ErrorCode::unreachable,
                   a.maker->before_joint(j) + "joint " + quote(a.axes->joints[j].name) +
                       ", which has no motor, would move to " + text::print_rounded(at[j]) +
                       " and not to " + text::print_rounded(goal[j]),
                   "Give values only for the joints with motors.");
    std::vector<double> q;
    for (std::size_t i = 0; i < m.times.size(); ++i) q.push_back(m.q[i * n + j]);
    const std::vector<double> qd = sim::rate_of(m.times, q), qdd = sim::rate_of(m.times, qd);
    for (std::size_t i = 0; i < m.times.size(); ++i)
      m.qd[i * n + j] = qd[i], m.qdd[i * n + j] = qdd[i];
  }
  return {};
}

Result<sim::RobotMotion> TaskExecutor::motion_of(const model::TaskStep& step, std::size_t who,
                                                 const std::string& where, double t,
                                                 Progress& progress) {
  const Actor& a = actors_[who];
  if (!can_move(a)) {
    const auto several = std::find_if(
        a.model->joints.begin(), a.model->joints.end(),
        [](const JointModel& j) { return coordinate_count(j.type) != velocity_count(j.type); });
    return error(ErrorCode::unsupported,
                 "robot " + quote(a.placed->name) + " has the " +
                     (several->type == JointType::free ? "free joint " : "ball joint ") +
                     quote(several->name) + ", but tasks move joints with one coordinate only",
                 "Use robot.simulate to move it by forces.");
  }
  RMP_TRY_ASSIGN(const Grip tip, this->tip(who, step.link));
  Pose world_T_trajectory;
  RMP_TRY_ASSIGN(model::Trajectory trajectory, trajectory_of(step, a, tip, t, world_T_trajectory));
  sim::RobotMotionTask task;
  task.start = sample(a, t).q;
  const auto goal_of = [&] {
    const auto& segments = trajectory.segments;
    return segments.empty() || segments.back().joints.empty() ? std::vector<double>{}
                                                              : segments.back().joints.back();
  };
  const std::vector<double> wanted = goal_of();
  if (a.axes) RMP_TRY(complete(a, trajectory, task.start));
  const std::vector<double> goal = goal_of();
  if (!step.trajectory && goal.size() == task.start.size()) {
    double way = 0;
    for (std::size_t j = 0; j < goal.size(); ++j)
      if (!a.axes || !a.axes->joints[j].passive)
        way = std::max(way, std::fabs(goal[j] - task.start[j]));
    if (way < kSameMove) return standing_motion(task.start, step.duration);
  }
  task.model = a.axes ? a.axes : a.model;
  if (const std::string& led = step.link.empty() ? a.tcp : step.link; !a.axes && !led.empty()) {
    auto with_tool = std::make_shared<RobotModel>(*a.model);
    with_tool->tips = {{led, tip.joint, tip.joint_T_grip}};
    task.model = std::move(with_tool);
  }
  task.ik = a.record->ik;
  task.axes = a.maker;
  task.is_at_start = true;
  task.trajectory = &trajectory;
  task.name = "move";
  task.where = where;
  task.base_T_trajectory = spatial::compose(spatial::inverse(a.world_T_base), world_T_trajectory);
  task.step = step_;
  task.lead = lead_of(t, step_);
  task.stored = motion::stored_in(sim_->snapshot);
  RMP_TRY_ASSIGN(auto m, sim::robot_motion(sim_->registry, task, progress));
  if (m.times.empty() || m.times.front() > 0) {  // between two rows: it starts at rest
    m.times.insert(m.times.begin(), 0.0);
    m.q.insert(m.q.begin(), task.start.begin(), task.start.end());
    for (auto* table : {&m.qd, &m.qdd}) table->insert(table->begin(), task.start.size(), 0.0);
  }
  // It is there already.
  if (!(m.times.back() > 0)) return standing_motion(task.start, step.duration);
  if (!a.model->loops.empty()) RMP_TRY(close(a, wanted, m));
  return m;
}

Result<double> TaskExecutor::move(const model::TaskStep& step, const std::string& robot,
                                  const std::string& where, double t, Progress& progress) {
  RMP_TRY_ASSIGN(const std::size_t who, actor(robot));
  Actor& a = actors_[who];
  const bool is_led = a.following && a.following->is_dynamic;
  const double busy_until = is_led ? a.busy_until : std::max(a.busy_until, moved_until(a));
  if (busy_until > t + kSameMove)
    return error(ErrorCode::conflict,
                 "robot " + quote(robot) +
                     " is still moved by another task at t = " + text::print_rounded(t) + " s",
                 "Make one wait for a signal of the other.");
  std::optional<Following> follows;
  if (can_move(a)) {
    RMP_TRY_ASSIGN(follows, following_of(step, who, where, t, progress));
  }
  if (follows && follows->is_dynamic) {
    note(t, robot + (follows->to.carrier ? " follows " + follows->name
                                         : " leaves " + a.following->name));
    RMP_TRY_ASSIGN(a.busy_until, begin_following(std::move(*follows), who, t));
    return a.busy_until;
  }
  a.following.reset();
  RMP_TRY_ASSIGN(auto motion, motion_of(step, who, where, t, progress));
  if (motion.times.size() < 2) return t;
  for (const std::string& n : motion.notes)
    if (told_.emplace(robot, n).second) note(t, robot + ": " + n);
  const double end = t + motion.times.back();
  if (follows) {
    follows->end = follows->path_begin = end;
    if (follows->kind == Following::Kind::straight) {
      // Its shares, for what is left of it when the frame begins to move.
      const auto law =
          law_of_line(step, *follows, pose_at(follows->from, t), pose_at(follows->to, t));
      if (!law.ok()) return law.error();
    }
    a.following = std::move(follows);
  }
  a.moves.push_back({t, std::move(motion)});
  a.busy_until = end;
  return end;
}

}  // namespace robomosp::task
