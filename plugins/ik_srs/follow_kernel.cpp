// SPDX-License-Identifier: Apache-2.0
// One branch at one arm angle, a target a lane; compiled once an instruction set (layer: plugin).
// The formulas are those of SrsTarget (srs_arm.cpp) with the arm angle put in first.
#include "follow_kernel.h"

#include "spatial/lane_angles.h"

namespace robomosp::ik_srs::RMP_LANES {
namespace {

using namespace spatial::RMP_LANES;

struct Axes {
  Vec<Lanes> to, side, third;
};

RMP_INLINE Vec<Lanes> unit(const Vec<Lanes>& v) { return scaled(v, 1 / root_of(dot(v, v))); }
// Unit vector of v's part across the unit vector `to`, twice, so that what rounding left goes too.
template <class T>
RMP_INLINE Vec<Lanes> lanes_across(const Vec<T>& v, const Vec<Lanes>& to) {
  const Vec<Lanes> once = unit(v - scaled(to, dot(to, v)));
  return unit(once - scaled(to, dot(to, once)));
}
RMP_INLINE Vec<Lanes> turned(const Vec<double>& axis, const Lanes& s, const Lanes& c,
                             const Vec<Lanes>& v) {
  return scaled(v, c) + scaled(cross(axis, v), s) + scaled(axis, (1 - c) * dot(axis, v));
}

// Rz(first) Ry(second) Rz(third) of the matrix that is the sum of a_k b_k^T.
RMP_INLINE void split_lanes(const Vec<Lanes>* a, const Vec<Lanes>* b, double sign, Lanes* q,
                            Lanes& sine) {
  const auto element = [&](auto row, auto column) __attribute__((always_inline)) {
    return row(a[0]) * column(b[0]) + row(a[1]) * column(b[1]) + row(a[2]) * column(b[2]);
  };
  const auto x = [](const Vec<Lanes>& v) __attribute__((always_inline)) { return v.x; };
  const auto y = [](const Vec<Lanes>& v) __attribute__((always_inline)) { return v.y; };
  const auto z = [](const Vec<Lanes>& v) __attribute__((always_inline)) { return v.z; };
  const Lanes m2 = element(x, z), m5 = element(y, z);
  sine = root_of(m2 * m2 + m5 * m5);
  const Lanes per = sign / pick(sine > 0, sine, splat<Lanes>(1)), s = m5 * per, c = m2 * per;
  q[0] = angle(s, c);
  q[1] = angle(sign * sine, element(z, z));
  q[2] = angle(c * element(y, x) - s * element(x, x), c * element(y, y) - s * element(x, y));
}

void follow(const FollowArm& arm, const FollowBranch& branch, const double* targets,
            std::size_t count, Followed& out) {
  const Vec<double> axis4 = plain(arm.axis4), upper = plain(arm.upper), fore = plain(arm.fore);
  const Vec<double> plane = fore - scaled(axis4, arm.offset), side4 = cross(axis4, plane);
  const double a = dot(upper, plane), b = dot(upper, side4), n = arm.l2 * arm.l3;
  for (std::size_t i = 0; i < count; i += kLanes) {
    Lanes pose[12], q[7];
    load_samples(targets + 12 * i, 12, count - i, pose);
    const Vec<Lanes> way = multiply(pose, plain(arm.tip_wrist)) +
                           (Vec<Lanes>{pose[9], pose[10], pose[11]} - plain(arm.shoulder));
    const Lanes distance = root_of(dot(way, way));
    const Vec<Lanes> to = scaled(way, 1 / distance);
    // The elbow: k and the root are cosine and sine of its angle from the straight arm, times n.
    const Lanes square = distance * distance - arm.offset * arm.offset, none{};
    const Lanes reach = root_of(most_of(square, none));
    const double sum = arm.l2 + arm.l3, difference = arm.l2 - arm.l3;
    const Lanes product =
        (sum - reach) * (sum + reach) * (reach - difference) * (reach + difference);
    const Lanes root = 0.5 * root_of(most_of(product, none));
    const Lanes k = 0.5 * (square - (arm.l2 * arm.l2 + arm.l3 * arm.l3));
    Lanes s4 = (b * k + branch.elbow * a * root) / (n * n),
          c4 = (a * k - branch.elbow * b * root) / (n * n);
    const Lanes size = 1 / root_of(s4 * s4 + c4 * c4);
    s4 *= size, c4 *= size;
    q[3] = angle(s4, c4);
    const Vec<Lanes> wide_fore = vec<Lanes>(arm.fore);
    const Vec<Lanes> to_wrist = unit(upper + turned(axis4, s4, c4, wide_fore));
    const Vec<Lanes> from_side = lanes_across(upper, to_wrist);
    // The arm angle turns the zero direction about the line from shoulder to wrist.
    const Vec<double> up = plain(arm.axis1);
    const Vec<Lanes> zero = lanes_across(up, to), beside = cross(to, zero), leaning = cross(to, up);
    const Vec<Lanes> to_side = scaled(zero, branch.cosine) + scaled(beside, branch.sine);
    const Vec<Lanes> from[3] = {to_wrist, from_side, cross(to_wrist, from_side)},
                     goal[3] = {to, to_side, cross(to, to_side)};
    Vec<Lanes> left[3], right[3];
    for (std::size_t e = 0; e < 3; ++e) {
      left[e] = multiply(arm.first_to, goal[e]);
      right[e] = multiply(arm.first_from, from[e]);
    }
    Lanes sine2, sine6;
    split_lanes(left, right, branch.shoulder, q, sine2);
    // R5 R6 R7 = R4^T (R1 R2 R3)^T R.
    for (std::size_t e = 0; e < 3; ++e) {
      left[e] = multiply(arm.last_to, turned(axis4, -s4, c4, from[e]));
      right[e] = multiply_back(arm.whole, multiply_back(pose, goal[e]));
    }
    split_lanes(left, right, branch.wrist, q + 4, sine6);
    q[1] -= arm.bend2, q[5] -= arm.bend6;
    store_samples(q, 7, count - i, out.q + 7 * i);
    const Lanes gap = most_of(distance - arm.most, arm.least - distance);
    Lanes clear =
        least_of(least_of(root / n, root_of(dot(leaning, leaning))), least_of(sine2, sine6));
    clear = pick((gap < 0) & (product > 0), clear, none);
    store(out.clear + i, clear);
  }
  measure_tips<7>(arm.places, targets, out.q, count, out.distance, out.square);
}

constexpr FollowKernel kKernel{follow};

}  // namespace

const FollowKernel& follow_kernel() { return kKernel; }

}  // namespace robomosp::ik_srs::RMP_LANES
