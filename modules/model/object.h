// SPDX-License-Identifier: Apache-2.0
// Objects: solids and other objects put together (layer: data processing, model).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "model/basics.h"
#include "model/fields.h"
#include "model/kind.h"

namespace robomosp::model {

/// A part of an object: a solid or another object at a place.
struct ObjectPart {
  std::string name;
  AnyId what;           ///< solid or object
  Placement placement;  ///< object_T_part
  MaterialId material;  ///< overrides the solid's own; may be none
};
template <class V>
constexpr void fields(V& v, Of<ObjectPart>) {
  v("name", &ObjectPart::name).needed().doc("Unique within the object.");
  v("what", &ObjectPart::what)
      .refers_to({Kind::solid, Kind::object})
      .by_kind()
      .needed()
      .doc("The placed solid or object.");
  v("placement", &ObjectPart::placement).flat().doc("Its frame in the object's.");
  v("material", &ObjectPart::material).doc("Replaces the solid's own material.");
}

/// A place where an object works when it is a tool: the tip of a wire, the middle between fingers.
/// A tool is mounted by the object's own frame, z away from the flange.
struct ToolCentrePoint {
  std::string name;
  Placement placement;  ///< object_T_tcp
};
template <class V>
constexpr void fields(V& v, Of<ToolCentrePoint>) {
  v("name", &ToolCentrePoint::name).needed().doc("Unique among the object's centre points.");
  v("placement", &ToolCentrePoint::placement)
      .flat()
      .doc("Its frame in the object's, by which the object is mounted.");
}

/// What happens where parts overlap.
enum class Overlap : std::uint8_t {
  once,  ///< shared volume counts once, for the part listed first
  sum,   ///< every part counts in full
};
inline constexpr std::array<std::string_view, 2> kOverlapWords{"once", "sum"};
constexpr std::span<const std::string_view> words(Of<Overlap>) { return kOverlapWords; }

struct Object {
  std::string description;
  Overlap overlap = Overlap::once;
  std::vector<ObjectPart> parts;
  std::vector<ToolCentrePoint> tcps;  ///< any make a tool of it; the first one is its usual one
  Parametric parametric;
  std::optional<MeasuredMass> measured;
};
template <class V>
constexpr void fields(V& v, Of<Object>) {
  v("description", &Object::description).doc("Its description.");
  v("parametric", &Object::parametric).flat().doc("Parameters and expressions.");
  v("overlap", &Object::overlap)
      .doc("Whether volume shared by parts counts once, for the first of them, or for each.");
  v("measured", &Object::measured).label("measured mass").doc("Mass measured on the real part.");
  v("parts", &Object::parts).by_names().doc("Its parts.");
  v("tcps", &Object::tcps).doc("Tool centre points; with any the object is a tool.");
}

}  // namespace robomosp::model
