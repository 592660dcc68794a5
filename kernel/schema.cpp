// SPDX-License-Identifier: Apache-2.0
#include "kernel/schema.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "kernel/argument_faults.h"
#include "kernel/bare_numbers.h"
#include "kernel/file_root.h"
#include "kernel/number_reader.h"
#include "kernel/part_faults.h"
#include "kernel/plain_check.h"
#include "kernel/text.h"
#include "kernel/type.h"
#include "kernel/units.h"
#include "kernel/value_text.h"

namespace robomosp {
namespace {

PlainSpec plain_spec(const ParamSpec& spec, std::string_view plain) {
  return {plain, spec.unit, spec.choices, spec.min, spec.max, spec.infinite};
}

bool is_dimensionless(std::string_view unit) { return unit.empty() || unit == "1"; }

/// `a real in m/s`, `a real`
std::string real_in(std::string_view unit) {
  return is_dimensionless(unit) ? "a real" : "a real in " + std::string(unit);
}

/// `0.1 or "100 mm/s"`: two spellings of one amount in that unit.
std::string example_real(std::string_view unit) {
  struct Example {
    std::string_view unit, text;
  };
  constexpr Example kExamples[] = {
      {"m", "0.1 or \"100 mm\""},         {"m/s", "0.1 or \"100 mm/s\""},
      {"m/s^2", "0.1 or \"100 mm/s^2\""}, {"rad", "1.57 or \"90 deg\""},
      {"rad/s", "1.57 or \"90 deg/s\""},  {"rad/s^2", "1.57 or \"90 deg/s^2\""},
      {"kg", "0.25 or \"250 g\""},        {"s", "0.5 or \"500 ms\""},
  };
  if (is_dimensionless(unit)) return "0.5";
  for (const Example& e : kExamples)
    if (e.unit == unit) return std::string(e.text);
  return "0.1 or \"0.1 " + std::string(unit) + "\"";
}

std::string example(const PlainSpec& spec) {
  const std::string_view type = spec.type;
  if (type == "bool") return "Give true or false.";
  if (type == "int") return "Give a whole number such as 3.";
  if (type == "real") return "Give a number such as " + example_real(spec.unit) + ".";
  if (type == "string" || type == "path") return "Give a text in quotes.";
  if (type == "enum") return "Choices: " + text::enumerate(spec.choices) + ".";
  if (type == "real[]") return "Give a list of numbers such as {" + example_real(spec.unit) + "}.";
  if (type == "vec3") return "Give three numbers such as {0.1, 0, 0.2}.";
  if (type == "pose")
    return "Give {x, y, z, roll, pitch, yaw}, {position = {x, y, z}, rpy = {roll, pitch, yaw}} or "
           "a 4x4 matrix.";
  if (type == "matrix") return "Give rows of equal length such as {{1, 0}, {0, 1}}.";
  if (type == "list") return "Give a list such as {1, 2}.";
  if (type == "map") return "Give named values such as {a = 1}.";
  return {};
}

/// Units of the entries of "m, rad, m"; empty = one unit for all.
std::vector<std::string> units_of_entries(std::string_view unit) {
  std::vector<std::string> out;
  if (unit.find(',') == std::string_view::npos) return out;
  for (const std::string_view part : text::split(unit, ',')) out.emplace_back(text::trim(part));
  return out;
}

/// The kind of thing a parameter takes, with its article.
std::string kind_name(const PlainSpec& spec) {
  const std::string_view type = spec.type;
  if (type == "real") return real_in(spec.unit);
  if (type == "real[]")
    return is_dimensionless(spec.unit) ? "a list of reals"
                                       : "a list of reals in " + std::string(spec.unit);
  if (type == "int") return "an integer";
  if (type == "enum") return "one of the choices";
  if (type == "vec3")
    return is_dimensionless(spec.unit) ? "three reals" : "three reals in " + std::string(spec.unit);
  if (type == "any") return "a value";
  if (type.starts_with("ref:")) {
    std::string kinds(type.substr(4));
    for (std::size_t at = 0; (at = kinds.find('|', at)) != std::string::npos; at += 4)
      kinds.replace(at, 1, " or ");
    return (std::string_view("aeio").find(kinds.front()) != std::string_view::npos ? "an " : "a ") +
           kinds;
  }
  return (type.front() == 'a' ? "an " : "a ") + std::string(type);
}

std::string numbers_given(std::size_t n) {
  return std::to_string(n) + (n == 1 ? " number is given" : " numbers are given");
}

/// What the first words of a parameter's sentence name, with its verb: `joint values are`.
std::string doc_words(std::string_view doc) {
  std::string words(doc.substr(0, doc.find_first_of(",.:;")));
  const bool is_word = words.size() > 1 && words[1] >= 'a' && words[1] <= 'z';
  if (is_word && words[0] >= 'A' && words[0] <= 'Z') words[0] = static_cast<char>(words[0] + 32);
  return words + (words.ends_with('s') && !words.ends_with("ss") ? " are" : " is");
}

/// The value as a message shows it, cut to a readable length.
std::string shown(const Value& v) {
  constexpr std::size_t kLongest = 60;
  std::string s =
      v.as_string() ? text::quote(beginning_of(v, kLongest)) : beginning_of(v, kLongest);
  if (s.size() <= kLongest) return s;
  s.resize(kLongest);
  // Do not cut within a UTF-8 character.
  while (!s.empty() && (static_cast<unsigned char>(s.back()) & 0xC0U) == 0x80U) s.pop_back();
  if (!s.empty() && static_cast<unsigned char>(s.back()) >= 0xC0U) s.pop_back();
  return s + "...";
}

Error fault(std::string_view path, std::string message, std::string hint = {},
            std::string_view code = "argument.malformed") {
  return argument_error(code, path, std::move(message), std::move(hint));
}

Error wrong_count(std::string_view path, std::string message, std::string hint = {}) {
  return fault(path, std::move(message), std::move(hint), "argument.wrong_count");
}

Error wrong_type(const PlainSpec& spec, const Value& v, std::string_view path) {
  return fault(path, shown(v) + " is not " + kind_name(spec), example(spec), "argument.wrong_type");
}

std::string with_unit(double v, std::string_view unit) {
  return text::print(v) + (is_dimensionless(unit) ? "" : " " + std::string(unit));
}

/// "greater than 0" for the least positive double and its like.
bool is_just_above_zero(double min) { return min > 0 && min <= 1e-300; }

std::string range_text(const PlainSpec& spec) {
  const bool low = spec.min != -std::numeric_limits<double>::infinity();
  const bool high = spec.max != std::numeric_limits<double>::infinity();
  if (!low && !high) return {};
  if (low && is_just_above_zero(spec.min))
    return "greater than 0" +
           (high ? " and at most " + with_unit(spec.max, spec.unit) : std::string());
  if (low && high) return text::print(spec.min) + " to " + with_unit(spec.max, spec.unit);
  return low ? "at least " + with_unit(spec.min, spec.unit)
             : "at most " + with_unit(spec.max, spec.unit);
}

Result<double> check_range(const PlainSpec& spec, double v, std::string_view path) {
  if (std::isnan(v) || (std::isinf(v) && !spec.infinite))
    return fault(path, text::print(v) + " is not a finite number",
                 "Give a number such as " + example_real(spec.unit) + ".");
  if (v < spec.min || v > spec.max)
    return range_error(path,
                       with_unit(v, spec.unit) + " is out of range; it must be " + range_text(spec),
                       v, v < spec.min ? spec.min : spec.max, spec.unit);
  return v;
}

/// True if a number is in range and of a likely size, so that nothing is recorded.
bool fits_silently(const PlainSpec& spec, double v) {
  return std::isfinite(v) && v >= spec.min && v <= spec.max && BareNumbers::is_likely(v);
}

/// Any number within the unit, not yet range-checked.
Result<double> read_real(const PlainSpec& spec, const Value& v, std::string_view path) {
  if (v.is_number()) {
    BareNumbers::number(path, v.number(), spec.unit);
    return v.number();
  }
  if (const std::string* s = v.as_string()) {
    Result<double> read =
        units::read_quantity(*s, spec.unit == "1" ? std::string_view() : spec.unit);
    if (read.ok()) {
      BareNumbers::tell(path, *s, spec.unit);
      return read;
    }
    if (NumberReader* reader = NumberReader::current())
      if (auto number = reader->read(*s, spec.unit == "1" ? std::string_view() : spec.unit,
                                     spec.min, spec.max)) {
        if (!number->ok())
          return argument_error(std::move(*number).error(), path, "argument.malformed");
        return **number;
      }
    Error e = std::move(read).error();
    if (e.message.ends_with(" is not a number")) return wrong_type(spec, v, path);
    return fault(path, std::move(e.message), std::move(e.hint), "argument.wrong_unit");
  }
  return fault(path, shown(v) + " is not " + real_in(spec.unit),
               "Give a number such as " + example_real(spec.unit) + ".", "argument.wrong_type");
}

std::string element_path(std::string_view path, std::size_t i) {
  return std::string(path) + "[" + std::to_string(i + 1) + "]";
}

/// The pieces of "1, 2, 3", "{1 mm, 2 mm}" or "1 2 3".
std::vector<std::string_view> pieces(std::string_view s) {
  s = text::trim(s);
  if (s.size() >= 2 &&
      ((s.front() == '{' && s.back() == '}') || (s.front() == '[' && s.back() == ']')))
    s = text::trim(s.substr(1, s.size() - 2));
  std::vector<std::string_view> parts;
  if (s.empty()) return parts;
  const bool commas = s.find(',') != std::string_view::npos;
  for (const std::string_view part : text::split(s, commas ? ',' : ' ')) {
    const std::string_view trimmed = text::trim(part);
    if (commas || !trimmed.empty()) parts.push_back(trimmed);
  }
  return parts;
}

/// The reals of an array, a list, or a text; ranges checked entry by entry. nullopt = another type.
Result<std::optional<std::vector<double>>> read_reals(const PlainSpec& spec, const Value& v,
                                                      std::string_view path) {
  PlainSpec one = spec;
  one.type = "real";
  const std::vector<std::string> entry_units = units_of_entries(spec.unit);
  std::vector<double> numbers;
  const auto add = [&](const Value& item) -> Result<void> {
    if (numbers.size() < entry_units.size()) one.unit = entry_units[numbers.size()];
    if (item.is_number() && fits_silently(one, item.number())) {
      numbers.push_back(item.number());
      return {};
    }
    const std::string here = element_path(path, numbers.size());
    RMP_TRY_ASSIGN(const double read, read_real(one, item, here));
    RMP_TRY_ASSIGN(const double checked, check_range(one, read, here));
    numbers.push_back(checked);
    return {};
  };
  if (const NumericArray* a = v.as_array()) {
    if (a->is_matrix() && a->rows() != 1 && a->cols() != 1)
      return std::optional<std::vector<double>>();
    numbers.reserve(a->size());
    for (const double x : a->data()) RMP_TRY(add(x));
  } else if (const List* list = v.as_list()) {
    numbers.reserve(list->size());
    for (const Value& item : *list) RMP_TRY(add(item));
  } else if (const std::string* s = v.as_string()) {
    // "30 deg" is one number; of several those without commas have no units apart.
    const bool is_one = spec.type == "real[]" && units::read_quantity(*s, spec.unit).ok();
    if (is_one) {
      RMP_TRY(add(v));
    } else {
      for (const std::string_view part : pieces(*s)) RMP_TRY(add(Value(part)));
    }
  } else if (v.is_number() && spec.type == "real[]") {
    RMP_TRY(add(v));                                 // a list of one
  } else if (!v.as_map() || !v.as_map()->empty()) {  // an empty table may be given as a map
    return std::optional<std::vector<double>>();
  }
  return std::optional(std::move(numbers));
}

using Matrix3 = std::array<double, 9>;

Matrix3 product(const Matrix3& a, const Matrix3& b) {
  Matrix3 c{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      for (std::size_t k = 0; k < 3; ++k) c[3 * i + j] += a[3 * i + k] * b[3 * k + j];
  return c;
}

Matrix3 turn(char axis, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  if (axis == 'x') return {1, 0, 0, 0, c, -s, 0, s, c};
  if (axis == 'y') return {c, 0, s, 0, 1, 0, -s, 0, c};
  return {c, -s, 0, s, c, 0, 0, 0, 1};
}

/// rpy: R = Rz(yaw) Ry(pitch) Rx(roll) of (roll, pitch, yaw); xyz: Rx Ry Rz; zyz: Rz Ry Rz.
Matrix3 rotation_of(std::string_view notation, const std::vector<double>& a) {
  if (notation == "rpy") return product(product(turn('z', a[2]), turn('y', a[1])), turn('x', a[0]));
  if (notation == "xyz") return product(product(turn('x', a[0]), turn('y', a[1])), turn('z', a[2]));
  return product(product(turn('z', a[0]), turn('y', a[1])), turn('z', a[2]));
}

/// Departure of R from a rotation: greatest entry of |R^T R - 1|; 2 for a mirror.
double rotation_error(const Matrix3& r) {
  double worst = 0;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) {
      double dot = i == j ? -1 : 0;
      for (std::size_t k = 0; k < 3; ++k) dot += r[3 * k + i] * r[3 * k + j];
      worst = std::max(worst, std::abs(dot));
    }
  const double det = r[0] * (r[4] * r[8] - r[5] * r[7]) - r[1] * (r[3] * r[8] - r[5] * r[6]) +
                     r[2] * (r[3] * r[7] - r[4] * r[6]);
  return det > 0 ? worst : 2;
}

/// Nearest rotation of a nearly orthogonal matrix: Newton's iteration for the polar factor.
Matrix3 orthonormal(Matrix3 r) {
  for (int step = 0; step < 4; ++step) {
    Matrix3 g{};  // (3 - R^T R) / 2
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j) {
        double dot = 0;
        for (std::size_t k = 0; k < 3; ++k) dot += r[3 * k + i] * r[3 * k + j];
        g[3 * i + j] = ((i == j ? 3 : 0) - dot) / 2;
      }
    r = product(r, g);
  }
  return r;
}

Result<Value> pose_from_matrix(const std::vector<double>& m, std::string_view path) {
  // Entries typed with fewer than seven digits are refused rather than silently bent.
  constexpr double kAccepted = 1e-6, kAsGiven = 1e-14, kLastRow = 1e-9;
  for (const double x : m)
    if (!std::isfinite(x))
      return fault(path, "the matrix of a pose holds a number that is not finite");
  if (std::abs(m[12]) > kLastRow || std::abs(m[13]) > kLastRow || std::abs(m[14]) > kLastRow ||
      std::abs(m[15] - 1) > kLastRow)
    return fault(path, "the last row of a pose's matrix is not 0, 0, 0, 1",
                 "Give a matrix {R, p; 0, 1} with the position in the last column.");
  Matrix3 r{m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]};
  const double off = rotation_error(r);
  if (off > kAccepted)
    return fault(path,
                 "the 3x3 part of a pose's matrix is not a rotation (off by " +
                     text::print_rounded(off, 2) + "; at most 1e-06 is accepted)",
                 "Give more digits, or angles: {position = {x, y, z}, rpy = {roll, pitch, yaw}}.");
  if (off > kAsGiven) r = orthonormal(r);
  constexpr const char* kAxes[] = {".x", ".y", ".z"};
  for (const std::size_t i : {0U, 1U, 2U}) {
    // Whole numbers were typed, as in pose(400, 0, 300); others may have been computed.
    const double x = m[4 * i + 3];
    if (x == std::round(x)) BareNumbers::number(std::string(path) + kAxes[i], x, "m");
  }
  return pose_value(Pose{r, {m[3], m[7], m[11]}});
}

