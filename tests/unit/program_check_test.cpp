// SPDX-License-Identifier: Apache-2.0
// What a program's check by a run finds, where it says it is, and that it changes nothing.
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <numbers>
#include <random>
#include <string>

#include <gtest/gtest.h>

#include "program_check/shown_run.h"
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
  std::size_t count_of(const Value& c, const char* kind) {
    std::size_t n = 0;
    for (const Value& d : *at(c, "differences").as_list()) n += *at(d, "kind").as_string() == kind;
    return n;
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
  /// The fault of a kind, the only one; nil = there is none, or more.
  static Value only(const Value& checked, const std::string& kind) {
    Value out;
    std::size_t count = 0;
    for (const Value& f : *at(checked, "faults").as_list())
      if (*at(f, "kind").as_string() == kind) out = f, ++count;
    EXPECT_EQ(count, 1U) << kind << "\n" << report(checked);
    return count == 1 ? out : Value();
  }
  static void expect_none(const Value& checked, const std::string& kind) {
    EXPECT_EQ(lines(checked, kind), "") << report(checked);
  }
  static std::string report(const Value& checked) { return *at(checked, "report").as_string(); }
  /// What a fault compares; nan = it is none.
  static double number(const Value& fault, const char* key) {
    const Map* m = fault.as_map();
    const Value* v = m ? m->find(key) : nullptr;
    return v && v->is_number() ? v->number() : std::numeric_limits<double>::quiet_NaN();
  }
  static bool says(const Value& checked, const std::string& words) {
    for (const Value& n : *at(checked, "not_checked").as_list())
      if (n.as_string()->find(words) != std::string::npos) return true;
    return false;
  }
  /// A cell of its own for an arm; program() then puts programs into it.
  void use(const Value& arm, const std::string& name) {
    cell_ = call("world.create", {{"name", name}});
    call("world.add_robot", {{"id", cell_}, {"robot", arm}, {"name", std::string("ur5")}});
  }
  Value copy(const std::string& name, const std::string& of = "ur5") {
    return call("robot.duplicate", {{"id", call("robot.get", {{"name", of}})}, {"name", name}});
  }
  Value put_with(const std::string& declarations, const std::string& body) {
    const Value p =
        call("program.create",
             {{"name", "job" + std::to_string(++made_)},
              {"source", "PROGRAM job;\n" + declarations + "BEGIN\n" + body + "ENDPROGRAM;\n"}});
    call("world.add_program", {{"id", cell_}, {"program", p}});
    return p;
  }
  /// An arc of 120 degrees about the robot's first axis, 500 mm away, the tool turning with it:
  /// joint 1 alone moves. In line 4.
  static std::string arc(double speed) {
    const auto at = [](double degrees) {
      const double a = degrees * std::numbers::pi / 180;
      return "POSE(POSITION(" + std::to_string(500 * std::cos(a)) + ", " +
             std::to_string(500 * std::sin(a)) + ", 300.0), ORIZYX(" + std::to_string(degrees) +
             ", 180.0, 0.0))";
    };
    return "  MOVE PTP " + at(-60) + ";\n  MOVE CIRCLE " + at(0) + ", " + at(60) +
           " SPEED := " + std::to_string(speed) + ", SPEED_ORI := 400.0;\n";
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

// Each kind of fault where it is the truth by a number of another source, and where it must not be.

TEST_F(ProgramCheck, SpeedIsThatOfTheToolOverItsRadius) {
  // 1.047 m of arc under 2.5 m/s^2: no more than sqrt(2.5 * 1.047) m/s is come to, at 0.5 m.
  const double arc_length = 0.5 * 120 * std::numbers::pi / 180;
  const double rate = std::sqrt(2.5 * arc_length) / 0.5;
  const Value f = only(check(put(arc(1800)), {{"sample_time", 0.002}}), "speed");
  EXPECT_EQ(number(f, "line"), 4);
  EXPECT_EQ(number(f, "joint"), 1);
  EXPECT_NEAR(number(f, "value"), rate, 0.006);
  EXPECT_NEAR(number(f, "limit"), std::numbers::pi, 1e-9);
  EXPECT_NEAR(number(f, "excess"), number(f, "value") - std::numbers::pi, 1e-9);
  // 1 m/s at 0.5 m is 2 rad/s.
  use(arm_, "slower");
  const Value slow = check(put(arc(1000)), {{"sample_time", 0.002}});
  expect_none(slow, "speed");
  const Value& share = at(at(slow, "motions").as_list()->back(), "speed_share");
  EXPECT_NEAR(*share.as_real(), 2 / std::numbers::pi, 1e-3);
}

TEST_F(ProgramCheck, AccelerationIsThatOfTheToolOverItsRadius) {
  const Value arm = copy("quick");
  call("robot.set_link", {{"id", arm}, {"link", 1}, {"max_acceleration", 4.0}});
  use(arm, "acceleration");
  const Value c = check(put(arc(1000)), {{"sample_time", 0.002}});
  const Value f = only(c, "acceleration");
  EXPECT_EQ(number(f, "line"), 4);
  EXPECT_NEAR(number(f, "value"), 2.5 / 0.5, 1e-3);  // of either sign: it brakes as it starts
  EXPECT_EQ(*at(f, "severity").as_string(), "warning");
  // The other joints have none, which is said.
  EXPECT_TRUE(says(c, "acceleration")) << report(c);
  call("robot.set_link", {{"id", arm}, {"link", 1}, {"max_acceleration", 6.0}});
  use(arm, "acceleration_within");
  expect_none(check(put(arc(1000)), {{"sample_time", 0.002}}), "acceleration");
}

TEST_F(ProgramCheck, TorqueIsWeightTimesLever) {
  const Value arm = copy("strong");
  for (int link = 1; link <= 6; ++link)
    call("robot.set_link", {{"id", arm},
                            {"link", link},
                            {"mass", link == 6 ? 5.0 : 0.0},
                            {"com", List{0.0, 0.0, 0.0}},
                            {"inertia", List{0.0, 0.0, 0.0, 0.0, 0.0, 0.0}}});
  call("robot.set_link", {{"id", arm}, {"link", 2}, {"max_force", 30.0}});
  use(arm, "torque");
  // So slow that nothing but the weight counts: 5 kg as far from the shoulder as the tool is, which
  // is where the last link has its origin.
  const Value p =
      put("  MOVE PTP MAIN_JOINT(0.0, -0.5, 0.0, 0.0, 0.0, 0.0) SPEED_PTP := 1.0, "
          "ACC_PTP := 1.0;\n");
  const Value c = check(p, {{"contacts", false}});
  const Value f = only(c, "torque");
  const NumericArray& end = *at(at(c, "motions").as_list()->back(), "end").as_array();
  EXPECT_NEAR(std::fabs(number(f, "value")), 5 * 9.81 * std::fabs(end[0]), 0.6);
  EXPECT_GT(std::fabs(end[0]), 0.8);
  EXPECT_EQ(std::fabs(number(f, "limit")), 30);
  call("robot.set_link", {{"id", arm}, {"link", 2}, {"max_force", 45.0}});
  expect_none(check(p, {{"contacts", false}}), "torque");
  // Not asked for is said.
  EXPECT_TRUE(says(check(p, {{"torques", false}}), "Torques"));
}

TEST_F(ProgramCheck, ClearanceAndDepthAreTheDistanceOfTheWalls) {
  const Value arm = copy("probe");
  call("robot.add_tool", {{"id", arm},
                          {"name", std::string("rod_tip")},
                          {"link", 6},
                          {"position", List{0.0, 0.0, 0.12}}});
  const Value rod =
      call("solid.create",
           {{"name", std::string("rod")},
            {"root", Map{{"kind", std::string("cylinder")}, {"radius", 0.012}, {"height", 0.12}}}});
  const Value wall =
      call("solid.create",
           {{"name", std::string("wall")},
            {"root", Map{{"kind", std::string("box")}, {"x", 0.1}, {"y", 0.02}, {"z", 0.3}}}});
  const auto beside = [&](double gap) {
    use(arm, "gap" + std::to_string(++made_));
    call("world.add_object", {{"id", cell_}, {"what", rod}, {"name", std::string("rod")}});
    call("world.attach", {{"id", cell_},
                          {"object", std::string("rod")},
                          {"robot", std::string("ur5")},
                          {"link", std::string("rod_tip")},
                          {"rpy", List{std::numbers::pi, 0.0, 0.0}}});
    call("world.add_object", {{"id", cell_},
                              {"what", wall},
                              {"name", std::string("wall")},
                              {"position", List{0.4, 0.2 + 0.012 + gap + 0.01, 0.0}}});
    const Value p = put("  MOVE PTP " + place(400, 200, 400) + ";\n  MOVE LIN " +
                        place(400, 200, 250) + " SPEED := 200.0;\n");
    call("program.bind",
         {{"id", p}, {"kind", std::string("robot")}, {"tool", std::string("rod_tip")}});
    return check(p);
  };
  const Value near = beside(0.003);
  expect_none(near, "contact");
  const Value f = only(near, "clearance");
  EXPECT_EQ(number(f, "line"), 4);
  EXPECT_NEAR(number(f, "value"), 0.003, 2e-4);
  EXPECT_EQ(*at(f, "severity").as_string(), "warning");
  const Value into = beside(-0.002);
  expect_none(into, "clearance");
  EXPECT_NEAR(number(only(into, "contact"), "value"), -0.002, 2e-4);
  EXPECT_FALSE(*at(into, "correct").as_bool());
  const Value away = beside(0.02);
  expect_none(away, "contact");
  expect_none(away, "clearance");
}

// At joints 2 and 3 of 170 and -100 degrees the elbow of kr5 is within its waist. The first motion
// leaves from there; or it cannot be carried out, and the robot is put to the end of the second.
TEST_F(ProgramCheck, ARunThatStartsInContactIsAFaultWhateverItsFirstMotionDoes) {
  const Value arm = call("robot.get", {{"name", std::string("kr5")}});
  const double degree = std::numbers::pi / 180;
  const std::string away = "  MOVE PTP MAIN_JOINT(0.0, 60.0, 30.0, 0.0, 30.0, 0.0);\n";
  for (const std::string& body : {away, "  MOVE LIN " + place(5000, 0, 100) + ";\n" + away}) {
    cell_ = call("world.create", {{"name", "start" + std::to_string(++made_)}});
    call("world.add_robot", {{"id", cell_},
                             {"robot", arm},
                             {"name", std::string("arm")},
                             {"q", List{0.0, 170 * degree, -100 * degree, 0.0, 0.0, 0.0}}});
    const Value c = check(put(body));
    // It is told at the first motion that has a way.
    EXPECT_EQ(lines(c, "contact"), body == away ? "3 " : "4 ") << report(c);
    const Value f = only(c, "contact");
    EXPECT_EQ(number(f, "from"), 0);
    EXPECT_NE(
        at(f, "message").as_string()->find("the run starts in contact: arm.elbow and arm.waist"),
        std::string::npos)
        << report(c);
  }
}

TEST_F(ProgramCheck, AThinWallBetweenTwoRowsIsNotPassed) {
  // At 1 m/s rows half a second apart are 0.5 m from each other, and so from the wall between.
  const Value wall =
      call("solid.create",
           {{"name", std::string("sheet")},
            {"root", Map{{"kind", std::string("box")}, {"x", 0.4}, {"y", 0.002}, {"z", 0.6}}}});
  call("world.add_object", {{"id", cell_}, {"what", wall}, {"position", List{0.55, 0.0, 0.0}}});
  const Value p = put("  MOVE PTP " + place(500, -350, 300) + ";\n  MOVE LIN " +
                      place(500, 350, 300) + " SPEED := 1000.0;\n");
  for (const double step : {0.02, 0.3}) {
    const Value c = check(p, {{"sample_time", step}});
    EXPECT_NE(lines(c, "contact").find('4'), std::string::npos) << step << "\n" << report(c);
  }
}

TEST_F(ProgramCheck, SingularitiesAndChangesOfTheWristAreWhereJointFiveIsZero) {
  const Value arm = call("robot.get", {{"name", std::string("kr5")}});
  const auto down = [&](const std::string& cell) {
    use(arm, "wrist" + std::to_string(++made_));
    return check(put_with(
        "VAR\n"
        "  POSE: tray := POSE(POSITION(700.0, -200.0, 20.0), ORIZYX(30.0, 0.0, 0.0));\n"
        "  POSE: grasp := POSE(POSITION(0.0, 0.0, 0.0), ORIZYX(0.0, 180.0, 0.0));\n"
        "  POSE: higher := POSE(POSITION(0.0, 0.0, 120.0), ORIZYX(0.0, 0.0, 0.0));\n"
        "  POSE: place;\n",
        "  place := tray @ POSE(POSITION(" + cell +
            "), ORIZYX(0.0, 0.0, 0.0));\n  MOVE PTP place @ higher @ grasp;\n  MOVE LIN place @ "
            "grasp SPEED := 150.0;\n"));
  };
  const auto fifth = [&](const Value& c, std::size_t motion) {
    const Value& row = (*at(c, "targets").as_list())[motion];
    return (*at(row, "q").as_array())[4];
  };
  const Value through = down("0.0, 85.0, 0.0");
  ASSERT_EQ(at(through, "targets").as_list()->size(), 2U);
  // The wrist is stretched where the fifth angle changes its sign: it does on the way.
  EXPECT_LT(fifth(through, 0) * fifth(through, 1), 0);
  EXPECT_EQ(number(only(through, "configuration"), "line"), 10);
  EXPECT_GT(number(only(through, "singularity"), "value"), 100);
  const Value beside = down("330.0, 170.0, 0.0");
  EXPECT_GT(fifth(beside, 0) * fifth(beside, 1), 0);
  expect_none(beside, "configuration");
  expect_none(beside, "singularity");
}

TEST_F(ProgramCheck, AxesOfTheControllerCount) {
  const auto profile = [&](const char* name, double lower, std::int64_t joint) {
    return call("record.create", {{"kind", std::string("controller")},
                                  {"name", std::string(name)},
                                  {"fields", Map{{"target", std::string("krl")},
                                                 {"axes", List{Map{{"name", std::string("A1")},
                                                                   {"joint", joint},
                                                                   {"sign", -1},
                                                                   {"offset", 10.0},
                                                                   {"lower", lower},
                                                                   {"upper", 170.0}}}}}}});
  };
  call(
      "world.set_robot_q",
      {{"id", cell_}, {"robot", std::string("ur5")}, {"q", List{0.0, -1.0, 1.0, -1.5, -1.5, 0.0}}});
  call("robot.set_axes",
       {{"id", call("robot.get", {{"name", std::string("ur5")}})}, {"axes", List{}}});
  const Value p = put("  MOVE PTP MAIN_JOINT(30.0, -60.0, 60.0, -90.0, -90.0, 0.0);\n");
  // -1 * 30 + 10 is -20 degrees.
  const Value f = only(check(p, {{"profile", profile("narrow", -12, 1)}}), "controller");
  EXPECT_NEAR(number(f, "value"), -20, 1e-6);
  EXPECT_NEAR(number(f, "excess"), 8, 1e-6);
  expect_none(check(p, {{"profile", profile("wide", -30, 1)}}), "controller");
  // An axis that is of no joint is said.
  EXPECT_TRUE(says(check(p, {{"profile", profile("seventh", -30, 7)}}), "joint 7"));
}

TEST_F(ProgramCheck, WaitsWithoutAnEndAndThoseThatRunOut) {
  call("world.add_signal", {{"id", cell_}, {"name", std::string("go")}});
  const std::string head = "SIGNAL\n  INPUT BOOL: go AT 1;\n";
  const Value p = put_with(head, "  WAIT FOR go;\n  WAIT FOR go TIMEOUT 0.5;\n  WAIT 0.1 SEC;\n");
  const Value alone = check(p);
  EXPECT_EQ(number(only(alone, "signal"), "line"), 5);
  const Value late = only(alone, "timeout");
  EXPECT_EQ(number(late, "line"), 6);
  EXPECT_NEAR(number(late, "time"), 0.5, 0.021);
  // The wait itself costs nothing, the other two 0.5 and 0.1 s.
  EXPECT_NEAR(*at(at(alone, "cycle_time"), "total").as_real(), 0.6, 0.03);
  // With one that gives it neither is a fault.
  put_with("SIGNAL\n  OUTPUT BOOL: go AT 1;\n", "  WAIT 0.25 SEC;\n  go := TRUE;\n");
  const Value both = check(p);
  expect_none(both, "signal");
  expect_none(both, "timeout");
  EXPECT_TRUE(*at(both, "correct").as_bool()) << report(both);
  // Beside nobody it stands again.
  EXPECT_FALSE(lines(check(p, {{"alone", true}}), "signal").empty());
}

TEST_F(ProgramCheck, ASemaphoreThatNobodyReleases) {
  const Value stuck = check(put_with("VAR\n  SEMAPHORE: s := 0;\n", "  ACQUIRE(s);\n"));
  EXPECT_EQ(number(only(stuck, "signal"), "line"), 5);
  const Value free = check(put_with("VAR\n  SEMAPHORE: s := 1;\n", "  ACQUIRE(s);\n"));
  expect_none(free, "signal");
}

TEST_F(ProgramCheck, GripsThatFindNothing) {
  const std::string head = "SIGNAL\n  OUTPUT BOOL: gripper AT 3;\n";
  const std::string body = "  MOVE PTP " + place(400, 200, 450) + ";\n  MOVE LIN " +
                           place(400, 200, 300) + ";\n  gripper := TRUE;\n";
  call("world.set_robot_q", {{"id", cell_},
                             {"robot", std::string("ur5")},
                             {"q", List{0.0, -1.57, -1.57, -1.57, 1.57, 0.0}}});
  EXPECT_EQ(number(only(check(put_with(head, body)), "grip"), "line"), 7);
  const Value part = call("solid.create", {{"name", std::string("part")},
                                           {"root", Map{{"kind", std::string("box")},
                                                        {"x", 0.04},
                                                        {"y", 0.04},
                                                        {"z", 0.04},
                                                        {"position", List{0.0, 0.0, -0.04}}}}});
  call("world.add_object", {{"id", cell_},
                            {"what", part},
                            {"name", std::string("part")},
                            {"position", List{0.4, 0.2, 0.3}}});
  const Value c = check(put_with(head, body), {{"alone", true}});
  expect_none(c, "grip");
  // What is taken touches what takes it, which is meant.
  expect_none(c, "contact");
}

TEST_F(ProgramCheck, UntilThatNeverComesTrue) {
  call("world.add_signal", {{"id", cell_}, {"name", std::string("arrived")}});
  const Value p = put_with("SIGNAL\n  INPUT BOOL: arrived AT 1;\n",
                           "  MOVE PTP " + place(400, 200, 400) + ";\n  MOVE LIN " +
                               place(400, 200, 300) + " SPEED := 50.0 UNTIL arrived;\n");
  const Value f = only(check(p), "until");
  EXPECT_EQ(number(f, "line"), 6);
  EXPECT_EQ(*at(f, "severity").as_string(), "note");
  put_with("SIGNAL\n  OUTPUT BOOL: arrived AT 1;\n", "  WAIT 2.0 SEC;\n  arrived := TRUE;\n");
  expect_none(check(p), "until");
}

TEST_F(ProgramCheck, MotionsThatAreNotPossibleAndProgramsThatEnd) {
  const Value line = check(put("  MOVE PTP " + place(400, 200, 400) + ";\n  MOVE CIRCLE " +
                               place(400, 200, 350) + ", " + place(400, 200, 300) + ";\n"));
  EXPECT_EQ(number(only(line, "motion"), "line"), 4);
  expect_none(line, "program");
  EXPECT_TRUE(says(line, "cycle time lacks 1"));
  use(arm_, "ends");
  const Value ends =
      check(put_with("VAR\n  INT: a := 1, b := 0;\n", "  WAIT 0.1 SEC;\n  a := a DIV b;\n"));
  const Value f = only(ends, "program");
  EXPECT_EQ(number(f, "line"), 6);
  EXPECT_NEAR(number(f, "time"), 0.1, 1e-9);
  expect_none(ends, "motion");
  use(arm_, "circle");
  const Value circle = check(put("  MOVE PTP " + place(400, 200, 400) + ";\n  MOVE CIRCLE " +
                                 place(430, 200, 350) + ", " + place(400, 200, 300) + ";\n"));
  expect_none(circle, "motion");
}

TEST_F(ProgramCheck, WhatIsNotCarriedOutIsANote) {
  const std::string to = "  MOVE PTP " + place(400, 200, 400);
  const Value f = only(check(put(to + " C_PASS := TRUE;\n")), "ignored");
  EXPECT_EQ(number(f, "line"), 3);
  EXPECT_EQ(*at(f, "severity").as_string(), "note");
  expect_none(check(put(to + ";\n")), "ignored");
}

TEST_F(ProgramCheck, WhatIsNotLookedAtIsSaid) {
  const Value c = check(put("  MOVE PTP " + place(400, 200, 400) + ";\n"));
  EXPECT_TRUE(says(c, "limit of its acceleration and torque"));
  // A program that moves nothing has no contacts of its own, whoever else has some.
  const Value floor =
      call("solid.create",
           {{"name", std::string("floor")},
            {"root", Map{{"kind", std::string("box")}, {"x", 2.0}, {"y", 2.0}, {"z", 0.6}}}});
  call("world.add_object", {{"id", cell_}, {"what", floor}, {"position", List{1.2, 0.0, 0.0}}});
  const Value still = check(put("  WAIT 0.5 SEC;\n"));
  expect_none(still, "contact");
  EXPECT_TRUE(says(still, "moves nothing")) << report(still);
  // Others move the robot: their limits are theirs.
  EXPECT_TRUE(says(still, "Limits of ur5"));
  // A time that is up is said.
  const Value cut = check(put("  WAIT 5.0 SEC;\n"), {{"most_time", 1.0}});
  EXPECT_TRUE(says(cut, "was ended after")) << report(cut);
  EXPECT_FALSE(*at(at(cut, "cycle_time"), "complete").as_bool());
}

TEST_F(ProgramCheck, RulesThatAllowContactsAreSaid) {
  const Value wall =
      call("solid.create",
           {{"name", std::string("wall")},
            {"root", Map{{"kind", std::string("box")}, {"x", 0.05}, {"y", 0.6}, {"z", 1.0}}}});
  call("world.add_object", {{"id", cell_},
                            {"what", wall},
                            {"name", std::string("wall")},
                            {"position", List{0.45, 0.0, 0.3}}});
  const Value p =
      put("  MOVE PTP " + place(400, 400, 400) + ";\n  MOVE PTP " + place(550, -300, 400) + ";\n");
  EXPECT_FALSE(says(check(p), "Allowed to touch"));
  call("world.allow_pair", {{"id", cell_},
                            {"a", std::string("ur5.wrist_3")},
                            {"b", std::string("wall")},
                            {"reason", std::string("soft")}});
  EXPECT_TRUE(says(check(p), "Allowed to touch"));
}

TEST_F(ProgramCheck, PicturesAndPlotsAreOfARunThatWasAskedFor) {
  const Value p = put("  MOVE PTP " + place(400, 200, 400) + ";\n");
  const Error e = fails(
      "program.post", {{"id", p}, {"target", std::string("krl")}, {"plot", std::string("x.svg")}});
  EXPECT_NE(e.sentence().find("run_check"), std::string::npos) << e.sentence();
  const fs::path file = fs::temp_directory_path() / "robomosp-check-plot.svg";
  const Value out = call(
      "program.post",
      {{"id", p}, {"target", std::string("krl")}, {"run_check", true}, {"plot", file.string()}});
  EXPECT_TRUE(*at(out, "correct").as_bool());
  EXPECT_GT(fs::file_size(file), 1000U);
  fs::remove(file);
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

TEST(CheckPicture, LinesOfAPlaceShareOneWordAndCaptionsAreCutBetweenWords) {
  EXPECT_EQ(program_check::lines_text({7}), "line 7");
  EXPECT_EQ(program_check::lines_text({18, 7}), "lines 7 and 18");
  EXPECT_EQ(program_check::lines_text({7, 12, 18}), "lines 7, 12 and 18");
  EXPECT_EQ(program_check::lines_text({1, 2, 3, 4, 5}), "lines 1, 2, 3, 4 and 5");
  EXPECT_EQ(program_check::lines_text({1, 2, 3, 4, 5, 6, 7}), "lines 1, 2, 3, 4 and 3 more");
  EXPECT_EQ(program_check::shortened("post and wrist touch", 20), "post and wrist touch");
  EXPECT_EQ(program_check::shortened("post and wrist touch", 19), "post and wrist ... (1 more word)");
  EXPECT_EQ(program_check::shortened("post and wrist touch", 11), "post and ... (2 more words)");
  EXPECT_EQ(program_check::shortened("a_word_that_is_too_long", 5), "a_word_that_is_too_long");
}

TEST_F(ProgramCheck, EveryPairOfTargetsThatAreReadIsComparedForEveryProgram) {
  const std::vector<std::string> targets{"krl",  "rapid", "urscript", "fanuc_tp", "melfa5",
                                         "val3", "gcode", "as",       "pdl2"};
  // Targets of a motion in each program, counted by hand from its loops.
  const std::map<std::string, std::int64_t> programs{
      {"hanoi", 42}, {"palletising", 96}, {"pick_and_place", 32}, {"arc_weld", 7}};
  const std::set<std::string> refused{"urscript pick_and_place", "fanuc_tp pick_and_place",
                                      "gcode pick_and_place", "gcode palletising"};
  const Value puma = call("robot.get", {{"name", std::string("puma560")}});
  // The programs are beyond Unimation's ranges.
  call("robot.set_axes", {{"id", puma}, {"axes", List{}}});
  std::size_t pairs = 0;
  for (const auto& [name, points] : programs) {
    const Value p =
        call("program.import",
             {{"file", std::string(ROBOMOSP_SOURCE_DIR) + "/scripts/programs/" + name + ".irl"}});
    for (std::size_t i = 0; i < targets.size(); ++i)
      for (std::size_t k = i + 1; k < targets.size(); ++k) {
        const std::string what = name + " " + targets[i] + " " + targets[k];
        const Value c =
            call("program.compare_targets",
                 {{"id", p}, {"targets", List{targets[i], targets[k]}}, {"robot", puma}});
        const std::string said = *at(c, "points").as_string();
        std::size_t whole = 0;
        for (const Value& t : *at(c, "targets").as_list()) {
          const std::string one = *at(t, "target").as_string() + " " + name;
          EXPECT_EQ(*at(t, "correct").as_bool(), !refused.contains(one)) << what;
          EXPECT_EQ(at(t, "reader").as_string()->empty(), refused.contains(one))
              << one << ": " << *at(t, "not_read").as_string();
          if (refused.contains(one)) {
            EXPECT_NE(said.find("Not looked at: " + *at(t, "target").as_string()),
                      std::string::npos)
                << said;
          } else {
            ++whole;
            EXPECT_EQ(*at(t, "compared").as_int(), points) << what;
            EXPECT_LT(*at(t, "most_distance").as_real(), 1e-6) << what;
            EXPECT_LT(*at(t, "most_angle").as_real(), 1e-5) << what;
          }
        }
        if (whole == 2) {
          ++pairs;
          EXPECT_EQ(*at(c, "compared").as_int(), points) << what;
          EXPECT_LT(*at(c, "most_distance").as_real(), 1e-6) << what;
        }
        for (const char* kind : {"point", "motion", "output", "speed"}) {
          EXPECT_EQ(count_of(c, kind), 0U) << what << " " << kind << "\n"
                                           << *at(c, "text").as_string();
        }
      }
  }
  EXPECT_GT(pairs, 80U);
}

TEST_F(ProgramCheck, WhatTargetsSayInOtherUnitsIsNamedAndNotCompared) {
  const Value p =
      put("  MOVE PTP " + place(400, 200, 400) + " SPEED_PTP := 60.0 C_PTP := 20.0;\n  MOVE LIN " +
          place(400, 200, 300) + " SPEED := 100.0;\n");
  const Value c = call(
      "program.compare_targets",
      {{"id", p}, {"targets", List{std::string("krl"), std::string("urscript")}}, {"robot", arm_}});
  EXPECT_EQ(count_of(c, "speed"), 0U) << *at(c, "text").as_string();
  EXPECT_EQ(count_of(c, "blend"), 0U) << *at(c, "text").as_string();
  std::string all;
  for (const Value& each : *at(c, "not_compared").as_list()) all += *each.as_string() + "\n";
  EXPECT_NE(all.find("Speeds of PTP of krl and urscript"), std::string::npos) << all;
  EXPECT_NE(all.find("How far PTP motions blend of krl and urscript"), std::string::npos) << all;
  // In equal units nothing is left out.
  const Value same = call("program.compare_targets",
                          {{"id", p},
                           {"targets", List{std::string("urscript"), std::string("melfa5")}},
                           {"robot", arm_}});
  EXPECT_NE(at(same, "points").as_string()->find("mm (radii)"), std::string::npos);
}

TEST_F(ProgramCheck, PointsThatDifferBetweenTargetsAreFound) {
  const Value rough =
      call("record.create",
           {{"kind", std::string("controller")},
            {"name", std::string("rough")},
            {"fields", Map{{"target", std::string("krl")}, {"length_digits", std::int64_t{0}}}}});
  const Value p = put("  MOVE PTP " + place(400.4, 200, 400) + ";\n");
  const Value c = call(
      "program.compare_targets",
      {{"id", p}, {"targets", List{std::string("krl"), std::string("rough")}}, {"robot", arm_}});
  EXPECT_EQ(*at(c, "compared").as_int(), 1);
  EXPECT_NEAR(*at(c, "most_distance").as_real(), 4e-4, 1e-9) << *at(c, "text").as_string();
  // One with the program, one with the other target.
  EXPECT_EQ(count_of(c, "point"), 2U);
}

TEST_F(ProgramCheck, TargetsGivenTwiceAndInputsThatAreNoneAreRefused) {
  const Value p =
      call("program.import",
           {{"file", std::string(ROBOMOSP_SOURCE_DIR) + "/scripts/programs/pick_and_place.irl"}});
  const auto sentence = [&](const List& targets, const Map& inputs) {
    return fails("program.compare_targets", {{"id", p}, {"targets", targets}, {"inputs", inputs}})
        .sentence();
  };
  const List two{std::string("krl"), std::string("rapid")};
  EXPECT_NE(sentence({std::string("krl"), std::string("krl")}, {}).find("twice"),
            std::string::npos);
  const std::string unknown = sentence(two, {{"part_her", true}});
  EXPECT_NE(unknown.find("part_here"), std::string::npos) << unknown;
  const std::string output = sentence(two, {{"gripper", true}});
  EXPECT_NE(output.find("gripper"), std::string::npos) << output;
  const std::string wrong = sentence(two, {{"part_here", 3.5}});
  EXPECT_NE(wrong.find("BOOL"), std::string::npos) << wrong;
  const Value c = call("program.compare_targets",
                       {{"id", p}, {"targets", two}, {"inputs", Map{{"Part_Here", true}}}});
  EXPECT_GT(*at(c, "compared").as_int(), 0);
}

/// What stands behind `word` in a text, up to `end`.
std::string behind(const std::string& text, const std::string& word, const std::string& end) {
  const auto at = text.find(word);
  if (at == std::string::npos) return "(no " + word + ")";
  const auto from = at + word.size();
  return text.substr(from, text.find(end, from) - from);
}

/// The configuration that posts write against the places of the links in the same joints: of arms
/// with a spherical wrist, whatever their joints count from, at random poses.
TEST_F(ProgramCheck, ConfigurationsThatArePostedAreThoseOfTheJoints) {
  struct Arm {
    const char* name;
    double lower[6], upper[6];  ///< [degrees]
    double sign, offset;        ///< of the maker's axes 1, 4 and 6; offset of axis 6 [degrees]
    double bends;  ///< 1: joint 5 bends the hand down where it is above 0 and joint 4 is 0
  };
  const Arm arms[] = {
      {"irb140", {-170, -175, -45, -170, -110, -170}, {170, 15, 225, 170, 110, 170}, 1, 90, 1},
      {"kr5", {-150, -60, -100, -170, -110, -170}, {150, 175, 65, 170, 110, 170}, -1, 0, 1},
      {"puma560", {-150, -40, -220, -100, -95, -170}, {150, 220, 40, 160, 95, 170}, 1, 0, -1}};
  std::mt19937 random(20261128);
  std::set<std::string> seen;
  std::size_t compared = 0;
  for (const Arm& arm : arms) {
    const Value robot = call("robot.get", {{"name", std::string(arm.name)}});
    for (int round = 0; round < 40; ++round) {
      List q;
      std::vector<double> degrees;
      for (std::size_t i = 0; i < 6; ++i) {
        degrees.push_back(std::uniform_real_distribution(arm.lower[i], arm.upper[i])(random));
        q.emplace_back(degrees[i] * std::numbers::pi / 180);
      }
      if (std::fabs(degrees[4]) < 5) continue;  // near the singular wrist either will do
      auto fk = app().dispatch(session_, "robot.fk", {{"id", robot}, {"q", q}, {"all", true}});
      if (!fk.ok()) continue;
      const List& links = *at(*fk, "links").as_list();
      using Row = std::array<double, 16>;
      const auto frame = [&](std::size_t link) {
        Row out{};
        const auto& p = at(links[link], "pose").as_array()->data();
        for (std::size_t i = 0; i < 16; ++i) out[i] = p[i];
        return out;
      };
      const Row first = frame(0), elbow = frame(1), wrist = frame(4);
      // x of the first link's frame leads from axis 1 to axis 2, or is where joint 1 = 0 looks.
      const auto front = [&](const Row& r) { return r[3] * first[0] + r[7] * first[4]; };
      const double w = front(wrist), l = w - front(first), h = wrist[11] - first[11];
      const double e = front(elbow) - front(first), u = elbow[11] - first[11];
      const double side = l * u - h * e;
      if (std::fabs(w) < 0.02 || std::fabs(side) < 2e-3) continue;
      const bool is_behind = w < 0, is_below = is_behind ? side > 0 : side < 0;
      const bool is_flipped = arm.bends * degrees[4] < 0;
      const bool is_bent_back = is_behind != is_below;
      std::string joints;
      for (const double d : degrees) joints += (joints.empty() ? "" : ", ") + std::to_string(d);
      const auto& pose = at(*fk, "pose").as_array()->data();
      const auto n = [&](std::size_t i) { return std::to_string(pose[i]); };
      const Value p = call(
          "program.create",
          {{"name", "c" + std::to_string(compared)},
           {"source", "PROGRAM c;\nVAR\n  POSE: there := POSE(POSITION(" +
                          std::to_string(pose[3] * 1000) + ", " + std::to_string(pose[7] * 1000) +
                          ", " + std::to_string(pose[11] * 1000) + "), ORIMAT(POSITION(" + n(0) +
                          ", " + n(4) + ", " + n(8) + "), POSITION(" + n(1) + ", " + n(5) + ", " +
                          n(9) + "), POSITION(" + n(2) + ", " + n(6) + ", " + n(10) +
                          ")));\nBEGIN\n  MOVE PTP JOINT(MAIN_JOINT(" + joints +
                          "), ADD_JOINT(0.0));\n  MOVE LIN there;\nENDPROGRAM;\n"}});
      const auto post = [&](const char* target) {
        const Value found =
            call("program.post",
                 {{"id", p}, {"target", std::string(target)}, {"robot", robot}, {"check", true}});
        std::string all;
        for (const Value& f : *at(found, "files").as_list()) all += *at(f, "text").as_string();
        return all;
      };
      const std::string what = std::string(arm.name) + " at " + joints;
      const auto bit = [](bool is_on, int value) { return is_on ? value : 0; };
      const std::string rapid = post("rapid");
      const auto quarter = [&](std::size_t i) {
        const double of_maker = arm.sign * degrees[i] + (i == 5 ? arm.offset : 0);
        return std::to_string(static_cast<int>(std::floor(of_maker / 90)));
      };
      // ABB's cfx and KUKA's S count the sign of the axis itself.
      EXPECT_NE(rapid.find("[" + quarter(0) + "," + quarter(3) + "," + quarter(5) + "," +
                           std::to_string(bit(is_behind, 4) + bit(is_bent_back, 2) +
                                          bit(degrees[4] < 0, 1)) +
                           "]"),
                std::string::npos)
          << what << "\n"
          << rapid;
      EXPECT_EQ(behind(post("krl"), ",S ", ","),
                std::to_string(bit(is_behind, 1) + bit(!is_bent_back, 2) + bit(degrees[4] < 0, 4)))
          << what;
      EXPECT_EQ(behind(post("fanuc_tp"), "CONFIG : '", ","), std::string(is_flipped ? "F " : "N ") +
                                                                 (is_below ? "D " : "U ") +
                                                                 (is_behind ? "B" : "T"))
          << what;
      EXPECT_EQ(behind(post("melfa5"), ")(", ","),
                std::to_string(bit(!is_behind, 4) + bit(!is_below, 2) + bit(!is_flipped, 1)))
          << what;
      std::string letters;
      for (const auto& [is_on, letter] :
           {std::pair(is_behind, "S"), std::pair(is_below, "E"), std::pair(is_flipped, "W")})
        if (is_on) letters += std::string(letters.empty() ? "" : " ") + letter;
      EXPECT_EQ(behind(behind(post("pdl2"), "MOVE LINEAR TO POS(", ")"), "'", "'"), letters)
          << what;
      const std::string val3 = post("val3");
      EXPECT_NE(val3.find(std::string("shoulder=\"") + (is_behind ? "righty" : "lefty") +
                          "\" elbow=\"" + (is_bent_back ? "enegative" : "epositive") +
                          "\" wrist=\"" + (is_flipped ? "wnegative" : "wpositive")),
                std::string::npos)
          << what << "\n"
          << val3;
      seen.insert(std::string(arm.name) + (is_behind ? "B" : "T") + (is_below ? "D" : "U") +
                  (is_flipped ? "F" : "N"));
      ++compared;
    }
  }
  EXPECT_GT(compared, 60U);
  EXPECT_GT(seen.size(), 16U) << "of the 24 configurations of three arms too few are tried";
}

TEST_F(ProgramCheck, StraightMotionsArePostedInTheBranchTheyKeep) {
  const auto there = [](const std::string& z) {
    return "POSE(POSITION(450.0, 200.0, " + z + "), ORIZYX(0.0, 120.0, 0.0))";
  };
  // STATUS 2 is the elbow below, and the arm comes with its elbow above.
  const Value p = put("  MOVE PTP ROBTARGET(" + there("300.0") +
                      ", 0, [0, 0], ADD_JOINT(0.0));\n  MOVE LIN ROBTARGET(" + there("250.0") +
                      ", 2, [0, 0], ADD_JOINT(0.0));\n");
  const Value c =
      call("program.post", {{"id", p},
                            {"target", std::string("krl")},
                            {"robot", call("robot.get", {{"name", std::string("puma560")}})},
                            {"check", true}});
  EXPECT_TRUE(*at(c, "correct").as_bool());
  bool is_told = false;
  for (const Value& f : *at(c, "faults").as_list())
    is_told =
        is_told || at(f, "message").as_string()->find("keeps its branch, which is STATUS 0") !=
                       std::string::npos;
  EXPECT_TRUE(is_told);
  const std::string dat = *at((*at(c, "files").as_list())[1], "text").as_string();
  EXPECT_EQ(dat.find(",S 0"), std::string::npos) << dat;
}

/// A hint is a way that is still there: the robot is named and the program is flat.
TEST_F(ProgramCheck, HintsOfEveryTargetAreNotOfWhatWasDone) {
  const Value robot = call("robot.get", {{"name", std::string("puma560")}});
  std::vector<Value> programs;
  for (const char* name : {"hanoi", "palletising", "pick_and_place", "arc_weld", "two_robots"})
    programs.push_back(
        call("program.import",
             {{"file", std::string(ROBOMOSP_SOURCE_DIR) + "/scripts/programs/" + name + ".irl"}}));
  // Targets beyond reach, of a place alone, with a tool, behind what only the run knows.
  programs.push_back(put("  MOVE PTP ROBTARGET(" + place(400, 200, 400) +
                         ", 3, [9, 9], ADD_JOINT(0.0));\n  MOVE PTP " + place(4000, 0, 300) +
                         ";\n  MOVE LIN POSITION(400.0, 0.0, 300.0);\n  MOVE PTP " +
                         place(400, 0, 300) + " TOOL := " + place(0, 0, 100) +
                         ";\n  MOVE_INC LIN POSITION(0.0, 0.0, 10.0) TIME := 3.0;\n"));
  std::size_t hints = 0;
  const Value targets = call("program.targets", {});
  for (const Value& t : *targets.as_list()) {
    const std::string target = *at(t, "name").as_string();
    for (const Value& p : programs) {
      const auto found = app().dispatch(session_, "program.post",
                                        {{"id", p},
                                         {"target", target},
                                         {"robot", robot},
                                         {"form", std::string("flat")},
                                         {"check", true}});
      if (!found.ok()) continue;
      for (const Value& f : *at(*found, "faults").as_list()) {
        const std::string& hint = *at(f, "hint").as_string();
        ++hints;
        for (const char* done : {"ame the robot", "robot = ...", "flattened program", "= \"flat\""})
          EXPECT_EQ(hint.find(done), std::string::npos)
              << target << " " << *at(f, "message").as_string() << " " << hint;
        if (*at(f, "severity").as_string() == "error") {
          EXPECT_NE(hint, "") << target << " " << *at(f, "message").as_string();
        }
      }
    }
  }
  EXPECT_GT(hints, 200U);
}

// The robot of a program without a world may come from the library with the same command, and the
// program from the group of edits that is open.
TEST_F(ProgramCheck, ALoneRobotIsTheOneThatThisSessionSees) {
  const Value p = call("program.create", {{"name", "lone"},
                                          {"source",
                                           "PROGRAM lone;\nBEGIN\n  MOVE PTP MAIN_JOINT(0.0, 0.0, "
                                           "0.0, 0.0, 30.0, 0.0);\nENDPROGRAM;\n"}});
  const Value first = call("program.check_run", {{"id", p}, {"robot", "kr5"}, {"contacts", false}});
  EXPECT_EQ(*at(first, "errors").as_int(), 0) << first.text();
  EXPECT_EQ(at(first, "motions").as_list()->size(), 1U) << first.text();
}

// Folders of a backup may hold copies of a file: one of a name is read, the nearest.
TEST_F(ProgramCheck, OfCopiesInABackupOneIsRead) {
  const fs::path task =
      fs::temp_directory_path() / ("copies-" + std::to_string(::getpid())) / "TASK1";
  fs::create_directories(task / "PROGMOD" / "old");
  const auto write = [](const fs::path& file, const std::string& text) {
    std::ofstream(file, std::ios::binary) << text;
  };
  const auto lib = [](const char* output) {
    return std::string("MODULE lib\n  PROC open_it()\n    SetDO ") + output +
           ", 1;\n  ENDPROC\nENDMODULE\n";
  };
  write(task / "PROGMOD" / "main.mod",
        "MODULE m\n  PROC main()\n    open_it;\n    open_it;\n  ENDPROC\nENDMODULE\n");
  write(task / "PROGMOD" / "lib.mod", lib("near"));
  write(task / "PROGMOD" / "old" / "LIB.MOD", lib("far"));
  const Value read =
      call("program.read_foreign", {{"file", (task / "PROGMOD" / "main.mod").string()}});
  fs::remove_all(task.parent_path());
  EXPECT_EQ(at(read, "read").as_list()->size(), 2U) << at(read, "read").text();
  EXPECT_EQ(*at(read, "errors").as_int(), 0) << at(read, "faults").text();
  const std::string irl = *at((*at(read, "files").as_list())[0], "text").as_string();
  EXPECT_NE(irl.find("near := TRUE"), std::string::npos) << irl;
  EXPECT_EQ(irl.find("far"), std::string::npos) << irl;
}

}  // namespace
}  // namespace robomosp
