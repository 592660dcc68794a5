// SPDX-License-Identifier: Apache-2.0
// Files of any kind, and the library of shipped ones.
#include <algorithm>

#include "io/legacy.h"
#include "io/native.h"
#include "io/recovery_journal.h"
#include "ioci/core/commands.h"
#include "ioci/exchange/loaded.h"
#include "kernel/file_root.h"

namespace robomosp::ioci {
namespace {

Result<Value> library_list(CommandContext& ctx, const Map& args) {
  const Kind kind = *kind_from(text_of(args, "kind"));
  List out;
  for (const std::string& name : library_names(ctx.app, kind)) out.emplace_back(name);
  return Value(std::move(out));
}

Result<Value> library_folders_of(CommandContext& ctx, const Map&) {
  List out;
  for (const auto& folder : ctx.app.library) out.emplace_back(folder.string());
  return Value(std::move(out));
}

Result<Value> load(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const auto loaded,
                 load_file(ctx, text_of(args, "file"),
                           flag(args, "reload") ? io::Reload::yes : io::Reload::no));
  return Value(Application::handle(loaded.id));
}

Result<Value> export_2006(CommandContext& ctx, const Map& args) {
  if (!ctx.snapshot().find(ref(args, "id"))->solvers.empty())
    ctx.app.messages.post(
        Severity::warning, "left_out",
        name_in(ctx, ref(args, "id")) + " keeps solvers in Lua, which files of 2006 do not hold.",
        "io");
  RMP_TRY_ASSIGN(const auto written,
                 io::export_legacy(ctx.snapshot(), ref(args, "id"), text_of(args, "folder"),
                                   flag(args, "overwrite")));
  List out;
  for (const auto& path : written) out.emplace_back(path.string());
  return Value(std::move(out));
}

Result<Value> save_all(CommandContext& ctx, const Map& args) {
  const std::filesystem::path folder = text_of(args, "folder");
  if (file_kind(folder) != FileKind::folder)
    return error(ErrorCode::not_found, "there is no folder " + text::quote(folder.string()),
                 "Create it first. One record is saved to a file by its own command, such as "
                 "robot.save.");
  const auto library =
      flag(args, "library") ? std::vector<std::filesystem::path>{} : library_folders(ctx.app);
  std::vector<std::pair<AnyId, std::filesystem::path>> wanted;
  for (const AnyId id : ctx.snapshot().list()) {
    const model::Record& r = *ctx.snapshot().find(id);
    if (r.file.empty())
      wanted.emplace_back(id, folder / (r.name + std::string(io::extension(id.kind))));
    else if (!is_within(library, r.file)) wanted.emplace_back(id, r.file);
  }
  std::vector<std::filesystem::path> replaced;
  RMP_TRY_ASSIGN(const auto written,
                 io::save_all(ctx.edit(), wanted, ctx.app.library, save_options(args, replaced)));
  report_replaced(ctx, Severity::warning, replaced);
  std::vector<std::string> left;
  std::string copy;
  for (const AnyId id : io::unsaved_records(ctx.snapshot(), ctx.app.library)) {
    const model::Record& r = *ctx.snapshot().find(id);
    if (!is_within(library, r.file)) continue;
    const std::string kind(to_string(id.kind));
    left.push_back(ctx.snapshot().describe(id));
    copy = kind + ".save{id = " + text::quote(r.name) +
           ", file = " + text::quote(r.name + std::string(io::extension(id.kind))) + "}";
  }
  if (!left.empty())
    ctx.app.messages.post(Severity::warning, "left_out",
                          text::enumerate_some(left, 4) + (left.size() == 1 ? " is" : " are") +
                              " changed and not saved: the library, where " +
                              (left.size() == 1 ? "it" : "they") +
                              " came from, is shared by all documents. " + copy + " saves a copy.",
                          "io");
  List out;
  for (const auto& path : written) out.emplace_back(path.string());
  return Value(std::move(out));
}

}  // namespace

