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

double area_of(const Cut& cut) {
  double sum = 0;
  const auto at = [&](std::uint32_t i) {
    return Vec3{cut.positions[3 * i], cut.positions[3 * i + 1], cut.positions[3 * i + 2]};
  };
  for (std::size_t t = 0; t + 2 < cut.triangles.size(); t += 3) {
    const Vec3 a = at(cut.triangles[t]);
    sum += 0.5 * norm(cross(at(cut.triangles[t + 1]) - a, at(cut.triangles[t + 2]) - a));
  }
  return sum;
}

/// Area of a regular polygon with `sides` corners on a circle.
double polygon(double radius, int sides) {
  return 0.5 * sides * radius * radius * std::sin(2 * std::acos(-1.0) / sides);
}

TEST(Cut, ATubeIsCutToARingWithAFreeHole) {
  const int sides = 96;
  const Surface tube =
      surface_of(*synthetic::lathe({{0.03, 0}, {0.06, 0}, {0.06, 0.1}, {0.03, 0.1}, {0.03, 0}}));
  const Cut ring = cut_of(tube, {}, {0, 0, 0.05}, {0, 0, 1});
  const double wanted = polygon(0.06, sides) - polygon(0.03, sides);
  EXPECT_NEAR(area_of(ring), wanted, 1e-5 * wanted);
  EXPECT_NEAR(length_of(ring.outline.ends),
              2 * sides * (0.06 + 0.03) * std::sin(std::acos(-1.0) / sides), 1e-5);
  // Lengthwise through the axis: two walls of 30 mm x 100 mm.
  const Cut walls = cut_of(tube, {}, {0, 0, 0}, {0, 1, 0});
  EXPECT_NEAR(area_of(walls), 2 * 0.03 * 0.1, 1e-6);
}

TEST(Cut, IsMovedWithItsBodyAndHasTheAreaOfAnyDirection) {
  // A plane through the middle of a unit cube across a diagonal cuts a hexagon of 3 sqrt(3) / 4.
  const Surface cube = surface_of(*synthetic::box(1, 1, 1));
  const Pose place = synthetic::turned({0, 0, 1}, 0.4, {5, -2, 1});
  const double n = 1 / std::sqrt(3.0);
  const Cut cut = cut_of(cube, place, place.p, rotate(place, {n, n, n}));
  EXPECT_NEAR(area_of(cut), 0.75 * std::sqrt(3.0), 1e-5);
  for (std::size_t i = 0; i + 2 < cut.positions.size(); i += 3)
    EXPECT_NEAR(dot(Vec3{cut.positions[i], cut.positions[i + 1], cut.positions[i + 2]} - place.p,
                    rotate(place, {n, n, n})),
                0, 1e-6);
  EXPECT_EQ(area_of(cut_of(cube, place, {0, 0, 9}, {0, 0, 1})), 0);
}

TEST(Cut, AFaceInThePlaneIsCutOnOneSideOnly) {
  const Surface cube = surface_of(*synthetic::box(1, 1, 1));
  const double above = area_of(cut_of(cube, {}, {0, 0, 0.5}, {0, 0, 1})),
               below = area_of(cut_of(cube, {}, {0, 0, 0.5}, {0, 0, -1}));
  EXPECT_NEAR(above + below, 1, 1e-6);
}

TEST(Cut, WhatIsNotClosedIsNotFilledBeyondItsSides) {
  Mesh open = *synthetic::box(1, 1, 1);
  open.triangles.resize(open.triangles.size() - 6);  // without the last face
  EXPECT_LE(area_of(cut_of(surface_of(open), {}, {}, {1, 0, 0})), 1 + 1e-6);
}

TEST(Contour, OfABoxIsAHexagonFromACornerAndASquareFromAbove) {
  const Surface cube = surface_of(*synthetic::box(1, 1, 1));
  const auto edges = edges_of(cube);
  EXPECT_EQ(edges.size(), 18U);  // twelve and a diagonal on each face
  const Segments corner = contour_of(cube, edges, {5, -4, 3}, true);
  EXPECT_NEAR(length_of(corner.ends), 6, 1e-6);
  EXPECT_NEAR(corner.along.back(), 6, 1e-5);  // joined to one line
  EXPECT_NEAR(length_of(contour_of(cube, edges, {0, 0, 1}, false).ends), 4, 1e-6);
}

TEST(TangentEdges, AreWhereFacesMeetSmoothly) {
  Mesh bent = *synthetic::box(1, 1, 1);
  bent.faces.clear();
  for (std::uint32_t f = 0; f < 6; ++f) bent.faces.push_back({2 * f, 2, f});
  Surface s = surface_of(bent);
  EXPECT_TRUE(tangent_edges_of(s, edges_of(s)).ends.empty());  // all of its edges are sharp
  // The two triangles of one face as faces of their own meet at their diagonal.
  s.face_of[0] = 100;
  EXPECT_NEAR(length_of(tangent_edges_of(s, edges_of(s)).ends), std::sqrt(2.0), 1e-6);
}

}  // namespace
}  // namespace robomosp::viewer
