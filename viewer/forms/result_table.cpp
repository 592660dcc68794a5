// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/forms/result_table.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <QItemSelection>

#include "kernel/literal.h"
#include "kernel/text.h"
#include "viewer/theme/theme.h"
#include "viewer/widgets/field.h"
#include "viewer/widgets/number_fields.h"

namespace robomosp::viewer {
namespace {

constexpr std::size_t kMostCopied = 2'000'000;  // cells

QString cell_text(const Value& v) {
  if (v.is_nil()) return {};
  if (v.is_number()) return number_text(v.number());
  if (v.as_string()) return qt(*v.as_string());
  constexpr std::size_t kMost = 120;
  const std::string s = beginning_of_literal(v, kMost);
  return qt(s.size() > kMost ? s.substr(0, kMost) + "…" : s);
}

bool is_plain(const Value& v) { return !v.as_list() && !v.as_map() && !v.as_array(); }

}  // namespace

std::size_t ResultTable::row_count() const {
  return numbers.size() > 0 ? numbers.rows() : rows.size();
}

double ResultTable::number(std::size_t row, std::size_t column) const {
  if (numbers.size() > 0) {
    const std::size_t cols = numbers.is_matrix() ? numbers.cols() : 1;
    return row < numbers.rows() && column < cols ? numbers[row * cols + column] : 0;
  }
  return row < rows.size() && column < rows[row].size() ? rows[row][column].number() : 0;
}

Value ResultTable::cell(std::size_t row, std::size_t column) const {
  if (numbers.size() > 0)
    return row < numbers.rows() && column < columns.size() ? Value(number(row, column)) : Value();
  return row < rows.size() && column < rows[row].size() ? rows[row][column] : Value();
}

bool ResultTable::rises() const {
  const std::size_t count = row_count();
  for (std::size_t r = 1; r < count; ++r)
    if (!(number(r, 0) > number(r - 1, 0))) return false;
  return count > 2;
}

ResultTable table_of(const Value& v) {
  ResultTable t;
  if (const NumericArray* a = v.as_array()) {
    const std::size_t cols = a->is_matrix() ? a->cols() : 1;
    for (std::size_t c = 0; c < cols; ++c) {
      t.columns.push_back(a->is_matrix() ? std::to_string(c + 1) : "value");
      t.units.push_back(a->unit());
    }
    t.numbers = *a;
    return t;
  }
  if (const List* list = v.as_list()) {
    if (list->empty()) return t;
    const bool are_maps = std::all_of(list->begin(), list->end(),
                                      [](const Value& e) { return e.as_map() != nullptr; });
    if (are_maps) {
      for (const Value& each : *list)
        for (const auto& [name, value] : *each.as_map())
          if (std::find(t.columns.begin(), t.columns.end(), name) == t.columns.end())
            t.columns.push_back(name);
      for (const Value& each : *list) {
        t.rows.emplace_back();
        for (const std::string& name : t.columns) {
          const Value* cell = each.as_map()->find(name);
          t.rows.back().push_back(cell ? *cell : Value());
        }
      }
      return t;
    }
    const bool are_rows = std::all_of(list->begin(), list->end(),
                                      [](const Value& e) { return e.as_list() || e.as_array(); });
    if (are_rows) {
      std::size_t cols = 0;
      for (const Value& each : *list) {
        t.rows.push_back(elements_of(each));
        cols = std::max(cols, t.rows.back().size());
      }
      for (auto& row : t.rows) row.resize(cols);
      for (std::size_t c = 0; c < cols; ++c) t.columns.push_back(std::to_string(c + 1));
      return t;
    }
    t.columns = {"value"};
    for (const Value& each : *list) t.rows.push_back({each});
    return t;
  }
  if (const Map* m = v.as_map()) {
    if (m->empty()) return t;
    // Columns of equal length.
    std::size_t length = 0;
    bool are_columns = m->size() > 1;
    for (const auto& [name, value] : *m) {
      const auto parts = elements_of(value);
      if (parts.size() < 2 || (length != 0 && parts.size() != length) ||
          !std::all_of(parts.begin(), parts.end(), is_plain))
        are_columns = false;
      else length = parts.size();
    }
    if (are_columns) {
      t.rows.resize(length);
      for (const auto& [name, value] : *m) {
        t.columns.push_back(name);
        t.units.push_back(value.as_array() ? value.as_array()->unit() : "");
        const auto parts = elements_of(value);
        for (std::size_t r = 0; r < length; ++r) t.rows[r].push_back(parts[r]);
      }
      t.is_curve = std::all_of(t.rows.begin(), t.rows.end(),
                               [](const auto& row) {
                                 return std::all_of(row.begin(), row.end(),
                                                    [](const Value& e) { return e.is_number(); });
                               }) &&
                   t.rises();
      return t;
    }
    t.columns = {"field", "value"};
    for (const auto& [name, value] : *m) t.rows.push_back({Value(name), value});
  }
  return t;
}

// ---- ResultModel ----

ResultModel::ResultModel(ResultTable table, QObject* parent)
    : QAbstractTableModel(parent), table_(std::move(table)) {}

int ResultModel::rowCount(const QModelIndex& parent) const {
  return parent.isValid() ? 0 : static_cast<int>(table_.row_count());
}

int ResultModel::columnCount(const QModelIndex& parent) const {
  return parent.isValid() ? 0 : static_cast<int>(table_.columns.size());
}

std::size_t ResultModel::row_at(int shown) const {
  const auto at = static_cast<std::size_t>(shown);
  return at < order_.size() ? order_[at] : at;
}

QVariant ResultModel::data(const QModelIndex& index, int role) const {
  if (role != Qt::DisplayRole && role != Qt::ToolTipRole && role != Qt::TextAlignmentRole &&
      role != Qt::FontRole)
    return {};
  const Value v = table_.cell(row_at(index.row()), static_cast<std::size_t>(index.column()));
  if (role == Qt::DisplayRole || role == Qt::ToolTipRole) return cell_text(v);
  if (!v.is_number()) return {};
  if (role == Qt::TextAlignmentRole) return QVariant::fromValue(Qt::AlignRight | Qt::AlignVCenter);
  return theme().mono;
}

QString ResultModel::heading(std::size_t c) const {
  QString s = qt(table_.columns[c]);
  if (c < table_.units.size() && !table_.units[c].empty())
    s += " [" + unit_text(table_.units[c]) + "]";
  return s;
}

QVariant ResultModel::headerData(int section, Qt::Orientation orientation, int role) const {
  if (role != Qt::DisplayRole) return {};
  if (orientation == Qt::Vertical) return static_cast<int>(row_at(section)) + 1;
  return heading(static_cast<std::size_t>(section));
}

void ResultModel::sort(int column, Qt::SortOrder order) {
  Q_EMIT layoutAboutToBeChanged();
  const std::size_t count = table_.row_count();
  order_.clear();
  if (column >= 0 && column < columnCount()) {
    const auto c = static_cast<std::size_t>(column);
    struct Key {
      int kind;  ///< 0 = number, 1 = text, 2 = not a number or empty
      double number;
      QString text;
    };
    std::vector<Key> keys;
    keys.reserve(count);
    for (std::size_t r = 0; r < count; ++r) {
      const Value v = table_.cell(r, c);
      if (v.is_number()) keys.push_back({std::isnan(v.number()) ? 2 : 0, v.number(), {}});
      else keys.push_back({v.is_nil() ? 2 : 1, 0, cell_text(v)});
    }
    order_.resize(count);
    std::iota(order_.begin(), order_.end(), 0U);
    const bool is_up = order == Qt::AscendingOrder;
    std::stable_sort(order_.begin(), order_.end(), [&](std::uint32_t a, std::uint32_t b) {
      const Key &x = keys[a], &y = keys[b];
      if (x.kind != y.kind) return x.kind < y.kind;
      if (x.kind == 0) return is_up ? x.number < y.number : y.number < x.number;
      if (x.kind == 1) return is_up ? x.text < y.text : y.text < x.text;
      return false;
    });
  }
  Q_EMIT layoutChanged();
}

QString ResultModel::text_of(const QItemSelection& selection) const {
  int top = rowCount(), bottom = -1, left = columnCount(), right = -1;
  for (const QItemSelectionRange& range : selection) {
    top = std::min(top, range.top());
    bottom = std::max(bottom, range.bottom());
    left = std::min(left, range.left());
    right = std::max(right, range.right());
  }
  if (bottom < top || right < left) return {};
  QString out;
  const auto line_of = [&](const auto& cell) {
    for (int c = left; c <= right; ++c) {
      if (c > left) out += '\t';
      out += cell(c);
    }
    out += '\n';
  };
  if (bottom > top) line_of([&](int c) { return heading(static_cast<std::size_t>(c)); });
  std::size_t cells = 0;
  for (int r = top; r <= bottom && cells < kMostCopied; ++r) {
    line_of([&](int c) {
      ++cells;
      if (!selection.contains(index(r, c))) return QString();
      const Value v = table_.cell(row_at(r), static_cast<std::size_t>(c));
      return v.is_number() ? qt(text::print(v.number())) : cell_text(v).replace('\t', ' ');
    });
  }
  if (bottom == top) out.chop(1);
  return out;
}

}  // namespace robomosp::viewer
