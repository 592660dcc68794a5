// SPDX-License-Identifier: Apache-2.0
// Samples of a simulated motion, and the columns and notes of its recording (layer: application,
// sim).
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "recording/recording.h"
#include "robotics/maker_axes.h"
#include "sim/mechanism_motion.h"
#include "sim/motion_reference.h"
#include "sim/simulate.h"

namespace robomosp::sim {

class MotionTable {
 public:
  /// `axes` are those of the robot's maker, for notes and the docs of columns; they must outlive
  /// the table.
  MotionTable(const MechanismMotion& motion, const robotics::MakerAxes& axes);

  void add(double t, std::span<const double> x, const MechanismMotion::Forces& forces);
  /// Records, at increasing times, whether the torque of an entry is clipped.
  void cut(std::size_t entry, double t, bool is_cut);
  /// Greatest torque of the motor of an entry of tau [N m or N].
  [[nodiscard]] double limit_of(std::size_t entry) const { return limits_[entry]; }
  [[nodiscard]] const std::vector<double>& times() const { return times_; }
  [[nodiscard]] std::span<const double> q(std::size_t sample) const {
    const std::size_t width = q_.size() / times_.size();
    return std::span(q_).subspan(sample * width, width);
  }
  [[nodiscard]] double tau(std::size_t sample, std::size_t entry) const {
    return tau_[sample * limits_.size() + entry];
  }

  /// time, q, qd, qdd, tau, tau_friction, tau_stop; the last one only if a stop was reached, or
  /// `all_stops`.
  void add_joint_columns(recording::Recording& out, bool all_stops = false) const;
  /// kinetic, potential, energy: of bodies, motors and springs, in the base frame.
  Result<void> add_energy_columns(recording::Recording& out, const Bound<InverseDynamics>& dynamics,
                                  Progress& progress) const;
  /// x, y, z of the first tip in the world.
  Result<void> add_tip_columns(recording::Recording& out,
                               const std::function<Result<Pose>(double)>& world_T_base) const;
  /// error1, ... of the joints against the reference, and tip_error.
  Result<void> add_error_columns(recording::Recording& out, const MotionReference& reference) const;
  /// Limits reached, joints that stick, torques clipped.
  void add_notes(recording::Recording& out, const MechanismMotion& motion) const;

 private:
  struct Interval {
    std::size_t entry = 0;
    double from = 0, to = 0;
    bool is_open = false;
  };
  /// Times when joints stuck and slid again.
  void add_friction_notes(const MechanismMotion& motion, std::vector<std::string>& notes) const;
  [[nodiscard]] std::string label(std::size_t entry) const;
  /// "joint 3 (elbow)" preceded by its axis.
  [[nodiscard]] std::string joint_label(std::size_t joint) const;
  /// The same with the value and the range of the axis when the joint reaches a limit.
  [[nodiscard]] std::string limit_label(const MotionEvent& e) const;
  void add_entries(recording::Recording& out, const std::string& stem, const std::string& what,
                   const std::string& rotary, const std::string& linear,
                   std::span<const double> table) const;

  const RobotModel& model_;
  const robotics::MakerAxes& axes_;
  bool has_friction_, has_stops_, has_loops_;
  std::vector<double> limits_;
  std::vector<std::size_t> joint_of_;  ///< by entry of qd
  std::vector<bool> is_rotary_;        ///< likewise
  std::vector<double> times_, q_, qd_, qdd_, tau_, friction_, stop_;
  std::vector<Interval> cuts_;
};

}  // namespace robomosp::sim
