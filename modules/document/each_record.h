// SPDX-License-Identifier: Apache-2.0
// Records of some kinds in one pass over a snapshot (layer: application).
#pragma once

#include <functional>
#include <span>

#include "document/document.h"

namespace robomosp::document {

/// Calls `see` for each record of these kinds, in order of creation, until it returns false. As
/// fast as memory gives the records: nothing is listed first. [any thread]
void each_record(const Snapshot&, std::span<const Kind> kinds,
                 const std::function<bool(AnyId, const Record&)>& see);

}  // namespace robomosp::document
