// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/desktop/console_signature.h"

#include <algorithm>
#include <vector>

namespace robomosp::viewer {
namespace {

struct OpenCall {
  int at;         ///< of the brace or parenthesis
  bool is_table;  ///< without a name before it
};

bool is_call_letter(QChar c) { return c.isLetterOrNumber() || c == '_' || c == '.' || c == ':'; }

/// Where the calls that are open at a place begin, outermost first.
std::vector<OpenCall> open_calls(const QString& lua, int place) {
  std::vector<OpenCall> open;
  const int end = std::min(place, static_cast<int>(lua.size()));
  for (int i = 0; i < end; ++i) {
    const QChar c = lua[i];
    if (c == '"' || c == '\'') {
      for (++i; i < end && lua[i] != c; ++i)
        if (lua[i] == '\\') ++i;
    } else if (c == '-' && i + 1 < end && lua[i + 1] == '-') {
      while (i < end && lua[i] != '\n') ++i;
    } else if (c == '(' || c == '{') {
      int before = i - 1;
      while (before >= 0 && lua[before] == ' ') --before;
      open.push_back({i, before < 0 || !is_call_letter(lua[before])});
    } else if ((c == ')' || c == '}') && !open.empty()) {
      open.pop_back();
    }
  }
  return open;
}

}  // namespace

QString call_around(const QString& lua, int place) {
  const std::vector<OpenCall> open = open_calls(lua, place);
  // Of a call with a table in parentheses, or a table in a table, the one with a name counts.
  for (auto call = open.rbegin(); call != open.rend(); ++call) {
    if (call->is_table) continue;
    int last = call->at - 1;
    while (last >= 0 && lua[last] == ' ') --last;
    int first = last;
    while (first >= 0 && is_call_letter(lua[first])) --first;
    QString name = lua.mid(first + 1, last - first);
    const auto colon = name.lastIndexOf(':');
    return colon >= 0 ? name.mid(colon) : name;
  }
  return {};
}

QString argument_at(const QString& lua, int place) {
  const std::vector<OpenCall> open = open_calls(lua, place);
  if (open.empty()) return {};
  const QString inside = lua.mid(open.back().at + 1, place - open.back().at - 1);
  const QString part = inside.section(',', -1).trimmed();
  return part.section('=', 0, 0).trimmed();
}

}  // namespace robomosp::viewer
