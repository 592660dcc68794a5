// SPDX-License-Identifier: Apache-2.0
#include "lua/lua_state.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <string>
#include <thread>

#include <gtest/gtest.h>

#include <robomosp/sdk/dynamics.h>
#include <robomosp/sdk/ik.h>
#include <robomosp/sdk/trajectory.h>

#include "support/program.h"

namespace robomosp::lua {
namespace {

class Lua : public test::ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    options_.print = [this](std::string_view s) { printed_ += s; };
    options_.memory_limit = std::size_t{64} << 20;
    options_.patience = std::chrono::milliseconds(200);
    state_ = std::make_unique<LuaState>(app(), session_, options_);
  }
  std::string eval(std::string_view code) {
    auto r = state_->eval(code);
    return r.ok() ? *r
                  : "ERROR " + std::string(to_string(r.error().code)) + ": " + r.error().sentence();
  }
  /// Interrupts the session from another thread after some ms, as a signal would.
  Result<std::string> eval_interrupted(std::string_view code, int ms = 50) {
    std::jthread killer([this, ms] {
      std::this_thread::sleep_for(std::chrono::milliseconds(ms));
      session_.interrupt();
    });
    return state_->eval(code);
  }
  /// One revolute joint about z with a tip 1 m along x: q = atan2(y, x).
  static RobotModel pendulum() {
    RobotModel m;
    m.name = "pendulum";
    m.joints.resize(1);
    m.joints[0].lower = -3;
    m.joints[0].upper = 3;
    m.joints[0].friction.viscous = 0.5;
    m.tips.resize(1);
    m.tips[0].joint = 0;
    m.tips[0].tool.p = {1, 0, 0};
    m.number_coordinates();
    return m;
  }
  static Pose turned(double q) {
    Pose t;
    t.R = {std::cos(q), -std::sin(q), 0, std::sin(q), std::cos(q), 0, 0, 0, 1};
    t.p = {std::cos(q), std::sin(q), 0};
    return t;
  }

  ioci::Session session_{"test"};
  LuaOptions options_;
  std::string printed_;
  std::unique_ptr<LuaState> state_;
};

TEST_F(Lua, ValuesKeepTheirTypeThroughBothConversions) {
  const auto values = state_->eval_values(
      "true, 7, 0.5, 'text', {1, 2.5, 'x'}, {a = {b = 1}}, array{{1, 2}, {3, 4}}, nil");
  ASSERT_TRUE(values.ok()) << values.error().sentence();
  EXPECT_EQ((*values)[0], Value(true));
  EXPECT_EQ((*values)[1], Value(7));
  EXPECT_EQ((*values)[2], Value(0.5));
  EXPECT_EQ((*values)[3], Value("text"));
  EXPECT_EQ((*values)[4], Value(List{1, 2.5, "x"}));
  EXPECT_EQ((*values)[5], Value(Map{{"a", Map{{"b", 1}}}}));
  EXPECT_EQ((*values)[6], Value(NumericArray({1, 2, 3, 4}, 2, 2)));
  EXPECT_TRUE((*values)[7].is_nil());
}

TEST_F(Lua, MixedSparseCyclicAndForeignValuesAreRefusedInWords) {
  EXPECT_NE(eval("local t, s = {}, ('x'):rep(1 << 20) for i = 1, 65 do t[i] = s end "
                 "material.create{name = t}")
                .find("more than 64 MiB together"),
            std::string::npos);
  EXPECT_NE(eval("material.create{name = {1, a = 2}}").find("mixes named and numbered"),
            std::string::npos);
  EXPECT_NE(eval("material.create{name = {1, nil, 3}}").find("holes"), std::string::npos);
  EXPECT_NE(eval("local t = {} t.t = t return material.create{name = t}").find("contains itself"),
            std::string::npos);
  EXPECT_NE(eval("material.create{name = print}").find("a function cannot be given"),
            std::string::npos);
}

