// SPDX-License-Identifier: Apache-2.0
// Contact physics on the clock of tasks and programs: what falls, slides and is pushed is seen by
// conditions, grips and frames while the run goes on.
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

constexpr double kGravity = 9.80665, kTop = 0.1;  ///< of the desk [m]

/// A UR5 before a desk, and a wooden block of 40 mm.
class ProgramPhysics : public ProgramRun {
 protected:
  void SetUp() override {
    ProgramRun::SetUp();
    call("material.create", {{"name", "beech"}, {"density", 700.0}});
    call("solid.create",
         {{"name", "desk"}, {"root", Map{{"kind", "box"}, {"x", 0.6}, {"y", 1.0}, {"z", 0.02}}}});
    call("solid.create", {{"name", "block"},
                          {"material", "beech"},
                          {"root", Map{{"kind", "box"}, {"x", 0.04}, {"y", 0.04}, {"z", 0.04}}}});
    add("desk", 0.5, 0, kTop - 0.02);
  }
  void add(const std::string& what, double x, double y, double z) {
    call("world.add_object",
         {{"id", cell_}, {"what", what}, {"name", what}, {"position", List{x, y, z}}});
  }
  void add_task(const std::string& name, List steps) {
    call("task.create", {{"name", name}, {"steps", std::move(steps)}});
    call("world.add_task", {{"id", cell_}, {"task", name}});
  }
  static Map physics(Map more = {}) {
    more.set("objects", List{Map{{"name", "desk"}, {"fixed", true}}});
    return more;
  }
  /// The instant that a note tells; NAN = nobody does.
  static double told(const RecordingPtr& r, const std::string& what) {
    for (const std::string& n : r->notes)
      if (n.find(what) != std::string::npos) return std::stod(n.substr(4));
    return NAN;
  }
  void put_carry() {
    call("world.add_signal", {{"id", cell_}, {"name", "landed"}});
    const Value carry = put(
        "carry",
        "  WAIT FOR landed;\n"
        "  MOVE PTP POSE(POSITION(500.0, -200.0, 250.0), down);\n"
        "  MOVE LIN POSITION(500.0, -200.0, 142.0) SPEED := 100.0;\n"
        "  gripper := TRUE;\n"
        "  MOVE LIN POSITION(500.0, -200.0, 250.0);\n"
        "  MOVE LIN POSITION(500.0, 200.0, 250.0);\n"
        "  MOVE LIN POSITION(500.0, 200.0, 192.0) SPEED := 100.0;\n"
        "  gripper := FALSE;\n"
        "  WAIT 0.5 SEC;\n",
        "SIGNAL OUTPUT BOOL: gripper AT 1; INPUT BOOL: landed AT 1;\nVAR " + std::string(kDown));
    call("program.bind", {{"id", carry}, {"kind", "grip"}, {"name", "gripper"}, {"to", "block"}});
    add_task("watch", List{Map{{"step", "wait"}, {"condition", "block.z <= 100.1 mm"}},
                           Map{{"step", "set"}, {"signal", "landed"}, {"value", 1}}});
  }
};

TEST_F(ProgramPhysics, AConditionSeesAFallingBlockAtTheInstantOfFreeFall) {
  add("block", 0.5, -0.2, 0.5);
  call("world.add_signal", {{"id", cell_}, {"name", "low"}});
  add_task("watch",
           List{Map{{"step", "wait"}, {"condition", "block.z < 300 mm"}},
                Map{{"step", "set"}, {"signal", "low"}, {"value", 1}},
                Map{{"step", "message"}, {"text", "low"}}, Map{{"step", "wait"}, {"time", 0.5}}});
  const RecordingPtr r = run({{"physics", physics()}});
  ASSERT_TRUE(r);
  // Steps of 1 ms by semi-implicit Euler are ahead of t by half a step.
  EXPECT_NEAR(told(r, "low"), std::sqrt(2 * 0.2 / kGravity), 0.6e-3);
  // The same engine without tasks has the same rows, to the last bit.
  const Value alone =
      call("world.simulate_physics", {{"id", cell_},
                                      {"duration", 0.7},
                                      {"sample_time", 0.02},
                                      {"objects", List{Map{{"name", "desk"}, {"fixed", true}}}}});
  ASSERT_TRUE(alone.as_handle());
  const RecordingPtr without = app().recordings.find(alone.as_handle()->number);
  for (const char* name : {"block.x", "block.y", "block.z"}) {
    const auto &a = column(r, name), &b = column(without, name);
    ASSERT_GT(a.size(), 30U);
    ASSERT_GT(b.size(), 30U);
    for (std::size_t i = 0; i < 30; ++i) EXPECT_EQ(a[i], b[i]) << name << " " << i;
  }
  EXPECT_NEAR(column(r, "block.z").back(), kTop, 1e-4);
}

