// SPDX-License-Identifier: GPL-3.0-or-later
// ToolSettings: the tool of all views, its axes and what it snaps to (layer: GUI).
#pragma once

#include <cstdint>
#include <numbers>
#include <string>

#include "viewer/desktop/listeners.h"

namespace robomosp::viewer {

enum class Tool : std::uint8_t {
  select,   ///< clicks select, drags on empty ground draw a box
  move,     ///< arrows at the selection
  turn,     ///< rings at the selection
  measure,  ///< clicks measure
};
inline constexpr const char* kToolNames[] = {"select", "move", "turn", "measure"};

/// The axes of the gizmo.
enum class ToolAxes : std::uint8_t {
  world,
  own,     ///< of what is moved
  parent,  ///< of the frame in which the record gives the placement
  frame,   ///< of a frame of the world, by its name
};

/// [GUI thread]
struct ToolSettings {
  Tool tool = Tool::move;
  ToolAxes axes = ToolAxes::world;
  std::string frame{};       ///< of ToolAxes::frame
  bool is_snapping = false;  ///< the magnet; Ctrl inverts it during a drag
  bool snaps_grid = false, snaps_vertex = true, snaps_edge = true, snaps_face = false,
       snaps_axis = true;
  double grid = 0.01;                          ///< [m]
  double angle = 15 * std::numbers::pi / 180;  ///< step of turns [rad]
  Listeners<> changed;
};

}  // namespace robomosp::viewer
