// SPDX-License-Identifier: Apache-2.0
// Conformance suite of robomosp.physics/1: free motion and joints against closed forms, contact
// against the laws that it models (layer: contract helper for tests, header-only).
#pragma once

#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <robomosp/sdk/conformance/models.h>
#include <robomosp/sdk/conformance/provider.h>
#include <robomosp/sdk/conformance/threads.h>
#include <robomosp/sdk/physics.h>

namespace robomosp::conformance {

struct PhysicsCase {
  std::string file, provider;
  std::vector<std::pair<std::string, std::string>> params;
  std::string name;
};
inline void PrintTo(const PhysicsCase& c, std::ostream* os) {
  *os << c.provider;
  if (c.name != c.provider) *os << " " << c.name;
}
inline std::string physics_case_name(const testing::TestParamInfo<PhysicsCase>& info) {
  return info.param.name;
}

/// A uniform box of a mass [kg] and side lengths [m], centred in its frame.
[[nodiscard]] inline PhysicsBody box_body(double mass, const Vec3& s, const Pose& pose) {
  PhysicsBody b;
  b.shape.shapes = {{ShapeKind::box, s, nullptr, {}}};
  b.mass = {mass,
            {},
            {mass * (s[1] * s[1] + s[2] * s[2]) / 12, mass * (s[0] * s[0] + s[2] * s[2]) / 12,
             mass * (s[0] * s[0] + s[1] * s[1]) / 12, 0, 0, 0}};
  b.pose = pose;
  return b;
}
/// An immovable slab with its upper side at z = 0.
[[nodiscard]] inline PhysicsBody floor_body() {
  PhysicsBody b = box_body(0, {20, 20, 1}, shift(0, 0, -0.5));
  b.mass = {};
  return b;
}

class PhysicsConformance : public testing::TestWithParam<PhysicsCase> {
 protected:
  void SetUp() override {
    auto found = find_provider<PhysicsEngine>(GetParam().file, GetParam().provider);
    ASSERT_TRUE(found.ok()) << found.error().sentence();
    provider_ = *found;
    engine_ = create<PhysicsEngine>(**found);
    ASSERT_NE(engine_, nullptr);
  }
  Result<std::unique_ptr<PhysicsWorld>> make(const std::vector<PhysicsBody>& bodies,
                                             const std::vector<PhysicsJoint>& joints = {},
                                             Vec3 gravity = {0, 0, -9.81}) {
    TableParams params(*provider_);
    for (const auto& [name, text] : GetParam().params) params.set(name, text);
    return engine_->create(bodies, joints, gravity, params);
  }
  struct State {
    std::vector<Pose> poses;
    std::vector<Vec3> velocities, angular_velocities;
    std::vector<double> q, qd;
  };
  static State read(const PhysicsWorld& world, std::size_t bodies, std::size_t joints = 0) {
    State s;
    s.poses.resize(bodies), s.velocities.resize(bodies), s.angular_velocities.resize(bodies);
    s.q.resize(joints), s.qd.resize(joints);
    EXPECT_TRUE(
        world.read({sizeof(PhysicsState), s.poses, s.velocities, s.angular_velocities, s.q, s.qd})
            .ok());
    return s;
  }
  static void run(PhysicsWorld& world, double dt, int steps,
                  const std::vector<double>& forces = {}) {
    NoProgress none;
    const auto done = world.step(dt, steps, forces, none);
    ASSERT_TRUE(done.ok()) << done.error().sentence();
  }
  /// What a simple engine says of what it need not have.
  template <class T>
  static bool is_left_out(const Result<T>& r) {
    return !r.ok() && r.error().code == ErrorCode::unsupported;
  }
  const rmp_provider* provider_ = nullptr;
  std::unique_ptr<PhysicsEngine> engine_;
};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(PhysicsConformance);

TEST_P(PhysicsConformance, AFreeBodyFallsAsAParabola) {
  // The centre of mass is off the frame's origin, so that the frame turns about it.
  PhysicsBody b = box_body(2, {0.1, 0.2, 0.3}, multiply(shift(1, 2, 3), turn_x(0.4)));
  b.mass.com = {0.05, -0.02, 0.1};
  b.shape = {};
  b.velocity = {0.5, 0, 1};
  auto world = make({b});
  ASSERT_TRUE(world.ok()) << world.error().sentence();
  const double dt = 1e-4;
  run(**world, dt, 5000);
  const State s = read(**world, 1);
  const double t = 0.5;
  EXPECT_NEAR(s.poses[0].p[0], 1 + 0.5 * t, 1e-9);
  EXPECT_NEAR(s.poses[0].p[1], 2, 1e-9);
  EXPECT_NEAR(s.poses[0].p[2], 3 + t - 9.81 * t * t / 2, 9.81 * t * dt)
      << "first order in the step";
  EXPECT_NEAR(s.velocities[0][2], 1 - 9.81 * t, 1e-9);
  EXPECT_LT(rotation_gap(s.poses[0], b.pose), 1e-12);
}

TEST_P(PhysicsConformance, AFreeBodyThatTurnsKeepsItsMomentum) {
  PhysicsBody b = box_body(3, {0.1, 0.2, 0.4}, Pose{});
  b.shape = {};
  b.angular_velocity = {1, 2, -1.5};
  auto world = make({b}, {}, {0, 0, 0});
  ASSERT_TRUE(world.ok()) << world.error().sentence();
  const auto momentum = [&](const State& s) {
    const auto& R = s.poses[0].R;
    const Vec3& w = s.angular_velocities[0];
    const double I[3] = {b.mass.inertia.xx, b.mass.inertia.yy, b.mass.inertia.zz};
    Vec3 h{};
    for (std::size_t k = 0; k < 3; ++k) {
      const double own = I[k] * (R[k] * w[0] + R[3 + k] * w[1] + R[6 + k] * w[2]);
      for (std::size_t r = 0; r < 3; ++r) h[r] += R[3 * r + k] * own;
    }
    return h;
  };
  const Vec3 before = momentum(read(**world, 1));
  run(**world, 5e-4, 2000);
  const Vec3 after = momentum(read(**world, 1));
  for (std::size_t k = 0; k < 3; ++k)
    EXPECT_NEAR(after[k], before[k], 0.01 * std::hypot(before[0], before[1], before[2]));
}

TEST_P(PhysicsConformance, ABoxRestsOnTheFloorWithItsWeight) {
  auto world = make({floor_body(), box_body(5, {0.2, 0.3, 0.1}, shift(0.1, 0.2, 0.05))});
  ASSERT_TRUE(world.ok()) << world.error().sentence();
  run(**world, 1e-3, 1000);
  const State s = read(**world, 2);
  EXPECT_NEAR(s.poses[1].p[0], 0.1, 1e-4);
  EXPECT_NEAR(s.poses[1].p[2], 0.05, 2e-4);
  EXPECT_LT(rotation_gap(s.poses[1], Pose{}), 1e-3);
  std::vector<PhysicsContact> contacts;
  (*world)->contacts(contacts);
  ASSERT_FALSE(contacts.empty());
  double up = 0;
  for (const PhysicsContact& c : contacts) {
    EXPECT_EQ(c.a, 0);
    EXPECT_EQ(c.b, 1);
    EXPECT_NEAR(c.point[2], 0, 1e-3);
    EXPECT_NEAR(c.normal[2], -1, 1e-6) << "it points to body a, the floor";
    up += c.force[2];
  }
  EXPECT_NEAR(up, -5 * 9.81, 0.02 * 5 * 9.81) << "on the floor";
}

TEST_P(PhysicsConformance, FrictionHoldsOnAGentleSlopeAndLetsSlideOnASteepOne) {
  const double mu = 0.4;
  const auto way = [&](double slope) {
    PhysicsBody slab = floor_body(), box = box_body(1, {0.2, 0.2, 0.1}, shift(0, 0, 0.05));
    slab.friction = box.friction = mu;
    auto world = make({slab, box}, {}, {9.81 * std::sin(slope), 0, -9.81 * std::cos(slope)});
    EXPECT_TRUE(world.ok());
    run(**world, 1e-3, 1000);
    return read(**world, 2).poses[1].p[0];
  };
  EXPECT_LT(std::fabs(way(0.3)), 2e-3) << "tan 0.3 = 0.31";
  const double slope = 0.7, expected = 9.81 * (std::sin(slope) - mu * std::cos(slope)) / 2;
  EXPECT_NEAR(way(slope), expected, 0.03 * expected);
}

TEST_P(PhysicsConformance, ABallBouncesByItsRestitution) {
  PhysicsBody ball, slab = floor_body();
  ball.shape.shapes = {{ShapeKind::sphere, {0.1, 0, 0}, nullptr, {}}};
  ball.mass = {1, {}, {0.004, 0.004, 0.004, 0, 0, 0}};
  ball.pose = shift(0, 0, 1.1);
  ball.restitution = 0.8;
  auto world = make({slab, ball});
  ASSERT_TRUE(world.ok()) << world.error().sentence();
  double highest = 0;
  bool has_hit = false;
  for (int i = 0; i < 900; ++i) {
    run(**world, 1e-3, 1);
    const State s = read(**world, 2);
    has_hit = has_hit || s.velocities[1][2] > 0.5;
    if (has_hit) highest = std::max(highest, s.poses[1].p[2] - 0.1);
  }
  EXPECT_NEAR(highest, 0.64, 0.03) << "0.8^2 of the height of the drop";
}

TEST_P(PhysicsConformance, ATorqueTurnsAWheelAndPositionsCountWholeTurns) {
  PhysicsBody wheel = box_body(2, {0.4, 0.4, 0.05}, multiply(shift(0.1, 0, 1), turn_x(0.3)));
  wheel.shape = {};
  PhysicsJoint hinge;
  hinge.a = -1, hinge.b = 0;
  hinge.in_a = wheel.pose;
  hinge.in_b = turn_z(-0.4);  // the wheel starts at +0.4
  hinge.lower = 1, hinge.upper = -1;
  const double I = wheel.mass.inertia.zz, torque = 0.5, t = 2;
  auto world = make({wheel}, {hinge});
  ASSERT_TRUE(world.ok()) << world.error().sentence();
  EXPECT_NEAR(read(**world, 1, 1).q[0], -0.4, 1e-12) << "a_T_b of the joint frames";
  run(**world, 5e-4, 4000, {torque});
  const State s = read(**world, 1, 1);
  EXPECT_NEAR(s.qd[0], torque / I * t, 1e-3 * torque / I * t);
  EXPECT_NEAR(s.q[0], -0.4 + torque / I * t * t / 2, 2e-3 * torque / I * t * t);
  EXPECT_GT(s.q[0], 4 * kPi);
}

TEST_P(PhysicsConformance, AMotorsInertiaCountsForItsJointAndNotForItsBody) {
  // Two parallel hinges, the second body on its own axis at a distance r: with the motor's inertia
  // A (I1 + m2 r^2 + I2) a1 + I2 a2 = 0 and I2 a1 + (I2 + A) a2 = torque.
  const double r = 0.4, A = 0.03, torque = 0.2, dt = 1e-4;
  PhysicsBody first = box_body(1, {0.1, 0.1, 0.1}, Pose{}),
              second = box_body(2, {0.2, 0.1, 0.1}, shift(r, 0, 0));
  first.shape = second.shape = {};
  PhysicsJoint one, two;
  one.b = 0, one.lower = 1, one.upper = -1;
  two = one, two.a = 0, two.b = 1;
  two.in_a = shift(r, 0, 0);
  two.armature = A;
  auto world = make({first, second}, {one, two}, {0, 0, 0});
  ASSERT_TRUE(world.ok()) << world.error().sentence();
  run(**world, dt, 1, {0, torque});
  const State s = read(**world, 2, 2);
  const double I1 = first.mass.inertia.zz + 2 * r * r, I2 = second.mass.inertia.zz;
  const double det = (I1 + I2) * (I2 + A) - I2 * I2;
  EXPECT_NEAR(s.qd[0] / dt, -I2 * torque / det, 1e-3 * torque / I1);
  EXPECT_NEAR(s.qd[1] / dt, (I1 + I2) * torque / det, 1e-3 * torque / (I2 + A));

  PhysicsJoint slide = one;
  slide.type = 1, slide.armature = 3, slide.viscous = 20;
  auto sliding = make({first}, {slide}, {0, 0, 0});
  ASSERT_TRUE(sliding.ok()) << sliding.error().sentence();
  run(**sliding, 1e-3, 300, {10});
  // (m + A) dv/dt = F - b v
  EXPECT_NEAR(read(**sliding, 1, 1).qd[0], 0.5 * (1 - std::exp(-0.3 * 20 / 4)), 2e-3);
}

TEST_P(PhysicsConformance, AServoReachesItsSpeedWithNoMoreThanItsForce) {
  PhysicsBody block = box_body(2, {0.1, 0.1, 0.1}, Pose{});
  block.shape = {};
  PhysicsJoint slide;
  slide.b = 0, slide.type = 1, slide.lower = 1, slide.upper = -1;
  auto world = make({block}, {slide}, {0, 0, 0});
  ASSERT_TRUE(world.ok()) << world.error().sentence();
  const auto moved = (*world)->servo(0, 0.5, 4);
  if (is_left_out(moved)) GTEST_SKIP() << moved.error().sentence();
  ASSERT_TRUE(moved.ok()) << moved.error().sentence();
  run(**world, 1e-3, 100);
  EXPECT_NEAR(read(**world, 1, 1).qd[0], 0.2, 1e-5) << "4 N for 0.1 s on 2 kg";
  run(**world, 1e-3, 400);
  EXPECT_NEAR(read(**world, 1, 1).qd[0], 0.5, 1e-5);
  ASSERT_TRUE((*world)->servo(0, 0, 0).ok());
  run(**world, 1e-3, 100, {1});
  EXPECT_NEAR(read(**world, 1, 1).qd[0], 0.55, 1e-5) << "without it only the force counts";
  EXPECT_FALSE((*world)->servo(3, 0, 1).ok());
  EXPECT_FALSE((*world)->servo(0, 0, -1).ok());
}

TEST_P(PhysicsConformance, AJointFollowsAnotherOne) {
  // A wheel about x drives a slide along y by a ratio r [m/rad]: (I + r^2 m) a = torque + r F.
  const double r = -0.05, torque = 0.3, force = 2, t = 0.5;
  PhysicsBody wheel = box_body(1, {0.1, 0.1, 0.1}, Pose{}),
              rack = box_body(4, {0.1, 0.1, 0.1}, shift(0, 0.3, 0));
  wheel.shape = rack.shape = {};
  PhysicsJoint hinge, slide;
  hinge.b = 0, hinge.lower = 1, hinge.upper = -1;
  hinge.in_a = hinge.in_b = turn_x(0.3);
  slide = hinge;
  slide.type = 1, slide.b = 1;
  slide.in_a = multiply(shift(0, 0.2, 0), turn_x(-kPi / 2));
  slide.in_b = turn_x(-kPi / 2);
  slide.follows = 0, slide.ratio = r, slide.offset = 0.1;
  auto world = make({wheel, rack}, {hinge, slide}, {0, 0, 0});
  if (is_left_out(world)) GTEST_SKIP() << world.error().sentence();
  ASSERT_TRUE(world.ok()) << world.error().sentence();
  run(**world, 1e-3, 500, {torque, force});
  const State s = read(**world, 2, 2);
  const double a = (torque + r * force) / (wheel.mass.inertia.xx + r * r * 4);
  EXPECT_NEAR(s.qd[0], a * t, 1e-3 * std::fabs(a * t));
  EXPECT_NEAR(s.qd[1], r * s.qd[0], 1e-5);
  EXPECT_NEAR(s.q[1], r * s.q[0] + 0.1, 1e-6);
  EXPECT_NEAR(s.poses[1].p[1], 0.2 + s.q[1], 1e-6);

  slide.follows = 1;
  EXPECT_FALSE(make({wheel, rack}, {hinge, slide}).ok()) << "itself";
}

TEST_P(PhysicsConformance, DirectionsOfALoopAreKeptAndOthersAreFree) {
  // A block that may only slide along the world's x and turn about it falls not, but slides.
  PhysicsBody block = box_body(2, {0.1, 0.1, 0.1}, shift(0, 0, 1));
  block.shape = {};
  PhysicsJoint loop;
  loop.type = 4, loop.b = 0;
  loop.in_a = shift(0, 0, 1);
  loop.fixed = 2 | 4 | 16 | 32;
  auto world = make({block}, {loop}, {1, 0, -9.81});
  if (is_left_out(world)) GTEST_SKIP() << world.error().sentence();
  ASSERT_TRUE(world.ok()) << world.error().sentence();
  ASSERT_TRUE((*world)->push(0, {}, {0.01, 0.02, 0}).ok());
  run(**world, 1e-3, 500);
  const State s = read(**world, 1);
  EXPECT_NEAR(s.velocities[0][0], 0.5, 1e-4);
  EXPECT_NEAR(s.poses[0].p[2], 1, 1e-6);
  EXPECT_NEAR(s.angular_velocities[0][0], 0.01 / block.mass.inertia.xx * 0.5, 1e-3);
  EXPECT_NEAR(s.angular_velocities[0][1], 0, 1e-6);
  run(**world, 1e-3, 100);
  EXPECT_NEAR(read(**world, 1).angular_velocities[0][0], s.angular_velocities[0][0], 1e-6)
      << "a push lasts for one call";
}

TEST_P(PhysicsConformance, FrictionIsAsWideAsTheConeAlongAnySlope) {
  // Down a slope that is not along an axis: the bound of the pyramid would be up to sqrt(2) mu.
  const double mu = 0.4, slope = 0.45;  // tan = 0.483
  for (const double heading : {0.0, 0.6, kPi / 4, 2.5}) {
    PhysicsBody slab = floor_body(), box = box_body(1, {0.2, 0.2, 0.1}, shift(0, 0, 0.05));
    slab.friction = box.friction = mu;
    const double along = 9.81 * std::sin(slope), down = 9.81 * std::cos(slope);
    auto world =
        make({slab, box}, {}, {along * std::cos(heading), along * std::sin(heading), -down});
    ASSERT_TRUE(world.ok()) << world.error().sentence();
    run(**world, 1e-3, 1000);
    const Vec3 p = read(**world, 2).poses[1].p;
    const double expected = (along - mu * down) / 2;
    EXPECT_NEAR(std::hypot(p[0], p[1]), expected, 0.03 * expected) << heading;
  }
}

TEST_P(PhysicsConformance, ABoxTipsWhereItsWeightLeavesItsEdge) {
  // Width b and height h: it tips where tan of the slope is greater than b / h.
  const double b = 0.1, h = 0.3, limit = std::atan(b / h);
  const auto tilt = [&](double slope) {
    PhysicsBody slab = floor_body(), box = box_body(1, {b, 0.2, h}, shift(0, 0, h / 2));
    slab.friction = box.friction = 1;
    auto world = make({slab, box}, {}, {9.81 * std::sin(slope), 0, -9.81 * std::cos(slope)});
    EXPECT_TRUE(world.ok());
    run(**world, 1e-3, 1500);
    return rotation_gap(read(**world, 2).poses[1], Pose{});
  };
  EXPECT_LT(tilt(limit - 0.01), 0.01);
  EXPECT_GT(tilt(limit + 0.01), 0.5);
}

TEST_P(PhysicsConformance, FingersHoldABoxByFrictionAloneOrLetItSlip) {
  // Two pads press with N each from both sides: held while 2 mu N >= m g.
  const double mu = 0.5, m = 0.8, limit = m * 9.81 / (2 * mu);
  const auto fall = [&](double force) {
    PhysicsBody box = box_body(m, {0.06, 0.05, 0.08}, shift(0, 0, 1));
    PhysicsBody left = box_body(0.2, {0.01, 0.04, 0.04}, shift(-0.0351, 0, 1)), right = left;
    right.pose = shift(0.0351, 0, 1);
    for (PhysicsBody* x : {&box, &left, &right}) x->friction = mu;
    PhysicsJoint slide;
    slide.type = 1, slide.lower = 1, slide.upper = -1;
    Pose along_x;
    along_x.R = {0, 0, 1, 1, 0, 0, 0, 1, 0};
    slide.in_b = along_x;
    slide.b = 1, slide.in_a = multiply(left.pose, along_x);
    PhysicsJoint other = slide;
    other.b = 2, other.in_a = multiply(right.pose, along_x);
    auto world = make({box, left, right}, {slide, other});
    EXPECT_TRUE(world.ok());
    run(**world, 1e-3, 1000, {force, -force});
    return 1 - read(**world, 3).poses[0].p[2];
  };
  EXPECT_LT(fall(1.03 * limit), 1e-3);
  // Beyond it the box falls with g - 2 mu N / m until the pads have no more to hold.
  EXPECT_GT(fall(0.97 * limit), 0.05);
}

TEST_P(PhysicsConformance, ASlideStopsAtItsLimitAndABrakeHoldsIt) {
  PhysicsBody block = box_body(2, {0.1, 0.1, 0.1}, shift(0, 0, 1));
  block.shape = {};
  PhysicsJoint slide;
  slide.a = -1, slide.b = 0, slide.type = 1;
  slide.in_a = shift(0, 0, 1);
  slide.lower = -0.2, slide.upper = 0.5;
  auto free = make({block}, {slide});
  slide.coulomb = 25;  // more than the weight of 19.62 N
  auto braked = make({block}, {slide});
  ASSERT_TRUE(free.ok() && braked.ok());
  run(**free, 1e-3, 1000);
  run(**braked, 1e-3, 1000);
  EXPECT_NEAR(read(**free, 1, 1).q[0], -0.2, 1e-3);
  EXPECT_NEAR(read(**braked, 1, 1).q[0], 0, 1e-3);
  run(**free, 1e-3, 1000, {30});
  EXPECT_NEAR(read(**free, 1, 1).q[0], 0.5, 1e-3) << "pushed up against the other limit";
}

TEST_P(PhysicsConformance, AnAttachedBodyIsCarriedAndFallsWhenReleased) {
  PhysicsBody hand = box_body(0, {0.1, 0.1, 0.1}, shift(0, 0, 1)),
              box = box_body(1, {0.1, 0.1, 0.1}, shift(0, 0, 0.9));
  hand.mass = {};
  auto world = make({hand, box});
  ASSERT_TRUE(world.ok()) << world.error().sentence();
  const auto held = (*world)->attach(0, 1);
  ASSERT_TRUE(held.ok()) << held.error().sentence();
  const double dt = 1e-3;
  for (int i = 0; i < 500; ++i) {
    const double x = 0.2 * dt * i;
    ASSERT_TRUE((*world)->move(0, shift(x, 0, 1), {0.2, 0, 0}, {}).ok());
    run(**world, dt, 1);
  }
  const State carried = read(**world, 2);
  EXPECT_NEAR(carried.poses[1].p[0], 0.1, 2e-3);
  EXPECT_NEAR(carried.poses[1].p[2], 0.9, 2e-3);
  ASSERT_TRUE((*world)->release(*held).ok());
  EXPECT_FALSE((*world)->release(*held).ok()) << "released twice";
  ASSERT_TRUE((*world)->move(0, shift(0, 0, 3), {}, {}).ok());
  run(**world, dt, 300);
  EXPECT_NEAR(read(**world, 2).poses[1].p[2], 0.9 - 9.81 * 0.09 / 2, 0.01);
}

TEST_P(PhysicsConformance, AConveyorTakesABoxAlong) {
  PhysicsBody belt = floor_body(), box = box_body(1, {0.2, 0.2, 0.1}, shift(0, 0, 0.05));
  auto world = make({belt, box});
  ASSERT_TRUE(world.ok()) << world.error().sentence();
  for (int i = 0; i < 1000; ++i) {
    ASSERT_TRUE((*world)->move(0, belt.pose, {0.3, 0, 0}, {}).ok());
    run(**world, 1e-3, 1);
  }
  EXPECT_NEAR(read(**world, 2).velocities[1][0], 0.3, 0.01);
}

TEST_P(PhysicsConformance, ConvexPiecesAndMeshesRestLikeBoxes) {
  Mesh cube;
  for (int i = 0; i < 8; ++i)
    for (int k = 0; k < 3; ++k) cube.positions.push_back(i >> k & 1 ? 0.05F : -0.05F);
  cube.normals.resize(cube.positions.size());
  cube.triangles = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                    2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
  for (const ShapeKind kind : {ShapeKind::convex, ShapeKind::mesh}) {
    PhysicsBody b = box_body(1, {0.1, 0.1, 0.1}, shift(0, 0, 0.0505));
    b.shape.shapes = {{kind, {}, &cube, {}}};
    auto world = make({floor_body(), b});
    if (!world.ok() && world.error().code == ErrorCode::unsupported) {
      EXPECT_NE(world.error().where.find("body 2"), std::string::npos) << world.error().sentence();
      continue;
    }
    ASSERT_TRUE(world.ok()) << world.error().sentence();
    run(**world, 1e-3, 500);
    const State s = read(**world, 2);
    EXPECT_NEAR(s.poses[1].p[2], 0.05, 1e-3) << "kind " << static_cast<int>(kind);
    EXPECT_LT(rotation_gap(s.poses[1], Pose{}), 1e-2) << "kind " << static_cast<int>(kind);
  }
}

TEST_P(PhysicsConformance, EqualRunsGiveEqualBits) {
  const auto last = [&] {
    std::vector<PhysicsBody> bodies{floor_body()};
    for (int i = 0; i < 5; ++i)
      bodies.push_back(
          box_body(1, {0.1, 0.1, 0.1},
                   multiply(shift(0.03 * i, 0.02 * i, 0.2 + 0.13 * i), turn_x(0.1 * i))));
    auto world = make(bodies);
    EXPECT_TRUE(world.ok());
    run(**world, 2e-3, 300);
    return read(**world, bodies.size());
  };
  const State a = last(), b = last();
  for (std::size_t i = 0; i < a.poses.size(); ++i) {
    EXPECT_EQ(a.poses[i].p, b.poses[i].p);
    EXPECT_EQ(a.poses[i].R, b.poses[i].R);
  }
}

TEST_P(PhysicsConformance, WorldsOnSeveralThreadsRunAsTheyDoAlone) {
  const auto last = [&] {
    std::vector<PhysicsBody> bodies{floor_body()};
    for (int i = 0; i < 4; ++i)
      bodies.push_back(
          box_body(1, {0.1, 0.1, 0.1},
                   multiply(shift(0.03 * i, 0.02 * i, 0.2 + 0.13 * i), turn_x(0.1 * i))));
    auto world = make(bodies);
    EXPECT_TRUE(world.ok());
    if (!world.ok()) return State{};
    run(**world, 2e-3, 200);
    return read(**world, bodies.size());
  };
  const State alone = last();
  std::array<State, 4> together;
  at_once(together.size(), [&](std::size_t thread) { together[thread] = last(); });
  for (const State& s : together) {
    ASSERT_EQ(s.poses.size(), alone.poses.size());
    for (std::size_t i = 0; i < alone.poses.size(); ++i) {
      EXPECT_EQ(s.poses[i].p, alone.poses[i].p);
      EXPECT_EQ(s.poses[i].R, alone.poses[i].R);
    }
  }
}

TEST_P(PhysicsConformance, WrongInputIsRefusedAndCancelIsHeard) {
  const PhysicsBody good = box_body(1, {0.1, 0.1, 0.1}, Pose{});
  PhysicsBody flat = good, thin = good;
  flat.shape.shapes[0].sizes[1] = 0;
  thin.mass.inertia.xx = 0;
  EXPECT_FALSE(make({flat}).ok());
  EXPECT_FALSE(make({thin}).ok());
  PhysicsJoint lost;
  lost.b = 7;
  EXPECT_FALSE(make({good}, {lost}).ok());
  auto world = make({good});
  ASSERT_TRUE(world.ok());
  NoProgress none;
  EXPECT_FALSE((*world)->step(-1, 1, {}, none).ok());
  const std::vector<double> forces{1, 2};
  EXPECT_FALSE((*world)->step(1e-3, 1, forces, none).ok()) << "two forces for no joint";
  EXPECT_FALSE((*world)->attach(0, 0).ok());
  EXPECT_FALSE((*world)->move(0, Pose{}, {}, {}).ok()) << "it has mass";
  EXPECT_FALSE((*world)->push(4, {}, {}).ok());
  EXPECT_FALSE((*world)->ignore(0, 1).ok());
  CancelledProgress stop;
  const auto stopped = (*world)->step(1e-3, 100, {}, stop);
  ASSERT_FALSE(stopped.ok());
  EXPECT_EQ(stopped.error().code, ErrorCode::cancelled);
}

}  // namespace robomosp::conformance
