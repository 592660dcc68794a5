// SPDX-License-Identifier: Apache-2.0
#include "evaluation/cache.h"

#include <chrono>
#include <iterator>

#include "kernel/call_queue.h"

namespace robomosp::evaluation {

namespace {

/// How often one who waits for a value looks whether it is cancelled.
constexpr std::chrono::milliseconds kLook{20};

}  // namespace

Cache::Turn Cache::begin(const Fingerprint& key, const Fingerprint& failure_key) {
  Turn turn;
  const std::lock_guard lock(mutex_);
  if (is_enabled_)
    for (const Fingerprint& k : {key, failure_key})
      if (const auto it = index_.find(k); it != index_.end()) {
        entries_.splice(entries_.begin(), entries_, it->second);
        ++stats_.hits;
        turn.found = it->second->value;
        return turn;
      }
  if (is_enabled_) {
    std::shared_ptr<Flight>& flight = flights_[key];
    if (!flight) {
      turn.own = flight = std::make_shared<Flight>();
      flight->maker = std::this_thread::get_id();
    } else if (flight->maker != std::this_thread::get_id() && !CallQueue::is_serving()) {
      ++stats_.hits;
      turn.other = flight;
      return turn;
    }
    // Else nobody may be able to make it before this call returns: a thread that answers a call of
    // another one holds up that one, and whoever waits for a value that it makes.
  }
  ++stats_.misses;
  return turn;
}

Result<std::optional<Cache::Value>> Cache::wait(Flight& flight, const Progress& progress) {
  std::unique_lock lock(mutex_);
  ++flight.waiting;
  while (!wait_serving(lock, landed_, kLook, [&] { return flight.has_landed; })) {
    lock.unlock();
    const bool is_cancelled = progress.cancelled();
    lock.lock();
    if (!is_cancelled || flight.has_landed) continue;
    --flight.waiting;
    return error(ErrorCode::cancelled, "cancelled");
  }
  --flight.waiting;
  return flight.outcome;
}

Cache::Landing::Landing(Cache& cache, const Fingerprint& key, std::shared_ptr<Flight> flight)
    : cache_(cache), key_(key), flight_(std::move(flight)) {}

Cache::Landing::~Landing() {
  if (!flight_) return;
  const std::lock_guard lock(cache_.mutex_);
  flight_->outcome = std::move(outcome_);
  flight_->has_landed = true;
  cache_.flights_.erase(key_);
  if (flight_->waiting > 0) cache_.landed_.notify_all();
}

std::shared_ptr<const void> Cache::keep(const Fingerprint& key, Value value, std::size_t bytes) {
  // What is let go is destroyed after the lock: a shape's destructor is its provider's code.
  std::list<Entry> dropped;
  const std::lock_guard lock(mutex_);
  if (!is_enabled_) return value.value;
  if (const auto it = index_.find(key); it != index_.end()) {
    if (value.value && !it->second->value.value)
      it->second->value = value;  // another thread failed
    return value.value ? it->second->value.value : nullptr;
  }
  const std::size_t size = bytes + sizeof(Entry) + 128;
  entries_.push_front({key, value, size});
  index_.emplace(key, entries_.begin());
  stats_.bytes += size;
  while (stats_.bytes > budget_ && entries_.size() > 1) {
    stats_.bytes -= entries_.back().bytes;
    index_.erase(entries_.back().key);
    dropped.splice(dropped.begin(), entries_, std::prev(entries_.end()));
  }
  stats_.entries = entries_.size();
  return value.value;
}

std::optional<Fingerprint> Cache::key_of(const document::RecordPtr& record,
                                         const Vec3& gravity) const {
  const std::lock_guard lock(mutex_);
  if (!is_enabled_) return std::nullopt;
  for (const RecordKey& k : record_keys_)
    if (k.record == record && k.gravity == gravity) return k.key;
  return std::nullopt;
}

void Cache::keep_key(const document::RecordPtr& record, const Vec3& gravity,
                     const Fingerprint& key) {
  document::RecordPtr dropped = record;  // ended without the mutex
  const std::lock_guard lock(mutex_);
  RecordKey& k = record_keys_[next_record_key_++ % kRecordKeys];
  k.record.swap(dropped);
  k.gravity = gravity;
  k.key = key;
}

bool Cache::is_enabled() const {
  const std::lock_guard lock(mutex_);
  return is_enabled_;
}

bool Cache::holds(const Fingerprint& key, const Fingerprint& failure_key) const {
  const std::lock_guard lock(mutex_);
  return is_enabled_ && (index_.contains(key) || index_.contains(failure_key));
}

CacheStats Cache::stats() const {
  const std::lock_guard lock(mutex_);
  return stats_;
}

void Cache::clear() {
  std::list<Entry> dropped;
  std::array<RecordKey, kRecordKeys> keys;
  const std::lock_guard lock(mutex_);
  keys.swap(record_keys_);
  dropped.swap(entries_);
  index_.clear();
  stats_.entries = 0;
  stats_.bytes = 0;
}

void Cache::set_enabled(bool is_enabled) {
  const std::lock_guard lock(mutex_);
  is_enabled_ = is_enabled;
}

}  // namespace robomosp::evaluation
