// SPDX-License-Identifier: Apache-2.0
#include "task/run.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>

#include "kernel/text.h"
#include "task/task_executor.h"

namespace robomosp::task {
namespace {

using model::StepKind;
using model::TaskStep;
using text::quote;

constexpr std::size_t kMostAtOnce = 100'000;  ///< steps without time between

/// The steps of one placed task as they are carried out: blocks and calls on a stack.
class Thread {
 public:
  /// `at` is its place in the world. It has not begun.
  Thread(const document::Snapshot& snapshot, const model::PlacedTask& placed, std::size_t at)
      : place(at), snapshot_(snapshot), placed_(&placed), name_(placed.name) {}
  /// From its first step on, at time t.
  void begin(double t) {
    ready_at = t;
    moved.clear();
    deadline.reset();
    calls_.clear();
    enter(placed_->task, placed_->robot);
  }

  std::size_t place = 0;  ///< in the world
  double ready_at = 0;
  std::string moved;               ///< robot whose move it waits for; "" = it waits for none
  std::optional<double> deadline;  ///< of the wait it is in

  /// Leaves finished blocks and calls; false = the task is over.
  bool has_step() {
    while (!calls_.empty()) {
      Call& c = calls_.back();
      if (c.at < c.task->steps.size()) return true;
      calls_.pop_back();
    }
    return false;
  }
  [[nodiscard]] const TaskStep& step() const { return calls_.back().task->steps[calls_.back().at]; }
  [[nodiscard]] const std::string& robot() const {
    return step().robot.empty() ? calls_.back().robot : step().robot;
  }
  /// `task "left", step 3 (wait)`
  [[nodiscard]] std::string where() const {
    std::string s = "task " + quote(name_);
    for (std::size_t i = 1; i < calls_.size(); ++i) s += " > " + quote(calls_[i].name);
    return s + ", step " + std::to_string(calls_.back().at + 1) + " (" +
           std::string(to_string(step().kind)) + ")";
  }
  void next() { go_to(end_of(calls_.back().at)); }
  /// Into the block that the step is.
  void into(std::int64_t times) {
    Call& c = calls_.back();
    const std::size_t end = end_of(c.at);
    if (times <= 0 || end == c.at + 1) return go_to(end);
    c.open.push_back({c.at, end, times});
    ++c.at;
  }
  /// Past the `when` that the step is, into its `otherwise` if it has one.
  void past() {
    Call& c = calls_.back();
    const std::size_t end = end_of(c.at);
    const bool has_else = end < c.task->steps.size() &&
                          c.task->steps[end].kind == StepKind::otherwise &&
                          c.task->steps[end].parent == c.task->steps[c.at].parent;
    if (!has_else) return go_to(end);
    c.at = end;
    into(1);
  }
  void call() {
    const TaskId task = step().task;
    const std::string with = robot();
    next();
    enter(task, with);
  }

 private:
  struct Block {
    std::size_t at = 0, end = 0;
    std::int64_t left = 1;
  };
  struct Call {
    const model::Task* task = nullptr;
    std::string name, robot;
    std::size_t at = 0;
    std::vector<Block> open;
  };
  void enter(TaskId id, const std::string& robot) {
    const model::Task* task = snapshot_.get(id);
    if (task) calls_.push_back({task, snapshot_.find(AnyId(id))->name, robot, 0, {}});
  }
  [[nodiscard]] std::size_t end_of(std::size_t i) const {
    const auto& steps = calls_.back().task->steps;
    std::size_t end = i + 1;
    while (end < steps.size() && steps[end].parent >= static_cast<std::int32_t>(i)) ++end;
    return end;
  }
  void go_to(std::size_t at) {
    Call& c = calls_.back();
    while (!c.open.empty() && at >= c.open.back().end) {
      if (--c.open.back().left > 0) {
        at = c.open.back().at + 1;
        break;
      }
      c.open.pop_back();
    }
    c.at = at;
  }

