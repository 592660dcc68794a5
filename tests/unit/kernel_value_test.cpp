// SPDX-License-Identifier: Apache-2.0
#include "kernel/value.h"

#include <gtest/gtest.h>

namespace robomosp {
namespace {

TEST(Value, TextReadsWell) {
  EXPECT_EQ(Value().text(), "nil");
  EXPECT_EQ(Value(true).text(), "true");
  EXPECT_EQ(Value(3).text(), "3");
  EXPECT_EQ(Value(0.1).text(), "0.1");
  EXPECT_EQ(Value("plain").text(), "plain");
  EXPECT_EQ(Value(Handle{"robot", 17}).text(), "robot#17");
  EXPECT_EQ(Value(List{1, 2.5, "a\"b"}).text(), "{1, 2.5, \"a\\\"b\"}");
  EXPECT_EQ(Value(Map{{"x", 1}, {"a b", List{}}, {"m", Map{}}}).text(),
            "{x = 1, [\"a b\"] = {}, m = {}}");
  EXPECT_EQ(Value(NumericArray({1, 2}, "N m")).text(), "{1, 2} N m");
  EXPECT_EQ(Value(NumericArray({1, 2, 3, 4}, 2, 2)).text(), "{{1, 2}, {3, 4}}");
  EXPECT_EQ(Value(List{List{1, List{2}}, 3}).text(), "{{1, {2}}, 3}");
}

TEST(Value, MapsKeepTheOrderOfInsertionAndReplaceInPlace) {
  Map m{{"b", 1}, {"a", 2}};
  m.set("b", 3);
  m.set("c", 4);
  EXPECT_EQ(Value(m).text(), "{b = 3, a = 2, c = 4}");
  EXPECT_TRUE(m.erase("a"));
  EXPECT_FALSE(m.erase("a"));
  EXPECT_EQ(m.find("a"), nullptr);
  ASSERT_NE(m.find("c"), nullptr);
  EXPECT_EQ(*m.find("c"), Value(4));
}

TEST(Value, MapsAreEqualWhateverTheirOrder) {
  EXPECT_EQ((Map{{"a", 1}, {"b", 2}}), (Map{{"b", 2}, {"a", 1}}));
  EXPECT_FALSE((Map{{"a", 1}}) == (Map{{"a", 2}}));
  EXPECT_FALSE((Map{{"a", 1}}) == (Map{{"b", 1}}));
}

TEST(Value, ATypeIsNeverMistakenForAnother) {
  const Value values[] = {Value(),       Value(true),  Value(1),
                          Value(1.5),    Value("s"),   Value(NumericArray({1})),
                          Value(List{}), Value(Map{}), Value(Handle{"job", 1})};
  const char* names[] = {"nil", "bool", "int", "real", "string", "array", "list", "map", "handle"};
  for (std::size_t i = 0; i < std::size(values); ++i) {
    EXPECT_EQ(values[i].type_name(), names[i]);
    for (std::size_t j = 0; j < std::size(values); ++j) EXPECT_EQ(values[i] == values[j], i == j);
  }
  EXPECT_EQ(Value(2).number(), 2.0);
  EXPECT_EQ(Value("2").number(), 0.0);
}

}  // namespace
}  // namespace robomosp
