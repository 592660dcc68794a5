// SPDX-License-Identifier: Apache-2.0
#include <random>
#include <string>

#include <gtest/gtest.h>

#include "kernel/base64.h"

namespace robomosp {
namespace {

std::string encoded(std::string_view bytes) {
  std::string out;
  base64::append(out, bytes);
  return out;
}

TEST(Base64, IsThatOfRfc4648) {
  const std::pair<const char*, const char*> vectors[] = {{"", ""},
                                                         {"f", "Zg=="},
                                                         {"fo", "Zm8="},
                                                         {"foo", "Zm9v"},
                                                         {"foob", "Zm9vYg=="},
                                                         {"fooba", "Zm9vYmE="},
                                                         {"foobar", "Zm9vYmFy"}};
  for (const auto& [plain, text] : vectors) {
    EXPECT_EQ(encoded(plain), text);
    ASSERT_EQ(base64::decoded_size(text), std::string_view(plain).size());
    std::string back(std::string_view(plain).size(), '?');
    EXPECT_TRUE(base64::decode(text, back.data()));
    EXPECT_EQ(back, plain);
  }
}

TEST(Base64, BytesComeBackAtAnyLength) {
  std::mt19937 random(5);
  for (std::size_t size = 0; size < 300; ++size) {
    std::string bytes(size, 0);
    for (char& c : bytes) c = static_cast<char>(random());
    const std::string text = "before" + encoded(bytes);
    const std::string_view own = std::string_view(text).substr(6);
    ASSERT_EQ(base64::decoded_size(own), size);
    std::string back(size + 8, '~');
    ASSERT_TRUE(base64::decode(own, back.data()));
    EXPECT_EQ(back, bytes + std::string(8, '~')) << "nothing is written behind";
  }
}

TEST(Base64, WhatIsNoneIsRefused) {
  std::string room(1000, 0);
  for (const char* text : {"Zg=", "Z", "Zg", "Zh==", "Zm9=", "Zm 8=", "Zm8\n",
                           "====", "Z===", "Zg==Zg==", "Zm9v=Zm9", "Zm-_", "Zm9v\xff\xff\xff\xff"})
    EXPECT_FALSE(base64::decoded_size(text) && base64::decode(text, room.data())) << text;
  const std::string good = encoded(std::string(200, 'x'));
  for (std::size_t i = 0; i + 4 < good.size(); ++i)
    for (const char bad : {'=', '-', ' ', '\0', '\x80'}) {
      std::string text = good;
      text[i] = bad;
      EXPECT_FALSE(base64::decode(text, room.data())) << i;
    }
}

}  // namespace
}  // namespace robomosp
