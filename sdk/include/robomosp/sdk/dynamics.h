// SPDX-License-Identifier: Apache-2.0
// Interfaces robomosp.inverse_dynamics/1 and robomosp.forward_dynamics/1, batch first
// (layer: contract, std only). Vectors are laid out sample after sample: q[i * coordinate_count()
// + k], qd[i * dof() + k] and so on; RobotModel defines the entries.
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
  kInertialTerm = 2,   ///< M(q) qdd, motor inertia included; and what a moving base adds
  kVelocityTerm = 4,   ///< Coriolis, centrifugal and gyroscopic
  kFrictionTerm = 8,   ///< viscous and Coulomb
  kExternalTerm = 16,  ///< minus J^T of the wrench at the tip
  kSpringTerm = 32,    ///< what holds against the joints' springs
  kAllTerms = 63,
};

/// Force and moment that act *on* the robot at the tip, in the base frame's axes, about the tip.
struct TipWrench {
  Vec3 force{};   ///< [N]
  Vec3 moment{};  ///< [N m]
};

/// How the base moves at an instant, all in the base frame's axes. Replaces RobotModel::gravity.
struct BaseMotion {
  Vec3 gravity{};               ///< [m/s^2]
  Vec3 acceleration{};          ///< of the base's origin, without gravity [m/s^2]
  Vec3 angular_velocity{};      ///< [rad/s]
  Vec3 angular_acceleration{};  ///< [rad/s^2]
};

/// States to evaluate. Made by the host; may gain fields at the end. Empty qd or qdd means zero.
struct DynamicsBatch {
  std::size_t count = 0;           ///< number of samples
  std::span<const double> q;       ///< count * coordinate_count()
  std::span<const double> qd;      ///< count * dof or empty
  std::span<const double> qdd;     ///< count * dof or empty (inverse dynamics)
  std::span<const double> tau;     ///< count * dof or empty (forward dynamics) [N m or N]
  std::span<const TipWrench> tip;  ///< count, 1 for all, or empty
  std::uint32_t terms = kAllTerms;
  std::span<double> scratch;         ///< at least scratch_size(), owned by the caller
  std::int32_t tip_index = 0;        ///< into RobotModel::tips: where `tip` acts
  std::span<const BaseMotion> base;  ///< count, 1 for all, or empty = at rest
};

/// Energy and momentum of one sample, in the base frame.
struct Energy {
  double kinetic = 0;       ///< bodies and motors [J]
  double potential = 0;     ///< of weight (0 at the base's origin) and springs [J]
  Vec3 momentum{};          ///< linear [kg m/s]
  Vec3 angular_momentum{};  ///< about the base's origin [kg m^2/s]
  Vec3 com{};               ///< centre of mass of the moving bodies [m]
};

/// Interface robomosp.inverse_dynamics/1. Loops of the model are not looked at: tau is that of the
/// tree.
class InverseDynamics {
 public:
  using Interface = InverseDynamics;
  static constexpr const char* kInterfaceId = "robomosp.inverse_dynamics/1";
  virtual ~InverseDynamics() = default;
  /// What later versions of the SDK add, by its id (plugin.h); nullptr = not known.
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
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
  /// Partial derivatives of the chosen terms' tau: by_q and by_qd, count matrices of dof * dof,
  /// row-major, row = entry of tau. For spherical and free joints "by q" is by a small velocity
  /// of the joint. (By qdd it is M.) The host differentiates numerically what is unsupported.
  virtual Result<void> derivatives(const DynamicsBatch&, std::span<double> by_q,
                                   std::span<double> by_qd, Progress&) const {
    (void)by_q, (void)by_qd;
    return unsupported_by_provider("derivatives");
  }
  /// The regressor Y: tau = Y pi for gravity, inertial and velocity terms without motors; count
  /// matrices of dof rows and 10 columns a joint: m, m x, m y, m z [kg, kg m], then Ixx Iyy Izz
  /// Ixy Iyz Ixz about the joint frame's origin, elements as in Sym3 [kg m^2].
  virtual Result<void> regressor(const DynamicsBatch&, std::span<double> y, Progress&) const {
    (void)y;
    return unsupported_by_provider("the regressor");
  }
  /// One entry a sample.
  virtual Result<void> energy(const DynamicsBatch&, std::span<Energy> out, Progress&) const {
    (void)out;
    return unsupported_by_provider("energy");
  }

 protected:
  static Result<void> unsupported_by_provider(const char* what) {
    return error(ErrorCode::unsupported,
                 std::string("this provider of inverse dynamics does not compute ") + what,
                 "Choose another provider, such as newton_euler.");
  }
};

/// Interface robomosp.forward_dynamics/1. With loops in the model the accelerations meet them (with
/// stabilisation against drift), or prepare says that the provider cannot.
class ForwardDynamics {
 public:
  using Interface = ForwardDynamics;
  static constexpr const char* kInterfaceId = "robomosp.forward_dynamics/1";
  virtual ~ForwardDynamics() = default;
  /// What later versions of the SDK add, by its id (plugin.h); nullptr = not known.
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
  /// Binds to one mechanism, which outlives the solver; a mechanism with a singular inertia matrix
  /// is an error that names the joint. [application thread or job]
  virtual Result<void> prepare(const RobotModel& model, const Params& params) = 0;
  [[nodiscard]] virtual std::size_t scratch_size() const = 0;
  /// qdd (count * dof) for the given q, qd, tau; `terms` without kInertialTerm select what
  /// resists (friction, gravity, ...). Allocates nothing. [any thread] after prepare
  virtual Result<void> accelerations(const DynamicsBatch& batch, std::span<double> qdd,
                                     Progress&) const = 0;
  /// The same, and the forces that keep the loops closed: one number a fixed direction (in order of
  /// LoopDirection, loop after loop) a sample, acting on frame b in the axes of frame a [N, N m].
  virtual Result<void> constrained(const DynamicsBatch&, std::span<double> qdd,
                                   std::span<double> forces, Progress&) const {
    (void)qdd, (void)forces;
    return error(ErrorCode::unsupported,
                 "this provider of forward dynamics does not support closed loops",
                 "Choose a provider with the tag \"loops\", such as constrained.");
  }
  /// Partial derivatives of qdd: count matrices of dof * dof, row-major, row = entry of qdd.
  virtual Result<void> derivatives(const DynamicsBatch&, std::span<double> by_q,
                                   std::span<double> by_qd, std::span<double> by_tau,
                                   Progress&) const {
    (void)by_q, (void)by_qd, (void)by_tau;
    return error(ErrorCode::unsupported,
                 "this provider of forward dynamics computes no derivatives",
                 "Choose another provider, such as articulated_body.");
  }
};

}  // namespace robomosp
