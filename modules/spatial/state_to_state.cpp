// SPDX-License-Identifier: Apache-2.0
// Derivation. Let U(T) be the greatest way in a time T from (v0, a0) to (v1, a1). Pontryagin's
// principle with lambda_x = 1 gives a switching function of second degree in time: jerk +, -, +,
// with the acceleration held at a limit where it reaches one, and held at 0 where the velocity does
// (H. Maurer, On optimal control problems with bounded state variables and control appearing
// linearly, SIAM J. Control Optim. 15, 1977). With jerk 1 and S = T - (a1 - a0), the peak p and the
// trough q of the acceleration follow from
//   2 (p - q) + hold_p + hold_q = S,   p^2 - q^2 + A (hold_p - hold_q) = C,
// in closed form. The derivative of U is the Hamiltonian, in closed form too; as a function of S it
// first falls, then rises, so that U has at most one top and one bottom, at roots of quadratics.
#include "spatial/state_to_state.h"

#include <algorithm>
#include <cmath>

namespace robomosp::spatial {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kSlack = 1e-12;
/// Ends missed by this share of the numbers they come from are met: states taken from a motion on
/// its way are no more accurate, and its remaining time may be the only one for long.
constexpr double kTouch = 1e-11;

double root(double x) { return x > 0 ? std::sqrt(x) : 0; }

/// Velocity after the acceleration has been taken to 0 by jerk 1 (forwards from a state).
double settled(double v, double a) { return v + a * std::fabs(a) / 2; }

}  // namespace

void FarthestMotion::prepare() {
  C = v1 - v0 - (a1 * a1 - a0 * a0) / 2;
  c0 = v0 - a0 * a0 / 2;
  c1 = v1 - a1 * a1 / 2;
  // v at a = 0 is c0 + p^2 + A hold_p, and c1 + q^2 + A hold_q.
  p_top = root(V - c0);
  q_top = -root(V - c1);
  hold_p_top = hold_q_top = 0;
  if (p_top > A) p_top = A, hold_p_top = (V - c0 - A * A) / A;
  if (q_top < -A) q_top = -A, hold_q_top = (V - c1 - A * A) / A;
  S_top = 2 * (p_top - q_top) + hold_p_top + hold_q_top;
}

FarthestMotion::Shape FarthestMotion::shape(double S) const {
  if (S >= S_top) return {p_top, q_top, hold_p_top, hold_q_top, S - S_top};
  const double share = C / A, both = S - 4 * A;
  if (both > std::fabs(share)) return {A, -A, (both + share) / 2, (both - share) / 2, 0};
  // The bounds matter where rounding decides: in the shortest times.
  const double half = std::max(0.0, S / 2), p = half > 0 ? C / S + S / 4 : a0;
  if (C >= 0 && p > A) {
    const double low = std::max(A - half, std::min(a1, A - root(A * S - C)));
    return {A, low, S - 2 * (A - low), 0, 0};
  }
  if (C < 0 && p - half < -A) {
    const double high = std::min(half - A, std::max(a0, root(A * S + C) - A));
    return {high, -A, 0, S - 2 * (high + A), 0};
  }
  const double peak = std::min(a1 + half, std::max(a0, p));
  return {peak, peak - half, 0, 0, 0};
}

double FarthestMotion::way(const Shape& s) const {
  const double rise = s.p - a0, fall = s.p - s.q, end = a1 - s.q;
  const double va = v0 + rise * (a0 + rise / 2), vb = va + s.p * s.hold_p,
               vc = vb + fall * (s.p - fall / 2), vd = vc + s.q * s.hold_q;
  return rise * (v0 + rise * (a0 / 2 + rise / 6)) + s.hold_p * (va + s.p * s.hold_p / 2) +
         fall * (vb + fall * (s.p / 2 - fall / 6)) + s.cruise * V +
         s.hold_q * (vc + s.q * s.hold_q / 2) + end * (vd + end * (s.q / 2 + end / 6));
}

