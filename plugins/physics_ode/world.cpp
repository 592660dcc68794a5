// SPDX-License-Identifier: Apache-2.0
#include "world.h"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <mutex>
#include <numbers>
#include <string>

#include "spatial/mass.h"
#include "spatial/pose.h"
#include "spatial/principal.h"

namespace robomosp::physics_ode {
namespace {

constexpr double kPi = std::numbers::pi;
enum Type { kRevolute = 0, kPrismatic = 1, kFixed = 2, kBall = 3 };

/// ODE keeps its random numbers and set-up in globals: one world steps at a time, from a known
/// seed, so that equal calls give equal bits.
std::mutex& engine_mutex() {
  static std::mutex m;
  return m;
}

void make_ready() {
  static const int initialised = [] {
    // It would write to the standard error when contacts are redundant, which it solves all the
    // same.
    dSetMessageHandler([](int, const char*, va_list) {});
    return dInitODE2(0);
  }();
  (void)initialised;
  dAllocateODEDataForThread(dAllocateMaskAll);  // once a thread; later calls do nothing
}

Vec3 vec3(const dReal* v) { return {v[0], v[1], v[2]}; }

Pose pose_of(const dReal* position, const dReal* rotation) {
  Pose t;
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t c = 0; c < 3; ++c) t.R[3 * r + c] = rotation[4 * r + c];
  t.p = vec3(position);
  return t;
}

void place(dBodyID id, const Pose& world_T_body, const Vec3& com) {
  const Vec3 p = spatial::transform(world_T_body, com);
  dMatrix3 R;
  to_ode(world_T_body, R);
  dBodySetPosition(id, p[0], p[1], p[2]);
  dBodySetRotation(id, R);
}

/// Velocity of the centre of mass from that of the body's origin.
Vec3 at_com(const Vec3& velocity, const Vec3& w, const Pose& pose, const Vec3& com) {
  return spatial::add(velocity, spatial::cross(w, spatial::rotate(pose, com)));
}

/// What a rotor of this inertia about the joint's axis adds to the moving body.
void add_rotor(Sym3& I, const Vec3& axis, double armature) {
  I.xx += armature * axis[0] * axis[0];
  I.yy += armature * axis[1] * axis[1];
  I.zz += armature * axis[2] * axis[2];
  I.xy += armature * axis[0] * axis[1];
  I.yz += armature * axis[1] * axis[2];
  I.xz += armature * axis[0] * axis[2];
}

/// Turn about z (or way along z) that takes frame a to frame b.
double joint_start(int type, const Pose& a, const Pose& b) {
  const Pose t = spatial::compose(spatial::inverse(a), b);
  return type == kPrismatic ? t.p[2] : std::atan2(t.R[3] - t.R[1], t.R[0] + t.R[4]);
}

std::string number_text(std::size_t i) { return std::to_string(i + 1); }

}  // namespace

Result<std::unique_ptr<OdeWorld>> OdeWorld::make(std::span<const PhysicsBody> bodies,
                                                 std::span<const PhysicsJoint> joints, Vec3 gravity,
                                                 const Settings& settings) {
  make_ready();
  if (!spatial::is_finite(gravity))
    return error(ErrorCode::invalid_argument, "gravity is not finite", "Correct it.");
  std::unique_ptr<OdeWorld> w(new OdeWorld());
  w->settings_ = settings;
  w->world_ = dWorldCreate();
  w->space_ = dHashSpaceCreate(nullptr);
  w->contact_joints_ = dJointGroupCreate(0);
  dWorldSetGravity(w->world_, gravity[0], gravity[1], gravity[2]);
  dWorldSetERP(w->world_, settings.erp);
  dWorldSetCFM(w->world_, settings.cfm);
  dWorldSetQuickStepNumIterations(w->world_, settings.sweeps);
  dWorldSetAutoDisableFlag(w->world_, 0);
  dWorldSetContactSurfaceLayer(w->world_, 1e-5);
  // Rotors first: the inertia of a body is given once.
  std::vector<PhysicsBody> with_rotors(bodies.begin(), bodies.end());
  for (const PhysicsJoint& j : joints)
    if (j.type == kRevolute && j.armature > 0 && j.b >= 0 &&
        static_cast<std::size_t>(j.b) < bodies.size())
      add_rotor(with_rotors[static_cast<std::size_t>(j.b)].mass.inertia, spatial::axis(j.in_b, 2),
                j.armature);
  for (std::size_t i = 0; i < with_rotors.size(); ++i) RMP_TRY(w->add_body(with_rotors[i], i));
  for (std::size_t i = 0; i < joints.size(); ++i) RMP_TRY(w->add_joint(joints[i], i, bodies));
  return w;
}

