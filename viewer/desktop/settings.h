// SPDX-License-Identifier: GPL-3.0-or-later
// Settings: what the window keeps from one start to the next: layouts, theme, zoom, recent files,
// history of the console (layer: GUI).
#pragma once

#include <QByteArray>
#include <QSettings>
#include <QString>
#include <QStringList>

namespace robomosp::viewer {

/// The file robomosp/desktop.ini in the user's folder of configurations. [GUI thread]
class Settings {
 public:
  /// "" = the user's file.
  explicit Settings(const QString& file = {});

  [[nodiscard]] QByteArray layout(const QString& workspace) const;
  void set_layout(const QString& workspace, const QByteArray& state);
  void forget_layouts();
  [[nodiscard]] bool is_dark() const;
  void set_dark(bool on);
  [[nodiscard]] double zoom() const;
  void set_zoom(double zoom);
  [[nodiscard]] QString workspace() const;
  void set_workspace(const QString& name);
  [[nodiscard]] QByteArray geometry() const;
  void set_geometry(const QByteArray& geometry);
  /// Newest first, at most 12.
  [[nodiscard]] QStringList recent_files() const;
  void add_recent_file(const QString& file);
  void forget_recent_files();
  /// Oldest first, at most 500.
  [[nodiscard]] QStringList console_history() const;
  void set_console_history(const QStringList& lines);

 private:
  QSettings file_;
};

}  // namespace robomosp::viewer
