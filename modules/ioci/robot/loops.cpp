// SPDX-License-Identifier: Apache-2.0
// Closed loops of a robot: what holds together, how far it is open, closing it.
#include <algorithm>
#include <cmath>

#include "ioci/core/record_params.h"
#include "ioci/robot/array_units.h"
#include "ioci/robot/robots.h"
#include "kernel/type.h"
#include "model/words.h"
#include "robotics/closure.h"
#include "robotics/coordinates.h"
#include "robotics/home.h"
#include "robotics/kinematics.h"

namespace robomosp::ioci {
namespace {

using model::LoopClosure;
using model::Robot;

/// A four-bar for the examples: ground 0.4 m, crank 0.1 m, coupler 0.35 m, rocker 0.25 m.
std::string with_four_bar(const char* rest) {
  return std::string(
             "local bar = robot.create{name = \"bar\", links = {\n"
             "  {name = \"crank\", a = 0.1}, {name = \"coupler\", a = 0.35, passive = true},\n"
             "  {name = \"rocker\", parent = \"base\", origin = {0.4, 0, 0}, passive = true}},\n"
             "  poses = {home = {0.6, 0.7, 1.8}}}\n"
             "bar:add_loop{name = \"pin\", kind = \"planar\", a = {link = \"coupler\"},\n"
             "  b = {link = \"rocker\", position = {0.25, 0, 0}}}\n") +
         rest;
}

const Schema& side_schema() {
  static const Schema all = [] {
    Schema s{needed("link", "any", "", "Number or name of the link, or \"base\".")};
    for (ParamSpec& p : placement_fields("the link")) s.push_back(std::move(p));
    return s;
  }();
  return all;
}

std::string side_type() {
  Schema s = side_schema();
  retype(s, "link", "member:link_or_base of id or int");
  return map_type(s);
}
const NamedType kSideType("frame_on_link", "map", side_type);

Result<void> read_side(const CommandContext& ctx, const Robot& r, const Value& v,
                       const std::string& path, std::int32_t& link, model::Placement& frame) {
  RMP_TRY_ASSIGN(const Map checked, read_map(ctx, side_schema(), v, path));
  RMP_TRY_ASSIGN(link, read_link(r, *checked.find("link"), true, path + ".link"));
  if (const Map* table = v.as_map()) {
    RMP_TRY_ASSIGN(frame, read_placement_fields(*table, path));
  }
  return {};
}

Result<LoopClosure*> find_loop(Robot& r, const std::string& name) {
  std::vector<std::string> known;
  for (LoopClosure& l : r.loops) {
    if (l.name == name) return &l;
    known.push_back(l.name);
  }
  return unknown_name("loop", name, known);
}

Result<void> apply_loop(CommandContext& ctx, const Map& args, const Robot& r, LoopClosure& l) {
  RMP_TRY(set_fields(l, args, {"a", "b"}));
  if (has(args, "a")) RMP_TRY(read_side(ctx, r, *ctx.given("a"), "a", l.link_a, l.in_a));
  if (has(args, "b")) RMP_TRY(read_side(ctx, r, *ctx.given("b"), "b", l.link_b, l.in_b));
  return {};
}

Result<Value> add_loop(CommandContext& ctx, const Map& args) {
  return change_robot(ctx, args, [&](Robot& r) -> Result<void> {
    LoopClosure l;
    RMP_TRY(apply_loop(ctx, args, r, l));
    r.loops.push_back(std::move(l));
    return {};
  });
}

Result<Value> set_loop(CommandContext& ctx, const Map& args) {
  return change_robot(ctx, args, [&](Robot& r) -> Result<void> {
    RMP_TRY_ASSIGN(LoopClosure * l, find_loop(r, text_of(args, "name")));
    return apply_loop(ctx, args, r, *l);
  });
}

Result<Value> remove_loop(CommandContext& ctx, const Map& args) {
  return change_robot(ctx, args, [&](Robot& r) -> Result<void> {
    RMP_TRY_ASSIGN(const LoopClosure* l, find_loop(r, text_of(args, "name")));
    r.loops.erase(r.loops.begin() + (l - r.loops.data()));
    return {};
  });
}

Result<Value> loops(CommandContext& ctx, const Map& args) {
  const Robot& r = content<Robot>(ctx, args);
  const auto side = [&r](std::int32_t link, const model::Placement& at) {
    return Map{
        {"link", link < 0 ? std::string("base") : r.links[static_cast<std::size_t>(link)].name},
        {"placement", placement_value(at)}};
  };
  List out;
  for (const LoopClosure& l : r.loops)
    out.emplace_back(Map{{"name", l.name},
                         {"kind", model::loop_word(l.kind)},
                         {"a", side(l.link_a, l.in_a)},
                         {"b", side(l.link_b, l.in_b)}});
  return Value(std::move(out));
}

Result<Value> loop_error(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const auto m, model_of(ctx, args));
  const Robot& r = content<Robot>(ctx, args);
  std::vector<double> q = robotics::home_joint_values(r);
  if (has(args, "q")) {
    RMP_TRY_ASSIGN(q, read_q(*args.find("q"), r, m->joints, "q"));
  }
  std::vector<Pose> frames(m->joints.size());
  robotics::forward_kinematics(*m, q, frames);
  std::vector<double> residual(robotics::loop_rows(*m));
  robotics::loop_residual(*m, frames, residual);
  std::vector<double> jacobian(residual.size() * m->dof());
  robotics::loop_jacobian(*m, frames, jacobian);
  const std::size_t rows = residual.size();
  return Value(Map{{"residual", NumericArray(std::move(residual), residual_array_unit(*m))},
                   {"jacobian", rows > 0 ? Value(NumericArray(std::move(jacobian), rows, m->dof()))
                                         : Value(List{})}});
}

/// The values of joints by the names of their links, into q; which velocities they hold.
Result<void> read_joints(const CommandContext& ctx, const Robot& r, const RobotModel& m,
                         const Value& given, std::vector<double>& q, std::vector<bool>& held) {
  (void)ctx;
  const Map* table = given.as_map();
  if (!table)
    return error(ErrorCode::invalid_argument, given.text() + " is not a table of joint values",
                 "Give them by name, such as {crank = \"30 deg\"}.", "joints");
  const auto links = robotics::link_joints(r);
  const auto units = robotics::coordinate_units(m);
  for (const auto& [name, value] : *table) {
    const std::string path = "joints." + name;
    RMP_TRY_ASSIGN(const std::int32_t index, read_link(r, Value(name), false, "joints"));
    const robotics::LinkJoints& own = links[static_cast<std::size_t>(index)];
    if (own.q_count == 0)
      return error(ErrorCode::invalid_argument, "link " + text::quote(name) + " has no coordinate",
                   "It is fixed, or its joint follows another one.", path);
    std::vector<double> values;
    if (own.q_count == 1) {
      const std::string unit(units[static_cast<std::size_t>(own.q)]);
      RMP_TRY_ASSIGN(const Value read, check_value(field("", "real", unit, ""), value, path));
      values = {read.number()};
    } else {
      values = reals(&value);
    }
    if (values.size() != static_cast<std::size_t>(own.q_count))
      return error(ErrorCode::invalid_argument,
                   count_given(values.size(), "number") + " for the joint of link " +
                       text::quote(name) + ", which has " + std::to_string(own.q_count),
                   "robot.coordinates lists them.", path);
    std::copy(values.begin(), values.end(), q.begin() + own.q);
    std::fill_n(held.begin() + own.v, own.v_count, true);
  }
  return {};
}

Result<Value> close(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const auto m, model_of(ctx, args));
  const Robot& r = content<Robot>(ctx, args);
  std::vector<double> start = robotics::home_joint_values(r);
  if (has(args, "q")) {
    RMP_TRY_ASSIGN(start, read_q(*args.find("q"), r, m->joints, "q"));
  }
  std::vector<double> target = start;
  std::vector<bool> held = robotics::actuated_velocities(*m);
  if (has(args, "joints")) {
    held.assign(m->dof(), false);
    RMP_TRY(read_joints(ctx, r, *m, *args.find("joints"), target, held));
  }
  const robotics::Closure closed = robotics::close_loops(*m, start, target, held);
  if (!flag(args, "partial")) RMP_TRY(closed_or_fault(*m, closed));
  return Value(Map{{"q", NumericArray(closed.q, joint_array_unit(*m))},
                   {"closed", closed.is_closed},
                   {"residual", closed.residual},
                   {"iterations", static_cast<std::int64_t>(closed.iterations)}});
}

