// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <set>

#include "io/native.h"
#include "ioci/commands.h"

namespace robomosp::ioci {
namespace {

using model::Solid;
using model::SolidNode;
using Nodes = std::vector<SolidNode>;

bool is_primitive(CsgKind kind) { return csg_info(kind).children == CsgChildren::none; }

std::vector<std::string> kind_words() {
  std::vector<std::string> out;
  for (const CsgNodeInfo& row : kCsgNodes) out.emplace_back(row.name);
  return out;
}

CsgKind kind_of_word(std::string_view word) {
  const CsgNodeInfo* row = csg_info(word);
  return row ? row->kind : CsgKind::box;
}

std::string word_of(CsgKind kind) { return std::string(csg_info(kind).name); }

ParamSpec size_spec(const CsgSize& size) {
  ParamSpec p = field(std::string(size.name), "real", std::string(size.unit), "Size.");
  if (size.range == CsgRange::positive) p = above_zero(p);
  else if (size.range == CsgRange::not_negative) p.min = 0;
  else if (size.range == CsgRange::count) p = between(p, 1, 10000);
  if (size.required) p.required = true;
  else p.default_value = Value(size.default_value);
  return p;
}

Schema node_schema(CsgKind kind) {
  Schema s{choice("kind", kind_words(), "An operation or a primitive.", true),
           optional("name", "string", "", "Name of the node within the solid."),
           optional("expressions", "map", "", "Its numbers that are expressions, by path.")};
  for (ParamSpec& p : placement_fields("its parent")) s.push_back(std::move(p));
  for (std::size_t i = 0; i < csg_size_count(kind); ++i)
    s.push_back(size_spec(csg_info(kind).sizes[i]));
  if (!is_primitive(kind))
    s.push_back(needed("children", "list", "", "The nodes it works on, in order."));
  return s;
}

std::string free_node_name(const std::set<std::string>& taken, const std::string& wanted) {
  if (!taken.contains(wanted)) return wanted;
  for (int i = 2;; ++i)
    if (const std::string name = wanted + "_" + std::to_string(i); !taken.contains(name))
      return name;
}

/// The flat form of a nested table, without recursion: parents first, children in order. Numbers
/// that are expressions are noted in `into`.
Result<Nodes> read_tree(CommandContext& ctx, const Value& root, std::set<std::string> taken,
                        std::string_view path, model::Parametric& into) {
  struct Open {
    Value value;
    std::int32_t parent;
    std::string path;
  };
  constexpr std::size_t kMostNodes = 100000;
  std::vector<Open> stack;
  stack.push_back({root, -1, std::string(path)});
  Nodes nodes;
  while (!stack.empty()) {
    const Open open = std::move(stack.back());
    stack.pop_back();
    if (nodes.size() >= kMostNodes)
      return error(ErrorCode::invalid_argument,
                   "the tree has more than " + std::to_string(kMostNodes) + " nodes", {},
                   std::string(path));
    const Map* raw = open.value.as_map();
    if (!raw)
      return error(ErrorCode::invalid_argument, open.value.text() + " is not a node",
                   "Give a table such as {kind = \"box\", x = 0.1, y = 0.1, z = 0.02}.", open.path);
    ParamSpec kind_spec = choice("kind", kind_words(), "An operation or a primitive.", true);
    const Value* kind_value = raw->find("kind");
    if (!kind_value)
      return error(ErrorCode::invalid_argument, "the node has no kind",
                   "Kinds: " + text::enumerate(kind_words()) + ".", open.path);
    RMP_TRY_ASSIGN(const Value kind_checked,
                   check_value(kind_spec, *kind_value, open.path + ".kind"));
    SolidNode node;
    node.kind = kind_of_word(*kind_checked.as_string());
    node.parent = open.parent;
    const Schema schema = node_schema(node.kind);
    RMP_TRY_ASSIGN(const Map given, ctx.expressions.read(schema, *raw, open.path));
    RMP_TRY_ASSIGN(const Map args, read_map(ctx, schema, Value(given), open.path));
    RMP_TRY_ASSIGN(node.placement, read_placement_fields(given, open.path));
    if (has(args, "name")) {
      node.name = text_of(args, "name");
      if (node.name.empty() || node.name.find('.') != std::string::npos)
        return error(ErrorCode::invalid_argument, text::quote(node.name) + " cannot name a node",
                     "Use letters, digits and _.", open.path);
      if (taken.contains(node.name))
        return error(ErrorCode::conflict, "there are two nodes named " + text::quote(node.name),
                     "Names are unique within a solid.", open.path);
    } else {
      node.name = free_node_name(taken, word_of(node.kind));
    }
    taken.insert(node.name);
    ctx.expressions.keep(into, node.name);
    const auto index = static_cast<std::int32_t>(nodes.size());
    for (std::size_t i = 0; i < csg_size_count(node.kind); ++i)
      node.sizes[i] = real(args, csg_info(node.kind).sizes[i].name);
    if (!is_primitive(node.kind)) {
      const List& children = *args.find("children")->as_list();
      if (children.empty())
        return error(ErrorCode::invalid_argument,
                     word_of(node.kind) + " " + text::quote(node.name) + " has no children",
                     "Give children = {...}.", open.path);
      for (std::size_t i = children.size(); i-- > 0;)
        stack.push_back(
            {children[i], index, open.path + ".children[" + std::to_string(i + 1) + "]"});
    }
    nodes.push_back(std::move(node));
  }
  return nodes;
}

Result<std::size_t> find_node(const Solid& s, std::string_view name) {
  std::vector<std::string> known;
  for (std::size_t i = 0; i < s.nodes.size(); ++i) {
    if (s.nodes[i].name == name) return i;
    known.push_back(s.nodes[i].name);
  }
  return unknown_name("node", name, known);
}

/// One past the last node of the subtree at `i`; subtrees are contiguous in this order.
std::size_t subtree_end(const Nodes& nodes, std::size_t i) {
  std::size_t end = i + 1;
  while (end < nodes.size() && nodes[end].parent >= static_cast<std::int32_t>(i)) ++end;
  return end;
}

/// Puts a block (its own parents relative to itself, -1 = block's root) at `at` under `parent`.
void insert_block(Nodes& nodes, std::size_t at, Nodes block, std::int32_t parent) {
  const auto shift = static_cast<std::int32_t>(block.size());
  const auto first = static_cast<std::int32_t>(at);
  for (SolidNode& n : nodes)
    if (n.parent >= first) n.parent += shift;
  for (SolidNode& n : block) n.parent = n.parent < 0 ? parent : n.parent + first;
  nodes.insert(nodes.begin() + first, block.begin(), block.end());
}

std::set<std::string> names(const Nodes& nodes) {
  std::set<std::string> out;
  for (const SolidNode& n : nodes) out.insert(n.name);
  return out;
}

Schema solid_fields() {
  return {
      optional("material", "ref:material", "", "What it is made of; without one it has no mass."),
      above_zero(
          optional("chord", "real", "m", "Greatest distance of a mesh chord from the surface.")),
      optional("description", "string", "", "What it is.")};
}

void apply_fields(const Map& args, Solid& s) {
  if (has(args, "material")) s.material = typed<model::Material>(args, "material");
  if (has(args, "chord")) s.chord = real(args, "chord");
  if (has(args, "description")) s.description = text_of(args, "description");
}

Result<Value> create(CommandContext& ctx, const Map& args) {
  Solid s;
  apply_fields(args, s);
  s.parametric = ctx.expressions.own();
  ctx.expressions.keep(s.parametric);
  RMP_TRY_ASSIGN(s.nodes, read_tree(ctx, *args.find("root"), {}, "root", s.parametric));
  RMP_TRY_ASSIGN(const auto id, ctx.edit().add(text_of(args, "name"), std::move(s)));
  return Value(Application::handle(id));
}

std::vector<std::string> settable(const SolidNode& n) {
  std::vector<std::string> out{"name"};
  for (std::size_t i = 0; i < csg_size_count(n.kind); ++i)
    out.emplace_back(csg_info(n.kind).sizes[i].name);
  if (csg_info(n.kind).children == CsgChildren::any) out.emplace_back("kind");
  out.insert(out.end(), std::begin(kPlacementFields), std::end(kPlacementFields));
  return out;
}

Result<void> set_node(Solid& s, std::size_t index, std::string_view name, const Value& value,
                      const std::string& path) {
  SolidNode& n = s.nodes[index];
  for (std::size_t i = 0; i < csg_size_count(n.kind); ++i)
    if (const CsgSize& size = csg_info(n.kind).sizes[i]; size.name == name) {
      RMP_TRY_ASSIGN(const Value v, check_value(size_spec(size), value, path));
      n.sizes[i] = v.number();
      return {};
    }
  RMP_TRY_ASSIGN(const bool placed, set_placement(n.placement, name, value, path));
  if (placed) return {};
  if (name == "name") {
    const std::string wanted = value.as_string() ? *value.as_string() : std::string();
    if (wanted.empty() || wanted.find('.') != std::string::npos)
      return error(ErrorCode::invalid_argument, value.text() + " cannot name a node",
                   "Use letters, digits and _.", path);
    if (wanted != n.name && names(s.nodes).contains(wanted))
      return error(ErrorCode::conflict, "there is already a node named " + text::quote(wanted), {},
                   path);
    n.name = wanted;
    return {};
  }
  if (name == "kind" && csg_info(n.kind).children == CsgChildren::any) {
    RMP_TRY_ASSIGN(const Value v,
                   check_value(choice("kind", {"union", "difference", "intersection"}, "", true),
                               value, path));
    n.kind = kind_of_word(*v.as_string());
    return {};
  }
  Error e = unknown_name("field", name, settable(n));
  e.message += " of " + word_of(n.kind) + " " + text::quote(n.name);
  return e;
}

Result<Value> set(CommandContext& ctx, const Map& args) {
  const std::string path = text_of(args, "path");
  const AnyId id = ref(args, "id");
  auto read = ctx.expressions.read_at(ctx.snapshot().find(id)->body, path, *args.find("value"));
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
        apply_fields(checked, s);
        return {};
      }
      std::vector<std::string> known{"material", "chord", "description"};
      for (const SolidNode& n : s.nodes)
        known.push_back(n.name + "." +
                        (csg_size_count(n.kind) > 0 ? std::string(csg_info(n.kind).sizes[0].name)
                                                    : std::string("placement")));
      return unknown_name("field", path, known);
    }
    RMP_TRY_ASSIGN(const std::size_t node, find_node(s, path.substr(0, dot)));
    return set_node(s, node, path.substr(dot + 1), value, path);
  });
  if (!done.ok()) return std::move(done).in(name_in(ctx, id)).error();
  return Value();
}

