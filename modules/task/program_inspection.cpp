// SPDX-License-Identifier: Apache-2.0
// Programs that are checked: they go on behind what would end them.
#include "task/program_inspection.h"

#include <algorithm>

#include "task/program_actor.h"

namespace robomosp::task {

ProgramPlace ProgramActor::place(std::uint32_t process, const rmp_span& span, double now) {
  ProgramPlace out;
  out.span = span;
  out.process = process;
  out.calls = machine_.call_stack(process);
  out.time = now;
  out.count = ++inspection_->counts[{span.file, span.line, span.column}];
  return out;
}

void ProgramActor::tell(InspectedEvent::Kind kind, ProgramPlace where, std::string message,
                        std::string hint, std::vector<std::string> signals) {
  constexpr std::size_t kMost = 10'000;
  auto& all = inspection_->events;
  if (all.size() >= kMost) {
    ++inspection_->events_left_out;
    return;
  }
  all.push_back({kind, std::move(where), std::move(message), std::move(hint), std::move(signals)});
}

Result<void> ProgramActor::run(TaskExecutor& executor, double now, Progress& progress) {
  if (!inspection_) return advance(executor, now, progress);
  if (inspection_->is_dead) return {};
  auto done = advance(executor, now, progress);
  if (done.ok() || done.error().code == ErrorCode::cancelled) return done;
  const program::Status& s = machine_.status();
  ProgramPlace where;
  if (s.fault) {
    where = place(s.fault->process, s.fault->span, now);
    where.calls = s.fault->calls;
  } else {
    const auto calls = machine_.call_stack(0);
    where = place(0, calls.empty() ? rmp_span{} : calls.front().span, now);
  }
  tell(InspectedEvent::Kind::fault, std::move(where), done.error().message, done.error().hint);
  inspection_->is_dead = true;
  return {};
}

bool ProgramActor::waive(double now) {
  if (is_over()) return false;
  bool goes_on = false;
  const auto waits = machine_.status().waits;
  for (const program::Wait& w : waits) {
    const auto calls = machine_.call_stack(w.process);
    const rmp_span span = calls.empty() ? w.span : calls.front().span;
    if (w.kind != program::WaitKind::condition) {
      if (w.kind == program::WaitKind::semaphore || w.kind == program::WaitKind::line)
        tell(InspectedEvent::Kind::stuck, place(w.process, span, now),
             w.kind == program::WaitKind::line
                 ? "READ waits for a line, but a check has no operator"
                 : "ACQUIRE waits for a semaphore that no process releases",
             w.kind == program::WaitKind::line
                 ? "Provide the value with a signal or in the source."
                 : "RELEASE it on every path through the other processes.");
      continue;
    }
    std::vector<std::string> names;
    for (const std::uint32_t s : w.signals) {
      const auto& row = *static_cast<const rmp_code_symbol*>(rmp_row(&machine_.code().symbols, s));
      names.emplace_back(row.name);
    }
    auto& times = inspection_->waived[{span.file, span.line, span.column}];
    constexpr std::size_t kMostTimes = 1000;  // of one wait: a loop that never ends otherwise
    if (++times == 1) {
      std::string list;
      for (const std::string& n : names) list += (list.empty() ? "" : ", ") + n;
      tell(InspectedEvent::Kind::signal, place(w.process, span, now),
           names.empty() ? "WAIT FOR waits for a condition that nothing can change any more"
                         : "WAIT FOR waits for a signal that nothing sets: " + list +
                               (names.size() == 1 ? " does" : " do") + " not change any more",
           names.empty() ? "Change the condition, or give it a TIMEOUT."
                         : "Set it in another program or task of the world, bind it "
                           "(program.bind), or give the wait a TIMEOUT.",
           names);
    }
    if (times <= kMostTimes && machine_.waive_wait(w.process)) goes_on = true;
  }
  if (!goes_on) inspection_->is_dead = true;
  return goes_on;
}

void ProgramActor::finish(double now) {
  ProgramInspection& told = *inspection_;
  told.machine = machine_;
  told.end = now;
  told.is_over = machine_.status().state == program::RunState::over;
  for (const program::EndedWait& w : machine_.timeouts()) {
    ProgramPlace where = place(w.process, w.span, w.time);
    where.calls.clear();
    tell(InspectedEvent::Kind::timeout, std::move(where), "WAIT FOR timed out",
         "Set its signals in another program or task of the world, or give a longer TIMEOUT.");
  }
}

}  // namespace robomosp::task
