// SPDX-License-Identifier: GPL-3.0-or-later
// Solids bounded by triangles with exact corners (layer: plugin). Free of CGAL: the representation
// of exact corners is in exact_corners.h.
#pragma once

#include <memory>

#include "patch_mesh.h"

namespace robomosp::csg_cgal {

class BoxTree;

/// Immutable; of any number of separate pieces, or empty. [any thread]
class ExactSolid {
 public:
  struct Impl;
  explicit ExactSolid(std::shared_ptr<const Impl> impl);

  /// A closed mesh, oriented outwards, its corners on the grid.
  static ExactSolid from(PatchMesh mesh);
  /// With its neighbours_of() and tree if known.
  static ExactSolid from(PatchMesh mesh, std::vector<Triangle> neighbours, BoxTree tree);
  /// An exactly moved copy; `instance` distinguishes the ids of the copies of one solid (0 = keep
  /// them). The last copy is cached with its derived data, since a drag moves one of many solids.
  [[nodiscard]] ExactSolid moved(const Affine& motion, std::uint64_t instance) const;
  /// Rounded to double.
  [[nodiscard]] const PatchMesh& mesh() const;
  /// For each side k of each triangle, from its corner k on, the triangle beyond.
  [[nodiscard]] const std::vector<Triangle>& neighbours() const;
  [[nodiscard]] const BoxTree& tree() const;
  [[nodiscard]] const Box3& box() const;
  [[nodiscard]] double volume() const;
  [[nodiscard]] bool empty() const;
  [[nodiscard]] const Impl& impl() const { return *impl_; }

 private:
  std::shared_ptr<const Impl> impl_;
};

}  // namespace robomosp::csg_cgal
