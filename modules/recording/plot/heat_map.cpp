// SPDX-License-Identifier: Apache-2.0
#include "recording/plot/heat_map.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "kernel/text.h"
#include "recording/plot/colour_map.h"
#include "recording/plot/column_of.h"
#include "recording/plot/file.h"

namespace robomosp::recording {
namespace {

constexpr std::size_t kMostCells = 1U << 22;
constexpr std::size_t kColours = 256;
constexpr const char* kBlank = "#cfd4da";  // cells in collision
constexpr const char* kCurve = "#d6304a";
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

std::string axis_label_of(const Column& c) {
  std::string name = c.name;
  std::replace(name.begin(), name.end(), '_', ' ');
  return c.unit.empty() ? name : name + " [" + c.unit + "]";
}

/// The evenly spaced values that a column takes.
Result<HeatMap::Axis> axis_of(const Column& c, double step) {
  HeatMap::Axis axis;
  axis.label = axis_label_of(c);
  std::vector<double> v;
  for (const double x : c.values)
    if (std::isfinite(x)) v.push_back(x);
  std::sort(v.begin(), v.end());
  if (v.empty()) return error(ErrorCode::invalid_argument, "the column has no values", "", c.name);
  const double noise = 1e-9 * std::max(v.back() - v.front(), std::fabs(v.back()));
  v.erase(std::unique(v.begin(), v.end(), [&](double a, double b) { return b - a <= noise; }),
          v.end());
  axis.first = v.front();
  if (!(step > 0))
    step = v.size() > 1 ? (v.back() - v.front()) / static_cast<double>(v.size() - 1) : 1;
  axis.step = step;
  axis.count = static_cast<std::size_t>(std::lround((v.back() - v.front()) / step)) + 1;
  for (const double x : v)
    if (std::fabs((x - axis.first) / step - std::round((x - axis.first) / step)) > 1e-3)
      return error(ErrorCode::invalid_argument, "the values are not evenly spaced",
                   "Maps can be drawn of voxels and joint slices; use plots for other recordings.",
                   c.name);
  return axis;
}

std::size_t index_of(const HeatMap::Axis& axis, double value) {
  return static_cast<std::size_t>(std::lround((value - axis.first) / axis.step));
}

/// Share of the way up the colours, 0..1.
double share_of(const HeatMap& m, double v) {
  const double s =
      m.is_log ? std::log(v / m.low) / std::log(m.high / m.low) : (v - m.low) / (m.high - m.low);
  return std::clamp(s, 0.0, 1.0);
}

/// Marks beside the colour bar: powers of ten, or round numbers.
std::vector<double> bar_ticks(const HeatMap& m) {
  if (!m.is_log) return ticks_within(m.low, m.high, 5);
  std::vector<double> out;
  const double first = std::ceil(std::log10(m.low) - 1e-9);
  const double last = std::floor(std::log10(m.high) + 1e-9);
  const double step = std::max(1.0, std::ceil((last - first) / 8));
  for (double k = first; k <= last; k += step) out.push_back(std::pow(10, k));
  return out;
}

std::string gnuplot_script(const HeatMap& m) {
  std::string s =
      "set border 31 linecolor rgb '#9aa3ad' linewidth 1\n"
      "set tics nomirror out textcolor rgb '#39424d'\n"
      "set key at screen 0.02,0.005 left bottom Left reverse horizontal textcolor rgb '#39424d' "
      "samplen 1\nset palette defined (";
  const auto colours = colour_map(kColours);
  for (std::size_t i = 0; i < colours.size(); ++i)
    s += fmt::format("{}{} '{}'", i ? ", " : "", i, hex_of(colours[i]));
  s += fmt::format(")\nset palette maxcolors {}\n$map << EOD\n", kColours);
  for (std::size_t i = 0; i < m.values.size(); ++i) {
    const double v = m.values[i];
    const auto at = [&](const HeatMap::Axis& a, std::size_t k) {
      return text::print(a.first + a.step * static_cast<double>(k));
    };
    s += at(m.x, i % m.x.count) + " " + at(m.y, i / m.x.count) + " " +
         (std::isnan(v) ? "NaN" : text::print(std::clamp(v, m.low, m.high))) + "\n";
  }
  s += "EOD\n";
  if (!m.curve.empty()) {
    s += "$curve << EOD\n";
    for (const auto& p : m.curve) s += text::print(p[0]) + " " + text::print(p[1]) + "\n";
    s += "EOD\n";
  }
  if (m.is_metric) s += "set size ratio -1\n";
  if (m.is_log) s += "set logscale cb\nset format cb '%g'\n";
  if (m.has_collisions)
    s += fmt::format(
        "set object 1 rectangle from graph 0,0 to graph 1,1 behind fillcolor rgb '{}' fillstyle "
        "solid noborder\n",
        kBlank);
  s += fmt::format(
      "set title {} font 'DejaVu Sans,13'\nset xlabel {}\nset ylabel {}\nset cblabel {}\n"
      "set xrange [{}:{}]\nset yrange [{}:{}]\nset cbrange [{}:{}]\n"
      "plot $map using 1:2:3 with image notitle",
      gnuplot_text(m.title), gnuplot_text(m.x.label), gnuplot_text(m.y.label),
      gnuplot_text(m.label), text::print(m.x.low()), text::print(m.x.high()),
      text::print(m.y.low()), text::print(m.y.high()), text::print(m.low), text::print(m.high));
  if (!m.curve.empty())
    s += fmt::format(
        ", $curve using 1:2 with points pointtype 7 pointsize 0.4 linecolor rgb '{}' title "
        "'singular'",
        kCurve);
  if (m.has_collisions)
    s += fmt::format(
        ", NaN with points pointtype 5 pointsize 1.6 linecolor rgb '{}' title 'collision'", kBlank);
  return s + "\n";
}

/// Where the cells and the colour bar are in an SVG picture [px].
struct Box {
  double x0, y0, x1, y1;
};

Box cells_box(const HeatMap& m) {
  const double left = 76, right = 150, top = 48, bottom = 62;
  Box b{left, top, m.width - right, m.height - bottom};
  if (!m.is_metric) return b;
  const double wide = m.x.high() - m.x.low(), high = m.y.high() - m.y.low();
  const double scale = std::min((b.x1 - b.x0) / wide, (b.y1 - b.y0) / high);
  const double cx = 0.5 * (b.x0 + b.x1), cy = 0.5 * (b.y0 + b.y1);
  return {cx - 0.5 * scale * wide, cy - 0.5 * scale * high, cx + 0.5 * scale * wide,
          cy + 0.5 * scale * high};
}

/// The cells of each colour as one path of rectangles; runs along a row are one rectangle.
std::string svg_cells(const HeatMap& m, const Box& b) {
  const double w = (b.x1 - b.x0) / static_cast<double>(m.x.count);
  const double h = (b.y1 - b.y0) / static_cast<double>(m.y.count);
  std::vector<std::string> paths(kColours);
  const auto colour_at = [&](std::size_t i) {
    return std::isnan(m.values[i])
               ? kColours
               : static_cast<std::size_t>(std::lround(share_of(m, m.values[i]) * (kColours - 1)));
  };
  for (std::size_t row = 0; row < m.y.count; ++row)
    for (std::size_t a = 0, e; a < m.x.count; a = e) {
      const std::size_t colour = colour_at(row * m.x.count + a);
      for (e = a + 1; e < m.x.count && colour_at(row * m.x.count + e) == colour;) ++e;
      if (colour == kColours) continue;
      paths[colour] +=
          fmt::format("M{:.2f} {:.2f}h{:.2f}v{:.2f}h{:.2f}z", b.x0 + w * static_cast<double>(a),
                      b.y1 - h * static_cast<double>(row + 1), w * static_cast<double>(e - a), h,
                      -w * static_cast<double>(e - a));
    }
  const auto colours = colour_map(kColours);
  std::string s = "<g shape-rendering=\"crispEdges\">\n";
  for (std::size_t c = 0; c < kColours; ++c)
    if (!paths[c].empty())
      s += fmt::format("<path fill=\"{}\" d=\"{}\"/>\n", hex_of(colours[c]), paths[c]);
  return s + "</g>\n";
}

std::string svg_line(double x0, double y0, double x1, double y1) {
  return fmt::format(
      "<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"#9aa3ad\"/>", x0, y0,
      x1, y1);
}

std::string svg_text(double x, double y, const char* anchor, std::string_view text) {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\">{}</text>\n", x, y, anchor,
                     escape_xml(text));
}

std::string svg_upright(double x, double y, std::string_view text) {
  return fmt::format(
      "<text transform=\"translate({:.1f} {:.1f}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n",
      x, y, escape_xml(text));
}

std::string svg_axes(const HeatMap& m, const Box& b) {
  std::string s;
  const auto x_ticks = ticks_within(m.x.low(), m.x.high(), 8);
  const auto y_ticks = ticks_within(m.y.low(), m.y.high(), 6);
  const auto step = [](const std::vector<double>& t) { return t.size() > 1 ? t[1] - t[0] : 1.0; };
  for (const double v : x_ticks) {
    const double x = b.x0 + (v - m.x.low()) / (m.x.high() - m.x.low()) * (b.x1 - b.x0);
    s += svg_line(x, b.y1, x, b.y1 + 5) +
         svg_text(x, b.y1 + 19, "middle", tick_text(v, step(x_ticks)));
  }
  for (const double v : y_ticks) {
    const double y = b.y1 - (v - m.y.low()) / (m.y.high() - m.y.low()) * (b.y1 - b.y0);
    s += svg_line(b.x0 - 5, y, b.x0, y) +
         svg_text(b.x0 - 8, y + 4, "end", tick_text(v, step(y_ticks)));
  }
  s += fmt::format(
      "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"none\" "
      "stroke=\"#9aa3ad\"/>\n",
      b.x0, b.y0, b.x1 - b.x0, b.y1 - b.y0);
  s += svg_text(0.5 * (b.x0 + b.x1), b.y1 + 40, "middle", m.x.label);
  return s + svg_upright(b.x0 - 52, 0.5 * (b.y0 + b.y1), m.y.label);
}

std::string svg_bar(const HeatMap& m, const Box& b) {
  const double x0 = m.width - 120, x1 = x0 + 20;
  const auto colours = colour_map(kColours);
  std::string s = "<defs><linearGradient id=\"bar\" x1=\"0\" y1=\"1\" x2=\"0\" y2=\"0\">";
  for (std::size_t c = 0; c < kColours; c += 15)
    s += fmt::format("<stop offset=\"{:.4f}\" stop-color=\"{}\"/>",
                     static_cast<double>(c) / (kColours - 1), hex_of(colours[c]));
  s += fmt::format(
      "</linearGradient></defs>\n<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"20\" height=\"{:.1f}\" "
      "fill=\"url(#bar)\" stroke=\"#9aa3ad\"/>\n",
      x0, b.y0, b.y1 - b.y0);
  const auto ticks = bar_ticks(m);
  for (const double v : ticks) {
    const double y = b.y1 - share_of(m, v) * (b.y1 - b.y0);
    s += svg_line(x1, y, x1 + 5, y) + svg_text(x1 + 8, y + 4, "start",
                                               tick_text(v, m.is_log           ? v
                                                            : ticks.size() > 1 ? ticks[1] - ticks[0]
                                                                               : 1.0));
  }
  return s + svg_upright(m.width - 14, 0.5 * (b.y0 + b.y1), m.label);
}

}  // namespace

