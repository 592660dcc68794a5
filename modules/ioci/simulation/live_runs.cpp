// SPDX-License-Identifier: Apache-2.0
// Live runs: simulations that are stepped, played, paused, run backwards, and go on in an edited
// world.
#include <algorithm>
#include <cmath>
#include <limits>

#include "ioci/core/commands.h"
#include "ioci/core/origins.h"
#include "ioci/program/in_world.h"
#include "ioci/robot/shown_robot.h"
#include "ioci/simulation/live_runs.h"
#include "ioci/simulation/program_debugging.h"
#include "ioci/simulation/run_pulse.h"
#include "ioci/simulation/run_start.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"

namespace robomosp::ioci {
namespace {

/// What a live run can be of: a word, the command whose arguments it takes, and how it is computed
/// row by row; without that the command's whole recording is made first.
struct Simulation {
  const char* word;
  const char* command;
  Result<LiveSource> (*live)(CommandContext&, const Map&);
};
constexpr Simulation kOfWorlds[] = {{"physics", "world.simulate_physics", live_physics},
                                    {"dynamics", "world.simulate_dynamics", live_dynamics},
                                    {"inverse_kinematics", "world.inverse_kinematics", nullptr},
                                    {"forward_kinematics", "world.forward_kinematics", nullptr},
                                    {"inverse_dynamics", "world.inverse_dynamics", nullptr},
                                    {"time_optimal", "world.time_optimal", nullptr},
                                    {"tasks", "world.run_task", live_tasks}};
constexpr Simulation kOfRobots[] = {{"dynamics", "robot.simulate", live_robot}};
constexpr const char* kReplay = "recording";

std::vector<std::string> words_of(std::span<const Simulation> all) {
  std::vector<std::string> words;
  for (const Simulation& s : all) words.emplace_back(s.word);
  words.emplace_back(kReplay);
  return words;
}

/// A recording that is there already, row by row.
sim::LiveRun::Source replay(recording::RecordingPtr recording) {
  return [recording = std::move(recording)](const sim::RunState* from, sim::RowSink& sink,
                                            Progress&) -> Result<recording::RecordingPtr> {
    const double begin = from ? from->time : -std::numeric_limits<double>::infinity();
    RMP_TRY(sim::hand_on(*recording, begin, sink));
    return recording;
  };
}

Result<recording::RecordingPtr> live_recording_of(const CommandContext& ctx, const Value* v) {
  const Handle* h = v ? v->as_handle() : nullptr;
  auto found = h && h->kind == "recording" ? ctx.app.recordings.find(h->number) : nullptr;
  if (found) return found;
  return error(ErrorCode::invalid_argument, "there is no recording to run",
               "Give with = {recording = ...}.", "with");
}

/// Whether something that is asked was written in Lua, which would wait for its script at every
/// row.
bool asks_scripts(const Registry& registry, const LiveSource& live) {
  return std::any_of(live.asks.begin(), live.asks.end(), [&](const auto& asked) {
    const auto info = registry.find(asked.first, asked.second.name);
    return info.ok() && info->is_script;
  });
}

/// How an entry is computed from now on, and its programs; null = it has none to look at.
struct Made {
  sim::LiveRun::Source source;
  std::shared_ptr<task::ProgramWatch> watch = {};
  bool has_forces = false;  ///< run.pull acts
};

/// Tells simulations which sessions are open, until the application ends. [any thread]
class OpenSessions {
 public:
  explicit OpenSessions(const Application& app) : gate_(std::make_shared<Gate>()) {
    gate_->app = &app;
  }
  ~OpenSessions() {
    const std::lock_guard lock(gate_->mutex);
    gate_->app = nullptr;
  }
  OpenSessions(const OpenSessions&) = delete;
  OpenSessions& operator=(const OpenSessions&) = delete;
  [[nodiscard]] std::function<bool(std::uint64_t session)> check() const {
    return [gate = gate_](std::uint64_t session) {
      const std::lock_guard lock(gate->mutex);
      if (!gate->app) return false;
      const auto all = gate->app->sessions();
      return std::any_of(all.begin(), all.end(), [&](const Application::SessionInfo& s) {
        return s.number == session && s.is_open;
      });
    };
  }

