// SPDX-License-Identifier: Apache-2.0
// Shapes as ODE's geometries (layer: plugin).
#pragma once

#include <memory>
#include <vector>

#include <ode/ode.h>
#include <robomosp/sdk/collision.h>

namespace robomosp::physics_ode {

static_assert(sizeof(dReal) == sizeof(double));

/// Numbers that a geometry reads as long as it lives.
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
/// a hull it meets other hulls, as a mesh all else.
enum class Role { any, hull, mesh_of_hull };

/// A geometry and where it sits in its body.
struct Geometry {
  dGeomID id = nullptr;
  Role role = Role::any;
  Pose body_T_geometry;
  std::unique_ptr<GeometryData> data;
};

/// Makes the geometries of a shape in a space; a shape without extent is an error.
Result<std::vector<Geometry>> make_geometries(dSpaceID space, const Shape& shape);

/// Whether geometries of these roles are tested against each other.
[[nodiscard]] bool meet(Role a, Role b);

/// Pose to ODE's matrix of three rows of four.
void to_ode(const Pose& pose, dMatrix3 R);

}  // namespace robomosp::physics_ode
