// SPDX-License-Identifier: GPL-3.0-or-later
// SchemaForm: the fields of a schema, by groups, with conditions, marks and faults (layer: GUI).
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <QWidget>

#include "kernel/fault.h"
#include "kernel/schema.h"
#include "viewer/forms/form_context.h"
#include "viewer/widgets/field.h"

class QGridLayout;
class QLabel;
class QPushButton;
class QToolButton;
class QVBoxLayout;

namespace robomosp::viewer {

/// A fault with what a form shows of it.
struct ShownFault {
  std::string path;  ///< of the value: "links[2].alpha"; empty = of the whole form
  QString sentence;
  std::vector<FaultRemedy> remedies;
};
[[nodiscard]] ShownFault shown_fault(const Fault& fault);

/// One field with its label, mark, and the sentences of its faults below.
class FormRowWidget : public QWidget {
 public:
  FormRowWidget(const FormContextPtr& context, const ParamSpec& param, const std::string& path,
                QWidget* parent);
  [[nodiscard]] Field* field() const { return field_; }
  [[nodiscard]] const ParamSpec& param() const { return param_; }
  void set_changed(bool on);
  [[nodiscard]] bool is_changed() const { return is_changed_; }
  void show_fault(const ShownFault& fault,
                  const std::function<void(const FaultRemedy&)>& on_remedy);
  void clear_faults();
  [[nodiscard]] QString fault_text() const;
  /// A row of a form within a form has a narrower label.
  void set_is_inner(bool on);

 protected:
  void paintEvent(QPaintEvent* event) override;
  void changeEvent(QEvent* event) override;

 private:
  void arrange();
  void take_lengths();
  ParamSpec param_;
  QLabel* label_;
  Field* field_;
  QGridLayout* grid_;
  QWidget* faults_ = nullptr;
  QVBoxLayout* fault_column_ = nullptr;
  bool is_changed_ = false, is_inner_ = false;
};

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

  /// Called after an edit by the user: the path of the changed part within the form ("q",
  /// "links[2].alpha"), its value (nothing = removed), and the stage.
  std::function<void(const std::string& path, const std::optional<Value>& value,
                     Field::Stage stage)>
      on_change;
  std::function<void(const FaultRemedy&)> on_remedy;

 private:
  struct Entry;
  struct Group;
  void make_row(Entry& entry);
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
  QPushButton* more_ = nullptr;
  QWidget* general_faults_;
  QVBoxLayout* general_column_;
};

}  // namespace robomosp::viewer
