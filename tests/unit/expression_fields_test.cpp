// SPDX-License-Identifier: Apache-2.0
// Every real number of every kind of record, found by the declarations of the fields alone, takes
// an expression: its value follows the parameter, undo brings both back, and the file keeps them.
// Other numbers of the record stay as they are.
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "model/marked_numbers.h"
#include "support/expression_slots.h"

namespace robomosp {
namespace {

using test::same_number;
using test::Slot;

struct ExpressionFields : test::OpenRecords {};

TEST_F(ExpressionFields, EveryNumberFollowsItsParameterAloneAndUndoBringsItBack) {
  for (const AnyId id : samples.ids) {
    SCOPED_TRACE(d.now()->describe(id));
    const std::vector<Slot> slots = open(id);
    if (HasFailure()) return;
    const model::Body before = body(id);
    for (std::size_t i = 0; i < slots.size(); ++i) {
      const Slot& s = slots[i];
      const double v = s.value;
      bool is_set = false;
      for (const double other : {v * 1.01, v * 0.99, v + 0.125, 0.5, 2.0, 1.0, 0.0, -0.25}) {
        if (other == v || !set(id, "p" + std::to_string(i), other)) continue;
        is_set = true;
        EXPECT_TRUE(same_number(model::number_at(body(id), s.path)->value, other)) << s.path;
        const auto differences = model::differences(before, body(id));
        EXPECT_EQ(differences.size(), 2U) << s.path;  // the number, and the parameter
        ASSERT_TRUE(d.undo().ok());
        EXPECT_TRUE(model::equal(before, body(id))) << s.path;
        break;
      }
      EXPECT_TRUE(is_set) << s.path << " = " << v << ": no other value was taken";
    }
    if (slots.empty()) continue;  // a task without steps
    ASSERT_TRUE(d.undo().ok());
    EXPECT_FALSE(model::parametric_of(body(id))->expressions.contains(slots[0].path));
  }
}

TEST_F(ExpressionFields, FilesHaveAllOfThem) {
  for (const AnyId id : samples.ids) {
    SCOPED_TRACE(d.now()->describe(id));
    open(id);
    const auto& texts = model::parametric_of(body(id))->expressions;
    const std::filesystem::path file = d.now()->find(id)->file;
    const auto text = io::print(*d.now(), id, file, {});
    ASSERT_TRUE(text.ok()) << text.error().sentence();
    document::Document other;
    auto tx = other.begin("load");
    const auto loaded = io::load_text(*tx, *text, file.string(), file.parent_path(), {});
    ASSERT_TRUE(loaded.ok()) << loaded.error().sentence() << "\n" << *text;
    const model::Body& back = tx->now().find(loaded->id)->body;
    EXPECT_EQ(model::parametric_of(back)->expressions, texts) << *text;
    for (const auto& [path, expression] : texts)
      EXPECT_TRUE(
          same_number(model::number_at(back, path)->value, model::number_at(body(id), path)->value))
          << path;
    const auto again = io::print(tx->now(), loaded->id, file, {});
    ASSERT_TRUE(again.ok()) << again.error().sentence();
    EXPECT_EQ(*again, *text);
  }
}

TEST(MarkedNumbers, AreNearTheirValuesWithinTheirRangeAndEachIsFoundAgain) {
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  const struct {
    double value, min, max;
  } cases[] = {
      {1, 0, 1},         {1, 1, 2},        {0, 0, kInfinite},     {0, -kInfinite, 0},
      {1e300, 0, 1e300}, {-1e-300, -1, 1}, {0.1, -1, 1},          {0.1, -1, 1},
      {1e-320, 0, 1},    {-1, -1, 0},      {1.7e308, 0, 1.7e308}, {5, -kInfinite, kInfinite}};
  model::MarkedNumbers marks;
  std::vector<double> given;
  std::size_t n = 0;
  for (const auto& c : cases) {
    const double v = marks.near(c.value, c.min, c.max, "x" + std::to_string(n++));
    EXPECT_NE(v, c.value);
    EXPECT_GE(v, c.min);
    EXPECT_LE(v, c.max);
    EXPECT_LE(std::abs(v - c.value), 1e-12 * std::abs(c.value) + 1e-300);
    given.push_back(v);
  }
  for (std::size_t i = 0; i < given.size(); ++i)
    EXPECT_EQ(*marks.find(given[i]), "x" + std::to_string(i));
  EXPECT_EQ(marks.near(3, 3, 3, "y"), 3);  // no room
  EXPECT_EQ(marks.find(0.1), nullptr);
  EXPECT_EQ(model::number_of_nan(model::marked_nan(0xfffffffeU)), 0xfffffffeU);
  EXPECT_FALSE(model::number_of_nan(std::nan("")));
  EXPECT_FALSE(model::number_of_nan(1.0));
}

/// What an edit does to the places of elements: the expression stays with its own.
TEST(ExpressionsOfLists, FollowElementsOfListsWithoutNames) {
  const auto segment = [](double speed) {
    model::TrajectorySegment s;
    s.shape.name = "line";
    s.shape.params["speed"] = speed;
    s.points.resize(2);
    return s;
  };
  using Change = std::function<void(std::vector<model::TrajectorySegment>&)>;
  const struct {
    const char* name;
    Change change;
    std::map<std::string, std::string> expected;
  } cases[] = {
      {"one in front, as fast",
       [&](auto& s) {
         s.insert(s.begin(), segment(0.1));
         s[0].points[0].position[0] = 2;
       },
       {{"segments.2.shape.speed", "v"}, {"segments.3.shape.speed", "w"}}},
      {"one between",
       [&](auto& s) { s.insert(s.begin() + 1, segment(0.7)); },
       {{"segments.1.shape.speed", "v"}, {"segments.3.shape.speed", "w"}}},
      {"exchanged",
       [&](auto& s) { std::swap(s[0], s[1]); },
       {{"segments.2.shape.speed", "v"}, {"segments.1.shape.speed", "w"}}},
      {"the first goes", [&](auto& s) { s.erase(s.begin()); }, {{"segments.1.shape.speed", "w"}}},
      {"all go", [&](auto& s) { s.clear(); }, {}},
      {"a plain number",
       [&](auto& s) { s[0].shape.params["speed"] = 0.3; },
       {{"segments.2.shape.speed", "w"}}}};
  for (const auto& c : cases) {
    model::Trajectory t;
    t.segments = {segment(0.1), segment(0.2)};
    t.segments[1].points[0].position[0] = 1;  // so that they are told apart
    t.parametric.expressions = {{"segments.1.shape.speed", "v"}, {"segments.2.shape.speed", "w"}};
    const model::Body before = t;
    c.change(t.segments);
    model::Body after = t;
    model::follow_edit(before, after);
    EXPECT_EQ(model::parametric_of(after)->expressions, c.expected) << c.name;
  }
}

}  // namespace
}  // namespace robomosp
