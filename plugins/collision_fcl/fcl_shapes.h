// SPDX-License-Identifier: Apache-2.0
// Uses of FCL: triangle meshes in bounding volume hierarchies (layer: plugin, collision_fcl). Its
// pitfalls, with their workarounds, are described in docs/decisions/0016-collision-by-fcl.md.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include <robomosp/sdk/collision.h>
#include <robomosp/sdk/result.h>

namespace robomosp::collision_fcl {

/// FCL's object; its headers take seconds to compile, so few files include them.
struct Geometry;
using GeometryPtr = std::shared_ptr<const Geometry>;

/// For triangles: oriented boxes with swept spheres (OBBRSS), the only kind that FCL does not copy
/// in every query.
[[nodiscard]] GeometryPtr make_mesh_geometry(
    const std::vector<Vec3>& points, const std::vector<std::array<std::uint32_t, 3>>& triangles);

/// Initialises FCL's function tables, since their set-up by the first query is not thread-safe.
void warm_up();

/// Distance and nearest points in the world of disjoint meshes; nullopt if they are farther apart
/// than `interest` [m].
[[nodiscard]] Result<std::optional<PairDistance>> surface_distance(const Geometry& a,
                                                                   const Pose& world_T_a,
                                                                   const Geometry& b,
                                                                   const Pose& world_T_b,
                                                                   double interest);

}  // namespace robomosp::collision_fcl
