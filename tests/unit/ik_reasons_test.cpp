// SPDX-License-Identifier: Apache-2.0
// Why inverse kinematics has no answer, sentence by sentence, against the geometry of the arms: how
// far a target is out of reach, whose limit is in the way, which direction is lost, and the closest
// configuration; with every solver that can tell.
#include <memory>
#include <string>

#include <gtest/gtest.h>

#include "ioci/core/commands.h"
#include "lua/lua_state.h"
#include "support/program.h"

namespace robomosp::lua {
namespace {

class IkReasons : public test::ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    state_ = std::make_unique<LuaState>(app(), session_, LuaOptions{});
  }
  /// Runs code that ends with asserts of its own.
  void run(std::string_view code) {
    auto r = state_->eval(code);
    EXPECT_TRUE(r.ok()) << (r.ok() ? "" : r.error().sentence());
  }
  ioci::Session session_{"test"};
  std::unique_ptr<LuaState> state_;
};

// Two rods of 0.7 m and 0.45 m in the x-z plane reach rings of 0.25 m to 1.15 m.
TEST_F(IkReasons, APlaneArmStretchesOrFoldsTowardsWhatIsOutOfReach) {
  run(R"~(
local rods = robot.get("planar2rods")
local function reach(x, z)
  return rods:solve_goals{goals = {{target = pose(x, 0, z), parts = "position"}}, partial = true}
end
local far = reach(1.2, -0.5)                  -- 1.3 m away
assert(far.status == "out_of_reach")
assert(math.abs(far.shortfall - 0.15) < 1e-6, far.shortfall)
assert(far.detail:find("out of reach by 0.15 m", 1, true), far.detail)
local at = rods:fk{q = far.q}.position        -- stretched towards it
assert(math.abs(at[1] - 1.15 * 1.2 / 1.3) < 1e-5 and math.abs(at[3] + 1.15 * 0.5 / 1.3) < 1e-5)
local l = far.lost_direction                  -- along the arm
assert(math.abs(math.abs(l[1]) - 1.2 / 1.3) < 1e-4 and math.abs(math.abs(l[3]) - 0.5 / 1.3) < 1e-4)
local near = reach(0.06, 0.08)                -- 0.1 m away
assert(near.status == "out_of_reach" and math.abs(near.shortfall - 0.15) < 1e-6, near.detail)
local beside = rods:solve_goals{goals = {{target = pose(0.5, 0.2, 0), parts = "position"}}, partial = true}
assert(math.abs(beside.shortfall - 0.2) < 1e-6, beside.detail)   -- 0.2 m out of its plane
)~");
}

// The wrist point of a PUMA is on a ring about axis 1: 0.15005 m aside, then up to a2 + |(a3, d4)|
// long in the arm's plane. Its distance is looked for along the ring's edge.
TEST_F(IkReasons, AWristIsOutOfReachByItsDistanceFromTheArmsRing) {
  run(R"~(
local puma = robot.get("puma560")
for _, p in ipairs{{1.2, 0.3, 0.2}, {0.3, -0.9, 0.8}, {0.2, 0.1, -1.4}} do
  local s = puma:solve_ik{target = pose(p[1], p[2], p[3]), partial = true, provider = "spherical_wrist"}
  assert(s.status == "out_of_reach", s.status)
  local a = puma:fk{q = {0.3, 0.2, 0.1, 0.4, 0.5, 0}}.position
  local b = puma:fk{q = {0.3, 0.2, 0.1, 0.4, -0.7, 0}}.position
  -- The tool's origin lies on axis 6: it moves on a circle about the wrist, so both give d6.
  local chord = math.sqrt((a[1] - b[1])^2 + (a[2] - b[2])^2 + (a[3] - b[3])^2)
  local d6 = chord / (2 * math.sin(0.6))
  local w = {p[1], p[2], p[3] - d6}           -- the tool's z axis is the world's
  local rho, L = math.sqrt(w[1]^2 + w[2]^2), 0.4318 + math.sqrt(0.0203^2 + 0.4318^2)
  local least = math.huge
  for i = 0, 200000 do
    local t = -math.pi / 2 + math.pi * i / 200000
    local r = math.sqrt(0.15005^2 + (L * math.cos(t))^2)
    least = math.min(least, math.sqrt((r - rho)^2 + (L * math.sin(t) - w[3])^2))
  end
  assert(math.abs(s.shortfall - least) < 1e-6, s.shortfall .. " instead of " .. least)
  assert(s.detail:find("out of reach by", 1, true), s.detail)
end
)~");
}

