// SPDX-License-Identifier: Apache-2.0
#include "spatial/box_tree.h"

#include <algorithm>
#include <numeric>

namespace robomosp::spatial {

BoxTree::BoxTree(std::span<const Box> leaves) {
  if (leaves.empty()) return;
  std::vector<std::uint32_t> order(leaves.size());
  std::iota(order.begin(), order.end(), 0U);
  struct Range {
    std::size_t begin, end;
    std::int64_t parent;  ///< whose second child it is; -1 = of none
  };
  std::vector<Range> ranges{{0, leaves.size(), -1}};
  nodes_.reserve(2 * leaves.size());
  while (!ranges.empty()) {
    const Range r = ranges.back();
    ranges.pop_back();
    const auto at = static_cast<std::uint32_t>(nodes_.size());
    if (r.parent >= 0) nodes_[static_cast<std::size_t>(r.parent)].second = at;
    nodes_.push_back({});
    if (r.end - r.begin == 1) {
      nodes_[at].leaf = static_cast<std::int32_t>(order[r.begin]);
      continue;
    }
    Vec3 low = leaves[order[r.begin]].centre, high = low;
    for (std::size_t i = r.begin; i < r.end; ++i)
      for (std::size_t k = 0; k < 3; ++k) {
        low[k] = std::min(low[k], leaves[order[i]].centre[k]);
        high[k] = std::max(high[k], leaves[order[i]].centre[k]);
      }
    const Vec3 size = sub(high, low);
    const auto longest =
        static_cast<std::size_t>(std::max_element(size.begin(), size.end()) - size.begin());
    const std::size_t middle = (r.begin + r.end) / 2;
    const auto begin = order.begin();
    std::nth_element(
        begin + static_cast<std::ptrdiff_t>(r.begin), begin + static_cast<std::ptrdiff_t>(middle),
        begin + static_cast<std::ptrdiff_t>(r.end), [&](std::uint32_t a, std::uint32_t b) {
          return std::pair(leaves[a].centre[longest], a) < std::pair(leaves[b].centre[longest], b);
        });
    ranges.push_back({middle, r.end, at});
    ranges.push_back({r.begin, middle, -1});
  }
}

void BoxTree::refit(std::span<const Box> leaves, std::vector<Box>& boxes) const {
  boxes.resize(nodes_.size());
  for (std::size_t i = nodes_.size(); i-- > 0;)
    boxes[i] = nodes_[i].leaf >= 0 ? leaves[static_cast<std::size_t>(nodes_[i].leaf)]
                                   : around(boxes[i + 1], boxes[nodes_[i].second]);
}

}  // namespace robomosp::spatial
