// SPDX-License-Identifier: Apache-2.0
#include "task/program_actor.h"

#include "task/program_cell.h"

namespace robomosp::task {

Result<void> ProgramActor::advance(TaskExecutor& executor, double now, Progress& progress) {
  ProgramCell cell(*this, executor, now, progress);
  const auto resume = [&] {
    for (const std::uint32_t process : std::exchange(paused_, {})) machine_.resume_pause(process);
  };
  if (std::exchange(is_shown_, false)) resume();
  wants_line_ = false;
  for (int slices = 0;;) {
    const program::Status& s = machine_.run(now, cell);
    note_line(now);
    if (s.state == program::RunState::fault) {
      const program::Fault& f = *s.fault;
      return error(code_, f.message, f.hint,
                   "program " + quote(name()) + ", " + f.file + ":" + std::to_string(f.span.line) +
                       ":" + std::to_string(f.span.column));
    }
    if (s.state == program::RunState::stopped) {
      auto given = presets_.give(machine_);
      if (!given.ok()) return std::move(given).error().in("program " + quote(name()));
      if (*given) continue;
    }
    if (s.state == program::RunState::busy) {
      if (progress.cancelled()) return error(ErrorCode::cancelled, "the run was cancelled");
      if (pause_wish_ && pause_wish_->load()) {
        machine_.pause();
        continue;
      }
      if (++slices < kMostSlices) continue;
      return error(ErrorCode::conflict,
                   "it loops endlessly without waiting at t = " + text::print_rounded(now) + " s",
                   "Add a motion or a WAIT to the loop.",
                   "program " + quote(name()) + ", " + where());
    }
    if (paused_.empty() || s.state != program::RunState::waiting) break;
    if (is_attended_) {
      is_shown_ = true;
      break;
    }
    resume();
  }
  if (!is_stopped()) RMP_TRY(cell.settle());
  if (is_over() && !text_.empty()) {
    executor.note(now, name() + ": " + text_);
    text_.clear();
  }
  if (is_over() && machine_.status().is_halted && !std::exchange(has_told_halt_, true))
    executor.note(now, name() + " is at HALT, " + place_text(machine_.status().halted_at));
  return {};
}

bool ProgramActor::is_over() const {
  return machine_.status().state == program::RunState::over ||
         (inspection_ && inspection_->is_dead);
}
bool ProgramActor::is_stopped() const {
  return machine_.status().state == program::RunState::stopped;
}

std::optional<double> ProgramActor::next_time(double now, double cycle) const {
  const program::Status& s = machine_.status();
  std::optional<double> next;
  const auto at = [&](double t) { next = next ? std::min(*next, t) : t; };
  // A machine that was stopped, or is new, goes on at once.
  if (s.state == program::RunState::busy || s.state == program::RunState::stopped || is_asking())
    return now;
  if (is_over()) {
    // A program that ends while its last motion runs is over when that is.
    for (const auto& [number, open] : open_)
      if (open.end > now + kSame) at(open.end);
    return next;
  }
  for (const program::Wait& w : s.waits) {
    if (w.until) at(std::max(now, *w.until));
    for (const std::uint64_t number : w.motions)
      if (const auto it = open_.find(number); it != open_.end() && !held_.contains(number))
        at(std::max(now, it->second.end));
    if (w.each_cycle) at(cycle);
  }
  if (s.watches_each_cycle) at(cycle);
  return next;
}

bool ProgramActor::waits_for_signals() const {
  const program::Status& s = machine_.status();
  if (!s.watched.empty()) return true;
  return std::any_of(s.waits.begin(), s.waits.end(),
                     [](const program::Wait& w) { return !w.signals.empty(); });
}

ProgramActor::Stuck ProgramActor::stuck() const {
  Stuck out;
  const rmp_code& c = machine_.code();
  for (const program::Wait& w : machine_.status().waits) {
    std::string what, hint;
    switch (w.kind) {
      case program::WaitKind::condition: {
        for (const std::uint32_t s : w.signals)
          what += (what.empty() ? "" : ", ") +
                  std::string(static_cast<const rmp_code_symbol*>(rmp_row(&c.symbols, s))->name);
        hint =
            what.empty()
                ? "Change the condition's variables in another process, or give the wait a TIMEOUT."
                : "Make a task set these signals first.";
        what = what.empty() ? " waits for variables" : " waits for " + what;
        break;
      }
      case program::WaitKind::semaphore: {
        const std::string name = machine_.semaphore_of(w.process);
        what = " waits for " + (name.empty() ? "a semaphore" : "the semaphore " + name);
        hint = "RELEASE it in another process.";
        break;
      }
      case program::WaitKind::stopped:
        what = " is held by STOP";
        hint = "CONTINUE it in another process.";
        break;
      default: continue;
    }
    std::string who = "program " + text::quote(name());
    if (w.process != 0) who += ", process " + machine_.process_name(w.process);
    if (w.kind != program::WaitKind::stopped) who += ", " + place_text(w.span);
    out.waits.push_back(who + what);
    if (std::find(out.hints.begin(), out.hints.end(), hint) == out.hints.end())
      out.hints.push_back(hint);
  }
  if (out.waits.empty()) {
    out.waits.push_back("program " + text::quote(name()) + ", " + where() + " waits");
    out.hints.emplace_back("Make another process or task continue.");
  }
  return out;
}

std::string ProgramActor::where() const {
  const auto calls = machine_.call_stack(0);
  return calls.empty() ? "its end" : place_text(calls.front().span);
}

std::string ProgramActor::place_text(const rmp_span& s) const {
  const rmp_code& c = machine_.code();
  std::string file;
  if (s.file < c.files.count)
    file = static_cast<const rmp_code_file*>(rmp_row(&c.files, s.file))->name;
  return file + ":" + std::to_string(s.line) + ":" + std::to_string(s.column);
}

void ProgramActor::note_line(double t) {
  const program::Status& s = machine_.status();
  std::uint32_t line = s.halted_at.line;
  if (!s.is_halted) {
    const auto at = s.state == program::RunState::over ? std::nullopt : machine_.place_of(0);
    if (!at) return;
    line = at->span.line;
  }
  if (!lines_.empty() && lines_.back().second == line) return;
  if (!lines_.empty() && lines_.back().first == t) lines_.back().second = line;
  else lines_.emplace_back(t, line);
}

double ProgramActor::line_at(double t) const {
  const auto after = std::upper_bound(lines_.begin(), lines_.end(), t,
                                      [](double x, const auto& l) { return x < l.first; });
  return after == lines_.begin() ? 0 : std::prev(after)->second;
}

}  // namespace robomosp::task
