// SPDX-License-Identifier: Apache-2.0
// How a body without joints turns in a step when nothing touches it: its angular momentum stays,
// and its energy to the fourth order of the step (layer: plugin).
#pragma once

#include <array>

#include <ode/ode.h>
#include <robomosp/sdk/types.h>

namespace robomosp::physics_ode {

/// The part of a step that comes from turning about an axis that is no principal one.
struct FreeTurn {
  bool is_on = false;
  Vec3 torque{};                           ///< that makes the engine's velocity w_after [N m]
  Vec3 w_after{};                          ///< without contact [rad/s], world axes
  std::array<double, 4> rest{1, 0, 0, 0};  ///< turn, in the body, that the engine's motion lacks
};

/// Of a body at its centre of mass, world axes [kg m^2], row by row.
[[nodiscard]] std::array<double, 9> inertia_in_world(dBodyID body);

/// The turn of a body during h [s] without torque.
[[nodiscard]] FreeTurn free_turn(dBodyID body, double h);

}  // namespace robomosp::physics_ode
