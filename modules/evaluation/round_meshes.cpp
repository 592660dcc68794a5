// SPDX-License-Identifier: Apache-2.0
#include "evaluation/round_meshes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "spatial/convex_hull.h"
#include "spatial/mass.h"
#include "spatial/pose.h"
#include "spatial/principal.h"
#include "spatial/vec.h"

namespace robomosp::evaluation {
namespace {

constexpr std::size_t kMostCircles = 24;
constexpr double kTurn = 2 * std::numbers::pi;
constexpr double kOffCircle = 1e-3;       ///< of a corner from its circle, of the extent
constexpr double kExactly = 2e-6;         ///< the same of single precision
constexpr double kSphereShare = 0.4;      ///< of a sphere's surface that has to be there
constexpr double kSagitta = 0.01;         ///< of a face within the sphere, of the radius
constexpr std::size_t kFewestSides = 8;   ///< of what may be meant round
constexpr double kSameNormal = 1 - 1e-9;  ///< cosine of normals of one face
constexpr std::size_t kMostFaces = 3;     ///< whose normals are looked at
constexpr double kUneven = 1.02;          ///< of a gap between corners

/// Centre of mass, principal axes and normals of large faces of a hull.
struct HullAxes {
  Vec3 middle{};
  std::vector<Vec3> axes;
};
HullAxes axes_of_hull(const spatial::Hull& hull) {
  HullAxes out;
  double volume = 0;
  std::array<double, 6> second{};  // xx yy zz xy xz yz about hull.middle
  Vec3 first{};
  struct Face {
    Vec3 normal;
    double area;
  };
  std::vector<Face> faces;
  for (const auto& t : hull.triangles) {
    const Vec3 a = spatial::sub(hull.points[t[0]], hull.middle),
               b = spatial::sub(hull.points[t[1]], hull.middle),
               c = spatial::sub(hull.points[t[2]], hull.middle);
    const Vec3 n = spatial::cross(spatial::sub(b, a), spatial::sub(c, a));
    const double six = spatial::dot(a, spatial::cross(b, c)), twice = spatial::norm(n);
    volume += six / 6;
    for (std::size_t k = 0; k < 3; ++k) first[k] += six / 24 * (a[k] + b[k] + c[k]);
    // Integral of x_i x_j over the tetrahedron with the origin.
    const auto moment = [&](std::size_t i, std::size_t j) {
      return six / 120 *
             ((a[i] + b[i] + c[i]) * (a[j] + b[j] + c[j]) + a[i] * a[j] + b[i] * b[j] +
              c[i] * c[j]);
    };
    second[0] += moment(0, 0), second[1] += moment(1, 1), second[2] += moment(2, 2);
    second[3] += moment(0, 1), second[4] += moment(0, 2), second[5] += moment(1, 2);
    if (!(twice > 0)) continue;
    const Vec3 unit = spatial::scale(n, 1 / twice);
    const auto same = std::find_if(faces.begin(), faces.end(), [&](const Face& f) {
      return std::fabs(spatial::dot(f.normal, unit)) > kSameNormal;
    });
    if (same != faces.end()) same->area += twice;
    else if (faces.size() < 4096) faces.push_back({unit, twice});
  }
  if (!(volume > 0)) return out;
  const Vec3 com = spatial::scale(first, 1 / volume);
  out.middle = spatial::add(hull.middle, com);
  const double x = second[0] / volume - com[0] * com[0], y = second[1] / volume - com[1] * com[1],
               z = second[2] / volume - com[2] * com[2];
  Sym3 inertia{};
  inertia.xx = y + z, inertia.yy = x + z, inertia.zz = x + y;
  inertia.xy = com[0] * com[1] - second[3] / volume;
  inertia.xz = com[0] * com[2] - second[4] / volume;
  inertia.yz = com[1] * com[2] - second[5] / volume;
  const spatial::Principal p = spatial::principal(inertia);
  for (std::size_t k = 0; k < 3; ++k) out.axes.push_back({p.axes[k], p.axes[3 + k], p.axes[6 + k]});
  std::sort(faces.begin(), faces.end(),
            [](const Face& f, const Face& g) { return f.area > g.area; });
  for (std::size_t i = 0; i < std::min(kMostFaces, faces.size()); ++i)
    out.axes.push_back(faces[i].normal);
  return out;
}

/// A frame at a point with z along an axis.
Pose frame_along(const Vec3& at, const Vec3& axis) {
  Vec3 side{};
  const auto least = static_cast<std::size_t>(
      std::min_element(axis.begin(), axis.end(),
                       [](double a, double b) { return std::fabs(a) < std::fabs(b); }) -
      axis.begin());
  side[least] = 1;
  const Vec3 x = spatial::unit(spatial::cross(side, axis)), y = spatial::cross(axis, x);
  Pose out;
  for (std::size_t k = 0; k < 3; ++k)
    out.R[3 * k] = x[k], out.R[3 * k + 1] = y[k], out.R[3 * k + 2] = axis[k];
  out.p = at;
  return out;
}

/// The centre and radius of the sphere through points, by least squares of |p|^2 = 2 c p + d.
std::optional<std::pair<Vec3, double>> sphere_through(std::span<const Vec3> points,
                                                      const Vec3& about) {
  std::array<std::array<double, 5>, 4> a{};
  for (const Vec3& at : points) {
    const Vec3 p = spatial::sub(at, about);
    const std::array<double, 5> row{2 * p[0], 2 * p[1], 2 * p[2], 1, spatial::dot(p, p)};
    for (std::size_t i = 0; i < 4; ++i)
      for (std::size_t k = 0; k < 5; ++k) a[i][k] += row[i] * row[k];
  }
  for (std::size_t i = 0; i < 4; ++i) {
    std::size_t best = i;
    for (std::size_t r = i + 1; r < 4; ++r)
      if (std::fabs(a[r][i]) > std::fabs(a[best][i])) best = r;
    std::swap(a[i], a[best]);
    if (!(std::fabs(a[i][i]) > 0)) return std::nullopt;
    for (std::size_t r = 0; r < 4; ++r) {
      if (r == i) continue;
      const double f = a[r][i] / a[i][i];
      for (std::size_t k = i; k < 5; ++k) a[r][k] -= f * a[i][k];
    }
  }
  const Vec3 c{a[0][4] / a[0][0], a[1][4] / a[1][1], a[2][4] / a[2][2]};
  const double square = a[3][4] / a[3][3] + spatial::dot(c, c);
  if (!(square > 0) || !std::isfinite(square)) return std::nullopt;
  return std::pair{spatial::add(about, c), std::sqrt(square)};
}

/// The sphere whose surface a mesh mostly is.
std::shared_ptr<const RoundOutside> sphere_of(const Mesh& mesh, std::span<const Vec3> points,
                                              const spatial::Hull& hull) {
  const auto found = sphere_through(hull.points, hull.middle);
  if (!found) return nullptr;
  const auto& [centre, radius] = *found;
  const auto off = [&](const Vec3& p) { return spatial::distance(p, centre) - radius; };
  for (const Vec3& p : hull.points)
    if (std::fabs(off(p)) > kExactly * radius) return nullptr;
  double area = 0;
  for (std::size_t i = 0; i + 2 < mesh.triangles.size(); i += 3) {
    const Vec3 &a = points[mesh.triangles[i]], &b = points[mesh.triangles[i + 1]],
               &c = points[mesh.triangles[i + 2]];
    const Vec3 middle = spatial::scale(spatial::add(a, spatial::add(b, c)), 1.0 / 3);
    if (off(middle) < -kSagitta * radius ||
        std::max({std::fabs(off(a)), std::fabs(off(b)), std::fabs(off(c))}) > kExactly * radius)
      continue;
    area += spatial::norm(spatial::cross(spatial::sub(b, a), spatial::sub(c, a))) / 2;
  }
  if (area < kSphereShare * 2 * kTurn * radius * radius) return nullptr;
  RoundOutside out;
  out.pose.p = centre;
  out.sphere = radius;
  return std::make_shared<const RoundOutside>(std::move(out));
}

/// Corners of a circle about z; 0 where a gap between them is larger than in a regular polygon of
/// kFewestSides.
std::size_t corners_around(std::vector<double> angles) {
  std::sort(angles.begin(), angles.end());
  std::vector<double> apart;  // corners of neighbouring triangles are there several times
  for (const double a : angles)
    if (apart.empty() || a - apart.back() > 1e-6) apart.push_back(a);
  if (apart.size() > 1 && apart.front() + kTurn - apart.back() <= 1e-6) apart.pop_back();
  if (apart.size() < kFewestSides) return 0;
  double gap = apart.front() + kTurn - apart.back();
  for (std::size_t i = 1; i < apart.size(); ++i) gap = std::max(gap, apart[i] - apart[i - 1]);
  if (gap > kUneven * kTurn / static_cast<double>(kFewestSides)) return 0;
  // As many as a regular polygon has whose gaps are as large.
  return static_cast<std::size_t>(kTurn / gap * kUneven);
}

/// Sides about z of a frame, the fewest of all circles of the outline; 0 = it does not turn about
/// it.
std::size_t sides_about(std::span<const Vec3> points, const Pose& frame,
                        std::span<const std::array<double, 2>> profile) {
  if (profile.empty()) return 0;
  double extent = profile.back()[1] - profile.front()[1];
  for (const auto& circle : profile) extent = std::max(extent, 2 * circle[0]);
  const double near = kOffCircle * extent;
  const Pose back = spatial::inverse(frame);
  std::vector<std::vector<double>> angles(profile.size());
  for (const Vec3& at : points) {
    const Vec3 p = spatial::transform(back, at);
    const double r = std::hypot(p[0], p[1]);
    for (std::size_t i = 0; i < profile.size(); ++i)
      if (std::fabs(r - profile[i][0]) <= near && std::fabs(p[2] - profile[i][1]) <= near)
        angles[i].push_back(std::atan2(p[1], p[0]));
  }
  std::size_t least = points.size();
  for (const auto& all : angles) least = std::min(least, corners_around(all));
  return least;
}

}  // namespace

std::vector<std::array<double, 2>> turned_profile(std::span<const Vec3> vertices,
                                                  const Pose& frame) {
  std::vector<std::array<double, 2>> points;
  const Pose back = spatial::inverse(frame);
  for (const Vec3& v : vertices) {
    const Vec3 p = spatial::transform(back, v);
    points.push_back({std::hypot(p[0], p[1]), p[2]});
  }
  if (points.empty()) return points;
  std::sort(points.begin(), points.end(), [](const auto& a, const auto& b) {
    return a[1] < b[1] || (a[1] == b[1] && a[0] > b[0]);
  });
  const double extent = std::max(points.back()[1] - points.front()[1],
                                 2 * (*std::max_element(points.begin(), points.end()))[0]);
  // Of single precision, also where the mesh is far from its origin.
  double farthest = 0;
  for (const Vec3& v : vertices)
    for (const double x : v) farthest = std::max(farthest, std::fabs(x));
  const double rounding =
      std::max(1e-6 * extent, 4.0 * std::numeric_limits<float>::epsilon() * farthest);
  std::vector<std::array<double, 2>> hull;
  for (const auto& p : points) {
    if (!hull.empty() && p[1] - hull.back()[1] <= rounding) {
      hull.back()[0] = std::max(hull.back()[0], p[0]);
      if (hull.size() < 2) continue;
    } else {
      hull.push_back(p);
    }
    // Keeps the chain convex, seen from the axis.
    while (hull.size() >= 3) {
      const auto &a = hull[hull.size() - 3], &b = hull[hull.size() - 2], &c = hull.back();
      const double out = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
      if (out > rounding * extent) break;
      hull.erase(hull.end() - 2);
    }
  }
  std::erase_if(hull, [&](const auto& p) { return p[0] <= rounding; });
  if (hull.size() <= kMostCircles) return hull;
  // Fewer of a rounded outline, with its ends and its greatest radius.
  const auto widest =
      static_cast<std::size_t>(std::max_element(hull.begin(), hull.end()) - hull.begin());
  std::vector<std::array<double, 2>> fewer;
  for (std::size_t i = 0, next = 0; i < hull.size(); ++i) {
    const std::size_t wanted = next * (hull.size() - 1) / (kMostCircles - 2);
    if (i == wanted) ++next;
    if (i == wanted || i == widest) fewer.push_back(hull[i]);
  }
  return fewer;
}

MeshRoundness mesh_roundness(const Mesh& mesh) {
  MeshRoundness out;
  const std::vector<Vec3> points = spatial::vertices(mesh);
  const auto hull = spatial::convex_hull(points);
  if (!hull) return out;
  if (auto sphere = sphere_of(mesh, points, *hull)) {
    out.outside = std::move(sphere);
    out.sides = hull->points.size();
    return out;
  }
  const HullAxes found = axes_of_hull(*hull);
  for (const Vec3& axis : found.axes) {
    const Pose frame = frame_along(found.middle, axis);
    std::vector<std::array<double, 2>> profile = turned_profile(points, frame);
    const std::size_t sides = sides_about(points, frame, profile);
    // An axis that is a little off has more circles.
    const bool is_better = sides > out.sides || (sides > 0 && sides == out.sides && out.outside &&
                                                 profile.size() < out.outside->profile.size());
    if (!is_better) continue;
    out.sides = sides;
    if (sides < kFewestRoundSides) continue;
    // Two circles of one radius up to rounding are those of a cylinder.
    if (profile.size() == 2 && std::fabs(profile[0][0] - profile[1][0]) <= kExactly * profile[0][0])
      profile[0][0] = profile[1][0] = std::max(profile[0][0], profile[1][0]);
    RoundOutside outside;
    outside.pose = frame;
    outside.profile = std::move(profile);
    out.outside = std::make_shared<const RoundOutside>(std::move(outside));
  }
  return out;
}

}  // namespace robomosp::evaluation
