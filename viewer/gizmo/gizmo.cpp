// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/gizmo/gizmo.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <QPainter>
#include <QPainterPath>

#include "viewer/scene/linear.h"
#include "viewer/theme/theme.h"

namespace robomosp::viewer {
namespace {

constexpr double kRingShare = 0.92;  ///< radius of rings, of the length of an arrow
constexpr double kViewRingShare = 1.12;
constexpr double kPlaneFrom = 0.30, kPlaneTo = 0.52;  ///< of the length of an arrow
constexpr double kArrowFrom = 0.16;                   ///< free space around the centre
constexpr double kEdgeOn = 0.12;  ///< cosine below which a plane is seen from its edge
constexpr double kAlong = 0.995;  ///< cosine above which an axis points at the eye
constexpr int kRingPoints = 72;

/// The view direction at a point, from the eye to it.
Vec3 looking(const ScreenCamera& c, const Vec3& at) {
  if (!c.camera.perspective()) return -1.0 * c.camera.backward();
  const Vec3 d = at - c.camera.eye();
  const double n = norm(d);
  return n > 0 ? (1 / n) * d : -1.0 * c.camera.backward();
}

/// Two unit vectors across an axis.
std::array<Vec3, 2> across(const Vec3& axis) {
  const Vec3 other = std::fabs(axis[2]) < 0.9 ? Vec3{0, 0, 1} : Vec3{1, 0, 0};
  Vec3 u = cross(other, axis);
  u = (1 / norm(u)) * u;
  return {u, cross(axis, u)};
}

}  // namespace

bool is_turn(Grip g) {
  return g == Grip::turn_x || g == Grip::turn_y || g == Grip::turn_z || g == Grip::turn_view;
}

bool is_plane(Grip g) { return g == Grip::move_yz || g == Grip::move_zx || g == Grip::move_xy; }

int axis_of(Grip g) {
  switch (g) {
    case Grip::move_x:
    case Grip::move_yz:
    case Grip::turn_x: return 0;
    case Grip::move_y:
    case Grip::move_zx:
    case Grip::turn_y: return 1;
    case Grip::move_z:
    case Grip::move_xy:
    case Grip::turn_z: return 2;
    case Grip::none:
    case Grip::move_free:
    case Grip::turn_view: break;
  }
  return -1;
}

std::optional<QPointF> ScreenCamera::project(const Vec3& point) const {
  const auto at = camera.project(point);
  if (!at) return std::nullopt;
  return origin + QPointF((*at)[0] / ratio, (*at)[1] / ratio);
}

Ray ScreenCamera::ray(QPointF at) const {
  at = (at - origin) * ratio;
  return camera.ray(at.x(), at.y());
}

double ScreenCamera::metres_per_pixel(const Vec3& at) const {
  const double s = camera.metres_per_pixel() * ratio;
  if (!camera.perspective()) return s;
  const double depth = dot(camera.eye() - at, camera.backward());
  return s * std::max(depth, 1e-6 * camera.distance()) / camera.distance();
}

Pose rotation_about(const Vec3& k, double angle) {
  const double c = std::cos(angle), s = std::sin(angle), v = 1 - c;
  Pose out;
  out.R = {c + v * k[0] * k[0],        v * k[0] * k[1] - s * k[2], v * k[0] * k[2] + s * k[1],
           v * k[0] * k[1] + s * k[2], c + v * k[1] * k[1],        v * k[1] * k[2] - s * k[0],
           v * k[0] * k[2] - s * k[1], v * k[1] * k[2] + s * k[0], c + v * k[2] * k[2]};
  return out;
}

double distance_to(const QPolygonF& line, QPointF at) {
  double least = std::numeric_limits<double>::infinity();
  for (qsizetype i = 0; i + 1 < line.size(); ++i) {
    const QPointF a = line[i], d = line[i + 1] - a, r = at - a;
    const double length2 = QPointF::dotProduct(d, d);
    const double t = length2 > 0 ? std::clamp(QPointF::dotProduct(r, d) / length2, 0.0, 1.0) : 0.0;
    const QPointF off = r - t * d;
    least = std::min(least, std::hypot(off.x(), off.y()));
  }
  return least;
}

Vec3 Gizmo::axis(int i) const {
  const auto k = static_cast<std::size_t>(i);
  return {axes.R[k], axes.R[k + 3], axes.R[k + 6]};
}

double Gizmo::size_in(const ScreenCamera& c) const { return size_px * c.metres_per_pixel(origin); }

QPolygonF Gizmo::ring(const ScreenCamera& c, const Vec3& about, double radius) const {
  const auto [u, v] = across(about);
  QPolygonF out;
  for (int i = 0; i <= kRingPoints; ++i) {
    const double a = 2 * std::numbers::pi * i / kRingPoints;
    if (const auto p = c.project(origin + (radius * std::cos(a)) * u + (radius * std::sin(a)) * v))
      out << *p;
  }
  return out;
}

QPolygonF Gizmo::square(const ScreenCamera& c, int k) const {
  const double s = size_in(c);
  const Vec3 u = (s * kPlaneFrom) * axis((k + 1) % 3), v = (s * kPlaneFrom) * axis((k + 2) % 3);
  const double far = kPlaneTo / kPlaneFrom;
  QPolygonF out;
  for (const Vec3& corner : {u + v, far * u + v, far * u + far * v, u + far * v, u + v})
    if (const auto p = c.project(origin + corner)) out << *p;
  return out;
}

Vec3 Gizmo::turn_axis(Grip grip, const ScreenCamera& c) const {
  return grip == Grip::turn_view ? -1.0 * looking(c, origin) : axis(axis_of(grip));
}

Grip Gizmo::hit(const ScreenCamera& c, QPointF at) const {
  if (mode == GizmoMode::hidden) return Grip::none;
  const auto centre = c.project(origin);
  if (!centre) return Grip::none;
  const double s = size_in(c);
  const Vec3 view = looking(c, origin);
  Grip best = Grip::none;
  double least = reach_px;
  const auto offer = [&](Grip grip, double distance) {
    if (distance < least) best = grip, least = distance;
  };
  if (mode == GizmoMode::turn) {
    constexpr Grip kRings[] = {Grip::turn_x, Grip::turn_y, Grip::turn_z};
    for (int i = 0; i < 3; ++i) offer(kRings[i], distance_to(ring(c, axis(i), kRingShare * s), at));
    offer(Grip::turn_view, distance_to(ring(c, view, kViewRingShare * s), at));
    return best;
  }
  if (std::hypot(at.x() - centre->x(), at.y() - centre->y()) < 0.12 * size_px)
    return Grip::move_free;
  constexpr Grip kArrows[] = {Grip::move_x, Grip::move_y, Grip::move_z};
  constexpr Grip kSquares[] = {Grip::move_yz, Grip::move_zx, Grip::move_xy};
  for (int i = 0; i < 3; ++i) {
    if (std::fabs(dot(axis(i), view)) > kAlong) continue;
    const auto from = c.project(origin + (kArrowFrom * s) * axis(i)),
               to = c.project(origin + s * axis(i));
    if (from && to) offer(kArrows[i], distance_to(QPolygonF{*from, *to}, at));
  }
  if (best != Grip::none) return best;
  for (int i = 0; i < 3; ++i)
    if (std::fabs(dot(axis(i), view)) > kEdgeOn && square(c, i).containsPoint(at, Qt::OddEvenFill))
      return kSquares[i];
  return Grip::none;
}

std::optional<Vec3> Gizmo::point_on(Grip grip, const ScreenCamera& c, QPointF at) const {
  const Ray ray = c.ray(at);
  if (grip == Grip::move_free || is_plane(grip)) {
    const Vec3 n = is_plane(grip) ? axis(axis_of(grip)) : c.camera.backward();
    const double along = dot(n, ray.direction);
    if (std::fabs(along) < 1e-6) return std::nullopt;
    const double t = dot(n, origin - ray.origin) / along;
    if (t < 0) return std::nullopt;  // beyond the horizon
    return ray.origin + t * ray.direction;
  }
  const int k = axis_of(grip);
  if (k < 0 || is_turn(grip)) return std::nullopt;
  // The point of the axis nearest to the ray.
  const Vec3 a = axis(k), d = ray.direction, w = ray.origin - origin;
  const double b = dot(a, d), denominator = 1 - b * b;
  if (denominator < 1e-9) return std::nullopt;
  const double t = (dot(a, w) - b * dot(d, w)) / denominator;
  return origin + t * a;
}

std::optional<double> Gizmo::angle_on(Grip grip, const ScreenCamera& c, QPointF at) const {
  const Vec3 n = turn_axis(grip, c), view = looking(c, origin);
  const auto [u, v] = across(n);
  const double facing = dot(n, view);
  if (std::fabs(facing) > kEdgeOn) {
    const Ray ray = c.ray(at);
    const double along = dot(n, ray.direction);
    if (std::fabs(along) < 1e-9) return std::nullopt;
    const double t = dot(n, origin - ray.origin) / along;
    if (t < 0) return std::nullopt;
    const Vec3 r = ray.origin + t * ray.direction - origin;
    if (norm(r) < 1e-12) return std::nullopt;
    return std::atan2(dot(r, v), dot(r, u));
  }
  // Seen from its edge: along the line in the picture, a radius is one radian.
  const auto centre = c.project(origin);
  if (!centre) return std::nullopt;
  const Vec3 tangent = cross(n, -1.0 * view);
  const auto ahead = c.project(origin + (c.metres_per_pixel(origin) / norm(tangent)) * tangent);
  if (!ahead) return std::nullopt;
  QPointF along = *ahead - *centre;
  const double length = std::hypot(along.x(), along.y());
  if (length < 1e-9) return std::nullopt;
  along /= length;
  return QPointF::dotProduct(at - *centre, along) / (kRingShare * size_px);
}

Pose Gizmo::moved(const Pose& start, const GizmoMotion& m, const ScreenCamera& c) const {
  Pose out = start;
  if (is_turn(m.grip)) {
    const Pose turn = rotation_about(turn_axis(m.grip, c), m.angle);
    for (std::size_t i = 0; i < 3; ++i) {
      const Vec3 column = rotate(turn, Vec3{start.R[i], start.R[i + 3], start.R[i + 6]});
      out.R[i] = column[0], out.R[i + 3] = column[1], out.R[i + 6] = column[2];
    }
    out.p = origin + rotate(turn, start.p - origin);
    return out;
  }
  out.p = start.p + (m.grip == Grip::move_free ? m.offset : rotate(axes, m.offset));
  return out;
}

void Gizmo::paint(QPainter& painter, const ScreenCamera& c) const {
  if (mode == GizmoMode::hidden) return;
  const auto centre = c.project(origin);
  if (!centre) return;
  const Theme& t = theme();
  const double s = size_in(c), thin = t.px(2), thick = t.px(3.5);
  const Vec3 view = looking(c, origin);
  painter.setRenderHint(QPainter::Antialiasing);
  const auto colour = [&](Grip grip, int k) {
    QColor out = is_refused ? t.fault : k < 0 ? t.label : t.axes[static_cast<std::size_t>(k)];
    const bool is_other = dragged != Grip::none && dragged != grip;
    out.setAlphaF(is_other ? 0.25F : 1.0F);
    return out;
  };
  const auto width = [&](Grip grip) {
    return grip == dragged || (dragged == Grip::none && grip == hovered) ? thick : thin;
  };
  if (mode == GizmoMode::turn) {
    constexpr Grip kRings[] = {Grip::turn_x, Grip::turn_y, Grip::turn_z};
    painter.setBrush(Qt::NoBrush);
    for (int i = 0; i < 3; ++i) {
      // The half behind the centre is faint, so that rings read as circles in space.
      const auto [u, v] = across(axis(i));
      for (const bool is_front : {false, true}) {
        QPainterPath path;
        bool is_open = false;
        for (int k = 0; k <= kRingPoints; ++k) {
          const double a = 2 * std::numbers::pi * k / kRingPoints;
          const Vec3 r = (kRingShare * s * std::cos(a)) * u + (kRingShare * s * std::sin(a)) * v;
          const bool is_near = dot(r, view) <= 1e-9 * s;
          const auto p = c.project(origin + r);
          if (!p || is_near != is_front) {
            is_open = false;
            continue;
          }
          if (is_open) path.lineTo(*p);
          else path.moveTo(*p);
          is_open = true;
        }
        QColor shade = colour(kRings[i], i);
        if (!is_front) shade.setAlphaF(0.3F * static_cast<float>(shade.alphaF()));
        painter.setPen(QPen(shade, width(kRings[i])));
        painter.drawPath(path);
      }
    }
    QColor shade = colour(Grip::turn_view, -1);
    shade.setAlphaF(0.7F * static_cast<float>(shade.alphaF()));
    painter.setPen(QPen(shade, width(Grip::turn_view)));
    painter.drawPolyline(ring(c, view, kViewRingShare * s));
    return;
  }
  constexpr Grip kSquares[] = {Grip::move_yz, Grip::move_zx, Grip::move_xy};
  for (int i = 0; i < 3; ++i) {
    if (std::fabs(dot(axis(i), view)) <= kEdgeOn) continue;
    QColor fill = colour(kSquares[i], i);
    const bool is_lit = kSquares[i] == dragged || (dragged == Grip::none && kSquares[i] == hovered);
    painter.setPen(QPen(fill, t.px(1)));
    fill.setAlphaF((is_lit ? 0.7F : 0.35F) * static_cast<float>(fill.alphaF()));
    painter.setBrush(fill);
    painter.drawPolygon(square(c, i));
  }
  constexpr Grip kArrows[] = {Grip::move_x, Grip::move_y, Grip::move_z};
  constexpr const char* kNames[] = {"X", "Y", "Z"};
  painter.setFont(t.ui);
  // The arrow farthest from the eye first.
  std::array<int, 3> order{0, 1, 2};
  std::sort(order.begin(), order.end(),
            [&](int a, int b) { return dot(axis(a), view) > dot(axis(b), view); });
  for (const int i : order) {
    if (std::fabs(dot(axis(i), view)) > kAlong) continue;
    const auto from = c.project(origin + (kArrowFrom * s) * axis(i)),
               to = c.project(origin + s * axis(i));
    if (!from || !to) continue;
    const QColor shade = colour(kArrows[i], i);
    painter.setPen(QPen(shade, width(kArrows[i]), Qt::SolidLine, Qt::FlatCap));
    painter.drawLine(*from, *to);
    QPointF along = *to - *from;
    const double length = std::hypot(along.x(), along.y());
    if (length < 1) continue;
    along /= length;
    const QPointF side(-along.y(), along.x());
    const double head = t.px(11), half = t.px(4.5);
    painter.setPen(Qt::NoPen);
    painter.setBrush(shade);
    painter.drawPolygon(QPolygonF{*to + head * along, *to + half * side, *to - half * side});
    painter.setPen(shade);
    const QPointF text = *to + (head + t.px(9)) * along;
    painter.drawText(QRectF(text.x() - 20, text.y() - 20, 40, 40), Qt::AlignCenter, kNames[i]);
  }
  painter.setPen(QPen(colour(Grip::move_free, -1), width(Grip::move_free)));
  QColor fill = t.label_ground;
  fill.setAlphaF(0.6F);
  painter.setBrush(fill);
  painter.drawEllipse(*centre, 0.09 * size_px, 0.09 * size_px);
}

}  // namespace robomosp::viewer
