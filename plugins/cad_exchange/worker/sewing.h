// SPDX-License-Identifier: Apache-2.0
// Loose faces to solids (layer: plugin). Lengths are millimetres.
#pragma once

#include <cstddef>
#include <vector>

#include <TopoDS_Face.hxx>
#include <TopoDS_Shape.hxx>
#include <TopoDS_Solid.hxx>

namespace robomosp::cad_exchange {

struct Sewn {
  std::vector<TopoDS_Solid> solids;  ///< outwards, with their cavities
  std::vector<TopoDS_Face> open;     ///< faces of nothing that closes, as they were given
  double gap = 0;                    ///< the widest tolerance used
  std::size_t joined = 0;            ///< faces of the solids
  std::size_t cavities = 0;          ///< closed shells that became cavities of others
};

/// Joins faces to solids by what they share, with the least tolerance that closes each. Bodies that
/// touch come apart where the faces of each come one after the other, as files write them; a closed
/// shell inside another is its cavity, one inside that a solid again.
[[nodiscard]] Sewn sew(const std::vector<TopoDS_Face>& faces);

/// The same for all faces of a shape that belong to no solid, the innermost groups first: what does
/// not close within its group is joined with that of the groups around it.
[[nodiscard]] Sewn sew_groups(const TopoDS_Shape& shape);

/// Sum of the areas [mm^2].
[[nodiscard]] double area_of(const std::vector<TopoDS_Face>& faces);

}  // namespace robomosp::cad_exchange
