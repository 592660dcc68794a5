// SPDX-License-Identifier: Apache-2.0
#include "robotics/arm_status.h"

#include <array>
#include <cmath>

#include "spatial/pose.h"
#include "spatial/vec.h"

namespace robomosp::robotics {
namespace {

using spatial::add;
using spatial::cross;
using spatial::dot;
using spatial::norm;
using spatial::scale;
using spatial::sub;

/// A point and a direction.
struct StatusAxis {
  Vec3 at{}, along{};
};

}  // namespace

std::optional<std::uint32_t> arm_status(const RobotModel& robot, std::span<const double> q) {
  constexpr double kSameLine = 1e-5;
  if (!robot.is_simple() || robot.joints.size() != 6 || q.size() != 6) return std::nullopt;
  std::array<StatusAxis, 6> axes;
  Vec3 bend{};  // axis 5 where joint 4 is 0
  Pose frame;
  for (std::size_t i = 0; i < 6; ++i) {
    const JointModel& j = robot.joints[i];
    if (j.type != JointType::revolute || j.parent != static_cast<std::int32_t>(i) - 1 ||
        j.is_coupled())
      return std::nullopt;
    frame = spatial::compose(frame, j.placement);
    axes[i] = {frame.p, spatial::axis(frame, 2)};
    if (i == 3) bend = spatial::axis(spatial::compose(frame, robot.joints[4].placement), 2);
    // All turns with joint 1, so that it is looked at where that is 0.
    frame = spatial::compose(frame, spatial::rotation_z(i == 0 ? 0.0 : q[i]));
  }
  // The wrist: the point of axis 5 nearest to axis 4.
  const Vec3 n = cross(axes[3].along, axes[4].along);
  const double nn = dot(n, n);
  if (nn < kSameLine) return std::nullopt;
  const double way = dot(cross(sub(axes[3].at, axes[4].at), axes[3].along), n) / nn;
  const Vec3 wrist = add(axes[4].at, scale(axes[4].along, way));
  double length = 0;
  for (std::size_t i = 1; i < 6; ++i) length += spatial::distance(axes[i].at, axes[i - 1].at);
  for (const std::size_t i : {3U, 5U})
    if (norm(cross(sub(wrist, axes[i].at), axes[i].along)) > kSameLine * length)
      return std::nullopt;
  const Vec3 across = cross(axes[1].along, axes[2].along);
  if (dot(across, across) > kSameLine || std::fabs(dot(axes[0].along, axes[1].along)) > kSameLine)
    return std::nullopt;
  const Vec3 up = axes[0].along[2] < 0 ? scale(axes[0].along, -1) : axes[0].along;
  Vec3 front = cross(axes[1].along, up);
  const double beside = dot(front, sub(axes[1].at, axes[0].at));
  const double side = std::fabs(beside) > kSameLine * length ? beside : front[0];
  if (side < 0) front = scale(front, -1);
  const bool is_behind = dot(front, sub(wrist, axes[0].at)) < 0;
  const Vec3 to_wrist = sub(wrist, axes[1].at), to_elbow = sub(axes[2].at, axes[1].at);
  const double above =
      dot(front, to_wrist) * dot(up, to_elbow) - dot(up, to_wrist) * dot(front, to_elbow);
  const bool is_below = (is_behind ? -above : above) < 0;
  // Axis 5 in the sense in which axis 2 lowers the arm in front.
  const double lowers = dot(bend, cross(up, front));
  if (std::fabs(lowers) < 0.5) return std::nullopt;
  const double sine = dot(cross(axes[3].along, axes[5].along), axes[4].along);
  const bool is_flipped = (lowers < 0 ? -sine : sine) < 0;
  return (is_behind ? kShoulderBehind : 0U) | (is_below ? kElbowBelow : 0U) |
         (is_flipped ? kWristFlipped : 0U);
}

}  // namespace robomosp::robotics
