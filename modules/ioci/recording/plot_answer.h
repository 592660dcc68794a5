// SPDX-License-Identifier: Apache-2.0
// What commands that plot have in common (layer: application, ioci, internal).
#pragma once

#include <string>
#include <vector>

#include "ioci/core/commands.h"
#include "recording/plot/plot.h"

namespace robomosp::ioci {

/// The argument `as` of a plot.
[[nodiscard]] ParamSpec plot_answer_field();

/// The plot of a request and of the arguments `kind`, `title`, `columns`, `width`, `height`, `as`
/// and `file`: the name of the file that it was written to, or without one the plot as `as` says.
/// `columns`: those of a plot over time when the arguments name none; empty = all. Samples that a
/// logarithmic axis has no place for are counted in a warning.
[[nodiscard]] Result<Value> plot_answer(CommandContext&, recording::PlotRequest request,
                                        const Map& args, std::vector<std::string> columns = {});

}  // namespace robomosp::ioci
