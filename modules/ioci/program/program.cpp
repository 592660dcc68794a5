// SPDX-License-Identifier: Apache-2.0
// Programs of robots: their source, what is wrong with it, and what a compiler makes of it.
#include <algorithm>
#include <filesystem>
#include <map>
#include <set>

#include <robomosp/sdk/names.h>
#include <robomosp/sdk/program_reader.h>
#include <robomosp/sdk/program_tables.h>

#include "io/native.h"
#include "ioci/core/commands.h"
#include "ioci/core/import_faults.h"
#include "ioci/program/compiled.h"
#include "ioci/program/foreign.h"
#include "ioci/program/in_world.h"
#include "ioci/program/program_files.h"
#include "ioci/program/workshop.h"
#include "kernel/file_root.h"
#include "model/declare.h"
#include "model/program.h"
#include "model/program_kinds.h"
#include "motion/provider_params.h"
#include "program_source/text_faults.h"

namespace robomosp::ioci {
namespace {

using model::Program;
using model::ProgramFile;
using program_source::FaultyText, program_source::source_faults, program_source::text_fault;

ProgramFile* find_file(Program& p, std::string_view name) {
  const auto it = std::find_if(p.files.begin(), p.files.end(),
                               [&](const ProgramFile& f) { return f.name == name; });
  return it == p.files.end() ? nullptr : &*it;
}
Result<void> check_file_name(const std::string& name) {
  if (!name.empty() && name.find_first_of("/\\") == std::string::npos && name != "." &&
      name != "..")
    return {};
  return error(ErrorCode::invalid_argument, text::quote(name) + " is not the name of a file",
               "File names of a program have no folders, such as \"cell.ssi\".", "name");
}
std::vector<std::string> file_names(const Program& p) {
  std::vector<std::string> out;
  for (const ProgramFile& f : p.files) out.push_back(f.name);
  return out;
}

Result<Compiled> compile(CommandContext& ctx, const Map& args) {
  const AnyId id = ref(args, "id");
  return program_source::compile(workshop_of(ctx), id, places_of(ctx.snapshot(), id, args));
}

}  // namespace

Result<Compiled> compile_whole(CommandContext& ctx, const Map& args) {
  const AnyId id = ref(args, "id");
  return program_source::compile_whole(workshop_of(ctx), id, places_of(ctx.snapshot(), id, args));
}

namespace {

// ---- commands ----

Result<AnyId> add_program(CommandContext& ctx, const std::string& name, Program p) {
  model::Record r;
  r.name = name;
  r.body = model::OtherContent(program_kind(), std::move(p));
  return ctx.edit().add(std::move(r));
}

/// Reports (code "program_fault") the first error of a source that was given. It is kept: a program
/// may be written piece by piece.
void note_fault(CommandContext& ctx, AnyId id) {
  const auto made = compile_whole(ctx, Map{{"id", Application::handle(id)}});
  if (made.ok() || made.error().code != ErrorCode::syntax) return;
  Fault f = std::move(faults_of(made.error()).front());
  f.severity = Severity::info;
  f.message = "it does not run yet: " + f.message;
  ctx.app.messages.post(f, "program");
}

Result<Value> create(CommandContext& ctx, const Map& args) {
  Program p;
  p.description = text_of(args, "description");
  p.language = text_of(args, "language");
  if (has(args, "language")) {
    RMP_TRY(ctx.app.registry.find(Language::kInterfaceId, p.language));
  }
  const std::string name = text_of(args, "name");
  std::string file = text_of(args, "file_name");
  if (file.empty()) {
    for (const char c : name)
      file += (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ? c : '_';
    file += ".irl";
  }
  RMP_TRY(check_file_name(file));
  RMP_TRY_ASSIGN(const std::string source, told_source(ctx, file, text_of(args, "source")));
  p.files.push_back({file, lines_of(source)});
  RMP_TRY_ASSIGN(const AnyId id, add_program(ctx, name, std::move(p)));
  note_fault(ctx, id);
  return Value(Application::handle(id));
}

/// What a record may be named after a controller's file, which may begin with a digit and have
/// any characters: those that stand in no name are "_".
std::string record_name(std::string_view foreign) {
  std::string out = with_name_characters(foreign);
  while (!out.empty() && out.back() == ' ') out.pop_back();
  return is_name(out) ? out : "x" + out;
}

/// A controller's program: its IRL, and behind it the files that it was, so that nothing is lost.
Result<Value> import_foreign(CommandContext& ctx, const Map& args,
                             const std::filesystem::path& path, const std::string& reader) {
  RMP_TRY_ASSIGN(const program_source::Foreign made, read_foreign(ctx, path, reader, args));
  Program p;
  std::map<std::string, std::string> stored_names;  // of the files that were read
  for (const ReadFile& f : made.program->files()) {
    std::string name(f.name);
    for (const program_source::ForeignFile& g : made.files)
      if (g.name == name) name = "irl_" + name;
    p.files.push_back({name, lines_of(f.text)});
  }
  for (const program_source::ForeignFile& f : made.files) {
    const std::string plain = record_name(f.name);
    std::string file = plain;
    for (int n = 2;
         std::any_of(p.files.begin(), p.files.end(), [&](const auto& g) { return g.name == file; });
         ++n)
      file = "x" + std::to_string(n) + "_" + plain;
    p.files.push_back({file, lines_of(f.text)});
    stored_names[f.name] = file;
  }
  const std::string name =
      has(args, "name") ? text_of(args, "name") : record_name(path.stem().string());
  const Program stored = p;
  RMP_TRY_ASSIGN(const AnyId id, add_program(ctx, name, std::move(p)));
  constexpr std::size_t kMostTold = 20;
  std::vector<Fault> kept;
  std::size_t errors = 0, warnings = 0, told = 0;
  for (const rmp_code_fault& f : made.program->faults()) {
    errors += f.severity == RMP_FAULT_ERROR;
    warnings += f.severity == RMP_FAULT_WARNING;
    if (f.severity == RMP_FAULT_NOTE) continue;
    // The files that were read are in the program behind its IRL.
    const program_source::ForeignFile& file = made.files[f.span.file];
    FaultyText in{id, &stored, {}, made.reader, ProgramReader::kInterfaceId};
    Fault fault = text_fault("program.not_read", in,
                             {f.severity, f.span, stored_names[file.name], f.message, f.hint});
    fault.where = file.name + fault.where.substr(stored_names[file.name].size());
    kept.push_back(std::move(fault));
    if (told++ >= kMostTold) continue;
    ctx.app.messages.post(kept.back(), "program");
  }
  ctx.app.kept<ImportFaults>().note(id, name, std::move(kept));
  if (told > kMostTold)
    ctx.app.messages.post(errors > 0 ? Severity::error : Severity::warning, "not_read",
                          path.filename().string() + ": " + std::to_string(errors) +
                              " errors and " + std::to_string(warnings) +
                              " warnings in all; program.read_foreign lists them.",
                          "program");
  return Value(Application::handle(id));
}

Result<Value> import(CommandContext& ctx, const Map& args) {
  const std::filesystem::path path = text_of(args, "file");
  RMP_TRY_ASSIGN(const std::string reader,
                 program_source::reader_of(reading_place(ctx), path, text_of(args, "language")));
  if (!reader.empty()) return import_foreign(ctx, args, path, reader);
  for (const char* each : {"settings", "profile"})
    if (has(args, each))
      return error(ErrorCode::invalid_argument,
                   "a file of IRL is read without " +
                       std::string(each[0] == 's' ? "settings" : "a controller"),
                   {}, each);
  Program p;
  RMP_TRY_ASSIGN(const ProviderInfo info,
                 ctx.app.registry.find(Language::kInterfaceId, text_of(args, "language")));
  RMP_TRY_ASSIGN(const auto language, language_of(ctx, info.name));
  if (has(args, "language")) p.language = info.name;
  RMP_TRY_ASSIGN(const std::string bytes, io::read_file(path, program_source::kMostSource));
  RMP_TRY_ASSIGN(const std::string text, told_source(ctx, path.filename().string(), bytes));
  p.files.push_back({path.filename().string(), lines_of(text)});
  // What a source names lies beside it, and may name more.
  constexpr std::size_t kMostNamed = 100;
  std::set<std::string> seen{p.files[0].name};
  for (std::size_t i = 0; i < p.files.size(); ++i) {
    const std::string source = text_of_file(p.files[i]);
    RMP_TRY_ASSIGN(const auto wanted, language->needs(SourceFile{p.files[i].name, source, {}}));
    for (const std::string& each : wanted) {
      const std::string base = std::filesystem::path(each).filename().string();
      if (base.empty() || base == "." || base == ".." || !seen.insert(base).second) continue;
      const std::filesystem::path beside = path.parent_path() / base;
      if (file_kind(beside) != FileKind::file) {
        ctx.app.messages.post(Severity::warning, "missing_file",
                              p.files[i].name + " names " + text::quote(each) +
                                  ", which is not beside it. Add it with program.set_file.",
                              "program");
        continue;
      }
      if (p.files.size() >= kMostNamed)
        return error(ErrorCode::unsupported,
                     "it names more than " + std::to_string(kMostNamed) + " files", {},
                     path.filename().string());
      RMP_TRY_ASSIGN(const auto more, program_source::source_beside(reading_place(ctx), beside));
      if (more) p.files.push_back({base, lines_of(*more)});
    }
  }
  // Who names no list of data has that of this name, where there is one.
  const std::string list = "datalist.dls";
  const bool has_list = std::any_of(p.files.begin(), p.files.end(), [](const ProgramFile& f) {
    return std::filesystem::path(f.name).extension() == ".dls";
  });
  if (const auto beside = path.parent_path() / list;
      !has_list && file_kind(beside) == FileKind::file) {
    RMP_TRY_ASSIGN(const auto more, program_source::source_beside(reading_place(ctx), beside));
    if (more) {
      p.files.push_back({list, lines_of(*more)});
      ctx.app.messages.post(Severity::info, "file_note",
                            p.files[0].name + " names no list of data: " + list +
                                " of its folder is added to the program.",
                            "program");
    }
  }
  const std::string name = has(args, "name") ? text_of(args, "name") : path.stem().string();
  RMP_TRY_ASSIGN(const AnyId id, add_program(ctx, name, std::move(p)));
  return Value(Application::handle(id));
}

Result<Value> export_files(CommandContext& ctx, const Map& args) {
  const std::filesystem::path folder = text_of(args, "folder");
  const Program& p = program_of(ctx, args);
  if (file_kind(folder) != FileKind::folder)
    return error(ErrorCode::not_found, "there is no folder " + text::quote(folder.string()),
                 "Create it first.", "folder");
  for (const ProgramFile& f : p.files) {
    // Names come from files, too.
    RMP_TRY(check_file_name(f.name));
    if (!flag(args, "overwrite") && file_kind(folder / f.name) != FileKind::none)
      return error(ErrorCode::conflict,
                   "there is a file " + text::quote((folder / f.name).string()) + " already",
                   "Give overwrite = true to replace it, or another folder.");
  }
  List out;
  for (const ProgramFile& f : p.files) {
    RMP_TRY(io::write_file(folder / f.name, text_of_file(f)));
    out.emplace_back((folder / f.name).string());
  }
  return Value(std::move(out));
}

Result<Value> set_file(CommandContext& ctx, const Map& args) {
  const std::string name = text_of(args, "name");
  RMP_TRY(check_file_name(name));
  RMP_TRY_ASSIGN(const std::string text, told_source(ctx, name, text_of(args, "text")));
  std::vector<std::string> lines = lines_of(text);
  RMP_TRY(edit_program(ctx, ref(args, "id"), [&](Program& p) -> Result<void> {
    if (ProgramFile* f = find_file(p, name)) f->lines = std::move(lines);
    else p.files.push_back({name, std::move(lines)});
    return {};
  }));
  return Value();
}

Result<Value> remove_file(CommandContext& ctx, const Map& args) {
  const std::string name = text_of(args, "name");
  RMP_TRY(edit_program(ctx, ref(args, "id"), [&](Program& p) -> Result<void> {
    const ProgramFile* f = find_file(p, name);
    if (!f) return unknown_name("file", name, file_names(p));
    if (f == p.files.data())
      return error(ErrorCode::conflict, text::quote(name) + " is the program itself",
                   "Change its text with program.set_file.", "name");
    p.files.erase(p.files.begin() + (f - p.files.data()));
    return {};
  }));
  return Value();
}

Result<Value> source(CommandContext& ctx, const Map& args) {
  Program copy = program_of(ctx, args);
  if (copy.files.empty()) return Value(std::string());
  if (!has(args, "name")) return Value(text_of_file(copy.files[0]));
  const std::string name = text_of(args, "name");
  if (const ProgramFile* f = find_file(copy, name)) return Value(text_of_file(*f));
  return unknown_name("file", name, file_names(copy));
}

Result<Value> files(CommandContext& ctx, const Map& args) {
  List out;
  for (const ProgramFile& f : program_of(ctx, args).files)
    out.emplace_back(Map{{"name", f.name}, {"lines", static_cast<std::int64_t>(f.lines.size())}});
  return Value(std::move(out));
}

Result<Value> check_source(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const Compiled made, compile(ctx, args));
  const rmp_code& c = made.code();
  static constexpr const char* kWords[] = {"error", "warning", "note"};
  std::int64_t errors = 0, warnings = 0;
  List faults;
  const AnyId id = ref(args, "id");
  const std::vector<Fault> as_data = source_faults({.record = id,
                                                    .program = &program_of(ctx, args),
                                                    .where = name_in(ctx, id),
                                                    .name = ctx.snapshot().find(id)->name},
                                                   c);
  for (std::uint32_t i = 0; i < c.faults.count; ++i) {
    const auto& f = row<rmp_code_fault>(c.faults, i);
    errors += f.severity == RMP_FAULT_ERROR;
    warnings += f.severity == RMP_FAULT_WARNING;
    faults.emplace_back(Map{{"severity", kWords[f.severity]},
                            {"file", row<rmp_code_file>(c.files, f.span.file).name},
                            {"line", static_cast<std::int64_t>(f.span.line)},
                            {"column", static_cast<std::int64_t>(f.span.column)},
                            {"length", static_cast<std::int64_t>(f.span.end - f.span.begin)},
                            {"message", std::string(f.message) + "."},
                            {"hint", f.hint},
                            {"fault", fault_map(as_data[i])}});
  }
  return Value(Map{{"correct", errors == 0},
                   {"errors", errors},
                   {"warnings", warnings},
                   {"faults", std::move(faults)}});
}

/// The typed program as tables.
class Tree {
 public:
  Tree(const rmp_code& code, const Program& program, const std::vector<std::string>& texts)
      : c_(code) {
    for (std::uint32_t f = 0; f < c_.files.count; ++f) {
      const std::string* text = nullptr;
      for (std::size_t i = 0; i < program.files.size(); ++i)
        if (program.files[i].name == row<rmp_code_file>(c_.files, f).name) text = &texts[i];
      texts_.push_back(text);
    }
  }
  Map run() {
    List symbols, routines;
    for (std::uint32_t i = 0; i < c_.symbols.count; ++i) {
      static constexpr const char* kKinds[] = {"constant", "variable", "parameter", "input",
                                               "output",   "robot",    "type"};
      const auto& s = row<rmp_code_symbol>(c_.symbols, i);
      if (s.kind > RMP_SYMBOL_TYPE || s.scope == RMP_NONE) continue;
      const auto& scope = row<rmp_code_scope>(c_.scopes, s.scope);
      if (scope.kind == RMP_SCOPE_PREDEFINED) continue;
      Map one{{"name", s.name},
              {"kind", kKinds[s.kind]},
              {"type", type(s.type)},
              {"scope", scope.name},
              {"line", static_cast<std::int64_t>(s.span.line)}};
      if (s.value != RMP_NONE) one.set("value", text(expression(s.value).span));
      symbols.emplace_back(std::move(one));
    }
    for (std::uint32_t i = 0; i < c_.routines.count; ++i) {
      static constexpr const char* kKinds[] = {"program", "procedure", "function",
                                               "process", "interrupt", "data_list"};
      static constexpr const char* kModes[] = {"in", "out", "inout"};
      const auto& r = row<rmp_code_routine>(c_.routines, i);
      List parameters;
      for (std::uint32_t k = 0; k < r.parameter_count; ++k) {
        const auto& p = row<rmp_code_symbol>(c_.symbols, r.first_parameter + k);
        parameters.emplace_back(
            Map{{"name", p.name}, {"type", type(p.type)}, {"mode", kModes[p.mode]}});
      }
      routines.emplace_back(Map{{"name", row<rmp_code_symbol>(c_.symbols, r.symbol).name},
                                {"kind", kKinds[r.kind]},
                                {"parameters", std::move(parameters)},
                                {"result", type(r.result)},
                                {"recursive", r.is_recursive != 0},
                                {"line", static_cast<std::int64_t>(r.span.line)},
                                {"statements", block(r.body)}});
    }
    return Map{
        {"name", c_.name}, {"symbols", std::move(symbols)}, {"routines", std::move(routines)}};
  }

