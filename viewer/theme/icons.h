// SPDX-License-Identifier: GPL-3.0-or-later
// Icons of the interface: outlines on a grid of 16 units, tinted by the theme (layer: GUI).
#pragma once

#include <string_view>
#include <vector>

#include <QColor>
#include <QIcon>
#include <QPixmap>

namespace robomosp::viewer {

/// The icon of a name such as "world" or "play", sharp at every device pixel ratio: dim, brighter
/// under the mouse, in the accent when checked. It follows the current theme. Null if the name is
/// unknown.
[[nodiscard]] QIcon icon(std::string_view name);

/// One icon in a colour; `size` in device-independent px.
[[nodiscard]] QPixmap icon_pixmap(std::string_view name, const QColor& colour, int size,
                                  double device_pixel_ratio);

/// The icon of a kind of record ("world", "trajectory") or of a row of the navigator ("link").
[[nodiscard]] std::string_view icon_of_kind(std::string_view kind);

/// Names of all icons.
[[nodiscard]] std::vector<std::string_view> icon_names();

}  // namespace robomosp::viewer
