// SPDX-License-Identifier: Apache-2.0
// Mitsubishi Movemaster RV-M1: .rm1. Commands without a number run at once and define positions;
// lines with numbers are the program, in the order of their numbers.
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "reader.h"
#include "readers.h"

namespace robomosp::readers {
namespace {

const Style kMovemasterStyle{.comment = "'",
                             .quotes = "\"",
                             .name_first = "",
                             .name_rest = "",
                             .signs = {},
                             .has_lines = true,
                             .joins_in_brackets = false,
                             .hex = "&"};
constexpr std::int64_t kMostPositions = 629, kMostCounters = 99;
constexpr double kSpeedAtStart = 4;  ///< of ten, when the drive unit is switched on

/// An operand of a command: a number, a letter, or nothing between two commas.
struct MovemasterOperand {
  std::optional<double> value;
  char sign = 0;
  std::string letter;  ///< lower-case
  At at;
};
struct MovemasterLine {
  std::int64_t number = -1;  ///< -1 = runs at once
  std::string word;          ///< lower-case
  std::vector<MovemasterOperand> operands;
  At at;
};
/// What the manual names and IRL has no counterpart of, and what moves or switches nothing.
const std::set<std::string, std::less<>> kMovemasterOther{
    "da", "dc", "dl", "dp", "dw", "ea", "gf", "he", "ho", "in", "ip", "lr", "ma", "mc", "mj",
    "mt", "nt", "nw", "og", "ot", "pa", "pc", "pt", "rs", "sf", "tr", "wr", "cl", "er"};
const std::set<std::string, std::less<>> kMovemasterHarmless{"gp", "pr", "rn"};

class MovemasterReader final : public Reader {
 public:
  using Reader::Reader;

  void run() override {
    name_ = std::string(stem(files_[0].name));
    scan(0, kMovemasterStyle);
    comment_file_ = static_cast<std::uint32_t>(-1);
    split_lines();
    find_targets();
    if (is_cancelled()) return;
    // Positions are defined before the program runs.
    for (const MovemasterLine& l : direct_) statement(l.at, [&] { at_once(l); });
    begin_speed();
    emit_range(0, lines_.size(), false);
    for (const auto& [number, range] : subroutines_) {
      const At at = range.first < lines_.size() ? lines_[range.first].at : At{};
      begin("subroutine_" + std::to_string(number), {}, kNone, at);
      labels_of_ = number;
      emit_range(range.first, range.second, true);
      labels_of_ = -1;
      close();
    }
  }

 private:
  Ex primary() override { return failed(); }

  // ---- lines ----

