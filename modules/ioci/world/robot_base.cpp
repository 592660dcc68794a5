// SPDX-License-Identifier: Apache-2.0
// How the base of a robot is held in a world: fixed, or moved along a trajectory of the world.
#include <algorithm>
#include <vector>

#include "ioci/robot/robots.h"
#include "ioci/robot/shown_robot.h"
#include "ioci/world/members.h"
#include "model/placement.h"
#include "motion/cartesian_path.h"
#include "spatial/pose.h"

namespace robomosp::ioci {
namespace {

using model::BaseKind;
using model::World;

constexpr double kMostSamples = 5e6;

/// The trajectory of its world that the base follows.
Result<const model::PlacedTrajectory*> base_way(const CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const ShownRobot s, shown_robot(ctx, args));
  const World& w = *ctx.snapshot().get(s.world);
  const model::PlacedRobot& robot = w.robots[s.member];
  const auto at = std::find_if(w.trajectories.begin(), w.trajectories.end(),
                               [&](const auto& t) { return t.name == robot.base_trajectory; });
  if (!robot.base_trajectory.empty() && at != w.trajectories.end()) return &*at;
  return error(ErrorCode::conflict,
               "its base follows no trajectory in world " +
                   text::quote(ctx.snapshot().find(AnyId(s.world))->name),
               "Set one with robot.set_base, or with PRobot <id> AddBaseTjc <trajectory>.",
               name_in(ctx, ref(args, "id")));
}

struct Way {
  std::vector<double> times;
  std::vector<PathSample> samples;
  Pose world_T_path;
};
Result<Way> sampled(const CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const model::PlacedTrajectory* placed, base_way(ctx, args));
  const document::Snapshot& now = ctx.snapshot();
  const model::Trajectory& t = *now.get(placed->trajectory);
  RMP_TRY_ASSIGN(const auto path,
                 motion::Path::build(ctx.app.registry, placed->name, t, motion::stored_in(now)));
  if (path->duration() / t.sample_time > kMostSamples)
    return error(ErrorCode::invalid_argument,
                 "a sample time of " + text::print(t.sample_time) + " s makes more than " +
                     text::print(kMostSamples) + " samples",
                 "Set a longer sample_time.", "trajectory " + text::quote(placed->name));
  Way way;
  way.times = path->sample_times(t.sample_time);
  way.samples.resize(way.times.size());
  way.world_T_path = model::pose(placed->placement);
  RMP_TRY(path->sample(way.times, way.samples));
  return way;
}

Result<Value> base_trajectory(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const model::PlacedTrajectory* way, base_way(ctx, args));
  return Value(way->name);
}

Result<Value> base_points(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const Way way, sampled(ctx, args));
  std::vector<double> rows;
  rows.reserve(7 * way.times.size());
  for (std::size_t i = 0; i < way.times.size(); ++i) {
    const auto p = model::placement(spatial::compose(way.world_T_path, way.samples[i].pose));
    rows.insert(rows.end(), {way.times[i], p.position[0], p.position[1], p.position[2], p.angles[0],
                             p.angles[1], p.angles[2]});
  }
  return Value(NumericArray(std::move(rows), way.times.size(), 7));
}

Result<Value> base_point_count(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const Way way, sampled(ctx, args));
  return Value(way.times.size());
}

Result<Value> set_base(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const ShownRobot s, shown_robot(ctx, args));
  std::optional<BaseKind> kind;
  if (has(args, "kind")) {
    const std::string wanted = text_of(args, "kind");
    const auto at = std::find(model::kBaseWords.begin(), model::kBaseWords.end(), wanted);
    kind = static_cast<BaseKind>(at - model::kBaseWords.begin());
  }
  std::optional<std::string> way;
  if (has(args, "trajectory")) {
    const Value& given = *args.find("trajectory");
    auto found = find_trajectory(ctx, s.world, given, name_in(ctx, ref(args, "id")));
    if (found.ok()) {
      way = ctx.snapshot().get(s.world)->trajectories[*found].name;
    } else if (const std::string* file = given.as_string(); file && file->ends_with(".tjc")) {
      RMP_TRY_ASSIGN(const Value made,
                     ctx.dispatch("world.load_trajectory",
                                  {{"id", Application::handle(s.world)}, {"file", *file}}));
      way = *made.as_string();
    } else {
      return std::move(found).error();
    }
  }
  if (!kind && !way)
    return error(ErrorCode::usage, "neither kind nor trajectory is given", "Give one of them.",
                 name_in(ctx, ref(args, "id")));
  if (way && kind == BaseKind::fixed)
    return error(ErrorCode::invalid_argument, "a fixed base cannot follow a trajectory",
                 "Make it free_flying, free_floating or serpentine, or leave the trajectory out.",
                 name_in(ctx, ref(args, "id")));
  std::string now;
  auto done = change<World>(ctx, s.world, [&](World& w) -> Result<void> {
    model::PlacedRobot& robot = w.robots[s.member];
    if (kind) robot.base = *kind;
    if (way) robot.base_trajectory = *way;
    if (way && robot.base == BaseKind::fixed) robot.base = BaseKind::free_flying;
    if (robot.base == BaseKind::fixed) robot.base_trajectory.clear();
    now = robot.base_trajectory;
    return {};
  });
  if (!done.ok()) return std::move(done).error();
  return Value(now);
}

}  // namespace

