// SPDX-License-Identifier: Apache-2.0
// The recursions as tables of functions, one table an instruction set (layer: data processing,
// spatial). Plain structures only: what the kernels read is prepared in recursion_chain.h.
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
  double carried;      ///< mass of the body and all that it carries [kg]
  double armature, viscous, coulomb_positive, coulomb_negative, stiffness, rest;
  bool resists;   ///< has armature, friction or a spring
  bool branches;  ///< carries a joint that does not come right behind it
};

struct TipPath {
  const std::int32_t* joints;  ///< from the base to the joint that carries the tip
  std::int32_t count;
  double p[3];  ///< the tip's origin in that joint's frame [m]
};

struct Mechanism {
  const Body* bodies;
  const std::int32_t* entry_parent;  ///< of entries of qd: the next one nearer the base, or -1
  const double* least_inertia;       ///< of entries of qd: below it a pivot is rounding
  const TipPath* tips;
  std::size_t count, coordinates, velocities;
  double gravity[3];
  bool coupled;         ///< entries of tau are sums over joints
  bool dense;           ///< entry_parent[k] is k - 1 throughout
  bool resists;         ///< some body does
  bool single_joints;   ///< revolute and prismatic joints, none coupled
  bool simple_chain;    ///< of these, one behind the other
  std::size_t columns;  ///< of all joints: more than velocities when joints are coupled
  bool ordered;  ///< one body behind the other, whose columns are the entries of tau in order
};

/// What to compute for a range of samples. Pointers as the spans of DynamicsBatch; null = zeros.
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
  /// Forward dynamics by articulated bodies: below it the resistance of a joint is rounding, one a
  /// joint; null = by the inertia matrix. Needs single_joints.
  const double* pivots;
  bool lanes;  ///< several samples at once
  std::uint32_t terms;
  const double *q, *qd, *qdd, *tau;
  const double* wrench;       ///< 6 numbers a sample, or null
  const double* base;         ///< 12 numbers a sample: BaseMotion, or null
  bool one_wrench, one_base;  ///< for all samples
  std::int32_t tip;
  double* out;
  double *by_rate, *by_force;  ///< of derivatives: n * n numbers a sample, as out
};

struct Kernels {
  /// Computes samples first..last of `samples`. Returns the first one whose result is not finite or
  /// whose inertia is not positive definite, or `last`.
  std::size_t (*run)(const Mechanism&, const Task&, std::size_t samples, std::size_t first,
                     std::size_t last, double* scratch);
  /// Doubles of scratch that run needs.
  std::size_t (*scratch)(const Mechanism&, const Task&);
  std::size_t lanes;
};

/// Relative to the diagonal element before elimination: below this a pivot is rounding.
inline constexpr double kPivot = 1e-13;
/// Relative to the greatest inertia that the joint can carry: below this a pivot is rounding.
/// Bodies that the joint does not carry add no rounding to its pivot, however heavy they are.
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
