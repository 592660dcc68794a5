// SPDX-License-Identifier: Apache-2.0
// OcctCsgEngine: interface robomosp.csg/1 on Open CASCADE's exact boundary representation
// (layer: plugin).
#pragma once

#include <array>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "evaluate.h"
#include "topology_gate.h"

#include <robomosp/sdk/csg.h>
#include <robomosp/sdk/csg_edges.h>

namespace robomosp::csg_occt {

/// A verified solid: a value of the term cache at a place.
class OcctShape final : public CsgShape {
 public:
  OcctShape(ValuePtr value, const gp_Trsf& pose, std::array<Vec3, 2> bounds,
            std::vector<std::string> notes)
      : value_(std::move(value)), pose_(pose), bounds_(bounds), notes_(std::move(notes)) {}

  std::array<Vec3, 2> bounds() const override { return bounds_; }
  std::span<const std::string> notes() const override { return notes_; }

  const std::vector<Solid>& solids() const { return value_->solids; }  ///< before pose()
  const gp_Trsf& pose() const { return pose_; }                        ///< [mm]
  const Lineage& lineage() const { return value_->lineage; }

 private:
  ValuePtr value_;
  gp_Trsf pose_;
  std::array<Vec3, 2> bounds_;
  std::vector<std::string> notes_;
};

class OcctCsgEngine final : public CsgEngine, public CsgEdges {
 public:
  OcctCsgEngine();
  const void* extension(const char* id) const override;

  Result<std::shared_ptr<const CsgShape>> evaluate(const CsgTree& tree,
                                                   Progress& progress) const override;
  Result<Mesh> mesh(const CsgShape& shape, const MeshQuality& quality,
                    Progress& progress) const override;
  Result<Moments> moments(const CsgShape& shape, Progress& progress) const override;
  Result<Partition> partition(std::span<const PlacedShape> parts,
                              Progress& progress) const override;
  Result<std::vector<CsgFeature>> features(const CsgShape& shape,
                                           Progress& progress) const override;
  Result<std::vector<CsgEdge>> edges(const CsgShape& shape, double chord,
                                     Progress& progress) const override;
  Result<CsgProfile> section(const CsgShape& shape, const Pose& plane, double chord,
                             Progress& progress) const override;
  Result<CsgGeometry> geometry(const CsgShape& shape, Progress& progress) const override;

 private:
  /// Enough for the steps of some hundred edits; an entry shares what did not change.
  static constexpr std::size_t kTermLimit = 2'000;

  Shortcut shortcut_ = Shortcut::on;
  mutable TermCache cache_{kTermLimit};
  mutable FaceMemory faces_;
  mutable TopologyGate gate_;
};

/// The shape as this engine's own, or an error.
Result<const OcctShape*> own_shape(const CsgShape& shape);

/// The diagonal of all boxes [mm].
double extent_of(const std::vector<Solid>& solids);

/// Meshes located solids [mm]; the caller holds a claim on their lineage.
Result<Mesh> mesh_solids(const std::vector<Solid>& solids, const gp_Trsf& pose,
                         const MeshQuality& quality, Progress& progress);

struct PlacedSolids {
  std::vector<Solid> solids;  ///< in their own frame
  gp_Trsf pose;               ///< to the common frame
};
/// The caller holds a claim on the lineage of all parts.
Result<CsgEngine::Partition> partition_solids(const std::vector<PlacedSolids>& parts,
                                              FaceMemory& faces, Progress& progress);

}  // namespace robomosp::csg_occt
