// SPDX-License-Identifier: GPL-3.0-or-later
#include "mesh_boolean.h"

#include <algorithm>
#include <cstdlib>
#include <deque>
#include <numeric>
#include <string_view>
#include <unordered_map>

#include "exact_corners.h"
#include "local_boolean.h"
#include "whole_boolean.h"

namespace robomosp::csg_cgal {
namespace {

/// Relative; volumes are summed in double.
constexpr double kVolumeSlack = 1e-9;
/// How far, by its size, a solid is moved whose touching another in an edge or corner leaves no
/// closed surface.
constexpr double kNudge = 1e-9;

/// What the operation must keep between: a surface that cuts itself shows here.
bool is_plausible(CsgKind kind, double a, double b, double got) {
  const double slack = kVolumeSlack * (a + b);
  switch (kind) {
    case CsgKind::union_: return got >= std::max(a, b) - slack && got <= a + b + slack;
    case CsgKind::difference: return got >= a - b - slack && got <= a + slack;
    default: return got >= -slack && got <= std::min(a, b) + slack;
  }
}

/// ROBOMOSP_CSG_TRIANGLES=whole: every operation looks at both solids from end to end;
/// =near: none does, for the tests. Otherwise only those that cannot be decided near the cut.
std::string_view wanted_way() {
  const char* said = std::getenv("ROBOMOSP_CSG_TRIANGLES");
  return said ? said : "";
}

/// One operation on two solids as they lie; nothing when its result is no closed surface.
std::optional<ExactSolid> try_boolean(CsgKind kind, const ExactSolid& a, const ExactSolid& b,
                                      const Progress& progress) {
  const auto checked = [&](std::optional<ExactSolid> solid) {
    if (solid && !is_plausible(kind, a.volume(), b.volume(), solid->volume())) solid.reset();
    return solid;
  };
  const std::string_view way = wanted_way();
  if (way != "whole") {
    LocalOutcome near = local_boolean(kind, a, b, progress);
    auto solid = checked(std::move(near.solid));
    if (solid || near.state == LocalOutcome::State::touches || way == "near") return solid;
  }
  return checked(whole_boolean(kind, a, b, progress));
}

Result<BooleanOutcome> boolean(CsgKind kind, const ExactSolid& a, const ExactSolid& b,
                               const Progress& progress) {
  stop_if_cancelled(progress);
  if (auto solid = try_boolean(kind, a, b, progress)) return BooleanOutcome{*solid, ""};
  // Solids that touch in a line or a point: a hair's breadth aside they do or do not.
  const double size = std::max(a.box().diagonal(), b.box().diagonal());
  for (const Vec3& way : {Vec3{0.5345, 0.8018, 0.2673}, Vec3{-0.6350, 0.2540, 0.7295},
                          Vec3{0.1826, -0.5477, -0.8165}}) {
    stop_if_cancelled(progress);
    Affine nudge;
    nudge.t = snapped(way * (kNudge * size));
    if (auto solid = try_boolean(kind, a, b.moved(nudge, 0), progress))
      return BooleanOutcome{*solid, "solids that only touch were moved by " +
                                        millimetres_text(kNudge * size) +
                                        " to get a closed result"};
  }
  return error(ErrorCode::plugin_failed, "the triangles could not be joined into a closed surface",
               "Faces or edges that only touch are the usual cause: move an operand slightly.");
}

/// Solids that have nothing in common side by side.
ExactSolid joined_solids(const std::vector<ExactSolid>& solids) {
  if (solids.size() == 1) return solids.front();
  auto all = std::make_shared<ExactSolid::Impl>();
  const bool is_plain = std::all_of(solids.begin(), solids.end(),
                                    [](const ExactSolid& s) { return s.impl().names.empty(); });
  for (const ExactSolid& solid : solids) {
    const auto& from = solid.impl();
    PatchMesh& mesh = all->mesh;
    const auto corners = static_cast<std::uint32_t>(mesh.points.size()),
               patches = static_cast<std::uint32_t>(mesh.patches.size()),
               sources = static_cast<std::uint32_t>(all->sources.size());
    mesh.points.insert(mesh.points.end(), from.mesh.points.begin(), from.mesh.points.end());
    mesh.patches.insert(mesh.patches.end(), from.mesh.patches.begin(), from.mesh.patches.end());
    for (const Triangle& t : from.mesh.triangles)
      mesh.triangles.push_back({t[0] + corners, t[1] + corners, t[2] + corners});
    for (const std::uint32_t p : from.mesh.patch_of) mesh.patch_of.push_back(p + patches);
    all->sources.insert(all->sources.end(), from.sources.begin(), from.sources.end());
    all->slack = std::max(all->slack, from.slack);
    if (is_plain) continue;
    for (CornerName name : from.names) {
      if (name.source != CornerName::kPlain) name.source += sources;
      all->names.push_back(name);
    }
    all->names.resize(mesh.points.size());
  }
  all->measure();
  return ExactSolid(std::move(all));
}

/// Groups of solids whose boxes hang together, each in the order given.
std::vector<std::vector<ExactSolid>> clusters(std::vector<ExactSolid> solids) {
  std::vector<std::size_t> order(solids.size()), parent(solids.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::iota(parent.begin(), parent.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return solids[a].box().low[0] < solids[b].box().low[0];
  });
  const auto root = [&](std::size_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  for (std::size_t i = 0; i < order.size(); ++i)
    for (std::size_t j = i + 1; j < order.size(); ++j) {
      const Box3 &a = solids[order[i]].box(), &b = solids[order[j]].box();
      if (b.low[0] > a.high[0]) break;
      if (a.meets(b)) {
        const std::size_t x = root(order[i]), y = root(order[j]);
        parent[std::max(x, y)] = std::min(x, y);
      }
    }
  std::vector<std::vector<ExactSolid>> groups;
  std::unordered_map<std::size_t, std::size_t> group_of;
  for (std::size_t i = 0; i < solids.size(); ++i) {
    const auto [at, is_new] = group_of.try_emplace(root(i), groups.size());
    if (is_new) groups.emplace_back();
    groups[at->second].push_back(std::move(solids[i]));
  }
  return groups;
}

}  // namespace

Result<BooleanOutcome> unite(std::vector<ExactSolid> solids, Progress& progress) {
  std::string remedy;
  std::vector<ExactSolid> apart;
  for (auto& group : clusters(std::move(solids))) {
    // Pairs, then pairs of pairs: no triangle takes part in more than log n operations.
    std::deque<ExactSolid> open(group.begin(), group.end());
    while (open.size() > 1) {
      RMP_TRY_ASSIGN(BooleanOutcome two, boolean(CsgKind::union_, open[0], open[1], progress));
      if (!two.remedy.empty()) remedy = two.remedy;
      open.erase(open.begin(), open.begin() + 2);
      open.push_back(std::move(two.solid));
    }
    apart.push_back(std::move(open.front()));
  }
  return BooleanOutcome{joined_solids(apart), std::move(remedy)};
}

Result<BooleanOutcome> subtract(const ExactSolid& solid, std::vector<ExactSolid> tools,
                                Progress& progress) {
  if (tools.empty()) return BooleanOutcome{solid, ""};
  auto tool = unite(tools, progress);
  if (tool.ok()) {
    auto cut = boolean(CsgKind::difference, solid, tool->solid, progress);
    if (cut.ok() && cut->remedy.empty()) cut->remedy = tool->remedy;
    if (cut.ok() || tools.size() == 1) return cut;
  }
  // Tools that cannot be one: one after another.
  BooleanOutcome rest{solid, ""};
  for (const ExactSolid& t : tools) {
    if (rest.solid.empty()) break;
    RMP_TRY_ASSIGN(BooleanOutcome next, boolean(CsgKind::difference, rest.solid, t, progress));
    if (next.remedy.empty()) next.remedy = std::move(rest.remedy);
    rest = std::move(next);
  }
  return rest;
}

Result<BooleanOutcome> intersect(std::vector<ExactSolid> solids, Progress& progress) {
  BooleanOutcome rest{solids.front(), ""};
  for (std::size_t i = 1; i < solids.size() && !rest.solid.empty(); ++i) {
    RMP_TRY_ASSIGN(BooleanOutcome next,
                   boolean(CsgKind::intersection, rest.solid, solids[i], progress));
    if (next.remedy.empty()) next.remedy = std::move(rest.remedy);
    rest = std::move(next);
  }
  return rest;
}

}  // namespace robomosp::csg_cgal
