// SPDX-License-Identifier: Apache-2.0
// What a robot does: forward kinematics, Jacobian, and where worlds show it.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "ioci/robot/array_units.h"
#include "ioci/robot/robots.h"
#include "ioci/robot/shown_robot.h"
#include "ioci/robot/states.h"
#include "robotics/batch_kinematics.h"
#include "robotics/closure.h"
#include "robotics/coordinates.h"
#include "robotics/home.h"
#include "robotics/kinematics.h"
#include "robotics/kinematics_kernels.h"
#include "robotics/singularity.h"
#include "spatial/pose.h"

namespace robomosp::ioci {
namespace {

using model::Robot;

struct Posed {
  std::shared_ptr<const RobotModel> model;
  std::vector<double> q;
  std::vector<Pose> frames;  ///< base_T_joint
};

Result<Posed> posed(CommandContext& ctx, const Map& args,
                    std::shared_ptr<const RobotModel> model = {}) {
  Posed p;
  p.model = std::move(model);
  if (!p.model) {
    RMP_TRY_ASSIGN(p.model, model_of(ctx, args));
  }
  RMP_TRY_ASSIGN(p.q, given_or_shown(ctx, args, *p.model));
  note_degrees(ctx, *p.model, p.q);
  p.frames.resize(p.model->joints.size());
  robotics::forward_kinematics(*p.model, p.q, p.frames);
  return p;
}

/// Poses of many states, as those of pose_map(): one block, arrays of rows.
class PoseTable {
 public:
  explicit PoseTable(std::size_t count) : count_(count), room_(room_for(26 * count)) {}
  [[nodiscard]] robotics::kernels::PoseRows at(std::size_t row) const {
    double* all = room_.get();
    return {all + 16 * row, all + 16 * count_ + 3 * row, all + 19 * count_ + 3 * row,
            all + 22 * count_ + 4 * row};
  }
  [[nodiscard]] Map map() const {
    return Map{{"pose", rows_of(room_, count_, 16, "")},
               {"position", rows_of(room_, count_, 3, "m", 16 * count_)},
               {"rpy", rows_of(room_, count_, 3, "rad", 19 * count_)},
               {"quaternion", rows_of(room_, count_, 4, "", 22 * count_)}};
  }

