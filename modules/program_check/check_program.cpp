// SPDX-License-Identifier: Apache-2.0
#include "program_check/check_program.h"

#include <algorithm>
#include <utility>
#include <variant>
#include <vector>

#include "kernel/text.h"
#include "model/controller.h"
#include "program_source/compile.h"
#include "program_source/source_text.h"
#include "robotics/controller_profile.h"
#include "task/target_places.h"

namespace robomosp::program_check {
namespace {

using program_source::named_once, program_source::place_of, program_source::places_of,
    program_source::ProgramPlace, program_source::programs_of, program_source::Workshop;

/// A world for a program that has none: the robot alone, in a snapshot that nobody publishes.
Result<void> alone(const Workshop& with, const CheckTask& task, CheckedProgram& out,
                   std::string& name_there) {
  RMP_TRY_ASSIGN(auto scratch, with.document.begin("check of a program"));
  // As this session sees the document: the robot may just have come from the library.
  scratch.base_on(std::make_shared<const document::Snapshot>(with.snapshot()));
  model::World world;
  world.robots.push_back({"robot", task.robot, {}, {}, model::BaseKind::fixed, {}});
  world.robots.back().name = with.snapshot().find(AnyId(task.robot))->name;
  const std::string name = with.snapshot().find(task.program)->name;
  RMP_TRY_ASSIGN(out.world, scratch.add(scratch.free_name(Kind::world, name + "_check"), world));
  out.snapshot = std::make_shared<const document::Snapshot>(scratch.now());
  name_there = name;
  return {};
}

void put_in_place(const InItsPlace* instead, task::ProgramInWorld& one, const model::World& world) {
  if (!instead) return;
  one.code = instead->code;
  one.frees_unbound = true;
  one.moves_flange = instead->moves_flange;
  one.counted = instead->counted;
  one.is_on_carriage = instead->is_on_carriage;
  instead->bind(one.placement, world);
}

/// The limits that a controller's record gives for each robot of the world.
Result<void> limits_of_profile(const Workshop& with, AnyId id, const task::ProgramInWorld& program,
                               CheckedProgram& out) {
  Options& options = out.options;
  const model::Record* r = with.snapshot().find(id);
  const auto& c = std::get<model::OtherContent>(r->body).as<model::Controller>();
  // Of a robot on a rail the profile counts the joints of the arm.
  const sim::Simulator looks = with.simulator_on(*out.snapshot);
  auto lead = task::target_places(looks, out.world, program, {}, with.progress);
  if (!lead.ok() && lead.error().code == ErrorCode::cancelled) return std::move(lead).error();
  options.controller = r->name;
  options.most_speed = c.max_speed * 1000;
  options.most_speed_orientation = c.max_speed_ori * program_source::kDegreesPerRadian;
  for (const model::PlacedRobot& placed : out.snapshot->get(out.world)->robots) {
    robotics::ControllerProfile profile;
    profile.name = r->name;
    profile.record = c;
    RMP_TRY(profile.fill());
    auto maker = robotics::MakerAxes::of(*out.snapshot->get(placed.robot));
    if (!maker.ok()) return std::move(maker).error().in("robot " + text::quote(placed.name));
    // What is wrong with bindings is the run's to say.
    std::vector<robotics::RailJoint> rail;
    if (lead.ok() && lead->robot == placed.name) {
      rail.resize(lead->rail);
      for (const task::AdditionalJoint& a : lead->additional)
        if (a.rail >= 0) rail[static_cast<std::size_t>(a.rail)] = {a.number, a.is_rotary};
    }
    // program.post reports contradictions.
    RMP_TRY(profile.use(std::move(*maker), placed.name, rail));
    for (const PostAxis& a : profile.axes) {
      const bool has_limits = std::any_of(c.axes.begin(), c.axes.end(), [&](const auto& own) {
        return own.name == a.name && own.lower < own.upper;
      });
      auto joint = static_cast<std::size_t>(std::max(0, a.joint)) + rail.size();
      if (!is_of_robot(a))
        for (std::size_t k = 0; k < rail.size(); ++k)
          if (rail[k].number == static_cast<std::size_t>(std::max(0, a.joint)) + 1) joint = k;
      const bool is_there = is_of_robot(a) || joint < rail.size();
      if (!has_limits || !is_there || a.joint < 0) continue;
      AxisLimit limit{placed.name, std::string(a.name), joint, {}, a.offset, a.lower, a.upper};
      limit.factors.emplace_back(limit.joint, a.sign);
      for (std::size_t k = 0; k < a.coupled.size(); ++k)
        if (a.coupled[k] != 0) limit.factors.emplace_back(k + rail.size(), a.coupled[k]);
      options.axes.push_back(std::move(limit));
    }
  }
  return {};
}

}  // namespace

Result<CheckedProgram> check_program(const Workshop& with, const CheckTask& task,
                                     const InItsPlace* instead) {
  const AnyId id = task.program;
  const auto places = places_of(with.snapshot(), id);
  CheckedProgram out;
  task::TaskRun run;
  std::size_t checked = 0;
  const bool frees = task.frees_unbound;
  if (places.empty() && task.robot.number != 0) {
    task::ProgramInWorld one;
    RMP_TRY_ASSIGN(one.code, compile_program(with, id));
    RMP_TRY(alone(with, task, out, one.placement.name));
    one.frees_unbound = frees;
    put_in_place(instead, one, *out.snapshot->get(out.world));
    out.code = one.code, out.name = one.placement.name;
    run.programs.push_back(std::move(one));
  } else {
    if (places.empty())
      return error(ErrorCode::invalid_argument, "no world has this program",
                   "Give robot to run it alone, or place it with world.add_program.",
                   with.snapshot().describe(id));
    if (task.robot.number != 0)
      return error(ErrorCode::invalid_argument, "the program already has a world",
                   "Leave robot out; program.bind{kind = \"robot\"} changes it.", "robot");
    RMP_TRY_ASSIGN(const ProgramPlace place, place_of(with.snapshot(), id, task.place));
    out.world = place.world, out.name = place.placed->name;
    // A snapshot is a value that shares its records.
    out.snapshot = std::make_shared<const document::Snapshot>(with.snapshot());
    for (const ProgramPlace& other : programs_of(with.snapshot(), place.world)) {
      const bool is_own = other.at == place.at;
      if (!is_own && task.alone) continue;
      task::ProgramInWorld one;
      RMP_TRY_ASSIGN(one.code, compile_program(with, other.placed->program, &other));
      one.placement = *other.placed;
      one.frees_unbound = frees;
      if (is_own) put_in_place(instead, one, *with.snapshot().get(place.world));
      if (is_own) checked = run.programs.size(), out.code = one.code;
      run.programs.push_back(std::move(one));
    }
  }
  run.world = out.world;
  run.has_tasks = !task.alone;
  run.sample_time = task.sample_time;
  run.most_time = task.most_time;
  Options& options = out.options;
  options.clearance = task.clearance;
  options.condition = task.condition;
  options.contacts = task.contacts;
  options.torques = task.torques;
  if (task.profile.number != 0)
    RMP_TRY(limits_of_profile(with, task.profile, run.programs[checked], out));
  auto done =
      check(with.simulator_on(*out.snapshot), std::move(run), checked, options, with.progress);
  if (!done.ok()) return named_once(std::move(done).error(), with.snapshot().describe(id));
  out.check = std::move(*done);
  if (task.alone)
    out.check.not_checked.emplace_back(
        "Other programs and tasks of the world did not run beside it.");
  return out;
}

}  // namespace robomosp::program_check
