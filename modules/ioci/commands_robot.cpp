// SPDX-License-Identifier: Apache-2.0
// What a robot is: links, rows, limits, drives, masses, tool, named poses.
#include <algorithm>
#include <cmath>
#include <limits>

#include "ioci/commands.h"
#include "robotics/build_model.h"
#include "robotics/kinematics.h"
#include "robotics/skin.h"
#include "spatial/mass.h"
#include "spatial/pose.h"
#include "spatial/principal.h"

namespace robomosp::ioci {

std::string with_arm(const char* rest) {
  // The wrist-partitioned arm of Craig, Introduction to Robotics, 3.7, in round numbers.
  return std::string(
             "local arm = robot.create{name = \"arm\", convention = \"dh\", links = {\n"
             "  {d = 0.4, alpha = \"-90 deg\", lower = -3, upper = 3, mass = 5, com = {0, 0.1, 0}, "
             "inertia = {0.02, 0.01, 0.02, 0, 0, 0}},\n"
             "  {a = 0.45, lower = -3, upper = 3, mass = 4, com = {-0.2, 0, 0}, inertia = {0.01, "
             "0.05, 0.05, 0, 0, 0}},\n"
             "  {a = 0.05, alpha = \"-90 deg\", lower = -3, upper = 3, mass = 3, com = {0, 0, "
             "0.05}, inertia = {0.01, 0.01, 0.005, 0, 0, 0}},\n"
             "  {d = 0.42, alpha = \"90 deg\", lower = -3, upper = 3, mass = 1, com = {0, -0.1, "
             "0}, inertia = {0.003, 0.001, 0.003, 0, 0, 0}},\n"
             "  {alpha = \"-90 deg\", lower = -2, upper = 2, mass = 0.5, inertia = {0.001, 0.001, "
             "0.001, 0, 0, 0}},\n"
             "  {d = 0.08, lower = -3, upper = 3, mass = 0.2, com = {0, 0, -0.02}, inertia = "
             "{1e-4, 1e-4, 1e-4, 0, 0, 0}}},\n"
             "  poses = {ready = {0, -0.9, 0.6, 0, 1, 0}}}\n") +
         rest;
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

Result<std::vector<double>> read_q(const Value& value, const model::Robot& robot,
                                   std::span<const JointModel> joints, std::string_view path) {
  std::vector<double> q;
  const std::string where(path);
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
      const bool slides = i < joints.size() && joints[i].type == JointType::prismatic;
      RMP_TRY_ASSIGN(const Value read, check_value(field("", "real", slides ? "m" : "rad", ""), v,
                                                   where + "[" + std::to_string(i + 1) + "]"));
      q.push_back(read.number());
    }
  } else if (const std::string* name = value.as_string()) {
    std::vector<std::string> known;
    for (const model::NamedPose& p : robot.poses) {
      if (p.name == *name) return p.q;
      known.push_back(p.name);
    }
    const bool all_turn = std::all_of(joints.begin(), joints.end(), [](const JointModel& j) {
      return j.type == JointType::revolute;
    });
    auto read = check_value(field("", "real[]", all_turn ? "rad" : "", ""), value, where);
    if (!read.ok() && text::trim(*name).find_first_of("0123456789") == std::string::npos)
      return unknown_name("pose", *name, known).in(path);
    if (!read.ok()) return std::move(read).error();
    q = reals(&*read);
  } else if (!value.as_map() || !value.as_map()->empty()) {
    return error(ErrorCode::invalid_argument, value.text() + " is not a list of joint values",
                 "Give " + std::to_string(joints.size()) + " numbers or the name of a pose.",
                 where);
  }
  if (q.size() != joints.size())
    return error(ErrorCode::invalid_argument,
                 count_given(q.size(), "joint value") + "; the robot has " +
                     std::to_string(joints.size()) + (joints.size() == 1 ? " joint" : " joints"),
                 "Give one value a joint.", where);
  for (std::size_t i = 0; i < q.size(); ++i)
    if (!std::isfinite(q[i]))
      return error(ErrorCode::invalid_argument, text::print(q[i]) + " is not a finite number", {},
                   where + "[" + std::to_string(i + 1) + "]");
  return q;
}

Result<std::shared_ptr<const RobotModel>> model_of(CommandContext& ctx, const Map& args,
                                                   std::string_view name) {
  const Vec3 gravity = has(args, "gravity") ? vec3(args, "gravity") : Vec3{0, 0, -9.81};
  return ctx.app.derived.robot_model(ctx.snapshot(), typed<model::Robot>(args, name), gravity,
                                     ctx.progress);
}

void tell_no_mass(CommandContext& ctx, const RobotModel& m, Severity severity,
                  std::string_view outcome) {
  const auto weighs = [](const JointModel& j) {
    const Sym3& i = j.body.inertia;
    return j.body.mass != 0 || i.xx != 0 || i.yy != 0 || i.zz != 0;
  };
  if (m.joints.empty() || std::any_of(m.joints.begin(), m.joints.end(), weighs)) return;
  ctx.app.messages.post(severity, "no_mass",
                        "robot " + text::quote(m.name) + " has no masses" + std::string(outcome) +
                            ". Give its links masses or designed parts.",
                        "ioci");
}

