// SPDX-License-Identifier: Apache-2.0
#include "robotics/loop_motion.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace robomosp::robotics {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Directions of loops and of motors below this part of the greatest count as lost.
constexpr double kLostDirection = 1e-9;
/// Loops that are open by a little hold in directions that they would not hold when closed, by that
/// much and by what lengths are less than 1 m.
constexpr double kOpenedBy = 1e3;
/// Rates and accelerations of loops that count as none.
constexpr double kNoMotion = 1e-9;

std::size_t loop_index(Index i) { return static_cast<std::size_t>(i); }

/// The columns of an orthogonal matrix that its decomposition left out of its range.
void left_out_columns(const Eigen::CompleteOrthogonalDecomposition<MatrixXd>& of, Index rank,
                      MatrixXd& out) {
  const Index rows = of.rows(), left = rows - rank;
  out.setZero(rows, left);
  out.bottomRows(left).setIdentity();
  if (left > 0) out.applyOnTheLeft(of.householderQ());
}

}  // namespace

Result<LoopMotion> LoopMotion::make(const RobotModel& model) {
  RMP_TRY_ASSIGN(spatial::BodyTree tree, spatial::make_body_tree(model));
  std::vector<bool> has_motor(tree.velocities, true);
  for (const JointModel& j : model.joints)
    if (!j.is_coupled() && j.passive)
      for (std::int32_t k = 0; k < velocity_count(j.type); ++k)
        has_motor[static_cast<std::size_t>(j.v_index + k)] = false;
  return LoopMotion(std::make_shared<const spatial::BodyTree>(std::move(tree)),
                    std::move(has_motor));
}

LoopMotion::LoopMotion(std::shared_ptr<const spatial::BodyTree> tree, std::vector<bool> has_motor)
    : tree_(std::move(tree)),
      has_motor_(std::move(has_motor)),
      bodies_(tree_->bodies.size()),
      columns_(tree_->columns),
      qd_(tree_->velocities) {
  for (std::size_t v = 0; v < has_motor_.size(); ++v)
    (has_motor_[v] ? motors_ : passive_).push_back(static_cast<Index>(v));
  const auto rows = static_cast<Index>(spatial::loop_rows(tree_->loops));
  jacobian_.setZero(rows, static_cast<Index>(tree_->velocities));
  bias_.setZero(rows), rate_.setZero(rows), gap_.setZero(rows);
}

LoopMotion::LoopMotion(const LoopMotion& other) : LoopMotion(other.tree_, other.has_motor_) {}

void LoopMotion::at(std::span<const double> q, std::span<const double> qd) {
  qd_.assign(qd.begin(), qd.end());
  qd_.resize(tree_->velocities);
  spatial::TreeState state;
  state.q = q.data();
  state.qd = qd_.data();
  spatial::sweep(*tree_, state, bodies_, columns_);
  const auto span = [](auto& m) { return std::span<double>(m.data(), loop_index(m.size())); };
  spatial::loop_constraints(*tree_, bodies_, columns_, state,
                            {span(jacobian_), span(bias_), span(rate_), span(gap_)});
  is_factored_ = false;
}

double LoopMotion::gap() const { return gap_.size() == 0 ? 0 : gap_.cwiseAbs().maxCoeff(); }

double LoopMotion::lost_part() const { return std::clamp(kOpenedBy * gap(), kLostDirection, 1e-3); }

std::size_t LoopMotion::worst_loop() const {
  if (gap_.size() == 0) return 0;
  Index worst = 0;
  gap_.cwiseAbs().maxCoeff(&worst);
  return spatial::loop_of_row(tree_->loops, loop_index(worst));
}

double LoopMotion::rate_error() const {
  if (gap_.size() == 0) return 0;
  const VectorXd qd = Eigen::Map<const VectorXd>(qd_.data(), static_cast<Index>(qd_.size()));
  const double all = (jacobian_.cwiseAbs() * qd.cwiseAbs()).maxCoeff();
  return all > kNoMotion ? rate_.cwiseAbs().maxCoeff() / all : 0;
}

double LoopMotion::acceleration_error(std::span<const double> qdd) const {
  if (gap_.size() == 0) return 0;
  VectorXd a = VectorXd::Zero(jacobian_.cols());
  for (std::size_t v = 0; v < qdd.size(); ++v) a[static_cast<Index>(v)] = qdd[v];
  const double all = (jacobian_.cwiseAbs() * a.cwiseAbs() + bias_.cwiseAbs()).maxCoeff();
  return all > kNoMotion ? (jacobian_ * a + bias_).cwiseAbs().maxCoeff() / all : 0;
}

