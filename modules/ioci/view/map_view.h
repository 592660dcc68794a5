// SPDX-License-Identifier: Apache-2.0
// Planes as commands take them, and maps of voxels in pictures (layer: application). Internal to
// modules/ioci.
#pragma once

#include <string_view>

#include <robomosp/sdk/render.h>

#include "ioci/core/commands.h"

namespace robomosp::ioci {

struct Plane {
  Vec3 point{};   ///< [m]
  Vec3 normal{};  ///< any length but zero; towards the side that is taken away
};

/// normal, axis, point and offset.
[[nodiscard]] Schema plane_fields();
/// A plane that cuts pictures, with the look of the cut faces.
[[nodiscard]] Schema section_fields();
/// The word of an axis, or a table of `fields`, as a checked table.
[[nodiscard]] Result<Map> read_plane_map(const CommandContext&, const Schema& fields,
                                         const Value& given, std::string_view path);
/// The plane of a checked table; through `through` where neither point nor offset is given.
[[nodiscard]] Result<Plane> read_plane(const Map& checked, const Vec3& through,
                                       std::string_view path);

/// Adds the map `given` of a picture of `what`, a robot or a world, to its scene.
[[nodiscard]] Result<void> add_map(CommandContext&, const Value& given, AnyId what, render::Scene&);

}  // namespace robomosp::ioci
