// SPDX-License-Identifier: Apache-2.0
// The kernels behind batch_kinematics.h, one table per instruction set; plain structures only
// (layer: data processing, robotics).
#pragma once

#include <cstddef>
#include <cstdint>

#include "spatial/instruction_set.h"
#include "spatial/joint_constants.h"

namespace robomosp::robotics::kernels {

/// Inputs and outputs. Poses are 12 numbers (R row-major, p); null outputs are skipped.
struct Task {
  const spatial::JointConstants* joints;
  const std::int32_t* path;  ///< joints to place, parents first
  std::size_t path_count, joint_count, coordinates, dof;
  const double* tool;       ///< of the tip on the last joint of the path
  const double* turned_by;  ///< row-major, of Jacobians: axes_R_base; null = none
  bool in_tip;              ///< Jacobians in the tip's axes
  bool coupled;             ///< columns are sums over joints
  bool by_rows;             ///< Jacobians as matrices of 6 rows, else joint after joint
  const double* q;
  double *frames, *poses, *jacobians;
};

/// Poses in readable representations, each in a separate array, one row per pose.
struct PoseRows {
  double* matrices;     ///< 16 numbers each, row-major
  double* positions;    ///< 3
  double* rpy;          ///< 3
  double* quaternions;  ///< 4: w >= 0, x, y, z
};

struct Table {
  /// Samples first..last of `samples`.
  void (*run)(const Task&, std::size_t samples, std::size_t first, std::size_t last,
              double* scratch);
  std::size_t (*scratch)(std::size_t joints, std::size_t coordinates, std::size_t dof);
  /// base_T_joint of one configuration, 12 numbers a joint, straight from the model.
  void (*frames)(const JointModel* joints, std::size_t count, const double* q, double* frames);
  /// base * pose of `count` poses of 12 numbers; `base` is null for none.
  void (*describe)(const double* poses, std::size_t count, const double* base, const PoseRows& to);
  std::size_t lanes;
};

/// The kernels of a set, or of the widest one that processor and build support. [any thread]
[[nodiscard]] const Table& table(spatial::InstructionSet set);

namespace baseline {
const Table& table();
}
namespace avx2 {
const Table& table();
}
namespace avx512 {
const Table& table();
}

}  // namespace robomosp::robotics::kernels
