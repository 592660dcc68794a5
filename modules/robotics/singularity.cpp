// SPDX-License-Identifier: Apache-2.0
#include "robotics/singularity.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/SVD>

#include "robotics/kinematics.h"
#include "spatial/pose.h"
#include "spatial/print.h"

namespace robomosp::robotics {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

MatrixXd matrix_of(std::span<const double> jacobian) {
  return Eigen::Map<const Eigen::Matrix<double, 6, Eigen::Dynamic>>(
      jacobian.data(), 6, static_cast<Index>(jacobian.size() / 6));
}

MatrixXd part_of(const MatrixXd& J, TwistPart part) {
  if (part == TwistPart::translation) return J.topRows<3>();
  if (part == TwistPart::rotation) return J.bottomRows<3>();
  return J;
}

// Of the two senses the one whose greatest part is positive; what is rounding becomes 0.
Twist tidy(VectorXd u) {
  u.normalize();
  Index greatest = 0;
  u.cwiseAbs().maxCoeff(&greatest);
  if (u[greatest] < 0) u = -u;
  Twist t{};
  for (Index k = 0; k < 6; ++k)
    t[static_cast<std::size_t>(k)] = std::fabs(u[k]) < 1e-6 ? 0.0 : u[k];
  return t;
}

MatrixXd scaled_jacobian(const RobotModel& model, std::size_t tip, std::span<const double> q,
                         double length, TwistPart part) {
  std::vector<Pose> frames(model.joints.size());
  forward_kinematics(model, q, frames);
  std::vector<double> columns(6 * model.dof());
  geometric_jacobian(model, tip, frames, JacobianFrame::base, columns);
  MatrixXd J = matrix_of(columns);
  J.topRows<3>() /= length;
  return part_of(J, part);
}

// The configuration a little beside q: every coordinate moved by `size`, signs by the bits of
// `seed`. Quaternions are moved within their length.
std::vector<double> beside(const RobotModel& model, std::span<const double> q, double size,
                           unsigned seed) {
  std::vector<double> out(q.begin(), q.end());
  unsigned state = seed * 2654435761U + 12345U;
  for (const JointModel& j : model.joints) {
    if (j.is_coupled()) continue;
    for (std::int32_t k = 0; k < coordinate_count(j.type); ++k) {
      state = state * 1664525U + 1013904223U;
      const double sign = static_cast<double>(state >> 8) / 8388608.0 - 1;
      out[static_cast<std::size_t>(j.q_index + k)] += sign * size;
    }
  }
  return out;
}

int rank_of(const VectorXd& values, double threshold) {
  int rank = 0;
  for (Index i = 0; i < values.size(); ++i)
    rank += values[i] > threshold * values[0] && values[i] > 0;
  return rank;
}

}  // namespace

Dexterity dexterity(std::span<const double> jacobian, TwistPart part, double length) {
  MatrixXd J = matrix_of(jacobian);
  J.topRows<3>() /= length;
  J = part_of(J, part);
  Dexterity d;
  if (J.cols() == 0) return d;
  const Eigen::JacobiSVD<MatrixXd> svd(J, Eigen::ComputeThinU);
  const VectorXd& s = svd.singularValues();
  d.singular_values.assign(s.data(), s.data() + s.size());
  d.yoshikawa = s.prod();
  d.least = s[s.size() - 1];
  d.condition = d.least > 1e-15 * s[0] ? s[0] / d.least : std::numeric_limits<double>::infinity();
  VectorXd u = VectorXd::Zero(6);
  const VectorXd weakest = svd.matrixU().col(s.size() - 1);
  u.segment(part == TwistPart::rotation ? 3 : 0, weakest.size()) = weakest;
  if (part == TwistPart::all) u.head<3>() *= length;
  d.weakest = tidy(u);
  return d;
}

Ellipsoid ellipsoid(std::span<const double> jacobian, TwistPart part) {
  Ellipsoid e;
  const MatrixXd J =
      part_of(matrix_of(jacobian), part == TwistPart::all ? TwistPart::translation : part);
  MatrixXd square = MatrixXd::Zero(3, std::max<Index>(3, J.cols()));
  square.leftCols(J.cols()) = J;
  const Eigen::JacobiSVD<MatrixXd> svd(square, Eigen::ComputeFullU);
  Eigen::Matrix3d axes = svd.matrixU();
  if (axes.determinant() < 0) axes.col(2) = -axes.col(2);
  for (Index r = 0; r < 3; ++r)
    for (Index c = 0; c < 3; ++c) e.axes[static_cast<std::size_t>(3 * r + c)] = axes(r, c);
  for (std::size_t i = 0; i < 3; ++i) {
    const double s = svd.singularValues()[static_cast<Index>(i)];
    const bool is_lost = !(s > 1e-12 * svd.singularValues()[0]);
    e.velocity[i] = is_lost ? 0.0 : s;
    e.force[i] = is_lost ? std::numeric_limits<double>::infinity() : 1 / s;
  }
  return e;
}

