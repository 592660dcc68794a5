// SPDX-License-Identifier: Apache-2.0
// Joint rates that give the tip a wanted motion, a sample a lane; compiled once an instruction set.
#include "sim/rates_kernel.h"

#include "spatial/lane_angles.h"

namespace robomosp::sim::RMP_LANES {
namespace {

using namespace spatial::RMP_LANES;

/// J J^T = L D L^T, L with ones on its diagonal.
struct Factors {
  Lanes l[6][6], inverse[6], pivot;
};

RMP_INLINE Factors factors(const Lanes* jacobian, std::size_t dof) {
  Factors f;
  Lanes a[6][6] = {};
  for (std::size_t k = 0; k < dof; ++k) {
    const Lanes* column = jacobian + 6 * k;
    for (std::size_t r = 0; r < 6; ++r)
      for (std::size_t c = 0; c <= r; ++c) a[r][c] += column[r] * column[c];
  }
  Lanes greatest = a[0][0];
  for (std::size_t r = 1; r < 6; ++r) greatest = most_of(greatest, a[r][r]);
  Lanes least = greatest;
  for (std::size_t c = 0; c < 6; ++c) {
    Lanes d = a[c][c];
    for (std::size_t k = 0; k < c; ++k) d -= f.l[c][k] * a[c][k];
    least = least_of(least, d);
    f.inverse[c] = 1 / pick(d > 0, d, splat<Lanes>(1));
    for (std::size_t r = c + 1; r < 6; ++r) {
      Lanes x = a[r][c];
      for (std::size_t k = 0; k < c; ++k) x -= f.l[c][k] * a[r][k];
      a[r][c] = x;  // l times d
      f.l[r][c] = x * f.inverse[c];
    }
  }
  f.pivot = least / pick(greatest > 0, greatest, splat<Lanes>(1));
  return f;
}

RMP_INLINE void solve(const Factors& f, Lanes* x) {
  for (std::size_t r = 1; r < 6; ++r)
    for (std::size_t k = 0; k < r; ++k) x[r] -= f.l[r][k] * x[k];
  for (std::size_t r = 0; r < 6; ++r) x[r] *= f.inverse[r];
  for (std::size_t r = 5; r-- > 0;)
    for (std::size_t k = r + 1; k < 6; ++k) x[r] -= f.l[k][r] * x[k];
}

// x += J+ (wanted - J x), twice: the second pass removes what squaring the condition number cost.
RMP_INLINE void correct_one(const Factors& f, const Lanes* jacobian, std::size_t dof,
                            const Lanes* wanted, Lanes* x) {
  for (int pass = 0; pass < 2; ++pass) {
    Lanes missing[6];
    for (std::size_t r = 0; r < 6; ++r) missing[r] = wanted[r];
    for (std::size_t k = 0; k < dof; ++k)
      for (std::size_t r = 0; r < 6; ++r) missing[r] -= jacobian[6 * k + r] * x[k];
    solve(f, missing);
    for (std::size_t k = 0; k < dof; ++k)
      for (std::size_t r = 0; r < 6; ++r) x[k] += jacobian[6 * k + r] * missing[r];
  }
}

// Acceleration of the tip when all joint accelerations are zero: joint k moves the tip as column k
// says, and what turns before it turns that column: sum of (w before + w with it) x v_k, and w x
// w_k.
RMP_INLINE void velocity_acceleration(const Lanes* jacobian, std::size_t dof, const Lanes* qd,
                                      Lanes* out) {
  const Lanes none{};
  Vec<Lanes> w{none, none, none}, linear = w, angular = w;
  for (std::size_t k = 0; k < dof; ++k) {
    const Lanes* column = jacobian + 6 * k;
    const Vec<Lanes> v = scaled(Vec<Lanes>{column[0], column[1], column[2]}, qd[k]),
                     turn = scaled(Vec<Lanes>{column[3], column[4], column[5]}, qd[k]),
                     with = w + turn;
    linear = linear + cross(w + with, v);
    angular = angular + cross(w, turn);
    w = with;
  }
  out[0] = linear.x, out[1] = linear.y, out[2] = linear.z;
  out[3] = angular.x, out[4] = angular.y, out[5] = angular.z;
}

void correct(const RatesTask& task) {
  const std::size_t n = task.dof;
  for (std::size_t i = 0; i < task.count; i += kLanes) {
    const std::size_t left = task.count - i;
    Lanes jacobian[6 * kMostRates], tip[24], qd[kMostRates], qdd[kMostRates], bias[6];
    load_samples(task.jacobians + 6 * n * i, 6 * n, left, jacobian);
    load_samples(task.rates + 24 * i, 24, left, tip);
    load_samples(task.qd + n * i, n, left, qd);
    load_samples(task.qdd + n * i, n, left, qdd);
    const Factors f = factors(jacobian, n);
    correct_one(f, jacobian, n, tip + 12, qd);
    velocity_acceleration(jacobian, n, qd, bias);
    for (std::size_t r = 0; r < 6; ++r) bias[r] = tip[18 + r] - bias[r];
    correct_one(f, jacobian, n, bias, qdd);
    store_samples(qd, n, left, task.corrected_qd + n * i);
    store_samples(qdd, n, left, task.corrected_qdd + n * i);
    store(task.pivot + i, f.pivot);
  }
}

constexpr RatesKernel kKernel{correct};

}  // namespace

const RatesKernel& rates_kernel() { return kKernel; }

}  // namespace robomosp::sim::RMP_LANES
