// SPDX-License-Identifier: GPL-3.0-or-later
// Cut faces of sections: the segments in which a plane meets the triangles, and the area they wind
// around, swept in strips.
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "viewer/scene/linear.h"
#include "viewer/scene/surface.h"

namespace robomosp::viewer {
namespace {

using Point = std::array<double, 2>;  ///< in the plane [m]

/// A side of the cut face, from its lower to its upper end.
struct Side {
  Point low{}, high{};
  int turn = 0;  ///< +1 if the surface runs upwards here, else -1
  [[nodiscard]] double x_at(double y) const {
    const double t = (y - low[1]) / (high[1] - low[1]);
    return low[0] + t * (high[0] - low[0]);
  }
};

/// Axes of the plane.
struct CutPlane {
  Vec3 origin, x, y, normal;
  CutPlane(const Vec3& point, const Vec3& n) : origin(point), normal(n) {
    x = cross(std::abs(n[2]) < 0.9 ? Vec3{0, 0, 1} : Vec3{1, 0, 0}, n);
    x = (1 / norm(x)) * x;
    y = cross(n, x);
  }
  [[nodiscard]] Vec3 world(double a, double b) const { return origin + a * x + b * y; }
};

struct Segment {
  Point from, to;
};

std::vector<Segment> segments_in(const Surface& s, const Pose& pose, const CutPlane& plane) {
  // Vertices at one place must give the same numbers, or the sides would not meet.
  const auto weld = welded(s);
  std::vector<std::array<double, 3>> at(weld.size());
  for (std::size_t i = 0; i < weld.size(); ++i) {
    if (weld[i] != i) continue;
    const Vec3 p =
        transform(pose, {s.positions[3 * i], s.positions[3 * i + 1], s.positions[3 * i + 2]}) -
        plane.origin;
    at[i] = {dot(p, plane.x), dot(p, plane.y), dot(p, plane.normal)};
  }
  const auto meet = [&](std::uint32_t a, std::uint32_t b) -> Point {
    if (a > b) std::swap(a, b);
    const double t = at[a][2] / (at[a][2] - at[b][2]);
    return {at[a][0] + t * (at[b][0] - at[a][0]), at[a][1] + t * (at[b][1] - at[a][1])};
  };
  std::vector<Segment> found;
  for (std::size_t t = 0; t + 2 < s.triangles.size(); t += 3) {
    Segment segment{};
    int down = 0, up = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = weld[s.triangles[t + k]], b = weld[s.triangles[t + (k + 1) % 3]];
      const bool a_above = at[a][2] >= 0, b_above = at[b][2] >= 0;
      if (a_above == b_above) continue;
      if (a_above) segment.from = meet(a, b), ++down;
      else segment.to = meet(a, b), ++up;
    }
    if (down == 1 && up == 1 && segment.from != segment.to) found.push_back(segment);
  }
  return found;
}

/// Collects strips between two sides; a strip grows while the same two sides bound it.
struct Strips {
  using Bounds = std::pair<std::size_t, std::size_t>;
  const CutPlane& plane;
  const std::vector<Side>& sides;
  Cut& cut;
  std::map<Bounds, double> open;  // where they began

  void close(const Bounds& b, double from, double to) const {
    const auto first = static_cast<std::uint32_t>(cut.positions.size() / 3);
    for (const double y : {from, to})
      for (const std::size_t side : {b.first, b.second})
        for (const double x : plane.world(sides[side].x_at(y), y))
          cut.positions.push_back(static_cast<float>(x));
    for (const std::uint32_t i : {0U, 1U, 3U, 0U, 3U, 2U}) cut.triangles.push_back(first + i);
  }
  void next(std::vector<Bounds> now, double y) {
    std::map<Bounds, double> kept;
    for (const Bounds& b : now) {
      const auto was = open.find(b);
      kept[b] = was == open.end() ? y : was->second;
      if (was != open.end()) open.erase(was);
    }
    for (const auto& [b, from] : open) close(b, from, y);
    open = std::move(kept);
  }
};

}  // namespace

Cut cut_of(const Surface& surface, const Pose& pose, const Vec3& point, const Vec3& normal) {
  const CutPlane plane(point, normal);
  const auto segments = segments_in(surface, pose, plane);
  Cut cut;
  std::vector<Side> sides;
  std::vector<double> heights;
  for (const Segment& s : segments) {
    for (const Point& p : {s.from, s.to})
      for (const double x : plane.world(p[0], p[1]))
        cut.outline.ends.push_back(static_cast<float>(x));
    cut.outline.along.push_back(0);
    cut.outline.along.push_back(
        static_cast<float>(std::hypot(s.to[0] - s.from[0], s.to[1] - s.from[1])));
    if (s.from[1] == s.to[1]) continue;
    const bool is_up = s.from[1] < s.to[1];
    sides.push_back({is_up ? s.from : s.to, is_up ? s.to : s.from, is_up ? 1 : -1});
    heights.push_back(s.from[1]);
    heights.push_back(s.to[1]);
  }
  std::sort(heights.begin(), heights.end());
  heights.erase(std::unique(heights.begin(), heights.end()), heights.end());
  std::sort(sides.begin(), sides.end(),
            [](const Side& a, const Side& b) { return a.low[1] < b.low[1]; });
  Strips strips{plane, sides, cut, {}};
  std::vector<std::size_t> active;
  std::size_t begun = 0;
  for (std::size_t h = 0; h + 1 < heights.size(); ++h) {
    const double low = heights[h], high = heights[h + 1], middle = 0.5 * (low + high);
    std::erase_if(active, [&](std::size_t i) { return sides[i].high[1] <= low; });
    for (; begun < sides.size() && sides[begun].low[1] <= low; ++begun)
      if (sides[begun].high[1] > low) active.push_back(begun);
    std::sort(active.begin(), active.end(), [&](std::size_t a, std::size_t b) {
      const double xa = sides[a].x_at(middle), xb = sides[b].x_at(middle);
      return xa != xb ? xa < xb : a < b;
    });
    std::vector<Strips::Bounds> now;
    int turns = 0;
    std::size_t left = 0;
    for (const std::size_t i : active) {
      const int before = turns;
      turns += sides[i].turn;
      if (before == 0) left = i;
      else if (turns == 0) now.emplace_back(left, i);
    }
    strips.next(std::move(now), low);
  }
  if (!heights.empty()) strips.next({}, heights.back());
  return cut;
}

}  // namespace robomosp::viewer
