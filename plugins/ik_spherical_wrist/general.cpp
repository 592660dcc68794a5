// SPDX-License-Identifier: Apache-2.0
// D. L. Pieper, The kinematics of manipulators under computer control, 1968: the wrist point's
// distance from axis 1 and its height along it do not depend on joint 1.
#include "general.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "spatial/pose.h"
#include "spatial/subproblems.h"

namespace robomosp::ik_spherical_wrist {
namespace {

using spatial::add;
using spatial::cross;
using spatial::dot;
using spatial::norm;
using spatial::scale;
using spatial::SinCos;
using spatial::sub;
using spatial::turned;

constexpr double kTurn = 2 * std::numbers::pi;
constexpr double kLimitRounding = 1e-10;
constexpr double kSingular = 1e-12;

SinCos sin_cos_of(double t) { return {std::sin(t), std::cos(t)}; }
double angle_of(const SinCos& t) { return std::atan2(t.sin, t.cos); }

/// a + b cos(t3) + c sin(t3).
struct Wave {
  double a = 0, b = 0, c = 0;
  [[nodiscard]] double at(const SinCos& t) const { return a + b * t.cos + c * t.sin; }
};

class Arm3 {
 public:
  Arm3(const Family& f, const Question& question)
      : f_(f),
        j_(f.arm.joints),
        question_(question),
        goal_(spatial::transform(question.target, f.tip_wrist)) {}

  /// First three angles that bring the wrist point to the goal, at most 4.
  int solve(std::array<std::array<double, 3>, 4>& found) const {
    int count = 0;
    const auto put = [&](double t2, double t3) {
      std::array<double, 3> q{first(t2, t3), t2, t3};
      if (count == 4 || !polish(q)) return;
      for (int i = 0; i < count; ++i) {
        double apart = 0;
        for (std::size_t k = 0; k < 3; ++k)
          apart = std::max(apart, std::fabs(std::remainder(
                                      q[k] - found[static_cast<std::size_t>(i)][k], kTurn)));
        if (apart < 1e-7) return;
      }
      found[static_cast<std::size_t>(count++)] = q;
    };
    // Points p1, p2 at the ends of the common normal d of axes 1 and 2, with v = the wrist point
    // behind joint 3 seen from p2 and R2 the turn of joint 2:
    //   2 d . R2 v = |goal - p1|^2 - |v|^2 - |d|^2,   h1 . R2 v = h1 . (goal - p1 - d).
    const Vec3 h1 = j_[0].axis, h2 = j_[1].axis, h3 = j_[2].axis;
    const Vec3 n12 = cross(h1, h2);
    const double sigma = norm(n12);
    Vec3 p1 = j_[0].point, p2 = j_[1].point;
    const bool crossing = sigma > kSame;
    if (crossing) {
      const Vec3 w = sub(p2, p1);
      p1 = add(p1, scale(h1, dot(cross(w, h2), n12) / (sigma * sigma)));
      p2 = add(p2, scale(h2, dot(cross(w, h1), n12) / (sigma * sigma)));
    } else {
      p2 = add(p2, scale(h2, dot(sub(p1, p2), h2)));
    }
    const Vec3 d = sub(p2, p1);
    const double length = norm(d);
    const bool apart = length > kSame * f_.arm.length;
    Vec3 n = apart ? scale(d, 1 / length) : spatial::unit(n12);
    const Vec3 e2 = cross(h2, n);
    // v(t3) = centre + across cos + side sin.
    const Vec3 from3 = sub(f_.wrist, j_[2].point);
    const Vec3 along = scale(h3, dot(h3, from3)), across = sub(from3, along),
               side = cross(h3, from3);
    const Vec3 centre = sub(add(j_[2].point, along), p2);
    const auto wave = [&](const Vec3& u) {
      return Wave{dot(u, centre), dot(u, across), dot(u, side)};
    };
    const Wave va = wave(n), vb = wave(e2), vh = wave(h2);
    const Wave v2{dot(centre, centre) + dot(across, across), 2 * dot(centre, across),
                  2 * dot(centre, side)};
    const Vec3 to = sub(goal_, p1);
    const double k2 = dot(to, to) - length * length, k1 = dot(h1, sub(to, d));
    const double up = dot(h1, h2);
    // |d| (a c - b s) = E and sigma (a s + b c) = F; h1 = up h2 + h1e e2.
    const double h1e = dot(h1, e2);
    const Wave E{(k2 - v2.a) / 2, -v2.b / 2, -v2.c / 2};
    const Wave F{k1 - up * vh.a, -up * vh.b, -up * vh.c};
    const auto turn_from = [&](const SinCos& t3) {
      const double a = va.at(t3), b = vb.at(t3), e = E.at(t3), g = F.at(t3);
      if (apart && crossing) {
        const double x = e / length, y = g / h1e;
        if (std::hypot(a, b) > kSingular * f_.arm.length)
          put(std::atan2(a * y - b * x, a * x + b * y), angle_of(t3));
        else put(question_.near[1], angle_of(t3));
        return;
      }
      // a s + b c = y, or a c - b s = x.
      const auto two = crossing ? spatial::solve_cosine(b, a, g / h1e)
                                : spatial::solve_cosine(a, -b, e / length);
      if (two.gap > 1e-6 * f_.arm.length) return;
      for (const SinCos& t2 : two.turn) put(angle_of(t2), angle_of(t3));
    };
    const auto linear = [&](const Wave& w) {
      const auto two = spatial::solve_cosine(w.b, w.c, -w.a);
      if (two.gap > 1e-6 * f_.arm.length * f_.arm.length) return;
      for (const SinCos& t3 : two.turn) turn_from(t3);
    };
    if (!apart && !crossing) return 0;  // axes 1 and 2 are one
    if (!apart) return linear(E), count;
    if (!crossing) return linear(F), count;
    // (E / |d|)^2 + (F / sigma)^2 = |v|^2 - (h2 . v)^2, of second degree in cos and sin of t3.
    double a2 = 0, b2 = 0, a1 = 0, b1 = 0, a0 = 0;
    const auto add_square = [&](const Wave& w, double weight) {
      a0 += weight * (w.a * w.a + (w.b * w.b + w.c * w.c) / 2);
      a1 += weight * 2 * w.a * w.b;
      b1 += weight * 2 * w.a * w.c;
      a2 += weight * (w.b * w.b - w.c * w.c) / 2;
      b2 += weight * w.b * w.c;
    };
    add_square(E, 1 / (length * length));
    add_square(F, 1 / (h1e * h1e));
    add_square(vh, 1);
    a0 -= v2.a, a1 -= v2.b, b1 -= v2.c;
    const auto roots = spatial::trigonometric_roots(a2, b2, a1, b1, a0);
    for (int i = 0; i < roots.count; ++i)
      turn_from(sin_cos_of(roots.t[static_cast<std::size_t>(i)]));
    return count;
  }

