// SPDX-License-Identifier: Apache-2.0
// Checks a CsgTree and brings it into the form that is cheapest to evaluate: chains of differences
// become one n-ary cut, nested unions and intersections merge, patterns become unions, mirror
// images of symmetric primitives those primitives elsewhere; every term gets a content key (layer:
// plugin).
#pragma once

#include "occt_support.h"

namespace robomosp::csg_occt {

struct Item {
  std::size_t term = 0;
  gp_Trsf pose;  ///< term's frame in the frame of the term that uses it [mm]
};

/// A primitive, an n-ary operation on items, or a modifier of one. For a difference, items[0] is
/// what is cut.
struct Term {
  CsgKind kind = CsgKind::box;
  std::size_t node = 0;           ///< the node of the user's tree to name in messages
  std::array<double, 6> sizes{};  ///< [m]
  std::vector<Item> items;
  Key key{};  ///< of the content without its own placement
  Key own{};  ///< of the content without the items
  /// Not by the shortcut for prisms: OCCT's fillets fail on the faces that makes.
  bool general = false;
};

struct Plan {
  std::vector<Term> terms;  ///< items come before the terms that use them
  Item root;
};

/// Never recurses: the depth of the tree costs no stack.
Result<Plan> make_plan(const CsgTree& tree, Progress& progress);

}  // namespace robomosp::csg_occt
