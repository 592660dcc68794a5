// SPDX-License-Identifier: Apache-2.0
// Motions planned around the obstacles of a world: free, within limits, the same for a seed, and
// refused in a sentence.
#include <cmath>
#include <memory>
#include <string>

#include <gtest/gtest.h>

#include "ioci/commands.h"
#include "lua/lua_state.h"
#include "support/program.h"

namespace robomosp::lua {
namespace {

class PlanPath : public test::ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    state_ = std::make_unique<LuaState>(app(), session_, LuaOptions{});
    run(R"~(
-- Two rods of 0.5 m in the x-y plane, and a ball out on the x axis: both ends are free.
arm = robot.create{name = "rods", convention = "dh", links = {
  {a = 0.5, lower = -3, upper = 3, max_velocity = 1, max_acceleration = 2},
  {a = 0.5, lower = -3, upper = 3, max_velocity = 1, max_acceleration = 2}},
  poses = {left = {0.8, 0}, right = {-0.8, 0}}}
ball = solid.create{name = "ball", root = {kind = "sphere", radius = 0.1}}
cell = world.create{name = "cell"}
cell:add_robot{robot = arm, q = "left"}
cell:add_object{what = ball, position = {0.8, 0, 0}}
)~");
  }
  void run(const std::string& code) {
    auto r = state_->eval(code);
    EXPECT_TRUE(r.ok()) << (r.ok() ? "" : r.error().sentence());
  }
  std::string refused(const std::string& arguments) {
    auto r = state_->eval("cell:plan_path{" + arguments + "}");
    EXPECT_FALSE(r.ok()) << arguments;
    return r.ok() ? "" : r.error().sentence();
  }
  ioci::Session session_{"test"};
  std::unique_ptr<LuaState> state_;
};

TEST_F(PlanPath, TheMotionIsFreeSmoothAndWithinLimits) {
  run(R"~(
assert(not cell:check_path{path = {"left", "right"}}.is_free)
for _, planner in ipairs{"rrt_connect", "prm", {name = "bit_star", params = {checks = 300}}} do
  local way = cell:plan_path{robot = "rods", to = "right", planner = planner, seconds = 100}
  local r = way.recording
  assert(cell:check_path{recording = r}.is_free)
  assert(way.length <= way.found_length + 1e-12 and #way.waypoints >= 3)
  local t = r:values("time")
  assert(t[#t] == way.duration)
  for j, last in ipairs{-0.8, 0} do
    local q, qd, qdd = r:values("q" .. j), r:values("qd" .. j), r:values("qdd" .. j)
    assert(q[1] == (j == 1 and 0.8 or 0) and math.abs(q[#q] - last) < 1e-9)
    assert(math.abs(qd[1]) < 1e-9 and math.abs(qd[#qd]) < 1e-9)
    for i = 1, #q do
      assert(math.abs(qd[i]) <= 1.001 and math.abs(qdd[i]) <= 2 * 1.02)
      if i > 1 then  -- positions are the integral of velocities
        local h = t[i] - t[i - 1]
        assert(math.abs(q[i] - q[i - 1] - h * (qd[i] + qd[i - 1]) / 2) < 2 * h * h)
      end
    end
  end
  -- No motion from -0.8 to 0.8 of a joint is faster than bang-bang with cut speed: L / V + V / A.
  assert(way.duration >= 1.6 + 0.5 - 1e-9, way.duration)
end
)~");
}

TEST_F(PlanPath, EqualSeedsGiveEqualMotions) {
  run(R"~(
local function q(seed)
  return table.concat(cell:plan_path{robot = "rods", to = "right", seed = seed}.recording:values("q2"), " ")
end
assert(q(3) == q(3) and q(3) ~= q(4))
)~");
}

// Either elbow reaches the target; the motion ends in one of them.
TEST_F(PlanPath, PosesOfTheToolAreReachedInAnyConfiguration) {
  run(R"~(
local there = arm:fk{q = {-1.2, 0.6}}.position
local way = cell:plan_path{robot = "rods", target = pose(there[1], there[2], 0, {0, 0, -0.6}),
                           ik = "numeric"}
assert(way.goals >= 1)
local x, y = way.recording:values("x"), way.recording:values("y")
assert(math.abs(x[#x] - there[1]) < 1e-8 and math.abs(y[#y] - there[2]) < 1e-8)
)~");
}

TEST_F(PlanPath, WhatCannotBePlannedIsToldInASentence) {
  const auto told = [&](const std::string& arguments, const std::string& words) {
    const std::string s = refused(arguments);
    EXPECT_NE(s.find(words), std::string::npos) << s;
  };
  told("robot = 'rods', from = {0, 0}, to = 'right'", "at the start");
  told("robot = 'rods', from = {0, 0}, to = 'right'", "ball");
  told("robot = 'rods', to = {0, 0}", "at the goal");
  told("robot = 'rods', to = {0, 0}", "ball");
  told("robot = 'rods', to = {0, 4}", "outside its limits at the goal");
  told("robot = 'rods', from = {4, 0}, to = 'right'", "outside its limits at the start");
  told("robot = 'rods', to = 'left'", "already");
  told("robot = 'rods'", "where to go");
  told("robot = 'rod', to = 'right'", "rods");
  told("robot = 'rods', target = pose(3, 0, 0)", "target");
  told("robot = 'rods', to = 'right', planner = 'straight'", "straight");
}

TEST_F(PlanPath, ItIsCancelled) {
  run("cell:add_object{what = ball, name = 'near', position = {0.3, 0, 0}}");
  session_.show_progress = [&](double, std::string_view) { session_.interrupt(); };
  const std::string s = refused("robot = 'rods', to = 'right', seconds = 1000");
  EXPECT_NE(s.find("stopped"), std::string::npos) << s;
}

}  // namespace
}  // namespace robomosp::lua
