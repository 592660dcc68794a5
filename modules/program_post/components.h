// SPDX-License-Identifier: Apache-2.0
// What calls each other in a circle (layer: data processing, program_post).
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

namespace robomosp::program_post {

/// The strongly connected components of a graph with nodes 0 .. n-1, `edges(i)` a range of those
/// that i leads to: the component of each node, numbered so that what a component leads to has a
/// lower number. Linear (Tarjan, SIAM J. Computing 1 (1972) 146), without recursion.
template <class Edges>
std::vector<std::uint32_t> components(std::size_t n, Edges&& edges) {
  constexpr std::uint32_t kNone = ~std::uint32_t{0};
  std::vector<std::uint32_t> out(n, kNone), number(n, kNone), lowest(n, 0), stack;
  struct Visit {
    std::uint32_t node;
    decltype(edges(0U).begin()) next;
  };
  std::vector<Visit> open;
  std::uint32_t seen = 0, made = 0;
  const auto enter = [&](std::uint32_t i) {
    number[i] = lowest[i] = seen++;
    stack.push_back(i);
    open.push_back({i, edges(i).begin()});
  };
  for (std::uint32_t root = 0; root < n; ++root) {
    if (number[root] != kNone) continue;
    enter(root);
    while (!open.empty()) {
      const std::uint32_t i = open.back().node;
      if (open.back().next != edges(i).end()) {
        const std::uint32_t to = *open.back().next++;
        if (number[to] == kNone) enter(to);
        else if (out[to] == kNone) lowest[i] = std::min(lowest[i], number[to]);
        continue;
      }
      open.pop_back();
      if (!open.empty()) lowest[open.back().node] = std::min(lowest[open.back().node], lowest[i]);
      if (lowest[i] != number[i]) continue;
      for (std::uint32_t k = kNone; k != i;) {
        k = stack.back();
        stack.pop_back();
        out[k] = made;
      }
      ++made;
    }
  }
  return out;
}

}  // namespace robomosp::program_post
