// SPDX-License-Identifier: Apache-2.0
// Numbers of joints, links and bodies as indices (layer: application, sim).
#pragma once

#include <cstddef>
#include <cstdint>

namespace robomosp::sim {

/// A number that is known not to be negative, as an index.
[[nodiscard]] inline std::size_t index(std::int32_t i) { return static_cast<std::size_t>(i); }

}  // namespace robomosp::sim
