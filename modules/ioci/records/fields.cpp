// SPDX-License-Identifier: Apache-2.0
// Commands for records of any kind, as the declarations of their fields say: record.schema, kinds,
// create, describe, set, save.
#include <map>
#include <memory>
#include <mutex>

#include "document/validate.h"
#include "io/native.h"
#include "ioci/core/commands.h"
#include "ioci/core/loaded.h"
#include "ioci/records/field_values.h"
#include "kernel/type_forms.h"
#include "model/field_types.h"
#include "model/parametric.h"

namespace robomosp::ioci {
namespace {

Result<Kind> kind_given(const Map& args) {
  const std::string word = text_of(args, "kind");
  if (const auto kind = kind_from(word)) return *kind;
  std::vector<std::string> known;
  for (const Kind k : all_kinds()) known.emplace_back(to_string(k));
  return unknown_name("kind of record", word, known);
}

Result<Value> kinds(CommandContext&, const Map&) {
  List out;
  for (const Kind k : all_kinds()) out.emplace_back(to_string(k));
  return Value(std::move(out));
}

/// It follows from declarations, which do not change. All kinds are registered before the first
/// command runs.
Value schema_of(const document::Snapshot& snapshot, Kind kind) {
  static std::mutex mutex;
  static std::map<Kind, std::shared_ptr<const Map>> all;  // guarded by mutex
  const std::lock_guard lock(mutex);
  std::shared_ptr<const Map>& made = all[kind];
  if (!made) {
    const model::KindInfo& about = model::info(kind);
    List form;
    for (const ParamSpec& p : model::record_fields(about)) form.emplace_back(param_value(p));
    made = std::make_shared<const Map>(Map{{"kind", about.name},
                                           {"extension", about.extension},
                                           {"folder", about.folder},
                                           {"fields", schema_fields(snapshot, *about.type)},
                                           {"form", std::move(form)}});
  }
  return Value(made);
}

Result<Value> schema(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const Kind kind, kind_given(args));
  return schema_of(ctx.snapshot(), kind);
}

Result<Value> create_of_kind(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const Kind kind, kind_given(args));
  model::Record r{text_of(args, "name"), {}, model::empty_body(kind)};
  if (has(args, "parameters")) {
    auto* parametric = model::parametric_of(r.body);
    if (!parametric)
      return error(ErrorCode::unsupported,
                   document::with_article(to_string(kind)) + " has no parameters",
                   "Leave them out.", "parameters");
    const std::string world = kind == Kind::world ? r.name : std::string();
    RMP_TRY_ASSIGN(*parametric,
                   read_parameters(ctx.snapshot(), world, args.find("parameters"), "parameters"));
  }
  if (const Value* given = args.find("fields"); given && given->as_map())
    for (const auto& [path, value] : *given->as_map()) {
      const auto at = model::find_for_change(model::content(r.body), path);
      if (!at) return unknown_path(r.body, path).in(text::quote(r.name));
      RMP_TRY(read_field(ctx, r.body, *at, value, path));
    }
  RMP_TRY_ASSIGN(const AnyId id, ctx.edit().add(std::move(r)));
  return Value(Application::handle(id));
}

Result<AnyId> record_given(CommandContext& ctx, const Map& args) {
  return read_ref(ctx, "any", *args.find("id"), "id");
}

Result<Value> describe_fields(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const AnyId id, record_given(ctx, args));
  return Value(describe_record(ctx.snapshot(), id));
}

Result<Value> set_many(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const AnyId id, record_given(ctx, args));
  const Value* value = args.find("value");
  RMP_TRY(set_path(ctx, id, text_of(args, "path"), value ? *value : Value()));
  return Value();
}

Result<Value> save_fields(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const AnyId id, record_given(ctx, args));
  std::vector<std::filesystem::path> replaced;
  RMP_TRY_ASSIGN(const auto written, io::save(ctx.edit(), id, text_of(args, "file"),
                                              ctx.app.library, save_options(args, replaced)));
  report_replaced(ctx, Severity::info, replaced);
  List out;
  for (const auto& path : written) out.emplace_back(path.string());
  return Value(std::move(out));
}

const char* const kBrass = "material.create{name = \"brass\", density = 8500}\n";
std::string with_brass(const char* rest) { return std::string(kBrass) + rest; }

