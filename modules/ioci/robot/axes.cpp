// SPDX-License-Identifier: Apache-2.0
// The axes of a robot as its maker counts them: changed, shown, and joints from them.
#include <utility>

#include "ioci/robot/array_units.h"
#include "ioci/robot/robots.h"
#include "ioci/robot/shown_robot.h"
#include "robotics/home.h"
#include "robotics/maker_axes.h"

namespace robomosp::ioci {
namespace {

using model::AxisUnit;
using model::MakerAxis;
using model::Robot;

ParamSpec of_unit(ParamSpec p, AxisUnit unit) {
  p.unit = unit == AxisUnit::mm ? "m" : "rad";
  return p;
}

/// Fields of an axis; the unit of its numbers follows its own.
Schema maker_axis_schema(AxisUnit unit) {
  return Schema{
      needed("name", "string", "", "The maker's name, such as A1."),
      needed("link", "any", "", "Name or number of the link that its joint moves."),
      between(
          defaulted("sign", "int", "", 1, "1, or -1 if the axis counts in the opposite direction."),
          -1, 1),
      of_unit(defaulted("offset", "real", "rad", 0.0, "Value of the axis at joint value 0."), unit),
      optional("coupled", "list", "", "Coupled joints: {link = ..., ratio = 1}."),
      choice("unit", {"deg", "mm"}, "mm for a prismatic joint."),
      defaulted("external", "bool", "", false, "Whether it is an external axis of the controller."),
      of_unit(
          unbounded(optional("lower", "real", "rad", "Least value; by default that of the joint.")),
          unit),
      of_unit(unbounded(optional("upper", "real", "rad", "Greatest value.")), unit)};
}

Result<MakerAxis> read_maker_axis(const CommandContext& ctx, const Robot& r, const Value& given,
                                  const std::string& path) {
  MakerAxis a;
  if (const Map* table = given.as_map())
    if (const Value* unit = table->find("unit"); unit && unit->as_string())
      a.unit = *unit->as_string() == "mm" ? AxisUnit::mm : AxisUnit::deg;
  RMP_TRY_ASSIGN(const Map checked, read_map(ctx, maker_axis_schema(a.unit), given, path));
  a.name = text_of(checked, "name");
  RMP_TRY_ASSIGN(a.link, read_link(r, *checked.find("link"), false, path + ".link"));
  a.sign = static_cast<std::int32_t>(integer(checked, "sign"));
  if (a.sign == 0)
    return error(ErrorCode::invalid_argument, "the sign of axis " + text::quote(a.name) + " is 0",
                 "It is 1 or -1.", path + ".sign");
  a.offset = real(checked, "offset");
  a.external = flag(checked, "external");
  if (has(checked, "lower")) a.lower = real(checked, "lower");
  if (has(checked, "upper")) a.upper = real(checked, "upper");
  if (!has(checked, "coupled")) return a;
  static const Schema kCoupled{
      needed("link", "any", "", "Name or number of the link moved by the coupled joint."),
      defaulted("ratio", "real", "", 1.0, "Factor of that joint's value.")};
  const List& list = *checked.find("coupled")->as_list();
  for (std::size_t i = 0; i < list.size(); ++i) {
    const std::string at = path + ".coupled[" + std::to_string(i + 1) + "]";
    RMP_TRY_ASSIGN(const Map one, read_map(ctx, kCoupled, list[i], at));
    model::AxisCoupling c;
    RMP_TRY_ASSIGN(c.link, read_link(r, *one.find("link"), false, at + ".link"));
    c.ratio = real(one, "ratio");
    a.coupled.push_back(c);
  }
  return a;
}

Result<Value> set_axes(CommandContext& ctx, const Map& args) {
  return change_robot(ctx, args, [&](Robot& r) { return give_axes(ctx, r, *args.find("axes")); });
}

Error no_axes(CommandContext& ctx, const Map& args) {
  return error(ErrorCode::not_found, "the maker's axes of this robot are unknown",
               "Set their names, signs and offsets with robot.set_axes.",
               name_in(ctx, ref(args, "id")));
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
