// SPDX-License-Identifier: Apache-2.0
// Physics written in Lua (layer: application, lua).
#include <algorithm>
#include <cmath>
#include <numbers>

#include <robomosp/sdk/physics.h>

#include "kernel/text.h"
#include "lua/provide.h"
#include "spatial/pose.h"
#include "spatial/vec.h"

namespace robomosp::lua {
namespace {

std::size_t place_of(std::int32_t i) { return static_cast<std::size_t>(i); }

/// The world as the script has it is one table; what the host knows of it is read after each step.
class LuaWorld final : public PhysicsWorld {
 public:
  LuaWorld(ProviderPtr p, std::span<const PhysicsBody> bodies, std::span<const PhysicsJoint> joints,
           const Params& params)
      : p_(std::move(p)),
        params_(p_->schema, params),
        bodies_(bodies.begin(), bodies.end()),
        joints_(joints.begin(), joints.end()),
        world_(p_),
        joint_q_(joints.size()),
        joint_qd_(joints.size()) {}

  Result<void> create(Vec3 gravity) {
    Call call_script(*p_);
    const auto created = call_script.run([&](Impl& impl, lua_State* L) -> Result<void> {
      lua_createtable(L, 0, 3);
      set_vector(impl, L, "gravity", gravity, "m/s^2");
      lua_createtable(L, static_cast<int>(bodies_.size()), 0);
      for (std::size_t i = 0; i < bodies_.size(); ++i) {
        push_body(impl, L, bodies_[i]);
        lua_rawseti(L, -2, static_cast<lua_Integer>(i + 1));
      }
      lua_setfield(L, -2, "bodies");
      lua_createtable(L, static_cast<int>(joints_.size()), 0);
      for (std::size_t i = 0; i < joints_.size(); ++i) {
        push_joint(impl, L, joints_[i]);
        lua_rawseti(L, -2, static_cast<lua_Integer>(i + 1));
      }
      lua_setfield(L, -2, "joints");
      lua_pushvalue(L, 1);
      world_.keep(L);
      measure_joints();
      report_joints(L);
      if (!call_script.push_optional(L, "create")) return {};
      lua_pushvalue(L, 1);
      push_params(impl, L, p_->schema, params_.get());
      RMP_TRY(call(impl, L, 2, 2));
      return check_refusal(*p_, L, "world");
    });
    for (PhysicsBody& b : bodies_) b.shape.shapes.clear();  // their meshes may go now
    return created;
  }

  Result<void> step(double dt, std::int32_t steps, std::span<const double> forces,
                    Progress& progress) override {
    if (!(dt > 0) || (!forces.empty() && forces.size() != joints_.size()))
      return error(ErrorCode::invalid_argument, "the step is not a time, or forces are missing",
                   "Give one force per joint.");
    const std::vector<double> none(joints_.size(), 0.0);
    Call call_script(*p_);
    return call_script.run([&](Impl& impl, lua_State* L) -> Result<void> {
      world_.push(L);
      push_params(impl, L, p_->schema, params_.get());
      for (std::int32_t i = 0; i < steps; ++i) {
        if (progress.cancelled()) return error(ErrorCode::cancelled, "physics was cancelled");
        lua_settop(L, 2);
        call_script.push_function(L, "step");
        lua_pushvalue(L, 1);
        lua_pushnumber(L, dt);
        push_vector(impl, L, forces.empty() ? std::span<const double>(none) : forces);
        lua_pushvalue(L, 2);
        RMP_TRY(call(impl, L, 4, 1));
        RMP_TRY(read_contacts(L, 3));
        RMP_TRY(read_bodies(L));
        measure_joints();
        lua_settop(L, 2);
        lua_pushvalue(L, 1);
        report_joints(L);
      }
      return {};
    });
  }

  Result<void> read(const PhysicsState& out) const override {
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      if (i < out.poses.size()) out.poses[i] = bodies_[i].pose;
      if (i < out.velocities.size()) out.velocities[i] = bodies_[i].velocity;
      if (i < out.angular_velocities.size())
        out.angular_velocities[i] = bodies_[i].angular_velocity;
    }
    std::copy_n(joint_q_.begin(), std::min(joint_q_.size(), out.joint_positions.size()),
                out.joint_positions.begin());
    std::copy_n(joint_qd_.begin(), std::min(joint_qd_.size(), out.joint_velocities.size()),
                out.joint_velocities.begin());
    return {};
  }

  void contacts(std::vector<PhysicsContact>& out) const override { out = contacts_; }

