// SPDX-License-Identifier: Apache-2.0
// The part of the suite of robomosp.collision/1 on ellipsoids, and on cones and ellipsoids against
// meshes; collision_suite.h includes it (layer: contract helper for tests).
#pragma once

#include <robomosp/sdk/conformance/collision_suite.h>

namespace robomosp::conformance {
namespace detail {

inline Vec3 into(const Pose& t, const Vec3& p) {  // t^-1 p
  Vec3 out{};
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t i = 0; i < 3; ++i) out[k] += t.R[3 * i + k] * (p[i] - t.p[i]);
  return out;
}
inline double dot_of(const Vec3& a, const Vec3& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/// Distance of a point outside of an ellipsoid about the origin, by halving: the nearest point is
/// e_i^2 p_i / (t + e_i^2), for the t > 0 at which it lies on the surface.
inline double point_to_ellipsoid(const Vec3& half, const Vec3& p) {
  const auto at = [&](long double t) {
    long double sum = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const long double e = half[k], x = e * p[k] / (t + e * e);
      sum += x * x;
    }
    return sum;
  };
  if (at(0) <= 1) return 0;
  long double low = 0, high = 1;
  while (at(high) > 1) high *= 2;
  for (int i = 0; i < 100; ++i) (at((low + high) / 2) > 1 ? low : high) = (low + high) / 2;
  long double squared = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const long double e = half[k], x = low * p[k] / (low + e * e);
    squared += x * x;
  }
  return static_cast<double>(std::sqrt(squared));
}

/// Distance of two ellipsoids that are apart. The vector z from one to the other is the least
/// element of a convex set with the support function h_A + h_B - c.v, so that it maximizes c.v -
/// h_A(v) - h_B(v) - v.v / 2, which is concave and smooth: Newton's method with halved steps.
inline double ellipsoid_to_ellipsoid(const Vec3& half_a, const Pose& at_a, const Vec3& half_b,
                                     const Pose& at_b) {
  using Matrix = std::array<Vec3, 3>;
  const auto form = [](const Vec3& half, const Pose& at) {
    Matrix m{};
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j)
        for (std::size_t k = 0; k < 3; ++k)
          m[i][j] += at.R[3 * i + k] * half[k] * half[k] * at.R[3 * j + k];
    return m;
  };
  const std::array<Matrix, 2> forms{form(half_a, at_a), form(half_b, at_b)};
  const auto times = [](const Matrix& m, const Vec3& v) {
    return Vec3{dot_of(m[0], v), dot_of(m[1], v), dot_of(m[2], v)};
  };
  Vec3 c{};
  for (std::size_t k = 0; k < 3; ++k) c[k] = at_b.p[k] - at_a.p[k];
  const auto value = [&](const Vec3& v) {
    double f = dot_of(c, v) - dot_of(v, v) / 2;
    for (const Matrix& m : forms) f -= std::sqrt(std::max(0.0, dot_of(v, times(m, v))));
    return f;
  };
  // From the best of many directions and of ever nearer ones to it, at the length that is best
  // along it.
  Vec3 best{};
  double most = -std::numeric_limits<double>::infinity();
  const auto try_out = [&](Vec3 n) {
    const double length = std::sqrt(dot_of(n, n));
    for (double& x : n) x /= length;
    if (value(n) + 0.5 > most) {
      most = value(n) + 0.5;
      best = n;
    }
  };
  const auto spiral = [](int i, int count) {
    const double z = 1 - (2 * i + 1) / double(count), r = std::sqrt(1 - z * z);
    return Vec3{r * std::cos(2.399963229728653 * i), r * std::sin(2.399963229728653 * i), z};
  };
  for (int i = 0; i < 400; ++i) try_out(spiral(i, 400));
  for (double radius = 0.1; radius > 1e-7; radius *= 0.7)
    for (int i = 0; i < 12; ++i) {
      const Vec3 aside = spiral(i, 12), from = best;
      try_out(
          {from[0] + radius * aside[0], from[1] + radius * aside[1], from[2] + radius * aside[2]});
    }
  if (!(most > 0)) return 0;
  Vec3 v{best[0] * most, best[1] * most, best[2] * most};
  for (int step = 0; step < 100; ++step) {
    Vec3 g{};
    Matrix h{};
    for (std::size_t i = 0; i < 3; ++i) g[i] = c[i] - v[i], h[i][i] = 1;
    for (const Matrix& m : forms) {
      const Vec3 mv = times(m, v);
      const double s = std::sqrt(dot_of(v, mv));
      for (std::size_t i = 0; i < 3; ++i) {
        g[i] -= mv[i] / s;
        for (std::size_t j = 0; j < 3; ++j) h[i][j] += m[i][j] / s - mv[i] * mv[j] / (s * s * s);
      }
    }
    const auto det = [](const Vec3& x, const Vec3& y, const Vec3& z) {
      return x[0] * (y[1] * z[2] - y[2] * z[1]) - x[1] * (y[0] * z[2] - y[2] * z[0]) +
             x[2] * (y[0] * z[1] - y[1] * z[0]);
    };
    const double all = det(h[0], h[1], h[2]);
    const Vec3 d{det(g, h[1], h[2]) / all, det(h[0], g, h[2]) / all, det(h[0], h[1], g) / all};
    double share = 1;
    Vec3 next{};
    for (; share > 1e-12; share /= 2) {
      for (std::size_t i = 0; i < 3; ++i) next[i] = v[i] + share * d[i];
      if (value(next) >= value(v) - 1e-15 * std::sqrt(dot_of(c, c) * dot_of(v, v))) break;
    }
    if (!(share > 1e-12)) break;
    v = next;
  }
  // By the planes normal to that vector: their error is quadratic in the vector's error.
  const double length = std::sqrt(dot_of(v, v));
  return value({v[0] / length, v[1] / length, v[2] / length}) + 0.5;
}

