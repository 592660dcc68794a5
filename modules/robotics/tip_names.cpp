// SPDX-License-Identifier: Apache-2.0
#include "robotics/tip_names.h"

namespace robomosp::robotics {

std::vector<bool> leaf_links(const model::Robot& robot) {
  std::vector<bool> out(robot.links.size(), true);
  for (const model::Link& link : robot.links)
    if (link.parent >= 0) out[static_cast<std::size_t>(link.parent)] = false;
  return out;
}

std::string leaf_tip_name(const model::Robot& robot, std::size_t link) {
  const std::string& name = robot.links[link].name;
  return name.empty() ? "link " + std::to_string(link + 1) : name;
}

void each_tip_name(const model::Robot& robot, const std::function<bool(std::string_view)>& see) {
  if (robot.links.empty() || !see("tool")) return;
  const std::vector<bool> is_leaf = leaf_links(robot);
  for (std::size_t i = 0; i + 1 < robot.links.size(); ++i)
    if (is_leaf[i] && !see(leaf_tip_name(robot, i))) return;
  for (const model::RobotTool& tool : robot.tools)
    if (!see(tool.name)) return;
}

}  // namespace robomosp::robotics
