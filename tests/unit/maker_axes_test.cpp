// SPDX-License-Identifier: Apache-2.0
// The maker's axes of robots: values against products of rotations about the axes of data sheets,
// what posts write of them, contradictions and what is not known.
#include <string>

#include <gtest/gtest.h>

#include "support/lua_program.h"

namespace robomosp {
namespace {

class MakerAxesTest : public test::LuaProgramTest {};

/// FANUC, LR Mate like: J3 is the angle of the forearm from the horizontal.
const char* const kFanuc = R"lua(
fanuc = robot.create{name = "fanuc", links = {
  {name = "turn", d = 0.33, a = 0.05, alpha = "-90 deg"},
  {name = "upper", a = 0.33, theta = "-90 deg"},
  {name = "fore", a = 0.035, alpha = "-90 deg"},
  {name = "roll", d = 0.335, alpha = "90 deg"},
  {name = "pitch", alpha = "-90 deg"},
  {name = "flange", d = 0.08}},
  axes = {{name = "J1", link = "turn"}, {name = "J2", link = "upper"},
    {name = "J3", link = "fore", sign = -1, coupled = {{link = "upper", ratio = -1}}},
    {name = "J4", link = "roll", sign = -1}, {name = "J5", link = "pitch", sign = -1},
    {name = "J6", link = "flange", sign = -1}}}
)lua";

TEST_F(MakerAxesTest, AreWhatTheDataSheetsSay) {
  run(R"lua(
-- Axis and point of each axis at the maker's zero [m], and the flange there; x of the flange points
-- down, z forwards.
local sheets = {
  kr5 = {  -- KUKA KR 5 arc: 400, 180, 600, 120, 620 mm; A1, A4 and A6 count clockwise
    {{0,0,-1}, {0,0,0.4}}, {{0,1,0}, {0.18,0,0.4}}, {{0,1,0}, {0.78,0,0.4}},
    {{-1,0,0}, {0.78,0,0.52}}, {{0,1,0}, {1.4,0,0.52}}, {{-1,0,0}, {1.4,0,0.52}},
    flange = {1.4, 0, 0.52}},
  irb140 = {  -- ABB IRB 140: 352, 70, 360, 380, 65 mm
    {{0,0,1}, {0,0,0.352}}, {{0,1,0}, {0.07,0,0.352}}, {{0,1,0}, {0.07,0,0.712}},
    {{1,0,0}, {0.07,0,0.712}}, {{0,1,0}, {0.45,0,0.712}}, {{1,0,0}, {0.45,0,0.712}},
    flange = {0.515, 0, 0.712}}}
local function mul(a, b)
  local c = {}
  for i = 1, 4 do
    c[i] = {}
    for j = 1, 4 do
      local s = 0
      for k = 1, 4 do s = s + a[i][k] * b[k][j] end
      c[i][j] = s
    end
  end
  return c
end
local function about(n, p, t)
  local x, y, z, c, s, v = n[1], n[2], n[3], math.cos(t), math.sin(t), 1 - math.cos(t)
  local r = {{c + x*x*v, x*y*v - z*s, x*z*v + y*s}, {y*x*v + z*s, c + y*y*v, y*z*v - x*s},
             {z*x*v - y*s, z*y*v + x*s, c + z*z*v}}
  local m = {}
  for i = 1, 3 do
    m[i] = {r[i][1], r[i][2], r[i][3], p[i] - r[i][1]*p[1] - r[i][2]*p[2] - r[i][3]*p[3]}
  end
  m[4] = {0, 0, 0, 1}
  return m
end
math.randomseed(7)
for name, sheet in pairs(sheets) do
  local arm = robot.get(name)
  arm:set{mass_source = "given"}  -- bodies need a provider of solids
  -- kr5's tool is KUKA's flange; irb140's is tool0, which is ABB's
  if name == "kr5" then arm:set_tool{position = {0, 0, 0}, rpy = {0, 0, math.pi}} end
  for _ = 1, 20 do
    local values, m = {}, {{1,0,0,0},{0,1,0,0},{0,0,1,0},{0,0,0,1}}
    for i = 1, 6 do
      values[i] = math.random() * 240 - 120
      m = mul(m, about(sheet[i][1], sheet[i][2], math.rad(values[i])))
    end
    local f, q = sheet.flange, arm:joints_from_axes{values = values}
    local at = arm:fk{q = q}.pose
    for i = 1, 3 do
      local p = m[i][1]*f[1] + m[i][2]*f[2] + m[i][3]*f[3] + m[i][4]
      assert(math.abs(at[i][4] - p) < 1e-9, name .. ": position")
      assert(math.abs(at[i][1] + m[i][3]) < 1e-9, name .. ": x of the flange")
      assert(math.abs(at[i][3] - m[i][1]) < 1e-9, name .. ": z of the flange")
    end
    for i, a in ipairs(arm:axes{q = q}) do assert(math.abs(a.value - values[i]) < 1e-9) end
  end
end)lua");
}

/// ros-industrial/fanuc#186: axes 2 and 3 of the model at 31.324 and -2.018 degrees are J3 =
/// -33.342 degrees on the pendant.
TEST_F(MakerAxesTest, CountFanucsThirdAxisFromTheHorizontal) {
  run(std::string(kFanuc) + R"lua(
local model = {math.rad(15.719), math.rad(31.324), -math.rad(-2.018), 0, 0, 0}
assert(math.abs(fanuc:axes{q = model}[3].value + 33.342) < 1e-9)
local q = fanuc:joints_from_axes{values = {15.719, 31.324, -33.342, 0, 0, 0}}
for i = 1, 6 do assert(math.abs(q[i] - model[i]) < 1e-12) end
local p = program.create{name = "j", source = [[
PROGRAM j;
BEGIN
  MOVE PTP MAIN_JOINT(15.719, 31.324, 2.018, -73.641, 101.125, 31.149);
ENDPROGRAM;
]]}
local out = p:post{target = "fanuc_tp", robot = "fanuc"}
local text = out.files[1].text
for name, value in pairs{J1 = "15.719", J2 = "31.324", J3 = "-33.342", J4 = "73.641", J5 = "-101.125", J6 = "-31.149"} do
  assert(text:match(name .. "=%s*(%S+) deg") == value, text)
end
for _, f in ipairs(out.faults) do assert(f.severity ~= "warning", f.message) end)lua");
}

TEST_F(MakerAxesTest, ArePostedWithAndWithoutAProfile) {
  run(R"lua(
robot.get("kr5"):set{mass_source = "given"}
controller.get{name = "kuka_krc"}
local p = program.create{name = "j", source = [[
PROGRAM j;
BEGIN
  MOVE PTP MAIN_JOINT(10.0, 45.0, 0.0, 20.0, 30.0, 40.0);
ENDPROGRAM;
]]}
for _, asked in ipairs{{target = "krl", robot = "kr5"}, {profile = "kuka_krc", robot = "kr5"}} do
  local out = p:post(asked)
  local text = ""
  for _, f in ipairs(out.files) do text = text .. f.text end
  local a = {}
  for name, value in text:gmatch("(A%d) (%-?[%d.]+)") do a[name] = tonumber(value) end
  assert(a.A1 == -10 and a.A2 == -45 and a.A3 == 90 and a.A4 == -20 and a.A5 == 30 and a.A6 == -40, text)
  assert(#out.faults == 0, out.faults[1] and out.faults[1].message)
end)lua");
}

TEST_F(MakerAxesTest, AreSaidWhereTheProfileContradictsThem) {
  run(R"lua(
robot.get("kr5"):set{mass_source = "given"}
record.create{kind = "controller", name = "cell", fields = {target = "krl", axes = {
  {name = "A1", joint = 1, sign = 1}, {name = "A2", joint = 3}, {name = "A3", joint = 2, offset = 5}}}}
local p = program.create{name = "j", source =
  "PROGRAM j;\nBEGIN\n  MOVE PTP MAIN_JOINT(10.0, 45.0, 0.0, 0.0, 30.0, 0.0);\nENDPROGRAM;\n"}
local out = p:post{profile = "cell", robot = "kr5"}
local told = ""
for _, f in ipairs(out.faults) do
  assert(f.severity == "warning")
  told = told .. f.message .. "\n"
end
assert(told:find('axis "A1" of controller "cell" has sign 1 instead of -1', 1, true), told)
assert(told:find('axis "A2" of controller "cell" has joint 3 instead of joint 2', 1, true), told)
assert(told:find("offset 5 instead of 90", 1, true), told)
assert((out.files[2].text .. out.files[1].text):find("A1 %-10")))lua");
}

TEST_F(MakerAxesTest, AreSaidOnceWhereTheyAreNotKnown) {
  run(R"lua(
robot.get("puma560"):set_axes{axes = {}}
local p = program.create{name = "j", source = [[
PROGRAM j;
BEGIN
  MOVE PTP MAIN_JOINT(10.0, 45.0, -100.0, 0.0, 30.0, 0.0);
  MOVE PTP MAIN_JOINT(20.0, 45.0, -100.0, 0.0, 30.0, 0.0);
ENDPROGRAM;
]]}
for _, target in ipairs{"krl", "rapid", "fanuc_tp"} do
  local out, n = p:post{target = target, robot = "puma560", check = true}, 0
  for _, f in ipairs(out.faults) do
    if f.message:find("the controller's axis convention is unknown", 1, true) then n = n + 1 end
  end
  assert(n == 1, target .. " says it " .. n .. " times")
end)lua");
}

/// Bits by KUKA's rules, of formulas of the arm in its plane and not of the program's kinematics.
TEST_F(MakerAxesTest, GiveStatusAndTurnOfKuka) {
  run(R"lua(
local arm = robot.get("kr5")
arm:set{mass_source = "given"}
arm:set_tool{position = {0, 0, 0}}
arm:set_link{link = "shoulder", lower = "-65 deg", upper = "180 deg"}
arm:set_link{link = "elbow", lower = "-105 deg", upper = "68 deg"}
local function rules(a)
  local up, fore = math.rad(a[2]), math.rad(a[2] + a[3])
  local x = 0.18 + 0.6*math.cos(up) + 0.62*math.cos(fore) + 0.12*math.sin(fore)
  local s = (x < 0 and 1 or 0) + (a[3] >= math.deg(math.atan(0.12, 0.62)) and 2 or 0) + (a[5] < 0 and 4 or 0)
  local t = 0
  for i = 1, 6 do if a[i] < 0 then t = t + (1 << (i - 1)) end end
  return s, t
end
local seen, checked = {}, 0
for _, wish in ipairs{{20, -60, 70, 30, 40, 50}, {-40, -60, 90, -130, -50, 10}, {10, -50, 0, 15, -35, 80},
                      {30, -150, 100, -20, 60, 170}, {-20, -55, 60, 100, -70, 20}} do
  local q, j = arm:joints_from_axes{values = wish}, {}
  for i = 1, 6 do j[i] = string.format("%.9f", math.deg(q[i])) end
  local at = arm:fk{q = q}
  local w = at.rpy
  local name = "p" .. checked
  local p = program.create{name = name, source = "PROGRAM " .. name .. ";\nVAR\n" ..
    string.format("  POSE: t := POSE(POSITION(%.9f, %.9f, %.9f), ORIZYX(%.12f, %.12f, %.12f));\n",
      at.position[1]*1000, at.position[2]*1000, at.position[3]*1000,
      math.deg(w[3]), math.deg(w[2]), math.deg(w[1])) ..
    "BEGIN\n  MOVE PTP MAIN_JOINT(" .. table.concat(j, ", ") .. ");\n  MOVE PTP t;\nENDPROGRAM;\n"}
  local out = p:post{target = "krl", robot = "kr5"}
  local text = ""
  for _, f in ipairs(out.files) do text = text .. f.text end
  local s, t = text:match(",S (%d+),T (%d+)")
  local ws, wt = rules(wish)
  assert(tonumber(s) == ws and tonumber(t) == wt,
    string.format("%s: S %s T %s for %d and %d\n%s", name, s, t, ws, wt, text))
  seen[ws], checked = true, checked + 1
end
local kinds = 0
for _ in pairs(seen) do kinds = kinds + 1 end
assert(kinds >= 3))lua");
}

/// STATUS 0 is in front with the elbow up for every arm, in a run as in a post.
TEST_F(MakerAxesTest, LeaveTheConfigurationToGeometry) {
  run(R"lua(
local arm = robot.get("irb140")
arm:set{mass_source = "given"}
arm:set_link{link = "shoulder", lower = "-180 deg", upper = "20 deg"}
arm:set_link{link = "elbow", lower = "-50 deg", upper = "230 deg"}
for _, wish in ipairs{{0, 10, 20, 0, 30, 0}, {30, -20, 10, 20, 40, -30}} do
  local q = arm:joints_from_axes{values = wish}
  local at = arm:fk{q = q}
  local w = at.rpy
  local name = "c" .. wish[1]
  local p = program.create{name = name, source = "PROGRAM " .. name .. ";\nVAR\n" ..
    string.format("  ROBTARGET: t := ROBTARGET(POSE(POSITION(%.9f, %.9f, %.9f), " ..
      "ORIZYX(%.12f, %.12f, %.12f)), 0, [0, 0], ADD_JOINT(0.0));\n",
      at.position[1]*1000, at.position[2]*1000, at.position[3]*1000,
      math.deg(w[3]), math.deg(w[2]), math.deg(w[1])) ..
    "BEGIN\n  MOVE PTP t;\nENDPROGRAM;\n"}
  local found = p:check_run{robot = "irb140", contacts = false, torques = false}
  assert(found.errors == 0, found.faults[1] and found.faults[1].message)
  local text = p:post{target = "rapid", robot = "irb140"}.files[1].text
  local cfx = text:match("%],%[%-?%d+,%-?%d+,%-?%d+,(%d+)%]")
  assert(cfx == "0", text)
end)lua");
}

/// A program of the controller keeps its numbers; joints follow where the robot is known.
TEST_F(MakerAxesTest, AreWhatProgramsOfControllersMean) {
  run(std::string(kFanuc) + R"lua(
local f = io.open("j3.ls", "w")
f:write([[
/PROG  J3
/ATTR
DEFAULT_GROUP	= 1,*,*,*,*;
/MN
   1:J P[1] 100% FINE ;
/POS
P[1]{
   GP1:
	UF : 0, UT : 0,
	J1=    15.719 deg,	J2=    31.324 deg,	J3=   -33.342 deg,
	J4=    73.641 deg,	J5=  -101.125 deg,	J6=   -31.149 deg
};
/END
]])
f:close()
local p = program.import{file = "j3.ls"}
os.remove("j3.ls")
local text = p:post{target = "fanuc_tp", robot = "fanuc"}.files[1].text
assert(text:match("J3=%s*(%S+) deg") == "-33.342", text)
local points = p:post{target = "joint_trajectory", robot = "fanuc"}
local all = ""
for _, file in ipairs(points.files) do all = all .. file.text end
local last
for each in all:gmatch("positions: %[([^%]]+)%]") do last = each end
assert(last, all)
local q = {}
for each in last:gmatch("[^, ]+") do q[#q + 1] = tonumber(each) end
assert(math.abs(q[2] - math.rad(31.324)) < 1e-5 and math.abs(q[3] - math.rad(2.018)) < 1e-5, last))lua");
}

/// FANUC R-2000iB/165F (312, 1075, 225, 1280 mm, and 270 mm to the tool), from its second axis:
/// pose, joints and configurations of one point as onerobotics.com published them in 2013 (The
/// perils of six axis robots): N with J5 below 0, F above.
const char* const kR2000 = R"lua(
fanuc = robot.create{name = "r2000", links = {
  {name = "turn", a = 0.312, alpha = "-90 deg"},
  {name = "upper", a = 1.075, theta = "-90 deg"},
  {name = "fore", a = 0.225, alpha = "-90 deg"},
  {name = "roll", d = 1.28, alpha = "90 deg"},
  {name = "pitch", alpha = "-90 deg"},
  {name = "flange", d = 0.27}},
  axes = {{name = "J1", link = "turn"}, {name = "J2", link = "upper"},
    {name = "J3", link = "fore", sign = -1, coupled = {{link = "upper", ratio = -1}}},
    {name = "J4", link = "roll", sign = -1}, {name = "J5", link = "pitch", sign = -1},
    {name = "J6", link = "flange", sign = -1}}}
published = {
  N = {7.962, -5.284, -36.250, 77.661, -51.975, -79.273},
  F = {7.962, -5.284, -36.250, -102.339, 51.975, 100.727}}
)lua";

TEST_F(MakerAxesTest, AreFanucsAtAPublishedPoseInBothWristConfigurations) {
  run(std::string(kR2000) + R"lua(
for letter, axes in pairs(published) do
  local at = fanuc:fk{q = fanuc:joints_from_axes{values = axes}}
  for i, want in ipairs{1.5, 0, 0.36} do assert(math.abs(at.position[i] - want) < 5e-5, letter) end
  for i, want in ipairs{135, -45, 0} do
    assert(math.abs(math.deg(at.rpy[i]) - want) < 2e-3, letter .. " rpy " .. i)
  end
end
-- What a program with this pose and configuration means, and what is written of the joints.
for letter, axes in pairs(published) do
  local name = "p_" .. letter:lower()
  local f = io.open(name .. ".ls", "w")
  f:write("/PROG  " .. name:upper() .. "\n/ATTR\nDEFAULT_GROUP	= 1,*,*,*,*;\n/MN\n" ..
    "   1:J P[1] 100% FINE ;\n/POS\nP[1]{\n   GP1:\n	UF : 0, UT : 0,		CONFIG : '" .. letter ..
    " U T, 0, 0, 0',\n	X =  1500.000  mm,	Y =     0.000  mm,	Z =   360.000  mm,\n" ..
    "	W =   135.000 deg,	P =   -45.000 deg,	R =     0.000 deg\n};\n/END\n")
  f:close()
  local p = program.import{file = name .. ".ls"}
  os.remove(name .. ".ls")
  local r = p:run{robot = "r2000", unbound = "free"}
  local q = {}
  for j = 1, 6 do
    local c = r:values("r2000.q" .. j)
    q[j] = c[#c]
  end
  for i, a in ipairs(fanuc:axes{q = q}) do
    assert(math.abs(a.value - axes[i]) < 2e-3, letter .. " " .. a.name .. " " .. a.value)
  end
  local text = p:post{target = "fanuc_tp", robot = "r2000"}.files[1].text
  assert(text:find("CONFIG : '" .. letter .. " U T", 1, true), text)
end)lua");
}

TEST_F(MakerAxesTest, GoWithALockedJointAndWithOneThatSlidesNow) {
  run(R"lua(
local arm = robot.get("ur5"):duplicate{name = "locked"}
for k, p in pairs(arm:poses()) do arm:remove_pose(type(k) == "string" and k or p.name) end
local names = {}
for i, a in ipairs(arm:axes{q = {0, 0, 0, 0, 0, 0}}) do names[i] = a.name end
arm:set_link{link = 6, joint = "fixed"}
local left = arm:axes{q = {0, 0, 0, 0, 0}}
assert(#left == 5 and left[5].name == names[5])
arm:set_link{link = 5, joint = "prismatic"}
local slid = arm:axes{q = {0, 0, 0, 0, 0.25}}[5]
assert(slid.name == names[5] and slid.value == 250)
)lua");
  std::string notes;
  for (const Message& m : app().messages.recent(1000))
    if (m.code == "maker_axis") notes += m.text + "\n";
  EXPECT_NE(notes.find("has no independent value now"), std::string::npos) << notes;
  EXPECT_NE(notes.find("counts as the joint of link"), std::string::npos) << notes;
}

/// The wrist of two arms whose axis 5 turns the other way round the same bend.
TEST_F(MakerAxesTest, LeaveTheWristToGeometry) {
  run(R"lua(
local kuka, abb, puma = robot.get("kr5"), robot.get("irb140"), robot.get("puma560")
for _, arm in ipairs{kuka, abb, puma} do arm:set{mass_source = "given"} end
-- In front, elbow up; axis 5 bends the hand down (STATUS 0) or up (4). KUKA's and ABB's axis 5 is
-- positive where it bends down; the joint of the puma's rows is negative there.
local tries = {
  {kuka, {0, -60, 90, 0, 30, 0}, 0}, {kuka, {0, -60, 90, 0, -30, 0}, 4},
  {abb, {0, 10, 20, 0, 30, 0}, 0}, {abb, {0, 10, 20, 0, -30, 0}, 4}}
for i, one in ipairs(tries) do
  local arm, axes, status = table.unpack(one)
  local at = arm:fk{q = arm:joints_from_axes{values = axes}}
  local w = at.rpy
  for _, asked in ipairs{0, 4} do
    local name = "w" .. i .. "_" .. asked
    local p = program.create{name = name, source = "PROGRAM " .. name .. ";\nVAR\n" ..
      string.format("  ROBTARGET: t := ROBTARGET(POSE(POSITION(%.9f, %.9f, %.9f), " ..
        "ORIZYX(%.12f, %.12f, %.12f)), %d, [0, 0], ADD_JOINT(0.0));\n",
        at.position[1]*1000, at.position[2]*1000, at.position[3]*1000,
        math.deg(w[3]), math.deg(w[2]), math.deg(w[1]), asked) ..
      "BEGIN\n  MOVE PTP t;\nENDPROGRAM;\n"}
    local r = p:run{robot = arm.name}
    local q = {}
    for j = 1, 6 do
      local c = r:values(arm.name .. ".q" .. j)
      q[j] = c[#c]
    end
    local five = arm:axes{q = q}[5].value
    assert((five < 0) == (asked == 4), name .. ": axis 5 at " .. five)
  end
end
-- The forearm of the puma at ready points up; joint 5 < 0 bends the hand forwards.
local q = {0, math.rad(45), math.rad(-135), 0, math.rad(-45), 0}
local at = puma:fk{q = q}
local w = at.rpy
local p = program.create{name = "wp", source = "PROGRAM wp;\nVAR\n" ..
  string.format("  POSE: t := POSE(POSITION(%.9f, %.9f, %.9f), ORIZYX(%.12f, %.12f, %.12f));\n",
    at.position[1]*1000, at.position[2]*1000, at.position[3]*1000,
    math.deg(w[3]), math.deg(w[2]), math.deg(w[1])) ..
  "  ROBTARGET: here;\nBEGIN\n  MOVE PTP MAIN_JOINT(0.0, 45.0, -135.0, 0.0, -45.0, 0.0);\n" ..
  "  here := R_ROBTARGET_ACT;\n  WRITE(here.STATUS);\nENDPROGRAM;\n"}
local r = p:run{robot = "puma560"}
local said = table.concat(r:notes(), "\n")
assert(said:find("wp: [012345678]"), said)
local status = tonumber(said:match("wp: (%d)"))
assert(status & 4 == 0, "STATUS " .. status))lua");
}

/// An arm with a parallelogram: A3 counts joints 2 and 3, A5 half of joint 4; and an external axis
/// that counts backwards from 100 mm. Values against sums by hand.
const char* const kCoupled = R"lua(
coupled = robot.create{name = "coupled", links = {
  {name = "turn", d = 0.4, a = 0.1, alpha = "-90 deg"},
  {name = "upper", a = 0.5, theta = "-90 deg"},
  {name = "fore", a = 0.05, alpha = "-90 deg"},
  {name = "roll", d = 0.5, alpha = "90 deg"},
  {name = "pitch", alpha = "-90 deg"},
  {name = "flange", d = 0.1}},
  axes = {{name = "A1", link = "turn"}, {name = "A2", link = "upper", sign = -1, offset = "90 deg"},
    {name = "A3", link = "fore", coupled = {{link = "upper", ratio = 1}}},
    {name = "A4", link = "roll"},
    {name = "A5", link = "pitch", offset = "-10 deg", coupled = {{link = "roll", ratio = 0.5}}},
    {name = "A6", link = "flange", sign = -1}}}
function target_cell(target)
  local axes = {}
  local pulses = target == "inform" and 1000 or nil
  for i = 1, 6 do axes[i] = {name = "A" .. i, joint = i, pulses = pulses} end
  axes[7] = {name = "E1", joint = 1, is_external = true, is_linear = true, sign = -1, offset = 100,
    pulses = pulses}
  record.create{kind = "controller", name = "cell_" .. target,
    fields = {target = target, axes = axes}}
  return "cell_" .. target
end
joint_source = [[
PROGRAM j;
BEGIN
  MOVE PTP JOINT(MAIN_JOINT(10.0, 20.0, 30.0, 40.0, 50.0, 60.0), ADD_JOINT(12.5));
ENDPROGRAM;
]]
-- Numbers of a text in their order, without those that are a part of a name.
function numbers_of(text)
  local out = {}
  for at, word in text:gmatch("()(%-?%d+%.?%d*[eE]?%-?%d*)") do
    local before = at > 1 and text:sub(at - 1, at - 1) or " "
    if not before:match("[%w_.]") and tonumber(word) then out[#out + 1] = tonumber(word) end
  end
  return out
end
function holds(text, wanted)
  local all = numbers_of(text)
  for first = 1, #all - #wanted + 1 do
    local same = true
    for i, v in ipairs(wanted) do same = same and math.abs(all[first + i - 1] - v) < 1e-3 end
    if same then return true end
  end
  return false
end
function text_of(out)
  local text = ""
  for _, f in ipairs(out.files) do text = text .. f.name .. "\n" .. f.text .. "\n" end
  return text
end
)lua";

/// q = (10, 20, 30, 40, 50, 60) degrees: A2 = 90 - 20, A3 = 30 + 20, A5 = 50 + 40 / 2 - 10, A6 =
/// -60; E1 = 100 - 12.5 mm.
TEST_F(MakerAxesTest, AreWrittenCoupledAndExternalByEveryTarget) {
  run(std::string(kCoupled) + R"lua(
local both = program.create{name = "j", source = joint_source}
local own = program.create{name = "k", source = joint_source:gsub("PROGRAM j", "PROGRAM k")
  :gsub("JOINT%(MAIN_JOINT(%b()), ADD_JOINT%(12.5%)%)", "MAIN_JOINT%1")}
local axes, rad = {10, 70, 50, 40, 60, -60}, {}
for i, v in ipairs(axes) do rad[i] = math.rad(v) end
-- How each writes them: numbers in a row, by name, or after the words around each.
local in_a_row = {rapid = true, melfa4 = true, melfa5 = true, as = true, pacscript = true, pdl2 = true}
local function named(text, words)
  local out = {}
  for _, word in ipairs(words) do out[#out + 1] = tonumber(text:match(word .. "%s*(%-?[%d.]+)")) end
  return out
end
local function words(pattern, last)
  local out = {}
  for i = 1, 6 do out[i] = pattern:format(i) end
  out[#out + 1] = last
  return out
end
local function same(found, wanted, who)
  for i, v in ipairs(wanted) do
    assert(found[i] and math.abs(found[i] - v) < 1e-3, who .. ": " .. tostring(found[i]) .. " for " .. v)
  end
end
local with_external = {10, 70, 50, 40, 60, -60, 87.5}
for _, target in ipairs{"krl", "rapid", "fanuc_tp", "melfa4", "melfa5", "as", "pacscript", "pdl2"} do
  local out = both:post{profile = target_cell(target), robot = "coupled"}
  local text = text_of(out)
  if target == "krl" then same(named(text, words("A%d", "E1")), with_external, target)
  elseif target == "fanuc_tp" then same(named(text, words("J%d=", "E1=")), with_external, target)
  elseif target == "pacscript" then
    assert(holds(text, axes) and text:find("EXA%(%(7, 87.5000%)%)"), text)
  else assert(holds(text, with_external), target .. "\n" .. text) end
  for _, f in ipairs(out.faults) do assert(f.severity == "note", target .. ": " .. f.message) end
end
-- Those without external axes say so, and write the others.
for _, target in ipairs{"inform", "val3", "urscript", "crcl", "joint_trajectory", "gcode"} do
  local good, why = pcall(both.post, both, {profile = target_cell(target), robot = "coupled"})
  assert(not good and (tostring(why):find("additional") or tostring(why):find("external axes")),
    target .. ": " .. tostring(why))
end
local written = {}
local function own_text(target)
  if written[target] then return text_of(written[target]), written[target] end
  local list = {}
  for i = 1, 6 do list[i] = {name = "A" .. i, joint = i, pulses = target == "inform" and 1000 or nil} end
  record.create{kind = "controller", name = "own_" .. target, fields = {target = target, axes = list}}
  local out = own:post{profile = "own_" .. target, robot = "coupled"}
  for _, f in ipairs(out.faults) do assert(f.severity == "note", target .. ": " .. f.message) end
  written[target] = out
  return text_of(out), out
end
assert(own_text("inform"):find("C00000=10000,70000,50000,40000,60000,%-60000"))
same(named(own_text("val3"), words('j%d="')), axes, "val3")
assert(holds(own_text("urscript"), rad))
local k = {}
for v in own_text("crcl"):gmatch("<JointPosition>([^<]+)") do k[#k + 1] = tonumber(v) end
same(k, axes, "crcl")
-- A trajectory of ROS counts joints.
local q = {}
for i = 1, 6 do q[i] = math.rad(10 * i) end
assert(holds(own_text("joint_trajectory"), q))
-- What readers make of the texts leads to the joints again.
for target, file in pairs{krl = "k.src", rapid = "k.mod", fanuc_tp = "k.ls", melfa4 = "k.prg",
    urscript = "k.script", val3 = "k/k.pjx"} do
  local _, out = own_text(target)
  os.execute("mkdir -p coupled_back/k")
  for _, f in ipairs(out.files) do
    local h = assert(io.open("coupled_back/" .. f.name, "w"))
    h:write(f.text)
    h:close()
  end
  local first
  for _, f in ipairs(out.files) do
    if f.name:lower() == file then first = f.name end
  end
  local back = program.import{file = "coupled_back/" .. assert(first, target), name = "back_" .. target}
  local points = back:post{target = "joint_trajectory", robot = "coupled"}
  assert(holds(text_of(points), q), target .. "\n" .. text_of(points) .. back:source())
  os.execute("rm -r coupled_back")
end)lua");
}

TEST_F(MakerAxesTest, AreShownBesideTheJoints) {
  run(R"lua(
local kuka = robot.get("kr5")
kuka:set{mass_source = "given"}
assert(kuka:overview():find("A2 = -q2 (-180 to 65 deg), A3 = q3 + 90 deg (-15 to 158 deg)", 1, true),
  kuka:overview())
assert(kuka:joints()[2].axis == "A2" and robot.get("stanford"):joints()[2].axis == nil)
-- Inverse kinematics beyond a limit.
local q = {0, math.rad(60), math.rad(75), 0, math.rad(30), 0}
local s = kuka:solve_ik{target = kuka:fk{q = q}.pose, seed = q, limits = "ignore", all = true}
-- A recording's columns: KUKA's senses and zeros by hand, in SI.
local cell = world.create{name = "cell"}
cell:add_robot{robot = kuka, name = "arm", q = {0.1, 0.9, 0.2, 0.3, 0.4, 0.5}}
task.create{name = "go", steps = {{step = "move", joints = {0.2, 1.1, 0.3, 0.2, 0.5, 0.4}}}}
cell:add_task{task = "go", robot = "arm"}
local r = cell:run_task{task = "go"}
r:compute{quantities = {"axes"}, robot = "arm"}
for i, rule in ipairs{{-1, 0}, {-1, 0}, {1, math.pi / 2}, {-1, 0}, {1, 0}, {-1, 0}} do
  local joint, axis = r:values("arm.q" .. i), r:values("arm.axis_A" .. i)
  for k = 1, #joint do assert(math.abs(axis[k] - rule[1] * joint[k] - rule[2]) < 1e-12) end
end
local none, why = pcall(function()
  local other = world.create{name = "other"}
  other:add_robot{robot = "stanford", name = "s"}
  task.create{name = "wait", steps = {{step = "wait", time = 0.1}}}
  other:add_task{task = "wait", robot = "s"}
  other:run_task{task = "wait"}:compute{quantities = {"axes"}, robot = "s"}
end)
assert(not none and tostring(why):find("the maker's axes of the robot are unknown"), why)
-- A program beyond a limit.
local prog = program.create{name = "beyond", source =
  "PROGRAM beyond;\nBEGIN\n  MOVE PTP MAIN_JOINT(0.0, 60.0, 75.0, 0.0, 30.0, 0.0);\nENDPROGRAM;\n"}
local found = prog:check_run{robot = "kr5", contacts = false, torques = false}
assert(found.faults[1].message:find("axis A3 at 165 deg (-15 to 158 deg), joint 3 of", 1, true),
  found.faults[1].message))lua");
}

TEST_F(MakerAxesTest, RefuseWhatCannotBeTurnedRound) {
  run(kFanuc);
  const auto refused = [&](const char* axes, const char* sentence) {
    const std::string told = eval(std::string("fanuc:set_axes{axes = {") + axes + "}}");
    EXPECT_NE(told.find(sentence), std::string::npos) << told;
  };
  refused("{name = \"J1\", link = \"turn\"}", "no maker's axis is given for joint \"upper\"");
  refused("{name = \"J1\", link = \"turn\", sign = 3}", "sign");
  run(R"lua(
local function refused(more, sentence)
  local r = robot.create{name = "r", links = {{name = "a"}, {name = "b"}}}
  local first = {name = "J1", link = "a"}
  for k, v in pairs(more) do first[k] = v end
  local good, why = pcall(r.set_axes, r, {axes = {first, {name = "J2", link = "b"}}})
  assert(not good and tostring(why):find(sentence, 1, true), tostring(why))
  r:remove()
end
refused({link = "b"}, "no maker's axis is given for joint")
refused({name = "J2"}, "named")
refused({sign = 0}, "1 or -1")
refused({unit = "mm"}, "turns")
refused({coupled = {{link = "a"}}}, "twice")
refused({coupled = {{link = "b", ratio = 1e9}}}, "ratio")
refused({lower = 1, upper = 0}, "limits"))lua");
  // Two axes that are the same sum of two joints.
  run(R"lua(
local flat = robot.create{name = "flat", links = {{name = "a"}, {name = "b"}}}
local good, why = pcall(flat.set_axes, flat, {axes = {
  {name = "J1", link = "a", coupled = {{link = "b"}}}, {name = "J2", link = "b", coupled = {{link = "a"}}}}})
assert(not good and tostring(why):find("linearly dependent"), why))lua");
}

TEST_F(MakerAxesTest, AreSavedAndReadAgain) {
  run(std::string(kFanuc) + R"lua(
local text = fanuc:text()
assert(text:find("axis J3 { link fore  sign -1  coupled { link upper  ratio -1 } }", 1, true), text)
fanuc:save{file = "maker_axes_test.rbt"}
fanuc:remove()
local again = robot.load("maker_axes_test.rbt")
os.remove("maker_axes_test.rbt")
assert(again:text() == text)
assert(math.abs(again:axes{q = {0, 0.3, 0.2, 0, 0, 0}}[3].value + math.deg(0.5)) < 1e-9)
again:remove_link("flange")
assert(#again:axes() == 5))lua");
}

}  // namespace
}  // namespace robomosp