/// The fields of a loop; each side, a link with a frame, is one argument.
Schema loop_params(bool creating) {
  Schema s = led_by({"name", "kind"},
                    without(record_params("robot", "loops"), {"link_a", "link_b", "a", "b"}));
  param_named(s, "name").required = true;
  param_named(s, "kind").required = creating;
  for (const char* side : {"b", "a"}) {
    ParamSpec p = optional(side, "map", "",
                           "A frame on a link: {link = name, number or \"base\", and position with "
                           "angles or placement}.");
    p.required = creating;
    s.insert(s.begin() + 2, std::move(p));
  }
  s.insert(s.begin(), self("robot"));
  return s;
}

}  // namespace

RMP_COMMANDS(robot_loop_commands) {
  std::vector<CommandSpec> all;
  const ParamSpec name = needed("name", "string", "", "Name of the loop, unique in the robot.");
  all.push_back(
      {.name = "robot.add_loop",
       .classic = "",
       .summary = "Closes a loop: a frame on one link stays together with a frame on another.",
       .details = "The links of a robot form a tree; loops are additional constraints. The tree is "
                  "cut at one joint of each loop, which becomes this closure. Joints without "
                  "motors are marked with passive = true.",
       .example = with_four_bar("assert(#bar:loops() == 1)"),
       .params = loop_params(true),
       .returns = {},
       .effect = Effect::edits,
       .run = add_loop});
  all.push_back({.name = "robot.set_loop",
                 .classic = "",
                 .summary = "Changes a loop.",
                 .details = "",
                 .example = with_four_bar("bar:set_loop{name = \"pin\", kind = \"revolute\"}\n"
                                          "assert(bar:loops()[1].kind == \"revolute\")"),
                 .params = loop_params(false),
                 .returns = {},
                 .effect = Effect::edits,
                 .run = set_loop});
  all.push_back({.name = "robot.remove_loop",
                 .classic = "",
                 .summary = "Removes a loop.",
                 .details = "",
                 .example = with_four_bar("bar:remove_loop(\"pin\")\nassert(#bar:loops() == 0)"),
                 .params = {self("robot"), name},
                 .returns = {},
                 .effect = Effect::edits,
                 .run = remove_loop});
  all.push_back({.name = "robot.loops",
                 .classic = "",
                 .summary = "Lists the loops of a robot.",
                 .details = "",
                 .example = with_four_bar("assert(bar:loops()[1].b.link == \"rocker\")"),
                 .params = {self("robot")},
                 .returns = {"list",
                             "",
                             "",
                             {field("name", "string", "", "Name."),
                              field("kind", "string", "", "point, revolute, planar or weld."),
                              field("a", "map", "", "Link and placement of frame a."),
                              field("b", "map", "", "Link and placement of frame b.")}},
                 .effect = Effect::reads,
                 .run = loops});
  all.push_back(
      {.name = "robot.loop_error",
       .classic = "",
       .summary = "Reports the errors of the loop closures, and their derivatives by the joints.",
       .details =
           "The residual has one number for each direction that a loop constrains: in the axes of "
           "frame a, the vector from its origin to that of frame b [m], then the rotation vector "
           "of frame b in frame a [rad]. The Jacobian is its derivative by the velocities.",
       .example = with_four_bar("local e = bar:loop_error{q = {0, 0, 0}}\n"
                                "assert(math.abs(e.residual[1] - 0.2) < 1e-12)"),
       .params = {self("robot"), optional("q", "any", "rad or m",
                                          "Configuration or name of a pose; \"home\" if omitted.")},
       .returns = {"map",
                   "",
                   "",
                   {field("residual", "real[]", "m or rad", "Zero if the loops are closed."),
                    field("jacobian", "matrix", "",
                          "One row per number of the residual, one column per velocity.")}},
       .effect = Effect::reads,
       .run = loop_error});
  all.push_back(
      {.name = "robot.close",
       .classic = "",
       .summary = "Finds a configuration in which all loops are closed.",
       .details = "Joints with motors keep their values in q and the passive ones move; with "
                  "`joints`, exactly the joints named there are held and all others are free, so "
                  "that the motors of a platform can be computed from its pose as well. The held "
                  "joints move from the start to their values in small steps, and the others "
                  "follow by Newton's method, so that the branch of the start is kept.",
       .example = with_four_bar(
           "local c = bar:close{joints = {crank = \"90 deg\"}}\n"
           "assert(c.closed and c.residual < 1e-12 and math.abs(c.q[1] - math.pi / 2) < 1e-15)"),
       .params = {self("robot"),
                  optional("q", "any", "rad or m",
                           "Start: a configuration or the name of a pose; \"home\" if omitted."),
                  optional("joints", "map", "",
                           "Values of the joints to hold, by the names of their links; for a joint "
                           "of several coordinates, all of them."),
                  defaulted("partial", "bool", "", false,
                            "Return the nearest configuration even if the loops cannot be closed "
                            "or a joint exceeds its limits.")},
       .returns = {"map",
                   "",
                   "",
                   {field("q", "real[]", "rad, m or 1", "The configuration."),
                    field("closed", "bool", "", "Whether all loops are closed."),
                    field("residual", "real", "m or rad", "Greatest number of the residual."),
                    field("iterations", "int", "", "Newton steps taken.")}},
       .effect = Effect::reads,
       .run = close});
  return all;
}

}  // namespace robomosp::ioci
