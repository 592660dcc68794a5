// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/gizmo/snapping.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "viewer/scene/linear.h"

namespace robomosp::viewer {
namespace {

constexpr auto kLongestLook = std::chrono::microseconds(2000);
constexpr double kRoundness = 2e-3;  ///< greatest share by which points leave a circle
constexpr std::size_t kFewestOfCircle = 8;
constexpr double kCentreFirst = 1, kCornerFirst = 2;  ///< [px] by which they win over edges

Vec3 point_at(const std::vector<float>& list, std::size_t i) {
  return {static_cast<double>(list[3 * i]), static_cast<double>(list[3 * i + 1]),
          static_cast<double>(list[3 * i + 2])};
}

/// The decimal number of seven digits that a single-precision number was made from.
Vec3 decimals(Vec3 p) {
  for (double& x : p) {
    if (x == 0) continue;
    const double scale = std::pow(10.0, 6 - std::floor(std::log10(std::fabs(x))));
    x = std::round(x * scale) / scale;
  }
  return p;
}

struct Circle {
  Vec3 centre{}, axis{};
  double radius = 0;
};

/// The circle that points lie on, if they do: a full one or an arc.
std::optional<Circle> circle_through(const std::vector<Vec3>& points) {
  const std::size_t n = points.size();
  if (n < kFewestOfCircle) return std::nullopt;
  const Vec3 a = points[0], b = points[n / 3], c = points[2 * n / 3];
  const Vec3 u = b - a, v = c - a, w = cross(u, v);
  const double w2 = dot(w, w);
  if (w2 < 1e-12 * dot(u, u) * dot(v, v)) return std::nullopt;
  const Vec3 to = (0.5 / w2) * (dot(v, v) * cross(w, u) - dot(u, u) * cross(w, v));
  // |b-a|^2 and |c-a|^2 with their normals give the centre of three points.
  const Circle out{a + to, (1 / std::sqrt(w2)) * w, norm(to)};
  for (const Vec3& p : points) {
    const Vec3 r = p - out.centre;
    if (std::fabs(norm(r) - out.radius) > kRoundness * out.radius ||
        std::fabs(dot(r, out.axis)) > kRoundness * out.radius)
      return std::nullopt;
  }
  return out;
}

}  // namespace

const char* word_of(SnapTarget::Kind kind) {
  switch (kind) {
    case SnapTarget::Kind::corner: return "corner";
    case SnapTarget::Kind::edge: return "edge";
    case SnapTarget::Kind::centre: return "centre";
    case SnapTarget::Kind::face: break;
  }
  return "face";
}

const Snapper::Box& Snapper::box_of(const std::shared_ptr<const Mesh>& mesh) {
  Box& box = boxes_[mesh.get()];
  // Another mesh may have come to the same address.
  if (!box.mesh.expired() && box.mesh.lock() == mesh) return box;
  Vec3 low{1e300, 1e300, 1e300}, high{-1e300, -1e300, -1e300};
  const std::size_t count = mesh->edge_points.size() / 3;
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3 p = point_at(mesh->edge_points, i);
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], p[k]);
      high[k] = std::max(high[k], p[k]);
    }
  }
  box.mesh = mesh;
  box.centre = count > 0 ? 0.5 * (low + high) : Vec3{};
  box.radius = count > 0 ? 0.5 * norm(high - low) : -1;
  return box;
}

