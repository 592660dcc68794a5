// SPDX-License-Identifier: Apache-2.0
#include "geometry.h"

#include <algorithm>
#include <cmath>
#include <limits>
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
  g.tag->role = Role::hull;
  g.body_T_geometry = shape.pose;
  g.body_T_geometry.p = spatial::transform(shape.pose, hull->middle);
  std::vector<float> points(g.data->points.begin(), g.data->points.end());
  std::vector<dTriIndex> triangles;
  for (const auto& t : hull->triangles) triangles.insert(triangles.end(), t.begin(), t.end());
  Geometry mesh = from_triangles(space, std::move(points), std::move(triangles));
  mesh.tag->role = Role::mesh_of_hull;
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

// ---- round outsides ----

/// Of the triangles' distance from a round surface: what counts as on it, more than the mesh needs.
constexpr double kMore = 1.5, kOnSurface = 2e-6;
constexpr double kAlong = 0.7;        ///< cosine of a triangle's normal and the surface's
constexpr double kRimShare = 2e-4;    ///< of a radius: the thickness of a rim
constexpr double kEndNormal = 0.999;  ///< cosine of an end's normal and the axis

Vec3 middle_of(const std::array<Vec3, 3>& t) {
  return spatial::scale(spatial::add(t[0], spatial::add(t[1], t[2])), 1.0 / 3);
}

double squared_distance(const Vec3& p, const std::array<Vec3, 3>& t) {
  // The nearest point of a triangle: inside, or on the nearest edge.
  const Vec3 n = spatial::cross(spatial::sub(t[1], t[0]), spatial::sub(t[2], t[0]));
  const double n2 = spatial::dot(n, n);
  bool is_inside = n2 > 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3 &a = t[k], &b = t[(k + 1) % 3];
    const Vec3 e = spatial::sub(b, a), d = spatial::sub(p, a);
    if (spatial::dot(spatial::cross(e, d), n) < 0) is_inside = false;
    const double e2 = spatial::dot(e, e);
    const double u = e2 > 0 ? std::clamp(spatial::dot(d, e) / e2, 0.0, 1.0) : 0;
    const Vec3 off = spatial::sub(d, spatial::scale(e, u));
    least = std::min(least, spatial::dot(off, off));
  }
  if (!is_inside) return least;
  const double h = spatial::dot(spatial::sub(p, t[0]), n);
  return h * h / n2;
}

/// Whether a way from p to q goes through a triangle (Moller and Trumbore, J. Graphics Tools 2
/// (1997) 21).
bool crosses(const Vec3& p, const Vec3& q, const std::array<Vec3, 3>& t) {
  const Vec3 d = spatial::sub(q, p), e = spatial::sub(t[1], t[0]), f = spatial::sub(t[2], t[0]);
  const Vec3 h = spatial::cross(d, f);
  const double det = spatial::dot(e, h);
  if (det == 0) return false;
  const Vec3 s = spatial::sub(p, t[0]), c = spatial::cross(s, e);
  const double u = spatial::dot(s, h) / det, v = spatial::dot(d, c) / det,
               w = spatial::dot(f, c) / det;
  return u >= 0 && v >= 0 && u + v <= 1 && w >= 0 && w <= 1;
}

/// Divides the mesh's triangles into those on the round surface and the others, which are kept.
std::shared_ptr<const Opening> divide(const Shape& shape, const Pose& round, double radius,
                                      double length, std::vector<std::uint32_t>& others) {
  std::vector<Opening::Triangle> on, walls;
  const std::vector<Vec3> points = spatial::vertices(*shape.mesh);
  const Pose back = spatial::inverse(round);
  const double at_all = kOnSurface * 2 * std::max(radius, length);
  double sagitta = 0;
  const auto& all = shape.mesh->triangles;
  // Corners are on the surface to rounding; what lies between them is not.
  const auto off = [&](const Vec3& p) { return foot_on(p, radius, length).distance; };
  for (std::size_t i = 0; i + 2 < all.size(); i += 3) {
    Opening::Triangle t;
    for (std::size_t k = 0; k < 3; ++k) t[k] = spatial::transform(back, points[all[i + k]]);
    const Vec3 n = spatial::cross(spatial::sub(t[1], t[0]), spatial::sub(t[2], t[0]));
    const double twice = spatial::norm(n);
    const Vec3 middle = middle_of(t);
    const Foot foot = foot_on(middle, radius, length);
    const bool is_on = std::all_of(t.begin(), t.end(),
                                   [&](const Vec3& p) { return std::fabs(off(p)) <= at_all; }) &&
                       twice > 0 && spatial::dot(n, foot.normal) > kAlong * twice;
    if (!is_on) {
      others.insert(others.end(), {all[i], all[i + 1], all[i + 2]});
      walls.push_back(t);
      continue;
    }
    for (std::size_t k = 0; k < 3; ++k)
      sagitta = std::max(sagitta, -off(spatial::scale(spatial::add(t[k], t[(k + 1) % 3]), 0.5)));
    sagitta = std::max(sagitta, -foot.distance);
    on.push_back(t);
  }
  return std::make_shared<Opening>(radius, length, std::move(on), std::move(walls),
                                   kMore * sagitta + at_all);
}

