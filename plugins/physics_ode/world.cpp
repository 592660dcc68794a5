// SPDX-License-Identifier: Apache-2.0
#include "world.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <mutex>
#include <numbers>
#include <stdexcept>
#include <string>
#include <string_view>

#include "near_pairs.h"
#include "patch.h"
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

/// Beyond these the engine's cells overflow, its sums lose all digits, or its assertions end the
/// process. Of centres of mass and sizes [m], speeds [m/s], turning [rad/s], masses [kg], forces
/// [N or N m] and gravity [m/s^2].
constexpr double kFarthest = 1e7, kFastest = 1e7, kFastestTurn = 1e6;
constexpr double kLeastMass = 1e-9, kMostMass = 1e12, kMostForce = 1e12, kMostGravity = 1e6;
constexpr double kShortestStep = 1e-9, kLongestStep = 100;  ///< [s]
/// What a step may take on, so that it ends within some tenths of a second and can be stopped:
/// rows of an island for Dantzig's method, whose work grows with their cube, and contacts in all.
constexpr std::size_t kMostRows = 1650, kMostContacts = 20'000;
/// A push of what is too deep may leave bodies this speed [m/s or rad/s]: a bounce of 0.05 um.
constexpr double kSlowPush = 1e-3;
constexpr std::size_t kMostPoints = 64;  ///< of a pair of shapes
constexpr double kParallel = 0.9999;     ///< cosine of directions that count as one
constexpr double kBeside = 1e-3;         ///< sine of a direction that still counts as outwards
constexpr double kDeepestAtRim = 0.1;    ///< of its radius
constexpr double kAtRim = 1e-9;          ///< of a radius
constexpr double kLeastShare = 1e-6;     ///< of a repair, so that it divides

/// Thrown where the engine would end the process.
struct EngineFailure : std::runtime_error {
  using std::runtime_error::runtime_error;
};

[[noreturn]] void fail(int, const char* message, va_list arguments) {
  std::array<char, 256> text{};
  std::vsnprintf(text.data(), text.size(), message, arguments);
  throw EngineFailure(text.data());
}

bool is_within(const Vec3& v, double most) {
  return std::all_of(v.begin(), v.end(), [&](double x) { return std::fabs(x) <= most; });
}

Error beyond(std::string what, const char* hint, std::string where = {}) {
  return error(ErrorCode::invalid_argument, std::move(what), hint, std::move(where));
}
constexpr const char* kTooMuch = "Use a shorter step, softer gains or smaller forces.";

thread_local bool has_complained = false;  ///< the engine, since this was set to false

