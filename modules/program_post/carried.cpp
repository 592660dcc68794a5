// SPDX-License-Identifier: Apache-2.0
#include "program_post/carried.h"

#include <cstdint>
#include <deque>
#include <optional>

#include "program_post/walk.h"

namespace robomosp::program_post {
namespace {

using State = std::optional<std::vector<double>>;  ///< nothing = known at run time only

State merged(const State& a, const State& b) { return a && b && *a == *b ? a : State(); }

class Flow {
 public:
  Flow(const rmp_code& code, std::span<const CarriedSetting> settings, std::vector<double> start)
      : c_(code), settings_(settings), start_(std::move(start)) {}

  std::vector<CarriedMotion> run() {
    out_.resize(c_.motions.count);
    is_seen_.assign(c_.motions.count, false);
    if (is_constant()) {
      for (CarriedMotion& m : out_) m = {start_, start_};
      return std::move(out_);
    }
    const std::uint32_t routines = c_.routines.count;
    find_touched();
    for (std::uint32_t r = 0; r < routines; ++r) {
      const auto kind = routine(r).kind;
      if (kind == RMP_ROUTINE_PROCESS || kind == RMP_ROUTINE_INTERRUPT)
        is_shared_ = is_shared_ || touched_[r];
    }
    exits_.assign(routines, std::nullopt);
    entries_.assign(routines, std::nullopt);
    is_entered_.assign(routines, false);
    is_open_.assign(routines, false);
    is_known_exit_.assign(routines, false);
    records_ = true;
    enter(0, is_shared_ ? State() : State(start_));
    for (std::uint32_t r = 0; r < routines; ++r)
      if (const auto kind = routine(r).kind;
          kind == RMP_ROUTINE_PROCESS || kind == RMP_ROUTINE_INTERRUPT)
        enter(r, State());
    while (!waiting_.empty()) {
      const std::uint32_t r = waiting_.front();
      waiting_.pop_front();
      in_ = r;
      State exit;
      bool has_exit = false;
      (void)block(routine(r).body, entries_[r], exit, has_exit);
    }
    return std::move(out_);
  }

 private:
  template <class Row>
  const Row& row_at(const rmp_table& t, std::uint32_t i) const {
    return *static_cast<const Row*>(rmp_row(&t, i));
  }
  [[nodiscard]] const rmp_code_routine& routine(std::uint32_t r) const {
    return row_at<rmp_code_routine>(c_.routines, r);
  }
  [[nodiscard]] const rmp_code_statement& st(std::uint32_t i) const {
    return row_at<rmp_code_statement>(c_.statements, i);
  }
  [[nodiscard]] const rmp_code_motion& motion(std::uint32_t i) const {
    return row_at<rmp_code_motion>(c_.motions, i);
  }

  /// Every motion leaves the joints where they start.
  bool is_constant() const {
    for (const CarriedSetting& s : settings_) {
      if (s.is_unknown) return false;
      for (const auto& [k, v] : s.values)
        if (k >= start_.size() || (s.is_step ? v != 0 : v != start_[k])) return false;
    }
    return true;
  }

