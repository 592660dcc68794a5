// SPDX-License-Identifier: Apache-2.0
// Numbers as a program writes them and as messages show them (layer: data processing, program).
#pragma once

#include <string>

#include "kernel/text.h"

namespace robomosp::program {

/// A REAL as a literal of IRL, the shortest that reads back to the same number: "100000.0", "0.0"
/// (of -0, too), "-2.5". An exponent only from 1e15 on and below 1e-5: "1.0e+20". "inf", "nan".
/// [any thread]
[[nodiscard]] inline std::string real_literal(double v) {
  std::string s = text::print_rounded(v, 17);
  const std::size_t digits = s.find_first_not_of("-0123456789");
  if (digits == std::string::npos) return s + ".0";
  if (s[digits] == 'e') s.insert(digits, ".0");
  return s;
}

}  // namespace robomosp::program
