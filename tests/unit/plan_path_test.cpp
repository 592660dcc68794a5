// SPDX-License-Identifier: Apache-2.0
// Motions planned around the obstacles of a world: free, within limits, the same for a seed, and
// refused in a sentence.
#include <cmath>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "ioci/core/commands.h"
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
  local way = cell:plan_path{robot = "rods", to = "right", planner = planner, seconds = 100, shortcuts = 20,
                             sample_time = 0.0005}
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
      assert(math.abs(qd[i]) <= 1 + 1e-7 and math.abs(qdd[i]) <= 2 * (1 + 1e-7))
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

// Masses of 2 kg and 0.01 kg m^2 at the ends of rods of 0.5 m, turning about the vertical: with
// c = cos q2, s = sin q2 the torque of the first joint is m l^2 ((3 + 2 c) qdd1 + (1 + c) qdd2 -
// s (2 qd1 qd2 + qd2^2)), that of the second m l^2 ((1 + c) qdd1 + qdd2 + s qd1^2), and the
// inertias times 2 qdd1 + qdd2 and qdd1 + qdd2 (M. W. Spong et al., Robot Modeling and Control,
// section 7.3).
TEST_F(PlanPath, TorqueLimitsAreKept) {
  run(R"~(
local function link(most) return {a = 0.5, lower = -3, upper = 3, max_velocity = 3,
  max_acceleration = 20, max_force = most, mass = 2, com = {0, 0, 0},
  inertia = {0.01, 0.01, 0.01, 0, 0, 0}} end
heavy = robot.create{name = "heavy", convention = "dh", links = {link(4), link(1.5)},
  poses = {left = {0.8, 0}, right = {-0.8, 0}}}
hall = world.create{name = "hall"}
hall:add_robot{robot = heavy, q = "left"}
hall:add_object{what = ball, position = {0.8, 0, 0}}
local function strongest(torque_limits)
  local r = hall:plan_path{robot = "heavy", to = "right", shortcuts = 10, sample_time = 0.001,
                           torque_limits = torque_limits}.recording
  local q2, v1, v2, a1, a2 = r:values("q2"), r:values("qd1"), r:values("qd2"), r:values("qdd1"),
                             r:values("qdd2")
  local most = {0, 0}
  for i = 1, #q2 do
    local c, s = math.cos(q2[i]), math.sin(q2[i])
    local k = 2 * 0.5 * 0.5
    local t1 = k * ((3 + 2 * c) * a1[i] + (1 + c) * a2[i] - s * (2 * v1[i] * v2[i] + v2[i]^2)) +
               0.01 * (2 * a1[i] + a2[i])
    local t2 = k * ((1 + c) * a1[i] + a2[i] + s * v1[i]^2) + 0.01 * (a1[i] + a2[i])
    most = {math.max(most[1], math.abs(t1)), math.max(most[2], math.abs(t2))}
  end
  return most
end
local kept, free = strongest(), strongest(false)
assert(kept[1] <= 4 * (1 + 1e-7) and kept[2] <= 1.5 * (1 + 1e-7), kept[1] .. " " .. kept[2])
assert(kept[1] > 3.9 or kept[2] > 1.45, kept[1] .. " " .. kept[2])
assert(free[1] > 5 and free[2] > 2, free[1] .. " " .. free[2])
)~");
}

TEST_F(PlanPath, EqualSeedsGiveEqualMotions) {
  run(R"~(
local function q(seed)
  return table.concat(cell:plan_path{robot = "rods", to = "right", seed = seed, shortcuts = 10}.recording:values("q2"), " ")
end
assert(q(3) == q(3) and q(3) ~= q(4))
)~");
}

