// SPDX-License-Identifier: Apache-2.0
#include "lua/kept_scripts.h"

#include <algorithm>
#include <utility>

#include "kernel/interface_adapters.h"
#include "kernel/permit.h"
#include "kernel/text.h"
#include "lua/provide.h"

namespace robomosp::lua {
namespace {

/// Makes the globals of a text that came with a file. What it is given is copied, so that nothing
/// it changes is seen outside; metatables are its own, and without finalizers, which would run
/// when it is not its turn.
constexpr std::string_view kRoom = R"lua(
local real, commands = ...
local pairs, type, error, setmetatable = pairs, type, error, setmetatable
local function copy(t)
  local out = {}
  for k, v in pairs(t) do out[k] = v end
  return out
end
local env = {}
for _, name in pairs{"_VERSION", "array", "assert", "deg", "error", "ipairs", "mm", "next", "pairs",
    "pcall", "pi", "pose", "print", "rawequal", "rawget", "rawlen", "rawset", "rpy", "select",
    "tonumber", "tostring", "type", "xpcall"} do
  env[name] = real[name]
end
for _, name in pairs{"coroutine", "linalg", "math", "string", "table", "utf8"} do
  env[name] = copy(real[name])
end
env.string.dump = nil
env.os = {clock = real.os.clock, date = real.os.date, difftime = real.os.difftime,
  time = real.os.time}
for name, t in pairs(commands) do
  env[name] = setmetatable(t, {__metatable = false, __call = t.get and function(_, ...)
    return t.get(...)
  end})
end
local own = setmetatable({}, {__mode = "k"})
function env.setmetatable(t, meta)
  if type(meta) == "table" and (meta.__gc ~= nil or meta.__close ~= nil) then
    error("a solver that came with a file has no __gc and no __close", 2)
  end
  setmetatable(t, meta)
  own[t] = meta
  return t
end
function env.getmetatable(t) return own[t] end
env._G = env
env.ioci = {}
return env
)lua";

/// What the text calls `ioci.provide`: takes the value if it is the solver that is looked for.
/// Upvalues: interface, name, a table whose entry 1 becomes the value.
Result<int> kept_provide(Impl&, lua_State* L) {
  const auto is = [&](int index, int upvalue) {
    if (lua_type(L, index) != LUA_TSTRING) return false;
    std::string given = lua_tostring(L, index);
    if (index == 1) {
      if (const std::string now = current_interface(given); !now.empty()) given = now;
    }
    return given == lua_tostring(L, lua_upvalueindex(upvalue));
  };
  if (is(1, 1) && is(2, 2)) {
    lua_pushvalue(L, 3);
    lua_rawseti(L, lua_upvalueindex(3), 1);
  }
  return 0;
}

/// Commands that read and do nothing else, by topic.
void push_reading_commands(const ProgramState& impl, lua_State* L) {
  lua_newtable(L);
  for (const ioci::CommandSpec* spec : impl.app.commands.list()) {
    const auto dot = spec->name.find('.');
    if (dot == std::string::npos || (spec->effect | Effect::reads) != Effects(Effect::reads))
      continue;
    const std::string topic = spec->name.substr(0, dot);
    if (lua_getfield(L, -1, topic.c_str()) != LUA_TTABLE) {
      lua_pop(L, 1);
      lua_newtable(L);
      lua_pushvalue(L, -1);
      lua_setfield(L, -3, topic.c_str());
    }
    push_command(L, *spec, false);
    lua_setfield(L, -2, spec->name.c_str() + dot + 1);
    lua_pop(L, 1);
  }
}

/// A body that runs protected, on the state's thread.
struct ScriptJob {
  const std::function<Result<void>(lua_State*)>* body;
  std::optional<Error> failed;
};
Result<int> run_script_job(Impl&, lua_State* L) {
  auto& job = *static_cast<ScriptJob*>(lua_touserdata(L, 1));
  lua_settop(L, 0);
  auto r = (*job.body)(L);
  if (!r.ok()) job.failed = std::move(r).error();
  return 0;
}
Result<void> protect(Impl& impl, const std::function<Result<void>(lua_State*)>& body) {
  lua_State* L = impl.current ? impl.current : impl.main;
  const int top = lua_gettop(L);
  if (!lua_checkstack(L, 40))
    return error(ErrorCode::script_failed, "the Lua stack is full", "Reduce the call depth.");
  ScriptJob job{&body, {}};
  lua_pushcfunction(L, entry<run_script_job>);
  lua_pushlightuserdata(L, &job);
  auto done = call(impl, L, 1, 0);
  lua_settop(L, top);
  RMP_TRY(std::move(done));
  if (job.failed) return std::move(*job.failed);
  return {};
}

}  // namespace

Permit KeptScripts::permit(const ProgramState& impl) {
  return {program_of(impl).session.name(),
          "a solver that came with a file",
          Effect::reads,
          Effects::all().without(Effect::reads),
          false,
          true};
}

