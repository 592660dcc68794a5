// SPDX-License-Identifier: Apache-2.0
// Plots of columns against another one.
#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "kernel/text.h"
#include "sim/colour_map.h"
#include "sim/plot_file.h"
#include "sim/recording.h"

namespace robomosp::sim {
namespace {

/// Ten colours that stay apart for most kinds of colour vision (Tableau 10 order, own values).
constexpr std::array<const char*, 10> kPalette{"#2f6fb7", "#e07b1f", "#3a9a4b", "#c43c3c",
                                               "#7d5bb3", "#8a5a48", "#d264a8", "#6d7680",
                                               "#aaa623", "#22a3b8"};

AxisRange range_of(const std::vector<const Column*>& columns, int wanted) {
  double low = INFINITY, high = -INFINITY;
  for (const auto* c : columns)
    for (const double v : c->values) {
      if (!std::isfinite(v)) continue;
      low = std::min(low, v);
      high = std::max(high, v);
    }
  if (low > high) low = 0, high = 1;
  return nice_range(low, high, wanted);
}

/// Columns of one unit share a panel; panels are stacked.
std::vector<std::vector<const Column*>> panels_of(const PlotSpec& spec) {
  std::vector<std::vector<const Column*>> panels;
  for (const auto* c : spec.columns) {
    auto it = std::find_if(panels.begin(), panels.end(),
                           [&](const auto& p) { return p.front()->unit == c->unit; });
    if (it == panels.end()) panels.push_back({c});
    else it->push_back(c);
  }
  return panels;
}

std::string axis_label(const std::vector<const Column*>& panel) {
  // The common stem of the names, "tau" of tau1..tau7, with the unit.
  std::string stem = panel.front()->name;
  for (const auto* c : panel) {
    std::size_t n = 0;
    while (n < stem.size() && n < c->name.size() && stem[n] == c->name[n]) ++n;
    stem.resize(n);
  }
  if (panel.size() == 1) stem = panel.front()->name;
  while (!stem.empty() && stem.back() == '_') stem.pop_back();
  const std::string& unit = panel.front()->unit;
  if (unit.empty()) return stem;
  return stem.empty() ? "[" + unit + "]" : stem + " [" + unit + "]";
}

/// At most about two points a pixel: keeps the lowest and highest of each run of samples.
std::vector<std::size_t> visible_rows(const std::vector<double>& y, std::size_t budget) {
  std::vector<std::size_t> rows;
  const std::size_t n = y.size();
  if (n <= budget) {
    for (std::size_t i = 0; i < n; ++i) rows.push_back(i);
    return rows;
  }
  const std::size_t runs = budget / 2;
  for (std::size_t r = 0; r < runs; ++r) {
    const std::size_t a = r * n / runs, b = (r + 1) * n / runs;
    std::size_t low = a, high = a;
    for (std::size_t i = a; i < b; ++i) {
      if (y[i] < y[low]) low = i;
      if (y[i] > y[high]) high = i;
    }
    rows.push_back(std::min(low, high));
    if (low != high) rows.push_back(std::max(low, high));
  }
  if (rows.back() != n - 1) rows.push_back(n - 1);
  return rows;
}

std::string gnuplot_script(const PlotSpec& spec) {
  const auto panels = panels_of(spec);
  std::string s =
      "set border 3 linecolor rgb '#9aa3ad' linewidth 1\n"
      "set tics nomirror textcolor rgb '#39424d'\n"
      "set grid linetype 1 linecolor rgb '#e3e7ec' linewidth 1\n"
      "set key outside right top vertical textcolor rgb '#39424d' samplen 2 spacing 1.25\n"
      "set lmargin 13\nset rmargin 16\n";  // panels one below the other share their time axis
  for (std::size_t p = 0; p < panels.size(); ++p) {
    s += fmt::format("$panel{} << EOD\n", p);
    for (std::size_t r = 0; r < spec.x->values.size(); ++r) {
      s += text::print(spec.x->values[r]);
      for (const auto* c : panels[p]) {
        s += ' ';
        s += std::isfinite(c->values[r]) ? text::print(c->values[r]) : "NaN";
      }
      s += '\n';
    }
    s += "EOD\n";
  }
  s += fmt::format("set multiplot layout {},1 title {} font 'DejaVu Sans,13'\n", panels.size(),
                   gnuplot_text(spec.title));
  const std::string x_label =
      spec.x->unit.empty() ? spec.x->name : spec.x->name + " [" + spec.x->unit + "]";
  for (std::size_t p = 0; p < panels.size(); ++p) {
    const AxisRange x = range_of({spec.x}, 8), y = range_of(panels[p], 5);
    s += fmt::format(
        "set xrange [{}:{}]\nset yrange [{}:{}]\nset ylabel {}\nset xlabel {}\nplot ",
        text::print(spec.x->values.empty() ? 0 : spec.x->values.front()),
        text::print(spec.x->values.empty()
                        ? 1
                        : std::max(spec.x->values.back(), spec.x->values.front() + x.step * 1e-3)),
        text::print(y.low), text::print(y.high), gnuplot_text(axis_label(panels[p])),
        p + 1 == panels.size() ? gnuplot_text(x_label) : "''");
    for (std::size_t c = 0; c < panels[p].size(); ++c)
      s += fmt::format("{}$panel{} using 1:{} with lines linewidth 2 linecolor rgb '{}' title {}",
                       c ? ", " : "", p, c + 2, kPalette[c % kPalette.size()],
                       gnuplot_text(panels[p][c]->name));
    s += '\n';
  }
  return s + "unset multiplot\n";
}

}  // namespace

std::string to_svg(const PlotSpec& spec) {
  const auto panels = panels_of(spec);
  const double width = spec.width, height = spec.height;
  const double left = 76, right = 128, top = 48, bottom = 52, gap = 26;
  const double inner = (height - top - bottom - gap * static_cast<double>(panels.size() - 1)) /
                       static_cast<double>(panels.size());
  std::string s = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} "
      "{1}\" "
      "font-family=\"DejaVu Sans, Helvetica, Arial, sans-serif\" font-size=\"12\" "
      "fill=\"#39424d\">\n"
      "<rect width=\"{0}\" height=\"{1}\" fill=\"#ffffff\"/>\n"
      "<text x=\"{2:.1f}\" y=\"26\" font-size=\"15\" text-anchor=\"middle\">{3}</text>\n",
      spec.width, spec.height, left + (width - left - right) / 2, escape_xml(spec.title));
  const AxisRange rough = range_of({spec.x}, 8);
  const auto& xs = spec.x->values;
  const double x0 = xs.empty() ? 0 : xs.front();
  const double x1 = xs.empty() || xs.back() <= x0 ? x0 + 1 : xs.back();
  const auto px = [&](double x) { return left + (x - x0) / (x1 - x0) * (width - left - right); };
  for (std::size_t p = 0; p < panels.size(); ++p) {
    const double y0 = top + static_cast<double>(p) * (inner + gap), y1 = y0 + inner;
    const AxisRange range = range_of(panels[p], 5);
    const auto py = [&](double y) {
      return y1 - (y - range.low) / (range.high - range.low) * inner;
    };
    for (double y = range.low; y <= range.high + range.step * 0.5; y += range.step)
      s += fmt::format(
          "<line x1=\"{:.1f}\" x2=\"{:.1f}\" y1=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"#e3e7ec\"/>"
          "<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"end\">{}</text>\n",
          left, width - right, py(y), py(y), left - 8, py(y) + 4, tick_text(y, range.step));
    for (double x = std::ceil(x0 / rough.step - 1e-9) * rough.step; x <= x1 + rough.step * 1e-6;
         x += rough.step) {
      s += fmt::format(
          "<line x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1:.1f}\" y2=\"{2:.1f}\" stroke=\"#e3e7ec\"/>",
          px(x), y0, y1);
      if (p + 1 == panels.size())
        s += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{}</text>", px(x),
                         y1 + 18, tick_text(x, rough.step));
      s += '\n';
    }
    s += fmt::format(
        "<path d=\"M{0:.1f} {1:.1f}V{2:.1f}H{3:.1f}\" fill=\"none\" stroke=\"#9aa3ad\"/>\n", left,
        y0, y1, width - right);
    s += fmt::format(
        "<text transform=\"translate(18 {:.1f}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n",
        (y0 + y1) / 2, escape_xml(axis_label(panels[p])));
    for (std::size_t c = 0; c < panels[p].size(); ++c) {
      const auto& ys = panels[p][c]->values;
      const char* colour = kPalette[c % kPalette.size()];
      std::string d;
      bool pen = false;  // lifted over values that are not finite
      for (const std::size_t r : visible_rows(ys, static_cast<std::size_t>(width) * 2)) {
        if (!std::isfinite(ys[r])) {
          pen = false;
          continue;
        }
        d += fmt::format("{}{:.2f} {:.2f}", pen ? 'L' : 'M', px(xs[r]), py(ys[r]));
        pen = true;
      }
      const double key = y0 + 8 + 19 * static_cast<double>(c);
      s += fmt::format(
          "<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"2\" "
          "stroke-linejoin=\"round\"/>"
          "<line x1=\"{:.1f}\" x2=\"{:.1f}\" y1=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"{}\" "
          "stroke-width=\"2.5\"/>"
          "<text x=\"{:.1f}\" y=\"{:.1f}\">{}</text>\n",
          d, colour, width - right + 14, width - right + 34, key, key, colour, width - right + 40,
          key + 4, escape_xml(panels[p][c]->name));
    }
  }
  const std::string x_label =
      spec.x->unit.empty() ? spec.x->name : spec.x->name + " [" + spec.x->unit + "]";
  s += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{}</text>\n</svg>\n",
                   left + (width - left - right) / 2, height - 14, escape_xml(x_label));
  return s;
}

Result<void> write_plot(const PlotSpec& spec, const std::string& path) {
  if (spec.columns.empty() || !spec.x)
    return error(ErrorCode::invalid_argument, "there is nothing to plot",
                 "Name at least one column.");
  return write_drawing(
      {spec.width, spec.height, [&] { return to_svg(spec); }, [&] { return gnuplot_script(spec); }},
      path);
}

}  // namespace robomosp::sim
