// SPDX-License-Identifier: Apache-2.0
// Functions and procedures of the language itself (layer: data processing, plugin irl).
#pragma once

#include <optional>
#include <span>
#include <string_view>

namespace robomosp::irl {

/// Parameters, a letter each: i INT, r REAL, n INT or REAL, c CHAR, b BOOL, s STRING, p POSITION,
/// o ORIENTATION, P POSE, J JOINT, T ROBTARGET, x a process, v any value; places that are changed:
/// S SEMAPHORE, L a list, F a FILE or TEXT, B a STRING; e an element of the list before it, a
/// anything with a length; w any number of values to be written, and m of places to be read,
/// perhaps behind a FILE or TEXT. Behind "?" they may be left out. The result has the same letters:
/// n is the argument's type, e an element; "" is a procedure. q is BRAKE's: an INT and the name of
/// a robot, each of which may be left out; R is the type of robots.
struct Intrinsic {
  std::string_view name, parameters, result;
  std::string_view doc;  ///< one sentence
};
[[nodiscard]] std::span<const Intrinsic> intrinsics();

/// Value of a function of numbers at known arguments; nothing = it is left to run time, where it is
/// the same, or an error.
[[nodiscard]] std::optional<double> evaluate(std::string_view name, std::span<const double> x);

/// The predefined library and the cell that programs have without one, in IRL.
extern const std::string_view kPredefined;
extern const std::string_view kStandardCell;

}  // namespace robomosp::irl
