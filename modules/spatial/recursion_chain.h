// SPDX-License-Identifier: Apache-2.0
// A mechanism prepared for the kernels: one flat row a joint, masses about the joint's origin
// (layer: data processing, spatial).
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <robomosp/sdk/dynamics.h>

#include "spatial/body_tree.h"
#include "spatial/recursion_kernels.h"

namespace robomosp::spatial::recursions {

/// Owns what its Mechanism points to.
class Chain {
 public:
  /// Copies what the recursions need; a model that breaks its contract is an error. Closed loops
  /// are not looked at.
  static Result<Chain> make(const RobotModel& model);

  [[nodiscard]] const Mechanism& mechanism() const { return mechanism_; }
  [[nodiscard]] const std::string& robot() const { return robot_; }
  [[nodiscard]] BatchShape shape() const { return {robot_, coordinates(), dof(), tip_count()}; }
  [[nodiscard]] std::size_t dof() const { return mechanism_.velocities; }
  [[nodiscard]] std::size_t coordinates() const { return mechanism_.coordinates; }
  [[nodiscard]] std::size_t tip_count() const { return tips_.size(); }
  /// The joint that an entry of qd and tau belongs to.
  [[nodiscard]] std::size_t joint_of(std::size_t entry) const { return joint_of_[entry]; }

  Chain() = default;
  Chain(Chain&&) = default;
  Chain& operator=(Chain&&) = default;

 private:
  void add_body(const JointModel& joint);
  void add_entries(const JointModel& joint, std::size_t index);
  void add_tips(const RobotModel& model);
  void find_least_inertias();

  Mechanism mechanism_{};
  std::string robot_;
  std::vector<Body> bodies_;
  std::vector<std::int32_t> entry_parent_, paths_;
  std::vector<double> least_inertia_;
  std::vector<TipPath> tips_;
  std::vector<std::size_t> joint_of_;
};

}  // namespace robomosp::spatial::recursions
