// SPDX-License-Identifier: Apache-2.0
// Processes, what they wait for, and interrupts; the machine as a value.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <utility>

#include "program/state.h"

namespace robomosp::program {

// ---- the machine ----

Machine::Machine(std::shared_ptr<const Code> code, std::shared_ptr<State> state)
    : code_(std::move(code)), state_(std::move(state)) {}
Machine::Machine(const Machine&) = default;
Machine::Machine(Machine&&) noexcept = default;
Machine& Machine::operator=(const Machine&) = default;
Machine& Machine::operator=(Machine&&) noexcept = default;
Machine::~Machine() = default;

/// The state, for changes: copies of the machine keep theirs.
Machine::State& Machine::own() { return own_part(state_); }

void Machine::restart() {
  auto fresh = std::make_shared<State>();
  fresh->breakpoints = state_->breakpoints;
  fresh->next_breakpoint = state_->next_breakpoint;
  fresh->status.state = RunState::busy;
  fresh->globals.resize(code_->globals);
  fresh->keeps_journal = state_->keeps_journal;
  if (fresh->keeps_journal) fresh->has_run.resize(code_->ops.size());
  state_ = std::move(fresh);
}

const rmp_code& Machine::code() const { return code_->tables(); }
const std::shared_ptr<const CompiledProgram>& Machine::compiled() const { return code_->program; }
const Status& Machine::status() const { return state_->status; }
std::uint64_t Machine::instructions() const { return state_->instructions; }
std::uint64_t Machine::looks() const { return state_->looks; }
std::uint64_t Machine::bytes() const {
  constexpr std::uint64_t kBytesOfHit = 64;
  return Run(*code_, *state_, nullptr, nullptr, nullptr).bytes() +
         (state_->hits ? state_->hits->size() * kBytesOfHit : 0);
}

std::vector<std::uint32_t> Machine::processes() const {
  std::vector<std::uint32_t> out;
  if (!state_->has_begun) return {0};
  for (const std::uint32_t k : state_->order)
    if (!state_->processes[k].is_ended) out.push_back(state_->processes[k].routine);
  return out;
}

std::string Machine::semaphore_of(std::uint32_t process) const {
  for (const Process& p : state_->processes) {
    if (p.routine != process || p.is_ended) continue;
    const WaitState* wait = p.wait.kind == Waits::semaphore ? &p.wait : nullptr;
    for (const Frame& f : p.frames)
      for (const WaitState& x : f.put_aside)
        if (!wait && x.kind == Waits::semaphore) wait = &x;
    if (!wait) return {};
    for (std::uint32_t s = 0; s < code_->place_of.size(); ++s) {
      const Place& at = code_->place_of[s];
      if (at.offset == kNone || at.space != kGlobal || at.type >= code_->types.size()) continue;
      if (wait->address >= at.offset && wait->address - at.offset < code_->types[at.type].slots)
        return code_->symbol(s).name;
    }
  }
  return {};
}

bool Machine::resume_pause(std::uint32_t process) {
  for (std::size_t k = 0; k < state_->processes.size(); ++k) {
    const Process& p = state_->processes[k];
    if (p.routine != process || p.is_ended || p.wait.kind != Waits::pause) continue;
    own().processes[k].wait.is_granted = true;
    return true;
  }
  return false;
}

const Status& Machine::run(double now, World& world, const std::atomic<bool>* cancel) {
  const RunState state = state_->status.state;
  if (state == RunState::over || state == RunState::fault) return state_->status;
  Run(*code_, own(), &world, cancel, nullptr).run(now);
  return state_->status;
}

std::string Fault::sentence() const {
  std::string out = file;
  if (span.line) out += ":" + std::to_string(span.line) + ":" + std::to_string(span.column);
  if (!out.empty()) out += ": ";
  out += message;
  if (!out.empty() && out.back() != '.') out += '.';
  if (!hint.empty()) out += " " + hint;
  return out;
}

// ---- processes ----

Process* Run::process_of(std::uint32_t routine) {
  if (routine >= s_.process_at.size() || s_.process_at[routine] == kNone) return nullptr;
  return &s_.processes[s_.process_at[routine]];
}

void Run::count_bytes(Process& p) {
  const std::uint64_t now = p.bytes();
  s_.process_bytes += now - p.counted;
  p.counted = now;
}

bool Run::sleeps(const Process& p) const {
  if (p.is_ended || p.is_stopped || p.used >= c_.limits.slice) return true;
  if (!p.open.empty() || !p.interrupts.empty()) return false;
  switch (p.wait.kind) {
    case Waits::time: return s_.now < p.wait.until;
    case Waits::semaphore:
    case Waits::pause: return !p.wait.is_granted;
    default: return false;
  }
}

void Run::wake(const Process& p) { awake_.emplace(-std::int64_t{p.priority}, p.routine); }

void Run::disable_all(Process& p) {
  for (const EnabledInterrupt& x : p.interrupts)
    if (std::uint32_t& by = s_.enabled_by[x.routine]; by == s_.process_at[p.routine]) by = kNone;
  p.interrupts.clear();
}

void Run::start_process(std::uint32_t routine, std::int32_t priority) {
  const auto is_before = [&](std::uint32_t a, std::uint32_t b) {
    const Process &x = s_.processes[a], &y = s_.processes[b];
    return x.priority != y.priority ? x.priority > y.priority : x.routine < y.routine;
  };
  Process* p = process_of(routine);
  if (p) {
    s_.order.erase(
        std::lower_bound(s_.order.begin(), s_.order.end(), s_.process_at[routine], is_before));
    awake_.erase({-std::int64_t{p->priority}, routine});
  } else {
    if (s_.process_at.size() <= routine) s_.process_at.resize(c_.routines.size(), kNone);
    s_.process_at[routine] = static_cast<std::uint32_t>(s_.processes.size());
    p = &s_.processes.emplace_back();
  }
  disable_all(*p);
  const std::uint64_t used = p->used, counted = p->counted;
  *p = {};
  p->used = used, p->counted = counted;
  p->routine = routine;
  p->priority = priority;
  const std::uint32_t at = s_.process_at[routine];
  s_.order.insert(std::lower_bound(s_.order.begin(), s_.order.end(), at, is_before), at);
  wake(*p);
  const bool has_room = push_frame(*p, routine, 0, FrameKind::call);
  count_bytes(*p);
  if (has_room) p->pc = c_.routines[routine].first;
}

void Run::abort_all(Process& p, AbortReason reason) {
  for (const OpenMotion& m : p.open) {
    const auto done = world_->abort_motion(m.number, reason);
    if (!done.ok()) fail(done.error());
  }
  p.open.clear();
}

bool Run::is_held(std::uint64_t motion) const {
  for (const Process& p : s_.processes) {
    if (p.is_ended || p.level == 0) continue;
    for (const Frame& f : p.frames)
      if (std::find(f.held.begin(), f.held.end(), motion) != f.held.end()) return true;
  }
  return false;
}

bool Run::release(const std::vector<std::uint64_t>& motions) {
  for (const std::uint64_t number : motions) {
    // Of a process that STOP holds it goes on with that.
    const bool is_stopped =
        std::any_of(s_.processes.begin(), s_.processes.end(), [&](const Process& x) {
          return x.is_stopped &&
                 std::any_of(x.open.begin(), x.open.end(),
                             [&](const OpenMotion& m) { return m.number == number; });
        });
    if (is_stopped) continue;
    const auto done = world_->resume_motion(number);
    if (!done.ok()) return fail(done.error());
  }
  return true;
}

/// Forgets motions that are done. False = one of them failed.
bool Run::poll(Process& p) {
  for (std::size_t k = 0; k < p.open.size();) {
    const auto state = world_->motion_state(p.open[k].number);
    if (!state.ok()) {
      p_ = &p;
      at_ = p.pc;
      const rmp_span span = p.open[k].span;
      p.open.erase(p.open.begin() + static_cast<std::ptrdiff_t>(k));
      fail(state.error());
      if (s_.status.fault) {
        s_.status.fault->span = span;
        if (!s_.status.fault->calls.empty()) s_.status.fault->calls.front().span = span;
      }
      return false;
    }
    if (*state == MotionState::done) {
      p.open.erase(p.open.begin() + static_cast<std::ptrdiff_t>(k));
      ++s_.progress;
    } else {
      ++k;
    }
  }
  return true;
}

/// Runs a condition from an op up to its end, in the innermost frame.
Run::Next Run::condition(Process& p, std::uint32_t op) {
  const std::uint32_t pc = p.pc;
  const std::size_t depth = p.condition_depth;
  p.condition_depth = p.frames.size();
  p.pc = op;
  // A condition has a slice of its own: it is not put off.
  const std::uint64_t used = std::exchange(p.used, 0);
  const Next next = execute(p);
  p.used += used;
  p.condition_depth = depth;
  if (next == Next::condition_true || next == Next::condition_false) {
    p.pc = pc;
    return next;
  }
  if (!s_.status.fault && s_.status.state != RunState::cancelled) {
    p_ = &p;
    at_ = p.pc;
    fail("a condition of UNTIL or WHEN does not end", "It may only compute.");
  }
  return Next::stop;
}

/// Looks at the conditions of a process's interrupts. True = one of them has begun.
bool Run::interrupts(Process& p) {
  std::int32_t running = 0;
  bool is_in_one = false;
  for (const Frame& f : p.frames)
    if (f.kind == FrameKind::interrupt) {
      running = f.priority;
      is_in_one = true;
    }
  for (std::size_t k = 0; k < p.interrupts.size(); ++k) {
    const std::uint32_t routine = p.interrupts[k].routine;
    const std::int32_t priority = p.interrupts[k].priority;
    const bool may_begin = !is_in_one || priority > running;
    bool is_due = p.interrupts[k].is_pending;
    if (p.interrupts[k].looked != s_.progress) {
      // In a frame of its own, which stays if it begins.
      if (!push_frame(p, routine, p.pc, FrameKind::interrupt)) return false;
      const Next next = condition(p, c_.routines[routine].first);
      if (next == Next::stop) return false;
      const std::uint32_t test = last_test_;
      p.interrupts[k].looked = s_.progress;
      const bool is_true = next == Next::condition_true;
      if (is_true && !p.interrupts[k].was_true) is_due = true;
      p.interrupts[k].was_true = is_true;
      if (is_due && may_begin) {
        p.interrupts[k].is_pending = false;
        Frame& f = p.frames.back();
        f.back = p.pc;
        f.priority = priority;
        f.put_aside.push_back(std::move(p.wait));
        p.wait = {};
        ++p.level;
        p.pc = test + 1;
        ++s_.progress;
        return true;
      }
      p.frames.pop_back();
      p.interrupts[k].is_pending = is_due;
    } else if (is_due && may_begin) {
      p.interrupts[k].looked = ~std::uint64_t{0};  // its condition again, for the frame
      --k;
    }
  }
  return false;
}

/// Lets a process go on, if it can. True = it has.
bool Run::look(Process& p) {
  ++s_.looks;
  const bool has_gone_on = look_at(p);
  count_bytes(p);
  return has_gone_on;
}

bool Run::look_at(Process& p) {
  if (p.is_ended || p.is_stopped) return false;
  p_ = &p;
  s_.running = p.routine;
  at_ = p.pc;
  const std::uint64_t before = s_.progress;
  const std::uint64_t used = p.used;
  if (!p.open.empty() && !poll(p)) return false;
  if (p.used >= c_.limits.slice) return false;
  if (!p.interrupts.empty()) {
    interrupts(p);
    if (s_.status.fault) return false;
  }
  WaitState& w = p.wait;
  switch (w.kind) {
    case Waits::nothing: break;
    case Waits::time:
      if (s_.now < w.until) return s_.progress != before;
      w = {};
      break;
    case Waits::motion: {
      const auto count = [&] {
        return w.own_level ? static_cast<std::size_t>(std::count_if(
                                 p.open.begin(), p.open.end(),
                                 [&](const OpenMotion& m) { return m.level == p.level; }))
                           : p.open.size();
      };
      const auto is_about = [&] {
        return std::any_of(p.open.begin(), p.open.end(),
                           [&](const OpenMotion& m) { return m.number == w.motion; });
      };
      if (w.move != kNone && !w.is_aborted && is_about() && (w.looked != s_.progress)) {
        const Next next = condition(p, c_.moves[w.move].until);
        if (next == Next::stop) return false;
        if (next == Next::condition_true) {
          w.is_aborted = true;
          const auto done = world_->abort_motion(w.motion, AbortReason::until);
          if (!done.ok()) {
            fail(done.error());
            return false;
          }
          ++s_.progress;
          if (!poll(p)) return false;
        }
        w.looked = s_.progress;
      }
      if (count() > w.most_open) return s_.progress != before;
      const std::uint32_t action =
          w.move != kNone && w.is_aborted ? c_.moves[w.move].action : kNone;
      w = {};
      if (action != kNone) {
        if (!push_frame(p, action, p.pc, FrameKind::action)) return false;
        p.pc = c_.routines[action].first;
      }
      ++s_.progress;
      break;
    }
    case Waits::condition:
      // Looked at once in a run(), and again when others have gone on.
      if (w.looked == s_.progress) return s_.progress != before;
      w.kind = Waits::nothing;
      break;
    case Waits::semaphore:
    case Waits::pause:
      if (!w.is_granted) return s_.progress != before;
      w = {};
      break;
    case Waits::brake:
      for (const std::uint64_t number : w.braked) {
        const auto stands = world_->stands(number);
        if (!stands.ok()) {
          fail(stands.error());
          return false;
        }
        if (!*stands) return s_.progress != before;
        if (w.holds) continue;
        const auto state = world_->motion_state(number);
        if (!state.ok()) {
          fail(state.error());
          return false;
        }
        if (*state == MotionState::running) return s_.progress != before;
      }
      w = {};
      ++s_.progress;
      break;
    case Waits::line: {
      auto line = world_->read_line(p.routine);
      if (!line.ok()) {
        fail(line.error());
        return false;
      }
      if (!line->has_value()) return s_.progress != before;
      p.input += **line + "\n";
      w = {};
      ++s_.progress;
      break;
    }
  }
  const Next next = execute(p);
  switch (next) {
    case Next::end:
      p.is_ended = true;
      p.stack = {};
      disable_all(p);
      ++s_.progress;
      return true;
    case Next::wait: break;
    default: break;
  }
  if (p.wait.kind == Waits::condition) {
    p.wait.looked = s_.progress;
    return s_.progress != before;
  }
  return s_.progress != before || p.used != used;
}

void Run::write_files() {
  for (Heap::File& f : s_.heap.files) {
    if (f.mode != 'W' && f.mode != 'A') continue;
    const auto done = world_->write_file(f.name, f.text, f.mode == 'A');
    f.mode = 0;
    if (done.ok() || s_.status.fault) continue;
    p_ = nullptr;
    fail(done.error());
    Fault& fault = *s_.status.fault;
    fault.span = f.span;
    const rmp_code& t = c_.tables();
    if (f.span.file < t.files.count) fault.file = row<rmp_code_file>(t.files, f.span.file).name;
  }
}

void Run::run(double now) {
  if (!std::isfinite(now) || now < s_.now) {
    // Time that stands still is allowed; time that falls would let waits end twice.
    if (!std::isfinite(now) || s_.has_begun) {
      s_.status.fault = Fault{
          "the time of a run is " + real_literal(now) + " s, behind " + real_literal(s_.now) + " s",
          "Give a time that is not before the previous one.",
          0,
          {},
          "",
          {}};
      s_.status.state = RunState::fault;
      return;
    }
  }
  s_.now = now;
  Status& status = s_.status;
  status.state = RunState::waiting;
  status.stop.reset();
  status.waits.clear();
  if (!s_.has_begun) {
    s_.has_begun = true;
    if (bytes() > c_.limits.most_bytes) has_room(c_.limits.most_bytes);
    else start_process(0, 0);
  }
  for (Process& p : s_.processes) p.used = 0;
  ++s_.progress;  // every condition is looked at once
  awake_.clear();
  for (const std::uint32_t k : s_.order)
    if (!s_.processes[k].is_ended)
      awake_.emplace_hint(awake_.end(), -std::int64_t{s_.processes[k].priority},
                          s_.processes[k].routine);
  for (auto next = awake_.begin(); next != awake_.end();) {
    Process& p = *process_of(next->second);
    const bool has_gone_on = look(p);
    if (status.fault || status.is_halted || status.stop || status.state == RunState::cancelled)
      break;
    // Nothing asks again in vain: who sleeps is left out until something wakes it.
    const auto at = next++;
    if (sleeps(p)) awake_.erase(at);
    // Whenever one has gone on, those of higher priority are asked again.
    if (has_gone_on) next = awake_.begin();
  }
  if (status.fault || status.is_halted) {
    for (Process& p : s_.processes) {
      if (!p.is_ended) abort_all(p, AbortReason::halt);
      if (!status.fault) p.is_ended = true;
    }
    if (!status.fault) write_files();
    status.state = status.fault ? RunState::fault : RunState::over;
  } else if (status.state == RunState::cancelled) {
    // Nothing: it may go on.
  } else if (status.stop) {
    status.state = RunState::stopped;
  } else if (std::all_of(s_.processes.begin(), s_.processes.end(),
                         [](const Process& p) { return p.is_ended; })) {
    write_files();
    status.state = status.fault ? RunState::fault : RunState::over;
  } else {
    const bool is_busy =
        std::any_of(s_.processes.begin(), s_.processes.end(), [&](const Process& p) {
          return !p.is_ended && !p.is_stopped && p.used >= c_.limits.slice;
        });
    status.state = is_busy ? RunState::busy : RunState::waiting;
  }
  tell();
}

/// What everybody waits for.
void Run::tell() {
  Status& status = s_.status;
  status.instructions = s_.instructions;
  status.waits.clear();
  status.watched.clear();
  status.watches_each_cycle = false;
  if (status.state == RunState::over || status.state == RunState::fault) return;
  const auto add = [](std::vector<std::uint32_t>& to, const std::vector<std::uint32_t>& from) {
    for (const std::uint32_t s : from)
      if (std::find(to.begin(), to.end(), s) == to.end()) to.push_back(s);
  };
  for (const std::uint32_t k : s_.order) {
    const Process& p = s_.processes[k];
    if (p.is_ended) continue;
    for (const EnabledInterrupt& i : p.interrupts) {
      const ConditionInfo& c = c_.conditions[c_.routines[i.routine].condition];
      add(status.watched, c.signals);
      status.watches_each_cycle = status.watches_each_cycle || c.each_cycle;
    }
    const auto one = [&](const WaitState& w, std::uint32_t pc) {
      Wait x;
      x.process = p.routine;
      if (w.is_behind && pc > 0) --pc;
      if (pc < c_.ops.size() && c_.instruction_of[pc] != kNone) x.span = c_.instruction(pc).span;
      const auto info = [&](std::uint32_t condition) {
        if (condition == kNone) return;
        add(x.signals, c_.conditions[condition].signals);
        x.each_cycle = c_.conditions[condition].each_cycle;
      };
      switch (w.kind) {
        case Waits::nothing: return;
        case Waits::time:
          x.kind = WaitKind::time;
          x.until = w.until;
          break;
        case Waits::motion:
          x.kind = WaitKind::motion;
          for (const OpenMotion& m : p.open) x.motions.push_back(m.number);
          if (w.move != kNone && !w.is_aborted) info(c_.moves[w.move].condition);
          break;
        case Waits::condition: {
          x.kind = WaitKind::condition;
          const Frame& f = p.frames.back();
          if (f.has_deadline) x.until = f.deadline;
          if (f.wait != kNone) info(c_.waits[f.wait].condition);
          break;
        }
        case Waits::semaphore: x.kind = WaitKind::semaphore; break;
        case Waits::brake:
          x.kind = WaitKind::motion;
          x.motions = w.braked;
          x.each_cycle = w.holds;
          break;
        case Waits::pause:
          x.kind = WaitKind::pause;
          x.message = w.message;
          break;
        case Waits::line: x.kind = WaitKind::line; break;
      }
      status.waits.push_back(std::move(x));
    };
    if (p.is_stopped) {
      Wait x;
      x.process = p.routine;
      x.kind = WaitKind::stopped;
      status.waits.push_back(std::move(x));
      continue;
    }
    one(p.wait, p.pc);
    // Motions behind which the process has gone on, and what an interrupt has put aside.
    for (const Frame& f : p.frames)
      if (!f.put_aside.empty()) {
        Wait x;
        x.process = p.routine;
        x.kind = WaitKind::interrupt;
        status.waits.push_back(std::move(x));
      }
  }
}

}  // namespace robomosp::program
