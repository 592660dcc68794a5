// SPDX-License-Identifier: Apache-2.0
#include "program_source/source_text.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <numbers>
#include <optional>

#include "kernel/expression.h"
#include "kernel/letters.h"
#include "kernel/text.h"
#include "kernel/units.h"
#include "program/real_literal.h"
#include "spatial/rotation.h"

namespace robomosp::program_source {
namespace {

constexpr std::string_view kReserved[] = {
    "program",   "endprogram", "module",     "endmodule",   "system_specification",
    "datalist",  "import",     "export",     "const",       "var",
    "type",      "signal",     "record",     "endrecord",   "array",
    "of",        "list",       "procedure",  "endproc",     "function",
    "endfct",    "process",    "endprocess", "interrupt",   "endinterrupt",
    "begin",     "if",         "then",       "elsif",       "else",
    "endif",     "while",      "do",         "endwhile",    "for",
    "to",        "downto",     "endfor",     "repeat",      "until",
    "loop",      "endloop",    "exit",       "case",        "when",
    "default",   "endcase",    "goto",       "label",       "return",
    "wait",      "pause",      "halt",       "move",        "move_inc",
    "and",       "or",         "exor",       "not",         "div",
    "mod",       "in",         "out",        "inout",       "true",
    "false",     "pose",       "position",   "orientation", "robtarget",
    "joint",     "main_joint", "add_joint",  "int",         "real",
    "bool",      "char",       "string",     "text",        "file",
    "semaphore", "start",      "stop",       "continue",    "cancel",
    "enable",    "disable",    "teach",      "write",       "writeln",
    "read",      "readln",     "robot",      "bounds",      "sqrt",
    "abs",       "round",      "trunc",      "inv",         "rs",
    "xyz",       "yxz",        "zyx",        "zyz2",        "vang",
    "quat",      "open",       "close",      "acquire",     "release"};

}  // namespace

std::string irl_real(double value) {
  constexpr double kGrid = 1e9, kMost = 1e6;
  if (std::fabs(value) < kMost) value = std::round(value * kGrid) / kGrid;
  return program::real_literal(value);
}

std::string irl_position(const Vec3& p) {
  return "POSITION(" + irl_real(kMm * p[0]) + ", " + irl_real(kMm * p[1]) + ", " +
         irl_real(kMm * p[2]) + ")";
}
std::string irl_orientation(const std::array<double, 9>& rotation) {
  const Vec3 a = spatial::to_rpy(rotation);
  return "ORIZYX(" + irl_real(kDegreesPerRadian * a[2]) + ", " +
         irl_real(kDegreesPerRadian * a[1]) + ", " + irl_real(kDegreesPerRadian * a[0]) + ")";
}
std::string irl_pose(const Pose& pose) {
  return "POSE(" + irl_position(pose.p) + ", " + irl_orientation(pose.R) + ")";
}

std::string irl_string(std::string_view text) {
  std::string out = "'";
  for (const char c : text) {
    out += c == '\n' || c == '\r' ? ' ' : c;
    if (c == '\'') out += c;
  }
  return out + "'";
}

std::string irl_comment(std::string_view text) {
  std::string out = "{ ";
  for (const char c : text) out += c == '{' ? '[' : c == '}' ? ']' : c;
  return out + " }";
}

const std::string& IrlNames::name(const std::string& key, std::string_view wanted) {
  const auto found = by_key_.find(key);
  if (found != by_key_.end()) return found->second;
  std::string stem;
  for (const char c : wanted) stem += text::is_letter(c) || text::is_digit(c) ? c : '_';
  if (stem.empty() || !text::is_letter(stem[0])) stem = "n_" + stem;
  if (std::find(std::begin(kReserved), std::end(kReserved), text::lower(stem)) !=
          std::end(kReserved) ||
      text::lower(stem).starts_with("r_"))  // names of the system
    stem = "my_" + stem;
  std::string made = stem;
  for (int n = 2; !taken_.insert(text::lower(made)).second; ++n)
    made = stem + "_" + std::to_string(n);
  return by_key_.emplace(key, made).first->second;
}

namespace {

/// Tokens of an expression that has been printed, which tells how they are spelled; operators have
/// the same precedence in both languages.
class Translation {
 public:
  Translation(std::string_view text, const std::map<std::string, IrlSignal>& signals)
      : text_(text), signals_(signals) {}

  Result<std::string> run() {
    while (at_ < text_.size()) RMP_TRY(one());
    if (wants_truth_) return unlike_truth(bool_);
    return out_;
  }

