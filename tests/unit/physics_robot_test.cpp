// SPDX-License-Identifier: Apache-2.0
// Robots that the physics engine moves: swings against the equations of motion (articulated bodies,
// closed loops), grips that hold by friction alone against mu N >= m (g + a) / 2, self-contact.
#include <cmath>
#include <functional>
#include <numbers>

#include <gtest/gtest.h>

#include "sim/forward_simulation.h"
#include "sim/physics.h"
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
using ActionKind = PhysicsAction::Kind;

constexpr double kFreeFall = 9.81;

model::Placement placed_at(Vec3 p) {
  model::Placement out;
  out.position = p;
  return out;
}
double last(const recording::Recording& r, const std::string& column) {
  const auto* c = r.find(column);
  EXPECT_NE(c, nullptr) << column;
  return c ? c->values.back() : std::nan("");
}
/// Greatest difference of the columns `stem`1, `stem`2, ...
double difference(const recording::Recording& a, const recording::Recording& b,
                  const std::string& stem) {
  double most = 0;
  for (std::size_t i = 1; a.find(stem + std::to_string(i)); ++i) {
    const auto& x = a.find(stem + std::to_string(i))->values;
    const auto* y = b.find(stem + std::to_string(i));
    if (!y || y->values.size() != x.size()) return std::nan("");
    for (std::size_t k = 0; k < x.size(); ++k)
      most = std::max(most, std::fabs(x[k] - y->values[k]));
  }
  return most;
}

class PhysicsRobot : public testing::Test {
 protected:
  Result<recording::RecordingPtr> simulate(PhysicsRun run, WorldId world) {
    run.world = world;
    const auto snapshot = bench.document.now();
    return sim::simulate_physics({bench.registry, bench.derived, *snapshot}, run, progress);
  }
  /// The same free motion by the equations of motion and the variable-step integrator.
  Result<recording::RecordingPtr> integrate(WorldId world, const std::string& robot,
                                            const PhysicsRun& run) {
    sim::ForwardRun f;
    f.world = world;
    f.robot = robot;
    f.duration = run.duration;
    f.sample_time = run.sample_time;
    const auto snapshot = bench.document.now();
    return sim::forward_dynamics({bench.registry, bench.derived, *snapshot}, f, progress);
  }
  static PhysicsRun limp(const std::string& robot, double duration, double step = 1e-4) {
    PhysicsRun run;
    run.robots = {{robot, RobotDrive::limp, {}, {}, {}, false}};
    run.duration = duration, run.step = step, run.sample_time = 0.05;
    return run;
  }
  /// A robot of the library alone, where it stands by `q`.
  WorldId alone(const std::string& robot, std::vector<double> q) {
    const AnyId id = bench.load("robots/" + robot + ".rbt");
    model::World w;
    w.robots.push_back({robot, RobotId{id.number}, placed_at({0, 0, 1}), std::move(q)});
    return make(bench.document, "world_of_" + robot, w);
  }

  template <class R>
  void edit(AnyId id, const std::function<void(R&)>& change) {
    auto tx = bench.document.begin("edit");
    ASSERT_TRUE(tx.ok());
    const auto edited = tx->edit(id, [&](document::Record& r) -> Result<void> {
      change(std::get<R>(r.body));
      return {};
    });
    ASSERT_TRUE(edited.ok()) << edited.error().sentence();
    ASSERT_TRUE(tx->commit().ok());
  }

  Workbench bench;
  NoProgress progress;
};

// ---- swings ----

TEST_F(PhysicsRobot, APumaWithItsMotorsInertiasSwingsAsTheEquationsOfMotionSay) {
  // Its motors' inertias are up to thousands of times a link's own about the joint's axis.
  const WorldId world = alone("puma560", {0.3, -0.4, 0.2, 0.5, -0.6, 0.4});
  const PhysicsRun coarse = limp("puma560", 0.3, 1e-3), fine = limp("puma560", 0.3, 2.5e-4);
  const auto exact = unwrap(integrate(world, "puma560", coarse));
  const auto a = unwrap(simulate(coarse, world)), b = unwrap(simulate(fine, world));
  ASSERT_TRUE(exact && a && b);
  const double moved = std::fabs(last(*exact, "q2") + 0.4);
  EXPECT_GT(moved, 0.1);
  EXPECT_LT(difference(*a, *exact, "q"), 0.01 * moved);
  EXPECT_LT(difference(*b, *exact, "q"), 0.35 * difference(*a, *exact, "q")) << "first order";
}

