// SPDX-License-Identifier: Apache-2.0
#include "sim/physics_actor.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "kernel/text.h"
#include "robotics/closure.h"
#include "robotics/kinematics.h"
#include "sim/forward_simulation.h"
#include "sim/index.h"
#include "sim/provider_answer.h"
#include "spatial/pose.h"
#include "spatial/quintic.h"
#include "spatial/rotation.h"

namespace robomosp::sim {
namespace {

/// How fast a joint without a greatest velocity grips [m/s, rad/s].
constexpr double kMostTorque = 1e12;  ///< that an engine is asked for [N m or N]
constexpr double kGripSpeed = 0.1, kGripTurn = 0.5;
/// For the rates of joints that follow through loops [s].
constexpr double kDifference = 1e-4;

bool is_single(const JointModel& j) { return coordinate_count(j.type) == 1; }

}  // namespace

// ---- the way ----

RobotPath::RobotPath(std::shared_ptr<const RobotModel> model, std::vector<double> start)
    : model_(std::move(model)),
      start_(std::move(start)),
      held_(robotics::actuated_velocities(*model_)),
      branch_(start_) {}

Result<std::vector<double>> RobotPath::closed(const std::vector<double>& from,
                                              const std::vector<double>& to) const {
  if (model_->loops.empty()) return to;
  robotics::Closure c = robotics::close_loops(*model_, from, to, held_);
  if (c.is_closed) return std::move(c.q);
  return error(ErrorCode::invalid_argument,
               "its loops cannot be closed there: " + text::print_rounded(c.residual, 3) +
                   " m or rad remain open in loop " + text::quote(model_->loops[c.worst_loop].name),
               "Give values of the joints with motors that the others can follow.");
}

Result<void> RobotPath::start_at(std::vector<double> q) {
  RMP_TRY_ASSIGN(start_, closed(q, q));
  branch_ = start_;
  return {};
}

Result<void> RobotPath::add(double begin, double duration, const std::vector<double>& to) {
  RMP_TRY_ASSIGN(auto end, closed(last(), to));
  pieces_.push_back({begin, begin + duration, last(), std::move(end), std::nullopt});
  return {};
}

Result<void> RobotPath::add(double begin, MotionReference motion) {
  MotionReference::Sample s;
  RMP_TRY(motion.at(motion.duration(), s));
  pieces_.push_back({begin, begin + motion.duration(), last(), s.q, std::move(motion)});
  return {};
}

Result<void> RobotPath::at(double t, MotionReference::Sample& s) const {
  const std::size_t n = model_->dof();
  s.has_tip = false;
  if (leader_) {
    leader_(t, s);
    return {};
  }
  s.qd.assign(n, 0.0), s.qdd.assign(n, 0.0);
  const auto after =
      std::find_if(pieces_.begin(), pieces_.end(), [&](const Piece& p) { return t <= p.end; });
  if (after == pieces_.end() || t < after->begin) {
    s.q = after != pieces_.end() ? after->from : last();
    return {};
  }
  if (after->motion) return after->motion->at(t - after->begin, s);
  if (model_->loops.empty()) {
    quintic(*after, t, s);
    return {};
  }
  // The joints without motors by differences of closed configurations.
  const double h = kDifference;
  std::vector<double> before(s.q), behind;
  const auto closed_at = [&](double when, std::vector<double>& q) {
    quintic(*after, std::clamp(when, after->begin, after->end), s);
    robotics::Closure c = robotics::close_loops(*model_, branch_, s.q, held_);
    if (c.is_closed) branch_ = std::move(c.q);
    q = branch_;
  };
  closed_at(t - h, before);
  std::vector<double> now;
  closed_at(t, now);
  closed_at(t + h, behind);
  quintic(*after, t, s);
  const bool is_inside = t - h >= after->begin && t + h <= after->end;
  for (std::size_t i = 0; i < now.size(); ++i) {
    if (held_[i] || !is_inside) continue;
    s.qd[i] = (behind[i] - before[i]) / (2 * h);
    s.qdd[i] = (behind[i] - 2 * now[i] + before[i]) / (h * h);
  }
  s.q = now;
  return {};
}

void RobotPath::quintic(const Piece& piece, double t, MotionReference::Sample& s) {
  const double T = piece.end - piece.begin, u = (t - piece.begin) / T;
  const spatial::Jet ease = spatial::ease(u);
  const double x = ease.v, v = ease.d / T, a = ease.dd / (T * T);
  const std::size_t n = piece.from.size();
  s.q.resize(n), s.qd.resize(n), s.qdd.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    const double path = piece.to[i] - piece.from[i];
    s.q[i] = piece.from[i] + x * path, s.qd[i] = v * path, s.qdd[i] = a * path;
  }
}

