// SPDX-License-Identifier: Apache-2.0
#include "kernel/expression.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include "kernel/text.h"

namespace robomosp {

enum class Expression::Op : std::uint8_t {
  constant,
  pi,
  unit,  ///< a unit by itself: `mm`
  name,
  negate,
  invert,  ///< not
  either,  ///< or
  both,    ///< and
  less,
  less_equal,
  greater,
  greater_equal,
  equal,
  not_equal,
  add,
  subtract,
  multiply,
  divide,
  power,
  if_,
  sqrt,
  abs,
  min,
  max,
  floor,
  ceil,
  round,
  sin,
  cos,
  tan,
  asin,
  acos,
  atan,
  atan2,
  hypot,
};

bool Expression::Step::operator==(const Step& o) const {
  return op == o.op && count == o.count && constant.value == o.constant.value &&
         constant.dimension == o.constant.dimension && constant.fits_any == o.constant.fits_any;
}

namespace {

using text::quote;
using units::Dimension;

constexpr Dimension kNumber{};
constexpr Dimension kAngle{0, 0, 0, 1};
constexpr std::size_t kMostArguments = 100;
constexpr int kMostPower = 9;      ///< of a unit or a quantity with a dimension
constexpr int kMostExponent = 99;  ///< of a metre, kilogram, ... in a result

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }
bool is_word(std::string_view s) {
  return !s.empty() && is_letter(s.front()) &&
         std::all_of(s.begin(), s.end(), [](char c) { return is_letter(c) || is_digit(c); });
}

/// A piece of the user's text, short enough for a message.
std::string shown(std::string_view s) {
  constexpr std::size_t kMost = 60;
  if (s.size() <= kMost) return std::string(s);
  return std::string(s.substr(0, kMost)) + "...";
}

}  // namespace

bool same_kind(const Dimension& a, const Dimension& b) {
  if (a == b) return true;
  return a[0] == b[0] && a[1] == b[1] && a[2] == b[2] && (a[0] != 0 || a[1] != 0);
}

/// From text to program: tokens on demand, precedence climbing with a limit to its depth.
class ExpressionCompiler {
 public:
  explicit ExpressionCompiler(Expression& e) : e_(e) {}

  Result<void> run() {
    RMP_TRY(advance());
    if (token_.kind == Kind::end) return fault(0, "the expression is empty");
    RMP_TRY(expression(1));
    if (token_.kind == Kind::end) return {};
    if (token_.kind == Kind::word || token_.kind == Kind::number || token_.kind == Kind::quoted ||
        is(TokenText{"("}))
      return fault(token_.begin, "an operator is missing before " + quote(token_.text),
                   "Products are written with *: 2 * bore. Only a unit follows a number directly.");
    return fault(token_.begin, quote(token_.text) + " is not expected here");
  }

  struct Function {
    std::string_view name;
    Expression::Op op;
    std::uint32_t least, most;
    std::string_view sample;
  };
  static const Function* find_function(std::string_view name) {
    for (const Function& f : kFunctions)
      if (f.name == name) return &f;
    return nullptr;
  }
  static const Function* find_function(Expression::Op op) {
    for (const Function& f : kFunctions)
      if (f.op == op) return &f;
    return nullptr;
  }
  static bool is_keyword(std::string_view s) { return s == "and" || s == "or" || s == "not"; }

  struct Binary {
    std::string_view text;
    Expression::Op op;
    int level;
  };
  static const Binary* find_binary(Expression::Op op) {
    for (const Binary& b : kBinaries)
      if (b.op == op) return &b;
    return nullptr;
  }

  // Levels of precedence: or 1, and 2, not 3, comparisons 4, sums 5, products 6, sign 7, power 8.
  static constexpr int kNot = 3, kCompare = 4, kProduct = 6, kSign = 7, kPower = 8, kAtom = 9;

 private:
  using Op = Expression::Op;
  using TokenText = std::string_view;
  enum class Kind : std::uint8_t { end, number, word, quoted, symbol };
  struct Token {
    Kind kind = Kind::end;
    std::size_t begin = 0, end = 0;
    std::string_view text;
    double number = 0;
    std::string_view unit;
  };

