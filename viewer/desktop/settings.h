// SPDX-License-Identifier: GPL-3.0-or-later
// Settings: what the window keeps from one start to the next: layouts, theme, zoom, recent files,
// history of the console (layer: GUI).
#pragma once

#include <map>
#include <optional>

#include <QByteArray>
#include <QMap>
#include <QSettings>
#include <QString>
#include <QStringList>
#include <QVariant>

#include <robomosp/sdk/result.h>

namespace robomosp::viewer {

/// "true" if the start page is not shown at the start.
inline constexpr const char* kStartHidden = "start/hidden";

/// The file robomosp/desktop.ini in the user's folder of configurations. [GUI thread]
class Settings {
 public:
  /// "" = the user's file.
  explicit Settings(const QString& file = {});
  [[nodiscard]] static QString file_of_user();

  /// Writes what has changed, and when. The reason if the file cannot be written; none if it can.
  [[nodiscard]] std::optional<Error> write();

  [[nodiscard]] QByteArray layout(const QString& workspace) const;
  void set_layout(const QString& workspace, const QByteArray& state);
  void forget_layouts();
  [[nodiscard]] bool is_dark() const;
  void set_dark(bool on);
  [[nodiscard]] double zoom() const;
  void set_zoom(double zoom);
  /// Of fields and buttons.
  [[nodiscard]] bool has_strong_borders() const;
  void set_strong_borders(bool on);
  /// Whether views at rest show a still of best quality.
  [[nodiscard]] bool has_fine_pictures() const;
  void set_fine_pictures(bool on);
  [[nodiscard]] QString workspace() const;
  void set_workspace(const QString& name);
  [[nodiscard]] QByteArray geometry() const;
  void set_geometry(const QByteArray& geometry);
  /// Newest first, at most 12.
  [[nodiscard]] QStringList recent_files() const;
  void add_recent_file(const QString& file);
  void forget_recent_files();
  /// Of the command palette, newest first.
  [[nodiscard]] QStringList recent_commands() const;
  void set_recent_commands(const QStringList& names);
  /// Oldest first, at most 500.
  [[nodiscard]] QStringList console_history() const;
  void set_console_history(const QStringList& lines);
  /// Writes the file now.
  void sync() { file_.sync(); }
  /// Other texts by name, such as "stories/moves"; "" = not set.
  [[nodiscard]] QString value(const QString& name) const { return file_.value(name).toString(); }
  void set_value(const QString& name, const QString& value) { file_.setValue(name, value); }
  /// Keys of menu entries that differ from the program's, by name; as portable texts.
  [[nodiscard]] std::map<QString, QString> shortcuts() const;
  void set_shortcut(const QString& action, const QString& keys);
  void forget_shortcut(const QString& action);
  void forget_shortcuts();
  /// Cameras that the user named, by name, of a record such as "world pa10_circle".
  [[nodiscard]] QMap<QString, QString> user_views(const QString& record) const;
  void set_user_views(const QString& record, const QMap<QString, QString>& views);
  /// Kept for the timeline by a key, such as the variables of a kind of recording.
  [[nodiscard]] QVariant timeline(const QString& key) const;
  void set_timeline(const QString& key, const QVariant& value);

 private:
  QSettings file_;
};

}  // namespace robomosp::viewer