OdeWorld::~OdeWorld() {
  if (contact_joints_) dJointGroupDestroy(contact_joints_);
  bodies_.clear();
  if (space_) dSpaceDestroy(space_);
  if (world_) dWorldDestroy(world_);
}

Result<void> OdeWorld::add_body(const PhysicsBody& body, std::size_t number) {
  const std::string where = "body " + number_text(number);
  if (!spatial::is_finite(body.mass) || !spatial::is_rigid(body.pose) ||
      !spatial::is_finite(body.velocity) || !spatial::is_finite(body.angular_velocity))
    return error(ErrorCode::invalid_argument, "its mass, place or velocity is not valid",
                 "Correct them.", where);
  if (!(body.friction >= 0) || !(body.restitution >= 0 && body.restitution <= 1))
    return error(ErrorCode::invalid_argument, "its friction or restitution is out of range",
                 "Friction is at least 0, restitution from 0 to 1.", where);
  Body b;
  b.is_movable = body.mass.mass > 0;
  b.com = b.is_movable ? body.mass.com : Vec3{};
  b.friction = body.friction;
  b.restitution = body.restitution;
  b.group = body.group;
  b.self = body.self;
  b.id = dBodyCreate(world_);
  dBodySetData(b.id, reinterpret_cast<void*>(number));
  if (b.is_movable) {
    const double least = spatial::principal(body.mass.inertia).moments[0];
    if (!(least > 0)) {
      dBodyDestroy(b.id);
      return error(ErrorCode::invalid_argument, "it has mass but no inertia about some axis",
                   "Give it an inertia about all three axes.", where);
    }
    const Sym3& I = body.mass.inertia;
    dMass m;
    dMassSetParameters(&m, body.mass.mass, 0, 0, 0, I.xx, I.yy, I.zz, I.xy, I.xz, I.yz);
    dBodySetMass(b.id, &m);
  } else {
    dBodySetKinematic(b.id);
  }
  place(b.id, body.pose, b.com);
  const Vec3 v = at_com(body.velocity, body.angular_velocity, body.pose, b.com);
  dBodySetLinearVel(b.id, v[0], v[1], v[2]);
  dBodySetAngularVel(b.id, body.angular_velocity[0], body.angular_velocity[1],
                     body.angular_velocity[2]);
  // Gyroscopic torque without the energy that an explicit step would add.
  dBodySetGyroscopicMode(b.id, 1);
  bodies_.push_back(std::move(b));
  for (const Shape& shape : body.shape.shapes) {
    auto made = make_geometries(space_, shape);
    if (!made.ok()) return std::move(made).error().in(where);
    for (Geometry& g : *made) {
      const Pose& t = g.body_T_geometry;
      const Vec3& com = bodies_.back().com;
      dMatrix3 R;
      to_ode(t, R);
      dGeomSetBody(g.id, bodies_.back().id);
      dGeomSetOffsetPosition(g.id, t.p[0] - com[0], t.p[1] - com[1], t.p[2] - com[2]);
      dGeomSetOffsetRotation(g.id, R);
      dGeomSetData(g.id, reinterpret_cast<void*>(static_cast<std::size_t>(g.role)));
      bodies_.back().geometries.push_back(std::move(g));
    }
  }
  return {};
}

