// SPDX-License-Identifier: Apache-2.0
#include "ioci/core/import_faults.h"

#include <utility>

namespace robomosp::ioci {

void ImportFaults::note(AnyId id, const std::string& name, std::vector<Fault> faults, Holds holds) {
  if (faults.empty()) return;
  const std::lock_guard lock(mutex_);
  const auto [at, is_new] = by_record_.try_emplace(id);
  Entry& entry = at->second;
  if (is_new) order_.push_back(id);
  if (entry.name != name) entry = {name, {}};
  for (Fault& f : faults)
    if (entry.faults.size() < kMostFaults) entry.faults.emplace_back(std::move(f), holds);
  while (order_.size() > kMostRecords) {
    by_record_.erase(order_.front());
    order_.pop_front();
  }
}

std::vector<Fault> ImportFaults::of(const document::Snapshot& records, AnyId id) const {
  std::vector<std::pair<Fault, Holds>> known;
  const auto* record = records.find(id);
  if (!record) return {};
  {
    const std::lock_guard lock(mutex_);
    const auto at = by_record_.find(id);
    if (at == by_record_.end() || at->second.name != record->name) return {};
    known = at->second.faults;
  }
  std::vector<Fault> out;
  for (auto& [fault, holds] : known)
    if (!holds || holds(records)) out.push_back(std::move(fault));
  return out;
}

}  // namespace robomosp::ioci
