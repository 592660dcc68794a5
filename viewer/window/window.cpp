// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/window/window.h"

#include <algorithm>
#include <cerrno>
#include <clocale>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <memory>
#include <string>

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <QAction>
#include <QApplication>
#include <QElapsedTimer>
#include <QGuiApplication>
#include <QPainter>
#include <QTimer>

#include "viewer/window/display.h"
#include "viewer/window/theme.h"
#include "viewer/window/viewer_window.h"

namespace robomosp::viewer {
namespace {

int refuse(const Error& reason) {
  std::fprintf(stderr, "%s\n", reason.sentence().c_str());
  return 1;
}

Error no_window(const std::string& reason) {
  return error(ErrorCode::unsupported, "cannot open a window, because " + reason,
               "Start the program in a desktop session, or draw the picture into a file instead "
               "with --render FILE.");
}

/// What the child of `check_display` does: lets Qt connect, silently, and ends.
[[noreturn]] void try_display() {
  // Qt aborts without a display; that shall leave neither text nor a core file.
  const rlimit no_core{};
  setrlimit(RLIMIT_CORE, &no_core);
  if (const int null = open("/dev/null", O_RDWR | O_CLOEXEC); null >= 0) {
    dup2(null, STDOUT_FILENO);
    dup2(null, STDERR_FILENO);
  }
  std::signal(SIGABRT, SIG_DFL);
  std::signal(SIGALRM, SIG_DFL);
  sigset_t alarm_only;
  sigemptyset(&alarm_only);
  sigaddset(&alarm_only, SIGALRM);
  sigprocmask(SIG_UNBLOCK, &alarm_only, nullptr);
  alarm(5);  // A display that accepts the connection and never answers.
  int count = 1;
  char name[] = "robomosp";
  char* arguments[] = {name, nullptr};
  const QGuiApplication application(count, arguments);
  _exit(0);
}

std::unique_ptr<QApplication> make_application() {
  static int count = 1;
  static char name[] = "robomosp";
  static char* arguments[] = {name, nullptr};
  auto application = std::make_unique<QApplication>(count, arguments);
  // Qt takes the locale of the system; numbers in files must not follow it.
  std::setlocale(LC_NUMERIC, "C");
  apply_dark_theme(*application);
  return application;
}

Result<void> save_window(ViewerWindow& window, const std::string& path) {
  // The OpenGL part of a grabbed window may be missing; paint it in from its own framebuffer.
  QImage picture = window.grab().toImage();
  QPainter painter(&picture);
  Display& display = window.display();
  painter.drawImage(QRect(display.mapTo(&window, QPoint(0, 0)), display.size()), display.shown());
  painter.end();
  if (picture.save(QString::fromStdString(path), "PNG")) return {};
  return error(ErrorCode::io, "cannot write the picture \"" + path + "\"",
               "Check that the folder exists and may be written.");
}

}  // namespace

Result<void> check_display() {
  static bool answered = false;
  if (answered || QCoreApplication::instance() != nullptr) return {};
  std::string asked;
  for (const char* name : {"DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM"}) {
    if (qEnvironmentVariableIsEmpty(name)) continue;
    asked += (asked.empty() ? "" : ", ") + std::string(name) + " is \"" +
             qgetenv(name).toStdString() + "\"";
  }
  if (asked.empty())
    return no_window("there is no display: neither DISPLAY nor WAYLAND_DISPLAY is set");
  const pid_t child = fork();
  if (child == 0) try_display();
  int status = 0;
  pid_t ended = child;
  if (child > 0) {
    do ended = waitpid(child, &status, 0);
    while (ended < 0 && errno == EINTR);
  }
  if (ended < 0) return no_window("the system starts no process to try the display");
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
    return no_window("the display does not answer: " + asked);
  answered = true;
  return {};
}

int run_window(const Frame& frame, const Playback& playback, const WindowOptions& options) {
  if (const auto display = check_display(); !display) return refuse(display.error());
  std::unique_ptr<QApplication> application;
  if (QCoreApplication::instance() == nullptr) application = make_application();

  auto display = Display::create(options.quality, options.software_view);
  if (!display) return refuse(display.error());
  ViewerWindow window(std::move(display).value());
  window.setWindowTitle(QString::fromStdString(options.title));
  window.resize(std::clamp(options.width, 480, 16000), std::clamp(options.height, 360, 16000));
  window.on_pick = options.on_pick;
  window.set_frame(frame);
  window.set_playback(playback);
  if (options.on_open) options.on_open(window);
  window.set_speed(options.speed);
  if (auto* refine = window.findChild<QAction*>("refine")) refine->setChecked(options.refine);
  window.show();
  if (options.play) window.play(true);

  int status = 0;
  const double after = std::isfinite(options.screenshot_after) ? options.screenshot_after : 0;
  QElapsedTimer shown;
  QTimer watch;
  QObject::connect(&watch, &QTimer::timeout, &window, [&] {
    if (window.display().pictures_drawn() == 0) return;
    if (!shown.isValid()) {
      shown.start();
      if (options.on_shown) options.on_shown(window);
      if (options.screenshot.empty()) watch.stop();
      return;
    }
    const double waited = 1e-3 * static_cast<double>(shown.elapsed());
    if (waited < after) return;
    const bool may_improve = options.refine && !window.is_playing() && waited < after + 60;
    if (may_improve && !window.display().is_refined()) return;
    watch.stop();
    if (const auto saved = save_window(window, options.screenshot); !saved)
      status = refuse(saved.error());
    window.close();
  });
  watch.start(20);
  QApplication::exec();
  return status;
}

}  // namespace robomosp::viewer