/// Numbers of one part of a pose: position [m] or angles [rad].
Result<std::vector<double>> pose_part(const Value& v, std::string_view path, const char* unit) {
  PlainSpec part;
  part.type = "vec3";
  part.unit = unit;
  RMP_TRY_ASSIGN(auto numbers, read_reals(part, v, path));
  if (!numbers) return wrong_type(part, v, path);
  if (numbers->size() != 3)
    return wrong_count(path,
                       numbers_given(numbers->size()) + "; " + kind_name(part) + " are needed");
  return std::move(*numbers);
}

/// Rotation of (x, y, z) about an axis of any length but zero (Rodrigues).
Matrix3 rotation_about(const std::array<double, 3>& axis, double angle) {
  const double length = std::hypot(axis[0], axis[1], axis[2]);
  const double x = axis[0] / length, y = axis[1] / length, z = axis[2] / length;
  const double c = std::cos(angle), s = std::sin(angle), t = 1 - c;
  return {t * x * x + c,     t * x * y - s * z, t * x * z + s * y, t * x * y + s * z, t * y * y + c,
          t * y * z - s * x, t * x * z - s * y, t * y * z + s * x, t * z * z + c};
}

/// {w, x, y, z} of any length but zero.
Result<Matrix3> rotation_of_quaternion(const Value& v, const std::string& path) {
  PlainSpec part;
  part.type = "real[]";
  RMP_TRY_ASSIGN(const auto q, read_reals(part, v, path));
  constexpr const char* kHint = "Give {w, x, y, z}.";
  if (!q) return wrong_type(part, v, path);
  if (q->size() != 4)
    return wrong_count(path, numbers_given(q->size()) + "; four are needed", kHint);
  const double length = std::hypot(std::hypot((*q)[0], (*q)[1], (*q)[2]), (*q)[3]);
  if (!(length > 0)) return fault(path, "the quaternion is zero", kHint);
  const double w = (*q)[0] / length, x = (*q)[1] / length, y = (*q)[2] / length,
               z = (*q)[3] / length;
  return Matrix3{1 - 2 * (y * y + z * z), 2 * (x * y - w * z),     2 * (x * z + w * y),
                 2 * (x * y + w * z),     1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
                 2 * (x * z - w * y),     2 * (y * z + w * x),     1 - 2 * (x * x + y * y)};
}