  Result<std::int32_t> attach(std::int32_t a, std::int32_t b) override {
    const auto number = next_attachment_;
    RMP_TRY_ASSIGN(const bool told, tell("attach", [&](Impl&, lua_State* L) {
                     for (const std::int32_t n : {number, a + 1, b + 1}) lua_pushinteger(L, n);
                   }));
    if (!told) return lacks("attach", "holds nothing");
    ++next_attachment_;
    return number;
  }
  Result<void> release(std::int32_t attachment) override {
    RMP_TRY_ASSIGN(const bool told,
                   tell("release", [&](Impl&, lua_State* L) { lua_pushinteger(L, attachment); }));
    if (!told) return lacks("release", "does not support releasing");
    return {};
  }
  Result<void> servo(std::int32_t joint, double velocity, double force) override {
    if (joint < 0 || place_of(joint) >= joints_.size() || !(force >= 0) || !std::isfinite(velocity))
      return error(ErrorCode::invalid_argument,
                   "this joint does not exist, or its force is negative",
                   "Give a joint, a velocity and a force.", "joint " + std::to_string(joint + 1));
    RMP_TRY_ASSIGN(const bool told, tell("servo", [&](Impl&, lua_State* L) {
                     lua_pushinteger(L, joint + 1);
                     lua_pushnumber(L, velocity);
                     lua_pushnumber(L, force);
                   }));
    return told ? Result<void>() : PhysicsWorld::servo(joint, velocity, force);
  }
  Result<void> push(std::int32_t body, Vec3 force, Vec3 torque) override {
    RMP_TRY_ASSIGN(const bool told, tell("push", [&](Impl& impl, lua_State* L) {
                     lua_pushinteger(L, body + 1);
                     push_vector(impl, L, force, "N");
                     push_vector(impl, L, torque, "N m");
                   }));
    return told ? Result<void>() : PhysicsWorld::push(body, force, torque);
  }
  Result<void> ignore(std::int32_t a, std::int32_t b) override {
    RMP_TRY_ASSIGN(const bool told, tell("ignore", [&](Impl&, lua_State* L) {
                     for (const std::int32_t n : {a + 1, b + 1}) lua_pushinteger(L, n);
                   }));
    return told ? Result<void>() : PhysicsWorld::ignore(a, b);
  }

  Result<void> move(std::int32_t body, const Pose& pose, Vec3 velocity,
                    Vec3 angular_velocity) override {
    if (body < 0 || place_of(body) >= bodies_.size() || bodies_[place_of(body)].mass.mass > 0)
      return error(ErrorCode::invalid_argument, "this body does not exist or is not fixed",
                   "Move only bodies without mass.", "body " + std::to_string(body + 1));
    PhysicsBody& b = bodies_[place_of(body)];
    b.pose = pose, b.velocity = velocity, b.angular_velocity = angular_velocity;
    Call call_script(*p_);
    return call_script.run([&](Impl& impl, lua_State* L) -> Result<void> {
      world_.push(L);
      lua_getfield(L, 1, "bodies");
      lua_geti(L, -1, body + 1);
      set_motion(impl, L, b);
      return {};
    });
  }

 private:
  static void set_motion(Impl& impl, lua_State* L, const PhysicsBody& b) {
    set_pose(impl, L, "pose", b.pose);
    set_vector(impl, L, "velocity", b.velocity, "m/s");
    set_vector(impl, L, "angular_velocity", b.angular_velocity, "rad/s");
  }
  static void push_body(Impl& impl, lua_State* L, const PhysicsBody& b) {
    lua_createtable(L, 0, 12);
    push_shapes(impl, L, b.shape);
    lua_setfield(L, -2, "shapes");
    set_number(L, "mass", b.mass.mass);
    set_vector(impl, L, "com", b.mass.com, "m");
    set_inertia(impl, L, b.mass.inertia);
    set_motion(impl, L, b);
    set_number(L, "friction", b.friction);
    set_number(L, "restitution", b.restitution);
    lua_pushinteger(L, b.group);
    lua_setfield(L, -2, "group");
    lua_pushboolean(L, b.self ? 1 : 0);
    lua_setfield(L, -2, "self");
  }
  static void push_joint(Impl& impl, lua_State* L, const PhysicsJoint& j) {
    static constexpr const char* kTypes[] = {"revolute", "prismatic", "fixed", "ball", "loop"};
    lua_createtable(L, 0, 12);
    lua_pushinteger(L, j.a + 1);
    lua_setfield(L, -2, "a");
    lua_pushinteger(L, j.b + 1);
    lua_setfield(L, -2, "b");
    set_text(L, "type", kTypes[std::clamp(j.type, 0, 4)]);
    set_pose(impl, L, "in_a", j.in_a);
    set_pose(impl, L, "in_b", j.in_b);
    const bool is_limited = j.lower <= j.upper;
    set_number(L, "lower", is_limited ? j.lower : -HUGE_VAL);
    set_number(L, "upper", is_limited ? j.upper : HUGE_VAL);
    set_number(L, "viscous", j.viscous);
    set_number(L, "coulomb", j.coulomb);
    set_number(L, "armature", j.armature);
    if (j.type == 4) set_directions(L, "fixed", j.fixed);
    if (j.follows < 0) return;
    lua_pushinteger(L, j.follows + 1);
    lua_setfield(L, -2, "follows");
    set_number(L, "ratio", j.ratio);
    set_number(L, "offset", j.offset);
  }