Result<Value> add_node(CommandContext& ctx, const Map& args) {
  const AnyId id = ref(args, "id");
  const Solid& before = content<Solid>(ctx, args);
  model::Parametric texts;
  RMP_TRY_ASSIGN(const Nodes block,
                 read_tree(ctx, *args.find("node"), names(before.nodes), "node", texts));
  const std::string made = block.front().name;
  auto done = change<Solid>(ctx, id, [&](Solid& s) -> Result<void> {
    RMP_TRY_ASSIGN(const std::size_t parent, has(args, "parent")
                                                 ? find_node(s, text_of(args, "parent"))
                                                 : Result<std::size_t>(0));
    if (is_primitive(s.nodes[parent].kind))
      return error(ErrorCode::conflict,
                   word_of(s.nodes[parent].kind) + " " + text::quote(s.nodes[parent].name) +
                       " cannot have children",
                   "Wrap it in an operation first: solid.wrap.");
    insert_block(s.nodes, subtree_end(s.nodes, parent), block, static_cast<std::int32_t>(parent));
    s.parametric.expressions.merge(texts.expressions);
    return {};
  });
  if (!done.ok()) return std::move(done).in(name_in(ctx, id)).error();
  return Value(made);
}

Result<Value> remove_node(CommandContext& ctx, const Map& args) {
  const AnyId id = ref(args, "id");
  auto done = change<Solid>(ctx, id, [&](Solid& s) -> Result<void> {
    RMP_TRY_ASSIGN(const std::size_t at, find_node(s, text_of(args, "node")));
    if (at == 0)
      return error(ErrorCode::conflict, "node " + text::quote(s.nodes[0].name) + " is the root",
                   "Remove the solid instead.");
    const std::int32_t parent = s.nodes[at].parent;
    const auto children = std::count_if(s.nodes.begin(), s.nodes.end(),
                                        [&](const SolidNode& n) { return n.parent == parent; });
    const SolidNode& above = s.nodes[static_cast<std::size_t>(parent)];
    if (children == 1)
      return error(ErrorCode::conflict,
                   "node " + text::quote(s.nodes[at].name) + " is the only child of " +
                       word_of(above.kind) + " " + text::quote(above.name),
                   "Remove that instead.");
    const std::size_t end = subtree_end(s.nodes, at);
    const auto gone = static_cast<std::int32_t>(end - at);
    s.nodes.erase(s.nodes.begin() + static_cast<std::ptrdiff_t>(at),
                  s.nodes.begin() + static_cast<std::ptrdiff_t>(end));
    for (SolidNode& n : s.nodes)
      if (n.parent >= static_cast<std::int32_t>(at)) n.parent -= gone;
    return {};
  });
  if (!done.ok()) return std::move(done).in(name_in(ctx, id)).error();
  return Value();
}

