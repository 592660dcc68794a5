// SPDX-License-Identifier: Apache-2.0
#include "evaluation/mass.h"

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "evaluation/leaves.h"
#include "kernel/text.h"
#include "spatial/mass.h"
#include "spatial/pose.h"

namespace robomosp::evaluation {
namespace {

using document::Snapshot;
using model::Record;

void note(BodyMass& sum, std::string text) {
  if (std::find(sum.notes.begin(), sum.notes.end(), text) == sum.notes.end())
    sum.notes.push_back(std::move(text));
}

/// What add_group() found out about one leaf.
struct Weighed {
  PartMass part;
  double relative_error = 0;
};

/// True when boxes show that no two solids of different engines share volume.
bool engines_are_apart(const std::vector<MadeSolid>& shapes,
                       const std::vector<const Leaf*>& leaves) {
  std::vector<std::array<Vec3, 2>> boxes;
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    const auto box = placed_box(shapes[i], leaves[i]->placement);
    if (!box.ok()) return false;
    boxes.push_back(*box);
  }
  constexpr double kTouching = 1e-9;  ///< depth that is rounding of a face on a face [m]
  for (std::size_t a = 0; a < boxes.size(); ++a)
    for (std::size_t b = 0; b < a; ++b) {
      if (shapes[a].engine.name == shapes[b].engine.name) continue;
      if (shapes[a].engine.is_plain || shapes[b].engine.is_plain) continue;
      bool is_apart = false;
      for (std::size_t i = 0; i < 3; ++i)
        is_apart |=
            std::min(boxes[a][1][i], boxes[b][1][i]) - std::max(boxes[a][0][i], boxes[b][0][i]) <=
            kTouching;
      if (!is_apart) return false;
    }
  return true;
}

/// Volume of the box that two placed solids' boxes share [m^3], no more than either solid's.
Result<double> most_shared(const MadeSolid& a, const Pose& at, const Moments& of_a,
                           const MadeSolid& b, const Pose& bt, const Moments& of_b) {
  RMP_TRY_ASSIGN(const auto one, placed_box(a, at));
  RMP_TRY_ASSIGN(const auto other, placed_box(b, bt));
  double shared = 1;
  for (std::size_t i = 0; i < 3; ++i)
    shared *= std::max(0.0, std::min(one[1][i], other[1][i]) - std::max(one[0][i], other[0][i]));
  return std::min({shared, of_a.volume, of_b.volume});
}

/// Adds the mass of leaves that share one object with Overlap::once, in the order in which they
/// claim volume; `group` is put into that order. Leaves whose mass was measured have none of
/// their own, and are left out when they cannot be made.
Result<void> add_group(Solids& solids, const Snapshot& s, std::vector<const Leaf*>& group,
                       std::vector<Weighed>& parts, BodyMass& sum, Progress& progress) {
  // A material without density is a look only.
  const auto weighs = [&](const Leaf* l) {
    const auto* material = l->material ? s.get(l->material) : nullptr;
    return l->measured || (material && material->density > 0);
  };
  std::stable_partition(group.begin(), group.end(), weighs);
  std::vector<const Leaf*> made;
  std::vector<MadeSolid> shapes;
  std::vector<Moments> whole;
  for (const Leaf* l : group) {
    const auto both = [&]() -> Result<void> {
      RMP_TRY_ASSIGN(MadeSolid shape_of_leaf, solids.shape(s, l->solid, progress));
      RMP_TRY_ASSIGN(const Moments m,
                     solids.moments(shape_of_leaf, progress).in(s.describe(l->solid)));
      shapes.push_back(std::move(shape_of_leaf));
      whole.push_back(m);
      return {};
    }();
    if (!both.ok() && l->measured && both.error().code != ErrorCode::cancelled) {
      note(sum, "Its volume lacks a part: " + both.error().sentence());
      continue;
    }
    RMP_TRY(both);
    made.push_back(l);
  }
  group = made;
  // Meshes that are no clean solids cannot be cut: each counts in full, and what it may share with
  // others is part of the error.
  for (std::size_t i = 0; i < group.size(); ++i) {
    if (!shapes[i].engine.is_plain || !(whole[i].volume > 0)) continue;
    double shared = 0;
    for (std::size_t k = 0; k < group.size(); ++k) {
      if (k == i || (shapes[k].engine.is_plain && k > i)) continue;
      RMP_TRY_ASSIGN(const double most, most_shared(shapes[i], group[i]->placement, whole[i],
                                                    shapes[k], group[k]->placement, whole[k]));
      shared += most;
    }
    if (!(shared > 1e-6 * whole[i].volume)) continue;
    const double share = std::min(1.0, shared / whole[i].volume);
    whole[i].relative_error = std::min(1.0, whole[i].relative_error + share);
    note(sum, s.describe(group[i]->solid) + " is counted in full, since it cannot be cut: up to " +
                  text::print_rounded(100 * share, 3) + " % of it may be in other parts.");
  }
  // Parts of two engines: each by its own where they cannot overlap, else triangles throughout.
  const auto is_of_other_engine = [&](const MadeSolid& x) {
    const auto first = std::find_if(shapes.begin(), shapes.end(),
                                    [](const MadeSolid& y) { return !y.engine.is_plain; });
    return !x.engine.is_plain && x.engine.name != first->engine.name;
  };
  const bool is_mixed = std::any_of(shapes.begin(), shapes.end(), is_of_other_engine);
  const bool are_apart = is_mixed && engines_are_apart(shapes, group);
  if (is_mixed && !are_apart) {
    RMP_TRY_ASSIGN(const SolidEngine triangles, solids.mesh_engine());
    for (std::size_t i = 0; i < group.size(); ++i) {
      if (shapes[i].engine.name == triangles.name || shapes[i].engine.is_plain) continue;
      RMP_TRY_ASSIGN(const CsgTree tree, solids.tree_of(s, group[i]->solid, progress));
      std::string why = std::move(shapes[i].stand_in);
      RMP_TRY_ASSIGN(
          shapes[i],
          solids.shape_of_triangles(triangles, tree, progress).in(s.describe(group[i]->solid)));
      shapes[i].stand_in = std::move(why);
    }
  }
  std::vector<double> densities;
  for (std::size_t i = 0; i < group.size(); ++i) {
    const Leaf* l = group[i];
    const auto* material = l->material ? s.get(l->material) : nullptr;
    if (l->material && !material) return stale(s, l->material);
    densities.push_back(material && !l->measured ? material->density : 0);
    if (!material && !l->measured)
      note(sum, s.describe(l->solid) + " has no material, so it has no mass.");
    sum.area += whole[i].area;
    sum.exact = sum.exact && whole[i].exact && shapes[i].stand_in.empty();
    if (!shapes[i].stand_in.empty()) note(sum, s.describe(l->solid) + ": " + shapes[i].stand_in);
    for (const std::string& text : shapes[i].shape->notes())
      note(sum, s.describe(l->solid) + ": " + text);
  }
  const auto add = [&](std::size_t i, const Moments& m, const MassProperties& mass) {
    sum.volume += m.volume;
    sum.exact = sum.exact && m.exact;
    parts.push_back(
        {{group[i]->name, group[i]->solid, group[i]->material, densities[i], m.volume, mass},
         m.relative_error});
  };
  if (group.size() == 1) {
    add(0, whole[0],
        spatial::in_frame(spatial::mass_properties(whole[0], densities[0]), group[0]->placement));
    return {};
  }
  if (group.empty()) return {};
  std::vector<Pose> poses;
  for (const Leaf* l : group) poses.push_back(l->placement);
  std::map<std::string, std::vector<std::size_t>> by_engine;
  for (std::size_t i = 0; i < group.size(); ++i) by_engine[shapes[i].engine.name].push_back(i);
  std::vector<Moments> own = whole;
  std::vector<MassProperties> masses(group.size());
  for (const auto& [name, members] : by_engine) {
    if (members.size() == 1 || shapes[members.front()].engine.is_plain) {
      for (const std::size_t i : members)
        masses[i] = spatial::in_frame(spatial::mass_properties(whole[i], densities[i]), poses[i]);
      continue;
    }
    std::vector<MadeSolid> some;
    std::vector<Pose> where;
    for (const std::size_t i : members) {
      some.push_back(shapes[i]);
      where.push_back(poses[i]);
    }
    RMP_TRY_ASSIGN(const CsgEngine::Partition split, solids.partition(some, where, progress));
    sum.overlap += split.overlap;
    std::size_t measured = 0;
    for (std::size_t k = 0; k < members.size(); ++k) {
      if (split.parts[k].relative_error > 2 * whole[members[k]].relative_error) ++measured;
      own[members[k]] = split.parts[k];
      masses[members[k]] = spatial::mass_properties(split.parts[k], densities[members[k]]);
    }
    if (measured > 0)
      note(sum, "What " +
                    (measured == 1 ? "a part shares" : std::to_string(measured) + " parts share") +
                    " with others was not cut exactly, since faces nearly coincide or are "
                    "freeform; it was measured numerically, and relative_error bounds its error.");
  }
  for (std::size_t i = 0; i < group.size(); ++i) add(i, own[i], masses[i]);
  return {};
}

/// `listed` gets what each solid adds, in order of listing; a measured part's mass stands with its
/// first solid.
Result<BodyMass> mass_of(Solids& solids, const Snapshot& s, const std::vector<Leaf>& leaves,
                         const std::vector<MeasuredPart>& measured, Progress& progress,
                         std::vector<PartMass>* listed) {
  std::size_t groups = 0;
  for (const Leaf& l : leaves) groups = std::max(groups, l.group + 1);
  std::vector<std::vector<const Leaf*>> by_group(groups);
  for (const Leaf& l : leaves) by_group[l.group].push_back(&l);
  BodyMass sum;
  std::vector<Weighed> parts;
  std::vector<const Leaf*> order;
  for (auto& group : by_group) {
    if (group.empty()) continue;
    auto added = add_group(solids, s, group, parts, sum, progress);
    if (!added.ok()) return std::move(added).error();
    order.insert(order.end(), group.begin(), group.end());
  }
  std::vector<MassProperties> masses;
  double mass_error = 0, volume_error = 0;
  for (const Weighed& w : parts) {
    masses.push_back(w.part.mass);
    mass_error += w.relative_error * w.part.mass.mass;
    volume_error += w.relative_error * w.part.volume;
  }
  for (const MeasuredPart& m : measured) {
    masses.push_back(spatial::in_frame(m.measured.mass, m.placement));
    note(sum, s.describe(m.what) + " is included with its measured mass" +
                  (m.measured.source.empty() ? "." : " (" + m.measured.source + ")."));
  }
  sum.mass = spatial::combine(masses);
  if (!spatial::is_finite(sum.mass))
    return error(ErrorCode::invalid_argument, "its mass is beyond the range of real numbers",
                 "Check sizes and densities.");
  if (!sum.exact)
    sum.relative_error = sum.mass.mass > 0 ? mass_error / sum.mass.mass
                         : sum.volume > 0  ? volume_error / sum.volume
                                           : 0;
  if (listed) {
    // Groups and their weightless parts come in another order than the listing.
    std::vector<std::pair<const Leaf*, PartMass*>> by_leaf;
    for (std::size_t i = 0; i < parts.size(); ++i) by_leaf.emplace_back(order[i], &parts[i].part);
    std::sort(by_leaf.begin(), by_leaf.end());  // all leaves are elements of one vector
    std::set<std::size_t> told;
    for (const auto& [leaf, part] : by_leaf) {
      if (leaf->measured && told.insert(*leaf->measured).second)
        part->mass = spatial::in_frame(measured[*leaf->measured].measured.mass,
                                       measured[*leaf->measured].placement);
      listed->push_back(std::move(*part));
    }
  }
  return sum;
}

/// Without the measured mass of `id` itself.
Result<BodyMass> computed_mass(Solids& solids, const Snapshot& s, AnyId id, Progress& progress,
                               std::vector<PartMass>* listed) {
  std::vector<MeasuredPart> measured;
  RMP_TRY_ASSIGN(const std::vector<Leaf> leaves, leaves_of(s, id, measured));
  auto sum = mass_of(solids, s, leaves, measured, progress, listed);
  if (!sum.ok() && sum.error().where.empty()) return std::move(sum).error().in(s.describe(id));
  return sum;
}

}  // namespace

Result<BodyMass> parts_mass(Solids& solids, const Snapshot& s,
                            std::span<const model::BodyPart> parts, Progress& progress) {
  std::vector<MeasuredPart> measured;
  RMP_TRY_ASSIGN(const std::vector<Leaf> leaves, leaves_of(s, parts, measured));
  return mass_of(solids, s, leaves, measured, progress, nullptr);
}

Result<BodyMass> body_mass(Solids& solids, const Snapshot& s, AnyId id, Progress& progress,
                           std::vector<PartMass>* listed) {
  auto sum = computed_mass(solids, s, id, progress, listed);
  const Record* record = s.find(id);
  const auto* own = record ? measured_of(*record) : nullptr;
  if (!own || !own->has_value()) return sum;
  if (!sum.ok()) {
    if (sum.error().code == ErrorCode::cancelled) return sum;
    // What was measured does not need the shape.
    BodyMass only;
    note(only, "Its volume is unknown: " + sum.error().sentence());
    sum = std::move(only);
  } else {
    sum->computed = sum->mass;
  }
  sum->mass = (*own)->mass;
  sum->measured_source = (*own)->source;
  return sum;
}

}  // namespace robomosp::evaluation