TEST_F(Lua, HandlesAreEqualByIdHaveMethodsAndGoStale) {
  ASSERT_TRUE(state_->run_string("m = material.create{name = 'steel', density = 7850}", "t").ok());
  EXPECT_EQ(eval("m == material 'steel', m.name, m.kind, m:describe().density, m.exists"),
            "true\nsteel\nmaterial\n7850\ntrue");
  EXPECT_NE(eval("m:descrbe()").find("Did you mean \"describe\"?"), std::string::npos);
  EXPECT_NE(eval("m.describe()").find("with a colon"), std::string::npos);
  ASSERT_TRUE(app().document.undo().ok());
  EXPECT_EQ(eval("m.exists"), "false");
  EXPECT_NE(eval("m:describe()").find("stale_handle"), std::string::npos) << eval("m:describe()");
}

TEST_F(Lua, ArraysAreImmutableVectorsAndMatricesWithUnits) {
  EXPECT_EQ(eval("local a = array({1, 2, 3}, 'm') return #a, a[2], a[4], a + a, -a, 2 * a, a / 2, "
                 "a:unit(), a == array{1, 2, 3}"),
            "3\n2\nnil\n{2, 4, 6} m\n{-1, -2, -3} m\n{2, 4, 6} m\n{0.5, 1, 1.5} m\nm\ntrue");
  EXPECT_EQ(eval("local m = array{{1, 2}, {3, 4}} return m[2][1], m(2, 2), m * array{1, 1}, "
                 "m:table()[1][2]"),
            "3\n4\n{3, 7}\n2");
  EXPECT_NE(eval("array({1}, 'm') + array({1}, 'rad')").find("in m and in rad"), std::string::npos);
  EXPECT_NE(eval("array{1}[1] = 2").find("ERROR"), std::string::npos);
  EXPECT_NE(eval("local a = array{1} a[1] = 2").find("cannot be changed"), std::string::npos);
}

TEST_F(Lua, AMisspeltNameOfAnArgumentIsToldAsSuch) {
  eval("arm = robot.create{name = 'arm', links = {{a = 1}}}");
  EXPECT_NE(eval("arm:fk{Q = {0}}").find("\"Q\" is not a parameter. Did you mean \"q\"?"),
            std::string::npos)
      << eval("arm:fk{Q = {0}}");
  EXPECT_EQ(eval("arm:fk{0}.position[1], arm:fk({0}).position[1], arm:fk{q = {0}}.position[1]"),
            "1\n1\n1");
}

TEST_F(Lua, QuantitiesInTextWorkInPosesAndRotations) {
  EXPECT_EQ(eval("rpy('180 deg', 0, '180 deg') == rpy(pi, 0, pi)"), "true");
  EXPECT_EQ(eval("pose('100 mm', 0, 0) == pose(0.1, 0, 0)"), "true");
  EXPECT_NE(eval("pose('90 deg', 0, 0)").find("ERROR invalid_argument"), std::string::npos);
  EXPECT_EQ(eval("rpy(1)").find("a no value"), std::string::npos) << eval("rpy(1)");
}

TEST_F(Lua, AMethodWithoutACallIsCompleteAndTellsWhatItIs) {
  eval("arm = robot.create{name = 'arm', links = {{a = 1}}}");
  EXPECT_FALSE(state_->is_incomplete("arm:fk\n"));
  EXPECT_NE(eval("arm:fk").find("robot.fk"), std::string::npos) << eval("arm:fk");
  EXPECT_NE(eval("arm:fk?").find("Computes the pose of the tool"), std::string::npos);
}

TEST_F(Lua, AnUnknownGlobalSuggestsTheNearestName) {
  EXPECT_NE(eval("robt.fk()").find("Did you mean \"robot\"?"), std::string::npos);
  EXPECT_EQ(eval("nothing_like_it"), "nil");
}

TEST_F(Lua, EveryHelperHasHelp) {
  for (const char* name : {"deg", "mm", "rpy", "pose", "array", "help", "apropos", "tic", "toc"}) {
    EXPECT_EQ(eval(std::string("help(") + name + ")").find("ERROR"), std::string::npos) << name;
    EXPECT_EQ(eval(std::string("help '") + name + "'").find("ERROR"), std::string::npos) << name;
  }
}

TEST_F(Lua, ErrorsAreTablesWithASentence) {
  EXPECT_EQ(eval("local ok, e = pcall(robot.get, {name = 'nobody'}) return ok, e.code, "
                 "tostring(e):find('nobody', 1, true) ~= nil"),
            "false\nunknown_name\ntrue");
  EXPECT_EQ(eval("error{code = 'unreachable', message = 'too far'}").find("ERROR unreachable"), 0U);
}

