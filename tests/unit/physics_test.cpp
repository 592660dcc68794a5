// SPDX-License-Identifier: Apache-2.0
// Worlds with contact: what rests, slides and is carried, against closed forms.
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "motion/provider_params.h"
#include "sim/physics.h"
#include "spatial/pose.h"
#include "support/records.h"
#include "support/workbench.h"

namespace robomosp {
namespace {

using sim::PhysicsAction;
using sim::PhysicsRun;
using sim::RobotDrive;
using test::make;
using test::unwrap;
using test::Workbench;
using Action = PhysicsAction::Kind;

constexpr double kFall = 9.81;
constexpr double kBoxMass = 600 * 0.1 * 0.1 * 0.1;  ///< density times volume [kg]

class Physics : public testing::Test {
 protected:
  Physics() {
    model::Material wood;
    wood.density = 600;
    const auto material = make(bench.document, "wood", wood);
    box_ = add_box("box", {0.1, 0.1, 0.1}, material);
    world_.objects.push_back({"floor", add_box("floor", {3, 3, 0.1}, {}), at({0, 0, -0.1})});
  }
  static model::Placement at(Vec3 p) {
    model::Placement out;
    out.position = p;
    return out;
  }
  SolidId add_box(const std::string& name, std::array<double, 3> sizes, MaterialId material) {
    model::SolidNode n;
    n.name = name;
    n.sizes = {sizes[0], sizes[1], sizes[2]};
    model::Solid s;
    s.material = material;
    s.nodes = {n};
    return make(bench.document, name, s);
  }
  /// A hand that slides along x and z, with a pad 0.04 m high below its mounting at z = 0.3.
  void add_gantry() {
    const auto link = [](const char* name, std::int32_t parent, Vec3 axis) {
      model::Link l;
      l.name = name;
      l.parent = parent;
      l.joint = model::JointKind::prismatic;
      l.origin = model::Placement{};
      l.axis = axis;
      l.lower = -1, l.upper = 1;
      l.given = MassProperties{20, {}, {0.1, 0.1, 0.1, 0, 0, 0}};
      return l;
    };
    model::Robot r;
    r.links = {link("carriage", -1, {1, 0, 0}), link("hand", 0, {0, 0, 1})};
    const AnyId pad = add_box("pad", {0.04, 0.04, 0.04}, {});
    r.links[1].parts = {{pad, {}}};
    world_.robots.push_back({"gantry", make(bench.document, "gantry", r), at({0, 0, 0.3}), {0, 0}});
  }
  WorldId world() {
    if (id_.number == 0) id_ = make(bench.document, "cell", world_);
    return id_;
  }
  Result<recording::RecordingPtr> simulate(PhysicsRun run) {
    run.world = world();
    const auto snapshot = bench.document.now();
    const sim::Simulator simulator{bench.registry, bench.derived, *snapshot};
    return sim::simulate_physics(simulator, run, progress);
  }
  static double last(const recording::Recording& r, const std::string& column) {
    const auto* c = r.find(column);
    EXPECT_NE(c, nullptr) << column;
    return c ? c->values.back() : std::numeric_limits<double>::quiet_NaN();
  }
  static PhysicsAction move(std::vector<double> q, double duration) {
    PhysicsAction a;
    a.q = std::move(q);
    a.duration = duration;
    return a;
  }
  static PhysicsAction act(Action kind, double duration = 0) {
    PhysicsAction a;
    a.kind = kind;
    a.duration = duration;
    return a;
  }
  /// Down to the box, 0.2 mm into it; up, across, down, away.
  static PhysicsRun carry(RobotDrive drive) {
    PhysicsRun run;
    run.robots = {{"gantry", drive, {}, {}, {}}};
    run.step = 2e-3;
    run.actions = {move({0, -0.2002}, 0.4),   act(Action::wait, 0.1), act(Action::grasp),
                   move({0, -0.1}, 0.4),      move({0.3, -0.1}, 0.6), move({0.3, -0.2}, 0.4),
                   act(Action::release, 0.1), move({0.3, 0}, 0.3),    act(Action::wait, 0.5)};
    return run;
  }

  Workbench bench;
  NoProgress progress;
  model::World world_;
  SolidId box_;

