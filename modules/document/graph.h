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

/// Ids a body refers to, ascending, each once; with `before`, those only that stand in what it does
/// not share with that: whatever it refers to and `before` does not is among them.
[[nodiscard]] std::vector<AnyId> references(const model::Body& body,
                                            const model::Body* before = nullptr);

/// References exist and are of the kinds that the declarations of their fields allow; with `before`
/// only those that it does not share with that are looked at.
[[nodiscard]] Result<void> check_references(const Snapshot&, const Record&,
                                            const Record* before = nullptr);

/// The records before the edit, and whether a record referred to another one then.
struct Before {
  std::function<const Record*(AnyId)> record;  ///< null for one that was not there
  std::function<bool(AnyId from, AnyId to)> refers;
};
/// There is no cycle of references, given that there was none before: a new one passes through a
/// reference that a changed record did not have.
[[nodiscard]] Result<void> refuse_cycles(const Snapshot& now, const Before&,
                                         const std::vector<AnyId>& changed);

}  // namespace robomosp::document
