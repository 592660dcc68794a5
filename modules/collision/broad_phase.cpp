// SPDX-License-Identifier: Apache-2.0
#include "collision/broad_phase.h"

namespace robomosp::collision {

using spatial::Box;
using spatial::BoxTree;

namespace {
constexpr double kRounding = 1e-12;  ///< [m], and of a size
}  // namespace

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
