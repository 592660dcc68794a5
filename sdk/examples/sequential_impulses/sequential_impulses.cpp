// SPDX-License-Identifier: Apache-2.0
// A physics engine of one's own: bodies with balls and boxes, every kind of joint, contact with
// friction and restitution, by impulses at the velocities (rows.h) and a semi-implicit Euler step.
// Joints are solved exactly, contacts and limits by sweeps. Nothing is random and nothing is kept
// outside the world, so that equal calls give equal bits.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <robomosp/sdk/physics.h>
#include <robomosp/sdk/plugin.h>
#include <robomosp/sdk/robot_model.h>

#include "rows.h"
#include "spatial/mass.h"
#include "spatial/rotation.h"
#include "touch.h"

namespace {

using namespace robomosp;
using namespace sequential_impulses;

constexpr double kPi = 3.14159265358979323846;
// Corners that rest yield a little, so that they share what presses evenly: of rigid ones no law
// says how.
constexpr double kYielding = 0.01;

struct Settings {
  int sweeps = 0;
  double repair = 0;  ///< share of a drift or of a depth that a step takes back
  bool around = false;
};
struct Body {
  PhysicsBody given;
  std::vector<Solid> solids;  ///< in the body's frame
  double radius = 0;          ///< about the body's origin
  Pose pose;
  Vec3 v{}, w{};  ///< of the centre of mass
  Vec3 force{}, torque{};
  [[nodiscard]] bool is_movable() const { return given.mass.mass > 0; }
  [[nodiscard]] Vec3 com() const { return transform(pose, given.mass.com); }
};
struct Joint {
  PhysicsJoint given;
  std::uint32_t fixed = 0;  ///< LoopDirection
  double q = 0;             ///< counts whole turns
  double servo_speed = 0, servo_force = 0;
  bool is_alive = true;
};
/// A joint's frames in the world, and its axis as ends of a row.
struct Placed {
  Pose a, b;
  Row axis;
};

Error bad(std::string message, std::string hint, std::string where = {}) {
  return error(ErrorCode::invalid_argument, std::move(message), std::move(hint), std::move(where));
}
std::string numbered(const char* what, std::size_t i) { return what + std::to_string(i + 1); }

/// Inverse of a positive definite matrix by its cofactors.
Sym3 inverse(const Sym3& s) {
  const Sym3 c{s.yy * s.zz - s.yz * s.yz, s.xx * s.zz - s.xz * s.xz, s.xx * s.yy - s.xy * s.xy,
               s.xz * s.yz - s.xy * s.zz, s.xy * s.xz - s.xx * s.yz, s.xy * s.yz - s.xz * s.yy};
  return scale(c, 1 / (s.xx * c.xx + s.xy * c.xy + s.xz * c.xz));
}
bool is_positive(const Sym3& s) {
  return is_finite(s) && s.xx > 0 && s.xx * s.yy - s.xy * s.xy > 0 &&
         multiply(s, Vec3{s.yy * s.zz - s.yz * s.yz, s.xz * s.yz - s.xy * s.zz,
                          s.xy * s.yz - s.xz * s.yy})[0] > 0;
}

Result<Solid> solid_of(const Shape& s, bool around) {
  const auto box = [&](const Vec3& middle, const Vec3& half) -> Result<Solid> {
    for (const double x : half)
      if (!(x > 0) || !std::isfinite(x)) return bad("a size is not positive", "Give a solid.");
    return Solid{compose(s.pose, Pose{{1, 0, 0, 0, 1, 0, 0, 0, 1}, middle}), half, 0};
  };
  switch (s.kind) {
    case ShapeKind::sphere:
      if (!(s.sizes[0] > 0)) return bad("a size is not positive", "Give a solid.");
      return Solid{s.pose, {}, s.sizes[0]};
    case ShapeKind::box: return box({}, scale(s.sizes, 0.5));
    case ShapeKind::cylinder:
      if (around) return box({}, {s.sizes[0], s.sizes[0], s.sizes[1] / 2});
      break;
    case ShapeKind::capsule:
      if (around) return box({}, {s.sizes[0], s.sizes[0], s.sizes[0] + s.sizes[1] / 2});
      break;
    case ShapeKind::cone:
    case ShapeKind::ellipsoid: break;
    case ShapeKind::mesh:
    case ShapeKind::convex: {
      if (!around) break;
      if (!s.mesh || s.mesh->positions.empty()) return bad("a mesh has no points", "Give a solid.");
      Vec3 low{kUnbounded, kUnbounded, kUnbounded}, high = scale(low, -1);
      for (std::size_t i = 0; i < s.mesh->positions.size(); ++i) {
        const double x = static_cast<double>(s.mesh->positions[i]);
        low[i % 3] = std::min(low[i % 3], x), high[i % 3] = std::max(high[i % 3], x);
      }
      return box(scale(add(low, high), 0.5), scale(sub(high, low), 0.5));
    }
  }
  return error(ErrorCode::unsupported, "it has a shape that is neither a ball nor a box",
               "Give the parameter around = true to take the box around it, or choose ode.");
}

class World final : public PhysicsWorld {
 public:
  static Result<std::unique_ptr<World>> make(std::span<const PhysicsBody> bodies,
                                             std::span<const PhysicsJoint> joints, Vec3 gravity,
                                             const Settings& settings) {
    auto world = std::make_unique<World>();
    world->gravity_ = gravity;
    world->settings_ = settings;
    for (std::size_t i = 0; i < bodies.size(); ++i)
      RMP_TRY(world->add_body(bodies[i]).in(numbered("body ", i)));
    for (std::size_t i = 0; i < joints.size(); ++i)
      RMP_TRY(world->add_joint(joints[i]).in(numbered("joint ", i)));
    return world;
  }