TEST_F(Lua, AnErrorInATransactionRollsAllOfItBack) {
  EXPECT_NE(eval("ioci.transaction('t', function() material.create{name = 'a', density = 1} "
                 "error('stop') end)")
                .find("stop"),
            std::string::npos);
  EXPECT_EQ(eval("#material.list()"), "0");
  EXPECT_EQ(eval("ioci.transaction('t', function() material.create{name = 'a', density = 1} "
                 "material.create{name = 'b', density = 1} return 5 end)"),
            "5");
  ASSERT_TRUE(app().document.undo().ok());
  EXPECT_EQ(eval("#material.list()"), "0");
}

TEST_F(Lua, MemoryIsLimitedForTablesStringsAndArraysAndIsFreeAgainAfterwards) {
  for (const char* code :
       {"local t = {} for i = 1, 1e9 do t[i] = {i} end", "local s = string.rep('x', 1 << 30)",
        "local t, n = {}, {} for i = 1, 1e5 do n[i] = i end for i = 1, 1e6 do t[i] = array(n) end"})
    EXPECT_NE(eval(code).find("memory"), std::string::npos) << code;
  EXPECT_EQ(eval("1 + 1"), "2");
  EXPECT_EQ(eval("collectgarbage() return 1"), "1");
  EXPECT_LT(state_->memory_used(), std::size_t{8} << 20);
}

TEST_F(Lua, CtrlCEndsLoopsThatPcallXpcallAndCoroutinesTryToSave) {
  for (const char* code :
       {"while true do end", "while true do pcall(function() while true do end end) end",
        "pcall(function() while true do pcall(function() while true do end end) end end) while "
        "true do end",
        "xpcall(function() while true do end end, function() while true do end end) while true do "
        "end",
        "while true do coroutine.wrap(function() pcall(function() while true do end end) end)() "
        "end"}) {
    const auto start = std::chrono::steady_clock::now();
    const auto r = eval_interrupted(code);
    ASSERT_FALSE(r.ok()) << code;
    EXPECT_EQ(r.error().code, ErrorCode::cancelled) << code << ": " << r.error().sentence();
    EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(5)) << code;
    EXPECT_EQ(eval("1 + 1"), "2") << "the next input runs after " << code;
  }
}

TEST_F(Lua, EndlessRecursionIsAnErrorNotACrash) {
  // The stack's own limit or the memory budget, whichever is met first.
  EXPECT_EQ(eval("local function f() return 1 + f() end f()").find("ERROR script_failed"), 0U);
  EXPECT_NE(eval("local s = string.rep('(', 100000) return load('return ' .. s)").find("nil"),
            std::string::npos);
}

/// Before the stack is full: there Lua cannot finalize what it collects, and tries for minutes.
TEST_F(Lua, RecursionIsRefusedWhileThereIsRoomToFinalize) {
  options_.memory_limit = std::size_t{1} << 30;
  state_ = std::make_unique<LuaState>(app(), session_, options_);
  EXPECT_EQ(eval("function depth(n) if n == 0 then return 0 end return 1 + depth(n - 1) end "
                 "return depth(100000)"),
            "100000");
  std::string wide = "local f; f = function(n) local a0";
  for (int i = 1; i < 180; ++i) wide += ", a" + std::to_string(i);
  wide += "; return 1 + f(n) end return f(1)";
  for (const std::string& code :
       {std::string("local function f(...) return 1 + f(...) end return f()"),
        std::string("local function f(...) return 1 + f(...) end return f(1, 2, 3, 4, 5, 6, 7)"),
        std::string("local function f() return 1 + f() end return coroutine.wrap(f)()"), wide}) {
    const auto r = state_->eval("for i = 1, 20000 do local a = array{i} end " + code);
    ASSERT_FALSE(r.ok());
    EXPECT_EQ(r.error().code, ErrorCode::script_failed) << r.error().sentence();
    EXPECT_NE(r.error().sentence().find("calls itself too deeply"), std::string::npos)
        << r.error().sentence();
  }
}

