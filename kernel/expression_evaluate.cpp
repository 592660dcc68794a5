// SPDX-License-Identifier: Apache-2.0
// Running the program of an expression.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "kernel/expression_grammar.h"
#include "kernel/text.h"

namespace robomosp {
namespace {

using text::quote;
using units::Dimension;
using Grammar = ExpressionGrammar;

constexpr int kMostExponent = 99;  ///< of a metre, kilogram, ... in a result

}  // namespace

/// Runs a program on a stack of cells.
class ExpressionMachine : ExpressionGrammar {
 public:
  ExpressionMachine(const Expression& e, const Expression::Lookup& lookup)
      : e_(e), lookup_(lookup), known_(e.names_.size()) {}

  Result<Quantity> run() {
    for (const Step& s : e_.code_) RMP_TRY(step(s));
    const Cell& top = stack_.back();
    if (top.is_condition)
      return e_.fault(0, ErrorCode::invalid_argument, "this is a condition, not a quantity",
                      "Use a condition within if: if(a > b, a, b).");
    if (top.fault) return faults_[*top.fault];
    return Quantity{top.value, top.dimension, top.fits_any};
  }

 private:
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
  static std::string function_name(Op op) { return std::string(find_function(op)->name); }

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
        return wrong(s, kind(a[i]) + " is not a condition",
                     "Compare it: " + source(a[i]) + " > 0.");
      return wrong(s, "the condition " + source(a[i]) + " is not a quantity",
                   "Use a condition within if: if(a > b, a, b).");
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

Result<Quantity> Expression::evaluate(const Lookup& lookup) const {
  return ExpressionMachine(*this, lookup).run();
}

Result<double> Expression::evaluate(const Lookup& lookup, std::string_view si_unit) const {
  RMP_TRY_ASSIGN(const Quantity q, evaluate(lookup));
  RMP_TRY_ASSIGN(const units::Unit expected, units::parse(si_unit));
  if (q.fits_any || same_kind(q.dimension, expected.dimension)) return q.value;
  std::string want = units::kind_of(expected.dimension);
  if (!si_unit.empty() && !want.ends_with(si_unit)) want += " (" + std::string(si_unit) + ")";
  return error(ErrorCode::invalid_argument,
               quote(Grammar::shown(text_)) + " is " + units::kind_of(q.dimension) + "; " + want +
                   " is expected",
               q.dimension == Grammar::kNumber
                   ? "Multiply it by a unit, such as " +
                         std::string(expected.dimension == Grammar::kAngle         ? "deg"
                                     : expected.dimension == Dimension{1, 0, 0, 0} ? "mm"
                                                                                   : si_unit) +
                         "."
                   : "");
}

}  // namespace robomosp
