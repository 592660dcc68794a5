// SPDX-License-Identifier: Apache-2.0
// Piles of free bodies, which the plugin of ODE solves by sparse matrices: against the engine's own
// exact solver, and against what contacts must fulfil.
#include <algorithm>
#include <cmath>
#include <limits>

#include <robomosp/sdk/conformance/physics_suite.h>

#include "pile.h"
#include "spatial/vec.h"
#include "support/seed.h"

namespace robomosp::conformance {
namespace {

const std::string kFile = std::string(ROBOMOSP_PLUGIN_DIR) + "/physics_ode.so";

/// Boxes that fall onto each other and come to rest, over a floor and beside a moving wall.
std::vector<std::vector<Pose>> heap(const char* piles_from, int steps) {
  const auto found = find_provider<PhysicsEngine>(kFile, "ode");
  EXPECT_TRUE(found.ok());
  const auto engine = create<PhysicsEngine>(**found);
  TableParams params(**found);
  params.set("piles_from", std::string(piles_from));
  Random random(3);
  std::vector<PhysicsBody> bodies{floor_body(), box_body(0, {0.1, 1, 1}, shift(-0.3, 0, 0.5))};
  bodies[1].mass = {};
  for (int i = 0; i < 12; ++i) {
    const Pose turn =
        multiply(turn_x(random.uniform(-0.2, 0.2)), turn_y(random.uniform(-0.2, 0.2)));
    bodies.push_back(
        box_body(0.5 + 0.1 * i, {0.1, 0.12, 0.08},
                 multiply(shift(0.11 * (i % 2), 0.05 * (i % 3), 0.06 + 0.05 * i), turn)));
    bodies.back().mass.com = {0.005, -0.004, 0.003};
    bodies.back().friction = 0.1 * i;
    bodies.back().restitution = i % 4 == 0 ? 0.3 : 0;
    bodies.back().angular_velocity = {0.5, -0.3, 2};
  }
  auto world = engine->create(bodies, {}, {0, 0, -9.81}, params);
  EXPECT_TRUE(world.ok()) << world.error().sentence();
  NoProgress none;
  std::vector<std::vector<Pose>> all;
  for (int i = 0; i < steps; ++i) {
    EXPECT_TRUE((*world)->move(1, shift(-0.3 + 2e-4 * i, 0, 0.5), {0.2, 0, 0}, {}).ok());
    EXPECT_TRUE((*world)->push(4, {0, 1, 2}, {0.01, 0, 0.02}).ok());
    EXPECT_TRUE((*world)->step(1e-3, 1, {}, none).ok());
    std::vector<Pose> poses(bodies.size());
    EXPECT_TRUE((*world)->read({sizeof(PhysicsState), poses, {}, {}, {}, {}}).ok());
    all.push_back(std::move(poses));
  }
  return all;
}

TEST(OdePiles, MoveAsByTheEnginesOwnExactSolver) {
  // Chaos makes of rounding what it likes after a while.
  const auto sparse = heap("0", 150), dense = heap("1000000", 150);
  double most = 0, moved = 0;
  for (std::size_t t = 0; t < sparse.size(); ++t)
    for (std::size_t b = 0; b < sparse[t].size(); ++b) {
      most = std::max(most, position_gap(sparse[t][b], dense[t][b]));
      moved = std::max(moved, position_gap(sparse[t][b], sparse[0][b]));
    }
  EXPECT_LT(most, 1e-6);
  EXPECT_GT(moved, 0.05);
}

TEST(OdePiles, GiveEqualBitsInEqualRuns) {
  const auto one = heap("0", 300), other = heap("0", 300);
  for (std::size_t t = 0; t < one.size(); ++t)
    for (std::size_t b = 0; b < one[t].size(); ++b) {
      ASSERT_EQ(one[t][b].p, other[t][b].p);
      ASSERT_EQ(one[t][b].R, other[t][b].R);
    }
}

/// J v of a row.
double gap_speed(const std::vector<physics_ode::PileBody>& bodies,
                 const physics_ode::PileContact& c, std::size_t row) {
  const auto of = [&](std::int32_t body, const Vec3& arm) {
    if (body < 0) return 0.0;
    const auto& b = bodies[static_cast<std::size_t>(body)];
    return spatial::dot(c.axis[row], spatial::add(b.v, spatial::cross(b.w, arm)));
  };
  return of(c.a, c.arm_a) - of(c.b, c.arm_b);
}

TEST(OdePiles, FulfilWhatContactsDemand) {
  Random random(test::seed());
  const auto vector = [&](double most) {
    const auto x = random.vector(3, -most, most);
    return Vec3{x[0], x[1], x[2]};
  };
  for (int round = 0; round < 60; ++round) {
    const auto count = static_cast<std::size_t>(random.uniform(1, 25));
    std::vector<physics_ode::PileBody> bodies(count);
    for (auto& b : bodies) {
      b.mass = std::pow(10.0, random.uniform(-1, 1));
      const double i = 0.01 * b.mass, x = random.uniform(-0.3, 0.3) * i;
      b.inertia = {i, x, 0, x, 2 * i, 0, 0, 0, 1.5 * i};
      b.v = vector(0.1), b.w = vector(0.1);
      b.v_free = spatial::add(b.v, vector(0.05)), b.w_free = b.w;
    }
    std::vector<physics_ode::PileContact> contacts(count * 5);
    for (auto& c : contacts) {
      c.a = static_cast<std::int32_t>(random.uniform(0, static_cast<double>(count)));
      c.b = std::max(-1, c.a - static_cast<std::int32_t>(random.uniform(1, 5)));
      if (random.uniform(0, 1) < 0.3) std::swap(c.a, c.b);
      Vec3 n = vector(1), t = vector(1);
      n = spatial::scale(n, 1 / spatial::norm(n));
      t = spatial::cross(n, t);
      t = spatial::scale(t, 1 / spatial::norm(t));
      c.axis = {n, t, spatial::cross(n, t)};
      c.arm_a = vector(0.1), c.arm_b = vector(0.1);
      c.target = {random.uniform(0, 0.05), round % 2 ? random.uniform(-0.1, 0.1) : 0, 0};
      c.soft = 1e-4, c.soft_across = 1e-5;
      c.friction = round % 3 == 0 ? 0 : random.uniform(0, 1);
    }
    auto smooth_bodies = bodies;
    auto smooth = contacts;
    for (auto& c : smooth) c.friction = 0;
    ASSERT_TRUE(physics_ode::solve_pile(smooth_bodies, smooth, 1e8)) << round;
    ASSERT_TRUE(physics_ode::solve_pile(bodies, contacts, 1e8)) << round;
    double most = 0;
    std::vector<Vec3> force(count), torque(count);
    for (std::size_t k = 0; k < contacts.size(); ++k) {
      const auto& c = contacts[k];
      for (std::size_t r = 0; r < 3; ++r) most = std::max(most, std::fabs(c.impulse[r]));
    }
    const double eps = 1e-7 * most, slow = 1e-9;
    for (std::size_t k = 0; k < contacts.size(); ++k) {
      const auto& c = contacts[k];
      for (std::size_t r = 0; r < 3; ++r) {
        const double p = c.impulse[r];
        const double high =
            r == 0 ? std::numeric_limits<double>::infinity() : c.friction * smooth[k].impulse[0];
        const double low = r == 0 ? 0 : -high;
        const double left =
            gap_speed(bodies, c, r) + (r == 0 ? c.soft : c.soft_across) * p - c.target[r];
        ASSERT_GE(p, low - eps) << round << ", contact " << k;
        ASSERT_LE(p, high + eps) << round << ", contact " << k;
        // It gives way where it is not at a limit, and a limit holds it back from that only.
        if (p > low + eps) {
          ASSERT_LE(left, slow) << round << ", contact " << k << ", row " << r;
        }
        if (p < high - eps) {
          ASSERT_GE(left, -slow) << round << ", contact " << k << ", row " << r;
        }
        const Vec3 push = spatial::scale(c.axis[r], p);
        const auto give = [&](std::int32_t body, const Vec3& arm, double sign) {
          if (body < 0) return;
          const auto b = static_cast<std::size_t>(body);
          force[b] = spatial::add(force[b], spatial::scale(push, sign));
          torque[b] = spatial::add(torque[b], spatial::scale(spatial::cross(arm, push), sign));
        };
        give(c.a, c.arm_a, 1), give(c.b, c.arm_b, -1);
      }
    }
    for (std::size_t b = 0; b < count; ++b) {
      const auto& x = bodies[b];
      const Vec3 gain = spatial::sub(x.w, x.w_free);
      for (std::size_t k = 0; k < 3; ++k) {
        ASSERT_NEAR(x.mass * (x.v[k] - x.v_free[k]), force[b][k], eps);
        ASSERT_NEAR(x.inertia[3 * k] * gain[0] + x.inertia[3 * k + 1] * gain[1] +
                        x.inertia[3 * k + 2] * gain[2],
                    torque[b][k], eps);
      }
    }
  }
}

TEST(OdePiles, RefuseWhatIsNoNumberOrTooMuchWork) {
  std::vector<physics_ode::PileBody> bodies(2);
  for (auto& b : bodies) b.mass = 1, b.inertia = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  std::vector<physics_ode::PileContact> contacts(1);
  contacts[0].a = 0, contacts[0].b = 1;
  contacts[0].axis = {Vec3{0, 0, 1}, Vec3{1, 0, 0}, Vec3{0, 1, 0}};
  contacts[0].soft = contacts[0].soft_across = 1e-4;
  contacts[0].target = {0.1, 0, 0};
  EXPECT_FALSE(physics_ode::solve_pile(bodies, contacts, 1));
  EXPECT_TRUE(physics_ode::solve_pile(bodies, contacts, 1e4));
  EXPECT_NEAR(contacts[0].impulse[0], 0.1 / (2 + 1e-4), 1e-12);
  for (const double x : {std::nan(""), std::numeric_limits<double>::infinity(), 1e300}) {
    auto wrong = contacts;
    wrong[0].target[0] = x;
    auto some = bodies;
    if (physics_ode::solve_pile(some, wrong, 1e4)) {
      EXPECT_TRUE(std::isfinite(some[0].v[2])) << x;
    }
  }
}

}  // namespace
}  // namespace robomosp::conformance
