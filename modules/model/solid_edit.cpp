// SPDX-License-Identifier: Apache-2.0
#include "model/solid_edit.h"

#include <cmath>
#include <set>
#include <unordered_map>
#include <utility>

#include "model/placement.h"
#include "spatial/pose.h"

namespace robomosp::model {

namespace {

/// The node that an expression's path begins with. Names may hold dots: the longest fits.
const SolidNode* owner_of(const std::vector<SolidNode>& nodes, std::string_view path) {
  const SolidNode* found = nullptr;
  for (const SolidNode& n : nodes)
    if (path.size() > n.name.size() && path[n.name.size()] == '.' && path.starts_with(n.name) &&
        (!found || n.name.size() > found->name.size()))
      found = &n;
  return found;
}

/// Far below what can be seen, far above what composing poses rounds [m, 1].
constexpr double kSamePlace = 1e-12;

bool is_same(const Pose& a, const Pose& b) {
  double off = 0;
  for (std::size_t i = 0; i < 9; ++i) off = std::fmax(off, std::fabs(a.R[i] - b.R[i]));
  for (std::size_t i = 0; i < 3; ++i) off = std::fmax(off, std::fabs(a.p[i] - b.p[i]));
  return off <= kSamePlace;
}

std::string numbered(std::string_view wanted, const std::set<std::string, std::less<>>& taken) {
  if (!taken.contains(wanted)) return std::string(wanted);
  for (int k = 2;; ++k)
    if (std::string name = std::string(wanted) + "_" + std::to_string(k); !taken.contains(name))
      return name;
}

std::set<std::string, std::less<>> names_of(const std::vector<SolidNode>& nodes) {
  std::set<std::string, std::less<>> names;
  for (const SolidNode& n : nodes) names.insert(n.name);
  return names;
}

}  // namespace

std::optional<std::size_t> find_node(const Solid& s, std::string_view name) {
  for (std::size_t i = 0; i < s.nodes.size(); ++i)
    if (s.nodes[i].name == name) return i;
  return std::nullopt;
}

std::size_t subtree_end(const Solid& s, std::size_t i) {
  std::size_t end = i + 1;
  while (end < s.nodes.size() && s.nodes[end].parent >= static_cast<std::int32_t>(i)) ++end;
  return end;
}

std::optional<std::size_t> height_of(CsgKind kind) {
  switch (kind) {
    case CsgKind::box:
    case CsgKind::wedge: return 2;
    case CsgKind::cylinder: return 1;
    case CsgKind::cone: return 2;
    case CsgKind::frustum: return 4;
    case CsgKind::pyramid: return 3;
    case CsgKind::prism: return 0;
    default: return std::nullopt;
  }
}

Pose node_T_body(const SolidNode& n) {
  const auto height = height_of(n.kind);
  return n.is_centred && height ? spatial::translation({0, 0, -0.5 * n.sizes[*height]}) : Pose{};
}

std::vector<std::size_t> children_of(const Solid& s, std::size_t i) {
  std::vector<std::size_t> out;
  const std::size_t end = subtree_end(s, i);
  for (std::size_t k = i + 1; k < end; k = subtree_end(s, k)) out.push_back(k);
  return out;
}

Pose solid_T_node(const Solid& s, std::size_t i) {
  Pose t;
  for (auto k = static_cast<std::int32_t>(i); k >= 0;) {
    const SolidNode& n = s.nodes[static_cast<std::size_t>(k)];
    t = spatial::compose(pose(n.placement), t);
    if (n.is_global) break;
    k = n.parent;
  }
  return t;
}

void place_node(Solid& s, std::size_t i, const Pose& t) {
  if (is_same(solid_T_node(s, i), t)) return;
  SolidNode& n = s.nodes[i];
  Pose frame;
  if (!n.is_global && n.parent >= 0) frame = solid_T_node(s, static_cast<std::size_t>(n.parent));
  n.placement = placement(spatial::compose(spatial::inverse(frame), t), n.placement.notation);
}

std::string free_node_name(const Solid& s, std::string_view wanted) {
  return numbered(wanted, names_of(s.nodes));
}

Branch copy_branch(const Solid& s, std::size_t i) {
  Branch b;
  const auto first = static_cast<std::ptrdiff_t>(i);
  b.nodes.assign(s.nodes.begin() + first,
                 s.nodes.begin() + static_cast<std::ptrdiff_t>(subtree_end(s, i)));
  for (SolidNode& n : b.nodes) n.parent -= static_cast<std::int32_t>(i);
  b.nodes[0].parent = -1;
  const auto names = names_of(b.nodes);
  for (const auto& [path, text] : s.parametric.expressions)
    if (const SolidNode* owner = owner_of(s.nodes, path); owner && names.contains(owner->name))
      b.expressions.emplace(path, text);
  return b;
}

void make_names_free(const Solid& s, Branch& b) {
  auto taken = names_of(s.nodes);
  std::unordered_map<std::string, std::string> renamed;
  std::vector<SolidNode> before = b.nodes;
  for (SolidNode& n : b.nodes) {
    std::string name = numbered(n.name, taken);
    taken.insert(name);
    renamed.emplace(n.name, name);
    n.name = std::move(name);
  }
  std::map<std::string, std::string> expressions;
  for (auto& [path, text] : b.expressions) {
    const SolidNode* owner = owner_of(before, path);
    if (!owner) continue;
    expressions.emplace(renamed.at(owner->name) + path.substr(owner->name.size()), std::move(text));
  }
  b.expressions = std::move(expressions);
}

void insert_branch(Solid& s, std::size_t at, std::int32_t parent, Branch b) {
  const auto shift = static_cast<std::int32_t>(b.nodes.size());
  const auto first = static_cast<std::int32_t>(at);
  for (SolidNode& n : s.nodes)
    if (n.parent >= first) n.parent += shift;
  for (SolidNode& n : b.nodes) n.parent = n.parent < 0 ? parent : n.parent + first;
  s.nodes.insert(s.nodes.begin() + first, std::make_move_iterator(b.nodes.begin()),
                 std::make_move_iterator(b.nodes.end()));
  for (auto& [path, text] : b.expressions)
    s.parametric.expressions.insert_or_assign(path, std::move(text));
}

Branch take_branch(Solid& s, std::size_t i) {
  Branch b = copy_branch(s, i);
  for (const auto& [path, text] : b.expressions) s.parametric.expressions.erase(path);
  const std::size_t end = subtree_end(s, i);
  s.nodes.erase(s.nodes.begin() + static_cast<std::ptrdiff_t>(i),
                s.nodes.begin() + static_cast<std::ptrdiff_t>(end));
  const auto gone = static_cast<std::int32_t>(end - i);
  for (SolidNode& n : s.nodes)
    if (n.parent >= static_cast<std::int32_t>(end)) n.parent -= gone;
  return b;
}

}  // namespace robomosp::model
