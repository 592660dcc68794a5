// SPDX-License-Identifier: Apache-2.0
// Value <-> Lua, and Error <-> error objects.
#include <algorithm>
#include <iterator>
#include <limits>

#include "kernel/fault.h"
#include "kernel/text.h"
#include "kernel/type.h"
#include "lua/internal.h"
#include "lua/pretty.h"
#include "lua/terminal_text.h"

namespace robomosp::lua {
namespace {

const char kReturnsKey = 0;  // in a result table's metatable: its ReturnSpec
const char kErrorKey = 0;    // in the registry: metatable of error objects

std::string type_text(lua_State* L, int index) { return luaL_typename(L, index); }

/// How the keys of a table look.
struct Keys {
  std::size_t strings = 0, integers = 0;
  lua_Integer greatest = 0;
  bool has_other = false;
  std::string other;  ///< type of the first key that is neither
};

Keys keys_of(lua_State* L, int table) {
  Keys k;
  lua_pushnil(L);
  while (lua_next(L, table) != 0) {
    if (lua_type(L, -2) == LUA_TSTRING) {
      ++k.strings;
    } else if (lua_isinteger(L, -2) && lua_tointeger(L, -2) >= 1) {
      ++k.integers;
      k.greatest = std::max(k.greatest, lua_tointeger(L, -2));
    } else if (!k.has_other) {
      k.has_other = true;
      k.other =
          lua_type(L, -2) == LUA_TNUMBER ? "number that is not 1, 2, 3, ..." : type_text(L, -2);
    }
    lua_pop(L, 1);
  }
  return k;
}

Error bad_value(std::string message, std::string hint) {
  return error(ErrorCode::invalid_argument, std::move(message), std::move(hint));
}

/// Of all texts in one value. A table names a text as often as it likes at no cost; a value has a
/// copy for each.
constexpr std::size_t kMostText = std::size_t{64} << 20;
thread_local std::size_t t_text = 0;

Result<Value> list_from(lua_State* L, int table, std::size_t count, int depth) {
  List list;
  list.reserve(count);
  for (std::size_t i = 1; i <= count; ++i) {
    lua_rawgeti(L, table, static_cast<lua_Integer>(i));
    auto item = to_value(L, lua_gettop(L), depth + 1);
    lua_pop(L, 1);
    if (!item.ok()) return std::move(item).error().in("[" + std::to_string(i) + "]");
    list.push_back(std::move(*item));
  }
  return Value(std::move(list));
}

/// What a script shows its object as: the text __shown of the metatable. scripts/lib/remote.lua
/// says so of what stands for another program's things. nullopt for tables without.
std::optional<std::string> shown_as(lua_State* L, int table) {
  if (!lua_checkstack(L, 3) || lua_getmetatable(L, table) == 0) return std::nullopt;
  lua_pushliteral(L, "__shown");
  lua_rawget(L, -2);
  std::optional<std::string> text;
  std::size_t length = 0;
  if (lua_type(L, -1) == LUA_TSTRING)
    if (const char* s = lua_tolstring(L, -1, &length)) text.emplace(s, length);
  lua_pop(L, 2);
  return text;
}

Result<Value> table_to_value(lua_State* L, int table, int depth) {
  if (const auto object = shown_as(L, table))
    return bad_value(*object + " is unknown to this program", "Give a name, or its content.");
  if (depth >= kDeepestValue)
    return bad_value("the table is nested deeper than " + std::to_string(kDeepestValue) +
                         " levels or contains itself",
                     "Give a flatter table.");
  if (!lua_checkstack(L, 6)) return bad_value("the Lua stack is full", "Give a flatter table.");
  const Keys keys = keys_of(L, table);
  if (keys.has_other)
    return bad_value("a table has a key that is a " + keys.other,
                     "Use names or the numbers 1, 2, 3, ... as keys.");
  if (keys.strings > 0 && keys.integers > 0)
    return bad_value("a table mixes named and numbered entries",
                     "Give either a list {1, 2, 3} or named values {a = 1, b = 2}.");
  if (keys.strings > 0) {
    auto map = to_map(L, table, depth);
    if (!map.ok()) return std::move(map).error();
    return Value(std::move(*map));
  }
  if (keys.greatest != static_cast<lua_Integer>(keys.integers))
    return bad_value("a list has holes: it has " + std::to_string(keys.integers) +
                         " entries, the last one is number " + std::to_string(keys.greatest),
                     "Number the entries 1, 2, 3, ... without nil between.");
  return list_from(L, table, keys.integers, depth);
}

/// Tables of fewer rows are values like others.
constexpr std::size_t kManyRows = 16;

/// The numbers of a plain table with the keys 1, 2, 3, ... in that order, appended to `out`; their
/// count, 0 for any other table. The stack stays as it was.
std::size_t append_numbers(lua_State* L, int table, std::vector<double>& out) {
  if (lua_type(L, table) != LUA_TTABLE || lua_getmetatable(L, table) != 0) {
    if (lua_type(L, table) == LUA_TTABLE) lua_pop(L, 1);
    return 0;
  }
  lua_Integer count = 0;
  lua_pushnil(L);
  while (lua_next(L, table) != 0) {
    if (!lua_isinteger(L, -2) || lua_tointeger(L, -2) != count + 1 ||
        lua_type(L, -1) != LUA_TNUMBER) {
      lua_pop(L, 2);
      return 0;
    }
    out.push_back(lua_tonumber(L, -1));
    lua_pop(L, 1);
    ++count;
  }
  return static_cast<std::size_t>(count);
}

/// A table of kManyRows rows and more, each of as many numbers, as a matrix: a value for every
/// number would take ten times as long. nullopt for any other table, which to_value() reads.
std::optional<Value> many_rows(lua_State* L, int index) {
  const int table = lua_absindex(L, index);
  if (lua_type(L, table) != LUA_TTABLE || lua_rawlen(L, table) < kManyRows || !lua_checkstack(L, 8))
    return std::nullopt;
  if (lua_getmetatable(L, table) != 0) {
    lua_pop(L, 1);
    return std::nullopt;
  }
  std::vector<double> numbers;
  std::size_t rows = 0, width = 0;
  lua_pushnil(L);
  while (lua_next(L, table) != 0) {
    const bool is_next =
        lua_isinteger(L, -2) && lua_tointeger(L, -2) == static_cast<lua_Integer>(rows + 1);
    const std::size_t count = is_next ? append_numbers(L, lua_gettop(L), numbers) : 0;
    if (rows == 0 && count > 0) {
      width = count;
      numbers.reserve(width * static_cast<std::size_t>(lua_rawlen(L, table)));
    }
    if (count == 0 || count != width) {
      lua_pop(L, 2);
      return std::nullopt;
    }
    lua_pop(L, 1);
    ++rows;
  }
  return Value(NumericArray(std::move(numbers), rows, width));
}

/// Whether rows of numbers may be given for a parameter: quantities whose form depends on the
/// robot, such as q, qd and tau.
bool takes_rows(const Schema* params, std::string_view name) {
  if (!params) return false;
  const ParamSpec* at = find_param(*params, name);
  return at && plain_type(at->type) == "any" && !at->unit.empty();
}

}  // namespace

Result<Value> argument_value(lua_State* L, int index, const Schema& params, std::string_view name) {
  if (takes_rows(&params, name))
    if (auto matrix = many_rows(L, index)) return std::move(*matrix);
  return to_value(L, index);
}

Result<Map> to_map(lua_State* L, int index, int depth, const Schema* params) {
  const int table = lua_absindex(L, index);
  if (depth == 0) t_text = 0;
  if (depth >= kDeepestValue || !lua_checkstack(L, 6))
    return bad_value("the table is nested deeper than " + std::to_string(kDeepestValue) +
                         " levels or contains itself",
                     "Give a flatter table.");
  Map map;
  bool is_sorted = true;
  lua_pushnil(L);
  while (lua_next(L, table) != 0) {
    if (lua_type(L, -2) != LUA_TSTRING) {
      const std::string type = type_text(L, -2);
      lua_pop(L, 2);
      return bad_value("named values are expected and one key is a " + type, "Write name = value.");
    }
    std::size_t length = 0;
    const char* key = lua_tolstring(L, -2, &length);
    std::string name(key, length);
    std::optional<Value> matrix;
    if (takes_rows(params, name)) matrix = many_rows(L, -1);
    auto item = matrix ? Result<Value>(std::move(*matrix)) : to_value(L, lua_gettop(L), depth + 1);
    if (!item.ok()) {
      lua_pop(L, 2);
      return std::move(item).error().in(name);
    }
    is_sorted = is_sorted && (map.empty() || std::prev(map.end())->first < name);
    map.append(std::move(name), std::move(*item));  // a table has each key once
    lua_pop(L, 1);
  }
  if (is_sorted) return map;
  // Lua's order of keys differs from run to run; logs and files must not.
  constexpr std::size_t kFew = 64;  // a map looks for each name one by one
  Map sorted;
  if (map.size() <= kFew) {
    std::vector<std::string> names;
    names.reserve(map.size());
    for (const auto& [name, value] : map) names.push_back(name);
    std::sort(names.begin(), names.end());
    for (std::string& name : names) {
      Value value = std::move(*map.find(name));
      sorted.append(std::move(name), std::move(value));
    }
    return sorted;
  }
  std::vector<Map::Entry> entries(map.begin(), map.end());
  std::sort(entries.begin(), entries.end(),
            [](const auto& a, const auto& b) { return a.first < b.first; });
  for (auto& [name, value] : entries) sorted.append(std::move(name), std::move(value));
  return sorted;
}

Result<Value> to_value(lua_State* L, int index, int depth) {
  index = lua_absindex(L, index);
  if (depth == 0) t_text = 0;
  switch (lua_type(L, index)) {
    case LUA_TNIL:
    case LUA_TNONE: return Value();
    case LUA_TBOOLEAN: return Value(lua_toboolean(L, index) != 0);
    case LUA_TNUMBER:
      if (lua_isinteger(L, index)) return Value(static_cast<std::int64_t>(lua_tointeger(L, index)));
      return Value(static_cast<double>(lua_tonumber(L, index)));
    case LUA_TSTRING: {
      std::size_t length = 0;
      const char* s = lua_tolstring(L, index, &length);
      t_text += length;
      if (t_text > kMostText)
        return bad_value("the texts have more than 64 MiB together", "Put them into files.");
      return Value(std::string(s, length));
    }
    case LUA_TUSERDATA:
      if (const ArrayBox* a = array_at(L, index)) return Value(a->value());
      if (auto h = handle_at(L, index)) return Value(std::move(*h));
      return bad_value("a userdata of another library cannot be given to a command",
                       "Give numbers, texts, tables or handles.");
    case LUA_TTABLE: return table_to_value(L, index, depth);
    default:
      return bad_value("a " + type_text(L, index) + " cannot be given to a command",
                       "Give numbers, texts, tables or handles.");
  }
}

Result<std::vector<double>> to_reals(lua_State* L, int index, std::string_view what) {
  index = lua_absindex(L, index);
  std::vector<double> out;
  if (const ArrayBox* a = array_at(L, index)) {
    if (a->is_matrix()) return std::vector<double>(a->source.data());
    out.reserve(a->length());
    for (std::size_t i = 0; i < a->length(); ++i) out.push_back(a->entry(i));
    return out;
  }
  if (!lua_istable(L, index))
    return bad_value(std::string(what) + " is a " + type_text(L, index) + ", not a list of numbers",
                     "Give numbers such as {1, 2, 3}.");
  const auto count = lua_rawlen(L, index);
  out.reserve(count);
  for (lua_Unsigned i = 1; i <= count; ++i) {
    const int type = lua_rawgeti(L, index, static_cast<lua_Integer>(i));
    const double v = lua_tonumber(L, -1);
    lua_pop(L, 1);
    if (type != LUA_TNUMBER)
      return bad_value(
          std::string(what) + " has an entry [" + std::to_string(i) + "] that is not a number",
          "Give numbers such as {1, 2, 3}.");
    out.push_back(v);
  }
  return out;
}

namespace {

Result<int> result_text(Impl& impl, lua_State* L) {
  const std::string text = pretty_of(impl, L, 1, Shown::as_text);
  lua_pushlstring(L, text.data(), text.size());
  return 1;
}

/// Pushes the metatable that remembers a ReturnSpec; made once for each.
void push_result_metatable(lua_State* L, const ioci::ReturnSpec* returns) {
  if (lua_rawgetp(L, LUA_REGISTRYINDEX, returns) == LUA_TTABLE) return;
  lua_pop(L, 1);
  lua_createtable(L, 0, 3);
  lua_pushlightuserdata(L, const_cast<ioci::ReturnSpec*>(returns));
  lua_rawsetp(L, -2, &kReturnsKey);
  lua_pushcfunction(L, entry<result_text>);
  lua_setfield(L, -2, "__tostring");
  lua_pushvalue(L, -1);
  lua_rawsetp(L, LUA_REGISTRYINDEX, returns);
}

std::string_view field_unit(const ioci::ReturnSpec* returns, std::string_view name) {
  if (!returns) return {};
  for (const ParamSpec& f : returns->fields)
    if (f.name == name) return f.unit;
  return {};
}

void push_any(Impl& impl, lua_State* L, const Value& v, const ioci::ReturnSpec* returns,
              std::string_view unit);

void push_map(Impl& impl, lua_State* L, const Map& map, const ioci::ReturnSpec* returns) {
  lua_createtable(L, 0, static_cast<int>(map.size()));
  for (const auto& [key, value] : map) {
    lua_pushlstring(L, key.data(), key.size());
    push_any(impl, L, value, nullptr, field_unit(returns, key));
    lua_rawset(L, -3);
  }
}

void push_any(Impl& impl, lua_State* L, const Value& v, const ioci::ReturnSpec* returns,
              std::string_view unit) {
  luaL_checkstack(L, 8, "a value is nested too deep");
  switch (v.type()) {
    case Value::Type::nil: lua_pushnil(L); return;
    case Value::Type::boolean: lua_pushboolean(L, *v.as_bool() ? 1 : 0); return;
    case Value::Type::integer: lua_pushinteger(L, *v.as_int()); return;
    case Value::Type::real: lua_pushnumber(L, *v.as_real()); return;
    case Value::Type::string:
      lua_pushlstring(L, v.as_string()->data(), v.as_string()->size());
      return;
    case Value::Type::array: push_array(impl, L, *v.as_array(), unit); return;
    case Value::Type::handle: push_handle(impl, L, *v.as_handle()); return;
    case Value::Type::map: push_map(impl, L, *v.as_map(), returns); break;
    case Value::Type::list: {
      const List& list = *v.as_list();
      lua_createtable(L, static_cast<int>(std::min<std::size_t>(list.size(), 1U << 26)), 0);
      lua_Integer i = 0;
      for (const Value& item : list) {
        push_any(impl, L, item, item.as_map() ? returns : nullptr, unit);
        lua_rawseti(L, -2, ++i);
      }
      break;
    }
  }
  if (returns && !returns->fields.empty()) {
    push_result_metatable(L, returns);
    lua_setmetatable(L, -2);
  }
}

}  // namespace

namespace {

/// Lua begins to collect when memory has grown by the part that its pause says, 200 % by itself.
/// Answers with thousands of rows are tables, arrays and handles by the hundred thousand, of which
/// each collection marks and sweeps all: 10,000 objects of a world took 14 times as long as 1,000
/// by themselves, and 25 times with it. A state that is small within its limit waits longer.
void pace_collector(Impl& impl, lua_State* L) {
  constexpr std::size_t kSmallPart = 16;
  constexpr int kLongPause = 400, kPause = 200;  // [%]
  const bool is_small = impl.used + impl.external < impl.options.memory_limit / kSmallPart;
  if (is_small == impl.is_collected_rarely) return;
  impl.is_collected_rarely = is_small;
  lua_gc(L, LUA_GCSETPAUSE, is_small ? kLongPause : kPause);
}

}  // namespace

void push(Impl& impl, lua_State* L, const Value& value, const ioci::ReturnSpec* returns) {
  pace_collector(impl, L);
  push_any(impl, L, value, returns, returns ? std::string_view(returns->unit) : std::string_view());
}

const ioci::ReturnSpec* returns_of(lua_State* L, int index) {
  if (!lua_istable(L, index) || lua_getmetatable(L, index) == 0) return nullptr;
  lua_rawgetp(L, -1, &kReturnsKey);
  const auto* returns = static_cast<const ioci::ReturnSpec*>(lua_touserdata(L, -1));
  lua_pop(L, 2);
  return returns;
}

// --- errors
// ---------------------------------------------------------------------------------------

namespace {

std::string string_field(lua_State* L, int table, const char* name) {
  lua_pushstring(L, name);
  lua_rawget(L, table);
  std::size_t length = 0;
  const char* s = lua_type(L, -1) == LUA_TSTRING ? lua_tolstring(L, -1, &length) : nullptr;
  std::string out = s ? std::string(s, length) : std::string();
  lua_pop(L, 1);
  return out;
}

/// "box.lua:12: text" -> {"box.lua:12", "text"}; no place, no split.
std::pair<std::string, std::string> split_place(std::string_view s) {
  for (std::size_t at = s.find(':'); at != std::string_view::npos; at = s.find(':', at + 1)) {
    std::size_t end = at + 1;
    while (end < s.size() && s[end] >= '0' && s[end] <= '9') ++end;
    if (end > at + 1 && s.substr(end, 2) == ": " && s.find('\n') > at)
      return {std::string(s.substr(0, end)), std::string(s.substr(end + 2))};
  }
  return {{}, std::string(s)};
}

}  // namespace

void push_error(lua_State* L, const Error& e, std::string_view at) {
  const auto set = [&](const char* name, std::string_view text) {
    lua_pushlstring(L, text.data(), text.size());
    lua_setfield(L, -2, name);
  };
  luaL_checkstack(L, 12, "while an error is raised");
  lua_createtable(L, 0, 6);
  set("code", to_string(e.code));
  set("message", e.message);
  set("where", e.where);
  set("hint", e.hint);
  set("at", at);
  if (kept_faults(e)) {
    push(impl_of(L), L, Value(fault_list(e)));
    lua_setfield(L, -2, "faults");
  }
  lua_rawgetp(L, LUA_REGISTRYINDEX, &kErrorKey);
  lua_setmetatable(L, -2);
}

namespace {

/// What helps with Lua's complaint about a global that is nil; "" for any other message.
std::string suggestion(lua_State* L, std::string_view message) {
  constexpr std::string_view kBefore = "a nil value (global '";
  auto at = message.find(kBefore);
  if (at == std::string_view::npos) return {};
  at += kBefore.size();
  return hint_for_name(impl_of(L), L, std::string(message.substr(at, message.find('\'', at) - at)));
}

}  // namespace

Error to_error(lua_State* L, int index) {
  index = lua_absindex(L, index);
  if (lua_istable(L, index)) {
    Error e;
    e.code = error_code_from(string_field(L, index, "code")).value_or(ErrorCode::script_failed);
    e.message = string_field(L, index, "message");
    e.where = string_field(L, index, "where");
    e.hint = string_field(L, index, "hint");
    const std::string at = string_field(L, index, "at");
    lua_pushliteral(L, "faults");
    if (lua_rawget(L, index) == LUA_TTABLE)
      if (const auto faults = to_value(L, -1); faults.ok()) adopt_faults(e, *faults);
    lua_pop(L, 1);
    if (!at.empty()) e = std::move(e).in(at);
    if (e.message.empty()) e.message = "a script raised a table without a message";
    return e;
  }
  if (lua_type(L, index) == LUA_TSTRING) {
    auto [at, message] = split_place(lua_tostring(L, index));
    std::string hint = suggestion(L, message);
    return error(ErrorCode::script_failed, std::move(message), std::move(hint), std::move(at));
  }
  return error(ErrorCode::script_failed,
               "a script raised a " + type_text(L, index) + " instead of a text",
               "Raise errors with error(\"what happened\").");
}

std::string place(lua_State* L, int level) {
  lua_Debug ar;
  for (; lua_getstack(L, level, &ar) != 0; ++level) {
    lua_getinfo(L, "Sl", &ar);
    if (ar.currentline > 0) return std::string(ar.short_src) + ":" + std::to_string(ar.currentline);
  }
  return {};
}

namespace {
Result<int> error_text(Impl&, lua_State* L) {
  Error e = to_error(L, 1);
  if (lua_istable(L, 1))
    e.where = string_field(L, 1, "where");  // the sentence is without the script line
  const std::string text = e.sentence();
  lua_pushlstring(L, text.data(), text.size());
  return 1;
}
}  // namespace

void open_errors(lua_State* L) {
  lua_createtable(L, 0, 3);
  lua_pushcfunction(L, entry<error_text>);
  lua_setfield(L, -2, "__tostring");
  lua_pushliteral(L, "error");
  lua_setfield(L, -2, "__name");
  lua_rawsetp(L, LUA_REGISTRYINDEX, &kErrorKey);
}

// --- text
// -------------------------------------------------------------------------------------------

namespace {

std::string basic_text(Impl& impl, lua_State* L, int index) {
  switch (lua_type(L, index)) {
    case LUA_TFUNCTION:
      if (const ioci::CommandSpec* spec = command_of(L, index))
        return "command " + spec->name + ": " + spec->summary;
      return "function";
    case LUA_TTABLE: return "table";
    case LUA_TTHREAD: return "coroutine";
    case LUA_TLIGHTUSERDATA: return "light userdata";
    default: break;
  }
  const auto value = to_value(L, index);
  if (!value.ok()) return luaL_typename(L, index);
  return pretty(
      *value, nullptr, [&](const Handle& h) { return impl.host.describe(h); }, style_of(impl));
}

/// Text of tables that have no Value (functions, mixed keys, cycles): one line an entry, tables
/// inside indented.
class TableText {
 public:
  TableText(Impl& impl, lua_State* L, Shown shown)
      : impl_(impl), L_(L), left_(shown == Shown::beginning ? 200U : 100000U) {}

