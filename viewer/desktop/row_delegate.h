// SPDX-License-Identifier: GPL-3.0-or-later
// RowDelegate: paints rows of the navigator: icon, name, detail at the right, marks for unsaved
// and faulty records, the eye of members (layer: GUI).
#pragma once

#include <QStyledItemDelegate>

namespace robomosp::viewer {

class RowDelegate : public QStyledItemDelegate {
 public:
  using QStyledItemDelegate::QStyledItemDelegate;
  /// Where a row has the eye of a member, if it has one.
  [[nodiscard]] static QRect eye_place(const QRect& row);
  void paint(QPainter* painter, const QStyleOptionViewItem& option,
             const QModelIndex& index) const override;
  [[nodiscard]] QSize sizeHint(const QStyleOptionViewItem& option,
                               const QModelIndex& index) const override;
  QWidget* createEditor(QWidget* parent, const QStyleOptionViewItem& option,
                        const QModelIndex& index) const override;
  void updateEditorGeometry(QWidget* editor, const QStyleOptionViewItem& option,
                            const QModelIndex& index) const override;
};

}  // namespace robomosp::viewer
