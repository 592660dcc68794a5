// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "kernel/text.h"
#include "lua/provide.h"

namespace robomosp::lua {

Error failed(const LuaProvider& p, std::string message, std::string hint) {
  return error(ErrorCode::plugin_failed, std::move(message), std::move(hint),
               p.interface_id + " " + text::quote(p.name));
}

void push_vector(Impl& impl, lua_State* L, std::span<const double> v, const char* unit) {
  push_array(impl, L, NumericArray(std::vector<double>(v.begin(), v.end()), unit));
}

void set_number(lua_State* L, const char* name, double v) {
  lua_pushnumber(L, v);
  lua_setfield(L, -2, name);
}

void set_vector(Impl& impl, lua_State* L, const char* name, std::span<const double> v,
                const char* unit) {
  push_vector(impl, L, v, unit);
  lua_setfield(L, -2, name);
}

void set_pose(Impl& impl, lua_State* L, const char* name, const Pose& pose) {
  push(impl, L, pose_value(pose));
  lua_setfield(L, -2, name);
}

void set_text(lua_State* L, const char* name, std::string_view text) {
  lua_pushlstring(L, text.data(), text.size());
  lua_setfield(L, -2, name);
}

void set_inertia(Impl& impl, lua_State* L, const Sym3& s) {
  push_array(impl, L,
             NumericArray({s.xx, s.xy, s.xz, s.xy, s.yy, s.yz, s.xz, s.yz, s.zz}, 3, 3, "kg m^2"));
  lua_setfield(L, -2, "inertia");
}

void set_directions(lua_State* L, const char* name, std::uint32_t bits) {
  lua_createtable(L, 6, 0);
  lua_Integer count = 0;
  for (int d = 0; d < 6; ++d) {
    if (!(bits & (1U << d))) continue;
    lua_pushinteger(L, d + 1);
    lua_rawseti(L, -2, ++count);
  }
  lua_setfield(L, -2, name);
}

namespace {

void set_index(lua_State* L, const char* name, std::int32_t from_zero) {
  lua_pushinteger(L, from_zero + 1);  // Lua counts from 1: 0 = base, world or none
  lua_setfield(L, -2, name);
}

const char* type_word(JointType type) {
  switch (type) {
    case JointType::revolute: break;
    case JointType::prismatic: return "prismatic";
    case JointType::spherical: return "spherical";
    case JointType::free: return "free";
  }
  return "revolute";
}

void push_joint(Impl& impl, lua_State* L, const JointModel& j) {
  lua_createtable(L, 0, 24);
  set_text(L, "name", j.name);
  set_text(L, "type", type_word(j.type));
  set_index(L, "parent", j.parent);
  set_index(L, "q_index", j.q_index);
  set_index(L, "v_index", j.v_index);
  set_pose(impl, L, "placement", j.placement);
  set_pose(impl, L, "link", j.link);
  set_number(L, "lower", j.lower);
  set_number(L, "upper", j.upper);
  set_number(L, "max_velocity", j.max_velocity);
  set_number(L, "max_acceleration", j.max_acceleration);
  set_number(L, "max_jerk", j.max_jerk);
  set_number(L, "max_force", j.max_force);
  set_number(L, "mass", j.body.mass);
  set_vector(impl, L, "com", j.body.com, "m");
  set_inertia(impl, L, j.body.inertia);
  set_number(L, "armature", j.armature);
  lua_pushboolean(L, j.passive ? 1 : 0);
  lua_setfield(L, -2, "passive");
  lua_createtable(L, 0, 3);
  set_number(L, "viscous", j.friction.viscous);
  set_number(L, "coulomb_positive", j.friction.coulomb_positive);
  set_number(L, "coulomb_negative", j.friction.coulomb_negative);
  lua_setfield(L, -2, "friction");
  lua_createtable(L, 0, 2);
  set_number(L, "stiffness", j.spring.stiffness);
  set_number(L, "rest", j.spring.rest);
  lua_setfield(L, -2, "spring");
  if (!j.is_coupled()) return;
  lua_createtable(L, 0, 3);
  set_index(L, "of", j.coupling.of);
  set_number(L, "ratio", j.coupling.ratio);
  set_number(L, "offset", j.coupling.offset);
  lua_setfield(L, -2, "coupling");
}

void push_loop(Impl& impl, lua_State* L, const LoopModel& l) {
  lua_createtable(L, 0, 6);
  set_text(L, "name", l.name);
  set_index(L, "joint_a", l.joint_a);
  set_index(L, "joint_b", l.joint_b);
  set_pose(impl, L, "in_a", l.in_a);
  set_pose(impl, L, "in_b", l.in_b);
  set_directions(L, "fixed", l.fixed);
}

template <class List, class Push>
void set_list(lua_State* L, const char* name, const List& list, const Push& push_one) {
  lua_createtable(L, static_cast<int>(list.size()), 0);
  for (std::size_t i = 0; i < list.size(); ++i) {
    push_one(list[i]);
    lua_rawseti(L, -2, static_cast<lua_Integer>(i + 1));
  }
  lua_setfield(L, -2, name);
}

}  // namespace

Result<void> check_simple(const LuaProvider& p, const RobotModel& model) {
  if (!p.has_tag("simple") || (model.is_simple() && model.loops.empty())) return {};
  return error(ErrorCode::unsupported,
               "provider " + text::quote(p.name) +
                   " supports robots with one coordinate per joint, without followers and loops",
               "Choose another provider for it.", "robot " + text::quote(model.name));
}

Result<void> check_refusal(const LuaProvider& p, lua_State* L, std::string where) {
  if (!lua_isnil(L, -2) || lua_type(L, -1) != LUA_TSTRING) return {};
  return error(ErrorCode::unsupported,
               "provider " + text::quote(p.name) + " refuses: " + lua_tostring(L, -1),
               "Choose another provider for it.", std::move(where));
}

void push_model(Impl& impl, lua_State* L, const RobotModel& model, bool with_gravity) {
  lua_createtable(L, 0, 8);
  set_text(L, "name", model.name);
  lua_pushinteger(L, static_cast<lua_Integer>(model.dof()));
  lua_setfield(L, -2, "dof");
  lua_pushinteger(L, static_cast<lua_Integer>(model.coordinate_count()));
  lua_setfield(L, -2, "coordinates");
  set_pose(impl, L, "base", model.base);
  set_vector(impl, L, "gravity", with_gravity ? model.gravity : Vec3{}, "m/s^2");
  set_list(L, "joints", model.joints, [&](const JointModel& j) { push_joint(impl, L, j); });
  set_list(L, "tips", model.tips, [&](const TipModel& t) {
    lua_createtable(L, 0, 3);
    set_text(L, "name", t.name);
    set_index(L, "joint", t.joint);
    set_pose(impl, L, "tool", t.tool);
  });
  set_list(L, "loops", model.loops, [&](const LoopModel& l) { push_loop(impl, L, l); });
}

void push_shapes(Impl& impl, lua_State* L, const ShapedBody& body) {
  static constexpr struct {
    const char* word;
    std::size_t sizes;
  } kKinds[] = {{"mesh", 0},    {"box", 3},    {"sphere", 1}, {"cylinder", 2},
                {"capsule", 2}, {"convex", 0}, {"cone", 3},   {"ellipsoid", 3}};
  lua_createtable(L, static_cast<int>(body.shapes.size()), 0);
  lua_Integer count = 0;
  for (const Shape& s : body.shapes) {
    const auto& kind = kKinds[static_cast<std::size_t>(s.kind)];
    lua_createtable(L, 0, 4);
    set_text(L, "kind", kind.word);
    set_vector(impl, L, "sizes", std::span(s.sizes).first(kind.sizes), "m");
    set_pose(impl, L, "pose", s.pose);
    if (s.mesh) {
      const auto& v = s.mesh->positions;
      push_array(impl, L, NumericArray({v.begin(), v.end()}, v.size() / 3, 3, "m"));
      lua_setfield(L, -2, "vertices");
      std::vector<double> corners(s.mesh->triangles.begin(), s.mesh->triangles.end());
      for (double& c : corners) c += 1;
      push_array(impl, L, NumericArray(std::move(corners), s.mesh->triangle_count(), 3));
      lua_setfield(L, -2, "triangles");
    }
    lua_rawseti(L, -2, ++count);
  }
}

void push_params(Impl& impl, lua_State* L, const Schema& schema, const Params& params) {
  lua_createtable(L, 0, static_cast<int>(schema.size()));
  for (const ParamSpec& s : schema) {
    if (!params.has(s.name)) continue;
    const std::string_view type = plain_type(s.type);
    if (type == "bool") lua_pushboolean(L, params.boolean(s.name) ? 1 : 0);
    else if (type == "int") lua_pushinteger(L, params.integer(s.name));
    else if (type == "real") lua_pushnumber(L, params.real(s.name));
    else if (type == "real[]" || type == "vec3")
      push_vector(impl, L, params.reals(s.name), s.unit.c_str());
    else if (type == "pose") push(impl, L, pose_value(params.pose(s.name)));
    else {
      const std::string_view t = params.text(s.name);
      lua_pushlstring(L, t.data(), t.size());
    }
    lua_setfield(L, -2, s.name.c_str());
  }
}

Result<std::vector<double>> read_finite(const LuaProvider& p, lua_State* L, int index,
                                        std::size_t count, const char* what) {
  auto numbers = to_reals(L, index, what);
  if (!numbers.ok())
    return failed(p, std::move(numbers).error().message, "Return a list of numbers.");
  if (numbers->size() != count)
    return failed(p,
                  std::string(what) + " has " + std::to_string(numbers->size()) + " numbers; " +
                      std::to_string(count) + " are needed",
                  "Return that many numbers.");
  for (std::size_t i = 0; i < count; ++i)
    if (!std::isfinite((*numbers)[i]))
      return failed(p,
                    std::string(what) + " has an entry [" + std::to_string(i + 1) + "] that is " +
                        text::print((*numbers)[i]),
                    "Return finite numbers.");
  return std::move(*numbers);
}

Result<Vec3> read_vec3(const LuaProvider& p, lua_State* L, int index, const char* what) {
  RMP_TRY_ASSIGN(const auto v, read_finite(p, L, index, 3, what));
  return Vec3{v[0], v[1], v[2]};
}

Result<Pose> read_pose(const LuaProvider& p, lua_State* L, int index, const char* what) {
  ParamSpec spec;
  spec.name = what;
  spec.type = "pose";
  RMP_TRY_ASSIGN(const Value given, to_value(L, index));
  auto checked = check_value(spec, given, what);
  if (!checked.ok())
    return failed(p, std::move(checked).error().sentence(),
                  "Return a pose such as pose(0.1, 0, 0.2).");
  return *pose_from(*checked);
}

void push_poses(Impl& impl, lua_State* L, std::span<const Pose> poses) {
  lua_createtable(L, static_cast<int>(poses.size()), 0);
  const int list = lua_gettop(L);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    push(impl, L, pose_value(poses[i]));
    lua_rawseti(L, list, static_cast<lua_Integer>(i + 1));
  }
}

Result<double> read_duration(Call& call_script, Impl& impl, lua_State* L, const LuaProvider& p,
                             int first, int second) {
  call_script.push_function(L, "duration");
  if (lua_isfunction(L, -1)) {
    lua_pushvalue(L, first);
    lua_pushvalue(L, second);
    RMP_TRY(call(impl, L, 2, 1));
  }
  const double duration =
      lua_type(L, -1) == LUA_TNUMBER ? static_cast<double>(lua_tonumber(L, -1)) : 0.0;
  if (duration > 0 && std::isfinite(duration)) return duration;
  return failed(p, "the duration is not a number above 0 [s]",
                "Return the duration when t is nil, or give duration = seconds.");
}

}  // namespace robomosp::lua
