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

/// Scripts count joints and coordinates alike.
Result<void> need_simple(const RobotModel& model) {
  if (model.is_simple() && model.loops.empty()) return {};
  return error(ErrorCode::unsupported,
               "solvers written in Lua serve robots whose joints have one coordinate each, without "
               "followers and loops",
               "Choose another provider for it.", "robot " + text::quote(model.name));
}

void push_model(Impl& impl, lua_State* L, const RobotModel& model, bool with_gravity) {
  lua_createtable(L, 0, 6);
  lua_pushstring(L, model.name.c_str());
  lua_setfield(L, -2, "name");
  lua_pushinteger(L, static_cast<lua_Integer>(model.dof()));
  lua_setfield(L, -2, "dof");
  push(impl, L, pose_value(model.base));
  lua_setfield(L, -2, "base");
  const Vec3 gravity = with_gravity ? model.gravity : Vec3{};
  push_vector(impl, L, gravity, "m/s^2");
  lua_setfield(L, -2, "gravity");
  lua_createtable(L, static_cast<int>(model.joints.size()), 0);
  for (std::size_t i = 0; i < model.joints.size(); ++i) {
    const JointModel& j = model.joints[i];
    lua_createtable(L, 0, 14);
    lua_pushstring(L, j.name.c_str());
    lua_setfield(L, -2, "name");
    lua_pushstring(L, j.type == JointType::revolute ? "revolute" : "prismatic");
    lua_setfield(L, -2, "type");
    lua_pushinteger(L, j.parent + 1);  // 0 = base; Lua counts joints from 1
    lua_setfield(L, -2, "parent");
    push(impl, L, pose_value(j.placement));
    lua_setfield(L, -2, "placement");
    set_number(L, "lower", j.lower);
    set_number(L, "upper", j.upper);
    set_number(L, "max_velocity", j.max_velocity);
    set_number(L, "max_acceleration", j.max_acceleration);
    set_number(L, "max_force", j.max_force);
    set_number(L, "mass", j.body.mass);
    push_vector(impl, L, j.body.com, "m");
    lua_setfield(L, -2, "com");
    const Sym3& s = j.body.inertia;
    push_array(
        impl, L,
        NumericArray({s.xx, s.xy, s.xz, s.xy, s.yy, s.yz, s.xz, s.yz, s.zz}, 3, 3, "kg m^2"));
    lua_setfield(L, -2, "inertia");
    set_number(L, "armature", j.armature);
    lua_rawseti(L, -2, static_cast<lua_Integer>(i + 1));
  }
  lua_setfield(L, -2, "joints");
  lua_createtable(L, static_cast<int>(model.tips.size()), 0);
  for (std::size_t i = 0; i < model.tips.size(); ++i) {
    lua_createtable(L, 0, 3);
    lua_pushstring(L, model.tips[i].name.c_str());
    lua_setfield(L, -2, "name");
    lua_pushinteger(L, model.tips[i].joint + 1);
    lua_setfield(L, -2, "joint");
    push(impl, L, pose_value(model.tips[i].tool));
    lua_setfield(L, -2, "tool");
    lua_rawseti(L, -2, static_cast<lua_Integer>(i + 1));
  }
  lua_setfield(L, -2, "tips");
}

void push_params(Impl& impl, lua_State* L, const Schema& schema, const Params& params) {
  lua_createtable(L, 0, static_cast<int>(schema.size()));
  for (const ParamSpec& s : schema) {
    if (!params.has(s.name)) continue;
    if (s.type == "bool") lua_pushboolean(L, params.boolean(s.name) ? 1 : 0);
    else if (s.type == "int") lua_pushinteger(L, params.integer(s.name));
    else if (s.type == "real") lua_pushnumber(L, params.real(s.name));
    else if (s.type == "real[]") push_vector(impl, L, params.reals(s.name), s.unit.c_str());
    else if (s.type == "pose") push(impl, L, pose_value(params.pose(s.name)));
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
                  "Return one number for each joint.");
  for (std::size_t i = 0; i < count; ++i)
    if (!std::isfinite((*numbers)[i]))
      return failed(p,
                    std::string(what) + " has an entry [" + std::to_string(i + 1) + "] that is " +
                        text::print((*numbers)[i]),
                    "Return finite numbers.");
  return std::move(*numbers);
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

}  // namespace robomosp::lua