void make_ready() {
  static const int initialised = [] {
    // It would write to the standard error. Dantzig's method gives up where contacts are redundant
    // and without depth, and what it leaves lets bodies jump.
    dSetMessageHandler([](int, const char*, va_list) { has_complained = true; });
    dSetErrorHandler(fail);
    dSetDebugHandler(fail);
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

const GeometryTag& tag_of(dGeomID g) { return *static_cast<const GeometryTag*>(dGeomGetData(g)); }

Vec3 axis_of(dGeomID cylinder) {
  const dReal* R = dGeomGetRotation(cylinder);
  return {R[2], R[6], R[10]};
}

/// The engine takes the end of a cylinder for the octagon around it: points beyond the rim go to
/// it. `arm`: the mean distance of the end's points from the axis, of the radius.
void keep_on_cylinder(dGeomID cylinder, dContactGeom& at, double& arm) {
  dReal radius = 0, length = 0;
  dGeomCylinderGetParams(cylinder, &radius, &length);
  const Vec3 axis = axis_of(cylinder), from = vec3(dGeomGetPosition(cylinder));
  if (std::fabs(spatial::dot(axis, vec3(at.normal))) < kParallel) return;
  const Vec3 d = spatial::sub(vec3(at.pos), from);
  const double z = spatial::dot(axis, d);
  const Vec3 along = spatial::scale(axis, z), out = spatial::sub(d, along);
  const double r = spatial::norm(out);
  if (r < radius * (1 - kAtRim)) return;
  const Vec3 p = spatial::add(from, spatial::add(along, spatial::scale(out, radius / r)));
  std::copy_n(p.begin(), 3, at.pos);
  arm = tag_of(cylinder).arm[z > 0 ? 1 : 0];
}

/// Of a round geometry the points where there is a surface, of a rim those where the outline is
/// farthest that way; returns their number, in front. `sign`: of the normal into the geometry.
std::size_t keep_what_is_there(dGeomID g, double sign, std::span<dContactGeom> points) {
  const GeometryTag& tag = tag_of(g);
  if (!tag.opening && tag.role != Role::rim) return points.size();
  dReal radius = 0, length = 0;
  if (tag.role == Role::rim) dGeomCylinderGetParams(g, &radius, &length);
  const dReal* R = dGeomGetRotation(g);
  const Pose back = spatial::inverse(pose_of(dGeomGetPosition(g), R));
  const auto is_wanted = [&](const dContactGeom& c) {
    const Vec3 p = spatial::transform(back, vec3(c.pos));
    const Vec3 d = spatial::scale(spatial::rotate(back, vec3(c.normal)), -sign);  // outwards
    if (tag.opening) return tag.opening->is_there(p, d, c.depth);
    // In the half plane through the axis and the point.
    const double r = std::hypot(p[0], p[1]);
    // What is deeper, or farther in, is in a bore.
    if (c.depth > kDeepestAtRim * radius || r < (1 - kDeepestAtRim) * radius) return false;
    const double out = r > 0 ? (d[0] * p[0] + d[1] * p[1]) / r : 0;
    return std::all_of(tag.sides.begin(), tag.sides.end(), [&](const auto& side) {
      return out * side[0] + d[2] * side[1] <= kBeside * std::hypot(side[0], side[1]);
    });
  };
  const auto end = std::stable_partition(points.begin(), points.end(), is_wanted);
  return static_cast<std::size_t>(end - points.begin());
}

}  // namespace

std::string short_number(double x) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.3g", x);
  return text.data();
}

bool step_exactly(dWorldID world, double dt) {
  has_complained = false;
  return dWorldStep(world, dt) != 0;
}
bool gave_up() { return has_complained; }

Result<std::unique_ptr<OdeWorld>> OdeWorld::make(std::span<const PhysicsBody> bodies,
                                                 std::span<const PhysicsJoint> joints, Vec3 gravity,
                                                 const Settings& settings) {
  make_ready();
  if (!is_within(gravity, kMostGravity))
    return beyond("gravity is not finite, or beyond 1e6 m/s^2", "Correct it.");
  std::unique_ptr<OdeWorld> w(new OdeWorld());
  w->settings_ = settings;
  w->gravity_ = gravity;
  w->world_ = dWorldCreate();
  w->space_ = dSimpleSpaceCreate(nullptr);
  w->contact_joints_ = dJointGroupCreate(0);
  dWorldSetGravity(w->world_, gravity[0], gravity[1], gravity[2]);
  dWorldSetERP(w->world_, settings.erp);
  dWorldSetCFM(w->world_, settings.cfm);
  dWorldSetQuickStepNumIterations(w->world_, settings.sweeps);
  dWorldSetAutoDisableFlag(w->world_, 0);
  dWorldSetContactSurfaceLayer(w->world_, 1e-5);
  try {
    for (std::size_t i = 0; i < bodies.size(); ++i) RMP_TRY(w->add_body(bodies[i], i));
    for (std::size_t i = 0; i < joints.size(); ++i) RMP_TRY(w->add_joint(joints[i], i, bodies));
  } catch (const EngineFailure& e) {
    return beyond(std::string("the engine rejects it (") + e.what() + ")",
                  "Correct sizes, masses and placements.",
                  w->joints_.empty() ? "body " + number_text(w->bodies_.size()) : "");
  }
  return w;
}

OdeWorld::OdeWorld() : near_pairs_(std::make_unique<NearPairs>()) {}

OdeWorld::~OdeWorld() {
  try {
    if (contact_joints_) dJointGroupDestroy(contact_joints_);
    if (space_) dSpaceDestroy(space_);
    if (world_) dWorldDestroy(world_);
  } catch (const EngineFailure&) {
    // It stopped in the middle of a step: the rest is left as it is.
  }
}

