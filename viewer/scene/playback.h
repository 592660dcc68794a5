// SPDX-License-Identifier: GPL-3.0-or-later
// The poses of a Playback at any time, between samples too (layer: GUI, std only).
#pragma once

#include <vector>

#include <robomosp/sdk/result.h>

#include "viewer/frame.h"

namespace robomosp::viewer {

/// Tells in a sentence what is wrong with a playback: counts, order of times, numbers not finite.
[[nodiscard]] Result<void> check(const Playback& playback);

/// Duration [s] from the first to the last sample; 0 if there are fewer than two.
[[nodiscard]] double duration(const Playback& playback);

/// Poses at `time` [s] in the order of `playback.ids`: positions linear, rotations along the
/// shortest arc; before the first and after the last sample the pose stands still.
[[nodiscard]] std::vector<Pose> poses_at(const Playback& playback, double time);

}  // namespace robomosp::viewer