TEST_F(ProgramPhysics, WhatAProgramLetsGoFallsOntoTheDeskAndStaysInTheAirWithout) {
  add("block", 0.5, -0.2, 0.12);
  put_carry();
  const RecordingPtr r = run({{"physics", physics()}});
  ASSERT_TRUE(r);
  EXPECT_NEAR(told(r, "ur5 takes block") > 0 ? first(r, "signal.landed", 1) : NAN,
              std::sqrt(2 * 0.0199 / kGravity), 0.021);
  EXPECT_NEAR(column(r, "block.y").back(), 0.2, 1e-4);
  EXPECT_NEAR(column(r, "block.z").back(), kTop, 1e-4);
  // While it is held it is where the tool is.
  const double taken = told(r, "ur5 takes block"), free = told(r, "block is let go");
  const auto &t = column(r, "time"), &z = column(r, "block.z");
  const auto ways = tool(r);
  for (std::size_t i = 0; i < t.size(); ++i)
    if (t[i] > taken && t[i] < free) {
      EXPECT_NEAR(z[i], ways[i][2] - 0.042, 2e-4) << t[i];
    }
  // It falls from 50 mm above the desk for 0.1 s.
  const double fall = std::sqrt(2 * 0.05 / kGravity);
  for (std::size_t i = 0; i < t.size(); ++i)
    if (t[i] > free && t[i] < free + fall - 0.001) {
      const double fallen = kGravity * (t[i] - free) * (t[i] - free) / 2;
      EXPECT_NEAR(z[i], kTop + 0.05 - fallen, 1.2e-3) << t[i];
    }
  // Without physics nothing lands, and what is waited for never comes.
  EXPECT_NE(fault().find("can never come true"), std::string::npos) << fault();
}

TEST_F(ProgramPhysics, LiveRunsStepAndGoOnToTheSameBits) {
  add("block", 0.5, -0.2, 0.12);
  put_carry();
  const Map with{{"physics", physics()}};
  const RecordingPtr whole = run(with), again = run(with);
  const Value live = call("world.start_run", {{"id", cell_}, {"of", "tasks"}, {"with", with}});
  call("run.step", {{"id", live}, {"rows", 100}});
  call("run.refresh", {{"id", live}});
  call("run.finish", {{"id", live}});
  const Value made = call("run.recording", {{"id", live}});
  const RecordingPtr stepped = app().recordings.find(made.as_handle()->number);
  ASSERT_TRUE(whole && again && stepped);
  for (const auto& c : whole->columns) {
    EXPECT_EQ(c.values, column(again, c.name)) << c.name;
    EXPECT_EQ(c.values, column(stepped, c.name)) << c.name;
  }
}

TEST_F(ProgramPhysics, ARobotPushesABlockIntoALightBarrierThatStopsItsMotion) {
  add("block", 0.5, -0.2, kTop);
  // A plate without mass in the tool, which the robot takes along.
  call("solid.create",
       {{"name", "plate"}, {"root", Map{{"kind", "box"}, {"x", 0.1}, {"y", 0.01}, {"z", 0.1}}}});
  add("plate", 1, 1, 1);
  call("world.attach",
       {{"id", cell_}, {"object", "plate"}, {"robot", "ur5"}, {"position", List{0.0, 0.0, 0.0}}});
  call("world.add_signal", {{"id", cell_}, {"name", "barrier"}});
  put("push",
      "  MOVE PTP POSE(POSITION(500.0, -300.0, 400.0), down);\n"
      "  MOVE LIN POSITION(500.0, -300.0, 210.0) SPEED := 200.0;\n"
      "  MOVE LIN POSITION(500.0, 200.0, 210.0) SPEED := 50.0 ACC := 0.5 UNTIL barrier;\n"
      "  WAIT 0.5 SEC;\n",
      "SIGNAL INPUT BOOL: barrier AT 1;\nVAR " + std::string(kDown));
  add_task("eye", List{Map{{"step", "wait"}, {"condition", "block.y > 0 m"}},
                       Map{{"step", "set"}, {"signal", "barrier"}, {"value", 1}},
                       Map{{"step", "message"}, {"text", "seen"}}});
  const RecordingPtr r = run({{"physics", physics()}, {"sample_time", 0.005}, {"most_time", 60.0}});
  ASSERT_TRUE(r);
  EXPECT_TRUE(has_note(r, "\"ur5\" holds \"plate\" from the start"));
  const double seen = told(r, "seen");
  ASSERT_TRUE(std::isfinite(seen));
  const auto &t = column(r, "time"), &y = column(r, "block.y"), &plate = column(r, "plate.y");
  // From where the plate meets it, it goes before the plate at its speed.
  for (std::size_t i = 0; i < t.size(); ++i) {
    if (t[i] > seen - 2 && t[i] < seen) {
      EXPECT_NEAR(y[i] - plate[i], 0.02 + 0.005, 1e-3) << t[i];
      EXPECT_NEAR(y[i], 0.05 * (t[i] - seen), 1e-3) << t[i];
    }
  }
  // It stops where the robot has stopped.
  EXPECT_GT(y.back(), 0);
  EXPECT_LT(y.back(), 0.03);
  EXPECT_NEAR(column(r, "block.z").back(), kTop, 1e-4);
}