Result<void> OdeWorld::add_body(const PhysicsBody& body, std::size_t number) {
  const std::string where = "body " + number_text(number);
  if (!spatial::is_finite(body.mass) || !spatial::is_rigid(body.pose) ||
      !spatial::is_finite(body.velocity) || !spatial::is_finite(body.angular_velocity))
    return error(ErrorCode::invalid_argument, "its mass, placement or velocity is not valid",
                 "Correct them.", where);
  if (!(body.friction >= 0) || !(body.restitution >= 0 && body.restitution <= 1))
    return error(ErrorCode::invalid_argument, "its friction or restitution is out of range",
                 "Friction is at least 0, restitution from 0 to 1.", where);
  const double mass = body.mass.mass;
  if (mass > 0 && !(mass >= kLeastMass && mass <= kMostMass))
    return beyond("its mass of " + short_number(mass) + " kg is not from 1e-9 to 1e12 kg",
                  "Correct its density or size.", where);
  if (!is_within(body.pose.p, kFarthest) || !is_within(body.velocity, kFastest) ||
      !is_within(body.angular_velocity, kFastestTurn))
    return beyond("it is beyond 1e7 m, or faster than 1e7 m/s or 1e6 rad/s",
                  "Place it nearer, or start it with a lower velocity.", where);
  for (const Shape& shape : body.shape.shapes)
    if (!is_within(shape.sizes, kFarthest) || !is_within(shape.pose.p, kFarthest))
      return beyond("one of its shapes is larger than 1e7 m, or farther away than that",
                    "Make it smaller.", where);
  Body b;
  b.is_movable = mass > 0;
  b.com = b.is_movable ? body.mass.com : Vec3{};
  b.friction = body.friction;
  b.restitution = body.restitution;
  b.group = body.group;
  b.self = body.self;
  b.pose = body.pose;
  if (b.is_movable) {
    const double least = spatial::principal(body.mass.inertia).moments[0];
    if (!(least > 0))
      return error(ErrorCode::invalid_argument, "it has mass but no inertia about some axis",
                   "Give it an inertia about all three axes.", where);
    const Sym3& I = body.mass.inertia;
    dMass m;
    dMassSetParameters(&m, mass, 0, 0, 0, I.xx, I.yy, I.zz, I.xy, I.xz, I.yz);
    b.id = dBodyCreate(world_);
    dBodySetMass(b.id, &m);
    place(b.id, body.pose, b.com);
    const Vec3 v = at_com(body.velocity, body.angular_velocity, body.pose, b.com);
    dBodySetLinearVel(b.id, v[0], v[1], v[2]);
    dBodySetAngularVel(b.id, body.angular_velocity[0], body.angular_velocity[1],
                       body.angular_velocity[2]);
  }
  bodies_.push_back(std::move(b));
  for (std::size_t i = 0; i < body.shape.shapes.size(); ++i) {
    const Shape& shape = body.shape.shapes[i];
    auto made = make_geometries(space_, shape);
    if (!made.ok()) return std::move(made).error().in(where);
    for (Geometry& g : *made) {
      g.tag->body = static_cast<std::int32_t>(number);
      g.tag->shape = static_cast<std::int32_t>(i);
      g.tag->number = geometries_++;
      dGeomSetData(g.id, g.tag.get());
      near_pairs_->add(g.id, static_cast<std::int32_t>(number), bodies_.back().is_movable);
      bodies_.back().geometries.push_back(std::move(g));
    }
  }
  fasten(bodies_.back());
  note_extent(bodies_.back());
  const bool is_carried =
      !bodies_.back().is_movable && (body.velocity != Vec3{} || body.angular_velocity != Vec3{});
  if (is_carried)
    return move(static_cast<std::int32_t>(number), body.pose, body.velocity, body.angular_velocity);
  return {};
}

