// SPDX-License-Identifier: GPL-3.0-or-later
// ResultTable: a result as rows and columns, and the model that a table view shows (layer: GUI).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <QAbstractTableModel>
#include <QString>

#include "kernel/value.h"

class QItemSelection;

namespace robomosp::viewer {

/// A result as rows and columns: a list of maps, a matrix, a map of columns of equal length, a
/// vector, a map of plain values. Empty columns = it has none of these forms.
struct ResultTable {
  std::vector<std::string> columns, units;
  std::vector<std::vector<Value>> rows;
  NumericArray numbers;   ///< the cells of a matrix or vector, in place of `rows`; shared
  bool is_curve = false;  ///< all columns are numbers with a first one that rises: worth a plot

  [[nodiscard]] std::size_t row_count() const;
  /// Nil outside the table.
  [[nodiscard]] Value cell(std::size_t row, std::size_t column) const;
  [[nodiscard]] double number(std::size_t row, std::size_t column) const;
  /// Whether the first column rises over more than two rows.
  [[nodiscard]] bool rises() const;
};
[[nodiscard]] ResultTable table_of(const Value& result);

/// Sorts an order of the rows, never the rows. [GUI thread]
class ResultModel : public QAbstractTableModel {
 public:
  explicit ResultModel(ResultTable table, QObject* parent);
  int rowCount(const QModelIndex& parent = {}) const override;
  int columnCount(const QModelIndex& parent = {}) const override;
  QVariant data(const QModelIndex& index, int role) const override;
  QVariant headerData(int section, Qt::Orientation orientation, int role) const override;
  /// Numbers by value before texts, empty cells last; column -1 = as they came.
  void sort(int column, Qt::SortOrder order) override;
  /// The selected cells, tabs between columns; with headings if it is more than one row. Numbers
  /// have all their digits and the minus of ASCII.
  [[nodiscard]] QString text_of(const QItemSelection& selection) const;

 private:
  [[nodiscard]] std::size_t row_at(int shown) const;
  [[nodiscard]] QString heading(std::size_t column) const;
  ResultTable table_;
  std::vector<std::uint32_t> order_;  ///< empty = as they came
};

}  // namespace robomosp::viewer