 private:
  struct Gate {
    std::mutex mutex;
    const Application* app = nullptr;  // guarded by mutex
  };
  std::shared_ptr<Gate> gate_;
};

Result<Made> source_of(CommandContext& ctx, const LiveRunEntry& entry) {
  // A source computes with what is published, while a group of edits is only this session's.
  if (ctx.is_in_group())
    return error(ErrorCode::conflict, "a live run cannot begin while a group of edits is open",
                 "Finish the group first.");
  if (entry.of == kReplay) {
    RMP_TRY_ASSIGN(auto recording, live_recording_of(ctx, entry.with.find("recording")));
    return Made{replay(std::move(recording))};
  }
  const std::span<const Simulation> all = entry.subject.kind == "world"
                                              ? std::span<const Simulation>(kOfWorlds)
                                              : std::span<const Simulation>(kOfRobots);
  const auto simulation =
      std::find_if(all.begin(), all.end(), [&](const Simulation& s) { return entry.of == s.word; });
  if (simulation == all.end()) return unknown_name("simulation", entry.of, words_of(all));
  Map args = entry.with;
  if (flag(args, "watch"))
    return error(ErrorCode::invalid_argument, "a live run cannot be watched",
                 "Apply edits with run:refresh(); watch is for commands that record at once.",
                 "with");
  args.set("id", entry.subject);
  if (simulation->live) {
    const CommandSpec& spec = *ctx.app.commands.find(simulation->command);
    RMP_TRY_ASSIGN(const Map checked, read_map(ctx, spec.params, args, "with"));
    RMP_TRY_ASSIGN(LiveSource live, simulation->live(ctx, checked));
    if (live.source && !asks_scripts(ctx.app.registry, live)) {
      if (live.watch)
        live.watch->begin = [set = entry.breakpoints,
                             watch = live.watch.get()](std::vector<task::ProgramActor>& programs) {
          return set->set_all(programs, watch->stand ? &*watch->stand : nullptr);
        };
      if (live.pulls) {
        *live.pulls = entry.pulls;
        live.pulls->set_open_check(ctx.app.kept<OpenSessions>().check());
      }
      return Made{std::move(live.source), std::move(live.watch), live.pulls != nullptr};
    }
  }
  RMP_TRY_ASSIGN(const Value made, ctx.dispatch(simulation->command, args));
  RMP_TRY_ASSIGN(auto recording, live_recording_of(ctx, &made));
  ctx.app.recordings.remove(made.as_handle()->number);
  return Made{replay(std::move(recording))};
}

LiveRunPtr entry_of(CommandContext& ctx, const Map& args) {
  const Handle& h = *args.find("id")->as_handle();
  LiveRunPtr found = ctx.app.runs->find(h.number);
  if (!found) throw StaleHandle{h};
  return found;
}

/// Whether a record and all that it refers to are the same in two snapshots.
bool is_same(const document::Snapshot& a, const document::Snapshot& b, AnyId id) {
  if (a.revision() == b.revision()) return true;
  std::vector<AnyId> ids{id};
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const auto record = a.share(ids[i]);
    if (record != b.share(ids[i])) return false;
    if (!record) continue;
    model::for_each_reference(record->body, [&](AnyId other, std::string_view) {
      if (std::find(ids.begin(), ids.end(), other) == ids.end()) ids.push_back(other);
    });
  }
  return true;
}

/// Values of a row by the names of its columns.
class Row {
 public:
  Row(const recording::Recording& head, const std::vector<double>& values)
      : head_(head), values_(values) {}
  [[nodiscard]] const double* find(const std::string& name) const {
    const std::size_t count = std::min(values_.size(), head_.columns.size());
    for (std::size_t c = 0; c < count; ++c)
      if (head_.columns[c].name == name) return &values_[c];
    return nullptr;
  }
  [[nodiscard]] Map all() const {
    Map out;
    const std::size_t count = std::min(values_.size(), head_.columns.size());
    for (std::size_t c = 0; c < count; ++c) out.set(head_.columns[c].name, values_[c]);
    return out;
  }
  /// q1, q2, ... of a robot.
  [[nodiscard]] std::vector<double> joints(const std::string& robot) const {
    const std::string stem = (robot == head_.robot ? "" : robot + ".") + std::string("q");
    std::vector<double> q;
    while (const double* x = find(stem + std::to_string(q.size() + 1))) q.push_back(*x);
    return q;
  }
  [[nodiscard]] std::optional<Pose> pose(const std::string& object) const {
    std::array<double, 7> x{};
    for (std::size_t k = 0; k < x.size(); ++k) {
      const double* v = find(object + recording::kPlaceColumns[k]);
      if (!v) return std::nullopt;
      x[k] = *v;
    }
    return recording::pose_of_place(x);
  }

