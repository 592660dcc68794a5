// SPDX-License-Identifier: GPL-3.0-or-later
// Actions: the entries of the window's menus, by name (layer: GUI). Each names the command that it
// calls, in its tool tip and for window.actions.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <QAction>
#include <QKeySequence>
#include <QObject>
#include <QString>

class QMenu;

namespace robomosp::viewer {

/// One entry. Its name is the object name of the QAction.
struct ActionSpec {
  const char* name;
  const char* text;     ///< with & before the letter that reaches it in its menu
  const char* icon;     ///< see icons.h; "" = none
  const char* keys;     ///< its shortcut, such as "Ctrl+S"; "" = none
  const char* command;  ///< that it calls, as Lua; "" = window.trigger with its name
  bool is_checkable = false;
  bool echoes = true;  ///< its line, if its command is window.trigger: not what has another line,
                       ///< or what a macro must not repeat
};

/// [GUI thread]
class Actions {
 public:
  explicit Actions(QObject* owner) : owner_(owner) {}
  /// Adds an entry to a menu. `run` gets whether it is checked; it is not called when the program
  /// checks it.
  QAction* add(QMenu* menu, const ActionSpec& spec, std::function<void(bool)> run);
  /// Null if there is none.
  [[nodiscard]] QAction* find(std::string_view name) const;
  void enable(std::string_view name, bool on) const;
  void check(std::string_view name, bool on) const;
  [[nodiscard]] const std::vector<QAction*>& all() const { return all_; }
  /// Lists an action that something else has made, such as a dock; it has its object name already.
  void adopt(QAction& action, const QString& command);
  /// Sets the shortcut of an entry, also in its tool tip.
  static void set_keys(QAction& action, const QKeySequence& keys);
  /// The shortcut that it was added with.
  [[nodiscard]] static QKeySequence default_keys(const QAction& action);

  /// Gets the line of each entry that the user chooses and that calls no other command.
  std::function<void(const std::string& line)> echo;

 private:
  QObject* owner_;
  std::vector<QAction*> all_;
  std::map<std::string, QAction*, std::less<>> by_name_;
};

/// The line that chooses an entry.
[[nodiscard]] std::string trigger_line(std::string_view action);

/// The command of an action, as Lua.
[[nodiscard]] QString command_of(const QAction& action);

}  // namespace robomosp::viewer
