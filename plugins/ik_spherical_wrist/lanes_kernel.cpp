// SPDX-License-Identifier: Apache-2.0
// The closed forms of arms with parallel axes, one branch a lane; compiled once an instruction set
// (layer: plugin). Derivation: docs/user/inverse_kinematics.md.
#include "lanes_kernel.h"
#include "spatial/lanes.h"

namespace robomosp::ik_spherical_wrist::RMP_LANES {
namespace {

using spatial::RMP_LANES::any;
using spatial::RMP_LANES::Bits;
using spatial::RMP_LANES::kLanes;
using spatial::RMP_LANES::Lanes;
using spatial::RMP_LANES::load;
using spatial::RMP_LANES::splat;
using spatial::RMP_LANES::store;

constexpr double kPi = 0x1.921fb54442d18p1, kTurn = 2 * kPi;
/// Below this sine of joint 5 its neighbours turn about one line, and one of them is kept.
constexpr double kWristSingular = 1e-12;
/// Below this distance from axis 1, per arm length, joint 1 is kept.
constexpr double kShoulderSingular = 1e-13;
/// How far outside a limit rounding may put an angle [rad].
constexpr double kLimitRounding = 1e-10;

constexpr double kSign1[kBranches] = {1, 1, 1, 1, -1, -1, -1, -1};
constexpr double kSign3[kBranches] = {1, 1, -1, -1, 1, 1, -1, -1};
constexpr double kSign5[kBranches] = {1, -1, 1, -1, 1, -1, 1, -1};

RMP_INLINE Lanes pick(Bits which, Lanes yes, Lanes no) { return which ? yes : no; }
RMP_INLINE Lanes size_of(Lanes x) { return pick(x < 0, -x, x); }
RMP_INLINE Lanes least_of(Lanes a, Lanes b) { return pick(a < b, a, b); }
RMP_INLINE Lanes most_of(Lanes a, Lanes b) { return pick(a > b, a, b); }
RMP_INLINE Lanes root_of(Lanes x) {
#if defined(__AVX512F__) && RMP_LANE_COUNT == 8
  return _mm512_maskz_sqrt_pd(0xff, x);
#elif defined(__AVX__) && RMP_LANE_COUNT == 4
  return _mm256_sqrt_pd(x);
#else
  for (std::size_t i = 0; i < kLanes; ++i) x[i] = __builtin_sqrt(x[i]);
  return x;
#endif
}

// Nearest whole number, for |x| < 2^51: adding 1.5 * 2^52 leaves no room for a fraction.
RMP_INLINE Lanes whole(Lanes x) {
  constexpr double kBig = 0x1.8p52;
  return (x + kBig) - kBig;
}
RMP_INLINE Lanes ceiling(Lanes x) {
  const Lanes r = whole(x);
  return pick(r < x, r + 1, r);
}

// Angle of (x, y), to 2e-16 relative: atan(t) on t <= tan(pi / 8) as t + t^3 P(t^2), P interpolated
// at Chebyshev nodes; 0 at the origin.
RMP_INLINE Lanes angle(Lanes y, Lanes x) {
  const Lanes ax = size_of(x), ay = size_of(y);
  const Lanes big = most_of(ax, ay), small = least_of(ax, ay);
  const Bits far = small > 0x1.a827999fcef33p-2 * big;  // atan t = pi/4 + atan((t - 1) / (t + 1))
  const Lanes up = pick(far, small - big, small), down = pick(far, small + big, big);
  const Lanes t = up / pick(down > 0, down, splat<Lanes>(1)), z = t * t;
  Lanes p = splat<Lanes>(0.016144973584241742);
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
  Lanes a = pick(far, splat<Lanes>(kPi / 4), Lanes{}) + (t + t * z * p);
  a = pick(ax >= ay, a, kPi / 2 - a);
  a = pick(x < 0, kPi - a, a);
  return pick(y < 0, -a, a);
}

struct Settled {
  Lanes q, outside;
};
// The turn of q nearest to `near` that is within the limits; else the one nearest to `near`, and
// how far it is outside.
RMP_INLINE Settled settle(Lanes q, double near, double lower, double upper) {
  const double low = lower - kLimitRounding, high = upper + kLimitRounding;
  const Lanes x = q + kTurn * whole((near - q) * (1 / kTurn));
  const Lanes over = x - high, under = low - x;
  Lanes y = pick(over > 0, x - kTurn * ceiling(over * (1 / kTurn)), x);
  y = pick(under > 0, x + kTurn * ceiling(under * (1 / kTurn)), y);
  const Bits in = (y <= high) & (y >= low);
  const Lanes held = pick(y > upper, splat<Lanes>(upper), pick(y < lower, splat<Lanes>(lower), y));
  const Lanes out = most_of(over, under);
  // Of a joint with both limits the least excess counts, which may be at the other end.
  const Lanes other = pick(over > under, lower - (x - kTurn), (x + kTurn) - upper);
  const Lanes excess = pick((other > 0) & (other < out), other, out);
  return {pick(in, held, x), pick(in, Lanes{}, excess + kLimitRounding)};
}

template <bool three>
RMP_INLINE void solve(const ParallelArm& c, const Question& question, Candidates& out) {
  // What all branches share: the wrist point and the tip's orientation in the base frame.
  const double* R = question.R.data();
  const double* wrist = question.wrist.data();
  const double* near = question.near.data();
  const double* origin = c.origin.data();
  const double* tip_wrist = c.tip_wrist.data();
  const double* B = c.base_R.data();
  const double rx = wrist[0] - origin[0], ry = wrist[1] - origin[1], rz = wrist[2] - origin[2];
  const double wx = B[0] * rx + B[1] * ry + B[2] * rz, wy = B[3] * rx + B[4] * ry + B[5] * rz,
               wz = B[6] * rx + B[7] * ry + B[8] * rz;
  double part[9], t[9];
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 3; ++k)
      part[3 * i + k] = R[3 * i] * tip_wrist[k] + R[3 * i + 1] * tip_wrist[3 + k] +
                        R[3 * i + 2] * tip_wrist[6 + k];
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 3; ++k)
      t[3 * i + k] = B[3 * i] * part[k] + B[3 * i + 1] * part[3 + k] + B[3 * i + 2] * part[6 + k];

