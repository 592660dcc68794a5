// SPDX-License-Identifier: GPL-3.0-or-later
// Fields with a row for each part: lists and maps.
#include <algorithm>

#include <QHBoxLayout>
#include <QLabel>
#include <QPushButton>
#include <QToolButton>
#include <QVBoxLayout>

#include "viewer/forms/composite_fields.h"
#include "viewer/forms/field_buttons.h"
#include "viewer/forms/field_factory.h"
#include "viewer/theme/icons.h"
#include "viewer/theme/theme.h"
#include "viewer/widgets/number_fields.h"
#include "viewer/widgets/simple_fields.h"

namespace robomosp::viewer {

// ---- PartsField ----

PartsField::PartsField(FormContextPtr context, ParamSpec element, std::string path,
                       const QString& add_tip, QWidget* parent)
    : Field(parent),
      context_(std::move(context)),
      element_(std::move(element)),
      path_(std::move(path)),
      column_(column_of(this)) {
  element_.required = true;
  QPushButton* add = link_button(this, "Add", add_tip, qt(context_->title + "." + path_) + ".add");
  add->setIcon(icon("plus"));
  column_->addWidget(add, 0, Qt::AlignLeft);
  setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Preferred);
  QObject::connect(add, &QPushButton::clicked, this, [this] { add_part(); });
}

std::size_t PartsField::index_of(const QWidget* box) const {
  const auto at =
      std::find_if(rows_.begin(), rows_.end(), [box](const Row& r) { return r.box == box; });
  return static_cast<std::size_t>(at - rows_.begin());
}

void PartsField::add_row(QWidget* box, QHBoxLayout* line, Row row) {
  line->setContentsMargins(0, 0, 0, 0);
  line->setSpacing(theme().px(4));
  row.field->on_change = [this, box](Stage stage) { take_part(box, stage); };
  column_->insertWidget(static_cast<int>(rows_.size()), box);
  rows_.push_back(row);
  box->show();
}

void PartsField::drop_row(std::size_t index) {
  if (rows_[index].field == last_field_) last_field_ = nullptr;
  rows_[index].box->hide();
  rows_[index].box->deleteLater();
  rows_.erase(rows_.begin() + static_cast<std::ptrdiff_t>(index));
}

void PartsField::take_part(const QWidget* box, Stage stage) {
  const std::size_t i = index_of(box);
  if (i >= rows_.size()) return;
  const std::string key = key_of(i);
  if (key.empty()) return;
  last_field_ = rows_[i].field;
  last_path_ = key + last_field_->changed_path();
  notify(stage);
}

void PartsField::take_whole(Stage stage) {
  last_path_.clear();
  last_field_ = nullptr;
  notify(stage);
}

std::optional<Value> PartsField::changed_value() const {
  return last_field_ && !last_path_.empty() ? last_field_->changed_value() : value();
}

std::optional<std::pair<std::size_t, std::string_view>> PartsField::row_at(
    std::string_view path) const {
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    const std::string key = key_of(i);
    if (key.empty() || !path.starts_with(key)) continue;
    const std::string_view rest = path.substr(key.size());
    if (rest.empty() || rest.front() == '.' || rest.front() == '[') return std::pair(i, rest);
  }
  return std::nullopt;
}

bool PartsField::place_fault(std::string_view path, const QString& sentence) {
  if (const auto at = row_at(path)) {
    (void)rows_[at->first].field->place_fault(at->second, sentence);
    return true;
  }
  return Field::place_fault(path, sentence);
}

void PartsField::clear_faults() {
  Field::clear_faults();
  for (const Row& row : rows_) row.field->clear_faults();
}

std::vector<PartFault> PartsField::shown_faults() const {
  std::vector<PartFault> out;
  for (std::size_t i = 0; i < rows_.size(); ++i)
    for (PartFault& each : rows_[i].field->shown_faults())
      out.push_back({key_of(i) + each.path, std::move(each.sentence)});
  return out.empty() ? Field::shown_faults() : out;
}

bool PartsField::shows_sentence(std::string_view path) const {
  const auto at = row_at(path);
  return at && rows_[at->first].field->shows_sentence(at->second);
}

// ---- ListField ----

ListField::ListField(FormContextPtr context, ParamSpec element, std::string path, QWidget* parent)
    : PartsField(std::move(context), std::move(element), std::move(path),
                 "Add an element at the end", parent) {}

std::string ListField::key_of(std::size_t row) const { return "[" + std::to_string(row + 1) + "]"; }

void ListField::append(const std::optional<Value>& value) {
  auto* box = new QWidget(this);
  box->setObjectName(objectName() + ".row");
  box->setAccessibleName("Element");
  auto* line = new QHBoxLayout(box);
  Row row{box, make_field(context_, element_, path_ + key_of(rows_.size()), box)};
  row.number = new QLabel(box);
  row.number->setObjectName(objectName() + ".number");
  row.number->setAccessibleName("Place in the list");
  row.number->setProperty("quiet", true);
  row.number->setFixedWidth(theme().px(20));
  row.number->setFixedHeight(theme().field_height);
  row.field->set_value(value);
  auto* up = small_button(box, "chevron_right", "Move up", {});
  up->setArrowType(Qt::UpArrow);
  auto* remove = small_button(box, "close", "Remove the element", {});
  line->addWidget(row.number, 0, Qt::AlignTop);
  line->addWidget(row.field, 1);
  line->addWidget(up, 0, Qt::AlignTop);
  line->addWidget(remove, 0, Qt::AlignTop);
  QObject::connect(up, &QToolButton::clicked, this, [this, box] {
    if (const std::size_t i = index_of(box); i > 0 && i < rows_.size()) move_element(i, i - 1);
  });
  QObject::connect(remove, &QToolButton::clicked, this,
                   [this, box] { remove_element(index_of(box)); });
  add_row(box, line, row);
}