  static constexpr Function kFunctions[] = {
      {"if", Op::if_, 3, 3, "if(a > b, a, b)"},
      {"sqrt", Op::sqrt, 1, 1, "sqrt(area)"},
      {"abs", Op::abs, 1, 1, "abs(x)"},
      {"min", Op::min, 1, kMostArguments, "min(a, b)"},
      {"max", Op::max, 1, kMostArguments, "max(a, b)"},
      {"floor", Op::floor, 1, 1, "floor(x / mm)"},
      {"ceil", Op::ceil, 1, 1, "ceil(x / mm)"},
      {"round", Op::round, 1, 1, "round(x / mm)"},
      {"sin", Op::sin, 1, 1, "sin(30 deg)"},
      {"cos", Op::cos, 1, 1, "cos(30 deg)"},
      {"tan", Op::tan, 1, 1, "tan(30 deg)"},
      {"asin", Op::asin, 1, 1, "asin(a / b)"},
      {"acos", Op::acos, 1, 1, "acos(a / b)"},
      {"atan", Op::atan, 1, 1, "atan(a / b)"},
      {"atan2", Op::atan2, 2, 2, "atan2(y, x)"},
      {"hypot", Op::hypot, 2, kMostArguments, "hypot(x, y)"},
  };
  static constexpr Binary kBinaries[] = {
      {"or", Op::either, 1},
      {"and", Op::both, 2},
      {"<", Op::less, kCompare},
      {"<=", Op::less_equal, kCompare},
      {">", Op::greater, kCompare},
      {">=", Op::greater_equal, kCompare},
      {"==", Op::equal, kCompare},
      {"!=", Op::not_equal, kCompare},
      {"+", Op::add, 5},
      {"-", Op::subtract, 5},
      {"*", Op::multiply, kProduct},
      {"/", Op::divide, kProduct},
      {"^", Op::power, kPower},
  };

  [[nodiscard]] Error fault(std::size_t at, std::string message, std::string hint = {}) const {
    return e_.fault(at, ErrorCode::syntax, std::move(message), std::move(hint));
  }
  [[nodiscard]] bool is(TokenText symbol) const {
    return token_.kind == Kind::symbol && token_.text == symbol;
  }
  [[nodiscard]] const Binary* binary() const {
    if (token_.kind != Kind::symbol && token_.kind != Kind::word) return nullptr;
    for (const Binary& b : kBinaries)
      if (b.text == token_.text) return &b;
    return nullptr;
  }
  void emit(Op op, std::uint32_t count, std::size_t begin, std::size_t at) {
    Expression::Step s;
    s.op = op;
    s.count = count;
    s.begin = static_cast<std::uint32_t>(begin);
    s.end = static_cast<std::uint32_t>(last_end_);
    s.at = static_cast<std::uint32_t>(at);
    e_.code_.push_back(std::move(s));
  }
  Result<void> deeper(std::size_t at) {
    if (++depth_ <= Expression::kDeepest) return {};
    return fault(at,
                 "the expression is nested more than " + std::to_string(Expression::kDeepest) +
                     " levels deep",
                 "Give a part of it a name of its own.");
  }

