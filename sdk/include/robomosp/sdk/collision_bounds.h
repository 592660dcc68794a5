// SPDX-License-Identifier: Apache-2.0
// What a collision scene may offer beside its distances: distances within a tolerance
// (layer: contract, std only).
#pragma once

#include <span>

#include <robomosp/sdk/collision.h>

namespace robomosp {

/// Of a scene, by CollisionScene::extension(CollisionBounds::kId). [any thread]
class CollisionBounds {
 public:
  static constexpr const char* kId = "robomosp.collision_bounds/1";
  virtual ~CollisionBounds() = default;
  /// What later versions of the SDK add, by its id (plugin.h); nullptr = not known.
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
  /// As CollisionScene::distances(), but each answer may be too small by up to `tolerance` > 0 [m],
  /// and is never too great: what is answered with d > 0 is at least d apart. Where bodies touch,
  /// the answer is as that of distances(). The points are of the bodies and at most `tolerance`
  /// farther apart than the answer; equal ones with an answer above 0 say that none are known, of
  /// pairs that are farther apart than `interest` less the tolerance. Equal questions get equal
  /// answers.
  virtual Result<void> lower_bounds(std::span<const Pose> poses,
                                    std::span<const CollisionPair> pairs, double interest,
                                    double tolerance, std::span<PairDistance> out,
                                    Progress&) const = 0;
};

}  // namespace robomosp
