// SPDX-License-Identifier: Apache-2.0
// What the bridges read of strangers: packages of RTDE, payloads of MQTT; and their queue.
#include <chrono>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "mqtt/payload.h"
#include "row_queue.h"
#include "rtde/protocol.h"
#include "support/seed.h"

namespace robomosp::bridges {
namespace {

using namespace std::chrono_literals;
using namespace std::string_literals;

TEST(Rtde, PackagesAreAsPublished) {
  EXPECT_EQ(rtde::request_version(), "\x00\x05V\x00\x02"s);
  EXPECT_EQ(rtde::package(rtde::Package::start), "\x00\x03S"s);
  EXPECT_EQ(rtde::request_outputs(125, {"timestamp", "actual_q"}),
            "\x00\x1dO\x40\x5f\x40\x00\x00\x00\x00\x00timestamp,actual_q"s);
  EXPECT_EQ(rtde::controller_version("\0\0\0\5\0\0\0\13\0\0\0\1\0\1\xa7\x1e"s), "5.11.1 (108318)");
  const auto recipe = rtde::recipe("\1DOUBLE,VECTOR6D,NOT_FOUND");
  ASSERT_TRUE(recipe);
  EXPECT_EQ(recipe->number, 1);
  EXPECT_EQ(recipe->types, (std::vector<std::string>{"DOUBLE", "VECTOR6D", "NOT_FOUND"}));
  EXPECT_EQ(rtde::text_message("\5hello\3abc\2"s), "hello");
}

TEST(Rtde, NumbersOfEveryTypeAreRead) {
  const std::string content =
      "\x07"
      "\x01"
      "\xff"
      "\xff\xff\xff\xfe"
      "\xff\xff\xff\xfe"
      "\x00\x00\x00\x00\x00\x00\x01\x00"
      "\xbf\xf8\x00\x00\x00\x00\x00\x00"s;
  const rtde::Type types[] = {rtde::Type::boolean, rtde::Type::uint8,  rtde::Type::int32,
                              rtde::Type::uint32,  rtde::Type::uint64, rtde::Type::number};
  const auto values = rtde::data(content, 7, types);
  ASSERT_TRUE(values);
  EXPECT_EQ(*values, (std::vector<double>{1, 255, -2, 4294967294.0, 256, -1.5}));
  EXPECT_FALSE(rtde::data(content, 8, types));
  for (std::size_t n = 0; n < content.size(); ++n)
    EXPECT_FALSE(rtde::data(std::string_view(content).substr(0, n), 7, types));
  EXPECT_FALSE(rtde::data(content + "x", 7, types));
}

TEST(Rtde, AStreamIsCutIntoPackagesHoweverItComes) {
  std::mt19937 random(test::seed());
  std::string stream;
  std::vector<std::string> sent;
  for (int i = 0; i < 200; ++i) {
    sent.emplace_back(random() % 300, static_cast<char>(random()));
    stream += rtde::package(rtde::Package::data, sent.back());
  }
  rtde::Reader reader;
  std::vector<std::string> got;
  for (std::size_t at = 0; at < stream.size();) {
    const std::size_t n = std::min<std::size_t>(1 + random() % 500, stream.size() - at);
    reader.add(std::string_view(stream).substr(at, n));
    at += n;
    while (const auto found = reader.next()) got.emplace_back(found->content);
  }
  EXPECT_EQ(got, sent);
  EXPECT_FALSE(reader.is_broken());
  reader.add("\0\2x"s);
  EXPECT_FALSE(reader.next());
  EXPECT_TRUE(reader.is_broken());
}

TEST(Rtde, AnyBytesAreReadWithoutHarm) {
  std::mt19937 random(test::seed());
  const rtde::Type types[] = {rtde::Type::number, rtde::Type::vector6, rtde::Type::vector6_int32};
  for (int round = 0; round < 2000; ++round) {
    std::string bytes(random() % 400, '\0');
    for (char& c : bytes) c = static_cast<char>(random());
    rtde::Reader reader;
    reader.add(bytes);
    while (const auto found = reader.next()) {
      (void)rtde::recipe(found->content);
      (void)rtde::accepted(found->content);
      (void)rtde::text_message(found->content);
      (void)rtde::controller_version(found->content);
      (void)rtde::data(found->content, 7, types);
    }
  }
}

TEST(Payloads, AnyBytesGiveNumbersOrASentence) {
  std::mt19937 random(test::seed());
  const Json config = Json::parse(
      R"({"field": "/a/b", "count": 2, "sign": [1, -1], "scale": 2, "offset": [0, 1]})");
  Table table(config, "");
  const FieldMap field = read_field(table, "");
  EXPECT_EQ(read_payload(R"({"a": {"b": [3, 4]}})", {&field}), (std::vector<double>{6, -7}));
  const std::string good = R"({"a": {"b": [3.5, -4e2]}, "c": [null, true, "x"]})";
  std::size_t refused = 0;
  for (int round = 0; round < 20000; ++round) {
    std::string text = good;
    for (std::size_t k = random() % 4 + 1; k > 0; --k) switch (random() % 3) {
        case 0: text[random() % text.size()] = static_cast<char>(random()); break;
        case 1: text.erase(random() % text.size(), 1); break;
        default: text.insert(random() % text.size(), 1, "[]{}:,0-.e\"\\"[random() % 12]);
      }
    try {
      for (const double v : read_payload(text, {&field})) EXPECT_TRUE(std::isfinite(v));
    } catch (const PayloadFault&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 1000U);
}

TEST(RowQueues, DropTheOldestAndPutBackInOrder) {
  RowQueue queue(3);
  for (int i = 1; i <= 5; ++i) queue.push({0, {double(i)}});
  EXPECT_EQ(queue.dropped(), 2U);
  std::vector<Row> rows = queue.take(2, 0ms);
  ASSERT_EQ(rows.size(), 2U);
  EXPECT_EQ(rows[0].values[0], 3);
  queue.push({0, {6}});
  queue.put_back(std::move(rows));  // 3 has no place any more
  EXPECT_EQ(queue.dropped(), 3U);
  rows = queue.take(10, 0ms);
  ASSERT_EQ(rows.size(), 3U);
  EXPECT_EQ(rows[0].values[0], 4);
  EXPECT_EQ(rows[2].values[0], 6);
}

}  // namespace
}  // namespace robomosp::bridges
