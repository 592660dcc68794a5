// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "io/native.h"
#include "ioci/core/commands.h"
#include "ioci/core/word_list.h"
#include "ioci/recording/plot_answer.h"
#include "recording/file.h"
#include "recording/plot/heat_map.h"
#include "recording/recording.h"

namespace robomosp::ioci {
namespace {

recording::RecordingPtr recording_of(CommandContext& ctx, const Map& args) {
  return ctx.recording(*args.find("id")->as_handle());
}

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
      return error(ErrorCode::invalid_argument, v.text() + " is no recording",
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

Result<Value> list(CommandContext& ctx, const Map&) {
  List out;
  for (const auto& [number, r] : ctx.app.recordings.list())
    out.emplace_back(Map{{"recording", Handle{"recording", number}},
                         {"title", r->title},
                         {"robot", r->robot},
                         {"trajectory", r->trajectory},
                         {"samples", r->rows()}});
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

Result<Value> csv(CommandContext& ctx, const Map& args) {
  const std::string file = text_of(args, "file");
  const auto r = recording_of(ctx, args);
  RMP_TRY_ASSIGN(const std::string bytes, recording::to_csv(*r, ctx.progress));
  RMP_TRY(io::write_file(file, bytes));
  return Value(Map{{"file", file}, {"rows", r->rows()}, {"columns", r->columns.size()}});
}

Result<Value> plot(CommandContext& ctx, const Map& args) {
  const auto r = recording_of(ctx, args);
  recording::PlotRequest request;
  RMP_TRY_ASSIGN(const auto others, recordings_in(ctx, args, "with"));
  request.recordings.push_back(r.get());
  for (const auto& other : others) request.recordings.push_back(other.get());
  if (has(args, "x")) request.x = text_of(args, "x");
  request.limits = flag(args, "limits");
  return plot_answer(std::move(request), args);
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
    const NumericArray* points = given->as_array();
    if (points && points->cols() == 2)
      for (std::size_t i = 0; i < points->rows(); ++i)
        o.curve.push_back({points->at(i, 0), points->at(i, 1)});
    else if (!given->as_list() || !given->as_list()->empty())
      return error(ErrorCode::invalid_argument, "the curve is no table of two columns",
                   "Give the field curve of robot.joint_slice.", "curve");
  }
  o.width = static_cast<int>(integer(args, "width"));
  o.height = static_cast<int>(integer(args, "height"));
  RMP_TRY_ASSIGN(const auto m, recording::heat_map(*r, o));
  const std::string file = text_of(args, "file");
  RMP_TRY_ASSIGN(const std::string bytes, recording::heat_map_file(m, file));
  RMP_TRY(io::write_file(file, bytes));
  Map out{{"file", file}, {"cells", m.cells}, {"low", m.low}, {"high", m.high}};
  if (m.at) out.set("at", *m.at);
  return Value(std::move(out));
}

Result<Value> summary(CommandContext& ctx, const Map& args) {
  const auto r = recording_of(ctx, args);
  const recording::Column* approach =
      flag(args, "approach") ? nullptr : r->find(recording::kApproachColumn);
  List out;
  std::vector<double> values;
  for (const recording::Column& c : r->columns) {
    values.clear();
    for (std::size_t i = 0; i < c.values.size(); ++i)
      if (!approach || approach->values[i] == 0) values.push_back(c.values[i]);
    if (values.empty()) continue;
    const auto [low, high] = std::minmax_element(values.begin(), values.end());
    double squares = 0;
    for (const double v : values) squares += v * v;
    out.emplace_back(Map{{"name", c.name},
                         {"unit", c.unit},
                         {"min", *low},
                         {"max", *high},
                         {"rms", std::sqrt(squares / static_cast<double>(values.size()))},
                         {"first", values.front()},
                         {"last", values.back()}});
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
                                    "on. All but the time when left out.");
  all.push_back(
      {.name = "recording.list",
       .classic = "",
       .summary = "Lists what simulations have recorded.",
       .details = "Recordings live as long as the program runs, outside the document.",
       .example = with_recording("assert(#recording.list() == 1)"),
       .params = {},
       .returns = {"list",
                   "",
                   "",
                   {field("recording", "handle", "", "The recording."),
                    field("title", "string", "", "What it shows."),
                    field("robot", "string", "", "The robot's name in the world."),
                    field("trajectory", "string", "", "The trajectory's name in the world."),
                    field("samples", "int", "", "Number of samples.")}},
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
                              field("doc", "string", "", "What it holds.")}},
                 .effect = Effect::reads,
                 .run = columns});
  all.push_back({.name = "recording.notes",
                 .classic = "",
                 .summary = "Reports what happened while a recording was made, a sentence each.",
                 .details = "Such as limits met and with which speed, torques that were cut, when "
                            "joints came to rest and went on, steps of the integrator.",
                 .example = with_recording("assert(type(run:notes()) == \"table\")"),
                 .params = {self("recording")},
                 .returns = {"list", "", "Sentences.", {}},
                 .effect = Effect::reads,
                 .run = notes});
  all.push_back(
      {.name = "recording.values",
       .classic = "",
       .summary = "Gives the numbers of one or several columns.",
       .details = "",
       .example = with_recording("assert(#run:values(\"tau1\") == #run:values(\"time\"))"),
       .params = {self("recording"), picked},
       .returns =
           {"array", "", "One column as a vector; several as a matrix with one row a sample.", {}},
       .effect = Effect::reads,
       .run = values});
  all.push_back(
      {.name = "recording.csv",
       .classic = "",
       .summary = "Writes a recording as comma-separated text with a header line.",
       .details = "",
       .example = with_recording("assert(run:csv(\"example.csv\").rows == #run:values(\"time\"))"),
       .params = {self("recording"), needed("file", "path", "", "The file.")},
       .returns = {"map",
                   "",
                   "",
                   {field("file", "string", "", "The file."),
                    field("rows", "int", "", "Lines after the header."),
                    field("columns", "int", "", "Columns.")}},
       .effect = Effect::files_write,
       .run = csv});
  all.push_back(
      {.name = "recording.plot",
       .classic = "",
       .summary = "Draws columns against time or another column, or a path in space.",
       .details =
           "*.svg is written by the program itself, *.png and *.pdf through gnuplot; without a "
           "file the plot is returned in characters, for the console. Columns of one unit share a "
           "panel. Several recordings are drawn over each other: one colour a column, dashed by "
           "recording.",
       .example = with_recording(
           "run:plot{file = \"example.svg\", columns = {\"tau\"}}\n"
           "run:plot{file = \"limits.svg\", columns = {\"q1\", \"q2\"}, limits = true}\n"
           "run:plot{file = \"path.svg\", kind = \"path\"}\n"
           "assert(run:plot{columns = \"y\"}:find(\"time\"))"),
       .params = {self("recording"),
                  optional("file", "path", "",
                           "The picture, *.svg, *.png or *.pdf; as text when left out."),
                  picked,
                  choice("kind", {"curves", "path"},
                         "Columns over x, or the path of three columns in space (x, y, z of the "
                         "tool when left out) with its projections."),
                  optional("x", "string", "",
                           "The column along the horizontal axis; else time, or the first column "
                           "where there is none."),
                  optional("with", "any", "", "Another recording or a list, drawn over this one."),
                  defaulted("limits", "bool", "", false,
                            "Show what the values should stay within, such as joint limits: bands "
                            "of what is beyond. Columns of different limits get a panel each."),
                  optional("title", "string", "", "Title; that of the recording when left out."),
                  between(defaulted("width", "int", "", 900, "Pixels."), 100, 10000),
                  between(optional("height", "int", "", "Pixels; what the panels need."), 100,
                          10000)},
       .returns = {"string", "", "The file, or the plot as text.", {}},
       .effect = Effect::reads,
       .sometimes = Effect::files_write | Effect::processes,
       .run = plot});
  all.push_back(
      {.name = "recording.heat_map",
       .classic = "",
       .summary = "Draws a section through voxels, or a joint slice, with a colour bar.",
       .details = "The colours are equally far apart to the eye. Of slices, nodes in collision are "
                  "grey. *.svg is written by the program itself, *.png and *.pdf through gnuplot.",
       .example =
           "local arm = robot.get(\"twolink\")\n"
           "local s = arm:joint_slice{part = \"translation\", count = 20}\n"
           "assert(s.recording:heat_map{file = \"slice.svg\", curve = s.curve}.cells == 400)",
       .params = {self("recording"),
                  needed("file", "path", "", "The picture, *.svg, *.png or *.pdf."),
                  optional("column", "string", "",
                           "The value; share, else manipulability when left out."),
                  optional("x", "string", "", "Column along the horizontal axis; the first one."),
                  optional("y", "string", "",
                           "Column along the vertical axis; of voxels z, else the second one."),
                  optional("at", "real", "m",
                           "Of voxels: place of the section along the third axis, 0 when left out; "
                           "the nearest layer is taken."),
                  optional("low", "real", "", "Value of the lowest colour."),
                  optional("high", "real", "", "Value of the highest colour."),
                  defaulted("log", "bool", "", false, "Colours by powers of ten."),
                  optional("curve", "any", "", "Points to mark: curve of robot.joint_slice."),
                  optional("title", "string", "", "Title; that of the recording when left out."),
                  between(defaulted("width", "int", "", 720, "Pixels."), 300, 10000),
                  between(defaulted("height", "int", "", 560, "Pixels."), 200, 10000)},
       .returns = {"map",
                   "",
                   "",
                   {field("file", "string", "", "The picture."),
                    field("cells", "int", "", "That have a value."),
                    field("low", "real", "", "Value of the lowest colour."),
                    field("high", "real", "", "Value of the highest colour."),
                    field("at", "real", "m", "Of voxels: the layer that is shown.")}},
       .effect = Effect::files_write,
       .sometimes = Effect::processes,
       .run = heat_map});
  all.push_back({.name = "recording.summary",
                 .classic = "",
                 .summary = "Gives least, greatest and root-mean-square value of every column.",
                 .details = "",
                 .example = with_recording("assert(run:summary()[1].min == 0)"),
                 .params = {self("recording"),
                            defaulted("approach", "bool", "", true,
                                      "Counts rows of moves that were put before the trajectory "
                                      "or a part of it (those with 1 in the column approach).")},
                 .returns = {"list",
                             "",
                             "",
                             {field("name", "string", "", "The column."),
                              field("unit", "string", "", "Its unit."),
                              field("min", "real", "", "Least value."),
                              field("max", "real", "", "Greatest value."),
                              field("rms", "real", "", "Root mean square."),
                              field("first", "real", "", "First value."),
                              field("last", "real", "", "Last value.")}},
                 .effect = Effect::reads,
                 .run = summary});
  all.push_back({.name = "recording.remove",
                 .classic = "",
                 .summary = "Forgets a recording.",
                 .details = "",
                 .example = with_recording("run:remove()\nassert(#recording.list() == 0)"),
                 .params = {self("recording")},
                 .returns = {},
                 .effect = Effect::simulates,
                 .run = remove});
  return all;
}

}  // namespace robomosp::ioci