void ListField::renumber() {
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    const QString at = qt(context_->title + "." + path_ + key_of(i));
    rows_[i].number->setText(QString::number(i + 1));
    rows_[i].number->setObjectName(at + ".number");
    rows_[i].number->setAccessibleName(QString("Element %1").arg(i + 1));
    rows_[i].number->setToolTip(toolTip());
    const auto buttons =
        rows_[i].box->findChildren<QToolButton*>(QString(), Qt::FindDirectChildrenOnly);
    if (buttons.size() >= 2) {
      buttons[0]->setObjectName(at + ".up");
      buttons[1]->setObjectName(at + ".remove");
      buttons[0]->setEnabled(i > 0);
    }
  }
}

std::optional<Value> ListField::value() const {
  List out;
  for (const Row& row : rows_) out.push_back(row.field->value().value_or(Value()));
  return Value(std::move(out));
}

void ListField::set_value(const std::optional<Value>& value) {
  const auto parts = value ? elements_of(*value) : std::vector<Value>();
  while (rows_.size() > parts.size()) drop_row(rows_.size() - 1);
  for (std::size_t i = 0; i < parts.size(); ++i)
    if (i < rows_.size()) rows_[i].field->set_value(parts[i]);
    else append(parts[i]);
  last_path_.clear();
  last_field_ = nullptr;
  renumber();
}

void ListField::add_element() {
  append(std::nullopt);
  renumber();
  if (auto* options = dynamic_cast<OptionsField*>(rows_.back().field)) options->open_editor(true);
  rows_.back().field->setFocus(Qt::OtherFocusReason);
  take_whole(Stage::changed);
}

void ListField::remove_element(std::size_t i) {
  if (i >= rows_.size()) return;
  const auto now = elements_of(*value());
  List rest;
  for (std::size_t k = 0; k < now.size(); ++k)
    if (k != i) rest.push_back(now[k]);
  set_value(Value(std::move(rest)));
  take_whole(Stage::changed);
}

void ListField::move_element(std::size_t from, std::size_t to) {
  if (from >= rows_.size() || to >= rows_.size()) return;
  List all = elements_of(*value());
  Value moved = all[from];
  all.erase(all.begin() + static_cast<std::ptrdiff_t>(from));
  all.insert(all.begin() + static_cast<std::ptrdiff_t>(to), std::move(moved));
  set_value(Value(std::move(all)));
  take_whole(Stage::changed);
}

// ---- MapField ----

MapField::MapField(FormContextPtr context, ParamSpec element, std::string path, QWidget* parent)
    : PartsField(std::move(context), std::move(element), std::move(path), "Add a name with a value",
                 parent) {}

std::string MapField::key_of(std::size_t row) const {
  const auto name = rows_[row].name->value();
  return name && name->as_string() ? "." + *name->as_string() : std::string();
}

void MapField::add_part() {
  add_entry("", std::nullopt);
  rows_.back().name->setFocus();
}

void MapField::add_entry(const std::string& name, const std::optional<Value>& value) {
  auto* box = new QWidget(this);
  box->setObjectName(objectName() + ".row");
  box->setAccessibleName("Element");
  auto* line = new QHBoxLayout(box);
  auto* key = new TextField(box);
  key->setFixedWidth(theme().px(100));
  const QString at = qt(context_->title + "." + path_) + QString("#%1").arg(rows_.size() + 1);
  key->describe("Name", "The name of this value.", {}, at + ".name");
  key->set_value(name.empty() ? std::nullopt : std::optional(Value(name)));
  Row row{box, make_field(context_, element_, path_ + "." + (name.empty() ? "new" : name), box)};
  row.name = key;
  row.field->set_value(value);
  auto* remove = small_button(box, "close", "Remove this value", at + ".remove");
  line->addWidget(key, 0, Qt::AlignTop);
  line->addWidget(row.field, 1);
  line->addWidget(remove, 0, Qt::AlignTop);
  key->on_change = [this](Stage stage) { take_whole(stage); };
  QObject::connect(remove, &QToolButton::clicked, this, [this, box] {
    if (const std::size_t i = index_of(box); i < rows_.size()) drop_row(i);
    take_whole(Stage::changed);
  });
  add_row(box, line, row);
}

std::optional<Value> MapField::value() const {
  Map out;
  for (const Row& row : rows_)
    if (const auto name = row.name->value())
      out.set(name->as_string() ? *name->as_string() : name->text(),
              row.field->value().value_or(Value()));
  return Value(std::move(out));
}

void MapField::set_value(const std::optional<Value>& value) {
  static const Map kNone;
  const Map& m = value && value->as_map() ? *value->as_map() : kNone;
  // With the same names only values change.
  bool is_same = rows_.size() == m.size();
  std::size_t i = 0;
  for (const auto& [name, each] : m) is_same = is_same && key_of(i++) == "." + name;
  if (is_same) {
    i = 0;
    for (const auto& [name, each] : m) rows_[i++].field->set_value(each);
    return;
  }
  while (!rows_.empty()) drop_row(rows_.size() - 1);
  for (const auto& [name, each] : m) add_entry(name, each);
}

}  // namespace robomosp::viewer
