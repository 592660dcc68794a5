// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/desktop/manual.h"

#include <algorithm>
#include <utility>

#include <QDir>
#include <QDirIterator>
#include <QFile>
#include <QFileInfo>
#include <QRegularExpression>

namespace robomosp::viewer {
namespace {

constexpr qint64 kLongestPage = 4 << 20;  ///< [bytes]

QString file_text(const QString& path) {
  QFile file(path);
  if (!file.open(QIODevice::ReadOnly)) return {};
  return QString::fromUtf8(file.read(kLongestPage));
}

/// The page of the commands that begin like this one.
QString page_of_command(const QString& name) {
  const auto dot = name.indexOf('.');
  return "ioci/" + (dot < 0 ? QString("general") : name.left(dot)) + ".md";
}

}  // namespace

Manual::Manual(std::filesystem::path folder)
    : folder_(std::move(folder)), share_(folder_.parent_path()) {
  std::error_code none;
  if (auto whole = std::filesystem::weakly_canonical(folder_, none); !none) folder_ = whole;
}

bool Manual::is_there() const {
  return QFileInfo::exists(QString::fromStdString(folder_) + "/user");
}

std::optional<QString> Manual::read(const QString& page) const {
  const QString clean = QDir::cleanPath(page);
  if (clean.startsWith("..") || clean.startsWith('/') || !clean.endsWith(".md"))
    return std::nullopt;
  const QString path = QString::fromStdString(folder_) + "/" + clean;
  if (!QFileInfo(path).isFile()) return std::nullopt;
  return file_text(path);
}

std::optional<QString> Manual::command(const QString& name) const {
  const std::optional<QString> page = read(page_of_command(name));
  if (!page) return std::nullopt;
  const QString head = "\n## " + name + "\n";
  const auto from = page->indexOf(head);
  if (from < 0) return std::nullopt;
  const auto end = page->indexOf("\n## ", from + head.size() - 1);
  return "# " + name + "\n" +
         page->mid(from + head.size(), end < 0 ? -1 : end - from - head.size());
}

QStringList Manual::pages(const QString& folder) const {
  QStringList out;
  const QDir root(QString::fromStdString(folder_));
  QDirIterator it(root.filePath(folder), {"*.md"}, QDir::Files, QDirIterator::Subdirectories);
  while (it.hasNext()) out += root.relativeFilePath(it.next());
  out.sort();
  return out;
}

QStringList Manual::script_files() const {
  QStringList out;
  for (const char* folder : {"examples", "demos"}) {
    const QDir all(QString::fromStdString((share_ / folder).string()));
    for (const QString& name : all.entryList({"*.lua"}, QDir::Files, QDir::Name))
      if (!name.endsWith("_pictures.lua"))  // they draw those of the pages
        out += all.filePath(name);
  }
  return out;
}

std::vector<Manual::Script> Manual::scripts() const {
  std::vector<Script> out;
  for (const QString& path : script_files()) {
    QFile file(path);
    QString title;
    if (file.open(QIODevice::ReadOnly))
      while (title.isEmpty() && !file.atEnd()) {
        const QString line = QString::fromUtf8(file.readLine(400)).trimmed();
        if (!line.isEmpty() && !line.startsWith("--")) break;
        if (!line.contains("SPDX")) title = line.mid(2).trimmed();
      }
    out.push_back({path, title});
  }
  return out;
}

QString Manual::title(const QString& page) const {
  QFile file(QString::fromStdString(folder_) + "/" + page);
  if (!file.open(QIODevice::ReadOnly)) return page;
  while (!file.atEnd()) {
    const QString line = QString::fromUtf8(file.readLine(1000)).trimmed();
    if (line.startsWith("# ")) return line.mid(2);
  }
  return page;
}

QString Manual::anchor_of(const QString& heading) {
  QString out;
  for (const QChar c : heading.toLower()) {
    if (c.isLetterOrNumber() || c == '_' || c == '-') out += c;
    else if (c == ' ') out += '-';
  }
  return out;
}

const std::vector<ManualSection>& Manual::sections() const {
  if (std::exchange(is_read_, true)) return sections_;
  for (const char* folder : {"user", "ioci"})
    for (const QString& page : pages(folder)) {
      const bool has_commands = page.startsWith("ioci/");
      if (page == "ioci/README.md") continue;  // a list of what the other pages have
      const QString text = file_text(QString::fromStdString(folder_) + "/" + page);
      const QString chapter = title(page);
      bool is_code = false;
      for (const QStringView line : QStringView(text).split('\n')) {
        if (line.startsWith(QLatin1String("```"))) is_code = !is_code;
        const bool is_heading = !is_code && line.startsWith('#') && line.contains(' ');
        if (is_heading) {
          const QString heading = line.mid(line.indexOf(' ') + 1).trimmed().toString();
          const bool is_top = line.startsWith(QLatin1String("# "));
          const bool is_command = has_commands && !is_top;
          sections_.push_back({is_command ? "command:" + heading : page,
                               chapter,
                               heading,
                               is_top || is_command ? QString() : anchor_of(heading),
                               {}});
        } else if (!sections_.empty() && sections_.back().chapter == chapter) {
          sections_.back().text += line;
          sections_.back().text += '\n';
        }
      }
    }
  return sections_;
}

std::vector<const ManualSection*> Manual::search(const QString& words, std::size_t at_most) const {
  const QStringList wanted = words.simplified().split(' ', Qt::SkipEmptyParts);
  if (wanted.isEmpty()) return {};
  struct Found {
    const ManualSection* section;
    int rank;
  };
  std::vector<Found> found;
  for (const ManualSection& s : sections()) {
    int rank = s.title.compare(words.trimmed(), Qt::CaseInsensitive) == 0 ? -100 : 0;
    const bool has_all = std::all_of(wanted.begin(), wanted.end(), [&](const QString& w) {
      if (s.title.contains(w, Qt::CaseInsensitive)) {
        rank -= 10;
        return true;
      }
      if (s.chapter.contains(w, Qt::CaseInsensitive)) {
        rank -= 3;
        return true;
      }
      return s.text.contains(w, Qt::CaseInsensitive);
    });
    if (!has_all) continue;
    if (!s.page.startsWith("command:")) rank -= 2;  // chapters explain, commands list
    found.push_back({&s, rank});
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const Found& a, const Found& b) { return a.rank < b.rank; });
  std::vector<const ManualSection*> out;
  for (const Found& f : found) {
    if (out.size() == at_most) break;
    out.push_back(f.section);
  }
  return out;
}

QString excerpt_of(const ManualSection& section, const QString& words) {
  constexpr int kBefore = 40, kLength = 150;
  QString text = section.text.simplified();
  qsizetype at = -1;
  for (const QString& w : words.simplified().split(' ', Qt::SkipEmptyParts))
    if (at < 0) at = text.indexOf(w, 0, Qt::CaseInsensitive);
  qsizetype from = std::max<qsizetype>(0, at - kBefore);
  if (from > 0) from = text.indexOf(' ', from) + 1;
  QString out = text.mid(from, kLength);
  // What would be taken for links, tables, code or emphasis.
  out.remove(QRegularExpression("[\\[\\]`|*#<>]"));
  return (from > 0 ? "... " : "") + out + (from + kLength < text.size() ? " ..." : "");
}

}  // namespace robomosp::viewer
