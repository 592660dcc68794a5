// SPDX-License-Identifier: Apache-2.0
// Handles written as text, and lists of kinds such as "solid|object" (layer: application, ioci
// only).
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "document/document.h"
#include "ioci/core/handle_kinds.h"
#include "kernel/value.h"

namespace robomosp::ioci {

/// "robot#17" or "robot:pa10#17" -> {"robot", 17}; "#" alone is no handle, nor is a kind that
/// neither records nor `kinds` have.
[[nodiscard]] std::optional<Handle> handle_from_text(const HandleKinds& kinds, std::string_view s);
/// "world:cell" -> {Kind::world, "cell"}: a record by its kind and name, for names that records of
/// several kinds have.
[[nodiscard]] std::optional<std::pair<Kind, std::string_view>> kind_and_name(std::string_view s);
/// The record of one of the kinds with this name, or "kind:name"; of several the first kind's.
/// nullopt = there is none. Unlike Application::resolve() it looks for no reason why.
[[nodiscard]] std::optional<Handle> handle_by_name(const document::Snapshot&,
                                                   std::string_view kinds, std::string_view name);
/// The text that refers to a record wherever its kind is taken: its name, or "world:cell" where a
/// record of another kind has that name. nullopt = the record is not there.
[[nodiscard]] std::optional<std::string> reference_text(const document::Snapshot&, const Handle&);
/// Whether a kind is in the list; "any" has all of them.
[[nodiscard]] bool kinds_include(std::string_view kinds, std::string_view kind);
/// ErrorCode::stale_handle.
[[nodiscard]] Error stale_handle(const Handle&);

}  // namespace robomosp::ioci
