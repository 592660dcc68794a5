// SPDX-License-Identifier: Apache-2.0
#include "robotics/tip_motion.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Core>

#include "robotics/closure.h"
#include "robotics/decompositions.h"
#include "robotics/kinematics.h"

namespace robomosp::robotics {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Greatest motion of a joint between two closings on the way to a configuration beside [rad or m].
constexpr double kStep = 0.1;

std::size_t at(Index k) { return static_cast<std::size_t>(k); }

MatrixXd loops_jacobian(const RobotModel& model, std::span<const Pose> frames) {
  const auto rows = static_cast<Index>(loop_rows(model)), dof = static_cast<Index>(model.dof());
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> J(rows, dof);
  loop_jacobian(model, frames, {J.data(), at(J.size())});
  return J;
}

std::vector<double> numbers(const MatrixXd& m) { return {m.data(), m.data() + m.size()}; }

std::vector<std::vector<double>> columns_of(const MatrixXd& m) {
  std::vector<std::vector<double>> out;
  for (Index c = 0; c < m.cols(); ++c) out.push_back(numbers(m.col(c)));
  return out;
}

/// How many singular values count.
Index tip_rank(const VectorXd& values, double threshold) {
  Index rank = 0;
  while (rank < values.size() && values[rank] > 0 && values[rank] > threshold * values[0]) ++rank;
  return rank;
}

}  // namespace

TipMotion tip_motion(const RobotModel& model, std::size_t tip, std::span<const Pose> frames,
                     double threshold) {
  TipMotion out;
  const auto dof = static_cast<Index>(model.dof());
  out.jacobian.resize(6 * model.dof());
  geometric_jacobian(model, tip, frames, JacobianFrame::base, out.jacobian);
  const std::vector<bool> driven = actuated_velocities(model);
  const bool is_closed = !model.loops.empty();
  const bool all =
      !is_closed || std::none_of(driven.begin(), driven.end(), [](bool d) { return d; });
  for (std::size_t v = 0; v < model.dof(); ++v)
    if (all || driven[v]) out.motors.push_back(v);
  if (!is_closed || dof == 0) {
    out.feasible = columns_of(MatrixXd::Identity(dof, dof));
    out.feasible_twists = out.jacobian;
    return out;
  }
  const MatrixXd J = Eigen::Map<const MatrixXd>(out.jacobian.data(), 6, dof);
  const Eigen::JacobiSVD<MatrixXd> loops(loops_jacobian(model, frames), Eigen::ComputeFullV);
  const MatrixXd Z = loops.matrixV().rightCols(dof - tip_rank(loops.singularValues(), threshold));
  const MatrixXd twists = J * Z;
  out.feasible = columns_of(Z);
  out.feasible_twists = numbers(twists);
  MatrixXd of_motors(static_cast<Index>(out.motors.size()), Z.cols());
  for (Index m = 0; m < of_motors.rows(); ++m)
    of_motors.row(m) = Z.row(static_cast<Index>(out.motors[at(m)]));
  out.jacobian.clear();
  if (Z.cols() == 0) {
    out.jacobian.resize(6 * out.motors.size(), 0.0);
    return out;
  }
  const Eigen::JacobiSVD<MatrixXd> driving(of_motors, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const VectorXd& s = driving.singularValues();
  // Z is orthonormal: what the motors feel of a unit motion is at most 1, whatever the greatest is.
  Index rank = 0;
  while (rank < s.size() && s[rank] > threshold) ++rank;
  out.hold = s[s.size() - 1];
  const MatrixXd V = driving.matrixV().leftCols(rank);
  out.jacobian = numbers(twists * V * s.head(rank).cwiseInverse().asDiagonal() *
                         driving.matrixU().leftCols(rank).transpose());
  const MatrixXd loose = driving.matrixV().rightCols(Z.cols() - rank);
  out.loose = columns_of(Z * loose);
  out.self_motion_twists = numbers(twists * loose);
  return out;
}

std::vector<double> configuration_beside(const RobotModel& model, std::span<const double> q,
                                         double size, unsigned seed) {
  VectorXd way(static_cast<Index>(model.dof()));
  unsigned state = seed * 2654435761U + 12345U;
  for (double& x : way) {
    state = state * 1664525U + 1013904223U;
    x = size * (static_cast<double>(state >> 8) / 8388608.0 - 1);
  }
  std::vector<double> out(q.begin(), q.end());
  const auto move = [&](const VectorXd& step) {
    move_configuration(model, {step.data(), at(step.size())}, out);
  };
  if (model.loops.empty()) {
    move(way);
    return out;
  }
  const auto steps = std::max(1.0, std::ceil(size / kStep));
  const std::vector<bool> none(model.dof(), false);
  std::vector<Pose> frames(model.joints.size());
  // From a singular place the motions of any branch may lead on; a little way off it is reported.
  for (double i = 0; i < steps; ++i) {
    forward_kinematics(model, out, frames);
    const MatrixXd J = loops_jacobian(model, frames);
    Eigen::CompleteOrthogonalDecomposition<MatrixXd> loops;
    loops.setThreshold(1e-8);
    loops.compute(J);
    VectorXd step = way - loops.solve(J * way);
    // As long as the way itself: few motions are left of many joints.
    if (!(step.norm() > 1e-12 * way.norm())) return out;
    step *= way.norm() / step.norm() / steps;
    const std::vector<double> before = out;
    move(step);
    Closure closed = close_loops(model, out, out, none);
    if (!closed.is_closed) return before;
    out = std::move(closed.q);
  }
  return out;
}

double open_by(const RobotModel& model, std::span<const Pose> joint_frames) {
  std::vector<double> residual(loop_rows(model));
  loop_residual(model, joint_frames, residual);
  double most = 0;
  for (const double r : residual) most = std::max(most, std::fabs(r));
  return most;
}

}  // namespace robomosp::robotics