/// {x, y, z, angle}, or {axis = {x, y, z}, angle = angle}.
Result<Matrix3> rotation_of_axis_angle(const Value& v, const std::string& path) {
  constexpr const char* kHint = "Give {x, y, z, angle} or {axis = {x, y, z}, angle = angle}.";
  List items;
  if (const Map* map = v.as_map()) {
    const Value* axis = map->find("axis");
    const Value* angle = map->find("angle");
    if (!axis || !angle || map->size() != 2)
      return fault(path, "an axis_angle has an axis and an angle", kHint);
    if (const List* list = axis->as_list()) items = *list;
    else if (const NumericArray* a = axis->as_array())
      items.assign(a->data().begin(), a->data().end());
    if (items.size() != 3) return fault(path + ".axis", "three numbers are needed", kHint);
    items.push_back(*angle);
  } else if (const List* list = v.as_list()) {
    items = *list;
  } else if (const NumericArray* a = v.as_array()) {
    items.assign(a->data().begin(), a->data().end());
  }
  if (items.size() != 4)
    return wrong_count(path, numbers_given(items.size()) + "; four are needed", kHint);
  PlainSpec part;
  part.type = "real[]";
  part.unit = ", , , rad";
  RMP_TRY_ASSIGN(const auto n, read_reals(part, Value(std::move(items)), path));
  if (!n || n->size() != 4) return wrong_type(part, v, path);
  const std::array<double, 3> axis{(*n)[0], (*n)[1], (*n)[2]};
  if (!(std::hypot(axis[0], axis[1], axis[2]) > 0)) return fault(path, "the axis is zero", kHint);
  return rotation_about(axis, (*n)[3]);
}

