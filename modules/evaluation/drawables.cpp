// SPDX-License-Identifier: Apache-2.0
#include "evaluation/drawables.h"

#include <algorithm>
#include <atomic>
#include <mutex>
#include <optional>
#include <set>
#include <utility>

#include "evaluation/attached_tools.h"
#include "evaluation/csg_tree.h"
#include "evaluation/leaves.h"
#include "kernel/executor.h"
#include "kernel/quiet_progress.h"
#include "model/placement.h"
#include "robotics/link_geometry.h"
#include "spatial/pose.h"

namespace robomosp::evaluation {
namespace {

using document::Snapshot;

constexpr double kLinkGeometryShininess = 0.4;

/// A branch of a tree that can be shown though the tree cannot.
struct Operand {
  std::string name;
  std::shared_ptr<const Mesh> mesh;
  Pose placement;           ///< solid_T_mesh
  bool is_healthy = false;  ///< stands in the solid as it is, beside what failed
};

/// The operands of the deepest operation that fails, those that can be made; before them what
/// unions put beside it, which would look the same if it had not failed.
Result<std::vector<Operand>> operands(Solids& solids, const CsgTree& tree, double chord,
                                      Progress& progress) {
  std::vector<Operand> beside, found;
  bool is_in_unions = true;
  for (std::size_t top = 0;;) {
    std::optional<std::size_t> failing;
    found.clear();
    for (const std::size_t child : children_of(tree, top)) {
      Branch branch = branch_of(tree, child);
      auto made = solids.mesh(branch.tree, chord, progress);
      if (made.ok()) {
        found.push_back({tree.nodes[child].name, std::move(made).value(), branch.placement, false});
      } else if (made.error().code == ErrorCode::cancelled) {
        return std::move(made).error();
      } else if (!failing) {
        failing = child;
      }
    }
    // A primitive that fails is no operation: its neighbours are what there is to see.
    is_in_unions = is_in_unions && tree.nodes[top].kind == CsgKind::union_;
    const bool is_deepest =
        !failing || csg_info(tree.nodes[*failing].kind).children == CsgChildren::none;
    if (is_deepest) {
      // Somebody has to tell what failed.
      if (found.empty()) std::swap(found, beside);
      for (Operand& o : found) o.is_healthy = false;
      beside.insert(beside.end(), found.begin(), found.end());
      return beside;
    }
    if (is_in_unions)
      for (Operand& o : found) {
        o.is_healthy = true;
        beside.push_back(std::move(o));
      }
    top = *failing;
  }
}

/// Makes and meshes what is not known yet, several solids at once. Failures are remembered by
/// the cache and reported to whoever asks.
Result<void> prepare(Solids& solids, const Snapshot& s, const std::vector<Leaf>& leaves,
                     Progress& progress) {
  struct Work {
    CsgTree tree;
    double chord = 0;
  };
  std::vector<Work> work;
  std::set<SolidId> seen;
  std::set<Fingerprint> keys;
  for (const Leaf& l : leaves) {
    if (!seen.insert(l.solid).second) continue;
    const auto solid = Solids::solid_of(s, l.solid);
    if (!solid.ok()) continue;
    auto tree = solids.tree_of(**solid, progress);
    if (!tree.ok()) continue;
    const auto e = solids.engine_for(*tree);
    if (!e.ok()) continue;
    MeshQuality quality;
    quality.chord = (*solid)->chord;
    const Solids::Keys shape_keys = Solids::keys_of(*e, *tree);
    const Fingerprint key = Solids::mesh_key(shape_keys.value, quality);
    if (solids.cache().holds(key, shape_keys.failure) || !keys.insert(key).second) continue;
    work.push_back({std::move(*tree), quality.chord});
  }
  if (work.size() < 2 || !solids.cache().is_enabled()) return {};
  std::atomic<std::size_t> done{0};
  std::mutex tell;
  Executor& executor = Executor::of_process();
  executor.spread(work.size(), executor.cores(), [&](std::size_t i) {
    if (progress.cancelled()) return;
    QuietProgress quiet(progress);
    (void)solids.mesh(work[i].tree, work[i].chord, quiet).ok();
    const std::lock_guard lock(tell);
    progress.report(static_cast<double>(++done) / static_cast<double>(work.size()),
                    "making solids");
  });
  if (progress.cancelled()) return error(ErrorCode::cancelled, "cancelled");
  return {};
}

Result<void> add_link_geometry(Solids& solids, const model::Robot& robot, RobotBodies& out,
                               Progress& progress) {
  const robotics::LinkGeometry skin = robotics::make_link_geometry(without_tool_stick(robot));
  const auto add = [&](const std::vector<robotics::LinkGeometryPiece>& pieces,
                       const std::string& name, std::vector<Drawable>& to) -> Result<void> {
    for (const auto& piece : pieces) {
      RMP_TRY_ASSIGN(auto m, solids.mesh(piece.tree, kLinkGeometryChord, progress));
      to.push_back(
          {name,
           std::move(m),
           {},
           piece.role == robotics::LinkGeometryRole::tube ? robot.skin_colour : robot.skin_accent,
           kLinkGeometryShininess,
           0});
    }
    return {};
  };
  if (out.is_generated[0]) RMP_TRY(add(skin.base, "base", out.bodies[0]));
  for (std::size_t i = 0; i < robot.links.size() && i < skin.links.size(); ++i)
    if (out.is_generated[i + 1])
      RMP_TRY(add(skin.links[i], robot.links[i].name, out.bodies[i + 1]));
  return {};
}

}  // namespace

Result<void> prepare(Solids& solids, const Snapshot& s, std::span<const AnyId> what,
                     Progress& progress) {
  std::vector<Leaf> all;
  for (const AnyId id : what) {
    auto leaves = leaves_of(s, id);
    if (leaves.ok()) all.insert(all.end(), leaves->begin(), leaves->end());
  }
  return prepare(solids, s, all, progress);
}

Result<std::vector<Drawable>> drawables_of(Solids& solids, const Snapshot& s, AnyId id,
                                           Progress& progress) {
  RMP_TRY_ASSIGN(const std::vector<Leaf> leaves, leaves_of(s, id));
  if (leaves.size() > 1) RMP_TRY(prepare(solids, s, leaves, progress));
  std::vector<Drawable> all;
  std::optional<Error> first;
  for (const Leaf& l : leaves) {
    RMP_TRY_ASSIGN(const auto* solid, Solids::solid_of(s, l.solid));
    const auto* given = l.material ? s.get(l.material) : nullptr;
    const model::Material look = given ? *given : model::Material{};
    const auto draw = [&](std::string name, std::shared_ptr<const Mesh> m, const Pose& placement,
                          std::string failure) {
      const bool is_operand = !failure.empty();
      all.push_back({std::move(name), std::move(m), placement, look.colour, look.shininess,
                     look.metalness, look.ambient, look.specular, look.emission, is_operand,
                     std::move(failure)});
    };
    auto tree = solids.tree_of(*solid, progress);
    auto made = tree.ok() ? solids.mesh(*tree, solid->chord, progress)
                          : Result<std::shared_ptr<const Mesh>>(tree.error());
    if (made.ok()) {
      draw(l.name, *made, l.placement, "");
      continue;
    }
    Error why = std::move(made).error().in(s.describe(l.solid));
    if (why.code == ErrorCode::cancelled) return why;
    if (tree.ok()) {
      RMP_TRY_ASSIGN(const auto shown, operands(solids, *tree, solid->chord, progress));
      for (const Operand& o : shown)
        draw(o.name.empty() ? l.name : l.name + "." + o.name, o.mesh,
             spatial::compose(l.placement, o.placement), o.is_healthy ? "" : why.sentence());
    }
    if (!first) first = std::move(why);
  }
  if (all.empty() && first) return *first;
  return all;
}

Result<RobotBodies> robot_bodies_of(Solids& solids, const Snapshot& s, RobotId id,
                                    Progress& progress) {
  const auto* robot = s.get(id);
  if (!robot) return stale(s, id);
  RobotBodies out;
  out.bodies.resize(robot->links.size() + 1);
  out.is_generated = robotics::generated_bodies(*robot);
  out.generated =
      robot->base_parts.empty() && std::all_of(robot->links.begin(), robot->links.end(),
                                               [](const auto& l) { return l.parts.empty(); });
  RMP_TRY(add_link_geometry(solids, *robot, out, progress));
  out.tools_from.resize(out.bodies.size());
  const auto tools_begin = [&out] {
    for (std::size_t b = 0; b < out.bodies.size(); ++b) out.tools_from[b] = out.bodies[b].size();
  };
  if (out.generated && robot->attached.empty()) {
    tools_begin();
    return out;
  }
  const bool is_any_generated =
      std::find(out.is_generated.begin(), out.is_generated.end(), true) != out.is_generated.end();
  std::vector<AnyId> parts_of_all;
  for (const auto& p : robot->base_parts) parts_of_all.push_back(p.what);
  for (const auto& l : robot->links)
    if (l.visible)
      for (const auto& p : l.parts) parts_of_all.push_back(p.what);
  for (const auto& t : robot->attached) parts_of_all.push_back(t.what);
  RMP_TRY(prepare(solids, s, parts_of_all, progress));
  std::optional<Error> first;
  bool is_anything_drawn = is_any_generated;
  const auto add = [&](const std::vector<model::BodyPart>& parts,
                       std::vector<Drawable>& to) -> Result<void> {
    for (const auto& p : parts) {
      auto drawn = drawables_of(solids, s, p.what, progress);
      if (!drawn.ok()) {
        if (drawn.error().code == ErrorCode::cancelled) return drawn.error();
        if (!first) first = drawn.error();
        continue;
      }
      is_anything_drawn = is_anything_drawn || !drawn->empty();
      for (Drawable& d : *drawn) {
        d.placement = spatial::compose(model::pose(p.placement), d.placement);
        to.push_back(std::move(d));
      }
    }
    return {};
  };
  RMP_TRY(add(robot->base_parts, out.bodies[0]));
  for (std::size_t i = 0; i < robot->links.size(); ++i)
    if (robot->links[i].visible) RMP_TRY(add(robot->links[i].parts, out.bodies[i + 1]));
  tools_begin();
  for (const auto& t : robot->attached)
    RMP_TRY(add({{t.what, t.placement}}, out.bodies[static_cast<std::size_t>(t.link + 1)]));
  if (first && !is_anything_drawn) return *first;
  return out;
}

}  // namespace robomosp::evaluation
