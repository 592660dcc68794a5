// SPDX-License-Identifier: Apache-2.0
// Whether a subscriber wants commands that only read and ended well (layer: application).
#pragma once

#include <cstdint>

namespace robomosp::ioci {

/// Beside the topics in Events::topics(): a subscriber to commands has EventFilter::reads.
inline constexpr std::uint32_t kReadsWanted = std::uint32_t{1} << 31U;

}  // namespace robomosp::ioci
