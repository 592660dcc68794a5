// SPDX-License-Identifier: Apache-2.0
// The fast search for one vector width (layer: plugin): Levenberg-Marquardt on the base-referred
// Jacobian within the joint limits, with a damping that vanishes with the error, so that it
// converges like Newton's method (Sugihara, IEEE T-RO 27(5), 2011; limits by an active set).
// Included once by each lanes_*.cpp with RMP_LANES and RMP_LANE_SPACE set. Without the standard
// library: an inline function compiled here would be linked into code for older processors.
#include "lanes.h"

namespace robomosp::ik_numeric::RMP_LANE_SPACE {

constexpr int kWidth = RMP_LANES;
typedef double Wide __attribute__((vector_size(8 * RMP_LANES)));
typedef long long Mask __attribute__((vector_size(8 * RMP_LANES)));

static inline Wide all(double x) {
  Wide w;
  for (int i = 0; i < kWidth; ++i) w[i] = x;
  return w;
}
static inline Wide least(Wide a, Wide b) { return a < b ? a : b; }
static inline Wide most(Wide a, Wide b) { return a > b ? a : b; }
static inline Wide size_of(Wide a) { return a < 0.0 ? -a : a; }
static inline Wide root(Wide a) {
  for (int i = 0; i < kWidth; ++i) a[i] = __builtin_sqrt(a[i]);
  return a;
}
static inline bool any(Mask m) {
  long long o = 0;
  for (int i = 0; i < kWidth; ++i) o |= m[i];
  return o != 0;
}

// Sine and cosine: reduced by pi/2 in three parts (Cody and Waite), then Taylor's series up to x^15
// and x^16, with a remainder below 1e-16 on [-pi/4, pi/4].
static inline void sine_cosine(Wide x, Wide& sine, Wide& cosine) {
  const double magic = 6755399441055744.0;  // 1.5 * 2^52: adding it rounds to a whole number
  const Wide turned = x * 0.63661977236758134308 + magic;
  const Wide n = turned - magic;
  Wide r = x - n * 1.57079632673412561417e+00;
  r -= n * 6.07710050630396597660e-11;
  r -= n * 2.02226624879595063154e-21;
  const Mask k = __builtin_convertvector(n, Mask);
  const Wide z = r * r;
  Wide s = z * (-1.0 / 1307674368000.0) + 1.0 / 6227020800.0;
  s = s * z - 1.0 / 39916800.0;
  s = s * z + 1.0 / 362880.0;
  s = s * z - 1.0 / 5040.0;
  s = s * z + 1.0 / 120.0;
  s = s * z - 1.0 / 6.0;
  s = s * z * r + r;
  Wide c = z * (1.0 / 20922789888000.0) - 1.0 / 87178291200.0;
  c = c * z + 1.0 / 479001600.0;
  c = c * z - 1.0 / 3628800.0;
  c = c * z + 1.0 / 40320.0;
  c = c * z - 1.0 / 720.0;
  c = c * z + 1.0 / 24.0;
  c = c * z - 0.5;
  c = c * z + 1.0;
  const Mask swap = (k & 1) != 0;
  const Wide a = swap ? c : s, b = swap ? s : c;
  sine = (k & 2) != 0 ? -a : a;
  cosine = ((k + 1) & 2) != 0 ? -b : b;
}

struct Target {
  Wide R[9], p[3];
};

struct Error {
  Wide e[6];         // position in chain lengths, then the turn left as a chord
  Wide place, turn;  // squared: [m^2], chord^2
  Wide cost;
};

// Tip pose for q; columns[6 j ...] of the Jacobian and the error there.
static void evaluate(const LaneChain& chain, const Wide* q, const Target& target, Wide* columns,
                     Error& out) {
  Wide R[9], p[3];
  for (int i = 0; i < 9; ++i) R[i] = all(i % 4 == 0 ? 1.0 : 0.0);
  for (int i = 0; i < 3; ++i) p[i] = all(0);
  for (int j = 0; j < chain.size; ++j) {
    const LaneJoint& joint = chain.joints[j];
    if (j == 0) {
      for (int i = 0; i < 9; ++i) R[i] = all(joint.R[i]);
      for (int i = 0; i < 3; ++i) p[i] = all(joint.p[i]);
    } else {
      for (int i = 0; i < 3; ++i) {
        const Wide x = R[3 * i], y = R[3 * i + 1], z = R[3 * i + 2];
        p[i] += x * joint.p[0] + y * joint.p[1] + z * joint.p[2];
        for (int c = 0; c < 3; ++c)
          R[3 * i + c] = x * joint.R[c] + y * joint.R[3 + c] + z * joint.R[6 + c];
      }
    }
    Wide* column = columns + 6 * j;
    if (joint.slides) {
      for (int i = 0; i < 3; ++i) p[i] += R[3 * i + 2] * q[j];
    } else {
      Wide s, c;
      sine_cosine(q[j], s, c);
      for (int i = 0; i < 9; i += 3) {
        const Wide x = R[i], y = R[i + 1];
        R[i] = x * c + y * s;
        R[i + 1] = y * c - x * s;
      }
      for (int i = 0; i < 3; ++i) column[i] = p[i];
    }
    for (int i = 0; i < 3; ++i) column[3 + i] = R[3 * i + 2];
  }
  for (int i = 0; i < 3; ++i) {
    const Wide x = R[3 * i], y = R[3 * i + 1], z = R[3 * i + 2];
    p[i] += x * chain.p[0] + y * chain.p[1] + z * chain.p[2];
    for (int c = 0; c < 3; ++c)
      R[3 * i + c] = x * chain.R[c] + y * chain.R[3 + c] + z * chain.R[6 + c];
  }
  const double f = chain.inverse_length;
  for (int j = 0; j < chain.size; ++j) {
    Wide* column = columns + 6 * j;
    const Wide x = column[3], y = column[4], z = column[5];
    if (chain.joints[j].slides) {
      const double u = chain.joints[j].unit * f;
      column[0] = x * u, column[1] = y * u, column[2] = z * u;
      column[3] = column[4] = column[5] = all(0);
    } else {
      const Wide a = (p[0] - column[0]) * f, b = (p[1] - column[1]) * f, c = (p[2] - column[2]) * f;
      column[0] = y * c - z * b, column[1] = z * a - x * c, column[2] = x * b - y * a;
    }
  }
  out.place = all(0);
  for (int i = 0; i < 3; ++i) {
    const Wide d = target.p[i] - p[i];
    out.place += d * d;
    out.e[i] = d * f;
  }
  // D = R_target R^T: twice its axial vector is 2 sin(angle) axis, its trace 1 + 2 cos(angle). The
  // chord 2 sin(angle / 2) needs no arctangent and increases up to half a turn.
  const auto element = [&](int r, int c) {
    return target.R[3 * r] * R[3 * c] + target.R[3 * r + 1] * R[3 * c + 1] +
           target.R[3 * r + 2] * R[3 * c + 2];
  };
  const Wide d00 = element(0, 0), d11 = element(1, 1), d22 = element(2, 2);
  const Wide d01 = element(0, 1), d10 = element(1, 0), d02 = element(0, 2), d20 = element(2, 0);
  const Wide d12 = element(1, 2), d21 = element(2, 1);
  const Wide trace = d00 + d11 + d22;
  const Wide h = most(1.0 + trace, all(1e-9));  // 4 cos^2(angle / 2)
  const Wide g = 1.0 / root(h);
  out.e[3] = (d21 - d12) * g, out.e[4] = (d02 - d20) * g, out.e[5] = (d10 - d01) * g;
  const Mask half = h < 1e-6;
  if (any(half)) {
    // Near half a turn the axis is taken from the columns of D + 1, which are parallel to it.
    const Wide a = d00 + 1.0, b = d11 + 1.0, c = d22 + 1.0;
    const Mask first = (a >= b) & (a >= c), second = b >= c;
    const Wide x = first ? a : second ? d01 + d10 : d02 + d20;
    const Wide y = first ? d01 + d10 : second ? b : d12 + d21;
    const Wide z = first ? d02 + d20 : second ? d12 + d21 : c;
    const Wide u = first ? x : all(0.5) * x, v = second & ~first ? y : all(0.5) * y;
    const Wide w = ~first & ~second ? z : all(0.5) * z;
    const Wide s = 2.0 / root(most(u * u + v * v + w * w, all(1e-300)));
    out.e[3] = half ? u * s : out.e[3];
    out.e[4] = half ? v * s : out.e[4];
    out.e[5] = half ? w * s : out.e[5];
  }
  out.turn = out.e[3] * out.e[3] + out.e[4] * out.e[4] + out.e[5] * out.e[5];
  out.cost = out.place * (f * f) + out.turn;
}

// step = J^T (J J^T + damping)^-1 e over the joints with free[j] = 1, by Cholesky's L D L^T.
static void damped_step(int n, const Wide* columns, const Wide* free, const Wide* e, Wide damping,
                        Wide* step) {
  Wide g[6][6];
  for (int r = 0; r < 6; ++r)
    for (int c = 0; c <= r; ++c) g[r][c] = r == c ? damping : all(0);
  for (int j = 0; j < n; ++j) {
    const Wide* a = columns + 6 * j;
    for (int r = 0; r < 6; ++r) {
      const Wide x = a[r] * free[j];
      for (int c = 0; c <= r; ++c) g[r][c] += x * a[c];
    }
  }
  Wide y[6], inverse[6];
  for (int c = 0; c < 6; ++c) {
    Wide d = g[c][c];
    Wide scaled[6];
    for (int k = 0; k < c; ++k) scaled[k] = g[c][k] * inverse[k];
    for (int k = 0; k < c; ++k) d -= g[c][k] * scaled[k];
    inverse[c] = 1.0 / most(d, all(1e-14));
    Wide x = e[c];
    for (int k = 0; k < c; ++k) x -= scaled[k] * y[k];
    y[c] = x;
    for (int r = c + 1; r < 6; ++r)
      for (int k = 0; k < c; ++k) g[r][c] -= g[r][k] * scaled[k];
  }
  for (int r = 5; r >= 0; --r) {
    Wide x = y[r];
    for (int k = r + 1; k < 6; ++k) x -= g[k][r] * y[k];
    y[r] = x * inverse[r];
  }
  for (int j = 0; j < n; ++j) {
    const Wide* a = columns + 6 * j;
    step[j] = (a[0] * y[0] + a[1] * y[1] + a[2] * y[2] + a[3] * y[3] + a[4] * y[4] + a[5] * y[5]) *
              free[j];
  }
}

// Joints at a limit that would leave it are held; the step is recomputed without them.
static void limited_step(const LaneChain& chain, const Wide* q, const Wide* columns, const Error& e,
                         Wide damping, Wide* free, Wide* step) {
  const int n = chain.size;
  for (int j = 0; j < n; ++j) free[j] = all(1);
  for (int round = 0; round < 4; ++round) {
    damped_step(n, columns, free, e.e, damping, step);
    Mask more = all(0) != all(0);
    for (int j = 0; j < n; ++j) {
      const LaneJoint& joint = chain.joints[j];
      const Mask leaves =
          ((q[j] <= joint.lower) & (step[j] < 0.0)) | ((q[j] >= joint.upper) & (step[j] > 0.0));
      free[j] = leaves ? all(0) : free[j];
      more |= leaves;
    }
    if (!any(more)) return;
  }
  for (int j = 0; j < n; ++j) step[j] *= free[j];
}

static void run(const LaneChain& chain, const LaneOptions& o, LaneWork& work, double* memory) {
  const int n = chain.size;
  Wide* const q = reinterpret_cast<Wide*>(memory);
  Wide* const trial = q + n;
  Wide* const step = trial + n;
  Wide* const free = step + n;
  Wide* const columns = free + n;
  Wide* const trial_columns = columns + 6 * n;
  double* const buffer = reinterpret_cast<double*>(trial_columns + 6 * n);
  Target target;
  Error at, next;
  Wide trust = all(1);
  bool active[kWidth];
  int iterations[kWidth], slow[kWidth];
  for (int k = 0; k < n; ++k) q[k] = all(0);
  for (int k = 0; k < 6 * n; ++k) columns[k] = all(0);
  for (int i = 0; i < 9; ++i) target.R[i] = all(i % 4 == 0 ? 1.0 : 0.0);
  for (int i = 0; i < 3; ++i) target.p[i] = all(0);
  for (int i = 0; i < 6; ++i) at.e[i] = all(0);
  at.place = at.turn = at.cost = all(1);
  // A new search begins with an infinite error: its first step has length zero, and is accepted.
  const double endless = 1e300;
  const auto load = [&](int l) {
    double R[9], p[3];
    active[l] = work.next(l, buffer, R, p);
    if (!active[l]) return;
    for (int j = 0; j < n; ++j) q[j][l] = buffer[j];
    for (int i = 0; i < 9; ++i) target.R[i][l] = R[i];
    for (int i = 0; i < 3; ++i) target.p[i][l] = p[i];
    at.cost[l] = at.place[l] = endless;
    trust[l] = 5;
    iterations[l] = -1, slow[l] = 0;
  };
  bool some = false;
  for (int l = 0; l < kWidth; ++l) load(l), some |= active[l];
  const double place = o.position * o.position, turn = o.rotation * o.rotation;
  for (int round = 0; some; ++round) {
    if ((round & 15) == 15 && work.stopped()) return;
    limited_step(chain, q, columns, at, o.damping * trust * at.cost + 1e-12, free, step);
    Wide greatest = all(1e-300);
    for (int j = 0; j < n; ++j) greatest = most(greatest, size_of(step[j]));
    const Wide shorten = least(all(1), o.max_step / greatest);
    Wide moved = all(0);
    for (int j = 0; j < n; ++j) {
      const LaneJoint& joint = chain.joints[j];
      const Wide x = q[j] + shorten * step[j] * joint.unit;
      trial[j] = most(all(joint.lower), least(all(joint.upper), x));
      moved = most(moved, size_of(trial[j] - q[j]) / joint.unit);
    }
    evaluate(chain, trial, target, trial_columns, next);
    const Mask better = next.cost < at.cost;
    const Mask was_reached = (at.place <= place) & (at.turn <= turn);
    const Wide gain = better ? 1.0 - next.cost / at.cost : all(0);
    for (int j = 0; j < n; ++j) q[j] = better ? trial[j] : q[j];
    for (int k = 0; k < 6 * n; ++k) columns[k] = better ? trial_columns[k] : columns[k];
    for (int k = 0; k < 6; ++k) at.e[k] = better ? next.e[k] : at.e[k];
    at.place = better ? next.place : at.place;
    at.turn = better ? next.turn : at.turn;
    at.cost = better ? next.cost : at.cost;
    const Mask reached = (at.place <= place) & (at.turn <= turn);
    trust =
        better ? most(all(1e-3), gain > 0.5 ? trust * 0.2 : trust) : most(trust, all(1e-2)) * 8.0;
    // Slow progress along a valley with a nonzero minimum: a closest pose, not a solution.
    const Mask stuck = ~reached & ((better & (gain < 1e-4) & (moved < 1e-3)) |
                                   (~better & ((moved < 1e-12) | (trust > 1e9))));
    const Mask creeps = gain < 0.3;
    // Within tolerance, one more Newton step reduces the error to rounding.
    const Mask good = reached & (was_reached | ~better | (at.cost < 1e-28));
    bool ended = false;
    for (int l = 0; l < kWidth; ++l) {
      if (!active[l]) continue;
      ++iterations[l];
      slow[l] = creeps[l] ? slow[l] + 1 : 0;
      const bool last = iterations[l] >= o.max_iterations;
      const bool bad = stuck[l] || (slow[l] >= o.patience && !reached[l]);
      if (!good[l] && !last && !bad) continue;
      for (int j = 0; j < n; ++j) buffer[j] = q[j][l];
      work.done(l,
                reached[l] ? LaneEnd::reached
                : bad      ? LaneEnd::stuck
                           : LaneEnd::out_of_iterations,
                buffer, at.cost[l], iterations[l]);
      active[l] = false;
      ended = true;
    }
    if (!ended) continue;
    some = false;
    for (int l = 0; l < kWidth; ++l) {
      if (!active[l] || work.obsolete(l)) load(l);
      some |= active[l];
    }
  }
}

extern const LaneEngine kEngine;
const LaneEngine kEngine{kWidth, run, RMP_LANE_NAME};

}  // namespace robomosp::ik_numeric::RMP_LANE_SPACE
