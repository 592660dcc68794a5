// SPDX-License-Identifier: Apache-2.0
// Distance and depth of rounded zonotopes: the points c + sum of s_k g_k with every s_k in -1..1,
// and all within r of them. A sphere has no side g, a capsule one, a box three.
//
// The differences of points of two of them fill a zonotope again, with the sides of both, at most
// six. How far apart they are is a least squares problem with bounds,
//
//     min | c + sum s_k g_k |,  -1 <= s_k <= 1,
//
// solved in finitely many steps by an active set (P. B. Stark, R. L. Parker, Comp. Stat. 10
// (1995) 129). Where it is zero, the depth is the least way out of the difference through one of
// its faces, whose normals are the products g_i x g_j (P. McMullen, Trans. AMS 159 (1971) 91).
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "spatial/vec.h"

namespace rounded_boxes {

using namespace robomosp::spatial;
using robomosp::Vec3;

struct Zonotope {
  Vec3 center{};
  std::array<Vec3, 3> sides{};
  std::size_t count = 0;  ///< of sides
  double radius = 0;
};

struct Gap {
  double distance = 0;  ///< below 0: minus the depth
  Vec3 on_a{}, on_b{};
};

/// The differences of two zonotopes; s holds the place of the answer.
class Difference {
 public:
  Difference(const Zonotope& a, const Zonotope& b)
      : a_(a), b_(b), center_(sub(a.center, b.center)) {
    for (std::size_t k = 0; k < a.count; ++k) sides_[count_++] = a.sides[k];
    for (std::size_t k = 0; k < b.count; ++k) sides_[count_++] = scale(b.sides[k], -1);
    size_ = norm(center_);
    for (std::size_t k = 0; k < count_; ++k) size_ += norm(sides_[k]);
  }

  [[nodiscard]] Gap gap() {
    constexpr double kTouching = 1e-14;
    const double radii = a_.radius + b_.radius;
    const Vec3 apart = nearest(center_);
    double way = norm(apart);
    if (way > kTouching * size_) return with_radii(scale(apart, 1 / way), way - radii);
    Vec3 out{0, 0, 1};
    const double depth = least_way_out(out);
    nearest(sub(center_, scale(out, depth)));  // s of the face's point
    return with_radii(scale(out, -1), -depth - radii);
  }

 private:
  /// The points of both at s, moved to the surfaces; `n` leads from b to a.
  [[nodiscard]] Gap with_radii(const Vec3& n, double distance) const {
    Gap g{distance, a_.center, b_.center};
    for (std::size_t k = 0; k < count_; ++k) {
      if (k < a_.count) g.on_a = add(g.on_a, scale(sides_[k], s_[k]));
      else g.on_b = sub(g.on_b, scale(sides_[k], s_[k]));
    }
    g.on_a = sub(g.on_a, scale(n, a_.radius));
    g.on_b = add(g.on_b, scale(n, b_.radius));
    return g;
  }

  /// The least c + sum s_k g_k; leaves s.
  Vec3 nearest(const Vec3& c) {
    constexpr double kRounding = 4e-16;
    constexpr int kMostSteps = 200;  // far above what is needed; a guard against rounding
    std::array<bool, 6> is_free{};
    for (std::size_t k = 0; k < count_; ++k) s_[k] = dot(sides_[k], c) > 0 ? -1 : 1;
    Vec3 r = value(c);
    for (int step = 0; step < kMostSteps; ++step) {
      // The side whose bound holds back most.
      std::size_t best = count_;
      double most = kRounding * size_;
      for (std::size_t k = 0; k < count_; ++k) {
        if (is_free[k]) continue;
        const double pull = dot(sides_[k], r) * s_[k] / norm(sides_[k]);
        if (pull > most) most = pull, best = k;
      }
      if (best == count_) break;
      is_free[best] = true;
      if (!settle(c, is_free)) is_free[best] = false;  // it adds no direction
      const Vec3 now = value(c);
      if (!(dot(now, now) < dot(r, r))) break;
      r = now;
    }
    return r;
  }

