// SPDX-License-Identifier: Apache-2.0
#include "evaluation/csg_tree.h"

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <robomosp/sdk/csg_primitive.h>

#include "kernel/schema.h"
#include "kernel/text.h"
#include "model/placement.h"
#include "model/solid_edit.h"
#include "spatial/pose.h"

namespace robomosp::evaluation {
namespace {

using text::quote;

constexpr std::size_t kMostNodes = 100'000;  ///< of a plugin's primitive

Value value_of(const model::ProviderChoice::Param& param) {
  return std::visit(
      [](const auto& v) -> Value {
        if constexpr (std::is_same_v<std::decay_t<decltype(v)>, std::vector<double>>)
          return NumericArray(v);
        else return v;
      },
      param);
}

std::string node_text(const model::SolidNode& node) { return "node " + quote(node.name); }

/// A sentence about what is wrong with a tree a plugin built, or "".
std::string tree_fault(const CsgTree& tree) {
  if (tree.nodes.empty()) return "built a tree without nodes";
  if (tree.nodes.size() > kMostNodes)
    return "built a tree of more than " + std::to_string(kMostNodes) + " nodes";
  for (std::size_t i = 0; i < tree.nodes.size(); ++i) {
    const CsgNode& n = tree.nodes[i];
    const std::string which = "built a tree in which node " + std::to_string(i);
    if (csg_info(n.kind).kind != n.kind || n.kind == CsgKind::custom)
      return which + " has a kind unknown to all engines";
    if (i == 0 ? n.parent != -1 : n.parent < 0 || static_cast<std::size_t>(n.parent) >= i)
      return which + " has the parent " + std::to_string(n.parent);
    if (!spatial::is_rigid(n.placement))
      return which + " has a placement that is not a rigid motion";
    for (const double size : n.sizes)
      if (!std::isfinite(size)) return which + " has a size that is not a finite number";
  }
  return "";
}

void feed(Fingerprinter& fp, const CsgProfile& profile) {
  fp.add(profile.loops.size());
  for (const CsgLoop& loop : profile.loops) {
    fp.add(std::span<const double>(loop.start)).add(loop.curves.size());
    for (const CsgCurve& c : loop.curves) {
      fp.add(static_cast<int>(c.kind)).add(c.points.size());
      for (const auto& p : c.points) fp.add(std::span<const double>(p));
    }
  }
}

}  // namespace

void feed(Fingerprinter& fp, const Pose& t) {
  fp.add(std::span<const double>(t.R)).add(std::span<const double>(t.p));
}

void feed(Fingerprinter& fp, const CsgTree& tree) {
  fp.add(tree.nodes.size());
  for (const CsgNode& n : tree.nodes) {
    fp.add(static_cast<int>(n.kind))
        .add(static_cast<int>(n.parent))
        .add(std::span<const double>(n.sizes))
        .add(std::string_view(n.select));
    fp.add(n.profile != nullptr).add(n.geometry != nullptr);
    if (n.profile) feed(fp, *n.profile);
    if (n.geometry)
      fp.add(static_cast<std::int64_t>(n.geometry->digest[0]))
          .add(static_cast<std::int64_t>(n.geometry->digest[1]));
    feed(fp, n.placement);
  }
}

Result<CsgTree> tree_of(const model::Solid& solid, const Expand& expand) {
  CsgTree tree;
  tree.nodes.reserve(solid.nodes.size());
  std::vector<Pose> solid_T_node;        // of the solid's own nodes
  std::vector<std::int32_t> first_node;  // of each of them in the tree
  for (const model::SolidNode& n : solid.nodes) {
    const bool has_parent = n.parent >= 0;
    const auto parent = static_cast<std::size_t>(has_parent ? n.parent : 0);
    const Pose outer = has_parent ? solid_T_node[parent] : Pose{};
    Pose placement = model::pose(n.placement);
    solid_T_node.push_back(n.is_global ? placement : spatial::compose(outer, placement));
    if (n.is_global && has_parent) placement = spatial::compose(spatial::inverse(outer), placement);
    const auto at = static_cast<std::int32_t>(tree.nodes.size());
    const std::int32_t parent_node = has_parent ? first_node[parent] : -1;
    first_node.push_back(at);
    if (n.kind != CsgKind::custom) {
      if (n.is_centred) placement = spatial::compose(placement, model::node_T_body(n));
      tree.nodes.push_back(
          {n.kind, parent_node, placement, n.sizes, n.name, n.profile, n.geometry, n.select});
      continue;
    }
    auto made = expand(n);
    if (!made.ok()) {
      if (made.error().code == ErrorCode::cancelled) return std::move(made).error();
      return std::move(made).error().in(node_text(n));
    }
    for (std::size_t i = 0; i < (*made)->nodes.size(); ++i) {
      CsgNode inner = (*made)->nodes[i];
      inner.parent = i == 0 ? parent_node : inner.parent + at;
      if (i == 0) inner.placement = spatial::compose(placement, inner.placement);
      inner.name = inner.name.empty() ? n.name : n.name + "." + inner.name;
      tree.nodes.push_back(std::move(inner));
    }
  }
  return tree;
}

Result<CsgTree> built_primitive(const Registry& registry, const ProviderInfo& provider,
                                const model::ProviderChoice& choice, Progress& progress) {
  Map given;
  for (const auto& [name, param] : choice.params) given.set(name, value_of(param));
  const std::string who = "primitive " + quote(provider.name);
  RMP_TRY_ASSIGN(Map checked, check(provider.schema, given).in(who));
  const auto params = make_params(std::move(checked));
  RMP_TRY_ASSIGN(const auto primitive, registry.create<CsgPrimitive>(provider.name));
  auto tree = guarded(provider.name, [&] { return primitive->build(*params, progress); });
  if (!tree.ok())
    return tree.error().code == ErrorCode::cancelled ? std::move(tree) : std::move(tree).in(who);
  if (const std::string fault = tree_fault(*tree); !fault.empty())
    return error(ErrorCode::plugin_failed, "provider " + quote(provider.name) + " " + fault,
                 "Report it to the provider's author.");
  return tree;
}

Branch branch_of(const CsgTree& tree, std::size_t top) {
  Branch branch;
  std::vector<std::int32_t> number(tree.nodes.size(), -1);
  for (std::size_t i = top; i < tree.nodes.size(); ++i) {
    const auto parent = tree.nodes[i].parent;
    if (i != top && (parent < 0 || number[static_cast<std::size_t>(parent)] < 0)) continue;
    number[i] = static_cast<std::int32_t>(branch.tree.nodes.size());
    CsgNode node = tree.nodes[i];
    node.parent = i == top ? -1 : number[static_cast<std::size_t>(parent)];
    if (i == top) node.placement = {};
    branch.tree.nodes.push_back(std::move(node));
  }
  for (auto i = static_cast<std::int32_t>(top); i >= 0;
       i = tree.nodes[static_cast<std::size_t>(i)].parent)
    branch.placement =
        spatial::compose(tree.nodes[static_cast<std::size_t>(i)].placement, branch.placement);
  return branch;
}

std::vector<std::size_t> children_of(const CsgTree& tree, std::size_t node) {
  std::vector<std::size_t> children;
  for (std::size_t i = node + 1; i < tree.nodes.size(); ++i)
    if (tree.nodes[i].parent == static_cast<std::int32_t>(node)) children.push_back(i);
  return children;
}

}  // namespace robomosp::evaluation
