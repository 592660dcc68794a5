// SPDX-License-Identifier: Apache-2.0
// Bodies that touch and the nearest points of a world, marked in its scene (layer: application,
// scene). [any thread]
#pragma once

#include <span>

#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

#include "collision/collision.h"
#include "scene/build.h"

namespace robomosp::scene {

/// Paints the bodies that touch red, and where nothing does draws the shortest line between two
/// bodies with its length beside it. `q` as for CollisionModel; items are found by their names, as
/// build() gives them.
[[nodiscard]] Result<void> mark_contacts(const collision::CollisionModel&,
                                         std::span<const double> q, render::Scene&, Progress&);

/// The configuration of all robots at a time of a recording, linear between samples [s].
[[nodiscard]] Result<std::vector<double>> configuration_at(const collision::CollisionModel&,
                                                           const recording::Recording&,
                                                           double time);

}  // namespace robomosp::scene
