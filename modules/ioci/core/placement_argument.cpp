// SPDX-License-Identifier: Apache-2.0
#include "ioci/core/placement_argument.h"

#include <algorithm>

namespace robomosp::ioci {
namespace {

const Schema& placement_params() {
  static const Schema all = placement_fields("");
  return all;
}

}  // namespace

bool has_placement(const CommandContext& ctx) {
  const Schema& params = placement_params();
  return std::any_of(params.begin(), params.end(),
                     [&](const ParamSpec& p) { return ctx.given(p.name) != nullptr; });
}

Result<model::Placement> placement_given(const CommandContext& ctx, const std::string& what) {
  Map given;
  for (const ParamSpec& p : placement_params())
    if (const Value* v = ctx.given(p.name)) given.append(p.name, *v);
  return read_placement_fields(given, what);
}

}  // namespace robomosp::ioci
