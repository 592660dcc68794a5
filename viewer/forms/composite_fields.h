// SPDX-License-Identifier: GPL-3.0-or-later
// Fields with parts: alternatives, lists, tables of named values, maps with fields, variants,
// providers with parameters (layer: GUI).
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "kernel/schema.h"
#include "kernel/type.h"
#include "viewer/forms/form_context.h"
#include "viewer/widgets/field.h"

class QHBoxLayout;
class QLabel;
class QPushButton;
class QToolButton;
class QVBoxLayout;

namespace robomosp::viewer {

class ChoiceField;
class LiteralField;
class SchemaForm;
class TextField;

/// A value that may be absent, of one of several types: a line with what is given, buttons to set
/// and remove it, a switch between the types, and the field of the chosen one, made when it is
/// needed. The last alternative is always the value as Lua.
class OptionsField : public Field {
 public:
  OptionsField(FormContextPtr context, ParamSpec param, std::string path, QWidget* parent);
  [[nodiscard]] std::optional<Value> value() const override;
  void set_value(const std::optional<Value>& value) override;
  void set_default(const std::optional<Value>& value) override;
  bool place_fault(std::string_view path, const QString& sentence) override;
  void clear_faults() override;
  [[nodiscard]] std::vector<PartFault> shown_faults() const override;
  [[nodiscard]] bool shows_sentence(std::string_view path) const override;
  [[nodiscard]] QString unit_beside() const override;
  [[nodiscard]] std::string changed_path() const override;
  [[nodiscard]] std::optional<Value> changed_value() const override;
  [[nodiscard]] bool is_tall() const override;
  /// Index of the alternative that is shown; the last is Lua.
  [[nodiscard]] std::size_t option() const { return option_; }
  [[nodiscard]] std::size_t option_count() const { return types_.size() + 1; }
  void show_option(std::size_t index);
  /// The field of the alternative; null while nothing is given or it is folded.
  [[nodiscard]] Field* editor() const { return editor_; }
  /// Makes the editor, as the button "Set" does. `is_edit`: reports the change.
  void open_editor(bool is_edit);
  /// The line is hidden, and the editor always shown.
  void set_always_open();

 private:
  void make_editor();
  void drop_editor();
  void show_line();
  [[nodiscard]] ParamSpec param_of(std::size_t index) const;
  FormContextPtr context_;
  ParamSpec param_;
  std::string path_;
  std::vector<const TypeTree*> types_;
  std::size_t option_ = 0;
  std::optional<Value> value_;  ///< what counts while there is no editor, or it was not edited
  bool is_edited_ = false, is_always_open_ = false, was_open_ = false;
  bool is_inline_ = false;  ///< the editor is within the line
  Field* editor_ = nullptr;
  std::string last_path_;
  QVBoxLayout* column_;
  QWidget* head_;
  QLabel* line_;
  QToolButton *fold_, *remove_;
  QPushButton *set_, *switch_;
};

/// Base of fields that have a row for each of any number of parts, and a button that adds one.
class PartsField : public Field {
 public:
  bool place_fault(std::string_view path, const QString& sentence) override;
  void clear_faults() override;
  [[nodiscard]] std::vector<PartFault> shown_faults() const override;
  [[nodiscard]] bool shows_sentence(std::string_view path) const override;
  [[nodiscard]] std::string changed_path() const override { return last_path_; }
  [[nodiscard]] std::optional<Value> changed_value() const override;
  [[nodiscard]] bool is_tall() const override { return true; }
  [[nodiscard]] std::size_t size() const { return rows_.size(); }

 protected:
  struct Row {
    QWidget* box;
    Field* field;
    QLabel* number = nullptr;   ///< of an element of a list
    TextField* name = nullptr;  ///< of an entry of a map
  };
  PartsField(FormContextPtr context, ParamSpec element, std::string path, const QString& add_tip,
             QWidget* parent);
  /// The part of a row as the beginning of a path: "[2]", ".limit"; "" = it has none yet.
  [[nodiscard]] virtual std::string key_of(std::size_t row) const = 0;
  virtual void add_part() = 0;
  /// The row of a path, with the rest of the path behind it.
  [[nodiscard]] std::optional<std::pair<std::size_t, std::string_view>> row_at(
      std::string_view path) const;
  [[nodiscard]] std::size_t index_of(const QWidget* box) const;
  /// Adds a row with the field of a part at `path` behind `heads`.
  void add_row(QWidget* box, QHBoxLayout* line, Row row);
  void drop_row(std::size_t index);
  /// Reports a change of one part, or of the whole.
  void take_part(const QWidget* box, Stage stage);
  void take_whole(Stage stage);

