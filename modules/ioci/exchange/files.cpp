// SPDX-License-Identifier: Apache-2.0
// Files of any kind, and the library of shipped ones.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "io/legacy.h"
#include "io/native.h"
#include "io/recovery_journal.h"
#include "ioci/core/commands.h"
#include "ioci/core/library_files.h"
#include "ioci/core/loaded.h"
#include "kernel/file_root.h"
#include "kernel/fingerprint.h"
#include "kernel/literal.h"
#include "kernel/text.h"

namespace robomosp::ioci {
namespace {

Result<Value> library_list(CommandContext& ctx, const Map& args) {
  const Kind kind = *kind_from(text_of(args, "kind"));
  List out;
  for (const std::string& name : library_names(ctx.app, kind)) out.emplace_back(name);
  return Value(std::move(out));
}

/// The line `description "..."` of a native file, which comes before all that is long; "" without.
std::string description_in(const std::filesystem::path& file) {
  constexpr int kHeadLines = 20;
  std::ifstream in(file);
  std::string line;
  for (int i = 0; i < kHeadLines && std::getline(in, line); ++i) {
    constexpr std::string_view kWord = "description ";
    const std::string_view words = text::trim(line);
    if (!words.starts_with(kWord)) continue;
    const auto value = read_literal(text::trim(words.substr(kWord.size())));
    if (value.ok() && value->as_string()) return *value->as_string();
  }
  return {};
}

/// Files of the library with all files that they name; each is read once.
class LibraryDigests {
 public:
  explicit LibraryDigests(std::vector<std::filesystem::path> library)
      : library_(std::move(library)) {}
  /// Fingerprint of the contents of a file and of all files that it needs.
  Result<Fingerprint> of(const std::filesystem::path& file, const Progress& progress) {
    std::set<std::string> needed;
    std::vector<std::filesystem::path> open{file};
    while (!open.empty()) {
      const std::filesystem::path next = open.back();
      open.pop_back();
      if (!needed.insert(next.string()).second) continue;
      if (progress.cancelled()) return error(ErrorCode::cancelled, "cancelled");
      const Read& r = read(next);
      open.insert(open.end(), r.named.begin(), r.named.end());
    }
    Fingerprinter all("library/1");
    for (const std::string& each : needed) all.add(read(each).content);
    return all.finish();
  }

