// SPDX-License-Identifier: Apache-2.0
// Programs that take parts from a belt which a task, or another program, drives at the same time.
#include <algorithm>
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

/// A belt along -y past a UR5, with a part at its beginning and one 0.3 m behind it. The program
/// takes the first where the belt has stopped and the second as it passes, and puts both on a tray.
class Belts : public ProgramRun {
 protected:
  static constexpr double kSpeed = 0.1, kAcceleration = 1;  ///< of the belt
  static constexpr double kBelt = 0.3;                      ///< y of its beginning
  static constexpr double kPitch = 0.3;
  void SetUp() override {
    ProgramRun::SetUp();
    call("robot.create", {{"name", "belt"},
                          {"links", List{Map{{"name", "cloth"},
                                             {"joint", "prismatic"},
                                             {"origin", List{0.0, 0.0, 0.0}},
                                             {"axis", List{0.0, -1.0, 0.0}},
                                             {"lower", -0.1},
                                             {"upper", 2.0},
                                             {"max_velocity", kSpeed},
                                             {"max_acceleration", kAcceleration}}}}});
    call("world.add_robot",
         {{"id", cell_}, {"robot", "belt"}, {"name", "belt"}, {"position", List{0.5, kBelt, 0.1}}});
    call("solid.create", {{"name", "block"},
                          {"root", Map{{"kind", "box"}, {"x", 0.04}, {"y", 0.04}, {"z", 0.04}}}});
    for (int i = 0; i < 2; ++i) {
      const std::string part = "part" + std::to_string(i + 1);
      call("world.add_object", {{"id", cell_},
                                {"what", "block"},
                                {"name", part},
                                {"position", List{0.5, kBelt + i * kPitch, 0.1}}});
      call("world.attach", {{"id", cell_},
                            {"object", part},
                            {"robot", "belt"},
                            {"link", "cloth"},
                            {"position", List{0.0, i * kPitch, 0.0}}});
    }
    for (const char* signal : {"ready", "taken", "passes"})
      call("world.add_signal", {{"id", cell_}, {"name", signal}});
    const Value pick =
        call("program.create", {{"name", "pick"},
                                {"source",
                                 "PROGRAM pick;\n"
                                 "SIGNAL\n"
                                 "  INPUT BOOL: ready AT 1; INPUT BOOL: passes AT 2;\n"
                                 "  OUTPUT BOOL: taken AT 1; OUTPUT BOOL: gripper AT 2;\n"
                                 "VAR " +
                                     std::string(kDown) +
                                     "PROCEDURE lay (IN REAL: x);\n"
                                     "BEGIN\n"
                                     "  MOVE PTP POSE(POSITION(x, -400.0, 250.0), down);\n"
                                     "  MOVE LIN POSITION(x, -400.0, 200.0) SPEED := 100.0;\n"
                                     "  gripper := FALSE;\n"
                                     "  MOVE LIN POSITION(x, -400.0, 250.0);\n"
                                     "ENDPROC;\n"
                                     "PROCESS shut;\n"
                                     "BEGIN\n"
                                     "  WAIT 0.2 SEC;\n"
                                     "  gripper := TRUE;\n"
                                     "ENDPROCESS;\n"
                                     "BEGIN\n"
                                     "  MOVE PTP POSE(POSITION(500.0, 0.0, 200.0), down);\n"
                                     "  WAIT FOR ready;\n"
                                     "  MOVE LIN POSITION(500.0, 0.0, 142.0) SPEED := 100.0;\n"
                                     "  gripper := TRUE;\n"
                                     "  MOVE LIN POSITION(500.0, 0.0, 250.0);\n"
                                     "  lay(400.0);\n"
                                     "  MOVE PTP POSE(POSITION(500.0, 0.0, 250.0), down);\n"
                                     "  MOVE LIN POSITION(500.0, 0.0, 142.0);\n"
                                     "  taken := TRUE;\n"
                                     "  WAIT FOR passes;\n"
                                     "  START shut;\n"
                                     "  MOVE LIN POSITION(500.0, -60.0, 142.0) SPEED := 100.0;\n"
                                     "  MOVE LIN POSITION(500.0, -60.0, 250.0);\n"
                                     "  lay(300.0);\n"
                                     "ENDPROGRAM;\n"}});
    call("world.add_program", {{"id", cell_}, {"program", pick}, {"robot", "ur5"}});
    // The tool is as fast as the belt when it has come v^2 / 2a, and the part twice as far.
    call("task.create",
         {{"name", "barrier"},
          {"steps", List{Map{{"step", "wait"}, {"condition", "part2.y <= 2 mm"}},
                         Map{{"step", "set"}, {"signal", "passes"}, {"value", 1}}}}});
    call("world.add_task", {{"id", cell_}, {"task", "barrier"}});
  }
  void drive_by_task() {
    call("task.create",
         {{"name", "feed"},
          {"steps",
           List{Map{{"step", "move"}, {"joints", List{kBelt}}, {"profile", "trapezoidal"}},
                Map{{"step", "set"}, {"signal", "ready"}, {"value", 1}},
                Map{{"step", "wait"}, {"condition", "taken == 1"}},
                Map{{"step", "move"}, {"joints", List{0.8}}, {"profile", "trapezoidal"}}}}});
    call("world.add_task", {{"id", cell_}, {"task", "feed"}, {"robot", "belt"}});
  }
  void drive_by_program() {
    const Value feed =
        call("program.create", {{"name", "feed"},
                                {"source",
                                 "PROGRAM feed;\nSYSTEM_SPECIFICATION 'belt.ssi';\n"
                                 "SIGNAL OUTPUT BOOL: ready AT 1; INPUT BOOL: taken AT 1;\n"
                                 "BEGIN\n"
                                 "  MOVE PTP MAIN_JOINT(300.0) SPEED_PTP := 100.0;\n"
                                 "  ready := TRUE;\n"
                                 "  WAIT FOR taken;\n"
                                 "  MOVE PTP MAIN_JOINT(800.0) SPEED_PTP := 100.0;\n"
                                 "ENDPROGRAM;\n"}});
    call("program.set_file",
         {{"id", feed},
          {"name", "belt.ssi"},
          {"text",
           "PROGRAM belt;\nCONST INT: R_NTURNS := 1, R_NADDJ := 1, R_NJ := 2, R_DEVICE_NUMBER := "
           "1;\n"
           "TYPE\nRECORD REAL: A1; ENDRECORD: MAIN_JOINT;\nRECORD REAL: AA1; ENDRECORD: "
           "ADD_JOINT;\n"
           "RECORD MAIN_JOINT: M_JOINT; ADD_JOINT: A_JOINT; ENDRECORD: JOINT;\n"
           "RECORD POSE: PSE; INT: STATUS; ARRAY [1..R_NTURNS] OF INT: TURNS; ADD_JOINT: A_JOINT; "
           "ENDRECORD: ROBTARGET;\nENDPROGRAM;\n"}});
    call("world.add_program", {{"id", cell_}, {"program", feed}, {"robot", "belt"}});
  }
  /// When the part changed hands; NAN = it did not.
  static double told(const RecordingPtr& r, const std::string& what) {
    for (const std::string& n : r->notes)
      if (n.find(what) != std::string::npos) return std::stod(n.substr(4));
    return NAN;
  }
  static double at_time(const RecordingPtr& r, const std::string& name, double t) {
    const auto &times = column(r, "time"), &v = column(r, name);
    const auto i =
        static_cast<std::size_t>(std::lower_bound(times.begin(), times.end(), t) - times.begin());
    if (i == 0 || i >= times.size()) return v[std::min(i, v.size() - 1)];
    const double u = (t - times[i - 1]) / (times[i] - times[i - 1]);
    return v[i - 1] + u * (v[i] - v[i - 1]);
  }
  /// How far a belt has come that starts at rest, t after it did, before it brakes.
  static double run_up(double t) {
    const double rise = kSpeed / kAcceleration;
    return t < rise ? kAcceleration * t * t / 2 : kSpeed * (t - rise / 2);
  }
  void expect_carried(const RecordingPtr& r) {
    const double first = told(r, "ur5 takes part1"), second = told(r, "ur5 takes part2");
    ASSERT_TRUE(std::isfinite(first) && std::isfinite(second));
    // It moves with the belt until it is taken, however the belt is driven.
    for (const double t : {0.05, 0.5, 1.7, 2.9})
      EXPECT_NEAR(at_time(r, "part1.y", t), kBelt - run_up(t), 1e-4) << t;
    EXPECT_NEAR(this->first(r, "signal.ready", 1), kBelt / kSpeed + kSpeed / kAcceleration, 0.0051);
    EXPECT_NEAR(at_time(r, "part1.y", first), 0, 1e-9);
    const double started = this->first(r, "signal.taken", 1);
    const double passes = (kPitch - 0.002) / kSpeed + kSpeed / kAcceleration / 2;
    EXPECT_NEAR(this->first(r, "signal.passes", 1) - started, passes, 0.0101);
    // It is taken 0.2 s later, while both move as fast and the tool is above its middle.
    const double where = 0.002 - 0.2 * kSpeed;
    EXPECT_NEAR(at_time(r, "part2.y", second), where, 1e-4);
    for (const double before : {0.1, 0.05, 0.01, -0.01, -0.05, -0.1}) {
      const double t = second - before, h = 0.01;
      EXPECT_NEAR((at_time(r, "part2.y", t + h) - at_time(r, "part2.y", t - h)) / (2 * h), -kSpeed,
                  2e-3)
          << before;
    }
    EXPECT_NEAR(at_time(r, "belt.qd1", second), kSpeed, 1e-9);
    // On the tray both lie as they were taken: under the middle of the tool.
    for (const auto& [part, x] : {std::pair("part1", 0.4), std::pair("part2", 0.3)}) {
      EXPECT_NEAR(column(r, std::string(part) + ".x").back(), x, 2e-5) << part;
      EXPECT_NEAR(column(r, std::string(part) + ".y").back(), -0.4, 2e-5) << part;
      EXPECT_NEAR(column(r, std::string(part) + ".z").back(), 0.2 - 0.042, 2e-5) << part;
    }
    EXPECT_NEAR(column(r, "belt.q1").back(), 0.8, 1e-9);
  }
  /// How many targets are solved at once depends on the steps, and the last digit on that where
  /// lanes and single numbers are rounded differently (ROBOMOSP_SIMD=baseline).
  static void expect_near(const recording::Column& c, const RecordingPtr& r) {
    const auto other = column(r, c.name);
    ASSERT_EQ(c.values.size(), other.size()) << c.name;
    for (std::size_t i = 0; i < other.size(); ++i)
      ASSERT_NEAR(c.values[i], other[i], 1e-11 * (1 + std::fabs(other[i])))
          << c.name << ", row " << i;
  }
  void expect_repeated(const RecordingPtr& r) {
    const Map with{{"sample_time", 0.005}};
    const RecordingPtr again = run(with);
    const Value live = call("world.start_run", {{"id", cell_}, {"of", "tasks"}, {"with", with}});
    for (int i = 0; i < 20; ++i) call("run.step", {{"id", live}, {"rows", 7}});
    call("run.finish", {{"id", live}});
    const Value made = call("run.recording", {{"id", live}});
    const RecordingPtr stepped = app().recordings.find(made.as_handle()->number);
    ASSERT_TRUE(again && stepped);
    for (const auto& c : r->columns) {
      EXPECT_EQ(c.values, column(again, c.name)) << c.name;
      expect_near(c, stepped);
    }
    EXPECT_EQ(r->notes, again->notes);
    EXPECT_EQ(r->notes, stepped->notes);
  }
};

