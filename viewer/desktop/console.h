// SPDX-License-Identifier: GPL-3.0-or-later
// Console: the Lua session of the window (layer: GUI). It also shows each act of the other panels
// as the line of Lua that repeats it, and records them as a macro.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include <QPlainTextEdit>
#include <QStringList>
#include <QTimer>
#include <QWidget>

#include "viewer/desktop/console_output.h"
#include "viewer/desktop/desk.h"
#include "viewer/desktop/lua_highlighter.h"
#include "viewer/theme/theme.h"

class QLabel;
class QLineEdit;
class QListWidget;
class QToolButton;

namespace robomosp::viewer {

class Actions;
class Settings;

/// The field for an input of one or several lines.
class ConsoleInput : public QPlainTextEdit {
 public:
  explicit ConsoleInput(QWidget* parent = nullptr);
  /// Called with each key before the field takes it; true = done.
  std::function<bool(QKeyEvent*)> on_key;
  /// Called when it loses the focus.
  std::function<void()> on_leave;

 protected:
  void keyPressEvent(QKeyEvent* event) override;
  bool event(QEvent* event) override;
  void focusOutEvent(QFocusEvent* event) override;
};

/// [GUI thread]
class Console : public QWidget {
 public:
  Console(Desk& desk, Settings& settings, QWidget* parent = nullptr);
  ~Console() override;

  /// Evaluates an input as if it had been typed.
  void run(const QString& input);
  void clear();
  void set_recording(bool on);
  [[nodiscard]] bool is_recording() const { return is_recording_; }
  /// The lines of the macro, as a script.
  [[nodiscard]] QString macro() const;
  [[nodiscard]] bool has_macro() const { return !macro_.isEmpty(); }
  /// All lines, without the pictures between them.
  [[nodiscard]] QString text() const;
  [[nodiscard]] ConsoleOutput& output() const { return *output_; }
  /// True while pictures of results are loaded or drawn.
  [[nodiscard]] bool is_drawing() const { return output_->is_drawing(); }
  [[nodiscard]] ConsoleInput& input() const { return *input_; }

  Listeners<> macro_changed;

 protected:
  void changeEvent(QEvent* event) override;

 private:
  bool key(QKeyEvent* event);
  void enter();
  void evaluate(const QString& input);
  void append(ConsoleLine line, const QString& text);
  /// Shows a result as a small picture below its text, if it is one.
  void append_picture(const Value& result, const QString& text);
  void append_plot(const Handle& recording, const QString& title);
  void complete();
  void show_completion(std::size_t start, const QStringList& words);
  void take_completion();
  void hide_completion();
  void step_history(int by);
  void begin_search();
  void step_search(const QString& text, bool next);
  void end_search(bool take);
  void fit_input();
  /// Shows the arguments of the command around the cursor.
  void ask_signature();
  void show_signature(const Map& command, const QString& argument);
  void note_line(const QString& line);
  void apply_theme();
  void stop();

  Desk& desk_;
  Settings& settings_;
  ConsoleOutput* output_;
  ConsoleInput* input_;
  QLabel* prompt_;
  QListWidget* completions_;
  QWidget* search_bar_;
  QLineEdit* search_;
  QLabel* found_;
  QLabel* signature_;
  QTimer signature_timer_;
  std::map<std::string, Map> signatures_;  ///< of commands, as ioci.describe returns them
  QToolButton* stop_;
  QStringList history_, macro_;
  qsizetype at_ = 0;  ///< in the history; its size = what is being typed
  QString typed_;     ///< kept while the history is looked through
  qsizetype found_at_ = -1;
  int completion_start_ = 0;
  std::vector<Desk::Answer> running_;
  Desk::Answer completing_;
  int runs_ = 0;  ///< inputs that have not ended
  bool is_recording_ = false;
  int themed_ = theme_revision();  ///< the theme that it shows
};

}  // namespace robomosp::viewer
