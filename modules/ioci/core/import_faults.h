// SPDX-License-Identifier: Apache-2.0
// What imports left out, by the records that they made (layer: application, ioci only).
#pragma once

#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "document/document.h"
#include "kernel/fault.h"

namespace robomosp::ioci {

class Application;

/// Kept with the application (Application::kept()), for fault.list. Outside the document and its
/// files. [any thread]
class ImportFaults {
 public:
  explicit ImportFaults(Application&) {}
  /// True as long as the fault holds; empty = as long as the record exists.
  using Holds = std::function<bool(const document::Snapshot&)>;
  /// Adds faults of the record, which has this name.
  void note(AnyId, const std::string& name, std::vector<Fault> faults, Holds holds = {});
  /// Those that hold.
  [[nodiscard]] std::vector<Fault> of(const document::Snapshot&, AnyId) const;

 private:
  static constexpr std::size_t kMostRecords = 10'000, kMostFaults = 1'000;
  struct Entry {
    std::string name;  ///< numbers count from 1 again after the document was cleared
    std::vector<std::pair<Fault, Holds>> faults;
  };
  mutable std::mutex mutex_;
  std::map<AnyId, Entry> by_record_;  // guarded by mutex_
  std::deque<AnyId> order_;           // guarded by mutex_
};

}  // namespace robomosp::ioci