Result<void> OdeWorld::add_joint(const PhysicsJoint& j, std::size_t number,
                                 std::span<const PhysicsBody> bodies) {
  const std::string where = "joint " + number_text(number);
  const auto count = static_cast<std::int32_t>(bodies_.size());
  if (j.a < -1 || j.b < -1 || j.a >= count || j.b >= count || j.a == j.b)
    return error(ErrorCode::invalid_argument, "it joins bodies that do not exist",
                 "Give the numbers of two bodies, -1 for the world.", where);
  const auto frame = [&](std::int32_t body, const Pose& in_body) {
    return body < 0 ? in_body
                    : spatial::compose(bodies[static_cast<std::size_t>(body)].pose, in_body);
  };
  const Pose a = frame(j.a, j.in_a), b = frame(j.b, j.in_b);
  const Vec3 z = spatial::axis(a, 2);
  Joint out;
  out.a = j.a, out.b = j.b, out.type = j.type;
  out.lower = j.lower, out.upper = j.upper, out.viscous = j.viscous, out.coulomb = j.coulomb;
  switch (j.type) {
    case kRevolute: out.id = dJointCreateHinge(world_, nullptr); break;
    case kPrismatic: out.id = dJointCreateSlider(world_, nullptr); break;
    case kFixed: out.id = dJointCreateFixed(world_, nullptr); break;
    case kBall: out.id = dJointCreateBall(world_, nullptr); break;
    default:
      return error(ErrorCode::invalid_argument, "its type is " + std::to_string(j.type),
                   "0 is revolute, 1 prismatic, 2 fixed, 3 ball.", where);
  }
  // Body b is the one that moves: positions count how it stands against a.
  dJointAttach(out.id, body_id(j.b), body_id(j.a));
  if (j.type == kRevolute) {
    dJointSetHingeAnchor(out.id, b.p[0], b.p[1], b.p[2]);
    dJointSetHingeAxis(out.id, z[0], z[1], z[2]);
  } else if (j.type == kPrismatic) {
    dJointSetSliderAxis(out.id, z[0], z[1], z[2]);
  } else if (j.type == kFixed) {
    dJointSetFixed(out.id);
  } else {
    dJointSetBallAnchor(out.id, b.p[0], b.p[1], b.p[2]);
  }
  out.start = joint_start(j.type, a, b);
  joints_.push_back(out);
  tied_.emplace_back(std::min(j.a, j.b), std::max(j.a, j.b));
  return {};
}

bool OdeWorld::may_touch(std::int32_t a, std::int32_t b) const {
  const Body &x = bodies_[static_cast<std::size_t>(a)], &y = bodies_[static_cast<std::size_t>(b)];
  if (!x.is_movable && !y.is_movable) return false;
  if (x.group != 0 && x.group == y.group && !(x.self && y.self)) return false;
  const std::pair<std::int32_t, std::int32_t> pair{std::min(a, b), std::max(a, b)};
  return std::find(tied_.begin(), tied_.end(), pair) == tied_.end();
}

