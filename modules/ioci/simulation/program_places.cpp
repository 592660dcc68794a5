// SPDX-License-Identifier: Apache-2.0
// Programs in live runs, for editors: what runs, its text and lines, where it is while it runs, and
// over what is recorded line by line.
#include <algorithm>
#include <set>
#include <unordered_map>

#include "ioci/core/commands.h"
#include "ioci/program/in_world.h"
#include "ioci/program/program_files.h"
#include "ioci/simulation/program_debugging.h"

namespace robomosp::ioci {
namespace {

using namespace debugging;
using program::Machine;

constexpr std::int64_t kMostNotes = 10'000;
constexpr std::size_t kMostTimes = 200;

bool same(std::string_view a, std::string_view b) {
  const auto lower = [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  };
  return a.size() == b.size() && std::equal(a.begin(), a.end(), b.begin(),
                                            [&](char x, char y) { return lower(x) == lower(y); });
}

/// Does not wait for a program that computes.
Result<Value> run_place(CommandContext& ctx, const Map& args) {
  const LiveRunPtr entry = run_of(ctx, args);
  RMP_TRY_ASSIGN(const auto watch, watch_of(*entry));
  const sim::LiveRun::Shown shown = entry->run->shown();
  const bool is_playing = shown.speed != 0;
  Map out;
  if (const std::unique_lock lock(watch->mutex, std::try_to_lock); lock.owns_lock()) {
    out = place(*watch, *entry);
  } else {
    out = Map{{"time", shown.time},
              {"is_stopped", false},
              {"is_complete", shown.is_complete},
              {"is_past", false}};
    // It rests in a moment; who asks again then gets where.
    out.set("is_playing", true);
  }
  if (!out.find("is_playing")) out.set("is_playing", is_playing);
  out.set("notes", static_cast<std::int64_t>(shown.notes));
  return Value(std::move(out));
}

std::string state_of(const Machine& m) {
  switch (m.status().state) {
    case program::RunState::over: return "over";
    case program::RunState::fault: return "fault";
    case program::RunState::stopped: return "stopped";
    default: return "runs";
  }
}

/// As it was when the run began.
const model::Program* program_of(const document::Snapshot& snapshot, const LiveRunEntry& entry,
                                 std::string_view name) {
  for (const ProgramPlace& p : programs_of(snapshot, WorldId{entry.subject.number}))
    if (p.placed->name == name) return program_in(snapshot, p.placed->program);
  return nullptr;
}

Result<Value> run_programs(CommandContext& ctx, const Map& args) {
  const LiveRunPtr entry = run_of(ctx, args);
  RMP_TRY_ASSIGN(const auto watch, watch_of(*entry));
  const document::SnapshotPtr snapshot = entry->snapshot();
  const std::lock_guard lock(watch->mutex);
  const std::size_t row = row_shown(*watch, *entry);
  List out;
  for (std::size_t i = 0; i < watch->programs.size(); ++i) {
    const Machine& m = machine_at(*watch, row, i);
    List files, processes;
    if (const model::Program* p = program_of(*snapshot, *entry, watch->programs[i].name()))
      for (const model::ProgramFile& f : p->files) files.emplace_back(f.name);
    for (const std::uint32_t p : m.processes()) {
      Map one{{"number", static_cast<std::int64_t>(p)}, {"name", m.process_name(p)}};
      if (const auto calls = m.call_stack(p); !calls.empty()) {
        one.set("file", file_of(m, calls.front().span));
        one.set("line", static_cast<std::int64_t>(calls.front().span.line));
      }
      processes.emplace_back(std::move(one));
    }
    out.emplace_back(Map{{"name", watch->programs[i].name()},
                         {"state", state_of(m)},
                         {"files", std::move(files)},
                         {"processes", std::move(processes)}});
  }
  return Value(std::move(out));
}

Result<Value> program_lines(CommandContext& ctx, const Map& args) {
  const LiveRunPtr entry = run_of(ctx, args);
  RMP_TRY_ASSIGN(const auto watch, watch_of(*entry));
  const std::lock_guard lock(watch->mutex);
  RMP_TRY_ASSIGN(const std::size_t at, program_at(*watch, args));
  const Machine& m = watch->programs[at].machine();
  RMP_TRY_ASSIGN(const auto spans, m.statements(text_of(args, "source")));
  List lines, routines;
  for (const rmp_span& s : spans)
    lines.emplace_back(Map{{"line", static_cast<std::int64_t>(s.line)},
                           {"column", static_cast<std::int64_t>(s.column)}});
  for (const Machine::RoutinePlace& r : m.routines())
    routines.emplace_back(Map{{"name", r.name},
                              {"file", file_of(m, r.span)},
                              {"line", static_cast<std::int64_t>(r.span.line)}});
  return Value(Map{{"statements", std::move(lines)}, {"routines", std::move(routines)}});
}

/// As it was compiled, whatever was edited since.
Result<Value> program_text(CommandContext& ctx, const Map& args) {
  const LiveRunPtr entry = run_of(ctx, args);
  RMP_TRY_ASSIGN(const auto watch, watch_of(*entry));
  std::string name;
  {
    const std::lock_guard lock(watch->mutex);
    RMP_TRY_ASSIGN(const std::size_t at, program_at(*watch, args));
    name = watch->programs[at].name();
  }
  const document::SnapshotPtr snapshot = entry->snapshot();
  const model::Program* const p = program_of(*snapshot, *entry, name);
  if (!p) return unknown_name("program", name, {});
  const std::string source = text_of(args, "source");
  std::vector<std::string> known;
  for (const model::ProgramFile& f : p->files) {
    if (source.empty() || same(f.name, source)) return Value(text_of_file(f));
    known.push_back(f.name);
  }
  return unknown_name("file", source, known);
}

Result<Value> run_notes(CommandContext& ctx, const Map& args) {
  const LiveRunPtr entry = run_of(ctx, args);
  List out;
  for (std::string& note : entry->run->notes(static_cast<std::size_t>(integer(args, "from") - 1),
                                             static_cast<std::size_t>(integer(args, "most"))))
    out.emplace_back(std::move(note));
  return Value(std::move(out));
}

// ---- over what is recorded ----

struct Spot {
  std::uint32_t file = 0, line = 0, column = 0;
  std::size_t depth = 0;
  [[nodiscard]] bool is_line_of(const Spot& o) const {
    return file == o.file && line == o.line && depth == o.depth;
  }
};
std::optional<Spot> spot_of(const Machine& m, std::uint32_t process) {
  const auto place = m.place_of(process);
  if (!place) return std::nullopt;
  return Spot{place->span.file, place->span.line, place->span.column, place->depth};
}

/// Breakpoints that stop, of each program by line.
using BreakpointLines =
    std::vector<std::unordered_map<std::uint32_t, std::vector<program::Breakpoint>>>;
BreakpointLines lines_of(const task::ProgramWatch& watch, Breakpoints& set) {
  BreakpointLines out(watch.programs.size());
  const std::lock_guard lock(set.mutex);
  for (std::size_t p = 0; p < out.size(); ++p)
    for (const auto& [number, b] : set.all)
      if (b.program == watch.programs[p].name() && b.what.log.empty())
        out[p][b.what.line].push_back(b.what);
  return out;
}

/// Whether a program comes to a breakpoint in a row, other than in the row before.
bool has_breakpoint(const task::ProgramWatch& watch, const BreakpointLines& lines,
                    std::size_t row) {
  for (std::size_t p = 0; p < watch.programs.size(); ++p) {
    if (lines[p].empty()) continue;
    const Machine& m = machine_at(watch, row, p);
    for (const std::uint32_t process : m.processes()) {
      const auto now = spot_of(m, process);
      const auto here = now ? lines[p].find(now->line) : lines[p].end();
      if (here == lines[p].end()) continue;
      if (row > 0) {
        const auto before = spot_of(machine_at(watch, row - 1, p), process);
        if (before && before->is_line_of(*now)) continue;
      }
      const std::string file = file_of(m, rmp_span{now->file, 0, 0, 0, 0});
      for (const program::Breakpoint& b : here->second) {
        if (!same(file, b.file)) continue;
        if (b.condition.empty()) return true;
        const auto v = m.evaluate(b.condition, process, 0);
        if (v.ok() && v->value == "TRUE") return true;
      }
    }
  }
  return false;
}

/// Shows a row: its time, and which of the rows at that time.
Result<void> show_row(task::ProgramWatch& watch, const LiveRunEntry& entry, std::size_t row,
                      std::unique_lock<std::mutex>& lock, Progress& progress) {
  const std::size_t count = watch.rows.size();
  const double time = row < count ? watch.rows[row].time : watch.rows.back().time;
  lock.unlock();
  RMP_TRY(entry.run->go_to(time, progress));
  lock.lock();
  watch.chosen.reset();
  // The last row is what is now.
  if (row + 1 < count && watch.rows.size() == count)
    watch.chosen = task::ProgramWatch::Chosen{row, entry.run->shown().time, count};
  return {};
}

Result<Value> step_recorded(CommandContext& ctx, const Map& args) {
  const LiveRunPtr entry = run_of(ctx, args);
  RMP_TRY_ASSIGN(const auto watch, watch_of(*entry));
  RMP_TRY(entry->run->pause(ctx.progress));
  std::unique_lock lock(watch->mutex);
  RMP_TRY_ASSIGN(const std::size_t program, program_at(*watch, args));
  if (watch->rows.empty())
    return error(ErrorCode::conflict, "nothing is recorded yet", "Start the run first.");
  const bool is_back = flag(args, "back");
  const std::string kind = text_of(args, "to");
  // What is now is behind the last row, unless it is that row.
  std::size_t at = row_shown(*watch, *entry);
  const std::uint32_t process = process_of(machine_at(*watch, at, program), args);
  const auto here = spot_of(machine_at(*watch, at, program), process);
  if (at >= watch->rows.size()) at = watch->rows.size() - 1;
  const BreakpointLines lines =
      kind == "breakpoint" ? lines_of(*watch, *entry->breakpoints) : BreakpointLines();
  const auto fits = [&](std::size_t row) {
    if (kind == "breakpoint") return has_breakpoint(*watch, lines, row);
    const auto there = spot_of(machine_at(*watch, row, program), process);
    if (!there || !here) return there.has_value() != here.has_value();
    if (kind == "out") return there->depth < here->depth;
    if (kind == "over" && there->depth > here->depth) return false;
    return !there->is_line_of(*here) || there->column != here->column;
  };
  std::optional<std::size_t> found;
  for (std::size_t row = at; !found && (is_back ? row > 0 : row + 1 < watch->rows.size());) {
    row = is_back ? row - 1 : row + 1;
    if (ctx.progress.cancelled()) return error(ErrorCode::cancelled, "the search was cancelled");
    if (fits(row)) found = row;
  }
  const std::size_t end = is_back ? 0 : watch->rows.size() - 1;
  RMP_TRY(show_row(*watch, *entry, found.value_or(end), lock, ctx.progress));
  Map out = place(*watch, *entry);
  out.set("is_found", found.has_value());
  return Value(std::move(out));
}

/// Times at which a program came to a line, newest first.
Result<Value> recorded_at(CommandContext& ctx, const Map& args) {
  const LiveRunPtr entry = run_of(ctx, args);
  RMP_TRY_ASSIGN(const auto watch, watch_of(*entry));
  const std::lock_guard lock(watch->mutex);
  RMP_TRY_ASSIGN(const std::size_t program, program_at(*watch, args));
  const auto line = static_cast<std::uint32_t>(integer(args, "line"));
  std::string source = text_of(args, "source");
  const Machine& last = watch->programs[program].machine();
  if (source.empty()) source = file_of(last, rmp_span{0, 0, 0, 0, 0});
  RMP_TRY(last.statements(source));
  std::vector<std::pair<double, std::uint32_t>> found;
  std::set<std::uint32_t> before;
  for (std::size_t row = 0; row < watch->rows.size(); ++row) {
    std::set<std::uint32_t> now;
    const Machine& m = machine_at(*watch, row, program);
    for (const std::uint32_t process : m.processes()) {
      const auto place = m.place_of(process);
      if (!place || place->span.line != line || !same(file_of(m, place->span), source)) continue;
      now.insert(process);
      if (!before.contains(process)) found.emplace_back(watch->rows[row].time, process);
    }
    before = std::move(now);
  }
  List out;
  for (std::size_t i = found.size(); i-- > 0 && out.size() < kMostTimes;)
    out.emplace_back(
        Map{{"time", found[i].first}, {"process", static_cast<std::int64_t>(found[i].second)}});
  return Value(std::move(out));
}

/// A program that counts, and its run, for examples.
std::string with_run_of_program(const char* rest) {
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
             "  WRITELN('sum ', sum);\n"
             "ENDPROGRAM;\n"
             "]]}\ncell:add_program{program = count}\n"
             "local run = cell:start_run(\"tasks\")\n") +
         rest;
}

}  // namespace

