// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <utility>

#include <QGridLayout>
#include <QToolButton>

#include "kernel/text.h"
#include "viewer/theme/icons.h"
#include "viewer/theme/theme.h"
#include "viewer/widgets/number_fields.h"

namespace robomosp::viewer {

std::optional<std::size_t> index_in_path(std::string_view path) {
  if (path.empty() || path.front() != '[') return std::nullopt;
  const auto end = path.find(']');
  if (end == std::string_view::npos) return std::nullopt;
  std::size_t index = 0;
  for (const char c : path.substr(1, end - 1)) {
    if (c < '0' || c > '9' || index > 1'000'000) return std::nullopt;
    index = index * 10 + static_cast<std::size_t>(c - '0');
  }
  if (index == 0) return std::nullopt;
  return index - 1;
}

std::vector<Value> elements_of(const Value& v) {
  std::vector<Value> out;
  if (const List* list = v.as_list()) out = *list;
  if (const NumericArray* a = v.as_array())
    for (const double x : a->data()) out.emplace_back(x);
  return out;
}

VectorField::VectorField(std::vector<Component> components, QWidget* parent)
    : Field(parent), components_(std::move(components)), grid_(new QGridLayout(this)) {
  grid_->setContentsMargins(0, 0, 0, 0);
  grid_->setSpacing(theme().px(4));
  setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Fixed);
  build(components_.size());
}

VectorField::VectorField(NumberFormat each, QWidget* parent)
    : Field(parent), each_(std::move(each)), grid_(new QGridLayout(this)) {
  grid_->setContentsMargins(0, 0, 0, 0);
  grid_->setSpacing(theme().px(4));
  setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Fixed);
  const auto button = [this](const char* name, const QString& tip) {
    auto* b = new QToolButton(this);
    b->setIcon(icon(name));
    b->setFixedSize(theme().field_height, theme().field_height);
    b->setToolTip(tip);
    b->setAccessibleName(tip);
    return b;
  };
  more_ = button("plus", "Add a number");
  fewer_ = button("minus", "Remove the last number");
  QObject::connect(more_, &QToolButton::clicked, this, [this] {
    build(fields_.size() + 1);
    value_.reset();
    fields_.back()->set_value(Value(0.0));
    changed_ = fields_.size() - 1;
    notify(Stage::changed);
  });
  QObject::connect(fewer_, &QToolButton::clicked, this, [this] {
    if (fields_.empty()) return;
    value_.reset();
    build(fields_.size() - 1);
    notify(Stage::changed);
  });
  build(0);
}

void VectorField::set_per_row(int count) {
  per_row_ = std::max(1, count);
  build(fields_.size());
}

bool VectorField::is_tall() const { return static_cast<int>(fields_.size()) > per_row_; }

NumberField* VectorField::add_field() {
  const std::size_t index = fields_.size();
  const bool is_named = index < components_.size();
  auto* field = new NumberField(is_named ? components_[index].format : each_, this);
  field->set_may_be_empty(is_named);
  if (is_named)
    field->set_prefix(components_[index].axis >= 0 && components_.size() <= 3
                          ? QString()
                          : qt(components_[index].name),
                      components_[index].axis);
  field->on_change = [this, index](Stage stage) { take(index, stage); };
  fields_.push_back(field);
  return field;
}

void VectorField::build(std::size_t count) {
  while (fields_.size() > count) {
    fields_.back()->hide();
    fields_.back()->deleteLater();
    fields_.pop_back();
  }
  while (fields_.size() < count) add_field();
  while (grid_->count() > 0) delete grid_->takeAt(0);
  int i = 0;
  for (NumberField* f : fields_) {
    grid_->addWidget(f, i / per_row_, i % per_row_);
    f->show();
    ++i;
  }
  if (more_) {
    grid_->addWidget(more_, i / per_row_, i % per_row_, Qt::AlignLeft);
    grid_->addWidget(fewer_, (i + 1) / per_row_, (i + 1) % per_row_, Qt::AlignLeft);
    fewer_->setEnabled(count > 0);
  }
  name_fields();
  place_unit();
  updateGeometry();
}

