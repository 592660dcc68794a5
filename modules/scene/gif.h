// SPDX-License-Identifier: Apache-2.0
// Animated GIF files: one palette for the film, frames that contain only changes (layer:
// application, scene). [one thread at a time]
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace robomosp::scene {

/// A colour of a palette, sRGB.
using GifColour = std::array<std::uint8_t, 3>;

/// Counts the colours of pictures and finds a few that represent them: boxes of the colour cube are
/// cut at their mean, the one with the greatest squared error first.
class GifPalette {
 public:
  GifPalette();
  /// Bytes red, green, blue, opacity of each pixel; opacity is ignored.
  void add(std::span<const std::uint8_t> rgba);
  /// At most `most` (1..256) colours; black where no pixel was counted.
  [[nodiscard]] std::vector<GifColour> colours(std::size_t most) const;

 private:
  struct Bin {
    std::uint64_t count = 0, red = 0, green = 0, blue = 0;
  };
  std::vector<Bin> bins_;
};

/// Writes a film that repeats forever. Gradients are dithered by a fixed pattern, so that static
/// parts keep their pixels.
class GifWriter {
 public:
  /// `palette`: 1..255 colours; sizes 1..65535 px.
  GifWriter(std::size_t width, std::size_t height, std::vector<GifColour> palette);
  ~GifWriter();
  GifWriter(const GifWriter&) = delete;
  GifWriter& operator=(const GifWriter&) = delete;
  /// Adds width x height pixels, shown until `end` from the start [s].
  void add(std::span<const std::uint8_t> rgba, double end);
  /// The file; no frame can follow.
  [[nodiscard]] std::string finish();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace robomosp::scene