 private:
  [[nodiscard]] const rmp_code_expression& expression(std::uint32_t e) const {
    return row<rmp_code_expression>(c_.expressions, e);
  }
  [[nodiscard]] std::string type(std::uint32_t t) const {
    static constexpr const char* kBasic[] = {"",       "INT",  "REAL", "CHAR",      "BOOL",
                                             "STRING", "TEXT", "FILE", "SEMAPHORE", "PROCESS"};
    if (t <= RMP_TYPE_PROCESS) return kBasic[t];
    const auto& x = row<rmp_code_type>(c_.types, t);
    if (*x.name) return x.name;
    if (x.kind == RMP_TYPE_RECORD) return "RECORD";
    if (x.kind == RMP_TYPE_LIST) return "LIST OF " + type(x.element);
    return "ARRAY [" + std::to_string(x.lower) + ".." + std::to_string(x.upper) + "] OF " +
           type(x.element);
  }
  /// As the source has it.
  [[nodiscard]] std::string text(const rmp_span& s) const {
    const std::string* all = texts_[s.file];
    if (!all || s.end > all->size() || s.begin > s.end) return {};
    return all->substr(s.begin, s.end - s.begin);
  }
  // Statements are nested no deeper than their compiler lets them be.
  List block(std::uint32_t first, int depth = 0) {
    constexpr int kDeepest = 400;
    List out;
    if (first != RMP_NONE && depth >= kDeepest) {
      out.emplace_back(Map{{"statement", "nested too deep to be shown"}});
      return out;
    }
    for (std::uint32_t s = first; s != RMP_NONE; s = row<rmp_code_statement>(c_.statements, s).next)
      out.emplace_back(statement(row<rmp_code_statement>(c_.statements, s), depth));
    return out;
  }
  Map statement(const rmp_code_statement& s, int depth) {
    static constexpr const char* kWords[] = {
        "assign",   "call",  "if",   "arm",      "case",   "while",  "repeat",   "loop",  "for",
        "for_down", "exit",  "goto", "label",    "return", "wait",   "wait_for", "pause", "halt",
        "move",     "start", "stop", "continue", "cancel", "enable", "disable",  "teach"};
    Map out{{"statement", kWords[s.op]}, {"line", static_cast<std::int64_t>(s.span.line)}};
    if (s.symbol != RMP_NONE) out.set("name", row<rmp_code_symbol>(c_.symbols, s.symbol).name);
    static constexpr const char* kParts[] = {"a", "b", "c"};
    const std::uint32_t parts[] = {s.a, s.b, s.c};
    for (std::size_t k = 0; k < 3; ++k) {
      if (parts[k] == RMP_NONE) continue;
      out.set(kParts[k], text(expression(parts[k]).span));
      if (k == 0) out.set("type", type(expression(parts[k]).type));
    }
    if (s.count > 0) {
      List labels;
      for (std::uint32_t k = 0; k < s.count; ++k)
        labels.emplace_back(text(expression(row<std::uint32_t>(c_.links, s.first + k)).span));
      out.set("labels", std::move(labels));
    }
    if (s.motion != RMP_NONE) motion(out, row<rmp_code_motion>(c_.motions, s.motion));
    if (s.body != RMP_NONE) out.set("statements", block(s.body, depth + 1));
    return out;
  }
  void motion(Map& out, const rmp_code_motion& m) {
    out.set("interpolation", std::string(code_text_detail::kMoves[m.interpolation]));
    out.set("incremental", m.is_incremental != 0);
    List targets;
    for (std::uint32_t k = 0; k < m.target_count; ++k) {
      const auto& e = expression(row<std::uint32_t>(c_.links, m.first_target + k));
      targets.emplace_back(Map{{"value", text(e.span)}, {"type", type(e.type)}});
    }
    out.set("targets", std::move(targets));
    Map attributes;
    for (std::uint32_t k = 0; k < m.attribute_count; ++k) {
      const auto& a = row<rmp_code_attribute>(c_.attributes, m.first_attribute + k);
      attributes.set(std::string(code_text_detail::kAttributes[a.attribute]),
                     text(expression(a.value).span));
    }
    out.set("attributes", std::move(attributes));
    if (m.until != RMP_NONE) out.set("until", text(expression(m.until).span));
  }

