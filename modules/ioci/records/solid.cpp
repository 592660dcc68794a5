// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <set>

#include "io/native.h"
#include "ioci/core/commands.h"
#include "ioci/core/record_params.h"
#include "ioci/records/field_values.h"
#include "ioci/records/solid_nodes.h"

namespace robomosp::ioci {
namespace {

using model::Solid;
using model::SolidNode;

const Schema& solid_fields() {
  static const Schema all =
      led_by({"material", "chord"}, without(record_params("solid", ""), {"measured", "nodes"}));
  return all;
}

Result<Value> create_solid(CommandContext& ctx, const Map& args) {
  Solid s;
  RMP_TRY(set_fields(s, args));
  s.parametric = ctx.expressions.own();
  ctx.expressions.keep(s.parametric);
  RMP_TRY_ASSIGN(model::Branch tree, read_tree(ctx, *args.find("root"), {}, "root"));
  s.nodes = std::move(tree.nodes);
  s.parametric.expressions.merge(tree.expressions);
  RMP_TRY_ASSIGN(const auto id, ctx.edit().add(text_of(args, "name"), std::move(s)));
  return Value(Application::handle(id));
}

/// The value to set, with numbers instead of expressions, which wait in the context.
Result<Value> read_value(CommandContext& ctx, AnyId id, const std::string& path,
                         const Value& value) {
  const model::Body& body = ctx.snapshot().find(id)->body;
  const auto dot = path.find('.');
  const Solid& solid = std::get<Solid>(body);
  const auto node =
      dot == std::string::npos ? std::nullopt : model::find_node(solid, path.substr(0, dot));
  if (!node || solid.nodes[*node].kind != CsgKind::custom)
    return ctx.expressions.read_at(body, path, value);
  const std::string field = path.substr(dot + 1);
  if (field == "primitive") return read_primitive(ctx, value, path, path);
  if (field.starts_with("primitive."))
    return read_primitive_param(ctx, solid.nodes[*node], field.substr(10), value, path);
  return ctx.expressions.read_at(body, path, value);
}

Result<Value> set_solid(CommandContext& ctx, const Map& args) {
  const std::string path = text_of(args, "path");
  const AnyId id = ref(args, "id");
  auto read = read_value(ctx, id, path, *args.find("value"));
  if (!read.ok()) return std::move(read).in(name_in(ctx, id)).error();
  const Value& value = *read;
  RMP_TRY_ASSIGN(const bool is_done, set_component(ctx, id, path, value));
  if (is_done) return Value();
  auto done = change<Solid>(ctx, id, [&](Solid& s) -> Result<void> {
    ctx.expressions.keep(s.parametric);
    const auto dot = path.find('.');
    if (dot == std::string::npos) {
      for (const ParamSpec& p : solid_fields()) {
        if (p.name != path) continue;
        if (path == "material" &&
            (value.is_nil() || (value.as_string() && value.as_string()->empty()))) {
          s.material = {};
          return {};
        }
        RMP_TRY_ASSIGN(const Map checked, read_map(ctx, Schema{p}, Value(Map{{path, value}}), ""));
        return set_fields(s, checked);
      }
      std::vector<std::string> known{"material", "chord", "description"};
      for (const SolidNode& n : s.nodes)
        known.push_back(n.name + "." +
                        (csg_size_count(n.kind) > 0 ? std::string(csg_info(n.kind).sizes[0].name)
                                                    : std::string("placement")));
      return unknown_name("field", path, known);
    }
    RMP_TRY_ASSIGN(const std::size_t node, need_node(s, path.substr(0, dot)));
    return set_node_field(ctx, s, node, path.substr(dot + 1), value, path);
  });
  if (!done.ok() && done.error().code == ErrorCode::unknown_name &&
      model::find(model::content(ctx.snapshot().find(id)->body), path))
    done = set_path(ctx, id, path, *args.find("value"));
  if (!done.ok()) return std::move(done).in(name_in(ctx, id)).error();
  return Value();
}

/// Levels of the table that solid.tree gives.
constexpr std::size_t kDeepestTree = 100;

Result<Value> tree(CommandContext& ctx, const Map& args) {
  const Solid& s = content<Solid>(ctx, args);
  const std::string& solid = ctx.snapshot().find(ref(args, "id"))->name;
  // What is nested deeper, neither Lua nor JSON-RPC takes, nor the end of a table's life.
  std::vector<std::size_t> depth(s.nodes.size(), 1);
  for (std::size_t i = 0; i < s.nodes.size(); ++i) {
    if (s.nodes[i].parent >= 0) depth[i] = depth[static_cast<std::size_t>(s.nodes[i].parent)] + 1;
    if (depth[i] > kDeepestTree)
      return error(ErrorCode::unsupported,
                   "its nodes are nested deeper than " + std::to_string(kDeepestTree) + " levels",
                   "solid.text returns the whole tree as text.", name_in(ctx, ref(args, "id")));
  }
  // From the last node to the first, each hands itself to its parent; no recursion.
  std::vector<List> children(s.nodes.size());
  Value root;
  for (std::size_t i = s.nodes.size(); i-- > 0;) {
    const SolidNode& n = s.nodes[i];
    Map m = node_map(s, i, solid);
    if (!is_primitive(n.kind)) {
      std::reverse(children[i].begin(), children[i].end());
      m.set("children", std::move(children[i]));
    }
    if (n.parent < 0) root = Value(std::move(m));
    else children[static_cast<std::size_t>(n.parent)].emplace_back(std::move(m));
  }
  return root;
}

Result<Value> solid_mass(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const auto b, ctx.app.derived.mass(ctx.snapshot(), ref(args, "id"), ctx.progress));
  return Value(body_mass_map(b, about_of(args)));
}

Result<Value> moments(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const auto m,
                 ctx.app.derived.moments(ctx.snapshot(), typed<Solid>(args), ctx.progress));
  return Value(Map{{"volume", m.volume},
                   {"area", m.area},
                   {"first", vec_value(m.first, "m^4")},
                   {"second", sym_value(m.second, "m^5")},
                   {"exact", m.exact},
                   {"relative_error", m.relative_error}});
}

