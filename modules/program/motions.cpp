// SPDX-License-Identifier: Apache-2.0
// Motions of programs: attributes and targets, checked and handed to the world.
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "program/real_literal.h"
#include "program/state.h"

namespace robomosp::program {

PlainPose Run::pose_of(const Slot* s) const {
  PlainPose p;
  for (std::size_t k = 0; k < 3; ++k) p.position[k] = s[k].real();
  for (std::size_t k = 0; k < 4; ++k) p.quaternion[k] = s[3 + k].real();
  return p;
}

/// Whether field `k` of a record of joints is an INT.
bool Run::is_whole_joint(std::uint32_t type, std::uint32_t k) const {
  const rmp_code_type& x = c_.type(type);
  return k < x.field_count && c_.type(c_.field(x.first_field + k).type).kind == RMP_TYPE_INT;
}

Target Run::target_of(std::uint32_t type, const Slot* s) const {
  Target t;
  const rmp_code_type& x = c_.type(type);
  t.role = x.role;
  const auto reals = [&](std::uint32_t of, const Slot* from, std::vector<double>& to) {
    for (std::uint32_t k = 0; k < c_.types[of].slots; ++k)
      to.push_back(is_whole_joint(of, k) ? double(from[k].integer()) : from[k].real());
  };
  const auto field = [&](std::uint32_t k) { return c_.field(x.first_field + k).type; };
  switch (x.role) {
    case RMP_ROLE_POSITION:
      for (std::size_t k = 0; k < 3; ++k) t.pose.position[k] = s[k].real();
      break;
    case RMP_ROLE_POSE: t.pose = pose_of(s); break;
    case RMP_ROLE_MAIN_JOINT: reals(type, s, t.joints); break;
    case RMP_ROLE_ADD_JOINT: reals(type, s, t.additional); break;
    case RMP_ROLE_JOINT:
      reals(field(0), s, t.joints);
      reals(field(1), s + c_.types[field(0)].slots, t.additional);
      break;
    case RMP_ROLE_ROBTARGET: {
      t.pose = pose_of(s);
      t.status = s[7].integer();
      const std::uint32_t turns = c_.types[field(2)].slots;
      for (std::uint32_t k = 0; k < turns; ++k) t.turns.push_back(s[8 + k].integer());
      reals(field(3), s + 8 + turns, t.additional);
      break;
    }
    default: break;
  }
  return t;
}

bool Run::put_target(std::uint32_t type, const Target& t, Slot* s) {
  const rmp_code_type& x = c_.type(type);
  const auto field = [&](std::uint32_t k) { return c_.field(x.first_field + k).type; };
  const auto reals = [&](std::uint32_t of, const std::vector<double>& from, Slot* to,
                         const char* what) {
    if (from.size() > c_.types[of].slots)
      return fail("the robot has " + std::to_string(from.size()) + " " + what +
                      ", and the program's type " + c_.type_name(of) + " holds " +
                      std::to_string(c_.types[of].slots),
                  "Give the program the cell of its robot: SYSTEM_SPECIFICATION '...';");
    for (std::uint32_t k = 0; k < c_.types[of].slots; ++k) {
      const double v = k < from.size() ? from[k] : 0;
      if (!std::isfinite(v) || std::fabs(v) > 2e9)
        return fail("the state of the robot is not a finite number");
      to[k] = is_whole_joint(of, k) ? Slot::of(static_cast<std::int32_t>(std::lround(v)))
                                    : Slot::of_real(v);
    }
    return true;
  };
  if (x.role == RMP_ROLE_JOINT)
    return reals(field(0), t.joints, s, "joints") &&
           reals(field(1), t.additional, s + c_.types[field(0)].slots, "additional joints");
  for (std::size_t k = 0; k < 3; ++k) s[k] = Slot::of_real(t.pose.position[k]);
  for (std::size_t k = 0; k < 4; ++k) s[3 + k] = Slot::of_real(t.pose.quaternion[k]);
  for (std::size_t k = 0; k < 7; ++k)
    if (!std::isfinite(s[k].real())) return fail("the state of the robot is not a finite number");
  s[7] = Slot::of(t.status);
  const std::uint32_t turns = c_.types[field(2)].slots;
  for (std::uint32_t k = 0; k < turns; ++k)
    s[8 + k] = Slot::of(k < t.turns.size() ? t.turns[k] : 0);
  return reals(field(3), t.additional, s + 8 + turns, "additional joints");
}

bool Run::refresh(Process& p, const Op& o) {
  const std::uint32_t robot = c_.live_symbol[o.n];
  std::optional<Target> state;
  for (const LiveField& f : c_.live[o.n]) {
    Slot* to = s_.globals.data() + f.offset;
    if (f.kind == 2) {
      const auto speed = world_->robot_speed(robot, p.routine);
      if (!speed.ok()) return fail(speed.error());
      if (!std::isfinite(*speed)) return fail("the speed of the robot is not a finite number");
      *to = Slot::of_real(*speed);
      continue;
    }
    if (!state) {
      auto now = world_->robot_state(robot, p.routine);
      if (!now.ok()) return fail(now.error());
      state = std::move(now).value();
    }
    if (!put_target(f.type, *state, to)) return false;
  }
  return true;
}

bool Run::begin_motion(Process& p, std::uint32_t number) {
  const MoveInfo& m = c_.moves[number];
  Motion motion;
  motion.process = p.routine;
  motion.interpolation = m.interpolation;
  motion.is_incremental = m.is_incremental;
  motion.has_until = m.until != kNone;
  motion.span = c_.instruction(at_).span;
  MotionAttributes& a = motion.attributes;
  const auto system = [&](std::uint32_t offset, double& to) {
    if (offset != kNone) to = s_.globals[offset].real();
  };
  system(c_.r_speed, a.speed);
  system(c_.r_speed_ori, a.speed_orientation);
  system(c_.r_acc, a.acceleration);
  system(c_.r_move_time, a.time);
  system(c_.r_c_cp, a.c_cp);
  system(c_.r_c_speed, a.c_speed);
  system(c_.r_wobble_amplitude, a.wobble_amplitude);
  system(c_.r_wobble_length, a.wobble_length);
  system(c_.r_speed_ptp, a.speed_ptp);
  system(c_.r_acc_ptp, a.acceleration_ptp);
  system(c_.r_c_ptp, a.c_ptp);
  const auto turned = [&](PlainPose& pose, const char* what) {
    auto& q = pose.quaternion;
    const double n = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (!(std::fabs(n - 1) < 1e-3))
      return fail(std::string("the orientation of ") + what +
                      " is not a unit quaternion: its length is " + real_literal(n),
                  n == 0 ? "It has no value yet: assign one, such as ORIZYX(0.0, 180.0, 0.0)."
                         : "Create it with a function such as ORIQUAT or ORIZYX.");
    // What is one but for rounding stays as it is, so that to say it again changes nothing.
    if (std::fabs(n - 1) > 1e-14)
      for (double& v : q) v /= n;
    return true;
  };
  for (const MoveAttribute& x : m.attributes) {
    a.given |= 1u << x.attribute;
    if (x.attribute == RMP_ATTR_ACT_ROB) {
      a.robot = c_.symbol(x.robot).name;
      a.robot_symbol = x.robot;
      continue;
    }
    const Slot* v = slots(p, x.value);
    switch (x.attribute) {
      case RMP_ATTR_SPEED: a.speed = v->real(); break;
      case RMP_ATTR_SPEED_ORI: a.speed_orientation = v->real(); break;
      case RMP_ATTR_ACC: a.acceleration = v->real(); break;
      case RMP_ATTR_TIME: a.time = v->real(); break;
      case RMP_ATTR_C_CP: a.c_cp = v->real(); break;
      case RMP_ATTR_C_SPEED: a.c_speed = v->real(); break;
      case RMP_ATTR_C_PASS: a.passes = v->integer() != 0; break;
      case RMP_ATTR_WOBBLE: a.weaves = v->integer() != 0; break;
      case RMP_ATTR_DEVICE: a.device = v->integer(); break;
      case RMP_ATTR_ADAX_CONTROL: a.additional_axes = v->integer(); break;
      case RMP_ATTR_SPEED_PTP: a.speed_ptp = v->real(); break;
      case RMP_ATTR_ACC_PTP: a.acceleration_ptp = v->real(); break;
      case RMP_ATTR_C_PTP: a.c_ptp = v->real(); break;
      case RMP_ATTR_TOOL:
        a.tool = pose_of(v);
        if (!turned(*a.tool, "TOOL")) return false;
        break;
      case RMP_ATTR_FRAME:
        a.frame = pose_of(v);
        if (!turned(*a.frame, "FRAME")) return false;
        break;
      default: break;
    }
  }
  if (a.robot_symbol == kNone && p.robot != kNone) {
    a.robot = c_.symbol(p.robot).name;
    a.robot_symbol = p.robot;
  }
  const auto shown = [](double v) { return real_literal(v); };
  const auto above = [&](const char* name, double v) {
    return v > 0 || fail(std::string(name) + " is " + shown(v) + ", but it must be above zero");
  };
  const auto share = [&](const char* name, double v) {
    return (v > 0 && v <= 100) || fail(std::string(name) + " is " + shown(v) +
                                       ", but it must be above zero and at most 100 %");
  };
  const auto not_negative = [&](const char* name, double v) {
    return v >= 0 || fail(std::string(name) + " is " + shown(v) + ", but it must not be negative");
  };
  const bool is_ptp = m.interpolation == RMP_MOVE_PTP;
  if (is_ptp) {
    if (!share("SPEED_PTP", a.speed_ptp) || !share("ACC_PTP", a.acceleration_ptp) ||
        !not_negative("C_PTP", a.c_ptp))
      return false;
    if (a.c_ptp > 100) return fail("C_PTP is " + shown(a.c_ptp) + ", but it must be at most 100 %");
  } else if (!above("SPEED", a.speed) || !above("SPEED_ORI", a.speed_orientation) ||
             !not_negative("C_CP", a.c_cp)) {
    return false;
  } else if (a.c_speed < 0 || a.c_speed > 100) {
    return fail("C_SPEED is " + shown(a.c_speed) + ", but it must be from 0 to 100 %");
  }
  if (a.weaves && !is_ptp) {
    if (!not_negative("R_WOBBLE_AMPLITUDE", a.wobble_amplitude)) return false;
    if (!(a.wobble_length > 0))
      return fail(
          "R_WOBBLE_LENGTH is " + shown(a.wobble_length) + ", but WOBBLE needs a value above zero",
          "It is the distance of one swing to both sides and back, in mm.");
  }
  if (!share("ACC", a.acceleration)) return false;
  if (a.time <= 0 && a.time != -1)
    return fail("TIME is " + shown(a.time) + ", but it must be above zero, or -1 for none",
                "It comes from the motion or from R_MOVE_TIME.");
  for (const Place& x : m.targets) {
    Target t = target_of(x.type, slots(p, x));
    const bool has_orientation = t.role == RMP_ROLE_POSE || t.role == RMP_ROLE_ROBTARGET;
    if (has_orientation && !turned(t.pose, "a target")) return false;
    if (t.role == RMP_ROLE_ROBTARGET && t.status < -1)
      return fail(
          "the STATUS of a target is " + std::to_string(t.status) + ", but it must not be negative",
          "-1 is any; else a bit for each branch of the robot's inverse kinematics.");
    motion.targets.push_back(std::move(t));
  }
  motion.approximates =
      !motion.has_until && (is_ptp ? a.c_ptp > 0 || a.passes : a.c_cp > 0 || a.passes);
  motion.number = s_.next_motion++;
  if (!p.open.empty()) motion.after = p.open.back().number;
  if (observer_) {
    const auto noted = observer_->moves(p.routine, m);
    if (!noted.ok()) return fail(noted.error());
  }
  const auto begun = world_->begin_motion(motion);
  if (!begun.ok()) return fail(begun.error());
  ++s_.progress;
  p.open.push_back({motion.number, p.level, motion.approximates, motion.span, a.robot_symbol});
  p.wait = {};
  p.pc = at_ + 1;
  if (motion.approximates) return true;
  p.wait.kind = Waits::motion;
  p.wait.is_behind = true;
  if (motion.has_until) {
    p.wait.move = number;
    p.wait.motion = motion.number;
  }
  return true;
}

}  // namespace robomosp::program