TEST_F(Lua, IncompleteInputIsToldApartFromWrongInput) {
  for (const char* s : {"for i = 1, 2 do", "x = {", "f(", "=1 +", "local s = [[a", "function f()"})
    EXPECT_TRUE(state_->is_incomplete(s)) << s;
  for (const char* s : {"x = 1", "1 + 1", "x = )", "=x", "for for", "", "robot?"})
    EXPECT_FALSE(state_->is_incomplete(s)) << s;
}

TEST_F(Lua, NamesThatAreNotThereHelp) {
  const auto fault = [&](const char* input) {
    const auto r = state_->eval(input);
    return r.ok() ? std::string() : r.error().hint;
  };
  ASSERT_TRUE(state_->run_string("r = robot.create{name = 'bow', links = {{a = 1}}}", "t").ok());
  EXPECT_EQ(fault("r:ik{}"), "Did you mean \"solve_ik\"?");
  EXPECT_EQ(fault("r:ikine{}"), "Did you mean \"solve_ik\"?");
  EXPECT_EQ(fault("r:fkine{}"), "Did you mean \"fk\"?");
  EXPECT_EQ(fault("robot.ik{}"), "Did you mean \"robot.solve_ik\"?");
  EXPECT_EQ(fault("r:dhtable()"), "Did you mean \"dh_table\"?");
  EXPECT_EQ(fault("fkin()"), "Did you mean \"robot.fk\"?");
  EXPECT_EQ(fault("exit()"), "quit() ends the program.");
  ASSERT_TRUE(state_->eval("five = 5").ok());
  EXPECT_EQ(*state_->eval("five?"), "five is a number: 5");
  EXPECT_EQ(*state_->eval("{}?"), "{} is a table: {}");
}

TEST_F(Lua, ALocalVariableThatNothingCanUseIsNoted) {
  const auto notes = [&] {
    int n = 0;
    for (const Message& m : app().messages.recent(1000)) n += m.code == "lone_local";
    return n;
  };
  const int before = notes();
  for (const char* input : {"local x = 3 print(x)", "local x = 3; return x",
                            "local function f() end", "for i = 1, 2 do local y = i end", "x = 3"})
    ASSERT_TRUE(state_->eval(input).ok()) << input;
  EXPECT_EQ(notes(), before);
  ASSERT_TRUE(state_->eval("local a, b = 3, {4}").ok());
  EXPECT_EQ(notes(), before + 1);
}

TEST_F(Lua, ANameOfTheProgramThatWasReplacedComesBackWithNil) {
  const auto notes = [&] {
    int n = 0;
    for (const Message& m : app().messages.recent(1000)) n += m.code == "hidden_name";
    return n;
  };
  ASSERT_TRUE(state_->eval("run = 5").ok());
  ASSERT_TRUE(state_->eval("run = run + 1").ok());
  EXPECT_EQ(notes(), 1);
  EXPECT_EQ(*state_->eval("run"), "6");
  ASSERT_TRUE(state_->eval("run = nil").ok());
  EXPECT_EQ(*state_->eval("#run.list()"), "0");
  ASSERT_TRUE(state_->eval("pi = 3").ok());
  EXPECT_EQ(notes(), 2);
  ASSERT_TRUE(state_->eval("pi = nil").ok());
  EXPECT_EQ(*state_->eval("pi > 3"), "true");
  // A script is left alone.
  ASSERT_TRUE(state_->run_string("world = 7", "t").ok());
  EXPECT_EQ(notes(), 2);
}

