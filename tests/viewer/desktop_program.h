// SPDX-License-Identifier: GPL-3.0-or-later
// The program robomosp-desktop as a child of a test, with its own home folder.
#pragma once

#include <string>

#include <QElapsedTimer>
#include <QFile>
#include <QProcess>
#include <QProcessEnvironment>
#include <QString>
#include <QStringList>
#include <QTemporaryDir>

namespace robomosp::viewer {

/// What a child did until it ended.
struct ProgramEnd {
  int status = -1;  ///< of its exit; -1 = it was killed, or crashed
  bool is_late = false;
  std::string out, err;
};

class DesktopProgram {
 public:
  explicit DesktopProgram(const QTemporaryDir& home)
      : environment_(QProcessEnvironment::systemEnvironment()) {
    environment_.insert("HOME", home.path());
    environment_.insert("XDG_RUNTIME_DIR", home.path());
    for (const char* name :
         {"XDG_CACHE_HOME", "XDG_CONFIG_HOME", "XDG_STATE_HOME", "XDG_DATA_HOME"})
      environment_.remove(name);
    environment_.insert("ROBOMOSP_NO_THUMBNAILS", "1");
  }
  ~DesktopProgram() {
    if (process_.state() == QProcess::NotRunning) return;
    process_.kill();
    process_.waitForFinished(5000);
  }
  DesktopProgram(const DesktopProgram&) = delete;
  DesktopProgram& operator=(const DesktopProgram&) = delete;

  /// A variable of its environment; "" removes it.
  DesktopProgram& with(const QString& name, const QString& value) {
    if (value.isEmpty()) environment_.remove(name);
    else environment_.insert(name, value);
    return *this;
  }
  /// Limits bytes of files that it writes.
  DesktopProgram& with_file_limit(const QString& blocks) {
    limit_ = blocks;
    return *this;
  }
  void start(const QStringList& args) {
    process_.setProcessEnvironment(environment_);
    const QString program = QString(ROBOMOSP_BUILD_DIR) + "/bin/robomosp-desktop";
    if (limit_.isEmpty()) {
      process_.start(program, args);
    } else {
      process_.start(
          "/bin/sh",
          QStringList{"-c", "ulimit -f " + limit_ + "; exec \"$0\" \"$@\"", program} + args);
    }
    process_.waitForStarted();
  }
  /// Waits for its end.
  ProgramEnd end(int patience_ms = 120000) {
    ProgramEnd e;
    e.is_late = !process_.waitForFinished(patience_ms);
    if (e.is_late) {
      process_.kill();
      process_.waitForFinished(5000);
    }
    e.status = process_.exitStatus() == QProcess::NormalExit ? process_.exitCode() : -1;
    e.out = out_ + process_.readAllStandardOutput().toStdString();
    e.err = process_.readAllStandardError().toStdString();
    return e;
  }
  ProgramEnd run(const QStringList& args) {
    start(args);
    return end();
  }
  /// Waits until it has printed a text.
  bool has_printed(const std::string& text, int patience_ms = 120000) {
    QElapsedTimer clock;
    clock.start();
    while (out_.find(text) == std::string::npos) {
      if (clock.elapsed() > patience_ms || process_.state() == QProcess::NotRunning) return false;
      process_.waitForReadyRead(100);
      out_ += process_.readAllStandardOutput().toStdString();
    }
    return true;
  }
  /// SIGKILL: no chance to tidy up.
  void kill() {
    process_.kill();
    process_.waitForFinished(10000);
    out_ += process_.readAllStandardOutput().toStdString();
  }
  /// SIGTERM: it is to end by itself. The time that it took [ms]; -1 = it did not end.
  qint64 terminate() {
    QElapsedTimer clock;
    clock.start();
    process_.terminate();
    const bool has_ended = process_.waitForFinished(60000);
    out_ += process_.readAllStandardOutput().toStdString();
    return has_ended ? clock.elapsed() : -1;
  }
  [[nodiscard]] int exit_code() const { return process_.exitCode(); }
  [[nodiscard]] const std::string& printed() const { return out_; }

 private:
  QProcessEnvironment environment_;
  QProcess process_;
  QString limit_;
  std::string out_;
};

/// Writes a text file and returns its path.
inline QString written(const QTemporaryDir& folder, const QString& name, const QByteArray& text) {
  QFile file(folder.filePath(name));
  if (file.open(QIODevice::WriteOnly)) file.write(text);
  return file.fileName();
}

}  // namespace robomosp::viewer
