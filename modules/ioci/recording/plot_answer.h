// SPDX-License-Identifier: Apache-2.0
// What commands that plot have in common (layer: application, ioci, internal).
#pragma once

#include <string>
#include <vector>

#include "ioci/core/commands.h"
#include "recording/plot/plot.h"

namespace robomosp::ioci {

/// The plot of a request and of the arguments `kind`, `title`, `columns`, `width`, `height` and
/// `file`: the name of the file that it was written to, or without one the plot in characters.
/// `columns`: those of a plot over time when the arguments name none; empty = all.
[[nodiscard]] Result<Value> plot_answer(recording::PlotRequest request, const Map& args,
                                        std::vector<std::string> columns = {});

}  // namespace robomosp::ioci
