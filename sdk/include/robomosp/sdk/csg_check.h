// SPDX-License-Identifier: Apache-2.0
// What every CSG engine refuses, in the same words: trees that are none, placements that are no
// rigid motions, sizes out of range (layer: contract, std only). [any thread]
#pragma once

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/csg.h>
#include <robomosp/sdk/result.h>

namespace robomosp {

inline constexpr double kCsgSmallestLength = 1e-8;  ///< of a size that is not 0 [m]
inline constexpr double kCsgGreatestLength = 1e4;   ///< of sizes and placements [m]
inline constexpr double kCsgMostCount = 10'000;     ///< of sizes that are counts
inline constexpr double kCsgSmallestFactor = 1e-3;  ///< of a scale
inline constexpr double kCsgGreatestFactor = 1e3;   ///< of a scale
inline constexpr double kCsgScalesTogether = 1e6;   ///< of nested scales, in both directions

/// The children of each node in order: first_child[i], then next_sibling of that; 0 = none (the
/// root is nobody's child).
struct CsgLinks {
  std::vector<std::size_t> first_child, next_sibling;
};

/// `node 3 ("bore")`, or `node 3` without a name.
[[nodiscard]] inline std::string csg_node_text(const CsgNode& node, std::size_t index) {
  const std::string number = "node " + std::to_string(index);
  return node.name.empty() ? number : number + " (\"" + node.name + "\")";
}

/// Shortest decimal text that reads back to the same number, whatever the locale.
[[nodiscard]] inline std::string csg_number_text(double value) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value);
  return {text.data(), end.ptr};
}

/// `base_radius` as people read it.
[[nodiscard]] inline std::string csg_spaced(std::string_view name) {
  std::string text(name);
  std::replace(text.begin(), text.end(), '_', ' ');
  return text;
}

[[nodiscard]] constexpr bool is_csg_operation(CsgKind kind) {
  return csg_info(kind).children == CsgChildren::any;
}
[[nodiscard]] constexpr bool is_csg_modifier(CsgKind kind) {
  return csg_info(kind).children == CsgChildren::one;
}

/// Finite, orthonormal within the tolerance, determinant +1.
[[nodiscard]] inline bool is_rigid_motion(const Pose& pose, double tolerance) {
  const auto is_number = [](double x) { return std::isfinite(x); };
  const auto& R = pose.R;
  if (!std::all_of(R.begin(), R.end(), is_number)) return false;
  if (!std::all_of(pose.p.begin(), pose.p.end(), is_number)) return false;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = i; j < 3; ++j) {
      const double dot =
          R[3 * i] * R[3 * j] + R[3 * i + 1] * R[3 * j + 1] + R[3 * i + 2] * R[3 * j + 2];
      if (std::abs(dot - (i == j ? 1.0 : 0.0)) > tolerance) return false;
    }
  return R[0] * (R[4] * R[8] - R[5] * R[7]) - R[1] * (R[3] * R[8] - R[5] * R[6]) +
             R[2] * (R[3] * R[7] - R[4] * R[6]) >
         0;
}

