// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/desktop/end_signals.h"

#include <atomic>
#include <cerrno>
#include <csignal>
#include <utility>

#include <fcntl.h>
#include <unistd.h>

#include <QSocketNotifier>

namespace robomosp::viewer {
namespace {

constexpr int kEndSignals[] = {SIGTERM, SIGINT, SIGHUP};
std::atomic<int> end_pipe{-1};

void note_end(int signal) {
  const int kept = errno;
  const char byte = static_cast<char>(signal);
  if (const int pipe = end_pipe.load(); pipe >= 0)
    while (::write(pipe, &byte, 1) < 0 && errno == EINTR) {
    }
  errno = kept;
}

}  // namespace

EndSignals::EndSignals(std::function<void(int)> end, QObject* parent)
    : QObject(parent), end_(std::move(end)) {
  if (::pipe2(pipe_.data(), O_CLOEXEC | O_NONBLOCK) != 0) return;  // signals end it as ever
  end_pipe = pipe_[1];
  notifier_ = new QSocketNotifier(pipe_[0], QSocketNotifier::Read, this);
  connect(notifier_, &QSocketNotifier::activated, this, [this] {
    char byte = 0;
    if (::read(pipe_[0], &byte, 1) == 1) end_(byte);
  });
  struct sigaction action {};
  action.sa_handler = note_end;
  action.sa_flags = static_cast<int>(SA_RESETHAND);  // the second one ends the process
  for (const int signal : kEndSignals) ::sigaction(signal, &action, nullptr);
}

EndSignals::~EndSignals() {
  if (pipe_[0] < 0) return;
  for (const int signal : kEndSignals) std::signal(signal, SIG_DFL);
  end_pipe = -1;
  ::close(pipe_[0]);
  ::close(pipe_[1]);
}

}  // namespace robomosp::viewer
