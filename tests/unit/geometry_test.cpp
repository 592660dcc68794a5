// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include <gtest/gtest.h>

#include <robomosp/sdk/csg_scale.h>

#include "geometry/mesh_checks.h"
#include "geometry/mesh_mass.h"
#include "spatial/mass.h"

namespace robomosp::geometry {
namespace {

// A box between two corners; every face has its own four vertices, as display meshes have.
Mesh box(Vec3 low, Vec3 high) {
  Mesh m;
  const int faces[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                           {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  for (const auto& face : faces) {
    const auto base = static_cast<std::uint32_t>(m.vertex_count());
    for (const int v : face)
      for (std::size_t k = 0; k < 3; ++k)
        m.positions.push_back(static_cast<float>((v >> k) & 1 ? high[k] : low[k]));
    for (const std::uint32_t i : {0U, 1U, 2U, 0U, 2U, 3U}) m.triangles.push_back(base + i);
  }
  m.normals.assign(m.positions.size(), 0.0F);
  return m;
}

void append(Mesh& a, const Mesh& b) {
  const auto base = static_cast<std::uint32_t>(a.vertex_count());
  a.positions.insert(a.positions.end(), b.positions.begin(), b.positions.end());
  for (const std::uint32_t v : b.triangles) a.triangles.push_back(base + v);
}

TEST(CsgScale, AreasOfEllipsoidsAreTheIntegralsOfTheirNormals) {
  // By midpoints, which around converge at once and along by the square of their number.
  const auto area = [](double x, double y, double z) {
    const int n = 4000;
    const double pi = 3.14159265358979323846;
    double sum = 0;
    for (int i = 0; i < n; ++i)
      for (int k = 0; k < 200; ++k) {
        const double t = pi * ((i + 0.5) / n - 0.5), f = 2 * pi * k / 200;
        const double c = std::cos(t);
        const double a = y * z * c * std::cos(f), b = x * z * c * std::sin(f),
                     d = x * y * std::sin(t);
        sum += std::sqrt(a * a + b * b + d * d) * c;
      }
    return sum * (pi / n) * (2 * pi / 200);
  };
  for (const Vec3 r : {Vec3{3, 2, 1}, Vec3{1, 1, 2}, Vec3{2, 2, 1}, Vec3{1, 1.001, 0.999}})
    EXPECT_NEAR(ellipsoid_area(r[0], r[1], r[2]) / area(r[0], r[1], r[2]), 1, 2e-7)
        << r[0] << " " << r[1] << " " << r[2];
  EXPECT_EQ(ellipsoid_area(2, 2, 2), 16 * 3.14159265358979323846);
  EXPECT_NEAR(ellipsoid_area(5, 1, 3), ellipsoid_area(1, 3, 5), 1e-13);
}

TEST(CsgScale, MomentsAndPrimitivesAreStretched) {
  const auto of_box = [](double x, double y, double z) {
    Moments m;
    m.volume = x * y * z;
    m.area = 2 * (x * y + y * z + x * z);
    m.first = {m.volume * x / 2, m.volume * y / 2, m.volume * z / 2};  // from its corner
    m.second = {m.volume * x * x / 3, m.volume * y * y / 3, m.volume * z * z / 3,
                m.volume * x * y / 4, m.volume * y * z / 4, m.volume * x * z / 4};
    return m;
  };
  Moments before = of_box(1, 2, 3);
  before.exact = false;
  before.relative_error = 0.01;
  const Moments m = scaled_moments(before, {2, 0.5, 3}), want = of_box(2, 1, 9);
  EXPECT_NEAR(m.volume, want.volume, 1e-12);
  for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(m.first[k], want.first[k], 1e-12);
  EXPECT_NEAR(m.second.xx, want.second.xx, 1e-12);
  EXPECT_NEAR(m.second.yz, want.second.yz, 1e-12);
  EXPECT_NEAR(m.second.zz, want.second.zz, 1e-9);
  EXPECT_GE(m.area, want.area);
  EXPECT_FALSE(m.exact);
  EXPECT_EQ(m.relative_error, 0.01);

  CsgNode n;
  n.kind = CsgKind::cylinder;
  n.sizes = {1, 2};
  n.placement.p = {1, 1, 1};
  EXPECT_FALSE(scaled_primitive(n, {1, 2, 1})) << "it is elliptic";
  n.placement.R = {1, 0, 0, 0, 0, -1, 0, 1, 0};  // its axis along -y
  const auto along = scaled_primitive(n, {2, 3, 2});
  ASSERT_TRUE(along);
  EXPECT_EQ(along->sizes[0], 2);
  EXPECT_EQ(along->sizes[1], 6);
  EXPECT_EQ(along->placement.p, (Vec3{2, 3, 2}));
  n.placement.R = {0.8, -0.6, 0, 0.6, 0.8, 0, 0, 0, 1};
  EXPECT_FALSE(scaled_primitive(n, {2, 3, 2})) << "it would be sheared";
  EXPECT_TRUE(scaled_primitive(n, {2, 2, 2}));
}

TEST(MeshCheck, ABoxWithSeparateFacesIsClosedAndOnePiece) {
  const MeshReport r = check(box({0, 0, 0}, {1, 2, 3}));
  EXPECT_TRUE(r.is_closed) << r.problem;
  EXPECT_EQ(r.pieces, 1U);
  EXPECT_TRUE(r.problem.empty());
}

TEST(MeshCheck, AMissingTriangleLeavesThreeOpenEdges) {
  Mesh m = box({0, 0, 0}, {1, 1, 1});
  m.triangles.resize(m.triangles.size() - 3);
  const MeshReport r = check(m);
  EXPECT_FALSE(r.is_closed);
  EXPECT_EQ(r.open_edges, 3U);
}

TEST(MeshCheck, ATurnedTriangleIsNotClosed) {
  Mesh m = box({0, 0, 0}, {1, 1, 1});
  std::swap(m.triangles[0], m.triangles[1]);
  const MeshReport r = check(m);
  EXPECT_FALSE(r.is_closed);
  EXPECT_EQ(r.bad_edges, 3U);
}

TEST(MeshCheck, PiecesAreCounted) {
  Mesh m = box({0, 0, 0}, {1, 1, 1});
  append(m, box({2, 0, 0}, {3, 1, 1}));
  EXPECT_EQ(check(m).pieces, 2U);
  EXPECT_TRUE(check(m).is_closed);
}

TEST(MeshCheck, BoxesThatTouchAlongAnEdgeAreClosed) {
  Mesh m = box({0, 0, 0}, {1, 1, 1});
  append(m, box({1, 1, 0}, {2, 2, 1}));
  const MeshReport r = check(m);
  EXPECT_TRUE(r.is_closed) << r.problem;
  const auto moved = moments(m);
  ASSERT_TRUE(moved.ok()) << moved.error().sentence();
  EXPECT_NEAR(moved->volume, 2, 1e-12);
  EXPECT_NEAR(moved->first[0], 0.5 + 1.5, 1e-12);
}

TEST(MeshCheck, AMeshGivenTwiceIsNotClosed) {
  Mesh m = box({0, 0, 0}, {1, 1, 1});
  append(m, box({0, 0, 0}, {1, 1, 1}));
  EXPECT_EQ(check(m).bad_edges, 18U);
}

TEST(MeshCheck, BrokenMeshesAreToldApart) {
  EXPECT_FALSE(check(Mesh{}).is_closed);
  Mesh m = box({0, 0, 0}, {1, 1, 1});
  m.triangles[4] = 99;
  EXPECT_EQ(check(m).problem, "a triangle refers to vertex 99 of 24.");
  m = box({0, 0, 0}, {1, 1, 1});
  m.positions[5] = std::nanf("");
  EXPECT_EQ(check(m).problem, "a vertex of the mesh is not a finite number.");
}

TEST(MeshBounds, AreTheCorners) {
  const auto b = *bounds(box({-1, 0.5, 2}, {1, 2, 3}));
  EXPECT_EQ(b[0], (Vec3{-1, 0.5, 2}));
  EXPECT_EQ(b[1], (Vec3{1, 2, 3}));
  EXPECT_FALSE(bounds(Mesh{}).has_value());
}

// Box a, b, c about its middle: m (b^2 + c^2) / 12, independent of where the box stands.
TEST(MeshMass, OfABoxFarAwayEqualsTheFormula) {
  const Vec3 low{100, -50, 20}, high{100.5, -49.75, 22};
  const auto m = moments(box(low, high));
  ASSERT_TRUE(m.ok()) << m.error().sentence();
  const MassProperties p = spatial::mass_properties(*m, 1000);
  EXPECT_NEAR(m->volume, 0.25, 1e-14);
  EXPECT_NEAR(m->area, 2 * (0.5 * 0.25 + 0.5 * 2 + 0.25 * 2), 1e-13);
  EXPECT_NEAR(p.mass, 250, 1e-11);
  EXPECT_NEAR(p.com[0], 100.25, 1e-12);
  EXPECT_NEAR(p.com[1], -49.875, 1e-12);
  EXPECT_NEAR(p.com[2], 21, 1e-12);
  // Second moments about a far origin cancel: 250 kg * (100 m)^2 leaves nine digits.
  EXPECT_NEAR(p.inertia.xx, 250.0 / 12 * (0.25 * 0.25 + 4), 1e-8);
  EXPECT_NEAR(p.inertia.yy, 250.0 / 12 * (0.5 * 0.5 + 4), 1e-8);
  EXPECT_NEAR(p.inertia.zz, 250.0 / 12 * (0.5 * 0.5 + 0.25 * 0.25), 1e-8);
  EXPECT_NEAR(p.inertia.xy, 0, 1e-8);
}

TEST(MeshMass, OfACavityIsSubtracted) {
  Mesh m = box({0, 0, 0}, {1, 1, 1});
  Mesh hole = box({0.25, 0.25, 0.25}, {0.75, 0.75, 0.75});
  for (std::size_t t = 0; t < hole.triangles.size(); t += 3)
    std::swap(hole.triangles[t], hole.triangles[t + 1]);
  append(m, hole);
  const auto r = moments(m);
  ASSERT_TRUE(r.ok());
  EXPECT_NEAR(r->volume, 1 - 0.125, 1e-15);
}

TEST(MeshMass, OpenAndInsideOutMeshesAreRefused) {
  Mesh open = box({0, 0, 0}, {1, 1, 1});
  open.triangles.resize(30);
  EXPECT_FALSE(moments(open).ok());
  Mesh inside_out = box({0, 0, 0}, {1, 1, 1});
  for (std::size_t t = 0; t < inside_out.triangles.size(); t += 3)
    std::swap(inside_out.triangles[t], inside_out.triangles[t + 1]);
  EXPECT_FALSE(moments(inside_out).ok());
}

TEST(MeshMass, TheErrorStatedBoundsThatOfATurnedPrismOfManySides) {
  // A prism with n sides within a cylinder: sides r (1 - cos(pi/n)) from it at most.
  const double r = 0.05, h = 0.2, pi = 3.14159265358979323846;
  for (const int n : {8, 32, 128}) {
    Mesh m;
    const auto add_point = [&](double x, double y, double z) {
      for (const double v : {x, y, z}) m.positions.push_back(static_cast<float>(v));
    };
    add_point(0, 0, 0);
    add_point(0, 0, h);
    for (int i = 0; i < n; ++i)
      for (const double z : {0.0, h})
        add_point(r * std::cos(2 * pi * i / n), r * std::sin(2 * pi * i / n), z);
    for (int i = 0; i < n; ++i) {
      const auto a = static_cast<std::uint32_t>(2 + 2 * i),
                 b = static_cast<std::uint32_t>(2 + 2 * ((i + 1) % n));
      for (const std::uint32_t v : {0U, b, a, 1U, a + 1, b + 1, a, b, b + 1, a, b + 1, a + 1})
        m.triangles.push_back(v);
    }
    m.normals.assign(m.positions.size(), 0.0F);
    const auto got = moments(m, r * (1 - std::cos(pi / n)));
    ASSERT_TRUE(got.ok()) << got.error().sentence();
    const double volume = pi * r * r * h, error = (volume - got->volume) / volume;
    EXPECT_LE(error, got->relative_error) << n;
    EXPECT_GT(error, 0.1 * got->relative_error) << "the bound is not far off, " << n;
  }
  // Without a deviation it is what rounding to float makes.
  const auto flat = moments(box({0.1, 0.1, 0.1}, {0.2, 0.2, 0.2}));
  EXPECT_LE(std::abs(flat->volume - 0.001) / 0.001, flat->relative_error);
  EXPECT_LT(flat->relative_error, 1e-5);
}

}  // namespace
}  // namespace robomosp::geometry
