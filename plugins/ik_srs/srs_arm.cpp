// SPDX-License-Identifier: Apache-2.0
// M. Shimizu, H. Kakuya, W.-K. Yoon, K. Kitagaki, K. Kosuge, Analytical inverse kinematic
// computation for 7-DOF redundant manipulators with joint limits and its application to redundancy
// resolution, IEEE T-RO 24 (2008); the zero of the arm angle as in K. Kreutz-Delgado, M. Long,
// H. Seraji, Kinematic analysis of 7-DOF manipulators, IJRR 11 (1992).
#include "srs_arm.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "spatial/ik_support.h"
#include "spatial/pose.h"
#include "spatial/print.h"
#include "spatial/subproblems.h"

namespace robomosp::ik_srs {
namespace {

using spatial::add;
using spatial::ArmJoint;
using spatial::cross;
using spatial::dot;
using spatial::norm;
using spatial::scale;
using spatial::SinCos;
using spatial::sub;
using spatial::turned;
using Matrix = std::array<double, 9>;

/// Axes count as parallel or perpendicular below this sine or cosine, as meeting below this
/// distance per arm length.
constexpr double kSame = 1e-9;
/// Below this sine of joint 2 or 6 its neighbours turn about one line, and one of them is kept.
constexpr double kSingular = 1e-12;
/// Below this sine the arm points along axis 1, or the elbow is straight.
constexpr double kAligned = 1e-9;

Matrix times(const Matrix& a, const Matrix& b) {
  Matrix c;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 3; ++k)
      c[3 * i + k] = a[3 * i] * b[k] + a[3 * i + 1] * b[3 + k] + a[3 * i + 2] * b[6 + k];
  return c;
}
Matrix transposed(const Matrix& a) {
  return {a[0], a[3], a[6], a[1], a[4], a[7], a[2], a[5], a[8]};
}
Matrix columns(const Vec3& x, const Vec3& y, const Vec3& z) {
  return {x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2]};
}
Matrix rotation(const Vec3& h, const SinCos& t) {
  return columns(turned(h, t, {1, 0, 0}), turned(h, t, {0, 1, 0}), turned(h, t, {0, 0, 1}));
}
SinCos sin_cos_of(double t) { return {std::sin(t), std::cos(t)}; }
double angle_of(const SinCos& t) { return std::atan2(t.sin, t.cos); }

double distance_to(const ArmJoint& a, const Vec3& p) {
  return norm(cross(a.axis, sub(p, a.point)));
}
Vec3 nearest_on(const ArmJoint& a, const ArmJoint& b) {
  const Vec3 n = cross(a.axis, b.axis);
  const double t = dot(cross(sub(b.point, a.point), b.axis), n) / dot(n, n);
  return add(a.point, scale(a.axis, t));
}

// Empty when axes first .. first + 2 meet in `point` at right angles, else what is wrong.
std::string why_no_ball(const spatial::SerialArm& arm, std::size_t first, Vec3& point) {
  const ArmJoint &a = arm.joints[first], &b = arm.joints[first + 1], &c = arm.joints[first + 2];
  const std::string na = std::to_string(first + 1), nb = std::to_string(first + 2),
                    nc = std::to_string(first + 3);
  const auto metres = [](double x) { return spatial::print_number(x, 3) + " m"; };
  if (std::fabs(dot(a.axis, b.axis)) > kSame)
    return "axis " + nb + " is not perpendicular to axis " + na;
  if (std::fabs(dot(b.axis, c.axis)) > kSame)
    return "axis " + nc + " is not perpendicular to axis " + nb;
  point = nearest_on(b, a);
  const double miss = distance_to(a, point), third = distance_to(c, point);
  if (miss > kSame * arm.length) return "axis " + nb + " passes axis " + na + " at " + metres(miss);
  if (third > kSame * arm.length)
    return "axis " + nc + " passes the point where axes " + na + " and " + nb + " meet at " +
           metres(third);
  return {};
}

Ball ball(const spatial::SerialArm& arm, std::size_t first) {
  const Vec3 z = arm.joints[first].axis, y = arm.joints[first + 1].axis, x = cross(y, z);
  const Vec3 last = arm.joints[first + 2].axis;
  Ball out;
  out.to = transposed(columns(x, y, z));
  out.bend = std::atan2(dot(last, x), dot(last, z));
  const SinCos t = sin_cos_of(out.bend);
  out.from = transposed(columns(turned(y, t, x), y, turned(y, t, z)));
  return out;
}