  /// Calls an optional function of (world, what `push_rest` pushes), which may refuse; false =
  /// there is none.
  template <class Push>
  Result<bool> tell(const char* function, const Push& push_rest) {
    bool told = false;
    Call call_script(*p_);
    const auto ran = call_script.run([&](Impl& impl, lua_State* L) -> Result<void> {
      if (!call_script.push_optional(L, function)) return {};
      told = true;
      world_.push(L);
      push_rest(impl, L);
      RMP_TRY(call(impl, L, lua_gettop(L) - 1, 2));
      return check_refusal(*p_, L, function);
    });
    if (!ran.ok()) return ran.error();
    return told;
  }
  [[nodiscard]] Error lacks(const char* function, const char* lack) const {
    return error(
        ErrorCode::unsupported,
        "provider " + text::quote(p_->name) + " " + lack + ": it has no function " + function,
        "Give it one, or choose another provider.");
  }

  Result<void> read_bodies(lua_State* L) {
    lua_getfield(L, 1, "bodies");
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      PhysicsBody& b = bodies_[i];
      if (!(b.mass.mass > 0)) continue;  // they stay where the host has put them
      const std::string of = " of body " + std::to_string(i + 1);
      if (lua_istable(L, -1)) lua_geti(L, -1, static_cast<lua_Integer>(i + 1));
      if (!lua_istable(L, -1))
        return failed(*p_, "the script has taken body " + std::to_string(i + 1) + " away",
                      "Keep the table world.bodies.");
      lua_getfield(L, -1, "pose");
      RMP_TRY_ASSIGN(b.pose, read_pose(*p_, L, lua_gettop(L), ("the pose" + of).c_str()));
      lua_getfield(L, -2, "velocity");
      RMP_TRY_ASSIGN(b.velocity, read_vec3(*p_, L, lua_gettop(L), ("the velocity" + of).c_str()));
      lua_getfield(L, -3, "angular_velocity");
      RMP_TRY_ASSIGN(b.angular_velocity,
                     read_vec3(*p_, L, lua_gettop(L), ("the angular velocity" + of).c_str()));
      lua_pop(L, 4);
    }
    return {};
  }

  Result<void> read_contacts(lua_State* L, int index) {
    contacts_.clear();
    if (lua_isnil(L, index)) return {};
    constexpr const char* kHint =
        "Return {{a = 1, b = 2, point = {...}, normal = {...}, depth = 0, force = {...}}}.";
    if (!lua_istable(L, index))
      return failed(*p_, std::string("the contacts are a ") + luaL_typename(L, index), kHint);
    const auto count = static_cast<lua_Integer>(luaL_len(L, index));
    for (lua_Integer i = 1; i <= count; ++i) {
      lua_settop(L, index);
      const std::string which = "contact " + std::to_string(i);
      if (lua_geti(L, index, i) != LUA_TTABLE) return failed(*p_, which + " is not a table", kHint);
      const int row = lua_gettop(L);
      PhysicsContact c;
      for (const auto& [field, body] : {std::pair("a", &c.a), std::pair("b", &c.b)}) {
        lua_getfield(L, row, field);
        const lua_Integer n = lua_isinteger(L, -1) ? lua_tointeger(L, -1) : 0;
        if (n < 1 || n > static_cast<lua_Integer>(bodies_.size()))
          return failed(*p_,
                        which + " has no body " + field + ", a number from 1 to " +
                            std::to_string(bodies_.size()),
                        kHint);
        *body = static_cast<std::int32_t>(n - 1);
      }
      for (const auto& [field, v] : {std::pair("point", &c.point), std::pair("normal", &c.normal),
                                     std::pair("force", &c.force)}) {
        lua_getfield(L, row, field);
        RMP_TRY_ASSIGN(*v, read_vec3(*p_, L, lua_gettop(L),
                                     ("the " + std::string(field) + " of " + which).c_str()));
      }
      lua_getfield(L, row, "depth");
      c.depth = lua_type(L, -1) == LUA_TNUMBER ? lua_tonumber(L, -1) : std::nan("");
      if (!(c.depth >= 0) || !std::isfinite(c.depth))
        return failed(*p_, which + " has no depth (a number of 0 or more)", kHint);
      if (c.a == c.b || std::fabs(spatial::norm(c.normal) - 1) > 1e-6)
        return failed(*p_, which + " involves one body only, or its normal is not of length 1",
                      kHint);
      contacts_.push_back(c);
    }
    return {};
  }

