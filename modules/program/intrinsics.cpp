// SPDX-License-Identifier: Apache-2.0
// Functions and procedures of the language, as they run: arguments, results, numbers, semaphores
// and robots. Geometry, texts and files have files of their own.
#include "program/intrinsics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "program/real_literal.h"

namespace robomosp::program {

Run::Did Run::intrinsic(Process& p, const IntrinsicCall& c) {
  Intrinsic asked{*this, p, c};
  return asked.call();
}

Run::Did Run::Intrinsic::call() {
  for (std::size_t k = 0; k < c.arguments.size() && k < in.size(); ++k) {
    in[k] = run.slots(p, c.arguments[k]);
    if (!in[k]) return failed("a place of the code does not exist", "Compile the program again.");
  }
  if (c.fn >= Fn::open && c.fn <= Fn::release && p.condition_depth)
    return failed("a condition of UNTIL or WHEN calls " + name(),
                  "Functions called there may only compute.");
  switch (c.fn) {
    case Fn::number:
    case Fn::abs_int:
    case Fn::size_of:
    case Fn::for_step: return numbers();
    case Fn::cross:
    case Fn::dot:
    case Fn::inv: return geometry();
    case Fn::ori_xyz:
    case Fn::ori_yxz:
    case Fn::ori_zyx:
    case Fn::ori_zyz2:
    case Fn::ori_rs:
    case Fn::ori_vang:
    case Fn::ori_quat:
    case Fn::ori_mat:
    case Fn::ori_mult: return orientations();
    case Fn::angle_x:
    case Fn::angle_y:
    case Fn::angle_z:
    case Fn::angle_z2:
    case Fn::quat_a:
    case Fn::quat_b:
    case Fn::quat_c:
    case Fn::quat_d:
    case Fn::rot_angle:
    case Fn::rot_axis:
    case Fn::vector_n:
    case Fn::vector_o:
    case Fn::vector_a: return parts_of_orientation();
    case Fn::compare:
    case Fn::length:
    case Fn::locate:
    case Fn::concat:
    case Fn::extract:
    case Fn::delete_: return texts();
    case Fn::list_add:
    case Fn::list_insert:
    case Fn::list_delete:
    case Fn::list_clear:
    case Fn::list_index: return lists();
    case Fn::trafo:
    case Fn::trafo_inv:
    case Fn::robot_joints:
    case Fn::robot_target:
    case Fn::robot_flange:
    case Fn::robot_speed:
    case Fn::act_robot:
    case Fn::brake: return robots();
    case Fn::open:
    case Fn::close:
    case Fn::eof:
    case Fn::eol:
    case Fn::write:
    case Fn::writeln:
    case Fn::read:
    case Fn::readln: return files();
    case Fn::acquire:
    case Fn::release:
    case Fn::get_status: return semaphores();
  }
  return unknown();
}

Run::Did Run::Intrinsic::failed(std::string message, std::string hint) {
  run.fail(std::move(message), std::move(hint));
  return Did::failed;
}

Run::Did Run::Intrinsic::unknown() { return failed("this function of the language is unknown"); }

std::string Run::Intrinsic::name() const { return std::string(run.c_.symbol(c.symbol).name); }

Run::Did Run::Intrinsic::whole(std::int64_t v) {
  if (v > std::numeric_limits<std::int32_t>::max() || v < std::numeric_limits<std::int32_t>::min())
    return failed("the value of " + name() + " is outside the range of INT",
                  "An INT is from -2147483648 to 2147483647.");
  *out() = Slot::of(v);
  return Did::done;
}

Run::Did Run::Intrinsic::reals(const double* v, std::size_t n) {
  for (std::size_t k = 0; k < n; ++k)
    if (!std::isfinite(v[k]))
      return failed("the value of " + name() + " is outside the range of REAL");
  Slot* to = out();
  for (std::size_t k = 0; k < n; ++k) to[k] = Slot::of_real(v[k]);
  return Did::done;
}

void Run::Intrinsic::get(std::size_t k, double* v, std::size_t n) const {
  for (std::size_t i = 0; i < n; ++i) v[i] = in[k][i].real();
}

bool Run::Intrinsic::turned(std::size_t k, double* q) {
  get(k, q, 4);
  const double n = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (!(std::fabs(n - 1) < 1e-3))
    return run.fail("the orientation that " + name() +
                        " gets is not a unit quaternion: its length is " + real_literal(n),
                    "Create it with a function such as ORIQUAT or ORIZYX.");
  for (int i = 0; i < 4; ++i) q[i] /= n;
  return true;
}

Run::Did Run::Intrinsic::numbers() {
  switch (c.fn) {
    case Fn::number: {
      const double x[2] = {number(0), c.arguments.size() > 1 ? number(1) : 0.0};
      const auto y = number_value(c.number, std::span(x, c.arguments.size()));
      if (!y || std::fabs(*y) > 4e9) {
        if (!y) return failed(name() + " has no value at " + real_literal(x[0]));
        return whole(std::numeric_limits<std::int64_t>::max());
      }
      return whole(static_cast<std::int64_t>(*y));
    }
    case Fn::abs_int: {
      const std::int64_t x = in[0]->integer();
      return whole(x < 0 ? -x : x);
    }
    case Fn::size_of: {
      const TypeInfo& t = run.c_.types[c.arguments[0].type];
      if (t.kind == RMP_TYPE_ARRAY) return whole(t.length);
      if (t.kind == RMP_TYPE_STRING)
        return whole(static_cast<std::int64_t>(run.text_of(*in[0]).size()));
      const Heap::List* l = run.list_of(*in[0]);
      return whole(
          l && t.element_slots ? static_cast<std::int64_t>(l->slots.size() / t.element_slots) : 0);
    }
    case Fn::for_step:
      if (in[0]->integer() == 0)
        return failed("STEP of the FOR is 0, so the loop would never end",
                      "A positive STEP counts upwards, a negative one downwards.");
      *out() = *in[0];
      return Did::done;
    default: return unknown();
  }
}

Run::Did Run::Intrinsic::robots() {
  double r[7];
  switch (c.fn) {
    case Fn::trafo:
    case Fn::trafo_inv: {
      const Target t = run.target_of(c.arguments[0].type, in[0]);
      auto made =
          c.fn == Fn::trafo ? run.world_->forward(t, p.routine) : run.world_->inverse(t, p.routine);
      if (!made.ok()) return run.fail(made.error()), Did::failed;
      run.cost_ += 100;
      return run.put_target(c.result.type, *made, out()) ? Did::done : Did::failed;
    }
    case Fn::robot_joints:
    case Fn::robot_target: {
      if (run.must_wait(p)) return Did::waits;
      const auto now = run.world_->robot_state(p.robot, p.routine);
      if (!now.ok()) return run.fail(now.error()), Did::failed;
      run.cost_ += 100;
      return run.put_target(c.result.type, *now, out()) ? Did::done : Did::failed;
    }
    case Fn::robot_flange: {
      if (run.must_wait(p)) return Did::waits;
      const auto now = run.world_->robot_flange(p.robot, p.routine);
      if (!now.ok()) return run.fail(now.error()), Did::failed;
      run.cost_ += 100;
      for (std::size_t k = 0; k < 3; ++k) r[k] = now->position[k];
      for (std::size_t k = 0; k < 4; ++k) r[3 + k] = now->quaternion[k];
      return reals(r, 7);
    }
    case Fn::robot_speed: {
      if (run.must_wait(p)) return Did::waits;
      const auto speed = run.world_->robot_speed(p.robot, p.routine);
      if (!speed.ok()) return run.fail(speed.error()), Did::failed;
      if (!std::isfinite(*speed)) return failed("the speed of the robot is not a finite number");
      *out() = Slot::of_real(*speed);
      return Did::done;
    }
    case Fn::act_robot: return run.act_robot(p, c);
    case Fn::brake: return run.brake(p, c, c.arguments.empty() ? 0 : in[0]->integer());
    default: return unknown();
  }
}

/// R_ACT_ROB: chooses a robot, or gives the one that was chosen as it is now.
Run::Did Run::act_robot(Process& p, const IntrinsicCall& c) {
  if (!c.has_result) {
    if (p.condition_depth)
      return fail("a condition of UNTIL or WHEN chooses a robot",
                  "Functions called there may only compute."),
             Did::failed;
    p.robot = c.robot;
    return Did::done;
  }
  if (must_wait(p)) return Did::waits;
  const auto of = std::find_if(c_.robots.begin(), c_.robots.end(), [&](const auto& r) {
    return r.first == p.robot || (p.robot == kNone && c_.robots.size() == 1);
  });
  if (of == c_.robots.end())
    return fail(p.robot == kNone
                    ? "R_ACT_ROB has not been set to a robot yet"
                    : "R_ACT_ROB is a robot of a different type than the cell's first robot",
                p.robot == kNone
                    ? "Choose one first, such as R_ACT_ROB := " +
                          std::string(c_.robots.empty() ? "arm"
                                                        : c_.symbol(c_.robots[0].first).name) +
                          ";"
                    : "Name the robot when reading its fields."),
           Did::failed;
  Op o;
  o.n = of->second;
  if (!refresh(p, o)) return Did::failed;
  const std::uint32_t n = c_.types[c.result.type].slots;
  std::copy_n(s_.globals.data() + c_.place_of[of->first].offset, n, slots(p, c.result));
  cost_ += n / 16 + 100;
  return Did::done;
}

/// BRAKE: the motions that an interrupt of this process came into, or those of a robot.
Run::Did Run::brake(Process& p, const IntrinsicCall& c, std::int32_t mode) {
  const auto failed = [&](std::string message, std::string hint) {
    fail(std::move(message), std::move(hint));
    return Did::failed;
  };
  if (must_wait(p)) return Did::waits;
  if (p.condition_depth)
    return failed("a condition of UNTIL or WHEN brakes",
                  "Functions called there may only compute.");
  if (mode != 0 && mode != 1)
    return failed("BRAKE has no mode " + std::to_string(mode),
                  "0 ends the motion, 1 holds it until the interrupt's routine has ended.");
  Frame* interrupt = nullptr;
  for (Frame& f : p.frames)
    if (f.kind == FrameKind::interrupt) interrupt = &f;
  if (mode == 1 && !interrupt)
    return failed(
        "BRAKE(1) holds a motion until the routine of an interrupt has ended, but this is not one",
        "BRAKE ends a motion; STOP holds a process until CONTINUE.");
  ++s_.progress;
  WaitState wait;
  wait.kind = Waits::brake;
  wait.is_behind = true;
  wait.holds = mode == 1;
  for (Process& other : s_.processes) {
    if (other.is_ended || (c.robot == kNone && &other != &p)) continue;
    for (const OpenMotion& m : other.open) {
      if (c.robot != kNone && m.robot != c.robot) {
        const auto is_same = world_->same_robot(m.robot, c.robot);
        if (!is_same.ok()) return fail(is_same.error()), Did::failed;
        if (!*is_same) continue;
      }
      if (mode == 1 && is_held(m.number)) continue;
      const auto done = mode == 1 ? world_->hold_motion(m.number)
                                  : world_->abort_motion(m.number, AbortReason::until);
      if (!done.ok()) return fail(done.error()), Did::failed;
      if (mode == 1) interrupt->held.push_back(m.number);
      wait.braked.push_back(m.number);
    }
  }
  if (wait.braked.empty()) return Did::done;
  p.wait = std::move(wait);
  p.pc = at_ + 1;
  return Did::waits;
}

Run::Did Run::Intrinsic::semaphores() {
  switch (c.fn) {
    case Fn::acquire:
    case Fn::release: {
      if (run.must_wait(p)) return Did::waits;
      Slot* s = c.arguments[0].is_reference ? run.at(p, run.address_of(p, c.arguments[0]), 1, true)
                                            : run.slots(p, c.arguments[0]);
      if (!s) return failed("a place of the code does not exist", "Compile the program again.");
      const std::uint64_t address = run.address_of(p, c.arguments[0]);
      // Places on a stack are of one process.
      const std::uint64_t key = address >= run.s_.globals.size() && address < kConstantAddress
                                    ? address + ((std::uint64_t{p.routine} + 1) << 40)
                                    : address;
      ++run.s_.progress;
      if (c.fn == Fn::acquire) {
        if (s->integer() > 0) {
          *s = Slot::of(s->integer() - 1);
          return Did::done;
        }
        p.wait = {};
        p.wait.kind = Waits::semaphore;
        p.wait.address = key;
        p.wait.ticket = run.s_.next_ticket++;
        return Did::waits;
      }
      // Handed over to who waits: the highest priority, then who came first.
      WaitState* best = nullptr;
      Process* of = nullptr;
      std::uint32_t* pc = nullptr;
      for (Process& other : run.s_.processes) {
        if (other.is_ended) continue;
        const auto one = [&](WaitState& x, std::uint32_t& at_op) {
          if (x.kind != Waits::semaphore || x.is_granted || x.address != key) return;
          if (best && (other.priority < of->priority ||
                       (other.priority == of->priority && x.ticket > best->ticket)))
            return;
          best = &x;
          of = &other;
          pc = &at_op;
        };
        one(other.wait, other.pc);
        for (Frame& f : other.frames)
          for (WaitState& x : f.put_aside) one(x, f.back);
      }
      if (best) {
        best->is_granted = true;
        run.wake(*of);
        ++*pc;
        return Did::done;
      }
      if (s->integer() == std::numeric_limits<std::int32_t>::max())
        return failed("the count of the semaphore exceeds the range of INT");
      *s = Slot::of(s->integer() + 1);
      return Did::done;
    }
    case Fn::get_status: {
      const std::int32_t r_ = in[0]->integer();
      const Process* x = r_ >= 0 ? run.process_of(static_cast<std::uint32_t>(r_)) : nullptr;
      if (!x || x->is_ended) return whole(0);
      if (x->is_stopped) return whole(2);
      const bool is_blocked =
          x->wait.kind != Waits::nothing && x->wait.kind != Waits::motion && !x->wait.is_granted;
      return whole(is_blocked ? 3 : 1);
    }
    default: return unknown();
  }
}

}  // namespace robomosp::program
