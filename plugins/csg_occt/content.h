// SPDX-License-Identifier: Apache-2.0
// Solids with more data than sizes: prisms and revolutions of a profile, and geometry read from a
// file (layer: plugin).
#pragma once

#include <string>
#include <vector>

#include "boolean.h"

namespace robomosp::csg_occt {

struct Content {
  std::vector<Solid> solids;  ///< [mm], checked, oriented outwards
  std::vector<std::string> notes;
};

/// For kinds with has_content(). Errors have no location.
Result<Content> build_content(const CsgNode& node, FaceMemory& faces, Progress& progress);

/// True if the shape passes BRepCheck_Analyzer. Writes into the shape.
bool is_sound(const TopoDS_Shape& shape);

}  // namespace robomosp::csg_occt
