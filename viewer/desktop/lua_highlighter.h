// SPDX-License-Identifier: GPL-3.0-or-later
// LuaHighlighter: colours of Lua and of other lines in the console (layer: GUI).
#pragma once

#include <QSyntaxHighlighter>

namespace robomosp::viewer {

/// What a block of the console is; its user state.
enum class ConsoleLine : int { input = 1, echo, result, failure, note };

/// Colours blocks by what they are, in the colours of the current theme; Lua in those of code. If
/// `everywhere`, all blocks are Lua without a prompt.
class LuaHighlighter : public QSyntaxHighlighter {
 public:
  LuaHighlighter(QTextDocument* document, bool everywhere)
      : QSyntaxHighlighter(document), everywhere_(everywhere) {}

 protected:
  void highlightBlock(const QString& text) override;

 private:
  bool everywhere_;
};

}  // namespace robomosp::viewer
