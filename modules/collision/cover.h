// SPDX-License-Identifier: Apache-2.0
// Spheres and plain shapes around the pieces of a body, for checks that only have to tell near from
// far (layer: application, collision).
#pragma once

#include <span>
#include <vector>

#include "collision/search_kernel.h"
#include "evaluation/shapes.h"
#include "spatial/box.h"

namespace robomosp::collision {

/// A body twice: as spheres, for when it moves, and as boxes and cylinders, for when it is at rest.
/// In the body's frame.
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

/// A sphere around spheres, about the middle of the box around them.
[[nodiscard]] SearchSphere sphere_around(std::span<const SearchSphere> spheres);

}  // namespace robomosp::collision
