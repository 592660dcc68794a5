// SPDX-License-Identifier: Apache-2.0
// world.time_optimal against what can be computed by hand: Coulomb friction, torques of a two-link
// arm, and which rows belong to an approach.
#include <gtest/gtest.h>

#include "support/lua_program.h"

namespace robomosp {
namespace {

class TimeOptimalTest : public test::LuaProgramTest {
 protected:
  void SetUp() override {
    LuaProgramTest::SetUp();
    run(R"~(
function near(a, b, tolerance, what)
  assert(math.abs(a - b) <= tolerance, (what or "") .. ": " .. a .. " is not " .. b)
end
function cell_of(name, arm)
  local cell = world.create{name = name}
  cell:add_robot{robot = arm}
  return cell
end
function way(name, joints)
  return trajectory.create{name = name, sample_time = 0.01, segments = {
    {shape = "ptp", profile = "quintic", joints = joints}}}
end)~");
  }
};

// A force along the way of a rod's end, in its own axes, helps or hinders like a constant torque
// a F: it speeds up with (L + a F) / I and slows down with (L - a F) / I. A force that grows with
// the way keeps the limits too.
TEST_F(TimeOptimalTest, ForcesAtTheTipTakeTheirPartOfTheTorqueLimits) {
  run(R"~(
local L, a, m, d, F = 10, 0.4, 5, 1.5, 8
local I = 0.2 + m * a * a
robot.create{name = "rod", convention = "dh", links = {{a = a, mass = m, inertia = {1, 1, 0.2, 0, 0, 0}, max_force = L}}}
local cell = cell_of("cell", "rod")
cell:add_trajectory{trajectory = way("turn", {{0}, {d}})}
local function run(force)
  local r = cell:time_optimal{robot = "rod", trajectory = "turn", start = "path", step = 0.002,
    tip_force = {0, force, 0}, tip_axes = "tool"}
  local t, tau, most = r:values("time"), r:values("tau1"), 0
  for i = 1, #t do most = math.max(most, math.abs(tau[i])) end
  assert(most <= L * (1 + 1e-4) and most > 0.99 * L, "" .. most)
  return t[#t], r
end
for _, f in ipairs{0, F, -F} do
  local up, down = (L + a * f) / I, (L - a * f) / I
  near(run(f), math.sqrt(2 * d * (up + down) / (up * down)), 2e-3, "with " .. f .. " N")
end
local _, r = run("-4 N - 10 N/m * path")
local q, w = r:values("q1"), r:values("wrench2")
near(r:values("path")[#q], a * d, 1e-6, "path")
for i = 2, #q - 1, 20 do  -- tau = I qdd - a F
  near(r:values("tau1")[i], I * r:values("qdd1")[i] + a * (4 + 10 * a * q[i]), 1e-4, "row " .. i)
end
local good, why = pcall(run, "1 N/s * time")
assert(not good and tostring(why):find("a force over time cannot be used"), tostring(why)))~");
}

// One joint without weight, from rest to rest by d: it speeds up with (L - T) / I and slows down
// with (L + T) / I, T the Coulomb friction against the way, so that it takes
// sqrt(2 d (a + b) / (a b)). Friction is greater in the negative direction.
TEST_F(TimeOptimalTest, CoulombFrictionIsCountedWithTheSignOfTheMotion) {
  run(R"~(
local I, L, d = 2, 10, 1.5
local function turntable(name, plus, minus)
  return robot.create{name = name, convention = "dh", links = {{mass = 1, inertia = {1, 1, I, 0, 0, 0},
    gear_ratio = 1, coulomb_positive = plus, coulomb_negative = minus, max_force = L}}}
end
local function takes(T)
  local a, b = (L - T) / I, (L + T) / I
  return math.sqrt(2 * d * (a + b) / (a * b))
end
local function duration(cell, name, from, to)
  cell:add_trajectory{trajectory = way(name, {{from}, {to}})}
  local r = cell:time_optimal{robot = cell:robots()[1].name, trajectory = name, start = "path", step = 0.002}
  local t, tau, qd, q = r:values("time"), r:values("tau1"), r:values("qd1"), r:values("q1")
  local sign, T = to > from and 1 or -1
  T = sign > 0 and 2 or 5
  local full, most = 0, 0
  for i = 2, #t - 1 do
    most = math.max(most, math.abs(tau[i]))
    if math.abs(tau[i]) > 0.999 * L then full = full + 1 end
    -- Torque by hand.
    near(tau[i], I * r:values("qdd1")[i] + sign * T, 1e-6, "torque at row " .. i)
  end
  assert(most <= L * (1 + 1e-6), "" .. most)
  assert(full > 0.95 * (#t - 2), full .. " of " .. #t)
  return t[#t], r
end
local rough = cell_of("rough", turntable("rough_table", 2, -5))
local there = duration(rough, "there", 0, d)
local back, r = duration(rough, "back", d, 0)
near(there, takes(2), 2e-3 * takes(2), "there")
near(back, takes(5), 2e-3 * takes(5), "back")
-- It starts and stops with an acceleration: friction is that of the motion, so that the limit holds
-- in these rows, too.
local n = #r:values("time")
near(r:values("qd1")[1], 0, 0)
near(r:values("qd1")[n], 0, 1e-9)
near(r:values("tau_friction1")[1], -5, 1e-4)
near(r:values("tau_friction1")[n], -5, 1e-4)
near(r:values("tau1")[1], -L, 1e-3)
near(r:values("tau1")[n], L, 1e-3)
assert(not table.concat(r:notes(), "\n"):find("exceeds"), table.concat(r:notes(), "\n")))~");
}

// Torques of the planar two-link arm by its textbook formulas, gravity along -y (J. J. Craig,
// Introduction to Robotics, 6.7), friction added by the sign of each rate; the path turns around.
TEST_F(TimeOptimalTest, TorquesOfATwoLinkArmRecomputedByHandStayWithinTheirLimits) {
  run(R"~(
local m1, m2, l1, l2, I1, I2, g = 3, 2, 0.5, 0.4, 0.05, 0.03, 9.81
local c1, c2 = 0.25, 0.18                                -- centres of mass from the joints
local limits = {60, 18}
local plus, minus, viscous = {2.5, 0.9}, {-4, -1.4}, {0.08, 0.03}
local function link(i, a, m, c, I)
  return {a = a, mass = m, com = {c - a, 0, 0}, inertia = {0.001, 0.001, I, 0, 0, 0}, gear_ratio = 1,
    coulomb_positive = plus[i], coulomb_negative = minus[i], viscous = viscous[i], max_force = limits[i]}
end
local arm = robot.create{name = "two", convention = "dh", base = {0, 0, 0, "90 deg", 0, 0},
  links = {link(1, l1, m1, c1, I1), link(2, l2, m2, c2, I2)}}
local function torques(q1, q2, v1, v2, a1, a2)
  local s2, k2 = math.sin(q2), math.cos(q2)
  local m12 = I2 + m2 * (c2 * c2 + l1 * c2 * k2)
  local m11 = I1 + I2 + m1 * c1 * c1 + m2 * (l1 * l1 + c2 * c2 + 2 * l1 * c2 * k2)
  local g2 = m2 * c2 * g * math.cos(q1 + q2)
  return m11 * a1 + m12 * a2 - m2 * l1 * c2 * s2 * (2 * v1 * v2 + v2 * v2) +
      (m1 * c1 + m2 * l1) * g * math.cos(q1) + g2,
    m12 * a1 + (I2 + m2 * c2 * c2) * a2 + m2 * l1 * c2 * s2 * v1 * v1 + g2
end
local cell = cell_of("cell", arm)
local points = {{-0.4, 0.3}, {0.9, 1.2}, {-0.4, 0.3}}
cell:add_trajectory{trajectory = way("swing", points)}
local r = cell:time_optimal{robot = "two", trajectory = "swing", start = "path", step = 0.002}
local v = {}
for _, name in ipairs{"q1", "q2", "qd1", "qd2", "qdd1", "qdd2", "tau1", "tau2"} do v[name] = r:values(name) end
local n, moving, resting, used = #v.q1, 0, 0, 0
local back = false
for i = 1, n do
  local tau = {torques(v.q1[i], v.q2[i], v.qd1[i], v.qd2[i], v.qdd1[i], v.qdd2[i])}
  local most = 0
  for j = 1, 2 do
    local rate = v["qd" .. j][i]
    if math.abs(rate) > 1e-4 then
      local friction = viscous[j] * rate + (rate > 0 and plus[j] or minus[j])
      near(v["tau" .. j][i], tau[j] + friction, 1e-6, "torque " .. j .. " at row " .. i)
      assert(math.abs(tau[j] + friction) <= limits[j] * (1 + 1e-3), "" .. tau[j] + friction)
      most = math.max(most, math.abs(tau[j] + friction) / limits[j])
      moving = moving + 1
      if j == 1 and rate < -0.1 then back = true end
    elseif rate == 0 then                                -- within the cone: no more than it takes
      local f = v["tau" .. j][i] - tau[j]
      assert(f <= plus[j] + 1e-9 and f >= minus[j] - 1e-9, "" .. f)
      resting = resting + 1
    end
  end
  if most > 0.93 then used = used + 1 end
end
assert(back and resting >= 2 and moving > n)
assert(used > 0.8 * n, used .. " of " .. n)              -- and no slower than they allow
-- Friction costs time.
for i = 1, 2 do arm:set_link{link = i, coulomb_positive = 0, coulomb_negative = 0, viscous = 0} end
local free = cell:time_optimal{robot = "two", trajectory = "swing", start = "path", step = 0.002}
local a, b = free:values("time"), r:values("time")
assert(a[#a] < b[#b], a[#a] .. " " .. b[#b]))~");
}

TEST_F(TimeOptimalTest, RowsOfAnApproachAreMarkedAsInOtherRecordings) {
  run(R"~(
local arm = robot.create{name = "arm2", convention = "dh", links = {
  {a = 0.5, mass = 2, com = {-0.2, 0, 0}, inertia = {0.1, 0.1, 0.1, 0, 0, 0}, max_force = 20},
  {a = 0.4, mass = 1, com = {-0.2, 0, 0}, inertia = {0.1, 0.1, 0.1, 0, 0, 0}, max_force = 10}}}
local cell = cell_of("cell", arm)
cell:add_trajectory{trajectory = way("way", {{0.5, 0.5}, {1.1, -0.2}, {1.5, 0.6}})}
local slow = cell:inverse_kinematics{robot = "arm2", trajectory = "way"}
local fast = cell:time_optimal{robot = "arm2", trajectory = "way", step = 0.005}
local function bounds(r)
  local a, q1, q2, last = r:values("approach"), r:values("q1"), r:values("q2"), 0
  for i = 1, #a do
    assert(a[i] == 0 or a[i] == 1)
    if a[i] == 1 then assert(i == last + 1, "one stretch"); last = i end
  end
  assert(last > 3 and last < #a - 3, "" .. last)
  near(q1[1], 0, 1e-12)
  return q1[last], q2[last], q1, q2, last
end
local q1, q2 = bounds(slow)
near(q1, 0.5, 2e-2); near(q2, 0.5, 2e-2)
local q1, q2, all1, all2, last = bounds(fast)
near(q1, 0.5, 5e-2); near(q2, 0.5, 5e-2)
for i = 1, last do near(all1[i], all2[i], 1e-6, "the approach is straight") end
assert(table.concat(fast:notes(), "\n"):find("Before retiming: An approach of", 1, true))
-- None where it begins on the path.
local from = cell:time_optimal{robot = "arm2", trajectory = "way", start = "path"}
assert(not pcall(from.values, from, "approach")))~");
}

}  // namespace
}  // namespace robomosp
