// SPDX-License-Identifier: Apache-2.0
// Axis-aligned boxes around bodies, and how far they are apart (layer: data processing, spatial).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>

#include "spatial/pose.h"
#include "spatial/vec.h"

namespace robomosp::spatial {

struct Box {
  Vec3 centre{}, half{};
};

[[nodiscard]] inline Box box_around(std::span<const Vec3> points) {
  constexpr double kInf = std::numeric_limits<double>::infinity();
  Vec3 low{kInf, kInf, kInf}, high{-kInf, -kInf, -kInf};
  for (const Vec3& p : points)
    for (std::size_t k = 0; k < 3; ++k)
      low[k] = std::min(low[k], p[k]), high[k] = std::max(high[k], p[k]);
  return {scale(add(low, high), 0.5), scale(sub(high, low), 0.5)};
}
/// Around two boxes.
[[nodiscard]] inline Box around(const Box& a, const Box& b) {
  Box out;
  for (std::size_t k = 0; k < 3; ++k) {
    const double low = std::min(a.centre[k] - a.half[k], b.centre[k] - b.half[k]);
    const double high = std::max(a.centre[k] + a.half[k], b.centre[k] + b.half[k]);
    out.centre[k] = 0.5 * (low + high);
    out.half[k] = 0.5 * (high - low);
  }
  return out;
}
/// Around a box that is moved and turned.
[[nodiscard]] inline Box moved(const Box& b, const Pose& t) {
  Box out{transform(t, b.centre), {}};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) out.half[i] += std::fabs(t.R[3 * i + j]) * b.half[j];
  return out;
}
/// Square of the least distance of two boxes; 0 where they meet.
[[nodiscard]] inline double squared_gap(const Box& a, const Box& b) {
  double sum = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const double d = std::fabs(a.centre[i] - b.centre[i]) - a.half[i] - b.half[i];
    if (d > 0) sum += d * d;
  }
  return sum;
}
[[nodiscard]] inline double gap(const Box& a, const Box& b) { return std::sqrt(squared_gap(a, b)); }

}  // namespace robomosp::spatial
