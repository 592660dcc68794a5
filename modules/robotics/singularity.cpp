// SPDX-License-Identifier: Apache-2.0
#include "robotics/singularity.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "robotics/decompositions.h"
#include "robotics/kinematics.h"
#include "robotics/tip_motion.h"
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

/// Rows of `part` of twists, lengths in units of `length`.
MatrixXd scaled(std::span<const double> twists, double length, TwistPart part) {
  MatrixXd J = matrix_of(twists);
  J.topRows<3>() /= length;
  return part_of(J, part);
}

TipMotion motion_at(const RobotModel& model, std::size_t tip, std::span<const double> q,
                    double threshold) {
  std::vector<Pose> frames(model.joints.size());
  forward_kinematics(model, q, frames);
  return tip_motion(model, tip, frames, threshold);
}

/// What the tip can do a little or farther beside, in the direction that `seed` gives.
TipMotion motion_beside(const RobotModel& model, std::size_t tip, std::span<const double> q,
                        double size, unsigned seed) {
  return motion_at(model, tip, configuration_beside(model, q, size, seed), 1e-9);
}

/// Directions that loose motions give the tip, orthonormal; and all others.
struct Split {
  MatrixXd loose, held;
};
Split split(const MatrixXd& loose) {
  const Index rows = loose.rows();
  if (loose.cols() == 0) return {MatrixXd(rows, 0), MatrixXd::Identity(rows, rows)};
  const Eigen::JacobiSVD<MatrixXd> svd(loose, Eigen::ComputeFullU);
  Index rank = 0;
  while (rank < svd.singularValues().size() && svd.singularValues()[rank] > 1e-9) ++rank;
  return {svd.matrixU().leftCols(rank), svd.matrixU().rightCols(rows - rank)};
}

/// Below it all counts as standing still, of unit joint rates and lengths in the reach.
constexpr double kStill = 1e-3;

int rank_of(const VectorXd& values, double threshold) {
  int rank = 0;
  for (Index i = 0; i < values.size(); ++i)
    rank += values[i] > threshold * std::max(values[0], kStill);
  return rank;
}

/// "move along (0, 0, 1)" and the like; nothing for zeros.
std::string direction_words(const Twist& t) {
  const double v = std::hypot(t[0], t[1], t[2]), w = std::hypot(t[3], t[4], t[5]);
  const auto axis = [](double x, double y, double z, double n) {
    const auto number = [&](double a) { return spatial::print_number(a / n + 0.0, 3); };
    return "(" + number(x) + ", " + number(y) + ", " + number(z) + ")";
  };
  if (!(v > 0) && !(w > 0)) return {};
  if (w < 0.02 * v) return "move along " + axis(t[0], t[1], t[2], v);
  if (v < 0.02 * w) return "turn about " + axis(t[3], t[4], t[5], w);
  return "move along " + axis(t[0], t[1], t[2], v) + " while turning about " +
         axis(t[3], t[4], t[5], w);
}

}  // namespace

Dexterity dexterity(std::span<const double> jacobian, TwistPart part, double length,
                    std::span<const double> loose) {
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  const MatrixXd J = scaled(jacobian, length, part);
  const Split directions = split(scaled(loose, length, part));
  const Index count = std::min(J.rows(), J.cols()), endless = directions.loose.cols();
  Dexterity d;
  if (count == 0) return d;
  if (endless >= count) {
    d.singular_values.assign(static_cast<std::size_t>(count), kInfinite);
    d.yoshikawa = d.condition = d.least = kInfinite;
    return d;
  }
  const MatrixXd others = endless > 0 ? MatrixXd(directions.held.transpose() * J) : J;
  const Eigen::JacobiSVD<MatrixXd> svd(others, Eigen::ComputeThinU);
  const VectorXd s = svd.singularValues().head(count - endless);
  d.singular_values.assign(static_cast<std::size_t>(endless), kInfinite);
  d.singular_values.insert(d.singular_values.end(), s.data(), s.data() + s.size());
  d.least = s[s.size() - 1];
  const bool is_singular = !(d.least > 1e-15 * s[0]);
  d.yoshikawa = endless == 0 ? s.prod() : is_singular ? 0.0 : kInfinite;
  d.condition = endless > 0 || is_singular ? kInfinite : s[0] / d.least;
  VectorXd u = VectorXd::Zero(6);
  VectorXd weakest = svd.matrixU().col(s.size() - 1);
  if (endless > 0) weakest = directions.held * weakest;
  u.segment(part == TwistPart::rotation ? 3 : 0, weakest.size()) = weakest;
  if (part == TwistPart::all) u.head<3>() *= length;
  d.weakest = tidy(u);
  return d;
}

