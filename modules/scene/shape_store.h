// SPDX-License-Identifier: Apache-2.0
// ShapeStore: the shapes of records, kept as long as nothing that they were made from has changed
// (layer: application, scene). Internal to modules/scene. [one thread at a time]
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
  /// From now on the shapes are those of `snapshot`.
  void renew(const document::SnapshotPtr& snapshot);
  void forget();
  /// Forgets the bodies of all other records.
  void keep_bodies(const std::unordered_map<AnyId, std::vector<std::size_t>>& used);
  /// Forgets all other robots.
  void keep_robots(const std::unordered_set<AnyId>& used);

  /// Makes those of the solids and objects that are not there, several at once.
  Result<void> prepare(const std::vector<AnyId>& bodies, Progress&);
  /// Solids, objects and materials. What failed has its failure in the shape.
  Result<ShapePtr> bodies(AnyId what, Detail, Progress&);
  Result<ShapePtr> mark(AnyId what, Progress&);
  ShapePtr frames(AnyId what);
  ShapePtr dimensions(AnyId what);
  /// Whether an exact one is there.
  [[nodiscard]] bool has_exact(AnyId what) const;
  /// Records whose bodies are coarse.
  [[nodiscard]] const std::unordered_set<AnyId>& coarse() const { return coarse_; }

  struct Robot {
    RobotBasePtr base;  ///< null where it failed, or is outstanding
    ShapePtr bodies, frames, rows;
    std::optional<Error> failure;
    bool is_current = false;  ///< else it is that of an earlier snapshot
  };
  /// With Detail::coarse what is there, be it old; nothing is computed.
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
