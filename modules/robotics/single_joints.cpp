// SPDX-License-Identifier: Apache-2.0
#include "robotics/single_joints.h"

namespace robomosp::robotics {

std::string why_not_single_joints(const RobotModel& model) {
  const auto quoted = [](const std::string& name) { return "\"" + name + "\""; };
  if (!model.loops.empty()) {
    const std::size_t more = model.loops.size() - 1;
    return "it has the closed loop " + quoted(model.loops.front().name) +
           (more == 0 ? "" : " and " + std::to_string(more) + " more");
  }
  for (const JointModel& j : model.joints) {
    if (j.is_coupled())
      return "its joint " + quoted(j.name) + " follows joint " +
             quoted(model.joints[static_cast<std::size_t>(j.coupling.of)].name);
    if (j.type == JointType::spherical) return "its joint " + quoted(j.name) + " is a ball joint";
    if (j.type == JointType::free) return "its joint " + quoted(j.name) + " is a free joint";
  }
  return {};
}

}  // namespace robomosp::robotics
