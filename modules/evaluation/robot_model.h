// SPDX-License-Identifier: Apache-2.0
// The mechanism of a robot record with the masses of its designed parts (layer: application,
// evaluation). Internal to modules/evaluation. [any thread]
#pragma once

#include <memory>
#include <optional>

#include "evaluation/derived.h"
#include "evaluation/solids.h"

namespace robomosp::evaluation {

/// As Derived::robot_model().
[[nodiscard]] Result<std::shared_ptr<const RobotModel>> robot_model_of(Solids&,
                                                                       const document::Snapshot&,
                                                                       RobotId, Vec3 gravity,
                                                                       Progress&);

/// As Derived::standing_mass().
[[nodiscard]] Result<std::optional<MassProperties>> standing_mass_of(Solids&,
                                                                     const document::Snapshot&,
                                                                     RobotId, Progress&);

}  // namespace robomosp::evaluation
