// SPDX-License-Identifier: Apache-2.0
#include "program/presets.h"

#include <cmath>

#include "kernel/text.h"

#include <robomosp/sdk/program_code.h>

#include "program/state.h"

namespace robomosp::program {

Result<Presets> Presets::make(Machine& machine, std::vector<Preset> values) {
  Presets out;
  if (values.empty()) return out;
  const rmp_code& code = machine.code();
  const std::uint32_t body =
      code.routines.count > 0 ? row<rmp_code_routine>(code.routines, 0).body : RMP_NONE;
  if (body == RMP_NONE)
    return error(
        ErrorCode::invalid_argument,
        "the program has no statement, and nothing that " + values.front().first + " could change",
        "Give no values.", values.front().first);
  const rmp_span& first = row<rmp_code_statement>(code.statements, body).span;
  Breakpoint at;
  at.file = row<rmp_code_file>(code.files, first.file).name;
  at.line = first.line;
  RMP_TRY_ASSIGN(const Breakpoint set, machine.set_breakpoint(std::move(at)));
  out.values_ = std::move(values);
  out.breakpoint_ = set.number;
  return out;
}

Result<bool> Presets::give(Machine& machine) {
  const Status& s = machine.status();
  if (breakpoint_ == 0 || s.state != RunState::stopped || !s.stop ||
      s.stop->breakpoint != breakpoint_)
    return false;
  machine.remove_breakpoint(breakpoint_);
  breakpoint_ = 0;
  for (const auto& [place, expression] : values_) {
    auto set = machine.assign(place, expression, 0, 0);
    if (!set.ok()) return std::move(set).error().in(place + " = " + expression);
  }
  return true;
}

Result<void> fits_signal(const rmp_code_symbol& s, double value) {
  const std::string what = std::string(s.kind == RMP_SYMBOL_OUTPUT ? "the output " : "the input ") +
                           s.name + " cannot be " + text::print_rounded(value);
  const auto no = [&](std::string hint) {
    return error(ErrorCode::invalid_argument, what, std::move(hint));
  };
  if (s.type == RMP_TYPE_BOOL && value != 0 && value != 1)
    return no("It must be a BOOL: TRUE (1) or FALSE (0).");
  if (!std::isfinite(value)) return no("It must be a finite number.");
  if (s.type != RMP_TYPE_INT) return {};
  if (value != std::floor(value)) return no("It must be an INT, a whole number.");
  const bool has_bits = s.width > 1 && s.width < 32;
  const double least = has_bits ? 0.0 : -2147483648.0;
  const double most = has_bits ? std::ldexp(1.0, s.width) - 1 : 2147483647.0;
  if (value < least || value > most)
    return no((has_bits ? "Its " + std::to_string(s.width) + " bits hold " : "An INT is ") +
              text::print_rounded(least) + " to " + text::print_rounded(most) + ".");
  return {};
}

Result<void> fits_signal(const rmp_code_symbol& s, const SignalValue& v) {
  const bool is_real = s.type == RMP_TYPE_REAL || v.real != 0;
  return fits_signal(s, is_real ? v.real : static_cast<double>(v.integer));
}

}  // namespace robomosp::program
