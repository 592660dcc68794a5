// SPDX-License-Identifier: Apache-2.0
// Broad phase: pairs of bodies that can be near each other, from trees of the boxes around them
// (layer: application, collision).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <robomosp/sdk/collision.h>

#include "spatial/box.h"
#include "spatial/box_tree.h"

namespace robomosp::collision {

/// Unordered pairs out of a number of bodies.
class PairSet {
 public:
  explicit PairSet(std::size_t bodies = 0) : bodies_(bodies), has_(bodies * bodies) {}
  PairSet(std::size_t bodies, std::span<const CollisionPair> pairs) : PairSet(bodies) {
    for (const CollisionPair& p : pairs) has_[index(p.a, p.b)] = true, has_[index(p.b, p.a)] = true;
  }
  [[nodiscard]] bool contains(std::int32_t a, std::int32_t b) const { return has_[index(a, b)]; }

 private:
  [[nodiscard]] std::size_t index(std::int32_t a, std::int32_t b) const {
    return static_cast<std::size_t>(a) * bodies_ + static_cast<std::size_t>(b);
  }
  std::size_t bodies_;
  std::vector<bool> has_;
};

/// The boxes of a world's bodies: a tree of the fixed ones, built once, and one of the moving ones.
/// Immutable. [any thread]
class BroadPhase {
 public:
  BroadPhase() = default;
  /// `boxes` in the bodies' frames, `poses` the initial ones.
  BroadPhase(std::span<const spatial::Box> boxes, std::span<const Pose> poses,
             const std::vector<bool>& moves);

  /// Poses of the moving bodies; one per thread.
  struct Placed {
    std::vector<spatial::Box> boxes, nodes;
  };
  /// `poses` of all bodies; `grown`: enlargement of each body's box [m], or empty.
  void place(std::span<const Pose> poses, std::span<const double> grown, Placed& out) const;

  /// Calls visit(pair), a < b, for all pairs of the set with at least one moving body and boxes
  /// within bound() [m]; bound() may shrink meanwhile.
  template <class Bound, class Visit>
  void near(const Placed& placed, const PairSet& pairs, Bound&& bound, Visit&& visit) const {
    for (std::size_t i = 0; i < moving_.size(); ++i) {
      const std::int32_t own = moving_[i];
      const auto meet = [&](std::int32_t other) {
        if (pairs.contains(own, other))
          visit(own < other ? CollisionPair{own, other} : CollisionPair{other, own});
      };
      still_tree_.near(still_nodes_, placed.boxes[i], bound,
                       [&](std::size_t k) { meet(still_[k]); });
      moving_tree_.near(placed.nodes, placed.boxes[i], bound, [&](std::size_t k) {
        if (k > i) meet(moving_[k]);
      });
    }
  }

 private:
  std::vector<std::int32_t> still_, moving_;  ///< bodies
  std::vector<spatial::Box> boxes_;           ///< of the moving ones, in their frames
  spatial::BoxTree still_tree_, moving_tree_;
  std::vector<spatial::Box> still_nodes_;
};

}  // namespace robomosp::collision
