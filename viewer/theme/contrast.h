// SPDX-License-Identifier: GPL-3.0-or-later
// Contrast of the theme's colours, as WCAG 2 defines it (layer: GUI).
#pragma once

#include <vector>

#include <QColor>
#include <QString>

#include "viewer/theme/theme.h"

namespace robomosp::viewer {

/// (L1 + 0.05) / (L2 + 0.05) of the relative luminances of two opaque colours: 1 .. 21.
[[nodiscard]] double contrast(const QColor& a, const QColor& b);

/// A colour of the theme.
struct PaletteRow {
  QString name;
  QColor colour;
  double contrast = 0;  ///< on the panel; 0 = no text has this colour
};
/// The colours of the design's palette in their order.
[[nodiscard]] std::vector<PaletteRow> contrast_table(const Theme& theme);

/// A colour of text on a ground that the window has.
struct TextPair {
  QString text, ground;
  QColor text_colour, ground_colour;
};
/// All text that must be readable, with each ground it appears on. Disabled text is not among it.
[[nodiscard]] std::vector<TextPair> text_pairs(const Theme& theme);

}  // namespace robomosp::viewer
