// SPDX-License-Identifier: Apache-2.0
// The door of the plugin collision_fcl.
#include <robomosp/sdk/plugin.h>

#include "engine.h"

namespace robomosp::collision_fcl {
namespace {
const rmp_param kParams[] = {
    {"threads", "int", "", "Greatest number of threads of one call; 0 = one per core.", "0",
     nullptr, 0, 256},
};
}  // namespace
}  // namespace robomosp::collision_fcl

RMP_PLUGIN("org.robomosp.collision_fcl", "0.1.0", "Apache-2.0",
           "Collision and distance: convex shapes by closed forms and GJK, meshes by FCL",
           RMP_PROVIDER(robomosp::collision_fcl::FclEngine, "fcl",
                        "Closed forms and GJK for convex shapes, bounding volume hierarchies of "
                        "FCL for meshes, depths by an expanding polytope.",
                        "convex,cones,ellipsoids,mesh,depth", robomosp::collision_fcl::kParams))