 private:
  const recording::Recording& head_;
  const std::vector<double>& values_;
};

}  // namespace

Map live_run_state(const Application& app, const LiveRunEntry& entry) {
  const sim::LiveRun::Shown s = entry.run->shown();
  const recording::Recording head = entry.run->head();
  const Row row(head, s.values);
  const AnyId subject{*kind_from(entry.subject.kind), entry.subject.number};
  bool is_outdated = !is_same(*entry.snapshot(), *app.document.now(), subject);
  if (subject.kind == Kind::world && entry.of == "tasks")
    for (const document::SnapshotPtr& each : {entry.snapshot(), app.document.now()})
      for (const ProgramPlace& p : programs_of(*each, WorldId{subject.number}))
        is_outdated =
            is_outdated || !is_same(*entry.snapshot(), *app.document.now(), p.placed->program);
  Map out{{"time", s.time},
          {"row", static_cast<std::int64_t>(s.row + 1)},
          {"rows", static_cast<std::int64_t>(s.rows)},
          {"recorded", s.recorded},
          {"speed", s.speed},
          {"is_playing", s.speed != 0},
          {"is_over", s.is_over},
          {"is_complete", s.is_complete},
          {"is_outdated", is_outdated},
          {"lag", s.lag},
          {"restarts", static_cast<std::int64_t>(s.restarts)}};
  if (s.failure) out.set("error", s.failure->sentence());
  out.set("values", row.all());
  Map joints, axes, objects;
  const document::SnapshotPtr snapshot = entry.snapshot();
  const auto add_joints = [&](const std::string& robot, const model::Robot* placed) {
    auto q = row.joints(robot);
    if (q.empty()) return;
    const auto maker = robotics::MakerAxes::for_messages(placed);
    if (maker->known()) axes.set(robot, axis_map(*maker, q));
    joints.set(robot, NumericArray(std::move(q)));
  };
  if (const auto* record = snapshot->find(subject)) {
    if (const auto* world = std::get_if<model::World>(&record->body)) {
      for (const auto& r : world->robots) add_joints(r.name, snapshot->get(r.robot));
      for (const auto& o : world->objects)
        if (const auto pose = row.pose(o.name)) objects.set(o.name, pose_map(*pose));
    } else {
      add_joints(head.robot, std::get_if<model::Robot>(&record->body));
    }
  }
  out.set("joints", std::move(joints));
  if (!axes.empty()) out.set("axes", std::move(axes));
  List pullable, pulls;
  for (std::string& name : pullable_robots(entry, head)) pullable.emplace_back(std::move(name));
  if (entry.has_forces)
    for (const auto& [name, pose] : objects) pullable.emplace_back(name);
  out.set("objects", std::move(objects));
  for (const sim::Pulls::Shown& p : entry.pulls.shown()) {
    Map one{{"session", static_cast<std::int64_t>(p.pull.session)}};
    if (p.pull.object.empty()) {
      one.set("robot", p.pull.robot);
      one.set("link", p.pull.link);
    } else {
      one.set("object", p.pull.object);
    }
    one.set("to", vec_value(p.pull.to));
    if (p.at) one.set("at", vec_value(*p.at));
    one.set("force", p.force);
    pulls.emplace_back(std::move(one));
  }
  out.set("pullable", std::move(pullable));
  out.set("pulls", std::move(pulls));
  return out;
}

std::vector<std::string> pullable_robots(const LiveRunEntry& entry,
                                         const recording::Recording& head) {
  std::vector<std::string> out;
  if (!entry.has_forces) return out;
  const document::SnapshotPtr snapshot = entry.snapshot();
  const auto* record = snapshot->find(AnyId{*kind_from(entry.subject.kind), entry.subject.number});
  const auto* world = record ? std::get_if<model::World>(&record->body) : nullptr;
  // Robots that follow their motion whatever acts on them have no torques.
  const auto add_robot = [&](const std::string& name) {
    if (head.find((name == head.robot ? "" : name + ".") + std::string("tau1")))
      out.push_back(name);
  };
  if (!world) add_robot(head.robot);
  else
    for (const auto& r : world->robots) add_robot(r.name);
  return out;
}

