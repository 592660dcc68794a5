// SPDX-License-Identifier: Apache-2.0
// Numeric arrays as userdata: immutable vectors and matrices with units.
#include <algorithm>
#include <cmath>

#include "kernel/provider_guard.h"
#include "kernel/text.h"
#include "kernel/unit_lists.h"
#include "lua/internal.h"
#include "lua/pretty.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"

namespace robomosp::lua {

NumericArray ArrayBox::value() const {
  if (row == kWhole) {
    if (unit == source.unit()) return source;
    return source.is_matrix() ? NumericArray(source.data(), source.rows(), source.cols(), unit)
                              : NumericArray(source.data(), unit);
  }
  const auto first = source.data().begin() + static_cast<std::ptrdiff_t>(row * source.cols());
  return NumericArray(
      std::vector<double>(first, first + static_cast<std::ptrdiff_t>(source.cols())), unit);
}

namespace {

const char kArrayKey = 0;         // in the registry: metatable of arrays; in it: a mark
const char kArrayMethodsKey = 0;  // in the registry: their methods

Error misused_array(std::string message, std::string hint = {}) {
  return error(ErrorCode::invalid_argument, std::move(message), std::move(hint));
}

std::string shape(const ArrayBox& a) {
  return a.is_matrix() ? "a " + std::to_string(a.source.rows()) + "x" +
                             std::to_string(a.source.cols()) + " matrix"
                       : "a vector of " + std::to_string(a.length());
}

/// Registers the box that lies in the userdata on top.
void finish_box(Impl& impl, lua_State* L, ArrayBox& box) {
  lua_rawgetp(L, LUA_REGISTRYINDEX, &kArrayKey);
  lua_setmetatable(L, -2);
  if (box.row != ArrayBox::kWhole) return;
  // Lua sees only the small userdata, so the numbers behind it are counted here. Shared arrays
  // count more than once; that errs on the safe side.
  box.counted = box.source.size() * sizeof(double);
  impl.external += box.counted;
  if (impl.external < impl.collect_at) return;
  lua_gc(L, LUA_GCCOLLECT);
  impl.collect_at = std::max(std::size_t{64} << 20, 2 * impl.external);
}

void push_row(Impl& impl, lua_State* L, const ArrayBox& matrix, std::size_t row) {
  auto* box =
      new (lua_newuserdatauv(L, sizeof(ArrayBox), 0)) ArrayBox{matrix.source, matrix.unit, row, 0};
  finish_box(impl, L, *box);
}

/// The array at an index, or the error that says what is there instead.
Result<const ArrayBox*> need_array(lua_State* L, int index) {
  if (const ArrayBox* a = array_at(L, index)) return a;
  return misused_array(std::string("a numeric array is expected, not a ") + luaL_typename(L, index),
                       "Make one by array{1, 2, 3}.");
}

// --- reading ---------------------------------------------------------------------------------

Result<int> length(Impl&, lua_State* L) {
  RMP_TRY_ASSIGN(const ArrayBox* a, need_array(L, 1));
  lua_pushinteger(L, static_cast<lua_Integer>(a->length()));
  return 1;
}

void push_entry(Impl& impl, lua_State* L, const ArrayBox& a, lua_Integer i) {
  if (i < 1 || static_cast<std::size_t>(i) > a.length()) {
    lua_pushnil(L);
  } else if (a.is_matrix()) {
    push_row(impl, L, a, static_cast<std::size_t>(i - 1));
  } else {
    lua_pushnumber(L, a.entry(static_cast<std::size_t>(i - 1)));
  }
}

/// a[i], a.method; upvalue 1 is the table of methods.
Result<int> index_array(Impl& impl, lua_State* L) {
  RMP_TRY_ASSIGN(const ArrayBox* a, need_array(L, 1));
  if (lua_type(L, 2) == LUA_TNUMBER) {
    int is_whole = 0;
    const lua_Integer i = lua_tointegerx(L, 2, &is_whole);
    push_entry(impl, L, *a, is_whole ? i : 0);
    return 1;
  }
  lua_pushvalue(L, 2);
  if (lua_rawget(L, lua_upvalueindex(1)) != LUA_TNIL) return 1;
  std::vector<std::string> known;
  lua_pushnil(L);
  while (lua_next(L, lua_upvalueindex(1)) != 0) {
    known.emplace_back(lua_tostring(L, -2));
    lua_pop(L, 1);
  }
  std::sort(known.begin(), known.end());
  const std::string key = lua_type(L, 2) == LUA_TSTRING ? lua_tostring(L, 2) : luaL_typename(L, 2);
  std::string near = text::did_you_mean(key, known);
  if (!near.empty()) near += ' ';
  return error(ErrorCode::unknown_name, "a numeric array has no method " + text::quote(key),
               near + "help \"linalg\" shows what arrays can do.");
}

/// m(i, j), v(i)
Result<int> call_array(Impl& impl, lua_State* L) {
  RMP_TRY_ASSIGN(const ArrayBox* a, need_array(L, 1));
  const auto i = lua_tointeger(L, 2);
  if (lua_gettop(L) < 3) {
    push_entry(impl, L, *a, i);
    return 1;
  }
  const auto j = lua_tointeger(L, 3);
  if (!a->is_matrix()) return misused_array("a vector needs one index", "Write v[i].");
  if (i < 1 || j < 1 || static_cast<std::size_t>(i) > a->source.rows() ||
      static_cast<std::size_t>(j) > a->source.cols())
    return misused_array(
        "entry (" + std::to_string(i) + ", " + std::to_string(j) + ") is outside " + shape(*a),
        "Indices start at 1.");
  lua_pushnumber(L, a->source.at(static_cast<std::size_t>(i - 1), static_cast<std::size_t>(j - 1)));
  return 1;
}

Result<int> assign(Impl&, lua_State*) {
  return misused_array("numeric arrays cannot be changed",
                       "Copy it with a:table(), change the copy, and use that.");
}

Result<int> array_text(Impl& impl, lua_State* L) {
  RMP_TRY_ASSIGN(const ArrayBox* a, need_array(L, 1));
  PrettyStyle style;
  style.digits = impl.digits;
  const std::string s = pretty_array(a->value(), a->unit, style);
  lua_pushlstring(L, s.data(), s.size());
  return 1;
}

int next_entry(lua_State* L) {
  const lua_Integer i = luaL_checkinteger(L, 2) + 1;
  lua_pushinteger(L, i);
  lua_pushinteger(L, i);
  lua_gettable(L, 1);
  return lua_isnil(L, -1) ? 1 : 2;
}

Result<int> pairs(Impl&, lua_State* L) {
  RMP_TRY(need_array(L, 1));
  lua_pushcfunction(L, next_entry);
  lua_pushvalue(L, 1);
  lua_pushinteger(L, 0);
  return 3;
}

Result<int> collect(Impl& impl, lua_State* L) {
  auto* box = static_cast<ArrayBox*>(lua_touserdata(L, 1));
  impl.external -= std::min(impl.external, box->counted);
  box->~ArrayBox();
  lua_pushnil(L);
  lua_setmetatable(L, 1);  // a second look at a collected array finds no array
  return 0;
}

// --- arithmetic ------------------------------------------------------------------------------

void push_like(Impl& impl, lua_State* L, const ArrayBox& model, std::vector<double> data,
               std::string unit) {
  if (model.is_matrix())
    push_array(
        impl, L,
        NumericArray(std::move(data), model.source.rows(), model.source.cols(), std::move(unit)));
  else push_array(impl, L, NumericArray(std::move(data), std::move(unit)));
}

/// An operand: an array, or a plain table of numbers taken as one.
Result<std::optional<ArrayBox>> array_operand(lua_State* L, int index) {
  if (const ArrayBox* a = array_at(L, index)) return std::optional(*a);
  if (lua_istable(L, index)) {
    RMP_TRY_ASSIGN(auto numbers, to_reals(L, index, "the operand"));
    return std::optional(ArrayBox{NumericArray(std::move(numbers)), {}});
  }
  return std::optional<ArrayBox>();
}

Result<int> combine(Impl& impl, lua_State* L, double sign, std::string_view verb) {
  RMP_TRY_ASSIGN(const auto a, array_operand(L, 1));
  RMP_TRY_ASSIGN(const auto b, array_operand(L, 2));
  if (!a || !b)
    return misused_array("an array and a " + std::string(luaL_typename(L, a ? 2 : 1)) +
                             " cannot be " + std::string(verb),
                         "Both must be arrays of the same shape.");
  if (a->length() != b->length() || a->is_matrix() != b->is_matrix() ||
      (a->is_matrix() && a->source.cols() != b->source.cols()))
    return misused_array(shape(*a) + " and " + shape(*b) + " cannot be " + std::string(verb),
                         "Both must have the same shape.");
  if (!a->unit.empty() && !b->unit.empty() && a->unit != b->unit)
    return misused_array(
        "arrays in " + a->unit + " and in " + b->unit + " cannot be " + std::string(verb),
        "Both must have the same unit.");
  const NumericArray left = a->value(), right = b->value();
  std::vector<double> out(left.size());
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = left[i] + sign * right[i];
  push_like(impl, L, *a, std::move(out), a->unit.empty() ? b->unit : a->unit);
  return 1;
}

Result<int> add(Impl& impl, lua_State* L) { return combine(impl, L, 1, "added"); }
Result<int> subtract(Impl& impl, lua_State* L) { return combine(impl, L, -1, "subtracted"); }

Result<int> scaled(Impl& impl, lua_State* L, const ArrayBox& a, double by, bool divide) {
  std::vector<double> out = a.value().data();
  for (double& x : out) x = divide ? x / by : x * by;
  push_like(impl, L, a, std::move(out), a.unit);
  return 1;
}

/// A unit that holds for all numbers, also when they change places: none of a list of units.
std::string common_unit(const std::string& unit) {
  return units::is_list(unit) ? std::string() : unit;
}

std::string product_unit(const std::string& a, const std::string& b) {
  if (units::is_list(a) || units::is_list(b)) return {};
  return a.empty() ? b : b.empty() ? a : a + " " + b;
}

/// What a pose can multiply though it has four columns: a point, a twist, a rotation; and a
/// rotation a pose. False when these are none of them.
Result<bool> multiply_pose(Impl& impl, lua_State* L, const ArrayBox& a, const ArrayBox& b) {
  const auto rotation = [](const ArrayBox& box) -> std::optional<Pose> {
    if (!box.is_matrix() || box.source.rows() != 3 || box.source.cols() != 3) return std::nullopt;
    const NumericArray& m = box.source;
    return rigid_pose(NumericArray(
        {m[0], m[1], m[2], 0, m[3], m[4], m[5], 0, m[6], m[7], m[8], 0, 0, 0, 0, 1}, 4, 4));
  };
  const auto pose = rigid_pose(a.value());
  if (!pose) {
    const auto turn = rotation(a);
    const auto moved = rigid_pose(b.value());
    if (!turn || !moved) return false;
    push(impl, L, pose_value(spatial::compose(*turn, *moved)));
    return true;
  }
  if (const auto turn = rotation(b)) {
    push(impl, L, pose_value(spatial::compose(*pose, *turn)));
    return true;
  }
  if (b.is_matrix()) return false;
  if (b.length() == 3) {
    const Vec3 p = spatial::transform(*pose, {b.entry(0), b.entry(1), b.entry(2)});
    push_array(impl, L, NumericArray({p[0], p[1], p[2]}, common_unit(b.unit)));
    return true;
  }
  if (b.length() != 6) return false;
  const Vec3 w = spatial::rotate(*pose, {b.entry(3), b.entry(4), b.entry(5)});
  const Vec3 v = spatial::add(spatial::rotate(*pose, {b.entry(0), b.entry(1), b.entry(2)}),
                              spatial::cross(pose->p, w));
  push_array(impl, L, NumericArray({v[0], v[1], v[2], w[0], w[1], w[2]}, common_unit(b.unit)));
  return true;
}

/// number * array, array * number, matrix * matrix, matrix * vector, and a pose with a point, a
/// twist (v, w) or a rotation.
Result<int> multiply(Impl& impl, lua_State* L) {
  if (lua_type(L, 1) == LUA_TNUMBER || lua_type(L, 2) == LUA_TNUMBER) {
    const int number = lua_type(L, 1) == LUA_TNUMBER ? 1 : 2;
    RMP_TRY_ASSIGN(const ArrayBox* a, need_array(L, 3 - number));
    return scaled(impl, L, *a, lua_tonumber(L, number), false);
  }
  RMP_TRY_ASSIGN(const auto a, array_operand(L, 1));
  RMP_TRY_ASSIGN(const auto b, array_operand(L, 2));
  if (!a || !b || !a->is_matrix())
    return misused_array("only a number or a matrix can multiply an array",
                         "Write x:dot(y) for the dot product of vectors.");
  if (a->source.cols() != b->length()) {
    RMP_TRY_ASSIGN(const bool is_done, multiply_pose(impl, L, *a, *b));
    if (is_done) return 1;
    return misused_array(
        shape(*a) + " cannot multiply " + shape(*b),
        "The number of columns of the first must equal the number of rows of the second.");
  }
  const std::size_t rows = a->source.rows(), inner = a->source.cols(),
                    cols = b->is_matrix() ? b->source.cols() : 1;
  const NumericArray right = b->value();
  std::vector<double> out(rows * cols, 0.0);
  for (std::size_t i = 0; i < rows; ++i)
    for (std::size_t k = 0; k < inner; ++k)
      for (std::size_t j = 0; j < cols; ++j)
        out[i * cols + j] += a->source.at(i, k) * right[k * cols + j];
  std::string unit = product_unit(a->unit, b->unit);
  push_array(impl, L,
             b->is_matrix() ? NumericArray(std::move(out), rows, cols, std::move(unit))
                            : NumericArray(std::move(out), std::move(unit)));
  return 1;
}

Result<int> divide(Impl& impl, lua_State* L) {
  RMP_TRY_ASSIGN(const ArrayBox* a, need_array(L, 1));
  if (lua_type(L, 2) != LUA_TNUMBER)
    return misused_array("an array can be divided by a number only", "Write a / 2.");
  return scaled(impl, L, *a, lua_tonumber(L, 2), true);
}

Result<int> negate(Impl& impl, lua_State* L) {
  RMP_TRY_ASSIGN(const ArrayBox* a, need_array(L, 1));
  return scaled(impl, L, *a, -1, false);
}

Result<int> equal(Impl&, lua_State* L) {
  const ArrayBox* a = array_at(L, 1);
  const ArrayBox* b = array_at(L, 2);
  lua_pushboolean(L, a && b && a->value() == b->value() ? 1 : 0);
  return 1;
}

// --- methods ---------------------------------------------------------------------------------

void push_numbers(lua_State* L, const ArrayBox& a, std::size_t first, std::size_t count) {
  lua_createtable(L, static_cast<int>(count), 0);
  for (std::size_t i = 0; i < count; ++i) {
    lua_pushnumber(L, a.source.data()[first + i]);
    lua_rawseti(L, -2, static_cast<lua_Integer>(i + 1));
  }
}

Result<int> to_table(Impl&, lua_State* L) {
  RMP_TRY_ASSIGN(const ArrayBox* a, need_array(L, 1));
  if (!a->is_matrix()) {
    push_numbers(L, *a, a->row == ArrayBox::kWhole ? 0 : a->row * a->source.cols(), a->length());
    return 1;
  }
  lua_createtable(L, static_cast<int>(a->source.rows()), 0);
  for (std::size_t r = 0; r < a->source.rows(); ++r) {
    push_numbers(L, *a, r * a->source.cols(), a->source.cols());
    lua_rawseti(L, -2, static_cast<lua_Integer>(r + 1));
  }
  return 1;
}

Result<int> unit(Impl& impl, lua_State* L) {
  RMP_TRY_ASSIGN(const ArrayBox* a, need_array(L, 1));
  if (lua_gettop(L) == 1) {
    lua_pushlstring(L, a->unit.data(), a->unit.size());
    return 1;
  }
  if (lua_type(L, 2) != LUA_TSTRING)
    return misused_array("a unit must be a text", "Write a:unit(\"m\").");
  push_like(impl, L, *a, a->value().data(), lua_tostring(L, 2));
  return 1;
}

Result<int> rows(Impl&, lua_State* L) {
  RMP_TRY_ASSIGN(const ArrayBox* a, need_array(L, 1));
  lua_pushinteger(L, static_cast<lua_Integer>(a->length()));
  return 1;
}

Result<int> cols(Impl&, lua_State* L) {
  RMP_TRY_ASSIGN(const ArrayBox* a, need_array(L, 1));
  lua_pushinteger(L, static_cast<lua_Integer>(a->is_matrix() ? a->source.cols() : 1));
  return 1;
}

Result<int> column(Impl& impl, lua_State* L) {
  RMP_TRY_ASSIGN(const ArrayBox* a, need_array(L, 1));
  const auto j = lua_tointeger(L, 2);
  if (!a->is_matrix() || j < 1 || static_cast<std::size_t>(j) > a->source.cols())
    return misused_array("there is no column " + std::to_string(j) + " in " + shape(*a),
                         "Columns are numbered from 1.");
  std::vector<double> out(a->source.rows());
  for (std::size_t i = 0; i < out.size(); ++i)
    out[i] = a->source.at(i, static_cast<std::size_t>(j - 1));
  const std::vector<std::string_view> names = units::entries(a->unit);
  std::string name = names.size() == a->source.cols()
                         ? std::string(names[static_cast<std::size_t>(j - 1)])
                         : common_unit(a->unit);
  push_array(impl, L, NumericArray(std::move(out), std::move(name)));
  return 1;
}

Result<int> transpose(Impl& impl, lua_State* L) {
  RMP_TRY_ASSIGN(const ArrayBox* a, need_array(L, 1));
  if (!a->is_matrix()) return misused_array("only a matrix can be transposed");
  const std::size_t r = a->source.rows(), c = a->source.cols();
  std::vector<double> out(r * c);
  for (std::size_t i = 0; i < r; ++i)
    for (std::size_t j = 0; j < c; ++j) out[j * r + i] = a->source.at(i, j);
  push_array(impl, L, NumericArray(std::move(out), c, r, common_unit(a->unit)));
  return 1;
}

Result<int> dot(Impl&, lua_State* L) {
  RMP_TRY_ASSIGN(const auto a, array_operand(L, 1));
  RMP_TRY_ASSIGN(const auto b, array_operand(L, 2));
  if (!a || !b || a->is_matrix() || b->is_matrix() || a->length() != b->length())
    return misused_array("the dot product needs two vectors of the same length");
  double sum = 0;
  for (std::size_t i = 0; i < a->length(); ++i) sum += a->entry(i) * b->entry(i);
  lua_pushnumber(L, sum);
  return 1;
}

Result<int> extreme(lua_State* L, bool greatest) {
  RMP_TRY_ASSIGN(const ArrayBox* a, need_array(L, 1));
  const NumericArray v = a->value();
  if (v.size() == 0) return misused_array("an empty array has no extremes");
  const auto& d = v.data();
  lua_pushnumber(
      L, greatest ? *std::max_element(d.begin(), d.end()) : *std::min_element(d.begin(), d.end()));
  return 1;
}
Result<int> least(Impl&, lua_State* L) { return extreme(L, false); }
Result<int> greatest(Impl&, lua_State* L) { return extreme(L, true); }

Result<Pose> need_array_pose(lua_State* L) {
  RMP_TRY_ASSIGN(const ArrayBox* a, need_array(L, 1));
  const auto pose = rigid_pose(a->value());
  if (!pose)
    return misused_array(shape(*a) + " is not a pose",
                         "A pose is a 4x4 matrix such as pose(0.1, 0, 0.2).");
  return *pose;
}

Result<int> pose_position(Impl& impl, lua_State* L) {
  RMP_TRY_ASSIGN(const Pose t, need_array_pose(L));
  push_array(impl, L, NumericArray({t.p[0], t.p[1], t.p[2]}, "m"));
  return 1;
}
Result<int> pose_angles(Impl& impl, lua_State* L) {
  RMP_TRY_ASSIGN(const Pose t, need_array_pose(L));
  const Vec3 a = spatial::to_rpy(t.R);
  push_array(impl, L, NumericArray({a[0], a[1], a[2]}, "rad"));
  return 1;
}
/// array{1, 2, 3 [, unit]}, array({{1, 0}, {0, 1}}, unit)
Result<int> make_array(Impl& impl, lua_State* L) {
  const std::string unit_text = lua_type(L, 2) == LUA_TSTRING ? lua_tostring(L, 2) : "";
  if (const ArrayBox* a = array_at(L, 1)) {
    push_like(impl, L, *a, a->value().data(), unit_text.empty() ? a->unit : unit_text);
    return 1;
  }
  if (!lua_istable(L, 1))
    return misused_array("array needs a table of numbers or of rows",
                         "Write array{1, 2, 3} or array{{1, 0}, {0, 1}}.");
  RMP_TRY(push_array_of(impl, L, 1, unit_text));
  return 1;
}

}  // namespace

const ArrayBox* array_at(lua_State* L, int index) {
  if (lua_type(L, index) != LUA_TUSERDATA || lua_getmetatable(L, index) == 0) return nullptr;
  lua_rawgetp(L, -1, &kArrayKey);
  const bool is_array = lua_toboolean(L, -1) != 0;
  lua_pop(L, 2);
  return is_array ? static_cast<const ArrayBox*>(lua_touserdata(L, index)) : nullptr;
}

void push_array(Impl& impl, lua_State* L, NumericArray array, std::string_view unit) {
  std::string shown(array.unit().empty() ? unit : std::string_view(array.unit()));
  auto* box =
      new (lua_newuserdatauv(L, sizeof(ArrayBox), 0)) ArrayBox{std::move(array), std::move(shown)};
  finish_box(impl, L, *box);
}

Result<void> push_array_of(Impl& impl, lua_State* L, int table, const std::string& unit) {
  table = lua_absindex(L, table);
  const int first = lua_rawgeti(L, table, 1);
  const bool is_matrix = first == LUA_TTABLE || array_at(L, -1) != nullptr;
  lua_pop(L, 1);
  if (!is_matrix) {
    RMP_TRY_ASSIGN(auto numbers, to_reals(L, table, "the table"));
    push_array(impl, L, NumericArray(std::move(numbers), unit));
    return {};
  }
  std::vector<double> data;
  const auto count = static_cast<std::size_t>(lua_rawlen(L, table));
  std::size_t width = 0;
  for (std::size_t i = 1; i <= count; ++i) {
    lua_rawgeti(L, table, static_cast<lua_Integer>(i));
    auto row = to_reals(L, -1, "row " + std::to_string(i));
    lua_pop(L, 1);
    if (!row.ok()) return std::move(row).error();
    if (i == 1) width = row->size();
    if (row->size() != width || width == 0)
      return misused_array("row " + std::to_string(i) + " has " + std::to_string(row->size()) +
                               " numbers, the first one " + std::to_string(width),
                           "Give rows of equal length.");
    data.insert(data.end(), row->begin(), row->end());
  }
  push_array(impl, L, NumericArray(std::move(data), count, width, unit));
  return {};
}

std::optional<Pose> rigid_pose(const NumericArray& a) {
  constexpr double kAccepted = 1e-6;  // as for poses given to commands
  const auto pose = pose_from(Value(a));
  if (!pose || !is_rotation_matrix(pose->R)) return std::nullopt;
  const auto last = a.data().subspan(12);
  if (!(std::abs(last[0]) + std::abs(last[1]) + std::abs(last[2]) <= kAccepted) ||
      !(std::abs(last[3] - 1) <= kAccepted))
    return std::nullopt;
  return pose;
}

void push_array_methods(lua_State* L) { lua_rawgetp(L, LUA_REGISTRYINDEX, &kArrayMethodsKey); }

void open_arrays(lua_State* L) {
  static constexpr luaL_Reg kMeta[] = {{"__len", entry<length>},
                                       {"__call", entry<call_array>},
                                       {"__newindex", entry<assign>},
                                       {"__tostring", entry<array_text>},
                                       {"__pairs", entry<pairs>},
                                       {"__gc", entry<collect>},
                                       {"__add", entry<add>},
                                       {"__sub", entry<subtract>},
                                       {"__mul", entry<multiply>},
                                       {"__div", entry<divide>},
                                       {"__unm", entry<negate>},
                                       {"__eq", entry<equal>},
                                       {nullptr, nullptr}};
  static constexpr luaL_Reg kMethods[] = {
      {"table", entry<to_table>},  {"unit", entry<unit>},
      {"rows", entry<rows>},       {"cols", entry<cols>},
      {"col", entry<column>},      {"transpose", entry<transpose>},
      {"dot", entry<dot>},         {"min", entry<least>},
      {"max", entry<greatest>},    {"position", entry<pose_position>},
      {"rpy", entry<pose_angles>}, {nullptr, nullptr}};
  lua_createtable(L, 0, 18);
  lua_pushboolean(L, 1);
  lua_rawsetp(L, -2, &kArrayKey);
  luaL_setfuncs(L, kMeta, 0);
  lua_newtable(L);
  luaL_setfuncs(L, kMethods, 0);
  lua_pushvalue(L, -1);
  lua_rawsetp(L, LUA_REGISTRYINDEX, &kArrayMethodsKey);
  lua_pushcclosure(L, entry<index_array>, 1);
  lua_setfield(L, -2, "__index");
  lua_pushliteral(L, "array");
  lua_setfield(L, -2, "__name");
  lua_pushliteral(L, "array");
  lua_setfield(L, -2, "__metatable");
  lua_rawsetp(L, LUA_REGISTRYINDEX, &kArrayKey);
  lua_pushcfunction(L, entry<make_array>);
  lua_setglobal(L, "array");
}

}  // namespace robomosp::lua
