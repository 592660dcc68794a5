// SPDX-License-Identifier: Apache-2.0
#include "ioci/robot/robots.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "evaluation/robot_doubts.h"
#include "kernel/bare_numbers.h"
#include "robotics/build_model.h"
#include "robotics/coordinates.h"
#include "robotics/kinematics.h"
#include "robotics/singularity.h"
#include "spatial/pose.h"
#include "spatial/print.h"

namespace robomosp::ioci {

std::string with_arm(const char* rest) {
  return std::string("local arm = robot.get(\"arm\")\n") + rest;
}

namespace {
constexpr const char* kObjectives[] = {"none", "centre", "manipulability", "limits", "clearance"};
}  // namespace

std::vector<ParamSpec> objective_fields(const std::string& more) {
  return {choice("objective", {std::begin(kObjectives), std::end(kObjectives)},
                 "Use of the remaining freedom: centre (joints near the middle of their limits), "
                 "manipulability, limits (away from near ones), clearance (" +
                     more + ")."),
          above_zero(
              defaulted("influence", "real", "m", 0.2,
                        "With clearance: obstacles beyond this distance do not count, nor do pairs "
                        "of the robot's own bodies that are nearer in every configuration."))};
}

Result<void> check_objective_fields(const CommandContext& ctx, const Map& args) {
  if (objective_of(args) == IkObjective::clearance) return {};
  if (!ctx.given("influence")) return {};
  return error(ErrorCode::invalid_argument,
               "influence belongs to the objective clearance, but the objective is " +
                   text_of(args, "objective"),
               "Give objective = \"clearance\", or leave it out.", "influence");
}

IkObjective objective_of(const Map& args) {
  const std::string word = text_of(args, "objective");
  const auto at = std::find(std::begin(kObjectives), std::end(kObjectives), word);
  return static_cast<IkObjective>(at - std::begin(kObjectives));
}

Result<std::int32_t> read_link(const model::Robot& r, const Value& value, bool base_allowed,
                               std::string_view path) {
  const auto count = static_cast<std::int64_t>(r.links.size());
  std::optional<std::int64_t> number;
  if (value.as_int()) number = *value.as_int();
  if (const double* x = value.as_real(); x && std::floor(*x) == *x && std::fabs(*x) < 1e9)
    number = static_cast<std::int64_t>(*x);
  if (const std::string* s = value.as_string()) {
    if (base_allowed && *s == "base") return -1;
    std::vector<std::string> known;
    for (std::size_t i = 0; i < r.links.size(); ++i) {
      if (r.links[i].name == *s) return static_cast<std::int32_t>(i);
      known.push_back(r.links[i].name);
    }
    number = text::read_int(*s);
    if (!number) return unknown_name("link", *s, known).in(path);
  }
  if (!number)
    return error(ErrorCode::invalid_argument, value.text() + " is not a link",
                 "Give its number, 1 is the first, or its name.", std::string(path));
  if (base_allowed && *number == 0) return -1;
  if (*number < 1 || *number > count)
    return error(ErrorCode::invalid_argument, "there is no link " + std::to_string(*number),
                 "Links are numbered 1 to " + std::to_string(count) + ".", std::string(path));
  return static_cast<std::int32_t>(*number - 1);
}

namespace {

/// Numbers that are joint values as they stand, one a joint; false = they need a closer look.
bool read_plain_q(const Value& value, std::span<const JointModel> joints, std::vector<double>& q) {
  for (const JointModel& j : joints)
    if (j.is_coupled() || coordinate_count(j.type) != 1) return false;
  const NumericArray* array = value.as_array();
  const List* list = value.as_list();
  if (!array && !list) return false;
  if ((array ? array->size() : list->size()) != joints.size()) return false;
  q.resize(joints.size());
  for (std::size_t i = 0; i < q.size(); ++i) {
    if (list && !(*list)[i].is_number()) return false;
    q[i] = array ? (*array)[i] : (*list)[i].number();
    if (!(std::fabs(q[i]) <= kMostOfAJoint)) return false;
  }
  return true;
}

}  // namespace

Result<void> check_size(std::span<const double> values, std::string_view path) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (std::fabs(values[i]) <= kMostOfAJoint) continue;
    const std::string where = std::string(path) + "[" + std::to_string(i + 1) + "]";
    if (!std::isfinite(values[i]))
      return error(ErrorCode::invalid_argument, text::print(values[i]) + " is not a finite number",
                   {}, where);
    return error(ErrorCode::invalid_argument,
                 text::print(values[i]) + " is too large to calculate with",
                 "Give a number up to " + text::print(kMostOfAJoint) + ".", where);
  }
  return {};
}