Result<Map> live_run_rows(const LiveRunEntry& entry, std::size_t from,
                          std::optional<std::size_t> restarts, std::size_t most, std::size_t values,
                          std::span<const std::string> columns) {
  const std::size_t width = std::max<std::size_t>(1, entry.run->head().columns.size());
  most = std::min(most, std::max<std::size_t>(1, values / width));
  RMP_TRY_ASSIGN(auto piece, entry.run->piece(from, restarts, most, columns));
  Map table;
  std::size_t rows = 0;
  for (auto& c : piece.columns) {
    rows = c.values.size();
    table.set(c.name, NumericArray(std::move(c.values)));
  }
  return Map{{"from", static_cast<std::int64_t>(piece.from + 1)},
             {"count", static_cast<std::int64_t>(rows)},
             {"rows", static_cast<std::int64_t>(piece.recorded)},
             {"restarts", static_cast<std::int64_t>(piece.restarts)},
             {"columns", std::move(table)}};
}

Result<double> speed_of(const Value& given) {
  const std::string* word = given.as_string();
  double speed = 0;
  if (word && *word == "max") speed = sim::kAsFastAsPossible;
  else if (const auto read = word ? text::read_real(*word) : given.number()) speed = *read;
  else
    return error(ErrorCode::invalid_argument, given.text() + " is not a speed",
                 "Give a number, 1 = real time, or \"max\".", "speed");
  if (std::isnan(speed) || speed == 0 || speed == -sim::kAsFastAsPossible)
    return error(ErrorCode::invalid_argument, "a speed of " + given.text() + " cannot be played",
                 "Use run.pause to stop; a negative speed plays backwards.", "speed");
  return speed;
}

