// SPDX-License-Identifier: Apache-2.0
#include "collision/cache.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "collision/collision.h"

namespace robomosp::collision {
namespace {

using evaluation::Sources;

/// The record and all that it refers to, each once, in an order that is the same every time.
/// Trajectories have no bodies and do not count.
std::vector<document::RecordPtr> what_it_is_made_from(const document::Snapshot& snapshot,
                                                      AnyId id) {
  std::vector<AnyId> ids{id};
  std::vector<document::RecordPtr> records;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    auto record = snapshot.share(ids[i]);
    if (!record) continue;
    model::for_each_reference(record->body, [&](AnyId other, std::string_view) {
      if (other.kind != Kind::trajectory && std::find(ids.begin(), ids.end(), other) == ids.end())
        ids.push_back(other);
    });
    records.push_back(std::move(record));
  }
  return records;
}

Result<std::shared_ptr<const CollisionModel>> make(const Sources& source, AnyId id,
                                                   Progress& progress) {
  return id.kind == Kind::world ? CollisionModel::of_world(source, WorldId{id.number}, progress)
                                : CollisionModel::of_robot(source, RobotId{id.number}, progress);
}

}  // namespace

Result<std::shared_ptr<const CollisionModel>> CollisionCache::find(const Sources& source, AnyId id,
                                                                   Progress& progress) {
  const std::uint64_t revision = source.registry.revision();
  auto made_from = what_it_is_made_from(source.snapshot, id);
  {
    const std::lock_guard lock(mutex_);
    for (auto it = entries_.begin(); it != entries_.end(); ++it)
      if (it->revision == revision && it->made_from == made_from) {
        entries_.splice(entries_.begin(), entries_, it);
        return it->model;
      }
  }
  auto made = make(source, id, progress);
  if (!made.ok()) return made;
  std::list<Entry> dropped;  // ended without the mutex
  const std::lock_guard lock(mutex_);
  entries_.push_front({revision, std::move(made_from), *made});
  if (entries_.size() > kKept) dropped.splice(dropped.begin(), entries_, std::prev(entries_.end()));
  return made;
}

Result<std::shared_ptr<const CollisionModel>> collision_model(const Sources& source, AnyId id,
                                                              Progress& progress) {
  return source.collision_models ? source.collision_models->find(source, id, progress)
                                 : make(source, id, progress);
}

}  // namespace robomosp::collision
