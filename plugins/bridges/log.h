// SPDX-License-Identifier: Apache-2.0
// Messages of a bridge, on standard error (layer: plugin).
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>

namespace robomosp::bridges {

/// Sentences on standard error. [any thread]
class Log {
 public:
  /// Prints a message immediately.
  void say(const std::string& sentence);
  /// For events that may occur a thousand times a second: prints the first of a kind at once, then
  /// one every ten seconds with the number of occurrences.
  void often(const std::string& kind, const std::string& sentence);

 private:
  struct Kind {
    std::chrono::steady_clock::time_point said;
    std::uint64_t since = 0;
  };
  std::mutex mutex_;
  std::map<std::string, Kind> kinds_;  // guarded by mutex_
};

}  // namespace robomosp::bridges