  const rmp_code& c_;
  std::vector<const std::string*> texts_;
};

Result<Value> tree(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const Compiled made, compile_whole(ctx, args));
  return Value(Tree(made.code(), program_of(ctx, args), made.texts).run());
}

Result<Value> code(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const Compiled made, compile_whole(ctx, args));
  const std::string out = code_text(made.code());
  if (!has(args, "file")) return Value(out);
  const std::filesystem::path file = text_of(args, "file");
  RMP_TRY(io::write_file(file, out));
  return Value(file.string());
}

Result<Value> read_code(CommandContext&, const Map& args) {
  RMP_TRY_ASSIGN(const std::string all,
                 io::read_file(text_of(args, "file"), program_source::kMostSource * 16));
  RMP_TRY_ASSIGN(const auto tables, read_code_text(all));
  const rmp_code& c = tables->code();
  List routines;
  for (std::uint32_t i = 0; i < c.routines.count; ++i) {
    const auto& r = row<rmp_code_routine>(c.routines, i);
    routines.emplace_back(Map{{"name", row<rmp_code_symbol>(c.symbols, r.symbol).name},
                              {"instructions", static_cast<std::int64_t>(r.instruction_count)}});
  }
  return Value(Map{{"name", c.name},
                   {"instructions", static_cast<std::int64_t>(c.instructions.count)},
                   {"routines", std::move(routines)}});
}

