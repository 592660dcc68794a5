// SPDX-License-Identifier: Apache-2.0
// Structural edits of a solid's flat tree that preserve names, order, placements and expressions
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

/// A separate subtree: parents are indices within it, -1 = its top (node 0). `expressions` by path,
/// as in Parametric.
struct Branch {
  std::vector<SolidNode> nodes;
  std::map<std::string, std::string> expressions;
};

/// The index of the size that is the height of a primitive with its base at z = 0; empty for other
/// kinds. Such nodes may be centred.
[[nodiscard]] std::optional<std::size_t> height_of(CsgKind);
/// node_T_body of a primitive as the engines build it: the identity, or half the height down if the
/// node is centred.
[[nodiscard]] Pose node_T_body(const SolidNode&);

[[nodiscard]] std::optional<std::size_t> find_node(const Solid&, std::string_view name);
/// One past the last node of the subtree at `i`.
[[nodiscard]] std::size_t subtree_end(const Solid&, std::size_t i);
/// Indices of the children of `i`, in order.
[[nodiscard]] std::vector<std::size_t> children_of(const Solid&, std::size_t i);
/// Pose of the node in the solid, with all placements above it applied; patterns and mirrors are
/// ignored.
[[nodiscard]] Pose solid_T_node(const Solid&, std::size_t i);
/// Sets the placement so that the node has the pose `t` in the solid, in its frame (parent or
/// global) and representation of angles. Numbers that already match are kept.
void place_node(Solid&, std::size_t i, const Pose& t);
/// A name like `wanted` that is free in the solid: "bore", "bore_2", ...
[[nodiscard]] std::string free_node_name(const Solid&, std::string_view wanted);

/// A copy of the subtree at `i` with its expressions.
[[nodiscard]] Branch copy_branch(const Solid&, std::size_t i);
/// Renames nodes with names that exist in the solid, and updates their expressions.
void make_names_free(const Solid&, Branch&);
/// Inserts a branch before index `at` below `parent`; its names must be free.
void insert_branch(Solid&, std::size_t at, std::int32_t parent, Branch);
/// Removes the subtree at `i` with its expressions.
Branch take_branch(Solid&, std::size_t i);

}  // namespace robomosp::model
