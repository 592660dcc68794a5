// SPDX-License-Identifier: Apache-2.0
// One loop over the branches without calls or jumps, so that the compiler makes vector code of it.
// Derivation: docs/user/inverse_kinematics.md.
#include "lanes.h"

#include <cmath>
#include <numbers>

namespace robomosp::ik_spherical_wrist {
namespace {

#define RMP_INLINE [[gnu::always_inline]] inline

constexpr double kPi = std::numbers::pi, kTurn = 2 * kPi;
/// Below this sine of joint 5 its neighbours turn about one line, and one of them is kept.
constexpr double kWristSingular = 1e-12;
/// Below this distance from axis 1, per arm length, joint 1 is kept.
constexpr double kShoulderSingular = 1e-13;
/// How far outside a limit rounding may put an angle [rad].
constexpr double kLimitRounding = 1e-10;

constexpr std::array<double, kBranches> kSign1{1, 1, 1, 1, -1, -1, -1, -1};
constexpr std::array<double, kBranches> kSign3{1, 1, -1, -1, 1, 1, -1, -1};
constexpr std::array<double, kBranches> kSign5{1, -1, 1, -1, 1, -1, 1, -1};

// Nearest whole number, for |x| < 2^51: adding 1.5 * 2^52 leaves no room for a fraction.
RMP_INLINE double whole(double x) {
  constexpr double kBig = 6755399441055744.0;
  return (x + kBig) - kBig;
}
RMP_INLINE double ceiling(double x) {
  const double r = whole(x);
  return r < x ? r + 1 : r;
}

// Angle of (x, y), to 2e-16 relative: atan(t) on t <= tan(pi / 8) as t + t^3 P(t^2), P interpolated
// at Chebyshev nodes; 0 at the origin.
RMP_INLINE double angle(double y, double x) {
  const double ax = std::fabs(x), ay = std::fabs(y);
  const double big = ax > ay ? ax : ay, small = ax > ay ? ay : ax;
  const bool far = small > 0.41421356237309503 * big;  // atan(t) = pi/4 + atan((t - 1) / (t + 1))
  const double up = far ? small - big : small, down = far ? small + big : big;
  const double t = down > 0 ? up / down : 0.0, z = t * t;
  double p = 0.016144973584241742;
  p = p * z - 0.03442637336309011;
  p = p * z + 0.045451625004966183;
  p = p * z - 0.052288153563136014;
  p = p * z + 0.058786656658639996;
  p = p * z - 0.066663971190719304;
  p = p * z + 0.076922944359089529;
  p = p * z - 0.090909086651550702;
  p = p * z + 0.11111111102643356;
  p = p * z - 0.14285714285619402;
  p = p * z + 0.19999999999999518;
  p = p * z - 0.33333333333333331;
  double a = (far ? kPi / 4 : 0.0) + (t + t * z * p);
  a = ax > ay ? a : kPi / 2 - a;
  a = x < 0 ? kPi - a : a;
  return y < 0 ? -a : a;
}

struct Settled {
  double q, outside;
};
// The turn of q nearest to `near` that is within the limits; else the one nearest to `near`, and
// how far it is outside.
RMP_INLINE Settled settle(double q, double near, double lower, double upper) {
  const double x = q + kTurn * whole((near - q) * (1 / kTurn));
  const double over = x - (upper + kLimitRounding), under = (lower - kLimitRounding) - x;
  double y = over > 0 ? x - kTurn * ceiling(over * (1 / kTurn)) : x;
  y = under > 0 ? x + kTurn * ceiling(under * (1 / kTurn)) : y;
  const bool in = y <= upper + kLimitRounding && y >= lower - kLimitRounding;
  const double held = y > upper ? upper : y < lower ? lower : y;
  const double out = over > under ? over : under;
  // Of a joint with both limits the least excess counts, which may be at the other end.
  const double other = over > under ? lower - (x - kTurn) : (x + kTurn) - upper;
  const double excess = other > 0 && other < out ? other : out;
  return {in ? held : x, in ? 0.0 : excess + kLimitRounding};
}

template <bool three>
RMP_INLINE void solve_lanes(const ParallelArm& c, const Question& question, Candidates& out) {
  // What all branches share: the wrist point and the tip's orientation in the base frame.
  const auto& B = c.base_R;
  const double rx = question.wrist[0] - c.origin[0], ry = question.wrist[1] - c.origin[1],
               rz = question.wrist[2] - c.origin[2];
  const double wx = B[0] * rx + B[1] * ry + B[2] * rz, wy = B[3] * rx + B[4] * ry + B[5] * rz,
               wz = B[6] * rx + B[7] * ry + B[8] * rz;
  std::array<double, 9> part, t;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 3; ++k)
      part[3 * i + k] = question.R[3 * i] * c.tip_wrist[k] +
                        question.R[3 * i + 1] * c.tip_wrist[3 + k] +
                        question.R[3 * i + 2] * c.tip_wrist[6 + k];
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 3; ++k)
      t[3 * i + k] = B[3 * i] * part[k] + B[3 * i + 1] * part[3 + k] + B[3 * i + 2] * part[6 + k];

