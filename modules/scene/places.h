// SPDX-License-Identifier: Apache-2.0
// Frames and lights of worlds in pictures (layer: application, scene). Internal to modules/scene.
#pragma once

#include <robomosp/sdk/render.h>

#include "model/records.h"

namespace robomosp::scene {

/// The axes of a world's frame with its name, `length` [m] each.
[[nodiscard]] render::Triad triad_of(const model::PlacedFrame&, double length);
/// The lamp of a world's light.
[[nodiscard]] render::Light lamp_of(const model::PlacedLight&);
/// The axes of a light with its name; it shines along -z.
[[nodiscard]] render::Triad triad_of(const model::PlacedLight&, double length);

}  // namespace robomosp::scene
