// SPDX-License-Identifier: Apache-2.0
// Solvers written in Lua: ioci.provide and ioci.withdraw. The adapters (provide_*.cpp) answer on
// the thread of their script; what a script returns is checked before anything uses it.
#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include "kernel/interface_adapters.h"
#include "kernel/permit.h"
#include "kernel/text.h"
#include "lua/provide.h"

namespace robomosp::lua {
namespace {

struct Adapters {
  std::vector<LuaInterface> all;
  std::vector<std::string> files;
};
/// Filled before main(), and only read from then on.
Adapters& adapters() {
  static Adapters one;
  return one;
}

Result<std::string> need_text(lua_State* L, int index, const char* what) {
  if (lua_type(L, index) == LUA_TSTRING) return std::string(lua_tostring(L, index));
  return error(ErrorCode::invalid_argument,
               std::string(what) + " must be a text, not a " + luaL_typename(L, index),
               "Write ioci.provide(\"robomosp.ik/1\", \"my_ik\", fn).");
}

std::string text_field(const Map& m, const char* name) {
  const Value* v = m.find(name);
  return v && v->as_string() ? *v->as_string() : std::string();
}

/// params = {{name = "gain", type = "real", unit = "", doc = "...", default = 1}, ...}
Result<Schema> read_schema(lua_State* L, int table) {
  Schema schema;
  lua_getfield(L, table, "params");
  auto given = to_value(L, -1);
  lua_pop(L, 1);
  if (!given.ok()) return std::move(given).error().in("params");
  if (given->is_nil()) return schema;
  if (!given->as_list())
    return error(ErrorCode::invalid_argument, "params is not a list",
                 "Write params = {{name = \"gain\", type = \"real\", default = 1}}.");
  for (const Value& row : *given->as_list()) {
    ParamSpec p;
    if (const Map* m = row.as_map()) {
      p.name = text_field(*m, "name");
      p.type = text_field(*m, "type");
      p.unit = text_field(*m, "unit");
      p.doc = text_field(*m, "doc");
      if (const Value* d = m->find("default")) p.default_value = *d;
      if (const Value* v = m->find("min"); v && v->is_number()) p.min = v->number();
      if (const Value* v = m->find("max"); v && v->is_number()) p.max = v->number();
      if (const Value* v = m->find("choices"); v && v->as_list())
        for (const Value& c : *v->as_list())
          p.choices.push_back(c.as_string() ? *c.as_string() : c.text());
    }
    static constexpr std::string_view kTypes[] = {"bool", "int",  "real",   "string",
                                                  "enum", "path", "real[]", "pose"};
    if (p.name.empty() ||
        std::find(std::begin(kTypes), std::end(kTypes), p.type) == std::end(kTypes))
      return error(ErrorCode::invalid_argument, "an entry of params has no name or no known type",
                   "Types: bool, int, real, string, enum, path, real[], pose.");
    p.required = !p.default_value;
    schema.push_back(std::move(p));
  }
  return schema;
}

/// tags = {"simple", "loops"}
Result<std::vector<std::string>> read_tags(lua_State* L, int table) {
  std::vector<std::string> tags;
  lua_getfield(L, table, "tags");
  auto given = to_value(L, -1);
  lua_pop(L, 1);
  if (!given.ok()) return std::move(given).error().in("tags");
  if (given->is_nil()) return tags;
  for (const Value& v : given->as_list() ? *given->as_list() : List{Value()}) {
    if (!v.as_string())
      return error(ErrorCode::invalid_argument, "tags is not a list of words",
                   "Write tags = {\"simple\"}.");
    tags.push_back(*v.as_string());
  }
  return tags;
}

void close(Impl& impl, LuaProvider& p) {
  impl.app.registry.remove(p.interface_id, p.name);
  luaL_unref(impl.main, LUA_REGISTRYINDEX, p.ref);
  for (const int value : p.values) luaL_unref(impl.main, LUA_REGISTRYINDEX, value);
  p.values.clear();
  p.ref = LUA_NOREF;
  p.state = nullptr;
}

bool withdraw(Impl& impl, std::string_view interface_id, std::string_view name) {
  const auto it =
      std::find_if(impl.providers.begin(), impl.providers.end(), [&](const ProviderPtr& p) {
        return p->interface_id == current_interface(interface_id) && p->name == name;
      });
  if (it == impl.providers.end()) return false;
  close(impl, **it);
  impl.providers.erase(it);
  return true;
}

/// ioci.provide(interface_id, name, fn | {fn fields, summary =, tags =, params =})
Result<int> ioci_provide(Impl& impl, lua_State* L) {
  RMP_TRY(script_may(impl, Effect::providers, "ioci.provide"));
  const PermitScope own(nullptr);
  RMP_TRY_ASSIGN(std::string interface_id, need_text(L, 1, "the interface id"));
  RMP_TRY_ASSIGN(const std::string name, need_text(L, 2, "the provider's name"));
  const auto& known = LuaInterfaceFile::all();
  const auto adapter = std::find_if(known.begin(), known.end(), [&](const LuaInterface& a) {
    // What a script gives is the same for every number of an interface.
    return current_interface(interface_id) == a.interface_id;
  });
  if (adapter == known.end()) {
    std::vector<std::string> ids;
    for (const LuaInterface& a : known) ids.emplace_back(a.interface_id);
    return error(ErrorCode::unknown_name,
                 text::quote(interface_id) + " is not an interface that Lua can provide",
                 text::did_you_mean(interface_id, ids) +
                     (text::nearest(interface_id, ids) ? " " : "") +
                     "Interfaces: " + text::enumerate(ids) + ".");
  }
  interface_id = adapter->interface_id;
  ProviderInfo info;
  if (lua_istable(L, 3)) {
    lua_getfield(L, 3, adapter->function);
    const bool has_function = lua_isfunction(L, -1);
    lua_pop(L, 1);
    if (!has_function)
      return error(ErrorCode::invalid_argument,
                   "the table has no function " + std::string(adapter->function),
                   "Write {" + std::string(adapter->function) + " = function(...) ... end}.");
    lua_getfield(L, 3, "summary");
    if (lua_type(L, -1) == LUA_TSTRING) info.summary = lua_tostring(L, -1);
    lua_pop(L, 1);
    RMP_TRY_ASSIGN(info.schema, read_schema(L, 3));
    RMP_TRY_ASSIGN(info.tags, read_tags(L, 3));
    if (lua_getfield(L, 3, "branches") != LUA_TNIL &&
        std::find(info.tags.begin(), info.tags.end(), "branches") == info.tags.end())
      info.tags.emplace_back("branches");
    lua_pop(L, 1);
  } else if (!lua_isfunction(L, 3)) {
    return error(
        ErrorCode::invalid_argument,
        std::string("a provider is a function or a table of functions, not a ") +
            luaL_typename(L, 3),
        "Write ioci.provide(\"" + interface_id + "\", \"" + name + "\", function(...) ... end).");
  }
  info.interface_id = interface_id;
  info.name = name;
  info.origin = impl.plugin.empty() ? "lua" : impl.plugin;
  if (info.summary.empty()) info.summary = "Provided by the script " + place(L, 1) + ".";

  auto provider = std::make_shared<LuaProvider>();
  provider->calls = impl.calls;
  provider->patience = impl.options.patience;
  provider->interface_id = interface_id;
  provider->name = name;
  provider->tags = info.tags;
  provider->schema = info.schema;
  // A script that is run again replaces what it gave before; a plugin takes no other one's place.
  if (impl.plugin.empty()) withdraw(impl, interface_id, name);
  RMP_TRY(impl.app.registry.add(
      std::move(info),
      [provider, create = adapter->create]() -> Result<void*> { return create(provider); }));
  lua_pushvalue(L, 3);
  provider->ref = luaL_ref(L, LUA_REGISTRYINDEX);
  provider->state = &impl;
  impl.providers.push_back(std::move(provider));
  return 0;
}

Result<int> ioci_withdraw(Impl& impl, lua_State* L) {
  RMP_TRY(script_may(impl, Effect::providers, "ioci.withdraw"));
  const PermitScope own(nullptr);
  RMP_TRY_ASSIGN(const std::string interface_id, need_text(L, 1, "the interface id"));
  RMP_TRY_ASSIGN(const std::string name, need_text(L, 2, "the provider's name"));
  lua_pushboolean(L, withdraw(impl, interface_id, name) ? 1 : 0);
  return 1;
}

}  // namespace

LuaInterfaceFile::LuaInterfaceFile(const char* file, const LuaInterface& entry) {
  adapters().files.emplace_back(file);
  auto& all = adapters().all;
  const std::string_view id = entry.interface_id;
  all.insert(std::find_if(all.begin(), all.end(),
                          [&](const LuaInterface& a) { return a.interface_id >= id; }),
             entry);
}
const std::vector<LuaInterface>& LuaInterfaceFile::all() { return adapters().all; }
const std::vector<std::string>& LuaInterfaceFile::files() { return adapters().files; }

void withdraw_after(Impl& impl, std::size_t keep) {
  while (impl.providers.size() > keep) {
    close(impl, *impl.providers.back());
    impl.providers.pop_back();
  }
}
void withdraw_all(Impl& impl) { withdraw_after(impl, 0); }

void open_providers(Impl&, lua_State* L) {
  lua_pushcfunction(L, entry<ioci_provide>);
  lua_setfield(L, -2, "provide");
  lua_pushcfunction(L, entry<ioci_withdraw>);
  lua_setfield(L, -2, "withdraw");
}

}  // namespace robomosp::lua
