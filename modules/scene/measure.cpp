// SPDX-License-Identifier: Apache-2.0
// Distances and angles between features.
#include "scene/measure.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>
#include <utility>

#include "spatial/box_tree.h"
#include "spatial/rotation.h"
#include "spatial/vec.h"

namespace robomosp::scene {
namespace {

using spatial::add;
using spatial::cross;
using spatial::dot;
using spatial::norm;
using spatial::scale;
using spatial::sub;
using Triangle = std::array<Vec3, 3>;

constexpr double kParallel = 1e-9;  ///< sine of the angle up to which directions are parallel
constexpr std::size_t kStepsPerCheck = 256;

struct Pair {
  double squared = std::numeric_limits<double>::infinity();
  Vec3 a{}, b{};
  void offer(const Vec3& p, const Vec3& q) {
    const Vec3 d = sub(q, p);
    const double s = dot(d, d);
    if (s < squared) *this = {s, p, q};
  }
};

/// The nearest points of two line segments (Ericson: Real-Time Collision Detection, 5.1.9).
void offer_sides(Pair& best, const Vec3& p1, const Vec3& q1, const Vec3& p2, const Vec3& q2) {
  const Vec3 d1 = sub(q1, p1), d2 = sub(q2, p2), r = sub(p1, p2);
  const double a = dot(d1, d1), e = dot(d2, d2), f = dot(d2, r);
  double s = 0, t = 0;
  if (a > 0 || e > 0) {
    if (!(a > 0)) {
      t = std::clamp(f / e, 0.0, 1.0);
    } else {
      const double c = dot(d1, r);
      if (!(e > 0)) {
        s = std::clamp(-c / a, 0.0, 1.0);
      } else {
        const double b = dot(d1, d2), denominator = a * e - b * b;
        s = denominator > 1e-14 * a * e ? std::clamp((b * f - c * e) / denominator, 0.0, 1.0) : 0;
        t = (b * s + f) / e;
        if (t < 0) t = 0, s = std::clamp(-c / a, 0.0, 1.0);
        else if (t > 1) t = 1, s = std::clamp((b - c) / a, 0.0, 1.0);
      }
    }
  }
  best.offer(add(p1, scale(d1, s)), add(p2, scale(d2, t)));
}

/// The foot of a point on the plane of a triangle, if it is inside the triangle.
std::optional<Vec3> foot_on(const Triangle& t, const Vec3& p) {
  const Vec3 u = sub(t[1], t[0]), v = sub(t[2], t[0]), n = cross(u, v);
  const double n2 = dot(n, n);
  if (!(n2 > 1e-24 * dot(u, u) * dot(v, v))) return std::nullopt;  // a line or a point
  const Vec3 w = sub(p, t[0]);
  const double second = dot(cross(u, w), n) / n2, first = dot(cross(w, v), n) / n2;
  if (first < 0 || second < 0 || first + second > 1) return std::nullopt;
  return sub(p, scale(n, dot(w, n) / n2));
}

/// Where a side passes through a triangle, both distances are 0.
void offer_crossing(Pair& best, const Triangle& t, const Vec3& p, const Vec3& q) {
  const Vec3 n = cross(sub(t[1], t[0]), sub(t[2], t[0]));
  const double a = dot(n, sub(p, t[0])), b = dot(n, sub(q, t[0]));
  if ((a > 0) == (b > 0) || a == b) return;
  const Vec3 at = add(p, scale(sub(q, p), a / (a - b)));
  if (const auto foot = foot_on(t, at)) best = {0, *foot, *foot};
}

void offer_triangles(Pair& best, const Triangle& a, const Triangle& b) {
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 3; ++k)
      offer_sides(best, a[i], a[(i + 1) % 3], b[k], b[(k + 1) % 3]);
  for (std::size_t i = 0; i < 3; ++i) {
    if (const auto foot = foot_on(b, a[i])) best.offer(a[i], *foot);
    if (const auto foot = foot_on(a, b[i])) best.offer(*foot, b[i]);
  }
  for (std::size_t i = 0; i < 3 && best.squared > 0; ++i) {
    offer_crossing(best, b, a[i], a[(i + 1) % 3]);
    offer_crossing(best, a, b[i], b[(i + 1) % 3]);
  }
}

/// The nearest points of two sets of triangles.
Result<Pair> nearest_pair(std::span<const Triangle> a, std::span<const Triangle> b,
                          Progress& progress) {
  const bool is_swapped = a.size() > b.size();
  if (is_swapped) std::swap(a, b);
  std::vector<spatial::Box> leaves;
  leaves.reserve(b.size());
  for (const Triangle& t : b) leaves.push_back(spatial::box_around(t));
  const spatial::BoxTree tree(leaves);
  std::vector<spatial::Box> boxes;
  tree.refit(leaves, boxes);
  Pair best;
  for (std::size_t i = 0; i < a.size() && best.squared > 0; ++i) {
    if (i % kStepsPerCheck == 0 && progress.cancelled())
      return error(ErrorCode::cancelled, "measuring was cancelled");
    tree.near(
        boxes, spatial::box_around(a[i]),
        [&] { return best.squared > 0 ? std::sqrt(best.squared) : -1; },
        [&](std::size_t k) { offer_triangles(best, a[i], b[k]); });
  }
  if (is_swapped) std::swap(best.a, best.b);
  return best;
}

double angle_between(const Vec3& u, const Vec3& v) {
  return std::atan2(norm(cross(u, v)), std::fabs(dot(u, v)));
}

/// Of two endless lines.
double line_distance(const Vec3& p, const Vec3& u, const Vec3& q, const Vec3& v) {
  const Vec3 across = cross(u, v), between = sub(q, p);
  const double n = norm(across);
  return n > kParallel ? std::fabs(dot(between, across)) / n : norm(cross(between, u));
}

void compare_directions(Measurement& m, const MeasuredFeature& a, const MeasuredFeature& b) {
  const bool has_a = a.is_plane() || a.has_axis(), has_b = b.is_plane() || b.has_axis();
  if (a.pose && b.pose) m.angle = norm(spatial::rotation_difference(a.pose->R, b.pose->R));
  if (has_a && has_b) {
    const double angle = angle_between(a.direction, b.direction);
    const bool is_mixed = a.is_plane() != b.is_plane();
    m.angle = is_mixed ? std::numbers::pi / 2 - angle : angle;
    if (a.has_axis() && b.has_axis())
      m.axis_distance = line_distance(a.point, a.direction, b.point, b.direction);
    const double off =
        is_mixed ? std::fabs(dot(a.direction, b.direction)) : norm(cross(a.direction, b.direction));
    if ((a.is_plane() || b.is_plane()) && off <= kParallel)
      m.plane_distance = std::fabs(dot((a.is_plane() ? a : b).direction, sub(b.point, a.point)));
  }
  if (a.has_centre() && b.has_centre()) m.centre_distance = spatial::distance(a.point, b.point);
  for (const auto& [one, other] : {std::pair(&a, &b), std::pair(&b, &a)}) {
    if (!other->has_centre()) continue;
    const Vec3 between = sub(other->point, one->point);
    if (one->is_plane()) m.plane_distance = std::fabs(dot(one->direction, between));
    if (one->has_axis() && !other->has_axis())
      m.axis_distance = norm(cross(one->direction, between));
  }
}

}  // namespace

Result<Measurement> measure(const MeasuredFeature& from, const MeasuredFeature& to,
                            Progress& progress) {
  Measurement m;
  RMP_TRY_ASSIGN(const Pair pair, nearest_pair(from.pieces, to.pieces, progress));
  m.distance = std::sqrt(pair.squared);
  if (!std::isfinite(m.distance))
    return error(ErrorCode::invalid_argument, "the two places are too far apart to measure",
                 "Give places less than 1e150 m apart.");
  m.from = pair.a;
  m.to = pair.b;
  m.bound = from.bound + to.bound;
  compare_directions(m, from, to);
  return m;
}

}  // namespace robomosp::scene
