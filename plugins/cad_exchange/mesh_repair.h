// SPDX-License-Identifier: Apache-2.0
// Builds a closed, outward-oriented surface from loose triangles of files (layer: plugin, std
// only).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace robomosp::cad_exchange {

/// The changes made, for the report.
struct MeshRepair {
  std::size_t welded = 0;           ///< vertices merged within the tolerance, not exactly
  std::size_t degenerate = 0;       ///< triangles without area, left out
  std::size_t doubled = 0;          ///< duplicate triangles, left out
  std::size_t turned = 0;           ///< triangles oriented opposite to their neighbours
  std::size_t holes = 0;            ///< holes filled
  double widest_hole = 0;           ///< greatest extent of one [m]
  bool inside_out = false;          ///< all triangles were flipped
  std::size_t open_edges = 0;       ///< left open: repair not requested, or it failed
  std::array<double, 3> open_at{};  ///< the centre of one of them [m]
  std::string failure;              ///< why a repair was reverted; "" = it was not
  double volume = 0;                ///< signed volume of the result [m^3]

  /// Sentences about the changes; empty if there are none.
  [[nodiscard]] std::vector<std::string> notes(const std::string& name) const;
};

/// Merges coincident vertices, drops triangles without area, and, if `heal`, merges vertices that
/// nearly coincide, flips triangles, fills holes and orients the surface outwards. Indices must be
/// in range. The result of healing is checked: if it encloses no volume, or a filling cuts the
/// surface, the mesh is left unchanged, with the reason in `failure`.
MeshRepair repair(std::vector<double>& points, std::vector<std::uint32_t>& triangles, bool heal);

}  // namespace robomosp::cad_exchange
