// SPDX-License-Identifier: Apache-2.0
// Structural edits of a solid's flat tree that keep names, order, places and expressions right
// (layer: data processing, model). Nodes are in pre-order: a subtree is contiguous. [any thread]
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "model/records.h"

namespace robomosp::model {

/// A subtree on its own: parents count within it, -1 = its top (node 0). `expressions` by path, as
/// in Parametric.
struct Branch {
  std::vector<SolidNode> nodes;
  std::map<std::string, std::string> expressions;
};

/// The number among a node's sizes that is the height of a primitive that stands on z = 0; none of
/// other kinds. Such nodes may be centred.
[[nodiscard]] std::optional<std::size_t> height_of(CsgKind);
/// node_T_body of a primitive as the engines make it: the identity, or half the height down where
/// the node is centred.
[[nodiscard]] Pose node_T_body(const SolidNode&);

[[nodiscard]] std::optional<std::size_t> find_node(const Solid&, std::string_view name);
/// One past the last node of the subtree at `i`.
[[nodiscard]] std::size_t subtree_end(const Solid&, std::size_t i);
/// Indices of the nodes right below `i`, in order.
[[nodiscard]] std::vector<std::size_t> children_of(const Solid&, std::size_t i);
/// Where the node stands in the solid, all placements above it applied; patterns and mirrors are
/// not counted.
[[nodiscard]] Pose solid_T_node(const Solid&, std::size_t i);
/// Writes the placement so that the node stands at `t` in the solid, in its own frame (parent or
/// global) and notation of angles. Numbers that say so already stay as they are.
void place_node(Solid&, std::size_t i, const Pose& t);
/// A name like `wanted` that no node of the solid has: "bore", "bore_2", ...
[[nodiscard]] std::string free_node_name(const Solid&, std::string_view wanted);

/// A copy of the subtree at `i` with its expressions.
[[nodiscard]] Branch copy_branch(const Solid&, std::size_t i);
/// Renames nodes whose names the solid has already, their expressions with them.
void make_names_free(const Solid&, Branch&);
/// Puts a branch in front of index `at` below `parent`; its names must be free.
void insert_branch(Solid&, std::size_t at, std::int32_t parent, Branch);
/// Takes the subtree at `i` out, its expressions too.
Branch take_branch(Solid&, std::size_t i);

}  // namespace robomosp::model
