// SPDX-License-Identifier: Apache-2.0
// Functions of numbers that programs of robots have, in degrees: one implementation for the
// compiler that folds constants, for the machine that runs, and for posts (layer: contract helper,
// inline only, not part of the ABI).
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string_view>

namespace robomosp {

enum class NumberFunction : std::uint8_t {
  sin,
  cos,
  tan,
  asin,
  acos,
  atan,
  atan2,
  sqrt,
  exp,
  ln,
  abs,
  trunc,
  round,
  same
};

/// By its name in capitals; FLOAT, CHR and ORD are `same`. Nothing = it is none of these.
[[nodiscard]] inline std::optional<NumberFunction> number_function(std::string_view name) {
  using F = NumberFunction;
  struct Row {
    std::string_view name;
    F function;
  };
  constexpr Row kAll[] = {
      {"SIN", F::sin},     {"COS", F::cos},    {"TAN", F::tan},     {"ASIN", F::asin},
      {"ACOS", F::acos},   {"ATAN", F::atan},  {"ATAN2", F::atan2}, {"SQRT", F::sqrt},
      {"EXP", F::exp},     {"LN", F::ln},      {"ABS", F::abs},     {"TRUNC", F::trunc},
      {"ROUND", F::round}, {"FLOAT", F::same}, {"CHR", F::same},    {"ORD", F::same}};
  for (const Row& r : kAll)
    if (r.name == name) return r.function;
  return std::nullopt;
}

inline constexpr double kDegreesPerRadian = 57.29577951308232;

/// Sine of degrees, exact at multiples of 90.
[[nodiscard]] inline double sine_of_degrees(double x) {
  const double r = std::fmod(x, 360.0);
  if (std::fmod(r, 90.0) == 0.0) {
    const int quarter = (static_cast<int>(r / 90.0) + 4) % 4;
    return quarter == 1 ? 1.0 : quarter == 3 ? -1.0 : 0.0;
  }
  return std::sin(r / kDegreesPerRadian);
}
[[nodiscard]] inline double cosine_of_degrees(double x) {
  return sine_of_degrees(std::fmod(x, 360.0) + 90.0);
}

/// Value of a function; ATAN2 takes y and x, the others one number. Nothing = it has none there.
[[nodiscard]] inline std::optional<double> number_value(NumberFunction f,
                                                        std::span<const double> x) {
  using F = NumberFunction;
  double y = std::numeric_limits<double>::quiet_NaN();
  switch (f) {
    case F::sin: y = sine_of_degrees(x[0]); break;
    case F::cos: y = cosine_of_degrees(x[0]); break;
    case F::tan:
      if (const double r = std::fmod(x[0], 180.0); r != 90.0 && r != -90.0)
        y = r == 0.0 ? 0.0 : std::tan(std::fmod(x[0], 360.0) / kDegreesPerRadian);
      break;
    case F::asin:
      if (x[0] >= -1 && x[0] <= 1) y = std::asin(x[0]) * kDegreesPerRadian;
      break;
    case F::acos:
      if (x[0] >= -1 && x[0] <= 1) y = std::acos(x[0]) * kDegreesPerRadian;
      break;
    case F::atan: y = std::atan(x[0]) * kDegreesPerRadian; break;
    case F::atan2:
      if (x.size() > 1 && (x[0] != 0 || x[1] != 0)) y = std::atan2(x[0], x[1]) * kDegreesPerRadian;
      break;
    case F::sqrt:
      if (x[0] >= 0) y = std::sqrt(x[0]);
      break;
    case F::exp: y = std::exp(x[0]); break;
    case F::ln:
      if (x[0] > 0) y = std::log(x[0]);
      break;
    case F::abs: y = std::fabs(x[0]); break;
    case F::trunc: y = std::trunc(x[0]); break;
    case F::round: y = std::round(x[0]); break;
    case F::same: y = x[0]; break;
  }
  if (!std::isfinite(y)) return std::nullopt;
  return y;
}

}  // namespace robomosp