  // The depth of the recursion is bounded by kDeepest.
  std::string of(int table) {
    if (auto object = shown_as(L_, table)) return std::move(*object);
    if (const void* id = lua_topointer(L_, table);
        std::find(open_.begin(), open_.end(), id) != open_.end())
      return "<cycle>";
    if (open_.size() >= kDeepest || !lua_checkstack(L_, 8)) return "table";
    open_.push_back(lua_topointer(L_, table));
    std::vector<std::pair<std::string, std::string>> named;
    std::vector<std::pair<lua_Integer, std::string>> numbered;
    std::size_t left_out = 0;
    lua_pushnil(L_);
    while (lua_next(L_, table) != 0) {
      if (left_ == 0) {
        ++left_out;
      } else {
        --left_;
        const int value = lua_gettop(L_), key = value - 1;
        std::string text = lua_istable(L_, value) ? nested(value) : basic_text(impl_, L_, value);
        if (lua_isinteger(L_, key)) numbered.emplace_back(lua_tointeger(L_, key), std::move(text));
        else if (lua_type(L_, key) == LUA_TSTRING)
          named.emplace_back(lua_tostring(L_, key), std::move(text));
        else named.emplace_back("[" + basic_text(impl_, L_, key) + "]", std::move(text));
      }
      lua_pop(L_, 1);
    }
    open_.pop_back();
    std::sort(numbered.begin(), numbered.end());
    std::sort(named.begin(), named.end());
    std::vector<std::string> lines;
    for (const auto& [k, t] : numbered) lines.push_back("[" + std::to_string(k) + "] = " + t);
    for (const auto& [k, t] : named) lines.push_back(k + " = " + t);
    if (left_out > 0) lines.push_back("... " + std::to_string(left_out) + " more");
    return lines.empty() ? "{}" : text::join(lines, "\n");
  }