Result<Value> wrap(CommandContext& ctx, const Map& args) {
  const AnyId id = ref(args, "id");
  const Solid& before = content<Solid>(ctx, args);
  std::set<std::string> taken = names(before.nodes);
  SolidNode op;
  op.kind = kind_of_word(text_of(args, "kind"));
  op.name = has(args, "name") ? text_of(args, "name") : free_node_name(taken, word_of(op.kind));
  if (taken.contains(op.name))
    return error(ErrorCode::conflict, "there is already a node named " + text::quote(op.name), {},
                 name_in(ctx, id));
  taken.insert(op.name);
  Nodes with;
  model::Parametric texts;
  if (has(args, "with")) {
    RMP_TRY_ASSIGN(with, read_tree(ctx, *args.find("with"), taken, "with", texts));
  }
  auto done = change<Solid>(ctx, id, [&](Solid& s) -> Result<void> {
    RMP_TRY_ASSIGN(const std::size_t at, has(args, "node") ? find_node(s, text_of(args, "node"))
                                                           : Result<std::size_t>(0));
    const std::int32_t above = s.nodes[at].parent;
    insert_block(s.nodes, at, {op}, above);
    s.nodes[at].parent = above;
    s.nodes[at + 1].parent = static_cast<std::int32_t>(at);
    if (!with.empty())
      insert_block(s.nodes, subtree_end(s.nodes, at), with, static_cast<std::int32_t>(at));
    s.parametric.expressions.merge(texts.expressions);
    return {};
  });
  if (!done.ok()) return std::move(done).in(name_in(ctx, id)).error();
  return Value(op.name);
}