  void split_lines() {
    while (!at_end()) {
      if (peek().kind == Tk::line) {
        next();
        continue;
      }
      MovemasterLine l;
      l.at = here();
      if (peek().kind == Tk::number) {
        const Token n = next();
        l.number = n.is_integer ? static_cast<std::int64_t>(n.value) : -1;
        if (l.number < 1 || l.number > 9999)
          fail(n.at, "a line number must be from 1 to 9999, but this is " + std::string(n.raw));
        if (at_line_end()) continue;  // deletes the line of that number
      }
      if (peek().kind != Tk::name) {
        statement(l.at, [&] { bad(here(), "a command must begin with its letters, such as MO"); });
        skip_line();
        continue;
      }
      const Token word = next();
      l.word = word.low.substr(0, word.low.find_first_of("0123456789"));
      // "MO1" is written without a blank, too.
      if (l.word.size() < word.low.size()) {
        MovemasterOperand o;
        o.at = word.at;
        o.value = 0;
        for (const char c : word.low.substr(l.word.size())) {
          if (c < '0' || c > '9') o.value.reset();
          if (o.value) *o.value = *o.value * 10 + (c - '0');
        }
        l.operands.push_back(std::move(o));
        if (!at_line_end() && !accept(",")) {
          l.word += " ";  // said where the line is carried out
          skip_rest();
        }
      }
      while (!at_line_end()) {
        MovemasterOperand o;
        o.at = here();
        if (is("-") || is("+")) o.sign = next().low[0];
        if (peek().kind == Tk::number) {
          o.value = next().value * (o.sign == '-' ? -1 : 1);
        } else if (peek().kind == Tk::name) {
          o.letter = next().low;
        } else if (peek().kind == Tk::text) {
          o.letter = "\"" + std::string(next().raw);
        }
        l.operands.push_back(std::move(o));
        if (at_line_end()) break;
        if (!is(",")) {
          l.word += " ";  // said where the line is carried out
          skip_rest();
          break;
        }
        next();
      }
      if (l.number < 0) {
        direct_.push_back(std::move(l));
      } else {
        const auto [same, is_new] = rows_.try_emplace(l.number, lines_.size());
        if (!is_new) {
          note(l.at, "line " + std::to_string(l.number) + " appears twice; the later one applies");
          lines_[same->second] = std::move(l);
        } else {
          lines_.push_back(std::move(l));
        }
      }
    }
    std::stable_sort(
        lines_.begin(), lines_.end(),
        [](const MovemasterLine& a, const MovemasterLine& b) { return a.number < b.number; });
    rows_.clear();
    for (std::size_t i = 0; i < lines_.size(); ++i) {
      rows_[lines_[i].number] = i;
      const auto k = jump_operand(lines_[i].word);
      if (k && whole(lines_[i], *k) >= 0) jumped_to_.insert(whole(lines_[i], *k));
    }
  }
  static std::int64_t whole(const MovemasterLine& l, std::size_t i, std::int64_t otherwise = -1) {
    if (i >= l.operands.size() || !l.operands[i].value) return otherwise;
    const double v = *l.operands[i].value;
    return v == std::floor(v) && std::fabs(v) < 1e9 ? static_cast<std::int64_t>(v) : otherwise;
  }
  [[nodiscard]] std::size_t row_of(std::int64_t number) const {
    const auto it = rows_.find(number);
    return it == rows_.end() ? lines_.size() : it->second;
  }
  static std::optional<std::size_t> jump_operand(const std::string& word) {
    if (word == "gt" || word == "gs") return 0;
    if (word == "eq" || word == "ne" || word == "lg" || word == "sm" || word == "tb") return 1;
    return std::nullopt;
  }
  /// Lines that others jump to, subroutines, positions that change, and what the register is for.
  void find_targets() {
    for (const MovemasterLine& l : lines_) {
      if (l.word == "gs") {
        const std::int64_t n = whole(l, 0);
        const std::size_t from = row_of(n);
        std::size_t to = from;
        while (to < lines_.size() && lines_[to].word != "rt") ++to;
        if (from < lines_.size() && to < lines_.size()) subroutines_[n] = {from, to + 1};
      }
    }
    for (std::size_t i = 0; i < lines_.size(); ++i) {
      const std::string& word = lines_[i].word;
      const bool ends_wait = i > 0 && is_wait(i - 1);
      if (word == "cp" || (jump_operand(word) == 1 && !ends_wait)) has_register_ = true;
      const auto k = jump_operand(word);
      if (!k || word == "gs" || ends_wait || whole(lines_[i], *k) < 0) continue;
      targets_.insert(whole(lines_[i], *k));
      // Where a subroutine is entered by a jump, the program itself has its lines, too.
      const std::size_t row = row_of(whole(lines_[i], *k));
      for (const auto& [number, range] : subroutines_) {
        const auto has = [&](std::size_t at) { return at >= range.first && at < range.second; };
        if (has(row) && !has(i)) entered_.insert(whole(lines_[i], *k));
      }
    }
  }
  /// ID, and TB back to it: a wait for an input.
  [[nodiscard]] bool is_wait(std::size_t i) const {
    return i + 1 < lines_.size() && lines_[i].word == "id" && lines_[i + 1].word == "tb" &&
           whole(lines_[i + 1], 1) == lines_[i].number &&
           !jumped_to_.contains(lines_[i + 1].number);
  }
  [[nodiscard]] bool is_in_subroutine(std::size_t i) const {
    return std::any_of(subroutines_.begin(), subroutines_.end(),
                       [&](const auto& s) { return i >= s.second.first && i < s.second.second; });
  }
  void emit_range(std::size_t from, std::size_t to, bool is_routine) {
    bool is_over = false;
    for (std::size_t i = from; i < to; ++i) {
      const MovemasterLine& l = lines_[i];
      // Subroutines are behind the end, unless the program runs into them.
      if (!is_routine && is_over && is_in_subroutine(i) && !entered_.contains(l.number)) continue;
      if (targets_.contains(l.number)) {
        emit("LABEL " + line_label(l.number) + ":", l.at);
        is_over = false;
      }
      if (is_wait(i)) {
        statement(l.at, [&] { wait(lines_[i + 1]); });
        ++i;
      } else {
        statement(l.at, [&] { one(l, is_routine); });
      }
      if (is_cancelled()) return;
      if (l.word == "ed" || l.word == "gt" || l.word == "rt") is_over = true;
    }
    for (; loops_ > 0; --loops_) {
      fail(lines_[to - 1].at, "a loop (RC) has no NX");
      indented(-1);
      emit("ENDFOR;", lines_[to - 1].at);
    }
  }
  std::string line_label(std::int64_t number) { return label("line_" + std::to_string(number)); }

