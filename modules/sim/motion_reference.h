// SPDX-License-Identifier: Apache-2.0
// Desired motion of a mechanism over time: joint values from tables, interpolated smoothly between
// their rows (layer: application, sim).
#pragma once

#include <memory>
#include <span>
#include <vector>

#include <robomosp/sdk/result.h>
#include <robomosp/sdk/robot_model.h>
#include <robomosp/sdk/trajectory.h>

#include "motion/cartesian_path.h"
#include "recording/recording.h"

namespace robomosp::sim {

/// Rows of numbers at increasing times; linear between the rows, constant before and after.
struct TimedRows {
  std::vector<double> times;
  std::size_t width = 0;
  std::vector<double> values;  ///< row after row
  void at(double t, std::span<double> out) const;
};

/// The columns `stem`1, `stem`2, ... of a recording, `width` of them; an error names the first
/// missing one.
Result<TimedRows> timed_rows(const recording::Recording& recording, const std::string& stem,
                             std::size_t width);

/// Desired configuration, velocity and acceleration, and those of the tip if it follows a path.
class MotionReference {
 public:
  /// Constant at q.
  MotionReference(const RobotModel& model, std::vector<double> q);
  /// Joint columns q, and qd and qdd if present (else by differences); `stem` is the prefix of
  /// their names, as in "left.q1".
  static Result<MotionReference> from_recording(const RobotModel& model,
                                                const recording::Recording& recording,
                                                const std::string& stem = {});
  /// Makes the tip follow a path as well: `base_T_path` times its poses.
  void follow(std::shared_ptr<const motion::Path> path, const Pose& base_T_path);

  struct Sample {
    std::vector<double> q, qd, qdd;
    Pose tip;
    std::array<double, 6> tip_velocity{}, tip_acceleration{};
    bool has_tip = false;
  };
  /// At rest at the last row after the end. Errors: those of the path of the tip.
  Result<void> at(double t, Sample& out) const;
  /// Times of its rows [s]; one row = constant.
  [[nodiscard]] std::span<const double> times() const { return times_; }
  [[nodiscard]] double duration() const { return times_.empty() ? 0 : times_.back(); }

 private:
  explicit MotionReference(const RobotModel& model) : model_(&model) {}
  const RobotModel* model_;
  std::vector<double> times_, q_, qd_, qdd_;
  std::shared_ptr<const motion::Path> path_;
  Pose base_T_path_;
};

}  // namespace robomosp::sim
