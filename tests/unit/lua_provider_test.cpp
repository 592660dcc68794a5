// SPDX-License-Identifier: Apache-2.0
// Providers written in Lua: what their functions are given of any mechanism, and the sentences for
// answers that cannot be used.
#include <cmath>
#include <fstream>
#include <iterator>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include <robomosp/sdk/collision.h>
#include <robomosp/sdk/curve.h>
#include <robomosp/sdk/dynamics.h>
#include <robomosp/sdk/ik.h>
#include <robomosp/sdk/integrator.h>
#include <robomosp/sdk/motion_law.h>
#include <robomosp/sdk/orientation.h>
#include <robomosp/sdk/physics.h>
#include <robomosp/sdk/robot_code.h>

#include "kernel/plugin_loader.h"
#include "lua/lua_state.h"
#include "support/program.h"

namespace robomosp::lua {
namespace {

class LuaProviders : public test::ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    LuaOptions options;
    options.patience = std::chrono::milliseconds(100);
    state_ = std::make_unique<LuaState>(app(), session_, options);
  }
  void run(const std::string& code) {
    const auto r = state_->run_string(code, "mine.lua");
    ASSERT_TRUE(r.ok()) << r.error().sentence();
  }
  /// A provider "mine" of the interface; `given` is its function or table.
  template <class I>
  std::shared_ptr<I> provide(const std::string& given) {
    run("ioci.provide('" + std::string(I::kInterfaceId) + "', 'mine', " + given + ")");
    auto made = app().registry.create<I>("mine");
    EXPECT_TRUE(made.ok());
    return made.ok() ? *made : nullptr;
  }
  template <class I>
  std::shared_ptr<I> prepared(const std::string& given, const RobotModel& model) {
    auto solver = provide<I>(given);
    const auto done = solver->prepare(model, *make_params({}));
    EXPECT_TRUE(done.ok()) << done.error().sentence();
    return solver;
  }
  template <class T>
  static std::string said(const Result<T>& r) {
    return r.ok() ? "" : std::string(to_string(r.error().code)) + " " + r.error().sentence();
  }
  static void expect_says(const std::string& said, std::initializer_list<const char*> parts) {
    for (const char* part : parts)
      EXPECT_NE(said.find(part), std::string::npos) << part << " is not in: " << said;
  }

  /// A free body, a ball joint on it, a hinge, and a slide that follows the hinge; the slide's tip
  /// is pinned to the base by a loop in x and about y.
  static RobotModel machine() {
    RobotModel m;
    m.name = "machine";
    m.joints.resize(4);
    const JointType types[] = {JointType::free, JointType::spherical, JointType::revolute,
                               JointType::prismatic};
    for (std::size_t i = 0; i < 4; ++i) {
      m.joints[i].name = "j" + std::to_string(i + 1);
      m.joints[i].type = types[i];
      m.joints[i].parent = static_cast<std::int32_t>(i) - 1;
      m.joints[i].body.mass = 1 + static_cast<double>(i);
    }
    m.joints[3].coupling = {2, -0.5, 0.1};
    m.joints[3].friction.viscous = 3;
    m.joints[2].spring = {7, 0.2};
    m.joints[2].passive = true;
    m.tips.resize(1);
    m.tips[0].joint = 3;
    LoopModel loop;
    loop.name = "pin";
    loop.joint_a = 3;
    loop.in_b.p = {0.3, 0, 0};
    loop.fixed = kLoopX | kLoopRotY;
    m.loops.push_back(loop);
    m.number_coordinates();
    return m;
  }
  /// All joints at zero, where the loop is open by 0.3 m - unless the free body is moved there.
  static std::vector<double> at(double x) { return {x, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0}; }

  ioci::Session session_{"test"};
  std::unique_ptr<LuaState> state_;
  NoProgress progress_;
};