// ---- what the engine moves ----

Result<void> move_body(PhysicsWorld& world, const std::string& provider, std::int32_t body,
                       const Pose& from, const Pose& to, double dt) {
  const Pose turn{spatial::compose(to, spatial::inverse(from)).R, {}};
  const Vec3 v = spatial::scale(spatial::sub(to.p, from.p), 1 / dt),
             w = spatial::scale(spatial::rotation_log(turn.R), 1 / dt);
  return guarded(provider, [&] { return world.move(body, from, v, w); });
}

double PhysicsActor::joint_value(std::size_t j, std::span<const double> of_q) const {
  const JointModel& m = model->joints[j];
  const double value = of_q[index(m.q_index)];
  return m.is_coupled() ? m.coupling.ratio * value + m.coupling.offset : value;
}

std::string PhysicsActor::joint_words(std::size_t j) const {
  const JointModel& m = model->joints[j];
  const bool has_axis = axes && !m.is_coupled() && coordinate_count(m.type) == 1;
  return (has_axis ? axes->before_joint(index(m.q_index)) : std::string()) + "joint " +
         text::quote(m.name);
}

Result<std::size_t> PhysicsActor::grip_of(const std::string& name, double force, double speed) {
  std::vector<std::string> names;
  for (std::size_t j = 0; j < model->joints.size(); ++j) {
    const JointModel& m = model->joints[j];
    if (m.name == name) {
      if (m.is_coupled() || m.passive || !is_single(m))
        return error(ErrorCode::invalid_argument,
                     joint_words(j) +
                         (m.is_coupled()
                              ? " follows " + text::quote(model->joints[index(m.coupling.of)].name)
                          : m.passive ? std::string(" has no motor")
                                      : std::string(" does not turn or slide")),
                     m.is_coupled() ? "Grip with the joint that it follows."
                                    : "Grip with a joint that has a motor.");
      if (force == 0 || !std::isfinite(force) || std::fabs(force) > m.max_force)
        return error(ErrorCode::invalid_argument,
                     "a force of " + text::print_rounded(force) +
                         " is not a valid grip force of " + joint_words(j),
                     std::isfinite(m.max_force)
                         ? "Give a force up to " + text::print_rounded(m.max_force) +
                               ", positive if it increases the joint value."
                         : "Give a force [N or N m], positive if it increases the joint value.");
      const bool slides = m.type == JointType::prismatic;
      if (speed == 0)
        speed = std::isfinite(m.max_velocity) ? m.max_velocity : slides ? kGripSpeed : kGripTurn;
      const auto known = std::find_if(grips.begin(), grips.end(),
                                      [&](const PhysicsGrip& g) { return g.joint == j; });
      if (known != grips.end()) return static_cast<std::size_t>(known - grips.begin());
      grips.push_back({j, force, speed, false});
      return grips.size() - 1;
    }
    if (!m.is_coupled() && !m.passive && is_single(m)) names.push_back(m.name);
  }
  const std::string hint = text::did_you_mean(name, names);
  return error(ErrorCode::unknown_name,
               "robot " + text::quote(placed->name) + " has no joint " + text::quote(name),
               hint.empty() ? "It has " + text::enumerate(names) + "." : hint);
}

Result<void> PhysicsActor::choose_dynamic() {
  const auto& joints = model->joints;
  is_dynamic.assign(joints.size(), is_driven());
  if (is_driven()) return {};
  for (const PhysicsGrip& g : grips) is_dynamic[g.joint] = true;
  for (bool grows = !grips.empty(); grows;) {
    grows = false;
    const auto mark = [&](std::size_t j) {
      if (!is_dynamic[j]) is_dynamic[j] = grows = true;
    };
    for (std::size_t j = 0; j < joints.size(); ++j) {
      const JointModel& m = joints[j];
      if (m.parent >= 0 && is_dynamic[index(m.parent)]) mark(j);
      if (!m.is_coupled()) continue;
      if (is_dynamic[index(m.coupling.of)]) mark(j);
      if (is_dynamic[j]) mark(index(m.coupling.of));
    }
  }
  for (std::size_t j = 0; j < joints.size(); ++j)
    if (is_dynamic[j] && (!is_single(joints[j]) || joints[j].passive))
      return error(ErrorCode::unsupported,
                   joint_words(j) + " is carried by a gripping joint and has no motor to hold it",
                   "Give drive = \"controlled\".", "robot " + text::quote(placed->name));
  return {};
}

