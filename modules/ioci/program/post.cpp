// SPDX-License-Identifier: Apache-2.0
// Programs to the languages of controllers, by providers of robomosp.post/1.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <span>

#include "io/native.h"
#include "ioci/core/room_parts.h"
#include "ioci/core/watchers.h"
#include "ioci/program/compiled.h"
#include "ioci/program/in_world.h"
#include "ioci/program/post_form.h"
#include "ioci/program/program_files.h"
#include "ioci/program/workshop.h"
#include "kernel/file_root.h"
#include "model/declare.h"
#include "model/program_kinds.h"
#include "program_post/packs.h"
#include "program_post/post.h"
#include "program_post/read_back.h"
#include "program_source/source_text.h"
#include "program_source/text_faults.h"

namespace robomosp::ioci {
namespace {

using program_post::Posted, program_post::PostedFault, program_post::PostedLine,
    program_post::RunBeside;
using program_source::FaultyText, program_source::with_faults;

/// The source of a checked `id`, as a post sees it.
FaultyText posted_text(const CommandContext& ctx, const Map& args, std::string target = {}) {
  const AnyId id = ref(args, "id");
  return {id,
          &program_of(ctx, args),
          name_in(ctx, id),
          std::move(target),
          Post::kInterfaceId,
          ctx.snapshot().find(id)->name};
}

/// `e` with the errors of a post as its faults.
Error with_posted(Error e, const FaultyText& in, const rmp_code& code, const Posted& out,
                  const std::vector<FaultRemedy>& remedies = {}) {
  std::vector<Fault> faults;
  for (const PostedFault& f : out.faults)
    if (f.severity == RMP_FAULT_ERROR) faults.push_back(program_post::posted_fault(in, code, f));
  for (Fault& f : faults) f.remedies.insert(f.remedies.end(), remedies.begin(), remedies.end());
  return with_faults(std::move(e), faults);
}

List fault_list(const FaultyText& in, const rmp_code& code, const Posted& out) {
  static constexpr const char* kWords[] = {"error", "warning", "note"};
  List all;
  for (const PostedFault& f : out.faults)
    all.emplace_back(Map{
        {"severity", kWords[std::min<std::uint32_t>(f.severity, 2)]},
        {"file",
         f.span.file < code.files.count ? row<rmp_code_file>(code.files, f.span.file).name : ""},
        {"line", static_cast<std::int64_t>(f.span.line)},
        {"column", static_cast<std::int64_t>(f.span.column)},
        {"message", f.message + "."},
        {"hint", f.hint},
        {"fault", fault_map(program_post::posted_fault(in, code, f))}});
  return all;
}

/// Inputs and limits of a run that flattens.
Result<program::TraceOptions> flattening_of(const Map& args) {
  program::TraceOptions options;
  if (const Value* given = args.find("inputs"); given && given->as_map())
    for (const auto& [name, value] : *given->as_map()) {
      const double* number = value.as_real();
      const auto* whole = value.as_int();
      const bool* is_on = value.as_bool();
      if (!number && !whole && !is_on)
        return error(
            ErrorCode::invalid_argument,
            "the value of input " + text::quote(name) + " is neither a number nor true or false",
            "Such as inputs = {part_here = true}.", "inputs");
      program::SignalValue v;
      if (number) v = {std::llround(*number), *number};
      if (whole) v = {*whole, static_cast<double>(*whole)};
      if (is_on) v = {*is_on ? 1 : 0, *is_on ? 1.0 : 0.0};
      if (number && !(std::fabs(*number) < 1e9))
        return error(ErrorCode::invalid_argument,
                     "the value of input " + text::quote(name) + " is beyond 1e9", {}, "inputs");
      options.inputs[name] = v;
    }
  if (has(args, "most_steps"))
    options.most_instructions = static_cast<std::uint64_t>(integer(args, "most_steps"));
  return options;
}

Result<program_post::PostRequest> request_of(const Map& args) {
  program_post::PostRequest out;
  out.program = ref(args, "id");
  out.place = place_wish(args);
  out.robot = typed<model::Robot>(args, "robot");
  out.profile = ref(args, "profile");
  out.target = text_of(args, "target");
  if (const Value* given = args.find("params"); given && given->as_map()) {
    RMP_TRY_ASSIGN(out.params, read_provider(Value(Map{{"params", *given}}), "params"));
  }
  out.only_robot = text_of(args, "only_robot");
  out.name = text_of(args, "name");
  out.form = form_of(args);
  RMP_TRY_ASSIGN(out.flattening, flattening_of(args));
  out.lists_faults = flag(args, "check");
  return out;
}

/// What program.check_run says of the program: in its world, or alone with the robot.
Result<Map> run_of(CommandContext& ctx, const Map& args) {
  Map asked{{"id", *args.find("id")}};
  for (const char* each : {"world", "name_there", "profile", "contacts", "picture", "plot"})
    if (has(args, each)) asked.set(each, *args.find(each));
  if (has(args, "robot") && places_of(ctx.snapshot(), ref(args, "id")).empty())
    asked.set("robot", *args.find("robot"));
  RMP_TRY_ASSIGN(const Value found, ctx.dispatch("program.check_run", asked));
  return *found.as_map();
}

Map beside_map(const RunBeside& b) {
  return {{"compared", b.not_run.empty()},
          {"reader", b.reader},
          {"why_not", b.not_run},
          {"motions", static_cast<std::int64_t>(b.motions)},
          {"read_motions", static_cast<std::int64_t>(b.read_motions)},
          {"ends", static_cast<std::int64_t>(b.compared)},
          {"most_distance", b.most_mm / 1000},
          {"most_angle", b.most_degrees / program_source::kDegreesPerRadian},
          {"most_joint", b.most_joint},
          {"time", b.seconds},
          {"has_times", b.has_times},
          {"read_time", b.read_seconds},
          {"changes", static_cast<std::int64_t>(b.changes)},
          {"read_changes", static_cast<std::int64_t>(b.read_changes)},
          {"not_said", static_cast<std::int64_t>(b.not_said)},
          {"text", program_post::beside_sentence(b)}};
}
/// The flattened program in place of a structured one, if that can be posted.
std::vector<FaultRemedy> flat_instead(CommandContext& ctx, const program_post::PostRequest& asked,
                                      const program_post::PostResult& posted) {
  if (asked.form != program_post::PostForm::structured || !posted.has_flat) return {};
  program_post::PostRequest flat = asked;
  flat.form = program_post::PostForm::flat;
  flat.lists_faults = true;
  const auto tried = program_post::post(workshop_of(ctx), flat);
  if (!tried.ok() || tried->posted.errors() > 0) return {};
  FaultRemedy r;
  r.label = "Post the flattened program";
  r.args.set("form", "flat");
  r.repeats = true;
  r.is_tried = true;
  return {std::move(r)};
}

/// The posted files: their texts, or their paths after they were written to the folder.
Result<List> give_files(const Map& args, const program_post::PostedFiles& posted) {
  List files;
  const bool is_written = has(args, "folder") && !flag(args, "check");
  const std::filesystem::path folder = text_of(args, "folder");
  if (is_written && file_kind(folder) != FileKind::folder)
    return error(ErrorCode::not_found, "there is no folder " + text::quote(folder.string()),
                 "Create it first.", "folder");
  for (const auto& [name, bytes] : posted) {
    if (!is_written) {
      files.emplace_back(Map{{"name", name}, {"text", bytes}});
      continue;
    }
    if (!flag(args, "overwrite") && file_kind(folder / name) != FileKind::none)
      return error(ErrorCode::conflict,
                   "there is a file " + text::quote((folder / name).string()) + " already",
                   "Give overwrite = true to replace it, or another folder.");
  }
  if (!is_written) return files;
  for (const auto& [name, bytes] : posted) {
    // Such as the application of VAL3, which is a folder.
    const auto inner = (folder / name).parent_path();
    if (file_kind(inner) != FileKind::folder) RMP_TRY(make_folders(inner));
    RMP_TRY(io::write_file(folder / name, bytes));
    files.emplace_back(Map{{"name", name}, {"path", (folder / name).string()}});
  }
  return files;
}

Result<Value> post(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const program_post::PostRequest asked, request_of(args));
  RMP_TRY_ASSIGN(program_post::PostResult result, program_post::post(workshop_of(ctx), asked));
  const rmp_code& code = result.program.code();
  Posted& out = result.posted;
  const std::string where = name_in(ctx, ref(args, "id"));
  std::size_t errors = out.errors();
  Map run;
  std::int64_t run_errors = 0;
  for (const char* drawn : {"picture", "plot"})
    if (has(args, drawn) && !flag(args, "run_check"))
      return error(ErrorCode::invalid_argument,
                   std::string("a ") + drawn + " needs run_check = true",
                   "Give run_check = true, or leave it out.", drawn);
  if (flag(args, "run_check") && (errors == 0 || flag(args, "check"))) {
    RMP_TRY_ASSIGN(run, run_of(ctx, args));
    run_errors = *run.find("errors")->as_int();
    if (run_errors > 0 && !flag(args, "check")) {
      const Map& first = *run.find("faults")->as_list()->front().as_map();
      return error(
          ErrorCode::unsupported,
          "a run finds " + std::to_string(run_errors) + (run_errors == 1 ? " error" : " errors") +
              ", and nothing is written; the first: " + *first.find("text")->as_string(),
          "program.check_run lists them; without run_check the program is posted unchecked.",
          where);
    }
  }
  std::optional<RunBeside> beside;
  if (flag(args, "run_check") && errors == 0 && run_errors == 0) {
    RMP_TRY_ASSIGN(beside, program_post::run_beside(workshop_of(ctx), asked.cell(), asked.profile,
                                                    asked.only_robot, out.files, result.target));
    program_post::add_beside(*beside, row<rmp_code_routine>(code.routines, 0).span, out);
    errors = out.errors();
  }
  if (errors > 0 && !flag(args, "check")) {
    const PostedFault& first =
        *std::find_if(out.faults.begin(), out.faults.end(),
                      [](const PostedFault& f) { return f.severity == RMP_FAULT_ERROR; });
    std::string hint = first.hint;
    if (errors > 1)
      hint += (hint.empty() ? "" : " ") + std::string("With check = true all ") +
              std::to_string(errors) + " errors are listed.";
    return with_posted(
        error(ErrorCode::unsupported, first.message, hint,
              where + ", " + row<rmp_code_file>(code.files, first.span.file).name + ":" +
                  std::to_string(first.span.line) + ":" + std::to_string(first.span.column)),
        posted_text(ctx, args, result.target.name), code, out, flat_instead(ctx, asked, result));
  }
  if (flag(args, "watch") && (flag(args, "check") || !has(args, "folder")))
    return error(ErrorCode::invalid_argument, "no files are written that could be kept up to date",
                 "Give a folder for the files, and leave check out.", "watch");
  List files;
  if (errors == 0) {
    RMP_TRY_ASSIGN(files, give_files(args, out.files));
    RMP_TRY(watch_drawing(ctx, "program.post", args));
  }
  List map;
  if (flag(args, "source_map"))
    for (const PostedLine& l : out.lines)
      map.emplace_back(Map{{"file", l.file},
                           {"line", static_cast<std::int64_t>(l.line)},
                           {"source", row<rmp_code_file>(code.files, l.span.file).name},
                           {"source_line", static_cast<std::int64_t>(l.span.line)}});
  List faults = fault_list(posted_text(ctx, args, result.target.name), code, out);
  if (const Value* more = run.find("faults"))
    for (const Value& each : *more->as_list()) {
      const Map& f = *each.as_map();
      Map row;
      for (const char* name :
           {"severity", "file", "line", "column", "message", "hint", "kind", "fault"})
        row.set(name, *f.find(name));
      faults.emplace_back(std::move(row));
    }
  Map all{{"target", result.target.name},
          {"form", out.form},
          {"correct", errors == 0 && run_errors == 0},
          {"files", std::move(files)},
          {"faults", std::move(faults)},
          {"source_map", std::move(map)}};
  if (flag(args, "run_check")) all.set("run", Value(std::move(run)));
  if (beside) all.set("read_back", Value(beside_map(*beside)));
  return Value(std::move(all));
}

Result<Value> part_of_robot(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const Compiled made, compile_whole(ctx, args));
  RMP_TRY_ASSIGN(const program_post::Part part,
                 program_post::part_of(workshop_of(ctx), ref(args, "profile"), made,
                                       text_of(args, "robot"), false, false));
  const std::string where = name_in(ctx, ref(args, "id"));
  Posted out;
  for (const auto& r : part.remarks) out.fault(r.severity, r.span, r.message, r.hint);
  for (const PostedFault& f : out.faults)
    if (f.severity == RMP_FAULT_ERROR)
      return with_posted(
          error(ErrorCode::unsupported, f.message, f.hint,
                where + ", " + row<rmp_code_file>(made.code().files, f.span.file).name + ":" +
                    std::to_string(f.span.line) + ":" + std::to_string(f.span.column)),
          posted_text(ctx, args), made.code(), out);
  model::Program p = program_of(ctx, args);
  p.files.front().lines = lines_of(part.text);
  List faults = fault_list(posted_text(ctx, args), made.code(), out);
  const std::string name = text_of(args, "name");
  model::Record r;
  r.name = name;
  r.body = model::OtherContent(program_kind(), std::move(p));
  RMP_TRY_ASSIGN(const AnyId id, ctx.edit().add(std::move(r)));
  return Value(Map{{"program", Application::handle(id)}, {"faults", std::move(faults)}});
}