/// Mean distance from the axis of the points of a face across it that looks up or down, of its
/// radius.
double arm_of_end(const Mesh& mesh, const Pose& round, double radius, double z, bool looks_up) {
  const Pose back = spatial::inverse(round);
  const std::vector<Vec3> points = spatial::vertices(mesh);
  double area = 0, moment = 0;
  for (std::size_t i = 0; i + 2 < mesh.triangles.size(); i += 3) {
    Opening::Triangle t;
    for (std::size_t k = 0; k < 3; ++k)
      t[k] = spatial::transform(back, points[mesh.triangles[i + k]]);
    const Vec3 n = spatial::cross(spatial::sub(t[1], t[0]), spatial::sub(t[2], t[0]));
    const double twice = spatial::norm(n);
    const Vec3 middle = middle_of(t);
    if (!((looks_up ? n[2] : -n[2]) > kEndNormal * twice) ||
        std::fabs(middle[2] - z) > kOnSurface * 2 * std::max(radius, std::fabs(z)))
      continue;
    // By four points (exact for polynomials of degree 2).
    double r = 3.0 / 4 * std::hypot(middle[0], middle[1]);
    for (const Vec3& p : t) r += std::hypot(p[0], p[1]) / 12;
    area += twice / 2, moment += r * twice / 2;
  }
  return area > 0 ? moment / area / radius : 2.0 / 3;
}

/// A sphere or one cylinder with openings: the primitive, where the mesh is on its surface, and the
/// triangles of bores and slots.
Result<std::vector<Geometry>> make_bored(dSpaceID space, const Shape& shape, const Pose& round,
                                         double radius, double length) {
  std::vector<std::uint32_t> others;
  auto opening = divide(shape, round, radius, length, others);
  std::vector<Geometry> out;
  Geometry& g = out.emplace_back();
  g.id = length > 0 ? dCreateCylinder(space, radius, length) : dCreateSphere(space, radius);
  g.body_T_geometry = spatial::compose(shape.pose, round);
  g.tag->opening = std::move(opening);
  if (length > 0)
    g.tag->arm = {arm_of_end(*shape.mesh, round, radius, -length / 2, false),
                  arm_of_end(*shape.mesh, round, radius, length / 2, true)};
  if (!others.empty()) {
    out.push_back(from_triangles(space, shape.mesh->positions, {others.begin(), others.end()}));
    out.back().body_T_geometry = shape.pose;
    out.back().tag->is_beside_round = true;
  }
  return out;
}

Result<std::vector<Geometry>> make_round(dSpaceID space, const Shape& shape,
                                         const RoundOutside& outside) {
  const auto& circles = outside.profile;
  if (outside.sphere > 0 && shape.mesh)
    return make_bored(space, shape, outside.pose, outside.sphere, 0);
  const bool is_cylinder =
      circles.size() == 2 && circles[0][0] == circles[1][0] && circles[1][1] > circles[0][1];
  if (is_cylinder && shape.mesh) {
    Pose round = outside.pose;
    round.p = spatial::transform(round, Vec3{0, 0, 0.5 * (circles[0][1] + circles[1][1])});
    return make_bored(space, shape, round, circles[0][0], circles[1][1] - circles[0][1]);
  }
  RMP_TRY_ASSIGN(auto out, shape.kind == ShapeKind::convex ? make_convex(space, shape)
                                                           : make_mesh(space, shape));
  for (Geometry& g : out) g.tag->is_beside_round = true;
  for (std::size_t i = 0; i < circles.size(); ++i) {
    const auto [radius, z] = circles[i];
    if (!(radius > 0)) continue;
    Geometry& g = out.emplace_back();
    g.tag->role = Role::rim;
    // Within the ends.
    const double thick = kRimShare * radius;
    const double shift = circles.size() == 1       ? 0
                         : i == 0                  ? thick / 2
                         : i + 1 == circles.size() ? -thick / 2
                                                   : 0;
    g.id = dCreateCylinder(space, radius, thick);
    g.body_T_geometry = spatial::compose(
        shape.pose, spatial::compose(outside.pose, spatial::translation({0, 0, z + shift})));
    if (shape.mesh && i == 0)
      g.tag->arm[0] = arm_of_end(*shape.mesh, outside.pose, radius, z, false);
    if (shape.mesh && i + 1 == circles.size())
      g.tag->arm[1] = arm_of_end(*shape.mesh, outside.pose, radius, z, true);
    if (i > 0) g.tag->sides[0] = {circles[i - 1][0] - radius, circles[i - 1][1] - z};
    if (i + 1 < circles.size())
      g.tag->sides[1] = {circles[i + 1][0] - radius, circles[i + 1][1] - z};
  }
  // Rims first: where they touch, the triangles between them need not.
  std::rotate(out.begin(),
              std::find_if(out.begin(), out.end(),
                           [](const Geometry& g) { return g.tag->role == Role::rim; }),
              out.end());
  return out;
}

}  // namespace

