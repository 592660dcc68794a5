// SPDX-License-Identifier: GPL-3.0-or-later
#include "engine.h"

#include <cmath>

namespace robomosp::csg_cgal {
namespace {

/// Finer meshes [m] and angles [rad] than these are mistakes.
constexpr double kFinestChord = 1e-9, kFinestAngle = 1e-4;

Result<const MeshShape*> own_shape(const CsgShape* shape) {
  if (const auto* own = dynamic_cast<const MeshShape*>(shape)) return own;
  return error(ErrorCode::invalid_argument,
               shape ? "the shape was made by another engine" : "there is no shape",
               "Evaluate its tree with the engine \"cgal\".");
}

Error bad_placement(std::string where) {
  return error(ErrorCode::invalid_argument,
               "placement is not a rigid motion; its rotation must be orthonormal with "
               "determinant +1 and all its numbers finite",
               {}, std::move(where));
}

}  // namespace

Result<std::shared_ptr<const CsgShape>> CgalCsgEngine::evaluate(const CsgTree& tree,
                                                                Progress& progress) const {
  using Shape = Result<std::shared_ptr<const CsgShape>>;
  return guarded("evaluating the solid", [&]() -> Shape {
    stop_if_cancelled(progress);
    RMP_TRY_ASSIGN(Evaluated made, evaluate_tree(tree, *imports_, progress));
    progress.report(1, "solid evaluated");
    return std::shared_ptr<const CsgShape>(std::make_shared<MeshShape>(std::move(made)));
  });
}

Result<Mesh> CgalCsgEngine::mesh(const CsgShape& shape, const MeshQuality& quality,
                                 Progress& progress) const {
  return guarded("meshing the solid", [&]() -> Result<Mesh> {
    RMP_TRY_ASSIGN(const MeshShape* own, own_shape(&shape));
    if (!(quality.chord >= kFinestChord) || !std::isfinite(quality.chord))
      return error(ErrorCode::invalid_argument, "mesh chord is " + csg_number_text(quality.chord) +
                                                    " m; it must be " +
                                                    csg_number_text(kFinestChord) + " m or more");
    if (!(quality.angle >= kFinestAngle) || !std::isfinite(quality.angle))
      return error(ErrorCode::invalid_argument, "mesh angle is " + csg_number_text(quality.angle) +
                                                    " rad; it must be " +
                                                    csg_number_text(kFinestAngle) + " rad or more");
    stop_if_cancelled(progress);
    return display_mesh(own->solid(), progress);
  });
}

Result<Moments> CgalCsgEngine::moments(const CsgShape& shape, Progress& progress) const {
  return guarded("integrating the solid", [&]() -> Result<Moments> {
    RMP_TRY_ASSIGN(const MeshShape* own, own_shape(&shape));
    stop_if_cancelled(progress);
    return moments_of(own->solid().mesh());
  });
}

Result<CsgEngine::Partition> CgalCsgEngine::partition(std::span<const PlacedShape> parts,
                                                      Progress& progress) const {
  return guarded("separating overlapping parts", [&]() -> Result<Partition> {
    std::vector<ExactSolid> solids;
    for (std::size_t i = 0; i < parts.size(); ++i) {
      const std::string where = "part " + std::to_string(i);
      RMP_TRY_ASSIGN(const MeshShape* own, own_shape(parts[i].shape.get()).in(where));
      const auto pose = to_affine(parts[i].placement);
      if (!pose) return bad_placement(where);
      solids.push_back(own->solid().moved(*pose, 0));
    }
    Partition out;
    for (std::size_t i = 0; i < solids.size(); ++i) {
      stop_if_cancelled(progress);
      progress.report(static_cast<double>(i) / static_cast<double>(solids.size()),
                      "separating overlapping parts");
      std::vector<ExactSolid> earlier;
      for (std::size_t k = 0; k < i; ++k)
        if (solids[k].box().meets(solids[i].box())) earlier.push_back(solids[k]);
      RMP_TRY_ASSIGN(
          const BooleanOutcome left,
          subtract(solids[i], std::move(earlier), progress).in("part " + std::to_string(i)));
      out.parts.push_back(moments_of(left.solid.mesh()));
      out.overlap += std::max(0.0, solids[i].volume() - out.parts.back().volume);
    }
    return out;
  });
}

Result<std::vector<CsgFeature>> CgalCsgEngine::features(const CsgShape& shape,
                                                        Progress& progress) const {
  return guarded("listing features", [&]() -> Result<std::vector<CsgFeature>> {
    RMP_TRY_ASSIGN(const MeshShape* own, own_shape(&shape));
    stop_if_cancelled(progress);
    return features_of(own->solid().mesh(), progress);
  });
}

Result<CsgProfile> CgalCsgEngine::section(const CsgShape& shape, const Pose& plane, double chord,
                                          Progress& progress) const {
  return guarded("cutting a section", [&]() -> Result<CsgProfile> {
    RMP_TRY_ASSIGN(const MeshShape* own, own_shape(&shape));
    const auto pose = to_affine(plane);
    if (!pose) return bad_placement("section plane");
    if (!(chord > 0) || !std::isfinite(chord))
      return error(ErrorCode::invalid_argument,
                   "section chord is " + csg_number_text(chord) + " m; it must be greater than 0");
    stop_if_cancelled(progress);
    PatchMesh mesh = own->solid().mesh();
    Affine inverse;  // plane_T_solid
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j) inverse.A[3 * i + j] = pose->A[3 * j + i];
    inverse.t = inverse.turn(pose->t) * -1;
    for (Vec3& p : mesh.points) p = snapped(inverse(p));
    return section_of(mesh);
  });
}

Result<CsgGeometry> CgalCsgEngine::geometry(const CsgShape& shape, Progress& progress) const {
  return guarded("exporting the mesh", [&]() -> Result<CsgGeometry> {
    RMP_TRY_ASSIGN(const MeshShape* own, own_shape(&shape));
    stop_if_cancelled(progress);
    const PatchMesh& mesh = own->solid().mesh();
    CsgGeometry out;
    out.form = CsgGeometry::Form::mesh;
    for (const Vec3& p : mesh.points) out.points.insert(out.points.end(), p.begin(), p.end());
    for (const auto& t : mesh.triangles)
      out.triangles.insert(out.triangles.end(), t.begin(), t.end());
    return out;
  });
}

}  // namespace robomosp::csg_cgal
