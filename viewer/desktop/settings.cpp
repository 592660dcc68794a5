// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/desktop/settings.h"

#include <algorithm>

#include <QStandardPaths>

namespace robomosp::viewer {
namespace {

constexpr int kRecentFiles = 12;
constexpr int kHistoryLines = 500;
/// Layouts of other versions do not fit the panels of this one.
constexpr int kLayoutVersion = 2;

QString layout_key(const QString& workspace) {
  return QString("layout%1/%2").arg(kLayoutVersion).arg(workspace);
}

}  // namespace

Settings::Settings(const QString& file)
    : file_(file.isEmpty()
                ? QStandardPaths::writableLocation(QStandardPaths::GenericConfigLocation) +
                      "/robomosp/desktop.ini"
                : file,
            QSettings::IniFormat) {}

QByteArray Settings::layout(const QString& workspace) const {
  return file_.value(layout_key(workspace)).toByteArray();
}
void Settings::set_layout(const QString& workspace, const QByteArray& state) {
  file_.setValue(layout_key(workspace), state);
}
void Settings::forget_layouts() { file_.remove(QString("layout%1").arg(kLayoutVersion)); }

bool Settings::is_dark() const { return file_.value("window/theme", "dark").toString() != "light"; }
void Settings::set_dark(bool on) { file_.setValue("window/theme", on ? "dark" : "light"); }

double Settings::zoom() const { return file_.value("window/zoom", 1.0).toDouble(); }
void Settings::set_zoom(double zoom) { file_.setValue("window/zoom", zoom); }

QString Settings::workspace() const { return file_.value("window/workspace", "motion").toString(); }
void Settings::set_workspace(const QString& name) { file_.setValue("window/workspace", name); }

QByteArray Settings::geometry() const { return file_.value("window/geometry").toByteArray(); }
void Settings::set_geometry(const QByteArray& geometry) {
  file_.setValue("window/geometry", geometry);
}

QStringList Settings::recent_files() const { return file_.value("files/recent").toStringList(); }
void Settings::add_recent_file(const QString& file) {
  QStringList all = recent_files();
  all.removeAll(file);
  all.prepend(file);
  file_.setValue("files/recent", all.mid(0, kRecentFiles));
}
void Settings::forget_recent_files() { file_.remove("files/recent"); }

QStringList Settings::console_history() const {
  return file_.value("console/history").toStringList();
}
void Settings::set_console_history(const QStringList& lines) {
  file_.setValue("console/history",
                 lines.mid(std::max<qsizetype>(0, lines.size() - kHistoryLines)));
}

}  // namespace robomosp::viewer