TEST_F(LuaProviders, ThePageNamesTheInterfacesThatNeedAnotherLanguage) {
  std::ifstream in(std::string(ROBOMOSP_SOURCE_DIR) + "/docs/plugin_author/lua.md");
  const std::string page(std::istreambuf_iterator<char>(in), {});
  ASSERT_FALSE(page.empty());
  // The refusal lists what a script can provide.
  const auto refused = state_->eval("ioci.provide('robomosp.nothing/1', 'x', print)");
  ASSERT_FALSE(refused.ok());
  const std::string can = refused.error().sentence();
  std::size_t count = 0;
  for (const std::string& id : known_interfaces()) {
    if (can.find(id) != std::string::npos) {
      EXPECT_NE(page.find("| `" + id + "` |"), std::string::npos) << id << " has no row";
      ++count;
      continue;
    }
    const std::string word = id.substr(id.find('.') + 1, id.find('/') - id.find('.') - 1);
    EXPECT_TRUE(page.find("`" + word + "`") != std::string::npos ||
                page.find(" " + word + "s need") != std::string::npos)
        << "the page does not say that " << id << " is none for scripts";
  }
  EXPECT_GE(count, 12U);
}

TEST_F(LuaProviders, AreGivenEveryMechanismWithItsNumbering) {
  const RobotModel m = machine();
  auto ik = prepared<IkSolver>(
      "function(model, target, seed, asked)\n"
      "  local j, l = model.joints, model.loops[1]\n"
      "  assert(model.dof == 10 and model.coordinates == 12 and #seed == 12 and seed[4] == 1)\n"
      "  assert(j[1].type == 'free' and j[2].type == 'spherical' and j[4].type == 'prismatic')\n"
      "  assert(j[1].q_index == 1 and j[2].q_index == 8 and j[3].q_index == 12)\n"
      "  assert(j[1].v_index == 1 and j[2].v_index == 7 and j[3].v_index == 10)\n"
      "  assert(j[4].q_index == 12 and j[4].coupling.of == 3 and j[4].coupling.ratio == -0.5)\n"
      "  assert(j[4].coupling.offset == 0.1 and not j[3].coupling and j[3].passive)\n"
      "  assert(j[3].spring.stiffness == 7 and j[3].spring.rest == 0.2)\n"
      "  assert(j[4].friction.viscous == 3 and j[1].parent == 0 and j[4].parent == 3)\n"
      "  assert(l.name == 'pin' and l.joint_a == 4 and l.joint_b == 0 and l.in_b(1, 4) == 0.3)\n"
      "  assert(#l.fixed == 2 and l.fixed[1] == 1 and l.fixed[2] == 5)\n"
      "  assert(asked.tip == 1 and not asked.all and asked.objective == 'none')\n"
      "  return {target(1, 4), 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0} end",
      m);
  const auto solve = [&](double x) {
    std::vector<Pose> targets(1);
    targets[0].p = {x, 0, 0.1};  // the follower stands at its offset
    std::vector<IkResult> results(1);
    IkBatch batch;
    batch.targets = targets;
    const auto done = ik->solve(batch, results, progress_);
    EXPECT_TRUE(done.ok()) << said(done);
    return results[0];
  };
  const IkResult closed = solve(0.3), open = solve(0.2);
  EXPECT_EQ(closed.status, IkStatus::solved) << closed.detail;
  EXPECT_EQ(closed.q, at(0.3));
  EXPECT_EQ(open.status, IkStatus::not_converged);
  EXPECT_NE(open.detail.find("loops open by 0.1"), std::string::npos) << open.detail;
}

TEST_F(LuaProviders, ThatSaySimpleAreNotGivenOthers) {
  auto ik = provide<IkSolver>("{solve = function() return nil end, tags = {'simple'}}");
  expect_says(said(ik->prepare(machine(), *make_params({}))),
              {"unsupported", "robot \"machine\"", "one coordinate per joint", "\"mine\""});
  RobotModel plain;
  plain.joints.resize(1);
  plain.tips.resize(1);
  plain.number_coordinates();
  EXPECT_TRUE(ik->prepare(plain, *make_params({})).ok());
  const auto info = app().registry.find(IkSolver::kInterfaceId, "mine");
  ASSERT_TRUE(info.ok());
  EXPECT_EQ(info->tags, std::vector<std::string>{"simple"});
  const auto wrong = state_->run_string(
      "ioci.provide('robomosp.ik/1', 'mine', {solve = function() end, tags = 'simple'})", "t");
  expect_says(said(wrong), {"tags is not a list of words"});
}

