// SPDX-License-Identifier: GPL-3.0-or-later
// CgalCsgEngine: interface robomosp.csg/1 on triangle meshes with CGAL's exact corefinement
// (layer: plugin).
#pragma once

#include <robomosp/sdk/csg.h>

#include "evaluate.h"

namespace robomosp::csg_cgal {

/// A solid bounded by triangles.
class MeshShape final : public CsgShape {
 public:
  explicit MeshShape(Evaluated evaluated)
      : solid_(std::move(evaluated.solid)), notes_(std::move(evaluated.notes)) {}
  std::array<Vec3, 2> bounds() const override { return {solid_.box().low, solid_.box().high}; }
  std::span<const std::string> notes() const override { return notes_; }
  const ExactSolid& solid() const { return solid_; }

 private:
  ExactSolid solid_;
  std::vector<std::string> notes_;
};

class CgalCsgEngine final : public CsgEngine {
 public:
  explicit CgalCsgEngine(const rmp_host* host) : imports_(std::make_unique<Imports>(host)) {}
  Result<std::shared_ptr<const CsgShape>> evaluate(const CsgTree& tree,
                                                   Progress& progress) const override;
  Result<Mesh> mesh(const CsgShape& shape, const MeshQuality& quality,
                    Progress& progress) const override;
  Result<Moments> moments(const CsgShape& shape, Progress& progress) const override;
  Result<Partition> partition(std::span<const PlacedShape> parts,
                              Progress& progress) const override;
  Result<std::vector<CsgFeature>> features(const CsgShape& shape,
                                           Progress& progress) const override;
  Result<CsgProfile> section(const CsgShape& shape, const Pose& plane, double chord,
                             Progress& progress) const override;
  Result<CsgGeometry> geometry(const CsgShape& shape, Progress& progress) const override;

 private:
  std::unique_ptr<Imports> imports_;
};

/// Display mesh with smooth normals along the patches and the sharp edges between them.
Mesh display_mesh(const ExactSolid& solid, const Progress& progress);
/// Faces, then edges, then corners.
std::vector<CsgFeature> features_of(const PatchMesh& mesh, const Progress& progress);
/// Closed polygons where the plane z = 0 cuts the mesh (in the plane's frame).
CsgProfile section_of(const PatchMesh& mesh);

}  // namespace robomosp::csg_cgal
