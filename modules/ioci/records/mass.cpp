// SPDX-License-Identifier: Apache-2.0
// Mass in detail: part by part, measured instead of computed, and as a link's parameters.
#include <cmath>

#include "ioci/core/commands.h"
#include "spatial/mass.h"
#include "spatial/pose.h"

namespace robomosp::ioci {
namespace {

Result<Value> mass_table(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const auto parts,
                 ctx.app.derived.part_masses(ctx.snapshot(), ref(args, "id"), ctx.progress));
  List out;
  for (const evaluation::PartMass& p : parts) {
    Map row{{"part", p.name}, {"solid", ref_value(ctx.snapshot(), p.solid)}};
    if (p.material) row.set("material", ref_value(ctx.snapshot(), p.material));
    row.set("density", p.density);
    row.set("volume", p.volume);
    row.set("mass", p.mass.mass);
    row.set("com", vec_value(p.mass.com, "m"));
    row.set("inertia", sym_value(p.mass.inertia, "kg m^2"));
    out.emplace_back(std::move(row));
  }
  return Value(std::move(out));
}

/// {Ixx, Iyy, Izz, Ixy, Iyz, Ixz} or a symmetric 3x3 matrix.
Result<Sym3> read_inertia(const Value& value) {
  std::vector<double> v = reals(&value);
  const NumericArray* array = value.as_array();
  const List* list = value.as_list();
  if (list && list->size() == 3) {
    v.clear();
    for (const Value& row : *list)
      for (const double x : reals(&row)) v.push_back(x);
  }
  for (const double x : v)
    if (!std::isfinite(x))
      return error(ErrorCode::invalid_argument, "an element of the inertia is not a finite number",
                   {}, "inertia");
  if (v.size() == 6) return Sym3{v[0], v[1], v[2], v[3], v[4], v[5]};
  if (v.size() == 9 && (list || (array && array->rows() == 3))) {
    const auto differs = [&](std::size_t i, std::size_t j) {
      return std::fabs(v[i] - v[j]) > 1e-9 * (std::fabs(v[0]) + std::fabs(v[4]) + std::fabs(v[8]));
    };
    if (!differs(1, 3) && !differs(5, 7) && !differs(2, 6))
      return Sym3{v[0], v[4], v[8], v[1], v[5], v[2]};
  }
  return error(ErrorCode::invalid_argument, "this is not an inertia",
               "Give {Ixx, Iyy, Izz, Ixy, Iyz, Ixz} or a symmetric 3x3 matrix, elements of the "
               "tensor about the centre of mass [kg m^2].",
               "inertia");
}

Result<Value> set_measured(CommandContext& ctx, const Map& args) {
  model::MeasuredMass measured;
  measured.mass.mass = real(args, "mass");
  measured.mass.com = vec3(args, "com");
  measured.source = text_of(args, "source");
  if (has(args, "inertia")) {
    RMP_TRY_ASSIGN(measured.mass.inertia, read_inertia(*args.find("inertia")));
  }
  const AnyId id = ref(args, "id");
  // What was not measured stays as computed, the inertia in proportion to the mass.
  if (!has(args, "com") || !has(args, "inertia")) {
    RMP_TRY_ASSIGN(const auto b, ctx.app.derived.mass(ctx.snapshot(), id, ctx.progress));
    const MassProperties& computed = b.computed ? *b.computed : b.mass;
    if (!(computed.mass > 0))
      return error(ErrorCode::invalid_argument,
                   "centre of mass and inertia cannot be computed, since it has no material",
                   "Give com and inertia too, or a material.", name_in(ctx, id));
    if (!has(args, "com")) measured.mass.com = computed.com;
    if (!has(args, "inertia"))
      measured.mass.inertia = spatial::scale(computed.inertia, measured.mass.mass / computed.mass);
  }
  RMP_TRY(ctx.edit().edit(id, [&](model::Record& r) -> Result<void> {
    if (auto* solid = std::get_if<model::Solid>(&r.body)) solid->measured = measured;
    else std::get<model::Object>(r.body).measured = measured;
    return {};
  }));
  return Value();
}

Result<Value> clear_measured(CommandContext& ctx, const Map& args) {
  RMP_TRY(ctx.edit().edit(ref(args, "id"), [&](model::Record& r) -> Result<void> {
    if (auto* solid = std::get_if<model::Solid>(&r.body)) solid->measured.reset();
    else std::get<model::Object>(r.body).measured.reset();
    return {};
  }));
  return Value();
}

/// Mass, com and inertia with the ten parameters that are linear in the equations of motion.
Map link_map(const MassProperties& m) {
  const auto p = spatial::inertial_parameters(m);
  return Map{{"mass", m.mass},
             {"com", vec_value(m.com, "m")},
             {"inertia", sym_value(m.inertia, "kg m^2")},
             {"inertia_origin", sym_value(spatial::inertia_about(m, Vec3{}), "kg m^2")},
             {"first_moment", vec_value(spatial::scale(m.com, m.mass), "kg m")},
             {"parameters", NumericArray(std::vector<double>(p.begin(), p.end()))}};
}

Result<Value> link_mass(CommandContext& ctx, const Map& args) {
  const auto& robot = content<model::Robot>(ctx, args);
  RMP_TRY_ASSIGN(const std::int32_t index, read_link(robot, *args.find("link"), false, "link"));
  const model::Link& link = robot.links[static_cast<std::size_t>(index)];
  RMP_TRY_ASSIGN(const auto parts, ctx.app.derived.mass(ctx.snapshot(), link.parts, ctx.progress));
  const bool weighs = parts.mass.mass > 0;
  const bool designs = robot.mass_source == model::MassSource::designed && weighs;
  MassProperties used;
  if (designs) used = parts.mass;
  else if (link.given) used = *link.given;
  Map out = link_map(used);
  out.set("link", link.name);
  out.set("source", designs ? "designed" : link.given ? "given" : "none");
  if (weighs) out.set("designed", mass_value(parts.mass));
  if (link.given) out.set("given", mass_value(*link.given));
  return Value(std::move(out));
}

std::string with_pin(const char* rest) {
  return std::string(
             "material.create{name = \"steel\", density = 7850}\n"
             "local pin = solid.create{name = \"pin\", material = \"steel\", root = {kind = "
             "\"cylinder\", radius = 0.01, height = 0.05}}\n"
             "local bolt = object.create{name = \"bolt\", parts = {{what = \"pin\", name = "
             "\"shank\"}, {what = \"pin\", name = \"head\", position = {0, 0, 0.05}}}}\n") +
         rest;
}

}  // namespace

