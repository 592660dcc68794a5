// SPDX-License-Identifier: Apache-2.0
// Conformance suite of robomosp.collision/1 (layer: contract helper for tests, GoogleTest,
// header-only). A kind of shape that an engine refuses with ErrorCode::unsupported is left out; an
// engine with the tag "approximate" may underestimate the clearance, never overestimate it. Include
// it in one file of a test program and instantiate it:
//   INSTANTIATE_TEST_SUITE_P(Mine, CollisionConformance,
//                            testing::Values(CollisionCase{"mine.so", "mine"}));
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <robomosp/sdk/collision.h>
#include <robomosp/sdk/conformance/allocations.h>
#include <robomosp/sdk/conformance/models.h>
#include <robomosp/sdk/conformance/provider.h>
#include <robomosp/sdk/conformance/stop_after.h>
#include <robomosp/sdk/conformance/threads.h>

namespace robomosp::conformance {

struct CollisionCase {
  std::string file, provider;
};
inline void PrintTo(const CollisionCase& c, std::ostream* os) { *os << c.provider; }

// --- shapes for tests ------------------------------------------------------------------------

inline Shape shape_of(ShapeKind kind, double x, double y = 0, double z = 0) {
  Shape s;
  s.kind = kind;
  s.sizes = {x, y, z};
  return s;
}
/// A closed box of triangles.
inline Mesh box_mesh(double x, double y, double z) {
  Mesh m;
  for (int i = 0; i < 8; ++i)
    for (const double v : {i & 1 ? x / 2 : -x / 2, i & 2 ? y / 2 : -y / 2, i & 4 ? z / 2 : -z / 2})
      m.positions.push_back(static_cast<float>(v));
  m.normals.assign(m.positions.size(), 0.0F);
  m.triangles = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                 2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
  return m;
}
/// A ball of triangles with rings pushed in and out by `bump`.
inline Mesh ball_mesh(double radius, int rings, double bump = 0) {
  Mesh m;
  const int around = 2 * rings;
  const auto put = [&](double z, double r, double angle, double scale) {
    m.positions.push_back(static_cast<float>(scale * r * std::cos(angle)));
    m.positions.push_back(static_cast<float>(scale * r * std::sin(angle)));
    m.positions.push_back(static_cast<float>(scale * z));
  };
  put(radius, 0, 0, 1);
  for (int i = 1; i < rings; ++i)
    for (int k = 0; k < around; ++k)
      put(radius * std::cos(kPi * i / rings), radius * std::sin(kPi * i / rings),
          2 * kPi * k / around, 1 + bump * std::sin(5.0 * i) * std::cos(3.0 * k));
  put(-radius, 0, 0, 1);
  const auto at = [&](int i, int k) {
    return static_cast<std::uint32_t>(1 + (i - 1) * around + k % around);
  };
  const auto last = static_cast<std::uint32_t>(m.vertex_count() - 1);
  for (int k = 0; k < around; ++k) {
    m.triangles.insert(m.triangles.end(), {0, at(1, k), at(1, k + 1)});
    m.triangles.insert(m.triangles.end(), {last, at(rings - 1, k + 1), at(rings - 1, k)});
    for (int i = 1; i + 1 < rings; ++i) {
      m.triangles.insert(m.triangles.end(), {at(i, k), at(i + 1, k), at(i + 1, k + 1)});
      m.triangles.insert(m.triangles.end(), {at(i, k), at(i + 1, k + 1), at(i, k + 1)});
    }
  }
  m.normals.assign(m.positions.size(), 0.0F);
  return m;
}

class CollisionConformance : public testing::TestWithParam<CollisionCase> {
 protected:
  static constexpr std::uint64_t kSeed = 1106;
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();

