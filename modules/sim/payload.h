// SPDX-License-Identifier: Apache-2.0
// What robots carry: the masses of held objects ride on the bodies that hold them (layer:
// application, sim).
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "sim/recording.h"
#include "sim/simulate.h"

namespace robomosp::sim {

/// What the robot of a world holds from the start, by the world's attachments; for all times.
[[nodiscard]] Result<std::vector<Load>> attached_loads(const Simulator&, WorldId,
                                                       const model::PlacedRobot&,
                                                       const RobotModel&);

/// The model with the masses of the loads at the joints that carry them, as one body with theirs.
/// Those on the base, and those without mass, weigh nothing; without any it is the same model.
[[nodiscard]] Result<std::shared_ptr<const RobotModel>> loaded_model(
    const Simulator&, std::shared_ptr<const RobotModel>, std::span<const Load>, Progress&);

/// Those of the loads that are carried at a time [s].
[[nodiscard]] std::vector<Load> loads_at(std::span<const Load>, double time);
/// The first rows of the stretches of rows within which nothing is taken or let go; without times
/// it is all one.
[[nodiscard]] std::vector<std::size_t> load_stretches(const Recording&, std::span<const Load>);

/// loaded_model() with what the world's attachments put on the robot.
[[nodiscard]] Result<std::shared_ptr<const RobotModel>> attached_model(
    const Simulator&, WorldId, const model::PlacedRobot&, std::shared_ptr<const RobotModel>,
    Progress&);

}  // namespace robomosp::sim
