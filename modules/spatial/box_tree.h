// SPDX-License-Identifier: Apache-2.0
// A tree of axis-aligned boxes, to find which of many are near one (layer: data processing,
// spatial).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "spatial/box.h"

namespace robomosp::spatial {

/// A binary tree over boxes. Which boxes stand together is decided once; where they are is kept
/// outside, so that several threads can have them at different places.
class BoxTree {
 public:
  BoxTree() = default;
  /// Halves at the median of the centres along the longest side, again and again.
  explicit BoxTree(std::span<const Box> leaves);

  [[nodiscard]] bool empty() const { return nodes_.empty(); }
  /// The boxes of all nodes from those of the leaves.
  void refit(std::span<const Box> leaves, std::vector<Box>& boxes) const;

  /// Calls visit(leaf) for every leaf whose box is within bound() of `box`, the nearer half of each
  /// node first; bound() [m] is asked again at every node and may shrink meanwhile; below 0 ends
  /// it.
  template <class Bound, class Visit>
  void near(std::span<const Box> boxes, const Box& box, Bound&& bound, Visit&& visit) const {
    if (nodes_.empty()) return;
    const auto is_beyond = [&](double squared) {
      const double b = bound();
      return !(b >= 0) || squared > b * b;
    };
    std::array<std::pair<std::uint32_t, double>, kDepth> stack;
    std::size_t size = 0;
    stack[size++] = {0, squared_gap(boxes[0], box)};
    while (size > 0) {
      const auto [at, squared] = stack[--size];
      if (is_beyond(squared)) continue;
      const Node& node = nodes_[at];
      if (node.leaf >= 0) {
        visit(static_cast<std::size_t>(node.leaf));
        continue;
      }
      const double first = squared_gap(boxes[at + 1], box),
                   second = squared_gap(boxes[node.second], box);
      const std::pair<std::uint32_t, double> a{at + 1, first}, b{node.second, second};
      stack[size++] = first <= second ? b : a;
      stack[size++] = first <= second ? a : b;
    }
  }

 private:
  static constexpr std::size_t kDepth = 72;  ///< of a halved tree of 2^31 leaves, and some
  struct Node {
    std::uint32_t second = 0;  ///< the first child is the next node
    std::int32_t leaf = -1;
  };
  std::vector<Node> nodes_;  ///< children after their parent
};

}  // namespace robomosp::spatial