  /// Configurations of a grid whose wrist points come closest, with their distances.
  int nearest(std::array<std::array<double, 3>, 4>& found, std::array<double, 4>& gaps) const {
    constexpr int kGrid = 24;
    gaps.fill(INFINITY);
    for (int i = 0; i < kGrid; ++i)
      for (int k = 0; k < kGrid; ++k) {
        const double t2 = i * kTurn / kGrid, t3 = k * kTurn / kGrid, t1 = first(t2, t3);
        const double gap = norm(sub(point({t1, t2, t3}), goal_));
        const auto worst = std::max_element(gaps.begin(), gaps.end());
        if (gap < *worst) {
          *worst = gap;
          found[static_cast<std::size_t>(worst - gaps.begin())] = {t1, t2, t3};
        }
      }
    return 4;
  }

 private:
  [[nodiscard]] Vec3 about(std::size_t i, double t, const Vec3& p) const {
    return add(j_[i].point, turned(j_[i].axis, sin_cos_of(t), sub(p, j_[i].point)));
  }
  [[nodiscard]] Vec3 point(const std::array<double, 3>& q) const {
    return about(0, q[0], about(1, q[1], about(2, q[2], f_.wrist)));
  }
  // Joint 1 for given others; the angle to stay near where the wrist point is on axis 1.
  [[nodiscard]] double first(double t2, double t3) const {
    const Vec3 x = sub(about(1, t2, about(2, t3, f_.wrist)), j_[0].point);
    double size = 0;
    const SinCos t = spatial::turn_between(j_[0].axis, x, sub(goal_, j_[0].point), &size);
    return size > kSingular * f_.arm.length * f_.arm.length ? angle_of(t) : question_.near[0];
  }
  // Newton steps on the wrist point; false when it stays away from the goal.
  bool polish(std::array<double, 3>& q) const {
    double gap = 0;
    for (int step = 0; step < 4; ++step) {
      const Vec3 c3 = about(2, q[2], f_.wrist), c2 = about(1, q[1], c3), c1 = about(0, q[0], c2);
      const Vec3 e = sub(goal_, c1);
      gap = norm(e);
      if (gap < 1e-15 * f_.arm.length || step == 3) break;
      const SinCos t1 = sin_cos_of(q[0]), t2 = sin_cos_of(q[1]);
      const auto turn1 = [&](const Vec3& v) { return turned(j_[0].axis, t1, v); };
      const Vec3 v1 = cross(j_[0].axis, sub(c1, j_[0].point));
      const Vec3 v2 = turn1(cross(j_[1].axis, sub(c2, j_[1].point)));
      const Vec3 v3 = turn1(turned(j_[1].axis, t2, cross(j_[2].axis, sub(c3, j_[2].point))));
      const double det = dot(v1, cross(v2, v3));
      if (std::fabs(det) < 1e-9 * f_.arm.length * f_.arm.length * f_.arm.length) break;
      const std::array<double, 3> dq{dot(e, cross(v2, v3)) / det, dot(v1, cross(e, v3)) / det,
                                     dot(v1, cross(v2, e)) / det};
      for (std::size_t k = 0; k < 3; ++k) q[k] += std::clamp(dq[k], -1e-2, 1e-2);
    }
    return gap <= question_.touch;
  }

