// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/scene/orbit_camera.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "viewer/scene/linear.h"

namespace robomosp::viewer {
namespace {

constexpr double kPi = std::numbers::pi;
// A long lens (28 degrees) keeps machines from looking distorted.
constexpr double kOpeningAngle = 28.0 / 180.0 * kPi;
constexpr double kMinDistance = 1e-4, kMaxDistance = 1e6;

}  // namespace

void OrbitCamera::set_viewport(int width, int height) {
  width_ = std::max(width, 1);
  height_ = std::max(height, 1);
}

void OrbitCamera::look(Camera::View view) {
  const auto set = [&](double yaw, double pitch) { yaw_ = yaw, pitch_ = pitch; };
  switch (view) {
    case Camera::View::isometric: set(-0.87, 0.32); break;
    case Camera::View::front: set(-kPi / 2, 0); break;
    case Camera::View::back: set(kPi / 2, 0); break;
    case Camera::View::left: set(kPi, 0); break;
    case Camera::View::right: set(0, 0); break;
    case Camera::View::top: set(-kPi / 2, kPi / 2); break;
    case Camera::View::bottom: set(-kPi / 2, -kPi / 2); break;
    case Camera::View::custom: break;
  }
}

void OrbitCamera::look_from(const Vec3& eye, const Vec3& target) {
  const Vec3 offset = eye - target;
  const double length = norm(offset);
  if (!is_finite(eye) || !is_finite(target) || length < kMinDistance) return;
  target_ = target;
  distance_ = length;
  pitch_ = std::asin(std::clamp(offset[2] / length, -1.0, 1.0));
  // Straight above or below, the direction has no yaw: keep x to the right.
  const bool is_vertical = std::hypot(offset[0], offset[1]) < 1e-9 * length;
  yaw_ = is_vertical ? -kPi / 2 : std::atan2(offset[1], offset[0]);
}

void OrbitCamera::orbit(double dx_px, double dy_px) {
  const double per_pixel = kPi / height_;
  yaw_ = std::remainder(yaw_ - dx_px * per_pixel, 2 * kPi);
  pitch_ = std::clamp(pitch_ + dy_px * per_pixel, -kPi / 2, kPi / 2);
}

void OrbitCamera::orbit_about(const Vec3& point, double dx_px, double dy_px) {
  if (!is_finite(point)) return orbit(dx_px, dy_px);
  const Vec3 offset = target_ - point;
  const double x = dot(offset, right()), y = dot(offset, up()), z = dot(offset, backward());
  orbit(dx_px, dy_px);
  target_ = point + x * right() + y * up() + z * backward();
}

void OrbitCamera::pan(double dx_px, double dy_px) {
  const double s = metres_per_pixel();
  target_ = target_ + (-dx_px * s) * right() + (dy_px * s) * up();
}

void OrbitCamera::zoom_at(double x_px, double y_px, double factor) {
  if (!(factor > 0) || !std::isfinite(factor)) return;
  const double wanted = std::clamp(distance_ / factor, kMinDistance, kMaxDistance);
  // The point under the cursor in the plane through the target; scaling the camera about it leaves
  // its place in the picture unchanged in both projections.
  const double s = metres_per_pixel();
  const Vec3 fixed =
      target_ + ((x_px - 0.5 * width_) * s) * right() + ((0.5 * height_ - y_px) * s) * up();
  target_ = fixed + (wanted / distance_) * (target_ - fixed);
  distance_ = wanted;
}

void OrbitCamera::fit(std::span<const Vec3> points, double margin) {
  constexpr double kInf = std::numeric_limits<double>::infinity();
  Vec3 low{kInf, kInf, kInf}, high{-kInf, -kInf, -kInf};
  for (const Vec3& p : points) {
    if (!is_finite(p)) continue;
    for (std::size_t i = 0; i < 3; ++i) {
      low[i] = std::min(low[i], p[i]);
      high[i] = std::max(high[i], p[i]);
    }
  }
  if (low[0] > high[0]) return;
  target_ = 0.5 * (low + high);

  const double free = 1 - 2 * std::clamp(margin, 0.0, 0.4);
  const double ky = tan_half_height() * free, kx = ky * aspect();
  const Vec3 x_axis = right(), y_axis = up(), z_axis = backward();
  // A point (x, y, z) in camera directions relative to the target is inside the picture of a camera
  // at distance d shifted by c if |x - c| <= k (d - z). The smallest such d over all points follows
  // from the largest x/k + z and -x/k + z. For parallel projection the z terms vanish.
  double right_max = -kInf, left_max = -kInf, up_max = -kInf, down_max = -kInf;
  for (const Vec3& p : points) {
    if (!is_finite(p)) continue;
    const Vec3 r = p - target_;
    const double x = dot(r, x_axis), y = dot(r, y_axis);
    const double z = perspective_ ? dot(r, z_axis) : 0;
    right_max = std::max(right_max, x / kx + z);
    left_max = std::max(left_max, -x / kx + z);
    up_max = std::max(up_max, y / ky + z);
    down_max = std::max(down_max, -y / ky + z);
  }
  const double wanted = std::max(0.5 * (right_max + left_max), 0.5 * (up_max + down_max));
  // A single point has no size: show a neighbourhood of 10 cm.
  distance_ = std::clamp(wanted > kMinDistance ? wanted : 0.1 / tan_half_height(), kMinDistance,
                         kMaxDistance);
  target_ = target_ + (0.5 * kx * (right_max - left_max)) * x_axis +
            (0.5 * ky * (up_max - down_max)) * y_axis;
}

Vec3 OrbitCamera::eye() const { return target_ + distance_ * backward(); }

Vec3 OrbitCamera::backward() const {
  return {std::cos(pitch_) * std::cos(yaw_), std::cos(pitch_) * std::sin(yaw_), std::sin(pitch_)};
}

Vec3 OrbitCamera::right() const { return {-std::sin(yaw_), std::cos(yaw_), 0}; }

Vec3 OrbitCamera::up() const {
  return {-std::sin(pitch_) * std::cos(yaw_), -std::sin(pitch_) * std::sin(yaw_), std::cos(pitch_)};
}

double OrbitCamera::tan_half_height() const { return std::tan(0.5 * kOpeningAngle); }

double OrbitCamera::metres_per_pixel() const { return 2 * distance_ * tan_half_height() / height_; }

Matrix4 OrbitCamera::view() const {
  const Vec3 x = right(), y = up(), z = backward(), e = eye();
  return {x[0], x[1], x[2], -dot(x, e), y[0], y[1], y[2], -dot(y, e),
          z[0], z[1], z[2], -dot(z, e), 0,    0,    0,    1};
}

Matrix4 OrbitCamera::projection(double near, double far, double shift_x_px,
                                double shift_y_px) const {
  const double sx = 2 * shift_x_px / width_, sy = -2 * shift_y_px / height_;
  const double k = tan_half_height();
  if (perspective_) {
    const double fy = 1 / k, fx = fy / aspect();
    return {fx,
            0,
            -sx,
            0,
            0,
            fy,
            -sy,
            0,
            0,
            0,
            (near + far) / (near - far),
            2 * near * far / (near - far),
            0,
            0,
            -1,
            0};
  }
  const double h = k * distance_, w = h * aspect();
  return {1 / w, 0, 0, sx, 0, 1 / h, 0, sy, 0, 0, 2 / (near - far), (near + far) / (near - far),
          0,     0, 0, 1};
}

Ray OrbitCamera::ray(double x_px, double y_px) const {
  const double s = metres_per_pixel();
  const Vec3 in_plane =
      target_ + ((x_px - 0.5 * width_) * s) * right() + ((0.5 * height_ - y_px) * s) * up();
  if (!perspective_) {
    // Far enough back that nothing of an ordinary scene is behind the origin.
    return {in_plane + 100 * distance_ * backward(), -1.0 * backward()};
  }
  const Vec3 d = in_plane - eye();
  return {eye(), (1 / norm(d)) * d};
}

std::optional<std::array<double, 2>> OrbitCamera::project(const Vec3& point) const {
  const Vec3 r = point - target_;
  const double depth = distance_ - dot(r, backward());
  if (perspective_ && depth <= 1e-6 * distance_) return std::nullopt;
  const double scale = (perspective_ ? distance_ / depth : 1.0) / metres_per_pixel();
  return std::array<double, 2>{0.5 * width_ + dot(r, right()) * scale,
                               0.5 * height_ - dot(r, up()) * scale};
}

}  // namespace robomosp::viewer