double FarthestMotion::growth(const Shape& s) const {
  if (s.cruise > 0) return V;
  return c0 + s.p * (s.p / 2 + s.hold_p + (s.p - s.q) / 2);
}

double FarthestMotion::reach(double x, double from, double to, double touch) const {
  // Places where the way may turn or its formula changes.
  std::array<double, 12> stop;
  std::size_t count = 0;
  const auto add = [&](double S) {
    if (S > from && S < to) stop[count++] = S;
  };
  const double both = 4 * A + std::fabs(C) / A;
  add(both);
  add(S_top);
  const double inner = A * A - std::fabs(C);
  if (inner >= 0) {
    const double r = 2 * std::sqrt(inner);
    add(2 * A - r);
    add(2 * A + r);
  }
  if (const double b = c0 + C / 2, d = b * b - 0.1875 * C * C; b < 0 && d >= 0) {
    const double r = std::sqrt(d), u = (r - b) / 0.1875;
    add(std::sqrt(u));
    add(root((-b - r) / 0.1875));
  }
  const double c = C >= 0 ? c1 : c0;  // of the side that does not hold
  if (const double d = A * A - 16 * c; d >= 0) {
    const double r = std::sqrt(d);
    for (const double w : {(3 * A + r) / 4, (3 * A - r) / 4}) add((w * w + std::fabs(C)) / A);
  }
  add(4 * A - C / A - 2 * (c0 / A + 1.5 * A));
  for (std::size_t i = 1; i < count; ++i)
    for (std::size_t k = i; k > 0 && stop[k] < stop[k - 1]; --k) std::swap(stop[k], stop[k - 1]);
  double low = from, high = 0, way_high = 0;
  bool is_found = false;
  for (std::size_t i = 0; i <= count && !is_found; ++i) {
    if (i == count && !(to < kInfinity)) {
      // Cruising: every second brings V.
      high = std::max(low, S_top);
      return high + (x - way(shape(high))) / V;
    }
    high = i < count ? stop[i] : to;
    way_high = way(shape(high));
    if (way_high >= x - touch) is_found = true;
    else low = high;
  }
  if (!is_found) return kInfinity;
  if (way_high <= x) return high;
  // Newton's steps, kept between low and high.
  double S = (low + high) / 2;
  for (int i = 0; i < 100; ++i) {
    const Shape s = shape(S);
    const double f = way(s) - x, g = growth(s);
    (f < 0 ? low : high) = S;
    double next = g > 0 ? S - f / g : low - 1;
    if (!(next >= low && next <= high)) next = (low + high) / 2;
    const double step = std::fabs(next - S);
    S = next;
    if (step <= 4e-16 * S || high - low <= 4e-16 * high) break;
  }
  return S;
}