  /// Operators of `level` and above. Recursion is bounded by deeper().
  Result<void> expression(int level) {
    const std::size_t begin = token_.begin;
    if (token_.kind == Kind::word && token_.text == "not") {
      if (level > kNot) return fault(begin, "\"not\" stands in front of a condition");
      RMP_TRY(deeper(begin));
      RMP_TRY(advance());
      RMP_TRY(expression(kNot));
      emit(Op::invert, 1, begin, begin);
      --depth_;
    } else {
      RMP_TRY(sign());
    }
    bool is_compared = false;
    for (;;) {
      const Binary* b = binary();
      if (!b || b->level < level || b->op == Op::power) return {};
      const std::size_t at = token_.begin;
      if (b->level == kCompare && std::exchange(is_compared, true))
        return fault(at, "comparisons cannot follow each other", "Write a < b and b < c.");
      RMP_TRY(advance());
      RMP_TRY(expression(b->level + 1));
      emit(b->op, 2, begin, at);
    }
  }
  Result<void> sign() {
    if (!is("-") && !is("+")) return power();
    const std::size_t begin = token_.begin;
    const bool is_minus = is("-");
    RMP_TRY(deeper(begin));
    RMP_TRY(advance());
    RMP_TRY(sign());
    if (is_minus) emit(Op::negate, 1, begin, begin);
    --depth_;
    return {};
  }
  Result<void> power() {
    const std::size_t begin = token_.begin;
    RMP_TRY(primary());
    if (!is("^")) return {};
    const std::size_t at = token_.begin;
    RMP_TRY(deeper(at));
    RMP_TRY(advance());
    RMP_TRY(sign());
    emit(Op::power, 2, begin, at);
    --depth_;
    return {};
  }
  Result<void> primary() {
    const Token t = token_;
    switch (t.kind) {
      case Kind::end: return fault(t.begin, "the expression ends where a value is expected");
      case Kind::number: return number();
      case Kind::quoted: return name();
      case Kind::word: break;
      case Kind::symbol: {
        if (t.text != "(") return fault(t.begin, "a value is expected here, not " + quote(t.text));
        RMP_TRY(deeper(t.begin));
        RMP_TRY(advance());
        RMP_TRY(expression(1));
        RMP_TRY(close(t.begin));
        --depth_;
        return {};
      }
    }
    if (next_is('(')) return call();
    if (next_is('.')) return name();
    if (is_keyword(t.text)) return fault(t.begin, "a value is expected here, not " + quote(t.text));
    if (t.text == "pi") {
      RMP_TRY(advance());
      emit(Op::pi, 0, t.begin, t.begin);
      e_.code_.back().constant.value = std::numbers::pi;
      return {};
    }
    if (units::is_unit(t.text)) {
      const auto unit = units::parse(t.text);
      RMP_TRY(advance());
      emit(Op::unit, 0, t.begin, t.begin);
      e_.code_.back().constant = {units::to_si(1, *unit), unit->dimension, false};
      e_.code_.back().unit = std::string(t.text);
      return {};
    }
    if (const Function* f = find_function(t.text))
      return fault(t.begin, quote(t.text) + " is a function",
                   "Write " + std::string(f->sample) + ".");
    return name();
  }
  Result<void> number() {
    const Token t = token_;
    RMP_TRY(advance());
    emit(Op::constant, 0, t.begin, t.begin);
    Expression::Step& s = e_.code_.back();
    s.number = t.number;
    s.unit = std::string(t.unit);
    s.constant = {t.number, kNumber, t.number == 0 && t.unit.empty()};
    if (t.unit.empty()) return {};
    const auto unit = units::parse(t.unit);
    if (!unit.ok()) return fault(t.begin, unit.error().message, unit.error().hint);
    s.constant = {units::to_si(t.number, *unit), unit->dimension, false};
    if (!std::isfinite(s.constant.value))
      return fault(t.begin, quote(shown(t.text)) + " is outside the range of real numbers");
    return {};
  }
  /// `bore`, `cell.bore` or `'my cell'.bore`.
  Result<void> name() {
    const std::size_t begin = token_.begin;
    std::string scope, last(token_.text);
    const bool is_quoted = token_.kind == Kind::quoted;
    const bool is_scope = next_is('.');
    if (is_quoted && !is_scope)
      return fault(begin, "a name in quotes is that of a world and needs a parameter behind it",
                   "Such as 'my cell'.bore.");
    RMP_TRY(advance());
    if (is_scope) {
      scope = std::move(last);
      RMP_TRY(advance());  // the dot
      if (token_.kind != Kind::word)
        return fault(token_.begin, "the name of a parameter is expected behind the dot");
      last = std::string(token_.text);
      RMP_TRY(advance());
    }
    const Expression::Name name{std::move(scope), std::move(last)};
    const auto known = std::find(e_.names_.begin(), e_.names_.end(), name);
    const auto index = static_cast<std::size_t>(known - e_.names_.begin());
    if (known == e_.names_.end()) e_.names_.push_back(name);
    e_.places_.push_back({index, begin, last_end_});
    emit(Op::name, static_cast<std::uint32_t>(index), begin, begin);
    return {};
  }
  Result<void> call() {
    const Token t = token_;
    const Function* f = find_function(t.text);
    if (!f) {
      std::vector<std::string> names;
      for (const Function& k : kFunctions) names.emplace_back(k.name);
      std::string hint = text::did_you_mean(t.text, names);
      if (hint.empty()) hint = "Functions are " + text::enumerate(names) + ".";
      return fault(t.begin, "there is no function " + quote(t.text), std::move(hint));
    }
    RMP_TRY(deeper(t.begin));
    RMP_TRY(advance());
    const std::size_t open = token_.begin;
    RMP_TRY(advance());
    std::uint32_t count = 0;
    if (!is(")"))
      for (;;) {
        RMP_TRY(expression(1));
        ++count;
        if (!is(",")) break;
        if (count == kMostArguments)
          return fault(token_.begin, quote(t.text) + " has more than " +
                                         std::to_string(kMostArguments) + " arguments");
        RMP_TRY(advance());
      }
    RMP_TRY(close(open));
    if (count < f->least || count > f->most)
      return fault(t.begin,
                   quote(t.text) + " is given " + std::to_string(count) +
                       (count == 1 ? " argument" : " arguments"),
                   "Write " + std::string(f->sample) + ".");
    emit(f->op, count, t.begin, t.begin);
    --depth_;
    return {};
  }
  Result<void> close(std::size_t open) {
    if (is(")")) return advance();
    if (token_.kind == Kind::end)
      return fault(open, "this bracket is not closed", "Add the \")\" that is missing.");
    if (is(",")) return fault(token_.begin, "there is no function for this comma");
    return fault(token_.begin, "an operator or \")\" is expected here, not " + quote(token_.text));
  }

  // ---- tokens: token_ is the next one not yet used, at_ stands behind it ----

  [[nodiscard]] std::string_view all() const { return e_.text_; }
  [[nodiscard]] std::size_t skip(std::size_t p) const {
    while (p < all().size() && is_blank(all()[p])) ++p;
    return p;
  }
  [[nodiscard]] bool next_is(char c) const {
    const std::size_t p = skip(at_);
    return p < all().size() && all()[p] == c;
  }
  [[nodiscard]] std::size_t word_end(std::size_t p) const {
    while (p < all().size() && (is_letter(all()[p]) || is_digit(all()[p]))) ++p;
    return p;
  }

