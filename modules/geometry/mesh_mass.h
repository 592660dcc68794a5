// SPDX-License-Identifier: Apache-2.0
// Volume integrals of the solid that a closed mesh bounds (layer: data processing, geometry):
// exact for the polyhedron, an approximation of a curved solid. [any thread]
#pragma once

#include <robomosp/sdk/csg.h>
#include <robomosp/sdk/result.h>
#include <robomosp/sdk/types.h>

namespace robomosp::geometry {

/// Moments about the frame's origin, `exact` = false. An error for a mesh that is not closed or is
/// inside out. `deviation` is the greatest distance of its triangles from the surface they
/// approximate [m]: with the rounding of the corners it determines `relative_error`, a bound for
/// the volume and, about the mesh's middle, for the second moments' trace.
[[nodiscard]] Result<Moments> moments(const Mesh& mesh, double deviation = 0);

}  // namespace robomosp::geometry