TEST_F(LuaProviders, ServeGoalsAndObjectivesOnlyWhenTheySaySo) {
  const RobotModel m = machine();
  const std::vector<Pose> targets(2);
  const std::vector<IkGoal> goals = {{0, kIkPosition, 1}, {0, kIkRotZ, 2}};
  std::vector<IkResult> results(1);
  IkBatch batch;
  batch.targets = targets;
  batch.goals = goals;
  auto plain = prepared<IkSolver>("function() return nil end", m);
  expect_says(said(plain->solve(batch, results, progress_)), {"unsupported", "tags = {\"goals\"}"});
  auto able = prepared<IkSolver>(
      "{tags = {'goals', 'objectives'}, solve = function(model, target, seed, asked)\n"
      "  local g = asked.goals\n"
      "  assert(#g == 2 and #g[1].parts == 3 and g[2].parts[1] == 6 and g[2].weight == 2)\n"
      "  assert(g[2].target(4, 4) == 1 and asked.objective == 'limits')\n"
      "  return nil, 'seen' end}",
      m);
  batch.objective = IkObjective::limits;
  ASSERT_EQ(said(able->solve(batch, results, progress_)), "");
  EXPECT_EQ(results[0].detail, "seen");
  batch.objective = IkObjective::none;
  const std::vector<double> angles = {0.1};
  batch.arm_angles = angles;
  expect_says(said(able->solve(batch, results, progress_)), {"tags = {\"arm_angle\"}"});
}

TEST_F(LuaProviders, DynamicsOfAnyMechanismAndOfLoops) {
  const RobotModel m = machine();
  auto inverse = prepared<InverseDynamics>(
      "function(model, q, qd, qdd)\n"
      "  assert(#q == 12 and #qd == 10 and #qdd == 10)\n"
      "  local tau = {}\n"
      "  for k = 1, 10 do tau[k] = k * qdd[k] end\n"
      "  return tau end",
      m);
  const std::vector<double> q = at(0), qd(10, 0.5), qdd(10, 1);
  DynamicsBatch b;
  b.count = 1;
  b.q = q;
  b.qd = qd;
  b.qdd = qdd;
  std::vector<double> tau(10), inertia(100);
  ASSERT_EQ(said(inverse->torques(b, tau, progress_)), "");
  EXPECT_DOUBLE_EQ(tau[8], 9);
  // The follower's friction counts for the joint that it follows, by the square of the ratio.
  EXPECT_DOUBLE_EQ(tau[9], 10 + 7 * (0 - 0.2) + 0.25 * 3 * 0.5);
  ASSERT_EQ(said(inverse->inertia(b, inertia, progress_)), "");
  EXPECT_DOUBLE_EQ(inertia[11 * 4], 5);

  auto plain = provide<ForwardDynamics>("function() return {} end");
  expect_says(said(plain->prepare(m, *make_params({}))), {"unsupported", "tags = {\"loops\"}"});
  auto silent = prepared<ForwardDynamics>(
      "{tags = {'loops'}, accelerations = function(model, q, qd, tau) return tau end}", m);
  std::vector<double> out(10), forces(2);
  b.tau = qdd;
  b.terms = 0;
  ASSERT_EQ(said(silent->accelerations(b, out, progress_)), "");
  EXPECT_EQ(out, qdd);
  expect_says(said(silent->constrained(b, out, forces, progress_)),
              {"unsupported", "second result"});
  auto able = prepared<ForwardDynamics>(
      "{tags = {'loops'}, accelerations = function(model, q, qd, tau) return tau, {4, 5} end}", m);
  ASSERT_EQ(said(able->constrained(b, out, forces, progress_)), "");
  EXPECT_EQ(forces, (std::vector<double>{4, 5}));
}

