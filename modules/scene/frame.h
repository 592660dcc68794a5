// SPDX-License-Identifier: Apache-2.0
// Frames: what a scene shows at one moment, and what changed from one to another (layer:
// application, scene). Immutable, shared; readable from any thread without locks.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <robomosp/sdk/render.h>

#include "document/document.h"
#include "model/long_list.h"
#include "scene/shape.h"

namespace robomosp::scene {

/// In the order of the world's list; frames share the blocks that did not change.
using MemberList = model::LongList<MemberPtr>;

/// An element of a member.
struct ElementRef {
  ElementKind kind = ElementKind::item;
  ShapeLayer layer = ShapeLayer::bodies;
  std::uint32_t index = 0;  ///< in the list of that kind of the member's shape
  MemberPtr member;
};
/// Stable across frames: the same element of the same member has the same id.
[[nodiscard]] std::uint64_t id_of(const ElementRef&);

/// What is different in a later frame.
struct Changes {
  std::uint64_t from = 0, to = 0;   ///< numbers of the frames; from 0 = everything is new
  std::vector<ElementRef> added;    ///< of the later frame, as the next two
  std::vector<ElementRef> changed;  ///< in more than its pose
  std::vector<ElementRef> moved;    ///< in its pose only
  std::vector<ElementRef> removed;  ///< of the earlier frame
  [[nodiscard]] bool empty() const {
    return added.empty() && changed.empty() && moved.empty() && removed.empty();
  }
};

struct Frame {
  std::uint64_t number = 0;        ///< 1, 2, ... in one scene
  document::SnapshotPtr snapshot;  ///< that it shows; null before the first
  AnyId what;                      ///< world, robot, object, solid or material
  bool is_there = false;           ///< the record exists
  bool is_exact = false;           ///< nothing coarse is shown and nothing is outstanding
  MemberList bodies;               ///< objects of a world, or the one body that is shown
  MemberList robots, trajectories, frames, lights, ghosts, clearances;
  std::optional<Error> failure;  ///< why a record that is no world cannot be shown
  std::vector<std::string>
      troubles;   ///< of what is in no member: robots that cannot be built, grips
  Changes since;  ///< since the frame before this one

  /// Calls see(const MemberPtr&) in drawing order.
  template <class See>
  void for_each_member(See&& see) const {
    for (const MemberList* list :
         {&bodies, &robots, &frames, &lights, &trajectories, &ghosts, &clearances})
      for (const MemberPtr& member : *list) see(member);
  }
};
using FramePtr = std::shared_ptr<const Frame>;

/// What changed between two frames of the same scene; `from` null = everything is
/// added. Costs a comparison for each 64 members that the two share, and what changed.
[[nodiscard]] Changes changes_between(const Frame* from, const Frame& to);

/// The item of a reference with its id, name and place in the world.
[[nodiscard]] render::Item item_of(const ElementRef&);
/// Everything as renderers take it. `group_of`, if given, gets for each item the number of what
/// moves as one when the scene is exploded; then tools have no axes.
[[nodiscard]] render::Scene to_scene(const Frame&, std::vector<std::size_t>* group_of = nullptr);
/// Sentences about what is not shown, each once.
[[nodiscard]] std::vector<std::string> left_out(const Frame&);

}  // namespace robomosp::scene
