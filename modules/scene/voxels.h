// SPDX-License-Identifier: Apache-2.0
// Maps of voxels around a robot: coloured by a column, cut open or translucent, with a legend
// (layer: application, scene). [any thread]
#pragma once

#include <optional>
#include <string>

#include <robomosp/sdk/render.h>
#include <robomosp/sdk/result.h>

#include "recording/recording.h"

namespace robomosp::scene {

/// How a map of voxels is shown.
struct VoxelView {
  /// What lies on the side that the normal points to is left out, by whole voxels.
  struct Cut {
    Vec3 point{}, normal{};  ///< mounting frame [m]
  };
  std::string column;  ///< empty = share, else manipulability
  std::optional<Cut> cut;
  double opacity = 1;               ///< 0 (exclusive)..1
  std::optional<double> low, high;  ///< of the colours; none = of the values
  std::optional<double> above;      ///< voxels of a lesser value are left out
  std::size_t bands = 20;           ///< colours, 2..100
};

/// Adds the outer faces of the voxels that are shown, an item for each colour, and their legend.
/// Tells a recording without voxels, an unknown column, and a cut or a value `above` that leaves
/// nothing.
[[nodiscard]] Result<void> add_voxels(render::Scene&, const recording::Recording&,
                                      const Pose& world_T_mounting, const VoxelView&);

}  // namespace robomosp::scene
