// SPDX-License-Identifier: Apache-2.0
// The kind of records that are programs (layer: application).
#pragma once

#include "model/kind.h"

namespace robomosp::ioci {

/// Registers the kind `program` with its first call. [any thread]
[[nodiscard]] Kind program_kind();

}  // namespace robomosp::ioci
