// SPDX-License-Identifier: Apache-2.0
// Forces at tips written in Lua (layer: application, lua).
#include <algorithm>
#include <cmath>

#include <robomosp/sdk/tip_force.h>

#include "kernel/known_provider.h"
#include "kernel/text.h"
#include "lua/program_state.h"
#include "lua/provide.h"

namespace robomosp::lua {
namespace {

constexpr std::string_view kForceFunction =
    "function ";  ///< what names of given functions begin with
constexpr std::size_t kMostForceFunctions = 64;

/// fn(time, path, params) -> fx, fy, fz, or with mx, my, mz, each as results or in one list. `path`
/// is nil where the robot follows none.
class LuaTipForce final : public TipForce {
 public:
  explicit LuaTipForce(ProviderPtr p) : p_(std::move(p)) {}
  Result<void> prepare(const Params& params) override {
    params_ = Kept(p_->schema, params);
    return {};
  }
  Result<TipWrench> at(double time, double path) const override {
    TipWrench out;
    Call call_script(*p_);
    RMP_TRY(call_script.run([&](Impl& impl, lua_State* L) -> Result<void> {
      const int before = lua_gettop(L);
      call_script.push_function(L, "force");
      lua_pushnumber(L, time);
      if (std::isnan(path)) lua_pushnil(L);
      else lua_pushnumber(L, path);
      push_params(impl, L, p_->schema, params_.get());
      RMP_TRY(call(impl, L, 3, LUA_MULTRET));
      const int count = lua_gettop(L) - before;
      std::vector<double> w;
      if (count == 1 && lua_type(L, -1) != LUA_TNUMBER) {
        RMP_TRY_ASSIGN(w, to_reals(L, -1, "the force"));
      } else {
        for (int k = 1; k <= count; ++k)
          if (lua_type(L, before + k) == LUA_TNUMBER) w.push_back(lua_tonumber(L, before + k));
      }
      if ((w.size() != 3 && w.size() != 6) ||
          (count > 1 && w.size() != static_cast<std::size_t>(count)))
        return failed(*p_, "the force has " + std::to_string(w.size()) + " numbers",
                      "Return three numbers of a force [N], or six of a force and a moment [N m].");
      w.resize(6);
      for (const double v : w)
        if (!std::isfinite(v))
          return failed(*p_, "the force is not a number at t = " + text::print_rounded(time) + " s",
                        "Correct the function.");
      out = {{w[0], w[1], w[2]}, {w[3], w[4], w[5]}};
      return {};
    }));
    return out;
  }

 private:
  ProviderPtr p_;
  Kept params_;
};

bool is_function_field(lua_State* L, int table, const char* name) {
  lua_pushstring(L, name);
  lua_rawget(L, table);
  const bool is = lua_isfunction(L, -1) && !command_of(L, -1);
  lua_pop(L, 1);
  return is;
}

/// Name of the provider that calls the function on top; made where there is none yet.
Result<std::string> force_function_name(ProgramState& impl, lua_State* L) {
  const int function = lua_gettop(L);
  std::vector<std::size_t> given;
  for (std::size_t i = 0; i < impl.providers.size(); ++i) {
    const LuaProvider& p = *impl.providers[i];
    if (p.interface_id != TipForce::kInterfaceId || !p.name.starts_with(kForceFunction)) continue;
    lua_rawgeti(L, LUA_REGISTRYINDEX, p.ref);
    const bool is_same = lua_rawequal(L, -1, function) != 0;
    lua_pop(L, 1);
    if (is_same) return p.name;
    given.push_back(i);
  }
  RMP_TRY(script_may(impl, Effect::providers, "a function as tip_force"));
  if (given.size() >= kMostForceFunctions) withdraw_at(impl, given.front());
  std::size_t number = 1;
  std::string name;
  do name = std::string(kForceFunction) + std::to_string(number++);
  while (known_provider(impl.app.registry, TipForce::kInterfaceId, name).ok());
  ProviderSource source;
  source.origin = impl.plugin.empty() ? "lua" : impl.plugin;
  source.summary = "Function given as tip_force at " + place(L, 1) + ".";
  const PermitScope own(nullptr);
  RMP_TRY(add_provider(impl, L, TipForce::kInterfaceId, name, function, std::move(source)));
  return name;
}

/// Whether the command takes a force at a tip along a motion, and the table at `index` has a
/// function for it.
bool has_force_function(lua_State* L, const ioci::CommandSpec& spec, int index) {
  const bool takes = std::any_of(spec.params.begin(), spec.params.end(),
                                 [](const ParamSpec& p) { return p.name == "tip_wrench"; });
  return takes && lua_istable(L, index) &&
         (is_function_field(L, index, "tip_force") || is_function_field(L, index, "tip_moment"));
}

}  // namespace

/// The function `tip_force` becomes the name of a provider that calls it, the same for the same
/// function; the state keeps the last 64.
Result<void> ProgramState::take_functions(lua_State* L, const ioci::CommandSpec& spec, int index) {
  if (!has_force_function(L, spec, index)) return {};
  if (is_function_field(L, index, "tip_moment"))
    return error(
        ErrorCode::invalid_argument, "a function gives force and moment together",
        "Give it as tip_force, and return six numbers: the force [N] and the moment [N m].",
        "tip_moment");
  lua_newtable(L);
  const int copy = lua_gettop(L);
  lua_pushnil(L);
  while (lua_next(L, index) != 0) {
    lua_pushvalue(L, -2);
    lua_insert(L, -2);
    lua_rawset(L, copy);
  }
  lua_pushliteral(L, "tip_force");
  lua_rawget(L, index);
  auto name = force_function_name(*this, L);
  lua_pop(L, 1);
  if (!name.ok()) return std::move(name).error().in("tip_force");
  lua_pushlstring(L, name->data(), name->size());
  lua_setfield(L, copy, "tip_force");
  lua_replace(L, index);
  return {};
}

RMP_LUA_PROVIDER(TipForce, LuaTipForce, "force");

}  // namespace robomosp::lua