void PhysicsActor::add_joints(std::vector<PhysicsJoint>& joints) {
  joint.assign(model->joints.size(), -1);
  turns.assign(model->joints.size(), 0.0);
  for (std::size_t b = 0; b < model->joints.size(); ++b) {
    const JointModel& m = model->joints[b];
    if (!is_dynamic[b] || m.type == JointType::free) continue;
    PhysicsJoint j;
    j.a = base_body + 1 + m.parent;
    j.b = base_body + 1 + static_cast<std::int32_t>(b);
    j.type = m.type == JointType::spherical ? 3 : m.type == JointType::prismatic ? 1 : 0;
    j.in_a = m.placement;
    const bool is_limited = std::isfinite(m.lower) || std::isfinite(m.upper);
    j.lower = is_limited ? m.lower : 1, j.upper = is_limited ? m.upper : -1;
    if (is_single(m)) {
      j.viscous = m.friction.viscous;
      j.coulomb = 0.5 * (m.friction.coulomb_positive - m.friction.coulomb_negative);
      j.armature = m.armature;
    }
    if (m.is_coupled()) {
      j.follows = joint[index(m.coupling.of)];
      j.ratio = m.coupling.ratio, j.offset = m.coupling.offset;
    }
    joint[b] = static_cast<std::int32_t>(joints.size());
    joints.push_back(j);
  }
  for (const LoopModel& loop : model->loops) {
    const auto moves = [&](std::int32_t j) { return j >= 0 && is_dynamic[index(j)]; };
    if (!moves(loop.joint_a) && !moves(loop.joint_b)) continue;
    PhysicsJoint j;
    j.a = base_body + 1 + loop.joint_a, j.b = base_body + 1 + loop.joint_b;
    j.in_a = loop.in_a, j.in_b = loop.in_b;
    j.type = loop.fixed == kLoopPoint      ? 3
             : loop.fixed == kLoopRevolute ? 0
             : loop.fixed == kLoopWeld     ? 2
                                           : 4;
    j.fixed = loop.fixed;
    j.lower = 1, j.upper = -1;
    joints.push_back(j);
  }
}

void PhysicsActor::take_turns_off(std::vector<PhysicsJoint>& joints) const {
  for (std::size_t j = 0; j < joint.size(); ++j) {
    if (joint[j] < 0) continue;
    PhysicsJoint& out = joints[index(joint[j])];
    out.lower -= turns[j], out.upper -= turns[j];
    if (out.follows >= 0)
      out.offset += out.ratio * turns[index(model->joints[j].coupling.of)] - turns[j];
  }
}

void PhysicsActor::body_velocities(std::vector<Vec3>& linear, std::vector<Vec3>& angular) const {
  const std::size_t n = model->joints.size();
  linear.assign(n, {}), angular.assign(n, {});
  for (std::size_t j = 0; j < n; ++j) {
    const JointModel& m = model->joints[j];
    const Pose at = spatial::compose(world_T_base, now[j]);
    Vec3 v{}, w{};
    if (m.parent >= 0) {
      const std::size_t p = index(m.parent);
      const Vec3 arm = spatial::rotate(world_T_base, spatial::sub(now[j].p, now[p].p));
      w = angular[p];
      v = spatial::add(linear[p], spatial::cross(w, arm));
    }
    const double* x = &qd[index(m.v_index)];
    if (is_single(m)) {
      const double rate = m.is_coupled() ? m.coupling.ratio * *x : *x;
      Vec3& along = m.type == JointType::prismatic ? v : w;
      along = spatial::add(along, spatial::rotate(at, {0, 0, rate}));
    } else {
      if (m.type == JointType::free) {
        v = spatial::add(v, spatial::rotate(at, {x[0], x[1], x[2]}));
        x += 3;
      }
      w = spatial::add(w, spatial::rotate(at, {x[0], x[1], x[2]}));
    }
    linear[j] = v, angular[j] = w;
  }
}