StateToState::Fault StateToState::prepare(const Motion1& start, const Motion1& end,
                                          const StateLimits& limits) {
  start_ = start;
  end_ = end;
  jerk_ = limits.j;
  const double scale = 1 / limits.j;
  double V = limits.v * scale, A = limits.a * scale;
  double x0 = start.x * scale, v0 = start.v * scale, a0 = start.a * scale;
  const double x1 = end.x * scale, v1 = end.v * scale, a1 = end.a * scale;
  if (std::fabs(v1) > V * (1 + kSlack)) return Fault::end_velocity;
  if (std::fabs(a1) > A * (1 + kSlack)) return Fault::end_acceleration;
  if (std::fabs(settled(v1, a1)) > V * (1 + kSlack) ||
      std::fabs(settled(v1, -a1)) > V * (1 + kSlack))
    return Fault::end_passed;
  if (!(V < kInfinity) || !(A < kInfinity)) {
    // Above what any motion between these states uses.
    const double time =
        8 * (std::cbrt(std::fabs(x1 - x0)) + std::sqrt(std::fabs(v0) + std::fabs(v1)) +
             std::fabs(a0) + std::fabs(a1)) +
        1e-6;
    A = std::min(A, time);
    V = std::min(V, std::fabs(v0) + std::fabs(v1) + time * time);
  }
  // A start outside the limits: back as fast as possible.
  brakes_ = 0;
  brake_time_ = 0;
  const auto brake = [&](double dt, double jerk) {
    if (!(dt > 0)) return;
    brake_dt_[brakes_] = dt, brake_jerk_[brakes_++] = jerk * jerk_;
    brake_time_ += dt;
    x0 += dt * (v0 + dt * (a0 / 2 + dt * jerk / 6));
    v0 += dt * (a0 + dt * jerk / 2);
    a0 += dt * jerk;
  };
  if (std::fabs(a0) > A) {
    const double sign = a0 > 0 ? 1 : -1;
    brake(std::fabs(a0) - A, -sign);
    a0 = sign * A;
  }
  for (int round = 0; round < 3; ++round) {
    double s = v0 > V ? 1 : v0 < -V ? -1 : settled(v0, a0) > 0 ? 1 : -1;
    if (!(s * v0 > V * (1 + kSlack)) && !(s * settled(v0, a0) > V * (1 + kSlack))) break;
    // Mirrored so that it is too fast forwards. The acceleration falls until V is met, its limit
    // is, or the velocity could not be caught before -V any more.
    const double v = s * v0, a = s * a0;
    const double at_v = a + root(a * a + 2 * (v - V)), at_a = a + A,
                 at_turn = a + root(v + a * a / 2 + V);
    const auto rise_to_V = [&] {
      const double b = -s * a0;
      brake(b - root(b * b - 2 * (s * v0 - V)), s);
    };
    if (at_v <= std::min(at_a, at_turn)) {
      brake(at_v, -s);
    } else if (at_a <= at_turn) {
      brake(at_a, -s);
      a0 = -s * A;
      const double to_v = (s * v0 - V) / A, to_turn = (s * v0 - A * A / 2 + V) / A;
      brake(std::min(to_v, to_turn), 0);
      if (to_turn < to_v) rise_to_V();
    } else {
      brake(at_turn, -s);
      rise_to_V();
    }
    v0 = s * V;
  }
  way_ = x1 - x0;
  forward_ = {v0, a0, v1, a1, V, A, 0, 0, 0, 0, 0, 0, 0, 0};
  forward_.prepare();
  backward_ = {-v0, -a0, -v1, -a1, V, A, 0, 0, 0, 0, 0, 0, 0, 0};
  backward_.prepare();
  // When can the velocity be changed so? Rising then falling, with a peak r > 0 of (a0^2 + a1^2) /
  // 2
  // + dv, or the mirror image. Between them times are blocked while the acceleration cannot stay
  // away from 0.
  const double dv = v1 - v0, mean = (a0 * a0 + a1 * a1) / 2, sum = a0 + a1;
  const double direct_dv = (a1 >= a0 ? 1 : -1) * (a1 * a1 - a0 * a0) / 2;
  const double sign = dv >= direct_dv ? 1 : -1;
  const double r = root(mean + sign * dv);
  first_ = std::max(std::fabs(a1 - a0),
                    r <= A ? 2 * r - sign * sum : 2 * A - sign * sum + (r * r - A * A) / A);
  gap_from_ = gap_to_ = kInfinity;
  const double least = std::min(sign * a0, sign * a1), square = mean - sign * dv;
  if (least > 0 && square >= 0 && square <= least * least) {
    gap_from_ = sign * sum - 2 * std::sqrt(square);
    gap_to_ = sign * sum + 2 * std::sqrt(square);
  }
  // Rounding decides over states that lie on the last piece of a motion: they may just go on.
  direct_ = std::fabs(a1 - a0);
  const double j = a1 >= a0 ? 1 : -1;
  const double direct_path = direct_ * (v0 + direct_ * (a0 / 2 + j * direct_ / 6));
  touch_ = kTouch * (10 * std::fabs(way_) + std::fabs(x0) + std::fabs(x1) +
                     first_ * (std::fabs(v0) + std::fabs(v1)));
  is_direct_ = std::fabs(dv - direct_dv) <= kTouch * (std::fabs(v0) + std::fabs(v1) + mean) &&
               std::fabs(direct_path - way_) <= touch_;
  return Fault::none;
}

