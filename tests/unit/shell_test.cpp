// SPDX-License-Identifier: Apache-2.0
#include "shell/json.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "shell/shell.h"

namespace robomosp::shell {
namespace {

TEST(Json, ValuesReadBackToTheSameBits) {
  const Value v = Map{{"b", true},      {"i", std::int64_t{9007199254740993}},
                      {"r", 0.1 + 0.2}, {"s", "\xC3\xA9\n\""},
                      {"n", nullptr},   {"l", List{1, 2.5, Map{}}}};
  const auto back = from_json(to_json(v));
  ASSERT_TRUE(back.ok()) << back.error().sentence();
  EXPECT_EQ(*back, v);
}

TEST(Json, HandlesKeepKindNumberAndName) {
  const Value h = Handle{"robot", 17};
  EXPECT_EQ(to_json(h, [](const Handle&) { return std::string("pa10"); }),
            R"({"$handle":{"kind":"robot","number":17,"name":"pa10"}})");
  const auto back = from_json(to_json(h));
  ASSERT_TRUE(back.ok());
  EXPECT_EQ(*back, h);
}

TEST(Json, NumbersThatJsonCannotHoldAreStrings) {
  EXPECT_EQ(to_json(List{std::nan(""), std::numeric_limits<double>::infinity(),
                         -std::numeric_limits<double>::infinity()}),
            R"(["nan","inf","-inf"])");
  EXPECT_EQ(to_json(NumericArray({1, 2, 3, 4}, 2, 2)), "[[1.0,2.0],[3.0,4.0]]");
}

TEST(Json, BytesThatAreNoUtf8DoNotBreakTheLine) {
  EXPECT_EQ(to_json(std::string("a\xFFz")), "\"a\xEF\xBF\xBDz\"");
  EXPECT_FALSE(from_json("\"a\xFFz\"").ok());
}

TEST(Json, DepthIsLimitedAtExactly64) {
  EXPECT_TRUE(from_json(std::string(64, '[') + std::string(64, ']')).ok());
  const auto deep = from_json(std::string(65, '[') + std::string(65, ']'));
  ASSERT_FALSE(deep.ok());
  EXPECT_NE(deep.error().message.find("64"), std::string::npos);
  EXPECT_FALSE(from_json(std::string(1000000, '[')).ok());
}

TEST(ExitCodes, TellWhatKindOfFailureItWas) {
  EXPECT_EQ(exit_code(ErrorCode::script_failed), 1);
  EXPECT_EQ(exit_code(ErrorCode::usage), 2);
  EXPECT_EQ(exit_code(ErrorCode::stale_handle), 3);
  EXPECT_EQ(exit_code(ErrorCode::unreachable), 4);
  EXPECT_EQ(exit_code(ErrorCode::cancelled), 130);
}

}  // namespace
}  // namespace robomosp::shell
