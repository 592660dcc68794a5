// SPDX-License-Identifier: Apache-2.0
#include "ioci/records/solid_nodes.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <utility>

#include <robomosp/sdk/csg_primitive.h>

#include "io/geometry.h"
#include "ioci/core/record_params.h"
#include "kernel/type.h"
#include "model/field_types.h"

namespace robomosp::ioci {

using model::Branch;
using model::Solid;
using model::SolidNode;

namespace {

CsgKind kind_of_word(std::string_view word) {
  const CsgNodeInfo* row = csg_info(word);
  return row ? row->kind : CsgKind::box;
}

ParamSpec size_spec(const CsgSize& size) {
  ParamSpec p = field(std::string(size.name), "real", std::string(size.unit), "Size.");
  if (size.range == CsgRange::positive) p = above_zero(p);
  else if (size.range == CsgRange::not_negative) p.min = 0;
  else if (size.range == CsgRange::count) p = between(p, 1, 10000);
  if (size.required) p.required = true;
  else p.default_value = Value(size.default_value);
  return p;
}

ParamSpec frame_spec() {
  return choice("frame", {"parent", "global"}, "Reference frame of the placement.");
}

ParamSpec centred_spec() {
  return defaulted("centred", "bool", "", false,
                   "The placement is that of the middle of its height, not of its base.");
}

bool is_drawn(CsgKind kind) { return kind == CsgKind::prism || kind == CsgKind::revolution; }
bool is_edge_work(CsgKind kind) { return kind == CsgKind::fillet || kind == CsgKind::chamfer; }

/// Fields of SolidNode that nodes give in a form of their own; all others are as declared.
constexpr std::string_view kOwnForms[] = {"kind",      "name",      "parent", "sizes",
                                          "profile",   "geometry",  "select", "primitive",
                                          "is_global", "is_centred"};
bool has_own_form(std::string_view field) {
  return std::find(std::begin(kOwnForms), std::end(kOwnForms), field) != std::end(kOwnForms);
}
/// A field of nodes that has none; null = there is no such field.
const model::Field* declared_field(std::string_view name) {
  const model::Field* f = model::type_of<SolidNode>().field(name);
  return f && f->type != &model::type_of<model::Placement>() && !has_own_form(name) ? f : nullptr;
}

Schema make_node_schema(CsgKind kind) {
  Schema s{choice("kind", kind_words(), "An operation or a primitive.", true),
           optional("name", "string", "", "Name of the node within the solid."),
           optional("expressions", "map", "", "Its numbers given by expressions, by path.")};
  for (ParamSpec& p : record_params("solid", "nodes", "its parent"))
    if (!has_own_form(p.name)) s.push_back(std::move(p));
  s.push_back(frame_spec());
  for (std::size_t i = 0; i < csg_size_count(kind); ++i)
    s.push_back(size_spec(csg_info(kind).sizes[i]));
  if (model::height_of(kind)) s.push_back(centred_spec());
  if (is_edge_work(kind)) s.push_back(optional("select", "string", "", "The edges."));
  if (is_drawn(kind)) s.push_back(needed("profile", "any", "", "The outline."));
  if (kind == CsgKind::imported) s.push_back(needed("geometry", "map", "", "Its geometry."));
  if (kind == CsgKind::custom)
    s.push_back(needed("primitive", "any", "", "The plugin's primitive."));
  if (!is_primitive(kind)) s.push_back(optional("children", "list", "", "The nodes it works on."));
  return s;
}

/// For check(), made once: solids have many nodes.
const Schema& node_schema(CsgKind kind) {
  static const auto all = [] {
    std::map<CsgKind, Schema> made;
    for (const CsgNodeInfo& row : kCsgNodes)
      made.emplace(row.kind, plain_params(make_node_schema(row.kind)));
    return made;
  }();
  return all.at(kind);
}

/// Nodes as a type: a case for each kind.
std::string node_type() {
  std::vector<std::pair<std::string, Schema>> cases;
  for (const std::string& word : kind_words()) {
    Schema s = make_node_schema(kind_of_word(word));
    std::erase_if(s, [](const ParamSpec& p) { return p.name == "kind"; });
    for (const auto& [field, type] : std::initializer_list<std::pair<const char*, const char*>>{
             {"expressions", "map<string> @advanced"},
             {"profile", "string or list<any> or map<any>"},
             {"geometry", "map<string or int or matrix>"},
             {"primitive", "provider:primitive"},
             {"children", "list<type:node>"}})
      if (std::any_of(s.begin(), s.end(), [&](const ParamSpec& p) { return p.name == field; }))
        retype(s, field, type);
    cases.emplace_back(word, std::move(s));
  }
  return variant_type("kind", cases);
}
const NamedType kNodeType("node", "map", node_type);

Result<void> check_node_name(const Value& value, const std::string& path) {
  const std::string* name = value.as_string();
  if (name && !name->empty() && name->find('.') == std::string::npos) return {};
  return error(ErrorCode::invalid_argument,
               (name ? text::quote(*name) : value.text()) + " cannot name a node",
               "Use letters, digits and _.", path);
}

std::string hex(const std::array<std::uint64_t, 2>& digest) {
  char out[40];
  std::snprintf(out, sizeof out, "%016llx%016llx", static_cast<unsigned long long>(digest[0]),
                static_cast<unsigned long long>(digest[1]));
  return out;
}

/// `{solid = "housing", node = "body"}` (as node_map() writes it), `{points = ..., triangles =
/// ...}` or `{brep = "..."}`.
Result<io::GeometryPtr> read_geometry(CommandContext& ctx, const Map& given,
                                      const std::string& path) {
  const auto refuse = [&](std::string message) {
    return error(ErrorCode::invalid_argument, std::move(message),
                 "Give {solid = name, node = name} of an imported node, {points = {{x, y, z}, "
                 "...}, triangles = {{1, 2, 3}, ...}}, or import a file.",
                 path);
  };
  if (const Value* solid = given.find("solid")) {
    const document::Snapshot& now = ctx.snapshot();
    if (const Value* digest = given.find("digest"); digest && digest->as_string())
      for (const AnyId id : now.list(Kind::solid))
        for (const SolidNode& n : std::get<Solid>(now.find(id)->body).nodes)
          if (n.geometry && hex(n.geometry->digest) == *digest->as_string()) return n.geometry;
    RMP_TRY_ASSIGN(const AnyId id, read_ref(ctx, "solid", *solid, path + ".solid"));
    const Solid& from = std::get<Solid>(now.find(id)->body);
    RMP_TRY_ASSIGN(const std::size_t i, need_node(from, text_of(given, "node")));
    if (!from.nodes[i].geometry)
      return refuse("node " + text::quote(from.nodes[i].name) + " is not imported");
    return from.nodes[i].geometry;
  }
  CsgGeometry g;
  g.source = text_of(given, "source");
  if (has(given, "brep")) {
    g.brep = text_of(given, "brep");
  } else if (has(given, "points") && has(given, "triangles")) {
    g.form = CsgGeometry::Form::mesh;
    RMP_TRY_ASSIGN(const Value points, check_value(field("", "matrix", "m", ""),
                                                   *given.find("points"), path + ".points"));
    RMP_TRY_ASSIGN(
        const Value triangles,
        check_value(field("", "matrix", "", ""), *given.find("triangles"), path + ".triangles"));
    if (points.as_array()->cols() != 3 || triangles.as_array()->cols() != 3)
      return refuse("points and triangles must have three numbers each");
    g.points = points.as_array()->data();
    for (const double v : triangles.as_array()->data()) {
      if (!(v >= 1 && v <= 4e9 && v == std::floor(v)))
        return refuse(text::print(v) + " is not the number of a point, numbered from 1");
      g.triangles.push_back(static_cast<std::uint32_t>(v - 1));
    }
  } else {
    return refuse("the geometry is missing");
  }
  auto made = io::make_geometry(std::move(g));
  if (!made.ok()) return std::move(made).error().in(path);
  return made;
}

/// The numbers among the parameters of a primitive, as reals; none when it has no provider here.
Schema number_params(const CommandContext& ctx, const std::string& primitive) {
  Schema out;
  const auto info = ctx.app.registry.find(CsgPrimitive::kInterfaceId, primitive);
  if (primitive.empty() || !info.ok()) return out;
  for (const ParamSpec& p : info->schema)
    if (plain_type(p.type) == "real" || plain_type(p.type) == "int")
      out.push_back(field(p.name, "real", p.unit, p.doc));
  return out;
}

/// One node of a table. Its expressions are noted in the branch.
Result<void> read_node(CommandContext& ctx, CsgKind kind, const Map& raw, std::int32_t parent,
                       FreshNames& taken, const std::string& path, Branch& into) {
  SolidNode node;
  node.kind = kind;
  node.parent = parent;
  const Schema& schema = node_schema(kind);
  RMP_TRY_ASSIGN(const Map given, ctx.expressions.read(schema, raw, path));
  RMP_TRY_ASSIGN(const Map args, read_map(ctx, schema, Value(given), path));
  RMP_TRY_ASSIGN(node.placement, read_placement_fields(given, path));
  node.is_global = text_of(args, "frame") == "global";
  node.is_centred = model::height_of(kind) && flag(args, "centred");
  if (has(args, "name")) {
    RMP_TRY(check_node_name(*args.find("name"), path));
    node.name = text_of(args, "name");
    if (!taken.take(node.name))
      return error(ErrorCode::conflict, "there are two nodes named " + text::quote(node.name),
                   "Names must be unique within a solid.", path);
  } else {
    node.name = taken.fresh(word_of(kind));
  }
  for (std::size_t i = 0; i < csg_size_count(kind); ++i)
    node.sizes[i] = real(args, csg_info(kind).sizes[i].name);
  node.select = text_of(args, "select");
  for (const model::Field& f : model::type_of<SolidNode>().fields)
    if (declared_field(f.name)) RMP_TRY(set_field(f, &node, args));
  if (is_drawn(kind)) {
    RMP_TRY_ASSIGN(node.profile, read_profile(ctx, *args.find("profile"), path + ".profile"));
  }
  if (kind == CsgKind::imported) {
    RMP_TRY_ASSIGN(node.geometry,
                   read_geometry(ctx, *args.find("geometry")->as_map(), path + ".geometry"));
  }
  if (kind == CsgKind::custom) {
    const std::string where = path + ".primitive";
    RMP_TRY_ASSIGN(const Value primitive,
                   read_primitive(ctx, *args.find("primitive"), "primitive", where));
    RMP_TRY_ASSIGN(node.primitive, read_provider(primitive, where));
  }
  model::Parametric texts;
  ctx.expressions.keep(texts, node.name);
  // A count that is an expression is given as a whole number by tables of solid.tree.
  for (auto& [name, param] : node.primitive.params)
    if (const auto* whole = std::get_if<std::int64_t>(&param);
        whole && texts.expressions.contains(node.name + ".primitive." + name))
      param = static_cast<double>(*whole);
  into.expressions.merge(texts.expressions);
  into.nodes.push_back(std::move(node));
  return {};
}

}  // namespace

std::vector<std::string> kind_words(bool with_primitives) {
  std::vector<std::string> out;
  for (const CsgNodeInfo& row : kCsgNodes)
    if (with_primitives || row.children != CsgChildren::none) out.emplace_back(row.name);
  return out;
}

std::string word_of(CsgKind kind) { return std::string(csg_info(kind).name); }

std::set<std::string> node_names(const Solid& s) {
  std::set<std::string> out;
  for (const SolidNode& n : s.nodes) out.insert(n.name);
  return out;
}

Result<std::size_t> need_node(const Solid& s, std::string_view name) {
  if (const auto i = model::find_node(s, name)) return *i;
  std::vector<std::string> known;
  for (const SolidNode& n : s.nodes) known.push_back(n.name);
  return unknown_name("node", name, known);
}

Result<Branch> read_tree(CommandContext& ctx, const Value& root, FreshNames taken,
                         std::string_view path) {
  struct Open {
    Value value;
    std::int32_t parent;
    std::string path;
  };
  constexpr std::size_t kMostNodes = 100000;
  std::vector<Open> stack;
  stack.push_back({root, -1, std::string(path)});
  Branch branch;
  while (!stack.empty()) {
    const Open open = std::move(stack.back());
    stack.pop_back();
    if (branch.nodes.size() >= kMostNodes)
      return error(ErrorCode::invalid_argument,
                   "the tree has more than " + std::to_string(kMostNodes) + " nodes", {},
                   std::string(path));
    const Map* raw = open.value.as_map();
    if (!raw)
      return error(ErrorCode::invalid_argument, open.value.text() + " is not a node",
                   "Give a table such as {kind = \"box\", x = 0.1, y = 0.1, z = 0.02}.", open.path);
    const Value* kind_value = raw->find("kind");
    if (!kind_value)
      return error(ErrorCode::invalid_argument, "the node has no kind",
                   "Kinds: " + text::enumerate(kind_words()) + ".", open.path);
    RMP_TRY_ASSIGN(const Value word, check_value(choice("kind", kind_words(), "", true),
                                                 *kind_value, open.path + ".kind"));
    const CsgKind kind = kind_of_word(*word.as_string());
    const auto index = static_cast<std::int32_t>(branch.nodes.size());
    RMP_TRY(read_node(ctx, kind, *raw, open.parent, taken, open.path, branch));
    if (is_primitive(kind)) continue;
    const Value* inner = raw->find("children");
    const List* children = inner ? inner->as_list() : nullptr;
    const std::string what =
        word_of(kind) + " " + text::quote(branch.nodes[static_cast<std::size_t>(index)].name);
    if (!children || children->empty())
      return error(ErrorCode::invalid_argument, what + " has no children", "Give children = {...}.",
                   open.path);
    if (csg_info(kind).children == CsgChildren::one && children->size() != 1)
      return error(
          ErrorCode::invalid_argument,
          what + " has " + std::to_string(children->size()) + " children; it needs exactly one",
          "Put them into a union.", open.path);
    for (std::size_t i = children->size(); i-- > 0;)
      stack.push_back(
          {(*children)[i], index, open.path + ".children[" + std::to_string(i + 1) + "]"});
  }
  return branch;
}

Result<Branch> read_flat_nodes(CommandContext& ctx, const List& nodes, const std::string& path) {
  Branch branch;
  FreshNames taken{std::set<std::string>()};
  std::map<std::string, std::int32_t, std::less<>> index_of;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const std::string here = path + "[" + std::to_string(i + 1) + "]";
    const Map* given = nodes[i].as_map();
    const Value* word = given ? given->find("kind") : nullptr;
    if (!word)
      return error(ErrorCode::invalid_argument, nodes[i].text() + " is not a node",
                   "Give a table such as {kind = \"box\", name = \"body\", x = 0.1, y = 0.1, z = "
                   "0.02}.",
                   here);
    RMP_TRY_ASSIGN(const Value kind,
                   check_value(choice("kind", kind_words(), "", true), *word, here + ".kind"));
    std::int32_t parent = -1;
    if (const Value* above = given->find("parent"); above && above->as_string()) {
      const auto known = index_of.find(*above->as_string());
      if (known == index_of.end())
        return error(ErrorCode::unknown_name,
                     "there is no node " + text::quote(*above->as_string()) + " before it",
                     "Order the nodes so that parents come first.", here + ".parent");
      parent = known->second;
    }
    Map fields = *given;
    fields.erase("parent");
    RMP_TRY(read_node(ctx, kind_of_word(*kind.as_string()), fields, parent, taken, here, branch));
    index_of.emplace(branch.nodes.back().name, static_cast<std::int32_t>(i));
  }
  return branch;
}