  Result<void> step(double dt, std::int32_t steps, std::span<const double> forces,
                    Progress& progress) override {
    if (!(dt > 0) || !std::isfinite(dt) || steps < 0)
      return bad("the step is not a positive time", "Give 1 ms, say.");
    if (!forces.empty() && forces.size() != given_joints_)
      return bad(std::to_string(forces.size()) + " forces are given for " +
                     std::to_string(given_joints_) + " joints",
                 "Give one force per joint, or none.");
    for (std::int32_t s = 0; s < steps; ++s) {
      if (s % 16 == 0 && progress.cancelled())
        return error(ErrorCode::cancelled, "the simulation was cancelled");
      RMP_TRY(one_step(dt, forces));
    }
    for (Body& b : bodies_) b.force = b.torque = {};
    return {};
  }
  Result<void> read(const PhysicsState& out) const override {
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      const Body& b = bodies_[i];
      if (i < out.poses.size()) out.poses[i] = b.pose;
      if (i < out.velocities.size())
        out.velocities[i] = sub(b.v, cross(b.w, sub(b.com(), b.pose.p)));
      if (i < out.angular_velocities.size()) out.angular_velocities[i] = b.w;
    }
    for (std::size_t j = 0; j < given_joints_; ++j) {
      if (j < out.joint_positions.size()) out.joint_positions[j] = joints_[j].q;
      if (j < out.joint_velocities.size())
        out.joint_velocities[j] =
            has_axis(joints_[j]) ? placed(joints_[j]).axis.speed(moving()) : 0;
    }
    return {};
  }
  void contacts(std::vector<PhysicsContact>& out) const override { out = contacts_; }