  FormContextPtr context_;
  ParamSpec element_;
  std::string path_;
  std::vector<Row> rows_;
  std::string last_path_;
  Field* last_field_ = nullptr;
  QVBoxLayout* column_;
};

/// Elements of one type: added, removed, moved; each has its field.
class ListField : public PartsField {
 public:
  ListField(FormContextPtr context, ParamSpec element, std::string path, QWidget* parent);
  [[nodiscard]] std::optional<Value> value() const override;
  void set_value(const std::optional<Value>& value) override;
  [[nodiscard]] Field* element(std::size_t i) const { return rows_[i].field; }
  void add_element();
  void remove_element(std::size_t i);
  void move_element(std::size_t from, std::size_t to);

 protected:
  [[nodiscard]] std::string key_of(std::size_t row) const override;
  void add_part() override { add_element(); }

 private:
  void append(const std::optional<Value>& value);
  void renumber();
};

/// Names with values of one type.
class MapField : public PartsField {
 public:
  MapField(FormContextPtr context, ParamSpec element, std::string path, QWidget* parent);
  [[nodiscard]] std::optional<Value> value() const override;
  void set_value(const std::optional<Value>& value) override;
  void add_entry(const std::string& name, const std::optional<Value>& value);

 protected:
  [[nodiscard]] std::string key_of(std::size_t row) const override;
  void add_part() override;
};

/// A map with known fields; further entries are kept. Of a variant, a first field decides which
/// other fields there are.
class FieldsField : public Field {
 public:
  /// `tree` is a map with fields, the row of a table, or a variant.
  FieldsField(FormContextPtr context, const TypeTree& tree, std::string path, QWidget* parent);
  [[nodiscard]] std::optional<Value> value() const override;
  void set_value(const std::optional<Value>& value) override;
  bool place_fault(std::string_view path, const QString& sentence) override;
  void clear_faults() override;
  [[nodiscard]] std::vector<PartFault> shown_faults() const override;
  [[nodiscard]] bool shows_sentence(std::string_view path) const override;
  [[nodiscard]] std::string changed_path() const override { return last_path_; }
  [[nodiscard]] std::optional<Value> changed_value() const override { return last_value_; }
  [[nodiscard]] bool is_tall() const override { return true; }
  [[nodiscard]] SchemaForm* form() const { return form_; }

 private:
  void show_case(const std::string& word, const Map& values);
  FormContextPtr context_;
  const TypeTree& tree_;
  std::string path_;
  ChoiceField* decides_ = nullptr;
  SchemaForm* form_ = nullptr;
  Map others_;  ///< entries without a field
  bool is_given_ = false;
  std::string last_path_;
  std::optional<Value> last_value_;
  QVBoxLayout* column_;
};

/// A provider and its parameters: a name, or {name, params}.
class ProviderField : public Field {
 public:
  ProviderField(FormContextPtr context, const TypeTree& tree, std::string path, QWidget* parent);
  [[nodiscard]] std::optional<Value> value() const override;
  void set_value(const std::optional<Value>& value) override;
  void set_default(const std::optional<Value>& value) override;
  bool place_fault(std::string_view path, const QString& sentence) override;
  void clear_faults() override;
  [[nodiscard]] std::vector<PartFault> shown_faults() const override;
  [[nodiscard]] bool shows_sentence(std::string_view path) const override;
  [[nodiscard]] bool is_tall() const override { return form_ != nullptr; }
  [[nodiscard]] ChoiceField* choice() const { return choice_; }
  [[nodiscard]] SchemaForm* form() const { return form_; }

 private:
  void ask_params(const Map& values);
  void take_schema(const Schema& schema, const Map& values);
  FormContextPtr context_;
  const TypeTree& tree_;
  std::string path_;
  ChoiceField* choice_;
  SchemaForm* form_ = nullptr;
  Map params_;                  ///< until the form is there
  std::optional<Value> value_;  ///< as it was set, until it is edited
  int asked_ = 0;
  QVBoxLayout* column_;
};

/// Shows the balls and densities of materials in a field that chooses one.
void ask_material_looks(ChoiceField* field, const FormContextPtr& context);
/// Sets the choices of a field by schema.choices for `path` of the form.
void ask_choices(ChoiceField* field, const FormContextPtr& context, const std::string& path);

}  // namespace robomosp::viewer
