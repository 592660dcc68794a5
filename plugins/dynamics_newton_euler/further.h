// SPDX-License-Identifier: Apache-2.0
// What newton_euler computes beside torques and inertia, all in the base frame with spatial vectors
// and for every joint type: energy and momentum, the regressor of the dynamic parameters, partial
// derivatives (layer: plugin). Functions allocate nothing and check the batch.
#pragma once

#include "spatial/body_tree.h"

namespace robomosp::newton_euler {

/// Doubles of scratch that the three functions below need at most.
[[nodiscard]] std::size_t further_scratch(const spatial::BodyTree& tree);

/// InverseDynamics::energy.
Result<void> energy(const spatial::BodyTree& tree, const DynamicsBatch& batch,
                    std::span<Energy> out, Progress& progress);
/// InverseDynamics::regressor.
Result<void> regressor(const spatial::BodyTree& tree, const DynamicsBatch& batch,
                       std::span<double> y, Progress& progress);
/// InverseDynamics::derivatives.
Result<void> derivatives(const spatial::BodyTree& tree, const DynamicsBatch& batch,
                         std::span<double> by_q, std::span<double> by_qd, Progress& progress);

}  // namespace robomosp::newton_euler
