// SPDX-License-Identifier: Apache-2.0
// Where the axes, lines and legends of a plot stand (layer: application, private to recording).
#pragma once

#include <string>
#include <vector>

#include "recording/plot/canvas.h"
#include "recording/plot/colour_map.h"
#include "recording/plot/plot.h"

namespace robomosp::recording {

/// The plot in pixels.
[[nodiscard]] Canvas drawn(const Plot&);

/// Least and greatest finite value among some values; 0..1 without any, and room about a single
/// one.
class Extent {
 public:
  void add(double v);
  void add(const std::vector<double>& values);
  [[nodiscard]] ValueRange range() const;
  /// No values, or such as differ by rounding only.
  [[nodiscard]] bool is_single() const;

 private:
  double low_ = 0, high_ = 0;
  bool has_value_ = false;
};

/// From one mark to the next.
[[nodiscard]] double step_of(const std::vector<double>& marks);

/// A number along an axis and where it stands: at the value, of a logarithmic axis at its
/// logarithm.
struct AxisMark {
  double at = 0;
  std::string text;
};
/// About `wanted` round numbers within the range; of a logarithmic axis powers of ten, between
/// which 2 and 5 are added where there are few, or round steps within less than a decade.
[[nodiscard]] std::vector<AxisMark> axis_marks(const ValueRange&, int wanted, bool is_log);
/// Where the multiples 2 to 9 of the powers of ten stand along a logarithmic axis.
[[nodiscard]] std::vector<double> fine_marks(const ValueRange&);

/// The axes of a plot that is no path: round limits unless tight, finite limits of panels included.
[[nodiscard]] ValueRange x_range(const Plot&);
[[nodiscard]] ValueRange y_range(const PlotPanel&, int marks, bool is_log);

}  // namespace robomosp::recording