TEST_F(PhysicsRobot, AFourBarLinkageSwingsClosed) {
  const WorldId world = alone("four_bar", {1, -0.4892203623696061, 1.7181605870968062});
  const PhysicsRun run = limp("four_bar", 0.4, 5e-4);
  const auto exact = unwrap(integrate(world, "four_bar", run)), done = unwrap(simulate(run, world));
  ASSERT_TRUE(exact && done);
  EXPECT_GT(std::fabs(last(*exact, "q1") - 1), 0.2);
  EXPECT_LT(difference(*done, *exact, "q"), 5e-3);
}

TEST_F(PhysicsRobot, ADeltaRobotOfCoupledRodsFallsAsTheEquationsOfMotionSay) {
  const WorldId world = alone("delta", {});
  const PhysicsRun run = limp("delta", 0.1, 1e-3);
  const auto exact = unwrap(integrate(world, "delta", run)), done = unwrap(simulate(run, world));
  ASSERT_TRUE(exact && done);
  EXPECT_GT(std::fabs(last(*exact, "q1") - exact->find("q1")->values[0]), 0.02);
  EXPECT_LT(difference(*done, *exact, "q"), 1.5e-3) << "1e-3 here, first order in the step";
}

TEST_F(PhysicsRobot, ASatelliteTurnsAgainstItsArm) {
  const AnyId id = bench.load("worlds/satellite_arm.wld");
  PhysicsRun run;
  run.robots = {{"satellite_arm", RobotDrive::controlled, {}, {}, {}, false}};
  run.duration = 0.2;
  const auto done = simulate(run, WorldId{id.number});
  ASSERT_TRUE(done.ok()) << done.error().sentence();
  double length = 0;
  for (int k = 4; k <= 7; ++k) length += std::pow(last(**done, "q" + std::to_string(k)), 2);
  EXPECT_NEAR(length, 1, 1e-9) << "a unit quaternion";
}

TEST_F(PhysicsRobot, APendulumKeepsItsEnergy) {
  model::Link l;
  l.name = "rod";
  l.origin = model::Placement{};
  l.axis = {0, 1, 0};
  l.given = MassProperties{0.5, {0, 0, -0.4}, {0.01, 0.01, 0.01, 0, 0, 0}};
  model::Robot r;
  r.links = {l};
  model::World w;
  w.robots.push_back({"pendulum", make(bench.document, "pendulum", r), {}, {1.2}});
  const WorldId world = make(bench.document, "swing", w);
  PhysicsRun run = limp("pendulum", 3, 2e-4);
  run.sample_time = 0.01;
  const auto done = unwrap(simulate(run, world));
  ASSERT_TRUE(done);
  const auto &q = done->find("q1")->values, &qd = done->find("qd1")->values;
  const double inertia = 0.01 + 0.5 * 0.16, lift = 0.5 * kFreeFall * 0.4;
  double least = 1e9, most = -1e9;
  for (std::size_t i = 0; i < q.size(); ++i) {
    const double energy = 0.5 * inertia * qd[i] * qd[i] + lift * (1 - std::cos(q[i]));
    least = std::min(least, energy), most = std::max(most, energy);
  }
  EXPECT_LT(most - least, 0.01 * lift * (1 - std::cos(1.2))) << "in 2 swings";
}

// ---- what controllers do with loops and followers ----

TEST_F(PhysicsRobot, AControlledDeltaFollowsItsMotionThroughItsLoops) {
  const WorldId world = alone("delta", {});
  PhysicsRun run;
  run.robots = {{"delta", RobotDrive::controlled, {}, {}, {}, false}};
  run.step = 2e-3;
  PhysicsAction a;
  a.duration = 0.3;
  const auto start = unwrap(simulate(limp("delta", 1e-3, 1e-3), world));
  ASSERT_TRUE(start);
  for (std::size_t i = 1; i <= start->dof; ++i)
    a.q.push_back(start->find("q" + std::to_string(i))->values[0]);
  // Arms two and three stand where their joints are named in the file.
  a.q[0] += 0.2;
  run.actions = {a};
  const auto done = simulate(run, world);
  ASSERT_TRUE(done.ok()) << done.error().sentence();
  EXPECT_NEAR(last(**done, "q1"), a.q[0], 2e-3);
}

