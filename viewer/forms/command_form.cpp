// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/forms/command_form.h"

#include <algorithm>

#include <QApplication>
#include <QCheckBox>
#include <QClipboard>
#include <QElapsedTimer>
#include <QHBoxLayout>
#include <QKeyEvent>
#include <QLabel>
#include <QPushButton>
#include <QVBoxLayout>

#include "ioci/client/call_text.h"
#include "kernel/argument_faults.h"
#include "kernel/type_forms.h"
#include "viewer/forms/result_view.h"
#include "viewer/forms/schema_form.h"
#include "viewer/theme/icons.h"
#include "viewer/theme/theme.h"

namespace robomosp::viewer {
namespace {

constexpr int kPreviewDelay = 150;  // [ms]

std::string word(const Map& m, const char* name) {
  const Value* v = m.find(name);
  return v && v->as_string() ? *v->as_string() : std::string();
}

bool has_word(const Map& m, const char* list_name, const char* wanted) {
  const Value* v = m.find(list_name);
  if (!v || !v->as_list()) return false;
  return std::any_of(v->as_list()->begin(), v->as_list()->end(), [wanted](const Value& e) {
    return e.as_string() && *e.as_string() == wanted;
  });
}

/// What a command does besides returning a value, as a few words.
QString effect_words(const Map& d) {
  QStringList does;
  if (has_word(d, "effects", "edits")) does << "edits the document, one step";
  if (has_word(d, "effects", "simulates")) does << "makes a recording";
  if (has_word(d, "effects", "files_write")) does << "writes files";
  if (has_word(d, "effects", "files_read")) does << "reads files";
  if (has_word(d, "effects", "processes")) does << "starts programs";
  if (has_word(d, "effects", "providers")) does << "changes solvers";
  if (has_word(d, "effects", "loads_code")) does << "loads code";
  if (has_word(d, "effects", "administers")) does << "gives access to others";
  if (has_word(d, "effects", "stops")) does << "ends the program";
  if (!has_word(d, "effects", "edits")) {
    if (has_word(d, "sometimes", "edits")) does << "may edit the document";
    else does.prepend("changes nothing");
  }
  return does.join(", ");
}

QPushButton* text_button(QWidget* parent, const QString& text, const QString& tip,
                         const QString& name, const char* property = nullptr) {
  auto* b = new QPushButton(text, parent);
  b->setObjectName(name);
  b->setAccessibleName(text);
  b->setToolTip(tip);
  if (property) b->setProperty(property, true);
  return b;
}

QLabel* named_label(QWidget* parent, const QString& name, const QString& accessible,
                    const char* property = nullptr) {
  auto* l = new QLabel(parent);
  l->setObjectName(name);
  l->setAccessibleName(accessible);
  l->setToolTip(accessible);
  if (property) l->setProperty(property, true);
  return l;
}

}  // namespace

CommandForm::CommandForm(ioci::Client& client, QWidget* parent) : QWidget(parent), client_(client) {
  const Theme& t = theme();
  setObjectName("command_form");
  setAccessibleName("Form of a command");
  auto* column = new QVBoxLayout(this);
  column->setContentsMargins(0, 0, 0, 0);
  column->setSpacing(0);
  body_ = new QWidget(this);
  body_->setObjectName("command_form.body");
  body_->setAccessibleName("Arguments");
  body_column_ = new QVBoxLayout(body_);
  body_column_->setContentsMargins(t.px(12), t.px(8), t.px(12), t.px(8));
  body_column_->setSpacing(t.px(6));
  auto* head = new QHBoxLayout;
  head->setSpacing(t.px(8));
  name_ = named_label(body_, "command_form.name", "Name of the command");
  use_font(*name_, &Theme::menu, true);
  summary_ = named_label(body_, "command_form.summary", "What the command does", "dim");
  summary_->setSizePolicy(QSizePolicy::Ignored, QSizePolicy::Preferred);
  help_ =
      text_button(body_, "Help", "Open the page of this command (F1)", "command_form.help", "link");
  head->addWidget(name_);
  head->addWidget(summary_, 1);
  head->addWidget(help_);
  body_column_->addLayout(head);
  details_ = named_label(body_, "command_form.details", "More about the command", "quiet");
  details_->setWordWrap(true);
  details_->hide();
  body_column_->addWidget(details_);
  column->addWidget(body_);

  body_->setSizePolicy(QSizePolicy::Preferred, QSizePolicy::Maximum);
  auto* lua_row = new QWidget(this);
  lua_row->setObjectName("command_form.lua_row");
  lua_row->setAccessibleName("The call as Lua");
  lua_row->setSizePolicy(QSizePolicy::Preferred, QSizePolicy::Maximum);
  lua_row->setProperty("ground", "field");
  lua_row->setAttribute(Qt::WA_StyledBackground);
  auto* lua_layout = new QHBoxLayout(lua_row);
  lua_layout->setContentsMargins(t.px(12), t.px(8), t.px(8), t.px(8));
  lua_ = named_label(lua_row, "command_form.lua", "The call as Lua");
  use_font(*lua_, &Theme::code);
  lua_->setWordWrap(true);
  lua_->setTextFormat(Qt::RichText);
  lua_->setTextInteractionFlags(Qt::TextSelectableByMouse);
  copy_ = text_button(lua_row, {}, "Copy the line", "command_form.copy", "link");
  copy_->setAccessibleName("Copy the line");
  copy_->setIcon(icon("copy"));
  lua_layout->addWidget(lua_, 1);
  lua_layout->addWidget(copy_, 0, Qt::AlignTop);
  column->addWidget(lua_row);

  foot_ = new QWidget(this);
  foot_->setObjectName("command_form.foot");
  foot_->setAccessibleName("Running the command");
  foot_->setSizePolicy(QSizePolicy::Preferred, QSizePolicy::Maximum);
  auto* foot = new QHBoxLayout(foot_);
  foot->setContentsMargins(t.px(12), t.px(8), t.px(12), t.px(8));
  foot->setSpacing(t.px(8));
  run_ = text_button(foot_, "Run", "Run the command (Ctrl+Enter)", "command_form.run", "filled");
  job_ = text_button(foot_, "Run as a job", "Run it beside other work; it is listed among the jobs",
                     "command_form.run_as_job");
  cancel_ = text_button(foot_, "Cancel", "Stop the command", "command_form.cancel");
  cancel_->hide();
  preview_ = new QCheckBox("Preview", foot_);
  preview_->setObjectName("command_form.preview");
  preview_->setAccessibleName("Preview");
  preview_->setToolTip("Show what the command would change, without changing it");
  macro_ =
      text_button(foot_, "Add to macro", "Add the line to the macro", "command_form.macro", "link");
  macro_->hide();
  effect_ = named_label(foot_, "command_form.effect", "Effect of the command", "quiet");
  effect_->setAlignment(Qt::AlignRight | Qt::AlignVCenter);
  effect_->setWordWrap(true);
  effect_->setSizePolicy(QSizePolicy::Ignored, QSizePolicy::Preferred);
  foot->addWidget(run_);
  foot->addWidget(job_);
  foot->addWidget(cancel_);
  foot->addWidget(preview_);
  foot->addWidget(macro_);
  foot->addWidget(effect_, 1);
  column->addWidget(foot_);

  outcome_ = named_label(this, "command_form.outcome", "Outcome", "dim");
  outcome_->setWordWrap(true);
  outcome_->setContentsMargins(t.px(12), 0, t.px(12), t.px(8));
  show_ = text_button(this, {}, "Show the result", "command_form.show_result", "link");
  show_->setAccessibleName("Show the result");
  show_->hide();
  outcome_->setTextInteractionFlags(Qt::TextSelectableByMouse);
  outcome_->setSizePolicy(QSizePolicy::Preferred, QSizePolicy::Maximum);
  outcome_->hide();
  auto* outcome_row = new QHBoxLayout;
  outcome_row->setContentsMargins(0, 0, t.px(8), 0);
  outcome_row->addWidget(outcome_, 1);
  outcome_row->addWidget(show_, 0, Qt::AlignTop);
  column->addLayout(outcome_row);
  QObject::connect(show_, &QPushButton::clicked, this, [this] {
    if (on_show && made_.number != 0) on_show(made_);
  });
  result_ = new ResultView(client_, this);
  result_->hide();
  column->addWidget(result_, 1);
  column->addStretch(0);

  QObject::connect(run_, &QPushButton::clicked, this, [this] { run(false); });
  QObject::connect(job_, &QPushButton::clicked, this, [this] { run(true); });
  QObject::connect(cancel_, &QPushButton::clicked, this, [this] { cancel(); });
  QObject::connect(help_, &QPushButton::clicked, this, [this] {
    if (on_help) on_help(command_);
    else details_->setVisible(!details_->isVisibleTo(this) && !details_->text().isEmpty());
  });
  QObject::connect(copy_, &QPushButton::clicked, this,
                   [this] { QApplication::clipboard()->setText(line_); });
  QObject::connect(macro_, &QPushButton::clicked, this, [this] {
    if (on_macro) on_macro(line_);
  });
  QObject::connect(preview_, &QCheckBox::toggled, this, [this](bool on) { preview(on); });
  preview_timer_.setSingleShot(true);
  preview_timer_.setInterval(kPreviewDelay);
  QObject::connect(&preview_timer_, &QTimer::timeout, this, [this] { start_preview(); });
}

CommandForm::~CommandForm() { cancel(); }

void CommandForm::showEvent(QShowEvent* event) {
  macro_->setVisible(static_cast<bool>(on_macro));
  QWidget::showEvent(event);
}

void CommandForm::changeEvent(QEvent* event) {
  if (event->type() == QEvent::StyleChange && form_) {
    show_line({});
    show_outcome(outcome_->text(), outcome_kind_);
  }
  QWidget::changeEvent(event);
}

void CommandForm::set_columns(int columns) {
  columns_ = columns;
  if (form_) form_->set_columns(columns);
}

void CommandForm::set_pose_sources(
    std::function<void(std::function<void(const Value&)>)> of_selection,
    std::function<void(std::function<void(const Value&)>)> of_view) {
  pose_of_selection_ = std::move(of_selection);
  pose_of_view_ = std::move(of_view);
}

void CommandForm::open(const std::string& command, const Map& values,
                       const std::map<std::string, QString>& sources) {
  const int number = ++asked_;
  ask(client_, "ioci.describe", Map{{"command", command}}, this,
      [this, number, values, sources](const Result<Value>& r) {
        if (number != asked_) return;
        if (!r.ok()) return show_outcome(qt(r.error().sentence()), "fault");
        const List* list = r->as_list();
        if (list && !list->empty() && list->front().as_map())
          open_described(*list->front().as_map(), values, sources);
      });
}

void CommandForm::open_described(const Map& description, const Map& values,
                                 const std::map<std::string, QString>& sources) {
  ++asked_;
  ++runs_;
  is_running_ = false;
  description_ = description;
  command_ = word(description, "name");
  auto schema =
      schema_from_values(description.find("params") ? *description.find("params") : Value());
  if (!schema.ok()) return show_outcome(qt(schema.error().sentence()), "fault");
  if (form_) {
    form_->hide();
    form_->deleteLater();
    form_ = nullptr;
  }
  context_ = std::make_shared<FormContext>();
  context_->client = &client_;
  context_->of = Map{{"command", command_}};
  context_->title = command_;
  const Value* takes = description.find("takes_expressions");
  context_->takes_expressions = takes && takes->as_bool() && *takes->as_bool();
  context_->pose_of_selection = pose_of_selection_;
  context_->pose_of_view = pose_of_view_;
  context_->given = [this] { return this->values(); };
  form_ = new SchemaForm(context_, std::move(*schema), {}, body_);
  form_->set_columns(columns_);
  body_column_->addWidget(form_);
  fill(values);
  for (const auto& [name, source] : sources)
    if (Field* f = form_->field(name)) f->set_source(source);
  form_->on_change = [this](const std::string& path, const std::optional<Value>&, Field::Stage) {
    show_line(path.substr(0, path.find_first_of(".[")));
    if (preview_->isChecked()) preview_timer_.start();
  };
  form_->on_remedy = [this](const FaultRemedy& remedy) { carry_out(remedy); };
  form_->on_grown = [this] {
    if (on_grown) on_grown();
  };
  name_->setText(qt(command_));
  summary_->setText(qt(word(description, "summary")));
  summary_->setToolTip(qt(word(description, "summary")));
  details_->setText(qt(word(description, "details")));
  details_->hide();
  effect_->setText(effect_words(description));
  if (const Value* r = description.find("returns"); r && r->as_map())
    unit_ = word(*r->as_map(), "unit");
  preview_->setVisible(has_word(description, "effects", "edits"));
  preview_->setChecked(false);
  show_outcome({}, "dim");
  result_->clear();
  result_->hide();
  show_->hide();
  form_->show();
  show_line({});
  if (on_ready) on_ready();
}

Map CommandForm::values() const { return form_ ? form_->values() : Map(); }

void CommandForm::fill(const Map& values) {
  if (!form_) return;
  Map known;
  for (const auto& [name, value] : values)
    if (find_param(form_->schema(), name)) known.set(name, value);
  form_->fill(known);
  show_line({});
}

void CommandForm::show_line(const std::string& changed) {
  const Theme& t = theme();
  const ioci::CallText text = ioci::call_text(command_, values());
  line_ = qt(text.line);
  const auto html = [](std::string_view s) { return qt(s).toHtmlEscaped(); };
  // Strings in their colour, the part that was just changed on the ground of a selection.
  const auto coloured = [&](std::string_view s) {
    QString out;
    std::size_t i = 0;
    while (i < s.size()) {
      if (s[i] == '"') {
        std::size_t end = i + 1;
        while (end < s.size() && s[end] != '"') end += s[end] == '\\' ? 2 : 1;
        end = std::min(end + 1, s.size());
        out += QString("<span style='color:%1'>%2</span>")
                   .arg(t.string.name(), html(s.substr(i, end - i)));
        i = end;
      } else {
        const std::size_t end = std::min(s.find('"', i), s.size());
        out += html(s.substr(i, end - i));
        i = end;
      }
    }
    return out;
  };
  const std::string_view line = text.line;
  QString shown = QString("<span style='color:%1'>›</span>&nbsp; ").arg(t.accent.name());
  std::size_t done = 0;
  for (const auto& part : text.parts) {
    shown += coloured(line.substr(done, part.begin - done));
    const QString piece = coloured(line.substr(part.begin, part.end - part.begin));
    shown += part.argument == changed
                 ? QString("<span style='background:%1'>%2</span>").arg(t.selection.name(), piece)
                 : piece;
    done = part.end;
  }
  shown += coloured(line.substr(done));
  lua_->setText(shown);
  lua_->setAccessibleDescription(line_);
}

void CommandForm::show_outcome(const QString& text, const char* kind) {
  const Theme& t = theme();
  outcome_kind_ = kind;
  outcome_->setText(text);
  outcome_->setVisible(!text.isEmpty());
  const std::string_view k = kind;
  outcome_->setStyleSheet(QString("color: %1;")
                              .arg((k == "fault" ? t.fault
                                    : k == "ok"  ? t.ok
                                                 : t.text_dim)
                                       .name()));
  outcome_->setAccessibleDescription(text);
}

QString CommandForm::outcome() const { return outcome_->text(); }

void CommandForm::run(bool as_job) {
  if (!form_ || is_running_) return;
  form_->clear_faults();
  const Map args = values();
  const int number = ++runs_;
  is_running_ = true;
  run_->setEnabled(false);
  job_->setEnabled(false);
  cancel_->show();
  show_outcome("Running…", "dim");
  auto clock = std::make_shared<QElapsedTimer>();
  clock->start();
  const QPointer<CommandForm> self = this;
  ioci::Client::How how;
  how.job = as_job;
  how.progress = [self, number](double fraction, const std::string& what) {
    if (self && self->runs_ == number)
      self->show_outcome(QString("%1 % %2").arg(static_cast<int>(fraction * 100)).arg(qt(what)),
                         "dim");
  };
  answer_ = client_.call(
      command_, args,
      [self, number, args, clock](const Result<Value>& r) {
        if (!self || self->runs_ != number) return;
        self->take_result(args, r);
        if (r.ok())
          self->show_outcome(QString("✓ Done in %1 s")
                                 .arg(number_text(static_cast<double>(clock->elapsed()) / 1000)),
                             "ok");
      },
      std::move(how));
}

void CommandForm::cancel() {
  if (is_running_) client_.cancel(answer_);
}

void CommandForm::offer_result(const Value& result) {
  const Handle* h = result.as_handle();
  if (const Map* m = result.as_map(); !h && m)
    for (const auto& [name, v] : *m)
      if (!h) h = v.as_handle();
  made_ = h ? *h : Handle();
  show_->setVisible(h && on_show);
  if (!h) return;
  show_->setText(h->kind == "recording" ? QString("Open in the timeline")
                                        : "Show the " + qt(h->kind));
  show_->setAccessibleName(show_->text());
  show_->setToolTip(show_->text());
}

void CommandForm::take_result(const Map& args, const Result<Value>& r) {
  is_running_ = false;
  run_->setEnabled(true);
  job_->setEnabled(true);
  cancel_->hide();
  if (r.ok()) {
    const bool shows = !r->is_nil();
    if (shows) result_->show_result(*r, unit_);
    result_->setVisible(shows);
    offer_result(*r);
  } else {
    show_->hide();
    result_->hide();
    show_faults(r.error());
  }
  if (on_run) on_run(command_, args, r);
}

void CommandForm::show_faults(const Error& e) {
  if (e.code == ErrorCode::cancelled) return show_outcome("Cancelled.", "dim");
  std::vector<ShownFault> shown;
  for (const Fault& f : faults_of(e)) {
    ShownFault one = shown_fault(f);
    // A fault of a record that the command made is about the arguments only where it names one.
    if (f.subject.argument.empty()) one.path.clear();
    shown.push_back(std::move(one));
  }
  const bool all = form_->show_faults(shown);
  show_outcome(all ? QString("%1 to correct above.")
                         .arg(shown.size() == 1 ? QString("One value is")
                                                : QString("%1 values are").arg(shown.size()))
                   : QString(),
               "fault");
}

void CommandForm::carry_out(const FaultRemedy& remedy) {
  if (remedy.repeats || remedy.command == command_ || remedy.command.empty()) {
    fill(remedy.repeats ? repeated(remedy, values()) : remedy.args);
    form_->clear_faults();
    show_outcome(qt(remedy.label), "dim");
    return;
  }
  ask(client_, remedy.command, remedy.args, this,
      [this, label = remedy.label](const Result<Value>& r) {
        if (!r.ok()) return show_outcome(qt(r.error().sentence()), "fault");
        form_->clear_faults();
        show_outcome(qt(label) + ": done.", "ok");
      });
}

void CommandForm::preview(bool on) {
  if (preview_->isChecked() != on) {
    preview_->setChecked(on);
    return;
  }
  ++previews_;
  if (on) start_preview();
  else show_outcome({}, "dim");
}

void CommandForm::start_preview() {
  if (!form_) return;
  const int number = ++previews_;
  const QPointer<CommandForm> self = this;
  auto draft_number = std::make_shared<Value>();
  const auto draft =
      client_.open_draft("preview of " + command_, [draft_number](const Result<Value>& r) {
        if (r.ok()) *draft_number = *r;
      });
  ioci::Client& client = client_;
  ioci::Client::How how;
  how.in = draft;
  client_.call(
      command_, values(),
      [self, number, draft, draft_number, &client](const Result<Value>& r) {
        if (!self || self->previews_ != number) {
          client.cancel(draft);
          return;
        }
        self->form_->clear_faults();
        if (!r.ok()) {
          self->show_faults(r.error());
          client.cancel(draft);
          return;
        }
        ask(client, "draft.changes", Map{{"draft", *draft_number}}, self,
            [self, number](const Result<Value>& changes) {
              if (!self || self->previews_ != number) return;
              if (!changes.ok() || !changes->as_map())
                return self->show_outcome(changes.ok() ? QString() : qt(changes.error().sentence()),
                                          "fault");
              QStringList words;
              for (const auto& [what, list] : *changes->as_map()) {
                if (!list.as_list()) continue;
                for (const Value& each : *list.as_list()) {
                  const Map* m = each.as_map();
                  if (!m) continue;
                  QString one = qt(what == "added"     ? "adds "
                                   : what == "removed" ? "removes "
                                                       : "changes ") +
                                qt(word(*m, "name"));
                  if (const Value* fields = m->find("fields"); fields && fields->as_list()) {
                    QStringList names;
                    for (const Value& f : *fields->as_list())
                      names << qt(f.as_string() ? *f.as_string() : f.text());
                    if (!names.isEmpty()) one += " (" + names.join(", ") + ")";
                  }
                  words << one;
                }
              }
              self->show_outcome(
                  "Preview: " + (words.isEmpty() ? QString("changes nothing") : words.join("; ")) +
                      ".",
                  "dim");
            });
        client.cancel(draft);
      },
      std::move(how));
}

void CommandForm::keyPressEvent(QKeyEvent* event) {
  if ((event->key() == Qt::Key_Return || event->key() == Qt::Key_Enter) &&
      event->modifiers() & Qt::ControlModifier)
    return run(false);
  if (event->key() == Qt::Key_F1 && on_help) return on_help(command_);
  QWidget::keyPressEvent(event);
}

}  // namespace robomosp::viewer
