// SPDX-License-Identifier: Apache-2.0
// Spheres and simple shapes around the pieces of a body, for checks that only have to separate near
// from far (layer: application, collision).
#pragma once

#include <span>
#include <vector>

#include "collision/search_kernel.h"
#include "evaluation/shapes.h"
#include "spatial/box.h"

namespace robomosp::collision {

/// Two covers of a body, in its frame: spheres, used when it moves, and boxes and cylinders, used
/// when it is at rest.
struct BodyCover {
  std::vector<SearchSphere> spheres;
  bool are_exact = true;  ///< the spheres are the body; else they contain it
  struct Still {
    SearchShape shape;     ///< R and p: body_T_shape
    bool is_exact = true;  ///< the shape is a piece of the body; else it contains one
  };
  std::vector<Still> shapes;
};

[[nodiscard]] BodyCover cover_of(std::span<const evaluation::ShapePiece> pieces);

/// The smallest box along the axes of a piece's frame.
[[nodiscard]] spatial::Box box_in_piece(const evaluation::ShapePiece&);

/// A sphere around spheres, centred in the box around them.
[[nodiscard]] SearchSphere sphere_around(std::span<const SearchSphere> spheres);

}  // namespace robomosp::collision