Foot foot_on(const Vec3& p, double radius, double length) {
  if (length <= 0) {
    const double r = spatial::norm(p);
    return {r - radius, r > 0 ? spatial::scale(p, 1 / r) : Vec3{0, 0, 1}};
  }
  const double r = std::hypot(p[0], p[1]);
  const double out = r - radius, above = std::fabs(p[2]) - length / 2;
  if (above > out) return {above, {0, 0, p[2] < 0 ? -1.0 : 1.0}};
  return {out, r > 0 ? Vec3{p[0] / r, p[1] / r, 0} : Vec3{1, 0, 0}};
}

Opening::Opening(double radius, double length, std::vector<Triangle> on,
                 std::vector<Triangle> walls, double tolerance)
    : radius_(radius),
      length_(length),
      tolerance_(tolerance),
      on_(bounded(on)),
      walls_(bounded(walls)) {}

std::vector<Opening::Bounded> Opening::bounded(const std::vector<Triangle>& all) {
  std::vector<Bounded> out;
  for (const Triangle& t : all) {
    Bounded b{t, t[0], t[0]};
    for (const Vec3& p : t)
      for (std::size_t k = 0; k < 3; ++k)
        b.low[k] = std::min(b.low[k], p[k]), b.high[k] = std::max(b.high[k], p[k]);
    out.push_back(b);
  }
  return out;
}

bool Opening::is_there(const Vec3& point, const Vec3& outward, double depth) const {
  const Foot foot = foot_on(point, radius_, length_);
  const Vec3 p = spatial::sub(point, spatial::scale(foot.normal, foot.distance));
  const Vec3 q = spatial::sub(p, spatial::scale(outward, depth));
  const auto is_near = [&](const Bounded& b, const Vec3& from, const Vec3& to, double reach) {
    for (std::size_t k = 0; k < 3; ++k)
      if (std::max(from[k], to[k]) < b.low[k] - reach ||
          std::min(from[k], to[k]) > b.high[k] + reach)
        return false;
    return true;
  };
  const bool is_on = std::any_of(on_.begin(), on_.end(), [&](const Bounded& b) {
    return is_near(b, p, p, tolerance_) &&
           squared_distance(p, b.triangle) <= tolerance_ * tolerance_;
  });
  if (!is_on) return false;
  // What goes through a wall is in a bore.
  return std::none_of(walls_.begin(), walls_.end(), [&](const Bounded& b) {
    return is_near(b, p, q, 0) && crosses(p, q, b.triangle);
  });
}

GeometryData::~GeometryData() {
  if (mesh) dGeomTriMeshDataDestroy(mesh);
}

bool meet(Role a, Role b) {
  if (a == Role::hull || b == Role::hull) return a == b;
  if (a == Role::rim && b == Role::rim) return false;
  return a != Role::mesh_of_hull || b != Role::mesh_of_hull;
}

Result<std::vector<Geometry>> make_geometries(dSpaceID space, const Shape& shape) {
  const Vec3& s = shape.sizes;
  Geometry g;
  g.body_T_geometry = shape.pose;
  if (const RoundOutside* outside = outside_of(shape)) return make_round(space, shape, *outside);
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
      return error(ErrorCode::unsupported, "this engine does not support cones",
                   "Give its convex hull.");
    case ShapeKind::ellipsoid:
      return error(ErrorCode::unsupported, "this engine does not support ellipsoids",
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
