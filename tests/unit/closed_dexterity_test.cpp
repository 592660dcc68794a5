// SPDX-License-Identifier: Apache-2.0
// What tips of closed chains can do by their motors, and their singular configurations, against
// closed forms: speed ratios of linkages, and A x' = B q' of parallel robots (C. Gosselin and J.
// Angeles, "Singularity analysis of closed-loop kinematic chains", IEEE Trans. Robotics and
// Automation 6(3), 1990) from the lengths of their rods.
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <Eigen/LU>

#include <robomosp/sdk/conformance/mechanisms.h>

#include "robotics/singularity.h"
#include "robotics/tip_motion.h"
#include "spatial/pose.h"
#include "support/closed_mechanism.h"

namespace robomosp {
namespace {

using conformance::kPi;
using conformance::shift;
using robotics::Dexterity;
using robotics::Singularity;
using robotics::TipMotion;
using robotics::TwistPart;
using spatial::dot;
using spatial::sub;
using Mechanism = test::ClosedMechanism;

constexpr double kInfinite = std::numeric_limits<double>::infinity();

TipMotion motion_of(const RobotModel& m, const std::vector<double>& q) {
  std::vector<Pose> frames(m.joints.size());
  robotics::forward_kinematics(m, q, frames);
  EXPECT_LT(robotics::open_by(m, frames), 1e-11);
  return robotics::tip_motion(m, 0, frames);
}

/// Rows 0, 1, ... of the Jacobian.
Eigen::MatrixXd rows_of(const TipMotion& t, Eigen::Index rows) {
  const Eigen::MatrixXd J = Eigen::Map<const Eigen::MatrixXd>(
      t.jacobian.data(), 6, static_cast<Eigen::Index>(t.motors.size()));
  return J.topRows(rows);
}

// --- four-bar ------------------------------------------------------------------------------------

/// conformance::four_bar with its pin on the left of the way from the crank's end to the rocker's
/// foot.
std::vector<double> four_bar_at(double g, double a, double b, double c, double crank) {
  const double ax = a * std::cos(crank), ay = a * std::sin(crank), d = std::hypot(g - ax, ay);
  const double rocker =
      std::atan2(ay, ax - g) - std::acos(std::min(1.0, (d * d + c * c - b * b) / (2 * d * c)));
  const double px = g + c * std::cos(rocker), py = c * std::sin(rocker);
  return {crank, std::atan2(py - ay, px - ax) - crank, rocker};
}

// w4 / w2 = a sin(t2 - t3) / (c sin(t4 - t3)): R. L. Norton, Design of Machinery, eq. 6.18b.
TEST(ClosedDexterity, TheFourBarsRockerTurnsAtTheTextbooksRatio) {
  const double g = 1, a = 0.3, b = 0.9, c = 0.7;
  const RobotModel m = conformance::four_bar(g, a, b, c);
  for (const double crank : {-2.0, 0.4, 1.2, 2.8}) {
    const auto q = four_bar_at(g, a, b, c, crank);
    const TipMotion t = motion_of(m, q);
    ASSERT_EQ(t.motors, std::vector<std::size_t>{0});
    ASSERT_EQ(t.feasible.size(), 1U);
    EXPECT_TRUE(t.loose.empty());
    const double t3 = q[0] + q[1], t4 = q[2];
    const double ratio = a * std::sin(crank - t3) / (c * std::sin(t4 - t3));
    EXPECT_NEAR(t.jacobian[0], -c * ratio * std::sin(t4), 1e-12);
    EXPECT_NEAR(t.jacobian[1], c * ratio * std::cos(t4), 1e-12);
    const Dexterity d = robotics::dexterity(t.jacobian, TwistPart::translation, 1);
    ASSERT_EQ(d.singular_values.size(), 1U);
    EXPECT_NEAR(d.yoshikawa, std::fabs(c * ratio), 1e-12);
    EXPECT_FALSE(robotics::singularity(m, 0, q, TwistPart::translation).is_singular());
  }
}

/// The crank and the coupler on one line: the rocker at its end.
std::vector<double> rocker_at_its_end(double g, double a, double b, double c) {
  const double reach = a + b, angle = std::acos((g * g + reach * reach - c * c) / (2 * g * reach));
  const double px = reach * std::cos(angle) - g, py = reach * std::sin(angle);
  return {angle, 0, std::atan2(py, px)};
}

TEST(ClosedDexterity, AtTheRockersEndTheCrankDoesNotMoveIt) {
  const RobotModel m = conformance::four_bar(1, 0.3, 0.9, 0.7);
  const auto q = rocker_at_its_end(1, 0.3, 0.9, 0.7);
  const Singularity s = robotics::singularity(m, 0, q, TwistPart::translation);
  EXPECT_TRUE(s.is_singular());
  EXPECT_EQ(s.rank, 0);
  EXPECT_EQ(s.full_rank, 1);
  ASSERT_EQ(s.lost.size(), 1U);
  // The pin would move across the rocker.
  EXPECT_NEAR(std::fabs(s.lost[0][0]), std::fabs(std::sin(q[2])), 1e-6);
  EXPECT_NEAR(std::fabs(s.lost[0][1]), std::fabs(std::cos(q[2])), 1e-6);
  EXPECT_TRUE(s.loose.empty());
  EXPECT_EQ(s.mobility, 1);
}

TEST(ClosedDexterity, DrivenAtTheRockerTheSamePlaceIsADeadPointThatTheMotorDoesNotHold) {
  RobotModel m = conformance::four_bar(1, 0.3, 0.9, 0.7);
  m.joints[0].passive = true;
  m.joints[2].passive = false;
  m.tips[0].tool = shift(0.45, 0, 0);  // the middle of the coupler
  const auto q = rocker_at_its_end(1, 0.3, 0.9, 0.7);
  const Singularity s = robotics::singularity(m, 0, q, TwistPart::translation);
  EXPECT_TRUE(s.is_singular());
  EXPECT_NEAR(s.hold, 0, 1e-9);
  ASSERT_EQ(s.loose.size(), 1U);
  // The crank's end stays on its circle and the pin stands still: 0.3 qd1 = -0.9 (qd1 + qd2).
  EXPECT_NEAR(0.3 * s.loose[0][0] + 0.9 * (s.loose[0][0] + s.loose[0][1]), 0, 1e-9);
  EXPECT_NEAR(s.loose[0][2], 0, 1e-9);
  EXPECT_NEAR(std::fabs(s.gained[0][0]), std::fabs(std::sin(q[0])), 1e-9);
  EXPECT_NEAR(std::fabs(s.gained[0][1]), std::fabs(std::cos(q[0])), 1e-9);
  EXPECT_NE(robotics::gained_words(s.gained[0]).find("with the motors at rest"), std::string::npos);
  const auto elsewhere = four_bar_at(1, 0.3, 0.9, 0.7, 1.2);
  EXPECT_FALSE(robotics::singularity(m, 0, elsewhere, TwistPart::translation).is_singular());
}

TEST(ClosedDexterity, AFlatParallelogramMayGoOnEitherWay) {
  const RobotModel m = conformance::four_bar(1, 0.4, 1, 0.4);
  const Singularity flat = robotics::singularity(m, 0, std::vector<double>{0, 0, 0});
  EXPECT_EQ(flat.mobility, 2);
  EXPECT_EQ(flat.least_mobility, 1);
  EXPECT_TRUE(flat.is_singular());
  EXPECT_EQ(flat.loose.size(), 1U);
  const Singularity open = robotics::singularity(m, 0, std::vector<double>{0.7, -0.7, 0.7});
  EXPECT_EQ(open.mobility, 1);
  EXPECT_FALSE(open.is_singular());
}

// --- five-bar ------------------------------------------------------------------------------------

struct FiveBar {
  double half, upper = 0.25, fore = 0.35;
  [[nodiscard]] RobotModel model() const {
    using conformance::add_joint;
    const MassProperties rod = conformance::body(1, 0.1, 0, 0, 0.01, 0.01, 0.01);
    RobotModel m;
    m.name = "five-bar";
    add_joint(m, "left", -1, JointType::revolute, shift(0, half, 0), rod);
    add_joint(m, "left forearm", 0, JointType::revolute, shift(upper, 0, 0), rod).passive = true;
    add_joint(m, "right", -1, JointType::revolute, shift(0, -half, 0), rod);
    add_joint(m, "right forearm", 2, JointType::revolute, shift(upper, 0, 0), rod).passive = true;
    m.loops = {{"wrist", 1, 3, shift(fore, 0, 0), shift(fore, 0, 0), kLoopX | kLoopY}};
    m.tips = {{"tool", 1, shift(fore, 0, 0)}};
    m.number_coordinates();
    return m;
  }
  [[nodiscard]] Vec3 elbow(bool left, double angle) const {
    return {upper * std::cos(angle), (left ? half : -half) + upper * std::sin(angle), 0};
  }
  /// Joint values with the arms at these angles and the tool at p.
  [[nodiscard]] std::vector<double> q(double left, double right, const Vec3& p) const {
    const Vec3 a = sub(p, elbow(true, left)), b = sub(p, elbow(false, right));
    return {left, std::atan2(a[1], a[0]) - left, right, std::atan2(b[1], b[0]) - right};
  }
  /// The tool on the far side of its elbows.
  [[nodiscard]] Vec3 tool(double left, double right) const {
    const Vec3 a = elbow(true, left), b = elbow(false, right), d = sub(a, b);
    const double l = spatial::norm(d), h = std::sqrt(fore * fore - l * l / 4);
    return {(a[0] + b[0]) / 2 + h * d[1] / l, (a[1] + b[1]) / 2 - h * d[0] / l, 0};
  }
};

TEST(ClosedDexterity, TheFiveBarsJacobianIsThatOfItsTwoForearms) {
  const FiveBar bar{0.08};
  const RobotModel m = bar.model();
  for (const auto& [left, right] : {std::pair(0.7, -0.7), {1.2, -0.3}, {0.2, -1.4}}) {
    const Vec3 p = bar.tool(left, right), a = sub(p, bar.elbow(true, left)),
               b = sub(p, bar.elbow(false, right));
    Eigen::Matrix2d A, B = Eigen::Matrix2d::Zero();
    A << a[0], a[1], b[0], b[1];
    B(0, 0) = bar.upper * (-std::sin(left) * a[0] + std::cos(left) * a[1]);
    B(1, 1) = bar.upper * (-std::sin(right) * b[0] + std::cos(right) * b[1]);
    const TipMotion t = motion_of(m, bar.q(left, right, p));
    ASSERT_EQ(t.motors, (std::vector<std::size_t>{0, 2}));
    EXPECT_LT((rows_of(t, 2) - A.inverse() * B).cwiseAbs().maxCoeff(), 1e-12);
    EXPECT_NEAR(robotics::dexterity(t.jacobian, TwistPart::translation, 1).yoshikawa,
                std::fabs(B.determinant() / A.determinant()), 1e-12);
    EXPECT_FALSE(robotics::singularity(m, 0, bar.q(left, right, p)).is_singular());
  }
}

TEST(ClosedDexterity, AStretchedLegOfTheFiveBarIsASingularityOfTheFirstKind) {
  const FiveBar bar{0.08};
  const RobotModel m = bar.model();
  const double left = -0.4, reach = bar.upper + bar.fore;
  const Vec3 p{reach * std::cos(left), bar.half + reach * std::sin(left), 0};
  // The right arm by the law of cosines, its elbow outside.
  const double x = p[0], y = p[1] + bar.half, d = std::hypot(x, y);
  const double right =
      std::atan2(y, x) -
      std::acos((d * d + bar.upper * bar.upper - bar.fore * bar.fore) / (2 * d * bar.upper));
  const auto q = bar.q(left, right, p);
  const Singularity s = robotics::singularity(m, 0, q, TwistPart::translation);
  EXPECT_EQ(s.rank, 1);
  EXPECT_EQ(s.full_rank, 2);
  EXPECT_TRUE(s.loose.empty()) << "the motors hold it";
  ASSERT_EQ(s.lost.size(), 1U);
  EXPECT_NEAR(s.lost[0][0], std::cos(left), 1e-6);
  EXPECT_NEAR(s.lost[0][1], std::sin(left), 1e-6);
  const TipMotion t = motion_of(m, q);
  EXPECT_NEAR(robotics::dexterity(t.jacobian, TwistPart::translation, 1).yoshikawa, 0, 1e-12);
}

TEST(ClosedDexterity, ForearmsOnOneLineAreASingularityOfTheSecondKind) {
  // Elbows at (0.2, 0.35) and (0.2, -0.35): the forearms of 0.35 m are one line, the tool between.
  const FiveBar wide{0.2};
  const RobotModel m = wide.model();
  const double angle = std::asin(0.6);
  const auto q = wide.q(angle, -angle, {0.2, 0, 0});
  const Singularity s = robotics::singularity(m, 0, q, TwistPart::translation);
  EXPECT_TRUE(s.is_singular());
  EXPECT_EQ(s.mobility, 2);
  ASSERT_EQ(s.gained.size(), 1U);
  EXPECT_NEAR(s.gained[0][0], 1, 1e-12) << "the tool can move across the forearms";
  EXPECT_EQ(robotics::gained_words(s.gained[0]),
            "can move along (1, 0, 0) with the motors at rest");
  EXPECT_NEAR(s.loose[0][0], 0, 1e-12);
  EXPECT_NEAR(s.loose[0][2], 0, 1e-12);
  // Along the forearms y' = 0.2 t1 = 0.2 t2: of motor rates of length 1, 0.2 / sqrt(2).
  const TipMotion t = motion_of(m, q);
  const Dexterity d =
      robotics::dexterity(t.jacobian, TwistPart::translation, 1, t.self_motion_twists);
  ASSERT_EQ(d.singular_values.size(), 2U);
  EXPECT_EQ(d.singular_values[0], kInfinite);
  EXPECT_NEAR(d.singular_values[1], 0.2 / std::sqrt(2.0), 1e-12);
  EXPECT_EQ(d.condition, kInfinite);
  EXPECT_NEAR(d.weakest[1], 1, 1e-12);
  const robotics::Ellipsoid e =
      robotics::ellipsoid(t.jacobian, TwistPart::translation, t.self_motion_twists);
  EXPECT_EQ(e.velocity[0], kInfinite);
  EXPECT_EQ(e.force[0], 0) << "the motors bear no force along x";
  EXPECT_NEAR(std::fabs(e.axes[0]), 1, 1e-12);
  EXPECT_NEAR(e.velocity[1], 0.2 / std::sqrt(2.0), 1e-12);
  EXPECT_EQ(e.velocity[2], 0);
  // A little beside it is regular, and the tool is fast and hardly held.
  const auto near = wide.q(angle - 2e-4, -angle + 2e-4, wide.tool(angle - 2e-4, -angle + 2e-4));
  const Singularity beside = robotics::singularity(m, 0, near, TwistPart::translation);
  EXPECT_FALSE(beside.is_singular());
  EXPECT_LT(beside.hold, 0.05);
  EXPECT_GT(beside.hold, 1e-3);
}

// --- spatial -------------------------------------------------------------------------------------

// (p - c) . p' = (p - c) . c' for the centres c of the three spheres (see closed_chains_test).
TEST(ClosedDexterity, TheDeltasJacobianIsThatOfItsThreeSpheres) {
  const Mechanism m("delta");
  const double base = 0.2, platform = 0.05, upper = 0.25;
  for (const auto& q : {std::array{0.35, 0.35, 0.35}, {0.9, 0.2, 0.4}, {-0.3, 0.6, 0.1}}) {
    const auto closed = m.close({{"arm_one", q[0]}, {"arm_two", q[1]}, {"arm_three", q[2]}}).q;
    const Vec3 p = m.tip(closed).p;
    Eigen::Matrix3d A, B = Eigen::Matrix3d::Zero();
    for (std::size_t k = 0; k < 3; ++k) {
      const double turn = 2 * kPi * static_cast<double>(k) / 3, c = std::cos(turn),
                   s = std::sin(turn), out = base + upper * std::cos(q[k]) - platform;
      const Vec3 rod = sub(p, {out * c, out * s, -upper * std::sin(q[k])});
      const Vec3 rate{-upper * std::sin(q[k]) * c, -upper * std::sin(q[k]) * s,
                      -upper * std::cos(q[k])};
      const auto row = static_cast<Eigen::Index>(k);
      A.row(row) << rod[0], rod[1], rod[2];
      B(row, row) = dot(rod, rate);
    }
    const TipMotion t = motion_of(m.model, closed);
    ASSERT_EQ(t.motors.size(), 3U);
    const Eigen::MatrixXd J = rows_of(t, 6);
    EXPECT_LT((J.topRows<3>() - A.inverse() * B).cwiseAbs().maxCoeff(), 1e-9);
    EXPECT_LT(J.bottomRows<3>().cwiseAbs().maxCoeff(), 1e-9) << "the platform does not turn";
    const Singularity s = robotics::singularity(m.model, 0, closed);
    EXPECT_FALSE(s.is_singular());
    EXPECT_EQ(s.full_rank, 3);
  }
}

/// Rows (u, p x u) of the legs, which a twist of the platform at its origin turns into leg speeds.
Eigen::Matrix<double, 6, 6> legs_of_stewart(const Pose& platform, double ahead) {
  Eigen::Matrix<double, 6, 6> rows;
  const Vec3 at = spatial::transform(platform, {0, 0, ahead});
  for (int k = 0; k < 6; ++k) {
    const double half = k % 2 ? 1 : -1, third = 2 * kPi * (k / 2) / 3;
    const double b = third + half * kPi / 12, p = third + half * kPi / 4;
    const Vec3 ball = spatial::transform(platform, {0.3 * std::cos(p), 0.3 * std::sin(p), 0});
    const Vec3 u = spatial::unit(sub(ball, {0.5 * std::cos(b), 0.5 * std::sin(b), 0.05}));
    const Vec3 w = spatial::cross(sub(ball, at), u);
    rows.row(k) << u[0], u[1], u[2], w[0], w[1], w[2];
  }
  return rows;
}

TEST(ClosedDexterity, TheStewartPlatformsJacobianIsTheInverseOfItsLegs) {
  const Mechanism m("stewart");
  for (const auto& [p, rpy] :
       {std::pair(Vec3{0, 0, 0.7}, Vec3{}), {Vec3{0.05, -0.03, 0.74}, Vec3{0.1, -0.15, 0.2}}}) {
    const Pose platform{spatial::from_rpy(rpy), p};
    const auto q = m.close_at("platform", platform).q;
    const TipMotion t = motion_of(m.model, q);
    ASSERT_EQ(t.motors.size(), 6U);
    const Eigen::MatrixXd one = legs_of_stewart(platform, 0.02) * rows_of(t, 6);
    EXPECT_LT((one - Eigen::MatrixXd::Identity(6, 6)).cwiseAbs().maxCoeff(), 1e-9);
    EXPECT_FALSE(robotics::singularity(m.model, 0, q).is_singular());
  }
}

// Turned by a right angle about the vertical all legs have the same moment about it, and the
// platform can screw up and down (E. F. Fichter, "A Stewart platform-based manipulator", IJRR 5(2),
// 1986, section 4.2). Legs of 0.65 m height: the pitch is 0.3 0.5 cos(30 deg) / 0.65.
TEST(ClosedDexterity, AStewartPlatformTurnedByARightAngleScrewsOfItself) {
  const Mechanism m("stewart");
  const Pose platform{spatial::from_rpy({0, 0, kPi / 2}), {0, 0, 0.7}};
  ASSERT_NEAR(legs_of_stewart(platform, 0.02).determinant(), 0, 1e-12);
  const auto q = m.close_at("platform", platform).q;
  const Singularity s = robotics::singularity(m.model, 0, q);
  EXPECT_TRUE(s.is_singular());
  EXPECT_EQ(s.mobility, 6);
  EXPECT_EQ(s.rank, 6) << "nothing is lost";
  ASSERT_EQ(s.gained.size(), 1U);
  const auto& g = s.gained[0];
  EXPECT_NEAR(g[2] / g[5], -0.15 * std::cos(kPi / 6) / 0.65, 1e-9);
  for (const std::size_t k : {0U, 1U, 3U, 4U}) EXPECT_NEAR(g[k], 0, 1e-9);
}

}  // namespace
}  // namespace robomosp
