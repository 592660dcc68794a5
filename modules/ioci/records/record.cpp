// SPDX-License-Identifier: Apache-2.0
// Commands that every kind of record has: list, get, remove, rename, duplicate, describe, load,
// save, text.
#include "io/legacy.h"
#include "io/native.h"
#include "ioci/core/commands.h"
#include "ioci/core/loaded.h"
#include "kernel/file_root.h"
#include "model/program_kinds.h"

namespace robomosp::ioci {
namespace {

/// Lua that makes one record of a kind, for the examples, and its name.
struct Sample {
  const char* name;
  const char* create;
  const char* article;
};
/// In order of Kind.
constexpr Sample kSamples[] = {
    {"brass", "material.create{name = \"brass\", density = 8500}", "a material"},
    {"pin",
     "solid.create{name = \"pin\", root = {kind = \"cylinder\", radius = 0.01, height = 0.05}}",
     "a solid"},
    {"bolt",
     "solid.create{name = \"pin\", root = {kind = \"cylinder\", radius = 0.01, height = "
     "0.05}}\nobject.create{name = \"bolt\", parts = {{what = \"pin\"}}}",
     "an object"},
    {"arm", "robot.create{name = \"arm\", links = {{a = 0.3}, {a = 0.2}}}", "a robot"},
    {"stroke",
     "trajectory.create{name = \"stroke\", segments = {{shape = \"line\", points = {{0, 0, 0, 0, "
     "0, 0}, {0.1, 0, 0, 0, 0, 0}}}}}",
     "a trajectory"},
    {"cell", "world.create{name = \"cell\"}", "a world"},
    {"shift", "task.create{name = \"shift\", steps = {{step = \"message\", text = \"hello\"}}}",
     "a task"},
};
constexpr Sample kProgramSample{
    "rest", "program.create{name = \"rest\", source = \"PROGRAM rest; BEGIN HALT; ENDPROGRAM;\"}",
    "a program"};
constexpr Sample kControllerSample{
    "press", "record.create{kind = \"controller\", name = \"press\", fields = {target = \"krl\"}}",
    "a controller"};

/// The kind that an entry of the table is of: one with a name, or one that registered.
using KindOf = Kind (*)();
template <Kind K>
Kind named() {
  return K;
}

template <KindOf Of>
Result<Value> list_of_kind(CommandContext& ctx, const Map&) {
  const Kind of = Of();
  List out;
  for (const AnyId id : ctx.snapshot().list(of)) out.emplace_back(Application::handle(id));
  return Value(std::move(out));
}

template <KindOf Of>
Result<Value> get(CommandContext& ctx, const Map& args) {
  const Kind of = Of();
  const std::string name = text_of(args, "name");
  if (const auto id = ctx.snapshot().find(of, name)) return Value(Application::handle(*id));
  const std::string kind(to_string(of));
  if (const auto file = library_file(ctx.app, of, name)) {
    const bool before = ctx.edit().set_outside_history(true);
    auto read = load_file(ctx, *file);
    ctx.edit().set_outside_history(before);
    RMP_TRY_ASSIGN(const auto loaded, std::move(read));
    return Value(Application::handle(loaded.id));
  }
  std::vector<std::string> known = library_names(ctx.app, of);
  for (const AnyId id : ctx.snapshot().list(of)) known.push_back(ctx.snapshot().find(id)->name);
  Error e = unknown_name(kind, name, known);
  e.message += " in the document or in the library";
  if (e.hint.empty()) e.hint = "library.list(\"" + kind + "\") lists the library.";
  return e;
}

Result<Value> remove_record(CommandContext& ctx, const Map& args) {
  RMP_TRY(ctx.edit().remove(ref(args, "id")));
  return Value();
}

Result<Value> rename_record(CommandContext& ctx, const Map& args) {
  const std::string name = text_of(args, "name");
  RMP_TRY(ctx.edit().edit(ref(args, "id"), [&](model::Record& r) -> Result<void> {
    r.name = name;
    return {};
  }));
  return Value();
}

Result<Value> duplicate(CommandContext& ctx, const Map& args) {
  const AnyId id = ref(args, "id");
  model::Record copy = *ctx.snapshot().find(id);
  copy.name = has(args, "name") ? text_of(args, "name") : ctx.edit().free_name(id.kind, copy.name);
  copy.file.clear();
  RMP_TRY_ASSIGN(const AnyId made, ctx.edit().add(std::move(copy)));
  return Value(Application::handle(made));
}

Result<Value> run_describe_record(CommandContext& ctx, const Map& args) {
  return Value(describe_record(ctx.snapshot(), ref(args, "id")));
}

template <KindOf Of>
Result<Value> load(CommandContext& ctx, const Map& args) {
  const Kind of = Of();
  const std::filesystem::path file = text_of(args, "file");
  const bool old_object = of == Kind::object && file.extension() == ".obj";
  if (old_object && file_kind(file) != FileKind::none && !io::is_legacy_file(file))
    return error(ErrorCode::invalid_argument,
                 text::quote(file.string()) + " is not an object of ROBOMOSP 1.4",
                 "import reads Wavefront meshes.");
  if (file.extension() != io::extension(of) && !old_object && !io::is_legacy_file(file)) {
    for (const Kind k : all_kinds())
      if (file.extension() == io::extension(k))
        return error(ErrorCode::invalid_argument,
                     text::quote(file.string()) + " is a " + std::string(to_string(k)) + " file",
                     std::string(to_string(k)) + ".load reads it.");
    return error(
        ErrorCode::invalid_argument,
        text::quote(file.string()) + " does not end with " + std::string(io::extension(of)),
        "Files of this kind are named *" + std::string(io::extension(of)) +
            (to_string(of) == "program"
                 ? "; program.import reads programs in text and those of controllers."
                 : "."));
  }
  RMP_TRY_ASSIGN(const auto loaded,
                 load_file(ctx, file, flag(args, "reload") ? io::Reload::yes : io::Reload::no, of));
  return Value(Application::handle(loaded.id));
}

Result<Value> save_record(CommandContext& ctx, const Map& args) {
  const AnyId id = ref(args, "id");
  const model::Record* r = ctx.snapshot().find(id);
  std::filesystem::path file = has(args, "file") ? text_of(args, "file") : r->file;
  if (file.empty())
    return error(ErrorCode::invalid_argument, name_in(ctx, id) + " was never saved",
                 "Give file = \"" + r->name + std::string(io::extension(id.kind)) + "\".");
  if (!has(args, "file") && is_within(library_folders(ctx.app), file))
    return error(ErrorCode::permission,
                 name_in(ctx, id) +
                     " is in a file of the library, which all documents share: " + file.string(),
                 "Give file = \"" + r->name + std::string(io::extension(id.kind)) +
                     "\", or that file's own name to change the library.");
  if (file.extension() != io::extension(id.kind))
    return error(
        ErrorCode::invalid_argument,
        text::quote(file.string()) + " does not end with " + std::string(io::extension(id.kind)),
        "Name it " + text::quote(file.stem().string() + std::string(io::extension(id.kind))) + ".");
  std::vector<std::filesystem::path> replaced;
  RMP_TRY_ASSIGN(const auto written,
                 io::save(ctx.edit(), id, file, ctx.app.library, save_options(args, replaced)));
  report_replaced(ctx, Severity::info, replaced);
  List out;
  for (const auto& path : written) out.emplace_back(path.string());
  return Value(std::move(out));
}

Result<Value> native_text(CommandContext& ctx, const Map& args) {
  const AnyId id = ref(args, "id");
  const model::Record* r = ctx.snapshot().find(id);
  const std::filesystem::path file =
      r->file.empty() ? std::filesystem::path(r->name + std::string(io::extension(id.kind)))
                      : std::filesystem::path(r->file);
  RMP_TRY_ASSIGN(auto out, io::print(ctx.snapshot(), id, file, ctx.app.library));
  return Value(std::move(out));
}

template <KindOf Of>
void add_kind(std::vector<CommandSpec>& all, const Sample& s) {
  const Kind of = Of();
  const std::string kind(to_string(of)), a = s.article, make = s.create, name = s.name,
                                         extension(io::extension(of));
  const bool world = of == Kind::world;
  const auto quoted = "\"" + name + "\"";
  all.push_back(
      {.name = kind + ".list",
       .classic = world ? "Worlds LsWorlds" : "",
       .summary = "Lists the document's records of kind " + kind + ", in order of creation.",
       .details = "",
       .example = make + "\nassert(#" + kind + ".list() == 1)",
       .params = {},
       .returns = {"list", "", "Handles.", {}},
       .effect = Effect::reads,
       .run = list_of_kind<Of>});
  all.push_back(
      {.name = kind + ".get",
       .classic = "",
       .summary = "Finds " + a + " by name, in the document or else in the library.",
       .details = "A record from the library is loaded with everything it refers to; this is not a "
                  "step of the history, and undo does not remove it.",
       .example = make + "\nassert(" + kind + ".get(" + quoted + ").name == " + quoted + ")",
       .params = {needed("name", "string", "", "Its name.")},
       .returns = {"handle", "", "", {}},
       .effect = Effect::reads,
       .sometimes = Effect::files_read | Effect::edits,
       .run = get<Of>});
  all.push_back(
      {.name = kind + ".remove",
       .classic = world ? "World Close" : "",
       .summary = "Removes " + a + "; refused while others refer to it.",
       .details = "",
       .example = make + "\n" + kind + ".remove(" + quoted + ")\nassert(#" + kind + ".list() == 0)",
       .params = {self(kind)},
       .returns = {},
       .effect = Effect::edits,
       .run = remove_record});
  all.push_back(
      {.name = kind + ".rename",
       .classic = "",
       .summary = "Renames " + a + ".",
       .details = "References use ids and stay valid. The file it was saved to does not change.",
       .example = make + "\n" + kind + ".rename(" + quoted + ", \"another\")\nassert(" + kind +
                  ".get(\"another\"))",
       .params = {self(kind), needed("name", "string", "", "The new name, unique among its kind.")},
       .returns = {},
       .effect = Effect::edits,
       .run = rename_record});
  all.push_back(
      {.name = kind + ".duplicate",
       .classic = "",
       .summary = "Makes a copy of " + a + ".",
       .details = "The copy refers to the same records and has no file yet.",
       .example = make + "\nlocal copy = " + kind + ".duplicate(" + quoted + ")\nassert(#" + kind +
                  ".list() == 2)",
       .params = {self(kind), optional("name", "string", "",
                                       "Name of the copy; a free one is chosen if omitted.")},
       .returns = {"handle", "", "", {}},
       .effect = Effect::edits,
       .run = duplicate});
  all.push_back(
      {.name = kind + ".describe",
       .classic = world ? "World Show" : "",
       .summary = "Returns all fields of " + a + " as nested tables.",
       .details = "Lengths are in metres, angles in radians; references are names.",
       .example = make + "\nassert(" + kind + ".describe(" + quoted + ").name == " + quoted + ")",
       .params = {self(kind)},
       .returns = {"map<any>{kind: string; name: string; file?: string}",
                   "",
                   "Its kind, its name, its file if it was loaded or saved, and the fields of the "
                   "kind, which record.schema describes.",
                   {}},
       .effect = Effect::reads,
       .run = run_describe_record});
  all.push_back(
      {.name = kind + ".load",
       .classic = world ? "Worlds Open" : "",
       .summary = "Loads " + a + " and everything it refers to from a " + extension + " file.",
       .details =
           std::string("The load succeeds completely or changes nothing, and is one step. A file "
                       "that is already in the document is not loaded again unless reload is true; "
                       "a message reports if it has changed on disk since.") +
           (of <= Kind::object ? " Files of ROBOMOSP 1.4 (2006) are recognised by their content "
                                 "and read as well (.mtr, .csg, .obj)."
                               : ""),
       .example = make + "\nlocal file = \"example" + extension + "\"\n" + kind +
                  ".save{id = " + quoted + ", file = file}\ndocument.clear()\n" + kind +
                  ".load(file)\nassert(#" + kind + ".list() == 1)",
       .params = {needed("file", "path", "", "The file."), reload_field()},
       .returns = {"handle", "", "", {}},
       .effect = Effect::files_read | Effect::edits,
       .run = load<Of>});
  all.push_back(
      {.name = kind + ".save",
       .classic = world ? "World Save" : "",
       .summary = "Saves " + a + " to a " + extension + " file.",
       .details = "Records it refers to that were never saved are saved to the same folder. Saving "
                  "is not a step of the history: undo leaves the record saved. Nothing is written "
                  "if another program changed the file meanwhile.",
       .example = make + "\nlocal written = " + kind + ".save{id = " + quoted +
                  ", file = \"example" + extension + "\"}\nassert(#written >= 1)",
       .params = {self(kind),
                  optional("file", "path", "", "The file; by default the one it came from."),
                  overwrite_field()},
       .returns = {"list", "", "Paths of the files written.", {}},
       .effect = Effect::files_write | Effect::edits,
       .run = save_record});
  all.push_back(
      {.name = kind + ".text",
       .classic = "",
       .summary = "Returns the text that saving " + a + " would write.",
       .details = "",
       .example = (of == Kind::object ? "local dir = \"example\"\n" + make +
                                            "\nsolid.save{id = \"pin\", file = dir .. \".csg\"}"
                                      : make) +
                  "\nassert(" + kind + ".text(" + quoted + "):find(\"robomosp " + kind + "\"))",
       .params = {self(kind)},
       .returns = {"string", "", "", {}},
       .effect = Effect::reads,
       .run = native_text});
}

}  // namespace

RMP_COMMANDS(record_commands) {
  std::vector<CommandSpec> all;
  add_kind<named<Kind::material>>(all, kSamples[static_cast<std::size_t>(Kind::material)]);
  add_kind<named<Kind::solid>>(all, kSamples[static_cast<std::size_t>(Kind::solid)]);
  add_kind<named<Kind::object>>(all, kSamples[static_cast<std::size_t>(Kind::object)]);
  add_kind<named<Kind::robot>>(all, kSamples[static_cast<std::size_t>(Kind::robot)]);
  add_kind<named<Kind::trajectory>>(all, kSamples[static_cast<std::size_t>(Kind::trajectory)]);
  add_kind<named<Kind::world>>(all, kSamples[static_cast<std::size_t>(Kind::world)]);
  add_kind<named<Kind::task>>(all, kSamples[static_cast<std::size_t>(Kind::task)]);
  add_kind<program_kind>(all, kProgramSample);
  add_kind<controller_kind>(all, kControllerSample);
  return all;
}

}  // namespace robomosp::ioci
