// SPDX-License-Identifier: Apache-2.0
#include "touching.h"

#include <cmath>

#include "boolean.h"
#include "leaders.h"
#include "spatial/box.h"
#include "spatial/box_tree.h"

namespace robomosp::csg_occt {
namespace {

/// Covers what rounding takes off where a box is kept as centre and half.
constexpr double kTouchRounding = 1e-12;  // [mm], and of the numbers

spatial::Box rounded_outwards(const Bnd_Box& box) {
  const gp_Pnt low = box.CornerMin(), high = box.CornerMax();
  spatial::Box out;
  for (int k = 1; k <= 3; ++k) {
    const auto i = static_cast<std::size_t>(k - 1);
    const double a = low.Coord(k), b = high.Coord(k);
    out.centre[i] = 0.5 * (a + b);
    out.half[i] = 0.5 * (b - a) + kTouchRounding * (1 + std::abs(a) + std::abs(b));
  }
  return out;
}

}  // namespace

std::vector<std::vector<std::size_t>> touching_sets(
    const std::vector<const Bnd_Box*>& boxes,
    const std::function<bool(std::size_t, std::size_t)>& counts, const Progress& progress) {
  const std::size_t n = boxes.size();
  std::vector<spatial::Box> leaves;
  std::vector<std::size_t> box_of_leaf;
  for (std::size_t i = 0; i < n; ++i) {
    if (boxes[i]->IsVoid()) continue;
    leaves.push_back(rounded_outwards(*boxes[i]));
    box_of_leaf.push_back(i);
  }
  const spatial::BoxTree tree(leaves);
  std::vector<spatial::Box> nodes;
  tree.refit(leaves, nodes);
  Leaders leaders(n);
  for (std::size_t k = 0; k < leaves.size(); ++k) {
    if (progress.cancelled()) return {};
    const std::size_t i = box_of_leaf[k];
    tree.near(
        nodes, leaves[k], [] { return 0.0; },
        [&](std::size_t leaf) {
          const std::size_t j = box_of_leaf[leaf];
          if (j > i && counts(i, j) && boxes_meet(*boxes[i], *boxes[j]))
            leaders.join(static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j));
        });
  }
  std::vector<std::vector<std::size_t>> sets;
  std::vector<std::size_t> place(n, n);
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t first = leaders.find(static_cast<std::uint32_t>(i));
    if (place[first] == n) {
      place[first] = sets.size();
      sets.emplace_back();
    }
    sets[place[first]].push_back(i);
  }
  return sets;
}

}  // namespace robomosp::csg_occt
