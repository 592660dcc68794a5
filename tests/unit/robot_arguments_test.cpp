// SPDX-License-Identifier: Apache-2.0
// Arguments of robot commands that would have no effect: refused, or named in a message where
// they are kept for later.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

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
refused("influence belongs to the objective clearance, but the objective is none", arm.solve_goals, arm,
  {goals = {{target = arm:fk{q = q}.pose}}, influence = 0.1})
refused("but the objective is limits", arm.solve_goals, arm,
  {goals = {{target = arm:fk{q = q}.pose}}, objective = "limits", influence = 0.1})
local cell = world.create{name = "cell"}
cell:add_robot{robot = arm}
refused("but obstacles are used with the objective clearance only", arm.solve_goals, arm,
  {goals = {{target = arm:fk{q = q}.pose}}, world = "cell"})
cell:add_trajectory{trajectory = trajectory.create{name = "way", segments = {
  {shape = "ptp", joints = {zero, q}}}}}
refused("influence belongs to the objective clearance", cell.inverse_kinematics, cell,
  {robot = "arm", trajectory = "way", influence = 0.1})
refused("a point is either on a link or at a tip", arm.point_velocity, arm, {q = q, qd = zero, link = 2, tip = "tool"})
refused("a tip is named, but no wrench acts at it", arm.inverse_dynamics, arm, {q = q, tip = "tool"})
arm:inverse_dynamics{q = q, tip = "tool", tip_force = {1, 0, 0}}
local function inverse(args)
  args.robot, args.trajectory = "arm", "way"
  return cell:inverse_dynamics(args)
end
refused("a tip is named, but no force acts at it", inverse, {tip = "tool"})
refused("tip_columns belongs to a recording, but no tip_wrench is given", inverse, {tip_force = {1, 0, 0}, tip_columns = {"a"}})
refused("tip_over belongs to a recording", inverse, {tip_over = "path"})
refused("it has 2 numbers, but three are needed", inverse, {tip_force = {1, 0}})
refused("there is no q1 here", inverse, {tip_force = {1, 0, "1 N * q1"}})
refused("tip_moment[3]: true is not a number or an expression", inverse, {tip_moment = {1, 0, true}})
refused("is not a recording", inverse, {tip_wrench = 3})
refused("has no tip \"elbow\"", inverse, {tip_force = {1, 0, 0}, tip = "elbow"})
local plain, pushed = inverse{}, inverse{tip_force = {"10 N", 0, "-20 N * sin(2 rad/s * time)"}, tip_axes = "base"}
local again = inverse{tip_wrench = pushed}
for i, t in ipairs(plain:values("time")) do
  local with = pushed:values("tau2")[i] - plain:values("tau2")[i]
  assert(math.abs(with - pushed:values("tau_external2")[i]) < 1e-9)
  assert(math.abs(again:values("tau2")[i] - pushed:values("tau2")[i]) < 1e-9)
  assert(math.abs(pushed:values("wrench3")[i] + 20 * math.sin(2 * t)) < 1e-9)
end
refused("placed is the robot's name in a world", arm.workspace, arm, {samples = 100, placed = "arm"})
refused("its com has no effect", arm.set_payload, arm, {com = {0, 0, 0.1}})
refused("its inertia has no effect", arm.set_payload, arm, {mass = 0, inertia = {1, 1, 1, 0, 0, 0}})
arm:set_payload{mass = 2, com = {0, 0, 0.1}}
local with = arm:mass().mass
arm:set_payload{}                                        -- takes it off
assert(math.abs(with - arm:mass().mass - 2) < 1e-9))~");
}

