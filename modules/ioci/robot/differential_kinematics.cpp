// SPDX-License-Identifier: Apache-2.0
// How a robot moves: rates of Jacobians, notations of the orientation, velocities and accelerations
// of points, ellipsoids, singular directions; several goals of inverse kinematics at once.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "collision/collision.h"
#include "ioci/robot/array_units.h"
#include "ioci/robot/robots.h"
#include "robotics/analytical.h"
#include "robotics/kinematics.h"
#include "robotics/maker_axes.h"
#include "robotics/singularity.h"
#include "robotics/twist.h"
#include "sim/ik_question.h"
#include "spatial/euler.h"
#include "spatial/pose.h"

namespace robomosp::ioci {
namespace {

using model::Robot;
using robotics::TwistPart;

struct Moved {
  std::shared_ptr<const RobotModel> model;
  std::vector<double> q, qd, qdd;
  std::vector<Pose> frames;                    ///< base_T_joint
  std::vector<robotics::FrameMotion> motions;  ///< of the joint frames, base axes
};

Result<std::vector<double>> rates_of(const Map& args, std::string_view name, const RobotModel& m) {
  const Value* v = args.find(name);
  if (!v || v->is_nil()) return std::vector<double>(m.dof(), 0.0);
  std::vector<double> out = v->is_number() ? std::vector<double>{v->number()} : reals(v);
  if (out.size() != m.dof())
    return error(ErrorCode::invalid_argument,
                 count_given(out.size(), "number") + "; the robot has " + std::to_string(m.dof()) +
                     " velocities",
                 "Give one number per joint, three for a ball joint, six for a free joint.",
                 std::string(name));
  RMP_TRY(check_size(out, name));
  return out;
}

Result<Moved> moved(CommandContext& ctx, const Map& args) {
  Moved m;
  RMP_TRY_ASSIGN(m.model, model_of(ctx, args));
  RMP_TRY_ASSIGN(m.q, read_q(*args.find("q"), content<Robot>(ctx, args), m.model->joints, "q"));
  note_degrees(ctx, *m.model, m.q);
  RMP_TRY_ASSIGN(m.qd, rates_of(args, "qd", *m.model));
  RMP_TRY_ASSIGN(m.qdd, rates_of(args, "qdd", *m.model));
  m.frames.resize(m.model->joints.size());
  m.motions.resize(m.model->joints.size());
  robotics::forward_kinematics(*m.model, m.q, m.frames);
  robotics::joint_motions(*m.model, m.frames, m.qd, m.qdd, m.motions);
  return m;
}

Result<std::size_t> tip_named(const RobotModel& m, const std::string& wanted) {
  std::vector<std::string> known;
  for (std::size_t i = 0; i < m.tips.size(); ++i) {
    if (m.tips[i].name == wanted) return i;
    known.push_back(m.tips[i].name);
  }
  return unknown_name("tip", wanted, known).in("robot " + text::quote(m.name));
}
Result<std::size_t> tip_of(const RobotModel& m, const Map& args) {
  return has(args, "tip") ? tip_named(m, text_of(args, "tip"))
                          : Result<std::size_t>(std::size_t{0});
}

/// Columns joint after joint as the matrix of the textbooks.
NumericArray matrix_value(std::span<const double> columns) {
  const std::size_t dof = columns.size() / 6;
  std::vector<double> rows(columns.size());
  for (std::size_t j = 0; j < dof; ++j)
    for (std::size_t i = 0; i < 6; ++i) rows[i * dof + j] = columns[6 * j + i];
  return NumericArray(std::move(rows), 6, dof);
}

struct TipColumns {
  Pose tip;                    ///< mounting frame
  robotics::FrameMotion move;  ///< of the tip, mounting axes
  std::vector<double> jacobian, rate;
};

/// Jacobian of the tip and its rate in the mounting frame's axes or in the tool's.
TipColumns tip_columns(const Moved& m, std::size_t tip, bool in_tool) {
  const RobotModel& model = *m.model;
  const std::int32_t joint = model.tips[tip].joint;
  const Pose at = robotics::tip_pose(model, tip, m.frames);
  TipColumns c;
  c.jacobian.resize(6 * model.dof());
  c.rate.resize(6 * model.dof());
  robotics::point_jacobian(model, joint, at.p, m.frames, c.jacobian);
  robotics::point_jacobian_rate(model, joint, at.p, m.frames, m.motions, c.rate);
  c.move = robotics::carried_motion(joint, at.p, m.frames, m.motions);
  if (in_tool) {
    // d(R^T J)/dt = R^T (dJ/dt - w x J)
    for (std::size_t k = 0; k < c.rate.size(); k += 3) {
      const Vec3 x =
          spatial::cross(c.move.w, {c.jacobian[k], c.jacobian[k + 1], c.jacobian[k + 2]});
      for (std::size_t i = 0; i < 3; ++i) c.rate[k + i] -= x[i];
    }
  }
  const Pose axes = in_tool ? spatial::inverse(at) : model.base;
  robotics::express_columns(axes, c.jacobian);
  robotics::express_columns(axes, c.rate);
  c.tip = spatial::compose(model.base, at);
  for (Vec3* v : {&c.move.v, &c.move.w, &c.move.a, &c.move.alpha})
    *v = spatial::rotate(model.base, *v);
  return c;
}

Result<Value> jacobian_rate(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const Moved m, moved(ctx, args));
  RMP_TRY_ASSIGN(const std::size_t tip, tip_of(*m.model, args));
  return Value(matrix_value(tip_columns(m, tip, text_of(args, "frame") == "tool").rate));
}

Result<robotics::Representation> read_representation(const Map& args) {
  const std::string name = text_of(args, "representation");
  if (const auto n = robotics::representation(name)) return *n;
  return error(
      ErrorCode::invalid_argument, text::quote(name) + " is not a representation of rotations",
      "Give rpy, quaternion, rotation_vector, or a sequence such as rzyx (turning axes) or "
      "sxyz (fixed axes).",
      "representation");
}

Result<Value> analytical_jacobian(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const Moved m, moved(ctx, args));
  RMP_TRY_ASSIGN(const std::size_t tip, tip_of(*m.model, args));
  RMP_TRY_ASSIGN(const auto n, read_representation(args));
  const TipColumns base = tip_columns(m, tip, false);
  std::vector<double> Bd;
  const auto B = robotics::representation_rates(n, base.tip.R, base.move.w, &Bd);
  if (!B)
    return error(ErrorCode::invalid_argument,
                 "the representation " + text_of(args, "representation") +
                     " is singular here: its middle angle is " +
                     (n.sequence.is_proper() ? "0 or 180 deg" : "90 or -90 deg") +
                     ", so that its rates are not defined",
                 "Choose another sequence, or quaternion.", "robot " + text::quote(m.model->name));
  const std::size_t size = n.size(), dof = m.model->dof();
  std::vector<double> A = robotics::analytical_rows(base.jacobian, *B, size);
  std::vector<double> Ad = robotics::analytical_rows(base.rate, *B, size);
  const std::vector<double> more = robotics::analytical_rows(base.jacobian, Bd, size);
  for (std::size_t k = 3 * dof; k < Ad.size(); ++k) Ad[k] += more[k];
  if (text_of(args, "frame") == "tool") {
    const TipColumns own = tip_columns(m, tip, true);
    for (std::size_t j = 0; j < dof; ++j)
      for (std::size_t i = 0; i < 3; ++i) {
        A[i * dof + j] = own.jacobian[6 * j + i];
        Ad[i * dof + j] = own.rate[6 * j + i];
      }
  }
  return Value(Map{{"jacobian", NumericArray(std::move(A), 3 + size, dof)},
                   {"rate", NumericArray(std::move(Ad), 3 + size, dof)},
                   {"orientation", NumericArray(robotics::orientation_numbers(n, base.tip.R))},
                   {"position", vec_value(base.tip.p, "m")}});
}