TEST_F(IkReasons, TheJointWhoseLimitIsInTheWayIsNamedByEverySolver) {
  run(R"~(
local puma = robot.get("puma560")
local q = {0.3, 0.6, -0.4, 0.2, 0.7, 0.1}
local target = puma:fk{q = q}.pose
-- Only joint 5 is narrowed, to less than any posture needs: its turn is acos of the same cosine.
puma:set_link{link = 5, lower = -0.2, upper = 0.2}
for _, name in ipairs{"spherical_wrist", "numeric"} do
  local s = puma:solve_ik{target = target, partial = true, provider = name, seed = q}
  assert(s.status == "joint_limit", name .. ": " .. s.status)
  assert(s.limiting_joint ~= nil and s.detail:find("would need", 1, true), name .. ": " .. s.detail)
  assert(math.abs(s.q[5]) <= 0.2 + 1e-9, name)
  local ok, told = pcall(function() return puma:solve_ik{target = target, provider = name, seed = q} end)
  assert(not ok and tostring(told):find(s.limiting_joint, 1, true), tostring(told))
end
)~");
}

TEST_F(IkReasons, ASolvedAnswerNextToASingularOneNamesWhatIsLost) {
  run(R"~(
local puma = robot.get("puma560")
for _, name in ipairs{"spherical_wrist", "numeric"} do
  for _, bend in ipairs{0, 2e-4} do
    local q = {0.3, 0.6, -0.4, 0.2, bend, 0.1}       -- axes 4 and 6 are one line, or nearly
    local s = puma:solve_ik{target = puma:fk{q = q}.pose, seed = q, provider = name,
                            position_tolerance = 1e-8, rotation_tolerance = 1e-8}
    assert(s.status == "solved")
    local lost = s.lost_direction
    assert(lost, name .. " names no direction at " .. bend)
    assert(s.detail:find("next to a singular configuration: there the tip cannot", 1, true), s.detail)
    local L = puma:singularity{q = s.q, threshold = 1e-2}.lost[1]
    local dot, own = 0, 0
    for i = 1, 6 do dot = dot + math.abs(lost[i] - L[i]); own = own + lost[i]^2 end
    assert(math.abs(own - 1) < 1e-9)
    assert(dot < 0.02, name .. ": " .. dot)
  end
  local q = {0.3, 0.6, -0.4, 0.2, 0.5, 0.1}
  local s = puma:solve_ik{target = puma:fk{q = q}.pose, seed = q, provider = name}
  assert(s.lost_direction == nil and s.detail == "", name .. ": " .. s.detail)
end
-- A stretched elbow, for a goal of the position alone.
local rods = robot.get("planar2rods")
local s = rods:solve_goals{goals = {{target = pose(1.15, 0, 0), parts = "position"}},
                           position_tolerance = 1e-6}
assert(s.status == "solved" and math.abs(math.abs(s.lost_direction[1]) - 1) < 1e-3, s.detail)
)~");
}