  // Joint 1 puts the wrist point at its offset along axis 2: a cos + b sin = k.
  const double a1 = c.sin_tilt * wy, b1 = -c.sin_tilt * wx, k1 = c.offset - c.cos_tilt * wz;
  const double n1 = a1 * a1 + b1 * b1, size1 = __builtin_sqrt(n1);
  const bool free1 = size1 < kShoulderSingular * c.reach;
  const double k1n = k1 * k1;
  const double root1 =
      n1 > k1n ? __builtin_sqrt((size1 - __builtin_fabs(k1)) * (size1 + __builtin_fabs(k1))) : 0.0;
  const double gap1 = __builtin_fabs(k1) > size1 ? __builtin_fabs(k1) - size1 : 0.0;
  const double k1c = k1 > size1 ? size1 : k1 < -size1 ? -size1 : k1;
  const double inv1 = free1 ? 0.0 : 1 / n1;
  const double near_c1 = free1 ? __builtin_cos(near[0]) : 0.0;
  const double near_s1 = free1 ? __builtin_sin(near[0]) : 0.0;
  const std::size_t kept = three ? 5 : 3;  // of the pair that turns about one line
  const double l22 = c.length2 * c.length2, l33 = c.length3 * c.length3;
  const double a3 = c.l2x * c.l3x + c.l2y * c.l3y;
  const double b3 = c.sign3 * (c.l2y * c.l3x - c.l2x * c.l3y);
  const double n3 = l22 * l33;  // = a3^2 + b3^2
  const double most = c.length2 + c.length3, least = __builtin_fabs(c.length2 - c.length3);
  const double* W = c.wrist_plane.data();
  const double* lower = question.lower.data();
  const double* upper = question.upper.data();
  const double l23 = c.length2 * c.length3, per_n3 = 1 / n3;
  const double margin1 = free1 ? 0.0 : root1 / size1;