/// Kind, sizes, profile and geometry of one node.
[[nodiscard]] inline Result<void> check_csg_node(const CsgNode& node, std::size_t index) {
  const auto bad = [&](std::string what) {
    return error(ErrorCode::invalid_argument, std::move(what), {}, csg_node_text(node, index));
  };
  const auto number = [](double x) { return csg_number_text(x); };
  const auto metres = [](double x) { return csg_number_text(x) + " m"; };
  const CsgNodeInfo& row = csg_info(node.kind);
  if (row.kind != node.kind)
    return bad("kind " + std::to_string(static_cast<int>(node.kind)) +
               " is neither an operation nor a primitive");
  if (node.kind == CsgKind::custom)
    return bad("a custom primitive has to be replaced by its parts before it is evaluated");
  const std::string kind = csg_spaced(row.name);
  for (std::size_t k = 0; k < csg_size_count(node.kind); ++k) {
    const CsgSize& about = row.sizes[k];
    const double size = node.sizes[k];
    const std::string name = kind + " " + csg_spaced(about.name);
    const std::string text =
        number(size) + (about.unit.empty() ? "" : " ") + std::string(about.unit);
    if (!std::isfinite(size)) return bad(name + " is not a number");
    if (about.range == CsgRange::not_negative && size < 0)
      return bad(name + " is " + text + "; it must not be negative");
    if (about.range == CsgRange::positive && size <= 0)
      return bad(name + " is " + text + "; it must be greater than 0");
    if (about.range == CsgRange::count &&
        (size != std::floor(size) || size < 1 || size > kCsgMostCount))
      return bad(name + " is " + text + "; it must be a whole number from 1 to " +
                 number(kCsgMostCount));
    if (about.unit != "m") continue;
    if (size != 0 && std::abs(size) < kCsgSmallestLength && about.range != CsgRange::any)
      return bad(name + " is " + text + "; the smallest length is " + metres(kCsgSmallestLength));
    if (std::abs(size) > kCsgGreatestLength)
      return bad(name + " is " + text + "; the greatest length is " + metres(kCsgGreatestLength));
  }
  const auto& s = node.sizes;
  const auto check_fillet = [&](double fillet, double smallest, const char* of) -> Result<void> {
    if (fillet < smallest / 2) return {};
    return bad(kind + " fillet is " + metres(fillet) + "; it must be less than half the smallest " +
               of + ", " + metres(smallest / 2));
  };
  const auto check_angle = [&](double angle) -> Result<void> {
    if (std::abs(angle) <= kCsgFullTurn * (1 + 1e-12)) return {};
    return bad(kind + " angle is " + number(angle) + " rad; it must be within one turn, " +
               number(kCsgFullTurn) + " rad");
  };
  switch (node.kind) {
    case CsgKind::box: return check_fillet(s[3], std::min({s[0], s[1], s[2]}), "side");
    case CsgKind::cylinder:
      return check_fillet(s[2], std::min(2 * s[0], s[1]), "of diameter and height");
    case CsgKind::cone:
      if (s[0] == 0 && s[1] == 0)
        return bad("cone base radius and top radius are both 0 m; one must be greater than 0");
      return {};
    case CsgKind::torus:
      if (s[1] >= s[0])
        return bad("torus tube radius is " + metres(s[1]) +
                   "; it must be less than the ring radius, " + metres(s[0]));
      return {};
    case CsgKind::wedge:
      if (s[3] > s[0])
        return bad("wedge top x is " + metres(s[3]) + "; it must not be greater than x, " +
                   metres(s[0]));
      return {};
    case CsgKind::pyramid:
      if (s[0] < 3) return bad("pyramid sides is " + number(s[0]) + "; it must be 3 or more");
      return {};
    case CsgKind::mirror:
      if (std::hypot(s[0], s[1], s[2]) < 1e-9)
        return bad("mirror normal is (0, 0, 0); it must not be zero");
      return {};
    case CsgKind::circular_pattern: return check_angle(s[1]);
    case CsgKind::scale:
      for (std::size_t k = 0; k < 3; ++k)
        if (!(s[k] >= kCsgSmallestFactor && s[k] <= kCsgGreatestFactor))
          return bad("scale " + std::string(row.sizes[k].name) + " is " + number(s[k]) +
                     "; it must be from " + number(kCsgSmallestFactor) + " to " +
                     number(kCsgGreatestFactor));
      return {};
    case CsgKind::prism:
    case CsgKind::revolution:
      if (!node.profile) return bad(kind + " has no profile");
      return node.kind == CsgKind::revolution ? check_angle(s[0]) : Result<void>();
    case CsgKind::imported:
      if (!node.geometry) return bad("the imported solid has no geometry");
      return {};
    default: return {};
  }
}

