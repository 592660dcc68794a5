// SPDX-License-Identifier: Apache-2.0
// Volume integrals of the solid that a closed mesh bounds (layer: data processing, geometry):
// exact for the polyhedron, an approximation of a curved solid. [any thread]
#pragma once

#include <robomosp/sdk/csg.h>
#include <robomosp/sdk/result.h>
#include <robomosp/sdk/types.h>

namespace robomosp::geometry {

/// Moments about the frame's origin, `exact` = false. A mesh that is not closed, or is inside out,
/// is an error.
[[nodiscard]] Result<Moments> moments(const Mesh& mesh);

}  // namespace robomosp::geometry