  for (std::size_t i = 0; i < kBranches; i += kLanes) {
    const Lanes sign1 = load(kSign1 + i), sign3 = load(kSign3 + i), sign5 = load(kSign5 + i);
    const Lanes c1 = free1 ? splat<Lanes>(near_c1) : (a1 * k1c - sign1 * b1 * root1) * inv1;
    const Lanes s1 = free1 ? splat<Lanes>(near_s1) : (b1 * k1c + sign1 * a1 * root1) * inv1;
    // The wrist point in the plane of joints 2 and 3, from axis 2.
    const Lanes gx = c1 * wx + s1 * wy, gy = c1 * wy - s1 * wx;
    Lanes ux = gx - c.at_x;
    Lanes uy = c.cos_tilt * gy - c.sin_tilt * wz - c.at_y;
    // The tip's axes behind joint 1, in the plane's frame.
    const Lanes p00 = c1 * t[0] + s1 * t[3], p10 = c1 * t[3] - s1 * t[0];
    const Lanes p01 = c1 * t[1] + s1 * t[4], p11 = c1 * t[4] - s1 * t[1];
    const Lanes p02 = c1 * t[2] + s1 * t[5], p12 = c1 * t[5] - s1 * t[2];
    const Lanes e10 = c.cos_tilt * p10 - c.sin_tilt * t[6];
    const Lanes e20 = c.sin_tilt * p10 + c.cos_tilt * t[6];
    const Lanes e11 = c.cos_tilt * p11 - c.sin_tilt * t[7];
    const Lanes e21 = c.sin_tilt * p11 + c.cos_tilt * t[7];
    const Lanes e12 = c.cos_tilt * p12 - c.sin_tilt * t[8];
    const Lanes e22 = c.sin_tilt * p12 + c.cos_tilt * t[8];
    Lanes f00 = p00, f01 = p01, f02 = p02, f10 = e10, f11 = e11, f12 = e12;
    Lanes q2{}, q3{}, cos23{}, sin23{}, gap = splat<Lanes>(gap1), margin3{};

    // The two links from axis 2 to (ux, uy); gives q2 and q3.
    const auto two_links = [&](Lanes x, Lanes y) __attribute__((always_inline)) {
      const Lanes r2 = x * x + y * y, r = root_of(r2);
      const Lanes k3 = 0.5 * (r2 - l22 - l33);
      // a3^2 + b3^2 - k3^2 as a product of lengths: exact where the arm is stretched.
      const Lanes product = (most - r) * (most + r) * (r - least) * (r + least);
      const Lanes root3 = 0.5 * root_of(most_of(product, Lanes{}));
      const Lanes gap3 = most_of(most_of(r - most, least - r), Lanes{});
      const Lanes k3c = pick(r > most, splat<Lanes>(l23), pick(r < least, splat<Lanes>(-l23), k3));
      const Lanes c3 = (a3 * k3c - sign3 * b3 * root3) * per_n3;
      const Lanes s3 = (b3 * k3c + sign3 * a3 * root3) * per_n3;
      q3 = angle(s3, c3);
      const Lanes t3 = c.sign3 * s3;
      const Lanes vx = c.l2x + c3 * c.l3x - t3 * c.l3y, vy = c.l2y + t3 * c.l3x + c3 * c.l3y;
      const Lanes cc = vx * x + vy * y, ss = vx * y - vy * x;
      const Lanes size = root_of(cc * cc + ss * ss);
      const Lanes per_size = 1 / pick(size > 0, size, splat<Lanes>(1));
      const Lanes c2 = pick(size > 0, cc * per_size, splat<Lanes>(1)), s2 = ss * per_size;
      q2 = angle(s2, c2);
      cos23 = c2 * c3 - s2 * t3;
      sin23 = s2 * c3 + c2 * t3;
      gap = root_of(gap * gap + gap3 * gap3);
      margin3 = root3 * (per_n3 * l23);
    };

    if (!three) {
      two_links(ux, uy);
      f00 = cos23 * p00 + sin23 * e10, f10 = cos23 * e10 - sin23 * p00;
      f01 = cos23 * p01 + sin23 * e11, f11 = cos23 * e11 - sin23 * p01;
      f02 = cos23 * p02 + sin23 * e12, f12 = cos23 * e12 - sin23 * p02;
    }
    // Rz(q4) Ry(q5 + bend) Rz(q6) = m; with three parallel axes q4 is the sum of their turns.
    const Lanes m00 = W[0] * f00 + W[1] * f10 + W[2] * e20;
    const Lanes m10 = W[3] * f00 + W[4] * f10 + W[5] * e20;
    const Lanes m01 = W[0] * f01 + W[1] * f11 + W[2] * e21;
    const Lanes m11 = W[3] * f01 + W[4] * f11 + W[5] * e21;
    const Lanes m02 = W[0] * f02 + W[1] * f12 + W[2] * e22;
    const Lanes m12 = W[3] * f02 + W[4] * f12 + W[5] * e22;
    const Lanes m22 = W[6] * f02 + W[7] * f12 + W[8] * e22;
    const Lanes across = root_of(m02 * m02 + m12 * m12);
    const Bits free5 = across < kWristSingular;
    const Lanes q5 = angle(sign5 * across, m22) - c.bend;
    const Lanes sharp = sign5 / pick(free5, splat<Lanes>(1), across);
    // Where it is singular, m11 and -m01 are cosine and sine of q4 + q6, or of q4 - q6 when axis 6
    // is turned over; one of them is kept.
    Lanes c4 = sharp * m02, s4 = sharp * m12;
    if (__builtin_expect(any(free5), 0)) {
      const double near_c = __builtin_cos(near[kept]), near_s = __builtin_sin(near[kept]);
      const Lanes near_t = pick(m22 > 0, splat<Lanes>(near_s), splat<Lanes>(-near_s));
      const Lanes free_c = three ? m11 * near_c - m01 * near_t : splat<Lanes>(near_c);
      const Lanes free_s = three ? -m01 * near_c - m11 * near_t : splat<Lanes>(near_s);
      c4 = pick(free5, free_c, c4);
      s4 = pick(free5, free_s, s4);
    }
    const Lanes q6 = angle(c4 * m10 - s4 * m00, c4 * m11 - s4 * m01);
    Lanes q4 = angle(s4, c4);
    if (three) {
      // q4 is the last link's turn in the plane.
      ux -= c4 * c.l4x - s4 * c.l4y;
      uy -= s4 * c.l4x + c4 * c.l4y;
      two_links(ux, uy);
      q4 = c.sign4 * (q4 - (q2 + c.sign3 * q3));
    }
    const Lanes q1 = angle(s1, c1);
    const Settled a = settle(q1, near[0], lower[0], upper[0]);
    const Settled b = settle(q2, near[1], lower[1], upper[1]);
    const Settled d = settle(q3, near[2], lower[2], upper[2]);
    const Settled e = settle(q4, near[3], lower[3], upper[3]);
    const Settled f = settle(q5, near[4], lower[4], upper[4]);
    const Settled g = settle(q6, near[5], lower[5], upper[5]);
    store(out.q[0].data() + i, a.q);
    store(out.q[1].data() + i, b.q);
    store(out.q[2].data() + i, d.q);
    store(out.q[3].data() + i, e.q);
    store(out.q[4].data() + i, f.q);
    store(out.q[5].data() + i, g.q);
    const Lanes worst =
        most_of(most_of(most_of(a.outside, b.outside), most_of(d.outside, e.outside)),
                most_of(f.outside, g.outside));
    store(out.outside.data() + i, worst);
    const Lanes d1 = a.q - near[0], d2 = b.q - near[1], d3 = d.q - near[2], d4 = e.q - near[3],
                d5 = f.q - near[4], d6 = g.q - near[5];
    store(out.cost.data() + i, (d1 * d1 + d2 * d2) + (d3 * d3 + d4 * d4) + (d5 * d5 + d6 * d6));
    store(out.gap.data() + i, pick(gap <= question.touch, Lanes{}, gap));
    store(out.margin.data() + i, least_of(splat<Lanes>(margin1), least_of(margin3, across)));
  }
}

}  // namespace

void solve_lanes(const ParallelArm& c, const Question& question, Candidates& out) {
  if (c.three) solve<true>(c, question, out);
  else solve<false>(c, question, out);
}

void sines_cosines(const double* q, double* sine, double* cosine) {
  spatial::RMP_LANES::sin_cos<spatial::RMP_LANES::RightAngles::as_given>(q, 8, sine, cosine);
}

}  // namespace robomosp::ik_spherical_wrist::RMP_LANES
