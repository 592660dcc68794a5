// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/forms/schema_form.h"

#include <algorithm>

#include <QGridLayout>
#include <QHBoxLayout>
#include <QLabel>
#include <QPushButton>
#include <QToolButton>
#include <QVBoxLayout>

#include "kernel/type.h"
#include "kernel/type_forms.h"
#include "viewer/forms/composite_fields.h"
#include "viewer/forms/field_factory.h"
#include "viewer/theme/icons.h"
#include "viewer/theme/theme.h"

namespace robomosp::viewer {
namespace {

/// A sentence in the colour of faults with the remedies as links below.
QWidget* fault_box(const ShownFault& fault,
                   const std::function<void(const FaultRemedy&)>& on_remedy, const QString& name,
                   QWidget* parent) {
  auto* box = new QWidget(parent);
  box->setObjectName(name);
  box->setAccessibleName("Fault");
  auto* column = new QVBoxLayout(box);
  column->setContentsMargins(0, 0, 0, theme().px(2));
  column->setSpacing(0);
  auto* sentence = new QLabel(fault.sentence, box);
  sentence->setObjectName(name + ".sentence");
  sentence->setAccessibleName("Fault: " + fault.sentence);
  sentence->setToolTip("The fault of this value.");
  sentence->setProperty("fault", true);
  sentence->setWordWrap(true);
  sentence->setTextInteractionFlags(Qt::TextSelectableByMouse);
  column->addWidget(sentence);
  if (!fault.remedies.empty() && on_remedy) {
    auto* row = new QHBoxLayout;
    row->setContentsMargins(0, 0, 0, 0);
    row->setSpacing(theme().px(8));
    int i = 0;
    for (const FaultRemedy& remedy : fault.remedies) {
      auto* button = new QPushButton(qt(remedy.label), box);
      button->setProperty("link", true);
      button->setObjectName(QString("%1.remedy%2").arg(name).arg(++i));
      button->setAccessibleName(qt(remedy.label));
      button->setToolTip(remedy.is_tried ? "This was tried and removes the fault."
                                         : "This may help; it was not tried.");
      QObject::connect(button, &QPushButton::clicked, box,
                       [on_remedy, remedy] { on_remedy(remedy); });
      row->addWidget(button);
    }
    row->addStretch();
    column->addLayout(row);
  }
  return box;
}

/// A label from a name: "sample_time" as "Sample time".
QString readable(const std::string& label) {
  QString s = qt(label);
  s.replace('_', ' ');
  if (!s.isEmpty() && s[0].isLower() && s.size() > 1) s[0] = s[0].toUpper();
  return s;
}

/// The record that a command is about is called by its kind: "Robot" rather than "Id".
QString label_of(const ParamSpec& p) {
  const TypeTree& t = type_tree(p.type);
  if (p.name == "id" && t.kind == TypeKind::reference && t.notes.label.empty() && p.label.empty())
    return readable(t.words.empty() || t.words.front() == "any" ? "record" : t.words.front());
  return readable(form_label(p));
}

}  // namespace

ShownFault shown_fault(const Fault& fault) {
  ShownFault out;
  out.path = fault.subject.argument.empty() ? fault.subject.path : fault.subject.argument;
  // At its place a fault needs no place in its sentence.
  Fault plain = fault;
  if (!out.path.empty()) plain.where.clear();
  QString s = qt(sentence(plain));
  if (!s.isEmpty()) s[0] = s[0].toUpper();
  out.sentence = s;
  out.remedies = fault.remedies;
  return out;
}

// ---- FormRowWidget ----

FormRowWidget::FormRowWidget(const FormContextPtr& context, const ParamSpec& param,
                             const std::string& path, QWidget* parent)
    : QWidget(parent), param_(param), label_(new QLabel(this)), grid_(new QGridLayout(this)) {
  const Theme& t = theme();
  const QString name = qt(context->title + "." + path);
  setObjectName(name + ".row");
  setAccessibleName(label_of(param_));
  field_ = make_field(context, param_, path, this);
  if (param_.required)
    if (auto* options = dynamic_cast<OptionsField*>(field_)) options->open_editor(false);
  label_->setObjectName(name + ".label");
  label_->setText(label_of(param_));
  label_->setProperty("dim", true);
  label_->setAccessibleName(label_->text());
  label_->setToolTip(field_->toolTip());
  label_->setBuddy(field_);
  label_->setAlignment(Qt::AlignLeft | Qt::AlignVCenter);
  grid_->setContentsMargins(0, t.px(2), 0, t.px(2));
  grid_->setHorizontalSpacing(0);
  grid_->setVerticalSpacing(t.px(2));
  take_lengths();
  arrange();
}

void FormRowWidget::set_is_inner(bool on) {
  is_inner_ = on;
  take_lengths();
}

void FormRowWidget::take_lengths() {
  const Theme& t = theme();
  constexpr int kInnerLabel = 84;  // of the design [px]
  label_->setFixedWidth(is_inner_ ? t.px(kInnerLabel) : t.label_width);
  label_->setMinimumHeight(t.field_height);
}

void FormRowWidget::arrange() {
  grid_->removeWidget(label_);
  grid_->removeWidget(field_);
  grid_->addWidget(label_, 0, 0, Qt::AlignTop);
  grid_->setColumnMinimumWidth(1, theme().mark_width);
  grid_->addWidget(field_, 0, 2, Qt::AlignTop);
  grid_->setColumnStretch(2, 1);
}

void FormRowWidget::set_changed(bool on) {
  if (is_changed_ == on) return;
  is_changed_ = on;
  QFont f = label_->font();
  label_->setProperty("dim", !on);
  label_->setStyleSheet(on ? QString("color: %1;").arg(theme().text.name()) : QString());
  label_->setFont(f);
  update();
}

void FormRowWidget::paintEvent(QPaintEvent*) {
  if (!is_changed_) return;
  const Theme& t = theme();
  QPainter p(this);
  p.setRenderHint(QPainter::Antialiasing);
  p.setPen(Qt::NoPen);
  p.setBrush(t.accent);
  const double r = t.px(2);
  p.drawEllipse(QPointF(label_->geometry().right() + t.mark_width / 2.0,
                        label_->geometry().top() + t.field_height / 2.0),
                r, r);
}

void FormRowWidget::changeEvent(QEvent* event) {
  if (event->type() == QEvent::StyleChange) {
    take_lengths();
    const bool on = is_changed_;
    is_changed_ = !on;
    set_changed(on);
  }
  QWidget::changeEvent(event);
}

void FormRowWidget::show_fault(const ShownFault& fault,
                               const std::function<void(const FaultRemedy&)>& on_remedy) {
  if (!faults_) {
    faults_ = new QWidget(this);
    faults_->setObjectName(objectName() + ".faults");
    faults_->setAccessibleName("Faults");
    fault_column_ = new QVBoxLayout(faults_);
    fault_column_->setContentsMargins(0, 0, 0, 0);
    fault_column_->setSpacing(theme().px(2));
    grid_->addWidget(faults_, 1, 0, 1, 3);
  }
  fault_column_->addWidget(fault_box(
      fault, on_remedy, field_->objectName() + QString(".fault%1").arg(fault_column_->count() + 1),
      faults_));
  faults_->show();
}

void FormRowWidget::clear_faults() {
  field_->clear_faults();
  if (!faults_) return;
  faults_->hide();
  faults_->deleteLater();
  faults_ = nullptr;
  fault_column_ = nullptr;
}

QString FormRowWidget::fault_text() const {
  QStringList all;
  if (faults_)
    for (const QLabel* label : faults_->findChildren<QLabel*>()) all << label->text();
  return all.join('\n');
}

// ---- SchemaForm ----

struct SchemaForm::Entry {
  const ParamSpec* param = nullptr;
  TypeNotes notes;
  std::size_t group = 0;
  FormRowWidget* row = nullptr;  // made when it is first shown
  std::optional<Value> value{};  // until there is a row
  bool is_shown = false;
};
struct SchemaForm::Group {
  std::string name;
  QToolButton* head = nullptr;  // null for fields without a group
  bool is_folded = false;
};

SchemaForm::SchemaForm(FormContextPtr context, Schema schema, std::string prefix, QWidget* parent)
    : QWidget(parent),
      context_(std::move(context)),
      schema_(std::move(schema)),
      prefix_(std::move(prefix)),
      grid_(new QGridLayout(this)),
      general_faults_(new QWidget(this)) {
  const Theme& t = theme();
  setObjectName(qt(context_->title + (prefix_.empty() ? "" : "." + prefix_) + ".form"));
  grid_->setContentsMargins(0, 0, 0, 0);
  grid_->setHorizontalSpacing(t.px(24));
  grid_->setVerticalSpacing(0);
  general_faults_->setObjectName(objectName() + ".faults");
  general_faults_->setAccessibleName("Faults");
  setAccessibleName("Form");
  general_column_ = new QVBoxLayout(general_faults_);
  general_column_->setContentsMargins(0, t.px(4), 0, t.px(4));
  general_faults_->hide();
  // Groups in the order of their first field, fields within one by their order.
  for (const ParamSpec& p : schema_) {
    auto e = std::make_unique<Entry>();
    e->param = &p;
    e->notes = notes_of(p);
    const auto it = std::find_if(groups_.begin(), groups_.end(),
                                 [&](const auto& g) { return g->name == e->notes.group; });
    e->group = static_cast<std::size_t>(it - groups_.begin());
    if (it == groups_.end()) {
      auto g = std::make_unique<Group>();
      g->name = e->notes.group;
      groups_.push_back(std::move(g));
    }
    has_advanced_ = has_advanced_ || e->notes.is_advanced;
    entries_.push_back(std::move(e));
  }
  std::stable_sort(entries_.begin(), entries_.end(), [](const auto& a, const auto& b) {
    return a->group != b->group ? a->group < b->group : a->notes.order < b->notes.order;
  });
  refresh();
}

SchemaForm::~SchemaForm() = default;

SchemaForm::Entry* SchemaForm::entry(std::string_view name) const {
  for (const auto& e : entries_)
    if (e->param->name == name) return e.get();
  return nullptr;
}

void SchemaForm::make_row(Entry& e) {
  const std::string path = prefix_.empty() ? e.param->name : prefix_ + "." + e.param->name;
  e.row = new FormRowWidget(context_, *e.param, path, this);
  e.row->set_is_inner(dynamic_cast<Field*>(parentWidget()) != nullptr);
  if (e.value) e.row->field()->set_value(e.value);
  Entry* entry = &e;
  e.row->field()->on_height = [this] {
    if (columns_ > 1) arrange();
  };
  e.row->field()->on_change = [this, entry](Field::Stage stage) { take(*entry, stage); };
}

void SchemaForm::take(Entry& e, Field::Stage stage) {
  Field* field = e.row->field();
  if (stage != Field::Stage::drag_begun) {
    const QString fault = field->fault();
    e.row->clear_faults();
    if (!fault.isEmpty()) {  // found by the field itself
      field->set_fault(fault);
      e.row->show_fault({e.param->name, fault, {}}, {});
    }
  }
  const std::string path = e.param->name + field->changed_path();
  const std::optional<Value> value = field->changed_value();
  // A drag moves no other fields: rows that come and go would end it.
  if (stage == Field::Stage::changed || stage == Field::Stage::drag_ended ||
      stage == Field::Stage::drag_cancelled)
    refresh();
  if (on_change) on_change(path, value, stage);
}

void SchemaForm::fill(const Map& values) {
  for (const auto& e : entries_) {
    const Value* v = values.find(e->param->name);
    const std::optional<Value> value = v && !v->is_nil() ? std::optional(*v) : std::nullopt;
    e->value = value;
    if (e->row) e->row->field()->set_value(value);
  }
  refresh();
}

void SchemaForm::set(std::string_view name, const std::optional<Value>& value) {
  Entry* e = entry(name);
  if (!e) return;
  e->value = value;
  if (e->row) e->row->field()->set_value(value);
  refresh();
}

Map SchemaForm::values() const {
  Map out;
  for (const ParamSpec& p : schema_) {
    const Entry* e = entry(p.name);
    const std::optional<Value> v = e->row ? e->row->field()->value() : e->value;
    if (v && !v->is_nil()) out.set(p.name, *v);
  }
  return out;
}

Field* SchemaForm::field(std::string_view name) const {
  const Entry* e = entry(name);
  return e && e->row ? e->row->field() : nullptr;
}

FormRowWidget* SchemaForm::row(std::string_view name) const {
  const Entry* e = entry(name);
  return e ? e->row : nullptr;
}

bool SchemaForm::is_shown(std::string_view name) const {
  const Entry* e = entry(name);
  return e && e->is_shown;
}

std::vector<std::string> SchemaForm::shown_names() const {
  std::vector<std::string> out;
  for (const auto& e : entries_)
    if (e->is_shown) out.push_back(e->param->name);
  return out;
}

void SchemaForm::set_baseline(std::optional<Map> values) {
  baseline_ = std::move(values);
  refresh();
}

void SchemaForm::set_columns(int columns) {
  columns_ = std::max(1, columns);
  arrange();
}

void SchemaForm::show_advanced(bool on) {
  shows_advanced_ = on;
  refresh();
}

void SchemaForm::refresh() {
  const Map now = values();
  std::vector<const ParamSpec*> wanted;
  for (const FormRow& row : form_rows(schema_, now)) wanted.push_back(row.param);
  bool is_other = false;
  for (const auto& e : entries_) {
    const bool applies = std::find_if(wanted.begin(), wanted.end(), [&](const ParamSpec* p) {
                           return p->name == e->param->name;
                         }) != wanted.end();
    const bool is_given = now.find(e->param->name) != nullptr;
    const bool shows = applies && (!e->notes.is_advanced || shows_advanced_ || is_given) &&
                       !(groups_[e->group]->is_folded);
    if (shows && !e->row) make_row(*e);
    is_other = is_other || shows != e->is_shown || (shows && e->row && e->row->parent() != this);
    e->is_shown = shows;
    if (e->row) {
      if (baseline_) {
        const Value* a = baseline_->find(e->param->name);
        const Value* b = now.find(e->param->name);
        e->row->set_changed((a == nullptr) != (b == nullptr) || (a && b && !(*a == *b)));
      }
      const QString source = e->row->field()->source();
      if (e->param->required && !is_given && source.isEmpty())
        e->row->field()->set_source("required");
      if (is_given && source == "required") e->row->field()->set_source({});
    }
  }
  if (is_other || grid_->count() == 0) arrange();
}

void SchemaForm::arrange() {
  while (grid_->count() > 0) delete grid_->takeAt(0);
  // As advanced fields count those that would be shown.
  int hidden = 0;
  for (const auto& e : entries_)
    if (e->notes.is_advanced && !e->is_shown && !groups_[e->group]->is_folded) ++hidden;
  int line = 0, column = 0;
  const auto next_line = [&] {
    if (column > 0) ++line;
    column = 0;
  };
  std::size_t group = groups_.size();
  QWidget* last = nullptr;
  for (const auto& e : entries_) {
    if (e->group != group) {
      group = e->group;
      Group& g = *groups_[group];
      next_line();
      if (!g.name.empty()) {
        if (!g.head) {
          g.head = new QToolButton(this);
          g.head->setObjectName(objectName() + ".group." + qt(g.name));
          g.head->setText(readable(g.name));
          g.head->setAccessibleName(g.head->text());
          g.head->setToolTip("Fold or unfold these fields");
          g.head->setToolButtonStyle(Qt::ToolButtonTextBesideIcon);
          use_font(*g.head, &Theme::ui, true);
          QObject::connect(g.head, &QToolButton::clicked, this, [this, group] {
            groups_[group]->is_folded = !groups_[group]->is_folded;
            refresh();
            arrange();
          });
        }
        g.head->setIcon(icon(g.is_folded ? "chevron_right" : "chevron_down"));
        grid_->addWidget(g.head, line++, 0, 1, columns_, Qt::AlignLeft);
        g.head->show();
      }
    }
    if (!e->row) continue;
    e->row->setVisible(e->is_shown);
    if (!e->is_shown) continue;
    const bool is_wide = columns_ > 1 && e->row->field()->is_tall();
    if (is_wide) next_line();
    grid_->addWidget(e->row, line, column, 1, is_wide ? columns_ : 1);
    if (last) QWidget::setTabOrder(last, e->row->field());
    last = e->row->field();
    column += is_wide ? columns_ : 1;
    if (column >= columns_) next_line();
  }
  next_line();
  // A group without any field that applies has no heading.
  for (std::size_t i = 0; i < groups_.size(); ++i) {
    if (!groups_[i]->head || groups_[i]->is_folded) continue;
    const bool has_any = std::any_of(entries_.begin(), entries_.end(),
                                     [i](const auto& e) { return e->group == i && e->is_shown; });
    groups_[i]->head->setVisible(has_any);
  }
  if (has_advanced_ && (hidden > 0 || shows_advanced_)) {
    if (!more_) {
      more_ = new QPushButton(this);
      more_->setProperty("link", true);
      more_->setObjectName(objectName() + ".more");
      QObject::connect(more_, &QPushButton::clicked, this,
                       [this] { show_advanced(!shows_advanced_); });
    }
    more_->setText(shows_advanced_ ? QString("Fewer") : QString("%1 more").arg(hidden));
    more_->setToolTip(shows_advanced_ ? "Hide fields that are seldom needed"
                                      : "Show fields that are seldom needed");
    more_->setAccessibleName(more_->toolTip());
    grid_->addWidget(more_, line++, 0, 1, columns_, Qt::AlignLeft);
    more_->show();
  } else if (more_) {
    more_->hide();
  }
  grid_->addWidget(general_faults_, line++, 0, 1, columns_);
  for (int c = 0; c < 4; ++c) grid_->setColumnStretch(c, c < columns_ ? 1 : 0);
  updateGeometry();
}

bool SchemaForm::show_faults(const std::vector<ShownFault>& faults) {
  bool all = true;
  for (const ShownFault& fault : faults) {
    const std::size_t end = std::min(fault.path.find('.'), fault.path.find('['));
    const std::string name = fault.path.substr(0, end);
    Entry* e = name.empty() ? nullptr : entry(name);
    if (e && !e->is_shown) {
      // It is brought into view.
      groups_[e->group]->is_folded = false;
      if (e->notes.is_advanced) shows_advanced_ = true;
      refresh();
      if (!e->row) make_row(*e);
      e->is_shown = true;
      arrange();
    }
    if (!e) {
      all = false;
      general_column_->addWidget(
          fault_box(fault, on_remedy,
                    general_faults_->objectName() + QString::number(general_column_->count() + 1),
                    general_faults_));
      general_faults_->show();
      continue;
    }
    const std::string rest = end == std::string::npos ? std::string() : fault.path.substr(end);
    (void)e->row->field()->place_fault(rest, fault.sentence);
    e->row->show_fault(fault, on_remedy);
  }
  return all;
}

void SchemaForm::clear_faults() {
  for (const auto& e : entries_)
    if (e->row) e->row->clear_faults();
  while (general_column_->count() > 0) {
    QLayoutItem* item = general_column_->takeAt(0);
    if (QWidget* w = item->widget()) {
      w->hide();
      w->deleteLater();
    }
    delete item;
  }
  general_faults_->hide();
}

}  // namespace robomosp::viewer