RMP_COMMANDS(file_commands) {
  std::vector<CommandSpec> all;
  std::vector<std::string> kinds;
  for (const Kind k : all_kinds()) kinds.emplace_back(to_string(k));
  all.push_back(
      {.name = "library.list",
       .classic = "",
       .summary = "Lists the names that the library has of a kind.",
       .details = "robot.get(name) and its like load them.",
       .example = "for _, name in ipairs(library.list(\"robot\")) do\n  assert(#name > 0)\nend",
       .params = {choice("kind", kinds, "Kind of record.")},
       .returns = {"list", "", "Names.", {}},
       .effect = Effect::reads,
       .run = library_list});
  all.push_back({.name = "library.folders",
                 .classic = "",
                 .summary = "Lists the folders of the library.",
                 .details = "From the command line, ROBOMOSP_LIBRARY, or beside the program.",
                 .example = "assert(#library.folders() >= 1)",
                 .params = {},
                 .returns = {"list", "", "Paths.", {}},
                 .effect = Effect::reads,
                 .run = library_folders_of});
  all.push_back(
      {.name = "file.load",
       .classic = "",
       .summary = "Loads a file of any kind and everything it refers to.",
       .details =
           "The kind follows from the extension: .mtr, .csg, .part, .rbt, .tjc, "
           ".wld. Files of ROBOMOSP 1.4 (2006), worlds and .stn among them, are recognised "
           "by their content; a .csg of several materials becomes an object "
           "(solid.load makes one solid of it). All or nothing, as one step. A file that is in "
           "the document already is not loaded again unless reload is true; when it was "
           "changed on the disk since, a message says so.",
       .example = "material.create{name = \"brass\", density = 8500}\nlocal path = "
                  "\"example.mtr\"\nmaterial.save{id = \"brass\", file = "
                  "path}\ndocument.clear()\nassert(file.load(path).name == \"brass\")",
       .params = {needed("file", "path", "", "The file."), reload_field()},
       .returns = {"handle", "", "", {}},
       .effect = Effect::files_read | Effect::edits,
       .run = load});
  all.push_back(
      {.name = "file.export_2006",
       .classic = "",
       .summary = "Writes a material, solid or object as files of ROBOMOSP 1.4 (2006).",
       .details = "They go below the folder, which stands for that program's installation: "
                  "Saves/Materials, Saves/CSGs, Saves/Objects, with all that is referred to. What "
                  "the format cannot express is an error that names the node, and nothing is "
                  "written. Masses, overlap and parameters have no place there.",
       .example = "material.create{name = \"brass\", density = 8500}\nsolid.create{name = \"pin\", "
                  "material = \"brass\", root = {kind = \"cylinder\", radius = 0.01, height = "
                  "0.05}}\nassert(#file.export_2006{id = solid.get(\"pin\"), folder = \".\"} == "
                  "2)\ndocument.clear()\nassert(solid.load(\"Saves/CSGs/pin.csg\").name == "
                  "\"pin\")",
       .params = {needed("id", "ref:material|solid|object", "", "What to write."),
                  needed("folder", "path", "", "The folder; it must be there."),
                  defaulted("overwrite", "bool", "", false,
                            "Replace files that are there with another content.")},
       .returns = {"list", "", "Paths of the files written, its own last.", {}},
       .effect = Effect::files_write,
       .run = export_2006});
  const auto saving = [](ParamSpec folder) {
    return Schema{
        std::move(folder),
        defaulted("library", "bool", "", false, "Also write back what came from the library."),
        overwrite_field()};
  };
  all.push_back(
      {.name = "document.save",
       .classic = "",
       .summary = "Saves every record of the document.",
       .details = "A record goes to the file it came from, one that was never saved into the "
                  "folder, as its name with the extension of its kind. What came from the library "
                  "is left alone unless asked for. Nothing is written when another program changed "
                  "one of the files since it was read or saved here. world.pack writes a world "
                  "with all that it needs as one file.",
       .example =
           "material.create{name = \"brass\", density = 8500}\nassert(#document.save() == 1)",
       .params = saving(defaulted("folder", "path", "", ".",
                                  "Folder for records that were never saved; it must be there.")),
       .returns = {"list", "", "Paths of the files written.", {}},
       .effect = Effect::files_write | Effect::edits,
       .run = save_all});
  all.push_back(
      {.name = "file.save_all",
       .classic = "",
       .summary = "Saves every record of the document, as document.save does into a given folder.",
       .details = "A record goes to the file it came from, else into the folder given. What came "
                  "from the library is left alone unless asked for. Nothing is written when "
                  "another program changed one of the files since it was read or saved here; a "
                  "file that is replaced and held something of another program is named in a "
                  "message.",
       .example =
           "material.create{name = \"brass\", density = 8500}\nassert(#file.save_all(\".\") == 1)",
       .params = saving(needed("folder", "path", "", "Folder for records that were never saved.")),
       .returns = {"list", "", "Paths of the files written.", {}},
       .effect = Effect::files_write | Effect::edits,
       .run = save_all});
  return all;
}

}  // namespace robomosp::ioci
