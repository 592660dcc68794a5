// SPDX-License-Identifier: Apache-2.0
// The axes of a controller from the joints of a robot, and the joints from the axes. The only place
// that computes either (layer: contract helper,
// inline only, not part of the ABI). Axes are in degrees and mm, joints in rad and m.
// [any thread]
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <robomosp/sdk/post.h>
#include <robomosp/sdk/robot_model.h>

namespace robomosp {

/// Whether entry `i` of q is the value of a joint that slides. False without a robot, or if it has
/// joints of several coordinates.
[[nodiscard]] inline bool joint_slides(const RobotModel* robot, std::size_t i) {
  return robot && robot->is_simple() && i < robot->joints.size() &&
         robot->joints[i].type == JointType::prismatic;
}

/// Whether the axis is a joint of the robot: an entry of q.
[[nodiscard]] inline bool is_of_robot(const PostAxis& a) { return !a.external || a.of_robot != 0; }

/// Degrees or mm of the axis for one rad or m of its joint.
[[nodiscard]] inline double axis_scale(const PostAxis& a, const RobotModel* robot) {
  const bool is_linear = a.linear || (a.joint >= 0 && joint_slides(robot, std::size_t(a.joint)));
  return is_linear ? 1000.0 : 180.0 / std::numbers::pi;
}

/// The value of an axis of the robot [degrees or mm] at q [rad or m]; nothing = q is too short.
[[nodiscard]] inline std::optional<double> axis_value(const PostAxis& a, std::span<const double> q,
                                                      const RobotModel* robot) {
  if (a.joint < 0 || std::size_t(a.joint) >= q.size() || a.coupled.size() > q.size())
    return std::nullopt;
  double sum = a.sign * q[std::size_t(a.joint)];
  for (std::size_t k = 0; k < a.coupled.size(); ++k) sum += a.coupled[k] * q[k];
  return sum * axis_scale(a, robot) + a.offset;
}

/// q [rad or m] at these values of the robot's axes [degrees or mm], in their order without the
/// external ones that are no joints of the robot. Entries of q that no axis counts are those of
/// `rest` (coordinate_count() numbers). Nothing = the numbers of values and axes differ, an axis
/// names no entry, or axes depend on each other.
[[nodiscard]] inline std::optional<std::vector<double>> joints_from_axes(
    std::span<const PostAxis> axes, std::span<const double> values, std::span<const double> rest,
    const RobotModel* robot) {
  std::vector<const PostAxis*> own;
  for (const PostAxis& a : axes)
    if (is_of_robot(a)) own.push_back(&a);
  const std::size_t n = own.size();
  if (values.size() != n) return std::nullopt;
  std::vector<double> q(rest.begin(), rest.end());
  std::vector<std::size_t> entry;
  for (const PostAxis* a : own) {
    if (a->joint < 0 || std::size_t(a->joint) >= q.size() || a->coupled.size() > q.size() ||
        std::find(entry.begin(), entry.end(), std::size_t(a->joint)) != entry.end())
      return std::nullopt;
    entry.push_back(std::size_t(a->joint));
  }
  // Gauss with the greatest pivot: rows are axes, columns the entries that they are of.
  const std::size_t w = n + 1;
  std::vector<double> m(n * w, 0.0);
  for (std::size_t i = 0; i < n; ++i) {
    double right = (values[i] - own[i]->offset) / axis_scale(*own[i], robot);
    for (std::size_t k = 0; k < own[i]->coupled.size(); ++k) {
      const auto at = std::find(entry.begin(), entry.end(), k);
      if (at == entry.end()) right -= own[i]->coupled[k] * q[k];
      else m[i * w + std::size_t(at - entry.begin())] += own[i]->coupled[k];
    }
    m[i * w + i] += own[i]->sign;
    m[i * w + n] = right;
  }
  for (std::size_t c = 0; c < n; ++c) {
    std::size_t best = c;
    for (std::size_t r = c + 1; r < n; ++r)
      if (std::fabs(m[r * w + c]) > std::fabs(m[best * w + c])) best = r;
    if (!(std::fabs(m[best * w + c]) > 1e-9)) return std::nullopt;
    if (best != c)
      for (std::size_t k = 0; k < w; ++k) std::swap(m[c * w + k], m[best * w + k]);
    for (std::size_t r = 0; r < n; ++r) {
      const double f = r == c ? 0.0 : m[r * w + c] / m[c * w + c];
      if (f != 0)
        for (std::size_t k = c; k < w; ++k) m[r * w + k] -= f * m[c * w + k];
    }
  }
  for (std::size_t i = 0; i < n; ++i) q[entry[i]] = m[i * w + n] / m[i * w + i];
  return q;
}

}  // namespace robomosp
