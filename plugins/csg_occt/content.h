// SPDX-License-Identifier: Apache-2.0
// Solids that are more than their sizes: prisms and revolutions of a profile, and what was read
// from a file (layer: plugin).
#pragma once

#include <string>
#include <vector>

#include "boolean.h"

namespace robomosp::csg_occt {

struct Content {
  std::vector<Solid> solids;  ///< [mm], checked, the right way out
  std::vector<std::string> notes;
};

/// For kinds with has_content(). Errors lack the place.
Result<Content> build_content(const CsgNode& node, FaceMemory& faces, Progress& progress);

/// The shape passes BRepCheck_Analyzer. Writes into the shape.
bool is_sound(const TopoDS_Shape& shape);

}  // namespace robomosp::csg_occt
