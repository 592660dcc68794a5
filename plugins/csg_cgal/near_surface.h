// SPDX-License-Identifier: GPL-3.0-or-later
// The part of a solid near another one's surface as a surface of CGAL, cut along the other, and its
// joints with the rest (layer: plugin; CGAL).
#pragma once

#include <vector>

#include <CGAL/Surface_mesh.h>

#include "exact_corners.h"

namespace robomosp::csg_cgal {

using Surface = CGAL::Surface_mesh<Point>;

/// Cells are what a solid's surface consists of when it is cut: its triangles far from the other
/// solid, by their numbers, then the pieces of those near it. Corners are those of the solid, then
/// those that the cut made.
class NearSurface {
 public:
  static constexpr std::uint32_t kNone = ~0U, kWall = ~0U - 1;

  explicit NearSurface(const ExactSolid& solid)
      : solid_(&solid),
        neighbours_(&solid.neighbours()),
        number_(solid.mesh().triangles.size(), kNone) {}

  void take(std::uint32_t triangle) {
    if (number_[triangle] != kNone) return;
    number_[triangle] = static_cast<std::uint32_t>(near_.size());
    near_.push_back(triangle);
  }
  [[nodiscard]] bool has(std::uint32_t triangle) const { return number_[triangle] != kNone; }
  [[nodiscard]] bool empty() const { return near_.empty(); }

  /// All that was taken as a surface; corners at which it hangs together by no edge are there
  /// several times.
  void build();
  /// Each cuts its triangles along the other.
  static void cut(NearSurface& a, NearSurface& b, const Progress& progress);
  /// Numbers the pieces and joins them to the rest; false when they do not fit together.
  [[nodiscard]] bool finish();

  /// A side of pieces along the cut.
  struct Wall {
    std::uint32_t from, to;     ///< corners
    std::uint32_t left, right;  ///< cells; the left one runs from `from` to `to`
    std::array<Point, 2> ends;
    Point left_apex, right_apex;
    bool is_flat;  ///< both cells are pieces of one triangle
  };
  [[nodiscard]] const std::vector<Wall>& walls() const { return walls_; }

  [[nodiscard]] const ExactSolid& solid() const { return *solid_; }
  /// All cells, also the numbers of triangles that were taken.
  [[nodiscard]] std::uint32_t cell_count() const {
    return static_cast<std::uint32_t>(number_.size() + pieces_.size());
  }
  [[nodiscard]] bool is_cell(std::uint32_t cell) const {
    return cell >= number_.size() || number_[cell] == kNone;
  }
  [[nodiscard]] const Triangle& corners(std::uint32_t cell) const {
    return cell < number_.size() ? solid_->mesh().triangles[cell]
                                 : pieces_[cell - number_.size()].corners;
  }
  /// The cell beyond side k, or kWall.
  [[nodiscard]] std::uint32_t beyond(std::uint32_t cell, std::size_t k) const;
  [[nodiscard]] std::uint32_t patch(std::uint32_t cell) const {
    return solid_->mesh()
        .patch_of[cell < number_.size() ? cell : pieces_[cell - number_.size()].triangle];
  }
  [[nodiscard]] std::uint32_t corner_count() const {
    return static_cast<std::uint32_t>(solid_->mesh().points.size() + made_.size());
  }
  [[nodiscard]] bool is_made(std::uint32_t corner) const {
    return corner >= solid_->mesh().points.size();
  }
  /// Rounded.
  [[nodiscard]] const Vec3& point(std::uint32_t corner) const {
    return is_made(corner) ? made_rounded_[corner - solid_->mesh().points.size()]
                           : solid_->mesh().points[corner];
  }
  [[nodiscard]] Point exact(std::uint32_t corner) const {
    return is_made(corner) ? made_[corner - solid_->mesh().points.size()]
                           : solid_->impl().exact(corner);
  }
  [[nodiscard]] const std::vector<Point>& made() const { return made_; }
  [[nodiscard]] double made_slack() const { return made_slack_; }

 private:
  struct Piece {
    std::uint32_t triangle;  ///< it was cut from
    Triangle corners, beyond{kNone, kNone, kNone};
  };
  void name_corners();
  bool join(std::uint32_t piece, std::size_t side, Surface::Halfedge_index h,
            const std::vector<std::uint32_t>& piece_of);

  const ExactSolid* solid_;
  const std::vector<Triangle>* neighbours_;
  std::vector<std::uint32_t> number_, near_;  ///< of triangles among those taken, and back
  Surface surface_;
  std::vector<std::uint32_t> corner_of_;  ///< by surface_'s vertex
  std::vector<Point> made_;
  std::vector<Vec3> made_rounded_;
  double made_slack_ = 0;
  std::vector<Piece> pieces_;
  /// Pieces beyond sides of far triangles: 3 triangle + side, sorted.
  std::vector<std::pair<std::uint64_t, std::uint32_t>> shore_;
  std::vector<Wall> walls_;
};

}  // namespace robomosp::csg_cgal
