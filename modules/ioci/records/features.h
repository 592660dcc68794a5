// SPDX-License-Identifier: Apache-2.0
// Features of solids and objects chosen by selectors (layer: application). Internal to
// modules/ioci.
#pragma once

#include <string>
#include <string_view>

#include <robomosp/sdk/csg.h>

#include "ioci/core/commands.h"

namespace robomosp::ioci {

/// The one feature of a solid or object, in its frame, that a selector means: an index of
/// object.features, or words such as "largest hole radius 5 mm". `whose` as in faults: `part
/// "pin"`.
Result<CsgFeature> feature_of(CommandContext&, AnyId what, const Value& selector,
                              const std::string& whose, std::string_view path);
/// Rotation of the frame that a feature has: z along its direction (outward normal, axis), turned
/// out of the object's frame by as little as possible; a point has that of the object.
[[nodiscard]] std::array<double, 9> feature_rotation(const CsgFeature&);

}  // namespace robomosp::ioci
