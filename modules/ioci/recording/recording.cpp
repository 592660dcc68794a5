// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "io/native.h"
#include "ioci/core/commands.h"
#include "ioci/core/loaded.h"
#include "ioci/core/origins.h"
#include "ioci/core/surroundings.h"
#include "ioci/core/watchers.h"
#include "ioci/core/word_list.h"
#include "ioci/recording/plot_answer.h"
#include "ioci/recording/recording_argument.h"
#include "ioci/view/lone_robot.h"
#include "recording/file.h"
#include "recording/limit_share.h"
#include "recording/plot/heat_map.h"
#include "recording/recording.h"

namespace robomosp::ioci {
namespace {

Result<std::vector<const recording::Column*>> chosen(const recording::Recording& r,
                                                     const Map& args) {
  RMP_TRY_ASSIGN(auto names, word_list(args, "columns"));
  if (names.empty())
    for (const recording::Column& c : r.columns)
      if (c.name != "time") names.push_back(c.name);
  return r.select(names);
}

/// One recording or a list of them.
Result<std::vector<recording::RecordingPtr>> recordings_in(CommandContext& ctx, const Map& args,
                                                           const std::string& path) {
  std::vector<recording::RecordingPtr> out;
  const Value* given = args.find(path);
  if (!given || given->is_nil()) return out;
  const auto add = [&](const Value& v) -> Result<void> {
    const Handle* h = v.as_handle();
    auto found = h && h->kind == "recording" ? ctx.app.recordings.find(h->number) : nullptr;
    if (!found)
      return error(ErrorCode::invalid_argument, v.text() + " is not a recording",
                   "Give a recording or a list of recordings.", path);
    out.push_back(std::move(found));
    return {};
  };
  if (!given->as_list()) {
    RMP_TRY(add(*given));
    return out;
  }
  for (const Value& v : *given->as_list()) RMP_TRY(add(v));
  return out;
}

/// What changed of what a recording was made from.
std::vector<std::string> changes_of(CommandContext& ctx, std::uint64_t number) {
  const OriginPtr origin = ctx.app.origins->find(number);
  if (!origin || !origin->fixed.empty()) return {};
  return changes_since(ctx.app, ctx.snapshot(), origin->inputs);
}

/// Notes of one recording or a list of them, where they are out of date.
void tell_stale(CommandContext& ctx, const Value& recordings, const std::string& work) {
  if (const Handle* h = recordings.as_handle())
    note_if_stale(ctx.app, ctx.snapshot(), h->number, work);
  if (const List* list = recordings.as_list())
    for (const Value& each : *list)
      if (const Handle* h = each.as_handle())
        note_if_stale(ctx.app, ctx.snapshot(), h->number, work);
}

/// Columns that differ by their last number only as "q1 to q6", all with their unit.
std::vector<std::string> column_groups(const recording::Recording& r) {
  const auto stem_of = [](const std::string& name) {
    return name.substr(0, name.find_last_not_of("0123456789") + 1);
  };
  std::vector<std::string> out;
  for (std::size_t i = 0; i < r.columns.size();) {
    const recording::Column& first = r.columns[i];
    const std::string stem = stem_of(first.name);
    std::size_t end = i + 1;
    if (stem.size() < first.name.size())
      while (end < r.columns.size() && r.columns[end].unit == first.unit &&
             r.columns[end].name.size() > stem.size() && stem_of(r.columns[end].name) == stem)
        ++end;
    std::string text = first.name;
    if (end > i + 1) text += (end > i + 2 ? " to " : " and ") + r.columns[end - 1].name;
    if (!first.unit.empty()) text += " [" + first.unit + "]";
    out.push_back(std::move(text));
    i = end;
  }
  return out;
}

Result<Value> overview(CommandContext& ctx, const Map& args) {
  const auto r = recording_of(ctx, args);
  const std::uint64_t number = args.find("id")->as_handle()->number;
  std::string out = r->title.empty() ? "recording#" + std::to_string(number) : r->title;
  out += "\n" + std::to_string(r->rows()) + (r->rows() == 1 ? " sample" : " samples");
  const recording::Column* time = r->find("time");
  if (time && !time->values.empty())
    out += ", time from " + text::print_rounded(time->values.front(), 6) + " to " +
           text::print_rounded(time->values.back(), 6) + " s";
  out += "\n\n";
  const auto note = [&out](const char* word, const std::string& what) {
    std::string head(word);
    head.resize(9, ' ');
    if (!what.empty()) out += "  " + head + what + "\n";
  };
  constexpr std::size_t kMostGroups = 40;
  std::vector<std::string> groups = column_groups(*r);
  if (groups.size() > kMostGroups) {
    const std::size_t more = groups.size() - kMostGroups;
    groups.resize(kMostGroups);
    groups.push_back(std::to_string(more) + " more, which recording.columns lists");
  }
  std::string all;
  for (const std::string& group : groups) all += (all.empty() ? "" : ", ") + group;
  note("columns", all);
  constexpr std::size_t kMostNotes = 5;
  for (std::size_t i = 0; i < std::min(r->notes.size(), kMostNotes); ++i)
    note(i == 0 ? "notes" : "", r->notes[i]);
  if (r->notes.size() > kMostNotes)
    note("", std::to_string(r->notes.size() - kMostNotes) + " more, which recording.notes lists");
  if (const auto changes = changes_of(ctx, number); !changes.empty())
    note("stale", "older than " + text::enumerate(changes) + "; recording.refresh updates it");
  return Value(std::move(out));
}

/// Memory of the values of a recording [bytes].
std::int64_t bytes_of(const recording::Recording& r) {
  std::size_t count = 0;
  for (const recording::Column& c : r.columns) count += c.values.size();
  return static_cast<std::int64_t>(count * sizeof(double));
}

/// The world, or the robot without one, that a recording moves.
std::optional<Handle> subject_of(const document::Snapshot& snapshot,
                                 const recording::Recording& r) {
  if (r.world.number != 0) return Handle{"world", r.world.number};
  if (const auto robot = robot_of(snapshot, r)) return Handle{"robot", robot->number};
  return std::nullopt;
}

Result<Value> list(CommandContext& ctx, const Map&) {
  List out;
  // Read once: it takes longer than the list.
  static const double total = [] {
    const auto memory = read_memory();
    return memory ? static_cast<double>(memory->total) : 0.0;
  }();
  for (const auto& [number, r] : ctx.app.recordings.list()) {
    const std::int64_t bytes = bytes_of(*r);
    Map row{{"recording", Handle{"recording", number}},
            {"title", r->title},
            {"stale", !changes_of(ctx, number).empty()},
            {"robot", r->robot},
            {"trajectory", r->trajectory},
            {"samples", r->rows()},
            {"bytes", bytes},
            {"share", total > 0 ? static_cast<double>(bytes) / total : 0.0}};
    if (auto subject = subject_of(ctx.snapshot(), *r)) row.set("subject", std::move(*subject));
    out.emplace_back(std::move(row));
  }
  return Value(std::move(out));
}

Result<Value> columns(CommandContext& ctx, const Map& args) {
  List out;
  for (const recording::Column& c : recording_of(ctx, args)->columns)
    out.emplace_back(Map{{"name", c.name}, {"unit", c.unit}, {"doc", c.doc}});
  return Value(std::move(out));
}

Result<Value> notes(CommandContext& ctx, const Map& args) {
  List out;
  for (const std::string& note : recording_of(ctx, args)->notes) out.emplace_back(note);
  const auto changes = changes_of(ctx, args.find("id")->as_handle()->number);
  if (!changes.empty())
    out.emplace_back("It is older than " + text::enumerate(changes) +
                     "; recording.refresh updates it.");
  return Value(std::move(out));
}

Result<Value> values(CommandContext& ctx, const Map& args) {
  const auto r = recording_of(ctx, args);
  RMP_TRY_ASSIGN(const auto picked, chosen(*r, args));
  if (picked.size() == 1) return Value(NumericArray(picked[0]->values, picked[0]->unit));
  std::vector<double> rows(r->rows() * picked.size());
  for (std::size_t c = 0; c < picked.size(); ++c)
    for (std::size_t i = 0; i < r->rows(); ++i) rows[i * picked.size() + c] = picked[c]->values[i];
  return Value(NumericArray(std::move(rows), r->rows(), picked.size()));
}

/// The rows between the arguments `from` and `to`; the recording itself if neither is given.
Result<recording::RecordingPtr> between_times(recording::RecordingPtr r, const Map& args) {
  if (!has(args, "from") && !has(args, "to")) return r;
  const recording::Column* time = r->find("time");
  if (!time)
    return error(ErrorCode::invalid_argument, "the recording has no time", "Leave from and to out.",
                 has(args, "from") ? "from" : "to");
  const auto begin = time->values.begin(), end = time->values.end();
  const auto first = has(args, "from") ? std::lower_bound(begin, end, real(args, "from")) : begin;
  const auto last = has(args, "to") ? std::upper_bound(begin, end, real(args, "to")) : end;
  if (first >= last)
    return error(ErrorCode::invalid_argument, "the recording has no row between these times",
                 "Give times between " + text::print_rounded(time->values.front(), 6) + " and " +
                     text::print_rounded(time->values.back(), 6) + " s.",
                 has(args, "from") ? "from" : "to");
  recording::Recording part = *r;
  for (std::size_t c = 0; c < part.columns.size(); ++c) {
    const auto& all = r->columns[c].values;
    part.columns[c].values.assign(all.begin() + (first - begin), all.begin() + (last - begin));
  }
  return std::make_shared<const recording::Recording>(std::move(part));
}

Result<Value> csv(CommandContext& ctx, const Map& args) {
  const std::string file = text_of(args, "file");
  RMP_TRY_ASSIGN(auto r, between_times(recording_of(ctx, args), args));
  if (has(args, "columns")) {
    RMP_TRY_ASSIGN(const auto picked, chosen(*r, args));
    recording::Recording part;
    part.title = r->title;
    if (const recording::Column* time = r->find("time")) part.columns.push_back(*time);
    for (const recording::Column* c : picked)
      if (!part.find(c->name)) part.columns.push_back(*c);
    r = std::make_shared<const recording::Recording>(std::move(part));
  }
  RMP_TRY_ASSIGN(const std::string bytes, recording::to_csv(*r, ctx.progress));
  RMP_TRY(write_named_file(ctx, file, bytes));
  return Value(Map{{"file", file}, {"rows", r->rows()}, {"columns", r->columns.size()}});
}

Result<Value> plot(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const auto r, between_times(recording_of(ctx, args), args));
  recording::PlotRequest request;
  RMP_TRY_ASSIGN(auto others, recordings_in(ctx, args, "with"));
  for (recording::RecordingPtr& other : others) {
    RMP_TRY_ASSIGN(other, between_times(other, args));
  }
  request.recordings.push_back(r.get());
  for (const auto& other : others) request.recordings.push_back(other.get());
  if (has(args, "x")) request.x = text_of(args, "x");
  request.limits = flag(args, "limits");
  request.each_alone = text_of(args, "panels") == "column";
  const std::string log = text_of(args, "log");
  request.log_x = log == "x" || log == "xy";
  request.log_y = log == "y" || log == "xy";
  RMP_TRY_ASSIGN(Value answer, plot_answer(ctx, std::move(request), args));
  for (const char* name : {"id", "with"})
    if (const Value* given = args.find(name)) tell_stale(ctx, *given, "recording.plot");
  RMP_TRY(watch_drawing(ctx, "recording.plot", args));
  return answer;
}

Result<Value> heat_map(CommandContext& ctx, const Map& args) {
  const auto r = recording_of(ctx, args);
  recording::HeatMapRequest o;
  const auto word = [&](const char* name) {
    return has(args, name) ? text_of(args, name) : std::string();
  };
  const auto number = [&](const char* name) {
    return has(args, name) ? std::optional(real(args, name)) : std::nullopt;
  };
  o.column = word("column");
  o.x = word("x");
  o.y = word("y");
  o.title = word("title");
  o.at = number("at");
  o.low = number("low");
  o.high = number("high");
  o.is_log = flag(args, "log");
  if (const Value* given = args.find("curve"); given && !given->is_nil()) {
    const bool is_empty = given->as_list() && given->as_list()->empty();
    Value rows;
    if (!is_empty) {
      RMP_TRY_ASSIGN(rows, check_value(field("", "matrix", "", ""), *given, "curve"));
    }
    const NumericArray* points = rows.as_array();
    if (points && points->cols() == 2)
      for (std::size_t i = 0; i < points->rows(); ++i)
        o.curve.push_back({points->at(i, 0), points->at(i, 1)});
    else if (!is_empty)
      return error(ErrorCode::invalid_argument, "the curve is not a table of two columns",
                   "Give the field curve of robot.joint_slice.", "curve");
  }
  o.width = static_cast<int>(integer(args, "width"));
  o.height = static_cast<int>(integer(args, "height"));
  RMP_TRY_ASSIGN(const auto m, recording::heat_map(*r, o));
  const std::string file = text_of(args, "file");
  RMP_TRY_ASSIGN(const std::string bytes, recording::heat_map_file(m, file));
  RMP_TRY(write_named_file(ctx, file, bytes));
  Map out{{"file", file}, {"cells", m.cells}, {"low", m.low}, {"high", m.high}};
  if (m.at) out.set("at", *m.at);
  return Value(std::move(out));
}

Result<Value> summary(CommandContext& ctx, const Map& args) {
  const auto r = recording_of(ctx, args);
  const recording::Column* approach =
      flag(args, "approach") ? nullptr : r->find(recording::kApproachColumn);
  const double from =
      has(args, "from") ? real(args, "from") : -std::numeric_limits<double>::infinity();
  const double to = has(args, "to") ? real(args, "to") : std::numeric_limits<double>::infinity();
  const recording::Column* time = r->find("time");
  if (!time && (has(args, "from") || has(args, "to")))
    return error(ErrorCode::invalid_argument, "the recording has no column \"time\"",
                 "Leave out from and to.");
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < r->rows(); ++i) {
    const double t = time ? time->values[i] : 0;
    if ((approach && approach->values[i] != 0) || t < from || t > to) continue;
    rows.push_back(i);
  }
  List out;
  if (rows.empty()) return Value(std::move(out));
  std::vector<double> values(rows.size());
  for (const recording::Column& c : r->columns) {
    for (std::size_t i = 0; i < rows.size(); ++i) values[i] = c.values[rows[i]];
    const auto [low, high] = std::minmax_element(values.begin(), values.end());
    double squares = 0;
    for (const double v : values) squares += v * v;
    Map row{{"name", c.name},
            {"unit", c.unit},
            {"doc", c.doc},
            {"min", *low},
            {"max", *high},
            {"rms", std::sqrt(squares / static_cast<double>(values.size()))},
            {"first", values.front()},
            {"last", values.back()}};
    if (std::isfinite(c.lower)) row.set("lower", c.lower);
    if (std::isfinite(c.upper)) row.set("upper", c.upper);
    std::optional<std::size_t> nearest;
    double share = 0;
    for (std::size_t i = 0; i < values.size(); ++i)
      if (const double each = recording::limit_share(c.lower, c.upper, values[i]);
          !std::isnan(each) && (!nearest || each > share)) {
        nearest = i;
        share = each;
      }
    if (nearest) {
      row.set("share", share);
      row.set("at_share", values[*nearest]);
      if (time) row.set("at", time->values[rows[*nearest]]);
    }
    out.emplace_back(std::move(row));
  }
  return Value(std::move(out));
}