Result<Value> targets(CommandContext& ctx, const Map&) {
  List all;
  for (const ProviderInfo& info : ctx.app.registry.list()) {
    if (info.interface_id != Post::kInterfaceId || !info.enabled) continue;
    auto post = ctx.app.registry.create<Post>(info.name);
    if (!post.ok()) {
      all.emplace_back(Map{{"name", info.name}, {"title", post.error().sentence()}});
      continue;
    }
    const PostCapabilities& c = (*post)->capabilities();
    static constexpr const char* kBlending[] = {"none",   "distance", "percent",
                                                "radius", "zone",     "accuracy"};
    static constexpr const char* kSpeed[] = {"mm/s", "m/s", "mm/min", "percent", "time"};
    List lacks;
    static constexpr std::pair<std::uint64_t, const char*> kFeatures[] = {
        {kPostProcedures, "procedures"},
        {kPostFunctions, "functions"},
        {kPostRecursion, "recursion"},
        {kPostReals, "real variables"},
        {kPostStrings, "strings"},
        {kPostArrays, "arrays"},
        {kPostRecords, "records"},
        {kPostPoses, "variables of poses"},
        {kPostIf, "IF"},
        {kPostWhile, "WHILE"},
        {kPostProcesses, "parallel processes"},
        {kPostInterrupts, "interrupts"},
        {kPostWaitTimeout, "WAIT FOR with TIMEOUT"},
        {kPostUntil, "UNTIL"},
        {kPostVariableTargets, "computed targets"},
        {kPostMessages, "messages"}};
    for (const auto& [bit, word] : kFeatures)
      if ((c.features & bit) == 0) lacks.emplace_back(word);
    all.emplace_back(
        Map{{"name", info.name},
            {"title", std::string(c.title)},
            {"extensions", std::string(c.extensions)},
            {"structured", (c.forms & kPostStructured) != 0},
            {"flat", (c.forms & kPostFlat) != 0},
            {"speed", kSpeed[std::clamp(static_cast<int>(c.speed), 0, 4)]},
            {"blending", kBlending[std::clamp(static_cast<int>(c.blending), 0, 5)]},
            {"external_axes", static_cast<std::int64_t>(c.external_axes)},
            {"longest_name", static_cast<std::int64_t>(c.max_name)},
            {"lacks", std::move(lacks)},
            {"several_robots", std::find(info.tags.begin(), info.tags.end(),
                                         program_post::kSeveralRobots) != info.tags.end()},
            {"by", std::find(info.tags.begin(), info.tags.end(), program_post::kByTemplates) !=
                           info.tags.end()
                       ? "templates"
                       : "plugin"},
            {"origin", info.origin}});
  }
  return Value(std::move(all));
}

