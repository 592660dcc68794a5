// SPDX-License-Identifier: Apache-2.0
// All that holds bodies together or apart in a step, as rows J v + s p = r with an impulse p within
// bounds; equal rows of joints at once by a Cholesky factor, what is left by sweeps over the
// impulses (projected Gauss-Seidel: R. W. Cottle, J.-S. Pang, R. E. Stone, The Linear
// Complementarity Problem, 1992; for bodies E. Catto, Iterative Dynamics with Temporal Coherence,
// 2005).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "spatial/vec.h"

namespace sequential_impulses {

using namespace robomosp::spatial;
using robomosp::Sym3;
using robomosp::Vec3;

struct Moving {
  double inverse_mass = 0;
  Sym3 inverse_inertia{};  ///< world axes
  Vec3 v{}, w{};           ///< of the centre of mass
};

constexpr double kUnbounded = std::numeric_limits<double>::infinity();

struct Row {
  struct End {
    std::size_t body = 0;
    Vec3 linear{}, angular{};
  };
  std::vector<End> ends;
  double target = 0;    ///< r
  double softness = 0;  ///< s
  double yielding = 0;  ///< the same as a share of J M^-1 J^T
  double low = -kUnbounded, high = kUnbounded;
  std::uint64_t key = 0;  ///< of the same row in the next step
  std::size_t normal = 0;
  double friction = 0;  ///< > 0: this and the next row are no longer than friction times `normal`
  double impulse = 0;

  [[nodiscard]] bool is_equal() const {
    return low == -kUnbounded && high == kUnbounded && friction == 0;
  }
  [[nodiscard]] double speed(const std::vector<Moving>& bodies) const {
    double sum = 0;
    for (const End& e : ends)
      sum += dot(e.linear, bodies[e.body].v) + dot(e.angular, bodies[e.body].w);
    return sum;
  }
  void push(std::vector<Moving>& bodies, double p) const {
    for (const End& e : ends) {
      Moving& m = bodies[e.body];
      m.v = add(m.v, scale(e.linear, p * m.inverse_mass));
      m.w = add(m.w, scale(multiply(m.inverse_inertia, e.angular), p));
    }
  }
};

/// Speed along row x that a unit impulse along row y gives.
inline double coupling(const Row& x, const Row& y, const std::vector<Moving>& bodies) {
  double sum = 0;
  for (const Row::End& e : x.ends)
    for (const Row::End& f : y.ends)
      if (e.body == f.body) {
        const Moving& m = bodies[e.body];
        sum += m.inverse_mass * dot(e.linear, f.linear) +
               dot(e.angular, multiply(m.inverse_inertia, f.angular));
      }
  return sum;
}

/// Finds the impulses and gives them to the bodies.
class Solve {
 public:
  Solve(std::vector<Row>& rows, std::vector<Moving>& bodies, int sweeps) : rows_(rows) {
    std::stable_partition(rows.begin(), rows.end(), [](const Row& r) { return r.is_equal(); });
    for (const Row& r : rows_) equal_ += r.is_equal() ? 1 : 0;
    n_ = rows.size();
    a_.resize(n_ * n_);
    b_.resize(n_);
    for (std::size_t i = 0; i < n_; ++i) {
      b_[i] = rows[i].target - rows[i].speed(bodies);
      for (std::size_t k = 0; k <= i; ++k) a(i, k) = a(k, i) = coupling(rows[i], rows[k], bodies);
      a(i, i) += rows[i].softness + (kSoftness + rows[i].yielding) * a(i, i);
    }
    eliminate();
    sweep(sweeps);
    substitute();
    for (const Row& r : rows_) r.push(bodies, r.impulse);
  }

 private:
  // Rows that say the same twice (closed loops) share their impulse.
  static constexpr double kSoftness = 1e-10, kLeast = 1e-30, kSettled = 1e-9;
  double& a(std::size_t i, std::size_t k) { return a_[i * n_ + k]; }

  /// Gauss's elimination of the equal rows: what is left of the others knows them.
  void eliminate() {
    for (std::size_t i = 0; i < equal_; ++i)
      for (std::size_t k = i + 1; k < n_; ++k) {
        const double f = a(k, i) / std::max(a(i, i), kLeast);
        if (f == 0) continue;
        for (std::size_t c = i + 1; c < n_; ++c) a(k, c) -= f * a(i, c);
        b_[k] -= f * b_[i];
      }
  }
  void sweep(int sweeps) {
    for (int pass = 0; pass < sweeps; ++pass) {
      double change = 0, size = 0;
      for (std::size_t i = equal_; i < n_; ++i) {
        const std::size_t count = rows_[i].friction > 0 ? 2 : 1;
        double now[2] = {}, length = 0;
        // One divisor for both directions of friction, so that it ends up against the slip.
        const double divisor =
            count == 1 ? a(i, i) : std::max(a(i, i), a(i + 1, i + 1)) + std::fabs(a(i, i + 1));
        for (std::size_t k = 0; k < count; ++k) {
          const Row& r = rows_[i + k];
          double rest = b_[i + k];
          for (std::size_t c = equal_; c < n_; ++c) rest -= a(i + k, c) * rows_[c].impulse;
          now[k] = std::clamp(r.impulse + rest / std::max(divisor, kLeast), r.low, r.high);
          length = std::hypot(length, now[k]);
        }
        if (count == 2) {  // Coulomb's cone, not a pyramid
          const double most = rows_[i].friction * normal_impulse(rows_[i]);
          if (length > most)
            for (double& x : now) x *= most / length;
        }
        for (std::size_t k = 0; k < count; ++k) {
          change = std::max(change, std::fabs(now[k] - rows_[i + k].impulse));
          size = std::max(size, std::fabs(now[k]));
          rows_[i + k].impulse = now[k];
        }
        i += count - 1;
      }
      if (change <= kSettled * size) return;
    }
  }
  /// The row that presses, by its key.
  [[nodiscard]] double normal_impulse(const Row& tangent) const {
    return rows_[equal_ + tangent.normal].impulse;
  }
  void substitute() {
    for (std::size_t i = equal_; i-- > 0;) {
      double rest = b_[i];
      for (std::size_t c = i + 1; c < n_; ++c) rest -= a(i, c) * rows_[c].impulse;
      rows_[i].impulse = rest / std::max(a(i, i), kLeast);
    }
  }

  std::vector<Row>& rows_;
  std::size_t n_ = 0, equal_ = 0;
  std::vector<double> a_, b_;
};

}  // namespace sequential_impulses
