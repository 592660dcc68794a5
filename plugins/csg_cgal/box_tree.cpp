// SPDX-License-Identifier: GPL-3.0-or-later
#include "box_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace robomosp::csg_cgal {
namespace {

constexpr float kInf = std::numeric_limits<float>::infinity();

float below(double x) {
  const auto f = static_cast<float>(x);
  return double{f} <= x ? f : std::nextafter(f, -kInf);
}
float above(double x) {
  const auto f = static_cast<float>(x);
  return double{f} >= x ? f : std::nextafter(f, kInf);
}

/// Twenty-one bits with two zeros after each.
std::uint64_t spread_out(std::uint64_t x) {
  x = (x | x << 32U) & 0x1F00000000FFFFU;
  x = (x | x << 16U) & 0x1F0000FF0000FFU;
  x = (x | x << 8U) & 0x100F00F00F00F00FU;
  x = (x | x << 4U) & 0x10C30C30C30C30C3U;
  return (x | x << 2U) & 0x1249249249249249U;
}

struct Keyed {
  std::uint64_t key;
  std::uint32_t triangle;
};

/// By key, equal ones as they were.
void sort_by_key(std::vector<Keyed>& all) {
  constexpr std::size_t kBits = 11, kBuckets = std::size_t{1} << kBits;
  std::vector<Keyed> other(all.size());
  for (std::size_t shift = 0; shift < 63; shift += kBits) {
    std::array<std::uint32_t, kBuckets + 1> first{};
    for (const Keyed& k : all) ++first[(k.key >> shift & (kBuckets - 1)) + 1];
    if (std::find(first.begin(), first.end(), all.size()) != first.end()) continue;  // all alike
    std::partial_sum(first.begin(), first.end(), first.begin());
    for (const Keyed& k : all) other[first[k.key >> shift & (kBuckets - 1)]++] = k;
    all.swap(other);
  }
}

}  // namespace

BoxTree::Box BoxTree::around(const Box& a, const Box& b) {
  return {a.low < b.low ? a.low : b.low, a.high > b.high ? a.high : b.high};
}

BoxTree::BoxTree(std::span<const Vec3> points,
                 std::span<const std::array<std::uint32_t, 3>> triangles, double slack) {
  if (triangles.empty()) return;
  Box3 all;
  for (const Vec3& p : points) all.add(p);
  origin_ = (all.low + all.high) * 0.5;
  for (std::size_t i = 0; i < 3; ++i)
    reach_ = std::max({reach_, std::abs(all.low[i]), std::abs(all.high[i])});
  // Differences from the origin are rounded, too.
  const double margin = slack + 1e-15 * reach_;
  const Vec3 size = all.high - all.low;
  const double widest = std::max({size[0], size[1], size[2]});
  const double cells = widest > 0 ? 2097151.0 / widest : 0;
  std::vector<Keyed> keyed(triangles.size());
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    const auto& [a, b, c] = triangles[t];
    std::uint64_t key = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const double mid = (points[a][i] + points[b][i] + points[c][i]) / 3 - all.low[i];
      const double cell = std::clamp(mid * cells, 0.0, 2097151.0);
      key |= spread_out(static_cast<std::uint64_t>(cell)) << i;
    }
    keyed[t] = {key, t};
  }
  sort_by_key(keyed);
  order_.resize(keyed.size());
  boxes_.resize(keyed.size(), Box{});
  for (std::size_t i = 0; i < keyed.size(); ++i) {
    order_[i] = keyed[i].triangle;
    const auto& [a, b, c] = triangles[order_[i]];
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax({points[a][k], points[b][k], points[c][k]});
      boxes_[i].low[k] = below(low - origin_[k] - margin);
      boxes_[i].high[k] = above(high - origin_[k] + margin);
    }
  }
  auto& leaves = levels_.emplace_back((keyed.size() + kLeaf - 1) / kLeaf);
  for (std::uint32_t i = 0; i < leaves.size(); ++i) {
    const auto [first, last] = leaf(i);
    leaves[i] = boxes_[first];
    for (std::uint32_t k = first + 1; k < last; ++k) leaves[i] = around(leaves[i], boxes_[k]);
  }
  while (levels_.back().size() > 1) {
    const auto& low = levels_.back();
    std::vector<Box> next((low.size() + 1) / 2);
    for (std::size_t i = 0; i < next.size(); ++i)
      next[i] = 2 * i + 1 < low.size() ? around(low[2 * i], low[2 * i + 1]) : low[2 * i];
    levels_.push_back(std::move(next));
  }
}

}  // namespace robomosp::csg_cgal