  /// Moves the free sides to their least squares, as far as the bounds allow; what meets a bound is
  /// free no more. False where the free sides depend on each other.
  bool settle(const Vec3& c, std::array<bool, 6>& is_free) {
    for (;;) {
      std::array<std::size_t, 6> free{};
      std::size_t n = 0;
      for (std::size_t k = 0; k < count_; ++k)
        if (is_free[k]) free[n++] = k;
      if (n == 0) return true;
      std::array<double, 6> target{};
      if (!least_squares(c, free, n, target)) return false;
      double share = 1;
      std::size_t stops = 6;
      for (std::size_t i = 0; i < n; ++i) {
        const double from = s_[free[i]], to = target[i];
        if (to >= -1 && to <= 1) continue;
        const double part = ((to > 1 ? 1.0 : -1.0) - from) / (to - from);
        if (part < share || stops == 6) share = part, stops = i;
      }
      for (std::size_t i = 0; i < n; ++i) s_[free[i]] += share * (target[i] - s_[free[i]]);
      if (stops == 6) return true;
      s_[free[stops]] = target[stops] > 1 ? 1 : -1;
      is_free[free[stops]] = false;
    }
  }

  /// s of the free sides without their bounds, by orthogonal columns (modified Gram-Schmidt).
  bool least_squares(const Vec3& c, const std::array<std::size_t, 6>& free, std::size_t n,
                     std::array<double, 6>& s) const {
    constexpr double kDependent = 1e-12;
    if (n > 3) return false;
    Vec3 rest = scale(c, -1);
    for (std::size_t k = 0, i = 0; k < count_; ++k) {
      if (i < n && free[i] == k) ++i;
      else rest = sub(rest, scale(sides_[k], s_[k]));
    }
    std::array<Vec3, 3> q{};
    double r[3][3] = {}, y[3] = {};
    for (std::size_t i = 0; i < n; ++i) {
      const Vec3& g = sides_[free[i]];
      Vec3 v = g;
      for (int pass = 0; pass < 2; ++pass)  // twice is enough
        for (std::size_t k = 0; k < i; ++k) {
          const double part = dot(q[k], v);
          r[k][i] += part;
          v = sub(v, scale(q[k], part));
        }
      r[i][i] = norm(v);
      if (!(r[i][i] > kDependent * norm(g))) return false;
      q[i] = scale(v, 1 / r[i][i]);
      y[i] = dot(q[i], rest);
      rest = sub(rest, scale(q[i], y[i]));
    }
    for (std::size_t i = n; i-- > 0;) {
      s[i] = y[i];
      for (std::size_t k = i + 1; k < n; ++k) s[i] -= r[i][k] * s[k];
      s[i] /= r[i][i];
    }
    return true;
  }

  /// Depth of the origin below the nearest face, `out` its normal; 0 where the sides span no space.
  double least_way_out(Vec3& out) const {
    constexpr double kParallel = 1e-9;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < count_; ++i)
      for (std::size_t k = i + 1; k < count_; ++k) {
        const Vec3 product = cross(sides_[i], sides_[k]);
        const double length = norm(product);
        if (!(length > kParallel * norm(sides_[i]) * norm(sides_[k]))) continue;
        Vec3 n = scale(product, 1 / length);
        double at = dot(n, center_), reach = 0;
        if (at < 0) n = scale(n, -1), at = -at;
        for (std::size_t j = 0; j < count_; ++j) reach += std::fabs(dot(n, sides_[j]));
        // Towards +n the difference reaches at + reach, towards -n reach - at: the shorter way.
        if (reach - at < least) least = reach - at, out = scale(n, -1);
      }
    if (std::isfinite(least)) return least > 0 ? least : 0;
    if (count_ > 0) out = any_normal(sides_[0]);
    return 0;
  }
  [[nodiscard]] static Vec3 any_normal(const Vec3& v) {
    const Vec3 other = std::fabs(v[0]) < std::fabs(v[2]) ? Vec3{1, 0, 0} : Vec3{0, 0, 1};
    return unit(cross(v, other));
  }
  [[nodiscard]] Vec3 value(const Vec3& c) const {
    Vec3 r = c;
    for (std::size_t k = 0; k < count_; ++k) r = add(r, scale(sides_[k], s_[k]));
    return r;
  }

  const Zonotope &a_, &b_;
  Vec3 center_;
  std::array<Vec3, 6> sides_{};
  std::size_t count_ = 0;
  double size_ = 0;
  std::array<double, 6> s_{};
};

}  // namespace rounded_boxes