/// The whole tree: parents first, operations with children, modifiers with one, primitives with
/// none, placements with rotations orthonormal within `rotation_tolerance`, and
/// check_csg_node() of every node. What an engine cannot make is for it to refuse.
[[nodiscard]] inline Result<CsgLinks> check_csg_tree(const CsgTree& tree,
                                                     double rotation_tolerance = 1e-6) {
  const auto& nodes = tree.nodes;
  if (nodes.empty())
    return error(ErrorCode::invalid_argument, "the tree has no nodes",
                 "Give at least one primitive.");
  CsgLinks links{std::vector<std::size_t>(nodes.size()), std::vector<std::size_t>(nodes.size())};
  std::vector<std::size_t> last_child(nodes.size());
  struct Stretch {
    double least = 1, greatest = 1;  // products of the factors above a node and its own
  };
  std::vector<Stretch> stretch(nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const CsgNode& node = nodes[i];
    const auto bad = [&](std::string what) {
      return error(ErrorCode::invalid_argument, std::move(what), {}, csg_node_text(node, i));
    };
    if (i == 0 && node.parent != -1)
      return bad("parent is " + std::to_string(node.parent) +
                 "; the first node is the root and its parent must be -1");
    if (i > 0) {
      if (node.parent < 0 || static_cast<std::size_t>(node.parent) >= i)
        return bad("parent is " + std::to_string(node.parent) +
                   "; it must be the index of an earlier node (0.." + std::to_string(i - 1) + ")");
      const auto p = static_cast<std::size_t>(node.parent);
      const std::string parent = "parent " + csg_node_text(nodes[p], p);
      if (!is_csg_operation(nodes[p].kind) && !is_csg_modifier(nodes[p].kind))
        return bad(parent + " is a primitive; only operations and modifiers have children");
      if (is_csg_modifier(nodes[p].kind) && links.first_child[p] != 0)
        return bad(parent + " has a child already; put both into a union to modify them together");
      (links.first_child[p] == 0 ? links.first_child[p] : links.next_sibling[last_child[p]]) = i;
      last_child[p] = i;
    }
    if (!is_rigid_motion(node.placement, rotation_tolerance))
      return bad(
          "placement is not a rigid motion; its rotation must be orthonormal with determinant "
          "+1 and all its numbers finite");
    for (const double x : node.placement.p)
      if (std::abs(x) > kCsgGreatestLength)
        return bad("placement is " + csg_number_text(x) + " m away; it must be within " +
                   csg_number_text(kCsgGreatestLength) + " m");
    RMP_TRY(check_csg_node(node, i));
    if (i > 0) stretch[i] = stretch[static_cast<std::size_t>(node.parent)];
    if (node.kind != CsgKind::scale) continue;
    const auto [least, greatest] = std::minmax({node.sizes[0], node.sizes[1], node.sizes[2]});
    stretch[i] = {stretch[i].least * least, stretch[i].greatest * greatest};
    if (stretch[i].least < 1 / kCsgScalesTogether * (1 - 1e-9) ||
        stretch[i].greatest > kCsgScalesTogether * (1 + 1e-9))
      return bad("the nested scales multiply to " +
                 csg_number_text(stretch[i].greatest > kCsgScalesTogether ? stretch[i].greatest
                                                                          : stretch[i].least) +
                 "; they must stay between 1e-6 and 1e6");
  }
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (links.first_child[i] != 0) continue;
    if (is_csg_operation(nodes[i].kind))
      return error(ErrorCode::invalid_argument,
                   "operation has no children; it needs at least one solid", {},
                   csg_node_text(nodes[i], i));
    if (is_csg_modifier(nodes[i].kind))
      return error(ErrorCode::invalid_argument,
                   "modifier has no children; it needs one solid to work on", {},
                   csg_node_text(nodes[i], i));
  }
  return links;
}

}  // namespace robomosp