  void SetUp() override {
    auto found = find_provider<CollisionEngine>(GetParam().file, GetParam().provider);
    ASSERT_TRUE(found.ok()) << found.error().sentence();
    params_ = TableParams(**found);
    is_approximate_ = std::string_view((*found)->tags).find("approximate") != std::string::npos;
    engine_ = create<CollisionEngine>(**found);
    ASSERT_NE(engine_, nullptr);
  }
  std::unique_ptr<CollisionScene> build(std::vector<std::vector<Shape>> bodies) {
    std::vector<ShapedBody> shaped;
    for (auto& shapes : bodies) shaped.push_back({std::move(shapes)});
    NoProgress none;
    auto made = engine_->build(shaped, params_, none);
    EXPECT_TRUE(made.ok()) << (made.ok() ? "" : made.error().sentence());
    return made.ok() ? std::move(made).value() : nullptr;
  }
  /// Whether the engine knows the kind; a refusal has to name the body and give a hint.
  bool takes(ShapeKind kind) {
    static const Mesh cube = box_mesh(1, 1, 1);
    Shape s = shape_of(kind, 1, 1, 1);
    s.mesh = &cube;
    NoProgress none;
    const std::vector<ShapedBody> bodies{{{shape_of(ShapeKind::sphere, 1)}}, {{s}}};
    const auto made = engine_->build(bodies, params_, none);
    if (made.ok()) return true;
    EXPECT_EQ(made.error().code, ErrorCode::unsupported) << made.error().sentence();
    EXPECT_NE(made.error().where.find("body 2"), std::string::npos) << made.error().sentence();
    EXPECT_FALSE(made.error().hint.empty()) << made.error().sentence();
    return false;
  }
  /// A distance as it is reported, against what it is.
  [[nodiscard]] bool agrees(double told, double distance, double tolerance) const {
    return told <= distance + tolerance && (is_approximate_ || told >= distance - tolerance);
  }
  /// The same for whether two bodies touch.
  [[nodiscard]] bool agrees(bool told, bool is_touching) const {
    return told == is_touching || (is_approximate_ && told);
  }
  PairDistance distance(const CollisionScene& scene, const Pose& a, const Pose& b,
                        double interest = kInfinity) {
    const std::array poses{a, b};
    const std::array pairs{CollisionPair{0, 1}};
    std::array<PairDistance, 1> out;
    NoProgress none;
    const auto done = scene.distances(poses, pairs, interest, out, none);
    EXPECT_TRUE(done.ok()) << (done.ok() ? "" : done.error().sentence());
    return out[0];
  }
  bool touches(const CollisionScene& scene, const Pose& a, const Pose& b) {
    const std::array poses{a, b};
    const std::array pairs{CollisionPair{0, 1}};
    std::array<std::uint8_t, 1> out{7};
    NoProgress none;
    const auto done = scene.collisions(poses, pairs, out, none);
    EXPECT_TRUE(done.ok()) << (done.ok() ? "" : done.error().sentence());
    EXPECT_LE(out[0], 1);
    return out[0] == 1;
  }
  static double apart(const PairDistance& d) {
    return std::hypot(d.on_a[0] - d.on_b[0], d.on_a[1] - d.on_b[1], d.on_a[2] - d.on_b[2]);
  }
  static Pose random_pose(Random& random, double reach) {
    Pose p = multiply(turn_z(random.uniform(-kPi, kPi)),
                      multiply(turn_x(random.uniform(0, kPi)), turn_z(random.uniform(-kPi, kPi))));
    for (double& x : p.p) x = random.uniform(-reach, reach);
    return p;
  }
  /// A and B in the frame in which A is at the origin, moved anywhere: what is known in one
  /// frame must hold in all.
  void expect_distance(const Shape& a, const Shape& b, const Pose& a_T_b, double expected,
                       double tolerance = 1e-9) {
    if (!takes(a.kind) || !takes(b.kind)) return;
    const auto scene = build({{a}, {b}});
    ASSERT_NE(scene, nullptr);
    Random random(kSeed);
    for (int i = 0; i < 8; ++i) {
      const Pose world_T_a = i == 0 ? Pose{} : random_pose(random, 2);
      const Pose world_T_b = multiply(world_T_a, a_T_b);
      const PairDistance d = distance(*scene, world_T_a, world_T_b);
      ASSERT_TRUE(agrees(d.distance, expected, tolerance))
          << d.distance << " instead of " << expected << ", pose " << i << ", seed " << kSeed;
      ASSERT_EQ(touches(*scene, world_T_a, world_T_b),
                is_approximate_ ? d.distance <= 0 : expected <= 0)
          << "pose " << i;
      if (expected > 0 && d.distance > 0) {
        ASSERT_NEAR(apart(d), d.distance, tolerance) << "nearest points";
      }
    }
  }