Ellipsoid ellipsoid(std::span<const double> jacobian, TwistPart part,
                    std::span<const double> loose) {
  Ellipsoid e;
  if (part == TwistPart::all) part = TwistPart::translation;
  const MatrixXd J = scaled(jacobian, 1, part);
  const Split directions = split(scaled(loose, 1, part));
  const Index endless = directions.loose.cols(), held = 3 - endless;
  Eigen::Matrix3d axes;
  axes.leftCols(endless) = directions.loose;
  VectorXd s(held);
  if (held > 0) {
    MatrixXd square = MatrixXd::Zero(held, std::max<Index>(held, J.cols()));
    square.leftCols(J.cols()) = endless > 0 ? MatrixXd(directions.held.transpose() * J) : J;
    const Eigen::JacobiSVD<MatrixXd> svd(square, Eigen::ComputeFullU);
    axes.rightCols(held) =
        endless > 0 ? MatrixXd(directions.held * svd.matrixU()) : MatrixXd(svd.matrixU());
    s = svd.singularValues();
  }
  if (axes.determinant() < 0) axes.col(2) = -axes.col(2);
  for (Index r = 0; r < 3; ++r)
    for (Index c = 0; c < 3; ++c) e.axes[static_cast<std::size_t>(3 * r + c)] = axes(r, c);
  for (Index i = 0; i < 3; ++i) {
    const auto k = static_cast<std::size_t>(i);
    if (i < endless) {
      e.velocity[k] = std::numeric_limits<double>::infinity();
      e.force[k] = 0;
      continue;
    }
    const double value = s[i - endless];
    const bool is_lost = !(value > 1e-12 * s[0]);
    e.velocity[k] = is_lost ? 0.0 : value;
    e.force[k] = is_lost ? std::numeric_limits<double>::infinity() : 1 / value;
  }
  return e;
}

double reach(const RobotModel& model, std::size_t tip) {
  const auto way = [&](std::int32_t joint, const Pose& local) {
    double length = spatial::norm(local.p);
    for (std::int32_t j = joint; j >= 0; j = model.joints[static_cast<std::size_t>(j)].parent) {
      const JointModel& m = model.joints[static_cast<std::size_t>(j)];
      if (m.parent >= 0) length += spatial::norm(m.placement.p);
      const double range = m.upper - m.lower;
      if (m.type == JointType::prismatic && std::isfinite(range)) length += 0.5 * range;
    }
    return length;
  };
  double length = way(model.tips[tip].joint, model.tips[tip].tool);
  // A platform that is a free body of the tree hangs on the legs that close its loops.
  for (const LoopModel& l : model.loops)
    length = std::max({length, way(l.joint_a, l.in_a), way(l.joint_b, l.in_b)});
  return length > 1e-9 ? length : 1.0;
}