/// How thin its geometries are and how far they reach.
void OdeWorld::note_extent(Body& b) const {
  for (Geometry& g : b.geometries) {
    dReal at[6];
    // In the geometry's own axes.
    const Pose now = pose_of(dGeomGetPosition(g.id), dGeomGetRotation(g.id));
    const dBodyID body = dGeomGetBody(g.id);
    dGeomSetBody(g.id, nullptr);
    dMatrix3 R;
    to_ode(Pose{}, R);
    dGeomSetRotation(g.id, R);
    dGeomGetAABB(g.id, at);
    const Vec3 size{at[1] - at[0], at[3] - at[2], at[5] - at[4]};
    g.thickness = *std::min_element(size.begin(), size.end());
    to_ode(now, R);
    dGeomSetRotation(g.id, R);
    if (body) dGeomSetBody(g.id, body);
    b.thinnest = b.thinnest > 0 ? std::min(b.thinnest, g.thickness) : g.thickness;
    b.reach = std::max(b.reach,
                       spatial::distance(g.body_T_geometry.p, b.com) + 0.5 * spatial::norm(size));
  }
  fasten(b);
}

/// The geometries where the body is, or fixed to it.
void OdeWorld::fasten(const Body& b) {
  for (const Geometry& g : b.geometries) {
    const Pose t = b.id ? g.body_T_geometry : spatial::compose(b.pose, g.body_T_geometry);
    dMatrix3 R;
    to_ode(t, R);
    if (b.id) {
      dGeomSetBody(g.id, b.id);
      dGeomSetOffsetPosition(g.id, t.p[0] - b.com[0], t.p[1] - b.com[1], t.p[2] - b.com[2]);
      dGeomSetOffsetRotation(g.id, R);
    } else {
      dGeomSetPosition(g.id, t.p[0], t.p[1], t.p[2]);
      dGeomSetRotation(g.id, R);
    }
  }
}

void OdeWorld::give_id(std::int32_t body) {
  if (body < 0) return;
  Body& b = bodies_[static_cast<std::size_t>(body)];
  if (b.id) return;
  b.id = dBodyCreate(world_);
  dBodySetKinematic(b.id);
  place(b.id, b.pose, b.com);
  fasten(b);
  near_pairs_->regroup();
}

bool OdeWorld::may_touch(std::int32_t a, std::int32_t b) const {
  const Body &x = bodies_[static_cast<std::size_t>(a)], &y = bodies_[static_cast<std::size_t>(b)];
  if (!x.is_movable && !y.is_movable) return false;
  if (x.group != 0 && x.group == y.group && !(x.self && y.self)) return false;
  return !tied_.contains({std::min(a, b), std::max(a, b)});
}

