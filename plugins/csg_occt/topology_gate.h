// SPDX-License-Identifier: Apache-2.0
// Serialises access to topology: meshing writes triangles and polygons into faces and edges, and
// Booleans write flags, so solids that share topology take turns, while others run in parallel
// (layer: plugin).
#pragma once

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <iterator>
#include <list>
#include <mutex>
#include <utility>
#include <vector>

#include <robomosp/sdk/progress.h>

namespace robomosp::csg_occt {

/// Numbers of the primitives from which a solid was made, ascending. Solids with disjoint lineages
/// share no topology.
using Lineage = std::vector<std::uint64_t>;

inline void merge(Lineage& into, const Lineage& other) {
  Lineage both;
  both.reserve(into.size() + other.size());
  std::set_union(into.begin(), into.end(), other.begin(), other.end(), std::back_inserter(both));
  into = std::move(both);
}

/// One claim per lineage at a time, in order of arrival. A thread holds at most one claim. [any
/// thread]
class TopologyGate {
 private:
  using Queue = std::list<Lineage>;

 public:
  class Claim {
   public:
    Claim() = default;
    Claim(TopologyGate& gate, Queue::iterator place) : gate_(&gate), place_(place) {}
    Claim(Claim&& other) noexcept
        : gate_(std::exchange(other.gate_, nullptr)), place_(other.place_) {}
    Claim& operator=(Claim&&) = delete;
    ~Claim() {
      if (gate_) gate_->leave(place_);
    }
    explicit operator bool() const { return gate_ != nullptr; }

   private:
    TopologyGate* gate_ = nullptr;
    Queue::iterator place_;
  };

  std::uint64_t new_number() {
    const std::lock_guard lock(mutex_);
    return ++last_number_;
  }

  /// Waits for its turn; an empty claim means cancellation.
  Claim claim(Lineage lineage, const Progress& progress) {
    std::unique_lock lock(mutex_);
    queue_.push_back(std::move(lineage));
    const auto place = std::prev(queue_.end());
    while (!is_first(place)) {
      changed_.wait_for(lock, std::chrono::milliseconds(20));
      if (!is_first(place) && progress.cancelled()) {
        queue_.erase(place);
        changed_.notify_all();
        return {};
      }
    }
    return {*this, place};
  }

 private:
  static bool is_shared(const Lineage& a, const Lineage& b) {
    auto i = a.begin();
    auto j = b.begin();
    while (i != a.end() && j != b.end()) {
      if (*i == *j) return true;
      if (*i < *j) ++i;
      else ++j;
    }
    return false;
  }
  bool is_first(Queue::const_iterator place) const {
    return std::none_of(queue_.begin(), place,
                        [&](const Lineage& earlier) { return is_shared(earlier, *place); });
  }
  void leave(Queue::iterator place) {
    {
      const std::lock_guard lock(mutex_);
      queue_.erase(place);
    }
    changed_.notify_all();
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  Queue queue_;  // holders and waiting claims, in order of arrival
  std::uint64_t last_number_ = 0;
};

}  // namespace robomosp::csg_occt