/// A point of a link, or the tool.
Result<std::pair<std::int32_t, Vec3>> read_point(CommandContext& ctx, const Map& args,
                                                 const Moved& m) {
  std::int32_t joint = -1;
  Pose carried;
  if (has(args, "link") && has(args, "tip"))
    return error(ErrorCode::invalid_argument,
                 "a point is either on a link or at a tip, but both are given",
                 "Leave one of them out.", "tip");
  if (has(args, "link")) {
    const Robot& r = content<Robot>(ctx, args);
    RMP_TRY_ASSIGN(const std::int32_t link, read_link(r, *args.find("link"), false, "link"));
    const auto frame = robotics::link_frames(r)[static_cast<std::size_t>(link)];
    joint = frame.joint;
    carried = frame.joint_T_link;
  } else {
    RMP_TRY_ASSIGN(const std::size_t tip, tip_of(*m.model, args));
    joint = m.model->tips[tip].joint;
    carried = m.model->tips[tip].tool;
  }
  const Vec3 local = has(args, "point") ? vec3(args, "point") : Vec3{};
  const Pose at =
      joint < 0 ? carried : spatial::compose(m.frames[static_cast<std::size_t>(joint)], carried);
  return std::pair{joint, spatial::transform(at, local)};
}

Result<Value> point_motion(CommandContext& ctx, const Map& args, bool accelerations) {
  RMP_TRY_ASSIGN(const Moved m, moved(ctx, args));
  RMP_TRY_ASSIGN(const auto point, read_point(ctx, args, m));
  const auto& [joint, place] = point;
  const robotics::FrameMotion p = robotics::carried_motion(joint, place, m.frames, m.motions);
  const Pose& base = m.model->base;
  const auto told = [&](const Vec3& v, const char* unit) {
    return vec_value(spatial::rotate(base, v), unit);
  };
  Map out{{"position", vec_value(spatial::transform(base, place), "m")},
          {"velocity", told(p.v, "m/s")},
          {"angular_velocity", told(p.w, "rad/s")}};
  if (accelerations) {
    out.set("acceleration", told(p.a, "m/s^2"));
    out.set("angular_acceleration", told(p.alpha, "rad/s^2"));
  }
  return Value(std::move(out));
}
Result<Value> point_velocity(CommandContext& ctx, const Map& args) {
  return point_motion(ctx, args, false);
}
Result<Value> point_acceleration(CommandContext& ctx, const Map& args) {
  return point_motion(ctx, args, true);
}

