// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/widgets/elided.h"

#include <QStyleOptionButton>
#include <QStyleOptionComboBox>
#include <QStyleOptionFrame>
#include <QStyleOptionToolButton>
#include <QStylePainter>

namespace robomosp::viewer {

void ElidedButton::paintEvent(QPaintEvent*) {
  QStylePainter p(this);
  QStyleOptionButton option;
  initStyleOption(&option);
  int room = style()->subElementRect(QStyle::SE_PushButtonContents, &option, this).width();
  constexpr int kIconGap = 4;  // of Qt's styles [px]
  if (!option.icon.isNull()) room -= option.iconSize.width() + kIconGap;
  option.text = option.fontMetrics.elidedText(option.text, Qt::ElideRight, room);
  p.drawControl(QStyle::CE_PushButton, option);
}

QSize ElidedToolButton::minimumSizeHint() const {
  return {3 * iconSize().width(), QToolButton::minimumSizeHint().height()};
}

void ElidedToolButton::paintEvent(QPaintEvent*) {
  QStylePainter p(this);
  QStyleOptionToolButton option;
  initStyleOption(&option);
  const int missing = sizeHint().width() - width();
  if (missing > 0) {
    const int whole = option.fontMetrics.horizontalAdvance(option.text);
    option.text = option.fontMetrics.elidedText(option.text, Qt::ElideRight, whole - missing);
  }
  p.drawComplexControl(QStyle::CC_ToolButton, option);
}

void ElidedLine::paintEvent(QPaintEvent* event) {
  QStyleOptionFrame option;
  initStyleOption(&option);
  constexpr int kTextInset = 2;  // of QLineEdit [px]
  const QRect room = style()
                         ->subElementRect(QStyle::SE_LineEditContents, &option, this)
                         .marginsRemoved(textMargins())
                         .adjusted(kTextInset, 0, -kTextInset, 0);
  const bool is_whole = fontMetrics().horizontalAdvance(text()) <= room.width();
  if (hasFocus() || is_whole || echoMode() != QLineEdit::Normal)
    return QLineEdit::paintEvent(event);
  QStylePainter p(this);
  p.drawPrimitive(QStyle::PE_PanelLineEdit, option);
  p.setPen(palette().color(isEnabled() ? QPalette::Active : QPalette::Disabled, QPalette::Text));
  p.drawText(room, Qt::AlignVCenter | Qt::AlignLeft | Qt::TextSingleLine,
             fontMetrics().elidedText(text(), Qt::ElideRight, room.width()));
}

void ElidedCombo::paintEvent(QPaintEvent*) {
  QStylePainter p(this);
  QStyleOptionComboBox option;
  initStyleOption(&option);
  int room = style()
                 ->subControlRect(QStyle::CC_ComboBox, &option, QStyle::SC_ComboBoxEditField, this)
                 .width();
  constexpr int kIconGap = 8;  // around the icon, in Qt's styles [px]
  if (!option.currentIcon.isNull()) room -= option.iconSize.width() + kIconGap;
  option.currentText = option.fontMetrics.elidedText(option.currentText, Qt::ElideRight, room);
  p.drawComplexControl(QStyle::CC_ComboBox, option);
  p.drawControl(QStyle::CE_ComboBoxLabel, option);
}

}  // namespace robomosp::viewer
