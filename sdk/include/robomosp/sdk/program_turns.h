// SPDX-License-Identifier: Apache-2.0
// Whole turns of joints: TURNS of a ROBTARGET, and what controllers count (layer: contract helper,
// inline only, not part of the ABI).
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include <robomosp/sdk/program_tables.h>

namespace robomosp {

/// Where turn 0 begins [degrees], unless the cell says otherwise: -180, so that 0 is up to half a
/// turn in either direction. A cell may set R_TURNS_FROM := 0: turn 0 is 0 to 360, turn -1 what is
/// negative.
inline constexpr double kTurnsFrom = -180;
/// A turn that is not given: whichever is nearest (-100 and less).
inline constexpr std::int32_t kAnyTurn = -128;
[[nodiscard]] inline bool is_any_turn(std::int32_t turn) { return turn <= -100; }
/// How far beyond a turn's ends an angle still counts as within [degrees]: digits that were
/// rounded.
inline constexpr double kTurnSlack = 0.05;

/// The turn that an angle [degrees] is in. Half a turn is turn 0 from either side where `from` is
/// -180.
[[nodiscard]] inline std::int32_t turn_of(double degrees, double from = kTurnsFrom) {
  const double t = (degrees - from) / 360;
  const double whole = from < 0 && std::fabs(degrees) <= -from + 1e-6 ? 0 : std::floor(t + 1e-9);
  return static_cast<std::int32_t>(whole);
}
/// The same angle, turned by whole turns into this one; of two at its ends, the one nearer to
/// `seed`. All in degrees.
[[nodiscard]] inline double in_turn(double degrees, std::int32_t turn, double from, double seed) {
  const double begin = from + 360.0 * turn;
  const double base = degrees + 360 * std::ceil((begin - kTurnSlack - degrees) / 360);
  const double other = base + 360;
  if (other > begin + 360 + kTurnSlack) return base;
  return std::fabs(other - seed) < std::fabs(base - seed) ? other : base;
}
/// The value of a constant number of the program's cell, `otherwise` where it has none within
/// -360 to 360. `name` is upper-case.
[[nodiscard]] inline double cell_number(const rmp_code& code, std::string_view name_of,
                                        double otherwise) {
  for (std::uint32_t i = 0; i < code.symbols.count; ++i) {
    const auto& s = row<rmp_code_symbol>(code.symbols, i);
    if (s.kind != RMP_SYMBOL_CONSTANT || s.constant == RMP_NONE) continue;
    const std::string_view name = s.name;
    bool is_it = name.size() == name_of.size();
    for (std::size_t k = 0; is_it && k < name.size(); ++k)
      is_it = (name[k] >= 'a' && name[k] <= 'z' ? name[k] - 32 : name[k]) == name_of[k];
    if (!is_it) continue;
    const auto& c = row<rmp_code_constant>(code.constants, s.constant);
    const double v = c.kind == RMP_CONSTANT_INT ? static_cast<double>(c.integer) : c.real;
    if (c.kind != RMP_CONSTANT_TEXT && v >= -360 && v <= 360) return v;
  }
  return otherwise;
}
/// R_TURNS_FROM of the program's cell; nothing there = kTurnsFrom.
[[nodiscard]] inline double turns_from(const rmp_code& code) {
  return cell_number(code, "R_TURNS_FROM", kTurnsFrom);
}
/// Whether MAIN_JOINT and TURNS of the program are those of the maker's axes, as in programs of
/// controllers (R_MAKER_AXES := 1 in its cell), instead of the robot's joints.
[[nodiscard]] inline bool counts_maker_axes(const rmp_code& code) {
  return cell_number(code, "R_MAKER_AXES", 0) != 0;
}

}  // namespace robomosp