 private:
  static constexpr std::size_t kDeepest = 8;

  std::string nested(int table) {
    std::string text = of(table);
    if (shown_as(L_, table)) return text;
    if (text == "<cycle>" || text == "{}" || text == "table") return text;
    for (std::size_t at = text.find('\n'); at != std::string::npos; at = text.find('\n', at + 3))
      text.insert(at + 1, "  ");
    return "\n  " + text;
  }

  Impl& impl_;
  lua_State* L_;
  std::size_t left_;  ///< entries that may still be shown
  std::vector<const void*> open_;
};

}  // namespace

PrettyStyle style_of(const Impl& impl) {
  PrettyStyle out;
  out.digits = impl.digits;
  if (const std::size_t width = impl.options.width ? impl.options.width() : 0; width > 0) {
    out.width = std::max<std::size_t>(width, 40);
    out.fits = true;
  }
  return out;
}

std::string pretty_of(Impl& impl, lua_State* L, int index, Shown shown) {
  index = lua_absindex(L, index);
  if (!lua_checkstack(L, 16)) return luaL_typename(L, index);
  if (!lua_istable(L, index)) return basic_text(impl, L, index);
  if (lua_getmetatable(L, index) != 0) {
    lua_rawgetp(L, LUA_REGISTRYINDEX, &kErrorKey);
    const bool is_error = lua_rawequal(L, -1, -2) != 0;
    lua_pop(L, 2);
    if (is_error) return to_error(L, index).sentence();
  }
  if (auto object = shown_as(L, index)) return std::move(*object);
  const auto value = to_value(L, index);
  if (!value.ok()) return TableText(impl, L, shown).of(index);
  const ioci::ReturnSpec* returns = returns_of(L, index);
  const ioci::CommandSpec* apropos = impl.host.find("apropos");
  if (apropos && returns == &apropos->returns && value->as_list() && value->as_list()->empty())
    return "Nothing was found. Try fewer or different words; help() lists the topics.";
  PrettyStyle style = style_of(impl);
  if (shown == Shown::as_text) {
    style = PrettyStyle{};
    style.digits = impl.digits;
  }
  if (shown != Shown::beginning) style.most_items = std::numeric_limits<std::size_t>::max();
  return pretty(
      *value, returns, [&](const Handle& h) { return impl.host.describe(h); }, style);
}

std::string result_text_of(Impl& impl, lua_State* L, int index) {
  if (const auto handle = handle_at(L, index)) {
    const ioci::CommandSpec* overview = impl.host.find(handle->kind + ".overview");
    if (overview && overview->returns.type == "string") {
      const auto said = impl.host.dispatch(*overview, Map{{"id", *handle}});
      if (said.ok() && said->as_string()) {
        const PrettyStyle style = style_of(impl);
        return fitted(*said->as_string(), style.fits ? style.width : 0);
      }
    }
  }
  return pretty_of(impl, L, index);
}

}  // namespace robomosp::lua
