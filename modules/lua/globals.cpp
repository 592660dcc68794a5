// SPDX-License-Identifier: Apache-2.0
// Global helpers of scripts: print, help, units, poses, time.
#include <chrono>
#include <cmath>
#include <numbers>

#include "kernel/permit.h"
#include "kernel/text.h"
#include "kernel/units.h"
#include "lua/internal.h"
#include "lua/terminal_text.h"
#include "spatial/rotation.h"

namespace robomosp::lua {
namespace {

Error misused_global(std::string message, std::string hint) {
  return error(ErrorCode::invalid_argument, std::move(message), std::move(hint));
}

/// A number in SI, or a text such as "20 mm".
Result<double> need_quantity(lua_State* L, int index, const std::string& what, const char* si) {
  if (lua_type(L, index) == LUA_TNUMBER) return static_cast<double>(lua_tonumber(L, index));
  if (lua_type(L, index) == LUA_TSTRING) {
    auto read = units::read_quantity(lua_tostring(L, index), si);
    if (!read.ok()) return std::move(read).error().in(what);
    return *read;
  }
  return misused_global(what + " is a " + luaL_typename(L, index) + ", not a number",
                        std::string("Write a number in ") + si + ", or a text such as " +
                            (std::string_view(si) == "m" ? "\"100 mm\"." : "\"90 deg\"."));
}

/// All quantities of a list or array.
Result<std::vector<double>> quantities(lua_State* L, int index, const std::string& what,
                                       const char* si) {
  if (!lua_istable(L, index)) return to_reals(L, index, what);
  std::vector<double> out;
  const auto count = lua_rawlen(L, index);
  for (lua_Unsigned i = 1; i <= count; ++i) {
    lua_rawgeti(L, index, static_cast<lua_Integer>(i));
    RMP_TRY_ASSIGN(const double v, need_quantity(L, lua_gettop(L), what, si));
    lua_pop(L, 1);
    out.push_back(v);
  }
  return out;
}

/// print(...): texts separated by tabs, through the session's sink.
Result<int> print(Impl& impl, lua_State* L) {
  std::string line;
  const int count = lua_gettop(L);
  for (int i = 1; i <= count; ++i) {
    if (i > 1) line += '\t';
    const bool is_plain = lua_istable(L, i) && lua_getmetatable(L, i) == 0;
    lua_settop(L, count);
    if (is_plain || array_at(L, i) || returns_of(L, i)) {
      line += pretty_of(impl, L, i, Shown::all);
      continue;
    }
    std::size_t length = 0;
    const char* s = luaL_tolstring(L, i, &length);
    line.append(s, length);
    lua_pop(L, 1);
  }
  line += '\n';
  RMP_TRY(impl.host.may_print(line.size()));
  print_text(impl, line);
  return 0;
}

/// A number or all numbers of a table or array, from a unit to SI.
Result<int> convert(Impl& impl, lua_State* L, const char* from, const char* si) {
  const auto unit = units::parse(from);
  if (!unit.ok()) return unit.error();
  if (lua_type(L, 1) == LUA_TNUMBER) {
    lua_pushnumber(L, units::to_si(lua_tonumber(L, 1), *unit));
    return 1;
  }
  if (!lua_istable(L, 1) && !array_at(L, 1))
    return misused_global(
        std::string(from) + "(x) needs a number or a list of numbers, not a " + luaL_typename(L, 1),
        "Write " + std::string(from) + "(90).");
  RMP_TRY_ASSIGN(auto numbers, to_reals(L, 1, "the argument"));
  for (double& x : numbers) x = units::to_si(x, *unit);
  const ArrayBox* a = array_at(L, 1);
  push_array(impl, L,
             a && a->is_matrix()
                 ? NumericArray(std::move(numbers), a->source.rows(), a->source.cols(), si)
                 : NumericArray(std::move(numbers), si));
  return 1;
}
Result<int> degrees(Impl& impl, lua_State* L) { return convert(impl, L, "deg", "rad"); }
Result<int> millimetres(Impl& impl, lua_State* L) { return convert(impl, L, "mm", "m"); }

/// Angles of rpy() that were rather meant in degrees: beyond two turns, and whole numbers of them.
void note_degrees_of(Impl& impl, const Vec3& angles, const char* call) {
  constexpr double kTwoTurns = 4 * std::numbers::pi, kMost = 1080;
  for (const double x : angles)
    if (std::fabs(x) > kTwoTurns && std::fabs(x) <= kMost && x == std::round(x)) {
      const std::string given = text::print(x);
      impl.host.note("likely_unit", std::string(call) + ": " + given + " is taken as " + given +
                                        " rad. Write " + text::quote(given + " deg") +
                                        " for degrees.");
      return;
    }
}

/// Three quantities of the SI unit `si` from a list or from arguments; `call` and `things` name
/// them: "rpy(roll, pitch, yaw)" and "angle".
Result<Vec3> three(lua_State* L, const char* call, const char* thing, const char* si) {
  const std::string what = std::string(thing) + " of " + call;
  std::vector<double> numbers;
  if (lua_istable(L, 1) || array_at(L, 1)) {
    RMP_TRY_ASSIGN(numbers, quantities(L, 1, what, si));
  } else {
    for (int i = 1; i <= 3 && !lua_isnoneornil(L, i); ++i) {
      RMP_TRY_ASSIGN(const double v, need_quantity(L, i, what, si));
      numbers.push_back(v);
    }
  }
  if (numbers.size() != 3)
    return misused_global(
        std::string(call) + " needs three " + thing + "s; " +
            (numbers.empty()       ? std::string("none is given")
             : numbers.size() == 1 ? std::string("one is given")
                                   : std::to_string(numbers.size()) + " are given"),
        std::string_view(si) == "m" ? "Write pose(0.1, 0, \"200 mm\")."
                                    : "Write rpy(0, 0, \"90 deg\").");
  return Vec3{numbers[0], numbers[1], numbers[2]};
}

/// rpy(roll, pitch, yaw): 3x3 rotation, R = Rz(yaw) Ry(pitch) Rx(roll).
Result<int> rpy(Impl& impl, lua_State* L) {
  RMP_TRY_ASSIGN(const Vec3 angles, three(L, "rpy(roll, pitch, yaw)", "angle", "rad"));
  note_degrees_of(impl, angles, "rpy(roll, pitch, yaw)");
  const spatial::Matrix3 r = spatial::from_rpy(angles);
  push_array(impl, L, NumericArray(std::vector<double>(r.begin(), r.end()), 3, 3));
  return 1;
}

/// pose(x, y, z [, rotation]), pose({x, y, z} [, rotation]); the rotation is rpy(...), a 3x3
/// matrix, or a table {roll, pitch, yaw}.
Result<int> pose(Impl& impl, lua_State* L) {
  Pose t;
  RMP_TRY_ASSIGN(t.p, three(L, "pose(x, y, z, rotation)", "coordinate", "m"));
  const int rotation = lua_istable(L, 1) || array_at(L, 1) ? 2 : 4;
  if (!lua_isnoneornil(L, rotation)) {
    RMP_TRY_ASSIGN(const auto r,
                   quantities(L, rotation, "the rotation of pose(x, y, z, rotation)", "rad"));
    if (r.size() == 3) {
      note_degrees_of(impl, {r[0], r[1], r[2]}, "pose(x, y, z, rotation)");
      t.R = spatial::from_rpy({r[0], r[1], r[2]});
    } else if (r.size() == 9) {
      std::copy(r.begin(), r.end(), t.R.begin());
    } else {
      return misused_global("the rotation of a pose has " + std::to_string(r.size()) + " numbers",
                            "Give rpy(roll, pitch, yaw) or a 3x3 matrix.");
    }
  }
  push(impl, L, pose_value(t));
  return 1;
}

/// What help() says about the globals that are no commands.
struct Topic {
  std::string_view name, text;
};
constexpr Topic kTopics[] = {
    {"units",
     "Numbers are in SI: metres, kilograms, seconds, newtons; angles are in radians.\n"
     "A text carries another unit: \"20 mm\", \"90 deg\", \"7.85 g/cm^3\"; a unit of the wrong "
     "kind is "
     "refused.\n"
     "deg(90) and mm(20) turn a number, or all numbers of a list, into SI.\n"},
    {"deg",
     "deg(x): degrees to radians; x is a number or a list of numbers.\n"
     "  deg(90)          deg{0, 45, 90}\n"},
    {"mm",
     "mm(x): millimetres to metres; x is a number or a list of numbers.\n"
     "  mm(20)           mm{100, 0, 250}\n"},
    {"rpy",
     "rpy(roll, pitch, yaw): the 3x3 rotation Rz(yaw) Ry(pitch) Rx(roll); angles in rad or "
     "texts.\n"
     "  rpy(0, pi / 2, 0)          rpy(\"180 deg\", 0, 0)\n"},
    {"pose",
     "pose(x, y, z [, rotation]): a 4x4 pose; lengths in m or texts. The rotation is "
     "rpy(...), a 3x3 array, or {roll, pitch, yaw}.\n"
     "  pose(0.4, 0, \"250 mm\", rpy(\"180 deg\", 0, 0))          pose{0.4, 0, 0.25}\n"},
    {"array",
     "array(list [, unit]): numbers as an unchangeable vector, or as a matrix when the "
     "list has rows. +, -, * and / work on it; a[i], m[r][c], m(r, c), #a, a:unit(), "
     "a:table().\n"
     "  array{1, 2, 3}          array({{1, 0}, {0, 1}}, \"m\")\n"},
    {"linalg",
     "linalg: linear algebra of arrays and lists. What begins with an array is a method too: "
     "A:det() is linalg.det(A).\n"
     "  make     identity(n)  zeros(r [, c])  ones(r [, c])  linspace(first, last, n)  rows{a, b}  "
     "columns{a, b}\n"
     "  solve    det  inverse  solve(A, b)  lstsq(A, b)  pinv  rank  cond  trace  "
     "norm(A [, 1, 2, \"inf\", \"fro\"])\n"
     "  factor   svd -> U, s, V   eig -> values, vectors [, imaginary parts]   qr -> Q, R   "
     "lu -> L, U, P   chol -> L\n"
     "  combine  cross(a, b)  outer(a, b)  kron(A, B)  times(A, B)  over(A, B)  pow(A, p)\n"
     "  parts    sub(v, first, last)  sub(A, row, row, column, column)  diagonal  "
     "reshape(a, r [, c])\n"
     "  entries  abs  sqrt  exp  log  sin  cos  tan  asin  acos  atan  floor  ceil  sign  "
     "map(a, f)  sum  mean\n"
     "  frames   rotation(v)  rotvec(R)  quaternion(R)  from_quaternion(q)  skew(v)  adjoint(T)  "
     "apply(T, points)\n"
     "A pose times a point, a twist (v, w), a rotation or a pose gives one in the outer frame.\n"
     "  x = A:solve{1, 2}          U, s, V = J:svd()          T * array{0, 0, 0.1}\n"},
    {"pi", "pi: 3.14159...\n"},
    {"digits",
     "digits(n): from now on numbers are shown with n significant digits, 1 to 17; digits() tells "
     "how many these are: 6 unless changed. 15 show all that a decimal number keeps, 17 all there "
     "is. Nothing is rounded by it.\n"
     "  digits(15)          digits(6)\n"
     "In ~/.config/robomosp/startup.lua it holds for every console.\n"},
    {"print", "print(...): writes its arguments, tables too, as readable text.\n"},
    {"help",
     "help(): the topics. help(x): what x is, a command, a method, a handle or a helper; its "
     "name in quotes works as well. In the console x? does the same.\n"
     "  help(robot.fk)          help \"units\"          robot.fk?\n"},
    {"start",
     "start(command [, arguments]): runs a command as a job and gives its handle at once; the "
     "command is a name or a function.\n"
     "job:wait() gives its result, job:progress() how far it is, job:cancel() ends it.\n"
     "  job = start(\"world.plan_path\", {id = \"cell\", robot = \"arm\", to = \"home\"})\n"
     "  job:wait()          start(robot.fk, \"pa10\", {q = \"home\"}):wait()\n"},
    {"tic", "tic(): starts the stopwatch that toc() reads.\n"},
    {"toc", "toc(): seconds since tic().\n"},
    {"traceback", "traceback(): the call stack of the last error that reached the console.\n"},
};

/// help(): overview; help(x) for a command, namespace, method, handle or topic.
Result<int> help(Impl& impl, lua_State* L) {
  if (!lua_isnoneornil(L, 1)) {
    const auto topic = help_topic(impl, L, 1);
    if (!topic)
      return misused_global(std::string("there is no help about a ") + luaL_typename(L, 1),
                            "Give a command, a handle, or a name in quotes.");
    RMP_TRY_ASSIGN(const std::string text, help_text(impl, *topic));
    lua_pushlstring(L, text.data(), text.size());
    return 1;
  }
  RMP_TRY_ASSIGN(const std::string text, help_text(impl, ""));
  lua_pushlstring(L, text.data(), text.size());
  return 1;
}

/// digits(n): significant digits of numbers that are shown.
Result<int> digits(Impl& impl, lua_State* L) {
  constexpr lua_Integer kMost = 17;
  if (!lua_isnoneornil(L, 1)) {
    int is_whole = 0;
    const lua_Integer n = lua_tointegerx(L, 1, &is_whole);
    if (!is_whole || n < 1 || n > kMost)
      return misused_global("digits(n) needs a whole number from 1 to 17",
                            "Write digits(15), or digits(6) as at the start.");
    impl.digits = static_cast<int>(n);
    return 0;
  }
  lua_pushinteger(L, impl.digits);
  return 1;
}

double seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

const char kTicKey = 0;

Result<int> tic(Impl&, lua_State* L) {
  lua_pushnumber(L, seconds());
  lua_rawsetp(L, LUA_REGISTRYINDEX, &kTicKey);
  return 0;
}
/// toc(): seconds since tic().
Result<int> toc(Impl&, lua_State* L) {
  if (lua_rawgetp(L, LUA_REGISTRYINDEX, &kTicKey) != LUA_TNUMBER)
    return misused_global("toc() was called before tic()", "Call tic() first.");
  lua_pushnumber(L, seconds() - lua_tonumber(L, -1));
  return 1;
}

/// traceback(): call stack of the last error that reached the console.
Result<int> traceback(Impl& impl, lua_State* L) {
  lua_pushlstring(L, impl.traceback.data(), impl.traceback.size());
  return 1;
}

/// The handler of xpcall runs with hooks off, so a handler that never ends could not be
/// interrupted; while the script is being stopped no handler runs.
Result<int> guarded_handler(Impl& impl, lua_State* L) {
  if (is_stopping(impl)) return 1;
  lua_pushvalue(L, lua_upvalueindex(1));
  lua_insert(L, 1);
  lua_call(L, lua_gettop(L) - 1, LUA_MULTRET);
  return lua_gettop(L);
}

int xpcall_rest(lua_State* L, int, lua_KContext) { return lua_gettop(L); }

/// xpcall with the handler wrapped; upvalue 1 is Lua's own. A plain C function, because its
/// function may yield.
int guarded_xpcall(lua_State* L) {
  luaL_checktype(L, 2, LUA_TFUNCTION);
  lua_pushvalue(L, 2);
  lua_pushcclosure(L, entry<guarded_handler>, 1);
  lua_replace(L, 2);
  lua_pushvalue(L, lua_upvalueindex(1));
  lua_insert(L, 1);
  lua_callk(L, lua_gettop(L) - 1, LUA_MULTRET, 0, xpcall_rest);
  return lua_gettop(L);
}

}  // namespace

Result<void> script_may(const Impl& impl, Effect effect, std::string_view what) {
  if (denied_within().has(effect))
    return error(ErrorCode::permission,
                 "a solver that came with a file may not call " + std::string(what) + ", which " +
                     std::string(phrase(effect)),
                 "Such a solver may only compute and read the document.");
  return impl.host.may(effect, what);
}

std::optional<std::string> help_topic(Impl& impl, lua_State* L, int index) {
  index = lua_absindex(L, index);
  if (lua_type(L, index) == LUA_TSTRING) return lua_tostring(L, index);
  if (const ioci::CommandSpec* spec = command_of(L, index)) return spec->name;
  if (const KindInfo* info = handle_kind(L, index)) return info->kind;
  if (lua_isfunction(L, index) || lua_istable(L, index)) {
    for (const Topic& t : kTopics) {
      lua_getglobal(L, std::string(t.name).c_str());
      const bool is_it = lua_rawequal(L, -1, index) != 0;
      lua_pop(L, 1);
      if (is_it) return std::string(t.name);
    }
  }
  if (!lua_istable(L, index)) return std::nullopt;
  // A namespace is the global table of a topic.
  for (const ioci::CommandSpec* spec : impl.host.list()) {
    const std::string topic = spec->name.substr(0, spec->name.find('.'));
    lua_getglobal(L, topic.c_str());
    const bool is_it = lua_rawequal(L, -1, index) != 0;
    lua_pop(L, 1);
    if (is_it) return topic;
  }
  return std::nullopt;
}

Result<std::string> help_text(Impl& impl, const std::string& topic) {
  const PrettyStyle style = style_of(impl);
  const auto shown = [&style](std::string_view text) {
    return style.fits ? fitted(text, style.width) : std::string(text);
  };
  for (const Topic& t : kTopics)
    if (t.name == topic) return shown(t.text);
  const ioci::CommandSpec* help = impl.host.find("help");
  const auto text = help ? impl.host.dispatch(*help, Map{{"topic", topic}})
                         : Result<Value>(impl.host.unknown("help"));
  if (text.ok()) return shown(text->as_string() ? *text->as_string() : text->text());
  // A function of linalg by its name alone.
  lua_State* L = impl.current ? impl.current : impl.main;
  lua_getglobal(L, "linalg");
  if (lua_istable(L, -1)) lua_getfield(L, -1, topic.c_str());
  else lua_pushnil(L);
  const bool is_linalg = lua_isfunction(L, -1);
  lua_pop(L, 2);
  if (is_linalg) return help_text(impl, "linalg");
  return text.error();
}

void guard_xpcall(lua_State* L) {
  lua_getglobal(L, "xpcall");
  lua_pushcclosure(L, guarded_xpcall, 1);
  lua_setglobal(L, "xpcall");
}

void open_helpers(lua_State* L) {
  static constexpr luaL_Reg kFunctions[] = {
      {"print", entry<print>},         {"help", entry<help>},      {"digits", entry<digits>},
      {"deg", entry<degrees>},         {"mm", entry<millimetres>}, {"rpy", entry<rpy>},
      {"pose", entry<pose>},           {"tic", entry<tic>},        {"toc", entry<toc>},
      {"traceback", entry<traceback>}, {nullptr, nullptr}};
  lua_pushglobaltable(L);
  luaL_setfuncs(L, kFunctions, 0);
  lua_pushnumber(L, std::numbers::pi);
  lua_setfield(L, -2, "pi");
  lua_pop(L, 1);
}

}  // namespace robomosp::lua