  const document::Snapshot& snapshot_;
  const model::PlacedTask* placed_;
  std::string name_;
  std::vector<Call> calls_;
};

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr double kNear = 1e-9;                   ///< times this near are the same [s]
constexpr std::uint64_t kBytesOfMachine = 2000;  ///< about, beside its variables
constexpr std::size_t kFewRows = 8;              ///< are kept, whatever they take

class Runner {
 public:
  Runner(TaskExecutor& executor, std::vector<Thread>& threads, std::vector<ProgramActor>& programs,
         const TaskRun& wanted, Progress& progress)
      : executor_(executor),
        threads_(threads),
        programs_(programs),
        seen_(programs.size()),
        most_(wanted.most_time),
        duration_(wanted.duration),
        has_outside_(wanted.outside != nullptr),
        progress_(progress) {}

  enum class End { over, limit, stopped };
  [[nodiscard]] double now() const { return now_; }
  [[nodiscard]] std::size_t stopped_at() const { return stopped_at_; }
  /// Whether only somebody outside could make anything happen.
  [[nodiscard]] bool is_idle() const { return is_idle_; }
  /// Until all is over, to a time, or to where a debugger stops a program.
  Result<End> run_to(double limit) {
    limit_ = limit;
    for (;;) {
      if (progress_.cancelled()) return error(ErrorCode::cancelled, "the run was cancelled");
      RMP_TRY_ASSIGN(const bool is_stopped, all_at_once());
      if (is_stopped) return End::stopped;
      RMP_TRY(executor_.refresh_following(now_));
      for (Thread& thread : threads_)
        if (thread.ready_at > now_ && !thread.moved.empty())
          thread.ready_at = std::max(now_, executor_.busy_until(thread.moved));
      double next = kNever;
      bool is_over = true;
      for (const ProgramActor& p : programs_) {
        const auto at = p.next_time(now_, next_row());
        if (!p.is_over() || at) is_over = false;
        if (at) next = std::min(next, *at);
      }
      for (Thread& thread : threads_) {
        if (!thread.has_step() && thread.ready_at <= now_) continue;
        is_over = false;
        if (thread.ready_at > now_) next = std::min(next, thread.ready_at);
        else if (thread.deadline) next = std::min(next, *thread.deadline);
      }
      if (is_over || is_checked()) return End::over;
      RMP_TRY_ASSIGN(next, before_event(next));
      if (duration_ > 0 && next > duration_ && limit >= duration_) {
        RMP_TRY(go_to(duration_));
        return End::over;
      }
      const double step = executor_.next_step(now_);
      is_idle_ = next == kNever && !is_searched_in_part_;
      if (next == kNever && !(is_searched_in_part_ && std::min(limit, step) < most_) &&
          !has_outside_) {
        if (const auto waived = waive()) {
          if (*waived) continue;
          return End::over;
        }
        return stuck();
      }
      next = std::min(next, step);
      if (next > most_ && inspected()) {
        for (ProgramActor& p : programs_)
          if (p.inspection()) p.inspection()->is_out_of_time = true;
        now_ = most_;
        return End::over;
      }
      if (std::min(next, limit) > most_)
        return error(ErrorCode::conflict,
                     (programs_.empty() ? "the tasks take longer than "
                                        : "the tasks and programs take longer than ") +
                         text::print_rounded(most_) + " s",
                     "Give a larger most_time" +
                         std::string(programs_.empty() ? "." : ", or a duration at which to end."));
      if (next > limit) {
        RMP_TRY(go_to(std::max(now_, limit)));
        return End::limit;
      }
      RMP_TRY(go_to(next));
    }
  }

