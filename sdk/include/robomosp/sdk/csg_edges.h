// SPDX-License-Identifier: Apache-2.0
// What an engine of robomosp.csg/1 may know besides features: its edges as curves, for seams and
// other paths along them (layer: contract, std only).
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <robomosp/sdk/csg.h>

namespace robomosp {

/// A place on an edge, in the frame of the tree.
struct CsgEdgePoint {
  Vec3 position{};                ///< [m]
  Vec3 tangent{};                 ///< unit length, from the edge's start to its end
  std::array<Vec3, 2> normals{};  ///< outward, of its two faces, in one order all along
};

/// An edge of a solid: where two of its faces meet.
struct CsgEdge {
  enum class Kind : std::int32_t {
    line,
    circle,  ///< or a part of one
    curve,   ///< any other
  };
  Kind kind = Kind::curve;
  bool is_closed = false;  ///< it ends where it starts
  double length = 0;       ///< [m]
  Vec3 centre{}, axis{};   ///< of a circle [m]; it runs counterclockwise about the axis
  double radius = 0;       ///< [m]
  double angle = 0;        ///< that it runs [rad], above 0
  /// In order, from its start to its end: the two ends of a line, of others as many as a chord
  /// between two needs to be within the distance asked for, and none turns by more than 30 degrees.
  std::vector<CsgEdgePoint> points;
};

/// What CsgEngine::extension(kExtensionId) points to, as `const CsgEdges*`, where the engine has
/// edges. It lives as long as the engine. [any thread]
class CsgEdges {
 public:
  static constexpr const char* kExtensionId = "robomosp.csg_edges/1";
  virtual ~CsgEdges() = default;
  /// What later versions of the SDK add, by its id (plugin.h); nullptr = not known.
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
  /// Each edge once; seams within one surface are none. In an order that does not depend on how the
  /// solid came about. `chord` [m], above 0.
  virtual Result<std::vector<CsgEdge>> edges(const CsgShape&, double chord, Progress&) const = 0;
};

}  // namespace robomosp