void VectorField::resizeEvent(QResizeEvent* event) {
  Field::resizeEvent(event);
  place_unit();
}

void VectorField::take_theme() { place_unit(); }

void VectorField::place_unit() {
  const int columns = std::min(per_row_, static_cast<int>(fields_.size()));
  QString unit;
  bool has_space = true;
  if (columns > 0) {
    const int each = (width() - grid_->horizontalSpacing() * (columns - 1)) / columns;
    unit = unit_text(fields_.front()->format().shown);
    for (const NumberField* f : fields_) {
      if (unit_text(f->format().shown) != unit) unit.clear();  // each has its own
      has_space = has_space && f->width_with_unit() <= each;
    }
  }
  const QString beside = has_space ? QString() : unit;
  for (NumberField* f : fields_) f->set_shows_unit(beside.isEmpty());
  if (std::exchange(unit_beside_, beside) == beside) return;
  // A form draws it beside the label.
  for (QWidget* w = parentWidget(); w && !w->isWindow(); w = w->parentWidget()) w->update();
}

void VectorField::name_fields() {
  for (std::size_t i = 0; i < fields_.size(); ++i) {
    const QString part = i < components_.size() && !components_[i].name.empty()
                             ? qt(components_[i].name)
                             : QString::number(i + 1);
    fields_[i]->describe(accessibleName() + " " + part, accessibleDescription(), toolTip(),
                         objectName() + "[" + QString::number(i + 1) + "]");
  }
  if (more_) {
    more_->setObjectName(objectName() + ".add");
    fewer_->setObjectName(objectName() + ".remove");
  }
}

void VectorField::set_components(std::vector<Component> components) {
  const auto now = value();
  components_ = std::move(components);
  delete more_;
  delete fewer_;
  more_ = fewer_ = nullptr;
  build(0);
  build(components_.size());
  set_value(now);
}

std::optional<Value> VectorField::value() const {
  if (value_) return value_;
  List out;
  bool is_given = more_ && !fields_.empty();
  bool are_numbers = true;
  for (const NumberField* f : fields_) {
    const auto v = f->value();
    is_given = is_given || v;
    are_numbers = are_numbers && (!v || v->is_number());
    out.push_back(v ? *v : f->default_value() ? *f->default_value() : Value(0.0));
  }
  if (!is_given) return std::nullopt;
  if (was_array_ && are_numbers) {
    std::vector<double> numbers;
    for (const Value& v : out) numbers.push_back(v.number());
    return Value(NumericArray(std::move(numbers)));
  }
  return Value(std::move(out));
}

void VectorField::set_value(const std::optional<Value>& value) {
  was_array_ = value && value->as_array();
  value_ = value;
  is_edited_ = false;
  const auto parts = value ? elements_of(*value) : std::vector<Value>();
  if (components_.empty()) build(parts.size());
  for (std::size_t i = 0; i < fields_.size(); ++i)
    fields_[i]->set_value(i < parts.size() ? std::optional(parts[i]) : std::nullopt);
  name_fields();
}

void VectorField::set_default(const std::optional<Value>& value) {
  Field::set_default(value);
  const auto parts = value ? elements_of(*value) : std::vector<Value>();
  for (std::size_t i = 0; i < fields_.size(); ++i)
    fields_[i]->set_default(i < parts.size() ? std::optional(parts[i]) : std::nullopt);
}

void VectorField::set_mixed(bool on) {
  Field::set_mixed(on);
  for (NumberField* f : fields_) f->set_mixed(on);
}

void VectorField::set_computed(std::size_t component, std::optional<double> si) {
  if (component < fields_.size()) fields_[component]->set_computed(si);
}

void VectorField::take(std::size_t index, Stage stage) {
  value_.reset();
  changed_ = index;
  is_edited_ = true;
  set_fault({});
  notify(stage);
}

