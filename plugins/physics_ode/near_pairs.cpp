// SPDX-License-Identifier: Apache-2.0
#include "near_pairs.h"

#include <algorithm>
#include <cmath>

namespace robomosp::physics_ode {
namespace {

/// What rounding may take off a box kept as centre and half [m], and of its numbers.
constexpr double kAxisRounding = 1e-15;

bool boxes_meet(dGeomID a, dGeomID b) {
  dReal x[6], y[6];
  dGeomGetAABB(a, x);
  dGeomGetAABB(b, y);
  for (std::size_t k = 0; k < 3; ++k)
    if (x[2 * k] > y[2 * k + 1] || x[2 * k + 1] < y[2 * k]) return false;
  return true;
}

}  // namespace

void NearPairs::add(dGeomID geometry, std::int32_t body, bool is_movable) {
  entries_.push_back({geometry, body, is_movable});
  is_grouped_ = false;
}

spatial::Box NearPairs::box_of(dGeomID geometry) {
  dReal bounds[6];
  dGeomGetAABB(geometry, bounds);
  spatial::Box box;
  for (std::size_t k = 0; k < 3; ++k) {
    const double low = bounds[2 * k], high = bounds[2 * k + 1];
    box.centre[k] = 0.5 * (low + high);
    box.half[k] = 0.5 * (high - low) + kAxisRounding * (1 + std::fabs(low) + std::fabs(high));
  }
  return box;
}

void NearPairs::place(Group& group) const {
  group.boxes.clear();
  for (const std::uint32_t i : group.members) group.boxes.push_back(box_of(entries_[i].id));
}

void NearPairs::group() {
  still_ = {}, moving_ = {};
  for (std::size_t i = 0; i < entries_.size(); ++i)
    (dGeomGetBody(entries_[i].id) ? moving_ : still_)
        .members.push_back(static_cast<std::uint32_t>(i));
  place(still_);
  still_.tree = spatial::BoxTree(still_.boxes);
  still_.tree.refit(still_.boxes, still_.nodes);
  looked_ = looked_when_made_ = 0;
  is_grouped_ = true;
}

void NearPairs::see(std::uint32_t a, std::uint32_t b) {
  const Entry &x = entries_[a], &y = entries_[b];
  if (x.body != y.body && boxes_meet(x.id, y.id)) numbers_.emplace_back(std::minmax(a, b));
}

const std::vector<std::pair<dGeomID, dGeomID>>& NearPairs::find() {
  if (!is_grouped_) group();
  place(moving_);
  const bool is_new = looked_when_made_ == 0 || looked_ > 2 * looked_when_made_;
  if (is_new) moving_.tree = spatial::BoxTree(moving_.boxes);
  moving_.tree.refit(moving_.boxes, moving_.nodes);
  looked_ = 0;
  numbers_.clear();
  const auto touching = [this] { return ++looked_, 0.0; };
  for (std::size_t i = 0; i < moving_.members.size(); ++i) {
    const std::uint32_t own = moving_.members[i];
    if (!entries_[own].is_movable) continue;
    still_.tree.near(still_.nodes, moving_.boxes[i], touching,
                     [&](std::size_t k) { see(own, still_.members[k]); });
    moving_.tree.near(moving_.nodes, moving_.boxes[i], touching, [&](std::size_t k) {
      const std::uint32_t other = moving_.members[k];
      if (other > own || !entries_[other].is_movable) see(own, other);
    });
  }
  if (is_new) looked_when_made_ = looked_ + 1;
  std::sort(numbers_.begin(), numbers_.end());
  pairs_.clear();
  for (const auto& [a, b] : numbers_) pairs_.emplace_back(entries_[a].id, entries_[b].id);
  return pairs_;
}

}  // namespace robomosp::physics_ode
