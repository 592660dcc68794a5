// SPDX-License-Identifier: GPL-3.0-or-later
// From the records of a world to the Frame that is drawn, and from a recording to its Playback
// (layer: GUI, free of OSG and Qt). [any thread: reads a snapshot]
#pragma once

#include <string>

#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

#include "document/derived.h"
#include "document/document.h"
#include "kernel/registry.h"
#include "sim/recording.h"
#include "viewer/frame.h"

namespace robomosp::viewer {

/// What a picture of a world is built from.
struct WorldView {
  const document::Snapshot& snapshot;
  document::Derived& derived;
  const Registry& registry;
  WorldId world;
};

/// Objects, robots at the joint values the world gives them, trajectories as lines and a triad at
/// each robot's tool. What cannot be built (a solid that fails) is left out and told in `left_out`.
[[nodiscard]] Result<Frame> build_frame(const WorldView&, std::vector<std::string>& left_out,
                                        Progress&);

/// How the robot of a recording moves; ids are those of build_frame on the same world.
[[nodiscard]] Result<Playback> build_playback(const WorldView&, const sim::Recording&, Progress&);

/// A solid, an object or a robot (at its "home" pose or zeros) on its own.
[[nodiscard]] Result<Frame> build_frame(const document::Snapshot&, document::Derived&, AnyId,
                                        Progress&);

}  // namespace robomosp::viewer