bool VectorField::place_fault(std::string_view path, const QString& sentence) {
  std::optional<std::size_t> index = index_in_path(path);
  if (!index && path.size() > 1 && path.front() == '.')
    for (std::size_t i = 0; i < components_.size(); ++i)
      if (components_[i].name == path.substr(1)) index = i;
  if (index && *index < fields_.size()) {
    fields_[*index]->set_fault(sentence);
    return true;
  }
  // A sentence about the whole that follows an edit is about the component that was edited.
  if (is_edited_ && changed_ < fields_.size()) fields_[changed_]->set_fault(sentence);
  else
    for (NumberField* f : fields_) f->set_fault(sentence);
  return Field::place_fault(path, sentence);
}

void VectorField::clear_faults() {
  Field::clear_faults();
  for (NumberField* f : fields_) f->clear_faults();
}

std::vector<PartFault> VectorField::shown_faults() const {
  std::vector<PartFault> out;
  for (std::size_t i = 0; i < fields_.size(); ++i)
    if (!fields_[i]->fault().isEmpty())
      out.push_back({"[" + std::to_string(i + 1) + "]", fields_[i]->fault()});
  return out.empty() ? Field::shown_faults() : out;
}

// ---- MatrixField ----

MatrixField::MatrixField(std::size_t rows, std::size_t cols, NumberFormat each, QWidget* parent)
    : Field(parent),
      fixed_rows_(rows),
      fixed_cols_(cols),
      each_(std::move(each)),
      grid_(new QGridLayout(this)),
      tools_(new QWidget(this)) {
  grid_->setContentsMargins(0, 0, 0, 0);
  grid_->setSpacing(theme().px(2));
  auto* row = new QHBoxLayout(tools_);
  row->setContentsMargins(0, 0, 0, 0);
  row->setSpacing(theme().px(4));
  const auto button = [&](const char* symbol, const QString& tip, const char* name, int more_rows,
                          int more_cols) {
    auto* b = new QToolButton(tools_);
    b->setIcon(icon(symbol));
    b->setText(name);
    b->setToolButtonStyle(Qt::ToolButtonTextBesideIcon);
    b->setToolTip(tip);
    b->setAccessibleName(tip);
    b->setObjectName(name);
    QObject::connect(b, &QToolButton::clicked, this, [this, more_rows, more_cols] {
      const auto next = [](std::size_t n, int by) {
        return static_cast<std::size_t>(std::max(0, static_cast<int>(n) + by));
      };
      const auto now = value();
      resize_to(std::max<std::size_t>(next(rows_, more_rows), cols_ == 0 && more_cols > 0 ? 1 : 0),
                std::max<std::size_t>(next(cols_, more_cols), more_rows > 0 ? 1 : 0));
      notify(Stage::changed);
    });
    row->addWidget(b);
  };
  if (!fixed_rows_) {
    button("plus", "Add a row", "Row", 1, 0);
    button("minus", "Remove the last row", "Row", -1, 0);
  }
  if (!fixed_cols_) {
    button("plus", "Add a column", "Column", 0, 1);
    button("minus", "Remove the last column", "Column", 0, -1);
  }
  row->addStretch();
  tools_->setVisible(!fixed_rows_ || !fixed_cols_);
  build(fixed_rows_, fixed_cols_);
}

void MatrixField::build(std::size_t rows, std::size_t cols) {
  for (NumberField* f : fields_) {
    f->hide();
    f->deleteLater();
  }
  fields_.clear();
  while (grid_->count() > 0) delete grid_->takeAt(0);
  rows_ = rows;
  cols_ = cols;
  for (std::size_t r = 0; r < rows; ++r)
    for (std::size_t c = 0; c < cols; ++c) {
      auto* f = new NumberField(each_, this);
      f->set_may_be_empty(false);
      f->describe(QString("%1 row %2 column %3").arg(accessibleName()).arg(r + 1).arg(c + 1), {},
                  {}, QString("%1[%2][%3]").arg(objectName()).arg(r + 1).arg(c + 1));
      f->on_change = [this, at = r * cols + c](Stage stage) {
        value_.reset();
        changed_ = at;
        set_fault({});
        notify(stage);
      };
      grid_->addWidget(f, static_cast<int>(r), static_cast<int>(c));
      f->show();
      fields_.push_back(f);
    }
  grid_->addWidget(tools_, static_cast<int>(rows), 0, 1,
                   static_cast<int>(std::max<std::size_t>(cols, 1)));
  updateGeometry();
}