void OdeWorld::collide(dGeomID first, dGeomID second) {
  const dBodyID ids[2] = {dGeomGetBody(first), dGeomGetBody(second)};
  std::int32_t a = static_cast<std::int32_t>(reinterpret_cast<std::size_t>(dBodyGetData(ids[0])));
  std::int32_t b = static_cast<std::int32_t>(reinterpret_cast<std::size_t>(dBodyGetData(ids[1])));
  const auto role = [](dGeomID g) {
    return static_cast<Role>(reinterpret_cast<std::size_t>(dGeomGetData(g)));
  };
  if (a == b || !meet(role(first), role(second)) || !may_touch(a, b)) return;
  if (a > b) std::swap(a, b), std::swap(first, second);
  dContactGeom points[64];
  const int count =
      dCollide(first, second, std::min(settings_.most_contacts, 64), points, sizeof(dContactGeom));
  const Body &x = bodies_[static_cast<std::size_t>(a)], &y = bodies_[static_cast<std::size_t>(b)];
  for (int i = 0; i < count; ++i) {
    dContact c{};
    c.geom = points[i];
    c.surface.mode = dContactApprox1 | dContactSoftERP | dContactSoftCFM;
    c.surface.mu = std::sqrt(x.friction * y.friction);
    c.surface.soft_erp = settings_.contact_erp;
    c.surface.soft_cfm = settings_.contact_cfm;
    if (const double bounce = std::max(x.restitution, y.restitution); bounce > 0) {
      c.surface.mode |= dContactBounce;
      c.surface.bounce = bounce;
      c.surface.bounce_vel = 0.02;
    }
    const dJointID joint = dJointCreateContact(world_, contact_joints_, &c);
    dJointAttach(joint, x.id, y.id);
    Contact& kept = contacts_.emplace_back();
    kept.contact = {a, b, vec3(c.geom.pos), vec3(c.geom.normal), c.geom.depth, {}};
    kept.feedback = {};
    dJointSetFeedback(joint, &kept.feedback);
  }
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
  const bool is_low = now - low < 1 && low > -kPi, is_high = high - now < 1 && high < kPi;
  dJointSetHingeParam(j.id, dParamHiStop, is_high ? high : dInfinity);
  dJointSetHingeParam(j.id, dParamLoStop, is_low ? low : -dInfinity);
}

Result<void> OdeWorld::step(double dt, std::int32_t steps, std::span<const double> forces,
                            Progress& progress) {
  make_ready();
  if (!(dt > 0) || !std::isfinite(dt) || steps < 0)
    return error(ErrorCode::invalid_argument, "the step is not a positive time", "Give 1 ms, say.");
  if (!forces.empty() && forces.size() != joints_.size())
    return error(ErrorCode::invalid_argument,
                 std::to_string(forces.size()) + " forces are given for " +
                     std::to_string(joints_.size()) + " joints",
                 "Give one force a joint, or none.");
  const std::lock_guard lock(engine_mutex());
  for (std::int32_t s = 0; s < steps; ++s) {
    if (s % 16 == 0 && progress.cancelled())
      return error(ErrorCode::cancelled, "the simulation was stopped");
    dRandSetSeed(1);
    dJointGroupEmpty(contact_joints_);
    contacts_.clear();
    dSpaceCollide(space_, this, [](void* self, dGeomID a, dGeomID b) {
      static_cast<OdeWorld*>(self)->collide(a, b);
    });
    for (std::size_t i = 0; i < joints_.size(); ++i) {
      Joint& j = joints_[i];
      if (j.type != kRevolute && j.type != kPrismatic) continue;
      set_stops(j);
      // Friction as a brake of limited force: it stops, and never drives back.
      const double brake = j.coulomb + j.viscous * std::fabs(rate(j));
      const double force = forces.empty() ? 0 : forces[i];
      if (j.type == kRevolute) {
        j.last = dJointGetHingeAngle(j.id);
        dJointSetHingeParam(j.id, dParamVel, 0);
        dJointSetHingeParam(j.id, dParamFMax, brake);
        dJointAddHingeTorque(j.id, force);
      } else {
        dJointSetSliderParam(j.id, dParamVel, 0);
        dJointSetSliderParam(j.id, dParamFMax, brake);
        dJointAddSliderForce(j.id, force);
      }
    }
    const int done = settings_.exact ? dWorldStep(world_, dt) : dWorldQuickStep(world_, dt);
    if (!done) return error(ErrorCode::internal, "the engine ran out of memory");
    for (Joint& j : joints_) {
      if (j.type != kRevolute) continue;
      const double change = dJointGetHingeAngle(j.id) - j.last;
      if (change > kPi) j.turned -= 2 * kPi;
      if (change < -kPi) j.turned += 2 * kPi;
    }
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      const dReal* p = dBodyGetPosition(bodies_[i].id);
      if (!std::isfinite(p[0] + p[1] + p[2]))
        return error(ErrorCode::invalid_argument,
                     "body " + number_text(i) + " flew off to infinity",
                     "Use a shorter step, or softer forces.");
    }
  }
  for (Contact& c : contacts_) c.contact.force = vec3(c.feedback.f1);
  return {};
}

