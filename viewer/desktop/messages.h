// SPDX-License-Identifier: GPL-3.0-or-later
// Messages: what the program and the window have to say, each linked to its record, with what
// mends it (layer: GUI).
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include <QAbstractListModel>
#include <QDateTime>
#include <QStyledItemDelegate>
#include <QWidget>

#include "kernel/fault.h"
#include "viewer/desktop/desk.h"

class QComboBox;
class QListView;
class QSortFilterProxyModel;

namespace robomosp::viewer {

/// The list. [GUI thread]
class MessageModel : public QAbstractListModel {
 public:
  enum Role {
    kSeverity = Qt::UserRole,  ///< int of Severity
    kTime,                     ///< QString
    kLink,                     ///< QString of the link; empty = none
    kRemedy                    ///< QString, label of the first remedy; empty = none
  };
  using QAbstractListModel::QAbstractListModel;
  void add(Severity severity, const QString& text, std::shared_ptr<const Fault> fault);
  void clear();
  [[nodiscard]] const Fault* fault_at(int row) const;
  [[nodiscard]] int rowCount(const QModelIndex& parent) const override;
  [[nodiscard]] QVariant data(const QModelIndex& index, int role) const override;

 private:
  struct Row {
    Severity severity = Severity::info;
    QDateTime time;
    QString text;
    std::shared_ptr<const Fault> fault;
    int repeated = 1;
  };
  std::vector<Row> rows_;
};

/// [GUI thread]
class MessagesPanel : public QWidget {
 public:
  explicit MessagesPanel(Desk& desk, QWidget* parent = nullptr);
  void clear();
  void add(Severity severity, const QString& text, std::shared_ptr<const Fault> fault = {});
  /// Warnings and errors that came since the panel was seen last.
  [[nodiscard]] int unseen() const { return unseen_; }
  void mark_seen();
  [[nodiscard]] MessageModel& model() const { return *model_; }

  Listeners<> unseen_changed;

 protected:
  void showEvent(QShowEvent* event) override;

 private:
  void follow(const QModelIndex& index, bool mend);
  /// Selects the part of a record that a path of a fault lies in.
  void select_part(const Handle& record, const std::string& path);

  Desk& desk_;
  MessageModel* model_;
  QSortFilterProxyModel* filter_;
  QListView* list_;
  QComboBox* least_;
  int unseen_ = 0;
};

}  // namespace robomosp::viewer
