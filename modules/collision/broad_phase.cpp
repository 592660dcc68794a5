// SPDX-License-Identifier: Apache-2.0
#include "collision/broad_phase.h"

#include <algorithm>
#include <numeric>

namespace robomosp::collision {

using spatial::Box;

namespace {
constexpr double kRounding = 1e-12;  ///< [m], and of a size
}  // namespace

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
    std::vector<Vec3> centres;
    for (std::size_t i = r.begin; i < r.end; ++i) centres.push_back(leaves[order[i]].centre);
    const Vec3 half = spatial::box_around(centres).half;
    const auto longest =
        static_cast<std::size_t>(std::max_element(half.begin(), half.end()) - half.begin());
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
                                   : spatial::around(boxes[i + 1], boxes[nodes_[i].second]);
}

BroadPhase::BroadPhase(std::span<const Box> boxes, std::span<const Pose> poses,
                       const std::vector<bool>& moves) {
  std::vector<Box> still_boxes;
  for (std::size_t b = 0; b < boxes.size(); ++b) {
    Box box = boxes[b];
    // What rounding may add to a pose: a pair must not be left out for it.
    for (double& h : box.half) h += kRounding * (1 + h);
    if (moves[b]) {
      moving_.push_back(static_cast<std::int32_t>(b));
      boxes_.push_back(box);
    } else {
      still_.push_back(static_cast<std::int32_t>(b));
      still_boxes.push_back(moved(box, poses[b]));
    }
  }
  still_tree_ = BoxTree(still_boxes);
  still_tree_.refit(still_boxes, still_nodes_);
  std::vector<Box> moving_boxes;
  for (std::size_t i = 0; i < moving_.size(); ++i)
    moving_boxes.push_back(moved(boxes_[i], poses[static_cast<std::size_t>(moving_[i])]));
  moving_tree_ = BoxTree(moving_boxes);
}

void BroadPhase::place(std::span<const Pose> poses, std::span<const double> grown,
                       Placed& out) const {
  out.boxes.resize(moving_.size());
  for (std::size_t i = 0; i < moving_.size(); ++i) {
    const auto b = static_cast<std::size_t>(moving_[i]);
    out.boxes[i] = moved(boxes_[i], poses[b]);
    if (!grown.empty())
      for (double& h : out.boxes[i].half) h += grown[b];
  }
  moving_tree_.refit(out.boxes, out.nodes);
}

}  // namespace robomosp::collision