constexpr std::string_view kPositions[] = {"position", "cylindrical", "spherical"};
constexpr std::string_view kRotations[] = {"rpy", "xyz", "zyz", "quaternion", "axis_angle"};

Result<Value> pose_from_parts(const Value* position, std::string_view coordinates,
                              const Value* angles, std::string_view notation,
                              std::string_view path) {
  Pose pose;
  if (position) {
    const char* unit = coordinates == "cylindrical" ? "m, rad, m"
                       : coordinates == "spherical" ? "m, rad, rad"
                                                    : "m";
    RMP_TRY_ASSIGN(const auto p,
                   pose_part(*position, std::string(path) + "." + std::string(coordinates), unit));
    pose.p = {p[0], p[1], p[2]};
    if (coordinates == "cylindrical") pose.p = {p[0] * std::cos(p[1]), p[0] * std::sin(p[1]), p[2]};
    if (coordinates == "spherical")
      pose.p = {p[0] * std::sin(p[2]) * std::cos(p[1]), p[0] * std::sin(p[2]) * std::sin(p[1]),
                p[0] * std::cos(p[2])};
  }
  if (angles) {
    const std::string here = std::string(path) + "." + std::string(notation);
    if (notation == "quaternion") {
      RMP_TRY_ASSIGN(pose.R, rotation_of_quaternion(*angles, here));
    } else if (notation == "axis_angle") {
      RMP_TRY_ASSIGN(pose.R, rotation_of_axis_angle(*angles, here));
    } else {
      RMP_TRY_ASSIGN(const auto a, pose_part(*angles, here, "rad"));
      pose.R = rotation_of(notation, a);
    }
  }
  return pose_value(pose);
}

