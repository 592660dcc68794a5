// SPDX-License-Identifier: Apache-2.0
// What a scale node does to primitives and to volume integrals, in closed form: for engines that
// cannot stretch a solid itself (layer: contract, std only). [any thread]
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <initializer_list>
#include <optional>

#include <robomosp/sdk/csg.h>

namespace robomosp {

/// Moments of a solid stretched along the axes from the origin by factors > 0: of volume, first and
/// second moments the exact image, with the relative error that the solid's had. The area is what
/// it is only where the factors are equal; elsewhere it is a bound from above, and `exact` refers
/// to the other numbers.
[[nodiscard]] inline Moments scaled_moments(const Moments& m, const Vec3& factors) {
  const auto [x, y, z] = factors;
  const double volume = x * y * z;
  Moments out = m;
  out.volume = m.volume * volume;
  out.area = m.area * std::max({x * y, y * z, x * z});
  for (std::size_t k = 0; k < 3; ++k) out.first[k] = m.first[k] * volume * factors[k];
  out.second = {m.second.xx * volume * x * x, m.second.yy * volume * y * y,
                m.second.zz * volume * z * z, m.second.xy * volume * x * y,
                m.second.yz * volume * y * z, m.second.xz * volume * x * z};
  return out;
}

/// Surface of an ellipsoid of three half axes (Legendre, 1825), to rounding.
[[nodiscard]] inline double ellipsoid_area(double x, double y, double z) {
  constexpr double kPi = 3.14159265358979323846;
  std::array<double, 3> r{x, y, z};
  std::sort(r.begin(), r.end());
  const auto [c, b, a] = r;
  if (!(c < a)) return 4 * kPi * a * a;
  const double cosine = c / a, sine2 = (a - c) / a * ((a + c) / a), sine = std::sqrt(sine2);
  const double k2 = (b - c) / b * ((b + c) / b) / sine2;
  const double k = std::sqrt(std::clamp(k2, 0.0, 1.0)), angle = std::atan2(sine, cosine);
  return 2 * kPi * c * c +
         2 * kPi * a * b / sine *
             (std::ellint_2(k, angle) * sine2 + std::ellint_1(k, angle) * cosine * cosine);
}

/// The primitive, at its place, that a scale node makes of a primitive child; the answer's
/// placement is that in the frame of the scale node, its parent is not set. None where the result
/// is no primitive, or the child's axes are not those of the node.
[[nodiscard]] inline std::optional<CsgNode> scaled_primitive(const CsgNode& child,
                                                             const Vec3& factors) {
  constexpr double kRounded = 4e-16;  // of a quarter turn that was given as an angle
  // Along each of the child's axes the factor of the node's axis that it lies on.
  Vec3 f{};
  for (std::size_t c = 0; c < 3; ++c) {
    std::size_t off = 0;
    for (std::size_t r = 0; r < 3; ++r) {
      if (std::abs(child.placement.R[3 * r + c]) > kRounded) f[c] = factors[r];
      else ++off;
    }
    if (off != 2) f[c] = 0;
  }
  const bool is_even = factors[0] == factors[1] && factors[1] == factors[2];
  if (is_even) f = factors;
  if (f[0] == 0 || f[1] == 0 || f[2] == 0) return {};
  CsgNode out = child;
  for (std::size_t k = 0; k < 3; ++k) out.placement.p[k] *= factors[k];
  auto& s = out.sizes;
  const bool is_round = f[0] == f[1];
  const auto by = [&](std::initializer_list<double> of) {
    std::size_t k = 0;
    for (const double x : of) s[k++] *= x;
    return std::optional<CsgNode>(out);
  };
  switch (child.kind) {
    case CsgKind::box:
      if (s[3] != 0 && !is_even) return {};
      return by({f[0], f[1], f[2], f[0]});
    case CsgKind::cylinder:
      if (!is_round || (s[2] != 0 && !is_even)) return {};
      return by({f[0], f[2], f[0]});
    case CsgKind::cone:
      if (!is_round) return {};
      return by({f[0], f[0], f[2]});
    case CsgKind::sphere:
      if (is_even) return by({f[0]});
      out.kind = CsgKind::ellipsoid;
      s[1] = s[2] = s[0];
      return by({f[0], f[1], f[2]});
    case CsgKind::ellipsoid: return by({f[0], f[1], f[2]});
    case CsgKind::torus:
      if (!is_even) return {};
      return by({f[0], f[0]});
    case CsgKind::frustum: return by({f[0], f[1], f[0], f[1], f[2]});
    case CsgKind::wedge: return by({f[0], f[1], f[2], f[0]});
    case CsgKind::pyramid:
      if (!is_round) return {};
      return by({1, f[0], f[0], f[2]});
    default: return {};
  }
}

}  // namespace robomosp
