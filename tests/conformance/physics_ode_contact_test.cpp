// SPDX-License-Identifier: Apache-2.0
// Contact by the plugin of ODE against closed forms: what falls without bouncing, overlaps, rolls,
// spins and tumbles.
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include <robomosp/sdk/conformance/physics_suite.h>
#include <robomosp/sdk/physics_notes.h>
#include <robomosp/sdk/round_outside.h>

namespace robomosp::conformance {
namespace {

constexpr double kGravity = 9.81, kTurn = 2 * std::numbers::pi;
const std::string kOdeFile = std::string(ROBOMOSP_PLUGIN_DIR) + "/physics_ode.so";

/// A world of the provider "ode" with its parameters as they are, or another solver.
class OdeContact : public testing::Test {
 protected:
  void make(const std::vector<PhysicsBody>& bodies, const std::vector<PhysicsJoint>& joints = {},
            Vec3 gravity = {0, 0, -kGravity}, const char* solver = "exact") {
    const auto found = find_provider<PhysicsEngine>(kOdeFile, "ode");
    ASSERT_TRUE(found.ok()) << found.error().sentence();
    engine_ = create<PhysicsEngine>(**found);
    TableParams params(**found);
    params.set("solver", std::string(solver));
    auto made = engine_->create(bodies, joints, gravity, params);
    ASSERT_TRUE(made.ok()) << made.error().sentence();
    world_ = std::move(*made);
    bodies_ = bodies.size(), joints_ = joints.size();
  }
  void run(double dt, int steps) {
    NoProgress none;
    const auto done = world_->step(dt, steps, {}, none);
    ASSERT_TRUE(done.ok()) << done.error().sentence();
    s.poses.resize(bodies_), s.v.resize(bodies_), s.w.resize(bodies_);
    s.q.resize(joints_), s.qd.resize(joints_);
    ASSERT_TRUE(world_->read({sizeof(PhysicsState), s.poses, s.v, s.w, s.q, s.qd}).ok());
  }
  [[nodiscard]] std::vector<PhysicsNote> notes() const {
    const void* known = world_->extension(PhysicsNotes::kId);
    EXPECT_NE(known, nullptr);
    auto all = static_cast<const PhysicsNotes*>(known)->notes();
    return all.ok() ? *all : std::vector<PhysicsNote>{};
  }
  struct {
    std::vector<Pose> poses;
    std::vector<Vec3> v, w;
    std::vector<double> q, qd;
  } s;
  std::unique_ptr<PhysicsEngine> engine_;
  std::unique_ptr<PhysicsWorld> world_;
  std::size_t bodies_ = 0, joints_ = 0;
};

PhysicsBody cylinder_body(double mass, double radius, double length, const Pose& pose) {
  PhysicsBody b;
  b.shape.shapes = {{ShapeKind::cylinder, {radius, length, 0}, nullptr, {}, {}}};
  const double across = mass * (3 * radius * radius + length * length) / 12;
  b.mass = {mass, {}, {across, across, mass * radius * radius / 2, 0, 0, 0}};
  b.pose = pose;
  return b;
}

/// Turned about z with the outline radius, z, counter-clockwise in the half plane; not smooth.
Mesh turned_mesh(const std::vector<std::array<double, 2>>& outline, int around) {
  Mesh m;
  const auto corner = [&](std::size_t i, int k) {
    const auto& [r, z] = outline[i % outline.size()];
    const double t = kTurn * k / around;
    m.triangles.push_back(static_cast<std::uint32_t>(m.positions.size() / 3));
    for (const double x : {r * std::cos(t), r * std::sin(t), z}) {
      m.positions.push_back(static_cast<float>(x));
      m.normals.push_back(0);
    }
  };
  for (std::size_t i = 0; i < outline.size(); ++i)
    for (int k = 0; k < around; ++k) {
      corner(i, k), corner(i, k + 1), corner(i + 1, k + 1);
      corner(i, k), corner(i + 1, k + 1), corner(i + 1, k);
    }
  return m;
}

// ---- push-out ----

TEST_F(OdeContact, WhatFallsWithoutRestitutionStaysDown) {
  for (const char* solver : {"exact", "sweeps"})
    for (const double dt : {1e-3, 1e-4}) {
      make({floor_body(), box_body(1, {0.1, 0.1, 0.1}, shift(0, 0, 2.05)),
            cylinder_body(1, 0.05, 0.1, shift(1, 0, 2.05))},
           {}, {0, 0, -kGravity}, solver);
      // sqrt(2 h / g) = 0.639 s
      run(dt, static_cast<int>(0.645 / dt));
      double top = -1, fastest = 0;
      for (int i = 0; i < 400; ++i) {
        run(dt, 1);
        for (const std::size_t b : {std::size_t{1}, std::size_t{2}})
          top = std::max(top, s.poses[b].p[2] - 0.05), fastest = std::max(fastest, s.v[b][2]);
      }
      EXPECT_LT(top, 1e-6) << solver << ", step " << dt;
      EXPECT_LT(fastest, 2e-3) << solver << ", step " << dt;
      EXPECT_NEAR(s.poses[1].p[2], 0.05, 2e-5);
    }
}

TEST_F(OdeContact, WhatBouncesRisesByTheSquareOfItsRestitution) {
  PhysicsBody ball = box_body(1, {0.1, 0.1, 0.1}, shift(0, 0, 1.05));
  ball.shape.shapes = {{ShapeKind::sphere, {0.05, 0, 0}, nullptr, {}, {}}};
  ball.restitution = 0.5;
  make({floor_body(), ball});
  run(1e-4, 4600);
  double top = 0;
  for (int i = 0; i < 4000; ++i) run(1e-4, 1), top = std::max(top, s.poses[1].p[2] - 0.05);
  EXPECT_NEAR(top, 0.25, 0.002);
}

TEST_F(OdeContact, OverlapsArePushedApartAndGetNoSpeed) {
  // 30 mm in the floor, 30 mm in each other, and a pile of eight in one place.
  std::vector<PhysicsBody> bodies{floor_body(), box_body(1, {0.1, 0.1, 0.1}, shift(0, 0, 0.02)),
                                  box_body(1, {0.1, 0.1, 0.1}, shift(0, 0, 0.09))};
  for (int i = 0; i < 8; ++i)
    bodies.push_back(box_body(1, {0.1, 0.1, 0.1}, shift(1, 0, 0.04 + 0.08 * i)));
  make(bodies);
  double fastest = 0;
  for (int i = 0; i < 500; ++i) {
    run(1e-3, 1);
    for (std::size_t b = 1; b < bodies.size(); ++b)
      fastest = std::max(fastest, std::sqrt(s.v[b][0] * s.v[b][0] + s.v[b][1] * s.v[b][1] +
                                            s.v[b][2] * s.v[b][2]));
  }
  EXPECT_LT(fastest, 0.02) << "what falls a little on the way";
  EXPECT_NEAR(s.poses[1].p[2], 0.05, 1e-4);
  EXPECT_NEAR(s.poses[2].p[2], 0.15, 1e-4);
  for (int i = 0; i < 8; ++i)
    EXPECT_NEAR(s.poses[static_cast<std::size_t>(3 + i)].p[2], 0.05 + 0.1 * i, 1e-3) << i;
}

TEST_F(OdeContact, AJointThatHitsItsStopStaysThere) {
  for (const int type : {0, 1}) {
    PhysicsBody b = box_body(1, {0.1, 0.1, 0.1}, type == 0 ? shift(0.5, 0, 0) : Pose{});
    b.shape = {};
    PhysicsJoint j;
    j.b = 0, j.type = type;
    j.lower = -1, j.upper = 1;
    if (type == 0) {  // about y, so that gravity turns it; the body swings about the origin
      j.in_a.R = {1, 0, 0, 0, 0, 1, 0, -1, 0};
      j.in_b = j.in_a, j.in_b.p = {-0.5, 0, 0};
    }
    make({b}, {j});
    double most = 0, back = 10;
    bool has_hit = false;
    for (int i = 0; i < 2000; ++i) {
      run(1e-3, 1);
      most = std::max(most, std::fabs(s.q[0]));
      has_hit = has_hit || std::fabs(s.q[0]) >= 1;
      if (has_hit) back = std::min(back, std::fabs(s.q[0]));
    }
    EXPECT_TRUE(has_hit) << type;
    EXPECT_LT(most, 1.01) << type;
    EXPECT_GT(back, 1 - 1e-6) << type << ": it does not bounce off";
  }
}

// ---- turning ----

/// Kinetic energy of a body whose axes are principal.
double energy(const PhysicsBody& b, const Pose& at, const Vec3& w) {
  const double I[3] = {b.mass.inertia.xx, b.mass.inertia.yy, b.mass.inertia.zz};
  double sum = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const double own = at.R[k] * w[0] + at.R[3 + k] * w[1] + at.R[6 + k] * w[2];
    sum += 0.5 * I[k] * own * own;
  }
  return sum;
}

TEST_F(OdeContact, ATumblingBrickKeepsItsEnergy) {
  PhysicsBody b = box_body(2, {0.1, 0.2, 0.3}, Pose{});
  b.angular_velocity = {1, 8, 2};
  make({b}, {}, {0, 0, 0});
  const double before = energy(b, Pose{}, b.angular_velocity);
  run(1e-3, 10000);
  EXPECT_NEAR(energy(b, s.poses[0], s.w[0]) / before, 1, 1e-8);
  // The same with a step of 10 ms, and in a fall.
  make({b}, {}, {0, 0, -1});
  run(1e-2, 1000);
  EXPECT_NEAR(energy(b, s.poses[0], s.w[0]) / before, 1, 1e-6);
}

TEST_F(OdeContact, ATumblingBrickTurnsOverInThePeriodOfTheEllipticIntegral) {
  PhysicsBody b = box_body(2, {0.1, 0.2, 0.3}, Pose{});
  const double I1 = b.mass.inertia.xx, I2 = b.mass.inertia.yy, I3 = b.mass.inertia.zz;
  b.angular_velocity = {0.2, 6, 0.5};  // nearly about the middle axis: it flips
  make({b}, {}, {0, 0, 0});
  // Landau and Lifshitz, Mechanics, 37: for I1 > I2 > I3 the period of the velocity is
  // 4 K(k) sqrt(I1 I2 I3 / ((I1 - I2) (M^2 - 2 E I3))) with
  // k^2 = (I2 - I3)(2 E I1 - M^2) / ((I1 - I2)(M^2 - 2 E I3)) where M^2 > 2 E I2.
  const Vec3& w = b.angular_velocity;
  const double E2 = I1 * w[0] * w[0] + I2 * w[1] * w[1] + I3 * w[2] * w[2];
  const double M2 = I1 * I1 * w[0] * w[0] + I2 * I2 * w[1] * w[1] + I3 * I3 * w[2] * w[2];
  double a = I1, c = I3;
  if (M2 < E2 * I2) std::swap(a, c);
  const double k2 = (I2 - c) * (E2 * a - M2) / ((a - I2) * (M2 - E2 * c));
  const double period =
      4 * std::comp_ellint_1(std::sqrt(k2)) * std::sqrt(I1 * I2 * I3 / ((a - I2) * (M2 - E2 * c)));
  run(period / 4000, 4000);
  Vec3 own{};
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t r = 0; r < 3; ++r) own[k] += s.poses[0].R[3 * r + k] * s.w[0][r];
  for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(own[k], w[k], 1e-4) << k;
  run(period / 8000, 4000);
  double half = 0;
  for (std::size_t r = 0; r < 3; ++r) half += s.poses[0].R[3 * r + 1] * s.w[0][r];
  EXPECT_NEAR(half, -w[1], 1e-4) << "half a period later it is upside down";
}

