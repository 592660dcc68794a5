// SPDX-License-Identifier: Apache-2.0
// From a solid's nodes to the tree that CSG engines see: placements resolved, plugins' primitives
// spliced in (layer: application). Internal to modules/evaluation. [any thread]
#pragma once

#include <functional>
#include <memory>

#include <robomosp/sdk/csg.h>
#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

#include "kernel/fingerprint.h"
#include "kernel/registry.h"
#include "model/records.h"

namespace robomosp::evaluation {

/// The tree of a custom node's primitive, such as from a cache.
using Expand = std::function<Result<std::shared_ptr<const CsgTree>>(const model::SolidNode&)>;

/// Parents first, parent_T_node everywhere, no custom nodes. Errors name the node.
[[nodiscard]] Result<CsgTree> tree_of(const model::Solid& solid, const Expand& expand);

/// Builds a custom node's tree by its provider, after checking the parameters against the
/// provider's table, and checks the result.
[[nodiscard]] Result<CsgTree> built_primitive(const Registry& registry,
                                              const ProviderInfo& provider,
                                              const model::ProviderChoice& choice,
                                              Progress& progress);

/// `top` and the nodes below, without the placement of `top`, and solid_T_top.
struct Branch {
  CsgTree tree;
  Pose placement;
};
[[nodiscard]] Branch branch_of(const CsgTree& tree, std::size_t top);
/// Indices of the children of a node, in order.
[[nodiscard]] std::vector<std::size_t> children_of(const CsgTree& tree, std::size_t node);

/// Feeds everything that affects the solid; not names.
void feed(Fingerprinter& fp, const CsgTree& tree);
void feed(Fingerprinter& fp, const Pose& pose);

}  // namespace robomosp::evaluation
