// SPDX-License-Identifier: Apache-2.0
// Elements that are loaded from files into a world: placed, named, undone as one step.
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>

#include "ioci/core/application.h"
#include "support/program.h"

namespace robomosp::ioci {
namespace {

namespace fs = std::filesystem;

class WorldLoad : public test::CommandTest {
 protected:
  void SetUp() override {
    CommandTest::SetUp();
    folder_ = fs::temp_directory_path() / ("robomosp-load-" + std::to_string(::getpid()));
    fs::create_directories(folder_);
    fs::current_path(folder_);
    call("solid.create",
         {{"name", "crate"}, {"root", Map{{"kind", "box"}, {"x", 0.1}, {"y", 0.1}, {"z", 0.1}}}});
    call("solid.save", {{"id", "crate"}, {"file", "crate.csg"}});
    call("robot.create", {{"name", "arm"}, {"links", List{Map{{"a", 0.3}}, Map{{"a", 0.2}}}}});
    call("robot.save", {{"id", "arm"}, {"file", "arm.rbt"}});
    call("trajectory.create",
         {{"name", "stroke"},
          {"segments",
           List{Map{{"shape", "line"},
                    {"points", List{List{0, 0, 0, 0, 0, 0}, List{0.1, 0, 0, 0, 0, 0}}}}}}});
    call("trajectory.save", {{"id", "stroke"}, {"file", "stroke.tjc"}});
    call("task.create",
         {{"name", "say"}, {"steps", List{Map{{"step", "message"}, {"text", "hello"}}}}});
    call("task.save", {{"id", "say"}, {"file", "say.tsk"}});
    // A small world of all of them.
    call("world.create", {{"name", "corner"}});
    call("world.add_object", {{"id", "corner"}, {"what", "crate"}, {"position", List{0, 1, 0}}});
    call("world.add_robot", {{"id", "corner"}, {"robot", "arm"}, {"q", List{0.5, 0.25}}});
    call("world.add_frame", {{"id", "corner"}, {"name", "bench"}, {"position", List{1, 0, 0}}});
    call("world.add_task", {{"id", "corner"}, {"task", "say"}, {"robot", "arm"}});
    call("world.add_signal", {{"id", "corner"}, {"name", "ready"}, {"from", "arm"}});
    call("world.attach", {{"id", "corner"}, {"object", "crate"}, {"robot", "arm"}});
    call("world.save", {{"id", "corner"}, {"file", "corner.wld"}});
    call("document.clear");
    call("world.create", {{"name", "cell"}});
  }
  void TearDown() override {
    fs::current_path(fs::temp_directory_path());
    fs::remove_all(folder_);
  }
  List load(Map args) {
    args.set("id", "cell");
    const Value made = call("world.load_element", args);
    return made.as_list() ? *made.as_list() : List{};
  }
  std::string refusal(Map args) {
    args.set("id", "cell");
    return fails("world.load_element", args).sentence();
  }
  Value described() { return call("world.describe", {{"id", "cell"}}); }
  std::size_t records(const char* kind) {
    return call(std::string(kind) + ".list").as_list()->size();
  }
  fs::path folder_;
};

TEST_F(WorldLoad, EachKindIsLoadedAndPlacedInOneStep) {
  const std::string before = app().document.content_digest();
  const struct {
    Map args;
    const char *list, *name;
  } cases[] = {
      {{{"file", "crate.csg"}, {"position", List{1, 2, 3}}}, "world.objects", "crate"},
      {{{"file", "arm.rbt"}, {"q", List{0.1, 0.2}}, {"name", "left"}}, "world.robots", "left"},
      {{{"file", "stroke.tjc"}}, "world.trajectories", "stroke"},
      {{{"file", "say.tsk"}}, "world.tasks", "say"},
  };
  for (const auto& c : cases) {
    EXPECT_EQ(load(c.args), List{Value(c.name)});
    const Value listed = call(c.list, {{"id", "cell"}});
    ASSERT_EQ(listed.as_list()->size(), 1U) << c.name;
    EXPECT_EQ(at(listed.as_list()->front(), "name"), Value(c.name));
    call("document.undo");
    EXPECT_EQ(app().document.content_digest(), before) << "record and member are one step";
  }
  load(cases[0].args);
  const Value crate = call("world.objects", {{"id", "cell"}}).as_list()->front();
  EXPECT_EQ(at(at(crate, "placement"), "position").as_array()->data(),
            (std::vector<double>{1, 2, 3}));
  load(cases[1].args);
  const Value arm = call("world.robots", {{"id", "cell"}}).as_list()->front();
  EXPECT_EQ(at(arm, "q").as_array()->data(), (std::vector<double>{0.1, 0.2}));
}

TEST_F(WorldLoad, ARobotOfAnotherFormatIsImported) {
  bool has_reader = false;
  for (const auto& info : app().registry.list("robomosp.importer/1"))
    has_reader = has_reader || info.name == "robot";
  if (!has_reader) GTEST_SKIP() << "this build reads no files of robots";
  std::ofstream("two.urdf") << R"(<robot name="two"><link name="base"/><link name="tip"/>
<joint name="turn" type="revolute"><parent link="base"/><child link="tip"/><origin xyz="0 0 0.1"/>
<axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>)";
  EXPECT_EQ(load({{"file", "two.urdf"}, {"position", List{0, 0, 1}}}), List{Value("two")});
  EXPECT_EQ(call("world.robots", {{"id", "cell"}}).as_list()->size(), 1U);
  call("document.undo");
  EXPECT_EQ(records("robot"), 0U);
}

TEST_F(WorldLoad, NamesThatClashGoByTheUsersChoice) {
  const Map crate{{"file", "crate.csg"}, {"position", List{1, 0, 0}}};
  load(crate);
  EXPECT_EQ(load(crate), List{Value("crate_2")});
  EXPECT_EQ(records("solid"), 1U) << "a file that is there is not loaded again";
  Map refuse = crate;
  refuse.set("clash", "refuse");
  EXPECT_EQ(
      refusal(refuse),
      "world \"cell\": there is already a member named \"crate\". Give another name, or clash "
      "= \"rename\" or \"replace\".");
  EXPECT_EQ(load({{"file", "arm.rbt"}, {"name", "arm"}}), List{Value("arm")});
  EXPECT_EQ(
      refusal({{"file", "crate.csg"}, {"name", "arm"}, {"clash", "replace"}}),
      "world \"cell\": member \"arm\" is of a different kind and cannot be replaced. Give another "
      "name, or clash = \"rename\".");
  // Replaced without a place given it stands where the old one stood.
  call("solid.create",
       {{"name", "drum"}, {"root", Map{{"kind", "cylinder"}, {"radius", 0.1}, {"height", 0.2}}}});
  call("solid.save", {{"id", "drum"}, {"file", "drum.csg"}});
  EXPECT_EQ(load({{"file", "drum.csg"}, {"name", "crate"}, {"clash", "replace"}}),
            List{Value("crate")});
  const Value all = call("world.objects", {{"id", "cell"}});
  ASSERT_EQ(all.as_list()->size(), 2U);
  const Value& replaced = all.as_list()->front();
  EXPECT_EQ(*app().name_of(*at(replaced, "what").as_handle()), "drum");
  EXPECT_EQ(at(at(replaced, "placement"), "position").as_array()->data(),
            (std::vector<double>{1, 0, 0}));
}

TEST_F(WorldLoad, AllThatAnotherWorldHoldsIsTakenOver) {
  load({{"file", "arm.rbt"}});
  const List names = load({{"file", "corner.wld"}, {"position", List{0, 0, 2}}});
  EXPECT_EQ(names, (List{Value("crate"), Value("arm_2"), Value("bench"), Value("say")}));
  EXPECT_EQ(records("world"), 1U) << "only its elements were wanted";
  const auto list = [&](const char* command) { return *call(command, {{"id", "cell"}}).as_list(); };
  EXPECT_EQ(at(at(list("world.objects")[0], "placement"), "position").as_array()->data(),
            (std::vector<double>{0, 1, 2}));
  EXPECT_EQ(at(list("world.robots")[1], "q").as_array()->data(), (std::vector<double>{0.5, 0.25}));
  EXPECT_EQ(at(list("world.tasks")[0], "robot"), Value("arm_2")) << "names follow";
  EXPECT_EQ(at(list("world.attachments")[0], "robot"), Value("arm_2"));
  EXPECT_EQ(at(list("world.signals")[0], "from"), Value("arm_2"));
  call("document.undo");
  EXPECT_EQ(list("world.robots").size(), 1U);
  call("world.add_signal", {{"id", "cell"}, {"name", "ready"}, {"kind", "analogue"}});
  EXPECT_EQ(refusal({{"file", "corner.wld"}}),
            "world \"cell\": signal \"ready\" already exists and differs in kind, unit or initial "
            "value. Tasks refer to signals by name, so it is not renamed; change one of the two.");
}

TEST_F(WorldLoad, WhatHasNoPlaceOrIsNotThereIsRefusedInASentence) {
  call("material.create", {{"name", "brass"}, {"density", 8500}});
  call("material.save", {{"id", "brass"}, {"file", "brass.mtr"}});
  EXPECT_EQ(refusal({{"file", "brass.mtr"}}),
            "\"brass.mtr\" holds a material. Only elements with a placement can be in a world; "
            "load materials with file.load.");
  EXPECT_EQ(
      refusal({{"file", "crate.csg"}, {"q", List{1}}}),
      "world.load_element, q: q is for a robot, but the file contains a solid. Leave it out.");
  EXPECT_NE(refusal({{"file", "none.rbt"}}).find("none.rbt"), std::string::npos);
  EXPECT_NE(refusal({{"file", "notes.txt"}}).find(".txt cannot be imported"), std::string::npos);
  call("world.save", {{"id", "cell"}, {"file", "cell.wld"}});
  EXPECT_EQ(refusal({{"file", "cell.wld"}}),
            "world \"cell\": \"cell.wld\" is the file of this world. Give the file of an element.");
}

}  // namespace
}  // namespace robomosp::ioci