TEST_F(OdeContact, ASpinningPuckStopsAsByAnEvenPressure) {
  // Torque 2/3 mu m g R against m R^2 / 2: angle 3 w^2 R / (8 mu g); a ring's arm is
  // 2/3 (R^3 - r^3) / (R^2 - r^2); a square's of side a is a (sqrt 2 + asinh 1) / 6.
  const double mu = 0.3, R = 0.1, w = 20;
  PhysicsBody ground = floor_body();
  ground.friction = mu;
  const auto angle = [&](PhysicsBody b) {
    b.friction = mu, b.angular_velocity = {0, 0, w};
    make({ground, b});
    double sum = 0;
    for (int i = 0; i < 4000; ++i) run(5e-4, 1), sum += 5e-4 * s.w[1][2];
    EXPECT_NEAR(s.w[1][2], 0, 1e-6);
    return sum;
  };
  const double puck = 3 * w * w * R / (8 * mu * kGravity);  // 5.10
  EXPECT_NEAR(angle(cylinder_body(1, R, 0.04, shift(0, 0, 0.02))), puck, 0.005 * puck);

  const double a = 0.1, arm = a * (std::sqrt(2.0) + std::asinh(1.0)) / 6;
  const PhysicsBody box = box_body(1, {a, a, 0.04}, shift(0, 0, 0.02));
  const double square = box.mass.inertia.zz * w * w / (2 * mu * kGravity * arm);
  EXPECT_NEAR(angle(box), square, 0.01 * square);

  const double r = 0.05;
  const Mesh ring = turned_mesh({{r, -0.02}, {R, -0.02}, {R, 0.02}, {r, 0.02}}, 48);
  RoundOutside outside;
  outside.profile = {{R, -0.02}, {R, 0.02}};
  PhysicsBody b = cylinder_body(1, R, 0.04, shift(0, 0, 0.02));
  b.mass.inertia.zz = 0.5 * (R * R + r * r);
  b.shape.shapes = {{ShapeKind::mesh, {}, &ring, {}, {}}};
  set_outside(b.shape.shapes[0], &outside);
  const double ring_arm = 2.0 / 3 * (R * R * R - r * r * r) / (R * R - r * r);
  const double turned = b.mass.inertia.zz * w * w / (2 * mu * kGravity * ring_arm);
  EXPECT_NEAR(angle(b), turned, 0.01 * turned);
}