// Unit vector of v's part across the unit vector `to`, twice, so that what rounding left goes too.
Vec3 across(const Vec3& v, const Vec3& to) {
  const Vec3 once = spatial::unit(sub(v, scale(to, dot(to, v))));
  return spatial::unit(sub(once, scale(to, dot(to, once))));
}

// Part of the upper arm across the line from shoulder to wrist, and where the elbow is straight the
// direction that it leaves the line to; `sign` is that of upper . (axis 4 x to_wrist).
Vec3 elbow_side(const SrsArm& a, const Vec3& to_wrist, int sign) {
  const Vec3 side = sub(a.upper, scale(to_wrist, dot(a.upper, to_wrist)));
  if (norm(side) > kAligned * norm(a.upper)) return across(side, to_wrist);
  return scale(spatial::unit(cross(a.arm.joints[3].axis, to_wrist)), sign);
}

// Zero direction of the arm angle for a shoulder-wrist direction.
Vec3 zero_side(const SrsArm& a, const Vec3& to) {
  const Vec3& up = a.arm.joints[0].axis;
  return across(norm(cross(to, up)) < kAligned ? a.reference : up, to);
}

struct ThreeTurns {
  double first, second, third;
};
// Rz(first) Ry(second) Rz(third) = m; the first is kept where the second is 0 or pi.
ThreeTurns split(const Matrix& m, int sign, double kept) {
  const double across = std::hypot(m[2], m[5]);
  double q1 = std::atan2(sign * m[5], sign * m[2]);
  if (across < kSingular) q1 = kept;
  const SinCos t = sin_cos_of(q1);
  return {q1, std::atan2(sign * across, m[8]),
          std::atan2(t.cos * m[3] - t.sin * m[0], t.cos * m[4] - t.sin * m[1])};
}

Matrix at_angle(const Matrix& m0, const Matrix& m1, const Matrix& m2, const SinCos& t) {
  Matrix m;
  for (std::size_t i = 0; i < 9; ++i) m[i] = m0[i] + t.cos * m1[i] + t.sin * m2[i];
  return m;
}

double wrapped(double t) { return std::remainder(t, kTurn); }

}  // namespace

Result<SrsArm> recognise(const RobotModel& model, std::size_t tip) {
  const auto refused = [](std::string message) {
    return error(ErrorCode::unsupported, std::move(message),
                 "Choose another provider, such as numeric.");
  };
  SrsArm a;
  RMP_TRY_ASSIGN(a.arm, spatial::serial_arm(model, tip));
  if (a.arm.size() != 7)
    return refused("this closed form needs 7 revolute joints, but the tip \"" +
                   model.tips[tip].name + "\" is carried by " + std::to_string(a.arm.size()));
  const std::string start = "it is not a spherical-revolute-spherical arm: ";
  if (const auto why = why_no_ball(a.arm, 0, a.shoulder); !why.empty()) return refused(start + why);
  if (const auto why = why_no_ball(a.arm, 4, a.wrist); !why.empty()) return refused(start + why);
  const ArmJoint& middle = a.arm.joints[3];
  const Vec3 h = middle.axis;
  // The elbow: the point of axis 4 nearest to the shoulder.
  const Vec3 elbow = add(middle.point, scale(h, dot(h, sub(a.shoulder, middle.point))));
  a.upper = sub(elbow, a.shoulder);
  a.fore = sub(a.wrist, elbow);
  a.offset = dot(h, a.fore);
  a.upper_across = norm(a.upper);
  a.fore_across = norm(sub(a.fore, scale(h, a.offset)));
  if (a.upper_across < kSame * a.arm.length) return refused(start + "axis 4 passes the shoulder");
  if (a.fore_across < kSame * a.arm.length) return refused(start + "axis 4 passes the wrist");
  a.most = std::hypot(a.upper_across + a.fore_across, a.offset);
  a.least = std::hypot(a.upper_across - a.fore_across, a.offset);
  a.tip_wrist = spatial::transform(spatial::inverse(a.arm.tip_at_zero), a.wrist);
  a.reference = spatial::axis(a.arm.joints[0].placement, 0);
  a.first = ball(a.arm, 0);
  a.last = ball(a.arm, 4);
  return a;
}

