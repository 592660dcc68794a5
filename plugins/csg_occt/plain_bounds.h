// SPDX-License-Identifier: Apache-2.0
// Tight boxes of solids that are made of planes, cylinders and cones with straight and circular
// edges, from the edges alone; copies of one solid are measured once (layer: plugin).
#pragma once

#include <array>
#include <unordered_map>

#include "occt_support.h"

#include <Bnd_Box.hxx>

namespace robomosp::csg_occt {

class PlainBounds {
 public:
  /// Widens the box by the solid at the pose [mm]. False, and nothing done, for other solids.
  bool widen(Bnd_Box& box, const TopoDS_Shape& solid, const gp_Trsf& pose);

 private:
  struct Extent {
    bool is_plain = false;
    std::array<double, 3> low{}, high{};
  };
  std::unordered_map<Key, Extent, KeyHash> known_;  // by solid and rotation
};

}  // namespace robomosp::csg_occt
