// SPDX-License-Identifier: Apache-2.0
// Kinematics of many configurations against the SDK's frames, which share no code with it, and
// against differences of these.
#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include <robomosp/sdk/conformance/mechanisms.h>

#include "robotics/batch_kinematics.h"
#include "robotics/kinematics_kernels.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"

namespace robomosp::robotics {
namespace {

using conformance::Random;
using spatial::InstructionSet;

std::vector<RobotModel> models() {
  RobotModel moved = conformance::puma560();
  moved.base = conformance::multiply(conformance::shift(1, 2, 3), conformance::turn_x(0.7));
  return {moved,
          conformance::panda(),
          conformance::scara(),
          conformance::tree(),
          conformance::long_chain(40),
          conformance::floating_manipulator(),
          conformance::four_bar(1, 0.4, 1.1, 0.8)};
}
constexpr std::size_t kCount = 11;  // no multiple of any number of lanes

std::vector<double> configurations(const RobotModel& m, std::size_t count) {
  Random random(4);
  std::vector<double> q;
  for (std::size_t i = 0; i < count; ++i)
    for (const double x : random.configuration(m)) q.push_back(x);
  return q;
}
double pose_difference(const Pose& a, const Pose& b) {
  double most = 0;
  for (std::size_t k = 0; k < 9; ++k) most = std::max(most, std::fabs(a.R[k] - b.R[k]));
  for (std::size_t k = 0; k < 3; ++k) most = std::max(most, std::fabs(a.p[k] - b.p[k]));
  return most;
}

class EverySet : public testing::TestWithParam<InstructionSet> {};
INSTANTIATE_TEST_SUITE_P(BatchKinematics, EverySet,
                         testing::Values(InstructionSet::baseline, InstructionSet::avx2,
                                         InstructionSet::avx512));

TEST_P(EverySet, FramesAndTipsAreThoseOfTheMechanism) {
  for (const RobotModel& m : models()) {
    const BatchKinematics kinematics(m, GetParam());
    const std::size_t joints = m.joints.size(), width = m.coordinate_count();
    const auto q = configurations(m, kCount);
    std::vector<double> scratch(kinematics.scratch_size());
    std::vector<Pose> frames(kCount * joints), single(joints), tips(kCount);
    kinematics.joint_frames(q, frames, scratch);
    for (std::size_t i = 0; i < kCount; ++i) {
      const auto expected = conformance::joint_frames(m, q.data() + i * width);
      forward_kinematics(m, {q.data() + i * width, width}, single);
      for (std::size_t j = 0; j < joints; ++j) {
        EXPECT_LT(pose_difference(frames[i * joints + j], expected[j]), 1e-13) << m.name << j;
        EXPECT_LT(pose_difference(single[j], expected[j]), 1e-13) << m.name << j;
      }
    }
    for (std::size_t t = 0; t < m.tips.size(); ++t) {
      kinematics.tip_poses(t, q, tips, scratch);
      for (std::size_t i = 0; i < kCount; ++i)
        EXPECT_LT(pose_difference(tips[i], tip_pose(m, t, {&frames[i * joints], joints})), 1e-13)
            << m.name << ", tip " << t;
    }
  }
}

TEST_P(EverySet, JacobiansAreRatesOfTheTip) {
  for (const RobotModel& m : models()) {
    const BatchKinematics kinematics(m, GetParam());
    const std::size_t n = m.dof(), width = m.coordinate_count();
    const auto q = configurations(m, kCount);
    std::vector<double> scratch(kinematics.scratch_size()), J(kCount * 6 * n), unit(n);
    std::vector<Pose> tips(kCount);
    for (std::size_t t = 0; t < m.tips.size(); ++t) {
      kinematics.jacobians(t, q, JacobianFrame::base, tips, J, scratch);
      for (std::size_t k = 0; k < n; ++k) {
        unit.assign(n, 0);
        unit[k] = 1;
        const double h = 1e-5;
        const auto at = [&](double s) {
          const auto moved = conformance::advanced(m, q.data(), unit.data(), s);
          return tip_pose(m, t, conformance::joint_frames(m, moved.data()));
        };
        const Pose a = at(-h), b = at(h);
        for (std::size_t r = 0; r < 3; ++r)
          EXPECT_NEAR(J[6 * k + r], (b.p[r] - a.p[r]) / (2 * h), 1e-8) << m.name << k;
        // Rd R^T of the first sample is skew with the angular velocity.
        const auto turned = [&](std::size_t i, std::size_t j) {
          double sum = 0;
          for (std::size_t c = 0; c < 3; ++c)
            sum += (b.R[3 * i + c] - a.R[3 * i + c]) / (2 * h) * tips[0].R[3 * j + c];
          return sum;
        };
        EXPECT_NEAR(J[6 * k + 3], turned(2, 1), 1e-8) << m.name << k;
        EXPECT_NEAR(J[6 * k + 4], turned(0, 2), 1e-8) << m.name << k;
        EXPECT_NEAR(J[6 * k + 5], turned(1, 0), 1e-8) << m.name << k;
      }
    }
    // The other axes, against one configuration at a time.
    std::vector<Pose> frames(m.joints.size());
    std::vector<double> expected(6 * n);
    for (const JacobianFrame axes :
         {JacobianFrame::base, JacobianFrame::world, JacobianFrame::tip}) {
      kinematics.jacobians(0, q, axes, {}, J, scratch);
      for (std::size_t i = 0; i < kCount; ++i) {
        forward_kinematics(m, {q.data() + i * width, width}, frames);
        geometric_jacobian(m, 0, frames, axes, expected);
        for (std::size_t k = 0; k < 6 * n; ++k)
          EXPECT_NEAR(J[i * 6 * n + k], expected[k], 1e-13) << m.name << k;
      }
    }
    // The same numbers as matrices.
    std::vector<double> rows(J.size());
    kinematics.jacobian_rows(0, q, JacobianFrame::tip, rows, scratch);
    for (std::size_t i = 0; i < kCount; ++i)
      for (std::size_t row = 0; row < 6; ++row)
        for (std::size_t k = 0; k < n; ++k)
          EXPECT_EQ(rows[i * 6 * n + row * n + k], J[i * 6 * n + 6 * k + row]) << m.name;
  }
}

TEST_P(EverySet, PosesAreDescribedAsOneByOne) {
  const RobotModel m = conformance::puma560();
  const BatchKinematics kinematics(m, GetParam());
  Random random(9);
  std::vector<Pose> poses;
  for (int i = 0; i < 2000; ++i) {
    Pose t = conformance::multiply(conformance::turn_x(random.uniform(-4, 4)),
                                   conformance::turn_z(random.uniform(-4, 4)));
    t = conformance::multiply(t, conformance::turn_x(random.uniform(-4, 4)));
    poses.push_back(conformance::multiply(
        t, conformance::shift(random.uniform(-2, 2), random.uniform(-2, 2), 1)));
  }
  // Half turns about each axis, where angles and quaternions change signs, and singular pitches.
  for (const std::array<double, 9>& R : {std::array<double, 9>{1, 0, 0, 0, 1, 0, 0, 0, 1},
                                         {-1, 0, 0, 0, -1, 0, 0, 0, 1},
                                         {-1, 0, 0, 0, 1, 0, 0, 0, -1},
                                         {1, 0, 0, 0, -1, 0, 0, 0, -1},
                                         {0, 0, 1, 0, 1, 0, -1, 0, 0},
                                         {0, 1, 0, 0, 0, -1, -1, 0, 0},
                                         {0, 0, -1, 0, 1, 0, 1, 0, 0}})
    poses.push_back({R, {}});
  const Pose base = conformance::multiply(conformance::shift(1, 2, 3), conformance::turn_x(0.7));
  for (const Pose& frame : {Pose{}, base}) {
    const std::size_t n = poses.size();
    std::vector<double> matrices(16 * n), positions(3 * n), rpy(3 * n), quaternions(4 * n);
    kinematics.describe(poses, frame,
                        {matrices.data(), positions.data(), rpy.data(), quaternions.data()});
    for (std::size_t i = 0; i < n; ++i) {
      const Pose t = spatial::compose(frame, poses[i]);
      for (std::size_t r = 0; r < 3; ++r) {
        for (std::size_t c = 0; c < 3; ++c)
          EXPECT_NEAR(matrices[16 * i + 4 * r + c], t.R[3 * r + c], 1e-15);
        EXPECT_NEAR(matrices[16 * i + 4 * r + 3], t.p[r], 1e-14);
        EXPECT_EQ(positions[3 * i + r], matrices[16 * i + 4 * r + 3]);
        EXPECT_EQ(matrices[16 * i + 12 + r], 0);
      }
      EXPECT_EQ(matrices[16 * i + 15], 1);
      const Vec3 angles = spatial::to_rpy(t.R);
      const auto q = spatial::to_quaternion(t.R);
      const double* own = &quaternions[4 * i];
      const std::array<double, 4> one{q.w, q.x, q.y, q.z};
      // Rounding may turn the sign of a half turn only.
      double same = 0;
      for (std::size_t k = 0; k < 4; ++k) same += own[k] * one[k];
      EXPECT_GE(own[0], 0);
      EXPECT_TRUE(same > 0 || one[0] < 1e-14) << i;
      for (std::size_t k = 0; k < 4; ++k)
        EXPECT_NEAR(own[k] * (same < 0 ? -1 : 1), one[k], 1e-14) << i;
      for (std::size_t k = 0; k < 3; ++k)
        EXPECT_NEAR(std::remainder(rpy[3 * i + k] - angles[k], 2 * conformance::kPi), 0, 1e-12)
            << i << " " << k;
    }
  }
}

TEST_P(EverySet, AResultDependsNeitherOnItsPlaceNorOnThreads) {
  const RobotModel m = conformance::panda();
  const BatchKinematics kinematics(m, GetParam());
  const std::size_t count = 100003, n = m.dof();  // enough for several threads
  const auto q = configurations(m, count);
  std::vector<double> scratch(kinematics.scratch_size()), all(count * 6 * n), few(5 * 6 * n);
  kinematics.jacobians(0, q, JacobianFrame::base, {}, all, scratch);
  for (const std::size_t at : {std::size_t{0}, std::size_t{3}, count / 2 + 1, count - 5}) {
    kinematics.jacobians(0, {q.data() + at * n, 5 * n}, JacobianFrame::base, {}, few, scratch);
    for (std::size_t k = 0; k < few.size(); ++k) ASSERT_EQ(few[k], all[at * 6 * n + k]) << at;
  }
}

TEST(ForwardKinematics, RightAnglesLeaveNoResidue) {
  RobotModel m = conformance::puma560();
  for (JointModel& j : m.joints)
    for (double& x : j.placement.R) x = std::nearbyint(x);  // its twists are right angles
  const double r = conformance::kPi / 2;
  const std::vector<double> q{r, -r, 0, r, 2 * r, -r};
  std::vector<Pose> frames(6);
  forward_kinematics(m, q, frames);
  for (const Pose& f : frames)
    for (const double x : f.R) EXPECT_TRUE(x == 0 || std::fabs(x) == 1) << x;
}

}  // namespace
}  // namespace robomosp::robotics
