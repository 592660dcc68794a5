// SPDX-License-Identifier: Apache-2.0
// Programs in live runs: breakpoints, steps, variables, and back over what is recorded.
#include "ioci/simulation/program_debugging.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "ioci/core/commands.h"
#include "ioci/program/in_world.h"
#include "ioci/simulation/run_pulse.h"
#include "ioci/simulation/task_run.h"

namespace robomosp::ioci {

using program::Machine;

namespace debugging {

LiveRunPtr run_of(CommandContext& ctx, const Map& args) {
  const Handle& h = *args.find("id")->as_handle();
  LiveRunPtr found = ctx.app.runs->find(h.number);
  if (!found) throw StaleHandle{h};
  return found;
}

Result<std::shared_ptr<task::ProgramWatch>> watch_of(const LiveRunEntry& entry) {
  if (auto watch = entry.watch()) return watch;
  return error(
      ErrorCode::unsupported, "run " + text::quote(entry.title) + " has no programs",
      "Start one of a world with programs: cell:start_run(\"tasks\"). With solvers written "
      "in Lua a run is computed whole, without a debugger.");
}

Result<std::size_t> program_at(const task::ProgramWatch& watch, const Map& args) {
  std::vector<std::string> known;
  for (std::size_t i = 0; i < watch.programs.size(); ++i) {
    known.push_back(watch.programs[i].name());
    if (has(args, "program") && known.back() == text_of(args, "program")) return i;
  }
  if (has(args, "program")) return unknown_name("program", text_of(args, "program"), known);
  if (watch.is_stopped) return watch.stopped_at;
  if (watch.programs.size() == 1) return std::size_t{0};
  return error(ErrorCode::invalid_argument,
               "the run has " + std::to_string(known.size()) + " programs",
               known.empty() ? "It has not started."
                             : "Give program, one of " + text::enumerate(known) + ".",
               "program");
}

std::uint32_t process_of(const Machine& machine, const Map& args) {
  if (has(args, "process")) return static_cast<std::uint32_t>(integer(args, "process"));
  const program::Status& s = machine.status();
  return s.state == program::RunState::stopped && s.stop ? s.stop->process : 0;
}

std::string file_of(const Machine& machine, const rmp_span& s) {
  const rmp_code& c = machine.code();
  return s.file < c.files.count ? static_cast<const rmp_code_file*>(rmp_row(&c.files, s.file))->name
                                : std::string();
}

std::size_t row_shown(const task::ProgramWatch& watch, const LiveRunEntry& entry) {
  const double time = entry.run->shown().time;
  const double tolerance = 1e-9 * std::max(1.0, time);
  if (const auto& c = watch.chosen;
      c && c->rows == watch.rows.size() && std::fabs(c->shown - time) <= tolerance)
    return c->row;
  if (watch.rows.empty() || time >= watch.rows.back().time - tolerance) return watch.rows.size();
  auto after = std::upper_bound(watch.rows.begin(), watch.rows.end(), time + tolerance,
                                [](double t, const auto& row) { return t < row.time; });
  if (after != watch.rows.begin()) --after;
  return static_cast<std::size_t>(after - watch.rows.begin());
}

const Machine& machine_at(const task::ProgramWatch& watch, std::size_t row, std::size_t program) {
  if (row < watch.rows.size() && program < watch.rows[row].machines.size())
    return watch.rows[row].machines[program];
  return watch.programs[program].machine();
}

Result<Looked> looked_at(const task::ProgramWatch& watch, const LiveRunEntry& entry,
                         const Map& args) {
  Looked out;
  RMP_TRY_ASSIGN(out.program, program_at(watch, args));
  const std::size_t row = row_shown(watch, entry);
  out.machine = &machine_at(watch, row, out.program);
  out.is_now = row >= watch.rows.size();
  return out;
}

Map place(const task::ProgramWatch& watch, const LiveRunEntry& entry) {
  const sim::LiveRun::Shown shown = entry.run->shown();
  const std::size_t row = row_shown(watch, entry);
  const bool is_now = row >= watch.rows.size();
  const bool is_stopped = is_now ? watch.is_stopped : watch.rows[row].is_stopped;
  const std::size_t stopped_at = is_now ? watch.stopped_at : watch.rows[row].stopped_at;
  Map out{{"time", shown.time},
          {"is_stopped", is_stopped && !(is_now && shown.is_complete)},
          {"is_complete", shown.is_complete},
          {"is_past", !is_now}};
  if (shown.failure) out.set("error", shown.failure->sentence());
  if (shown.failure && is_now)
    for (const task::ProgramActor& p : watch.programs)
      if (const auto& fault = p.machine().status().fault) {
        out.set("program", p.name());
        out.set("reason", "fault");
        out.set("process", static_cast<std::int64_t>(fault->process));
        out.set("file", fault->file);
        out.set("line", static_cast<std::int64_t>(fault->span.line));
        out.set("column", static_cast<std::int64_t>(fault->span.column));
        out.set("message", fault->message + (fault->hint.empty() ? "." : ". " + fault->hint));
        return out;
      }
  if (!is_stopped || stopped_at >= watch.programs.size()) return out;
  const Machine& machine = machine_at(watch, row, stopped_at);
  const auto& stop = machine.status().stop;
  if (!stop) {
    // It asks: PAUSE, or READ.
    for (const program::Wait& w : machine.status().waits) {
      const bool is_pause = w.kind == program::WaitKind::pause;
      if (!is_pause && w.kind != program::WaitKind::line) continue;
      out.set("program", watch.programs[stopped_at].name());
      out.set("reason", is_pause ? "pause" : "input");
      out.set("process", static_cast<std::int64_t>(w.process));
      out.set("file", file_of(machine, w.span));
      out.set("line", static_cast<std::int64_t>(w.span.line));
      out.set("column", static_cast<std::int64_t>(w.span.column));
      if (is_pause) out.set("message", w.message);
      break;
    }
    return out;
  }
  static constexpr const char* kReasons[] = {"breakpoint", "step", "motion", "pause", "entry"};
  out.set("program", watch.programs[stopped_at].name());
  out.set("reason", kReasons[static_cast<std::size_t>(stop->reason)]);
  out.set("process", static_cast<std::int64_t>(stop->process));
  out.set("file", file_of(machine, stop->span));
  out.set("line", static_cast<std::int64_t>(stop->span.line));
  out.set("column", static_cast<std::int64_t>(stop->span.column));
  if (stop->reason == program::StopReason::breakpoint) {
    const std::lock_guard lock(entry.breakpoints->mutex);
    const auto& numbers = entry.breakpoints->numbers;
    const auto found = numbers.find({watch.programs[stopped_at].name(), stop->breakpoint});
    if (found != numbers.end()) out.set("breakpoint", found->second);
    if (!stop->message.empty()) out.set("message", stop->message);
  }
  return out;
}

}  // namespace debugging

namespace {

using namespace debugging;

Map breakpoint_map(const Breakpoints::One& b, std::uint64_t hits) {
  return Map{{"number", b.number},
             {"program", b.program},
             {"source", b.what.file},
             {"line", static_cast<std::int64_t>(b.what.line)},
             {"column", static_cast<std::int64_t>(b.what.column)},
             {"routine", b.what.routine},
             {"condition", b.what.condition},
             {"ignore", static_cast<std::int64_t>(b.what.ignore)},
             {"log", b.what.log},
             {"hits", static_cast<std::int64_t>(hits)}};
}

/// "5" and "= 5" is the fifth hit, ">= 3" from the third on, "< 3", "% 2" every second one.
Result<void> read_hits(const std::string& given, program::Breakpoint& b) {
  std::string_view rest = text::trim(given);
  std::string op;
  while (!rest.empty() && std::string_view("<>=%").find(rest.front()) != std::string_view::npos) {
    op += rest.front();
    rest.remove_prefix(1);
  }
  rest = text::trim(rest);
  std::uint64_t n = 0;
  bool is_number = !rest.empty() && rest.size() < 16;
  for (const char c : rest) {
    is_number = is_number && c >= '0' && c <= '9';
    if (is_number) n = n * 10 + static_cast<std::uint64_t>(c - '0');
  }
  const auto wrong = [&] {
    return error(ErrorCode::invalid_argument, text::quote(given) + " does not define which hits",
                 "Write a number of at least 1, alone or after =, <, <=, >, >= or %.", "hits");
  };
  if (!is_number || n == 0) return wrong();
  if (op.empty() || op == "=" || op == "==") b.ignore = n - 1, b.until = n;
  else if (op == ">=") b.ignore = n - 1;
  else if (op == ">") b.ignore = n;
  else if (op == "<=") b.until = n;
  else if (op == "<" && n > 1) b.until = n - 1;
  else if (op == "%") b.every = n;
  else return wrong();
  return {};
}

Result<Value> set_breakpoint(CommandContext& ctx, const Map& args) {
  const LiveRunPtr entry = run_of(ctx, args);
  RMP_TRY_ASSIGN(const auto watch, watch_of(*entry));
  const std::lock_guard lock(watch->mutex);
  RMP_TRY_ASSIGN(const std::size_t at, program_at(*watch, args));
  Breakpoints::One one;
  one.program = watch->programs[at].name();
  one.what.file = text_of(args, "source");
  one.what.routine = text_of(args, "routine");
  if (has(args, "line") == has(args, "routine"))
    return error(ErrorCode::invalid_argument, "a breakpoint must be at a line or at a routine",
                 "Give line, or routine.", "line");
  if (has(args, "line")) one.what.line = static_cast<std::uint32_t>(integer(args, "line"));
  one.what.log = text_of(args, "log");
  one.what.condition = text_of(args, "condition");
  one.what.ignore = static_cast<std::uint64_t>(integer(args, "ignore"));
  if (has(args, "hits")) RMP_TRY(read_hits(text_of(args, "hits"), one.what));
  auto made = watch->programs[at].machine().set_breakpoint(one.what);
  if (!made.ok()) return named_once(std::move(made).error(), "program " + text::quote(one.program));
  one.own = made->number;
  one.what.line = made->line;
  one.what.file = made->file;
  one.what.column = made->column;
  const std::lock_guard own(entry->breakpoints->mutex);
  one.number = entry->breakpoints->next++;
  entry->breakpoints->all.emplace(one.number, one);
  entry->breakpoints->numbers[{one.program, one.own}] = one.number;
  return Value(breakpoint_map(one, 0));
}

Result<Value> clear_breakpoint(CommandContext& ctx, const Map& args) {
  const LiveRunPtr entry = run_of(ctx, args);
  RMP_TRY_ASSIGN(const auto watch, watch_of(*entry));
  const std::int64_t number = integer(args, "number");
  const std::lock_guard lock(watch->mutex);
  const std::lock_guard own(entry->breakpoints->mutex);
  auto& all = entry->breakpoints->all;
  const auto it = all.find(number);
  if (it == all.end())
    return error(ErrorCode::not_found, "the run has no breakpoint " + std::to_string(number),
                 "run.breakpoints lists them.", "number");
  for (task::ProgramActor& p : watch->programs)
    if (p.name() == it->second.program) p.machine().remove_breakpoint(it->second.own);
  entry->breakpoints->numbers.erase({it->second.program, it->second.own});
  all.erase(it);
  return Value();
}

Result<Value> breakpoints(CommandContext& ctx, const Map& args) {
  const LiveRunPtr entry = run_of(ctx, args);
  RMP_TRY_ASSIGN(const auto watch, watch_of(*entry));
  const std::lock_guard lock(watch->mutex);
  const std::lock_guard own(entry->breakpoints->mutex);
  std::map<std::pair<std::string, std::uint32_t>, std::uint64_t> hits;
  for (const task::ProgramActor& p : watch->programs)
    for (const program::Breakpoint& x : p.machine().breakpoints())
      if (x.hits > 0) hits[{p.name(), x.number}] = x.hits;
  List out;
  for (const auto& [n, b] : entry->breakpoints->all) {
    const auto counted = hits.find({b.program, b.own});
    out.emplace_back(breakpoint_map(b, counted == hits.end() ? 0 : counted->second));
  }
  return Value(std::move(out));
}

Result<Value> go_on(CommandContext& ctx, const Map& args, std::optional<program::StepKind> kind) {
  const LiveRunPtr entry = run_of(ctx, args);
  RMP_TRY_ASSIGN(const auto watch, watch_of(*entry));
  if (kind) {
    const std::lock_guard lock(watch->mutex);
    RMP_TRY_ASSIGN(const std::size_t at, program_at(*watch, args));
    Machine& machine = watch->programs[at].machine();
    machine.step(*kind, process_of(machine, args));
  }
  if (has(args, "speed")) {
    RMP_TRY_ASSIGN(const double speed, speed_of(*args.find("speed")));
    if (speed < 0)
      return error(ErrorCode::invalid_argument, "a program cannot run backwards",
                   "Use run.step_recorded to step back through the recording.", "speed");
    Map from;
    {
      const std::lock_guard lock(watch->mutex);
      watch->chosen.reset();
      from = place(*watch, *entry);
    }
    // From here on its thread may hold the lock for as long as a program computes.
    entry->run->play(speed);
    ctx.app.kept<RunPulse>().wake();
    return Value(std::move(from));
  }
  auto done = entry->run->finish(ctx.progress);
  if (!done.ok()) return std::move(done).error().in("run " + text::quote(entry->title));
  const std::lock_guard lock(watch->mutex);
  return Value(place(*watch, *entry));
}
Result<Value> continue_run(CommandContext& ctx, const Map& args) {
  return go_on(ctx, args, std::nullopt);
}
template <program::StepKind kind>
Result<Value> step_program(CommandContext& ctx, const Map& args) {
  return go_on(ctx, args, kind);
}

Result<Value> stack(CommandContext& ctx, const Map& args) {
  const LiveRunPtr entry = run_of(ctx, args);
  RMP_TRY_ASSIGN(const auto watch, watch_of(*entry));
  const std::lock_guard lock(watch->mutex);
  RMP_TRY_ASSIGN(const Looked at, looked_at(*watch, *entry, args));
  List out;
  for (const program::CallPlace& c : at.machine->call_stack(process_of(*at.machine, args)))
    out.emplace_back(Map{{"routine", c.name},
                         {"file", file_of(*at.machine, c.span)},
                         {"line", static_cast<std::int64_t>(c.span.line)},
                         {"column", static_cast<std::int64_t>(c.span.column)}});
  return Value(std::move(out));
}

/// As deep as Machine was told to cut it.
Map variable_map(const program::Variable& v) {
  Map out{{"name", v.name}, {"type", v.type}, {"value", v.value}};
  if (v.part_count > 0) out.set("is_indexed", v.is_indexed);
  if (v.part_count > 0) {
    List parts;
    for (const program::Variable& p : v.parts) parts.emplace_back(variable_map(p));
    out.set("parts", std::move(parts));
    out.set("part_count", static_cast<std::int64_t>(v.part_count));
  }
  return out;
}

Result<std::uint32_t> frame_of(const Machine& machine, std::uint32_t process, const Map& args) {
  const std::int64_t frame = integer(args, "frame");
  if (frame == 0) return Machine::kNoFrame;
  const auto calls = machine.call_stack(process);
  if (frame >= 1 && frame <= static_cast<std::int64_t>(calls.size()))
    return static_cast<std::uint32_t>(frame - 1);
  return error(
      ErrorCode::invalid_argument,
      "there is no frame " + std::to_string(frame) + " of process " + std::to_string(process),
      "run.stack lists them; 1 is the innermost.", "frame");
}

program::VariableCut cut_of(const Map& args) {
  program::VariableCut cut;
  cut.depth = static_cast<std::uint32_t>(integer(args, "depth"));
  return cut;
}

Result<Value> variables(CommandContext& ctx, const Map& args) {
  const LiveRunPtr entry = run_of(ctx, args);
  RMP_TRY_ASSIGN(const auto watch, watch_of(*entry));
  const std::lock_guard lock(watch->mutex);
  RMP_TRY_ASSIGN(const Looked at, looked_at(*watch, *entry, args));
  List out;
  const std::uint32_t process = process_of(*at.machine, args);
  std::vector<program::Variable> all;
  RMP_TRY_ASSIGN(const std::uint32_t frame, frame_of(*at.machine, process, args));
  program::VariableCut cut = cut_of(args);
  if (has(args, "of")) {
    ++cut.depth;
    cut.first_part = static_cast<std::uint64_t>(integer(args, "from") - 1);
    cut.most_parts = static_cast<std::uint32_t>(integer(args, "most"));
    RMP_TRY_ASSIGN(program::Variable whole,
                   at.machine->evaluate(text_of(args, "of"), process, frame, cut));
    all = std::move(whole.parts);
  } else {
    all = frame == Machine::kNoFrame ? at.machine->globals(cut)
                                     : at.machine->variables(process, frame, cut);
    const auto from = std::min(static_cast<std::size_t>(integer(args, "from") - 1), all.size());
    all.erase(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(from));
    all.resize(std::min(all.size(), static_cast<std::size_t>(integer(args, "most"))));
  }
  for (const program::Variable& v : all) out.emplace_back(variable_map(v));
  return Value(std::move(out));
}

Result<Value> evaluate(CommandContext& ctx, const Map& args) {
  const LiveRunPtr entry = run_of(ctx, args);
  RMP_TRY_ASSIGN(const auto watch, watch_of(*entry));
  const std::lock_guard lock(watch->mutex);
  RMP_TRY_ASSIGN(const Looked at, looked_at(*watch, *entry, args));
  const std::uint32_t process = process_of(*at.machine, args);
  RMP_TRY_ASSIGN(const std::uint32_t frame, frame_of(*at.machine, process, args));
  RMP_TRY_ASSIGN(const program::Variable v,
                 at.machine->evaluate(text_of(args, "expression"), process, frame, cut_of(args)));
  return Value(variable_map(v));
}

Result<Value> set_variable(CommandContext& ctx, const Map& args) {
  const LiveRunPtr entry = run_of(ctx, args);
  RMP_TRY_ASSIGN(const auto watch, watch_of(*entry));
  const std::lock_guard lock(watch->mutex);
  RMP_TRY_ASSIGN(const Looked at, looked_at(*watch, *entry, args));
  if (!at.is_now)
    return error(ErrorCode::conflict,
                 "the run shows the past, and past variables cannot be changed",
                 "Seek to its last row first.");
  Machine& machine = watch->programs[at.program].machine();
  const std::uint32_t process = process_of(machine, args);
  RMP_TRY_ASSIGN(const std::uint32_t frame, frame_of(machine, process, args));
  RMP_TRY_ASSIGN(const program::Variable v,
                 machine.assign(text_of(args, "variable"), text_of(args, "value"), process, frame));
  return Value(variable_map(v));
}

Result<Value> input(CommandContext& ctx, const Map& args) {
  const LiveRunPtr entry = run_of(ctx, args);
  RMP_TRY_ASSIGN(const auto watch, watch_of(*entry));
  const std::lock_guard lock(watch->mutex);
  RMP_TRY_ASSIGN(const std::size_t at, program_at(*watch, args));
  const std::string line = text_of(args, "text");
  constexpr std::size_t kMostLine = std::size_t{1} << 20, kMostLines = 100'000;
  if (line.size() > kMostLine || line.find('\n') != std::string::npos)
    return error(
        ErrorCode::invalid_argument,
        line.size() > kMostLine ? "a line of " + std::to_string(line.size()) + " bytes is too long"
                                : std::string("a line must not contain an end of line"),
        line.size() > kMostLine ? "Give at most 1048576." : "Give one line after the other.",
        "text");
  const task::ProgramActor& program = watch->programs[at];
  if (program.is_over())
    return error(ErrorCode::conflict,
                 "program " + text::quote(program.name()) + " has ended and reads nothing",
                 "run.reset starts it again.");
  std::vector<std::string>& lines = watch->lines[program.name()];
  if (lines.size() >= kMostLines)
    return error(ErrorCode::unsupported, "the program already has 100000 lines of input",
                 "Make it read a file.");
  lines.push_back(line);
  return Value(Map{{"program", program.name()},
                   {"unread", static_cast<std::int64_t>(lines.size() - program.lines_read())}});
}

/// A program that counts, and its run, for examples.
std::string with_run(const char* rest) {
  return with_arm(
             "local cell = world.create{name = \"cell\"}\ncell:add_robot{robot = arm}\n"
             "local count = program.create{name = \"count\", source = [[\n"
             "PROGRAM count;\n"
             "VAR INT: i, sum;\n"
             "PROCEDURE add (IN INT: n);\n"
             "BEGIN\n"
             "  sum := sum + n;\n"
             "ENDPROC;\n"
             "BEGIN\n"
             "  FOR i := 1 TO 5\n"
             "    add(i);\n"
             "    WAIT 0.1 SEC;\n"
             "  ENDFOR;\n"
             "ENDPROGRAM;\n"
             "]]}\ncell:add_program{program = count}\n"
             "local run = cell:start_run(\"tasks\")\n") +
         rest;
}

}  // namespace

std::vector<std::string> Breakpoints::set_all(std::vector<task::ProgramActor>& programs,
                                              const task::ProgramWatch::Stand* stand) {
  const std::lock_guard lock(mutex);
  const Entry entry_now = std::exchange(entry, Entry::runs);
  if (entry_now != Entry::runs && !programs.empty())
    programs.front().machine().stop_on_entry(entry_now == Entry::waits);
  std::map<std::pair<std::string, std::uint32_t>, std::uint64_t> hits;
  if (stand)
    for (const auto& [name, machine] : stand->programs)
      for (const program::Breakpoint& x : machine.breakpoints())
        if (x.hits > 0) hits[{name, x.number}] = x.hits;
  std::map<std::string, program::Machine*> machines;
  for (task::ProgramActor& p : programs) machines[p.name()] = &p.machine();
  std::vector<std::string> notes;
  for (const auto& [number, b] : all) {
    const std::string word = "breakpoint " + std::to_string(b.number) + " stops nowhere: program " +
                             text::quote(b.program);
    const auto at = machines.find(b.program);
    if (at == machines.end()) {
      notes.push_back(word + " is not run");
      continue;
    }
    program::Breakpoint what = b.what;
    what.number = b.own;
    const auto counted = hits.find({b.program, b.own});
    what.hits = counted == hits.end() ? 0 : counted->second;
    const auto made = at->second->set_breakpoint(std::move(what));
    if (!made.ok()) notes.push_back(word + ": " + made.error().message);
  }
  return notes;
}

Result<LiveSource> live_tasks(CommandContext& ctx, const Map& args) {
  LiveSource out;
  RMP_TRY_ASSIGN(task::TaskRun run, task_run(ctx, args));
  if (run.programs.empty()) return out;
  if (run.physics) out.asks.emplace_back(PhysicsEngine::kInterfaceId, run.physics->engine);
  for (const auto& placed : ctx.snapshot().get(run.world)->robots)
    if (const auto* robot = ctx.snapshot().get(placed.robot))
      out.asks.emplace_back(IkSolver::kInterfaceId, robot->ik);
  out.watch = std::make_shared<task::ProgramWatch>();
  out.source = [&registry = ctx.app.registry, &derived = ctx.app.derived,
                snapshot = ctx.app.document.now(), run = std::move(run), watch = out.watch](
                   const sim::RunState* from, sim::RowSink& sink, Progress& progress) {
    return task::run({registry, derived, *snapshot}, run, progress, &sink, watch.get(),
                     from ? std::optional(from->time) : std::nullopt);
  };
  return out;
}

RMP_COMMANDS(program_debugging_commands) {
  std::vector<CommandSpec> all;
  const auto add = [&](const char* name, const char* summary, const char* details,
                       std::string example, Schema params, ReturnSpec returns, Effect effect,
                       Result<Value> (*run)(CommandContext&, const Map&)) {
    all.push_back({.name = name,
                   .classic = "",
                   .summary = summary,
                   .details = details,
                   .example = std::move(example),
                   .params = std::move(params),
                   .returns = std::move(returns),
                   .effect = effect,
                   .run = run});
  };
  const ParamSpec any_frame = between(
      defaulted(
          "frame", "int", "", 1,
          "Frame of the stack, 1 is the innermost; 0 gives the variables of program and modules."),
      0, 1e9);
  const ParamSpec program = optional(
                      "program", "string", "",
                      "Its name in the world; by default the stopped one, or the only one."),
                  process = between(
                      optional(
                          "process", "int", "",
                          "Number of its process, 0 is the program; by default the stopped one."),
                      0, 1e9);
  const ReturnSpec stood{
      "map",
      "",
      "",
      {field("time", "real", "s", "Time shown."),
       field("is_stopped", "bool", "", "True if a program is stopped at a line."),
       field("is_complete", "bool", "", "Whether the computation is complete."),
       field("error", "string", "", "Why it could not continue; absent if it could."),
       field("is_past", "bool", "", "Whether rows after the shown time are already computed."),
       field("program", "string", "", "The stopped program; the next fields refer to it."),
       field("reason", "string", "",
             "breakpoint, step, motion, pause (run.pause, or PAUSE), input (READ waits for "
             "run.input), entry or fault."),
       field("process", "int", "", "Number of its process, 0 is the program."),
       field("file", "string", "", "Place at which it is stopped."),
       field("line", "int", "", "Place at which it is stopped."),
       field("column", "int", "", "Place at which it is stopped."),
       field("breakpoint", "int", "", "Number of the breakpoint, if it is at one."),
       field("message", "string", "",
             "The fault; the message of PAUSE; at a breakpoint, why its condition has no value.")}};
  const std::vector<ParamSpec> breakpoint_fields{
      field("number", "int", "", "Number of the breakpoint."),
      field("program", "string", "", "Its name in the world."),
      field("source", "string", "", "Its file; empty for the program itself."),
      field("line", "int", "", "Line of the first statement at or after the given line."),
      field("column", "int", "", "Column of that statement."),
      field("routine", "string", "", "Routine with the breakpoint at its start, if one was given."),
      field("condition", "string", "", "Condition of the stop; empty means always."),
      field("ignore", "int", "", "Hits before it stops."),
      field("log", "string", "", "Message instead of a stop; empty: it stops."),
      field("hits", "int", "", "Hits so far.")};
  const std::vector<ParamSpec> variable_fields{
      field("name", "string", "", "Or [3] for an element."),
      field("type", "string", "", "Type as declared."),
      field("value", "string", "", "Value as printed by WRITE."),
      field("parts", "list", "", "Parts of records, arrays and lists, up to 200 each."),
      field("part_count", "int", "", "Number of parts."),
      field("is_indexed", "bool", "", "Whether they are elements rather than fields.")};
  const ParamSpec depth = between(
      defaulted("depth", "int", "", 8, "Depth of nested parts to return; 0 returns none."), 0, 8);
  const ParamSpec speed =
      optional("speed", "any", "",
               "It returns at once, and the run plays at this speed: 1 = real time, \"max\" = as "
               "fast as it computes. run.place reports its place.");
  add("run.set_breakpoint", "Sets a breakpoint: a live run stops when a program comes to a line.",
      "The condition is an expression of the language over the names visible there, without calls. "
      "Wrong names and types are rejected here; a condition without a value when it is evaluated, "
      "such as v[9] of eight elements, stops there, and message gives the reason. Breakpoints stay "
      "with the run, also after run.refresh and run.reset. A run starts after the statements of "
      "its programs at time 0; run.reset begins again and stops there, too.",
      with_run("local b = run:set_breakpoint{line = 5, condition = \"n = 3\"}\n"
               "assert(run:continue().line == 5 and b.line == 5)\n"
               "assert(run:evaluate(\"sum\").value == \"3\")"),
      {self("run"), between(optional("line", "int", "", "Line of the file."), 1, 1e9), program,
       optional("source", "string", "",
                "File of the program, such as a module; by default the program itself."),
       optional("condition", "string", "", "It stops if this is true."),
       between(defaulted("ignore", "int", "", 0, "Hits before it stops."), 0, 1e15),
       optional("routine", "string", "", "Instead of line: the start of this routine."),
       optional("hits", "string", "",
                "Hits at which it stops: \"5\" the fifth, \">= 3\" from the third on, \"% 2\" "
                "every second; also =, <, <= and >."),
       optional("log", "string", "",
                "Instead of stopping, it writes this note, with the values of expressions in "
                "braces: \"n is {n}\".")},
      {"map", "", "", breakpoint_fields}, Effect::simulates, set_breakpoint);
  add("run.clear_breakpoint", "Removes a breakpoint.", "",
      with_run("local b = run:set_breakpoint{line = 5}\nrun:clear_breakpoint(b.number)\n"
               "assert(run:continue().is_complete)"),
      {self("run"), needed("number", "int", "", "Number of the breakpoint.")}, {},
      Effect::simulates, clear_breakpoint);
  add("run.breakpoints", "Lists the breakpoints of a live run.", "",
      with_run("run:set_breakpoint{line = 5}\nassert(run:breakpoints()[1].line == 5)"),
      {self("run")}, {"list", "", "One table each.", breakpoint_fields}, Effect::reads,
      breakpoints);
  add("run.continue", "Continues until a program stops at a breakpoint, or to the end.",
      "run.play, run.step and run.seek stop at breakpoints, too; the run then pauses at that time.",
      with_run("run:set_breakpoint{line = 5, ignore = 2}\n"
               "assert(math.abs(run:continue().time - 0.3) < 1e-9)\n"
               "assert(run:continue().reason == \"breakpoint\")"),
      {self("run"), speed}, stood, Effect::simulates, continue_run);
  add("run.step_into", "Steps to the next line of a process, entering routines that it calls.",
      "Other programs and processes continue meanwhile; a line that takes time is completed.",
      with_run("run:set_breakpoint{line = 9}\nrun:continue()\n"
               "assert(run:step_into().line == 5)"),
      {self("run"), program, process, speed}, stood, Effect::simulates,
      step_program<program::StepKind::into>);
  add("run.step_over", "Steps to the next line of a process in the same routine.", "",
      with_run("run:set_breakpoint{line = 9}\nrun:continue()\n"
               "assert(run:step_over().line == 10)"),
      {self("run"), program, process, speed}, stood, Effect::simulates,
      step_program<program::StepKind::over>);
  add("run.step_out", "Continues until a process has left its present routine.", "",
      with_run("run:set_breakpoint{line = 5}\nrun:continue()\n"
               "assert(run:step_out().line ~= 5)"),
      {self("run"), program, process, speed}, stood, Effect::simulates,
      step_program<program::StepKind::out>);
  add("run.to_motion", "Continues until a process is about to begin a motion.", "",
      with_run("assert(run:to_motion().is_complete)"), {self("run"), program, process, speed},
      stood, Effect::simulates, step_program<program::StepKind::motion>);
  add("run.input", "Adds an input line for READ to a program.",
      "If a program of a live run reaches READ without an input line, the run pauses with the "
      "reason input; run.continue then continues with the line. Lines that are added in advance "
      "are kept until they are read, also after run.refresh.",
      with_arm("local cell = world.create{name = \"cell\"}\ncell:add_robot{robot = arm}\n"
               "local asks = program.create{name = \"asks\", source = [[\n"
               "PROGRAM asks;\n"
               "VAR INT: n;\n"
               "BEGIN\n"
               "  READLN(n);\n"
               "  WRITELN(2 * n);\n"
               "  WAIT 0.1 SEC;\n"
               "ENDPROGRAM;\n"
               "]]}\ncell:add_program{program = asks}\n"
               "local run = cell:start_run(\"tasks\")\n"
               "assert(run:continue().reason == \"input\")\n"
               "run:input(\"21\")\n"
               "run:continue()\n"
               "assert(run:recording():notes()[1] == \"t = 0 s: asks: 42\")"),
      {self("run"), needed("text", "string", "", "The line, without its line end."), program},
      {"map",
       "",
       "",
       {field("program", "string", "", "The program that reads it."),
        field("unread", "int", "", "Number of unread lines, including this one.")}},
      Effect::simulates, input);
  add("run.stack", "Lists the active calls of a process of a program, innermost first.",
      "At the time that the run shows, like run.variables and run.evaluate. In the recorded past "
      "it is the state after that row.",
      with_run("run:set_breakpoint{line = 5}\nrun:continue()\n"
               "assert(run:stack()[1].routine:lower() == \"add\" and #run:stack() == 2)"),
      {self("run"), program, process},
      {"list",
       "",
       "One table each.",
       {field("routine", "string", "", "Its name."), field("file", "string", "", "Its file."),
        field("line", "int", "", "Its file."), field("column", "int", "", "Its file.")}},
      Effect::reads, stack);
  add("run.variables", "Lists the variables of an active routine of a process.", "",
      with_run("run:set_breakpoint{line = 5}\nrun:continue()\n"
               "assert(run:variables()[1].name:lower() == \"n\")\n"
               "assert(#run:variables{frame = 0} > 0)"),
      {self("run"), any_frame, program, process,
       optional("of", "string", "", "List the parts of this variable instead of all variables."),
       between(defaulted("from", "int", "", 1, "The first one to return, 1 = the first."), 1, 9e15),
       between(defaulted("most", "int", "", 200, "Greatest number to return."), 1, 10'000), depth},
      {"list", "", "One table each.", variable_fields}, Effect::reads, variables);
  add("run.evaluate", "Evaluates an expression as a program sees it.",
      "Names, fields, indices, numbers, strings, operators and parentheses; no calls.",
      with_run("run:set_breakpoint{line = 5}\nrun:continue()\n"
               "assert(run:evaluate(\"n + 1\").value == \"3\")"),
      {self("run"), needed("expression", "string", "", "An expression in the program's language."),
       any_frame, program, process, depth},
      {"map", "", "", variable_fields}, Effect::reads, evaluate);
  add("run.set_variable", "Sets a variable of a program.",
      "Not possible in the past. run.refresh and run.reset recompute without the change.",
      with_run("run:set_breakpoint{line = 5}\nrun:continue()\nrun:set_variable(\"sum\", \"100\")\n"
               "run:continue()\nassert(run:evaluate(\"sum\").value == \"102\")"),
      {self("run"), needed("variable", "string", "", "Name, with fields and indices."),
       needed("value", "string", "", "An expression as in run.evaluate."), any_frame, program,
       process},
      {"map", "", "", variable_fields}, Effect::simulates, set_variable);
  return all;
}

}  // namespace robomosp::ioci
