// SPDX-License-Identifier: Apache-2.0
// Commands for what was measured: recordings that grow, parts of them, and residuals against a
// model.
#include <algorithm>
#include <cmath>

#include "ioci/core/commands.h"
#include "ioci/core/origins.h"
#include "ioci/core/word_list.h"
#include "ioci/recording/given_columns.h"
#include "ioci/recording/recording_argument.h"
#include "ioci/simulation/tip_load_arguments.h"
#include "recording/residual.h"
#include "sim/measured_motion.h"

namespace robomosp::ioci {
namespace {

Result<Value> append(CommandContext& ctx, const Map& args) {
  const std::uint64_t number = number_of(args);
  std::vector<std::string> names, units;
  {
    // Not longer than needed: the table grows in its place while nobody has it.
    const auto r = recording_of(ctx, args);
    for (const recording::Column& c : r->columns) names.push_back(c.name), units.push_back(c.unit);
  }
  recording::Recording given;
  const List& entries = *args.find("columns")->as_list();
  for (std::size_t i = 0; i < entries.size(); ++i)
    RMP_TRY(add_columns(entries[i], "columns[" + std::to_string(i + 1) + "]", given));
  if (given.rows() == 0)
    return error(ErrorCode::invalid_argument, "there are no rows to append",
                 "Give at least one value of every column.", "columns");
  std::vector<std::vector<double>> values(names.size());
  for (recording::Column& c : given.columns) {
    const auto at = std::find(names.begin(), names.end(), c.name);
    if (at == names.end()) return unknown_name("column", c.name, names).in("columns");
    const auto k = static_cast<std::size_t>(at - names.begin());
    if (c.unit != units[k])
      return error(ErrorCode::invalid_argument,
                   "column " + text::quote(c.name) + " is in " + text::quote(units[k]) +
                       " and the rows are in " + text::quote(c.unit),
                   "Name a unit of the same kind.", "columns");
    values[k] = std::move(c.values);
  }
  for (std::size_t k = 0; k < names.size(); ++k)
    if (values[k].empty())
      return error(ErrorCode::invalid_argument,
                   "the rows have no values of column " + text::quote(names[k]),
                   "Give all columns. Columns added by recording.compute and recording.watch are "
                   "for recordings that do not grow, such as a recording.part of this one.",
                   "columns");
  RMP_TRY_ASSIGN(const std::size_t rows, ctx.app.recordings.append(number, values));
  // What a command made is no longer what it would make.
  if (const OriginPtr origin = ctx.app.origins->find(number); !origin || origin->fixed.empty())
    ctx.app.origins->note_fixed(number, "rows were appended to it");
  return Value(Map{{"rows", rows}, {"appended", values.front().size()}});
}

Result<Value> part(CommandContext& ctx, const Map& args) {
  const auto r = recording_of(ctx, args);
  const recording::Column* const time = r->find("time");
  if (!time)
    return error(ErrorCode::invalid_argument, "the recording has no time",
                 "Parts are selected by time: it needs a column \"time\".");
  const auto index = [&](const char* name, bool is_end) {
    const auto& t = time->values;
    if (!has(args, name)) return is_end ? t.size() : std::size_t{0};
    const auto at = is_end ? std::upper_bound(t.begin(), t.end(), real(args, name))
                           : std::lower_bound(t.begin(), t.end(), real(args, name));
    return static_cast<std::size_t>(at - t.begin());
  };
  std::size_t first = index("from", false);
  const std::size_t end = index("to", true);
  if (has(args, "last")) {
    const double begin = time->values.empty() ? 0 : time->values.back() - real(args, "last");
    first = std::max(first, static_cast<std::size_t>(
                                std::lower_bound(time->values.begin(), time->values.end(), begin) -
                                time->values.begin()));
  }
  if (first >= end)
    return error(ErrorCode::invalid_argument,
                 time->values.empty() ? std::string("the recording has no rows")
                                      : "it has no rows in this time; they are from " +
                                            text::print_rounded(time->values.front()) + " s to " +
                                            text::print_rounded(time->values.back()) + " s",
                 "Give times within it.");
  recording::Recording out;
  out.title = r->title;
  out.world = r->world;
  out.robot = r->robot;
  out.trajectory = r->trajectory;
  out.dof = r->dof;
  out.base_moves = r->base_moves;
  out.loads = r->loads;
  out.notes = r->notes;
  for (const recording::Column& c : r->columns)
    out.columns.push_back(
        {c.name, c.unit, c.doc,
         std::vector<double>(c.values.begin() + static_cast<std::ptrdiff_t>(first),
                             c.values.begin() + static_cast<std::ptrdiff_t>(end)),
         c.lower, c.upper});
  return Value(
      Handle{"recording",
             ctx.app.recordings.add(std::make_shared<const recording::Recording>(std::move(out)))});
}

/// The recording of a residual and its statistics.
Value residual_answer(CommandContext& ctx, recording::Recording r, double shift) {
  List columns;
  for (const recording::ResidualStatistics& s : recording::residual_statistics(r))
    columns.emplace_back(Map{{"name", s.name},
                             {"unit", s.unit},
                             {"mean", s.mean},
                             {"rms", s.rms},
                             {"deviation", s.deviation},
                             {"max", s.greatest},
                             {"at", s.at},
                             {"samples", s.samples}});
  const std::size_t rows = r.rows();
  const std::uint64_t number =
      ctx.app.recordings.add(std::make_shared<const recording::Recording>(std::move(r)));
  return Value(Map{{"recording", Handle{"recording", number}},
                   {"columns", std::move(columns)},
                   {"shift", shift},
                   {"rows", rows}});
}

Result<Value> residual(CommandContext& ctx, const Map& args) {
  const auto measured = recording_of(ctx, args);
  const auto model = ctx.recording(*args.find("with")->as_handle());
  RMP_TRY_ASSIGN(const auto columns, word_list(args, "columns"));
  double shift = real(args, "shift");
  if (has(args, "find_shift")) {
    if (shift != 0)
      return error(ErrorCode::invalid_argument, "shift and find_shift are both given",
                   "Leave one out.", "find_shift");
    RMP_TRY_ASSIGN(shift, recording::best_shift(*measured, *model, columns,
                                                real(args, "find_shift"), ctx.progress));
  }
  RMP_TRY_ASSIGN(auto r, recording::residual(*measured, *model, columns, shift));
  return residual_answer(ctx, std::move(r), shift);
}

Result<Value> torque_residual(CommandContext& ctx, const Map& args) {
  const auto measured = recording_of(ctx, args);
  const sim::Simulator simulator{ctx.app.registry, ctx.app.derived, ctx.snapshot(),
                                 &ctx.app.collision_models};
  RMP_TRY_ASSIGN(const auto load, read_optional_load(ctx, args));
  RMP_TRY_ASSIGN(
      const auto model,
      sim::torques_of_motion(simulator, *measured, has(args, "window") ? real(args, "window") : 0,
                             ctx.progress, load));
  std::vector<std::string> torques;
  for (std::size_t k = 1; model->find("tau" + std::to_string(k)); ++k)
    torques.push_back("tau" + std::to_string(k));
  recording::Recording with_torques = *measured;
  if (const Value* given = args.find("torque_per_current"); given && !given->is_nil()) {
    const NumericArray& constants = *given->as_array();
    if (constants.size() != torques.size())
      return error(ErrorCode::invalid_argument,
                   "there are " + std::to_string(constants.size()) + " values for " +
                       std::to_string(torques.size()) + " joints",
                   "Give one for each joint.", "torque_per_current");
    for (std::size_t k = 0; k < torques.size(); ++k) {
      const std::string name = "current" + std::to_string(k + 1);
      const recording::Column* current = with_torques.find(name);
      if (!current)
        return error(ErrorCode::invalid_argument,
                     "the recording has no column " + text::quote(name),
                     "torque_per_current needs the currents current1, current2 and so on.",
                     "torque_per_current");
      recording::Column tau{torques[k], model->find(torques[k])->unit, "from the measured current",
                            current->values};
      for (double& v : tau.values) v *= constants[k];
      std::erase_if(with_torques.columns, [&](const auto& c) { return c.name == torques[k]; });
      with_torques.columns.push_back(std::move(tau));
    }
  }
  for (const std::string& name : torques)
    if (!with_torques.find(name))
      return error(ErrorCode::invalid_argument,
                   "the recording has no measured torque " + text::quote(name),
                   "It needs tau1, tau2 and so on, or currents and torque_per_current.");
  RMP_TRY_ASSIGN(auto r, recording::residual(with_torques, *model, torques));
  r.title = measured->title + ": measured torques minus those of the model";
  return residual_answer(ctx, std::move(r), 0);
}

std::string with_measured(const char* rest) {
  return with_arm(
             "local run = arm:simulate{q = \"ready\", duration = 0.2}\n"
             "local q = run:values(\"q\")\n"
             "local measured = recording.create{title = \"measured\", robot = \"arm\", columns = "
             "{\n"
             "  {name = \"time\", unit = \"s\", values = run:values(\"time\")},\n"
             "  {name = \"q\", unit = \"rad\", values = q}}}\n") +
         rest;
}

}  // namespace

RMP_COMMANDS(measured_recording_commands) {
  std::vector<CommandSpec> all;
  all.push_back(
      {.name = "recording.append",
       .classic = "",
       .summary = "Adds rows at the end of a recording, such as new measurements of a controller.",
       .details = "Columns are given as to recording.create, all that the recording has, in any "
                  "order; they are converted to SI. The time must increase, and either all rows "
                  "are added or none. The effort depends on the new rows only, not on the length "
                  "of the recording; a recording holds up to 268,435,456 numbers. Readers that "
                  "already have the recording keep the rows they have read. Recordings are outside "
                  "the document: undo does not remove rows, recording.part leaves some out.",
       .example = with_measured(
           "measured:append{columns = {{name = \"time\", unit = \"ms\", values = {210, 220}},\n"
           "  {name = \"q\", unit = \"deg\", values = {{1, 2, 3, 4, 5, 6}, {1, 2, 3, 4, 5, 6}}}}}\n"
           "assert(#measured:values(\"q1\") == 23)\n"
           "assert(math.abs(measured:values(\"q6\")[23] - math.rad(6)) < 1e-12)"),
       .params = {self("recording"),
                  needed("columns", "list", "",
                         "Columns with their values, such as {name =, values =, unit =}.")},
       .returns = {"map",
                   "",
                   "",
                   {field("rows", "int", "", "Number of rows it now has."),
                    field("appended", "int", "", "Number of new rows.")}},
       .effect = Effect::simulates,
       .run = append});
  all.push_back(
      {.name = "recording.part",
       .classic = "",
       .summary = "Copies the rows of a time interval from a recording.",
       .details = "For example the last seconds of a growing one.",
       .example = with_measured("assert(#measured:part{from = 0.1}:values(\"time\") == 11)\n"
                                "assert(measured:part{last = 0.05}:values(\"time\")[1] > 0.14)"),
       .params = {self("recording"),
                  optional("from", "real", "s", "The first time; the beginning if omitted."),
                  optional("to", "real", "s", "The last time; the end if omitted."),
                  above_zero(optional("last", "real", "s",
                                      "Length of the interval before the end, instead."))},
       .returns = {"handle", "", "The new recording.", {}},
       .effect = Effect::simulates,
       .run = part});
  const auto answer = [](const char* shift) {
    return ReturnSpec{
        "map",
        "",
        "",
        {field("recording", "handle", "",
               "Columns such as q_residual1 over the measured times, for plots and files."),
         field("columns", "list", "",
               "One table per column: name, unit, mean, rms (root mean square), deviation "
               "(standard deviation), max (greatest absolute value), at (its time) and samples."),
         field("shift", "real", "s", shift), field("rows", "int", "", "Rows of the recording.")}};
  };
  all.push_back(
      {.name = "recording.residual",
       .classic = "",
       .summary = "Returns the measured columns minus those of a model, over time.",
       .details = "Covers the time that both have; the model is interpolated linearly at the "
                  "measured times. Clocks of controllers start at other times: shift is the delay "
                  "of the model, find_shift searches for the shift with the best fit of both.",
       .example = with_measured(
           "local time = run:values(\"time\"):table()\n"
           "for i = 1, #time do time[i] = time[i] + 0.03 end\n"
           "local late = recording.create{columns = {\n"
           "  {name = \"time\", unit = \"s\", values = time},\n"
           "  {name = \"q\", unit = \"rad\", values = q}}}\n"
           "local fit = late:residual{with = run, columns = \"q\", find_shift = 0.1}\n"
           "assert(math.abs(fit.shift + 0.03) < 1e-4 and fit.columns[2].rms < 1e-4)\n"
           "fit.recording:plot{file = \"residual.svg\"}"),
       .params = {self("recording"), needed("with", "ref:recording", "", "The model's recording."),
                  optional("columns", "any", "",
                           "A name or a list of names; \"q\" means q1, q2 and so on. All common "
                           "columns if omitted."),
                  defaulted("shift", "real", "s", 0.0,
                            "Added to the measured times before the model is evaluated."),
                  above_zero(optional("find_shift", "real", "s",
                                      "Search for the shift within plus and minus this time."))},
       .returns = answer("The shift used."),
       .effect = Effect::simulates,
       .run = residual});
  Schema residual_params{
      self("recording"),
      above_zero(optional("window", "real", "s",
                          "Time window of the samples around each one that are fitted together; at "
                          "most 1000 samples.")),
      optional("torque_per_current", "real[]", "",
               "Torque constant of each joint in N m/A (N/A for a prismatic one): torques are then "
               "computed from the columns current1, current2 and so on, in A.")};
  for (ParamSpec& p : tip_load_fields("the path length of the tip since the first row"))
    residual_params.push_back(std::move(p));
  all.push_back(
      {.name = "recording.torque_residual",
       .classic = "",
       .summary =
           "Returns the measured torques minus those that the model needs for the measured motion.",
       .details = "Inverse dynamics of the recording's robot at the measured q1, q2 and so on, "
                  "with the measured velocities and accelerations, or with derivatives if these "
                  "were not measured. Noise grows with each derivative: window fits parabolas to "
                  "the samples within it. A force at a tip is taken from the columns wrench1 to "
                  "wrench6 or from the arguments. The residual is friction, payload or inertia "
                  "that the model does not include, or a contact.",
       .example = with_measured(
           "run:compute(\"torque\")\n"
           "local torques = recording.create{robot = \"arm\", columns = {\n"
           "  {name = \"time\", unit = \"s\", values = run:values(\"time\")},\n"
           "  {name = \"q\", unit = \"rad\", values = q},\n"
           "  {name = \"qd\", unit = \"rad/s\", values = run:values(\"qd\")},\n"
           "  {name = \"qdd\", unit = \"rad/s^2\", values = run:values(\"qdd\")},\n"
           "  {name = \"tau\", unit = \"N m\", values = run:values(\"tau\")}}}\n"
           "local r = torques:torque_residual()\n"
           "assert(r.columns[1].name == \"tau_residual1\" and r.columns[1].max < 1e-9)"),
       .params = residual_params,
       .returns = answer("0."),
       .effect = Effect::simulates,
       .run = torque_residual});
  return all;
}

}  // namespace robomosp::ioci
