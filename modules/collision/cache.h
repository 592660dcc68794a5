// SPDX-License-Identifier: Apache-2.0
// CollisionCache: prepared collision models of worlds and robots, kept between commands until one
// of their inputs changes (layer: application). [any thread]
#pragma once

#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <vector>

#include "evaluation/sources.h"

namespace robomosp::collision {

class CollisionModel;

class CollisionCache {
 public:
  /// The model of a world, or of a robot alone (CollisionModel::of_robot); built if not cached.
  Result<std::shared_ptr<const CollisionModel>> find(const evaluation::Sources& source, AnyId id,
                                                     Progress& progress);

 private:
  static constexpr std::size_t kKept = 4;
  struct Entry {
    std::uint64_t revision;  ///< of the registry: another engine requires a new model
    /// The record and all records it refers to. Records are replaced, never changed, and these are
    /// kept alive, so that equal addresses mean equal contents, also within an open transaction.
    std::vector<document::RecordPtr> made_from;
    std::shared_ptr<const CollisionModel> model;
  };
  std::mutex mutex_;
  std::list<Entry> entries_;  ///< most recently used first; guarded by mutex_
};

/// From the simulator's cache if it has one, else built.
Result<std::shared_ptr<const CollisionModel>> collision_model(const evaluation::Sources&, AnyId,
                                                              Progress&);

}  // namespace robomosp::collision