TEST_F(ProgramPhysics, WhatIsHeldAgainstSomethingIsSaidToBeElsewhere) {
  add("block", 0.5, -0.2, kTop);
  const Value press = put("press",
                          "  MOVE PTP POSE(POSITION(500.0, -200.0, 250.0), down);\n"
                          "  MOVE LIN POSITION(500.0, -200.0, 142.0) SPEED := 100.0;\n"
                          "  gripper := TRUE;\n"
                          "  MOVE LIN POSITION(500.0, -200.0, 132.0) SPEED := 20.0;\n"
                          "  gripper := FALSE;\n"
                          "  WAIT 0.5 SEC;\n",
                          "SIGNAL OUTPUT BOOL: gripper AT 1;\nVAR " + std::string(kDown));
  call("program.bind", {{"id", press}, {"kind", "grip"}, {"name", "gripper"}, {"to", "block"}});
  const RecordingPtr r = run({{"physics", physics()}});
  ASSERT_TRUE(r);
  EXPECT_TRUE(has_note(r, "mm from its held position: it hit something"));
}

TEST_F(ProgramPhysics, WithoutTasksWhatIsHeldAtTheStartIsHeldUntilItIsReleased) {
  add("block", 1, 1, 1);
  call("world.attach",
       {{"id", cell_}, {"object", "block"}, {"robot", "ur5"}, {"position", List{0.0, 0.0, 0.02}}});
  const Value made =
      call("world.simulate_physics",
           {{"id", cell_},
            {"duration", 0.4},
            {"actions", List{Map{{"action", "release"}, {"object", "block"}, {"time", 0.2}}}}});
  ASSERT_TRUE(made.as_handle());
  const RecordingPtr r = app().recordings.find(made.as_handle()->number);
  EXPECT_TRUE(has_note(r, "\"ur5\" holds \"block\" from the start"));
  const auto &t = column(r, "time"), &z = column(r, "block.z");
  EXPECT_LT(column(r, "block.x")[0], 0.95);  // not where it was placed
  const double lands = 0.2 + std::sqrt(2 * (z[0] - (kTop + 0.04)) / kGravity);  // upside down
  for (std::size_t i = 0; i < t.size(); ++i)
    if (t[i] < lands - 0.001) {
      const double fallen = kGravity * std::pow(std::max(0.0, t[i] - 0.2), 2) / 2;
      EXPECT_NEAR(z[i], z[0] - fallen, 1.2e-3) << t[i];
    }
  EXPECT_GT(z[0], kTop + 0.05);
}

TEST_F(ProgramPhysics, WrongInputsGetASentence) {
  add("block", 0.5, -0.2, kTop);
  add_task("rest", List{Map{{"step", "wait"}, {"time", 0.1}}});
  EXPECT_NE(fault({{"physics", 3}}).find("physics: 3 is not bool or "), std::string::npos);
  EXPECT_NE(fault({{"physics", Map{{"friction", -1.0}}}}).find("friction"), std::string::npos);
  EXPECT_NE(fault({{"physics", Map{{"step", NAN}}}}).find("step"), std::string::npos);
  EXPECT_NE(fault({{"physics", Map{{"engine", "odd"}}}}).find("\"ode\""), std::string::npos);
  EXPECT_NE(fault({{"physics", Map{{"objects", List{Map{{"name", "blok"}}}}}}})
                .find("Did you mean \"block\"?"),
            std::string::npos);
  for (const double step : {1e-300, 1e-8})
    EXPECT_NE(fault({{"physics", Map{{"step", step}}}}).find("too short for rows of 0.02 s"),
              std::string::npos);
  // Steps that do not fit the rows are made shorter.
  EXPECT_TRUE(run({{"physics", Map{{"step", 0.0007}}}}));
  EXPECT_TRUE(run({{"physics", Map{{"step", 1e6}}}}));
  EXPECT_TRUE(run({{"physics", false}}));
  EXPECT_FALSE(has_note(run({{"physics", true}}), "physics moves nothing"));
  call("world.remove_member", {{"id", cell_}, {"member", "block"}});
  EXPECT_TRUE(has_note(run({{"physics", true}}), "physics moves nothing"));
}

}  // namespace
}  // namespace robomosp
