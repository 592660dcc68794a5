// SPDX-License-Identifier: Apache-2.0
// A tree of axis-aligned boxes, for finding those near a given one (layer: data processing,
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

/// A binary tree over boxes. The grouping of boxes is fixed once; their positions are stored
/// outside, so that several threads can have different ones.
class BoxTree {
 public:
  BoxTree() = default;
  /// Splits recursively at the median of the centres along the longest side.
  explicit BoxTree(std::span<const Box> leaves);

  [[nodiscard]] bool empty() const { return nodes_.empty(); }
  /// The boxes of all nodes from those of the leaves.
  void refit(std::span<const Box> leaves, std::vector<Box>& boxes) const;

  /// Calls visit(leaf) for every leaf with a box within bound() of `box`, the nearer child of each
  /// node first; bound() [m] is evaluated at every node and may shrink meanwhile; a negative bound
  /// ends the search.
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
  static constexpr std::size_t kDepth = 72;  ///< sufficient for a balanced tree of 2^31 leaves
  struct Node {
    std::uint32_t second = 0;  ///< the first child is the next node
    std::int32_t leaf = -1;
  };
  std::vector<Node> nodes_;  ///< children after their parent
};

}  // namespace robomosp::spatial