ParamSpec record_field() { return needed("id", "ref:any", "", "A record of any kind."); }
ParamSpec kind_field() {
  return needed("kind", "string", "", "Kind such as \"robot\"; record.kinds lists them.");
}

}  // namespace

RMP_COMMANDS(field_commands) {
  return {
      {.name = "record.kinds",
       .classic = "",
       .summary = "Lists the kinds of records.",
       .details = "",
       .example = "assert(#record.kinds() >= 7)",
       .params = {},
       .returns = {"list", "", "Their names.", {}},
       .effect = Effect::reads,
       .run = kinds},
      {.name = "record.schema",
       .classic = "",
       .summary = "Describes the fields of a kind of record.",
       .details = "Each field has name, label, doc, type and since (the first version of the files "
                  "that has it); if applicable, unit, min or above, max, infinite, choices, "
                  "default, optional, needed, read_only, expression (its numbers may be "
                  "expressions), names (it names an element of that list) and fields, those of its "
                  "elements. A property palette can be generated from it.",
       .example =
           "local about = record.schema(\"material\")\n"
           "assert(about.extension == \".mtr\")\n"
           "for _, f in ipairs(about.fields) do\n"
           "  if f.name == \"density\" then assert(f.unit == \"kg/m^3\" and f.min == 0) end\n"
           "end",
       .params = {kind_field()},
       .returns =
           {"map",
            "",
            "",
            {field("kind", "string", "", "The kind."),
             field("extension", "string", "", "Extension of its files."),
             field("folder", "string", "", "Folder of a library that contains such records."),
             field("fields", "list", "", "Its fields."),
             field("form", "list", "",
                   "The same fields, described as ioci.describe describes arguments: types as "
                   "nested tables, groups, and conditions under which they count.")}},
       .effect = Effect::reads,
       .run = schema},
      {.name = "record.create",
       .classic = "",
       .summary = "Makes a record of any kind from its fields.",
       .details = "Fields that are not given have their defaults; record.schema lists them.",
       .example = "record.create{kind = \"material\", name = \"brass\", fields = {density = "
                  "8500}}\nassert(material.describe(\"brass\").density == 8500)",
       .params = {kind_field(), needed("name", "string", "", "Its name, unique among its kind."),
                  optional("fields", "map", "", "Values by field or path."), parameters_field()},
       .returns = {"handle", "", "", {}},
       .effect = Effect::edits,
       .run = create_of_kind},
      {.name = "record.describe",
       .classic = "",
       .summary = "Returns all fields of a record of any kind as nested tables.",
       .details = "Lengths are in metres, angles in radians; references are names.",
       .example = with_brass("assert(record.describe(\"brass\").density == 8500)"),
       .params = {record_field()},
       .returns = {"map", "", "Its values by field; record.schema describes them.", {}},
       .effect = Effect::reads,
       .run = describe_fields},
      {.name = "record.set",
       .classic = "",
       .summary = "Changes one value of a record of any kind.",
       .details = "The path starts with a field, followed by fields inside it: `density`, "
                  "`links[2].joint`, `elbow.drive.gear_ratio`, `tools.camera.position.x`. Elements "
                  "of lists are given by their place from 1 or by their name; nil removes an "
                  "optional value. Lists and tables are replaced as a whole.",
       .example = with_brass("record.set{id = \"brass\", path = \"density\", value = \"8.4 "
                             "g/cm^3\"}\nassert(material.describe(\"brass\").density == 8400)"),
       .params = {record_field(), needed("path", "string", "", "Path of the value."),
                  optional("value", "any", "", "Its new value.")},
       .returns = {},
       .effect = Effect::edits,
       .run = set_many,
       .takes_expressions = true},
      {.name = "record.save",
       .classic = "",
       .summary = "Saves a record of any kind.",
       .details = "Records it refers to that were never saved are saved to the same folder.",
       .example = with_brass("assert(#record.save{id = \"brass\", file = \"brass.mtr\"} == 1)"),
       .params = {record_field(), needed("file", "path", "", "The file."), overwrite_field()},
       .returns = {"list", "", "Paths of the files written.", {}},
       .effect = Effect::files_write | Effect::edits,
       .run = save_fields},
  };
}

}  // namespace robomosp::ioci