/// Aligns the pyramid of friction with where the bodies would slide without friction: along that
/// direction it is as wide as the cone.
void OdeWorld::set_direction(const Body& x, const Body& y, dContact& c) const {
  const Vec3 at = vec3(c.geom.pos), n = vec3(c.geom.normal);
  const auto velocity = [&](const Body& b) {
    if (!b.id) return Vec3{};
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
  const GeometryTag &x = tag_of(first), &y = tag_of(second);
  const std::int32_t a = x.body, b = y.body;
  if (!meet(x.role, y.role) || !may_touch(a, b)) return;
  std::array<dContactGeom, kMostPoints> points;
  const int most = std::min(settings_.most_contacts, static_cast<int>(kMostPoints));
  auto count =
      static_cast<std::size_t>(dCollide(first, second, most, points.data(), sizeof(dContactGeom)));
  double arm = 0;  // of an even pressure on a round end
  for (const dGeomID g : {first, second}) {
    if (dGeomGetClass(g) == dCylinderClass)
      for (std::size_t i = 0; i < count; ++i) keep_on_cylinder(g, points[i], arm);
    count = keep_what_is_there(g, g == first ? 1 : -1, {points.data(), count});
  }
  if (x.is_beside_round || y.is_beside_round)
    count = drop_beside_round(x, y, {points.data(), count});
  const auto is_round = [](const GeometryTag& t) { return t.role == Role::rim || t.opening; };
  for (std::size_t i = 0; i < count; ++i) {
    add_contact(x, y, points[i], 1);
    contacts_.back().round = (is_round(x) ? 1U : 0U) | (is_round(y) ? 2U : 0U);
  }
  if (count < 3) return;
  const Vec3 normal = vec3(points[0].normal);
  std::array<Vec3, kMostPoints> places;
  std::array<double, kMostPoints> depths;
  for (std::size_t i = 0; i < count; ++i) {
    if (spatial::dot(normal, vec3(points[i].normal)) < kParallel) return;
    places[i] = vec3(points[i].pos), depths[i] = points[i].depth;
  }
  const auto middle = patch_middle({places.data(), count}, {depths.data(), count}, normal, arm);
  if (!middle) return;
  dContactGeom at = points[0];
  std::copy_n(middle->point.begin(), 3, at.pos);
  at.depth = middle->depth;
  // Loads are as the inverse softness where a body rests on several points.
  add_contact(x, y, at, (1 - middle->share) / (middle->share * static_cast<double>(count)));
}

/// Without the points of triangles that press the same way as the round outside of their shape,
/// which is farther out; returns the number of the others, in front.
std::size_t OdeWorld::drop_beside_round(const GeometryTag& x, const GeometryTag& y,
                                        std::span<dContactGeom> points) const {
  const auto is_wanted = [&](const dContactGeom& c) {
    return std::none_of(contacts_.rbegin(), contacts_.rend(), [&](const Contact& other) {
      return other.round != 0 && other.contact.a == x.body && other.contact.b == y.body &&
             other.shapes == std::array{x.shape, y.shape} &&
             ((x.is_beside_round && (other.round & 1) != 0) ||
              (y.is_beside_round && (other.round & 2) != 0)) &&
             spatial::dot(other.contact.normal, vec3(c.normal)) > kParallel;
    });
  };
  const auto end = std::stable_partition(points.begin(), points.end(), is_wanted);
  return static_cast<std::size_t>(end - points.begin());
}

void OdeWorld::add_contact(const GeometryTag& of_a, const GeometryTag& of_b, const dContactGeom& at,
                           double softness) {
  const std::int32_t a = of_a.body, b = of_b.body;
  const Body &x = bodies_[static_cast<std::size_t>(a)], &y = bodies_[static_cast<std::size_t>(b)];
  dContact c{};
  c.geom = at;
  c.surface.mode = dContactApprox1 | dContactSoftERP | dContactSoftCFM;
  c.surface.mu = std::sqrt(x.friction * y.friction);
  c.surface.soft_erp = settings_.contact_erp;
  c.surface.soft_cfm = softness * settings_.contact_cfm;
  if (const double bounce = std::max(x.restitution, y.restitution); bounce > 0) {
    c.surface.mode |= dContactBounce;
    c.surface.bounce = bounce;
    c.surface.bounce_vel = 0.02;
  }
  set_direction(x, y, c);
  std::array<std::uint32_t, 3> key{of_a.number, of_b.number, 0};
  if (!contacts_.empty() && contacts_.back().key[0] == key[0] && contacts_.back().key[1] == key[1])
    key[2] = contacts_.back().key[2] + 1;
  Contact& kept = contacts_.emplace_back();
  kept.key = key;
  kept.shapes = {of_a.shape, of_b.shape};
  kept.contact = {a, b, vec3(c.geom.pos), vec3(c.geom.normal), c.geom.depth, {}};
  kept.made = c;
  kept.feedback = {};
  kept.first_is_a = x.id != nullptr;
}

/// Of the contact's joint. What is pushed out is pushed by what friction was without the push.
dSurfaceParameters OdeWorld::surface(const Contact& contact, Pass pass) const {
  dSurfaceParameters s = contact.made.surface;
  if (pass == Pass::motion) s.soft_erp = 0;
  if (pass == Pass::places) {
    s.mode &= ~dContactApprox1;
    s.mu = contact.push_limit;
  }
  return s;
}

void OdeWorld::make_contact_joints(Pass pass) {
  for (Contact& c : contacts_) {
    if (c.is_solved) continue;
    dContact made = c.made;
    made.surface = surface(c, pass);
    const dJointID joint = dJointCreateContact(world_, contact_joints_, &made);
    dJointAttach(joint, body_id(c.contact.a), body_id(c.contact.b));
    if (pass != Pass::places) dJointSetFeedback(joint, &c.feedback);
  }
}

/// Whether repairing what is too deep would give bodies a speed worth mentioning.
bool OdeWorld::is_deep() const {
  const double layer = dWorldGetContactSurfaceLayer(world_);
  const double contact = kSlowPush * dt_ / std::max(settings_.contact_erp, kLeastShare);
  const double stop = kSlowPush * dt_ / std::max(settings_.erp, kLeastShare);
  return std::any_of(contacts_.begin(), contacts_.end(),
                     [&](const Contact& c) { return c.made.geom.depth - layer > contact; }) ||
         std::any_of(joints_.begin(), joints_.end(),
                     [&](const Joint& j) { return beyond_stop(j) > stop; });
}

/// That all bodies are where contact can be found.
Result<void> OdeWorld::check_state() const {
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const dBodyID id = bodies_[i].id;
    if (!id) continue;
    const Vec3 p = vec3(dBodyGetPosition(id)), v = vec3(dBodyGetLinearVel(id)),
               w = vec3(dBodyGetAngularVel(id));
    const dReal* q = dBodyGetQuaternion(id);
    if (is_within(p, kFarthest) && is_within(v, kFastest) && is_within(w, kFastestTurn) &&
        std::isfinite(q[0] + q[1] + q[2] + q[3]))
      continue;
    return beyond("it diverged: beyond 1e7 m, 1e7 m/s or 1e6 rad/s", kTooMuch,
                  "body " + number_text(i));
  }
  return {};
}

