// SPDX-License-Identifier: Apache-2.0
// Cache of derived values by fingerprint, least recently used first out, with a byte budget
// (layer: application). Internal to modules/evaluation. [any thread]
#pragma once

#include <array>
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <unordered_map>
#include <utility>

#include <robomosp/sdk/result.h>

#include "evaluation/derived.h"
#include "kernel/fingerprint.h"

namespace robomosp::evaluation {

class Cache {
 public:
  explicit Cache(std::size_t budget_bytes) : budget_(budget_bytes) {}

  /// The value of `key`, else what `make` computes: Result<T>. Makes are run without a lock; of two
  /// at the same time the first to finish is kept, so that all share one value. `bytes` estimates
  /// the size of a value. Failures are kept under `failure_key`, cancellation is not kept.
  /// The fingerprint's domain ("mesh/1") must tell the type T.
  template <class T, class Make, class Bytes>
  Result<std::shared_ptr<const T>> get(const Fingerprint& key, const Fingerprint& failure_key,
                                       Make&& make, Bytes&& bytes) {
    if (auto found = find(key, failure_key)) {
      if (found->error) return *found->error;
      return std::static_pointer_cast<const T>(found->value);
    }
    Result<T> made = make();
    if (!made.ok()) {
      if (made.error().code != ErrorCode::cancelled)
        (void)keep(failure_key, {nullptr, made.error()}, 512);
      return std::move(made).error();
    }
    const std::size_t size = bytes(*made);
    std::shared_ptr<const void> value = std::make_shared<const T>(std::move(made).value());
    return std::static_pointer_cast<const T>(keep(key, {std::move(value), std::nullopt}, size));
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
  [[nodiscard]] std::optional<Value> find(const Fingerprint& key, const Fingerprint& failure_key);
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
  std::array<RecordKey, kRecordKeys> record_keys_;  // guarded by mutex_
  std::size_t next_record_key_ = 0;                 // guarded by mutex_
  std::list<Entry> entries_;                        // most recent first; guarded by mutex_
  std::unordered_map<Fingerprint, std::list<Entry>::iterator> index_;  // guarded by mutex_
  CacheStats stats_;                                                   // guarded by mutex_
  std::size_t budget_;
  bool is_enabled_ = true;  // guarded by mutex_
};

}  // namespace robomosp::evaluation
