// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/timeline/bands_view.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <QHelpEvent>
#include <QKeyEvent>
#include <QMouseEvent>
#include <QPainter>
#include <QPainterPath>
#include <QToolTip>
#include <QWheelEvent>

#include "viewer/plots/plot_lanes.h"
#include "viewer/theme/theme.h"

namespace robomosp::viewer {
namespace {

constexpr double kSegmentHeight = 22, kBandHeight = 16;  ///< [px of the design]
constexpr double kLeastWidth = 3;                        ///< of a span [px]

bool is_limit_band(const Band& band) {
  return band.name == "clearance" || band.name == "position" || band.name == "speed" ||
         band.name == "torque" || band.name == "faults";
}

}  // namespace

BandsView::BandsView(TimeAxis& axis, QWidget* parent) : QWidget(parent), axis_(axis) {
  setObjectName("bands");
  setAccessibleName("Bands");
  setToolTip(
      "Segments, limits, faults, grips and signals over time; a click shows what is there.\n"
      "recording.bands(id)");
  setFocusPolicy(Qt::StrongFocus);
  setSizePolicy(QSizePolicy::Preferred, QSizePolicy::Fixed);
  axis_.changed.add(this, [this] { update(); });
}

void BandsView::show_bands(std::vector<Band> bands) {
  bands_ = std::move(bands);
  if (current_.band >= bands_.size()) current_ = {};
  else if (current_.span && *current_.span >= bands_[current_.band].spans.size())
    current_.span.reset();
  updateGeometry();
  update();
}

void BandsView::set_cursor(std::optional<double> time) {
  cursor_ = time;
  if (std::any_of(bands_.begin(), bands_.end(), [](const Band& b) { return b.is_signal; }))
    update(QRect(0, 0, static_cast<int>(axis_.left()), height()));
}

void BandsView::set_dimmed(bool on) {
  if (std::exchange(is_dimmed_, on) != on) update();
}

void BandsView::set_selected(const std::optional<Handle>& record, const std::string& path) {
  selected_ = record;
  selected_path_ = path;
  update();
}

int BandsView::height_of(const Band& band) const {
  return theme().px(band.name == "segments" ? kSegmentHeight : kBandHeight);
}

QSize BandsView::sizeHint() const {
  int height = bands_.empty() ? 0 : theme().px(4);
  for (const Band& band : bands_) height += height_of(band);
  return {theme().px(300), height};
}

QRect BandsView::band_rect(std::size_t band) const {
  int top = theme().px(2);
  for (std::size_t i = 0; i < band && i < bands_.size(); ++i) top += height_of(bands_[i]);
  return band < bands_.size() ? QRect(0, top, width(), height_of(bands_[band])) : QRect();
}

QRect BandsView::span_rect(std::size_t band, std::size_t span) const {
  if (band >= bands_.size() || span >= bands_[band].spans.size()) return {};
  const BandSpan& s = bands_[band].spans[span];
  const double begin = axis_.left(), end = axis_.left() + axis_.length();
  double from = axis_.x_of(s.from), to = axis_.x_of(s.to);
  if (to < begin || from > end) return {};
  if (to - from < kLeastWidth) {
    const double middle = (from + to) / 2;
    from = middle - kLeastWidth / 2;
    to = middle + kLeastWidth / 2;
  }
  const QRect row = band_rect(band);
  const int left = static_cast<int>(std::lround(std::max(from, begin))),
            right = static_cast<int>(std::lround(std::min(to, end)));
  const int pad = theme().px(2);
  return {left, row.top() + pad, std::max(1, right - left), row.height() - 2 * pad};
}

std::optional<BandsView::Place> BandsView::place_at(QPoint at) const {
  for (std::size_t b = 0; b < bands_.size(); ++b) {
    if (!band_rect(b).contains(at)) continue;
    Place place{b, {}};
    // The last one is drawn on top.
    for (std::size_t s = bands_[b].spans.size(); s-- > 0;) {
      const QRect r = span_rect(b, s);
      if (at.x() >= r.left() - 1 && at.x() <= r.right() + 1 && !r.isEmpty()) {
        place.span = s;
        break;
      }
    }
    return place;
  }
  return std::nullopt;
}

QString BandsView::value_of(const Band& signal, double time) const {
  const auto after = std::upper_bound(signal.times.begin(), signal.times.end(), time);
  if (after == signal.times.begin()) return {};
  const double v = signal.values[static_cast<std::size_t>(after - signal.times.begin()) - 1];
  if (signal.is_digital) return v != 0 ? "on" : "off";
  return fixed_number(v, 2);
}

QString BandsView::sentence_of(const Place& place) const {
  const Band& band = bands_[place.band];
  if (place.span) return band.spans[*place.span].text;
  if (!band.is_known) return band.label + ": not looked at, " + band.why;
  QString text = band.label;
  if (is_limit_band(band) && band.spans.empty()) text += ": nothing found";
  if (!band.note.isEmpty()) text += "; " + band.note;
  return text;
}

QString BandsView::text_at(QPoint at) const {
  const auto place = place_at(at);
  if (!place) return {};
  const Band& band = bands_[place->band];
  if (band.is_signal && at.x() >= axis_.left())
    return band.label + ": " + value_of(band, axis_.time_at(at.x()));
  return sentence_of(*place);
}

bool BandsView::event(QEvent* event) {
  if (event->type() == QEvent::ToolTip) {
    auto* help = static_cast<QHelpEvent*>(event);
    const QString text = text_at(help->pos());
    QToolTip::showText(help->globalPos(), text.isEmpty() ? toolTip() : text, this);
    return true;
  }
  return QWidget::event(event);
}

void BandsView::paint_spans(QPainter& p, std::size_t b, const QRect& area) const {
  const Theme& t = theme();
  const Band& band = bands_[b];
  const bool is_limit = is_limit_band(band);
  if (!band.is_known) {
    p.fillRect(area, QBrush(t.line, Qt::BDiagPattern));
    p.setFont(t.small);
    const QString why = band.name == "clearance" ? band.why + " – click to compute it" : band.why;
    const QFontMetrics size(t.small);
    const QString text = size.elidedText(why, Qt::ElideRight, area.width() - t.px(16));
    const QRect ground(area.left() + t.px(6), area.top(), size.horizontalAdvance(text) + t.px(10),
                       area.height());
    p.fillRect(ground, t.panel);
    p.setPen(band.name == "clearance" ? t.accent : t.text_quiet);
    p.drawText(ground, Qt::AlignCenter, text);
    return;
  }
  if (is_limit) p.fillRect(area, t.ok_ground);
  for (std::size_t i = 0; i < band.spans.size(); ++i) {
    const BandSpan& span = band.spans[i];
    const QRect r = span_rect(b, i);
    if (r.isEmpty()) continue;
    if (is_limit) {
      p.fillRect(r, span.level == "fault" ? t.fault : t.warn_fill);
      continue;
    }
    if (span.level == "note") {
      QPainterPath mark;
      const QPointF c = QRectF(r).center();
      const double h = t.px(4);
      mark.moveTo(c + QPointF(0, -h));
      mark.lineTo(c + QPointF(h, 0));
      mark.lineTo(c + QPointF(0, h));
      mark.lineTo(c + QPointF(-h, 0));
      mark.closeSubpath();
      p.fillPath(mark, t.accent);
      continue;
    }
    const bool is_selected =
        selected_ && span.record == selected_ && (span.path.empty() || span.path == selected_path_);
    const bool is_minor = span.level == "transition" || span.level == "approach";
    p.fillRect(r, is_selected ? t.selection : is_minor ? t.field : t.header);
    p.setPen(QPen(is_selected ? t.accent : t.field_line, 1));
    p.drawRect(r.adjusted(0, 0, -1, -1));
    if (r.width() < t.px(14)) continue;
    p.setFont(t.small);
    p.setPen(is_minor ? t.text_quiet : t.text);
    const QRect words = r.adjusted(t.px(6), 0, -t.px(3), 0);
    p.drawText(words, Qt::AlignVCenter | Qt::AlignLeft,
               QFontMetrics(t.small).elidedText(span.text, Qt::ElideRight, words.width()));
  }
}

void BandsView::paint_signal(QPainter& p, const Band& band, const QRect& area) const {
  if (band.times.empty()) return;
  const auto [low, high] = std::minmax_element(band.values.begin(), band.values.end());
  const double least = band.is_digital ? 0 : *low, most = band.is_digital ? 1 : *high;
  const double range = most > least ? most - least : 1;
  const auto y_of = [&](double v) {
    return area.bottom() - 2 - (v - least) / range * (area.height() - 4);
  };
  // Changes within one pixel are one stroke.
  QPainterPath path;
  bool is_begun = false;
  double last_x = 0, last_y = 0, top = 0, bottom = 0;
  const auto end_stroke = [&] {
    if (!(bottom > top)) return;
    path.lineTo(last_x, top);
    path.lineTo(last_x, bottom);
    path.lineTo(last_x, last_y);
  };
  const double end = axis_.left() + axis_.length();
  const auto after = std::upper_bound(band.times.begin(), band.times.end(), axis_.low());
  auto i = static_cast<std::size_t>(after - band.times.begin());
  if (i > 0) --i;  // the value at the left edge
  for (; i < band.times.size(); ++i) {
    const double x = std::max(axis_.left(), axis_.x_of(band.times[i]));
    const double y = y_of(band.values[i]);
    if (x > end) break;
    if (is_begun && x - last_x < 1) {
      top = std::min(top, y);
      bottom = std::max(bottom, y);
      last_y = y;
      continue;
    }
    if (is_begun) {
      end_stroke();
      path.lineTo(x, last_y);
      path.lineTo(x, y);
    } else {
      path.moveTo(x, y);
    }
    is_begun = true;
    last_x = x;
    last_y = top = bottom = y;
  }
  if (!is_begun) return;
  end_stroke();
  const double stop = std::min(end, axis_.x_of(axis_.to()));
  if (stop > last_x) path.lineTo(stop, last_y);
  p.setPen(QPen(theme().text_dim, 1));
  p.setBrush(Qt::NoBrush);
  p.drawPath(path);
}

void BandsView::paintEvent(QPaintEvent* event) {
  const Theme& t = theme();
  QPainter p(this);
  p.fillRect(event->rect(), t.panel);
  const int left = static_cast<int>(axis_.left()), length = static_cast<int>(axis_.length());
  for (std::size_t b = 0; b < bands_.size(); ++b) {
    const QRect row = band_rect(b);
    if (!row.intersects(event->rect())) continue;
    const Band& band = bands_[b];
    p.setFont(t.small);
    p.setOpacity(1);
    p.setPen(hasFocus() && b == current_.band && !current_.span ? t.accent : t.text_dim);
    const QRect label = QRect(0, row.top(), left, row.height()).adjusted(t.px(8), 0, -t.px(6), 0);
    p.drawText(label, Qt::AlignVCenter | Qt::AlignLeft,
               QFontMetrics(t.small).elidedText(band.label, Qt::ElideRight, label.width()));
    if (band.is_signal && cursor_) {
      p.setPen(t.text);
      p.drawText(label, Qt::AlignVCenter | Qt::AlignRight, value_of(band, *cursor_));
    } else if (!band.note.isEmpty()) {
      p.setPen(t.warn);
      const int name = QFontMetrics(t.small).horizontalAdvance(band.label) + t.px(6);
      p.drawText(label.adjusted(name, 0, 0, 0), Qt::AlignVCenter | Qt::AlignLeft, "partly");
    }
    const int pad = t.px(2);
    const QRect area(left, row.top() + pad, length, row.height() - 2 * pad);
    p.setOpacity(is_dimmed_ ? 0.45 : 1);
    if (band.is_signal) paint_signal(p, band, area);
    else paint_spans(p, b, area);
  }
  p.setOpacity(1);
  if (hasFocus() && current_.span) {
    p.setPen(QPen(t.accent, t.focus_ring));
    p.setBrush(Qt::NoBrush);
    p.drawRect(span_rect(current_.band, *current_.span).adjusted(-1, -1, 0, 0));
  }
}

void BandsView::pick(const Place& place) {
  current_ = place;
  update();
  if (!on_pick || place.band >= bands_.size()) return;
  // The pick may load other bands.
  const Band band = bands_[place.band];
  on_pick(band, place.span ? &band.spans[*place.span] : nullptr);
}

void BandsView::mousePressEvent(QMouseEvent* event) {
  if (event->button() != Qt::LeftButton) return;
  const auto place = place_at(event->pos());
  if (!place) return;
  const bool is_in_time = event->pos().x() >= axis_.left();
  const bool is_empty = !place->span && bands_[place->band].is_known;
  if (is_empty && is_in_time && on_scrub) on_scrub(axis_.time_at(event->pos().x()));
  else pick(*place);
}

void BandsView::wheelEvent(QWheelEvent* event) {
  if (event->position().x() < axis_.left() || axis_.is_empty()) return event->ignore();
  axis_.zoom(std::pow(0.85, event->angleDelta().y() / 120.0), axis_.time_at(event->position().x()));
  event->accept();
}

void BandsView::keyPressEvent(QKeyEvent* event) {
  if (bands_.empty()) return QWidget::keyPressEvent(event);
  const std::size_t spans = bands_[current_.band].spans.size();
  switch (event->key()) {
    case Qt::Key_Up:
      if (current_.band > 0) current_ = {current_.band - 1, {}};
      break;
    case Qt::Key_Down:
      if (current_.band + 1 < bands_.size()) current_ = {current_.band + 1, {}};
      break;
    case Qt::Key_Right:
      if (!current_.span && spans > 0) current_.span = 0;
      else if (current_.span && *current_.span + 1 < spans) ++*current_.span;
      break;
    case Qt::Key_Left:
      if (current_.span && *current_.span > 0) --*current_.span;
      break;
    case Qt::Key_Return:
    case Qt::Key_Enter:
    case Qt::Key_Space: pick(current_); break;
    default: QWidget::keyPressEvent(event); return;
  }
  setAccessibleDescription(sentence_of(current_));
  update();
  event->accept();
}

void BandsView::focusInEvent(QFocusEvent* event) {
  QWidget::focusInEvent(event);
  update();
}

void BandsView::focusOutEvent(QFocusEvent* event) {
  QWidget::focusOutEvent(event);
  update();
}

void BandsView::changeEvent(QEvent* event) {
  if (event->type() == QEvent::StyleChange) updateGeometry();
  QWidget::changeEvent(event);
}

}  // namespace robomosp::viewer
