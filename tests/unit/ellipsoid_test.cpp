// SPDX-License-Identifier: Apache-2.0
// Ellipsoids as bodies of a picture: lengths, normals, and what is flat or endless.
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "scene/ellipsoid.h"

namespace robomosp::scene {
namespace {

TEST(DrawnEllipsoid, TheGreatestLengthIsTheSizeAndNothingIsFlatOrEndless) {
  const Vec3 flat = drawn_lengths({0.8, 0.4, 0}, 0.2);
  EXPECT_DOUBLE_EQ(flat[0], 0.2);
  EXPECT_DOUBLE_EQ(flat[1], 0.1);
  EXPECT_GT(flat[2], 0);
  EXPECT_LT(flat[2], 0.01);
  const Vec3 needle = drawn_lengths({1.25, 2.5, std::numeric_limits<double>::infinity()}, 0.2);
  EXPECT_DOUBLE_EQ(needle[2], 0.2);
  EXPECT_DOUBLE_EQ(needle[1], 0.1) << "endless counts as twice the greatest finite length";
  for (const double h : drawn_lengths({0, 0, 0}, 0.2)) EXPECT_GT(h, 0);
}

TEST(DrawnEllipsoid, ItsPointsAndNormalsAreThoseOfTheEllipsoid) {
  const Vec3 half{0.3, 0.2, 0.1};
  const render::Item item = ellipsoid_item(7, "e", Pose{}, half, {0, 0, 1, 0.5F});
  ASSERT_TRUE(item.mesh);
  const Mesh& m = *item.mesh;
  ASSERT_EQ(m.positions.size(), m.normals.size());
  double volume = 0;
  for (std::size_t v = 0; v < m.vertex_count(); ++v) {
    double on = 0, along = 0, length = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const double x = static_cast<double>(m.positions[3 * v + k]) / half[k];
      on += x * x;
      // The gradient of the quadric is along x / half.
      along += static_cast<double>(m.normals[3 * v + k]) * x / half[k];
      length += x * x / (half[k] * half[k]);
    }
    EXPECT_NEAR(on, 1, 1e-5);
    EXPECT_NEAR(along, std::sqrt(length), 1e-4);
  }
  for (std::size_t t = 0; t < m.triangle_count(); ++t) {
    double p[3][3];
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t k = 0; k < 3; ++k)
        p[c][k] = static_cast<double>(m.positions[3 * m.triangles[3 * t + c] + k]);
    volume += (p[0][0] * (p[1][1] * p[2][2] - p[1][2] * p[2][1]) -
               p[0][1] * (p[1][0] * p[2][2] - p[1][2] * p[2][0]) +
               p[0][2] * (p[1][0] * p[2][1] - p[1][1] * p[2][0])) /
              6;
  }
  const double exact = 4.0 / 3 * 3.14159265358979 * 0.3 * 0.2 * 0.1;
  EXPECT_NEAR(volume, exact, 0.02 * exact) << "triangles are counter-clockwise from outside";
}

}  // namespace
}  // namespace robomosp::scene
