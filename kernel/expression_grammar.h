// SPDX-License-Identifier: Apache-2.0
// The elements of expressions: operations, functions, operators and their precedence (layer: core).
// Internal to kernel/expression*.cpp.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "kernel/expression.h"

namespace robomosp {

enum class Expression::Op : std::uint8_t {
  constant,
  pi,
  unit,  ///< a unit without a number: `mm`
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

class ExpressionGrammar {
 public:
  using Op = Expression::Op;
  static constexpr std::size_t kMostArguments = 100;
  static constexpr int kMostPower = 9;  ///< greatest power of a unit or of a quantity with a
                                        ///< dimension

  // Levels of precedence: or 1, and 2, not 3, comparisons 4, sums 5, products 6, sign 7, power 8.
  static constexpr int kNot = 3, kCompare = 4, kProduct = 6, kSign = 7, kPower = 8, kAtom = 9;

  struct Function {
    std::string_view name;
    Expression::Op op;
    std::uint32_t least, most;
    std::string_view sample;
  };
  struct Binary {
    std::string_view text;
    Expression::Op op;
    int level;
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

  static const Binary* find_binary(Expression::Op op) {
    for (const Binary& b : kBinaries)
      if (b.op == op) return &b;
    return nullptr;
  }

  static bool is_letter(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
  }
  static bool is_digit(char c) { return c >= '0' && c <= '9'; }
  static bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }
  /// True if a text can be a name.
  static bool is_word(std::string_view s) {
    return !s.empty() && is_letter(s.front()) &&
           std::all_of(s.begin(), s.end(), [](char c) { return is_letter(c) || is_digit(c); });
  }

  /// A piece of the user's text, short enough for a message.
  static std::string shown(std::string_view s) {
    constexpr std::size_t kMost = 60;
    if (s.size() <= kMost) return std::string(s);
    return std::string(s.substr(0, kMost)) + "...";
  }

  static constexpr units::Dimension kNumber{};
  static constexpr units::Dimension kAngle{0, 0, 0, 1};
};

}  // namespace robomosp