TwistPart part_of(const Map& args) {
  const std::string part = text_of(args, "part");
  return part == "translation" ? TwistPart::translation
         : part == "rotation"  ? TwistPart::rotation
                               : TwistPart::all;
}

Result<Value> dexterity(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const Moved m, moved(ctx, args));
  RMP_TRY_ASSIGN(const std::size_t tip, tip_of(*m.model, args));
  RMP_TRY_ASSIGN(robotics::TipMotion motion, closed_tip_motion(*m.model, tip, m.frames));
  robotics::express_columns(m.model->base, motion.jacobian);
  robotics::express_columns(m.model->base, motion.self_motion_twists);
  const TwistPart part = part_of(args);
  const double length = has(args, "length") ? real(args, "length") : 1.0;
  const robotics::Dexterity d =
      robotics::dexterity(motion.jacobian, part, length, motion.self_motion_twists);
  const auto ellipsoid = [&](TwistPart of, const char* speed, const char* force) {
    const robotics::Ellipsoid e =
        robotics::ellipsoid(motion.jacobian, of, motion.self_motion_twists);
    return Value(
        Map{{"axes", NumericArray(std::vector<double>(e.axes.begin(), e.axes.end()), 3, 3)},
            {"velocity", vec_value(e.velocity, speed)},
            {"force", vec_value(e.force, force)}});
  };
  List motors;
  for (const std::size_t v : motion.motors) motors.emplace_back(static_cast<std::int64_t>(v + 1));
  return Value(
      Map{{"yoshikawa", d.yoshikawa},
          {"condition", d.condition},
          {"least", d.least},
          {"singular_values", NumericArray(d.singular_values)},
          {"weakest", NumericArray(std::vector<double>(d.weakest.begin(), d.weakest.end()))},
          {"translation", ellipsoid(TwistPart::translation, "m/s", "N")},
          {"rotation", ellipsoid(TwistPart::rotation, "rad/s", "N m")},
          {"jacobian", matrix_value(motion.jacobian)},
          {"motors", std::move(motors)}});
}

Result<Value> singularity(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const Moved m, moved(ctx, args));
  RMP_TRY_ASSIGN(const std::size_t tip, tip_of(*m.model, args));
  RMP_TRY(closed_tip_motion(*m.model, tip, m.frames));
  const robotics::Singularity s =
      robotics::singularity(*m.model, tip, m.q, part_of(args), real(args, "threshold"));
  List words;
  const auto told = [&](const std::vector<robotics::Twist>& twists, auto&& in_words) {
    std::vector<double> rows;
    for (const robotics::Twist& t : twists) {
      const Vec3 v = spatial::rotate(m.model->base, {t[0], t[1], t[2]});
      const Vec3 w = spatial::rotate(m.model->base, {t[3], t[4], t[5]});
      const robotics::Twist in_mounting{v[0], v[1], v[2], w[0], w[1], w[2]};
      words.emplace_back(in_words(in_mounting));
      rows.insert(rows.end(), in_mounting.begin(), in_mounting.end());
    }
    return rows;
  };
  const auto joined = [](const std::vector<std::vector<double>>& all) {
    std::vector<double> out;
    for (const auto& rates : all) out.insert(out.end(), rates.begin(), rates.end());
    return out;
  };
  const auto table = [](std::vector<double> rows, std::size_t columns) {
    return rows.empty() ? Value(List{}) : Value(NumericArray(rows, rows.size() / columns, columns));
  };
  const Value lost = table(told(s.lost, robotics::lost_words), 6),
              gained = table(told(s.gained, robotics::gained_words), 6);
  if (s.mobility > s.least_mobility)
    words.emplace_back("its loops leave it " + std::to_string(s.mobility) +
                       " independent motions instead of " + std::to_string(s.least_mobility));
  return Value(Map{{"singular", s.is_singular()},
                   {"rank", s.rank},
                   {"full_rank", s.full_rank},
                   {"least", s.least},
                   {"lost", lost},
                   {"words", std::move(words)},
                   {"idle", table(joined(s.idle), m.model->dof())},
                   {"mobility", s.mobility},
                   {"hold", s.hold},
                   {"gained", gained},
                   {"loose", table(joined(s.loose), m.model->dof())}});
}

// --- inverse kinematics of several goals ---------------------------------------------------

struct GoalWord {
  const char* word;
  std::uint32_t parts;
};
constexpr GoalWord kGoalParts[] = {{"pose", kIkPose},
                                   {"position", kIkPosition},
                                   {"rotation", kIkRotation},
                                   {"axis", kIkAxis},
                                   {"position_and_axis", kIkPosition | kIkAxis},
                                   {"x", kIkX},
                                   {"y", kIkY},
                                   {"z", kIkZ},
                                   {"turn_x", kIkRotX},
                                   {"turn_y", kIkRotY},
                                   {"turn_z", kIkRotZ}};

