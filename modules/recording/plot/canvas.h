// SPDX-License-Identifier: Apache-2.0
// What a plot is drawn with: lines, areas and texts in pixels, written as SVG or as a gnuplot
// script (layer: application, private to recording).
#pragma once

#include <array>
#include <string>
#include <variant>
#include <vector>

#include "recording/plot/file.h"

namespace robomosp::recording {

using PixelPath = std::vector<std::array<double, 2>>;  ///< from the upper left corner

struct Stroke {
  std::string colour;  ///< "#rrggbb"
  double width = 1;
  std::size_t dash = 0;  ///< 0 = solid
  double opacity = 1;
  bool operator==(const Stroke&) const = default;
};

enum class Anchor { start, middle, end };

class Canvas {
 public:
  static constexpr double kTextSize = 14;  ///< [px]
  Canvas(int width, int height) : width_(width), height_(height) {}

  void line(PixelPath points, Stroke stroke) {
    shapes_.emplace_back(Line{std::move(points), std::move(stroke)});
  }
  void area(PixelPath corners, std::string colour, double opacity) {
    shapes_.emplace_back(Area{std::move(corners), std::move(colour), opacity});
  }
  /// Its middle is at the height y; `upright` turns it by a quarter.
  void text(double x, double y, std::string words, Anchor anchor = Anchor::start,
            double size = kTextSize, bool upright = false) {
    shapes_.emplace_back(Text{x, y, std::move(words), anchor, size, upright});
  }

  [[nodiscard]] std::string svg() const;
  [[nodiscard]] std::string gnuplot() const;  ///< script without terminal and output

 private:
  struct Line {
    PixelPath points;
    Stroke stroke;
  };
  struct Area {
    PixelPath corners;
    std::string colour;
    double opacity;
  };
  struct Text {
    double x, y;
    std::string words;
    Anchor anchor;
    double size;
    bool upright;
  };
  int width_, height_;
  std::vector<std::variant<Line, Area, Text>> shapes_;
};

}  // namespace robomosp::recording
