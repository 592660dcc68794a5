// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/forms/plot_view.h"

#include <algorithm>
#include <cmath>

#include <QKeyEvent>
#include <QMouseEvent>
#include <QPainter>
#include <QPainterPath>
#include <QWheelEvent>

#include "viewer/theme/theme.h"
#include "viewer/widgets/field.h"

namespace robomosp::viewer {
namespace {

/// 1, 2 or 5 times a power of ten, about `range / count`.
double tick_step(double range, int count) {
  const double raw = range / std::max(1, count);
  if (!(raw > 0) || !std::isfinite(raw)) return 1;
  const double ten = std::pow(10, std::floor(std::log10(raw)));
  const double r = raw / ten;
  return (r < 1.5 ? 1 : r < 3.5 ? 2 : r < 7.5 ? 5 : 10) * ten;
}

}  // namespace

PlotView::PlotView(QWidget* parent) : QWidget(parent) {
  setMouseTracking(true);
  setFocusPolicy(Qt::StrongFocus);
  setMinimumHeight(theme().px(140));
  setAccessibleName("Plot");
  setToolTip("Wheel: zoom; drag: move; double click: all; + and - zoom, arrows move.");
}

QSize PlotView::sizeHint() const { return {theme().px(560), theme().px(220)}; }

void PlotView::show_data(std::shared_ptr<const PlotData> data) {
  data_ = std::move(data);
  shown_.assign(data_ ? data_->columns.size() : 0, true);
  make_panels();
  fit();
}

void PlotView::set_shown(std::size_t column, bool on) {
  if (column >= shown_.size()) return;
  shown_[column] = on;
  make_panels();
  update();
}

void PlotView::make_panels() {
  panels_.clear();
  if (!data_) return;
  for (std::size_t i = 0; i < data_->columns.size(); ++i) {
    if (!shown_[i]) continue;
    const std::string& unit = data_->columns[i].unit;
    auto it = std::find_if(panels_.begin(), panels_.end(),
                           [&](const Panel& p) { return p.unit == unit; });
    if (it == panels_.end()) it = panels_.insert(panels_.end(), Panel{unit, {}, 0, 1});
    it->columns.push_back(i);
  }
  for (Panel& p : panels_) {
    double low = 1e300, high = -1e300;
    for (const std::size_t c : p.columns)
      for (const double v : data_->columns[c].values)
        if (std::isfinite(v)) {
          low = std::min(low, v);
          high = std::max(high, v);
        }
    if (low > high) low = 0, high = 1;
    if (high - low < 1e-12 * std::max(1.0, std::fabs(high))) {
      low -= std::max(1e-9, std::fabs(low) * 0.1);
      high += std::max(1e-9, std::fabs(high) * 0.1);
    }
    const double room = 0.06 * (high - low);
    p.low = low - room;
    p.high = high + room;
  }
}

void PlotView::fit() {
  from_ = 0;
  to_ = 1;
  if (data_ && !data_->x.empty()) {
    const auto [low, high] = std::minmax_element(data_->x.begin(), data_->x.end());
    from_ = *low;
    to_ = *high > *low ? *high : *low + 1;
  }
  update();
}

QRect PlotView::area() const {
  const Theme& t = theme();
  return rect().adjusted(t.px(56), t.px(10), -t.px(28), -t.px(44));
}

double PlotView::x_at(double pixel) const {
  const QRect a = area();
  return from_ + (pixel - a.left()) / std::max(1, a.width()) * (to_ - from_);
}
double PlotView::pixel_at(double x) const {
  const QRect a = area();
  return a.left() + (x - from_) / (to_ - from_) * a.width();
}

void PlotView::paintEvent(QPaintEvent*) {
  const Theme& t = theme();
  QPainter p(this);
  p.fillRect(rect(), t.panel);
  if (!data_ || panels_.empty()) return;
  p.setRenderHint(QPainter::Antialiasing);
  const QRect all = area();
  const int gap = t.px(10);
  const int count = static_cast<int>(panels_.size());
  const int panel_height = (all.height() - gap * (count - 1)) / count;
  const double dx = tick_step(to_ - from_, all.width() / t.px(90));
  p.setFont(t.mono);
  for (int i = 0; i < count; ++i) {
    const Panel& panel = panels_[static_cast<std::size_t>(i)];
    const QRect a(all.left(), all.top() + i * (panel_height + gap), all.width(), panel_height);
    const auto y_of = [&](double v) {
      return a.bottom() - (v - panel.low) / (panel.high - panel.low) * a.height();
    };
    p.setPen(QPen(t.line, 1));
    const double dy = tick_step(panel.high - panel.low, std::max(2, panel_height / t.px(34)));
    for (double v = std::ceil(panel.low / dy) * dy; v <= panel.high; v += dy) {
      const double y = y_of(v);
      p.setPen(QPen(t.line, 1));
      p.drawLine(QPointF(a.left(), y), QPointF(a.right(), y));
      p.setPen(t.text_quiet);
      p.drawText(QRectF(0, y - t.px(8), a.left() - t.px(6), t.px(16)),
                 Qt::AlignRight | Qt::AlignVCenter, number_text(std::fabs(v) < dy * 1e-6 ? 0 : v));
    }
    for (double x = std::ceil(from_ / dx) * dx; x <= to_; x += dx) {
      const double px = pixel_at(x);
      p.setPen(QPen(t.line, 1));
      p.drawLine(QPointF(px, a.top()), QPointF(px, a.bottom()));
      if (i + 1 == count) {
        p.setPen(t.text_quiet);
        p.drawText(QRectF(px - t.px(40), a.bottom() + t.px(4), t.px(80), t.px(16)),
                   Qt::AlignHCenter | Qt::AlignTop,
                   number_text(std::fabs(x) < dx * 1e-6 ? 0 : x) +
                       (data_->x_unit.empty() ? QString() : " " + unit_text(data_->x_unit)));
      }
    }
    p.setPen(t.text_dim);
    p.drawText(QRectF(a.left() + t.px(6), a.top() + t.px(2), a.width(), t.px(16)),
               Qt::AlignLeft | Qt::AlignTop, unit_text(panel.unit));
    p.save();
    p.setClipRect(a);
    std::size_t colour = 0;
    for (const std::size_t c : panel.columns) {
      const auto& values = data_->columns[c].values;
      const std::size_t n = std::min(values.size(), data_->x.size());
      QPainterPath path;
      bool is_begun = false;
      // Where many samples fall on a pixel, their least and greatest are drawn.
      const bool is_dense = static_cast<double>(n) > 4.0 * all.width();
      int last_px = -1;
      double low = 0, high = 0;
      const auto flush = [&] {
        if (last_px < 0) return;
        if (!is_begun) path.moveTo(last_px, low);
        path.lineTo(last_px, low);
        path.lineTo(last_px, high);
        is_begun = true;
      };
      for (std::size_t k = 0; k < n; ++k) {
        const double x = data_->x[k], v = values[k];
        if (k + 1 < n && data_->x[k + 1] < from_) continue;
        if (!std::isfinite(v)) {
          if (is_dense) flush();
          last_px = -1;
          is_begun = false;
          continue;
        }
        const double px = pixel_at(x), py = y_of(v);
        if (!is_dense) {
          if (is_begun) path.lineTo(px, py);
          else path.moveTo(px, py);
          is_begun = true;
        } else if (static_cast<int>(px) != last_px) {
          flush();
          last_px = static_cast<int>(px);
          low = high = py;
        } else {
          low = std::min(low, py);
          high = std::max(high, py);
        }
        if (x > to_) break;
      }
      if (is_dense) flush();
      p.setPen(QPen(t.series[colour++ % t.series.size()], 1.5));
      p.setBrush(Qt::NoBrush);
      p.drawPath(path);
    }
    p.restore();
  }
  // Cursor and legend with values.
  std::size_t row = 0;
  if (cursor_ && !data_->x.empty()) {
    p.setPen(QPen(t.accent, 1));
    const double px = pixel_at(*cursor_);
    if (px >= all.left() && px <= all.right())
      p.drawLine(QPointF(px, all.top()), QPointF(px, all.bottom()));
    const auto it = std::lower_bound(data_->x.begin(), data_->x.end(), *cursor_);
    row = std::min(static_cast<std::size_t>(it - data_->x.begin()), data_->x.size() - 1);
  }
  int x = all.left();
  const int y = height() - t.px(20);
  for (const Panel& panel : panels_) {
    std::size_t colour = 0;
    for (const std::size_t c : panel.columns) {
      QString name = qt(data_->columns[c].name);
      if (cursor_ && row < data_->columns[c].values.size())
        name += " " + number_text(data_->columns[c].values[row]);
      const int w = t.px(14) + p.fontMetrics().horizontalAdvance(name) + t.px(12);
      if (x + w > width()) break;
      p.fillRect(QRect(x, y + t.px(6), t.px(10), t.px(3)), t.series[colour++ % t.series.size()]);
      p.setPen(t.text_dim);
      p.drawText(QRect(x + t.px(14), y, w, t.px(16)), Qt::AlignVCenter | Qt::AlignLeft, name);
      x += w;
    }
  }
  if (hasFocus()) {
    p.setPen(QPen(t.accent, 1));
    p.setBrush(Qt::NoBrush);
    p.drawRect(rect().adjusted(0, 0, -1, -1));
  }
}

void PlotView::zoom(double factor, double about) {
  const double from = about - (about - from_) * factor, to = about + (to_ - about) * factor;
  if (to - from < 1e-9 || !std::isfinite(to - from)) return;
  from_ = from;
  to_ = to;
  update();
}

void PlotView::move_by(double x) {
  from_ += x;
  to_ += x;
  update();
}

void PlotView::wheelEvent(QWheelEvent* event) {
  zoom(std::pow(0.85, event->angleDelta().y() / 120.0), x_at(event->position().x()));
  event->accept();
}

void PlotView::mousePressEvent(QMouseEvent* event) {
  if (event->button() == Qt::LeftButton) drag_x_ = event->pos().x();
}

void PlotView::mouseMoveEvent(QMouseEvent* event) {
  if (drag_x_) {
    move_by(x_at(*drag_x_) - x_at(event->pos().x()));
    drag_x_ = event->pos().x();
  }
  cursor_ = x_at(event->pos().x());
  update();
}

void PlotView::mouseReleaseEvent(QMouseEvent*) { drag_x_.reset(); }
void PlotView::mouseDoubleClickEvent(QMouseEvent*) { fit(); }

void PlotView::keyPressEvent(QKeyEvent* event) {
  const double span = to_ - from_;
  switch (event->key()) {
    case Qt::Key_Plus: return zoom(0.8, from_ + span / 2);
    case Qt::Key_Minus: return zoom(1.25, from_ + span / 2);
    case Qt::Key_Left: return move_by(-span / 10);
    case Qt::Key_Right: return move_by(span / 10);
    case Qt::Key_Home: return fit();
    default: QWidget::keyPressEvent(event);
  }
}

void PlotView::leaveEvent(QEvent*) {
  cursor_.reset();
  update();
}

}  // namespace robomosp::viewer
