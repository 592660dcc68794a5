// SPDX-License-Identifier: Apache-2.0
#include "kernel/messages.h"

#include <stdexcept>
#include <thread>

#include <gtest/gtest.h>

namespace robomosp {
namespace {

TEST(Messages, TheRingKeepsTheNewest) {
  Messages messages(3);
  for (int i = 0; i < 5; ++i) messages.post(Severity::info, "c", std::to_string(i));
  const auto recent = messages.recent();
  ASSERT_EQ(recent.size(), 3U);
  EXPECT_EQ(recent.front().text, "2");
  EXPECT_EQ(recent.back().text, "4");
  EXPECT_EQ(messages.recent(1).front().text, "4");
}

TEST(Messages, ARepeatedMessageIsCountedAndNotRepeated) {
  std::chrono::steady_clock::time_point now{};
  Messages messages(100, [&] { return now; });
  int heard = 0;
  std::uint32_t repeated = 0;
  messages.subscribe([&](const Message& m) {
    ++heard;
    repeated = m.repeated;
  });
  for (int i = 0; i < 20; ++i) messages.post(Severity::warning, "slow", "the step is late");
  EXPECT_EQ(heard, Messages::kRateLimit);
  messages.post(Severity::warning, "slow", "another text");
  EXPECT_EQ(heard, Messages::kRateLimit + 1);
  now += std::chrono::seconds(1);
  messages.post(Severity::warning, "slow", "the step is late");
  EXPECT_EQ(heard, Messages::kRateLimit + 2);
  EXPECT_EQ(repeated, 20U - Messages::kRateLimit);
}

TEST(Messages, ManyDifferentTextsDoNotGrowWithoutBound) {
  Messages messages(10);
  for (int i = 0; i < 10000; ++i) messages.post(Severity::debug, "n", std::to_string(i));
  EXPECT_EQ(messages.recent(1000).size(), 10U);
}

TEST(Messages, ASubscriberMayThrowPostAndUnsubscribe) {
  Messages messages;
  int heard = 0;
  std::uint64_t self = 0;
  messages.subscribe([](const Message&) { throw std::runtime_error("listener"); });
  self = messages.subscribe([&](const Message& m) {
    ++heard;
    if (m.text == "first") messages.post(Severity::info, "c", "second");
    messages.unsubscribe(self);
  });
  messages.post(Severity::info, "c", "first", "test");
  messages.post(Severity::info, "c", "third");
  EXPECT_EQ(heard, 2);
  EXPECT_EQ(messages.recent().front().source, "test");
}

TEST(Messages, ThreadsMayPostAtTheSameTime) {
  Messages messages(10000);
  {
    std::vector<std::jthread> threads;
    for (int t = 0; t < 4; ++t)
      threads.emplace_back([&, t] {
        for (int i = 0; i < 500; ++i)
          messages.post(Severity::info, "c", std::to_string(t * 1000 + i));
      });
  }
  EXPECT_EQ(messages.recent(10000).size(), 2000U);
}

}  // namespace
}  // namespace robomosp
