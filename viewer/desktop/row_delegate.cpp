// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/desktop/row_delegate.h"

#include <cmath>

#include <QLineEdit>
#include <QPainter>

#include "viewer/desktop/navigator_model.h"
#include "viewer/desktop/values.h"
#include "viewer/theme/icons.h"
#include "viewer/theme/theme.h"

namespace robomosp::viewer {
namespace {

QRect text_place(const QRect& row) {
  const Theme& t = theme();
  return row.adjusted(t.icon + t.gap, 0, -t.gap, 0);
}

}  // namespace

QRect RowDelegate::eye_place(const QRect& row) {
  const Theme& t = theme();
  const int side = t.icon + t.gap;
  return {row.right() - side, row.top(), side, row.height()};
}

void RowDelegate::paint(QPainter* painter, const QStyleOptionViewItem& option,
                        const QModelIndex& index) const {
  const Theme& t = theme();
  painter->save();
  const bool is_selected = option.state.testFlag(QStyle::State_Selected);
  const bool has_focus = option.widget && option.widget->hasFocus();
  if (is_selected) painter->fillRect(option.rect, has_focus ? t.selection : t.selection_idle);
  else if (option.state.testFlag(QStyle::State_MouseOver)) painter->fillRect(option.rect, t.hover);

  const QString fault = index.data(NavigatorModel::kFault).toString();
  const bool is_quiet = index.data(NavigatorModel::kIsQuiet).toBool();
  const double ratio = painter->device()->devicePixelRatioF();
  const auto eye = static_cast<NavigatorModel::Eye>(index.data(NavigatorModel::kEye).toInt());
  const bool is_dim = is_quiet || eye == NavigatorModel::Eye::hidden;
  const QColor ink = !fault.isEmpty() ? t.fault : is_dim ? t.text_dim : t.text;
  const QRect row = option.rect;
  const int middle = row.top() + (row.height() - t.icon) / 2;
  const auto picture = index.data(NavigatorModel::kPicture).value<QPixmap>();
  if (picture.isNull()) {
    const std::string name = utf8(index.data(NavigatorModel::kIcon).toString());
    painter->drawPixmap(row.left(), middle,
                        icon_pixmap(name, !fault.isEmpty() ? t.fault : t.text_dim, t.icon, ratio));
  } else {
    const QSizeF size = picture.deviceIndependentSize();
    painter->drawPixmap(
        QPointF(row.left(), row.top() + std::floor((row.height() - size.height()) / 2)), picture);
  }

  int right = row.right() - t.gap;
  const auto mark = [&](const char* what, const QColor& colour) {
    right -= t.icon;
    painter->drawPixmap(right, middle, icon_pixmap(what, colour, t.icon, ratio));
    right -= t.gap / 2;
  };
  if (eye == NavigatorModel::Eye::hidden) mark("hidden", t.text_dim);
  if (eye == NavigatorModel::Eye::shown) mark("eye", t.text_quiet);
  if (!fault.isEmpty() || index.data(NavigatorModel::kFaultBelow).toBool()) mark("fault", t.fault);
  if (index.data(NavigatorModel::kIsHeavy).toBool()) mark("warning", t.warn);
  if (index.data(NavigatorModel::kIsUnsaved).toBool()) {
    painter->setRenderHint(QPainter::Antialiasing);
    painter->setPen(Qt::NoPen);
    painter->setBrush(t.text_dim);
    const double r = t.px(3.5);
    painter->drawEllipse(QPointF(right - r, row.center().y() + 0.5), r, r);
    right -= static_cast<int>(2 * r) + t.gap / 2;
  }
  QRect place = text_place(row);
  if (!picture.isNull())
    place.setLeft(row.left() +
                  static_cast<int>(std::ceil(picture.deviceIndependentSize().width())) + t.gap);
  const QString detail = index.data(NavigatorModel::kDetail).toString();
  const QString text = index.data(Qt::DisplayRole).toString();
  const QFontMetrics metrics(t.ui);
  if (!detail.isEmpty()) {
    const QFontMetrics small(t.small);
    const int width = small.horizontalAdvance(detail);
    const int free = right - place.left() - metrics.horizontalAdvance(text) - t.gap;
    if (width <= free) {
      painter->setFont(t.small);
      painter->setPen(t.text_dim);
      painter->drawText(QRect(right - width, row.top(), width, row.height()),
                        Qt::AlignVCenter | Qt::AlignLeft, detail);
      right -= width + t.gap;
    }
  }
  place.setRight(right);
  painter->setFont(t.ui);
  painter->setPen(ink);
  painter->drawText(place, Qt::AlignVCenter | Qt::AlignLeft,
                    metrics.elidedText(text, Qt::ElideRight, place.width()));
  painter->restore();
}

QSize RowDelegate::sizeHint(const QStyleOptionViewItem&, const QModelIndex&) const {
  return {theme().px(120), theme().row};
}

QWidget* RowDelegate::createEditor(QWidget* parent, const QStyleOptionViewItem&,
                                   const QModelIndex&) const {
  auto* editor = new QLineEdit(parent);
  editor->setObjectName("navigator_rename");
  editor->setAccessibleName("New name");
  editor->setToolTip("The new name; Enter renames, Escape keeps the old one");
  return editor;
}

void RowDelegate::updateEditorGeometry(QWidget* editor, const QStyleOptionViewItem& option,
                                       const QModelIndex&) const {
  editor->setGeometry(text_place(option.rect).adjusted(-theme().px(6), 1, 0, -1));
}

}  // namespace robomosp::viewer
