// SPDX-License-Identifier: Apache-2.0
// The console on a terminal: line editor, history, completion, several-line input
// (layer: application, shell).
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "lua/lua_state.h"

namespace robomosp::shell {

/// $XDG_STATE_HOME/robomosp/history, or below ~/.local/state; empty without a home.
[[nodiscard]] std::filesystem::path history_file();

/// Line editor on standard input and output. [the session's thread]
class LineEditor {
 public:
  /// `idle` is called every 50 ms while it waits for a key, and when the descriptor `wake` can be
  /// read; true means that Ctrl-C came as a signal.
  LineEditor(const lua::LuaState& lua, std::function<bool()> idle, int wake = -1);
  ~LineEditor();
  LineEditor(const LineEditor&) = delete;
  LineEditor& operator=(const LineEditor&) = delete;

  enum class Outcome { line, cancelled, end };
  struct Line {
    Outcome outcome = Outcome::end;
    std::string text;
  };
  /// One line; `before` is what was typed on the lines before it, for completion.
  [[nodiscard]] Line read(const std::string& prompt, const std::string& before);
  /// Adds to the history and writes it to its file.
  void remember(const std::string& line);

  struct Impl;  ///< for the callbacks of the editing library only

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace robomosp::shell
