// SPDX-License-Identifier: Apache-2.0
#include "robotics/grip.h"

#include "kernel/text.h"
#include "model/placement.h"
#include "spatial/pose.h"

namespace robomosp::robotics {

std::optional<LinkFrame> find_grip(const model::Robot& robot, const RobotModel& model,
                                   const std::string& link_or_tool) {
  if (link_or_tool.empty()) return LinkFrame{model.tips.front().joint, model.tips.front().tool};
  const auto on_link = [&](std::int32_t link, const Pose& t) {
    if (link < 0) return LinkFrame{-1, t};
    const LinkFrame f = link_frames(robot)[static_cast<std::size_t>(link)];
    return LinkFrame{f.joint, spatial::compose(f.joint_T_link, t)};
  };
  for (const model::RobotTool& tool : robot.tools)
    if (tool.name == link_or_tool) return on_link(tool.link, model::pose(tool.placement));
  if (!robot.attached.empty())
    for (const TipModel& tip : model.tips)
      if (tip.name == link_or_tool) return LinkFrame{tip.joint, tip.tool};
  for (std::size_t i = 0; i < robot.links.size(); ++i)
    if (robot.links[i].name == link_or_tool) return on_link(static_cast<std::int32_t>(i), Pose{});
  return {};
}

LinkFrame flange_frame(const model::Robot& robot) {
  const Pose tool = model::pose(robot.tool);
  if (robot.links.empty()) return {-1, tool};
  const LinkFrame last = link_frames(robot).back();
  return {last.joint, spatial::compose(last.joint_T_link, tool)};
}

Result<LinkFrame> grip_frame(const model::Robot& robot, const RobotModel& model,
                             const std::string& link_or_tool) {
  if (const auto found = find_grip(robot, model, link_or_tool)) return *found;
  std::vector<std::string> known;
  for (const model::RobotTool& tool : robot.tools) known.push_back(tool.name);
  for (const model::AttachedTool& tool : robot.attached) known.push_back(tool.name);
  for (const model::Link& link : robot.links) known.push_back(link.name);
  return error(ErrorCode::unknown_name, "it has no link or tool " + text::quote(link_or_tool),
               "It has " + text::enumerate(known) + ".", "robot " + text::quote(model.name));
}

}  // namespace robomosp::robotics