bool PhysicsActor::find_turns(std::span<const double> joint_q) {
  bool is_right = true;
  for (std::size_t j = 0; j < joint.size(); ++j) {
    if (joint[j] < 0 || model->joints[j].type != JointType::revolute) continue;
    const double missing = joint_value(j, begin) - joint_q[index(joint[j])];
    const double whole = 2 * std::numbers::pi * std::round(missing / (2 * std::numbers::pi));
    if (whole != turns[j]) turns[j] = whole, is_right = false;
  }
  return is_right;
}

void PhysicsActor::read(std::span<const Pose> poses, std::span<const Vec3> velocities,
                        std::span<const Vec3> angular_velocities, std::span<const double> joint_q,
                        std::span<const double> joint_qd) {
  for (std::size_t j = 0; j < joint.size(); ++j) {
    const JointModel& m = model->joints[j];
    if (!is_dynamic[j] || m.is_coupled()) continue;
    if (is_single(m)) {
      q[index(m.q_index)] = joint_q[index(joint[j])] + turns[j];
      qd[index(m.v_index)] = joint_qd[index(joint[j])];
      continue;
    }
    const std::size_t b = index(base_body) + 1 + j, a = index(base_body + 1 + m.parent);
    const Pose moved =
        spatial::compose(spatial::inverse(spatial::compose(poses[a], m.placement)), poses[b]);
    double* x = &q[index(m.q_index)];
    double* v = &qd[index(m.v_index)];
    if (m.type == JointType::free) {
      const Vec3 arm = spatial::sub(poses[b].p, poses[a].p);
      const Vec3 against = spatial::add(velocities[a], spatial::cross(angular_velocities[a], arm));
      const Vec3 own = spatial::rotate_back(poses[b], spatial::sub(velocities[b], against));
      x = std::copy(moved.p.begin(), moved.p.end(), x);
      v = std::copy(own.begin(), own.end(), v);
    }
    const auto r = spatial::to_quaternion(moved.R);
    const double same = r.w * x[0] + r.x * x[1] + r.y * x[2] + r.z * x[3], sign = same < 0 ? -1 : 1;
    x[0] = sign * r.w, x[1] = sign * r.x, x[2] = sign * r.y, x[3] = sign * r.z;
    const Vec3 w =
        spatial::rotate_back(poses[b], spatial::sub(angular_velocities[b], angular_velocities[a]));
    std::copy(w.begin(), w.end(), v);
  }
}

// ---- forces ----

Result<void> PhysicsActor::control(double t, double step, MotionReference::Sample& wanted) {
  RMP_TRY(path->at(t, wanted));
  ControlInput in;
  in.time = t, in.dt = t == 0 ? 0 : step;
  in.q = q, in.qd = qd;
  in.q_desired = wanted.q, in.qd_desired = wanted.qd, in.qdd_desired = wanted.qdd;
  std::fill(tau.begin(), tau.end(), std::nan(""));
  RMP_TRY(guarded(controller.provider,
                  [&] { return controller.solver->torques(in, memory, scratch, tau); }));
  for (const double x : tau)
    if (!std::isfinite(x))
      return error(ErrorCode::plugin_failed,
                   "provider " + text::quote(controller.provider) +
                       " returned a torque that is not a number",
                   "Lower the gains or shorten the step; else report it to the provider's author.");
  for (std::size_t j = 0; j < model->joints.size(); ++j) {
    const JointModel& m = model->joints[j];
    if (m.is_coupled() || m.passive) continue;
    for (int k = 0; k < velocity_count(m.type); ++k)
      if (const double x = tau[index(m.v_index) + static_cast<std::size_t>(k)];
          std::fabs(x) > kMostTorque)
        return error(ErrorCode::invalid_argument,
                     "controller " + text::quote(controller.provider) + " requests for " +
                         joint_words(j) + " a force of " + text::print_rounded(x) +
                         ": the motion has become unstable",
                     "Lower the gains or shorten the step.", "robot " + text::quote(placed->name));
  }
  return {};
}

