// SPDX-License-Identifier: Apache-2.0
// Colours of maps, and round numbers along an axis (layer: application). [any thread]
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include <robomosp/sdk/types.h>

namespace robomosp::recording {

/// `count` >= 2 colours (sRGB) from the least value to the greatest: dark violet, blue, green,
/// light yellow. Neighbours are equally far apart in Oklab (Ottosson, "A perceptual color space for
/// image processing", 2020) and each is lighter than the one before, so that the map is read the
/// same in grey and with most kinds of colour vision (design rules: Kovesi, arXiv:1509.03700).
[[nodiscard]] std::vector<Colour> colour_map(std::size_t count);

/// "#rrggbb"
[[nodiscard]] std::string hex_of(const Colour&);

/// Round limits around values, and the step between marks.
struct AxisRange {
  double low = 0, high = 1, step = 0.2;
};
/// Round limits and a 1-2-5 step with about `wanted` intervals.
[[nodiscard]] AxisRange nice_range(double low, double high, int wanted);
/// The multiples of a 1-2-5 step that lie within low..high, about `wanted` of them.
[[nodiscard]] std::vector<double> ticks_within(double low, double high, int wanted);
/// Text of a mark, without rounding noise from repeated steps.
[[nodiscard]] std::string tick_text(double value, double step);

/// Least and greatest finite value; from zero if the least is small relative to the greatest.
/// Widened for a single value; 0..1 without values.
struct ValueRange {
  double low = 0, high = 1;
};
[[nodiscard]] ValueRange value_range(std::span<const double> values);

}  // namespace robomosp::recording
