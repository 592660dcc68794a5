// SPDX-License-Identifier: GPL-3.0-or-later
// LuaHighlighter: colours of Lua and of other lines in the console (layer: GUI).
#pragma once

#include <functional>

#include <QColor>
#include <QString>
#include <QSyntaxHighlighter>

namespace robomosp::viewer {

/// What a block of the console is; its user state.
enum class ConsoleLine : int { input = 1, echo, result, failure, note };

/// Calls `paint` with place, length and colour of each keyword, text, number and comment of a line
/// of Lua from a place on.
void colour_lua(const QString& text, int from,
                const std::function<void(int at, int length, const QColor& colour)>& paint);

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