namespace {

/// What the run's outcome is worth: its state, or the error.
Result<Value> answer(CommandContext& ctx, const Map& args, Result<void> done) {
  const LiveRunPtr run = entry_of(ctx, args);
  const LiveRunEntry& entry = *run;
  if (!done.ok()) return std::move(done).error().in("run " + text::quote(entry.title));
  return Value(ctx.app.kept<RunPulse>().publish(args.find("id")->as_handle()->number, entry));
}

void set_entry(LiveRunEntry& entry, const Map& args) {
  const std::string word = text_of(args, "entry");
  const std::lock_guard lock(entry.breakpoints->mutex);
  entry.breakpoints->entry = word == "stop"   ? Breakpoints::Entry::stops
                             : word == "wait" ? Breakpoints::Entry::waits
                                              : Breakpoints::Entry::runs;
}

Result<Value> start(CommandContext& ctx, const Map& args) {
  const auto made = std::make_shared<LiveRunEntry>();
  LiveRunEntry& entry = *made;
  entry.of = text_of(args, "of");
  entry.subject = *args.find("id")->as_handle();
  if (const Value* with = args.find("with"); with && with->as_map()) entry.with = *with->as_map();
  entry.title = ctx.name_of(entry.subject).value_or("") + ": " + entry.of;
  entry.set_snapshot(ctx.base());
  set_entry(entry, args);
  RMP_TRY_ASSIGN(Made simulation, source_of(ctx, entry));
  entry.set_watch(std::move(simulation.watch));
  entry.has_forces = simulation.has_forces;
  entry.run = std::make_unique<sim::LiveRun>();
  RMP_TRY(entry.run->start(std::move(simulation.source), ctx.progress));
  if (entry.of != kReplay) {
    auto noted = with_start_notes(ctx, entry.run->recording());
    if (!noted.ok()) return std::move(noted).error();
  }
  return Value(Handle{"run", ctx.app.runs->add(made)});
}

/// How the programs of a run that rests stand at the time that it shows.
task::ProgramWatch::Stand stand_of(const task::ProgramWatch& watch, const LiveRunEntry& entry) {
  task::ProgramWatch::Stand out;
  const std::size_t row = debugging::row_shown(watch, entry);
  const bool is_now = row >= watch.rows.size();
  for (std::size_t i = 0; i < watch.programs.size(); ++i)
    out.programs.emplace_back(watch.programs[i].name(), debugging::machine_at(watch, row, i));
  const std::size_t at = is_now ? watch.stopped_at : watch.rows[row].stopped_at;
  if ((is_now ? watch.is_stopped : watch.rows[row].is_stopped) && at < out.programs.size())
    out.stopped = at;
  return out;
}

/// Lets a run rest, also where a program computes without end.
Result<void> rest(CommandContext& ctx, const LiveRunEntry& entry) {
  const auto watch = entry.watch();
  if (watch) watch->wants_pause = true;
  auto done = entry.run->pause(ctx.progress);
  if (watch) watch->wants_pause = false;
  return done;
}

/// Computes on with the world as it is now; what cannot leaves the run as it was.
Result<Value> anew(CommandContext& ctx, const Map& args, bool is_same_run,
                   Result<void> (sim::LiveRun::*how)(sim::LiveRun::Source, Progress&)) {
  const LiveRunPtr run = entry_of(ctx, args);
  LiveRunEntry& entry = *run;
  auto made = source_of(ctx, entry);
  if (!made.ok()) return answer(ctx, args, std::move(made).error());
  if (const auto before = entry.watch(); is_same_run && before && made->watch) {
    if (auto rested = rest(ctx, entry); !rested.ok()) return answer(ctx, args, std::move(rested));
    const std::lock_guard old(before->mutex);
    made->watch->lines = before->lines;  // what was typed counts again
    made->watch->stand = stand_of(*before, entry);
  }
  auto done = (entry.run.get()->*how)(std::move(made->source), ctx.progress);
  if (done.ok()) {
    entry.set_watch(std::move(made->watch));
    entry.has_forces = made->has_forces;
    entry.set_snapshot(ctx.base());
  }
  return answer(ctx, args, std::move(done));
}
Result<Value> reset(CommandContext& ctx, const Map& args) {
  set_entry(*entry_of(ctx, args), args);
  return anew(ctx, args, false, &sim::LiveRun::start);
}
Result<Value> refresh(CommandContext& ctx, const Map& args) {
  const LiveRunPtr run = entry_of(ctx, args);
  {
    const std::lock_guard lock(run->breakpoints->mutex);
    run->breakpoints->entry = Breakpoints::Entry::runs;
  }
  return anew(ctx, args, true, &sim::LiveRun::refresh);
}

Result<Value> step_run(CommandContext& ctx, const Map& args) {
  const LiveRunPtr entry = entry_of(ctx, args);
  sim::LiveRun& run = *entry->run;
  if (!has(args, "time")) return answer(ctx, args, run.step(integer(args, "rows"), ctx.progress));
  return answer(ctx, args, run.go_to(run.shown().time + real(args, "time"), ctx.progress));
}
Result<Value> seek(CommandContext& ctx, const Map& args) {
  return answer(ctx, args, entry_of(ctx, args)->run->go_to(real(args, "time"), ctx.progress));
}
Result<Value> finish(CommandContext& ctx, const Map& args) {
  return answer(ctx, args, entry_of(ctx, args)->run->finish(ctx.progress));
}
Result<Value> pause(CommandContext& ctx, const Map& args) {
  return answer(ctx, args, rest(ctx, *entry_of(ctx, args)));
}

Result<Value> play(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const double speed, speed_of(*args.find("speed")));
  entry_of(ctx, args)->run->play(speed);
  ctx.app.kept<RunPulse>().wake();
  return answer(ctx, args, {});
}

Result<Value> stop(CommandContext& ctx, const Map& args) {
  entry_of(ctx, args)->run->stop();
  return answer(ctx, args, {});
}

Result<Value> state(CommandContext& ctx, const Map& args) {
  return Value(live_run_state(ctx.app, *entry_of(ctx, args)));
}

Result<Value> recording(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(auto recording,
                 with_start_notes(ctx, entry_of(ctx, args)->run->recording(), false));
  const std::uint64_t number = ctx.app.recordings.add(std::move(recording));
  ctx.app.origins->note_fixed(
      number,
      "it is of a live run, which continues with run:refresh() or begins again with run:reset()");
  return Value(Handle{"recording", number});
}