TEST_F(LuaProviders, FunctionsLentToAScriptEndWithItsCall) {
  auto integrator = provide<Integrator>("function(rate, t, x, h) kept = rate return x end");
  struct System final : OdeSystem {
    [[nodiscard]] std::size_t size() const override { return 1; }
    [[nodiscard]] std::size_t positions() const override { return 1; }
    void project(std::span<double>) override {}
    [[nodiscard]] std::size_t events() const override { return 0; }
    void event_values(double, std::span<const double>, std::span<double>) override {}
    bool at_event(double, std::size_t, std::span<double>) override { return true; }
    Result<void> rate(double, std::span<const double>, std::span<double> dx) override {
      dx[0] = 1;
      return {};
    }
  } system;
  struct Sink final : OdeSink {
    bool sample(double, std::span<const double>) override { return true; }
  } sink;
  ASSERT_TRUE(integrator->prepare(*make_params({})).ok());
  const std::vector<double> x0 = {0};
  OdeRun run_;
  run_.x0 = x0;
  run_.end = 0.01;
  run_.step = 0.01;
  ASSERT_EQ(said(integrator->run(system, run_, sink, progress_)), "");
  expect_says(said(state_->run_string("kept(0, {1})", "t")), {"a call that has ended"});
}

// ---- curves, laws and orientations ----

class LuaPaths : public LuaProviders {
 protected:
  static std::vector<Pose> points() {
    std::vector<Pose> p(3);
    p[1].p = {0.5, 0.25, 0};
    p[2].p = {1, 1, 0};
    return p;
  }
  Result<std::unique_ptr<Curve>> curve(const std::string& given) {
    return provide<CurveFactory>(given)->make(points(), *make_params({}));
  }
  Result<std::unique_ptr<MotionLaw>> law(const std::string& given) {
    return provide<MotionLawFactory>(given)->make({sizeof(LawTask), 2, 1}, *make_params({}));
  }
  Result<std::unique_ptr<Orientation>> orientation(const std::string& given) {
    const std::vector<double> shares{0, 0.3, 1};
    const auto all = points();
    return provide<OrientationFactory>(given)->make({sizeof(OrientationTask), all, shares, nullptr},
                                                    *make_params({}));
  }
};

// u -> (u, u^2, u^3): a cubic, of which differences of fourth order miss nothing but rounding.
TEST_F(LuaPaths, ACurveHasTheDerivativesOfItsPlaces) {
  const auto made = curve(
      "{place = function(points, params, u) assert(#points == 3) return {u, u^2, u^3} end,\n"
      " knots = function(points) return {0, points[2](1, 4), 1} end}");
  ASSERT_TRUE(made.ok()) << said(made);
  EXPECT_EQ((*made)->knots(), (std::vector<double>{0, 0.5, 1}));
  EXPECT_EQ((*made)->end(), 1);
  for (const double u : {0.0, 0.00037, 0.31415, 0.5, 0.99991, 1.0}) {
    CurveSample s;
    std::jthread([&] {
      EXPECT_TRUE((*made)->evaluate({&u, 1}, {&s, 1}).ok());
    }).join();  // any thread
    const double p[] = {u, u * u, u * u * u}, d1[] = {1, 2 * u, 3 * u * u}, d2[] = {0, 2, 6 * u};
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(s.p[k], p[k], 1e-14);
      EXPECT_NEAR(s.d1[k], d1[k], 1e-11);
      EXPECT_NEAR(s.d2[k], d2[k], 1e-8);
    }
  }
  expect_says(said(curve("function() return nil, 'no road' end")), {"unsupported", "no road"});
  expect_says(said(curve("function() return {1, 2} end")), {"\"mine\"", "the place", "2 numbers"});
  expect_says(said(curve("{place = function(_, _, u) return {u, 0, 0} end,\n"
                         " knots = function() return {0, 2, 1} end}")),
              {"knot 2 is 2", "0 to 1"});
}

