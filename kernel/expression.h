// SPDX-License-Identifier: Apache-2.0
// Expressions such as `bore/2 + 3 mm` over named quantities, with dimensional analysis
// (layer: core). Compiled once to a flat program. Grammar and rules: docs/user/parameters.md.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/result.h>

#include "kernel/units.h"

namespace robomosp {

/// A number in SI units with its dimension.
struct Quantity {
  double value = 0;
  units::Dimension dimension{};
  bool fits_any = false;  ///< the number 0 written without a unit, which fits any dimension
};

/// True if quantities of these dimensions may be added and compared: the dimensions are equal, or
/// differ only in radians and contain metres or kilograms. So an arc `radius * angle` is a length,
/// but a plain number is not an angle, and a frequency not an angular speed.
[[nodiscard]] bool same_kind(const units::Dimension&, const units::Dimension&);

/// A compiled expression. Immutable. [any thread]
class Expression {
 public:
  static constexpr std::size_t kLongest = 4000;  ///< characters of a text
  static constexpr std::size_t kDeepest = 60;    ///< nesting of brackets, functions and signs

  /// A name used: `bore` (scope "") or `cell.bore`.
  struct Name {
    std::string scope, name;
    bool operator==(const Name&) const = default;
  };
  /// The quantity of a name, or the reason why it has none.
  using Lookup = std::function<Result<Quantity>(const Name&)>;

  /// Parses a text. A fault is one sentence; its `where` is `at character 7 of "bore + "`.
  [[nodiscard]] static Result<Expression> compile(std::string_view text);

  [[nodiscard]] const std::string& text() const { return text_; }  ///< without blanks around it
  [[nodiscard]] const std::vector<Name>& names() const { return names_; }  ///< each once, in order
  /// A number with or without a unit and nothing else: "3 mm", "-0.5".
  [[nodiscard]] bool is_literal() const;

  /// The value. Names are looked up on demand, each at most once. Faults are incompatible
  /// dimensions, roots of negative numbers, division by zero and results beyond the range of real
  /// numbers; in a branch of `if` that is not taken, only the first of these.
  [[nodiscard]] Result<Quantity> evaluate(const Lookup&) const;
  /// The same for a number of SI unit `si_unit`; another dimension is a fault that names both.
  [[nodiscard]] Result<double> evaluate(const Lookup&, std::string_view si_unit) const;

  /// The text with each name replaced by the result of `rename`; everything else stays as written.
  [[nodiscard]] std::string renamed(const std::function<Name(const Name&)>& rename) const;
  /// The expression in its shortest spelling: no needless brackets, one blank around operators.
  [[nodiscard]] std::string print() const;
  /// How a name is written: `bore`, `cell.bore`, `'my cell'.bore`.
  [[nodiscard]] static std::string spell(const Name&);

  /// Checks that a text can be a name: a letter or _, then letters, digits and _, and not the name
  /// of a unit, function or constant. `what` names the object in the error, such as "parameter".
  [[nodiscard]] static Result<void> check_name(std::string_view name, std::string_view what);

  /// True for equal programs: the texts differ only in blanks, needless brackets and the spelling
  /// of numbers.
  bool operator==(const Expression& other) const { return code_ == other.code_; }

 private:
  friend class ExpressionGrammar;
  friend class ExpressionCompiler;
  friend class ExpressionMachine;
  enum class Op : std::uint8_t;
  /// One step of the program in postfix order; [begin, end) is its range in the text.
  struct Step {
    Op op{};
    std::uint32_t count = 0;  ///< number of operands; for a name: its index
    Quantity constant;
    std::uint32_t begin = 0, end = 0, at = 0;  ///< `at`: position of the operator or function
    std::string unit{};                        ///< of a number, as written
    double number = 0;                         ///< of a number, before its unit
    bool operator==(const Step&) const;
  };
  struct Place {  ///< a name in the text
    std::size_t name = 0, begin = 0, end = 0;
  };
  [[nodiscard]] Error fault(std::size_t at, ErrorCode, std::string message,
                            std::string hint = {}) const;

  std::string text_;
  std::vector<Step> code_;
  std::vector<Name> names_;
  std::vector<Place> places_;
};

}  // namespace robomosp
