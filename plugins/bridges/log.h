// SPDX-License-Identifier: Apache-2.0
// What a bridge says of itself, on standard error (layer: plugin).
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
  /// Now, whatever was said before.
  void say(const std::string& sentence);
  /// What may happen a thousand times a second: the first of a kind at once, then once in ten
  /// seconds with how often it happened.
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
