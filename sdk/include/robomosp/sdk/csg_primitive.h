// SPDX-License-Identifier: Apache-2.0
// Interface robomosp.primitive/1: a primitive of a plugin's own, such as a gear, made of nodes that
// every CSG engine knows (layer: contract, std only).
#pragma once

#include <robomosp/sdk/csg.h>
#include <robomosp/sdk/params.h>
#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

namespace robomosp {

/// Interface robomosp.primitive/1. [any thread]
class CsgPrimitive {
 public:
  using Interface = CsgPrimitive;
  static constexpr const char* kInterfaceId = "robomosp.primitive/1";
  virtual ~CsgPrimitive() = default;
  /// What later versions of the SDK add, by its id (plugin.h); nullptr = not known.
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
  /// The primitive's tree for these parameters (SI, checked against the provider's table) in the
  /// primitive's own frame. A combination that makes no solid is an error that names the parameter.
  /// Equal parameters give equal trees.
  virtual Result<CsgTree> build(const Params& params, Progress&) const = 0;
};

}  // namespace robomosp