TEST_F(PhysicsRobot, AMovedFourBarStaysClosedBetweenItsPoses) {
  const WorldId world = alone("four_bar", {1, -0.4892203623696061, 1.7181605870968062});
  PhysicsRun run;
  PhysicsAction a;
  a.duration = 0.5;
  a.q = {2.2, -0.4892203623696061, 1.7181605870968062};  // only the crank has a motor
  run.actions = {a};
  const auto done = unwrap(simulate(run, world));
  ASSERT_TRUE(done);
  // The pin: crank and coupler meet the rocker (its own numbers, see the file).
  for (std::size_t i = 0; i < done->rows(); i += 10) {
    const double q1 = done->find("q1")->values[i], q2 = done->find("q2")->values[i],
                 q3 = done->find("q3")->values[i];
    EXPECT_NEAR(0.12 * std::cos(q1) + 0.36 * std::cos(q1 + q2), 0.42 + 0.28 * std::cos(q3), 1e-9);
    EXPECT_NEAR(0.12 * std::sin(q1) + 0.36 * std::sin(q1 + q2), 0.28 * std::sin(q3), 1e-9);
  }
  EXPECT_NEAR(last(*done, "q1"), 2.2, 1e-9);
}

// ---- grips ----

class Grip : public PhysicsRobot {
 protected:
  static constexpr double kMu = 0.5;
  static constexpr double kMass = 0.6;  ///< of the box [kg]
  static constexpr double kLift = 0.2, kTime = 0.5;
  /// Greatest acceleration of the quintic of minimum jerk: 10 / sqrt(3) of way / time^2.
  static double acceleration() { return 10 / std::sqrt(3.0) * kLift / (kTime * kTime); }

  SolidId add_box(const std::string& name, Vec3 sizes, MaterialId material) {
    model::SolidNode n;
    n.name = name;
    n.sizes = {sizes[0], sizes[1], sizes[2]};
    model::Solid s;
    s.material = material;
    s.nodes = {n};
    return make(bench.document, name, s);
  }
  /// A hand that goes up and down, with two fingers that close along x; the right one follows.
  void SetUp() override {
    model::Material m;
    m.density = kMass / (0.06 * 0.06 * 0.08);
    const auto wood = make(bench.document, "wood", m);
    const SolidId box = add_box("box", {0.06, 0.06, 0.08}, wood),
                  floor = add_box("floor", {2, 2, 0.1}, {}),
                  finger = add_box("finger", {0.01, 0.03, 0.05}, {});
    const auto link = [](const char* name, std::int32_t parent, Vec3 axis, double mass) {
      model::Link l;
      l.name = name;
      l.parent = parent;
      l.joint = model::JointKind::prismatic;
      l.origin = model::Placement{};
      l.axis = axis;
      const double i = 1e-3 * mass;
      l.given = MassProperties{mass, {}, {i, i, i, 0, 0, 0}};
      return l;
    };
    model::Robot r;
    r.links = {link("lift", -1, {0, 0, 1}, 5), link("left", 0, {-1, 0, 0}, 0.1),
               link("right", 0, {1, 0, 0}, 0.1)};
    r.links[1].parts = {{finger, placed_at({-0.005, 0, 0})}};
    r.links[2].parts = {{finger, placed_at({0.005, 0, 0})}};
    r.links[2].mimic = model::Mimic{1, 1, 0};
    coupled_ = make(bench.document, "coupled", r);
    r.links[2].mimic.reset();
    two_motors_ = make(bench.document, "two_motors", r);
    world_.objects = {{"floor", floor, placed_at({0, 0, -0.1})},
                      {"box", box, placed_at({0, 0, 0})}};
  }
  /// Closes with `force` on each finger's motor, lifts, waits.
  PhysicsRun pick(RobotDrive drive, double force, bool two = false) const {
    PhysicsRun run;
    run.step = 1e-3;
    run.friction = kMu;
    run.robots = {{"hand", drive, {}, {}, {}, false}};
    PhysicsAction grip, move, wait;
    grip.kind = ActionKind::grip;
    grip.joint = "left", grip.force = -force, grip.speed = 0.05;
    grip.duration = two ? 0 : 0.4;
    move.q = {kLift, 0.04};
    if (two) move.q.push_back(0.04);
    move.duration = kTime;
    wait.kind = ActionKind::wait, wait.duration = 0.3;
    run.actions = {grip, move, wait};
    if (two) {
      grip.joint = "right", grip.duration = 0.4;
      run.actions.insert(run.actions.begin() + 1, grip);
    }
    return run;
  }
  WorldId world(RobotId robot, std::vector<double> q) {
    model::World w = world_;
    w.robots = {{"hand", robot, placed_at({0, 0, 0.02}), std::move(q)}};
    return make(bench.document, "cell" + std::to_string(++count_), w);
  }
  double slip(const PhysicsRun& run, bool two = false) {
    const WorldId w = two ? world(two_motors_, {0, 0.04, 0.04}) : world(coupled_, {0, 0.04});
    const auto r = unwrap(simulate(run, w));
    if (!r) return std::nan("");
    return last(*r, "q1") - last(*r, "box.z");
  }
  RobotId coupled_, two_motors_;