 private:
  std::size_t count_;
  std::shared_ptr<double[]> room_;
};

/// About what forward kinematics takes for a joint of a state, to divide batches.
double nanoseconds_of(const RobotModel& m) { return 10 + 3 * static_cast<double>(m.joints.size()); }

/// The joint values of each state with its loops closed; the first fault is an error.
Result<std::vector<double>> closed_states(CommandContext& ctx, const RobotModel& m,
                                          const States& q) {
  const std::size_t width = m.coordinate_count();
  const auto held = robotics::actuated_velocities(m);
  std::vector<double> out(q.values().size());
  RMP_TRY(for_states(q.count(), kNanosecondsToClose, ctx.progress,
                     [&](std::size_t first, std::size_t last, std::size_t) -> Result<void> {
                       for (std::size_t i = first; i < last; ++i) {
                         const auto open = q.values().subspan(i * width, width);
                         const auto closed = robotics::close_loops(m, open, open, held);
                         RMP_TRY(closed_or_fault(m, closed).in("q[" + std::to_string(i + 1) + "]"));
                         std::copy_n(closed.q.begin(), width, &out[i * width]);
                       }
                       return {};
                     }));
  return out;
}

/// robot.fk of a batch.
Result<Value> fk_rows(CommandContext& ctx, const Map& args, const RobotModel& m, States q) {
  const std::size_t count = q.count(), width = m.coordinate_count(), joints = m.joints.size();
  note_degrees(ctx, m, q.values().first(width));
  RMP_TRY_ASSIGN(const std::size_t tip, tip_index(m, args));
  const bool is_closing = flag(args, "close");
  if (is_closing) {
    RMP_TRY_ASSIGN(auto closed, closed_states(ctx, m, q));
    q.replace(std::move(closed));
  }
  const robotics::BatchKinematics kinematics(m);
  const std::size_t own = kinematics.scratch_size();
  std::vector<double> scratch(spatial::cores() * own);
  const auto scratch_of = [&](std::size_t thread) {
    return std::span(scratch).subspan(thread * own, own);
  };
  const PoseTable tips(count);
  // As many as stay in the nearest cache between the kernels.
  constexpr std::size_t kTogether = 64;
  RMP_TRY(for_states(count, nanoseconds_of(m), ctx.progress,
                     [&](std::size_t first, std::size_t last, std::size_t thread) -> Result<void> {
                       std::array<Pose, kTogether> poses;
                       for (std::size_t i = first; i < last; i += kTogether) {
                         const std::size_t here = std::min(kTogether, last - i);
                         const std::span<Pose> some = std::span(poses).first(here);
                         kinematics.tip_poses(tip, q.values().subspan(i * width, here * width),
                                              some, scratch_of(thread));
                         kinematics.describe(some, m.base, tips.at(i));
                       }
                       return {};
                     }));
  Map out = tips.map();
  if (flag(args, "all")) {
    const Robot& r = content<Robot>(ctx, args);
    const auto links = robotics::link_frames(r);
    const std::vector<PoseTable> tables = [&] {
      std::vector<PoseTable> made;
      for (std::size_t l = 0; l < links.size(); ++l) made.emplace_back(count);
      return made;
    }();
    RMP_TRY(
        for_states(count, nanoseconds_of(m) + 20 * static_cast<double>(links.size()), ctx.progress,
                   [&](std::size_t first, std::size_t last, std::size_t thread) -> Result<void> {
                     std::vector<Pose> frames(kTogether * joints), of_state(links.size()),
                         by_link(links.size() * kTogether);
                     for (std::size_t i = first; i < last; i += kTogether) {
                       const std::size_t here = std::min(kTogether, last - i);
                       const auto some = std::span(frames).first(here * joints);
                       kinematics.joint_frames(q.values().subspan(i * width, here * width), some,
                                               scratch_of(thread));
                       for (std::size_t k = 0; k < here; ++k) {
                         robotics::link_poses(links, some.subspan(k * joints, joints), of_state);
                         for (std::size_t l = 0; l < links.size(); ++l)
                           by_link[l * kTogether + k] = of_state[l];
                       }
                       for (std::size_t l = 0; l < links.size(); ++l)
                         kinematics.describe(std::span(by_link).subspan(l * kTogether, here),
                                             m.base, tables[l].at(i));
                     }
                     return {};
                   }));
    List told;
    for (std::size_t l = 0; l < links.size(); ++l) {
      Map link = tables[l].map();
      link.set("name", r.links[l].name);
      told.emplace_back(std::move(link));
    }
    out.set("links", std::move(told));
  }
  if (is_closing)
    out.set("q", NumericArray(std::vector<double>(q.values().begin(), q.values().end()), count,
                              width, joint_array_unit(m)));
  return Value(std::move(out));
}

Result<Value> fk(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const auto model, model_of(ctx, args));
  if (const Value* given = args.find("q"); given && gives_rows(*given, *model)) {
    RMP_TRY_ASSIGN(States many, read_states(*given, content<Robot>(ctx, args), *model, "q"));
    return fk_rows(ctx, args, *model, std::move(many));
  }
  RMP_TRY_ASSIGN(Posed p, posed(ctx, args, model));
  if (flag(args, "close")) {
    const robotics::Closure closed =
        robotics::close_loops(*p.model, p.q, p.q, robotics::actuated_velocities(*p.model));
    RMP_TRY(closed_or_fault(*p.model, closed));
    p.q = closed.q;
    robotics::forward_kinematics(*p.model, p.q, p.frames);
  }
  RMP_TRY_ASSIGN(const std::size_t tip, tip_index(*p.model, args));
  Map out = pose_map(spatial::compose(p.model->base, robotics::tip_pose(*p.model, tip, p.frames)));
  if (flag(args, "all")) {
    const Robot& r = content<Robot>(ctx, args);
    const auto frames = robotics::link_frames(r);
    std::vector<Pose> poses(frames.size());
    robotics::link_poses(frames, p.frames, poses);
    List links;
    for (std::size_t i = 0; i < poses.size(); ++i) {
      Map link = pose_map(spatial::compose(p.model->base, poses[i]));
      link.set("name", r.links[i].name);
      links.emplace_back(std::move(link));
    }
    out.set("links", std::move(links));
  }
  if (flag(args, "close")) out.set("q", NumericArray(p.q, joint_array_unit(*p.model)));
  return Value(std::move(out));
}

Result<Value> link_pose(CommandContext& ctx, const Map& args) {
  const Robot& r = content<Robot>(ctx, args);
  RMP_TRY_ASSIGN(const auto m, model_of(ctx, args));
  RMP_TRY_ASSIGN(const std::int32_t index, read_link(r, *args.find("link"), false, "link"));
  std::vector<double> q = robotics::neutral_coordinates(*m);
  if (flag(args, "shown") && !has(args, "q")) {
    RMP_TRY_ASSIGN(q, shown_or_home(ctx, args));
  }
  if (has(args, "q")) {
    RMP_TRY_ASSIGN(q, read_q(*args.find("q"), r, m->joints, "q"));
  }
  std::vector<Pose> frames(m->joints.size());
  robotics::forward_kinematics(*m, q, frames);
  const auto all = robotics::link_frames(r);
  std::vector<Pose> poses(all.size());
  robotics::link_poses(all, frames, poses);
  Pose out = poses[static_cast<std::size_t>(index)];
  if (text_of(args, "frame") == "parent") {
    const std::int32_t parent = r.links[static_cast<std::size_t>(index)].parent;
    if (parent >= 0)
      out = spatial::compose(spatial::inverse(poses[static_cast<std::size_t>(parent)]), out);
  } else {
    out = spatial::compose(m->base, out);
  }
  return Value(pose_map(out));
}

/// `mGetLocal` and `mGetGlobal` are the two frames of robot.link_pose.
Result<Value> link_pose_parent(CommandContext& ctx, const Map& args) {
  Map local = args;
  local.set("frame", "parent");
  return link_pose(ctx, local);
}

/// Jacobian joint after joint as the matrix of the textbooks: 6 rows (v, w), one column a joint.
NumericArray jacobian_matrix(const std::vector<double>& columns, std::size_t dof) {
  std::vector<double> rows(6 * dof);
  for (std::size_t j = 0; j < dof; ++j)
    for (std::size_t i = 0; i < 6; ++i) rows[i * dof + j] = columns[6 * j + i];
  return NumericArray(std::move(rows), 6, dof);
}

/// robot.jacobian of a batch.
Result<Value> jacobian_rows(CommandContext& ctx, const RobotModel& m, const States& q,
                            std::size_t tip, robotics::JacobianFrame frame) {
  const std::size_t count = q.count(), width = m.coordinate_count(), size = 6 * m.dof();
  note_degrees(ctx, m, q.values().first(width));
  const robotics::BatchKinematics kinematics(m);
  const std::size_t own = kinematics.scratch_size();
  std::vector<double> scratch(spatial::cores() * own);
  const auto room = room_for(count * size);
  RMP_TRY(for_states(count, nanoseconds_of(m), ctx.progress,
                     [&](std::size_t first, std::size_t last, std::size_t thread) -> Result<void> {
                       const std::size_t here = last - first;
                       kinematics.jacobian_rows(
                           tip, q.values().subspan(first * width, here * width), frame,
                           std::span(room.get() + first * size, here * size),
                           std::span(scratch).subspan(thread * own, own));
                       return {};
                     }));
  return Value(rows_of(room, count, size));
}

Result<Value> jacobian(CommandContext& ctx, const Map& args) {
  const auto frame = text_of(args, "frame") == "tool" ? robotics::JacobianFrame::tip
                                                      : robotics::JacobianFrame::world;
  RMP_TRY_ASSIGN(const auto model, model_of(ctx, args));
  if (const Value* given = args.find("q"); given && gives_rows(*given, *model)) {
    RMP_TRY_ASSIGN(const States many, read_states(*given, content<Robot>(ctx, args), *model, "q"));
    RMP_TRY_ASSIGN(const std::size_t tip, tip_index(*model, args));
    return jacobian_rows(ctx, *model, many, tip, frame);
  }
  RMP_TRY_ASSIGN(const Posed p, posed(ctx, args, model));
  RMP_TRY_ASSIGN(const std::size_t tip, tip_index(*p.model, args));
  std::vector<double> j(6 * p.model->dof());
  robotics::geometric_jacobian(*p.model, tip, p.frames, frame, j);
  return Value(jacobian_matrix(j, p.model->dof()));
}

Result<Value> manipulability(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const Posed p, posed(ctx, args));
  RMP_TRY_ASSIGN(const std::size_t tip, tip_index(*p.model, args));
  RMP_TRY_ASSIGN(const robotics::TipMotion motion, closed_tip_motion(*p.model, tip, p.frames));
  const std::string measure = text_of(args, "measure"), part = text_of(args, "part");
  if (measure == "yoshikawa" && part == "all" && motion.loose.empty())
    return Value(robotics::manipulability(motion.jacobian));
  const robotics::Dexterity d =
      robotics::dexterity(motion.jacobian,
                          part == "translation" ? robotics::TwistPart::translation
                          : part == "rotation"  ? robotics::TwistPart::rotation
                                                : robotics::TwistPart::all,
                          1, motion.self_motion_twists);
  return Value(measure == "condition" ? d.condition : measure == "least" ? d.least : d.yoshikawa);
}