Result<Value> add_target(CommandContext& ctx, const Map& args) {
  std::filesystem::path file = text_of(args, "file");
  if (file_kind(file) == FileKind::folder) file /= program_post::kPackFile;
  RMP_TRY_ASSIGN(const auto pack, program_post::read_pack(
                                      file, [](const std::filesystem::path& f, std::uint64_t most) {
                                        return io::read_file(f, most);
                                      }));
  // A pack replaces itself, so that it can be written step by step.
  RMP_TRY_ASSIGN(const std::string name,
                 program_post::add_pack(ctx.app.registry, file, pack, true));
  return Value(name);
}

const RoomFile kPacksPart({.plugins_loaded = [](Application& app,
                                                std::span<const std::filesystem::path> folders) {
  program_post::load_packs(app.registry, app.messages, folders);
}});

/// A program that moves, for examples.
std::string with_moves(const char* rest) {
  return std::string(
             "local lift = program.create{name = \"lift\", source = [[\n"
             "PROGRAM lift;\n"
             "VAR\n"
             "  POSE: place := POSE(POSITION(500.0, 0.0, 120.0), ORIZYX(0.0, 180.0, 0.0));\n"
             "BEGIN\n"
             "  MOVE LIN place SPEED := 80.0;\n"
             "ENDPROGRAM;\n"
             "]]}\n") +
         rest;
}

}  // namespace