Result<void> PhysicsActor::drive(double t, double end, double step, const std::string& provider,
                                 PhysicsWorld& world, std::span<const Pose> poses,
                                 std::span<double> forces, MotionReference::Sample& wanted) {
  if (!is_driven() && grips.empty()) return {};
  std::fill(tau.begin(), tau.end(), 0.0);
  if (settings.drive == RobotDrive::controlled) RMP_TRY(control(t, step, wanted));
  if (!is_driven()) RMP_TRY(path->at(end, wanted));
  for (std::size_t j = 0; j < joint.size(); ++j) {
    const JointModel& m = model->joints[j];
    if (!is_dynamic[j]) continue;
    if (!is_single(m)) {
      const double* x = &tau[index(m.v_index)];
      if (m.passive || std::all_of(x, x + velocity_count(m.type), [](double f) { return f == 0; }))
        continue;
      const std::int32_t b = base_body + 1 + static_cast<std::int32_t>(j),
                         a = base_body + 1 + m.parent;
      const bool is_free = m.type == JointType::free;
      const Vec3 force = is_free ? spatial::rotate(poses[index(b)], {x[0], x[1], x[2]}) : Vec3{};
      if (is_free) x += 3;
      const Vec3 torque = spatial::rotate(poses[index(b)], {x[0], x[1], x[2]});
      const Vec3 arm = spatial::sub(poses[index(b)].p, poses[index(a)].p);
      const Vec3 back = spatial::add(torque, spatial::cross(arm, force));
      RMP_TRY(guarded(provider, [&] { return world.push(b, force, torque); }));
      RMP_TRY(guarded(provider, [&] {
        return world.push(a, spatial::scale(force, -1), spatial::scale(back, -1));
      }));
      continue;
    }
    double& force = forces[index(joint[j])];
    // The engine's Coulomb friction is the same both ways: what is left of the two is a force.
    force = -m.spring.stiffness * (joint_value(j, q) - m.spring.rest) -
            0.5 * (m.friction.coulomb_positive + m.friction.coulomb_negative);
    if (m.is_coupled()) continue;
    double& torque = tau[index(m.v_index)];
    if (m.passive) torque = 0;
    if (std::fabs(torque) > m.max_force) {
      torque = std::copysign(m.max_force, torque);
      ++cut[index(m.v_index)];
    }
    const auto grip = std::find_if(grips.begin(), grips.end(),
                                   [&](const PhysicsGrip& g) { return g.joint == j; });
    if (grip != grips.end() && grip->is_on) {
      torque = grip->force;
      RMP_TRY(guarded(provider, [&] {
        return world.servo(joint[j], std::copysign(grip->speed, grip->force),
                           std::fabs(grip->force));
      }));
    } else if (is_driven()) {
      force += torque;
      if (grip != grips.end())
        RMP_TRY(guarded(provider, [&] { return world.servo(joint[j], 0, 0); }));
    } else {
      // Back to where the motion says, no faster than it grips.
      double speed = (wanted.q[index(m.q_index)] - q[index(m.q_index)]) / (end - t);
      double most = m.max_force;
      if (grip != grips.end()) {
        const double fastest = grip->speed + std::fabs(wanted.qd[index(m.v_index)]);
        speed = std::clamp(speed, -fastest, fastest);
        if (!std::isfinite(most)) most = std::fabs(grip->force);
      }
      RMP_TRY(guarded(provider, [&] { return world.servo(joint[j], speed, most); }));
    }
  }
  return {};
}

Result<void> PhysicsActor::move(double t, double end, const std::string& provider,
                                PhysicsWorld& world, MotionReference::Sample& wanted) {
  if (!acts) return {};
  const std::vector<double> read_q = q, read_qd = qd;
  RMP_TRY(path->at(t, wanted));
  robotics::forward_kinematics(*model, wanted.q, now);
  RMP_TRY(path->at(end, wanted));
  robotics::forward_kinematics(*model, wanted.q, next);
  q = wanted.q, qd = wanted.qd;
  const double dt = end - t;
  for (std::size_t j = 0; j < now.size(); ++j) {
    const JointModel& m = model->joints[j];
    if (is_dynamic[j]) {
      if (m.is_coupled()) continue;
      q[index(m.q_index)] = read_q[index(m.q_index)];
      qd[index(m.v_index)] = read_qd[index(m.v_index)];
      continue;
    }
    RMP_TRY(move_body(world, provider, base_body + 1 + static_cast<std::int32_t>(j),
                      spatial::compose(world_T_base, now[j]),
                      spatial::compose(world_T_base, next[j]), dt));
  }
  return {};
}

}  // namespace robomosp::sim
