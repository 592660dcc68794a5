// SPDX-License-Identifier: Apache-2.0
// Contact of free bodies that touch each other, solved exactly in time that grows with how many
// bodies are side by side and not with the cube of all (layer: plugin).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <robomosp/sdk/types.h>

namespace robomosp::physics_ode {

/// A body that moves and has no joint.
struct PileBody {
  double mass = 0;
  std::array<double, 9> inertia{};  ///< about the centre of mass, world axes
  Vec3 v{}, w{};                    ///< now; found: after the step
  Vec3 v_free{}, w_free{};          ///< after the step without contact
};
struct PileContact {
  std::int32_t a = -1, b = -1;       ///< bodies of the pile; -1 = what is not moved by it
  std::array<Vec3, 3> axis{};        ///< the normal, which points to a, and two across it
  Vec3 arm_a{}, arm_b{};             ///< from the centres of mass
  std::array<double, 3> target{};    ///< gap velocity to be reached, but for what gives way
  double soft = 0, soft_across = 0;  ///< gap velocity by impulse [m/s / N s]
  double friction = 0;
  double limit = -1;                ///< of friction [N s]; below 0 = by `friction`
  std::array<double, 3> impulse{};  ///< found [N s]
  /// Where the impulses are expected, and found, without friction (the first) and with it: -1 and 1
  /// at their limits, 0 between them, 2 not known. Expectations change the time only, up to
  /// rounding.
  std::array<signed char, 4> place{2, 2, 2, 2};
};

/// The problem of ODE's exact solver: impulses p and velocities v with M (v - v_free) = J^T p, J v
/// + soft p = target, where 0 <= p along normals and |p| <= friction times the normal impulse that
/// there is without friction across them, or the `limit`. Its unique solution is where the convex
/// function 1/2 (v - v_free)^T M (v - v_free) + sum of penalties is least, which Newton's method
/// with exact line searches finds in finitely many steps; their matrices are as sparse as the
/// contacts. `most` = multiplications of one factorization that are taken on. False where it is not
/// found; nothing is changed then.
[[nodiscard]] bool solve_pile(std::vector<PileBody>& bodies, std::vector<PileContact>& contacts,
                              double most);

}  // namespace robomosp::physics_ode
