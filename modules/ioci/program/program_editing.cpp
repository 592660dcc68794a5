// SPDX-License-Identifier: Apache-2.0
// What editors ask of a program, as commands: colours, completion, hover, places of names, new
// names, layout, outline.
#include <algorithm>
#include <deque>

#include "ioci/core/commands.h"
#include "ioci/program/program_files.h"
#include "motion/provider_params.h"
#include "program/open_editing.h"

namespace robomosp::ioci {
namespace {

using model::Program;

constexpr const char* kKinds[kSourceTokenKinds] = {
    "keyword",  "number",    "string", "comment",   "sign",    "name",   "constant",
    "variable", "parameter", "signal", "robot",     "type",    "field",  "procedure",
    "function", "process",   "label",  "attribute", "program", "unknown"};
const char* word_of(SourceTokenKind k) { return kKinds[static_cast<std::uint32_t>(k)]; }

/// A program with its texts and where their lines begin.
struct Editing {
  std::vector<std::string> names, texts;
  std::vector<std::vector<std::uint32_t>> lines;
  std::unique_ptr<EditedProgram> program;

  /// Fields `line`, `column` and `length` of a piece of a file.
  void place(Map& out, std::uint32_t file, std::uint32_t begin, std::uint32_t end) {
    std::vector<std::uint32_t>& starts = lines[file];
    if (starts.empty()) {
      starts.push_back(0);
      for (std::size_t i = 0; i < texts[file].size(); ++i)
        if (texts[file][i] == '\n') starts.push_back(static_cast<std::uint32_t>(i + 1));
    }
    const auto it = std::upper_bound(starts.begin(), starts.end(), begin) - 1;
    out.set("line", static_cast<std::int64_t>(it - starts.begin() + 1));
    out.set("column", static_cast<std::int64_t>(begin - *it + 1));
    out.set("length", static_cast<std::int64_t>(end - begin));
  }
  Map place(const SourceRange& r) {
    Map out{{"file", names[r.file]}};
    place(out, r.file, r.begin, r.end);
    return out;
  }
};

Result<Editing> open(CommandContext& ctx, const Map& args) {
  const Program& p = program_of(ctx, args);
  if (p.files.empty())
    return error(ErrorCode::invalid_argument, "it has no source", "Set it with program.set_file.",
                 name_in(ctx, ref(args, "id")));
  RMP_TRY_ASSIGN(const ProviderInfo info,
                 ctx.app.registry.find(Language::kInterfaceId, p.language));
  RMP_TRY_ASSIGN(auto language, language_of(ctx, info.name));
  model::ProviderChoice choice;
  choice.name = info.name;
  RMP_TRY_ASSIGN(auto params,
                 motion::checked_params(info, choice, "provider " + text::quote(info.name)));
  Editing out;
  std::vector<SourceFile> files;
  for (const model::ProgramFile& f : p.files) {
    out.names.push_back(f.name);
    out.texts.push_back(text_of_file(f));
  }
  for (std::size_t i = 0; i < out.texts.size(); ++i)
    files.push_back({out.names[i], out.texts[i], {}});
  out.lines.resize(files.size());
  RMP_TRY_ASSIGN(out.program,
                 program::open_editing(std::move(language), info.name, std::move(params), files));
  return out;
}

/// The file that an argument names; the program itself when it was left out.
Result<std::uint32_t> file_of(const Editing& e, const Map& args) {
  if (!has(args, "name")) return 0U;
  const std::string name = text_of(args, "name");
  const auto it = std::find(e.names.begin(), e.names.end(), name);
  if (it == e.names.end()) return unknown_name("file", name, e.names);
  return static_cast<std::uint32_t>(it - e.names.begin());
}
/// The byte that `line` and `column` name; the column behind the last byte is one, too.
Result<std::uint32_t> place_of(const Editing& e, std::uint32_t file, const Map& args) {
  const std::string& all = e.texts[file];
  const std::int64_t line = integer(args, "line"), column = integer(args, "column");
  std::size_t begin = 0;
  for (std::int64_t n = 1; n < line; ++n) {
    const std::size_t end = all.find('\n', begin);
    if (end == std::string::npos)
      return error(ErrorCode::invalid_argument,
                   e.names[file] + " has " + std::to_string(n) + " lines, but no line " +
                       std::to_string(line),
                   {}, "line");
    begin = end + 1;
  }
  const std::size_t end = std::min(all.find('\n', begin), all.size());
  if (static_cast<std::uint64_t>(column) > end - begin + 1)
    return error(ErrorCode::invalid_argument,
                 "line " + std::to_string(line) + " of " + e.names[file] + " has " +
                     std::to_string(end - begin) + " bytes, but no column " +
                     std::to_string(column),
                 {}, "column");
  return static_cast<std::uint32_t>(begin + static_cast<std::size_t>(column) - 1);
}
struct Place {
  Editing editing;
  std::uint32_t file = 0, at = 0;
};
Result<Place> open_at(CommandContext& ctx, const Map& args) {
  Place out;
  RMP_TRY_ASSIGN(out.editing, open(ctx, args));
  RMP_TRY_ASSIGN(out.file, file_of(out.editing, args));
  RMP_TRY_ASSIGN(out.at, place_of(out.editing, out.file, args));
  return out;
}

Result<Value> tokens(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(Editing e, open(ctx, args));
  RMP_TRY_ASSIGN(const std::uint32_t file, file_of(e, args));
  RMP_TRY_ASSIGN(const auto all, e.program->tokens(file, ctx.progress));
  List out;
  for (const SourceToken& t : all) {
    Map one{{"kind", word_of(t.kind)}};
    e.place(one, file, t.begin, t.end);
    one.set("declaration", t.is_declaration);
    one.set("predefined", t.is_predefined);
    out.emplace_back(std::move(one));
  }
  return Value(std::move(out));
}

Result<Value> complete(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(Place p, open_at(ctx, args));
  RMP_TRY_ASSIGN(const auto all, p.editing.program->complete(p.file, p.at, ctx.progress));
  List out;
  for (const SourceCompletion& c : all) {
    Map one{{"label", c.label},
            {"kind", word_of(c.kind)},
            {"detail", c.detail},
            {"doc", c.doc},
            {"insert", c.insert}};
    p.editing.place(one, p.file, c.begin, c.end);
    out.emplace_back(std::move(one));
  }
  return Value(std::move(out));
}

Result<Value> hover(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(Place p, open_at(ctx, args));
  RMP_TRY_ASSIGN(const SourceHover h, p.editing.program->hover(p.file, p.at, ctx.progress));
  if (h.detail.empty()) return Value();
  Map out{{"detail", h.detail}, {"doc", h.doc}};
  p.editing.place(out, p.file, h.range.begin, h.range.end);
  return Value(std::move(out));
}

Result<Value> definition(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(Place p, open_at(ctx, args));
  RMP_TRY_ASSIGN(const auto all, p.editing.program->definition(p.file, p.at, ctx.progress));
  List out;
  for (const SourceRange& r : all) out.emplace_back(p.editing.place(r));
  return Value(std::move(out));
}

Result<Value> references(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(Place p, open_at(ctx, args));
  RMP_TRY_ASSIGN(const auto all, p.editing.program->references(p.file, p.at, ctx.progress));
  List out;
  for (const SourceReference& r : all) {
    Map one = p.editing.place(r.range);
    one.set("declaration", r.is_declaration);
    out.emplace_back(std::move(one));
  }
  return Value(std::move(out));
}

/// Gives files of the program new texts.
Result<void> set_texts(CommandContext& ctx, const Map& args,
                       const std::vector<std::pair<std::size_t, std::string>>& texts) {
  if (texts.empty()) return {};
  return edit_program(ctx, ref(args, "id"), [&](Program& q) -> Result<void> {
    for (const auto& [file, all] : texts) q.files[file].lines = lines_of(all);
    return {};
  });
}

Result<Value> rename(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(Place p, open_at(ctx, args));
  const std::string to = text_of(args, "to");
  if (to.empty())
    return error(ErrorCode::invalid_argument, "the new name is empty", "Such as: to = \"place\".",
                 "to");
  RMP_TRY_ASSIGN(const auto edits, p.editing.program->rename(p.file, p.at, to, ctx.progress));
  List places;
  for (const SourceEdit& e : edits) places.emplace_back(p.editing.place(e.range));
  std::vector<std::pair<std::size_t, std::string>> texts;
  for (std::size_t i = 0; i < edits.size();) {
    const std::uint32_t file = edits[i].range.file;
    const std::string& old = p.editing.texts[file];
    std::string made;
    std::uint32_t done = 0;
    for (; i < edits.size() && edits[i].range.file == file; ++i) {
      made.append(old, done, edits[i].range.begin - done);
      made += edits[i].text;
      done = edits[i].range.end;
    }
    made.append(old, done);
    if (made != old) texts.emplace_back(file, std::move(made));
  }
  RMP_TRY(set_texts(ctx, args, texts));
  return Value(
      Map{{"changed", static_cast<std::int64_t>(edits.size())}, {"places", std::move(places)}});
}

Result<Value> format(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(Editing e, open(ctx, args));
  SourceLayout layout;
  layout.indent = static_cast<std::uint32_t>(integer(args, "indent"));
  const std::string words = text_of(args, "keywords");
  layout.words = words == "upper"   ? SourceCase::upper
                 : words == "lower" ? SourceCase::lower
                                    : SourceCase::keep;
  std::uint32_t first = 0, last = static_cast<std::uint32_t>(e.names.size());
  if (has(args, "name")) {
    RMP_TRY_ASSIGN(first, file_of(e, args));
    last = first + 1;
  }
  List files;
  std::vector<std::pair<std::size_t, std::string>> texts;
  for (std::uint32_t f = first; f < last; ++f) {
    RMP_TRY_ASSIGN(std::string made, e.program->format(f, layout, ctx.progress));
    if (made == e.texts[f]) continue;
    files.emplace_back(e.names[f]);
    texts.emplace_back(f, std::move(made));
  }
  const bool is_changed = !texts.empty();
  if (!flag(args, "check")) RMP_TRY(set_texts(ctx, args, texts));
  return Value(Map{{"changed", is_changed}, {"files", std::move(files)}});
}

Result<Value> outline(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(Editing e, open(ctx, args));
  RMP_TRY_ASSIGN(const std::uint32_t file, file_of(e, args));
  RMP_TRY_ASSIGN(const auto all, e.program->outline(file, ctx.progress));
  List out;
  for (const SourceSymbol& s : all) {
    Map one{{"name", s.name}, {"kind", word_of(s.kind)}, {"detail", s.detail}};
    if (s.parent != RMP_NONE) one.set("parent", static_cast<std::int64_t>(s.parent) + 1);
    Map end;
    e.place(end, file, s.end, s.end);
    e.place(one, file, s.name_begin, s.name_end);
    one.set("last_line", *end.find("line")->as_int());
    out.emplace_back(std::move(one));
  }
  return Value(std::move(out));
}

std::string with_edited_program(const char* rest) {
  return std::string(
             "local lift = program.create{name = \"lift\", source = [[\n"
             "PROGRAM lift;\n"
             "VAR INT: rounds := 3, i;\n"
             "BEGIN\n"
             "  FOR i := 1 TO rounds\n"
             "  WAIT 0.5 SEC;\n"
             "  ENDFOR;\n"
             "ENDPROGRAM;\n"
             "]]}\n") +
         rest;
}
std::vector<ParamSpec> with_place(std::vector<ParamSpec> more = {}) {
  constexpr double kMost = 4e9;
  std::vector<ParamSpec> out{
      self("program"), between(needed("line", "int", "", "Line, 1 is the first."), 1, kMost),
      between(needed("column", "int", "", "Byte of the line, 1 is the first."), 1, kMost)};
  for (ParamSpec& p : more) out.push_back(std::move(p));
  out.push_back(optional("name", "string", "", "Name of the file; the program itself if omitted."));
  return out;
}
std::vector<ParamSpec> piece(std::vector<ParamSpec> before) {
  before.push_back(field("line", "int", "", "Column of its first byte."));
  before.push_back(field("column", "int", "", "Byte of the line, 1 is the first."));
  before.push_back(field("length", "int", "", "Bytes."));
  return before;
}

}  // namespace

RMP_COMMANDS(program_editing_commands) {
  std::vector<CommandSpec> all;
  const ParamSpec file =
      optional("name", "string", "", "Name of the file; the program itself if omitted.");
  all.push_back(
      {.name = "program.tokens",
       .classic = "",
       .summary = "Returns the tokens of a program with their kinds, for syntax colouring.",
       .details = "Kinds are keyword, number, string, comment, sign, constant, variable, "
                  "parameter, signal, robot, type, field, procedure, function, process, label, "
                  "attribute, program; name is an identifier that is not declared, and unknown is "
                  "no token of the language. Works on programs with errors.",
       .example = with_edited_program("assert(lift:tokens()[2].kind == \"program\")"),
       .params = {self("program"), file},
       .returns = {"list", "", "One table each, in order.",
                   piece({field("kind", "string", "", "Its kind."),
                          field("declaration", "bool", "", "Whether this is its declaration."),
                          field("predefined", "bool", "", "Whether it belongs to the language.")})},
       .effect = Effect::reads,
       .run = tokens});
  all.push_back(
      {.name = "program.complete",
       .classic = "",
       .summary = "Lists the completions at a place of a program.",
       .details = "The best first. A partly typed word is completed: the bytes that `insert` "
                  "replaces are those at `line`, `column`. The line need not be complete.",
       .example = with_edited_program("assert(lift:complete{line = 4, column = 20}[1].label == "
                                      "\"rounds\")"),
       .params = with_place(),
       .returns = {"list", "", "One table each.",
                   piece({field("label", "string", "", "The name or word."),
                          field("kind", "string", "", "Kind as in program.tokens."),
                          field("detail", "string", "", "Its declaration."),
                          field("doc", "string", "",
                                "The comment beside its declaration, or its description."),
                          field("insert", "string", "", "Text that replaces the bytes.")})},
       .effect = Effect::reads,
       .run = complete});
  all.push_back(
      {.name = "program.hover",
       .classic = "",
       .summary = "Describes the name or word at a place of a program.",
       .details = "Empty if there is no word.",
       .example = with_edited_program("assert(lift:hover{line = 4, column = 18}.detail == "
                                      "\"VAR INT: rounds := 3\")"),
       .params = with_place(),
       .returns = {"map", "", "",
                   piece({field("detail", "string", "", "Its declaration."),
                          field("doc", "string", "",
                                "The comment beside its declaration, or its description.")})},
       .effect = Effect::reads,
       .run = hover});
  all.push_back(
      {.name = "program.definition",
       .classic = "",
       .summary = "Returns the place where the name at a place of a program is declared.",
       .details =
           "Empty for names of the language. For the name of a file it is the start of that file.",
       .example = with_edited_program("assert(lift:definition{line = 4, column = 18}[1].line "
                                      "== 2)"),
       .params = with_place(),
       .returns = {"list", "", "One table each.",
                   piece({field("file", "string", "", "A file of the program.")})},
       .effect = Effect::reads,
       .run = definition});
  all.push_back(
      {.name = "program.references",
       .classic = "",
       .summary = "Lists every place of the name at a place of a program, in all of its files.",
       .details = "",
       .example = with_edited_program("assert(#lift:references{line = 4, column = 18} == 2)"),
       .params = with_place(),
       .returns = {"list", "", "One table each.",
                   piece({field("file", "string", "", "A file of the program."),
                          field("declaration", "bool", "", "Whether this is its declaration.")})},
       .effect = Effect::reads,
       .run = references});
  all.push_back(
      {.name = "program.rename_symbol",
       .classic = "",
       .summary = "Renames the symbol at a place of a program in all of its files.",
       .details = "Refused if the program would change its meaning or get another error, or if "
                  "lines with that name have errors.",
       .example = with_edited_program("lift:rename_symbol{line = 2, column = 10, to = \"n\"}\n"
                                      "assert(lift:source():find(\"TO n\"))"),
       .params = with_place({needed("to", "string", "", "The new name.")}),
       .returns = {"map",
                   "",
                   "",
                   {field("changed", "int", "", "Number of places changed."),
                    field("places", "list", "",
                          "The changed places: file, line, column, length.")}},
       .effect = Effect::edits,
       .run = rename});
  all.push_back(
      {.name = "program.format",
       .classic = "",
       .summary = "Formats a program's files in the usual layout.",
       .details = "Lines stay lines; only blanks and empty lines change. Comments keep every byte, "
                  "and the program keeps its meaning.",
       .example = with_edited_program("assert(lift:format{check = true}.changed)\nlift:format()\n"
                                      "assert(lift:source():find(\"\\n    WAIT\"))"),
       .params =
           {self("program"), optional("name", "string", "", "Name of the file; all if omitted."),
            between(defaulted("indent", "int", "", 2, "Indentation per level, in blanks."), 0, 16),
            choice("keywords", {"keep", "upper", "lower"}, "Case of reserved words."),
            defaulted("check", "bool", "", false, "Only report whether the layout would change.")},
       .returns = {"map",
                   "",
                   "",
                   {field("changed", "bool", "", "Whether the layout differed."),
                    field("files", "list", "", "Names of the files that differed.")}},
       .effect = Effect::edits,
       .run = format});
  all.push_back(
      {.name = "program.outline",
       .classic = "",
       .summary = "Lists the declarations in a file of a program, routines with their contents.",
       .details = "Works on programs with errors.",
       .example = with_edited_program("assert(lift:outline()[2].name == \"rounds\")"),
       .params = {self("program"), file},
       .returns = {"list", "", "One table each; nested entries follow the one that contains them.",
                   piece({field("name", "string", "", "Its name."),
                          field("kind", "string", "", "Kind as in program.tokens."),
                          field("detail", "string", "", "Its declaration."),
                          field("parent", "int", "", "Number of the entry that contains it."),
                          field("last_line", "int", "", "Its last line.")})},
       .effect = Effect::reads,
       .run = outline});
  return all;
}

}  // namespace robomosp::ioci