  Result<void> advance() {
    last_end_ = token_.end;
    const std::size_t p = at_ = skip(at_);
    token_ = {Kind::end, p, p, {}, 0, {}};
    if (p >= all().size()) return {};
    const char c = all()[p];
    if (is_letter(c)) {
      at_ = word_end(p);
      token_.kind = Kind::word;
    } else if (is_digit(c) || (c == '.' && p + 1 < all().size() && is_digit(all()[p + 1]))) {
      return lex_number(p);
    } else if (c == '\'') {
      const std::size_t close = all().find('\'', p + 1);
      if (close == std::string_view::npos || close == p + 1)
        return fault(p, "the name in quotes is not closed or empty", "Such as 'my cell'.bore.");
      at_ = close + 1;
      token_ = {Kind::quoted, p, at_, all().substr(p + 1, close - p - 1), 0, {}};
      return {};
    } else {
      const std::string_view two = all().substr(p, 2);
      const bool is_double = two == "<=" || two == ">=" || two == "==" || two == "!=";
      if (!is_double && std::string_view("+-*/^(),<>.").find(c) == std::string_view::npos)
        return strange(p);
      at_ = p + (is_double ? 2 : 1);
      token_.kind = Kind::symbol;
    }
    token_.end = at_;
    token_.text = all().substr(p, at_ - p);
    return {};
  }
  [[nodiscard]] Error strange(std::size_t p) const {
    const char c = all()[p];
    if (c == '=') return fault(p, "\"=\" cannot stand here", "Equality is written ==.");
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte == 0x7F) return fault(p, "a control character cannot stand here");
    std::size_t e = p + 1;
    while (e < all().size() && (static_cast<unsigned char>(all()[e]) & 0xC0) == 0x80) ++e;
    return fault(p, "the character " + quote(all().substr(p, e - p)) + " cannot stand here");
  }

  Result<void> lex_number(std::size_t p) {
    const char* const last = all().data() + all().size();
    const auto got = std::from_chars(all().data() + p, last, token_.number);
    at_ = static_cast<std::size_t>(got.ptr - all().data());
    if (got.ec == std::errc::result_out_of_range)
      return fault(
          p, quote(shown(all().substr(p, at_ - p))) + " is outside the range of real numbers");
    if (at_ < all().size() && (all()[at_] == '.' || is_digit(all()[at_])))
      return fault(p, quote(shown(all().substr(p, at_ + 1 - p))) + " is not a number");
    RMP_TRY(lex_unit());
    token_.kind = Kind::number;
    token_.end = at_;
    token_.text = all().substr(p, at_ - p);
    return {};
  }
  /// Units directly behind a number, as far as they go: `mm`, `N m`, `kg/m^3`. The name of a
  /// function in front of its bracket and a world in front of its dot are none.
  Result<void> lex_unit() {
    std::size_t begin = std::string_view::npos;
    for (;;) {
      std::size_t p = skip(at_);
      const bool is_first = begin == std::string_view::npos;
      if (!is_first && p < all().size() && all()[p] == '/') p = skip(p + 1);
      else if (is_first && p < all().size() && all()[p] == '%') {
        token_.unit = all().substr(p, 1);
        at_ = p + 1;
        return {};
      }
      if (p >= all().size() || !is_letter(all()[p])) return {};
      std::size_t e = word_end(p);
      const std::string_view word = all().substr(p, e - p);
      const std::size_t behind = skip(e);
      const bool is_call = behind < all().size() && (all()[behind] == '(' || all()[behind] == '.');
      if (!units::is_unit(word) || is_call) {
        if (!is_first || is_keyword(word)) return {};
        if (!is_call && !is_number_word(word)) return not_a_unit(p, word);
        return fault(p, "an operator is missing before " + quote(word),
                     "Products are written with *: 2 * bore.");
      }
      if (behind < all().size() && all()[behind] == '^') {
        std::size_t digits = skip(behind + 1);
        const std::size_t sign = digits;
        if (digits < all().size() && all()[digits] == '-') ++digits;
        int power = 0;
        const auto got = std::from_chars(all().data() + sign, all().data() + all().size(), power);
        e = static_cast<std::size_t>(got.ptr - all().data());
        if (got.ec != std::errc() || power == 0 || std::abs(power) > kMostPower ||
            (e < all().size() && (all()[e] == '.' || is_letter(all()[e]))))
          return fault(sign, "the power of a unit is a whole number from -9 to 9",
                       "The power of a number with its unit is written in brackets: (3 mm)^2.");
      }
      if (is_first) begin = p;
      at_ = e;
      token_.unit = all().substr(begin, e - begin);
    }
  }
  static bool is_number_word(std::string_view word) {
    return word == "pi" || find_function(word) != nullptr;
  }
  [[nodiscard]] Error not_a_unit(std::size_t p, std::string_view word) const {
    const Error e = units::parse(word).error();
    std::string hint = e.hint;
    if (!hint.starts_with("Did you mean"))
      hint = "Behind a number stands its unit; a product is written " +
             std::string(token_.text.empty() ? "2" : token_.text) + " * " + shown(word) + ".";
    return fault(p, e.message, std::move(hint));
  }

  Expression& e_;
  Token token_;
  std::size_t at_ = 0, last_end_ = 0, depth_ = 0;
};