namespace {

using model::JointKind;
using model::Link;
using model::Robot;

ParamSpec unbounded(ParamSpec p) {
  p.infinite = true;
  return p;
}

Schema link_schema(JointKind kind, bool creating) {
  const char* unit = kind == JointKind::prismatic ? "m" : "rad";
  const std::string rate = std::string(unit) + "/s", rate2 = rate + "^2",
                    force = kind == JointKind::prismatic ? "N" : "N m";
  Schema s{optional("name", "string", "", "Name of the link, unique in the robot."),
           optional("parent", "any", "", "Number or name of the link it stands on, \"base\" for the base; the link before when left out."),
           creating ? choice("joint", {"revolute", "prismatic", "fixed"}, "How it moves.") : [] {
             ParamSpec p = choice("joint", {"revolute", "prismatic", "fixed"}, "How it moves.", true);
             p.required = false;
             return p;
           }(),
           optional("a", "real", "m", "Link length."),
           optional("alpha", "real", "rad", "Link twist."),
           optional("d", "real", "m", "Link offset; what a prismatic joint adds to."),
           optional("theta", "real", "rad", "Joint angle; what a revolute joint adds to."),
           unbounded(optional("lower", "real", unit, "Least joint value.")),
           unbounded(optional("upper", "real", unit, "Greatest joint value.")),
           unbounded(above_zero(optional("max_velocity", "real", rate, "Greatest joint speed."))),
           unbounded(above_zero(optional("max_acceleration", "real", rate2, "Greatest joint acceleration."))),
           unbounded(above_zero(optional("max_force", "real", force, "Greatest torque or force of the joint."))),
           between(optional("motor_inertia", "real", "kg m^2", "Jm, at the motor."), 0, std::numeric_limits<double>::infinity()),
           optional("gear_ratio", "real", "", "G, may be negative."),
           between(optional("viscous", "real", "N m s/rad", "B, viscous friction at the motor."), 0, std::numeric_limits<double>::infinity()),
           between(optional("coulomb_positive", "real", "N m", "Tc+, Coulomb friction for positive speed at the motor."), 0, std::numeric_limits<double>::infinity()),
           between(optional("coulomb_negative", "real", "N m", "Tc-, Coulomb friction for negative speed at the motor."), -std::numeric_limits<double>::infinity(), 0),
           between(optional("mass", "real", "kg", "Published mass."), 0, std::numeric_limits<double>::infinity()),
           optional("com", "vec3", "m", "Published centre of mass in the link's frame."),
           optional("inertia", "any", "kg m^2", "Published inertia about the centre of mass: {Ixx, Iyy, Izz, Ixy, Iyz, Ixz} or a 3x3 matrix, elements of the tensor."),
           optional("parts", "list", "", "Designed bodies: {what = solid or object, placement or position with angles}."),
           optional("visible", "bool", "", "Whether it is drawn.")};
  return s;
}

/// `name` is what paths call the list: "parts" or "base_parts".
Result<std::vector<model::BodyPart>> read_bodies(CommandContext& ctx, const Value& list,
                                                 const std::string& path, const char* name) {
  std::vector<model::BodyPart> out;
  Schema schema{needed("what", "ref:object|solid", "", "An object or solid.")};
  for (ParamSpec& p : placement_fields("the link")) schema.push_back(std::move(p));
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

/// Applies checked link fields; `index` is the link's own, `robot` holds those before it.
Result<void> apply_link(CommandContext& ctx, const Map& args, const Robot& robot,
                        std::int32_t index, Link& l, const std::string& path) {
  if (has(args, "name")) l.name = text_of(args, "name");
  if (has(args, "parent")) {
    RMP_TRY_ASSIGN(l.parent, read_link(robot, *args.find("parent"), true, path + ".parent"));
    if (l.parent >= index)
      return error(ErrorCode::conflict, "a link stands on a link before it",
                   "Order the links so that parents come first.", path + ".parent");
  }
  if (has(args, "joint")) {
    const std::string joint = text_of(args, "joint");
    l.joint = joint == "prismatic" ? JointKind::prismatic
              : joint == "fixed"   ? JointKind::fixed
                                   : JointKind::revolute;
  }
  const std::pair<const char*, double*> numbers[] = {
      {"a", &l.row.a},
      {"alpha", &l.row.alpha},
      {"d", &l.row.d},
      {"theta", &l.row.theta},
      {"lower", &l.lower},
      {"upper", &l.upper},
      {"max_velocity", &l.max_velocity},
      {"max_acceleration", &l.max_acceleration},
      {"max_force", &l.max_force},
      {"motor_inertia", &l.drive.motor_inertia},
      {"gear_ratio", &l.drive.gear_ratio},
      {"viscous", &l.drive.viscous},
      {"coulomb_positive", &l.drive.coulomb_positive},
      {"coulomb_negative", &l.drive.coulomb_negative}};
  for (const auto& [name, target] : numbers)
    if (has(args, name)) *target = real(args, name);
  if (l.lower > l.upper)
    return error(ErrorCode::invalid_argument,
                 "the lower limit " + text::print(l.lower) + " is above the upper limit " +
                     text::print(l.upper),
                 "Swap them.", path);
  if (has(args, "mass") || has(args, "com") || has(args, "inertia")) {
    if (!l.given) l.given.emplace();
    if (has(args, "mass")) l.given->mass = real(args, "mass");
    if (has(args, "com")) l.given->com = vec3(args, "com");
    if (has(args, "inertia")) {
      RMP_TRY_ASSIGN(l.given->inertia, read_inertia(*args.find("inertia"), path + ".inertia"));
    }
  }
  if (has(args, "parts")) {
    RMP_TRY_ASSIGN(l.parts, read_bodies(ctx, *args.find("parts"), path + ".parts", "parts"));
  }
  if (has(args, "visible")) l.visible = flag(args, "visible");
  return {};
}

JointKind kind_given(const Value* joint, JointKind otherwise) {
  const std::string* s = joint ? joint->as_string() : nullptr;
  if (!s) return otherwise;
  return *s == "prismatic" ? JointKind::prismatic
         : *s == "fixed"   ? JointKind::fixed
                           : JointKind::revolute;
}

Result<void> append_link(CommandContext& ctx, Robot& r, Value given, const std::string& path) {
  const Map* raw = given.as_map();
  const JointKind kind = kind_given(raw ? raw->find("joint") : nullptr, JointKind::revolute);
  if (raw) {
    RMP_TRY_ASSIGN(given, ctx.expressions.read(link_schema(kind, true), Map(*raw), path));
  }
  RMP_TRY_ASSIGN(const Map checked, read_map(ctx, link_schema(kind, true), given, path));
  Link l;
  const auto index = static_cast<std::int32_t>(r.links.size());
  l.parent = index - 1;
  l.name = "link" + std::to_string(index + 1);
  RMP_TRY(apply_link(ctx, checked, r, index, l, path));
  for (const Link& other : r.links)
    if (other.name == l.name)
      return error(ErrorCode::conflict, "there are two links named " + text::quote(l.name),
                   "Names are unique within a robot.", path);
  ctx.expressions.keep(r.parametric, l.name);
  r.links.push_back(std::move(l));
  return {};
}

/// The mechanism must be one that solvers accept: faults show at the command that makes them.
Result<void> check_robot(const std::string& name, const Robot& r) {
  auto built = robotics::build_robot_model(name, r, {}, {0, 0, -9.81});
  if (!built.ok()) return std::move(built).error();
  for (const model::NamedPose& p : r.poses)
    if (p.q.size() != built->dof())
      return error(ErrorCode::conflict,
                   "pose " + text::quote(p.name) + " has " + std::to_string(p.q.size()) +
                       " values for " + std::to_string(built->dof()) + " joints",
                   "Set or remove the pose first.", "robot " + text::quote(name));
  return {};
}

/// Tells of given inertias that no body can have. They are kept: published data may be partial,
/// such as the only element of PUMA's first link that its torques depend on.
void tell_inertia(CommandContext& ctx, const std::string& name, const Link& l) {
  if (!l.given) return;
  const Vec3 m = spatial::principal(l.given->inertia).moments;  // ascending
  const double slack = 1e-6 * std::max(std::fabs(m[0]), std::fabs(m[2]));
  if (m[0] >= -slack && m[2] <= m[0] + m[1] + slack) return;
  const auto shown = [](double x) { return text::print_rounded(x, 4); };
  ctx.app.messages.post(Severity::warning, "inertia",
                        "robot " + text::quote(name) + ", link " + text::quote(l.name) +
                            ": no body has the given inertia, with the principal moments " +
                            shown(m[0]) + ", " + shown(m[1]) + " and " + shown(m[2]) +
                            " kg m^2. None can be negative or exceed the sum of the others.",
                        "ioci");
}

Schema robot_fields() {
  Schema s{
      choice("convention", {"dh", "mdh"}, "Standard or modified (Craig) Denavit-Hartenberg rows."),
      choice("mass_source", {"given", "designed"},
             "Masses from the links' published values, or from their designed parts."),
      optional("base", "pose", "", "Where the base stands in the frame the robot is mounted in."),
      optional("base_parts", "list", "",
               "Designed bodies of the base: {what = solid or object, placement or position with "
               "angles}."),
      optional("tool", "pose", "", "The tool in the frame of the last link."),
      optional("ik", "any", "",
               "Inverse kinematics provider: name, or {name = ..., params = {...}}."),
      optional("inverse_dynamics", "any", "", "Inverse dynamics provider."),
      optional("forward_dynamics", "any", "", "Forward dynamics provider."),
      optional("skin_colour", "any", "", "Colour of the generated body, \"#rrggbb\"."),
      optional("skin_accent", "any", "", "Colour of its joints."),
      optional("description", "string", "", "What it is."),
      optional("source", "string", "", "Where the parameters come from.")};
  return s;
}

Result<void> apply_fields(CommandContext& ctx, const Map& args, Robot& r) {
  if (has(args, "convention"))
    r.convention =
        text_of(args, "convention") == "mdh" ? model::Convention::mdh : model::Convention::dh;
  if (has(args, "mass_source"))
    r.mass_source = text_of(args, "mass_source") == "designed" ? model::MassSource::designed
                                                               : model::MassSource::given;
  if (has(args, "base")) {
    RMP_TRY_ASSIGN(r.base, read_placement(ctx.given("base"), "base"));
  }
  if (has(args, "tool")) {
    RMP_TRY_ASSIGN(r.tool, read_placement(ctx.given("tool"), "tool"));
  }
  if (has(args, "base_parts")) {
    RMP_TRY_ASSIGN(r.base_parts,
                   read_bodies(ctx, *args.find("base_parts"), "base_parts", "base_parts"));
  }
  const std::pair<const char*, model::ProviderChoice*> providers[] = {
      {"ik", &r.ik},
      {"inverse_dynamics", &r.inverse_dynamics},
      {"forward_dynamics", &r.forward_dynamics}};
  for (const auto& [name, target] : providers)
    if (has(args, name)) {
      RMP_TRY_ASSIGN(*target, read_provider(*args.find(name), name));
    }
  if (has(args, "skin_colour")) {
    RMP_TRY_ASSIGN(r.skin_colour, read_colour(*args.find("skin_colour"), "skin_colour"));
  }
  if (has(args, "skin_accent")) {
    RMP_TRY_ASSIGN(r.skin_accent, read_colour(*args.find("skin_accent"), "skin_accent"));
  }
  if (has(args, "description")) r.description = text_of(args, "description");
  if (has(args, "source")) r.source = text_of(args, "source");
  ctx.expressions.keep(r.parametric);
  return {};
}

Result<Value> create(CommandContext& ctx, const Map& args) {
  Robot r;
  const std::string name = text_of(args, "name");
  r.parametric = ctx.expressions.own();
  RMP_TRY(apply_fields(ctx, args, r));
  const List& links = *args.find("links")->as_list();
  for (std::size_t i = 0; i < links.size(); ++i)
    RMP_TRY(append_link(ctx, r, links[i], "links[" + std::to_string(i + 1) + "]"));
  RMP_TRY_ASSIGN(const RobotModel built, robotics::build_robot_model(name, r, {}, {0, 0, -9.81}));
  if (const Value* poses = args.find("poses"); poses && poses->as_map())
    for (const auto& [pose, q] : *poses->as_map()) {
      RMP_TRY_ASSIGN(auto values, read_q(q, r, built.joints, "poses." + pose));
      r.poses.push_back({pose, std::move(values)});
    }
  for (const Link& l : r.links) tell_inertia(ctx, name, l);
  RMP_TRY_ASSIGN(const auto id, ctx.edit().add(name, std::move(r)));
  return Value(Application::handle(id));
}

std::string name_in_document(const CommandContext& ctx, const Map& args) {
  return ctx.snapshot().find(ref(args, "id"))->name;
}

/// Changes a robot and refuses what no solver could accept.
template <class Fn>
Result<Value> change_robot(CommandContext& ctx, const Map& args, Fn&& fn) {
  const AnyId id = ref(args, "id");
  const std::string name = ctx.snapshot().find(id)->name;
  auto done = change<Robot>(ctx, id, [&](Robot& r) -> Result<void> {
    auto changed = fn(r);
    if (!changed.ok()) return std::move(changed).error().in("robot " + text::quote(name));
    return check_robot(name, r);
  });
  if (!done.ok()) return std::move(done).error();
  return Value();
}

Result<Value> set(CommandContext& ctx, const Map& args) {
  return change_robot(ctx, args, [&](Robot& r) { return apply_fields(ctx, args, r); });
}

Result<Value> set_link(CommandContext& ctx, const Map& args) {
  const Robot& before = content<Robot>(ctx, args);
  RMP_TRY_ASSIGN(const std::int32_t index, read_link(before, *args.find("link"), false, "link"));
  // Units follow the joint's type, so what was given is read again for this link.
  const Link& old = before.links[static_cast<std::size_t>(index)];
  Map given;
  for (const ParamSpec& p : link_schema(old.joint, false))
    if (const Value* v = ctx.given(p.name)) given.set(p.name, *v);
  const Schema schema = link_schema(kind_given(given.find("joint"), old.joint), false);
  const std::string where = "link " + text::quote(old.name);
  RMP_TRY_ASSIGN(given, ctx.expressions.read(schema, given, where));
  RMP_TRY_ASSIGN(const Map checked, read_map(ctx, schema, Value(given), where));
  return change_robot(ctx, args, [&](Robot& r) -> Result<void> {
    Link& l = r.links[static_cast<std::size_t>(index)];
    RMP_TRY(apply_link(ctx, checked, r, index, l, where));
    ctx.expressions.keep(r.parametric, l.name);
    for (std::size_t i = 0; i < r.links.size(); ++i)
      if (static_cast<std::int32_t>(i) != index && r.links[i].name == l.name)
        return error(ErrorCode::conflict, "there are two links named " + text::quote(l.name),
                     "Names are unique within a robot.");
    if (checked.find("inertia")) tell_inertia(ctx, name_in_document(ctx, args), l);
    return {};
  });
}

Result<Value> add_link(CommandContext& ctx, const Map& args) {
  Map given;
  for (const ParamSpec& p : link_schema(JointKind::revolute, true))
    if (const Value* v = ctx.given(p.name)) given.set(p.name, *v);
  return change_robot(ctx, args, [&](Robot& r) -> Result<void> {
    RMP_TRY(append_link(ctx, r, Value(given), "link " + std::to_string(r.links.size() + 1)));
    tell_inertia(ctx, name_in_document(ctx, args), r.links.back());
    // Named poses keep fitting: the new joint stands at 0 in them.
    if (r.links.back().joint != JointKind::fixed)
      for (model::NamedPose& p : r.poses) p.q.push_back(0);
    return {};
  });
}

Result<Value> remove_link(CommandContext& ctx, const Map& args) {
  return change_robot(ctx, args, [&](Robot& r) -> Result<void> {
    RMP_TRY_ASSIGN(const std::int32_t index, read_link(r, *args.find("link"), false, "link"));
    for (const Link& l : r.links)
      if (l.parent == index)
        return error(ErrorCode::conflict,
                     "link " + text::quote(l.name) + " stands on link " +
                         text::quote(r.links[static_cast<std::size_t>(index)].name),
                     "Remove that first.");
    const auto moving = robotics::moving_links(r);
    if (const auto joint = std::find(moving.begin(), moving.end(), index); joint != moving.end())
      for (model::NamedPose& p : r.poses) p.q.erase(p.q.begin() + (joint - moving.begin()));
    r.links.erase(r.links.begin() + index);
    for (Link& l : r.links)
      if (l.parent > index) --l.parent;
    return {};
  });
}

std::string_view joint_word(JointKind k) {
  return k == JointKind::revolute ? "revolute" : k == JointKind::prismatic ? "prismatic" : "fixed";
}

Result<Value> dh_table(CommandContext& ctx, const Map& args) {
  const Robot& r = content<Robot>(ctx, args);
  std::vector<double> matrix;
  List rows;
  for (const Link& l : r.links) {
    const double type = l.joint == JointKind::revolute    ? 0
                        : l.joint == JointKind::prismatic ? 1
                                                          : 2;
    matrix.insert(matrix.end(), {l.row.alpha, l.row.a, l.row.theta, l.row.d, type});
    rows.emplace_back(Map{{"link", l.name},
                          {"alpha", l.row.alpha},
                          {"a", l.row.a},
                          {"theta", l.row.theta},
                          {"d", l.row.d},
                          {"type", joint_word(l.joint)}});
  }
  return Value(Map{{"convention", r.convention == model::Convention::dh ? "dh" : "mdh"},
                   {"columns", List{"alpha", "a", "theta", "d", "type"}},
                   {"matrix", NumericArray(std::move(matrix), r.links.size(), 5)},
                   {"rows", std::move(rows)}});
}

Result<Value> links(CommandContext& ctx, const Map& args) {
  const Map all = describe_record(ctx.snapshot(), ref(args, "id"));
  return *all.find("links");
}

Result<Value> link_of(CommandContext& ctx, const Map& args) {
  const Robot& r = content<Robot>(ctx, args);
  RMP_TRY_ASSIGN(const std::int32_t index, read_link(r, *args.find("link"), false, "link"));
  const Map all = describe_record(ctx.snapshot(), ref(args, "id"));
  return (*all.find("links")->as_list())[static_cast<std::size_t>(index)];
}

Result<Value> link_row(CommandContext& ctx, const Map& args) {
  const Robot& r = content<Robot>(ctx, args);
  RMP_TRY_ASSIGN(const std::int32_t index, read_link(r, *args.find("link"), false, "link"));
  const Link& l = r.links[static_cast<std::size_t>(index)];
  return Value(NumericArray({l.row.alpha, l.row.a, l.row.theta, l.row.d,
                             l.joint == JointKind::revolute    ? 0.0
                             : l.joint == JointKind::prismatic ? 1.0
                                                               : 2.0}));
}

Result<Value> joints(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const auto m, model_of(ctx, args));
  List out;
  for (const JointModel& j : m->joints) {
    Map row{{"name", j.name},
            {"type", j.type == JointType::revolute ? "revolute" : "prismatic"},
            {"unit", j.type == JointType::revolute ? "rad" : "m"}};
    const std::pair<const char*, double> limits[] = {{"lower", j.lower},
                                                     {"upper", j.upper},
                                                     {"max_velocity", j.max_velocity},
                                                     {"max_acceleration", j.max_acceleration},
                                                     {"max_force", j.max_force}};
    for (const auto& [name, v] : limits)
      if (std::isfinite(v)) row.set(name, v);
    out.emplace_back(std::move(row));
  }
  return Value(std::move(out));
}

Result<Value> dof(CommandContext& ctx, const Map& args) {
  return Value(robotics::moving_links(content<Robot>(ctx, args)).size());
}

Result<Value> base_type(CommandContext&, const Map&) { return Value("Fixed"); }

Result<Value> poses(CommandContext& ctx, const Map& args) {
  Map out;
  for (const model::NamedPose& p : content<Robot>(ctx, args).poses)
    out.set(p.name, NumericArray(p.q));
  return Value(std::move(out));
}

Result<Value> set_pose(CommandContext& ctx, const Map& args) {
  const std::string name = text_of(args, "name");
  if (name.empty())
    return error(ErrorCode::invalid_argument, "the pose has no name", "Give name = \"home\".");
  RMP_TRY_ASSIGN(const auto m, model_of(ctx, args));
  RMP_TRY_ASSIGN(const auto q, read_q(*args.find("q"), content<Robot>(ctx, args), m->joints, "q"));
  return change_robot(ctx, args, [&](Robot& r) -> Result<void> {
    for (model::NamedPose& p : r.poses)
      if (p.name == name) {
        p.q = q;
        return {};
      }
    r.poses.push_back({name, q});
    return {};
  });
}

Result<Value> remove_pose(CommandContext& ctx, const Map& args) {
  const std::string name = text_of(args, "name");
  return change_robot(ctx, args, [&](Robot& r) -> Result<void> {
    std::vector<std::string> known;
    for (const auto& p : r.poses) known.push_back(p.name);
    if (std::erase_if(r.poses, [&](const model::NamedPose& p) { return p.name == name; }) == 0)
      return unknown_name("pose", name, known);
    return {};
  });
}

/// Bodies of the moving links in the links' frames, with the motors' parameters.
Result<Value> dynamics(CommandContext& ctx, const Map& args) {
  const Robot& r = content<Robot>(ctx, args);
  RMP_TRY_ASSIGN(const auto m, model_of(ctx, args));
  const auto moving = robotics::moving_links(r);
  std::vector<double> matrix;
  List rows;
  for (std::size_t i = 0; i < m->joints.size(); ++i) {
    const JointModel& j = m->joints[i];
    const Link& l = r.links[static_cast<std::size_t>(moving[i])];
    const MassProperties b = spatial::in_frame(j.body, spatial::inverse(j.link));
    matrix.insert(matrix.end(), {b.mass, b.com[0], b.com[1], b.com[2], b.inertia.xx, b.inertia.yy,
                                 b.inertia.zz, b.inertia.xy, b.inertia.yz, b.inertia.xz,
                                 l.drive.motor_inertia, l.drive.gear_ratio, l.drive.viscous,
                                 l.drive.coulomb_positive, l.drive.coulomb_negative});
    rows.emplace_back(Map{{"link", l.name},
                          {"mass", b.mass},
                          {"com", vec_value(b.com, "m")},
                          {"inertia", sym_value(b.inertia, "kg m^2")},
                          {"motor_inertia", l.drive.motor_inertia},
                          {"gear_ratio", l.drive.gear_ratio},
                          {"viscous", l.drive.viscous},
                          {"coulomb_positive", l.drive.coulomb_positive},
                          {"coulomb_negative", l.drive.coulomb_negative}});
  }
  List columns;
  for (const char* c : {"mass", "rx", "ry", "rz", "Ixx", "Iyy", "Izz", "Ixy", "Iyz", "Ixz", "Jm",
                        "G", "B", "Tc+", "Tc-"})
    columns.emplace_back(c);
  return Value(Map{{"columns", std::move(columns)},
                   {"matrix", NumericArray(std::move(matrix), m->joints.size(), 15)},
                   {"rows", std::move(rows)}});
}

Result<Value> mass(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const auto m, model_of(ctx, args));
  std::vector<double> q(m->dof(), 0.0);
  if (has(args, "q")) {
    RMP_TRY_ASSIGN(q, read_q(*args.find("q"), content<Robot>(ctx, args), m->joints, "q"));
  }
  std::vector<Pose> frames(m->joints.size());
  robotics::forward_kinematics(*m, q, frames);
  std::vector<MassProperties> bodies;
  for (std::size_t i = 0; i < frames.size(); ++i)
    bodies.push_back(spatial::in_frame(m->joints[i].body, spatial::compose(m->base, frames[i])));
  tell_no_mass(ctx, *m, Severity::info, "");
  const MassProperties all = spatial::combine(bodies);
  return mass_value(all);
}