/// Whether the exact solver takes all islands, which are those of the engine.
bool OdeWorld::are_islands_small() const {
  if (!settings_.exact || 3 * contacts_.size() <= kMostRows) return true;
  std::vector<std::size_t> root(bodies_.size());
  for (std::size_t i = 0; i < root.size(); ++i) root[i] = i;
  const auto find = [&](std::size_t i) {
    while (root[i] != i) i = root[i] = root[root[i]];
    return i;
  };
  const auto join = [&](std::int32_t a, std::int32_t b) {
    if (body_id(a) && body_id(b))
      root[find(static_cast<std::size_t>(a))] = find(static_cast<std::size_t>(b));
  };
  for (const Joint& j : joints_) join(j.a, j.b);
  for (const Attachment& t : attachments_)
    if (t.joint) join(t.a, t.b);
  for (const Contact& c : contacts_)
    if (!c.is_solved) join(c.contact.a, c.contact.b);
  std::vector<std::size_t> rows(bodies_.size());
  for (const Contact& c : contacts_) {
    if (c.is_solved) continue;
    const std::int32_t one = body_id(c.contact.a) ? c.contact.a : c.contact.b;
    if ((rows[find(static_cast<std::size_t>(one))] += 3) > kMostRows) return false;
  }
  return true;
}

Result<void> OdeWorld::find_contacts(Progress& progress) {
  contacts_.clear();
  std::size_t asked = 0;
  for (const auto& [a, b] : near_pairs_->find()) {
    if (asked++ % 256 == 255 && progress.cancelled())
      return error(ErrorCode::cancelled, "the simulation was cancelled");
    if (contacts_.size() > kMostContacts)
      return beyond("there are more than " + std::to_string(kMostContacts) +
                        " contacts, the maximum per step",
                    "Place bodies apart, or give a smaller most_contacts.");
    collide(a, b);
  }
  expect_places();
  return {};
}

/// Contacts push as they did in the step before.
void OdeWorld::expect_places() {
  auto before = places_.begin();
  for (Contact& c : contacts_) {
    while (before != places_.end() && before->first < c.key) ++before;
    if (before != places_.end() && before->first == c.key) c.place = before->second;
  }
}

/// Velocities and places after the step, and forces of contact.
Result<void> OdeWorld::solve_step(std::span<const double> forces, Pass pass) {
  for (Contact& c : contacts_) c.is_solved = false;
  settle_piles(pass);
  is_swept_ = !are_islands_small();
  dJointGroupEmpty(contact_joints_);
  make_contact_joints(pass);
  for (Joint& j : joints_) prepare(j, pass);
  const bool done = !has_rows_ ? advance(forces, {}) : advance_with_rows(forces);
  if (!done) return error(ErrorCode::internal, "the engine ran out of memory");
  if (pass == Pass::places) return {};
  // ODE puts the body first where there is one only.
  for (Contact& c : contacts_) {
    if (!c.is_solved) c.contact.force = spatial::scale(vec3(c.feedback.f1), c.first_is_a ? 1 : -1);
    c.push_limit = c.made.surface.mu * std::fabs(spatial::dot(c.contact.force, c.contact.normal));
  }
  return {};
}