SrsTarget::SrsTarget(const SrsArm& arm, const Pose& target, const Angles& near)
    : arm_(arm), near_(near) {
  const Vec3 way = sub(spatial::transform(target, arm.tip_wrist), arm.shoulder);
  distance_ = norm(way);
  to_ = distance_ > 0 ? scale(way, 1 / distance_) : arm.arm.joints[0].axis;
  gap_ = std::max({0.0, distance_ - arm.most, arm.least - distance_});
  elbow_[0] = elbow(-1, target);
  elbow_[1] = elbow(1, target);
}

SrsTarget::Elbow SrsTarget::elbow(int sign, const Pose& target) const {
  const Vec3 h = arm_.arm.joints[3].axis;
  const Vec3 fore = sub(arm_.fore, scale(h, arm_.offset)), side = cross(h, fore);
  const double l2 = arm_.upper_across, l3 = arm_.fore_across;
  const double a = dot(arm_.upper, fore), b = dot(arm_.upper, side), n = l2 * l3;
  // Squares of the distance across axis 4, as products that are exact where the arm is stretched.
  const double square = std::max(0.0, distance_ * distance_ - arm_.offset * arm_.offset);
  const double reach = std::sqrt(square);
  const double product = (l2 + l3 - reach) * (l2 + l3 + reach) * (reach - std::fabs(l2 - l3)) *
                         (reach + std::fabs(l2 - l3));
  const double root = product > 0 && gap_ == 0 ? 0.5 * std::sqrt(product) : 0.0;
  const double k = std::clamp(0.5 * (square - l2 * l2 - l3 * l3), -n, n);
  const SinCos t{(b * k + sign * a * root) / (n * n), (a * k - sign * b * root) / (n * n)};
  Elbow out;
  out.q4 = angle_of(t);
  const double size = std::hypot(t.sin, t.cos);
  const SinCos t4{t.sin / size, t.cos / size};
  const Vec3 to_wrist = spatial::unit(add(arm_.upper, turned(h, t4, arm_.fore)));
  const Vec3 from_side = elbow_side(arm_, to_wrist, -sign), to_side = zero_side(arm_, to_);
  // Turn of the shoulder at arm angle 0, and with it about the line `to_`.
  const Matrix zero = times(columns(to_, to_side, cross(to_, to_side)),
                            transposed(columns(to_wrist, from_side, cross(to_wrist, from_side))));
  const Vec3& u = to_;
  const Matrix along{u[0] * u[0], u[0] * u[1], u[0] * u[2], u[1] * u[0], u[1] * u[1],
                     u[1] * u[2], u[2] * u[0], u[2] * u[1], u[2] * u[2]};
  const Matrix skew{0, -u[2], u[1], u[2], 0, -u[0], -u[1], u[0], 0};
  const Matrix r0 = times(along, zero), r2 = times(skew, zero);
  Matrix r1;
  for (std::size_t i = 0; i < 9; ++i) r1[i] = zero[i] - r0[i];
  const Matrix from = transposed(arm_.first.from);
  out.shoulder = {times(arm_.first.to, times(r0, from)), times(arm_.first.to, times(r1, from)),
                  times(arm_.first.to, times(r2, from))};
  // R5 R6 R7 = R4^T (R1 R2 R3)^T R, R the turn of the tip since q = 0.
  const Matrix whole = times(target.R, transposed(arm_.arm.tip_at_zero.R));
  const Matrix before = times(arm_.last.to, rotation(h, {-t4.sin, t4.cos}));
  const Matrix behind = times(whole, transposed(arm_.last.from));
  const auto wrist = [&](const Matrix& r) { return times(before, times(transposed(r), behind)); };
  out.wrist = {wrist(r0), wrist(r1), wrist(r2)};
  return out;
}

Angles SrsTarget::at(unsigned branch, double arm_angle) const {
  const Elbow& e = elbow_[branch & 1U];
  const SinCos t = sin_cos_of(arm_angle);
  const ThreeTurns s = split(at_angle(e.shoulder.m0, e.shoulder.m1, e.shoulder.m2, t),
                             branch & 2U ? -1 : 1, near_[0]);
  const ThreeTurns w =
      split(at_angle(e.wrist.m0, e.wrist.m1, e.wrist.m2, t), branch & 4U ? -1 : 1, near_[4]);
  return {s.first, s.second - arm_.first.bend, s.third, e.q4,
          w.first, w.second - arm_.last.bend,  w.third};
}

bool SrsTarget::within_limits(const Angles& q) const {
  for (std::size_t j = 0; j < 7; ++j)
    if (spatial::turns_outside(arm_.arm.joints[j], q[j]) > 0) return false;
  return true;
}

