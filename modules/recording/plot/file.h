// SPDX-License-Identifier: Apache-2.0
// Files of plots: own SVG text; PNG and PDF through gnuplot (layer: application, private to recording).
#pragma once

#include <functional>
#include <string>
#include <string_view>

#include <robomosp/sdk/result.h>

namespace robomosp::recording {

/// The inputs for both methods of drawing a plot.
struct Drawing {
  int width = 900, height = 520;  ///< pixels
  std::function<std::string()> svg;
  std::function<std::string()> gnuplot;  ///< script without terminal and output
};
/// The bytes of a file of that name: .svg, .png or .pdf; any other extension is an error.
[[nodiscard]] Result<std::string> drawing_file(const Drawing&, const std::string& name);

[[nodiscard]] std::string escape_xml(std::string_view);
/// In double quotes; enhanced mode is off.
[[nodiscard]] std::string gnuplot_text(std::string_view);

}  // namespace robomosp::recording