Result<void> OdeWorld::step_once(std::span<const double> forces, Progress& progress) {
  RMP_TRY(check_state());
  RMP_TRY(find_contacts(progress));
  begin_turns();
  const std::vector<FastBody> fast = fast_bodies();
  bool is_swept = false;
  if (!is_deep()) {
    RMP_TRY(solve_step(forces, Pass::whole));
    is_swept = is_swept_;
  } else {
    // Pushing out moves bodies and leaves them no speed.
    const std::vector<Moving> before = moving();
    RMP_TRY(solve_step(forces, Pass::motion));
    is_swept = is_swept_;
    const std::vector<Moving> after = moving();
    put_back(before);
    RMP_TRY(solve_step(forces, Pass::places));
    for (const Moving& s : after) {
      dBodySetLinearVel(s.id, s.v[0], s.v[1], s.v[2]);
      dBodySetAngularVel(s.id, s.w[0], s.w[1], s.w[2]);
    }
  }
  end_turns();
  places_.clear();
  for (const Contact& c : contacts_) places_.emplace_back(c.key, c.place);
  if (!fast.empty()) find_passed(fast);
  if ((is_swept || is_swept_) && !was_swept_) {
    was_swept_ = true;
    notes_.push_back({-1, -1,
                      "touching bodies have more than " + std::to_string(kMostRows / 3) +
                          " contacts at once, from step " + std::to_string(steps_ + 1) +
                          " on, now and then: such steps are solved by sweeps instead of exactly, "
                          "so piles creep and sink a little"});
  }
  ++steps_;
  for (Joint& j : joints_) {
    if (j.type != kRevolute) continue;
    const double change = dJointGetHingeAngle(j.id) - j.last;
    if (change > kPi) j.turned -= 2 * kPi;
    if (change < -kPi) j.turned += 2 * kPi;
  }
  return {};
}

const void* OdeWorld::extension(const char* id) const {
  if (!id || std::string_view(id) != PhysicsNotes::kId) return nullptr;
  return static_cast<const PhysicsNotes*>(this);
}

Result<std::vector<PhysicsNote>> OdeWorld::notes() const { return notes_; }

Result<void> OdeWorld::step(double dt, std::int32_t steps, std::span<const double> forces,
                            Progress& progress) {
  make_ready();
  if (!(dt > 0) || !std::isfinite(dt) || steps < 0)
    return error(ErrorCode::invalid_argument, "the step is not a positive time", "Give 1 ms, say.");
  if (dt < kShortestStep || dt > kLongestStep)
    return beyond("a step of " + short_number(dt) + " s is not from 1e-9 to 100 s",
                  "Give 1 ms, say.");
  if (!forces.empty() && forces.size() != joints_.size())
    return error(ErrorCode::invalid_argument,
                 std::to_string(forces.size()) + " forces are given for " +
                     std::to_string(joints_.size()) + " joints",
                 "Give one force per joint, or none.");
  for (std::size_t i = 0; i < forces.size(); ++i)
    if (!(std::fabs(forces[i]) <= kMostForce))
      return beyond("a force of " + short_number(forces[i]) + " is beyond 1e12 N or N m", kTooMuch,
                    "joint " + number_text(i));
  if (is_broken_)
    return error(ErrorCode::invalid_argument, "the engine stopped in an earlier step",
                 "Restart the simulation.");
  const std::lock_guard lock(engine_mutex());
  dt_ = dt;
  try {
    for (std::int32_t s = 0; s < steps; ++s) {
      if (s % 16 == 0 && progress.cancelled())
        return error(ErrorCode::cancelled, "the simulation was cancelled");
      RMP_TRY(step_once(forces, progress));
    }
  } catch (const EngineFailure& e) {
    is_broken_ = true;
    return beyond(std::string("the engine could not continue (") + e.what() + ")", kTooMuch);
  }
  RMP_TRY(check_state());
  pushes_.clear();
  return {};
}

