// SPDX-License-Identifier: Apache-2.0
#include "remote/json.h"

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "remote/rpc.h"
#include "shell/shell.h"
#include "support/lua_program.h"

namespace robomosp::shell {
using namespace remote;
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

std::string with_array(const std::string& inner) { return R"({"q":{"$array":)" + inner + "}}"; }

TEST(Json, ArraysAsBase64KeepBitsAndShape) {
  const double inf = std::numeric_limits<double>::infinity();
  EXPECT_EQ(to_json(NumericArray({1.0, -2.0}), {}, Arrays::base64),
            R"({"$array":{"shape":[2],"base64":"AAAAAAAA8D8AAAAAAAAAwA=="}})");
  for (const std::size_t rows : {0, 1, 2, 500}) {  // long ones do not go through the parser
    std::vector<double> x(3 * rows);
    for (std::size_t i = 0; i < x.size(); ++i) x[i] = std::sin(static_cast<double>(i)) * 1e-300;
    if (!x.empty()) x.back() = -inf, x.front() = -0.0;
    for (const NumericArray& a : {NumericArray(x, rows, 3), NumericArray(x)}) {
      const Value given = Map{{"a", a}, {"base64", "short \\ \" one"}, {"b", List{a, 1}}};
      const std::string text = to_json(given, {}, Arrays::base64);
      const auto back = from_json(text);
      ASSERT_TRUE(back.ok()) << back.error().sentence();
      EXPECT_EQ(*back, given);
      EXPECT_EQ(back->as_map()->find("a")->as_array()->cols(), a.cols());
      EXPECT_FALSE(array_fault(*back));
    }
  }
  const double nan = std::nan("17");
  const auto back = from_json(to_json(NumericArray({nan}), {}, Arrays::base64));
  EXPECT_EQ(std::bit_cast<std::uint64_t>((*back->as_array())[0]),
            std::bit_cast<std::uint64_t>(nan));
}

TEST(Json, ArraysThatAreNoneSayWhy) {
  const std::string zeros(1600, 'A');  // 150 numbers
  const std::pair<std::string, const char*> wrong[] = {
      {R"({"shape": [2], "base64": "AAAAAAAAAAA="})",
       "has 2 numbers, 16 bytes, and its base64 has 8"},
      {R"({"shape": [50, 4], "base64": ")" + zeros + "\"}", "has 200 numbers, 1600 bytes"},
      {R"({"shape": [150], "base64": ")" + zeros.substr(1) + "-\"}", "not base64"},
      {R"({"shape": [150], "base64": ")" + zeros.substr(1) + "\"}", "cut off"},
      {R"({"shape": [1]})", "needs its shape and its base64"},
      {R"({"shape": [1], "base64": 5})", "needs its shape and its base64"},
      {R"({"shape": [1], "base64": "AAAAAAAAAAA=", "unit": "m"})", "and nothing else"},
      {R"({"shape": [], "base64": ""})", "one or two whole numbers"},
      {R"({"shape": [3, 0], "base64": ""})", "the second above 0"},
      {R"({"shape": [1.5], "base64": "AAAAAAAAAAA="})", "one or two whole numbers"},
      {R"({"shape": [-1], "base64": "AAAAAAAAAAA="})", "one or two whole numbers"},
      {R"({"shape": [268435456, 268435456], "base64": ""})", "bytes, and its base64 has 0"},
      {R"({"shape": [268435457], "base64": ""})", "one or two whole numbers"},
      {R"("here")", "needs its shape"}};
  for (const auto& [inner, said] : wrong) {
    const auto read = from_json(with_array(inner));
    ASSERT_TRUE(read.ok()) << inner;
    const auto fault = array_fault(*read);
    ASSERT_TRUE(fault) << inner;
    EXPECT_NE(fault->message.find(said), std::string::npos) << fault->sentence();
    EXPECT_EQ(fault->where, "q");
  }
}

