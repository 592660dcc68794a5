// SPDX-License-Identifier: Apache-2.0
// document.outline and record.outline: the rows of trees, by paths that record.set takes.
#include <string>

#include <gtest/gtest.h>

#include "ioci/core/application.h"

namespace robomosp {
namespace {

const Map kFoot{{"kind", "box"}, {"name", "foot"}, {"x", 0.1}, {"y", 0.1}, {"z", 0.1}};

class Outline : public testing::Test {
 protected:
  void SetUp() override {
    ioci::ApplicationOptions options;
    options.plugins = false;
    options.library = {ROBOMOSP_SOURCE_DIR "/scripts/library"};
    auto made = ioci::Application::create(std::move(options));
    ASSERT_TRUE(made.ok()) << made.error().sentence();
    app = std::move(*made);
  }
  Value call(const std::string& command, const Map& args) {
    auto r = app->dispatch(session, command, args);
    EXPECT_TRUE(r.ok()) << command << ": " << (r.ok() ? "" : r.error().sentence());
    return r.ok() ? *r : Value();
  }
  static const Map& map(const Value& v) { return *v.as_map(); }
  static std::string text(const Value& row, const char* key) {
    const Value* v = map(row).find(key);
    return v && v->as_string() ? *v->as_string() : std::string();
  }
  /// The rows of a group.
  List rows(const Value& id, const std::string& group, int from = 1, int at_most = 1000) {
    const Value v = call("record.outline",
                         {{"id", id}, {"group", group}, {"from", from}, {"at_most", at_most}});
    if (!v.as_list() || v.as_list()->empty()) return {};
    return *map(v.as_list()->front()).find("rows")->as_list();
  }
  std::unique_ptr<ioci::Application> app;
  ioci::Session session{"test"};
};

TEST_F(Outline, ListsRecordsWithNamesAndTellsThoseOfTheLibrary) {
  call("material.create", {{"name", "brass"}, {"density", 8500.0}});
  call("material.get", {{"name", "steel"}});
  const Value all = call("document.outline", {});
  ASSERT_EQ(all.as_list()->size(), 2U);
  EXPECT_EQ(text((*all.as_list())[0], "name"), "brass");
  EXPECT_EQ(map((*all.as_list())[0]).find("is_library"), nullptr);
  EXPECT_EQ(text((*all.as_list())[1], "kind"), "material");
  EXPECT_NE(map((*all.as_list())[1]).find("is_library"), nullptr);
}

TEST_F(Outline, EveryRowOfEveryKindHasAPathThatRecordSetTakes) {
  call("solid.create",
       {{"name", "block"},
        {"root", Map{{"kind", "union"},
                     {"children", List{kFoot, Map{{"kind", "sphere"}, {"radius", 0.1}}}}}}});
  call("robot.create",
       {{"name", "arm"}, {"links", List{Map{{"name", "upper"}, {"a", 0.3}}, Map{{"a", 0.2}}}}});
  call("task.create",
       {{"name", "shift"}, {"steps", List{Map{{"step", "message"}, {"text", "hello"}}}}});
  call("world.create", {{"name", "cell"}});
  call("world.add_object", {{"id", "cell"}, {"what", "block"}, {"name", "first"}});
  call("world.add_object", {{"id", "cell"}, {"what", "block"}, {"name", "a.b"}});
  call("world.add_robot", {{"id", "cell"}, {"robot", "arm"}});
  int checked = 0;
  const Value all = call("document.outline", {});
  for (const Value& record : *all.as_list()) {
    const Value id = *map(record).find("id");
    const Value groups = call("record.outline", {{"id", id}});
    for (const Value& group : *groups.as_list())
      for (const Value& row : *map(group).find("rows")->as_list()) {
        const std::string path = text(row, "path"), name = text(row, "name");
        // Setting its name to what it is changes nothing, and so proves that the path leads there.
        if (name.empty()) continue;
        const auto before = call("document.digest", {});
        const auto r = app->dispatch(session, "record.set",
                                     {{"id", id}, {"path", path + ".name"}, {"value", name}});
        EXPECT_TRUE(r.ok()) << path << ": " << (r.ok() ? "" : r.error().sentence());
        EXPECT_EQ(call("document.digest", {}), before) << path;
        ++checked;
      }
  }
  EXPECT_GE(checked, 7);
}

TEST_F(Outline, RowsTellKindParentAndTheRecordThatTheyPlace) {
  call("solid.create",
       {{"name", "block"}, {"root", Map{{"kind", "union"}, {"children", List{kFoot}}}}});
  const List nodes = rows("block", "nodes");
  ASSERT_EQ(nodes.size(), 2U);
  EXPECT_EQ(text(nodes[0], "detail"), "union");
  EXPECT_EQ(map(nodes[0]).find("parent"), nullptr);
  EXPECT_EQ(text(nodes[1], "path"), "nodes.foot");
  EXPECT_EQ(map(nodes[1]).find("parent")->number(), 1);
  call("world.create", {{"name", "cell"}});
  call("world.add_object", {{"id", "cell"}, {"what", "block"}});
  const List objects = rows("cell", "objects");
  ASSERT_EQ(objects.size(), 1U);
  EXPECT_EQ(map(objects[0]).find("refers")->as_handle()->kind, "solid");
}

TEST_F(Outline, PagesTogetherAreTheWholeList) {
  call("solid.create", {{"name", "block"}, {"root", kFoot}});
  call("world.create", {{"name", "stock"}});
  List objects;
  for (int i = 0; i < 25; ++i)
    objects.emplace_back(Map{{"what", "block"}, {"name", "b" + std::to_string(i)}});
  call("world.add_objects", {{"id", "stock"}, {"objects", objects}});
  const List whole = rows("stock", "objects");
  List pages;
  for (int from = 1; from <= 25; from += 10)
    for (const Value& row : rows("stock", "objects", from, 10)) pages.push_back(row);
  EXPECT_EQ(pages, whole);
  EXPECT_TRUE(rows("stock", "objects", 26).empty());
}

TEST_F(Outline, AnUnknownGroupIsRefusedWithThoseThereAre) {
  call("world.create", {{"name", "cell"}});
  const auto r = app->dispatch(session, "record.outline", {{"id", "cell"}, {"group", "robot"}});
  ASSERT_FALSE(r.ok());
  EXPECT_NE(r.error().sentence().find("robots"), std::string::npos) << r.error().sentence();
}

TEST_F(Outline, ARecordingIsRefusedByAllCommandsOfRecordsOfAnyKind) {
  const List columns{Map{{"name", "q1"}, {"values", List{0.0, 0.1}}}};
  const Value recording = call("recording.create", {{"title", "taken"}, {"columns", columns}});
  ASSERT_TRUE(recording.as_handle());
  int tried = 0;
  for (const ioci::CommandSpec* spec : app->commands.list()) {
    if (!spec->name.starts_with("record.")) continue;
    Map args;
    for (const ParamSpec& p : spec->params) {
      if (p.name == "id" && p.type == "ref:any") args.set("id", recording);
      else if (p.required) args.set(p.name, "x");
    }
    if (!args.find("id")) continue;
    const auto r = app->dispatch(session, spec->name, args);
    ASSERT_FALSE(r.ok()) << spec->name;
    EXPECT_NE(r.error().sentence().find("is a recording, not a record"), std::string::npos)
        << spec->name << ": " << r.error().sentence();
    ++tried;
  }
  EXPECT_GE(tried, 8);
}

TEST_F(Outline, WithoutAWindowItsCommandsSaySo) {
  EXPECT_EQ(call("window.is_open", {}), Value(false));
  const auto r = app->dispatch(session, "window.read", {{"widget", "console"}});
  ASSERT_FALSE(r.ok());
  EXPECT_NE(r.error().sentence().find("no window is open"), std::string::npos);
}

}  // namespace
}  // namespace robomosp
