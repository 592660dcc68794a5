// SPDX-License-Identifier: Apache-2.0
// Whether long arrays hold numbers that can be calculated with, without a branch a number (layer:
// data processing, spatial).
#pragma once

#include <cstddef>
#include <span>

namespace robomosp::spatial {

/// Index of the first number that is not within -limit..limit (NaN is not), or their count.
/// limit >= 0. [any thread]
[[nodiscard]] std::size_t first_beyond(std::span<const double> numbers, double limit);

}  // namespace robomosp::spatial