void OdeWorld::read(const PhysicsState& out) const {
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const Body& b = bodies_[i];
    Pose t = pose_of(dBodyGetPosition(b.id), dBodyGetRotation(b.id));
    const Vec3 arm = spatial::scale(spatial::rotate(t, b.com), -1);
    t.p = spatial::add(t.p, arm);
    const Vec3 w = vec3(dBodyGetAngularVel(b.id));
    if (i < out.poses.size()) out.poses[i] = t;
    if (i < out.angular_velocities.size()) out.angular_velocities[i] = w;
    if (i < out.velocities.size())
      out.velocities[i] = spatial::add(vec3(dBodyGetLinearVel(b.id)), spatial::cross(w, arm));
  }
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    if (i < out.joint_positions.size()) out.joint_positions[i] = position(joints_[i]);
    if (i < out.joint_velocities.size()) out.joint_velocities[i] = rate(joints_[i]);
  }
}

void OdeWorld::contacts(std::vector<PhysicsContact>& out) const {
  out.clear();
  for (const Contact& c : contacts_) out.push_back(c.contact);
  std::stable_sort(out.begin(), out.end(), [](const PhysicsContact& x, const PhysicsContact& y) {
    return std::pair(x.a, x.b) < std::pair(y.a, y.b);
  });
}

Result<std::int32_t> OdeWorld::attach(std::int32_t a, std::int32_t b) {
  make_ready();
  const auto count = static_cast<std::int32_t>(bodies_.size());
  if (a < 0 || b < 0 || a >= count || b >= count || a == b)
    return error(ErrorCode::invalid_argument, "bodies to attach do not exist",
                 "Give the numbers of two bodies.");
  const dJointID joint = dJointCreateFixed(world_, nullptr);
  dJointAttach(joint, body_id(a), body_id(b));
  dJointSetFixed(joint);
  attachments_.push_back({joint, a, b});
  tied_.emplace_back(std::min(a, b), std::max(a, b));
  return static_cast<std::int32_t>(attachments_.size()) - 1;
}

Result<void> OdeWorld::release(std::int32_t attachment) {
  const auto i = static_cast<std::size_t>(attachment);
  if (attachment < 0 || i >= attachments_.size() || !attachments_[i].joint)
    return error(ErrorCode::invalid_argument, "there is no such attachment",
                 "Give a number that attach() gave and that was not released.");
  Attachment& at = attachments_[i];
  dJointDestroy(at.joint);
  at.joint = nullptr;
  const std::pair<std::int32_t, std::int32_t> pair{std::min(at.a, at.b), std::max(at.a, at.b)};
  tied_.erase(std::find(tied_.begin(), tied_.end(), pair));
  return {};
}

Result<void> OdeWorld::move(std::int32_t body, const Pose& pose, Vec3 velocity,
                            Vec3 angular_velocity) {
  if (body < 0 || body >= static_cast<std::int32_t>(bodies_.size()) ||
      bodies_[static_cast<std::size_t>(body)].is_movable)
    return error(ErrorCode::invalid_argument, "only bodies without mass can be placed",
                 "Give the number of a body of mass 0.");
  if (!spatial::is_rigid(pose) || !spatial::is_finite(velocity) ||
      !spatial::is_finite(angular_velocity))
    return error(ErrorCode::invalid_argument, "the place or velocity is not valid", "Correct it.",
                 "body " + number_text(static_cast<std::size_t>(body)));
  const dBodyID id = body_id(body);
  place(id, pose, {});
  dBodySetLinearVel(id, velocity[0], velocity[1], velocity[2]);
  dBodySetAngularVel(id, angular_velocity[0], angular_velocity[1], angular_velocity[2]);
  return {};
}

}  // namespace robomosp::physics_ode