  Result<std::int32_t> attach(std::int32_t a, std::int32_t b) override {
    if (!exists(a) || !exists(b) || a == b)
      return bad("bodies to attach do not exist", "Give the numbers of two bodies.");
    PhysicsJoint tie;
    tie.a = a, tie.b = b, tie.type = 2;
    tie.in_a = compose(spatial::inverse(body(a).pose), body(b).pose);
    RMP_TRY(add_joint(tie));
    --given_joints_;
    return static_cast<std::int32_t>(joints_.size() - 1 - given_joints_);
  }
  Result<void> release(std::int32_t attachment) override {
    const auto i = given_joints_ + static_cast<std::size_t>(std::max(attachment, 0));
    if (attachment < 0 || i >= joints_.size() || !joints_[i].is_alive)
      return bad("there is no such attachment",
                 "Give a number returned by attach() that is still attached.");
    joints_[i].is_alive = false;
    return {};
  }
  Result<void> move(std::int32_t b, const Pose& pose, Vec3 velocity,
                    Vec3 angular_velocity) override {
    if (!exists(b) || body(b).is_movable())
      return bad("only bodies without mass can be placed", "Give the number of a body of mass 0.");
    if (!is_rigid(pose) || !is_finite(velocity) || !is_finite(angular_velocity))
      return bad("the placement or velocity is not valid", "Correct it.");
    body(b).pose = pose, body(b).v = velocity, body(b).w = angular_velocity;
    return {};
  }
  Result<void> servo(std::int32_t joint, double velocity, double force) override {
    if (joint < 0 || std::cmp_greater_equal(joint, given_joints_) ||
        !has_axis(joints_[static_cast<std::size_t>(joint)]) || !(force >= 0))
      return bad("there is no such motor", "Give a revolute or prismatic joint and a force >= 0.");
    Joint& j = joints_[static_cast<std::size_t>(joint)];
    j.servo_speed = velocity, j.servo_force = force;
    return {};
  }
  Result<void> push(std::int32_t b, Vec3 force, Vec3 torque) override {
    if (!exists(b)) return bad("there is no such body", "Give the number of a body.");
    Body& x = body(b);
    x.force = add(x.force, force);
    x.torque = add(x.torque, add(torque, cross(sub(x.pose.p, x.com()), force)));
    return {};
  }
  Result<void> ignore(std::int32_t a, std::int32_t b) override {
    if (!exists(a) || !exists(b) || a == b)
      return bad("bodies to ignore do not exist", "Give the numbers of two bodies.");
    ignored_.insert(std::minmax(a, b));
    return {};
  }

 private:
  [[nodiscard]] bool exists(std::int32_t b) const {
    return b >= 0 && std::cmp_less(b, bodies_.size());
  }
  [[nodiscard]] Body& body(std::int32_t b) { return bodies_[static_cast<std::size_t>(b)]; }
  [[nodiscard]] static bool has_axis(const Joint& j) { return j.given.type <= 1; }
  /// The world is one more body, behind all others.
  [[nodiscard]] std::size_t index(std::int32_t b) const {
    return b < 0 ? bodies_.size() : static_cast<std::size_t>(b);
  }
  [[nodiscard]] Pose pose(std::int32_t b) const {
    return b < 0 ? Pose{} : bodies_[static_cast<std::size_t>(b)].pose;
  }
  [[nodiscard]] Vec3 com(std::size_t b) const {
    return b < bodies_.size() ? bodies_[b].com() : Vec3{};
  }

