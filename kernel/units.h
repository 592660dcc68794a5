// SPDX-License-Identifier: Apache-2.0
// Units: names like "mm", "deg", "N m", "kg/m^3" with their factor to SI and dimension (layer:
// core). Angles have a separate dimension, so that 90 mm is not an angle.
#pragma once

#include <array>
#include <string>
#include <string_view>

#include <robomosp/sdk/result.h>

namespace robomosp::units {

/// Exponents of metre, kilogram, second, radian.
using Dimension = std::array<int, 4>;

struct Unit {
  double factor = 1;  ///< SI value of one unit
  Dimension dimension{};
};

/// Reads a unit: products by space, `*` or `.`, quotients by `/`, powers by `^` ("kg m^2", "mm/s").
/// "" is dimensionless.
[[nodiscard]] Result<Unit> parse(std::string_view name);
/// True if `word` alone names a unit: "mm", "deg", "%".
[[nodiscard]] bool is_unit(std::string_view word);
/// The same, or a longer spelling such as "degrees", "inch" or the degree sign. These are units behind a
/// number only, so that parameters may have such names.
[[nodiscard]] bool is_unit_behind_number(std::string_view word);

/// "a length", "an angle", "a number without a unit", or "a quantity in kg m^5".
[[nodiscard]] std::string kind_of(const Dimension&);
/// The unit in SI: "m", "rad/s", "N m", "kg m^5"; "" = dimensionless.
[[nodiscard]] std::string si_name(const Dimension&);

/// Converts a number from `unit` to SI and back. Units that divide by an integer (mm, g, ms) are
/// converted by division, so that 35 mm gives the same bits as 0.035.
[[nodiscard]] double to_si(double value, const Unit& unit);
[[nodiscard]] double from_si(double si, const Unit& unit);

/// Reads "20 mm", "90deg", "0.5" for a quantity of SI unit `si_unit`; a bare number is SI.
/// A unit of another dimension is an error that names both.
[[nodiscard]] Result<double> read_quantity(std::string_view s, std::string_view si_unit);

/// A text for files that reads back to the same bits: SI or the customary unit (mm for m, deg for
/// rad), whichever round-trips and is shorter; the unit is always written unless SI.
[[nodiscard]] std::string print_quantity(double si, std::string_view si_unit);
/// The same, always with the unit: "0.48 m", "20 mm", "3"; of equally long texts the customary
/// unit.
[[nodiscard]] std::string print_with_unit(double si, std::string_view si_unit);

}  // namespace robomosp::units