Result<std::uint32_t> read_goal_parts(const Value* given, const std::string& path) {
  if (!given || given->is_nil()) return static_cast<std::uint32_t>(kIkPose);
  std::uint32_t parts = 0;
  std::vector<std::string> known;
  for (const auto& w : kGoalParts) known.emplace_back(w.word);
  List one{*given};
  const List& words = given->as_list() ? *given->as_list() : one;
  for (const Value& v : words) {
    const std::string name = v.as_string() ? *v.as_string() : v.text();
    const auto it = std::find_if(std::begin(kGoalParts), std::end(kGoalParts),
                                 [&](const GoalWord& w) { return name == w.word; });
    if (it == std::end(kGoalParts)) return unknown_name("part", name, known).in(path);
    parts |= it->parts;
  }
  return parts;
}

Schema goal_fields() {
  return {optional("tip", "string", "", "Name of the tip; by default the tool of the last link."),
          needed("target", "pose", "", "Target pose, in the mounting frame."),
          optional("parts", "any", "",
                   "Parts of the pose that count, one word or a list: pose, position, rotation, "
                   "axis (the tip's z axis), position_and_axis, x, y, z, turn_x, turn_y, turn_z "
                   "(axes of the target)."),
          above_zero(defaulted("weight", "real", "", 1.0, "Weight relative to the other goals."))};
}

std::string_view goal_status_word(IkStatus s) {
  switch (s) {
    case IkStatus::solved: return "solved";
    case IkStatus::out_of_reach: return "out_of_reach";
    case IkStatus::joint_limit: return "joint_limit";
    case IkStatus::not_converged: break;
  }
  return "not_converged";
}

Result<Value> solve_goals(CommandContext& ctx, const Map& args) {
  const Robot& r = content<Robot>(ctx, args);
  RMP_TRY_ASSIGN(const auto m, model_of(ctx, args));
  const Pose mounting_T_base = spatial::inverse(m->base);
  std::vector<IkGoal> goals;
  std::vector<Pose> targets;
  for (const Value& v : *args.find("goals")->as_list()) {
    const std::string path = "goals[" + std::to_string(goals.size() + 1) + "]";
    RMP_TRY_ASSIGN(const Map g, read_map(ctx, goal_fields(), v, path));
    IkGoal goal;
    if (has(g, "tip")) {
      RMP_TRY_ASSIGN(const std::size_t tip, tip_named(*m, text_of(g, "tip")).in(path));
      goal.tip = static_cast<std::int32_t>(tip);
    }
    RMP_TRY_ASSIGN(goal.parts, read_goal_parts(g.find("parts"), path + ".parts"));
    goal.weight = real(g, "weight");
    goals.push_back(goal);
    targets.push_back(spatial::compose(mounting_T_base, *pose_from(*g.find("target"))));
  }
  if (goals.empty())
    return error(ErrorCode::invalid_argument, "there are no goals", "Give at least one.", "goals");
  std::vector<double> seed;
  if (has(args, "seed")) {
    RMP_TRY_ASSIGN(seed, read_q(*args.find("seed"), r, m->joints, "seed"));
  }
  model::ProviderChoice choice = r.ik;
  if (has(args, "provider")) {
    RMP_TRY_ASSIGN(choice, read_provider(*args.find("provider"), "provider"));
  } else {
    choice = sim::ik_with_tag(ctx.app.registry, choice, "goals");
  }
  RMP_TRY_ASSIGN(auto bound, ctx.app.solvers.ik(ctx.app.registry, m, choice));
  IkBatch batch;
  batch.targets = targets;
  batch.goals = goals;
  batch.seeds = seed;
  batch.tolerance = {real(args, "position_tolerance"), real(args, "rotation_tolerance")};
  batch.all_solutions = flag(args, "all");
  batch.objective = objective_of(args);
  RMP_TRY(check_objective_fields(ctx, args));
  if (has(args, "world") && batch.objective != IkObjective::clearance)
    return error(ErrorCode::invalid_argument,
                 "a world is given, but obstacles are used with the objective clearance only",
                 "Give objective = \"clearance\", or leave it out.", "world");
  std::shared_ptr<const collision::CollisionModel> collision;
  std::unique_ptr<collision::AskedClearance> field;
  if (batch.objective == IkObjective::clearance) {
    const sim::Simulator simulator{ctx.app.registry, ctx.app.derived, ctx.snapshot()};
    std::size_t member = 0;
    if (has(args, "world")) {
      RMP_TRY_ASSIGN(collision,
                     ctx.app.collision_models.find(simulator, ref(args, "world"), ctx.progress));
      const auto& shown = ctx.snapshot().get(WorldId{ref(args, "world").number})->robots;
      while (member < shown.size() && !(shown[member].robot == typed<Robot>(args))) ++member;
      if (member >= collision->robots().size())
        return error(ErrorCode::conflict, "the world does not contain this robot", "Add it first.",
                     "world");
    } else {
      RMP_TRY_ASSIGN(collision,
                     ctx.app.collision_models.find(simulator, ref(args, "id"), ctx.progress));
    }
    RMP_TRY_ASSIGN(field, collision->field(member, real(args, "influence"), ctx.progress));
    batch.clearance = field.get();
  }
  auto solved = sim::solve_ik(bound, batch, ctx.progress);
  // A robot's closed form answers whole poses only; the program's default takes the rest.
  if (!solved.ok() && solved.error().code == ErrorCode::unsupported && !has(args, "provider")) {
    RMP_TRY_ASSIGN(bound, ctx.app.solvers.ik(ctx.app.registry, m, model::ProviderChoice{}));
    solved = sim::solve_ik(bound, batch, ctx.progress);
  }
  if (field) RMP_TRY(field->outcome());
  RMP_TRY_ASSIGN(auto results, std::move(solved));
  IkResult& result = results.front();
  result.detail =
      robotics::MakerAxes::for_messages(&content<Robot>(ctx, args))->in_text(*m, result.detail);
  if (batch.goals.size() == 1)
    sim::report_singular(*m, static_cast<std::size_t>(batch.goals[0].tip), batch.goals[0].parts,
                         result);
  if (result.status != IkStatus::solved && !flag(args, "partial"))
    return error(
        ErrorCode::unreachable,
        result.detail.empty() ? "no configuration meets the goals" : result.detail,
        "Move the targets, relax them, or give partial = true to get the closest configuration.",
        "robot " + text::quote(m->name));
  const std::size_t n = m->coordinate_count();
  Map out{{"status", goal_status_word(result.status)}};
  if (!result.q.empty()) {
    const std::string unit = joint_array_unit(*m);
    out.set("q",
            NumericArray(std::vector<double>(result.q.begin(),
                                             result.q.begin() + static_cast<std::ptrdiff_t>(n)),
                         unit));
    out.set("solutions", NumericArray(result.q, result.q.size() / n, n, unit));
  }
  out.set("position_error", result.position_error);
  out.set("rotation_error", result.rotation_error);
  out.set("detail", result.detail);
  out.set("shortfall", result.shortfall);
  if (result.limiting_joint >= 0)
    out.set("limiting_joint", m->joints[static_cast<std::size_t>(result.limiting_joint)].name);
  if (result.lost_direction != std::array<double, 6>{}) {
    const auto& t = result.lost_direction;
    const Vec3 v = spatial::rotate(m->base, {t[0], t[1], t[2]});
    const Vec3 w = spatial::rotate(m->base, {t[3], t[4], t[5]});
    out.set("lost_direction", NumericArray({v[0], v[1], v[2], w[0], w[1], w[2]}));
  }
  out.set("iterations", static_cast<std::int64_t>(result.iterations));
  out.set("provider", bound.provider);
  return Value(std::move(out));
}

