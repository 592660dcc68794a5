// SPDX-License-Identifier: Apache-2.0
// The graph of references between records of all kinds: referenced records must exist, cycles are
// refused, and dependencies are listed (layer: application). Internal to modules/document.
#pragma once

#include <functional>
#include <vector>

#include <robomosp/sdk/result.h>

#include "document/document.h"

namespace robomosp::document {

/// Ids that a body refers to, ascending, each once; with `before`, only those in the parts not
/// shared with it, which include all references that `before` does not have.
[[nodiscard]] std::vector<AnyId> references(const model::Body& body,
                                            const model::Body* before = nullptr);

/// Checks that references exist and have the kinds that the declarations of their fields allow;
/// with `before`, only those in the parts not shared with it.
[[nodiscard]] Result<void> check_references(const Snapshot&, const Record&,
                                            const Record* before = nullptr);

/// The records before the edit, and the references between them.
struct Before {
  std::function<const Record*(AnyId)> record;  ///< null for a record that did not exist
  std::function<bool(AnyId from, AnyId to)> refers;
};
/// Checks that references form no cycle, given that they formed none before: a new cycle
/// passes through a reference that a changed record did not have.
[[nodiscard]] Result<void> refuse_cycles(const Snapshot& now, const Before&,
                                         const std::vector<AnyId>& changed);

}  // namespace robomosp::document
