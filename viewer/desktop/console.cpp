// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/desktop/console.h"

#include <algorithm>
#include <memory>
#include <utility>

#include <QEvent>
#include <QFileInfo>
#include <QHBoxLayout>
#include <QKeyEvent>
#include <QLabel>
#include <QLineEdit>
#include <QListWidget>
#include <QScrollBar>
#include <QTextBlock>
#include <QToolButton>
#include <QVBoxLayout>

#include "viewer/desktop/console_signature.h"
#include "viewer/desktop/lua_highlighter.h"
#include "viewer/desktop/settings.h"
#include "viewer/desktop/values.h"
#include "viewer/forms/result_picture.h"
#include "viewer/forms/small_plot.h"
#include "viewer/theme/icons.h"
#include "viewer/theme/theme.h"

namespace robomosp::viewer {
namespace {

constexpr int kMostLines = 5000;    ///< of the output
constexpr int kMostInLine = 20000;  ///< characters of a line: Qt lays out longer ones slowly
constexpr int kMostInputLines = 8;  ///< shown of an input
constexpr int kSignatureAfterMs = 150;
constexpr int kMostCompletions = 12;  ///< shown at once
const QChar kPrompt(0x203A);

/// The text of results, where those that are pictures as Base64 or SVG have their beginnings only.
std::string without_pictures(std::string text, const List& results) {
  constexpr std::size_t kBeginning = 40;
  for (const Value& result : results) {
    const auto picture = picture_of(result);
    if (!picture || picture->text.size() <= 2 * kBeginning) continue;
    const std::size_t at = text.find(picture->text);
    if (at == std::string::npos) continue;
    const std::string beginning =
        picture->text.substr(0, std::min(kBeginning, picture->text.find('\n')));
    text.replace(at, picture->text.size(),
                 beginning + " ... (" + std::to_string(picture->text.size()) + " characters)");
  }
  return text;
}

}  // namespace

ConsoleInput::ConsoleInput(QWidget* parent) : QPlainTextEdit(parent) {
  setLineWrapMode(QPlainTextEdit::WidgetWidth);
  setVerticalScrollBarPolicy(Qt::ScrollBarAlwaysOff);
  setProperty("flat", true);
}

bool ConsoleInput::event(QEvent* event) {
  // Tab completes; it must not go to the next widget, nor Escape to a dialog.
  if (event->type() == QEvent::ShortcutOverride) {
    const auto* key = static_cast<QKeyEvent*>(event);
    const bool is_ours = key->key() == Qt::Key_Up || key->key() == Qt::Key_Down ||
                         key->key() == Qt::Key_Escape || key->key() == Qt::Key_Tab ||
                         (key->modifiers() == Qt::ControlModifier &&
                          (key->key() == Qt::Key_R || key->key() == Qt::Key_L));
    const bool is_text =
        key->modifiers() == Qt::NoModifier || key->modifiers() == Qt::ShiftModifier;
    if (is_ours || (is_text && !key->text().isEmpty())) {
      event->accept();
      return true;
    }
  }
  return QPlainTextEdit::event(event);
}

void ConsoleInput::keyPressEvent(QKeyEvent* event) {
  if (on_key && on_key(event)) {
    event->accept();
    return;
  }
  QPlainTextEdit::keyPressEvent(event);
}

void ConsoleInput::focusOutEvent(QFocusEvent* event) {
  QPlainTextEdit::focusOutEvent(event);
  if (on_leave) on_leave();
}

Console::Console(Desk& desk, Settings& settings, QWidget* parent)
    : QWidget(parent), desk_(desk), settings_(settings), history_(settings.console_history()) {
  setObjectName("console");
  setAccessibleName("Console");
  setProperty("ground", "field");
  output_ = new ConsoleOutput;
  output_->setObjectName("console_output");
  output_->setAccessibleName("Lines of the console");
  output_->setToolTip("What was called, and its results");
  output_->setProperty("flat", true);
  output_->setMaximumBlockCount(kMostLines);
  output_->setLineWrapMode(QPlainTextEdit::WidgetWidth);
  output_->setTextInteractionFlags(Qt::TextSelectableByMouse | Qt::TextSelectableByKeyboard);
  new LuaHighlighter(output_->document(), false);

  auto* row = new QWidget;
  row->setObjectName("console_row");
  row->setAccessibleName("Input of the console");
  row->setProperty("ground", "field");
  auto* across = new QHBoxLayout(row);
  across->setContentsMargins(0, 0, 0, 0);
  prompt_ = new QLabel(kPrompt);
  prompt_->setObjectName("console_prompt");
  prompt_->setAccessibleName("Prompt");
  prompt_->setToolTip("Type Lua here; help() helps, Tab completes");
  input_ = new ConsoleInput;
  input_->setObjectName("console_input");
  input_->setAccessibleName("Lua");
  input_->setToolTip(
      "Lua: Enter runs, Shift+Enter begins a line, Tab completes, Up and Down go "
      "through the history, Ctrl+R searches it");
  input_->setPlaceholderText("help(), or Lua");
  new LuaHighlighter(input_->document(), true);
  stop_ = new QToolButton;
  stop_->setObjectName("console_stop");
  stop_->setAccessibleName("Stop");
  stop_->setToolTip("Stop what runs (Escape)");
  stop_->setIcon(icon("stop"));
  stop_->setText("Stop");
  stop_->hide();
  across->addWidget(prompt_, 0, Qt::AlignTop);
  across->addWidget(input_, 1);
  across->addWidget(stop_, 0, Qt::AlignTop);

  search_bar_ = new QWidget;
  search_bar_->setObjectName("console_search_bar");
  search_bar_->setAccessibleName("Search in the history");
  search_bar_->setProperty("ground", "header");
  auto* search_row = new QHBoxLayout(search_bar_);
  search_row->setContentsMargins(4, 2, 4, 2);
  search_ = new QLineEdit;
  search_->setObjectName("console_search");
  search_->setAccessibleName("Text to find in the history");
  search_->setToolTip(
      "Part of an earlier line; Ctrl+R finds the next, Enter takes it, Escape ends");
  search_->setPlaceholderText("Part of an earlier line");
  found_ = new QLabel;
  found_->setObjectName("console_found");
  found_->setAccessibleName("Line found");
  found_->setToolTip("The line found");
  search_row->addWidget(search_, 1);
  search_row->addWidget(found_, 2);
  search_bar_->hide();

  auto* line = new QWidget;
  line->setObjectName("console_line");
  line->setAccessibleName("Separator");
  line->setFixedHeight(1);
  auto* column = new QVBoxLayout(this);
  column->setContentsMargins(0, 0, 0, 0);
  column->setSpacing(0);
  column->addWidget(output_, 1);
  column->addWidget(search_bar_);
  signature_ = new QLabel;
  signature_->setObjectName("console_signature");
  signature_->setAccessibleName("Arguments of the command");
  signature_->setToolTip("The command at the cursor and its arguments; F1 shows its page");
  signature_->setWordWrap(true);
  signature_->setContentsMargins(8, 2, 8, 2);
  signature_->hide();
  column->addWidget(signature_);
  column->addWidget(line);
  column->addWidget(row);
  setFocusProxy(input_);

  completions_ = new QListWidget(this);
  completions_->setObjectName("console_completions");
  completions_->setAccessibleName("Completions");
  completions_->setToolTip("Tab or Enter takes the chosen word");
  completions_->setFocusPolicy(Qt::NoFocus);
  completions_->setUniformItemSizes(true);
  completions_->hide();
  connect(completions_, &QListWidget::itemClicked, this, [this] { take_completion(); });

  input_->on_key = [this](QKeyEvent* e) { return key(e); };
  input_->on_leave = [this] {
    if (!completions_->underMouse()) hide_completion();
  };
  connect(input_, &QPlainTextEdit::textChanged, this, [this] {
    fit_input();
    if (completions_->isVisible()) complete();
  });
  signature_timer_.setSingleShot(true);
  signature_timer_.setInterval(kSignatureAfterMs);
  connect(&signature_timer_, &QTimer::timeout, this, [this] { ask_signature(); });
  connect(input_, &QPlainTextEdit::cursorPositionChanged, this,
          [this] { signature_timer_.start(); });
  connect(stop_, &QToolButton::clicked, this, [this] { stop(); });
  connect(search_, &QLineEdit::textEdited, this,
          [this](const QString& text) { step_search(text, false); });
  connect(search_, &QLineEdit::returnPressed, this, [this] { end_search(true); });
  auto* next = new QAction(search_bar_);
  next->setObjectName("console_search_next");
  next->setShortcut(QKeySequence("Ctrl+R"));
  next->setShortcutContext(Qt::WidgetWithChildrenShortcut);
  connect(next, &QAction::triggered, this, [this] { step_search(search_->text(), true); });
  search_bar_->addAction(next);
  auto* leave = new QAction(search_bar_);
  leave->setObjectName("console_search_end");
  leave->setShortcut(QKeySequence("Escape"));
  leave->setShortcutContext(Qt::WidgetWithChildrenShortcut);
  connect(leave, &QAction::triggered, this, [this] { end_search(false); });
  search_bar_->addAction(leave);

  at_ = history_.size();
  desk_.acted.add(this, [this](const std::string& line_of_lua) {
    const QString text = shown(line_of_lua);
    append(ConsoleLine::echo, text);
    note_line(text);
  });
  desk_.printed.add(this, [this](const std::string& text) {
    QString lines = shown(text);
    if (lines.endsWith('\n')) lines.chop(1);
    append(ConsoleLine::result, lines);
  });
  desk_.noted.add(this, [this](const QString& text) { append(ConsoleLine::note, text); });
  apply_theme();
}

Console::~Console() = default;

void Console::apply_theme() {
  const Theme& t = theme();
  for (QPlainTextEdit* edit :
       {static_cast<QPlainTextEdit*>(output_), static_cast<QPlainTextEdit*>(input_)}) {
    use_font(*edit, &Theme::code);
    edit->document()->setDocumentMargin(t.gap);
    edit->setStyleSheet(
        QString("QPlainTextEdit { background: %1; color: %2; border: 0px; "
                "selection-background-color: %3; selection-color: %4; }")
            .arg(t.field.name(), t.text.name(), t.accent_fill.name(), t.on_accent.name()));
  }
  input_->document()->setDocumentMargin(t.gap / 2.0);
  use_font(*prompt_, &Theme::code);
  prompt_->setContentsMargins(t.gap, t.gap / 2, 0, 0);
  prompt_->setStyleSheet(QString("color: %1;").arg(t.accent.name()));
  use_font(*found_, &Theme::code);
  use_font(*signature_, &Theme::small);
  signature_->setStyleSheet(
      QString("background: %1; color: %2;").arg(t.header.name(), t.text_dim.name()));
  use_font(*completions_, &Theme::code);
  completions_->setStyleSheet(
      QString(
          "QListWidget { background: %1; border: 1px solid %2; } QListWidget::item { height: "
          "%3px; padding-left: 6px; } QListWidget::item:selected { background: %4; color: %5; }")
          .arg(t.header.name(), t.field_line.name())
          .arg(t.px(22))
          .arg(t.selection.name(), t.text.name()));
  if (QWidget* line = findChild<QWidget*>("console_line"))
    line->setStyleSheet(QString("background: %1;").arg(t.line.name()));
  // Lines keep the colours that they were written in: write them again in those of the theme.
  for (QSyntaxHighlighter* h : findChildren<QSyntaxHighlighter*>()) h->rehighlight();
  output_->refit();
  fit_input();
}

void Console::changeEvent(QEvent* event) {
  if (std::exchange(themed_, theme_revision()) != theme_revision()) apply_theme();
  QWidget::changeEvent(event);
}

void Console::fit_input() {
  const QFontMetrics metrics(input_->font());
  const int lines = std::clamp(input_->document()->size().toSize().height(), 1, kMostInputLines);
  input_->setFixedHeight(lines * metrics.lineSpacing() + theme().gap + 2);
}

void Console::ask_signature() {
  const QString text = input_->toPlainText();
  const int place = input_->textCursor().position();
  const std::string name = utf8(call_around(text, place));
  const QString argument = argument_at(text, place);
  if (name.find('.') == std::string::npos) return signature_->hide();
  if (const auto known = signatures_.find(name); known != signatures_.end())
    return show_signature(known->second, argument);
  desk_.ask("ioci.describe", {{"command", name}}, *this, [this, name](const Result<Value>& r) {
    // Names that are no commands are remembered, too.
    signatures_[name] = r.ok() && !list_of(*r).empty() ? map_of(list_of(*r).front()) : Map();
    signature_timer_.start();
  });
}

void Console::show_signature(const Map& command, const QString& argument) {
  const std::string name = text_at(command, "name");
  if (name.empty()) return signature_->hide();
  QStringList arguments;
  QString about = shown(text_at(command, "summary"));
  for (const Value& v : list_at(command, "params")) {
    const Map& param = map_of(v);
    const QString each = shown(text_at(param, "name"));
    const bool is_here = each == argument;
    QString word = each.toHtmlEscaped();
    if (!flag_at(param, "required")) word = "<i>" + word + "</i>";
    if (is_here) {
      word = "<b>" + word + "</b>";
      about = shown(text_at(param, "doc"));
      if (const std::string unit = text_at(param, "unit"); !unit.empty())
        about += " [" + shown(unit) + "]";
    }
    arguments += word;
  }
  signature_->setText(
      QString("<span style=\"color:%1\">%2{%3}</span> %4")
          .arg(theme().text.name(), shown(name), arguments.join(", "), about.toHtmlEscaped()));
  signature_->show();
}

QString Console::text() const { return output_->text(); }

void Console::append(ConsoleLine line, const QString& text) {
  QScrollBar* bar = output_->verticalScrollBar();
  const bool is_at_end = bar->value() >= bar->maximum() - 4;
  QTextCursor cursor(output_->document());
  cursor.movePosition(QTextCursor::End);
  const QString head = line == ConsoleLine::echo    ? QString(QChar(0x00B7)) + ' '
                       : line == ConsoleLine::input ? QString(kPrompt) + ' '
                                                    : QString();
  bool is_first = true;
  for (const QString& part : text.split('\n')) {
    if (!output_->document()->isEmpty()) cursor.insertBlock();
    cursor.block().setUserState(static_cast<int>(line));
    cursor.insertText((is_first || head.isEmpty() ? head : QString("  ")) + part.left(kMostInLine));
    if (part.size() > kMostInLine)
      cursor.insertText(QString(" ... (%1 more characters)").arg(part.size() - kMostInLine));
    is_first = false;
  }
  if (is_at_end) bar->setValue(bar->maximum());
}

void Console::clear() { output_->clear(); }

void Console::note_line(const QString& line) {
  if (!is_recording_) return;
  macro_ += line;
  macro_changed();
}

void Console::set_recording(bool on) {
  if (is_recording_ == on) return;
  is_recording_ = on;
  if (on) macro_.clear();
  append(ConsoleLine::note, on ? "-- recording a macro: each act becomes a line of it"
                               : QString("-- the macro has %1 lines").arg(macro_.size()));
  macro_changed();
}

QString Console::macro() const {
  return "-- Recorded in robomosp-desktop.\n" + macro_.join('\n') + (macro_.isEmpty() ? "" : "\n");
}

void Console::run(const QString& input) { evaluate(input); }

bool Console::key(QKeyEvent* event) {
  const bool is_plain = event->modifiers() == Qt::NoModifier;
  const bool is_ctrl = event->modifiers() == Qt::ControlModifier;
  const bool has_list = completions_->isVisible();
  switch (event->key()) {
    case Qt::Key_Tab:
      if (has_list) take_completion();
      else complete();
      return true;
    case Qt::Key_Return:
    case Qt::Key_Enter:
      if (event->modifiers().testFlag(Qt::ShiftModifier)) return false;
      if (has_list) take_completion();
      else enter();
      return true;
    case Qt::Key_Escape:
      if (has_list) hide_completion();
      else if (runs_ > 0) stop();
      else input_->clear();
      return true;
    case Qt::Key_Up:
    case Qt::Key_Down: {
      if (!is_plain) return false;
      const int by = event->key() == Qt::Key_Up ? -1 : 1;
      if (has_list) {
        const int count = completions_->count();
        completions_->setCurrentRow((completions_->currentRow() + by + count) % count);
        return true;
      }
      const QTextCursor cursor = input_->textCursor();
      const int block = cursor.blockNumber();
      if (by < 0 ? block > 0 : block + 1 < input_->blockCount()) return false;
      step_history(by);
      return true;
    }
    case Qt::Key_R:
      if (!is_ctrl) return false;
      begin_search();
      return true;
    case Qt::Key_L:
      if (!is_ctrl) return false;
      clear();
      return true;
    case Qt::Key_C:
      if (!is_ctrl || input_->textCursor().hasSelection() || runs_ == 0) return false;
      stop();
      return true;
    default: return false;
  }
}

void Console::stop() {
  for (const Desk::Answer& each : running_) desk_.client().cancel(each);
}

void Console::enter() {
  const QString text = input_->toPlainText();
  if (text.trimmed().isEmpty()) return;
  // Whether it is whole is known to the session only.
  desk_.base().complete(utf8(text), 0, [this, text](const ioci::LiveView::Completed& c) {
    if (input_->toPlainText() != text) return;
    if (c.is_incomplete) {
      input_->insertPlainText("\n");
      return;
    }
    input_->clear();
    evaluate(text);
  });
}

void Console::evaluate(const QString& input) {
  const QString text = input.trimmed();
  history_.removeAll(text);
  history_ += text;
  at_ = history_.size();
  typed_.clear();
  settings_.set_console_history(history_);
  append(ConsoleLine::input, text);
  ++runs_;
  stop_->show();
  std::erase_if(running_,
                [](const Desk::Answer& a) { return a.stage() == Desk::Answer::Stage::ended; });
  const auto values = std::make_shared<List>();
  const auto done = [this, text, values](const Result<Value>& r) {
    if (--runs_ == 0) stop_->hide();
    if (!r.ok()) return append(ConsoleLine::failure, shown(r.error().sentence()));
    const std::string* result = r->as_string();
    const QString lines = result ? shown(without_pictures(*result, *values)) : QString();
    if (!lines.isEmpty()) append(ConsoleLine::result, lines);
    for (const Value& value : *values) append_picture(value, lines);
    note_line(text);
  };
  running_.push_back(desk_.evaluate(utf8(text), done, values));
}

void Console::append_picture(const Value& result, const QString& text) {
  if (const Handle* handle = result.as_handle()) {
    if (handle->kind == "recording") append_plot(*handle, text.section('\n', 0, 0));
    return;
  }
  const auto picture = picture_of(result);
  if (!picture) return;
  // A text that names no file is only a text.
  if (!picture->file.isEmpty() && !QFileInfo(picture->file).isFile()) return;
  const std::uint64_t number = output_->add_picture(
      {picture->title, result,
       picture->text.size() + static_cast<std::size_t>(picture->bytes.size())});
  output_->draw(number, [picture = *picture, most = output_->most_pixels()] {
    return draw_picture(picture, most);
  });
}

void Console::append_plot(const Handle& recording, const QString& title) {
  const std::uint64_t number = output_->add_picture(
      {title.isEmpty() ? QString("plot") : "plot of " + title, Value(recording), 0});
  const auto fail = [this, number](const QString& why) { output_->give_up(number, why); };
  desk_.ask("recording.columns", {{"id", recording}}, *this,
            [this, recording, number, fail](const Result<Value>& r) {
              if (!r.ok()) return fail(shown(r.error().sentence()));
              const std::vector<std::string> chosen = small_plot_columns(list_of(*r));
              if (chosen.empty()) return output_->remove(number);
              List names{"time"};
              for (const std::string& name : chosen) names.emplace_back(name);
              desk_.ask("recording.values", {{"id", recording}, {"columns", names}}, *this,
                        [this, number, fail](const Result<Value>& values) {
                          if (!values.ok()) return fail(shown(values.error().sentence()));
                          const NumericArray* numbers = values->as_array();
                          if (!numbers) return output_->remove(number);
                          output_->draw(
                              number, [numbers = *numbers, t = theme(),
                                       most = output_->most_pixels(), ratio = devicePixelRatioF()] {
                                return draw_small_plot(numbers, most, ratio, t);
                              });
                        });
            });
}

// --- completion ------------------------------------------------------------------------------

void Console::complete() {
  const QTextCursor cursor = input_->textCursor();
  const QString text = input_->toPlainText();
  const std::string before = utf8(text.left(cursor.position()));
  desk_.client().cancel(completing_);
  completing_ = desk_.base().complete(
      utf8(text), before.size(), [this, text, before](const ioci::LiveView::Completed& c) {
        if (input_->toPlainText() != text) return;
        QStringList words;
        for (const std::string& word : c.completion.words) words += shown(word);
        const std::size_t start = std::min(c.completion.start, before.size());
        const auto chars = QString::fromStdString(before.substr(0, start)).size();
        show_completion(static_cast<std::size_t>(chars), words);
      });
}

void Console::show_completion(std::size_t start, const QStringList& words) {
  completion_start_ = static_cast<int>(start);
  const QTextCursor cursor = input_->textCursor();
  const QString typed =
      input_->toPlainText().mid(completion_start_, cursor.position() - completion_start_);
  if (words.isEmpty() || (words.size() == 1 && words.front() == typed)) return hide_completion();
  if (words.size() == 1 && !completions_->isVisible()) {
    completions_->clear();
    completions_->addItem(words.front());
    completions_->setCurrentRow(0);
    return take_completion();
  }
  completions_->clear();
  completions_->addItems(words);
  completions_->setCurrentRow(0);
  const Theme& t = theme();
  const int rows = std::min(static_cast<int>(words.size()), kMostCompletions);
  int width = t.px(120);
  const QFontMetrics metrics(t.code);
  for (const QString& word : words) width = std::max(width, metrics.horizontalAdvance(word));
  width += t.px(36);
  const int height = rows * t.px(22) + 4;
  const QPoint at = input_->mapTo(this, input_->cursorRect().topLeft());
  completions_->setGeometry(std::clamp(at.x(), 0, std::max(0, this->width() - width)),
                            std::max(0, at.y() - height), std::min(width, this->width()),
                            std::min(height, at.y()));
  completions_->show();
  completions_->raise();
}

void Console::take_completion() {
  const QListWidgetItem* chosen = completions_->currentItem();
  const QString word = chosen ? chosen->text() : QString();
  hide_completion();
  if (word.isEmpty()) return;
  QTextCursor cursor = input_->textCursor();
  cursor.setPosition(completion_start_);
  cursor.setPosition(input_->textCursor().position(), QTextCursor::KeepAnchor);
  cursor.insertText(word);
  input_->setTextCursor(cursor);
  hide_completion();
}

void Console::hide_completion() { completions_->hide(); }

// --- history ---------------------------------------------------------------------------------

void Console::step_history(int by) {
  if (at_ == history_.size()) typed_ = input_->toPlainText();
  const qsizetype to = std::clamp<qsizetype>(at_ + by, 0, history_.size());
  if (to == at_) return;
  at_ = to;
  input_->setPlainText(at_ == history_.size() ? typed_ : history_[at_]);
  input_->moveCursor(QTextCursor::End);
}

void Console::begin_search() {
  found_at_ = -1;
  search_->clear();
  found_->clear();
  search_bar_->show();
  search_->setFocus();
}

void Console::step_search(const QString& text, bool next) {
  const qsizetype from = next && found_at_ >= 0 ? found_at_ - 1 : history_.size() - 1;
  for (qsizetype i = from; i >= 0 && !text.isEmpty(); --i) {
    if (!history_[i].contains(text, Qt::CaseInsensitive)) continue;
    found_at_ = i;
    found_->setText(history_[i].simplified());
    return;
  }
  if (!next) {
    found_at_ = -1;
    found_->setText(text.isEmpty() ? QString() : "no line has it");
  }
}

void Console::end_search(bool take) {
  search_bar_->hide();
  if (take && found_at_ >= 0) {
    input_->setPlainText(history_[found_at_]);
    input_->moveCursor(QTextCursor::End);
  }
  input_->setFocus();
}

}  // namespace robomosp::viewer
