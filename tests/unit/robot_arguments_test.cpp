// SPDX-License-Identifier: Apache-2.0
// Arguments of robot commands that would count for nothing: refused, or named in a message where
// they are kept for later.
#include <gtest/gtest.h>

#include "support/lua_program.h"

namespace robomosp {
namespace {

class RobotArguments : public test::LuaProgramTest {
 protected:
  void SetUp() override {
    LuaProgramTest::SetUp();
    run(R"~(
function refused(part, f, ...)
  local ok, e = pcall(f, ...)
  assert(not ok, "not refused: " .. part)
  assert(tostring(e):find(part, 1, true), tostring(e) .. " lacks " .. part)
end
q = {0.1, -0.8, 0.5, 0.2, 0.9, 0.3}
arm = robot.get("arm"))~");
  }
  /// The newest message of this code; "" = there is none.
  std::string said(const char* code) {
    std::string out;
    for (const Message& m : app().messages.recent(1000))
      if (m.code == code) out = m.text;
    return out;
  }
};

TEST_F(RobotArguments, WhatBelongsToAnotherArgumentIsRefusedWithoutIt) {
  run(R"~(
local zero = {0, 0, 0, 0, 0, 0}
refused("influence is of the objective clearance, and the objective is none", arm.solve_goals, arm,
  {goals = {{target = arm:fk{q = q}.pose}}, influence = 0.1})
refused("and the objective is limits", arm.solve_goals, arm,
  {goals = {{target = arm:fk{q = q}.pose}}, objective = "limits", influence = 0.1})
local cell = world.create{name = "cell"}
cell:add_robot{robot = arm}
refused("whose obstacles count with the objective clearance only", arm.solve_goals, arm,
  {goals = {{target = arm:fk{q = q}.pose}}, world = "cell"})
cell:add_trajectory{trajectory = trajectory.create{name = "way", segments = {
  {shape = "ptp", joints = {zero, q}}}}}
refused("influence is of the objective clearance", cell.inverse_kinematics, cell,
  {robot = "arm", trajectory = "way", influence = 0.1})
refused("a point is on a link or at a tip", arm.point_velocity, arm, {q = q, qd = zero, link = 2, tip = "tool"})
refused("a tip is named, and no wrench acts at it", arm.inverse_dynamics, arm, {q = q, tip = "tool"})
arm:inverse_dynamics{q = q, tip = "tool", tip_force = {1, 0, 0}}
refused("placed is the robot's name in a world", arm.workspace, arm, {samples = 100, placed = "arm"})
refused("its com counts for nothing", arm.set_payload, arm, {com = {0, 0, 0.1}})
refused("its inertia counts for nothing", arm.set_payload, arm, {mass = 0, inertia = {1, 1, 1, 0, 0, 0}})
arm:set_payload{mass = 2, com = {0, 0, 0.1}}
local with = arm:mass().mass
arm:set_payload{}                                        -- takes it off
assert(math.abs(with - arm:mass().mass - 2) < 1e-9))~");
}

TEST_F(RobotArguments, FieldsThatAJointHasNoUseForAreNamed) {
  run("robot.create{name = 'fixed_end', links = {{name = 'turn', mass = 1},\n"
      "  {name = 'plate', joint = 'fixed', upper = 1, viscous = 0.1, passive = true, mass = 1}}}");
  EXPECT_EQ(said("unused_fields"),
            "link \"plate\": its joint is fixed, for which upper, viscous and passive count for "
            "nothing.");
  run("robot.create{name = 'ball', links = {{name = 'ball', joint = 'spherical', origin = {0, 0, "
      "1},\n"
      "  axis = {1, 0, 0}, mass = 1}}}");
  EXPECT_EQ(said("unused_fields"),
            "link \"ball\": its joint is spherical, for which axis counts for nothing.");
  run("robot.get('fixed_end'):set_link{link = 'plate', joint = 'revolute', upper = 2}\n"
      "assert(robot.get('fixed_end'):joints()[2].upper == 2)");
  EXPECT_EQ(said("unused_fields"),
            "link \"ball\": its joint is spherical, for which axis counts for nothing.");
}

TEST_F(RobotArguments, JointValuesBeyondLimitsAndOpenLoopsAreShownAndSaid) {
  run(R"~(
local cell = world.create{name = "cell"}
cell:add_robot{robot = arm}
arm:set_joints(q))~");
  EXPECT_EQ(said("joint_limits"), "");
  run("arm:set_joints{0, 0, 100, 0, 0, 0}\nassert(arm:joint_values()[3] == 100)");
  const std::string beyond = said("joint_limits");
  EXPECT_NE(beyond.find("robot \"arm\" is shown with joint 3 ("), std::string::npos) << beyond;
  EXPECT_NE(beyond.find(" at 5730 deg, "), std::string::npos) << beyond;
  EXPECT_NE(beyond.find(" beyond its limit."), std::string::npos) << beyond;
  run("world.get('cell'):set_robot_q{robot = 'arm', q = {100, 0, 0, 0, 0, 0}}");
  EXPECT_NE(said("joint_limits").find("joint 1 ("), std::string::npos) << said("joint_limits");
  EXPECT_EQ(said("open_loops"), "");
  run("bar = robot.get('four_bar')\n"
      "world.get('cell'):add_robot{robot = bar}\n"
      "local closed = bar:close{}.q\n"
      "bar:set_joints(closed)");
  EXPECT_EQ(said("open_loops"), "");
  run("local q = bar:joint_values():table()\nq[1] = q[1] + 0.3\nbar:set_joints(q)");
  EXPECT_NE(said("open_loops").find("robot \"four_bar\" is shown with its loops open by "),
            std::string::npos)
      << said("open_loops");
}

TEST_F(RobotArguments, AToleranceFinerThanNumbersBlamesNoSolver) {
  run(R"~(
for _, name in ipairs{"puma560", "pa10", "ur5"} do
  local r = robot.get(name)
  local n = r:dof()
  for k = 1, 20 do
    local q = {}
    for i = 1, n do q[i] = 0.1 * i + 0.02 * k end
    local found = r:solve_ik{target = r:fk{q = q}.pose, position_tolerance = 1e-300,
      rotation_tolerance = 1e-300, partial = true}
    assert(found.status ~= "solved" or found.position_error < 1e-13)
  end
end)~");
}

TEST_F(RobotArguments, WhatKnowsStandingBasesOnlySaysSo) {
  run(R"~(
cell = world.create{name = "cell"}
cell:add_robot{robot = arm}
trajectory.create{name = "drive", segments = {{shape = "line", points = {{0, 0, 0}, {0.3, 0, 0}}}}}
cell:add_trajectory{trajectory = "drive"}
arm:set_base{trajectory = "drive"}
local function says(run)
  local all = table.concat(run:notes(), "\n")
  assert(all:find('base of "arm" stands where it is placed', 1, true), all)
end
says(cell:simulate_physics{duration = 0.01})
cell:add_task{task = task.create{name = "wait", steps = {{step = "wait", time = 0.01}}}, robot = "arm"}
says(cell:run_task{})
says(cell:plan_path{robot = "arm", from = {0, 0, 0, 0, 0, 0}, to = q}.recording)
cell:remove_member("drive"))~");
  EXPECT_EQ(said("base"),
            "The way \"drive\" is gone: the base of \"arm\" stands where it is placed.");
  run(R"~(
cell:add_object{what = object.create{name = "box", parts = {
  {what = solid.create{name = "cube", root = {kind = "box", name = "b", x = 0.1, y = 0.1, z = 0.1}}}}}}
cell:attach{robot = "arm", object = "box"}
cell:remove_member("arm"))~");
  EXPECT_EQ(said("let_go"), "\"arm\" is gone and holds no longer: \"box\".");
}

}  // namespace
}  // namespace robomosp
