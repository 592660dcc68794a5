// SPDX-License-Identifier: Apache-2.0
#include "program_post/robot_cell.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include <robomosp/sdk/post_writer.h>
#include <robomosp/sdk/program_turns.h>

#include "kernel/text.h"
#include "robotics/grip.h"
#include "robotics/home.h"
#include "robotics/rail.h"
#include "spatial/identity.h"
#include "spatial/pose.h"
#include "task/target_places.h"

namespace robomosp::program_post {
namespace {

using program_source::ProgramPlace, program_source::Workshop;

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
  if (!lead.frame_carrier.empty())
    cell.remarks.push_back(
        {RMP_FAULT_ERROR, head(code),
         "the frame " + text::quote(lead.frame) + " is an object that " +
             text::quote(lead.frame_carrier) +
             " carries, which the program moves: posts write frames that stay",
         "Bind the program to a frame of the world, and give its targets there."});
  else if (lead.frame_is_object && cell.places.frame)
    cell.remarks.push_back(
        {RMP_FAULT_WARNING, head(code),
         "the frame " + text::quote(lead.frame) +
             " is an object, which may move: its place at the start is written",
         "Bind the program to a frame of the world, or check the post with run_check."});
}

/// Additional joints that are joints of the world. Of a robot on a rail what is left is the arm.
void carry(PostCell& cell, const rmp_code& code, const task::TargetPlaces& lead) {
  Carrier c;
  c.rail = lead.rail;
  c.start = cell.start;
  c.has_no_additional = cell_number(code, "R_NADDJ", 1) == 0;
  for (std::uint32_t i = 0; i < code.types.count; ++i)
    if (const auto& t = row<rmp_code_type>(code.types, i); t.role == RMP_ROLE_ADD_JOINT)
      c.slots = t.field_count;
  const bool counts_axes = counts_maker_axes(code);
  // A joint at 0.4 m is at 400 mm, and not beside it by a rounding.
  const auto whole = [](double v) { return std::round(v * 1e9) / 1e9; };
  cell.rail.resize(lead.rail);
  for (const task::AdditionalJoint& a : lead.additional) {
    CarriedAxis one;
    one.number = a.number, one.rail = a.rail, one.is_rotary = a.is_rotary;
    one.start = whole(a.start), one.lower = a.lower, one.upper = a.upper;
    if (counts_axes) one.sign = a.maker.sign, one.offset = a.maker.offset;
    one.name = a.joint + " of " + a.robot;
    if (a.rail >= 0) cell.rail[static_cast<std::size_t>(a.rail)] = {a.number, a.is_rotary};
    c.slots = std::max(c.slots, a.number);
    c.axes.push_back(std::move(one));
    cell.axis_names.push_back(a.axis);
    cell.axis_counts.push_back(a.maker);
  }
  if (lead.rail > 0) {
    c.chain = cell.robot;
    cell.robot = robotics::arm_behind_rail(*c.chain, lead.rail);
    cell.start.erase(cell.start.begin(),
                     cell.start.begin() + static_cast<std::ptrdiff_t>(lead.rail));
  }
  cell.carrier = std::move(c);
}

/// The robot alone, as in a run of a program without a world: external axes of the maker that carry
/// it are additional joints. Nothing = it has none.
Result<std::optional<task::TargetPlaces>> alone_places(
    const Workshop& with, RobotId record, const std::shared_ptr<const CompiledProgram>& program,
    std::string_view symbol) {
  const model::Robot& robot = *with.snapshot().get(record);
  if (std::none_of(robot.axes.begin(), robot.axes.end(),
                   [](const model::MakerAxis& a) { return a.external; }))
    return std::optional<task::TargetPlaces>();
  RMP_TRY_ASSIGN(auto scratch, with.document.begin("post of a program"));
  scratch.base_on(std::make_shared<const document::Snapshot>(with.snapshot()));
  model::World world;
  world.robots.push_back({"robot", record, {}, {}, model::BaseKind::fixed, {}});
  RMP_TRY_ASSIGN(const WorldId id, scratch.add(scratch.free_name(Kind::world, "post"), world));
  const document::Snapshot now = scratch.now();
  const sim::Simulator simulator = with.simulator_on(now);
  task::ProgramInWorld wanted;
  wanted.code = program;
  wanted.placement.name = program->code().name;
  RMP_TRY_ASSIGN(auto found, task::target_places(simulator, id, wanted, symbol, with.progress));
  return std::optional(std::move(found));
}

/// The tag of targets whose controllers know which external axis carries the robot.
constexpr const char* kCarriedBase = "carried_base";

}  // namespace

