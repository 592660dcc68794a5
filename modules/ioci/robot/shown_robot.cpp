// SPDX-License-Identifier: Apache-2.0
#include "ioci/robot/shown_robot.h"

#include <algorithm>
#include <numbers>
#include <optional>
#include <string>

#include "ioci/robot/array_units.h"
#include "ioci/robot/robots.h"
#include "robotics/coordinates.h"
#include "robotics/home.h"
#include "robotics/joint_limits.h"
#include "robotics/kinematics.h"
#include "robotics/maker_axes.h"
#include "robotics/tip_motion.h"

namespace robomosp::ioci {
namespace {}  // namespace

ParamSpec shown_world() {
  return optional("world", "ref:world", "", "The world, if several show the robot.");
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
  if (found.empty() && has(args, "world"))
    return error(ErrorCode::conflict,
                 "world " + text::quote(snapshot.find(ref(args, "world"))->name) +
                     " does not contain it, so that it has no joint values there",
                 "Add it to the world first: world.add_robot.", where);
  if (found.empty())
    return error(ErrorCode::conflict, "no world contains it, so it has no present joint values",
                 "Add it to a world first: world.add_robot.", where);
  if (found.size() > 1) {
    const std::string first = snapshot.find(AnyId(found.front().world))->name;
    const auto again = std::find_if(found.begin() + 1, found.end(), [&](const ShownRobot& s) {
      return s.world == found.front().world;
    });
    const std::string& member =
        snapshot.get(found.front().world)->robots[found.front().member].name;
    return error(ErrorCode::conflict, "it is placed more than once: " + text::enumerate(worlds),
                 again == found.end()
                     ? "Name the world: world = " + text::quote(first) + "."
                     : "Name the member, such as world.set_robot_q{id = " + text::quote(first) +
                           ", robot = " + text::quote(member) + ", q = ...}.",
                 where);
  }
  ShownRobot s = found.front();
  if (s.q.empty()) s.q = robotics::home_joint_values(content<model::Robot>(ctx, args));
  return s;
}

void note_shown_joints(CommandContext& ctx, RobotId robot, std::span<const double> q) {
  const auto m =
      ctx.app.derived.robot_model(ctx.snapshot(), robot, Vec3{0, 0, -9.81}, ctx.progress);
  if (m.ok()) note_shown_joints(ctx, robot, **m, q);
}

void note_shown_joints(CommandContext& ctx, RobotId robot, const RobotModel& m,
                       std::span<const double> q) {
  constexpr double kOpen = 1e-6;  // [m or rad]
  if (q.size() != m.coordinate_count()) return;
  note_degrees(ctx, m, q);
  const auto who = [&m] { return "robot " + text::quote(m.name); };
  const auto excess = robotics::limit_excess(m, q);
  if (excess.joint >= 0) {
    const auto axes = robotics::MakerAxes::of(*ctx.snapshot().get(robot));
    const auto entry = m.joints[static_cast<std::size_t>(excess.joint)].q_index;
    ctx.app.messages.post(
        Severity::warning, "joint_limits",
        who() + " is shown with " +
            (axes.ok() ? axes->before_place(static_cast<std::size_t>(entry), q) : std::string()) +
            robotics::excess_words(m, excess) + ".",
        "ioci");
  }
  if (m.loops.empty()) return;
  std::vector<Pose> frames(m.joints.size());
  robotics::forward_kinematics(m, q, frames);
  if (const double open = robotics::open_by(m, frames); open > kOpen)
    ctx.app.messages.post(Severity::warning, "open_loops",
                          who() + " is shown with its loops open by " +
                              text::print_rounded(open, 3) +
                              " m or rad. robot.close gives joint values that close them.",
                          "ioci");
}

Result<std::vector<double>> shown_or_home(const CommandContext& ctx, const Map& args) {
  bool is_shown = has(args, "world");
  for (const AnyId any : ctx.snapshot().list(Kind::world))
    for (const auto& placed : ctx.snapshot().get(WorldId{any.number})->robots)
      is_shown = is_shown || placed.robot == typed<model::Robot>(args);
  if (!is_shown) return robotics::home_joint_values(content<model::Robot>(ctx, args));
  RMP_TRY_ASSIGN(ShownRobot s, shown_robot(ctx, args));
  return std::move(s.q);
}

Result<Value> put_joints(CommandContext& ctx, const Map& args, const ShownRobot& shown,
                         std::vector<double> q) {
  const model::World& world = *ctx.snapshot().get(shown.world);
  note_shown_joints(ctx, world.robots[shown.member].robot, q);
  auto done = change<model::World>(ctx, shown.world, [&](model::World& w) -> Result<void> {
    w.robots[shown.member].q = q;
    return {};
  });
  if (!done.ok()) return std::move(done).error();
  return joints_answer(args, content<model::Robot>(ctx, args), std::move(q));
}

ParamSpec angle_unit() {
  return choice("angles", {"radians", "degrees"},
                "Unit of bare joint angles, in arguments and results; lengths are in metres.");
}

bool in_degrees(const Map& args) {
  return has(args, "angles") && text_of(args, "angles") == "degrees";
}

namespace {

/// The entries of a text such as `30 45deg {0 "1 m"}`; a unit by itself belongs to the number
/// before it.
List entries_of(const std::string& text) {
  std::string plain = text;
  for (char& c : plain)
    if (c == '{' || c == '}' || c == ',' || c == '"' || c == '\t' || c == '\n') c = ' ';
  List out;
  for (const std::string_view word : text::split(plain, ' ')) {
    if (word.empty()) continue;
    const bool is_unit = word.find_first_of("0123456789.") == std::string_view::npos &&
                         !text::read_real(word) && !out.empty();
    if (is_unit) out.back() = Value(*out.back().as_string() + " " + std::string(word));
    else out.emplace_back(std::string(word));
  }
  return out;
}

}  // namespace

Result<std::vector<double>> read_joints(const Map& args, const Value& value,
                                        const model::Robot& robot, const RobotModel& m,
                                        std::string_view path) {
  if (!in_degrees(args)) return read_q(value, robot, m.joints, path);
  List entries;
  if (const std::string* text = value.as_string()) {
    const bool is_pose = std::any_of(robot.poses.begin(), robot.poses.end(),
                                     [&](const auto& p) { return p.name == *text; });
    if (is_pose || text->find_first_of("0123456789") == std::string::npos)
      return read_q(value, robot, m.joints, path);
    entries = entries_of(*text);
  } else if (const NumericArray* a = value.as_array()) {
    for (const double x : a->data()) entries.emplace_back(x);
  } else if (const List* list = value.as_list()) {
    entries = *list;
  } else {
    return read_q(value, robot, m.joints, path);
  }
  const std::vector<std::string_view> units = robotics::coordinate_units(m.joints);
  for (std::size_t i = 0; i < entries.size(); ++i) {
    std::optional<double> bare;
    if (entries[i].is_number()) bare = entries[i].number();
    else if (const std::string* word = entries[i].as_string()) bare = text::read_real(*word);
    if (!bare) continue;
    const bool turns = i < units.size() && units[i] == "rad";
    entries[i] = Value(turns ? *bare * kDegree : *bare);
  }
  return read_q(Value(std::move(entries)), robot, m.joints, path);
}

Value joints_answer(const Map& args, const model::Robot& robot, std::vector<double> q) {
  if (in_degrees(args)) {
    const std::vector<std::string_view> units = robotics::coordinate_units(robot);
    for (std::size_t i = 0; i < q.size() && i < units.size(); ++i)
      if (units[i] == "rad") q[i] /= kDegree;
  }
  return Value(NumericArray(std::move(q), joint_array_unit(robot, in_degrees(args))));
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
