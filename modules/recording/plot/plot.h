// SPDX-License-Identifier: Apache-2.0
// Plots of recordings: one description, drawn as SVG, by gnuplot (PNG, PDF) or as plain text
// (layer: application, recording). [any thread]
#pragma once

#include <cstddef>
#include <limits>
#include <string>
#include <vector>

#include <robomosp/sdk/result.h>

#include "recording/recording.h"

namespace robomosp::recording {

struct PlotLine {
  std::string name;
  std::vector<double> x, y;  ///< of equal lengths; the line is broken where they are not finite
  std::vector<double> z;     ///< of paths in space only
  std::size_t colour = 0;    ///< the same for one column of several recordings
  std::size_t source = 0;    ///< index of the recording: selects the dash pattern
};

/// Lines over one pair of axes.
struct PlotPanel {
  std::string y_label;
  std::vector<PlotLine> lines;
  /// Limits of the values; the area beyond is drawn as a band. Infinite = no band.
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
};

/// A stretch of the horizontal axis with a word above it, through all panels.
struct PlotMark {
  double from = 0, to = 0;
  std::string text;
  std::string colour = "#d62728";
};

struct Plot {
  std::string title;
  std::vector<std::string> sources;  ///< titles of the recordings if there are several
  std::string x_label, z_label;      ///< z_label: of paths in space only
  std::vector<PlotPanel> panels;     ///< one below the other, over the same x; one of a path
  bool is_path = false;              ///< a path in space with its projections
  bool is_tight = false;             ///< the horizontal axis ends with the data, as of time
  bool is_metric = false;            ///< both axes are lengths: drawn to one scale
  /// Logarithmic axes: lines and limits hold the decadic logarithms of their values.
  bool log_x = false, log_y = false;
  std::vector<PlotMark> marks;    ///< not for paths
  std::size_t left_out = 0;       ///< samples that a logarithmic axis cannot show
  std::size_t samples = 0;        ///< of all lines, with those
  int width = 900, height = 520;  ///< pixels
};

/// Options for plotting.
struct PlotRequest {
  std::vector<const Recording*> recordings;  ///< over each other; the first names the plot
  std::vector<std::string> columns;          ///< as Recording::select; empty = all but x
  std::string x;                      ///< horizontal axis; empty = time, or else the first column
  bool log_x = false, log_y = false;  ///< logarithmic axes; not for paths
  bool limits = false;                ///< show the limits of the values
  bool each_alone = false;            ///< a separate panel, with its scale, for every column
  bool is_path = false;  ///< columns are x, y, z of a path in space, those of the tool when empty
  std::string title;     ///< empty = that of the first recording
  int width = 900;
  int height = 0;  ///< 0 = as needed by the panels
};
/// Columns of one unit share a panel unless each is alone; with limits, only if these are equal
/// too. Errors: unknown columns, recordings that lack one, and columns without values above 0 along
/// a logarithmic axis; single values of 0 and below are left out there and counted.
[[nodiscard]] Result<Plot> plot(const PlotRequest&);

/// A self-contained SVG picture (axes with units, grid, legend).
[[nodiscard]] std::string to_svg(const Plot&);
/// The bytes of a file of that name: .svg by to_svg, .png and .pdf through gnuplot; any other
/// extension is an error.
[[nodiscard]] Result<std::string> plot_file(const Plot&, const std::string& name);
/// The plot in characters of ASCII, `columns` >= 40 wide; a path as its three projections.
[[nodiscard]] std::string to_text(const Plot&, std::size_t columns = 78);

}  // namespace robomosp::recording
