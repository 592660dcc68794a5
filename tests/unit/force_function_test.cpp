// SPDX-License-Identifier: Apache-2.0
// Forces at tips as functions of scripts: against the same force as an expression, and against
// motions in closed form.
#include <string>

#include <gtest/gtest.h>

#include "support/lua_program.h"

namespace robomosp::lua {
namespace {

class ForceFunctions : public test::LuaProgramTest {
 protected:
  void SetUp() override {
    LuaProgramTest::SetUp();
    run("arm = robot 'irb140'\n"
        "cell = world.create{name = 'cell'}\n"
        "stance = {0, 0, 0, 0, 0.5, 0}\n"
        "cell:add_robot{robot = arm, name = 'arm', q = stance, position = {0.2, -0.1, 0.3}, rpy = "
        "{0, 0, 0.7}}\n"
        "at = arm:fk{q = stance}\n"
        "p, a = at.position, at.rpy\n"
        "trajectory.create{name = 'seam', sample_time = 0.02, segments = {{shape = 'line', points "
        "= {{p[1], p[2], p[3], a[1], a[2], a[3]}, {p[1], p[2] + 0.1, p[3], a[1], a[2], a[3]}}}}}\n"
        "cell:add_trajectory{trajectory = 'seam', position = {0.2, -0.1, 0.3}, rpy = {0, 0, 0.7}}\n"
        "run_of = function(force, axes)\n"
        "  return cell:inverse_dynamics{robot = 'arm', trajectory = 'seam', tip_force = force,\n"
        "    tip_axes = axes}\n"
        "end\n"
        "function alike(one, other, name, within)\n"
        "  for _, d in ipairs(one:compare{with = other, columns = name}) do\n"
        "    assert(d.max <= within, d.name .. ' differs by ' .. d.max)\n"
        "  end\n"
        "end\n");
  }
};

TEST_F(ForceFunctions, GiveWhatTheSameExpressionGives) {
  run("for _, axes in ipairs{'world', 'base', 'tool'} do\n"
      "  one = run_of({'-20 N * sin(2 rad/s * time)', '5 N + 100 N/m * path', 7}, axes)\n"
      "  listed = run_of(function(t, s) return {-20 * math.sin(2 * t), 5 + 100 * s, 7} end, axes)\n"
      "  plain = run_of(function(t, s) return -20 * math.sin(2 * t), 5 + 100 * s, 7 end, axes)\n"
      "  array_ = run_of(function(t, s) return array{-20 * math.sin(2 * t), 5 + 100 * s, 7} end, "
      "axes)\n"
      "  for _, other in ipairs{listed, plain, array_} do\n"
      "    alike(one, other, 'tau', 1e-9)\n"
      "    alike(one, other, 'wrench', 1e-12)\n"
      "  end\n"
      "end\n"
      "six = run_of(function(t) return {1, 2, 3, 0.1 * t, 0.2, 0.3} end, 'tool')\n"
      "same = cell:inverse_dynamics{robot = 'arm', trajectory = 'seam', tip_axes = 'tool',\n"
      "  tip_force = {1, 2, 3}, tip_moment = {'0.1 N m / 1 s * time', 0.2, 0.3}}\n"
      "alike(six, same, 'tau', 1e-9)");
}

// A rod of 0.4 m with 2 kg at its end, about the vertical: qdd = F(t) a / (m a^2), F = 0.8 t.
TEST_F(ForceFunctions, MoveARodAsItsIntegralSays) {
  run("rod = robot.create{name = 'rod', links = {{name = 'rod', a = 0.4,\n"
      "  mass = 2, com = {0, 0, 0}}}}\n"
      "push = function(t, path) assert(path == nil) return {0, 0.8 * t, 0} end\n"
      "turns = rod:simulate{duration = 1.5, tip_axes = 'tool', tip_force = push}\n"
      "q = turns:values('q1')\n"
      "assert(math.abs(q[#q] - 0.8 / (2 * 0.4) * 1.5^3 / 6) < 1e-8)\n"
      "assert(math.abs(turns:values('wrench2')[1]) < 1e-12)\n"
      "turns:compute{quantities = 'torque', tip_axes = 'tool', tip_force = function(t, path)\n"
      "  assert(path >= 0) return {0, 0.8 * t, 0} end}\n"
      "for i = 1, #q do assert(math.abs(turns:values('tau1')[i]) < 1e-8) end\n"
      // In a job, whose thread hands the call to the script that waits for it.
      "again = start('robot.simulate', {id = rod, duration = 1.5, tip_axes = 'tool',\n"
      "  tip_force = push}):wait()\n"
      "alike(turns, again, 'q', 1e-12)");
}

TEST_F(ForceFunctions, HaveAPathWhereTheRobotFollowsOne) {
  run("lengths = {}\n"
      "held = cell:simulate_dynamics{robot = 'arm', trajectory = 'seam', duration = 0.1,\n"
      "  controller = 'computed_torque', tip_force = function(t, s)\n"
      "    lengths[#lengths + 1] = s\n"
      "    return {0, 0, -10 - 100 * s}\n"
      "  end}\n"
      "assert(#lengths > 10)\n"
      "s, f = held:values('path'), held:values('wrench3')\n"
      "for i = 1, #s do assert(math.abs(f[i] + 10 + 100 * s[i]) < 1e-9) end\n"
      "assert(s[#s] > 0)");
}

TEST_F(ForceFunctions, AreProvidersUnderOneNameEach) {
  run("f = function() return {1, 0, 0} end\n"
      "count = function() local n = 0\n"
      "  for _, p in ipairs(provider.list('tip_force')) do n = n + 1 end\n"
      "  return n end\n"
      "before = count()\n"
      "run_of(f)\nrun_of(f)\n"
      "assert(count() == before + 1)\n"
      "ioci.provide('robomosp.tip_force/1', 'grind', {\n"
      "  force = function(t, s, params) return {params.strength * t, 0, 0} end,\n"
      "  params = {{name = 'strength', type = 'real', unit = 'N', default = 3}}})\n"
      "r = run_of('grind')\n"
      "assert(math.abs(r:values('wrench1')[5] - 3 * r:values('time')[5]) < 1e-12)\n"
      "r = run_of{name = 'grind', params = {strength = 8}}\n"
      "assert(math.abs(r:values('wrench1')[5] - 8 * r:values('time')[5]) < 1e-12)\n"
      // A recording is made again by the same function.
      "k = 1\n"
      "r = run_of(function() return {k, 0, 0} end)\n"
      "k = 2\n"
      "r:refresh{always = true}\n"
      "assert(r:values('wrench1')[1] == 2)");
}

TEST_F(ForceFunctions, FaultsNameTheFunctionAndTheTime) {
  const auto expect = [&](const std::string& function, std::string_view with) {
    const std::string said = eval("run_of(" + function + ")");
    EXPECT_NE(said.find(with), std::string::npos) << said;
  };
  expect("function(t) return 1, 2 end", "the force has 2 numbers");
  expect("function(t) return {} end", "the force has 0 numbers");
  expect("function(t) return {1, 2, 0 / 0} end", "not a number at t = 0 s");
  expect("function(t) return {1, 2, 1e300} end", "1e+300 is not a usable force");
  expect("function(t) return {1, 2, 'x'} end", "entry [3] that is not a number");
  expect("function(t) if t > 0.05 then error('the spindle broke') end return {1, 2, 3} end",
         "the spindle broke");
  expect("function(t) if t > 0.05 then error('the spindle broke') end return {1, 2, 3} end",
         "t = 0.06 s");
  expect("'grindd'", "tip_force");
  const std::string moment = eval(
      "cell:inverse_dynamics{robot = 'arm', trajectory = 'seam', "
      "tip_moment = function() return {1, 2, 3} end}");
  EXPECT_NE(moment.find("Give it as tip_force"), std::string::npos) << moment;
  const std::string fast = eval(
      "cell:time_optimal{robot = 'arm', trajectory = 'seam', "
      "tip_force = function() return {1, 2, 3} end}");
  EXPECT_NE(fast.find("a force over time"), std::string::npos) << fast;
  const std::string elsewhere = eval("arm:fk{q = function() end}");
  EXPECT_NE(elsewhere.find("a function cannot be given to a command"), std::string::npos)
      << elsewhere;
}

}  // namespace
}  // namespace robomosp::lua
