// SPDX-License-Identifier: GPL-3.0-or-later
// Several views of one scene in a picture: four beside each other, or one for each eye (layer:
// GUI).
#pragma once

#include <cstdint>
#include <vector>

#include <QImage>
#include <QRect>
#include <QSize>

#include "viewer/scene/orbit_camera.h"

namespace robomosp::viewer {

/// How the pictures for the two eyes reach them.
enum class Stereo : std::uint8_t {
  none,
  anaglyph,      ///< through red and cyan glasses
  side_by_side,  ///< the left eye's picture on the left
  interlaced     ///< rows of the two in turn, for screens with polarised rows
};

struct StereoSettings {
  Stereo mode = Stereo::none;
  double eye_distance = 0;  ///< [m]; 0 = a thirtieth of the convergence
  double convergence = 0;   ///< distance of what is in the plane of the screen [m]; 0 = the target
  bool operator==(const StereoSettings&) const = default;
};

/// One view of the scene.
struct SceneShot {
  OrbitCamera camera;
  double shift = 0;  ///< of the picture to the right [px]
  QRect rect;        ///< in the whole picture [px], counted from the upper left corner
};

/// The views of the left and the right eye of a camera in a picture of this size [px].
[[nodiscard]] std::vector<SceneShot> stereo_pair(const OrbitCamera& camera,
                                                 const StereoSettings& settings, QSize size);

/// True if the two pictures are mixed pixel by pixel.
[[nodiscard]] bool is_mixed(Stereo mode);

/// The pictures of the views as one of this size [px].
[[nodiscard]] QImage composed(const std::vector<SceneShot>& shots,
                              const std::vector<QImage>& images, Stereo mode, QSize size);

}  // namespace robomosp::viewer
