// SPDX-License-Identifier: Apache-2.0
// Traversals of the tables of a program (layer: data processing, program_post).
#pragma once

#include <cstdint>
#include <vector>

#include <robomosp/sdk/program_tables.h>

namespace robomosp::program_post {

/// True if `is_it` is true for a statement from `first` to the end of its block, or for one within
/// them; inner statements come before the following ones. `at(i)` returns row i. Linear, without
/// recursion.
template <class At, class Fn>
bool any_statement(std::uint32_t first, At&& at, Fn&& is_it) {
  std::vector<std::uint32_t> open{first};
  while (!open.empty()) {
    const std::uint32_t i = open.back();
    open.pop_back();
    if (i == RMP_NONE) continue;
    const rmp_code_statement& s = at(i);
    open.push_back(s.next);
    open.push_back(s.body);
    if (is_it(s)) return true;
  }
  return false;
}

/// Visits all of them. `see` must not add statements.
template <class At, class Fn>
void each_statement(std::uint32_t first, At&& at, Fn&& see) {
  any_statement(first, at, [&](const rmp_code_statement& s) {
    see(s);
    return false;
  });
}
template <class Fn>
void each_statement(const ProgramTables& t, std::uint32_t first, Fn&& see) {
  each_statement(
      first, [&](std::uint32_t i) -> const rmp_code_statement& { return t.statements[i]; }, see);
}

/// The expressions computed by a motion: targets, values of attributes, condition of UNTIL
/// (RMP_NONE = none).
template <class Fn>
void each_value(const ProgramTables& t, const rmp_code_motion& m, Fn&& see) {
  for (std::uint32_t k = 0; k < m.target_count; ++k) see(t.links[m.first_target + k]);
  for (std::uint32_t k = 0; k < m.attribute_count; ++k)
    see(t.attributes[m.first_attribute + k].value);
  see(m.until);
}

}  // namespace robomosp::program_post