  TableParams params_;
  bool is_approximate_ = false;
  std::unique_ptr<CollisionEngine> engine_;
};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(CollisionConformance);

// Distances below follow from the sizes by hand.
TEST_P(CollisionConformance, SpheresBoxesAndCapsulesHaveTheDistancesOfClosedForms) {
  using enum ShapeKind;
  EXPECT_TRUE(takes(sphere) || takes(mesh)) << "an engine of nothing";
  const double root2 = std::sqrt(2.0), root3 = std::sqrt(3.0);
  const Shape ball = shape_of(sphere, 0.3), block = shape_of(box, 0.4, 0.6, 0.8);
  const Shape pill = shape_of(capsule, 0.1, 0.6), can = shape_of(cylinder, 0.2, 0.5);
  expect_distance(ball, shape_of(sphere, 0.2), shift(3, 4, 0), 4.5);
  expect_distance(ball, shape_of(sphere, 0.2), shift(0.3, 0, 0), -0.2);
  // A sphere before a face, an edge and a corner of a box.
  expect_distance(ball, block, shift(0.9, 0, 0), 0.4);
  expect_distance(ball, block, shift(0.2 + 1, 0.3 + 1, 0), root2 - 0.3);
  expect_distance(ball, block, shift(0.2 + 1, 0.3 + 1, -0.4 - 1), root3 - 0.3);
  expect_distance(ball, block, shift(0.4, 0, 0), -0.1);
  expect_distance(ball, block, {}, -(0.3 + 0.2));
  // A sphere beside, above and before the rim of a cylinder, and in it.
  expect_distance(ball, can, shift(0.9, 0, 0.1), 0.4);
  expect_distance(ball, can, shift(0.1, 0, 0.9), 0.35);
  expect_distance(ball, can, shift(0.6, 0.8, 0.25 + 0.8), std::hypot(0.8, 0.8) - 0.3);
  expect_distance(ball, can, shift(0.05, 0, 0), -(0.3 + 0.15));
  // A sphere beside and at the end of a capsule.
  expect_distance(ball, pill, shift(1, 0, 0.2), 0.6);
  expect_distance(ball, pill, shift(0.3, 0.4, 1.5), std::hypot(0.5, 1.2) - 0.4);
  // Capsules crossed, parallel, in line and with crossing axes.
  expect_distance(pill, pill, multiply(shift(0.7, 0, 0.1), turn_x(kPi / 2)), 0.5);
  expect_distance(pill, pill, shift(0.5, 0, 0.2), 0.3);
  expect_distance(pill, pill, shift(0, 0, 1.1), 0.3);
  expect_distance(pill, pill, turn_x(kPi / 2), -0.2);
}

TEST_P(CollisionConformance, BoxesCylindersAndCapsulesHaveTheDistancesOfClosedForms) {
  using enum ShapeKind;
  const Shape block = shape_of(box, 0.4, 0.6, 0.8), can = shape_of(cylinder, 0.2, 0.5);
  const Shape pill = shape_of(capsule, 0.1, 0.6);
  const double root2 = std::sqrt(2.0);
  expect_distance(block, block, shift(1, 0.2, -0.1), 0.6);                     // face to face
  expect_distance(block, block, shift(0.4 + 0.3, 0.6 + 0.4, 0), 0.5);          // edge to edge
  expect_distance(block, block, shift(0.4 + 0.2, 0.6 + 0.3, 0.8 + 0.6), 0.7);  // corners
  // A cube on its edge above a face: half its diagonal.
  expect_distance(block, shape_of(box, 0.2, 0.2, 0.2), multiply(shift(0.05, 0, 1), turn_x(kPi / 4)),
                  1 - 0.4 - 0.1 * root2);
  expect_distance(block, can, shift(0.9, 0, 0.1), 0.5);              // the wall before a face
  expect_distance(block, can, shift(0, 0, 1), 0.35);                 // the bottom before a face
  expect_distance(block, can, shift(0.2 + 0.6, 0.3 + 0.8, 0), 0.8);  // the wall before an edge
  expect_distance(can, can, shift(0.6, 0.8, 0.1), 0.6);              // parallel
  expect_distance(can, can, shift(0.1, 0, 0.9), 0.4);                // one above the other
  expect_distance(can, can, multiply(shift(0.7, 0, 0), turn_x(kPi / 2)), 0.3);  // crossed
  expect_distance(can, can, shift(0.4 + 0.3, 0, 0.5 + 0.4), 0.5);               // rim to rim
  expect_distance(can, pill, shift(0.6, 0.8, 0), 0.7);
  expect_distance(can, pill, shift(0, 0, 1), 1 - 0.25 - 0.3 - 0.1);
  expect_distance(block, pill, shift(0.9, 0, 0), 0.6);
  expect_distance(block, pill, shift(0.2 + 0.3, 0.3 + 0.4, 0), 0.4);
  // Depths: the least distance out.
  expect_distance(block, block, shift(0.35, 0, 0), -0.05, 1e-5);
  expect_distance(block, can, shift(0, 0, 0.6), -0.05, 1e-5);
}

TEST_P(CollisionConformance, SpheresAndCapsulesAnywhereHaveTheDistancesOfPointsAndSegments) {
  // Points to solids by clamping their coordinates; a segment is as far as the nearest of its
  // points; their distance to a convex solid is a convex function along it: halved by thirds.
  using enum ShapeKind;
  Random random(kSeed + 5);
  const auto in = [](const Pose& t, const Vec3& p) {  // t^-1 p
    Vec3 out{};
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t i = 0; i < 3; ++i) out[k] += t.R[3 * i + k] * (p[i] - t.p[i]);
    return out;
  };
  const auto over = [](double x, double half) { return std::max(0.0, std::fabs(x) - half); };
  // Of a point from a shape without its margin: a sphere's is its radius, a capsule's as well.
  const auto from_core = [&](const Shape& s, const Vec3& p) {
    switch (s.kind) {
      case sphere: return std::hypot(p[0], p[1], p[2]);
      case capsule: return std::hypot(p[0], p[1], over(p[2], s.sizes[1] / 2));
      case cylinder:
        return std::hypot(over(std::hypot(p[0], p[1]), s.sizes[0]), over(p[2], s.sizes[1] / 2));
      default:
        return std::hypot(over(p[0], s.sizes[0] / 2), over(p[1], s.sizes[1] / 2),
                          over(p[2], s.sizes[2] / 2));
    }
  };
  const auto margin = [](const Shape& s) {
    return s.kind == sphere || s.kind == capsule ? s.sizes[0] : 0.0;
  };
  const std::vector<Shape> round{shape_of(sphere, 0.15), shape_of(capsule, 0.1, 0.6)};
  const std::vector<Shape> all{shape_of(sphere, 0.2), shape_of(capsule, 0.08, 0.9),
                               shape_of(box, 0.4, 0.6, 0.8), shape_of(cylinder, 0.25, 0.5)};
  for (const Shape& a : round)
    for (const Shape& b : all) {
      if (!takes(a.kind) || !takes(b.kind)) continue;
      const auto scene = build({{a}, {b}});
      ASSERT_NE(scene, nullptr);
      int compared = 0;
      for (int i = 0; i < 100; ++i) {
        const Pose at_a = random_pose(random, 0.7), at_b = random_pose(random, 0.7);
        const auto along = [&](double t) {
          return from_core(b, in(at_b, multiply(at_a, shift(0, 0, t)).p));
        };
        double low = a.kind == capsule ? -a.sizes[1] / 2 : 0, high = -low;
        for (int step = 0; step < 120; ++step) {
          const double x = low + (high - low) / 3, y = high - (high - low) / 3;
          (along(x) <= along(y) ? high : low) = along(x) <= along(y) ? y : x;
        }
        const double core = std::min(along(low), along(high));
        if (core < 1e-6) continue;  // the cores meet: a depth
        ++compared;
        const double expected = core - margin(a) - margin(b);
        const PairDistance d = distance(*scene, at_a, at_b);
        ASSERT_TRUE(agrees(d.distance, expected, 1e-9))
            << d.distance << " instead of " << expected << ", kinds " << static_cast<int>(a.kind)
            << " and " << static_cast<int>(b.kind) << ", pose " << i << ", seed " << kSeed + 5;
        if (d.distance > 0) {
          ASSERT_NEAR(apart(d), d.distance, 1e-9);
        }
      }
      EXPECT_GT(compared, 30);
    }
}

