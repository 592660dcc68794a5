// SPDX-License-Identifier: Apache-2.0
// Shapes: what a member of a scene shows, given in the frames of its bodies, so that moving it is a
// matter of poses; and members, shapes at a place (layer: application, scene). Immutable once made.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <robomosp/sdk/render.h>
#include <robomosp/sdk/result.h>

#include "model/kind.h"

namespace robomosp::scene {

/// What an element of a picture is.
enum class ElementKind : std::uint8_t { item, line, triad, mark, label, legend, light };

/// Body of an element that is given in the world's frame.
inline constexpr std::int32_t kWorldBody = -1;

/// The part of its member that an element shows; -1 = nothing of that kind.
struct PartOf {
  std::int32_t link = -1;     ///< of a robot: 0 = its base, then its links
  std::int32_t tool = -1;     ///< of a robot: an attached tool
  std::int32_t part = -1;     ///< part of an object; of a link: the designed part
  std::int32_t leaf = -1;     ///< of a solid or object: which of the solids that it consists of
  std::int32_t node = -1;     ///< of that solid
  std::int32_t segment = -1;  ///< of a trajectory
  std::int32_t point = -1;    ///< of that segment: its control point
};

/// Something to draw. What has a name has the name of its part only, and no id.
template <class T>
struct Element {
  T what;                   ///< poses and points in the frame of `body`
  std::int32_t body = 0;    ///< of the member
  std::uint32_t group = 0;  ///< with its number makes the id, see item_id()
  std::uint32_t number = 0;
  PartOf of = {};
};

/// A box along the axes of a frame [m]; low > high = nothing is in it.
using Bounds = std::array<Vec3, 2>;
[[nodiscard]] Bounds empty_box();
void grow(Bounds&, const Bounds& other);
/// The bounds of a box placed at `pose`: around its corners.
[[nodiscard]] Bounds moved(const Bounds&, const Pose& pose);
/// Length of its diagonal [m]; 0 of an empty one, or where a number is not finite.
[[nodiscard]] double diagonal(const Bounds&);
/// Around the vertices of a mesh placed at `pose`.
[[nodiscard]] Bounds box_of(const Mesh&, const Pose& pose);

/// The elements of a member, or of one layer of it.
struct Shape {
  std::vector<Element<render::Item>> items;
  std::vector<Element<render::Line>> lines;
  std::vector<Element<render::Triad>> triads;
  std::vector<Element<render::MassMark>> marks;
  std::vector<Element<render::Label>> labels;
  std::vector<Element<render::Legend>> legends;
  std::vector<Element<render::Light>> lights;
  std::vector<Bounds> boxes;                    ///< of each body, around its items
  std::optional<Error> failure = std::nullopt;  ///< why there is nothing
  std::vector<std::string> left_out = {};       ///< sentences about what is missing
  /// For each pair of neighbouring points of a line: the segment of the trajectory that they are
  /// in; one list a line, empty if not known.
  std::vector<std::vector<std::int32_t>> segments = {};

  /// It has no element.
  [[nodiscard]] bool is_empty() const {
    return items.empty() && lines.empty() && triads.empty() && marks.empty() && labels.empty() &&
           legends.empty() && lights.empty();
  }
};
using ShapePtr = std::shared_ptr<const Shape>;
/// Calls see(kind, list) for every list of elements of a shape.
template <class See>
void for_each_list(const Shape& shape, See&& see) {
  see(ElementKind::item, shape.items);
  see(ElementKind::line, shape.lines);
  see(ElementKind::triad, shape.triads);
  see(ElementKind::mark, shape.marks);
  see(ElementKind::label, shape.labels);
  see(ElementKind::legend, shape.legends);
  see(ElementKind::light, shape.lights);
}

/// What a member of a scene is.
enum class MemberKind : std::uint8_t {
  body,
  robot,
  trajectory,
  frame,
  light,
  material,
  ghost,
  clearance  ///< the shortest line between two bodies
};

/// The layers of a member, drawn in this order.
enum class ShapeLayer : std::uint8_t {
  bodies,      ///< what is always shown
  marks,       ///< centres of mass
  posed,       ///< what depends on joint values other than by poses
  frames,      ///< of parts, nodes and links
  rows,        ///< Denavit-Hartenberg rows
  dimensions,  ///< lengths of sides
  labels,      ///< names
};
inline constexpr std::size_t kShapeLayers = 7;

/// Shapes at a place.
struct Member {
  MemberKind kind = MemberKind::body;
  bool is_placed = false;  ///< a member of a world; else the record that is shown
  std::string name;        ///< in the world; else the name of the record
  AnyId what;              ///< the record that it is made from; of frames and lights the world
  std::array<ShapePtr, kShapeLayers> shapes;  ///< by ShapeLayer; null = that layer is empty
  std::vector<Pose> bodies;                   ///< world_T_body
  Bounds box;                                 ///< around its bodies, in the world
  /// Bodies that touch something, ascending: they are drawn red.
  std::vector<std::int32_t> touching = {};
  /// Of a clearance: the robot or object in the world that its line begins at; `what` is the
  /// record of that.
  std::string begins_at = {};

  [[nodiscard]] const ShapePtr& shape(ShapeLayer layer) const {
    return shapes[static_cast<std::size_t>(layer)];
  }
  /// From which the ids of its elements are made.
  [[nodiscard]] std::string owner() const {
    return is_placed && kind == MemberKind::body ? "object " + name
           : kind == MemberKind::ghost           ? "ghost " + name
           : kind == MemberKind::clearance       ? "clearance " + name
                                                 : name;
  }
  [[nodiscard]] bool touches(std::int32_t body) const {
    return !touching.empty() && std::binary_search(touching.begin(), touching.end(), body);
  }
  [[nodiscard]] Pose world_T(std::int32_t body) const {
    return body < 0 ? Pose{} : bodies[static_cast<std::size_t>(body)];
  }
};
using MemberPtr = std::shared_ptr<const Member>;

}  // namespace robomosp::scene
