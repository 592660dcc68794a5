// SPDX-License-Identifier: Apache-2.0
// Origins: the records, and the places in them, of what is picked in a picture (layer:
// application, scene). [any thread]
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <robomosp/sdk/result.h>

#include "scene/frame.h"

namespace robomosp::scene {

/// A place in a record that record.set takes.
struct RecordPath {
  AnyId record;
  std::string path;
};

struct Origin {
  /// The innermost place; solid.set takes it too where the record is a
  /// solid, and trajectory.set_segment the number `segment` where it is a trajectory.
  AnyId record;
  std::string path;
  /// The same from outside inwards: the member in the world, parts within parts, `record`.
  std::vector<RecordPath> steps;
  std::string member;       ///< of the world; "" of a record on its own
  std::string link;         ///< of a robot; "base" of its base
  std::string part;         ///< parts of objects and links, within each other: "gripper.finger"
  std::string node;         ///< of a solid
  std::uint64_t face = 0;   ///< Mesh::Face::id of the triangle; 0 = the engine knows no faces
  std::size_t segment = 0;  ///< of a trajectory, from 1; 0 = not known
  std::size_t point = 0;    ///< its control point, from 1; 0 = none
};

/// The origin of an element. `primitive` is the triangle of an item, or of a line the pair of
/// neighbouring points, from 0; none = the element as a whole. Paths are of the frame's snapshot.
/// An element that the frame's records no longer explain, or a primitive that it does not have, is
/// an error.
[[nodiscard]] Result<Origin> pick(const Frame&, const ElementRef&,
                                  std::optional<std::size_t> primitive = {});
/// The name of a record in the frame's snapshot; "" if the record is missing.
[[nodiscard]] std::string name_of(const Frame&, AnyId record);
/// The element of an id; none where the frame has none. Takes time by the number of elements.
[[nodiscard]] std::optional<ElementRef> find_element(const Frame&, std::uint64_t id);
/// Every element of a frame in drawing order.
void for_each_element(const Frame&, const std::function<void(const ElementRef&)>& see);

}  // namespace robomosp::scene