Result<Branch> read_operation(CommandContext& ctx, CsgKind kind, const Map& fields,
                              FreshNames taken, std::string_view path) {
  Branch branch;
  Map table{{"kind", word_of(kind)}};
  for (const auto& [key, v] : fields) table.set(key, v);
  if (const Value* inner = fields.find("children"); inner && !inner->is_nil())
    return error(ErrorCode::invalid_argument, "the operation's children are given twice",
                 "The wrapped node is the first; give others as with = {...}.", std::string(path));
  RMP_TRY(read_node(ctx, kind, table, -1, taken, std::string(path), branch));
  return branch;
}

Result<Value> read_primitive(CommandContext& ctx, const Value& value, const std::string& prefix,
                             const std::string& path) {
  const Map* map = value.as_map();
  const Value* params = map ? map->find("params") : nullptr;
  if (!params || !params->as_map()) return value;
  const Value* name = map->find("name");
  const Schema numbers =
      number_params(ctx, name && name->as_string() ? *name->as_string() : std::string());
  RMP_TRY_ASSIGN(Map read,
                 ctx.expressions.read(numbers, *params->as_map(), path + ".params", prefix));
  Map out = *map;
  out.set("params", std::move(read));
  return Value(std::move(out));
}

Result<Value> read_primitive_param(CommandContext& ctx, const SolidNode& node,
                                   const std::string& param, const Value& value,
                                   const std::string& path) {
  const std::string prefix = path.substr(0, path.size() - param.size() - 1);
  RMP_TRY_ASSIGN(const Map read, ctx.expressions.read(number_params(ctx, node.primitive.name),
                                                      Map{{param, value}}, prefix, prefix));
  return *read.find(param);
}