Result<Value> rows(CommandContext& ctx, const Map& args) {
  const LiveRunPtr run = entry_of(ctx, args);
  std::vector<std::string> names;
  if (const Value* given = args.find("columns"); given && given->as_list())
    for (const Value& v : *given->as_list())
      names.push_back(v.as_string() ? *v.as_string() : v.text());
  std::optional<std::size_t> restarts;
  if (has(args, "restarts")) restarts = static_cast<std::size_t>(integer(args, "restarts"));
  RMP_TRY_ASSIGN(Map out, live_run_rows(*run, static_cast<std::size_t>(integer(args, "from") - 1),
                                        restarts, static_cast<std::size_t>(integer(args, "most")),
                                        kMostRunValues, names));
  return Value(std::move(out));
}

Result<Value> columns(CommandContext& ctx, const Map& args) {
  List out;
  for (const recording::Column& c : entry_of(ctx, args)->run->head().columns)
    out.emplace_back(Map{{"name", c.name}, {"unit", c.unit}, {"doc", c.doc}});
  return Value(std::move(out));
}

Result<Value> remove(CommandContext& ctx, const Map& args) {
  ctx.app.runs->remove(args.find("id")->as_handle()->number);
  return Value();
}

Result<Value> list(CommandContext& ctx, const Map&) {
  List out;
  for (const auto& [number, entry] : ctx.app.runs->list()) {
    const sim::LiveRun::Shown s = entry->run->shown();
    out.emplace_back(Map{{"id", Handle{"run", number}},
                         {"title", entry->title},
                         {"subject", entry->subject},
                         {"time", s.time},
                         {"recorded", s.recorded},
                         {"is_playing", s.speed != 0},
                         {"is_over", s.is_over}});
  }
  return Value(std::move(out));
}

/// Lua of a box that falls on a floor, for examples.
std::string with_fall(const char* rest) {
  return std::string(
             "material.create{name = \"wood\", density = 600}\n"
             "solid.create{name = \"floor\", root = {kind = \"box\", x = 2, y = 2, z = 0.1}}\n"
             "solid.create{name = \"box\", material = \"wood\", root = {kind = \"box\", x = 0.1, "
             "y = 0.1, z = 0.1}}\n"
             "local cell = world.create{name = \"cell\"}\n"
             "cell:add_object{what = \"floor\", position = {0, 0, -0.1}}\n"
             "cell:add_object{what = \"box\", position = {0, 0, 0.5}}\n"
             "local fall = cell:start_run(\"physics\", {duration = 0.5})\n") +
         rest;
}

}  // namespace

