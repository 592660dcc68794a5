// SPDX-License-Identifier: Apache-2.0
#include "evaluation/shapes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <string_view>
#include <utility>

#include <robomosp/sdk/csg_scale.h>

#include "evaluation/csg_tree.h"
#include "evaluation/round_meshes.h"
#include "geometry/mesh_mass.h"
#include "spatial/convex_hull.h"
#include "spatial/pose.h"
#include "spatial/vec.h"

namespace robomosp::evaluation {
namespace {

constexpr std::size_t kMostPieces = 256;  ///< of one solid; more are one mesh
constexpr double kShallow = 5e-4;         ///< depth of dents of triangles, of the extent

/// A union or pattern, whose pieces can stand alone.
bool is_sum(CsgKind k) {
  return k == CsgKind::union_ || k == CsgKind::linear_pattern || k == CsgKind::circular_pattern;
}

Mesh mesh_of_hull(const spatial::Hull& hull) {
  Mesh m;
  for (const Vec3& p : hull.points) {
    const Vec3 out = spatial::unit(spatial::sub(p, hull.middle));
    for (std::size_t k = 0; k < 3; ++k) {
      m.positions.push_back(static_cast<float>(p[k]));
      m.normals.push_back(static_cast<float>(out[k]));
    }
  }
  for (const auto& t : hull.triangles) m.triangles.insert(m.triangles.end(), t.begin(), t.end());
  return m;
}

/// The hull, where the mesh has its volume.
std::optional<spatial::Hull> convex_form(const Mesh& mesh) {
  const auto points = spatial::vertices(mesh);
  const auto moments = geometry::moments(mesh);
  if (!moments.ok()) return std::nullopt;
  auto hull = spatial::convex_hull(points);
  if (!hull) return std::nullopt;
  double extent = 0;
  for (const Vec3& p : hull->points)
    extent = std::max(extent, 2 * spatial::distance(p, hull->middle));
  // Round surfaces are triangles with dents that the hull has not; they are shallow everywhere,
  // the walls of the smallest hole are not.
  const double shallow = kShallow * extent;
  if (hull->volume > moments->volume + shallow * moments->area) return std::nullopt;
  std::vector<std::pair<Vec3, double>> planes;
  for (const auto& t : hull->triangles) {
    const Vec3 n =
        spatial::unit(spatial::cross(spatial::sub(hull->points[t[1]], hull->points[t[0]]),
                                     spatial::sub(hull->points[t[2]], hull->points[t[0]])));
    planes.emplace_back(n, spatial::dot(n, hull->points[t[0]]));
  }
  for (std::size_t i = 0; i + 2 < mesh.triangles.size(); i += 3) {
    const Vec3 middle = spatial::scale(
        spatial::add(points[mesh.triangles[i]],
                     spatial::add(points[mesh.triangles[i + 1]], points[mesh.triangles[i + 2]])),
        1.0 / 3);
    if (std::none_of(planes.begin(), planes.end(), [&](const auto& plane) {
          return plane.second - spatial::dot(plane.first, middle) <= shallow;
        }))
      return std::nullopt;
  }
  return hull;
}

/// Moves the hull's points that are exact corners in single precision to those.
void make_exact(spatial::Hull& hull, const std::vector<Vec3>& corners) {
  double greatest = 0;
  for (const Vec3& p : hull.points)
    for (const double x : p) greatest = std::max(greatest, std::fabs(x));
  const double rounding = 4.0 * std::numeric_limits<float>::epsilon() * greatest;
  for (Vec3& p : hull.points) {
    double least = rounding;
    const Vec3* nearest = nullptr;
    for (const Vec3& c : corners)
      if (const double d = spatial::distance(p, c); d <= least) least = d, nearest = &c;
    if (nearest) p = *nearest;
  }
}

/// The hull of regular polygons on the ends of a cone; false where it has no extent.
bool make_cone(ShapePiece& piece, const Vec3& sizes) {
  constexpr double kChord = 2e-4;  // [m]
  const double radius = std::max(sizes[0], sizes[1]);
  const int sides =
      static_cast<int>(std::clamp(std::numbers::pi / std::sqrt(2 * kChord / radius), 16.0, 96.0));
  std::vector<Vec3> points;
  for (const auto& [r, z] : {std::pair{sizes[0], -sizes[2] / 2}, std::pair{sizes[1], sizes[2] / 2}})
    for (int i = 0; i < (r > 0 ? sides : 1); ++i) {
      const double angle = 2 * std::numbers::pi * i / sides;
      points.push_back({r * std::cos(angle), r * std::sin(angle), z});
    }
  auto hull = spatial::convex_hull(points);
  if (!hull) return false;
  piece.kind = ShapeKind::convex;
  piece.cone = sizes;
  RoundOutside outside;
  if (sizes[0] > 0) outside.profile.push_back({sizes[0], -sizes[2] / 2});
  if (sizes[1] > 0) outside.profile.push_back({sizes[1], sizes[2] / 2});
  piece.outside = std::make_shared<const RoundOutside>(std::move(outside));
  piece.mesh = std::make_shared<const Mesh>(mesh_of_hull(*hull));
  piece.corners = std::make_shared<const std::vector<Vec3>>(std::move(hull->points));
  return true;
}

/// The hull of points on an ellipsoid, pushed out so that its faces lie about as far within as its
/// corners lie beyond; false where it has no extent.
bool make_ellipsoid(ShapePiece& piece, const Vec3& half) {
  constexpr int kRows = 16, kAround = 32;
  const double step = std::numbers::pi / kRows;
  // In the middle of a square of the grid a face is by the sagitta of half its diagonal within.
  const double out = 2 / (1 + std::cos(step / std::numbers::sqrt2));
  std::vector<Vec3> points;
  for (int r = 0; r <= kRows; ++r)
    for (int k = 0; k < (r % kRows == 0 ? 1 : kAround); ++k) {
      const double t = step * r, f = 2 * std::numbers::pi * k / kAround;
      points.push_back({out * half[0] * std::sin(t) * std::cos(f),
                        out * half[1] * std::sin(t) * std::sin(f), out * half[2] * std::cos(t)});
    }
  auto hull = spatial::convex_hull(points);
  if (!hull) return false;
  piece.kind = ShapeKind::convex;
  piece.ellipsoid = half;
  piece.mesh = std::make_shared<const Mesh>(mesh_of_hull(*hull));
  piece.corners = std::make_shared<const std::vector<Vec3>>(std::move(hull->points));
  return true;
}

// ---- round outsides ----

/// A solid of revolution about its z axis.
bool is_turned(const CsgNode& n) {
  switch (n.kind) {
    case CsgKind::cylinder:
    case CsgKind::cone:
    case CsgKind::torus: return true;
    case CsgKind::revolution: return n.sizes[0] >= kCsgFullTurn - 1e-9;
    default: return false;
  }
}
/// Turns about z and shifts along it only.
bool keeps_axis(const Pose& p) {
  constexpr double kOff = 1e-12;
  return std::fabs(p.p[0]) <= kOff && std::fabs(p.p[1]) <= kOff && std::fabs(p.R[2]) <= kOff &&
         std::fabs(p.R[5]) <= kOff && p.R[8] > 0;
}
/// Whether all below a node is made of solids of revolution about the node's z axis.
bool is_all_turned(const CsgTree& tree, std::size_t top) {
  for (std::size_t i = top + 1; i < tree.nodes.size() && tree.nodes[i].parent >= 0; ++i) {
    if (tree.nodes[i].parent < static_cast<std::int32_t>(top)) break;
    const CsgNode& n = tree.nodes[i];
    if (!keeps_axis(n.placement)) return false;
    const bool joins = n.kind == CsgKind::difference || n.kind == CsgKind::union_;
    if (!joins && n.kind != CsgKind::sphere && !is_turned(n)) return false;
  }
  return true;
}

/// What a solid is from outside, in the frame of its root, where it comes from a solid of
/// revolution from which tools are taken; nullptr elsewhere. `mesh` is of the whole.
std::shared_ptr<const RoundOutside> round_outside(const CsgTree& tree, const Mesh& mesh) {
  RoundOutside out;
  std::size_t at = 0;
  while (tree.nodes[at].kind == CsgKind::difference) {
    const auto children = children_of(tree, at);
    if (children.empty()) return nullptr;
    at = children.front();
    out.pose = spatial::compose(out.pose, tree.nodes[at].placement);
  }
  const CsgNode& n = tree.nodes[at];
  const bool is_rounded =
      (n.kind == CsgKind::fillet || n.kind == CsgKind::chamfer) && is_all_turned(tree, at);
  if (n.kind == CsgKind::sphere) {
    out.sphere = n.sizes[0];
  } else if (n.kind == CsgKind::cylinder && n.sizes[2] == 0) {
    out.profile = {{n.sizes[0], 0}, {n.sizes[0], n.sizes[1]}};
  } else if (n.kind == CsgKind::cone) {
    if (n.sizes[0] > 0) out.profile.push_back({n.sizes[0], 0});
    if (n.sizes[1] > 0) out.profile.push_back({n.sizes[1], n.sizes[2]});
  } else if (is_turned(n) || is_rounded) {
    out.profile = turned_profile(spatial::vertices(mesh), out.pose);
  }
  if (!(out.sphere > 0) && out.profile.empty()) return nullptr;
  return std::make_shared<const RoundOutside>(std::move(out));
}

/// Whether a solid is an imported one, of which tools may be taken and which may be scaled evenly.
bool is_imported(const CsgTree& tree) {
  std::size_t at = 0;
  while (tree.nodes[at].kind == CsgKind::difference || tree.nodes[at].kind == CsgKind::scale) {
    const auto children = children_of(tree, at);
    if (children.empty()) return false;
    at = children.front();
  }
  return tree.nodes[at].kind == CsgKind::imported;
}

class Factory {
 public:
  Factory(const CsgTree& whole, const MeshOf& mesh_of, const CornersOf& corners_of)
      : whole_(whole),
        mesh_of_(mesh_of),
        corners_of_(corners_of),
        pieces_expected_(count(whole, 0)) {}

