// SPDX-License-Identifier: Apache-2.0
// Layout of the axes, lines and legends of a plot (layer: application, private to recording).
#pragma once

#include <string>
#include <vector>

#include "recording/plot/canvas.h"
#include "recording/plot/colour_map.h"
#include "recording/plot/plot.h"

namespace robomosp::recording {

/// The plot in pixels.
[[nodiscard]] Canvas drawn(const Plot&);

/// Least and greatest finite value of some values; 0..1 without any, and widened around a single
/// one.
class Extent {
 public:
  void add(double v);
  void add(const std::vector<double>& values);
  [[nodiscard]] ValueRange range() const;
  /// True if there are no values, or only values equal up to rounding.
  [[nodiscard]] bool is_single() const;

 private:
  double low_ = 0, high_ = 0;
  bool has_value_ = false;
};

/// Distance between marks.
[[nodiscard]] double step_of(const std::vector<double>& marks);

/// A number along an axis, and its position: the value, or for a logarithmic axis its logarithm.
struct AxisMark {
  double at = 0;
  std::string text;
};
/// About `wanted` round numbers within the range; for a logarithmic axis powers of ten, with 2 and
/// 5 added between them if they are few, or round steps in less than a decade.
[[nodiscard]] std::vector<AxisMark> axis_marks(const ValueRange&, int wanted, bool is_log);
/// Positions of the multiples 2 to 9 of the powers of ten along a logarithmic axis.
[[nodiscard]] std::vector<double> fine_marks(const ValueRange&);

/// The x range of a plot other than a path: round limits unless tight, including finite limits of
/// panels.
[[nodiscard]] ValueRange x_range(const Plot&);
[[nodiscard]] ValueRange y_range(const PlotPanel&, int marks, bool is_log);

}  // namespace robomosp::recording