/// Distance of a box from an ellipsoid that it does not meet: of its corners, its edges (along
/// which the distance is convex) and its faces (before which the ellipsoid is nearest where its
/// normal is theirs).
inline double box_to_ellipsoid(const Vec3& sizes, const Pose& at_box, const Vec3& half,
                               const Pose& at) {
  double best = std::numeric_limits<double>::infinity();
  const auto from = [&](const Vec3& on_box) {
    return point_to_ellipsoid(half,
                              into(at, multiply(at_box, shift(on_box[0], on_box[1], on_box[2])).p));
  };
  const Vec3 h{sizes[0] / 2, sizes[1] / 2, sizes[2] / 2};
  const Vec3 centre = into(at_box, at.p);
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t i = (k + 1) % 3, j = (k + 2) % 3;
    for (const double s : {-1.0, 1.0}) {
      // The ellipsoid's point that is lowest over the face, in the box's frame.
      Vec3 n{};  // the face's normal in the ellipsoid's frame
      for (std::size_t a = 0; a < 3; ++a)
        for (std::size_t r = 0; r < 3; ++r) n[a] += at.R[3 * r + a] * at_box.R[3 * r + k] * s;
      double reach = 0;
      for (std::size_t a = 0; a < 3; ++a) reach += half[a] * half[a] * n[a] * n[a];
      reach = std::sqrt(reach);
      Vec3 low = at.p;
      for (std::size_t r = 0; r < 3; ++r)
        for (std::size_t a = 0; a < 3; ++a)
          low[r] -= at.R[3 * r + a] * half[a] * half[a] * n[a] / reach;
      low = into(at_box, low);
      const double gap = s * centre[k] - reach - h[k];
      if (gap > 0 && std::fabs(low[i]) <= h[i] && std::fabs(low[j]) <= h[j])
        best = std::min(best, gap);
      for (const double q : {-1.0, 1.0}) {  // the edges along k
        Vec3 p{};
        p[i] = s * h[i], p[j] = q * h[j];
        const auto along = [&](double t) {
          p[k] = t;
          return from(p);
        };
        double a = -h[k], b = h[k];
        best = std::min({best, along(a), along(b)});
        for (int step = 0; step < 70; ++step) {
          const double x = a + (b - a) / 3, y = b - (b - a) / 3;
          (along(x) <= along(y) ? b : a) = along(x) <= along(y) ? y : x;
        }
        best = std::min(best, along((a + b) / 2));
      }
    }
  }
  return best;
}

}  // namespace detail

