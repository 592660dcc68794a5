// SPDX-License-Identifier: Apache-2.0
#include "spatial/euler.h"

#include <cmath>
#include <numbers>

#include "spatial/pose.h"

namespace robomosp::spatial {
namespace {

constexpr std::array<std::array<std::size_t, 3>, 12> kAxes{{{0, 1, 2},
                                                            {0, 2, 1},
                                                            {1, 2, 0},
                                                            {1, 0, 2},
                                                            {2, 0, 1},
                                                            {2, 1, 0},
                                                            {0, 1, 0},
                                                            {0, 2, 0},
                                                            {1, 2, 1},
                                                            {1, 0, 1},
                                                            {2, 0, 2},
                                                            {2, 1, 2}}};

constexpr std::array<EulerSequence, 24> make_sequences() {
  std::array<EulerSequence, 24> all{};
  for (std::size_t i = 0; i < 24; ++i) all[i] = {kAxes[i % 12], i >= 12};
  return all;
}
constexpr std::array<EulerSequence, 24> kSequences = make_sequences();

Pose turn_about(std::size_t axis, double angle) {
  return axis == 0 ? rotation_x(angle) : axis == 1 ? rotation_y(angle) : rotation_z(angle);
}

// The same rotation about turning axes: the turns in the opposite order.
EulerSequence turned(const EulerSequence& s) {
  return s.turning ? s : EulerSequence{{s.axes[2], s.axes[1], s.axes[0]}, true};
}
Vec3 turned(const EulerSequence& s, const Vec3& v) {
  return s.turning ? v : Vec3{v[2], v[1], v[0]};
}

// atan2 into (-pi, pi]: a zero of either sign counts as +0.
double angle_of(double sin, double cos) {
  const double a = std::atan2(sin + 0.0, cos);
  return a <= -std::numbers::pi ? std::numbers::pi : a;
}

Matrix3 columns(const Vec3& a, const Vec3& b, const Vec3& c) {
  return {a[0], b[0], c[0], a[1], b[1], c[1], a[2], b[2], c[2]};
}
Matrix3 sum(const Matrix3& a, const Matrix3& b, double f) {
  Matrix3 r;
  for (std::size_t i = 0; i < 9; ++i) r[i] = a[i] + f * b[i];
  return r;
}
Matrix3 product(const Matrix3& a, const Matrix3& b) {
  Matrix3 r{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      for (std::size_t k = 0; k < 3; ++k) r[3 * i + j] += a[3 * i + k] * b[3 * k + j];
  return r;
}
Matrix3 skew(const Vec3& v) {
  return {0, 0.0 - v[2], v[1], v[2], 0, 0.0 - v[0], 0.0 - v[1], v[0], 0};
}

}  // namespace

std::string EulerSequence::name() const {
  std::string s(1, turning ? 'r' : 's');
  for (const std::size_t a : axes) s += static_cast<char>('x' + a);
  return s;
}

std::span<const EulerSequence, 24> euler_sequences() { return kSequences; }

std::optional<EulerSequence> euler_sequence(std::string_view name) {
  if (name == "rpy") return kRollPitchYaw;
  const std::string full = name.size() == 3 ? "r" + std::string(name) : std::string(name);
  for (const EulerSequence& s : kSequences)
    if (s.name() == full) return s;
  return std::nullopt;
}

Matrix3 from_euler(const EulerSequence& s, const Vec3& angles) {
  const EulerSequence t = turned(s);
  const Vec3 a = turned(s, angles);
  return compose(compose(turn_about(t.axes[0], a[0]), turn_about(t.axes[1], a[1])),
                 turn_about(t.axes[2], a[2]))
      .R;
}

// The last angle is read after the first has been turned back: near the singular position each of
// the two is ill-defined but together they still reproduce the matrix.
EulerAngles to_euler(const EulerSequence& s, const Matrix3& r) {
  const EulerSequence t = turned(s);
  const std::size_t i = t.axes[0], j = t.axes[1], k = 3 - i - j;
  const double e = (i + 1) % 3 == j ? 1.0 : -1.0;  // +1 when i, j, k are x, y, z in a cycle
  const auto R = [&](std::size_t row, std::size_t column) { return r[3 * row + column]; };
  EulerAngles out;
  double first = 0, middle = 0, last = 0;
  const double sine = t.is_proper() ? R(j, i) : -e * R(j, k);
  const double cosine = t.is_proper() ? -e * R(k, i) : R(k, k);
  out.regularity = std::hypot(sine, cosine);
  if (out.regularity > 1e-15) first = angle_of(sine, cosine);
  const SinCos a = sin_cos(first);
  const auto back = [&](std::size_t column) {
    return a.cos * R(j, column) + e * a.sin * R(k, column);
  };
  if (t.is_proper()) {
    middle = std::atan2(out.regularity, R(i, i));
    last = angle_of(-e * back(k), back(j));
  } else {
    middle = std::atan2(e * R(i, k), out.regularity);
    last = angle_of(e * back(i), back(j));
  }
  out.angles = turned(s, Vec3{first, middle, last});
  return out;
}

Matrix3 euler_rates(const EulerSequence& s, const Vec3& angles) {
  const EulerSequence t = turned(s);
  const Vec3 a = turned(s, angles);
  const Pose one = turn_about(t.axes[0], a[0]);
  const Pose two = compose(one, turn_about(t.axes[1], a[1]));
  const Vec3 c[3] = {axis(Pose{}, t.axes[0]), axis(one, t.axes[1]), axis(two, t.axes[2])};
  return s.turning ? columns(c[0], c[1], c[2]) : columns(c[2], c[1], c[0]);
}

Matrix3 euler_rates_rate(const EulerSequence& s, const Vec3& angles, const Vec3& rates) {
  const Vec3 d = turned(s, rates);
  const Matrix3 E = euler_rates(s, angles);
  Pose e;
  e.R = E;
  const Vec3 c[3] = {axis(e, s.turning ? 0 : 2), axis(e, 1), axis(e, s.turning ? 2 : 0)};
  // Each axis is carried by the turns before it.
  const Vec3 w1 = scale(c[0], d[0]), w2 = add(w1, scale(c[1], d[1]));
  const Vec3 r1 = cross(w1, c[1]), r2 = cross(w2, c[2]);
  return s.turning ? columns({}, r1, r2) : columns(r2, r1, {});
}

std::array<double, 12> quaternion_rates(const Quaternion& q) {
  // dq/dt = 1/2 (0, w) q for w in the outer axes.
  const double w = 0.5 * q.w, x = 0.5 * q.x, y = 0.5 * q.y, z = 0.5 * q.z;
  return {-x, -y, -z, w, z, -y, -z, w, x, y, -x, w};
}

Matrix3 rotation_vector_rates(const Vec3& v) {
  // The inverse left Jacobian of SO(3) (Barfoot, State Estimation for Robotics, 2017, eq. 7.77).
  const double t = norm(v);
  const double k = t < 1e-3 ? 1.0 / 12 + t * t / 720 : 1 / (t * t) - 1 / (2 * t * std::tan(t / 2));
  const Matrix3 s = skew(v);
  return sum(sum({1, 0, 0, 0, 1, 0, 0, 0, 1}, s, -0.5), product(s, s), k);
}

Matrix3 rotation_vector_rates_rate(const Vec3& v, const Vec3& rate) {
  const double t = norm(v);
  const double half = std::sin(t / 2);
  const double k = t < 1e-3 ? 1.0 / 12 + t * t / 720 : 1 / (t * t) - 1 / (2 * t * std::tan(t / 2));
  // dk/dt = (dk/d|v|) v . rate / |v|
  const double slope =
      t < 1e-2
          ? 1.0 / 360 + t * t / 7560
          : (-2 / (t * t * t) + 1 / (2 * t * t * std::tan(t / 2)) + 1 / (4 * t * half * half)) / t;
  const Matrix3 s = skew(v), d = skew(rate);
  Matrix3 r = sum({}, d, -0.5);
  r = sum(r, product(s, s), slope * dot(v, rate));
  return sum(r, sum(product(d, s), product(s, d), 1), k);
}

}  // namespace robomosp::spatial
