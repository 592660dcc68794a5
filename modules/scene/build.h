// SPDX-License-Identifier: Apache-2.0
// From the records of a document to the scene of a picture, and from a recording to its playback
// (layer: application, scene). [any thread: reads a snapshot]
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/render.h>
#include <robomosp/sdk/result.h>

#include "collision/cache.h"
#include "document/document.h"
#include "evaluation/derived.h"
#include "kernel/registry.h"
#include "recording/recording.h"
#include "scene/extras.h"
#include "scene/motion.h"
#include "scene/playback.h"

namespace robomosp::scene {

/// What a picture is built from.
struct Source {
  const document::Snapshot& snapshot;
  evaluation::Derived& derived;
  const Registry& registry;
  /// Prepared collision models for `Extras::contacts` and `clearances`; null = made for the
  /// picture.
  collision::CollisionCache* collision_models = nullptr;
};

struct Frame;

/// A scene, and sentences about what could not be built and was left out.
struct Built {
  render::Scene scene;
  std::vector<std::string> left_out;
  /// That it was made of by build(); null from built_of().
  std::shared_ptr<const Frame> frame{};
};

/// A world (objects, robots at the joint values the world gives them, trajectories as lines, a
/// triad at each tool), a robot, object or solid on its own, or a material on a sphere and a cone.
/// Of a solid that cannot be made, the operands of the failed operation are shown in the colour of
/// a warning and the failure is reported; in a world, what cannot be built is left out, elsewhere
/// it is the error. `motion`, if any, moves robots and objects of a world to where a run has them,
/// with their frames, marks and ellipsoids.
[[nodiscard]] Result<Built> build(const Source&, AnyId, const Extras&, Progress&,
                                  MotionPtr motion = nullptr);

/// A frame as one scene, moved apart by `explode_by` (see Extras::explode). Where there is nothing
/// to show, the frame's failure.
[[nodiscard]] Result<Built> built_of(const Frame& frame, double explode_by);

/// How the robots and objects of a recording move: robots along columns q1, ... (others than the
/// recording's own along `<name>.q1`, ...), objects along `<name>.x .y .z .qw .qx .qy .qz`; ids are
/// those of build() on the same world.
[[nodiscard]] Result<Playback> build_playback(const Source&, WorldId, const recording::Recording&,
                                              Progress&);

/// Moves the groups of items outwards from the middle of the box around all: each by `factor` times
/// the distance from there to the middle of its box; groups that share the middle (a pin in its
/// bore) are spread along the longest axis of the box. `group_of[i]` numbers the group of item i.
/// Thin lines join the old and the new middles. [m]
void explode(render::Scene& scene, std::span<const std::size_t> group_of, double factor);

/// The mark of a body's mass, given in the world. Mass and principal moments must be positive.
[[nodiscard]] render::MassMark mass_mark(std::uint64_t id, const MassProperties& world_mass);

/// Items that show a material: a sphere and a cone side by side, 0.1 m high.
[[nodiscard]] std::vector<render::Item> material_preview(const render::Appearance&);

}  // namespace robomosp::scene