TEST_F(Belts, PartsOfABeltThatATaskDrivesAreTakenAtRestAndInMotion) {
  drive_by_task();
  const RecordingPtr r = run({{"sample_time", 0.005}});
  ASSERT_TRUE(r);
  expect_carried(r);
  expect_repeated(r);
}

TEST_F(Belts, PartsOfABeltThatAnotherProgramDrivesAreTakenAtRestAndInMotion) {
  drive_by_program();
  const RecordingPtr r = run({{"sample_time", 0.005}});
  ASSERT_TRUE(r);
  expect_carried(r);
  expect_repeated(r);
}

TEST_F(Belts, ALiveRunGoesOnWhileAPartIsHeldAndTheBeltRuns) {
  drive_by_task();
  const Map with{{"sample_time", 0.005}};
  const RecordingPtr whole = run(with);
  ASSERT_TRUE(whole);
  const Value live = call("world.start_run", {{"id", cell_}, {"of", "tasks"}, {"with", with}});
  const auto steps = static_cast<std::int64_t>(told(whole, "ur5 takes part2") / 0.005) + 3;
  call("run.step", {{"id", live}, {"rows", steps}});
  call("run.refresh", {{"id", live}});
  call("run.finish", {{"id", live}});
  const Value made = call("run.recording", {{"id", live}});
  const RecordingPtr gone_on = app().recordings.find(made.as_handle()->number);
  for (const auto& c : whole->columns) expect_near(c, gone_on);
}

