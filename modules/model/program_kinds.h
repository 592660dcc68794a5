// SPDX-License-Identifier: Apache-2.0
// The kinds of records that are programs and controllers (layer: data processing, model).
#pragma once

#include "model/kind.h"

namespace robomosp {

/// Registers the kind `program` with its first call. [any thread]
[[nodiscard]] Kind program_kind();
/// The same of the kind `controller`. [any thread]
[[nodiscard]] Kind controller_kind();

}  // namespace robomosp
