// SPDX-License-Identifier: Apache-2.0
// User-defined values of a program's variables, set before its first statement (layer: data
// processing, program).
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <robomosp/sdk/result.h>

#include "program/machine.h"

namespace robomosp::program {

/// Place (a variable, a field, an element) and expression.
using Preset = std::pair<std::string, std::string>;

/// Checks that a declared signal can have a value: BOOL is 0 or 1, INT a whole number within its
/// bits, REAL finite. Errors name the signal and its range.
Result<void> fits_signal(const rmp_code_symbol& signal, double value);
Result<void> fits_signal(const rmp_code_symbol& signal, const SignalValue& value);

/// Sets values after the declarations of a program and before its first statement, overriding the
/// values in declarations. A value type, used with its machine. [one thread]
class Presets {
 public:
  Presets() = default;
  /// Stops the machine there. Errors: the program has no statement.
  static Result<Presets> make(Machine&, std::vector<Preset>);
  /// Call it after each run(): true = the machine had stopped there and has the values now, so run
  /// it again. Errors name values that cannot be set.
  Result<bool> give(Machine&);

 private:
  std::vector<Preset> values_;
  std::uint32_t breakpoint_ = 0;  ///< 0 = nothing to do
};

}  // namespace robomosp::program