TEST_F(Lua, CompletionKnowsGlobalsCommandsParametersRecordsAndMethods) {
  const auto offers = [&](std::string_view text, std::string_view word) {
    const auto words = state_->complete(text, text.size()).words;
    return std::find(words.begin(), words.end(), word) != words.end();
  };
  ASSERT_TRUE(
      state_->run_string("m = material.create{name = 'titanium', density = 4500}", "t").ok());
  EXPECT_TRUE(offers("mater", "material"));
  EXPECT_TRUE(offers("material.cre", "create"));
  EXPECT_TRUE(offers("material.create{ den", "density = "));
  EXPECT_TRUE(offers("material.create({ den", "density = "));
  EXPECT_TRUE(offers("material \"ti", "titanium"));
  EXPECT_TRUE(offers("m:des", "describe"));
  // Values of arguments: poses, words of nested tables, providers of what is called.
  ASSERT_TRUE(state_
                  ->run_string("bow = robot.create{name = 'bow', links = {{a = 1}}, poses = {home "
                               "= {0}, aside = {1}}}",
                               "t")
                  .ok());
  EXPECT_TRUE(offers("bow:fk{ q = \"as", "aside"));
  EXPECT_TRUE(offers("robot.fk{ id = \"bow\", q = \"ho", "home"));
  EXPECT_TRUE(offers("solid.create{ name = \"s\", root = { kind = \"cyl", "cylinder"));
  EXPECT_TRUE(offers("solid.create{ root = { children = { { kind = \"bo", "box"));
  EXPECT_TRUE(offers("robot.create{ links = { { joint = \"pris", "prismatic"));
  EXPECT_TRUE(offers("robot.get(\"bow\"):solve_ik{ provider = \"num", "numeric"));
  EXPECT_FALSE(offers("robot.get(\"bow\"):solve_ik{ provider = \"", "newton_euler"));
  EXPECT_TRUE(offers("robot.set{ id = \"bow\", inverse_dynamics = \"newton", "newton_euler"));
  EXPECT_FALSE(offers("-- mater", "material"));
  EXPECT_FALSE(offers("\"mater", "material"));
}

TEST_F(Lua, AFunctionMaySolveInverseKinematicsAndIsJudgedByForwardKinematics) {
  ASSERT_TRUE(
      state_
          ->run_string(
              "ioci.provide('robomosp.ik/1', 'mine', function(model, target, seed, tolerance)\n"
              "  assert(model.dof == 1 and model.joints[1].upper == 3 and #seed == 1 and "
              "tolerance.position > 0)\n"
              "  if target(1, 4) < -0.99 then return nil, 'out_of_reach' end\n"
              "  if lie then return {0} end\n"
              "  return {math.atan(target(2, 4), target(1, 4))} end)",
              "ik.lua")
          .ok());
  const RobotModel model = pendulum();
  auto ik = app().registry.create<IkSolver>("mine");
  ASSERT_TRUE(ik.ok()) << ik.error().sentence();
  const auto params = make_params({});
  ASSERT_TRUE((*ik)->prepare(model, *params).ok());
  const std::vector<Pose> targets = {turned(0.7), turned(-2), turned(3.1)};
  std::vector<IkResult> results(3);
  IkBatch batch;
  batch.targets = targets;
  NoProgress progress;
  const auto done = (*ik)->solve(batch, results, progress);
  ASSERT_TRUE(done.ok()) << done.error().sentence();
  EXPECT_EQ(results[0].status, IkStatus::solved);
  EXPECT_NEAR(results[0].q.at(0), 0.7, 1e-12);
  EXPECT_NEAR(results[1].q.at(0), -2, 1e-12);
  EXPECT_EQ(results[2].status, IkStatus::out_of_reach);
  ASSERT_TRUE(state_->run_string("lie = true", "t").ok());
  ASSERT_TRUE((*ik)->solve(batch, results, progress).ok());
  EXPECT_EQ(results[0].status, IkStatus::not_converged);
  EXPECT_GT(results[0].position_error, 0.1);

  Error off_thread;
  std::jthread([&] { off_thread = (*ik)->solve(batch, results, progress).error(); }).join();
  EXPECT_EQ(off_thread.code, ErrorCode::plugin_failed);
  EXPECT_NE(off_thread.message.find("its script was busy for 0.2 s"), std::string::npos)
      << off_thread.sentence();
  state_.reset();
  const auto dead = (*ik)->solve(batch, results, progress);
  ASSERT_FALSE(dead.ok());
  EXPECT_NE(dead.error().message.find("closed"), std::string::npos);
  EXPECT_FALSE(app().registry.create<IkSolver>("mine").ok());
}

