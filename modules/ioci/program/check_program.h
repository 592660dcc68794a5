// SPDX-License-Identifier: Apache-2.0
// Programs checked by a run before they are posted (layer: application, ioci only).
#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <string_view>

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
/// Label of a place in a picture: `line 7`, `lines 7, 12 and 18`, or for more than five `lines 7,
/// 9, 12, 18 and 3 more`.
[[nodiscard]] std::string lines_text(const std::set<std::uint32_t>& lines);
/// At most about so many bytes, cut between words, with how many were left out.
[[nodiscard]] std::string shortened(std::string_view, std::size_t most);

}  // namespace robomosp::ioci
