// SPDX-License-Identifier: Apache-2.0
// Playback: motions of the items and triads of a scene, and their poses at any time, also between
// samples (layer: application, scene). [any thread]
#pragma once

#include <cstdint>
#include <vector>

#include <robomosp/sdk/render.h>
#include <robomosp/sdk/result.h>

namespace robomosp::scene {

/// Motion of the items and triads of a scene over time.
struct Playback {
  std::vector<double> times;       ///< [s], increasing
  std::vector<std::uint64_t> ids;  ///< the moving items and triads
  std::vector<Pose> poses;         ///< times.size() * ids.size(), time-major
};

/// Checks a playback: counts, order of times, finite numbers. The error is a sentence.
[[nodiscard]] Result<void> check(const Playback& playback);

/// Duration [s] from the first to the last sample; 0 if there are fewer than two.
[[nodiscard]] double duration(const Playback& playback);

/// Poses at `time` [s] in the order of `playback.ids`: positions are interpolated linearly,
/// rotations along the shortest arc; before the first and after the last sample the pose is
/// constant.
[[nodiscard]] std::vector<Pose> poses_at(const Playback& playback, double time);

/// Moves the items and triads of a scene to their poses at `time` [s].
void pose_at(render::Scene& scene, const Playback& playback, double time);

}  // namespace robomosp::scene
