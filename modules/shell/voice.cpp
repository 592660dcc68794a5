// SPDX-License-Identifier: Apache-2.0
#include "shell/voice.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>

#include "kernel/text.h"
#include "shell/pager.h"
#include "shell/shell.h"

namespace robomosp::shell {

using remote::error_map;
using remote::to_json;

int exit_code(ErrorCode code) {
  switch (code) {
    case ErrorCode::usage: return 2;
    case ErrorCode::invalid_argument:
    case ErrorCode::unknown_name:
    case ErrorCode::not_found:
    case ErrorCode::syntax:
    case ErrorCode::conflict:
    case ErrorCode::stale_handle:
    case ErrorCode::plugin_refused:
    case ErrorCode::permission:
    case ErrorCode::unsupported: return 3;
    case ErrorCode::unreachable: return 4;
    case ErrorCode::cancelled: return 130;
    case ErrorCode::io:
    case ErrorCode::plugin_failed:
    case ErrorCode::internal:
    case ErrorCode::script_failed: return 1;
  }
  return 1;
}

void ProgressLine::show(double fraction, std::string_view what) {
  std::string words = text::visible(what);
  std::replace(words.begin(), words.end(), '\n', ' ');
  std::fprintf(stderr, "\r[%3d%%] %s\x1b[K", static_cast<int>(fraction * 100), words.c_str());
  is_shown_ = true;
}

void ProgressLine::erase() {
  if (is_shown_.exchange(false)) std::fprintf(stderr, "\r\x1b[K");
}

ProgressLine& progress_line() {
  static ProgressLine line;
  return line;
}

Voice::Voice(const Settings& s) : settings_(s) {
  const char* no_color = std::getenv("NO_COLOR");
  color_ = s.color == "always" ||
           (s.color == "auto" && ::isatty(STDERR_FILENO) != 0 && !(no_color && *no_color));
}

int Voice::keep_output() {
  std::fflush(stdout);
  const int fd = ::fcntl(STDOUT_FILENO, F_DUPFD_CLOEXEC, STDERR_FILENO + 1);
  std::FILE* answers = fd < 0 ? nullptr : ::fdopen(fd, "w");
  if (!answers || ::dup2(STDERR_FILENO, STDOUT_FILENO) < 0) return STDOUT_FILENO;
  out_ = answers;
  return fd;
}

int Voice::fail(const Error& e, std::string_view trace) const {
  const Error said = text::shortened(e);
  if (settings_.json) line(to_json(Map{{"ok", false}, {"error", error_map(said)}}));
  else to_stderr("error", "\x1b[31m", said.sentence());
  if (settings_.trace && !trace.empty())
    std::fprintf(stderr, "%s\n", text::visible(text::shortened(std::string(trace))).c_str());
  return exit_code(e.code);
}

void Voice::note(std::string_view text) const {
  if (!settings_.quiet && !settings_.json) to_stderr("note", "\x1b[36m", text);
}

void Voice::warn(std::string_view text) const {
  if (!settings_.quiet) to_stderr("warning", "\x1b[33m", text);
}

void Voice::line(std::string_view text) const {
  progress_line().erase();
  std::fwrite(text.data(), 1, text.size(), out_);
  std::fputc('\n', out_);
  std::fflush(out_);
}

void Voice::result(const Value& value, std::string_view text, const NameOf& name_of) const {
  if (settings_.json)
    line(
        to_json(value.is_nil() ? Map{{"ok", true}} : Map{{"ok", true}, {"value", value}}, name_of));
  else if (!text.empty()) show(text.ends_with('\n') ? text.substr(0, text.size() - 1) : text);
}

void Voice::show(std::string_view text) const {
  const std::string shown = text::visible(text);
  progress_line().erase();
  if (pages_) show_paged(shown);
  else line(shown);
}

void Voice::to_stderr(const char* word, const char* color, std::string_view text) const {
  const std::string shown = text::visible(text);
  progress_line().erase();
  std::fprintf(stderr, "%s%s:%s %s\n", color_ ? color : "", word, color_ ? "\x1b[0m" : "",
               shown.c_str());
}

}  // namespace robomosp::shell
