// SPDX-License-Identifier: Apache-2.0
// The library's robots against their makers' sheets: ranges and speeds of the axes in the makers'
// own terms, reach, home pose and mass. The table was written from the sheets, not from the files
// of the library; `sign` and `zero` lead from a maker's axis to our joint.
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "support/lua_program.h"

namespace robomosp {
namespace {

/// A maker's axis [deg, mm; deg/s, mm/s]: axis = sign * joint + zero. A speed of 0 = no sheet.
struct SheetAxis {
  double lower, upper;
  double speed = 0;
  double sign = 1, zero = 0;
  bool slides = false;
};
struct SheetRobot {
  const char* name;
  std::vector<SheetAxis> axes;
  const char* stretched;  ///< the maker's axes where the reach is measured
  int wrist;              ///< link with the point that the reach is measured to
  const char* from;       ///< what it is measured from: "axis 1", or a point "{x, y, z}" [m]
  double reach, within;   ///< [mm]
};

std::vector<SheetAxis> sheet_turns(std::vector<double> ranges, std::vector<double> speeds = {}) {
  std::vector<SheetAxis> out;
  for (std::size_t i = 0; i < ranges.size(); ++i)
    out.push_back({-ranges[i], ranges[i], speeds.empty() ? 0 : speeds[i]});
  return out;
}

std::vector<SheetRobot> sheets() {
  return {
      // KUKA KR 5 arc: ranges and speeds of kuka_kr5_support of ros-industrial, after KUKA's
      // specification; reach 1412 mm to the intersection of axes 4 and 5. Positive A1, A4 and A6
      // turn against ours.
      {"kr5",
       {{-155, 155, 154, -1},
        {-180, 65, 154, -1},
        {-15, 158, 228, 1, 90},
        {-350, 350, 343, -1},
        {-130, 130, 384},
        {-350, 350, 721, -1}},
       "{0, 0, math.deg(math.atan(0.12, 0.62)), 0, 0, 0}",
       4,
       "axis 1",
       1412,
       1},
      // ABB IRB 140: working range of abb_irb140_support of ros-industrial, after 3HAC041346-001
      // Rev Q; velocities of ARTE's IRB140; reach 810 mm to axis 5.
      {"irb140",
       {{-180, 180, 200},
        {-90, 110, 200, 1, 90},
        {-230, 50, 260, 1, -180},
        {-200, 200, 360},
        {-115, 115, 360},
        {-400, 400, 450, 1, 90}},
       "{0, 90, -90, 0, 0, 0}",
       4,
       "axis 1",
       810,
       0.01},
      // Unimation PUMA 560: Fu, Gonzalez, Lee, Robotics, 1987; reach of the wrist's middle 0.878 m
      // from the shoulder's (864 mm in the plane of the arm). Its zero in the rows of puma560:
      // PumasAreOneRobot below.
      {"puma560",
       {{-160, 160},
        {-225, 45, 0, 1, -180},
        {-45, 225, 0, 1, 180},
        {-110, 170},
        {-100, 100},
        {-266, 266}},
       "{0, -180, 90 + math.deg(math.atan(0.0203, 0.4318)), 0, 0, 0}",
       4,
       "{0, 0, 0}",
       878,
       2},
      {"puma560_mdh",
       {{-160, 160}, {-225, 45}, {-45, 225}, {-110, 170}, {-100, 100}, {-266, 266}},
       "{0, 0, 90 + math.deg(math.atan(0.0203, 0.4331)), 0, 0, 0}",
       4,
       "{0, 0, 0}",
       878,
       2},
      // Franka Emika Panda, data sheet and Franka Control Interface documentation (2.175 and
      // 2.61 rad/s). The sheet's 855 mm are 3 mm less than the rows reach, shoulder to flange.
      {"panda",
       {{-166, 166, 124.6},
        {-101, 101, 124.6},
        {-166, 166, 124.6},
        {-176, -4, 124.6},
        {-166, 166, 149.5},
        {-1, 215, 149.5},
        {-166, 166, 149.5}},
       "{0, 75, 0, -28, 0, 155, 0}",
       7,
       "{0, 0, 0.333}",
       855,
       3},
      // Universal Robots UR5 and UR10e, data sheets: all axes +-360 deg. The sheets' reach of 850
      // and 1300 mm is less than the flange's: it is what they recommend.
      {"ur5", sheet_turns({360, 360, 360, 360, 360, 360}, {180, 180, 180, 180, 180, 180}),
       "{0, 0, 0, -90, 0, 0}", 5, "axis 1", 850, 70},
      {"ur10e", sheet_turns({360, 360, 360, 360, 360, 360}, {120, 120, 180, 180, 180, 180}),
       "{0, 0, 0, -90, 0, 0}", 5, "axis 1", 1300, 20},
      // KUKA LBR iiwa 14 R820, data sheet: reach 820 mm from axis 2 to the intersection of the
      // wrist's axes.
      {"iiwa14", sheet_turns({170, 120, 170, 120, 170, 120, 175}, {85, 85, 100, 75, 130, 135, 135}),
       "{0, 0, 0, 0, 0, 0, 0}", 6, "{0, 0, 0.36}", 820, 0.01},
      // Mitsubishi PA-10, S1 to W2: ranges of the Choreonoid model, speeds of the data sheet,
      // lengths 450 + 480 mm (7CE) and 450 + 500 mm (older arm) from the shoulder to the wrist.
      {"pa10", sheet_turns({177, 94, 174, 137, 255, 165, 360}, {57, 57, 114, 114, 360, 360, 360}),
       "{0, 0, 0, 0, 0, 0, 0}", 6, "{0, 0, 0.317}", 930, 0.01},
      {"pa10_nus",
       sheet_turns({177, 94, 174, 137, 255, 165, 360}, {57, 57, 114, 114, 360, 360, 360}),
       "{0, 0, 0, 0, 0, 0, 0}", 6, "{0, 0, 0.315}", 950, 0.01},
      // Stanford arm: the boom slides by 12 to 50 inches, from the shoulder to the wrist.
      {"stanford",
       {{-170, 170},
        {-170, 170},
        {12 * 25.4, 50 * 25.4, 0, 1, 0, true},
        {-170, 170},
        {-90, 90},
        {-170, 170}},
       "{0, 0, 50 * 25.4, 0, 0, 0}",
       3,
       "{0, 0.154, 0.412}",
       50 * 25.4,
       0.01},
      // Adept Cobra s600, data sheet: joint ranges and speeds, reach 600 mm.
      {"cobra600",
       {{-105, 105, 386}, {-150, 150, 720}, {0, 210, 1100, 1, 0, true}, {-360, 360, 1200}},
       "{0, 0, 0, 0}",
       4,
       "axis 1",
       600,
       0.01},
  };
}

class LibrarySheets : public test::LuaProgramTest {
 protected:
  void SetUp() override {
    LuaProgramTest::SetUp();
    run(R"(
function joints(axes, values)
  local q = {}
  for i, a in ipairs(axes) do q[i] = a.sign * (values[i] - a.zero) * a.unit end
  return q
end
function named(arm, pose) return arm:pose_values{name = pose} end
function apart(p, from)
  if from == "axis 1" then return math.sqrt(p[1] ^ 2 + p[2] ^ 2) end
  return math.sqrt((p[1] - from[1]) ^ 2 + (p[2] - from[2]) ^ 2 + (p[3] - from[3]) ^ 2)
end
function within(q, links)
  for i, l in ipairs(links) do
    if q[i] < l.lower - 1e-4 or q[i] > l.upper + 1e-4 then return l.name .. " at " .. q[i] end
  end
  return "yes"
end)");
  }
  /// Sets the Lua variables `arm`, `links` and `axes`.
  void use(const SheetRobot& sheet) {
    std::string axes = "axes = {";
    for (const SheetAxis& a : sheet.axes) {
      const auto number = [](double v) { return std::to_string(v); };
      axes += "{lower = " + number(a.lower) + ", upper = " + number(a.upper) +
              ", speed = " + number(a.speed) + ", sign = " + number(a.sign) +
              ", zero = " + number(a.zero) + ", unit = " + (a.slides ? "1e-3" : "math.pi / 180") +
              "},";
    }
    run(axes + "}\narm = robot.get('" + sheet.name + "')\nlinks = arm:links()");
  }
};

// FCI documents 2.8973 rad where the Panda's sheet has 166 deg, and so on: within 0.005 deg.
TEST_F(LibrarySheets, RangesAndSpeedsOfTheAxesAreTheMakers) {
  for (const SheetRobot& sheet : sheets()) {
    use(sheet);
    EXPECT_EQ(eval(R"(
problems = ""
for i, a in ipairs(axes) do
  local l = links[i]
  local first, last = a.sign * (a.lower - a.zero) * a.unit, a.sign * (a.upper - a.zero) * a.unit
  if first > last then first, last = last, first end
  if math.abs(l.lower - first) > 1e-4 or math.abs(l.upper - last) > 1e-4 then
    problems = problems .. string.format(" %s: %.3f to %.3f for %.3f to %.3f;", l.name, l.lower / a.unit,
      l.upper / a.unit, first / a.unit, last / a.unit)
  end
  if a.speed > 0 and math.abs(l.max_velocity / a.unit - a.speed) > 0.06 then
    problems = problems .. " " .. l.name .. " turns at " .. l.max_velocity / a.unit .. ";"
  end
end
return #axes == #links and problems or "other axes")"),
              "")
        << sheet.name;
  }
}

TEST_F(LibrarySheets, EveryRobotReachesWhatItsSheetSays) {
  for (const SheetRobot& sheet : sheets()) {
    use(sheet);
    run("q = joints(axes, " + std::string(sheet.stretched) + ")");
    EXPECT_EQ(eval("within(q, links)"), "yes") << sheet.name;
    const std::string from =
        sheet.from == std::string("axis 1") ? "'axis 1'" : std::string(sheet.from);
    const double reach =
        std::stod(eval("string.format('%.6f', 1000 * apart(arm:fk{q = q, all = true}.links[" +
                       std::to_string(sheet.wrist) + "].position, " + from + "))"));
    EXPECT_NEAR(reach, sheet.reach, sheet.within) << sheet.name;
    EXPECT_GT(reach, sheet.reach - 1.1) << sheet.name;
  }
}

// Each axis at both ends while the others are at the robot's home: the joint's own link stands
// turned about the axis from home as far as the maker's numbers say, and the solver of the inverse
// kinematics takes the place, where it knows the arm.
TEST_F(LibrarySheets, EveryAxisGoesToBothEndsOfItsRange) {
  for (const SheetRobot& sheet : sheets()) {
    use(sheet);
    EXPECT_EQ(eval(R"(
problems = ""
local home = named(arm, "home")
for i, a in ipairs(axes) do
  for _, value in ipairs{a.lower, a.upper} do
    local q = {}
    for j, v in ipairs(home) do q[j] = v end
    q[i] = a.sign * (value - a.zero) * a.unit
    local l = links[i]
    local is = within(q, links)
    if is ~= "yes" then problems = problems .. " " .. is .. " for " .. value .. ";" end
    local s = arm:solve_ik{target = arm:fk{q = q}.pose, seed = q}
    if s.status ~= "solved" or s.position_error > 1e-5 then
      problems = problems .. " " .. l.name .. " " .. value .. ": " .. s.status .. ";"
    end
  end
end
return problems)"),
              "")
        << sheet.name;
  }
}

using SheetMatrix = std::array<double, 16>;
SheetMatrix sheet_turn(char axis, double degrees) {
  const double c = std::cos(degrees * std::numbers::pi / 180),
               s = std::sin(degrees * std::numbers::pi / 180);
  if (axis == 'x') return {1, 0, 0, 0, 0, c, -s, 0, 0, s, c, 0, 0, 0, 0, 1};
  if (axis == 'y') return {c, 0, s, 0, 0, 1, 0, 0, -s, 0, c, 0, 0, 0, 0, 1};
  return {c, -s, 0, 0, s, c, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
}
SheetMatrix sheet_shift(double x, double y, double z) {
  return {1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z, 0, 0, 0, 1};
}
SheetMatrix sheet_chain(const std::vector<SheetMatrix>& all) {
  SheetMatrix t{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  for (const SheetMatrix& m : all) {
    SheetMatrix next{};
    for (std::size_t i = 0; i < 4; ++i)
      for (std::size_t j = 0; j < 4; ++j)
        for (std::size_t k = 0; k < 4; ++k) next[4 * i + j] += t[4 * i + k] * m[4 * k + j];
    t = next;
  }
  return t;
}

// The axes in the library's records are those of the table, which was written apart from them.
TEST_F(LibrarySheets, AxesOfTheRecordsAreTheMakers) {
  for (const SheetRobot& sheet : sheets()) {
    use(sheet);
    if (sheet.name == std::string("stanford")) {  // a laboratory's arm
      EXPECT_EQ(eval("#arm:axes()"), "0");
      continue;
    }
    EXPECT_EQ(eval(R"(
problems = ""
local shown = arm:axes{q = named(arm, "home")}
for i, a in ipairs(axes) do
  local x = shown[i]
  if x.link ~= links[i].name or x.sign ~= a.sign or math.abs(x.offset - a.zero) > 1e-9
      or math.abs(x.lower - a.lower) > 1e-2 or math.abs(x.upper - a.upper) > 1e-2 then
    problems = problems .. string.format(" %s: %d q + %.3f, %.3f to %.3f;", x.name, x.sign, x.offset,
      x.lower, x.upper)
  end
end
return #shown == #axes and problems or "other axes")"),
              "")
        << sheet.name;
  }
}

// Two models of one robot by other authors, puma560 after Paul and puma560_mdh after Armstrong,
// Khatib and Burdick, whose joints are Unimation's: at the same axes the flange is at the same
// place and looks the same way, the bases turned by half a turn and lengths different by 1.4 mm.
TEST_F(LibrarySheets, PumasAreOneRobot) {
  EXPECT_EQ(eval(R"(
local a, b = robot.get("puma560"), robot.get("puma560_mdh")
math.randomseed(3)
local most, turned = 0, 0
for _ = 1, 50 do
  local v = {}
  for i, x in ipairs(a:axes()) do v[i] = x.lower + (x.upper - x.lower) * math.random() end
  local p, s = a:fk{q = a:joints_from_axes{values = v}}.pose, b:fk{q = b:joints_from_axes{values = v}}.pose
  for i = 1, 3 do
    local sign = i < 3 and -1 or 1
    most = math.max(most, math.abs(sign * p[i][4] - s[i][4]))
    turned = math.max(turned, math.abs(sign * p[i][3] - s[i][3]))
    -- x of the tool frames are opposite, too
    turned = math.max(turned, math.abs(sign * p[i][1] + s[i][1]))
  end
end
return most < 2e-3 and turned < 1e-9 and "one" or most .. " " .. turned)"),
            "one");
}

// The chains are those of kuka_kr5_support, abb_irb140_support and kuka_lbr_iiwa_support of
// ros-industrial, of adept_cobra_s600_support with the signs of its bridge on the controller, and
// of the PA-10 of OpenHRP and Choreonoid turned by a quarter, which turn by the makers' axes: signs
// and zeros of the table against another description of the same arms. Of the flange's face the
// places are compared: what a flange calls x is free.
TEST_F(LibrarySheets, SignsAndZerosAgreeWithTheMakersChains) {
  const std::vector<std::vector<double>> tries{
      {0, 0, 0, 0, 0, 0},         {155, 65, 158, 90, 100, 30}, {-155, -90, 90, -75, -130, 200},
      {20, -40, 30, 50, 60, -70}, {-90, -89, 50, 100, 40, 10}, {100, 60, -14, -200, -60, 0}};
  for (const SheetRobot& sheet : sheets()) {
    const std::string name = sheet.name;
    const bool is_iiwa = name == "iiwa14", is_pa10 = name == "pa10" || name == "pa10_nus";
    const bool is_cobra = name == "cobra600";
    if (name != "kr5" && name != "irb140" && !is_iiwa && !is_pa10 && !is_cobra) continue;
    use(sheet);
    for (std::vector<double> a : tries) {
      if (is_iiwa || is_pa10) a.push_back(25);
      if (is_cobra) a = {a[0], a[1], std::fabs(a[2]), a[3]};
      const double fore = name == "pa10" ? 0.48 : 0.5, flange = name == "pa10" ? 0.07 : 0.08;
      const SheetMatrix t =
          is_iiwa
              ? sheet_chain({sheet_turn('z', a[0]), sheet_shift(0, 0, 0.36), sheet_turn('y', a[1]),
                             sheet_turn('z', a[2]), sheet_shift(0, 0, 0.42), sheet_turn('y', -a[3]),
                             sheet_turn('z', a[4]), sheet_shift(0, 0, 0.4), sheet_turn('y', a[5]),
                             sheet_turn('z', a[6]), sheet_shift(0, 0, 0.126)})
          : is_pa10 ? sheet_chain(
                          {sheet_turn('z', a[0]), sheet_shift(0, 0, name == "pa10" ? 0.317 : 0.315),
                           sheet_turn('y', a[1]), sheet_turn('z', a[2]), sheet_shift(0, 0, 0.45),
                           sheet_turn('y', a[3]), sheet_turn('z', a[4]), sheet_shift(0, 0, fore),
                           sheet_turn('y', a[5]), sheet_turn('z', a[6]), sheet_shift(0, 0, flange)})
          : is_cobra ? sheet_chain({sheet_shift(0, 0, 0.387), sheet_turn('z', a[0]),
                                    sheet_shift(0.325, 0, 0), sheet_turn('z', a[1]),
                                    sheet_shift(0.275, 0, -a[2] / 1000)})
          : name == "kr5"
              ? sheet_chain({sheet_shift(0, 0, 0.4), sheet_turn('z', -a[0]),
                             sheet_shift(0.18, 0, 0), sheet_turn('y', a[1]), sheet_shift(0.6, 0, 0),
                             sheet_turn('y', a[2]), sheet_shift(0.62, 0, 0.12),
                             sheet_turn('x', -a[3]), sheet_turn('y', a[4]),
                             sheet_shift(0.115, 0, 0)})
              : sheet_chain({sheet_turn('z', a[0]), sheet_shift(0.07, 0, 0.352),
                             sheet_turn('y', a[1]), sheet_shift(0, 0, 0.36), sheet_turn('y', a[2]),
                             sheet_shift(0.38, 0, 0), sheet_turn('x', a[3]), sheet_turn('y', a[4]),
                             sheet_shift(0.065, 0, 0)});
      std::string values;
      for (const double v : a) values += std::to_string(v) + ", ";
      run("p = arm:fk{q = joints(axes, {" + values + "})}.position");
      for (std::size_t i = 0; i < 3; ++i)
        EXPECT_NEAR(std::stod(eval("string.format('%.9f', p[" + std::to_string(i + 1) + "])")),
                    t[4 * i + 3], 1e-6)
            << name << " at " << values;
    }
  }
}

// KUKA's home, A1 to A6 at 0, -90, 90, 0, 0, 0: the flange is 915 mm before axis 1 and 1120 mm
// above the floor, and looks forwards with its x down. ABB's zero: the wrist is 450 mm before
// axis 1.
TEST_F(LibrarySheets, MakersHomesAreReached) {
  EXPECT_EQ(eval(R"(
arm = robot.get("kr5")
s = arm:solve_ik{target = pose(0.915, 0, 1.12, rpy(0, math.pi / 2, 0)), seed = named(arm, "home")}
return s.status)"),
            "solved");
  for (int i = 1; i <= 6; ++i)
    EXPECT_EQ(eval("math.abs(s.q[" + std::to_string(i) + "] - ({0, math.pi / 2, 0, 0, 0, 0})[" +
                   std::to_string(i) + "]) < 1e-6"),
              "true")
        << eval("s.q");
  EXPECT_EQ(eval(R"(
local f = robot.get("kr5"):fk{q = named(robot.get("kr5"), "maker_home")}
local z, x = f.pose[1][3], f.pose[3][1]
return string.format("%.3f %.3f %.3f z %.3f x %.3f", f.position[1], f.position[2], f.position[3], z, x))"),
            "0.915 0.000 1.120 z 1.000 x -1.000");
  EXPECT_EQ(eval(R"(
local f = robot.get("irb140"):fk{q = named(robot.get("irb140"), "maker_zero")}
return string.format("%.3f %.3f %.3f", f.position[1], f.position[2], f.position[3]))"),
            "0.515 0.000 0.712");
}

}  // namespace
}  // namespace robomosp
