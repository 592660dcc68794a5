// SPDX-License-Identifier: Apache-2.0
// Meshes with their looks of solids, objects and robots (layer: application, evaluation). Internal
// to modules/evaluation. [any thread]
#pragma once

#include <span>
#include <vector>

#include "evaluation/derived.h"
#include "evaluation/solids.h"

namespace robomosp::evaluation {

constexpr double kLinkGeometryChord = 2e-4;  ///< tessellation of generated bodies [m]

/// As the methods of Derived of these names.
[[nodiscard]] Result<std::vector<Drawable>> drawables_of(Solids&, const document::Snapshot&,
                                                         AnyId solid_or_object, Progress&);
[[nodiscard]] Result<RobotBodies> robot_bodies_of(Solids&, const document::Snapshot&, RobotId,
                                                  Progress&);
[[nodiscard]] Result<void> prepare(Solids&, const document::Snapshot&,
                                   std::span<const AnyId> solids_and_objects, Progress&);

}  // namespace robomosp::evaluation