std::vector<Interval> SrsTarget::feasible(unsigned branch) const {
  const Elbow& e = elbow_[branch & 1U];
  if (spatial::turns_outside(arm_.arm.joints[3], e.q4) > 0) return {};
  std::array<double, 64> ends;
  std::size_t count = 0;
  const auto cut = [&](double c0, double c1, double c2) {  // c0 + c1 cos + c2 sin = 0
    const auto two = spatial::solve_cosine(c1, c2, -c0);
    if (two.gap > 0) return;
    for (const SinCos& t : two.turn) ends[count++] = angle_of(t);
  };
  const auto cut_ball = [&](const Wave& w, std::size_t first, double bend) {
    for (std::size_t k = 0; k < 3; ++k) {
      const ArmJoint& joint = arm_.arm.joints[first + k];
      if (joint.upper - joint.lower >= kTurn) continue;
      for (const double limit : {joint.lower, joint.upper}) {
        if (!std::isfinite(limit)) continue;
        const double s = std::sin(limit), c = std::cos(limit);
        const auto both = [&](std::size_t a, double fa, std::size_t b, double fb) {
          cut(fa * w.m0[a] + fb * w.m0[b], fa * w.m1[a] + fb * w.m1[b],
              fa * w.m2[a] + fb * w.m2[b]);
        };
        if (k == 0) both(5, c, 2, -s);      // (sin, cos) of the first are elements 5 and 2
        else if (k == 2) both(7, c, 6, s);  // of the third 7 and -6
        else cut(w.m0[8] - std::cos(limit + bend), w.m1[8], w.m2[8]);
      }
    }
    // Where the ball may be stretched its outer joints can jump.
    const double top = std::atan2(w.m2[8], w.m1[8]);
    ends[count++] = top;
    ends[count++] = wrapped(top + kPi);
  };
  cut_ball(e.shoulder, 0, arm_.first.bend);
  cut_ball(e.wrist, 4, arm_.last.bend);
  std::sort(ends.begin(), ends.begin() + static_cast<std::ptrdiff_t>(count));
  std::vector<Interval> out;
  for (std::size_t i = 0; i < count; ++i) {
    const double from = ends[i], to = i + 1 < count ? ends[i + 1] : ends[0] + kTurn;
    if (to - from < 1e-12 || !within_limits(at(branch, 0.5 * (from + to)))) continue;
    if (!out.empty() && from - out.back().to < 1e-12) out.back().to = to;
    else out.push_back({from, to});
  }
  // The last may go on with the first over -pi.
  if (out.size() > 1 && out.back().to >= out.front().from + kTurn - 1e-12) {
    out.front().from = out.back().from - kTurn;
    out.pop_back();
  }
  return out;
}

std::array<double, 3> branch_measures(const SrsArm& a, const Angles& q) {
  const Vec3& h = a.arm.joints[3].axis;
  const Vec3 fore = sub(a.fore, scale(h, a.offset));
  const double bent = dot(h, cross(a.upper, turned(h, sin_cos_of(q[3]), fore)));
  // Counted about axis 2 where axis 4 is parallel to it at q = 0.
  const double way = dot(h, a.arm.joints[1].axis) < -kSame ? -1 : 1;
  return {-std::sin(q[1] + a.first.bend),
          std::clamp(way * bent / (a.upper_across * a.fore_across), -1.0, 1.0),
          std::sin(q[5] + a.last.bend)};
}

double arm_angle(const SrsArm& a, const Angles& q) {
  const auto& j = a.arm.joints;
  const SinCos t4 = sin_cos_of(q[3]);
  const Vec3 way = add(a.upper, turned(j[3].axis, t4, a.fore));
  const double bent = dot(a.upper, cross(j[3].axis, way));
  const Vec3 from = spatial::unit(way), side = elbow_side(a, from, bent < 0 ? -1 : 1);
  const auto shoulder = [&](const Vec3& v) {
    return turned(j[0].axis, sin_cos_of(q[0]),
                  turned(j[1].axis, sin_cos_of(q[1]), turned(j[2].axis, sin_cos_of(q[2]), v)));
  };
  const Vec3 to = shoulder(from), zero = zero_side(a, to), at = shoulder(side);
  return std::atan2(dot(to, cross(zero, at)), dot(zero, at));
}

}  // namespace robomosp::ik_srs
