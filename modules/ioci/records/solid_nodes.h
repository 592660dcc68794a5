// SPDX-License-Identifier: Apache-2.0
// Nodes of solids as the tables that commands accept and return (layer: application, ioci only).
#pragma once

#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "ioci/core/commands.h"
#include "kernel/fresh_names.h"
#include "model/solid_edit.h"

namespace robomosp::ioci {

/// Words of kinds, all or those that hold other nodes.
[[nodiscard]] std::vector<std::string> kind_words(bool with_primitives = true);
[[nodiscard]] std::string word_of(CsgKind kind);
[[nodiscard]] inline bool is_primitive(CsgKind kind) {
  return csg_info(kind).children == CsgChildren::none;
}

/// The flat form of a nested table: parents first, children in order, with names not in `taken`,
/// and the expressions given for its numbers.
[[nodiscard]] Result<model::Branch> read_tree(CommandContext& ctx, const Value& root,
                                              FreshNames taken, std::string_view path);
/// The flat form of a flat list, as record.describe gives it: each node is a table with the name of
/// its `parent`, which comes before it; the first is the root.
[[nodiscard]] Result<model::Branch> read_flat_nodes(CommandContext& ctx, const List& nodes,
                                                    const std::string& path);
/// One node of a kind that is known, without children; `fields` are those of its table.
[[nodiscard]] Result<model::Branch> read_operation(CommandContext& ctx, CsgKind kind,
                                                   const Map& fields, FreshNames taken,
                                                   std::string_view path);
/// Sets a field of a node: a size, "name", "kind", "frame", "select", "profile", "primitive" or one
/// of a placement. Expressions given for it wait in the context.
Result<void> set_node_field(CommandContext& ctx, model::Solid& s, std::size_t node,
                            std::string_view field, const Value& value, const std::string& path);

/// The value for a node's field `primitive`, or `primitive.teeth`, with expressions among the
/// parameters that its provider declares as quantities or counts replaced by numbers. The
/// expressions are kept in the context under `prefix`, the path of `primitive`.
Result<Value> read_primitive(CommandContext& ctx, const Value& value, const std::string& prefix,
                             const std::string& path);
Result<Value> read_primitive_param(CommandContext& ctx, const model::SolidNode& node,
                                   const std::string& param, const Value& value,
                                   const std::string& path);

/// The table of a node without its children, as read_tree() takes it; `solid` is the name of the
/// record.
[[nodiscard]] Map node_map(const model::Solid& s, std::size_t node, const std::string& solid);

/// A profile from a list of loops or a short form; `into` receives the expressions of its
/// coordinates as "profile.1.2.x".
[[nodiscard]] Result<std::shared_ptr<const CsgProfile>> read_profile(CommandContext& ctx,
                                                                     const Value& value,
                                                                     const std::string& path);
[[nodiscard]] Value profile_value(const CsgProfile& profile);
/// Help text on the notation of profiles.
[[nodiscard]] std::string profile_help();

[[nodiscard]] std::set<std::string> node_names(const model::Solid& s);
/// Index of a node by name; the error lists similar names.
[[nodiscard]] Result<std::size_t> need_node(const model::Solid& s, std::string_view name);

}  // namespace robomosp::ioci
