// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/forms/record_sections.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

#include <QGridLayout>
#include <QHBoxLayout>
#include <QLabel>
#include <QPushButton>
#include <QToolButton>
#include <QVBoxLayout>

#include "kernel/type.h"
#include "kernel/units.h"
#include "viewer/forms/field_buttons.h"
#include "viewer/forms/form_context.h"
#include "viewer/theme/icons.h"
#include "viewer/theme/theme.h"
#include "viewer/widgets/gauge.h"
#include "viewer/widgets/number_fields.h"

namespace robomosp::viewer {
namespace {

constexpr std::size_t kMostUsers = 24;

std::string word_of(const Map& m, const char* name) {
  const Value* v = m.find(name);
  return v && v->as_string() ? *v->as_string() : std::string();
}

QLabel* section_label(QWidget* parent, const QString& words, const QString& name,
                      const char* property) {
  auto* l = new QLabel(words, parent);
  l->setObjectName(name);
  l->setAccessibleName(words.isEmpty() ? name : words);
  l->setToolTip(l->accessibleName());
  if (property) l->setProperty(property, true);
  return l;
}

}  // namespace

// ---- RecordSection ----

RecordSection::RecordSection(ioci::Client& client, const QString& title, const QString& name,
                             QWidget* parent)
    : QWidget(parent), client_(client) {
  setObjectName(name);
  setAccessibleName(title);
  auto* outer = new QVBoxLayout(this);
  auto* top = new QHBoxLayout;
  head_ = new QToolButton(this);
  head_->setObjectName(name + ".head");
  head_->setText(title);
  head_->setAccessibleName(title);
  head_->setToolTip("Fold or unfold this section");
  head_->setToolButtonStyle(Qt::ToolButtonTextBesideIcon);
  head_->setIcon(icon("chevron_down"));
  use_font(*head_, &Theme::ui, true);
  note_ = section_label(this, {}, name + ".note", "quiet");
  note_->setAlignment(Qt::AlignRight | Qt::AlignVCenter);
  top->addWidget(head_);
  top->addWidget(note_, 1);
  outer->addLayout(top);
  content_ = new QWidget(this);
  content_->setObjectName(name + ".content");
  content_->setAccessibleName(title);
  column_ = new QVBoxLayout(content_);
  column_->setContentsMargins(0, 0, 0, 0);
  column_->setSpacing(0);
  outer->addWidget(content_);
  QObject::connect(head_, &QToolButton::clicked, this, [this] {
    content_->setVisible(content_->isHidden());
    head_->setIcon(icon(content_->isHidden() ? "chevron_right" : "chevron_down"));
  });
  RecordSection::apply_theme();
}

void RecordSection::apply_theme() {
  layout()->setContentsMargins(0, theme().px(8), 0, 0);
  layout()->setSpacing(theme().px(2));
}

void RecordSection::changeEvent(QEvent* event) {
  if (std::exchange(themed_, theme_revision()) != theme_revision()) apply_theme();
  QWidget::changeEvent(event);
}

void RecordSection::refresh() {
  if (is_asking_) {
    is_wanted_ = true;
    return;
  }
  is_asking_ = true;
  ask_values();
}

void RecordSection::finished() {
  is_asking_ = false;
  if (on_shown) on_shown();
  if (std::exchange(is_wanted_, false)) refresh();
}

void RecordSection::set_note(const QString& note) {
  note_->setText(note);
  note_->setAccessibleName(note.isEmpty() ? accessibleName() : note);
}

// ---- MassSection ----

MassSection::MassSection(ioci::Client& client, Handle record, const QString& name, QWidget* parent)
    : RecordSection(client, "Mass", "properties.mass", parent), record_(std::move(record)) {
  set_note("of " + name);
  grid_ = new QGridLayout;
  grid_->setVerticalSpacing(0);
  grid_->setColumnStretch(2, 1);
  column_->addLayout(grid_);
  fault_ = section_label(this, {}, "properties.mass.fault", "fault");
  fault_->setWordWrap(true);
  fault_->hide();
  column_->addWidget(fault_);
  const struct {
    const char *label, *name, *unit;
    double factor;
    int index;
  } all[] = {{"Mass", "mass", "kg", 1, -1},
             {"Volume", "volume", "cm³", 1e6, -1},
             {"Surface", "area", "cm²", 1e4, -1},
             {"Centre x", "com", "mm", 1e3, 0},
             {"Centre y", "com", "mm", 1e3, 1},
             {"Centre z", "com", "mm", 1e3, 2},
             {"Principal I₁", "principal_moments", "kg m²", 1, 0},
             {"I₂", "principal_moments", "kg m²", 1, 1},
             {"I₃", "principal_moments", "kg m²", 1, 2}};
  int line = 0;
  for (const auto& each : all) {
    const QString at = QString("properties.mass.%1").arg(line + 1);
    Row row{each.name, each.unit, each.factor, each.index, nullptr,
            nullptr,   nullptr,   nullptr,     {},         {}};
    row.label = section_label(this, each.label, at + ".label", "dim");
    row.before = section_label(this, {}, at + ".before", "quiet");
    row.now = section_label(this, {}, at, nullptr);
    row.change = section_label(this, {}, at + ".change", "dim");
    for (QLabel* l : {row.before, row.now}) {
      use_font(*l, &Theme::mono);
      l->setAlignment(Qt::AlignRight | Qt::AlignVCenter);
      l->setTextInteractionFlags(Qt::TextSelectableByMouse);
      l->setFocusPolicy(Qt::NoFocus);
    }
    row.change->setAlignment(Qt::AlignRight | Qt::AlignVCenter);
    grid_->addWidget(row.label, line, 0);
    grid_->addWidget(row.before, line, 1);
    grid_->addWidget(row.now, line, 2);
    grid_->addWidget(row.change, line, 3);
    rows_.push_back(row);
    ++line;
  }
  MassSection::apply_theme();
  refresh();
}

void MassSection::apply_theme() {
  RecordSection::apply_theme();
  grid_->setContentsMargins(theme().px(4), 0, 0, 0);
  grid_->setHorizontalSpacing(theme().px(6));
  for (const Row& row : rows_) row.label->setFixedHeight(theme().px(20));
}

std::optional<double> MassSection::mass() const { return rows_.front().value; }

void MassSection::keep_as_before() {
  for (Row& row : rows_) row.first = row.value;
}

void MassSection::ask_values() {
  ask(client_, record_.kind + ".mass", Map{{"id", record_}}, this, [this](const Result<Value>& r) {
    const Map* m = r.ok() ? r->as_map() : nullptr;
    fault_->setVisible(!r.ok());
    if (m) show_values(*m);
    else if (!r.ok()) fault_->setText(qt(r.error().sentence()));
    finished();
  });
}

void MassSection::show_values(const Map& values) {
  for (Row& row : rows_) {
    const Value* v = values.find(row.name);
    row.value.reset();
    if (v && row.index < 0 && v->is_number()) row.value = v->number();
    if (v && row.index >= 0)
      if (const auto parts = elements_of(*v); static_cast<std::size_t>(row.index) < parts.size())
        row.value = parts[static_cast<std::size_t>(row.index)].number();
    // Rounding of an integral about a plane of symmetry.
    constexpr double kNoise = 1e-12;
    if (row.value && std::fabs(*row.value) < kNoise) row.value = 0;
    const auto text = [&](double si) { return QString::number(si * row.factor, 'g', 5); };
    const auto shown = [&](double si) { return text(si).replace('-', QChar(0x2212)); };
    if (!row.first) row.first = row.value;
    row.now->setText(row.value ? shown(*row.value) + " " + qt(row.unit) : QString("unknown"));
    row.now->setAccessibleName(row.label->text() + " " + row.now->text());
    // Rounding of an integral is no change.
    const double scale = row.first ? std::max(std::fabs(*row.first), 1e-12) : 1;
    const bool is_other = row.first && row.value &&
                          std::fabs(*row.value - *row.first) > 1e-6 * scale &&
                          text(*row.value) != text(*row.first);
    row.before->setText(is_other ? shown(*row.first) + " →" : QString());
    const double percent = is_other ? (*row.value - *row.first) / *row.first * 100 : 0;
    constexpr double kMostPercent = 9999;
    const bool has_percent =
        is_other && std::fabs(*row.first * row.factor) > 1e-6 && std::fabs(percent) < kMostPercent;
    row.change->setText(has_percent ? QString("%1%2 %")
                                          .arg(percent < 0 ? QString(QChar(0x2212)) : QString("+"))
                                          .arg(std::fabs(percent), 0, 'g', 3)
                                    : QString());
    row.change->setStyleSheet(QString("color: %1;").arg(theme().warn.name()));
  }
}

// ---- UsersSection ----

UsersSection::UsersSection(ioci::Client& client, Handle record, QWidget* parent)
    : RecordSection(client, "Used by", "properties.users", parent), record_(std::move(record)) {
  hide();
  refresh();
}

void UsersSection::ask_values() {
  ask(client_, "document.referrers", Map{{"record", record_}}, this,
      [this](const Result<Value>& r) {
        show_users(r.ok() && r->as_list() ? *r->as_list() : List());
        finished();
      });
}

void UsersSection::show_users(const List& users) {
  setVisible(!users.empty());
  if (users == shown_) return;
  shown_ = users;
  for (QWidget* w : links_) {
    w->hide();
    w->deleteLater();
  }
  links_.clear();
  set_note(users.size() == 1 ? QString("1 record") : QString("%1 records").arg(users.size()));
  for (std::size_t i = 0; i < std::min(users.size(), kMostUsers); ++i) {
    const Handle* h = users[i].as_handle();
    if (!h) continue;
    QPushButton* link = link_button(this, qt(h->kind), "Select this record",
                                    QString("properties.users.%1").arg(i + 1));
    link->setIcon(icon(icon_of_kind(h->kind)));
    QObject::connect(link, &QPushButton::clicked, this, [this, handle = *h] {
      if (on_go) on_go(handle);
    });
    ask(client_, "record.describe", Map{{"id", *h}}, link, [link](const Result<Value>& r) {
      const Map* m = r.ok() ? r->as_map() : nullptr;
      if (!m) return;
      link->setText(qt(word_of(*m, "name")));
      link->setAccessibleName(qt(word_of(*m, "kind") + " " + word_of(*m, "name")));
      link->setToolTip(link->accessibleName() + ": select it");
    });
    column_->addWidget(link, 0, Qt::AlignLeft);
    links_.push_back(link);
  }
  if (users.size() > kMostUsers) {
    QLabel* rest = section_label(this, QString("and %1 more").arg(users.size() - kMostUsers),
                                 "properties.users.rest", "quiet");
    column_->addWidget(rest);
    links_.push_back(rest);
  }
}

// ---- SegmentSection ----

SegmentSection::SegmentSection(ioci::Client& client, Handle trajectory, std::string name,
                               int segment, QWidget* parent)
    : RecordSection(client, "Largest on this segment", "properties.segment", parent),
      trajectory_(std::move(trajectory)),
      name_(std::move(name)),
      segment_(segment) {
  set_note("of the limit");
  sentence_ = section_label(this, {}, "properties.segment.sentence", "quiet");
  sentence_->setWordWrap(true);
  column_->addWidget(sentence_);
  refresh();
}

void SegmentSection::say(const QString& sentence) {
  for (Gauge* g : gauges_) g->hide();
  sentence_->setText(sentence);
  sentence_->setAccessibleName(sentence);
  sentence_->show();
  finished();
}

void SegmentSection::ask_values() {
  ask(client_, "trajectory.segments", Map{{"id", trajectory_}}, this,
      [this](const Result<Value>& r) {
        if (!r.ok() || !r->as_list()) return say(r.ok() ? QString() : qt(r.error().sentence()));
        for (const Value& each : *r->as_list()) {
          const Map* m = each.as_map();
          const Value* number = m ? m->find("number") : nullptr;
          const Value *start = m ? m->find("start") : nullptr,
                      *duration = m ? m->find("duration") : nullptr;
          if (!number || number->number() != segment_ || word_of(*m, "kind") == "transition")
            continue;
          if (!start || !duration)
            return say("The times of this segment depend on a robot; run the trajectory.");
          from_ = start->number();
          to_ = from_ + duration->number();
          return ask_recording();
        }
        say("The trajectory has no such segment.");
      });
}

void SegmentSection::ask_recording() {
  ask(client_, "recording.list", {}, this, [this](const Result<Value>& r) {
    const List* all = r.ok() ? r->as_list() : nullptr;
    const Map* newest = nullptr;
    for (std::size_t i = 0; all && i < all->size(); ++i)
      if (const Map* m = (*all)[i].as_map(); m && word_of(*m, "trajectory") == name_) newest = m;
    const Value* handle = newest ? newest->find("recording") : nullptr;
    if (!handle || !handle->as_handle())
      return say("No recording of this trajectory. Run it to see how near its limits it comes.");
    const Value* stale = newest->find("stale");
    set_note(stale && stale->as_bool() && *stale->as_bool() ? "of the limit, out of date"
                                                            : "of the limit");
    ask_summary(*handle->as_handle());
  });
}

void SegmentSection::ask_summary(const Handle& recording) {
  ask(client_, "recording.summary",
      Map{{"id", recording}, {"approach", false}, {"from", from_}, {"to", to_}}, this,
      [this](const Result<Value>& r) {
        if (!r.ok() || !r->as_list()) return say(r.ok() ? QString() : qt(r.error().sentence()));
        show_summary(*r->as_list());
      });
}

void SegmentSection::show_summary(const List& columns) {
  const struct {
    const char *prefix, *label;
  } groups[] = {{"qd", "Joint speed"},
                {"qdd", "Joint acceleration"},
                {"q", "Joint position"},
                {"tau", "Torque"},
                {"speed", "Tool speed"}};
  std::size_t used = 0;
  QStringList unknown;
  for (const auto& group : groups) {
    const Map* worst = nullptr;
    double share = -1;
    bool has_any = false;
    for (const Value& each : columns) {
      const Map* m = each.as_map();
      if (!m) continue;
      std::string name = word_of(*m, "name");
      const auto digits = name.find_last_not_of("0123456789");
      if (digits == std::string::npos || name.substr(0, digits + 1) != group.prefix) continue;
      has_any = true;
      const Value* s = m->find("share");
      if (!s || s->number() <= share) continue;
      share = s->number();
      worst = m;
    }
    if (!has_any) continue;
    if (!worst) {
      unknown << QString(group.label).toLower();
      continue;
    }
    if (gauges_.size() <= used) {
      auto* g = new Gauge(this);
      g->setObjectName(QString("properties.segment.gauge%1").arg(used + 1));
      column_->addWidget(g);
      gauges_.push_back(g);
    }
    Gauge* g = gauges_[used++];
    const std::string name = word_of(*worst, "name"), unit = word_of(*worst, "unit");
    const Value* value = worst->find("at_share");
    const std::string shown_name(shown_unit_of(unit));
    const auto shown = units::parse(shown_name);
    const double number = value ? value->number() : 0;
    g->set_label(group.label);
    g->set_share(share);
    g->set_text("joint " + qt(name.substr(name.find_last_not_of("0123456789") + 1)) + ", " +
                number_text(std::strtod(
                    QString::number(shown.ok() ? units::from_si(number, *shown) : number, 'g', 4)
                        .toLatin1()
                        .constData(),
                    nullptr)) +
                (unit_text(shown_name).startsWith("°") ? "" : " ") + unit_text(shown_name));
    g->setAccessibleName(group.label);
    g->setToolTip(qt(word_of(*worst, "doc")) + "\nrecording.summary{from = , to = }");
    g->show();
  }
  for (std::size_t i = used; i < gauges_.size(); ++i) gauges_[i]->hide();
  sentence_->setVisible(!unknown.isEmpty() || used == 0);
  sentence_->setText(unknown.isEmpty() ? QString("The recording has no limits.")
                                       : "No limit is known: " + unknown.join(", ") + ".");
  sentence_->setAccessibleName(sentence_->text());
  finished();
}

}  // namespace robomosp::viewer
