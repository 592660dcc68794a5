// SPDX-License-Identifier: GPL-3.0-or-later
// CommandForm: the form of one command, with the Lua line it makes, its faults, a preview and its
// result (layer: GUI).
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include <QTimer>
#include <QWidget>

#include "ioci/client/client.h"
#include "kernel/fault.h"
#include "viewer/forms/form_context.h"

class QCheckBox;
class QLabel;
class QPushButton;
class QScrollArea;
class QVBoxLayout;

namespace robomosp::viewer {

class ResultView;
class SchemaForm;

/// Asks the client for the description of a command and draws its form. Nothing of it waits: a run
/// that takes long shows its progress and can be cancelled. Ctrl+Enter runs. [GUI thread]
class CommandForm : public QWidget {
 public:
  /// The client outlives the form.
  explicit CommandForm(ioci::Client& client, QWidget* parent = nullptr);
  ~CommandForm() override;

  /// Opens the form of a command, filled with values; `sources` says whence some of them come
  /// ("from the selection"). Values of arguments that the command does not have are left out.
  void open(const std::string& command, const Map& values = {},
            const std::map<std::string, QString>& sources = {});
  /// The same with the result of ioci.describe for that command, if it is known.
  void open_described(const Map& description, const Map& values,
                      const std::map<std::string, QString>& sources);
  [[nodiscard]] const std::string& command() const { return command_; }
  /// Null until the description has come.
  [[nodiscard]] SchemaForm* form() const { return form_; }
  [[nodiscard]] Map values() const;
  void fill(const Map& values);
  /// Calls the command with what is filled in.
  void run(bool as_job = false);
  void cancel();
  /// Shows what the command would change, on a draft that is dropped, and again after each edit.
  void preview(bool on);
  [[nodiscard]] bool is_running() const { return is_running_; }
  [[nodiscard]] ResultView* result() const { return result_; }
  [[nodiscard]] QString line() const { return line_; }
  /// The sentences below the form: the outcome of a run, or what a preview found.
  [[nodiscard]] QString outcome() const;
  void set_columns(int columns);
  /// Where fields of poses take one from; empty = they offer none.
  void set_pose_sources(std::function<void(std::function<void(const Value&)>)> of_selection,
                        std::function<void(std::function<void(const Value&)>)> of_view);

  /// After each run, with its result or error.
  std::function<void(const std::string& command, const Map& args, const Result<Value>&)> on_run;
  std::function<void()> on_ready;                        ///< the form is drawn
  std::function<void()> on_grown;                        ///< it needs another height
  std::function<void(const std::string& page)> on_help;  ///< F1 or the link: "robot.fk"
  /// Shows a record or recording that the command made; empty = no link is offered.
  std::function<void(const Handle&)> on_show;
  std::function<void(const QString& line)> on_macro;  ///< "Add to macro"; none = no button

 protected:
  void keyPressEvent(QKeyEvent* event) override;
  void showEvent(QShowEvent* event) override;
  void changeEvent(QEvent* event) override;

 private:
  void show_line(const std::string& changed);
  void show_faults(const Error& error);
  void offer_result(const Value& result);
  void take_result(const Map& args, const Result<Value>& r);
  void carry_out(const FaultRemedy& remedy);
  void start_preview();
  void show_outcome(const QString& text, const char* kind);
  ioci::Client& client_;
  std::string command_;
  Map description_;
  std::shared_ptr<FormContext> context_;
  SchemaForm* form_ = nullptr;
  QLabel *name_, *summary_, *lua_, *effect_, *outcome_, *details_;
  QPushButton *help_, *copy_, *run_, *job_, *cancel_, *macro_, *show_;
  QCheckBox* preview_;
  QWidget *body_, *foot_;
  QVBoxLayout* body_column_;
  ResultView* result_;
  QString line_;
  const char* outcome_kind_ = "dim";  ///< "dim", "ok" or "fault"
  int columns_ = 2;
  int asked_ = 0;  ///< counts openings, so that a late description is dropped
  int runs_ = 0;   ///< counts runs, likewise
  bool is_running_ = false;
  ioci::Client::Answer answer_;
  std::function<void(std::function<void(const Value&)>)> pose_of_selection_, pose_of_view_;
  QTimer preview_timer_;
  int previews_ = 0;
  Handle made_;       ///< the record or recording of the last result
  std::string unit_;  ///< of a number as result
};

}  // namespace robomosp::viewer
