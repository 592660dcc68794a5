// SPDX-License-Identifier: Apache-2.0
// The command that compares one program for several controllers (program_post/comparison.h).
#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <tuple>

#include <robomosp/sdk/post_axes.h>
#include <robomosp/sdk/post_writer.h>

#include "io/native.h"
#include "ioci/core/commands.h"
#include "ioci/program/compiled.h"
#include "ioci/program/post_cell.h"
#include "ioci/program/post_profile.h"
#include "ioci/program/program_files.h"
#include "ioci/program/read_back.h"
#include "ioci/program/rows.h"
#include "model/program_kinds.h"
#include "program_post/comparison.h"
#include "program_post/part_of_robot.h"
#include "program_source/source_text.h"

namespace robomosp::ioci {
namespace {

namespace comparison = program_post::comparison;
using comparison::Comparison, comparison::Difference, comparison::Line, comparison::Reached,
    comparison::Side, comparison::SideFault, comparison::input_named;

/// What was posted for a target, and how its controller counts the robot's axes.
struct PostedSide {
  Side side;
  ProviderInfo info;
  std::shared_ptr<ControllerProfile> axes;
};

/// Runs through what an independent reader makes of the files.
Result<void> read_back(CommandContext& ctx, const rmp_code& program, const PostCell& cell,
                       const program::TraceOptions& options, PostedSide& posted) {
  Side& side = posted.side;
  RMP_TRY_ASSIGN(const ReadBack read,
                 read_posted(ctx, side.files, posted.axes ? &posted.axes->record : nullptr));
  side.not_read = read.not_read;
  // What it could not say is told; all the rest is compared.
  for (const ReadBack::Unread& u : read.not_said) {
    SideFault told{"error", "", u.message, "", 0};
    if (const auto at = side.source_of.find({u.file, u.line}); at != side.source_of.end())
      std::tie(told.file, told.line) = at->second;
    side.not_said.push_back(std::move(told));
  }
  if (!read.program) return {};
  auto traced = program::trace(
      read.program, comparison::inputs_of(program, options, read.program->code()), &ctx.progress);
  if (!traced.ok()) {
    if (traced.error().code == ErrorCode::cancelled) return std::move(traced).error();
    side.not_read = "as reader " + read.reader +
                    " has it, it cannot be run through: " + traced.error().sentence();
    return {};
  }
  side.reader = read.reader;
  std::vector<PostAxis> externals;
  comparison::Carried carried;
  if (cell.carrier) {
    carried.carrier = &*cell.carrier;
    carried.is_controllers = true;
    carried.has_no_additional = cell_number(read.program->code(), "R_NADDJ", 1) == 0;
    RMP_TRY_ASSIGN(const auto kind, rail_kind(posted.info, side.capabilities, posted.axes->view));
    carried.is_on_carriage = cell.is_on_rail() && kind != program_post::RailKind::base;
    for (const PostAxis& a : posted.axes->axes)
      if (a.external && a.of_robot == 0 && a.joint >= 0) externals.push_back(a);
    carried.axes = externals;
  }
  side.reached = comparison::reached(*traced, {}, carried);
  if (counts_maker_axes(read.program->code()) && posted.axes)
    for (Reached& r : side.reached) {
      if (!r.is_joints || r.joints.empty()) continue;
      const auto& axes = posted.axes->view.axes;
      std::size_t count = r.joints.size();
      for (const PostAxis& a : axes)
        if (is_of_robot(a) && a.joint >= 0)
          count = std::max(count, static_cast<std::size_t>(a.joint) + 1);
      const auto q = joints_from_axes(axes, r.joints, std::vector<double>(count, 0.0), nullptr);
      if (!q) continue;
      r.joints = *q;
      for (std::size_t j = 0; j < q->size(); ++j)
        for (const PostAxis& a : axes)
          if (a.joint == static_cast<std::int32_t>(j))
            r.joints[j] = (*q)[j] * axis_scale(a, nullptr);
    }
  side.bits = comparison::deeds(*traced, false);
  side.whole = comparison::deeds(*traced, true);
  return {};
}

std::vector<std::string> split_lines(const std::string& text) {
  std::vector<std::string> out;
  for (std::string_view line : text::split(text, '\n')) {
    if (line.ends_with('\r')) line.remove_suffix(1);
    out.emplace_back(line);
  }
  while (!out.empty() && out.back().empty()) out.pop_back();
  return out;
}

Result<PostedSide> post_side(CommandContext& ctx, const Map& args, const PostCell& cell,
                             const std::shared_ptr<const CompiledProgram>& program,
                             const std::string& symbol, const std::string& asked) {
  PostedSide posted;
  Side& out = posted.side;
  Map post{{"id", *args.find("id")}, {"check", true}, {"source_map", true}};
  if (const auto profile = ctx.snapshot().find(controller_kind(), asked)) {
    post.set("profile", Application::handle(*profile));
    out.profile = asked;
  } else {
    post.set("target", Value(asked));
  }
  for (const char* each : {"robot", "world", "name_there", "form", "inputs"})
    if (has(args, each)) post.set(each, *args.find(each));
  posted.axes = std::make_shared<ControllerProfile>();
  if (const auto profile = ctx.snapshot().find(controller_kind(), asked)) {
    const model::Record* r = ctx.snapshot().find(*profile);
    posted.axes->name = r->name;
    posted.axes->record = std::get<model::OtherContent>(r->body).as<model::Controller>();
  }
  RMP_TRY(posted.axes->fill());
  if (cell.is_placed) {
    // Each side owns the names of its axes.
    RMP_TRY_ASSIGN(PostCell own, post_cell(ctx, args, program, symbol));
    RMP_TRY(
        posted.axes->use(std::move(own.maker), own.robot_name, own.rail));  // the post reports it
  } else if (has(args, "robot")) {
    RMP_TRY_ASSIGN(auto maker, robotics::MakerAxes::of(content<model::Robot>(ctx, args, "robot")));
    RMP_TRY(posted.axes->use(std::move(maker), name_in(ctx, ref(args, "robot")),
                             cell.rail));  // the post reports it
  }
  RMP_TRY_ASSIGN(const Value found, ctx.dispatch("program.post", post));
  const Map& map = *found.as_map();
  out.target = *map.find("target")->as_string();
  out.label = out.profile.empty() ? out.target : out.profile;
  out.form = *map.find("form")->as_string();
  out.is_correct = *map.find("correct")->as_bool();
  RMP_TRY_ASSIGN(const auto made, ctx.app.registry.create<Post>(out.target));
  out.capabilities = made->capabilities();
  RMP_TRY_ASSIGN(posted.info, ctx.app.registry.find(Post::kInterfaceId, out.target));
  if (cell.carrier) {
    RMP_TRY_ASSIGN(const auto kind, rail_kind(posted.info, out.capabilities, posted.axes->view));
    if (kind != program_post::RailKind::none) carry_axes(*posted.axes, cell);
  }
  out.title = std::string(out.capabilities.title);
  for (const Value& each : *map.find("faults")->as_list()) {
    const Map& f = *each.as_map();
    out.faults.push_back({*f.find("severity")->as_string(), *f.find("file")->as_string(),
                          *f.find("message")->as_string(), *f.find("hint")->as_string(),
                          static_cast<std::uint32_t>(*f.find("line")->as_int())});
  }
  for (const Value& each : *map.find("files")->as_list()) {
    const Map& f = *each.as_map();
    out.files.emplace_back(*f.find("name")->as_string(), *f.find("text")->as_string());
  }
  out.units = comparison::units_of(out.target);
  auto& source = out.source_of;
  for (const Value& each : *map.find("source_map")->as_list()) {
    const Map& l = *each.as_map();
    source[{*l.find("file")->as_string(), static_cast<std::size_t>(*l.find("line")->as_int())}] = {
        *l.find("source")->as_string(),
        static_cast<std::uint32_t>(*l.find("source_line")->as_int())};
  }
  for (const auto& [name, text] : out.files) {
    const std::vector<std::string> lines = split_lines(text);
    for (std::size_t i = 0; i < lines.size(); ++i) {
      const auto at = source.find({name, i + 1});
      const auto key =
          at == source.end() ? std::pair<std::string, std::uint32_t>{"", 0} : at->second;
      out.lines[key].push_back({name, i + 1, lines[i]});
    }
  }
  return posted;
}

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

Result<Comparison> compared(CommandContext& ctx, const Map& args,
                            const std::vector<std::string>& targets) {
  Comparison out;
  RMP_TRY_ASSIGN(const Compiled made, compile_whole(ctx, args));
  const model::Program& p = program_of(ctx, args);
  for (std::size_t i = 0; i < p.files.size(); ++i)
    out.source.emplace_back(p.files[i].name, p.files[i].lines);
  program::TraceOptions options;
  if (const Value* given = args.find("inputs"); given && given->as_map()) {
    RMP_TRY_ASSIGN(options.inputs, input_values(made.code(), *given->as_map()));
  }
  const auto moved = program_post::robots_that_move(made.code());
  const std::string symbol = moved.size() == 1 ? moved.front() : std::string();
  RMP_TRY_ASSIGN(const PostCell cell, post_cell(ctx, args, made.program, symbol));
  comparison::Carried carried;
  if (cell.carrier) {
    carried.carrier = &*cell.carrier;
    carried.has_no_additional = cell.carrier->has_no_additional;
  }
  auto traced = program::trace(made.program, options, &ctx.progress);
  if (traced.ok())
    out.reached = comparison::reached(*traced, cell.places, carried),
    out.bits = comparison::deeds(*traced, false), out.whole = comparison::deeds(*traced, true);
  else if (traced.error().code == ErrorCode::cancelled) return std::move(traced).error();
  else out.not_traced = traced.error().sentence();
  for (const std::string& each : targets) {
    RMP_TRY_ASSIGN(PostedSide posted, post_side(ctx, args, cell, made.program, symbol, each));
    Side& side = posted.side;
    if (side.is_correct && !side.files.empty()) {
      RMP_TRY(read_back(ctx, made.code(), cell, options, posted));
    } else if (!side.is_correct) {
      side.not_read = "it cannot be posted";
    }
    out.sides.push_back(std::move(side));
  }
  comparison::compare(out);
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
  RMP_TRY_ASSIGN(const Comparison c, compared(ctx, args, targets));
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