/// Runs a program on a stack of cells.
class ExpressionMachine {
 public:
  ExpressionMachine(const Expression& e, const Expression::Lookup& lookup)
      : e_(e), lookup_(lookup), known_(e.names_.size()) {}

  Result<Quantity> run() {
    for (const Step& s : e_.code_) RMP_TRY(step(s));
    const Cell& top = stack_.back();
    if (top.is_condition)
      return e_.fault(0, ErrorCode::invalid_argument, "this is a condition, not a quantity",
                      "Conditions stand in if: if(a > b, a, b).");
    if (top.fault) return faults_[*top.fault];
    return Quantity{top.value, top.dimension, top.fits_any};
  }

 private:
  using Op = Expression::Op;
  using Step = Expression::Step;
  struct Cell {
    double value = 0;  ///< of a condition 0 or 1
    Dimension dimension{};
    bool fits_any = false, is_condition = false;
    std::optional<std::size_t> fault;  ///< there is no value, because of faults_[*fault]
    std::uint32_t begin = 0, end = 0;
  };
  using Arguments = const Cell*;

  [[nodiscard]] std::string source(const Cell& c) const {
    return shown(std::string_view(e_.text_).substr(c.begin, c.end - c.begin));
  }
  /// "a length (3 mm)"
  [[nodiscard]] std::string kind(const Cell& c) const {
    return (c.is_condition ? std::string("a condition") : units::kind_of(c.dimension)) + " (" +
           source(c) + ")";
  }
  [[nodiscard]] Error wrong(const Step& s, std::string message, std::string hint = {}) const {
    return e_.fault(s.at, ErrorCode::invalid_argument, std::move(message), std::move(hint));
  }
  static bool is_plain(const Cell& c) { return c.dimension == kNumber; }
  static std::string function_name(Op op) {
    return std::string(ExpressionCompiler::find_function(op)->name);
  }

  Result<void> step(const Step& s) {
    Cell out;
    out.begin = s.begin;
    out.end = s.end;
    if (s.op <= Op::name) {
      Quantity q = s.constant;
      if (s.op == Op::name) {
        auto& known = known_[s.count];
        if (!known) {
          auto got = lookup_(e_.names_[s.count]);
          if (!got.ok()) {
            Error& e = got.error();
            return e_.fault(s.at, e.code, e.where.empty() ? e.message : e.where + ": " + e.message,
                            e.hint);
          }
          known = *got;
        }
        q = *known;
      }
      out.value = q.value;
      out.dimension = q.dimension;
      out.fits_any = q.fits_any;
      stack_.push_back(out);
      return {};
    }
    const Arguments a = stack_.data() + (stack_.size() - s.count);
    RMP_TRY(check_conditions(s, a));
    RMP_TRY(apply(s, a, out));
    // A fault of an operand is one of the result, unless the operation looked past it itself.
    if (s.op != Op::if_ && s.op != Op::both && s.op != Op::either)
      for (std::uint32_t i = 0; i < s.count && !out.fault; ++i) out.fault = a[i].fault;
    if (!out.fault && !out.is_condition && !std::isfinite(out.value))
      out.fault = add_fault(s, source(out) + " is beyond the range of real numbers");
    stack_.resize(stack_.size() - s.count);
    stack_.push_back(out);
    return {};
  }
  std::size_t add_fault(const Step& s, std::string message, std::string hint = {}) {
    faults_.push_back(wrong(s, std::move(message), std::move(hint)));
    return faults_.size() - 1;
  }

  /// Conditions are wanted by and, or, not and as the first argument of if, and nowhere else.
  [[nodiscard]] Result<void> check_conditions(const Step& s, Arguments a) const {
    for (std::uint32_t i = 0; i < s.count; ++i) {
      const bool wants = s.op == Op::both || s.op == Op::either || s.op == Op::invert ||
                         (s.op == Op::if_ && i == 0);
      if (wants == a[i].is_condition) continue;
      if (wants)
        return wrong(s, kind(a[i]) + " stands where a condition is expected",
                     "Compare it: " + source(a[i]) + " > 0.");
      return wrong(s, "the condition " + source(a[i]) + " stands where a quantity is expected",
                   "Conditions stand in if: if(a > b, a, b).");
    }
    return {};
  }

