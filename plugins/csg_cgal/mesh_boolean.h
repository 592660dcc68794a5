// SPDX-License-Identifier: GPL-3.0-or-later
// Solids bounded by triangles with exact corners, and boolean operations on them by CGAL's
// corefinement (layer: plugin). All of CGAL is behind this header and triangulate.h.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "patch_mesh.h"

namespace robomosp::csg_cgal {

/// Immutable; of any number of separate pieces, or empty. [any thread]
class ExactSolid {
 public:
  struct Impl;
  explicit ExactSolid(std::shared_ptr<const Impl> impl);

  /// A closed mesh, oriented outwards, its corners on the grid.
  static ExactSolid from(PatchMesh mesh);
  /// Exactly moved; `instance` tells the ids of the copies of one solid apart (0 = keep them).
  [[nodiscard]] ExactSolid moved(const Affine& motion, std::uint64_t instance) const;
  /// Rounded to double.
  [[nodiscard]] const PatchMesh& mesh() const;
  [[nodiscard]] const Box3& box() const;
  [[nodiscard]] double volume() const;
  [[nodiscard]] bool empty() const;
  [[nodiscard]] const Impl& impl() const { return *impl_; }

 private:
  std::shared_ptr<const Impl> impl_;
};

struct BooleanOutcome {
  ExactSolid solid;
  std::string remedy;  ///< what had to be done to get a closed result; empty = nothing
};

/// All solids together. Throws Cancelled.
Result<BooleanOutcome> unite(std::vector<ExactSolid> solids, Progress& progress);
/// The solid minus all tools. Throws Cancelled.
Result<BooleanOutcome> subtract(const ExactSolid& solid, std::vector<ExactSolid> tools,
                                Progress& progress);
/// What all share. Throws Cancelled.
Result<BooleanOutcome> intersect(std::vector<ExactSolid> solids, Progress& progress);

/// Turns the separate pieces of a closed mesh so that they bound a volume; false when the surface
/// cuts itself, with two triangles that do in `witness`.
bool orient_outwards(PatchMesh& mesh, std::array<std::uint32_t, 2>& witness);

}  // namespace robomosp::csg_cgal