Result<Value> tree(CommandContext& ctx, const Map& args) {
  const Solid& s = content<Solid>(ctx, args);
  // From the last node to the first, each hands itself to its parent; no recursion.
  std::vector<List> children(s.nodes.size());
  Value root;
  for (std::size_t i = s.nodes.size(); i-- > 0;) {
    const SolidNode& n = s.nodes[i];
    Map m{{"kind", word_of(n.kind)}, {"name", n.name}, {"placement", placement_value(n.placement)}};
    for (std::size_t k = 0; k < csg_size_count(n.kind); ++k)
      m.set(std::string(csg_info(n.kind).sizes[k].name), n.sizes[k]);
    if (Map texts = expressions_map(s.parametric, n.name); !texts.empty())
      m.set("expressions", std::move(texts));
    if (!is_primitive(n.kind)) {
      std::reverse(children[i].begin(), children[i].end());
      m.set("children", std::move(children[i]));
    }
    if (n.parent < 0) root = Value(std::move(m));
    else children[static_cast<std::size_t>(n.parent)].emplace_back(std::move(m));
  }
  return root;
}

Result<Value> mass(CommandContext& ctx, const Map& args) {
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
  return Value(Map{{"vertices", mesh->vertex_count()},
                   {"triangles", mesh->triangle_count()},
                   {"faces", mesh->faces.size()},
                   {"edges", mesh->edge_sizes.size()}});
}

