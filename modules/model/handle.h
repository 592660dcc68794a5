// SPDX-License-Identifier: Apache-2.0
// Handles of records, which faults and values name them by (layer: data processing, model).
#pragma once

#include <string>

#include "kernel/value.h"
#include "model/kind.h"

namespace robomosp::model {

[[nodiscard]] inline Handle handle(AnyId id) { return {std::string(to_string(id.kind)), id.number}; }

}  // namespace robomosp::model