// ---- round bodies ----

TEST_F(OdeContact, RoundBodiesWithBoresRollAsRoundOnes) {
  const double R = 0.1, speed = 1, time = 2;
  Pose lying;
  lying.R = {1, 0, 0, 0, 0, -1, 0, 1, 0};
  lying.p = {0, 0, R};
  const auto way = [&](const Mesh& mesh, ShapeKind kind, const RoundOutside& outside) {
    PhysicsBody b = cylinder_body(1, R, 0.04, lying);
    b.shape.shapes = {{kind, {}, &mesh, {}, {}}};
    set_outside(b.shape.shapes[0], &outside);
    b.velocity = {speed, 0, 0};
    b.angular_velocity = {0, speed / R, 0};
    make({floor_body(), b});
    run(1e-3, static_cast<int>(1e3 * time));
    EXPECT_NEAR(s.poses[1].p[2], R, 2e-5);
    EXPECT_NEAR(s.poses[1].p[1], 0, 1e-4);
    return s.poses[1].p[0];
  };
  RoundOutside disc;
  disc.profile = {{R, -0.02}, {R, 0.02}};
  const Mesh bored = turned_mesh({{0.05, -0.02}, {R, -0.02}, {R, 0.02}, {0.05, 0.02}}, 40);
  EXPECT_NEAR(way(bored, ShapeKind::mesh, disc), speed * time, 1e-4) << "a disc with a hole";

  // Along z, with a bore of 0.03 along it.
  RoundOutside ball;
  ball.sphere = R;
  std::vector<std::array<double, 2>> outline;
  const double low = std::asin(0.3);
  for (int i = 0; i <= 24; ++i) {
    const double t = low + (std::numbers::pi - 2 * low) * i / 24;
    outline.push_back({R * std::sin(t), -R * std::cos(t)});
  }
  EXPECT_NEAR(way(turned_mesh(outline, 40), ShapeKind::mesh, ball), speed * time, 1e-4)
      << "a sphere with a bore";

  // Chamfered: circles of its outline.
  RoundOutside wheel;
  wheel.profile = {{0.09, -0.02}, {R, -0.01}, {R, 0.01}, {0.09, 0.02}};
  const Mesh chamfered = turned_mesh(
      {{0.05, -0.02}, {0.09, -0.02}, {R, -0.01}, {R, 0.01}, {0.09, 0.02}, {0.05, 0.02}}, 40);
  EXPECT_NEAR(way(chamfered, ShapeKind::mesh, wheel), speed * time, 1e-4) << "a wheel";
  const Mesh solid =
      turned_mesh({{0, -0.02}, {0.09, -0.02}, {R, -0.01}, {R, 0.01}, {0.09, 0.02}, {0, 0.02}}, 40);
  EXPECT_NEAR(way(solid, ShapeKind::convex, wheel), speed * time, 1e-4) << "a convex one";
}