Result<HeatMap> heat_map(const Recording& r, const HeatMapRequest& o) {
  if (r.columns.size() < 3 || r.rows() == 0)
    return error(ErrorCode::invalid_argument, "the recording has no map in it",
                 "Make one by robot.workspace, robot.reachability or robot.joint_slice.");
  const bool is_voxels = r.voxel > 0;
  HeatMap m;
  RMP_TRY_ASSIGN(const Column* value, column_of(r, !o.column.empty() ? o.column
                                                   : r.find("share") ? "share"
                                                                     : "manipulability"));
  RMP_TRY_ASSIGN(const Column* x, column_of(r, o.x.empty() ? r.columns[0].name : o.x));
  RMP_TRY_ASSIGN(const Column* y,
                 column_of(r, o.y.empty() ? r.columns[is_voxels ? 2 : 1].name : o.y));
  if (x == y)
    return error(ErrorCode::invalid_argument, "both axes are " + text::quote(x->name),
                 "Give two columns.", "y");
  const Column* third = nullptr;
  if (is_voxels)
    for (std::size_t k = 0; k < 3; ++k)
      if (&r.columns[k] != x && &r.columns[k] != y) third = &r.columns[k];
  if (is_voxels && (x > &r.columns[2] || y > &r.columns[2]))
    return error(ErrorCode::invalid_argument, "the axes of voxels are x, y and z",
                 "Choose two of them.", "x");
  RMP_TRY_ASSIGN(m.x, axis_of(*x, r.voxel));
  RMP_TRY_ASSIGN(m.y, axis_of(*y, r.voxel));
  if (m.x.count > kMostCells / m.y.count)
    return error(ErrorCode::invalid_argument,
                 "the map would have more than " + std::to_string(kMostCells) + " cells",
                 "Make a coarser one.");
  std::size_t layer = 0;
  HeatMap::Axis depth;
  if (third) {
    RMP_TRY_ASSIGN(depth, axis_of(*third, r.voxel));
    const double last = depth.first + depth.step * static_cast<double>(depth.count - 1);
    layer = index_of(depth, std::clamp(o.at.value_or(0), depth.first, last));
    m.at = depth.first + depth.step * static_cast<double>(layer);
  }
  m.values.assign(m.x.count * m.y.count, kNone);
  std::vector<std::uint8_t> is_taken(m.values.size(), 0);
  const Column* collision = is_voxels ? nullptr : r.find("collision");
  std::vector<double> shown;
  for (std::size_t i = 0; i < r.rows(); ++i) {
    if (third && index_of(depth, third->values[i]) != layer) continue;
    const std::size_t cell = index_of(m.y, y->values[i]) * m.x.count + index_of(m.x, x->values[i]);
    if (std::exchange(is_taken[cell], 1))
      return error(ErrorCode::invalid_argument, "several rows are at the same position of the map",
                   "Choose axes that distinguish the rows.");
    if (collision && collision->values[i] > 0.5) {
      m.has_collisions = true;
      continue;
    }
    m.values[cell] = value->values[i];
    m.cells += !std::isnan(value->values[i]);
    if (std::isfinite(value->values[i]) && (!o.is_log || value->values[i] > 0))
      shown.push_back(value->values[i]);
  }
  const ValueRange range = value_range(shown);
  m.low = o.low.value_or(range.low);
  m.high = o.high.value_or(range.high);
  m.is_log = o.is_log;
  if (m.is_log && !o.low) m.low = shown.empty() ? 1 : *std::min_element(shown.begin(), shown.end());
  if (!(m.low < m.high) || (m.is_log && !(m.low > 0)))
    return error(ErrorCode::invalid_argument,
                 "the colours cannot go from " + text::print_rounded(m.low, 6) + " to " +
                     text::print_rounded(m.high, 6),
                 "Give low and high in this order, both above zero with log.", "low");
  m.title = !o.title.empty() ? o.title : r.title;
  if (o.title.empty() && third && depth.count > 1)
    m.title += ", " + third->name + " = " + text::print_rounded(*m.at, 3) + " m";
  m.label = axis_label_of(*value);
  m.is_metric = is_voxels;
  m.curve = o.curve;
  m.width = o.width;
  m.height = o.height;
  return m;
}

