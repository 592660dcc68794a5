// SPDX-License-Identifier: GPL-3.0-or-later
#include "support.h"

#include <charconv>

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
