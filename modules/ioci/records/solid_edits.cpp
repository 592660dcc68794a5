// SPDX-License-Identifier: Apache-2.0
// Structural edits of solids: each is one step of undo.
#include <algorithm>
#include <utility>

#include "ioci/records/solid_nodes.h"
#include "kernel/expression.h"

namespace robomosp::ioci {
namespace {

using model::Branch;
using model::Solid;
using model::SolidNode;

std::string shown(const SolidNode& n) { return word_of(n.kind) + " " + text::quote(n.name); }

/// Refuses a parent that cannot take one more node.
Result<void> check_room(const Solid& s, std::size_t parent) {
  const SolidNode& p = s.nodes[parent];
  if (is_primitive(p.kind))
    return error(ErrorCode::conflict, shown(p) + " cannot have children",
                 "Wrap it in an operation first: solid.wrap.");
  if (csg_info(p.kind).children == CsgChildren::one && !model::children_of(s, parent).empty())
    return error(ErrorCode::conflict, shown(p) + " takes one node and already has it",
                 "Wrap it in a union first: solid.wrap.");
  return {};
}

/// Index in the flat tree of the new child number `index` (from 1) of `parent`; none = the last.
Result<std::size_t> child_place(const Solid& s, std::size_t parent, const Map& args) {
  if (!has(args, "index")) return model::subtree_end(s, parent);
  const auto children = model::children_of(s, parent);
  const auto index = static_cast<std::size_t>(integer(args, "index"));
  if (index > children.size() + 1)
    return error(ErrorCode::invalid_argument,
                 "index is " + std::to_string(index) + "; " + shown(s.nodes[parent]) + " has " +
                     std::to_string(children.size()) +
                     (children.size() == 1 ? " other node" : " other nodes"),
                 "Give 1 to " + std::to_string(children.size() + 1) + ".");
  return index > children.size() ? model::subtree_end(s, parent) : children[index - 1];
}

/// Refuses to take a node from where others need it.
Result<void> check_leaves(const Solid& s, std::size_t i, const char* instead) {
  if (i == 0)
    return error(ErrorCode::conflict, "node " + text::quote(s.nodes[0].name) + " is the root",
                 instead);
  const auto parent = static_cast<std::size_t>(s.nodes[i].parent);
  if (model::children_of(s, parent).size() > 1) return {};
  return error(
      ErrorCode::conflict,
      "node " + text::quote(s.nodes[i].name) + " is the only child of " + shown(s.nodes[parent]),
      "Remove that instead, or solid.unwrap it.");
}

/// The subtree that is to be added: a table, or a copy of node `copy` of the solid `from`.
Result<Branch> wanted_branch(CommandContext& ctx, const Map& args, const char* table,
                             const std::set<std::string>& taken) {
  const bool is_copy = has(args, "copy");
  if (is_copy == has(args, table))
    return error(ErrorCode::invalid_argument,
                 is_copy ? "both a node to copy and a new node are given" : "no node is given",
                 "Give " + std::string(table) + " = {kind = ...}, or copy = \"name\".");
  if (!is_copy) return read_tree(ctx, *args.find(table), taken, table);
  const bool is_other = has(args, "from") && ref(args, "from") != ref(args, "id");
  const Solid& source = content<Solid>(ctx, args, has(args, "from") ? "from" : "id");
  auto at = need_node(source, text_of(args, "copy"));
  if (!at.ok()) return std::move(at).error().in(name_in(ctx, ref(args, is_other ? "from" : "id")));
  Branch b = model::copy_branch(source, *at);
  // Parameters of another solid are not known here; those of worlds are.
  if (is_other)
    std::erase_if(b.expressions, [](const auto& e) {
      const auto compiled = Expression::compile(e.second);
      return !compiled.ok() || std::any_of(compiled->names().begin(), compiled->names().end(),
                                           [](const auto& n) { return n.scope.empty(); });
    });
  return b;
}

/// Names of a copy that are taken get a number; a wanted name for its top is used as it is.
Result<void> settle_names(const Solid& s, const Map& args, Branch& b) {
  if (has(args, "copy")) model::make_names_free(s, b);
  if (!has(args, "name")) return {};
  const std::string wanted = text_of(args, "name");
  if (wanted == b.nodes[0].name) return {};
  if (wanted.empty() || wanted.find('.') != std::string::npos)
    return error(ErrorCode::invalid_argument, text::quote(wanted) + " cannot name a node",
                 "Use letters, digits and _.");
  const auto same = [&](const SolidNode& n) { return n.name == wanted; };
  if (std::any_of(s.nodes.begin(), s.nodes.end(), same) ||
      std::any_of(b.nodes.begin(), b.nodes.end(), same))
    return error(ErrorCode::conflict, "there is already a node named " + text::quote(wanted));
  std::map<std::string, std::string> expressions;
  for (auto& [path, text] : b.expressions)
    expressions.emplace(path.starts_with(b.nodes[0].name + ".")
                            ? wanted + path.substr(b.nodes[0].name.size())
                            : path,
                        std::move(text));
  b.expressions = std::move(expressions);
  b.nodes[0].name = wanted;
  return {};
}

template <class Fn>
Result<Value> edit_solid(CommandContext& ctx, const Map& args, Fn&& fn) {
  const AnyId id = ref(args, "id");
  std::string name;
  auto done = change<Solid>(ctx, id, [&](Solid& s) -> Result<void> {
    RMP_TRY_ASSIGN(name, fn(s));
    return {};
  });
  if (!done.ok()) return std::move(done).in(name_in(ctx, id)).error();
  return name.empty() ? Value() : Value(name);
}

Result<Value> add_node(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(Branch b, wanted_branch(ctx, args, "node", node_names(content<Solid>(ctx, args))));
  return edit_solid(ctx, args, [&](Solid& s) -> Result<std::string> {
    RMP_TRY_ASSIGN(const std::size_t parent, has(args, "parent")
                                                 ? need_node(s, text_of(args, "parent"))
                                                 : Result<std::size_t>(0));
    RMP_TRY(check_room(s, parent));
    RMP_TRY_ASSIGN(const std::size_t at, child_place(s, parent, args));
    RMP_TRY(settle_names(s, args, b));
    std::string made = b.nodes[0].name;
    model::insert_branch(s, at, static_cast<std::int32_t>(parent), std::move(b));
    return made;
  });
}

Result<Value> remove_node(CommandContext& ctx, const Map& args) {
  return edit_solid(ctx, args, [&](Solid& s) -> Result<std::string> {
    RMP_TRY_ASSIGN(const std::size_t at, need_node(s, text_of(args, "node")));
    RMP_TRY(check_leaves(s, at, "Remove the solid instead."));
    model::take_branch(s, at);
    return std::string();
  });
}

Result<Value> duplicate_node(CommandContext& ctx, const Map& args) {
  return edit_solid(ctx, args, [&](Solid& s) -> Result<std::string> {
    RMP_TRY_ASSIGN(const std::size_t at, need_node(s, text_of(args, "node")));
    if (at == 0)
      return error(ErrorCode::conflict, "node " + text::quote(s.nodes[0].name) + " is the root",
                   "Wrap it in an operation first: solid.wrap.");
    const auto parent = static_cast<std::size_t>(s.nodes[at].parent);
    RMP_TRY(check_room(s, parent));
    Branch b = model::copy_branch(s, at);
    model::make_names_free(s, b);
    RMP_TRY(settle_names(s, args, b));
    std::string made = b.nodes[0].name;
    model::insert_branch(s, model::subtree_end(s, at), static_cast<std::int32_t>(parent),
                         std::move(b));
    return made;
  });
}

Result<Value> replace_node(CommandContext& ctx, const Map& args) {
  const Solid& before = content<Solid>(ctx, args);
  auto found = need_node(before, text_of(args, "node"));
  if (!found.ok()) return std::move(found).error().in(name_in(ctx, ref(args, "id")));
  std::set<std::string> taken = node_names(before);
  for (std::size_t k = *found; k < model::subtree_end(before, *found); ++k)
    taken.erase(before.nodes[k].name);
  RMP_TRY_ASSIGN(Branch b, wanted_branch(ctx, args, "with", taken));
  const Value* table = args.find("with");
  const Map* map = table ? table->as_map() : nullptr;
  const auto is_given = [&](std::string_view key) { return map && map->find(key); };
  const bool is_placed =
      std::any_of(std::begin(kPlacementFields), std::end(kPlacementFields), is_given);
  return edit_solid(ctx, args, [&](Solid& s) -> Result<std::string> {
    const std::size_t at = *found;
    const SolidNode old = s.nodes[at];
    if (!is_placed) {
      b.nodes[0].placement = old.placement;
      b.nodes[0].is_global = old.is_global;
      if (!is_given("centred"))
        b.nodes[0].is_centred = old.is_centred && model::height_of(b.nodes[0].kind).has_value();
      std::erase_if(b.expressions, [&](const auto& e) {
        const std::string& top = b.nodes[0].name;
        return e.first.starts_with(top + ".position.") || e.first.starts_with(top + ".rpy.") ||
               e.first.starts_with(top + ".xyz.") || e.first.starts_with(top + ".zyz.");
      });
    }
    // The new node takes the old one's name unless it brings its own.
    if (!is_given("name") && !has(args, "copy")) {
      std::map<std::string, std::string> expressions;
      const std::string& top = b.nodes[0].name;
      const bool is_free = std::none_of(b.nodes.begin() + 1, b.nodes.end(),
                                        [&](const SolidNode& n) { return n.name == old.name; });
      if (is_free) {
        for (auto& [path, text] : b.expressions)
          expressions.emplace(
              path.starts_with(top + ".") ? old.name + path.substr(top.size()) : path,
              std::move(text));
        b.expressions = std::move(expressions);
        b.nodes[0].name = old.name;
      }
    }
    if (at == 0) {
      const auto parameters = s.parametric.parameters;
      const std::string chord = [&] {
        const auto it = s.parametric.expressions.find("chord");
        return it == s.parametric.expressions.end() ? std::string() : it->second;
      }();
      s.nodes.clear();
      s.parametric.expressions.clear();
      if (!chord.empty()) s.parametric.expressions.emplace("chord", chord);
    } else {
      model::take_branch(s, at);
    }
    RMP_TRY(settle_names(s, args, b));
    std::string made = b.nodes[0].name;
    model::insert_branch(s, at, old.parent, std::move(b));
    return made;
  });
}

/// The operations above a node that put what it makes elsewhere than its frame says.
std::vector<std::string> displacing_above(const Solid& s, std::size_t at) {
  std::vector<std::string> out;
  for (auto k = s.nodes[at].parent; k >= 0; k = s.nodes[static_cast<std::size_t>(k)].parent) {
    const SolidNode& n = s.nodes[static_cast<std::size_t>(k)];
    if (n.kind == CsgKind::scale || n.kind == CsgKind::mirror ||
        n.kind == CsgKind::linear_pattern || n.kind == CsgKind::circular_pattern)
      out.push_back(shown(n));
  }
  return out;
}

Result<Value> move_node(CommandContext& ctx, const Map& args) {
  std::vector<std::string> before, after;
  auto done = edit_solid(ctx, args, [&](Solid& s) -> Result<std::string> {
    RMP_TRY_ASSIGN(std::size_t at, need_node(s, text_of(args, "node")));
    const std::string name = s.nodes[at].name;
    if (at == 0)
      return error(ErrorCode::conflict, "node " + text::quote(name) + " is the root",
                   "Move other nodes out of it instead.");
    const auto from = static_cast<std::size_t>(s.nodes[at].parent);
    RMP_TRY_ASSIGN(const std::size_t to, has(args, "parent") ? need_node(s, text_of(args, "parent"))
                                                             : Result<std::size_t>(from));
    if (to >= at && to < model::subtree_end(s, at))
      return error(ErrorCode::conflict,
                   to == at ? "node " + text::quote(name) + " cannot be moved into itself"
                            : "node " + text::quote(s.nodes[to].name) + " is inside " +
                                  text::quote(name) + ", which would be moved into it",
                   "Choose an operation outside it.");
    if (to != from) {
      RMP_TRY(check_leaves(s, at, ""));
      RMP_TRY(check_room(s, to));
    }
    const Pose place = model::solid_T_node(s, at);
    before = displacing_above(s, at);
    const std::string parent_name = s.nodes[to].name;
    Branch b = model::take_branch(s, at);
    const std::size_t parent = *model::find_node(s, parent_name);
    RMP_TRY_ASSIGN(at, child_place(s, parent, args));
    model::insert_branch(s, at, static_cast<std::int32_t>(parent), std::move(b));
    if (flag(args, "stay")) model::place_node(s, at, place);
    after = displacing_above(s, at);
    return std::string();
  });
  std::vector<std::string> unlike;
  for (const auto& [some, others] : {std::pair{&before, &after}, std::pair{&after, &before}})
    for (const std::string& n : *some)
      if (std::find(others->begin(), others->end(), n) == others->end()) unlike.push_back(n);
  if (done.ok() && flag(args, "stay") && !unlike.empty())
    ctx.app.messages.post(Severity::info, "stay",
                          "The frame of " + text::quote(text_of(args, "node")) +
                              " stays; what it makes does not, by " + text::enumerate(unlike) + ".",
                          name_in(ctx, ref(args, "id")));
  return done;
}

Result<Value> unwrap(CommandContext& ctx, const Map& args) {
  return edit_solid(ctx, args, [&](Solid& s) -> Result<std::string> {
    RMP_TRY_ASSIGN(const std::size_t at, has(args, "node") ? need_node(s, text_of(args, "node"))
                                                           : Result<std::size_t>(0));
    const SolidNode op = s.nodes[at];
    if (is_primitive(op.kind))
      return error(ErrorCode::conflict, shown(op) + " is a primitive; there is nothing inside it",
                   "Use solid.remove_node.");
    const auto children = model::children_of(s, at);
    const bool needs_one =
        op.parent < 0 ||
        csg_info(s.nodes[static_cast<std::size_t>(op.parent)].kind).children == CsgChildren::one;
    if (needs_one && children.size() != 1)
      return error(ErrorCode::conflict,
                   shown(op) + " has " + std::to_string(children.size()) + " nodes, and " +
                       (op.parent < 0 ? std::string("a solid has a single root")
                                      : shown(s.nodes[static_cast<std::size_t>(op.parent)]) +
                                            " takes one node"),
                   "Move or remove the others first.");
    std::vector<Pose> places;
    for (const std::size_t c : children) places.push_back(model::solid_T_node(s, c));
    std::vector<std::string> names;
    for (const std::size_t c : children) names.push_back(s.nodes[c].name);
    std::erase_if(s.parametric.expressions, [&](const auto& e) {
      const Solid& now = s;
      const Branch alone{{now.nodes[at]}, {}};
      return e.first.starts_with(alone.nodes[0].name + ".") &&
             std::none_of(now.nodes.begin(), now.nodes.end(), [&](const SolidNode& n) {
               return n.name.size() > alone.nodes[0].name.size() &&
                      e.first.starts_with(n.name + ".");
             });
    });
    s.nodes.erase(s.nodes.begin() + static_cast<std::ptrdiff_t>(at));
    for (SolidNode& n : s.nodes) {
      if (n.parent == static_cast<std::int32_t>(at)) n.parent = op.parent;
      else if (n.parent > static_cast<std::int32_t>(at)) --n.parent;
    }
    for (std::size_t k = 0; k < names.size(); ++k)
      model::place_node(s, *model::find_node(s, names[k]), places[k]);
    return std::string();
  });
}

Result<Value> wrap(CommandContext& ctx, const Map& args) {
  std::set<std::string> taken = node_names(content<Solid>(ctx, args));
  const CsgNodeInfo* info = csg_info(text_of(args, "kind"));
  Map fields;
  if (const Value* v = args.find("fields"); v && v->as_map()) fields = *v->as_map();
  if (has(args, "name")) fields.set("name", *args.find("name"));
  RMP_TRY_ASSIGN(Branch op, read_operation(ctx, info->kind, fields, taken, "fields"));
  taken.insert(op.nodes[0].name);
  Branch with;
  if (has(args, "with")) {
    if (info->children == CsgChildren::one)
      return error(ErrorCode::invalid_argument, std::string(info->name) + " takes one node only",
                   "Leave with out.", name_in(ctx, ref(args, "id")));
    RMP_TRY_ASSIGN(with, read_tree(ctx, *args.find("with"), taken, "with"));
  }
  return edit_solid(ctx, args, [&](Solid& s) -> Result<std::string> {
    RMP_TRY_ASSIGN(const std::size_t at, has(args, "node") ? need_node(s, text_of(args, "node"))
                                                           : Result<std::size_t>(0));
    const std::int32_t above = s.nodes[at].parent;
    std::string made = op.nodes[0].name;
    model::insert_branch(s, at, above, std::move(op));
    s.nodes[at].parent = above;
    s.nodes[at + 1].parent = static_cast<std::int32_t>(at);
    if (!with.nodes.empty())
      model::insert_branch(s, model::subtree_end(s, at), static_cast<std::int32_t>(at),
                           std::move(with));
    return made;
  });
}

const char* const kEditedPlate =
    "local plate = solid.create{name = \"plate\", root = {kind = \"difference\", name = \"cut\", "
    "children = {\n"
    "  {kind = \"box\", name = \"body\", x = 0.2, y = 0.1, z = 0.01},\n"
    "  {kind = \"cylinder\", name = \"bore\", radius = 0.01, height = 0.03, position = {0, 0, "
    "-0.01}}}}}\n";

std::string with_edited_plate(const char* rest) { return std::string(kEditedPlate) + rest; }

ParamSpec index_field() {
  ParamSpec p =
      optional("index", "int", "", "Its number among the nodes there; by default the last.");
  p.min = 1;
  return p;
}

}  // namespace

RMP_COMMANDS(solid_node_commands) {
  std::vector<CommandSpec> all;
  const ParamSpec copy =
      optional("copy", "string", "", "Name of a node to copy, with all below it, instead.");
  const ParamSpec from =
      optional("from", "ref:solid", "", "The solid of the node to copy; by default this one.");
  all.push_back(
      {.name = "solid.add_node",
       .classic = "",
       .summary = "Adds a node, or a whole tree of nodes, below an operation.",
       .details = "Nodes of a copy are numbered if their names are taken. A copy within the solid "
                  "keeps its expressions over parameters; a copy from another solid keeps only "
                  "those over parameters of worlds.",
       .example = with_edited_plate(
           "plate:add_node{node = {kind = \"cylinder\", name = \"second\", radius = 0.005, height "
           "= 0.03, position = {0.05, 0, -0.01}}}\n"
           "plate:add_node{copy = \"second\", name = \"third\", index = 2}\n"
           "assert(plate:tree().children[2].name == \"third\")"),
       .params = {self("solid"), optional("node", "map", "", "The node, as in solid.create."),
                  optional("parent", "string", "", "Name of the operation; the root if omitted."),
                  index_field(), copy, from, optional("name", "string", "", "Name of the copy.")},
       .returns = {"string", "", "Name of the node.", {}},
       .effect = Effect::edits,
       .run = add_node,
       .takes_expressions = true});
  all.push_back({.name = "solid.remove_node",
                 .classic = "",
                 .summary = "Removes a node and all below it.",
                 .details = "",
                 .example = with_edited_plate(
                     "plate:add_node{node = {kind = \"sphere\", name = \"dent\", radius = "
                     "0.004}}\nplate:remove_node(\"dent\")\nassert(#plate:tree().children == 2)"),
                 .params = {self("solid"), needed("node", "string", "", "Its name.")},
                 .returns = {},
                 .effect = Effect::edits,
                 .run = remove_node});
  all.push_back({.name = "solid.duplicate_node",
                 .classic = "",
                 .summary = "Copies a node and all below it, and inserts the copy after it.",
                 .details = "Its expressions are copied, too.",
                 .example = with_edited_plate(
                     "local name = plate:duplicate_node(\"bore\")\nplate:set{path = name "
                     ".. \".position.x\", value = \"50 mm\"}\n"
                     "assert(name == \"bore_2\" and #plate:tree().children == 3)"),
                 .params = {self("solid"), needed("node", "string", "", "Its name."),
                            optional("name", "string", "", "Name of the copy.")},
                 .returns = {"string", "", "Name of the copy.", {}},
                 .effect = Effect::edits,
                 .run = duplicate_node});
  all.push_back({.name = "solid.replace_node",
                 .classic = "",
                 .summary = "Replaces a node by another node, or a tree of nodes.",
                 .details = "The new node has the placement of the old one, and its name unless it "
                            "has a name itself.",
                 .example = with_edited_plate(
                     "plate:replace_node{node = \"bore\", with = {kind = \"box\", x = "
                     "0.02, y = 0.02, z = 0.03}}\n"
                     "local t = plate:tree().children[2]\n"
                     "assert(t.kind == \"box\" and t.name == \"bore\" and "
                     "t.placement.position[3] == -0.01)"),
                 .params = {self("solid"), needed("node", "string", "", "The node to remove."),
                            optional("with", "map", "", "The new node, as in solid.create."), copy,
                            from, optional("name", "string", "", "Its name.")},
                 .returns = {"string", "", "Name of the new node.", {}},
                 .effect = Effect::edits,
                 .run = replace_node,
                 .takes_expressions = true});
  all.push_back(
      {.name = "solid.move_node",
       .classic = "",
       .summary = "Moves a node, with all below it, to another operation or to another place in "
                  "its operation.",
       .details =
           "Order matters in a difference: the other nodes are subtracted from the first one.",
       .example = with_edited_plate(
           "plate:wrap{node = \"bore\", kind = \"union\", name = \"holes\"}\n"
           "plate:add_node{node = {kind = \"sphere\", name = \"ball\", radius = 0.02}}\n"
           "plate:move_node{node = \"ball\", parent = \"holes\", index = 1}\n"
           "assert(plate:tree().children[2].children[1].name == \"ball\")"),
       .params = {self("solid"), needed("node", "string", "", "Its name."),
                  optional("parent", "string", "",
                           "Name of the operation; by default the present one."),
                  index_field(),
                  defaulted(
                      "stay", "bool", "", Value(true),
                      "True keeps its place in the solid, false the numbers of its placement.")},
       .returns = {},
       .effect = Effect::edits,
       .run = move_node});
  all.push_back(
      {.name = "solid.wrap",
       .classic = "",
       .summary = "Puts an operation or a modifier around a node, optionally with a second node.",
       .details = "",
       .example = "local pin = solid.create{name = \"pin\", root = {kind = \"cylinder\", radius = "
                  "0.01, height = 0.05}}\n"
                  "pin:wrap{kind = \"difference\", with = {kind = \"cylinder\", name = \"bore\", "
                  "radius = 0.004, height = 0.05}}\nassert(pin:tree().kind == \"difference\")\n"
                  "pin:wrap{kind = \"chamfer\", fields = {distance = \"1 mm\", select = \"top\"}}\n"
                  "assert(pin:tree().distance == 0.001)",
       .params = {self("solid"), choice("kind", kind_words(false), "The operation.", true),
                  optional("node", "string", "",
                           "The node that becomes its first child; the root if omitted."),
                  optional("with", "map", "", "A second child, as in solid.create."),
                  optional("name", "string", "", "Name of the operation."),
                  optional("fields", "map", "",
                           "Its other fields, as in solid.create: sizes, select, placement.")},
       .returns = {"string", "", "Name of the operation.", {}},
       .effect = Effect::edits,
       .run = wrap,
       .takes_expressions = true});
  all.push_back(
      {.name = "solid.unwrap",
       .classic = "",
       .summary = "Removes an operation or modifier and keeps the nodes inside at their places.",
       .details = "At the root, and inside a modifier, it must have a single node.",
       .example = with_edited_plate("plate:wrap{node = \"bore\", kind = \"union\", name = "
                                    "\"holes\", fields = {position = {0.05, 0, 0}}}\n"
                                    "plate:unwrap(\"holes\")\n"
                                    "assert(plate:tree().children[2].placement.position[1] == "
                                    "0.05)"),
       .params = {self("solid"),
                  optional("node", "string", "",
                           "Name of the operation or modifier; the root if omitted.")},
       .returns = {},
       .effect = Effect::edits,
       .run = unwrap});
  return all;
}

}  // namespace robomosp::ioci