RMP_COMMANDS(robot_base_commands) {
  std::vector<CommandSpec> all;
  const ParamSpec world = shown_world();
  const auto moving = [](const std::string& rest) {
    return example_cell(
               "trajectory.create{name = \"drive\", sample_time = 0.1, segments = {{shape = "
               "\"line\", points = {{0, 0, 0, 0, 0, 0}, {0.3, 0, 0, 0, 0, 0}}}}}\n"
               "cell:add_trajectory{trajectory = \"drive\"}\n"
               "arm:set_base{kind = \"free_flying\", trajectory = \"drive\"}\n") +
           rest;
  };
  std::vector<std::string> kinds(model::kBaseWords.begin(), model::kBaseWords.end());
  ParamSpec kind = choice("kind", std::move(kinds),
                          "How the base is held; unchanged if omitted, but free_flying if a "
                          "trajectory is given to a fixed one.");
  kind.default_value.reset();
  all.push_back(
      {.name = "robot.set_base",
       .classic = "PRobot AddBaseTjc(trajectory)",
       .summary = "Sets how a world holds the base of a robot, and its trajectory.",
       .details = "Runs along trajectories and forward dynamics move the mounting frame along it. "
                  "All other commands, including pictures and collision checks, use the placement "
                  "of the robot. The kinds are only names; they do not change the computation.",
       .example = moving("assert(arm:base_type() == \"Free Flying\")"),
       .params = {self("robot"),
                  optional("trajectory", "any", "",
                           "A trajectory of the world, by name or record; or a file *.tjc, which "
                           "is loaded into the world first."),
                  kind, world},
       .returns = {"string", "", "Name of the trajectory it follows now; empty if none.", {}},
       .effect = Effect::edits,
       .sometimes = Effect::files_read,
       .run = set_base});
  all.push_back(
      {.name = "robot.base_trajectory",
       .classic = "PRobot GetBaseTjcId",
       .summary = "Returns the name of the trajectory that the base follows in its world.",
       .details = "",
       .example = moving("assert(arm:base_trajectory() == \"drive\")"),
       .params = {self("robot"), world},
       .returns = {"string", "", "Name of the member.", {}},
       .effect = Effect::reads,
       .run = base_trajectory});
  all.push_back(
      {.name = "robot.base_points",
       .classic = "PRobot GetBaseTjc",
       .summary = "Returns the poses of a robot's mounting frame along the trajectory of its base.",
       .details = "At the trajectory's sample times, in the world frame.",
       .example = moving("local p = arm:base_points()\nassert(math.abs(p[#p][2] - 0.3) < 1e-12)"),
       .params = {self("robot"), world},
       .returns = {"matrix", "", "Columns: time [s], x, y, z [m], roll, pitch, yaw [rad].", {}},
       .effect = Effect::reads,
       .run = base_points});
  all.push_back({.name = "robot.base_point_count",
                 .classic = "PRobot GetBaseNumGen",
                 .summary = "Counts the rows of robot.base_points.",
                 .details = "",
                 .example = moving("assert(arm:base_point_count() == #arm:base_points())"),
                 .params = {self("robot"), world},
                 .returns = {"int", "", "", {}},
                 .effect = Effect::reads,
                 .run = base_point_count});
  return all;
}

}  // namespace robomosp::ioci
