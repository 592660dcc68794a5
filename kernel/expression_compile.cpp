// SPDX-License-Identifier: Apache-2.0
// From the text of an expression to its program.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <system_error>
#include <utility>

#include "kernel/expression_grammar.h"
#include "kernel/text.h"

namespace robomosp {

using text::quote;
using units::Dimension;

/// From text to program: tokens on demand, precedence climbing with a limit to its depth.
class ExpressionCompiler : ExpressionGrammar {
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

 private:
  using TokenText = std::string_view;
  enum class Kind : std::uint8_t { end, number, word, quoted, symbol };
  struct Token {
    Kind kind = Kind::end;
    std::size_t begin = 0, end = 0;
    std::string_view text;
    double number = 0;
    std::string_view unit;
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
                 "Split it: give a part of it a name (a parameter).");
  }

  /// Operators of `level` and above. Recursion is bounded by deeper().
  Result<void> expression(int level) {
    const std::size_t begin = token_.begin;
    if (token_.kind == Kind::word && token_.text == "not") {
      if (level > kNot) return fault(begin, "\"not\" needs a condition behind it");
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
    if (c == '=') return fault(p, "\"=\" is not an operator", "Equality is written ==.");
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte == 0x7F)
      return fault(p, "a control character is not allowed in an expression");
    std::size_t e = p + 1;
    while (e < all().size() && (static_cast<unsigned char>(all()[e]) & 0xC0) == 0x80) ++e;
    return fault(
        p, "the character " + quote(all().substr(p, e - p)) + " is not allowed in an expression");
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
      constexpr std::string_view kDegreeSign = "\u00b0";
      const bool is_sign = p < all().size() && all().substr(p).starts_with(kDegreeSign);
      if (p >= all().size() || (!is_letter(all()[p]) && !is_sign)) return {};
      std::size_t e = is_sign ? p + kDegreeSign.size() : word_end(p);
      const std::string_view word = all().substr(p, e - p);
      const std::size_t behind = skip(e);
      const bool is_call = behind < all().size() && (all()[behind] == '(' || all()[behind] == '.');
      if (!units::is_unit_behind_number(word) || is_call) {
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
      hint = "A name right behind a number is its unit; write a product as " +
             std::string(token_.text.empty() ? "2" : token_.text) + " * " + shown(word) + ".";
    return fault(p, e.message, std::move(hint));
  }

  Expression& e_;
  Token token_;
  std::size_t at_ = 0, last_end_ = 0, depth_ = 0;
};

Result<Expression> Expression::compile(std::string_view text) {
  Expression e;
  text = text::trim(text);
  if (text.size() > kLongest)
    return error(ErrorCode::syntax,
                 "the expression has more than " + std::to_string(kLongest) + " characters",
                 "Split it: give a part of it a name (a parameter).");
  e.text_ = std::string(text);
  RMP_TRY(ExpressionCompiler(e).run());
  return e;
}

}  // namespace robomosp
