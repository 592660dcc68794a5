// SPDX-License-Identifier: Apache-2.0
// Cache of derived values by fingerprint, least recently used first out, with a byte budget; a
// value that several threads want at once is computed by one of them (layer: application). Internal
// to modules/evaluation. [any thread]
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

  /// The value of `key`, else what `make` computes: Result<T>. Makes are run without a lock. Of
  /// threads that ask for a key at the same time one makes the value and the others wait for it,
  /// each until its own `progress` is cancelled; when the one that makes it is cancelled or throws,
  /// one of those that wait begins anew. `bytes` estimates the size of a value. Failures are kept
  /// under `failure_key`, cancellation is not kept. The fingerprint's domain ("mesh/1") must tell
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

  /// Whether a value or failure is kept under either key; counts as no look-up.
  [[nodiscard]] bool holds(const Fingerprint& key, const Fingerprint& failure_key) const;
  /// The key of what was last made of a record under `gravity`, for as long as it is remembered.
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
  /// A value that is being made.
  struct Flight {
    std::thread::id maker;
    std::size_t waiting = 0;       // guarded by mutex_, as is all below
    bool has_landed = false;       ///< nobody makes it any more
    std::optional<Value> outcome;  ///< none = who made it was cancelled or threw
  };
  /// What one who asks for a value does: takes what was found, waits for the other's, or makes it
  /// (`own`; null = for itself alone).
  struct Turn {
    std::optional<Value> found;
    std::shared_ptr<Flight> other, own;
  };
  /// Ends a flight, whatever happens to who made it.
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
  /// What came of a flight, none = its value is still to be made; an error when the asker is
  /// cancelled first.
  [[nodiscard]] Result<std::optional<Value>> wait(Flight& flight, const Progress& progress);
  /// Keeps and returns the value, or returns the one that was kept first.
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
