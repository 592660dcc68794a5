// SPDX-License-Identifier: Apache-2.0
#include "robotics/analytical.h"

#include <cmath>

#include "spatial/vec.h"

namespace robomosp::robotics {
namespace {

using spatial::Matrix3;

Matrix3 inverse(const Matrix3& m) {
  const Vec3 a{m[0], m[3], m[6]}, b{m[1], m[4], m[7]}, c{m[2], m[5], m[8]};
  const Vec3 bc = spatial::cross(b, c), ca = spatial::cross(c, a), ab = spatial::cross(a, b);
  const double d = spatial::dot(a, bc);
  return {bc[0] / d, bc[1] / d, bc[2] / d, ca[0] / d, ca[1] / d,
          ca[2] / d, ab[0] / d, ab[1] / d, ab[2] / d};
}
Matrix3 product(const Matrix3& a, const Matrix3& b) {
  Matrix3 r{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      for (std::size_t k = 0; k < 3; ++k) r[3 * i + j] += a[3 * i + k] * b[3 * k + j];
  return r;
}
Vec3 apply(const Matrix3& m, const Vec3& v) {
  return {m[0] * v[0] + m[1] * v[1] + m[2] * v[2], m[3] * v[0] + m[4] * v[1] + m[5] * v[2],
          m[6] * v[0] + m[7] * v[1] + m[8] * v[2]};
}
std::vector<double> list(const Matrix3& m) { return {m.begin(), m.end()}; }

}  // namespace

std::optional<Representation> representation(std::string_view name) {
  Representation n;
  if (name == "quaternion") n.kind = Representation::Kind::quaternion;
  else if (name == "rotation_vector") n.kind = Representation::Kind::rotation_vector;
  else if (const auto s = spatial::euler_sequence(name)) n.sequence = *s;
  else return std::nullopt;
  return n;
}

std::vector<double> orientation_numbers(const Representation& n, const Matrix3& R) {
  if (n.kind == Representation::Kind::quaternion) {
    const spatial::Quaternion q = spatial::to_quaternion(R);
    return {q.w, q.x, q.y, q.z};
  }
  const Vec3 v = n.kind == Representation::Kind::rotation_vector
                     ? spatial::rotation_log(R)
                     : spatial::to_euler(n.sequence, R).angles;
  return {v.begin(), v.end()};
}

std::optional<std::vector<double>> representation_rates(const Representation& n, const Matrix3& R,
                                                        const Vec3& w, std::vector<double>* rate) {
  switch (n.kind) {
    case Representation::Kind::quaternion: {
      const auto B = spatial::quaternion_rates(spatial::to_quaternion(R));
      if (rate) {
        // B is linear in the quaternion, whose rate is B w.
        double d[4];
        for (std::size_t i = 0; i < 4; ++i)
          d[i] = B[3 * i] * w[0] + B[3 * i + 1] * w[1] + B[3 * i + 2] * w[2];
        const auto Bd = spatial::quaternion_rates({d[0], d[1], d[2], d[3]});
        rate->assign(Bd.begin(), Bd.end());
      }
      return std::vector<double>(B.begin(), B.end());
    }
    case Representation::Kind::rotation_vector: {
      const Vec3 v = spatial::rotation_log(R);
      const Matrix3 B = spatial::rotation_vector_rates(v);
      if (rate) *rate = list(spatial::rotation_vector_rates_rate(v, apply(B, w)));
      return list(B);
    }
    case Representation::Kind::euler: break;
  }
  const spatial::EulerAngles a = spatial::to_euler(n.sequence, R);
  if (a.is_singular()) return std::nullopt;
  const Matrix3 B = inverse(spatial::euler_rates(n.sequence, a.angles));
  if (rate) {
    // d(E^-1)/dt = -E^-1 dE/dt E^-1
    const Matrix3 Ed = spatial::euler_rates_rate(n.sequence, a.angles, apply(B, w));
    Matrix3 Bd = product(product(B, Ed), B);
    for (double& x : Bd) x = -x;
    *rate = list(Bd);
  }
  return list(B);
}

std::vector<double> analytical_rows(std::span<const double> columns, std::span<const double> B,
                                    std::size_t size) {
  const std::size_t dof = columns.size() / 6;
  std::vector<double> rows((3 + size) * dof, 0.0);
  for (std::size_t j = 0; j < dof; ++j) {
    const double* c = columns.data() + 6 * j;
    for (std::size_t i = 0; i < 3; ++i) rows[i * dof + j] = c[i];
    for (std::size_t i = 0; i < size; ++i)
      rows[(3 + i) * dof + j] = B[3 * i] * c[3] + B[3 * i + 1] * c[4] + B[3 * i + 2] * c[5];
  }
  return rows;
}

}  // namespace robomosp::robotics