namespace {

/// Whether an angle that was given to a turning joint is rather one in degrees: more than a turn
/// beyond its limits, or more than two turns where it has none, and, as degrees, within them or a
/// whole number up to a turn.
bool is_likely_degrees(const JointModel& j, double x) {
  constexpr double kTurn = 2 * std::numbers::pi;
  if (j.type != JointType::revolute || !(std::fabs(x) > kTurn)) return false;
  const bool is_bounded = std::isfinite(j.lower) && std::isfinite(j.upper);
  const bool is_far =
      is_bounded ? x > j.upper + kTurn || x < j.lower - kTurn : std::fabs(x) > 2 * kTurn;
  const double turned = x * kDegree;
  // A whole number was typed, even where the joint cannot turn that far.
  return is_far && std::fabs(turned) <= kTurn &&
         (!is_bounded || x == std::round(x) || (turned >= j.lower && turned <= j.upper));
}

}  // namespace

Result<std::vector<double>> read_q(const Value& value, const model::Robot& robot,
                                   std::span<const JointModel> joints, std::string_view path) {
  std::vector<double> q;
  const auto note = [&] {  // of one value a joint
    for (std::size_t i = 0; i < q.size(); ++i)
      if (is_likely_degrees(joints[i], q[i]))
        BareNumbers::unlikely(std::string(path) + "[" + std::to_string(i + 1) + "]", q[i], "rad");
  };
  if (read_plain_q(value, joints, q)) {
    note();
    return q;
  }
  q.clear();
  const std::string where(path);
  const std::vector<std::string_view> units = robotics::coordinate_units(joints);
  if (const NumericArray* a = value.as_array()) {
    q = a->data();
  } else if (const List* list = value.as_list()) {
    q.reserve(list->size());
    for (std::size_t i = 0; i < list->size(); ++i) {
      const Value& v = (*list)[i];
      if (v.is_number()) {
        q.push_back(v.number());
        continue;
      }
      const std::string unit(i < units.size() ? units[i] : "rad");
      RMP_TRY_ASSIGN(const Value read, check_value(field("", "real", unit, ""), v,
                                                   where + "[" + std::to_string(i + 1) + "]"));
      q.push_back(read.number());
    }
  } else if (const std::string* name = value.as_string()) {
    std::vector<std::string> known;
    for (const model::NamedPose& p : robot.poses) {
      if (p.name == *name) return p.q;
      known.push_back(p.name);
    }
    const bool all_turn =
        std::all_of(units.begin(), units.end(), [](std::string_view u) { return u == "rad"; });
    auto read = check_value(field("", "real[]", all_turn ? "rad" : "", ""), value, where);
    if (!read.ok() && text::trim(*name).find_first_of("0123456789") == std::string::npos) {
      Error e = unknown_name("pose", *name, known);
      if (known.empty()) e.hint = "The robot has none; robot.set_pose names one.";
      return std::move(e).in(path);
    }
    if (!read.ok()) return std::move(read).error();
    q = reals(&*read);
  } else if (value.is_number()) {
    q = {value.number()};  // a list of one
  } else if (!value.as_map() || !value.as_map()->empty()) {
    return error(ErrorCode::invalid_argument, value.text() + " is not a list of joint values",
                 "Give " + std::to_string(units.size()) + " numbers or the name of a pose.", where);
  }
  const bool one_each = units.size() == joints.size();
  if (q.size() != units.size())
    return error(ErrorCode::invalid_argument,
                 count_given(q.size(), "joint value") + "; the robot has " +
                     std::to_string(units.size()) + (one_each ? " joint" : " coordinate") +
                     (units.size() == 1 ? "" : "s"),
                 one_each ? "Give one value per joint."
                          : "Give one value per coordinate; robot.coordinates lists them.",
                 where);
  RMP_TRY(check_size(q, where));
  for (std::size_t i = 0; i + 3 < q.size(); i += units[i].empty() ? 4 : 1)
    if (units[i].empty() &&
        !(std::hypot(std::hypot(q[i], q[i + 1]), std::hypot(q[i + 2], q[i + 3])) > 1e-9))
      return error(ErrorCode::invalid_argument, "a quaternion is zero",
                   "Use 1 0 0 0 for no rotation.", where + "[" + std::to_string(i + 1) + "]");
  if (one_each && joints.size() == q.size()) note();
  return q;
}

