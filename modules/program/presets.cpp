// SPDX-License-Identifier: Apache-2.0
#include "program/presets.h"

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

}  // namespace robomosp::program
