// SPDX-License-Identifier: Apache-2.0
#include "ioci/program/foreign.h"

#include "ioci/program/program_files.h"
#include "program_source/text_faults.h"

namespace robomosp::ioci {

Result<program_source::Foreign> read_foreign(CommandContext& ctx, const std::filesystem::path& path,
                                             const std::string& reader, const Map& args) {
  const Value* settings = args.find("settings");
  const model::Controller* controller =
      has(args, "profile")
          ? &std::get<model::OtherContent>(ctx.snapshot().find(ref(args, "profile"))->body)
                 .as<model::Controller>()
          : nullptr;
  return program_source::read_foreign(reading_place(ctx), path, reader,
                                      settings && settings->as_map() ? *settings->as_map() : Map(),
                                      controller);
}

namespace {

Result<Value> read(CommandContext& ctx, const Map& args) {
  const std::filesystem::path path = text_of(args, "file");
  RMP_TRY_ASSIGN(const std::string reader,
                 program_source::reader_of(reading_place(ctx), path, text_of(args, "language")));
  if (reader.empty())
    return error(ErrorCode::unsupported,
                 "no reader accepts " + text::quote(path.filename().string()),
                 "IRL files are read by program.import; provider.list{interface = "
                 "\"robomosp.program_reader/1\"} lists the readers.",
                 "file");
  RMP_TRY_ASSIGN(const program_source::Foreign made, read_foreign(ctx, path, reader, args));
  static constexpr const char* kWords[] = {"error", "warning", "note"};
  List files, faults, lines, read_files;
  for (const ReadFile& f : made.program->files())
    files.emplace_back(Map{{"name", std::string(f.name)}, {"text", std::string(f.text)}});
  for (const program_source::ForeignFile& f : made.files) read_files.emplace_back(f.name);
  std::int64_t errors = 0, warnings = 0;
  program_source::FaultyText in;
  in.provider = made.reader;
  in.interface_id = ProgramReader::kInterfaceId;
  for (const rmp_code_fault& f : made.program->faults()) {
    errors += f.severity == RMP_FAULT_ERROR;
    warnings += f.severity == RMP_FAULT_WARNING;
    faults.emplace_back(Map{
        {"severity", kWords[f.severity]},
        {"file", made.files[f.span.file].name},
        {"line", static_cast<std::int64_t>(f.span.line)},
        {"column", static_cast<std::int64_t>(f.span.column)},
        {"message", std::string(f.message) + "."},
        {"hint", f.hint},
        {"fault", fault_map(text_fault(
                      "program.not_read", in,
                      {f.severity, f.span, made.files[f.span.file].name, f.message, f.hint}))}});
  }
  for (const ReadLine& l : made.program->lines())
    lines.emplace_back(Map{{"irl_line", static_cast<std::int64_t>(l.irl_line)},
                           {"file", made.files[l.file].name},
                           {"line", static_cast<std::int64_t>(l.line)}});
  return Value(Map{{"language", made.reader},
                   {"read", std::move(read_files)},
                   {"errors", errors},
                   {"warnings", warnings},
                   {"files", std::move(files)},
                   {"faults", std::move(faults)},
                   {"lines", std::move(lines)}});
}

}  // namespace

RMP_COMMANDS(foreign_program_commands) {
  std::vector<CommandSpec> all;
  all.push_back(
      {.name = "program.read_foreign",
       .classic = "",
       .summary = "Reads a controller's program to IRL and lists what IRL cannot express.",
       .details = "Nothing is changed; program.import creates a program from the file. Other files "
                  "of the program are taken from its folder. Faults are located in the files that "
                  "were read; a statement that was not read becomes a comment in the IRL.",
       .example = "program.create{name = \"m\", file_name = \"move.ngc\", source = \"G21 G90\\nG1 "
                  "X10 Y5 Z2 "
                  "F600\\nM2\\n\"}:export{folder = \".\", overwrite = true}\n"
                  "local read = program.read_foreign{file = \"move.ngc\"}\n"
                  "assert(read.errors == 0 and read.language == \"gcode\")",
       .params = {needed("file", "path", "", "The file, such as .src, .mod, .script, .ls, .jbi."),
                  optional("language", "string", "",
                           "Its reader (robomosp.program_reader/1), if several controllers use the "
                           "extension."),
                  optional("settings", "map", "", "Values of the reader's parameters."),
                  optional("profile", "ref:controller", "",
                           "The controller: its pulses and options are used by the reader.")},
       .returns =
           {"map",
            "",
            "",
            {field("language", "string", "", "The reader."),
             field("read", "list", "", "Names of the files read."),
             field("errors", "int", "", "Places where the meaning of the IRL differs."),
             field("warnings", "int", "",
                   "Places that IRL cannot express and that do not affect motions and outputs."),
             field("files", "list", "", "The IRL: name, text of each file."),
             field("faults", "list", "",
                   "One table each: severity, file, line, column, message, hint, fault."),
             field("lines", "list", "",
                   "Source of each line of the first file: irl_line, file, line.")}},
       .effect = Effect::files_read,
       .run = read});
  return all;
}

}  // namespace robomosp::ioci
