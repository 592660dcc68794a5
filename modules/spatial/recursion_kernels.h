// SPDX-License-Identifier: Apache-2.0
// The recursions as tables of functions, one table per instruction set (layer: data processing,
// spatial). Plain structures only: the inputs of the kernels are prepared in recursion_chain.h.
#pragma once

#include <cstddef>
#include <cstdint>

#include "spatial/instruction_set.h"
#include "spatial/joint_constants.h"

namespace robomosp::spatial::recursions {

/// A joint and its body; moments about the joint's origin.
struct Body {
  spatial::JointConstants joint;
  std::size_t column;  ///< of its first velocity among those of all joints
  double mass;         ///< [kg]
  double first[3];     ///< mass times centre of mass [kg m]
  double inertia[6];   ///< xx yy zz xy yz xz [kg m^2]
  double second[6];    ///< integral of r r^T dm, the same order [kg m^2]
  double carried;      ///< mass of the body and all bodies it carries [kg]
  double armature, viscous, coulomb_positive, coulomb_negative, stiffness, rest;
  bool resists;   ///< has armature, friction or a spring
  bool branches;  ///< carries a joint other than the next one
};

struct TipPath {
  const std::int32_t* joints;  ///< from the base to the joint that carries the tip
  std::int32_t count;
  double p[3];  ///< the tip's origin in that joint's frame [m]
};

struct Mechanism {
  const Body* bodies;
  const std::int32_t* entry_parent;  ///< of entries of qd: the next one nearer the base, or -1
  const double* least_inertia;       ///< of entries of qd: pivots below it are rounding errors
  const TipPath* tips;
  std::size_t count, coordinates, velocities;
  double gravity[3];
  bool coupled;         ///< entries of tau are sums over joints
  bool dense;           ///< entry_parent[k] is k - 1 throughout
  bool resists;         ///< some body does
  bool single_joints;   ///< revolute and prismatic joints, none coupled
  bool simple_chain;    ///< of these, one after another
  std::size_t columns;  ///< of all joints: more than velocities if joints are coupled
  bool ordered;         ///< a chain of bodies with columns in the order of the entries of tau
};

/// Inputs and outputs for a range of samples. Pointers as the spans of DynamicsBatch; null = zeros.
struct Task {
  enum class What {
    torques,
    inertia,
    accelerations,
    torque_derivatives,        ///< out by q, by_rate; derivative_kernels()
    acceleration_derivatives,  ///< also by_force; without pivots at the given qdd
  };
  What what;
  bool columns;  ///< the inertia column by column instead of by composite bodies
  /// Forward dynamics by articulated bodies: a joint inertia below it is a rounding error, one per
  /// joint; null = by the inertia matrix. Needs single_joints.
  const double* pivots;
  bool lanes;  ///< several samples at once
  std::uint32_t terms;
  const double *q, *qd, *qdd, *tau;
  const double* wrench;       ///< 6 numbers per sample, or null
  const double* base;         ///< 12 numbers per sample: BaseMotion, or null
  bool one_wrench, one_base;  ///< for all samples
  std::int32_t tip;
  double* out;
  double *by_rate, *by_force;  ///< of derivatives: n * n numbers per sample, as out
};

struct Kernels {
  /// Computes samples first..last of `samples`. Returns the first one with a result that is not
  /// finite or an inertia that is not positive definite, or `last`.
  std::size_t (*run)(const Mechanism&, const Task&, std::size_t samples, std::size_t first,
                     std::size_t last, double* scratch);
  /// Number of doubles of scratch that run needs.
  std::size_t (*scratch)(const Mechanism&, const Task&);
  std::size_t lanes;
};

/// Relative to the diagonal element before elimination: a pivot below this is a rounding error.
inline constexpr double kPivot = 1e-13;
/// Relative to the greatest inertia that the joint can carry: a pivot below this is a rounding
/// error. Bodies that the joint does not carry add no rounding errors to its pivot, however heavy
/// they are.
inline constexpr double kCarried = 1e-13;

/// The kernels of a set, or the next narrower that was compiled.
[[nodiscard]] const Kernels& kernels(spatial::InstructionSet set);
/// The same for derivatives; all sets take single samples.
[[nodiscard]] const Kernels& derivative_kernels(spatial::InstructionSet set);

namespace baseline {
const Kernels& kernels();
const Kernels& derivative_kernels();
}  // namespace baseline
namespace avx2 {
const Kernels& kernels();
const Kernels& derivative_kernels();
}  // namespace avx2
namespace avx512 {
const Kernels& kernels();
const Kernels& derivative_kernels();
}  // namespace avx512

}  // namespace robomosp::spatial::recursions