RMP_COMMANDS(mass_commands) {
  std::vector<CommandSpec> all;
  all.push_back(
      {.name = "object.mass_table",
       .classic = "",
       .summary = "Lists the contribution of each solid to the computed mass of an object.",
       .details = "In the order of the parts, with nested objects resolved (\"gripper.finger\"). "
                  "If overlaps count once, the volume excludes what earlier parts already cover. "
                  "The rows add up to the mass.",
       .example = with_pin("local t = bolt:mass_table()\nassert(#t == 2 and math.abs(t[1].mass + "
                           "t[2].mass - bolt:mass().mass) < 1e-12)"),
       .params = {self("object")},
       .returns = {"list",
                   "",
                   "One row per solid.",
                   {field("part", "string", "", "Name of the part."),
                    field("solid", "string", "", "Its solid."),
                    field("material", "string", "", "Its material; nil if it has none."),
                    field("density", "real", "kg/m^3", "Density of the material."),
                    field("volume", "real", "m^3", "Volume that counts."),
                    field("mass", "real", "kg", "Mass."),
                    field("com", "vec3", "m", "Centre of mass in the object's frame."),
                    field("inertia", "matrix", "kg m^2",
                          "Inertia about that centre, in the axes of the object's frame.")}},
       .effect = Effect::reads,
       .run = mass_table});
  for (const char* kind : {"solid", "object"}) {
    const std::string name = kind == std::string("solid") ? "pin" : "bolt";
    const std::string article = kind == std::string("solid") ? "a solid" : "an object";
    all.push_back(
        {.name = std::string(kind) + ".set_measured",
         .classic = "",
         .summary = "Sets the mass of " + article + " to that measured on the real part.",
         .details = "It replaces the computed mass wherever this record is used; " +
                    std::string(kind) +
                    ".mass shows both. In the frame of the record. Omitted values stay as "
                    "computed, the inertia in proportion to the mass.",
         .example =
             with_pin((name + ":set_measured{mass = 0.2, source = \"scales\"}\nassert(" + name +
                       ":mass().mass == 0.2 and " + name + ":mass().computed.mass < 0.3)")
                          .c_str()),
         .params = {self(kind), above_zero(needed("mass", "real", "kg", "Mass.")),
                    optional("com", "vec3", "m", "Centre of mass."),
                    optional("inertia", "any", "kg m^2",
                             "About the centre of mass: {Ixx, Iyy, Izz, Ixy, Iyz, Ixz} or a 3x3 "
                             "matrix, elements of the tensor."),
                    optional("source", "string", "",
                             "Source of the measurement: method and person.")},
         .returns = {},
         .effect = Effect::edits,
         .run = set_measured});
    all.push_back(
        {.name = std::string(kind) + ".clear_measured",
         .classic = "",
         .summary = "Restores the computed mass of " + article + ".",
         .details = "",
         .example = with_pin((name + ":set_measured{mass = 0.2}\n" + name +
                              ":clear_measured()\nassert(" + name + ":mass().computed == nil)")
                                 .c_str()),
         .params = {self(kind)},
         .returns = {},
         .effect = Effect::edits,
         .run = clear_measured});
  }
  all.push_back(
      {.name = "robot.link_mass",
       .classic = "",
       .summary = "Returns the mass of a link in its frame with its ten inertial parameters.",
       .details =
           "By the robot's mass source: the published values, or the designed parts together (with "
           "their measured masses if any, and shared volume counted once, as in an object). "
           "parameters is m, m rx, m ry, m rz, Ixx, Iyy, Izz, Ixy, Iyz, Ixz about the origin of "
           "the link's frame: the torques are linear in them. robot.dynamics returns the drives.",
       .example = with_arm("local m = arm:link_mass(1)\nassert(m.mass == 5 and #m.parameters == "
                           "10)"),
       .params = {self("robot"), needed("link", "any", "", "Name or number of the link.")},
       .returns = {"map",
                   "",
                   "",
                   {field("link", "string", "", "Its name."),
                    field("source", "string", "", "given, designed or none."),
                    field("mass", "real", "kg", "Mass."),
                    field("com", "vec3", "m", "Centre of mass in the link's frame."),
                    field("inertia", "matrix", "kg m^2", "Inertia about the centre of mass."),
                    field("inertia_origin", "matrix", "kg m^2",
                          "Inertia about the frame's origin."),
                    field("first_moment", "vec3", "kg m", "Mass times centre of mass."),
                    field("parameters", "array", "", "The ten parameters, SI."),
                    field("given", "map", "", "The published values, if any."),
                    field("designed", "map", "", "Values of the parts, if they have mass.")}},
       .effect = Effect::reads,
       .run = link_mass});
  return all;
}

}  // namespace robomosp::ioci
