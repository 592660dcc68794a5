// SPDX-License-Identifier: Apache-2.0
#include "robotics/rail.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>

#include "spatial/pose.h"
#include "spatial/rotation.h"

namespace robomosp::robotics {

Pose base_T_carriage(const RobotModel& chain, std::size_t rail, std::span<const double> q) {
  Pose out{};
  for (std::size_t j = 0; j < rail && j < q.size(); ++j) {
    const JointModel& joint = chain.joints[j];
    Pose by{};
    if (joint.type == JointType::prismatic) by.p = {0, 0, q[j]};
    else by.R = spatial::from_quaternion({std::cos(q[j] / 2), 0, 0, std::sin(q[j] / 2)});
    out = spatial::compose(out, spatial::compose(joint.placement, by));
  }
  return out;
}

std::shared_ptr<RobotModel> arm_behind_rail(const RobotModel& chain, std::size_t rail) {
  auto out = std::make_shared<RobotModel>(chain);
  if (rail == 0) return out;
  const auto by = static_cast<std::int32_t>(rail);
  out->joints.erase(out->joints.begin(), out->joints.begin() + by);
  for (JointModel& j : out->joints) j.parent = std::max(-1, j.parent - by);
  std::erase_if(out->tips, [&](const TipModel& t) { return t.joint < by - 1; });
  for (TipModel& t : out->tips) t.joint = std::max(-1, t.joint - by);
  out->number_coordinates();
  return out;
}

Result<void> axes_behind_rail(std::span<PostAxis> axes, std::span<const RailJoint> rail) {
  constexpr double kDegrees = 180 / std::numbers::pi, kMillimetres = 1000;
  const std::size_t n = rail.size();
  for (PostAxis& a : axes) {
    const bool is_of_rail = a.joint >= 0 && static_cast<std::size_t>(a.joint) < n;
    for (std::size_t k = 0; k < a.coupled.size(); ++k)
      if (a.coupled[k] != 0 && (is_of_rail || k < n))
        return error(ErrorCode::unsupported,
                     "axis " + std::string(a.name) +
                         " counts several joints, and some of them are additional joints that "
                         "carry the arm",
                     "Let each additional joint have an axis that counts it alone "
                     "(robot.set_axes).");
    if (is_of_rail) {
      const RailJoint& joint = rail[static_cast<std::size_t>(a.joint)];
      a.sign *= axis_scale(a, nullptr) / (joint.is_rotary ? kDegrees : kMillimetres);
      a.joint = static_cast<std::int32_t>(joint.number) - 1;
      a.external = true;
      a.of_robot = 0;
      a.coupled = {};
    } else {
      a.joint -= static_cast<std::int32_t>(n);
      if (!a.coupled.empty()) a.coupled = a.coupled.subspan(n);
    }
  }
  return {};
}

}  // namespace robomosp::robotics