  Result<std::vector<ShapePiece>> run() {
    RMP_TRY(add());
    return std::move(pieces_);
  }

 private:
  /// Number of pieces that a tree would be divided into, about.
  static std::size_t count(const CsgTree& tree, std::size_t top) {
    const CsgNode& n = tree.nodes[top];
    if (n.kind == CsgKind::difference) {
      const auto children = children_of(tree, top);
      return children.empty() ? 1 : count(tree, children.front());
    }
    if (!is_sum(n.kind)) return 1;
    std::size_t sum = 0;
    for (const std::size_t c : children_of(tree, top)) sum += count(tree, c);
    if (n.kind != CsgKind::union_)
      sum = static_cast<std::size_t>(
          std::min(1e6, static_cast<double>(sum) * std::max(1.0, n.sizes[0])));
    return sum;
  }

  struct Job {
    CsgTree tree;
    Pose pose;  ///< body_T_root-frame's parent
  };

  Result<void> add() {
    std::vector<Job> jobs{{whole_, {}}};
    while (!jobs.empty()) {
      const Job job = std::move(jobs.back());
      jobs.pop_back();
      const CsgNode& root = job.tree.nodes.front();
      const Pose body_T_node = spatial::compose(job.pose, root.placement);
      if (primitive(root, body_T_node)) continue;
      if (root.kind == CsgKind::scale && job.tree.nodes.size() == 2)
        if (const auto made =
                scaled_primitive(job.tree.nodes[1], {root.sizes[0], root.sizes[1], root.sizes[2]}))
          if (primitive(*made, spatial::compose(body_T_node, made->placement))) continue;
      if (count(job.tree, 0) > kMostPieces || !divide(job, body_T_node, jobs))
        RMP_TRY(from_mesh(job));
    }
    return {};
  }

