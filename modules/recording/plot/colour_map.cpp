// SPDX-License-Identifier: Apache-2.0
#include "recording/plot/colour_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "kernel/text.h"

namespace robomosp::recording {
namespace {

using Lab = std::array<double, 3>;

/// The path of the map: lightness rises evenly while the hue turns from violet to yellow; the
/// chroma stays within what sRGB can show (least in the blue-greens).
Lab path(double t) {
  const double hue = (300 - 195 * t) * std::numbers::pi / 180;
  const double chroma = 0.135 - 0.045 * std::sin(std::numbers::pi * t);
  return {0.28 + 0.65 * t, chroma * std::cos(hue), chroma * std::sin(hue)};
}

float encoded(double linear) {
  const double c = std::clamp(linear, 0.0, 1.0);  // IEC 61966-2-1
  return static_cast<float>(c <= 0.0031308 ? 12.92 * c : 1.055 * std::pow(c, 1 / 2.4) - 0.055);
}

/// Matrices of Ottosson's definition.
Colour srgb(const Lab& c) {
  const double l = std::pow(c[0] + 0.3963377774 * c[1] + 0.2158037573 * c[2], 3);
  const double m = std::pow(c[0] - 0.1055613458 * c[1] - 0.0638541728 * c[2], 3);
  const double s = std::pow(c[0] - 0.0894841775 * c[1] - 1.2914855480 * c[2], 3);
  return {encoded(4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s),
          encoded(-1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s),
          encoded(-0.0041960863 * l - 0.7034186147 * m + 1.7076147010 * s), 1};
}

}  // namespace

std::vector<Colour> colour_map(std::size_t count) {
  constexpr std::size_t kPieces = 512;
  std::array<double, kPieces + 1> way{};  // along the path, so that steps are equally far apart
  Lab last = path(0);
  for (std::size_t i = 1; i <= kPieces; ++i) {
    const Lab next = path(static_cast<double>(i) / kPieces);
    way[i] = way[i - 1] + std::hypot(next[0] - last[0], next[1] - last[1], next[2] - last[2]);
    last = next;
  }
  std::vector<Colour> out;
  std::size_t at = 1;
  for (std::size_t i = 0; i < count; ++i) {
    const double wanted = way[kPieces] * static_cast<double>(i) / static_cast<double>(count - 1);
    while (at < kPieces && way[at] < wanted) ++at;
    const double share = (wanted - way[at - 1]) / (way[at] - way[at - 1]);
    out.push_back(srgb(path((static_cast<double>(at - 1) + share) / kPieces)));
  }
  return out;
}

std::string hex_of(const Colour& c) {
  const auto byte = [](float x) { return static_cast<int>(std::lround(255 * x)); };
  return fmt::format("#{:02x}{:02x}{:02x}", byte(c.r), byte(c.g), byte(c.b));
}

namespace {
double round_step(double low, double high, int wanted) {
  const double raw = (high - low) / wanted;
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  for (const double m : {1.0, 2.0, 5.0})
    if (raw <= m * power) return m * power;
  return 10 * power;
}
}  // namespace

AxisRange nice_range(double low, double high, int wanted) {
  if (!(high > low)) {
    const double pad = std::max(std::fabs(low) * 0.05, 0.5);
    low -= pad;
    high += pad;
  }
  const double step = round_step(low, high, wanted);
  return {std::floor(low / step) * step, std::ceil(high / step) * step, step};
}

std::vector<double> ticks_within(double low, double high, int wanted) {
  std::vector<double> out;
  if (!(high > low)) return out;
  // One mark shows no scale: then there are more than wanted.
  for (int count = wanted; out.size() < 2 && count <= 4 * wanted; count *= 2) {
    const double step = round_step(low, high, count);
    const double first = std::ceil(low / step - 1e-9), last = std::floor(high / step + 1e-9);
    out.clear();
    for (double k = first; k <= last; ++k) out.push_back(k * step);
  }
  return out;
}

std::string tick_text(double v, double step) {
  if (std::fabs(v) < step * 1e-9) v = 0;
  return text::print_rounded(v, 6);
}

ValueRange value_range(std::span<const double> values) {
  double low = INFINITY, high = -INFINITY;
  for (const double v : values) {
    if (!std::isfinite(v)) continue;
    low = std::min(low, v);
    high = std::max(high, v);
  }
  if (low > high) return {};
  if (low > 0 && low < 0.5 * high) low = 0;
  if (!(high > low)) {
    const double room = std::max(1e-6, 0.05 * std::fabs(high));
    return {low - room, high + room};
  }
  return {low, high};
}

}  // namespace robomosp::recording
