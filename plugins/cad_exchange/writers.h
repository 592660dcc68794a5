// SPDX-License-Identifier: Apache-2.0
// Meshes and drawings out: STL, OBJ, PLY, GLB, 3MF, DXF (layer: plugin).
#pragma once

#include <span>
#include <string>
#include <string_view>

#include <robomosp/sdk/io.h>
#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

namespace robomosp::cad_exchange {

struct MeshOptions {
  double unit = 1e-3;  ///< length of one unit of the file [m]; GLB is always in metres
  std::string_view unit_name = "mm";  ///< "mm", "cm", "m", "in", "ft"
};

/// Binary STL, all items in one.
Result<std::string> write_stl(std::span<const ExportItem>, const MeshOptions&);
/// Wavefront OBJ, an object for each part, corners joined where position and normal agree.
Result<std::string> write_obj(std::span<const ExportItem>, const MeshOptions&);
/// Binary PLY with normals and a colour for each corner.
Result<std::string> write_ply(std::span<const ExportItem>, const MeshOptions&);
/// Binary glTF 2.0, metres, y up, nodes as the items, copies share their mesh.
Result<std::string> write_glb(std::span<const ExportItem>);
/// 3MF with colours, components as the items, copies share their object; corners are joined.
Result<std::string> write_3mf(std::span<const ExportItem>, const MeshOptions&);
/// DXF: outlines of items that have a profile, seen from above; meshes of the others as 3DFACE.
Result<std::string> write_dxf(std::span<const ExportItem>, const MeshOptions&);

}  // namespace robomosp::cad_exchange
