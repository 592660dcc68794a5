// SPDX-License-Identifier: Apache-2.0
// Cache of derived values by fingerprint, least recently used first out, with a byte budget; if
// several threads request the same value, one of them computes it (layer: application). Internal to
// modules/evaluation. [any thread]
#pragma once

#include <array>
#include <condition_variable>
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <unordered_map>
#include <utility>

#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

#include "evaluation/derived.h"
#include "kernel/fingerprint.h"

namespace robomosp::evaluation {

class Cache {
 public:
  explicit Cache(std::size_t budget_bytes) : budget_(budget_bytes) {}

  /// Returns the value of `key`, or computes it by `make`: Result<T>, called without a lock. If
  /// several threads request a key at once, one computes the value and the others wait, each until
  /// its own `progress` is cancelled; if the computing one is cancelled or throws, one of the
  /// waiting threads starts over. `bytes` estimates the size of a value. Failures are kept under
  /// `failure_key`; cancellations are not kept. The fingerprint's domain ("mesh/1") must identify
  /// the type T.
  template <class T, class Make, class Bytes>
  Result<std::shared_ptr<const T>> get(const Fingerprint& key, const Fingerprint& failure_key,
                                       const Progress& progress, Make&& make, Bytes&& bytes) {
    const auto answer = [](const Value& v) -> Result<std::shared_ptr<const T>> {
      if (v.error) return *v.error;
      return std::static_pointer_cast<const T>(v.value);
    };
    for (;;) {
      const Turn turn = begin(key, failure_key);
      if (turn.found) return answer(*turn.found);
      if (turn.other) {
        auto outcome = wait(*turn.other, progress);
        if (!outcome.ok()) return std::move(outcome).error();
        if (*outcome) return answer(**outcome);
        continue;
      }
      Landing landing(*this, key, turn.own);
      Result<T> made = make();
      if (!made.ok()) {
        if (made.error().code != ErrorCode::cancelled) {
          (void)keep(failure_key, {nullptr, made.error()}, 512);
          landing.with({nullptr, made.error()});
        }
        return std::move(made).error();
      }
      const std::size_t size = bytes(*made);
      std::shared_ptr<const void> value = std::make_shared<const T>(std::move(made).value());
      value = keep(key, {std::move(value), std::nullopt}, size);
      landing.with({value, std::nullopt});
      return std::static_pointer_cast<const T>(value);
    }
  }

  /// True if a value or failure is kept under either key; not counted as a look-up.
  [[nodiscard]] bool holds(const Fingerprint& key, const Fingerprint& failure_key) const;
  /// The key last computed for a record under `gravity`, while it is remembered.
  [[nodiscard]] std::optional<Fingerprint> key_of(const document::RecordPtr& record,
                                                  const Vec3& gravity) const;
  void keep_key(const document::RecordPtr& record, const Vec3& gravity, const Fingerprint& key);
  [[nodiscard]] CacheStats stats() const;
  void clear();
  void set_enabled(bool);
  [[nodiscard]] bool is_enabled() const;

 private:
  struct Value {
    std::shared_ptr<const void> value;  ///< null when failed
    std::optional<Error> error;
  };
  struct Entry {
    Fingerprint key;
    Value value;
    std::size_t bytes = 0;
  };
  /// A value being computed.
  struct Flight {
    std::thread::id maker;
    std::size_t waiting = 0;       // guarded by mutex_, as is all below
    bool has_landed = false;       ///< no thread computes it any more
    std::optional<Value> outcome;  ///< empty = the computing thread was cancelled or threw
  };
  /// What a requesting thread does: use the cached value, wait for another thread's, or compute it
  /// (`own`; null = without sharing).
  struct Turn {
    std::optional<Value> found;
    std::shared_ptr<Flight> other, own;
  };
  /// Ends a flight in all cases, also if the computing thread fails.
  class Landing {
   public:
    Landing(Cache& cache, const Fingerprint& key, std::shared_ptr<Flight> flight);
    ~Landing();
    Landing(const Landing&) = delete;
    Landing& operator=(const Landing&) = delete;
    void with(Value outcome) { outcome_ = std::move(outcome); }

   private:
    Cache& cache_;
    const Fingerprint key_;
    std::shared_ptr<Flight> flight_;
    std::optional<Value> outcome_;
  };
  [[nodiscard]] Turn begin(const Fingerprint& key, const Fingerprint& failure_key);
  /// Waits for the outcome of a flight; empty = the value must still be computed; an error if the
  /// waiting thread is cancelled first.
  [[nodiscard]] Result<std::optional<Value>> wait(Flight& flight, const Progress& progress);
  /// Stores and returns the value, or returns the one stored first.
  std::shared_ptr<const void> keep(const Fingerprint& key, Value value, std::size_t bytes);

  /// Records never change but are replaced, and these are kept alive: an equal address means equal
  /// content.
  struct RecordKey {
    document::RecordPtr record;
    Vec3 gravity{};
    Fingerprint key;
  };
  static constexpr std::size_t kRecordKeys = 16;

  mutable std::mutex mutex_;
  std::condition_variable landed_;
  std::unordered_map<Fingerprint, std::shared_ptr<Flight>> flights_;  // by key; guarded by mutex_
  std::array<RecordKey, kRecordKeys> record_keys_;  // guarded by mutex_
  std::size_t next_record_key_ = 0;                 // guarded by mutex_
  std::list<Entry> entries_;                        // most recent first; guarded by mutex_
  std::unordered_map<Fingerprint, std::list<Entry>::iterator> index_;  // guarded by mutex_
  CacheStats stats_;                                                   // guarded by mutex_
  std::size_t budget_;
  bool is_enabled_ = true;  // guarded by mutex_
};

}  // namespace robomosp::evaluation
