// SPDX-License-Identifier: Apache-2.0
// Solids of revolution recognised by their triangles: which are and which are not, and that they
// roll as far as round ones.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <robomosp/sdk/conformance/provider.h>
#include <robomosp/sdk/physics.h>

#include "evaluation/round_meshes.h"
#include "evaluation/shapes.h"
#include "spatial/pose.h"

namespace robomosp::evaluation {
namespace {

constexpr double kRound = 2 * std::numbers::pi;
using RoundOutline = std::vector<std::array<double, 2>>;

/// Turned about z with an outline of radius and z, counter-clockwise, at angles; moved to `at`.
Mesh turned(const RoundOutline& outline, const std::vector<double>& angles, const Pose& at = {},
            double noise = 0) {
  Mesh m;
  std::mt19937 random(7);
  std::uniform_real_distribution<double> off(-noise, noise);
  std::vector<Vec3> points;
  for (const auto& [r, z] : outline)
    for (const double t : angles)
      points.push_back(spatial::transform(
          at, Vec3{r * std::cos(t) + off(random), r * std::sin(t) + off(random), z + off(random)}));
  const std::size_t n = angles.size();
  const auto corner = [&](std::size_t i, std::size_t k) {
    m.triangles.push_back(static_cast<std::uint32_t>(m.positions.size() / 3));
    for (const double x : points[(i % outline.size()) * n + k % n]) {
      m.positions.push_back(static_cast<float>(x));
      m.normals.push_back(0);
    }
  };
  for (std::size_t i = 0; i < outline.size(); ++i)
    for (std::size_t k = 0; k < n; ++k) {
      corner(i, k), corner(i, k + 1), corner(i + 1, k + 1);
      corner(i, k), corner(i + 1, k + 1), corner(i + 1, k);
    }
  return m;
}
std::vector<double> evenly(int n) {
  std::vector<double> out;
  for (int k = 0; k < n; ++k) out.push_back(kRound * k / n);
  return out;
}
Pose tilted() {
  Pose p = spatial::compose(spatial::translation({0.3, -0.2, 0.5}), spatial::rotation_z(0.7));
  const double c = std::cos(0.9), s = std::sin(0.9);
  Pose x;
  x.R = {1, 0, 0, 0, c, -s, 0, s, c};
  return spatial::compose(p, x);
}
RoundOutline ring(double r, double R, double half) {
  return {{r, -half}, {R, -half}, {R, half}, {r, half}};
}

TEST(RoundMeshes, CylindersWithBoresAreFoundWhereverTheyLie) {
  const double R = 0.1;
  // The height of sqrt(3) R has no axis by its moments.
  for (const double half : {0.02, 0.3, std::sqrt(3.0) / 2 * R})
    for (const double bore : {0.0, 0.05})
      for (const Pose& at : {Pose{}, tilted()}) {
        const MeshRoundness found = mesh_roundness(turned(ring(bore, R, half), evenly(48), at));
        ASSERT_TRUE(found.outside) << half << " " << bore;
        EXPECT_EQ(found.sides, 48U);
        ASSERT_EQ(found.outside->profile.size(), 2U);
        for (const auto& circle : found.outside->profile) EXPECT_NEAR(circle[0], R, 1e-6);
        EXPECT_EQ(found.outside->profile[0][0], found.outside->profile[1][0]);
        EXPECT_NEAR(found.outside->profile[1][1] - found.outside->profile[0][1], 2 * half, 1e-6);
        // The axis goes through the middle, along z of the mesh.
        const Pose& pose = found.outside->pose;
        const Vec3 z{pose.R[2], pose.R[5], pose.R[8]}, wanted{at.R[2], at.R[5], at.R[8]};
        EXPECT_NEAR(std::fabs(spatial::dot(z, wanted)), 1, 1e-10);
        EXPECT_LT(spatial::norm(spatial::cross(spatial::sub(pose.p, at.p), wanted)), 1e-6);
      }
}

TEST(RoundMeshes, WheelsConesAndSpheresAreFound) {
  const MeshRoundness wheel = mesh_roundness(
      turned({{0.05, -0.02}, {0.09, -0.02}, {0.1, -0.01}, {0.1, 0.01}, {0.09, 0.02}, {0.05, 0.02}},
             evenly(36), tilted()));
  ASSERT_TRUE(wheel.outside);
  EXPECT_EQ(wheel.outside->profile.size(), 4U);
  const MeshRoundness cone =
      mesh_roundness(turned({{0, 0}, {0.1, 0}, {0.04, 0.3}, {0, 0.3}}, evenly(32)));
  ASSERT_TRUE(cone.outside);
  EXPECT_EQ(cone.outside->profile.size(), 2U);
  for (const double low : {0.0, 0.3}) {  // with a bore of 0.3 R
    RoundOutline outline;
    const double from = std::asin(low);
    for (int i = 0; i <= 32; ++i) {
      const double t = from + (std::numbers::pi - 2 * from) * i / 32;
      outline.push_back({0.1 * std::sin(t), -0.1 * std::cos(t)});
    }
    const MeshRoundness ball = mesh_roundness(turned(outline, evenly(48), tilted()));
    ASSERT_TRUE(ball.outside) << low;
    EXPECT_NEAR(ball.outside->sphere, 0.1, 1e-6);
    EXPECT_LT(spatial::distance(ball.outside->pose.p, tilted().p), 1e-6);
  }
  // Scanned: 10 um beside it.
  const MeshRoundness rough =
      mesh_roundness(turned(ring(0.05, 0.1, 0.02), evenly(64), tilted(), 1e-5));
  EXPECT_TRUE(rough.outside);
}

TEST(RoundMeshes, PolygonsBoxesAndWhatIsNearlyRoundAreNot) {
  EXPECT_EQ(mesh_roundness(turned(ring(0, 0.1, 0.02), evenly(4))).sides, 0U);
  EXPECT_EQ(mesh_roundness(turned(ring(0.05, 0.1, 0.02), evenly(6))).sides, 0U) << "a nut";
  const MeshRoundness twelve = mesh_roundness(turned(ring(0.05, 0.1, 0.02), evenly(12)));
  EXPECT_FALSE(twelve.outside);
  EXPECT_EQ(twelve.sides, 12U);
  // A flat on a shaft, an oval, a half cylinder, a tetrahedron.
  std::vector<double> flat = evenly(48);
  flat.erase(flat.begin(), flat.begin() + 6);
  EXPECT_FALSE(mesh_roundness(turned(ring(0, 0.1, 0.02), flat)).outside);
  Mesh oval = turned(ring(0, 0.1, 0.02), evenly(48));
  for (std::size_t i = 0; i < oval.positions.size(); i += 3) oval.positions[i] *= 1.01F;
  EXPECT_FALSE(mesh_roundness(oval).outside);
  std::vector<double> half;
  for (int k = 0; k <= 24; ++k) half.push_back(kRound * k / 48);
  EXPECT_FALSE(mesh_roundness(turned(ring(0, 0.1, 0.02), half)).outside);
  EXPECT_FALSE(mesh_roundness(turned({{0, 0}, {0.1, 0}, {0, 0.2}}, evenly(3))).outside);
  // Nothing, a point, numbers that are none.
  EXPECT_FALSE(mesh_roundness(Mesh{}).outside);
  Mesh bad = turned(ring(0, 0.1, 0.02), evenly(48));
  bad.positions[4] = std::nanf("");
  EXPECT_FALSE(mesh_roundness(bad).outside);
}

TEST(RoundMeshes, ImportedSolidsHaveTheirOutside) {
  CsgTree tree;
  tree.nodes.resize(1);
  tree.nodes[0].kind = CsgKind::imported;
  tree.nodes[0].parent = -1;
  for (const int n : {48, 12, 6}) {
    const auto mesh =
        std::make_shared<const Mesh>(turned(ring(0.05, 0.1, 0.02), evenly(n), tilted()));
    const auto made = shape_pieces(
        tree, [&](const CsgTree&) -> Result<std::shared_ptr<const Mesh>> { return mesh; },
        [](const CsgTree&) -> Result<std::vector<Vec3>> { return std::vector<Vec3>{}; });
    ASSERT_TRUE(made.ok()) << made.error().sentence();
    ASSERT_EQ(made->size(), 1U);
    EXPECT_EQ(made->front().outside != nullptr, n == 48);
    EXPECT_EQ(made->front().sides, n == 6 ? 0U : static_cast<std::size_t>(n));
  }
}

// What rolls without slipping keeps its speed: 1 m/s for 2 s. A polygon of 40 sides rolls 1.2 m.
TEST(RoundMeshes, RollAsRoundOnes) {
  const auto found = conformance::find_provider<PhysicsEngine>(
      std::string(ROBOMOSP_PLUGIN_DIR) + "/physics_ode.so", "ode");
  ASSERT_TRUE(found.ok()) << found.error().sentence();
  const double R = 0.1;
  for (const double noise : {0.0, 1e-5}) {
    Pose lying;  // the mesh's own frame is tilted
    lying.R = {1, 0, 0, 0, 0, -1, 0, 1, 0};
    const Pose moved = spatial::compose(lying, spatial::inverse(tilted()));
    const Mesh mesh = turned(ring(0.05, R, 0.02), evenly(40), tilted(), noise);
    const MeshRoundness round = mesh_roundness(mesh);
    ASSERT_TRUE(round.outside);
    std::vector<PhysicsBody> bodies(2);
    Shape floor;
    floor.kind = ShapeKind::box;
    floor.sizes = {20, 20, 0.2};
    bodies[0].shape.shapes = {floor};
    bodies[0].pose.p = {0, 0, -0.1};
    Shape s;
    s.kind = ShapeKind::mesh;
    s.mesh = &mesh;
    s.pose = moved;
    set_outside(s, round.outside.get());
    bodies[1].shape.shapes = {s};
    bodies[1].mass = {1, {}, {3e-3, 5e-3, 3e-3, 0, 0, 0}};
    bodies[1].pose.p = {0, 0, R};
    bodies[1].velocity = {1, 0, 0};
    bodies[1].angular_velocity = {0, 1 / R, 0};
    const auto engine = conformance::create<PhysicsEngine>(**found);
    const conformance::TableParams params(**found);
    auto world = engine->create(bodies, {}, {0, 0, -9.81}, params);
    ASSERT_TRUE(world.ok()) << world.error().sentence();
    NoProgress none;
    ASSERT_TRUE((*world)->step(1e-3, 2000, {}, none).ok());
    std::vector<Pose> poses(2);
    ASSERT_TRUE((*world)->read({sizeof(PhysicsState), poses, {}, {}, {}, {}}).ok());
    EXPECT_NEAR(poses[1].p[0], 2, noise > 0 ? 0.02 : 1e-3) << noise;
    EXPECT_NEAR(poses[1].p[2], R, 1e-4);
  }
}

}  // namespace
}  // namespace robomosp::evaluation
