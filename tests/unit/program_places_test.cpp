// SPDX-License-Identifier: Apache-2.0
// Programs as members of worlds: names, copies, files, other worlds, removal and undo.
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

#include "support/program_run.h"

namespace robomosp {
namespace {

namespace fs = std::filesystem;

class ProgramPlaces : public test::ProgramRun {
 protected:
  void SetUp() override {
    ProgramRun::SetUp();
    folder_ = fs::temp_directory_path() / "robomosp_program_places";
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    call("world.add_signal", {{"id", cell_}, {"name", std::string("lamp")}});
    shines_ =
        put("shines", "light := TRUE;\nWAIT 0.1 SEC;\n", "SIGNAL\n  OUTPUT BOOL: light AT 1;\n");
    call("program.bind", {{"id", shines_},
                          {"kind", std::string("signal")},
                          {"name", std::string("light")},
                          {"to", std::string("lamp")}});
  }
  void TearDown() override { fs::remove_all(folder_); }
  /// "name:program:robot:bindings" of each program of a world.
  std::string programs(const Value& world) {
    std::string out;
    const Value all = call("world.programs", {{"id", world}});
    for (const Value& p : *all.as_list()) {
      const Map& m = *p.as_map();
      out += (out.empty() ? "" : " ") + *m.find("name")->as_string() + ":" +
             *m.find("program")->as_string() + ":" + *m.find("robot")->as_string() + ":" +
             m.find("bindings")->text();
    }
    return out;
  }
  fs::path folder_;
  Value shines_;
};

TEST_F(ProgramPlaces, AWorldThatIsSavedTakesItsProgramsAndBindingsAlong) {
  const fs::path file = folder_ / "cell.wld";
  call("world.save", {{"id", cell_}, {"file", file.string()}});
  app().document.clear();
  const Value loaded = call("world.load", {{"file", file.string()}});
  EXPECT_EQ(programs(loaded), "shines:shines::1");
  cell_ = loaded;
  EXPECT_EQ(column(run(), "signal.lamp").back(), 1);
}

TEST_F(ProgramPlaces, BindingsOfNumbersAndOfTheProgramsOwnRobotAreSavedAndReadAgain) {
  const auto bind = [&](const char* kind, const char* name, const char* to) {
    Map args{{"id", shines_}, {"kind", std::string(kind)}, {"to", std::string(to)}};
    if (*name) args.set("name", std::string(name));
    if (std::string(kind) == "joint") args.set("joint", std::string("1"));
    call("program.bind", args);
  };
  bind("robot", "", "ur5");
  bind("robot", "2", "ur5");
  bind("joint", "1", "ur5");
  bind("grip", "2", "");
  bind("robot", "light", "ur5");  // beside the signal of that name
  const fs::path file = folder_ / "cell.wld";
  call("world.save", {{"id", cell_}, {"file", file.string()}});
  const Value before = call("program.bindings", {{"id", shines_}});
  ASSERT_EQ(before.as_list()->size(), 6U);
  app().document.clear();
  const Value loaded = call("world.load", {{"file", file.string()}});
  const Value after = call("program.bindings", {{"id", std::string("shines")}});
  ASSERT_EQ(after.as_list()->size(), before.as_list()->size());
  for (std::size_t i = 0; i < before.as_list()->size(); ++i)
    for (const char* field : {"kind", "name", "to", "joint"})
      EXPECT_EQ(*(*after.as_list())[i].as_map()->find(field)->as_string(),
                *(*before.as_list())[i].as_map()->find(field)->as_string())
          << i << " " << field;
  EXPECT_EQ(programs(loaded), "shines:shines::6");
}

TEST_F(ProgramPlaces, APackedWorldHasThem) {
  const Value packed = call("world.pack", {{"id", cell_}});
  app().document.clear();
  const Value made = call("world.unpack", *packed.as_map());
  EXPECT_EQ(programs(made), "shines:shines::1");
}

TEST_F(ProgramPlaces, ACopyOfAProgramStandsNowhereAndACopyOfAWorldHasItsPrograms) {
  const Value copy = call("program.duplicate", {{"id", shines_}, {"name", std::string("other")}});
  EXPECT_EQ(call("program.bindings", {{"id", copy}}).as_list()->size(), 0U);
  EXPECT_EQ(programs(cell_), "shines:shines::1");
  const Value second = call("world.duplicate", {{"id", cell_}, {"name", std::string("second")}});
  EXPECT_EQ(programs(second), "shines:shines::1");
  // Now which world is meant has to be said.
  const std::string unclear =
      fails("program.bind",
            {{"id", shines_}, {"kind", std::string("free")}, {"name", std::string("light")}})
          .sentence();
  EXPECT_NE(unclear.find("\"shines\" in world \"second\""), std::string::npos) << unclear;
  call("program.bind", {{"id", shines_},
                        {"world", second},
                        {"kind", std::string("free")},
                        {"name", std::string("light")}});
  const Value both = call("program.bindings", {{"id", shines_}});
  ASSERT_EQ(both.as_list()->size(), 2U);
  EXPECT_EQ(*call("program.bindings", {{"id", shines_}, {"world", second}})
                 .as_list()
                 ->front()
                 .as_map()
                 ->find("kind")
                 ->as_string(),
            "free");
}

TEST_F(ProgramPlaces, WhatAWorldRunsIsNotRemovedAndAWorldIs) {
  const std::string kept = fails("program.remove", {{"id", shines_}}).sentence();
  EXPECT_NE(kept.find("\"cell"), std::string::npos) << kept;
  call("world.remove", {{"id", cell_}});
  call("program.remove", {{"id", shines_}});
}

TEST_F(ProgramPlaces, NamesAreThoseOfMembers) {
  const std::string taken =
      fails("world.add_program",
            {{"id", cell_}, {"program", shines_}, {"name", std::string("ur5")}})
          .sentence();
  EXPECT_NE(taken.find("ur5"), std::string::npos) << taken;
  EXPECT_EQ(*call("world.add_program", {{"id", cell_}, {"program", shines_}}).as_string(),
            "shines_2");
  EXPECT_EQ(programs(cell_), "shines:shines::1 shines_2:shines::0");
  // By its record it is no longer clear which.
  const std::string twice =
      fails("world.run_task", {{"id", cell_}, {"program", shines_}}).sentence();
  EXPECT_NE(twice.find("more than once"), std::string::npos) << twice;
  const std::string again =
      fails("world.run_task",
            {{"id", cell_}, {"program", List{std::string("shines"), std::string("shines")}}})
          .sentence();
  EXPECT_NE(again.find("given twice"), std::string::npos) << again;
  const std::string unknown =
      fails("world.remove_program", {{"id", cell_}, {"name", std::string("shine")}}).sentence();
  EXPECT_NE(unknown.find("shines"), std::string::npos) << unknown;
  call("world.remove_member", {{"id", cell_}, {"member", std::string("shines_2")}});
  EXPECT_EQ(programs(cell_), "shines:shines::1");
  call("document.undo");
  EXPECT_EQ(programs(cell_), "shines:shines::1 shines_2:shines::0");
  call("document.undo");
  call("document.undo");
  EXPECT_EQ(programs(cell_), "shines:shines::0");
}

TEST_F(ProgramPlaces, ARobotThatTheWorldHasNotIsNoRobotOfAProgram) {
  const std::string none =
      fails("world.add_program",
            {{"id", cell_}, {"program", shines_}, {"robot", std::string("ur6")}})
          .sentence();
  EXPECT_NE(none.find("ur5"), std::string::npos) << none;
}

TEST_F(ProgramPlaces, BindingsFollowMembersThatGetOtherNamesInAnotherWorld) {
  call("program.bind",
       {{"id", shines_}, {"kind", std::string("robot")}, {"to", std::string("ur5")}});
  const fs::path file = folder_ / "cell.wld";
  call("world.save", {{"id", cell_}, {"file", file.string()}});
  const Value hall = world_with({"ur5"});
  call("world.load_element",
       {{"id", hall}, {"file", file.string()}, {"position", List{2.0, 0.0, 0.0}}});
  EXPECT_EQ(programs(hall), "shines:shines::2");
  std::string robot;
  const Value all = call("program.bindings", {{"id", shines_}, {"world", hall}});
  for (const Value& b : *all.as_list())
    if (*b.as_map()->find("kind")->as_string() == "robot")
      robot = *b.as_map()->find("to")->as_string();
  EXPECT_EQ(robot, "ur5_2");
}

TEST_F(ProgramPlaces, BindingsFollowObjectsWithTheirPointsAndLeaveJointsAndLinksAlone) {
  call("solid.create",
       {{"name", std::string("cup")},
        {"root", Map{{"kind", std::string("box")}, {"x", 0.1}, {"y", 0.1}, {"z", 0.1}}}});
  const Value hall = world_with({"ur5"});
  for (const Value& world : {cell_, hall})
    call("world.add_object",
         {{"id", world}, {"what", std::string("cup")}, {"name", std::string("elbow")}});
  const auto bind = [&](Map args) {
    args.set("id", shines_);
    call("program.bind", args);
  };
  bind({{"kind", std::string("robot")},
        {"to", std::string("ur5")},
        {"tool", std::string("elbow.rim")}});
  bind({{"kind", std::string("robot")},
        {"name", std::string("2")},
        {"to", std::string("ur5")},
        {"tool", std::string("wrist_1")},
        {"frame", std::string("elbow")}});
  bind({{"kind", std::string("joint")},
        {"name", std::string("1")},
        {"to", std::string("ur5")},
        {"joint", std::string("elbow")}});
  bind({{"kind", std::string("grip")},
        {"name", std::string("2")},
        {"to", std::string("elbow")},
        {"robot", std::string("ur5")}});
  const fs::path file = folder_ / "cell.wld";
  call("world.save", {{"id", cell_}, {"file", file.string()}});
  call("world.load_element", {{"id", hall}, {"file", file.string()}});
  const Value all = call("program.bindings", {{"id", shines_}, {"world", hall}});
  const auto at = [&](std::size_t i, const char* field) {
    return *(*all.as_list())[i].as_map()->find(field)->as_string();
  };
  ASSERT_EQ(all.as_list()->size(), 5U);  // the first is of the signal
  EXPECT_EQ(at(1, "to") + " " + at(1, "tool"), "ur5_2 elbow_2.rim");
  EXPECT_EQ(at(2, "tool") + " " + at(2, "frame"), "wrist_1 elbow_2");
  EXPECT_EQ(at(3, "to") + " " + at(3, "joint"), "ur5_2 elbow");
  EXPECT_EQ(at(4, "to") + " " + at(4, "robot"), "elbow_2 ur5_2");
}

TEST_F(ProgramPlaces, AFileOfAProgramIsAnElement) {
  const fs::path file = folder_ / "shines.prg";
  call("program.save", {{"id", shines_}, {"file", file.string()}});
  const Value hall = world_with({"ur5"});
  const Value made = call("world.load_element", {{"id", hall},
                                                 {"file", file.string()},
                                                 {"name", std::string("beacon")},
                                                 {"robot", std::string("ur5")}});
  EXPECT_EQ(*made.as_list()->front().as_string(), "beacon");
  EXPECT_EQ(programs(hall), "beacon:shines:ur5:0");
}

TEST_F(ProgramPlaces, AFileOfAWorldThatNamesAnotherKindIsRefused) {
  const fs::path file = folder_ / "cell.wld";
  call("world.save", {{"id", cell_}, {"file", file.string()}});
  std::stringstream text;
  text << std::ifstream(file).rdbuf();
  std::string damaged = text.str();
  const std::string reference = "program \"shines.prg\"";
  const auto at = damaged.find(reference);
  ASSERT_NE(at, std::string::npos) << damaged;
  call("task.create", {{"name", std::string("stands")}});
  call("task.save", {{"id", std::string("stands")}, {"file", (folder_ / "stands.tsk").string()}});
  damaged.replace(at, reference.size(), "program \"stands.tsk\"");
  std::ofstream(file) << damaged;
  app().document.clear();
  const std::string refused = fails("world.load", {{"file", file.string()}}).sentence();
  EXPECT_NE(refused.find("stands.tsk"), std::string::npos) << refused;
}

}  // namespace
}  // namespace robomosp
