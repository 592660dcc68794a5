// SPDX-License-Identifier: Apache-2.0
// Help for posts: numbers and texts as controllers write them (layer: contract helper, inline
// only, not part of the ABI).
#pragma once

#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <string>
#include <string_view>

#include <robomosp/sdk/post.h>

namespace robomosp::post {

inline constexpr double kDegree = 57.29577951308232;  ///< degrees of a radian

/// Digits behind the point that a length [mm or m], an angle [degrees or radians], a time [s] or a
/// component of a unit vector has in a file; what a computation leaves below them is rounding
/// errors, which differ between processors.
inline constexpr int kUnitDigits = 9;
/// Significant digits of a number without a unit, such as a REAL of the program.
inline constexpr int kSignificantDigits = 12;

/// v rounded to the nearest decimal number with two digits more than kUnitDigits behind the point:
/// above rounding errors, and fine enough to be rounded again. Not finite or from 1e15 on: v
/// itself.
[[nodiscard]] inline double without_rounding_errors(double v) {
  if (!(std::fabs(v) < 1e15)) return v;
  char buffer[40];
  const auto r =
      std::to_chars(buffer, buffer + sizeof buffer, v, std::chars_format::fixed, kUnitDigits + 2);
  double out = v;
  std::from_chars(buffer, r.ptr, out);
  return out == 0 ? 0.0 : out;
}
/// v rounded to kSignificantDigits significant digits, or to kUnitDigits digits behind the point
/// where those are more, yet never beyond 15 significant ones. Whole numbers below 2^53 and numbers
/// that are not finite: v itself.
[[nodiscard]] inline double rounded_to_meaning(double v) {
  constexpr double kExactWhole = 9007199254740992.0;
  constexpr int kReliable = 15;  // decimal digits that every double keeps
  if (!std::isfinite(v) || (v == std::trunc(v) && std::fabs(v) < kExactWhole))
    return v == 0 ? 0.0 : v;
  char buffer[40];
  const auto digits = [&](int count) {
    return std::to_chars(buffer, buffer + sizeof buffer, v, std::chars_format::scientific,
                         count - 1)
        .ptr;
  };
  const char* end = digits(kSignificantDigits);
  const char* e = std::find(static_cast<const char*>(buffer), end, 'e') + 1;
  int exponent = 0;
  std::from_chars(*e == '+' ? e + 1 : e, end, exponent);
  const int count = std::min(kUnitDigits + 1 + exponent, kReliable);
  if (count > kSignificantDigits) end = digits(count);
  double out = v;
  std::from_chars(buffer, end, out);
  return std::isfinite(out) ? out : v;
}

/// With so many digits behind the point, without the locale and without -0. Not finite: "nan".
/// Values that differ by rounding errors give one text, also where they lie about half a last
/// digit; more than kUnitDigits digits are those of a number without a unit.
[[nodiscard]] inline std::string fixed(double v, int digits) {
  if (!std::isfinite(v)) return "nan";
  v = digits <= kUnitDigits ? without_rounding_errors(v) : rounded_to_meaning(v);
  char buffer[400];
  const auto r = std::to_chars(buffer, buffer + sizeof buffer, v, std::chars_format::fixed,
                               std::clamp(digits, 0, 17));
  std::string s(buffer, r.ptr);
  if (s[0] == '-' && s.find_first_not_of("-0.") == std::string::npos) s.erase(0, 1);
  return s;
}
/// The same without zeros at its end, and with at least `least` digits behind the point.
[[nodiscard]] inline std::string trimmed(double v, int digits, int least = 0) {
  std::string s = fixed(v, digits);
  const std::size_t point = s.find('.');
  if (point == std::string::npos) return s;
  while (s.back() == '0' && s.size() > point + 1 + static_cast<std::size_t>(least)) s.pop_back();
  if (s.back() == '.') s.pop_back();
  return s;
}
/// A number with a unit or a component of a unit vector, all kUnitDigits digits behind the point,
/// without zeros at its end: "12.5", "0.0".
[[nodiscard]] inline std::string with_unit_digits(double v) { return trimmed(v, kUnitDigits, 1); }
/// A number without a unit, rounded to its meaning: the shortest text that reads as that, always
/// with a point; exponents as "1.0E-7".
[[nodiscard]] inline std::string shortest(double v) {
  if (!std::isfinite(v)) return "nan";
  v = rounded_to_meaning(v);
  char buffer[64];
  std::string s(buffer, std::to_chars(buffer, buffer + sizeof buffer, v).ptr);
  const std::size_t e = s.find('e');
  if (e != std::string::npos) {
    std::string exponent = s.substr(e + 1);
    if (exponent[0] == '+') exponent.erase(0, 1);
    s.resize(e);
    if (s.find('.') == std::string::npos) s += ".0";
    return s + "E" + exponent;
  }
  return s.find('.') == std::string::npos ? s + ".0" : s;
}
/// The same without an exponent, however long it gets.
[[nodiscard]] inline std::string without_exponent(double v) {
  if (!std::isfinite(v)) return "nan";
  char buffer[1200];
  const auto r = std::to_chars(buffer, buffer + sizeof buffer, rounded_to_meaning(v),
                               std::chars_format::fixed);
  std::string s(buffer, r.ptr);
  return s.find('.') == std::string::npos ? s + ".0" : s;
}
[[nodiscard]] inline std::string upper(std::string_view s) {
  std::string out(s);
  for (char& c : out)
    if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
  return out;
}
[[nodiscard]] inline std::string lower(std::string_view s) {
  std::string out(s);
  for (char& c : out)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return out;
}

}  // namespace robomosp::post