// w - sin(2 pi w) / (2 pi) over 4 s.
TEST_F(LuaPaths, ALawRunsFromStartToEndWithItsRates) {
  const auto made =
      law("{duration = function(way) return 2 * way.length end, share = function(way, params, t)\n"
          "  local x = t / 4 return x - math.sin(2 * math.pi * x) / (2 * math.pi) end}");
  ASSERT_TRUE(made.ok()) << said(made);
  EXPECT_EQ((*made)->duration(), 4);
  const double w = std::acos(-1.0) / 2;
  for (const double t : {0.0, 0.3, 1.7, 3.9, 4.0}) {
    LawSample s;
    EXPECT_TRUE((*made)->sample({&t, 1}, {&s, 1}).ok());
    EXPECT_NEAR(s.share, t / 4 - std::sin(w * t) / (4 * w), 1e-12);
    EXPECT_NEAR(s.rate, (1 - std::cos(w * t)) / 4, 1e-9);
    EXPECT_NEAR(s.acceleration, w * std::sin(w * t) / 4, 1e-7);
  }
  LawSample s;
  const double after = 5;
  EXPECT_TRUE((*made)->sample({&after, 1}, {&s, 1}).ok());
  EXPECT_EQ(s.share, 1);
  EXPECT_EQ(s.rate, 0);
  // Rates that are given are taken: here the corner of a trapezoid.
  const auto exact =
      law("{duration = 2, share = function(way, params, t)\n"
          "  if t <= 1 then return t^2 / 2, t, 1 end return 1 - (2 - t)^2 / 2, 2 - t, -1 end}");
  ASSERT_TRUE(exact.ok()) << said(exact);
  const double before = 0.9995;
  EXPECT_TRUE((*exact)->sample({&before, 1}, {&s, 1}).ok());
  EXPECT_NEAR(s.rate, before, 2e-3);
  expect_says(said(law("{duration = 1, share = function(w, p, t) return 1 - t end}")),
              {"turn back at 0.002 s"});
  expect_says(said(law("{duration = 1, share = function(w, p, t) return t / 2 end}")),
              {"the path parameter at the end is 0.5", "0 to 1"});
  expect_says(said(law("{duration = 1, share = function(w, p, t) return 'all' end}")),
              {"the share at 0 s is not a finite number"});
  expect_says(said(law("{duration = -1, share = function(w, p, t) return t end}")),
              {"the duration is not a number above 0"});
}

// A turn about z by w^2: dR/dw = [2 w z]x R.
TEST_F(LuaPaths, AnOrientationHasTheDerivativesOfItsTurns) {
  const auto made = orientation(
      "function(points, params, w, shares)\n"
      "  assert(#points == 3 and shares[2] == 0.3)\n"
      "  return pose(0, 0, 0, rpy(0, 0, w^2)) end");
  ASSERT_TRUE(made.ok()) << said(made);
  for (const double w : {0.0, 0.1234567, 0.7, 1.0}) {
    OrientationSample s;
    CurveSample along;
    EXPECT_TRUE((*made)->evaluate({&w, 1}, {&along, 1}, {&s, 1}).ok());
    EXPECT_NEAR(s.R[0], std::cos(w * w), 1e-12);
    EXPECT_NEAR(s.R[3], std::sin(w * w), 1e-12);
    EXPECT_NEAR(s.turn[2], 2 * w, 1e-9);
    EXPECT_NEAR(s.bend[2], 2, 1e-6);
    EXPECT_NEAR(s.turn[0], 0, 1e-9);
  }
  expect_says(said(orientation("function() return 3 end")), {"\"mine\"", "the pose"});
}

// ---- collision ----

class LuaCollision : public LuaProviders {
 protected:
  static std::vector<ShapedBody> balls() {
    Shape s;
    s.kind = ShapeKind::sphere;
    s.sizes = {0.5, 0, 0};
    return {{{s}}, {{s}}, {}};
  }
  static std::vector<Pose> poses(double x) {
    std::vector<Pose> p(3);
    p[1].p = {x, 0, 0};
    return p;
  }
  Result<PairDistance> distance(const std::string& given, double x, CollisionPair pair = {0, 1},
                                double interest = HUGE_VAL) {
    auto engine = provide<CollisionEngine>(given);
    RMP_TRY_ASSIGN(const auto scene, engine->build(balls(), *make_params({}), progress_));
    std::vector<PairDistance> out(1);
    RMP_TRY(scene->distances(poses(x), std::vector{pair}, interest, out, progress_));
    return out[0];
  }
};

constexpr const char* kBalls =
    "function(a, b, A, B, interest)\n"
    "  assert(#a == 1 and a[1].kind == 'sphere' and #a[1].sizes == 1)\n"
    "  local x, r = B(1, 4) - A(1, 4), a[1].sizes[1]\n"
    "  return x - 2 * r, {A(1, 4) + r, 0, 0}, {B(1, 4) - r, 0, 0} end";

