// SPDX-License-Identifier: Apache-2.0
// Plots in characters of ASCII, for the console.
#include <algorithm>
#include <array>
#include <cmath>

#include "recording/plot/layout.h"

namespace robomosp::recording {
namespace {

constexpr std::string_view kMarks = "*+ox#@%&$=";
constexpr std::size_t kRows = 15, kLeft = 11;

/// Characters of one panel, row after row from above.
class Sheet {
 public:
  Sheet(std::size_t columns, ValueRange x, ValueRange y)
      : columns_(columns), x_(x), y_(y), cells_(columns * kRows, ' ') {}

  void row_of(double y, char c) {
    const auto r = static_cast<std::ptrdiff_t>(std::lround(row(y)));
    if (r < 0 || r >= static_cast<std::ptrdiff_t>(kRows)) return;
    for (std::size_t k = 0; k < columns_; ++k)
      cells_[static_cast<std::size_t>(r) * columns_ + k] = c;
  }

  void line(const std::vector<double>& x, const std::vector<double>& y, char mark) {
    for (std::size_t i = 0; i < x.size(); ++i) {
      put(column(x[i]), row(y[i]), mark);
      if (i == 0) continue;
      const double dc = column(x[i]) - column(x[i - 1]), dr = row(y[i]) - row(y[i - 1]);
      const double steps = std::ceil(std::max(std::fabs(dc), std::fabs(dr)));
      for (double s = 1; s < steps; ++s)
        put(column(x[i - 1]) + dc * s / steps, row(y[i - 1]) + dr * s / steps, mark);
    }
  }

  [[nodiscard]] std::string row_text(std::size_t r) const {
    return cells_.substr(r * columns_, columns_);
  }
  [[nodiscard]] double row(double y) const {
    return (y_.high - y) / (y_.high - y_.low) * (kRows - 1.0);
  }
  [[nodiscard]] double column(double x) const {
    return (x - x_.low) / (x_.high - x_.low) * (static_cast<double>(columns_) - 1.0);
  }

 private:
  void put(double c, double r, char mark) {
    if (!(c > -0.5 && c < static_cast<double>(columns_) - 0.5 && r > -0.5 && r < kRows - 0.5))
      return;
    cells_[static_cast<std::size_t>(std::lround(r)) * columns_ +
           static_cast<std::size_t>(std::lround(c))] = mark;
  }

  std::size_t columns_;
  ValueRange x_, y_;
  std::string cells_;
};

std::string padded(const std::string& s, std::size_t width) {
  return s.size() >= width ? s : std::string(width - s.size(), ' ') + s;
}

std::string numbers_below(const Sheet& sheet, const std::vector<AxisMark>& marks,
                          std::size_t columns, std::string& ruler) {
  std::string below(columns + kLeft + 8, ' ');
  for (const AxisMark& m : marks) {
    const auto c = static_cast<std::size_t>(std::lround(sheet.column(m.at)));
    ruler[c] = '+';
    const std::string& number = m.text;
    const std::size_t from = kLeft + 1 + c - std::min(kLeft + 1 + c, number.size() / 2);
    if (from + number.size() <= below.size()) below.replace(from, number.size(), number);
  }
  below.erase(below.find_last_not_of(' ') + 1);
  return below;
}

std::string panel_text(const Plot& plot, const PlotPanel& panel, std::size_t columns) {
  const ValueRange x = x_range(plot), y = y_range(panel, 4, plot.log_y);
  Sheet sheet(columns, x, y);
  for (const double limit : {panel.lower, panel.upper})
    if (std::isfinite(limit)) sheet.row_of(limit, '-');
  for (std::size_t i = 0; i < panel.lines.size(); ++i)
    sheet.line(panel.lines[i].x, panel.lines[i].y, kMarks[i % kMarks.size()]);
  std::array<std::string, kRows> labels;
  for (const AxisMark& m : axis_marks(y, 4, plot.log_y))
    labels[static_cast<std::size_t>(std::lround(sheet.row(m.at)))] = m.text;
  std::string out = panel.y_label + '\n';
  for (std::size_t r = 0; r < kRows; ++r) {
    std::string row = sheet.row_text(r);
    row.erase(row.find_last_not_of(' ') + 1);
    out += padded(labels[r], kLeft - 1) + (labels[r].empty() ? " |" : " +") + row + '\n';
  }
  std::string ruler(columns, '-');
  const std::string below = numbers_below(sheet, axis_marks(x, 6, plot.log_x), columns, ruler);
  out += std::string(kLeft, ' ') + '+' + ruler + '\n' + below + '\n';
  return out + padded(plot.x_label, kLeft + 1 + (columns + plot.x_label.size()) / 2) + '\n';
}

/// What each mark stands for, and how limits are drawn.
std::string legend(const Plot& plot, const PlotPanel& panel) {
  const bool is_list = !plot.sources.empty();  // one below the other, since titles are long
  const std::string indent(kLeft + 1, ' ');
  std::string out = indent;
  for (std::size_t i = 0; i < panel.lines.size(); ++i) {
    const PlotLine& line = panel.lines[i];
    if (is_list && i > 0) out += '\n' + indent;
    out += std::string(1, kMarks[i % kMarks.size()]) + ' ' + line.name;
    if (is_list && !plot.is_path) out += " of " + plot.sources[line.source];
    if (!is_list) out += "   ";
  }
  if (is_list) out += '\n' + indent;
  if (std::isfinite(panel.lower) || std::isfinite(panel.upper)) out += "-- limit";
  out.erase(out.find_last_not_of(' ') + 1);
  return out + '\n';
}

/// A path's projections: from above, from the front and from the left.
std::vector<Plot> views(const Plot& path) {
  std::vector<Plot> out;
  const std::string labels[3] = {path.x_label, path.panels.front().y_label, path.z_label};
  for (const auto& [across, up] : {std::pair<std::size_t, std::size_t>{0, 1}, {0, 2}, {1, 2}}) {
    Plot view;
    view.x_label = labels[across];
    view.panels.emplace_back();
    view.panels.front().y_label = labels[up];
    for (const PlotLine& line : path.panels.front().lines) {
      const std::vector<double>* values[3] = {&line.x, &line.y, &line.z};
      view.panels.front().lines.push_back({line.name, *values[across], *values[up], {}, 0, 0});
    }
    out.push_back(std::move(view));
  }
  return out;
}

}  // namespace

std::string to_text(const Plot& plot, std::size_t columns) {
  const std::size_t inner = std::max<std::size_t>(columns, 40) - kLeft - 4;
  std::string out = plot.title + '\n';
  if (plot.is_path) {
    for (const Plot& view : views(plot)) out += panel_text(view, view.panels.front(), inner);
    return out + legend(plot, plot.panels.front());
  }
  for (const PlotPanel& panel : plot.panels)
    out += panel_text(plot, panel, inner) + legend(plot, panel);
  return out;
}

}  // namespace robomosp::recording
