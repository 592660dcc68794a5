// SPDX-License-Identifier: Apache-2.0
// How often memory was allocated, for tests of functions that are called for every sample (layer:
// contract helper for tests, header-only). A program counts when one of its sources includes
// count_allocations.h; in others the tests of allocations are skipped.
#pragma once

#include <atomic>

#include <gtest/gtest.h>

namespace robomosp::conformance {

inline std::atomic<long long> allocations{0};        ///< by all threads since the program began
inline std::atomic<bool> counts_allocations{false};  ///< set by count_allocations.h

/// Allocations that `work` makes, on all threads. Call it once before: what is made on first use
/// (a thread, a table) is no allocation for each sample.
template <class Work>
[[nodiscard]] long long allocations_in(const Work& work) {
  const long long before = allocations.load();
  work();
  return allocations.load() - before;
}

}  // namespace robomosp::conformance

/// Ends a test in a program that does not count.
#define RMP_NEEDS_ALLOCATION_COUNTS()             \
  if (!robomosp::conformance::counts_allocations) \
  GTEST_SKIP() << "this program does not count allocations (conformance/count_allocations.h)"
