// SPDX-License-Identifier: Apache-2.0
// Programs checked by a run before they are posted (layer: application, ioci only).
#pragma once

#include "ioci/core/commands.h"
#include "program_check/check_program.h"

namespace robomosp::ioci {

using program_check::CheckedProgram;

/// What checked arguments ask for.
[[nodiscard]] program_check::CheckTask check_task(const Map& args);
/// The arguments that check_task() reads besides `id`.
[[nodiscard]] Schema check_params();
/// A fault as program.check_run returns it, without its member `fault`.
[[nodiscard]] Map fault_row(const CheckedProgram&, const program_check::Fault&);
}  // namespace robomosp::ioci
