// SPDX-License-Identifier: Apache-2.0
// Mass of solids and objects as commands return it, principal axes, and STL.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "ioci/commands.h"
#include "spatial/mass.h"
#include "spatial/pose.h"
#include "spatial/principal.h"

namespace robomosp::ioci {

std::vector<ParamSpec> body_mass_fields() {
  return {field("mass", "real", "kg", "Mass."),
          field("com", "vec3", "m", "Centre of mass in the frame of the record."),
          field("inertia", "matrix", "kg m^2",
                "Inertia tensor about the centre of mass; off the diagonal minus the products of "
                "inertia."),
          field("inertia_origin", "matrix", "kg m^2", "The same about the origin of the frame."),
          field("principal_moments", "vec3", "kg m^2",
                "Eigenvalues of the tensor about the centre of mass, ascending."),
          field("principal_axes", "matrix", "", "Their axes, one a column."),
          field("volume", "real", "m^3",
                "Volume; where parts overlap it counts once unless the object sums."),
          field("area", "real", "m^2", "Surface area, the sum over the parts."),
          field("overlap", "real", "m^3", "Volume that parts share."),
          field("exact", "bool", "", "True when it comes from the analytic surfaces."),
          field("notes", "list", "", "Remarks such as parts without a material.")};
}

Map body_mass_map(const document::BodyMass& b) {
  const spatial::Principal p = spatial::principal(b.mass.inertia);
  List notes;
  for (const auto& n : b.notes) notes.emplace_back(n);
  return Map{
      {"mass", b.mass.mass},
      {"com", vec_value(b.mass.com, "m")},
      {"inertia", sym_value(b.mass.inertia, "kg m^2")},
      {"inertia_origin", sym_value(spatial::inertia_about(b.mass, Vec3{}), "kg m^2")},
      {"principal_moments", vec_value(p.moments, "kg m^2")},
      {"principal_axes", NumericArray(std::vector<double>(p.axes.begin(), p.axes.end()), 3, 3)},
      {"volume", b.volume},
      {"area", b.area},
      {"overlap", b.overlap},
      {"exact", b.exact},
      {"notes", std::move(notes)}};
}

Result<std::string> stl(const std::vector<document::Drawable>& bodies) {
  std::size_t triangles = 0;
  for (const auto& b : bodies) triangles += b.mesh->triangle_count();
  if (triangles > 0xFFFFFFFFU)
    return error(ErrorCode::unsupported, "the mesh has too many triangles for STL");
  std::string out(84 + 50 * triangles, '\0');
  const std::string_view title = "robomosp, metres";
  std::copy(title.begin(), title.end(), out.begin());
  // STL is little-endian whatever the machine.
  const auto put32 = [&](std::size_t at, std::uint32_t w) {
    for (std::size_t i = 0; i < 4; ++i) out[at + i] = static_cast<char>((w >> (8 * i)) & 0xFFU);
  };
  const auto put = [&](std::size_t at, double value) {
    const auto f = static_cast<float>(value);
    std::uint32_t w = 0;
    std::memcpy(&w, &f, 4);
    put32(at, w);
  };
  put32(80, static_cast<std::uint32_t>(triangles));
  std::size_t at = 84;
  for (const auto& b : bodies)
    for (std::size_t t = 0; t < b.mesh->triangle_count(); ++t, at += 50) {
      Vec3 corner[3];
      for (std::size_t c = 0; c < 3; ++c) {
        const float* p = &b.mesh->positions[3 * std::size_t{b.mesh->triangles[3 * t + c]}];
        corner[c] = spatial::transform(
            b.placement,
            {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])});
      }
      const Vec3 n = spatial::unit(
          spatial::cross(spatial::sub(corner[1], corner[0]), spatial::sub(corner[2], corner[0])));
      for (std::size_t i = 0; i < 3; ++i) {
        put(at + 4 * i, n[i]);
        for (std::size_t c = 0; c < 3; ++c) put(at + 12 + 12 * c + 4 * i, corner[c][i]);
      }
    }
  return out;
}

}  // namespace robomosp::ioci