// --- notations -----------------------------------------------------------------------------

Result<Value> convert_rotation(CommandContext& ctx, const Map& args) {
  spatial::Matrix3 R{};
  int given = 0;
  const auto wrong = [](std::string what, std::string hint, const char* where) {
    return error(ErrorCode::invalid_argument, std::move(what), std::move(hint), where);
  };
  if (has(args, "euler")) {
    ++given;
    static const Schema fields{
        needed("sequence", "string", "",
               "Sequence such as rzyx (moving axes) or sxyz (fixed axes)."),
        needed("angles", "vec3", "rad", "Angles in the order of the sequence.")};
    RMP_TRY_ASSIGN(const Map e, read_map(ctx, fields, *args.find("euler"), "euler"));
    const auto s = spatial::euler_sequence(text_of(e, "sequence"));
    if (!s) {
      std::vector<std::string> known;
      for (const auto& k : spatial::euler_sequences()) known.push_back(k.name());
      return unknown_name("sequence", text_of(e, "sequence"), known).in("euler");
    }
    R = spatial::from_euler(*s, vec3(e, "angles"));
  }
  if (has(args, "rpy")) ++given, R = spatial::from_rpy(vec3(args, "rpy"));
  if (has(args, "rotation_vector"))
    ++given, R = spatial::rotation_exp(vec3(args, "rotation_vector"));
  if (has(args, "quaternion")) {
    ++given;
    const auto q = reals(args, "quaternion");
    if (q.size() != 4)
      return wrong(count_given(q.size(), "number"), "Give {w, x, y, z}.", "quaternion");
    const double n = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (!(n > 1e-12))
      return wrong("the quaternion is zero", "Give one with a length.", "quaternion");
    R = spatial::from_quaternion({q[0] / n, q[1] / n, q[2] / n, q[3] / n});
  }
  if (has(args, "axis_angle")) {
    ++given;
    const auto a = reals(args, "axis_angle");
    if (a.size() != 4)
      return wrong(count_given(a.size(), "number"), "Give {x, y, z, angle}.", "axis_angle");
    if (!(spatial::norm({a[0], a[1], a[2]}) > 1e-12))
      return wrong("the axis is zero", "Give one with a length.", "axis_angle");
    R = spatial::from_axis_angle({a[0], a[1], a[2]}, a[3]);
  }
  if (has(args, "matrix")) {
    ++given;
    const NumericArray& m = *args.find("matrix")->as_array();
    Pose t;
    if (m.rows() == 3 && m.cols() == 3)
      for (std::size_t i = 0; i < 9; ++i) t.R[i] = m[i];
    if (m.rows() != 3 || m.cols() != 3 || !spatial::is_rigid(t, 1e-6))
      return wrong("the matrix is not a rotation",
                   "Give three rows of three numbers, columns perpendicular, of length 1 and "
                   "right-handed.",
                   "matrix");
    R = t.R;
  }
  if (given != 1)
    return error(ErrorCode::invalid_argument, std::to_string(given) + " rotations are given",
                 "Give exactly one of euler, rpy, quaternion, axis_angle, rotation_vector and "
                 "matrix.");
  const spatial::Quaternion q = spatial::to_quaternion(R);
  const Vec3 v = spatial::rotation_log(R);
  const double angle = spatial::norm(v);
  Map euler;
  List singular;
  for (const auto& s : spatial::euler_sequences()) {
    const spatial::EulerAngles a = spatial::to_euler(s, R);
    euler.set(s.name(), vec_value(a.angles, "rad"));
    if (a.is_singular())
      singular.emplace_back(s.name() + ": the middle angle is " +
                            text::print_rounded(a.angles[1] * 180 / std::numbers::pi, 4) +
                            " deg, so that only the sum or the difference of the outer two is "
                            "defined; one of them is set to 0");
  }
  if (angle == 0) singular.emplace_back("axis: there is no turn, so that any axis will do");
  if (angle > std::numbers::pi - 1e-9)
    singular.emplace_back("axis: at half a turn the opposite axis will do as well");
  return Value(Map{{"matrix", NumericArray(std::vector<double>(R.begin(), R.end()), 3, 3)},
                   {"quaternion", NumericArray({q.w, q.x, q.y, q.z})},
                   {"axis", vec_value(angle > 0 ? spatial::unit(v) : Vec3{0, 0, 1})},
                   {"angle", angle},
                   {"rotation_vector", vec_value(v, "rad")},
                   {"rpy", vec_value(spatial::to_rpy(R), "rad")},
                   {"euler", std::move(euler)},
                   {"singular", std::move(singular)}});
}

}  // namespace

