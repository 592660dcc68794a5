// SPDX-License-Identifier: Apache-2.0
// The trampoline between Lua and C++, and the functions that stand for commands. This is the only
// file that raises Lua errors; everything else answers with a Result.
#include <algorithm>
#include <exception>
#include <new>

#include "kernel/text.h"
#include "kernel/type.h"
#include "lua/internal.h"

// What the C++ flavour of Lua throws is a pointer to this; the content is private to Lua. A handler
// needs a complete type, and is matched by the type's name.
struct lua_longjmp {};

namespace robomosp::lua {
namespace {

/// Restores which Lua thread runs.
class Current {
 public:
  Current(Impl& impl, lua_State* L) : slot_(impl.current), before_(impl.current) { slot_ = L; }
  ~Current() { slot_ = before_; }
  Current(const Current&) = delete;
  Current& operator=(const Current&) = delete;

 private:
  lua_State*& slot_;
  lua_State* before_;
};

/// Results pushed, or -1 with an error object on top.
int run_inside(lua_State* L, Function fn) {
  Impl& impl = impl_of(L);
  const Current current(impl, L);
  std::optional<Error> failed;
  try {
    Result<int> r = fn(impl, L);
    if (r.ok()) return *r;
    failed = std::move(r).error();
  } catch (lua_longjmp*) {
    throw;  // Lua's own error on its way to a protected call
  } catch (const std::bad_alloc&) {
    failed = error(ErrorCode::internal, "there is not enough memory",
                   "Free memory, or process less data at once.");
  } catch (const std::exception& e) {
    failed = error(ErrorCode::internal, std::string("an unexpected failure: ") + e.what(),
                   "Please report this.");
  } catch (...) {
    failed =
        error(ErrorCode::internal, "an unexpected failure of unknown kind", "Please report this.");
  }
  // A command that noticed Ctrl-C before the hook did: the script must not go on either.
  if (impl.host.interrupted()) stop_script(impl, L);
  push_error(L, *failed, place(L, 1));
  return -1;
}

int with_traceback(lua_State* L) {
  Impl& impl = impl_of(L);
  luaL_traceback(L, L, nullptr, 1);
  std::size_t length = 0;
  const char* s = lua_tolstring(L, -1, &length);
  std::string_view text(s, length);
  if (text.starts_with("stack traceback:\n")) text.remove_prefix(17);
  impl.traceback.assign(text);
  lua_pop(L, 1);
  return 1;
}

/// Could a table with this key be meant as a pose? A misspelt field counts, too.
bool is_pose_field(const std::string& key, const Schema& params) {
  static const std::vector<std::string> kFields = {
      "position", "cylindrical", "spherical", "rpy", "xyz", "zyz", "quaternion", "axis_angle"};
  if (std::find(kFields.begin(), kFields.end(), key) != kFields.end()) return true;
  std::vector<std::string> names;
  for (const ParamSpec& p : params) names.push_back(p.name);
  return text::nearest(key, kFields) && !text::nearest(key, names);
}

/// Does this only argument give names, or is it the value of the next parameter? A table with
/// names is a value only where a map or a pose is wanted: in "any" no command takes a map, and a
/// misspelt name is to be reported as such.
bool gives_names(lua_State* L, int index, const Schema& params, std::size_t next) {
  if (!lua_istable(L, index)) return false;
  const std::string_view type = next < params.size() ? plain_type(params[next].type) : "";
  bool any = false, known = false, pose = false;
  lua_pushnil(L);
  while (lua_next(L, index) != 0) {
    lua_pop(L, 1);
    if (lua_type(L, -1) != LUA_TSTRING) {
      lua_pop(L, 1);
      return false;
    }
    const std::string_view key = lua_tostring(L, -1);
    any = true;
    known = known || find_param(params, key);
    pose = pose || (type == "pose" && !known && is_pose_field(std::string(key), params));
  }
  return !any || known || !(type == "map" || pose);
}

/// Arguments `first`.. of a call: an optional handle or name for `id`, then either one table of
/// names or values in the order of the schema.
Result<Map> arguments(Impl& impl, lua_State* L, const ioci::CommandSpec& spec, int first) {
  std::optional<Value> id;
  std::size_t next = 0;
  int i = first;
  const int top = lua_gettop(L);
  const bool has_id = !spec.params.empty() && spec.params.front().name == "id";
  if (has_id && i <= top && (handle_kind(L, i) || lua_type(L, i) == LUA_TSTRING)) {
    RMP_TRY_ASSIGN(id, to_value(L, i));
    next = 1;
    ++i;
  }
  if (i == top && gives_names(L, i, spec.params, next)) {
    RMP_TRY(impl.take_functions(L, spec, i));
    RMP_TRY_ASSIGN(Map named, to_map(L, i, 0, &spec.params));
    if (next == 0) return named;
    if (named.find("id"))
      return error(ErrorCode::usage, "id is given twice", "Leave it out of the braces.");
    named.set("id", std::move(*id));
    return named;
  }
  Map args;
  if (id) args.set("id", std::move(*id));
  for (; i <= top; ++i, ++next) {
    if (next >= spec.params.size())
      return error(ErrorCode::usage,
                   "there are more arguments than the " + std::to_string(spec.params.size()) +
                       " that " + spec.name + " takes",
                   "help(\"" + spec.name + "\") lists them.");
    if (lua_isnil(L, i)) continue;
    auto value = argument_value(L, i, spec.params, spec.params[next].name);
    if (!value.ok()) return std::move(value).error().in(spec.params[next].name);
    args.set(spec.params[next].name, std::move(*value));
  }
  return args;
}

Result<int> run_command(Impl& impl, lua_State* L, const ioci::CommandSpec& spec, int first) {
  Result<Value> result = [&]() -> Result<Value> {
    auto args = arguments(impl, L, spec, first);
    if (!args.ok()) return std::move(args).error().in(spec.name);
    return impl.host.dispatch(spec, *args);
  }();
  if (impl.host.revision() != impl.commands) open_new_commands(impl, L);
  if (!result.ok()) return std::move(result).error();
  if (result->is_nil() && spec.returns.type == "nil") return 0;
  push(impl, L, *result, &spec.returns);
  return 1;
}

const ioci::CommandSpec& upvalue_command(lua_State* L) {
  return *static_cast<const ioci::CommandSpec*>(lua_touserdata(L, lua_upvalueindex(1)));
}

/// Upvalues: the CommandSpec, and whether it was taken from a handle.
Result<int> command_function(Impl& impl, lua_State* L) {
  const ioci::CommandSpec& spec = upvalue_command(L);
  if (lua_toboolean(L, lua_upvalueindex(2)) && !handle_kind(L, 1)) {
    const std::string verb = spec.name.substr(spec.name.find('.') + 1);
    return error(ErrorCode::usage, "the method " + verb + " was called without its handle",
                 "Write x:" + verb + "{...} with a colon.", spec.name);
  }
  return run_command(impl, L, spec, 1);
}

/// `robot "pa10"` is `robot.get{name = "pa10"}`; argument 1 is the namespace itself.
Result<int> namespace_call(Impl& impl, lua_State* L) {
  return run_command(impl, L, upvalue_command(L), 2);
}

/// A name that a namespace does not have; upvalue 1 is its name.
Result<int> namespace_missing(Impl& impl, lua_State* L) {
  if (lua_type(L, 2) != LUA_TSTRING) {
    lua_pushnil(L);
    return 1;
  }
  return impl.host.unknown(std::string(lua_tostring(L, lua_upvalueindex(1))) + "." +
                           lua_tostring(L, 2));
}

/// Whether the global of a name is free for a namespace or is one.
bool is_namespace(lua_State* L, const std::string& name) {
  bool is_ours = true;
  if (lua_getglobal(L, name.c_str()) == LUA_TTABLE) {
    is_ours = luaL_getmetafield(L, -1, "__name") == LUA_TSTRING;
    if (is_ours) {
      is_ours = name == lua_tostring(L, -1);
      lua_pop(L, 1);
    }
  } else {
    is_ours = lua_isnil(L, -1);
  }
  lua_pop(L, 1);
  return is_ours;
}

/// Shows one command of the table.
void open_command(Impl& impl, lua_State* L, const ioci::CommandSpec& spec);

/// The namespace table of a prefix, made when it is new, on top of the stack.
void push_namespace(Impl& impl, lua_State* L, const std::string& name) {
  if (lua_getglobal(L, name.c_str()) == LUA_TTABLE) return;
  lua_pop(L, 1);
  lua_newtable(L);
  lua_createtable(L, 0, 3);
  if (const ioci::CommandSpec* get = impl.host.find(name + ".get")) {
    lua_pushlightuserdata(L, const_cast<ioci::CommandSpec*>(get));
    lua_pushcclosure(L, entry<namespace_call>, 1);
    lua_setfield(L, -2, "__call");
  }
  lua_pushstring(L, name.c_str());
  lua_pushvalue(L, -1);
  lua_setfield(L, -3, "__name");
  lua_pushcclosure(L, entry<namespace_missing>, 1);
  lua_setfield(L, -2, "__index");
  lua_setmetatable(L, -2);
  lua_pushvalue(L, -1);
  lua_setglobal(L, name.c_str());
}

Result<std::string> need_text(lua_State* L, int index, const char* what) {
  if (lua_type(L, index) != LUA_TSTRING)
    return error(ErrorCode::invalid_argument,
                 std::string(what) + " must be a text, not a " + luaL_typename(L, index));
  std::size_t length = 0;
  const char* s = lua_tolstring(L, index, &length);
  return std::string(s, length);
}

/// ioci.call(name, {args} | args...)
Result<int> ioci_call(Impl& impl, lua_State* L) {
  RMP_TRY_ASSIGN(const std::string name, need_text(L, 1, "the command's name"));
  const ioci::CommandSpec* spec = impl.host.find(name);
  if (!spec) return impl.host.unknown(name);
  return run_command(impl, L, *spec, 2);
}

/// start(name | command, {args} | args...): the command as a job, whose handle it gives.
Result<int> start(Impl& impl, lua_State* L) {
  const ioci::CommandSpec* spec = command_of(L, 1);
  if (!spec) {
    RMP_TRY_ASSIGN(const std::string name, need_text(L, 1, "the command"));
    spec = impl.host.find(name);
    if (!spec) return impl.host.unknown(name);
  }
  auto args = arguments(impl, L, *spec, 2);
  if (!args.ok()) return std::move(args).error().in(spec->name);
  RMP_TRY_ASSIGN(const Handle job, impl.host.dispatch_async(*spec, std::move(*args)));
  push_handle(impl, L, job);
  return 1;
}

/// ioci.classic "PRobot pa10 mGetDHP"
Result<int> ioci_classic(Impl& impl, lua_State* L) {
  RMP_TRY_ASSIGN(const std::string line, need_text(L, 1, "the classic line"));
  Result<Value> result = impl.host.dispatch_classic(line);
  if (!result.ok()) return std::move(result).error();
  push(impl, L, *result);
  return 1;
}

/// ioci.transaction([label,] fn): all edits of fn are one undo step; an error undoes them.
Result<int> ioci_transaction(Impl& impl, lua_State* L) {
  std::string label = "script";
  if (lua_type(L, 1) == LUA_TSTRING) {
    label = lua_tostring(L, 1);
    lua_remove(L, 1);
  }
  if (!lua_isfunction(L, 1))
    return error(ErrorCode::invalid_argument, "a transaction needs a function",
                 "Write ioci.transaction(\"label\", function() ... end).");
  lua_settop(L, 1);
  bool script_failed = false;
  const auto done = impl.host.transaction(label, [&]() -> Result<void> {
    if (protected_call(impl, L, 0, LUA_MULTRET) == LUA_OK) return {};
    script_failed = true;
    return to_error(L, -1);
  });
  if (done.ok()) return lua_gettop(L);
  // A script's own error goes on as the object it was.
  if (script_failed) return kRaiseTop;
  return done.error();
}

}  // namespace

int enter(lua_State* L, Function fn) {
  const int pushed = run_inside(L, fn);
  return pushed < 0 ? lua_error(L) : pushed;
}

int protected_call(Impl& impl, lua_State* L, int arguments, int results) {
  const int base = lua_gettop(L) - arguments;
  if (!lua_checkstack(L, 4)) {
    lua_settop(L, base - 1);
    push_error(
        L, error(ErrorCode::script_failed, "the Lua stack is full", "Reduce the call depth."), {});
    return LUA_ERRRUN;
  }
  lua_pushcfunction(L, with_traceback);
  lua_insert(L, base);
  const int status = lua_pcall(L, arguments, results, base);
  lua_remove(L, base);
  if (status == LUA_ERRMEM && !lua_isstring(L, -1)) {
    lua_pop(L, 1);
    lua_pushliteral(L, "not enough memory");
  }
  (void)impl;
  return status;
}

Result<void> call(Impl& impl, lua_State* L, int arguments, int results) {
  const int base = lua_gettop(L) - arguments - 1;
  const int status = protected_call(impl, L, arguments, results);
  if (status == LUA_OK) return {};
  Error e = to_error(L, -1);
  if (status == LUA_ERRMEM)
    e = error(ErrorCode::script_failed,
              "the script needs more memory than its " +
                  std::to_string(impl.options.memory_limit >> 20) + " MiB",
              "Keep less data in tables at once.");
  lua_settop(L, base);
  return e;
}

void push_command(lua_State* L, const ioci::CommandSpec& spec, bool is_method) {
  lua_pushlightuserdata(L, const_cast<ioci::CommandSpec*>(&spec));
  lua_pushboolean(L, is_method ? 1 : 0);
  lua_pushcclosure(L, entry<command_function>, 2);
}

const ioci::CommandSpec* command_of(lua_State* L, int index) {
  if (lua_tocfunction(L, index) != static_cast<lua_CFunction>(entry<command_function>))
    return nullptr;
  if (!lua_getupvalue(L, index, 1)) return nullptr;
  const auto* spec = static_cast<const ioci::CommandSpec*>(lua_touserdata(L, -1));
  lua_pop(L, 1);
  return spec;
}

namespace {

void open_command(Impl& impl, lua_State* L, const ioci::CommandSpec& spec) {
  const auto dot = spec.name.find('.');
  if (dot == std::string::npos) {
    push_command(L, spec, false);
    lua_setglobal(L, spec.name.c_str());
    return;
  }
  const std::string name = spec.name.substr(0, dot);
  if (!spec.plugin.empty() && !is_namespace(L, name)) {
    impl.host.warn("command_hidden", "The command " + spec.name + " of the plugin " +
                                         text::quote(spec.plugin) +
                                         " has no global name here, since " + name +
                                         " is something else; ioci.call(" + text::quote(spec.name) +
                                         ", ...) runs it.");
    return;
  }
  push_namespace(impl, L, name);
  push_command(L, spec, false);
  lua_setfield(L, -2, spec.name.c_str() + dot + 1);
  lua_pop(L, 1);
}

}  // namespace

void open_new_commands(Impl& impl, lua_State* L) {
  impl.commands = impl.host.revision();
  for (const ioci::CommandSpec* spec : impl.host.list()) {
    if (spec->plugin.empty()) continue;
    const auto dot = spec->name.find('.');
    const std::string name = spec->name.substr(0, dot);
    // Those that are there stay as a script may have left them.
    const int top = lua_gettop(L);
    bool is_there = false;
    if (lua_getglobal(L, name.c_str()) == LUA_TTABLE && is_namespace(L, name)) {
      lua_pushstring(L, spec->name.c_str() + dot + 1);
      is_there = lua_rawget(L, -2) != LUA_TNIL;
    }
    lua_settop(L, top);
    if (is_there) continue;
    open_command(impl, L, *spec);
    add_method(impl, L, *spec);
  }
}

void open_commands(Impl& impl, lua_State* L) {
  impl.commands = impl.host.revision();
  for (const ioci::CommandSpec* spec : impl.host.list()) open_command(impl, L, *spec);
  lua_pushcfunction(L, entry<start>);
  lua_setglobal(L, "start");
  push_namespace(impl, L, "ioci");
  lua_pushcfunction(L, entry<ioci_call>);
  lua_setfield(L, -2, "call");
  lua_pushcfunction(L, entry<ioci_classic>);
  lua_setfield(L, -2, "classic");
  lua_pushcfunction(L, entry<ioci_transaction>);
  lua_setfield(L, -2, "transaction");
  lua_pop(L, 1);
}

}  // namespace robomosp::lua
