// SPDX-License-Identifier: Apache-2.0
// Interface robomosp.collision/1: contact and distance between meshes at many configurations
// (layer: contract, std only).
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>
#include <robomosp/sdk/types.h>

namespace robomosp {

/// A pair of bodies to be checked, by index into CollisionScene's bodies.
struct CollisionPair {
  std::int32_t a = 0, b = 0;
};

/// Answer for one pair at one sample.
struct PairDistance {
  double distance = 0;  ///< [m]; <= 0 when the bodies touch, overlap or one contains the other
  Vec3 on_a{}, on_b{};  ///< nearest points in the world; equal when distance <= 0
};

/// Bodies bound to an engine. Immutable. [any thread]
class CollisionScene {
 public:
  virtual ~CollisionScene() = default;
  /// poses: samples * bodies (body-fastest, world_T_body); out: samples * pairs (pair-fastest).
  /// Pairs farther apart than `interest` [m] may be answered with distance = interest.
  virtual Result<void> distances(std::span<const Pose> poses, std::span<const CollisionPair> pairs,
                                 double interest, std::span<PairDistance> out, Progress&) const = 0;
};

/// Interface robomosp.collision/1. [any thread]
class CollisionEngine {
 public:
  using Interface = CollisionEngine;
  static constexpr const char* kInterfaceId = "robomosp.collision/1";
  virtual ~CollisionEngine() = default;
  /// Prepares closed meshes (metres) for queries; the meshes may be freed afterwards.
  virtual Result<std::unique_ptr<CollisionScene>> build(std::span<const Mesh* const> bodies,
                                                        Progress&) const = 0;
};

}  // namespace robomosp
