// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/desktop/thumbnails.h"

#include <sys/prctl.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>

#include <QCoreApplication>
#include <QDir>
#include <QFileInfo>
#include <QImageReader>
#include <QStandardPaths>

#include "viewer/desktop/values.h"
#include "viewer/theme/theme.h"

namespace robomosp::viewer {
namespace {

/// Counted up when pictures are drawn in another manner.
constexpr const char* kPictureVersion = "3";
constexpr int kEndMs = 1000;

/// The program that draws: this one, or the one beside the program of a test.
QString drawing_program() {
  const QString here = QCoreApplication::applicationDirPath();
  for (const char* place : {"/robomosp-desktop", "/../bin/robomosp-desktop"})
    if (QFileInfo(here + place).isExecutable()) return QDir::cleanPath(here + place);
  return {};
}

}  // namespace

Thumbnails::Thumbnails(QObject* parent) : QObject(parent), themed_(theme_revision()) {
  setObjectName("thumbnails");
  load_timer_.setSingleShot(true);
  load_timer_.setInterval(0);
  connect(&load_timer_, &QTimer::timeout, this, [this] { load_next(); });
  connect(&drawer_, &QProcess::finished, this, [this] { take_drawn(); });
  connect(&drawer_, &QProcess::errorOccurred, this, [this](QProcess::ProcessError e) {
    if (e == QProcess::FailedToStart) take_drawn();
  });
}

Thumbnails::~Thumbnails() {
  drawer_.disconnect();
  drawer_.kill();
  drawer_.waitForFinished(kEndMs);
}

void Thumbnails::know(const std::string& kind, const List& rows) {
  kinds_.insert(kind);
  for (const Value& value : rows) {
    const Map& row = map_of(value);
    known_[{kind, text_at(row, "name")}] = {shown(text_at(row, "file")),
                                            shown(text_at(row, "digest")),
                                            shown(text_at(row, "description"))};
  }
}

QString Thumbnails::description(const std::string& kind, const std::string& name) const {
  const auto at = known_.find({kind, name});
  return at == known_.end() ? QString() : at->second.description;
}

QString Thumbnails::folder() {
  return QStandardPaths::writableLocation(QStandardPaths::GenericCacheLocation) +
         "/robomosp/pictures/";
}

QString Thumbnails::picture_file(const Key& key, const Known& known, bool is_dark) const {
  return folder() + shown(key.first) + "-" + shown(key.second) + "-" + known.digest + "-" +
         kPictureVersion + (is_dark ? "-dark.png" : "-light.png");
}

QString Thumbnails::file(const std::string& kind, const std::string& name) {
  const Key key{kind, name};
  const auto at = known_.find(key);
  if (at == known_.end() || at->second.digest.isEmpty()) return {};
  if (themed_ != theme_revision()) {
    themed_ = theme_revision();
    to_draw_.clear();  // what is still shown asks again
  }
  const QString wanted = picture_file(key, at->second, theme().is_dark),
                other = picture_file(key, at->second, !theme().is_dark);
  if (QFileInfo::exists(wanted)) return wanted;
  const bool is_drawn_now = is_busy_ && drawn_file_ == wanted;
  if (!refused_.contains(wanted) && !is_drawn_now &&
      std::find(to_draw_.begin(), to_draw_.end(), key) == to_draw_.end()) {
    to_draw_.push_back(key);
    draw_soon();
  }
  return QFileInfo::exists(other) ? other : QString();
}

QPixmap Thumbnails::small(const std::string& kind, const std::string& name, int height,
                          double ratio) {
  const QString picture = file(kind, name);
  if (picture.isEmpty()) return {};
  const QString key = picture + QString("@%1x%2").arg(height).arg(ratio);
  if (const auto at = small_.find(key); at != small_.end()) return at->second;
  if (loading_.insert(key).second) {
    to_load_.push_back({{kind, name}, picture, key, height, ratio});
    load_timer_.start();
  }
  return {};
}

/// One file at a time, so that the window stays responsive.
void Thumbnails::load_next() {
  if (to_load_.empty()) return;
  const Load load = to_load_.front();
  to_load_.pop_front();
  if (!to_load_.empty()) load_timer_.start();
  QImageReader reader(load.file);
  const int height = std::max(1, static_cast<int>(load.height * load.ratio));
  reader.setScaledSize(QSize(height * kWidth / kHeight, height));
  QPixmap pixmap = QPixmap::fromImage(reader.read());
  pixmap.setDevicePixelRatio(load.ratio);
  loading_.erase(load.name);
  small_[load.name] = pixmap;  // also if it is damaged, so that it is not read again
  drawn(load.key.first, load.key.second);
}

bool Thumbnails::is_drawing() const { return is_busy_ || !to_draw_.empty() || !to_load_.empty(); }

/// Not within the painting of a row.
void Thumbnails::draw_soon() {
  QMetaObject::invokeMethod(
      this, [this] { draw_next(); }, Qt::QueuedConnection);
}

/// Another process draws, one picture at a time and below all else: a record is loaded and made
/// there, so that neither this document nor this memory keeps it.
void Thumbnails::draw_next() {
  if (is_busy_ || to_draw_.empty()) return;
  if (qEnvironmentVariableIsSet("ROBOMOSP_NO_THUMBNAILS")) return to_draw_.clear();
  is_busy_ = true;
  const QString program = drawing_program();
  drawn_key_ = to_draw_.front();
  to_draw_.pop_front();
  const Known& known = known_[drawn_key_];
  const bool is_dark = theme().is_dark;
  drawn_file_ = picture_file(drawn_key_, known, is_dark);
  if (program.isEmpty() || !QDir().mkpath(folder())) return take_drawn();
  drawer_.setProcessChannelMode(QProcess::MergedChannels);
  // The system ends it with the window, however that ends.
  const pid_t window = ::getpid();
  drawer_.setChildProcessModifier([window] {
    ::prctl(PR_SET_PDEATHSIG, static_cast<unsigned long>(SIGKILL), 0UL, 0UL, 0UL);
    if (::getppid() != window) ::_exit(1);  // it has ended already
  });
  QStringList words{"-n",
                    QString::number(niceness),
                    program,
                    known.file,
                    "--still",
                    "--fast",
                    "--no-axes",
                    "--size",
                    QString("%1x%2").arg(kWidth).arg(kHeight),
                    "--render",
                    drawn_file_};
  if (is_dark)
    words << "--background"
          << "dark";
  drawer_.start("nice", words);
}

void Thumbnails::take_drawn() {
  if (!std::exchange(is_busy_, false)) return;
  const QString said =
      drawer_.isOpen() ? QString::fromUtf8(drawer_.readAll()).simplified() : QString();
  if (QFileInfo::exists(drawn_file_)) {
    forget_older(drawn_file_);
    drawn(drawn_key_.first, drawn_key_.second);
  } else {
    refused_.insert(drawn_file_);
    if (!std::exchange(has_failed_, true))
      failed(QString("No picture of the %1 \"%2\" of the library: %3")
                 .arg(shown(drawn_key_.first), shown(drawn_key_.second),
                      said.isEmpty()
                          ? "robomosp-desktop was not found or could not write to " + folder()
                          : said.left(300)));
  }
  draw_soon();  // after the signal of the process
}

/// Of one record and theme only the present picture is kept.
void Thumbnails::forget_older(const QString& picture) const {
  const Known& known = known_.at(drawn_key_);
  const QFileInfo kept(picture);
  const QString head = shown(drawn_key_.first) + "-" + shown(drawn_key_.second) + "-",
                tail = kept.fileName().mid(head.size() + known.digest.size() + 1).section('-', -1);
  QDir in(folder());
  for (const QString& each : in.entryList({head + "*-" + tail}, QDir::Files))
    // A name such as "arm-2" begins like "arm".
    if (each != kept.fileName() && each.mid(head.size()).count('-') == 2) in.remove(each);
}

}  // namespace robomosp::viewer