  Result<void> add_body(const PhysicsBody& given) {
    Body b;
    b.given = given;
    b.pose = given.pose;
    if (!is_rigid(given.pose) || !is_finite(given.mass) || !(given.mass.mass >= 0))
      return bad("its placement or mass is not valid", "Correct it.");
    if (b.is_movable() && !is_positive(given.mass.inertia))
      return bad("its inertia is not positive", "Give that of a solid.");
    if (!b.is_movable()) b.given.mass = {};
    if (!(given.friction >= 0) || !(given.restitution >= 0 && given.restitution <= 1))
      return bad("its friction or restitution is out of range", "Give 0 or more, and 0..1.");
    for (const Shape& s : given.shape.shapes) {
      RMP_TRY_ASSIGN(const Solid solid, solid_of(s, settings_.around));
      b.radius = std::max(b.radius, norm(solid.pose.p) + norm(solid.half) + solid.radius);
      b.solids.push_back(solid);
    }
    b.w = given.angular_velocity;
    b.v = add(given.velocity, cross(b.w, sub(b.com(), b.pose.p)));
    bodies_.push_back(std::move(b));
    return {};
  }
  Result<void> add_joint(const PhysicsJoint& given) {
    constexpr std::uint32_t kMasks[] = {kLoopRevolute, kLoopWeld & ~kLoopZ, kLoopWeld, kLoopPoint};
    const auto is_body = [&](std::int32_t b) { return b == -1 || exists(b); };
    if (!is_body(given.a) || !is_body(given.b) || given.a == given.b)
      return bad("it joins a body that does not exist", "Give two bodies, or -1 for the world.");
    if (given.type < 0 || given.type > 4) return bad("its type is unknown", "Give 0 to 4.");
    Joint j;
    j.given = given;
    j.fixed = given.type == 4 ? given.fixed : kMasks[given.type];
    if (given.follows >= 0 &&
        (!has_axis(j) || std::cmp_greater_equal(given.follows, joints_.size()) ||
         !has_axis(joints_[static_cast<std::size_t>(given.follows)])))
      return bad("it follows a joint that cannot be followed",
                 "Give an earlier revolute or prismatic one.");
    if (has_axis(j)) j.q = position(j, placed(j));
    joints_.push_back(j);
    ++given_joints_;
    return {};
  }

  // ---- rows ----

  [[nodiscard]] Row row(std::size_t a, std::size_t b, const Vec3& at, const Vec3& along) const {
    Row r;
    r.ends = {{b, along, cross(sub(at, com(b)), along)},
              {a, scale(along, -1), cross(along, sub(at, com(a)))}};
    return r;
  }
  [[nodiscard]] static Row turning(std::size_t a, std::size_t b, const Vec3& about) {
    Row r;
    r.ends = {{b, {}, about}, {a, {}, scale(about, -1)}};
    return r;
  }
  [[nodiscard]] Placed placed(const Joint& j) const {
    Placed p{compose(pose(j.given.a), j.given.in_a), compose(pose(j.given.b), j.given.in_b), {}};
    const std::size_t a = index(j.given.a), b = index(j.given.b);
    const Vec3 z = column(p.a, 2);
    p.axis = j.given.type == 0 ? turning(a, b, z) : row(a, b, p.b.p, z);
    return p;
  }
  /// The angle is that next to the last one.
  [[nodiscard]] static double position(const Joint& j, const Placed& p) {
    if (j.given.type == 1) return dot(column(p.a, 2), sub(p.b.p, p.a.p));
    const Vec3 x = column(p.b, 0);
    const double angle = std::atan2(dot(column(p.a, 1), x), dot(column(p.a, 0), x));
    return angle + 2 * kPi * std::round((j.q - angle) / (2 * kPi));
  }
  /// Small turn of b against a, axes of a: of what is fixed.
  [[nodiscard]] static Vec3 twist(const Placed& p, std::uint32_t fixed) {
    const Pose turn = compose(spatial::inverse(p.a), p.b);
    if ((fixed & 56) == 56) return rotation_log(turn.R);
    for (std::size_t k = 0; k < 3; ++k)  // one free axis: how far it is off itself
      if ((fixed & 56) == (56 & ~(8U << k)))
        return cross(Vec3{k == 0 ? 1.0 : 0, k == 1 ? 1.0 : 0, k == 2 ? 1.0 : 0}, column(turn, k));
    return {(turn.R[7] - turn.R[5]) / 2, (turn.R[2] - turn.R[6]) / 2, (turn.R[3] - turn.R[1]) / 2};
  }