Result<Value> bounds(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const auto b,
                 ctx.app.derived.bounds(ctx.snapshot(), ref(args, "id"), ctx.progress));
  return Value(
      Map{{"min", vec_value(b[0], "m")},
          {"max", vec_value(b[1], "m")},
          {"size", vec_value({b[1][0] - b[0][0], b[1][1] - b[0][1], b[1][2] - b[0][2]}, "m")}});
}

Result<Value> mesh_info(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const auto mesh,
                 ctx.app.derived.mesh(ctx.snapshot(), typed<Solid>(args), ctx.progress));
  RMP_TRY_ASSIGN(const std::string stand_in,
                 ctx.app.derived.stand_in(ctx.snapshot(), typed<Solid>(args), 0, ctx.progress));
  List notes;
  if (!stand_in.empty()) notes.emplace_back(stand_in);
  return Value(Map{{"notes", std::move(notes)},
                   {"vertices", mesh->vertex_count()},
                   {"triangles", mesh->triangle_count()},
                   {"faces", mesh->faces.size()},
                   {"edges", mesh->edge_sizes.size()}});
}

const char* const kPlate =
    "material.create{name = \"steel\", density = 7850}\n"
    "local plate = solid.create{name = \"plate\", material = \"steel\", root = {kind = "
    "\"difference\", children = {\n"
    "  {kind = \"box\", name = \"body\", x = 0.2, y = \"100 mm\", z = 0.01},\n"
    "  {kind = \"cylinder\", name = \"bore\", radius = 0.01, height = 0.03, position = {0, 0, "
    "-0.01}}}}}\n";

std::string with_plate(const char* rest) { return std::string(kPlate) + rest; }

}  // namespace

