// SPDX-License-Identifier: Apache-2.0
#include "evaluation/body_shapes.h"

#include <utility>

#include "evaluation/attached_tools.h"
#include "evaluation/drawables.h"
#include "evaluation/leaves.h"
#include "model/placement.h"
#include "robotics/link_geometry.h"
#include "spatial/pose.h"

namespace robomosp::evaluation {
namespace {

Result<std::shared_ptr<const std::vector<ShapePiece>>> shapes_of(Solids& solids,
                                                                 const CsgTree& tree, double chord,
                                                                 Progress& progress) {
  RMP_TRY_ASSIGN(const SolidEngine e, solids.engine_for(tree));
  Fingerprinter fp("shapes/4");
  fp.add(Solids::keys_of(e, tree).value).add(chord);
  const Fingerprint key = fp.finish();
  return solids.kept<std::vector<ShapePiece>>(
      "shapes", e, key, progress,
      [&] {
        return shape_pieces(
            tree, [&](const CsgTree& part) { return solids.mesh(part, chord, progress); },
            [&](const CsgTree& part) -> Result<std::vector<Vec3>> {
              RMP_TRY_ASSIGN(const MadeSolid made, solids.shape(part, progress));
              RMP_TRY_ASSIGN(const auto features, solids.features(made, progress));
              std::vector<Vec3> corners;
              for (const CsgFeature& f : *features)
                if (f.kind == CsgFeature::Kind::corner) corners.push_back(f.point);
              return corners;
            });
      },
      [](const std::vector<ShapePiece>& pieces) {
        std::size_t bytes = sizeof(ShapePiece) * pieces.size();
        for (const ShapePiece& p : pieces) {
          if (p.mesh) bytes += mesh_bytes(*p.mesh);
          if (p.corners) bytes += sizeof(Vec3) * p.corners->size();
        }
        return bytes;
      });
}

}  // namespace

using document::Snapshot;

Result<std::shared_ptr<const std::vector<ShapePiece>>> shapes_of(Solids& solids, const Snapshot& s,
                                                                 AnyId id, Progress& progress) {
  RMP_TRY_ASSIGN(const auto leaves, leaves_of(s, id));
  std::vector<ShapePiece> all;
  for (const Leaf& leaf : leaves) {
    RMP_TRY_ASSIGN(const auto* solid, Solids::solid_of(s, leaf.solid));
    RMP_TRY_ASSIGN(const CsgTree tree, solids.tree_of(s, leaf.solid, progress));
    RMP_TRY_ASSIGN(const auto own,
                   shapes_of(solids, tree, solid->chord, progress).in(s.describe(leaf.solid)));
    for (ShapePiece p : *own) {
      p.pose = spatial::compose(leaf.placement, p.pose);
      all.push_back(std::move(p));
    }
  }
  return std::make_shared<const std::vector<ShapePiece>>(std::move(all));
}

Result<std::vector<std::vector<ShapePiece>>> robot_shapes_of(Solids& solids, const Snapshot& s,
                                                             RobotId id, Progress& progress) {
  const auto* robot = s.get(id);
  if (!robot) return stale(s, id);
  std::vector<std::vector<ShapePiece>> out(robot->links.size() + 1);
  const auto add = [&](const std::shared_ptr<const std::vector<ShapePiece>>& pieces, const Pose& at,
                       std::vector<ShapePiece>& to) {
    for (ShapePiece p : *pieces) {
      p.pose = spatial::compose(at, p.pose);
      to.push_back(std::move(p));
    }
  };
  const auto add_link_geometry = [&](const std::vector<robotics::LinkGeometryPiece>& skin,
                                     std::vector<ShapePiece>& to) -> Result<void> {
    for (const auto& piece : skin) {
      RMP_TRY_ASSIGN(const auto own, shapes_of(solids, piece.tree, kLinkGeometryChord, progress));
      add(own, {}, to);
    }
    return {};
  };
  const auto add_parts = [&](const std::vector<model::BodyPart>& parts,
                             std::vector<ShapePiece>& to) -> Result<void> {
    for (const auto& part : parts) {
      RMP_TRY_ASSIGN(const auto own, shapes_of(solids, s, part.what, progress));
      add(own, model::pose(part.placement), to);
    }
    return {};
  };
  const std::vector<bool> is_generated = robotics::generated_bodies(*robot);
  const robotics::LinkGeometry skin = robotics::make_link_geometry(without_tool_stick(*robot));
  if (is_generated[0]) RMP_TRY(add_link_geometry(skin.base, out[0]));
  else RMP_TRY(add_parts(robot->base_parts, out[0]));
  for (std::size_t i = 0; i < robot->links.size(); ++i) {
    if (is_generated[i + 1]) RMP_TRY(add_link_geometry(skin.links[i], out[i + 1]));
    else RMP_TRY(add_parts(robot->links[i].parts, out[i + 1]));
  }
  for (const auto& t : robot->attached)
    RMP_TRY(add_parts({{t.what, t.placement}}, out[static_cast<std::size_t>(t.link + 1)]));
  return out;
}

}  // namespace robomosp::evaluation
