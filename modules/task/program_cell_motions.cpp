// SPDX-License-Identifier: Apache-2.0
// How motions of programs begin, blend and take others along.
#include <algorithm>
#include <cmath>
#include <set>

#include "robotics/grip.h"
#include "robotics/maker_axes.h"
#include "robotics/single_joints.h"
#include "spatial/print.h"
#include "task/program_cell.h"

namespace robomosp::task {

Result<ProgramCell::Goal> ProgramCell::goal(const program::Motion& m, const Target& t,
                                            const Beginning& b, const Goal& before) {
  const std::size_t who = b.use->actor, rail = rail_of(who);
  const Pose& frame = b.frame;
  const TaskExecutor::Grip& tip = b.tip;
  Goal out;
  out.target = t.role == RMP_ROLE_ROBTARGET ? &t : nullptr;
  if (t.role == RMP_ROLE_MAIN_JOINT || t.role == RMP_ROLE_JOINT) {
    out.is_joints = true;
    RMP_TRY_ASSIGN(out.q, joints_of(who, t.joints, m.is_incremental));
    if (m.is_incremental)
      for (std::size_t j = 0; j < out.q.size(); ++j) out.q[j] += before.q[rail + j];
    out.q.insert(out.q.begin(), b.rail_to.begin(), b.rail_to.end());
    for (std::size_t j = rail; j < out.q.size(); ++j) {
      const JointModel& joint = x_.actors_[who].model->joints[j];
      if (out.q[j] >= joint.lower - kSame && out.q[j] <= joint.upper + kSame) continue;
      const double unit = TaskExecutor::is_rotary(x_.actors_[who], j) ? kDegree : kMillimetre;
      trouble_ = {};
      trouble_.joint = static_cast<std::int32_t>(j);
      trouble_.value = out.q[j];
      trouble_.excess = std::max(out.q[j] - joint.upper, joint.lower - out.q[j]);
      return error(ErrorCode::unreachable,
                   x_.actors_[who].maker->before_place(j, out.q) + "joint " +
                       std::to_string(j - rail + 1) + " of " + quote(x_.actors_[who].placed->name) +
                       " cannot move to " + text::print_rounded(out.q[j] / unit),
                   "Its range is from " + text::print_rounded(joint.lower / unit) + " to " +
                       text::print_rounded(joint.upper / unit) + ".");
    }
    out.pose = base_T_tip(who, tip, out.q);
    return out;
  }
  if (t.role == RMP_ROLE_ADD_JOINT) {
    if (b.is_tied() && control_of(m, who) != 0) {
      out.pose = before.pose;  // the tool stays in what the path is in
      return out;
    }
    out = before;
    out.is_joints = true;
    return out;
  }
  Pose p = to_pose(t.pose);
  if (m.is_incremental) {
    // By this much in the axes of the targets' frame.
    const Pose now = spatial::compose(spatial::inverse(frame), before.pose);
    Pose turn = p, place_only;
    turn.p = {0, 0, 0};
    place_only.R = now.R;
    Pose next = spatial::compose(turn, place_only);
    if (t.role == RMP_ROLE_POSITION) next = place_only;
    for (std::size_t k = 0; k < 3; ++k) next.p[k] = now.p[k] + p.p[k];
    out.pose = spatial::compose(frame, next);
    return out;
  }
  out.pose = spatial::compose(frame, p);
  if (t.role == RMP_ROLE_POSITION) out.pose.R = before.pose.R;
  return out;
}

Result<const ProgramActor::RobotUse*> ProgramCell::device_of(const MotionAttributes& at) {
  if (at.device == 1) return robot_of(at.robot_symbol);
  std::int64_t number = at.device;
  if (!at.robot.empty()) {
    const auto listed = a_.machine_.evaluate(
        at.robot + ".R_DEVICES[" + std::to_string(at.device) + "]", 0, program::Machine::kNoFrame);
    const auto read = listed.ok() ? text::read_int(listed->value) : std::nullopt;
    if (read) number = *read;
  }
  const auto it = n_.devices.find(number);
  if (it != n_.devices.end()) return &it->second;
  const std::string word = std::to_string(number);
  return error(
      ErrorCode::invalid_argument,
      "DEVICE is " + std::to_string(at.device) +
          (number == at.device ? std::string() : ", which is device " + word + " of " + at.robot) +
          ", but the world has none with that number",
      number < 1 ? std::string("Name one of the robot's R_DEVICES.")
                 : "program.bind{kind = \"robot\", name = \"" + word +
                       "\", to = ...} gives it a robot of the world.");
}

bool ProgramCell::is_braked(std::size_t who) const {
  const auto it = a_.braked_until_.find(who);
  return it != a_.braked_until_.end() &&
         TaskExecutor::moved_until(x_.actors_[who]) <= it->second + kSame;
}

Result<ProgramCell::Beginning> ProgramCell::beginning(const program::Motion& m) {
  const MotionAttributes& at = m.attributes;
  Beginning out;
  RMP_TRY_ASSIGN(out.use, device_of(at));
  const std::size_t who = out.use->actor;
  const TaskExecutor::Actor& robot = x_.actors_[who];
  const std::string& name = robot.placed->name;
  if (const std::string why = robotics::why_not_single_joints(*robot.model); !why.empty())
    return error(ErrorCode::unsupported,
                 "robot " + quote(name) + ": " + why + ", and programs cannot move it yet",
                 TaskExecutor::can_move(robot) ? "Move it with a task."
                                               : "Move it with world.simulate_dynamics.");
  // Where and when it begins.
  if (m.after)
    if (const auto it = a_.open_.find(m.after); it != a_.open_.end() && it->second.actor == who)
      out.before = &it->second;
  const double free_from = TaskExecutor::moved_until(robot);
  // What the program has ended itself comes to rest before.
  const bool waits = out.before || is_braked(who);
  if (!waits && free_from > now_ + kSame)
    return error(ErrorCode::conflict,
                 "robot " + quote(name) +
                     " is still moved by another program, process or task "
                     "at t = " +
                     text::print_rounded(now_) + " s",
                 "Make one wait for a signal or semaphore of the other.");
  out.start = waits ? std::max(now_, free_from) : now_;
  const bool takes_along = std::any_of(m.targets.begin(), m.targets.end(),
                                       [](const Target& t) { return !t.additional.empty(); });
  for (const auto& [joint, other] : n_.joints)
    if (takes_along && !out.before && !other.is_grip && is_braked(other.at))
      out.start = std::max(out.start, TaskExecutor::moved_until(x_.actors_[other.at]));
  if (at.tool || n_.moves_flange) {
    const robotics::LinkFrame flange = robotics::flange_frame(*robot.record);
    out.tip = {flange.joint, at.tool ? spatial::compose(flange.joint_T_link, to_pose(*at.tool))
                                     : flange.joint_T_link};
  } else {
    RMP_TRY_ASSIGN(out.tip, x_.tip(who, out.use->tool));
  }
  RMP_TRY(additional(m, out));
  // Targets are where they are when the rail has come to its end.
  RMP_TRY_ASSIGN(out.frame, base_T_frame(*out.use, at.frame ? &*at.frame : nullptr, out.rail_to));
  RMP_TRY(tie(m, out));
  return out;
}

Result<void> ProgramCell::tie(const program::Motion& m, Beginning& out) {
  constexpr std::int32_t kKeep = 1, kKeepRelative = 2, kOfDevice = 3;
  const MotionAttributes& at = m.attributes;
  const std::size_t who = out.use->actor;
  const std::int32_t control = control_of(m, who);
  const std::vector<double> q = TaskExecutor::sample(x_.actors_[who], out.start).q;
  if (control < 0 || control > kOfDevice)
    return error(ErrorCode::invalid_argument,
                 "ADAX_CONTROL is " + std::to_string(control) + ", which has no meaning",
                 "Give 0, TCP_KEEP, TCP_KEEP_REL or DEVICE_REL.");
  if (control == 0 && rail_of(who) > 0) {
    out.reference_from = base_T_carriage(who, q);
    out.reference_to = base_T_carriage(who, out.rail_to);
    out.reference_is_carriage = true;
  }
  if (control <= kKeep) return {};
  const std::string word = control == kKeepRelative ? "TCP_KEEP_REL" : "DEVICE_REL";
  std::set<std::size_t> devices;
  for (const auto& [number, use] : n_.joints)
    if (!use.is_grip && use.at != who) devices.insert(use.at);
  if (devices.size() != 1)
    return error(
        ErrorCode::invalid_argument,
        devices.empty()
            ? "ADAX_CONTROL is " + word + ", but no additional joint belongs to a positioner"
            : "ADAX_CONTROL is " + word + ", but the additional joints belong to " +
                  std::to_string(devices.size()) + " devices",
        "program.bind{kind = \"joint\", name = \"1\", to = ...} binds the joints of one "
        "positioner.");
  const std::size_t device = *devices.begin();
  out.device = device;
  out.device_from = TaskExecutor::sample(x_.actors_[device], out.start).q;
  out.device_to = out.device_from;
  for (const Along& one : out.along)
    if (one.actor == device) out.device_to = one.to;
  RMP_TRY_ASSIGN(out.device_tip, x_.tip(device, {}));
  const Pose base_T_device = spatial::compose(spatial::inverse(x_.actors_[who].world_T_base),
                                              x_.actors_[device].world_T_base);
  out.reference_from =
      spatial::compose(base_T_device, base_T_tip(device, out.device_tip, out.device_from));
  out.reference_to =
      spatial::compose(base_T_device, base_T_tip(device, out.device_tip, out.device_to));
  if (control == kOfDevice)
    out.frame =
        at.frame ? spatial::compose(out.reference_to, to_pose(*at.frame)) : out.reference_to;
  return {};
}

Result<void> ProgramCell::begin(const program::Motion& m) {
  RMP_TRY_ASSIGN(const Beginning b, beginning(m));
  return begin(m, b);
}

Result<void> ProgramCell::begin(const program::Motion& m, const Beginning& b) {
  const MotionAttributes& at = m.attributes;
  const ProgramActor::OpenMotion* const before = b.before;
  const std::size_t who = b.use->actor;
  const TaskExecutor::Actor& robot = x_.actors_[who];
  const std::string& name = robot.placed->name;
  const double start = b.start;
  const TaskExecutor::Grip& tip = b.tip;
  // PTP from one target to another that takes a TIME of its own.
  const bool is_timed_ptp =
      m.interpolation == RMP_MOVE_PTP && at.time > 0 && m.targets.size() == 1 && b.along.empty();
  const bool passes = is_timed_ptp && at.passes && !(at.c_ptp > 0);
  if (!passes) tell_unheeded(at);
  Goal from;
  from.q = TaskExecutor::sample(robot, start).q;
  from.pose = base_T_tip(who, tip, from.q);
  TaskExecutor::Drive d;
  d.from = from.q;
  std::vector<double> to = from.q;
  RMP_TRY(drive(m, b, from, d, &to));
  // Additional joints go along, in the same time.
  ProgramActor::OpenMotion open;
  std::vector<Along> along = b.along;
  open.grips = b.grips;
  for (const Along& one : along) open.along.push_back(one.actor);
  open.along_from = start;
  if (b.is_tied() && m.interpolation != RMP_MOVE_PTP) {
    open.actor = who, open.tip = tip, open.start = start;
    RMP_TRY_ASSIGN(const double total, begin_tied(b, from.q, d, start, at.time));
    a_.additional_ = b.additional;
    open.end = start + total;
    a_.open_[m.number] = std::move(open);
    return {};
  }
  const std::string where;
  sim::RobotMotion motion;
  double least = 0;
  for (Along& one : along) {
    RMP_TRY_ASSIGN(one.motion, move_along(one, 0, start));
    if (!one.motion.times.empty()) least = std::max(least, one.motion.times.back());
  }
  const auto plan = [&](double when) -> Result<sim::RobotMotion> {
    if (d.trajectory.segments.empty()) return sim::RobotMotion{};
    RMP_TRY_ASSIGN(auto made, x_.driven(who, d, where, when, progress_));
    if (made.times.back() < least && !along.empty()) {
      if (d.trajectory.segments.size() == 1)
        d.trajectory.segments[0].shape.params["duration"] = least;
      RMP_TRY_ASSIGN(made, x_.driven(who, d, where, when, progress_));
    }
    if (m.interpolation != RMP_MOVE_PTP && at.time > 0)
      RMP_TRY(keeps_speeds(who, made, std::max(at.time, made.times.back())));
    return made;
  };
  open.actor = who, open.tip = tip;
  open.velocity_share = d.velocity_share, open.acceleration_share = d.acceleration_share;
  open.c_cp = m.interpolation == RMP_MOVE_PTP ? 0 : at.c_cp * kMillimetre;
  open.c_ptp = m.interpolation == RMP_MOVE_PTP ? at.c_ptp : 0;
  open.c_speed = m.interpolation == RMP_MOVE_PTP ? 1 : at.c_speed / 100;
  open.speed = m.interpolation == RMP_MOVE_PTP || at.time > 0 ? 0 : at.speed * kMillimetre;
  open.is_path = m.interpolation != RMP_MOVE_PTP;
  if (open.is_path) {
    open.speed_orientation = at.time > 0 ? 0 : at.speed_orientation * kDegree;
    open.acceleration = kFullAcceleration * at.acceleration / 100;
    open.angular_acceleration = kFullTurning * at.acceleration / 100;
  }
  open.start = open.end = start;
  if (before && (before->c_cp > 0 || before->c_ptp > 0) && before->c_speed > 0 && along.empty() &&
      !d.trajectory.segments.empty()) {
    RMP_TRY_ASSIGN(const bool is_blended, blend(m.after, *before, who, open, plan));
    if (is_blended) {
      a_.additional_ = b.additional;
      a_.open_[m.number] = std::move(open);
      return {};
    }
    note_once(
        "a transition was omitted where it would exceed the limits of the joints or the "
        "length of the next motion, or where C_SPEED is almost zero; " +
        name + " stops there");
  }
  if (before && (before->c_cp > 0 || before->c_ptp > 0) && !along.empty())
    note_once("a transition was omitted while additional axes move; " + name + " stops there");
  bool is_behind = false;  // it begins with a rate
  std::vector<double> rate(from.q.size(), 0.0);
  if (before && before->passing) {
    ProgramActor::OpenMotion& last = a_.open_[m.after];
    if (is_timed_ptp && can_pass(last)) {
      RMP_TRY_ASSIGN(rate, pass(last, to, at.time));
      is_behind = true;
    } else {
      RMP_TRY(stops(last));
      note_once("C_PASS is ignored if no PTP to one target with a TIME follows directly; " + name +
                " stops there");
    }
  }
  if (passes || is_behind) {
    open.passing = ProgramActor::Passing{};
    open.passing->is_from_rest = !is_behind;
    open.passing->rate = rate, open.passing->to = to;
    open.passing->process = m.process, open.passing->span = m.span;
    motion = cubics(from.q, rate, to, std::vector<double>(to.size(), 0.0), at.time);
    if (!passes) {
      open.passing->end = ProgramActor::Passing::End::stop;
      RMP_TRY(keeps_limits(open, from.q, {}, at.time, nullptr));
    }
  } else {
    RMP_TRY_ASSIGN(motion, plan(start));
    // TIME at the target is spent there.
    if (motion.times.empty() && at.time > 0) motion = cubics(from.q, rate, from.q, rate, at.time);
  }
  double total = motion.times.empty() ? 0 : motion.times.back();
  for (Along& one : along) {
    if (!one.motion.times.empty() && one.motion.times.back() < total - kSame) {
      RMP_TRY_ASSIGN(one.motion, move_along(one, total, start));
    }
    if (!one.motion.times.empty()) total = std::max(total, one.motion.times.back());
    x_.push(one.actor, start, std::move(one.motion));
  }
  x_.push(who, start, std::move(motion));
  a_.additional_ = b.additional;
  open.end = start + total;
  a_.open_[m.number] = std::move(open);
  return {};
}

Result<void> ProgramCell::keeps_speeds(std::size_t who, const sim::RobotMotion& m, double time) {
  const TaskExecutor::Actor& robot = x_.actors_[who];
  const std::size_t n = robot.start.size();
  double worst = kWithin, fastest = 0;
  std::size_t which = n;
  for (std::size_t k = 0; k < m.qd.size(); ++k) {
    const double rate = std::fabs(m.qd[k]), share = rate / robot.model->joints[k % n].max_velocity;
    if (share > worst) worst = share, fastest = rate, which = k % n;
  }
  if (which == n) return {};
  const bool is_rotary = TaskExecutor::is_rotary(robot, which);
  const double unit = is_rotary ? kDegree : kMillimetre;
  const std::string word = is_rotary ? " degrees/s" : " mm/s";
  trouble_ = {};
  trouble_.joint = static_cast<std::int32_t>(which);
  return error(
      ErrorCode::unreachable,
      "TIME of " + text::print_rounded(time) +
          " s is too short: " + robot.maker->before_joint(which) + "joint " +
          std::to_string(which - std::min(which, rail_of(who)) + 1) + " of " +
          quote(robot.placed->name) + " would move at " + text::print_rounded(fastest / unit, 4) +
          word + ", but its maximum is " +
          text::print_rounded(robot.model->joints[which].max_velocity / unit, 4),
      "Give TIME of " + text::print_rounded(std::ceil(time * worst * 1000) / 1000) + " s or more.");
}

void ProgramCell::tell_unheeded(const MotionAttributes& at) {
  if (at.passes && !(at.c_cp > 0) && !(at.c_ptp > 0))
    note_once(
        "C_PASS without C_CP or C_PTP is executed only in PTP to one target with a TIME: the "
        "motion stops at its target");
}

Result<std::vector<ProgramCell::Goal>> ProgramCell::goals_of(const program::Motion& m,
                                                             const Beginning& b, const Goal& from,
                                                             bool solves) {
  std::vector<Goal> goals;
  Goal before = from;
  if (b.is_tied()) {
    if (m.targets.size() > 1 &&
        (m.interpolation == RMP_MOVE_PTP || m.interpolation == RMP_MOVE_LIN))
      return error(ErrorCode::unsupported,
                   "several targets in one motion, while additional axes move with it",
                   "Write a MOVE for each target.");
    std::copy(b.rail_to.begin(), b.rail_to.end(), before.q.begin());
    before.pose = spatial::compose(b.reference_to,
                                   spatial::compose(spatial::inverse(b.reference_from), from.pose));
  }
  for (const Target& t : m.targets) {
    const bool is_kept = t.role == RMP_ROLE_ADD_JOINT && !b.is_tied();
    RMP_TRY_ASSIGN(Goal next, goal(m, t, b, before));
    if (solves && !next.is_joints && !is_kept) {
      RMP_TRY_ASSIGN(next.q, configuration(b.use->actor, b.tip, next.pose, before.q, next.target));
    } else if (next.q.empty()) {
      next.q = before.q;
    }
    if (!is_kept) goals.push_back(next);
    before = std::move(next);
  }
  return goals;
}

Result<void> ProgramCell::drive(const program::Motion& m, const Beginning& b, const Goal& begins,
                                TaskExecutor::Drive& d, std::vector<double>* end) {
  const TaskExecutor::Grip& tip = b.tip;
  Goal from = begins;
  const MotionAttributes& at = m.attributes;
  const bool is_ptp = m.interpolation == RMP_MOVE_PTP;
  RMP_TRY_ASSIGN(std::vector<Goal> goals, goals_of(m, b, from, is_ptp));
  if (goals.empty()) return {};
  if (end && is_ptp) *end = goals.back().q;
  if (b.is_tied() && !is_ptp) {
    // As seen from what the path is in.
    from.pose = spatial::compose(spatial::inverse(b.reference_from), from.pose);
    for (Goal& g : goals) g.pose = spatial::compose(spatial::inverse(b.reference_to), g.pose);
  }
  const auto share = [&](double percent, const char* what) -> Result<double> {
    if (!(percent > 0) || percent > 100)
      return error(ErrorCode::invalid_argument,
                   std::string(what) + " of " + text::print_rounded(percent) + " % is not possible",
                   "Give more than 0 and at most 100.");
    return percent / 100;
  };
  if (is_ptp) {
    RMP_TRY_ASSIGN(d.velocity_share, share(at.speed_ptp, "SPEED_PTP"));
    RMP_TRY_ASSIGN(d.acceleration_share, share(at.acceleration_ptp, "ACC_PTP"));
    std::vector<double> ways;
    double all = 0;
    std::vector<double> q = from.q;
    for (const Goal& g : goals) {
      double way = 0, square = 0;
      for (std::size_t j = 0; j < q.size(); ++j) {
        way = std::max(way, std::fabs(g.q[j] - q[j]));
        square += (g.q[j] - q[j]) * (g.q[j] - q[j]);
      }
      if (std::sqrt(square) < kSameJoints) way = 0;
      ways.push_back(way);
      all += way;
      q = g.q;
    }
    for (std::size_t i = 0; i < goals.size(); ++i) {
      if (ways[i] == 0) continue;
      model::TrajectorySegment s;
      s.shape.name = "ptp";
      s.shape.params["profile"] = std::string("trapezoidal");
      if (at.time > 0) s.shape.params["duration"] = at.time * ways[i] / all;
      s.joints = {goals[i].q};
      d.trajectory.segments.push_back(std::move(s));
    }
    return {};
  }
  if (!(at.speed > 0) || !(at.speed_orientation > 0))
    return error(ErrorCode::invalid_argument,
                 "a speed of " + text::print_rounded(at.speed) + " mm/s and " +
                     text::print_rounded(at.speed_orientation) + " degrees/s is not possible",
                 "SPEED and SPEED_ORI must be above 0.");
  RMP_TRY_ASSIGN(const double acceleration, share(at.acceleration, "ACC"));
  d.tip = tip;
  if (at.weaves && at.wobble_amplitude > 0) {
    double way = 0;
    Vec3 last = from.pose.p;
    for (const Goal& g : goals) way += distance(last, g.pose.p), last = g.pose.p;
    d.weave = motion::Weave{at.wobble_amplitude * kMillimetre, at.wobble_length * kMillimetre};
    // Under TIME: twice the mean speed, over arcs longer than their chords.
    d.weave_speed = at.time > 0 ? kPi * way / at.time : at.speed * kMillimetre;
  }
  const auto segment = [&](const char* shape, std::vector<Pose> points, double part) {
    model::TrajectorySegment s;
    s.shape.name = shape;
    s.law.name = "trapezoidal";
    if (std::string_view(shape) == "cubic_spline") s.orientation.name = "squad";
    for (const Pose& p : points) s.points.push_back(model::placement(p));
    const bool is_timed = at.time > 0;
    if (is_timed) s.shape.params["duration"] = at.time * part;
    s.shape.params["speed"] = is_timed ? kAnySpeed : at.speed * kMillimetre;
    s.shape.params["angular_speed"] = is_timed ? kAnySpeed : at.speed_orientation * kDegree;
    s.shape.params["acceleration"] = kFullAcceleration * acceleration;
    s.shape.params["angular_acceleration"] = kFullTurning * acceleration;
    d.trajectory.segments.push_back(std::move(s));
  };
  if (m.interpolation == RMP_MOVE_CIRCLE) {
    segment("arc", {from.pose, goals.front().pose, goals.back().pose}, 1);
  } else if (m.interpolation == RMP_MOVE_PATH) {
    std::vector<Pose> points{from.pose};
    for (const Goal& g : goals)
      if (distance(points.back().p, g.pose.p) > kSame) points.push_back(g.pose);
    if (points.size() > 1) segment("cubic_spline", points, 1);
  } else {
    double all = 0;
    Pose p = from.pose;
    std::vector<double> parts;
    for (const Goal& g : goals) {
      const double way = distance(p.p, g.pose.p) + 1e-3 * angle_between(p, g.pose);
      parts.push_back(way < kSame ? 0 : way);
      all += parts.back();
      p = g.pose;
    }
    p = from.pose;
    for (std::size_t i = 0; i < goals.size(); ++i) {
      if (parts[i] > 0) segment("line", {p, goals[i].pose}, parts[i] / all);
      p = goals[i].pose;
    }
  }
  return {};
}

template <class Plan>
Result<bool> ProgramCell::blend(std::uint64_t number, const ProgramActor::OpenMotion& before,
                                std::size_t who, ProgramActor::OpenMotion& open, Plan&& plan) {
  const TaskExecutor::Actor& robot = x_.actors_[who];
  const double end = TaskExecutor::moved_until(robot);
  const std::vector<double> q_end = TaskExecutor::sample(robot, end).q,
                            q_start = TaskExecutor::sample(robot, before.start).q;
  const Vec3 tip_end = base_T_tip(who, before.tip, q_end).p;
  const double halfway = before.start + (end - before.start) / 2;
  const auto is_near = [&](double t) {
    const std::vector<double> q = TaskExecutor::sample(robot, t).q;
    if (before.c_cp > 0) return distance(base_T_tip(who, before.tip, q).p, tip_end) <= before.c_cp;
    double way = 0, left = 0;
    for (std::size_t j = 0; j < q.size(); ++j) {
      way = std::max(way, std::fabs(q_end[j] - q_start[j]));
      left = std::max(left, std::fabs(q_end[j] - q[j]));
    }
    return left <= way * std::min(before.c_ptp, 100.0) / 200;
  };
  const double earliest = std::max(now_, halfway);
  double at = end;
  while (at > earliest && is_near(std::max(earliest, at - x_.step())))
    at = std::max(earliest, at - x_.step());
  if (at > earliest) {
    double low = std::max(earliest, at - x_.step());
    for (int i = 0; i < 40; ++i) {
      const double middle = (low + at) / 2;
      (is_near(middle) ? at : low) = middle;
    }
  }
  double overlap = end - at;
  bool is_slowed = before.c_speed >= 1, is_kept = false;
  for (int tries = 0; tries < kTries && overlap > x_.step() / 4; ++tries, overlap /= 2) {
    RMP_TRY_ASSIGN(sim::RobotMotion motion, plan(end - overlap));
    if (motion.times.size() < 2) return false;
    const double lasts = motion.times.back();
    if (lasts < 2 * overlap) {
      overlap = lasts;  // halved next
      continue;
    }
    if (!std::exchange(is_slowed, true)) {
      // C_SPEED: the later it leaves its path, the slower it crosses.
      const double most = slow_crossing(before, who, motion, overlap);
      if (most < overlap) {
        overlap = 2 * most;  // halved next
        continue;
      }
    }
    if (!std::exchange(is_kept, true)) {
      const double most = kept_crossing(before, open, who, motion, overlap);
      if (most < overlap) {
        overlap = 2 * most;  // halved next
        --tries;
        continue;
      }
    }
    const Crossing made = crossing(open.tip, who, motion, overlap);
    if (!x_.push_blended(who, end - overlap, std::move(motion), 1)) continue;
    tell_acceleration(before, open, made, end - overlap);
    open.start = end - overlap;
    open.end = open.start + lasts;
    a_.open_[number].end = end - overlap;
    return true;
  }
  return false;
}

Vec3 ProgramCell::tip_velocity(std::size_t who, const TaskExecutor::Grip& tip,
                               const TaskExecutor::Actor& moved, double t) const {
  constexpr double h = 1e-4;  // [s]
  const double from = std::max(0.0, t - h), to = t + h;
  const Vec3 a = base_T_tip(who, tip, TaskExecutor::sample(moved, from).q).p,
             b = base_T_tip(who, tip, TaskExecutor::sample(moved, to).q).p;
  Vec3 out{};
  for (std::size_t k = 0; k < 3; ++k) out[k] = (b[k] - a[k]) / (to - from);
  return out;
}

double ProgramCell::slow_crossing(const ProgramActor::OpenMotion& before, std::size_t who,
                                  const sim::RobotMotion& next, double overlap) {
  constexpr std::size_t kCount = 200;
  const TaskExecutor::Actor& robot = x_.actors_[who];
  TaskExecutor::Actor after = robot;
  after.moves = {{0, next}};
  after.start.assign(next.q.begin(),
                     next.q.begin() + static_cast<std::ptrdiff_t>(robot.start.size()));
  const double end = TaskExecutor::moved_until(robot);
  double speed = before.speed;
  if (!(speed > 0))  // of its TIME: the greatest that it has
    for (std::size_t k = 0; k <= kCount; ++k) {
      const Vec3 v = tip_velocity(who, before.tip, robot,
                                  before.start + (end - before.start) * static_cast<double>(k) /
                                                     static_cast<double>(kCount));
      speed = std::max(speed, std::hypot(v[0], v[1], v[2]));
    }
  std::vector<Vec3> leaving, coming;
  const double step = overlap / static_cast<double>(kCount);
  for (std::size_t k = 0; k <= kCount; ++k) {
    const double u = step * static_cast<double>(k);
    leaving.push_back(tip_velocity(who, before.tip, robot, end - overlap + u));
    coming.push_back(tip_velocity(who, before.tip, after, u));
  }
  const double wanted = before.c_speed * speed;
  const auto least = [&](std::size_t count) {
    double out = HUGE_VAL;
    for (std::size_t k = 0; k <= count; ++k) {
      const Vec3 &a = leaving[kCount - count + k], &b = coming[k];
      out = std::min(out, std::hypot(a[0] + b[0], a[1] + b[1], a[2] + b[2]));
    }
    return out;
  };
  std::size_t count = kCount;
  while (count > 0 && least(count) > wanted) --count;
  return step * static_cast<double>(count);
}

ProgramCell::Crossing ProgramCell::crossing(const TaskExecutor::Grip& tip, std::size_t who,
                                            const sim::RobotMotion& next, double overlap) const {
  constexpr std::size_t kCount = 64;
  const TaskExecutor::Actor& robot = x_.actors_[who];
  const std::size_t n = robot.start.size();
  TaskExecutor::Actor after = robot;
  after.moves = {{0, next}};
  after.start.assign(next.q.begin(), next.q.begin() + static_cast<std::ptrdiff_t>(n));
  const double end = TaskExecutor::moved_until(robot);
  const std::vector<double> q_end = TaskExecutor::sample(robot, end).q;
  const double span = overlap > 0 ? overlap : next.times.back();
  Crossing out;
  for (std::size_t k = 0; k <= kCount; ++k) {
    const double u = span * static_cast<double>(k) / static_cast<double>(kCount);
    auto s = TaskExecutor::sample(after, u);
    if (overlap > 0) {
      const auto rest = TaskExecutor::sample(robot, end - overlap + u);
      for (std::size_t j = 0; j < n; ++j) {
        s.q[j] += rest.q[j] - q_end[j];
        s.qd[j] += rest.qd[j];
        s.qdd[j] += rest.qdd[j];
      }
    }
    // Derivatives of the tool along the joints' parabola.
    constexpr double h = 1e-4;  // [s]
    const auto at = [&](double t) {
      std::vector<double> q = s.q;
      for (std::size_t j = 0; j < n; ++j) q[j] += t * (s.qd[j] + t / 2 * s.qdd[j]);
      return base_T_tip(who, tip, q);
    };
    const Pose a = at(-h), b = at(0), c = at(h);
    Vec3 v{}, bend{};
    for (std::size_t i = 0; i < 3; ++i) {
      v[i] = (c.p[i] - a.p[i]) / (2 * h);
      bend[i] = (c.p[i] - 2 * b.p[i] + a.p[i]) / (h * h);
    }
    out.speed = std::max(out.speed, std::hypot(v[0], v[1], v[2]));
    out.turning = std::max(out.turning, angle_between(a, c) / (2 * h));
    if (const double most = std::hypot(bend[0], bend[1], bend[2]); most > out.acceleration)
      out.acceleration = most, out.acceleration_after = u;
    for (std::size_t j = 0; j < n; ++j)
      out.joint_share =
          std::max(out.joint_share, std::fabs(s.qd[j]) / robot.model->joints[j].max_velocity);
  }
  return out;
}

double ProgramCell::kept_crossing(const ProgramActor::OpenMotion& before,
                                  const ProgramActor::OpenMotion& open, std::size_t who,
                                  const sim::RobotMotion& next, double overlap) const {
  const TaskExecutor::Actor& robot = x_.actors_[who];
  const double end = TaskExecutor::moved_until(robot);
  // What has no speed of its own, such as PTP, is as fast as it is.
  Crossing most = crossing(open.tip, who, next, 0);
  if (open.speed > 0) most.speed = open.speed;
  if (open.speed_orientation > 0) most.turning = open.speed_orientation;
  double speed = before.speed, turning = before.speed_orientation;
  if (!(speed > 0) || !(turning > 0)) {
    sim::RobotMotion last;
    constexpr std::size_t kCount = 200;
    for (std::size_t k = 0; k <= kCount; ++k) {
      const double u = (end - before.start) * static_cast<double>(k) / static_cast<double>(kCount);
      const auto s = TaskExecutor::sample(robot, before.start + u);
      last.times.push_back(u);
      last.q.insert(last.q.end(), s.q.begin(), s.q.end());
      last.qd.insert(last.qd.end(), s.qd.begin(), s.qd.end());
      last.qdd.insert(last.qdd.end(), s.qdd.begin(), s.qdd.end());
    }
    const Crossing own = crossing(before.tip, who, last, 0);
    if (!(speed > 0)) speed = own.speed;
    if (!(turning > 0)) turning = own.turning;
  }
  most.speed = std::max(most.speed, speed), most.turning = std::max(most.turning, turning);
  const bool bounds_tool = before.is_path || open.is_path;
  most.joint_share = bounds_tool ? 1 : std::max(before.velocity_share, open.velocity_share);
  const auto is_kept = [&](double time) {
    const Crossing c = crossing(open.tip, who, next, time);
    constexpr double kNear = 1e-6;  // [m/s, rad/s] rounding of the differences
    return c.joint_share <= kWithin * most.joint_share &&
           (!bounds_tool || (c.speed <= kWithin * most.speed + kNear &&
                             c.turning <= kWithin * most.turning + kNear));
  };
  if (is_kept(overlap)) return overlap;
  constexpr double kShrink = 0.9;
  constexpr int kScan = 60, kHalvings = 12;
  double low = overlap, high = overlap;
  for (int i = 0; i < kScan && !is_kept(low); ++i) high = low, low *= kShrink;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = (low + high) / 2;
    (is_kept(middle) ? low : high) = middle;
  }
  return low;
}

