// SPDX-License-Identifier: Apache-2.0
// Solids: flat CSG trees (layer: data processing, model). SI and radians.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/csg.h>

#include "model/basics.h"
#include "model/fields.h"
#include "model/kind.h"

namespace robomosp::model {

/// The numbers of the enum have gaps.
inline std::vector<Type::Word> numbered_words(Of<CsgKind>) {
  std::vector<Type::Word> words;
  for (const CsgNodeInfo& row : kCsgNodes)
    words.push_back({row.name, static_cast<std::int64_t>(row.kind)});
  return words;
}
inline constexpr std::array<std::string_view, 4> kCurveWords{"line", "arc", "spline", "circle"};
constexpr std::span<const std::string_view> words(Of<CsgCurve::Kind>) { return kCurveWords; }
inline constexpr std::array<std::string_view, 2> kGeometryWords{"brep", "mesh"};
constexpr std::span<const std::string_view> words(Of<CsgGeometry::Form>) { return kGeometryWords; }

template <class V>
constexpr void fields(V& v, Of<CsgCurve>) {
  v("kind", &CsgCurve::kind).doc("Type of the curve through its points.");
  v("points", &CsgCurve::points)
      .unit("m")
      .doc("Points on it, the last is its end; for a circle centre and radius.");
}
template <class V>
constexpr void fields(V& v, Of<CsgLoop>) {
  v("start", &CsgLoop::start).unit("m").doc("Start of the first curve.");
  v("curves", &CsgLoop::curves).doc("Curves, each from the end of the one before.");
}
template <class V>
constexpr void fields(V& v, Of<CsgProfile>) {
  v("loops", &CsgProfile::loops).doc("Closed outlines; an outline inside another is a hole.");
}
template <class V>
constexpr void fields(V& v, Of<CsgGeometry>) {
  v("form", &CsgGeometry::form).read_only().doc("Exact (brep) or a triangle mesh.");
  v("digest", &CsgGeometry::digest)
      .read_only()
      .doc("Digest of its content; equal content has an equal digest.");
  v("source", &CsgGeometry::source).doc("Its origin, for readers.");
  v.stands_for(4);  // the digest replaces brep, points and triangles; records never contain
                    // deviation
}

/// One node of a solid's CSG tree, flat, parents before children.
struct SolidNode {
  CsgKind kind = CsgKind::box;
  std::string name;               ///< unique within the solid; how commands address the node
  std::int32_t parent = -1;       ///< index of the parent, -1 for the root (node 0)
  Placement placement;            ///< parent_T_node
  std::array<double, 6> sizes{};  ///< in order of kCsgNodes [m, rad or 1]
  std::shared_ptr<const CsgProfile> profile{};    ///< of a prism or revolution
  std::shared_ptr<const CsgGeometry> geometry{};  ///< of an imported node
  std::string select{};                           ///< edges of a fillet or chamfer, see CsgNode
  ProviderChoice primitive{};                     ///< of a custom node (robomosp.primitive/1)
  bool is_global = false;                         ///< placement is solid_T_node
  /// Of primitives with their base at z = 0: the node's frame is at half their height.
  bool is_centred = false;
};
template <class V>
constexpr void fields(V& v, Of<SolidNode>) {
  v("kind", &SolidNode::kind).needed().doc("Primitive, operation or modifier.");
  v("name", &SolidNode::name).needed().doc("Unique within the solid; used by commands.");
  v("parent", &SolidNode::parent).index_of("nodes").doc("The parent node.");
  v("placement", &SolidNode::placement).flat().doc("Its frame in the parent's.");
  v("sizes", &SolidNode::sizes)
      .flat()
      .unit_by([](const void* n, std::size_t i) {
        return csg_info(static_cast<const SolidNode*>(n)->kind).sizes[i].unit;
      })
      .component_by([](const void* n, std::size_t i) {
        return csg_info(static_cast<const SolidNode*>(n)->kind).sizes[i].name;
      })
      .doc("Sizes of the node's kind, such as radius and height.");
  v("profile", &SolidNode::profile).doc("Outline of a prism or revolution.");
  v("geometry", &SolidNode::geometry).doc("Geometry of an imported node.");
  v("select", &SolidNode::select).doc("Edges for a fillet or chamfer; empty is all.");
  v("primitive", &SolidNode::primitive)
      .doc("Primitive of a plugin for a custom node, with its parameters.");
  v("is_global", &SolidNode::is_global)
      .doc("Whether the placement is in the solid's frame instead of the parent's.");
  v("is_centred", &SolidNode::is_centred)
      .doc("Whether a primitive that begins at z = 0 has its frame at half its height instead.");
}

struct Solid {
  std::string description;
  MaterialId material;  ///< may be none: then the solid has no mass
  double chord = 1e-4;  ///< tessellation: greatest chord distance [m]
  std::vector<SolidNode> nodes;
  Parametric parametric;
  std::optional<MeasuredMass> measured;
};
template <class V>
constexpr void fields(V& v, Of<Solid>) {
  v("description", &Solid::description).doc("Its description.");
  v("material", &Solid::material).doc("Its material; without one it has no mass.");
  v("chord", &Solid::chord)
      .unit("m")
      .above(0)
      .doc("Greatest distance of the displayed triangles from the surface.");
  v("parametric", &Solid::parametric).flat().doc("Parameters and expressions.");
  v("measured", &Solid::measured).label("measured mass").doc("Mass measured on the real part.");
  v("nodes", &Solid::nodes).by_names().doc("The tree of solids and operations, parents first.");
}

}  // namespace robomosp::model