Result<RailKind> rail_kind(const ProviderInfo& target, const PostCapabilities& caps,
                                         const PostProfile& profile) {
  if (caps.external_axes <= 0) return RailKind::none;
  const bool knows =
      std::find(target.tags.begin(), target.tags.end(), kCarriedBase) != target.tags.end();
  for (const PostOption& o : profile.options) {
    if (o.name != "rail") continue;
    if (o.value == "base") return RailKind::base;
    if (o.value == "carriage") return RailKind::carriage;
    return error(ErrorCode::invalid_argument,
                 "the option rail is " + text::quote(o.value) + ", which is not base or carriage",
                 "base: the controller knows which external axis carries the robot; carriage: it "
                 "does not.",
                 "controller " + text::quote(profile.name));
  }
  return knows ? RailKind::base : RailKind::carriage;
}

void carry_axes(robotics::ControllerProfile& profile, const PostCell& cell) {
  std::vector<robotics::ControllerProfile::AdditionalAxis> bound;
  for (std::size_t i = 0; i < cell.carrier->axes.size(); ++i) {
    const CarriedAxis& a = cell.carrier->axes[i];
    bound.push_back({a.number, !a.is_rotary, cell.axis_counts[i].sign, cell.axis_counts[i].offset,
                     a.lower, a.upper, cell.axis_names[i]});
  }
  profile.carry(bound, cell.carrier->slots);
}

Result<PostCell> post_cell(const Workshop& with, const CellWish& wish,
                           std::shared_ptr<const CompiledProgram> program,
                           std::string_view symbol) {
  PostCell out;
  const AnyId id = wish.program;
  const document::Snapshot& now = with.snapshot();
  const auto places = program_source::places_of(now, id, wish.place);
  const bool is_asked = wish.place.is_given();
  if (is_asked && places.empty()) RMP_TRY(program_source::place_of(now, id, wish.place));
  const rmp_code& code = program->code();
  const sim::Simulator simulator = with.simulator_on(now);
  std::optional<task::TargetPlaces> lead;
  std::string of;
  for (const ProgramPlace& place : places) {
    task::ProgramInWorld wanted;
    wanted.code = program;
    wanted.placement = *place.placed;
    const std::string there = describe(now, place);
    auto found = task::target_places(simulator, place.world, wanted, symbol, with.progress);
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
    if (wish.robot.number != 0 && wish.robot != found->record) {
      const std::string words = "in " + there + " the program moves robot " +
                                text::quote(found->robot) + ", not " +
                                text::quote(now.find(AnyId(wish.robot))->name);
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
          "Give world or name_there.", now.describe(id));
    if (lead) continue;
    lead = std::move(*found);
    of = there;
  }
  RobotId record{};
  if (lead) {
    record = lead->record;
    out.is_placed = true;
  } else if (wish.robot.number != 0) {
    record = wish.robot;
  } else {
    return out;
  }
  const model::Robot& robot = *now.get(record);
  RMP_TRY_ASSIGN(const auto model,
                 with.from.derived.robot_model(now, record, {0, 0, -9.81}, with.progress));
  const robotics::LinkFrame flange = robotics::flange_frame(robot);
  if (lead) {
    out.places = {spatial::unless_identity(lead->base_T_frame),
                  spatial::unless_identity(lead->flange_T_tool)};
    note_places(out, code, *lead, of);
  } else {
    const TipModel& tip = model->tips.front();
    if (tip.joint == flange.joint)
      out.places.tool = spatial::unless_identity(
          spatial::compose(spatial::inverse(flange.joint_T_link), tip.tool));
  }
  out.robot = of_flange(model, flange);
  out.start = lead ? lead->start : robotics::home_joint_values(robot);
  out.ik = robot.ik;
  out.robot_name = now.find(record)->name;
  auto maker = robotics::MakerAxes::of(robot);
  if (!maker.ok()) return std::move(maker).error().in("robot " + text::quote(out.robot_name));
  out.maker = std::move(*maker);
  if (!lead) {
    RMP_TRY_ASSIGN(lead, alone_places(with, record, program, symbol));
    if (lead) out.start = lead->start;
  }
  if (lead && !lead->additional.empty()) carry(out, code, *lead);
  return out;
}

}  // namespace robomosp::program_post
