// SPDX-License-Identifier: Apache-2.0
// What FCL does for us: triangle meshes in bounding volume hierarchies (layer: plugin,
// collision_fcl). Its traps, and what is done about each, stand in
// docs/decisions/0016-collision-by-fcl.md.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include <robomosp/sdk/collision.h>
#include <robomosp/sdk/result.h>

namespace robomosp::collision_fcl {

/// FCL's object; its headers take seconds to compile, so that few files see them.
struct Geometry;
using GeometryPtr = std::shared_ptr<const Geometry>;

/// Of triangles: oriented boxes with spheres swept (OBBRSS), the only kind that FCL does not copy
/// in every query.
[[nodiscard]] GeometryPtr make_mesh_geometry(
    const std::vector<Vec3>& points, const std::vector<std::array<std::uint32_t, 3>>& triangles);

/// Fills FCL's tables of functions, which are made by the first query and not for several threads.
void warm_up();

/// Distance and nearest points in the world of meshes that do not touch; nullopt when they are
/// farther apart than `interest` [m].
[[nodiscard]] Result<std::optional<PairDistance>> surface_distance(const Geometry& a,
                                                                   const Pose& world_T_a,
                                                                   const Geometry& b,
                                                                   const Pose& world_T_b,
                                                                   double interest);

}  // namespace robomosp::collision_fcl
