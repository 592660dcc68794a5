// SPDX-License-Identifier: GPL-3.0-or-later
// Pace: the resolution at which a moving view gets enough pictures a second (layer: GUI, std only).
#pragma once

#include <algorithm>
#include <cmath>

namespace robomosp::viewer {

/// Learns from the time that each picture takes. Software OpenGL needs time for each pixel, so
/// fewer are drawn while the view moves.
class Pace {
 public:
  /// Time of a picture until it is on the screen [s]: 40 pictures a second, with time left for
  /// what draws no pixels.
  static constexpr double kAim = 0.02;
  static constexpr double kLeast = 0.35;

  /// Of the sides of a picture in motion, kLeast .. 1; 1 = all pixels.
  [[nodiscard]] double share() const { return share_; }
  /// A picture of this share took so long [s].
  void drawn(double share, double seconds) {
    if (!(seconds > 0) || !std::isfinite(seconds)) return;
    // A part of the time does not depend on the pixels: half a step each time.
    const double wanted = share * std::pow(kAim / seconds, 0.35);
    const bool is_far = seconds > 1.1 * kAim || seconds < 0.75 * kAim;
    if (is_far) share_ = std::clamp(wanted, kLeast, 1.0);
    if (share_ > 0.95) share_ = 1;
  }

 private:
  double share_ = 1;
};

}  // namespace robomosp::viewer
