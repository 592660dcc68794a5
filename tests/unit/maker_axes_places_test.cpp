// SPDX-License-Identifier: Apache-2.0
// The maker's axes at every place that names a joint or takes its value: a test a place, with
// values computed by hand.
#include <string>

#include <gtest/gtest.h>

#include "support/lua_program.h"

namespace robomosp {
namespace {

class MakerAxesPlacesTest : public test::LuaProgramTest {
 protected:
  void SetUp() override {
    LuaProgramTest::SetUp();
    run(R"lua(
-- Two rods in a plane. B counts from the horizontal, as FANUC's J3: B = -q2 - q1.
function rods(more)
  local out = {name = "rods", links = {
    {name = "upper", a = 0.5, lower = "-100 deg", upper = "100 deg", mass = 1, com = {-0.25, 0, 0},
      inertia = {0.001, 0.02, 0.02, 0, 0, 0}},
    {name = "fore", a = 0.4, lower = "-170 deg", upper = "170 deg", mass = 1, com = {-0.2, 0, 0},
      inertia = {0.001, 0.02, 0.02, 0, 0, 0}}},
    axes = {{name = "A", link = "upper", sign = -1, offset = "90 deg"},
      {name = "B", link = "fore", sign = -1, coupled = {{link = "upper", ratio = -1}}}}}
  for k, v in pairs(more or {}) do out[k] = v end
  return robot.create(out)
end
function has(text, part) assert(text:find(part, 1, true), tostring(text)) end
function refusal(fn, ...)
  local good, why = pcall(fn, ...)
  assert(not good, "it is not refused")
  return tostring(why)
end
)lua");
  }
  /// The texts of the messages with a code.
  std::string messages(std::string_view code) {
    std::string out;
    for (const Message& m : app().messages.recent(1000))
      if (m.code == code) out += m.text + "\n";
    return out;
  }
};

/// A goal at q = (30, 175) degrees: B = -175 - 30; its range at A = 60 is -170 - 30 to 170 - 30.
TEST_F(MakerAxesPlacesTest, AreNamedByMotionPlanning) {
  run(R"lua(
local arm = rods()
local cell = world.create{name = "cell"}
cell:add_robot{robot = arm, name = "arm"}
has(refusal(cell.plan_path, cell, {robot = "arm", to = {"30 deg", "175 deg"}}),
  "axis B at -205 deg (-200 to 140 deg while A is at 60 deg), joint 2 (fore) is outside its limits at the goal")
has(refusal(cell.plan_path, cell, {robot = "arm", from = {"101 deg", 0}, to = {0, 1}}),
  "axis A at -11 deg (-10 to 190 deg), joint 1 (upper) is outside its limits at the start")
local way = cell:plan_path{robot = "arm", to = {0.5, 0.5}}
has(table.concat(way.notes, "\n"), "axis A, joint 1 (upper) has no limit for velocity and acceleration")
for _, c in ipairs(way.recording:columns()) do
  if c.name == "q2" then has(c.doc, "of axis B, joint 2 (fore)") end
end
-- Without axes as before.
arm:set_axes{axes = {}}
has(refusal(cell.plan_path, cell, {robot = "arm", to = {"30 deg", "175 deg"}}),
  ": joint 2 (fore) is outside its limits at the goal"))lua");
}

/// Joint 1 meets its upper limit of 100 degrees, which is -10 of axis A = 90 - q1. Where joint 2
/// meets its own of 170 degrees, B is -170 - q1 with the range -170 - q1 to 170 - q1.
TEST_F(MakerAxesPlacesTest, AreNamedWhereARunMeetsItsStops) {
  run(R"lua(
local arm = rods()
local notes = table.concat(arm:simulate{q = {1.7, 0}, qd = {1, 0}, duration = 0.2}:notes(), "\n")
has(notes, "axis A at -10 deg (-10 to 190 deg), joint 1 (upper) met its upper limit")
-- An axis that counts two joints: its value where joint 2 met its limit, and the range there.
local r = arm:simulate{q = {0.3, 2.9}, qd = {0.5, 3}, duration = 0.1, sample_time = 0.001}
local text = table.concat(r:notes(), "\n")
local value, low, high, a, t = text:match(
  "axis B at (%-[%d.]+) deg %((%-[%d.]+) to ([%d.]+) deg while A is at ([%d.]+) deg%), joint 2 %(fore%) met its upper limit at ([%d.]+) s")
assert(value, text)
local q1 = 90 - tonumber(a)   -- of axis A
assert(math.abs(tonumber(value) + 170 + q1) < 1e-3 and math.abs(tonumber(low) + 170 + q1) < 1e-3, text)
assert(math.abs(tonumber(high) - 170 + q1) < 1e-3, text)
-- The nearest row of the recording.
local times, q, near = r:values("time"), r:values("q1"), 1
for i = 1, #times do
  if math.abs(times[i] - tonumber(t)) < math.abs(times[near] - tonumber(t)) then near = i end
end
assert(math.abs(math.deg(q[near]) - q1) < 0.05, text)
has(refusal(arm.simulate, arm, {q = {"-101 deg", 0}, duration = 0.1}),
  "axis A at 191 deg (-10 to 190 deg), joint \"upper\" starts at")
arm:set_axes{axes = {}}
notes = table.concat(arm:simulate{q = {1.7, 0}, qd = {1, 0}, duration = 0.2}:notes(), "\n")
has(notes, "joint 1 (upper) met its upper limit")
assert(not notes:find("axis", 1, true), notes))lua");
}

/// KUKA: A1 = -q1, A2 = -q2, A3 = q3 + 90, A4 = -q4, A5 = q5, A6 = -q6 [degrees].
TEST_F(MakerAxesPlacesTest, AreInTheReasonsOfInverseKinematics) {
  run(R"lua(
local kuka = robot.get("kr5")
kuka:set{mass_source = "given"}
local rules = {A1 = {-1, 0, 1}, A2 = {-1, 0, 2}, A3 = {1, 90, 3}, A4 = {-1, 0, 4}, A5 = {1, 0, 5}, A6 = {-1, 0, 6}}
local far = kuka:fk{q = {0, math.rad(60), math.rad(75), 0, math.rad(30), 0}}.pose
for _, solver in ipairs{"spherical_wrist", "numeric"} do
  local why = refusal(kuka.solve_ik, kuka, {target = far, provider = solver})
  local name, value, low, high, joint, need, limit = why:match(
    "axis (A%d) at (%-?[%d.]+) deg %((%-?[%d.]+) to (%-?[%d.]+) deg%), joint (%d) %(\"[%w_]+\"%) would need (%-?[%d.]+) deg; its limit is (%-?[%d.]+) deg")
  assert(name, solver .. ": " .. why)
  local sign, offset, number = table.unpack(rules[name])
  assert(number == tonumber(joint), why)
  assert(math.abs(sign * need + offset - value) < 1e-6, why)
  local axis_limit = sign * limit + offset
  assert(math.abs(axis_limit - low) < 0.06 or math.abs(axis_limit - high) < 0.06, why)
end
-- Beyond the limit of an axis that counts two joints: q = (30, 175), B = -205, of -200 to 140.
local arm = rods()
local flat = arm:solve_ik{target = arm:fk{q = {"30 deg", "175 deg"}}.pose, limits = "ignore", seed = {0.5, 3.05}}
has(flat.beyond[1].detail, "axis B at -205 deg (-200 to 140 deg while A is at 60 deg), joint 2 (\"fore\") at 175")
has(refusal(arm.solve_ik, arm, {target = arm:fk{q = {"30 deg", "175 deg"}}.pose, provider = "numeric"}),
  "axis B"))lua");
}

/// The pendant's keys: J2 by 20 degrees while J3 of FANUC stays, so that joint 3 moves by -20.
TEST_F(MakerAxesPlacesTest, AreJogged) {
  run(R"lua(
local arm = rods()
local cell = world.create{name = "cell"}
cell:add_robot{robot = arm, name = "arm"}
local now = arm:jog{axis = "A", to = 60}
assert(math.abs(now.q[1] - math.rad(30)) < 1e-12, "A = 90 - q1")
assert(math.abs(now.q[2] + math.rad(30)) < 1e-12, "B stays at 0: q2 = -q1")
now = arm:jog{axis = "B", by = "0.5 rad"}
assert(math.abs(now.axes.B - math.deg(0.5)) < 1e-9 and math.abs(now.axes.A - 60) < 1e-9)
assert(math.abs(now.q[2] + math.rad(30) + 0.5) < 1e-12)
assert(math.abs(cell:robots()[1].axes.B - math.deg(0.5)) < 1e-9)
-- By name or all in a row.
arm:set_joints{axes = {A = 80}}
assert(math.abs(arm:joint_values()[1] - math.rad(10)) < 1e-12)
assert(math.abs(arm:joint_values()[2] + math.rad(10) + 0.5) < 1e-12)
cell:set_robot_q{robot = "arm", axes = {45, "-90 deg"}}
local q = arm:joint_values()
assert(math.abs(q[1] - math.rad(45)) < 1e-12 and math.abs(q[2] - math.rad(45)) < 1e-12)
-- What does not fit.
has(refusal(arm.jog, arm, {axis = "C", to = 1}), "\"C\"")
has(refusal(arm.jog, arm, {axis = "A"}), "neither to nor by is given")
has(refusal(arm.jog, arm, {axis = "A", to = 1, by = 1}), "both to and by are given")
has(refusal(arm.jog, arm, {axis = "A", to = 0/0}), "finite")
has(refusal(arm.jog, arm, {axis = "A", to = 1e300}), "too large")
has(refusal(arm.jog, arm, {axis = "A", to = "3 mm"}), "mm")
has(refusal(arm.set_joints, arm, {world = "cell"}), "no joint values are given")
has(refusal(arm.set_joints, arm, {q = {0, 0}, axes = {0, 0}}), "both q and axes are given")
has(refusal(arm.set_joints, arm, {axes = {1, 2, 3}}), "3 values are given, but the robot has 2 axes")
has(refusal(arm.set_joints, arm, {axes = {Z = 1}}), "\"Z\"")
arm:jog{axis = "B", to = 0}
arm:jog{axis = "A", to = 200}
arm:set_axes{axes = {}}
has(refusal(arm.jog, arm, {axis = "A", to = 1}), "the maker's axes of this robot are unknown")
has(refusal(arm.set_joints, arm, {axes = {1, 2}}), "the maker's axes of this robot are unknown")
assert(cell:robots()[1].axes == nil))lua");
  const std::string warned = messages("joint_limits");
  EXPECT_NE(warned.find("axis A at 200 deg (-10 to 190 deg), joint 1 (\"upper\") at -110 deg"),
            std::string::npos)
      << warned;
}

/// An axis that slides counts in mm, also backwards; an external one moves alone.
TEST_F(MakerAxesPlacesTest, AreJoggedAlongARail) {
  run(R"lua(
local arm = robot.create{name = "railed", links = {
  {name = "rail", joint = "prismatic", lower = -0.5, upper = 2, alpha = "90 deg"}, {name = "turn", a = 0.3}},
  axes = {{name = "A1", link = "turn"},
    {name = "E1", link = "rail", unit = "mm", sign = -1, offset = 0.1, external = true}}}
local cell = world.create{name = "cell"}
cell:add_robot{robot = arm, name = "arm"}
local now = arm:jog{axis = "E1", to = -400}
assert(math.abs(now.q[1] - 0.5) < 1e-12 and now.q[2] == 0)
now = arm:jog{axis = "E1", by = "0.1 m"}
assert(math.abs(now.q[1] - 0.4) < 1e-12 and math.abs(now.axes.E1 + 300) < 1e-9)
has(refusal(arm.jog, arm, {axis = "E1", by = "3 deg"}), "deg")
arm:jog{axis = "E1", to = 700})lua");
  const std::string warned = messages("joint_limits");
  EXPECT_NE(warned.find("axis E1 at 700 mm (-1900 to 600 mm), joint 1 (\"rail\")"),
            std::string::npos)
      << warned;
}

TEST_F(MakerAxesPlacesTest, AreShownByRunsAndTheirColumns) {
  run(R"lua(
local arm = rods()
local cell = world.create{name = "cell"}
cell:add_robot{robot = arm, name = "arm", q = {0.1, 0.2}}
task.create{name = "go", steps = {{step = "move", joints = {0.4, 0.6}}}}
cell:add_task{task = "go", robot = "arm"}
local r = cell:run_task{task = "go"}
local seen = 0
for _, c in ipairs(r:columns()) do
  if c.name == "arm.q2" then has(c.doc, "of axis B, joint 2 of arm") seen = seen + 1 end
  if c.name == "arm.qd1" then has(c.doc, "of axis A, joint 1 of arm") seen = seen + 1 end
end
assert(seen == 2)
-- A live run shows the pendant's values: A = 90 - q1, B = -q2 - q1.
local live = cell:start_run("recording", {recording = r})
local s = live:finish()
assert(math.abs(s.axes.arm.A - 90 + math.deg(0.4)) < 1e-6 and math.abs(s.axes.arm.B + math.deg(1)) < 1e-6)
-- Columns of axes are a group for plots and files.
r:compute{quantities = {"axes"}, robot = "arm"}
local text = r:plot{columns = {"arm.axes"}, as = "svg"}
assert(text:find("axis_A", 1, true) and text:find("axis_B", 1, true))
-- A robot without axes has none.
arm:set_axes{axes = {}}
local bare = cell:start_run("recording", {recording = cell:run_task{task = "go"}})
assert(bare:state().axes == nil))lua");
}

/// Names in any language, and names that differ in a mark only, give a column each.
TEST_F(MakerAxesPlacesTest, HaveAColumnEachWhateverTheirNames) {
  run(R"lua(
local arm = rods{axes = {{name = "肩", link = "upper"}, {name = "肘", link = "fore"}}}
local cell = world.create{name = "cell"}
cell:add_robot{robot = arm, name = "arm", q = {0.1, 0.2}}
task.create{name = "go", steps = {{step = "move", joints = {0.4, 0.6}}}}
cell:add_task{task = "go", robot = "arm"}
local r = cell:run_task{task = "go"}
r:compute{quantities = {"axes"}, robot = "arm"}
local function first(of, column, value)
  assert(math.abs(of:values(column)[1] - value) < 1e-12, column)
end
first(r, "arm.axis_肩", 0.1)
first(r, "arm.axis_肘", 0.2)
arm:set_axes{axes = {{name = "J 1", link = "upper"}, {name = "J-1", link = "fore"}}}
local again = cell:run_task{task = "go"}
again:compute{quantities = {"axes"}, robot = "arm"}
first(again, "arm.axis_J_1", 0.1)
first(again, "arm.axis_J_1_2", 0.2))lua");
}

TEST_F(MakerAxesPlacesTest, LabelThePlotOfACheck) {
  run(R"lua(
local kuka = robot.get("kr5")
kuka:set{mass_source = "given"}
local p = program.create{name = "way", source = [[
PROGRAM way;
BEGIN
  MOVE PTP MAIN_JOINT(0.0, 60.0, 0.0, 0.0, 30.0, 0.0);
  MOVE PTP MAIN_JOINT(0.0, 90.0, 0.0, 0.0, 30.0, 0.0);
ENDPROGRAM;
]]}
p:check_run{robot = "kr5", contacts = false, torques = false, plot = "axes_check.svg"}
local f = assert(io.open("axes_check.svg"))
local text = f:read("a")
f:close()
os.remove("axes_check.svg")
has(text, "A2, joint 2"))lua");
}

/// Limits that the record gives an axis of two joints: at q = (60, 80) B = -140, of -100 to 100,
/// while both joints are within their own.
TEST_F(MakerAxesPlacesTest, AreCheckedAgainstTheirOwnLimits) {
  run(R"lua(
local arm = rods{axes = {{name = "A", link = "upper"}, {name = "B", link = "fore", sign = -1,
  coupled = {{link = "upper", ratio = -1}}, lower = "-100 deg", upper = "100 deg"}}}
local p = program.create{name = "bend", source = "PROGRAM bend;\nSYSTEM_SPECIFICATION 'rods.ssi';\n" ..
  "BEGIN\n  MOVE PTP MAIN_JOINT(0.0, 80.0);\n  MOVE PTP MAIN_JOINT(60.0, 80.0);\nENDPROGRAM;\n"}
p:set_file{name = "rods.ssi", text = [[
PROGRAM rods;
CONST
  INT: R_NTURNS := 2, R_NADDJ := 1, R_NJ := 3, R_DEVICE_NUMBER := 1;
TYPE
  RECORD REAL: A, B; ENDRECORD: MAIN_JOINT;
  RECORD REAL: AA1; ENDRECORD: ADD_JOINT;
  RECORD MAIN_JOINT: M_JOINT; ADD_JOINT: A_JOINT; ENDRECORD: JOINT;
  RECORD POSE: PSE; INT: STATUS; ARRAY [1..R_NTURNS] OF INT: TURNS; ADD_JOINT: A_JOINT; ENDRECORD: ROBTARGET;
ENDPROGRAM;
]]}
local found = p:check_run{robot = "rods", contacts = false, torques = false}
assert(found.errors == 1, #found.faults)
local f = found.faults[1]
has(f.message, "axis B of robot \"rods\" would be at -140 deg, 40 deg beyond its limit of -100")
assert(f.kind == "joint_limit" and f.line == 5, f.kind)
-- Where a joint is shown beyond them, too.
local cell = world.create{name = "cell"}
cell:add_robot{robot = arm, name = "arm"}
has(refusal(cell.plan_path, cell, {robot = "arm", to = {0, "175 deg"}}),
  "axis B at -175 deg (-100 to 100 deg), joint 2 (fore)"))lua");
}

TEST_F(MakerAxesPlacesTest, AreNamedByTimeOptimalRuns) {
  run(R"lua(
local arm = robot.create{name = "weak", links = {
  {name = "lift", alpha = "90 deg", lower = -3, upper = 3, max_velocity = 1, max_acceleration = 1},
  {name = "arm", a = 1, mass = 10, com = {-0.5, 0, 0}, lower = -3, upper = 3, max_velocity = 1,
    max_acceleration = 1, max_force = 1}},
  axes = {{name = "S", link = "lift"}, {name = "L", link = "arm", sign = -1}}}
local cell = world.create{name = "cell"}
cell:add_robot{robot = arm, name = "arm"}
cell:add_trajectory{trajectory = trajectory.create{name = "up", segments = {
  {shape = "ptp", joints = {{0, 0.5}}}}}}
has(refusal(cell.time_optimal, cell, {robot = "arm", trajectory = "up"}), "axis L, joint 2 needs"))lua");
}

/// Where a robot is in several worlds, the sentence names what to write.
TEST_F(MakerAxesPlacesTest, SetJointsSaysHowToNameTheWorld) {
  run(R"lua(
local arm = rods()
has(refusal(arm.set_joints, arm, {q = {0, 0}}), "world.add_robot")
local one, two = world.create{name = "one"}, world.create{name = "two"}
one:add_robot{robot = arm, name = "left"}
two:add_robot{robot = arm, name = "right"}
local why = refusal(arm.set_joints, arm, {q = {0, 0}})
has(why, "one:left")
has(why, "two:right")
has(why, "Name the world: world = \"one\".")
arm:set_joints{q = {0.1, 0}, world = "one"}
one:add_robot{robot = arm, name = "again"}
has(refusal(arm.set_joints, arm, {q = {0, 0}, world = "one"}),
  "world.set_robot_q{id = \"one\", robot = \"left\", q = ...}")
local three = world.create{name = "three"}
has(refusal(arm.set_joints, arm, {q = {0, 0}, world = "three"}), "world \"three\" does not contain it"))lua");
}

/// An error of a program names it once, and a configuration is told in the words of STATUS.
TEST_F(MakerAxesPlacesTest, RunsNameTheProgramOnceAndTheConfiguration) {
  run(R"lua(
local kuka = robot.get("kr5")
kuka:set{mass_source = "given"}
local p = program.create{name = "loop",
  source = "PROGRAM loop;\nVAR\n  INT: n;\nBEGIN\n  WHILE TRUE DO\n    n := n - n;\n  ENDWHILE;\nENDPROGRAM;\n"}
local why = refusal(p.run, p, {robot = "kr5"})
has(why, "program \"loop\"")
local _, count = why:gsub("program \"loop\"", "")
assert(count == 1, why)
-- A straight motion through the singular wrist: axis 5 from 30 to -30.
local function pose(five)
  local at = kuka:fk{q = kuka:joints_from_axes{0, -60, 90, 0, five, 0}}
  local w = at.rpy
  return string.format("POSE(POSITION(%.9f, %.9f, %.9f), ORIZYX(%.12f, %.12f, %.12f))",
    at.position[1]*1000, at.position[2]*1000, at.position[3]*1000,
    math.deg(w[3]), math.deg(w[2]), math.deg(w[1]))
end
local turn = program.create{name = "turn", source = "PROGRAM turn;\nVAR\n  ROBTARGET: a := ROBTARGET(" ..
  pose(30) .. ", 0, [0, 0], ADD_JOINT(0.0));\n  ROBTARGET: b := ROBTARGET(" .. pose(-30) ..
  ", 4, [0, 0], ADD_JOINT(0.0));\nBEGIN\n  MOVE PTP a;\n  MOVE LIN b;\nENDPROGRAM;\n"}
local all = ""
for _, f in ipairs(turn:check_run{robot = "kr5", contacts = false, torques = false}.faults) do
  all = all .. f.message .. " " .. (f.hint or "") .. "\n"
end
has(all, "STATUS")
has(all, "hand down")
assert(not all:find("branch", 1, true) and not all:find("flip", 1, true), all))lua");
}

}  // namespace
}  // namespace robomosp
