// SPDX-License-Identifier: GPL-3.0-or-later
// Gizmo: arrows, planes and rings that move and turn a pose with the mouse, of constant size on the
// screen (layer: GUI). Geometry, hits and painting only: whoever owns it edits records.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include <QPointF>
#include <QPolygonF>

#include <robomosp/sdk/types.h>

#include "viewer/scene/orbit_camera.h"

class QPainter;

namespace robomosp::viewer {

/// A part of a gizmo that can be dragged.
enum class Grip : std::uint8_t {
  none,
  move_x,
  move_y,
  move_z,
  move_yz,  ///< in the plane across x
  move_zx,
  move_xy,
  move_free,  ///< in the plane of the picture
  turn_x,
  turn_y,
  turn_z,
  turn_view,  ///< about the direction of the view
};
[[nodiscard]] bool is_turn(Grip);
/// 0 x, 1 y, 2 z; -1 for move_free and turn_view.
[[nodiscard]] int axis_of(Grip);
[[nodiscard]] bool is_plane(Grip);

/// Which handles a gizmo shows.
enum class GizmoMode : std::uint8_t { hidden, move, turn };

/// A camera and the ratio of its pixels to those of the widget.
struct ScreenCamera {
  OrbitCamera camera;
  double ratio = 1;
  QPointF origin{};  ///< of its picture in the widget [device-independent px]
  /// [device-independent px]; none behind the eye.
  [[nodiscard]] std::optional<QPointF> project(const Vec3& point) const;
  [[nodiscard]] Ray ray(QPointF at) const;
  /// Length at a point that one pixel covers [m].
  [[nodiscard]] double metres_per_pixel(const Vec3& at) const;
};

/// A displacement of a gizmo: an offset along its axes, or an angle about one of them.
struct GizmoMotion {
  Grip grip = Grip::none;
  Vec3 offset{};     ///< along the gizmo's axes, of move_free in the world [m]
  double angle = 0;  ///< [rad]
};

class Gizmo {
 public:
  GizmoMode mode = GizmoMode::hidden;
  Vec3 origin{};        ///< [m]
  Pose axes;            ///< R: directions of its axes in the world
  double size_px = 84;  ///< length of an arrow
  double reach_px = 7;  ///< how near the mouse must be
  Grip hovered = Grip::none, dragged = Grip::none;
  bool is_refused = false;  ///< drawn in the colour of faults

  /// The handle under a place of the picture.
  [[nodiscard]] Grip hit(const ScreenCamera& camera, QPointF at) const;
  /// Direction of an axis in the world.
  [[nodiscard]] Vec3 axis(int i) const;
  /// Axis of a turn in the world.
  [[nodiscard]] Vec3 turn_axis(Grip grip, const ScreenCamera& camera) const;

  /// The point of a handle's line or plane that a place of the picture shows, none if the view is
  /// along it.
  [[nodiscard]] std::optional<Vec3> point_on(Grip grip, const ScreenCamera& camera,
                                             QPointF at) const;
  /// The angle of a place about the axis of a ring [rad]; none if it is at the axis.
  [[nodiscard]] std::optional<double> angle_on(Grip grip, const ScreenCamera& camera,
                                               QPointF at) const;
  /// Where a motion brings a pose; turns are about the gizmo's origin.
  [[nodiscard]] Pose moved(const Pose& start, const GizmoMotion& motion,
                           const ScreenCamera& camera) const;
  void paint(QPainter& painter, const ScreenCamera& camera) const;

 private:
  [[nodiscard]] double size_in(const ScreenCamera& camera) const;  ///< [m]
  [[nodiscard]] QPolygonF ring(const ScreenCamera& camera, const Vec3& axis, double radius) const;
  [[nodiscard]] QPolygonF square(const ScreenCamera& camera, int across) const;
};

/// Rotation by an angle about a unit axis.
[[nodiscard]] Pose rotation_about(const Vec3& axis, double angle);
/// Shortest distance of a point from a polyline [px].
[[nodiscard]] double distance_to(const QPolygonF& line, QPointF at);

}  // namespace robomosp::viewer
