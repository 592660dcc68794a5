// SPDX-License-Identifier: Apache-2.0
// Copy on write behind shared pointers (layer: core).
#pragma once

#include <atomic>
#include <memory>

namespace robomosp {

/// The object behind `p` for modification: copied unless `p` is its only owner. Ensure uniqueness
/// from the root down, since copies of an owner share what it owns.
template <class T>
T& unique(std::shared_ptr<T>& p) {
#if defined(__SANITIZE_THREAD__)
  constexpr bool kKnowsFences = false;  // ThreadSanitizer does not, so there it is always a copy
#else
  constexpr bool kKnowsFences = true;
#endif
  if (!p) {
    p = std::make_shared<T>();
  } else if (!kKnowsFences || p.use_count() != 1) {
    p = std::make_shared<T>(*p);
  } else {
    // Another thread may have released it just before; its reads happened before our writes.
#if !defined(__SANITIZE_THREAD__)
    std::atomic_thread_fence(std::memory_order_acquire);
#endif
  }
  return *p;
}

}  // namespace robomosp
