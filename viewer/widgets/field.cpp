// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/widgets/field.h"

#include <algorithm>
#include <cmath>

#include <QEvent>
#include <QPushButton>
#include <QStyle>

#include "viewer/theme/theme.h"

namespace robomosp::viewer {

Field::Field(QWidget* parent) : QWidget(parent) { setAttribute(Qt::WA_Hover); }

void Field::set_default(const std::optional<Value>& value) {
  default_ = value;
  update();
}

void Field::set_mixed(bool on) {
  is_mixed_ = on;
  update();
}

void Field::set_fault(const QString& sentence) {
  if (fault_ == sentence) return;
  fault_ = sentence;
  show_tip();
  update();
}

bool Field::place_fault(std::string_view path, const QString& sentence) {
  set_fault(sentence);
  return path.empty();
}

void Field::clear_faults() { set_fault({}); }

std::vector<PartFault> Field::shown_faults() const {
  if (fault_.isEmpty()) return {};
  return {{"", fault_}};
}

void Field::hold_look(bool is_hovered, bool has_focus) {
  holds_hover_ = is_hovered;
  holds_focus_ = has_focus;
  update();
}

void Field::set_source(const QString& note) {
  source_ = note;
  update();
}

void Field::describe(const QString& label, const QString& doc, const QString& command,
                     const QString& object_name) {
  setAccessibleName(label);
  setAccessibleDescription(doc);
  doc_ = doc;
  command_ = command;
  show_tip();
  setObjectName(object_name);  // last: fields with parts name these when it changes
}

void Field::show_tip() {
  QStringList lines;
  if (!fault_.isEmpty()) lines << fault_;
  if (!doc_.isEmpty()) lines << doc_;
  if (!command_.isEmpty()) lines << command_;
  if (lines.isEmpty()) lines << accessibleName();
  setToolTip(lines.join('\n'));
}

void Field::notify(Stage stage) {
  is_mixed_ = false;
  source_.clear();
  if (on_change) on_change(stage);
}

void Field::enterEvent(QEnterEvent* event) {
  is_hovered_ = true;
  update();
  QWidget::enterEvent(event);
}

void Field::leaveEvent(QEvent* event) {
  is_hovered_ = false;
  update();
  QWidget::leaveEvent(event);
}

void Field::focusInEvent(QFocusEvent* event) {
  update();
  QWidget::focusInEvent(event);
}

void Field::focusOutEvent(QFocusEvent* event) {
  update();
  QWidget::focusOutEvent(event);
}

void Field::changeEvent(QEvent* event) {
  if (event->type() == QEvent::StyleChange) {
    take_theme();
    updateGeometry();  // lengths follow the zoom of the interface
  }
  update();
  QWidget::changeEvent(event);
}

void paint_field(QPainter& painter, const QRect& rect, const FieldLook& look) {
  const Theme& t = theme();
  painter.setRenderHint(QPainter::Antialiasing);
  QColor line = t.field_line, ground = t.field;
  double width = 1;
  if (!look.is_enabled) {
    line = t.line;
    ground = t.panel;
  } else if (look.has_fault) {
    line = t.fault;
    ground = t.fault_ground;
    if (look.has_focus) width = t.focus_ring;
  } else if (look.has_focus || look.is_pressed) {
    line = t.accent;
    width = t.focus_ring;
  } else if (look.is_hovered) {
    line = t.text_quiet;
  }
  painter.setPen(QPen(line, width));
  painter.setBrush(ground);
  const double half = width / 2;
  painter.drawRoundedRect(QRectF(rect).adjusted(half, half, -half, -half), t.radius, t.radius);
}

void paint_axis_mark(QPainter& painter, const QRect& field, int axis) {
  if (axis < 0 || axis > 2) return;
  const Theme& t = theme();
  const QRect mark(field.left() + t.px(6), field.top() + t.px(5), t.px(3),
                   field.height() - t.px(10));
  painter.fillRect(mark, t.axes[static_cast<std::size_t>(axis)]);
}

void paint_text(QPainter& painter, const QRect& rect, int flags, const QString& text) {
  if (rect.width() <= 0) return;
  painter.drawText(rect, flags | Qt::TextSingleLine,
                   painter.fontMetrics().elidedText(text, Qt::ElideRight, rect.width()));
}

void style_as_segment(QPushButton* button) {
  const Theme& t = theme();
  button->setCheckable(true);
  button->setStyleSheet(
      QString("QPushButton:checked { background: %1; color: %2; font-weight: 600; }")
          .arg(t.selection.name(), t.text.name()));
}

QString number_text(double value, int decimals) {
  if (std::isnan(value)) return QStringLiteral("not a number");
  if (std::isinf(value)) return value > 0 ? QStringLiteral("∞") : QStringLiteral("\u2212∞");
  QString s;
  if (decimals >= 0) {
    s = QString::number(value, 'f', std::min(decimals, 12));
  } else {
    s = QString::number(value, 'g', 6);
    // Large whole numbers are written out.
    if (s.contains('e') && std::fabs(value) < 1e9 && std::fabs(value) >= 1)
      s = QString::number(value, 'f', 0);
  }
  if (s.toDouble() == 0) s.remove('-');
  return s.replace('-', QChar(0x2212));
}

QString unit_text(std::string_view unit) {
  if (unit == "deg") return QStringLiteral("°");
  QString s = qt(unit);
  s.replace("deg", "°");
  s.replace("^2", "²");
  s.replace("^3", "³");
  s.replace("^4", "⁴");
  s.replace("^5", "⁵");
  return s;
}

}  // namespace robomosp::viewer