  template <class Fn>
  void each_callee(std::uint32_t e, Fn&& see) const {
    std::vector<std::uint32_t> open{e};
    while (!open.empty()) {
      const std::uint32_t i = open.back();
      open.pop_back();
      if (i == RMP_NONE) continue;
      const auto& x = row_at<rmp_code_expression>(c_.expressions, i);
      if (x.op == RMP_EXPR_CALL && x.symbol != RMP_NONE)
        if (const auto r = row_at<rmp_code_symbol>(c_.symbols, x.symbol).routine; r != RMP_NONE)
          see(r);
      for (std::uint32_t k = 0; k < x.count; ++k)
        open.push_back(row_at<std::uint32_t>(c_.links, x.first + k));
    }
  }
  /// Routines that a statement calls to find its values.
  template <class Fn>
  void each_callee_of_values(const rmp_code_statement& s, Fn&& see) const {
    for (const std::uint32_t e : {s.a, s.b, s.c}) each_callee(e, see);
    if (s.op != RMP_STMT_MOVE || s.motion == RMP_NONE) return;
    const auto& m = motion(s.motion);
    for (std::uint32_t k = 0; k < m.target_count; ++k)
      each_callee(row_at<std::uint32_t>(c_.links, m.first_target + k), see);
    for (std::uint32_t k = 0; k < m.attribute_count; ++k)
      each_callee(row_at<rmp_code_attribute>(c_.attributes, m.first_attribute + k).value, see);
    each_callee(m.until, see);
  }
  /// The same, and the action of UNTIL ... DO.
  template <class Fn>
  void each_callee_of(const rmp_code_statement& s, Fn&& see) const {
    each_callee_of_values(s, see);
    if (s.op != RMP_STMT_MOVE || s.motion == RMP_NONE) return;
    if (const auto r = motion(s.motion).action; r != RMP_NONE) see(r);
  }
  /// Routines that may move additional joints, by themselves or by what they call.
  void find_touched() {
    const std::uint32_t n = c_.routines.count;
    touched_.assign(n, false);
    std::vector<std::vector<std::uint32_t>> callers(n);
    std::vector<std::uint32_t> open;
    for (std::uint32_t r = 0; r < n; ++r)
      each_statement(
          routine(r).body, [&](std::uint32_t i) -> const rmp_code_statement& { return st(i); },
          [&](const rmp_code_statement& s) {
            if (s.motion != RMP_NONE && !settings_[s.motion].is_none() && !touched_[r]) {
              touched_[r] = true;
              open.push_back(r);
            }
            each_callee_of(s, [&](std::uint32_t to) { callers[to].push_back(r); });
          });
    while (!open.empty()) {
      const std::uint32_t r = open.back();
      open.pop_back();
      for (const std::uint32_t by : callers[r])
        if (!touched_[by]) touched_[by] = true, open.push_back(by);
    }
  }
  /// Whether a block may change what it begins with.
  bool may_change(std::uint32_t first, const State& from) const {
    return any_statement(
        first, [&](std::uint32_t i) -> const rmp_code_statement& { return st(i); },
        [&](const rmp_code_statement& s) {
          bool changes = s.motion != RMP_NONE && !settings_[s.motion].is_none() &&
                         after(s.motion, from) != from;
          each_callee_of(s, [&](std::uint32_t r) { changes = changes || touched_[r]; });
          return changes;
        });
  }

  void enter(std::uint32_t r, const State& with) {
    if (!records_) return;
    const State next = is_entered_[r] ? merged(entries_[r], with) : with;
    if (is_entered_[r] && next == entries_[r]) return;
    is_entered_[r] = true;
    entries_[r] = next;
    waiting_.push_back(r);
  }
  /// Behind a routine, whatever it begins with.
  State exit_of(std::uint32_t r) {
    if (is_known_exit_[r]) return exits_[r];
    if (is_open_[r] || calls_ >= kMostCalls) return {};
    is_open_[r] = true;
    ++calls_;
    const bool recorded = std::exchange(records_, false);
    const std::uint32_t in = std::exchange(in_, r);
    State exit;
    bool has_exit = false;
    const State end = block(routine(r).body, State(), exit, has_exit);
    exits_[r] = has_exit ? merged(exit, end) : end;
    in_ = in;
    records_ = recorded;
    --calls_;
    is_open_[r] = false;
    is_known_exit_[r] = true;
    return exits_[r];
  }
  /// What a statement calls to find its values; the action of a motion comes behind it.
  void call(const rmp_code_statement& s, State& now) {
    each_callee_of_values(s, [&](std::uint32_t r) {
      enter(r, now);
      if (touched_[r]) now = exit_of(r);
    });
  }