Result<Value> set_joints(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const auto m, model_of(ctx, args));
  RMP_TRY_ASSIGN(const ShownRobot s, shown_robot(ctx, args));
  const Robot& r = content<Robot>(ctx, args);
  RMP_TRY(one_of_joints_and_axes(ctx, args, typed<Robot>(args), r));
  RMP_TRY_ASSIGN(auto q, has(args, "axes") ? read_axis_values(r, *args.find("axes"), s.q, "axes")
                                           : read_joints(args, *args.find("q"), r, *m, "q"));
  return put_joints(ctx, args, s, std::move(q));
}

Result<Value> add_joints(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const auto m, model_of(ctx, args));
  RMP_TRY_ASSIGN(ShownRobot s, shown_robot(ctx, args));
  RMP_TRY_ASSIGN(const auto step,
                 read_joints(args, *args.find("q"), content<Robot>(ctx, args), *m, "q"));
  const auto units = robotics::coordinate_units(*m);
  for (std::size_t i = 0; i < step.size() && i < s.q.size(); ++i) {
    if (units[i].empty())
      return error(ErrorCode::unsupported, "quaternions cannot be added to",
                   "Set the joints with robot.set_joints.", "robot " + text::quote(m->name));
    s.q[i] += step[i];
  }
  return put_joints(ctx, args, s, std::move(s.q));
}