  /// Joints follow from the bodies: positions a_T_b of the joint frames, whole turns counted.
  void measure_joints() {
    using namespace spatial;
    const PhysicsBody world;
    for (std::size_t i = 0; i < joints_.size(); ++i) {
      const PhysicsJoint& j = joints_[i];
      const PhysicsBody &a = j.a < 0 ? world : bodies_[place_of(j.a)],
                        &b = j.b < 0 ? world : bodies_[place_of(j.b)];
      const Pose in_a = compose(a.pose, j.in_a), in_b = compose(b.pose, j.in_b);
      const Pose between = compose(inverse(in_a), in_b);
      const Vec3 z = axis(in_a, 2), turn = sub(b.angular_velocity, a.angular_velocity);
      if (j.type == 0) {
        constexpr double kTurn = 2 * std::numbers::pi;
        const double angle = std::atan2(between.R[3], between.R[0]);
        joint_q_[i] = angle + kTurn * std::round((joint_q_[i] - angle) / kTurn);
        joint_qd_[i] = dot(z, turn);
      } else if (j.type == 1) {
        // The point of either body that is at b's joint frame now.
        const Vec3 of_b = add(b.velocity, cross(b.angular_velocity, sub(in_b.p, b.pose.p))),
                   of_a = add(a.velocity, cross(a.angular_velocity, sub(in_b.p, a.pose.p)));
        joint_q_[i] = between.p[2];
        joint_qd_[i] = dot(z, sub(of_b, of_a));
      }
    }
  }
  /// Fields position and velocity of world.joints; the world is on top.
  void report_joints(lua_State* L) const {
    lua_getfield(L, -1, "joints");
    for (std::size_t i = 0; lua_istable(L, -1) && i < joints_.size(); ++i) {
      lua_geti(L, -1, static_cast<lua_Integer>(i + 1));
      if (lua_istable(L, -1)) {
        set_number(L, "position", joint_q_[i]);
        set_number(L, "velocity", joint_qd_[i]);
      }
      lua_pop(L, 1);
    }
    lua_pop(L, 1);
  }

  ProviderPtr p_;
  Kept params_;
  std::vector<PhysicsBody> bodies_;
  std::vector<PhysicsJoint> joints_;
  KeptValue world_;
  std::vector<double> joint_q_, joint_qd_;
  std::vector<PhysicsContact> contacts_;
  std::int32_t next_attachment_ = 1;
};

/// fn(world, dt, forces, params) -> list of contacts, which moves world.bodies; or {step = fn,
/// create = fn(world, params), attach = fn(world, number, a, b), release = fn(world, number),
/// servo = fn(world, joint, velocity, force), push = fn(world, body, force, torque),
/// ignore = fn(world, a, b)}.
class LuaPhysics final : public PhysicsEngine {
 public:
  explicit LuaPhysics(ProviderPtr p) : p_(std::move(p)) {}
  Result<std::unique_ptr<PhysicsWorld>> create(std::span<const PhysicsBody> bodies,
                                               std::span<const PhysicsJoint> joints, Vec3 gravity,
                                               const Params& params) const override {
    auto world = std::make_unique<LuaWorld>(p_, bodies, joints, params);
    RMP_TRY(world->create(gravity));
    return std::unique_ptr<PhysicsWorld>(std::move(world));
  }

 private:
  ProviderPtr p_;
};

}  // namespace

RMP_LUA_PROVIDER(PhysicsEngine, LuaPhysics, "step");

}  // namespace robomosp::lua
