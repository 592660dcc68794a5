// SPDX-License-Identifier: Apache-2.0
// Values as the beginning of their text, for messages and logs (layer: core).
#pragma once

#include <cstddef>
#include <string>

#include "kernel/value.h"

namespace robomosp {

/// Value::text() for who shows its beginning only: all of it when it has no more than `most` bytes,
/// else a beginning of more than that, which may end anywhere. What is not shown takes no time.
/// [any thread]
[[nodiscard]] std::string beginning_of(const Value&, std::size_t most);

}  // namespace robomosp
