// SPDX-License-Identifier: Apache-2.0
// The axes of a controller from the joints of a robot, and the joints from the axes: the only place
// that computes either (layer: contract helper, inline only, not part of the ABI). Axes are in
// degrees and mm, joints in rad and m. [any thread]
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
  std::vector<std::size_t> entry, open;       // of each axis; axes without their joint yet
  std::vector<std::size_t> row(q.size(), n);  // the axis of an entry; n = none
  std::vector<char> is_known(q.size(), 1);
  for (const PostAxis* a : own) {
    if (a->joint < 0 || std::size_t(a->joint) >= q.size() || a->coupled.size() > q.size() ||
        row[std::size_t(a->joint)] != n)
      return std::nullopt;
    open.push_back(entry.size());
    row[std::size_t(a->joint)] = entry.size();
    is_known[std::size_t(a->joint)] = 0;
    entry.push_back(std::size_t(a->joint));
  }
  constexpr double kLeast = 1e-9;
  const auto right_of = [&](std::size_t i) {
    double right = (values[i] - own[i]->offset) / axis_scale(*own[i], robot);
    for (std::size_t k = 0; k < own[i]->coupled.size(); ++k)
      if (is_known[k]) right -= own[i]->coupled[k] * q[k];
    return right;
  };
  const auto own_factor = [&](std::size_t i) {
    return own[i]->sign + (entry[i] < own[i]->coupled.size() ? own[i]->coupled[entry[i]] : 0.0);
  };
  // An axis with its other joints known gives its own.
  for (std::size_t before = n + 1; open.size() < before;) {
    before = open.size();
    std::erase_if(open, [&](std::size_t i) {
      for (std::size_t k = 0; k < own[i]->coupled.size(); ++k)
        if (own[i]->coupled[k] != 0 && !is_known[k] && k != entry[i]) return false;
      if (!(std::fabs(own_factor(i)) > kLeast)) return false;
      q[entry[i]] = right_of(i) / own_factor(i);
      is_known[entry[i]] = 1;
      return true;
    });
  }
  // Those that are left depend on each other. Gauss with the greatest pivot.
  const std::size_t m = open.size(), w = m + 1;
  std::vector<std::size_t> column(n, m);
  for (std::size_t c = 0; c < m; ++c) column[open[c]] = c;
  std::vector<double> t(m * w, 0.0);
  for (std::size_t r = 0; r < m; ++r) {
    const PostAxis& a = *own[open[r]];
    for (std::size_t k = 0; k < a.coupled.size(); ++k)
      if (!is_known[k]) t[r * w + column[row[k]]] += a.coupled[k];
    t[r * w + r] += a.sign;
    t[r * w + m] = right_of(open[r]);
  }
  for (std::size_t c = 0; c < m; ++c) {
    std::size_t best = c;
    for (std::size_t r = c + 1; r < m; ++r)
      if (std::fabs(t[r * w + c]) > std::fabs(t[best * w + c])) best = r;
    if (!(std::fabs(t[best * w + c]) > kLeast)) return std::nullopt;
    if (best != c)
      for (std::size_t k = 0; k < w; ++k) std::swap(t[c * w + k], t[best * w + k]);
    for (std::size_t r = 0; r < m; ++r) {
      const double f = r == c ? 0.0 : t[r * w + c] / t[c * w + c];
      if (f != 0)
        for (std::size_t k = c; k < w; ++k) t[r * w + k] -= f * t[c * w + k];
    }
  }
  for (std::size_t r = 0; r < m; ++r) q[entry[open[r]]] = t[r * w + m] / t[r * w + r];
  return q;
}

}  // namespace robomosp