Singularity singularity(const RobotModel& model, std::size_t tip, std::span<const double> q,
                        TwistPart part, double threshold) {
  Singularity out;
  const double length = reach(model, tip);
  const TipMotion here = motion_at(model, tip, q, threshold);
  out.mobility = static_cast<int>(here.feasible.size());
  out.least_mobility = out.mobility;
  out.hold = here.hold;
  const MatrixXd J = scaled(here.feasible_twists, length, part);
  if (J.cols() == 0) return out;
  const Eigen::JacobiSVD<MatrixXd> svd(J, Eigen::ComputeFullU | Eigen::ComputeFullV);
  out.rank = rank_of(svd.singularValues(), threshold);
  out.full_rank = out.rank;
  std::size_t loose = here.loose.size();
  for (unsigned i = 1; i <= 8; ++i) {
    const TipMotion other = motion_beside(model, tip, q, 0.7, i);
    const MatrixXd twists = scaled(other.feasible_twists, length, part);
    out.full_rank =
        std::max(out.full_rank, rank_of(Eigen::JacobiSVD<MatrixXd>(twists).singularValues(), 1e-9));
    out.least_mobility = std::min(out.least_mobility, static_cast<int>(other.feasible.size()));
    loose = std::min(loose, other.loose.size());
  }
  if (here.loose.size() > loose) {
    out.loose = here.loose;
    MatrixXd twists = matrix_of(here.self_motion_twists);
    if (part == TwistPart::translation) twists.bottomRows<3>().setZero();
    if (part == TwistPart::rotation) twists.topRows<3>().setZero();
    for (Index c = 0; c < twists.cols(); ++c)
      out.gained.push_back(twists.col(c).norm() > 1e-9 ? tidy(twists.col(c)) : Twist{});
  }
  if (out.rank > 0 && out.full_rank <= svd.singularValues().size())
    out.least = svd.singularValues()[out.full_rank - 1] / svd.singularValues()[0];
  for (Index c = out.rank; c < J.cols(); ++c) {
    VectorXd whole = VectorXd::Zero(static_cast<Index>(model.dof()));
    for (Index k = 0; k < J.cols(); ++k)
      whole += svd.matrixV()(k, c) *
               Eigen::Map<const VectorXd>(here.feasible[static_cast<std::size_t>(k)].data(),
                                          whole.size());
    const VectorXd v = (whole.array().abs() < 1e-9).select(0.0, whole);
    out.idle.emplace_back(v.data(), v.data() + v.size());
  }
  const int lost = out.full_rank - out.rank;
  if (lost <= 0) return out;
  const MatrixXd null = svd.matrixU().rightCols(J.rows() - out.rank);
  // Of all that cannot be done here, what can be done a little beside: its part in the null space.
  MatrixXd near(J.rows() - out.rank, 0);
  for (unsigned i = 1; i <= 4; ++i) {
    const MatrixXd part_in_null =
        null.transpose() *
        scaled(motion_beside(model, tip, q, 1e-4, i).feasible_twists, length, part);
    near.conservativeResize(Eigen::NoChange, near.cols() + part_in_null.cols());
    near.rightCols(part_in_null.cols()) = part_in_null;
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

bool is_surely_regular(const RobotModel& model, std::size_t tip, std::span<const Pose> joint_frames,
                       TwistPart part, double threshold) {
  const std::size_t dof = model.dof();
  if (!model.loops.empty() || dof == 0) return false;
  std::vector<double> J(6 * dof);
  geometric_jacobian(model, tip, joint_frames, JacobianFrame::base, J);
  const double length = reach(model, tip);
  const std::size_t first = part == TwistPart::rotation ? 3 : 0,
                    rows = part == TwistPart::all ? 6 : 3;
  double square = 0;  // of all entries: the greatest singular value is no greater
  for (std::size_t j = 0; j < dof; ++j)
    for (std::size_t i = 0; i < rows; ++i) {
      double& x = J[6 * j + i] = J[6 * j + first + i];
      if (first + i < 3) x /= length;
      square += x * x;
    }
  // The products of its rows, or of its columns if these are fewer; less the square of what counts
  // as lost, they are positive definite when all that is there is above it.
  const bool by_rows = rows <= dof;
  const std::size_t n = std::min(rows, dof);
  std::array<double, 36> G{};
  for (std::size_t a = 0; a < n; ++a)
    for (std::size_t b = 0; b <= a; ++b)
      for (std::size_t k = 0; k < (by_rows ? dof : rows); ++k)
        G[6 * a + b] += by_rows ? J[6 * k + a] * J[6 * k + b] : J[6 * a + k] * J[6 * b + k];
  constexpr double kMargin = 1.01;
  const double least = kMargin * threshold * std::max(std::sqrt(square), kStill);
  for (std::size_t a = 0; a < n; ++a) {
    for (std::size_t b = 0; b < a; ++b) {
      for (std::size_t k = 0; k < b; ++k) G[6 * a + b] -= G[6 * a + k] * G[6 * b + k];
      G[6 * a + b] /= G[6 * b + b];
    }
    double pivot = G[6 * a + a] - least * least;
    for (std::size_t k = 0; k < a; ++k) pivot -= G[6 * a + k] * G[6 * a + k];
    // Rounding is some 1e-15 of all.
    if (!(pivot > 1e-13 * square)) return false;
    G[6 * a + a] = std::sqrt(pivot);
  }
  return true;
}

std::string lost_words(const Twist& t) {
  const std::string words = direction_words(t);
  return words.empty() ? "can move in all directions" : "cannot " + words;
}

std::string gained_words(const Twist& t) {
  const std::string words = direction_words(t);
  return (words.empty() ? "joints can move, the tool at rest," : "can " + words) +
         " with the motors at rest";
}

}  // namespace robomosp::robotics
