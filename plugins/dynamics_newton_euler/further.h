// SPDX-License-Identifier: Apache-2.0
// What newton_euler computes with spatial vectors in the base frame, for every joint type: energy
// and momentum, the regressor of the dynamic parameters (layer: plugin). Functions allocate nothing
// and check the batch.
#pragma once

#include "spatial/body_tree.h"

namespace robomosp::newton_euler {

/// Doubles of scratch that the two functions below need at most.
[[nodiscard]] std::size_t further_scratch(const spatial::BodyTree& tree);

/// InverseDynamics::energy.
Result<void> energy(const spatial::BodyTree& tree, const DynamicsBatch& batch,
                    std::span<Energy> out, Progress& progress);
/// InverseDynamics::regressor.
Result<void> regressor(const spatial::BodyTree& tree, const DynamicsBatch& batch,
                       std::span<double> y, Progress& progress);

}  // namespace robomosp::newton_euler