void ProgramCell::tell_acceleration(const ProgramActor::OpenMotion& before,
                                    const ProgramActor::OpenMotion& open, const Crossing& made,
                                    double start) {
  if (!before.is_path || !open.is_path) return;
  const double most = std::max(before.acceleration, open.acceleration);
  double& told = a_.told_accelerations_[open.actor];
  constexpr double kMore = 1.1;  // than was told before
  if (!(made.acceleration > 1.01 * most) || !(made.acceleration > kMore * told)) return;
  told = made.acceleration;
  note_once("the transition of " + x_.actors_[open.actor].placed->name + " reaches " +
            text::print_rounded(made.acceleration, 3) + " m/s^2 at t = " +
            text::print_rounded(start + made.acceleration_after, 4) + " s, above the " +
            text::print_rounded(most) + " m/s^2 of ACC: there both motions accelerate");
}

Result<sim::RobotMotion> ProgramCell::move_along(const Along& one, double duration, double start) {
  TaskExecutor::Drive d;
  d.from = TaskExecutor::sample(x_.actors_[one.actor], start).q;
  double way = 0;
  for (std::size_t j = 0; j < d.from.size(); ++j)
    way = std::max(way, std::fabs(one.to[j] - d.from[j]));
  if (way < kSameJoints) return sim::RobotMotion{};
  model::TrajectorySegment s;
  s.shape.name = "ptp";
  s.shape.params["profile"] = std::string("trapezoidal");
  if (duration > 0) s.shape.params["duration"] = duration;
  s.joints = {one.to};
  d.trajectory.segments.push_back(std::move(s));
  return x_.driven(one.actor, d, {}, start, progress_);
}