TEST_F(OdeContact, BoresStayOpen) {
  // A ring and a wheel hang on a fixed bolt through them: 10 mm of play above the bolt's middle.
  const double R = 0.1, r = 0.05, bolt = 0.04;
  RoundOutside disc, wheel;
  disc.profile = {{R, -0.02}, {R, 0.02}};
  wheel.profile = {{0.09, -0.02}, {R, -0.01}, {R, 0.01}, {0.09, 0.02}};
  const Mesh ring = turned_mesh({{r, -0.02}, {R, -0.02}, {R, 0.02}, {r, 0.02}}, 48);
  for (const RoundOutside* outside : {&disc, &wheel}) {
    Pose lying;
    lying.R = {1, 0, 0, 0, 0, -1, 0, 1, 0};
    PhysicsBody peg = cylinder_body(0, bolt, 0.2, lying), b = cylinder_body(1, R, 0.04, lying);
    peg.mass = {};
    b.shape.shapes = {{ShapeKind::mesh, {}, &ring, {}, {}}};
    set_outside(b.shape.shapes[0], outside);
    make({peg, b});
    run(1e-3, 1500);
    EXPECT_NEAR(s.poses[1].p[2], -(r - bolt), 5e-4);
    EXPECT_NEAR(s.poses[1].p[0], 0, 6e-3);
  }
}

