// SPDX-License-Identifier: Apache-2.0
// What surfaces that bound no clean solid enclose, against closed forms.
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "spatial/mass.h"
#include "spatial/surface_moments.h"
#include "spatial/vec.h"

namespace robomosp::spatial {
namespace {

struct Triangles {
  std::vector<double> points;
  std::vector<std::uint32_t> triangles;

  void add(const Triangles& other) {
    const auto base = static_cast<std::uint32_t>(points.size() / 3);
    points.insert(points.end(), other.points.begin(), other.points.end());
    for (const std::uint32_t v : other.triangles) triangles.push_back(base + v);
  }
  void turn() {
    for (std::size_t i = 0; i + 2 < triangles.size(); i += 3)
      std::swap(triangles[i], triangles[i + 1]);
  }
  [[nodiscard]] SurfaceMoments moments() const { return surface_moments(points, triangles); }
};

/// Every face has its own corners; the last two triangles are those of +x.
Triangles box(Vec3 low, Vec3 high) {
  Triangles m;
  const int faces[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                           {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  for (const auto& face : faces) {
    const auto base = static_cast<std::uint32_t>(m.points.size() / 3);
    for (const int v : face)
      for (std::size_t k = 0; k < 3; ++k) m.points.push_back((v >> k) & 1 ? high[k] : low[k]);
    for (const std::uint32_t i : {0U, 1U, 2U, 0U, 2U, 3U}) m.triangles.push_back(base + i);
  }
  return m;
}

Triangles ball(double radius, int rows) {
  Triangles m;
  const int around = 2 * rows;
  for (int r = 0; r <= rows; ++r)
    for (int k = 0; k < around; ++k) {
      const double t = std::numbers::pi * r / rows, f = 2 * std::numbers::pi * k / around;
      const double across = r == 0 || r == rows ? 0 : std::sin(t);
      for (const double x : {across * std::cos(f), across * std::sin(f), std::cos(t)})
        m.points.push_back(radius * x);
    }
  const auto at = [&](int r, int k) { return static_cast<std::uint32_t>(r * around + k % around); };
  for (int r = 0; r < rows; ++r)
    for (int k = 0; k < around; ++k) {
      if (r + 1 < rows)
        for (const std::uint32_t v : {at(r, k), at(r + 1, k), at(r + 1, k + 1)})
          m.triangles.push_back(v);
      if (r > 0)
        for (const std::uint32_t v : {at(r, k), at(r + 1, k + 1), at(r, k + 1)})
          m.triangles.push_back(v);
    }
  return m;
}

void expect_box(const SurfaceMoments& s, Vec3 low, Vec3 high, double tolerance) {
  const Vec3 size = sub(high, low), middle = scale(add(low, high), 0.5);
  const double volume = size[0] * size[1] * size[2];
  EXPECT_NEAR(s.moments.volume, volume, tolerance * volume);
  for (std::size_t k = 0; k < 3; ++k)
    EXPECT_NEAR(s.moments.first[k], volume * middle[k], tolerance * volume);
  EXPECT_NEAR(s.moments.second.xx, volume * (size[0] * size[0] / 12 + middle[0] * middle[0]),
              tolerance * volume);
  EXPECT_NEAR(s.moments.second.yz, volume * middle[1] * middle[2], tolerance * volume);
}

TEST(SurfaceMoments, AClosedBoxIsExactWhereverItStands) {
  const Vec3 low{10, -2, 3}, high{11, 0.5, 3.25};
  const SurfaceMoments s = box(low, high).moments();
  expect_box(s, low, high, 1e-9);
  EXPECT_TRUE(s.faults.empty());
  EXPECT_FALSE(s.is_hull);
  EXPECT_EQ(state_in_words(s), "");
  EXPECT_NEAR(s.moments.area, 2 * (1 * 2.5 + 1 * 0.25 + 2.5 * 0.25), 1e-12);
  EXPECT_LT(s.moments.relative_error, 1e-3);
}

TEST(SurfaceMoments, APlaneHoleLeavesNothingUnsure) {
  Triangles m = box({0, 0, 0}, {1, 2, 3});
  m.triangles.resize(m.triangles.size() - 6);
  const SurfaceMoments s = m.moments();
  expect_box(s, {0, 0, 0}, {1, 2, 3}, 1e-12);
  EXPECT_EQ(s.open_edges, 4U);
  ASSERT_EQ(s.faults.size(), 1U);
  EXPECT_EQ(s.faults[0].line.size(), 4U);
  EXPECT_LT(norm(sub(s.faults[0].at, {1, 1, 1.5})), 1e-12) << "the middle of the missing face";
  EXPECT_EQ(s.faults[0].size, 3);
  EXPECT_LT(s.moments.relative_error, 1e-3);
  EXPECT_EQ(state_in_words(s), "open along 4 edges");
}

TEST(SurfaceMoments, ACurvedHoleIsBoundedByTheHullOfItsRim) {
  // A cap is missing whose rim is not flat: one row down on one half, two on the other.
  Triangles m = ball(1, 40);
  const SurfaceMoments whole = m.moments();
  Triangles open = m;
  open.triangles.clear();
  for (std::size_t i = 0; i + 2 < m.triangles.size(); i += 3) {
    double z = 0, x = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      x += m.points[3 * m.triangles[i + k]] / 3;
      z += m.points[3 * m.triangles[i + k] + 2] / 3;
    }
    if (z > (x > 0 ? 0.95 : 0.9)) continue;
    open.triangles.insert(open.triangles.end(), m.triangles.begin() + static_cast<long>(i),
                          m.triangles.begin() + static_cast<long>(i) + 3);
  }
  const SurfaceMoments s = open.moments();
  const double off = std::fabs(s.moments.volume - whole.moments.volume) / whole.moments.volume;
  EXPECT_GT(off, 1e-4);
  EXPECT_LT(off, 0.05);
  EXPECT_GT(s.moments.relative_error, 2e-3) << "the rim is not flat";
  EXPECT_FALSE(s.is_hull);
}

TEST(SurfaceMoments, WhatIsEnclosedTwiceCountsOnce) {
  // Half of each cube of 1 is in the other: two thirds of the sum remain.
  Triangles m = box({0, 0, 0}, {1, 1, 1});
  m.add(box({0.5, 0, 0}, {1.5, 1, 1}));
  const SurfaceMoments s = m.moments();
  EXPECT_NEAR(s.moments.volume, 1.5, 1.5 * s.moments.relative_error);
  EXPECT_LT(s.moments.relative_error, 0.05);
  EXPECT_NEAR(s.moments.volume, 1.5, 0.02);
  EXPECT_NEAR(s.moments.first[0] / s.moments.volume, 0.75, 0.01);
  EXPECT_NEAR(s.overlap, 0.5, 0.02);
  ASSERT_EQ(s.faults.size(), 1U);
  EXPECT_EQ(s.faults[0].kind, SurfaceFault::Kind::overlap);
  EXPECT_GT(s.faults[0].at[0], 0.5);
  EXPECT_LT(s.faults[0].at[0], 1.0);
}

TEST(SurfaceMoments, PiecesAreTurnedOutwardsAndCavitiesStay) {
  Triangles outside_in = box({0, 0, 0}, {1, 1, 1});
  outside_in.turn();
  outside_in.add(box({2, 0, 0}, {3, 1, 1}));
  EXPECT_NEAR(outside_in.moments().moments.volume, 2, 1e-9);
  Triangles cavity = box({0.25, 0.25, 0.25}, {0.75, 0.75, 0.75});
  cavity.turn();
  cavity.add(box({0, 0, 0}, {1, 1, 1}));
  const SurfaceMoments s = cavity.moments();
  EXPECT_NEAR(s.moments.volume, 0.875, 1e-9);
  EXPECT_EQ(s.overlap, 0);
}

TEST(SurfaceMoments, TurnedTrianglesAndFacesWithTwoSidesAreUnderstood) {
  Triangles m = box({0, 0, 0}, {1, 2, 3});
  std::swap(m.triangles[4], m.triangles[5]);
  std::swap(m.triangles[16], m.triangles[17]);
  SurfaceMoments s = m.moments();
  expect_box(s, {0, 0, 0}, {1, 2, 3}, 1e-12);
  EXPECT_EQ(s.turned, 2U);
  EXPECT_TRUE(s.faults.empty());
  EXPECT_EQ(s.triangles, box({0, 0, 0}, {1, 2, 3}).triangles);

  Triangles both = box({0, 0, 0}, {1, 2, 3}), back = both;
  back.turn();
  both.add(back);
  s = both.moments();
  expect_box(s, {0, 0, 0}, {1, 2, 3}, 1e-12);
}

TEST(SurfaceMoments, WhatEnclosesNothingSure_IsItsHull) {
  // Three walls that meet in a corner: nobody knows where the others would be.
  Triangles m = box({0, 0, 0}, {1, 1, 1});
  std::vector<std::uint32_t> three;
  for (const std::size_t face : {0U, 2U, 4U})
    three.insert(three.end(), m.triangles.begin() + static_cast<long>(6 * face),
                 m.triangles.begin() + static_cast<long>(6 * face) + 6);
  m.triangles = three;
  const SurfaceMoments s = m.moments();
  EXPECT_TRUE(s.is_hull);
  EXPECT_EQ(s.moments.relative_error, 1);
  // The hull of seven corners of a cube lacks a sixth of it.
  EXPECT_NEAR(s.moments.volume, 5.0 / 6, 1e-9);
}

TEST(SurfaceMoments, FlatEmptyAndTinyAreNoError) {
  EXPECT_EQ(Triangles{}.moments().moments.volume, 0);
  EXPECT_FALSE(Triangles{}.moments().moments.exact);
  const Triangles sheet{{0, 0, 0, 1, 0, 0, 0, 1, 0}, {0, 1, 2}};
  EXPECT_EQ(sheet.moments().moments.volume, 0);
  EXPECT_EQ(sheet.moments().open_edges, 3U);
  const Triangles point{{0, 0, 0}, {0, 0, 0}};
  EXPECT_EQ(point.moments().moments.volume, 0);
  const SurfaceMoments tiny = box({0, 0, 0}, {1e-9, 1e-9, 1e-9}).moments();
  EXPECT_NEAR(tiny.moments.volume, 1e-27, 1e-36);
}

TEST(SurfaceMoments, ABallIsWhatItsTrianglesSay) {
  const SurfaceMoments s = ball(2, 60).moments();
  const double volume = 4 * std::numbers::pi * 8 / 3;
  EXPECT_NEAR(s.moments.volume / volume, 1, 3e-3);
  EXPECT_NEAR(s.moments.second.xx / (volume * 4 / 5), 1, 6e-3);
  EXPECT_TRUE(s.faults.empty());
  EXPECT_EQ(s.open_edges, 0U);
}

}  // namespace
}  // namespace robomosp::spatial