Result<Value> check_pose_map(const Map& map, std::string_view path) {
  std::vector<std::string> known(std::begin(kPositions), std::end(kPositions));
  known.insert(known.end(), std::begin(kRotations), std::end(kRotations));
  const Value* position = nullptr;
  const Value* angles = nullptr;
  std::string coordinates = "position", notation = "rpy";
  for (const auto& [key, value] : map) {
    if (std::find(std::begin(kPositions), std::end(kPositions), key) != std::end(kPositions)) {
      if (position)
        return fault(path, "a pose has both " + coordinates + " and " + key, "Give one position.");
      position = &value;
      coordinates = key;
    } else if (std::find(std::begin(kRotations), std::end(kRotations), key) !=
               std::end(kRotations)) {
      if (angles)
        return fault(path, "a pose has both " + notation + " and " + key,
                     "Give one set of angles.");
      angles = &value;
      notation = key;
    } else {
      return argument_error(
          error(ErrorCode::unknown_name, text::quote(key) + " is not a field of a pose",
                text::did_you_mean(key, known) + (text::nearest(key, known) ? " " : "") +
                    "Fields: " + text::enumerate(known) + "."),
          path, "argument.malformed");
    }
  }
  if (!position && !angles) return fault(path, "the pose is empty", "Give position, rpy, or both.");
  return pose_from_parts(position, coordinates, angles, notation, path);
}

/// Rows of equal length; nullopt = another type.
Result<std::optional<NumericArray>> read_matrix(const PlainSpec& spec, const Value& v,
                                                std::string_view path) {
  using Read = std::optional<NumericArray>;
  if (const NumericArray* a = v.as_array()) {
    if (!a->is_matrix()) return Read();
    for (std::size_t i = 0; i < a->size(); ++i)
      if (const double x = (*a)[i]; !std::isfinite(x) || x < spec.min || x > spec.max)
        RMP_TRY(
            check_range(spec, x, element_path(element_path(path, i / a->cols()), i % a->cols())));
    return Read(*a);
  }
  const List* rows = v.as_list();
  if (!rows || rows->empty()) return Read();
  std::vector<double> data;
  std::size_t cols = 0;
  for (std::size_t r = 0; r < rows->size(); ++r) {
    const std::string here = element_path(path, r);
    const Value& row = (*rows)[r];
    if (row.is_number() || row.as_string()) return Read();
    RMP_TRY_ASSIGN(auto numbers, read_reals(spec, row, here));
    if (!numbers) return Read();
    if (r == 0) cols = numbers->size();
    if (numbers->size() != cols || cols == 0)
      return wrong_count(here,
                         "the row has " + std::to_string(numbers->size()) +
                             " numbers, the first one " + std::to_string(cols),
                         "Give rows of equal length.");
    data.insert(data.end(), numbers->begin(), numbers->end());
  }
  return Read(NumericArray(std::move(data), rows->size(), cols, std::string(spec.unit)));
}

Result<Value> check_pose(const PlainSpec& spec, const Value& v, std::string_view path) {
  if (const Map* map = v.as_map()) return check_pose_map(*map, path);
  PlainSpec plain;
  plain.type = "real";
  RMP_TRY_ASSIGN(const auto matrix, read_matrix(plain, v, path));
  if (matrix) {
    if (matrix->rows() != 4 || matrix->cols() != 4)
      return fault(path,
                   "the matrix of a pose is " + std::to_string(matrix->rows()) + "x" +
                       std::to_string(matrix->cols()) + ", not 4x4",
                   example(spec));
    return pose_from_matrix(matrix->data(), path);
  }
  List items;
  if (const List* list = v.as_list()) items = *list;
  else if (const NumericArray* a = v.as_array()) items.assign(a->data().begin(), a->data().end());
  else if (const std::string* s = v.as_string())
    for (const std::string_view part : pieces(*s)) items.emplace_back(part);
  if (items.size() != 6) return wrong_type(spec, v, path);
  const Value position(List(items.begin(), items.begin() + 3)),
      angles(List(items.begin() + 3, items.end()));
  return pose_from_parts(&position, "position", &angles, "rpy", path);
}

Result<Value> check_integer(const PlainSpec& spec, const Value& v, std::string_view path) {
  std::optional<std::int64_t> i;
  if (v.as_int()) {
    i = *v.as_int();
  } else if (const double* r = v.as_real()) {
    constexpr double kExact = 9007199254740992.0;  // 2^53: beyond it reals skip integers
    if (std::abs(*r) <= kExact && std::floor(*r) == *r) i = static_cast<std::int64_t>(*r);
  } else if (const std::string* s = v.as_string()) {
    i = text::read_int(text::trim(*s));
  }
  if (!i) return wrong_type(spec, v, path);
  RMP_TRY(check_range(spec, static_cast<double>(*i), path));
  return Value(*i);
}

Result<Value> check_bool(const PlainSpec& spec, const Value& v, std::string_view path) {
  if (v.as_bool()) return v;
  if (const std::string* s = v.as_string()) {
    if (*s == "true" || *s == "yes" || *s == "on") return Value(true);
    if (*s == "false" || *s == "no" || *s == "off") return Value(false);
  }
  return wrong_type(spec, v, path);
}

Result<Value> check_enum(const PlainSpec& spec, const Value& v, std::string_view path) {
  if (v.as_int()) return check_enum(spec, Value(std::to_string(*v.as_int())), path);  // degree = 5
  const std::string* s = v.as_string();
  if (!s) return wrong_type(spec, v, path);
  if (std::find(spec.choices.begin(), spec.choices.end(), *s) != spec.choices.end()) return v;
  std::string hint = text::did_you_mean(*s, spec.choices);
  if (!hint.empty()) hint += " ";
  return fault(path, text::quote(*s) + " is not one of the choices", hint + example(spec),
               "argument.not_a_choice");
}