/// A program with a procedure, for examples.
std::string with_program(const char* rest) {
  return std::string(
             "local lift = program.create{name = \"lift\", source = [[\n"
             "PROGRAM lift;\n"
             "VAR\n"
             "  INT: rounds := 3, i;\n"
             "PROCEDURE go (IN REAL: height);\n"
             "BEGIN\n"
             "  MOVE LIN POSE(POSITION(500.0, 0.0, height), ORIZYX(0.0, 180.0, 0.0)) SPEED := "
             "80.0;\n"
             "ENDPROC;\n"
             "BEGIN\n"
             "  FOR i := 1 TO rounds\n"
             "    go(100.0);\n"
             "    go(300.0);\n"
             "  ENDFOR;\n"
             "ENDPROGRAM;\n"
             "]]}\n") +
         rest;
}

}  // namespace

Result<std::shared_ptr<const CompiledProgram>> compile_program(CommandContext& ctx, AnyId id,
                                                               const ProgramPlace* place) {
  return program_source::compile_program(workshop_of(ctx), id, place);
}

RMP_COMMANDS(program_commands) {
  std::vector<CommandSpec> all;
  const ParamSpec language =
      optional("language", "string", "",
               "Provider of the language (robomosp.language/1); the default one if omitted.");
  all.push_back(
      {.name = "program.create",
       .classic = "",
       .summary = "Makes a robot program from its source.",
       .details = "The source is stored unchanged even if it has errors; program.check lists them. "
                  "A program needs no cell: without SYSTEM_SPECIFICATION it is for a robot of six "
                  "axes with a gripper. program.set_file adds the files that it names.",
       .example = with_program("assert(lift:check().correct)"),
       .params = {needed("name", "string", "", "Name, unique among programs."),
                  needed("source", "string", "", "The text of the program."),
                  optional(
                      "file_name", "string", "",
                      "Name of its file, as used in faults; derived from the name if omitted."),
                  language, optional("description", "string", "", "Purpose of the program.")},
       .returns = {"handle", "", "", {}},
       .effect = Effect::edits,
       .run = create});
  all.push_back(
      {.name = "program.import",
       .classic = "",
       .summary = "Makes a program from a file of IRL or of a controller's language.",
       .details =
           "The files that it names (system specification .ssi, lists of data .dls, modules) are "
           "taken from the same folder; a missing one is reported. If it names no list of data, "
           "datalist.dls of that folder is used. Text that is not UTF-8 is read as ISO 8859-1. A "
           "controller's program (.src, .mod, .script, .ls, .jbi, ..., or .xml of CRCL and .yaml "
           "of ROS) is translated to IRL and its original files are kept; messages report what IRL "
           "cannot express, and program.read_foreign returns the same as a table.",
       .example =
           with_program("lift:export{folder = \".\", overwrite = true}\n"
                        "local again = program.import{file = \"lift.irl\", name = \"again\"}\n"
                        "assert(again:source() == lift:source())"),
       .params = {needed("file", "path", "", "The file."),
                  optional("name", "string", "", "Name of the program; the file's if omitted."),
                  optional(
                      "language", "string", "",
                      "Provider of the language (robomosp.language/1), or of a controller's reader "
                      "(robomosp.program_reader/1); selected by the extension if omitted."),
                  optional("settings", "map", "", "Values of the reader's parameters."),
                  optional("profile", "ref:controller", "",
                           "The controller: its pulses and options are used by the reader.")},
       .returns = {"handle", "", "", {}},
       .effect = Effect::edits | Effect::files_read,
       .run = import});
  all.push_back(
      {.name = "program.export",
       .classic = "",
       .summary = "Writes the source files of a program to a folder.",
       .details = "The bytes are those that were imported, with text in UTF-8.",
       .example = with_program("local written = lift:export{folder = \".\", overwrite = true}\n"
                               "assert(#written == 1)"),
       .params = {self("program"), defaulted("folder", "path", "", ".", "An existing folder."),
                  defaulted("overwrite", "bool", "", false,
                            "Whether existing files are replaced.")},
       .returns = {"list", "", "Paths of the files written.", {}},
       .effect = Effect::files_write,
       .run = export_files});
  all.push_back(
      {.name = "program.set_file",
       .classic = "",
       .summary = "Sets the text of a file of a program; a missing file is added.",
       .details = "The first file is the program; the others are files it may name: system "
                  "specifications (.ssi), modules (.irl), lists of data (.dls).",
       .example = with_program("lift:set_file{name = \"datalist.dls\", text = \"rounds := 5;\"}\n"
                               "assert(#lift:files() == 2)"),
       .params = {self("program"),
                  needed("name", "string", "", "Name of the file, without folders."),
                  needed("text", "string", "", "Its text.")},
       .returns = {},
       .effect = Effect::edits,
       .run = set_file});
  all.push_back({.name = "program.remove_file",
                 .classic = "",
                 .summary = "Removes a file from a program.",
                 .details = "The first file is the program and cannot be removed.",
                 .example = with_program("lift:set_file{name = \"spare.irl\", text = \"\"}\n"
                                         "lift:remove_file(\"spare.irl\")\n"
                                         "assert(#lift:files() == 1)"),
                 .params = {self("program"), needed("name", "string", "", "Name of the file.")},
                 .returns = {},
                 .effect = Effect::edits,
                 .run = remove_file});
  all.push_back({.name = "program.files",
                 .classic = "",
                 .summary = "Lists the files of a program; the first is the program itself.",
                 .details = "",
                 .example = with_program("assert(lift:files()[1].name == \"lift.irl\")"),
                 .params = {self("program")},
                 .returns = {"list", "", "One table per file: name, lines.", {}},
                 .effect = Effect::reads,
                 .run = files});
  all.push_back(
      {.name = "program.source",
       .classic = "",
       .summary = "Returns the text of a program, or of another of its files.",
       .details = "",
       .example = with_program("assert(lift:source():find(\"PROGRAM lift\"))"),
       .params = {self("program"), optional("name", "string", "",
                                            "Name of the file; the program itself if omitted.")},
       .returns = {"string", "", "The text.", {}},
       .effect = Effect::reads,
       .run = source});
  all.push_back(
      {.name = "program.check",
       .classic = "",
       .summary = "Checks a program and lists every fault with its place and a hint.",
       .details = "Checked are names, types, assignable places, constant values, and targets and "
                  "attributes of motions. Up to 100 errors are reported.",
       .example =
           with_program("local wrong = lift:source():gsub(\"rounds := 3\", \"rounds := 3.5\")\n"
                        "lift:set_file{name = \"lift.irl\", text = wrong}\n"
                        "assert(lift:check().faults[1].line == 3)"),
       .params = {self("program")},
       .returns = {"map",
                   "",
                   "",
                   {field("correct", "bool", "", "Whether it has no errors."),
                    field("errors", "int", "", "Number of errors."),
                    field("warnings", "int", "", "Number of warnings."),
                    field("faults", "list", "",
                          "One table each: severity, file, line, column, length, message, hint, "
                          "fault.")}},
       .effect = Effect::reads,
       .run = check_source});
  all.push_back(
      {.name = "program.tree",
       .classic = "",
       .summary = "Returns a program as its compiler understands it: symbols with their types, "
                  "routines with their statements.",
       .details =
           "Statements are tables with `statement` (its kind), `line`, and its parts: `a`, `b` and "
           "`c` are its expressions as in the source, `type` is that of `a`, `statements` contains "
           "nested statements; motions have `interpolation`, `incremental`, `targets`, "
           "`attributes` and `until`. A program with errors has no tree.",
       .example = with_program("local go = lift:tree().routines[2]\n"
                               "assert(go.name == \"go\" and go.statements[1].interpolation == "
                               "\"LIN\")"),
       .params = {self("program")},
       .returns = {"map",
                   "",
                   "",
                   {field("name", "string", "", "Name of the program."),
                    field("symbols", "list", "",
                          "One table each: name, kind, type, scope, line, value."),
                    field("routines", "list", "",
                          "One table each: name, kind, parameters, result, recursive, line, "
                          "statements. The first is the program.")}},
       .effect = Effect::reads,
       .run = tree});
  all.push_back({.name = "program.code",
                 .classic = "",
                 .summary = "Returns a program as three-address code, or writes it to a file.",
                 .details = "Four fields a line; docs/plugin_author/language.md describes the "
                            "form. program.read_code reads such a file.",
                 .example = with_program("assert(lift:code():find(\"MOVE LIN\"))"),
                 .params = {self("program"), optional("file", "path", "", "The file to write.")},
                 .returns = {"string", "", "The code, or the path of the written file.", {}},
                 .effect = Effect::reads,
                 .sometimes = Effect::files_write,
                 .run = code});
  all.push_back(
      {.name = "program.read_code",
       .classic = "",
       .summary = "Reads a file of three-address code and lists its contents.",
       .details = "Every number in it must refer to an existing variable, type, label or routine. "
                  "Faults name the line.",
       .example = with_program("lift:code{file = \"lift.code\"}\n"
                               "assert(#program.read_code{file = \"lift.code\"}.routines == 2)"),
       .params = {needed("file", "path", "", "The file.")},
       .returns = {"map",
                   "",
                   "",
                   {field("name", "string", "", "Name of the program."),
                    field("instructions", "int", "", "Number of instructions."),
                    field("routines", "list", "", "One table each: name, instructions.")}},
       .effect = Effect::files_read,
       .run = read_code});
  return all;
}

}  // namespace robomosp::ioci
