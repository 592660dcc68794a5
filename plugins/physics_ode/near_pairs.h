// SPDX-License-Identifier: Apache-2.0
// Finds pairs of nearby geometries among many (layer: plugin). The engine's own spaces need
// quadratic time and memory: its hash table keeps a bit for every pair, cleared in every step, and
// maps a lattice of bodies to few of its entries.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <ode/ode.h>

#include "spatial/box.h"
#include "spatial/box_tree.h"

namespace robomosp::physics_ode {

/// Geometries in two trees of boxes: static ones, in a tree built once, and those with a body, in a
/// tree with boxes that follow it. That tree is rebuilt when neighbours in it have moved so far
/// apart that a search takes twice as long. Pairs depend on the geometries alone, not on the trees.
class NearPairs {
 public:
  /// Adds a geometry, in the order of the pairs. `body`: number of its body.
  void add(dGeomID geometry, std::int32_t body, bool is_movable);
  /// Call it after a static geometry got a body, or was moved.
  void regroup() { is_grouped_ = false; }

  /// All pairs of different bodies with intersecting boxes, at least one of them movable, in
  /// ascending order of the two, first < second. Valid until the next call.
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
  std::size_t looked_ = 0, looked_when_made_ = 0;  ///< nodes visited in one find()
  std::vector<std::pair<std::uint32_t, std::uint32_t>> numbers_;
  std::vector<std::pair<dGeomID, dGeomID>> pairs_;
};

}  // namespace robomosp::physics_ode
