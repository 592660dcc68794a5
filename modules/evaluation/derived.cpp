// SPDX-License-Identifier: Apache-2.0
#include "evaluation/derived.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "evaluation/body_shapes.h"
#include "evaluation/csg_tree.h"
#include "evaluation/drawables.h"
#include "evaluation/leaves.h"
#include "evaluation/mass.h"
#include "evaluation/plain_mesh.h"
#include "evaluation/robot_model.h"
#include "evaluation/solids.h"

namespace robomosp::evaluation {

struct Derived::Impl {
  Impl(const Registry& registry, std::size_t budget) : cache(budget), solids(registry, cache) {}

  Cache cache;
  Solids solids;
  std::shared_ptr<FileCache> files;
};

namespace {

using document::Snapshot;

/// `object "arm" waits for solid "bore": ...`
Error waits(const Snapshot& s, AnyId who, Error e) {
  e.where = s.describe(who) + (e.where.empty() ? "" : " waits for " + e.where);
  return e;
}

Result<std::array<Vec3, 2>> bounds_of(Solids& solids, const Snapshot& s, AnyId id,
                                      Progress& progress) {
  RMP_TRY_ASSIGN(const std::vector<Leaf> leaves, leaves_of(s, id));
  if (leaves.empty())
    return error(ErrorCode::invalid_argument, "it has no parts", "Add a part to it.",
                 s.describe(id));
  constexpr double kInf = std::numeric_limits<double>::infinity();
  std::array<Vec3, 2> box{{{kInf, kInf, kInf}, {-kInf, -kInf, -kInf}}};
  for (const Leaf& l : leaves) {
    RMP_TRY_ASSIGN(const MadeSolid shape_of_leaf, solids.shape(s, l.solid, progress));
    RMP_TRY_ASSIGN(const auto own, placed_box(shape_of_leaf, l.placement).in(s.describe(l.solid)));
    for (std::size_t i = 0; i < 3; ++i) {
      box[0][i] = std::min(box[0][i], own[0][i]);
      box[1][i] = std::max(box[1][i], own[1][i]);
    }
  }
  return box;
}

/// Adds who asked to an error of a part.
template <class T>
Result<T> for_whom(const Snapshot& s, AnyId who, Result<T> result) {
  if (result.ok() || result.error().code == ErrorCode::cancelled) return result;
  if (who.kind == Kind::solid || result.error().where == s.describe(who) || !s.find(who))
    return result;
  return waits(s, who, std::move(result).error());
}

}  // namespace

Derived::Derived(const Registry& registry, std::size_t budget_bytes)
    : impl_(std::make_unique<Impl>(registry, budget_bytes)) {}
Derived::~Derived() = default;

void Derived::keep_in(std::shared_ptr<FileCache> files) {
  impl_->files = files;
  impl_->solids.keep_in(std::move(files));
}
const std::shared_ptr<FileCache>& Derived::files() const { return impl_->files; }

Result<std::shared_ptr<const Mesh>> Derived::mesh(const Snapshot& s, SolidId id,
                                                  Progress& progress) {
  return mesh(s, id, 0, progress);
}

Result<std::shared_ptr<const Mesh>> Derived::mesh(const Snapshot& s, SolidId id, double chord,
                                                  Progress& progress) {
  RMP_TRY_ASSIGN(const auto* solid, Solids::solid_of(s, id));
  RMP_TRY_ASSIGN(const CsgTree tree, impl_->solids.tree_of(s, id, progress));
  return impl_->solids.mesh(tree, chord > 0 ? chord : solid->chord, progress).in(s.describe(id));
}

Result<std::string> Derived::stand_in(const Snapshot& s, SolidId id, double chord,
                                      Progress& progress) {
  RMP_TRY_ASSIGN(const auto* solid, Solids::solid_of(s, id));
  RMP_TRY_ASSIGN(const auto shape, impl_->solids.shape(s, id, progress));
  if (!shape.stand_in.empty() || shape.engine.is_mesh) return shape.stand_in;
  // What failed once is remembered like what was made.
  const auto made = impl_->solids.mesh(shape, chord > 0 ? chord : solid->chord, progress);
  if (made.ok()) return std::string();
  if (made.error().code == ErrorCode::cancelled) return made.error();
  return Solids::stand_in_text(made.error());
}

Result<Moments> Derived::moments(const Snapshot& s, SolidId id, Progress& progress) {
  RMP_TRY_ASSIGN(const auto shape, impl_->solids.shape(s, id, progress));
  return impl_->solids.moments(shape, progress).in(s.describe(id));
}

Result<BodyMass> Derived::mass(const Snapshot& s, AnyId id, Progress& progress) {
  return for_whom(s, id, body_mass(impl_->solids, s, id, progress));
}

Result<BodyMass> Derived::mass(const Snapshot& s, std::span<const model::BodyPart> parts,
                               Progress& progress) {
  return parts_mass(impl_->solids, s, parts, progress);
}

Result<std::vector<PartMass>> Derived::part_masses(const Snapshot& s, AnyId id,
                                                   Progress& progress) {
  std::vector<PartMass> listed;
  auto made = for_whom(s, id, body_mass(impl_->solids, s, id, progress, &listed));
  if (!made.ok()) return std::move(made).error();
  return listed;
}

Result<std::shared_ptr<const std::vector<CsgFeature>>> Derived::features(const Snapshot& s,
                                                                         SolidId id,
                                                                         Progress& progress) {
  RMP_TRY_ASSIGN(const auto shape, impl_->solids.shape(s, id, progress));
  return impl_->solids.features(shape, progress).in(s.describe(id));
}

Result<std::shared_ptr<const std::vector<CsgEdge>>> Derived::edges(const Snapshot& s, SolidId id,
                                                                   double chord,
                                                                   Progress& progress) {
  RMP_TRY_ASSIGN(const auto shape, impl_->solids.shape(s, id, progress));
  return impl_->solids.edges(shape, chord, progress).in(s.describe(id));
}

Result<std::vector<MeshState>> Derived::mesh_states(const Snapshot& s, SolidId id, bool places,
                                                    Progress& progress) {
  constexpr std::size_t kMostCuts = 1000;
  RMP_TRY_ASSIGN(const CsgTree tree, impl_->solids.tree_of(s, id, progress));
  std::vector<MeshState> out;
  for (std::size_t i = 0; i < tree.nodes.size(); ++i) {
    const CsgNode& node = tree.nodes[i];
    if (!node.geometry || node.geometry->form != CsgGeometry::Form::mesh) continue;
    if (progress.cancelled()) return error(ErrorCode::cancelled, "cancelled");
    Branch branch = branch_of(tree, i);
    branch.tree.nodes[0].placement = branch.placement;
    const auto made = impl_->solids.shape(branch.tree, progress);
    if (!made.ok() && made.error().code == ErrorCode::cancelled) return made.error();
    if (made.ok() && !made->engine.is_plain) continue;
    MeshState state;
    state.node = node.name;
    state.alone = tree.nodes.size() == 1;
    state.why = made.ok() ? *why_plain(*made->shape) : made.error();
    if (made.ok() && state.alone && !made->shape->notes().empty())
      state.note = made->shape->notes()[0];
    if (made.ok() && places) {
      state.surface = examined(branch.tree);
      state.cuts = cuts_of(branch.tree, kMostCuts);
    }
    out.push_back(std::move(state));
  }
  return out;
}

Result<std::shared_ptr<const CsgProfile>> Derived::section(const Snapshot& s, SolidId id,
                                                           const Pose& plane, double chord,
                                                           Progress& progress) {
  RMP_TRY_ASSIGN(const auto shape, impl_->solids.shape(s, id, progress));
  return impl_->solids.section(shape, plane, chord, progress).in(s.describe(id));
}

Result<std::shared_ptr<const CsgGeometry>> Derived::geometry(const Snapshot& s, SolidId id,
                                                             Progress& progress) {
  RMP_TRY_ASSIGN(const auto shape, impl_->solids.shape(s, id, progress));
  return impl_->solids.geometry(shape, progress).in(s.describe(id));
}

Result<void> Derived::prepare(const Snapshot& s, std::span<const AnyId> what, Progress& progress) {
  return evaluation::prepare(impl_->solids, s, what, progress);
}

Result<std::array<Vec3, 2>> Derived::bounds(const Snapshot& s, AnyId id, Progress& progress) {
  return for_whom(s, id, bounds_of(impl_->solids, s, id, progress));
}

Result<std::vector<Drawable>> Derived::drawables(const Snapshot& s, AnyId id, Progress& progress) {
  return for_whom(s, id, drawables_of(impl_->solids, s, id, progress));
}

Result<std::shared_ptr<const RobotModel>> Derived::robot_model(const Snapshot& s, RobotId id,
                                                               Vec3 gravity, Progress& progress) {
  auto made = robot_model_of(impl_->solids, s, id, gravity, progress);
  // Faults of the robot itself say so already.
  if (!made.ok() && made.error().where.starts_with("robot ")) return made;
  return for_whom(s, id, std::move(made));
}

Result<std::optional<MassProperties>> Derived::standing_mass(const Snapshot& s, RobotId id,
                                                             Progress& progress) {
  return for_whom(s, id, standing_mass_of(impl_->solids, s, id, progress));
}

Result<RobotBodies> Derived::robot_bodies(const Snapshot& s, RobotId id, Progress& progress) {
  return for_whom(s, id, robot_bodies_of(impl_->solids, s, id, progress));
}

Result<std::shared_ptr<const std::vector<ShapePiece>>> Derived::shapes(const Snapshot& s, AnyId id,
                                                                       Progress& progress) {
  return for_whom(s, id, shapes_of(impl_->solids, s, id, progress));
}

Result<std::vector<std::vector<ShapePiece>>> Derived::robot_shapes(const Snapshot& s, RobotId id,
                                                                   Progress& progress) {
  return for_whom(s, id, robot_shapes_of(impl_->solids, s, id, progress));
}

CacheStats Derived::stats() const { return impl_->cache.stats(); }
void Derived::clear() { impl_->cache.clear(); }
void Derived::set_enabled(bool is_enabled) { impl_->cache.set_enabled(is_enabled); }

}  // namespace robomosp::evaluation