TEST_F(LuaCollision, TellsDistancesTouchesAndWhatTouchesNothing) {
  const auto apart = distance(kBalls, 3), deep = distance(kBalls, 0.75);
  ASSERT_TRUE(apart.ok() && deep.ok()) << said(apart) << said(deep);
  EXPECT_EQ(apart->distance, 2);
  EXPECT_EQ(apart->on_b[0], 2.5);
  EXPECT_EQ(deep->distance, -0.25);
  EXPECT_EQ(distance(kBalls, 3, {0, 2}, 0.7)->distance, 0.7) << "a body without shapes";
  EXPECT_EQ(distance(kBalls, 3, {0, 1}, 0.7)->distance, 0.7) << "farther than of interest";

  auto engine = provide<CollisionEngine>(kBalls);
  auto scene = engine->build(balls(), *make_params({}), progress_);
  ASSERT_TRUE(scene.ok());
  std::vector<std::uint8_t> hits(3, 9);
  const std::vector<CollisionPair> pairs = {{0, 1}, {1, 2}, {0, 2}};
  ASSERT_EQ(said((*scene)->collisions(poses(0.75), pairs, hits, progress_)), "");
  EXPECT_EQ(hits, (std::vector<std::uint8_t>{1, 0, 0}));
  Result<void> off_thread;
  std::jthread([&] {
    off_thread = (*scene)->collisions(poses(1), pairs, hits, progress_);
    scene->reset();
  }).join();
  expect_says(said(off_thread), {"plugin_failed", "busy for 0.1 s"});
}

TEST_F(LuaCollision, WhatPrepareMakesIsWhatIsGivenLater) {
  const char* given =
      "{prepare = function(shapes) return #shapes == 0 and 'none' or {r = shapes[1].sizes[1]} "
      "end,\n"
      " distance = function(a, b, A, B) return 1, {0, 0, 0}, {2 * a.r, 0, 0} end,\n"
      " touches = function(a, b, A, B) return a.r == b.r end}";
  EXPECT_EQ(distance(given, 1)->distance, 1);
  auto scene = provide<CollisionEngine>(given)->build(balls(), *make_params({}), progress_);
  ASSERT_TRUE(scene.ok());
  std::vector<std::uint8_t> hits(1);
  ASSERT_EQ(said((*scene)->collisions(poses(9), std::vector{CollisionPair{0, 1}}, hits, progress_)),
            "");
  EXPECT_EQ(hits[0], 1);
  run("ioci.withdraw('robomosp.collision/1', 'mine')");
  expect_says(
      said((*scene)->collisions(poses(9), std::vector{CollisionPair{0, 1}}, hits, progress_)),
      {"withdrawn"});
}

TEST_F(LuaCollision, AnswersThatCannotBeUsedAreSentences) {
  const auto answer = [&](const char* returned) {
    return said(distance("function() return " + std::string(returned) + " end", 3));
  };
  expect_says(answer("'far'"), {"plugin_failed", "\"mine\"", "bodies 1 and 2", "a string"});
  expect_says(answer("0/0, {0, 0, 0}, {0, 0, 0}"), {"nan"});
  expect_says(answer("2"), {"without nearest points"});
  expect_says(answer("2, {0, 0}, {0, 0, 0}"), {"2 numbers; 3 are needed"});
  expect_says(answer("2, {0, 0, 0}, {3, 0, 0}"), {"is 2 m", "3 m apart"});
  expect_says(answer("-1, {0, 0, 0}, {3, 0, 0}"), {"is -1 m", "3 m apart"});
  EXPECT_EQ(answer("0, {1, 0, 0}, {1, 0, 0}"), "");
  expect_says(said(distance("{distance = function() end, prepare = function() return nil, 'no "
                            "balls' end}",
                            3)),
              {"unsupported", "body 1", "no balls"});
  auto scene = provide<CollisionEngine>(
                   "{distance = function() end, touches = function() return 1 "
                   "end}")
                   ->build(balls(), *make_params({}), progress_);
  std::vector<std::uint8_t> hits(1);
  expect_says(
      said((*scene)->collisions(poses(1), std::vector{CollisionPair{0, 1}}, hits, progress_)),
      {"touches returned", "a number"});
}

