// SPDX-License-Identifier: Apache-2.0
// Operations that run seldom beside the others: about signals, waits, motions, processes and texts.
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "program/state.h"

namespace robomosp::program {
namespace {

constexpr std::int64_t kGreatestInt = std::numeric_limits<std::int32_t>::max();

}  // namespace

bool Run::read_signal(Process& p, const Op& o, Slot* out, bool& is_skipped) {
  const Signal signal = c_.signal(o.n);
  auto value = world_->read_signal(signal);
  if (!value.ok()) return fail(value.error());
  is_skipped = false;
  if (!value->has_value()) {
    const std::string name(signal.name);
    Frame& f = p.frames.back();
    if (observer_ && f.wait != kNone && !p.condition_depth) {
      const WaitInfo& w = c_.waits[f.wait];
      auto noted = observer_->unknown_wait(p.routine, w, f.has_deadline ? f.timeout : -1);
      if (!noted.ok()) return fail(noted.error());
      if (*noted) {
        is_skipped = true;
        s_.is_timeout_unknown = f.has_deadline;
        s_.timeout_unknown = c_.instruction(w.begin).span;
        if (c_.r_timeout != kNone) s_.globals[c_.r_timeout] = {};
        f.wait = kNone;
        f.has_deadline = false;
        p.pc = w.test + 1;
        ++s_.progress;
        return true;
      }
    }
    return fail("the flow depends on the " + std::string(signal.is_output ? "output " : "input ") +
                    name + ", which has no known value",
                "Give a value for " + name + ", or use it in WAIT FOR or UNTIL only.");
  }
  const SignalValue v = **value;
  if (signal.type == RMP_TYPE_REAL) {
    if (!std::isfinite(v.real))
      return fail("the signal " + std::string(signal.name) + " is not a finite number");
    *out = Slot::of_real(v.real);
  } else if (signal.type == RMP_TYPE_BOOL) {
    *out = Slot::of(v.integer != 0);
  } else {
    if (v.integer > kGreatestInt || v.integer < -kGreatestInt - 1)
      return fail("the signal " + std::string(signal.name) + " is " + std::to_string(v.integer) +
                      ", which is outside the range of INT",
                  "An INT is from -2147483648 to 2147483647.");
    *out = Slot::of(v.integer);
  }
  return true;
}

bool Run::write_signal(Process&, const Op& o, Slot value) {
  const Signal signal = c_.signal(o.n);
  SignalValue v;
  if (signal.type == RMP_TYPE_REAL) {
    v.real = value.real();
  } else {
    v.integer = signal.type == RMP_TYPE_BOOL ? value.integer() != 0 : value.integer();
    if (signal.type == RMP_TYPE_INT && signal.width > 1 && signal.width < 32 &&
        (v.integer < 0 || v.integer >= std::int64_t{1} << signal.width))
      return fail("the value " + std::to_string(v.integer) + " does not fit in the " +
                      std::to_string(signal.width) + " bits of " + std::string(signal.name),
                  "They hold 0 to " + std::to_string((std::int64_t{1} << signal.width) - 1) + ".");
  }
  const auto done = world_->write_signal(signal, v);
  ++s_.progress;
  return done.ok() || fail(done.error());
}

/// A fault in a condition of UNTIL or WHEN, which may only compute.
bool Run::may_act(const Process& p, const char* what) {
  if (!p.condition_depth) return true;
  return fail(std::string("a condition of UNTIL or WHEN ") + what,
              "Functions called there may only compute.");
}

bool Run::store_char(Process& p, std::uint64_t address, std::string s, std::uint64_t i, char to) {
  if (i > s.size())
    return fail("the index " + std::to_string(i) + " is outside 1.." + std::to_string(s.size()));
  s[i - 1] = to;
  cost_ += s.size() / 64;
  if (!has_room(s.size() + 64)) return false;
  const Slot changed = new_text(std::move(s));
  if (Slot* again = at(p, address, 1, true)) *again = changed;
  return true;
}

Run::Then Run::wait_time(Process& p, double seconds) {
  if (!may_act(p, "waits")) return Then::fault;
  const std::uint32_t pc = p.pc;
  if (seconds < 0) {
    fail("WAIT is of " + real_literal(seconds) + " s, but a time must not be negative");
    return Then::fault;
  }
  if (observer_) {
    const auto noted = observer_->waits_for_time(p.routine, seconds, c_.instruction(pc).span);
    if (!noted.ok()) {
      fail(noted.error());
      return Then::fault;
    }
  }
  ++s_.progress;
  p.wait = {};
  p.wait.kind = Waits::time;
  p.wait.until = s_.now + seconds;
  p.wait.is_behind = true;
  p.pc = pc + 1;
  return Then::wait;
}

Run::Then Run::wait_begin(Process& p, const Op& o, Slot timeout) {
  if (!may_act(p, "waits")) return Then::fault;
  Frame& f = p.frames.back();
  f.wait = o.n;
  f.has_deadline = o.r != 0;
  if (f.has_deadline) {
    const double seconds = timeout.real();
    if (seconds < 0) {
      fail("TIMEOUT is " + real_literal(seconds) + " s, but a time must not be negative");
      return Then::fault;
    }
    f.deadline = s_.now + seconds;
    f.timeout = seconds;
  }
  ++s_.progress;
  return Then::next;
}

Run::Then Run::wait_test(Process& p, const Op& o, Slot condition) {
  Frame& f = p.frames.back();
  const bool is_true = condition.integer() != 0 || f.is_waived;
  const bool is_late = f.has_deadline && s_.now >= f.deadline;
  if (!is_true && !is_late) {
    if (f.wait != o.n) {
      fail("a condition of WAIT FOR has no beginning", "Compile the program again.");
      return Then::fault;
    }
    p.pc = c_.waits[o.n].begin + 1;
    p.wait = {};
    p.wait.kind = Waits::condition;
    return Then::wait;
  }
  if (c_.r_timeout != kNone) s_.globals[c_.r_timeout] = Slot::of(!is_true);
  s_.is_timeout_unknown = false;
  if (s_.keeps_journal && !is_true)
    s_.timeouts.push_back({p.routine, s_.now, c_.instruction(c_.waits[o.n].begin).span});
  f.wait = kNone;
  f.has_deadline = f.is_waived = false;
  ++s_.progress;
  return Then::next;
}

Run::Then Run::pause(Process& p, std::string message) {
  if (!may_act(p, "pauses")) return Then::fault;
  if (observer_) observer_->running(p.routine, c_.instruction(p.pc).span);
  const auto told = world_->pause(p.routine, message);
  if (!told.ok()) {
    fail(told.error());
    return Then::fault;
  }
  ++s_.progress;
  p.wait = {};
  p.wait.kind = Waits::pause;
  p.wait.message = std::move(message);
  p.wait.is_behind = true;
  ++p.pc;
  return Then::wait;
}

Run::Then Run::halt(Process& p) {
  if (!may_act(p, "halts the program")) return Then::fault;
  if (observer_) {
    const auto noted = observer_->halts(p.routine, c_.instruction(p.pc).span);
    if (!noted.ok()) {
      fail(noted.error());
      return Then::fault;
    }
  }
  s_.status.is_halted = true;
  s_.status.halted_at = c_.instruction(p.pc).span;
  return Then::stop;
}

Run::Then Run::move(Process& p, std::uint32_t which) {
  if (!may_act(p, "moves")) return Then::fault;
  if (std::any_of(p.open.begin(), p.open.end(),
                  [&](const OpenMotion& m) { return is_held(m.number); })) {
    fail("BRAKE holds a motion of this process, and another motion cannot begin before it ends",
         "BRAKE without a mode, or with 0, ends it.");
    return Then::fault;
  }
  if (!p.open.empty()) {
    const bool is_chain = std::all_of(p.open.begin(), p.open.end(), [&](const OpenMotion& m) {
      return m.approximates && m.level == p.level;
    });
    if (!is_chain || c_.moves[which].until != kNone || p.open.size() >= 2) {
      p.wait = {};
      p.wait.kind = Waits::motion;
      p.wait.most_open = is_chain && c_.moves[which].until == kNone ? 1 : 0;
      return Then::wait;
    }
  }
  if (!begin_motion(p, which)) return Then::fault;
  cost_ += 16;
  return p.wait.kind != Waits::nothing ? Then::wait : Then::jump;
}

Run::Then Run::teach(Process& p, const Op& o) {
  if (!may_act(p, "teaches")) return Then::fault;
  if (c_.taught_offset[o.n] == kNone) {
    fail(std::string(c_.symbol(o.n).name) + " has no taught value",
         "Assign one in a data list: " + std::string(c_.symbol(o.n).name) + " := ...;");
    return Then::fault;
  }
  if (!s_.has_taught) {
    // Lists of data run now, on variables of their own; then this again.
    s_.has_taught = true;
    for (std::size_t k = c_.data_lists.size(); k-- > 0;) {
      const std::uint32_t back = p.pc;
      if (!push_frame(p, c_.data_lists[k], back, FrameKind::data_list)) return Then::fault;
      p.pc = c_.routines[c_.data_lists[k]].first;
    }
    return Then::jump;
  }
  const std::uint32_t type = c_.symbol(o.n).type;
  std::copy_n(s_.globals.data() + c_.taught_offset[o.n], c_.types[type].slots,
              s_.globals.data() + o.r);
  return deepen(p, type, o.r) ? Then::next : Then::fault;
}

Run::Then Run::seldom(Process& p, const Op& o, Slot* const* base) {
  const auto a = [&]() -> const Slot& { return base[o.sa][o.a]; };
  const auto r = [&]() -> Slot* { return base[o.sr] + o.r; };
  const auto next = [](bool is_done) { return is_done ? Then::next : Then::fault; };
  switch (o.code) {
    case Do::read_signal:
    case Do::write_signal:
    case Do::refresh:
    case Do::wait_time:
    case Do::wait_begin:
    case Do::pause:
    case Do::start:
    case Do::stop:
    case Do::continue_:
    case Do::cancel:
    case Do::enable:
    case Do::disable:
    case Do::teach:
      if (must_wait(p)) return Then::wait;
      break;
    default: break;
  }
  switch (o.code) {
    case Do::char_to_text: {
      if (!has_room(64)) return Then::fault;
      const Slot s = new_text(std::string(1, static_cast<char>(a().integer())));
      *r() = s;
      return Then::next;
    }
    case Do::store_char: {
      const std::uint64_t address = r()[0].bits, i = r()[1].bits;
      Slot* x = at(p, address, 1, true);
      if (!x) return Then::lost;
      if (i > 0)
        return next(
            store_char(p, address, std::string(text_of(*x)), i, static_cast<char>(a().integer())));
      *x = a();
      return Then::next;
    }
    case Do::read_signal: {
      bool is_skipped = false;
      if (!read_signal(p, o, r(), is_skipped)) return Then::fault;
      cost_ += 4;
      return is_skipped ? Then::jump : Then::next;
    }
    case Do::write_signal:
      if (!may_act(p, "writes an output")) return Then::fault;
      if (observer_) observer_->running(p.routine, c_.instruction(p.pc).span);
      return next(write_signal(p, o, a()));
    case Do::refresh: cost_ += 16; return next(refresh(p, o));
    case Do::timeout_known:
      if (!s_.is_timeout_unknown) return Then::next;
      fail("the flow depends on whether the WAIT FOR in line " +
               std::to_string(s_.timeout_unknown.line) + " timed out",
           "Give values for the inputs of its condition.");
      return Then::fault;
    case Do::end_without_value:
      fail("the function " + c_.routine_name(p.frames.back().routine) +
               " reached its end without a RETURN",
           "End every path through a function with RETURN value;");
      return Then::fault;
    case Do::wait_time: return wait_time(p, a().real());
    case Do::wait_begin: return wait_begin(p, o, o.r != 0 ? a() : Slot{});
    case Do::wait_test: return wait_test(p, o, a());
    case Do::pause: return pause(p, std::string(o.n ? text_of(a()) : std::string_view()));
    case Do::halt: return halt(p);
    case Do::until_test:
    case Do::interrupt_test:
      if (!p.condition_depth || p.frames.size() != p.condition_depth) {
        fail("the flow runs into a condition", "Compile the program again.");
        return Then::fault;
      }
      last_test_ = p.pc;
      return a().integer() ? Then::condition_true : Then::condition_false;
    case Do::move: return move(p, o.n);
    case Do::start:
    case Do::stop:
    case Do::continue_:
    case Do::cancel:
    case Do::enable:
    case Do::disable:
      if (!may_act(p, "controls processes") || !control(p, o)) return Then::fault;
      if (!p.is_stopped && !p.is_ended) return Then::next;
      ++p.pc;
      return Then::wait;
    case Do::teach: return teach(p, o);
    default:
      fail("the code has an operation that does not exist", "Compile the program again.");
      return Then::fault;
  }
}

}  // namespace robomosp::program