std::optional<SnapTarget> Snapper::find(const Frame& frame, const ScreenCamera& camera, QPointF at,
                                        double reach, const ToolSettings& kinds,
                                        const std::function<bool(std::uint64_t)>& is_left_out,
                                        const PickFace& pick) {
  const auto until = std::chrono::steady_clock::now() + kLongestLook;
  std::optional<SnapTarget> best;
  double least = std::numeric_limits<double>::infinity();
  const auto offer = [&](SnapTarget target, double distance) {
    if (distance >= least) return;
    best = std::move(target);
    least = distance;
  };
  const bool looks_at_edges = kinds.snaps_vertex || kinds.snaps_edge || kinds.snaps_axis;
  for (const Item& item : frame.items) {
    if (!looks_at_edges || !item.mesh || item.mesh->edge_sizes.empty() || is_left_out(item.id))
      continue;
    if (std::chrono::steady_clock::now() > until) break;
    const Box& box = box_of(item.mesh);
    if (box.radius < 0) continue;
    const Vec3 middle = transform(item.pose, box.centre);
    const auto shown = camera.project(middle);
    const double radius_px = box.radius / camera.metres_per_pixel(middle);
    // In perspective what is near the eye looks larger than its middle says.
    if (shown && std::hypot(shown->x() - at.x(), shown->y() - at.y()) > 1.5 * radius_px + reach)
      continue;
    std::size_t from = 0;
    for (const std::uint32_t size : item.mesh->edge_sizes) {
      const std::size_t first = from;
      from += size;
      if (3 * from > item.mesh->edge_points.size()) break;
      QPolygonF line;
      std::vector<Vec3> points;
      for (std::size_t i = first; i < from; ++i) {
        const Vec3 p = transform(item.pose, point_at(item.mesh->edge_points, i));
        const auto q = camera.project(p);
        if (!q) break;
        points.push_back(p);
        line << *q;
      }
      if (points.size() < 2 || points.size() < size) continue;
      const double near = distance_to(line, at);
      const auto circle = kinds.snaps_axis ? circle_through(points) : std::nullopt;
      SnapTarget target;
      target.item = item.id;
      target.name = item.name;
      target.line = line;
      if (circle) {
        target.on = points.front();
        target.kind = SnapTarget::Kind::centre;
        target.point = circle->centre;
        const auto centre = camera.project(circle->centre);
        const double to_centre =
            centre ? std::hypot(centre->x() - at.x(), centre->y() - at.y()) : 1e9;
        const double distance = std::min(near, to_centre);
        if (distance < reach) offer(target, distance - kCentreFirst);
        if (near < reach) continue;
      }
      if (near >= reach) continue;
      if (kinds.snaps_vertex && !circle)
        for (const std::size_t i : {std::size_t{0}, points.size() - 1}) {
          const QPointF q = line[static_cast<qsizetype>(i)];
          const double distance = std::hypot(q.x() - at.x(), q.y() - at.y());
          if (distance >= reach) continue;
          target.kind = SnapTarget::Kind::corner;
          target.point =
              transform(item.pose, decimals(point_at(item.mesh->edge_points, first + i)));
          offer(target, 0.5 * distance - kCornerFirst);
        }
      if (!kinds.snaps_edge) continue;
      // The point of the edge nearest to the view ray.
      const Ray ray = camera.ray(at);
      double closest = std::numeric_limits<double>::infinity();
      Vec3 on{};
      for (std::size_t i = 0; i + 1 < points.size(); ++i) {
        const Vec3 a = points[i], d = points[i + 1] - a, w = a - ray.origin;
        const double dd = dot(d, d), b = dot(d, ray.direction), denominator = dd - b * b;
        double t =
            denominator > 1e-12 * dd ? (b * dot(ray.direction, w) - dot(d, w)) / denominator : 0;
        t = std::clamp(t, 0.0, 1.0);
        const Vec3 p = a + t * d, r = p - ray.origin;
        const double off = norm(r - dot(r, ray.direction) * ray.direction);
        if (off < closest) closest = off, on = p;
      }
      target.kind = SnapTarget::Kind::edge;
      target.point = on;
      offer(target, near);
    }
  }
  if (best || !kinds.snaps_face || !pick) return best;
  if (const auto hit = pick(at)) {
    SnapTarget target;
    target.kind = SnapTarget::Kind::face;
    target.point = hit->point;
    target.item = hit->id;
    target.name = hit->name;
    return target;
  }
  return best;
}

}  // namespace robomosp::viewer
