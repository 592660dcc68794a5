// SPDX-License-Identifier: Apache-2.0
// When the lines of a run of contact physics happen, and along which motions robots move.
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "sim/physics_simulation.h"

namespace robomosp::sim {
namespace {

constexpr double kMostSteps = 1e8;
/// A motion that begins farther from where the robot is would be a jump [rad or m].
constexpr double kJump = 1e-4;

}  // namespace

Result<void> PhysicsSimulation::plan(Progress& progress) {
  double end = 0;
  std::string robot = actors_.size() == 1 ? actors_[0].placed->name : std::string();
  for (std::size_t i = 0; i < run_.actions.size(); ++i) {
    const PhysicsAction& action = run_.actions[i];
    const double begin = action.time.value_or(end);
    if (!action.robot.empty()) robot = action.robot;
    auto planned = plan_one(action, i, begin, robot, progress);
    if (!planned.ok()) return std::move(planned).error().in("action " + std::to_string(i + 1));
    end = *planned;
    last_end_ = std::max(last_end_, end);
  }
  std::stable_sort(events_.begin(), events_.end(),
                   [](const Event& x, const Event& y) { return x.tick < y.tick; });
  duration_ = run_.duration > 0 ? run_.duration : last_end_;
  if (!(duration_ > 0) || duration_ / run_.step > kMostSteps)
    return error(ErrorCode::invalid_argument,
                 duration_ > 0
                     ? "the step is too short for " + text::print_rounded(duration_) + " s"
                     : std::string("no duration of the simulation is given"),
                 "Give a duration such as duration = 2, and a step such as 0.001 s.");
  ticks_ = static_cast<std::int64_t>(std::ceil(duration_ / run_.step - 1e-9));
  if (from_)
    first_ = std::min(ticks_, static_cast<std::int64_t>(std::ceil(from_->time / run_.step - 1e-9)));
  std::erase_if(events_, [this](const Event& e) { return e.tick < first_; });
  return {};
}

Result<double> PhysicsSimulation::plan_one(const PhysicsAction& action, std::size_t number,
                                           double begin, const std::string& robot,
                                           Progress& progress) {
  if (!(begin >= 0) || !std::isfinite(begin) || !(action.duration >= 0) ||
      !std::isfinite(action.duration))
    return error(ErrorCode::invalid_argument, "its time or duration is not a time",
                 "Give times that are not negative.");
  if (action.kind == Kind::wait) return begin + action.duration;
  if (robot.empty())
    return error(ErrorCode::invalid_argument, "the action names no robot", "Name it: robot = ...");
  std::vector<PlacedName> names;
  for (const Actor& a : actors_) names.push_back({a.placed->name});
  RMP_TRY_ASSIGN(const std::size_t who, find(names, "robot", robot));
  Actor& a = actors_[who];
  a.acts = true;
  if (action.kind == Kind::grip) {
    if (a.settings.drive == RobotDrive::limp) return is_limp(robot);
    if (!(action.speed >= 0) || !std::isfinite(action.speed))
      return error(ErrorCode::invalid_argument, "its speed is not a speed",
                   "Give a speed above 0, or leave it out.");
    RMP_TRY_ASSIGN(grip_of_[number], a.grip_of(action.joint, action.force, action.speed));
  }
  if (action.kind != Kind::move) {
    if (!action.object.empty()) {
      RMP_TRY_ASSIGN(const std::size_t what, find(things_, "object", action.object));
      if (!things_[what].is_movable)
        return error(ErrorCode::invalid_argument,
                     text::quote(action.object) + " cannot move: it is fixed or has no mass",
                     "Give its solids a material, or remove it from the fixed objects.");
    }
    if (action.kind == Kind::grasp) RMP_TRY(tip_of(a, action.tool));
    const auto tick = static_cast<std::int64_t>(std::ceil(begin / run_.step - 1e-9));
    events_.push_back({begin, tick, number});
    actor_of_[number] = who;
    return begin + action.duration;
  }
  if (a.settings.drive == RobotDrive::limp) return is_limp(robot);
  if (begin < a.path->end() - 1e-9)
    return error(ErrorCode::invalid_argument,
                 "it begins at " + text::print_rounded(begin) + " s, before robot " +
                     text::quote(robot) + " has ended its move at " +
                     text::print_rounded(a.path->end()) + " s",
                 "Start later, or leave the time out.");
  return plan_move(a, action, begin, progress);
}

Error PhysicsSimulation::is_limp(const std::string& robot) {
  return error(ErrorCode::invalid_argument,
               "robot " + text::quote(robot) + " is not driven, so it cannot follow a motion",
               "Make it moved or controlled.");
}

Result<double> PhysicsSimulation::plan_move(Actor& a, const PhysicsAction& action, double begin,
                                            Progress& progress) {
  const int given = static_cast<int>(!action.q.empty()) + static_cast<int>(!!action.recorded) +
                    static_cast<int>(!action.trajectory.empty());
  if (given != 1)
    return error(ErrorCode::invalid_argument,
                 given == 0 ? "the move has no destination"
                            : "it has more than one of q, recording and trajectory",
                 "Give one of q, recording and trajectory.");
  if (!action.q.empty()) {
    if (action.q.size() != a.model->coordinate_count())
      return error(ErrorCode::invalid_argument,
                   "q has " + std::to_string(action.q.size()) + " numbers, but " +
                       std::to_string(a.model->coordinate_count()) + " are needed",
                   "Give one for each coordinate.");
    if (a.model->dof() != a.model->coordinate_count())
      return error(ErrorCode::unsupported,
                   "robots with spherical or free joints move along recordings only",
                   "Give a recording.");
    for (const double x : action.q)
      if (!std::isfinite(x))
        return error(ErrorCode::invalid_argument, "q holds a number that is not finite",
                     "Correct it.");
    const double duration = action.duration > 0 ? action.duration : least_duration(a, action.q);
    if (!std::isfinite(duration))
      return error(ErrorCode::invalid_argument,
                   "the move has no duration, and not all joints have a velocity limit",
                   "Give its duration.");
    if (duration > 0) RMP_TRY(a.path->add(begin, duration, action.q));
    return begin + duration;
  }
  RecordingPtr recorded = action.recorded;
  if (!action.trajectory.empty()) {
    Run along{run_.world, a.placed->name, action.trajectory, 0, {}};
    RMP_TRY_ASSIGN(recorded, sim_.inverse_kinematics(along, progress));
  }
  // Of several robots, such as of tasks and programs: its own columns.
  const std::string own = a.placed->name + ".";
  RMP_TRY_ASSIGN(auto motion,
                 MotionReference::from_recording(*a.model, *recorded,
                                                 recorded->find(own + "q1") ? own : std::string()));
  MotionReference::Sample s;
  RMP_TRY(motion.at(0, s));
  if (a.path->is_empty() && begin == 0) {
    a.q = s.q;
    RMP_TRY(a.path->start_at(s.q));
  }
  double jump = 0;
  for (std::size_t i = 0; i < s.q.size(); ++i)
    jump = std::max(jump, std::fabs(s.q[i] - a.path->last()[i]));
  if (jump > kJump)
    return error(ErrorCode::invalid_argument,
                 "the motion begins " + text::print_rounded(jump, 3) +
                     " rad or m away from the robot's configuration at that time",
                 "Move there first, or place the robot there.");
  RMP_TRY(a.path->add(begin, std::move(motion)));
  return a.path->end() + action.duration;
}

double PhysicsSimulation::least_duration(const Actor& a, std::span<const double> to) {
  double most = 0;
  for (const JointModel& joint : a.model->joints) {
    if (joint.is_coupled()) continue;
    const std::size_t i = index(joint.q_index);
    const double path = std::fabs(to[i] - a.path->last()[i]);
    if (path == 0) continue;
    most =
        std::max(most, std::isfinite(joint.max_velocity) ? 1.875 * path / joint.max_velocity
                                                         : std::numeric_limits<double>::infinity());
  }
  return most;
}

Result<std::int32_t> PhysicsSimulation::tip_of(const Actor& a, const std::string& tool) {
  std::vector<std::string> names;
  for (const TipModel& tip : a.model->tips) {
    if (tool.empty() || tip.name == tool) return a.base_body + 1 + tip.joint;
    names.push_back(tip.name);
  }
  return error(ErrorCode::unknown_name,
               "robot " + text::quote(a.placed->name) + " has no tool " + text::quote(tool),
               "It has " + text::enumerate(names) + ".");
}

}  // namespace robomosp::sim
