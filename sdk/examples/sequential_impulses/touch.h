// SPDX-License-Identifier: Apache-2.0
// Where balls and boxes touch, or nearly: points with the gap along one normal a pair. Boxes by the
// axis that separates them most, of fifteen (S. Gottschalk, M. C. Lin, D. Manocha, SIGGRAPH 1996),
// and by clipping the face of one against the sides of the other's (I. E. Sutherland,
// G. W. Hodgman, Comm. ACM 17 (1974) 32).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "spatial/pose.h"
#include "spatial/vec.h"

namespace sequential_impulses {

using namespace robomosp::spatial;
using robomosp::Pose;
using robomosp::Vec3;

/// A ball where radius > 0, else a box; in the world.
struct Solid {
  Pose pose;
  Vec3 half{};
  double radius = 0;
};
struct Touch {
  Vec3 point{}, normal{};  ///< the normal leads to the first of the pair
  double gap = 0;          ///< < 0 within each other
  std::size_t corner = 0;  ///< to know it again in the next step
};

inline Vec3 column(const Pose& t, std::size_t k) { return {t.R[k], t.R[3 + k], t.R[6 + k]}; }
/// Half the width of a box along n.
inline double reach(const Solid& s, const Vec3& n) {
  double sum = 0;
  for (std::size_t k = 0; k < 3; ++k) sum += s.half[k] * std::fabs(dot(n, column(s.pose, k)));
  return sum;
}

inline void touch_balls(const Solid& a, const Solid& b, double margin, std::vector<Touch>& out) {
  const Vec3 way = sub(a.pose.p, b.pose.p);
  const double apart = norm(way), gap = apart - a.radius - b.radius;
  if (gap > margin) return;
  const Vec3 n = apart > 0 ? scale(way, 1 / apart) : Vec3{0, 0, 1};
  out.push_back({add(b.pose.p, scale(n, b.radius + gap / 2)), n, gap, 0});
}

/// A ball a and a box b.
inline void touch_ball_box(const Solid& a, const Solid& b, double margin, std::vector<Touch>& out) {
  const Vec3 p = rotate_back(b.pose, sub(a.pose.p, b.pose.p));
  Vec3 near = p, n{};
  for (std::size_t k = 0; k < 3; ++k) near[k] = std::clamp(p[k], -b.half[k], b.half[k]);
  double apart = norm(sub(p, near));
  if (apart > 0) {
    n = scale(sub(p, near), 1 / apart);
  } else {  // the centre is inside: out through the nearest face
    std::size_t face = 0;
    for (std::size_t k = 1; k < 3; ++k)
      if (b.half[k] - std::fabs(p[k]) < b.half[face] - std::fabs(p[face])) face = k;
    n[face] = p[face] < 0 ? -1 : 1;
    near[face] = n[face] * b.half[face];
    apart = std::fabs(p[face]) - b.half[face];
  }
  if (apart - a.radius > margin) return;
  out.push_back({transform(b.pose, near), rotate(b.pose, n), apart - a.radius, 0});
}

/// The points of one face of `other` over the face of `reference` whose outward normal is `out`.
inline void clip_faces(const Solid& reference, const Solid& other, const Vec3& out, double margin,
                       bool reference_is_b, std::vector<Touch>& touches) {
  const auto steepest = [](const Solid& s, const Vec3& n) {
    std::size_t best = 0;
    for (std::size_t k = 1; k < 3; ++k)
      if (std::fabs(dot(n, column(s.pose, k))) > std::fabs(dot(n, column(s.pose, best)))) best = k;
    return best;
  };
  const std::size_t axis = steepest(reference, out), facing = steepest(other, out);
  const double side = dot(out, column(other.pose, facing)) > 0 ? -1 : 1;
  const Vec3 u = scale(column(other.pose, (facing + 1) % 3), other.half[(facing + 1) % 3]);
  const Vec3 v = scale(column(other.pose, (facing + 2) % 3), other.half[(facing + 2) % 3]);
  const Vec3 middle =
      add(other.pose.p, scale(column(other.pose, facing), side * other.half[facing]));
  std::vector<Vec3> face{add(middle, add(u, v)), add(middle, sub(u, v)), sub(middle, add(u, v)),
                         sub(middle, sub(u, v))};
  for (std::size_t k = 0; k < 3; ++k)
    for (const double sign : {-1.0, 1.0}) {
      if (k == axis) continue;
      const Vec3 n = scale(column(reference.pose, k), sign);
      const double limit = reference.half[k];
      std::vector<Vec3> kept;
      for (std::size_t i = 0; i < face.size(); ++i) {
        const Vec3 &p = face[i], &q = face[(i + 1) % face.size()];
        const double at_p = dot(n, sub(p, reference.pose.p)) - limit;
        const double at_q = dot(n, sub(q, reference.pose.p)) - limit;
        if (at_p <= 0) kept.push_back(p);
        if ((at_p < 0 && at_q > 0) || (at_p > 0 && at_q < 0))
          kept.push_back(add(p, scale(sub(q, p), at_p / (at_p - at_q))));
      }
      face = std::move(kept);
    }
  for (std::size_t i = 0; i < face.size(); ++i) {
    const double gap = dot(out, sub(face[i], reference.pose.p)) - reference.half[axis];
    if (gap > margin) continue;
    touches.push_back({face[i], scale(out, reference_is_b ? 1 : -1), gap, i});
  }
}

/// One point where the edges of a along its axis i and of b along its axis k cross.
inline Touch cross_edges(const Solid& a, const Solid& b, std::size_t i, std::size_t k,
                         const Vec3& n, double gap) {
  // The edges nearest to each other: those that lie farthest along -n on a and along n on b.
  Vec3 p = a.pose.p, q = b.pose.p;
  for (std::size_t j = 0; j < 3; ++j) {
    const Vec3 x = column(a.pose, j), y = column(b.pose, j);
    if (j != i) p = add(p, scale(x, dot(n, x) > 0 ? -a.half[j] : a.half[j]));
    if (j != k) q = add(q, scale(y, dot(n, y) > 0 ? b.half[j] : -b.half[j]));
  }
  const Vec3 x = column(a.pose, i), y = column(b.pose, k), r = sub(q, p);
  const double c = dot(x, y), s = (dot(x, r) - c * dot(y, r)) / (1 - c * c);
  const Vec3 on_a = add(p, scale(x, std::clamp(s, -a.half[i], a.half[i])));
  return {sub(on_a, scale(n, gap / 2)), n, gap, 8 + 3 * i + k};
}

inline void touch_boxes(const Solid& a, const Solid& b, double margin, std::vector<Touch>& out) {
  const Vec3 way = sub(a.pose.p, b.pose.p);
  double best = -std::numeric_limits<double>::infinity();
  Vec3 normal{};
  std::size_t kind = 0;  // 0 face of a, 1 face of b, 2 + 3 i + k edges
  // Faces are kept unless another axis separates clearly better, so that boxes at rest stay put.
  const auto consider = [&](Vec3 n, std::size_t which, double handicap) {
    const double length = norm(n);
    if (!(length > 1e-6)) return;
    n = scale(n, (dot(n, way) < 0 ? -1 : 1) / length);
    const double apart = dot(n, way) - reach(a, n) - reach(b, n);
    if (apart - handicap > best) best = apart - handicap, normal = n, kind = which;
  };
  constexpr double kFaceFirst = 1e-6;
  for (std::size_t k = 0; k < 3; ++k) consider(column(b.pose, k), 1, 0);
  for (std::size_t k = 0; k < 3; ++k) consider(column(a.pose, k), 0, kFaceFirst);
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 3; ++k)
      consider(cross(column(a.pose, i), column(b.pose, k)), 2 + 3 * i + k, 2 * kFaceFirst);
  if (best > margin) return;
  if (kind == 0) return clip_faces(a, b, scale(normal, -1), margin, false, out);
  if (kind == 1) return clip_faces(b, a, normal, margin, true, out);
  const double gap = dot(normal, way) - reach(a, normal) - reach(b, normal);
  out.push_back(cross_edges(a, b, (kind - 2) / 3, (kind - 2) % 3, normal, gap));
}

inline void touch(const Solid& a, const Solid& b, double margin, std::vector<Touch>& out) {
  if (a.radius > 0 && b.radius > 0) return touch_balls(a, b, margin, out);
  if (a.radius > 0) return touch_ball_box(a, b, margin, out);
  if (b.radius == 0) return touch_boxes(a, b, margin, out);
  const std::size_t first = out.size();
  touch_ball_box(b, a, margin, out);
  for (std::size_t i = first; i < out.size(); ++i) out[i].normal = scale(out[i].normal, -1);
}

}  // namespace sequential_impulses
