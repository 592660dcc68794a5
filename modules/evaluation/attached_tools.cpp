// SPDX-License-Identifier: Apache-2.0
#include "evaluation/attached_tools.h"

#include <utility>

#include "kernel/text.h"
#include "model/placement.h"
#include "spatial/pose.h"

namespace robomosp::evaluation {

using document::Snapshot;
using text::quote;

const std::vector<model::ToolCentrePoint>& tool_centre_points(const Snapshot& s, AnyId what) {
  static const std::vector<model::ToolCentrePoint> none;
  if (what.kind != Kind::object) return none;
  const auto* object = s.get(ObjectId{what.number});
  return object ? object->tcps : none;
}

Result<model::Robot> with_tool_frames(const Snapshot& s, const std::string& name,
                                      const model::Robot& robot) {
  model::Robot out = robot;
  out.attached.clear();
  out.tcp.clear();
  bool is_found = robot.tcp.empty();
  const auto add = [&](const std::string& tool, std::int32_t link, const model::Placement& at) {
    if (tool == robot.tcp) {
      out.tool = at;
      is_found = true;
    }
    model::RobotTool t;
    t.name = tool;
    t.link = link;
    t.placement = at;
    out.tools.push_back(std::move(t));
  };
  for (const model::AttachedTool& t : robot.attached) {
    add(t.name, t.link, t.placement);
    for (const model::ToolCentrePoint& tcp : tool_centre_points(s, t.what))
      add(t.name + "." + tcp.name, t.link,
          model::placement(spatial::compose(model::pose(t.placement), model::pose(tcp.placement))));
  }
  if (is_found) return out;
  std::vector<std::string> known;
  for (std::size_t i = robot.tools.size(); i < out.tools.size(); ++i)
    known.push_back(out.tools[i].name);
  return error(ErrorCode::unknown_name,
               "its tool is the centre point " + quote(robot.tcp) + ", which no longer exists",
               "Choose another with robot.change_tool, such as " + text::enumerate(known) + ".",
               "robot " + quote(name));
}

model::Robot without_tool_stick(const model::Robot& robot) {
  model::Robot out = robot;
  for (const model::AttachedTool& t : robot.attached)
    if (robot.tcp == t.name || robot.tcp.starts_with(t.name + ".")) out.tool = t.placement;
  return out;
}

}  // namespace robomosp::evaluation