void MatrixField::resize_to(std::size_t rows, std::size_t cols) {
  std::vector<std::vector<Value>> kept(rows_);
  for (std::size_t r = 0; r < rows_; ++r)
    for (std::size_t c = 0; c < cols_; ++c)
      kept[r].push_back(fields_[r * cols_ + c]->value().value_or(Value(0.0)));
  value_.reset();
  changed_.reset();
  build(rows, cols);
  for (std::size_t r = 0; r < rows; ++r)
    for (std::size_t c = 0; c < cols; ++c)
      fields_[r * cols + c]->set_value(r < kept.size() && c < kept[r].size() ? kept[r][c]
                                                                             : Value(0.0));
}

std::optional<Value> MatrixField::value() const {
  if (value_) return value_;
  bool is_given = false;
  List out;
  for (std::size_t r = 0; r < rows_; ++r) {
    List row;
    for (std::size_t c = 0; c < cols_; ++c) {
      const auto v = fields_[r * cols_ + c]->value();
      is_given = is_given || v;
      row.push_back(v.value_or(Value(0.0)));
    }
    out.emplace_back(std::move(row));
  }
  if (!is_given) return std::nullopt;
  if (was_array_) {
    std::vector<double> numbers;
    for (const NumberField* f : fields_) numbers.push_back(f->number().value_or(0));
    return Value(NumericArray(std::move(numbers), rows_, cols_));
  }
  return Value(std::move(out));
}

void MatrixField::set_value(const std::optional<Value>& value) {
  was_array_ = value && value->as_array();
  changed_.reset();
  std::vector<std::vector<Value>> rows;
  if (value) {
    if (const NumericArray* a = value->as_array(); a && a->is_matrix()) {
      for (std::size_t r = 0; r < a->rows(); ++r) {
        rows.emplace_back();
        for (std::size_t c = 0; c < a->cols(); ++c) rows.back().emplace_back(a->at(r, c));
      }
    } else {
      for (const Value& row : elements_of(*value)) rows.push_back(elements_of(row));
    }
  }
  std::size_t cols = fixed_cols_;
  for (const auto& row : rows) cols = std::max(cols, row.size());
  if (const std::size_t count = std::max(fixed_rows_, rows.size()); count != rows_ || cols != cols_)
    build(count, cols);
  for (std::size_t r = 0; r < rows.size(); ++r)
    for (std::size_t c = 0; c < rows[r].size(); ++c) fields_[r * cols_ + c]->set_value(rows[r][c]);
  value_ = value;
}

bool MatrixField::place_fault(std::string_view path, const QString& sentence) {
  if (const auto r = index_in_path(path); r && *r < rows_) {
    const auto c = index_in_path(path.substr(path.find(']') + 1));
    for (std::size_t i = 0; i < cols_; ++i)
      if (!c || *c == i) fields_[*r * cols_ + i]->set_fault(sentence);
    return true;
  }
  if (changed_ && *changed_ < fields_.size()) fields_[*changed_]->set_fault(sentence);
  return Field::place_fault(path, sentence);
}

std::vector<PartFault> MatrixField::shown_faults() const {
  std::vector<PartFault> out;
  for (std::size_t i = 0; i < fields_.size(); ++i)
    if (!fields_[i]->fault().isEmpty())
      out.push_back(
          {"[" + std::to_string(i / cols_ + 1) + "][" + std::to_string(i % cols_ + 1) + "]",
           fields_[i]->fault()});
  return out.empty() ? Field::shown_faults() : out;
}

void MatrixField::clear_faults() {
  Field::clear_faults();
  for (NumberField* f : fields_) f->clear_faults();
}

