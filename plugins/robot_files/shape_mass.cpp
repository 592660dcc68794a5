// SPDX-License-Identifier: Apache-2.0
#include "shape_mass.h"

#include <numbers>

#include "spatial/mass.h"

namespace robomosp::robot_files {

std::optional<MassProperties> shape_mass(const Shape& s, MeshMasses& meshes, MeshInertia rule) {
  constexpr double kPi = std::numbers::pi;
  const auto [x, y, z] = s.size;
  MassProperties m;
  switch (s.kind) {
    case Shape::Kind::box:
      m.mass = x * y * z;
      m.inertia = {m.mass * (y * y + z * z) / 12, m.mass * (x * x + z * z) / 12,
                   m.mass * (x * x + y * y) / 12};
      break;
    case Shape::Kind::cylinder: {
      m.mass = kPi * x * x * y;
      const double across = m.mass * (3 * x * x + y * y) / 12;
      m.inertia = {across, across, m.mass * x * x / 2};
      break;
    }
    case Shape::Kind::sphere: {
      m.mass = 4 * kPi * x * x * x / 3;
      const double i = 2 * m.mass * x * x / 5;
      m.inertia = {i, i, i};
      break;
    }
    case Shape::Kind::capsule: {
      // A cylinder and two half balls, whose centres are 3/8 of the radius from their discs.
      const double tube = kPi * x * x * y, caps = 4 * kPi * x * x * x / 3;
      m.mass = tube + caps;
      const double across =
          tube * (3 * x * x + y * y) / 12 + caps * (2 * x * x / 5 + y * y / 4 + 3 * x * y / 8);
      m.inertia = {across, across, tube * x * x / 2 + 2 * caps * x * x / 5};
      break;
    }
    case Shape::Kind::ellipsoid:
      m.mass = 4 * kPi * x * y * z / 3;
      m.inertia = {m.mass * (y * y + z * z) / 5, m.mass * (x * x + z * z) / 5,
                   m.mass * (x * x + y * y) / 5};
      break;
    case Shape::Kind::mesh: {
      const auto of_mesh =
          s.mesh ? mesh_mass(*s.mesh, s.scale, rule) : meshes.of(s.path, s.scale, rule);
      if (!of_mesh) return std::nullopt;
      m = *of_mesh;
      break;
    }
  }
  if (!(m.mass > 0)) return std::nullopt;
  return spatial::in_frame(m, s.pose);
}

}  // namespace robomosp::robot_files
