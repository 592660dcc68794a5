// SPDX-License-Identifier: Apache-2.0
// Commands that keep, complete and compare recordings.
#include <algorithm>
#include <cmath>
#include <filesystem>

#include "io/native.h"
#include "ioci/core/commands.h"
#include "ioci/core/loaded.h"
#include "ioci/core/origins.h"
#include "ioci/core/watchers.h"
#include "ioci/core/word_list.h"
#include "ioci/recording/given_columns.h"
#include "ioci/recording/recording_argument.h"
#include "ioci/simulation/tip_load_arguments.h"
#include "recording/compare.h"
#include "recording/file.h"
#include "sim/recording_columns.h"

namespace robomosp::ioci {
namespace {

constexpr std::size_t kMostBytes = std::size_t{4} << 30;

Result<Value> save(CommandContext& ctx, const Map& args) {
  const auto r = recording_of(ctx, args);
  const std::string file = text_of(args, "file");
  const std::string ending = std::filesystem::path(file).extension().string();
  std::string bytes;
  if (ending == ".rec") {
    const model::Record* world = ctx.snapshot().find(AnyId(r->world));
    RMP_TRY_ASSIGN(bytes, recording::to_text(*r, world ? world->name : "", ctx.progress));
  } else if (ending == ".csv") {
    RMP_TRY_ASSIGN(bytes, recording::to_csv(*r, ctx.progress));
  } else if (ending == ".json") {
    bytes = recording::to_json(*r);
  } else if (ending == ".npz") {
    RMP_TRY_ASSIGN(bytes, recording::to_npz(*r));
  } else {
    return error(ErrorCode::invalid_argument, "a recording cannot be saved as " + text::quote(file),
                 "Give a file name that ends with .rec, .csv, .json or .npz.");
  }
  RMP_TRY(write_named_file(ctx, file, bytes));
  return Value(Map{{"file", file}, {"rows", r->rows()}, {"columns", r->columns.size()}});
}

Result<Value> create(CommandContext& ctx, const Map& args) {
  recording::Recording r;
  r.title = text_of(args, "title");
  const List& columns = *args.find("columns")->as_list();
  for (std::size_t i = 0; i < columns.size(); ++i)
    RMP_TRY(add_columns(columns[i], "columns[" + std::to_string(i + 1) + "]", r));
  if (r.rows() == 0)
    return error(ErrorCode::invalid_argument, "there are no values",
                 "Give at least one column with at least one value.", "columns");
  if (const recording::Column* time = r.find("time"))
    for (std::size_t i = 1; i < time->values.size(); ++i)
      if (!(time->values[i] > time->values[i - 1]))
        return error(ErrorCode::invalid_argument,
                     "the time does not increase from row " + std::to_string(i) + " to row " +
                         std::to_string(i + 1),
                     "Sort the rows by time, or give the column another name.", "columns");
  RMP_TRY(give_robot(ctx, args, r));
  const std::uint64_t number =
      ctx.app.recordings.add(std::make_shared<const recording::Recording>(std::move(r)));
  ctx.app.origins->note_fixed(number, "it was made of given values");
  return Value(Handle{"recording", number});
}

Result<Value> load(CommandContext& ctx, const Map& args) {
  const std::filesystem::path file = text_of(args, "file");
  const bool is_plot = file.extension() == ".plot";
  const bool is_csv = file.extension() == ".csv" || is_plot;
  if (!is_csv && file.extension() != ".rec")
    return error(ErrorCode::invalid_argument,
                 "a recording cannot be loaded from " + text::quote(file.string()),
                 "Give a file that ends with .rec, .csv or .plot.");
  RMP_TRY_ASSIGN(const std::string bytes, io::read_file(file, kMostBytes));
  recording::Recording r;
  if (is_csv) {
    auto read = is_plot ? recording::recording_from_plot(bytes)
                        : recording::recording_from_csv(bytes, ctx.progress);
    if (!read.ok()) return std::move(read).error().in(file.filename().string());
    r = std::move(read).value();
    r.title = file.stem().string();
    RMP_TRY(give_robot(ctx, args, r));
  } else if (has(args, "robot") || has(args, "world")) {
    return error(ErrorCode::invalid_argument, "a *.rec contains its robot's name",
                 "Leave world and robot out.", "robot");
  } else {
    auto read = recording::recording_from_text(bytes, ctx.progress);
    if (!read.ok()) return std::move(read).error().in(file.filename().string());
    r = std::move(read->recording);
    if (const auto world = ctx.snapshot().find(Kind::world, read->world))
      r.world = WorldId{world->number};
  }
  const std::uint64_t number =
      ctx.app.recordings.add(std::make_shared<const recording::Recording>(std::move(r)));
  ctx.app.origins->note_fixed(number, "it was read from the file " + text::quote(file.string()));
  return Value(Handle{"recording", number});
}

/// What was added to a recording is added again when it is made again.
void note_step(CommandContext& ctx, const Map& args, const char* command) {
  Map given;
  for (const auto& [name, value] : args)
    if (const Value* as_given = ctx.given(name)) given.set(name, *as_given);
  ctx.app.origins->note_step(number_of(args), command, given);
  ctx.app.watchers->look(&ctx.session);
}

Result<Value> compute(CommandContext& ctx, const Map& args) {
  const auto r = recording_of(ctx, args);
  RMP_TRY_ASSIGN(const auto quantities, word_list(args, "quantities"));
  const sim::Simulator simulator{ctx.app.registry, ctx.app.derived, ctx.snapshot(),
                                 &ctx.app.collision_models};
  RMP_TRY_ASSIGN(const auto load, read_optional_load(ctx, args));
  RMP_TRY_ASSIGN(auto more, sim::with_quantities_of(simulator, *r, text_of(args, "robot"),
                                                    quantities, ctx.progress, load));
  List names;
  for (const recording::Column& c : more->columns)
    if (!r->find(c.name)) names.emplace_back(c.name);
  RMP_TRY(ctx.app.recordings.replace(number_of(args), r, std::move(more)));
  note_step(ctx, args, "recording.compute");
  return Value(std::move(names));
}

Result<Value> watch(CommandContext& ctx, const Map& args) {
  const std::string name = text_of(args, "name"), take = text_of(args, "take");
  const auto r = recording_of(ctx, args);
  RMP_TRY_ASSIGN(auto more, sim::with_watch(*r, name, text_of(args, "expression"),
                                            has(args, "unit") ? text_of(args, "unit") : "",
                                            take == "rate"       ? sim::Watch::rate
                                            : take == "integral" ? sim::Watch::integral
                                                                 : sim::Watch::value));
  const recording::Column& c = *more->find(name);
  Value out(NumericArray(c.values, c.unit));
  RMP_TRY(ctx.app.recordings.replace(number_of(args), r, std::move(more)));
  note_step(ctx, args, "recording.watch");
  return out;
}

Result<Value> compare(CommandContext& ctx, const Map& args) {
  const Value* with = args.find("with");
  const Handle* h = with ? with->as_handle() : nullptr;
  const auto other =
      h && h->kind == "recording" ? ctx.app.recordings.find(h->number) : recording::RecordingPtr{};
  if (!other)
    return error(ErrorCode::invalid_argument, (with ? with->text() : "nil") + " is not a recording",
                 "Give the recording to compare with.", "with");
  RMP_TRY_ASSIGN(const auto columns, word_list(args, "columns"));
  RMP_TRY_ASSIGN(const auto all, recording::compare(*recording_of(ctx, args), *other, columns));
  note_if_stale(ctx.app, ctx.snapshot(), number_of(args), "recording.compare");
  note_if_stale(ctx.app, ctx.snapshot(), h->number, "recording.compare");
  List out;
  for (const recording::ColumnDifference& d : all) {
    Map row{{"name", d.name}, {"unit", d.unit}, {"max", d.greatest},       {"at", d.at},
            {"rms", d.rms},   {"mean", d.mean}, {"deviation", d.deviation}};
    if (d.correlation) row.set("correlation", *d.correlation);
    row.set("samples", d.samples);
    out.emplace_back(std::move(row));
  }
  return Value(std::move(out));
}

std::string with_recorded_data(const char* rest) {
  return with_arm("local run = arm:simulate{q = \"ready\", duration = 0.2}\n") + rest;
}

}  // namespace

RMP_COMMANDS(recording_data_commands) {
  std::vector<CommandSpec> all;
  std::string quantities = "Quantities: ";
  for (const sim::RecordedQuantity& q : sim::recorded_quantities())
    quantities += (quantities.ends_with(": ") ? "" : "; ") + std::string(q.name) + " (" +
                  std::string(q.columns) + ") " + std::string(q.doc);
  all.push_back(
      {.name = "recording.save",
       .classic = "",
       .summary = "Saves a recording, or exports it for other programs.",
       .details = "*.rec is the program's own lossless text, *.csv a table with a header line, "
                  "*.json one object, *.npz an archive for numpy.load: an array for every column, "
                  "and columns, units, docs and title.",
       .example = with_recorded_data("run:save(\"example.rec\")\nrun:save(\"example.npz\")\n"
                                     "assert(run:save(\"example.json\").rows == 21)"),
       .params = {self("recording"),
                  needed("file", "path", "", "The file, *.rec, *.csv, *.json or *.npz.")},
       .returns = {"map",
                   "",
                   "",
                   {field("file", "string", "", "The file."), field("rows", "int", "", "Samples."),
                    field("columns", "int", "", "Columns.")}},
       .effect = Effect::files_write,
       .run = save});
  all.push_back(
      {.name = "recording.create",
       .classic = "",
       .summary = "Makes a recording from given values, for plots, tables and files.",
       .details =
           "Columns are {name =, values =, unit =, doc =}. Values are a list, an array or a matrix "
           "(its columns become name1, name2 and so on); all have the same number of rows. They "
           "are in the given unit, otherwise in that of the array, and are converted to SI; for a "
           "matrix, unit may be a list, such as \"rad, m, rad\". A column \"time\" must increase; "
           "without one the first column is the horizontal axis of plots.",
       .example = "local r = recording.create{title = \"drops\", columns = {\n"
                  "  {name = \"height\", unit = \"mm\", values = {100, 200, 400}},\n"
                  "  {name = \"duration\", unit = \"s\", values = {0.143, 0.202, 0.286}}}}\n"
                  "assert(math.abs(r:values(\"height\")[3] - 0.4) < 1e-12)\n"
                  "r:plot{file = \"drops.svg\", log = \"xy\"}\n"
                  "r:csv{file = \"drops.csv\"}",
       .params = {needed("columns", "list", "", "The columns, in order."),
                  defaulted("title", "string", "", std::string(), "Title of plots and files."),
                  robot_of_columns_field(), world_of_columns_field()},
       .returns = {"handle", "", "The recording.", {}},
       .effect = Effect::simulates,
       .run = create});
  all.push_back(
      {.name = "recording.load",
       .classic = "",
       .summary = "Loads a saved recording, or measured values from a table.",
       .details =
           "A *.rec is attached to the world of its name again if that is open. A *.csv has a "
           "header line of names with units, such as `time [s],q1 [deg]`; values are converted to "
           "SI, empty fields are missing values. A *.plot is a result of the program of 2006: "
           "torques, or positions, velocities and accelerations of the joints.",
       .example = with_recorded_data("run:save(\"example.rec\")\n"
                                     "local again = recording.load(\"example.rec\")\n"
                                     "assert(again:values(\"q2\")[21] == run:values(\"q2\")[21])"),
       .params = {needed("file", "path", "", "The file, *.rec, *.csv or *.plot."),
                  robot_of_columns_field(), world_of_columns_field()},
       .returns = {"handle", "", "The recording.", {}},
       .effect = Effect::files_read | Effect::simulates,
       .run = load});
  Schema compute_params{
      self("recording"), needed("quantities", "any", "", "A name or a list of names."),
      optional("robot", "string", "",
               "The robot, if the recording has several, as recordings of tasks do.")};
  for (ParamSpec& p : tip_load_fields("the path length of the tip since the first row"))
    compute_params.push_back(std::move(p));
  all.push_back(
      {.name = "recording.compute",
       .classic = "",
       .summary = "Adds columns that are computed from the recorded ones and the robot.",
       .details =
           quantities +
           ". The present robot is used; a message reports if it has changed since. Torques "
           "include the force in the columns wrench1 to wrench6 (world axes). tip_force, "
           "tip_moment or tip_wrench replace these columns; tip_force = {0, 0, 0} omits the force.",
       .example = with_recorded_data(
           "run:compute{\"power\", \"velocity\", \"limits\"}\n"
           "assert(run:values(\"speed\")[21] > 0)\n"
           "run:compute{quantities = \"torque\", tip_force = {0, 0, \"-20 N - 5 N/m * path\"}}\n"
           "assert(run:values(\"wrench3\")[1] == -20)"),
       .params = compute_params,
       .returns = {"list", "", "Names of the new columns.", {}},
       .effect = Effect::simulates,
       .run = compute});
  all.push_back(
      {.name = "recording.watch",
       .classic = "",
       .summary = "Adds a column computed by an expression over the others, and checks its unit.",
       .details = "The syntax is that of parameters: + - * / ^, functions, numbers with units.",
       .example = with_recorded_data(
           "run:watch{name = \"power1\", expression = \"tau1*qd1\", unit = \"W\"}\n"
           "local w = run:watch{name = \"turned\", expression = \"abs(qd2)\", take = "
           "\"integral\"}\n"
           "assert(w[21] > 0 and run:columns()[#run:columns()].unit == \"rad\")"),
       .params = {self("recording"), needed("name", "string", "", "Name of the column."),
                  needed("expression", "string", "", "The expression, such as tau1*qd1."),
                  optional("unit", "string", "", "SI unit of the result; derived if omitted."),
                  choice("take", {"value", "rate", "integral"},
                         "The value itself, its rate of change, or its integral over time.")},
       .returns = {"array", "", "The column.", {}},
       .effect = Effect::simulates,
       .run = watch});
  all.push_back(
      {.name = "recording.compare",
       .classic = "",
       .summary = "Reports the differences to another recording, column by column.",
       .details = "If the times differ, the other recording is interpolated linearly at the times "
                  "of this one, over the time that both cover. The correlation is Pearson's, as in "
                  "table 1 of the paper of 2006; a constant column has none.",
       .example = with_recorded_data(
           "local finer = arm:simulate{q = \"ready\", duration = 0.2, sample_time = 0.001}\n"
           "local d = run:compare{with = finer, columns = {\"q2\"}}[1]\n"
           "assert(d.max < 1e-9 and d.correlation > 0.999999)"),
       .params = {self("recording"), needed("with", "any", "", "The other recording."),
                  optional("columns", "any", "",
                           "A name or a list of names; \"tau\" means tau1, tau2 and so on. All "
                           "common columns if omitted.")},
       .returns = {"list",
                   "",
                   "",
                   {field("name", "string", "", "The column."),
                    field("unit", "string", "", "Unit of the column."),
                    field("max", "real", "", "Greatest absolute difference."),
                    field("at", "real", "s", "Its time; without time its row."),
                    field("rms", "real", "", "Root mean square of the difference."),
                    field("mean", "real", "", "Mean of the other minus this."),
                    field("deviation", "real", "", "Standard deviation of the difference."),
                    field("correlation", "real", "", "Correlation, -1 to 1."),
                    field("samples", "int", "", "Samples compared.")}},
       .effect = Effect::reads,
       .run = compare});
  return all;
}

}  // namespace robomosp::ioci
