// SPDX-License-Identifier: Apache-2.0
// A robot shown at one sample of a trajectory of its world, and from there at the next.
#include <cmath>
#include <mutex>

#include "ioci/robot/robots.h"
#include "ioci/robot/shown_robot.h"
#include "ioci/world/members.h"
#include "motion/cartesian_path.h"
#include "robotics/home.h"
#include "robotics/kinematics.h"
#include "robotics/maker_axes.h"
#include "sim/base_motion.h"
#include "sim/ik_reason.h"
#include "sim/simulate.h"
#include "spatial/pose.h"
#include "spatial/vec.h"

namespace robomosp::ioci {
namespace {

using model::World;

constexpr double kMostPathSamples = 5e6;
constexpr double kSamePlace = 1e-6;  ///< [m], [rad] of a tool that is at a sample

Result<Value> show_at(CommandContext& ctx, const Map& args) {
  const World& w = content<World>(ctx, args);
  const WorldId world = typed<World>(args);
  const std::string where = name_in(ctx, ref(args, "id"));
  RMP_TRY_ASSIGN(const std::size_t member, find_robot(ctx, world, *args.find("robot"), where));
  RMP_TRY_ASSIGN(const std::size_t at,
                 find_trajectory(ctx, world, *args.find("trajectory"), where));
  const document::Snapshot& now = ctx.snapshot();
  const model::PlacedRobot& placed = w.robots[member];
  const model::PlacedTrajectory& way = w.trajectories[at];
  const model::Trajectory& t = *now.get(way.trajectory);
  const model::Robot& robot = *now.get(placed.robot);
  RMP_TRY_ASSIGN(const auto path,
                 motion::Path::build(ctx.app.registry, way.name, t, motion::stored_in(now)));
  if (path->duration() / t.sample_time > kMostPathSamples)
    return error(ErrorCode::invalid_argument,
                 "a sample time of " + text::print(t.sample_time) + " s makes more than " +
                     text::print(kMostPathSamples) + " samples",
                 "Set a longer sample_time.", "trajectory " + text::quote(way.name));
  const std::vector<double> times = path->sample_times(t.sample_time);
  RMP_TRY_ASSIGN(const auto m,
                 ctx.app.derived.robot_model(now, placed.robot, w.gravity, ctx.progress));

  std::optional<sim::BasePath> base;
  if (!placed.base_trajectory.empty()) {
    for (const model::PlacedTrajectory& drive : w.trajectories) {
      if (drive.name != placed.base_trajectory) continue;
      RMP_TRY_ASSIGN(auto along,
                     motion::Path::build(ctx.app.registry, drive.name, *now.get(drive.trajectory),
                                         motion::stored_in(now)));
      base.emplace(std::move(along), model::pose(drive.placement));
    }
  }
  const auto target = [&](std::size_t i) -> Result<Pose> {
    PathSample s;
    RMP_TRY(path->sample(std::span(&times[i], 1), std::span(&s, 1)));
    Pose mounting = model::pose(placed.placement);
    if (base) {
      RMP_TRY_ASSIGN(mounting, base->world_T_mounting(times[i]));
    }
    return spatial::compose(spatial::inverse(spatial::compose(mounting, m->base)),
                            spatial::compose(model::pose(way.placement), s.pose));
  };

  const std::vector<double> shown =
      placed.q.empty() ? robotics::home_joint_values(robot) : placed.q;
  const std::string to = text_of(args, "to");
  std::size_t sample = to == "last" ? times.size() - 1 : 0;
  const auto key = std::pair(AnyId(world), std::pair(placed.name, way.name));
  if (to == "next" || to == "previous") {
    std::optional<std::size_t> here;
    {
      const std::lock_guard lock(ctx.app.classic.mutex);
      const auto known = ctx.app.classic.points.find(key);
      if (known != ctx.app.classic.points.end() && known->second.q == shown &&
          known->second.sample < times.size())
        here = known->second.sample;
    }
    if (!here && shown.size() == m->coordinate_count()) {
      std::vector<Pose> frames(m->joints.size());
      robotics::forward_kinematics(*m, shown, frames);
      const Pose tool = robotics::tip_pose(*m, 0, frames);
      for (std::size_t i = 0; i < times.size() && !here; ++i) {
        if (ctx.progress.cancelled())
          return error(ErrorCode::cancelled, "it was cancelled", "", where);
        RMP_TRY_ASSIGN(const Pose there, target(i));
        if (spatial::norm(spatial::sub(there.p, tool.p)) < kSamePlace &&
            spatial::norm(spatial::rotation_difference(there.R, tool.R)) < kSamePlace)
          here = i;
      }
    }
    const std::string names =
        "robot " + text::quote(placed.name) + ", trajectory " + text::quote(way.name);
    if (!here)
      return error(ErrorCode::conflict, "the tool is not at a point of the trajectory",
                   "Show it at the first or the last point, and continue from there.",
                   where + ", " + names);
    if (to == "next" ? *here + 1 >= times.size() : *here == 0)
      return error(ErrorCode::invalid_argument,
                   "the robot is at the " + std::string(to == "next" ? "last" : "first") +
                       " of its " + std::to_string(times.size()) + " points",
                   "Move in the other direction.", where + ", " + names);
    sample = to == "next" ? *here + 1 : *here - 1;
  }

  RMP_TRY_ASSIGN(const Pose goal, target(sample));
  RMP_TRY_ASSIGN(const auto bound, ctx.app.solvers.ik(ctx.app.registry, m, robot.ik));
  IkBatch batch;
  batch.targets = {&goal, 1};
  batch.seeds = shown;
  RMP_TRY_ASSIGN(const auto results, sim::solve_ik(bound, batch, ctx.progress));
  const IkResult& found = results.front();
  const std::string why =
      found.status == IkStatus::solved
          ? std::string()
          : sim::ik_reason(ctx.app.registry, bound, robot.ik, found, goal, shown,
                           *robotics::MakerAxes::for_messages(&robot), ctx.progress);
  if (found.status != IkStatus::solved)
    return error(ErrorCode::unreachable,
                 "point " + std::to_string(sample + 1) + " of " + std::to_string(times.size()) +
                     " cannot be reached" + (why.empty() ? "" : ": " + why),
                 "Move the trajectory or the robot, or start from another configuration.",
                 where + ", robot " + text::quote(placed.name));
  std::vector<double> q(found.q.begin(),
                        found.q.begin() + static_cast<std::ptrdiff_t>(m->coordinate_count()));
  auto done = change<World>(ctx, world, [&](World& changed) -> Result<void> {
    changed.robots[member].q = q;
    return {};
  });
  if (!done.ok()) return std::move(done).error();
  {
    const std::lock_guard lock(ctx.app.classic.mutex);
    ctx.app.classic.points[key] = {sample, q};
  }
  return Value(Map{{"point", static_cast<std::int64_t>(sample + 1)},
                   {"points", times.size()},
                   {"time", times[sample]},
                   {"q", joints_answer(args, robot, std::move(q))}});
}

}  // namespace

RMP_COMMANDS(path_point_commands) {
  std::vector<CommandSpec> all;
  all.push_back(
      {.name = "world.show_at",
       .classic = "World InvKineFirstPoint(robot, trajectory, to=first, angles=degrees)|World "
                  "InvKineFinalPoint(robot, trajectory, to=last, angles=degrees)|World "
                  "InvKineNextPoint(robot, trajectory, to=next, angles=degrees)|World "
                  "InvKinePrevPoint(robot, trajectory, to=previous, angles=degrees)",
       .summary = "Shows a robot with its tool at one sample of a trajectory.",
       .details = "The first or last sample, or the one after or before the tool's present one. "
                  "The search starts at the joint values shown. If the sample cannot be reached, "
                  "this is an error and the robot does not move.",
       .example = example_run(
           "local first = cell:show_at{robot = \"arm\", trajectory = \"stroke\", to = \"first\"}\n"
           "local second = cell:show_at{robot = \"arm\", trajectory = \"stroke\", to = \"next\"}\n"
           "assert(first.point == 1 and second.point == 2 and second.time > 0)"),
       .params = {self("world"), placed_robot_field(), placed_trajectory_field(),
                  choice("to", {"first", "last", "next", "previous"}, "The sample to show.", true),
                  angle_unit()},
       .returns = {"map",
                   "",
                   "",
                   {field("point", "int", "", "Its number, 1 is the first."),
                    field("points", "int", "", "Number of samples."),
                    field("time", "real", "s", "Time of the sample."),
                    field("q", "array", "", "Joint values; angles in the unit set by `angles`.")}},
       .effect = Effect::edits,
       .run = show_at});
  return all;
}

}  // namespace robomosp::ioci