void note_degrees(const CommandContext& ctx, const RobotModel& m, std::span<const double> q) {
  for (std::size_t i = 0; i < m.joints.size(); ++i) {
    const JointModel& j = m.joints[i];
    if (j.is_coupled()) continue;
    const double x = q[static_cast<std::size_t>(j.q_index)];
    if (!is_likely_degrees(j, x)) continue;
    BareNumbers::withdraw("rad");  // what follows names robot and joint
    const std::string given = text::print_rounded(x, 6);
    const std::string said = "robot " + text::quote(m.name) + ", joint " + std::to_string(i + 1) +
                             " (" + text::quote(j.name) + "): " + given + " is taken as " + given +
                             " rad, which is " + text::print_rounded(x / kDegree, 4) +
                             " deg. Write " + text::quote(given + " deg") + " for degrees.";
    // A loop over many such configurations says it once.
    for (const Message& before : ctx.app.messages.recent(20))
      if (before.code == "degrees" && before.text.starts_with(said.substr(0, said.find("): "))))
        return;
    ctx.app.messages.post(Severity::info, "degrees", said, "ioci");
    return;
  }
}

Result<std::shared_ptr<const RobotModel>> model_of(CommandContext& ctx, const Map& args,
                                                   std::string_view name) {
  const Vec3 gravity = has(args, "gravity") ? vec3(args, "gravity") : Vec3{0, 0, -9.81};
  return ctx.app.derived.robot_model(ctx.snapshot(), typed<model::Robot>(args, name), gravity,
                                     ctx.progress);
}

Result<std::size_t> tip_index(const RobotModel& m, const Map& args) {
  if (!has(args, "tip")) return std::size_t{0};
  std::vector<std::string> known;
  const std::string wanted = text_of(args, "tip");
  for (std::size_t i = 0; i < m.tips.size(); ++i) {
    if (m.tips[i].name == wanted) return i;
    known.push_back(m.tips[i].name);
  }
  return unknown_name("tip", wanted, known).in("robot " + text::quote(m.name));
}

bool has_mass(const RobotModel& m) {
  return std::any_of(m.joints.begin(), m.joints.end(), [](const JointModel& j) {
    const Sym3& i = j.body.inertia;
    return j.body.mass != 0 || i.xx != 0 || i.yy != 0 || i.zz != 0;
  });
}

void report_no_mass(CommandContext& ctx, const RobotModel& m, Severity severity,
                    std::string_view outcome) {
  if (m.joints.empty() || has_mass(m)) return;
  ctx.app.messages.post(severity, "no_mass",
                        "robot " + text::quote(m.name) + " has no masses" + std::string(outcome) +
                            ". Give its links masses or designed parts.",
                        "ioci");
}

Result<std::vector<model::BodyPart>> read_bodies(CommandContext& ctx, const Value& list,
                                                 const std::string& path, const char* name) {
  std::vector<model::BodyPart> out;
  static const Schema schema = [] {
    Schema s{needed("what", "ref:object|solid", "", "An object or solid.")};
    for (ParamSpec& p : placement_fields("the link")) s.push_back(std::move(p));
    return s;
  }();
  const List* items = list.as_list();
  for (std::size_t i = 0; items && i < items->size(); ++i) {
    const std::string where = path + "[" + std::to_string(i + 1) + "]";
    Value given = (*items)[i];
    if (const Map* raw = given.as_map()) {
      RMP_TRY_ASSIGN(given, ctx.expressions.read(schema, *raw, where,
                                                 std::string(name) + "." + std::to_string(i + 1)));
    }
    RMP_TRY_ASSIGN(const Map checked, read_map(ctx, schema, given, where));
    model::BodyPart part;
    part.what = ref(checked, "what");
    RMP_TRY_ASSIGN(part.placement, read_placement_fields(*given.as_map(), where));
    out.push_back(std::move(part));
  }
  return out;
}

Result<Sym3> read_inertia(const Value& v, const std::string& path) {
  const NumericArray* a = v.as_array();
  const List* list = v.as_list();
  if ((a && a->is_matrix()) ||
      (list && !list->empty() && !(*list)[0].is_number() && !(*list)[0].as_string())) {
    RMP_TRY_ASSIGN(const Value m, check_value(field("", "matrix", "kg m^2", ""), v, path));
    const NumericArray& t = *m.as_array();
    if (t.rows() != 3 || t.cols() != 3)
      return error(ErrorCode::invalid_argument,
                   "the inertia matrix is " + std::to_string(t.rows()) + "x" +
                       std::to_string(t.cols()) + ", not 3x3",
                   {}, path);
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < i; ++j)
        if (std::fabs(t.at(i, j) - t.at(j, i)) > 1e-12 * (1 + std::fabs(t.at(i, j))))
          return error(ErrorCode::invalid_argument, "the inertia matrix is not symmetric", {},
                       path);
    return Sym3{t.at(0, 0), t.at(1, 1), t.at(2, 2), t.at(0, 1), t.at(1, 2), t.at(0, 2)};
  }
  RMP_TRY_ASSIGN(const Value checked, check_value(field("", "real[]", "kg m^2", ""), v, path));
  const auto x = reals(&checked);
  if (x.size() != 6)
    return error(ErrorCode::invalid_argument, count_given(x.size(), "number") + " for an inertia",
                 "Give {Ixx, Iyy, Izz, Ixy, Iyz, Ixz} or a 3x3 matrix.", path);
  return Sym3{x[0], x[1], x[2], x[3], x[4], x[5]};
}

