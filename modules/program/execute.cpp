// SPDX-License-Identifier: Apache-2.0
// The loop that runs operations; calls and lists. What runs seldom is in seldom.cpp.
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "program/state.h"

namespace robomosp::program {
namespace {

constexpr std::int64_t kMostInt = std::numeric_limits<std::int32_t>::max();
constexpr std::int64_t kChunk = 1 << 16;

}  // namespace

bool Run::fail(std::string message, std::string hint) {
  if (s_.status.fault) return false;
  Fault f;
  f.message = std::move(message);
  f.hint = std::move(hint);
  if (p_) {
    f.process = p_->routine;
    const Machine::Code& c = c_;
    std::uint32_t op = at_;
    for (std::size_t k = p_->frames.size(); k-- > 0;) {
      CallPlace place;
      place.routine = p_->frames[k].routine;
      place.name = c.routine_name(place.routine);
      if (op < c.ops.size() && c.instruction_of[op] != kNone) place.span = c.instruction(op).span;
      place.statement_line = place.span.line;
      f.calls.push_back(place);
      op = p_->frames[k].back;
      if (op > 0 && p_->frames[k].kind == FrameKind::call) --op;
      if (f.calls.size() >= 200) break;
    }
    if (!f.calls.empty()) f.span = f.calls.front().span;
    const rmp_code& t = c.tables();
    if (f.span.file < t.files.count) f.file = row<rmp_code_file>(t.files, f.span.file).name;
  }
  s_.status.fault = std::move(f);
  return false;
}
bool Run::fail(const Error& e) {
  return fail(e.where.empty() ? e.message : e.where + ": " + e.message, e.hint);
}

/// Whether what comes waits for motions that the program has gone on behind.
bool Run::must_wait(Process& p) {
  if (p.open.empty() || p.condition_depth) return false;
  const bool has_own = std::any_of(p.open.begin(), p.open.end(),
                                   [&](const OpenMotion& m) { return m.level == p.level; });
  if (!has_own) return false;
  p.wait = {};
  p.wait.kind = Waits::motion;
  p.wait.own_level = true;
  return true;
}

Slot* Run::slots(Process& p, const Place& x) {
  if (x.is_reference) {
    const Slot* r = p.stack.data() + p.frames.back().base + x.offset;
    return at(p, r[0].bits, c_.types[x.type].slots, false);
  }
  if (x.space == kFrame) return p.stack.data() + p.frames.back().base + x.offset;
  if (x.space == kGlobal) return s_.globals.data() + x.offset;
  return const_cast<Slot*>(c_.constants.data()) + x.offset;
}

std::uint64_t Run::address_of(const Process& p, const Place& x) const {
  if (x.is_reference) return p.stack[p.frames.back().base + x.offset].bits;
  if (x.space == kFrame) return s_.globals.size() + p.frames.back().base + x.offset;
  if (x.space == kGlobal) return x.offset;
  return kConstantAddress | x.offset;
}

bool Run::push_frame(Process& p, std::uint32_t routine, std::uint32_t back, FrameKind kind) {
  const RoutineInfo& r = c_.routines[routine];
  if (p.frames.size() >= c_.limits.most_frames)
    return fail("more than " + std::to_string(c_.limits.most_frames) + " calls are nested",
                "A recursion needs a case without a recursive call.");
  const std::uint64_t base =
      p.frames.empty()
          ? 0
          : p.frames.back().base + std::uint64_t{c_.routines[p.frames.back().routine].frame};
  const std::uint64_t size = base + r.frame;
  if (size > p.stack.size()) {
    const std::uint64_t more = std::max<std::uint64_t>(size, p.stack.size() * 2) - p.stack.size();
    std::uint64_t wanted = p.stack.size() + more;
    if (bytes() + more * 8 > c_.limits.most_bytes) {
      wanted = size;
      collect();
      if (bytes() + (size - p.stack.size()) * 8 > c_.limits.most_bytes)
        return fail("the program needs more than the " + std::to_string(c_.limits.most_bytes) +
                        " bytes allowed",
                    "Make the variables of its routines smaller, or the recursion less deep.");
    }
    p.stack.resize(wanted);
  }
  std::fill_n(p.stack.begin() + static_cast<std::ptrdiff_t>(base), r.zeroed, Slot{});
  cost_ += r.zeroed / 16;
  Frame f;
  f.routine = routine;
  f.base = static_cast<std::uint32_t>(base);
  f.back = back;
  f.kind = kind;
  p.frames.push_back(std::move(f));
  return true;
}

Run::Next Run::call(Process& p, const Op& o) {
  const CallInfo& c = c_.calls[o.n];
  const std::uint32_t from = p.frames.back().base;
  const std::uint64_t result = c.has_result ? address_of(p, c.result) : 0;
  if (!push_frame(p, c.routine, at_ + 1, FrameKind::call)) return Next::stop;
  Frame& f = p.frames.back();
  f.result = result;
  f.has_result = c.has_result;
  Slot* stack = p.stack.data();
  for (const CallInfo::Argument& a : c.arguments) {
    Slot* to = stack + f.base + a.to;
    if (a.is_place) {
      if (a.from.is_reference) {
        to[0] = stack[from + a.from.offset];
        to[1] = stack[from + a.from.offset + 1];
      } else {
        to[0].bits =
            a.from.space == kGlobal ? a.from.offset : s_.globals.size() + from + a.from.offset;
        to[1] = {};
      }
      continue;
    }
    const Slot* value = a.from.space == kFrame    ? stack + from + a.from.offset
                        : a.from.space == kGlobal ? s_.globals.data() + a.from.offset
                                                  : c_.constants.data() + a.from.offset;
    const TypeInfo& t = c_.types[a.from.type];
    std::copy_n(value, t.slots, to);
    cost_ += t.slots / 16;
    if (t.has_list && !deepen(p, a.from.type, s_.globals.size() + f.base + a.to)) return Next::stop;
  }
  p.pc = c_.routines[c.routine].first;
  return Next::go_on;
}

Run::Next Run::leave(Process& p, const Op& o) {
  if (p.condition_depth && p.frames.size() <= p.condition_depth) {
    fail("a condition does not end where it should", "Compile the program again.");
    return Next::stop;
  }
  if (p.frames.size() == 1 && must_wait(p)) return Next::wait;
  Frame f = p.frames.back();
  if (f.has_result && o.n) {
    const TypeInfo& t = c_.types[o.n];
    const Slot* from = (o.sa == kFrame    ? p.stack.data() + f.base
                        : o.sa == kGlobal ? s_.globals.data()
                                          : c_.constants.data()) +
                       o.a;
    Slot* to = at(p, f.result, t.slots, true);
    if (!to) {
      fail("a result has no place", "Compile the program again.");
      return Next::stop;
    }
    std::copy_n(from, t.slots, to);
    cost_ += t.slots / 16;
    if (t.has_list && !deepen(p, o.n, f.result)) return Next::stop;
  }
  p.frames.pop_back();
  if (p.frames.empty()) return Next::end;
  p.pc = f.back;
  if (f.kind == FrameKind::interrupt) {
    if (p.level) --p.level;
    if (!f.put_aside.empty()) p.wait = std::move(f.put_aside.front());
    if (!release(f.held)) return Next::stop;
    ++s_.progress;
    if (p.wait.kind != Waits::nothing) return Next::wait;
  }
  return Next::go_on;
}

bool Run::element(Process& p, const Op& o, std::uint64_t address, std::uint64_t character,
                  Slot index, Slot* out) {
  const TypeInfo& t = c_.types[o.n];
  const std::int64_t i = index.integer();
  const auto outside = [&](std::int64_t low, std::int64_t high) {
    return fail("the index " + std::to_string(i) + " is outside " + std::to_string(low) + ".." +
                    std::to_string(high),
                high < low ? "It has no elements yet." : "");
  };
  (void)character;
  if (t.kind == RMP_TYPE_ARRAY) {
    const std::int64_t k = i - t.lower;
    if (k < 0 || k >= t.length) return outside(t.lower, std::int64_t{t.lower} + t.length - 1);
    out[0].bits = address + static_cast<std::uint64_t>(k) * t.element_slots;
    out[1] = {};
    return true;
  }
  const Slot* at_slot = at(p, address, 1, false);
  if (!at_slot) return fail("a place of the code does not exist", "Compile the program again.");
  if (t.kind == RMP_TYPE_STRING) {
    const auto length = static_cast<std::int64_t>(text_of(*at_slot).size());
    if (i < 1 || i > length) return outside(1, length);
    out[0].bits = address;
    out[1] = Slot::of(i);
    return true;
  }
  const Heap::List* l = list_of(*at_slot);
  const std::int64_t length =
      l && t.element_slots ? static_cast<std::int64_t>(l->slots.size() / t.element_slots) : 0;
  if (i < 1 || i > length) return outside(1, length);
  out[0].bits = kListAddress |
                (static_cast<std::uint64_t>(static_cast<std::uint32_t>(at_slot->bits)) << 32) |
                (static_cast<std::uint64_t>(i - 1) * t.element_slots);
  out[1] = {};
  return true;
}

bool Run::make_list(Process& p, const Op& o) {
  const std::uint64_t n = std::uint64_t{o.b} * c_.types[o.n].slots;
  if (!has_room(n * 8 + 64)) return false;
  const Slot l = new_list();
  s_.heap.bytes += n * 8;
  const Slot* from = p.stack.data() + p.frames.back().base + o.a;
  list_of(l)->slots.assign(from, from + n);
  Slot* to = (o.sr == kFrame ? p.stack.data() + p.frames.back().base : s_.globals.data()) + o.r;
  *to = l;
  return true;
}

Run::Next Run::execute(Process& p) {
  p_ = &p;
  s_.running = p.routine;
  const bool debugs = s_.breakpoints || s_.is_stepping || s_.wants_pause || s_.entry_op != kNone ||
                      s_.resume_op != kNone || s_.again.op != kNone || s_.keeps_journal;
  return debugs ? loop<true>(p) : loop<false>(p);
}

// Operands of one slot.
#define A base[o.sa][o.a]
#define B base[o.sb][o.b]
#define R base[o.sr][o.r]
#define RMP_INT(expression, name)                                         \
  {                                                                       \
    const std::int64_t v = (expression);                                  \
    if (v > kMostInt || v < -kMostInt - 1) [[unlikely]] {                 \
      at_ = pc;                                                           \
      fail(std::string("the value of ") + (name) +                        \
               " is outside the range of INT: " + std::to_string(v),      \
           "An INT is from -2147483648 to 2147483647; REAL holds more."); \
      goto failed;                                                        \
    }                                                                     \
    R = Slot::of(v);                                                      \
    ++pc;                                                                 \
    break;                                                                \
  }
#define RMP_REAL(expression, name)                                                   \
  {                                                                                  \
    const double v = (expression);                                                   \
    if (!std::isfinite(v)) [[unlikely]] {                                            \
      at_ = pc;                                                                      \
      fail(std::string("the value of ") + (name) + " is outside the range of REAL"); \
      goto failed;                                                                   \
    }                                                                                \
    R = Slot::of_real(v);                                                            \
    ++pc;                                                                            \
    break;                                                                           \
  }
#define RMP_TRUTH(expression) \
  {                           \
    R = Slot::of(expression); \
    ++pc;                     \
    break;                    \
  }

template <bool kDebug>
Run::Next Run::loop(Process& p) {
  const Op* const ops = c_.ops.data();
  std::uint32_t pc = p.pc;
  Slot* base[3] = {p.stack.data() + p.frames.back().base, s_.globals.data(),
                   const_cast<Slot*>(c_.constants.data())};
  Next result = Next::wait;
  std::uint64_t used = 0;
  const auto rebase = [&] { base[0] = p.stack.data() + p.frames.back().base; };
  const auto finish_chunk = [&] {
    used += cost_;
    cost_ = 0;
    p.used += used;
    s_.instructions += used;
    used = 0;
  };
  for (;;) {
    // A piece of the slice; between pieces everything alive stands in slots.
    finish_chunk();
    at_ = pc;
    p.pc = pc;
    if (cancel_ && cancel_->load(std::memory_order_relaxed)) {
      s_.status.state = RunState::cancelled;
      return Next::stop;
    }
    if (c_.limits.most_instructions && s_.instructions > c_.limits.most_instructions) {
      fail("the program has run more than " + std::to_string(c_.limits.most_instructions) +
               " instructions",
           "Look for an endless loop, or allow more instructions.");
      return Next::stop;
    }
    if (p.used >= c_.limits.slice) {
      if (!p.condition_depth) return Next::wait;
      fail("a condition of UNTIL or WHEN runs more than " + std::to_string(c_.limits.slice) +
               " instructions",
           "Look for an endless loop in a function it calls.");
      return Next::stop;
    }
    if (s_.heap.bytes > s_.heap.collect_at) {
      collect();
      if (bytes() > c_.limits.most_bytes) {
        has_room(1);
        return Next::stop;
      }
    }
    const std::uint64_t piece = std::min<std::uint64_t>(kChunk, c_.limits.slice - p.used);
    while (used < piece) {
      if constexpr (kDebug) {
        if (stops_here(p, pc, used)) {
          p.pc = pc;
          result = Next::stop;
          goto done;
        }
        if (s_.keeps_journal) s_.has_run[pc] = true;
      }
      ++used;
      const Op& o = ops[pc];
      switch (o.code) {
        case Do::copy1:
          R = A;
          ++pc;
          break;
        case Do::copy_n:
          std::copy_n(&A, o.n, &R);
          used += o.n / 16;
          ++pc;
          break;
        case Do::zero_n:
          std::fill_n(&R, o.n, Slot{});
          ++pc;
          break;
        case Do::copy_deep: {
          at_ = pc;
          const TypeInfo& t = c_.types[o.n];
          std::copy_n(&A, t.slots, &R);
          used += t.slots / 16;
          const std::uint64_t address =
              o.sr == kGlobal ? o.r : s_.globals.size() + p.frames.back().base + o.r;
          if (!deepen(p, o.n, address)) goto failed;
          used += cost_;
          cost_ = 0;
          ++pc;
          break;
        }
        case Do::int_to_real:
          R = Slot::of_real(A.integer());
          ++pc;
          break;
        case Do::int_to_char: {
          const std::int32_t v = A.integer();
          if (v < 0 || v > 255) {
            at_ = pc;
            fail("the code of a CHAR must be from 0 to 255, but this is " + std::to_string(v));
            goto failed;
          }
          R = Slot::of(v);
          ++pc;
          break;
        }
        case Do::negate_int: RMP_INT(-std::int64_t{A.integer()}, "-");
        case Do::negate_real:
          R = Slot::of_real(-A.real());
          ++pc;
          break;
        case Do::not_: RMP_TRUTH(A.integer() == 0);
        case Do::add_int: RMP_INT(std::int64_t{A.integer()} + B.integer(), "+");
        case Do::subtract_int: RMP_INT(std::int64_t{A.integer()} - B.integer(), "-");
        case Do::multiply_int: RMP_INT(std::int64_t{A.integer()} * B.integer(), "*");
        case Do::div_int:
        case Do::mod_int: {
          const std::int64_t x = A.integer(), y = B.integer();
          if (y == 0) {
            at_ = pc;
            fail("this divides by zero");
            goto failed;
          }
          RMP_INT(o.code == Do::div_int ? x / y : x % y, "DIV");
        }
        case Do::add_real: RMP_REAL(A.real() + B.real(), "+");
        case Do::subtract_real: RMP_REAL(A.real() - B.real(), "-");
        case Do::multiply_real: RMP_REAL(A.real() * B.real(), "*");
        case Do::divide_real:
          if (B.real() == 0) {
            at_ = pc;
            fail("this divides by zero");
            goto failed;
          }
          RMP_REAL(A.real() / B.real(), "/");
        case Do::equal_int: RMP_TRUTH(A.integer() == B.integer());
        case Do::not_equal_int: RMP_TRUTH(A.integer() != B.integer());
        case Do::less_int: RMP_TRUTH(A.integer() < B.integer());
        case Do::less_equal_int: RMP_TRUTH(A.integer() <= B.integer());
        case Do::greater_int: RMP_TRUTH(A.integer() > B.integer());
        case Do::greater_equal_int: RMP_TRUTH(A.integer() >= B.integer());
        case Do::equal_real: RMP_TRUTH(A.real() == B.real());
        case Do::not_equal_real: RMP_TRUTH(A.real() != B.real());
        case Do::less_real: RMP_TRUTH(A.real() < B.real());
        case Do::less_equal_real: RMP_TRUTH(A.real() <= B.real());
        case Do::greater_real: RMP_TRUTH(A.real() > B.real());
        case Do::greater_equal_real: RMP_TRUTH(A.real() >= B.real());
        case Do::compare_text: {
          const int c = text_of(A).compare(text_of(B));
          const bool v = o.n == RMP_OP_EQUAL        ? c == 0
                         : o.n == RMP_OP_NOT_EQUAL  ? c != 0
                         : o.n == RMP_OP_LESS       ? c < 0
                         : o.n == RMP_OP_LESS_EQUAL ? c <= 0
                         : o.n == RMP_OP_GREATER    ? c > 0
                                                    : c >= 0;
          used += std::min(text_of(A).size(), text_of(B).size()) / 64;
          RMP_TRUTH(v);
        }
        case Do::exor: RMP_TRUTH((A.integer() != 0) != (B.integer() != 0));
        case Do::compose: {
          at_ = pc;
          double x[7], y[7], z[7];
          const int m = o.n < 2 ? 7 : 4, n = o.n == 0 ? 7 : o.n == 2 ? 4 : 3;
          const Slot *a = &A, *b = &B;
          for (int k = 0; k < m; ++k) x[k] = a[k].real();
          for (int k = 0; k < n; ++k) y[k] = b[k].real();
          const double* q = o.n < 2 ? x + 3 : x;
          if (n == 4) {
            compose_orientations(q, y, z);
          } else {
            rotate_position(q, y, z);
            if (o.n < 2)
              for (int k = 0; k < 3; ++k) z[k] += x[k];
            if (n == 7) compose_orientations(q, y + 3, z + 3);
          }
          bool is_finite = true;
          for (int k = 0; k < n; ++k) is_finite = is_finite && std::isfinite(z[k]);
          if (!is_finite) {
            fail("the value of @ is outside the range of REAL");
            goto failed;
          }
          Slot* r = &R;
          for (int k = 0; k < n; ++k) r[k] = Slot::of_real(z[k]);
          used += 4;
          ++pc;
          break;
        }
        case Do::address: {
          Slot* r = &R;
          r[0].bits = o.sa == kFrame    ? s_.globals.size() + p.frames.back().base + o.a
                      : o.sa == kGlobal ? o.a
                                        : kConstantAddress | o.a;
          r[1] = {};
          ++pc;
          break;
        }
        case Do::field: {
          const Slot* a = &A;
          Slot* r = &R;
          r[0].bits = a[0].bits + o.n;
          r[1] = {};
          ++pc;
          break;
        }
        case Do::element:
        case Do::element_of: {
          at_ = pc;
          std::uint64_t address = 0;
          if (o.code == Do::element) address = A.bits;
          else
            address = o.sa == kFrame    ? s_.globals.size() + p.frames.back().base + o.a
                      : o.sa == kGlobal ? o.a
                                        : kConstantAddress | o.a;
          if (!element(p, o, address, 0, B, &R)) goto failed;
          ++pc;
          break;
        }
        case Do::load1: {
          const Slot* x = at(p, A.bits, 1, false);
          if (!x) goto lost;
          R = *x;
          ++pc;
          break;
        }
        case Do::load_n: {
          const Slot* x = at(p, A.bits, o.n, false);
          if (!x) goto lost;
          std::copy_n(x, o.n, &R);
          used += o.n / 16;
          ++pc;
          break;
        }
        case Do::load_deep: {
          at_ = pc;
          const TypeInfo& t = c_.types[o.n];
          const Slot* x = at(p, A.bits, t.slots, false);
          if (!x) goto lost;
          std::copy_n(x, t.slots, &R);
          const std::uint64_t address =
              o.sr == kGlobal ? o.r : s_.globals.size() + p.frames.back().base + o.r;
          if (!deepen(p, o.n, address)) goto failed;
          used += cost_ + t.slots / 16;
          cost_ = 0;
          ++pc;
          break;
        }
        case Do::load_char: {
          const Slot* ref = &A;
          const Slot* x = at(p, ref[0].bits, 1, false);
          if (!x) goto lost;
          if (ref[1].bits == 0) {
            R = *x;
          } else {
            const std::string_view s = text_of(*x);
            const std::uint64_t i = ref[1].bits;
            if (i > s.size()) {
              at_ = pc;
              fail("the index " + std::to_string(i) + " is outside 1.." + std::to_string(s.size()));
              goto failed;
            }
            R = Slot::of(static_cast<unsigned char>(s[i - 1]));
          }
          ++pc;
          break;
        }
        case Do::store1: {
          Slot* x = at(p, R.bits, 1, true);
          if (!x) goto lost;
          *x = A;
          ++pc;
          break;
        }
        case Do::store_n: {
          Slot* x = at(p, R.bits, o.n, true);
          if (!x) goto lost;
          std::copy_n(&A, o.n, x);
          used += o.n / 16;
          ++pc;
          break;
        }
        case Do::store_deep: {
          at_ = pc;
          const TypeInfo& t = c_.types[o.n];
          Slot* x = at(p, R.bits, t.slots, true);
          if (!x) goto lost;
          std::copy_n(&A, t.slots, x);
          if (!deepen(p, o.n, R.bits)) goto failed;
          used += cost_ + t.slots / 16;
          cost_ = 0;
          ++pc;
          break;
        }
        case Do::call:
          at_ = pc;
          if (call(p, o) == Next::stop) goto failed;
          used += cost_;
          cost_ = 0;
          pc = p.pc;
          rebase();
          break;
        case Do::intrinsic: {
          at_ = pc;
          p.pc = pc;
          const Did did = intrinsic(p, c_.intrinsics[o.n]);
          used += cost_;
          cost_ = 0;
          if (did == Did::failed) goto failed;
          if (did == Did::waits) goto waiting;
          rebase();
          ++pc;
          break;
        }
        case Do::number: {
          const IntrinsicCall& i = c_.intrinsics[o.n];
          const double x[2] = {A.real(), i.arguments.size() > 1 ? B.real() : 0.0};
          const auto y = number_value(i.number, std::span(x, i.arguments.size()));
          if (!y) {
            at_ = pc;
            fail(std::string(c_.symbol(i.symbol).name) + " has no value at " + real_literal(x[0]) +
                 (i.arguments.size() > 1 ? ", " + real_literal(x[1]) : ""));
            goto failed;
          }
          R = Slot::of_real(*y);
          ++pc;
          break;
        }
        case Do::make_list:
          at_ = pc;
          if (!make_list(p, o)) goto failed;
          ++pc;
          break;
        case Do::jump: pc = o.n; break;
        case Do::jump_if: pc = A.integer() ? o.n : pc + 1; break;
        case Do::jump_unless: pc = A.integer() ? pc + 1 : o.n; break;
        case Do::return_: {
          at_ = pc;
          p.pc = pc;
          const Next next = leave(p, o);
          used += cost_;
          cost_ = 0;
          if (next == Next::stop) goto failed;
          if (next == Next::end) {
            result = Next::end;
            goto done;
          }
          if (next == Next::wait) goto waiting;
          pc = p.pc;
          rebase();
          break;
        }
        default:
          at_ = pc;
          p.pc = pc;
          switch (seldom(p, o, base)) {
            case Then::next: ++pc; break;
            case Then::jump:
              pc = p.pc;
              rebase();
              break;
            case Then::wait: goto waiting;
            case Then::fault: goto failed;
            case Then::lost: goto lost;
            case Then::stop: result = Next::stop; goto done;
            case Then::condition_true: result = Next::condition_true; goto done;
            case Then::condition_false: result = Next::condition_false; goto done;
          }
          used += cost_;
          cost_ = 0;
          break;
      }
    }
  }
lost:
  at_ = pc;
  fail("a place of the code does not exist", "Compile the program again.");
failed:
  p.pc = at_;
  result = Next::stop;
  goto done;
waiting:
  result = Next::wait;
  goto done;
done:
  finish_chunk();
  return result;
}

}  // namespace robomosp::program