 private:
  Result<void> go_to(double t) {
    RMP_TRY(executor_.go_to(t, progress_));
    now_ = t;
    return {};
  }
  [[nodiscard]] double next_row() const {
    const double step = executor_.step();
    return step * (std::floor(now_ / step * (1 + 1e-12)) + 1);
  }
  /// Whether there is anything for a program to do now.
  [[nodiscard]] bool is_due(std::size_t i) const {
    const ProgramActor& p = programs_[i];
    const Seen& s = seen_[i];
    if (!s.has_begun) return true;
    if (p.is_over()) return false;
    if (s.changes != executor_.changes()) return true;
    const auto at = p.next_time(now_, kNever);
    return (at && *at <= now_) || s.row < next_row();
  }
  /// Steps of all tasks, and programs, until each takes time, waits or is over. True = a debugger
  /// has stopped a program.
  Result<bool> all_at_once() {
    std::size_t count = 0;
    for (bool is_going = true; is_going;) {
      is_going = false;
      for (std::size_t i = 0; i < programs_.size(); ++i) {
        if (!is_due(i)) continue;
        if (++count > kMostAtOnce)
          return error(ErrorCode::conflict,
                       "program " + quote(programs_[i].name()) + ", " + programs_[i].where() +
                           " loops endlessly without waiting at t = " + text::print_rounded(now_) +
                           " s",
                       "Add a WAIT or a motion to the loop.");
        // What it changes itself it has seen, but for what it wrote while others waited.
        seen_[i] = {true, executor_.changes(), next_row()};
        RMP_TRY(programs_[i].run(executor_, now_, progress_));
        is_going = true;
        if (programs_[i].is_stopped() || programs_[i].is_asking()) {
          stopped_at_ = i;
          return true;
        }
      }
      for (Thread& thread : threads_) {
        if (executor_.started()[thread.place].is_wanted) {
          executor_.task_begins(thread.place);
          thread.begin(now_);
          is_going = true;
        }
        while (thread.ready_at <= now_ && thread.has_step()) {
          const std::string where = thread.where();
          if (++count > kMostAtOnce)
            return error(ErrorCode::conflict,
                         where + " is repeated endlessly without waiting at t = " +
                             text::print_rounded(now_) + " s",
                         "Add a wait or a move to the repeat.");
          auto done = one(thread, where);
          if (!done.ok()) {
            Error e = std::move(done).error();
            return e.where.starts_with(where) ? e : std::move(e).in(where);  // moves know it
          }
          if (!*done) break;
          is_going = true;
        }
        if (executor_.started()[thread.place].is_running && !thread.has_step() &&
            thread.ready_at <= now_) {
          executor_.task_ends(thread.place);
          is_going = true;
        }
      }
    }
    return false;
  }
  /// False = it waits.
  Result<bool> one(Thread& thread, const std::string& where) {
    const TaskStep& s = thread.step();
    switch (s.kind) {
      case StepKind::move: {
        RMP_TRY_ASSIGN(thread.ready_at, executor_.move(s, thread.robot(), where, now_, progress_));
        thread.moved = thread.robot();
        thread.next();
        return true;
      }
      case StepKind::attach: RMP_TRY(executor_.attach(s, thread.robot(), now_, progress_)); break;
      case StepKind::detach: RMP_TRY(executor_.detach(s.object, now_)); break;
      case StepKind::set: RMP_TRY(executor_.set(s.signal, s.expression, now_)); break;
      case StepKind::wait: {
        if (s.expression.empty()) {
          thread.ready_at = now_ + s.duration;
          thread.moved.clear();
          break;
        }
        RMP_TRY_ASSIGN(const bool is_met, executor_.is_true(s.expression, now_));
        if (!is_met) {
          if (s.timeout > 0 && !thread.deadline) thread.deadline = now_ + s.timeout;
          if (!thread.deadline || now_ < *thread.deadline) return false;
          return error(ErrorCode::conflict,
                       quote(s.expression) + " did not come true within " +
                           text::print_rounded(s.timeout) + " s",
                       "Give a longer timeout, or set its signals in another task.");
        }
        thread.deadline.reset();
        break;
      }
      case StepKind::call: thread.call(); return true;
      case StepKind::repeat: thread.into(s.count); return true;
      case StepKind::when: {
        RMP_TRY_ASSIGN(const bool is_met, executor_.is_true(s.expression, now_));
        if (is_met) thread.into(1);
        else thread.past();
        return true;
      }
      case StepKind::otherwise: break;  // reached behind a `when` that was carried out
      case StepKind::message: executor_.note(now_, s.text); break;
    }
    thread.next();
    return true;
  }
  /// When a condition over time or places turns true before `next`, the time of the next event.
  Result<double> before_event(double next) {
    const double step = executor_.next_step(now_);
    const bool is_still = std::isinf(next) && std::isinf(step);
    waits_for_time_ = is_searched_in_part_ = false;
    for (Thread& thread : threads_) {
      if (thread.ready_at > now_ || !thread.has_step()) continue;  // it waits for no condition
      const std::string& condition = thread.step().expression;
      auto found = [&]() -> Result<std::optional<double>> {
        RMP_TRY_ASSIGN(const TaskExecutor::Watched watched, executor_.watched(condition));
        if (!watched.time && (is_still || !watched.motion)) return std::optional<double>{};
        waits_for_time_ = waits_for_time_ || watched.time;
        const double seen = std::min(limit_, step);  // what can be known now
        is_searched_in_part_ = is_searched_in_part_ || seen < std::min(next, most_);
        return executor_.first_true(condition, now_, std::min({next, most_, seen}), progress_);
      }();
      if (!found.ok()) return std::move(found).error().in(thread.where());
      if (*found) next = **found;
    }
    return next;
  }
  // ---- of checks ----
  [[nodiscard]] bool inspected() const {
    return std::any_of(programs_.begin(), programs_.end(),
                       [](const ProgramActor& p) { return p.inspection() != nullptr; });
  }
  /// The programs that are checked are over, with their last motions.
  [[nodiscard]] bool is_checked() const {
    return inspected() && std::all_of(programs_.begin(), programs_.end(), [&](const auto& p) {
             return !p.inspection() || (p.is_over() && !p.next_time(now_, kNever));
           });
  }
  /// Lets programs that are checked pass waits that nothing ends; whether one goes on. Nothing =
  /// none is checked.
  std::optional<bool> waive() {
    if (!inspected()) return std::nullopt;
    bool goes_on = false;
    for (std::size_t i = 0; i < programs_.size(); ++i)
      if (programs_[i].inspection() && programs_[i].waive(now_)) {
        goes_on = true;
        seen_[i].row = 0;
      }
    return goes_on;
  }
  /// All that are left wait for conditions, and nothing is left that could make one true.
  Error stuck() {
    std::string message;
    for (Thread& thread : threads_)
      if (thread.has_step())
        message += (message.empty() ? "" : "; ") + thread.where() + " waits for " +
                   quote(thread.step().expression);
    std::vector<std::string> hints;
    if (!message.empty()) hints.emplace_back("Make a task set these signals first.");
    for (const ProgramActor& p : programs_) {
      if (p.is_over()) continue;
      const ProgramActor::Stuck stuck = p.stuck();
      for (const std::string& w : stuck.waits) message += (message.empty() ? "" : "; ") + w;
      for (const std::string& h : stuck.hints)
        if (std::find(hints.begin(), hints.end(), h) == hints.end()) hints.push_back(h);
    }
    std::string hint;
    for (const std::string& h : hints) hint += (hint.empty() ? "" : " ") + h;
    if (waits_for_time_)
      return error(
          ErrorCode::conflict,
          message + ", which does not come true within " + text::print_rounded(most_) + " s",
          "Change the condition, or give a larger most_time.");
    return error(
        ErrorCode::conflict,
        message + ", which can never come true after t = " + text::print_rounded(now_) + " s",
        hint);
  }