Result<void> ProgramCell::additional(const program::Motion& m, Beginning& b) {
  const double start = b.start;
  std::vector<Along>& along = b.along;
  std::vector<double>& values = b.additional;
  values = a_.additional_;
  // Joints are where they are, whatever the program has set: increments begin there.
  for (const auto& [number, use] : n_.joints) {
    if (use.is_grip) continue;
    if (values.size() < number) values.resize(number);
    values[number - 1] =
        additional_of_joint(number, TaskExecutor::sample(x_.actors_[use.at], start).q[use.joint]);
  }
  const std::size_t rail = rail_of(b.use->actor);
  if (rail > 0) {
    const auto now = TaskExecutor::sample(x_.actors_[b.use->actor], start).q;
    b.rail_to.assign(now.begin(), now.begin() + static_cast<std::ptrdiff_t>(rail));
  }
  for (const Target& t : m.targets) {
    if (t.role != RMP_ROLE_ADD_JOINT && t.role != RMP_ROLE_JOINT && t.role != RMP_ROLE_ROBTARGET)
      continue;
    for (std::size_t k = 0; k < t.additional.size(); ++k) {
      if (values.size() <= k) values.resize(k + 1);
      const double was = values[k],
                   value = m.is_incremental ? was + t.additional[k] : t.additional[k];
      const auto use = n_.joints.find(k + 1);
      if (use == n_.joints.end()) {
        if (value != was)
          return error(ErrorCode::invalid_argument,
                       "additional joint " + std::to_string(k + 1) + " is not bound",
                       "program.bind{kind = \"joint\", name = \"" + std::to_string(k + 1) +
                           "\", to = ...} gives it a joint of the world.");
        continue;
      }
      if (n_.has_no_additional && t.additional[k] == 0 && !use->second.is_grip) {
        if (std::fabs(was) > kSameJoints)
          note_once(
              "the cell has no additional joints (R_NADDJ is 0), and zeros of targets do not move "
              "joint " +
              std::to_string(k + 1) + ", which is bound");
        continue;
      }
      values[k] = value;
      if (use->second.is_grip) {
        if ((was > 0.5) != (value > 0.5)) b.grips.emplace_back(use->second.at, value > 0.5);
        continue;
      }
      const TaskExecutor::Actor& other = x_.actors_[use->second.at];
      const bool is_own = use->second.at == b.use->actor;
      auto one = std::find_if(along.begin(), along.end(),
                              [&](const Along& a) { return a.actor == use->second.at; });
      if (!is_own && one == along.end()) {
        if (TaskExecutor::moved_until(other) > start + kSame)
          return error(ErrorCode::conflict,
                       "robot " + quote(other.placed->name) + " is already being moved",
                       "Make one wait for a signal of the other.");
        one = along.insert(along.end(), {use->second.at, TaskExecutor::sample(other, start).q, {}});
      }
      const double q = joint_of_additional(k + 1, value);
      const JointModel& joint = other.model->joints[use->second.joint];
      if (q < joint.lower - kSame || q > joint.upper + kSame) {
        std::vector<double> there = is_own ? b.rail_to : one->to;
        if (use->second.joint < there.size()) there[use->second.joint] = q;
        return error(ErrorCode::unreachable,
                     "additional joint " + std::to_string(k + 1) + " cannot move to " +
                         text::print_rounded(value),
                     "It is " + other.maker->before_place(use->second.joint, there) + "joint " +
                         quote(joint.name) + " of " + quote(other.placed->name) +
                         ", with the range " + spatial::print_joint_value(joint.lower, joint.type) +
                         " to " + spatial::print_joint_value(joint.upper, joint.type) + ".");
      }
      (is_own ? b.rail_to : one->to)[use->second.joint] = q;
    }
  }
  return {};
}

}  // namespace robomosp::task
