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
  arm:set_tool{position = {0, 0, 0}, rpy = {0, 0, name == "kr5" and math.pi or 0}}
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
      -- of the irb140's rows z of the last frame points up there
      local down = name == "kr5" and at[i][1] or -at[i][3]
      assert(math.abs(down + m[i][3]) < 1e-9, name .. ": x of the flange")
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
robot.get("puma560")
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
    if f.message:find("how the controller counts its axes is not known", 1, true) then n = n + 1 end
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
	UF : 0, UT : 1,
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

TEST_F(MakerAxesTest, RefuseWhatCannotBeTurnedRound) {
  run(kFanuc);
  const auto refused = [&](const char* axes, const char* sentence) {
    const std::string told = eval(std::string("fanuc:set_axes{axes = {") + axes + "}}");
    EXPECT_NE(told.find(sentence), std::string::npos) << told;
  };
  refused("{name = \"J1\", link = \"turn\"}", "none is that of joint \"upper\"");
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
refused({link = "b"}, "none is that of joint")
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
assert(not good and tostring(why):find("depend on each other"), why))lua");
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