  // Joint 1 puts the wrist point at its offset along axis 2: a cos + b sin = k.
  const double a1 = c.sin_tilt * wy, b1 = -c.sin_tilt * wx, k1 = c.offset - c.cos_tilt * wz;
  const double n1 = a1 * a1 + b1 * b1, size1 = std::sqrt(n1);
  const bool free1 = size1 < kShoulderSingular * c.reach;
  const double k1n = k1 * k1;
  const double root1 =
      n1 > k1n ? std::sqrt((size1 - std::fabs(k1)) * (size1 + std::fabs(k1))) : 0.0;
  const double gap1 = std::fabs(k1) > size1 ? std::fabs(k1) - size1 : 0.0;
  const double k1c = k1 > size1 ? size1 : k1 < -size1 ? -size1 : k1;
  const double inv1 = free1 ? 0.0 : 1 / n1;
  const double near_c1 = std::cos(question.near[0]), near_s1 = std::sin(question.near[0]);
  const std::size_t kept = three ? 5 : 3;  // of the pair that turns about one line
  const double near_c = std::cos(question.near[kept]), near_s = std::sin(question.near[kept]);
  const double l22 = c.length2 * c.length2, l33 = c.length3 * c.length3;
  const double a3 = c.l2x * c.l3x + c.l2y * c.l3y;
  const double b3 = c.sign3 * (c.l2y * c.l3x - c.l2x * c.l3y);
  const double n3 = l22 * l33;  // = a3^2 + b3^2
  const double most = c.length2 + c.length3, least = std::fabs(c.length2 - c.length3);
  const auto& W = c.wrist_plane;
  const auto& near = question.near;
  const auto& lower = question.lower;
  const auto& upper = question.upper;

#pragma GCC ivdep
  for (std::size_t i = 0; i < kBranches; ++i) {
    const double sign1 = kSign1[i], sign3 = kSign3[i], sign5 = kSign5[i];
    const double c1 = free1 ? near_c1 : (a1 * k1c - sign1 * b1 * root1) * inv1;
    const double s1 = free1 ? near_s1 : (b1 * k1c + sign1 * a1 * root1) * inv1;
    // The wrist point in the plane of joints 2 and 3, from axis 2.
    const double gx = c1 * wx + s1 * wy, gy = c1 * wy - s1 * wx;
    double ux = gx - c.at_x;
    double uy = c.cos_tilt * gy - c.sin_tilt * wz - c.at_y;
    // The tip's axes behind joint 1, in the plane's frame.
    const double p00 = c1 * t[0] + s1 * t[3], p10 = c1 * t[3] - s1 * t[0];
    const double p01 = c1 * t[1] + s1 * t[4], p11 = c1 * t[4] - s1 * t[1];
    const double p02 = c1 * t[2] + s1 * t[5], p12 = c1 * t[5] - s1 * t[2];
    const double e10 = c.cos_tilt * p10 - c.sin_tilt * t[6];
    const double e20 = c.sin_tilt * p10 + c.cos_tilt * t[6];
    const double e11 = c.cos_tilt * p11 - c.sin_tilt * t[7];
    const double e21 = c.sin_tilt * p11 + c.cos_tilt * t[7];
    const double e12 = c.cos_tilt * p12 - c.sin_tilt * t[8];
    const double e22 = c.sin_tilt * p12 + c.cos_tilt * t[8];
    double f00 = p00, f01 = p01, f02 = p02, f10 = e10, f11 = e11, f12 = e12;
    double q2 = 0, q3 = 0, cos23 = 1, sin23 = 0, gap = gap1, margin3 = 1;

    // The two links from axis 2 to (ux, uy); gives q2 and q3.
    const auto two_links = [&](double x, double y) __attribute__((always_inline)) {
      const double r2 = x * x + y * y, r = std::sqrt(r2);
      const double k3 = 0.5 * (r2 - l22 - l33);
      // a3^2 + b3^2 - k3^2 as a product of lengths: exact where the arm is stretched.
      const double product = (most - r) * (most + r) * (r - least) * (r + least);
      const double root3 = product > 0 ? 0.5 * std::sqrt(product) : 0.0;
      const double gap3 = r > most ? r - most : r < least ? least - r : 0.0;
      const double k3c = r > most ? c.length2 * c.length3 : r < least ? -c.length2 * c.length3 : k3;
      const double c3 = (a3 * k3c - sign3 * b3 * root3) / n3;
      const double s3 = (b3 * k3c + sign3 * a3 * root3) / n3;
      q3 = angle(s3, c3);
      const double t3 = c.sign3 * s3;
      const double vx = c.l2x + c3 * c.l3x - t3 * c.l3y, vy = c.l2y + t3 * c.l3x + c3 * c.l3y;
      const double cc = vx * x + vy * y, ss = vx * y - vy * x;
      const double size = std::sqrt(cc * cc + ss * ss);
      const double c2 = size > 0 ? cc / size : 1.0, s2 = size > 0 ? ss / size : 0.0;
      q2 = angle(s2, c2);
      cos23 = c2 * c3 - s2 * t3;
      sin23 = s2 * c3 + c2 * t3;
      gap = std::sqrt(gap * gap + gap3 * gap3);
      margin3 = root3 / n3 * (c.length2 * c.length3);
    };

    if (!three) {
      two_links(ux, uy);
      f00 = cos23 * p00 + sin23 * e10, f10 = cos23 * e10 - sin23 * p00;
      f01 = cos23 * p01 + sin23 * e11, f11 = cos23 * e11 - sin23 * p01;
      f02 = cos23 * p02 + sin23 * e12, f12 = cos23 * e12 - sin23 * p02;
    }
    // Rz(q4) Ry(q5 + bend) Rz(q6) = m; with three parallel axes q4 is the sum of their turns.
    const double m00 = W[0] * f00 + W[1] * f10 + W[2] * e20;
    const double m10 = W[3] * f00 + W[4] * f10 + W[5] * e20;
    const double m01 = W[0] * f01 + W[1] * f11 + W[2] * e21;
    const double m11 = W[3] * f01 + W[4] * f11 + W[5] * e21;
    const double m02 = W[0] * f02 + W[1] * f12 + W[2] * e22;
    const double m12 = W[3] * f02 + W[4] * f12 + W[5] * e22;
    const double m22 = W[6] * f02 + W[7] * f12 + W[8] * e22;
    const double across = std::sqrt(m02 * m02 + m12 * m12);
    const bool free5 = across < kWristSingular;
    const double q5 = angle(sign5 * across, m22) - c.bend;
    const double sharp = free5 ? 0.0 : sign5 / across;
    // Where it is singular, m11 and -m01 are cosine and sine of q4 + q6, or of q4 - q6 when axis 6
    // is turned over; one of them is kept.
    const double near_t = m22 > 0 ? near_s : -near_s;
    const double free_c = three ? m11 * near_c + -m01 * near_t : near_c;
    const double free_s = three ? -m01 * near_c - m11 * near_t : near_s;
    const double c4 = free5 ? free_c : sharp * m02, s4 = free5 ? free_s : sharp * m12;
    const double q6 = angle(c4 * m10 - s4 * m00, c4 * m11 - s4 * m01);
    double q4 = angle(s4, c4);
    if (three) {
      // q4 is the last link's turn in the plane.
      ux -= c4 * c.l4x - s4 * c.l4y;
      uy -= s4 * c.l4x + c4 * c.l4y;
      two_links(ux, uy);
      q4 = c.sign4 * (q4 - (q2 + c.sign3 * q3));
    }
    const double q1 = angle(s1, c1);
    const Settled a = settle(q1, near[0], lower[0], upper[0]);
    const Settled b = settle(q2, near[1], lower[1], upper[1]);
    const Settled d = settle(q3, near[2], lower[2], upper[2]);
    const Settled e = settle(q4, near[3], lower[3], upper[3]);
    const Settled f = settle(q5, near[4], lower[4], upper[4]);
    const Settled g = settle(q6, near[5], lower[5], upper[5]);
    out.q[0][i] = a.q;
    out.q[1][i] = b.q;
    out.q[2][i] = d.q;
    out.q[3][i] = e.q;
    out.q[4][i] = f.q;
    out.q[5][i] = g.q;
    double worst = a.outside > b.outside ? a.outside : b.outside;
    worst = d.outside > worst ? d.outside : worst;
    worst = e.outside > worst ? e.outside : worst;
    worst = f.outside > worst ? f.outside : worst;
    worst = g.outside > worst ? g.outside : worst;
    out.outside[i] = worst;
    out.cost[i] = (a.q - near[0]) * (a.q - near[0]) + (b.q - near[1]) * (b.q - near[1]) +
                  (d.q - near[2]) * (d.q - near[2]) + (e.q - near[3]) * (e.q - near[3]) +
                  (f.q - near[4]) * (f.q - near[4]) + (g.q - near[5]) * (g.q - near[5]);
    out.gap[i] = gap <= question.touch ? 0.0 : gap;
    const double margin1 = free1 ? 0.0 : root1 / size1;
    const double margin = margin1 < margin3 ? margin1 : margin3;
    out.margin[i] = margin < across ? margin : across;
  }
}

void solve_baseline(const ParallelArm& c, const Question& question, Candidates& out) {
  if (c.three) solve_lanes<true>(c, question, out);
  else solve_lanes<false>(c, question, out);
}
#if defined(__x86_64__)
__attribute__((target("avx2,fma"))) void solve_avx2(const ParallelArm& c, const Question& question,
                                                    Candidates& out) {
  if (c.three) solve_lanes<true>(c, question, out);
  else solve_lanes<false>(c, question, out);
}
__attribute__((target("avx512f,avx512dq,avx512vl,fma,prefer-vector-width=512"))) void solve_avx512(
    const ParallelArm& c, const Question& question, Candidates& out) {
  if (c.three) solve_lanes<true>(c, question, out);
  else solve_lanes<false>(c, question, out);
}
#endif

}  // namespace

LaneSolver lane_solver() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
      __builtin_cpu_supports("avx512vl"))
    return solve_avx512;
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return solve_avx2;
#endif
  return solve_baseline;
}

}  // namespace robomosp::ik_spherical_wrist
