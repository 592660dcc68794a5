// SPDX-License-Identifier: Apache-2.0
#include "kernel/expression.h"

#include <utility>

#include "kernel/expression_grammar.h"
#include "kernel/text.h"

namespace robomosp {
namespace {

using text::quote;
using units::Dimension;
using Grammar = ExpressionGrammar;

}  // namespace

bool Expression::Step::operator==(const Step& o) const {
  return op == o.op && count == o.count && constant.value == o.constant.value &&
         constant.dimension == o.constant.dimension && constant.fits_any == o.constant.fits_any;
}

bool same_kind(const Dimension& a, const Dimension& b) {
  if (a == b) return true;
  return a[0] == b[0] && a[1] == b[1] && a[2] == b[2] && (a[0] != 0 || a[1] != 0);
}

Error Expression::fault(std::size_t at, ErrorCode code, std::string message,
                        std::string hint) const {
  return error(code, std::move(message), std::move(hint),
               "at character " + std::to_string(at + 1) + " of " + quote(Grammar::shown(text_)));
}

bool Expression::is_literal() const {
  return !code_.empty() && code_[0].op == Op::constant &&
         (code_.size() == 1 || (code_.size() == 2 && code_[1].op == Op::negate));
}

std::string Expression::spell(const Name& n) {
  if (n.scope.empty()) return n.name;
  return (Grammar::is_word(n.scope) ? n.scope : "'" + n.scope + "'") + "." + n.name;
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
  const std::string subject = quote(Grammar::shown(name)) + " cannot name a " + std::string(what);
  if (!Grammar::is_word(name))
    return error(ErrorCode::invalid_argument, subject,
                 "A name is a letter or _, then letters, digits and _.");
  const char* is = units::is_unit(name)           ? "a unit"
                   : Grammar::find_function(name) ? "a function"
                   : name == "pi"                 ? "a constant"
                   : Grammar::is_keyword(name)    ? "a word of expressions"
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
        out = {text::print(s.number) + (s.unit.empty() ? "" : " " + s.unit), Grammar::kAtom,
               !s.unit.empty()};
        break;
      case Op::pi: out = {"pi", Grammar::kAtom, false}; break;
      case Op::unit: out = {s.unit, Grammar::kAtom, false, true}; break;
      case Op::name: out = {spell(names_[s.count]), Grammar::kAtom, false}; break;
      case Op::negate:
        out = {"-" + bracketed(a[0], a[0].level < Grammar::kSign), Grammar::kSign, a[0].has_unit};
        break;
      case Op::invert:
        out = {"not " + bracketed(a[0], a[0].level < Grammar::kNot), Grammar::kNot, false};
        break;
      default: {
        if (const auto* b = Grammar::find_binary(s.op)) {
          const bool is_power = s.op == Op::power, is_compare = b->level == Grammar::kCompare;
          const bool is_joined = s.op == Op::divide && a[0].has_unit && a[1].is_unit;
          const bool left = a[0].level < b->level || is_joined ||
                            (is_compare && a[0].level == b->level) ||
                            (is_power && (a[0].level <= b->level || a[0].has_unit));
          const bool right = is_power ? a[1].level < Grammar::kSign : a[1].level <= b->level;
          const std::string sign = is_power ? "^" : " " + std::string(b->text) + " ";
          out = {bracketed(a[0], left) + sign + bracketed(a[1], right), b->level,
                 a[1].has_unit && !right, a[0].is_unit && !left};
          break;
        }
        std::string list;
        for (const Piece& p : a) list += (list.empty() ? "" : ", ") + p.text;
        out = {std::string(Grammar::find_function(s.op)->name) + "(" + list + ")", Grammar::kAtom,
               false};
      }
    }
    stack.push_back(std::move(out));
  }
  return stack.empty() ? std::string() : std::move(stack.back().text);
}

}  // namespace robomosp