double StateToState::next_core(double T) const {
  if (is_direct_ && T <= direct_) return direct_;
  const double shift = forward_.a1 - forward_.a0;
  for (int section = 0; section < 2; ++section) {
    const double end = section == 0 ? gap_from_ : kInfinity;
    const double begin = std::max(T, section == 0 ? first_ : gap_to_);
    if (section == 1 && !(gap_to_ < kInfinity)) break;
    if (begin > end) continue;
    const double farthest = forward_.way(forward_.shape(begin - shift));
    if (farthest < way_ - touch_) {
      const double S = forward_.reach(way_, begin - shift, end - shift, touch_);
      if (S < kInfinity) return S + shift;
      continue;
    }
    const double nearest = -backward_.way(backward_.shape(begin + shift));
    if (nearest > way_ + touch_) {
      const double S = backward_.reach(-way_, begin + shift, end + shift, touch_);
      if (S < kInfinity) return S - shift;
      continue;
    }
    return begin;
  }
  return kInfinity;
}

double StateToState::next_duration(double T) const {
  return brake_time_ + next_core(std::max(0.0, T - brake_time_));
}

Ramps StateToState::motion(double T) const {
  Ramps out(start_.x, start_.v, start_.a);
  for (std::size_t i = 0; i < brakes_; ++i) out.append(brake_dt_[i], brake_jerk_[i]);
  T -= brake_time_;
  const double J = jerk_, shift = forward_.a1 - forward_.a0;
  if (is_direct_ && T <= direct_ * (1 + kSlack)) {
    out.append(direct_, shift > 0 ? J : -J);
    return out;
  }
  const FarthestMotion::Shape f = forward_.shape(T - shift), b = backward_.shape(T + shift);
  const double far = forward_.way(f), near = -backward_.way(b);
  // How much of the farthest motion: all of it or nothing where the time is the shortest.
  double share = far - near > touch_ ? (way_ - near) / (far - near) : 1;
  if (std::fabs(far - way_) <= touch_) share = 1;
  else if (std::fabs(near - way_) <= touch_) share = 0;
  struct Leg {
    double dt, jerk;
  };
  const auto legs = [](const FarthestMotion& m, const FarthestMotion::Shape& s, double jerk) {
    const bool is_split = s.cruise > 0;
    return std::array<Leg, 7>{{{s.p - m.a0, jerk},
                               {s.hold_p, 0},
                               {is_split ? s.p : s.p - s.q, -jerk},
                               {s.cruise, 0},
                               {is_split ? -s.q : 0, -jerk},
                               {s.hold_q, 0},
                               {m.a1 - s.q, jerk}}};
  };
  const auto up = legs(forward_, f, J), down = legs(backward_, b, -J);
  if (share >= 1 || share <= 0) {
    for (const Leg& leg : share >= 1 ? up : down) out.append(leg.dt, leg.jerk);
    return out;
  }
  // Both at once, each jerk by its share.
  std::size_t i = 0, k = 0;
  double left_up = up[0].dt, left_down = down[0].dt;
  while (i < 7 && k < 7) {
    const double dt = std::min(left_up, left_down);
    out.append(dt, share * up[i].jerk + (1 - share) * down[k].jerk);
    left_up -= dt, left_down -= dt;
    if (!(left_up > 0) && ++i < 7) left_up = up[i].dt;
    if (!(left_down > 0) && ++k < 7) left_down = down[k].dt;
  }
  return out;
}

double common_duration(std::span<const StateToState> work, double T) {
  // A time that one coordinate cannot take is prolonged to its next; each has few blocked times.
  for (std::size_t agreed = 0, i = 0; agreed < work.size() && T < kInfinity;
       i = (i + 1) % work.size()) {
    const double next = work[i].next_duration(T);
    agreed = next > T ? 1 : agreed + 1;
    T = std::max(T, next);
  }
  return T;
}

}  // namespace robomosp::spatial