std::vector<ParamSpec> mass_fields(const char* of_what, const char* frame) {
  return {
      between(optional("mass", "real", "kg", of_what), 0, std::numeric_limits<double>::infinity()),
      optional("com", "vec3", "m", std::string("Its centre of mass in ") + frame + "."),
      optional("inertia", "any", "kg m^2",
               "Its inertia about the centre of mass: {Ixx, Iyy, Izz, Ixy, Iyz, Ixz} or a 3x3 "
               "matrix, elements of the tensor.")};
}

Result<void> read_mass(const Map& args, std::optional<MassProperties>& out,
                       const std::string& path) {
  if (!has(args, "mass") && !has(args, "com") && !has(args, "inertia")) return {};
  if (!out) out.emplace();
  if (has(args, "mass")) out->mass = real(args, "mass");
  if (has(args, "com")) out->com = vec3(args, "com");
  if (has(args, "inertia")) {
    RMP_TRY_ASSIGN(out->inertia, read_inertia(*args.find("inertia"), path + "inertia"));
  }
  return {};
}

Result<void> check_robot(const std::string& name, const model::Robot& r) {
  auto built = robotics::build_robot_model(name, r, {}, {0, 0, -9.81});
  if (!built.ok()) return std::move(built).error();
  for (const model::NamedPose& p : r.poses)
    if (p.q.size() != built->coordinate_count())
      return error(ErrorCode::conflict,
                   "pose " + text::quote(p.name) + " has " + std::to_string(p.q.size()) +
                       " values for " + robotics::counted_coordinates(r),
                   "Set or remove the pose first.", "robot " + text::quote(name));
  return {};
}

void report_inertia(CommandContext& ctx, const std::string& name, const model::Link& l) {
  if (!l.given || !evaluation::is_impossible(l.given->inertia)) return;
  ctx.app.messages.post(Severity::warning, "inertia",
                        "robot " + text::quote(name) + ", link " + text::quote(l.name) +
                            ": no body has the given inertia, with the principal moments " +
                            evaluation::moments_text(l.given->inertia) +
                            " kg m^2. None can be negative or exceed the sum of the others.",
                        "ioci");
}

Result<void> closed_or_fault(const RobotModel& m, const robotics::Closure& closed) {
  const std::string where = "robot " + text::quote(m.name);
  if (!closed.is_closed)
    return error(ErrorCode::unreachable,
                 "loop " + text::quote(m.loops[closed.worst_loop].name) +
                     " cannot be closed there: it remains open by " +
                     text::print_rounded(closed.residual, 4) + " m or rad",
                 "Move its joints with motors, or start from another configuration.", where);
  if (closed.outside < 0) return {};
  const JointModel& j = m.joints[static_cast<std::size_t>(closed.outside)];
  const double value =
      j.is_coupled()
          ? j.coupling.ratio * closed.q[static_cast<std::size_t>(j.q_index)] + j.coupling.offset
          : closed.q[static_cast<std::size_t>(j.q_index)];
  return error(ErrorCode::unreachable,
               "closing the loops takes joint " + text::quote(j.name) + " to " +
                   spatial::print_joint_value(value, j.type) + ", outside its limits " +
                   spatial::print_joint_value(j.lower, j.type) + " to " +
                   spatial::print_joint_value(j.upper, j.type),
               "Move its joints with motors, or start from another configuration.", where);
}

Result<robotics::TipMotion> closed_tip_motion(const RobotModel& m, std::size_t tip,
                                              std::span<const Pose> joint_frames) {
  constexpr double kOpen = 1e-6;  // [m, rad]
  if (const double open = robotics::open_by(m, joint_frames); open > kOpen)
    return error(
        ErrorCode::invalid_argument,
        "its loops are open by " + text::print_rounded(open, 3) + " m or rad at these joint values",
        "Give values that close them: robot.close.", "robot " + text::quote(m.name));
  return robotics::tip_motion(m, tip, joint_frames);
}

}  // namespace robomosp::ioci
