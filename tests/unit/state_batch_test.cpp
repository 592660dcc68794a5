// SPDX-License-Identifier: Apache-2.0
// Many states in one call: each row is what the command answers for that state alone, for every
// robot of the library and every provider; what is wrong is said with its argument and row.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <robomosp/sdk/dynamics.h>

#include "robotics/closure.h"
#include "robotics/home.h"
#include "support/library_robots.h"
#include "support/lua_program.h"
#include "support/seed.h"

namespace robomosp {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

class StateBatch : public test::LuaProgramTest {
 protected:
  /// States of a robot: rows of joint values within their limits (with closed loops near its home,
  /// from where they close), and of rates.
  struct States {
    Value id;
    std::shared_ptr<const RobotModel> model;
    std::size_t count = 0;
    std::vector<double> q, qd, u;
  };
  States states_of(const std::string& robot, std::size_t count) {
    States s;
    s.count = count;
    auto id = app().dispatch(session_, "robot.get", Map{{"name", robot}});
    EXPECT_TRUE(id.ok()) << id.error().sentence();
    s.id = *id;
    NoProgress none;
    s.model = *app().derived.robot_model(*app().document.now(), RobotId{id->as_handle()->number},
                                         {0, 0, -9.81}, none);
    std::mt19937_64 random(test::seed() + 7);
    const std::vector<double> home =
        robotics::home_joint_values(*app().document.now()->get(RobotId{id->as_handle()->number}));
    const auto within = [&](double a, double b) {
      return std::uniform_real_distribution<double>(a, b)(random);
    };
    for (std::size_t i = 0; i < count; ++i) {
      std::vector<double> q(s.model->coordinate_count());
      for (const JointModel& j : s.model->joints) {
        if (j.is_coupled()) continue;
        double* own = &q[static_cast<std::size_t>(j.q_index)];
        if (j.type == JointType::free) {
          for (int k = 0; k < 3; ++k) *own++ = within(-1, 1);
        }
        if (j.type == JointType::free || j.type == JointType::spherical) {
          double norm = 0;
          for (int k = 0; k < 4; ++k) own[k] = within(-1, 1), norm = std::hypot(norm, own[k]);
          for (int k = 0; k < 4; ++k) own[k] /= norm;
        } else {
          const bool is_bounded = std::isfinite(j.lower) && std::isfinite(j.upper);
          *own = is_bounded ? within(j.lower, j.upper) : within(-3, 3);
        }
      }
      if (!s.model->loops.empty()) {
        q = home;
        std::vector<double> step(s.model->dof());
        for (double& x : step) x = within(-0.02, 0.02);
        robotics::move_configuration(*s.model, step, q);
      }
      s.q.insert(s.q.end(), q.begin(), q.end());
      for (std::size_t k = 0; k < s.model->dof(); ++k) {
        s.qd.push_back(within(-1, 1));
        s.u.push_back(within(-2, 2));
      }
    }
    return s;
  }
  static NumericArray rows(const std::vector<double>& all, std::size_t count) {
    return NumericArray(all, count, all.size() / count);
  }
  static NumericArray row(const std::vector<double>& all, std::size_t count, std::size_t i) {
    const std::size_t width = all.size() / count;
    return NumericArray(
        std::vector<double>(all.begin() + static_cast<std::ptrdiff_t>(i * width),
                            all.begin() + static_cast<std::ptrdiff_t>((i + 1) * width)));
  }
  /// Arguments of all states (`i` < 0) or of one.
  static Map arguments(const States& s, const std::string& command, const Value& provider,
                       std::ptrdiff_t i = -1) {
    const auto of = [&](const std::vector<double>& all) {
      return i < 0 ? rows(all, s.count) : row(all, s.count, static_cast<std::size_t>(i));
    };
    Map out{{"id", s.id}, {"q", of(s.q)}};
    if (!provider.is_nil()) out.set("provider", provider);
    if (command == "robot.inverse_dynamics") out.set("qd", of(s.qd)), out.set("qdd", of(s.u));
    if (command == "robot.forward_dynamics") out.set("qd", of(s.qd)), out.set("tau", of(s.u));
    if (command == "robot.fk") out.set("all", true);
    if (!s.model->loops.empty() && command != "robot.jacobian") out.set("close", true);
    return out;
  }
  /// Row i of `all` is `one`, as far as numbers go.
  static void expect_row(const Value& all, const Value& one, std::size_t i, std::size_t count,
                         const std::string& what) {
    if (const Map* fields = one.as_map()) {
      ASSERT_TRUE(all.as_map()) << what;
      for (const auto& [key, value] : *fields) {
        if (value.as_string()) continue;
        ASSERT_NE(all.as_map()->find(key), nullptr) << what << ": " << key;
        expect_row(*all.as_map()->find(key), value, i, count, what + "." + key);
      }
      return;
    }
    if (const List* list = one.as_list()) {
      ASSERT_TRUE(all.as_list() && all.as_list()->size() == list->size()) << what;
      for (std::size_t k = 0; k < list->size(); ++k)
        expect_row((*all.as_list())[k], (*list)[k], i, count, what + "[" + std::to_string(k) + "]");
      return;
    }
    const NumericArray* rows = all.as_array();
    const NumericArray* single = one.as_array();
    ASSERT_TRUE(rows && single) << what;
    ASSERT_EQ(rows->rows(), count) << what;
    ASSERT_EQ(rows->cols(), single->size()) << what;
    EXPECT_EQ(rows->unit(), single->unit()) << what;
    double most = 1;
    for (const double x : single->data()) most = std::max(most, std::fabs(x));
    // What is half a turn to rounding may be told with either sign.
    const bool is_angle = what.ends_with("rpy"), is_quaternion = what.ends_with("quaternion");
    const double sign = is_quaternion && (*single)[0] < 1e-12 &&
                                rows->at(i, 1) * (*single)[1] + rows->at(i, 2) * (*single)[2] +
                                        rows->at(i, 3) * (*single)[3] <
                                    0
                            ? -1
                            : 1;
    for (std::size_t k = 0; k < single->size(); ++k) {
      const double off = sign * rows->at(i, k) - (*single)[k];
      EXPECT_NEAR(is_angle ? std::remainder(off, 2 * std::numbers::pi) : off, 0, 2e-12 * most)
          << what << ", row " << i << ": " << rows->at(i, k) << " and " << (*single)[k];
    }
  }
  void expect_same(const States& s, const std::string& command, const Value& provider) {
    const std::string what = command + " by " + provider.text();
    const auto all = app().dispatch(session_, command, arguments(s, command, provider));
    for (std::size_t i = 0; i < s.count; ++i) {
      const auto one = app().dispatch(
          session_, command, arguments(s, command, provider, static_cast<std::ptrdiff_t>(i)));
      if (!one.ok()) {
        EXPECT_FALSE(all.ok()) << what << ": " << one.error().sentence();
        continue;
      }
      if (!all.ok()) continue;
      ++compared_;
      expect_row(*all, *one, i, s.count, what);
      if (HasFailure()) {
        ADD_FAILURE() << what << " at " << i;
        return;
      }
    }
    EXPECT_TRUE(all.ok() || !all.error().message.empty()) << what;
  }
  int compared_ = 0;
};

TEST_F(StateBatch, EachRowIsTheAnswerOfItsStateAlone) {
  int accelerated = 0;
  for (const std::string& robot : test::library_robots()) {
    SCOPED_TRACE(robot);
    const States s = states_of(robot, 37);
    compared_ = 0;
    for (const char* command : {"robot.fk", "robot.jacobian"}) expect_same(s, command, {});
    EXPECT_EQ(compared_, 2 * 37);
    for (const ProviderInfo& p : app().registry.list(InverseDynamics::kInterfaceId))
      for (const char* command :
           {"robot.inverse_dynamics", "robot.gravity_torques", "robot.inertia"})
        expect_same(s, command, Value(p.name));
    EXPECT_GE(compared_, 5 * 37);
    compared_ = 0;
    for (const ProviderInfo& p : app().registry.list(ForwardDynamics::kInterfaceId))
      expect_same(s, "robot.forward_dynamics", Value(p.name));
    expect_same(s, "robot.forward_dynamics", {});
    accelerated += compared_ >= 37 ? 1 : 0;
    if (HasFailure()) break;
  }
  EXPECT_GE(accelerated, 19) << "the others have no masses";
}

TEST_F(StateBatch, RowsDoNotDependOnHowManyThereAre) {
  const States few = states_of("puma560", 300);
  States many = few;  // enough for both cores
  many.count = 100 * few.count;
  for (auto* v : {&many.q, &many.qd, &many.u}) {
    const std::vector<double> block = *v;
    for (int i = 1; i < 100; ++i) v->insert(v->end(), block.begin(), block.end());
  }
  for (const std::string command :
       {"robot.inverse_dynamics", "robot.forward_dynamics", "robot.inertia", "robot.jacobian"}) {
    const auto a = app().dispatch(session_, command, arguments(few, command, {}));
    const auto b = app().dispatch(session_, command, arguments(many, command, {}));
    ASSERT_TRUE(a.ok() && b.ok()) << command;
    const Numbers some = a->as_array()->data(), all = b->as_array()->data();
    ASSERT_EQ(all.size(), 100 * some.size());
    for (std::size_t i = 0; i < all.size(); ++i)
      ASSERT_EQ(all[i], some[i % some.size()]) << command << " " << i;
  }
}

TEST_F(StateBatch, WhatIsOneStateCountsForAllRows) {
  run(R"~(
arm = robot.get("arm")
local Q = {{0.1, 0.2, 0.3, 0.4, 0.5, 0.6}, {"10 deg", 0, 0, 0, "90 deg", 0}, array{1, 1, 1, 1, 1, 1}}
local qd = {1, 0, 0.5, 0, 0, 0}
local all = arm:inverse_dynamics{q = Q, qd = qd}
assert(all:rows() == 3 and all:cols() == 6)
for i = 1, 3 do assert((all[i] - arm:inverse_dynamics{q = Q[i], qd = qd}):norm() < 1e-12) end
local same = arm:inverse_dynamics{q = Q[1], qd = {qd, {0, 0, 0, 0, 0, 0}}}
assert((same[1] - all[1]):norm() < 1e-12 and same:rows() == 2)
assert((same[2] - arm:gravity_torques{q = Q[1]}):norm() < 1e-12)
local one = arm:inverse_dynamics{q = {Q[1]}, qd = qd}           -- a batch of one has one row
assert(one:rows() == 1 and one:cols() == 6 and (one[1] - all[1]):norm() < 1e-12)
local m = arm:inertia{q = Q}
assert((m[2]:reshape(6, 6) - arm:inertia{q = Q[2]}):norm() < 1e-12)
local j = arm:jacobian{q = Q, frame = "tool"}
assert((j[3]:reshape(6, 6) - arm:jacobian{q = Q[3], frame = "tool"}):norm() < 1e-12)
local t = arm:fk{q = Q}
assert((t.pose[2]:reshape(4, 4) - arm:fk{q = Q[2]}.pose):norm() < 1e-12)
local wrench = arm:inverse_dynamics{q = Q, tip_force = {0, 0, 5}, gravity = {0, 0, 0}}
assert((wrench[2] - arm:inverse_dynamics{q = Q[2], tip_force = {0, 0, 5}, gravity = {0, 0, 0}}):norm() < 1e-12))~");
}

// A wrench a row, in the mounting frame's axes and in the tool's, which are turned by each pose.
TEST_F(StateBatch, WrenchesMayHaveARowAStateAndTheToolsAxes) {
  run(R"~(
arm = robot.get("arm")
local Q = {{0.1, 0.2, 0.3, 0.4, 0.5, 0.6}, {0.4, -0.3, 0.2, 1, 0.9, 0}, {1, 1, 1, 1, 1, 1}}
local F, M = {{3, 0, 5}, {0, -7, 1}, {2, 2, 2}}, {{0.1, 0, 0}, {0, 0.2, 0}, {0, 0, 0.3}}
local all = arm:inverse_dynamics{q = Q, tip_force = F, tip_moment = M}
local same = arm:inverse_dynamics{q = Q, tip_force = linalg.rows(F), tip_moment = linalg.rows(M)}
local fd = arm:forward_dynamics{q = Q, tip_force = F, tip_moment = M, tau = all}
for i = 1, 3 do
  local one = arm:inverse_dynamics{q = Q[i], tip_force = F[i], tip_moment = M[i]}
  assert((all[i] - one):norm() < 1e-12 and (all[i] - same[i]):norm() == 0)
  assert(fd[i]:norm() < 1e-9)
end
-- One state under many wrenches, and one wrench for all states, in the tool's axes.
local many = arm:inverse_dynamics{q = Q[2], tip_force = F}
assert(many:rows() == 3)
assert((many[3] - arm:inverse_dynamics{q = Q[2], tip_force = F[3]}):norm() < 1e-12)
local tool = arm:inverse_dynamics{q = Q, tip_force = {1, -2, 3}, tip_moment = {0.3, 0.2, 0.1}, tip_axes = "tool"}
for i = 1, 3 do
  local R = arm:fk{q = Q[i]}.pose
  local f, m = {}, {}
  for k = 1, 3 do
    f[k] = R[k][1] - 2 * R[k][2] + 3 * R[k][3]
    m[k] = 0.3 * R[k][1] + 0.2 * R[k][2] + 0.1 * R[k][3]
  end
  assert((tool[i] - arm:inverse_dynamics{q = Q[i], tip_force = f, tip_moment = m}):norm() < 1e-9)
end
local good, why = pcall(arm.inverse_dynamics, arm, {q = Q, tip_force = {{1, 0, 0}, {0, 1, 0}}})
assert(not good and tostring(why):find("it has 2 rows, but there are 3 states"), tostring(why))
good, why = pcall(arm.energy, arm, {q = Q[1], tip_force = {1, 0, 0}})
assert(not good)
good, why = pcall(arm.dynamics_derivatives, arm, {q = Q[1], tip_force = F})
assert(not good)
good, why = pcall(arm.inverse_dynamics, arm, {q = Q, tip_force = {1, 0}})
assert(not good and tostring(why):find("tip_force"), tostring(why)))~");
}

TEST_F(StateBatch, LoopsAreClosedRowByRow) {
  run(R"~(
bar = robot "four_bar"
local Q = {}
for i = 1, 20 do Q[i] = bar:close{joints = {crank = 0.05 * i}, q = "home"}.q:table() Q[i][2] = Q[i][2] + 1e-3 end
local t = bar:fk{q = Q, close = true, all = true}
for i = 1, 20 do
  local one = bar:fk{q = Q[i], close = true, all = true}
  assert((t.q[i] - one.q):norm() < 1e-12 and (t.position[i] - one.position):norm() < 1e-12)
  assert((t.links[2].rpy[i] - one.links[2].rpy):norm() < 1e-11)
end
local qdd = bar:forward_dynamics{q = Q, close = true}
for i = 1, 20 do assert((qdd[i] - bar:forward_dynamics{q = Q[i], close = true}):norm() < 1e-8) end)~");
}

TEST_F(StateBatch, TorquesOfClosedLoopsAreTheMotorsRowByRow) {
  run(R"~(
bar = robot "four_bar"
local Q, QD, QDD = {}, {}, {}
for i = 1, 20 do Q[i], QD[i], QDD[i] = {0.1 * i, -0.49, 1.72}, {1 + 0.1 * i, 0, 0}, {-2, 0, 0} end
Q[1] = bar:poses().home
for i = 2, 20 do Q[i] = bar:close{joints = {crank = 0.1 * i + 0.9}, q = Q[i - 1]}.q:table() end
local tau = bar:inverse_dynamics{q = Q, qd = QD, qdd = QDD, close = true}
local weight, m = bar:gravity_torques{q = Q}, bar:inertia{q = Q}
for i = 1, 20 do
  local one = {q = Q[i], qd = QD[i], qdd = QDD[i], close = true}
  assert((tau[i] - bar:inverse_dynamics(one)):norm() < 1e-10)
  assert(tau[i][2] == 0 and tau[i][3] == 0 and tau[i][1] ~= 0)
  assert((weight[i] - bar:gravity_torques{q = Q[i]}):norm() < 1e-10)
  assert(m[i][1] > 0 and m[i][5] == 0 and m[i][9] == 0)
  local c = bar:constraint_forces(one)
  assert(math.abs(c.tau[1] - tau[i][1]) < 1e-10 and math.abs(c.qdd[1] + 2) < 1e-8)
  local back = bar:forward_dynamics{q = Q[i], qd = QD[i], tau = tau[i], close = true}
  assert((back - c.qdd):norm() < 1e-8)
end
local function refused(call, ...)
  local ok, e = pcall(call)
  assert(not ok)
  for _, part in ipairs{...} do assert(tostring(e):find(part, 1, true), tostring(e)) end
end
Q[7][2] = Q[7][2] + 0.01
refused(function() bar:gravity_torques{q = Q} end, 'loop "pin" is open by', "row 7", "close = true")
refused(function() bar:inertia{q = Q} end, "row 7")
refused(function() bar:energy{q = Q[7]} end, 'loop "pin"')
refused(function() bar:inverse_dynamics{q = Q[1], qd = {1, 0, 0}} end, "speeds pull the closed loops apart")
refused(function() bar:dynamics_derivatives{q = Q[1]} end, "derivatives of torques with closed loops")
ioci.provide("robomosp.robot_code/1", "plain", {generate = function() return {} end})
refused(function() bar:generate_code{folder = ".", parts = {"inertia"}, provider = "plain"} end, "closed loops", "plain")
refused(function() bar:constraint_forces{q = Q[1], tau = {1, 0, 0}, qdd = {1, 0, 0}} end, "torques and accelerations"))~");
}

TEST_F(StateBatch, WhatIsWrongIsSaidWithItsRow) {
  run("arm = robot.get('arm') good = {0, 0, 0, 0, 0, 0} Q = linalg.zeros(4, 6)");
  const auto says = [&](const std::string& code, std::initializer_list<const char*> parts) {
    const std::string said = eval(code);
    for (const char* part : parts)
      EXPECT_NE(said.find(part), std::string::npos) << code << ": " << said;
  };
  says("arm:inverse_dynamics{q = linalg.zeros(4, 5)}",
       {"q: 5 columns are given", "the robot has 6 joints"});
  says("arm:inverse_dynamics{q = Q, qd = linalg.zeros(3, 6)}",
       {"qd: 3 rows are given; q has 4", "one row per state"});
  says("arm:forward_dynamics{q = Q, tau = linalg.zeros(4, 7)}", {"tau: 7 columns are given"});
  says("arm:fk{q = {good, {1, 2, 3}}}", {"q[2]: 3 numbers are given", "6 joints"});
  says("arm:fk{q = {good, 5}}", {"q[2]: 5 is not a row of numbers"});
  says("arm:fk{q = {good, {0, 0, 0, 'x', 0, 0}}}", {"q[2][4]"});
  says("arm:jacobian{q = {good, good, {0, 0, 0, 0/0, 0, 0}}}", {"q[3][4]", "not a finite number"});
  says("arm:inertia{q = linalg.rows{good, {0, 1e300, 0, 0, 0, 0}}}",
       {"q[2][2]: 1e+300 is too large to calculate with"});
  says("arm:gravity_torques{q = {{}}}", {"q[1]: 0 numbers are given"});
  says("arm:gravity_torques{q = {}}", {"q", "0 joint values are given"});
  says("arm:energy{q = Q}", {"q: one state is expected, but a matrix of 4 is given"});
  says("arm:regressor{q = good, qd = {good, good}}", {"qd: one state is expected"});
  // Matrices without rows come from other clients only.
  const auto none = app().dispatch(
      session_, "robot.fk", Map{{"id", "arm"}, {"q", NumericArray(std::vector<double>(), 0, 6)}});
  ASSERT_FALSE(none.ok());
  EXPECT_EQ(none.error().sentence(),
            "robot.fk, q: a matrix without rows contains no state. Give one row per state.");
  std::vector<double> bad(60'000, 0.1);
  bad[6 * 8123 + 2] = kNan;
  const auto nan = app().dispatch(session_, "robot.inverse_dynamics",
                                  Map{{"id", "arm"}, {"q", NumericArray(bad, 10'000, 6)}});
  ASSERT_FALSE(nan.ok());
  EXPECT_NE(nan.error().sentence().find("q[8124][3]"), std::string::npos) << nan.error().sentence();
  run(R"~(
sat = robot "satellite_arm"
local n = #sat:coordinates()
local Q = linalg.zeros(3, n)
local ok, e = pcall(sat.fk, sat, {q = Q})
assert(not ok and tostring(e):find("a quaternion is zero", 1, true) and tostring(e):find("q[1]", 1, true), tostring(e)))~");
}

TEST_F(StateBatch, ASolverInLuaAnswersRowsToo) {
  run(R"~(
calls = 0
ioci.provide("robomosp.inverse_dynamics/1", "springs", function(model, q, qd, qdd)
  calls = calls + 1
  local tau = {}
  for i = 1, #q do tau[i] = 2 * q[i] + qdd[i] end
  return tau
end)
arm = robot.get("arm")
local Q = linalg.rows{{1, 2, 3, 4, 5, 6}, {0, 0, 0, 0, 0, 1}}
local tau = arm:inverse_dynamics{q = Q, provider = "springs"}
assert((tau - 2 * Q):norm() < 1e-12 and calls == 2)
local m = arm:inertia{q = Q, provider = "springs"}
assert((m[2]:reshape(6, 6) - linalg.identity(6)):norm() < 1e-12))~");
}

TEST_F(StateBatch, ABatchEndsWhenItIsCancelled) {
  const States s = states_of("dual_arm", 1000);
  States many = s;
  many.count = 400 * s.count;
  many.q.clear();
  for (int i = 0; i < 400; ++i) many.q.insert(many.q.end(), s.q.begin(), s.q.end());
  for (const char* command : {"robot.fk", "robot.inverse_dynamics"}) {
    const auto job = app().dispatch_async(
        session_, command,
        Map{{"id", many.id}, {"q", NumericArray(many.q, many.count, many.q.size() / many.count)}});
    ASSERT_TRUE(job.ok()) << job.error().sentence();
    ASSERT_TRUE(app().dispatch(session_, "job.cancel", Map{{"id", *job}}).ok());
    const auto ended = app().dispatch(session_, "job.wait", Map{{"id", *job}});
    ASSERT_FALSE(ended.ok()) << command;
    EXPECT_EQ(ended.error().code, ErrorCode::cancelled) << ended.error().sentence();
  }
}

}  // namespace
}  // namespace robomosp
