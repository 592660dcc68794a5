// SPDX-License-Identifier: GPL-3.0-or-later
// Boxes of boxes around the triangles of a mesh, for finding pairs that may intersect (layer:
// plugin).
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "patch_mesh.h"

namespace robomosp::csg_cgal {

/// Built once, then only read. Triangles are sorted along a space-filling curve; four form a leaf,
/// and two boxes one of the next level, so that only boxes are stored. Results are supersets: boxes
/// are rounded outwards. [any thread]
class BoxTree {
 public:
  BoxTree() = default;
  /// `slack`: greatest error of the corners [m].
  BoxTree(std::span<const Vec3> points, std::span<const std::array<std::uint32_t, 3>> triangles,
          double slack);

  /// Calls see(own, other) for every pair of triangles with intersecting boxes.
  template <class See>
  void pairs(const BoxTree& other, See&& see) const;
  /// Calls see(t, u) once for every pair of triangles with intersecting boxes, for the part'th of
  /// `parts` portions of about equal work.
  template <class See>
  void pairs_within(std::size_t part, std::size_t parts, See&& see) const;
  /// Calls see(t) for every triangle with a box that intersects this one.
  template <class See>
  void meeting(const Box3& box, See&& see) const;

 private:
  /// In metres from the origin_, rounded outwards; a fourth number, 0, allows comparing all by one
  /// instruction.
  using Four = float __attribute__((vector_size(16)));
  struct Box {
    Four low, high;
  };
  static constexpr std::size_t kLeaf = 4;
  struct Place {
    std::uint32_t level, index;
  };

  static Box around(const Box& a, const Box& b);
  static bool meet(const Box& a, const Box& b) {
    const auto is_so = (a.low <= b.high) & (b.low <= a.high);
    using Halves = std::array<std::int64_t, 2>;
    const auto halves = std::bit_cast<Halves>(is_so);
    return (halves[0] & halves[1]) == -1;
  }
  /// `by`: from the origin of a to that of b.
  static bool meet(const Box& a, const Box& b, const Vec3& by, double margin) {
    bool is_so = true;
    for (std::size_t i = 0; i < 3; ++i)
      is_so = is_so & (double{a.low[i]} <= double{b.high[i]} + by[i] + margin) &
              (double{b.low[i]} + by[i] <= double{a.high[i]} + margin);
    return is_so;
  }
  [[nodiscard]] const Box& box(Place p) const { return levels_[p.level][p.index]; }
  [[nodiscard]] std::pair<std::uint32_t, std::uint32_t> leaf(std::uint32_t index) const;
  [[nodiscard]] Place root() const { return {static_cast<std::uint32_t>(levels_.size() - 1), 0}; }
  template <class Call>
  void children(Place p, Call&& call) const {
    for (const std::uint32_t c : {2 * p.index, 2 * p.index + 1})
      if (c < levels_[p.level - 1].size()) call(Place{p.level - 1, c});
  }

  Vec3 origin_{};
  double reach_ = 0;                      ///< greatest coordinate of origin and corners
  std::vector<std::uint32_t> order_;      ///< triangles along the curve
  std::vector<Box> boxes_;                ///< of the triangles in that order
  std::vector<std::vector<Box>> levels_;  ///< leaves first
};

inline std::pair<std::uint32_t, std::uint32_t> BoxTree::leaf(std::uint32_t index) const {
  const std::size_t first = kLeaf * index, last = std::min(first + kLeaf, order_.size());
  return {static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(last)};
}

template <class See>
void BoxTree::pairs(const BoxTree& other, See&& see) const {
  if (order_.empty() || other.order_.empty()) return;
  const Vec3 by = other.origin_ - origin_;
  const double margin = 1e-15 * (reach_ + other.reach_);
  std::vector<std::pair<Place, Place>> open{{root(), other.root()}};
  while (!open.empty()) {
    const auto [a, b] = open.back();
    open.pop_back();
    if (!meet(box(a), other.box(b), by, margin)) continue;
    if (a.level == 0 && b.level == 0) {
      const auto [a0, a1] = leaf(a.index);
      const auto [b0, b1] = other.leaf(b.index);
      for (std::uint32_t i = a0; i < a1; ++i)
        for (std::uint32_t j = b0; j < b1; ++j)
          if (meet(boxes_[i], other.boxes_[j], by, margin)) see(order_[i], other.order_[j]);
    } else if (a.level >= b.level) {
      children(a, [&](Place c) { open.emplace_back(c, b); });
    } else {
      other.children(b, [&](Place c) { open.emplace_back(a, c); });
    }
  }
}

template <class See>
void BoxTree::pairs_within(std::size_t part, std::size_t parts, See&& see) const {
  if (order_.empty()) return;
  // Portions are subtrees of one level with everything below.
  std::uint32_t split = root().level;
  while (split > 0 && levels_[split].size() < 4 * parts) --split;
  std::vector<std::pair<Place, Place>> open;
  const auto leaves = [&](std::uint32_t a, std::uint32_t b) {
    const auto [a0, a1] = leaf(a);
    const auto [b0, b1] = leaf(b);
    for (std::uint32_t i = a0; i < a1; ++i)
      for (std::uint32_t j = a == b ? i + 1 : b0; j < b1; ++j)
        if (meet(boxes_[i], boxes_[j])) see(order_[i], order_[j]);
  };
  const auto count = static_cast<std::uint32_t>(levels_[split].size());
  for (std::uint32_t i = static_cast<std::uint32_t>(part); i < count;
       i += static_cast<std::uint32_t>(parts)) {
    for (std::uint32_t j = i; j < count; ++j) {
      if (!meet(levels_[split][i], levels_[split][j])) continue;
      open.push_back({{split, i}, {split, j}});
      while (!open.empty()) {
        const auto [a, b] = open.back();
        open.pop_back();
        if (a.level == 0) {
          leaves(a.index, b.index);
          continue;
        }
        const auto& below = levels_[a.level - 1];
        for (std::uint32_t c = 2 * a.index;
             c < std::min<std::size_t>(2 * a.index + 2, below.size()); ++c)
          for (std::uint32_t d = a.index == b.index ? c : 2 * b.index;
               d < std::min<std::size_t>(2 * b.index + 2, below.size()); ++d)
            if (meet(below[c], below[d])) open.push_back({{a.level - 1, c}, {b.level - 1, d}});
      }
    }
  }
}

template <class See>
void BoxTree::meeting(const Box3& given, See&& see) const {
  if (order_.empty()) return;
  const double margin = 1e-15 * (reach_ + norm(given.low) + norm(given.high));
  const auto meets = [&](const Box& b) {
    for (std::size_t i = 0; i < 3; ++i)
      if (!(origin_[i] + double{b.low[i]} <= given.high[i] + margin &&
            given.low[i] <= origin_[i] + double{b.high[i]} + margin))
        return false;
    return true;
  };
  std::vector<Place> open{root()};
  while (!open.empty()) {
    const Place p = open.back();
    open.pop_back();
    if (!meets(box(p))) continue;
    if (p.level > 0) {
      children(p, [&](Place c) { open.push_back(c); });
      continue;
    }
    const auto [first, last] = leaf(p.index);
    for (std::uint32_t i = first; i < last; ++i)
      if (meets(boxes_[i])) see(order_[i]);
  }
}

}  // namespace robomosp::csg_cgal
