// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/scene/surface.h"

#include <cmath>

#include <gtest/gtest.h>

#include "viewer/scene/linear.h"
#include "viewer/synthetic.h"

namespace robomosp::viewer {
namespace {

double length_of(const std::vector<float>& segments) {
  double sum = 0;
  for (std::size_t i = 0; i + 5 < segments.size(); i += 6)
    sum += std::hypot(segments[i] - segments[i + 3], segments[i + 1] - segments[i + 4],
                      segments[i + 2] - segments[i + 5]);
  return sum;
}

TEST(Surface, ABareBoxGetsFlatNormalsAndItsTwelveEdges) {
  Mesh bare = *synthetic::box(1, 2, 3);
  bare.normals.clear();
  bare.edge_points.clear();
  bare.edge_sizes.clear();
  const Surface s = surface_of(bare);
  // The face diagonals are no edges: 4 (1 + 2 + 3) m remain.
  EXPECT_NEAR(length_of(s.segments), 24, 1e-5);
  ASSERT_EQ(s.normals.size(), s.positions.size());
  for (std::size_t t = 0; t < s.triangles.size(); ++t) {
    const std::size_t v = 3 * std::size_t{s.triangles[t]};
    const Vec3 n{s.normals[v], s.normals[v + 1], s.normals[v + 2]};
    // Flat: along one axis and outwards.
    const double along = std::max({std::abs(n[0]), std::abs(n[1]), std::abs(n[2])});
    EXPECT_NEAR(along, 1, 1e-6);
    EXPECT_GT(n[0] * s.positions[v] + n[1] * s.positions[v + 1] + n[2] * s.positions[v + 2], 0);
  }
}

TEST(Surface, ABareSphereIsSmoothAndHasNoEdges) {
  Mesh bare = *synthetic::sphere(0.5, 4000);
  bare.normals.clear();
  bare.edge_sizes.clear();
  const Surface s = surface_of(bare);
  EXPECT_TRUE(s.segments.empty());
  for (std::size_t i = 0; i + 2 < s.positions.size(); i += 3) {
    const Vec3 p{s.positions[i], s.positions[i + 1], s.positions[i + 2]};
    const Vec3 n{s.normals[i], s.normals[i + 1], s.normals[i + 2]};
    // Zero-area triangles at the poles carry no direction of their own.
    if (std::abs(p[2]) > 0.499) continue;
    EXPECT_GT(dot(p, n) / norm(p), 0.995);
  }
}

TEST(Surface, BadNumbersAndIndicesAreLeftOut) {
  Mesh mesh = *synthetic::box(1, 1, 1);
  mesh.triangles.insert(mesh.triangles.end(), {0, 1, 999999});
  mesh.triangles.push_back(0);
  mesh.positions.insert(mesh.positions.end(), {NAN, 0.0F, 0.0F});
  mesh.normals.insert(mesh.normals.end(), {0.0F, 0.0F, 1.0F});
  mesh.triangles.insert(mesh.triangles.begin(), {0, 1, 24});
  mesh.edge_sizes.push_back(1000);
  const Surface s = surface_of(mesh);
  EXPECT_EQ(s.triangles.size(), 36U);
  EXPECT_NEAR(length_of(s.segments), 12, 1e-5);
  EXPECT_DOUBLE_EQ(s.high[0], 0.5);
}

TEST(Surface, RaysHitASphereAtTheDistanceOfGeometry) {
  const Surface s = surface_of(*synthetic::sphere(1, 20000));
  for (const double offset : {0.0, 0.3, 0.9}) {
    const auto hit = first_hit(s, {-5, offset, 0.1}, {1, 0, 0});
    ASSERT_TRUE(hit);
    EXPECT_NEAR(*hit, 5 - std::sqrt(1 - offset * offset - 0.01), 3e-3);
  }
  EXPECT_FALSE(first_hit(s, {-5, 1.01, 0}, {1, 0, 0}));
  EXPECT_FALSE(first_hit(s, {-5, 0, 0}, {-1, 0, 0}));
}

TEST(Surface, AnEmptyMeshIsNothing) {
  const Surface s = surface_of(Mesh{});
  EXPECT_TRUE(s.triangles.empty());
  EXPECT_FALSE(first_hit(s, {0, 0, 5}, {0, 0, -1}));
}

}  // namespace
}  // namespace robomosp::viewer