  const Family& f_;
  const std::vector<spatial::ArmJoint>& j_;
  const Question& question_;
  Vec3 goal_;
};

Vec3 column(const std::array<double, 9>& r, std::size_t i) { return {r[i], r[3 + i], r[6 + i]}; }

// The last three angles for given first three: two answers; `margin` is 0 where they meet.
struct Wrist {
  std::array<std::array<double, 3>, 2> q{};
  double gap = 0, margin = 0;
};
Wrist wrist(const Family& f, const Question& question, const std::array<double, 3>& q) {
  const auto& j = f.arm.joints;
  const SinCos t1 = sin_cos_of(q[0]), t2 = sin_cos_of(q[1]), t3 = sin_cos_of(q[2]);
  const auto back = [&](const Vec3& v) {  // (R1 R2 R3)^T
    return turned(j[2].axis, {-t3.sin, t3.cos},
                  turned(j[1].axis, {-t2.sin, t2.cos}, turned(j[0].axis, {-t1.sin, t1.cos}, v)));
  };
  // Turn of the whole arm: target R times the transpose of the tip's R at q = 0.
  const auto whole = [&](const Vec3& v) {
    const Vec3 in_tip = spatial::rotate_back(f.arm.tip_at_zero, v);
    return back(add(add(scale(column(question.target.R, 0), in_tip[0]),
                        scale(column(question.target.R, 1), in_tip[1])),
                    scale(column(question.target.R, 2), in_tip[2])));
  };
  const Vec3 h4 = j[3].axis, h5 = j[4].axis, h6 = j[5].axis;
  const Vec3 g = whole(h6);
  const double fixed = dot(h4, h5) * dot(h5, h6);
  const double a = dot(h4, h6) - fixed, b = dot(h4, cross(h5, h6)), c = dot(h4, g) - fixed;
  auto two = spatial::solve_cosine(a, b, c);
  if (f.right_wrist) {  // then a^2 + b^2 = 1 and the root is |h4 x g|, without cancellation
    const double r = norm(cross(h4, g)), k = dot(h4, g);
    two.turn[0] = {b * k + a * r, a * k - b * r};
    two.turn[1] = {b * k - a * r, a * k + b * r};
    two.root = r;
    two.gap = 0;
  }
  Wrist out;
  out.gap = two.gap;
  out.margin = two.root;
  const Vec3 any = spatial::unit(cross(h6, h5));
  const Vec3 any_goal = whole(any);
  for (std::size_t i = 0; i < 2; ++i) {
    const Vec3 arm6 = turned(h5, two.turn[i], h6);
    double size = 0;
    SinCos t4 = spatial::turn_between(h4, arm6, g, &size);
    double q4 = angle_of(t4);
    if (size < kSingular) q4 = question.near[3], t4 = sin_cos_of(q4);
    const Vec3 rest =
        turned(h5, {-two.turn[i].sin, two.turn[i].cos}, turned(h4, {-t4.sin, t4.cos}, any_goal));
    out.q[i] = {q4, angle_of(two.turn[i]), angle_of(spatial::turn_between(h6, any, rest))};
  }
  return out;
}

}  // namespace

void solve_general(const Family& f, const Question& question, Candidates& out) {
  for (auto& q : out.q) q.fill(0);
  out.gap.fill(INFINITY);
  out.outside.fill(0);
  out.cost.fill(INFINITY);
  out.margin.fill(1);
  std::array<std::array<double, 3>, 4> arms{};
  std::array<double, 4> gaps{};
  const Arm3 arm(f, question);
  int count = arm.solve(arms);
  if (count == 0) count = arm.nearest(arms, gaps);
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    const Wrist last = wrist(f, question, arms[i]);
    for (std::size_t k = 0; k < 2; ++k) {
      const std::size_t lane = 2 * i + k;
      const double turn_gap = last.gap > 1e-12 ? last.gap * f.arm.length : 0;
      out.gap[lane] = gaps[i] + turn_gap;
      out.margin[lane] = last.margin;
      out.cost[lane] = 0;
      for (std::size_t joint = 0; joint < 6; ++joint) {
        const double q = joint < 3 ? arms[i][joint] : last.q[k][joint - 3];
        const double near = question.near[joint], lower = question.lower[joint],
                     upper = question.upper[joint];
        const double x = q + kTurn * std::round((near - q) / kTurn);
        double y = x;
        if (y > upper + kLimitRounding)
          y -= kTurn * std::ceil((y - upper - kLimitRounding) / kTurn);
        if (y < lower - kLimitRounding)
          y += kTurn * std::ceil((lower - kLimitRounding - y) / kTurn);
        const bool in = y <= upper + kLimitRounding && y >= lower - kLimitRounding;
        const double turns_out =
            in ? 0
               : std::min(std::max(x - upper, lower - x), x > upper ? std::fabs(lower - (x - kTurn))
                                                                    : std::fabs(x + kTurn - upper));
        out.q[joint][lane] = in ? std::clamp(y, lower, upper) : x;
        out.outside[lane] = std::max(out.outside[lane], turns_out);
        const double far = out.q[joint][lane] - near;
        out.cost[lane] += far * far;
      }
    }
  }
}

}  // namespace robomosp::ik_spherical_wrist
