// SPDX-License-Identifier: Apache-2.0
// What a robot is as a whole: its fields, named poses, masses, skin.
#include <algorithm>
#include <cmath>

#include "ioci/core/record_params.h"
#include "ioci/robot/array_units.h"
#include "ioci/robot/robots.h"
#include "ioci/robot/shown_robot.h"
#include "robotics/build_model.h"
#include "robotics/coordinates.h"
#include "robotics/kinematics.h"
#include "robotics/link_geometry.h"
#include "spatial/mass.h"
#include "spatial/pose.h"

namespace robomosp::ioci {

namespace {

using model::Link;
using model::Robot;

Schema robot_fields() {
  Schema s =
      led_by({"convention", "mass_source", "base", "base_parts", "base_mass", "tool", "ik",
              "inverse_dynamics", "forward_dynamics", "controller", "skin_colour", "skin_accent"},
             without(record_params("robot", ""), {"links", "payload", "tools", "attached", "tcp",
                                                  "loops", "poses", "axes", "pair_rules"}));
  param_named(s, "base_parts").type = "list<type:body>";
  param_named(s, "base_mass").type = "type:mass";
  for (const char* word : {"convention", "mass_source"}) {
    ParamSpec& p = param_named(s, word);
    p.default_value = Value(p.choices.front());
  }
  return s;
}

Result<void> apply_fields(CommandContext& ctx, const Map& args, Robot& r) {
  RMP_TRY(set_fields(r, args));
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
  if (has(args, "base_mass")) {
    static const Schema fields = mass_fields("Mass of the base.", "the frame of the base");
    RMP_TRY_ASSIGN(const Map given, read_map(ctx, fields, *args.find("base_mass"), "base_mass"));
    r.base_mass.reset();
    RMP_TRY(read_mass(given, r.base_mass, "base_mass."));
    if (r.base_mass && r.base_mass->mass == 0) r.base_mass.reset();
  }
  ctx.expressions.keep(r.parametric);
  return {};
}

Result<Value> create(CommandContext& ctx, const Map& args) {
  Robot r;
  const std::string name = text_of(args, "name");
  r.parametric = ctx.expressions.own();
  RMP_TRY(apply_fields(ctx, args, r));
  RMP_TRY_ASSIGN(const List links, links_given(*args.find("links"), args.find("columns")));
  std::unordered_set<std::string> names;
  const auto go_on = [&]() -> Result<void> {
    if (!ctx.progress.cancelled()) return {};
    return error(ErrorCode::cancelled, "the robot was not created: cancelled");
  };
  for (std::size_t i = 0; i < links.size(); ++i) {
    if (i % 256 == 0) RMP_TRY(go_on());
    RMP_TRY(append_link(ctx, r, links[i], "links[" + std::to_string(i + 1) + "]", names));
  }
  RMP_TRY_ASSIGN(const RobotModel built,
                 robotics::build_robot_model(name, r, {}, {0, 0, -9.81}, &ctx.progress));
  if (has(args, "axes")) RMP_TRY(give_axes(ctx, r, *args.find("axes")));
  if (const Value* poses = args.find("poses"); poses && poses->as_map())
    for (const auto& [pose, q] : *poses->as_map()) {
      RMP_TRY_ASSIGN(auto values, read_q(q, r, built.joints, "poses." + pose));
      r.poses.push_back({pose, std::move(values)});
    }
  for (std::size_t i = 0; i < r.links.size(); ++i) {
    if (i % 256 == 0) RMP_TRY(go_on());
    report_inertia(ctx, name, r.links[i]);
  }
  RMP_TRY(go_on());
  RMP_TRY_ASSIGN(const auto id, ctx.edit().add(name, std::move(r)));
  return Value(Application::handle(id));
}

Result<Value> set(CommandContext& ctx, const Map& args) {
  return change_robot(ctx, args, [&](Robot& r) { return apply_fields(ctx, args, r); });
}

Result<Value> dof(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const auto m, model_of(ctx, args));
  return Value(m->dof());
}

Result<Value> base_type(CommandContext& ctx, const Map& args) {
  const Robot& r = content<Robot>(ctx, args);
  const bool floats = std::any_of(r.links.begin(), r.links.end(), [](const Link& l) {
    return l.parent < 0 && l.joint == model::JointKind::free;
  });
  if (floats) return Value("Floating");
  // By the words of the program of 2006, of the only world that shows it or of the one given.
  constexpr const char* kWords[] = {"Fixed", "Free Flying", "Free Floating", "Serpentine"};
  bool is_placed = has(args, "world");
  for (const AnyId any : ctx.snapshot().list(Kind::world))
    for (const auto& placed : ctx.snapshot().get(WorldId{any.number})->robots)
      is_placed = is_placed || placed.robot == typed<Robot>(args);
  if (!is_placed) return Value(kWords[0]);
  RMP_TRY_ASSIGN(const ShownRobot shown, shown_robot(ctx, args));
  const auto& placed = ctx.snapshot().get(shown.world)->robots[shown.member];
  return Value(kWords[static_cast<std::size_t>(placed.base)]);
}

Result<Value> poses(CommandContext& ctx, const Map& args) {
  Map out;
  const Robot& r = content<Robot>(ctx, args);
  const std::string unit = joint_array_unit(r);
  for (const model::NamedPose& p : r.poses) out.set(p.name, NumericArray(p.q, unit));
  return Value(std::move(out));
}

Schema pose_params(const ParamSpec& q) {
  Schema s = led_by({"name"}, without(record_params("robot", "poses"), {"q"}));
  s.front().required = true;
  s.front().doc = "Name of the pose.";
  s.insert(s.begin(), self("robot"));
  s.insert(s.begin() + 2, q);
  return s;
}

Result<Value> set_pose(CommandContext& ctx, const Map& args) {
  model::NamedPose given;
  RMP_TRY(set_fields(given, args));
  if (given.name.empty())
    return error(ErrorCode::invalid_argument, "the pose has no name", "Give name = \"home\".");
  RMP_TRY_ASSIGN(const auto m, model_of(ctx, args));
  RMP_TRY_ASSIGN(given.q, read_q(*args.find("q"), content<Robot>(ctx, args), m->joints, "q"));
  return change_robot(ctx, args, [&](Robot& r) -> Result<void> {
    for (model::NamedPose& p : r.poses)
      if (p.name == given.name) {
        p = given;
        return {};
      }
    r.poses.push_back(given);
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
    // Of a sequence of joints only the last one carries the link.
    if (i + 1 < moving.size() && moving[i + 1] == moving[i]) continue;
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
  const std::size_t count = rows.size();
  List columns;
  for (const char* c : {"mass", "rx", "ry", "rz", "Ixx", "Iyy", "Izz", "Ixy", "Iyz", "Ixz", "Jm",
                        "G", "B", "Tc+", "Tc-"})
    columns.emplace_back(c);
  return Value(Map{{"columns", std::move(columns)},
                   {"matrix", NumericArray(std::move(matrix), count, 15)},
                   {"rows", std::move(rows)}});
}

Result<Value> mass(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const auto m, model_of(ctx, args));
  std::vector<double> q = robotics::neutral_coordinates(*m);
  if (has(args, "q")) {
    RMP_TRY_ASSIGN(q, read_q(*args.find("q"), content<Robot>(ctx, args), m->joints, "q"));
  }
  std::vector<Pose> frames(m->joints.size());
  robotics::forward_kinematics(*m, q, frames);
  std::vector<MassProperties> bodies;
  for (std::size_t i = 0; i < frames.size(); ++i)
    bodies.push_back(spatial::in_frame(m->joints[i].body, spatial::compose(m->base, frames[i])));
  const double moving = spatial::combine(bodies).mass;
  RMP_TRY_ASSIGN(const auto standing,
                 ctx.app.derived.standing_mass(ctx.snapshot(), typed<Robot>(args), ctx.progress));
  if (standing) bodies.push_back(*standing);
  report_no_mass(ctx, *m, Severity::info, "");
  const MassProperties all = spatial::combine(bodies);
  if (!spatial::is_finite(all))
    return error(ErrorCode::invalid_argument, "its mass is beyond the range of real numbers",
                 "Check the masses of its links.", name_in(ctx, ref(args, "id")));
  Value out = mass_value(all);
  out.as_map()->set("moving", Value(moving));
  out.as_map()->set("standing", Value(standing ? standing->mass : 0.0));
  return out;
}

Result<Value> skin(CommandContext& ctx, const Map& args) {
  const Robot& r = content<Robot>(ctx, args);
  const robotics::LinkGeometry s = robotics::make_link_geometry(r);
  const std::vector<bool> is_generated = robotics::generated_bodies(r);
  List per_link;
  for (std::size_t i = 0; i < s.links.size(); ++i)
    per_link.emplace_back(is_generated[i + 1] ? s.links[i].size() : std::size_t{0});
  const bool all_generated =
      r.base_parts.empty() &&
      std::all_of(r.links.begin(), r.links.end(), [](const Link& l) { return l.parts.empty(); });
  return Value(Map{{"generated", all_generated},
                   {"base", is_generated[0] ? s.base.size() : std::size_t{0}},
                   {"links", std::move(per_link)},
                   {"colour", colour_text(r.skin_colour)},
                   {"accent", colour_text(r.skin_accent)}});
}

}  // namespace

RMP_COMMANDS(robot_commands) {
  std::vector<CommandSpec> all;
  const ParamSpec q =
      optional("q", "any", "rad or m",
               "Joint values, one per joint, or the name of a pose; zeros if omitted.");
  Schema create_params{
      needed("name", "string", "", "Name, unique among robots."),
      needed("links", "any", "",
             "Links, parents before children; fields as in robot.add_link. Or rows of numbers with "
             "columns, or the result of robot.dh_table."),
      optional("columns", "list", "",
               "Meaning of the numbers in a row, with a unit if they are not in SI: {\"theta "
               "deg\", \"d mm\", \"a mm\", \"alpha deg\"}. Any field of a link may be a column.")};
  for (ParamSpec& p : robot_fields()) create_params.push_back(std::move(p));
  create_params.push_back(
      optional("poses", "map", "", "Named joint vectors, such as {home = {0, 0, 0}}."));
  create_params.push_back(optional(
      "axes", "list", "", "The axes as the maker counts them; fields as in robot.set_axes."));
  create_params.push_back(parameters_field());
  all.push_back(
      {.name = "robot.create",
       .classic = "",
       .summary = "Makes a robot from its links.",
       .details = "A link is a table of the fields of robot.add_link. Each is mounted on the one "
                  "before it unless it names a parent, so that trees can be made as well. A "
                  "Denavit-Hartenberg table can be typed directly, with named columns, as books "
                  "order them differently: links = {{0, 0.4, 0, -90}, {0, 0, 0.45, 0}}, columns = "
                  "{\"theta\", \"d\", \"a\", \"alpha deg\"}.",
       .example =
           "local arm = robot.create{name = \"shoulder\", convention = \"dh\", links = {\n"
           "  {d = 0.4, alpha = \"-90 deg\", lower = \"-170 deg\", upper = \"170 deg\", mass = 5, "
           "com = {0, 0.1, 0}, inertia = {0.02, 0.01, 0.02, 0, 0, 0}},\n"
           "  {a = 0.45, lower = \"-90 deg\", upper = \"120 deg\", mass = 4, com = {-0.2, 0, 0}},\n"
           "  {joint = \"prismatic\", lower = 0, upper = \"300 mm\"}},\n"
           "  poses = {ready = {0, \"-45 deg\", 0.1}}}\n"
           "assert(arm:dof() == 3 and arm:joints()[3].unit == \"m\")",
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
                 .summary = "Changes the given properties of a robot.",
                 .details = "",
                 .example = with_arm("arm:set{mass_source = \"designed\", base = {0, 0, 0.1, 0, 0, "
                                     "0}}\nassert(arm:describe().mass_source == \"designed\")"),
                 .params = std::move(set_params),
                 .returns = {},
                 .effect = Effect::edits,
                 .run = set,
                 .takes_expressions = true});
  all.push_back({.name = "robot.dof",
                 .classic = "PRobot GetDOF",
                 .summary = "Counts the independent joint velocities, not considering loops.",
                 .details = "",
                 .example = with_arm("assert(arm:dof() == 6)"),
                 .params = {self("robot")},
                 .returns = {"int", "", "", {}},
                 .effect = Effect::reads,
                 .run = dof});
  all.push_back({.name = "robot.base_type",
                 .classic = "PRobot GetBaseType",
                 .summary = "Reports how the base is held.",
                 .details = "Fixed: mounted where the world places it; Free Flying, Free Floating "
                            "or Serpentine: as set in the world that shows it (robot.set_base); "
                            "Floating: its first link has a free joint.",
                 .example = with_arm("assert(arm:base_type() == \"Fixed\")"),
                 .params = {self("robot"), shown_world()},
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
  q_needed.doc = "Joint values, one per joint, or the name of a pose.";
  all.push_back(
      {.name = "robot.set_pose",
       .classic = "",
       .summary = "Stores a joint vector under a name.",
       .details = "A world shows the pose \"home\" first.",
       .example = with_arm("arm:set_pose{name = \"home\", q = {0, \"-45 deg\", 0, 0, 0, "
                           "0}}\nassert(math.abs(arm:poses().home[2] + math.pi / 4) < 1e-15)"),
       .params = pose_params(q_needed),
       .returns = {},
       .effect = Effect::edits,
       .run = set_pose});
  all.push_back(
      {.name = "robot.remove_pose",
       .classic = "",
       .summary = "Removes a named pose.",
       .details = "",
       .example = with_arm("arm:remove_pose(\"ready\")\nassert(arm:poses().ready == nil)"),
       .params = {self("robot"), needed("name", "string", "", "Name of the pose.")},
       .returns = {},
       .effect = Effect::edits,
       .run = remove_pose});
  all.push_back(
      {.name = "robot.dynamics",
       .classic = "PRobot vGetDynamicp|PRobot vGetDynamic",
       .summary = "Returns the dynamic parameters of every moving link.",
       .details =
           "The matrix has the columns of the 2006 program: mass, rx, ry, rz, Ixx, Iyy, Izz, Ixy, "
           "Iyz, Ixz, Jm, G, B, Tc+, Tc-; in the link's frame, with the inertia about the centre "
           "of mass, and motor and friction at the motor. mass_source selects the masses.",
       .example = with_arm("assert(arm:dynamics().rows[1].mass == 5)"),
       .params = {self("robot")},
       .returns = {"map",
                   "",
                   "",
                   {field("columns", "list", "", "Names of the matrix' columns."),
                    field("matrix", "matrix", "", "One row per moving link, SI."),
                    field("rows", "list", "", "The same values by name.")}},
       .effect = Effect::reads,
       .run = dynamics});
  all.push_back(
      {.name = "robot.mass",
       .classic = "",
       .summary =
           "Returns mass, centre of mass and inertia of the robot at its present joint values.",
       .details = "In the robot's mounting frame: links with payloads, everything fixed to the "
                  "base, and the base itself: its designed parts if these count (mass_source), "
                  "otherwise its base_mass.",
       .example = with_arm("assert(math.abs(arm:mass().mass - 13.7) < 1e-12)"),
       .params = {self("robot"), q},
       .returns =
           {"map",
            "",
            "",
            {field("mass", "real", "kg", "Mass."), field("com", "vec3", "m", "Centre of mass."),
             field("inertia", "matrix", "kg m^2", "Inertia tensor about the centre of mass."),
             field("moving", "real", "kg", "Mass of the moving links."),
             field("standing", "real", "kg",
                   "Mass of the base and everything fixed to it, as far as it is known.")}},
       .effect = Effect::reads,
       .run = mass});
  all.push_back(
      {.name = "robot.skin",
       .classic = "",
       .summary = "Reports the generated bodies of links without designed parts.",
       .details = "Each visible link without parts gets a generated body, which is used for "
                  "pictures and collisions and has no mass; a fixed link on a designed link gets "
                  "none. The base gets one if it has no parts and carries a link that has one.",
       .example = "local rod = robot.create{name = \"rod\", links = {{name = \"swing\", joint = "
                  "\"revolute\", "
                  "a = 0.5}}}\n"
                  "assert(rod:skin().generated and not robot.get(\"arm\"):skin().generated)\n",
       .params = {self("robot")},
       .returns = {"map",
                   "",
                   "",
                   {field("generated", "bool", "", "True if no link has designed parts."),
                    field("base", "int", "", "Generated pieces of the base."),
                    field("links", "list", "", "Generated pieces of each link."),
                    field("colour", "string", "", "Colour of the tubes."),
                    field("accent", "string", "", "Colour of the joints.")}},
       .effect = Effect::reads,
       .run = skin});
  return all;
}

}  // namespace robomosp::ioci