RMP_COMMANDS(robot_kinematics_commands) {
  std::vector<CommandSpec> all;
  const ParamSpec q = needed("q", "any", "rad or m", "Joint values, or the name of a pose.");
  const ParamSpec qd = optional("qd", "real[]", "rad/s or m/s", "Joint speeds; zeros if omitted.");
  const ParamSpec qdd =
      optional("qdd", "real[]", "rad/s^2 or m/s^2", "Joint accelerations; zeros if omitted.");
  const ParamSpec tip =
      optional("tip", "string", "",
               "Name of the tip in a branched robot; by default the tool of the last link.");
  const ParamSpec part =
      choice("part", {"all", "translation", "rotation"},
             "The whole motion of the tool, or only its translation or rotation.");
  const auto add = [&](std::string name, std::string summary, std::string details,
                       std::string example, Schema params, ReturnSpec returns,
                       Result<Value> (*run)(CommandContext&, const Map&)) {
    all.push_back({.name = std::move(name),
                   .classic = "",
                   .summary = std::move(summary),
                   .details = std::move(details),
                   .example = std::move(example),
                   .params = std::move(params),
                   .returns = std::move(returns),
                   .effect = Effect::reads,
                   .run = run});
  };
  add("robot.jacobian_rate", "Returns the time derivative of the tool's geometric Jacobian.",
      "Six rows (v, w) as in robot.jacobian, one column per joint speed, so that the tool's "
      "acceleration is J qdd + rate qd.",
      with_arm("local rate = arm:jacobian_rate{q = \"ready\", qd = {0.5, 0, 0.3, 0, 0, "
               "0}}\nassert(#rate == 6 and #rate[1] == 6)"),
      {self("robot"), q, needed("qd", "real[]", "rad/s or m/s", "Joint speeds."),
       choice("frame", {"base", "tool"}, "Axes in which velocities are expressed."), tip},
      {"matrix", "1/s", "6 x joints.", {}}, jacobian_rate);
  add("robot.analytical_jacobian",
      "Returns the Jacobian with the rates of an orientation representation as its lower rows.",
      "Rows: three for the tool's velocity, then the rates of the representation's numbers (of the "
      "tool in the mounting frame). Representations: rpy, quaternion (w, x, y, z), "
      "rotation_vector, the sequences of rotation.convert such as rzyx. At a singularity of a "
      "sequence the command fails.",
      with_arm(
          "local a = arm:analytical_jacobian{q = \"ready\", representation = "
          "\"quaternion\"}\nassert(#a.jacobian == 7)\nlocal e = arm:analytical_jacobian{q = "
          "\"ready\", representation = \"rzyz\", qd = {0.1, 0, 0, 0, 0, 0}}\nassert(#e.rate == 6)"),
      {self("robot"), q, qd,
       defaulted("representation", "string", "", "rpy", "Representation of the orientation."),
       choice("frame", {"base", "tool"}, "Axes of the three velocity rows."), tip},
      {"map",
       "",
       "",
       {field("jacobian", "matrix", "", "6 or 7 rows, one column per joint speed."),
        field("rate", "matrix", "1/s", "Its time derivative at qd."),
        field("orientation", "real[]", "", "The numbers of the representation now [rad]."),
        field("position", "vec3", "m", "Position of the tool.")}},
      analytical_jacobian);
  const ParamSpec link =
      optional("link", "any", "", "Number or name of the link; the tool if omitted.");
  const ParamSpec point =
      between(optional("point", "vec3", "m",
                       "The point in the link's or the tool's frame; its origin if omitted."),
              -kMostOfAJoint, kMostOfAJoint);
  const std::vector<ParamSpec> speeds{
      field("position", "vec3", "m", "Position of the point, in the mounting frame."),
      field("velocity", "vec3", "m/s", "Velocity of the point."),
      field("angular_velocity", "vec3", "rad/s", "Angular velocity of its link.")};
  add("robot.point_velocity", "Returns the velocity of any point of any link.",
      "In the axes of the mounting frame.",
      with_arm(
          "local p = arm:point_velocity{q = \"ready\", qd = {1, 0, 0, 0, 0, 0}, link = 2, point "
          "= {0, 0, 0.1}}\nassert(math.abs(p.angular_velocity[3] - 1) < 1e-12)"),
      {self("robot"), q, needed("qd", "real[]", "rad/s or m/s", "Joint speeds."), link, point, tip},
      {"map", "", "", speeds}, point_velocity);
  auto accelerations = speeds;
  accelerations.push_back(field("acceleration", "vec3", "m/s^2", "Velocity of the point."));
  accelerations.push_back(
      field("angular_acceleration", "vec3", "rad/s^2", "Angular velocity of its link."));
  add("robot.point_acceleration", "Returns the acceleration of any point of any link.",
      "In the axes of the mounting frame, without gravity.",
      with_arm("local p = arm:point_acceleration{q = {0, 0, 0, 0, 0, 0}, qd = {2, 0, 0, 0, 0, 0}}\n"
               "assert(math.abs(p.acceleration[1] + 4 * p.position[1]) < 1e-12)"),
      {self("robot"), q, qd, qdd, link, point, tip}, {"map", "", "", accelerations},
      point_acceleration);
  add("robot.dexterity",
      "Measures the mobility of the tool: manipulability, condition, and the ellipsoids of "
      "velocity and force.",
      "The velocity ellipsoid contains the tool's velocities for joint speeds of unit length, the "
      "force ellipsoid its forces for joint torques of unit length: the same axes, inverse half "
      "lengths. view.render draws them with ellipsoid = \"velocity\" or \"force\". With closed "
      "loops the speeds are those of the motors, and all other joints follow; motions of the tool "
      "that are possible with the motors at rest count as infinitely fast.",
      with_arm("local d = arm:dexterity{q = \"ready\"}\nassert(math.abs(d.yoshikawa - "
               "arm:manipulability{q = \"ready\"}) < 1e-9)\nassert(d.condition > 1 and "
               "math.abs(d.translation.velocity[1] * d.translation.force[1] - 1) < 1e-9)"),
      {self("robot"), q, part,
       between(optional("length", "real", "m",
                        "Linear speeds are divided by this length to make them comparable with "
                        "angular ones; 1 m if omitted."),
               1e-6, 1e6),
       tip},
      {"map",
       "",
       "",
       {field("yoshikawa", "real", "", "Product of the singular values; 0 when singular."),
        field("condition", "real", "", "Greatest over least singular value; 1 is isotropic."),
        field("least", "real", "", "Least singular value."),
        field("singular_values", "real[]", "", "Descending."),
        field("weakest", "real[]", "",
              "Unit twist (v, w) of the least singular value, mounting axes."),
        field("translation", "map", "", "axes (columns), velocity and force: half lengths."),
        field("rotation", "map", "", "The same for angular velocity and moment."),
        field("jacobian", "matrix", "",
              "The analysed Jacobian: twists (v, w) for rates of the motors."),
        field("motors", "list", "", "Indices in qd of its columns.")}},
      dexterity);
  add("robot.singularity",
      "Reports whether a configuration is singular, and which motions the tool cannot make there.",
      "rank is that of the tool's Jacobian here, full_rank the greatest rank it has elsewhere: a "
      "robot of four joints has 4. lost contains one unit twist (v, w) per row, mounting axes, at "
      "the tool: it is perpendicular to all motions the tool can make, with lengths divided by the "
      "reach of the robot. With closed loops only motions that keep them closed count, and a "
      "configuration is also singular if the mechanism can move with its motors at rest (gained, "
      "loose), or if its loops allow more motions than elsewhere.",
      with_arm("local s = arm:singularity{q = {0, -0.9, 0.6, 0.4, 0, 0}}\nassert(s.singular and "
               "#s.words == 1)\nassert(not arm:singularity{q = \"ready\"}.singular)"),
      {self("robot"), q, part,
       between(defaulted("threshold", "real", "", 1e-6,
                         "A direction counts as lost below this share of the greatest rate."),
               1e-12, 0.5),
       tip},
      {"map",
       "",
       "",
       {field("singular", "bool", "", "Whether the configuration is singular."),
        field("rank", "int", "", "Rank of the Jacobian here."),
        field("full_rank", "int", "", "Greatest rank elsewhere."),
        field("least", "real", "", "Least singular value that counts, over the greatest."),
        field("lost", "matrix", "", "Lost twists, one per row; an empty list if there are none."),
        field("words", "list", "",
              "The same as text: cannot move along ..., cannot turn about ...; can move along ... "
              "with the motors at rest."),
        field("idle", "matrix", "", "Joint speeds that do not move the tool, one per row."),
        field("mobility", "int", "", "Independent motions that keep the loops closed."),
        field("hold", "real", "",
              "Least speed of the motors for joint speeds of length 1: 0 = the motors do not hold "
              "the mechanism."),
        field("gained", "matrix", "",
              "Unit twists of the tool with the motors at rest, zeros if it stays, one per row."),
        field("loose", "matrix", "", "Joint speeds for them, one per row.")}},
      singularity);
  const auto objective_params =
      objective_fields("away from obstacles: of the world, or the robot's own links");
  add("robot.solve_goals",
      "Finds joint values that meet several goals at once, or goals that leave freedom.",
      "Each goal brings a tip to a target, completely or in part; the remaining freedom serves the "
      "objective. Closed loops stay closed. If there is no solution the error gives the reason: "
      "distance beyond reach, the joint at its limit, or the lost direction; partial = true "
      "returns the closest configuration.",
      with_arm(
          "local at = arm:fk{q = \"ready\"}.pose\nlocal s = arm:solve_goals{goals = {{target = "
          "at, parts = \"position\"}}, objective = \"centre\"}\nassert(s.status == \"solved\" and "
          "s.position_error < 1e-8)\nlocal far = arm:solve_goals{goals = {{target = {3, 0, 0, 0, "
          "0, 0}, parts = \"position\"}}, partial = true}\nassert(far.status == \"out_of_reach\" "
          "and far.shortfall > 1)"),
      {self("robot"), needed("goals", "list", "", "Tables {target =, tip =, parts =, weight =}."),
       optional("seed", "any", "rad or m", "Joint values to start from, or the name of a pose."),
       objective_params[0],
       optional("world", "ref:world", "", "With clearance: world with the obstacles."),
       objective_params[1],
       defaulted("all", "bool", "", false,
                 "Return every solution that the solver can distinguish."),
       defaulted("partial", "bool", "", false, "Return the closest configuration if not solved."),
       above_zero(defaulted("position_tolerance", "real", "m", 1e-9,
                            "Tolerance for reaching a position.")),
       above_zero(defaulted("rotation_tolerance", "real", "rad", 1e-9,
                            "Tolerance for reaching a rotation.")),
       optional("provider", "any", "",
                "Name of the solver, or {name = ..., params = {...}}; by default the robot's own "
                "if it supports goals, otherwise numeric.")},
      {"map",
       "",
       "",
       {field("status", "string", "", "solved, out_of_reach, joint_limit or not_converged."),
        field("q", "real[]", "rad or m", "The (first) solution, or the closest configuration."),
        field("solutions", "matrix", "", "One row per solution."),
        field("position_error", "real", "m", "Greatest error over the goals."),
        field("rotation_error", "real", "rad", "Greatest error over the goals."),
        field("detail", "string", "",
              "Reason if not solved, or a remark that q is close to a singular configuration (one "
              "goal)."),
        field("shortfall", "real", "m", "Distance out of reach; 0 = not known."),
        field("limiting_joint", "string", "", "The joint that prevents the solution by its limit."),
        field("lost_direction", "real[]", "", "Unit twist (v, w) that is lost, mounting axes."),
        field("iterations", "int", "", "Iterations of the solver."),
        field("provider", "string", "", "The solver.")}},
      solve_goals);
  add("rotation.convert",
      "Shows a rotation as matrix, quaternion, axis and angle, roll-pitch-yaw and all 24 angle "
      "sequences, and names the singular ones.",
      "A sequence's name begins with s for fixed (static) or r for moving (rotating) axes: sxyz "
      "rotates about the fixed x, then y, then z, and is roll-pitch-yaw; rzyx about z, then the "
      "new y, then the new x. Three letters alone mean moving axes.",
      "local c = rotation.convert{euler = {sequence = \"rzyz\", angles = {0.1, 0.2, "
      "0.3}}}\nassert(math.abs(c.euler.rzyz[2] - 0.2) < 1e-12)\nassert(#rotation.convert{rpy = {0, "
      "\"90 deg\", 0}}.singular > 0)",
      {optional("euler", "map", "", "{sequence = \"rzyx\", angles = {a, b, c}}."),
       optional("rpy", "vec3", "rad", "Roll, pitch, yaw."),
       optional("quaternion", "real[]", "", "w, x, y, z of any length except zero."),
       optional("axis_angle", "real[]", "", "Axis x, y, z and angle [rad]."),
       optional("rotation_vector", "vec3", "rad", "Axis times angle."),
       optional("matrix", "matrix", "", "3x3 rotation matrix.")},
      {"map",
       "",
       "",
       {field("matrix", "matrix", "", "3x3."),
        field("quaternion", "real[]", "", "w, x, y, z, w >= 0."),
        field("axis", "vec3", "", "Unit axis."), field("angle", "real", "rad", "0 to pi."),
        field("rotation_vector", "vec3", "rad", "Axis times angle."),
        field("rpy", "vec3", "rad", "Roll, pitch, yaw."),
        field("euler", "map", "", "Three angles by the name of each of the 24 sequences [rad]."),
        field("singular", "list", "",
              "Sentences about values that the rotation does not define.")}},
      convert_rotation);
  return all;
}

}  // namespace robomosp::ioci
