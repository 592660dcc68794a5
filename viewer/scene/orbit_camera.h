// SPDX-License-Identifier: GPL-3.0-or-later
// OrbitCamera: where the picture is taken from and how mouse movements change it (layer: GUI, std
// only). Angles in radians, lengths in metres, pixels counted from the upper left corner.
#pragma once

#include <array>
#include <optional>
#include <span>

#include "viewer/frame.h"

namespace robomosp::viewer {

/// A half-line in the world.
struct Ray {
  Vec3 origin{};     ///< [m]
  Vec3 direction{};  ///< unit length
};

/// 4 x 4 matrix, row-major, acting on column vectors.
using Matrix4 = std::array<double, 16>;

/// A camera that circles a target with the z axis of the world kept upright. [GUI thread]
class OrbitCamera {
 public:
  /// Size of the picture in device pixels; values below one count as one.
  void set_viewport(int width, int height);
  /// Chooses the direction of a named view and keeps target and distance; `custom` changes nothing.
  void look(Camera::View view);
  /// Puts the eye at `eye` looking at `target`; does nothing if they coincide or are not finite.
  void look_from(const Vec3& eye, const Vec3& target);
  /// Changes between perspective and parallel projection; the target keeps its size.
  void set_perspective(bool on) { perspective_ = on; }

  /// Circles the target; half the height of the picture is 90 degrees.
  void orbit(double dx_px, double dy_px);
  /// Circles a point [m], which stays where it is in the picture.
  void orbit_about(const Vec3& point, double dx_px, double dy_px);
  /// Moves the target in the picture plane, so that it follows the mouse.
  void pan(double dx_px, double dy_px);
  /// Scales the picture by `factor` (> 1 comes closer), keeping what is under pixel (x, y) there.
  void zoom_at(double x_px, double y_px, double factor);
  /// Frames the points [m], leaving `margin` (0..0.4) of the picture free on each side.
  void fit(std::span<const Vec3> points, double margin = 0.055);

  [[nodiscard]] bool perspective() const { return perspective_; }
  [[nodiscard]] const Vec3& target() const { return target_; }  ///< [m]
  [[nodiscard]] double distance() const { return distance_; }   ///< eye to target [m]
  [[nodiscard]] Vec3 eye() const;                               ///< [m]
  [[nodiscard]] Vec3 backward() const;           ///< unit vector from the target towards the eye
  [[nodiscard]] Vec3 right() const;              ///< unit vector to the right in the picture
  [[nodiscard]] Vec3 up() const;                 ///< unit vector upwards in the picture
  [[nodiscard]] double tan_half_height() const;  ///< of the vertical opening angle
  [[nodiscard]] double aspect() const { return static_cast<double>(width_) / height_; }
  [[nodiscard]] int width() const { return width_; }    ///< [px]
  [[nodiscard]] int height() const { return height_; }  ///< [px]
  /// Length at the target that one pixel covers [m].
  [[nodiscard]] double metres_per_pixel() const;

  /// camera_T_world: x right, y up, looking along -z.
  [[nodiscard]] Matrix4 view() const;
  /// OpenGL projection for the depth range [near, far] [m], shifted by a fraction of a pixel.
  [[nodiscard]] Matrix4 projection(double near, double far, double shift_x_px = 0,
                                   double shift_y_px = 0) const;
  /// The half-line of all points shown at pixel (x, y).
  [[nodiscard]] Ray ray(double x_px, double y_px) const;
  /// Pixel at which a point [m] is shown; nothing if it lies behind the eye.
  [[nodiscard]] std::optional<std::array<double, 2>> project(const Vec3& point) const;

  friend bool operator==(const OrbitCamera&, const OrbitCamera&) = default;

 private:
  Vec3 target_{0, 0, 0.4};
  double yaw_ = -0.87, pitch_ = 0.36, distance_ = 4;
  bool perspective_ = true;
  int width_ = 1, height_ = 1;
};

}  // namespace robomosp::viewer