Result<Value> check_ref(const PlainSpec& spec, const Value& v, std::string_view path,
                        const ResolveRef& resolve) {
  const std::string_view kinds = spec.type.substr(4);
  if (!v.as_handle() && !v.as_string())
    return fault(path, shown(v) + " is not " + kind_name(spec), "Give its name or a handle.",
                 "argument.wrong_type");
  if (resolve) {
    Result<Handle> handle = resolve(kinds, v);
    if (!handle.ok()) {
      const bool is_unknown = handle.error().code == ErrorCode::unknown_name;
      return argument_error(std::move(handle).error(), path,
                            is_unknown ? "argument.unknown_record" : "argument.wrong_record");
    }
    return Value(std::move(*handle));
  }
  if (const Handle* h = v.as_handle()) {
    for (const std::string_view kind : text::split(kinds, '|'))
      if (kind == h->kind) return v;
    return fault(path, shown(v) + " is not " + kind_name(spec), {}, "argument.wrong_type");
  }
  return v;  // a provider's parameter: it gets the name
}

}  // namespace

Result<void> check_count(const TypeTree& tree, const Value& checked, std::string_view path) {
  const NumericArray* a = checked.as_array();
  if (tree.kind == TypeKind::vector && tree.count && a && a->size() != tree.count)
    return wrong_count(path,
                       numbers_given(a->size()) + "; " + std::to_string(tree.count) + " are needed",
                       tree.words.empty() ? "" : "They are " + text::enumerate(tree.words) + ".");
  if (tree.kind == TypeKind::matrix && a &&
      ((tree.rows && a->rows() != tree.rows) || (tree.cols && a->cols() != tree.cols)))
    return wrong_count(path, "the matrix is " + std::to_string(a->rows()) + "x" +
                                 std::to_string(a->cols()) + ", not " + type_words(tree));
  return {};
}

const ParamSpec* find_param(const Schema& schema, std::string_view name) {
  const auto it = std::find_if(schema.begin(), schema.end(),
                               [name](const ParamSpec& p) { return p.name == name; });
  return it == schema.end() ? nullptr : &*it;
}

Result<Value> check_plain(const PlainSpec& spec, const Value& v, std::string_view path,
                          const ResolveRef& resolve) {
  const std::string_view type = spec.type;
  if (type == "bool") return check_bool(spec, v, path);
  if (type == "int") return check_integer(spec, v, path);
  if (type == "enum") return check_enum(spec, v, path);
  if (type == "pose") return check_pose(spec, v, path);
  if (type.starts_with("ref:")) return check_ref(spec, v, path, resolve);
  if (type == "real") {
    RMP_TRY_ASSIGN(const double read, read_real(spec, v, path));
    RMP_TRY_ASSIGN(const double checked, check_range(spec, read, path));
    return Value(checked);
  }
  if (type == "string" || type == "path") {
    if (!v.as_string()) return wrong_type(spec, v, path);
    if (type == "path" &&
        (v.as_string()->empty() || v.as_string()->find('\0') != std::string::npos))
      return fault(path, shown(v) + " is not a path", "Give the path of a file in quotes.");
    return v;
  }
  if (type == "real[]" || type == "vec3") {
    RMP_TRY_ASSIGN(auto numbers, read_reals(spec, v, path));
    if (!numbers) return wrong_type(spec, v, path);
    if (type == "vec3" && numbers->size() != 3)
      return wrong_count(path,
                         numbers_given(numbers->size()) + "; " + kind_name(spec) + " are needed",
                         example(spec));
    return Value(NumericArray(
        std::move(*numbers), is_dimensionless(spec.unit) ? std::string() : std::string(spec.unit)));
  }
  if (type == "matrix") {
    RMP_TRY_ASSIGN(auto matrix, read_matrix(spec, v, path));
    if (!matrix) return wrong_type(spec, v, path);
    return Value(std::move(*matrix));
  }
  if (type == "list") {
    if (v.as_list()) return v;
    if (v.as_map() && v.as_map()->empty()) return Value(List());
    if (const NumericArray* a = v.as_array(); a && !a->is_matrix())
      return Value(List(a->data().begin(), a->data().end()));
    return wrong_type(spec, v, path);
  }
  if (type == "map") {
    if (v.as_map()) return v;
    if (v.as_list() && v.as_list()->empty()) return Value(Map());
    return wrong_type(spec, v, path);
  }
  return error(ErrorCode::internal, "the schema has the unknown type " + text::quote(type), {},
               std::string(path));
}

namespace {

/// A parameter whose type has details or notes.
Result<Value> check_detailed(const ParamSpec& spec, std::string_view plain, const Value& v,
                             std::string_view path, const ResolveRef& resolve) {
  const TypeTree& tree = type_tree(spec.type);
  PlainSpec one = plain_spec(spec, plain);
  if (one.unit.empty()) one.unit = tree.unit;
  std::vector<std::string> words;
  if (one.choices.empty() && !tree.choices.empty()) {
    for (const WordInfo& w : tree.choices) words.push_back(w.word);
    one.choices = words;
  }
  RMP_TRY_ASSIGN(Value checked, check_plain(one, v, path, resolve));
  RMP_TRY(check_count(tree, checked, path));
  return checked;
}

/// check_value() of a parameter whose plain type is known.
Result<Value> check_as(const ParamSpec& spec, std::string_view plain, const Value& v,
                       std::string_view path, const ResolveRef& resolve) {
  if (plain == "any") return v;
  return plain == spec.type ? check_plain(plain_spec(spec, plain), v, path, resolve)
                            : check_detailed(spec, plain, v, path, resolve);
}

}  // namespace

