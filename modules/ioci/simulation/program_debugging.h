// SPDX-License-Identifier: Apache-2.0
// What the commands of a debugger share: programs of a live run as they are, and as they were
// (layer: application, ioci only).
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "ioci/core/command.h"
#include "ioci/simulation/live_runs.h"

namespace robomosp::ioci::debugging {

/// The run of a checked `id`.
[[nodiscard]] LiveRunPtr run_of(CommandContext&, const Map& args);
/// Its programs; an error where it has none.
Result<std::shared_ptr<task::ProgramWatch>> watch_of(const LiveRunEntry&);

// With the mutex of the watch held:

/// The program that is meant: given, the one that stands, or the only one.
Result<std::size_t> program_at(const task::ProgramWatch&, const Map& args);
/// The row that is looked at; rows.size() = what is now.
[[nodiscard]] std::size_t row_shown(const task::ProgramWatch&, const LiveRunEntry&);
/// Machines as they were at the time that is shown.
struct Looked {
  std::size_t program = 0;
  const program::Machine* machine = nullptr;
  bool is_now = false;
};
Result<Looked> looked_at(const task::ProgramWatch&, const LiveRunEntry&, const Map& args);
[[nodiscard]] const program::Machine& machine_at(const task::ProgramWatch&, std::size_t row,
                                                 std::size_t program);
/// Given, or the one that stands, or 0.
[[nodiscard]] std::uint32_t process_of(const program::Machine&, const Map& args);
[[nodiscard]] std::string file_of(const program::Machine&, const rmp_span&);
/// Where the program that stands does so; time, whether anything is left to compute, and why not.
[[nodiscard]] Map place(const task::ProgramWatch&, const LiveRunEntry&);

}  // namespace robomosp::ioci::debugging
