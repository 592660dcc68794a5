// SPDX-License-Identifier: Apache-2.0
// Shared by the commands of a debugger: current and earlier states of the programs of a live run
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
/// Its programs; an error if it has none.
Result<std::shared_ptr<task::ProgramWatch>> watch_of(const LiveRunEntry&);

// With the mutex of the watch held:

/// The selected program: the given one, else the stopped one, else the only one.
Result<std::size_t> program_at(const task::ProgramWatch&, const Map& args);
/// The row that is shown; rows.size() = the current state.
[[nodiscard]] std::size_t row_shown(const task::ProgramWatch&, const LiveRunEntry&);
/// Machines in their state at the time shown.
struct Looked {
  std::size_t program = 0;
  const program::Machine* machine = nullptr;
  bool is_now = false;
};
Result<Looked> looked_at(const task::ProgramWatch&, const LiveRunEntry&, const Map& args);
[[nodiscard]] const program::Machine& machine_at(const task::ProgramWatch&, std::size_t row,
                                                 std::size_t program);
/// The given process, else the stopped one, else 0.
[[nodiscard]] std::uint32_t process_of(const program::Machine&, const Map& args);
[[nodiscard]] std::string file_of(const program::Machine&, const rmp_span&);
/// Where the stopped program is; time, whether anything is left to compute, and the reason if not.
[[nodiscard]] Map place(const task::ProgramWatch&, const LiveRunEntry&);

}  // namespace robomosp::ioci::debugging
