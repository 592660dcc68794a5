// SPDX-License-Identifier: Apache-2.0
// What a configuration shall meet at once: goals of tips in whole or in part, and closed loops; the
// error that is left and its Jacobian (layer: plugin).
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include <robomosp/sdk/ik.h>

#include "mechanism.h"

namespace robomosp::ik_numeric {

/// How far a configuration is off, greatest over goals and loops.
struct Miss {
  double position = 0;  ///< [m]
  double rotation = 0;  ///< [rad]
};

/// Rows of errors and their Jacobian. One thread's; lengths in mechanism lengths, so that position
/// and rotation weigh alike.
class Aims {
 public:
  Aims(const Mechanism& m, std::span<const IkGoal> goals);

  /// Fills error(), jacobian() (when asked) and miss() for q; one target a goal.
  void evaluate(std::span<const Pose> targets, std::span<const double> q, bool jacobian);

  /// Only the frames for q, for tip() and tip_jacobian().
  void place(std::span<const double> q) { forward(*mechanism_.model, q, frames_); }

  [[nodiscard]] Eigen::Index rows() const { return error_.size(); }
  [[nodiscard]] const Eigen::VectorXd& error() const { return error_; }
  /// error -> error - jacobian * step for small steps, each entry counted in its unit.
  [[nodiscard]] const Eigen::MatrixXd& jacobian() const { return jacobian_; }
  [[nodiscard]] const Miss& miss() const { return miss_; }
  [[nodiscard]] const Mechanism& mechanism() const { return mechanism_; }
  [[nodiscard]] std::span<const IkGoal> goals() const { return goals_; }
  /// Geometric Jacobian (v, w) of goal g's tip at the q last evaluated, base axes, real units.
  [[nodiscard]] Eigen::MatrixXd tip_jacobian(std::size_t goal) const;
  /// base_T_tip of goal g at the q last evaluated.
  [[nodiscard]] Pose tip(std::size_t goal) const;

 private:
  void frame_rows(const Pose& at, const Pose& wanted, std::uint32_t parts, double weight,
                  bool jacobian, Eigen::Index& row);

  const Mechanism& mechanism_;
  std::vector<IkGoal> goals_;
  std::vector<Pose> frames_;
  Eigen::VectorXd error_;
  Eigen::MatrixXd jacobian_, twist_;
  Miss miss_;
};

}  // namespace robomosp::ik_numeric
