// SPDX-License-Identifier: GPL-3.0-or-later
// The dark look of the windows: palette, style sheet and icons drawn from lines (layer: GUI).
#pragma once

#include <QIcon>

class QApplication;

namespace robomosp::viewer {

void apply_dark_theme(QApplication& application);

enum class Symbol { play, pause, to_start, loop, fit, isometric, perspective, picture };
[[nodiscard]] QIcon icon_of(Symbol symbol);

}  // namespace robomosp::viewer