TEST_F(Belts, ContactPhysicsMovesEachRobotAlongItsColumnsOfTheRun) {
  drive_by_program();
  const Value made = call("world.run_task", {{"id", cell_}, {"sample_time", 0.005}});
  const RecordingPtr r = app().recordings.find(made.as_handle()->number);
  ASSERT_TRUE(r);
  List actions;
  for (const char* robot : {"ur5", "belt"})
    actions.emplace_back(
        Map{{"action", "move"}, {"robot", robot}, {"recording", made}, {"time", 0.0}});
  const Value moved =
      call("world.simulate_physics", {{"id", cell_}, {"actions", actions}, {"sample_time", 0.05}});
  ASSERT_TRUE(moved.as_handle());
  const RecordingPtr physics = app().recordings.find(moved.as_handle()->number);
  const auto& times = column(physics, "time");
  ASSERT_GT(times.size(), 100U);
  for (std::size_t i = 0; i < times.size(); ++i) {
    for (const std::string q : {"q1", "q2", "q3", "q4", "q5", "q6"})
      EXPECT_NEAR(column(physics, q)[i], at_time(r, "ur5." + q, times[i]), 1e-9) << times[i];
    EXPECT_NEAR(column(physics, "belt.q1")[i], at_time(r, "belt.q1", times[i]), 1e-9) << times[i];
  }
}

}  // namespace
}  // namespace robomosp
