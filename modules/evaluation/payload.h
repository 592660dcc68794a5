// SPDX-License-Identifier: Apache-2.0
// What robots carry: the masses of held objects ride on the bodies that hold them (layer:
// application, evaluation).
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "evaluation/sources.h"
#include "recording/recording.h"

namespace robomosp::evaluation {

/// What the robot of a world holds from the start, by the world's attachments; for all times.
[[nodiscard]] Result<std::vector<recording::Load>> attached_loads(const Sources&, WorldId,
                                                                  const model::PlacedRobot&,
                                                                  const RobotModel&);

/// The model with the masses of the loads at the joints that carry them, as one body with theirs.
/// Those on the base, and those without mass, weigh nothing; without any it is the same model.
[[nodiscard]] Result<std::shared_ptr<const RobotModel>> loaded_model(
    const Sources&, std::shared_ptr<const RobotModel>, std::span<const recording::Load>, Progress&);

/// Those of the loads that are carried at a time [s].
[[nodiscard]] std::vector<recording::Load> loads_at(std::span<const recording::Load>, double time);
/// The first rows of the stretches of rows within which nothing is taken or let go; without times
/// it is all one.
[[nodiscard]] std::vector<std::size_t> load_stretches(const recording::Recording&,
                                                      std::span<const recording::Load>);

/// loaded_model() with what the world's attachments put on the robot.
[[nodiscard]] Result<std::shared_ptr<const RobotModel>> attached_model(
    const Sources&, WorldId, const model::PlacedRobot&, std::shared_ptr<const RobotModel>,
    Progress&);

}  // namespace robomosp::evaluation
