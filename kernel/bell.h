// SPDX-License-Identifier: Apache-2.0
// Bell: wakes threads that wait for work (layer: core).
#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>

namespace robomosp {

/// Unlike a condition variable, ringing never blocks: glibc's pthread_cond_signal() waits for
/// threads that were woken earlier and have no processor yet, milliseconds on a busy machine. [any
/// thread]
class Bell {
 public:
  /// To be called after changing what `is_due` of wait() looks at, best without its mutex.
  void ring() {
    rings_.fetch_add(1, std::memory_order_release);
    rings_.notify_all();
  }
  /// The same; wakes one of the waiting threads.
  void ring_one() {
    rings_.fetch_add(1, std::memory_order_release);
    rings_.notify_one();
  }
  /// Waits until `is_due()`, which is called with `lock` held.
  template <class Due>
  void wait(std::unique_lock<std::mutex>& lock, Due&& is_due) {
    while (!is_due()) {
      const std::uint32_t heard = rings_.load(std::memory_order_acquire);
      lock.unlock();
      rings_.wait(heard, std::memory_order_acquire);
      lock.lock();
    }
  }

 private:
  std::atomic<std::uint32_t> rings_{0};
};

}  // namespace robomosp