 private:
  WorldId id_;
};

TEST_F(Physics, AStackComesToRestAndWeighsWhatItShould) {
  for (int i = 0; i < 3; ++i)
    world_.objects.push_back({"box" + std::to_string(i + 1), box_, at({0, 0, 0.01 + 0.11 * i})});
  PhysicsRun run;
  run.duration = 1.5;
  const auto r = unwrap(simulate(run));
  ASSERT_TRUE(r);
  EXPECT_EQ(r->rows(), 151U);
  EXPECT_EQ(r->find("floor.x"), nullptr) << "what has no mass stands still";
  for (int i = 0; i < 3; ++i) {
    const std::string name = "box" + std::to_string(i + 1);
    EXPECT_NEAR(last(*r, name + ".z"), 0.1 * i, 5e-4);
    EXPECT_NEAR(std::hypot(last(*r, name + ".x"), last(*r, name + ".y")), 0, 5e-4);
    EXPECT_GT(std::fabs(last(*r, name + ".qw")), 1 - 1e-6);
    const auto& z = r->find(name + ".z")->values;
    EXPECT_NEAR(z.back(), z[z.size() - 20], 1e-6) << "at rest";
    // The forces on it carry its own weight.
    EXPECT_NEAR(last(*r, name + ".contact_force"), kBoxMass * kFall, 0.02 * kBoxMass * kFall);
  }
}

TEST_F(Physics, ASlidingBoxStopsWhereCoulombFrictionSays) {
  world_.objects.push_back({"box", box_, at({-0.5, 0, 0})});
  PhysicsRun run;
  run.duration = 0.6;
  run.friction = 0.4;
  sim::PhysicsObjectSettings s;
  s.name = "box";
  s.velocity = {1, 0, 0};
  run.objects = {s};
  const auto r = unwrap(simulate(run));
  ASSERT_TRUE(r);
  const double way = 1 / (2 * 0.4 * kFall);
  EXPECT_NEAR(last(*r, "box.x") + 0.5, way, 0.02 * way);
  // The geometric mean counts: one body without friction slides on.
  run.objects[0].friction = 0;
  EXPECT_NEAR(last(*unwrap(simulate(run)), "box.x") + 0.5, 0.6, 1e-3);
}

TEST_F(Physics, AFallFollowsTheSumOfTheStepsAndFixedOnesStay) {
  world_.objects.push_back({"box", box_, at({0, 0, 1})});
  world_.objects.push_back({"hung", box_, at({1, 0, 1})});
  PhysicsRun run;
  run.duration = 0.2;
  sim::PhysicsObjectSettings hung;
  hung.name = "hung";
  hung.is_fixed = true;
  run.objects = {hung};
  const auto r = unwrap(simulate(run));
  ASSERT_TRUE(r);
  // Velocity first, then position: g h^2 n (n + 1) / 2 after n steps of h.
  EXPECT_NEAR(last(*r, "box.z"), 1 - kFall * 1e-6 * 200 * 201 / 2, 1e-9);
  EXPECT_EQ(r->find("hung.z"), nullptr);
}

TEST_F(Physics, AMovedGantryCarriesABoxWithinAMillimetre) {
  add_gantry();
  world_.objects.push_back({"box", box_, at({0, 0, 0})});
  const auto r = unwrap(simulate(carry(RobotDrive::moved)));
  ASSERT_TRUE(r);
  EXPECT_EQ(r->robot, "gantry");
  EXPECT_NEAR(last(*r, "q1"), 0.3, 1e-12);
  EXPECT_NEAR(last(*r, "q2"), 0, 1e-12);
  EXPECT_NEAR(last(*r, "box.x"), 0.3, 1e-3);
  EXPECT_NEAR(last(*r, "box.y"), 0, 1e-3);
  EXPECT_NEAR(last(*r, "box.z"), 0, 1e-3);
  EXPECT_GT(std::fabs(last(*r, "box.qw")), 1 - 1e-5);
  // Half way it hangs in the air.
  const auto& z = r->find("box.z")->values;
  EXPECT_NEAR(z[120], 0.1, 2e-3);
}

TEST_F(Physics, AControlledGantryCarriesItTooAndEqualRunsGiveEqualBits) {
  add_gantry();
  world_.objects.push_back({"box", box_, at({0, 0, 0})});
  const auto run = carry(RobotDrive::controlled);
  const auto r = unwrap(simulate(run)), again = unwrap(simulate(run));
  ASSERT_TRUE(r && again);
  EXPECT_NEAR(last(*r, "box.x"), 0.3, 2e-3);
  EXPECT_NEAR(last(*r, "box.z"), 0, 1e-3);
  // The hand's motor carries the hand at rest.
  EXPECT_NEAR(last(*r, "tau2"), 20 * kFall, 0.05 * 20 * kFall);
  ASSERT_EQ(r->columns.size(), again->columns.size());
  for (std::size_t c = 0; c < r->columns.size(); ++c)
    EXPECT_EQ(r->columns[c].values, again->columns[c].values) << r->columns[c].name;
}

TEST_F(Physics, ALimpGantryFallsOntoItsStop) {
  add_gantry();
  world_.objects.clear();
  PhysicsRun run;
  run.duration = 1;
  run.robots = {{"gantry", RobotDrive::limp, {}, {}, {}}};
  const auto r = unwrap(simulate(run));
  ASSERT_TRUE(r);
  const auto& q = r->find("q2")->values;
  EXPECT_NEAR(q[20], -0.5 * kFall * 0.2 * 0.2, 1.1e-3);
  EXPECT_NEAR(q.back(), -1, 2e-3);
}

TEST_F(Physics, APendulumSwingsAndCountsItsTurns) {
  // Half a kilogram at 0.4 m, without inertia of its own: the engine needs some, and says so.
  model::Link l;
  l.name = "rod";
  l.origin = model::Placement{};
  l.axis = {0, 1, 0};
  l.given = MassProperties{0.5, {0, 0, -0.4}, {}};
  model::Robot r;
  r.links = {l};
  world_.objects.clear();
  const double start = 2 * std::acos(-1.0) + 0.1;
  world_.robots.push_back({"pendulum", make(bench.document, "pendulum", r), {}, {start}});
  PhysicsRun run;
  run.duration = 1;
  run.sample_time = 1e-3;
  run.robots = {{"pendulum", RobotDrive::limp, {}, {}, {}}};
  const auto done = unwrap(simulate(run));
  ASSERT_TRUE(done);
  const auto& q = done->find("q1")->values;
  EXPECT_NEAR(q.front(), start, 1e-12);
  // It is lowest after a quarter of 2 pi sqrt(l / g) (1 + a^2 / 16).
  const double quarter = std::acos(-1.0) / 2 * std::sqrt(0.4 / kFall) * (1 + 0.1 * 0.1 / 16);
  std::size_t i = 0;
  while (i < q.size() && q[i] > start - 0.1) ++i;
  EXPECT_NEAR(1e-3 * static_cast<double>(i), quarter, 2.5e-3);
  ASSERT_FALSE(done->notes.empty());
  EXPECT_NE(done->notes[0].find("pendulum.rod has no mass or no inertia"), std::string::npos)
      << done->notes[0];
}

TEST_F(Physics, AnEllipsoidRestsOnItsShortestAxisAndTheRunSaysHowItTouches) {
  model::Solid egg;
  model::Material stone;
  stone.density = 2000;
  egg.material = make(bench.document, "stone", stone);
  model::SolidNode n;
  n.kind = CsgKind::ellipsoid;
  n.name = "shell";
  n.sizes = {0.05, 0.04, 0.03};
  egg.nodes = {n};
  world_.objects.push_back({"egg", make(bench.document, "egg", egg), at({0, 0, 0.032})});
  PhysicsRun run;
  run.actions = {act(Action::wait, 1)};
  const auto r = unwrap(simulate(run));
  // On a polyhedron of its own, whose lowest faces lie 0.5 % of the longest half axis off at most.
  EXPECT_NEAR(last(*r, "egg.z"), 0.03, 0.0005);
  EXPECT_NE(std::find_if(r->notes.begin(), r->notes.end(),
                         [](const std::string& note) {
                           return note.find("1 ellipsoid collides as a polyhedron") !=
                                  std::string::npos;
                         }),
            r->notes.end());
}

/// A note that holds a text.
bool has_note(const recording::Recording& r, const std::string& part) {
  return std::any_of(r.notes.begin(), r.notes.end(),
                     [&](const std::string& note) { return note.find(part) != std::string::npos; });
}

TEST_F(Physics, OverlapAtTheStartIsSaidAndGivesNoSpeed) {
  world_.objects.push_back({"sunk", box_, at({0, 0, -0.03})});
  world_.objects.push_back({"beside", box_, at({1, 0, 0})});
  PhysicsRun run;
  run.duration = 0.3;
  run.sample_time = 1e-3;
  const auto r = unwrap(simulate(run));
  ASSERT_TRUE(r);
  EXPECT_TRUE(has_note(*r, "object \"floor\" and object \"sunk\" overlap by 30 mm at the start"));
  EXPECT_FALSE(has_note(*r, "beside"));
  const auto& z = r->find("sunk.z")->values;
  EXPECT_NEAR(z.back(), 0, 1e-4);
  EXPECT_LT(*std::max_element(z.begin(), z.end()), 1e-5) << "it does not jump";
}

TEST_F(Physics, WhatPassesThroughAnotherIsNamed) {
  world_.objects.push_back({"wall", add_box("wall", {0.05, 1, 1}, {}), at({0, 0, 0.5})});
  world_.objects.push_back({"shot", box_, at({-0.5, 0, 1})});
  PhysicsRun run;
  run.duration = 0.01;
  run.sample_time = 1e-3;
  sim::PhysicsObjectSettings s;
  s.name = "shot";
  s.velocity = {200, 0, 0};
  run.objects = {s};
  const auto r = unwrap(simulate(run));
  ASSERT_TRUE(r);
  EXPECT_TRUE(
      has_note(*r, "object \"wall\" and object \"shot\" passed through each other within a step"));
  run.step = 2e-4;
  EXPECT_FALSE(has_note(*unwrap(simulate(run)), "passed through"));
}

TEST_F(Physics, RoundSolidsWithBoresRollAsRoundOnes) {
  // Of a mass that does not matter: what rolls without slipping keeps its speed, 1 m/s for 2 s.
  model::Material steel;
  steel.density = 7800;
  const MaterialId material = make(bench.document, "steel", steel);
  const auto node = [](CsgKind kind, std::int32_t parent, std::array<double, 6> sizes, Vec3 shift) {
    model::SolidNode n;
    n.kind = kind;
    n.parent = parent;
    n.name = "n" + std::to_string(static_cast<int>(kind)) + (shift[2] < 0 ? "tool" : "");
    n.sizes = sizes;
    n.placement = at(shift);
    return n;
  };
  const auto solid = [&](const char* name, std::vector<model::SolidNode> nodes) {
    model::Solid s;
    s.material = material;
    s.nodes = std::move(nodes);
    return make(bench.document, name, s);
  };
  const double R = 0.1;
  const AnyId disc = solid(
      "disc", {node(CsgKind::difference, -1, {}, {}), node(CsgKind::cylinder, 0, {R, 0.04, 0}, {}),
               node(CsgKind::cylinder, 0, {0.05, 0.06, 0}, {0, 0, -0.01})});
  const AnyId ball =
      solid("ball", {node(CsgKind::difference, -1, {}, {}), node(CsgKind::sphere, 0, {R}, {}),
                     node(CsgKind::cylinder, 0, {0.03, 0.3, 0}, {0, 0, -0.15})});
  const AnyId rounded = solid("rounded", {node(CsgKind::cylinder, -1, {R, 0.04, 0.005}, {})});
  double y = -1;
  PhysicsRun run;
  run.duration = 2;
  for (const auto& [name, what] : {std::pair{"disc", disc}, {"ball", ball}, {"rounded", rounded}}) {
    model::Placement lying = at({-1, y, R});
    lying.angles = {std::acos(-1.0) / 2, 0, 0};
    world_.objects.push_back({name, what, lying});
    y += 0.7;
    sim::PhysicsObjectSettings s;
    s.name = name;
    s.velocity = {1, 0, 0};
    s.angular_velocity = {0, 1 / R, 0};
    run.objects.push_back(s);
  }
  const auto r = unwrap(simulate(run));
  ASSERT_TRUE(r);
  for (const char* name : {"disc", "ball", "rounded"})
    EXPECT_NEAR(last(*r, std::string(name) + ".x"), 1, 1e-3) << name;
}

TEST_F(Physics, TellsWhatIsWrong) {
  add_gantry();
  world_.objects.push_back({"box", box_, at({0, 0, 0})});
  const auto told = [&](const std::function<void(PhysicsRun&)>& change) {
    PhysicsRun run = carry(RobotDrive::moved);
    change(run);
    const auto r = simulate(run);
    return r.ok() ? std::string("done") : r.error().sentence();
  };
  const auto has = [](const std::string& text, const char* part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  has(told([](PhysicsRun& r) {
        r.objects = {{"bux", false, {}, {}, {}, {}}};
      }),
      "the world has no object \"bux\"");
  has(told([](PhysicsRun& r) { r.robots[0].name = "gentry"; }), "the world has no robot");
  has(told([](PhysicsRun& r) { r.friction = -1; }), "friction");
  has(told([](PhysicsRun& r) { r.actions.clear(); }), "no duration of the simulation");
  has(told([](PhysicsRun& r) { r.step = 0; }), "the step is not a positive time");
  has(told([](PhysicsRun& r) { r.actions[0].q = {0}; }), "q has 1 numbers, but 2 are needed");
  has(told([](PhysicsRun& r) { r.actions[0].duration = 0; }), "the move has no duration");
  has(told([](PhysicsRun& r) { r.actions[3].time = 0.1; }), "before robot \"gantry\" has ended");
  has(told([](PhysicsRun& r) { r.actions[0].q = {0, -0.1}; }), "touches no object that can move");
  has(told([](PhysicsRun& r) { r.actions[2].object = "floor"; }), "cannot move");
  has(told([](PhysicsRun& r) { r.actions[2].tool = "claw"; }), "has no tool");
  has(told([](PhysicsRun& r) { r.actions[2].kind = Action::wait; }), "does not hold");
  has(told([](PhysicsRun& r) { r.robots[0].drive = RobotDrive::limp; }), "is not driven");
  has(told([](PhysicsRun& r) { r.engine.name = "none"; }), "none");
}

TEST_F(Physics, StopsWhenCancelled) {
  struct Stop final : Progress {
    void report(double, std::string_view) override {}
    [[nodiscard]] bool cancelled() const override { return true; }
  } stop;
  world_.objects.push_back({"box", box_, at({0, 0, 0})});
  PhysicsRun run;
  run.world = world();
  run.duration = 1;
  const auto snapshot = bench.document.now();
  // What is derived is made before, so that the run itself is what stops.
  EXPECT_TRUE(
      sim::simulate_physics({bench.registry, bench.derived, *snapshot}, run, progress).ok());
  const auto r = sim::simulate_physics({bench.registry, bench.derived, *snapshot}, run, stop);
  ASSERT_FALSE(r.ok());
  EXPECT_EQ(r.error().code, ErrorCode::cancelled);
}

TEST(PhysicsPairs, BallsTouchWhereTheirCentresAreCloserThanTheirRadiiWhereverTheyHaveFlown) {
  const Workbench bench;
  NoProgress progress;
  const auto engine = unwrap(bench.registry.create<PhysicsEngine>("ode"));
  const auto info = unwrap(bench.registry.find(PhysicsEngine::kInterfaceId, "ode"));
  const auto params = unwrap(motion::checked_params(info, {"ode", {}}, "ode"));
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(-1, 1);
  const std::size_t count = 400;
  std::vector<PhysicsBody> bodies(count);
  std::vector<double> radii(count);
  for (std::size_t i = 0; i < count; ++i) {
    Shape ball;
    ball.kind = ShapeKind::sphere;
    radii[i] = i == 0 ? 3 : 0.05 + 0.04 * unit(random);
    ball.sizes = {radii[i], 0, 0};
    bodies[i].shape.shapes.push_back(ball);
    bodies[i].pose.p = {unit(random), unit(random), unit(random)};
    // The first is large, and far away until it is placed among the others; some stand still.
    if (i == 0) bodies[i].pose.p = {100, 0, 0};
    if (i == 0 || i % 5 == 1) continue;
    const double moment = 0.4 * radii[i] * radii[i];
    bodies[i].mass = {1, {}, {moment, moment, moment, 0, 0, 0}};
    bodies[i].velocity = {4 * unit(random), 4 * unit(random), 4 * unit(random)};
  }
  const auto world = unwrap(engine->create(bodies, {}, {}, *params));
  ASSERT_TRUE(world);
  std::vector<Pose> poses(count);
  std::vector<PhysicsContact> contacts;
  std::size_t touched = 0;
  for (int step = 0; step < 40; ++step) {
    if (step == 20) {
      ASSERT_TRUE(world->move(0, spatial::translation({3.2, 0, 0}), {}, {}).ok());
    }
    PhysicsState state;
    state.poses = poses;
    ASSERT_TRUE(world->read(state).ok());
    std::set<std::pair<std::int32_t, std::int32_t>> expected, found;
    const auto stands = [](std::size_t i) { return i == 0 || i % 5 == 1; };
    for (std::size_t a = 0; a < count; ++a)
      for (std::size_t b = a + 1; b < count; ++b)
        if (!(stands(a) && stands(b)) &&
            spatial::norm(spatial::sub(poses[a].p, poses[b].p)) < radii[a] + radii[b])
          expected.emplace(static_cast<std::int32_t>(a), static_cast<std::int32_t>(b));
    ASSERT_TRUE(world->step(0.02, 1, {}, progress).ok());
    world->contacts(contacts);
    for (const PhysicsContact& c : contacts) found.emplace(c.a, c.b);
    EXPECT_EQ(found, expected) << "step " << step;
    touched += found.size();
  }
  EXPECT_GT(touched, 500U);
}

}  // namespace
}  // namespace robomosp
