// SPDX-License-Identifier: Apache-2.0
// Rows between the thread that reads them and the one that hands them on (layer: plugin).
#pragma once

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <mutex>
#include <utility>
#include <vector>

namespace robomosp::bridges {

/// One sample of a recording: the time [s], then its columns.
struct Row {
  std::size_t recording = 0;  ///< into the configuration's list
  std::vector<double> values;
};

/// Holds so many rows at most; a further one drops the oldest. [any thread]
class RowQueue {
 public:
  explicit RowQueue(std::size_t most) : most_(most) {}

  void push(Row row) {
    const std::lock_guard lock(mutex_);
    rows_.push_back(std::move(row));
    if (rows_.size() > most_) rows_.pop_front(), ++dropped_;
    if (rows_.size() >= wanted_) changed_.notify_one();
  }
  /// The oldest `most` rows, after `wait` at the latest, or as soon as so many are there.
  std::vector<Row> take(std::size_t most, std::chrono::milliseconds wait) {
    std::unique_lock lock(mutex_);
    wanted_ = std::min(most, most_);
    changed_.wait_for(lock, wait, [&] { return rows_.size() >= wanted_; });
    std::vector<Row> out;
    for (; !rows_.empty() && out.size() < most; rows_.pop_front())
      out.push_back(std::move(rows_.front()));
    return out;
  }
  /// Puts rows back that could not be handed on, in front of the others.
  void put_back(std::vector<Row> rows) {
    const std::lock_guard lock(mutex_);
    for (; !rows.empty(); rows.pop_back()) {
      if (rows_.size() >= most_) {
        dropped_ += rows.size();
        return;
      }
      rows_.push_front(std::move(rows.back()));
    }
  }
  [[nodiscard]] std::uint64_t dropped() const {
    const std::lock_guard lock(mutex_);
    return dropped_;
  }
  [[nodiscard]] std::size_t size() const {
    const std::lock_guard lock(mutex_);
    return rows_.size();
  }

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Row> rows_;       // guarded by mutex_
  std::uint64_t dropped_ = 0;  // guarded by mutex_
  std::size_t wanted_ = 1;     // guarded by mutex_; rows that a reader waits for
  const std::size_t most_;
};

}  // namespace robomosp::bridges
