// SPDX-License-Identifier: Apache-2.0
#include "spatial/parallel.h"

#include <algorithm>
#include <array>
#include <system_error>
#include <thread>

namespace robomosp::spatial {
namespace {

constexpr std::size_t kMostThreads = 16;
constexpr double kWorthwhile = 300e3;  // of work a thread [ns]

}  // namespace

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
