// SPDX-License-Identifier: Apache-2.0
#include "engine.h"

#include <algorithm>
#include <cmath>

#include <BRepBndLib.hxx>

namespace robomosp::csg_occt {
namespace {

// Tight, without tolerances. The optimal algorithm can fail on odd surfaces; the plain one never
// does and is only looser.
std::array<Vec3, 2> tight_bounds(const std::vector<Solid>& solids, const gp_Trsf& pose) {
  Bnd_Box box;
  for (const Solid& s : solids) {
    const TopoDS_Shape shape = placed(s.shape, pose);
    Bnd_Box one;
    try {
      BRepBndLib::AddOptimal(shape, one, false, false);
    } catch (const Standard_Failure&) {
      one.SetVoid();
    }
    if (one.IsVoid()) BRepBndLib::Add(shape, one, false);
    one.SetGap(0);
    box.Add(one);
  }
  const gp_Pnt low = box.CornerMin(), high = box.CornerMax();
  const auto metres = [](const gp_Pnt& p) {
    return Vec3{p.X() / kMillimetresPerMetre, p.Y() / kMillimetresPerMetre,
                p.Z() / kMillimetresPerMetre};
  };
  return {metres(low), metres(high)};
}

std::vector<std::string> note_texts(const Plan& plan, const CsgTree& tree, const Value& value) {
  std::vector<std::string> texts;
  for (const Note& note : value.notes) {
    std::size_t t = plan.root.term;
    for (const std::uint32_t step : note.path)
      if (step < plan.terms[t].items.size()) t = plan.terms[t].items[step].term;
    const std::size_t node = plan.terms[t].node;
    texts.push_back(node_text(tree.nodes[node], node) + ": " + note.text + ".");
  }
  if (value.solids.size() > 1)
    texts.push_back("The solid consists of " + std::to_string(value.solids.size()) +
                    " separate pieces.");
  return texts;
}

}  // namespace

OcctCsgEngine::OcctCsgEngine() { silence_messenger(); }

Result<std::shared_ptr<const CsgShape>> OcctCsgEngine::evaluate(const CsgTree& tree,
                                                                Progress& progress) const {
  using Shape = Result<std::shared_ptr<const CsgShape>>;
  return guarded("evaluating the solid", [&]() -> Shape {
    if (progress.cancelled()) return cancelled_error();
    RMP_TRY_ASSIGN(const Plan plan, make_plan(tree, progress));
    RMP_TRY_ASSIGN(const ValuePtr value,
                   evaluate_plan(plan, tree, cache_, faces_, gate_, progress));
    const auto claim = gate_.claim(value->lineage, progress);
    if (!claim || progress.cancelled()) return cancelled_error();
    const auto bounds = tight_bounds(value->solids, plan.root.pose);
    progress.report(1, "solid evaluated");
    return std::shared_ptr<const CsgShape>(
        std::make_shared<OcctShape>(value, plan.root.pose, bounds, note_texts(plan, tree, *value)));
  });
}

Result<Mesh> OcctCsgEngine::mesh(const CsgShape& shape, const MeshQuality& quality,
                                 Progress& progress) const {
  return guarded("meshing the solid", [&]() -> Result<Mesh> {
    RMP_TRY_ASSIGN(const OcctShape* own, own_shape(shape));
    const auto claim = gate_.claim(own->lineage(), progress);
    if (!claim) return cancelled_error();
    return mesh_solids(own->solids(), own->pose(), quality, progress);
  });
}

Result<Moments> OcctCsgEngine::moments(const CsgShape& shape, Progress& progress) const {
  return guarded("integrating the solid", [&]() -> Result<Moments> {
    RMP_TRY_ASSIGN(const OcctShape* own, own_shape(shape));
    const auto claim = gate_.claim(own->lineage(), progress);
    if (!claim) return cancelled_error();
    Integrals sum;
    for (const Solid& s : own->solids()) {
      if (progress.cancelled()) return cancelled_error();
      sum.add(faces_.of(s.shape));
    }
    return to_moments(sum, own->pose(), extent_of(own->solids()));
  });
}

Result<CsgEngine::Partition> OcctCsgEngine::partition(std::span<const PlacedShape> parts,
                                                      Progress& progress) const {
  return guarded("separating overlapping parts", [&]() -> Result<Partition> {
    std::vector<PlacedSolids> placed_parts;
    Lineage lineage;
    for (std::size_t i = 0; i < parts.size(); ++i) {
      const std::string where = "part " + std::to_string(i);
      if (!parts[i].shape)
        return error(ErrorCode::invalid_argument, "there is no shape", "Evaluate it first.", where);
      RMP_TRY_ASSIGN(const OcctShape* own, own_shape(*parts[i].shape).in(where));
      const auto pose = to_trsf(parts[i].placement);
      if (!pose)
        return error(ErrorCode::invalid_argument,
                     "placement is not a rigid motion; its rotation must be orthonormal with "
                     "determinant +1 and all its numbers finite",
                     {}, where);
      placed_parts.push_back(
          {own->solids(), is_identity(*pose) ? own->pose() : *pose * own->pose()});
      merge(lineage, own->lineage());
    }
    const auto claim = gate_.claim(std::move(lineage), progress);
    if (!claim) return cancelled_error();
    return partition_solids(placed_parts, faces_, progress);
  });
}

Result<const OcctShape*> own_shape(const CsgShape& shape) {
  if (const auto* own = dynamic_cast<const OcctShape*>(&shape)) return own;
  return error(ErrorCode::invalid_argument, "the shape was made by another engine",
               "Evaluate its tree again with the engine \"occt\".");
}

double extent_of(const std::vector<Solid>& solids) {
  Bnd_Box box;
  for (const Solid& s : solids) box.Add(s.box);
  return box.IsVoid() ? 0 : std::sqrt(box.SquareExtent());
}

}  // namespace robomosp::csg_occt