// What a plan took is told; without times it is the same way.
TEST_F(PlanPath, AnswersTellWhatTheyTookAndCanDoWithoutTimes) {
  run(R"~(
local timed = cell:plan_path{robot = "rods", to = "right", seed = 3, shortcuts = 20}
local plain = cell:plan_path{robot = "rods", to = "right", seed = 3, shortcuts = 20, timed = false}
assert(plain.recording == nil and plain.times == nil and plain.joints == nil and plain.duration == nil)
assert(plain.seed == 3 and plain.planner == timed.planner and plain.planner == "rrt_connect")
assert(plain.length == timed.length and #plain.waypoints == #timed.waypoints)
local rows = {}
for i = 1, #plain.waypoints do
  rows[i] = {plain.waypoints[i][1], plain.waypoints[i][2]}
  for j = 1, 2 do assert(rows[i][j] == timed.waypoints[i][j]) end
end
assert(plain.waypoints[1][1] == 0.8 and plain.waypoints[#plain.waypoints][1] == -0.8)
assert(cell:check_path{path = rows, tolerance = 0.002}.is_free)
for _, name in ipairs{"configurations", "motions", "searches", "shortcuts"} do assert(plain.work[name] > 0, name) end
for _, name in ipairs{"goal", "search", "proof", "shortcut"} do assert(plain.work[name .. "_seconds"] > 0, name) end
assert(plain.work.timing_seconds == 0 and timed.work.timing_seconds > 0)
assert(plain.work.configurations < timed.work.configurations)
assert(not pcall(cell.plan_path, cell, {robot = "rods", to = "right", timed = false, watch = true}))
)~");
}

// Curves that take up a short motion between two corners turn far within little of the way; in
// these four ways the robot stopped at one.
TEST_F(PlanPath, RoundedCornersAreRunWithoutAStop) {
  run(R"~(
arm = robot.load("robots/ur5.rbt")
post = solid.create{name = "post", root = {kind = "box", x = 0.5, y = 0.06, z = 0.75}}
shop = world.create{name = "shop"}
shop:add_robot{robot = arm, name = "arm", q = {2.3, -1.2, 1.6, -1.9, -1.5, 0}}
shop:add_object{what = post, position = {0.6, 0, 0}}
for _, seed in ipairs{1, 5, 6, 9} do
  local way = shop:plan_path{robot = "arm", to = {4, -1.2, 1.6, -1.9, -1.5, 0}, planner = "prm", seed = seed}
  assert(#way.waypoints > 2)
  for _, note in ipairs(recording.notes(way.recording)) do
    assert(not note:find("It stops"), seed .. ": " .. note)
  end
  assert(shop:check_path{recording = way.recording}.is_free)
end
)~");
}

TEST_F(PlanPath, TheTimeGivenHoldsForShortcutsToo) {
  run(R"~(
local way = cell:plan_path{robot = "rods", to = "right", shortcuts = 100000, seconds = 0.3, timed = false}
if way.work.shortcuts < 100000 then
  assert(#way.notes == 1 and way.notes[1]:find("of 100000 shortcuts"), way.notes[1])
end
)~");
}

TEST_F(PlanPath, EqualSeedsGiveEqualWaysOnAnyThread) {
  for (const std::string planner : {"rrt_connect", "prm"}) {
    std::vector<std::string> ways(3);
    std::vector<std::thread> threads;
    for (std::string& way : ways)
      threads.emplace_back([&] {
        ioci::Session own{"own"};
        auto r = app().dispatch(own, "world.plan_path",
                                Map{{"id", "cell"},
                                    {"robot", "rods"},
                                    {"to", "right"},
                                    {"planner", planner},
                                    {"seconds", 100},
                                    {"timed", false}});
        way = r.ok() ? r->as_map()->find("waypoints")->text() : r.error().sentence();
      });
    for (std::thread& t : threads) t.join();
    EXPECT_EQ(ways[0], ways[1]) << planner;
    EXPECT_EQ(ways[0], ways[2]) << planner;
    EXPECT_NE(ways[0].find("0.8"), std::string::npos) << ways[0];
  }
}

// Either elbow reaches the target; the motion ends in one of them.
TEST_F(PlanPath, PosesOfTheToolAreReachedInAnyConfiguration) {
  run(R"~(
local there = arm:fk{q = {-1.2, 0.6}}.position
local way = cell:plan_path{robot = "rods", target = pose(there[1], there[2], 0, {0, 0, -0.6}),
                           ik = "numeric", shortcuts = 10}
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
  told("robot = 'rods'", "no target given");
  told("robot = 'rod', to = 'right'", "rods");
  told("robot = 'rods', target = pose(3, 0, 0)", "target");
  told("robot = 'rods', to = 'right', planner = 'straight'", "straight");
}

TEST_F(PlanPath, ItIsCancelled) {
  run("cell:add_object{what = ball, name = 'near', position = {0.3, 0, 0}}");
  session_.show_progress = [&](double, std::string_view) { session_.interrupt(); };
  const std::string s = refused("robot = 'rods', to = 'right', seconds = 1000");
  EXPECT_NE(s.find("was cancelled"), std::string::npos) << s;
}

}  // namespace
}  // namespace robomosp::lua
