// SPDX-License-Identifier: GPL-3.0-or-later
// RowFilter: the rows of the navigator's tree that a search keeps (layer: GUI).
#pragma once

#include <QSortFilterProxyModel>
#include <QStringList>
#include <QTimer>

namespace robomosp::viewer {

/// Rows with all words in their names, with the rows above and below them. [GUI thread]
///
/// Rows that change may change what is to be shown above and below them; this follows in the next
/// turn of the event loop. Qt's recursive filter would do so at once, but it loses count of rows
/// that are put below one that it does not show.
class RowFilter : public QSortFilterProxyModel {
 public:
  explicit RowFilter(int kind_role, QObject* parent = nullptr);

  void setSourceModel(QAbstractItemModel* model) override;
  /// "kind:robot" keeps rows with kinds that begin so.
  void set_words(const QStringList& words);
  /// Keeps rows of these kinds; empty = of all.
  void set_kinds(const QStringList& kinds);
  [[nodiscard]] bool is_active() const { return !words_.isEmpty() || !kinds_.isEmpty(); }

 protected:
  [[nodiscard]] bool filterAcceptsRow(int row, const QModelIndex& parent) const override;

 private:
  [[nodiscard]] bool matches(const QModelIndex& at) const;
  [[nodiscard]] bool has_match(const QModelIndex& at) const;  ///< it, or one below
  const int kind_role_;
  QStringList words_, kinds_;
  QTimer again_;  ///< rows have changed
};

}  // namespace robomosp::viewer
