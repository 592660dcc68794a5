// SPDX-License-Identifier: GPL-3.0-or-later
// Small shared pieces of the triangle engine: affine maps, texts, errors (layer: plugin). Metres.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <exception>
#include <new>
#include <optional>
#include <string>
#include <string_view>

#include <robomosp/sdk/csg_check.h>

namespace robomosp::csg_cgal {

inline Vec3 operator+(const Vec3& a, const Vec3& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
inline Vec3 operator-(const Vec3& a, const Vec3& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
inline Vec3 operator*(const Vec3& a, double s) { return {a[0] * s, a[1] * s, a[2] * s}; }
inline double dot(const Vec3& a, const Vec3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline double norm(const Vec3& a) { return std::sqrt(dot(a, a)); }
/// Zero stays zero.
inline Vec3 unit(const Vec3& a) {
  const double n = norm(a);
  return n > 0 ? a * (1 / n) : Vec3{};
}

/// Coordinates are rounded to this grid [m], a power of two, so that 0.1 + 0.2 meets 0.3 exactly
/// and sums of them stay exact within 64 m.
inline constexpr double kGrid = 0x1p-47;
inline double snapped(double x) { return std::round(x / kGrid) * kGrid; }
inline Vec3 snapped(const Vec3& p) { return {snapped(p[0]), snapped(p[1]), snapped(p[2])}; }

/// A rigid motion, a mirrored one, or one that stretches along some axes.
struct Affine {
  std::array<double, 9> A{1, 0, 0, 0, 1, 0, 0, 0, 1};  ///< row-major
  Vec3 t{};
  [[nodiscard]] Vec3 turn(const Vec3& v) const {
    return {A[0] * v[0] + A[1] * v[1] + A[2] * v[2], A[3] * v[0] + A[4] * v[1] + A[5] * v[2],
            A[6] * v[0] + A[7] * v[1] + A[8] * v[2]};
  }
  [[nodiscard]] Vec3 operator()(const Vec3& p) const { return turn(p) + t; }
  [[nodiscard]] Affine operator*(const Affine& b) const;
  [[nodiscard]] bool is_identity() const;
  [[nodiscard]] bool is_translation() const;
  [[nodiscard]] bool is_mirrored() const;
  /// Least and greatest factor of length changes; `is_even` = equal in all directions.
  struct Stretch {
    double least = 1, greatest = 1;
    bool is_even = true;
  };
  [[nodiscard]] Stretch stretch() const;
  /// The normal of the image of a plane with normal `n`.
  [[nodiscard]] Vec3 turn_normal(const Vec3& n) const;
};

inline constexpr double kRigid = 1e-9;  ///< how far a rotation may be from orthonormal

/// The placement, or nothing if it is not a finite rigid motion.
std::optional<Affine> to_affine(const Pose& pose);
/// Makes quarter turns exact and rounds translations to the grid.
Affine cleaned(Affine a);

/// Mixes a number into a key.
std::uint64_t mixed(std::uint64_t key, std::uint64_t value);
std::uint64_t mixed(std::uint64_t key, std::string_view text);

/// `0.05 mm`, three digits.
std::string millimetres_text(double metres);

/// Thrown inside the engine on cancellation; guarded() catches it.
struct Cancelled {};
inline void stop_if_cancelled(const Progress& progress) {
  if (progress.cancelled()) throw Cancelled{};
}
Error cancelled_error();

/// Runs `work` and turns every exception into an Error that names the `task`.
template <class Work>
auto guarded(std::string_view task, Work&& work) -> decltype(work()) {
  std::string what;
  try {
    return work();
  } catch (const Cancelled&) {
    return cancelled_error();
  } catch (const std::bad_alloc&) {
    what = "out of memory";
  } catch (const std::exception& e) {
    what = e.what();
  } catch (...) {
    what = "unknown exception";
  }
  return error(ErrorCode::plugin_failed, std::string(task) + " failed inside CGAL: " + what,
               "Simplify the solid or move its parts slightly.");
}

}  // namespace robomosp::csg_cgal
