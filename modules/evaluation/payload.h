// SPDX-License-Identifier: Apache-2.0
// Payloads of robots: the masses of held objects are added to the bodies that hold them (layer:
// application, evaluation).
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "evaluation/sources.h"
#include "recording/recording.h"

namespace robomosp::evaluation {

/// The initial loads of a world's robot, from the world's attachments; for all times.
[[nodiscard]] Result<std::vector<recording::Load>> attached_loads(const Sources&, WorldId,
                                                                  const model::PlacedRobot&,
                                                                  const RobotModel&);

/// The model with the masses of the loads added to the joints that carry them, as one body each.
/// Loads on the base, and those without mass, weigh nothing; without any, it is the same model.
[[nodiscard]] Result<std::shared_ptr<const RobotModel>> loaded_model(
    const Sources&, std::shared_ptr<const RobotModel>, std::span<const recording::Load>, Progress&);

/// The loads carried at a time [s].
[[nodiscard]] std::vector<recording::Load> loads_at(std::span<const recording::Load>, double time);
/// The first rows of the stretches of rows without a grip or release; without times there is one
/// stretch.
[[nodiscard]] std::vector<std::size_t> load_stretches(const recording::Recording&,
                                                      std::span<const recording::Load>);

/// loaded_model() with the loads of the world's attachments.
[[nodiscard]] Result<std::shared_ptr<const RobotModel>> attached_model(
    const Sources&, WorldId, const model::PlacedRobot&, std::shared_ptr<const RobotModel>,
    Progress&);

}  // namespace robomosp::evaluation
