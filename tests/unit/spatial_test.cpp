// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "spatial/magnitudes.h"
#include "spatial/mass.h"
#include "spatial/pose.h"
#include "spatial/print.h"
#include "spatial/rotation.h"

namespace robomosp::spatial {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr unsigned kSeed = 7;

double gap(const Matrix3& a, const Matrix3& b) {
  double g = 0;
  for (std::size_t i = 0; i < 9; ++i) g = std::max(g, std::fabs(a[i] - b[i]));
  return g;
}
Matrix3 multiplied(const Matrix3& a, const Matrix3& b) {
  Pose x, y;
  x.R = a, y.R = b;
  return compose(x, y).R;
}
Matrix3 about(char axis, double t) {
  const double c = std::cos(t), s = std::sin(t);
  if (axis == 'x') return {1, 0, 0, 0, c, -s, 0, s, c};
  if (axis == 'y') return {c, 0, s, 0, 1, 0, -s, 0, c};
  return {c, -s, 0, s, c, 0, 0, 0, 1};
}
class Draw {
 public:
  double operator()(double low, double high) {
    return std::uniform_real_distribution(low, high)(engine_);
  }
  Vec3 vector(double size) {
    return {(*this)(-size, size), (*this)(-size, size), (*this)(-size, size)};
  }

