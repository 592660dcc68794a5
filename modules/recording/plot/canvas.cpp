// SPDX-License-Identifier: Apache-2.0
#include "recording/plot/canvas.h"

#include <cmath>

#include <fmt/format.h>

namespace robomosp::recording {
namespace {

constexpr const char* kInk = "#39424d";
/// Lengths of strokes and gaps; the last serves all beyond.
constexpr std::array<const char*, 5> kDashes{"", "7 4", "2 3", "9 3 2 3", "4 6"};
/// The same for gnuplot, in units of the line's width.
constexpr std::array<const char*, 5> kGnuplotDashes{"solid", "(4,3)", "(1.5,2)", "(6,2,1.5,2)",
                                                    "(2,4)"};

std::size_t dash_of(const Stroke& s) { return std::min(s.dash, kDashes.size() - 1); }

/// "#aarrggbb" of gnuplot, whose 00 is opaque.
std::string with_opacity(const std::string& colour, double opacity) {
  return fmt::format("#{:02x}{}", static_cast<int>(std::lround(255 * (1 - opacity))),
                     colour.substr(1));
}

/// Points of a line, one a row. Gnuplot moves pieces that are exactly level or upright in its units
/// of 1/20 pixel onto whole pixels. That keeps thin lines of a grid sharp, but gives slow curves
/// steps: theirs are never exactly so.
std::string curve_data(const PixelPath& points, const Stroke& stroke) {
  constexpr double kAside = 0.06;
  const bool is_grid = points.size() == 2 && stroke.width <= 1;
  std::string out;
  std::array<double, 2> before{};
  for (std::size_t i = 0; i < points.size(); ++i) {
    std::array<double, 2> p = points[i];
    for (std::size_t k = 0; k < 2; ++k) {
      if (i > 0 && !is_grid && std::fabs(p[k] - before[k]) < kAside)
        p[k] = before[k] + (p[k] < before[k] ? -kAside : kAside);
    }
    before = p;
    out += fmt::format("{:.2f} {:.2f}\n", p[0], p[1]);
  }
  return out;
}

}  // namespace

std::string Canvas::svg() const {
  std::string s = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} "
      "{1}\" font-family=\"DejaVu Sans, Helvetica, Arial, sans-serif\" fill=\"{2}\">\n"
      "<rect width=\"{0}\" height=\"{1}\" fill=\"#ffffff\"/>\n",
      width_, height_, kInk);
  const auto path_of = [](const PixelPath& points) {
    std::string d;
    for (const auto& p : points)
      d += fmt::format("{}{:.2f} {:.2f}", d.empty() ? 'M' : 'L', p[0], p[1]);
    return d;
  };
  for (const auto& shape : shapes_) {
    if (const auto* line = std::get_if<Line>(&shape)) {
      const Stroke& k = line->stroke;
      s += fmt::format("<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{:g}\"",
                       path_of(line->points), k.colour, k.width);
      if (line->points.size() > 2) s += " stroke-linejoin=\"round\"";
      if (k.dash) s += fmt::format(" stroke-dasharray=\"{}\"", kDashes[dash_of(k)]);
      if (k.opacity < 1) s += fmt::format(" stroke-opacity=\"{:g}\"", k.opacity);
      s += "/>\n";
    } else if (const auto* area = std::get_if<Area>(&shape)) {
      s += fmt::format("<path d=\"{}Z\" fill=\"{}\" fill-opacity=\"{:g}\"/>\n",
                       path_of(area->corners), area->colour, area->opacity);
    } else {
      const auto& t = std::get<Text>(shape);
      constexpr std::array<const char*, 3> kAnchors{"start", "middle", "end"};
      const double drop = 0.36 * t.size;  // from the middle of the letters to their base
      const std::string place =
          t.upright
              ? fmt::format("transform=\"translate({:.1f} {:.1f}) rotate(-90)\"", t.x + drop, t.y)
              : fmt::format("x=\"{:.1f}\" y=\"{:.1f}\"", t.x, t.y + drop);
      s += fmt::format("<text {} font-size=\"{:g}\" text-anchor=\"{}\">{}</text>\n", place, t.size,
                       kAnchors[static_cast<std::size_t>(t.anchor)], escape_xml(t.words));
    }
  }
  return s + "</svg>\n";
}

std::string Canvas::gnuplot() const {
  // The axes are the pixels; gnuplot draws nothing of its own.
  std::string head = fmt::format(
      "unset border\nunset tics\nunset key\nset margins 0,0,0,0\n"
      "set xrange [0:{}]\nset yrange [{}:0]\n",
      width_, height_);
  std::string data, lines;
  std::size_t blocks = 0;
  const Stroke* last = nullptr;
  for (const auto& shape : shapes_) {
    if (const auto* line = std::get_if<Line>(&shape)) {
      if (!last || !(*last == line->stroke)) {
        const Stroke& k = line->stroke;
        if (blocks) data += "EOD\n";
        data += fmt::format("$lines{} << EOD\n", blocks);
        lines += fmt::format(
            "{} $lines{} using 1:2 with lines linewidth {:g} dashtype {} linecolor rgb '{}'",
            blocks ? ", \\\n" : "plot", blocks, k.width, kGnuplotDashes[dash_of(k)],
            with_opacity(k.colour, k.opacity));
        ++blocks;
        last = &k;
      }
      data += curve_data(line->points, line->stroke);
      data += '\n';  // lifts the pen
    } else if (const auto* area = std::get_if<Area>(&shape)) {
      head += "set object polygon from";
      const char* to = " ";
      for (const auto& p : area->corners) {
        head += fmt::format("{}{:.2f},{:.2f}", to, p[0], p[1]);
        to = " to ";
      }
      head += fmt::format("{}{:.2f},{:.2f} fillcolor rgb '{}' fillstyle solid noborder\n", to,
                          area->corners.front()[0], area->corners.front()[1],
                          with_opacity(area->colour, area->opacity));
    } else {
      const auto& t = std::get<Text>(shape);
      constexpr std::array<const char*, 3> kAnchors{"left", "center", "right"};
      head += fmt::format(
          "set label {} at {:.2f},{:.2f} {}{} font 'DejaVu Sans,{:g}' textcolor rgb '{}'\n",
          gnuplot_text(t.words), t.x, t.y, kAnchors[static_cast<std::size_t>(t.anchor)],
          t.upright ? " rotate by 90" : "", 0.75 * t.size, kInk);
    }
  }
  if (blocks) data += "EOD\n";
  else lines = "plot NaN";  // texts are drawn with a plot only
  return head + data + lines + '\n';
}

}  // namespace robomosp::recording