Result<void> set_node_field(CommandContext& ctx, Solid& s, std::size_t index, std::string_view name,
                            const Value& value, const std::string& path) {
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
    RMP_TRY(check_node_name(value, path));
    if (*value.as_string() != n.name && node_names(s).contains(*value.as_string()))
      return error(ErrorCode::conflict,
                   "there is already a node named " + text::quote(*value.as_string()), {}, path);
    n.name = *value.as_string();
    return {};
  }
  if (name == "frame") {
    RMP_TRY_ASSIGN(const Value v, check_value(frame_spec(), value, path));
    n.is_global = *v.as_string() == "global";
    return {};
  }
  if (name == "centred" && model::height_of(n.kind)) {
    RMP_TRY_ASSIGN(const Value v, check_value(centred_spec(), value, path));
    n.is_centred = *v.as_bool();
    return {};
  }
  if (name == "kind" && csg_info(n.kind).children == CsgChildren::any) {
    RMP_TRY_ASSIGN(const Value v,
                   check_value(choice("kind", {"union", "difference", "intersection"}, "", true),
                               value, path));
    n.kind = kind_of_word(*v.as_string());
    return {};
  }
  if (name == "select" && is_edge_work(n.kind)) {
    RMP_TRY_ASSIGN(const Value v, check_value(field("", "string", "", ""), value, path));
    n.select = *v.as_string();
    return {};
  }
  if (name == "profile" && is_drawn(n.kind)) {
    RMP_TRY_ASSIGN(n.profile, read_profile(ctx, value, path));
    auto& texts = s.parametric.expressions;
    std::erase_if(texts, [&](const auto& e) { return e.first.starts_with(path + "."); });
    ctx.expressions.keep(s.parametric, n.name);
    return {};
  }
  if (name.starts_with("primitive") && n.kind == CsgKind::custom) {
    if (name == "primitive") {
      RMP_TRY_ASSIGN(n.primitive, read_provider(value, path));
      return {};
    }
    if (name.starts_with("primitive.")) {  // one of its parameters; nil = its default again
      const std::string param(name.substr(10));
      if (value.is_nil()) {
        n.primitive.params.erase(param);
        return {};
      }
      RMP_TRY_ASSIGN(auto one, read_provider(Map{{"params", Map{{param, value}}}}, path));
      n.primitive.params[param] = std::move(one.params[param]);
      return {};
    }
  }
  if (const model::Field* f = declared_field(name)) {
    ParamSpec spec = model::field_param("solid", "nodes." + std::string(name), *f);
    RMP_TRY_ASSIGN(Value v, check_value(spec, value, path));
    return set_field(*f, &n, Map{{std::string(name), std::move(v)}});
  }
  std::vector<std::string> known{"name", "frame"};
  for (const model::Field& f : model::type_of<SolidNode>().fields)
    if (declared_field(f.name)) known.emplace_back(f.name);
  for (std::size_t i = 0; i < csg_size_count(n.kind); ++i)
    known.emplace_back(csg_info(n.kind).sizes[i].name);
  if (csg_info(n.kind).children == CsgChildren::any) known.emplace_back("kind");
  if (is_edge_work(n.kind)) known.emplace_back("select");
  if (is_drawn(n.kind)) known.emplace_back("profile");
  if (model::height_of(n.kind)) known.emplace_back("centred");
  if (n.kind == CsgKind::custom) known.emplace_back("primitive");
  known.insert(known.end(), std::begin(kPlacementFields), std::end(kPlacementFields));
  Error e = unknown_name("field", name, known);
  e.message += " of " + word_of(n.kind) + " " + text::quote(n.name);
  return e;
}