RMP_COMMANDS(run_commands) {
  std::vector<CommandSpec> all;
  const ReturnSpec shown{
      "map",
      "",
      "",
      {field("time", "real", "s", "Time shown."),
       field("row", "int", "", "The last row at or before it, 1 = the first."),
       field("rows", "int", "", "Recorded."),
       field("recorded", "real", "s", "Time up to which rows exist."),
       field("speed", "real", "", "Playback speed; 0 if not playing."),
       field("is_playing", "bool", "", "Whether it is playing."),
       field("is_over", "bool", "", "Whether it is shown to its end."),
       field("is_complete", "bool", "", "Whether the computation is complete."),
       field("is_outdated", "bool", "",
             "Whether the world was edited since; run.refresh applies the edits."),
       field("lag", "real", "s", "Time by which the simulation is behind the clock."),
       field("restarts", "int", "", "Number of restarts, or continuations with an edited world."),
       field("error", "string", "", "Why it could not continue; absent if it could."),
       field("values", "map", "", "The row: numbers by column name."),
       field("joints", "map", "", "Joint values by robot."),
       field(
           "axes", "map", "",
           "Values of the maker's axes [deg or mm] by robot and name, of robots with known axes."),
       field("objects", "map", "", "Poses of the moving objects."),
       field("pullable", "list", "", "Names of the objects and robots that run.pull can pull."),
       field("pulls", "list", "",
             "The pulls (run.pull): session; object, or robot and link; to [m]; and of the last "
             "computed step at [m], the pulled point, and force [N].")}};
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
                   .run = run,
                   .runs = run == start ? RunKind::simulation : RunKind::none});
  };
  const ParamSpec with = optional("with", "map", "", "Arguments of the simulation.");
  const ParamSpec entry =
      choice("entry", {"run", "stop", "wait"},
             "run: the programs run; stop: the first one stops before its first statement; wait: "
             "it waits there, and a breakpoint that is set there meanwhile still stops it.");
  const ReturnSpec made{"handle", "", "The run, at its first row.", {}};
  add("world.start_run", "Starts a simulation that can be stepped, played and paused.",
      "It takes the arguments of the command of that simulation: physics those of "
      "world.simulate_physics, dynamics of world.simulate_dynamics, tasks of world.run_task, "
      "recording the recording itself. Physics, dynamics and tasks with programs are computed row "
      "by row while the run plays; other motions, and those with solvers written in Lua, are "
      "computed first and then shown row by row.",
      with_fall("assert(fall:state().rows == 1)\nlocal s = fall:step(10)\n"
                "assert(math.abs(s.time - 0.1) < 1e-9 and s.objects.box.position[3] < 0.5)"),
      {self("world"), choice("of", words_of(kOfWorlds), "Kind of simulation.", true), with, entry},
      made, Effect::simulates, start);
  add("robot.start_run",
      "Starts a simulation of a robot without a world that can be stepped, played and paused.",
      "It takes the arguments of robot.simulate, or a recording.",
      with_arm("local swing = arm:start_run(\"dynamics\", {q = \"ready\", duration = 0.1})\n"
               "assert(swing:finish().is_over)"),
      {self("robot"), choice("of", words_of(kOfRobots), "Kind of simulation.", true), with}, made,
      Effect::simulates, start);
  add("run.step", "Steps forward or back by rows or time, and pauses there.",
      "Rows that are not recorded yet are computed.",
      with_fall("assert(fall:step().row == 2)\nassert(fall:step{time = 0.1}.row == 12)\n"
                "assert(fall:step(-11).row == 1)"),
      {self("run"), defaulted("rows", "int", "", 1, "Number of rows; negative for backwards."),
       optional("time", "real", "s", "Instead of rows: a time; negative for backwards.")},
      shown, Effect::simulates, step_run);
  ParamSpec time = needed("time", "real", "s", "Time to go to; times beyond the end mean the end.");
  time.min = 0;
  add("run.seek", "Goes to a time and pauses there.",
      "Rows that are not recorded yet are computed.",
      with_fall("assert(fall:seek(0.2).row == 21)\nassert(fall:seek(0).rows == 21)"),
      {self("run"), std::move(time)}, shown, Effect::simulates, seek);
  add("run.finish", "Computes to the end and shows it.", "",
      with_fall("local s = fall:finish()\nassert(s.is_over and s.time == 0.5)"), {self("run")},
      shown, Effect::simulates, finish);
  add("run.play", "Starts playback of a run.",
      "It returns at once. Backward playback shows recorded rows, down to the first one.",
      with_fall("assert(fall:play().is_playing)\nfall:pause()\nfall:play(\"max\")\n"
                "fall:finish()\nassert(fall:play(-2).speed == -2)"),
      {self("run"),
       defaulted("speed", "any", "", 1.0,
                 "1 = real time, 2 = twice as fast, \"max\" = as fast as it computes, -1 = "
                 "backwards.")},
      shown, Effect::simulates, play);
  add("run.pause", "Stops the time of a run and its simulation.", "",
      with_fall("fall:play(\"max\")\nlocal rows = fall:pause().rows\n"
                "assert(fall:state().rows == rows and not fall:state().is_playing)"),
      {self("run")}, shown, Effect::simulates, pause);
  add("run.refresh", "Continues from the shown state with the present world.",
      "Later rows are dropped. Objects and driven robots keep place and speed by name, gripped "
      "objects stay gripped, new objects start at their placements. Motions that depend on time "
      "only, such as kinematic ones and tasks, are computed again from their start and continue at "
      "this time; programs get there without a stop, and are at the same statement as before. If "
      "something cannot continue there, this is an error and the run does not change.",
      with_fall("fall:seek(0.1)\ncell:add_object{what = \"box\", name = \"late\", position = "
                "{0.5, 0, 0.3}}\n"
                "assert(fall:state().is_outdated)\nlocal s = fall:refresh()\n"
                "assert(s.objects.late.position[3] == 0.3 and s.objects.box.position[3] < 0.5)\n"
                "assert(fall:step(5).objects.late.position[3] < 0.3)"),
      {self("run")}, shown, Effect::simulates, refresh);
  add("run.reset", "Restarts a run from its beginning with the present world.",
      "No edit is undone. If the run cannot restart, it does not change.",
      with_fall("fall:finish()\ncell:place{member = \"box\", position = {0, 0, 0.2}}\n"
                "local s = fall:reset()\n"
                "assert(s.time == 0 and s.rows == 1 and s.objects.box.position[3] == 0.2)"),
      {self("run"), entry}, shown, Effect::simulates, reset);
  add("run.state", "Reports the state of a run.", "",
      with_fall("assert(fall:state().values[\"box.z\"] == 0.5)"), {self("run")}, shown,
      Effect::reads, state);
  add("run.rows", "Returns recorded rows of a run, from a given one on.",
      "A client can follow a growing run: it requests rows from its last row + 1, with the "
      "restarts of the previous result. After run.refresh or run.reset rows differ; the result "
      "then begins at the first changed row, and replaces the rows from there.",
      with_fall("fall:seek(0.1)\nlocal r = fall:rows{columns = {\"time\", \"box.z\"}}\n"
                "assert(r.count == 11 and #r.columns[\"box.z\"] == 11)\nfall:seek(0.2)\n"
                "local more = fall:rows{from = 12, restarts = r.restarts}\n"
                "assert(more.from == 12 and more.count == 10)"),
      {self("run"),
       between(defaulted("from", "int", "", 1, "The first row to return, 1 = the first."), 1, 9e15),
       between(optional("restarts", "int", "",
                        "The value of restarts for the rows that the caller has."),
               0, 9e15),
       between(defaulted("most", "int", "", 10'000,
                         "Greatest number of rows, with at most 1,000,000 values."),
               1, static_cast<double>(kMostRunValues)),
       optional("columns", "list", "", "Their names; all if omitted.")},
      {"map",
       "",
       "",
       {field("from", "int", "", "The first row returned."),
        field("count", "int", "", "Number of rows returned."),
        field("rows", "int", "", "Number of existing rows."),
        field("restarts", "int", "", "Value for the next call."),
        field("columns", "map", "", "Arrays by column name, in SI units.")}},
      Effect::reads, rows);
  add("run.columns", "Lists the columns of a run's rows with units.", "",
      with_fall("assert(fall:columns()[1].name == \"time\" and fall:columns()[1].unit == \"s\")"),
      {self("run")},
      {"list",
       "",
       "",
       {field("name", "string", "", "Name of the column."), field("unit", "string", "", "SI unit."),
        field("doc", "string", "", "Description of the column.")}},
      Effect::reads, columns);
  add("run.recording", "Returns the rows of a run so far as a recording.",
      "The recording does not grow with the run.",
      with_fall("fall:seek(0.1)\nlocal r = fall:recording()\nassert(#r:values(\"time\") == 11)"),
      {self("run")}, {"handle", "", "The recording.", {}}, Effect::simulates, recording);
  add("run.stop", "Ends the simulation of a run and keeps the recording.", "",
      with_fall("fall:step(3)\nassert(fall:stop().rows == 4)"), {self("run")}, shown,
      Effect::simulates, stop);
  add("run.remove", "Ends and deletes a run.", "",
      with_fall("local count = #run.list()\nfall:remove()\nassert(#run.list() == count - 1)"),
      {self("run")}, {}, Effect::simulates, remove);
  add("run.list", "Lists the live runs.", "",
      with_fall("local all = run.list()\nassert(all[#all].title == \"cell: physics\")"), {},
      {"list",
       "",
       "",
       {field("id", "handle", "", "The run."),
        field("title", "string", "", "Its subject and what it simulates, such as cell: physics."),
        field("subject", "handle", "", "The world or robot that it moves."),
        field("time", "real", "s", "Time shown."),
        field("recorded", "real", "s", "Time up to which rows exist."),
        field("is_playing", "bool", "", "Whether it is playing."),
        field("is_over", "bool", "", "Whether it is shown to its end.")}},
      Effect::reads, list);
  return all;
}

}  // namespace robomosp::ioci