  [[nodiscard]] State after(std::uint32_t m, const State& from) const {
    const CarriedSetting& s = settings_[m];
    if (s.is_unknown) return {};
    State out = from;
    // What is set as a whole does not depend on what was before.
    if (!out && !s.is_step && s.values.size() >= start_.size()) out = start_;
    for (const auto& [k, v] : s.values)
      if (out && k < out->size()) (*out)[k] = s.is_step ? (*out)[k] + v : v;
    return out;
  }
  void move(std::uint32_t m, State& now) {
    const State to = after(m, now);
    if (records_) {
      CarriedMotion& all = out_[m];
      if (is_seen_[m]) all = {merged(all.from, now), merged(all.to, to)};
      else all = {now, to};
      is_seen_[m] = true;
    }
    // A condition may end it on the way; its action runs where that was.
    State left = motion(m).until != RMP_NONE && now != to ? State() : to;
    if (is_shared_) left.reset();
    if (const auto r = motion(m).action; r != RMP_NONE) {
      enter(r, left);
      if (touched_[r]) left = merged(left, exit_of(r));
    }
    now = left;
  }
  /// The condition of WHILE comes before its body each time, that of REPEAT behind it.
  void loop(const rmp_code_statement& s, State& now, State& exit, bool& has_exit) {
    const bool is_while = s.op == RMP_STMT_WHILE, is_repeat = s.op == RMP_STMT_REPEAT;
    if (!is_repeat) call(s, now);
    const bool changes = may_change(s.body, now);
    bool asks = false;  // whether the condition moves additional joints
    if (is_while || is_repeat)
      each_callee_of_values(s, [&](std::uint32_t r) { asks = asks || touched_[r]; });
    // The second time it begins elsewhere.
    if (changes || asks) {
      now.reset();
      if (is_while) call(s, now);
    }
    State end = block(s.body, now, exit, has_exit);
    if (is_repeat) call(s, end);
    // EXIT leaves it anywhere in the body.
    if (changes) now.reset();
  }
  static bool is_loop(const rmp_code_statement& s) {
    return s.op == RMP_STMT_WHILE || s.op == RMP_STMT_REPEAT || s.op == RMP_STMT_LOOP ||
           s.op == RMP_STMT_FOR || s.op == RMP_STMT_FOR_DOWN;
  }
  State block(std::uint32_t first, State now, State& exit, bool& has_exit) {
    if (depth_ >= kMostDepth) return {};
    ++depth_;
    for (std::uint32_t i = first; i != RMP_NONE; i = st(i).next) {
      const rmp_code_statement& s = st(i);
      if (!is_loop(s)) call(s, now);
      switch (s.op) {
        case RMP_STMT_MOVE:
          if (s.motion != RMP_NONE) move(s.motion, now);
          break;
        case RMP_STMT_IF:
        case RMP_STMT_CASE: {
          State all;
          bool has_all = false, has_else = false;
          for (std::uint32_t a = s.body; a != RMP_NONE; a = st(a).next) {
            call(st(a), now);
            const State end = block(st(a).body, now, exit, has_exit);
            all = has_all ? merged(all, end) : end;
            has_all = true;
            has_else = has_else || (s.op == RMP_STMT_IF ? st(a).a == RMP_NONE : st(a).count == 0);
          }
          if (has_all) now = has_else ? all : merged(all, now);
          break;
        }
        case RMP_STMT_WHILE:
        case RMP_STMT_REPEAT:
        case RMP_STMT_LOOP:
        case RMP_STMT_FOR:
        case RMP_STMT_FOR_DOWN: loop(s, now, exit, has_exit); break;
        case RMP_STMT_LABEL:
          if (touched_[in_]) now.reset();
          break;
        case RMP_STMT_RETURN:
          exit = has_exit ? merged(exit, now) : now;
          has_exit = true;
          break;
        default: break;
      }
    }
    --depth_;
    return now;
  }

  static constexpr int kMostDepth = 1200, kMostCalls = 200;
  const rmp_code& c_;
  std::span<const CarriedSetting> settings_;
  std::vector<double> start_;
  std::vector<CarriedMotion> out_;
  std::vector<bool> is_seen_, touched_, is_entered_, is_open_, is_known_exit_;
  std::vector<State> entries_, exits_;
  std::deque<std::uint32_t> waiting_;
  bool is_shared_ = false, records_ = false;
  std::uint32_t in_ = 0;  ///< the routine
  int depth_ = 0, calls_ = 0;
};

}  // namespace

std::vector<CarriedMotion> follow_carried(const rmp_code& code,
                                          std::span<const CarriedSetting> settings,
                                          std::vector<double> start) {
  return Flow(code, settings, std::move(start)).run();
}

}  // namespace robomosp::program_post
