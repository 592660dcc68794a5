// SPDX-License-Identifier: Apache-2.0
// Names at a console: the state's own ones, which an assignment hides, and hints for names that are
// not defined.

#include "kernel/text.h"
#include "kernel/value_text.h"
#include "lua/internal.h"

namespace robomosp::lua {
namespace {

const char kOwnGlobalsKey = 0;  // in the registry: table of the globals a state began with

}  // namespace

void keep_own_globals(lua_State* L) {
  lua_newtable(L);
  lua_pushglobaltable(L);
  lua_pushnil(L);
  while (lua_next(L, -2) != 0) {
    lua_pushvalue(L, -2);
    lua_insert(L, -2);
    lua_rawset(L, -5);
  }
  lua_pop(L, 1);
  lua_rawsetp(L, LUA_REGISTRYINDEX, &kOwnGlobalsKey);
}

void check_own_globals(Impl& impl, lua_State* L) {
  const int top = lua_gettop(L);
  if (lua_rawgetp(L, LUA_REGISTRYINDEX, &kOwnGlobalsKey) != LUA_TTABLE) {
    lua_settop(L, top);
    return;
  }
  const int own = lua_gettop(L);
  lua_pushglobaltable(L);
  const int globals = lua_gettop(L);
  lua_pushnil(L);
  while (lua_next(L, own) != 0) {
    lua_pushvalue(L, -2);
    const bool is_set = lua_rawget(L, globals) != LUA_TNIL;
    const bool is_same = lua_rawequal(L, -1, -2) != 0;
    const std::string name =
        !is_same && lua_type(L, -3) == LUA_TSTRING ? lua_tostring(L, -3) : std::string();
    lua_pop(L, 1);
    if (!is_set) {
      lua_pushvalue(L, -2);
      lua_pushvalue(L, -2);
      lua_rawset(L, globals);
    }
    if (is_same || !is_set) {
      impl.hidden.erase(name);
    } else if (!name.empty() && impl.hidden.insert(name).second) {
      const auto commands = impl.host.list();
      const bool is_topic =
          std::any_of(commands.begin(), commands.end(),
                      [&name](const auto* spec) { return spec->name.starts_with(name + "."); });
      impl.host.note("hidden_name",
                     name + " is now your variable and hides the " +
                         (is_topic ? "commands " + name + ".*" : name + " there was") + "; " +
                         name + " = nil brings " + (is_topic ? "them" : "it") + " back.");
    }
    lua_pop(L, 1);
  }
  lua_settop(L, top);
}

std::string hint_for_name(Impl& impl, lua_State* L, const std::string& name) {
  if (!is_plain_name(name)) return {};
  if (impl.is_untrusted)
    if (std::string hint = untrusted_hint(name); !hint.empty()) return hint;
  if (name == "exit") return "quit() ends the program.";
  if (std::string record = impl.record_hint(name); !record.empty()) return record;
  std::vector<std::string> commands, globals;
  for (const ioci::CommandSpec* spec : impl.host.list())
    if (spec->name.ends_with("." + name)) commands.push_back(spec->name);
  if (commands.size() == 1) return "Did you mean " + text::quote(commands[0]) + "?";
  lua_pushglobaltable(L);
  lua_pushnil(L);
  while (lua_next(L, -2) != 0) {
    lua_pop(L, 1);
    if (lua_type(L, -1) == LUA_TSTRING) globals.emplace_back(lua_tostring(L, -1));
  }
  lua_pop(L, 1);
  std::sort(globals.begin(), globals.end());
  if (std::string near = text::did_you_mean(name, globals); !near.empty()) return near;
  const std::string leaving[] = {"exit"};
  if (text::nearest(name, leaving)) return "quit() ends the program.";
  if (!commands.empty()) {
    constexpr std::size_t kMost = 4;
    if (commands.size() > kMost) commands.resize(kMost);
    return "There is " + text::enumerate(commands) + ".";
  }
  const std::string meant = impl.host.unknown(name).hint;
  return meant.starts_with("Did you mean") ? meant : std::string();
}

std::string note_for_undefined(Impl& impl, lua_State* L, const std::string& name) {
  if (!is_plain_name(name)) return {};
  const std::string hint = hint_for_name(impl, L, name);
  return name + " is not defined." + (hint.empty() ? "" : " " + hint);
}

}  // namespace robomosp::lua
