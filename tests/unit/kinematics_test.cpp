// SPDX-License-Identifier: Apache-2.0
// Notations of rotations, velocities, Jacobians and their rates, ellipsoids and singular
// directions: against products of matrices, finite differences and closed forms.
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <robomosp/sdk/conformance/mechanisms.h>

#include "robotics/analytical.h"
#include "robotics/kinematics.h"
#include "robotics/singularity.h"
#include "robotics/twist.h"
#include "spatial/euler.h"
#include "spatial/pose.h"

namespace robomosp::robotics {
namespace {

using namespace conformance;
using spatial::EulerSequence;

Pose turn(std::size_t axis, double t) {
  return axis == 0 ? turn_x(t) : axis == 1 ? turn_y(t) : turn_z(t);
}

double difference(const spatial::Matrix3& a, const spatial::Matrix3& b) {
  double most = 0;
  for (std::size_t i = 0; i < 9; ++i) most = std::max(most, std::fabs(a[i] - b[i]));
  return most;
}

TEST(Euler, AllTwentyFourSequencesAreTheProductsTheirNamesTell) {
  Random random(11);
  std::vector<std::string> names;
  for (const EulerSequence& s : spatial::euler_sequences()) {
    SCOPED_TRACE(s.name());
    names.push_back(s.name());
    ASSERT_TRUE(spatial::euler_sequence(s.name()) == s);
    for (int i = 0; i < 50; ++i) {
      const auto a = random.vector(3, -kPi, kPi);
      const Pose t = s.turning ? multiply(multiply(turn(s.axes[0], a[0]), turn(s.axes[1], a[1])),
                                          turn(s.axes[2], a[2]))
                               : multiply(multiply(turn(s.axes[2], a[2]), turn(s.axes[1], a[1])),
                                          turn(s.axes[0], a[0]));
      ASSERT_LT(difference(spatial::from_euler(s, {a[0], a[1], a[2]}), t.R), 1e-14);
      const spatial::EulerAngles back = spatial::to_euler(s, t.R);
      ASSERT_LT(difference(spatial::from_euler(s, back.angles), t.R), 1e-14);
      ASSERT_GE(back.angles[1], s.is_proper() ? 0 : -kPi / 2);
      ASSERT_LE(back.angles[1], s.is_proper() ? kPi : kPi / 2);
      ASSERT_FALSE(back.is_singular());
    }
  }
  std::sort(names.begin(), names.end());
  EXPECT_EQ(std::unique(names.begin(), names.end()) - names.begin(), 24);
}

TEST(Euler, SingularRotationsAreToldAndReproduced) {
  for (const EulerSequence& s : spatial::euler_sequences()) {
    SCOPED_TRACE(s.name());
    for (const double middle : {s.is_proper() ? 0.0 : kPi / 2, s.is_proper() ? kPi : -kPi / 2}) {
      const auto R = spatial::from_euler(s, {0.7, middle, -0.4});
      const spatial::EulerAngles a = spatial::to_euler(s, R);
      EXPECT_TRUE(a.is_singular());
      EXPECT_TRUE(a.angles[0] == 0 || a.angles[2] == 0);
      EXPECT_LT(difference(spatial::from_euler(s, a.angles), R), 1e-14);
    }
  }
}

TEST(Euler, RollPitchYawIsTheOlderFunction) {
  const Vec3 a{0.3, -0.8, 2.1};
  EXPECT_EQ(spatial::from_euler(spatial::kRollPitchYaw, a), spatial::from_rpy(a));
  const Vec3 b = spatial::to_euler(spatial::kRollPitchYaw, spatial::from_rpy(a)).angles;
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(b[i], a[i], 1e-15);
  EXPECT_FALSE(spatial::euler_sequence("xxy").has_value());
  EXPECT_FALSE(spatial::euler_sequence("qxyz").has_value());
}

// The angular velocity of R(t) is the rotation vector from R(t - h) to R(t + h) over 2 h.
TEST(Euler, RatesOfEveryNotationAgreeWithDifferences) {
  const Vec3 a{0.5, 0.9, -1.3}, rates{0.3, -0.7, 1.1};
  constexpr double h = 1e-5;
  const auto moved = [&](double t) {
    return Vec3{a[0] + t * rates[0], a[1] + t * rates[1], a[2] + t * rates[2]};
  };
  for (const EulerSequence& s : spatial::euler_sequences()) {
    SCOPED_TRACE(s.name());
    const Vec3 turned = spatial::rotation_difference(spatial::from_euler(s, moved(-h)),
                                                     spatial::from_euler(s, moved(h)));
    Pose E;
    E.R = spatial::euler_rates(s, a);
    const Vec3 w = spatial::rotate(E, rates);
    for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(w[i], turned[i] / (2 * h), 1e-9);
    const auto before = spatial::euler_rates(s, moved(-h)),
               after = spatial::euler_rates(s, moved(h));
    const auto rate = spatial::euler_rates_rate(s, a, rates);
    for (std::size_t i = 0; i < 9; ++i)
      EXPECT_NEAR(rate[i], (after[i] - before[i]) / (2 * h), 1e-9);
  }
}

TEST(Euler, RatesOfRotationVectorsAgreeWithDifferences) {
  constexpr double h = 1e-5;
  const Vec3 rate{0.3, -0.7, 1.1};
  for (const double length : {0.0, 1e-4, 0.02, 1.0, 3.0}) {
    SCOPED_TRACE(length);
    const Vec3 v = spatial::scale(spatial::unit(Vec3{0.2, 0.5, -0.6}), length);
    const auto moved = [&](double t) { return spatial::add(v, spatial::scale(rate, t)); };
    const Vec3 w = spatial::scale(spatial::rotation_difference(spatial::rotation_exp(moved(-h)),
                                                               spatial::rotation_exp(moved(h))),
                                  1 / (2 * h));
    Pose B;
    B.R = spatial::rotation_vector_rates(v);
    const Vec3 back = spatial::rotate(B, w);
    for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(back[i], rate[i], 1e-8);
    const auto before = spatial::rotation_vector_rates(moved(-h)),
               after = spatial::rotation_vector_rates(moved(h));
    const auto d = spatial::rotation_vector_rates_rate(v, rate);
    for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(d[i], (after[i] - before[i]) / (2 * h), 1e-8);
  }
}

struct State {
  std::vector<double> q, qd, qdd;
};
State state_of(const RobotModel& m, std::uint64_t seed) {
  Random random(seed);
  State s;
  s.q = random.configuration(m);
  s.qd = random.vector(m.dof(), -1, 1);
  s.qdd = random.vector(m.dof(), -2, 2);
  return s;
}

/// q at time t of the motion with qd and qdd at 0, to second order in t for each velocity.
std::vector<double> later(const RobotModel& m, const State& s, double t) {
  std::vector<double> mean(m.dof());
  for (std::size_t i = 0; i < mean.size(); ++i) mean[i] = s.qd[i] + 0.5 * t * s.qdd[i];
  return advanced(m, s.q.data(), mean.data(), t);
}

std::vector<RobotModel> mechanisms() {
  return {puma560(), scara(), tree(), floating_manipulator(), panda()};
}

TEST(Twist, VelocityAndAccelerationOfAnyPointAgreeWithDifferences) {
  constexpr double h = 1e-4;
  for (const RobotModel& m : mechanisms()) {
    SCOPED_TRACE(m.name);
    const State s = state_of(m, 5);
    std::vector<Pose> frames(m.joints.size());
    std::vector<FrameMotion> motions(m.joints.size());
    forward_kinematics(m, s.q, frames);
    joint_motions(m, frames, s.qd, s.qdd, motions);
    const auto before = joint_frames(m, later(m, s, -h).data());
    const auto now = joint_frames(m, s.q.data());
    const auto after = joint_frames(m, later(m, s, h).data());
    const Vec3 local{0.1, -0.2, 0.3};
    for (std::size_t j = 0; j < m.joints.size(); ++j) {
      SCOPED_TRACE(m.joints[j].name);
      const auto at = [&](const std::vector<Pose>& f) {
        return multiply(f[j], shift(local[0], local[1], local[2])).p;
      };
      const FrameMotion p = carried_motion(static_cast<std::int32_t>(j), at(now), frames, motions);
      const Vec3 turned = spatial::rotation_difference(before[j].R, after[j].R);
      for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_NEAR(p.v[i], (at(after)[i] - at(before)[i]) / (2 * h), 1e-6);
        EXPECT_NEAR(p.a[i], (at(after)[i] - 2 * at(now)[i] + at(before)[i]) / (h * h), 1e-5);
        EXPECT_NEAR(p.w[i], turned[i] / (2 * h), 1e-6);
      }
    }
  }
}

TEST(Twist, AccelerationIsJacobianTimesAccelerationPlusItsRateTimesVelocity) {
  for (const RobotModel& m : mechanisms()) {
    SCOPED_TRACE(m.name);
    const State s = state_of(m, 6);
    std::vector<Pose> frames(m.joints.size());
    std::vector<FrameMotion> motions(m.joints.size());
    forward_kinematics(m, s.q, frames);
    joint_motions(m, frames, s.qd, s.qdd, motions);
    const auto tip = m.tips[0].joint;
    const Vec3 place = tip_pose(m, 0, frames).p;
    std::vector<double> J(6 * m.dof()), rate(6 * m.dof()), plain(6 * m.dof());
    point_jacobian(m, tip, place, frames, J);
    geometric_jacobian(m, 0, frames, JacobianFrame::base, plain);
    EXPECT_EQ(J, plain);
    point_jacobian_rate(m, tip, place, frames, motions, rate);
    const FrameMotion p = carried_motion(tip, place, frames, motions);
    for (std::size_t i = 0; i < 6; ++i) {
      double v = 0, a = 0;
      for (std::size_t k = 0; k < m.dof(); ++k) {
        v += J[6 * k + i] * s.qd[k];
        a += J[6 * k + i] * s.qdd[k] + rate[6 * k + i] * s.qd[k];
      }
      EXPECT_NEAR(v, i < 3 ? p.v[i] : p.w[i - 3], 1e-12);
      EXPECT_NEAR(a, i < 3 ? p.a[i] : p.alpha[i - 3], 1e-11);
    }
  }
}

TEST(Twist, RateOfTheJacobianAgreesWithDifferences) {
  constexpr double h = 1e-5;
  for (const RobotModel& m : mechanisms()) {
    SCOPED_TRACE(m.name);
    const State s = state_of(m, 7);
    std::vector<Pose> frames(m.joints.size());
    std::vector<FrameMotion> motions(m.joints.size());
    const auto jacobian = [&](const std::vector<double>& q) {
      std::vector<double> J(6 * m.dof());
      forward_kinematics(m, q, frames);
      geometric_jacobian(m, 0, frames, JacobianFrame::base, J);
      return J;
    };
    const auto before = jacobian(advanced(m, s.q.data(), s.qd.data(), -h));
    const auto after = jacobian(advanced(m, s.q.data(), s.qd.data(), h));
    std::vector<double> rate(6 * m.dof());
    forward_kinematics(m, s.q, frames);
    joint_motions(m, frames, s.qd, {}, motions);
    point_jacobian_rate(m, m.tips[0].joint, tip_pose(m, 0, frames).p, frames, motions, rate);
    for (std::size_t i = 0; i < rate.size(); ++i)
      EXPECT_NEAR(rate[i], (after[i] - before[i]) / (2 * h), 1e-8) << i;
  }
}

// The analytical Jacobian gives the rates of the notation's numbers, its rate their second ones.
TEST(Analytical, RatesOfEveryNotationAgreeWithDifferences) {
  const RobotModel m = puma560();
  State s;
  s.q = {0.3, 0.7, -0.4, 0.5, 0.8, -0.6};
  s.qd = {0.4, -0.3, 0.6, 0.2, -0.5, 0.7};
  s.qdd = {0.3, 0.1, -0.8, 0.4, 0.9, -0.2};
  std::vector<std::string> names{"rpy", "quaternion", "rotation_vector", "zyz"};
  for (const EulerSequence& e : spatial::euler_sequences()) names.push_back(e.name());
  constexpr double h = 1e-4;
  for (const std::string& name : names) {
    SCOPED_TRACE(name);
    const auto n = representation(name);
    ASSERT_TRUE(n.has_value());
    std::vector<Pose> frames(m.joints.size());
    std::vector<FrameMotion> motions(m.joints.size());
    const auto numbers = [&](double t) {
      return orientation_numbers(*n, conformance::tip_pose(m, later(m, s, t).data()).R);
    };
    forward_kinematics(m, s.q, frames);
    joint_motions(m, frames, s.qd, s.qdd, motions);
    const Pose tip = tip_pose(m, 0, frames);
    std::vector<double> J(36), Jd(36), rate;
    point_jacobian(m, 5, tip.p, frames, J);
    point_jacobian_rate(m, 5, tip.p, frames, motions, Jd);
    const auto B =
        representation_rates(*n, tip.R, carried_motion(5, tip.p, frames, motions).w, &rate);
    ASSERT_TRUE(B.has_value());
    const auto A = analytical_rows(J, *B, n->size()), Ad = analytical_rows(Jd, *B, n->size()),
               Bd = analytical_rows(J, rate, n->size());
    const auto before = numbers(-h), now = numbers(0), after = numbers(h);
    for (std::size_t i = 0; i < n->size(); ++i) {
      double first = 0, second = 0;
      for (std::size_t k = 0; k < 6; ++k) {
        const std::size_t e = (3 + i) * 6 + k;
        first += A[e] * s.qd[k];
        second += A[e] * s.qdd[k] + (Ad[e] + Bd[e]) * s.qd[k];
      }
      EXPECT_NEAR(first, (after[i] - before[i]) / (2 * h), 1e-6);
      EXPECT_NEAR(second, (after[i] - 2 * now[i] + before[i]) / (h * h), 1e-5);
    }
  }
}

TEST(Analytical, ASingularNotationHasNoRates) {
  const auto R = spatial::from_rpy({0.2, kPi / 2, 0.1});
  EXPECT_FALSE(representation_rates(*representation("rpy"), R, {}, nullptr).has_value());
  EXPECT_TRUE(representation_rates(*representation("zyz"), R, {}, nullptr).has_value());
}

// Two links in a plane: w = l1 l2 |sin q2| (Yoshikawa, IJRR 4(2), 1985, eq. 26).
TEST(Dexterity, OfTwoLinksInAPlaneIsTheClosedForm) {
  const RobotModel m = planar_rods();
  for (const double q2 : {0.3, 1.2, -2.0}) {
    std::vector<Pose> frames(2);
    const std::vector<double> q{0.4, q2};
    forward_kinematics(m, q, frames);
    std::vector<double> J(12);
    geometric_jacobian(m, 0, frames, JacobianFrame::base, J);
    const Dexterity d = dexterity(J, TwistPart::translation, 1);
    EXPECT_NEAR(d.yoshikawa, 0.7 * 0.45 * std::fabs(std::sin(q2)), 1e-14);
    // The squares of the singular values are the roots of x^2 - trace x + det.
    const double a = 0.49 + 2 * 0.45 * 0.45 + 2 * 0.7 * 0.45 * std::cos(q2);
    const double root = std::sqrt(a * a / 4 - d.yoshikawa * d.yoshikawa);
    ASSERT_EQ(d.singular_values.size(), 2U);
    EXPECT_NEAR(d.singular_values[0], std::sqrt(a / 2 + root), 1e-14);
    EXPECT_NEAR(d.least, std::sqrt(a / 2 - root), 1e-14);
    EXPECT_NEAR(d.condition, d.singular_values[0] / d.least, 1e-12);
    const Ellipsoid e = ellipsoid(J, TwistPart::translation);
    EXPECT_NEAR(e.velocity[0] * e.force[0], 1, 1e-12);
    EXPECT_NEAR(e.velocity[1], d.least, 1e-14);
    EXPECT_EQ(e.velocity[2], 0);
    EXPECT_TRUE(std::isinf(e.force[2]));
    EXPECT_NEAR(std::fabs(e.axes[8]), 1, 1e-12) << "nothing moves out of the plane";
  }
}

TEST(Singularity, StretchedLinksCannotMoveAlongThemselves) {
  const RobotModel m = planar_rods();
  const auto at = [&](double q2) {
    return singularity(m, 0, std::vector<double>{0.5, q2}, TwistPart::translation);
  };
  EXPECT_FALSE(at(0.8).is_singular());
  const Singularity s = at(0);
  EXPECT_EQ(s.rank, 1);
  EXPECT_EQ(s.full_rank, 2);
  ASSERT_EQ(s.lost.size(), 1U);
  EXPECT_NEAR(s.lost[0][0], std::cos(0.5), 1e-6);
  EXPECT_NEAR(s.lost[0][1], std::sin(0.5), 1e-6);
  for (std::size_t i = 2; i < 6; ++i) EXPECT_EQ(s.lost[0][i], 0);
  EXPECT_EQ(lost_words(s.lost[0]), "cannot move along (0.878, 0.479, 0)");
  // Rates that leave the tip in place: (l1 + l2) qd1 + l2 qd2 = 0.
  ASSERT_EQ(s.idle.size(), 1U);
  EXPECT_NEAR(1.15 * s.idle[0][0] + 0.45 * s.idle[0][1], 0, 1e-9);
}

// The PUMA's wrist with joint 5 at 0: axes 4 and 6 are one line, and the third direction of the
// wrist, across that line and the axis of joint 5, cannot be turned about.
TEST(Singularity, TheWristOfThePumaLosesOneTurn) {
  const RobotModel m = puma560();
  const std::vector<double> q{0.2, 0.6, -0.4, 0.3, 0, 0.5};
  const Singularity s = singularity(m, 0, q);
  EXPECT_EQ(s.rank, 5);
  EXPECT_EQ(s.full_rank, 6);
  ASSERT_EQ(s.lost.size(), 1U);
  const auto frames = joint_frames(m, q.data());
  const Vec3 z4 = spatial::axis(frames[3], 2), z5 = spatial::axis(frames[4], 2);
  const Vec3 across = spatial::cross(z4, z5);
  const Vec3 turning{s.lost[0][3], s.lost[0][4], s.lost[0][5]};
  // The arm can still turn about it, but only while moving the wrist: the lost twist is the
  // opposite combination, orthogonal to every column of the Jacobian in lengths of the reach.
  EXPECT_GT(std::fabs(spatial::dot(turning, across)), 0.3);
  std::vector<Pose> at(6);
  forward_kinematics(m, q, at);
  std::vector<double> J(36);
  geometric_jacobian(m, 0, at, JacobianFrame::base, J);
  const double L = reach(m, 0);
  for (std::size_t k = 0; k < 6; ++k) {
    double sum = 0;
    for (std::size_t i = 0; i < 6; ++i)
      sum += s.lost[0][i] * J[6 * k + i] * (i < 3 ? 1 / (L * L) : 1);
    EXPECT_NEAR(sum, 0, 1e-6);
  }
  ASSERT_EQ(s.idle.size(), 1U);
  EXPECT_NEAR(std::fabs(s.idle[0][3]), std::sqrt(0.5), 1e-9) << "joints 4 and 6 against each other";
  EXPECT_NEAR(s.idle[0][3] + s.idle[0][5], 0, 1e-9);
}

// What is found regular by a factorization has lost nothing by the decompositions, however near to
// a singular configuration; and all but those near to one are found so.
TEST(Singularity, WhatIsSurelyRegularHasLostNothing) {
  conformance::Random random(12);
  const RobotModel models[] = {
      puma560(), panda(), scara(), planar_rods(), tree(), floating_manipulator(), long_chain(12)};
  for (const RobotModel& m : models)
    for (const TwistPart part : {TwistPart::all, TwistPart::translation, TwistPart::rotation})
      for (const double threshold : {1e-6, 1e-3, 0.05}) {
        std::vector<Pose> frames(m.joints.size());
        int sure = 0, regular = 0;
        for (int i = 0; i < 60; ++i) {
          auto q = random.configuration(m);
          // Bent by less and less: wrists, elbows and shoulders come together.
          const double bend = std::pow(10.0, -0.15 * i);
          for (std::size_t k = 0; k < q.size() && m.is_simple() && i > 20; ++k)
            if (k == 1 || k == 2 || k == 4) q[k] = bend * (k == 2 && i % 2 ? -1 : 1);
          forward_kinematics(m, q, frames);
          const Singularity s = singularity(m, 0, q, part, threshold);
          const bool is_sure = is_surely_regular(m, 0, frames, part, threshold);
          EXPECT_TRUE(!is_sure || s.lost.empty()) << m.name << " " << i << " " << threshold;
          sure += is_sure;
          regular += static_cast<std::size_t>(s.rank) ==
                         std::min<std::size_t>(part == TwistPart::all ? 6 : 3, m.dof()) &&
                     s.least > 3 * threshold;
        }
        EXPECT_GE(sure, regular) << m.name << " " << threshold;
        if (m.name == "puma560") {
          EXPECT_GE(sure, threshold < 0.01 ? 15 : 1);
        }
      }
  const RobotModel loop = conformance::four_bar(1, 0.4, 1.1, 0.8);
  std::vector<Pose> frames(loop.joints.size());
  EXPECT_FALSE(is_surely_regular(loop, 0, frames, TwistPart::all, 1e-3));
}

TEST(Singularity, AScaraIsNotSingularBecauseItHasFourJoints) {
  const Singularity s = singularity(scara(), 0, std::vector<double>{0.2, 0.7, 0.1, 0.3});
  EXPECT_EQ(s.rank, 4);
  EXPECT_EQ(s.full_rank, 4);
  EXPECT_TRUE(s.lost.empty());
}

TEST(Singularity, DirectionsAreToldInWords) {
  EXPECT_EQ(lost_words({0, 0, 1, 0, 0, 0}), "cannot move along (0, 0, 1)");
  EXPECT_EQ(lost_words({0, 0, 0, 0, 1, 0}), "cannot turn about (0, 1, 0)");
  EXPECT_EQ(lost_words({0.6, 0, 0, 0, 0.8, 0}),
            "cannot move along (1, 0, 0) while turning about (0, 1, 0)");
}

}  // namespace
}  // namespace robomosp::robotics
