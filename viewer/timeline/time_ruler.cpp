// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/timeline/time_ruler.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <QKeyEvent>
#include <QMouseEvent>
#include <QPainter>
#include <QWheelEvent>

#include "viewer/plots/plot_lanes.h"
#include "viewer/theme/theme.h"

namespace robomosp::viewer {
namespace {

constexpr double kRulerHeight = 24;  ///< [px of the design]
constexpr double kDotSize = 3;       ///< half of it [px of the design]

}  // namespace

TimeRuler::TimeRuler(TimeAxis& axis, QWidget* parent) : QWidget(parent), axis_(axis) {
  setObjectName("time_ruler");
  setAccessibleName("Time");
  setToolTip(
      "Drag to move the time; Left and Right step, Home and End jump; the wheel zooms,\n"
      "a double click shows all");
  setFocusPolicy(Qt::StrongFocus);
  axis_.changed.add(this, [this] { update(); });
}

void TimeRuler::set_player(Player* player) {
  player_ = player;
  update();
}

QSize TimeRuler::sizeHint() const { return {theme().px(300), theme().px(kRulerHeight)}; }

void TimeRuler::paintEvent(QPaintEvent*) {
  const Theme& t = theme();
  QPainter p(this);
  p.fillRect(rect(), t.panel);
  p.setPen(t.line);
  p.drawLine(0, height() - 1, width(), height() - 1);
  if (!player_ || !player_->has_motion()) {
    p.setFont(t.ui);
    p.setPen(t.text_quiet);
    p.drawText(rect().adjusted(t.gap, 0, 0, 0), Qt::AlignVCenter,
               "No motion. Open a world with a trajectory, or double-click a recording.");
    paint_focus(p);
    return;
  }
  // The flag of the present time; numbers that it would cover are left out.
  const double now = player_->time();
  const QString flag = fixed_number(now, 3);
  QRect box;
  if (now >= axis_.low() && now <= axis_.high()) {
    const int flag_width = QFontMetrics(t.mono).horizontalAdvance(flag) + t.gap;
    const int flag_left = std::clamp(static_cast<int>(axis_.x_of(now)) - flag_width / 2, 0,
                                     std::max(0, width() - flag_width));
    box = QRect(flag_left, t.px(2), flag_width, height() - t.px(5));
  }
  if (axis_.high() > axis_.low()) {
    QFont mono = t.mono;
    mono.setPixelSize(std::max(1, t.px(10.5)));
    p.setFont(mono);
    const double step = axis_.tick(t.px(64));
    const int decimals = std::clamp(static_cast<int>(-std::floor(std::log10(step) + 1e-9)), 0, 9);
    const auto first = static_cast<long long>(std::ceil(axis_.low() / step - 1e-9));
    for (long long k = first;; ++k) {
      const double at = static_cast<double>(k) * step;
      if (at > axis_.high() + 1e-9 * step || k - first > 400) break;
      const int x = static_cast<int>(std::lround(axis_.x_of(at)));
      p.setPen(t.line);
      p.drawLine(x, height() - t.px(6), x, height());
      const QString number = fixed_number(at, std::max(1, decimals));
      const int half = p.fontMetrics().horizontalAdvance(number) / 2 + t.px(3);
      if (x + half > box.left() && x - half < box.right()) continue;
      p.setPen(t.text_quiet);
      p.drawText(QRect(x - t.px(40), 0, t.px(80), height() - t.px(5)), Qt::AlignCenter, number);
    }
  }
  if (!box.isNull()) {
    p.setFont(t.mono);
    p.setRenderHint(QPainter::Antialiasing);
    p.setPen(Qt::NoPen);
    p.setBrush(t.accent_fill);
    p.drawRoundedRect(box, t.radius, t.radius);
    p.setPen(t.on_accent);
    p.drawText(box, Qt::AlignCenter, flag);
    p.setRenderHint(QPainter::Antialiasing, false);
  }
  paint_focus(p);
}

void TimeRuler::paint_focus(QPainter& p) const {
  if (!hasFocus()) return;
  const Theme& t = theme();
  const double inset = t.focus_ring / 2.0;
  p.setPen(QPen(t.accent, t.focus_ring));
  p.setBrush(Qt::NoBrush);
  p.drawRect(QRectF(rect()).adjusted(inset, inset, -inset, -inset));
}

void TimeRuler::scrub(double x) {
  if (!player_ || axis_.is_empty()) return;
  player_->play(false);
  player_->set_time(time_at(x));
}

void TimeRuler::mousePressEvent(QMouseEvent* event) {
  if (event->button() == Qt::LeftButton) scrub(event->position().x());
}

void TimeRuler::mouseMoveEvent(QMouseEvent* event) {
  if (event->buttons().testFlag(Qt::LeftButton)) scrub(event->position().x());
}

void TimeRuler::mouseDoubleClickEvent(QMouseEvent*) { axis_.fit(); }

void TimeRuler::wheelEvent(QWheelEvent* event) {
  if (axis_.is_empty()) return event->ignore();
  axis_.zoom(std::pow(0.85, event->angleDelta().y() / 120.0), axis_.time_at(event->position().x()));
  event->accept();
}

void TimeRuler::keyPressEvent(QKeyEvent* event) {
  if (!player_ || !player_->has_motion()) return QWidget::keyPressEvent(event);
  switch (event->key()) {
    case Qt::Key_Left: player_->step(-1); break;
    case Qt::Key_Right: player_->step(1); break;
    case Qt::Key_Home: player_->set_time(player_->from()); break;
    case Qt::Key_End: player_->set_time(player_->to()); break;
    case Qt::Key_Plus: axis_.zoom(0.8, player_->time()); break;
    case Qt::Key_Minus: axis_.zoom(1.25, player_->time()); break;
    default: QWidget::keyPressEvent(event); return;
  }
  event->accept();
}

TimeCursor::TimeCursor(TimeAxis& axis, QWidget* over) : QWidget(over), axis_(axis) {
  setObjectName("time_cursor");
  setAccessibleName("Present time");
  setToolTip("The present time");
  setAttribute(Qt::WA_TransparentForMouseEvents);
  setAttribute(Qt::WA_NoSystemBackground);
  axis_.changed.add(this, [this] { update(); });
}

void TimeCursor::show_at(std::optional<double> time, std::vector<Dot> dots) {
  const auto redraw = [this] {
    if (!time_) return;
    const int x = static_cast<int>(axis_.x_of(*time_)), r = theme().px(kDotSize) + 2;
    update(QRect(x - r, 0, 2 * r + 1, height()));
  };
  redraw();
  time_ = time;
  dots_ = std::move(dots);
  redraw();
}

void TimeCursor::paintEvent(QPaintEvent*) {
  if (!time_ || *time_ < axis_.low() || *time_ > axis_.high()) return;
  const Theme& t = theme();
  QPainter p(this);
  const double x = std::round(axis_.x_of(*time_)) + 0.5;
  p.setPen(QPen(t.accent, 1));
  p.drawLine(QPointF(x, 0), QPointF(x, height()));
  p.setRenderHint(QPainter::Antialiasing);
  for (const Dot& dot : dots_) {
    p.setPen(QPen(t.panel, 1));
    p.setBrush(dot.colour);
    p.drawEllipse(dot.at, t.px(kDotSize), t.px(kDotSize));
  }
}

}  // namespace robomosp::viewer
