// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/widgets/gauge.h"

#include <algorithm>
#include <cmath>

#include <QKeyEvent>
#include <QMouseEvent>
#include <QToolButton>

#include "viewer/theme/icons.h"
#include "viewer/theme/theme.h"

namespace robomosp::viewer {

Gauge::Gauge(QWidget* parent) : QWidget(parent) {
  setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Fixed);
}

void Gauge::set_share(double share) {
  share_ = std::isfinite(share) ? std::max(0.0, share) : 0;
  setAccessibleDescription(QString("%1 %").arg(std::lround(share_ * 100)));
  update();
}

void Gauge::set_text(const QString& text) {
  text_ = text;
  update();
}

void Gauge::set_label(const QString& label) {
  label_ = label;
  update();
}

QSize Gauge::sizeHint() const { return {theme().px(160), theme().field_height}; }

void Gauge::paintEvent(QPaintEvent*) {
  const Theme& t = theme();
  QPainter p(this);
  p.setRenderHint(QPainter::Antialiasing);
  const int number_width = t.px(38);
  int left = 0;
  if (!label_.isEmpty()) {
    p.setFont(t.ui);
    p.setPen(t.text_dim);
    left = std::min(t.label_width, width() / 3);
    paint_text(p, QRect(0, 0, left, height()), Qt::AlignVCenter | Qt::AlignLeft, label_);
  }
  const int bar_width = label_.isEmpty() ? std::max(t.px(24), width() * 3 / 10) : t.px(46);
  const QRect bar(left, height() / 2 - t.px(2), bar_width, t.px(4));
  p.setPen(Qt::NoPen);
  p.setBrush(t.line);
  p.drawRoundedRect(bar, 2, 2);
  p.setBrush(share_ >= 1 ? t.fault : share_ >= warn_ ? t.warn_fill : t.ok_fill);
  p.drawRoundedRect(
      QRectF(bar.left(), bar.top(), bar.width() * std::min(1.0, share_), bar.height()), 2, 2);
  p.setFont(t.mono);
  p.setPen(isEnabled() ? t.text : t.disabled);
  const QRect number(bar.right() + t.px(6), 0, number_width, height());
  p.drawText(number, Qt::AlignVCenter | Qt::AlignRight,
             QString("%1 %").arg(std::lround(share_ * 100)));
  p.setFont(t.ui);
  p.setPen(t.text_dim);
  paint_text(p, QRect(number.right() + t.px(8), 0, width() - number.right() - t.px(8), height()),
             Qt::AlignVCenter | Qt::AlignLeft, text_);
}

JointRow::JointRow(int number, const QString& name, NumberFormat format, QWidget* parent)
    : Field(parent), number_(number), name_(name), format_(std::move(format)) {
  setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Fixed);
  const bool is_angle = format_.unit == "rad";
  step_ = is_angle ? std::acos(-1.0) / 180 : 0.001;
  if (format_.step == 0) format_.step = step_;
  NumberFormat plain = format_;
  field_ = new NumberField(plain, this);
  field_->set_may_be_empty(false);
  field_->set_fill_range(0, 0);
  field_->on_change = [this](Stage stage) {
    update();
    notify(stage);
  };
  const auto button = [this](const char* symbol, int by) {
    auto* b = new QToolButton(this);
    b->setIcon(icon(symbol));
    b->setAutoRepeat(true);
    b->setFocusPolicy(Qt::NoFocus);
    QObject::connect(b, &QToolButton::clicked, this, [this, by] { step(by); });
    return b;
  };
  less_ = button("minus", -1);
  more_ = button("plus", 1);
  QObject::connect(this, &QObject::objectNameChanged, this, [this](const QString& object) {
    field_->describe(accessibleName(), {}, toolTip(), object + ".value");
    less_->setObjectName(object + ".less");
    less_->setAccessibleName(name_ + " less");
    less_->setToolTip("Step back");
    more_->setObjectName(object + ".more");
    more_->setAccessibleName(name_ + " more");
    more_->setToolTip("Step forward");
  });
}

std::optional<Value> JointRow::value() const { return field_->value(); }

void JointRow::set_value(const std::optional<Value>& value) {
  field_->set_value(value);
  update();
}

void JointRow::set_effort(std::optional<double> effort, std::optional<double> limit) {
  effort_ = effort;
  effort_limit_ = limit;
  arrange();
  update();
}

bool JointRow::is_near_limit() const {
  constexpr double kNear = 0.05;
  const auto now = field_->number();
  if (!now || !std::isfinite(format_.min) || !std::isfinite(format_.max)) return false;
  const double range = format_.max - format_.min;
  return *now - format_.min < kNear * range || format_.max - *now < kNear * range;
}

QSize JointRow::sizeHint() const {
  const Theme& t = theme();
  return {t.px(300), is_stacked_ ? t.property_row + t.px(16) : t.property_row};
}
QSize JointRow::minimumSizeHint() const { return {theme().px(180), sizeHint().height()}; }

void JointRow::take_theme() { arrange(); }

QRect JointRow::bar_line() const {
  const int high = theme().property_row;
  return is_stacked_ ? QRect(0, height() - high, width(), high) : rect();
}

QRect JointRow::bar() const {
  const Theme& t = theme();
  const int left = less_->geometry().right() + t.px(4);
  const QRect line = bar_line();
  return {left, line.top() + (line.height() - t.field_height) / 2, field_->geometry().left() - left,
          t.field_height};
}

void JointRow::resizeEvent(QResizeEvent* event) {
  arrange();
  Field::resizeEvent(event);
}

