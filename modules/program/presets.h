// SPDX-License-Identifier: Apache-2.0
// Values that a user gives variables of a program before its first statement (layer: data
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

/// Whether a signal as it is declared can have a value: BOOL is 0 or 1, INT a whole number that its
/// bits hold, REAL finite. Errors name the signal and what it holds.
Result<void> fits_signal(const rmp_code_symbol& signal, double value);
Result<void> fits_signal(const rmp_code_symbol& signal, const SignalValue& value);

/// Gives values behind the declarations of a program and before its first statement, whatever
/// values the declarations give. A value; goes with its machine. [one thread]
class Presets {
 public:
  Presets() = default;
  /// Stops the machine there. Errors: the program has no statement.
  static Result<Presets> make(Machine&, std::vector<Preset>);
  /// To be asked behind each run(): true = the machine stood there, has the values now, and is to
  /// be run again. Errors name what cannot be set.
  Result<bool> give(Machine&);

 private:
  std::vector<Preset> values_;
  std::uint32_t breakpoint_ = 0;  ///< 0 = nothing to do
};

}  // namespace robomosp::program
