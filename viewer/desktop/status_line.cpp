// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/desktop/status_line.h"

#include <algorithm>

#include <QHelpEvent>
#include <QPainter>
#include <QStyle>
#include <QStyleOption>
#include <QToolTip>

#include "viewer/theme/theme.h"

namespace robomosp::viewer {
namespace {

constexpr double kLeastLabel = 28;  ///< [px of the design]: a letter and the ellipsis

}  // namespace

QSize ShortLabel::minimumSizeHint() const {
  const int least = text().isEmpty() ? 0 : theme().px(kLeastLabel);
  return {std::min(least, sizeHint().width()), QLabel::minimumSizeHint().height()};
}

bool ShortLabel::is_shortened() const {
  return fontMetrics().horizontalAdvance(text()) > contentsRect().width();
}

void ShortLabel::paintEvent(QPaintEvent*) {
  QPainter p(this);
  p.setFont(font());
  p.setPen(theme().text_dim);
  p.drawText(contentsRect(), Qt::AlignVCenter | Qt::AlignLeft | Qt::TextSingleLine,
             fontMetrics().elidedText(text(), Qt::ElideRight, contentsRect().width()));
}

bool ShortLabel::event(QEvent* event) {
  if (event->type() != QEvent::ToolTip || !is_shortened()) return QLabel::event(event);
  const auto* help = static_cast<QHelpEvent*>(event);
  QToolTip::showText(help->globalPos(), text() + "\n" + toolTip(), this);
  return true;
}

StatusLine::StatusLine(QWidget* parent) : QStatusBar(parent) {
  connect(this, &QStatusBar::messageChanged, this, [this](const QString& text) {
    setToolTip(text);
    update();
  });
}

void StatusLine::add_end(QWidget* widget) {
  ends_ += widget;
  addPermanentWidget(widget);
}

QRect StatusLine::message_place() const {
  int right = width();
  for (const QWidget* each : ends_)
    if (each->isVisible()) right = std::min(right, each->x());
  const int gap = theme().gap;
  return {gap, 0, std::max(0, right - 2 * gap), height()};
}

QString StatusLine::message_shown() const {
  return fontMetrics().elidedText(currentMessage(), Qt::ElideRight, message_place().width());
}

void StatusLine::showEvent(QShowEvent* event) {
  QStatusBar::showEvent(event);
  hideOrShow();  // a message that came before hid nothing
}

void StatusLine::paintEvent(QPaintEvent*) {
  QPainter p(this);
  QStyleOption option;
  option.initFrom(this);
  style()->drawPrimitive(QStyle::PE_PanelStatusBar, &option, &p, this);
  if (currentMessage().isEmpty()) return;
  p.setPen(theme().text);
  p.drawText(message_place(), Qt::AlignVCenter | Qt::AlignLeft | Qt::TextSingleLine,
             message_shown());
}

}  // namespace robomosp::viewer
