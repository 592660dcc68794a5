// SPDX-License-Identifier: Apache-2.0
// Paths kept between commands (layer: application).
#include "ioci/core/path_cache.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace robomosp::ioci {
namespace {

/// A trajectory and those stored in it at any depth, each once; of ids that are not there, null.
std::vector<document::RecordPtr> records_of(const document::Snapshot& snapshot, TrajectoryId id) {
  std::vector<TrajectoryId> ids{id};
  std::vector<document::RecordPtr> records;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    records.push_back(snapshot.share(AnyId(ids[i])));
    const auto* trajectory =
        records.back() ? std::get_if<model::Trajectory>(&records.back()->body) : nullptr;
    if (!trajectory) continue;
    for (const model::TrajectorySegment& s : trajectory->segments)
      if (s.stored && std::find(ids.begin(), ids.end(), s.stored) == ids.end())
        ids.push_back(s.stored);
  }
  return records;
}

/// What is written in Lua may answer otherwise each time.
bool has_script(const Registry& registry, const std::vector<document::RecordPtr>& records) {
  std::vector<std::string> scripts;
  for (const ProviderInfo& p : registry.list())
    if (p.is_script) scripts.push_back(p.name);
  if (scripts.empty()) return false;
  const auto is_script = [&](const model::ProviderChoice& choice) {
    return std::find(scripts.begin(), scripts.end(), choice.name) != scripts.end();
  };
  for (const document::RecordPtr& record : records) {
    const auto* trajectory = record ? std::get_if<model::Trajectory>(&record->body) : nullptr;
    if (!trajectory) continue;
    for (const model::TrajectorySegment& s : trajectory->segments)
      if (is_script(s.shape) || is_script(s.law) || is_script(s.orientation) ||
          is_script(s.turning))
        return true;
  }
  return false;
}

}  // namespace

Result<std::shared_ptr<const motion::Path>> PathCache::find(const Registry& registry,
                                                            const document::Snapshot& snapshot,
                                                            TrajectoryId id) {
  Entry entry;
  entry.revision = registry.revision();
  entry.records = records_of(snapshot, id);
  {
    const std::lock_guard lock(mutex_);
    for (auto it = entries_.begin(); it != entries_.end(); ++it)
      if (it->revision == entry.revision && it->records == entry.records) {
        entries_.splice(entries_.begin(), entries_, it);
        return it->path;
      }
  }
  const model::Record& record = *entry.records.front();
  RMP_TRY_ASSIGN(entry.path, motion::Path::build(registry, record.name,
                                                 std::get<model::Trajectory>(record.body),
                                                 motion::stored_in(snapshot)));
  auto path = entry.path;
  const bool is_kept = !has_script(registry, entry.records);
  std::list<Entry> dropped;  // ended without the mutex: a provider's code
  const std::lock_guard lock(mutex_);
  ++built_;
  if (!is_kept) return path;
  entries_.push_front(std::move(entry));
  if (entries_.size() > kKept) dropped.splice(dropped.begin(), entries_, std::prev(entries_.end()));
  return path;
}

std::uint64_t PathCache::built() const {
  const std::lock_guard lock(mutex_);
  return built_;
}

}  // namespace robomosp::ioci