  bool primitive(const CsgNode& n, const Pose& at) {
    ShapePiece p;
    Vec3 up{};
    if (n.kind == CsgKind::box && n.sizes[3] == 0) {
      p.kind = ShapeKind::box;
      p.sizes = {n.sizes[0], n.sizes[1], n.sizes[2]};
      up[2] = n.sizes[2] / 2;
    } else if (n.kind == CsgKind::cylinder && n.sizes[2] == 0) {
      p.kind = ShapeKind::cylinder;
      p.sizes = {n.sizes[0], n.sizes[1], 0};
      up[2] = n.sizes[1] / 2;
    } else if (n.kind == CsgKind::cone) {
      if (!make_cone(p, {n.sizes[0], n.sizes[1], n.sizes[2]})) return false;
      up[2] = n.sizes[2] / 2;
    } else if (n.kind == CsgKind::sphere) {
      p.kind = ShapeKind::sphere;
      p.sizes = {n.sizes[0], 0, 0};
    } else if (n.kind == CsgKind::ellipsoid) {
      if (!make_ellipsoid(p, {n.sizes[0], n.sizes[1], n.sizes[2]})) return false;
    } else {
      return false;
    }
    p.pose = spatial::compose(at, spatial::translation(up));
    pieces_.push_back(std::move(p));
    return true;
  }

