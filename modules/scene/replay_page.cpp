// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <string_view>
#include <utility>

#include "kernel/base64.h"
#include "scene/replay.h"
#include "scene/replay_files.h"

namespace robomosp::scene {
namespace {

/// Safe as text of an element.
std::string html(std::string_view s) {
  std::string out;
  for (const char c : s) {
    if (c == '<') out += "&lt;";
    else if (c == '&') out += "&amp;";
    else out += c;
  }
  return out;
}

}  // namespace

std::string replay_page(const ReplayData& data, const std::string& title, bool is_watched) {
  std::string bytes;
  base64::append(bytes, data.bytes);
  const std::pair<std::string_view, std::string> fillings[] = {
      {"TITLE", html(title)},
      {"RELOAD", is_watched ? " data-reload=\"2000\"" : ""},
      {"STYLE", std::string(kReplayStyle)},
      {"HEADER", data.header},
      {"BYTES", bytes},
      {"SCRIPT", std::string(kReplayScript)}};
  std::string page;
  std::string_view rest = kReplayPage;
  while (!rest.empty()) {
    const std::size_t at = rest.find('@');
    const std::size_t end = at == rest.npos ? rest.npos : rest.find('@', at + 1);
    page += rest.substr(0, at);
    if (end == rest.npos) break;
    const std::string_view name = rest.substr(at + 1, end - at - 1);
    for (const auto& [known, text] : fillings)
      if (known == name) page += text;
    rest.remove_prefix(end + 1);
  }
  return page;
}

}  // namespace robomosp::scene
