// SPDX-License-Identifier: Apache-2.0
#include "sim/joint_rates.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Core>
#include <Eigen/Eigenvalues>

#include "robotics/batch_kinematics.h"
#include "robotics/kinematics.h"
#include "sim/rates_kernel.h"
#include "spatial/instruction_set.h"
#include "spatial/pose.h"
#include "spatial/vec.h"

namespace robomosp::sim {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using JacobianMap = Eigen::Map<const Eigen::Matrix<double, 6, Eigen::Dynamic>>;

/// Directions of the tip that a Jacobian reaches worse than this, relative to the best, count as
/// lost: the joints are not driven along them.
constexpr double kSingular = 1e-7;

/// Pseudo-inverse of J through the eigenvalues of J J^T (fixed size: nothing is allocated).
struct PseudoInverse {
  explicit PseudoInverse(const JacobianMap& jacobian) : j(jacobian) {
    const Eigen::SelfAdjointEigenSolver<Matrix6> eigen(Matrix6(j * j.transpose()));
    const double floor = eigen.eigenvalues()[5] * kSingular * kSingular;
    Vector6 inverse = Vector6::Zero();
    for (int i = 0; i < 6; ++i)
      if (eigen.eigenvalues()[i] > floor && eigen.eigenvalues()[i] > 0)
        inverse[i] = 1 / eigen.eigenvalues()[i];
    square = eigen.eigenvectors() * inverse.asDiagonal() * eigen.eigenvectors().transpose();
  }
  /// x := x + J+ (wanted - J x): the tip moves as wanted, the null space of x stays. The second
  /// pass removes what squaring the condition number cost.
  void correct(const Vector6& wanted, Eigen::Map<Eigen::VectorXd> x) const {
    for (int pass = 0; pass < 2; ++pass) {
      const Vector6 missing = wanted - j * x;
      x.noalias() += j.transpose() * (square * missing);
    }
  }
  const JacobianMap& j;
  Matrix6 square;
};

/// Acceleration of the tip when all joint accelerations are zero: linear, then angular.
Vector6 velocity_acceleration(const RobotModel& model, std::span<const Pose> frames,
                              const Pose& tip, std::span<const double> qd,
                              std::vector<std::int32_t>& chain) {
  using namespace spatial;
  chain.clear();
  for (std::int32_t i = model.tips.front().joint; i >= 0;
       i = model.joints[static_cast<std::size_t>(i)].parent)
    chain.push_back(i);
  Vec3 w{}, acceleration{}, angular{}, origin{};
  const auto move_to = [&](const Vec3& p) {
    const Vec3 r = sub(p, origin);
    acceleration = add(acceleration, add(cross(angular, r), cross(w, cross(w, r))));
    origin = p;
  };
  for (auto it = chain.rbegin(); it != chain.rend(); ++it) {
    const auto i = static_cast<std::size_t>(*it);
    const Vec3 z = axis(frames[i], 2);
    move_to(frames[i].p);
    if (model.joints[i].type == JointType::revolute) {
      angular = add(angular, cross(w, scale(z, qd[i])));
      w = add(w, scale(z, qd[i]));
    } else {
      acceleration = add(acceleration, scale(cross(w, z), 2 * qd[i]));
    }
  }
  move_to(tip.p);
  Vector6 a;
  a << acceleration[0], acceleration[1], acceleration[2], angular[0], angular[1], angular[2];
  return a;
}

Vector6 stack(const Vec3& linear, const Vec3& angular) {
  Vector6 v;
  v << linear[0], linear[1], linear[2], angular[0], angular[1], angular[2];
  return v;
}

}  // namespace

