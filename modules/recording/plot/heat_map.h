// SPDX-License-Identifier: Apache-2.0
// Heat maps: a column of a recording over two others, as a picture with a colour bar
// (layer: application). [any thread]
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <robomosp/sdk/result.h>

#include "recording/recording.h"

namespace robomosp::recording {

struct HeatMapRequest {
  std::string column;               ///< the value; empty = share, else manipulability
  std::string x, y;                 ///< the axes; empty = the first two columns, of voxels x and z
  std::optional<double> at;         ///< of voxels: position of the section along the third axis
                                    ///< [m]; default 0
  std::optional<double> low, high;  ///< of the colours; empty = of the values
  bool is_log = false;              ///< logarithmic colours
  std::vector<std::array<double, 2>> curve;  ///< points to mark, such as singular ones
  std::string title;                         ///< empty = the recording's
  int width = 720, height = 560;             ///< pixels
};

/// Cells of equal size, x-fastest.
struct HeatMap {
  struct Axis {
    std::string label;           ///< name with unit
    double first = 0, step = 1;  ///< centre of the first cell; distance to the next
    std::size_t count = 0;
    [[nodiscard]] double low() const { return first - 0.5 * step; }
    [[nodiscard]] double high() const { return first + step * (static_cast<double>(count) - 0.5); }
  };
  std::string title, label;  ///< label: the value with its unit
  Axis x, y;
  std::vector<double> values;  ///< NaN if there is no row, or a collision
  double low = 0, high = 1;    ///< of the colours
  bool is_log = false;
  bool is_metric = false;       ///< both axes are positions: drawn to one scale
  bool has_collisions = false;  ///< some cells are empty because the robot collides there
  std::optional<double> at;     ///< the section's place along the third axis [m]
  std::size_t cells = 0;        ///< number of cells with a value
  std::vector<std::array<double, 2>> curve;
  int width = 0, height = 0;
};

/// Errors: unknown columns, rows that are not a grid, and more than 2^22 cells. Cells of colliding
/// slices are left empty.
[[nodiscard]] Result<HeatMap> heat_map(const Recording&, const HeatMapRequest&);

[[nodiscard]] std::string to_svg(const HeatMap&);
/// The bytes of a file of that name: .svg by the program itself, .png and .pdf through gnuplot.
[[nodiscard]] Result<std::string> heat_map_file(const HeatMap&, const std::string& name);

}  // namespace robomosp::recording