Result<void> KeptScripts::run(lua_State* L, const model::KeptSolver& solver) {
  const std::string& name = solver.provides.empty() ? solver.name : solver.provides;
  const Permit narrow = permit(impl_);
  const PermitScope permitted(&narrow);
  const std::string chunk = "=" + solver.name;
  if (luaL_loadbufferx(L, solver.text.data(), solver.text.size(), chunk.c_str(), "t") != LUA_OK) {
    Error e = to_error(L, -1);
    if (!e.message.starts_with("syntax error")) e.message = "syntax error: " + e.message;
    return e;
  }
  const int script = lua_gettop(L);
  lua_newtable(L);
  const int given = lua_gettop(L);
  if (luaL_loadbufferx(L, kRoom.data(), kRoom.size(), "=room", "t") != LUA_OK)
    return to_error(L, -1);
  lua_pushglobaltable(L);
  push_reading_commands(impl_, L);
  RMP_TRY(call(impl_, L, 2, 1));
  lua_getfield(L, -1, "ioci");
  lua_pushstring(L, solver.interface.c_str());
  lua_pushstring(L, name.c_str());
  lua_pushvalue(L, given);
  lua_pushcclosure(L, entry<kept_provide>, 3);
  lua_setfield(L, -2, "provide");
  lua_pop(L, 1);
  lua_setupvalue(L, script, 1);
  lua_pushvalue(L, script);
  RMP_TRY(call(impl_, L, 0, 1));
  if (lua_isnil(L, -1)) lua_rawgeti(L, given, 1);
  if (!lua_isnil(L, -1)) return {};
  return error(
      ErrorCode::script_failed,
      "the text provides no solver " + text::quote(name) + " of " + text::quote(solver.interface),
      "It calls ioci.provide(" + text::quote(solver.interface) + ", " + text::quote(name) +
          ", ...), or returns the function or table.");
}

Result<void> KeptScripts::try_out(const model::KeptSolver& solver) {
  return protect(impl_, [&](lua_State* L) -> Result<void> {
    RMP_TRY(run(L, solver));
    ProviderSource source;
    source.only_checks = true;
    return add_provider(impl_, L, solver.interface, solver.name, lua_gettop(L), source);
  });
}

Result<void> KeptScripts::provide(const ioci::KeptSolvers::Wanted& wanted) {
  const model::KeptSolver& s = wanted.solver;
  return protect(impl_, [&](lua_State* L) -> Result<void> {
    RMP_TRY(run(L, s));
    const int value = lua_gettop(L);
    const PermitScope own(nullptr);
    // The session's own one of the same text stands aside: what is kept is what runs.
    for (std::size_t i = 0; i < impl_.providers.size(); ++i) {
      const LuaProvider& p = *impl_.providers[i];
      if (p.is_kept || p.origin != "lua" || p.interface_id != s.interface || p.name != s.name ||
          p.source != s.text)
        continue;
      Aside aside{p.interface_id, p.name, {p.origin, {}, p.source, false, false}, LUA_NOREF};
      lua_rawgeti(L, LUA_REGISTRYINDEX, p.ref);
      aside.ref = luaL_ref(L, LUA_REGISTRYINDEX);
      aside_.push_back(std::move(aside));
      withdraw_at(impl_, i);
      break;
    }
    ProviderSource source;
    source.origin = wanted.origin;
    source.summary = "Written in Lua, " + wanted.origin + ".";
    source.text = s.text;
    source.is_kept = true;
    auto added = add_provider(impl_, L, s.interface, s.name, value, std::move(source));
    if (!added.ok()) put_back(s.interface, s.name);
    return added;
  });
}

void KeptScripts::put_back(const std::string& interface_id, const std::string& name) {
  const auto it = std::find_if(aside_.begin(), aside_.end(), [&](const Aside& a) {
    return a.interface_id == interface_id && a.name == name;
  });
  if (it == aside_.end()) return;
  const Aside aside = std::move(*it);
  aside_.erase(it);
  const PermitScope own(nullptr);
  (void)protect(impl_, [&](lua_State* L) -> Result<void> {
    lua_rawgeti(L, LUA_REGISTRYINDEX, aside.ref);
    luaL_unref(L, LUA_REGISTRYINDEX, aside.ref);
    return add_provider(impl_, L, aside.interface_id, aside.name, lua_gettop(L), aside.source);
  });
}

void KeptScripts::follow() {
  if (is_here()) catch_up();
}

void KeptScripts::catch_up() {
  ioci::KeptSolvers& kept = *impl_.app.kept_solvers;
  if (is_busy_ || seen_ == kept.revision()) return;
  is_busy_ = true;
  seen_ = kept.revision();
  const PermitScope own(nullptr);
  const auto wanted = kept.wanted();
  const auto serves = [](const LuaProvider& p, const ioci::KeptSolvers::Wanted& w) {
    return p.interface_id == w.solver.interface && p.name == w.solver.name &&
           p.source == w.solver.text && p.origin == w.origin;
  };
  for (std::size_t i = impl_.providers.size(); i-- > 0;) {
    const ProviderPtr p = impl_.providers[i];
    if (!p->is_kept ||
        std::any_of(wanted.begin(), wanted.end(), [&](const auto& w) { return serves(*p, w); }))
      continue;
    withdraw_at(impl_, i);
    if (std::none_of(wanted.begin(), wanted.end(), [&](const auto& w) {
          return w.solver.interface == p->interface_id && w.solver.name == p->name;
        }))
      put_back(p->interface_id, p->name);
  }
  for (const auto& w : wanted) {
    if (std::any_of(impl_.providers.begin(), impl_.providers.end(),
                    [&](const auto& p) { return p->is_kept && serves(*p, w); }))
      continue;
    const auto done = provide(w);
    kept.report(w.solver, done.ok() ? std::string() : done.error().sentence());
  }
  is_busy_ = false;
}

}  // namespace robomosp::lua