  struct Seen {
    bool has_begun = false;
    std::size_t changes = 0;
    double row = 0;  ///< the row behind the instant of its last run [s]
  };

  TaskExecutor& executor_;
  std::vector<Thread>& threads_;
  std::vector<ProgramActor>& programs_;
  std::vector<Seen> seen_;
  double most_, duration_, now_ = 0, limit_ = kNever;
  std::size_t stopped_at_ = 0;
  const bool has_outside_;
  bool is_idle_ = false;
  bool is_searched_in_part_ = false;  ///< some condition, only up to limit_
  bool waits_for_time_ = false;       ///< some task, for more than signals
  Progress& progress_;
};

/// The rows at these times, with the programs' lines.
recording::Recording rows_of(const std::vector<ProgramActor>& programs, recording::Recording table,
                             const std::string& title) {
  table.title = title;
  for (const ProgramActor& p : programs) {
    recording::Column c{p.name() + ".line", "", "line of " + p.name() + " being executed", {}};
    for (const double t : table.columns.front().values) c.values.push_back(p.line_at(t));
    table.columns.push_back(std::move(c));
  }
  return table;
}

std::uint64_t bytes_of(const ProgramWatch::Row& row) {
  std::uint64_t n = 0;
  for (const program::Machine& m : row.machines) n += m.bytes() + kBytesOfMachine;
  return n;
}

/// The machines as they are now, as a row; stops at one time have one each.
void keep_row(ProgramWatch& watch, double now, bool is_new) {
  if (is_new || watch.is_stopped || watch.rows.back().is_stopped) watch.rows.emplace_back();
  else watch.bytes -= bytes_of(watch.rows.back());
  ProgramWatch::Row& row = watch.rows.back();
  row.time = now;
  row.is_stopped = watch.is_stopped;
  row.stopped_at = watch.stopped_at;
  row.machines.clear();
  for (const ProgramActor& p : watch.programs) row.machines.push_back(p.machine());
  watch.bytes += bytes_of(row);
  if (watch.bytes <= kMostWatchedBytes || watch.rows.size() < kFewRows) return;
  // The latest stay as they are; of the older ones every second goes.
  std::vector<ProgramWatch::Row> kept;
  const std::size_t late = watch.rows.size() - kFewRows / 2;
  watch.bytes = 0;
  for (std::size_t i = 0; i < watch.rows.size(); ++i) {
    if (i % 2 == 1 && i < late) continue;
    watch.bytes += bytes_of(watch.rows[i]);
    kept.push_back(std::move(watch.rows[i]));
  }
  watch.rows = std::move(kept);
}

/// Whether a program that stands now does so as another run stood.
bool stands_as(const ProgramWatch::Stand& stand, const ProgramActor& p) {
  if (p.is_stopped()) return true;  // nothing else stops it on the way there
  if (!stand.stopped || stand.programs[*stand.stopped].first != p.name()) return false;
  const program::Machine& stood = stand.programs[*stand.stopped].second;
  if (stood.status().state == program::RunState::stopped) return false;
  return !p.machine().has_instructions_of(stood) ||
         p.machine().instructions() >= stood.instructions();
}

/// A run, row by row. With `from`, nothing = it would not stand there `exactly` as it stood.
Result<std::optional<recording::RecordingPtr>> run_rows(
    Runner& runner, TaskExecutor& executor, std::vector<ProgramActor>& programs,
    const TaskRun& wanted, const std::string& title, sim::RowSink& sink, ProgramWatch* watch,
    std::unique_lock<std::mutex>& lock, std::optional<double> from, bool exactly) {
  using Done = std::optional<recording::RecordingPtr>;
  const double begin = from.value_or(0), near = kNear * std::max(1.0, begin);
  std::size_t told = 0;    // notes of the run before
  std::size_t handed = 0;  // notes behind them that the sink has
  const auto table_at = [&](double t, std::size_t before) {
    return rows_of(programs, executor.table({t}, told + before), title);
  };
  const auto run_to = [&](double t) -> Result<Runner::End> {
    RMP_TRY_ASSIGN(const Runner::End end, runner.run_to(t));
    if (from && end == Runner::End::over && runner.now() < begin - near)
      return sim::over_before(runner.now(), begin);
    return end;
  };
  const auto set_breakpoints = [&] {
    if (!watch || !watch->begin) return;
    for (const std::string& n : watch->begin(programs)) executor.note(runner.now(), n);
  };
  bool has_begun = false;
  double last = -1;
  for (std::size_t k = 0;;) {
    double row = wanted.sample_time * static_cast<double>(k);
    const bool arrives = !has_begun && (!from || row >= begin - near);
    bool is_armed = false;
    if (arrives && from) {
      if (row > begin + near) row = begin;
      // All that happens there is still to come.
      if (begin > near) RMP_TRY(run_to(begin - near));
      if (watch && watch->stand && watch->stand->stopped) {
        const auto& [name, machine] = watch->stand->programs[*watch->stand->stopped];
        for (ProgramActor& p : programs) {
          if (p.name() != name) continue;
          is_armed = exactly && p.machine().stop_as(machine, begin + near, true);
          if (!is_armed) p.machine().stop_as(machine, begin + near, false);
        }
      }
    }
    if (arrives && watch) {
      for (ProgramActor& p : programs) p.set_attended(true);
      if (!from) set_breakpoints();
    }
    if (watch) watch->is_stopped = false;
    RMP_TRY_ASSIGN(Runner::End end, run_to(row));
    if (arrives && from) {
      const auto passes = [&] {
        const ProgramActor& p = programs[runner.stopped_at()];
        return watch && !p.wants_line() && !(watch->stand && stands_as(*watch->stand, p));
      };
      while (end == Runner::End::stopped && passes()) {
        RMP_TRY_ASSIGN(end, run_to(row));
      }
      if (is_armed && end != Runner::End::stopped) return Done{};
      told = executor.notes().size();
      set_breakpoints();
    }
    has_begun = has_begun || arrives;
    const double now = runner.now();
    const bool is_stopped = end == Runner::End::stopped;
    if (watch) {
      watch->now = now, watch->is_stopped = is_stopped, watch->stopped_at = runner.stopped_at();
      keep_row(*watch, now, now > last);
    }
    // An end that is no farther from a row than that is the row.
    const bool is_new = now > last + (end == Runner::End::over ? kNear : 0);
    const bool is_taken = is_new && now >= begin - near;
    const bool is_short = (is_taken || is_stopped) && sink.has_notes(handed);
    const recording::Recording table = table_at(now, is_short ? handed : 0);
    if (is_taken || is_stopped) handed = executor.notes().size() - told;
    if (lock.owns_lock()) lock.unlock();
    if (is_taken) {
      if (is_stopped) sink.rest_behind_next();
      auto state = std::make_shared<sim::RunState>();
      state->time = now;
      RMP_TRY(sink.take(table, 0, std::move(state)));
    } else if (is_stopped) {
      RMP_TRY(sink.rest(table));
    }
    if (watch) lock.lock();
    if (end == Runner::End::over)
      return Done(
          std::make_shared<const recording::Recording>(is_short ? table_at(now, 0) : table));
    if (is_new) last = now;
    if (!is_stopped && row >= wanted.sample_time * static_cast<double>(k) - near) ++k;
  }
}

/// The tasks that a run is asked for; none has begun.
Result<std::vector<Thread>> threads_of(const document::Snapshot& snapshot,
                                       const model::World& world, const TaskRun& wanted) {
  std::vector<std::string> known;
  for (const auto& t : world.tasks) known.push_back(t.name);
  std::vector<Thread> threads;
  if (!wanted.has_tasks) return threads;
  for (const std::string& name : wanted.tasks.empty() ? known : wanted.tasks) {
    const auto it = std::find(known.begin(), known.end(), name);
    if (it == known.end()) {
      std::string hint = text::did_you_mean(name, known);
      if (hint.empty())
        hint = known.empty() ? "Add one with world.add_task."
                             : "It has " + text::enumerate(known) + ".";
      return error(ErrorCode::unknown_name, "the world has no task " + quote(name), hint);
    }
    const auto at = static_cast<std::size_t>(it - known.begin());
    threads.emplace_back(snapshot, world.tasks[at], at);
  }
  return threads;
}

/// One attempt of run(): nothing = to be repeated not `exactly`.
Result<std::optional<recording::RecordingPtr>> run_once(const sim::Simulator& sim,
                                                        const TaskRun& wanted, Progress& progress,
                                                        sim::RowSink* sink, ProgramWatch* watch,
                                                        std::optional<double> from, bool exactly) {
  RMP_TRY_ASSIGN(TaskExecutor executor,
                 TaskExecutor::create(sim, wanted.world, wanted.sample_time, progress));
  if (wanted.physics) RMP_TRY(executor.add_physics(*wanted.physics, progress));
  const model::World& world = *sim.snapshot.get(wanted.world);
  RMP_TRY_ASSIGN(std::vector<Thread> threads, threads_of(sim.snapshot, world, wanted));
  if (threads.empty() && wanted.programs.empty())
    return error(ErrorCode::invalid_argument, "the world has no task or program to run",
                 "Add one with world.add_task or world.add_program.");
  std::vector<ProgramActor> own, &programs = watch ? watch->programs : own;
  std::vector<ProgramActor> made;
  for (const ProgramInWorld& p : wanted.programs) {
    std::vector<std::string> notes;
    RMP_TRY_ASSIGN(ProgramActor actor, ProgramActor::create(executor, p, notes));
    for (const std::string& n : notes) executor.note(0, n);
    for (const std::size_t task : actor.tasks()) {
      if (std::none_of(threads.begin(), threads.end(),
                       [&](const Thread& t) { return t.place == task; }))
        threads.emplace_back(sim.snapshot, world.tasks[task], task);
      executor.give_to_program(task);
      executor.note(0, "task " + quote(world.tasks[task].name) + " begins when program " +
                           quote(actor.name()) + " starts it");
    }
    made.push_back(std::move(actor));
  }
  for (Thread& t : threads)
    if (!executor.started()[t.place].is_of_program) t.begin(0);
  std::unique_lock<std::mutex> lock;
  if (watch) lock = std::unique_lock(watch->mutex);
  programs = std::move(made);
  Runner runner(executor, threads, programs, wanted, progress);
  const std::string title =
      sim.snapshot.find(AnyId(wanted.world))->name + (programs.empty()  ? ": tasks"
                                                      : threads.empty() ? ": programs"
                                                                        : ": tasks and programs");
  if (!sink) {
    const auto recorded =
        [&](recording::Recording table) -> std::optional<recording::RecordingPtr> {
      return std::make_shared<const recording::Recording>(
          rows_of(programs, std::move(table), title));
    };
    if (wanted.outside) {
      for (std::size_t k = 0;; ++k) {
        RMP_TRY_ASSIGN(const Runner::End end,
                       runner.run_to(wanted.sample_time * static_cast<double>(k)));
        const bool is_over = end != Runner::End::limit;
        RMP_TRY(wanted.outside->row(executor, programs, runner.now(), runner.is_idle(), is_over));
        if (is_over) return recorded(executor.recording(runner.now()));
      }
    }
    const auto ended = runner.run_to(kNever);
    ProgramInspection* told = nullptr;
    for (ProgramActor& p : programs) {
      if (!p.inspection()) continue;
      told = p.inspection();
      p.finish(runner.now());
    }
    if (!ended.ok()) {
      if (wanted.until_fault) *wanted.until_fault = executor.notes();
      if (!told || ended.error().code == ErrorCode::cancelled) return ended.error();
      told->run_error = ended.error().sentence();
    }
    return recorded(executor.recording(runner.now()));
  }
  if (watch) {
    watch->rows.clear();
    watch->bytes = 0;
    watch->chosen.reset();
    for (std::size_t i = 0; i < programs.size(); ++i) {
      programs[i].set_pause_wish(&watch->wants_pause);
      // What was given at the start comes before what is typed.
      const auto [at, is_new] =
          watch->lines.try_emplace(programs[i].name(), wanted.programs[i].lines);
      programs[i].set_lines(&at->second);
    }
  }
  return run_rows(runner, executor, programs, wanted, title, *sink, watch, lock, from, exactly);
}

}  // namespace

Result<recording::RecordingPtr> run(const sim::Simulator& sim, const TaskRun& wanted,
                                    Progress& progress, sim::RowSink* sink, ProgramWatch* watch,
                                    std::optional<double> from) {
  const bool stood = from && watch && watch->stand && watch->stand->stopped;
  auto made = run_once(sim, wanted, progress, sink, watch, from, stood);
  if (made.ok() && !*made) made = run_once(sim, wanted, progress, sink, watch, from, false);
  if (!made.ok()) return std::move(made).error();
  return std::move(**made);
}

}  // namespace robomosp::task
