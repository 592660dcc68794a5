// SPDX-License-Identifier: Apache-2.0
#include "document/changed.h"

#include <algorithm>
#include <unordered_set>

#include "document/state.h"

namespace robomosp::document {

std::vector<AnyId> Snapshot::State::differing_records(const State& before, const State& after) {
  std::vector<AnyId> out;
  const auto page = [](const State& s, std::size_t p) {
    return p < s.pages.size() ? s.pages[p].get() : nullptr;
  };
  for (std::size_t p = 0; p < std::max(before.pages.size(), after.pages.size()); ++p) {
    const Page *old_page = page(before, p), *new_page = page(after, p);
    for (std::size_t c = 0; old_page != new_page && c < kPage; ++c) {
      const Chunk* old = old_page ? old_page->chunks[c].get() : nullptr;
      const Chunk* now = new_page ? new_page->chunks[c].get() : nullptr;
      for (std::size_t i = 0; old != now && i < kChunk; ++i) {
        const RecordPtr was = old ? old->slots[i].record : nullptr;
        const RecordPtr is = now ? now->slots[i].record : nullptr;
        if (was != is) out.push_back({(is ? is : was)->kind(), (p * kPage + c) * kChunk + i});
      }
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
