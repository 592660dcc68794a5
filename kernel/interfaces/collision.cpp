// SPDX-License-Identifier: Apache-2.0
// Collision, contact physics and planning; their answers are checked where they are asked.
#include <robomosp/sdk/collision.h>
#include <robomosp/sdk/physics.h>
#include <robomosp/sdk/planner.h>

#include "kernel/interface_file.h"

namespace robomosp {

RMP_INTERFACES(collision, plain_interface<CollisionEngine>("fcl"),
               plain_interface<PhysicsEngine>("ode"), plain_interface<Planner>("rrt_connect"));

}  // namespace robomosp
