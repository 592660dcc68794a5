// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/desktop/settings.h"

#include <algorithm>

#include <QDateTime>
#include <QStandardPaths>

#include "viewer/desktop/values.h"

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

QString Settings::file_of_user() {
  return QStandardPaths::writableLocation(QStandardPaths::GenericConfigLocation) +
         "/robomosp/desktop.ini";
}

Settings::Settings(const QString& file)
    : file_(file.isEmpty() ? file_of_user() : file, QSettings::IniFormat) {}

std::optional<Error> Settings::write() {
  // An unchanged file would not be written, and a full disk not be noticed.
  file_.setValue("window/written", QDateTime::currentDateTimeUtc().toString(Qt::ISODateWithMs));
  file_.sync();
  // A file in a wrong format is written anew.
  if (file_.status() != QSettings::AccessError && file_.isWritable()) return std::nullopt;
  return error(ErrorCode::io,
               "the settings of the window (layout, theme, recent files) are lost when it closes: "
               "the file \"" +
                   utf8(file_.fileName()) + "\" cannot be written",
               "Check that its folder may be written and that the disk is not full.");
}

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

bool Settings::has_strong_borders() const {
  return file_.value("window/strong_borders", false).toBool();
}
void Settings::set_strong_borders(bool on) { file_.setValue("window/strong_borders", on); }

bool Settings::has_fine_pictures() const {
  return file_.value("window/fine_pictures", true).toBool();
}
void Settings::set_fine_pictures(bool on) { file_.setValue("window/fine_pictures", on); }

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

QStringList Settings::recent_commands() const {
  return file_.value("palette/recent").toStringList();
}
void Settings::set_recent_commands(const QStringList& names) {
  file_.setValue("palette/recent", names);
}

std::map<QString, QString> Settings::shortcuts() const {
  std::map<QString, QString> out;
  const QString group = "shortcuts/";
  for (const QString& key : file_.allKeys())
    if (key.startsWith(group)) out.emplace(key.mid(group.size()), file_.value(key).toString());
  return out;
}
void Settings::set_shortcut(const QString& action, const QString& keys) {
  file_.setValue("shortcuts/" + action, keys);
}
void Settings::forget_shortcut(const QString& action) { file_.remove("shortcuts/" + action); }
void Settings::forget_shortcuts() { file_.remove("shortcuts"); }

QStringList Settings::console_history() const {
  return file_.value("console/history").toStringList();
}
void Settings::set_console_history(const QStringList& lines) {
  file_.setValue("console/history",
                 lines.mid(std::max<qsizetype>(0, lines.size() - kHistoryLines)));
}

QMap<QString, QString> Settings::user_views(const QString& record) const {
  QMap<QString, QString> out;
  const QVariantMap kept = file_.value("views/" + record).toMap();
  for (auto i = kept.begin(); i != kept.end(); ++i) out.insert(i.key(), i.value().toString());
  return out;
}

void Settings::set_user_views(const QString& record, const QMap<QString, QString>& views) {
  QVariantMap kept;
  for (auto i = views.begin(); i != views.end(); ++i) kept.insert(i.key(), i.value());
  if (kept.isEmpty()) file_.remove("views/" + record);
  else file_.setValue("views/" + record, kept);
}

QVariant Settings::timeline(const QString& key) const { return file_.value("timeline/" + key); }

void Settings::set_timeline(const QString& key, const QVariant& value) {
  file_.setValue("timeline/" + key, value);
}

}  // namespace robomosp::viewer