  /// Operands of one kind: sets the dimension of the result. `done` as in "added".
  Result<void> common(const Step& s, Arguments a, std::uint32_t first, std::string_view done,
                      Cell& out) const {
    const Cell* measure = nullptr;  // the first that is not the 0 of everything
    for (std::uint32_t i = first; i < s.count; ++i) {
      if (a[i].fits_any) continue;
      if (!measure) {
        measure = &a[i];
        out.dimension = a[i].dimension;
        continue;
      }
      if (!same_kind(out.dimension, a[i].dimension)) {
        const bool one_is_plain = is_plain(*measure) || is_plain(a[i]);
        return wrong(s, kind(*measure) + " and " + kind(a[i]) + " cannot be " + std::string(done),
                     one_is_plain ? "Give the number a unit." : "");
      }
      // 1 m + 1 m rad is a length.
      if (std::abs(a[i].dimension[3]) < std::abs(out.dimension[3])) out.dimension = a[i].dimension;
    }
    out.fits_any = measure == nullptr;
    return {};
  }
  Result<void> need_angle(const Step& s, const Cell& c) const {
    if (c.dimension == kAngle || c.fits_any) return {};
    return wrong(s,
                 function_name(s.op) + " needs an angle; " + source(c) + " is " +
                     units::kind_of(c.dimension),
                 is_plain(c) ? "Write 30 deg, or multiply a number of radians by rad." : "");
  }
  Result<void> need_number(const Step& s, const Cell& c, std::string hint = {}) const {
    if (is_plain(c)) return {};
    return wrong(s,
                 function_name(s.op) + " needs a number without a unit; " + source(c) + " is " +
                     units::kind_of(c.dimension),
                 std::move(hint));
  }
  Result<void> limit(const Step& s, const Cell& out) const {
    for (const int e : out.dimension)
      if (std::abs(e) > kMostExponent)
        return wrong(s, "the unit of " + source(out) + " has a power beyond " +
                            std::to_string(kMostExponent));
    return {};
  }

  Result<void> apply(const Step& s, Arguments a, Cell& out) {
    switch (s.op) {
      case Op::negate:
        out.dimension = a[0].dimension;
        out.fits_any = a[0].fits_any;
        out.value = -a[0].value;
        return {};
      case Op::add:
      case Op::subtract:
        RMP_TRY(common(s, a, 0, s.op == Op::add ? "added" : "subtracted", out));
        out.value = s.op == Op::add ? a[0].value + a[1].value : a[0].value - a[1].value;
        return {};
      case Op::multiply:
      case Op::divide: return product(s, a, out);
      case Op::power: return power(s, a, out);
      case Op::less:
      case Op::less_equal:
      case Op::greater:
      case Op::greater_equal:
      case Op::equal:
      case Op::not_equal: return compare(s, a, out);
      case Op::invert:
        out.is_condition = true;
        out.value = 1 - a[0].value;
        return {};
      case Op::both:
      case Op::either: {
        // The left side decides when it can, and then the right one may have no value.
        const double decisive = s.op == Op::both ? 0 : 1;
        out.is_condition = true;
        const Cell& chosen = a[0].fault || a[0].value == decisive ? a[0] : a[1];
        out.value = chosen.value;
        out.fault = chosen.fault;
        return {};
      }
      case Op::if_: {
        RMP_TRY(common(s, a, 1, "alternatives of one if", out));
        const Cell& chosen = a[a[0].value != 0 ? 1 : 2];
        out.value = chosen.value;
        out.fault = a[0].fault ? a[0].fault : chosen.fault;
        return {};
      }
      default: return function(s, a, out);
    }
  }

  Result<void> product(const Step& s, Arguments a, Cell& out) {
    const int sign = s.op == Op::multiply ? 1 : -1;
    for (std::size_t i = 0; i < out.dimension.size(); ++i)
      out.dimension[i] = a[0].dimension[i] + sign * a[1].dimension[i];
    RMP_TRY(limit(s, out));
    if (s.op == Op::multiply) {
      out.value = a[0].value * a[1].value;
    } else if (a[1].value == 0 && !a[1].fault) {
      out.fault = add_fault(s, "division by zero: " + source(a[1]) + " is 0");
    } else {
      out.value = a[0].value / a[1].value;
    }
    return {};
  }

  Result<void> power(const Step& s, Arguments a, Cell& out) {
    if (!is_plain(a[1]))
      return wrong(
          s, "an exponent has no unit; " + source(a[1]) + " is " + units::kind_of(a[1].dimension));
    const double e = a[1].value;
    if (!is_plain(a[0])) {
      if (a[1].fault) return {};
      if (e != std::floor(e) || std::fabs(e) > kMostPower)
        return wrong(s,
                     kind(a[0]) + " can be raised to whole powers from -9 to 9, not to " +
                         text::print_rounded(e),
                     "Roots of it are taken with sqrt.");
      for (std::size_t i = 0; i < out.dimension.size(); ++i)
        out.dimension[i] = static_cast<int>(e) * a[0].dimension[i];
      RMP_TRY(limit(s, out));
    }
    if (a[0].value == 0 && e < 0 && !a[0].fault) {
      out.fault = add_fault(s, "division by zero: " + source(a[0]) + " is 0");
      return {};
    }
    out.value = std::pow(a[0].value, e);
    if (std::isnan(out.value) && !a[0].fault && !a[1].fault)
      out.fault =
          add_fault(s, source(a[0]) + " is negative and has no power " + text::print_rounded(e));
    return {};
  }

