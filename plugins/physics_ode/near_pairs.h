// SPDX-License-Identifier: Apache-2.0
// Which geometries of many are near each other (layer: plugin). The engine's own spaces take time
// and memory by the square of their number: its table of cells keeps a bit for every pair, which is
// cleared in every step, and sends a lattice of bodies to few of its entries.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <ode/ode.h>

#include "spatial/box.h"
#include "spatial/box_tree.h"

namespace robomosp::physics_ode {

/// Geometries in two trees of boxes: of those that stand still, made once, and of those that have a
/// body, whose boxes follow it. That tree is made anew when what stands together in it has moved so
/// far apart that looking takes twice as long. Pairs depend on the geometries alone, not on the
/// trees.
class NearPairs {
 public:
  /// A geometry, in the order of the pairs. `body`: number of the body it is of.
  void add(dGeomID geometry, std::int32_t body, bool is_movable);
  /// What stood still has got a body, or was placed elsewhere.
  void regroup() { is_grouped_ = false; }

  /// All pairs of different bodies whose boxes meet and of which one can move, in ascending order
  /// of the two, first < second. Valid until the next call.
  [[nodiscard]] const std::vector<std::pair<dGeomID, dGeomID>>& find();

 private:
  struct Entry {
    dGeomID id;
    std::int32_t body;
    bool is_movable;
  };
  struct Group {
    std::vector<std::uint32_t> members;  ///< ascending
    std::vector<spatial::Box> boxes, nodes;
    spatial::BoxTree tree;
  };
  void group();
  static spatial::Box box_of(dGeomID geometry);
  void place(Group& group) const;
  void see(std::uint32_t a, std::uint32_t b);

  std::vector<Entry> entries_;
  bool is_grouped_ = false;
  Group still_, moving_;
  std::size_t looked_ = 0, looked_when_made_ = 0;  ///< nodes, in one find()
  std::vector<std::pair<std::uint32_t, std::uint32_t>> numbers_;
  std::vector<std::pair<dGeomID, dGeomID>> pairs_;
};

}  // namespace robomosp::physics_ode