// ---- notes ----

TEST_F(OdeContact, AWallWhoseBricksTouchSidewaysStandsAndIsNotRefused) {
  std::vector<PhysicsBody> bodies{floor_body()};
  for (int row = 0; row < 10; ++row)
    for (int i = 0; i < 20; ++i)
      bodies.push_back(
          box_body(2, {0.1, 0.1, 0.1}, shift(0.1 * (i + 0.5 * (row % 2)), 0, 0.05 + 0.1 * row)));
  make(bodies);
  run(1e-3, 3);
  for (std::size_t b = 1; b < bodies.size(); ++b)
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_NEAR(s.poses[b].p[k], bodies[b].pose.p[k], 2e-4) << "brick " << b;
}

// Columns (stack bond) and half a brick aside (running bond), without and with overlap sideways.
TEST_F(OdeContact, WallsOfEachSizeStandInEitherBond) {
  for (const auto& [wide, high, steps] :
       {std::array{5, 5, 20}, std::array{10, 10, 2}, std::array{20, 10, 1}})
    for (const double aside : {0.0, 0.1})
      for (const double dent : {0.0, 1e-4}) {
        std::vector<PhysicsBody> bodies{floor_body()};
        for (int row = 0; row < high; ++row)
          for (int i = 0; i < wide; ++i)
            bodies.push_back(
                box_body(2, {0.2, 0.1, 0.1},
                         shift((0.2 - dent) * i + (row % 2 ? aside : 0), 0, 0.05 + 0.1 * row)));
        make(bodies);
        run(1e-3, steps);
        double worst = 0;
        for (std::size_t b = 1; b < bodies.size(); ++b)
          for (std::size_t k = 0; k < 3; ++k)
            worst = std::max(worst, std::fabs(s.poses[b].p[k] - bodies[b].pose.p[k]));
        const std::string where = std::to_string(wide) + " x " + std::to_string(high) + ", " +
                                  std::to_string(aside) + " aside, dent " + std::to_string(dent);
        EXPECT_LT(worst, 2e-3) << where;
      }
}

