// SPDX-License-Identifier: Apache-2.0
// The axes of a robot as its maker counts them: changed, shown, and joints from them.
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "ioci/core/record_params.h"
#include "ioci/robot/array_units.h"
#include "ioci/robot/robots.h"
#include "ioci/robot/shown_robot.h"
#include "kernel/type.h"
#include "robotics/home.h"
#include "robotics/maker_axes.h"

namespace robomosp::ioci {
namespace {

using model::AxisUnit;
using model::MakerAxis;
using model::Robot;

constexpr const char* kJointType = "member:joint of id or int";

Schema coupling_params() {
  Schema s = record_params("robot", "axes.coupled");
  ParamSpec& link = param_named(s, "link");
  link.type = kJointType;
  link.required = true;
  param_named(s, "ratio").default_value = Value(1.0);
  return s;
}

Schema maker_axis_params() {
  Schema s = record_params("robot", "axes");
  param_named(s, "name").required = true;
  ParamSpec& link = param_named(s, "link");
  link.type = kJointType;
  link.required = true;
  param_named(s, "sign").default_value = Value(1);
  param_named(s, "offset").default_value = Value(0.0);
  param_named(s, "unit").default_value = Value(std::string(model::kAxisUnitWords.front()));
  param_named(s, "external").default_value = Value(false);
  param_named(s, "coupled").type = "list<" + map_type(coupling_params()) + ">";
  return s;
}

std::string axis_type() { return map_type(maker_axis_params()); }
const NamedType kAxisType("axis", "map", axis_type);

Result<MakerAxis> read_maker_axis(const CommandContext& ctx, const Robot& r, const Value& given,
                                  const std::string& path) {
  MakerAxis a;
  if (const Map* table = given.as_map())
    if (const Value* unit = table->find("unit"); unit && unit->as_string())
      a.unit = *unit->as_string() == "mm" ? AxisUnit::mm : AxisUnit::deg;
  // The unit of its numbers follows its own.
  static const std::array<Schema, 2> kSchemas{plain_params(maker_axis_params(), 0),
                                              plain_params(maker_axis_params(), 1)};
  RMP_TRY_ASSIGN(const Map checked,
                 read_map(ctx, kSchemas[a.unit == AxisUnit::mm ? 1 : 0], given, path));
  RMP_TRY(set_fields(a, checked));
  RMP_TRY_ASSIGN(a.link, read_link(r, *checked.find("link"), false, path + ".link"));
  if (a.sign == 0)
    return error(ErrorCode::invalid_argument, "the sign of axis " + text::quote(a.name) + " is 0",
                 "It is 1 or -1.", path + ".sign");
  if (!has(checked, "coupled")) return a;
  static const Schema kCoupled = plain_params(coupling_params());
  const List& list = *checked.find("coupled")->as_list();
  for (std::size_t i = 0; i < list.size(); ++i) {
    const std::string at = path + ".coupled[" + std::to_string(i + 1) + "]";
    RMP_TRY_ASSIGN(const Map one, read_map(ctx, kCoupled, list[i], at));
    model::AxisCoupling c;
    RMP_TRY(set_fields(c, one));
    RMP_TRY_ASSIGN(c.link, read_link(r, *one.find("link"), false, at + ".link"));
    a.coupled.push_back(c);
  }
  return a;
}

Result<Value> set_axes(CommandContext& ctx, const Map& args) {
  return change_robot(ctx, args, [&](Robot& r) { return give_axes(ctx, r, *args.find("axes")); });
}

Error no_axes(CommandContext& ctx, const Map& args) {
  return no_maker_axes(ctx, typed<Robot>(args));
}

/// A value of an axis [degrees or mm]: a number as the pendant shows it, or a text with a unit.
Result<double> axis_number(const PostAxis& a, const Value& given, const std::string& path) {
  std::optional<double> bare;
  if (given.is_number()) bare = given.number();
  else if (const std::string* word = given.as_string()) bare = text::read_real(*word);
  if (!bare) {
    RMP_TRY_ASSIGN(const Value v,
                   check_value(field("", "real", a.linear ? "m" : "rad", ""), given, path));
    bare = v.number() * axis_scale(a, nullptr);
  }
  if (!std::isfinite(*bare))
    return error(ErrorCode::invalid_argument, text::print(*bare) + " is not a finite number", {},
                 path);
  return *bare;
}

Error unknown_axis(const robotics::MakerAxes& maker, const std::string& name,
                   const std::string& path) {
  std::vector<std::string> known;
  for (const PostAxis& a : maker.axes()) known.emplace_back(a.name);
  Error e = unknown_name("axis", name, known);
  if (e.hint.empty()) e.hint = "It has " + text::enumerate(known) + ".";
  return std::move(e).in(path);
}

/// Moves one axis, as the keys of a pendant do: the other axes keep their values.
Result<Value> jog(CommandContext& ctx, const Map& args) {
  const Robot& r = content<Robot>(ctx, args);
  RMP_TRY_ASSIGN(const robotics::MakerAxes maker, robotics::MakerAxes::of(r));
  if (!maker.known()) {
    Error e = no_axes(ctx, args);
    e.hint += " robot.add_joint moves a joint.";
    return e;
  }
  const std::string where = name_in(ctx, ref(args, "id")), name = text_of(args, "axis");
  const PostAxis* const axis = maker.find(name);
  if (!axis) return unknown_axis(maker, name, "axis").in(where);
  if (has(args, "to") == has(args, "by"))
    return error(ErrorCode::invalid_argument,
                 has(args, "to") ? "both to and by are given" : "neither to nor by is given",
                 "Give to, the value of the axis, or by, what is added to it.", where);
  const char* const how = has(args, "to") ? "to" : "by";
  auto number = axis_number(*axis, *args.find(how), how);
  if (!number.ok()) return std::move(number).error().in(where);
  RMP_TRY_ASSIGN(const ShownRobot s, shown_robot(ctx, args));
  const auto there = axis_value(*axis, s.q, nullptr);
  if (!there)
    return error(ErrorCode::conflict,
                 "the world shows it with " + std::to_string(s.q.size()) + " joint values",
                 "robot.set_joints sets all values of the robot.", where);
  const double value = has(args, "to") ? *number : *there + *number;
  auto q = read_axis_values(r, Value(Map{{name, value}}), s.q, how);
  if (!q.ok()) return std::move(q).error().in(where);
  const Map axes = axis_map(maker, *q);
  RMP_TRY_ASSIGN(const Value joints, put_joints(ctx, args, s, std::move(*q)));
  return Value(Map{{"axes", axes}, {"q", joints}});
}

Result<Value> axes(CommandContext& ctx, const Map& args) {
  const Robot& r = content<Robot>(ctx, args);
  RMP_TRY_ASSIGN(const robotics::MakerAxes maker, robotics::MakerAxes::of(r));
  std::vector<double> q = robotics::home_joint_values(r);
  if (has(args, "q")) {
    RMP_TRY_ASSIGN(const auto m, model_of(ctx, args));
    RMP_TRY_ASSIGN(q, read_q(*args.find("q"), r, m->joints, "q"));
  } else if (auto shown = shown_robot(ctx, args); shown.ok()) {
    q = shown->q;
  } else if (has(args, "world")) {
    return std::move(shown).error();
  }
  const std::vector<double> values = maker.values(q);
  List out;
  for (std::size_t i = 0; i < r.axes.size(); ++i) {
    const MakerAxis& a = r.axes[i];
    const PostAxis& x = maker.axes()[i];
    List coupled;
    for (const model::AxisCoupling& c : a.coupled)
      coupled.emplace_back(
          Map{{"link", r.links[static_cast<std::size_t>(c.link)].name}, {"ratio", c.ratio}});
    Map row{{"name", a.name},
            {"value", values[i]},
            {"unit", std::string(model::kAxisUnitWords[static_cast<std::size_t>(a.unit)])},
            {"link", r.links[static_cast<std::size_t>(a.link)].name},
            {"sign", static_cast<std::int64_t>(a.sign)},
            {"offset", x.offset},
            {"external", a.external}};
    if (!coupled.empty()) row.set("coupled", std::move(coupled));
    if (x.lower < x.upper) {
      row.set("lower", x.lower);
      row.set("upper", x.upper);
    }
    out.emplace_back(std::move(row));
  }
  return Value(std::move(out));
}

Result<Value> joints_from_axes(CommandContext& ctx, const Map& args) {
  const Robot& r = content<Robot>(ctx, args);
  RMP_TRY_ASSIGN(const robotics::MakerAxes maker, robotics::MakerAxes::of(r));
  if (!maker.known()) return no_axes(ctx, args);
  const std::vector<double> values = reals(args.find("values"));
  RMP_TRY(check_size(values, "values"));
  auto q = maker.joints(values);
  if (!q.ok()) return std::move(q).error().in(name_in(ctx, ref(args, "id")));
  return Value(NumericArray(std::move(*q), joint_array_unit(r)));
}

}  // namespace

Map axis_map(const robotics::MakerAxes& maker, std::span<const double> q) {
  Map out;
  const std::vector<double> values = maker.values(q);
  for (std::size_t i = 0; i < values.size(); ++i)
    out.set(std::string(maker.axes()[i].name), values[i]);
  return out;
}

Error no_maker_axes(const CommandContext& ctx, RobotId robot) {
  return error(ErrorCode::not_found, "the maker's axes of this robot are unknown",
               "Set their names, signs and offsets with robot.set_axes.",
               name_in(ctx, AnyId(robot)));
}

ParamSpec axis_values() {
  return optional("axes", "any", "deg or mm",
                  "Values of the maker's axes instead of q: a list of all in their order, or a "
                  "table by name, in which axes left out keep their values.");
}

Result<void> one_of_joints_and_axes(const CommandContext& ctx, const Map& args, RobotId id,
                                    const Robot& robot) {
  if (has(args, "q") == has(args, "axes"))
    return error(ErrorCode::invalid_argument,
                 has(args, "q") ? "both q and axes are given" : "no joint values are given",
                 robot.axes.empty() ? "Give q: joint values, or the name of a pose."
                                    : "Give q, joint values or the name of a pose, or axes, values "
                                      "of the maker's axes.",
                 name_in(ctx, AnyId(id)));
  if (has(args, "axes") && robot.axes.empty()) return no_maker_axes(ctx, id);
  return {};
}

Result<std::vector<double>> read_axis_values(const Robot& robot, const Value& given,
                                             std::span<const double> q, std::string_view path) {
  const std::string at(path);
  RMP_TRY_ASSIGN(const robotics::MakerAxes maker, robotics::MakerAxes::of(robot));
  const std::size_t n = maker.axes().size();
  std::vector<double> values = maker.values(q);
  if (const Map* named = given.as_map()) {
    for (const auto& [name, v] : *named) {
      const PostAxis* const axis = maker.find(name);
      if (!axis) return unknown_axis(maker, name, at);
      RMP_TRY_ASSIGN(values[static_cast<std::size_t>(axis - maker.axes().data())],
                     axis_number(*axis, v, at + "." + name));
    }
  } else {
    List all;
    if (const List* list = given.as_list()) all = *list;
    else if (const NumericArray* a = given.as_array())
      for (const double x : a->data()) all.emplace_back(x);
    else if (given.is_number()) all.push_back(given);
    if (all.size() != n)
      return error(ErrorCode::invalid_argument,
                   std::to_string(all.size()) + " values are given, but the robot has " +
                       std::to_string(n) + " axes",
                   "Give one value an axis, in degrees or mm, or a table of values by the names "
                   "of the axes.",
                   at);
    for (std::size_t i = 0; i < n; ++i) {
      RMP_TRY_ASSIGN(values[i],
                     axis_number(maker.axes()[i], all[i], at + "[" + std::to_string(i + 1) + "]"));
    }
  }
  auto joints = maker.joints(values);
  if (!joints.ok()) return std::move(joints).error().in(at);
  RMP_TRY(check_size(*joints, at));
  return std::move(*joints);
}

Result<void> give_axes(const CommandContext& ctx, Robot& r, const Value& given) {
  std::vector<MakerAxis> all;
  const List& list = *given.as_list();
  for (std::size_t i = 0; i < list.size(); ++i) {
    RMP_TRY_ASSIGN(MakerAxis a,
                   read_maker_axis(ctx, r, list[i], "axes[" + std::to_string(i + 1) + "]"));
    all.push_back(std::move(a));
  }
  r.axes = std::move(all);
  if (auto made = robotics::MakerAxes::of(r); !made.ok()) return std::move(made).error();
  return {};
}

RMP_COMMANDS(robot_axes_commands) {
  std::vector<CommandSpec> all;
  // FANUC: the pendant's J3 counts from the horizontal.
  const std::string fanuc =
      "local arm = robot.create{name = \"fanuc\", links = {\n"
      "  {name = \"turn\", d = 0.45, alpha = \"-90 deg\", a = 0.15},\n"
      "  {name = \"upper\", a = 0.6, theta = \"-90 deg\"}, {name = \"fore\", a = 0.64}}}\n"
      "arm:set_axes{axes = {{name = \"J1\", link = \"turn\"}, {name = \"J2\", link = \"upper\"},\n"
      "  {name = \"J3\", link = \"fore\", sign = -1, offset = \"90 deg\",\n"
      "   coupled = {{link = \"upper\", ratio = -1}}}}}\n";
  all.push_back(
      {.name = "robot.set_axes",
       .classic = "",
       .summary = "Sets the axes of a robot as its maker names and counts them.",
       .details =
           "Value = sign * joint + offset, plus the coupled joints times their ratios: FANUC's J3 "
           "is measured from the horizontal, whatever J2 is. Controllers show these values, and "
           "posts, limits and configurations use them. The axes are in the controller's order; "
           "every joint has one. An empty list removes them: they are then unknown.",
       .example = fanuc + "assert(math.abs(arm:axes{q = {0, 0, math.pi/2}}[3].value) < 1e-9)",
       .params = {self("robot"),
                  needed("axes", "list", "",
                         "One table each: name, link, sign, offset (rad or m; \"90 deg\"), "
                         "coupled, unit (deg or mm), external, lower, upper.")},
       .returns = {},
       .effect = Effect::edits,
       .run = set_axes});
  all.push_back(
      {.name = "robot.axes",
       .classic = "",
       .summary =
           "Returns the maker's axes of a robot with their values, as its controller shows them.",
       .details = "Values, offsets and limits are in degrees and mm. The list is empty if the axes "
                  "are not known.",
       .example = fanuc + "local a = arm:axes{q = {0, \"31.324 deg\", \"92.018 deg\"}}\n"
                          "assert(a[3].name == \"J3\" and math.abs(a[3].value + 33.342) < 1e-9)",
       .params = {self("robot"),
                  optional("q", "any", "rad or m",
                           "Joint values, one per joint, or the name of a pose; by default those "
                           "at which the only world with the robot shows it, or its home."),
                  shown_world()},
       .returns = {"list",
                   "",
                   "",
                   {field("name", "string", "", "The maker's name."),
                    field("value", "real", "deg or mm", "Its value."),
                    field("unit", "string", "", "deg or mm."),
                    field("link", "string", "", "Link moved by its joint."),
                    field("sign", "int", "", "Sign of the joint value, 1 or -1."),
                    field("offset", "real", "deg or mm", "Its value at joint value 0."),
                    field("external", "bool", "", "Whether it is an external axis."),
                    field("coupled", "list", "", "Coupled joints: link, ratio."),
                    field("lower", "real", "deg or mm", "Least value; absent if unlimited."),
                    field("upper", "real", "deg or mm", "Greatest value.")}},
       .effect = Effect::reads,
       .run = axes});
  all.push_back(
      {.name = "robot.jog",
       .classic = "",
       .summary = "Moves one of the maker's axes at which a world shows the robot.",
       .details = "As the keys of a pendant do: the other axes keep their values. Where an axis "
                  "counts several joints, such as FANUC's J3, these move together.",
       .example =
           fanuc +
           "world.create{name = \"cell\"}:add_robot{robot = arm}\n"
           "arm:jog{axis = \"J2\", to = 30}\n"
           "local now = arm:jog{axis = \"J2\", by = \"-10 deg\"}\n"
           "assert(math.abs(now.axes.J2 - 20) < 1e-9 and math.abs(now.axes.J3 - 90) < 1e-9)\n"
           "assert(math.abs(now.q[3] + math.rad(20)) < 1e-12)",
       .params = {self("robot"), needed("axis", "string", "", "The maker's name, such as A2."),
                  optional("to", "any", "deg or mm", "Its value; a text may have another unit."),
                  optional("by", "any", "deg or mm", "Or what is added to its value."),
                  shown_world()},
       .returns = {"map",
                   "",
                   "",
                   {field("axes", "map", "", "Values of all axes now by name [deg or mm]."),
                    field("q", "real[]", "rad or m", "The joint values now.")}},
       .effect = Effect::edits,
       .run = jog});
  all.push_back({.name = "robot.joints_from_axes",
                 .classic = "",
                 .summary = "Returns the joint values of a robot at values of the maker's axes.",
                 .details = "The inverse of robot.axes: converts values of a teach pendant to q.",
                 .example = fanuc + "local q = arm:joints_from_axes{0, 31.324, -33.342}\n"
                                    "assert(math.abs(q[3] - math.rad(92.018)) < 1e-12)",
                 .params = {self("robot"), needed("values", "any", "deg or mm",
                                                  "One value per axis, in their order.")},
                 .returns = {"array", "rad or m", "", {}},
                 .effect = Effect::reads,
                 .run = joints_from_axes});
  return all;
}

}  // namespace robomosp::ioci
