// SPDX-License-Identifier: GPL-3.0-or-later
// What tests of pictures share: a red cube, its picture, and the mean colour at a place.
#pragma once

#include <array>
#include <cstdlib>
#include <utility>

#include <gtest/gtest.h>

#include "viewer/scene/offscreen.h"
#include "viewer/synthetic.h"

namespace robomosp::viewer {

inline constexpr int kWidth = 480, kHeight = 320;

struct Rgb {
  double r, g, b;
  [[nodiscard]] double brightness() const { return (r + g + b) / 3; }
};

/// Mean over the 5 x 5 pixels around a place.
inline Rgb around(const Image& image, const std::array<double, 2>& pixel) {
  const int x0 = static_cast<int>(pixel[0]), y0 = static_cast<int>(pixel[1]);
  std::array<double, 3> sum{};
  for (int y = y0 - 2; y <= y0 + 2; ++y)
    for (int x = x0 - 2; x <= x0 + 2; ++x)
      for (int c = 0; c < 3; ++c) sum[static_cast<std::size_t>(c)] += image.at(x, y, c) / 25.0;
  return {sum[0], sum[1], sum[2]};
}

/// A red cube of 20 cm hovering 10 cm over the floor.
inline Frame cube_frame() {
  Frame frame;
  frame.items.push_back({7,
                         "cube",
                         synthetic::box(0.2, 0.2, 0.2),
                         {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0.2}},
                         {{0.8F, 0.1F, 0.1F, 1}, 0.2F, 0},
                         false});
  frame.camera.zoom = 0.5;
  return frame;
}

inline OffscreenRenderer renderer_for(const Frame& frame, Quality quality = Quality::fast) {
  auto r = OffscreenRenderer::create(kWidth, kHeight, quality);
  if (!r) {
    ADD_FAILURE() << r.error().sentence();
    std::abort();
  }
  r->scene().sync(frame);
  return std::move(r).value();
}

inline Image finished(OffscreenRenderer& r) {
  r.restart();
  while (r.step()) {
  }
  return r.image();
}

}  // namespace robomosp::viewer