  Result<void> compare(const Step& s, Arguments a, Cell& out) {
    RMP_TRY(common(s, a, 0, "compared", out));
    out.dimension = kNumber;
    out.fits_any = false;
    out.is_condition = true;
    const double x = a[0].value, y = a[1].value;
    bool yes = false;
    switch (s.op) {
      case Op::less: yes = x < y; break;
      case Op::less_equal: yes = x <= y; break;
      case Op::greater: yes = x > y; break;
      case Op::greater_equal: yes = x >= y; break;
      case Op::equal: yes = x == y; break;
      default: yes = x != y; break;
    }
    out.value = yes ? 1 : 0;
    return {};
  }

  Result<void> function(const Step& s, Arguments a, Cell& out) {
    const double x = a[0].value;
    const std::string whole =
        "Divide by the unit first: " + function_name(s.op) + "(" + source(a[0]) + " / mm) * mm.";
    switch (s.op) {
      case Op::sqrt:
        for (std::size_t i = 0; i < out.dimension.size(); ++i) {
          int e = a[0].dimension[i];
          if (i == 3 && e % 2 != 0 && (a[0].dimension[0] != 0 || a[0].dimension[1] != 0)) e = 0;
          if (e % 2 != 0) return wrong(s, "the root of " + kind(a[0]) + " has no unit");
          out.dimension[i] = e / 2;
        }
        if (x < 0 && !a[0].fault)
          out.fault = add_fault(s, "the root of a negative number: " + source(a[0]) + " is " +
                                       text::print_rounded(x));
        else out.value = std::sqrt(x);
        return {};
      case Op::abs:
        RMP_TRY(common(s, a, 0, "", out));
        out.value = std::fabs(x);
        return {};
      case Op::min:
      case Op::max:
        RMP_TRY(common(s, a, 0, "compared", out));
        out.value = x;
        for (std::uint32_t i = 1; i < s.count; ++i)
          out.value =
              s.op == Op::min ? std::fmin(out.value, a[i].value) : std::fmax(out.value, a[i].value);
        return {};
      case Op::hypot:
        RMP_TRY(common(s, a, 0, "sides of one triangle", out));
        out.value = std::fabs(x);
        for (std::uint32_t i = 1; i < s.count; ++i) out.value = std::hypot(out.value, a[i].value);
        return {};
      case Op::floor:
        RMP_TRY(need_number(s, a[0], whole));
        out.value = std::floor(x);
        return {};
      case Op::ceil:
        RMP_TRY(need_number(s, a[0], whole));
        out.value = std::ceil(x);
        return {};
      case Op::round:
        RMP_TRY(need_number(s, a[0], whole));
        out.value = std::round(x);
        return {};
      case Op::sin:
        RMP_TRY(need_angle(s, a[0]));
        out.value = std::sin(x);
        return {};
      case Op::cos:
        RMP_TRY(need_angle(s, a[0]));
        out.value = std::cos(x);
        return {};
      case Op::tan:
        RMP_TRY(need_angle(s, a[0]));
        out.value = std::tan(x);
        return {};
      case Op::asin:
      case Op::acos:
        RMP_TRY(need_number(s, a[0]));
        out.dimension = kAngle;
        if (std::fabs(x) > 1 && !a[0].fault)
          out.fault = add_fault(s, function_name(s.op) + " needs a number from -1 to 1; " +
                                       source(a[0]) + " is " + text::print_rounded(x));
        else out.value = s.op == Op::asin ? std::asin(x) : std::acos(x);
        return {};
      case Op::atan:
        RMP_TRY(need_number(s, a[0]));
        out.dimension = kAngle;
        out.value = std::atan(x);
        return {};
      case Op::atan2:
        RMP_TRY(common(s, a, 0, "sides of one triangle", out));
        out.dimension = kAngle;
        out.fits_any = false;
        out.value = std::atan2(x, a[1].value);
        return {};
      default: return {};
    }
  }

  const Expression& e_;
  const Expression::Lookup& lookup_;
  std::vector<std::optional<Quantity>> known_;
  std::vector<Cell> stack_;
  std::vector<Error> faults_;
};

Error Expression::fault(std::size_t at, ErrorCode code, std::string message,
                        std::string hint) const {
  return error(code, std::move(message), std::move(hint),
               "at character " + std::to_string(at + 1) + " of " + quote(shown(text_)));
}

Result<Expression> Expression::compile(std::string_view text) {
  Expression e;
  text = text::trim(text);
  if (text.size() > kLongest)
    return error(ErrorCode::syntax,
                 "the expression has more than " + std::to_string(kLongest) + " characters",
                 "Give a part of it a name of its own.");
  e.text_ = std::string(text);
  RMP_TRY(ExpressionCompiler(e).run());
  return e;
}

bool Expression::is_literal() const {
  return !code_.empty() && code_[0].op == Op::constant &&
         (code_.size() == 1 || (code_.size() == 2 && code_[1].op == Op::negate));
}

Result<Quantity> Expression::evaluate(const Lookup& lookup) const {
  return ExpressionMachine(*this, lookup).run();
}

