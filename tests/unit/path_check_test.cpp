// SPDX-License-Identifier: Apache-2.0
// Places of a trajectory that a robot cannot follow: a lift of one joint whose way is the height of
// the line, so that every number is known.
#include <string>

#include <gtest/gtest.h>

#include "support/lua_program.h"

namespace robomosp::lua {
namespace {

class PathCheck : public test::LuaProgramTest {
 protected:
  void SetUp() override {
    LuaProgramTest::SetUp();
    // 41 samples, 50 mm apart.
    run("lift = robot.create{name = 'lift', links = {{name = 'rail', joint = 'prismatic', lower = "
        "0, upper = 1}}}\n"
        "cell = world.create{name = 'cell'}\n"
        "cell:add_robot{robot = lift, name = 'lift'}\n"
        "trajectory.create{name = 'up', sample_time = 0.1, segments = {{shape = 'line', points = "
        "{{0, 0, 0, 0, 0, 0}, {0, 0, 2, 0, 0, 0}}, speed = 0.5}}}\n"
        "cell:add_trajectory{trajectory = 'up'}\n"
        "function check(more)\n"
        "  local args = {robot = 'lift', trajectory = 'up'}\n"
        "  for k, v in pairs(more or {}) do args[k] = v end\n"
        "  return cell:check(args)\n"
        "end");
  }
};

TEST_F(PathCheck, WhatIsOutOfReachIsToldByItsWorstSample) {
  run("c = check() f = c.faults[1]\n"
      "assert(not c.is_good and #c.faults == 1 and c.samples == 41)\n"
      "assert(math.abs(c.duration - 4) < 1e-12)\n"
      "assert(f.kind == 'unreachable' and f.first == 22 and f.last == 41 and f.sample == 41)\n"
      "assert(math.abs(f.from - 2.1) < 1e-9 and math.abs(f.time - 4) < 1e-9)\n"
      "assert(math.abs(f.share - 1) < 1e-12 and math.abs(f.position[3] - 2) < 1e-9)\n"
      "assert(math.abs(f.excess - 1) < 1e-6 and f.unit == 'm')\n"
      "assert(math.abs(f.q[1] - 1) < 1e-6)");
  EXPECT_NE(eval("f.text").find("sample 41 of 41 (t = 4 s): "), std::string::npos);
}

TEST_F(PathCheck, AWayOutAndBackIsTwoFaultsWhereItIsLeftTwice) {
  run("trajectory.create{name = 'twice', sample_time = 0.1, segments = {\n"
      "  {shape = 'line', points = {{0, 0, 0.5, 0, 0, 0}, {0, 0, 1.2, 0, 0, 0}}, speed = 0.5},\n"
      "  {shape = 'line', points = {{0, 0, 1.2, 0, 0, 0}, {0, 0, -0.2, 0, 0, 0}}, speed = 0.5,\n"
      "   transition = 'none'}}}\n"
      "cell:add_trajectory{trajectory = 'twice'}\n"
      "c = check{trajectory = 'twice'} a, b = c.faults[1], c.faults[2]\n"
      "assert(#c.faults == 2 and a.last < b.first)\n"
      "assert(math.abs(a.position[3] - 1.2) < 1e-9 and math.abs(a.excess - 0.2) < 1e-6)\n"
      "assert(math.abs(b.position[3] + 0.2) < 1e-9 and math.abs(b.excess - 0.2) < 1e-6)");
}

TEST_F(PathCheck, LimitsAreToldWhereTheyBreakAndByHowMuch) {
  run("lift:set_link{link = 'rail', upper = 3, max_velocity = 0.4}\n"
      "c = check() f = c.faults[1]\n"
      "assert(#c.faults == 1 and f.kind == 'limit' and f.joint == 1)\n"
      "assert(f.first == 1 and f.last == 41 and math.abs(f.excess - 0.1) < 1e-9)\n"
      "assert(f.unit == 'm/s')");
  EXPECT_NE(eval("f.why").find("joint 1 (rail) exceeds its velocity limit of 0.4 m/s by 0.1 m/s"),
            std::string::npos)
      << eval("f.why");
  run("lift:set_link{link = 'rail', max_velocity = 0.5}\n"
      "c = check() assert(c.is_good and #c.faults == 0)");
}

// The carriage, a cube of 0.1 m, stands at 0.8 m, where a beam from 0.85 m on goes 50 mm into it;
// the way from 0 to 0.5 m is free.
TEST_F(PathCheck, AStartInContactIsAFaultBeforeTheWay) {
  run("solid.create{name = 'cube', root = {kind = 'box', x = 0.1, y = 0.1, z = 0.1}}\n"
      "solid.create{name = 'beam', root = {kind = 'box', x = 1, y = 1, z = 0.1}}\n"
      "lift:set_link{link = 'rail', parts = {{what = 'cube'}}}\n"
      "cell:add_object{what = 'beam', name = 'beam', position = {0, 0, 0.85}}\n"
      "trajectory.create{name = 'low', sample_time = 0.1, segments = {{shape = 'line', points = "
      "{{0, 0, 0, 0, 0, 0}, {0, 0, 0.5, 0, 0, 0}}, speed = 0.5}}}\n"
      "cell:add_trajectory{trajectory = 'low'}\n"
      "cell:set_robot_q{robot = 'lift', q = {0.8}}\n"
      "c = check{trajectory = 'low'} f = c.faults[1]\n"
      "assert(not c.is_good and #c.faults == 1 and f.kind == 'start', c.faults)\n"
      "assert(math.abs(f.excess - 0.05) < 1e-6 and f.unit == 'm' and f.q[1] == 0.8)\n"
      "assert(f.a == 'beam' and f.b == 'lift.rail' or f.b == 'beam' and f.a == 'lift.rail')");
  EXPECT_NE(eval("f.text").find("at the robot's present joint values, before it begins: "), std::string::npos)
      << eval("f.text");
  run("assert(check{trajectory = 'low', collisions = false}.is_good)\n"
      "cell:set_robot_q{robot = 'lift', q = {0.7}}\n"
      "assert(check{trajectory = 'low'}.is_good)");
}

TEST_F(PathCheck, TheUnknownIsRefusedByName) {
  EXPECT_NE(eval("check{robot = 'lfit'}").find("robot \"lfit\""), std::string::npos);
  EXPECT_NE(eval("check{file = 'a.gif'}").find(".png"), std::string::npos);
}

}  // namespace
}  // namespace robomosp::lua
