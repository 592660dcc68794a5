// SPDX-License-Identifier: Apache-2.0
// Placeholder numbers for expressions while a record is built (layer: data processing, model): the
// code between an argument or file and the record copies plain numbers, and afterwards each
// expression is matched to the place of its number. Reasons:
// docs/decisions/0074-expressions-everywhere.md.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

namespace robomosp::model {

/// For readers that only copy numbers, such as those of files: a NaN that encodes `number`.
[[nodiscard]] double marked_nan(std::uint32_t number);
/// The number encoded by marked_nan(); empty for all other values.
[[nodiscard]] std::optional<std::uint32_t> number_of_nan(double v);

/// For code that also compares and computes, such as commands: numbers that differ from the values
/// of their expressions in the last three digits only.
class MarkedNumbers {
 public:
  /// A number for the expression `text` of this value: finite, within [min, max], and different
  /// from all numbers returned before. `value` itself if [min, max] has no other free number.
  [[nodiscard]] double near(double value, double min, double max, std::string_view text);

  [[nodiscard]] bool empty() const { return texts_.empty(); }
  /// The expression marked by a number; null = none.
  [[nodiscard]] const std::string* find(double v) const;
  /// Each expression once, in order of registration.
  [[nodiscard]] const std::vector<std::string>& texts() const { return texts_; }

 private:
  std::vector<std::string> texts_;
  std::unordered_map<std::uint64_t, std::size_t> by_bits_;  ///< of a number: place in texts_
};

}  // namespace robomosp::model
