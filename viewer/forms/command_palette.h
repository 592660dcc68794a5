// SPDX-License-Identifier: GPL-3.0-or-later
// CommandPalette: finds a command by a few letters and opens its form (layer: GUI).
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <QFrame>

#include "ioci/client/client.h"
#include "kernel/value.h"
#include "viewer/forms/fuzzy.h"
#include "viewer/forms/selected_paths.h"

class QLabel;
class QLineEdit;
class QListView;
class QScrollArea;
class QToolButton;

namespace robomosp::viewer {

class CommandForm;

/// A line to search all commands by name, classic spelling and summary, with the form of the chosen
/// one below it, prefilled from the selection and from its last use. Up and Down choose, Enter
/// opens the form, Ctrl+Enter runs, Escape goes back and then closes. Not modal. [GUI thread]
class CommandPalette : public QFrame {
 public:
  /// The client outlives the palette.
  explicit CommandPalette(ioci::Client& client, QWidget* parent = nullptr);
  ~CommandPalette() override;

  /// Shows it over the middle of its parent and puts the cursor into the line.
  void open(const QString& typed = {});
  /// The same with the form of a command.
  void open_command(const std::string& command, const Map& values = {});
  void set_selection(const SelectedPaths& selection);
  /// Keys of commands that have a shortcut, to be shown beside them.
  void set_shortcuts(std::map<std::string, QString> shortcuts);
  /// In a dock it keeps its place, so that nothing is hidden, and Escape does not close it.
  void set_docked(bool on);
  [[nodiscard]] bool is_docked() const { return is_docked_; }
  /// Hides it unless it is docked.
  void step_aside();
  /// Names of the commands that were run, newest first; they are listed first.
  void set_recent(std::vector<std::string> names);
  [[nodiscard]] const std::vector<std::string>& recent() const { return recent_; }

  [[nodiscard]] CommandForm* form() const { return form_; }
  [[nodiscard]] QLineEdit* line() const { return line_; }
  [[nodiscard]] QListView* list() const { return list_; }
  /// Names of the commands that are listed, best first.
  [[nodiscard]] std::vector<std::string> found() const;
  [[nodiscard]] std::size_t command_count() const { return commands_.size(); }
  [[nodiscard]] bool has_form() const;

  std::function<void()> on_close;
  std::function<void()> on_open;         ///< while it is docked: its dock must be shown
  std::function<void(bool on)> on_dock;  ///< the user wants it in a dock, or above the views
  std::function<void()> on_recent;       ///< after recent() changed

 protected:
  bool eventFilter(QObject* object, QEvent* event) override;
  void keyPressEvent(QKeyEvent* event) override;
  void resizeEvent(QResizeEvent* event) override;
  void paintEvent(QPaintEvent* event) override;
  void showEvent(QShowEvent* event) override;

 private:
  class Model;
  void ask_for_commands();
  void search(const QString& typed);
  void choose(int row);
  void show_form(bool on);
  void place();
  /// Values from the selection for the arguments of a command, and whence they come.
  void prefill(const Map& description, Map& values, std::map<std::string, QString>& sources) const;
  ioci::Client& client_;
  std::vector<SearchedCommand> commands_;
  std::vector<Value> descriptions_;  ///< maps in the same order, shared with other askers
  bool is_asking_ = false;
  SelectedPaths selection_;
  std::map<std::uint64_t, std::string> names_;  ///< of selected records, by number
  std::map<std::string, Map> last_use_;
  std::vector<std::string> recent_;  ///< newest first
  Model* model_;
  QLineEdit* line_;
  QLabel *count_, *escape_;
  QToolButton* dock_;
  QListView* list_;
  QScrollArea* scroll_;
  CommandForm* form_;
  bool is_docked_ = false;
  std::optional<std::pair<std::string, Map>> wanted_;  ///< to be opened when the table has come
};

}  // namespace robomosp::viewer
