// SPDX-License-Identifier: Apache-2.0
// Counts allocations by operator new. It replaces the operators of the program, so only one file of
// a program includes this. Not for use with sanitizers: their operators find more faults.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <new>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define ROBOMOSP_COUNTS_MEMORY 0
#else
#define ROBOMOSP_COUNTS_MEMORY 1
#endif

namespace robomosp::test {

/// Since the start of the program, of all threads.
inline std::atomic<std::size_t> allocations{0}, allocated_bytes{0};

struct Cost {
  double allocations = 0, bytes = 0;
};

/// The mean of a hundred calls of `one(i)`.
template <class Fn>
Cost cost(Fn&& one) {
  constexpr int kCalls = 100;
  const std::size_t count = allocations, bytes = allocated_bytes;
  for (int i = 0; i < kCalls; ++i) one(i);
  return {static_cast<double>(allocations - count) / kCalls,
          static_cast<double>(allocated_bytes - bytes) / kCalls};
}

}  // namespace robomosp::test

#if ROBOMOSP_COUNTS_MEMORY
// Not inlined, or the compiler takes malloc() and delete for a pair that does not match.
[[gnu::noinline]] void* operator new(std::size_t size) {
  ++robomosp::test::allocations;
  robomosp::test::allocated_bytes += size;
  if (void* p = std::malloc(size)) return p;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* p) noexcept { std::free(p); }
[[gnu::noinline]] void operator delete(void* p, std::size_t) noexcept { std::free(p); }
#endif