  void add_joint_rows(std::size_t number, double dt, const std::vector<Moving>& before) {
    const Joint& j = joints_[number];
    const Placed p = placed(j);
    const std::size_t a = index(j.given.a), b = index(j.given.b);
    const double repair = settings_.repair / dt;
    const Vec3 off = sub(p.b.p, p.a.p), turn = twist(p, j.fixed);
    for (std::size_t k = 0; k < 6; ++k) {
      if (!(j.fixed & (1U << k))) continue;
      const Vec3 d = column(p.a, k % 3);
      Row r = k < 3 ? row(a, b, p.b.p, d) : turning(a, b, d);
      r.target = -repair * (k < 3 ? dot(d, off) : turn[k - 3]);
      rows_.push_back(std::move(r));
    }
    if (!has_axis(j)) return;
    const PhysicsJoint& g = j.given;
    const auto add_axis = [&](double sign, double target, double softness, double low, double high,
                              std::uint64_t kind) {
      Row r = p.axis;
      for (Row::End& e : r.ends)
        e.linear = scale(e.linear, sign), e.angular = scale(e.angular, sign);
      r.target = target, r.softness = softness, r.low = low, r.high = high;
      r.key = number << 4 | kind;
      rows_.push_back(std::move(r));
    };
    // Motor and damper give what they oppose: p = A (v0 - v), p = -b dt v.
    if (g.armature > 0)
      add_axis(1, p.axis.speed(before), 1 / g.armature, -kUnbounded, kUnbounded, 0);
    if (g.viscous > 0) add_axis(1, 0, 1 / (g.viscous * dt), -kUnbounded, kUnbounded, 0);
    if (g.coulomb > 0) add_axis(1, 0, 0, -g.coulomb * dt, g.coulomb * dt, 1);
    if (j.servo_force > 0)
      add_axis(1, j.servo_speed, 0, -j.servo_force * dt, j.servo_force * dt, 2);
    if (g.lower <= g.upper) {
      // Not more way than is left.
      const auto limit = [&](double left) { return left > 0 ? -left / dt : -repair * left; };
      add_axis(1, limit(j.q - g.lower), 0, 0, kUnbounded, 3);
      add_axis(-1, limit(g.upper - j.q), 0, 0, kUnbounded, 4);
    }
    if (g.follows >= 0) {
      const Joint& of = joints_[static_cast<std::size_t>(g.follows)];
      Row r = p.axis;
      for (Row::End e : placed(of).axis.ends) {
        e.linear = scale(e.linear, -g.ratio), e.angular = scale(e.angular, -g.ratio);
        r.ends.push_back(e);
      }
      r.target = -repair * (j.q - g.ratio * of.q - g.offset);
      rows_.push_back(std::move(r));
    }
  }

