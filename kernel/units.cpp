// SPDX-License-Identifier: Apache-2.0
#include "kernel/units.h"

#include <charconv>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "kernel/text.h"

namespace robomosp::units {
namespace {

struct Named {
  std::string_view name;
  double factor;
  Dimension dimension;  // m kg s rad
};

constexpr double kPi = std::numbers::pi;
constexpr Dimension kNone{0, 0, 0, 0};
// Factors of inch, foot and pound are the exact ones of the 1959 agreement.
constexpr Named kUnits[] = {
    {"m", 1, {1, 0, 0, 0}},
    {"mm", 1e-3, {1, 0, 0, 0}},
    {"cm", 1e-2, {1, 0, 0, 0}},
    {"um", 1e-6, {1, 0, 0, 0}},
    {"km", 1e3, {1, 0, 0, 0}},
    {"in", 0.0254, {1, 0, 0, 0}},
    {"ft", 0.3048, {1, 0, 0, 0}},
    {"kg", 1, {0, 1, 0, 0}},
    {"g", 1e-3, {0, 1, 0, 0}},
    {"t", 1e3, {0, 1, 0, 0}},
    {"lb", 0.45359237, {0, 1, 0, 0}},
    {"s", 1, {0, 0, 1, 0}},
    {"ms", 1e-3, {0, 0, 1, 0}},
    {"min", 60, {0, 0, 1, 0}},
    {"h", 3600, {0, 0, 1, 0}},
    {"rad", 1, {0, 0, 0, 1}},
    {"deg", kPi / 180, {0, 0, 0, 1}},
    {"mrad", 1e-3, {0, 0, 0, 1}},
    {"rev", 2 * kPi, {0, 0, 0, 1}},
    {"rpm", kPi / 30, {0, 0, -1, 1}},
    {"N", 1, {1, 1, -2, 0}},
    {"kN", 1e3, {1, 1, -2, 0}},
    {"Nm", 1, {2, 1, -2, 0}},
    {"J", 1, {2, 1, -2, 0}},
    {"kJ", 1e3, {2, 1, -2, 0}},
    {"W", 1, {2, 1, -3, 0}},
    {"kW", 1e3, {2, 1, -3, 0}},
    {"Pa", 1, {-1, 1, -2, 0}},
    {"kPa", 1e3, {-1, 1, -2, 0}},
    {"MPa", 1e6, {-1, 1, -2, 0}},
    {"GPa", 1e9, {-1, 1, -2, 0}},
    {"bar", 1e5, {-1, 1, -2, 0}},
    {"Hz", 1, {0, 0, -1, 0}},
    {"%", 1e-2, kNone},
    {"1", 1, kNone},
};

/// Other spellings of these, as people write them.
struct Spelling {
  std::string_view written, name;
};
constexpr Spelling kSpellings[] = {
    {"\u00b0", "deg"},     {"degree", "deg"},      {"degrees", "deg"},    {"radian", "rad"},
    {"radians", "rad"},    {"inch", "in"},         {"inches", "in"},      {"foot", "ft"},
    {"feet", "ft"},        {"metre", "m"},         {"metres", "m"},       {"meter", "m"},
    {"meters", "m"},       {"millimetre", "mm"},   {"millimetres", "mm"}, {"millimeter", "mm"},
    {"millimeters", "mm"}, {"centimetre", "cm"},   {"centimetres", "cm"}, {"centimeter", "cm"},
    {"centimeters", "cm"}, {"\u00b5m", "um"},      {"\u03bcm", "um"},     {"second", "s"},
    {"seconds", "s"},      {"sec", "s"},           {"minute", "min"},     {"minutes", "min"},
    {"hour", "h"},         {"hours", "h"},         {"newton", "N"},       {"newtons", "N"},
    {"gram", "g"},         {"grams", "g"},         {"kilogram", "kg"},    {"kilograms", "kg"},
    {"revolution", "rev"}, {"revolutions", "rev"}, {"percent", "%"}};

struct NamedDimension {
  Dimension dimension;
  std::string_view name;  // with its article
  std::string_view si;    // "" = written from the exponents
};
constexpr NamedDimension kDimensions[] = {
    {kNone, "a number without a unit", ""},
    {{1, 0, 0, 0}, "a length", ""},
    {{2, 0, 0, 0}, "an area", ""},
    {{3, 0, 0, 0}, "a volume", ""},
    {{0, 1, 0, 0}, "a mass", ""},
    {{0, 0, 1, 0}, "a time", ""},
    {{0, 0, 0, 1}, "an angle", ""},
    {{1, 0, -1, 0}, "a speed", ""},
    {{1, 0, -2, 0}, "an acceleration", ""},
    {{1, 0, -3, 0}, "a jerk", ""},
    {{0, 0, -1, 1}, "an angular speed", ""},
    {{0, 0, -2, 1}, "an angular acceleration", ""},
    {{0, 0, -1, 0}, "a frequency", "Hz"},
    {{1, 1, -2, 0}, "a force", "N"},
    {{2, 1, -2, 0}, "a torque or energy", "N m"},
    {{2, 1, -3, 0}, "a power", "W"},
    {{-1, 1, -2, 0}, "a pressure", "Pa"},
    {{-3, 1, 0, 0}, "a density", ""},
    {{2, 1, 0, 0}, "a moment of inertia", ""},
};

const Named* find_unit(std::string_view name) {
  for (const Named& u : kUnits)
    if (u.name == name) return &u;
  return nullptr;
}

const Named* find_spelling(std::string_view written) {
  for (const Spelling& s : kSpellings)
    if (s.written == written) return find_unit(s.name);
  return nullptr;
}

Error unknown_unit(std::string_view name) {
  std::vector<std::string> names;
  for (const Named& u : kUnits)
    if (u.name != "1") names.emplace_back(u.name);
  std::string hint = text::did_you_mean(name, names);
  if (hint.empty())
    hint = "Units are " + text::enumerate(names) + ", and products such as \"N m\" or \"kg/m^3\".";
  return error(ErrorCode::invalid_argument, text::quote(name) + " is not a unit", std::move(hint));
}

Error malformed(std::string_view name) {
  return error(
      ErrorCode::invalid_argument, text::quote(name) + " is not a unit",
      "Write products with a space, quotients with / and powers with ^, such as \"kg m^2/s\".");
}

/// "a length" or, for a dimension without a name, "a quantity in kg m^3" with the unit as written.
std::string kind_of(const Unit& unit, std::string_view written) {
  for (const NamedDimension& d : kDimensions)
    if (d.dimension == unit.dimension) return std::string(d.name);
  return "a quantity in " + std::string(written);
}

struct Customary {
  std::string_view si, name;
};
constexpr Customary kCustomary[] = {
    {"m", "mm"}, {"rad", "deg"}, {"rad/s", "deg/s"}, {"rad/s^2", "deg/s^2"}};

}  // namespace

bool is_unit(std::string_view word) { return find_unit(word) != nullptr; }
bool is_unit_behind_number(std::string_view word) {
  return find_unit(word) != nullptr || find_spelling(word) != nullptr;
}

std::string kind_of(const Dimension& dimension) {
  return kind_of(Unit{1, dimension}, si_name(dimension));
}

std::string si_name(const Dimension& dimension) {
  for (const NamedDimension& d : kDimensions)
    if (d.dimension == dimension && !d.si.empty()) return std::string(d.si);
  constexpr std::string_view kNames[] = {"kg", "m", "s", "rad"};
  constexpr std::size_t kIndex[] = {1, 0, 2, 3};  // mass is written first: kg m^2
  const auto powers = [&](bool above, std::string_view separator) {
    std::string s;
    for (std::size_t i = 0; i < std::size(kNames); ++i) {
      const int power = above ? dimension[kIndex[i]] : -dimension[kIndex[i]];
      if (power <= 0) continue;
      if (!s.empty()) s += separator;
      s += kNames[i];
      if (power > 1) s += "^" + std::to_string(power);
    }
    return s;
  };
  const std::string above = powers(true, " "), below = powers(false, "/");
  if (!above.empty()) return below.empty() ? above : above + "/" + below;
  std::string s;
  for (std::size_t i = 0; i < std::size(kNames); ++i)
    if (const int power = dimension[kIndex[i]]; power != 0)
      s += (s.empty() ? "" : " ") + std::string(kNames[i]) + "^" + std::to_string(power);
  return s;
}

double to_si(double value, const Unit& unit) {
  // 35 mm is 35 / 1000, correctly rounded, and not 35 * 0.001, which is one bit off.
  const double divisor = std::round(1 / unit.factor);
  return unit.factor < 1 && 1 / divisor == unit.factor ? value / divisor : value * unit.factor;
}

double from_si(double si, const Unit& unit) {
  const double divisor = std::round(1 / unit.factor);
  return unit.factor < 1 && 1 / divisor == unit.factor ? si * divisor : si / unit.factor;
}

Result<Unit> parse(std::string_view name) {
  Unit unit;
  std::string_view rest = text::trim(name);
  if (rest.empty()) return unit;
  int sign = 1;
  for (;;) {
    const std::size_t length = std::min(rest.find_first_of(" *./^"), rest.size());
    const std::string_view word = rest.substr(0, length);
    if (word.empty()) return malformed(name);
    const Named* named = find_unit(word);
    if (!named) named = find_spelling(word);
    if (!named) return unknown_unit(word);
    rest.remove_prefix(length);
    int power = 1;
    if (!rest.empty() && rest.front() == '^') {
      rest.remove_prefix(1);
      const auto end = std::from_chars(rest.data(), rest.data() + rest.size(), power);
      if (end.ec != std::errc() || power == 0 || power < -9 || power > 9) return malformed(name);
      rest.remove_prefix(static_cast<std::size_t>(end.ptr - rest.data()));
    }
    power *= sign;
    // Multiply or divide step by step: 1/min is 1/60 and not pow(60, -1).
    for (int i = 0; i < std::abs(power); ++i)
      unit.factor = power > 0 ? unit.factor * named->factor : unit.factor / named->factor;
    for (std::size_t i = 0; i < unit.dimension.size(); ++i) {
      unit.dimension[i] += power * named->dimension[i];
      if (std::abs(unit.dimension[i]) > 99) return malformed(name);
    }
    if (rest.empty()) return unit;
    // Separator: spaces, and at most one of * . /
    const std::string_view before = rest;
    rest = text::trim(rest);
    sign = 1;
    if (rest.front() == '/' || rest.front() == '*' || rest.front() == '.') {
      sign = rest.front() == '/' ? -1 : 1;
      rest = text::trim(rest.substr(1));
    } else if (rest.size() == before.size()) {
      return malformed(name);
    }
    if (rest.empty()) return malformed(name);
  }
}

Result<double> read_quantity(std::string_view s, std::string_view si_unit) {
  s = text::trim(s);
  std::string_view number = s;
  if (number.size() > 1 && number[0] == '+' && number[1] != '-' && number[1] != '+')
    number.remove_prefix(1);
  double value = 0;
  const auto end = std::from_chars(number.data(), number.data() + number.size(), value);
  if (end.ec == std::errc::result_out_of_range)
    return error(ErrorCode::invalid_argument,
                 text::quote(s) + " is outside the range of real numbers");
  if (end.ec != std::errc())
    return error(ErrorCode::invalid_argument, text::quote(s) + " is not a number");
  const std::string_view written =
      text::trim(number.substr(static_cast<std::size_t>(end.ptr - number.data())));
  if (written.empty()) return value;
  RMP_TRY_ASSIGN(const Unit unit, parse(written));
  RMP_TRY_ASSIGN(const Unit expected, parse(si_unit));
  if (unit.dimension != expected.dimension) {
    std::string want = kind_of(expected, si_unit);
    if (!si_unit.empty() && !want.ends_with(si_unit)) want += " (" + std::string(si_unit) + ")";
    return error(ErrorCode::invalid_argument,
                 std::string(s) + " is " + kind_of(unit, written) + "; " + want + " is expected");
  }
  return to_si(value, unit);
}

namespace {

/// The shorter of `plain` (the number in SI) and the number in the customary unit that reads back
/// to the same bits.
std::string shorter(std::string plain, double si, std::string_view si_unit,
                    bool prefers_customary) {
  if (!std::isfinite(si) || si == 0) return plain;
  for (const Customary& c : kCustomary) {
    if (c.si != si_unit) continue;
    const Result<Unit> unit = parse(c.name);
    const std::string number = text::print_rounded(from_si(si, *unit), 12);
    const auto back = text::read_real(number);
    std::string candidate = number + " " + std::string(c.name);
    if (back && to_si(*back, *unit) == si &&
        candidate.size() < plain.size() + (prefers_customary ? 1 : 0))
      plain = std::move(candidate);
  }
  return plain;
}

}  // namespace

std::string print_quantity(double si, std::string_view si_unit) {
  return shorter(text::print(si), si, si_unit, false);
}

std::string print_with_unit(double si, std::string_view si_unit) {
  const std::string number = text::print(si);
  if (si_unit.empty()) return number;
  return shorter(number + " " + std::string(si_unit), si, si_unit, true);
}

}  // namespace robomosp::units
