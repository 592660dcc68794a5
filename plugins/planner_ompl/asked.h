// SPDX-License-Identifier: Apache-2.0
// What a search of our own may ask (layer: plugin).
#pragma once

#include <functional>
#include <span>

namespace robomosp::planner_ompl {

/// The checks of a problem, counted, and whether to stop; on the calling thread.
struct Asked {
  std::function<bool(std::span<const double> q)> is_free;
  std::function<bool(std::span<const double> a, std::span<const double> b)> is_free_between;
  std::function<bool()> is_over;
};

}  // namespace robomosp::planner_ompl