TEST_F(OdeContact, TooManyContactsOfJointedBodiesAreSolvedBySweepsAndSaid) {
  // One box is jointed to the next, so that the heap is the engine's whole.
  std::vector<PhysicsBody> bodies{floor_body()};
  for (int x = 0; x < 12; ++x)
    for (int y = 0; y < 12; ++y)
      bodies.push_back(box_body(1, {0.1, 0.1, 0.1}, shift(0.0999 * x, 0.0999 * y, 0.05)));
  PhysicsJoint j;
  j.a = 1, j.b = 2, j.type = 2;
  j.in_a.p = {0, 0.0999, 0};
  make(bodies, {j});
  run(1e-3, 2);
  const auto all = notes();
  ASSERT_EQ(all.size(), 1U);
  EXPECT_NE(all[0].text.find("more than 550 contacts"), std::string::npos) << all[0].text;
  EXPECT_NE(all[0].text.find("solved by sweeps"), std::string::npos) << all[0].text;
  for (std::size_t b = 1; b < bodies.size(); ++b) EXPECT_NEAR(s.poses[b].p[2], 0.05, 1e-3);
}

TEST_F(OdeContact, WhatPassesThroughAnotherInAStepIsSaid) {
  PhysicsBody wall = box_body(0, {0.05, 1, 1}, Pose{});
  wall.mass = {};
  for (const bool moves_wall : {false, true}) {
    PhysicsBody ball = box_body(1, {0.04, 0.04, 0.04}, shift(-0.57, 0, 0));
    ball.shape.shapes = {{ShapeKind::sphere, {0.02, 0, 0}, nullptr, {}, {}}};
    ball.velocity = {100, 0, 0};
    std::vector<PhysicsBody> bodies{wall, ball};
    if (moves_wall) {  // two that meet half way
      bodies[0] = box_body(1000, {0.05, 1, 1}, shift(0.57, 0, 0));
      bodies[0].velocity = {-100, 0, 0};
    }
    make(bodies, {}, {0, 0, 0});
    run(1e-3, 10);
    const auto all = notes();
    ASSERT_EQ(all.size(), 1U) << moves_wall;
    EXPECT_EQ(all[0].a, 0);
    EXPECT_EQ(all[0].b, 1);
    EXPECT_NE(all[0].text.find("passed through each other"), std::string::npos) << all[0].text;
    // A step as it asks for finds the contact.
    make(bodies, {}, {0, 0, 0});
    run(1e-4, 100);
    EXPECT_TRUE(notes().empty());
    EXPECT_LT(s.poses[1].p[0], s.poses[0].p[0]);
  }
  // A flight beside it is no passing.
  PhysicsBody ball = box_body(1, {0.04, 0.04, 0.04}, shift(-0.57, 0, 0.6));
  ball.velocity = {100, 0, 0};
  make({wall, ball}, {}, {0, 0, 0});
  run(1e-3, 10);
  EXPECT_TRUE(notes().empty());
}

}  // namespace
}  // namespace robomosp::conformance
