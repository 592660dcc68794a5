// SPDX-License-Identifier: Apache-2.0
// BrandWriter: shared by the posts of VAL3, AS, PacScript, PDL2 and CRCL. Calls, loops,
// messages and signals over the values and motions of the other headers (layer: plugins/posts,
// header only).
#pragma once

#include <charconv>
#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "brand_motions.h"

namespace robomosp::post::brand {

class BrandWriter : public BrandMotions {
 public:
  using BrandMotions::BrandMotions;

 protected:
  // ---- calls ----
  /// A new variable of the current routine; only if functions become procedures.
  virtual std::string temporary(Kind) { return "t"; }
  virtual std::string call_line(const std::string& name, const std::string& arguments) {
    return "CALL " + name + "(" + arguments + ")";
  }
  virtual bool has_functions() const { return false; }
  /// If functions are not supported, one is called before the statement, and returns its value by a
  /// parameter.
  Text call_function(std::uint32_t r, std::span<const std::uint32_t> arguments) override {
    if (has_functions()) return Writer::call_function(r, arguments);
    if (!may_call_) {
      fail(
          "a function of the program cannot be posted in a condition that is evaluated repeatedly, "
          "since " +
              std::string(caps_.title) + " has no functions",
          "Assign its value to a variable before, and at the end of the loop.");
      return {};
    }
    const std::string all = list(arguments);
    const std::string to = temporary(kind(routine(r).result));
    line(call_line(routine_name(r), all + (all.empty() ? "" : ", ") + to));
    return {to};
  }
  /// Rejects routines that these languages lack within a program.
  void refuse_beside(std::uint32_t r) {
    if (routine(r).kind == RMP_ROUTINE_PROCESS)
      cannot("parallel processes", "Post them as separate programs.");
    if (routine(r).kind == RMP_ROUTINE_INTERRUPT)
      cannot("interrupts", "Test the condition in the program.");
  }
  void call(std::uint32_t r, std::span<const std::uint32_t> arguments) override {
    std::string all = list(arguments);
    if (routine(r).kind == RMP_ROUTINE_FUNCTION && !has_functions())
      all += (all.empty() ? "" : ", ") + temporary(kind(routine(r).result));
    line(call_line(routine_name(r), all));
  }
  /// A condition that is evaluated more than once, or elsewhere than at its position.
  std::string asked_again(std::uint32_t condition) {
    may_call_ = false;
    std::string s = text(condition);
    may_call_ = true;
    return s;
  }
  /// For programs that run ahead of their motions: waits for these before reading signals.
  void settle_for(std::uint32_t condition) {
    if (reads_signals(condition)) settle();
  }
  void loop_asks(std::uint32_t condition) {
    settle_for(condition);
    reads_.push_back(reads_signals(condition));
  }
  void loop_asks_again() {
    if (reads_.back()) settle();
    reads_.pop_back();
  }
  /// The range of FOR in the target's language: from, to and, unless it is 1, the added step.
  /// `sign` is the precedence of a sign.
  std::string range(std::uint32_t from, std::uint32_t to, std::uint32_t step, bool down,
                    const char* to_word, const char* step_word, int sign) {
    std::string out = text(from);
    out += to_word + text(to);
    if (step == RMP_NONE) return out + (down ? step_word + std::string("-1") : "");
    const Text by = expr(step);
    return out + step_word + (down ? "-" + within(by, sign) : by.text);
  }
  /// An index with another origin, shifted.
  static std::string counted(const std::string& index, std::int64_t shift) {
    std::int64_t number = 0;
    const auto r = std::from_chars(index.data(), index.data() + index.size(), number);
    if (r.ec == std::errc() && r.ptr == index.data() + index.size())
      return std::to_string(number + shift);
    if (shift == 0) return index;
    return index + (shift > 0 ? " + " : " - ") + std::to_string(shift > 0 ? shift : -shift);
  }
  /// Indices, one after another; `first` is the number of the first element in the target.
  static std::string counted(const std::vector<std::string>& indices,
                             const std::vector<Bounds>& bounds, std::int64_t first,
                             const char* between = ", ") {
    std::string out;
    for (std::size_t k = 0; k < indices.size(); ++k)
      out += (k ? between : "") + counted(indices[k], first - std::int64_t{bounds[k].lower});
    return out;
  }
  /// Values of a message as words and numbers, one after another; nothing = a fault was reported.
  std::optional<std::string> message_text(std::span<const std::uint32_t> values,
                                          const char* between) {
    std::string all;
    for (const std::uint32_t v : values) {
      if (!is_word(v)) return std::nullopt;
      all += (all.empty() ? "" : between) + text(v);
    }
    return all;
  }
  bool is_word(std::uint32_t value) {
    const Kind k = kind(expression(value).type);
    if (k != Kind::none && k != Kind::transform) return true;
    cannot("messages of " + type_name(expression(value).type), "Write its parts.");
    return false;
  }
  /// For a wait in languages that count milliseconds.
  void warn_of_rounding(std::uint32_t seconds) {
    const auto k = known(seconds);
    if (k && std::fabs(*k * 1000 - std::round(*k * 1000)) > 1e-9)
      warn("the time is rounded to milliseconds");
  }
  /// Checks that a signal has a number and is not analogue; reports a fault otherwise.
  bool is_numbered(const Signal& s) {
    if (s.type == RMP_TYPE_REAL) cannot("analog signals", "Use an INT of several bits.");
    if (!s.target.empty())
      fail("signals of " + std::string(caps_.title) + " have numbers, and the profile names one " +
               s.target,
           "Give number instead of target in the profile.");
    return s.type != RMP_TYPE_REAL && s.target.empty();
  }
  static std::vector<std::string_view> lines_of(std::string_view s) {
    std::vector<std::string_view> out;
    while (!s.empty()) {
      const std::size_t end = std::min(s.find('\n'), s.size());
      out.push_back(s.substr(0, end));
      s.remove_prefix(std::min(end + 1, s.size()));
    }
    return out;
  }
  /// A string in these quotes; characters that cannot be written are an error.
  Text quoted(std::string_view s, char quote) {
    for (const char c : s)
      if (c == quote || c == '\\' || c < ' ' || c > '~') {
        cannot("strings with quotes, backslashes or characters beyond ASCII",
               "Rewrite it without them.");
        return {};
      }
    return {quote + std::string(s) + quote};
  }
  static bool is_identity(const Pose& p) { return p.p == Pose{}.p && p.R == Pose{}.R; }

  // ---- signals ----
  /// TRUE or FALSE of an output: its constant, or nothing.
  std::optional<bool> constant_bool(std::uint32_t e, bool inverted) const {
    const auto k = known(e);
    return k ? std::optional<bool>((*k != 0) != inverted) : std::nullopt;
  }
  /// Checks that the result of a function, a parameter or a local has a kind that the target
  /// supports.
  bool check_parameters(std::uint32_t r) {
    bool all_right = true;
    for (std::uint32_t k = 0; k < routine(r).parameter_count; ++k) {
      const auto& p = symbol(routine(r).first_parameter + k);
      if (kind(p.type) != Kind::none) continue;
      at_ = p.span;
      cannot("parameters of " + type_name(p.type), "Use a variable of the program instead.");
      all_right = false;
    }
    return all_right;
  }
  [[nodiscard]] std::uint32_t parameter(std::uint32_t r, std::uint32_t k) const {
    return routine(r).first_parameter + k;
  }

 private:
  std::vector<bool> reads_;  ///< of the enclosing WHILEs: whether they read signals

 protected:
  bool may_call_ = true;
};

}  // namespace robomosp::post::brand
