// SPDX-License-Identifier: GPL-3.0-or-later
// Series: the numbers of a column over time, with the extremes of blocks, so that any range is
// drawn with a few points for each pixel (layer: GUI). No Qt.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

namespace robomosp::viewer {

using Numbers64 = std::vector<double>;

/// Shared by all columns of a recording; ascending.
using TimesPtr = std::shared_ptr<const Numbers64>;

/// Making one takes time proportional to its length, everything else a few steps for each pixel.
/// [one thread at a time; const: any]
class Series {
 public:
  Series() = default;
  /// Of unequal lengths the shorter one counts.
  Series(TimesPtr times, Numbers64 values);

  /// Rows that were added to the times since.
  void append(const double* values, std::size_t count);
  /// Drops the rows from here on.
  void cut(std::size_t rows);

  [[nodiscard]] std::size_t size() const;
  [[nodiscard]] const TimesPtr& times() const { return times_; }
  [[nodiscard]] const Numbers64& values() const { return values_; }
  /// Linear between samples; nothing outside, and beside a missing value.
  [[nodiscard]] std::optional<double> at(double time) const;
  /// The value of the last sample at or before a time, as signals have it.
  [[nodiscard]] std::optional<double> step_at(double time) const;
  /// Least and greatest finite value; nothing without any.
  [[nodiscard]] std::optional<std::pair<double, double>> extremes() const;

  /// Points of a line for the range, and one sample beyond each end. Where more than a few samples
  /// fall on one of `pixels` columns, their extremes are two points. Not a number = a gap.
  struct Line {
    Numbers64 x, y;
  };
  [[nodiscard]] Line line(double from, double to, int pixels) const;

 private:
  struct Pair {
    double low, high;
  };
  [[nodiscard]] Pair extremes(std::size_t first, std::size_t last) const;  ///< of [first, last)
  void build(std::size_t from);

  TimesPtr times_;
  Numbers64 values_;
  std::vector<std::vector<Pair>> levels_;  ///< of blocks of 16, 256, ... samples
};

}  // namespace robomosp::viewer
