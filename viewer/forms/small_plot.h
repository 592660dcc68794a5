// SPDX-License-Identifier: GPL-3.0-or-later
// Small pictures of recordings: a few curves over time (layer: GUI).
#pragma once

#include <string>
#include <vector>

#include <QImage>
#include <QSize>

#include "kernel/value.h"

namespace robomosp::viewer {

struct Theme;

/// Names of the columns that a small picture shows, of the rows of recording.columns: torques if
/// there are any, otherwise the first group such as q1, q2, q3; at most seven. Empty without a
/// column "time".
[[nodiscard]] std::vector<std::string> small_plot_columns(const List& columns);

/// Curves of a matrix with the time in its first column. `size` in pixels at the ratio. Null if
/// there is nothing to draw. [any thread]
[[nodiscard]] QImage draw_small_plot(const NumericArray& values, QSize size, double ratio,
                                     const Theme& theme);

}  // namespace robomosp::viewer
