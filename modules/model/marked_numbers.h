// SPDX-License-Identifier: Apache-2.0
// Numbers that stand for expressions while a record is made (layer: data processing, model): the
// code between an argument or file and the record copies plain numbers, and afterwards each
// expression is found where its number is. Reasons: docs/decisions/0074-expressions-everywhere.md.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

namespace robomosp::model {

/// For readers that only copy numbers, such as those of files: a NaN that carries `number`.
[[nodiscard]] double marked_nan(std::uint32_t number);
/// What marked_nan() was given; none of every other number.
[[nodiscard]] std::optional<std::uint32_t> number_of_nan(double v);

/// For code that compares and computes as well, such as commands: numbers that differ from the
/// values of their expressions in the last three digits only.
class MarkedNumbers {
 public:
  /// A number for the expression `text` of this value: finite, within [min, max], and different
  /// from all numbers given before. `value` itself where [min, max] has no room for another one.
  [[nodiscard]] double near(double value, double min, double max, std::string_view text);

  [[nodiscard]] bool empty() const { return texts_.empty(); }
  /// The expression that a number stands for; null = none.
  [[nodiscard]] const std::string* find(double v) const;
  /// Each expression once, in the order in which they were given.
  [[nodiscard]] const std::vector<std::string>& texts() const { return texts_; }

 private:
  std::vector<std::string> texts_;
  std::unordered_map<std::uint64_t, std::size_t> by_bits_;  ///< of a number: place in texts_
};

}  // namespace robomosp::model
