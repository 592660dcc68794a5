// SPDX-License-Identifier: Apache-2.0
// Interfaces robomosp.inverse_dynamics/1 and robomosp.forward_dynamics/1, batch first
// (layer: contract, std only). Joint vectors are laid out joint-fastest: q[i * dof + j].
#pragma once

#include <cstdint>
#include <span>

#include <robomosp/sdk/params.h>
#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>
#include <robomosp/sdk/robot_model.h>

namespace robomosp {

/// Parts of the inverse dynamics, to be summed by `|`.
enum DynamicsTerm : std::uint32_t {
  kGravityTerm = 1,    ///< weight of the bodies
  kInertialTerm = 2,   ///< M(q) qdd, motor inertia included
  kVelocityTerm = 4,   ///< Coriolis, centrifugal and gyroscopic
  kFrictionTerm = 8,   ///< viscous and Coulomb
  kExternalTerm = 16,  ///< minus J^T of the wrench at the tip
  kAllTerms = 31,
};

/// Force and moment that act *on* the robot at the tip, in the base frame's axes, about the tip.
struct TipWrench {
  Vec3 force{};   ///< [N]
  Vec3 moment{};  ///< [N m]
};

/// States to evaluate. Made by the host; may gain fields at the end. Empty qd or qdd means zero.
struct DynamicsBatch {
  std::size_t count = 0;           ///< number of samples
  std::span<const double> q;       ///< count * dof [rad or m]
  std::span<const double> qd;      ///< count * dof or empty
  std::span<const double> qdd;     ///< count * dof or empty (inverse dynamics)
  std::span<const double> tau;     ///< count * dof or empty (forward dynamics) [N m or N]
  std::span<const TipWrench> tip;  ///< count, 1 for all, or empty
  std::uint32_t terms = kAllTerms;
  std::span<double> scratch;  ///< at least scratch_size(), owned by the caller
};

/// Interface robomosp.inverse_dynamics/1.
class InverseDynamics {
 public:
  using Interface = InverseDynamics;
  static constexpr const char* kInterfaceId = "robomosp.inverse_dynamics/1";
  virtual ~InverseDynamics() = default;
  /// Binds to one mechanism, which outlives the solver. [application thread or job]
  virtual Result<void> prepare(const RobotModel& model, const Params& params) = 0;
  /// Doubles of scratch that one call needs, whatever its count. [any thread] after prepare
  [[nodiscard]] virtual std::size_t scratch_size() const = 0;
  /// tau (count * dof) of the chosen terms. Allocates nothing. [any thread] after prepare
  virtual Result<void> torques(const DynamicsBatch& batch, std::span<double> tau,
                               Progress&) const = 0;
  /// Joint-space inertia M(q), motor inertia included: count matrices of dof * dof, symmetric.
  virtual Result<void> inertia(const DynamicsBatch& batch, std::span<double> m,
                               Progress&) const = 0;
};

/// Interface robomosp.forward_dynamics/1.
class ForwardDynamics {
 public:
  using Interface = ForwardDynamics;
  static constexpr const char* kInterfaceId = "robomosp.forward_dynamics/1";
  virtual ~ForwardDynamics() = default;
  /// Binds to one mechanism, which outlives the solver; a mechanism with a singular inertia matrix
  /// is an error that names the joint. [application thread or job]
  virtual Result<void> prepare(const RobotModel& model, const Params& params) = 0;
  [[nodiscard]] virtual std::size_t scratch_size() const = 0;
  /// qdd (count * dof) for the given q, qd, tau; `terms` without kInertialTerm select what
  /// resists (friction, gravity, ...). Allocates nothing. [any thread] after prepare
  virtual Result<void> accelerations(const DynamicsBatch& batch, std::span<double> qdd,
                                     Progress&) const = 0;
};

}  // namespace robomosp
