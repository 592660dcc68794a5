// SPDX-License-Identifier: Apache-2.0
// What a program's check by a run finds, where it says it is, and that it changes nothing.
#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>

#include "support/program.h"

namespace robomosp {
namespace {

namespace fs = std::filesystem;

class ProgramCheck : public test::CommandTest {
 protected:
  void SetUp() override {
    CommandTest::SetUp();
    arm_ = call("robot.get", {{"name", std::string("ur5")}});
    cell_ = call("world.create", {{"name", std::string("cell")}});
    call("world.add_robot", {{"id", cell_}, {"robot", arm_}, {"name", std::string("ur5")}});
  }
  /// A program of the world; its first statement stands in line 3.
  Value put(const std::string& body) {
    const Value p =
        call("program.create", {{"name", "job" + std::to_string(++made_)},
                                {"source", "PROGRAM job;\nBEGIN\n" + body + "ENDPROGRAM;\n"}});
    call("world.add_program", {{"id", cell_}, {"program", p}});
    return p;
  }
  static std::string place(double x, double y, double z) {
    return "POSE(POSITION(" + std::to_string(x) + ", " + std::to_string(y) + ", " +
           std::to_string(z) + "), ORIZYX(0.0, 180.0, 0.0))";
  }
  Value check(const Value& program, Map args = {}) {
    args.set("id", program);
    return call("program.check_run", args);
  }
  static const Value& at(const Value& map, const char* key) { return *map.as_map()->find(key); }
  /// Lines at which a fault of a kind stands.
  static std::string lines(const Value& checked, const std::string& kind) {
    std::string out;
    for (const Value& f : *at(checked, "faults").as_list())
      if (*at(f, "kind").as_string() == kind) out += std::to_string(*at(f, "line").as_int()) + " ";
    return out;
  }
  Value arm_, cell_;
  int made_ = 0;
};

TEST_F(ProgramCheck, WhatIsRightHasNoErrors) {
  const Value c = check(put("  MOVE PTP " + place(400, 200, 400) + ";\n  MOVE LIN " +
                            place(400, 200, 300) + " SPEED := 100.0;\n"));
  EXPECT_TRUE(*at(c, "correct").as_bool()) << *at(c, "report").as_string();
  EXPECT_EQ(at(c, "motions").as_list()->size(), 2U);
  const Value& cycle = at(c, "cycle_time");
  EXPECT_TRUE(*at(cycle, "complete").as_bool());
  EXPECT_GT(*at(cycle, "total").as_real(), 1.0);  // 100 mm with 100 mm/s, and the way there
  EXPECT_TRUE(at(c, "not_run").as_list()->empty());
}

TEST_F(ProgramCheck, SeveralFaultsOfARunStandAtTheirLines) {
  const Value c = check(put("  MOVE PTP " + place(400, 200, 400) +
                            ";\n"  // 3
                            "  MOVE PTP " +
                            place(9000, 0, 100) +
                            ";\n"                                                         // 4
                            "  MOVE PTP MAIN_JOINT(0.0, -60.0, 900.0, 0.0, 0.0, 0.0);\n"  // 5
                            "  MOVE PTP " +
                            place(400, 250, 400) +
                            ";\n"  // 6
                            "  IF 1 > 2 THEN\n    MOVE PTP " +
                            place(300, 250, 400) +  // 8
                            ";\n  ENDIF;\n"));
  EXPECT_FALSE(*at(c, "correct").as_bool());
  EXPECT_EQ(lines(c, "reach"), "4 ");
  EXPECT_EQ(lines(c, "joint_limit"), "5 ");
  // It goes on behind them: line 6 was run, line 8 not.
  bool ran_6 = false;
  for (const Value& m : *at(c, "motions").as_list()) ran_6 |= *at(m, "line").as_int() == 6;
  EXPECT_TRUE(ran_6);
  ASSERT_EQ(at(c, "not_run").as_list()->size(), 1U);
  EXPECT_EQ(*at(at(c, "not_run").as_list()->front(), "from").as_int(), 8);
}

TEST_F(ProgramCheck, ContactsAreFoundOnTheWay) {
  const Value wall =
      call("solid.create",
           {{"name", std::string("wall")},
            {"root", Map{{"kind", std::string("box")}, {"x", 0.05}, {"y", 0.6}, {"z", 1.0}}}});
  call("world.add_object", {{"id", cell_}, {"what", wall}, {"position", List{0.45, 0.0, 0.3}}});
  const Value p =
      put("  MOVE PTP " + place(400, 400, 400) + ";\n  MOVE PTP " + place(550, -300, 400) + ";\n");
  const Value c = check(p);
  EXPECT_FALSE(lines(c, "contact").empty()) << *at(c, "report").as_string();
  const Value without = check(p, {{"contacts", false}});
  EXPECT_TRUE(lines(without, "contact").empty());
  // What was not looked at is said.
  EXPECT_FALSE(at(without, "not_checked").as_list()->empty());
}

TEST_F(ProgramCheck, NothingIsChangedByIt) {
  const Value p =
      put("  MOVE PTP " + place(400, 200, 400) + ";\n  MOVE PTP " + place(9000, 0, 100) + ";\n");
  const auto before = app().document.now();
  (void)check(p);
  EXPECT_EQ(app().document.now(), before);
}

TEST_F(ProgramCheck, ListsAreBoundedAndSayWhatTheyLack) {
  std::string body;
  for (int i = 0; i < 30; ++i) body += "  MOVE PTP " + place(9000 + i, 0, 100) + ";\n";
  const Value c = check(put(body), {{"most", std::int64_t{10}}});
  EXPECT_EQ(at(c, "faults").as_list()->size(), 10U);
  EXPECT_EQ(*at(c, "errors").as_int(), 30);
  EXPECT_EQ(*at(at(c, "left_out"), "faults").as_int(), 20);
}

TEST_F(ProgramCheck, APostIsRefusedWithErrorsAndWritesNothing) {
  const fs::path folder = fs::temp_directory_path() / "robomosp-check-post";
  fs::remove_all(folder);
  fs::create_directories(folder);
  const Value p = put("  MOVE PTP " + place(9000, 0, 100) + ";\n");
  const Error e = fails("program.post", {{"id", p},
                                         {"target", std::string("krl")},
                                         {"folder", folder.string()},
                                         {"run_check", true}});
  EXPECT_NE(e.sentence().find("3"), std::string::npos) << e.sentence();
  EXPECT_TRUE(fs::is_empty(folder));
  fs::remove_all(folder);
}

TEST_F(ProgramCheck, TwoTargetsSideBySide) {
  const fs::path page = fs::temp_directory_path() / "robomosp-side-by-side.html";
  const Value p = put("  MOVE PTP " + place(400, 200, 400) + ";\n  WAIT 0.5 SEC;\n  MOVE LIN " +
                      place(400, 200, 300) + " SPEED := 100.0;\n");
  const Value c =
      call("program.compare_targets", {{"id", p},
                                       {"targets", List{std::string("krl"), std::string("rapid")}},
                                       {"robot", arm_},
                                       {"file", page.string()}});
  EXPECT_EQ(*at(c, "compared").as_int(), 2) << *at(c, "text").as_string();
  EXPECT_LT(*at(c, "most_distance").as_real(), 1e-5);
  EXPECT_LT(*at(c, "most_angle").as_real(), 1e-4);
  std::ifstream in(page);
  const std::string html(std::istreambuf_iterator<char>(in), {});
  EXPECT_NE(html.find("WAIT SEC"), std::string::npos);
  EXPECT_NE(html.find("WaitTime"), std::string::npos);
  fs::remove(page);
  const Error e = fails("program.compare_targets",
                        {{"id", p}, {"targets", List{std::string("krl"), std::string("krlx")}}});
  EXPECT_NE(e.sentence().find("krlx"), std::string::npos) << e.sentence();
}

}  // namespace
}  // namespace robomosp
