// SPDX-License-Identifier: Apache-2.0
// Handles written as text, and lists of kinds such as "solid|object" (layer: application, ioci
// only).
#pragma once

#include <optional>
#include <string_view>

#include "ioci/core/handle_kinds.h"
#include "kernel/value.h"

namespace robomosp::ioci {

/// "robot#17" or "robot:pa10#17" -> {"robot", 17}; "#" alone is no handle, nor is a kind that
/// neither records nor `kinds` have.
[[nodiscard]] std::optional<Handle> handle_from_text(const HandleKinds& kinds, std::string_view s);
/// Whether a kind is in the list; "any" has all of them.
[[nodiscard]] bool kinds_include(std::string_view kinds, std::string_view kind);

}  // namespace robomosp::ioci
