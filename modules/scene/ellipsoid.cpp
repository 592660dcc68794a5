// SPDX-License-Identifier: Apache-2.0
#include "scene/ellipsoid.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace robomosp::scene {

Vec3 drawn_lengths(const Vec3& half, double size) {
  double greatest = 0;
  for (const double h : half)
    if (std::isfinite(h)) greatest = std::max(greatest, h);
  if (!(greatest > 0)) greatest = 1;
  Vec3 out;
  double most = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    out[i] = std::isfinite(half[i]) ? half[i] : 2 * greatest;
    most = std::max(most, out[i]);
  }
  if (!(most > 0)) most = 1;
  for (double& h : out) h = std::max(h / most, 0.03) * size;
  return out;
}

render::Item ellipsoid_item(std::uint64_t id, std::string name, const Pose& pose, const Vec3& half,
                            const Colour& colour) {
  constexpr std::uint32_t kRound = 48, kUp = 24;
  auto mesh = std::make_shared<Mesh>();
  for (std::uint32_t i = 0; i <= kUp; ++i)
    for (std::uint32_t j = 0; j <= kRound; ++j) {
      const double up = std::numbers::pi * i / kUp, round = 2 * std::numbers::pi * j / kRound;
      const Vec3 u{std::sin(up) * std::cos(round), std::sin(up) * std::sin(round), std::cos(up)};
      // The normal of an ellipsoid is its point on the sphere over the half lengths.
      Vec3 n{u[0] / half[0], u[1] / half[1], u[2] / half[2]};
      const double length = std::hypot(n[0], n[1], n[2]);
      for (std::size_t k = 0; k < 3; ++k) {
        mesh->positions.push_back(static_cast<float>(half[k] * u[k]));
        mesh->normals.push_back(static_cast<float>(n[k] / length));
      }
    }
  for (std::uint32_t i = 0; i < kUp; ++i)
    for (std::uint32_t j = 0; j < kRound; ++j) {
      const std::uint32_t a = i * (kRound + 1) + j, b = a + kRound + 1;
      mesh->triangles.insert(mesh->triangles.end(), {a, b, a + 1, a + 1, b, b + 1});
    }
  // The three main ellipses, so that the axes can be read from any side.
  for (std::size_t k = 0; k < 3; ++k) {
    for (std::uint32_t j = 0; j <= kRound; ++j) {
      const double t = 2 * std::numbers::pi * j / kRound;
      Vec3 p{};
      p[(k + 1) % 3] = half[(k + 1) % 3] * std::cos(t);
      p[(k + 2) % 3] = half[(k + 2) % 3] * std::sin(t);
      for (const double x : p) mesh->edge_points.push_back(static_cast<float>(x));
    }
    mesh->edge_sizes.push_back(kRound + 1);
  }
  render::Item item;
  item.id = id;
  item.name = std::move(name);
  item.mesh = std::move(mesh);
  item.pose = pose;
  item.appearance = render::Appearance{colour, 0.3F, 0.0F};
  return item;
}

}  // namespace robomosp::scene