// ---- physics ----

class LuaPhysics : public LuaProviders {
 protected:
  /// A floor that stands, a ball at z = 1, and a hinge of the ball about z.
  Result<std::unique_ptr<PhysicsWorld>> world(const std::string& given) {
    std::vector<PhysicsBody> bodies(2);
    bodies[1].mass = {2, {}, {0.1, 0.1, 0.1, 0, 0, 0}};
    bodies[1].pose.p = {0, 0, 1};
    std::vector<PhysicsJoint> joints(1);
    joints[0].b = 1;
    joints[0].lower = 1, joints[0].upper = -1;
    return provide<PhysicsEngine>(given)->create(bodies, joints, {0, 0, -10}, *make_params({}));
  }
  Result<void> step(const std::string& body, int steps = 1) {
    RMP_TRY_ASSIGN(const auto w, world("function(world, dt, forces) " + body + " end"));
    return w->step(0.1, steps, {}, progress_);
  }
};

TEST_F(LuaPhysics, MovesTheBodiesOfItsTableAndMeasuresJoints) {
  auto w = world(
      "function(world, dt, forces)\n"
      "  local b, j = world.bodies[2], world.joints[1]\n"
      "  assert(#world.bodies == 2 and world.bodies[1].mass == 0 and world.gravity[3] == -10)\n"
      "  assert(j.a == 0 and j.b == 2 and j.type == 'revolute' and j.upper == math.huge)\n"
      "  assert(#forces == 1 and forces[1] == 4)\n"
      "  angle = (angle or 0) + 2\n"
      "  b.pose = pose(0, 0, 1, rpy(0, 0, angle))\n"
      "  b.velocity, b.angular_velocity = {0, 0, 0}, {0, 0, 20}\n"
      "  seen = j.position\n"
      "  return {{a = 2, b = 1, point = {0, 0, 0}, normal = {0, 0, 1}, depth = 0.01,\n"
      "           force = {0, 0, 20}}} end");
  ASSERT_TRUE(w.ok()) << said(w);
  const std::vector<double> forces = {4};
  ASSERT_EQ(said((*w)->step(0.1, 3, forces, progress_)), "");
  std::vector<Pose> poses(2);
  std::vector<Vec3> v(2), turning(2);
  std::vector<double> q(1), qd(1);
  EXPECT_TRUE((*w)->read({sizeof(PhysicsState), poses, v, turning, q, qd}).ok());
  EXPECT_EQ(poses[1].p[2], 1);
  EXPECT_NEAR(q[0], 6, 1e-12) << "whole turns are counted";
  EXPECT_NEAR(qd[0], 20, 1e-12);
  const auto seen = state_->eval_values("seen");
  ASSERT_TRUE(seen.ok());
  EXPECT_NEAR((*seen)[0].number(), 4, 1e-12);
  std::vector<PhysicsContact> contacts;
  (*w)->contacts(contacts);
  ASSERT_EQ(contacts.size(), 1U);
  EXPECT_EQ(contacts[0].a, 1);
  EXPECT_EQ(contacts[0].force[2], 20);
}

