// SPDX-License-Identifier: Apache-2.0
// Shapes as ODE's geometries (layer: plugin).
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include <ode/ode.h>
#include <robomosp/sdk/collision.h>
#include <robomosp/sdk/round_outside.h>

namespace robomosp::physics_ode {

static_assert(sizeof(dReal) == sizeof(double));

/// Numbers referenced by a geometry during its lifetime.
struct GeometryData {
  GeometryData() = default;
  GeometryData(const GeometryData&) = delete;
  GeometryData& operator=(const GeometryData&) = delete;
  ~GeometryData();
  std::vector<double> points, planes;
  std::vector<unsigned> polygons;  ///< 3, i, j, k a face
  std::vector<float> vertices;
  std::vector<dTriIndex> triangles;
  dTriMeshDataID mesh = nullptr;
};

/// A convex piece is two geometries, since ODE finds one point only where two convex ones touch: as
/// a hull it collides with other hulls, as a mesh with all others. A rim is a thin cylinder at a
/// circle of a round outside; it collides with everything but hulls and other rims.
enum class Role { any, hull, mesh_of_hull, rim };

/// The existing part of a round surface: triangles of the mesh on it.
class Opening {
 public:
  /// For a sphere (length 0) or a cylinder about z: the triangles `on` lie on its surface within
  /// the tolerance [m], the `walls` inside, in its frame.
  using Triangle = std::array<Vec3, 3>;
  Opening(double radius, double length, std::vector<Triangle> on, std::vector<Triangle> walls,
          double tolerance);
  /// True if the surface exists at a point near it, with material behind it down to a depth [m]
  /// against an outward direction.
  [[nodiscard]] bool is_there(const Vec3& point, const Vec3& outward, double depth) const;

 private:
  struct Bounded {
    Triangle triangle;
    Vec3 low, high;
  };
  static std::vector<Bounded> bounded(const std::vector<Triangle>& all);
  double radius_, length_, tolerance_;
  std::vector<Bounded> on_, walls_;
};

/// Contact data of a geometry; ODE keeps its address.
struct GeometryTag {
  std::int32_t body = -1, shape = -1;  ///< a shape of the body
  std::uint32_t number = 0;            ///< of all geometries, in the order of near pairs
  Role role = Role::any;
  bool is_beside_round = false;  ///< rims or a round geometry of the same shape are farther out
  std::shared_ptr<const Opening> opening;  ///< of a round geometry with openings
  /// Of a cylinder: mean distance of the points of the lower and of the upper end from the axis,
  /// relative to the radius.
  std::array<double, 2> arm{2.0 / 3, 2.0 / 3};
  /// Of a rim: vectors along the outline to its neighbours, as radius and z; none = an end.
  std::array<std::array<double, 2>, 2> sides{};
};

/// A geometry and its pose in its body.
struct Geometry {
  dGeomID id = nullptr;
  Pose body_T_geometry;
  double thickness = 0;  ///< least size of the box around it in its axes [m]
  std::unique_ptr<GeometryData> data;
  std::unique_ptr<GeometryTag> tag = std::make_unique<GeometryTag>();
};

/// Distance of a point outside a sphere (length 0) or a cylinder about z [m], and the normal of its
/// surface there.
struct Foot {
  double distance = 0;
  Vec3 normal{};
};
[[nodiscard]] Foot foot_on(const Vec3& point, double radius, double length);

/// Creates the geometries of a shape in a space; a shape without extent is an error.
Result<std::vector<Geometry>> make_geometries(dSpaceID space, const Shape& shape);

/// True if geometries of these roles are tested against each other.
[[nodiscard]] bool meet(Role a, Role b);

/// Pose to ODE's matrix of three rows of four.
void to_ode(const Pose& pose, dMatrix3 R);

}  // namespace robomosp::physics_ode
