// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/forms/schema_form.h"

#include <algorithm>

#include <QApplication>
#include <QClipboard>
#include <QContextMenuEvent>
#include <QElapsedTimer>
#include <QGridLayout>
#include <QHBoxLayout>
#include <QLabel>
#include <QMenu>
#include <QPushButton>
#include <QToolButton>
#include <QVBoxLayout>

#include "kernel/literal.h"
#include "kernel/type.h"
#include "kernel/type_forms.h"
#include "viewer/forms/composite_fields.h"
#include "viewer/forms/field_factory.h"
#include "viewer/theme/icons.h"
#include "viewer/theme/theme.h"
#include "viewer/widgets/elided.h"

namespace robomosp::viewer {
namespace {

void add_stops(QWidget* w, std::vector<QWidget*>& out);

void add_stops_of(QLayout* layout, std::vector<QWidget*>& out) {
  for (int i = 0; i < layout->count(); ++i) {
    QLayoutItem* item = layout->itemAt(i);
    if (item->widget()) add_stops(item->widget(), out);
    else if (item->layout()) add_stops_of(item->layout(), out);
  }
}

/// The widgets within one that the Tab key reaches, in the order of the layout.
void add_stops(QWidget* w, std::vector<QWidget*>& out) {
  if ((w->focusPolicy() & Qt::TabFocus) && !w->focusProxy()) out.push_back(w);
  if (w->layout()) return add_stops_of(w->layout(), out);
  for (QObject* child : w->children())
    if (auto* part = qobject_cast<QWidget*>(child); part && !part->isWindow()) add_stops(part, out);
}

/// Makes the Tab key follow the order of reading.
void order_stops(QWidget& form) {
  std::vector<QWidget*> stops;
  add_stops(&form, stops);
  for (std::size_t i = 1; i < stops.size(); ++i) QWidget::setTabOrder(stops[i - 1], stops[i]);
}

}  // namespace

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
  rest_.setSingleShot(true);
  rest_.setInterval(0);
  QObject::connect(&rest_, &QTimer::timeout, this, [this] { make_rows(); });
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
    else order_stops(*this);
  };
  e.row->field()->on_change = [this, entry](Field::Stage stage) { take(*entry, stage); };
  e.row->on_default = [this, entry] {
    entry->row->clear_faults();
    entry->row->field()->set_value(std::nullopt);
    refresh();
    if (on_change) on_change(entry->param->name, std::nullopt, Field::Stage::changed);
  };
  if (baseline_) mark_row(e, values());
}

void SchemaForm::mark_row(Entry& e, const Map& now) {
  if (!baseline_) return;
  const Value* a = baseline_->find(e.param->name);
  const Value* b = now.find(e.param->name);
  e.row->set_changed((a == nullptr) != (b == nullptr) || (a && b && !(*a == *b)));
  e.row->on_saved = [this, entry = &e] {
    if (!baseline_) return;
    const Value* saved = baseline_->find(entry->param->name);
    const auto value = saved ? std::optional(*saved) : std::nullopt;
    entry->row->clear_faults();
    entry->row->field()->set_value(value);
    refresh();
    if (on_change) on_change(entry->param->name, value, Field::Stage::changed);
  };
}

void SchemaForm::make_rows() {
  // The rest follows when the window has taken its other events.
  QElapsedTimer clock;
  clock.start();
  bool has_made = false;
  for (const auto& e : entries_) {
    if (!e->is_shown || e->row) continue;
    if (has_made && clock.elapsed() >= slice_ms) {
      rest_.start();
      break;
    }
    make_row(*e);
    mark_required(*e);
    has_made = true;
  }
  if (!has_made) return;
  arrange();
  if (on_grown) on_grown();
}

bool SchemaForm::is_complete() const {
  return std::all_of(entries_.begin(), entries_.end(),
                     [](const auto& e) { return !e->is_shown || e->row; });
}

void SchemaForm::take(Entry& e, Field::Stage stage) {
  Field* field = e.row->field();
  if (stage != Field::Stage::drag_begun) {
    // Those that the field found itself stay.
    const auto found = field->shown_faults();
    e.row->clear_faults();
    for (const PartFault& each : found) {
      (void)field->place_fault(each.path, each.sentence);
      if (!field->shows_sentence(each.path))
        e.row->show_fault({e.param->name + each.path, each.sentence, {}}, {});
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
  FormRowWidget* made = row(name);
  return made ? made->field() : nullptr;
}

FormRowWidget* SchemaForm::row(std::string_view name) const {
  Entry* e = entry(name);
  if (e && e->is_shown && !e->row) {
    auto* self = const_cast<SchemaForm*>(this);  // only the time at which it is made differs
    self->make_row(*e);
    self->arrange();
  }
  return e ? e->row : nullptr;
}

std::vector<PartFault> SchemaForm::field_faults() const {
  std::vector<PartFault> out;
  for (const auto& e : entries_)
    if (e->row && e->is_shown)
      for (PartFault& each : e->row->field()->shown_faults())
        out.push_back({e->param->name + each.path, std::move(each.sentence)});
  return out;
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
    is_other = is_other || shows != e->is_shown || (shows && e->row && e->row->parent() != this);
    e->is_shown = shows;
    if (e->row) {
      mark_row(*e, now);
      mark_required(*e);
    }
  }
  if (is_other || grid_->count() == 0) arrange();
  if (!rest_.isActive()) make_rows();  // otherwise they follow
}

void SchemaForm::mark_required(Entry& e) {
  Field* field = e.row->field();
  const auto value = field->value();
  const bool is_given = value && !value->is_nil();
  if (e.param->required && !is_given && field->source().isEmpty()) field->set_source("required");
  if (is_given && field->source() == "required") field->set_source({});
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
  for (const auto& e : entries_) {
    if (e->group != group) {
      group = e->group;
      Group& g = *groups_[group];
      next_line();
      if (!g.name.empty()) {
        if (!g.head) {
          g.head = new ElidedToolButton(this);
          g.head->setSizePolicy(QSizePolicy::Preferred, QSizePolicy::Fixed);
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
  order_stops(*this);
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
    if (!e->row) {  // one that is shown and follows
      make_row(*e);
      arrange();
    }
    const std::string rest = end == std::string::npos ? std::string() : fault.path.substr(end);
    (void)e->row->field()->place_fault(rest, fault.sentence);
    // Fields with forms write it below the row of the part, but without remedies.
    if (!fault.remedies.empty() || !e->row->field()->shows_sentence(rest))
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
