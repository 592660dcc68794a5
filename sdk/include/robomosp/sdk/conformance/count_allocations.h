// SPDX-License-Identifier: Apache-2.0
// Makes a test program count allocations (allocations.h): include it in exactly one of its sources.
// With the GNU C library it counts malloc and its like, which is what operator new and Eigen call;
// with others operator new. Sanitizers have their own allocators: under them nothing is counted.
#pragma once

#include <cerrno>
#include <cstdlib>
#include <new>

#include <robomosp/sdk/conformance/allocations.h>

#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || \
    __has_feature(memory_sanitizer)
#define RMP_SANITIZED 1
#endif
#endif
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define RMP_SANITIZED 1
#endif

#if !defined(RMP_SANITIZED)

#if defined(__GLIBC__)
extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);

__attribute__((visibility("default"))) void* malloc(std::size_t n) noexcept {
  robomosp::conformance::allocations.fetch_add(1, std::memory_order_relaxed);
  return __libc_malloc(n);
}
__attribute__((visibility("default"))) void* calloc(std::size_t n, std::size_t size) noexcept {
  robomosp::conformance::allocations.fetch_add(1, std::memory_order_relaxed);
  return __libc_calloc(n, size);
}
__attribute__((visibility("default"))) void* realloc(void* p, std::size_t n) noexcept {
  robomosp::conformance::allocations.fetch_add(1, std::memory_order_relaxed);
  return __libc_realloc(p, n);
}
__attribute__((visibility("default"))) void* memalign(std::size_t alignment,
                                                      std::size_t n) noexcept {
  robomosp::conformance::allocations.fetch_add(1, std::memory_order_relaxed);
  return __libc_memalign(alignment, n);
}
__attribute__((visibility("default"))) void* aligned_alloc(std::size_t alignment,
                                                           std::size_t n) noexcept {
  return memalign(alignment, n);
}
__attribute__((visibility("default"))) int posix_memalign(void** out, std::size_t alignment,
                                                          std::size_t n) noexcept {
  *out = memalign(alignment, n);
  return *out || n == 0 ? 0 : ENOMEM;
}
}
#else
__attribute__((visibility("default"))) void* operator new(std::size_t n) {
  robomosp::conformance::allocations.fetch_add(1, std::memory_order_relaxed);
  if (void* p = std::malloc(n ? n : 1)) return p;
  throw std::bad_alloc();
}
__attribute__((visibility("default"))) void operator delete(void* p) noexcept { std::free(p); }
__attribute__((visibility("default"))) void operator delete(void* p, std::size_t) noexcept {
  std::free(p);
}
#endif

namespace robomosp::conformance {
namespace {
[[maybe_unused]] const bool kCountsAllocations = [] {
  // Seen from a plugin: its malloc is this one, or nothing can be counted.
  const long long before = allocations.load();
  ::operator delete(::operator new(16));
  counts_allocations = allocations.load() > before;
  return true;
}();
}  // namespace
}  // namespace robomosp::conformance

#endif
