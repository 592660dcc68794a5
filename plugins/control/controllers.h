// SPDX-License-Identifier: Apache-2.0
// The providers of this plugin (layer: plugin).
#pragma once

#include <vector>

#include <robomosp/sdk/controller.h>

#include "gains.h"
#include "spatial/body_tree.h"

namespace robomosp::control {

/// tau = M(q) (qdd_w + Kd ed + Kp e) + c(q, qd) + g(q): the closed loop is linear, e'' + Kd e' +
/// Kp e = 0 (Luh, Walker, Paul, IEEE Trans. Automatic Control 25, 1980; Siciliano et al., Robotics,
/// 8.5.2).
class ComputedTorque final : public Controller {
 public:
  Result<void> prepare(const RobotModel& model, const InverseDynamics& dynamics,
                       const Params& params) override;
  [[nodiscard]] std::size_t state_size() const override { return 0; }
  [[nodiscard]] std::size_t scratch_size() const override;
  Result<void> torques(const ControlInput& in, std::span<double> state, std::span<double> scratch,
                       std::span<double> tau) const override;

 private:
  Plant plant_;
  std::vector<double> kp_, kd_;  ///< [1/s^2], [1/s]
  bool overcomes_friction_ = true;
};

/// tau = g(q) + Kp e + Kd ed (Takegaki, Arimoto, J. Dyn. Sys. Meas. Control 103, 1981).
class PdGravity final : public Controller {
 public:
  Result<void> prepare(const RobotModel& model, const InverseDynamics& dynamics,
                       const Params& params) override;
  [[nodiscard]] std::size_t state_size() const override { return 0; }
  [[nodiscard]] std::size_t scratch_size() const override;
  Result<void> torques(const ControlInput& in, std::span<double> state, std::span<double> scratch,
                       std::span<double> tau) const override;

 private:
  Plant plant_;
  std::vector<double> kp_, kd_;  ///< [N m/rad or N/m], [N m s/rad or N s/m]
};

/// tau = Kp e + Ki integral(e) + Kd ed, joint by joint. The integral is frozen while the torque is
/// at its limit and e would drive it further (conditional integration; Astrom, Hagglund, Advanced
/// PID Control, 3.5).
class JointPid final : public Controller {
 public:
  Result<void> prepare(const RobotModel& model, const InverseDynamics& dynamics,
                       const Params& params) override;
  [[nodiscard]] std::size_t state_size() const override { return plant_.dof(); }
  [[nodiscard]] std::size_t scratch_size() const override { return plant_.dof(); }
  Result<void> torques(const ControlInput& in, std::span<double> state, std::span<double> scratch,
                       std::span<double> tau) const override;

 private:
  Plant plant_;
  std::vector<double> kp_, kd_, ki_, limit_;
};

/// The tip 0 is driven as a unit mass: tau = J^T L (a - Jd qd) + h + (1 - J^T Jbar^T) tau_0 with L
/// = (J M^-1 J^T)^-1 and Jbar = M^-1 J^T L; tau_0 keeps the posture in the null space of the tip's
/// task (Khatib, IEEE J. Robotics and Automation 3, 1987). Near a singular configuration L is
/// damped. Closed loops, with rows A qdd + b = 0, reduce the joints' mobility to M^-1 - M^-1 A^T (A
/// M^-1 A^T)^-1 A M^-1 in place of M^-1 and add the acceleration -M^-1 A^T (A M^-1 A^T)^-1 b,
/// independent of the torques.
class OperationalSpace final : public Controller {
 public:
  Result<void> prepare(const RobotModel& model, const InverseDynamics& dynamics,
                       const Params& params) override;
  [[nodiscard]] std::size_t state_size() const override { return 0; }
  [[nodiscard]] std::size_t scratch_size() const override;
  Result<void> torques(const ControlInput& in, std::span<double> state, std::span<double> scratch,
                       std::span<double> tau) const override;

 private:
  /// Removes the constrained part from rows of M^-1 J^T (`rows_` of dof() each) with the Cholesky
  /// factor of M, and returns the acceleration caused by the loops alone.
  void hold_loops(const ControlInput& in, std::span<const double> factored,
                  std::span<double> mobility, std::span<double> held,
                  std::span<double> scratch) const;

  Plant plant_;
  spatial::BodyTree tree_;  ///< with loops only
  std::size_t loop_rows_ = 0;
  double kp_ = 0, kd_ = 0, posture_kp_ = 0, posture_kd_ = 0;
  std::size_t rows_ = 6;  ///< of the task: position and rotation, or position
  bool overcomes_friction_ = true;
};

}  // namespace robomosp::control
