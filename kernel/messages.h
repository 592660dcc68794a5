// SPDX-License-Identifier: Apache-2.0
// Messages: structured remarks to the user in a ring buffer, with subscribers (layer: core).
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "kernel/app_lock.h"

namespace robomosp {

struct Fault;  // kernel/fault.h

enum class Severity : std::uint8_t { debug, info, warning, error };
[[nodiscard]] std::string_view to_string(Severity);

struct Message {
  std::chrono::system_clock::time_point time;
  Severity severity = Severity::info;
  std::string code;            ///< stable word: "plugin_refused", "audit", ...
  std::string text;            ///< a sentence
  std::string source;          ///< the origin: "plugin_loader", "csg_occt"
  std::uint32_t repeated = 0;  ///< number of suppressed messages with the same text before this one
  /// Structured content; null = only the text.
  std::shared_ptr<const Fault> fault{};
};

/// Thread-safe. Subscribers are called outside the lock, in order, on the posting thread or on one
/// that is already calling them; one more call may follow shortly after unsubscribe. [any thread]
class Messages {
 public:
  using Clock = std::function<std::chrono::steady_clock::time_point()>;
  /// `clock` is for tests of the rate limit; empty = the steady clock.
  explicit Messages(std::size_t capacity = 1000, Clock clock = {})
      : capacity_(capacity), clock_(std::move(clock)) {}
  /// More than `kRateLimit` equal (code, text) pairs within a second are counted instead of
  /// repeated.
  static constexpr int kRateLimit = 5;
  void post(Severity, std::string_view code, std::string_view text, std::string_view source = {});
  /// The same, with severity, code and text of the fault.
  void post(const Fault&, std::string_view source = {});
  [[nodiscard]] std::vector<Message> recent(std::size_t at_most = 100) const;
  using Subscriber = std::function<void(const Message&)>;
  std::uint64_t subscribe(Subscriber);
  void unsubscribe(std::uint64_t);
  /// Messages posted by a thread that holds `lock`, which must outlive this object, reach
  /// subscribers when the thread has released it. Call it before anything is posted.
  void deliver_after(AppLock& lock) { lock_ = &lock; }

 private:
  void post(Message&&);
  struct Seen {
    std::chrono::steady_clock::time_point since;
    int count = 0;
    std::uint32_t suppressed = 0;
  };
  std::size_t capacity_;
  Clock clock_;
  AppLock own_lock_;
  AppLock* lock_ = &own_lock_;
  mutable std::mutex mutex_;
  std::deque<Message> ring_;                         // guarded by mutex_
  std::map<std::uint64_t, Subscriber> subscribers_;  // guarded by mutex_
  std::map<std::string, Seen> seen_;                 // guarded by mutex_
  std::uint64_t next_ = 1;                           // guarded by mutex_
};

}  // namespace robomosp
