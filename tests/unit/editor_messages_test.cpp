// SPDX-License-Identifier: Apache-2.0
// What the language server and the debug adapter read of editors: messages in bytes, changes of
// texts at places, addresses of files. Random ones too, against a plain way to do the same.
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include "remote/edited_text.h"
#include "remote/framed_messages.h"
#include "support/seed.h"

namespace robomosp::remote {
namespace {

using Json = nlohmann::json;
using Random = std::mt19937;

std::size_t below(Random& r, std::size_t n) { return n == 0 ? 0 : r() % n; }

/// A text as editors have them: all ends of lines, letters of one to four bytes.
std::string some_text(Random& r, std::size_t most) {
  static constexpr std::string_view kParts[] = {
      "a", "bc", " := ", ";", "\n", "\r\n", "\r", "\xc3\xa9", "\xe2\x82\xac", "\xf0\x9f\x98\x80",
      "{", "}"};
  std::string out;
  for (std::size_t k = below(r, most); k > 0; --k) out += kParts[below(r, std::size(kParts))];
  return out;
}
/// The byte of a place, sign by sign.
std::size_t plain_byte(const std::string& s, std::size_t line, std::size_t character, Units units) {
  std::size_t at = 0;
  for (std::size_t l = 0; l < line; ++l) {
    while (at < s.size() && s[at] != '\n' && s[at] != '\r') ++at;
    if (at == s.size()) return at;
    at += s[at] == '\r' && at + 1 < s.size() && s[at + 1] == '\n' ? 2 : 1;
  }
  std::size_t units_left = character;
  while (at < s.size() && s[at] != '\n' && s[at] != '\r' && units_left > 0) {
    const auto c = static_cast<unsigned char>(s[at]);
    const std::size_t bytes = c < 0x80 ? 1 : c < 0xe0 ? 2 : c < 0xf0 ? 3 : 4;
    const std::size_t its = units == Units::utf8 ? bytes : bytes == 4 ? 2 : 1;
    // Within a letter UTF-8 is its begin, and UTF-16 its end.
    if (units_left < its) return units == Units::utf8 ? at : at + bytes;
    units_left -= its;
    at += bytes;
  }
  return at;
}

TEST(EditorTexts, ChangesAtPlacesAreThoseOfAPlainWay) {
  Random r(test::seed());
  for (int round = 0; round < 2000; ++round) {
    const Units units = below(r, 2) ? Units::utf16 : Units::utf8;
    std::string want = some_text(r, round % 50 == 0 ? 3000 : 40);
    ChangedText changed(want);
    for (int k = 0; k < 6; ++k) {
      const Text text(want);
      ASSERT_EQ(text.all(), want);
      const auto place = [&] {
        return std::pair(static_cast<std::uint32_t>(below(r, 30)),
                         static_cast<std::uint32_t>(below(r, 10) ? below(r, 12) : 0xffffffffU));
      };
      auto from = place(), to = place();
      if (below(r, 8) && to < from) std::swap(from, to);
      const std::string with = some_text(r, 6);
      const std::size_t b0 = plain_byte(want, from.first, from.second, units),
                        b1 = plain_byte(want, to.first, to.second, units);
      ASSERT_EQ(text.byte(from.first, from.second, units), b0) << want;
      ASSERT_EQ(text.byte(to.first, to.second, units), b1) << want;
      const auto one = text.with_change(from.first, from.second, to.first, to.second, with, units);
      ASSERT_EQ(one.has_value(), b1 >= b0);
      ChangedText several = changed;
      const bool is_made =
          several.replace(from.first, from.second, to.first, to.second, with, units);
      if (!one) {
        EXPECT_FALSE(is_made);
        continue;
      }
      ASSERT_TRUE(is_made);
      changed = std::move(several);
      want = want.substr(0, b0) + with + want.substr(b1);
      ASSERT_EQ(*one, want);
      ASSERT_EQ(changed.all(), want);
      ASSERT_EQ(changed.size(), want.size());
    }
  }
}

TEST(EditorTexts, PlacesAreFoundAgain) {
  Random r(test::seed());
  for (int round = 0; round < 300; ++round) {
    const Text text(some_text(r, 2000));
    const std::string& s = text.all();
    for (int k = 0; k < 50; ++k) {
      auto byte = static_cast<std::uint32_t>(below(r, s.size() + 1));
      while (byte < s.size() && is_inner(s[byte])) ++byte;
      if (byte > 0 && byte < s.size() && s[byte] == '\n' && s[byte - 1] == '\r') --byte;
      for (const Units units : {Units::utf16, Units::utf8}) {
        const Json at = text.position(byte, units);
        EXPECT_EQ(text.byte(at["line"], at["character"], units), byte);
        EXPECT_EQ(plain_byte(s, at["line"], at["character"], units), byte);
      }
    }
  }
}

TEST(EditorTexts, AddressesOfFilesAreReadAgainAndOthersAreNone) {
  Random r(test::seed());
  for (int round = 0; round < 500; ++round) {
    std::string path = "/";
    for (std::size_t k = below(r, 20); k > 0; --k) path += static_cast<char>(1 + below(r, 255));
    const auto back = path_of(uri_of(path));
    ASSERT_TRUE(back.has_value());
    EXPECT_EQ(back->string(), path);
    std::string noise = "file:";
    for (std::size_t k = below(r, 12); k > 0; --k) noise += "/%2fA\0e:"[below(r, 8)];
    (void)path_of(noise);
    (void)file_name(noise);
  }
  EXPECT_FALSE(path_of("untitled:Untitled-1").has_value());
  EXPECT_FALSE(path_of("file://host").has_value());
  EXPECT_FALSE(path_of("file:///a%00b").has_value());
  EXPECT_EQ(path_of("file:///a%20b%")->string(), "/a b%");
}

TEST(EditorMessages, BytesInAnyPiecesAreTheSameMessages) {
  Random r(test::seed());
  for (int round = 0; round < 300; ++round) {
    std::vector<std::string> want;
    std::string bytes;
    for (std::size_t k = 1 + below(r, 5); k > 0; --k) {
      const Json message{{"jsonrpc", "2.0"}, {"id", k}, {"params", some_text(r, 300)}};
      want.push_back(message.dump());
      bytes += framed(message);
    }
    Frames frames;
    std::vector<std::string> got;
    std::string fault;
    for (std::size_t at = 0; at < bytes.size();) {
      const std::size_t n = 1 + below(r, below(r, 3) ? 7 : 4000);
      ASSERT_TRUE(frames.feed(
          std::string_view(bytes).substr(at, n),
          [&](std::string body) { got.push_back(std::move(body)); }, fault))
          << fault;
      at += n;
    }
    EXPECT_EQ(got, want);
  }
}

TEST(EditorMessages, DamagedBytesAreReadOrRefusedWithASentence) {
  Random r(test::seed());
  std::size_t refused = 0;
  for (int round = 0; round < 2000; ++round) {
    std::string bytes;
    for (std::size_t k = 1 + below(r, 3); k > 0; --k)
      bytes += framed({{"id", k}, {"params", {{"text", some_text(r, 20)}, {"n", {1, 2, {3}}}}}});
    for (std::size_t k = 1 + below(r, 6); k > 0; --k) {
      const std::size_t at = below(r, bytes.size());
      switch (below(r, 3)) {
        case 0: bytes[at] = static_cast<char>(below(r, 256)); break;
        case 1: bytes.erase(at, below(r, 5)); break;
        default: bytes.insert(at, some_text(r, 4)); break;
      }
      if (bytes.empty()) bytes = "x";
    }
    Frames frames;
    std::string fault;
    const bool is_read = frames.feed(
        bytes,
        [&](const std::string& body) {
          const auto size = bytes_of_json(body);
          if (!size) return;
          const Json j = Json::parse(body, nullptr, false);
          if (j.is_discarded()) return;
          const Json& params = member(j, "params");
          (void)string_member(params, "text");
          (void)number_member(j, "id");
        },
        fault);
    refused += !is_read;
    EXPECT_EQ(is_read, fault.empty()) << fault;
  }
  EXPECT_GT(refused, 50U);
}

TEST(EditorMessages, WhatIsTooMuchIsSaidBeforeItIsRead) {
  EXPECT_FALSE(bytes_of_json(std::string(100'000, '[')).has_value());
  EXPECT_FALSE(bytes_of_json("[" + std::string(2 * kMostEditorValues + 10, ',') + "]").has_value());
  EXPECT_TRUE(bytes_of_json("{\"text\":\"" + std::string(1000, '[') + "\"}").has_value());
  Frames frames;
  std::string fault;
  const auto none = [](const std::string&) { ADD_FAILURE() << "a message"; };
  EXPECT_FALSE(frames.feed(
      "Content-Length: " + std::to_string(kLongestEditorMessage + 1) + "\r\n\r\n", none, fault));
  EXPECT_FALSE(fault.empty());
  Frames other;
  fault.clear();
  EXPECT_FALSE(other.feed(std::string(100'000, 'x'), none, fault));
  EXPECT_FALSE(fault.empty());
  EXPECT_EQ(number_member({{"n", -1}}, "n"), std::nullopt);
  EXPECT_EQ(number_member({{"n", 1e300}}, "n"), std::nullopt);
  EXPECT_EQ(number_member({{"n", 5'000'000'000}}, "n"), 0xffffffffU);
}

}  // namespace
}  // namespace robomosp::remote
