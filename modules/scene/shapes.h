// SPDX-License-Identifier: Apache-2.0
// Bodies made from formulas (layer: application, scene). Internal to modules/scene.
#pragma once

#include <memory>

#include <robomosp/sdk/types.h>

namespace robomosp::scene {

/// A cone on z = 0 that points along +z. [m]
[[nodiscard]] std::shared_ptr<const Mesh> cone(double height, double radius);

}  // namespace robomosp::scene
