// SPDX-License-Identifier: Apache-2.0
// Which records differ between two snapshots of a document (layer: application). [any thread]
#pragma once

#include <vector>

#include "document/document.h"

namespace robomosp::document {

/// Ids of the records that were added, replaced or removed between `before` and `after`,
/// ascending. Costs a comparison for each 64 records that the two share, however many commits lie
/// between them; a record that was edited and put back by undo is the same and does not count.
[[nodiscard]] std::vector<AnyId> changed_records(const Snapshot& before, const Snapshot& after);

/// `changed` and all that refers to it, directly or not, as `now` has the references. In no order.
[[nodiscard]] std::vector<AnyId> dependents(const Snapshot& now, std::vector<AnyId> changed);

}  // namespace robomosp::document
