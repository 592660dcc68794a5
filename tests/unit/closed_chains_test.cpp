// SPDX-License-Identifier: Apache-2.0
// The closed chains of the library against closed forms: triangles for plane linkages, three
// spheres for the delta robot, leg lengths for the Stewart platform.
#include <array>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "robotics/build_model.h"
#include "robotics/closure.h"
#include "robotics/kinematics.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"
#include "support/closed_mechanism.h"

namespace robomosp {
namespace {

using robotics::Closure;
using spatial::add;
using spatial::dot;
using spatial::scale;
using spatial::sub;

constexpr double kHalfTurn = 3.14159265358979323846;

using Mechanism = test::ClosedMechanism;

TEST(ClosedChains, HomePosesAreClosed) {
  for (const char* name : {"four_bar", "slider_crank", "five_bar", "delta", "stewart"}) {
    const Mechanism m(name);
    std::vector<Pose> frames(m.model.joints.size());
    robotics::forward_kinematics(m.model, m.home, frames);
    std::vector<double> residual(robotics::loop_rows(m.model));
    ASSERT_FALSE(residual.empty()) << name;
    robotics::loop_residual(m.model, frames, residual);
    for (const double r : residual) EXPECT_NEAR(r, 0, 1e-14) << name;
  }
}

// The triangle of the crank's end, the rocker's foot and the pin, by the law of cosines; the pin is
// above the diagonal at home and stays there, for the crank can turn all the way round.
TEST(ClosedChains, TheFourBarsRockerFollowsTheLawOfCosines) {
  const Mechanism m("four_bar");
  const double g = 0.42, a = 0.12, b = 0.36, c = 0.28;
  for (double crank = -2.9; crank < 7; crank += 0.7) {
    const Closure closed = m.close({{"crank", crank}});
    const double x = a * std::cos(crank) - g, y = a * std::sin(crank), d = std::hypot(x, y);
    const double rocker = std::atan2(y, x) - std::acos((c * c + d * d - b * b) / (2 * c * d));
    EXPECT_NEAR(std::remainder(closed.q[m.q_of("rocker")] - rocker, 2 * kHalfTurn), 0, 1e-10)
        << crank;
  }
}

// x = a cos t + sqrt(l^2 - a^2 sin^2 t), measured from where the piston's joint stands.
TEST(ClosedChains, TheSliderCranksPistonStandsWhereTheTextbookSays) {
  const Mechanism m("slider_crank");
  const double a = 0.08, l = 0.26;
  for (double t = -3.1; t < 7; t += 0.6) {
    const Closure closed = m.close({{"crank", t}});
    const double x = a * std::cos(t) + std::sqrt(l * l - a * a * std::sin(t) * std::sin(t));
    EXPECT_NEAR(closed.q[m.q_of("piston")], x - 0.34, 1e-10) << t;
  }
}

// The tool is the crossing of two circles about the elbows, the one farther from the base.
TEST(ClosedChains, TheFiveBarsToolIsTheCrossingOfTwoCircles) {
  const Mechanism m("five_bar");
  const double upper = 0.25, fore = 0.35, half = 0.08;
  for (const auto& [left, right] : {std::pair(0.7, -0.7), {1.2, -0.3}, {0.2, -1.4}, {1.5, -1.5}}) {
    const Closure closed = m.close({{"left", left}, {"right", right}});
    const double ax = upper * std::cos(left), ay = half + upper * std::sin(left);
    const double bx = upper * std::cos(right), by = -half + upper * std::sin(right);
    const double dx = ax - bx, dy = ay - by, d = std::hypot(dx, dy);
    const double h = std::sqrt(fore * fore - d * d / 4);
    const Vec3 p = m.tip(closed.q).p;
    EXPECT_NEAR(p[0], (ax + bx) / 2 + h * dy / d, 1e-10);
    EXPECT_NEAR(p[1], (ay + by) / 2 - h * dx / d, 1e-10);
  }
}

/// The lower of the two points at the distance `radius` from three points.
Vec3 below_three_spheres(const std::array<Vec3, 3>& c, double radius) {
  // In the frame of the centres: x along the first side, z across their plane.
  const Vec3 ex = spatial::unit(sub(c[1], c[0]));
  const double d = spatial::distance(c[1], c[0]), i = dot(ex, sub(c[2], c[0]));
  const Vec3 ey = spatial::unit(sub(sub(c[2], c[0]), scale(ex, i)));
  const double j = dot(ey, sub(c[2], c[0]));
  const Vec3 ez = spatial::cross(ex, ey);
  const double x = d / 2, y = (i * i + j * j) / (2 * j) - i * x / j;
  const double z = std::sqrt(radius * radius - x * x - y * y);
  const Vec3 in_plane = add(c[0], add(scale(ex, x), scale(ey, y)));
  return add(in_plane, scale(ez, ez[2] > 0 ? -z : z));
}

// Elbows drawn in by the platform's radius are the centres of three spheres on which the platform's
// centre lies (R. Clavel 1991; the platform never turns).
TEST(ClosedChains, TheDeltasPlatformLiesOnThreeSpheresAndDoesNotTurn) {
  const Mechanism m("delta");
  const double base = 0.2, platform = 0.05, upper = 0.25, rod = 0.55;
  const std::array<std::array<double, 3>, 5> motors{
      {{0.35, 0.35, 0.35}, {0, 0, 0}, {0.9, 0.2, 0.4}, {-0.3, 0.6, 0.1}, {0.1, 1.2, 0.7}}};
  for (const auto& q : motors) {
    const Closure closed = m.close({{"arm_one", q[0]}, {"arm_two", q[1]}, {"arm_three", q[2]}});
    std::array<Vec3, 3> centres{};
    for (std::size_t k = 0; k < 3; ++k) {
      const double angle = 2 * kHalfTurn * static_cast<double>(k) / 3;
      const double out = base + upper * std::cos(q[k]) - platform;
      centres[k] = {out * std::cos(angle), out * std::sin(angle), -upper * std::sin(q[k])};
    }
    const Vec3 expected = below_three_spheres(centres, rod);
    const Pose tool = m.tip(closed.q);
    EXPECT_LT(spatial::distance(tool.p, expected), 1e-10);
    EXPECT_LT(spatial::norm(spatial::rotation_log(tool.R)), 1e-10);
  }
}

// Inverse kinematics of the platform: each leg is as long as its two ends are apart. And back: from
// the lengths the pose is found again.
TEST(ClosedChains, TheStewartPlatformsLegsAreAsLongAsTheirEndsAreApart) {
  const Mechanism m("stewart");
  struct Case {
    Vec3 p, rpy;
  };
  for (const Case& wanted : {Case{{0, 0, 0.7}, {}}, Case{{0.05, -0.03, 0.74}, {0.1, -0.15, 0.2}},
                             Case{{-0.06, 0.04, 0.68}, {-0.12, 0.05, -0.25}}}) {
    const spatial::Matrix3 R = spatial::from_rpy(wanted.rpy);
    const Closure closed = m.close_at("platform", Pose{R, wanted.p});
    std::vector<std::pair<std::string, double>> motors;
    for (int k = 0; k < 6; ++k) {
      const double half = k % 2 ? 1 : -1, third = 2 * kHalfTurn * (k / 2) / 3;
      const double b = third + half * kHalfTurn / 12, p = third + half * kHalfTurn / 4;
      const Vec3 foot{0.5 * std::cos(b), 0.5 * std::sin(b), 0.05};
      const Vec3 ball =
          spatial::transform(Pose{R, wanted.p}, {0.3 * std::cos(p), 0.3 * std::sin(p), 0});
      const std::string leg = "leg_" + std::to_string(k + 1);
      const double slide = spatial::distance(foot, ball) - 0.6;
      EXPECT_NEAR(closed.q[m.q_of(leg)], slide, 1e-10) << leg;
      motors.emplace_back(leg, slide);
    }
    const Closure back = m.close(motors);
    std::vector<Pose> frames(m.model.joints.size());
    robotics::forward_kinematics(m.model, back.q, frames);
    EXPECT_LT(spatial::distance(frames.back().p, wanted.p), 1e-10);
    EXPECT_LT(spatial::norm(spatial::rotation_difference(frames.back().R, R)), 1e-10);
  }
}

// The tips of the gripper stay parallel and close in the middle; one number moves all.
TEST(ClosedChains, TheGrippersFingersMoveTogether) {
  const Mechanism m("gripper");
  ASSERT_EQ(m.model.coordinate_count(), 1U);
  for (const double q : {-0.5, -0.1, 0.1}) {
    std::vector<Pose> joints(4), frames(4);
    robotics::forward_kinematics(m.model, std::vector<double>{q}, joints);
    robotics::link_poses(robotics::link_frames(m.record), joints, frames);
    EXPECT_LT(spatial::norm(spatial::rotation_log(frames[1].R)), 1e-14);
    EXPECT_LT(spatial::norm(spatial::rotation_log(frames[3].R)), 1e-14);
    EXPECT_NEAR(frames[1].p[1], -frames[3].p[1], 1e-15);
    EXPECT_NEAR(frames[1].p[1], 0.03 - 0.07 * std::sin(q), 1e-15);
  }
}

}  // namespace
}  // namespace robomosp
