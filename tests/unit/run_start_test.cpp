// SPDX-License-Identifier: Apache-2.0
// Every kind of run reports where it starts: in contact, or outside the limits.
#include <gtest/gtest.h>

#include "support/lua_program.h"

namespace robomosp {
namespace {

class RunStarts : public test::LuaProgramTest {
 protected:
  void SetUp() override {
    LuaProgramTest::SetUp();
    run(R"lua(
arm = robot.get("arm")
at = arm:fk{q = "ready"}
solid.create{name = "wall", root = {kind = "box", x = 0.2, y = 0.2, z = 0.2}}
p, a = at.position, at.rpy
trajectory.create{name = "out", sample_time = 0.05, segments = {{shape = "line", points = {
  {p[1], p[2], p[3], a[1], a[2], a[3]}, {p[1], p[2], p[3] - 0.05, a[1], a[2], a[3]}}}}}
task.create{name = "rest", steps = {{step = "wait", time = 0.2}}}
program.create{name = "still", source = "PROGRAM still;\nBEGIN\n  WAIT 0.2 SEC;\nENDPROGRAM;\n"}
function cell_with(q, wall)
  local cell = world.create{name = "cell"}
  cell:add_robot{robot = arm, name = "arm", q = q}
  cell:add_trajectory{trajectory = "out"}
  if wall then cell:add_object{what = "wall", position = wall} end
  cell:add_task{task = "rest", robot = "arm"}
  cell:add_program{program = "still"}
  return cell
end
-- Every command of a world that makes a recording of a run.
runs = {
  inverse_kinematics = function(c) return c:inverse_kinematics{robot = "arm", trajectory = "out"} end,
  inverse_dynamics = function(c) return c:inverse_dynamics{robot = "arm", trajectory = "out"} end,
  simulate = function(c) return c:simulate{robot = "arm", trajectory = "out"} end,
  time_optimal = function(c)
    return c:time_optimal{robot = "arm", trajectory = "out", torque_limits = false}
  end,
  run_task = function(c) return c:run_task{task = "rest"} end,
  program = function(c) return c:run_task{program = "still"} end,
  dynamics = function(c)
    return c:simulate_dynamics{robot = "arm", duration = 0.02, limits = "report"}
  end,
  physics = function(c) return c:simulate_physics{duration = 0.02} end,
  live_tasks = function(c) return c:start_run("tasks", {task = "rest"}):recording() end,
  live_physics = function(c) return c:start_run("physics", {duration = 0.02}):recording() end}
function starts(r)
  local out = ""
  for _, note in ipairs(r:notes()) do
    if note:find("The run starts", 1, true) then out = out .. note .. "\n" end
  end
  return out
end)lua");
  }
};

TEST_F(RunStarts, InContact) {
  run(R"lua(
for name, make in pairs(runs) do
  local cell = cell_with("ready", p)
  local told = starts(make(cell))
  assert(told:find("The run starts in contact: ", 1, true) and told:find("wall and arm.", 1, true),
    name .. ": " .. told)
  cell:remove()
end)lua");
}

TEST_F(RunStarts, ClearAreNotNoted) {
  run(R"lua(
for name, make in pairs(runs) do
  local cell = cell_with("ready", {p[1] + 1, p[2], p[3]})
  assert(starts(make(cell)) == "", name)
  cell:remove()
end)lua");
}

TEST_F(RunStarts, OutsideTheLimitsInTheMakersTerms) {
  run(R"lua(
local kuka = robot.get("kr5")
for _, name in ipairs{"run_task", "program", "dynamics", "live_tasks"} do
  local cell = world.create{name = "cell"}
  cell:add_robot{robot = kuka, name = "arm", q = {0, "60 deg", "75 deg", 0, "30 deg", 0}}
  cell:add_task{task = "rest", robot = "arm"}
  cell:add_program{program = "still"}
  local told = starts(runs[name](cell))
  assert(told:find("The run starts outside limits: robot \"arm\" has axis A3 at 165 deg " ..
    "(-15 to 158 deg), joint 3 (\"elbow\") at 75 deg, 7 deg beyond its limit.", 1, true),
    name .. ": " .. told)
  cell:remove()
end)lua");
}

}  // namespace
}  // namespace robomosp