Result<Value> tool(CommandContext& ctx, const Map& args) {
  Map out = pose_map(model::pose(content<Robot>(ctx, args).tool));
  out.set("placement", placement_value(content<Robot>(ctx, args).tool));
  return Value(std::move(out));
}

Result<Value> set_tool(CommandContext& ctx, const Map& args) {
  Map given;
  for (const ParamSpec& p : placement_fields(""))
    if (const Value* v = ctx.given(p.name)) given.set(p.name, *v);
  RMP_TRY_ASSIGN(const auto placement, read_placement_fields(given, "tool"));
  return change_robot(ctx, args, [&](Robot& r) -> Result<void> {
    r.tool = placement;
    return {};
  });
}

Result<Value> skin(CommandContext& ctx, const Map& args) {
  const Robot& r = content<Robot>(ctx, args);
  const robotics::Skin s = robotics::make_skin(r);
  const bool designed =
      !r.base_parts.empty() ||
      std::any_of(r.links.begin(), r.links.end(), [](const Link& l) { return !l.parts.empty(); });
  List per_link;
  for (const auto& pieces : s.links) per_link.emplace_back(pieces.size());
  return Value(Map{{"generated", !designed},
                   {"base", s.base.size()},
                   {"links", std::move(per_link)},
                   {"colour", colour_text(r.skin_colour)},
                   {"accent", colour_text(r.skin_accent)}});
}

}  // namespace