TEST_F(LuaPhysics, HoldsMovesAndPushesWhatItHasFunctionsFor) {
  auto plain = world("function() end");
  ASSERT_TRUE(plain.ok());
  expect_says(said((*plain)->attach(0, 1)), {"unsupported", "holds nothing", "attach"});
  expect_says(said((*plain)->release(1)), {"unsupported", "release"});
  expect_says(said((*plain)->servo(0, 1, 1)), {"unsupported", "limited force"});
  expect_says(said((*plain)->move(1, Pose{}, {}, {})), {"is not fixed", "body 2"});

  auto able = world(
      "{step = function(world) assert(world.bodies[1].pose(1, 4) == 5 and\n"
      "   world.bodies[1].velocity[2] == 3) end,\n"
      " attach = function(world, number, a, b) if a == 1 then return nil, 'the floor' end held = b "
      "end,\n"
      " release = function(world, number) released = number end,\n"
      " push = function(world, body, force, torque) pushed = force[2] end}");
  ASSERT_TRUE(able.ok()) << said(able);
  expect_says(said((*able)->attach(0, 1)), {"unsupported", "attach", "the floor"});
  const auto number = (*able)->attach(1, 0);
  ASSERT_TRUE(number.ok()) << said(number);
  EXPECT_EQ(said((*able)->release(*number)), "");
  EXPECT_EQ(said((*able)->push(1, {0, 2, 0}, {})), "");
  Pose moved;
  moved.p = {5, 0, 0};
  EXPECT_EQ(said((*able)->move(0, moved, {0, 3, 0}, {})), "");
  EXPECT_EQ(said((*able)->step(0.1, 1, {}, progress_)), "");
  const auto kept = state_->eval_values("held, released, pushed");
  ASSERT_TRUE(kept.ok());
  EXPECT_EQ((*kept)[0], Value(1));
  EXPECT_EQ((*kept)[1], Value(*number));
  EXPECT_EQ((*kept)[2].number(), 2);
  expect_says(said(world("{step = function() end, create = function() return nil, 'hinges' end}")),
              {"unsupported", "hinges"});
}

TEST_F(LuaPhysics, AnswersThatCannotBeUsedAreSentences) {
  expect_says(said(step("world.bodies[2].pose = {1, 2}")),
              {"plugin_failed", "\"mine\"", "the pose of body 2"});
  expect_says(said(step("world.bodies[2].velocity = {0, 0, 0/0}")), {"velocity of body 2", "nan"});
  expect_says(said(step("world.bodies[2] = nil")), {"taken body 2 away"});
  expect_says(said(step("world.bodies = 3")), {"taken body 2 away"});
  expect_says(said(step("return 3")), {"the contacts are a number"});
  expect_says(said(step("return {{a = 7, b = 1}}")), {"contact 1 has no body a", "1 to 2"});
  expect_says(said(step("return {{a = 1, b = 2, point = {0, 0, 0}}}")), {"normal of contact 1"});
  const std::string contact = "point = {0,0,0}, force = {0,0,0}, normal = {0,0,";
  expect_says(said(step("return {{a = 1, b = 2, depth = -1, " + contact + "1}}}")), {"no depth"});
  expect_says(said(step("return {{a = 1, b = 2, depth = 0, " + contact + "2}}}")), {"length 1"});
  expect_says(said(step("return {{a = 1, b = 1, depth = 0, " + contact + "1}}}")), {"one body"});
  EXPECT_EQ(said(step("return {{a = 1, b = 2, depth = 0, " + contact + "1}}}", 3)), "");
  expect_says(said(step("error('lost')")), {"lost", "mine.lua"});
}

// ---- code ----

TEST_F(LuaProviders, CodeIsAListOfFiles) {
  const RobotModel m = machine();
  const auto generate = [&](const std::string& body) {
    return provide<RobotCodeGenerator>("function(model, name, parts) " + body + " end")
        ->generate(m, "arm", kCodeInertia | kCodeJacobian, *make_params({}), progress_);
  };
  const auto files = generate(
      "assert(parts.inertia and parts.jacobian and not parts.forward_dynamics)\n"
      "return {{name = name .. '.m', text = 'a\\0b'}, {name = 'x', text = model.name}}");
  ASSERT_TRUE(files.ok()) << said(files);
  ASSERT_EQ(files->size(), 2U);
  EXPECT_EQ((*files)[0].name, "arm.m");
  EXPECT_EQ((*files)[0].text, std::string("a\0b", 3));
  EXPECT_EQ((*files)[1].text, "machine");
  expect_says(said(generate("return 'text'")), {"plugin_failed", "the files are a string"});
  expect_says(said(generate("return {}")), {"list of files is empty"});
  expect_says(said(generate("return {{text = ''}}")), {"file 1 has no name"});
  expect_says(said(generate("return {{name = 'a'}}")), {"file 1 has no text"});
  expect_says(said(generate("return nil, 'balls'")), {"unsupported", "machine", "balls"});
}

}  // namespace
}  // namespace robomosp::lua
