// SPDX-License-Identifier: Apache-2.0
// LoopMotion: the motions that closed loops leave a mechanism, and the forces of its motors that do
// the same work on them as forces at all joints of the open tree (layer: data processing,
// robotics).
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include <Eigen/Core>

#include <robomosp/sdk/result.h>
#include <robomosp/sdk/robot_model.h>

#include "robotics/decompositions.h"
#include "spatial/loops.h"

namespace robomosp::robotics {

/// Closed loops linearised at one state. J is the loop Jacobian (spatial/loops.h); the columns of Z
/// are a basis of the joint rates that keep the loops closed, J Z = 0.
///
/// Forces tau at the joints of the open tree are equivalent to motor forces f that do the same work
/// on every such motion: Z^T f = Z^T tau (Y. Nakamura, M. Ghodoussi, "Dynamics computation of
/// closed-link robot mechanisms with nonredundant and redundant actuators", IEEE Trans. Robotics
/// and Automation 5(3), 1989). With redundant motors f has the least sum of squares in SI units. If
/// the mechanism can move with all motors locked, the missing forces remain at the passive joints.
/// Motors are all joints that are not passive.
///
/// Z is not computed: f = tau - J^T l at the motors, where the loop forces l balance the passive
/// joints (by least squares) and, among those solutions, minimise f. The cost is the number of
/// joints times the square of the loop rows.
///
/// Copying copies the mechanism, not the state of at(). [one thread each]
class LoopMotion {
 public:
  /// A model that breaks its contract is an error.
  [[nodiscard]] static Result<LoopMotion> make(const RobotModel& model);
  LoopMotion(const LoopMotion& other);
  LoopMotion& operator=(const LoopMotion&) = delete;
  ~LoopMotion() = default;

  /// Moves to a state: coordinate_count() joint values and dof() rates, none = at rest.
  void at(std::span<const double> q, std::span<const double> qd = {});

  /// Greatest residual of the loops [m, rad].
  [[nodiscard]] double gap() const;
  /// Index of the loop with the greatest residual.
  [[nodiscard]] std::size_t worst_loop() const;
  /// How fast the rates of at() pull the loops apart, as a part of what the single joints do there:
  /// 0 = they keep them closed or are those of rest (below 1e-9 m/s and rad/s), at most 1.
  [[nodiscard]] double rate_error() const;
  /// The same of accelerations (dof(), none = zeros) at the rates of at().
  [[nodiscard]] double acceleration_error(std::span<const double> qdd) const;

  /// Changes rates of joints without motors, as little as possible, so that loops stay closed. The
  /// rates of at() are not used. Where no joint is passive all change.
  void follow_rates(std::span<double> qd);
  /// The same for accelerations at the rates of at().
  void follow_accelerations(std::span<double> qdd);

  /// Forces at the joints of the tree (dof()) become those of the motors.
  void to_motors(std::span<double> tau);
  /// The same for each column of a matrix of dof() rows, row-major.
  void to_motors(std::span<double> matrix, std::size_t columns);
  /// The tree's inertia M (dof() x dof(), row-major) becomes the one that the motors feel: R M R^T
  /// with R of to_motors(), so that rates that keep the loops closed have the same kinetic energy.
  void inertia_to_motors(std::span<double> m);

  /// One flag a velocity: it has a motor.
  [[nodiscard]] const std::vector<bool>& has_motor() const { return has_motor_; }

 private:
  using Matrix = Eigen::MatrixXd;
  using Decomposition = Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>;

  LoopMotion(std::shared_ptr<const spatial::BodyTree> tree, std::vector<bool> has_motor);
  /// The part of the greatest below which a direction of the loops counts as lost.
  [[nodiscard]] double lost_part() const;
  /// What the loops' forces do at joints without motors, and at motors.
  void factor();
  void reduce(Eigen::Ref<Matrix> columns);
  void follow(std::span<double> entries, const Eigen::VectorXd& pull);

  std::shared_ptr<const spatial::BodyTree> tree_;
  std::vector<bool> has_motor_;
  std::vector<Eigen::Index> motors_, passive_;
  bool is_factored_ = false;  ///< at the state of at()
  std::vector<spatial::MovingBody> bodies_;
  std::vector<spatial::Screw> columns_;
  std::vector<double> qd_;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> jacobian_;
  Eigen::VectorXd bias_, rate_, gap_;
  Matrix of_motors_;    ///< J^T, rows of the motors
  Matrix unheld_;       ///< forces of the loops that do nothing at joints without motors, columns
  Decomposition held_;  ///< J of joints without motors
  Decomposition pressing_;  ///< of_motors_ unheld_
  Eigen::Index held_rank_ = 0, pressing_rank_ = 0;
  Decomposition following_;
};

}  // namespace robomosp::robotics
