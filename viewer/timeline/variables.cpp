// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/timeline/variables.h"

#include <algorithm>
#include <map>
#include <utility>

#include <QEvent>
#include <QHBoxLayout>
#include <QKeyEvent>
#include <QLabel>
#include <QLineEdit>
#include <QListWidget>
#include <QPushButton>
#include <QVBoxLayout>

#include "viewer/desktop/values.h"
#include "viewer/theme/theme.h"
#include "viewer/widgets/field.h"

namespace robomosp::viewer {
namespace {

constexpr int kColumns = Qt::UserRole;

/// Names a widget for people, assistive technology and tests.
template <class W>
W* described(W* widget, const char* object_name, const QString& name, const QString& tip) {
  widget->setObjectName(object_name);
  widget->setAccessibleName(name);
  widget->setToolTip(tip);
  return widget;
}

}  // namespace

std::string stem_of(const std::string& column) {
  const std::size_t end = column.find_last_not_of("0123456789");
  return end == std::string::npos || end + 1 == column.size() ? std::string()
                                                              : column.substr(0, end + 1);
}

VariablePicker::VariablePicker(QWidget* parent) : QFrame(parent, Qt::Popup) {
  described(this, "variable_picker", "Variables", "Columns of the recording, to be plotted");
  setFrameShape(QFrame::StyledPanel);
  setProperty("ground", "panel");
  setAttribute(Qt::WA_StyledBackground);
  const Theme& t = theme();
  search_ = described(new QLineEdit, "variable_search", "Search the columns",
                      "Words of the name or description of a column");
  search_->setPlaceholderText("Search, such as torque or qd3");
  search_->installEventFilter(this);
  list_ = described(new QListWidget, "variable_list", "Columns",
                    "Enter: a new lane; Shift+Enter: into the present lane\n"
                    "recording.columns(id)");
  list_->setSelectionMode(QAbstractItemView::ExtendedSelection);
  list_->setUniformItemSizes(true);
  list_->installEventFilter(this);
  add_ = described(new QPushButton("New lane"), "variable_add", "Plot in a new lane",
                   "Plots the chosen columns in a lane of their own (Enter)");
  add_to_lane_ = described(new QPushButton("Into the lane"), "variable_add_to_lane",
                           "Plot in the present lane",
                           "Plots the chosen columns in the present lane (Shift+Enter)");
  expression_ = described(new QLineEdit, "variable_expression", "Expression over columns",
                          "Such as tau1*qd1; becomes a column of the recording\n"
                          "recording.watch{id = ..., name = ..., expression = ...}");
  expression_->setPlaceholderText("Expression, such as tau1*qd1");
  name_ = described(new QLineEdit, "variable_name", "Name of the new column",
                    "Name of the column; made if empty");
  name_->setPlaceholderText("name");
  unit_ = described(new QLineEdit, "variable_unit", "Unit of the new column",
                    "SI unit, which is checked; derived if empty");
  unit_->setPlaceholderText("unit");
  compute_ = described(new QPushButton("Compute"), "variable_compute", "Compute the expression",
                       "Adds the column and plots it\nrecording.watch{...}");
  fault_ = described(new QLabel, "variable_fault", "Fault of the expression",
                     "Why the expression was refused");
  fault_->setWordWrap(true);
  fault_->hide();
  auto* column = new QVBoxLayout(this);
  column->setContentsMargins(t.gap, t.gap, t.gap, t.gap);
  column->setSpacing(t.px(6));
  column->addWidget(search_);
  column->addWidget(list_, 1);
  auto* buttons = new QHBoxLayout;
  buttons->addWidget(add_);
  buttons->addWidget(add_to_lane_);
  buttons->addStretch(1);
  column->addLayout(buttons);
  auto* row = new QHBoxLayout;
  row->addWidget(expression_, 4);
  row->addWidget(name_, 2);
  row->addWidget(unit_, 1);
  row->addWidget(compute_);
  column->addLayout(row);
  column->addWidget(fault_);
  connect(search_, &QLineEdit::textChanged, this, [this] { fill(); });
  connect(list_, &QListWidget::itemDoubleClicked, this, [this] { choose(false); });
  connect(add_, &QPushButton::clicked, this, [this] { choose(false); });
  connect(add_to_lane_, &QPushButton::clicked, this, [this] { choose(true); });
  connect(compute_, &QPushButton::clicked, this, [this] { compute(); });
  for (QLineEdit* field : {expression_, name_, unit_})
    connect(field, &QLineEdit::returnPressed, this, [this] { compute(); });
}

void VariablePicker::open_below(const QWidget& button, const std::vector<ColumnInfo>& columns) {
  columns_ = columns;
  const Theme& t = theme();
  fault_->setStyleSheet(QString("QLabel { color: %1; }").arg(t.fault.name()));
  show_fault({});
  search_->clear();
  fill();
  resize(t.px(420), t.px(360));
  QPoint at = button.mapToGlobal(QPoint(0, button.height()));
  // The timeline is at the lower edge of the screen: the list opens upwards there.
  if (const QWidget* window = button.window()) {
    const int low = window->mapToGlobal(QPoint(0, window->height())).y();
    if (at.y() + height() > low) at.setY(button.mapToGlobal(QPoint(0, 0)).y() - height());
  }
  move(at);
  show();
  search_->setFocus();
}

void VariablePicker::show_fault(const QString& sentence) {
  fault_->setText(sentence);
  fault_->setVisible(!sentence.isEmpty());
}

void VariablePicker::fill() {
  const QStringList words = search_->text().split(' ', Qt::SkipEmptyParts);
  const auto fits = [&](const QString& text) {
    return std::all_of(words.begin(), words.end(), [&](const QString& word) {
      return text.contains(word, Qt::CaseInsensitive);
    });
  };
  list_->clear();
  const auto add = [&](const QString& text, const QStringList& names, const QString& doc) {
    auto* item = new QListWidgetItem(text);
    item->setData(kColumns, names);
    item->setToolTip(doc);
    list_->addItem(item);
  };
  std::map<std::string, QStringList> groups;
  std::vector<std::string> order;
  for (const ColumnInfo& c : columns_)
    if (const std::string stem = stem_of(c.name); !stem.empty()) {
      if (!groups.contains(stem)) order.push_back(stem);
      groups[stem] += shown(c.name);
    }
  const auto info = [&](const QString& name) {
    return std::find_if(columns_.begin(), columns_.end(),
                        [&](const ColumnInfo& c) { return shown(c.name) == name; });
  };
  for (const std::string& stem : order) {
    const QStringList& names = groups[stem];
    if (names.size() < 2) continue;
    const auto first = info(names.front());
    const QString text = shown(stem) + "   " + QString::number(names.size()) + " columns   " +
                         unit_text(first->unit);
    if (fits(text + ' ' + shown(first->doc))) add(text, names, shown(first->doc));
  }
  for (const ColumnInfo& c : columns_) {
    if (c.name == "time") continue;
    const QString doc = shown(c.doc);
    const QString text =
        shown(c.name) + "   " + unit_text(c.unit) + (doc.isEmpty() ? QString() : "   " + doc);
    if (fits(text)) add(text, {shown(c.name)}, doc);
  }
  if (list_->count() > 0) list_->setCurrentRow(0);
}

void VariablePicker::choose(bool into_present_lane) {
  std::vector<std::string> columns;
  for (const QListWidgetItem* item : list_->selectedItems())
    for (const QString& name : item->data(kColumns).toStringList())
      if (std::find(columns.begin(), columns.end(), utf8(name)) == columns.end())
        columns.push_back(utf8(name));
  if (columns.empty()) return;
  close();
  if (on_choose) on_choose(std::move(columns), into_present_lane);
}

void VariablePicker::compute() {
  if (expression_->text().trimmed().isEmpty())
    return show_fault("Write an expression over the columns, such as tau1*qd1.");
  if (on_expression)
    on_expression(expression_->text().trimmed(), name_->text().trimmed(), unit_->text().trimmed());
}

bool VariablePicker::eventFilter(QObject* watched, QEvent* event) {
  if (event->type() == QEvent::KeyPress) {
    auto* key = static_cast<QKeyEvent*>(event);
    if (key->key() == Qt::Key_Return || key->key() == Qt::Key_Enter) {
      choose(key->modifiers().testFlag(Qt::ShiftModifier));
      return true;
    }
    if (watched == search_ && (key->key() == Qt::Key_Down || key->key() == Qt::Key_Up)) {
      const int by = key->key() == Qt::Key_Down ? 1 : -1;
      const int row = std::clamp(list_->currentRow() + by, 0, std::max(0, list_->count() - 1));
      list_->setCurrentRow(row);
      return true;
    }
  }
  return QFrame::eventFilter(watched, event);
}

}  // namespace robomosp::viewer
