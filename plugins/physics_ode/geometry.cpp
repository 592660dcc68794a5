// SPDX-License-Identifier: Apache-2.0
#include "geometry.h"

#include <string>

#include "spatial/convex_hull.h"
#include "spatial/pose.h"

namespace robomosp::physics_ode {
namespace {

Error flat(const char* what) {
  return error(ErrorCode::invalid_argument, std::string(what) + " has no extent",
               "Give every shape a size above 0.");
}

Geometry from_triangles(dSpaceID space, std::vector<float> points,
                        std::vector<dTriIndex> triangles) {
  Geometry g;
  g.data = std::make_unique<GeometryData>();
  g.data->vertices = std::move(points);
  g.data->triangles = std::move(triangles);
  g.data->mesh = dGeomTriMeshDataCreate();
  dGeomTriMeshDataBuildSingle(g.data->mesh, g.data->vertices.data(), 3 * sizeof(float),
                              static_cast<int>(g.data->vertices.size() / 3),
                              g.data->triangles.data(), static_cast<int>(g.data->triangles.size()),
                              3 * sizeof(dTriIndex));
  g.id = dCreateTriMesh(space, g.data->mesh, nullptr, nullptr, nullptr);
  return g;
}

/// A convex piece, moved so that the origin is inside it: ODE's test needs that.
Result<std::vector<Geometry>> make_convex(dSpaceID space, const Shape& shape) {
  const auto corners = corners_of(shape);
  if (!shape.mesh && corners.empty()) return flat("a convex shape");
  const auto hull = corners.empty() ? spatial::convex_hull(spatial::vertices(*shape.mesh))
                                    : spatial::convex_hull(corners);
  if (!hull) return flat("a convex shape");
  Geometry g;
  g.data = std::make_unique<GeometryData>();
  for (const Vec3& p : hull->points)
    for (std::size_t k = 0; k < 3; ++k) g.data->points.push_back(p[k] - hull->middle[k]);
  const auto point = [&](std::uint32_t i) {
    return Vec3{g.data->points[3 * i], g.data->points[3 * i + 1], g.data->points[3 * i + 2]};
  };
  for (const auto& t : hull->triangles) {
    const Vec3 a = point(t[0]);
    const Vec3 n = spatial::cross(spatial::sub(point(t[1]), a), spatial::sub(point(t[2]), a));
    const double length = spatial::norm(n);
    if (!(length > 0)) continue;
    const Vec3 unit = spatial::scale(n, 1 / length);
    // The middle is inside: a plane that says otherwise is that of a sliver, whose neighbours bound
    // the hull there.
    const double away = spatial::dot(unit, a);
    if (!(away > 0)) continue;
    g.data->planes.insert(g.data->planes.end(), {unit[0], unit[1], unit[2], away});
    g.data->polygons.insert(g.data->polygons.end(), {3U, t[0], t[1], t[2]});
  }
  g.id = dCreateConvex(space, g.data->planes.data(),
                       static_cast<unsigned>(g.data->planes.size() / 4), g.data->points.data(),
                       static_cast<unsigned>(hull->points.size()), g.data->polygons.data());
  g.role = Role::hull;
  g.body_T_geometry = shape.pose;
  g.body_T_geometry.p = spatial::transform(shape.pose, hull->middle);
  std::vector<float> points(g.data->points.begin(), g.data->points.end());
  std::vector<dTriIndex> triangles;
  for (const auto& t : hull->triangles) triangles.insert(triangles.end(), t.begin(), t.end());
  Geometry mesh = from_triangles(space, std::move(points), std::move(triangles));
  mesh.role = Role::mesh_of_hull;
  mesh.body_T_geometry = g.body_T_geometry;
  std::vector<Geometry> both;
  both.push_back(std::move(g));
  both.push_back(std::move(mesh));
  return both;
}

Result<std::vector<Geometry>> make_mesh(dSpaceID space, const Shape& shape) {
  if (!shape.mesh || shape.mesh->triangles.empty()) return flat("a mesh");
  std::vector<Geometry> out;
  out.push_back(from_triangles(space, shape.mesh->positions,
                               {shape.mesh->triangles.begin(), shape.mesh->triangles.end()}));
  out.back().body_T_geometry = shape.pose;
  return out;
}

}  // namespace

GeometryData::~GeometryData() {
  if (mesh) dGeomTriMeshDataDestroy(mesh);
}

bool meet(Role a, Role b) {
  if (a == Role::hull || b == Role::hull) return a == b;
  return a != Role::mesh_of_hull || b != Role::mesh_of_hull;
}

Result<std::vector<Geometry>> make_geometries(dSpaceID space, const Shape& shape) {
  const Vec3& s = shape.sizes;
  Geometry g;
  g.body_T_geometry = shape.pose;
  switch (shape.kind) {
    case ShapeKind::box:
      if (!(s[0] > 0 && s[1] > 0 && s[2] > 0)) return flat("a box");
      g.id = dCreateBox(space, s[0], s[1], s[2]);
      break;
    case ShapeKind::sphere:
      if (!(s[0] > 0)) return flat("a sphere");
      g.id = dCreateSphere(space, s[0]);
      break;
    case ShapeKind::cylinder:
      if (!(s[0] > 0 && s[1] > 0)) return flat("a cylinder");
      g.id = dCreateCylinder(space, s[0], s[1]);
      break;
    case ShapeKind::capsule:
      if (!(s[0] > 0 && s[1] >= 0)) return flat("a capsule");
      g.id = s[1] > 0 ? dCreateCapsule(space, s[0], s[1]) : dCreateSphere(space, s[0]);
      break;
    case ShapeKind::convex: return make_convex(space, shape);
    case ShapeKind::mesh: return make_mesh(space, shape);
    case ShapeKind::cone:
      return error(ErrorCode::unsupported, "a cone is no shape of this engine",
                   "Give its convex hull.");
    case ShapeKind::ellipsoid:
      return error(ErrorCode::unsupported, "an ellipsoid is no shape of this engine",
                   "Give its convex hull.");
  }
  std::vector<Geometry> out;
  out.push_back(std::move(g));
  return out;
}

void to_ode(const Pose& pose, dMatrix3 R) {
  for (std::size_t r = 0; r < 3; ++r) {
    for (std::size_t c = 0; c < 3; ++c) R[4 * r + c] = pose.R[3 * r + c];
    R[4 * r + 3] = 0;
  }
}

}  // namespace robomosp::physics_ode