Result<Value> joint_values(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(ShownRobot s, shown_robot(ctx, args));
  return Value(NumericArray(std::move(s.q), joint_array_unit(content<Robot>(ctx, args))));
}

}  // namespace

RMP_COMMANDS(robot_motion_commands) {
  std::vector<CommandSpec> all;
  const ParamSpec q =
      needed("q", "any", "rad or m", "Joint values, one per joint, or the name of a pose.");
  const ParamSpec q_or_shown =
      optional("q", "any", "rad or m",
               "Joint values, one per joint, or the name of a pose; by default those at which the "
               "only world with the robot shows it.");
  const ParamSpec q_rows_or_shown =
      optional("q", "any", "rad or m",
               "Joint values, one per joint, the name of a pose, or a matrix with one row per "
               "state; by default those at which the only world with the robot shows it.");
  const ParamSpec tip =
      optional("tip", "string", "",
               "Name of the tip in a branched robot; by default the tool of the last link.");
  const std::vector<ParamSpec> pose_fields{field("pose", "pose", "", "4x4 homogeneous matrix."),
                                           field("position", "vec3", "m", "Position."),
                                           field("rpy", "vec3", "rad", "Roll, pitch, yaw."),
                                           field("quaternion", "real[]", "", "w, x, y, z.")};
  auto fk_fields = pose_fields;
  fk_fields.push_back(
      field("links", "list", "", "With all = true: the frames and names of all links."));
  fk_fields.push_back(field("q", "real[]", "", "With close = true: the closed configuration."));
  const char* const mounting =
      "In the robot's mounting frame, which is its base frame unless the robot has a base "
      "placement.";

  all.push_back(
      {.name = "robot.fk",
       .classic = "PRobot LLRL FKine|PRobot LLRL mGetOutHMT()",
       .summary = "Computes the pose of the tool for given joint values.",
       .details = std::string(mounting) +
                  " With a matrix of states each field has one row per state: pose 16 numbers, row "
                  "after row (t.pose[i]:reshape(4, 4)), position 3, rpy 3, quaternion 4.",
       .example =
           with_arm("local t = arm:fk{q = {0, 0, 0, 0, 0, 0}}\nassert(math.abs(t.position[1] - "
                    "0.5) < 1e-12)\nassert(#arm:fk{q = \"ready\", all = true}.links == 6)"),
       .params = {self("robot"), q_rows_or_shown,
                  defaulted("all", "bool", "", false, "Also return the frames of all links."), tip,
                  defaulted("close", "bool", "", false,
                            "First closes the loops: joints without motors move to the positions "
                            "given by the joints with motors.")},
       .returns = {"map", "", "", fk_fields},
       .effect = Effect::reads,
       .run = fk});
  const ParamSpec link = needed("link", "any", "", "Number, 1 is the first, or name of the link.");
  const ParamSpec q_optional =
      optional("q", "any", "rad or m", "Joint values or the name of a pose; zeros if omitted.");
  const ParamSpec shown =
      defaulted("shown", "bool", "", false,
                "By default at the joint values at which a world shows the robot, or at home.");
  all.push_back(
      {.name = "robot.link_pose",
       .classic = "PRobot Link mGetGlobal(link, shown=true)",
       .summary = "Returns the frame of one link.",
       .details = std::string(mounting) + " Classic: `PRobot <id> Link <i> mGetGlobal`.",
       .example = with_arm("assert(math.abs(arm:link_pose{link = 1}.position[3] - 0.4) < 1e-12)"),
       .params = {self("robot"), link, q_optional,
                  choice("frame", {"mounting", "parent"},
                         "Relative to the mounting frame or to the link before."),
                  shown},
       .returns = {"map", "", "", pose_fields},
       .effect = Effect::reads,
       .run = link_pose});
  all.push_back({.name = "robot.link_pose_local",
                 .classic = "PRobot Link mGetLocal(link, shown=true)",
                 .summary = "Returns the frame of a link in that of its parent.",
                 .details = "Classic: `PRobot <id> Link <i> mGetLocal`.",
                 .example = with_arm(
                     "assert(math.abs(arm:link_pose_local{link = 2}.position[1] - 0.45) < 1e-12)"),
                 .params = {self("robot"), link, q_optional, shown},
                 .returns = {"map", "", "", pose_fields},
                 .effect = Effect::reads,
                 .run = link_pose_parent});
  all.push_back(
      {.name = "robot.jacobian",
       .classic = "PRobot LLRL mJacobian|PRobot LLRL mJacobian Local(frame=tool, q)|PRobot LLRL "
                  "mJacobian Global(frame=base, q)",
       .summary = "Returns the geometric Jacobian of the tool.",
       .details =
           "Six rows (vx, vy, vz, wx, wy, wz), one column per joint; the reference point is the "
           "tool's origin. Each joint moves independently, also in a robot with closed loops; "
           "robot.dexterity considers the motions that keep loops closed. For a matrix of states "
           "each row of the result is one Jacobian, row after row: j[i]:reshape(6, n).",
       .example =
           with_arm("local j = arm:jacobian{q = \"ready\", frame = \"tool\"}\nassert(#j == 6)"),
       .params = {self("robot"), q_rows_or_shown,
                  choice("frame", {"base", "tool"}, "Axes in which velocities are expressed."),
                  tip},
       .returns = {"matrix", "", "6 x joints; for a batch one row per state.", {}},
       .effect = Effect::reads,
       .run = jacobian});
  all.push_back(
      {.name = "robot.manipulability",
       .classic = "",
       .summary =
           "Computes Yoshikawa's manipulability, a measure of the distance to a singularity.",
       .details = "sqrt(det(J J^T)), for fewer than six joints sqrt(det(J^T J)); 0 when singular.",
       .example = with_arm("assert(arm:manipulability{q = \"ready\"} > 0)"),
       .params = {self("robot"), q,
                  choice("measure", {"yoshikawa", "condition", "least"},
                         "Product of the singular values, the greatest over the least, or the "
                         "least; robot.dexterity returns all of them."),
                  choice("part", {"all", "translation", "rotation"}, "Part of the tool's motion."),
                  tip},
       .returns = {"real", "", "", {}},
       .effect = Effect::reads,
       .run = manipulability});
  const std::string in_world =
      "local cell = world.create{name = \"cell\"}\ncell:add_robot{robot = arm}\n";
  const ParamSpec world = shown_world();
  all.push_back({.name = "robot.joint_values",
                 .classic = "PRobot LLRL mGetInJointp",
                 .summary = "Returns the joint values at which a world shows the robot.",
                 .details = "",
                 .example = with_arm((in_world + "assert(#arm:joint_values() == 6)").c_str()),
                 .params = {self("robot"), world},
                 .returns = {"array", "rad or m", "", {}},
                 .effect = Effect::reads,
                 .run = joint_values});
  all.push_back(
      {.name = "robot.set_joints",
       .classic = "PRobot SetLinks(q, angles=degrees)",
       .summary = "Sets the joint values at which a world shows the robot.",
       .details = "",
       .example = with_arm(
           (in_world + "arm:set_joints(\"ready\")\nassert(arm:joint_values()[5] == 1)").c_str()),
       .params = {self("robot"),
                  optional("q", "any", "rad or m",
                           "Joint values, one per joint, or the name of a pose."),
                  world, angle_unit(), axis_values()},
       .returns =
           {"array", "rad or m", "The joint values now; angles in the unit set by `angles`.", {}},
       .effect = Effect::edits,
       .run = set_joints});
  all.push_back(
      {.name = "robot.add_joints",
       .classic = "PRobot AddLinks(q, angles=degrees)",
       .summary = "Adds to the joint values at which a world shows the robot.",
       .details = "",
       .example = with_arm(
           (in_world + "arm:add_joints({0.1, 0, 0, 0, 0, 0})\nassert(arm:joint_values()[1] == 0.1)")
               .c_str()),
       .params = {self("robot"), q, world, angle_unit()},
       .returns =
           {"array", "rad or m", "The joint values now; angles in the unit set by `angles`.", {}},
       .effect = Effect::edits,
       .run = add_joints});
  return all;
}

}  // namespace robomosp::ioci
