// SPDX-License-Identifier: Apache-2.0
// ShapeStore: the shapes of records, kept until one of their inputs changes (layer: application,
// scene). Internal to modules/scene. [one thread at a time]
#pragma once

#include <optional>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "scene/posed_robot.h"
#include "scene/scene_model.h"

namespace robomosp::scene {

class ShapeStore {
 public:
  ShapeStore(evaluation::Derived& derived, const Registry& registry)
      : derived_(derived), registry_(registry) {}

  [[nodiscard]] evaluation::Derived& derived() const { return derived_; }
  [[nodiscard]] const Registry& registry() const { return registry_; }
  /// Switches to the shapes of `snapshot`.
  void renew(const document::SnapshotPtr& snapshot);
  void forget();
  /// Drops the bodies of all other records.
  void keep_bodies(const std::unordered_map<AnyId, std::vector<std::size_t>>& used);
  /// Forgets all other robots.
  void keep_robots(const std::unordered_set<AnyId>& used);

  /// Builds the missing solids and objects, several at once.
  Result<void> prepare(const std::vector<AnyId>& bodies, Progress&);
  /// For solids, objects and materials. Failures are stored in the shape.
  Result<ShapePtr> bodies(AnyId what, Detail, Progress&);
  Result<ShapePtr> mark(AnyId what, Progress&);
  ShapePtr frames(AnyId what);
  ShapePtr dimensions(AnyId what);
  [[nodiscard]] bool has(AnyId what) const { return bodies_.contains(what); }
  /// True if an exact one is stored.
  [[nodiscard]] bool has_exact(AnyId what) const;
  /// Records with coarse bodies.
  [[nodiscard]] const std::unordered_set<AnyId>& coarse() const { return coarse_; }

  struct Robot {
    RobotBasePtr base;  ///< null if it failed, or is not built yet
    ShapePtr bodies, frames;
    std::optional<Error> failure;
    bool is_current = false;  ///< else it is that of an earlier snapshot
  };
  /// With Detail::coarse, returns what is stored, even if outdated; nothing is computed.
  Result<const Robot*> robot(RobotId, Detail, Progress&);

 private:
  struct Body {
    ShapePtr bodies, mark, frames, dimensions;
  };
  [[nodiscard]] Source source() const { return {*snapshot_, derived_, registry_}; }
  evaluation::Derived& derived_;
  const Registry& registry_;
  document::SnapshotPtr snapshot_;
  std::unordered_map<AnyId, Body> bodies_;
  std::unordered_set<AnyId> coarse_;
  std::unordered_map<AnyId, Robot> robots_;
};

}  // namespace robomosp::scene