RMP_COMMANDS(solid_commands) {
  std::vector<CommandSpec> all;
  std::string kinds =
      "A node is a table: kind, an optional name, its placement in its parent (placement, or "
      "position, cylindrical or spherical with rpy, xyz, zyz, quaternion or axis_angle; frame = "
      "\"global\" makes it relative to the solid's frame), and then the fields in the following "
      "table; with centred = true the frame of a primitive that starts at z = 0 is at half its "
      "height instead.\n\n"
      "| kind | fields | meaning |\n"
      "|---|---|---|\n";
  for (const CsgNodeInfo& p : kCsgNodes) {
    kinds += "| " + std::string(p.name) + " | ";
    for (std::size_t i = 0; i < csg_size_count(p.kind); ++i)
      kinds += (i ? ", " : "") + std::string(p.sizes[i].name);
    std::vector<std::string> more;
    if (p.kind == CsgKind::fillet || p.kind == CsgKind::chamfer) more.emplace_back("select");
    if (p.kind == CsgKind::prism || p.kind == CsgKind::revolution) more.emplace_back("profile");
    if (model::height_of(p.kind)) more.emplace_back("centred");
    if (p.kind == CsgKind::imported) more.emplace_back("geometry");
    if (p.kind == CsgKind::custom) more.emplace_back("primitive");
    if (p.children == CsgChildren::one) more.emplace_back("children (one)");
    if (p.children == CsgChildren::any) more.emplace_back("children");
    for (std::size_t i = 0; i < more.size(); ++i)
      kinds += (i > 0 || csg_size_count(p.kind) > 0 ? ", " : "") + more[i];
    kinds += " | " + std::string(p.doc) + " |\n";
  }
  kinds += profile_help();
  kinds +=
      "\n"
      "select chooses edges of the node inside: \"all\", or conditions joined by \"and\": parallel "
      "x (or y, z), straight, round, convex, concave, top, bottom, left, right, front, back "
      "(entirely at the greatest or least z, x, y), near (x, y, z) in metres.\n\n"
      "primitive is the name of a provider of robomosp.primitive/1, or {name = \"gear\", params = "
      "{teeth = 20}}; its numbers may be expressions. geometry is {solid = name, node = name} of "
      "an imported node, or {points = {{x, y, z}, ...}, triangles = {{1, 2, 3}, ...}} of a mesh.\n";
  Schema create_params{needed("name", "string", "", "Name, unique among solids."),
                       needed("root", "map", "", "The tree, a nested table of nodes.")};
  for (const ParamSpec& p : solid_fields()) create_params.push_back(p);
  create_params.push_back(parameters_field());
  all.push_back({.name = "solid.create",
                 .classic = "",
                 .summary = "Makes a solid from a tree of primitives and operations.",
                 .details = kinds,
                 .example = with_plate("assert(#plate:describe().nodes == 3)"),
                 .params = std::move(create_params),
                 .returns = {"handle", "", "", {}},
                 .effect = Effect::edits,
                 .run = create_solid,
                 .takes_expressions = true});
  all.push_back(
      {.name = "solid.set",
       .classic = "",
       .summary = "Changes one number or field of a solid.",
       .details =
           "The path is material, chord or description, or a node's name and one of its fields: "
           "\"bore.radius\", \"body.position\", \"body.position.z\", \"body.rpy\", \"body.frame\", "
           "\"body.name\", \"soft.select\", \"web.profile\", \"web.profile.1.3.x\", "
           "\"wheel.primitive.teeth\"; or any other path of record.set.",
       .example = with_plate("plate:set{path = \"bore.radius\", value = \"12 "
                             "mm\"}\nassert(plate:tree().children[2].radius == 0.012)"),
       .params = {self("solid"), needed("path", "string", "", "Path of the value."),
                  needed("value", "any", "", "The new value; lengths in metres, or with a unit.")},
       .returns = {},
       .effect = Effect::edits,
       .run = set_solid,
       .takes_expressions = true});
  all.push_back(
      {.name = "solid.tree",
       .classic = "",
       .summary = "Returns the tree as the nested table that solid.create takes.",
       .details = "Trees of more than 100 levels are refused; `solid.text` writes those.",
       .example = with_plate("local twin = solid.create{name = \"twin\", root = "
                             "plate:tree()}\nassert(twin:tree().children[1].x == 0.2)"),
       .params = {self("solid")},
       .returns = {"map",
                   "",
                   "",
                   {field("kind", "string", "", "Operation or primitive."),
                    field("name", "string", "", "Name of the node."),
                    field("placement", "map", "", "Pose in its parent."),
                    field("expressions", "map", "", "Numbers given by expressions, by path."),
                    field("children", "list", "", "Child nodes of an operation.")}},
       .effect = Effect::reads,
       .run = tree});
  all.push_back(
      {.name = "solid.mass",
       .classic = "",
       .summary = "Returns mass, centre of mass and inertia of a solid.",
       .details = "Exact to rounding: computed from the analytic surfaces, not from the mesh.",
       .example = with_plate("assert(math.abs(plate:mass().mass - 7850 * (0.2 * 0.1 * "
                             "0.01 - math.pi * 0.01^2 * 0.01)) < 1e-9)"),
       .params = {self("solid"), about_field()},
       .returns = {"map", "", "", body_mass_fields()},
       .effect = Effect::reads,
       .run = solid_mass});
  all.push_back(
      {.name = "solid.moments",
       .classic = "",
       .summary = "Returns volume, area and the first and second moments of a solid about its "
                  "frame's origin.",
       .details = "",
       .example = with_plate("assert(plate:moments().exact)"),
       .params = {self("solid")},
       .returns = {"map",
                   "",
                   "",
                   {field("volume", "real", "m^3", "Volume."),
                    field("area", "real", "m^2", "Surface area."),
                    field("first", "vec3", "m^4", "Integrals of x, y, z."),
                    field("second", "matrix", "m^5", "Integrals of the products of x, y, z."),
                    field("exact", "bool", "",
                          "Whether it is computed from the analytic surfaces."),
                    field("relative_error", "real", "", "Error estimate if not exact.")}},
       .effect = Effect::reads,
       .run = moments});
  const std::vector<ParamSpec> bounds_fields{field("min", "vec3", "m", "Least coordinates."),
                                             field("max", "vec3", "m", "Greatest coordinates."),
                                             field("size", "vec3", "m", "Their difference.")};
  all.push_back({.name = "solid.bounds",
                 .classic = "",
                 .summary = "Returns the box around a solid, along the axes of its frame.",
                 .details = "",
                 .example = with_plate("assert(math.abs(plate:bounds().size[1] - 0.2) < 1e-6)"),
                 .params = {self("solid")},
                 .returns = {"map", "", "", bounds_fields},
                 .effect = Effect::reads,
                 .run = bounds});
  all.push_back({.name = "solid.mesh_info",
                 .classic = "",
                 .summary = "Counts the vertices, triangles, faces and edges of a solid's mesh.",
                 .details = "",
                 .example = with_plate("assert(plate:mesh_info().triangles > 12)"),
                 .params = {self("solid")},
                 .returns = {"map",
                             "",
                             "",
                             {field("vertices", "int", "", "Vertices."),
                              field("triangles", "int", "", "Triangles."),
                              field("faces", "int", "", "Faces of the solid."),
                              field("edges", "int", "", "Feature edges."),
                              field("notes", "list", "", "Remarks: why it is an approximation.")}},
                 .effect = Effect::reads,
                 .run = mesh_info});
  all.push_back(
      {.name = "object.bounds",
       .classic = "",
       .summary = "Returns the box around an object, along the axes of its frame.",
       .details = "",
       .example = with_plate("local o = object.create{name = \"o\", parts = {{what = "
                             "\"plate\"}}}\nassert(math.abs(o:bounds().size[1] - 0.2) < 1e-6)"),
       .params = {self("object")},
       .returns = {"map", "", "", bounds_fields},
       .effect = Effect::reads,
       .run = bounds});
  return all;
}

}  // namespace robomosp::ioci
