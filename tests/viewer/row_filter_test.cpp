// SPDX-License-Identifier: GPL-3.0-or-later
// The rows that a search keeps, while rows come, go and change their names.
#include "viewer/desktop/row_filter.h"

#include <algorithm>
#include <random>

#include <QApplication>
#include <QStandardItemModel>
#include <QTreeView>

#include <gtest/gtest.h>

namespace robomosp::viewer {
namespace {

constexpr int kKind = Qt::UserRole;

/// "(a(b))": a row b below a row a.
QString shown_rows(const QAbstractItemModel& model, const QModelIndex& parent = {}) {
  QString out;
  for (int i = 0; i < model.rowCount(parent); ++i) {
    const QModelIndex row = model.index(i, 0, parent);
    out += '(' + row.data().toString() + shown_rows(model, row) + ')';
  }
  return out;
}

/// The same of the rows that are to be shown, without a filter's model.
QString kept_rows(const QStandardItem& parent, const QStringList& words, bool is_below_match) {
  QString out;
  for (int i = 0; i < parent.rowCount(); ++i) {
    const QStandardItem& row = *parent.child(i);
    const bool matches =
        is_below_match || std::all_of(words.begin(), words.end(), [&](const QString& word) {
          return row.text().contains(word);
        });
    const QString below = kept_rows(row, words, matches);
    if (matches || !below.isEmpty()) out += '(' + row.text() + below + ')';
  }
  return out;
}

TEST(RowFilter, KeepsMatchingRowsWithThoseAboveAndBelowWhateverChanges) {
  for (unsigned seed = 0; seed < 30; ++seed) {
    std::mt19937 random(seed);
    const auto any = [&](int below) {
      return static_cast<int>(random() % static_cast<unsigned>(below));
    };
    const auto letter = [&] { return QString(QChar('a' + any(4))); };
    QStandardItemModel source;
    RowFilter filter(kKind);
    filter.setSourceModel(&source);
    QTreeView tree;
    tree.setModel(&filter);
    QStandardItem& root = *source.invisibleRootItem();
    const auto any_item = [&] {
      QStandardItem* at = &root;
      while (at->rowCount() > 0 && any(3) > 0) at = at->child(any(at->rowCount()));
      return at;
    };
    QStringList words;
    for (int step = 0; step < 200; ++step) {
      QStandardItem* at = any_item();
      switch (any(6)) {
        case 0:
        case 1:
        case 2: at->insertRow(any(at->rowCount() + 1), new QStandardItem(letter())); break;
        case 3:
          if (at != &root) (at->parent() ? at->parent() : &root)->removeRow(at->row());
          break;
        case 4:
          if (at != &root) at->setText(letter());
          break;
        default:
          words = any(2) == 0 ? QStringList() : QStringList{letter()};
          filter.set_words(words);
          break;
      }
      // Several changes may come before the next turn of the loop.
      if (any(3) == 0) continue;
      QApplication::processEvents();
      tree.expandAll();
      ASSERT_EQ(shown_rows(filter).toStdString(), kept_rows(root, words, false).toStdString())
          << "seed " << seed << ", step " << step << ", words " << words.join(' ').toStdString();
    }
  }
}

TEST(RowFilter, KindsAndWordsHoldTogether) {
  QStandardItemModel source;
  RowFilter filter(kKind);
  filter.setSourceModel(&source);
  for (const auto& [name, kind] : {std::pair{"arm", "robot"}, {"arm", "solid"}, {"leg", "robot"}}) {
    auto* row = new QStandardItem(name);
    row->setData(kind, kKind);
    source.appendRow(row);
  }
  filter.set_words({"ARM"});
  EXPECT_EQ(shown_rows(filter), "(arm)(arm)");
  filter.set_words({"arm", "kind:rob"});
  EXPECT_EQ(shown_rows(filter), "(arm)");
  filter.set_words({});
  filter.set_kinds({"robot"});
  EXPECT_EQ(shown_rows(filter), "(arm)(leg)");
  filter.set_kinds({});
  EXPECT_FALSE(filter.is_active());
  EXPECT_EQ(filter.rowCount(), 3);
}

}  // namespace
}  // namespace robomosp::viewer