// An engine that takes no ellipsoids is given their hulls.
TEST_P(CollisionConformance, EllipsoidsAreExact) {
  using enum ShapeKind;
  if (!takes(ellipsoid)) GTEST_SKIP() << "it takes no ellipsoids";
  const std::vector<Vec3> forms{{0.3, 0.2, 0.1}, {0.1, 0.1, 0.4},   {0.3, 0.3, 0.05},
                                {0.2, 0.2, 0.2}, {0.5, 0.01, 0.02}, {0.4, 0.399, 0.398}};
  Random random(kSeed + 11);
  const auto ell = [](const Vec3& r) { return shape_of(ellipsoid, r[0], r[1], r[2]); };
  const auto compare = [&](const Shape& a, const Shape& b, const auto& expected) {
    const auto scene = build({{a}, {b}});
    ASSERT_NE(scene, nullptr);
    int apart_count = 0;
    for (int i = 0; i < 25; ++i) {
      const Pose at_a = random_pose(random, 0.6), at_b = random_pose(random, 0.6);
      const double want = expected(at_a, at_b);
      const PairDistance d = distance(*scene, at_a, at_b);
      SCOPED_TRACE("kinds " + std::to_string(int(a.kind)) + " and " + std::to_string(int(b.kind)) +
                   ", sizes " + std::to_string(a.sizes[0]) + " and " + std::to_string(b.sizes[0]) +
                   ", pose " + std::to_string(i) + ", seed " + std::to_string(kSeed + 11));
      if (want < 1e-9) {  // they meet
        ASSERT_LE(d.distance, 1e-9);
        continue;
      }
      ++apart_count;
      ASSERT_TRUE(agrees(d.distance, want, 1e-9)) << d.distance - want << " off " << want;
      ASSERT_NEAR(apart(d), d.distance, 1e-9);
      ASSERT_TRUE(agrees(touches(*scene, at_a, at_b), false));
    }
    EXPECT_GT(apart_count, 3);
  };
  for (const Vec3& a : forms) {
    for (const Vec3& b : forms)
      compare(ell(a), ell(b), [&](const Pose& at_a, const Pose& at_b) {
        return detail::ellipsoid_to_ellipsoid(a, at_a, b, at_b);
      });
    compare(ell(a), shape_of(sphere, 0.1), [&](const Pose& at_a, const Pose& at_b) {
      return detail::point_to_ellipsoid(a, detail::into(at_a, at_b.p)) - 0.1;
    });
    compare(ell(a), shape_of(capsule, 0.05, 0.4), [&](const Pose& at_a, const Pose& at_b) {
      const auto along = [&](double t) {
        return detail::point_to_ellipsoid(a, detail::into(at_a, multiply(at_b, shift(0, 0, t)).p));
      };
      double low = -0.2, high = 0.2;
      for (int step = 0; step < 80; ++step) {
        const double x = low + (high - low) / 3, y = high - (high - low) / 3;
        (along(x) <= along(y) ? high : low) = along(x) <= along(y) ? y : x;
      }
      return std::min({along(-0.2), along(0.2), along((low + high) / 2)}) - 0.05;
    });
    const Vec3 block{0.25, 0.5, 0.125};
    const Mesh triangles = box_mesh(block[0], block[1], block[2]);
    for (const ShapeKind kind : {box, convex, mesh}) {
      Shape b = shape_of(kind, block[0], block[1], block[2]);
      b.mesh = &triangles;
      if (!takes(kind)) continue;
      compare(b, ell(a), [&](const Pose& at_a, const Pose& at_b) {
        return touches(*build({{b}, {ell(a)}}), at_a, at_b)
                   ? 0.0
                   : detail::box_to_ellipsoid(block, at_a, a, at_b);
      });
    }
  }
}