  [[nodiscard]] bool may_touch(std::size_t i, std::size_t k) const {
    const Body &a = bodies_[i], &b = bodies_[k];
    if (!a.is_movable() && !b.is_movable()) return false;
    if (a.given.group != 0 && a.given.group == b.given.group && !(a.given.self && b.given.self))
      return false;
    const std::pair pair{static_cast<std::int32_t>(i), static_cast<std::int32_t>(k)};
    if (ignored_.contains(pair)) return false;
    return std::none_of(joints_.begin(), joints_.end(), [&](const Joint& j) {
      return j.is_alive && std::min(j.given.a, j.given.b) == pair.first &&
             std::max(j.given.a, j.given.b) == pair.second;
    });
  }
  void add_contact_rows(double dt, const std::vector<Moving>& now) {
    constexpr double kMargin = 1e-3;
    std::vector<Touch> touches;
    for (std::size_t i = 0; i < bodies_.size(); ++i)
      for (std::size_t k = i + 1; k < bodies_.size(); ++k) {
        const Body &a = bodies_[i], &b = bodies_[k];
        const double speed = norm(sub(a.v, b.v)) + norm(a.w) * a.radius + norm(b.w) * b.radius;
        const double margin = kMargin + 2 * dt * speed;
        if (a.solids.empty() || b.solids.empty() ||
            norm(sub(a.pose.p, b.pose.p)) > a.radius + b.radius + margin || !may_touch(i, k))
          continue;
        touches.clear();
        for (std::size_t x = 0; x < a.solids.size(); ++x)
          for (std::size_t y = 0; y < b.solids.size(); ++y) {
            const std::size_t first = touches.size();
            Solid u = a.solids[x], v = b.solids[y];
            u.pose = compose(a.pose, u.pose), v.pose = compose(b.pose, v.pose);
            touch(u, v, margin, touches);
            for (std::size_t t = first; t < touches.size(); ++t)
              touches[t].corner += 32 * (x * b.solids.size() + y);
          }
        for (const Touch& t : touches) add_touch(i, k, t, dt, now);
      }
  }
  void add_touch(std::size_t i, std::size_t k, const Touch& t, double dt,
                 const std::vector<Moving>& now) {
    const PhysicsBody &a = bodies_[i].given, &b = bodies_[k].given;
    Row press = row(k, i, t.point, t.normal);  // of a against b
    press.low = 0;
    press.target = t.gap > 0 ? -t.gap / dt : -settings_.repair * t.gap / dt;
    const double approach = -press.speed(now), bounce = std::max(a.restitution, b.restitution);
    if (bounce > 0 && approach > 3 * dt * norm(gravity_) + 0.01) {
      if (t.gap > 0) return;  // it bounces when it has arrived
      press.target = std::max(press.target, bounce * approach);
    } else {
      press.yielding = kYielding;
    }
    press.key = ((static_cast<std::uint64_t>(i) << 20 | k) << 20 | t.corner) << 2 | 1ULL << 63;
    const std::uint64_t key = press.key;
    const auto unequal = static_cast<std::size_t>(
        std::count_if(rows_.begin(), rows_.end(), [](const Row& r) { return !r.is_equal(); }));
    touching_.push_back({unequal, i, k, t});
    rows_.push_back(std::move(press));
    const Vec3 u =
        unit(cross(t.normal, std::fabs(t.normal[0]) < 0.7 ? Vec3{1, 0, 0} : Vec3{0, 1, 0}));
    const double friction = std::sqrt(a.friction * b.friction);
    if (friction == 0) return;
    for (const std::uint64_t k_th : {1U, 2U}) {
      Row r = row(k, i, t.point, k_th == 1 ? u : cross(t.normal, u));
      r.normal = unequal, r.friction = friction;
      r.key = key | k_th;
      rows_.push_back(std::move(r));
    }
  }

  // ---- a step ----

