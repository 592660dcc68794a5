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
/// Slower than this [m/s] has no direction.
constexpr double kLeastSlip = 1e-9;
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

}  // namespace

Result<std::unique_ptr<OdeWorld>> OdeWorld::make(std::span<const PhysicsBody> bodies,
                                                 std::span<const PhysicsJoint> joints, Vec3 gravity,
                                                 const Settings& settings) {
  make_ready();
  if (!spatial::is_finite(gravity))
    return error(ErrorCode::invalid_argument, "gravity is not finite", "Correct it.");
  std::unique_ptr<OdeWorld> w(new OdeWorld());
  w->settings_ = settings;
  w->gravity_ = gravity;
  w->world_ = dWorldCreate();
  w->space_ = dHashSpaceCreate(nullptr);
  w->contact_joints_ = dJointGroupCreate(0);
  dWorldSetGravity(w->world_, gravity[0], gravity[1], gravity[2]);
  dWorldSetERP(w->world_, settings.erp);
  dWorldSetCFM(w->world_, settings.cfm);
  dWorldSetQuickStepNumIterations(w->world_, settings.sweeps);
  dWorldSetAutoDisableFlag(w->world_, 0);
  dWorldSetContactSurfaceLayer(w->world_, 1e-5);
  for (std::size_t i = 0; i < bodies.size(); ++i) RMP_TRY(w->add_body(bodies[i], i));
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

bool OdeWorld::may_touch(std::int32_t a, std::int32_t b) const {
  const Body &x = bodies_[static_cast<std::size_t>(a)], &y = bodies_[static_cast<std::size_t>(b)];
  if (!x.is_movable && !y.is_movable) return false;
  if (x.group != 0 && x.group == y.group && !(x.self && y.self)) return false;
  const std::pair<std::int32_t, std::int32_t> pair{std::min(a, b), std::max(a, b)};
  return std::find(tied_.begin(), tied_.end(), pair) == tied_.end();
}

/// Aligns the pyramid of friction with where the bodies would slide without friction: along that
/// direction it is as wide as the cone.
void OdeWorld::set_direction(const Body& x, const Body& y, dContact& c) const {
  const Vec3 at = vec3(c.geom.pos), n = vec3(c.geom.normal);
  const auto velocity = [&](const Body& b) {
    dVector3 v;
    dBodyGetPointVel(b.id, at[0], at[1], at[2], v);
    // What joints hold does not fall.
    return b.is_movable && !b.is_jointed ? spatial::add(vec3(v), spatial::scale(gravity_, dt_))
                                         : vec3(v);
  };
  const Vec3 v = spatial::sub(velocity(x), velocity(y));
  const Vec3 t = spatial::sub(v, spatial::scale(n, spatial::dot(v, n)));
  const double speed = spatial::norm(t);
  if (!(speed > kLeastSlip)) return;
  c.surface.mode |= dContactFDir1;
  for (std::size_t k = 0; k < 3; ++k) c.fdir1[k] = t[k] / speed;
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
    set_direction(x, y, c);
    const dJointID joint = dJointCreateContact(world_, contact_joints_, &c);
    dJointAttach(joint, x.id, y.id);
    Contact& kept = contacts_.emplace_back();
    kept.contact = {a, b, vec3(c.geom.pos), vec3(c.geom.normal), c.geom.depth, {}};
    kept.feedback = {};
    dJointSetFeedback(joint, &kept.feedback);
  }
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
  dt_ = dt;
  for (std::int32_t s = 0; s < steps; ++s) {
    if (s % 16 == 0 && progress.cancelled())
      return error(ErrorCode::cancelled, "the simulation was stopped");
    dJointGroupEmpty(contact_joints_);
    contacts_.clear();
    dSpaceCollide(space_, this, [](void* self, dGeomID a, dGeomID b) {
      static_cast<OdeWorld*>(self)->collide(a, b);
    });
    for (Joint& j : joints_) prepare(j);
    const bool done = !has_rows_ ? advance(forces, {}) : advance_with_rows(forces);
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
  pushes_.clear();
  return {};
}

Pose OdeWorld::pose(std::int32_t body) const {
  if (body < 0) return {};
  const Body& b = bodies_[static_cast<std::size_t>(body)];
  Pose t = pose_of(dBodyGetPosition(b.id), dBodyGetRotation(b.id));
  t.p = spatial::sub(t.p, spatial::rotate(t, b.com));
  return t;
}

Result<void> OdeWorld::read(const PhysicsState& out) const {
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const Body& b = bodies_[i];
    const Pose t = pose(static_cast<std::int32_t>(i));
    const Vec3 arm = spatial::scale(spatial::rotate(t, b.com), -1);
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
  return {};
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

Result<void> OdeWorld::ignore(std::int32_t a, std::int32_t b) {
  const auto count = static_cast<std::int32_t>(bodies_.size());
  if (a < 0 || b < 0 || a >= count || b >= count || a == b)
    return error(ErrorCode::invalid_argument, "bodies that are not to touch do not exist",
                 "Give the numbers of two bodies.");
  tied_.emplace_back(std::min(a, b), std::max(a, b));
  return {};
}

Result<void> OdeWorld::push(std::int32_t body, Vec3 force, Vec3 torque) {
  if (body < 0 || body >= static_cast<std::int32_t>(bodies_.size()) || !spatial::is_finite(force) ||
      !spatial::is_finite(torque))
    return error(ErrorCode::invalid_argument, "the body or the force on it is not valid",
                 "Give the number of a body and finite forces.");
  pushes_.push_back({body, force, torque});
  return {};
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