TEST_P(CollisionConformance, EllipsoidsMeetAndHoldWhatTheyShould) {
  using enum ShapeKind;
  if (!takes(ellipsoid)) GTEST_SKIP() << "it takes no ellipsoids";
  const Shape egg = shape_of(ellipsoid, 0.5, 0.3, 0.2), ball = shape_of(sphere, 0.1);
  // A ball in the middle: the least distance out. Off it along the longest axis, where the nearest
  // point is not on the axis: x / (1 - (c / a)^2) of the surface above it.
  expect_distance(egg, ball, {}, -(0.1 + 0.2));
  expect_distance(egg, ball, shift(0.5, 0, 0), -0.1);
  expect_distance(egg, ball, shift(0, 0.31, 0), 0.01 - 0.1);
  const double x = 0.1 / (1 - 0.16), z = 0.2 * std::sqrt(1 - x * x / 0.25);
  expect_distance(egg, ball, shift(0.1, 0, 0), -(0.1 + std::hypot(x - 0.1, z)));
  expect_distance(egg, shape_of(box, 2, 2, 1), shift(0, 0, 0.65), -0.05, 1e-5);
  expect_distance(egg, egg, shift(0.9, 0, 0), -0.1, 1e-4);
  expect_distance(egg, egg, shift(0, 0, 0.41), 0.01);
  if (!takes(mesh)) return;
  // Within a mesh without touching it, and the mesh within the ellipsoid.
  const Mesh outer = ball_mesh(1, 12), inner = ball_mesh(0.1, 6);
  Shape big = shape_of(mesh, 0), small = big;
  big.mesh = &outer, small.mesh = &inner;
  for (const auto& [a, b] : {std::pair{big, egg}, std::pair{egg, small}}) {
    const auto scene = build({{a}, {b}});
    EXPECT_TRUE(touches(*scene, {}, shift(0.1, 0.05, 0)));
    EXPECT_LE(distance(*scene, {}, shift(0.1, 0.05, 0)).distance, 0);
    EXPECT_FALSE(touches(*scene, {}, shift(2, 0, 0)));
    EXPECT_GT(distance(*scene, {}, shift(2, 0, 0)).distance, 0.3);
  }
}

TEST_P(CollisionConformance, ConesAreAsFarFromTheTrianglesOfABoxAsFromTheBox) {
  using enum ShapeKind;
  if (!takes(cone) || !takes(mesh) || is_approximate_) GTEST_SKIP() << "no cones or meshes";
  const Mesh triangles = box_mesh(0.5, 0.25, 0.125);
  Shape hollow = shape_of(mesh, 0);
  hollow.mesh = &triangles;
  Random random(kSeed + 12);
  for (const Shape& c : {shape_of(cone, 0.3, 0.1, 0.5), shape_of(cone, 0, 0.2, 0.6)}) {
    const auto with_mesh = build({{c}, {hollow}});
    const auto with_box = build({{c}, {shape_of(box, 0.5, 0.25, 0.125)}});
    for (int i = 0; i < 200; ++i) {
      const Pose at_a = random_pose(random, 0.6), at_b = random_pose(random, 0.6);
      const double want = distance(*with_box, at_a, at_b).distance;
      if (std::fabs(want) < 1e-9) continue;
      const PairDistance d = distance(*with_mesh, at_a, at_b);
      SCOPED_TRACE("pose " + std::to_string(i) + ", seed " + std::to_string(kSeed + 12));
      ASSERT_EQ(touches(*with_mesh, at_a, at_b), want < 0);
      if (want > 0) {
        ASSERT_NEAR(d.distance, want, 1e-9);
        ASSERT_NEAR(apart(d), want, 1e-9);
      } else {
        ASSERT_LE(d.distance, 0);
      }
    }
  }
}

}  // namespace robomosp::conformance
