// SPDX-License-Identifier: Apache-2.0
// DXF in: closed outlines of a flat drawing as a profile, meshes as shapes (layer: plugin).
#pragma once

#include <string_view>

#include <robomosp/sdk/result.h>

#include "scene.h"

namespace robomosp::cad_exchange {

/// Text DXF of any version. `unit` [m] is taken where the drawing does not state one; 0 = not
/// given, then it is the millimetre, with a note. Entities understood: LINE, ARC, CIRCLE, ELLIPSE,
/// LWPOLYLINE and POLYLINE with bulges, SPLINE, 3DFACE, polyface and polygon meshes, INSERT.
Result<Scene> read_dxf(std::string_view bytes, double unit);

}  // namespace robomosp::cad_exchange
