// SPDX-License-Identifier: Apache-2.0
// Contact of free bodies, solved exactly in time that depends on how many bodies are side by side
// rather than on the cube of their number (layer: plugin).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <robomosp/sdk/types.h>

namespace robomosp::physics_ode {

/// A moving body without joints.
struct PileBody {
  double mass = 0;
  std::array<double, 9> inertia{};  ///< about the centre of mass, world axes
  Vec3 v{}, w{};                    ///< current; result: after the step
  Vec3 v_free{}, w_free{};          ///< after the step without contact
};
struct PileContact {
  std::int32_t a = -1, b = -1;       ///< bodies of the pile; -1 = a body not moved by it
  std::array<Vec3, 3> axis{};        ///< the normal, which points to a, and two tangents
  Vec3 arm_a{}, arm_b{};             ///< from the centres of mass
  std::array<double, 3> target{};    ///< target gap velocity, except for compliance
  double soft = 0, soft_across = 0;  ///< compliance: gap velocity per impulse [m/s / N s]
  double friction = 0;
  double limit = -1;                ///< of friction [N s]; below 0 = by `friction`
  std::array<double, 3> impulse{};  ///< result [N s]
  /// Expected, and resulting, states of the impulses, without friction (the first) and with it: -1
  /// and 1 at their limits, 0 between them, 2 unknown. Expectations affect only the time, up to
  /// rounding.
  std::array<signed char, 4> place{2, 2, 2, 2};
};

/// Solves the problem of ODE's exact solver: impulses p and velocities v with M (v - v_free) = J^T
/// p, J v + soft p = target, where 0 <= p along normals, and tangentially |p| <= friction times the
/// normal impulse of the frictionless solution, or the `limit`. Its unique solution minimises the
/// convex function 1/2 (v - v_free)^T M (v - v_free) + sum of penalties; Newton's method with exact
/// line searches finds it in finitely many steps, with matrices as sparse as the contacts. `most` =
/// limit of multiplications of one factorization. Returns false if it fails; nothing is changed
/// then.
[[nodiscard]] bool solve_pile(std::vector<PileBody>& bodies, std::vector<PileContact>& contacts,
                              double most);

}  // namespace robomosp::physics_ode
