// SPDX-License-Identifier: Apache-2.0
// Mass of solids and objects as commands return it, principal axes, and STL.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "ioci/commands.h"
#include "spatial/mass.h"
#include "spatial/pose.h"

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
  const Principal p = principal(b.mass.inertia);
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

Principal principal(const Sym3& s) {
  // Cyclic Jacobi: Golub & Van Loan, Matrix Computations, 8.5. Three by three converges in a few
  // sweeps; the bound only guards against NaN.
  double a[3][3] = {{s.xx, s.xy, s.xz}, {s.xy, s.yy, s.yz}, {s.xz, s.yz, s.zz}};
  double v[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const double scale = std::fabs(s.xx) + std::fabs(s.yy) + std::fabs(s.zz);
  for (int sweep = 0; sweep < 30; ++sweep) {
    if (std::fabs(a[0][1]) + std::fabs(a[0][2]) + std::fabs(a[1][2]) <= 1e-17 * scale) break;
    for (std::size_t p = 0; p < 2; ++p)
      for (std::size_t q = p + 1; q < 3; ++q) {
        if (a[p][q] == 0) continue;
        const double tau = (a[q][q] - a[p][p]) / (2 * a[p][q]);
        const double t = (tau >= 0 ? 1.0 : -1.0) / (std::fabs(tau) + std::sqrt(1 + tau * tau));
        const double c = 1 / std::sqrt(1 + t * t), sn = t * c;
        for (std::size_t k = 0; k < 3; ++k) {
          const double x = a[k][p], y = a[k][q];
          a[k][p] = c * x - sn * y;
          a[k][q] = sn * x + c * y;
        }
        for (std::size_t k = 0; k < 3; ++k) {
          const double x = a[p][k], y = a[q][k];
          a[p][k] = c * x - sn * y;
          a[q][k] = sn * x + c * y;
        }
        for (auto& row : v) {
          const double x = row[p], y = row[q];
          row[p] = c * x - sn * y;
          row[q] = sn * x + c * y;
        }
      }
  }
  std::array<std::size_t, 3> order{0, 1, 2};
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t i, std::size_t j) { return a[i][i] < a[j][j]; });
  Principal out;
  for (std::size_t i = 0; i < 3; ++i) {
    out.moments[i] = a[order[i]][order[i]];
    for (std::size_t k = 0; k < 3; ++k) out.axes[3 * k + i] = v[k][order[i]];
  }
  const auto& m = out.axes;
  const double det = m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) +
                     m[2] * (m[3] * m[7] - m[4] * m[6]);
  if (det < 0)
    for (std::size_t k = 0; k < 3; ++k) out.axes[3 * k + 2] = -out.axes[3 * k + 2];
  return out;
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