void differentiate(std::span<const double> times, std::span<const double> values, std::size_t dof,
                   std::span<double> first, std::span<double> second) {
  const std::size_t n = times.size();
  constexpr std::size_t kPoints = 5;
  const std::size_t m = std::min(kPoints, n);
  std::fill(first.begin(), first.end(), 0.0);
  std::fill(second.begin(), second.end(), 0.0);
  if (m < 2) return;
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t start = std::min(i >= m / 2 ? i - m / 2 : 0, n - m);
    // Fornberg's weights of the derivatives at times[i] (Math. Comp. 51, 1988), orders 0, 1, 2.
    std::array<std::array<double, 3>, kPoints> weight{};
    weight[0][0] = 1;
    double c1 = 1, c4 = times[start] - times[i];
    for (std::size_t k = 1; k < m; ++k) {
      const std::size_t orders = std::min<std::size_t>(k, 2);
      double c2 = 1;
      const double c5 = c4;
      c4 = times[start + k] - times[i];
      for (std::size_t j = 0; j < k; ++j) {
        const double c3 = times[start + k] - times[start + j];
        c2 *= c3;
        if (j == k - 1) {
          for (std::size_t s = orders; s > 0; --s)
            weight[k][s] =
                c1 * (static_cast<double>(s) * weight[k - 1][s - 1] - c5 * weight[k - 1][s]) / c2;
          weight[k][0] = -c1 * c5 * weight[k - 1][0] / c2;
        }
        for (std::size_t s = orders; s > 0; --s)
          weight[j][s] = (c4 * weight[j][s] - static_cast<double>(s) * weight[j][s - 1]) / c3;
        weight[j][0] = c4 * weight[j][0] / c3;
      }
      c1 = c2;
    }
    for (std::size_t k = 0; k < m; ++k)
      for (std::size_t d = 0; d < dof; ++d) {
        const double v = values[(start + k) * dof + d];
        first[i * dof + d] += weight[k][1] * v;
        second[i * dof + d] += weight[k][2] * v;
      }
  }
}

namespace {

const RatesKernel& kernel() {
  const spatial::InstructionSet set = spatial::widest_instruction_set();
#if defined(RMP_HAS_AVX512)
  if (set == spatial::InstructionSet::avx512) return avx512::rates_kernel();
#endif
#if defined(__x86_64__)
  if (set == spatial::InstructionSet::avx2) return avx2::rates_kernel();
#endif
  (void)set;
  return baseline::rates_kernel();
}

/// Above this share of its greatest entry the pivots of J J^T tell its rank for certain.
constexpr double kClearlyRegular = 1e-8;

/// One sample by eigenvalues: also near and in singular configurations, and of any number of
/// joints. qd and qdd: dof entries, estimates in.
void correct_by_eigenvalues(const RobotModel& model, std::span<const double> q,
                            const PathSample& path, std::span<double> qd, std::span<double> qdd) {
  const std::size_t dof = model.dof();
  std::vector<Pose> frames(dof);
  std::vector<double> jacobian(6 * dof);
  std::vector<std::int32_t> chain;
  const JacobianMap j(jacobian.data(), 6, static_cast<Eigen::Index>(dof));
  robotics::forward_kinematics(model, q, frames);
  robotics::geometric_jacobian(model, 0, frames, robotics::JacobianFrame::base, jacobian);
  const Pose tip = robotics::tip_pose(model, 0, frames);
  const PseudoInverse inverse(j);
  inverse.correct(stack(path.velocity, path.angular_velocity),
                  {qd.data(), static_cast<Eigen::Index>(dof)});
  const Vector6 bias = velocity_acceleration(model, frames, tip, qd, chain);
  inverse.correct(stack(path.acceleration, path.angular_acceleration) - bias,
                  {qdd.data(), static_cast<Eigen::Index>(dof)});
}

}  // namespace

void joint_rates(const RobotModel& model, std::span<const double> times, std::span<const double> q,
                 std::span<const PathSample> path, std::span<double> qd, std::span<double> qdd) {
  static_assert(sizeof(PathSample) == 24 * sizeof(double));
  const std::size_t dof = model.dof(), n = times.size();
  differentiate(times, q, dof, qd, qdd);
  const bool is_together = dof >= 6 && dof <= kMostRates;
  const robotics::BatchKinematics kinematics(model);
  std::vector<double> scratch(kinematics.scratch_size()), jacobians(6 * dof * kRatesTogether),
      pivot(kRatesTogether), first(dof * kRatesTogether), second(first);
  for (std::size_t i = 0; i < n; i += kRatesTogether) {
    const std::size_t count = std::min(kRatesTogether, n - i);
    if (is_together) {
      kinematics.jacobians(0, q.subspan(i * dof, count * dof), robotics::JacobianFrame::base, {},
                           std::span(jacobians).first(6 * count * dof), scratch);
      kernel().correct({dof, count, jacobians.data(), path[i].pose.R.data(), &qd[i * dof],
                        &qdd[i * dof], first.data(), second.data(), pivot.data()});
    }
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t row = (i + k) * dof;
      if (!(is_together && pivot[k] > kClearlyRegular)) {
        correct_by_eigenvalues(model, q.subspan(row, dof), path[i + k], qd.subspan(row, dof),
                               qdd.subspan(row, dof));
        continue;
      }
      for (std::size_t j = 0; j < dof; ++j) {
        qd[row + j] = first[k * dof + j];
        qdd[row + j] = second[k * dof + j];
      }
    }
  }
}

}  // namespace robomosp::sim
