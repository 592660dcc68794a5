// SPDX-License-Identifier: Apache-2.0
// The bodies a material is shown on, made from formulas so that no solids engine is needed.
#include <cmath>
#include <numbers>
#include <utility>

#include "scene/build.h"
#include "scene/shapes.h"

namespace robomosp::scene {
namespace {

constexpr double kHeight = 0.1;  ///< [m]
constexpr std::uint32_t kSides = 96;

void add_vertex(Mesh& m, double x, double y, double z, double nx, double ny, double nz) {
  for (const double v : {x, y, z}) m.positions.push_back(static_cast<float>(v));
  for (const double v : {nx, ny, nz}) m.normals.push_back(static_cast<float>(v));
}

void add_circle(Mesh& m, double radius, double z) {
  for (std::uint32_t s = 0; s <= kSides; ++s) {
    const double a = 2 * std::numbers::pi * (s % kSides) / kSides;
    for (const double v : {radius * std::cos(a), radius * std::sin(a), z})
      m.edge_points.push_back(static_cast<float>(v));
  }
  m.edge_sizes.push_back(kSides + 1);
}

/// Quads between consecutive rings of kSides + 1 vertices from `first` on, seen from outside.
void add_bands(Mesh& m, std::uint32_t first, std::uint32_t rings) {
  for (std::uint32_t r = 0; r + 1 < rings; ++r)
    for (std::uint32_t s = 0; s < kSides; ++s) {
      const std::uint32_t a = first + r * (kSides + 1) + s, b = a + kSides + 1;
      for (const std::uint32_t i : {a, a + 1, b + 1, a, b + 1, b}) m.triangles.push_back(i);
    }
}

std::shared_ptr<const Mesh> sphere() {
  auto m = std::make_shared<Mesh>();
  constexpr std::uint32_t kRings = 49;
  const double radius = 0.5 * kHeight;
  for (std::uint32_t r = 0; r < kRings; ++r) {
    const double latitude = std::numbers::pi * (static_cast<double>(r) / (kRings - 1) - 0.5);
    for (std::uint32_t s = 0; s <= kSides; ++s) {
      const double a = 2 * std::numbers::pi * (s % kSides) / kSides;
      const double x = std::cos(latitude) * std::cos(a), y = std::cos(latitude) * std::sin(a),
                   z = std::sin(latitude);
      add_vertex(*m, radius * x, radius * y, radius * (1 + z), x, y, z);
    }
  }
  add_bands(*m, 0, kRings);
  m->edge_sizes.push_back(0);  // a sphere has no edges; without any, creases would be looked for
  return m;
}

}  // namespace

std::shared_ptr<const Mesh> cone(double height, double radius) {
  auto m = std::make_shared<Mesh>();
  const double slope = radius / height, n = std::hypot(1.0, slope);
  for (const bool is_tip : {false, true})
    for (std::uint32_t s = 0; s <= kSides; ++s) {
      const double a = 2 * std::numbers::pi * (s % kSides) / kSides, c = std::cos(a),
                   d = std::sin(a), r = is_tip ? 0 : radius;
      add_vertex(*m, r * c, r * d, is_tip ? height : 0, c / n, d / n, slope / n);
    }
  add_bands(*m, 0, 2);
  const auto centre = static_cast<std::uint32_t>(m->vertex_count());
  add_vertex(*m, 0, 0, 0, 0, 0, -1);
  for (std::uint32_t s = 0; s <= kSides; ++s) {
    const double a = 2 * std::numbers::pi * (s % kSides) / kSides;
    add_vertex(*m, radius * std::cos(a), radius * std::sin(a), 0, 0, 0, -1);
  }
  for (std::uint32_t s = 1; s <= kSides; ++s)
    for (const std::uint32_t i : {centre, centre + s + 1, centre + s}) m->triangles.push_back(i);
  add_circle(*m, radius, 0);
  return m;
}

std::vector<render::Item> material_preview(const render::Appearance& look) {
  render::Item ball, pointed;
  ball.id = 1;
  ball.name = "sphere";
  ball.mesh = sphere();
  ball.pose.p = {-0.6 * kHeight, 0, 0};
  pointed.id = 2;
  pointed.name = "cone";
  pointed.mesh = cone(kHeight, 0.5 * kHeight);
  pointed.pose.p = {0.6 * kHeight, 0, 0};
  ball.appearance = pointed.appearance = look;
  return {std::move(ball), std::move(pointed)};
}

}  // namespace robomosp::scene