TEST_F(RobotArguments, FieldsThatAJointHasNoUseForAreNamed) {
  run("robot.create{name = 'fixed_end', links = {{name = 'turn', mass = 1},\n"
      "  {name = 'plate', joint = 'fixed', upper = 1, viscous = 0.1, passive = true, mass = 1}}}");
  EXPECT_EQ(said("unused_fields"),
            "link \"plate\": its joint is fixed, for which upper, viscous and passive have no "
            "effect.");
  run("robot.create{name = 'ball', links = {{name = 'ball', joint = 'spherical', origin = {0, 0, "
      "1},\n"
      "  axis = {1, 0, 0}, mass = 1}}}");
  EXPECT_EQ(said("unused_fields"),
            "link \"ball\": its joint is spherical, for which axis has no effect.");
  run("robot.get('fixed_end'):set_link{link = 'plate', joint = 'revolute', upper = 2}\n"
      "assert(robot.get('fixed_end'):joints()[2].upper == 2)");
  EXPECT_EQ(said("unused_fields"),
            "link \"ball\": its joint is spherical, for which axis has no effect.");
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

TEST_F(RobotArguments, TextsWithoutAUnitSayWhatTheyAreTakenAs) {
  const auto bare = [&] { return said("bare_number"); };
  run("solid.create{name = 'plate', root = {kind = 'box', name = 'box', x = '200', y = '30 mm', z "
      "= "
      "0.1}}");
  EXPECT_EQ(bare(),
            "solid.create: x = \"200\" is taken as 200 m, since it names no unit. "
            "Write \"200 mm\" for millimetres.");
  run("arm:fk{q = {'30', 0, 0, 0, 0, 0}}");
  EXPECT_EQ(bare(),
            "robot.fk: q[1] = \"30\" is taken as 30 rad, since it names no unit. Write "
            "\"30 deg\" for degrees.");
  run("arm:set_payload{mass = '2'}");
  EXPECT_EQ(bare(), "robot.set_payload: mass = \"2\" is taken as 2 kg, since it names no unit.");
  run("arm:fk{q = '1 2 3 4 5 6'}");
  EXPECT_NE(bare().find("So are 3 further texts without a unit."), std::string::npos) << bare();
  const std::string last = bare();
  // Units, expressions, nothing, numbers, and lines of the program whose numbers are texts.
  run(R"~(
arm:fk{q = {"30 deg", "0", 0, 0, 0, 0.5}}
solid.create{name = "other", parameters = {a = "20 mm"}, root = {kind = "box", name = "box", x = "2*a", y = "a", z = 1}}
robot.create{name = "plain", links = {{name = "one", a = 0.5}}}
world.create{name = "cell"}:add_robot{robot = arm}
ioci.classic "PRobot arm SetLinks {10 20 30 0 0 0}")~");
  EXPECT_EQ(bare(), last);
}

TEST_F(RobotArguments, AnglesThatLookLikeDegreesAreNamed) {
  const auto count = [&] {
    int n = 0;
    for (const Message& m : app().messages.recent(1000)) n += m.code == "degrees";
    return n;
  };
  const int before = count();
  run("arm:fk{q = {0, 0, 2, 0, 0, 3}}\narm:fk{q = {0, 0, 1e6, 0, 0, 0}}");  // that is no angle
  EXPECT_EQ(count(), before);
  run("arm:fk{q = {0, 30, 0, 0, 0, 0}}");
  EXPECT_NE(said("degrees").find("robot \"arm\", joint 2 ("), std::string::npos) << said("degrees");
  EXPECT_NE(said("degrees").find("30 is taken as 30 rad, which is 1719 deg. Write \"30 deg\" for "
                                 "degrees."),
            std::string::npos)
      << said("degrees");
  EXPECT_EQ(count(), before + 1);
  run("for i = 1, 50 do arm:inverse_dynamics{q = {0, 30 + i, 0, 0, 0, 0}} end");
  EXPECT_EQ(count(), before + 1) << "once is enough";
  run("arm:jacobian{q = {{0, 0, 0, 0, -90, 0}, {0, 0, 0, 0, 0, 0}}}");
  EXPECT_NE(said("degrees").find("joint 5"), std::string::npos) << said("degrees");
  run("world.create{name = 'cell'}:add_robot{robot = arm}\n"
      "world.get('cell'):set_robot_q{robot = 'arm', q = {45, 0, 0, 0, 0, 0}}");
  EXPECT_NE(said("degrees").find("joint 1"), std::string::npos) << said("degrees");
}

TEST_F(RobotArguments, NumbersOfUnlikelySizeAreNamed) {
  const auto likely = [&] { return said("likely_unit"); };
  run("robot.create{name = 'mm', links = {{alpha = '90 deg', a = 300}}}");
  EXPECT_EQ(likely(),
            "robot.create: links[1].a = 300 is taken as 300 m. Write \"300 mm\" for millimetres.");
  run("robot.create{name = 'deg', links = {{alpha = 90, a = 0.3}}}");
  EXPECT_EQ(likely(),  // 90 * 180 / pi = 5156.62
            "robot.create: alpha = 90 is taken as 90 rad, which is 5157 deg. Write \"90 deg\" for "
            "degrees.");
  run("arm:set_link{link = 1, lower = -170}");
  EXPECT_EQ(likely(),
            "robot.set_link: lower = -170 is taken as -170 rad, which is -9740 deg. Write \"-170 "
            "deg\" for degrees.");
  run("arm:set_link{link = 1, lower = -3, max_velocity = 180}");
  EXPECT_NE(likely().find("180 is taken as 180 rad/s, which is 10310 deg/s"), std::string::npos)
      << likely();
  run("solid.create{name = 'plate', root = {kind = 'box', name = 'box', x = 200, y = 1, z = 1}}");
  EXPECT_NE(likely().find("x = 200 is taken as 200 m"), std::string::npos) << likely();
  run("cell = world.create{name = 'cell'}\ncell:add_robot{robot = 'puma560', q = {0, -90, 0, 0, 0, "
      "0}}");
  EXPECT_NE(said("degrees").find("-90 is taken as -90 rad"), std::string::npos) << said("degrees");
  run("arm:set_pose{name = 'up', q = {0, 0, 120, 0, 0, 0}}");
  EXPECT_NE(likely().find("robot.set_pose: q[3] = 120 is taken as 120 rad"), std::string::npos)
      << likely();
  run("rpy(0, 180, 0)");
  EXPECT_NE(likely().find("180 is taken as 180 rad"), std::string::npos) << likely();
  run("arm:solve_ik{target = pose(0, 0, 300), partial = true}");
  EXPECT_NE(likely().find("target.z = 300 is taken as 300 m"), std::string::npos) << likely();
  // Numbers that are right, computed, or given with their unit.
  const std::string last = likely();
  run("robot.create{name = 'crane', links = {{a = 9, alpha = 1.5708, lower = -10, upper = 10}}}\n"
      "robot.create{name = 'whole', links = {{a = '300 mm', alpha = deg(90), lower = '-170 "
      "deg'}}}\n"
      "cell:set_robot_q{q = {0.1, 0, 0, 0, 0, 0}}");
  EXPECT_EQ(likely(), last);
  const auto count = [&] {
    int n = 0;
    for (const Message& m : app().messages.recent(1000)) n += m.code == "likely_unit";
    return n;
  };
  const int before = count();
  run("for i = 1, 50 do robot.create{name = 'r' .. i, links = {{alpha = 90 + i}}} end");
  EXPECT_LE(count(), before + 3) << "a loop says it once in twenty messages";
}

TEST_F(RobotArguments, ATableOfRowsIsTypedAsOneAndReadFromAnother) {
  run(R"~(
refused("columns", robot.create, {name = "a", links = {{0, 90, 0.3, 0}}})
refused("3 numbers", robot.create, {name = "a", links = {{0, 90, 0.3}}, columns = {"theta", "alpha deg", "a", "d"}})
refused("no column \"angle\"", robot.create, {name = "a", links = {{0}}, columns = {"angle"}})
refused("appears twice", robot.create, {name = "a", links = {{0, 1}}, columns = {"a", "a"}})
refused("not a unit", robot.create, {name = "a", links = {{0}}, columns = {"a furlongs"}})
-- PUMA 560 (Corke and Armstrong-Helouvry 1994): theta, d, a, alpha.
local puma = robot.create{name = "table", columns = {"theta", "d", "a [mm]", "alpha (deg)"}, links = {
  {0, 0, 0, 90}, {0, 0, 431.8, 0}, {0, 0.15005, 20.3, -90}, {0, 0.4318, 0, 90}, {0, 0, 0, -90}, {0, 0, 0, 0}}}
local shipped = robot.get("puma560")
local q = {0.1, -0.8, 0.5, 0.2, 0.9, 0.3}
assert((puma:fk{q = q}.pose - shipped:fk{q = q}.pose):norm() < 1e-12)
for i, links in ipairs{shipped:dh_table().rows, shipped:dh_table()} do
  local again = robot.create{name = "again" .. i, links = links}
  assert((again:fk{q = q}.pose - puma:fk{q = q}.pose):norm() < 1e-12)
  assert(again:links()[2].name == shipped:links()[2].name)
end
local t = shipped:dh_table()
local matrix = robot.create{name = "matrix", links = t.matrix, columns = t.columns}
assert((matrix:fk{q = q}.pose - puma:fk{q = q}.pose):norm() < 1e-12)
-- Rows of the modified convention stay what they are, and so does a joint that slides.
local craig = robot.create{name = "craig", convention = "mdh", links = {
  {alpha = 0.3, a = 0.2, d = 0.1}, {joint = "prismatic", a = 0.4, alpha = -1}}}
local copy = robot.create{name = "copy", links = craig:dh_table().rows}
assert((copy:fk{q = {0.4, 0.2}}.pose - craig:fk{q = {0.4, 0.2}}.pose):norm() < 1e-15)
refused("in degrees", robot.create, {name = "b", links = craig:dh_table{angles = "degrees"}}))~");
}

TEST_F(RobotArguments, NamesOfTheLibraryLoadWhereverARecordIsWanted) {
  run(R"~(
local cell = world.create{name = "cell"}
assert(cell:add_robot{robot = "ur5"} == "ur5" and robot.get("ur5"))
local pin = solid.create{name = "pin", material = "steel", root = {kind = "cylinder", name = "c", radius = 0.01, height = 0.05}}
assert(pin:describe().material == "steel")
local robots = #robot.list()
document.undo()   -- the solid: the material stays, as of material.get
assert(material.get("steel"))
refused("there is no robot \"ur6\"", cell.add_robot, cell, {robot = "ur6"})
refused("there is no robot \"kr5\"", robot.remove, "kr5")
-- Where a command fails, nothing is loaded.
refused("placement", cell.add_robot, cell, {robot = "kr5", placement = "nowhere"})
for _, r in ipairs(robot.list()) do assert(r.name ~= "kr5") end)~");
}

TEST_F(RobotArguments, SavingEverythingNamesWhatItLeavesToTheLibrary) {
  const auto folder =
      std::filesystem::temp_directory_path() / ("robomosp-save-" + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  run("local puma = robot.get('puma560')\npuma:set_pose{name = 'mine', q = {0, 0, 0, 0, 0, 0}}\n"
      "brass = material.create{name = 'brass', density = 8500}\n"
      "document.save('" +
      folder.string() + "')");
  EXPECT_TRUE(std::filesystem::exists(folder / "brass.mtr"));
  EXPECT_FALSE(std::filesystem::exists(folder / "puma560.rbt"));
  const std::string left = said("left_out");
  EXPECT_NE(left.find("robot \"puma560\""), std::string::npos) << left;
  EXPECT_NE(left.find("robot.save{id = \"puma560\", file = \"puma560.rbt\"} saves a copy."),
            std::string::npos)
      << left;
  std::filesystem::remove_all(folder);
}

TEST_F(RobotArguments, AFileThatIsReplacedIsNamed) {
  const std::string file =
      (std::filesystem::temp_directory_path() / ("robomosp-" + std::to_string(::getpid())))
          .string() +
      ".model";
  const auto count = [&] {
    int n = 0;
    for (const Message& m : app().messages.recent(1000))
      n += m.code == "file_replaced" && m.text.find(file) != std::string::npos;
    return n;
  };
  run("arm:save_model{file = '" + file + "'}\narm:save_model{file = '" + file + "'}");
  EXPECT_EQ(count(), 0) << "equal content is no loss";
  run("robot.get('puma560'):save_model{file = '" + file + "'}");
  EXPECT_EQ(count(), 1);
  std::filesystem::remove(file);
}

TEST_F(RobotArguments, AWorldOfOneRobotDoesNotAskWhich) {
  run(R"~(
local cell = world.create{name = "cell"}
refused("robot", cell.set_robot_q, cell, {q = q})
cell:add_robot{robot = arm}
cell:set_robot_q{q = q}
assert(cell:describe().robots[1].q[2] == q[2])
cell:add_robot{robot = arm, name = "second"}
refused("robot", cell.set_robot_q, cell, {q = q}))~");
}

TEST_F(RobotArguments, ANumberIsAListOfOne) {
  run(R"~(
local one = robot.create{name = "one", links = {{name = "turn", a = 0.5, mass = 1, com = {-0.25, 0, 0}}}}
assert((one:fk(0.3).position - one:fk{q = {0.3}}.position):norm() == 0)
assert((one:fk("30 deg").position - one:fk{q = {math.rad(30)}}.position):norm() < 1e-15)
local tau = one:inverse_dynamics{q = 0.3, qd = 1, qdd = 2, gravity = {0, -9.81, 0}}
assert(#tau == 1 and tau[1] == one:inverse_dynamics{q = {0.3}, qd = {1}, qdd = {2}, gravity = {0, -9.81, 0}}[1])
assert(one:jacobian_rate{q = 0.3, qd = 1}:rows() == 6)
refused("q: 1 joint value is given; the robot has 6 joints", arm.fk, arm, 0.3)
refused("the robot has 6", arm.inverse_dynamics, arm, {q = q, qd = 1}))~");
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
  assert(all:find('base of "arm" stays where it is placed', 1, true), all)
end
says(cell:simulate_physics{duration = 0.01})
cell:add_task{task = task.create{name = "wait", steps = {{step = "wait", time = 0.01}}}, robot = "arm"}
says(cell:run_task{})
says(cell:plan_path{robot = "arm", from = {0, 0, 0, 0, 0, 0}, to = q}.recording)
cell:remove_member("drive"))~");
  EXPECT_EQ(said("base"),
            "The way \"drive\" is gone: the base of \"arm\" stays where it is placed.");
  run(R"~(
cell:add_object{what = object.create{name = "box", parts = {
  {what = solid.create{name = "cube", root = {kind = "box", name = "b", x = 0.1, y = 0.1, z = 0.1}}}}}}
cell:attach{robot = "arm", object = "box"}
cell:remove_member("arm"))~");
  EXPECT_EQ(said("let_go"), "\"arm\" is gone and holds no longer: \"box\".");
}

}  // namespace
}  // namespace robomosp
