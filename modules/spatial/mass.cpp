// SPDX-License-Identifier: Apache-2.0
#include "spatial/mass.h"

#include <cmath>

#include "spatial/pose.h"

namespace robomosp::spatial {

Sym3 rotate(const Pose& a_T_b, const Sym3& s) {
  const auto& R = a_T_b.R;
  const Vec3 r0{R[0], R[1], R[2]}, r1{R[3], R[4], R[5]}, r2{R[6], R[7], R[8]};
  const Vec3 s0 = multiply(s, r0), s1 = multiply(s, r1), s2 = multiply(s, r2);
  return {dot(r0, s0), dot(r1, s1), dot(r2, s2), dot(r0, s1), dot(r1, s2), dot(r0, s2)};
}

MassProperties in_frame(const MassProperties& m, const Pose& a_T_b) {
  return {m.mass, transform(a_T_b, m.com), rotate(a_T_b, m.inertia)};
}

Sym3 parallel_axis(double mass, const Vec3& d) {
  const double x = d[0], y = d[1], z = d[2];
  return {mass * (y * y + z * z), mass * (x * x + z * z), mass * (x * x + y * y),
          0.0 - mass * x * y,     0.0 - mass * y * z,     0.0 - mass * x * z};
}

Sym3 inertia_about(const MassProperties& m, const Vec3& point) {
  return add(m.inertia, parallel_axis(m.mass, sub(m.com, point)));
}

MassProperties combine(std::span<const MassProperties> bodies) {
  MassProperties sum;
  Vec3 first{};
  for (const MassProperties& b : bodies) {
    sum.mass += b.mass;
    first = add(first, scale(b.com, b.mass));
  }
  if (sum.mass > 0) sum.com = scale(first, 1 / sum.mass);
  // One body keeps its numbers to the bit; a massless one its place.
  if (bodies.size() == 1) sum.com = bodies[0].com;
  for (const MassProperties& b : bodies) sum.inertia = add(sum.inertia, inertia_about(b, sum.com));
  return sum;
}

MassProperties mass_properties(const Moments& moments, double density) {
  MassProperties m;
  m.mass = density * moments.volume;
  if (moments.volume > 0) m.com = scale(moments.first, 1 / moments.volume);
  const Sym3& s = moments.second;
  const Sym3 about_origin{density * (s.yy + s.zz), density * (s.xx + s.zz), density * (s.xx + s.yy),
                          0.0 - density * s.xy,    0.0 - density * s.yz,    0.0 - density * s.xz};
  m.inertia = add(about_origin, scale(parallel_axis(m.mass, m.com), -1));
  return m;
}

std::array<double, 10> inertial_parameters(const MassProperties& m) {
  const Sym3 i = inertia_about(m, Vec3{});
  return {
      m.mass, m.mass * m.com[0], m.mass * m.com[1], m.mass * m.com[2], i.xx, i.yy, i.zz, i.xy, i.yz,
      i.xz};
}

Vec3 radii_of_gyration(const MassProperties& m) {
  if (!(m.mass > 0)) return {};
  const auto radius = [&](double i) { return std::sqrt(std::fmax(i, 0) / m.mass); };
  return {radius(m.inertia.xx), radius(m.inertia.yy), radius(m.inertia.zz)};
}

bool is_finite(const MassProperties& m) {
  return std::isfinite(m.mass) && is_finite(m.com) && is_finite(m.inertia);
}

}  // namespace robomosp::spatial
