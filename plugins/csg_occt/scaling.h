// SPDX-License-Identifier: Apache-2.0
// Solids stretched along the axes: spheres to ellipsoids, anything by a scale node (layer: plugin).
#pragma once

#include <array>
#include <vector>

#include "boolean.h"

namespace robomosp::csg_occt {

/// Stretched from the origin by factors > 0, in new topology. Curved surfaces become rational
/// splines that are them exactly; curves where faces meet that were approximations stay so. The
/// integrals of every face are the images of those before, so that they lose nothing by it.
Result<std::vector<Solid>> stretched(const std::vector<Solid>& solids,
                                     const std::array<double, 3>& factors, FaceMemory& faces,
                                     const Progress& progress);

/// Half axes [mm].
Result<Solid> ellipsoid(const std::array<double, 3>& half, FaceMemory& faces,
                        const Progress& progress);

}  // namespace robomosp::csg_occt
