// SPDX-License-Identifier: Apache-2.0
// Mass of a homogeneous shape, for formats that give densities (layer: plugin).
#pragma once

#include <optional>

#include "mechanism.h"

namespace robomosp::robot_files {

/// Of density 1 kg/m^3, in the body's frame; nothing for meshes and shapes without extent.
[[nodiscard]] std::optional<MassProperties> shape_mass(const Shape& s);

}  // namespace robomosp::robot_files
