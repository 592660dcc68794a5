// SPDX-License-Identifier: Apache-2.0
#include "shell/pager.h"

#include <signal.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "kernel/text.h"

namespace robomosp::shell {
namespace {

std::size_t characters(std::string_view line) {
  return static_cast<std::size_t>(std::count_if(line.begin(), line.end(), [](char c) {
    return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U;
  }));
}

/// Rows that a line takes on the screen.
std::size_t rows_of(std::string_view line, std::size_t columns) {
  const std::size_t n = characters(line);
  return n == 0 ? 1 : (n + columns - 1) / columns;
}

void write_line(std::string_view line) {
  std::fwrite(line.data(), 1, line.size(), stdout);
  std::fputc('\n', stdout);
}

/// While it lives Ctrl-C is for the pager: a handler that does nothing here and that a program
/// which is started does not inherit.
class InterruptsElsewhere {
 public:
  InterruptsElsewhere() {
    struct sigaction nothing {};
    nothing.sa_handler = [](int) {};
    nothing.sa_flags = SA_RESTART;
    ::sigaction(SIGINT, &nothing, &before_);
  }
  ~InterruptsElsewhere() { ::sigaction(SIGINT, &before_, nullptr); }
  InterruptsElsewhere(const InterruptsElsewhere&) = delete;
  InterruptsElsewhere& operator=(const InterruptsElsewhere&) = delete;

 private:
  struct sigaction before_ {};
};

/// Single keys without echo.
class Keys {
 public:
  Keys() {
    ::tcgetattr(STDIN_FILENO, &before_);
    termios raw = before_;
    raw.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO | ISIG);
    raw.c_cc[VMIN] = 1;
    raw.c_cc[VTIME] = 0;
    ::tcsetattr(STDIN_FILENO, TCSANOW, &raw);
  }
  ~Keys() { ::tcsetattr(STDIN_FILENO, TCSANOW, &before_); }
  Keys(const Keys&) = delete;
  Keys& operator=(const Keys&) = delete;
  /// 'q' when there are no more.
  [[nodiscard]] static char next() {
    char key = 'q';
    while (::read(STDIN_FILENO, &key, 1) < 0)
      if (errno != EINTR) return 'q';
    return key;
  }

 private:
  termios before_{};
};

void show_by_keys(const std::vector<std::string_view>& lines, TerminalSize size) {
  const std::size_t page = std::max<std::size_t>(size.rows, 3) - 1;
  std::size_t room = page;
  const Keys keys;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const std::size_t rows = rows_of(lines[i], size.columns);
    if (rows > room) {
      std::printf("\x1b[7m-- %zu more lines: space, Enter, q --\x1b[0m", lines.size() - i);
      std::fflush(stdout);
      const char key = Keys::next();
      std::printf("\r\x1b[K");
      if (key == 'q' || key == 'Q' || key == '\x03' || key == '\x04' || key == '\x1b') {
        std::fflush(stdout);
        return;
      }
      room = key == '\r' || key == '\n' || key == 'j' ? rows : std::max(rows, page);
    }
    write_line(lines[i]);
    room -= rows;
  }
}

}  // namespace

TerminalSize terminal_size() {
  TerminalSize out;
  winsize size{};
  if (::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0) {
    if (size.ws_col > 0) out.columns = size.ws_col;
    if (size.ws_row > 0) out.rows = size.ws_row;
  }
  return out;
}

void show_paged(std::string_view text) {
  const TerminalSize size = terminal_size();
  const std::vector<std::string_view> lines = text::split(text, '\n');
  std::size_t rows = 0;
  for (const std::string_view line : lines) rows += rows_of(line, size.columns);
  const char* program = std::getenv("PAGER");
  const char* terminal = std::getenv("TERM");
  const bool is_dumb = !terminal || std::string_view(terminal) == "dumb";
  const bool is_off = program && (*program == '\0' || std::string_view(program) == "cat");
  if (rows < size.rows || is_off || (!program && is_dumb)) {
    write_line(text);
    std::fflush(stdout);
    return;
  }
  std::fflush(stdout);
  const InterruptsElsewhere elsewhere;
  if (program) {
    // As others set it who call less: leave the screen as it is, show colours.
    ::setenv("LESS", "FRX", 0);
    if (std::FILE* pipe = ::popen(program, "w")) {
      std::fwrite(text.data(), 1, text.size(), pipe);
      std::fputc('\n', pipe);
      constexpr int kNotFound = 127;
      const int status = ::pclose(pipe);
      if (!(WIFEXITED(status) && WEXITSTATUS(status) == kNotFound)) return;
    }
  }
  show_by_keys(lines, size);
  std::fflush(stdout);
}

}  // namespace robomosp::shell