 private:
  model::World world_;
  int count_ = 0;
};

TEST_F(Grip, FrictionHoldsABoxThroughItsLiftFromMuNOfHalfItsWeightAndInertiaOn) {
  // One motor presses with both fingers: N = F / 2 on each side. Held while 2 mu N >= m (g + a).
  const double most = kMass * (kFreeFall + acceleration()) / kMu, still = kMass * kFreeFall / kMu;
  EXPECT_NEAR(acceleration(), 4.62, 0.01);
  for (const RobotDrive drive : {RobotDrive::moved, RobotDrive::controlled}) {
    const int d = static_cast<int>(drive);
    EXPECT_LT(std::fabs(slip(pick(drive, 1.05 * most))), 1e-3) << "drive " << d;
    // Between the two it holds the weight, but slips while the hand accelerates.
    const double slipped = slip(pick(drive, 0.5 * (most + still)));
    EXPECT_GT(slipped, 2e-3) << "drive " << d;
    EXPECT_LT(slipped, 0.1) << "drive " << d;
    EXPECT_NEAR(slip(pick(drive, 0.9 * still)), kLift, 0.02) << "it stays below, drive " << d;
  }
}

TEST_F(Grip, WhatSlipsIsWhatCoulombFrictionLacks) {
  // Slip from the equation of motion: s'' = max(a - (2 mu N - m g) / m, 0 at rest), by small steps.
  const double force = 0.5 * kMass * (2 * kFreeFall + acceleration()) / kMu, h = 1e-6;
  const double grips = kMu * force / kMass - kFreeFall;  // what friction can accelerate
  double s = 0, v = 0;
  for (double t = 0; t < kTime + 0.3; t += h) {
    const double u = std::min(t / kTime, 1.0);
    const double a = kLift * u * (60 + u * (-180 + 120 * u)) / (kTime * kTime);
    v = v > 0 || a > grips ? std::max(0.0, v + h * (a - grips)) : 0;
    s += h * v;
  }
  EXPECT_GT(s, 2e-3);
  EXPECT_NEAR(slip(pick(RobotDrive::moved, force)), s, 0.05 * s + 2e-4);
}

TEST_F(Grip, TwoMotorsPressWithTheirForceEach) {
  const double most = kMass * (kFreeFall + acceleration()) / (2 * kMu);
  EXPECT_LT(std::fabs(slip(pick(RobotDrive::moved, 1.05 * most, true), true)), 1e-3);
  EXPECT_GT(slip(pick(RobotDrive::moved, 0.85 * most, true), true), 2e-3);
}

TEST_F(Grip, FollowersFollowAndReleasedBoxesFall) {
  PhysicsRun run = pick(RobotDrive::moved, 40);
  PhysicsAction release;
  release.kind = ActionKind::release;
  release.duration = 0.5;
  run.actions.push_back(release);
  const WorldId w = world(coupled_, {0, 0.04});
  const auto r = unwrap(simulate(run, w));
  ASSERT_TRUE(r);
  const auto& z = r->find("box.z")->values;
  EXPECT_NEAR(*std::max_element(z.begin(), z.end()), kLift, 1e-3);
  EXPECT_NEAR(z.back(), 0, 1e-3) << "on the floor again";
  EXPECT_NEAR(last(*r, "box.x"), 0, 1e-3) << "both fingers move alike";
  EXPECT_NEAR(r->find("q2")->values[100], 0.03, 2e-4) << "closed on the box";
  EXPECT_NEAR(last(*r, "q2"), 0.04, 1e-4) << "open again";
}

TEST_F(Grip, EqualRunsGiveEqualBitsAlsoAfterAnEditThatWasUndone) {
  const PhysicsRun run = pick(RobotDrive::controlled, 30);
  const WorldId w = world(coupled_, {0, 0.04});
  const auto first = unwrap(simulate(run, w));
  ASSERT_TRUE(first);
  const auto same = [&](const recording::Recording& r) {
    if (r.columns.size() != first->columns.size()) return false;
    for (std::size_t c = 0; c < r.columns.size(); ++c)
      if (r.columns[c].values != first->columns[c].values) return false;
    return true;
  };
  EXPECT_TRUE(same(*unwrap(simulate(run, w)))) << "twice";
  edit<model::World>(w, [](model::World& x) { x.objects[1].placement.position = {0.004, 0, 0}; });
  const auto other = unwrap(simulate(run, w));
  EXPECT_FALSE(same(*other)) << "another start is another run";
  ASSERT_TRUE(bench.document.undo().ok());
  EXPECT_TRUE(same(*unwrap(simulate(run, w)))) << "undone";
  ASSERT_TRUE(bench.document.redo().ok());
  const auto redone = unwrap(simulate(run, w));
  for (std::size_t c = 0; c < other->columns.size(); ++c)
    EXPECT_EQ(redone->columns[c].values, other->columns[c].values) << "redone";
}

