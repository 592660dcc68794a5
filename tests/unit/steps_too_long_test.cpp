// SPDX-License-Identifier: Apache-2.0
// Simulations that leave all bounds: steps that are too long, motions that grow, chains so long
// that rounding exceeds the tolerances.
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "support/lua_program.h"

namespace robomosp {
namespace {

/// A block of 1 kg on a spring of 1e6 N/m: 1000 rad/s, x = 0.01 cos(1000 t).
class StepsTooLong : public test::LuaProgramTest {
 protected:
  void SetUp() override {
    LuaProgramTest::SetUp();
    run(R"(
      block = robot.create{name = "block", links = {{joint = "prismatic", origin = {0, 0, 0},
        axis = {1, 0, 0}, mass = 1, inertia = {0.01, 0.01, 0.01, 0, 0, 0}, stiffness = 1e6}}}
      function swing(integrator, step)
        local r = block:simulate{q = {0.01}, duration = 0.1, sample_time = 0.1, step = step,
          integrator = integrator, limits = "ignore"}
        return r:values("q1")[2]
      end
    )");
  }
};

/// Beyond the limit of stability of each method (Hairer, Norsett, Wanner, Solving ODEs I, IV.2 for
/// Runge-Kutta; h w = 2 for Verlet and semi-implicit Euler; for Yoshida's composition the trace of
/// the map of a step leaves -2..2 from h w = 1.5735 on) no answer comes, and well within it one
/// does.
TEST_F(StepsTooLong, AreRefusedByEveryMethodWithAFixedStep) {
  const struct {
    const char* method;
    double limit;
  } cases[] = {{"'runge_kutta4'", 2.8284},
               {"{name = 'symplectic', params = {method = 'euler'}}", 2},
               {"{name = 'symplectic', params = {method = 'verlet'}}", 2},
               {"{name = 'symplectic', params = {method = 'yoshida4'}}", 1.5735}};
  for (const auto& c : cases) {
    for (const double part : {1.01, 1.1, 1.3, 2.0, 5.0, 15.0}) {
      const std::string said = eval(std::string("swing(") + c.method + ", " +
                                    std::to_string(1e-3 * c.limit * part) + ")");
      // Of very long ones the motion may leave all bounds first.
      EXPECT_TRUE(said.find("too long") != std::string::npos ||
                  said.find("grows without bound") != std::string::npos)
          << c.method << " " << part << ": " << said;
      EXPECT_NE(said.find("shorter step"), std::string::npos) << said;
    }
    const std::string fine =
        eval(std::string("swing(") + c.method + ", " + std::to_string(0.4e-3 * c.limit) + ")");
    EXPECT_EQ(fine.find("error"), std::string::npos) << c.method << ": " << fine;
  }
}

TEST_F(StepsTooLong, AreNotFoundWhereTheMotionIsFollowed) {
  const std::string exact = "0.01 * math.cos(100)";
  for (const auto& [method, bound] :
       {std::pair<const char*, const char*>{"'runge_kutta4'", "1e-4"},
        {"{name = 'symplectic', params = {method = 'verlet'}}", "1e-3"},
        {"{name = 'symplectic', params = {method = 'yoshida4'}}", "1e-4"}})
    EXPECT_EQ(eval(std::string("math.abs(swing(") + method + ", 2e-4) - " + exact + ") < " + bound),
              "true")
        << method << ": " << eval(std::string("swing(") + method + ", 2e-4)");
}

TEST_F(StepsTooLong, OfAFreeFallOrOfRestAreNone) {
  run("free = robot.create{name = 'free', links = {{joint = 'prismatic', origin = {0, 0, 0}, "
      "axis = {0, 0, 1}, mass = 2, inertia = {0.01, 0.01, 0.01, 0, 0, 0}}}}");
  // Half of 9.81 for a second's square, in two steps.
  EXPECT_EQ(eval("local r = free:simulate{q = {0}, duration = 2, step = 1, sample_time = 1, "
                 "integrator = 'runge_kutta4', limits = 'ignore'}\n"
                 "return math.abs(r:values('q1')[3] + 0.5 * 9.81 * 4) < 1e-9"),
            "true");
  EXPECT_EQ(eval("local r = block:simulate{q = {0}, duration = 1, step = 0.05, sample_time = 1, "
                 "integrator = 'runge_kutta4', limits = 'ignore'}\nreturn r:values('q1')[2]"),
            "0");
}

TEST_F(StepsTooLong, AMotionBeyondWhatCanBeGivenIsRefusedByItsJoint) {
  run("light = robot.create{name = 'light', links = {{name = 'dart', joint = 'prismatic', "
      "origin = {0, 0, 0}, axis = {1, 0, 0}, mass = 1e-6, inertia = {1e-8, 1e-8, 1e-8, 0, 0, "
      "0}}}}");
  const std::string said = eval(
      "light:simulate{q = {0}, tau = {1e7}, duration = 10, sample_time = 1, "
      "limits = 'ignore'}");
  EXPECT_NE(said.find("grows without bound"), std::string::npos) << said;
  EXPECT_NE(said.find("dart"), std::string::npos) << said;
}

TEST_F(StepsTooLong, OfLongChainsTheTolerancesAreLooser) {
  run(R"(
    function chain(n, fields)
      local links, q = {}, {}
      for i = 1, n do
        q[i] = 0
        links[i] = {a = 0.1, mass = 1, com = {-0.05, 0, 0}, inertia = {0.001, 0.001, 0.001, 0, 0, 0}}
      end
      local r = robot.create{name = "chain" .. n .. "_" .. math.random(1 << 40), links = links}
      local args = {q = q, duration = 0.002, sample_time = 0.002, limits = "ignore"}
      for k, v in pairs(fields or {}) do args[k] = v end
      for _, note in ipairs(r:simulate(args):notes()) do
        if note:find("integrated by") then return note end
      end
    end
  )");
  // (3000 / 1000)^2 times 1e-10 and 1e-12.
  const std::string looser = eval("chain(3000)");
  EXPECT_NE(looser.find("tolerance 9e-10 relative and 9e-12 absolute, 9 times the default ones"),
            std::string::npos)
      << looser;
  EXPECT_NE(looser.find("3000 velocities"), std::string::npos) << looser;
  // What is given holds.
  const std::string given =
      eval("chain(3000, {relative_tolerance = 1e-8, absolute_tolerance = 1e-9})");
  EXPECT_NE(given.find("tolerance 1e-08 relative and 1e-09 absolute"), std::string::npos) << given;
  EXPECT_EQ(given.find("times the default"), std::string::npos) << given;
  EXPECT_NE(eval("chain(30)").find("tolerance 1e-10 relative and 1e-12 absolute"),
            std::string::npos);
}

}  // namespace
}  // namespace robomosp
