// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/forms/small_plot.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include <QPainter>
#include <QPolygonF>

#include "viewer/theme/theme.h"
#include "viewer/widgets/field.h"

namespace robomosp::viewer {
namespace {

constexpr std::size_t kMostCurves = 7;

/// "tau" of "tau3".
std::string stem_of(const std::string& name) {
  std::size_t end = name.size();
  while (end > 0 && name[end - 1] >= '0' && name[end - 1] <= '9') --end;
  return end == 0 ? name : name.substr(0, end);
}

}  // namespace

std::vector<std::string> small_plot_columns(const List& columns) {
  std::vector<std::string> names;
  for (const Value& each : columns)
    if (const Map* row = each.as_map())
      if (const Value* name = row->find("name"); name && name->as_string())
        names.push_back(*name->as_string());
  if (std::find(names.begin(), names.end(), "time") == names.end()) return {};
  std::erase(names, "time");
  if (names.empty()) return {};
  std::string stem = stem_of(names.front());
  for (const std::string& name : names)
    if (stem_of(name) == "tau") stem = "tau";
  std::vector<std::string> out;
  for (const std::string& name : names)
    if (out.size() < kMostCurves && stem_of(name) == stem) out.push_back(name);
  return out;
}

QImage draw_small_plot(const NumericArray& values, QSize size, double ratio, const Theme& t) {
  const std::size_t rows = values.is_matrix() ? values.rows() : 0,
                    cols = values.is_matrix() ? values.cols() : 0;
  if (rows < 2 || cols < 2 || size.isEmpty()) return {};
  const auto numbers = values.data();
  const auto at = [&](std::size_t row, std::size_t col) { return numbers[row * cols + col]; };
  constexpr double kInf = std::numeric_limits<double>::infinity();
  double low = kInf, high = -kInf;
  for (std::size_t r = 0; r < rows; ++r)
    for (std::size_t c = 1; c < cols; ++c)
      if (const double v = at(r, c); std::isfinite(v)) {
        low = std::min(low, v);
        high = std::max(high, v);
      }
  const double from = at(0, 0), to = at(rows - 1, 0);
  if (!(low <= high) || !(from < to) || !std::isfinite(to - from)) return {};
  if (high - low < 1e-12 * std::max(1.0, std::fabs(high))) {
    const double room = std::max(1e-9, 0.1 * std::fabs(low));
    low -= room;
    high += room;
  }
  QImage image(size, QImage::Format_RGB32);
  image.fill(t.panel);
  QPainter p(&image);
  p.setRenderHint(QPainter::Antialiasing);
  QFont font = t.small;
  font.setPixelSize(std::max(1, static_cast<int>(std::lround(t.px(11) * ratio))));
  p.setFont(font);
  const QFontMetricsF metrics(font);
  const QString top = number_text(high), bottom = number_text(low);
  const double left = std::max(metrics.horizontalAdvance(top), metrics.horizontalAdvance(bottom)) +
                      2 * t.gap * ratio;
  const QRectF area(left, 0.75 * metrics.height(), size.width() - left - t.gap * ratio,
                    size.height() - 2.5 * metrics.height());
  if (area.width() < 8 || area.height() < 8) return {};
  p.setPen(QPen(t.line, ratio));
  for (const double share : {0.0, 0.5, 1.0}) {
    const double y = area.top() + share * area.height();
    p.drawLine(QPointF(area.left(), y), QPointF(area.right(), y));
  }
  p.setPen(t.text_dim);
  const double line = metrics.height();
  const auto beside = [&](double y, const QString& text) {
    p.drawText(QRectF(0, y - 0.5 * line, left - t.gap * ratio, line),
               Qt::AlignRight | Qt::AlignVCenter, text);
  };
  beside(area.top(), top);
  beside(area.bottom(), bottom);
  const QRectF below(area.left(), area.bottom() + 0.3 * line, area.width(), line);
  p.drawText(below, Qt::AlignLeft | Qt::AlignVCenter, number_text(from) + " s");
  p.drawText(below, Qt::AlignRight | Qt::AlignVCenter, number_text(to) + " s");
  // Of the samples that fall on one column of pixels, the first, the extremes and the last.
  for (std::size_t c = 1; c < cols; ++c) {
    p.setPen(QPen(t.series[(c - 1) % t.series.size()], 1.5 * ratio));
    QPolygonF curve;
    const auto add = [&](double x, double v) {
      curve += QPointF(x, area.bottom() - (v - low) / (high - low) * area.height());
    };
    const auto flush = [&] {
      if (curve.size() > 1) p.drawPolyline(curve);
      curve.clear();
    };
    std::size_t r = 0;
    while (r < rows) {
      const double x = area.left() + (at(r, 0) - from) / (to - from) * area.width();
      if (!std::isfinite(x) || !std::isfinite(at(r, c))) {
        flush();
        ++r;
        continue;
      }
      const double column = std::floor(x), first = at(r, c);
      double least = first, most = first, last = first;
      for (++r; r < rows && std::isfinite(at(r, c)); ++r) {
        const double next = area.left() + (at(r, 0) - from) / (to - from) * area.width();
        if (std::floor(next) != column) break;
        last = at(r, c);
        least = std::min(least, last);
        most = std::max(most, last);
      }
      add(x, first);
      if (least < first) add(x, least);
      if (most > first) add(x, most);
      if (last != most || last == least) add(x, last);
    }
    flush();
  }
  return image;
}

}  // namespace robomosp::viewer
