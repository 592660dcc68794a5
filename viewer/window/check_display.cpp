// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/window/check_display.h"

#include <cerrno>
#include <csignal>
#include <string>

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <QGuiApplication>

namespace robomosp::viewer {
namespace {

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

}  // namespace robomosp::viewer
