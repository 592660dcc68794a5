// SPDX-License-Identifier: GPL-3.0-or-later
// ResultPicture: the picture that a result of a command is or names (layer: GUI).
#pragma once

#include <optional>
#include <string>

#include <QByteArray>
#include <QImage>
#include <QSize>
#include <QString>

#include "kernel/value.h"

namespace robomosp::viewer {

struct ResultPicture {
  QString title;     ///< such as "plate.png"
  QString file;      ///< that has it; "" = `bytes`
  QByteArray bytes;  ///< of a PNG or SVG file
  std::string text;  ///< how the result has it, where that is long: Base64 or the text of the SVG
};

/// The picture of {png = Base64}, {file = "x.png"}, the name of a file, Base64 of a PNG file, or
/// the text of an SVG file; none = it is no picture. Files are not read.
[[nodiscard]] std::optional<ResultPicture> picture_of(const Value& result);

/// Reads and draws it, not larger than `most`; it is never enlarged, except plots as SVG. Null if
/// it cannot be read. [any thread]
[[nodiscard]] QImage draw_picture(const ResultPicture& picture, QSize most);

}  // namespace robomosp::viewer
