// SPDX-License-Identifier: Apache-2.0
#include "kernel/turns.h"

#include <sched.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdint>
#include <optional>

namespace robomosp::turns {
namespace {

/// A turn of a thread that answers [ns].
constexpr std::uint64_t kTurn = 100'000;
constexpr int kBehind = 5;

/// How nice threads are that compute; kNobody = the program does not serve.
constexpr int kNobody = -1000;
std::atomic<int> g_behind{kNobody};
thread_local bool t_is_behind = false;

/// Of this thread.
std::optional<int> niceness() {
  errno = 0;
  const int nice = ::getpriority(PRIO_PROCESS, 0);
  return errno == 0 ? std::optional(nice) : std::nullopt;
}

/// Of this thread; `turn` 0 = as the system does. Older systems take no notice of turns.
void set(int nice, std::uint64_t turn) {
  struct Attributes {  // sched_attr, whose header and <sched.h> exclude each other
    std::uint32_t size = sizeof(Attributes);
    std::uint32_t policy = SCHED_OTHER;
    std::uint64_t flags = 0;
    std::int32_t nice = 0;
    std::uint32_t priority = 0;
    std::uint64_t runtime = 0, deadline = 0, period = 0;
  } attributes;
  if (::sched_getscheduler(0) != SCHED_OTHER) return;
  attributes.nice = nice;
  attributes.runtime = turn;
  (void)::syscall(SYS_sched_setattr, 0, &attributes, 0U);
}

}  // namespace

void answer() {
  if (const auto nice = niceness()) set(*nice, kTurn);
}

void serve() {
  if (const auto nice = niceness()) g_behind.store(*nice + kBehind, std::memory_order_relaxed);
}

void compute() {
  const int behind = g_behind.load(std::memory_order_relaxed);
  if (t_is_behind || behind == kNobody) return;
  t_is_behind = true;
  // Threads begin as the one that starts them is: with short turns, or behind already.
  if (const auto nice = niceness()) set(std::max(*nice, behind), 0);
}

}  // namespace robomosp::turns