// ---- BandField ----

BandField::BandField(NumberFormat format, QWidget* parent)
    : Field(parent), lower_(new NumberField(format, this)), upper_(new NumberField(format, this)) {
  setSizePolicy(QSizePolicy::Expanding, QSizePolicy::Fixed);
  for (NumberField* f : {lower_, upper_})
    f->on_change = [this](Stage stage) {
      const auto low = lower_->number(), high = upper_->number();
      const bool is_crossed = low && high && *low > *high;
      set_fault(is_crossed ? QStringLiteral("The lower bound is above the upper one.") : QString());
      for (NumberField* each : {lower_, upper_}) each->set_fault(fault());
      update();
      notify(stage);
    };
  QObject::connect(this, &QObject::objectNameChanged, this, [this](const QString& name) {
    lower_->describe(accessibleName() + " lower bound", {}, toolTip(), name + "[1]");
    upper_->describe(accessibleName() + " upper bound", {}, toolTip(), name + "[2]");
  });
}

std::optional<Value> BandField::value() const {
  const auto low = lower_->value(), high = upper_->value();
  if (!low && !high) return std::nullopt;
  return Value(List{low.value_or(Value()), high.value_or(Value())});
}

void BandField::set_value(const std::optional<Value>& value) {
  const auto parts = value ? elements_of(*value) : std::vector<Value>();
  lower_->set_value(!parts.empty() && !parts[0].is_nil() ? std::optional(parts[0]) : std::nullopt);
  upper_->set_value(parts.size() > 1 && !parts[1].is_nil() ? std::optional(parts[1])
                                                           : std::nullopt);
  update();
}

bool BandField::place_fault(std::string_view path, const QString& sentence) {
  if (const auto i = index_in_path(path); i && *i < 2) {
    (*i == 0 ? lower_ : upper_)->set_fault(sentence);
    return true;
  }
  return Field::place_fault(path, sentence);
}

void BandField::clear_faults() {
  Field::clear_faults();
  lower_->clear_faults();
  upper_->clear_faults();
}

void BandField::set_range(double from, double to) {
  from_ = from;
  to_ = std::max(to, from + 1e-12);
  update();
}

void BandField::set_marked(std::optional<double> si) {
  marked_ = si;
  update();
}

QSize BandField::sizeHint() const { return {theme().px(200), theme().field_height}; }

void BandField::resizeEvent(QResizeEvent* event) {
  const int w = std::max(theme().px(56), width() * 32 / 100);
  lower_->setGeometry(0, 0, w, height());
  upper_->setGeometry(width() - w, 0, w, height());
  Field::resizeEvent(event);
}

void BandField::paintEvent(QPaintEvent*) {
  const Theme& t = theme();
  QPainter p(this);
  p.setRenderHint(QPainter::Antialiasing);
  const int gap = t.px(6);
  const QRect bar(lower_->geometry().right() + gap, height() / 2 - t.px(2),
                  upper_->geometry().left() - lower_->geometry().right() - 2 * gap, t.px(4));
  p.setPen(Qt::NoPen);
  p.setBrush(t.line);
  p.drawRoundedRect(bar, 2, 2);
  const auto at = [&](double si) {
    return bar.left() + std::clamp((si - from_) / (to_ - from_), 0.0, 1.0) * bar.width();
  };
  const double left = at(lower_->number().value_or(from_)),
               right = at(upper_->number().value_or(to_));
  p.setBrush(isEnabled() ? t.accent_fill : t.field_line);
  if (right > left) p.drawRoundedRect(QRectF(left, bar.top(), right - left, bar.height()), 2, 2);
  if (marked_) {
    p.setBrush(*marked_ < lower_->number().value_or(from_) ||
                       *marked_ > upper_->number().value_or(to_)
                   ? t.fault
                   : t.text);
    p.drawRect(QRectF(at(*marked_) - 1, bar.top() - t.px(4), 2, bar.height() + t.px(8)));
  }
}

}  // namespace robomosp::viewer
