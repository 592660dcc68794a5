// SPDX-License-Identifier: Apache-2.0
#include "geometry/same_edges.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "spatial/vec.h"

namespace robomosp::geometry {
namespace {

using spatial::dot;
using spatial::norm;
using spatial::scale;
using spatial::sub;
using spatial::unit;

/// What an edge is known by.
struct EdgeMark {
  CsgEdge::Kind kind = CsgEdge::Kind::curve;
  bool is_closed = false;
  Vec3 place{};      ///< its middle, of a circle the centre [m]
  Vec3 direction{};  ///< along it, of a circle its axis; the sign means nothing
  /// Outward normals of its faces: in the solid's axes, of a circle along its axis and radius.
  std::array<Vec3, 2> normals{};
  double length = 0;  ///< [m]
};

EdgeMark mark_of(const CsgEdge& e) {
  EdgeMark m{e.kind, e.is_closed, {}, {}, {}, e.length};
  const CsgEdgePoint& middle = e.points[e.points.size() / 2];
  if (e.kind == CsgEdge::Kind::circle) {
    m.place = e.centre, m.direction = e.axis;
    const Vec3 out = unit(sub(middle.position, e.centre));
    // About which of the two directions of the axis the circle runs means nothing.
    Vec3 axis = e.axis;
    for (std::size_t k = 3; k-- > 0;) {
      if (std::fabs(axis[k]) < 1e-9) continue;
      if (axis[k] < 0) axis = scale(axis, -1);
      break;
    }
    for (std::size_t k = 0; k < 2; ++k)
      m.normals[k] = {dot(middle.normals[k], axis), dot(middle.normals[k], out), 0};
    return m;
  }
  m.place = e.points.size() == 2
                ? scale(spatial::add(e.points[0].position, e.points[1].position), 0.5)
                : middle.position;
  m.direction = middle.tangent;
  m.normals = middle.normals;
  return m;
}

/// The box around the marks, to compare places within it.
struct MarkBox {
  Vec3 least{}, size{};
  double diagonal = 0;
};
MarkBox box_of(const std::vector<EdgeMark>& marks) {
  constexpr double kFar = std::numeric_limits<double>::max();
  Vec3 least{kFar, kFar, kFar}, most{-kFar, -kFar, -kFar};
  for (const EdgeMark& m : marks)
    for (std::size_t k = 0; k < 3; ++k) {
      least[k] = std::min(least[k], m.place[k]);
      most[k] = std::max(most[k], m.place[k]);
    }
  const Vec3 size = sub(most, least);
  return {least, size, norm(size)};
}

double square(const Vec3& a, const Vec3& b) {
  const Vec3 d = sub(a, b);
  return dot(d, d);
}

/// Faces that differ by more than this share (0 alike, 1 opposite) are no longer the same.
constexpr double kOtherFaces = 0.4;

/// How unlike two edges are: 0 = alike, infinite = never the same.
double unlikeness(const EdgeMark& a, const EdgeMark& b, const MarkBox& of_a, const MarkBox& of_b) {
  constexpr double kNever = std::numeric_limits<double>::infinity();
  if (a.kind != b.kind || a.is_closed != b.is_closed) return kNever;
  const double faces =
      std::min(square(a.normals[0], b.normals[0]) + square(a.normals[1], b.normals[1]),
               square(a.normals[0], b.normals[1]) + square(a.normals[1], b.normals[0])) /
      8;
  if (faces > kOtherFaces) return kNever;
  const double turned = 1 - std::fabs(dot(a.direction, b.direction));
  // Where a solid grows its edges move with it: near, or at the same share of its size.
  const double whole = std::max({of_a.diagonal, of_b.diagonal, 1e-12});
  double shares = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto share = [&](const EdgeMark& m, const MarkBox& box) {
      return box.size[k] > 1e-9 * whole ? (m.place[k] - box.least[k]) / box.size[k] : 0.5;
    };
    const double d = share(a, of_a) - share(b, of_b);
    shares += d * d / 3;
  }
  const double moved = std::min(std::sqrt(square(a.place, b.place)) / whole, std::sqrt(shares));
  const double grown = std::fabs(a.length - b.length) / std::max(a.length + b.length, 1e-12);
  return 4 * faces + 2 * turned + moved + 0.2 * grown;
}

}  // namespace

std::vector<std::optional<std::size_t>> same_edges(std::span<const CsgEdge> before,
                                                   std::span<const CsgEdge> after,
                                                   std::span<const std::size_t> wanted) {
  std::vector<EdgeMark> old, now;
  for (const CsgEdge& e : before) old.push_back(mark_of(e));
  for (const CsgEdge& e : after) now.push_back(mark_of(e));
  const MarkBox old_box = box_of(old), new_box = box_of(now);
  std::vector<std::optional<std::size_t>> of_old(old.size());
  std::vector<bool> is_taken(now.size(), false);
  // Edges that are as they were are the same ones, whatever else changed.
  constexpr double kUnchanged = 1e-9;
  std::vector<std::pair<double, std::size_t>> by_place;
  for (std::size_t j = 0; j < now.size(); ++j) by_place.emplace_back(now[j].place[0], j);
  std::sort(by_place.begin(), by_place.end());
  for (std::size_t i = 0; i < old.size(); ++i)
    for (auto at = std::lower_bound(by_place.begin(), by_place.end(),
                                    std::pair(old[i].place[0] - kUnchanged, std::size_t{0}));
         at != by_place.end() && at->first <= old[i].place[0] + kUnchanged; ++at)
      if (!is_taken[at->second] && square(old[i].place, now[at->second].place) < 1e-18 &&
          std::fabs(old[i].length - now[at->second].length) < kUnchanged &&
          unlikeness(old[i], now[at->second], old_box, new_box) < 1e-6) {
        of_old[i] = at->second, is_taken[at->second] = true;
        break;
      }
  // Of the others the likest pair first, then the next of what is left. Where there are too many to
  // compare all with all, only those that are wanted look for theirs.
  std::vector<std::size_t> open;
  for (std::size_t i = 0; i < old.size(); ++i)
    if (!of_old[i]) open.push_back(i);
  constexpr std::size_t kMostPairs = 1'000'000;
  if (open.size() * now.size() > kMostPairs)
    std::erase_if(open, [&](std::size_t i) {
      return std::find(wanted.begin(), wanted.end(), i) == wanted.end();
    });
  struct Pair {
    double unlike;
    std::size_t old, now;
  };
  std::vector<Pair> pairs;
  for (const std::size_t i : open)
    for (std::size_t j = 0; j < now.size(); ++j)
      if (!is_taken[j])
        if (const double u = unlikeness(old[i], now[j], old_box, new_box); std::isfinite(u))
          pairs.push_back({u, i, j});
  std::sort(pairs.begin(), pairs.end(), [](const Pair& a, const Pair& b) {
    return std::tie(a.unlike, a.old, a.now) < std::tie(b.unlike, b.old, b.now);
  });
  for (const Pair& p : pairs)
    if (!of_old[p.old] && !is_taken[p.now]) of_old[p.old] = p.now, is_taken[p.now] = true;
  std::vector<std::optional<std::size_t>> out;
  for (const std::size_t i : wanted) out.push_back(of_old[i]);
  return out;
}

}  // namespace robomosp::geometry
