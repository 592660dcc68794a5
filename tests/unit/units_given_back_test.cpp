// SPDX-License-Identifier: Apache-2.0
// Arrays of joint values, rates and torques carry units that a recording takes back, column by
// column where the joints differ; tables of many states are the matrices they say.
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "support/lua_program.h"

namespace robomosp {
namespace {

class UnitsGivenBack : public test::LuaProgramTest {
 protected:
  void SetUp() override {
    LuaProgramTest::SetUp();
    run(R"(
      local body = {mass = 1, com = {0, 0, 0.1}, inertia = {0.01, 0.01, 0.01, 0, 0, 0}}
      local function link(fields)
        for k, v in pairs(body) do fields[k] = v end
        return fields
      end
      turns = robot.create{name = "turns", links = {link{a = 0.3}, link{a = 0.2}}}
      slides = robot.create{name = "slides", links = {link{joint = "prismatic"}}}
      mixed = robot.create{name = "mixed",
        links = {link{a = 0.3}, link{joint = "prismatic", alpha = 0.5}, link{a = 0.2}}}
      ball = robot.create{name = "ball",
        links = {link{a = 0.3}, link{joint = "spherical", origin = {0.1, 0, 0}}}}
      function units_of(values)
        local out = {}
        for i, c in ipairs(recording.create{columns = {{name = "x", values = values}}}:columns()) do
          out[i] = c.unit == "" and "none" or c.unit
        end
        return table.concat(out, "; ")
      end
    )");
  }
};

TEST_F(UnitsGivenBack, AccelerationsAndTorquesOfAlikeJointsHaveTheirUnit) {
  EXPECT_EQ(eval("turns:forward_dynamics{q = {0.1, 0.2}}:unit()"), "rad/s^2");
  EXPECT_EQ(eval("slides:forward_dynamics{q = {0.1}}:unit()"), "m/s^2");
  EXPECT_EQ(eval("units_of(turns:forward_dynamics{q = {0.1, 0.2}})"), "rad/s^2");
  EXPECT_EQ(eval("units_of(slides:inverse_dynamics{q = {0.1}})"), "N");
  EXPECT_EQ(eval("units_of(turns:gravity_torques{q = {{0, 0}, {0.1, 0.2}}})"), "N m; N m");
}

TEST_F(UnitsGivenBack, MatricesOfMixedJointsHaveAUnitAColumn) {
  run("Q = {{0.1, 0.2, 0.3}, {0.2, 0.1, 0}}");
  EXPECT_EQ(eval("units_of(mixed:forward_dynamics{q = Q})"), "rad/s^2; m/s^2; rad/s^2");
  EXPECT_EQ(eval("units_of(mixed:inverse_dynamics{q = Q})"), "N m; N; N m");
  // The numbers stay as they are.
  EXPECT_EQ(eval("local a = mixed:forward_dynamics{q = Q}\n"
                 "local r = recording.create{columns = {{name = 'x', values = a}}}\n"
                 "return r:values('x2')[2] == a[2][2]"),
            "true");
  // A ball has three velocities, whose joint torques are moments.
  EXPECT_EQ(eval("units_of(ball:inverse_dynamics{q = {{0, 1, 0, 0, 0}, {1, 1, 0, 0, 0}}})"),
            "N m; N m; N m; N m");
}

TEST_F(UnitsGivenBack, ConfigurationsHaveUnitsWhereverTheyComeFrom) {
  run("mixed:set_pose{name = 'p', q = {0.1, 0.2, 0.3}} cell = world.create{name = 'cell'}\n"
      "cell:add_robot{robot = mixed, name = 'm'}");
  for (const char* q : {"mixed:poses().p", "mixed:joint_values()", "mixed:set_joints{q = 'p'}",
                        "mixed:set_joint{joint = 2, value = 0.3}",
                        "mixed:add_joints{q = {0.1, 0, 0}}", "cell:robots()[1].q"})
    EXPECT_EQ(eval(std::string("(") + q + "):unit()"), "rad, m, rad") << q;
  EXPECT_EQ(eval("mixed:set_joints{q = 'p', angles = 'degrees'}:unit()"), "deg, m, deg");
  EXPECT_EQ(eval("ball:poses().none"), "nil");
}

TEST_F(UnitsGivenBack, ResidualsOfLoopsAndPlacesInOtherCoordinatesHaveThem) {
  for (const auto& [kind, unit] : {std::pair<const char*, const char*>{"point", "m"},
                                   {"revolute", "m, m, m, rad, rad"},
                                   {"weld", "m, m, m, rad, rad, rad"}}) {
    run(std::string("l = robot.create{name = '") + kind + "', links = {{a = 0.3}, {a = 0.2}}}\n" +
        "l:add_loop{name = 'pin', kind = '" + kind + "', a = {link = 2}, b = {link = 'base'}}");
    EXPECT_EQ(eval("l:loop_error{q = {0, 0}}.residual:unit()"), unit) << kind;
  }
  run("cell = world.create{name = 'bench'}\n"
      "cell:add_frame{name = 'a', cylindrical = {1, 0.2, 3}}\n"
      "cell:add_frame{name = 'b', spherical = {1, 0.2, 0.3}}\n"
      "cell:add_frame{name = 'c', position = {1, 0.2, 0.3}}");
  EXPECT_EQ(eval("cell:frames()[1].placement.cylindrical:unit()"), "m, rad, m");
  EXPECT_EQ(eval("cell:frames()[2].placement.spherical:unit()"), "m, rad, rad");
  EXPECT_EQ(eval("cell:frames()[3].placement.position:unit()"), "m");
}

TEST_F(UnitsGivenBack, OneColumnOfSeveralUnitsIsRefused) {
  const std::string said = eval("units_of(mixed:forward_dynamics{q = {0.1, 0.2, 0.3}})");
  EXPECT_NE(said.find("a column has one unit"), std::string::npos) << said;
  EXPECT_NE(said.find("rad/s^2, m/s^2, rad/s^2"), std::string::npos) << said;
  for (const char* unit : {"rad or m", "m, m, m", "rad, m, metres"}) {
    const std::string wrong =
        eval(std::string("recording.create{columns = {{name = 'x', unit = '") + unit +
             "', values = {{1, 2}, {3, 4}}}}}");
    EXPECT_NE(wrong.find("unit"), std::string::npos) << wrong;
    EXPECT_EQ(wrong.find("recording#"), std::string::npos) << unit << " gave " << wrong;
  }
}

TEST_F(UnitsGivenBack, AListOfUnitsIsBroughtToSiColumnByColumn) {
  run("r = recording.create{columns = {{name = 'x', unit = 'deg, mm', "
      "values = {{180, 35}, {90, 20}}}}}");
  EXPECT_EQ(eval("string.format('%.15g', r:values('x1')[1])"), "3.14159265358979");
  EXPECT_EQ(eval("r:values('x2')[1] == 0.035"), "true");
  EXPECT_EQ(eval("r:columns()[2].unit"), "m");
}

TEST_F(UnitsGivenBack, UnitsFollowTheirColumnsThroughArithmetic) {
  run("A = mixed:forward_dynamics{q = {{0.1, 0.2, 0.3}, {0.2, 0.1, 0}, {0, 0, 0}}}");
  EXPECT_EQ(eval("A:col(2):unit()"), "m/s^2");
  EXPECT_EQ(eval("A[1]:unit()"), "rad/s^2, m/s^2, rad/s^2");
  EXPECT_EQ(eval("(2 * A + A):unit()"), "rad/s^2, m/s^2, rad/s^2");
  // Square, so that its shape alone does not tell that rows are columns now.
  EXPECT_EQ(eval("A:transpose():unit() == ''"), "true");
  EXPECT_EQ(eval("(A * A):unit() == ''"), "true");
}

TEST_F(UnitsGivenBack, TablesOfManyStatesAreTheMatricesTheySay) {
  run(R"(
    rows, again = {}, {}
    for i = 1, 40 do
      rows[i] = {0.01 * i, i % 3, -0.02 * i}
      again[i] = {0.01 * i, i % 3, -0.02 * i}
    end
    exact = mixed:forward_dynamics{q = array(rows), qd = array(rows), tau = array(rows)}
  )");
  EXPECT_EQ(eval("mixed:forward_dynamics{q = rows, qd = rows, tau = rows} == exact"), "true");
  EXPECT_EQ(eval("mixed:fk{q = rows}.position == mixed:fk{q = array(rows)}.position"), "true");
  // A row of texts, and rows that Lua keeps in another order, are read as well.
  run("again[7] = {'0.07 rad', '1 m', '-0.14 rad'}");
  EXPECT_EQ(eval("mixed:forward_dynamics{q = again, qd = rows, tau = rows} == exact"), "true");
  run("odd = {} for i = 40, 1, -1 do odd[i] = {[3] = rows[i][3], [2] = rows[i][2], "
      "[1] = rows[i][1]} end");
  EXPECT_EQ(eval("mixed:forward_dynamics{q = odd, qd = rows, tau = rows} == exact"), "true");
}

TEST_F(UnitsGivenBack, TablesOfManyStatesThatAreNoneAreRefused) {
  run("function wrong(change)\n"
      "  local t = {} for i = 1, 40 do t[i] = {0, 0, 0} end\n"
      "  change(t)\n"
      "  return mixed:fk{q = t}\nend");
  const struct {
    const char* change;
    const char* says;
  } cases[] = {{"t[9][4] = 1", "q[9]"},       {"t[9][3] = nil", "q[9]"},
               {"t[9].x = 1", "mixes"},       {"t.x = 1", "mixes"},
               {"t[9] = 3", "q[9]"},          {"t[9][2] = 0/0", "q[9]"},
               {"t[9][2] = 1e300", "q[9]"},   {"t[9][2] = print", "function"},
               {"t[42] = {0, 0, 0}", "holes"}};
  for (const auto& c : cases) {
    const std::string said = eval(std::string("wrong(function(t) ") + c.change + " end)");
    EXPECT_NE(said.find(c.says), std::string::npos) << c.change << ": " << said;
  }
}

}  // namespace
}  // namespace robomosp
