// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/desktop/lua_highlighter.h"

#include <algorithm>

#include <QSet>

#include "viewer/theme/theme.h"

namespace robomosp::viewer {
namespace {

bool is_lua_keyword(const QString& word) {
  static const QSet<QString> all{"and",   "break", "do",       "else", "elseif", "end",
                                 "false", "for",   "function", "goto", "if",     "in",
                                 "local", "nil",   "not",      "or",   "repeat", "return",
                                 "then",  "true",  "until",    "while"};
  return all.contains(word);
}

}  // namespace

void colour_lua(const QString& text, int from,
                const std::function<void(int at, int length, const QColor& colour)>& paint) {
  const Theme& t = theme();
  const auto length = static_cast<int>(text.size());
  int i = from;
  const auto is_word = [](QChar c) { return c.isLetterOrNumber() || c == '_'; };
  while (i < length) {
    const QChar c = text[i];
    const int begin = i;
    if (c == '-' && i + 1 < length && text[i + 1] == '-') {
      paint(begin, length - begin, t.comment);
      return;
    }
    if (c == '"' || c == '\'') {
      for (++i; i < length && text[i] != c; ++i)
        if (text[i] == '\\') ++i;
      ++i;
      paint(begin, std::min(i, length) - begin, t.string);
    } else if (c.isDigit() || (c == '.' && i + 1 < length && text[i + 1].isDigit())) {
      while (i < length && (is_word(text[i]) || text[i] == '.' ||
                            ((text[i] == '-' || text[i] == '+') && i > begin &&
                             (text[i - 1] == 'e' || text[i - 1] == 'E'))))
        ++i;
      paint(begin, i - begin, t.number);
    } else if (is_word(c)) {
      while (i < length && is_word(text[i])) ++i;
      if (is_lua_keyword(text.mid(begin, i - begin))) paint(begin, i - begin, t.keyword);
    } else {
      ++i;
    }
  }
}

void LuaHighlighter::highlightBlock(const QString& text) {
  const Theme& t = theme();
  const auto length = static_cast<int>(text.size());
  int i = 0;
  if (!everywhere_) {
    const auto line = static_cast<ConsoleLine>(currentBlock().userState());
    setCurrentBlockState(static_cast<int>(line));  // it stays what it is
    setFormat(0, length,
              line == ConsoleLine::failure  ? t.fault
              : line == ConsoleLine::note   ? t.text_quiet
              : line == ConsoleLine::result ? t.text_dim
                                            : t.text);
    if (line != ConsoleLine::input && line != ConsoleLine::echo) return;
    setFormat(0, 1, line == ConsoleLine::input ? t.accent : t.text_quiet);
    i = std::min(2, length);
  }
  colour_lua(text, i,
             [this](int at, int count, const QColor& colour) { setFormat(at, count, colour); });
}

}  // namespace robomosp::viewer
