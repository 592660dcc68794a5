// SPDX-License-Identifier: Apache-2.0
// The closed forms of arms with parallel axes, one branch a lane; compiled once an instruction set
// (layer: plugin). Derivation: docs/user/inverse_kinematics.md.
#include "lanes_kernel.h"
#include "spatial/lane_angles.h"

namespace robomosp::ik_spherical_wrist::RMP_LANES {
namespace {

using namespace spatial::RMP_LANES;

constexpr double kTurn = 2 * kPi;
/// Below this sine of joint 5 its neighbours turn about one line, and one of them is kept.
constexpr double kWristSingular = 1e-12;
/// Below this distance from axis 1, per arm length, joint 1 is kept.
constexpr double kShoulderSingular = 1e-13;
/// How far outside a limit rounding may put an angle [rad].
constexpr double kLimitRounding = 1e-10;

constexpr double kSign1[kBranches] = {1, 1, 1, 1, -1, -1, -1, -1};
constexpr double kSign3[kBranches] = {1, 1, -1, -1, 1, 1, -1, -1};
constexpr double kSign5[kBranches] = {1, -1, 1, -1, 1, -1, 1, -1};

// Nearest whole number, for |x| < 2^51: adding 1.5 * 2^52 leaves no room for a fraction.
template <class T>
RMP_INLINE T whole(const T& x) {
  constexpr double kBig = 0x1.8p52;
  return (x + kBig) - kBig;
}
template <class T>
RMP_INLINE T ceiling(const T& x) {
  const T r = whole(x);
  return pick(r < x, r + 1.0, r);
}

template <class T>
struct Settled {
  T q, outside;
};
// The turn of q nearest to `near` that is within the limits; else the one nearest to `near`, and
// how far it is outside.
template <class T>
RMP_INLINE Settled<T> settle(const T& q, const T& near, double lower, double upper) {
  const double low = lower - kLimitRounding, high = upper + kLimitRounding;
  const T x = q + kTurn * whole((near - q) * (1 / kTurn));
  const T over = x - high, under = low - x;
  T y = pick(over > 0, x - kTurn * ceiling(over * (1 / kTurn)), x);
  y = pick(under > 0, x + kTurn * ceiling(under * (1 / kTurn)), y);
  const auto in = (y <= high) & (y >= low);
  const T held = pick(y > upper, splat<T>(upper), pick(y < lower, splat<T>(lower), y));
  const T out = most_of(over, under);
  // Of a joint with both limits the least excess counts, which may be at the other end.
  const T other = pick(over > under, lower - (x - kTurn), (x + kTurn) - upper);
  const T excess = pick((other > 0) & (other < out), other, out);
  return {pick(in, held, x), pick(in, T{}, excess + kLimitRounding)};
}

// What the branches of a target share, a target a lane: the wrist point and the tip's orientation
// in the frame `base`, and joint 1 up to the sign of its branch.
struct Shared {
  double wx[kTogether], wy[kTogether], wz[kTogether];
  double t[9][kTogether];
  double c1[kTogether], c1_turned[kTogether], s1[kTogether], s1_turned[kTogether];  // by sign1
  double gap[kTogether], margin[kTogether], near[6][kTogether];
};

void share(const ParallelArm& c, const LaneQuestions& question, std::size_t i, Shared& out) {
  Lanes pose[12], near[6];
  load_samples(question.targets + 12 * i, 12, question.count - i, pose);
  load_samples(question.near + 6 * i, 6, question.count - i, near);
  for (std::size_t k = 0; k < 6; ++k) store(out.near[k] + i, near[k]);
  const Lanes* R = pose;
  const double* B = c.base_R.data();
  const double* tip_wrist = c.tip_wrist.data();
  const Vec<Lanes> r = multiply(R, plain(question.tip_wrist)) +
                       (Vec<Lanes>{pose[9], pose[10], pose[11]} - plain(c.origin.data()));
  const Vec<Lanes> w = multiply(B, r);
  store(out.wx + i, w.x), store(out.wy + i, w.y), store(out.wz + i, w.z);
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec<Lanes> column =
        multiply(B, multiply(R, Vec<double>{tip_wrist[k], tip_wrist[3 + k], tip_wrist[6 + k]}));
    store(out.t[k] + i, column.x), store(out.t[3 + k] + i, column.y);
    store(out.t[6 + k] + i, column.z);
  }
  // Joint 1 puts the wrist point at its offset along axis 2: a cos + b sin = k.
  const Lanes a1 = c.sin_tilt * w.y, b1 = -c.sin_tilt * w.x, k1 = c.offset - c.cos_tilt * w.z;
  const Lanes n1 = a1 * a1 + b1 * b1, size1 = root_of(n1), wide1 = size_of(k1), none{};
  const Bits free1 = size1 < kShoulderSingular * c.reach;
  const Lanes root1 = root_of(most_of((size1 - wide1) * (size1 + wide1), none));
  const Lanes k1c = pick(k1 > size1, size1, pick(k1 < -size1, -size1, k1));
  const Lanes one = splat<Lanes>(1), per_n1 = 1 / pick(free1, one, n1);
  Lanes near_s{}, near_c{};
  if (__builtin_expect(any(free1), 0)) {
    double angle[kLanes], s[kLanes], cosine[kLanes];
    store(angle, near[0]);
    sin_cos<RightAngles::as_given>(angle, kLanes, s, cosine);
    near_s = load(s), near_c = load(cosine);
  }
  store(out.c1 + i, pick(free1, near_c, a1 * k1c * per_n1));
  store(out.s1 + i, pick(free1, near_s, b1 * k1c * per_n1));
  store(out.c1_turned + i, pick(free1, none, -(b1 * root1 * per_n1)));
  store(out.s1_turned + i, pick(free1, none, a1 * root1 * per_n1));
  store(out.gap + i, most_of(wide1 - size1, none));
  store(out.margin + i, pick(free1, none, root1 / pick(free1, one, size1)));
}

// Vectors that are computed side by side: some branches of a target each.
struct Place {
  std::size_t target, branch;
};
template <class T>
RMP_INLINE T of_targets(const Place* at, const double* x) {
  if constexpr (sizeof(T) == sizeof(Lanes)) return splat<Lanes>(x[at[0].target]);
  else return {splat<Lanes>(x[at[0].target]), splat<Lanes>(x[at[1].target])};
}
template <class T>
RMP_INLINE T of_branches(const Place* at, const double* x) {
  if constexpr (sizeof(T) == sizeof(Lanes)) return load(x + at[0].branch);
  else return {load(x + at[0].branch), load(x + at[1].branch)};
}
// Writes one member of the candidates.
template <class Member>
RMP_INLINE void put(const Place* at, Candidates* out, const Lanes& x, const Member& member) {
  store(member(out[at[0].target]) + at[0].branch, x);
}
template <class Member>
RMP_INLINE void put(const Place* at, Candidates* out, const Wide& x, const Member& member) {
  put(at, out, x.a, member);
  put(at + 1, out, x.b, member);
}

template <bool three, class T>
void solve(const ParallelArm& c, const LaneQuestions& question, const Shared& shared,
           const Place* at, Candidates* out) {
  const std::size_t kept = three ? 5 : 3;  // of the pair that turns about one line
  const double l22 = c.length2 * c.length2, l33 = c.length3 * c.length3;
  const double a3 = c.l2x * c.l3x + c.l2y * c.l3y;
  const double b3 = c.sign3 * (c.l2y * c.l3x - c.l2x * c.l3y);
  const double n3 = l22 * l33;  // = a3^2 + b3^2
  const double most = c.length2 + c.length3, least = __builtin_fabs(c.length2 - c.length3);
  const double* W = c.wrist_plane.data();
  const double *lower = question.lower, *upper = question.upper;
  const double l23 = c.length2 * c.length3, per_n3 = 1 / n3;
  const auto of = [&](const double* x) __attribute__((always_inline)) {
    return of_targets<T>(at, x);
  };
  const T sign1 = of_branches<T>(at, kSign1), sign3 = of_branches<T>(at, kSign3),
          sign5 = of_branches<T>(at, kSign5);
  const T c1 = of(shared.c1) + sign1 * of(shared.c1_turned);
  const T s1 = of(shared.s1) + sign1 * of(shared.s1_turned);
  const T wx = of(shared.wx), wy = of(shared.wy), wz = of(shared.wz);
  const T t0 = of(shared.t[0]), t1 = of(shared.t[1]), t2 = of(shared.t[2]), t3 = of(shared.t[3]),
          t4 = of(shared.t[4]), t5 = of(shared.t[5]), t6 = of(shared.t[6]), t7 = of(shared.t[7]),
          t8 = of(shared.t[8]);
  // The wrist point in the plane of joints 2 and 3, from axis 2.
  const T gx = c1 * wx + s1 * wy, gy = c1 * wy - s1 * wx;
  T ux = gx - c.at_x;
  T uy = c.cos_tilt * gy - c.sin_tilt * wz - c.at_y;
  // The tip's axes behind joint 1, in the plane's frame.
  const T p00 = c1 * t0 + s1 * t3, p10 = c1 * t3 - s1 * t0;
  const T p01 = c1 * t1 + s1 * t4, p11 = c1 * t4 - s1 * t1;
  const T p02 = c1 * t2 + s1 * t5, p12 = c1 * t5 - s1 * t2;
  const T e10 = c.cos_tilt * p10 - c.sin_tilt * t6;
  const T e20 = c.sin_tilt * p10 + c.cos_tilt * t6;
  const T e11 = c.cos_tilt * p11 - c.sin_tilt * t7;
  const T e21 = c.sin_tilt * p11 + c.cos_tilt * t7;
  const T e12 = c.cos_tilt * p12 - c.sin_tilt * t8;
  const T e22 = c.sin_tilt * p12 + c.cos_tilt * t8;
  T f00 = p00, f01 = p01, f02 = p02, f10 = e10, f11 = e11, f12 = e12;
  T q2{}, q3{}, cos23{}, sin23{}, gap = of(shared.gap), margin3{};

  // The two links from axis 2 to (ux, uy); gives q2 and q3.
  const auto two_links = [&](T x, T y) __attribute__((always_inline)) {
    const T r2 = x * x + y * y, r = root_of(r2);
    const T k3 = 0.5 * (r2 - l22 - l33);
    // a3^2 + b3^2 - k3^2 as a product of lengths: exact where the arm is stretched.
    const T product = (most - r) * (most + r) * (r - least) * (r + least);
    const T root3 = 0.5 * root_of(most_of(product, T{}));
    const T gap3 = most_of(most_of(r - most, least - r), T{});
    const T k3c = pick(r > most, splat<T>(l23), pick(r < least, splat<T>(-l23), k3));
    const T c3 = (a3 * k3c - sign3 * b3 * root3) * per_n3;
    const T s3 = (b3 * k3c + sign3 * a3 * root3) * per_n3;
    q3 = angle(s3, c3);
    const T turned3 = c.sign3 * s3;
    const T vx = c.l2x + c3 * c.l3x - turned3 * c.l3y, vy = c.l2y + turned3 * c.l3x + c3 * c.l3y;
    const T cc = vx * x + vy * y, ss = vx * y - vy * x;
    const T size = root_of(cc * cc + ss * ss);
    const T per_size = 1 / pick(size > 0, size, splat<T>(1));
    const T c2 = pick(size > 0, cc * per_size, splat<T>(1)), s2 = ss * per_size;
    q2 = angle(s2, c2);
    cos23 = c2 * c3 - s2 * turned3;
    sin23 = s2 * c3 + c2 * turned3;
    if (__builtin_expect(any((gap > 0) & (gap3 > 0)), 0)) gap = root_of(gap * gap + gap3 * gap3);
    else gap = gap + gap3;  // one of them is 0
    margin3 = root3 * (per_n3 * l23);
  };

  if (!three) {
    two_links(ux, uy);
    f00 = cos23 * p00 + sin23 * e10, f10 = cos23 * e10 - sin23 * p00;
    f01 = cos23 * p01 + sin23 * e11, f11 = cos23 * e11 - sin23 * p01;
    f02 = cos23 * p02 + sin23 * e12, f12 = cos23 * e12 - sin23 * p02;
  }
  // Rz(q4) Ry(q5 + bend) Rz(q6) = m; with three parallel axes q4 is the sum of their turns.
  const T m00 = W[0] * f00 + W[1] * f10 + W[2] * e20;
  const T m10 = W[3] * f00 + W[4] * f10 + W[5] * e20;
  const T m01 = W[0] * f01 + W[1] * f11 + W[2] * e21;
  const T m11 = W[3] * f01 + W[4] * f11 + W[5] * e21;
  const T m02 = W[0] * f02 + W[1] * f12 + W[2] * e22;
  const T m12 = W[3] * f02 + W[4] * f12 + W[5] * e22;
  const T m22 = W[6] * f02 + W[7] * f12 + W[8] * e22;
  const T across = root_of(m02 * m02 + m12 * m12);
  const auto free5 = across < kWristSingular;
  const T q5 = angle(sign5 * across, m22) - c.bend;
  const T sharp = sign5 / pick(free5, splat<T>(1), across);
  // Where it is singular, m11 and -m01 are cosine and sine of q4 + q6, or of q4 - q6 when axis 6
  // is turned over; one of them is kept.
  T c4 = sharp * m02, s4 = sharp * m12;
  if (__builtin_expect(any(free5), 0)) {
    double near_c_of[kTogether], near_s_of[kTogether];
    sin_cos<RightAngles::as_given>(shared.near[kept], question.count, near_s_of, near_c_of);
    const T near_c = of(near_c_of), near_s = of(near_s_of);
    const T near_t = pick(m22 > 0, near_s, -near_s);
    const T free_c = three ? m11 * near_c - m01 * near_t : near_c;
    const T free_s = three ? -m01 * near_c - m11 * near_t : near_s;
    c4 = pick(free5, free_c, c4);
    s4 = pick(free5, free_s, s4);
  }
  const T q6 = angle(c4 * m10 - s4 * m00, c4 * m11 - s4 * m01);
  T q4 = angle(s4, c4);
  if (three) {
    // q4 is the last link's turn in the plane.
    ux -= c4 * c.l4x - s4 * c.l4y;
    uy -= s4 * c.l4x + c4 * c.l4y;
    two_links(ux, uy);
    q4 = c.sign4 * (q4 - (q2 + c.sign3 * q3));
  }
  const T q1 = angle(s1, c1);
  const T angles[6] = {q1, q2, q3, q4, q5, q6};
  T worst{}, cost{};
  for (std::size_t k = 0; k < 6; ++k) {
    const T near = of(shared.near[k]);
    const Settled<T> s = settle(angles[k], near, lower[k], upper[k]);
    put(at, out, s.q, [&](Candidates& to) { return to.q[k].data(); });
    worst = most_of(worst, s.outside);
    cost += (s.q - near) * (s.q - near);
  }
  put(at, out, worst, [](Candidates& to) { return to.outside.data(); });
  put(at, out, cost, [](Candidates& to) { return to.cost.data(); });
  put(at, out, pick(gap <= question.touch, T{}, gap), [](Candidates& to) { return to.gap.data(); });
  put(at, out, least_of(of(shared.margin), least_of(margin3, across)),
      [](Candidates& to) { return to.margin.data(); });
}

// The lanes that are solutions in the order of their costs, by counting the cheaper ones.
RMP_INLINE void rank(Candidates& c) {
  const double* cost = c.cost.data();
  Bits lane;
  for (std::size_t i = 0; i < kLanes; ++i) lane[i] = static_cast<std::int64_t>(i);
  alignas(64) double valid[kBranches];
  for (std::size_t i = 0; i < kBranches; i += kLanes) {
    const Bits good = (load(c.gap.data() + i) == 0) & (load(c.outside.data() + i) == 0);
    store(valid + i, pick(good, load(cost + i), splat<Lanes>(__builtin_inf())));
  }
  for (std::size_t i = 0; i < kBranches; i += kLanes) {
    const Lanes own = load(valid + i);
    Bits count{};
    for (std::size_t k = 0; k < kBranches; ++k) {
      const Lanes other = splat<Lanes>(valid[k]);
      const Bits before = lane + static_cast<std::int64_t>(i) > static_cast<std::int64_t>(k);
      count -= (other < own) | ((other == own) & before);
    }
    __builtin_memcpy(c.rank.data() + i, &count, sizeof count);
  }
}

template <class T>
RMP_INLINE void solve(const ParallelArm& arm, const LaneQuestions& question, const Shared& shared,
                      const Place* at, Candidates* out) {
  if (arm.three) solve<true, T>(arm, question, shared, at, out);
  else solve<false, T>(arm, question, shared, at, out);
}

void solve_all(const ParallelArm& arm, const LaneQuestions& question, Candidates* out) {
  Shared shared;
  for (std::size_t i = 0; i < question.count; i += kLanes) share(arm, question, i, shared);
  constexpr std::size_t kVectors = kBranches / kLanes;  // a target
  const std::size_t vectors = question.count * kVectors;
  const auto place = [](std::size_t i) { return Place{i / kVectors, i % kVectors * kLanes}; };
  for (std::size_t i = 0; i + 1 < vectors; i += 2) {
    const Place at[2] = {place(i), place(i + 1)};
    solve<Wide>(arm, question, shared, at, out);
  }
  if constexpr (kVectors % 2 != 0) {
    const Place last = place(vectors - 1);
    if (vectors % 2 != 0) solve<Lanes>(arm, question, shared, &last, out);
  }
}

void rank_all(Candidates* candidates, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) rank(candidates[i]);
}

void measure(const ArmPlaces& places, const LaneQuestions& question, const double* q,
             double* distance, double* square) {
  measure_tips<6>(places.data(), question.targets, q, question.count, distance, square);
}

constexpr LaneSolver kSolver{solve_all, rank_all, measure};

}  // namespace

const LaneSolver& lane_solver() { return kSolver; }

}  // namespace robomosp::ik_spherical_wrist::RMP_LANES