Pose OdeWorld::pose(std::int32_t body) const {
  if (body < 0) return {};
  const Body& b = bodies_[static_cast<std::size_t>(body)];
  if (!b.id) return b.pose;
  Pose t = pose_of(dBodyGetPosition(b.id), dBodyGetRotation(b.id));
  t.p = spatial::sub(t.p, spatial::rotate(t, b.com));
  return t;
}

Result<void> OdeWorld::read(const PhysicsState& out) const {
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const Body& b = bodies_[i];
    const Pose t = pose(static_cast<std::int32_t>(i));
    if (!b.id) {
      if (i < out.poses.size()) out.poses[i] = t;
      if (i < out.angular_velocities.size()) out.angular_velocities[i] = {};
      if (i < out.velocities.size()) out.velocities[i] = {};
      continue;
    }
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
  give_id(a), give_id(b);
  for (const std::int32_t body : {a, b}) ++bodies_[static_cast<std::size_t>(body)].attached;
  const dJointID joint = dJointCreateFixed(world_, nullptr);
  dJointAttach(joint, body_id(a), body_id(b));
  dJointSetFixed(joint);
  attachments_.push_back({joint, a, b});
  tied_.emplace(std::min(a, b), std::max(a, b));
  return static_cast<std::int32_t>(attachments_.size()) - 1;
}

Result<void> OdeWorld::ignore(std::int32_t a, std::int32_t b) {
  const auto count = static_cast<std::int32_t>(bodies_.size());
  if (a < 0 || b < 0 || a >= count || b >= count || a == b)
    return error(ErrorCode::invalid_argument, "bodies to ignore do not exist",
                 "Give the numbers of two bodies.");
  tied_.emplace(std::min(a, b), std::max(a, b));
  return {};
}

Result<void> OdeWorld::push(std::int32_t body, Vec3 force, Vec3 torque) {
  if (body < 0 || body >= static_cast<std::int32_t>(bodies_.size()) ||
      !is_within(force, kMostForce) || !is_within(torque, kMostForce))
    return error(ErrorCode::invalid_argument, "the body or the force on it is not valid",
                 "Give the number of a body and forces up to 1e12 N.");
  pushes_.push_back({body, force, torque});
  return {};
}

Result<void> OdeWorld::release(std::int32_t attachment) {
  const auto i = static_cast<std::size_t>(attachment);
  if (attachment < 0 || i >= attachments_.size() || !attachments_[i].joint)
    return error(ErrorCode::invalid_argument, "there is no such attachment",
                 "Give a number returned by attach() that was not released.");
  Attachment& at = attachments_[i];
  dJointDestroy(at.joint);
  at.joint = nullptr;
  for (const std::int32_t body : {at.a, at.b}) --bodies_[static_cast<std::size_t>(body)].attached;
  const std::pair<std::int32_t, std::int32_t> pair{std::min(at.a, at.b), std::max(at.a, at.b)};
  tied_.erase(tied_.find(pair));
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
    return error(ErrorCode::invalid_argument, "the placement or velocity is not valid",
                 "Correct it.", "body " + number_text(static_cast<std::size_t>(body)));
  if (!is_within(pose.p, kFarthest) || !is_within(velocity, kFastest) ||
      !is_within(angular_velocity, kFastestTurn))
    return beyond("it would be beyond 1e7 m, or faster than 1e7 m/s or 1e6 rad/s", kTooMuch,
                  "body " + number_text(static_cast<std::size_t>(body)));
  Body& b = bodies_[static_cast<std::size_t>(body)];
  // What stays where it is needs no body.
  const bool stays = !b.id && pose.p == b.pose.p && pose.R == b.pose.R && velocity == Vec3{} &&
                     angular_velocity == Vec3{};
  if (stays) return {};
  give_id(body);
  const dBodyID id = b.id;
  place(id, pose, {});
  dBodySetLinearVel(id, velocity[0], velocity[1], velocity[2]);
  dBodySetAngularVel(id, angular_velocity[0], angular_velocity[1], angular_velocity[2]);
  return {};
}

}  // namespace robomosp::physics_ode