  // ---- values ----

  /// What a command takes: between `least` and `most` operands, all numbers.
  bool takes(const MovemasterLine& l, std::size_t least, std::size_t most) {
    if (l.word.ends_with(' ')) {
      bad(l.at, "operands must be separated by commas");
      return false;
    }
    if (l.operands.size() < least || l.operands.size() > most) {
      bad(l.at, upper_word(l.word) + " takes " + std::to_string(least) +
                    (most > least ? " to " + std::to_string(most) : std::string()) +
                    (most == 1 ? " operand" : " operands") + ", but here are " +
                    std::to_string(l.operands.size()));
      return false;
    }
    return true;
  }
  static std::string upper_word(std::string s) {
    for (char& c : s)
      if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 32);
    return s;
  }
  std::optional<double> number_at(const MovemasterLine& l, std::size_t i, double least,
                                  double most) {
    if (i < l.operands.size() && l.operands[i].value && *l.operands[i].value >= least &&
        *l.operands[i].value <= most)
      return *l.operands[i].value;
    bad(i < l.operands.size() ? l.operands[i].at : l.at,
        upper_word(l.word) + " takes a number from " + number_text(least) + " to " +
            number_text(most) + " here");
    return std::nullopt;
  }
  std::optional<std::int64_t> whole_at(const MovemasterLine& l, std::size_t i, std::int64_t least,
                                       std::int64_t most) {
    const auto v = number_at(l, i, static_cast<double>(least), static_cast<double>(most));
    if (v && *v == std::floor(*v)) return static_cast<std::int64_t>(*v);
    if (v) bad(l.operands[i].at, "a whole number is expected here");
    return std::nullopt;
  }
  /// Pose of x, y, z [mm], pitch and roll [degrees]: the hand lies in the plane through the waist;
  /// its pitch is from the horizontal, its roll about itself.
  Ex pose_of(const std::array<double, 5>& v) {
    const double away = std::hypot(v[0], v[1]);
    const double c = away < 1e-6 ? 1 : v[0] / away, s = away < 1e-6 ? 0 : v[1] / away;
    const double pitch = v[3] / kDegree, roll = (v[4] - params_.real("roll") * kDegree) / kDegree;
    // The hand, the horizontal across the plane, and what completes them.
    const std::array<double, 3> a{c * std::cos(pitch), s * std::cos(pitch), std::sin(pitch)},
        across{-s, c, 0};
    const auto cross = [](const std::array<double, 3>& p, const std::array<double, 3>& q) {
      return std::array<double, 3>{p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2],
                                   p[0] * q[1] - p[1] * q[0]};
    };
    const auto up = cross(a, across);
    std::array<double, 3> y{};
    for (std::size_t i = 0; i < 3; ++i) y[i] = std::cos(roll) * across[i] + std::sin(roll) * up[i];
    const auto x = cross(y, a);
    std::vector<Ex> columns;
    for (const auto& each : {x, y, a})
      columns.push_back(position({measure(each[0]), measure(each[1]), measure(each[2])}));
    Ex ori = value("ORIMAT(" + columns[0].s + ", " + columns[1].s + ", " + columns[2].s + ")",
                   kOrientation);
    ori.is_constant = true;
    return pose({measure(v[0]), measure(v[1]), measure(v[2])}, ori);
  }
  std::optional<std::array<double, 5>> five(const MovemasterLine& l, std::size_t from) {
    std::array<double, 5> v{};
    for (std::size_t i = 0; i < 5; ++i) {
      const std::size_t k = from + i;
      if (k >= l.operands.size() ||
          (!l.operands[k].value && l.operands[k].letter.empty() && l.operands[k].sign == 0))
        continue;  // left out is 0
      if (!l.operands[k].value || !(std::fabs(*l.operands[k].value) < 1e5)) {
        bad(l.operands[k].at, "a coordinate of a position must be a number below 100000");
        return std::nullopt;
      }
      v[i] = *l.operands[k].value;
    }
    return v;
  }
  std::string position_key(std::int64_t n) { return "position_" + std::to_string(n); }
  /// A position that was defined; an error where the file does not.
  Ex position_at(const MovemasterLine& l, std::size_t i) {
    const auto n = whole_at(l, i, 1, kMostPositions);
    if (!n) return failed();
    const std::string key = position_key(*n);
    if (!learned_.flags.contains(key))
      return bad(l.operands[i].at,
                 "position " + std::to_string(*n) + " is not defined in this file (PD)",
                 "Write PD lines for the positions stored in the drive unit.");
    const Symbol& s = implied(key, kPose, l.at);
    return place(s.irl, s.type);
  }
  void define(const MovemasterLine& l, bool is_at_once) {
    if (!takes(l, 1, 6)) return;
    const auto n = whole_at(l, 0, 1, kMostPositions);
    const auto v = five(l, 1);
    if (!n || !v) return;
    const std::string key = position_key(*n);
    const Ex to = pose_of(*v);
    learned_.flags.insert(key);
    if (is_at_once && !find(key)) {
      learn(key, kPose);
      const Symbol& s = declare(key, kPose);
      declare_variable(s, to.s, l.at);
      return;
    }
    const Symbol& s = implied(key, kPose, l.at);
    assign(place(s.irl, s.type), to, l.at);
  }
  Ex hand(const At& at) {
    const Symbol& s = named_signal("hand", true, kBool, at);
    return place(s.irl, kBool);
  }
  Ex counter(const MovemasterLine& l, std::size_t i) {
    const auto n = whole_at(l, i, 1, kMostCounters);
    if (!n) return failed();
    const Symbol& s = implied("counter_" + std::to_string(*n), kInt, l.at);
    return place(s.irl, s.type);
  }
  Ex register_now(const At& at) {
    const Symbol& s = implied("register", kInt, at);
    return place(s.irl, s.type);
  }

