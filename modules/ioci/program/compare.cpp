// SPDX-License-Identifier: Apache-2.0
// The command that compares one program for several controllers (program_post/comparison.h).
#include <algorithm>
#include <cmath>
#include <map>

#include "io/native.h"
#include "ioci/core/commands.h"
#include "ioci/program/compiled.h"
#include "ioci/program/in_world.h"
#include "ioci/program/post_form.h"
#include "ioci/program/rows.h"
#include "ioci/program/workshop.h"
#include "program_post/compare_targets.h"
#include "program_source/source_text.h"

namespace robomosp::ioci {
namespace {

namespace comparison = program_post::comparison;
using comparison::Comparison, comparison::Difference, comparison::Line, comparison::Side,
    comparison::SideFault, comparison::input_named;

/// Values of inputs, of those that the program has, each of its type.
Result<std::map<std::string, program::SignalValue>> input_values(const rmp_code& code,
                                                                 const Map& given) {
  std::map<std::string, program::SignalValue> out;
  std::vector<std::string> names;
  for (std::uint32_t i = 0; i < code.symbols.count; ++i)
    if (const auto& s = row_of<rmp_code_symbol>(code.symbols, i); s.kind == RMP_SYMBOL_INPUT)
      names.emplace_back(s.name);
  for (const auto& [name, value] : given) {
    const rmp_code_symbol* symbol = input_named(code, name);
    if (!symbol) {
      if (names.empty())
        return error(ErrorCode::invalid_argument,
                     "the program has no input " + text::quote(name) + ", and no others",
                     "Leave inputs out.", "inputs");
      Error e = unknown_name("input", name, names);
      e.where = "inputs";
      return e;
    }
    const bool* is_on = value.as_bool();
    const auto* integer = value.as_int();
    const double* number = value.as_real();
    const auto wrong = [&](const char* type, const char* such) {
      return error(
          ErrorCode::invalid_argument,
          "input " + text::quote(symbol->name) + " is a " + type + ", and not " + value.text(),
          "Such as inputs = {" + std::string(symbol->name) + " = " + such + "}.", "inputs");
    };
    program::SignalValue v;
    if (symbol->type == RMP_TYPE_BOOL) {
      if (!is_on) return wrong("BOOL", "true");
      v = {*is_on ? 1 : 0, *is_on ? 1.0 : 0.0};
    } else if (symbol->type == RMP_TYPE_INT) {
      const bool is_whole = number && std::floor(*number) == *number && std::fabs(*number) < 1e9;
      if (!integer && !is_whole) return wrong("INT", "3");
      const std::int64_t whole = integer ? *integer : std::llround(*number);
      v = {whole, static_cast<double>(whole)};
    } else {
      if (!integer && !(number && std::fabs(*number) < 1e9)) return wrong("REAL", "2.5");
      const double x = number ? *number : static_cast<double>(*integer);
      v = {std::llround(x), x};
    }
    out[name] = v;
  }
  return out;
}

Result<Value> compare_targets(CommandContext& ctx, const Map& args) {
  std::vector<std::string> targets;
  for (const Value& each : *args.find("targets")->as_list()) {
    if (!each.as_string())
      return error(ErrorCode::invalid_argument, each.text() + " is not the name of a target",
                   "Such as targets = {\"krl\", \"rapid\"}, or names of controllers.", "targets");
    if (std::find(targets.begin(), targets.end(), *each.as_string()) != targets.end())
      return error(
          ErrorCode::invalid_argument,
          text::quote(*each.as_string()) + " is given twice, but a target is compared with others",
          "Give each once; a controller's name counts as a separate target.", "targets");
    targets.push_back(*each.as_string());
  }
  if (targets.size() < 2 || targets.size() > 6)
    return error(ErrorCode::invalid_argument,
                 std::to_string(targets.size()) + " targets are given, but 2 to 6 can be compared",
                 "Such as targets = {\"krl\", \"rapid\"}.", "targets");
  const std::string file = has(args, "file") ? text_of(args, "file") : "";
  const bool is_html = file.ends_with(".html"), is_markdown = file.ends_with(".md"),
             is_text = file.ends_with(".txt");
  if (!file.empty() && !is_html && !is_markdown && !is_text)
    return error(ErrorCode::invalid_argument,
                 text::quote(file) + " is neither a .html, .md nor .txt file",
                 "Give one of these extensions.", "file");
  RMP_TRY_ASSIGN(const Compiled made, compile_whole(ctx, args));
  program_post::PostRequest request;
  request.program = ref(args, "id");
  request.place = place_wish(args);
  request.robot = typed<model::Robot>(args, "robot");
  request.form = form_of(args);
  if (const Value* given = args.find("inputs"); given && given->as_map()) {
    RMP_TRY_ASSIGN(request.flattening.inputs, input_values(made.code(), *given->as_map()));
  }
  RMP_TRY_ASSIGN(const Comparison c,
                 comparison::compare_targets(workshop_of(ctx), request, made, targets));
  std::string title = ctx.snapshot().find(ref(args, "id"))->name + ":";
  for (const Side& s : c.sides) title += (&s == &c.sides.front() ? " " : ", ") + s.label;
  const std::string text = comparison::as_text(c, static_cast<std::size_t>(integer(args, "width")));
  if (!file.empty())
    RMP_TRY(io::write_file(file, is_html       ? comparison::as_html(c, title)
                                 : is_markdown ? comparison::as_markdown(c, title)
                                               : text));
  const auto most = static_cast<std::size_t>(integer(args, "most"));
  List sides, differences, rows;
  for (const Side& s : c.sides) {
    std::int64_t errors = 0, warnings = 0;
    for (const SideFault& f : s.faults)
      errors += f.severity == "error", warnings += f.severity == "warning";
    sides.emplace_back(Map{{"target", s.target},
                           {"title", s.title},
                           {"profile", s.profile},
                           {"form", s.form},
                           {"correct", s.is_correct},
                           {"errors", errors},
                           {"warnings", warnings},
                           {"reader", s.reader},
                           {"not_read", s.not_read},
                           {"not_said", static_cast<std::int64_t>(s.not_said.size())},
                           {"compared", static_cast<std::int64_t>(s.compared)},
                           {"most_distance", s.most_mm / 1000},
                           {"most_angle", s.most_degrees / program_source::kDegreesPerRadian}});
  }
  List not_compared;
  for (const std::string& each : c.not_compared) not_compared.emplace_back(each);
  for (const Difference& d : c.differences) {
    if (differences.size() >= most) break;
    differences.emplace_back(Map{{"kind", d.kind},
                                 {"file", d.file},
                                 {"line", static_cast<std::int64_t>(d.line)},
                                 {"target", c.sides[d.side].label},
                                 {"text", d.text}});
  }
  std::size_t all = 0;
  for (const auto& [name, lines] : c.source)
    for (std::uint32_t l = 1; l <= lines.size(); ++l) {
      ++all;
      if (rows.size() >= most) continue;
      List says;
      for (const Side& s : c.sides) {
        std::string texts;
        if (const auto it = s.lines.find({name, l}); it != s.lines.end())
          for (const Line& one : it->second) texts += (texts.empty() ? "" : "\n") + one.text;
        says.emplace_back(std::move(texts));
      }
      rows.emplace_back(
          Map{{"file", name},
              {"line", static_cast<std::int64_t>(l)},
              {"source", lines[l - 1]},
              {"says", std::move(says)},
              {"differs", comparison::lines_that_differ(c, name, nullptr).contains(l)}});
    }
  Map left_out;
  if (c.differences.size() > most)
    left_out.set("differences", Value(static_cast<std::int64_t>(c.differences.size() - most)));
  if (all > most) left_out.set("rows", Value(static_cast<std::int64_t>(all - most)));
  Map out{{"targets", std::move(sides)},
          {"differences", std::move(differences)},
          {"rows", std::move(rows)},
          {"compared", static_cast<std::int64_t>(c.compared)},
          {"most_distance", c.most_mm / 1000},
          {"most_angle", c.most_degrees / program_source::kDegreesPerRadian},
          {"points", comparison::points_sentence(c)},
          {"not_compared", std::move(not_compared)},
          {"left_out", std::move(left_out)},
          {"text", text}};
  if (!c.not_traced.empty()) out.set("not_traced", Value(c.not_traced));
  if (!file.empty()) out.set("file", Value(file));
  return Value(std::move(out));
}

}  // namespace

RMP_COMMANDS(program_compare_commands) {
  CommandSpec c;
  c.name = "program.compare_targets";
  c.summary = "Compares the code of a program for several controllers, side by side.";
  c.details =
      "For each line of the source: the code of each target, what one target cannot express or "
      "expresses differently, and lines that only one has. If an independent reader supports a "
      "target, its files are read back and run, and motions, points, configurations, speeds and "
      "blends are compared with each other and with the program, and outputs and waits for a time "
      "with the program. Quantities that languages give in different units are listed but not "
      "compared. A name in targets is a target or a controller.";
  c.example =
      "local lift = program.create{name = \"lift\", source = [[\n"
      "PROGRAM lift;\n"
      "VAR\n"
      "  POSE: place := POSE(POSITION(500.0, 0.0, 120.0), ORIZYX(0.0, 180.0, 0.0));\n"
      "BEGIN\n"
      "  MOVE LIN place SPEED := 80.0;\n"
      "ENDPROGRAM;\n"
      "]]}\n"
      "local c = lift:compare_targets{targets = {\"krl\", \"melfa5\"}}\n"
      "assert(c.compared == 1 and c.most_distance < 1e-5)";
  c.params = {
      self("program"),
      needed("targets", "list", "", "Two to six targets, or names of controllers."),
      optional("robot", "ref:robot", "", "The robot that moves."),
      optional("world", "ref:world", "",
               "World that defines the frames of its targets and the tool it moves."),
      optional("name_there", "string", "", "Its name there, if the world has it several times."),
      choice("form", {"automatic", "structured", "flat"}, "As in program.post."),
      optional("inputs", "map", "",
               "Values of the program's inputs by name, of the declared types."),
      optional("file", "path", "", "A page with the codes side by side: *.html, *.md or *.txt."),
      between(defaulted("width", "int", "", std::int64_t{44}, "Width of a column of the text."), 12,
              400),
      between(defaulted("most", "int", "", std::int64_t{500},
                        "Greatest number of differences and rows listed."),
              1, 1000000)};
  c.returns = {
      "map",
      "",
      "",
      {field("targets", "list", "",
             "Tables: target, title, profile, form, correct, errors, warnings; reader that read it "
             "back, or not_read, the reason; not_said, the part of it that the reader could not "
             "express; compared, most_distance and most_angle from the program's points."),
       field("differences", "list", "",
             "Tables by line: kind (cannot, otherwise, missing, form, unread, motion, "
             "point, additional, configuration, speed, blend, output), file, line, target, "
             "text."),
       field("rows", "list", "",
             "Tables, one per line of the source: file, line, source, says (one text per target), "
             "differs."),
       field("compared", "int", "",
             "Number of points compared between two targets; 0 means that distances are unknown."),
       field("most_distance", "real", "m", "Greatest distance between them."),
       field("most_angle", "real", "rad", "Greatest distance between them."),
       field("points", "string", "", "The comparison in sentences, and what was not checked."),
       field("not_compared", "list", "", "Sentences: quantities given in different units."),
       field("not_traced", "string", "", "Why the program itself could not be run."),
       field("left_out", "map", "", "Number of rows missing in each list."),
       field("text", "string", "", "Everything as text."),
       field("file", "string", "", "The page.")}};
  c.effect = Effect::reads;
  c.sometimes = Effect::files_write;
  c.run = compare_targets;
  return {std::move(c)};
}

}  // namespace robomosp::ioci
