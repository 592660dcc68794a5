// SPDX-License-Identifier: Apache-2.0
// Several threads that ask a provider at once (layer: contract helper for tests, header-only).
#pragma once

#include <barrier>
#include <cstddef>
#include <functional>
#include <thread>
#include <vector>

namespace robomosp::conformance {

/// Runs `work(thread)` on several threads at once, which all begin together.
inline void at_once(std::size_t threads, const std::function<void(std::size_t)>& work) {
  std::barrier start(static_cast<std::ptrdiff_t>(threads));
  std::vector<std::jthread> all;
  for (std::size_t i = 0; i < threads; ++i)
    all.emplace_back([&work, &start, i] {
      start.arrive_and_wait();
      work(i);
    });
}

}  // namespace robomosp::conformance
