// SPDX-License-Identifier: Apache-2.0
// Programs in worlds: what names mean there, motions, signals, grips, and live runs with a
// debugger.
#include <chrono>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "support/program_run.h"

namespace robomosp {
namespace {

using recording::RecordingPtr;
using test::kDown;
using test::ProgramRun;

TEST_F(ProgramRun, TheTowersOfHanoiStandWhereTheyBelongOnThreeRobots) {
  for (const std::string robot : {"ur5", "puma560", "pa10"}) {
    cell_ = world_with({robot});
    const double stand = robot == "pa10" ? -0.2 : 0.0;
    call("world.add_frame",
         {{"id", cell_}, {"name", "table"}, {"position", List{0.0, 0.0, stand}}});
    for (int i = 1; i <= 3; ++i) {
      const std::string name = robot + "_disc" + std::to_string(i);
      call("solid.create",
           {{"name", name},
            {"root", Map{{"kind", "cylinder"}, {"radius", 0.1 - 0.02 * i}, {"height", 0.03}}}});
      call("world.add_object", {{"id", cell_},
                                {"what", name},
                                {"name", "disc" + std::to_string(i)},
                                {"position", List{0.6, -0.25, stand + 0.03 * (i - 1)}}});
    }
    const Value p =
        call("program.import",
             {{"file", std::string(ROBOMOSP_SOURCE_DIR) + "/scripts/programs/hanoi.irl"},
              {"name", "hanoi_" + robot}});
    call("world.add_program", {{"id", cell_}, {"program", p}, {"name", "hanoi"}});
    call("program.bind", {{"id", p}, {"kind", "robot"}, {"frame", "table"}});
    const RecordingPtr r = run();
    ASSERT_TRUE(r) << robot;
    for (int i = 1; i <= 3; ++i) {
      const std::string disc = "disc" + std::to_string(i);
      EXPECT_NEAR(column(r, disc + ".x").back(), 0.6, 1e-5) << robot;
      EXPECT_NEAR(column(r, disc + ".y").back(), 0.25, 1e-5) << robot;
      EXPECT_NEAR(column(r, disc + ".z").back(), stand + 0.03 * (i - 1), 1e-5) << robot;
    }
    EXPECT_TRUE(has_note(r, "hanoi: done: 7 discs carried"));
    std::size_t takes = 0;
    for (const std::string& n : r->notes) takes += n.find(" takes disc") != std::string::npos;
    EXPECT_EQ(takes, 7U);
  }
}

TEST_F(ProgramRun, AStraightMotionLastsAsItsSpeedAndAccelerationSay) {
  put("way",
      "MOVE PTP POSE(POSITION(400.0, 100.0, 300.0), down);\n"
      "go := TRUE;\n"
      "MOVE LIN POSE(POSITION(400.0, 100.0, 500.0), down) SPEED := 100.0;\n"
      "go := FALSE;\n"
      "MOVE LIN POSE(POSITION(400.0, 100.0, 300.0), down) TIME := 3.0;\n"
      "go := TRUE;\n",
      std::string("SIGNAL OUTPUT BOOL: go AT 1;\nVAR ") + kDown);
  call("world.add_signal", {{"id", cell_}, {"name", "go"}});
  const RecordingPtr r = run({{"sample_time", 0.001}});
  ASSERT_TRUE(r);
  const auto& go = column(r, "signal.go");
  const auto& t = column(r, "time");
  std::vector<double> changes;
  for (std::size_t i = 1; i < go.size(); ++i)
    if (go[i] != go[i - 1]) changes.push_back(t[i]);
  ASSERT_EQ(changes.size(), 3U);
  // 200 mm at 100 mm/s, up and down with 2.5 m/s^2: 2 s + 0.04 s.
  EXPECT_NEAR(changes[1] - changes[0], 2.04, 0.0021);
  EXPECT_NEAR(changes[2] - changes[1], 3.0, 0.0021);
  const auto places = tool(r);
  for (std::size_t i = 0; i < t.size(); ++i) {
    if (t[i] <= changes[0]) continue;
    EXPECT_NEAR(places[i][0], 0.4, 1e-6);
    EXPECT_NEAR(places[i][1], 0.1, 1e-6);
  }
  EXPECT_NEAR(places.back()[2], 0.3, 1e-6);
}

TEST_F(ProgramRun, TimeIsBoundedByTheJointsAndTheAccelerationOnly) {
  const auto lasts = [&](const std::string& name, const std::string& motion) {
    put(name,
        "MOVE PTP POSE(POSITION(500.0, -200.0, 300.0), down);\ngo := TRUE;\n" + motion +
            "\ngo := FALSE;\n",
        std::string("SIGNAL OUTPUT BOOL: go AT 1;\nVAR ") + kDown);
    const RecordingPtr r = run({{"sample_time", 0.001}});
    call("world.remove_program", {{"id", cell_}, {"name", name}});
    if (!r) return 0.0;
    const auto &go = column(r, "signal.go"), &t = column(r, "time");
    double out = 0;
    for (std::size_t i = 1; i < go.size(); ++i)
      if (go[i] != go[i - 1]) out = t[i] - out;
    const auto place = tool(r).back();
    EXPECT_NEAR(place[1], name.starts_with("spot") ? -0.2 : 0.2, 1e-6) << name;
    return out;
  };
  call("world.add_signal", {{"id", cell_}, {"name", "go"}});
  const std::string to = "POSE(POSITION(500.0, 200.0, 300.0), down)";
  // 400 mm with 2.5 m/s^2 take 0.8 s at least, whatever SPEED says.
  EXPECT_NEAR(lasts("fast", "MOVE LIN " + to + " TIME := 1.2 SPEED := 100.0;"), 1.2, 0.0021);
  EXPECT_NEAR(lasts("slow", "MOVE LIN " + to + " TIME := 6.0;"), 6.0, 0.0021);
  EXPECT_NEAR(lasts("round",
                    "MOVE CIRCLE POSITION(600.0, 0.0, 300.0), POSITION(500.0, 200.0, 300.0) "
                    "TIME := 3.0;"),
              3.0, 0.0021);
  EXPECT_NEAR(lasts("curve",
                    "MOVE PATH POSITION(600.0, 0.0, 300.0), POSITION(500.0, 200.0, 300.0) "
                    "TIME := 3.0;"),
              3.0, 0.0021);
  EXPECT_NEAR(lasts("spot",
                    "MOVE LIN POSE(POSITION(500.0, -200.0, 300.0), ORIZYX(90.0, 180.0, "
                    "0.0)) TIME := 2.0;"),
              2.0, 0.0021);
  const auto refused = [&](const std::string& name, const std::string& motion) {
    put(name, "MOVE PTP POSE(POSITION(500.0, -200.0, 300.0), down);\n" + motion + "\n",
        std::string("VAR ") + kDown);
    const std::string said = fault();
    call("world.remove_program", {{"id", cell_}, {"name", name}});
    return said;
  };
  const std::string short_of = refused("accel", "MOVE LIN " + to + " TIME := 0.5;");
  EXPECT_NE(short_of.find("too short for the limits. The shortest is 0.8 s."), std::string::npos)
      << short_of;
  // A turn of the hand on the spot by half a turn: within ACC, and too fast for the wrist.
  const std::string joint =
      refused("wrist",
              "MOVE LIN POSE(POSITION(500.0, -200.0, 300.0), ORIZYX(179.0, 180.0, 0.0)) "
              "TIME := 1.2;");
  EXPECT_NE(
      joint.find("TIME of 1.2 s is too short: axis wrist_3, joint 6 of \"ur5\" would move at"),
      std::string::npos)
      << joint;
  const auto at = joint.find("Give TIME of ");
  ASSERT_NE(at, std::string::npos) << joint;
  // What is said to be enough is.
  const double enough = std::stod(joint.substr(at + 13));
  EXPECT_NEAR(lasts("spot2",
                    "MOVE LIN POSE(POSITION(500.0, -200.0, 300.0), ORIZYX(179.0, 180.0, "
                    "0.0)) TIME := " +
                        std::to_string(enough) + ";"),
              enough, 0.0021);
}

TEST_F(ProgramRun, TargetsUnderTimeArePassedWithoutAStop) {
  // The ways in degrees of joint 1, in 0.5 s each.
  const auto motion = [](double q1, double time, bool passes) {
    return "MOVE PTP MAIN_JOINT(" + std::to_string(q1) +
           ", -90.0, 0.0, -90.0, 0.0, 0.0) TIME := " + std::to_string(time) +
           (passes ? " C_PASS := TRUE;\n" : ";\n");
  };
  put("pass",
      "MOVE PTP MAIN_JOINT(0.0, -90.0, 0.0, -90.0, 0.0, 0.0);\ngo := TRUE;\n" +
          motion(10, 0.5, true) + motion(30, 0.5, true) + motion(30, 0.4, true) +
          motion(20, 0.5, false) + "go := FALSE;\nWAIT 0.1 SEC;\n",
      "SIGNAL OUTPUT BOOL: go AT 1;\n");
  call("world.add_signal", {{"id", cell_}, {"name", "go"}});
  const RecordingPtr r = run({{"sample_time", 0.001}});
  ASSERT_TRUE(r);
  const auto& go = column(r, "signal.go");
  const auto &t = column(r, "time"), &q = column(r, "ur5.q1"), &qd = column(r, "ur5.qd1");
  const double degree = M_PI / 180, from = first(r, "signal.go", 1);
  double until = from;
  for (std::size_t i = 0; i < t.size(); ++i)
    if (go[i] > 0) until = t[i];
  EXPECT_NEAR(until - from, 1.9, 0.0021);
  const auto at = [&](const std::vector<double>& c, double time) {
    std::size_t i = 0;
    while (i + 1 < t.size() && t[i] < from + time) ++i;
    return c[i] / degree;
  };
  // 20 degrees/s before the first target and 40 behind it: the parabola has 30 there.
  EXPECT_NEAR(at(q, 0.5), 10, 0.05);
  EXPECT_NEAR(at(qd, 0.5), 30, 0.3);
  EXPECT_NEAR(at(q, 1.0), 30, 0.01);
  EXPECT_NEAR(at(qd, 1.0), 0, 0.3);
  EXPECT_NEAR(at(q, 1.2), 30, 1e-6);  // the TIME at a target is spent there
  EXPECT_NEAR(at(q, 1.9), 20, 0.01);
  EXPECT_FALSE(has_note(r, "C_PASS")) << r->notes.back();
}

TEST_F(ProgramRun, WhatCannotPassStopsAndSaysSo) {
  const std::string ptp = "MOVE PTP MAIN_JOINT(", rest = ".0, -90.0, 90.0, -90.0, -90.0, 0.0)";
  call("world.add_signal", {{"id", cell_}, {"name", "go"}});
  put("stops",
      ptp + "0" + rest + ";\ngo := TRUE;\n" + ptp + "10" + rest +
          " TIME := 1.0 C_PASS := TRUE;\nMOVE LIN ADD_JOINT(0.0);\n" + ptp + "20" + rest +
          " C_PASS := TRUE;\n" + ptp + "30" + rest + " TIME := 1.0 C_PASS := TRUE;\ngo := FALSE;\n",
      "SIGNAL OUTPUT BOOL: go AT 1;\n");
  const RecordingPtr r = run({{"sample_time", 0.001}});
  ASSERT_TRUE(r);
  EXPECT_TRUE(has_note(r, "C_PASS is ignored if no PTP to one target with a TIME follows"));
  EXPECT_TRUE(has_note(r, "C_PASS without C_CP or C_PTP is executed only in PTP to one target"));
}

TEST_F(ProgramRun, TargetsThatJointsCannotPassInTimeAreErrorsAndExcessIsANote) {
  const auto world = [&](double velocity, double acceleration) {
    List links;
    for (int i = 0; i < 6; ++i)
      links.emplace_back(Map{{"name", "l" + std::to_string(i)},
                             {"a", 0.2},
                             {"max_velocity", velocity},
                             {"max_acceleration", acceleration}});
    const std::string name = "arm" + std::to_string(++made_);
    const Value arm = call("robot.create", {{"name", name}, {"links", links}});
    cell_ = call("world.create", {{"name", "w" + name}});
    call("world.add_robot", {{"id", cell_}, {"robot", arm}, {"name", "arm"}});
  };
  const auto source = [](double a, double b, double c) {
    std::string out;
    for (const double q : {a, b, c})
      out += "MOVE PTP MAIN_JOINT(" + std::to_string(q) + ", 0.0, 0.0, 0.0, 0.0, 0.0) TIME := 1.0" +
             (q == c ? ";\n" : " C_PASS := TRUE;\n");
    return out;
  };
  // 60 degrees in 1 s, where 57.3 degrees/s is the greatest.
  world(1, 100);
  put("fast", source(20, 80, 90));
  EXPECT_NE(fault().find("program \"fast\", fast.irl:5:1: TIME of 1 s of the motion to the target "
                         "in line 4 is too short: joint 1 of \"arm\" would move at 60 degrees/s, "
                         "but its maximum is 57.3. Give TIME of 1.048 s or more."),
            std::string::npos)
      << fault();
  // From 20 degrees/s to 60 between the middles of 1 s each: 40 degrees/s^2.
  world(10, 0.5);
  put("bent", source(10, 70, 90));
  EXPECT_NE(
      fault().find(
          "joint 1 of \"arm\" would be accelerated at 50 degrees/s^2, but its maximum is 28.65"),
      std::string::npos)
      << fault();
  // The points ask for 2 * 20 degrees/s^2 at most, the cubic from rest has 6 * 20 - 2 * 20.
  world(10, 1);
  put("cubic", source(20, 40, 60));
  const RecordingPtr r = run();
  ASSERT_TRUE(r);
  EXPECT_TRUE(has_note(r,
                       "joint 1 of \"arm\" is accelerated at 80 degrees/s^2, but its maximum is "
                       "57.3: so it passes targets in their TIMEs (C_PASS, line "))
      << r->notes.back();
  // Alone it has no target to pass.
  world(1, 0.1);
  put("alone", source(20, 20, 20).substr(0, source(20, 20, 20).find('\n') + 1) + "WAIT 1.0 SEC;\n");
  EXPECT_NE(fault().find("a duration of 1 s is too short"), std::string::npos) << fault();
}

TEST_F(ProgramRun, AMotionBehindCancelBeginsWhereTheRobotStands) {
  call("world.add_signal", {{"id", cell_}, {"name", "go"}});
  put("ends",
      "MOVE PTP MAIN_JOINT(0.0, -90.0, 90.0, -90.0, -90.0, 0.0);\nSTART far;\nWAIT 0.5 SEC;\n"
      "CANCEL far;\ngo := TRUE;\n"
      "MOVE PTP MAIN_JOINT(0.0, -90.0, 90.0, -90.0, -90.0, 0.0);\ngo := FALSE;\nWAIT 0.1 SEC;\n",
      "SIGNAL OUTPUT BOOL: go AT 1;\nPROCESS far;\nBEGIN\n"
      "  MOVE PTP MAIN_JOINT(90.0, -90.0, 90.0, -90.0, -90.0, 0.0);\nENDPROCESS;\n");
  const RecordingPtr r = run({{"sample_time", 0.001}});
  ASSERT_TRUE(r);
  const auto &t = column(r, "time"), &q = column(r, "ur5.q1"), &qd = column(r, "ur5.qd1");
  const double from = first(r, "signal.go", 1);
  double most = 0, stands = 0;
  for (std::size_t i = 1; i < t.size(); ++i) {
    EXPECT_LT(std::fabs(q[i] - q[i - 1]), 0.001 * M_PI * 1.001) << t[i];  // its greatest speed
    EXPECT_LT(std::fabs(qd[i] - qd[i - 1]), 0.2) << t[i];                 // no jump
    if (t[i] > from && q[i] > most) most = q[i], stands = t[i];
  }
  EXPECT_GT(stands, from + 0.01);  // it brakes first
  EXPECT_NEAR(q.back(), 0, 1e-6);
}

/// A straight motion of 200 mm that an interrupt comes into; what its routine does.
std::string braked(const std::string& routine) {
  return "VAR POSE: a := POSE(POSITION(-300.0, -200.0, 400.0), ORIZYX(0.0, 180.0, 0.0));\n"
         "POSE: b := POSE(POSITION(-300.0, 0.0, 400.0), ORIZYX(0.0, 180.0, 0.0));\n"
         "INTERRUPT it WHEN R_ROBTARGET_ACT.PSE.POS.Y > -120.0;\nBEGIN\n" +
         routine + "ENDINTERRUPT;\n";
}

/// The row behind the first in which the tool is where that motion begins.
std::size_t at_begin(const std::vector<std::array<double, 3>>& at) {
  for (std::size_t i = 0; i < at.size(); ++i)
    if (std::abs(at[i][0] + 0.3) < 1e-5 && std::abs(at[i][1] + 0.2) < 1e-5) return i + 1;
  return at.size();
}

TEST_F(ProgramRun, BrakeEndsAMotionOnItsPathAndTheProgramReadsWhereItStands) {
  put("p",
      "MOVE PTP a;\nENABLE it;\nMOVE LIN b SPEED := 100.0;\nDISABLE it;\n"
      "WRITELN('at ', R_ROBTARGET_ACT.PSE.POS.X, ' ', R_ROBTARGET_ACT.PSE.POS.Y, ' ', "
      "R_JOINT_ACT.M_JOINT.A1);\nMOVE LIN b;\n",
      braked("BRAKE;\nWRITELN('speed ', R_SPEED_ACT < 0.5);\nWAIT 1.0 SEC;\n"));
  const RecordingPtr r = run();
  ASSERT_TRUE(r);
  EXPECT_TRUE(has_note(r, "p: speed TRUE"));
  const auto at = tool(r);
  // It stands for a second, a little behind where it was seen, on the line, and goes on to b.
  std::size_t stands = 0;
  double where = NAN;
  for (std::size_t i = at_begin(at); i < at.size(); ++i) {
    EXPECT_LT(at[i][1], 1e-5);
    if (std::abs(at[i][1] - at[i - 1][1]) < 1e-9 && at[i][1] > -0.19 && at[i][1] < -0.01)
      ++stands, where = at[i][1];
  }
  EXPECT_GT(stands, 5U);
  EXPECT_GT(where, -0.120);
  EXPECT_LT(where, -0.090);
  EXPECT_NEAR(at.back()[1], 0.0, 1e-5);
  // What it says is where it is.
  bool is_said = false;
  for (const std::string& n : r->notes)
    if (const auto k = n.find("p: at "); k != std::string::npos) {
      is_said = true;
      double x = 0, y = 0, a1 = 0;
      ASSERT_EQ(std::sscanf(n.c_str() + k, "p: at %lf %lf %lf", &x, &y, &a1), 3) << n;
      EXPECT_NEAR(x, -300, 1e-3);
      EXPECT_NEAR(y, 1000 * where, 1e-3);
      EXPECT_GT(std::abs(a1), 0.5) << n;
    }
  EXPECT_TRUE(is_said);
}

TEST_F(ProgramRun, BrakeHoldsAMotionAndItGoesOnBehindTheInterrupt) {
  put("p",
      "MOVE PTP a;\nENABLE it;\nMOVE LIN b SPEED := 100.0;\nWRITELN('there ', "
      "R_ROBTARGET_ACT.PSE.POS.Y > -0.01);\n",
      braked("BRAKE(1);\nWRITELN('speed ', R_SPEED_ACT < 0.5);\nWAIT 1.0 SEC;\n"));
  const RecordingPtr r = run();
  ASSERT_TRUE(r);
  EXPECT_TRUE(has_note(r, "p: speed TRUE"));
  EXPECT_TRUE(has_note(r, "p: there TRUE"));
  const auto at = tool(r);
  std::size_t stands = 0;
  for (std::size_t i = at_begin(at); i < at.size(); ++i) {
    EXPECT_GT(at[i][1], at[i - 1][1] - 1e-6);  // never back
    if (std::abs(at[i][1] - at[i - 1][1]) < 1e-9 && at[i][1] > -0.125 && at[i][1] < -0.08) ++stands;
  }
  EXPECT_GT(stands, 5U);
  EXPECT_NEAR(at.back()[1], 0.0, 1e-5);
}

TEST_F(ProgramRun, PassedTargetsAreHeldEndedAndSteppedThroughWithoutAJump) {
  const auto joint = [](double q) {
    return "MOVE PTP MAIN_JOINT(" + std::to_string(q) + ", -90.0, 90.0, -90.0, -90.0, 0.0)";
  };
  const std::string way = joint(0) + ";\n" + joint(10) + " TIME := 0.5 C_PASS := TRUE;\n" +
                          joint(30) + " TIME := 0.5 C_PASS := TRUE;\n" + joint(50) +
                          " TIME := 0.5 C_PASS := TRUE;\n" + joint(60) + " TIME := 0.5;\n";
  const auto expect_smooth = [&](const RecordingPtr& r) {
    ASSERT_TRUE(r);
    const auto &t = column(r, "time"), &q = column(r, "ur5.q1"), &qd = column(r, "ur5.qd1");
    for (std::size_t i = 1; i < t.size(); ++i) {
      const double dt = t[i] - t[i - 1];
      EXPECT_NEAR(q[i] - q[i - 1], dt * (qd[i] + qd[i - 1]) / 2, 2e-4) << t[i];
      EXPECT_LT(std::fabs(qd[i] - qd[i - 1]), 15 * dt + 1e-9) << t[i];
    }
  };
  int count = 0;
  const auto named = [&](const char* name) { return name + std::to_string(++count); };
  const auto remove = [&](const std::string& name) {
    call("world.remove_program", {{"id", cell_}, {"name", name}});
  };
  const double degree = M_PI / 180;
  put("plain", way);
  const RecordingPtr plain = run({{"sample_time", 0.005}});
  expect_smooth(plain);
  EXPECT_NEAR(column(plain, "ur5.q1").back(), 60 * degree, 1e-9);
  remove("plain");
  // Held between two targets that are passed, and let go on.
  for (const double when : {1.5, 1.9, 2.2, 2.6}) {
    SCOPED_TRACE(when);
    const std::string held = named("held"), ended = named("ended");
    put(held,
        "START goes;\nWAIT " + std::to_string(when) +
            " SEC;\nSTOP goes;\nWAIT 1.0 SEC;\n"
            "CONTINUE goes;\n",
        "PROCESS goes;\nBEGIN\n" + way + "ENDPROCESS;\n");
    const RecordingPtr r = run({{"sample_time", 0.005}});
    expect_smooth(r);
    EXPECT_NEAR(column(r, "ur5.q1").back(), 60 * degree, 1e-9);
    remove(held);
    // Ended there, and sent back at once.
    put(ended,
        "START goes;\nWAIT " + std::to_string(when) + " SEC;\nCANCEL goes;\n" + joint(0) + ";\n",
        "PROCESS goes;\nBEGIN\n" + way + "ENDPROCESS;\n");
    const RecordingPtr e = run({{"sample_time", 0.005}});
    expect_smooth(e);
    EXPECT_NEAR(column(e, "ur5.q1").back(), 0, 1e-9);
    remove(ended);
  }
  // By UNTIL, and by BRAKE in an interrupt: the next motion begins where the robot stands.
  for (const bool by_until : {true, false}) {
    const std::string cut = named("cut");
    put(cut,
        joint(0) + ";\nSTART later;\n" + (by_until ? "" : "ENABLE it;\n") + joint(60) +
            " SPEED_PTP := 30.0" + (by_until ? " UNTIL enough" : "") + ";\nx := 1;\n" + joint(5) +
            ";\n",
        std::string("VAR BOOL: enough := FALSE; INT: x;\n"
                    "PROCESS later;\nBEGIN\n  WAIT 0.6 SEC; enough := TRUE;\nENDPROCESS;\n") +
            (by_until ? "" : "INTERRUPT it WHEN enough;\nBEGIN\n  BRAKE;\nENDINTERRUPT;\n"));
    const RecordingPtr r = run({{"sample_time", 0.005}});
    expect_smooth(r);
    const auto& q = column(r, "ur5.q1");
    EXPECT_LT(*std::max_element(q.begin() + static_cast<std::ptrdiff_t>(q.size() / 2), q.end()),
              50 * degree);
    EXPECT_NEAR(q.back(), 5 * degree, 1e-9);
    remove(cut);
  }
}

TEST_F(ProgramRun, UntilStopsTheRobotOnItsPath) {
  put("way",
      "MOVE PTP POSE(POSITION(400.0, 100.0, 300.0), down);\n"
      "WAIT FOR start;\n"
      "MOVE LIN POSE(POSITION(400.0, 100.0, 600.0), down) SPEED := 100.0 UNTIL enough;\n"
      "WAIT 0.5 SEC;\n",
      std::string("SIGNAL INPUT BOOL: start AT 1; INPUT BOOL: enough AT 2;\nVAR ") + kDown);
  put("other", "WAIT 5.0 SEC; start := TRUE; WAIT 1.0 SEC; enough := TRUE;\n",
      "SIGNAL OUTPUT BOOL: start AT 1; OUTPUT BOOL: enough AT 2;\n");
  for (const char* name : {"start", "enough"})
    call("world.add_signal", {{"id", cell_}, {"name", name}});
  const RecordingPtr r = run({{"sample_time", 0.01}});
  ASSERT_TRUE(r);
  const auto places = tool(r);
  // 1 s of 100 mm/s behind a start with 2.5 m/s^2, and a way to rest.
  EXPECT_GT(places.back()[2], 0.398 - 1e-6);
  EXPECT_LT(places.back()[2], 0.42);
  EXPECT_NEAR(places.back()[0], 0.4, 1e-6);
  const auto& t = column(r, "time");
  for (std::size_t j = 1; j <= 6; ++j) {
    const auto& qd = column(r, "ur5.qd" + std::to_string(j));
    EXPECT_NEAR(qd.back(), 0, 1e-12);
    const auto& q = column(r, "ur5.q" + std::to_string(j));
    for (std::size_t i = 1; i < q.size(); ++i)
      EXPECT_NEAR(q[i] - q[i - 1], (qd[i] + qd[i - 1]) / 2 * (t[i] - t[i - 1]), 2e-4);
  }
}

TEST_F(ProgramRun, ACornerWithinItsZoneIsPassedWithoutAStop) {
  const std::string corner =
      "MOVE PTP POSE(POSITION(400.0, -100.0, 300.0), down);\ngo := TRUE;\n"
      "MOVE LIN POSE(POSITION(400.0, 100.0, 300.0), down) SPEED := 100.0 C_CP := ";
  const std::string rest =
      ";\nMOVE LIN POSE(POSITION(400.0, 100.0, 500.0), down) SPEED := 100.0;\ngo := FALSE;\n";
  const std::string declared = std::string("SIGNAL OUTPUT BOOL: go AT 1;\nVAR ") + kDown;
  call("world.add_signal", {{"id", cell_}, {"name", "go"}});
  put("stops", corner + "0.0" + rest, declared);
  put("passes", corner + "10.0" + rest, declared);
  const auto lasts = [&](const RecordingPtr& r) {
    const auto& go = column(r, "signal.go");
    double sum = 0;
    for (const double g : go) sum += g * 0.01;
    return sum;
  };
  const RecordingPtr stops = run({{"program", "stops"}, {"sample_time", 0.01}}),
                     passes = run({{"program", "passes"}, {"sample_time", 0.01}});
  ASSERT_TRUE(stops && passes);
  EXPECT_LT(lasts(passes), lasts(stops) - 0.01);
  const auto places = tool(passes);
  double nearest = 1;
  for (const auto& p : places)
    nearest = std::min(nearest, std::hypot(p[0] - 0.4, p[1] - 0.1, p[2] - 0.3));
  EXPECT_GT(nearest, 1e-4);
  EXPECT_LT(nearest, 0.01);
  EXPECT_NEAR(places.back()[2], 0.5, 1e-6);
}

TEST_F(ProgramRun, ProgramsAndTasksShareSignalsAndRepeatBitForBit) {
  for (const char* name : {"ask", "answer"})
    call("world.add_signal", {{"id", cell_}, {"name", name}});
  put("one",
      "FOR i := 1 TO 3\nask := TRUE; WAIT FOR answer; WAIT 0.1 SEC; ask := FALSE; WAIT FOR NOT "
      "answer;\n"
      "MOVE_INC LIN POSE(POSITION(0.0, 0.0, 10.0), ORIZYX(0.0, 0.0, 0.0));\nENDFOR;\n",
      "SIGNAL OUTPUT BOOL: ask AT 1; INPUT BOOL: answer AT 2;\nVAR INT: i;\n");
  call("task.create",
       {{"name", "two"},
        {"steps",
         List{Map{{"step", "repeat"},
                  {"count", 3},
                  {"steps", List{Map{{"step", "wait"}, {"condition", "ask == 1"}},
                                 Map{{"step", "wait"}, {"time", 0.25}},
                                 Map{{"step", "set"}, {"signal", "answer"}, {"value", 1}},
                                 Map{{"step", "wait"}, {"condition", "ask == 0"}},
                                 Map{{"step", "set"}, {"signal", "answer"}, {"value", 0}}}}}}}});
  call("world.add_task", {{"id", cell_}, {"task", "two"}});
  const RecordingPtr a = run(), b = run();
  ASSERT_TRUE(a && b);
  EXPECT_NEAR(first(a, "signal.answer", 1), 0.26, 0.011);
  ASSERT_EQ(a->columns.size(), b->columns.size());
  for (std::size_t c = 0; c < a->columns.size(); ++c)
    EXPECT_EQ(a->columns[c].values, b->columns[c].values) << a->columns[c].name;
  EXPECT_EQ(a->notes, b->notes);
}

TEST_F(ProgramRun, WhatIsBoundToNothingOrWronglyIsASentence) {
  const Value p =
      put("signals", "WAIT FOR here;\n", "SIGNAL INPUT BOOL: here AT 1; OUTPUT INT: lamp AT 2;\n");
  EXPECT_NE(fault().find("the world has no signal for here and lamp"), std::string::npos)
      << fault();
  call("program.bind", {{"id", p}, {"kind", "free"}, {"name", "lamp"}});
  call("program.bind", {{"id", p}, {"kind", "signal"}, {"name", "here"}, {"to", "nothing"}});
  EXPECT_NE(fault().find("no signal \"nothing\""), std::string::npos) << fault();
  call("program.bind", {{"id", p}, {"kind", "free"}, {"name", "here"}, {"value", 1}});
  EXPECT_TRUE(run());
  call("program.bind", {{"id", p}, {"kind", "grip"}, {"name", "here"}});
  EXPECT_NE(fault().find("cannot grip"), std::string::npos) << fault();
  call("program.unbind", {{"id", p}, {"name", "here"}});
  EXPECT_TRUE(run({{"unbound", "free"}, {"duration", 1}}));
  call("program.bind", {{"id", p}, {"kind", "robot"}, {"to", "nobody"}});
  EXPECT_NE(fault({{"unbound", "free"}}).find("no robot \"nobody\""), std::string::npos);
}

TEST_F(ProgramRun, FaultsNameProgramFileLineAndColumn) {
  put("far", "MOVE PTP POSE(POSITION(4000.0, 0.0, 0.0), down);\n", std::string("VAR ") + kDown);
  EXPECT_EQ(fault().find("world \"cell1\", program \"far\", far.irl:4:1: robot \"ur5\" does not"),
            0U)
      << fault();
  call("world.remove_program", {{"id", cell_}, {"name", "far"}});
  put("joints", "MOVE PTP MAIN_JOINT(0.0, 0.0, 0.0, 0.0, 0.0, 9000.0);\n");
  EXPECT_NE(fault().find("joint 6"), std::string::npos) << fault();
  call("world.remove_program", {{"id", cell_}, {"name", "joints"}});
  put("slow", "MOVE PTP MAIN_JOINT(0.0, 0.0, 0.0, 0.0, 0.0, 9.0) SPEED_PTP := share;\n",
      "VAR REAL: share;\n");
  EXPECT_NE(fault().find("SPEED_PTP"), std::string::npos) << fault();
  call("world.remove_program", {{"id", cell_}, {"name", "slow"}});
  put("never", "LOOP\nWAIT 1.0 SEC;\nENDLOOP;\n");
  EXPECT_NE(fault({{"most_time", 20}}).find("longer than 20 s"), std::string::npos);
  EXPECT_NEAR(column(run({{"duration", 5}}), "time").back(), 5, 1e-9);
  call("world.remove_program", {{"id", cell_}, {"name", "never"}});
  put("busy", "LOOP\nENDLOOP;\n");
  EXPECT_NE(fault().find("loops endlessly"), std::string::npos);
  call("world.remove_program", {{"id", cell_}, {"name", "busy"}});
  put("stuck", "WAIT FOR a;\n", "SIGNAL INPUT BOOL: a AT 1;\n");
  EXPECT_NE(fault({{"unbound", "free"}}).find("can never come true"), std::string::npos);
}

TEST_F(ProgramRun, PlacesOfHaltAndOfFilesAreThoseOfTheirStatements) {
  put("halts",
      "MOVE PTP MAIN_JOINT(0.0, -90.0, 90.0, 0.0, 0.0, 0.0);\nn := 1;\nIF n = 1 THEN\n"
      "    HALT;\nENDIF;\n",
      "VAR INT: n := 0;\n");
  const RecordingPtr r = run();
  ASSERT_TRUE(r);
  EXPECT_TRUE(has_note(r, "halts is at HALT, halts.irl:7:5")) << r->notes.back();
  EXPECT_EQ(column(r, "halts.line").back(), 7);
  call("world.remove_program", {{"id", cell_}, {"name", "halts"}});
  // What is open at the end is written then, and its fault is of the last WRITE.
  put("writes", "OPEN(f, 'list.txt', 'W');\nWRITELN(f, 1);\n  WRITELN(f, 2);\nn := 2;\n",
      "VAR FILE: f; INT: n;\n");
  EXPECT_NE(fault().find("program \"writes\", writes.irl:6:3: the program writes the file"),
            std::string::npos)
      << fault();
}

TEST_F(ProgramRun, WaitsThatNothingEndsSayWhatTheyWaitFor) {
  put("stuck", "START side;\nSTOP side;\nSTART other;\nACQUIRE(turn);\n",
      "VAR SEMAPHORE: turn; INT: n := 0;\n"
      "PROCESS side;\nBEGIN\n  WAIT 5.0 SEC;\nENDPROCESS;\n"
      "PROCESS other;\nBEGIN\n  WAIT FOR n = 3;\nENDPROCESS;\n");
  const std::string said = fault();
  for (const char* part : {"program \"stuck\", stuck.irl:15:1 waits for the semaphore turn",
                           "program \"stuck\", process side is held by STOP",
                           "program \"stuck\", process other, stuck.irl:9:3 waits for variables",
                           "which can never come true", "RELEASE it in another process.",
                           "CONTINUE it in another process.", "or give the wait a TIMEOUT."})
    EXPECT_NE(said.find(part), std::string::npos) << part << "\n" << said;
  EXPECT_EQ(said.find("Make a task set"), std::string::npos) << said;
}

TEST_F(ProgramRun, ARobotsNumberThatTheProgramHasNotIsRefused) {
  const Value p = put("one", "MOVE PTP MAIN_JOINT(0.0, -90.0, 90.0, 0.0, 0.0, 0.0);\n");
  call("program.bind", {{"id", p}, {"kind", "robot"}, {"name", "9"}, {"to", "ur5"}});
  EXPECT_NE(fault().find("it has no ROBOT number 9, and no motion names a DEVICE. Bind its own "
                         "robot without a name."),
            std::string::npos)
      << fault();
}

TEST_F(ProgramRun, AValueThatCannotBeNamesItsProgramOnce) {
  const Value p = put("seal", "n := 2;\n", "VAR INT: n := 1;\n");
  const std::string said =
      fails("program.bind", {{"id", p}, {"kind", "value"}, {"name", "n"}, {"expression", "'text'"}})
          .sentence();
  EXPECT_NE(said.find("program \"seal\""), std::string::npos) << said;
  EXPECT_EQ(said.find("program \"seal\"", said.find("program \"seal\"") + 1), std::string::npos)
      << said;
}

TEST_F(ProgramRun, LinesAreRecordedAndCostsGrowWithTheMotions) {
  put("many",
      "MOVE PTP POSE(POSITION(400.0, 100.0, 300.0), down);\nFOR i := 1 TO n\n"
      "MOVE_INC LIN POSE(POSITION(0.0, 0.0, 1.0), ORIZYX(0.0, 0.0, 0.0));\n"
      "MOVE_INC LIN POSE(POSITION(0.0, 0.0, -1.0), ORIZYX(0.0, 0.0, 0.0));\nENDFOR;\n",
      std::string("SIGNAL INPUT INT: n AT 1;\nVAR INT: i;\n") + kDown);
  const auto seconds = [&](double n) {
    call("program.bind", {{"id", "many"}, {"kind", "free"}, {"name", "n"}, {"value", n}});
    const auto start = std::chrono::steady_clock::now();
    const RecordingPtr r = run({{"most_time", 1e6}});
    EXPECT_EQ(column(r, "many.line").back(), 9);
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  };
  seconds(10);
  const double few = seconds(100), many = seconds(800);
  EXPECT_LT(many, 8 * 3 * few + 0.05);
}

class ProgramLive : public ProgramRun {
 protected:
  Value start() { return call("world.start_run", {{"id", cell_}, {"of", "tasks"}}); }
  void put_counter() {
    put("count",
        "  FOR i := 1 TO 5\n"  // 7
        "    add(i);\n"        // 8
        "    WAIT 0.1 SEC;\n"  // 9
        "    MOVE_INC LIN POSE(POSITION(0.0, 0.0, 10.0), ORIZYX(0.0, 0.0, 0.0));\n"
        "  ENDFOR;\n",
        "VAR INT: i, sum;\nPROCEDURE add (IN INT: n);\nBEGIN sum := sum + n;\nENDPROC;\n");
  }
};

TEST_F(ProgramLive, ARunStepByStepIsTheWholeRun) {
  put_counter();
  const RecordingPtr whole = run();
  const Value live = start();
  for (int i = 0; i < 10; ++i) call("run.step", {{"id", live}});
  call("run.finish", {{"id", live}});
  const Value made = call("run.recording", {{"id", live}});
  const RecordingPtr stepped = app().recordings.find(made.as_handle()->number);
  ASSERT_TRUE(whole && stepped);
  for (const auto& c : whole->columns) EXPECT_EQ(c.values, column(stepped, c.name)) << c.name;
  EXPECT_EQ(whole->notes, stepped->notes);
}

TEST_F(ProgramLive, StopsOfADebuggerLeavePassedTargetsAsTheyAre) {
  std::string way;
  for (const int q : {0, 10, 30, 50, 60})
    way += "MOVE PTP MAIN_JOINT(" + std::to_string(q) + ".0, -90.0, 90.0, -90.0, -90.0, 0.0)" +
           (q == 0 ? "" : " TIME := 0.5") + (q > 0 && q < 60 ? " C_PASS := TRUE;\n" : ";\n");
  put("way", way);
  const RecordingPtr whole = run();
  const Value live = start();
  for (int line = 3; line <= 7; ++line)
    call("run.set_breakpoint", {{"id", live}, {"program", "way"}, {"line", line}});
  for (int i = 0; i < 5; ++i) call("run.continue", {{"id", live}});
  call("run.finish", {{"id", live}});
  const Value made = call("run.recording", {{"id", live}});
  const RecordingPtr stopped = app().recordings.find(made.as_handle()->number);
  ASSERT_TRUE(whole && stopped);
  const auto &t = column(whole, "time"), &u = column(stopped, "time");
  const auto &q = column(whole, "ur5.q1"), &p = column(stopped, "ur5.q1");
  std::size_t k = 0, same = 0;
  for (std::size_t i = 0; i < t.size(); ++i) {
    while (k + 1 < u.size() && u[k] < t[i]) ++k;
    if (u[k] != t[i]) continue;
    ++same;
    EXPECT_EQ(p[k], q[i]) << t[i];
  }
  EXPECT_EQ(same, t.size());
}

TEST_F(ProgramLive, BreakpointsStopItAndThePastKeepsItsVariables) {
  put_counter();
  const Value live = start();
  const Value b = call("run.set_breakpoint", {{"id", live}, {"line", 8}, {"condition", "i = 3"}});
  EXPECT_EQ(*at(b, "line").as_int(), 8);
  const Value stood = call("run.continue", {{"id", live}});
  EXPECT_EQ(at(stood, "reason").text(), "breakpoint");
  EXPECT_EQ(*at(stood, "line").as_int(), 8);
  EXPECT_EQ(at(call("run.evaluate", {{"id", live}, {"expression", "sum"}}), "value").text(), "3");
  EXPECT_EQ(*at(call("run.step_into", {{"id", live}}), "line").as_int(), 4);
  EXPECT_EQ(call("run.stack", {{"id", live}}).as_list()->size(), 2U);
  EXPECT_EQ(at(call("run.evaluate", {{"id", live}, {"expression", "n"}}), "value").text(), "3");
  const Value moved = call("run.to_motion", {{"id", live}});
  EXPECT_EQ(at(moved, "reason").text(), "motion");
  EXPECT_EQ(*at(moved, "line").as_int(), 10);
  EXPECT_EQ(at(call("run.evaluate", {{"id", live}, {"expression", "sum"}}), "value").text(), "6");
  // Back, where sum was 1, and forward again.
  call("run.seek", {{"id", live}, {"time", 0.05}});
  EXPECT_EQ(at(call("run.evaluate", {{"id", live}, {"expression", "sum"}}), "value").text(), "1");
  EXPECT_NE(fails("run.set_variable", {{"id", live}, {"variable", "sum"}, {"value", "0"}})
                .sentence()
                .find("shows the past"),
            std::string::npos);
  call("run.step_over", {{"id", live}});
  call("run.set_variable", {{"id", live}, {"variable", "sum"}, {"value", "100"}});
  call("run.clear_breakpoint", {{"id", live}, {"number", at(b, "number")}});
  EXPECT_EQ(at(call("run.continue", {{"id", live}}), "is_complete").text(), "true");
  EXPECT_EQ(fails("run.set_breakpoint", {{"id", live}, {"line", 900}}).code,
            fails("run.set_breakpoint", {{"id", live}, {"line", 901}}).code);
}

TEST_F(ProgramLive, AnEditOfTheProgramIsTakenOverByRefresh) {
  put_counter();
  const Value live = start();
  call("run.step", {{"id", live}, {"rows", 5}});
  const Value source = call("program.source", {{"id", "count"}});
  std::string text = *source.as_string();
  text.replace(text.find("TO 5"), 4, "TO 9");
  call("program.set_file", {{"id", "count"}, {"name", "count.irl"}, {"text", text}});
  EXPECT_EQ(at(call("run.state", {{"id", live}}), "is_outdated").text(), "true");
  call("run.set_breakpoint", {{"id", live}, {"line", 8}, {"condition", "i = 9"}});
  const Value now = call("run.refresh", {{"id", live}});
  EXPECT_EQ(*at(now, "row").as_int(), 6);
  EXPECT_EQ(at(call("run.continue", {{"id", live}}), "is_stopped").text(), "true");
  EXPECT_EQ(at(call("run.continue", {{"id", live}}), "is_complete").text(), "true");
}

}  // namespace
}  // namespace robomosp
