// SPDX-License-Identifier: Apache-2.0
// The kind of records that are programs and controllers (layer: application).
#pragma once

#include "model/kind.h"

namespace robomosp::ioci {

/// Registers the kind `program` with its first call. [any thread]
[[nodiscard]] Kind program_kind();
/// The same of the kind `controller`. [any thread]
[[nodiscard]] Kind controller_kind();

}  // namespace robomosp::ioci