void LoopMotion::follow(std::span<double> entries, const VectorXd& pull) {
  const std::vector<Index>& moved = passive_.empty() ? motors_ : passive_;
  MatrixXd of(jacobian_.rows(), static_cast<Index>(moved.size()));
  for (Index k = 0; k < of.cols(); ++k) of.col(k) = jacobian_.col(moved[loop_index(k)]);
  if (of.size() == 0) return;
  following_.setThreshold(lost_part());
  following_.compute(of);
  const VectorXd by = following_.solve(-pull);
  for (Index k = 0; k < of.cols(); ++k) entries[loop_index(moved[loop_index(k)])] += by[k];
}

void LoopMotion::follow_rates(std::span<double> qd) {
  const Eigen::Map<const VectorXd> v(qd.data(), static_cast<Index>(qd.size()));
  follow(qd, jacobian_ * v);
}

void LoopMotion::follow_accelerations(std::span<double> qdd) {
  const Eigen::Map<const VectorXd> a(qdd.data(), static_cast<Index>(qdd.size()));
  follow(qdd, jacobian_ * a + bias_);
}

void LoopMotion::factor() {
  if (is_factored_) return;
  is_factored_ = true;
  const Index rows = jacobian_.rows();
  const double greatest = jacobian_.size() == 0 ? 0 : jacobian_.cwiseAbs().maxCoeff();
  // What is lost is so beside all joints, not only beside those of a part.
  const auto compute = [&](Decomposition& of, const MatrixXd& m) {
    const double most = m.size() == 0 ? 0 : m.cwiseAbs().maxCoeff();
    if (!(most > lost_part() * greatest)) return Index{0};
    of.setThreshold(lost_part() * greatest / most);
    of.compute(m);
    return of.rank();
  };
  MatrixXd of_passive(rows, static_cast<Index>(passive_.size()));
  for (Index k = 0; k < of_passive.cols(); ++k)
    of_passive.col(k) = jacobian_.col(passive_[loop_index(k)]);
  held_rank_ = compute(held_, of_passive);
  if (held_rank_ > 0) left_out_columns(held_, held_rank_, unheld_);
  else unheld_.setIdentity(rows, rows);
  of_motors_.resize(static_cast<Index>(motors_.size()), rows);
  for (Index m = 0; m < of_motors_.rows(); ++m)
    of_motors_.row(m) = jacobian_.col(motors_[loop_index(m)]).transpose();
  pressing_rank_ = compute(pressing_, of_motors_ * unheld_);
}

void LoopMotion::reduce(Eigen::Ref<MatrixXd> columns) {
  factor();
  const Index motors = static_cast<Index>(motors_.size()),
              passive = static_cast<Index>(passive_.size());
  MatrixXd f(motors, columns.cols()), p(passive, columns.cols());
  for (Index m = 0; m < motors; ++m) f.row(m) = columns.row(motors_[loop_index(m)]);
  for (Index k = 0; k < passive; ++k) p.row(k) = columns.row(passive_[loop_index(k)]);
  // The loops' forces carry what joints without motors would have to give ...
  if (held_rank_ > 0) {
    const MatrixXd forces = held_.transpose().solve(p);
    f -= of_motors_ * forces;
    if (held_rank_ < passive)
      for (Index k = 0; k < passive; ++k)
        p.row(k) -= jacobian_.col(passive_[loop_index(k)]).transpose() * forces;
    else p.setZero();
  }
  // ... and those that the others leave open make the motors' the least.
  if (pressing_rank_ > 0) f -= of_motors_ * (unheld_ * pressing_.solve(f));
  for (Index m = 0; m < motors; ++m) columns.row(motors_[loop_index(m)]) = f.row(m);
  for (Index k = 0; k < passive; ++k) columns.row(passive_[loop_index(k)]) = p.row(k);
}

void LoopMotion::to_motors(std::span<double> tau) {
  Eigen::Map<MatrixXd> column(tau.data(), static_cast<Index>(tau.size()), 1);
  reduce(column);
}

void LoopMotion::to_motors(std::span<double> matrix, std::size_t columns) {
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  Eigen::Map<RowMajor> given(matrix.data(), jacobian_.cols(), static_cast<Index>(columns));
  MatrixXd all = given;
  reduce(all);
  given = all;
}

void LoopMotion::inertia_to_motors(std::span<double> m) {
  const Index n = jacobian_.cols();
  Eigen::Map<MatrixXd> given(m.data(), n, n);
  MatrixXd half = given;
  reduce(half);
  MatrixXd whole = half.transpose();
  reduce(whole);
  given = 0.5 * (whole + whole.transpose());
}

}  // namespace robomosp::robotics
