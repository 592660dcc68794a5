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
  Thread(const document::Snapshot& snapshot, const model::PlacedTask& placed)
      : snapshot_(snapshot), name_(placed.name) {
    enter(placed.task, placed.robot);
  }

  double ready_at = 0;
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
  std::string name_;
  std::vector<Call> calls_;
};

class Runner {
 public:
  Runner(TaskExecutor& executor, std::vector<Thread>& threads, double most, Progress& progress)
      : executor_(executor), threads_(threads), most_(most), progress_(progress) {}

  /// Gives the time at which all tasks are over.
  Result<double> run() {
    for (;;) {
      if (progress_.cancelled()) return error(ErrorCode::cancelled, "the run was cancelled");
      RMP_TRY(all_at_once());
      constexpr double kNever = std::numeric_limits<double>::infinity();
      double next = kNever;
      bool is_over = true;
      for (Thread& thread : threads_) {
        if (!thread.has_step() && thread.ready_at <= now_) continue;
        is_over = false;
        if (thread.ready_at > now_) next = std::min(next, thread.ready_at);
        else if (thread.deadline) next = std::min(next, *thread.deadline);
      }
      if (is_over) return now_;
      RMP_TRY_ASSIGN(next, before_event(next));
      if (next == kNever) return stuck();
      if (next > most_)
        return error(ErrorCode::invalid_argument,
                     "the tasks take longer than " + text::print_rounded(most_) + " s",
                     "Give a greater most_time.");
      now_ = next;
    }
  }

 private:
  /// Steps of all tasks until each takes time, waits or is over.
  Result<void> all_at_once() {
    std::size_t count = 0;
    for (bool is_going = true; is_going;) {
      is_going = false;
      for (Thread& thread : threads_)
        while (thread.ready_at <= now_ && thread.has_step()) {
          const std::string where = thread.where();
          if (++count > kMostAtOnce)
            return error(
                ErrorCode::conflict,
                where + " is repeated without end at t = " + text::print_rounded(now_) + " s",
                "Put a wait or a move into the repeat.");
          auto done = one(thread, where);
          if (!done.ok()) {
            Error e = std::move(done).error();
            return e.where.starts_with(where) ? e : std::move(e).in(where);  // moves know it
          }
          if (!*done) break;
          is_going = true;
        }
    }
    return {};
  }
  /// False = it waits.
  Result<bool> one(Thread& thread, const std::string& where) {
    const TaskStep& s = thread.step();
    switch (s.kind) {
      case StepKind::move: {
        RMP_TRY_ASSIGN(thread.ready_at, executor_.move(s, thread.robot(), where, now_, progress_));
        thread.next();
        return true;
      }
      case StepKind::attach: RMP_TRY(executor_.attach(s, thread.robot(), now_)); break;
      case StepKind::detach: RMP_TRY(executor_.detach(s.object, now_)); break;
      case StepKind::set: RMP_TRY(executor_.set(s.signal, s.expression, now_)); break;
      case StepKind::wait: {
        if (s.expression.empty()) {
          thread.ready_at = now_ + s.duration;
          break;
        }
        RMP_TRY_ASSIGN(const bool is_met, executor_.is_true(s.expression, now_));
        if (!is_met) {
          if (s.timeout > 0 && !thread.deadline) thread.deadline = now_ + s.timeout;
          if (!thread.deadline || now_ < *thread.deadline) return false;
          return error(ErrorCode::conflict,
                       quote(s.expression) + " did not come true within " +
                           text::print_rounded(s.timeout) + " s",
                       "Give a longer timeout, or let another task set its signals.");
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
    const bool is_still = std::isinf(next);
    waits_for_time_ = false;
    for (Thread& thread : threads_) {
      if (thread.ready_at > now_ || !thread.has_step()) continue;  // it waits for no condition
      const std::string& condition = thread.step().expression;
      auto found = [&]() -> Result<std::optional<double>> {
        RMP_TRY_ASSIGN(const TaskExecutor::Watched watched, executor_.watched(condition));
        if (!watched.time && (is_still || !watched.motion)) return std::optional<double>{};
        waits_for_time_ = waits_for_time_ || watched.time;
        return executor_.first_true(condition, now_, std::min(next, most_), progress_);
      }();
      if (!found.ok()) return std::move(found).error().in(thread.where());
      if (*found) next = **found;
    }
    return next;
  }
  /// All that are left wait for conditions, and nothing is left that could make one true.
  Error stuck() {
    std::string message;
    for (Thread& thread : threads_)
      if (thread.has_step())
        message += (message.empty() ? "" : "; ") + thread.where() + " waits for " +
                   quote(thread.step().expression);
    if (waits_for_time_)
      return error(
          ErrorCode::conflict,
          message + ", which does not come true within " + text::print_rounded(most_) + " s",
          "Change the condition, or give a greater most_time.");
    return error(
        ErrorCode::conflict,
        message + ", which can never come true after t = " + text::print_rounded(now_) + " s",
        "Let a task set these signals before.");
  }

  TaskExecutor& executor_;
  std::vector<Thread>& threads_;
  double most_, now_ = 0;
  bool waits_for_time_ = false;  ///< some task, for more than signals
  Progress& progress_;
};

}  // namespace

Result<recording::RecordingPtr> run(const sim::Simulator& sim, const TaskRun& wanted,
                                    Progress& progress) {
  RMP_TRY_ASSIGN(TaskExecutor executor,
                 TaskExecutor::create(sim, wanted.world, wanted.sample_time, progress));
  const model::World& world = *sim.snapshot.get(wanted.world);
  std::vector<std::string> known;
  for (const auto& t : world.tasks) known.push_back(t.name);
  std::vector<Thread> threads;
  threads.reserve(world.tasks.size());
  for (const std::string& name : wanted.tasks.empty() ? known : wanted.tasks) {
    const auto it = std::find(known.begin(), known.end(), name);
    if (it == known.end()) {
      std::string hint = text::did_you_mean(name, known);
      if (hint.empty())
        hint = known.empty() ? "world.add_task gives it one."
                             : "It has " + text::enumerate(known) + ".";
      return error(ErrorCode::unknown_name, "the world has no task " + quote(name), hint);
    }
    threads.emplace_back(sim.snapshot, world.tasks[static_cast<std::size_t>(it - known.begin())]);
  }
  if (threads.empty())
    return error(ErrorCode::invalid_argument, "the world has no task to run",
                 "world.add_task gives it one.");
  Runner runner(executor, threads, wanted.most_time, progress);
  RMP_TRY_ASSIGN(const double end, runner.run());
  auto out = std::make_shared<recording::Recording>(executor.recording(end));
  out->title = sim.snapshot.find(AnyId(wanted.world))->name + ": tasks";
  return recording::RecordingPtr(std::move(out));
}

}  // namespace robomosp::task
