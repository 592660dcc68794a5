// SPDX-License-Identifier: Apache-2.0
#include "shell/console.h"

#include <histedit.h>
#include <langinfo.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <clocale>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <cwchar>

#include "shell/pager.h"

namespace robomosp::shell {

namespace fs = std::filesystem;

fs::path history_file() {
  if (const char* state = std::getenv("XDG_STATE_HOME"); state && *state == '/')
    return fs::path(state) / "robomosp" / "history";
  if (const char* home = std::getenv("HOME"); home && *home)
    return fs::path(home) / ".local" / "state" / "robomosp" / "history";
  return {};
}

struct LineEditor::Impl {
  Impl(const lua::LuaState& l, std::function<bool()> i) : lua(l), idle(std::move(i)) {}
  const lua::LuaState& lua;
  std::function<bool()> idle;
  EditLine* editor = nullptr;
  History* history = nullptr;
  fs::path file;
  std::string prompt, before;
  bool cancelled = false;
  int wake = -1;
};

namespace {

constexpr int kHistoryLines = 2000;
constexpr int kIdleEvery = 50;  // ms

LineEditor::Impl& impl_of(EditLine* editor) {
  void* data = nullptr;
  el_get(editor, EL_CLIENTDATA, &data);
  return *static_cast<LineEditor::Impl*>(data);
}

/// Rest of a UTF-8 character whose first byte was read.
wchar_t decode(int fd, unsigned char first) {
  const int more = first >= 0xF0 ? 3 : first >= 0xE0 ? 2 : first >= 0xC0 ? 1 : 0;
  if (more == 0) return first < 0x80 ? static_cast<wchar_t>(first) : L'\uFFFD';
  unsigned value = first & (0x3FU >> more);
  for (int i = 0; i < more; ++i) {
    unsigned char next = 0;
    if (::read(fd, &next, 1) != 1 || (next & 0xC0U) != 0x80U) return L'\uFFFD';
    value = (value << 6) | (next & 0x3FU);
  }
  return static_cast<wchar_t>(value);
}

void print_columns(const std::vector<std::string>& words) {
  const std::size_t width = terminal_size().columns;
  std::size_t longest = 1;
  for (const std::string& w : words) longest = std::max(longest, w.size() + 2);
  const std::size_t columns = std::max<std::size_t>(1, width / longest);
  const std::size_t rows = (words.size() + columns - 1) / columns;
  for (std::size_t r = 0; r < rows; ++r) {
    std::string line;
    for (std::size_t c = 0; c * rows + r < words.size(); ++c) {
      const std::string& w = words[c * rows + r];
      line += w;
      if ((c + 1) * rows + r < words.size()) line.append(longest - w.size(), ' ');
    }
    std::printf("%s\r\n", line.c_str());
  }
}

std::string common_start(const std::vector<std::string>& words) {
  std::string out = words.front();
  for (const std::string& w : words) {
    const auto end = std::mismatch(out.begin(), out.end(), w.begin(), w.end()).first;
    out.erase(end, out.end());
  }
  return out;
}

char* show_prompt(EditLine* editor) { return impl_of(editor).prompt.data(); }

/// Waits for a key; in between, what jobs ask of scripts gets its turn.
int read_key(EditLine* editor, wchar_t* out) {
  LineEditor::Impl& impl = impl_of(editor);
  for (;;) {
    pollfd ready[2]{{STDIN_FILENO, POLLIN, 0}, {impl.wake, POLLIN, 0}};
    const int n = ::poll(ready, 2, kIdleEvery);
    if (n <= 0 || ready[0].revents == 0) {
      if (n < 0 && errno != EINTR) return -1;
      // The prompt shows a moment before the terminal takes Ctrl-C as a key.
      if (!impl.idle()) continue;
      *out = L'\x03';
      return 1;
    }
    unsigned char first = 0;
    const ssize_t got = ::read(STDIN_FILENO, &first, 1);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return 0;
    *out = decode(STDIN_FILENO, first);
    return 1;
  }
}

/// Ctrl-C at the prompt: drops what was typed.
unsigned char cancel_line(EditLine* editor, int) {
  const LineInfo* line = el_line(editor);
  const auto length = static_cast<int>(line->lastchar - line->buffer);
  el_cursor(editor, static_cast<int>(line->lastchar - line->cursor));
  el_deletestr(editor, length);
  std::printf("^C\r\n");
  std::fflush(stdout);
  impl_of(editor).cancelled = true;
  return CC_NEWLINE;
}

unsigned char complete_word(EditLine* editor, int) {
  const LineEditor::Impl& impl = impl_of(editor);
  const LineInfo* line = el_line(editor);
  const std::string text = impl.before + std::string(line->buffer, line->lastchar);
  const std::size_t cursor =
      impl.before.size() + static_cast<std::size_t>(line->cursor - line->buffer);
  lua::Completion found = impl.lua.complete(text, cursor);
  if (found.words.empty()) return CC_REFRESH_BEEP;
  const std::string partial = text.substr(found.start, cursor - found.start);
  std::string fresh = common_start(found.words).substr(partial.size());
  if (found.words.size() == 1 && found.start > 0 && found.words[0].back() != '/') {
    const char before = text[found.start - 1];
    const bool closes = cursor < text.size() && text[cursor] == before;
    if ((before == '"' || before == '\'') && !closes) fresh += before;
  }
  if (!fresh.empty()) {
    el_insertstr(editor, fresh.c_str());
    return CC_REFRESH;
  }
  std::printf("\r\n");
  print_columns(found.words);
  std::fflush(stdout);
  return CC_REDISPLAY;
}

/// libedit works in the characters of the locale; numbers of this program never do.
void ensure_utf8() {
  std::setlocale(LC_CTYPE, "");
  if (std::strcmp(::nl_langinfo(CODESET), "UTF-8") != 0) std::setlocale(LC_CTYPE, "C.UTF-8");
}

}  // namespace

LineEditor::LineEditor(const lua::LuaState& lua, std::function<bool()> idle, int wake)
    : impl_(std::make_unique<Impl>(lua, std::move(idle))) {
  impl_->wake = wake;
  ensure_utf8();
  Impl& m = *impl_;
  m.editor = el_init("robomosp", stdin, stdout, stderr);
  m.history = history_init();
  HistEvent event;
  history(m.history, &event, H_SETSIZE, kHistoryLines);
  history(m.history, &event, H_SETUNIQUE, 1);
  m.file = history_file();
  if (!m.file.empty()) history(m.history, &event, H_LOAD, m.file.c_str());

  el_set(m.editor, EL_CLIENTDATA, &m);
  el_set(m.editor, EL_PROMPT, show_prompt);
  el_set(m.editor, EL_EDITOR, "emacs");
  el_set(m.editor, EL_HIST, history, m.history);
  el_set(m.editor, EL_GETCFN, read_key);
  el_set(m.editor, EL_ADDFN, "robomosp-complete", "Complete the word.", complete_word);
  el_set(m.editor, EL_ADDFN, "robomosp-cancel", "Drop the input.", cancel_line);
  el_set(m.editor, EL_BIND, "^I", "robomosp-complete", nullptr);
  el_set(m.editor, EL_BIND, "^C", "robomosp-cancel", nullptr);
  el_set(m.editor, EL_BIND, "^R", "em-inc-search-prev", nullptr);
  // While a line is edited Ctrl-C is a key; while a script runs it is a signal.
  el_set(m.editor, EL_SETTY, "-d", "-isig", nullptr);
  el_source(m.editor, nullptr);
}

LineEditor::~LineEditor() {
  el_end(impl_->editor);
  history_end(impl_->history);
}

LineEditor::Line LineEditor::read(const std::string& prompt, const std::string& before) {
  impl_->prompt = prompt;
  impl_->before = before;
  impl_->cancelled = false;
  el_resize(impl_->editor);
  // Before the prompt shows: keys typed at once must not meet the terminal's own line mode, which
  // would swallow a Ctrl-D.
  el_set(impl_->editor, EL_PREP_TERM, 1);
  int count = 0;
  const char* text = el_gets(impl_->editor, &count);
  if (impl_->cancelled) return {Outcome::cancelled, {}};
  if (!text || count <= 0) return {Outcome::end, {}};
  std::string line(text);
  while (!line.empty() && (line.back() == '\n' || line.back() == '\r')) line.pop_back();
  return {Outcome::line, std::move(line)};
}

void LineEditor::remember(const std::string& line) {
  if (line.find_first_not_of(" \t") == std::string::npos) return;
  HistEvent event;
  history(impl_->history, &event, H_ENTER, line.c_str());
  if (impl_->file.empty()) return;
  std::error_code ec;
  fs::create_directories(impl_->file.parent_path(), ec);
  if (!ec) history(impl_->history, &event, H_SAVE, impl_->file.c_str());
}

}  // namespace robomosp::shell
