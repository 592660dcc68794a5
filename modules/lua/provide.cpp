// SPDX-License-Identifier: Apache-2.0
// Solvers written in Lua: ioci.provide and ioci.withdraw. The adapters (provide_*.cpp) answer on
// the thread of their script; what a script returns is checked before anything uses it.
#include <algorithm>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

#include "ioci/core/kept_solvers.h"
#include "kernel/file_root.h"
#include "kernel/interface_adapters.h"
#include "kernel/permit.h"
#include "kernel/text.h"
#include "lua/kept_scripts.h"
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

Result<std::string> need_field_text(lua_State* L, int index, const char* what) {
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
    if (find_param(schema, p.name))
      return error(ErrorCode::invalid_argument,
                   "params has two entries named " + text::quote(p.name),
                   "Give each parameter a name that no other one has.");
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

void close(ProgramState& impl, LuaProvider& p) {
  impl.app.registry.remove(p.interface_id, p.name);
  luaL_unref(impl.main, LUA_REGISTRYINDEX, p.ref);
  for (const int value : p.values) luaL_unref(impl.main, LUA_REGISTRYINDEX, value);
  p.values.clear();
  p.ref = LUA_NOREF;
  p.state = nullptr;
}

bool withdraw(ProgramState& impl, std::string_view interface_id, std::string_view name) {
  const auto it =
      std::find_if(impl.providers.begin(), impl.providers.end(), [&](const ProviderPtr& p) {
        return p->interface_id == current_interface(interface_id) && p->name == name;
      });
  if (it == impl.providers.end()) return false;
  withdraw_at(impl, static_cast<std::size_t>(it - impl.providers.begin()));
  return true;
}

constexpr std::uint64_t kMostSource = std::uint64_t{64} << 20;  // [bytes]

/// The text of the script that calls from `level`; "" = not known.
std::string source_text(const Impl& impl, lua_State* L, int level) {
  lua_Debug caller;
  if (!lua_getstack(L, level, &caller) || !lua_getinfo(L, "S", &caller)) return {};
  const std::string chunk(caller.source, caller.srclen);
  if (const auto known = impl.sources.find(chunk); known != impl.sources.end())
    return known->second;
  if (!chunk.starts_with("@")) return {};
  if (!program_of(impl).session.may(Effect::files_read)) return {};
  const SessionFiles files(impl);
  auto text = read_permitted(chunk.substr(1), kMostSource);  // of dofile() and require()
  return text.ok() ? std::move(*text) : std::string();
}

/// ioci.provide(interface_id, name, fn | {fn fields, summary =, tags =, params =})
Result<int> ioci_provide(Impl& any, lua_State* L) {
  ProgramState& impl = program_of(any);
  RMP_TRY(script_may(impl, Effect::providers, "ioci.provide"));
  const PermitScope own(nullptr);
  RMP_TRY_ASSIGN(const std::string interface_id, need_field_text(L, 1, "the interface id"));
  RMP_TRY_ASSIGN(const std::string name, need_field_text(L, 2, "the provider's name"));
  ProviderSource source;
  source.origin = impl.plugin.empty() ? "lua" : impl.plugin;
  source.summary = "Provided by the script " + place(L, 1) + ".";
  source.text = source_text(impl, L, 1);
  // What is wrong is said before anything is taken away.
  source.only_checks = true;
  RMP_TRY(add_provider(impl, L, interface_id, name, 3, source));
  source.only_checks = false;
  // A script that is run again replaces what it gave before; a plugin takes no other one's place.
  if (impl.plugin.empty()) withdraw(impl, interface_id, name);
  std::string text = source.text;
  RMP_TRY(add_provider(impl, L, interface_id, name, 3, std::move(source)));
  impl.app.kept_solvers->note_source(current_interface(interface_id), name, std::move(text));
  return 0;
}

Result<int> ioci_withdraw(Impl& any, lua_State* L) {
  ProgramState& impl = program_of(any);
  RMP_TRY(script_may(impl, Effect::providers, "ioci.withdraw"));
  const PermitScope own(nullptr);
  RMP_TRY_ASSIGN(const std::string interface_id, need_field_text(L, 1, "the interface id"));
  RMP_TRY_ASSIGN(const std::string name, need_field_text(L, 2, "the provider's name"));
  lua_pushboolean(L, withdraw(impl, interface_id, name) ? 1 : 0);
  impl.kept->look_again();
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

Result<void> add_provider(Impl& impl, lua_State* L, const std::string& given_id,
                          const std::string& name, int index, ProviderSource source) {
  const auto& known = LuaInterfaceFile::all();
  const auto adapter = std::find_if(known.begin(), known.end(), [&](const LuaInterface& a) {
    // What a script gives is the same for every number of an interface.
    return current_interface(given_id) == a.interface_id;
  });
  if (adapter == known.end()) {
    std::vector<std::string> ids;
    for (const LuaInterface& a : known) ids.emplace_back(a.interface_id);
    return error(ErrorCode::unknown_name,
                 text::quote(given_id) + " is not an interface that Lua can provide",
                 text::did_you_mean(given_id, ids) + (text::nearest(given_id, ids) ? " " : "") +
                     "Interfaces: " + text::enumerate(ids) + ".");
  }
  const std::string interface_id = adapter->interface_id;
  ProviderInfo info;
  if (lua_istable(L, index)) {
    lua_getfield(L, index, adapter->function);
    const bool has_function = lua_isfunction(L, -1);
    lua_pop(L, 1);
    if (!has_function)
      return error(ErrorCode::invalid_argument,
                   "the table has no function " + std::string(adapter->function),
                   "Write {" + std::string(adapter->function) + " = function(...) ... end}.");
    lua_getfield(L, index, "summary");
    if (lua_type(L, -1) == LUA_TSTRING) info.summary = lua_tostring(L, -1);
    lua_pop(L, 1);
    RMP_TRY_ASSIGN(info.schema, read_schema(L, index));
    RMP_TRY_ASSIGN(info.tags, read_tags(L, index));
    if (lua_getfield(L, index, "branches") != LUA_TNIL &&
        std::find(info.tags.begin(), info.tags.end(), "branches") == info.tags.end())
      info.tags.emplace_back("branches");
    lua_pop(L, 1);
  } else if (!lua_isfunction(L, index)) {
    return error(
        ErrorCode::invalid_argument,
        std::string("a provider is a function or a table of functions, not a ") +
            luaL_typename(L, index),
        "Write ioci.provide(\"" + interface_id + "\", \"" + name + "\", function(...) ... end).");
  }
  if (source.only_checks) return {};
  info.interface_id = interface_id;
  info.name = name;
  info.origin = source.origin;
  info.is_script = true;
  if (info.summary.empty()) info.summary = std::move(source.summary);

  auto provider = std::make_shared<LuaProvider>();
  provider->calls = impl.calls;
  provider->patience = impl.options.patience;
  provider->interface_id = interface_id;
  provider->name = name;
  provider->tags = info.tags;
  provider->schema = info.schema;
  provider->origin = std::move(source.origin);
  provider->source = std::move(source.text);
  provider->is_kept = source.is_kept;
  RMP_TRY(program_of(impl).app.registry.add(
      std::move(info),
      [provider, create = adapter->create]() -> Result<void*> { return create(provider); }));
  lua_pushvalue(L, index);
  provider->ref = luaL_ref(L, LUA_REGISTRYINDEX);
  provider->state = &impl;
  program_of(impl).providers.push_back(std::move(provider));
  return {};
}

void withdraw_at(Impl& any, std::size_t place) {
  ProgramState& impl = program_of(any);
  close(impl, *impl.providers[place]);
  impl.providers.erase(impl.providers.begin() + static_cast<std::ptrdiff_t>(place));
}

void withdraw_after(Impl& any, std::size_t keep) {
  ProgramState& impl = program_of(any);
  while (impl.providers.size() > keep) {
    close(impl, *impl.providers.back());
    impl.providers.pop_back();
  }
}
void withdraw_all(Impl& impl) { withdraw_after(impl, 0); }

void open_providers(Impl&, lua_State* L) {
  lua_getglobal(L, "ioci");
  lua_pushcfunction(L, entry<ioci_provide>);
  lua_setfield(L, -2, "provide");
  lua_pushcfunction(L, entry<ioci_withdraw>);
  lua_setfield(L, -2, "withdraw");
  lua_pop(L, 1);
}

}  // namespace robomosp::lua
