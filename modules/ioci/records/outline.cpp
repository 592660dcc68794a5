// SPDX-License-Identifier: Apache-2.0
// Outlines: the records of the document and their named parts as rows, for trees of windows and
// browsers. Both follow the declarations of the fields.
#include <algorithm>

#include "ioci/core/commands.h"
#include "model/data.h"
#include "model/field_path.h"

namespace robomosp::ioci {
namespace {

Result<Value> document_outline(CommandContext& ctx, const Map&) {
  const auto folders = library_folders(ctx.app);
  List out;
  for (const AnyId id : ctx.snapshot().list()) {
    if (ctx.progress.cancelled()) return error(ErrorCode::cancelled, "cancelled");
    const model::Record& r = *ctx.snapshot().find(id);
    Map row{{"id", Application::handle(id)}, {"kind", to_string(id.kind)}, {"name", r.name}};
    if (!r.file.empty()) row.append("file", r.file);
    if (!r.file.empty() && is_within(folders, r.file)) row.append("is_library", true);
    out.emplace_back(std::move(row));
  }
  return Value(std::move(out));
}

constexpr const char* kRowType =
    "list<map{number: int \"Its number in the list, from 1.\"; path: string \"As record.set takes "
    "it.\"; name: string \"Empty if it has none.\"; detail?: string \"Its kind, joint or shape.\"; "
    "refers?: ref:any \"The record that it places or runs.\"; parent?: int \"Number of the part "
    "that it belongs to.\"}>";

/// The choice of a word or provider that distinguishes one element from its neighbours, and the
/// record that it refers to.
struct ElementFacts {
  std::string detail;
  AnyId refers;
};

ElementFacts facts_of(const model::Type& type, const void* element) {
  ElementFacts facts;
  for (const model::Field& f : type.fields) {
    if (f.counts && !f.counts(element)) continue;
    const void* value = f.in(element);
    if (f.type->shape == model::Shape::word && (f.name == "kind" || f.name == "joint"))
      facts.detail = f.type->word_of(value);
    else if (f.type == &model::type_of<model::ProviderChoice>() && facts.detail.empty())
      facts.detail = static_cast<const model::ProviderChoice*>(value)->name;
    else if (f.type->shape == model::Shape::reference && !facts.refers)
      facts.refers = f.type->id(value);
  }
  return facts;
}

/// The list of which an element names its parent by an index; null = elements have no parents.
const model::Field* parent_field(const model::Field& list) {
  for (const model::Field& f : list.type->element->fields)
    if (f.name == "parent" && f.index_in == list.name) return &f;
  return nullptr;
}

/// Lists of what has a name, and the segments and steps that are counted.
bool is_outlined(const model::Field& f) {
  if (f.type->shape != model::Shape::list || f.type->element->shape != model::Shape::structure)
    return false;
  const model::Field* name = f.type->element->field("name");
  if (name) return name->type->shape == model::Shape::text;
  return f.name == "segments" || f.name == "steps";
}

/// The path of an element as record.set takes it: by name where that leads to the same element.
std::string element_path(const model::Content& record, const model::Field& list, std::size_t i,
                         const std::string& name, const void* element) {
  const std::string prefix = std::string(list.name) + ".";
  if (!name.empty()) {
    const auto by_name = model::find(record, prefix + name);
    if (by_name && by_name->data == element) return prefix + name;
  }
  return prefix + std::to_string(i + 1);
}

Map row_of(const CommandContext& ctx, const model::Content& record, const model::Field& list,
           const void* elements, std::size_t i, const model::Field* parent) {
  const model::Type& type = *list.type->element;
  const void* element = list.type->at(elements, i);
  const std::string* text = model::name_of(type, element);
  ElementFacts facts = facts_of(type, element);
  Map row{{"number", i + 1},
          {"path", element_path(record, list, i, text ? *text : std::string(), element)},
          {"name", text ? *text : std::string()}};
  if (!facts.detail.empty()) row.append("detail", std::move(facts.detail));
  if (facts.refers && ctx.snapshot().find(facts.refers))
    row.append("refers", Application::handle(facts.refers));
  if (parent)
    if (const std::int64_t above = parent->type->whole(parent->in(element)); above >= 0)
      row.append("parent", above + 1);
  return row;
}

Result<Value> record_outline(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const AnyId id, read_ref(ctx, "any", *args.find("id"), "id"));
  const model::Record& r = *ctx.snapshot().find(id);
  const model::Content record = model::content(r.body);
  const std::string group = text_of(args, "group");
  const auto from = static_cast<std::size_t>(integer(args, "from") - 1);
  const auto at_most = static_cast<std::size_t>(integer(args, "at_most"));
  List out;
  std::vector<std::string> known;
  for (const model::Field& f : record.type->fields) {
    if (!is_outlined(f)) continue;
    known.emplace_back(f.name);
    if (!group.empty() && group != f.name) continue;
    const void* elements = f.in(record.data);
    const std::size_t count = f.type->length(elements);
    if (count == 0 && group.empty()) continue;
    const model::Field* parent = parent_field(f);
    List rows;
    for (std::size_t i = from; i < count && rows.size() < at_most; ++i) {
      if (ctx.progress.cancelled()) return error(ErrorCode::cancelled, "cancelled");
      rows.emplace_back(row_of(ctx, record, f, elements, i, parent));
    }
    out.emplace_back(Map{{"group", f.name},
                         {"label", f.shown_name()},
                         {"kind", f.word_in_files()},
                         {"count", count},
                         {"rows", std::move(rows)}});
  }
  if (!group.empty() && out.empty()) {
    Error e = unknown_name("group", group, known);
    e.message += " in " + name_in(ctx, id);
    return e;
  }
  return Value(std::move(out));
}

}  // namespace

