// SPDX-License-Identifier: Apache-2.0
// Makes a closed, outward surface of loose triangles as files hold them (layer: plugin, std only).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace robomosp::cad_exchange {

/// What was done, for the report.
struct MeshRepair {
  std::size_t welded = 0;           ///< vertices that were joined within the tolerance, not exactly
  std::size_t degenerate = 0;       ///< triangles without area, left out
  std::size_t doubled = 0;          ///< triangles that stood twice, left out
  std::size_t turned = 0;           ///< triangles that faced the other way than their neighbours
  std::size_t holes = 0;            ///< holes that were filled
  double widest_hole = 0;           ///< greatest extent of one [m]
  bool inside_out = false;          ///< everything was turned over
  std::size_t open_edges = 0;       ///< left open: not told to repair, or it failed
  std::array<double, 3> open_at{};  ///< the middle of one of them [m]
  std::string failure;              ///< why a repair was taken back; "" = it was not
  double volume = 0;                ///< of the result, as it faces [m^3]

  /// Sentences about it; empty when nothing was done.
  [[nodiscard]] std::vector<std::string> notes(const std::string& name) const;
};

/// Joins vertices at one place, drops triangles without area, and, if `heal`, joins vertices that
/// nearly meet, turns triangles, fills holes and orients the whole outwards. Indices must be in
/// range. What was healed is looked at again: where it encloses nothing, or a filling cuts the
/// surface, the mesh stays as it was, with the reason in `failure`.
MeshRepair repair(std::vector<double>& points, std::vector<std::uint32_t>& triangles, bool heal);

}  // namespace robomosp::cad_exchange