Result<Value> remove(CommandContext& ctx, const Map& args) {
  ctx.app.recordings.remove(args.find("id")->as_handle()->number);
  return Value();
}

std::string with_recording(const char* rest) {
  return with_arm(
             "local cell = world.create{name = \"cell\"}\ncell:add_robot{robot = arm, q = "
             "\"ready\"}\nlocal start = arm:fk{q = \"ready\"}\nlocal p, a = start.position, "
             "start.rpy\n"
             "trajectory.create{name = \"stroke\", sample_time = 0.05, segments = {{shape = "
             "\"line\", points = {\n"
             "  {p[1], p[2], p[3], a[1], a[2], a[3]}, {p[1], p[2] + 0.05, p[3], a[1], a[2], "
             "a[3]}}}}}\n"
             "cell:add_trajectory{trajectory = \"stroke\"}\nlocal run = "
             "cell:inverse_dynamics{robot = \"arm\", trajectory = \"stroke\"}\n") +
         rest;
}

}  // namespace

RMP_COMMANDS(recording_commands) {
  std::vector<CommandSpec> all;
  const ParamSpec picked = optional("columns", "any", "",
                                    "A name or a list of names; \"tau\" means tau1, tau2 and so "
                                    "on. All except the time if omitted.");
  all.push_back(
      {.name = "recording.list",
       .classic = "",
       .summary = "Lists the recordings of simulations and measurements.",
       .details = "Recordings exist until the program ends, outside the document.",
       .example = with_recording("assert(recording.list()[1].subject == cell)"),
       .params = {},
       .returns =
           {"list",
            "",
            "",
            {field("recording", "handle", "", "The recording."),
             field("title", "string", "", "Its content in a few words."),
             field("stale", "bool", "",
                   "Whether the records have changed since; recording.is_stale lists the changes."),
             field("subject", "handle", "",
                   "The world that it moves, or the robot of a recording without a world; absent "
                   "if there is none."),
             field("robot", "string", "", "The robot's name in the world."),
             field("trajectory", "string", "", "The trajectory's name in the world."),
             field("samples", "int", "", "Number of samples."),
             field("bytes", "int", "", "Memory of its values [bytes]."),
             field("share", "real", "",
                   "bytes divided by the machine's memory, 0 to 1; 0 if that is unknown.")}},
       .effect = Effect::reads,
       .run = list});
  all.push_back({.name = "recording.columns",
                 .classic = "",
                 .summary = "Lists the columns of a recording with units.",
                 .details = "",
                 .example = with_recording("assert(run:columns()[1].name == \"time\")"),
                 .params = {self("recording")},
                 .returns = {"list",
                             "",
                             "",
                             {field("name", "string", "", "Name of the column."),
                              field("unit", "string", "", "SI unit."),
                              field("doc", "string", "", "Description of the column.")}},
                 .effect = Effect::reads,
                 .run = columns});
  all.push_back({.name = "recording.notes",
                 .classic = "",
                 .summary = "Reports what happened while a recording was made, one sentence each.",
                 .details = "Such as limits reached and at which speed, torques that were cut, "
                            "when joints came to rest and moved again, steps of the integrator; "
                            "and changes since then of the records it was made from.",
                 .example = with_recording("assert(type(run:notes()) == \"table\")"),
                 .params = {self("recording")},
                 .returns = {"list", "", "Sentences.", {}},
                 .effect = Effect::reads,
                 .run = notes});
  all.push_back(
      {.name = "recording.values",
       .classic = "",
       .summary = "Returns the numbers of one or several columns.",
       .details = "",
       .example = with_recording("assert(#run:values(\"tau1\") == #run:values(\"time\"))"),
       .params = {self("recording"), picked},
       .returns = {"array",
                   "",
                   "One column as a vector; several as a matrix with one row per sample.",
                   {}},
       .effect = Effect::reads,
       .run = values});
  all.push_back(
      {.name = "recording.csv",
       .classic = "",
       .summary = "Writes a recording as comma-separated text with a header line.",
       .details = "",
       .example = with_recording("assert(run:csv(\"example.csv\").rows == #run:values(\"time\"))\n"
                                 "assert(run:csv{file = \"torques.csv\", columns = "
                                 "\"tau\"}.columns == 7)\n"
                                 "assert(run:csv{file = \"begin.csv\", to = 0.1}.rows == 3)"),
       .params = {self("recording"), needed("file", "path", "", "The file."),
                  optional(
                      "columns", "any", "",
                      "A name or a list of names; \"tau\" means tau1, tau2 and so on. The time "
                      "comes with them. All if omitted."),
                  optional("from", "real", "s", "First time; the beginning if omitted."),
                  optional("to", "real", "s", "Last time; the end if omitted.")},
       .returns = {"map",
                   "",
                   "",
                   {field("file", "string", "", "The file."),
                    field("rows", "int", "", "Number of lines after the header."),
                    field("columns", "int", "", "Columns.")}},
       .effect = Effect::files_write,
       .run = csv});
  all.push_back(
      {.name = "recording.overview",
       .classic = "",
       .summary = "Shows the contents of a recording on one screen: samples, columns, notes.",
       .details = "This is what the console prints for a recording.",
       .example = with_recording("assert(run:overview():find(\"q1 to q6 [rad]\", 1, true))"),
       .params = {self("recording")},
       .returns = {"string", "", "Markdown.", {}},
       .effect = Effect::reads,
       .run = overview});
  all.push_back(
      {.name = "recording.plot",
       .classic = "",
       .summary = "Draws columns against time or another column, or a path in space.",
       .details = "*.svg is written by the program itself, *.png and *.pdf through gnuplot; "
                  "without a file the plot is returned: in characters for the console, or in the "
                  "format set by `as`. Columns of one unit share a panel. Several recordings are "
                  "drawn over each other: one colour per column, line dashes by recording.",
       .example = with_recording(
           "run:plot{file = \"example.svg\", columns = {\"tau\"}}\n"
           "run:plot{file = \"limits.svg\", columns = {\"q1\", \"q2\"}, limits = true}\n"
           "run:plot{file = \"each.svg\", columns = {\"tau\"}, panels = \"column\"}\n"
           "run:plot{file = \"path.svg\", kind = \"path\"}\n"
           "run:compute(\"manipulability\")\n"
           "run:plot{file = \"decades.svg\", columns = \"manipulability\", log = \"y\"}\n"
           "assert(run:plot{columns = \"y\"}:find(\"time\"))\n"
           "assert(run:plot{columns = \"y\", as = \"svg\"}:find(\"<svg\"))"),
       .params = {self("recording"),
                  optional("file", "path", "",
                           "The picture, *.svg, *.png or *.pdf; text if omitted."),
                  picked,
                  choice("kind", {"curves", "path"},
                         "Columns over x, or the path of three columns in space (by default x, y, "
                         "z of the tool) with its projections."),
                  optional("x", "string", "",
                           "The column for the horizontal axis; otherwise time, or the first "
                           "column if there is no time."),
                  optional("with", "any", "", "Another recording or a list, drawn over this one."),
                  choice("panels", {"unit", "column"},
                         "One panel for all columns of a unit, or one panel with a separate scale "
                         "for every column, so that small values can be read beside large ones."),
                  choice("log", {"none", "x", "y", "xy"},
                         "Logarithmic axes. Samples of 0 and below cannot be drawn: a warning "
                         "counts them, and a column without any other sample is an error."),
                  defaulted("limits", "bool", "", false,
                            "Show limits of the values, such as joint limits, as bands beyond "
                            "them. Columns of different limits get a panel each."),
                  optional("title", "string", "", "Title; by default that of the recording."),
                  between(defaulted("width", "int", "", 900, "Pixels."), 100, 10000),
                  between(optional("height", "int", "",
                                   "Height in pixels; by default as the panels need."),
                          100, 10000),
                  watch_file_field(), plot_answer_field(),
                  optional("from", "real", "s", "First time; the beginning if omitted."),
                  optional("to", "real", "s", "Last time; the end if omitted.")},
       .returns = {"string", "", "The file, or the plot itself.", {}},
       .effect = Effect::reads,
       .sometimes = Effect::files_write | Effect::processes,
       .run = plot});
  all.push_back(
      {.name = "recording.heat_map",
       .classic = "",
       .summary = "Draws a section through voxels, or a joint slice, with a colour bar.",
       .details = "The colour scale is perceptually uniform. In slices, nodes in collision are "
                  "grey. *.svg is written by the program itself, *.png and *.pdf through gnuplot.",
       .example =
           "local arm = robot.get(\"twolink\")\n"
           "local s = arm:joint_slice{part = \"translation\", count = 20}\n"
           "assert(s.recording:heat_map{file = \"slice.svg\", curve = s.curve}.cells == 400)",
       .params =
           {self("recording"), needed("file", "path", "", "The picture, *.svg, *.png or *.pdf."),
            optional(
                "column", "string", "",
                "The value to draw; by default share, or manipulability if there is no share."),
            optional("x", "string", "",
                     "Column for the horizontal axis; the first one if omitted."),
            optional(
                "y", "string", "",
                "Column for the vertical axis; by default z for voxels, otherwise the second one."),
            optional("at", "real", "m",
                     "For voxels: position of the section along the third axis, 0 if omitted; the "
                     "nearest layer is drawn."),
            optional("low", "real", "", "Value of the lowest colour."),
            optional("high", "real", "", "Value of the highest colour."),
            defaulted("log", "bool", "", false, "Logarithmic colour scale."),
            optional("curve", "any", "", "Points to mark: curve of robot.joint_slice."),
            optional("title", "string", "", "Title; by default that of the recording."),
            between(defaulted("width", "int", "", 720, "Pixels."), 300, 10000),
            between(defaulted("height", "int", "", 560, "Pixels."), 200, 10000)},
       .returns = {"map",
                   "",
                   "",
                   {field("file", "string", "", "The picture."),
                    field("cells", "int", "", "Number of cells that have a value."),
                    field("low", "real", "", "Value of the lowest colour."),
                    field("high", "real", "", "Value of the highest colour."),
                    field("at", "real", "m", "For voxels: position of the drawn layer.")}},
       .effect = Effect::files_write,
       .sometimes = Effect::processes,
       .run = heat_map});
  all.push_back(
      {.name = "recording.summary",
       .classic = "",
       .summary = "Returns the least, greatest and root-mean-square value of every column.",
       .details = "Of columns with limits, such as joint limits, also how near to them the values "
                  "come.",
       .example = with_recording("assert(run:summary()[1].min == 0)\n"
                                 "local second = run:summary{from = 0.1, to = \"200 ms\"}[1]\n"
                                 "assert(second.min >= 0.1 and second.max <= 0.2)"),
       .params = {self("recording"),
                  defaulted("approach", "bool", "", true,
                            "Counts rows of moves that were put before the trajectory "
                            "or a part of it (those with 1 in the column approach)."),
                  optional("from", "real", "s", "Time of the first row that counts."),
                  optional("to", "real", "s", "Time of the last row that counts.")},
       .returns =
           {"list",
            "",
            "",
            {field("name", "string", "", "The column."),
             field("unit", "string", "", "Unit of the column."),
             field("doc", "string", "", "What the column is."),
             field("min", "real", "", "Least value."), field("max", "real", "", "Greatest value."),
             field("rms", "real", "", "Root mean square."),
             field("first", "real", "", "First value."), field("last", "real", "", "Last value."),
             field("lower", "real", "", "Lower limit, if there is one."),
             field("upper", "real", "", "Upper limit, if there is one."),
             field("share", "real", "",
                   "Largest distance from the middle of the limits, divided by half their range: "
                   "1 is at a limit."),
             field("at_share", "real", "", "The value that reaches it."),
             field("at", "real", "s", "Its time.")}},
       .effect = Effect::reads,
       .run = summary});
  all.push_back({.name = "recording.remove",
                 .classic = "",
                 .summary = "Deletes a recording.",
                 .details = "",
                 .example = with_recording("run:remove()\nassert(#recording.list() == 0)"),
                 .params = {self("recording")},
                 .returns = {},
                 .effect = Effect::simulates,
                 .run = remove});
  return all;
}

}  // namespace robomosp::ioci
