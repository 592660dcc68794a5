// SPDX-License-Identifier: Apache-2.0
// The catalogue of constructs that posts are tried with (share/robomosp/post_test/constructs.txt),
// and what becomes of each (layer: contract helper, inline only, not part of the ABI).
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/result.h>

namespace robomosp::post {

/// A statement, and a whole program around it.
struct ConstructCase {
  std::string text;        ///< the statement, one line of IRL
  std::string source;      ///< a program that contains it
  std::string without;     ///< the same program without it
  std::string bare;        ///< of a motion with attributes: the program without these; "" = not so
  std::uint32_t line = 0;  ///< its line in `source`
};

/// A motion without its attributes; "" = it has none.
[[nodiscard]] inline std::string without_attributes(const std::string& construct) {
  const std::size_t move = construct.find("MOVE");
  if (move == std::string::npos) return {};
  // Attributes follow the targets: " SPEED := 80.0, C_CP := 5.0 UNTIL ready;"
  const std::size_t assigns = construct.find(" := ", move);
  if (assigns == std::string::npos) return {};
  const std::size_t begin = construct.rfind(' ', assigns - 1);
  std::size_t end = construct.find(" UNTIL ", assigns);
  if (end == std::string::npos) end = construct.rfind(';');
  if (begin == std::string::npos || end == std::string::npos || end < begin) return {};
  return construct.substr(0, begin) + construct.substr(end);
}

/// The program of a case with a statement behind it, so that the construct is not its end.
[[nodiscard]] inline std::string followed(std::string source) {
  if (const std::size_t end = source.rfind("ENDPROGRAM"); end != std::string::npos)
    source.insert(end, "grip := FALSE; ");
  return source;
}

/// Reads a catalogue:
///
///     robomosp constructs 1
///     == frame
///     PROGRAM p; ... BEGIN {{before}}
///     {{construct}}
///     ENDPROGRAM;
///     == constructs
///     before: po := p1;
///     po := po @ po;
///
/// Each construct is a line; `before:` belongs to the next one. Lines that begin with # before the
/// first section are comments. Several frames, each with its constructs, may follow each other;
/// each has an output `grip`.
[[nodiscard]] inline Result<std::vector<ConstructCase>> read_constructs(std::string_view text) {
  const auto filled = [](std::string frame, std::string_view what, std::string_view with) {
    if (const std::size_t at = frame.find(what); at != std::string::npos)
      frame.replace(at, what.size(), with);
    return frame;
  };
  const auto wrong = [](std::uint32_t line, const char* what) {
    return error(ErrorCode::syntax, what, "See post_constructs.h for the format.",
                 "constructs.txt:" + std::to_string(line));
  };
  std::vector<ConstructCase> out;
  std::string frame, before;
  int section = 0;  // 0 head, 1 frame, 2 constructs
  std::uint32_t n = 0;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    ++n;
    if (n == 1) {
      if (line != "robomosp constructs 1")
        return wrong(n, "the first line is not \"robomosp constructs 1\"");
    } else if (line == "== frame") {
      section = 1;
      frame.clear();
    } else if (line == "== constructs") {
      if (frame.find("{{construct}}") == std::string::npos)
        return wrong(n, "there is no frame with {{construct}} before these constructs");
      section = 2;
    } else if (section == 1) {
      frame.append(line).append("\n");
    } else if (section == 2 && line.starts_with("before: ")) {
      before = line.substr(8);
    } else if (section == 2 && !line.empty()) {
      ConstructCase c;
      c.text = line;
      const std::string whole = filled(frame, "{{before}}", before);
      const std::size_t at = whole.find("{{construct}}");
      c.line = 1 + static_cast<std::uint32_t>(std::count(
                       whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(at), '\n'));
      c.source = filled(whole, "{{construct}}", line);
      c.without = filled(whole, "{{construct}}", "");
      if (const std::string bare = without_attributes(c.text); !bare.empty())
        c.bare = filled(whole, "{{construct}}", bare);
      out.push_back(std::move(c));
      before.clear();
    }
  }
  if (out.empty()) return wrong(n, "there are no constructs");
  return out;
}

}  // namespace robomosp::post
