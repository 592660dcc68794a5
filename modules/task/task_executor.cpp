// SPDX-License-Identifier: Apache-2.0
#include "task/task_executor.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "kernel/text.h"
#include "model/placement.h"
#include "robotics/closure.h"
#include "robotics/grip.h"
#include "robotics/home.h"
#include "robotics/kinematics.h"
#include "sim/base_motion.h"
#include "spatial/passing.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"
#include "task/members.h"

namespace robomosp::task {
namespace {

using text::quote;

constexpr double kSameInstant = 1e-9;  ///< [s]
constexpr double kOff = 1e-4;  ///< an object in a grip that is farther off has met something [m]

/// For the laws of moves: a joint a coordinate, with the limits of those that follow it.
std::shared_ptr<const RobotModel> axes_of(const RobotModel& model) {
  auto out = std::make_shared<RobotModel>();
  out->name = model.name;
  for (const JointModel& j : model.joints)
    if (!j.is_coupled()) {
      out->joints.push_back(j);
      out->joints.back().parent = static_cast<std::int32_t>(out->joints.size()) - 2;
    }
  for (const JointModel& j : model.joints) {
    if (!j.is_coupled() || j.coupling.ratio == 0) continue;
    JointModel& of = out->joints[static_cast<std::size_t>(j.q_index)];
    const double ratio = j.coupling.ratio, k = 1 / std::fabs(ratio);
    double low = (j.lower - j.coupling.offset) / ratio,
           high = (j.upper - j.coupling.offset) / ratio;
    if (ratio < 0) std::swap(low, high);
    of.lower = std::max(of.lower, low), of.upper = std::min(of.upper, high);
    of.max_velocity = std::min(of.max_velocity, k * j.max_velocity);
    of.max_acceleration = std::min(of.max_acceleration, k * j.max_acceleration);
    of.max_jerk = std::min(of.max_jerk, k * j.max_jerk);
  }
  out->tips.push_back({"tool", static_cast<std::int32_t>(out->joints.size()) - 1, Pose{}});
  out->number_coordinates();
  return out;
}

}  // namespace

Result<TaskExecutor> TaskExecutor::create(const sim::Simulator& sim, WorldId id, double step,
                                          Progress& progress) {
  TaskExecutor s(sim, step);
  s.id_ = id;
  s.world_ = sim.snapshot.get(id);
  if (!s.world_)
    return error(ErrorCode::stale_handle, "the world no longer exists", "Open or create one.");
  for (const model::PlacedRobot& placed : s.world_->robots) {
    if (const auto stands = sim::note_on_standing_base(placed, "tasks do")) s.note(0, *stands);
    Actor a;
    a.placed = &placed;
    a.record = sim.snapshot.get(placed.robot);
    a.maker = robotics::MakerAxes::for_messages(a.record);
    const Pose mounting = model::pose(placed.placement);
    RMP_TRY_ASSIGN(a.model, sim.derived.robot_model(
                                sim.snapshot, placed.robot,
                                spatial::rotate_back(mounting, s.world_->gravity), progress));
    a.world_T_base = spatial::compose(mounting, a.model->base);
    a.start = placed.q.empty() ? robotics::home_joint_values(*a.record) : placed.q;
    if (a.start.size() != a.model->coordinate_count())
      return error(ErrorCode::invalid_argument,
                   "robot " + quote(placed.name) + " is placed with " +
                       std::to_string(a.start.size()) + " joint values, but it has " +
                       std::to_string(a.model->coordinate_count()),
                   "Set its joint values again.");
    if (can_move(a) && (!a.model->is_simple() || !a.model->loops.empty()))
      a.axes = axes_of(*a.model);
    if (!a.model->loops.empty()) {
      const std::vector<bool> held(a.model->dof(), false);
      const robotics::Closure c = robotics::close_loops(*a.model, a.start, a.start, held);
      if (c.is_closed) a.start = c.q;
    }
    s.actor_of_.emplace(placed.name, s.actors_.size());
    s.actors_.push_back(std::move(a));
  }
  for (const model::PlacedObject& placed : s.world_->objects) {
    s.thing_of_.emplace(placed.name, s.things_.size());
    s.things_.push_back({&placed, {{0, 0, false, -1, model::pose(placed.placement)}}, false});
  }
  for (const model::Signal& signal : s.world_->signals) {
    s.wire_of_.emplace(signal.name, s.wires_.size());
    s.wires_.push_back({&signal, {{0, signal.initial}}});
  }
  s.started_.resize(s.world_->tasks.size());
  for (std::size_t i = 0; i < s.world_->tasks.size(); ++i)
    s.task_of_.emplace(s.world_->tasks[i].name, i);
  for (std::size_t i = 0; i < s.world_->frames.size(); ++i)
    s.frame_of_.emplace(s.world_->frames[i].name, i);
  for (const model::Attachment& held : s.world_->attachments) {
    RMP_TRY_ASSIGN(const std::size_t who, s.actor(held.robot));
    RMP_TRY_ASSIGN(const std::size_t what, find_member(s.thing_of_, held.object, "object"));
    RMP_TRY_ASSIGN(const Grip g, s.grip(s.actors_[who], held.link));
    s.things_[what].history = {
        {0, who, true, g.joint, spatial::compose(g.joint_T_grip, model::pose(held.tool_T_object))}};
  }
  return s;
}

Result<std::size_t> TaskExecutor::actor(const std::string& name) const {
  if (name.empty())
    return error(ErrorCode::invalid_argument, "neither the step nor its task names a robot",
                 "Give a robot to the step, or to the task in the world.");
  return find_member(actor_of_, name, "robot");
}

double TaskExecutor::busy_until(const std::string& robot) const {
  const auto it = actor_of_.find(robot);
  return it == actor_of_.end() ? 0 : actors_[it->second].busy_until;
}

Result<TaskExecutor::Grip> TaskExecutor::grip(const Actor& a, const std::string& link) const {
  if (const auto found = robotics::find_grip(*a.record, *a.model, link))
    return Grip{found->joint, found->joint_T_link};
  std::vector<std::string> known;
  for (const model::Link& own : a.record->links) known.push_back(own.name);
  for (const model::RobotTool& tool : a.record->tools) known.push_back(tool.name);
  for (const model::AttachedTool& tool : a.record->attached) known.push_back(tool.name);
  return error(ErrorCode::unknown_name,
               "robot " + quote(a.placed->name) + " has no link or tool " + quote(link),
               "It has " + text::enumerate(known) + ".");
}

const TaskExecutor::Thing* TaskExecutor::thing_of(const std::string& object_or_point,
                                                  std::string& point) const {
  point.clear();
  if (const auto it = thing_of_.find(object_or_point); it != thing_of_.end())
    return &things_[it->second];
  const auto dot = object_or_point.rfind('.');
  if (dot == std::string::npos) return nullptr;
  const auto it = thing_of_.find(object_or_point.substr(0, dot));
  if (it == thing_of_.end()) return nullptr;
  point = object_or_point.substr(dot + 1);
  return &things_[it->second];
}

Result<Pose> TaskExecutor::centre_point(const Thing& thing, const std::string& name) const {
  std::vector<std::string> known;
  if (thing.placed->what.kind == Kind::object)
    if (const auto* object = sim_->snapshot.get(ObjectId{thing.placed->what.number}))
      for (const model::ToolCentrePoint& t : object->tcps) {
        if (t.name == name) return model::pose(t.placement);
        known.push_back(t.name);
      }
  return error(ErrorCode::unknown_name,
               "object " + quote(thing.placed->name) + " has no tool centre point " + quote(name),
               known.empty() ? "It has none; Add one with object.add_tcp."
                             : "It has " + text::enumerate(known) + ".");
}

Result<TaskExecutor::Grip> TaskExecutor::tip(std::size_t who, const std::string& given) const {
  const Actor& a = actors_[who];
  const std::string& name = given.empty() ? a.tcp : given;
  auto found = grip(a, name);
  std::string point;
  const Thing* thing = found.ok() ? nullptr : thing_of(name, point);
  if (!thing) return found;
  Grip at;
  if (!point.empty()) {
    RMP_TRY_ASSIGN(at.joint_T_grip, centre_point(*thing, point));
  }
  const Held& h = thing->history.back();
  if (h.is_held && h.actor == who)
    return Grip{h.joint, point.empty() ? h.pose : spatial::compose(h.pose, at.joint_T_grip)};
  return error(
      ErrorCode::conflict,
      "robot " + quote(a.placed->name) + " does not hold object " + quote(thing->placed->name),
      "Attach it before moving it as a tool.");
}

bool TaskExecutor::can_move(const Actor& a) {
  return a.model->dof() == a.model->coordinate_count();
}

bool TaskExecutor::is_rotary(const Actor& a, std::size_t coordinate) {
  const auto& joints = a.axes ? a.axes->joints : a.model->joints;
  return joints[coordinate].type == JointType::revolute;
}

std::string TaskExecutor::joint_words(const Actor& a, std::size_t j) {
  const JointModel& m = a.model->joints[j];
  const bool has_axis = !m.is_coupled() && coordinate_count(m.type) == 1;
  return (has_axis ? a.maker->before_joint(static_cast<std::size_t>(m.q_index)) : std::string()) +
         "joint " + quote(m.name);
}

TaskExecutor::JointState TaskExecutor::sample(const Actor& a, double t) {
  JointState out;
  sample(a, t, out);
  return out;
}

void TaskExecutor::sample(const Actor& a, double t, JointState& out) {
  const std::size_t n = a.start.size();
  out.q = a.start;
  out.qd.assign(n, 0.0), out.qdd.assign(n, 0.0);
  const auto after = std::upper_bound(a.moves.begin(), a.moves.end(), t,
                                      [](double x, const Move& m) { return x < m.start; });
  if (after == a.moves.begin()) return;
  const sim::RobotMotion& m = std::prev(after)->motion;
  const double u = t - std::prev(after)->start;
  const auto next = static_cast<std::size_t>(std::upper_bound(m.times.begin(), m.times.end(), u) -
                                             m.times.begin());
  if (next == m.times.size()) {
    out.q.assign(m.q.end() - static_cast<std::ptrdiff_t>(n), m.q.end());
    return;
  }
  // Cubic between samples, by value and rate at both; accelerations are linear.
  const std::size_t i = next == 0 ? 0 : next - 1;
  const double h = m.times[i + 1] - m.times[i], x = (u - m.times[i]) / h;
  for (std::size_t j = 0; j < n; ++j) {
    const std::size_t k = i * n + j, l = k + n;
    const spatial::Jet s = spatial::cubic(m.q[l] - m.q[k], m.qd[k], m.qd[l], h, u - m.times[i]);
    out.q[j] = m.q[k] + s.v;
    out.qd[j] = s.d;
    out.qdd[j] = m.qdd[k] + x * (m.qdd[l] - m.qdd[k]);
  }
}

Pose TaskExecutor::world_T_joint(const Actor& a, std::int32_t joint, double t) const {
  if (joint < 0) return a.world_T_base;
  std::vector<Pose> frames(a.model->joints.size());
  robotics::forward_kinematics(*a.model, sample(a, t).q, frames);
  return spatial::compose(a.world_T_base, frames[static_cast<std::size_t>(joint)]);
}

Pose TaskExecutor::pose_of(const Thing& thing, double t) const {
  if (is_loose(thing) && t >= physics_->now() - kSameInstant && t >= thing.history.back().from)
    return physics_->pose(place_of(thing), t);
  const auto after = std::upper_bound(thing.history.begin(), thing.history.end(), t,
                                      [](double x, const Held& h) { return x < h.from; });
  const Held& h = after == thing.history.begin() ? *after : *std::prev(after);
  return h.is_held ? spatial::compose(world_T_joint(actors_[h.actor], h.joint, t), h.pose) : h.pose;
}

Result<Pose> TaskExecutor::frame(const std::string& name, double t) const {
  if (name.empty()) return Pose{};
  if (const auto it = frame_of_.find(name); it != frame_of_.end())
    return model::pose(world_->frames[it->second].placement);
  if (const auto it = thing_of_.find(name); it != thing_of_.end())
    return pose_of(things_[it->second], t);
  return find_member(frame_of_, name, "frame or object").error();
}

Result<void> TaskExecutor::attach(const model::TaskStep& step, const std::string& robot, double t,
                                  Progress& progress) {
  const std::string& object = step.object;
  RMP_TRY_ASSIGN(const std::size_t what, find_member(thing_of_, object, "object"));
  RMP_TRY_ASSIGN(const std::size_t who, actor(robot));
  RMP_TRY_ASSIGN(Grip point, grip(actors_[who], step.link));
  // A held gripper whose centre point leads the robot takes with that point.
  if (step.link.empty() && !actors_[who].tcp.empty()) {
    RMP_TRY_ASSIGN(point, tip(who, ""));
  }
  if (!step.tcp.empty()) RMP_TRY(centre_point(things_[what], step.tcp));
  RMP_TRY_ASSIGN(const Gripper from, gripper(who, step.link, point, t, progress));
  const double reach = step.reach > 0 ? step.reach : kReach;
  RMP_TRY_ASSIGN(const double away, distance(from, things_[what], t, progress));
  things_[what].is_missed = away > reach;
  if (!things_[what].is_missed) return take(step, robot, t);
  note(t, robot + " does not take " + object + ": " + missed(robot, from, object, away, reach));
  return {};
}

Result<void> TaskExecutor::take(const model::TaskStep& step, const std::string& robot, double t) {
  const std::string& object = step.object;
  RMP_TRY_ASSIGN(const std::size_t what, find_member(thing_of_, object, "object"));
  RMP_TRY_ASSIGN(const std::size_t who, actor(robot));
  RMP_TRY_ASSIGN(const Grip g, grip(actors_[who], step.link));
  if (!step.tcp.empty()) RMP_TRY(centre_point(things_[what], step.tcp));
  const Pose pose = pose_of(things_[what], t);
  const Pose joint = world_T_joint(actors_[who], g.joint, t);
  things_[what].history.push_back(
      {t, who, true, g.joint, spatial::compose(spatial::inverse(joint), pose)});
  note(t, robot + " takes " + object);
  led_by_own_tool(object);  // whoever it was handed over by
  if (physics_) RMP_TRY(physics_->hold(what, who, g.joint, things_[what].history.back().pose));
  if (!step.tcp.empty()) actors_[who].tcp = object + "." + step.tcp;
  return {};
}

void TaskExecutor::led_by_own_tool(const std::string& object) {
  for (Actor& a : actors_)
    if (a.tcp.substr(0, a.tcp.rfind('.')) == object) a.tcp.clear();
}

Result<void> TaskExecutor::detach(const std::string& object, double t) {
  RMP_TRY_ASSIGN(const std::size_t what, find_member(thing_of_, object, "object"));
  if (!things_[what].history.back().is_held) {
    if (things_[what].is_missed) {
      note(t, object + " is not released: it was out of reach when it should have been grasped");
      return {};
    }
    return error(ErrorCode::conflict, "nothing holds object " + quote(object), "Attach it first.");
  }
  Pose pose = pose_of(things_[what], t);
  note(t, object + " is released");
  if (physics_) {
    RMP_TRY(physics_->let_go(what));
    if (physics_->is_movable(what)) {
      // Where it came to while it was held: what it was pressed against has its say.
      const Pose there = physics_->pose(what, t);
      const double off = spatial::norm(spatial::sub(there.p, pose.p));
      if (off > kOff)
        note(t, object + " is " + text::print_rounded(1000 * off, 2) +
                    " mm from its held position: it hit something");
      pose = there;
    } else {
      note(t, object + " has no mass or is fixed, so it stays in place");
    }
  }
  things_[what].history.push_back({t, 0, false, -1, pose});
  led_by_own_tool(object);
  return {};
}

Result<void> TaskExecutor::set(const std::string& signal, const std::string& expression, double t) {
  RMP_TRY_ASSIGN(const std::size_t at, find_member(wire_of_, signal, "signal"));
  Wire& w = wires_[at];
  RMP_TRY_ASSIGN(const double value, evaluate(expression, w.signal->unit, t));
  if (w.signal->kind == model::SignalKind::digital && value != 0 && value != 1)
    return error(ErrorCode::invalid_argument,
                 "the digital signal " + quote(signal) + " cannot be " + text::print_rounded(value),
                 "It is 0 or 1.");
  w.history.emplace_back(t, value);
  ++changes_;
  return {};
}

bool TaskExecutor::start_task(std::size_t task) {
  Started& s = started_[task];
  if (s.is_running) return false;
  s = {s.is_of_program, true, true, false};
  ++changes_;
  return true;
}

void TaskExecutor::task_ends(std::size_t task) {
  started_[task].is_running = false;
  started_[task].is_done = true;
  ++changes_;
}

// What the notes of a run may take, and what each takes besides its letters [bytes].
constexpr std::size_t kMostNoteBytes = std::size_t{64} << 20, kBytesOfNote = 64;

void TaskExecutor::note(double t, const std::string& text) {
  if (note_bytes_ > kMostNoteBytes) return;
  note_bytes_ += text.size() + kBytesOfNote;
  notes_.push_back("t = " + text::print_rounded(t) + " s: " +
                   (note_bytes_ > kMostNoteBytes
                        ? std::string("the notes are longer than 64 MB; later ones are left out")
                        : text));
}

recording::Recording TaskExecutor::recording(double end) const {
  std::vector<double> times;
  const auto whole = static_cast<std::size_t>(end / step_ * (1 + 1e-12));
  for (std::size_t i = 0; i <= whole; ++i) times.push_back(step_ * static_cast<double>(i));
  if (times.back() < end - 1e-9) times.push_back(end);
  return table(std::move(times));
}

recording::Recording TaskExecutor::table(std::vector<double> at, std::size_t told) const {
  recording::Recording out;
  out.world = id_;
  out.notes.assign(notes_.begin() + static_cast<std::ptrdiff_t>(std::min(told, notes_.size())),
                   notes_.end());
  out.loads.emplace();
  for (const Thing& thing : things_)
    for (std::size_t i = 0; i < thing.history.size(); ++i) {
      const Held& h = thing.history[i];
      if (!h.is_held) continue;
      recording::Load load;
      load.robot = actors_[h.actor].placed->name;
      load.object = thing.placed->name;
      load.what = thing.placed->what;
      load.joint = h.joint;
      load.joint_T_object = h.pose;
      load.from = h.from;
      if (i + 1 < thing.history.size()) load.to = thing.history[i + 1].from;
      out.loads->push_back(std::move(load));
    }
  recording::Column time{"time", "s", "time from the start of the tasks", {}};
  time.values = at;
  const std::vector<double> times = std::move(at);
  out.columns.push_back(std::move(time));
  for (const Actor& a : actors_) {
    if (!can_move(a)) continue;  // it stands still
    const std::size_t n = a.start.size(), first = out.columns.size();
    const auto& joints = (a.axes ? a.axes : a.model)->joints;
    const auto add = [&](const char* stem, const char* what, const char* rate, auto&& limits) {
      for (std::size_t j = 0; j < n; ++j) {
        const std::string number = std::to_string(j + 1);
        recording::Column c{a.placed->name + stem + number,
                            (is_rotary(a, j) ? "rad" : "m") + std::string(rate),
                            std::string(what) + " of " + a.maker->before_joint(j) + "joint " +
                                number + " of " + a.placed->name,
                            {}};
        std::tie(c.lower, c.upper) = limits(joints[j]);
        out.columns.push_back(std::move(c));
      }
    };
    add(".q", "position", "", [](const JointModel& j) { return std::pair(j.lower, j.upper); });
    add(".qd", "velocity", "/s",
        [](const JointModel& j) { return std::pair(-j.max_velocity, j.max_velocity); });
    add(".qdd", "acceleration", "/s^2",
        [](const JointModel& j) { return std::pair(-j.max_acceleration, j.max_acceleration); });
    for (const double t : times) {
      const JointState s = sample(a, t);
      for (std::size_t j = 0; j < n; ++j) {
        out.columns[first + j].values.push_back(s.q[j]);
        out.columns[first + n + j].values.push_back(s.qd[j]);
        out.columns[first + 2 * n + j].values.push_back(s.qdd[j]);
      }
    }
  }
  for (const Wire& w : wires_) {
    recording::Column c{"signal." + w.signal->name, w.signal->unit, w.signal->description, {}};
    for (const double t : times) {
      const auto after =
          std::upper_bound(w.history.begin(), w.history.end(), t,
                           [](double x, const auto& change) { return x < change.first; });
      c.values.push_back(std::prev(after)->second);
    }
    out.columns.push_back(std::move(c));
  }
  for (const Thing& thing : things_) {
    if (thing.history.size() == 1 && !thing.history[0].is_held && !is_loose(thing)) continue;
    const std::size_t first = out.columns.size();
    for (const char* part : recording::kPlaceColumns)
      out.columns.push_back({thing.placed->name + part,
                             part[1] == 'q' ? "" : "m",
                             "place of " + thing.placed->name + " in the world",
                             {}});
    for (const double t : times) {
      const Pose p = pose_of(thing, t);
      const spatial::Quaternion r = spatial::to_quaternion(p.R);
      const double w[] = {r.w, r.x, r.y, r.z};
      for (std::size_t k = 0; k < 3; ++k) out.columns[first + k].values.push_back(p.p[k]);
      for (std::size_t k = 0; k < 4; ++k) out.columns[first + 3 + k].values.push_back(w[k]);
    }
  }
  return out;
}

}  // namespace robomosp::task