Map node_map(const Solid& s, std::size_t node, const std::string& solid) {
  const SolidNode& n = s.nodes[node];
  Map m{{"kind", word_of(n.kind)}, {"name", n.name}, {"placement", placement_value(n.placement)}};
  if (n.is_global) m.set("frame", "global");
  if (n.is_centred) m.set("centred", true);
  for (std::size_t k = 0; k < csg_size_count(n.kind); ++k)
    m.set(std::string(csg_info(n.kind).sizes[k].name), n.sizes[k]);
  if (!n.select.empty()) m.set("select", n.select);
  if (n.profile) m.set("profile", profile_value(*n.profile));
  if (n.geometry) {
    const bool is_mesh = n.geometry->form == CsgGeometry::Form::mesh;
    Map geometry{{"solid", solid},
                 {"node", n.name},
                 {"form", is_mesh ? "mesh" : "brep"},
                 {"digest", hex(n.geometry->digest)}};
    if (is_mesh) geometry.set("triangle_count", n.geometry->triangles.size() / 3);
    if (!n.geometry->source.empty()) geometry.set("source", n.geometry->source);
    m.set("geometry", std::move(geometry));
  }
  if (n.kind == CsgKind::custom) m.set("primitive", provider_value(n.primitive));
  const model::Type& type = model::type_of<SolidNode>();
  for (const model::Field& f : type.fields)
    if (declared_field(f.name))
      if (Value v = changed_value(nullptr, type, f, &n); !v.is_nil())
        m.set(std::string(f.name), std::move(v));
  if (Map texts = expressions_map(s.parametric, n.name); !texts.empty())
    m.set("expressions", std::move(texts));
  return m;
}

}  // namespace robomosp::ioci