Result<Value> write_stl(CommandContext& ctx, const Map& args) {
  const std::string file = text_of(args, "file");
  if (!file.ends_with(".stl"))
    return error(ErrorCode::invalid_argument, text::quote(file) + " does not end with .stl",
                 "STL is what this command writes.");
  RMP_TRY_ASSIGN(const auto bodies,
                 ctx.app.derived.drawables(ctx.snapshot(), ref(args, "id"), ctx.progress));
  RMP_TRY_ASSIGN(const std::string bytes, stl(bodies));
  RMP_TRY(io::write_file(file, bytes));
  std::size_t triangles = 0;
  for (const auto& b : bodies) triangles += b.mesh->triangle_count();
  return Value(Map{{"file", file}, {"triangles", triangles}});
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

std::vector<CommandSpec> solid_commands() {
  std::vector<CommandSpec> all;
  std::string kinds =
      "A node is a table: kind, an optional name, where it stands in its parent (placement, or "
      "position with rpy, xyz or zyz), and then\n\n"
      "| kind | fields | meaning |\n|---|---|---|\n";
  for (const CsgNodeInfo& p : kCsgNodes) {
    kinds += "| " + std::string(p.name) + " | ";
    for (std::size_t i = 0; i < csg_size_count(p.kind); ++i)
      kinds += (i ? ", " : "") + std::string(p.sizes[i].name);
    if (p.children != CsgChildren::none)
      kinds += csg_size_count(p.kind) ? ", children" : "children";
    kinds += " | " + std::string(p.doc) + " |\n";
  }
  Schema create_params{needed("name", "string", "", "Name, unique among solids."),
                       needed("root", "map", "", "The tree, a nested table of nodes.")};
  for (ParamSpec& p : solid_fields()) create_params.push_back(std::move(p));
  create_params.push_back(parameters_field());
  all.push_back({.name = "solid.create",
                 .classic = "",
                 .summary = "Makes a solid from a tree of primitives and operations.",
                 .details = kinds,
                 .example = with_plate("assert(#plate:describe().nodes == 3)"),
                 .params = std::move(create_params),
                 .returns = {"handle", "", "", {}},
                 .effect = Effect::edits,
                 .run = create,
                 .takes_expressions = true});
  all.push_back(
      {.name = "solid.set",
       .classic = "",
       .summary = "Changes one number or field of a solid.",
       .details =
           "The path is material, chord or description, or a node's name and one of its fields: "
           "\"bore.radius\", \"body.position\", \"body.position.z\", \"body.rpy\", \"body.name\".",
       .example = with_plate("plate:set{path = \"bore.radius\", value = \"12 "
                             "mm\"}\nassert(plate:tree().children[2].radius == 0.012)"),
       .params = {self("solid"), needed("path", "string", "", "What to change."),
                  needed("value", "any", "", "The new value; lengths in metres, or with a unit."),
                  optional("gesture", "string", "",
                           "Edits in a row with the same word share one step; for sliders.")},
       .returns = {},
       .effect = Effect::edits,
       .run = set,
       .takes_expressions = true});
  all.push_back(
      {.name = "solid.add_node",
       .classic = "",
       .summary = "Adds a node, or a whole tree of them, below an operation.",
       .details = "",
       .example = with_plate(
           "plate:add_node{node = {kind = \"cylinder\", name = \"second\", radius = 0.005, height "
           "= 0.03, position = {0.05, 0, -0.01}}}\nassert(#plate:tree().children == 3)"),
       .params = {self("solid"), needed("node", "map", "", "The node, as in solid.create."),
                  optional("parent", "string", "",
                           "Name of the operation; the root when left out.")},
       .returns = {"string", "", "Name of the node.", {}},
       .effect = Effect::edits,
       .run = add_node,
       .takes_expressions = true});
  all.push_back({.name = "solid.remove_node",
                 .classic = "",
                 .summary = "Removes a node and all below it.",
                 .details = "",
                 .example = with_plate(
                     "plate:add_node{node = {kind = \"sphere\", name = \"dent\", radius = "
                     "0.004}}\nplate:remove_node(\"dent\")\nassert(#plate:tree().children == 2)"),
                 .params = {self("solid"), needed("node", "string", "", "Its name.")},
                 .returns = {},
                 .effect = Effect::edits,
                 .run = remove_node});
  all.push_back(
      {.name = "solid.wrap",
       .classic = "",
       .summary = "Puts an operation around a node, with another node beside it if wanted.",
       .details = "",
       .example = "local pin = solid.create{name = \"pin\", root = {kind = \"cylinder\", radius = "
                  "0.01, height = 0.05}}\n"
                  "pin:wrap{kind = \"difference\", with = {kind = \"cylinder\", name = \"bore\", "
                  "radius = 0.004, height = 0.05}}\nassert(pin:tree().kind == \"difference\")",
       .params = {self("solid"),
                  choice("kind", {"union", "difference", "intersection"}, "The operation.", true),
                  optional("node", "string", "",
                           "The node that becomes its first child; the root when left out."),
                  optional("with", "map", "", "A further child, as in solid.create."),
                  optional("name", "string", "", "Name of the operation.")},
       .returns = {"string", "", "Name of the operation.", {}},
       .effect = Effect::edits,
       .run = wrap,
       .takes_expressions = true});
  all.push_back(
      {.name = "solid.tree",
       .classic = "",
       .summary = "Gives the tree as the nested table that solid.create takes.",
       .details = "",
       .example = with_plate("local twin = solid.create{name = \"twin\", root = "
                             "plate:tree()}\nassert(twin:tree().children[1].x == 0.2)"),
       .params = {self("solid")},
       .returns = {"map",
                   "",
                   "",
                   {field("kind", "string", "", "Operation or primitive."),
                    field("name", "string", "", "Name of the node."),
                    field("placement", "map", "", "Where it stands in its parent."),
                    field("expressions", "map", "", "Numbers that are expressions, by path."),
                    field("children", "list", "", "Of an operation: its nodes.")}},
       .effect = Effect::reads,
       .run = tree});
  all.push_back({.name = "solid.mass",
                 .classic = "",
                 .summary = "Gives mass, centre of mass and inertia of a solid.",
                 .details = "Exact to rounding: from the analytic surfaces, not from the mesh.",
                 .example = with_plate("assert(math.abs(plate:mass().mass - 7850 * (0.2 * 0.1 * "
                                       "0.01 - math.pi * 0.01^2 * 0.01)) < 1e-9)"),
                 .params = {self("solid"), about_field()},
                 .returns = {"map", "", "", body_mass_fields()},
                 .effect = Effect::reads,
                 .run = mass});
  all.push_back(
      {.name = "solid.moments",
       .classic = "",
       .summary = "Gives volume, area and the first and second moments of a solid about its "
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
                    field("exact", "bool", "", "From the analytic surface."),
                    field("relative_error", "real", "", "Estimate when not exact.")}},
       .effect = Effect::reads,
       .run = moments});
  const std::vector<ParamSpec> bounds_fields{field("min", "vec3", "m", "Least coordinates."),
                                             field("max", "vec3", "m", "Greatest coordinates."),
                                             field("size", "vec3", "m", "Their difference.")};
  all.push_back({.name = "solid.bounds",
                 .classic = "",
                 .summary = "Gives the box around a solid, along the axes of its frame.",
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
                              field("edges", "int", "", "Feature edges.")}},
                 .effect = Effect::reads,
                 .run = mesh_info});
  const std::vector<ParamSpec> export_fields{field("file", "string", "", "The file."),
                                             field("triangles", "int", "", "Triangles in it.")};
  all.push_back({.name = "solid.export",
                 .classic = "",
                 .summary = "Writes the mesh of a solid as binary STL, in metres.",
                 .details = "",
                 .example = with_plate("assert(plate:export(\"example.stl\").triangles > 12)"),
                 .params = {self("solid"), needed("file", "path", "", "The file, *.stl.")},
                 .returns = {"map", "", "", export_fields},
                 .effect = Effect::files_write,
                 .run = write_stl});
  all.push_back(
      {.name = "object.bounds",
       .classic = "",
       .summary = "Gives the box around an object, along the axes of its frame.",
       .details = "",
       .example = with_plate("local o = object.create{name = \"o\", parts = {{what = "
                             "\"plate\"}}}\nassert(math.abs(o:bounds().size[1] - 0.2) < 1e-6)"),
       .params = {self("object")},
       .returns = {"map", "", "", bounds_fields},
       .effect = Effect::reads,
       .run = bounds});
  all.push_back(
      {.name = "object.export",
       .classic = "",
       .summary = "Writes the meshes of an object's parts as one binary STL, in metres.",
       .details = "Parts that overlap stay separate shells.",
       .example = with_plate("local o = object.create{name = \"o\", parts = {{what = "
                             "\"plate\"}}}\nassert(o:export(\"example.stl\").triangles > 12)"),
       .params = {self("object"), needed("file", "path", "", "The file, *.stl.")},
       .returns = {"map", "", "", export_fields},
       .effect = Effect::files_write,
       .run = write_stl});
  return all;
}

}  // namespace robomosp::ioci
