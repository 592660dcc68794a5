// SPDX-License-Identifier: Apache-2.0
#include "program_post/posted.h"

#include <algorithm>

namespace robomosp::program_post {
namespace {

/// A hint without the way that was taken already: the flattened program.
std::string without_flat(std::string hint) {
  static constexpr std::pair<std::string_view, std::string_view> kWords[] = {
      {", or post the flattened program (form = \"flat\")", ""},
      {", or post the flattened program", ""},
      {"Post the flattened program (form = \"flat\").",
       "It depends on what only a run knows: give it a value, or leave it out."},
      {"Post the flattened program.",
       "It depends on what only a run knows: give it a value, or leave it out."}};
  for (const auto& [what, by] : kWords)
    if (const auto at = hint.find(what); at != std::string::npos) hint.replace(at, what.size(), by);
  for (const std::string_view begin :
       {"Post the flattened program (form = \"flat\"), or ", "Post the flattened program, or "})
    if (hint.starts_with(begin)) {
      hint.erase(0, begin.size());
      if (!hint.empty() && hint[0] >= 'a' && hint[0] <= 'z')
        hint[0] = static_cast<char>(hint[0] - 'a' + 'A');
    }
  return hint;
}
/// A hint without another: to name the robot, where one is named.
std::string without_robot(std::string_view message, std::string hint) {
  const auto has = [&](std::string_view words) {
    return message.find(words) != std::string_view::npos;
  };
  for (const std::string_view name :
       {"Name the robot: program.post{robot = ...}", "Name the robot (program.post{robot = ...})",
        ", or name the robot: program.post{robot = ...}"}) {
    const auto at = hint.find(name);
    if (at == std::string::npos) continue;
    hint.erase(at, name.size());
    if (hint.starts_with(", or ")) {
      hint.erase(0, 5);
      if (!hint.empty() && hint[0] >= 'a' && hint[0] <= 'z')
        hint[0] = static_cast<char>(hint[0] - 'a' + 'A');
    }
    if (hint != ".") return hint;
    if (has("TOOL of its own")) return "Make the tool a part of the robot, and leave TOOL out.";
    if (has("FRAME")) return "Make FRAME of constants.";
    if (has("keeps an orientation")) return "Give a POSE, which has one.";
    if (has("reach") || has("limit"))
      return "program.check_run shows the distance and a STATUS in reach at this line.";
    return "Make the target of constants, or give joints (MAIN_JOINT).";
  }
  return hint;
}
}  // namespace

void Posted::fault(std::uint32_t severity, const rmp_span& span, std::string_view message,
                   std::string_view hint) {
  std::string way(hint);
  if (is_flat) way = without_flat(std::move(way));
  if (has_robot) way = without_robot(message, std::move(way));
  faults.push_back({severity, span, std::string(message), std::move(way)});
}

std::size_t Posted::errors() const {
  return static_cast<std::size_t>(
      std::count_if(faults.begin(), faults.end(),
                    [](const PostedFault& f) { return f.severity == RMP_FAULT_ERROR; }));
}

}  // namespace robomosp::program_post