  [[nodiscard]] std::vector<Moving> moving() const {
    std::vector<Moving> all(bodies_.size() + 1);
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      const Body& b = bodies_[i];
      all[i].v = b.v, all[i].w = b.w;
      if (!b.is_movable()) continue;
      all[i].inverse_mass = 1 / b.given.mass.mass;
      all[i].inverse_inertia = inverse(rotate(b.pose, b.given.mass.inertia));
    }
    return all;
  }

  Result<void> one_step(double dt, std::span<const double> forces) {
    const std::vector<Moving> before = moving();
    std::vector<Moving> now = before;
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      if (!bodies_[i].is_movable()) continue;
      now[i].v =
          add(now[i].v, scale(add(gravity_, scale(bodies_[i].force, now[i].inverse_mass)), dt));
      now[i].w = add(now[i].w, scale(multiply(now[i].inverse_inertia, bodies_[i].torque), dt));
    }
    for (std::size_t j = 0; j < forces.size(); ++j)
      if (has_axis(joints_[j]) && forces[j] != 0) placed(joints_[j]).axis.push(now, dt * forces[j]);
    rows_.clear();
    touching_.clear();
    for (std::size_t j = 0; j < joints_.size(); ++j)
      if (joints_[j].is_alive) add_joint_rows(j, dt, before);
    add_contact_rows(dt, now);
    for (Row& r : rows_)  // contacts begin with the impulses of the step before
      if (const auto known = impulses_.find(r.key); known != impulses_.end())
        r.impulse = known->second;
    const Solve solve(rows_, now, settings_.sweeps);
    impulses_.clear();
    for (const Row& r : rows_)
      if (r.key != 0) impulses_[r.key] = r.impulse;
    report(dt);
    return advance(dt, now);
  }

  void report(double dt) {
    const auto equal = static_cast<std::size_t>(
        std::count_if(rows_.begin(), rows_.end(), [](const Row& r) { return r.is_equal(); }));
    contacts_.clear();
    for (const Touching& t : touching_) {
      const std::size_t at = equal + t.row;
      Vec3 force = scale(t.touch.normal, rows_[at].impulse / dt);
      for (std::size_t k = 1; k <= 2 && at + k < rows_.size(); ++k) {
        const Row& r = rows_[at + k];
        if (r.friction > 0 && r.normal == t.row)
          force = add(force, scale(r.ends[0].linear, r.impulse / dt));
      }
      if (rows_[at].impulse > 0)
        contacts_.push_back({static_cast<std::int32_t>(t.a), static_cast<std::int32_t>(t.b),
                             t.touch.point, t.touch.normal, std::max(0.0, -t.touch.gap), force});
    }
  }

  Result<void> advance(double dt, const std::vector<Moving>& now) {
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      Body& b = bodies_[i];
      if (!b.is_movable()) continue;
      const Vec3 momentum = multiply(rotate(b.pose, b.given.mass.inertia), now[i].w);
      const Vec3 com = add(b.com(), scale(now[i].v, dt));
      Pose turn;
      turn.R = rotation_exp(scale(now[i].w, dt));
      b.pose.R = from_quaternion(to_quaternion(compose(turn, b.pose).R));  // stays a rotation
      b.pose.p = sub(com, rotate(b.pose, b.given.mass.com));
      b.v = now[i].v;
      // What turns freely keeps its angular momentum, not its angular velocity.
      b.w = multiply(inverse(rotate(b.pose, b.given.mass.inertia)), momentum);
      if (!is_finite(b.pose.p) || !is_finite(b.w))
        return bad("it diverged to infinity", "Use a shorter step, or softer forces.",
                   numbered("body ", i));
    }
    for (Joint& j : joints_)
      if (has_axis(j)) j.q = position(j, placed(j));
    return {};
  }

  struct Touching {
    std::size_t row, a, b;
    Touch touch;
  };
  std::vector<Body> bodies_;
  std::vector<Joint> joints_;  ///< those given, then what attach() ties
  std::size_t given_joints_ = 0;
  std::set<std::pair<std::int32_t, std::int32_t>> ignored_;
  Vec3 gravity_{};
  Settings settings_;
  std::vector<Row> rows_;
  std::vector<Touching> touching_;
  std::map<std::uint64_t, double> impulses_;
  std::vector<PhysicsContact> contacts_;
};

const rmp_param kParams[] = {
    {"sweeps", "int", "", "Greatest number of sweeps over contacts and limits in a step.", "200",
     nullptr, 1, 100000},
    {"repair", "real", "", "Share of a drift or of a penetration that a step corrects.", "0.2",
     nullptr, 0, 1},
    {"around", "bool", "", "Whether other shapes are replaced by the boxes around them.", "false",
     nullptr, 1, 0},
};

class SequentialImpulses final : public PhysicsEngine {
 public:
  Result<std::unique_ptr<PhysicsWorld>> create(std::span<const PhysicsBody> bodies,
                                               std::span<const PhysicsJoint> joints, Vec3 gravity,
                                               const Params& p) const override {
    RMP_TRY_ASSIGN(auto world, World::make(bodies, joints, gravity,
                                           {static_cast<int>(p.integer("sweeps")), p.real("repair"),
                                            p.boolean("around")}));
    return std::unique_ptr<PhysicsWorld>(std::move(world));
  }
};

}  // namespace

RMP_PLUGIN("org.example.sequential_impulses", "0.1.0", "Apache-2.0",
           "A physics engine as an example.",
           RMP_PROVIDER(SequentialImpulses, "sequential_impulses",
                        "Balls and boxes, joints, contact with friction, by impulses.",
                        "contact,friction,partial", kParams))