double reach(const RobotModel& model, std::size_t tip) {
  double length = spatial::norm(model.tips[tip].tool.p);
  for (std::int32_t j = model.tips[tip].joint; j >= 0;
       j = model.joints[static_cast<std::size_t>(j)].parent) {
    const JointModel& m = model.joints[static_cast<std::size_t>(j)];
    if (m.parent >= 0) length += spatial::norm(m.placement.p);
    const double range = m.upper - m.lower;
    if (m.type == JointType::prismatic && std::isfinite(range)) length += 0.5 * range;
  }
  return length > 1e-9 ? length : 1.0;
}

Singularity singularity(const RobotModel& model, std::size_t tip, std::span<const double> q,
                        TwistPart part, double threshold) {
  Singularity out;
  const double length = reach(model, tip);
  const MatrixXd J = scaled_jacobian(model, tip, q, length, part);
  if (J.cols() == 0) return out;
  const Eigen::JacobiSVD<MatrixXd> svd(J, Eigen::ComputeFullU | Eigen::ComputeFullV);
  out.rank = rank_of(svd.singularValues(), threshold);
  out.full_rank = out.rank;
  for (unsigned i = 1; i <= 8; ++i) {
    const MatrixXd other = scaled_jacobian(model, tip, beside(model, q, 0.7, i), length, part);
    out.full_rank =
        std::max(out.full_rank, rank_of(Eigen::JacobiSVD<MatrixXd>(other).singularValues(), 1e-9));
  }
  if (out.full_rank > 0)
    out.least = svd.singularValues()[out.full_rank - 1] / svd.singularValues()[0];
  for (Index c = out.rank; c < J.cols(); ++c) {
    const VectorXd whole = svd.matrixV().col(c);
    const VectorXd v = (whole.array().abs() < 1e-9).select(0.0, whole);
    out.idle.emplace_back(v.data(), v.data() + v.size());
  }
  const int lost = out.full_rank - out.rank;
  if (lost <= 0) return out;
  const MatrixXd null = svd.matrixU().rightCols(J.rows() - out.rank);
  // Of all that cannot be done here, what can be done a little beside: its part in the null space.
  MatrixXd near(J.rows() - out.rank, 0);
  for (unsigned i = 1; i <= 4; ++i) {
    const MatrixXd here =
        null.transpose() * scaled_jacobian(model, tip, beside(model, q, 1e-4, i), length, part);
    near.conservativeResize(Eigen::NoChange, near.cols() + here.cols());
    near.rightCols(here.cols()) = here;
  }
  const Eigen::JacobiSVD<MatrixXd> back(near, Eigen::ComputeThinU);
  MatrixXd directions = null * back.matrixU().leftCols(lost);
  if (part == TwistPart::translation) directions.conservativeResizeLike(MatrixXd::Zero(6, lost));
  if (part == TwistPart::rotation) {
    MatrixXd whole = MatrixXd::Zero(6, lost);
    whole.bottomRows<3>() = directions;
    directions = whole;
  }
  // Pure translations first, where several directions are lost: they are the plainest to tell.
  if (lost > 1 && part == TwistPart::all) {
    const Eigen::JacobiSVD<MatrixXd> turning(directions.bottomRows<3>(), Eigen::ComputeFullV);
    directions = (directions * turning.matrixV()).rowwise().reverse().eval();
  }
  for (Index c = 0; c < directions.cols(); ++c) {
    VectorXd t = directions.col(c);
    t.head<3>() *= length;
    t = (t.array().abs() < 1e-3 * t.cwiseAbs().maxCoeff()).select(0.0, t);
    out.lost.push_back(tidy(t));
  }
  return out;
}

std::string lost_words(const Twist& t) {
  const double v = std::hypot(t[0], t[1], t[2]), w = std::hypot(t[3], t[4], t[5]);
  const auto axis = [](double x, double y, double z, double n) {
    const auto number = [&](double a) { return spatial::print_number(a / n + 0.0, 3); };
    return "(" + number(x) + ", " + number(y) + ", " + number(z) + ")";
  };
  if (!(v > 0) && !(w > 0)) return "can do everything";
  if (w < 0.02 * v) return "cannot move along " + axis(t[0], t[1], t[2], v);
  if (v < 0.02 * w) return "cannot turn about " + axis(t[3], t[4], t[5], w);
  return "cannot move along " + axis(t[0], t[1], t[2], v) + " while turning about " +
         axis(t[3], t[4], t[5], w);
}

}  // namespace robomosp::robotics
