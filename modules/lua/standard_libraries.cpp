// SPDX-License-Identifier: Apache-2.0
// Lua's own libraries in a script of this program: behind the session's permissions and folder, and
// without what would work against the program.
#include <cstdio>

#include "lua/internal.h"
#include "lua/program_state.h"

namespace robomosp::lua {
namespace {

/// os.exit(code): unwinds the script instead of ending the process under the program's feet.
Result<int> exit_script(Impl& impl, lua_State* L) {
  RMP_TRY(script_may(impl, Effect::stops, "os.exit"));
  int code = 0;
  if (lua_isboolean(L, 1)) code = lua_toboolean(L, 1) ? 0 : 1;
  else if (lua_isinteger(L, 1)) code = static_cast<int>(lua_tointeger(L, 1));
  impl.exit_code = code;
  stop_script(impl, L);
  return error(ErrorCode::cancelled, "the script called exit");
}

void remove_field(lua_State* L, const char* library, const char* name) {
  lua_getglobal(L, library);
  lua_pushnil(L);
  lua_setfield(L, -2, name);
  lua_pop(L, 1);
}

/// What of Lua's own libraries reaches out of the program. `only_text`: with a file's name only,
/// not with an open file or nothing.
struct Outward {
  const char* library;  ///< nullptr = a global
  const char* name;
  Effect effect;
  bool only_text;
};
constexpr Outward kOutward[] = {{"io", "input", Effect::files_read, true},
                                {"io", "lines", Effect::files_read, true},
                                {"io", "open", Effect::files_read, true},
                                {"io", "output", Effect::files_write, true},
                                {"io", "popen", Effect::processes, false},
                                {"io", "tmpfile", Effect::files_write, false},
                                {"os", "execute", Effect::processes, false},
                                {"os", "remove", Effect::files_write, false},
                                {"os", "rename", Effect::files_write, false},
                                {"os", "tmpname", Effect::files_write, false},
                                {"package", "searchpath", Effect::files_read, false},
                                {nullptr, "dofile", Effect::files_read, false},
                                {nullptr, "loadfile", Effect::files_read, false}};

/// Upvalue 2 and 3 of guarded_library, then its arguments: may the session do that?
Result<int> check_library(Impl& impl, lua_State* L) {
  const std::string what = lua_tostring(L, 2);
  auto effect = static_cast<Effect>(lua_tointeger(L, 1));
  if (what == "io.open") {
    const std::string_view mode = lua_type(L, 4) == LUA_TSTRING ? lua_tostring(L, 4) : "r";
    if (mode.find_first_of("wa+") != std::string_view::npos) {
      RMP_TRY(script_may(impl, Effect::files_write, what));
      if (mode.find('+') == std::string_view::npos) return 0;
    }
  }
  RMP_TRY(script_may(impl, effect, what));
  return 0;
}

int all_results(lua_State* L, int, lua_KContext) { return lua_gettop(L); }

/// A function of Lua's libraries behind the session's permissions. Upvalues: the function, the
/// effect, its name, whether only a text as the first argument has the effect. A plain C function,
/// because dofile and require may yield.
int guarded_library(lua_State* L) {
  const int count = lua_gettop(L);
  if (!lua_toboolean(L, lua_upvalueindex(4)) || lua_type(L, 1) == LUA_TSTRING) {
    luaL_checkstack(L, count + 4, "too many arguments");
    lua_pushcfunction(L, entry<check_library>);
    lua_pushvalue(L, lua_upvalueindex(2));
    lua_pushvalue(L, lua_upvalueindex(3));
    for (int i = 1; i <= count; ++i) lua_pushvalue(L, i);
    lua_call(L, count + 2, 0);
    if (program_of(impl_of(L)).session.files()) {
      lua_pushvalue(L, lua_upvalueindex(1));
      lua_insert(L, 1);
      lua_pushvalue(L, lua_upvalueindex(3));
      lua_insert(L, 2);
      return call_confined_library(L);
    }
  }
  lua_pushvalue(L, lua_upvalueindex(1));
  lua_insert(L, 1);
  lua_callk(L, count, LUA_MULTRET, 0, all_results);
  return lua_gettop(L);
}

/// Functions of `debug` that reach behind what is guarded: the functions in closures, metatables
/// of what is not a table, and so memory itself.
constexpr const char* kReachingBehind[] = {
    "debug",    "getlocal",     "getmetatable", "getregistry",  "getupvalue", "getuservalue",
    "setlocal", "setmetatable", "setupvalue",   "setuservalue", "upvalueid",  "upvaluejoin"};

/// Upvalues: Lua's function, its name.
Result<int> check_debug(Impl& impl, lua_State* L) {
  if (!program_of(impl).session.files() && program_of(impl).session.denied().empty()) return 0;
  return error(ErrorCode::permission,
               "debug." + std::string(lua_tostring(L, 1)) +
                   " is not available in a session with restricted rights",
               "debug.traceback and debug.getinfo are available.");
}
int guarded_debug(lua_State* L) {
  lua_pushcfunction(L, entry<check_debug>);
  lua_pushvalue(L, lua_upvalueindex(2));
  lua_call(L, 1, 0);
  lua_pushvalue(L, lua_upvalueindex(1));
  lua_insert(L, 1);
  lua_call(L, lua_gettop(L) - 1, LUA_MULTRET);
  return lua_gettop(L);
}

/// load() of a session that may not do everything takes text only: compiled code is not checked by
/// Lua, and can reach any memory. Upvalue: Lua's function.
int guarded_load(lua_State* L) {
  const ioci::Session& session = program_of(impl_of(L)).session;
  if (session.files() || !session.denied().empty()) {
    if (lua_gettop(L) < 3) lua_settop(L, 3);
    lua_pushliteral(L, "t");
    lua_replace(L, 3);
  }
  lua_pushvalue(L, lua_upvalueindex(1));
  lua_insert(L, 1);
  lua_call(L, lua_gettop(L) - 1, LUA_MULTRET);
  return lua_gettop(L);
}

/// Puts a guard around the function on top.
void guard(lua_State* L, Effect effect, const std::string& name, bool only_text) {
  lua_pushinteger(L, static_cast<lua_Integer>(effect));
  lua_pushlstring(L, name.data(), name.size());
  lua_pushboolean(L, only_text ? 1 : 0);
  lua_pushcclosure(L, guarded_library, 4);
}

void guard_libraries(lua_State* L) {
  for (const Outward& o : kOutward) {
    if (o.library) lua_getglobal(L, o.library);
    else lua_pushglobaltable(L);
    lua_getfield(L, -1, o.name);
    guard(L, o.effect, o.library ? std::string(o.library) + "." + o.name : o.name, o.only_text);
    lua_setfield(L, -2, o.name);
    lua_pop(L, 1);
  }
  lua_getglobal(L, "debug");
  for (const char* name : kReachingBehind) {
    lua_getfield(L, -1, name);
    lua_pushstring(L, name);
    lua_pushcclosure(L, guarded_debug, 2);
    lua_setfield(L, -2, name);
  }
  lua_pop(L, 1);
  lua_getglobal(L, "load");
  lua_pushcclosure(L, guarded_load, 1);
  lua_setglobal(L, "load");
  // What require() looks for: 2 is files of Lua, 3 and 4 are libraries of machine code.
  lua_getglobal(L, "package");
  lua_getfield(L, -1, "searchers");
  for (int i = 2; i <= 4; ++i) {
    lua_rawgeti(L, -1, i);
    guard(L, i == 2 ? Effect::files_read : Effect::loads_code, i == 2 ? "require" : "machine code",
          false);
    lua_rawseti(L, -2, i);
  }
  lua_pop(L, 2);
}

// --- standard output ---

ssize_t write_output(void* cookie, const char* bytes, std::size_t count) {
  const Impl& impl = *static_cast<const Impl*>(cookie);
  impl.options.print(std::string_view(bytes, count));
  return static_cast<ssize_t>(count);
}

/// What the standard files of Lua answer to close().
int keep_open(lua_State* L) {
  static_cast<luaL_Stream*>(luaL_checkudata(L, 1, LUA_FILEHANDLE))->closef = &keep_open;
  lua_pushnil(L);
  lua_pushliteral(L, "cannot close standard file");
  return 2;
}

/// Makes io.write and io.stdout write where print() does.
void redirect_output(Impl& impl, lua_State* L) {
  if (!impl.options.print) return;
  impl.out.reset(::fopencookie(&impl, "w", {nullptr, write_output, nullptr, nullptr}));
  if (!impl.out) return;
  // By lines, as a terminal: what asks for input flushes those first.
  std::setvbuf(impl.out.get(), nullptr, _IOLBF, BUFSIZ);
  lua_getglobal(L, "io");
  lua_getfield(L, -1, "output");
  auto* file = static_cast<luaL_Stream*>(lua_newuserdatauv(L, sizeof(luaL_Stream), 0));
  file->closef = nullptr;
  luaL_setmetatable(L, LUA_FILEHANDLE);
  file->f = impl.out.get();
  file->closef = &keep_open;
  lua_pushvalue(L, -1);
  lua_setfield(L, -4, "stdout");
  lua_call(L, 1, 0);
  lua_pop(L, 1);
}

void tame_libraries(Impl& impl, lua_State* L) {
  redirect_output(impl, L);
  guard_libraries(L);
  lua_getglobal(L, "os");
  lua_pushcfunction(L, entry<exit_script>);
  lua_setfield(L, -2, "exit");
  lua_pop(L, 1);
  // Would switch Ctrl-C off; and C modules of another Lua do not mix with this one. The locale is
  // the program's.
  remove_field(L, "debug", "sethook");
  remove_field(L, "package", "loadlib");
  remove_field(L, "os", "setlocale");
  lua_getglobal(L, "package");
  std::string path;
  for (const auto& folder : impl.options.module_path) path += folder.string() + "/?.lua;";
  path += "./?.lua";
  lua_pushlstring(L, path.data(), path.size());
  lua_setfield(L, -2, "path");
  lua_pushliteral(L, "");
  lua_setfield(L, -2, "cpath");
  lua_pop(L, 1);
  guard_xpcall(L);
}

}  // namespace

void open_globals(Impl& impl, lua_State* L) {
  tame_libraries(impl, L);
  open_helpers(L);
}

}  // namespace robomosp::lua