Result<double> Expression::evaluate(const Lookup& lookup, std::string_view si_unit) const {
  RMP_TRY_ASSIGN(const Quantity q, evaluate(lookup));
  RMP_TRY_ASSIGN(const units::Unit expected, units::parse(si_unit));
  if (q.fits_any || same_kind(q.dimension, expected.dimension)) return q.value;
  std::string want = units::kind_of(expected.dimension);
  if (!si_unit.empty() && !want.ends_with(si_unit)) want += " (" + std::string(si_unit) + ")";
  return error(
      ErrorCode::invalid_argument,
      quote(shown(text_)) + " is " + units::kind_of(q.dimension) + "; " + want + " is expected",
      q.dimension == kNumber
          ? "Multiply it by a unit, such as " +
                std::string(expected.dimension == kAngle                  ? "deg"
                            : expected.dimension == Dimension{1, 0, 0, 0} ? "mm"
                                                                          : si_unit) +
                "."
          : "");
}

std::string Expression::spell(const Name& n) {
  if (n.scope.empty()) return n.name;
  return (is_word(n.scope) ? n.scope : "'" + n.scope + "'") + "." + n.name;
}

std::string Expression::renamed(const std::function<Name(const Name&)>& rename) const {
  std::string out;
  std::size_t done = 0;
  for (const Place& p : places_) {
    const Name& before = names_[p.name];
    const Name after = rename(before);
    out += text_.substr(done, p.begin - done);
    out += after == before ? text_.substr(p.begin, p.end - p.begin) : spell(after);
    done = p.end;
  }
  return out + text_.substr(done);
}

Result<void> Expression::check_name(std::string_view name, std::string_view what) {
  const std::string subject = quote(shown(name)) + " cannot name a " + std::string(what);
  if (!is_word(name))
    return error(ErrorCode::invalid_argument, subject,
                 "A name is a letter or _, then letters, digits and _.");
  const char* is = units::is_unit(name)                      ? "a unit"
                   : ExpressionCompiler::find_function(name) ? "a function"
                   : name == "pi"                            ? "a constant"
                   : ExpressionCompiler::is_keyword(name)    ? "a word of expressions"
                                                             : nullptr;
  if (!is) return {};
  return error(ErrorCode::conflict, subject + ": it is " + is,
               "Choose a longer one, such as " + std::string(name) + "_1.");
}

std::string Expression::print() const {
  struct Piece {
    std::string text;
    int level = 0;          ///< of its outermost operator
    bool has_unit = false;  ///< ends in the unit of a number, which a `/` behind would continue
    bool is_unit = false;   ///< begins with a unit that would continue it
  };
  using Compiler = ExpressionCompiler;
  const auto bracketed = [](const Piece& p, bool needs) {
    return needs ? "(" + p.text + ")" : p.text;
  };
  std::vector<Piece> stack;
  for (const Step& s : code_) {
    Piece out;
    std::vector<Piece> a;
    if (s.op > Op::name) {
      a.assign(stack.end() - static_cast<std::ptrdiff_t>(s.count), stack.end());
      stack.resize(stack.size() - s.count);
    }
    switch (s.op) {
      case Op::constant:
        out = {text::print(s.number) + (s.unit.empty() ? "" : " " + s.unit), Compiler::kAtom,
               !s.unit.empty()};
        break;
      case Op::pi: out = {"pi", Compiler::kAtom, false}; break;
      case Op::unit: out = {s.unit, Compiler::kAtom, false, true}; break;
      case Op::name: out = {spell(names_[s.count]), Compiler::kAtom, false}; break;
      case Op::negate:
        out = {"-" + bracketed(a[0], a[0].level < Compiler::kSign), Compiler::kSign, a[0].has_unit};
        break;
      case Op::invert:
        out = {"not " + bracketed(a[0], a[0].level < Compiler::kNot), Compiler::kNot, false};
        break;
      default: {
        if (const auto* b = Compiler::find_binary(s.op)) {
          const bool is_power = s.op == Op::power, is_compare = b->level == Compiler::kCompare;
          const bool is_joined = s.op == Op::divide && a[0].has_unit && a[1].is_unit;
          const bool left = a[0].level < b->level || is_joined ||
                            (is_compare && a[0].level == b->level) ||
                            (is_power && (a[0].level <= b->level || a[0].has_unit));
          const bool right = is_power ? a[1].level < Compiler::kSign : a[1].level <= b->level;
          const std::string sign = is_power ? "^" : " " + std::string(b->text) + " ";
          out = {bracketed(a[0], left) + sign + bracketed(a[1], right), b->level,
                 a[1].has_unit && !right, a[0].is_unit && !left};
          break;
        }
        std::string list;
        for (const Piece& p : a) list += (list.empty() ? "" : ", ") + p.text;
        out = {std::string(Compiler::find_function(s.op)->name) + "(" + list + ")", Compiler::kAtom,
               false};
      }
    }
    stack.push_back(std::move(out));
  }
  return stack.empty() ? std::string() : std::move(stack.back().text);
}

}  // namespace robomosp