TEST_P(CollisionConformance, RandomBoxesAndHullsHaveTheDistanceOfTheirCornersAndEdges) {
  // The reference for boxes needs no search: they overlap unless one of fifteen axes separates them
  // (Gottschalk, Lin, Manocha, SIGGRAPH 1996), and apart they are as near as a corner of one is to
  // the other or an edge to an edge.
  using enum ShapeKind;
  Random random(kSeed);
  const auto corner = [](const Vec3& h, int i) {
    return Vec3{i & 1 ? h[0] : -h[0], i & 2 ? h[1] : -h[1], i & 4 ? h[2] : -h[2]};
  };
  const auto apply = [](const Pose& t, const Vec3& v) {
    return multiply(t, shift(v[0], v[1], v[2])).p;
  };
  const auto dot = [](const Vec3& a, const Vec3& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  };
  const auto minus = [](const Vec3& a, const Vec3& b) {
    return Vec3{a[0] - b[0], a[1] - b[1], a[2] - b[2]};
  };
  const auto corner_to_box = [&](const Pose& t, const Vec3& p, const Vec3& h) {
    double sum = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      double x = 0;
      for (std::size_t i = 0; i < 3; ++i) x += t.R[3 * i + k] * (p[i] - t.p[i]);
      const double out = std::max(0.0, std::fabs(x) - h[k]);
      sum += out * out;
    }
    return std::sqrt(sum);
  };
  // Squared distance of segments as a quadratic in (s, t), by its interior and its four borders.
  const auto edge_to_edge = [&](const Vec3& a0, const Vec3& a1, const Vec3& b0, const Vec3& b1) {
    const Vec3 u = minus(a1, a0), v = minus(b1, b0), r = minus(a0, b0);
    const double uu = dot(u, u), vv = dot(v, v), uv = dot(u, v), ur = dot(u, r), vr = dot(v, r);
    double best = kInfinity;
    const auto consider = [&](double s, double t) {
      if (!(s >= 0 && s <= 1 && t >= 0 && t <= 1)) return;
      Vec3 d{};
      for (std::size_t k = 0; k < 3; ++k) d[k] = r[k] + s * u[k] - t * v[k];
      best = std::min(best, std::sqrt(dot(d, d)));
    };
    const double det = uu * vv - uv * uv;
    if (det > 1e-9 * uu * vv) consider((uv * vr - vv * ur) / det, (uu * vr - uv * ur) / det);
    for (const double s : {0.0, 1.0}) consider(s, std::clamp((vr + s * uv) / vv, 0.0, 1.0));
    for (const double t : {0.0, 1.0}) consider(std::clamp((t * uv - ur) / uu, 0.0, 1.0), t);
    return best;
  };
  int separated = 0;
  if (!takes(box)) GTEST_SKIP() << "it refuses boxes";
  const bool has_hulls = takes(convex);
  for (int trial = 0; trial < 200; ++trial) {
    const Vec3 ha{random.uniform(0.05, 0.5), random.uniform(0.05, 0.5), random.uniform(0.05, 0.5)};
    const Vec3 hb{random.uniform(0.05, 0.5), random.uniform(0.05, 0.5), random.uniform(0.05, 0.5)};
    const Mesh mesh = box_mesh(2 * hb[0], 2 * hb[1], 2 * hb[2]);
    // The corners of the mesh, which are rounded to float; not rounded here again, for GCC 12 with
    // -O2 leaves such a pair of conversions of several numbers out.
    Vec3 hm{};
    for (std::size_t k = 0; k < 3; ++k) hm[k] = static_cast<double>(mesh.positions[21 + k]);
    Shape hull = shape_of(has_hulls ? convex : box, 2 * hm[0], 2 * hm[1], 2 * hm[2]);
    hull.mesh = &mesh;
    const auto scene = build({{shape_of(box, 2 * ha[0], 2 * ha[1], 2 * ha[2])}, {hull}});
    const Pose a = random_pose(random, 0.5), b = random_pose(random, 0.5);
    double expected = kInfinity;
    for (int i = 0; i < 8; ++i) {
      expected = std::min(expected, corner_to_box(b, apply(a, corner(ha, i)), hm));
      expected = std::min(expected, corner_to_box(a, apply(b, corner(hm, i)), ha));
      for (int k : {1, 2, 4})
        for (int j = 0; j < 8; ++j)
          for (int l : {1, 2, 4})
            if (!(i & k) && !(j & l))
              expected = std::min(
                  expected, edge_to_edge(apply(a, corner(ha, i)), apply(a, corner(ha, i | k)),
                                         apply(b, corner(hm, j)), apply(b, corner(hm, j | l))));
    }
    bool overlap = true;
    const auto column = [](const Pose& t, std::size_t k) {
      return Vec3{t.R[k], t.R[3 + k], t.R[6 + k]};
    };
    const auto separates = [&](const Vec3& n) {
      double reach = 0;
      for (std::size_t k = 0; k < 3; ++k)
        reach += ha[k] * std::fabs(dot(n, column(a, k))) + hm[k] * std::fabs(dot(n, column(b, k)));
      return dot(n, n) > 1e-12 && std::fabs(dot(n, minus(a.p, b.p))) > reach;
    };
    for (std::size_t k = 0; k < 3; ++k) {
      overlap = overlap && !separates(column(a, k)) && !separates(column(b, k));
      for (std::size_t l = 0; l < 3; ++l) {
        const Vec3 u = column(a, k), v = column(b, l);
        overlap = overlap && !separates({u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2],
                                         u[0] * v[1] - u[1] * v[0]});
      }
    }
    const PairDistance d = distance(*scene, a, b);
    SCOPED_TRACE("trial " + std::to_string(trial) + ", seed " + std::to_string(kSeed));
    ASSERT_TRUE(agrees(touches(*scene, a, b), overlap));
    if (overlap) {
      ASSERT_LE(d.distance, 0);
      continue;
    }
    ++separated;
    ASSERT_TRUE(agrees(d.distance, expected, 1e-9)) << d.distance << " instead of " << expected;
    if (d.distance > 0) {
      ASSERT_NEAR(apart(d), d.distance, 1e-9);
    }
  }
  EXPECT_GT(separated, 50);
}

