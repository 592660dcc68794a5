// SPDX-License-Identifier: Apache-2.0
#include "document/changed.h"

#include <algorithm>
#include <unordered_set>

#include "document/state.h"

namespace robomosp::document {

std::vector<AnyId> Snapshot::State::differing_records(const State& before, const State& after) {
  std::vector<AnyId> out;
  for (std::size_t c = 0; c < std::max(before.chunks.size(), after.chunks.size()); ++c) {
    const auto old = c < before.chunks.size() ? before.chunks[c] : nullptr;
    const auto now = c < after.chunks.size() ? after.chunks[c] : nullptr;
    if (old == now) continue;
    for (std::size_t i = 0; i < kChunk; ++i) {
      const RecordPtr was = old ? old->slots[i].record : nullptr;
      const RecordPtr is = now ? now->slots[i].record : nullptr;
      if (was != is) out.push_back({(is ? is : was)->kind(), c * kChunk + i});
    }
  }
  std::sort(out.begin(), out.end());
  return out;
}

std::vector<AnyId> changed_records(const Snapshot& before, const Snapshot& after) {
  return differing(before, after);
}

std::vector<AnyId> dependents(const Snapshot& now, std::vector<AnyId> changed) {
  std::unordered_set<AnyId> seen(changed.begin(), changed.end());
  for (std::size_t i = 0; i < changed.size(); ++i)
    for (const AnyId r : now.referrers(changed[i]))
      if (seen.insert(r).second) changed.push_back(r);
  return changed;
}

}  // namespace robomosp::document
