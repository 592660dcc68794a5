// SPDX-License-Identifier: Apache-2.0
// Forces at a robot's tip among the arguments of commands that run it (layer: application, ioci
// only).
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "ioci/core/commands.h"
#include "sim/tip_load.h"

namespace robomosp::ioci {

/// A handle among the arguments, also one written as text (`recording#3`).
[[nodiscard]] std::optional<Handle> given_handle(const CommandContext&, const Map& args,
                                                 std::string_view name);
/// The recording of the argument `name`, which was given.
[[nodiscard]] Result<recording::RecordingPtr> given_recording(const CommandContext&,
                                                              const Map& args,
                                                              const std::string& name);

/// `tip_force`, `tip_moment`, `tip_wrench`, `tip_columns`, `tip_over`, `tip_axes` and `tip`. `path`
/// describes what the path parameter belongs to.
[[nodiscard]] std::vector<ParamSpec> tip_load_fields(const std::string& path);
/// True if the arguments contain a force, a moment or a recording of them.
[[nodiscard]] bool has_tip_load(const Map& args);
/// Reads them; without arguments there is no load. Other load arguments without a load are an
/// error.
[[nodiscard]] Result<sim::TipLoad> read_tip_load(const CommandContext&, const Map& args);
/// The same, but without arguments the recorded load is kept; a given load may be zero.
[[nodiscard]] Result<std::optional<sim::TipLoad>> read_optional_load(const CommandContext&,
                                                                     const Map& args);

}  // namespace robomosp::ioci
