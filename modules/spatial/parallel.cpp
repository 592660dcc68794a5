// SPDX-License-Identifier: Apache-2.0
#include "spatial/parallel.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <system_error>
#include <thread>

#include <robomosp/sdk/host.h>

namespace robomosp::spatial {
namespace {

constexpr std::size_t kMostThreads = 16;
constexpr double kWorthwhile = 300e3;  // of work a thread [ns]

// The cores are shared by all who compute, whoever calls: there is no argument to hand this down.
std::atomic<Spread> current_spread{nullptr};

}  // namespace

void set_spread(Spread spread) { current_spread.store(spread, std::memory_order_release); }

void use_threads_of(const rmp_host* host) {
  if (const rmp_threads* threads = Host(host).threads()) set_spread(threads->spread);
}

std::size_t cores() {
  // Asked once: it costs the system some microseconds.
  static const std::size_t count =
      std::clamp<std::size_t>(std::thread::hardware_concurrency(), 1, kMostThreads);
  return count;
}

std::size_t worthwhile_threads(std::size_t samples, double nanoseconds) {
  const double threads = static_cast<double>(samples) * nanoseconds / kWorthwhile;
  if (threads < 2) return 1;
  return threads < static_cast<double>(kMostThreads)
             ? std::min(cores(), static_cast<std::size_t>(threads))
             : cores();
}

void in_parallel(std::size_t samples, std::size_t grain, std::size_t threads,
                 const std::function<void(std::size_t, std::size_t, std::size_t)>& work) {
  threads = std::clamp<std::size_t>(threads, 1, kMostThreads);
  const std::size_t grains = (samples + grain - 1) / grain;
  const auto part = [&](std::size_t t) { return std::min(samples, grains * t / threads * grain); };
  if (const Spread spread = current_spread.load(std::memory_order_acquire)) {
    const auto one = [&](std::size_t t) { work(part(t), part(t + 1), t); };
    using One = const decltype(one);
    spread(
        threads, threads, [](void* context, std::size_t t) { (*static_cast<One*>(context))(t); },
        const_cast<void*>(static_cast<const void*>(&one)));
    return;
  }
  std::array<std::jthread, kMostThreads> started;
  std::size_t refused = threads;
  for (std::size_t t = 1; t < threads; ++t) {
    try {
      started[t] = std::jthread([&, t] { work(part(t), part(t + 1), t); });
    } catch (const std::system_error&) {
      refused = t;
      break;
    }
  }
  work(part(0), part(1), 0);
  for (std::size_t t = refused; t < threads; ++t) work(part(t), part(t + 1), 0);
}

}  // namespace robomosp::spatial