TEST(Json, LongTextsThatAreNoArraysStayWhatTheyAre) {
  const std::string text(5000, 'Q');
  for (const std::string& message :
       {R"({"base64":")" + text + "\"}", R"({"x":{"base64":")" + text + "\"}}",
        R"({"$array":{"base64":")" + text + R"(","shape":[1]},"other":1})",
        R"(["base64",")" + text + "\"]", R"({"base64":["base64",")" + text + "\"]}"}) {
    const auto read = from_json(message);
    ASSERT_TRUE(read.ok()) << read.error().sentence();
    EXPECT_EQ(to_json(*read), message);
  }
  // What is wrong is told with its place in the message as it came.
  const std::string cut = R"({"$array":{"shape":[1],"base64":")" + text + "\"}";
  const auto read = from_json(cut);
  ASSERT_FALSE(read.ok());
  EXPECT_NE(read.error().message.find("byte " + std::to_string(cut.size() + 1)), std::string::npos)
      << read.error().message;
  EXPECT_FALSE(from_json(R"({"base64":")" + text + "\n\"}").ok());
}

class Rpc : public test::LuaProgramTest {
 protected:
  Value answer(const std::string& line) {
    RpcServer server(app(), session_, *state_);
    const auto said = server.answer(std::string_view(line));
    EXPECT_TRUE(said) << line;
    const auto read = from_json(said.value_or("null"));
    EXPECT_TRUE(read.ok());
    return *read;
  }
  void SetUp() override {
    LuaProgramTest::SetUp();
    run("robot.get('puma560')");
  }
  static std::string request(const std::string& method, const std::string& params,
                             const std::string& more = "") {
    return R"({"jsonrpc":"2.0","id":7,"method":")" + method + R"(","params":)" + params + more +
           "}";
  }
  static const Value& at(const Value& v, std::string_view key) {
    static const Value none;
    const Value* found = v.as_map() ? v.as_map()->find(key) : nullptr;
    EXPECT_TRUE(found) << key << " in " << v.text();
    return found ? *found : none;
  }
};

TEST_F(Rpc, ArraysTravelAsBase64BothWays) {
  std::vector<double> q(600 * 6);
  for (std::size_t i = 0; i < q.size(); ++i) q[i] = std::cos(static_cast<double>(i));
  const NumericArray rows(q, 600, 6);
  const Map params{{"id", "puma560"}, {"q", rows}};
  const auto expected = app().dispatch(session_, "robot.fk", params);
  ASSERT_TRUE(expected.ok());
  const std::string sent = to_json(params, {}, Arrays::base64), plain = to_json(params);
  const std::string base64 = R"(,"arrays":"base64")";
  // The four ways to give and to get.
  for (const std::string& given : {sent, plain}) {
    const Value as_arrays = answer(request("robot.fk", given, base64));
    ASSERT_TRUE(at(at(as_arrays, "result"), "pose").as_array());
    EXPECT_EQ(*at(at(as_arrays, "result"), "pose").as_array(), *at(*expected, "pose").as_array());
    const Value as_numbers = answer(request("robot.fk", given));
    ASSERT_TRUE(at(at(as_numbers, "result"), "rpy").as_list());
    EXPECT_EQ(to_json(at(at(as_numbers, "result"), "rpy")), to_json(at(*expected, "rpy")));
  }
  const Value positional = answer(request(
      "robot.gravity_torques", R"(["puma560",)" + to_json(rows, {}, Arrays::base64) + "]", base64));
  EXPECT_EQ(at(positional, "result").as_array()->rows(), 600U);
}

TEST_F(Rpc, WhatIsWrongWithAnArrayIsAnsweredToItsRequest) {
  const Value shape = answer(request(
      "robot.fk", R"({"id":"puma560","q":{"$array":{"shape":[2,6],"base64":"AAAAAAAAAAA="}}})"));
  EXPECT_EQ(at(shape, "id"), Value(7));
  EXPECT_EQ(at(at(shape, "error"), "code"), Value(-32602));
  const std::string& said = *at(at(shape, "error"), "message").as_string();
  EXPECT_TRUE(said.starts_with("robot.fk, q: ")) << said;
  EXPECT_NE(said.find("12 numbers, 96 bytes"), std::string::npos) << said;
  const Value width = answer(request(
      "robot.fk", R"({"id":"puma560","q":{"$array":{"shape":[1,1],"base64":"AAAAAAAAAAA="}}})"));
  EXPECT_NE(at(at(width, "error"), "message").as_string()->find("1 column is given"),
            std::string::npos);
  const Value word = answer(request("version", "{}", R"(,"arrays":"binary")"));
  EXPECT_EQ(at(at(word, "error"), "code"), Value(-32600));
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
