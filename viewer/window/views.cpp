// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/window/views.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include <QPainter>

namespace robomosp::viewer {
namespace {

/// Share of the convergence at which the eyes are apart without a setting.
constexpr double kEyeShare = 1.0 / 30;

// Red and cyan glasses: E. Dubois, "A projection method to generate anaglyph stereo images", 2001.
constexpr std::array<float, 9> kLeftEye{0.437F,  0.449F,  0.164F,  -0.062F, -0.062F,
                                        -0.024F, -0.048F, -0.050F, -0.017F};
constexpr std::array<float, 9> kRightEye{-0.011F, -0.032F, -0.007F, 0.377F, 0.761F,
                                         0.009F,  -0.026F, -0.093F, 1.234F};

QImage anaglyph_of(const QImage& left, const QImage& right) {
  QImage out(left.size(), QImage::Format_RGB32);
  const auto mixed = [](QRgb l, QRgb r, std::size_t row) {
    const auto part = [row](const std::array<float, 9>& m, QRgb c) {
      return m[3 * row] * static_cast<float>(qRed(c)) +
             m[3 * row + 1] * static_cast<float>(qGreen(c)) +
             m[3 * row + 2] * static_cast<float>(qBlue(c));
    };
    return static_cast<int>(
        std::clamp(part(kLeftEye, l) + part(kRightEye, r) + 0.5F, 0.0F, 255.0F));
  };
  for (int y = 0; y < out.height(); ++y) {
    const auto* l = reinterpret_cast<const QRgb*>(left.constScanLine(y));
    const auto* r = reinterpret_cast<const QRgb*>(right.constScanLine(y));
    auto* o = reinterpret_cast<QRgb*>(out.scanLine(y));
    for (int x = 0; x < out.width(); ++x)
      o[x] = qRgb(mixed(l[x], r[x], 0), mixed(l[x], r[x], 1), mixed(l[x], r[x], 2));
  }
  return out;
}

QImage interlaced_of(const QImage& left, const QImage& right) {
  QImage out = left;
  for (int y = 1; y < out.height(); y += 2)
    std::memcpy(out.scanLine(y), right.constScanLine(y),
                static_cast<std::size_t>(out.bytesPerLine()));
  return out;
}

}  // namespace

bool is_mixed(Stereo mode) { return mode == Stereo::anaglyph || mode == Stereo::interlaced; }

std::vector<SceneShot> stereo_pair(const OrbitCamera& camera, const StereoSettings& settings,
                                   QSize size) {
  const double convergence = settings.convergence > 0 ? settings.convergence : camera.distance();
  const double eyes = settings.eye_distance > 0 ? settings.eye_distance : kEyeShare * convergence;
  std::vector<SceneShot> shots;
  for (const bool is_right : {false, true}) {
    SceneShot shot{camera, 0, QRect(QPoint(), size)};
    if (settings.mode == Stereo::side_by_side) {
      const int half = size.width() / 2;
      shot.rect =
          QRect(is_right ? half : 0, 0, is_right ? size.width() - half : half, size.height());
    }
    shot.camera.set_viewport(shot.rect.width(), shot.rect.height());
    const double side = (is_right ? 0.5 : -0.5) * eyes;  // of this eye, to the right [m]
    const double per_pixel = shot.camera.metres_per_pixel();
    // The camera moves sideways and its picture back, so that the two meet at the convergence.
    shot.camera.pan(-side / per_pixel, 0);
    const double per_pixel_there =
        camera.perspective() ? per_pixel * convergence / camera.distance() : per_pixel;
    shot.shift = side / per_pixel_there;
    shots.push_back(shot);
  }
  return shots;
}

QImage composed(const std::vector<SceneShot>& shots, const std::vector<QImage>& images, Stereo mode,
                QSize size) {
  if (images.empty() || images.size() != shots.size()) return {};
  if (is_mixed(mode) && images.size() == 2 && images[0].size() == images[1].size()) {
    const QImage left = images[0].convertToFormat(QImage::Format_RGB32),
                 right = images[1].convertToFormat(QImage::Format_RGB32);
    return mode == Stereo::anaglyph ? anaglyph_of(left, right) : interlaced_of(left, right);
  }
  if (images.size() == 1) return images.front();
  QImage out(size, QImage::Format_RGB32);
  out.fill(Qt::black);
  QPainter painter(&out);
  for (std::size_t i = 0; i < shots.size(); ++i)
    painter.drawImage(shots[i].rect.topLeft(), images[i]);
  return out;
}

}  // namespace robomosp::viewer
