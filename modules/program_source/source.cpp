// SPDX-License-Identifier: Apache-2.0
#include "program_source/source.h"

#include <map>
#include <utility>

#include "kernel/text.h"
#include "model/placement.h"
#include "robotics/grip.h"
#include "robotics/single_joints.h"
#include "spatial/identity.h"
#include "spatial/pose.h"
#include "task/members.h"

namespace robomosp::program_source {

using text::quote;

Result<Arm> arm_of(const evaluation::Sources& from, const model::World& w, std::size_t which,
                   Progress& progress) {
  const model::PlacedRobot& placed = w.robots[which];
  Arm a;
  a.name = placed.name;
  a.record = from.snapshot.get(placed.robot);
  const Pose mounting = model::pose(placed.placement);
  RMP_TRY_ASSIGN(a.model,
                 from.derived.robot_model(from.snapshot, placed.robot,
                                          spatial::rotate_back(mounting, w.gravity), progress));
  a.base_T_world = spatial::inverse(spatial::compose(mounting, a.model->base));
  if (const std::string why = robotics::why_not_single_joints(*a.model); !why.empty())
    return error(ErrorCode::unsupported,
                 "robot " + quote(a.name) + ": " + why + ", which programs do not support",
                 "Use another robot.");
  return a;
}

Result<Arm> arm_named(const evaluation::Sources& from, WorldId world, const std::string& name,
                      Progress& progress) {
  const model::World& w = *from.snapshot.get(world);
  std::map<std::string, std::size_t> robots;
  for (std::size_t i = 0; i < w.robots.size(); ++i) robots[w.robots[i].name] = i;
  auto at = task::find_member(robots, name, "robot");
  if (!at.ok()) return std::move(at).error().in(name_of(from, world));
  return arm_of(from, w, *at, progress);
}

Result<std::string> Source::joints(std::span<const double> q) const {
  if (q.size() != arm_.model->joints.size())
    return error(ErrorCode::invalid_argument,
                 "robot " + quote(arm_.name) + " has " + std::to_string(arm_.model->joints.size()) +
                     " joints, but " + std::to_string(q.size()) + " values are given");
  std::string out = "MAIN_JOINT(";
  for (std::size_t j = 0; j < q.size(); ++j)
    out += (j ? ", " : "") +
           irl_real(q[j] *
                    (arm_.model->joints[j].type == JointType::revolute ? kDegreesPerRadian : kMm));
  return out + ")";
}

namespace {

/// TOOL of motions to places, where the robot has another tool than its flange: the program then
/// says what it moves wherever it is posted. Empty = none.
std::string tool_words(const Arm& arm) {
  const robotics::LinkFrame flange = robotics::flange_frame(*arm.record);
  const TipModel& tip = arm.model->tips.front();
  if (tip.joint != flange.joint) return {};
  const auto tool =
      spatial::unless_identity(spatial::compose(spatial::inverse(flange.joint_T_link), tip.tool));
  return tool ? " TOOL := " + irl_pose(*tool) : std::string();
}
/// Statements of motions to places, with `words` behind their attributes.
std::string with_tool(const std::string& text, const std::string& words) {
  if (words.empty()) return text;
  std::string out;
  bool is_motion = false;
  for (const std::string_view line : text::split(text, '\n')) {
    const std::size_t first = line.find_first_not_of(' ');
    if (first != std::string_view::npos && line.substr(first).starts_with("MOVE "))
      is_motion = line.find("JOINT(") == std::string_view::npos;
    std::string own(line);
    if (const std::size_t end = own.find(';'); is_motion && end != std::string::npos) {
      own.insert(end, words);
      is_motion = false;
    }
    out += own + "\n";
  }
  out.pop_back();
  return out;
}

}  // namespace

/// The record, of a program whose declarations are `head`.
WrittenProgram finished(const Source& source, const std::string& name, const std::string& from,
                        const std::string& head, const std::string& routines) {
  IrlNames names;
  const std::string id = names.name("", name);
  const std::string cell = irl_cell(source.arm().model->joints.size());
  std::string text = "PROGRAM " + id + ";\n" + irl_comment(from) + "\n";
  for (const std::string& n : source.notes) text += irl_comment(n) + "\n";
  if (!cell.empty()) text += "SYSTEM_SPECIFICATION '" + id + ".ssi';\n";
  const std::string tool = tool_words(source.arm());
  text += head + with_tool(routines, tool) + "BEGIN\n" + with_tool(source.body.text(), tool) +
          "ENDPROGRAM;\n";
  model::Program p;
  p.description = from;
  const auto add = [&](const std::string& file, const std::string& all) {
    model::ProgramFile f{file, {}};
    for (const std::string_view line : text::split(all, '\n')) f.lines.emplace_back(line);
    p.files.push_back(std::move(f));
  };
  add(id + ".irl", text);
  if (!cell.empty()) add(id + ".ssi", cell);
  return {name, std::move(p), source.notes};
}

std::string name_of(const evaluation::Sources& from, WorldId world) {
  return from.snapshot.describe(AnyId(world));
}

}  // namespace robomosp::program_source
