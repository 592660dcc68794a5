// SPDX-License-Identifier: Apache-2.0
// Sets that grow together: every member finds the least member of its set (layer: plugin).
#pragma once

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <vector>

namespace robomosp::csg_occt {

class Leaders {
 public:
  explicit Leaders(std::size_t n) : leader_(n) {
    std::iota(leader_.begin(), leader_.end(), std::uint32_t{0});
  }
  std::uint32_t find(std::uint32_t i) {
    while (leader_[i] != i) i = leader_[i] = leader_[leader_[i]];
    return i;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    a = find(a);
    b = find(b);
    leader_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::uint32_t> leader_;
};

}  // namespace robomosp::csg_occt
