// SPDX-License-Identifier: Apache-2.0
// Forward kinematics and Jacobians of many configurations, one a lane and on all cores: for
// workspace maps, path checks, training data (layer: data processing, robotics).
#pragma once

#include <span>
#include <vector>

#include <robomosp/sdk/robot_model.h>

#include "robotics/kinematics.h"
#include "spatial/instruction_set.h"
#include "spatial/joint_constants.h"

namespace robomosp::robotics {

namespace kernels {
struct PoseRows;
struct Table;
struct Task;
}  // namespace kernels

/// A mechanism of any joint types, prepared once; calls allocate nothing but the threads of large
/// batches. Results equal those of kinematics.h to rounding and depend neither on a sample's place
/// in the batch nor on the number of threads. Spans must have the lengths given (RMP_CHECK);
/// `scratch` has scratch_size() doubles that the caller owns. [any thread]
class BatchKinematics {
 public:
  BatchKinematics() = default;
  /// A set wider than the processor's is narrowed.
  explicit BatchKinematics(const RobotModel& model,
                           spatial::InstructionSet set = spatial::widest_instruction_set());

  [[nodiscard]] std::size_t scratch_size() const;
  /// base_T_joint: count * joints poses, sample after sample. q: count * coordinate_count().
  void joint_frames(std::span<const double> q, std::span<Pose> frames,
                    std::span<double> scratch) const;
  /// base_T_tip of each sample.
  void tip_poses(std::size_t tip, std::span<const double> q, std::span<Pose> poses,
                 std::span<double> scratch) const;
  /// Geometric Jacobians as of geometric_jacobian(), 6 * dof numbers a sample; with the tip's
  /// poses unless `poses` is empty.
  void jacobians(std::size_t tip, std::span<const double> q, JacobianFrame frame,
                 std::span<Pose> poses, std::span<double> jacobians,
                 std::span<double> scratch) const;
  /// The same without poses, each as a matrix of 6 rows (v, w) and dof columns, row-major.
  void jacobian_rows(std::size_t tip, std::span<const double> q, JacobianFrame frame,
                     std::span<double> rows, std::span<double> scratch) const;
  /// base * pose of each pose as matrix, position, roll-pitch-yaw and quaternion, which equal those
  /// of spatial/rotation.h to rounding. On the calling thread.
  void describe(std::span<const Pose> poses, const Pose& base, const kernels::PoseRows& to) const;

 private:
  struct Tip {
    std::vector<std::int32_t> path;  // joints from the base to the tip
    Pose tool;
  };

  [[nodiscard]] kernels::Task jacobian_task(std::size_t tip, std::span<const double> q,
                                            JacobianFrame frame, std::span<double> out) const;
  void run(kernels::Task& task, std::size_t samples, std::span<double> scratch) const;

  const kernels::Table* kernels_ = nullptr;
  std::vector<spatial::JointConstants> joints_;
  std::vector<std::int32_t> all_;
  std::vector<Tip> tips_;
  Pose base_;
  std::size_t coordinates_ = 0, dof_ = 0;
  bool coupled_ = false;
};

}  // namespace robomosp::robotics