// A solver sees numbers only: a clearance that could not be told fails the command.
TEST_F(IkReasons, AClearanceThatCannotBeToldIsNotTakenForClear) {
  run(R"~(
local arm = robot.get("puma560")
local cell = world.create{name = "cell"}
cell:add_robot{robot = arm, q = "ready"}
solid.create{name = "ball", root = {kind = "sphere", radius = 0.1}}
cell:add_object{what = "ball", position = {0.5, 0.2, 0.9}}
local calls, most = 0, math.huge
ioci.provide("robomosp.collision/1", "failing", {
  summary = "Spheres of 5 cm until it gives up.",
  prepare = function(shapes) return {} end,
  distance = function(a, b, A, B, interest)
    calls = calls + 1
    if calls > most then error("the sensor is gone") end
    local d = {B(1, 4) - A(1, 4), B(2, 4) - A(2, 4), B(3, 4) - A(3, 4)}
    local l = math.sqrt(d[1]^2 + d[2]^2 + d[3]^2)
    if l < 0.11 then return interest end
    return l - 0.1, {A(1, 4) + 0.05 * d[1] / l, A(2, 4) + 0.05 * d[2] / l, A(3, 4) + 0.05 * d[3] / l},
           {B(1, 4) - 0.05 * d[1] / l, B(2, 4) - 0.05 * d[2] / l, B(3, 4) - 0.05 * d[3] / l}
  end})
local built_in = provider.default "collision"
provider.default("collision", "failing")
local at = arm:fk{q = "ready"}.pose
local function ask()
  return arm:solve_goals{goals = {{target = at, parts = "position"}}, world = "cell",
                         objective = "clearance", influence = 0.6, seed = {0.1, -0.6, 0.2, 0.1, 0.4, 0}}
end
assert(ask().status == "solved")
calls = 0
assert(ask().status == "solved")              -- with everything prepared
local whole = calls
assert(whole > 10)
for _, share in ipairs{0, 0.5, 0.999} do
  calls, most = 0, math.floor(share * whole)
  local ok, e = pcall(ask)
  assert(not ok and tostring(e):find("the sensor is gone", 1, true), share .. ": " .. tostring(e))
end
provider.default("collision", built_in)
)~");
}

// A joint that has turned 1e9 rad is known to 1e-7 rad: no solver can do better, and none is
// blamed.
TEST_F(IkReasons, WhatLargeJointValuesCannotHoldIsSaidAndNotHeldAgainstTheSolver) {
  run(R"~(
for _, name in ipairs{"puma560", "ur5", "stanford", "panda", "iiwa14"} do
  local arm = robot.get(name)
  local n = #arm:links()
  local home = arm:pose_values{name = "home"}
  local target = arm:fk{q = home}.pose
  for _, huge in ipairs{1e3, 1e6, 1e9, 1e12} do
    for joint = 1, #home do
      local seed = {table.unpack(home)}
      seed[joint] = huge
      for _, all in ipairs{false, true} do
        local s = arm:solve_ik{target = target, seed = seed, all = all, partial = true, limits = "ignore"}
        assert(s.status ~= "solved" or s.rotation_error < 1.1e-9 or s.detail:find("rounding leaves an error"),
               name .. ": " .. s.rotation_error .. " " .. s.detail)
      end
    end
  end
end
local puma = robot.get("puma560")
local s = puma:solve_ik{target = puma:fk{q = "ready"}.pose, seed = {0, .07, .52, 1000, -.42, 1e9},
                        all = true, partial = true, limits = "ignore"}
assert(s.status == "solved", s.detail)
)~");
}

// Squares of 1e200 m are beyond doubles, sums of 1.7e308 m too: the first is answered, the second
// refused.
TEST_F(IkReasons, TargetsFartherThanNumbersReachAreRefusedInASentence) {
  run(R"~(
for _, name in ipairs{"puma560", "planar2rods", "gripper", "stewart", "delta"} do
  local arm = robot.get(name)
  for _, far in ipairs{1e160, 1e200, 1e299} do
    local ok, s = pcall(function()
      return arm:solve_goals{goals = {{target = pose(far, far, far), parts = "position"}}, partial = true}
    end)
    assert(ok, name .. ": " .. tostring(s))
    assert(s.position_error > 0.99 * far and s.position_error < 2 * far, name .. ": " .. s.position_error)
  end
  for _, p in ipairs{{1.7e308, 1.7e308, 1.7e308}, {0, -1e301, 0}} do
    for _, call in ipairs{function() return arm:solve_goals{goals = {{target = pose(table.unpack(p)), parts = "position"}}, partial = true} end,
                          function() return arm:solve_ik{target = pose(table.unpack(p)), partial = true, all = true} end} do
      local ok, e = pcall(call)
      assert(not ok and tostring(e):find("too large to compute distances"), name .. ": " .. tostring(e))
    end
  end
end
)~");
}

}  // namespace
}  // namespace robomosp::lua
