// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <utility>

#include "scene/build.h"
#include "scene/ids.h"
#include "scene/shape.h"

namespace robomosp::scene {
namespace {

using render::Item;

Bounds box_around(std::span<const Item> items) {
  Bounds box = empty_box();
  for (const Item& item : items)
    if (item.mesh) grow(box, box_of(*item.mesh, item.pose));
  return box;
}

Vec3 middle(const Bounds& box) {
  return {0.5 * (box[0][0] + box[1][0]), 0.5 * (box[0][1] + box[1][1]),
          0.5 * (box[0][2] + box[1][2])};
}

}  // namespace

void explode(render::Scene& scene, std::span<const std::size_t> group_of, double factor) {
  const auto whole = box_around(scene.items);
  const double size = diagonal(whole);
  if (scene.items.empty() || !std::isfinite(size) || !(size > 0)) return;
  const Vec3 centre = middle(whole);
  std::size_t longest = 0;
  for (std::size_t i = 1; i < 3; ++i)
    if (whole[1][i] - whole[0][i] > whole[1][longest] - whole[0][longest]) longest = i;

  struct Group {
    std::vector<std::size_t> items;
    Bounds box{};
    Vec3 shift{};
  };
  std::vector<Group> groups;
  for (std::size_t i = 0; i < scene.items.size(); ++i) {
    if (group_of[i] >= groups.size()) groups.resize(group_of[i] + 1);
    groups[group_of[i]].items.push_back(i);
  }
  std::erase_if(groups, [](const Group& g) { return g.items.empty(); });
  for (Group& g : groups) {
    std::vector<Item> own;
    for (const std::size_t i : g.items) own.push_back(scene.items[i]);
    g.box = box_around(own);
  }
  // Groups that share a middle, in the order of their lengths along the longest axis.
  constexpr double kSamePlace = 0.02;
  std::vector<bool> done(groups.size(), false);
  for (std::size_t a = 0; a < groups.size(); ++a) {
    if (done[a] || groups[a].box[0][0] > groups[a].box[1][0]) continue;
    const Vec3 at = middle(groups[a].box);
    std::vector<std::size_t> together;
    for (std::size_t b = a; b < groups.size(); ++b) {
      if (done[b] || groups[b].box[0][0] > groups[b].box[1][0]) continue;
      const Vec3 other = middle(groups[b].box);
      if (std::hypot(at[0] - other[0], at[1] - other[1], at[2] - other[2]) > kSamePlace * size)
        continue;
      done[b] = true;
      together.push_back(b);
    }
    std::vector<Vec3> way(together.size());
    for (std::size_t k = 0; k < together.size(); ++k)
      for (std::size_t i = 0; i < 3; ++i) way[k][i] = at[i] - centre[i];
    // The one listed first stays; the others come out to either side, each past the one before.
    const auto length = [&](std::size_t k) {
      const auto& box = groups[together[k]].box;
      return box[1][longest] - box[0][longest];
    };
    double up = 0.5 * length(0), down = up;
    for (std::size_t k = 1; k < together.size(); ++k) {
      double& used = k % 2 == 1 ? up : down;
      way[k][longest] += (k % 2 == 1 ? 2.0 : -2.0) * (used + 0.5 * length(k));
      used += length(k);
    }
    for (std::size_t k = 0; k < together.size(); ++k)
      for (std::size_t i = 0; i < 3; ++i) groups[together[k]].shift[i] = factor * way[k][i];
  }
  for (std::size_t n = 0; n < groups.size(); ++n) {
    const Group& g = groups[n];
    if (std::hypot(g.shift[0], g.shift[1], g.shift[2]) < 1e-3 * size) continue;
    for (const std::size_t k : g.items)
      for (std::size_t i = 0; i < 3; ++i) scene.items[k].pose.p[i] += g.shift[i];
    render::Line line;
    line.id = item_id(scene.items[g.items.front()].name, kLineBody + 1, n);
    line.colour = {0.30F, 0.33F, 0.38F, 0.8F};
    line.width = 1.2F;
    const Vec3 from = middle(g.box);
    line.points = {from, {from[0] + g.shift[0], from[1] + g.shift[1], from[2] + g.shift[2]}};
    scene.lines.push_back(std::move(line));
  }
}

}  // namespace robomosp::scene
