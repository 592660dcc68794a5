// SPDX-License-Identifier: Apache-2.0
// Mass of a homogeneous shape, for formats that give densities (layer: plugin).
#pragma once

#include <optional>

#include "mechanism.h"
#include "mesh_file.h"

namespace robomosp::robot_files {

/// Of density 1 kg/m^3, in the body's frame; nothing for shapes without extent, and for meshes that
/// MeshMasses cannot read. `rule` is for meshes.
[[nodiscard]] std::optional<MassProperties> shape_mass(const Shape& s, MeshMasses& meshes,
                                                       MeshInertia rule);

}  // namespace robomosp::robot_files
