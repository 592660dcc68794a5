// SPDX-License-Identifier: Apache-2.0
// Origins: the records, and the places in them, of elements picked in a picture (layer:
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

/// A place in a record, as a path for record.set.
struct RecordPath {
  AnyId record;
  std::string path;
};

struct Origin {
  /// The innermost place; solid.set accepts it too if the record is a solid, and
  /// trajectory.set_segment the number `segment` if it is a trajectory.
  AnyId record;
  std::string path;
  /// The same from outside inwards: the member in the world, parts within parts, `record`.
  std::vector<RecordPath> steps;
  std::string member;       ///< of the world; "" for a record on its own
  std::string link;         ///< of a robot; "base" of its base
  std::string part;         ///< nested parts of objects and links: "gripper.finger"
  std::string node;         ///< of a solid
  std::uint64_t face = 0;   ///< Mesh::Face::id of the triangle; 0 = the engine knows no faces
  std::size_t segment = 0;  ///< of a trajectory, from 1; 0 = unknown
  std::size_t point = 0;    ///< its control point, from 1; 0 = none
};

/// The origin of an element. `primitive` is the triangle of an item, or for a line the pair of
/// neighbouring points, from 0; none = the element as a whole. Paths are those of the frame's
/// snapshot. An element unknown to the frame's records, or a missing primitive, is an error.
[[nodiscard]] Result<Origin> pick(const Frame&, const ElementRef&,
                                  std::optional<std::size_t> primitive = {});
/// The name of a record in the frame's snapshot; "" if the record is missing.
[[nodiscard]] std::string name_of(const Frame&, AnyId record);
/// The element with an id; none if the frame lacks it. Takes time proportional to the number of
/// elements.
[[nodiscard]] std::optional<ElementRef> find_element(const Frame&, std::uint64_t id);
/// Every element of a frame in drawing order.
void for_each_element(const Frame&, const std::function<void(const ElementRef&)>& see);

}  // namespace robomosp::scene
