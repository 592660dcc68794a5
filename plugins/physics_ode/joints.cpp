// SPDX-License-Identifier: Apache-2.0
// Joints of a world: their frames, stops and motors (layer: plugin).
#include <algorithm>
#include <cmath>
#include <numbers>

#include "spatial/pose.h"
#include "world.h"

namespace robomosp::physics_ode {
namespace {

bool moves_on_one_axis(int type) { return type == kRevolute || type == kPrismatic; }

/// Turn about z (or way along z) that takes frame a to frame b.
double joint_start(int type, const Pose& a, const Pose& b) {
  const Pose t = spatial::compose(spatial::inverse(a), b);
  return type == kPrismatic ? t.p[2] : std::atan2(t.R[3] - t.R[1], t.R[0] + t.R[4]);
}

void set_motor(dJointID motor, int type, double velocity, double force) {
  const auto set = type == kRevolute ? dJointSetAMotorParam : dJointSetLMotorParam;
  set(motor, dParamVel, velocity);
  set(motor, dParamFMax, force);
}

}  // namespace

Result<void> OdeWorld::add_joint(const PhysicsJoint& j, std::size_t number,
                                 std::span<const PhysicsBody> bodies) {
  const std::string where = "joint " + number_text(number);
  const auto count = static_cast<std::int32_t>(bodies_.size());
  if (j.a < -1 || j.b < -1 || j.a >= count || j.b >= count || j.a == j.b)
    return error(ErrorCode::invalid_argument, "it joins bodies that do not exist",
                 "Give the numbers of two bodies, -1 for the world.", where);
  if (!(j.viscous >= 0) || !(j.coulomb >= 0) || !(j.armature >= 0) ||
      !std::isfinite(j.viscous + j.armature))
    return error(ErrorCode::invalid_argument, "its friction or motor inertia is out of range",
                 "Give numbers that are not negative.", where);
  if (j.follows >= 0) {
    const bool is_known = static_cast<std::size_t>(j.follows) < joints_.size();
    if (!is_known || !moves_on_one_axis(j.type) ||
        !moves_on_one_axis(joints_[static_cast<std::size_t>(j.follows)].type) ||
        !std::isfinite(j.ratio) || !std::isfinite(j.offset))
      return error(
          ErrorCode::invalid_argument,
          "it follows a joint that it cannot follow, or by numbers that are not finite",
          "A revolute or prismatic joint can follow an earlier revolute or prismatic joint.",
          where);
  }
  const auto frame = [&](std::int32_t body, const Pose& in_body) {
    return body < 0 ? in_body
                    : spatial::compose(bodies[static_cast<std::size_t>(body)].pose, in_body);
  };
  const Pose a = frame(j.a, j.in_a), b = frame(j.b, j.in_b);
  const Vec3 z = spatial::axis(a, 2);
  Joint out;
  out.a = j.a, out.b = j.b, out.type = j.type;
  out.in_a = j.in_a, out.in_b = j.in_b, out.fixed = j.fixed;
  out.lower = j.lower, out.upper = j.upper, out.viscous = j.viscous, out.coulomb = j.coulomb;
  out.armature = j.armature;
  out.follows = j.follows, out.ratio = j.ratio, out.offset = j.offset;
  if (!spatial::is_finite(a.p) || !spatial::is_finite(b.p))
    return error(ErrorCode::invalid_argument, "its frames are not finite", "Correct them.", where);
  switch (j.type) {
    case kRevolute: out.id = dJointCreateHinge(world_, nullptr); break;
    case kPrismatic: out.id = dJointCreateSlider(world_, nullptr); break;
    case kFixed: out.id = dJointCreateFixed(world_, nullptr); break;
    case kBall: out.id = dJointCreateBall(world_, nullptr); break;
    case kDirections: break;
    default:
      return error(ErrorCode::invalid_argument, "its type is " + std::to_string(j.type),
                   "0 is revolute, 1 prismatic, 2 fixed, 3 ball, 4 directions.", where);
  }
  give_id(j.a), give_id(j.b);
  // Body b is the one that moves: positions count how it stands against a.
  if (out.id) dJointAttach(out.id, body_id(j.b), body_id(j.a));
  if (j.type == kRevolute) {
    dJointSetHingeAnchor(out.id, b.p[0], b.p[1], b.p[2]);
    dJointSetHingeAxis(out.id, z[0], z[1], z[2]);
  } else if (j.type == kPrismatic) {
    dJointSetSliderAxis(out.id, z[0], z[1], z[2]);
  } else if (j.type == kFixed) {
    dJointSetFixed(out.id);
  } else if (j.type == kBall) {
    dJointSetBallAnchor(out.id, b.p[0], b.p[1], b.p[2]);
  }
  out.start = joint_start(j.type, a, b);
  if (moves_on_one_axis(j.type)) {
    if (j.coulomb > 0) {
      out.brake = make_motor(out);
      set_motor(out.brake, j.type, 0, j.coulomb);
    }
    if (j.armature > 0 || j.viscous > 0) {
      out.rotor = make_motor(out);
      set_motor(out.rotor, j.type, 0, dInfinity);
    }
  }
  for (const std::int32_t body : {j.a, j.b})
    if (body >= 0) bodies_[static_cast<std::size_t>(body)].is_jointed = true;
  has_rows_ = has_rows_ || j.follows >= 0 || j.type == kDirections;
  joints_.push_back(out);
  tied_.emplace(std::min(j.a, j.b), std::max(j.a, j.b));
  return {};
}

/// In the world.
Vec3 OdeWorld::axis(const Joint& j) const {
  return spatial::axis(j.b >= 0 ? spatial::compose(pose(j.b), j.in_b) : j.in_b, 2);
}

/// A motor along the joint's axis, still without force.
dJointID OdeWorld::make_motor(const Joint& j) const {
  // ODE wants a body first; seen from the other side the axis points the other way.
  const bool swapped = j.b < 0;
  const Vec3 z = swapped ? spatial::scale(axis(j), -1) : axis(j);
  const dBodyID first = body_id(swapped ? j.a : j.b), second = swapped ? nullptr : body_id(j.a);
  const bool turns = j.type == kRevolute;
  const dJointID motor =
      turns ? dJointCreateAMotor(world_, nullptr) : dJointCreateLMotor(world_, nullptr);
  dJointAttach(motor, first, second);
  if (turns) {
    dJointSetAMotorMode(motor, dAMotorUser);
    dJointSetAMotorNumAxes(motor, 1);
    dJointSetAMotorAxis(motor, 0, 1, z[0], z[1], z[2]);
  } else {
    dJointSetLMotorNumAxes(motor, 1);
    dJointSetLMotorAxis(motor, 0, 1, z[0], z[1], z[2]);
  }
  return motor;
}

double OdeWorld::position(const Joint& j) {
  if (j.type == kRevolute) return j.start + j.turned + dJointGetHingeAngle(j.id);
  if (j.type == kPrismatic) return j.start + dJointGetSliderPosition(j.id);
  return 0;
}
double OdeWorld::rate(const Joint& j) {
  if (j.type == kRevolute) return dJointGetHingeAngleRate(j.id);
  if (j.type == kPrismatic) return dJointGetSliderPositionRate(j.id);
  return 0;
}

/// ODE's stops of a hinge lie within half a turn: they are set where the limit is near.
void OdeWorld::set_stops(Joint& j) const {
  if (j.lower > j.upper) return;
  if (j.type == kPrismatic) {
    dJointSetSliderParam(j.id, dParamHiStop, j.upper - j.start);
    dJointSetSliderParam(j.id, dParamLoStop, j.lower - j.start);
    return;
  }
  const double shift = j.start + j.turned, now = dJointGetHingeAngle(j.id);
  const double low = j.lower - shift, high = j.upper - shift;
  const bool is_low = now - low < 1 && low > -std::numbers::pi,
             is_high = high - now < 1 && high < std::numbers::pi;
  dJointSetHingeParam(j.id, dParamHiStop, is_high ? high : dInfinity);
  dJointSetHingeParam(j.id, dParamLoStop, is_low ? low : -dInfinity);
}

double OdeWorld::beyond_stop(const Joint& j) {
  if (!moves_on_one_axis(j.type) || j.lower > j.upper) return 0;
  const double q = position(j);
  return std::max({0.0, q - j.upper, j.lower - q});
}

/// Before a step.
void OdeWorld::prepare(Joint& j, Pass pass) {
  if (!moves_on_one_axis(j.type)) return;
  set_stops(j);
  const double erp = pass == Pass::motion ? 0 : settings_.erp;
  if (j.type == kRevolute) dJointSetHingeParam(j.id, dParamStopERP, erp);
  if (j.type == kPrismatic) dJointSetSliderParam(j.id, dParamStopERP, erp);
  if (j.type == kRevolute) j.last = dJointGetHingeAngle(j.id);
  if (!j.rotor) return;
  // A rotor of inertia A that turns with the joint, not with the body, and viscous friction b give
  // the force -A (v+ - v) / h - b v+ = (c - v+) / cfm with cfm = 1 / (A / h + b).
  const double inertia = j.armature / dt_, sum = inertia + j.viscous;
  const auto set = j.type == kRevolute ? dJointSetAMotorParam : dJointSetLMotorParam;
  set(j.rotor, dParamCFM, 1 / sum);
  set(j.rotor, dParamVel, (j.b < 0 ? -1 : 1) * rate(j) * inertia / sum);
}

Result<void> OdeWorld::servo(std::int32_t joint, double velocity, double force) {
  if (joint < 0 || static_cast<std::size_t>(joint) >= joints_.size() ||
      !moves_on_one_axis(joints_[static_cast<std::size_t>(joint)].type))
    return error(ErrorCode::invalid_argument, "there is no such joint to move",
                 "Give the number of a revolute or prismatic joint.");
  if (!std::isfinite(velocity) || !(force >= 0))
    return error(ErrorCode::invalid_argument, "its speed or maximum force is not valid",
                 "Give a finite speed and a force that is not negative.",
                 "joint " + number_text(static_cast<std::size_t>(joint)));
  Joint& j = joints_[static_cast<std::size_t>(joint)];
  if (!j.motor) {
    if (force == 0) return {};
    j.motor = make_motor(j);
  }
  set_motor(j.motor, j.type, j.b < 0 ? -velocity : velocity, std::isinf(force) ? dInfinity : force);
  return {};
}

}  // namespace robomosp::physics_ode