RMP_COMMANDS(outline_commands) {
  std::vector<CommandSpec> all;
  all.push_back(
      {.name = "document.outline",
       .classic = "",
       .summary = "Lists all records with their names, kinds and files.",
       .details = "In order of creation. record.outline lists the parts of one.",
       .example = "material.create{name = \"brass\", density = 8500}\n"
                  "local rows = document.outline()\n"
                  "assert(#rows == 1 and rows[1].name == \"brass\")",
       .params = {},
       .returns = {"list",
                   "",
                   "",
                   {field("id", "handle", "", "The record."),
                    field("kind", "string", "", "Its kind."),
                    field("name", "string", "", "Its name."),
                    field("file", "string", "", "Its file, if it has one."),
                    field("is_library", "bool", "", "True if the file is in the library.")}},
       .effect = Effect::reads,
       .run = document_outline});
  all.push_back(
      {.name = "record.outline",
       .classic = "",
       .summary = "Lists the named parts of a record: links, members, segments, steps, nodes.",
       .details = "A group for each list of parts that is not empty.",
       .example = "robot.create{name = \"arm\", links = {{name = \"upper\", a = 0.3}, {a = 0.2}}}\n"
                  "local links = record.outline{id = robot.get(\"arm\"), group = \"links\"}[1]\n"
                  "assert(links.count == 2 and links.rows[1].path == \"links.upper\")",
       .params = {needed("id", "ref:any", "", "A record of any kind."),
                  optional("group", "string", "", "Only this list, such as links or objects."),
                  between(defaulted("from", "int", "", 1, "Number of the first part to list."), 1,
                          1e9),
                  between(defaulted("at_most", "int", "", 1000,
                                    "Greatest number of parts to list in each group."),
                          0, 1e6)},
       .returns = {"list",
                   "",
                   "",
                   {field("group", "string", "", "Name of the list, as in paths."),
                    field("label", "string", "", "The same for people."),
                    field("kind", "string", "", "What each part is: link, segment."),
                    field("count", "int", "", "Number of all parts."),
                    field("rows", kRowType, "", "The parts from `from` on.")}},
       .effect = Effect::reads,
       .run = record_outline});
  return all;
}

}  // namespace robomosp::ioci