Result<Value> check_value(const ParamSpec& spec, const Value& v, std::string_view path,
                          const ResolveRef& resolve) {
  return check_as(spec, plain_type(spec.type), v, path, resolve);
}

namespace {

/// A path of a session whose files lie in a folder, as the path there.
Result<Value> confined(const Value& v, const std::string& name) {
  auto path = permitted_name(*v.as_string());
  if (!path.ok()) return std::move(path).error().in(name);
  return Value(path->string());
}

}  // namespace

Error missing_argument(const ParamSpec& spec, std::string_view path) {
  const std::string_view type = plain_type(spec.type);
  const PlainSpec plain = plain_spec(spec, type);
  return fault(path,
               type == "any" && !spec.doc.empty()
                   ? doc_words(spec.doc) + " required"
                   : "no value is given; " + kind_name(plain) + (type == "vec3" ? " are" : " is") +
                         " required",
               example(plain), "argument.missing");
}

Fault unknown_argument(const Schema& schema, std::string_view name, std::string_view path) {
  std::vector<std::string> known;
  for (const ParamSpec& spec : schema) known.push_back(spec.name);
  std::string hint = text::did_you_mean(name, known);
  if (hint.empty())
    hint =
        known.empty() ? "It takes no parameters." : "Parameters: " + text::enumerate(known) + ".";
  Fault f = make_fault("argument.unknown", text::quote(name) + " is not a parameter",
                       std::move(hint), std::string(path));
  f.subject.argument =
      subject_path((path.empty() ? "" : std::string(path) + ".") + std::string(name));
  return f;
}

namespace {

std::vector<Fault> unknown_arguments(const Schema& schema, const Map& given,
                                     const ResolveRef& resolve) {
  constexpr std::size_t kMost = 10;  // that are named
  std::size_t unknown = 0;
  std::vector<Fault> out;
  for (const auto& [key, value] : given) {
    if (find_param(schema, key) || ++unknown > kMost) continue;
    out.push_back(unknown_argument(schema, key, {}));
    add_remedies(out.back(), schema, given, resolve);
  }
  if (unknown > kMost)
    out.push_back(make_fault("argument.unknown", std::to_string(unknown - kMost) +
                                                     " further names are not parameters either"));
  return out;
}

}  // namespace

Result<Map> check(const Schema& schema, const Map& given, const ResolveRef& resolve) {
  std::vector<Fault> faults;
  const auto add = [&](const Error& e, std::string_view name) {
    faults.push_back(argument_fault(e, name));
    add_remedies(faults.back(), schema, given, resolve);
  };
  Map checked;
  std::size_t known = 0;
  for (const ParamSpec& spec : schema) {
    const Value* v = given.find(spec.name);
    if (v) ++known;
    if (v && v->is_nil() && plain_type(spec.type) != "any") v = nullptr;
    if (!v && spec.default_value) v = &*spec.default_value;
    if (!v) {
      if (spec.required) add(missing_argument(spec, spec.name), spec.name);
      continue;
    }
    const std::string_view type = plain_type(spec.type);
    Result<Value> one = check_as(spec, type, *v, spec.name, resolve);
    if (type == "path" && one.ok() && current_file_root()) one = confined(*one, spec.name);
    if (!one.ok()) {
      add(one.error(), spec.name);
      continue;
    }
    const bool is_given = !spec.default_value || v != &*spec.default_value;
    if (is_given && !one->is_nil() && has_unchecked_parts(spec, type)) {
      std::vector<Fault> parts = part_faults(spec, *one, spec.name);
      if (!parts.empty()) {
        for (Fault& f : parts) {
          faults.push_back(std::move(f));
          add_remedies(faults.back(), schema, given, resolve);
        }
        continue;
      }
    }
    checked.append(spec.name, std::move(*one));
  }
  if (known != given.size()) {
    std::vector<Fault> unknown = unknown_arguments(schema, given, resolve);
    faults.insert(faults.begin(), std::make_move_iterator(unknown.begin()),
                  std::make_move_iterator(unknown.end()));
  }
  if (!faults.empty()) return error_of(std::move(faults));
  return checked;
}

std::string describe(const ParamSpec& spec) {
  const TypeTree& tree = type_tree(spec.type);
  const bool is_enum = tree.kind == TypeKind::word;
  std::string s = spec.name + ": ";
  if (plain_type(spec.type) == spec.type) {
    s += spec.type + (is_enum ? " " + text::join(spec.choices, "|") : "");
  } else {
    s += is_enum && tree.choices.empty() ? "enum " + text::join(spec.choices, "|")
                                         : type_words(tree);
  }
  if (tree.unit.empty() && !is_dimensionless(spec.unit)) s += " [" + spec.unit + "]";
  if (spec.default_value) {
    const bool quoted = spec.default_value->as_string() && !is_enum;
    s += " = " +
         (quoted ? text::quote(*spec.default_value->as_string()) : spec.default_value->text());
  } else {
    s += spec.required ? ", required" : ", optional";
  }
  if (const std::string range = range_text(plain_spec(spec, spec.type)); !range.empty())
    s += ", " + range;
  s += ".";
  if (!spec.doc.empty()) {
    s += " " + spec.doc;
    if (s.back() != '.') s += ".";
  }
  return s;
}

