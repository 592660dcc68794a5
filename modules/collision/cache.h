// SPDX-License-Identifier: Apache-2.0
// CollisionCache: prepared collision models of worlds and robots, kept between commands for as long
// as nothing that they were made from has changed (layer: application). [any thread]
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
  /// Of a world, or of a robot alone (CollisionModel::of_robot); made where it is not kept.
  Result<std::shared_ptr<const CollisionModel>> find(const evaluation::Sources& source, AnyId id,
                                                     Progress& progress);

 private:
  static constexpr std::size_t kKept = 4;
  struct Entry {
    std::uint64_t revision;  ///< of the registry: another engine makes it anew
    /// The record and all that it refers to. Records never change but are replaced, and these are
    /// kept alive, so that equal addresses mean equal contents, also within an open transaction.
    std::vector<document::RecordPtr> made_from;
    std::shared_ptr<const CollisionModel> model;
  };
  std::mutex mutex_;
  std::list<Entry> entries_;  ///< the one used last first; guarded by mutex_
};

/// From the simulator's cache where it has one, else made anew.
Result<std::shared_ptr<const CollisionModel>> collision_model(const evaluation::Sources&, AnyId,
                                                              Progress&);

}  // namespace robomosp::collision
