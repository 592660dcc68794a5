// SPDX-License-Identifier: Apache-2.0
#include "spatial/magnitudes.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

namespace robomosp::spatial {

std::size_t first_beyond(std::span<const double> numbers, double limit) {
  constexpr std::size_t kTogether = 64;
  // Magnitudes are ordered as their bits are, NaN behind all: what is beyond borrows.
  constexpr std::uint64_t kMagnitude = ~(std::uint64_t{1} << 63);
  const auto most = std::bit_cast<std::uint64_t>(limit);
  for (std::size_t i = 0; i < numbers.size(); i += kTogether) {
    const std::size_t end = std::min(numbers.size(), i + kTogether);
    std::uint64_t beyond = 0;
    for (std::size_t k = i; k < end; ++k)
      beyond |= most - (std::bit_cast<std::uint64_t>(numbers[k]) & kMagnitude);
    if ((beyond >> 63) == 0) continue;
    for (std::size_t k = i; k < end; ++k)
      if (!(std::fabs(numbers[k]) <= limit)) return k;
  }
  return numbers.size();
}

}  // namespace robomosp::spatial
