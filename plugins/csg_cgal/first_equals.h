// SPDX-License-Identifier: GPL-3.0-or-later
// Finds equal elements among many by hashing (layer: plugin).
#pragma once

#include <bit>
#include <cstdint>
#include <vector>

namespace robomosp::csg_cgal {

/// For each of n elements the first that is equal to it.
template <class Hash, class Equal>
std::vector<std::uint32_t> first_equals(std::size_t n, Hash&& hash, Equal&& equal) {
  constexpr std::uint32_t kFree = ~0U;
  std::vector<std::uint32_t> first(n), slots(std::bit_ceil(2 * n + 1), kFree);
  const std::size_t mask = slots.size() - 1;
  for (std::uint32_t i = 0; i < n; ++i)
    for (std::size_t at = hash(i) & mask;; at = (at + 1) & mask) {
      if (slots[at] == kFree) slots[at] = i;
      if (slots[at] != i && !equal(slots[at], i)) continue;
      first[i] = slots[at];
      break;
    }
  return first;
}

inline std::uint64_t stirred(std::uint64_t key, std::uint64_t value) {
  key = (key ^ value) * 0x9E3779B97F4A7C15U;
  return key ^ (key >> 32U);
}

}  // namespace robomosp::csg_cgal
