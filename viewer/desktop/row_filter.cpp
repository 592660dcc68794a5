// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/desktop/row_filter.h"

#include <algorithm>

namespace robomosp::viewer {

RowFilter::RowFilter(int kind_role, QObject* parent)
    : QSortFilterProxyModel(parent), kind_role_(kind_role) {
  again_.setSingleShot(true);
  connect(&again_, &QTimer::timeout, this, [this] { invalidate(); });
}

void RowFilter::setSourceModel(QAbstractItemModel* model) {
  QSortFilterProxyModel::setSourceModel(model);
  const auto later = [this] {
    if (is_active()) again_.start(0);
  };
  connect(model, &QAbstractItemModel::rowsInserted, this, later);
  connect(model, &QAbstractItemModel::rowsRemoved, this, later);
  connect(model, &QAbstractItemModel::dataChanged, this, later);
}

void RowFilter::set_words(const QStringList& words) {
  words_ = words;
  invalidate();
}

void RowFilter::set_kinds(const QStringList& kinds) {
  kinds_ = kinds;
  invalidate();
}

bool RowFilter::filterAcceptsRow(int row, const QModelIndex& parent) const {
  if (!is_active()) return true;
  const QModelIndex index = sourceModel()->index(row, 0, parent);
  for (QModelIndex at = parent; at.isValid(); at = at.parent())
    if (matches(at)) return true;
  return has_match(index);
}

bool RowFilter::has_match(const QModelIndex& at) const {
  if (matches(at)) return true;
  const int count = sourceModel()->rowCount(at);
  for (int i = 0; i < count; ++i)
    if (has_match(sourceModel()->index(i, 0, at))) return true;
  return false;
}

bool RowFilter::matches(const QModelIndex& at) const {
  const QString kind = at.data(kind_role_).toString();
  if (!kinds_.isEmpty() && !kinds_.contains(kind)) return false;
  const QString name = at.data(Qt::DisplayRole).toString();
  return std::all_of(words_.begin(), words_.end(), [&](const QString& word) {
    if (word.startsWith("kind:")) return kind.startsWith(word.mid(5), Qt::CaseInsensitive);
    return name.contains(word, Qt::CaseInsensitive);
  });
}

}  // namespace robomosp::viewer