TEST_P(CollisionConformance, ABodyInsideAnotherIsFound) {
  using enum ShapeKind;
  const Mesh outer = ball_mesh(1, 12), inner = ball_mesh(0.2, 6);
  Shape big, small;
  big.kind = small.kind = mesh;
  big.mesh = &outer;
  small.mesh = &inner;
  const auto expect_inside = [&](const Shape& a, const Shape& b) {
    if (!takes(a.kind) || !takes(b.kind)) return;
    const auto scene = build({{a}, {b}});
    ASSERT_NE(scene, nullptr);
    const Pose in = shift(0.3, 0.2, -0.1), out = shift(3, 0, 0);
    EXPECT_TRUE(touches(*scene, {}, in));
    EXPECT_LE(distance(*scene, {}, in).distance, 0);
    EXPECT_FALSE(touches(*scene, {}, out));
    EXPECT_GT(distance(*scene, {}, out).distance, 1.5);
  };
  expect_inside(big, small);
  expect_inside(small, big);
  expect_inside(big, shape_of(box, 0.2, 0.2, 0.2));
  expect_inside(shape_of(sphere, 1), small);
  expect_inside(shape_of(box, 2, 2, 2), small);
  expect_inside(big, shape_of(capsule, 0.1, 0.2));
  expect_inside(shape_of(box, 2, 2, 2), shape_of(capsule, 0.1, 0.2));
  if (!takes(mesh) || is_approximate_) return;
  // A hollow: the ball within is not in the material.
  Mesh shell = ball_mesh(1, 12);
  const Mesh hole = ball_mesh(0.6, 12);
  const auto offset = static_cast<std::uint32_t>(shell.vertex_count());
  shell.positions.insert(shell.positions.end(), hole.positions.begin(), hole.positions.end());
  shell.normals.insert(shell.normals.end(), hole.normals.begin(), hole.normals.end());
  for (std::size_t i = 0; i < hole.triangles.size(); i += 3)
    for (const std::size_t k : {0U, 2U, 1U}) shell.triangles.push_back(hole.triangles[i + k] + offset);
  Shape hollow;
  hollow.kind = mesh;
  hollow.mesh = &shell;
  const auto scene = build({{hollow}, {small}});
  EXPECT_FALSE(touches(*scene, {}, {}));
  EXPECT_NEAR(distance(*scene, {}, {}).distance, 0.4, 0.03);
  EXPECT_TRUE(touches(*scene, {}, shift(0.5, 0, 0)));
}

TEST_P(CollisionConformance, MeshesAreAsFarApartAsTheBoxesTheyAre) {
  using enum ShapeKind;
  if (!takes(mesh) || !takes(convex)) GTEST_SKIP() << "it refuses meshes or hulls";
  const Mesh a = box_mesh(0.5, 0.25, 1), b = box_mesh(0.25, 0.5, 0.125);
  const auto as = [](const Mesh& m, ShapeKind kind) {
    Shape s;
    s.kind = kind;
    s.mesh = &m;
    return s;
  };
  const auto meshes = build({{as(a, mesh)}, {as(b, mesh)}});
  const auto mixed = build({{shape_of(box, 0.5, 0.25, 1)}, {as(b, mesh)}});
  const auto hulls = build({{as(a, convex)}, {as(b, convex)}});
  const auto boxes = build({{shape_of(box, 0.5, 0.25, 1)}, {shape_of(box, 0.25, 0.5, 0.125)}});
  Random random(kSeed + 1);
  for (int i = 0; i < 100; ++i) {
    SCOPED_TRACE("pose " + std::to_string(i) + ", seed " + std::to_string(kSeed + 1));
    const Pose at_a = random_pose(random, 0.6), at_b = random_pose(random, 0.6);
    const double expected = distance(*boxes, at_a, at_b).distance;
    if (is_approximate_) {  // none of the three is judged by another: all know only bounds
      for (const auto* scene : {&meshes, &mixed, &hulls})
        ASSERT_EQ(touches(**scene, at_a, at_b), distance(**scene, at_a, at_b).distance <= 0);
      continue;
    }
    if (std::fabs(expected) < 1e-6) continue;  // rounding decides
    for (const auto* scene : {&meshes, &mixed, &hulls}) {
      ASSERT_EQ(touches(**scene, at_a, at_b), expected < 0);
      const PairDistance d = distance(**scene, at_a, at_b);
      if (expected > 0) {
        ASSERT_NEAR(d.distance, expected, 1e-7);
        ASSERT_NEAR(apart(d), expected, 1e-6);
      } else {
        ASSERT_LE(d.distance, 0);
      }
    }
    if (expected < 0) {
      ASSERT_NEAR(distance(*hulls, at_a, at_b).distance, expected, 1e-4);
    }
  }
}

TEST_P(CollisionConformance, NextToTouchingNothingBreaks) {
  using enum ShapeKind;
  const Mesh hull_mesh = ball_mesh(0.5, 8);
  Shape hull;
  hull.kind = convex;
  hull.mesh = &hull_mesh;
  std::vector<Shape> shapes{shape_of(sphere, 0.5),
                            shape_of(box, 1, 1, 1),
                            shape_of(cylinder, 0.5, 1),
                            shape_of(capsule, 0.25, 0.5),
                            hull,
                            shape_of(ellipsoid, 0.3, 0.4, 0.5)};
  std::erase_if(shapes, [&](const Shape& s) { return !takes(s.kind); });
  for (const Shape& a : shapes)
    for (const Shape& b : shapes) {
      const auto scene = build({{a}, {b}});
      for (const double gap : {-1e-5, -1e-9, -1e-12, 0.0, 1e-15, 1e-12, 1e-9, 1e-5})
        for (const Vec3 side : {Vec3{0, 0, 0}, Vec3{0.1, 0.2, 0}}) {
          // All reach 0.5 along z.
          const PairDistance d = distance(*scene, {}, shift(side[0], side[1], 1 + gap));
          ASSERT_TRUE(std::isfinite(d.distance));
          for (const double x : d.on_a) ASSERT_TRUE(std::isfinite(x));
          for (const double x : d.on_b) ASSERT_TRUE(std::isfinite(x));
          if (side[0] == 0) {
            ASSERT_TRUE(agrees(d.distance, gap, 1e-6)) << d.distance << " instead of " << gap;
          }
          if (side[0] == 0 && std::fabs(gap) > 1e-7) {
            ASSERT_TRUE(agrees(touches(*scene, {}, shift(0, 0, 1 + gap)), gap < 0));
          }
        }
    }
}

