// SPDX-License-Identifier: GPL-3.0-or-later
// Meshes and a whole scene made from formulas, so that the viewer's tests need no file and no
// kernel.
#pragma once

#include <memory>

#include "viewer/frame.h"

namespace robomosp::viewer::synthetic {

/// Box with the given full lengths [m], centred at the origin, with its twelve feature edges.
[[nodiscard]] std::shared_ptr<const Mesh> box(double x, double y, double z);

/// Point of a profile: distance from the z axis and height [m].
struct ProfilePoint {
  double radius, z;
};
/// Solid of revolution about z; corners of the profile sharper than 30 degrees become edges.
[[nodiscard]] std::shared_ptr<const Mesh> lathe(const std::vector<ProfilePoint>& profile,
                                                int sides = 96);
/// Cylinder about z from 0 to `height` with rounded rims.
[[nodiscard]] std::shared_ptr<const Mesh> cylinder(double radius, double height, double rim = 0.0,
                                                   int sides = 96);
/// Sphere of about `triangles` triangles.
[[nodiscard]] std::shared_ptr<const Mesh> sphere(double radius, int triangles);

/// Pose that turns by `angle` [rad] about a unit axis and then moves to `place` [m].
[[nodiscard]] Pose turned(const Vec3& axis, double angle, const Vec3& place = {0, 0, 0});
/// a_T_c of a_T_b and b_T_c.
[[nodiscard]] Pose chained(const Pose& a_T_b, const Pose& b_T_c);

/// A white six-axis arm on a cell floor with a table, workpieces, a glass screen, frames and a
/// path. `phase` [rad] bends the arm.
[[nodiscard]] Frame robot_cell(double phase = 0.0);

}  // namespace robomosp::viewer::synthetic
