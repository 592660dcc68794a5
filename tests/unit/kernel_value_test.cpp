// SPDX-License-Identifier: Apache-2.0
#include "kernel/value.h"

#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "kernel/value_text.h"

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

TEST(Value, ABeginningOfItsTextIsNoLongerThanIsShown) {
  const std::string word(300, 'x');
  List rows;
  for (int i = 0; i < 100'000; ++i) rows.emplace_back(Map{{"a", 0.01}, {word, List{i, word}}});
  const std::vector<std::pair<Value, std::size_t>> values{
      {Value(std::move(rows)), 700},
      {Value(NumericArray(std::vector<double>(1'000'000, 0.125), 1000, 1000)), 100},
      {Value(NumericArray(std::vector<double>(1'000'000, 0.125))), 100},
      {Value(std::string(1'000'000, 'y')), 100},
      {Value(Map{{"x", 1}}), 10}};
  for (const auto& [value, spare] : values) {
    const std::string all = value.text();
    for (const std::size_t most :
         {std::size_t{0}, std::size_t{5}, std::size_t{60}, std::size_t{400}}) {
      const std::string some = beginning_of(value, most);
      // Beginnings agree as far as they are shown, and more than that shows that it goes on.
      EXPECT_EQ(some.substr(0, most), all.substr(0, most));
      EXPECT_EQ(some.size() > most, all.size() > most);
      EXPECT_LT(some.size(), most + spare) << "nothing is made for nobody";
    }
    EXPECT_EQ(beginning_of(value, all.size()), all);
  }
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

TEST(Value, ASharedMapIsAMapThatIsCopiedWhenItIsChanged) {
  const auto shared = std::make_shared<const Map>(Map{{"a", 1}, {"b", List{1, 2}}});
  const Value one(shared);
  Value other = one;
  EXPECT_EQ(one.type(), Value::Type::map);
  EXPECT_EQ(one.type_name(), "map");
  EXPECT_EQ(one.as_map(), shared.get());
  EXPECT_EQ(std::as_const(other).as_map(), shared.get());
  EXPECT_EQ(one, other);
  EXPECT_EQ(one, Value(*shared));
  EXPECT_EQ(Value(*shared), one);
  EXPECT_FALSE(one == Value());
  EXPECT_FALSE(one == Value(Map{{"a", 1}}));
  EXPECT_EQ(one.text(), Value(*shared).text());
  other.as_map()->set("a", 2);
  EXPECT_EQ(*other.as_map()->find("a"), Value(2));
  EXPECT_EQ(*shared->find("a"), Value(1));
  EXPECT_FALSE(one == other);
}

}  // namespace
}  // namespace robomosp
