// SPDX-License-Identifier: Apache-2.0
#include "kernel/text.h"

#include <algorithm>
#include <bit>
#include <clocale>
#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

namespace robomosp {
namespace {

TEST(Text, PrintedRealsReadBackToTheSameBits) {
  constexpr unsigned kSeed = 20240;
  std::mt19937_64 random(kSeed);
  RecordProperty("seed", static_cast<int>(kSeed));
  int tried = 0;
  while (tried < 20000) {
    const double v = std::bit_cast<double>(random());  // all magnitudes, subnormals too
    if (std::isnan(v)) continue;
    ++tried;
    const auto back = text::read_real(text::print(v));
    ASSERT_TRUE(back.has_value()) << text::print(v);
    ASSERT_EQ(std::bit_cast<std::uint64_t>(*back), std::bit_cast<std::uint64_t>(v))
        << text::print(v);
  }
}

TEST(Text, PrintingAndReadingIgnoreTheLocale) {
  const std::string before = std::setlocale(LC_ALL, nullptr);
  // Any locale with a decimal comma that is installed; without one the test still holds.
  for (const char* name : {"de_DE.UTF-8", "fr_FR.UTF-8", "uk_UA.UTF-8"})
    if (std::setlocale(LC_ALL, name)) break;
  EXPECT_EQ(text::print(0.5), "0.5");
  EXPECT_EQ(text::read_real("0.5"), 0.5);
  EXPECT_FALSE(text::read_real("0,5"));
  std::setlocale(LC_ALL, before.c_str());
}

TEST(Text, SpecialRealsHaveOneSpellingEach) {
  EXPECT_EQ(text::print(-0.0), "0");
  EXPECT_EQ(text::print(std::numeric_limits<double>::infinity()), "inf");
  EXPECT_EQ(text::print(-std::numeric_limits<double>::infinity()), "-inf");
  EXPECT_EQ(text::print(-std::numeric_limits<double>::quiet_NaN()), "nan");
  EXPECT_EQ(text::print(1e22), "1e+22");
}

TEST(Text, ReadingTakesTheWholeTextOrNothing) {
  EXPECT_EQ(text::read_real("+1.5"), 1.5);
  for (const char* bad : {"", " 1", "1 ", "1x", "+-1", "++1", "+", "1e400", "0x10", "1,5", "--1"})
    EXPECT_FALSE(text::read_real(bad)) << bad;
  EXPECT_EQ(text::read_int("-9223372036854775808"), std::numeric_limits<std::int64_t>::min());
  for (const char* bad : {"", "9223372036854775808", "1.0", "1e3", "0x1", " 7"})
    EXPECT_FALSE(text::read_int(bad)) << bad;
}

TEST(Text, RoundedNumbersDropTrailingZeros) {
  EXPECT_EQ(text::print_rounded(1.0 / 3), "0.333333");
  EXPECT_EQ(text::print_rounded(2.0), "2");
  EXPECT_EQ(text::print_rounded(0.1 + 0.2, 12), "0.3");
  EXPECT_EQ(text::print_rounded(999999.5), "1000000");
  // Exponents from 1e15 on and below 1e-5 only.
  EXPECT_EQ(text::print_rounded(1e5), "100000");
  EXPECT_EQ(text::print_rounded(-1e-5), "-0.00001");
  EXPECT_EQ(text::print_rounded(9.9e-6), "9.9e-06");
  EXPECT_EQ(text::print_rounded(999999999999999.0, 17), "999999999999999");
  EXPECT_EQ(text::print_rounded(1e15), "1e+15");
  EXPECT_EQ(text::print_rounded(7121731995309737.0, 17), "7.121731995309737e+15");
  EXPECT_EQ(text::print_rounded(0.1, 17), "0.1");
}

TEST(Text, QuotingEscapesWhatWouldEndTheText) {
  EXPECT_EQ(text::quote("a \"b\"\\\n\t\r"), R"("a \"b\"\\\n\t\r")");
}

TEST(Text, ListsAreEnumeratedAsInASentence) {
  const std::vector<std::string> words = {"a", "b", "c"};
  EXPECT_EQ(text::enumerate(words), "a, b and c");
  EXPECT_EQ(text::enumerate(std::span(words).first(2)), "a and b");
  EXPECT_EQ(text::enumerate(std::span(words).first(1)), "a");
  EXPECT_EQ(text::enumerate({}), "");
  EXPECT_EQ(text::split("a,,b", ',').size(), 3U);
  EXPECT_EQ(text::trim(" \t a b\n"), "a b");
}

TEST(Text, NearNamesAreSuggestedAndFarOnesAreNot) {
  const std::vector<std::string> names = {"alpha", "length", "speed", "y"};
  EXPECT_EQ(text::nearest("alpa", names), "alpha");
  EXPECT_EQ(text::nearest("lenght", names), "length");
  EXPECT_EQ(text::nearest("SPEED", names), "speed");
  EXPECT_EQ(text::nearest("le", names), "length");
  EXPECT_FALSE(text::nearest("x", names));
  EXPECT_FALSE(text::nearest("torque", names));
  EXPECT_FALSE(text::nearest("", names));
  EXPECT_FALSE(text::nearest(std::string(1000000, 'a'), names));
  EXPECT_EQ(text::did_you_mean("alpa", names), "Did you mean \"alpha\"?");
}

TEST(Text, NothingThatSteersATerminalIsVisible) {
  EXPECT_EQ(text::visible("plain \"text\"\n\tof caf\xC3\xA9 \xE2\x82\xAC"),
            "plain \"text\"\n\tof caf\xC3\xA9 \xE2\x82\xAC");
  EXPECT_EQ(text::visible("\x1b[31mred\x07\r\x7f"), "\\x1b[31mred\\x07\\x0d\\x7f");
  // CSI as one character of UTF-8, and as one byte of an older terminal.
  EXPECT_EQ(text::visible("\xC2\x9B"
                          "31m"),
            "\\x9b31m");
  EXPECT_EQ(text::visible("a\x9B"
                          "31m"),
            "a\\x9b31m");
  EXPECT_EQ(text::visible(std::string_view("\0x", 2)), "\\x00x");
}

TEST(Text, ALongSentenceKeepsWhatIsNotTheUsers) {
  const std::string name(200'000, 'x');
  const std::string said =
      text::shortened("there is no robot " + text::quote(name) + " in the document");
  EXPECT_LT(said.size(), 300U);
  EXPECT_TRUE(said.starts_with("there is no robot \"xxxx")) << said;
  EXPECT_TRUE(said.ends_with("(200000 bytes) in the document")) << said;
  EXPECT_EQ(text::shortened("short \"" + std::string(500, 'y') + "\""),
            "short \"" + std::string(500, 'y') + "\"");
  std::string characters;
  for (int i = 0; i < 100'000; ++i) characters += "\xE2\x82\xAC";
  for (const std::string& s : {characters, text::quote(characters), "\"" + name, name + "\\"}) {
    const std::string cut = text::shortened(s, 1000);
    EXPECT_LE(cut.size(), 1010U);
    // Whole characters.
    EXPECT_EQ(std::count(cut.begin(), cut.end(), '\xE2'),
              std::count(cut.begin(), cut.end(), '\xAC'));
  }
}

}  // namespace
}  // namespace robomosp
