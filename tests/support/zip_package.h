// SPDX-License-Identifier: Apache-2.0
// ZIP packages for tests.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace robomosp::test {

/// A ZIP as other programs write it: "deflated", and with lengths and sums behind the content only.
inline std::string zip_package(const std::vector<std::pair<std::string, std::string>>& files) {
  const auto number = [](std::string& to, std::uint64_t v, int bytes) {
    for (int i = 0; i < bytes; ++i) to += static_cast<char>(v >> (8 * i) & 0xFFU);
  };
  const auto sum_of = [](const std::string& bytes) {
    std::uint32_t crc = ~0U;
    for (const char c : bytes) {
      crc ^= static_cast<unsigned char>(c);
      for (int i = 0; i < 8; ++i) crc = crc >> 1 ^ (crc & 1U ? 0xEDB88320U : 0U);
    }
    return ~crc;
  };
  std::string out, directory;
  for (const auto& [name, content] : files) {
    std::string packed;
    for (std::size_t at = 0;; at += 0xFFFF) {
      const std::string piece = content.substr(at, 0xFFFF);
      const bool is_last = at + piece.size() >= content.size();
      number(packed, is_last ? 1 : 0, 1);
      number(packed, piece.size(), 2);
      number(packed, ~piece.size(), 2);
      packed += piece;
      if (is_last) break;
    }
    const std::size_t start = out.size();
    const auto head = [&](std::string& to, bool is_local) {
      number(to, is_local ? 0x04034B50 : 0x02014B50, 4);
      if (!is_local) number(to, 20, 2);
      for (const std::uint64_t v : {20, 8, 8, 0, 0}) number(to, v, 2);
      number(to, is_local ? 0 : sum_of(content), 4);
      number(to, is_local ? 0 : packed.size(), 4);
      number(to, is_local ? 0 : content.size(), 4);
      number(to, name.size(), 2);
      number(to, 0, 2);
    };
    head(out, true);
    out += name + packed;
    for (const std::uint64_t v :
         {std::uint64_t{0x08074B50}, std::uint64_t{sum_of(content)}, packed.size(), content.size()})
      number(out, v, 4);
    head(directory, false);
    number(directory, 0, 6);
    number(directory, 0, 4);
    number(directory, start, 4);
    directory += name;
  }
  const std::size_t start = out.size();
  out += directory;
  number(out, 0x06054B50, 4);
  number(out, 0, 4);
  number(out, files.size(), 2);
  number(out, files.size(), 2);
  number(out, directory.size(), 4);
  number(out, start, 4);
  number(out, 0, 2);
  return out;
}

}  // namespace robomosp::test