 private:
  struct Read {
    Fingerprint content;
    std::vector<std::filesystem::path> named;
  };
  const Read& read(const std::filesystem::path& file) {
    const auto [at, is_new] = files_.try_emplace(file.string());
    Read& r = at->second;
    if (!is_new) return r;
    std::ifstream in(file, std::ios::binary);
    const std::string text((std::istreambuf_iterator<char>(in)), {});
    r.content = Fingerprinter("file/1").add(text).finish();
    const std::string kind = file.extension().string();
    const auto kinds = all_kinds();
    const bool is_native =
        std::any_of(kinds.begin(), kinds.end(), [&](Kind k) { return kind == io::extension(k); });
    if (!is_native) return r;
    for (const std::string_view line : text::split(text, '\n')) add_named(line, file, r.named);
    return r;
  }
  /// Native files name others between quotation marks, relative to their folder or to one of the
  /// library's.
  void add_named(std::string_view line, const std::filesystem::path& file,
                 std::vector<std::filesystem::path>& named) const {
    for (std::size_t i = 0; i < line.size() && line[i] != '#'; ++i) {
      if (line[i] != '"') continue;
      const std::size_t begin = ++i;
      while (i < line.size() && line[i] != '"') i += line[i] == '\\' ? 2 : 1;
      if (i >= line.size()) return;
      const std::string_view word = line.substr(begin, i - begin);
      if (word.find('.') == std::string_view::npos) continue;
      std::error_code none;
      const auto add = [&](const std::filesystem::path& folder) {
        const auto found = (folder / word).lexically_normal();
        if (!std::filesystem::is_regular_file(found, none)) return false;
        named.push_back(found);
        return true;
      };
      if (add(file.parent_path())) continue;
      for (const auto& folder : library_)
        if (add(folder)) break;
    }
  }
  std::vector<std::filesystem::path> library_;
  std::map<std::string, Read> files_;
};

Result<Value> library_describe(CommandContext& ctx, const Map& args) {
  const Kind kind = *kind_from(text_of(args, "kind"));
  const bool has_digests = flag(args, "digests");
  LibraryDigests digests(ctx.app.library);
  List out;
  for (const auto& [name, file] : library_files(ctx.app, kind)) {
    if (ctx.progress.cancelled()) return error(ErrorCode::cancelled, "cancelled");
    Map row{{"name", name}, {"description", description_in(file)}};
    if (has_digests) {
      row.set("file", file.string());
      RMP_TRY_ASSIGN(const Fingerprint digest, digests.of(file, ctx.progress));
      row.set("digest", digest.hex());
    }
    out.emplace_back(std::move(row));
  }
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
       .summary = "Lists the names of a kind in the library.",
       .details = "robot.get(name) and the corresponding commands of other kinds load them.",
       .example = "for _, name in ipairs(library.list(\"robot\")) do\n  assert(#name > 0)\nend",
       .params = {choice("kind", kinds, "Kind of record.")},
       .returns = {"list", "", "Names.", {}},
       .effect = Effect::reads,
       .run = library_list});
  all.push_back(
      {.name = "library.describe",
       .classic = "",
       .summary = "Lists the names of a kind in the library with their descriptions.",
       .details = "Nothing is loaded: the descriptions are read from the beginning of the files.",
       .example = "for _, world in ipairs(library.describe(\"world\")) do\n"
                  "  assert(#world.name > 0 and #world.description > 0)\nend",
       .params = {choice("kind", kinds, "Kind of record."),
                  defaulted("digests", "bool", "", false,
                            "Also return file and digest of each; all files that they need are "
                            "read.")},
       .returns = {"list",
                   "",
                   "In order of their names.",
                   {field("name", "string", "", "The name."),
                    field("description", "string", "", "Its description; empty without one."),
                    field("file", "string", "", "With digests: its file."),
                    field("digest", "string", "",
                          "With digests: text that differs if the file, or a file that it needs, "
                          "has other content.")}},
       .effect = Effect::reads,
       .run = library_describe});
  all.push_back(
      {.name = "library.folders",
       .classic = "",
       .summary = "Lists the folders of the library.",
       .details = "Set on the command line, by ROBOMOSP_LIBRARY, or found beside the program.",
       .example = "assert(#library.folders() >= 1)",
       .params = {},
       .returns = {"list", "", "Paths.", {}},
       .effect = Effect::reads,
       .run = library_folders_of});
  all.push_back(
      {.name = "file.load",
       .classic = "",
       .summary = "Loads a file of any kind and everything it refers to.",
       .details = "The extension determines the kind: .mtr, .csg, .part, .rbt, .tjc, .wld. Files "
                  "of ROBOMOSP 1.4 (2006), including worlds and .stn files, are recognised by "
                  "their content; a .csg with several materials becomes an object (solid.load "
                  "makes one solid of it). The load succeeds completely or changes nothing, and is "
                  "one step. A file that is already in the document is not loaded again unless "
                  "reload is true; a message reports if it has changed on disk since.",
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
       .details = "They are written below the folder, which corresponds to the installation of "
                  "that program: Saves/Materials, Saves/CSGs, Saves/Objects, with all records they "
                  "refer to. If the format cannot express something, an error names the node and "
                  "nothing is written. Masses, overlap and parameters are not part of the format.",
       .example = "material.create{name = \"brass\", density = 8500}\nsolid.create{name = \"pin\", "
                  "material = \"brass\", root = {kind = \"cylinder\", radius = 0.01, height = "
                  "0.05}}\nassert(#file.export_2006{id = solid.get(\"pin\"), folder = \".\"} == "
                  "2)\ndocument.clear()\nassert(solid.load(\"Saves/CSGs/pin.csg\").name == "
                  "\"pin\")",
       .params = {needed("id", "ref:material|solid|object", "", "The record to write."),
                  needed("folder", "path", "", "The folder; it must exist."),
                  defaulted("overwrite", "bool", "", false, "Replace existing files that differ.")},
       .returns = {"list", "", "Paths of the files written, that of the record last.", {}},
       .effect = Effect::files_write,
       .run = export_2006});
  const auto saving = [](ParamSpec folder) {
    return Schema{
        std::move(folder),
        defaulted("library", "bool", "", false, "Also save records that came from the library."),
        overwrite_field()};
  };
  all.push_back(
      {.name = "document.save",
       .classic = "",
       .summary = "Saves every record of the document.",
       .details = "A record is saved to the file it came from; a record that was never saved goes "
                  "to the folder, as its name with the extension of its kind. Records from the "
                  "library are skipped unless requested. Nothing is written if another program "
                  "changed one of the files since it was read or saved here. world.pack writes a "
                  "world with everything it needs as one file.",
       .example =
           "material.create{name = \"brass\", density = 8500}\nassert(#document.save() == 1)",
       .params = saving(defaulted("folder", "path", "", ".",
                                  "Folder for records that were never saved; it must exist.")),
       .returns = {"list", "", "Paths of the files written.", {}},
       .effect = Effect::files_write | Effect::edits,
       .run = save_all});
  all.push_back(
      {.name = "file.save_all",
       .classic = "",
       .summary = "Saves every record of the document, as document.save does with a folder.",
       .details = "A record is saved to the file it came from, otherwise to the given folder. "
                  "Records from the library are skipped unless requested. Nothing is written if "
                  "another program changed one of the files since it was read or saved here. A "
                  "message names each replaced file that contained other data of another program.",
       .example =
           "material.create{name = \"brass\", density = 8500}\nassert(#file.save_all(\".\") == 1)",
       .params = saving(needed("folder", "path", "", "Folder for records that were never saved.")),
       .returns = {"list", "", "Paths of the files written.", {}},
       .effect = Effect::files_write | Effect::edits,
       .run = save_all});
  return all;
}

}  // namespace robomosp::ioci
