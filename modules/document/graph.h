// SPDX-License-Identifier: Apache-2.0
// The graph of records that refer to each other, whatever their kinds: what is referred to must be
// there, nothing may refer to itself, and what depends on what (layer: application). Internal to
// modules/document.
#pragma once

#include <functional>
#include <vector>

#include <robomosp/sdk/result.h>

#include "document/document.h"

namespace robomosp::document {

/// Ids a body refers to, ascending, each once.
[[nodiscard]] std::vector<AnyId> references(const model::Body& body);

/// References exist and are of the kinds that the declarations of their fields allow.
[[nodiscard]] Result<void> check_references(const Snapshot&, const Record&);

/// The records before the edit; null for one that was not there.
using RecordBefore = std::function<const Record*(AnyId)>;
/// There is no cycle of references, given that there was none before: a new one passes through a
/// reference that a changed record did not have.
[[nodiscard]] Result<void> refuse_cycles(const Snapshot& now, const RecordBefore&,
                                         const std::vector<AnyId>& changed);

}  // namespace robomosp::document