void JointRow::arrange() {
  const Theme& t = theme();
  constexpr int kLeastOfOneLine = 400;  // of the design [px]
  if (const bool is_stacked = width() < t.px(kLeastOfOneLine); is_stacked != is_stacked_) {
    is_stacked_ = is_stacked;
    updateGeometry();
  }
  const int effort_width = effort_ ? t.px(52) : 0, side = t.px(20), field_width = t.px(70);
  const QRect line = bar_line();
  const int top = line.top() + (line.height() - t.field_height) / 2;
  const int button_top = line.top() + (line.height() - side) / 2;
  // The torque is beside the name where that has its own line.
  const int end = is_stacked_ ? width() : width() - effort_width;
  more_->setGeometry(end - side, button_top, side, side);
  field_->setGeometry(more_->geometry().left() - field_width - t.px(2), top, field_width,
                      t.field_height);
  const int bar_width =
      is_stacked_
          ? std::max(t.px(40), field_->geometry().left() - side - t.px(18))
          : std::clamp(width() - t.px(118) - effort_width - field_width - 2 * side - t.px(8),
                       t.px(40), t.px(160));
  less_->setGeometry(field_->geometry().left() - bar_width - side - t.px(4), button_top, side,
                     side);
}

void JointRow::paintEvent(QPaintEvent*) {
  const Theme& t = theme();
  QPainter p(this);
  p.setFont(t.mono);
  p.setPen(t.text_quiet);
  const int name_height = is_stacked_ ? height() - bar_line().height() + t.px(4) : height();
  p.drawText(QRect(0, 0, t.px(14), name_height), Qt::AlignVCenter, QString::number(number_));
  p.setFont(t.ui);
  p.setPen(isEnabled() ? t.text : t.disabled);
  const int name_end = is_stacked_ ? width() - (effort_ ? t.px(56) : 0) : less_->geometry().left();
  paint_text(p, QRect(t.px(16), 0, name_end - t.px(18), name_height),
             Qt::AlignVCenter | Qt::AlignLeft, name_);
  const QRect b = bar();
  paint_field(p, b, {is_hovered(), false, !fault().isEmpty(), isEnabled(), is_dragged_});
  const QRect inner = b.adjusted(2, 2, -2, -2);
  const auto now = field_->number();
  const double low = std::isfinite(format_.min) ? format_.min : -std::acos(-1.0);
  const double high = std::isfinite(format_.max) ? format_.max : std::acos(-1.0);
  const auto at = [&](double si) {
    return inner.left() + std::clamp((si - low) / (high - low), 0.0, 1.0) * inner.width();
  };
  if (now && high > low) {
    const double zero = at(std::clamp(0.0, low, high)), here = at(*now);
    p.fillRect(QRectF(std::min(zero, here), inner.top(), std::fabs(here - zero), inner.height()),
               t.selection);
    p.fillRect(QRectF(here - 1, inner.top(), 2, inner.height()),
               is_near_limit() ? t.warn_fill : t.accent);
  }
  if (effort_) {
    const double share =
        effort_limit_ && *effort_limit_ > 0 ? std::fabs(*effort_) / *effort_limit_ : 0;
    if (share > 0)
      p.fillRect(QRectF(inner.left(), inner.bottom() - t.px(2),
                        inner.width() * std::min(1.0, share), t.px(3)),
                 share >= 1    ? t.fault
                 : share > 0.8 ? t.warn_fill
                               : t.ok_fill);
    p.setFont(t.mono);
    p.setPen(share >= 1 ? t.fault : share > 0.8 ? t.warn : t.text_dim);
    p.drawText(is_stacked_ ? QRect(name_end, 0, width() - name_end, name_height)
                           : QRect(more_->geometry().right(), 0,
                                   width() - more_->geometry().right(), height()),
               Qt::AlignVCenter | Qt::AlignRight, number_text(std::round(*effort_ * 100) / 100));
  }
}

void JointRow::step(int by) {
  const double now = field_->number().value_or(0);
  field_->set_value(Value(std::clamp(now + by * step_, format_.min, format_.max)));
  update();
  notify(Stage::changed);
}

void JointRow::keyPressEvent(QKeyEvent* event) {
  if (event->key() == Qt::Key_Plus) return step(1);
  if (event->key() == Qt::Key_Minus) return step(-1);
  Field::keyPressEvent(event);
}

void JointRow::drag_to(int x, Stage stage) {
  const QRect inner = bar().adjusted(2, 2, -2, -2);
  const double low = std::isfinite(format_.min) ? format_.min : -std::acos(-1.0);
  const double high = std::isfinite(format_.max) ? format_.max : std::acos(-1.0);
  const double share =
      std::clamp(static_cast<double>(x - inner.left()) / std::max(1, inner.width()), 0.0, 1.0);
  field_->set_value(Value(low + share * (high - low)));
  update();
  notify(stage);
}

void JointRow::mousePressEvent(QMouseEvent* event) {
  if (event->button() != Qt::LeftButton || !bar().contains(event->pos())) return;
  is_dragged_ = true;
  notify(Stage::drag_begun);
  drag_to(event->pos().x(), Stage::dragged);
}

void JointRow::mouseMoveEvent(QMouseEvent* event) {
  if (is_dragged_) drag_to(event->pos().x(), Stage::dragged);
}

void JointRow::mouseReleaseEvent(QMouseEvent*) {
  if (!is_dragged_) return;
  is_dragged_ = false;
  update();
  notify(Stage::drag_ended);
}

}  // namespace robomosp::viewer