RMP_COMMANDS(post_commands) {
  std::vector<CommandSpec> all;
  all.push_back(
      {.name = "program.post",
       .classic = "",
       .summary = "Writes a program in the language of a controller.",
       .details = "Constructs that the target cannot express are rewritten if possible (CASE to "
                  "IF, FOR to WHILE, REPEAT to jumps); otherwise they are an error at the line, "
                  "with a workaround: nothing is omitted. With a robot, targets get joints, "
                  "configuration and turns from its inverse kinematics, each starting at the one "
                  "before in the text.\nIn a world the program has the robot, frame and tool of "
                  "its run: targets are written in the frame it is bound to and for the tool that "
                  "the robot has there, by the controller's own means; if these are missing, the "
                  "post is refused.\nA profile is a record of kind controller (record.create, or "
                  "from the library) with its axes, signals, tools and limits.",
       .example = with_moves("local out = lift:post{target = \"krl\"}\n"
                             "assert(out.files[1].text:find(\"LIN XPLACE\"))"),
       .params =
           {self("program"),
            optional("target", "string", "",
                     "Provider of robomosp.post/1, such as krl; the profile's if omitted. "
                     "program.targets lists them."),
            optional("profile", "ref:controller", "", "The controller profile."),
            optional("robot", "ref:robot", "", "The robot that moves."),
            optional("only_robot", "string", "",
                     "A ROBOT of a program for several robots: the part for its controller is "
                     "posted (program.part_of_robot)."),
            optional("folder", "path", "",
                     "An existing folder for the files; if omitted, their texts are returned."),
            choice("form", {"automatic", "structured", "flat"},
                   "structured: the program as written; flat: its actions in a run without inputs; "
                   "automatic: flat if the target cannot express the program as written."),
            optional("inputs", "map", "",
                     "Values of inputs by name for a program that is flattened: those that its "
                     "flow depends on."),
            between(optional("most_steps", "int", "",
                             "Limit of instructions for flattening; 2e9 if omitted."),
                    1, 1e15),
            optional("name", "string", "",
                     "Name of the program on the controller; by default that of the profile or the "
                     "program."),
            defaulted("check", "bool", "", false,
                      "Only lists errors and warnings; writes nothing."),
            defaulted("run_check", "bool", "", false,
                      "Checks the program by a run as well (program.check_run), in its world or "
                      "alone with the robot, and refuses the post if the run has errors. Then the "
                      "posted files are read back if a reader supports them, run in the same "
                      "place, and compared: tool poses in the world, joints, time, signals; "
                      "different poses or signals are errors. C files are compiled by the user's "
                      "compiler (ROBOMOSP_CC, else cc) and run in a separate process."),
            optional("world", "ref:world", "",
                     "World that it is posted and checked for, if it is in several."),
            optional("name_there", "string", "",
                     "Its name there, if the world has it several times."),
            optional("contacts", "bool", "",
                     "With run_check: false skips contacts, which take most of its time."),
            optional("picture", "path", "", "With run_check: a picture of the tool's path, *.png."),
            optional("plot", "path", "",
                     "With run_check: a plot over time, *.svg, *.png or *.pdf."),
            defaulted("overwrite", "bool", "", false, "Whether existing files are replaced."),
            watch_file_field(),
            defaulted("source_map", "bool", "", false,
                      "Whether the source line of each posted line is returned."),
            optional("params", "map", "", "Parameters of the target.")},
       .returns = {"map",
                   "",
                   "",
                   {field("target", "string", "", "The provider."),
                    field("form", "string", "", "The posted form."),
                    field("correct", "bool", "", "Whether there are no errors."),
                    field("files", "list", "", "One table each: name, text or path."),
                    field("faults", "list", "",
                          "One table each: severity, file, line, column, message, hint, fault; of "
                          "run_check also kind."),
                    field("run", "map", "", "With run_check: the result of program.check_run."),
                    field("read_back", "map", "",
                          "With run_check, if neither run has errors: comparison of the posted "
                          "files with the program. compared, or why_not; reader; motions and "
                          "read_motions; ends, the number compared; most_distance [m] and "
                          "most_angle [rad] of the tool in the world, most_joint [degrees or mm]; "
                          "time and read_time [s], if the target has_times; changes and "
                          "read_changes of signals; not_said, what the reader left out; text."),
                    field("source_map", "list", "",
                          "One table per line: file, line, source, source_line.")}},
       .effect = Effect::reads,
       .sometimes =
           Effects(Effect::files_write) | Effect::simulates | Effect::edits | Effect::processes,
       .run = post});
  all.push_back(
      {.name = "program.part_of_robot",
       .classic = "",
       .summary =
           "Makes the part of a program for several robots that runs on the controller of one.",
       .details =
           "The program and its processes run on the controller of the robot that each moves; a "
           "process that moves nothing runs where it shares the most. Semaphores, BOOL and INT "
           "that two controllers share become lines between them, which the profile lists among "
           "its signals: NAME_released and NAME_acquired of a semaphore, the name of a variable, "
           "and NAME_starts of both robots. Anything else they share is an error at its line. "
           "program.post with only_robot posts the same.",
       .example =
           "local both = program.create{name = \"both\", source = [[\n"
           "PROGRAM both;\n"
           "TYPE\n"
           "  RECORD POSE: R_BASE, R_TOOL; ENDRECORD: R_SPEC_TYPE;\n"
           "  ROBOT left := R_SPEC_TYPE(POSE(POSITION(0.0, 0.0, 0.0), ORIZYX(0.0, 0.0, 0.0)),\n"
           "    POSE(POSITION(0.0, 0.0, 0.0), ORIZYX(0.0, 0.0, 0.0)));\n"
           "  ROBOT right := left;\n"
           "VAR POSE: a := POSE(POSITION(500.0, 0.0, 300.0), ORIZYX(0.0, 180.0, 0.0));\n"
           "PROCESS go;\n"
           "BEGIN\n"
           "  MOVE PTP a ACT_ROB := right;\n"
           "ENDPROCESS;\n"
           "BEGIN\n"
           "  START go;\n"
           "  MOVE PTP a ACT_ROB := left;\n"
           "ENDPROGRAM;\n"
           "]]}\n"
           "local part = both:part_of_robot{robot = \"right\", name = \"right\"}\n"
           "assert(part.program:source():find(\"PROCEDURE go\"))",
       .params = {self("program"), needed("robot", "string", "", "A ROBOT of the program."),
                  needed("name", "string", "", "Name of the part, unique among programs."),
                  optional("profile", "ref:controller", "",
                           "The controller; its signals may be lines to another one.")},
       .returns = {"map",
                   "",
                   "",
                   {field("program", "handle", "", "The part."),
                    field("faults", "list", "",
                          "Remarks, one table each: severity, file, line, column, message, hint, "
                          "fault.")}},
       .effect = Effect::edits,
       .run = part_of_robot});
  all.push_back(
      {.name = "program.add_target",
       .classic = "",
       .summary = "Adds a post target that is made of templates, without a compiler.",
       .details = "A text file with one template per construct; "
                  "docs/plugin_author/post_templates.md describes the form. Templates that are "
                  "missing for the features it claims are reported at once, one sentence each with "
                  "its place. A pack that is read again replaces itself. It stays until the "
                  "program ends; a pack in a folder of plugins is loaded at every start.",
       .example = "io.open(\"acme.post\", \"w\"):write([[\n"
                  "robomosp target 1\n"
                  "name: acme\n"
                  "file: {{name}}.acl\n"
                  "motions: lin\n"
                  "forms: flat\n"
                  "== program_begin\n"
                  "BEGIN {{name}}\n"
                  "== program_end\n"
                  "STOP\n"
                  "== lin\n"
                  "GO {{x|fixed:1}} {{y|fixed:1}} {{z|fixed:1}} {{a}} {{b}} {{c}}\n"
                  "== output_on\n"
                  "ON {{number}}\n"
                  "== output_off\n"
                  "OFF {{number}}\n"
                  "== wait_time\n"
                  "WAIT {{milliseconds}}\n"
                  "]]):close()\n"
                  "assert(program.add_target(\"acme.post\") == \"acme\")",
       .params = {needed("file", "path", "", "The pack: a file, or a folder with pack.post.")},
       .returns = {"string", "", "Its name, to be used as a target.", {}},
       .effect = Effect::files_read | Effect::providers,
       .run = add_target});
  all.push_back({.name = "program.targets",
                 .classic = "",
                 .summary = "Lists the controller languages that programs can be posted to.",
                 .details = "",
                 .example = "assert(#program.targets() >= 1)",
                 .params = {},
                 .returns = {"list",
                             "",
                             "One table each: name, title, extensions, structured, flat, speed, "
                             "blending, external_axes, longest_name, lacks, several_robots, by "
                             "(plugin or templates), origin (its file).",
                             {}},
                 .effect = Effect::reads,
                 .run = targets});
  return all;
}

}  // namespace robomosp::ioci
