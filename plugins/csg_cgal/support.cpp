// SPDX-License-Identifier: GPL-3.0-or-later
#include "support.h"

#include <algorithm>
#include <charconv>
#include <utility>

namespace robomosp::csg_cgal {
namespace {

constexpr double kClean = 1e-15;  ///< nearer to 0, 1 or -1 is meant to be it

double determinant(const std::array<double, 9>& a) {
  return a[0] * (a[4] * a[8] - a[5] * a[7]) - a[1] * (a[3] * a[8] - a[5] * a[6]) +
         a[2] * (a[3] * a[7] - a[4] * a[6]);
}

}  // namespace

Affine Affine::operator*(const Affine& b) const {
  Affine c;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      c.A[3 * i + j] = A[3 * i] * b.A[j] + A[3 * i + 1] * b.A[3 + j] + A[3 * i + 2] * b.A[6 + j];
  c.t = (*this)(b.t);
  return cleaned(c);
}

bool Affine::is_translation() const { return A == Affine{}.A; }
bool Affine::is_identity() const { return is_translation() && t == Vec3{}; }
bool Affine::is_mirrored() const { return determinant(A) < 0; }

// The singular values, by Jacobi's rotations of the columns (Hestenes 1958).
Affine::Stretch Affine::stretch() const {
  std::array<Vec3, 3> c;
  for (std::size_t k = 0; k < 3; ++k) c[k] = {A[k], A[3 + k], A[6 + k]};
  for (int sweep = 0; sweep < 30; ++sweep) {
    bool is_done = true;
    for (const auto& [i, j] : {std::pair{0U, 1U}, std::pair{1U, 2U}, std::pair{0U, 2U}}) {
      const double x = dot(c[i], c[i]), y = dot(c[j], c[j]), xy = dot(c[i], c[j]);
      if (std::abs(xy) <= 1e-15 * std::sqrt(x * y)) continue;
      is_done = false;
      const double angle = 0.5 * std::atan2(2 * xy, x - y);
      const double cs = std::cos(angle), sn = std::sin(angle);
      const Vec3 a = c[i] * cs + c[j] * sn, b = c[j] * cs - c[i] * sn;
      c[i] = a;
      c[j] = b;
    }
    if (is_done) break;
  }
  const auto [least, greatest] = std::minmax({norm(c[0]), norm(c[1]), norm(c[2])});
  return {least, greatest, greatest - least < kRigid * greatest};
}

Vec3 Affine::turn_normal(const Vec3& n) const {
  const auto row = [&](std::size_t k) { return Vec3{A[3 * k], A[3 * k + 1], A[3 * k + 2]}; };
  const Vec3 a = cross(row(1), row(2)), b = cross(row(2), row(0)), c = cross(row(0), row(1));
  return unit(Vec3{dot(a, n), dot(b, n), dot(c, n)} * (determinant(A) < 0 ? -1 : 1));
}

std::optional<Affine> to_affine(const Pose& pose) {
  if (!is_rigid_motion(pose, kRigid)) return std::nullopt;
  return cleaned({pose.R, pose.p});
}

Affine cleaned(Affine a) {
  for (double& x : a.A) {
    const double whole = std::round(x);
    if (std::abs(x - whole) < kClean) x = whole + 0.0;
  }
  a.t = snapped(a.t);
  return a;
}

std::uint64_t mixed(std::uint64_t key, std::uint64_t value) {
  // The finaliser of splitmix64 (Steele, Lea and Flood 2014).
  std::uint64_t z = (key ^ value) + 0x9e3779b97f4a7c15ULL;
  z = (z ^ (z >> 30U)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27U)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31U);
}

std::uint64_t mixed(std::uint64_t key, std::string_view text) {
  for (const char c : text)
    key = mixed(key, static_cast<std::uint64_t>(static_cast<unsigned char>(c)));
  return mixed(key, text.size());
}

std::string millimetres_text(double metres) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), metres * 1e3,
                                 std::chars_format::general, 2);
  return std::string(text.data(), end.ptr) + " mm";
}

Error cancelled_error() { return error(ErrorCode::cancelled, "stopped by the user"); }

}  // namespace robomosp::csg_cgal
