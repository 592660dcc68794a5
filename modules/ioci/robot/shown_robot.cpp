// SPDX-License-Identifier: Apache-2.0
#include "ioci/robot/shown_robot.h"

#include <string>

#include "robotics/home.h"
#include "robotics/joint_limits.h"
#include "robotics/kinematics.h"
#include "robotics/tip_motion.h"

namespace robomosp::ioci {

ParamSpec shown_world() {
  return optional("world", "ref:world", "", "The world, when several show the robot.");
}

Result<ShownRobot> shown_robot(const CommandContext& ctx, const Map& args) {
  const RobotId id = typed<model::Robot>(args);
  const auto& snapshot = ctx.snapshot();
  std::vector<ShownRobot> found;
  std::vector<std::string> worlds;
  for (const AnyId any : snapshot.list(Kind::world)) {
    if (has(args, "world") && any.number != ref(args, "world").number) continue;
    const auto* w = snapshot.get(WorldId{any.number});
    for (std::size_t i = 0; i < w->robots.size(); ++i)
      if (w->robots[i].robot == id) {
        found.push_back({WorldId{any.number}, i, w->robots[i].q});
        worlds.push_back(snapshot.find(any)->name + ":" + w->robots[i].name);
      }
  }
  const std::string where = name_in(ctx, id);
  if (found.empty())
    return error(ErrorCode::conflict, "no world shows it, so that its joints stand nowhere",
                 "Add it to a world first: world.add_robot.", where);
  if (found.size() > 1)
    return error(ErrorCode::conflict, "it is shown more than once: " + text::enumerate(worlds),
                 "Use world.set_robot_q, which names the one meant.", where);
  ShownRobot s = found.front();
  if (s.q.empty()) s.q = robotics::home_joint_values(content<model::Robot>(ctx, args));
  return s;
}

void note_shown_joints(CommandContext& ctx, RobotId robot, std::span<const double> q) {
  constexpr double kOpen = 1e-6;  // [m or rad]
  const auto m =
      ctx.app.derived.robot_model(ctx.snapshot(), robot, Vec3{0, 0, -9.81}, ctx.progress);
  if (!m.ok() || q.size() != (*m)->coordinate_count()) return;
  const std::string who = "robot " + text::quote((*m)->name);
  const auto excess = robotics::limit_excess(**m, q);
  if (excess.joint >= 0)
    ctx.app.messages.post(Severity::warning, "joint_limits",
                          who + " is shown with " + robotics::excess_words(**m, excess) + ".",
                          "ioci");
  if ((*m)->loops.empty()) return;
  std::vector<Pose> frames((*m)->joints.size());
  robotics::forward_kinematics(**m, q, frames);
  if (const double open = robotics::open_by(**m, frames); open > kOpen)
    ctx.app.messages.post(Severity::warning, "open_loops",
                          who + " is shown with its loops open by " + text::print_rounded(open, 3) +
                              " m or rad. robot.close gives joint values that close them.",
                          "ioci");
}

Result<Value> put_joints(CommandContext& ctx, const ShownRobot& shown, std::vector<double> q) {
  const model::World& world = *ctx.snapshot().get(shown.world);
  note_shown_joints(ctx, world.robots[shown.member].robot, q);
  auto done = change<model::World>(ctx, shown.world, [&](model::World& w) -> Result<void> {
    w.robots[shown.member].q = q;
    return {};
  });
  if (!done.ok()) return std::move(done).error();
  return Value(NumericArray(std::move(q)));
}

Result<std::vector<double>> given_or_shown(const CommandContext& ctx, const Map& args,
                                           const RobotModel& m) {
  if (has(args, "q"))
    return read_q(*args.find("q"), content<model::Robot>(ctx, args), m.joints, "q");
  auto s = shown_robot(ctx, args);
  if (s.ok()) return std::move(s->q);
  Error e = std::move(s).error();
  e.message = "no joint values are given, and " + e.message;
  e.hint = "Give q, or have one world show it.";
  return e;
}

}  // namespace robomosp::ioci