Result<Schema> schema_from(std::span<const rmp_param> table) {
  Schema schema;
  for (std::size_t i = 0; i < table.size(); ++i) {
    const rmp_param& row = table[i];
    const auto malformed = [&](const std::string& why) {
      const std::string name =
          row.name && *row.name ? text::quote(row.name) : "row " + std::to_string(i + 1);
      return error(ErrorCode::plugin_refused, "parameter " + name + " " + why);
    };
    if (!row.name || !*row.name) return malformed("has no name");
    if (!row.type) return malformed("has the unknown type \"(null)\"");
    if (const std::string bad = type_fault(row.type); !bad.empty())
      return malformed("has the unknown type " + text::quote(row.type) +
                       (std::string_view(row.type).find_first_of(" (<{:@") == std::string_view::npos
                            ? std::string()
                            : ": " + bad));
    const TypeTree& tree = type_tree(row.type);
    ParamSpec spec;
    spec.name = row.name;
    spec.type = row.type;
    spec.unit = row.unit ? row.unit : "";
    spec.doc = row.doc ? row.doc : "";
    if (find_param(schema, spec.name)) return malformed("is in the table twice");
    if (auto unit = units::parse(spec.unit); !unit.ok())
      return malformed("has a bad unit: " + unit.error().message);
    if (std::isnan(row.min) || std::isnan(row.max))
      return malformed("has a range that is not a number");
    if (spec.unit.empty()) spec.unit = tree.unit;
    if (row.min <= row.max) {
      spec.min = row.min;
      spec.max = row.max;
    } else {
      spec.min = tree.notes.min.value_or(spec.min);
      spec.max = tree.notes.max.value_or(spec.max);
      spec.infinite = tree.notes.is_infinite;
    }
    if (row.choices)
      for (const std::string_view choice : text::split(row.choices, '|'))
        spec.choices.emplace_back(text::trim(choice));
    if (spec.choices.empty())
      for (const WordInfo& w : tree.choices) spec.choices.push_back(w.word);
    if (tree.kind == TypeKind::word && spec.choices.empty())
      return malformed("is an enum without choices");
    spec.required = row.default_text == nullptr && (row.flags & RMP_OPTIONAL) == 0;
    spec.label = row.label ? row.label : "";
    spec.group = row.group ? row.group : "";
    if (row.default_text) {
      spec.default_value = Value(row.default_text);
      if (tree.kind != TypeKind::reference) {
        auto checked = check_value(spec, *spec.default_value, "default");
        if (!checked.ok()) return malformed("has a bad default: " + checked.error().message);
        spec.default_value = std::move(*checked);
      }
    }
    schema.push_back(std::move(spec));
  }
  if (const std::string bad = schema_fault(schema); !bad.empty())
    return error(ErrorCode::plugin_refused, "parameter " + bad);
  return schema;
}

Result<Schema> schema_from(const rmp_provider& provider) {
  std::vector<rmp_param> table;
  for (std::uint32_t i = 0; i < provider.param_count; ++i)
    table.push_back(rmp_param_at(provider, i));
  return schema_from(table);
}

namespace {

class MapParams final : public Params {
 public:
  explicit MapParams(Map map) : map_(std::move(map)) {
    // reals() hands out spans, so lists are turned into stored numbers once.
    for (const auto& [name, value] : map_) {
      if (const NumericArray* a = value.as_array()) {
        arrays_.emplace(name, a->data());
      } else if (const List* list = value.as_list()) {
        std::vector<double> numbers;
        for (const Value& v : *list)
          if (v.is_number()) numbers.push_back(v.number());
        if (numbers.size() == list->size()) arrays_.emplace(name, std::move(numbers));
      }
    }
  }
  [[nodiscard]] bool has(std::string_view name) const override {
    return map_.find(name) != nullptr;
  }
  [[nodiscard]] double real(std::string_view name) const override {
    const Value* v = map_.find(name);
    return v ? v->number() : 0;
  }
  [[nodiscard]] long long integer(std::string_view name) const override {
    const Value* v = map_.find(name);
    return v && v->as_int() ? *v->as_int() : 0;
  }
  [[nodiscard]] bool boolean(std::string_view name) const override {
    const Value* v = map_.find(name);
    return v && v->as_bool() && *v->as_bool();
  }
  [[nodiscard]] std::string_view text(std::string_view name) const override {
    const Value* v = map_.find(name);
    return v && v->as_string() ? std::string_view(*v->as_string()) : std::string_view();
  }
  [[nodiscard]] std::span<const double> reals(std::string_view name) const override {
    const auto it = arrays_.find(name);
    return it == arrays_.end() ? std::span<const double>() : std::span<const double>(it->second);
  }
  [[nodiscard]] Pose pose(std::string_view name) const override {
    const Value* v = map_.find(name);
    return (v ? pose_from(*v) : std::nullopt).value_or(Pose{});
  }

 private:
  Map map_;
  std::map<std::string, std::vector<double>, std::less<>> arrays_;
};

}  // namespace

std::unique_ptr<Params> make_params(Map checked) {
  return std::make_unique<MapParams>(std::move(checked));
}

Value pose_value(const Pose& t) {
  return NumericArray({t.R[0], t.R[1], t.R[2], t.p[0], t.R[3], t.R[4], t.R[5], t.p[1], t.R[6],
                       t.R[7], t.R[8], t.p[2], 0, 0, 0, 1},
                      4, 4);
}

std::optional<Pose> pose_from(const Value& v) {
  const NumericArray* a = v.as_array();
  if (!a || a->rows() != 4 || a->cols() != 4) return std::nullopt;
  const auto& m = a->data();
  return Pose{{m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]}, {m[3], m[7], m[11]}};
}

}  // namespace robomosp