TEST_F(Grip, TellsWhatIsWrong) {
  const WorldId w = world(coupled_, {0, 0.04});
  const auto told = [&](const std::function<void(PhysicsRun&)>& change) {
    PhysicsRun run = pick(RobotDrive::moved, 30);
    change(run);
    const auto r = simulate(run, w);
    return r.ok() ? std::string("done") : r.error().sentence();
  };
  const auto has = [](const std::string& text, const char* part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  has(told([](PhysicsRun& r) { r.actions[0].joint = "lefd"; }),
      "robot \"hand\" has no joint \"lefd\"");
  has(told([](PhysicsRun& r) { r.actions[0].joint = "right"; }), "follows \"left\"");
  has(told([](PhysicsRun& r) { r.actions[0].force = 0; }), "a force of 0");
  has(told([](PhysicsRun& r) { r.actions[0].speed = -1; }), "speed");
  has(told([](PhysicsRun& r) { r.robots[0].drive = RobotDrive::limp; }), "is not driven");
  has(told([](PhysicsRun& r) {
        r.actions[0].kind = ActionKind::release;
        r.actions.pop_back();
      }),
      "does not hold anything");
}

// ---- self-contact ----

TEST_F(PhysicsRobot, LinksTouchEachOtherWhereThatIsAskedForAndNoRuleAllowsIt) {
  // An upper arm, a forearm and a hand that folds back onto the upper arm by its weight.
  model::Material m;
  m.density = 1000;
  const auto plastic = make(bench.document, "plastic", m);
  model::SolidNode n;
  n.name = "bar";
  n.sizes = {0.3, 0.04, 0.04};
  model::Solid s;
  s.material = plastic;
  s.nodes = {n};
  const SolidId bar = make(bench.document, "bar", s);
  const auto link = [&](const char* name, std::int32_t parent, double x, double lower,
                        double upper) {
    model::Link l;
    l.name = name;
    l.parent = parent;
    l.origin = placed_at({x, 0, 0});
    l.axis = {0, -1, 0};  // turning up
    l.lower = lower, l.upper = upper;
    l.given = MassProperties{0.5, {0.15, 0, 0}, {1e-4, 4e-3, 4e-3, 0, 0, 0}};
    l.parts = {{bar, placed_at({0.15, 0, -0.02})}};
    return l;
  };
  model::Robot r;
  // Its middle part stands upright, so that the hand's joint is above the upper arm.
  const double right = 0.5 * std::numbers::pi;
  r.links = {link("upper", -1, 0, -0.01, 0.01), link("middle", 0, 0.35, right - 0.01, right + 0.01),
             link("hand", 1, 0.1, -4, 4)};
  model::SolidNode small = n;
  small.sizes = {0.02, 0.02, 0.02};
  s.nodes = {small};
  r.links[1].parts = {{make(bench.document, "joint", s), placed_at({0.05, 0, 0})}};
  model::World w;
  // The hand points back and stands above the upper arm.
  w.robots.push_back(
      {"arm", make(bench.document, "arm", r), placed_at({0, 0, 1}), {0, right, 0.8 * right}});
  const WorldId world = make(bench.document, "fold", w);
  PhysicsRun run = limp("arm", 1, 1e-3);
  const auto through = unwrap(simulate(run, world));
  run.robots[0].self_contact = true;
  const auto stopped = unwrap(simulate(run, world));
  ASSERT_TRUE(through && stopped);
  EXPECT_EQ(last(*through, "contacts"), 0);
  const auto& touches = stopped->find("contacts")->values;
  EXPECT_GT(*std::max_element(touches.begin(), touches.end()), 0);
  EXPECT_GT(difference(*through, *stopped, "q"), 0.1);
  // A rule that allows the pair to touch takes the contact away.
  edit<model::Robot>(w.robots[0].robot, [](model::Robot& x) {
    x.pair_rules = {{"upper", "hand", true, "test"}};
  });
  const auto again = unwrap(simulate(run, world));
  ASSERT_TRUE(again);
  EXPECT_LT(difference(*through, *again, "q"), 1e-12);
}

}  // namespace
}  // namespace robomosp