TEST_P(CollisionConformance, PairsAreSymmetricToTheBit) {
  using enum ShapeKind;
  const Mesh bumpy = ball_mesh(0.4, 8, 0.1);
  Shape m;
  m.kind = mesh;
  m.mesh = &bumpy;
  Shape off = shape_of(box, 0.2, 0.3, 0.4);
  off.pose = shift(0.2, 0, 0);
  if (!takes(mesh)) m = shape_of(capsule, 0.3, 0.4);
  const Shape can = shape_of(takes(cylinder) ? cylinder : capsule, 0.1, 0.5);
  const auto scene = build({{m}, {off, can}, {shape_of(capsule, 0.1, 0.4)}});
  const std::vector<CollisionPair> there{{0, 1}, {1, 2}, {0, 2}}, back{{1, 0}, {2, 1}, {2, 0}};
  Random random(kSeed + 2);
  std::vector<Pose> poses;
  for (int i = 0; i < 150; ++i) poses.push_back(random_pose(random, 0.7));
  std::vector<PairDistance> a(150), b(150), again(150);
  NoProgress none;
  ASSERT_TRUE(scene->distances(poses, there, kInfinity, a, none).ok());
  ASSERT_TRUE(scene->distances(poses, back, kInfinity, b, none).ok());
  ASSERT_TRUE(scene->distances(poses, there, kInfinity, again, none).ok());
  for (std::size_t i = 0; i < a.size(); ++i) {
    ASSERT_EQ(a[i].distance, b[i].distance);
    ASSERT_EQ(a[i].distance, again[i].distance) << "the same call gives the same";
    ASSERT_EQ(a[i].on_a, b[i].on_b);
    ASSERT_EQ(a[i].on_b, b[i].on_a);
  }
}

TEST_P(CollisionConformance, TheInterestBoundsWhatIsComputedAndBodiesAreUnions) {
  using enum ShapeKind;
  Shape left = shape_of(sphere, 0.1), right = left;
  left.pose = shift(-1, 0, 0);
  right.pose = shift(1, 0, 0);
  const auto scene = build({{left, right}, {shape_of(sphere, 0.1)}});
  EXPECT_TRUE(agrees(distance(*scene, {}, shift(2, 0, 0)).distance, 0.8, 1e-12));
  const PairDistance near = distance(*scene, {}, shift(-2, 0, 0));
  if (!is_approximate_) {
    EXPECT_NEAR(near.on_a[0], -1.1, 1e-12);
    EXPECT_NEAR(near.on_b[0], -1.9, 1e-12);
    EXPECT_GE(distance(*scene, {}, shift(5, 0, 0), 0.5).distance, 0.5);
  }
  EXPECT_TRUE(agrees(distance(*scene, {}, shift(1.4, 0, 0), 0.5).distance, 0.2, 1e-12));
  const auto with_nothing = build({{left, right}, {}});
  EXPECT_FALSE(touches(*with_nothing, {}, {}));
  EXPECT_EQ(distance(*with_nothing, {}, {}, 0.5).distance, 0.5);
}

TEST_P(CollisionConformance, ABoundIsNoFartherOffThanTheBodiesAreLarge) {
  // What "approximate" allows: bounding volumes, not "everything always touches".
  using enum ShapeKind;
  const Mesh bumpy = ball_mesh(0.4, 8, 0.1);
  Shape pieces[] = {shape_of(sphere, 0.4),        shape_of(box, 0.6, 0.2, 0.1),
                    shape_of(cylinder, 0.1, 0.7), shape_of(capsule, 0.1, 0.5),
                    shape_of(convex, 0),          shape_of(mesh, 0)};
  pieces[4].mesh = pieces[5].mesh = &bumpy;
  Random random(kSeed + 7);
  for (const Shape& a : pieces)
    for (const Shape& b : pieces) {
      if (!takes(a.kind) || !takes(b.kind)) continue;
      const auto scene = build({{a}, {b}});
      ASSERT_NE(scene, nullptr);
      for (int i = 0; i < 5; ++i) {
        // All of them lie within 0.5 m of their origins; bounds may be twice as large.
        const Pose turned = multiply(shift(6, 0, 0), random_pose(random, 0.1));
        const double told = distance(*scene, {}, turned).distance;
        ASSERT_GT(told, 6 - 0.2 - 4 * 0.5);
        ASSERT_FALSE(touches(*scene, {}, turned));
      }
    }
}

TEST_P(CollisionConformance, SeveralThreadsGetTheSameDistancesAtOnce) {
  using enum ShapeKind;
  const Mesh bumpy = ball_mesh(0.4, 8, 0.1);
  Shape m;
  m.kind = mesh;
  m.mesh = &bumpy;
  if (!takes(mesh)) m = shape_of(capsule, 0.3, 0.4);
  const auto scene = build({{m}, {shape_of(sphere, 0.2)}, {m}});
  ASSERT_NE(scene, nullptr);
  const std::vector<CollisionPair> pairs{{0, 1}, {1, 2}, {0, 2}};
  Random random(kSeed + 8);
  std::vector<Pose> poses;
  for (int i = 0; i < 90; ++i) poses.push_back(random_pose(random, 0.7));
  const auto run = [&](std::vector<PairDistance>& out, std::vector<std::uint8_t>& hits) {
    NoProgress none;
    out.resize(90), hits.resize(90);
    EXPECT_TRUE(scene->distances(poses, pairs, kInfinity, out, none).ok());
    EXPECT_TRUE(scene->collisions(poses, pairs, hits, none).ok());
  };
  std::vector<PairDistance> alone;
  std::vector<std::uint8_t> alone_hits;
  run(alone, alone_hits);
  std::array<std::vector<PairDistance>, 4> together;
  std::array<std::vector<std::uint8_t>, 4> hits;
  at_once(4, [&](std::size_t thread) { run(together[thread], hits[thread]); });
  for (std::size_t thread = 0; thread < 4; ++thread) {
    EXPECT_EQ(hits[thread], alone_hits);
    for (std::size_t i = 0; i < alone.size(); ++i) {
      EXPECT_EQ(together[thread][i].distance, alone[i].distance);
      EXPECT_EQ(together[thread][i].on_a, alone[i].on_a);
    }
  }
}