 private:
  Error unlike_truth(const std::string& name) const {
    return error(ErrorCode::unsupported,
                 "the digital signal " + text::quote(name) +
                     " is used other than in a comparison with 0 or 1",
                 "In a program it is a BOOL; write " + name + " == 1.");
  }
  Error no_word(const std::string& what) const {
    return error(ErrorCode::unsupported,
                 "the language has no counterpart of " + text::quote(what) + " in " +
                     text::quote(std::string(text_)),
                 "Programs support signals, numbers and their sqrt and abs.");
  }
  void put(const std::string& token) {
    if (!out_.empty() && out_.back() != '(' && token != ")" && token != ",") out_ += ' ';
    out_ += token;
  }
  Result<void> one() {
    const char c = text_[at_];
    if (c == ' ') {
      ++at_;
      return {};
    }
    if (text::is_digit(c)) return number();
    if (text::is_letter(c) || c == '_' || c == '\'') return word();
    static constexpr std::pair<std::string_view, std::string_view> kSigns[] = {
        {"==", "="}, {"!=", "<>"}, {"<=", "<="}, {">=", ">="}, {"<", "<"}, {">", ">"},
        {"+", "+"},  {"-", "-"},   {"*", "*"},   {"/", "/"},   {"(", "("}, {")", ")"}};
    for (const auto& [ours, theirs] : kSigns) {
      if (text_.substr(at_, ours.size()) != ours) continue;
      const bool is_equality = ours == "==" || ours == "!=";
      if (wants_truth_ && !is_equality) return unlike_truth(bool_);
      compares_truth_ = wants_truth_;
      wants_truth_ = false;
      at_ += ours.size();
      put(std::string(theirs));
      return {};
    }
    return no_word(std::string(1, c));
  }
  Result<void> number() {
    double v = 0;
    const auto end = std::from_chars(text_.data() + at_, text_.data() + text_.size(), v).ptr;
    at_ = static_cast<std::size_t>(end - text_.data());
    // Its unit, as far as it goes on: "3 mm", "2 m/s".
    std::string unit;
    std::size_t look = at_;
    while (look < text_.size()) {
      std::size_t i = look;
      if (unit.empty() && text_[i] == ' ') ++i;
      else if (!unit.empty() && (text_[i] == ' ' || text_[i] == '/' || text_[i] == '^')) ++i;
      else break;
      std::size_t word = i;
      while (word < text_.size() &&
             (text::is_letter(text_[word]) || text_[word] == '%' ||
              (text_[i - 1] == '^' && (text::is_digit(text_[word]) || text_[word] == '-'))))
        ++word;
      if (word == i) break;
      const std::string more = unit + (unit.empty() ? "" : std::string(1, text_[i - 1])) +
                               std::string(text_.substr(i, word - i));
      if (!units::parse(more).ok()) break;
      unit = more;
      look = at_ = word;
    }
    if (!unit.empty()) {
      RMP_TRY_ASSIGN(const units::Unit u, units::parse(unit));
      v = units::to_si(v, u);
    }
    if (compares_truth_) {
      compares_truth_ = false;
      if (v != 0 && v != 1) return unlike_truth(bool_);
      put(v == 1 ? "TRUE" : "FALSE");
      return {};
    }
    put(irl_real(v));
    return {};
  }
  Result<void> word() {
    std::size_t end = at_;
    if (text_[end] == '\'') return no_word(std::string(text_.substr(at_)));
    while (end < text_.size() && (text::is_letter(text_[end]) || text::is_digit(text_[end]) ||
                                  text_[end] == '_' || text_[end] == '.'))
      ++end;
    const std::string w(text_.substr(at_, end - at_));
    at_ = end;
    static const std::map<std::string, std::string> kWords{
        {"and", "AND"}, {"or", "OR"}, {"not", "NOT"}, {"sqrt", "SQRT"}, {"abs", "ABS"}};
    if (const auto it = kWords.find(w); it != kWords.end()) {
      if (wants_truth_) return unlike_truth(bool_);
      put(it->second);
      return {};
    }
    if (w == "pi") {
      put(irl_real(std::numbers::pi));
      return {};
    }
    const auto signal = signals_.find(w);
    if (signal == signals_.end()) return no_word(w);
    if (compares_truth_ || wants_truth_) return unlike_truth(bool_);
    put(signal->second.name);
    if (signal->second.is_bool) {
      wants_truth_ = true;
      bool_ = w;
    }
    return {};
  }

  std::string_view text_;
  const std::map<std::string, IrlSignal>& signals_;
  std::size_t at_ = 0;
  std::string out_, bool_;
  bool wants_truth_ = false;     ///< a BOOL stands last: == or != has to follow
  bool compares_truth_ = false;  ///< and 0 or 1 after that
};

}  // namespace

Result<std::string> irl_expression(const std::string& expression,
                                   const std::map<std::string, IrlSignal>& signals) {
  RMP_TRY_ASSIGN(const Expression e, Expression::compile(expression));
  const std::string printed = e.print();
  return Translation(printed, signals).run();
}

std::string irl_cell(std::size_t joints) {
  constexpr std::size_t kUsual = 6;
  if (joints == kUsual) return {};
  std::string names;
  for (std::size_t j = 1; j <= joints; ++j) names += (j > 1 ? ", A" : "A") + std::to_string(j);
  return "PROGRAM cell;\n"
         "{ A robot of " +
         std::to_string(joints) +
         " joints with one additional axis. }\n"
         "CONST\n"
         "  INT: R_NTURNS := 2, R_NADDJ := 1, R_NJ := " +
         std::to_string(joints + 1) +
         ", R_DEVICE_NUMBER := 1;\n"
         "TYPE\n"
         "  RECORD REAL: " +
         names +
         "; ENDRECORD: MAIN_JOINT;\n"
         "  RECORD REAL: AA1; ENDRECORD: ADD_JOINT;\n"
         "  RECORD MAIN_JOINT: M_JOINT; ADD_JOINT: A_JOINT; ENDRECORD: JOINT;\n"
         "  RECORD\n"
         "    POSE: PSE;\n"
         "    INT: STATUS;\n"
         "    ARRAY [1..R_NTURNS] OF INT: TURNS;\n"
         "    ADD_JOINT: A_JOINT;\n"
         "  ENDRECORD: ROBTARGET;\n"
         "ENDPROGRAM;\n";
}

}  // namespace robomosp::program_source
