// SPDX-License-Identifier: Apache-2.0
// BodyTree: the constants of a mechanism for spatial-vector algorithms, its motion in the base
// frame, and the resulting torques and inertia. All joint types, coupled joints and moving bases;
// loops are stored, not solved (layer: data processing, spatial).
#pragma once

#include <span>
#include <string>
#include <vector>

#include <robomosp/sdk/dynamics.h>

#include "spatial/screw.h"

namespace robomosp::spatial {

/// One joint and the body it moves. Its columns are the motions, in the joint frame, for unit
/// velocities: unit vectors of (angular, linear), times the ratio of a coupled joint.
struct TreeBody {
  JointType type = JointType::revolute;
  std::int32_t parent = -1, q_index = 0, v_index = 0;
  std::int32_t column = 0;   ///< of its first column among those of all joints
  std::int32_t columns = 1;  ///< 1, 3 or 6
  bool coupled = false;
  double ratio = 1, offset = 0;
  Pose placement;  ///< parent_T_joint at rest
  RigidInertia inertia;
  double armature = 0;
  JointFriction friction;
  JointSpring spring;
};

struct BodyTree {
  std::string name;
  std::vector<std::string> joint_names;
  std::vector<TreeBody> bodies;
  std::vector<TipModel> tips;
  std::vector<LoopModel> loops;
  Vec3 gravity{};
  std::size_t coordinates = 0, velocities = 0;
  std::size_t columns = 0;  ///< of all joints: more than velocities if joints are coupled
  [[nodiscard]] std::string where() const { return "robot \"" + name + "\""; }
};

/// Rejects models that violate their contract: order and numbers of joints, placements, masses,
/// couplings, tips, loops.
[[nodiscard]] Result<void> check_mechanism(const RobotModel& model);

/// Copies the data needed by the algorithms; a model that violates its contract is an error.
[[nodiscard]] Result<BodyTree> make_body_tree(const RobotModel& model);

/// Sizes for checking the spans of a batch.
struct BatchShape {
  const std::string& robot;
  std::size_t coordinates, velocities, tips;
};
/// Rejects spans of the wrong length; `output` has output_per_sample numbers per sample.
[[nodiscard]] Result<void> check_batch(const BatchShape& shape, const DynamicsBatch& batch,
                                       std::size_t required_scratch, std::size_t output,
                                       std::size_t output_per_sample);
[[nodiscard]] inline Result<void> check_batch(const BodyTree& tree, const DynamicsBatch& batch,
                                              std::size_t required_scratch, std::size_t output,
                                              std::size_t output_per_sample) {
  return check_batch({tree.name, tree.coordinates, tree.velocities, tree.tips.size()}, batch,
                     required_scratch, output, output_per_sample);
}

/// parent_T_joint of one body.
[[nodiscard]] Pose joint_pose(const TreeBody& body, const double* q);
/// Column k of a joint, in the joint frame.
[[nodiscard]] Screw joint_column(const TreeBody& body, std::int32_t k);

/// One sample of a batch; a null pointer means zeros.
struct TreeState {
  const double *q = nullptr, *qd = nullptr, *qdd = nullptr;
  Screw base_velocity, base_acceleration;  ///< gravity included, base frame
};
/// A sample's motion restricted to `terms`. The inverse dynamics' inertial term includes qdd and
/// the base's motion; `forward` always keeps the base's motion.
[[nodiscard]] TreeState state_of(const BodyTree& tree, const DynamicsBatch& batch,
                                 std::size_t sample, std::uint32_t terms, bool forward);

/// A body in motion, all in the base frame.
struct MovingBody {
  Pose pose;  ///< base_T_joint
  Screw velocity, acceleration;
  RigidInertia inertia;
  Screw force;  ///< of the body alone, then (after gather) including all bodies it carries
};

/// Poses, velocities, accelerations, inertias and forces of the bodies; `columns` of all joints in
/// the base frame. Allocates nothing.
void sweep(const BodyTree& tree, const TreeState& state, std::span<MovingBody> bodies,
           std::span<Screw> columns);
/// Adds the wrench on the robot at a tip to the forces of a swept tree.
void apply_wrench(const BodyTree& tree, std::size_t tip, const TipWrench& wrench,
                  std::span<MovingBody> bodies);
/// Sums forces (and inertias, if requested) from the tips to the base.
void gather(const BodyTree& tree, std::span<MovingBody> bodies, bool inertias);

/// Adds velocity, friction, spring and motor parts of the joints alone to tau.
void add_joint_forces(const BodyTree& tree, const DynamicsBatch& batch, std::size_t sample,
                      std::uint32_t terms, std::span<double> tau);
/// tau of one sample for the selected terms. `bodies` and `columns` are scratch; they hold the
/// swept and gathered tree afterwards. `forward`: qdd is left out, the base's motion is not.
void tree_torques(const BodyTree& tree, const DynamicsBatch& batch, std::size_t sample,
                  std::uint32_t terms, bool forward, std::span<MovingBody> bodies,
                  std::span<Screw> columns, std::span<double> tau);
/// M(q) with motor inertia from a gathered tree with its inertias summed: dof * dof, row-major.
void tree_inertia(const BodyTree& tree, std::span<const MovingBody> bodies,
                  std::span<const Screw> columns, std::span<double> m);

/// Number of doubles for bodies and columns in a caller's scratch.
[[nodiscard]] std::size_t tree_scratch(const BodyTree& tree);
/// Both in a caller's scratch.
struct TreeScratch {
  std::span<MovingBody> bodies;
  std::span<Screw> columns;
  double* rest = nullptr;  ///< first double after them
};
[[nodiscard]] TreeScratch take_scratch(const BodyTree& tree, double* scratch);

/// Cholesky factor of a symmetric n * n matrix in its lower triangle, in place. Returns -1, or the
/// first row with a pivot that is not positive.
[[nodiscard]] std::ptrdiff_t cholesky(std::span<double> m, std::size_t n);
/// Solves in place with a factored matrix.
void cholesky_solve(std::span<const double> m, std::size_t n, double* x);

}  // namespace robomosp::spatial