 private:
  std::mt19937_64 engine_{kSeed};
};

TEST(SinCos, IsExactAtRightAnglesOnly) {
  for (int k = -8; k <= 8; ++k) {
    const SinCos a = sin_cos(k * kPi / 2);
    EXPECT_TRUE(a.sin == 0 || std::fabs(a.sin) == 1) << k;
    EXPECT_TRUE(a.cos == 0 || std::fabs(a.cos) == 1) << k;
    EXPECT_NEAR(a.sin, std::sin(k * kPi / 2), 1e-14);
    EXPECT_NEAR(a.cos, std::cos(k * kPi / 2), 1e-14);
  }
  EXPECT_NE(sin_cos(kPi / 2 + 1e-12).cos, 0);
  EXPECT_EQ(sin_cos(1e-12).sin, 1e-12);
  EXPECT_TRUE(std::isnan(sin_cos(std::nan("")).sin));
}

TEST(Angles, AreTheProductsTheyStandFor) {
  Draw draw;
  for (int i = 0; i < 100; ++i) {
    const Vec3 a = draw.vector(kPi);
    EXPECT_LT(gap(from_rpy(a),
                  multiplied(multiplied(about('z', a[2]), about('y', a[1])), about('x', a[0]))),
              1e-15);
    EXPECT_LT(gap(from_xyz(a),
                  multiplied(multiplied(about('x', a[0]), about('y', a[1])), about('z', a[2]))),
              1e-15);
    EXPECT_LT(gap(from_zyz(a),
                  multiplied(multiplied(about('z', a[0]), about('y', a[1])), about('z', a[2]))),
              1e-15);
  }
}

TEST(Angles, ReproduceTheMatrixEverywhereAlsoNearSingularPositions) {
  Draw draw;
  for (const double off : {1.0, 1e-3, 1e-7, 1e-9, 1e-12, 1e-16, 0.0})
    for (const double middle : {0.0, kPi / 2, -kPi / 2, kPi})
      for (int i = 0; i < 20; ++i) {
        const Vec3 a{draw(-kPi, kPi), middle + draw(-off, off), draw(-kPi, kPi)};
        for (const Matrix3& r : {from_rpy(a), from_xyz(a), from_zyz(a)}) {
          EXPECT_LT(gap(from_rpy(to_rpy(r)), r), 4e-15);
          EXPECT_LT(gap(from_xyz(to_xyz(r)), r), 4e-15);
          EXPECT_LT(gap(from_zyz(to_zyz(r)), r), 4e-15);
        }
      }
}

TEST(Angles, OfThePaperPoseComeBackAsWritten) {
  const Vec3 a = to_rpy(from_rpy({kPi, 0, kPi}));
  EXPECT_EQ(a, (Vec3{kPi, 0, kPi}));
  EXPECT_EQ(gap(from_rpy({kPi, 0, kPi}), {-1, 0, 0, 0, 1, 0, 0, 0, -1}), 0)
      << "the tool points straight down";
}

TEST(Quaternions, AgreeWithMatricesForAllAngles) {
  Draw draw;
  for (int i = 0; i < 300; ++i) {
    const Matrix3 r = from_axis_angle(draw.vector(1), i % 3 == 0 ? kPi : draw(-kPi, kPi));
    const Quaternion q = to_quaternion(r);
    EXPECT_NEAR(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z, 1, 1e-15);
    EXPECT_GE(q.w, 0);
    EXPECT_LT(gap(from_quaternion(q), r), 2e-15);
  }
}

TEST(RotationLog, IsExactNearZeroAndNearPi) {
  Draw draw;
  for (const double angle : {0.0, 1e-300, 1e-16, 1e-12, 1e-9, 1e-8, 1e-5, 0.1, 1.0, 3.0, kPi - 1e-5,
                             kPi - 1e-9, kPi - 1e-13})
    for (int i = 0; i < 20; ++i) {
      const Vec3 axis = unit(draw.vector(1));
      const Vec3 v = rotation_log(from_axis_angle(axis, angle));
      EXPECT_NEAR(distance(v, scale(axis, angle)), 0, angle < 1 ? 3e-16 : 2e-15) << angle;
      EXPECT_LT(gap(rotation_exp(v), from_axis_angle(axis, angle)), 3e-15);
    }
  EXPECT_NEAR(norm(rotation_log(from_axis_angle({0.3, -0.2, 0.9}, kPi))), kPi, 1e-15);
}

TEST(RotationDifference, TakesOneOrientationToTheOther) {
  Draw draw;
  for (int i = 0; i < 50; ++i) {
    const Matrix3 a = from_rpy(draw.vector(3)), b = from_rpy(draw.vector(3));
    EXPECT_LT(gap(multiplied(rotation_exp(rotation_difference(a, b)), a), b), 3e-15);
  }
}

TEST(Poses, ComposeAndInvert) {
  Draw draw;
  for (int i = 0; i < 50; ++i) {
    Pose a, b;
    a.R = from_rpy(draw.vector(3)), a.p = draw.vector(5);
    b.R = from_zyz(draw.vector(3)), b.p = draw.vector(5);
    const Vec3 p = draw.vector(2);
    EXPECT_LT(distance(transform(compose(a, b), p), transform(a, transform(b, p))), 1e-14);
    EXPECT_LT(distance(transform(inverse(a), transform(a, p)), p), 1e-14);
    EXPECT_LT(distance(rotate_back(a, rotate(a, p)), p), 1e-14);
    EXPECT_TRUE(is_rigid(a));
  }
  Pose mirror;
  mirror.R = {1, 0, 0, 0, 1, 0, 0, 0, -1};
  EXPECT_FALSE(is_rigid(mirror));
}

TEST(DenavitHartenberg, RowsAreTheProductsOfTheirConvention) {
  Draw draw;
  for (int i = 0; i < 50; ++i) {
    const double a = draw(-1, 1), alpha = draw(-3, 3), d = draw(-1, 1), theta = draw(-3, 3);
    const Pose dh = compose(compose(rotation_z(theta), translation({0, 0, d})),
                            compose(translation({a, 0, 0}), rotation_x(alpha)));
    const Pose mdh = compose(compose(rotation_x(alpha), translation({a, 0, 0})),
                             compose(rotation_z(theta), translation({0, 0, d})));
    EXPECT_LT(gap(dh_pose(a, alpha, d, theta).R, dh.R), 1e-15);
    EXPECT_LT(distance(dh_pose(a, alpha, d, theta).p, dh.p), 1e-15);
    EXPECT_LT(gap(mdh_pose(a, alpha, d, theta).R, mdh.R), 1e-15);
    EXPECT_LT(distance(mdh_pose(a, alpha, d, theta).p, mdh.p), 1e-15);
  }
}

TEST(DenavitHartenberg, RightAnglesGiveCleanFrames) {
  Pose t;
  for (int i = 0; i < 12; ++i)
    t = compose(t,
                i % 2 ? mdh_pose(0.5, -kPi / 2, 0.25, kPi / 2) : dh_pose(0.5, kPi / 2, 0.25, -kPi));
  for (const double x : t.R) EXPECT_TRUE(x == 0 || std::fabs(x) == 1) << x;
  for (const double x : t.p) EXPECT_EQ(x * 4, std::round(x * 4)) << "exact quarters of a metre";
}

TEST(JointPose, TurnsAboutOrSlidesAlongItsOwnZ) {
  const Pose place = dh_pose(0.1, 0.4, 0.3, 0.8);
  EXPECT_LT(gap(joint_pose(place, JointType::revolute, 0.7).R, compose(place, rotation_z(0.7)).R),
            1e-15);
  EXPECT_LT(distance(joint_pose(place, JointType::prismatic, 0.7).p,
                     compose(place, translation({0, 0, 0.7})).p),
            1e-15);
}

// Two point-like computations of the same thing: moving the pieces then combining, or combining
// then moving.
TEST(MassFrames, CombiningAndMovingCommute) {
  Draw draw;
  std::vector<MassProperties> parts;
  for (int i = 0; i < 4; ++i)
    parts.push_back(
        {draw(0.1, 3),
         draw.vector(1),
         {draw(1, 2), draw(1, 2), draw(1, 2), draw(-0.3, 0.3), draw(-0.3, 0.3), draw(-0.3, 0.3)}});
  Pose t;
  t.R = from_rpy({0.3, -1, 2}), t.p = {1, -2, 0.5};
  std::vector<MassProperties> moved;
  for (const auto& p : parts) moved.push_back(in_frame(p, t));
  const MassProperties a = in_frame(combine(parts), t), b = combine(moved);
  EXPECT_NEAR(a.mass, b.mass, 1e-14);
  EXPECT_LT(distance(a.com, b.com), 1e-14);
  for (const auto member : {&Sym3::xx, &Sym3::yy, &Sym3::zz, &Sym3::xy, &Sym3::yz, &Sym3::xz})
    EXPECT_NEAR(a.inertia.*member, b.inertia.*member, 1e-13);
}

TEST(MassFrames, KineticEnergyDoesNotDependOnTheFrame) {
  Draw draw;
  const MassProperties m{2, draw.vector(1), {1, 2, 2.5, 0.1, -0.2, 0.3}};
  Pose t;
  t.R = from_zyz(draw.vector(3)), t.p = draw.vector(1);
  const Vec3 w = draw.vector(1);
  const Vec3 turned = rotate(t, w);
  EXPECT_NEAR(dot(w, multiply(m.inertia, w)), dot(turned, multiply(in_frame(m, t).inertia, turned)),
              1e-14);
}

// The paper's second case: steel box 0.20 x 0.20 x 0.05 m and aluminium cylinder r 0.05 m, l 0.20 m
// on top, 0.05 m off along y; reference values computed independently to rounding.
TEST(MassFrames, CompoundObjectOfThePaper) {
  const double mb = 7850 * 0.2 * 0.2 * 0.05, mc = 2700 * kPi * 0.05 * 0.05 * 0.2;
  const double ib = mb / 12 * (0.04 + 0.0025), ic = mc / 12 * (3 * 0.0025 + 0.04);
  const MassProperties parts[] = {{mb, {0, 0, 0.025}, {ib, ib, mb / 12 * 0.08, 0, 0, 0}},
                                  {mc, {0, 0.05, 0.15}, {ic, ic, mc * 0.0025 / 2, 0, 0, 0}}};
  const MassProperties m = combine(parts);
  EXPECT_NEAR(m.mass, 19.941150082, 5e-10);
  EXPECT_NEAR(m.com[0], 0, 1e-15);
  EXPECT_NEAR(m.com[1], 0.010634, 5e-7);
  EXPECT_NEAR(m.com[2], 0.051585, 5e-7);
  EXPECT_NEAR(m.inertia.xx, 0.132913751, 5e-10);
  EXPECT_NEAR(m.inertia.yy, 0.124565930, 5e-10);
  EXPECT_NEAR(m.inertia.zz, 0.118315925, 5e-10);
  EXPECT_NEAR(m.inertia.yz, -0.020869551, 5e-10);
  EXPECT_NEAR(m.inertia.xy, 0, 1e-15);
}

TEST(MassFrames, MomentsOfABoxBecomeItsMassProperties) {
  // Box 0.2 x 0.4 x 0.6 standing on z = 0: integrals by hand.
  const double v = 0.2 * 0.4 * 0.6;
  Moments k;
  k.volume = v;
  k.first = {0, 0, v * 0.3};
  k.second = {v * 0.04 / 12, v * 0.16 / 12, v * 0.36 / 3, 0, 0, 0};
  const MassProperties m = mass_properties(k, 2000);
  EXPECT_NEAR(m.mass, 96, 1e-13);
  EXPECT_NEAR(m.com[2], 0.3, 1e-16);
  EXPECT_NEAR(m.inertia.xx, 96.0 / 12 * (0.16 + 0.36), 1e-13);
  EXPECT_NEAR(m.inertia.yy, 96.0 / 12 * (0.04 + 0.36), 1e-13);
  EXPECT_NEAR(m.inertia.zz, 96.0 / 12 * (0.04 + 0.16), 1e-13);
}

TEST(MassFrames, InertiaWithoutMassIsKept) {
  // PUMA 560's first link: no mass, but 0.35 kg m^2.
  const MassProperties parts[] = {{0, {0, 0, 0}, {0, 0.35, 0, 0, 0, 0}}, {}};
  const MassProperties m = combine(parts);
  EXPECT_EQ(m.mass, 0);
  EXPECT_EQ(m.inertia.yy, 0.35);
}

TEST(Printing, IsShortAndKnowsUnits) {
  EXPECT_EQ(print_number(0.2130000001, 3), "0.213");
  EXPECT_EQ(print_joint_value(137 * kPi / 180, JointType::revolute), "137 deg");
  EXPECT_EQ(print_joint_value(0.21, JointType::prismatic), "0.21 m");
}

TEST(Magnitudes, TheFirstNumberBeyondIsFoundWhereverItIs) {
  const double inf = std::numeric_limits<double>::infinity();
  for (const std::size_t count : {0, 1, 63, 64, 65, 300}) {
    std::vector<double> x(count);
    for (std::size_t i = 0; i < count; ++i) x[i] = (i % 2 ? -1 : 1) * 1e12;
    EXPECT_EQ(first_beyond(x, 1e12), count);
    EXPECT_EQ(first_beyond(x, std::nextafter(1e12, 0)), 0U);
    for (const double bad :
         {std::nan(""), -std::nan(""), inf, -inf, -1e13, std::nextafter(1e12, inf)})
      for (std::size_t i = 0; i < count; i += 7) {
        const double before = std::exchange(x[i], bad);
        EXPECT_EQ(first_beyond(x, 1e12), i) << bad;
        EXPECT_EQ(first_beyond(x, std::numeric_limits<double>::max()),
                  std::isfinite(bad) ? count : i);
        x[i] = before;
      }
  }
  const std::vector<double> zeros{0.0, -0.0, 5e-324};
  EXPECT_EQ(first_beyond(zeros, 0), 2U);
}

}  // namespace
}  // namespace robomosp::spatial
