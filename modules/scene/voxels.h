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

/// Options for showing a map of voxels.
struct VoxelView {
  /// Voxels on the side that the normal points to are hidden.
  struct Cut {
    Vec3 point{}, normal{};  ///< mounting frame [m]
  };
  std::string column;  ///< empty = share, else manipulability
  std::optional<Cut> cut;
  double opacity = 1;               ///< 0 (exclusive)..1
  std::optional<double> low, high;  ///< of the colours; empty = of the values
  std::optional<double> above;      ///< voxels with a lower value are hidden
  std::size_t bands = 20;           ///< colours, 2..100
};

/// Adds the outer faces of the visible voxels, an item for each colour, and their legend. Errors: a
/// recording without voxels, an unknown column, and a cut or a value `above` that hides everything.
[[nodiscard]] Result<void> add_voxels(render::Scene&, const recording::Recording&,
                                      const Pose& world_T_mounting, const VoxelView&);

}  // namespace robomosp::scene
