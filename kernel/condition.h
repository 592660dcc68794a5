// SPDX-License-Identifier: Apache-2.0
// Conditions under which a field matters: "step is move and pose is absent" (layer: core).
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/result.h>

#include "kernel/value.h"

namespace robomosp {

/// A condition over the other fields of a table. Grammar, loosest first:
///   condition = condition "or" condition | condition "and" condition | "not" condition
///             | "(" condition ")" | test
///   test      = field "is" ["not"] ( "present" | "absent" | "true" | "false" | number | word
///               | word "," word ... )
/// `is a, b` is true for either word. A field that is missing or empty (nil, "", {}) is absent.
/// Immutable after parsing. [any thread]
class Condition {
 public:
  /// One comparison of a field.
  struct Test {
    std::string field;
    bool is_negated = false;
    /// "present", "absent", or empty where `words` count.
    std::string state;
    std::vector<std::string> words;  ///< texts of values, of which one must be equal
  };

  /// True for all values.
  Condition() = default;
  [[nodiscard]] static Result<Condition> parse(std::string_view text);

  [[nodiscard]] bool is_always() const { return steps_.empty(); }
  /// Value of the condition where `value_of` gives the fields; null = absent.
  [[nodiscard]] bool holds(const std::function<const Value*(std::string_view)>& value_of) const;
  /// The same over a table; `shape.name` is a field of a table in it.
  [[nodiscard]] bool holds(const Map& fields) const;
  /// All comparisons, in order of the text.
  [[nodiscard]] const std::vector<Test>& tests() const { return tests_; }
  /// As it was written.
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  friend class ConditionParser;
  enum class Op : std::uint8_t { test, and_, or_, not_ };
  /// In postfix order.
  struct Step {
    Op op;
    std::size_t test = 0;
  };
  std::string text_;
  std::vector<Test> tests_;
  std::vector<Step> steps_;
};

}  // namespace robomosp
