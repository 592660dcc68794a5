// SPDX-License-Identifier: Apache-2.0
// Forward dynamics of links whose masses differ by many powers of ten.
#include <string>

#include <gtest/gtest.h>

#include "support/lua_program.h"

namespace robomosp {
namespace {

class UnlikeMasses : public test::LuaProgramTest {};

/// Two links in the plane, by hand: M and the velocity terms of the textbook (Spong, Hutchinson,
/// Vidyasagar, Robot Modeling and Control, 2006, 7.3), solved by Cramer's rule.
TEST_F(UnlikeMasses, AcceleratesMassesThatDifferByEighteenDecadesByEverySolver) {
  run(R"(
    function apart(m1, m2, provider)
      local l, c = 1, 0.5
      local function link(m)
        return {a = l, mass = m, com = {-c, 0, 0}, inertia = {0, m / 12, m / 12, 0, 0, 0}}
      end
      local arm = robot.create{name = "arm" .. math.random(1 << 40), links = {link(m1), link(m2)}}
      local q, qd, tau = {0.3, 0.8}, {0.4, -0.7}, {0.2 * m1 + m2, 0.3 * m2}
      local i1, i2 = m1 / 12, m2 / 12
      local M11 = i1 + m1 * c * c + i2 + m2 * (l * l + c * c + 2 * l * c * math.cos(q[2]))
      local M12 = i2 + m2 * (c * c + l * c * math.cos(q[2]))
      local M22 = i2 + m2 * c * c
      local h = -m2 * l * c * math.sin(q[2])
      local b1 = tau[1] - h * (2 * qd[1] * qd[2] + qd[2]^2)
      local b2 = tau[2] + h * qd[1]^2
      local det = M11 * M22 - M12 * M12
      local want = {(b1 * M22 - b2 * M12) / det, (M11 * b2 - M12 * b1) / det}
      local got = arm:forward_dynamics{q = q, qd = qd, tau = tau, provider = provider}
      local off = 0
      for i = 1, 2 do off = math.max(off, math.abs(got[i] - want[i]) / math.abs(want[i])) end
      return off
    end
  )");
  for (const char* provider : {"nil", "'inertia_matrix'", "'articulated_body'"})
    for (const char* masses : {"1e9, 1e-9", "1e-9, 1e-9", "1e9, 1e9", "1e6, 1e-12", "1, 1"})
      EXPECT_EQ(eval(std::string("apart(") + masses + ", " + provider + ") < 1e-9"), "true")
          << provider << " " << masses << ": "
          << eval(std::string("apart(") + masses + ", " + provider + ")");
}

TEST_F(UnlikeMasses, AJointThatCarriesNothingIsStillRefused) {
  run("bare = robot.create{name = 'bare', links = {{a = 1, mass = 1, com = {-0.5, 0, 0}}, {a = "
      "1}}}");
  const std::string said = eval("bare:forward_dynamics{q = {0.1, 0.2}}");
  EXPECT_NE(said.find("zero or negative"), std::string::npos) << said;
}

}  // namespace
}  // namespace robomosp
