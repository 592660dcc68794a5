// SPDX-License-Identifier: Apache-2.0
// Shapes for collision and contact of solids, objects and robots (layer: application, evaluation).
// Internal to modules/evaluation. [any thread]
#pragma once

#include <memory>
#include <vector>

#include "evaluation/derived.h"
#include "evaluation/solids.h"

namespace robomosp::evaluation {

/// As the methods of Derived of these names.
[[nodiscard]] Result<std::shared_ptr<const std::vector<ShapePiece>>> shapes_of(
    Solids&, const document::Snapshot&, AnyId solid_or_object, Progress&);
[[nodiscard]] Result<std::vector<std::vector<ShapePiece>>> robot_shapes_of(
    Solids&, const document::Snapshot&, RobotId, Progress&);

}  // namespace robomosp::evaluation
