// SPDX-License-Identifier: Apache-2.0
// The constants of a mechanism as the recursions read them: one flat row a joint, masses about the
// joint's origin (layer: plugin).
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include <robomosp/sdk/dynamics.h>

namespace robomosp::newton_euler {

struct ChainJoint {
  std::array<double, 9> R;  ///< parent_R_joint at q = 0, row-major
  Vec3 p;                   ///< origin in the parent's frame at q = 0 [m]
  double mass = 0;          ///< [kg]
  Vec3 first{};             ///< mass times centre of mass [kg m]
  Sym3 inertia;             ///< about the joint's origin [kg m^2]
  double armature = 0;
  JointFriction friction;
  std::int32_t parent = -1;
  bool is_prismatic = false;
};

struct Chain {
  std::vector<ChainJoint> joints;
  Vec3 gravity{};
  bool is_serial = true;        ///< every joint's parent is the joint before it
  std::int32_t tip_joint = -1;  ///< carries the tip that takes the wrench
  Vec3 tip{};                   ///< its origin in that joint's frame
  [[nodiscard]] std::size_t dof() const { return joints.size(); }
};

/// Copies what the recursions need; a model that breaks its contract is an error.
Result<Chain> make_chain(const RobotModel& model);

/// Refuses spans of the wrong length; `required_scratch` in doubles.
Result<void> check_batch(const Chain& chain, const DynamicsBatch& batch,
                         std::size_t required_scratch, std::size_t output,
                         std::size_t output_per_sample);

/// Samples between two looks at Progress: far less than 100 ms of work for any mechanism.
inline constexpr std::size_t kSamplesPerCheck = 256;

}  // namespace robomosp::newton_euler
