// SPDX-License-Identifier: Apache-2.0
// Tool centre points of objects as commands read them (layer: application). Internal to
// modules/ioci.
#pragma once

#include <string>

#include "ioci/core/commands.h"

namespace robomosp::ioci {

/// Fields of a centre point: its name and its placement in the object.
[[nodiscard]] const Schema& tcp_schema();
/// Adds one from checked fields; `given` has the placement as it was given.
Result<void> append_tcp(CommandContext&, model::Object&, const Map& checked, const Map& given,
                        std::string_view path);

}  // namespace robomosp::ioci