TEST_F(Lua, AProvidersFaultNamesTheProviderAndTheScriptLine) {
  const RobotModel model = pendulum();
  NoProgress progress;
  const std::vector<Pose> targets = {turned(0)};
  std::vector<IkResult> results(1);
  IkBatch batch;
  batch.targets = targets;
  const auto fault = [&](const std::string& body) {
    EXPECT_TRUE(
        state_
            ->run_string("ioci.provide('robomosp.ik/1', 'bad', function()\n" + body + " end)",
                         "bad.lua")
            .ok());
    auto ik = app().registry.create<IkSolver>("bad");
    EXPECT_TRUE((*ik)->prepare(model, *make_params({})).ok());
    const auto r = (*ik)->solve(batch, results, progress);
    return r.ok() ? std::string()
                  : std::string(to_string(r.error().code)) + " " + r.error().sentence();
  };
  const std::string raised = fault("error('no idea')");
  EXPECT_EQ(raised.find("plugin_failed"), 0U) << raised;
  EXPECT_NE(raised.find("\"bad\""), std::string::npos) << raised;
  EXPECT_NE(raised.find("bad.lua:2"), std::string::npos) << raised;
  EXPECT_NE(fault("return {0/0}").find("nan"), std::string::npos);
  EXPECT_NE(fault("return {1, 2}").find("2 numbers; 1 are needed"), std::string::npos);
  EXPECT_NE(fault("return 'x'").find("plugin_failed"), std::string::npos);
}

TEST_F(Lua, DynamicsOfAScriptSplitIntoTermsAndInertia) {
  // tau = 2 qdd + 3 qd^2 + 5 cos q, the coefficients chosen to tell the terms apart.
  ASSERT_TRUE(
      state_
          ->run_string(
              "ioci.provide('robomosp.inverse_dynamics/1', 'toy', function(model, q, qd, qdd)\n"
              "  return {2 * qdd[1] + 3 * qd[1] ^ 2 + 5 * math.cos(q[1])} end)",
              "t")
          .ok());
  const RobotModel model = pendulum();
  auto id = app().registry.create<InverseDynamics>("toy");
  ASSERT_TRUE(id.ok() && (*id)->prepare(model, *make_params({})).ok());
  NoProgress progress;
  const std::vector<double> q = {0.3}, qd = {1.5}, qdd = {0.25};
  DynamicsBatch b;
  b.count = 1;
  b.q = q;
  b.qd = qd;
  b.qdd = qdd;
  std::vector<double> out(1);
  const auto torque = [&](std::uint32_t terms) {
    b.terms = terms;
    const auto r = (*id)->torques(b, out, progress);
    EXPECT_TRUE(r.ok()) << (r.ok() ? "" : r.error().sentence());
    return out[0];
  };
  EXPECT_NEAR(torque(kGravityTerm), 5 * std::cos(0.3), 1e-12);
  EXPECT_NEAR(torque(kInertialTerm), 0.5, 1e-12);
  EXPECT_NEAR(torque(kVelocityTerm), 6.75, 1e-12);
  EXPECT_NEAR(torque(kFrictionTerm), 0.75, 1e-12);
  EXPECT_NEAR(torque(kAllTerms), 5 * std::cos(0.3) + 0.5 + 6.75 + 0.75, 1e-12);
  ASSERT_TRUE((*id)->inertia(b, out, progress).ok());
  EXPECT_NEAR(out[0], 2, 1e-12);
}

TEST_F(Lua, SpringsAndOtherTipsCountInDynamicsOfAScriptAndAMovingBaseIsRefused) {
  ASSERT_TRUE(state_
                  ->run_string("local function none() return {0} end\n"
                               "ioci.provide('robomosp.inverse_dynamics/1', 'none', none)\n"
                               "ioci.provide('robomosp.forward_dynamics/1', 'given',\n"
                               "  function(model, q, qd, tau) return {tau[1]} end)",
                               "t")
                  .ok());
  RobotModel model = pendulum();
  model.joints[0].spring = {8, 0.1};
  model.tips.push_back(model.tips[0]);
  model.tips[1].tool.p = {3, 0, 0};
  auto inverse = app().registry.create<InverseDynamics>("none");
  auto forward = app().registry.create<ForwardDynamics>("given");
  ASSERT_TRUE(inverse.ok() && (*inverse)->prepare(model, *make_params({})).ok());
  ASSERT_TRUE(forward.ok() && (*forward)->prepare(model, *make_params({})).ok());
  NoProgress progress;
  const std::vector<double> q = {0.3}, tau = {5};
  const std::vector<TipWrench> push = {{{0, 2, 0}, {}}};
  DynamicsBatch b;
  b.count = 1;
  b.q = q;
  b.tau = tau;
  b.tip = push;
  b.tip_index = 1;
  const double spring = 8 * (0.3 - 0.1), wrench = 2 * 3 * std::cos(0.3);
  std::vector<double> out(1);
  ASSERT_TRUE((*inverse)->torques(b, out, progress).ok());
  EXPECT_NEAR(out[0], spring - wrench, 1e-12);
  ASSERT_TRUE((*forward)->accelerations(b, out, progress).ok());
  EXPECT_NEAR(out[0], 5 - spring + wrench, 1e-12);
  b.tip_index = 2;
  EXPECT_FALSE((*inverse)->torques(b, out, progress).ok());
  b.tip_index = 0;
  const std::vector<BaseMotion> base(1);
  b.base = base;
  EXPECT_FALSE((*inverse)->torques(b, out, progress).ok());
  EXPECT_FALSE((*forward)->accelerations(b, out, progress).ok());
}

