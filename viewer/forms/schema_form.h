// SPDX-License-Identifier: GPL-3.0-or-later
// SchemaForm: the fields of a schema, by groups, with conditions, marks and faults (layer: GUI).
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <QTimer>
#include <QWidget>

#include "kernel/fault.h"
#include "kernel/schema.h"
#include "viewer/forms/form_context.h"
#include "viewer/forms/form_row.h"
#include "viewer/widgets/field.h"

class QGridLayout;
class QPushButton;
class QToolButton;
class QVBoxLayout;

namespace robomosp::viewer {

/// The fields of a schema under headings that fold, in one or two columns. Fields are hidden while
/// their condition does not hold, and advanced ones until "more" is chosen. It runs nothing.
class SchemaForm : public QWidget {
 public:
  /// `prefix` is the path of the form within that of the context: "", "step", "links[2]".
  SchemaForm(FormContextPtr context, Schema schema, std::string prefix, QWidget* parent);
  ~SchemaForm() override;

  /// Replaces all values; fields that `values` does not name are not given.
  void fill(const Map& values);
  /// Sets one value without a change being reported; nothing = not given.
  void set(std::string_view name, const std::optional<Value>& value);
  /// The values that are given, in the order of the schema.
  [[nodiscard]] Map values() const;
  [[nodiscard]] const Schema& schema() const { return schema_; }
  /// The field of a name; null = the schema has none, or it was never shown.
  [[nodiscard]] Field* field(std::string_view name) const;
  [[nodiscard]] FormRowWidget* row(std::string_view name) const;
  [[nodiscard]] bool is_shown(std::string_view name) const;
  /// Names of the fields that are shown, in their order.
  [[nodiscard]] std::vector<std::string> shown_names() const;
  /// Values that count as unchanged; others get the mark. Without them every given value does not.
  void set_baseline(std::optional<Map> values);
  void set_columns(int columns);
  void show_advanced(bool on);

  /// Shows faults at their fields; true if all had one. A remedy that repeats the call is offered
  /// through on_remedy like the others.
  bool show_faults(const std::vector<ShownFault>& faults);
  void clear_faults();
  /// The faults that fields show, with their paths within the form.
  [[nodiscard]] std::vector<PartFault> field_faults() const;
  /// True if all rows that are shown are made. Rows are made a few at a time, so that the thread
  /// of the window is not kept; field() and row() make the one that is asked for.
  [[nodiscard]] bool is_complete() const;
  /// Time that rows are made for at once [ms], less than a frame; 0 makes one row at a time.
  static inline int slice_ms = 6;

  /// Called after an edit by the user: the path of the changed part within the form ("q",
  /// "links[2].alpha"), its value (nothing = removed), and the stage.
  std::function<void(const std::string& path, const std::optional<Value>& value,
                     Field::Stage stage)>
      on_change;
  std::function<void(const FaultRemedy&)> on_remedy;
  std::function<void()> on_grown;  ///< after further rows were made

 private:
  struct Entry;
  struct Group;
  void make_row(Entry& entry);
  void make_rows();
  void mark_row(Entry& entry, const Map& now);
  static void mark_required(Entry& entry);
  void arrange();
  void refresh();
  void take(Entry& entry, Field::Stage stage);
  [[nodiscard]] Entry* entry(std::string_view name) const;
  FormContextPtr context_;
  Schema schema_;
  std::string prefix_;
  std::vector<std::unique_ptr<Entry>> entries_;  ///< in the order of the form
  std::vector<std::unique_ptr<Group>> groups_;
  std::optional<Map> baseline_;
  int columns_ = 1;
  bool shows_advanced_ = false, has_advanced_ = false;
  QGridLayout* grid_;
  QTimer rest_;  ///< makes the rows that are still missing
  QPushButton* more_ = nullptr;
  QWidget* general_faults_;
  QVBoxLayout* general_column_;
};

}  // namespace robomosp::viewer