std::string to_svg(const HeatMap& m) {
  const Box b = cells_box(m);
  std::string s = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} "
      "{1}\" font-family=\"DejaVu Sans, Helvetica, Arial, sans-serif\" font-size=\"12\" "
      "fill=\"#39424d\">\n<rect width=\"{0}\" height=\"{1}\" fill=\"#ffffff\"/>\n"
      "<text x=\"{2:.1f}\" y=\"28\" font-size=\"15\" text-anchor=\"middle\">{3}</text>\n",
      m.width, m.height, 0.5 * (b.x0 + b.x1), escape_xml(m.title));
  if (m.has_collisions)
    s += fmt::format(
        "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"{}\"/>\n", b.x0,
        b.y0, b.x1 - b.x0, b.y1 - b.y0, kBlank);
  s += svg_cells(m, b);
  for (const auto& p : m.curve) {
    const double x = (p[0] - m.x.low()) / (m.x.high() - m.x.low());
    const double y = (p[1] - m.y.low()) / (m.y.high() - m.y.low());
    if (x >= 0 && x <= 1 && y >= 0 && y <= 1)
      s += fmt::format("<circle cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"1.8\" fill=\"{}\"/>\n",
                       b.x0 + x * (b.x1 - b.x0), b.y1 - y * (b.y1 - b.y0), kCurve);
  }
  s += svg_axes(m, b) + svg_bar(m, b);
  double key = b.x0;
  const auto note = [&](const char* colour, const char* what) {
    s += fmt::format("<circle cx=\"{:.1f}\" cy=\"{}\" r=\"5\" fill=\"{}\"/>", key + 5,
                     m.height - 12, colour) +
         svg_text(key + 15, m.height - 8, "start", what);
    key += 100;
  };
  if (!m.curve.empty()) note(kCurve, "singular");
  if (m.has_collisions) note(kBlank, "collision");
  return s + "</svg>\n";
}

Result<std::string> heat_map_file(const HeatMap& m, const std::string& name) {
  return drawing_file(
      {m.width, m.height, [&] { return to_svg(m); }, [&] { return gnuplot_script(m); }}, name);
}

}  // namespace robomosp::recording
