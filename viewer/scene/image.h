// SPDX-License-Identifier: GPL-3.0-or-later
// Image: a finished picture, and PNG files (layer: GUI, libpng behind the source file).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <robomosp/sdk/render.h>
#include <robomosp/sdk/result.h>

namespace robomosp::viewer {

/// Eight-bit sRGB picture, rows from top to bottom, three bytes per pixel, no padding.
struct Image {
  int width = 0, height = 0;  ///< [px]
  std::vector<std::uint8_t> rgb;

  /// The byte of pixel (x, y), channel 0 red, 1 green, 2 blue; must be inside the picture.
  [[nodiscard]] std::uint8_t at(int x, int y, int channel) const {
    return rgb[3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                    static_cast<std::size_t>(x)) +
               static_cast<std::size_t>(channel)];
  }
};

/// The bytes of a PNG file; without opacity channel when every pixel is opaque. [any thread]
[[nodiscard]] Result<std::string> png_of(const render::Image& image);

/// Writes a PNG file. The file appears only when it is complete. [any thread]
[[nodiscard]] Result<void> write_png(const Image& image, const std::string& path);

}  // namespace robomosp::viewer