std::vector<CommandSpec> robot_commands() {
  std::vector<CommandSpec> all;
  const ParamSpec link = needed("link", "any", "", "Number, 1 is the first, or name of the link.");
  const ParamSpec q =
      optional("q", "any", "rad or m",
               "Joint values, one a joint, or the name of a pose; zeros when left out.");
  Schema create_params{
      needed("name", "string", "", "Name, unique among robots."),
      needed("links", "list", "", "Links, parents before children; fields as in robot.add_link.")};
  for (ParamSpec& p : robot_fields()) create_params.push_back(std::move(p));
  create_params.push_back(
      optional("poses", "map", "", "Named joint vectors, such as {home = {0, 0, 0}}."));
  create_params.push_back(parameters_field());
  all.push_back(
      {.name = "robot.create",
       .classic = "",
       .summary = "Makes a robot from its links.",
       .details = "A link is a table of the fields that robot.add_link takes. Each stands on the "
                  "one before it unless it names a parent, so that trees can be made as well.",
       .example = with_arm("assert(arm:dof() == 6)"),
       .params = std::move(create_params),
       .returns = {"handle", "", "", {}},
       .effect = Effect::edits,
       .run = create,
       .takes_expressions = true});
  Schema set_params{self("robot")};
  for (ParamSpec& p : robot_fields()) {
    p.default_value.reset();
    set_params.push_back(std::move(p));
  }
  all.push_back({.name = "robot.set",
                 .classic = "",
                 .summary = "Changes what is given of a robot.",
                 .details = "",
                 .example = with_arm("arm:set{mass_source = \"designed\", base = {0, 0, 0.1, 0, 0, "
                                     "0}}\nassert(arm:describe().mass_source == \"designed\")"),
                 .params = std::move(set_params),
                 .returns = {},
                 .effect = Effect::edits,
                 .run = set,
                 .takes_expressions = true});
  Schema add_params{self("robot")};
  for (ParamSpec& p : link_schema(JointKind::revolute, true)) add_params.push_back(std::move(p));
  const char* const by_type =
      "Limits are in rad, rad/s, rad/s^2 and N m for a revolute joint, in m, m/s, m/s^2 and N for "
      "a prismatic one.";
  // What is here only declares the fields: the limits' units follow the joint's type.
  for (ParamSpec& p : add_params)
    if (p.name == "lower" || p.name == "upper" || p.name.starts_with("max_")) {
      p.type = "any";
      p.min = -std::numeric_limits<double>::infinity();
    }
  Schema link_params = add_params;
  for (ParamSpec& p : link_params) p.default_value.reset();
  link_params.insert(link_params.begin() + 1, link);
  link_params.push_back(optional("gesture", "string", "",
                                 "Edits in a row with the same word share one step; for sliders."));
  all.push_back({.name = "robot.add_link",
                 .classic = "",
                 .summary = "Adds a link at the end of a robot's list.",
                 .details = std::string(by_type) + " Named poses get 0 for its joint.",
                 .example = with_arm("arm:add_link{name = \"rail\", joint = \"prismatic\", d = "
                                     "0.1, lower = 0, upper = \"200 mm\"}\nassert(arm:dof() == 7)"),
                 .params = std::move(add_params),
                 .returns = {},
                 .effect = Effect::edits,
                 .run = add_link,
                 .takes_expressions = true});
  all.push_back({.name = "robot.set_link",
                 .classic = "",
                 .summary = "Changes what is given of a link.",
                 .details = by_type,
                 .example = with_arm("arm:set_link{link = 2, a = \"500 mm\", upper = \"120 "
                                     "deg\"}\nassert(arm:link(2).a == 0.5)"),
                 .params = std::move(link_params),
                 .returns = {},
                 .effect = Effect::edits,
                 .run = set_link,
                 .takes_expressions = true});
  all.push_back({.name = "robot.remove_link",
                 .classic = "",
                 .summary = "Removes a link on which no other stands.",
                 .details = "Named poses lose the value of its joint.",
                 .example = with_arm("arm:remove_link(6)\nassert(arm:dof() == 5)"),
                 .params = {self("robot"), link},
                 .returns = {},
                 .effect = Effect::edits,
                 .run = remove_link});
  all.push_back(
      {.name = "robot.dh_table",
       .classic = "PRobot mGetDHP|PRobot LLRL mGetDHP",
       .summary = "Gives the Denavit-Hartenberg table of a robot.",
       .details = "The matrix has one row a link with the columns of the original: alpha [rad], a "
                  "[m], theta [rad], d [m], type (0 revolute, 1 prismatic, 2 fixed). The joint's "
                  "variable adds to theta or d.",
       .example = with_arm(
           "local t = arm:dh_table()\nassert(t.rows[1].d == 0.4 and t.columns[1] == \"alpha\")"),
       .params = {self("robot")},
       .returns = {"map",
                   "",
                   "",
                   {field("convention", "string", "", "dh or mdh."),
                    field("columns", "list", "", "Names of the matrix' columns."),
                    field("matrix", "matrix", "", "One row a link."),
                    field("rows", "list", "", "The same by names.")}},
       .effect = Effect::reads,
       .run = dh_table});
  all.push_back({.name = "robot.links",
                 .classic = "",
                 .summary = "Lists the links with everything they hold.",
                 .details = "Limits that are missing are unlimited.",
                 .example = with_arm("assert(#arm:links() == 6)"),
                 .params = {self("robot")},
                 .returns = {"list", "", "Tables with the fields of robot.add_link.", {}},
                 .effect = Effect::reads,
                 .run = links});
  all.push_back({.name = "robot.link",
                 .classic = "PRobot Link Get",
                 .summary = "Gives everything one link holds.",
                 .details = "Classic: `PRobot <id> Link <i> Get`.",
                 .example = with_arm("assert(arm:link(1).d == 0.4)"),
                 .params = {self("robot"), link},
                 .returns = {"map", "", "The fields of robot.add_link.", {}},
                 .effect = Effect::reads,
                 .run = link_of});
  all.push_back({.name = "robot.link_row",
                 .classic = "PRobot Link vGetDHp",
                 .summary = "Gives alpha, a, theta, d and type of one link.",
                 .details = "Classic: `PRobot <id> Link <i> vGetDHp`.",
                 .example = with_arm("assert(arm:link_row(2)[2] == 0.45)"),
                 .params = {self("robot"), link},
                 .returns = {"array", "", "alpha [rad], a [m], theta [rad], d [m], type.", {}},
                 .effect = Effect::reads,
                 .run = link_row});
  all.push_back(
      {.name = "robot.joints",
       .classic = "",
       .summary = "Lists the moving joints with type and limits.",
       .details = "Limits that are missing are unlimited.",
       .example = with_arm("assert(arm:joints()[1].upper == 3)"),
       .params = {self("robot")},
       .returns = {"list",
                   "",
                   "",
                   {field("name", "string", "", "Name of its link."),
                    field("type", "string", "", "revolute or prismatic."),
                    field("unit", "string", "", "rad or m."),
                    field("lower", "real", "rad or m", "Least value."),
                    field("upper", "real", "rad or m", "Greatest value."),
                    field("max_velocity", "real", "rad/s or m/s", "Greatest speed."),
                    field("max_acceleration", "real", "rad/s^2 or m/s^2", "Greatest acceleration."),
                    field("max_force", "real", "N m or N", "Greatest torque or force.")}},
       .effect = Effect::reads,
       .run = joints});
  all.push_back({.name = "robot.dof",
                 .classic = "PRobot GetDOF",
                 .summary = "Counts the joint variables.",
                 .details = "",
                 .example = with_arm("assert(arm:dof() == 6)"),
                 .params = {self("robot")},
                 .returns = {"int", "", "", {}},
                 .effect = Effect::reads,
                 .run = dof});
  all.push_back({.name = "robot.base_type",
                 .classic = "PRobot GetBaseType",
                 .summary = "Tells how the base is held.",
                 .details = "Bases are fixed where the world places them.",
                 .example = with_arm("assert(arm:base_type() == \"Fixed\")"),
                 .params = {self("robot")},
                 .returns = {"string", "", "", {}},
                 .effect = Effect::reads,
                 .run = base_type});
  all.push_back({.name = "robot.poses",
                 .classic = "",
                 .summary = "Lists the named poses of a robot.",
                 .details = "",
                 .example = with_arm("assert(#arm:poses().ready == 6)"),
                 .params = {self("robot")},
                 .returns = {"map", "", "Joint values by name.", {}},
                 .effect = Effect::reads,
                 .run = poses});
  ParamSpec q_needed = q;
  q_needed.required = true;
  q_needed.doc = "Joint values, one a joint, or the name of a pose.";
  all.push_back(
      {.name = "robot.set_pose",
       .classic = "",
       .summary = "Names a joint vector.",
       .details = "The pose \"home\" is what a world shows first.",
       .example = with_arm("arm:set_pose{name = \"home\", q = {0, \"-45 deg\", 0, 0, 0, "
                           "0}}\nassert(math.abs(arm:poses().home[2] + math.pi / 4) < 1e-15)"),
       .params = {self("robot"), needed("name", "string", "", "Name of the pose."), q_needed},
       .returns = {},
       .effect = Effect::edits,
       .run = set_pose});
  all.push_back(
      {.name = "robot.remove_pose",
       .classic = "",
       .summary = "Forgets a named pose.",
       .details = "",
       .example = with_arm("arm:remove_pose(\"ready\")\nassert(arm:poses().ready == nil)"),
       .params = {self("robot"), needed("name", "string", "", "Name of the pose.")},
       .returns = {},
       .effect = Effect::edits,
       .run = remove_pose});
  all.push_back(
      {.name = "robot.dynamics",
       .classic = "PRobot vGetDynamicp|PRobot vGetDynamic",
       .summary = "Gives the dynamic parameters of every moving link.",
       .details =
           "The matrix has the columns of the original: mass, rx, ry, rz, Ixx, Iyy, Izz, Ixy, Iyz, "
           "Ixz, Jm, G, B, Tc+, Tc-; in the link's frame, inertia about the centre of mass, motor "
           "and friction at the motor. Masses come from where mass_source says.",
       .example = with_arm("assert(arm:dynamics().rows[1].mass == 5)"),
       .params = {self("robot")},
       .returns = {"map",
                   "",
                   "",
                   {field("columns", "list", "", "Names of the matrix' columns."),
                    field("matrix", "matrix", "", "One row a moving link, SI."),
                    field("rows", "list", "", "The same by names.")}},
       .effect = Effect::reads,
       .run = dynamics});
  all.push_back(
      {.name = "robot.mass",
       .classic = "",
       .summary = "Gives mass, centre of mass and inertia of all moving links together.",
       .details = "In the frame the robot is mounted in. The base does not move and is left out.",
       .example = with_arm("assert(math.abs(arm:mass().mass - 13.7) < 1e-12)"),
       .params = {self("robot"), q},
       .returns = {"map",
                   "",
                   "",
                   {field("mass", "real", "kg", "Mass."),
                    field("com", "vec3", "m", "Centre of mass."),
                    field("inertia", "matrix", "kg m^2", "Tensor about it.")}},
       .effect = Effect::reads,
       .run = mass});
  all.push_back({.name = "robot.tool",
                 .classic = "PRobot mGetToolHMT",
                 .summary = "Gives the tool's frame in the frame of the last link.",
                 .details = "",
                 .example = with_arm("assert(arm:tool().pose[4][4] == 1)"),
                 .params = {self("robot")},
                 .returns = {"map",
                             "",
                             "",
                             {field("pose", "pose", "", "4x4 homogeneous matrix."),
                              field("position", "vec3", "m", "Position."),
                              field("rpy", "vec3", "rad", "Roll, pitch, yaw."),
                              field("quaternion", "real[]", "", "w, x, y, z."),
                              field("placement", "map", "", "As it was written.")}},
                 .effect = Effect::reads,
                 .run = tool});
  Schema tool_params{self("robot")};
  for (ParamSpec& p : placement_fields("the last link")) tool_params.push_back(std::move(p));
  all.push_back(
      {.name = "robot.set_tool",
       .classic = "",
       .summary = "Sets the tool's frame in the frame of the last link.",
       .details = "",
       .example = with_arm(
           "arm:set_tool{position = {0, 0, \"150 mm\"}}\nassert(arm:tool().position[3] == 0.15)"),
       .params = std::move(tool_params),
       .returns = {},
       .effect = Effect::edits,
       .run = set_tool});
  all.push_back(
      {.name = "robot.skin",
       .classic = "",
       .summary = "Tells what body is drawn for a robot without designed parts.",
       .details = "The generated body has no mass.",
       .example = with_arm("assert(arm:skin().generated)"),
       .params = {self("robot")},
       .returns = {"map",
                   "",
                   "",
                   {field("generated", "bool", "", "False when designed parts are drawn instead."),
                    field("base", "int", "", "Pieces of the base."),
                    field("links", "list", "", "Pieces of each link."),
                    field("colour", "string", "", "Colour of the tubes."),
                    field("accent", "string", "", "Colour of the joints.")}},
       .effect = Effect::reads,
       .run = skin});
  return all;
}

}  // namespace robomosp::ioci
