// SPDX-License-Identifier: Apache-2.0
// Handles of records, recordings and jobs as userdata whose methods are the commands of their kind.
#include <algorithm>

#include "kernel/text.h"
#include "lua/internal.h"

namespace robomosp::lua {
namespace {

const char kKindKey = 0;           // in a handle's metatable: its KindInfo
const char kHandleMethodsKey = 0;  // in a handle's metatable: table of methods

Handle checked_handle(lua_State* L, int index) {
  const auto h = handle_at(L, index);
  return h ? *h : Handle{};
}

/// `h.name`, `h.kind`, `h.number`, `h.exists`, or a method; upvalue 1 is the table of methods.
Result<int> index_handle(Impl& impl, lua_State* L) {
  lua_pushvalue(L, 2);
  if (lua_rawget(L, lua_upvalueindex(1)) != LUA_TNIL) return 1;
  const Handle h = checked_handle(L, 1);
  const std::string_view key =
      lua_type(L, 2) == LUA_TSTRING ? std::string_view(lua_tostring(L, 2)) : std::string_view();
  if (key == "kind") {
    lua_pushlstring(L, h.kind.data(), h.kind.size());
    return 1;
  }
  if (key == "number") {
    lua_pushinteger(L, static_cast<lua_Integer>(h.number));
    return 1;
  }
  const auto name = impl.host.name_of(h);
  if (key == "exists") {
    lua_pushboolean(L, name ? 1 : 0);
    return 1;
  }
  if (key == "name") {
    if (!name)
      return error(ErrorCode::stale_handle, impl.host.describe(h) + " no longer exists",
                   "Get a new handle by name.");
    lua_pushlstring(L, name->data(), name->size());
    return 1;
  }
  std::string hint = impl.host.unknown(h.kind + "." + std::string(key)).hint;
  // Of a method the topic is known.
  for (std::size_t at = 0; (at = hint.find("\"" + h.kind + ".")) != std::string::npos;)
    hint.erase(at + 1, h.kind.size() + 1);
  if (!hint.starts_with("Did you mean")) {
    const std::vector<std::string> known = method_names(impl, h.kind);
    hint = text::did_you_mean(key, known);
  }
  if (hint.empty()) hint = "help(x) lists the methods of x.";
  return error(ErrorCode::unknown_name, "a " + h.kind + " has no method " + text::quote(key),
               std::move(hint), impl.host.describe(h));
}

Result<int> assign_handle(Impl& impl, lua_State* L) {
  const Handle h = checked_handle(L, 1);
  return error(ErrorCode::invalid_argument, "fields of a " + h.kind + " cannot be assigned",
               "Edit it with a command, for example x:set{...}; help(x) lists them.",
               impl.host.describe(h));
}

Result<int> equal_handles(Impl&, lua_State* L) {
  const auto a = handle_at(L, 1), b = handle_at(L, 2);
  lua_pushboolean(L, a && b && *a == *b ? 1 : 0);
  return 1;
}

Result<int> handle_text(Impl& impl, lua_State* L) {
  const std::string s = impl.host.describe(checked_handle(L, 1));
  lua_pushlstring(L, s.data(), s.size());
  return 1;
}

/// Makes the metatable of a kind and leaves it on the stack.
void make_metatable(Impl& impl, lua_State* L, KindInfo& info) {
  lua_createtable(L, 0, 8);
  lua_pushlightuserdata(L, &info);
  lua_rawsetp(L, -2, &kKindKey);

  lua_newtable(L);
  for (const ioci::CommandSpec* spec : impl.host.methods_of(info.kind)) {
    push_command(L, *spec, true);
    lua_setfield(L, -2, spec->name.c_str() + info.kind.size() + 1);
  }
  lua_pushvalue(L, -1);
  lua_rawsetp(L, -3, &kHandleMethodsKey);
  lua_pushcclosure(L, entry<index_handle>, 1);
  lua_setfield(L, -2, "__index");
  lua_pushcfunction(L, entry<assign_handle>);
  lua_setfield(L, -2, "__newindex");
  lua_pushcfunction(L, entry<equal_handles>);
  lua_setfield(L, -2, "__eq");
  lua_pushcfunction(L, entry<handle_text>);
  lua_setfield(L, -2, "__tostring");
  lua_pushstring(L, info.kind.c_str());
  lua_setfield(L, -2, "__name");
  lua_pushliteral(L, "handle");
  lua_setfield(L, -2, "__metatable");
  lua_pushvalue(L, -1);
  lua_rawsetp(L, LUA_REGISTRYINDEX, &info);
}

}  // namespace

const KindInfo* handle_kind(lua_State* L, int index) {
  if (lua_type(L, index) != LUA_TUSERDATA || lua_getmetatable(L, index) == 0) return nullptr;
  lua_rawgetp(L, -1, &kKindKey);
  const auto* info = static_cast<const KindInfo*>(lua_touserdata(L, -1));
  lua_pop(L, 2);
  return info;
}

std::optional<Handle> handle_at(lua_State* L, int index) {
  const KindInfo* info = handle_kind(L, index);
  if (!info) return std::nullopt;
  return Handle{info->kind, static_cast<const HandleBox*>(lua_touserdata(L, index))->number};
}

void push_handle(Impl& impl, lua_State* L, const Handle& handle) {
  auto& info = impl.kinds[handle.kind];
  if (!info) info = std::make_unique<KindInfo>(KindInfo{handle.kind});
  auto* box = static_cast<HandleBox*>(lua_newuserdatauv(L, sizeof(HandleBox), 0));
  box->number = handle.number;
  if (lua_rawgetp(L, LUA_REGISTRYINDEX, info.get()) != LUA_TTABLE) {
    lua_pop(L, 1);
    make_metatable(impl, L, *info);
  }
  lua_setmetatable(L, -2);
}

void add_method(Impl& impl, lua_State* L, const ioci::CommandSpec& spec) {
  const auto dot = spec.name.find('.');
  const auto kind = impl.kinds.find(std::string_view(spec.name).substr(0, dot));
  if (kind == impl.kinds.end() || spec.params.empty() || spec.params.front().name != "id") return;
  if (lua_rawgetp(L, LUA_REGISTRYINDEX, kind->second.get()) == LUA_TTABLE) {
    lua_rawgetp(L, -1, &kHandleMethodsKey);
    push_command(L, spec, true);
    lua_setfield(L, -2, spec.name.c_str() + dot + 1);
    lua_pop(L, 1);
  }
  lua_pop(L, 1);
}

std::vector<std::string> method_names(const Impl& impl, std::string_view kind) {
  std::vector<std::string> out;
  for (const ioci::CommandSpec* spec : impl.host.methods_of(kind))
    out.push_back(spec->name.substr(kind.size() + 1));
  return out;
}

}  // namespace robomosp::lua
