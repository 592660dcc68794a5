// SPDX-License-Identifier: Apache-2.0
#include "ioci/program/post_cell.h"

#include <utility>

#include <robomosp/sdk/post_writer.h>

#include "ioci/core/commands.h"
#include "ioci/program/in_world.h"
#include "ioci/robot/robots.h"
#include "robotics/grip.h"
#include "robotics/home.h"
#include "spatial/pose.h"
#include "task/target_places.h"

namespace robomosp::ioci {
namespace {

/// The model with its flange as the only tip.
std::shared_ptr<const RobotModel> of_flange(const std::shared_ptr<const RobotModel>& model,
                                            const robotics::LinkFrame& flange) {
  const TipModel& tip = model->tips.front();
  if (tip.joint == flange.joint && post::same_place(tip.tool, flange.joint_T_link)) return model;
  auto out = std::make_shared<RobotModel>(*model);
  out->tips = {{"flange", flange.joint, flange.joint_T_link}};
  return out;
}

std::string millimetres(const Pose& p) {
  const post::Placed at = post::placed(p, post::Orientation::zyx);
  std::string out = "(";
  for (std::size_t i = 0; i < 3; ++i) out += (i ? ", " : "") + post::trimmed(at.mm[i], 3);
  out += ") mm";
  Pose turn;
  turn.R = p.R;
  if (post::same_place(turn, Pose{})) return out;
  out += ", A B C (";
  for (std::size_t i = 0; i < 3; ++i) out += (i ? ", " : "") + post::trimmed(at.ori[i], 3);
  return out + ") degrees";
}

rmp_span head(const rmp_code& code) { return row<rmp_code_routine>(code.routines, 0).span; }

void note_places(PostCell& cell, const rmp_code& code, const task::TargetPlaces& lead,
                 const std::string& world) {
  std::string what;
  if (cell.places.frame)
    what += "targets are in frame " + text::quote(lead.frame) + " at " +
            millimetres(*cell.places.frame) + " of the robot's base";
  if (cell.places.tool)
    what += (what.empty() ? "the tool" : ", the tool") +
            (lead.tool.empty() ? "" : " " + text::quote(lead.tool)) + " is at " +
            millimetres(*cell.places.tool) + " of the flange";
  if (!what.empty())
    cell.remarks.push_back({RMP_FAULT_NOTE, head(code), "as in " + world + ": " + what, {}});
  if (lead.frame_is_object && cell.places.frame)
    cell.remarks.push_back(
        {RMP_FAULT_WARNING, head(code),
         "the frame " + text::quote(lead.frame) +
             " is an object, which may move: its place at the start is written",
         "Bind the program to a frame of the world, or check the post with run_check."});
}

}  // namespace

Result<PostCell> post_cell(CommandContext& ctx, const Map& args,
                           std::shared_ptr<const CompiledProgram> program,
                           std::string_view symbol) {
  PostCell out;
  const AnyId id = ref(args, "id");
  const document::Snapshot& now = ctx.snapshot();
  const auto places = places_of(now, id, args);
  const bool is_asked = has(args, "world") || has(args, "name_there");
  if (is_asked && places.empty()) {
    RMP_TRY(place_of(ctx, args));
  }
  const rmp_code& code = program->code();
  const sim::Simulator simulator{ctx.app.registry, ctx.app.derived, now, &ctx.app.collision_models};
  std::optional<task::TargetPlaces> lead;
  std::string of;
  for (const ProgramPlace& place : places) {
    task::ProgramInWorld wanted;
    wanted.code = program;
    wanted.placement = *place.placed;
    const std::string there = describe(now, place);
    auto found = task::target_places(simulator, place.world, wanted, symbol, ctx.progress);
    if (!found.ok()) {
      // Of several robots a post says itself which it takes.
      const bool is_of_several = found.error().code == ErrorCode::not_found;
      if ((is_asked && !is_of_several) || found.error().code == ErrorCode::cancelled)
        return std::move(found).error().in(now.describe(AnyId(place.world)));
      out.remarks.push_back(
          {RMP_FAULT_WARNING, head(code),
           "no frame and tool are written of " + there + ": " + found.error().message,
           found.error().hint});
      continue;
    }
    if (has(args, "robot") && ref(args, "robot") != AnyId(found->record)) {
      const std::string words = "in " + there + " the program moves robot " +
                                text::quote(found->robot) + ", not " +
                                text::quote(now.find(ref(args, "robot"))->name);
      if (is_asked) return error(ErrorCode::invalid_argument, words, "Leave robot out.", "robot");
      out.remarks.push_back(
          {RMP_FAULT_NOTE, head(code), words + ": its frame and tool there are not written", {}});
      continue;
    }
    if (lead && (lead->record != found->record ||
                 !post::same_place(lead->base_T_frame, found->base_T_frame) ||
                 !post::same_place(lead->flange_T_tool, found->flange_T_tool)))
      return error(
          ErrorCode::invalid_argument,
          "the program has different robots, frames or tools as " + of + " and as " + there,
          "Give world or name_there.", name_in(ctx, id));
    if (lead) continue;
    lead = std::move(*found);
    of = there;
  }
  RobotId record{};
  if (lead) {
    record = lead->record;
    out.is_placed = true;
  } else if (has(args, "robot")) {
    record = typed<model::Robot>(args, "robot");
  } else {
    return out;
  }
  const model::Robot& robot = *now.get(record);
  RMP_TRY_ASSIGN(const auto model,
                 ctx.app.derived.robot_model(now, record, {0, 0, -9.81}, ctx.progress));
  const robotics::LinkFrame flange = robotics::flange_frame(robot);
  if (lead) {
    out.places = {program_post::unless_identity(lead->base_T_frame),
                  program_post::unless_identity(lead->flange_T_tool)};
    note_places(out, code, *lead, of);
    if (lead->rail > 0) {
      out.remarks.push_back({RMP_FAULT_WARNING, head(code),
                             "robot " + text::quote(lead->robot) +
                                 " is mounted on a rail of the program: joints and configurations "
                                 "of its targets are not computed",
                             "Give targets as joints where the configuration matters."});
      return out;
    }
  } else {
    const TipModel& tip = model->tips.front();
    if (tip.joint == flange.joint)
      out.places.tool = program_post::unless_identity(
          spatial::compose(spatial::inverse(flange.joint_T_link), tip.tool));
  }
  out.robot = of_flange(model, flange);
  out.ik = robot.ik;
  out.robot_name = now.find(record)->name;
  auto maker = robotics::MakerAxes::of(robot);
  if (!maker.ok()) return std::move(maker).error().in("robot " + text::quote(out.robot_name));
  out.maker = std::move(*maker);
  out.start = lead ? lead->start : robotics::home_joint_values(robot);
  return out;
}

}  // namespace robomosp::ioci
