// SPDX-License-Identifier: Apache-2.0
// Statements about processes and interrupts, and where debuggers stop a program.
#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "program/state.h"

namespace robomosp::program {

/// Processes, interrupts, HALT.
bool Run::control(Process& p, const Op& o) {
  ++s_.progress;
  switch (o.code) {
    case Do::start: {
      const std::int32_t priority =
          o.r ? (o.sb == kFrame    ? p.stack.data() + p.frames.back().base
                 : o.sb == kGlobal ? s_.globals.data()
                                   : const_cast<Slot*>(c_.constants.data()))[o.b]
                    .integer()
              : 0;
      if (Process* other = process_of(o.n); other && !other->is_ended)
        return fail(
            "the process " + c_.routine_name(o.n) + " is already running",
            "Wait until GETSTATUS(" + c_.routine_name(o.n) + ") = R_PROCESS_READY, or CANCEL it.");
      start_process(o.n, priority);
      return true;
    }
    case Do::stop:
    case Do::continue_: {
      Process* other = process_of(o.n);
      if (!other || other->is_ended)
        return fail("the process " + c_.routine_name(o.n) + " is not running", "START it first.");
      const bool stops = o.code == Do::stop;
      if (other->is_stopped == stops) return true;
      other->is_stopped = stops;
      if (!stops) wake(*other);
      for (const OpenMotion& m : other->open) {
        if (!stops && is_held(m.number)) continue;  // BRAKE holds it still
        const auto done = stops ? world_->hold_motion(m.number) : world_->resume_motion(m.number);
        if (!done.ok()) return fail(done.error());
      }
      return true;
    }
    case Do::cancel: {
      Process* other = process_of(o.n);
      if (!other || other->is_ended) return true;
      abort_all(*other, AbortReason::cancel);
      other->is_ended = true;
      for (const Frame& f : other->frames)
        if (!release(f.held)) return false;
      return !s_.status.fault;
    }
    case Do::enable: {
      EnabledInterrupt x;
      x.routine = o.n;
      x.priority = o.r ? (o.sb == kFrame    ? p.stack.data() + p.frames.back().base
                          : o.sb == kGlobal ? s_.globals.data()
                                            : const_cast<Slot*>(c_.constants.data()))[o.b]
                             .integer()
                       : 0;
      if (s_.enabled_by.size() <= o.n) s_.enabled_by.resize(c_.routines.size(), kNone);
      if (const std::uint32_t by = s_.enabled_by[o.n]; by != kNone && !s_.processes[by].is_ended) {
        if (s_.processes[by].routine == p.routine) return true;
        return fail("the interrupt " + c_.routine_name(o.n) + " is enabled by " +
                        c_.routine_name(s_.processes[by].routine) + " already",
                    "An interrupt belongs to one process: DISABLE it there first.");
      }
      s_.enabled_by[o.n] = s_.process_at[p.routine];
      const auto before = std::upper_bound(
          p.interrupts.begin(), p.interrupts.end(), x,
          [](const EnabledInterrupt& a, const EnabledInterrupt& b) {
            return a.priority != b.priority ? a.priority > b.priority : a.routine < b.routine;
          });
      p.interrupts.insert(before, x);
      return true;
    }
    default:
      if (o.n >= s_.enabled_by.size() || s_.enabled_by[o.n] == kNone) return true;
      std::erase_if(s_.processes[s_.enabled_by[o.n]].interrupts,
                    [&](const EnabledInterrupt& y) { return y.routine == o.n; });
      s_.enabled_by[o.n] = kNone;
      return true;
  }
}

/// `used` = instructions since the last piece.
bool Run::stops_here(Process& p, std::uint32_t op, std::uint64_t used) {
  if (p.condition_depth) return false;
  const bool is_resumed = s_.resume_op == op && s_.resume_process == p.routine;
  if (is_resumed) {
    s_.resume_op = kNone;
    return false;
  }
  std::string message;
  const auto stop = [&](StopReason reason, std::uint32_t number) {
    Stop x;
    x.message = std::move(message);
    x.reason = reason;
    x.process = p.routine;
    x.breakpoint = number;
    x.span = c_.instruction_of[op] == kNone ? rmp_span{} : c_.instruction(op).span;
    s_.status.stop = x;
    s_.is_stepping = s_.wants_pause = false;
    s_.entry_op = kNone;
    if (reason == StopReason::entry && s_.entry_counts) return true;
    s_.resume_op = op;
    s_.resume_process = p.routine;
    return true;
  };
  const auto no_value = [](const Error& e) {
    return "The condition of the breakpoint has no value here: " + e.message + ".";
  };
  // Breakpoints are not asked before it continues from there.
  if (s_.entry_op == op && s_.entry_counts) return stop(StopReason::entry, 0);
  std::optional<StopReason> reason;
  std::uint32_t number = 0;
  if (s_.entry_op == op) reason = StopReason::entry;
  if (s_.wants_pause) reason = StopReason::pause_wish;
  if (s_.is_stepping) {
    if (s_.step == StepKind::motion) {
      if (c_.ops[op].code == Do::move) reason = StopReason::motion;
    } else if (p.routine == s_.step_process) {
      const rmp_span& at = c_.instruction_of[op] == kNone ? s_.step_from : c_.instruction(op).span;
      const bool is_elsewhere = p.frames.size() != s_.step_depth || at.file != s_.step_from.file ||
                                at.line != s_.step_from.line || at.column != s_.step_from.column;
      const bool is_begin =
          std::binary_search(c_.statement_ops.begin(), c_.statement_ops.end(), op);
      // Behind a call the rest of its statement is no new one.
      const bool is_out = p.frames.size() < s_.step_depth;
      if (s_.step == StepKind::out ? is_out
          : s_.step == StepKind::over
              ? (is_out && is_elsewhere) ||
                    (p.frames.size() == s_.step_depth && is_begin && is_elsewhere)
              : (is_begin && is_elsewhere) || is_out)
        reason = StopReason::step;
    }
  }
  // All that are here count and say what they log, whatever stops it.
  const BreakpointSet* const set = s_.breakpoints.get();
  if (set && op < set->is_at.size() && set->is_at[op])
    for (const std::uint32_t k : set->numbers.at(op)) {
      const Breakpoint& b = set->all.at(k).what;
      if (!b.is_enabled) continue;
      if (const Result<bool> is_so = b.condition.empty() ? true : holds(p, b.condition);
          !is_so.ok()) {
        // It is no hit, and whoever set it learns why.
        if (!reason) {
          reason = StopReason::breakpoint;
          number = k;
          message = no_value(is_so.error());
        }
        continue;
      } else if (!*is_so) {
        continue;
      }
      const std::uint64_t hits = ++own_part(s_.hits)[k];
      if (hits <= b.ignore || (b.until && hits > b.until)) continue;
      if (b.every > 1 && hits % b.every != 0) continue;
      if (!b.log.empty()) {
        say_log(p, op, b.log);
      } else if (!reason) {
        reason = StopReason::breakpoint;
        number = k;
      }
    }
  if (Machine::State::Again& again = s_.again; !reason && again.op != kNone) {
    bool is_there =
        again.op == op && again.process == p.routine &&
        (again.instructions == 0 || again.instructions == s_.instructions + used + cost_);
    if (is_there && !again.condition.empty()) {
      const Result<bool> is_so = holds(p, again.condition);
      is_there = !is_so.ok() || *is_so;
      if (!is_so.ok()) message = no_value(is_so.error());
    }
    if (s_.now <= again.until && is_there) reason = again.reason, number = again.breakpoint;
    if (s_.now > again.until || is_there) again.op = kNone;
  }
  return reason && stop(*reason, number);
}

}  // namespace robomosp::program