  // ---- speeds ----

  /// What SP says; level 0 is the slowest there is, and counts as half a step.
  static double share_of(double level) { return (level == 0 ? 0.5 : level) / 9; }
  void set_speed(double level, const At& at) {
    set("joint_speed", measure(100 * share_of(level)), at);
    set("speed", measure(params_.real("speed") * 1000 * share_of(level)), at);
  }
  /// Motions before the first SP.
  void begin_speed() {
    for (const MovemasterLine& l : lines_) {
      if (l.word == "sp") return;
      if (l.word == "mo" || l.word == "ms" || l.word == "mp") break;
    }
    const bool moves = std::any_of(lines_.begin(), lines_.end(), [](const MovemasterLine& l) {
      return l.word == "mo" || l.word == "ms" || l.word == "mp";
    });
    if (!moves) return;
    set_speed(kSpeedAtStart, lines_.front().at);
    note(lines_.front().at,
         "no SP comes before the first motion: SP 4 is assumed, as after power-on");
  }

  // ---- commands ----

  void at_once(const MovemasterLine& l) {
    if (l.word == "pd") return define(l, true);
    if (l.word == "nt" || l.word == "ho" || l.word == "og") {
      bad(l.at, upper_word(l.word) + " moves to the mechanical origin, which IRL does not have");
      return;
    }
    if (l.word == "nw") {
      note_line(l.at, "NW clears the program and the positions before this file is loaded");
      return;
    }
    if (l.word == "cl" || l.word == "dl") {
      note_line(l.at, upper_word(l.word) + " clears previous data before this file is loaded");
      return;
    }
    one(l, false);
  }
  void one(const MovemasterLine& l, bool is_routine) {
    const std::string& w = l.word;
    if (w == "mo" || w == "ms") return go(l);
    if (w == "mp") return go_to_numbers(l);
    if (w == "pd") return define(l, false);
    if (w == "pl" || w == "px") return copy(l);
    if (w == "sp") {
      if (!takes(l, 1, 2)) return;
      if (const auto v = whole_at(l, 0, 0, 9)) set_speed(static_cast<double>(*v), l.at);
      if (l.operands.size() > 1)
        left_out(
            RMP_FAULT_WARNING, l.at,
            std::string("the acceleration rate (H, L) is not written in IRL") + kOtherTimes);
      return;
    }
    if (w == "ti") {
      if (!takes(l, 1, 1)) return;
      if (const auto v = whole_at(l, 0, 0, 32767))
        emit("WAIT " + measure(static_cast<double>(*v) / 10).s + " SEC;", l.at);
      return;
    }
    if (w == "tl") {
      if (!takes(l, 1, 1)) return;
      const auto v = number_at(l, 0, 0, 300);
      if (!v) return;
      Ex tool = pose({real(0), real(0), measure(*v)},
                     orientation("ORIQUAT", {real(1), real(0), real(0), real(0)}));
      set("tool", tool, l.at);
      return;
    }
    if (w == "gc" || w == "go") {
      if (!takes(l, 0, 0)) return;
      assign(hand(l.at), boolean(w == "gc"), l.at);
      return;
    }
    if (w == "ob") return switch_bit(l);
    if (w == "od") {
      if (!takes(l, 1, 1)) return;
      const auto v = whole_at(l, 0, -32768, 32767);
      if (!v) return;
      for (int bit = 0; bit < 8; ++bit) {
        const Symbol& s = signal(true, bit);
        emit(s.irl + ((((*v) >> bit) & 1) != 0 ? " := TRUE;" : " := FALSE;"), l.at);
      }
      return;
    }
    if (w == "id") {
      if (!takes(l, 0, 0)) return;
      if (has_register_) read_inputs(l.at);
      return;
    }
    if (w == "cp") {
      if (!takes(l, 1, 1)) return;
      assign(register_now(l.at), counter(l, 0), l.at);
      return;
    }
    if (w == "sc" || w == "ic" || w == "dc") {
      if (!takes(l, 1, w == "sc" ? 2 : 1)) return;
      const Ex c = counter(l, 0);
      if (!c.ok) return;
      if (w == "sc") {
        const auto v =
            l.operands.size() > 1 ? whole_at(l, 1, -32768, 32767) : std::optional<std::int64_t>(0);
        if (v) assign(c, integer(*v), l.at);
        return;
      }
      emit(c.s + " := " + c.s + (w == "ic" ? " + 1;" : " - 1;"), l.at);
      return;
    }
    if (jump_operand(w)) return jump(l);
    if (w == "rc") {
      if (!takes(l, 1, 1)) return;
      const auto n = whole_at(l, 0, 1, 32767);
      const Symbol& s = implied("repeat_" + std::to_string(loops_ + 1), kInt, l.at);
      emit("FOR " + s.irl + " := 1 TO " + std::to_string(n.value_or(1)) + " DO", l.at);
      indented(1);
      ++loops_;
      return;
    }
    if (w == "nx") {
      if (!takes(l, 0, 0)) return;
      if (loops_ == 0) {
        bad(l.at, "NX has no loop (RC)");
        return;
      }
      --loops_;
      indented(-1);
      emit("ENDFOR;", l.at);
      return;
    }
    if (w == "rt") {
      if (!takes(l, 0, 0)) return;
      if (!is_routine) bad(l.at, "RT is outside a subroutine (GS)");
      else emit("RETURN;", l.at);
      return;
    }
    if (w == "ed") {
      if (!takes(l, 0, 0)) return;
      emit(is_routine ? "HALT;" : "RETURN;", l.at);
      return;
    }
    if (w == "hlt") {
      if (takes(l, 0, 0)) emit("PAUSE;", l.at);
      return;
    }
    if (kMovemasterHarmless.contains(w)) {
      left_out(RMP_FAULT_WARNING, l.at,
               upper_word(w) + " neither moves a robot nor switches a signal");
      return;
    }
    bad(l.at, kMovemasterOther.contains(w) ? upper_word(w) + " is not read"
                                           : "\"" + upper_word(w.substr(0, 40)) +
                                                 "\" is not a command of the Movemaster RV-M1");
  }
  /// MO n[,O|C] and MS n,steps[,O|C]: the hand first.
  void go(const MovemasterLine& l) {
    const bool is_straight = l.word == "ms";
    if (!takes(l, is_straight ? 2 : 1, is_straight ? 3 : 2)) return;
    const Ex to = position_at(l, 0);
    if (is_straight && !whole_at(l, 1, 1, 99)) return;
    const std::size_t k = is_straight ? 2 : 1;
    if (k < l.operands.size()) {
      const std::string& c = l.operands[k].letter;
      if (c != "o" && c != "c") {
        bad(l.operands[k].at, "the hand must be O or C");
        return;
      }
      assign(hand(l.at), boolean(c == "c"), l.at);
    }
    move_to(to, is_straight, l.at);
  }
  void go_to_numbers(const MovemasterLine& l) {
    if (!takes(l, 1, 5)) return;
    if (const auto v = five(l, 0)) move_to(pose_of(*v), false, l.at);
  }
  void move_to(const Ex& to, bool is_straight, const At& at) {
    if (!to.ok) return;
    Motion m;
    m.word = is_straight ? "LIN" : "PTP";
    m.targets.push_back(to);
    m.attributes.emplace_back(is_straight ? "SPEED" : "SPEED_PTP",
                              get(is_straight ? "speed" : "joint_speed", kReal, at));
    move(std::move(m), at);
    if (!is_set("tool") && !std::exchange(told_tool_, true))
      note(at, "no TL sets the length of the hand: positions refer to the robot's present tool",
           "The drive unit stores a length, 107 mm by default; write TL 107 for it.");
  }
  void copy(const MovemasterLine& l) {
    if (!takes(l, 2, 2)) return;
    const auto n = whole_at(l, 0, 1, kMostPositions);
    if (!n) return;
    if (l.word == "pl") learned_.flags.insert(position_key(*n));
    const Ex a = position_at(l, 0), b = position_at(l, 1);
    if (!a.ok || !b.ok) return;
    if (l.word == "pl") {
      assign(a, b, l.at);
      return;
    }
    const Symbol& s = implied("exchanged", kPose, l.at);
    emit(s.irl + " := " + a.s + ";", l.at);
    emit(a.s + " := " + b.s + ";", l.at);
    emit(b.s + " := " + s.irl + ";", l.at);
  }
  void switch_bit(const MovemasterLine& l) {
    if (!takes(l, 1, 1)) return;
    const MovemasterOperand& o = l.operands[0];
    if (o.sign == 0) {
      bad(o.at, "OB needs + to switch a bit on or - to switch it off");
      return;
    }
    const auto n = bit_of(o, l);
    if (n < 0) return;
    const Symbol& s = signal(true, n);
    emit(s.irl + (o.sign == '+' ? " := TRUE;" : " := FALSE;"), l.at);
  }
  std::int64_t bit_of(const MovemasterOperand& o, const MovemasterLine& l) {
    const double v = o.value ? std::fabs(*o.value) : -1;
    if (v >= 0 && v <= 7 && v == std::floor(v)) return static_cast<std::int64_t>(v);
    bad(o.at, upper_word(l.word) + " takes a bit from 0 to 7");
    return -1;
  }
  void read_inputs(const At& at) {
    std::string sum;
    for (int bit = 0; bit < 8; ++bit) {
      const Symbol& s = signal(false, bit);
      sum += (bit ? " + " : "") + (bit ? std::to_string(1 << bit) + " * " : std::string()) +
             helper("bool_number") + "(" + s.irl + ")";
    }
    const Ex r = register_now(at);
    emit(r.s + " := " + sum + ";", at);
  }
  void wait(const MovemasterLine& test) {
    if (!takes(test, 2, 2)) return;
    const MovemasterOperand& o = test.operands[0];
    const auto n = bit_of(o, test);
    if (n < 0 || o.sign == 0) {
      if (n >= 0) bad(o.at, "TB needs + for a bit that is on or - for one that is off");
      return;
    }
    const Symbol& s = signal(false, n);
    // It jumps back while the bit is so.
    emit("WAIT FOR " + s.irl + (o.sign == '-' ? " = TRUE;" : " = FALSE;"), test.at);
    if (has_register_) read_inputs(test.at);
  }
  void jump(const MovemasterLine& l) {
    const std::size_t k = *jump_operand(l.word);
    if (!takes(l, k + 1, k + 1)) return;
    const std::int64_t to = whole(l, k);
    const std::size_t row = row_of(to);
    if (row == lines_.size()) {
      bad(l.operands[k].at, "line " + std::to_string(to) + " is not in this program");
      return;
    }
    if (l.word == "gs") {
      if (!subroutines_.contains(to)) {
        bad(l.at, "no RT ends the subroutine at line " + std::to_string(to));
        return;
      }
      const std::string name = "subroutine_" + std::to_string(to);
      if (!find(name)) announce(name, {}, kNone);
      emit(call(name, {}, l.at) + ";", l.at);
      return;
    }
    const auto range = subroutines_.find(labels_of_);
    if (range != subroutines_.end() && (row < range->second.first || row >= range->second.second)) {
      bad(l.at, "a subroutine jumps out of itself, which IRL procedures cannot");
      return;
    }
    if (loops_ > 0) {
      bad(l.at, "a jump leaves a loop (RC)", "Write the loop with a counter.");
      return;
    }
    const std::string go_there = "GOTO " + line_label(to) + ";";
    if (l.word == "gt") {
      emit(go_there, l.at);
      return;
    }
    const Ex r = register_now(l.at);
    std::string condition;
    if (l.word == "tb") {
      const MovemasterOperand& o = l.operands[0];
      const auto n = bit_of(o, l);
      if (n < 0) return;
      if (o.sign == 0) {
        bad(o.at, "TB needs + for a bit that is on or - for one that is off");
        return;
      }
      condition = "(" + r.s + (n ? " DIV " + std::to_string(1 << n) : std::string()) +
                  ") MOD 2 = " + (o.sign == '+' ? "1" : "0");
    } else {
      const auto v = whole_at(l, 0, -32768, 32767);
      if (!v) return;
      condition = r.s + " " +
                  (l.word == "eq"   ? "="
                   : l.word == "ne" ? "<>"
                   : l.word == "lg" ? ">"
                                    : "<") +
                  " " + std::to_string(*v);
    }
    emit("IF " + condition + " THEN " + go_there + " ENDIF;", l.at);
  }

  std::vector<MovemasterLine> direct_, lines_;
  std::map<std::int64_t, std::pair<std::size_t, std::size_t>> subroutines_;  ///< by first line
  std::map<std::int64_t, std::size_t> rows_;              ///< of lines, by their numbers
  std::set<std::int64_t> targets_, entered_, jumped_to_;  ///< numbers of lines
  std::int64_t labels_of_ = -1;                           ///< subroutine that is written
  int loops_ = 0;
  bool has_register_ = false, told_tool_ = false;
};

}  // namespace

Made read_movemaster(const ProgramReaderTask& task, const Params& params, Progress& progress) {
  return passes<MovemasterReader>(task, params, progress);
}

}  // namespace robomosp::readers
