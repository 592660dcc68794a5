// SPDX-License-Identifier: Apache-2.0
// Visibility: members of a world that a picture leaves out, and items of members and parts that it
// draws with less opacity, by the paths that commands take (layer: application, scene).
// [any thread]
#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/render.h>

#include "scene/frame.h"

namespace robomosp::scene {

/// Path of a member in its world, such as "objects.table"; "" of what is no member of a world.
[[nodiscard]] std::string member_path(const Member& member);
/// Paths of all members of the world that a frame shows.
[[nodiscard]] std::set<std::string> member_paths(const Frame&);

/// What leave_out() did.
struct LeftOut {
  std::set<std::string> members;  ///< those of the paths that the frame has
  std::set<std::uint64_t> items;  ///< ids of their items
};
/// Takes members of a world out of a scene made of the frame, with their marks, lines and labels.
[[nodiscard]] LeftOut leave_out(const Frame&, const std::set<std::string>& paths, render::Scene&);

/// Ids of the items, in order, that show a place: a member of the world shown ("objects.table"), or
/// a link, part or node of a record in it ("links.forearm", "parts.gripper.finger", "nodes.hole");
/// "" = all of that record. None if the frame shows nothing of it.
[[nodiscard]] std::vector<std::uint64_t> items_of(const Frame&, AnyId record,
                                                  std::string_view path);

}  // namespace robomosp::scene