TEST_P(CollisionConformance, NothingIsAllocatedForASample) {
  RMP_NEEDS_ALLOCATION_COUNTS();
  using enum ShapeKind;
  const Shape ball = shape_of(sphere, 0.2), pill = shape_of(capsule, 0.1, 0.4);
  const auto scene = takes(capsule) && takes(sphere) ? build({{ball}, {pill}, {ball}}) : nullptr;
  if (!scene) GTEST_SKIP() << "it refuses spheres or capsules";
  const std::vector<CollisionPair> pairs{{0, 1}, {1, 2}, {0, 2}};
  Random random(kSeed + 9);
  std::vector<Pose> poses;
  constexpr std::size_t kMany = 1000;
  for (std::size_t i = 0; i < 3 * kMany; ++i) poses.push_back(random_pose(random, 0.7));
  std::vector<PairDistance> out(3 * kMany);
  std::vector<std::uint8_t> hits(3 * kMany);
  NoProgress none;
  const auto in = [&](std::size_t samples) {
    return allocations_in([&] {
      const std::span<const Pose> some = std::span<const Pose>(poses).first(3 * samples);
      (void)scene->distances(some, pairs, kInfinity, std::span(out).first(3 * samples), none);
      (void)scene->collisions(some, pairs, std::span(hits).first(3 * samples), none);
    });
  };
  (void)in(kMany);  // what is made once
  // A call may divide its work and have some memory for each part.
  EXPECT_LT(in(kMany)-in(kMany / 2), static_cast<long long>(kMany / 20));
}

// What is inside of an open mesh is where it winds around a point by more than a half.
TEST_P(CollisionConformance, AMeshWithAHoleTouchesWithItsSurfaceAndItsMiddle) {
  using enum ShapeKind;
  if (!takes(mesh) || !takes(sphere)) GTEST_SKIP() << "it refuses meshes or spheres";
  Mesh open = box_mesh(1, 1, 1);
  open.triangles.resize(open.triangles.size() - 3);  // of the side at +x
  Shape holed;
  holed.kind = mesh;
  holed.mesh = &open;
  NoProgress none;
  const std::vector<ShapedBody> bodies{{{holed}}, {{shape_of(sphere, 0.05)}}};
  if (!engine_->build(bodies, params_, none).ok()) GTEST_SKIP() << "it refuses open meshes";
  const auto scene = build({{holed}, {shape_of(sphere, 0.05)}});
  EXPECT_TRUE(touches(*scene, {}, shift(-0.5, 0, 0))) << "a wall";
  EXPECT_TRUE(touches(*scene, {}, {})) << "the middle, around which eleven twelfths are";
  EXPECT_TRUE(touches(*scene, {}, shift(0.5, -0.3, -0.3))) << "what is left of the open side";
  EXPECT_FALSE(touches(*scene, {}, shift(0.7, 0.3, 0.3))) << "before the hole";
  EXPECT_FALSE(touches(*scene, {}, shift(2, 0, 0)));
}

TEST_P(CollisionConformance, WrongSizesAndBrokenNumbersAreRefused) {
  using enum ShapeKind;
  NoProgress none;
  const auto refuses = [&](const Shape& s) {
    const std::vector<ShapedBody> bodies{{{s}}};
    return !engine_->build(bodies, params_, none).ok();
  };
  EXPECT_TRUE(refuses(shape_of(sphere, -1)));
  EXPECT_TRUE(refuses(shape_of(box, 1, 0, 1)));
  EXPECT_TRUE(refuses(shape_of(cylinder, 1, std::nan(""))));
  EXPECT_TRUE(refuses(shape_of(mesh, 0)));
  EXPECT_TRUE(refuses(shape_of(convex, 0)));
  Mesh flat = box_mesh(1, 1, 1);
  for (std::size_t i = 2; i < flat.positions.size(); i += 3) flat.positions[i] = 0;
  Shape s;
  s.kind = convex;
  s.mesh = &flat;
  EXPECT_TRUE(refuses(s));
  Shape bent = shape_of(sphere, 1);
  bent.pose.R[0] = 2;
  EXPECT_TRUE(refuses(bent));

  const auto scene = build({{shape_of(sphere, 1)}, {shape_of(sphere, 1)}});
  std::vector<Pose> poses(2);
  std::vector<PairDistance> out(1), two(2);
  const std::vector<CollisionPair> good{{0, 1}}, out_of_range{{0, 2}}, itself{{1, 1}};
  EXPECT_FALSE(scene->distances(poses, good, 1, two, none).ok());
  EXPECT_FALSE(scene->distances(poses, out_of_range, 1, out, none).ok());
  EXPECT_FALSE(scene->distances(poses, itself, 1, out, none).ok());
  EXPECT_FALSE(scene->distances(poses, good, std::nan(""), out, none).ok());
  poses[1].p[0] = std::nan("");
  EXPECT_FALSE(scene->distances(poses, good, 1, out, none).ok());
  poses.pop_back();
  EXPECT_FALSE(scene->distances(poses, good, 1, out, none).ok());
}

TEST_P(CollisionConformance, CancellingStopsWithinATenthOfASecond) {
  const Mesh bumpy = ball_mesh(0.5, 40, 0.1);
  Shape m;
  m.kind = ShapeKind::mesh;
  m.mesh = &bumpy;
  const bool is_slow = takes(m.kind) && !is_approximate_;
  if (!is_slow) m = shape_of(ShapeKind::sphere, 0.5);
  const auto scene = build({{m}, {m}});
  std::vector<Pose> poses;
  for (int i = 0; i < 20000; ++i) {
    poses.push_back({});
    poses.push_back(multiply(shift(1.3, 0, 0), turn_z(0.001 * i)));
  }
  const std::vector<CollisionPair> pairs{{0, 1}};
  std::vector<PairDistance> out(20000);
  StopAfter progress(is_slow ? 0.03 : 0);
  const auto r = scene->distances(poses, pairs, kInfinity, out, progress);
  ASSERT_FALSE(r.ok());
  EXPECT_EQ(r.error().code, ErrorCode::cancelled);
  EXPECT_LT(progress.since_told(), 0.1) << "it was asked to stop and went on";
  EXPECT_LT(progress.unheard(), 0.1) << "it computed for longer without asking";
}

