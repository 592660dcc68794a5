// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cstdint>
#include <string_view>
#include <utility>

#include "scene/replay.h"
#include "scene/replay_files.h"

namespace robomosp::scene {
namespace {

/// Standard alphabet with padding (RFC 4648).
std::string base64(std::string_view bytes) {
  constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t three = 0;
    for (std::size_t k = 0; k < 3; ++k)
      three = three << 8U | (i + k < bytes.size() ? static_cast<std::uint8_t>(bytes[i + k]) : 0U);
    for (std::size_t k = 0; k < 4; ++k)
      out += i + k > bytes.size() ? '=' : kDigits[three >> (18 - 6 * k) & 63U];
  }
  return out;
}

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

std::string replay_page(const ReplayData& data, const std::string& title) {
  const std::pair<std::string_view, std::string> fillings[] = {
      {"TITLE", html(title)},
      {"STYLE", std::string(kReplayStyle)},
      {"HEADER", data.header},
      {"BYTES", base64(data.bytes)},
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