  /// Puts the parts of a sum, or of a sum with tools taken from it, on the list; last first, so
  /// that pieces come in the order of the tree.
  static bool divide(const Job& job, const Pose& body_T_node, std::vector<Job>& jobs) {
    const CsgNode& root = job.tree.nodes.front();
    const auto children = children_of(job.tree, 0);
    if (children.empty()) return false;
    std::vector<Job> parts;
    if (is_sum(root.kind)) {
      for (const std::size_t c : children) {
        CsgTree child = branch_of(job.tree, c).tree;
        child.nodes.front().placement = job.tree.nodes[c].placement;
        for (const Pose& copy : copies(root))
          parts.push_back({child, spatial::compose(body_T_node, copy)});
      }
    } else if (root.kind == CsgKind::difference && is_sum(job.tree.nodes[children[0]].kind)) {
      const CsgNode& sum = job.tree.nodes[children[0]];
      for (const std::size_t c : children_of(job.tree, children[0])) {
        for (const Pose& copy : copies(sum)) {
          CsgTree one;
          one.nodes.push_back(root);
          append(
              one, job.tree, c,
              spatial::compose(spatial::compose(sum.placement, copy), job.tree.nodes[c].placement));
          for (std::size_t k = 1; k < children.size(); ++k)
            append(one, job.tree, children[k], job.tree.nodes[children[k]].placement);
          parts.push_back({std::move(one), job.pose});
        }
      }
    }
    if (parts.empty()) return false;
    for (auto p = parts.rbegin(); p != parts.rend(); ++p) jobs.push_back(std::move(*p));
    return true;
  }

  /// Adds a branch below the root.
  static void append(CsgTree& to, const CsgTree& from, std::size_t top, const Pose& placement) {
    CsgTree branch = branch_of(from, top).tree;
    const auto offset = static_cast<std::int32_t>(to.nodes.size());
    for (std::size_t i = 0; i < branch.nodes.size(); ++i) {
      CsgNode& n = branch.nodes[i];
      n.parent = i == 0 ? 0 : n.parent + offset;
      if (i == 0) n.placement = placement;
      to.nodes.push_back(std::move(n));
    }
  }

  /// Where the copies of a sum's children stand, in its frame.
  static std::vector<Pose> copies(const CsgNode& n) {
    if (n.kind == CsgKind::union_) return {Pose{}};
    std::vector<Pose> out;
    const auto count = static_cast<int>(n.sizes[0]);
    for (int i = 0; i < count; ++i) {
      if (n.kind == CsgKind::linear_pattern) {
        out.push_back(spatial::translation(
            spatial::scale(Vec3{n.sizes[1], n.sizes[2], n.sizes[3]}, static_cast<double>(i))));
        continue;
      }
      // A full turn has equal gaps all round, a smaller angle copies at both ends.
      const bool is_full = std::fabs(n.sizes[1]) >= 2 * std::numbers::pi - 1e-9;
      const int gaps = is_full ? count : std::max(1, count - 1);
      out.push_back(spatial::rotation_z(n.sizes[1] * i / gaps));
    }
    return out;
  }

  Result<void> from_mesh(const Job& job) {
    CsgTree tree = job.tree;
    const Pose at = spatial::compose(job.pose, tree.nodes.front().placement);
    tree.nodes.front().placement = {};  // so that copies share one mesh
    auto mesh = mesh_of_(tree);
    if (!mesh.ok()) {
      // Tools may leave nothing of a part of a whole that is sound.
      if (pieces_expected_ > 1 && mesh.error().code == ErrorCode::invalid_argument &&
          mesh_of_(whole_).ok())
        return {};
      return std::move(mesh).error();
    }
    ShapePiece p;
    p.pose = at;
    p.outside = round_outside(tree, **mesh);
    if (!p.outside && is_imported(tree)) {
      MeshRoundness found = mesh_roundness(**mesh);
      p.outside = std::move(found.outside);
      p.sides = found.sides;
    }
    if (auto convex = convex_form(**mesh)) {
      auto corners = corners_of_(tree);
      if (corners.ok()) make_exact(*convex, *corners);
      else if (corners.error().code == ErrorCode::cancelled) return std::move(corners).error();
      p.kind = ShapeKind::convex;
      p.mesh = std::make_shared<const Mesh>(mesh_of_hull(*convex));
      p.corners = std::make_shared<const std::vector<Vec3>>(std::move(convex->points));
    } else {
      p.mesh = *mesh;
    }
    pieces_.push_back(std::move(p));
    return {};
  }

  const CsgTree& whole_;
  const MeshOf& mesh_of_;
  const CornersOf& corners_of_;
  std::size_t pieces_expected_;
  std::vector<ShapePiece> pieces_;
};

}  // namespace

std::vector<Vec3> ShapePiece::points() const {
  if (corners) return *corners;
  return mesh ? spatial::vertices(*mesh) : std::vector<Vec3>{};
}

TakenShapes taken_shapes(std::span<const std::string> tags) {
  const auto has = [&](std::string_view tag) {
    return std::find(tags.begin(), tags.end(), tag) != tags.end();
  };
  return {has("cones"), has("ellipsoids")};
}

Result<std::vector<ShapePiece>> shape_pieces(const CsgTree& tree, const MeshOf& mesh_of,
                                             const CornersOf& corners_of) {
  return Factory(tree, mesh_of, corners_of).run();
}

}  // namespace robomosp::evaluation