TEST_F(Lua, ASegmentOfAScriptIsSmoothAndMayBeSampledOnAnyThread) {
  ASSERT_TRUE(state_
                  ->run_string("ioci.provide('robomosp.segment/2', 'wave', {duration = 2, sample = "
                               "function(points, params, t)\n"
                               "  return pose(math.sin(t), 0, 0, rpy(0, 0, 0.5 * t)) end})",
                               "t")
                  .ok());
  auto factory = app().registry.create<SegmentFactory>("wave");
  ASSERT_TRUE(factory.ok());
  auto segment = (*factory)->make({}, *make_params({}));
  ASSERT_TRUE(segment.ok()) << segment.error().sentence();
  EXPECT_EQ((*segment)->duration(), 2);
  const std::vector<double> times = {0.0007, 0.9991, 1.7003};
  std::vector<PathSample> out(3);
  std::jthread([&] { EXPECT_TRUE((*segment)->sample(times, out).ok()); }).join();
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(out[i].pose.p[0], std::sin(times[i]), 1e-9);
    EXPECT_NEAR(out[i].velocity[0], std::cos(times[i]), 1e-5);
    EXPECT_NEAR(out[i].acceleration[0], -std::sin(times[i]), 1e-3);
    EXPECT_NEAR(out[i].angular_velocity[2], 0.5, 1e-6);
    EXPECT_NEAR(std::atan2(out[i].pose.R[3], out[i].pose.R[0]), 0.5 * times[i], 1e-9);
  }
}

TEST_F(Lua, AControllerMayUseTheOldWordsAndIsToldTheNewOnes) {
  std::vector<std::string> notes;
  const auto listener = app().messages.subscribe([&](const Message& m) {
    if (m.code == "old_word") notes.push_back(m.text);
  });
  const auto controlled = [&](const std::string& name, const std::string& wanted,
                              const std::string& kept) {
    return eval("ioci.provide('robomosp.controller/1', '" + name + "', {" + kept + " = 1, " +
                "torques = function(model, now, kept) local tau = {} kept[1] = kept[1] + 1 " +
                "for j = 1, model.dof do tau[j] = now.gravity[j] + 50 * (now.q_" + wanted +
                "[j] - now.q[j]) - 9 * (now.qd[j] - now.qd_" + wanted +
                "[j]) end return tau end})" +
                " return (robot 'planar2rods'):simulate{controller = '" + name +
                "', q = {0, 0.5}, reference = {0, 0.4}, duration = 0.1}:values('q2')");
  };
  const std::string now = controlled("now", "desired", "state");
  EXPECT_EQ(now.find("ERROR"), std::string::npos) << now;
  EXPECT_TRUE(notes.empty());
  EXPECT_EQ(controlled("before", "wanted", "memory"), now);
  ASSERT_EQ(notes.size(), 3U) << "each word is noted once";
  EXPECT_NE(notes[0].find("\"state\""), std::string::npos) << notes[0];
  EXPECT_NE(notes[1].find("now.q_desired"), std::string::npos) << notes[1];
  app().messages.unsubscribe(listener);
}

}  // namespace
}  // namespace robomosp::lua
