// SPDX-License-Identifier: Apache-2.0
// What scripts of strangers may use: libraries that compute, the commands of their session, and
// nothing that reaches a file, another program, machine code or the interpreter's inside. This is
// the first wall; the process that they run in is the second (sandbox/lock_down.h).
#include <algorithm>
#include <array>

#include "kernel/text.h"
#include "lua/internal.h"

namespace robomosp::lua {
namespace {

constexpr luaL_Reg kLibraries[] = {
    {LUA_GNAME, luaopen_base},        {LUA_TABLIBNAME, luaopen_table},
    {LUA_STRLIBNAME, luaopen_string}, {LUA_MATHLIBNAME, luaopen_math},
    {LUA_UTF8LIBNAME, luaopen_utf8},  {LUA_COLIBNAME, luaopen_coroutine}};

/// Globals of the whole language that are not there.
constexpr std::array<std::string_view, 7> kMissing = {"debug",   "dofile",  "io",  "loadfile",
                                                      "package", "require", "warn"};

/// load(text or function [, name [, mode [, env]]]): binary chunks are refused, since the
/// interpreter does not check them. Upvalue 1 is Lua's own.
int load_text(lua_State* L) {
  if (lua_gettop(L) < 3) lua_settop(L, 3);
  if (lua_isnil(L, 3)) {
    lua_pushliteral(L, "t");
    lua_replace(L, 3);
  }
  const char* mode = luaL_checkstring(L, 3);
  if (std::string_view(mode).find('t') == std::string_view::npos)
    return luaL_error(L, "an untrusted script loads text only (mode is \"%s\")", mode);
  lua_pushliteral(L, "t");
  lua_replace(L, 3);
  lua_pushvalue(L, lua_upvalueindex(1));
  lua_insert(L, 1);
  lua_call(L, lua_gettop(L) - 1, LUA_MULTRET);
  return lua_gettop(L);
}

/// collectgarbage("count"): the KiB in use; what would change the collector is refused.
Result<int> count_memory(Impl& impl, lua_State* L) {
  if (lua_type(L, 1) != LUA_TSTRING || std::string_view(lua_tostring(L, 1)) != "count")
    return error(ErrorCode::permission,
                 "an untrusted script may call collectgarbage with \"count\" only",
                 "Unused memory is freed automatically.");
  lua_pushnumber(L, static_cast<double>(impl.used + impl.external) / 1024);
  return 1;
}

Result<int> refuse_solver(Impl&, lua_State*) {
  return error(ErrorCode::permission, "an untrusted script cannot provide solvers",
               "Use a session with the effect loads_code.");
}

/// Takes a field of the table on top away.
void drop(lua_State* L, const char* name) {
  lua_pushnil(L);
  lua_setfield(L, -2, name);
}

/// `os` with what tells the time.
void open_time(lua_State* L) {
  lua_pushcfunction(L, luaopen_os);
  lua_call(L, 0, 1);
  lua_createtable(L, 0, 4);
  for (const char* name : {"clock", "date", "difftime", "time"}) {
    lua_getfield(L, -2, name);
    lua_setfield(L, -2, name);
  }
  lua_setglobal(L, LUA_OSLIBNAME);
  lua_pop(L, 1);
}

}  // namespace

std::string untrusted_hint(std::string_view global) {
  if (std::find(kMissing.begin(), kMissing.end(), global) == kMissing.end()) return {};
  return "An untrusted script has no " + std::string(global) +
         "; it can compute, and access the world with commands such as robot.fk.";
}

void open_untrusted(Impl& impl, lua_State* L) {
  for (const luaL_Reg& library : kLibraries) {
    luaL_requiref(L, library.name, library.func, 1);
    lua_pop(L, 1);
  }
  open_time(L);
  lua_pushglobaltable(L);
  for (const char* name : {"dofile", "loadfile", "warn"}) drop(L, name);
  lua_getfield(L, -1, "load");
  lua_pushcclosure(L, load_text, 1);
  lua_setfield(L, -2, "load");
  lua_pushcfunction(L, entry<count_memory>);
  lua_setfield(L, -2, "collectgarbage");
  lua_getfield(L, -1, LUA_STRLIBNAME);
  drop(L, "dump");
  lua_pop(L, 2);
  lua_pushliteral(L, "");
  lua_getmetatable(L, -1);
  lua_pushliteral(L, "string");
  lua_setfield(L, -2, "__metatable");
  lua_pop(L, 2);
  open_errors(L);
  open_arrays(L);
  open_linear_algebra(L);
  open_commands(impl, L);
  lua_getglobal(L, "ioci");
  for (const char* name : {"provide", "withdraw"}) {
    lua_pushcfunction(L, entry<refuse_solver>);
    lua_setfield(L, -2, name);
  }
  lua_pop(L, 1);
  guard_xpcall(L);
  open_helpers(L);
}

}  // namespace robomosp::lua