// Between the planes through the nearest points, normal to the line between them, is nothing of
// either body, to the digits that the points have; and alternating projections find no shorter
// distance.
TEST_P(CollisionConformance, ConesAreExact) {
  using enum ShapeKind;
  if (!takes(cone)) GTEST_SKIP() << "it takes no cones";
  const auto farthest = [](const Shape& s, const Vec3& d) {
    const double r = std::hypot(d[0], d[1]);
    if (s.kind == box)
      return (std::fabs(d[0]) * s.sizes[0] + std::fabs(d[1]) * s.sizes[1] +
              std::fabs(d[2]) * s.sizes[2]) /
             2;
    return std::max(s.sizes[0] * r - d[2] * s.sizes[2] / 2, s.sizes[1] * r + d[2] * s.sizes[2] / 2);
  };
  // Nearest point of a box or cone in its frame, in the half plane through the axis.
  const auto nearest = [](const Shape& s, const Vec3& p) -> Vec3 {
    if (s.kind == box)
      return {std::clamp(p[0], -s.sizes[0] / 2, s.sizes[0] / 2),
              std::clamp(p[1], -s.sizes[1] / 2, s.sizes[1] / 2),
              std::clamp(p[2], -s.sizes[2] / 2, s.sizes[2] / 2)};
    const double h = s.sizes[2] / 2, r = std::hypot(p[0], p[1]);
    const double at = (s.sizes[0] * (h - p[2]) + s.sizes[1] * (h + p[2])) / (2 * h);
    if (std::fabs(p[2]) <= h && r <= at) return p;
    double best = kInfinity;
    std::array<double, 2> found{};
    const auto edge = [&](double r0, double z0, double r1, double z1) {
      const double x = r1 - r0, y = z1 - z0, l2 = x * x + y * y;
      const double t = l2 > 0 ? std::clamp(((r - r0) * x + (p[2] - z0) * y) / l2, 0.0, 1.0) : 0.0;
      const double d = std::hypot(r - r0 - t * x, p[2] - z0 - t * y);
      if (d < best) best = d, found = {r0 + t * x, z0 + t * y};
    };
    edge(0, -h, s.sizes[0], -h);
    edge(s.sizes[0], -h, s.sizes[1], h);
    edge(s.sizes[1], h, 0, h);
    return r > 0 ? Vec3{p[0] / r * found[0], p[1] / r * found[0], found[1]}
                 : Vec3{found[0], 0, found[1]};
  };
  const auto on = [&](const Shape& s, const Pose& at, const Vec3& p) {
    Vec3 own{}, out = at.p;
    for (std::size_t j = 0; j < 3; ++j)
      for (std::size_t r = 0; r < 3; ++r) own[j] += at.R[3 * r + j] * (p[r] - at.p[r]);
    own = nearest(s, own);
    for (std::size_t j = 0; j < 3; ++j)
      for (std::size_t r = 0; r < 3; ++r) out[j] += at.R[3 * j + r] * own[r];
    return out;
  };
  const std::array<std::array<Shape, 2>, 4> cases{
      {{shape_of(cone, 0.3, 0.1, 0.5), shape_of(box, 0.2, 0.3, 0.4)},
       {shape_of(cone, 0.3, 0, 0.2), shape_of(cone, 0, 0.2, 0.6)},
       {shape_of(cone, 0.05, 0.4, 0.1), shape_of(cone, 0.3, 0.29, 0.5)},
       {shape_of(cone, 0.2, 0.2, 0.4), shape_of(box, 1, 1, 0.01)}}};
  Random random(kSeed);
  for (std::size_t c = 0; c < cases.size(); ++c) {
    const auto scene = build({{cases[c][0]}, {cases[c][1]}});
    ASSERT_NE(scene, nullptr);
    for (int i = 0; i < 100; ++i) {
      const std::array<Pose, 2> at{random_pose(random, 1), random_pose(random, 1)};
      const PairDistance d = distance(*scene, at[0], at[1]);
      ASSERT_EQ(touches(*scene, at[0], at[1]), d.distance <= 0) << "case " << c << ", " << i;
      if (!(d.distance > 1e-6)) continue;
      ASSERT_NEAR(apart(d), d.distance, 1e-9) << "case " << c << ", " << i;
      PairDistance shorter = d;
      for (int turn = 0; turn < 2000; ++turn) {
        shorter.on_a = on(cases[c][0], at[0], shorter.on_b);
        shorter.on_b = on(cases[c][1], at[1], shorter.on_a);
      }
      ASSERT_NEAR(apart(shorter), d.distance, 1e-9) << "case " << c << ", " << i;
      for (std::size_t k = 0; k < 2; ++k) {
        const Vec3 &from = k == 0 ? d.on_a : d.on_b, &to = k == 0 ? d.on_b : d.on_a;
        Vec3 n{}, own{};
        double middle = 0, along = 0;
        for (std::size_t j = 0; j < 3; ++j) n[j] = (to[j] - from[j]) / d.distance;
        for (std::size_t j = 0; j < 3; ++j) {
          for (std::size_t r = 0; r < 3; ++r) own[j] += at[k].R[3 * r + j] * n[r];
          middle += n[j] * at[k].p[j];
          along += n[j] * from[j];
        }
        ASSERT_NEAR(middle + farthest(cases[c][k], own), along, 1e-7)
            << "case " << c << ", " << i << ", shape " << k << ", seed " << kSeed;
      }
    }
  }
  expect_distance(shape_of(cone, 0.3, 0, 0.4), shape_of(sphere, 0.1), shift(0, 0, 0.6), 0.3);
  expect_distance(shape_of(cone, 0.3, 0, 0.4), shape_of(sphere, 0.1), shift(0.5, 0, -0.2), 0.1);
  // 0.05 below the middle of the side with normal (0.8, 0.6): the least distance out.
  expect_distance(shape_of(cone, 0.3, 0, 0.4), shape_of(sphere, 0.01),
                  shift(0.15 - 0.05 * 0.8, 0, -0.05 * 0.6), -0.06);
}

}  // namespace robomosp::conformance

#include <robomosp/sdk/conformance/collision_suite_ellipsoid.h>