RMP_COMMANDS(program_places_commands) {
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
  const ParamSpec program = optional(
                      "program", "string", "",
                      "Its name in the world; by default the stopped one, or the only one."),
                  source = optional(
                      "source", "string", "",
                      "File of the program, such as a module; by default the program itself.");
  std::vector<ParamSpec> place_fields{
      field("time", "real", "s", "Time shown."),
      field("is_stopped", "bool", "", "True if a program is stopped at a line."),
      field("is_complete", "bool", "", "Whether the computation is complete."),
      field("is_past", "bool", "", "Whether rows after the shown time are already computed."),
      field("error", "string", "", "Why it could not continue; absent if it could."),
      field("program", "string", "",
            "The program that is stopped or has the fault; the next fields refer to it."),
      field("reason", "string", "", "breakpoint, step, motion, pause, entry or fault."),
      field("process", "int", "", "Number of its process, 0 is the program."),
      field("file", "string", "", "Its present place."),
      field("line", "int", "", "Its present place."),
      field("column", "int", "", "Its present place."),
      field("breakpoint", "int", "", "Number of the breakpoint, if it is at one."),
      field("message", "string", "", "Description of a fault.")};
  auto seen = place_fields;
  seen.push_back(field("is_playing", "bool", "", "Whether the run is playing."));
  seen.push_back(field("notes", "int", "", "Number of notes so far."));
  add("run.place", "Returns the places of the programs of a live run, also while they run.",
      "It returns at once; run.continue and the steps with a speed, and run.play, continue "
      "meanwhile.",
      with_run_of_program("run:set_breakpoint{line = 5}\nrun:continue{speed = \"max\"}\n"
                          "repeat until not run:place().is_playing\nassert(run:place().line == 5)"),
      {self("run")}, {"map", "", "", seen}, Effect::reads, run_place);
  add("run.programs", "Lists the programs of a live run with their files and processes.",
      "At the time that the run shows.",
      with_run_of_program("local p = run:programs()[1]\n"
                          "assert(p.files[1] == \"count.irl\" and p.processes[1].line == 10)"),
      {self("run")},
      {"list",
       "",
       "One table each.",
       {field("name", "string", "", "Name in the world."),
        field("state", "string", "", "runs, stopped, over or fault."),
        field("files", "list", "", "Names of its files, the program first."),
        field("processes", "list", "",
              "Tables {number, name, file, line} of the active processes; 0 is the program.")}},
      Effect::reads, run_programs);
  add("run.program_lines",
      "Lists the first lines of statements and routines of a program in a run.",
      "Whether there is a breakpoint.",
      with_run_of_program("local l = run:program_lines()\nassert(l.statements[1].line == 5)\n"
                          "assert(#l.routines == 2)"),
      {self("run"), program, source},
      {"map",
       "",
       "",
       {field("statements", "list", "", "Tables {line, column} in the file, in order."),
        field("routines", "list", "", "Tables {name, file, line} of routines with statements.")}},
      Effect::reads, program_lines);
  add("run.program_text", "Returns the text of a file of a program as used by the run.",
      "Later edits take effect with run.refresh or run.reset.",
      with_run_of_program("assert(run:program_text():match(\"PROGRAM count\"))"),
      {self("run"), program, source}, {"string", "", "The text.", {}}, Effect::reads, program_text);
  add("run.notes", "Returns the notes and the output of a live run so far.", "",
      with_run_of_program(
          "run:finish()\nlocal all = run:notes()\n"
          "assert(all[#all] == \"t = 0.5 s: count: sum 15\" and #run:notes(#all + 1) == 0)"),
      {self("run"),
       between(defaulted("from", "int", "", 1, "The first note to return, 1 = the first."), 1,
               9e15),
       between(defaulted("most", "int", "", kMostNotes, "Greatest number to return."), 1,
               static_cast<double>(kMostNotes))},
      {"list", "", "Texts.", {}}, Effect::reads, run_notes);
  auto stood = place_fields;
  stood.push_back(field("is_found", "bool", "",
                        "Whether such a place exists; if not, the first or last row is shown."));
  add("run.step_recorded", "Moves through the recorded past to another line of a program.",
      "The record contains the state after each row, and the stops of programs. Nothing is "
      "computed; at the last row run.step_into and the other steps continue.",
      with_run_of_program("run:set_breakpoint{line = 5, hits = \"3\"}\nrun:continue()\n"
                          "local back = run:step_recorded{back = true, to = \"over\"}\n"
                          "assert(back.is_past and run:evaluate(\"sum\").value == \"6\")\n"
                          "assert(not run:step_recorded{to = \"breakpoint\"}.is_past)"),
      {self("run"), defaulted("back", "bool", "", false, "Towards the start."),
       choice("to", {"into", "over", "out", "breakpoint"},
              "into: another line; over: one that is not in a called routine; out: after leaving "
              "the routine; breakpoint: a line with a breakpoint."),
       program,
       between(optional("process", "int", "",
                        "Number of its process, 0 is the program; by default the stopped one."),
               0, 1e9)},
      {"map", "", "", stood}, Effect::simulates, step_recorded);
  add("run.recorded_at", "Lists the times at which a program came to a line, as far as recorded.",
      "Lines are recorded after each row and at the stops of programs.",
      with_run_of_program(
          "run:set_breakpoint{line = 5, hits = \"< 3\"}\nrun:continue()\nrun:continue()\n"
          "assert(#run:recorded_at{line = 5} == 2)"),
      {self("run"), between(needed("line", "int", "", "Line of the file."), 1, 1e9), program,
       source},
      {"list",
       "",
       "The latest first, at most 200.",
       {field("time", "real", "s", "Time for run.seek."),
        field("process", "int", "", "Number of its process, 0 is the program.")}},
      Effect::reads, recorded_at);
  return all;
}

}  // namespace robomosp::ioci
