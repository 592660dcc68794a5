// SPDX-License-Identifier: GPL-3.0-or-later
// What the corners of an ExactSolid are made of (layer: plugin; CGAL's kernel).
#pragma once

#include <mutex>
#include <optional>

#include <CGAL/Exact_predicates_exact_constructions_kernel.h>

#include "box_tree.h"
#include "exact_solid.h"

namespace robomosp::csg_cgal {

using Kernel = CGAL::Exact_predicates_exact_constructions_kernel;
using Point = Kernel::Point_3;

/// Where corners come from that are no doubles: plain corners or points made by an operation, then
/// moved, one motion after the other.
struct CornerSource {
  std::shared_ptr<const std::vector<Vec3>> plain;  ///< or
  std::shared_ptr<const std::vector<Point>> made;
  std::vector<Affine> motions;
};
struct CornerName {
  static constexpr std::uint32_t kPlain = ~0U;
  std::uint32_t source = kPlain;  ///< kPlain: the rounded corner is the exact one
  std::uint32_t index = 0;
};

/// Corners are exact without being numbers of CGAL until an operation asks for one: of a big solid
/// it asks for those near what it is cut by.
struct ExactSolid::Impl {
  PatchMesh mesh;                 ///< rounded
  std::vector<CornerName> names;  ///< one a corner, or none when all are plain
  std::vector<CornerSource> sources;
  double slack = 0;  ///< rounded coordinates are within this of exact ones [m]
  Box3 box;
  double volume = 0;

  /// Fills box and volume.
  void measure();
  [[nodiscard]] bool is_plain(std::uint32_t corner) const {
    return names.empty() || names[corner].source == CornerName::kPlain;
  }
  [[nodiscard]] Point exact(std::uint32_t corner) const;

  mutable std::once_flag neighbours_once, tree_once;
  mutable std::vector<Triangle> neighbours;
  mutable BoxTree tree;
  struct Copy {
    Affine motion;
    std::uint64_t instance;
    std::shared_ptr<const Impl> impl;
  };
  mutable std::mutex copy_mutex;
  mutable std::optional<Copy> copy;  ///< guarded by copy_mutex
};

inline Point exact_point(const Vec3& p) { return {p[0], p[1], p[2]}; }
/// To doubles beside the exact coordinates; `slack` grows to how far they may be off [m].
Vec3 rounded(const Point& p, double& slack);

}  // namespace robomosp::csg_cgal
