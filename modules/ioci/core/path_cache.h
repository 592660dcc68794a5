// SPDX-License-Identifier: Apache-2.0
// PathCache: the paths of trajectories, kept between commands so that a script that asks for one
// place after the other does not build all segments a call (layer: application). [any thread]
#pragma once

#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <vector>

#include "document/document.h"
#include "kernel/registry.h"
#include "motion/cartesian_path.h"

namespace robomosp::ioci {

class PathCache {
 public:
  /// The path of a trajectory that is there, with those stored in it as the snapshot has them.
  Result<std::shared_ptr<const motion::Path>> find(const Registry&, const document::Snapshot&,
                                                   TrajectoryId);
  /// How many were built.
  [[nodiscard]] std::uint64_t built() const;

 private:
  /// Paths of few segments are built quickly; long ones are few.
  static constexpr std::size_t kKept = 8;
  struct Entry {
    /// The trajectory and those stored in it. Records never change but are replaced, and these are
    /// kept alive: an equal address means equal content.
    std::vector<document::RecordPtr> records;
    std::uint64_t revision = 0;  ///< of the registry: a changed default or provider builds anew
    std::shared_ptr<const motion::Path> path;
  };
  mutable std::mutex mutex_;
  std::list<Entry> entries_;  ///< most recent first; guarded by mutex_
  std::uint64_t built_ = 0;   ///< guarded by mutex_
};

}  // namespace robomosp::ioci
