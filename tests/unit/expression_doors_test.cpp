// SPDX-License-Identifier: Apache-2.0
// Every number of every kind of record becomes an expression by record.set, and describe shows it.
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "ioci/core/commands.h"
#include "support/expression_slots.h"

namespace robomosp {
namespace {

using test::same_number;
using test::Slot;

struct ExpressionDoors : test::OpenRecords {};

TEST_F(ExpressionDoors, DescribeShowsThemAll) {
  for (const AnyId id : samples.ids) {
    SCOPED_TRACE(d.now()->describe(id));
    open(id);
    const auto& texts = model::parametric_of(body(id))->expressions;
    const Map described = ioci::describe_record(*d.now(), id);
    const Value* shown = described.find("expressions");
    for (const auto& [path, expression] : texts) {
      const Value* one = shown && shown->as_map() ? shown->as_map()->find(path) : nullptr;
      EXPECT_TRUE(one && *one->as_string() == expression) << path;
    }
  }
}

TEST_F(ExpressionDoors, RecordSetTakesThemAll) {
  auto made = ioci::Application::create({});
  ASSERT_TRUE(made.ok()) << made.error().sentence();
  ioci::Application& app = **made;
  ioci::Session session{"test"};
  for (const AnyId id : samples.ids) {
    const std::filesystem::path file = d.now()->find(id)->file;
    SCOPED_TRACE(d.now()->describe(id));
    auto tx = app.document.begin("load");
    const auto loaded = io::load(*tx, file, {});
    ASSERT_TRUE(loaded.ok()) << loaded.error().sentence();
    const AnyId there = loaded->id;
    std::vector<Slot> slots;
    const auto& known = model::parametric_of(body(id))->expressions;
    for (Slot& s : test::slots_of(body(id)))
      if (!known.contains(s.path) && std::isfinite(s.value)) slots.push_back(std::move(s));
    ASSERT_TRUE(tx->edit(there, [&](model::Record& r) -> Result<void> {
                    auto& p = model::parametric_of(r.body)->parameters;
                    for (std::size_t i = 0; i < slots.size(); ++i)
                      p.push_back({"p" + std::to_string(i), "", slots[i].unit, slots[i].value, ""});
                    return {};
                  }).ok());
    ASSERT_TRUE(tx->commit().ok());
    const model::Body before = app.document.now()->find(there)->body;
    for (std::size_t i = 0; i < slots.size(); ++i) {
      const auto set = app.dispatch(session, "record.set",
                                    {{"id", ioci::Application::handle(there)},
                                     {"path", slots[i].path},
                                     {"value", "p" + std::to_string(i) + " * 1"}});
      ASSERT_TRUE(set.ok()) << slots[i].path << ": " << set.error().sentence();
    }
    const model::Body& after = app.document.now()->find(there)->body;
    for (std::size_t i = 0; i < slots.size(); ++i) {
      const auto& texts = model::parametric_of(after)->expressions;
      const auto text = texts.find(slots[i].path);
      ASSERT_NE(text, texts.end()) << slots[i].path;
      EXPECT_EQ(text->second, "p" + std::to_string(i) + " * 1");
      EXPECT_TRUE(same_number(model::number_at(after, slots[i].path)->value,
                              model::number_at(before, slots[i].path)->value))
          << slots[i].path;
    }
  }
}

}  // namespace
}  // namespace robomosp
