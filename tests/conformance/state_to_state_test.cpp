// SPDX-License-Identifier: Apache-2.0
// From any state to any other with limited jerk: closed forms, an exhaustive search, and durations
// of another implementation.
#include "spatial/state_to_state.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace robomosp::spatial {
namespace {

using Fault = StateToState::Fault;

struct Task {
  Motion1 start, end;
  StateLimits limits;
};

double shortest(const Task& t) {
  StateToState s;
  EXPECT_EQ(s.prepare(t.start, t.end, t.limits), Fault::none);
  return s.next_duration(0);
}
double miss(const Ramps& r, const Motion1& end, double T) {
  return std::max({std::fabs(r.end().x - end.x), std::fabs(r.end().v - end.v),
                   std::fabs(r.end().a - end.a), std::fabs(r.duration() - T)});
}
/// Greatest share of the limits that is used, on a dense grid and at every change of jerk.
double use(const Ramps& r, const StateLimits& l, double from = 0) {
  double most = 0;
  const auto add = [&](const Motion1& m) {
    most = std::max({most, std::fabs(m.v) / l.v, std::fabs(m.a) / l.a, std::fabs(m.j) / l.j});
  };
  for (const Ramps::Piece& p : r.pieces())
    if (p.from >= from) add(p.start);
  for (int i = 0; i <= 200; ++i) add(r.at(from + (r.duration() - from) * i / 200));
  return most;
}

/// Random states that keep their limits and can be left and reached within them.
class States {
 public:
  explicit States(unsigned seed) : random_(seed) {}
  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  Task next() {
    Task t;
    t.limits = {uniform(0.1, 5), uniform(0.1, 10), uniform(0.1, 20)};
    for (Motion1* m : {&t.start, &t.end}) {
      m->x = uniform(-2, 2);
      if (uniform(0, 1) < 0.2) continue;
      m->v = uniform(-1, 1) * t.limits.v;
      m->a = uniform(-1, 1) * t.limits.a;
      while (std::fabs(m->v) + m->a * m->a / 2 / t.limits.j > t.limits.v) m->v *= 0.8, m->a *= 0.8;
    }
    return t;
  }

 private:
  std::mt19937 random_;
};

// L. Biagiotti, C. Melchiorri, Trajectory Planning for Automatic Machines and Robots, Springer
// 2008, section 3.4: the four cases of the double S from rest to rest.
TEST(StateToState, RestToRestTakesTheTimesOfTheTextbook) {
  const auto time = [](double way, double v, double a, double j) {
    return shortest({{}, {way, 0, 0, 0}, {v, a, j}});
  };
  EXPECT_NEAR(time(3, 1.5, 2, 8), 3 / 1.5 + 1.5 / 2 + 2.0 / 8, 1e-12);
  EXPECT_NEAR(time(-3, 1.5, 9, 8), 3 / 1.5 + 2 * std::sqrt(1.5 / 8), 1e-12);
  EXPECT_NEAR(time(3, 90, 2, 8), 0.25 + std::sqrt(0.0625 + 4 * 3 / 2.0), 1e-12);
  EXPECT_NEAR(time(-0.1, 9, 9, 8), std::cbrt(32 * 0.1 / 8), 1e-12);
  constexpr double kNone = std::numeric_limits<double>::infinity();
  EXPECT_NEAR(time(1000, kNone, kNone, 8), std::cbrt(32 * 1000 / 8.0), 1e-9);
  EXPECT_NEAR(time(1000, kNone, 2, 8), 0.25 + std::sqrt(0.0625 + 4 * 1000 / 2.0), 1e-9);
}

// Ruckig 0.17.3 (L. Berscheid, T. Kroeger, Jerk-limited Real-time Trajectory Generation with
// Arbitrary Target States, RSS 2021; github.com/pantor/ruckig) found these durations for three
// coordinates that arrive together. Five wait for a coordinate with blocked durations, four start
// above a limit.
TEST(StateToState, AgreesWithAnotherImplementation) {
  struct Row {
    double duration;
    std::array<std::array<std::array<double, 3>, 3>, 3> joints;  // start, end, limits
  };
  const std::vector<Row> rows{
      {3.95222486602827,
       {{{{{0.04, -1.8, 1.5}, {-0.02, 0.1, -0.52}, {2.56, 1.87, 9.61}}},
         {{{-1.36, 0.9, -0.59}, {-0.15, -0.28, 0.14}, {2.56, 0.63, 0.62}}},
         {{{0.46, -1.15, 2.49}, {-1.11, -0.28, -0.82}, {1.74, 2.83, 5.81}}}}}},
      {4.49418555858749,
       {{{{{1.34, 0, -0.89}, {-1.61, 0.75, -0.44}, {1.59, 1.27, 4.01}}},
         {{{-1.4, 1.72, -2.37}, {0.64, 0, 0.92}, {2.88, 5.93, 4.22}}},
         {{{0.91, 1.9, 1.08}, {1.02, 0.54, -0.68}, {2.56, 1.35, 10.39}}}}}},
      {4.55488192818146,
       {{{{{-1.55, -1.27, 1.32}, {0.6, -0.34, -0.43}, {1.21, 1.78, 9.75}}},
         {{{-1.47, 3.59, 2.78}, {-0.79, -0.42, -1.17}, {2.79, 3.66, 6.58}}},
         {{{-0.53, 0, 1.09}, {0.54, 0.1, -0.86}, {1.58, 3.9, 6.15}}}}}},
      {5.94566289312327,
       {{{{{-0.7, 0.05, -2.87}, {-1.32, 0.02, 0.67}, {0.99, 3.05, 7.39}}},
         {{{0.51, -0.57, 2.13}, {-1.79, 0.22, -0.96}, {1.34, 2.77, 5.14}}},
         {{{1.46, 0.65, 0.21}, {-1.38, -0.31, -0.2}, {1.42, 0.89, 0.89}}}}}},
      {4.13282779011196,
       {{{{{0.69, 1.55, -1.72}, {-0.43, 0.02, -0.69}, {2.02, 2.23, 9.16}}},
         {{{1.84, -2.02, 2.31}, {0.37, -0.01, 0.84}, {1.67, 3.17, 9.24}}},
         {{{-0.77, -0.54, -0.43}, {1.8, 0.54, -0.22}, {2.98, 1.03, 2.08}}}}}},
      {3.06973725871806,
       {{{{{0.27, -2.16, 1.12}, {-0.52, 1.2, 0.44}, {2.44, 2.08, 7.49}}},
         {{{-0.23, 0.58, 0.05}, {-0.89, 0.38, 0.48}, {0.99, 2.44, 2.75}}},
         {{{0.57, 0.92, 1.47}, {-0.56, 0.22, -0.09}, {1.26, 1.82, 9.88}}}}}},
      {4.97384322262623,
       {{{{{0.45, 1.23, 4.05}, {0.07, 0.38, -0.4}, {1.1, 5.78, 7.3}}},
         {{{-1.53, -2.51, 0.09}, {0.17, -0.43, 0.42}, {2.1, 1.71, 10.47}}},
         {{{-0.2, 0.88, -0.15}, {0.41, -0.47, 0.43}, {2, 1.49, 3.29}}}}}},
      {3.55549193631103,
       {{{{{-0.54, 2.25, 1.74}, {-1.78, 0.43, -1.47}, {2.94, 3.42, 9.24}}},
         {{{0.48, 0.96, -0.64}, {1.61, -0.46, 0}, {1.05, 2.45, 10.93}}},
         {{{-1.49, -0.01, 0.28}, {-1.39, -0.09, 0.19}, {0.63, 0.54, 9.6}}}}}},
      {5.59844043855666,
       {{{{{-0.93, 1.34, 1.29}, {-1.67, -0.02, -1.15}, {1.54, 2.38, 8.99}}},
         {{{-0.73, 2.21, -0.02}, {-1.28, 0.24, 0.96}, {2, 2.34, 4.26}}},
         {{{1.52, 1.65, 0.55}, {-1.43, -0.1, 0.73}, {2.96, 3.03, 1.53}}}}}},
      {2.74633999550203,
       {{{{{-1.13, 0.3, -1.06}, {-0.76, 0.11, 0.27}, {1.17, 1.16, 8.91}}},
         {{{-1.82, -0.12, 0.78}, {-1.93, -0.22, -0.54}, {0.69, 1.22, 6.41}}},
         {{{-0.35, -1.44, 0.24}, {-1.12, -0.9, 0.61}, {1.98, 4.88, 4.21}}}}}},
      {5.38032174636108,
       {{{{{1.8, 0.14, 0.35}, {-1.9, -0.15, -0.05}, {1.34, 1.04, 7.09}}},
         {{{0.35, -0.4, -2.48}, {-0.3, 0.4, 1.45}, {1.17, 4.2, 11.07}}},
         {{{1.48, -2.12, 0.74}, {-0.41, -0.87, 1.37}, {2.43, 5.27, 1.84}}}}}},
      {2.38501944099076,
       {{{{{-0.74, -0.12, -2.8}, {-1.2, -0.26, -0.93}, {1.19, 4.67, 5.68}}},
         {{{1.17, -0.2, -2.05}, {0.91, 0.32, -0.72}, {0.78, 5.12, 11.56}}},
         {{{-0.14, 0.16, -2.16}, {-0.49, -0.5, 0.94}, {1.36, 5.68, 4.47}}}}}},
      {3.11937625231923,
       {{{{{0.35, -0.33, -1.47}, {-0.92, 0.23, 1.12}, {0.73, 5.08, 7.29}}},
         {{{0.39, -0.44, -1.43}, {-0.15, -0.28, -2.16}, {2.1, 4.6, 10.09}}},
         {{{1.98, -1.06, 0.04}, {1.38, -0.76, 0.08}, {2.48, 1.17, 3.72}}}}}},
      {4.5296532147764,
       {{{{{1.45, 0.64, 0.3}, {1.69, 0.64, -0.32}, {2.13, 0.77, 1.94}}},
         {{{0.08, -1, -2.69}, {-0.52, -0.76, -1.74}, {2.2, 4.01, 8.64}}},
         {{{1.57, -0.36, -1.74}, {-1.56, -0.33, -0.23}, {0.74, 2.17, 11.71}}}}}},
  };
  for (const Row& row : rows) {
    std::array<StateToState, 3> work;
    std::array<Motion1, 3> ends;
    for (std::size_t j = 0; j < 3; ++j) {
      const auto& [s, e, l] = row.joints[j];
      ends[j] = {e[0], e[1], e[2], 0};
      ASSERT_EQ(work[j].prepare({s[0], s[1], s[2], 0}, ends[j], {l[0], l[1], l[2]}), Fault::none);
    }
    const double T = common_duration(work);
    EXPECT_NEAR(T, row.duration, 1e-9);
    for (std::size_t j = 0; j < 3; ++j) EXPECT_LE(miss(work[j].motion(T), ends[j], T), 1e-9);
  }
}

/// Every time that some structure of switches takes: found by scanning a free number of each
/// structure for the place where the end is met. Knows nothing of the solver's formulas.
class ExhaustiveSearch {
 public:
  explicit ExhaustiveSearch(const Task& t)
      : J_(t.limits.j),
        A_(t.limits.a),
        V_(t.limits.v),
        way_(t.end.x - t.start.x),
        v0_(t.start.v),
        a0_(t.start.a),
        v1_(t.end.v),
        a1_(t.end.a) {}

  double best() {
    // By way of a velocity without acceleration: there directly, on from there directly.
    const auto by_velocity = [&](double v) {
      const Leg in = to_velocity(v0_, a0_, v), out = to_velocity(v1_, -a1_, v);
      return Leg{in.time + out.time, in.way + out.way, true};
    };
    for (const double v : {V_, -V_}) {
      const Leg l = by_velocity(v);
      const double rest = (way_ - l.way) / v;
      if (rest >= 0) best_ = std::min(best_, l.time + rest);
    }
    scan(-V_, V_, by_velocity);
    for (const double sign : {1.0, -1.0}) {
      // Jerk sign, -sign, sign, without and with one hold at a limit; both holds include a = 0.
      scan(-A_, A_, [&](double peak) { return three(sign, peak, -1); });
      scan(-A_, A_, [&](double peak) { return three(sign, peak, 1); });
      scan(-A_, A_, [&](double trough) { return held(sign, trough, false); });
      scan(-A_, A_, [&](double peak) { return held(sign, peak, true); });
    }
    return best_;
  }

 private:
  struct Leg {
    double time = 0, way = 0;
    bool is_possible = false;
  };
  struct Walk {
    double x = 0, v = 0, a = 0, t = 0;
    bool ok = true;
    double V = std::numeric_limits<double>::infinity();
    void go(double dt, double j) {
      ok = ok && dt >= -1e-12;
      if (a * (a + dt * j) < 0) ok = ok && std::fabs(v - a * a / 2 / j) <= V * (1 + 1e-12);
      x += dt * (v + dt * (a / 2 + dt * j / 6)), v += dt * (a + dt * j / 2), a += dt * j, t += dt;
    }
  };
  /// From a state to a velocity at a = 0; the way backwards in time is the same for the end.
  Leg to_velocity(double v, double a, double to) const {
    const double s = to >= v + a * std::fabs(a) / 2 / J_ ? 1 : -1;
    const double peak = std::min(A_, std::sqrt(std::max(0.0, s * (to - v) * J_ + a * a / 2)));
    const double hold =
        std::max(0.0, (s * (to - v) - (2 * peak * peak - a * a) / 2 / J_) / std::max(peak, 1e-300));
    Walk w{0, v, a, 0, true};
    w.go((peak - s * a) / J_, s * J_), w.go(hold, 0), w.go(peak / J_, -s * J_);
    return {w.t, w.x, true};
  }
  Leg run(double sign, double peak, double hold_peak, double trough, double hold_trough) const {
    Walk w{0, v0_, a0_, 0, true, V_};
    w.go((peak - sign * a0_) / J_, sign * J_), w.go(hold_peak, 0);
    w.go((peak - trough) / J_, -sign * J_), w.go(hold_trough, 0);
    w.go((sign * a1_ - trough) / J_, sign * J_);
    return {w.t, w.x, w.ok && std::fabs(w.v - v1_) < 1e-9};
  }
  [[nodiscard]] double change(double sign) const {
    return sign * (v1_ - v0_) * J_ - (a1_ * a1_ - a0_ * a0_) / 2;
  }
  Leg three(double sign, double peak, double side) const {
    const double square = peak * peak - change(sign);
    if (square < 0 || square > A_ * A_) return {};
    return run(sign, peak, 0, side * std::sqrt(square), 0);
  }
  Leg held(double sign, double free, bool is_trough) const {
    const double hold =
        (is_trough ? free * free - A_ * A_ - change(sign) : change(sign) - A_ * A_ + free * free) /
        A_ / J_;
    return is_trough ? run(sign, free, 0, -A_, hold) : run(sign, A_, hold, free, 0);
  }
  template <class Fn>
  void scan(double from, double to, Fn&& fn) {
    constexpr int kSteps = 1000;
    double before = from;
    Leg last = fn(from);
    for (int i = 1; i <= kSteps; ++i) {
      const double at = from + (to - from) * i / kSteps;
      const Leg leg = fn(at);
      // Where the structure begins to be possible, and roots between two places where it is.
      double low = before, high = at;
      Leg at_low = last, at_high = leg;
      if (last.is_possible != leg.is_possible) {
        double in = leg.is_possible ? high : low, out = leg.is_possible ? low : high;
        for (int k = 0; k < 60; ++k) {
          const double middle = (in + out) / 2;
          (fn(middle).is_possible ? in : out) = middle;
        }
        (leg.is_possible ? low : high) = in;
        (leg.is_possible ? at_low : at_high) = fn(in);
      }
      if (at_low.is_possible && at_high.is_possible) {
        const bool is_rising = at_high.way > at_low.way;
        if ((at_low.way - way_) * (at_high.way - way_) <= 0) {
          for (int k = 0; k < 60; ++k) {
            const double middle = (low + high) / 2;
            ((fn(middle).way < way_) == is_rising ? low : high) = middle;
          }
          const Leg found = fn(high);
          if (found.is_possible && std::fabs(found.way - way_) < 1e-8)
            best_ = std::min(best_, found.time);
        }
      }
      before = at;
      last = leg;
    }
  }

  double J_, A_, V_, way_, v0_, a0_, v1_, a1_;
  double best_ = std::numeric_limits<double>::infinity();
};

TEST(StateToState, NoStructureOfSwitchesIsFaster) {
  States states(11);
  int same = 0;
  constexpr int kCount = 1000;
  for (int i = 0; i < kCount; ++i) {
    const Task t = states.next();
    const double T = shortest(t), searched = ExhaustiveSearch(t).best();
    ASSERT_LE(T, searched + 1e-6) << "state " << i << " of seed 11";
    if (std::fabs(T - searched) < 1e-6) ++same;
  }
  // The rest are times that the search's grid steps over.
  EXPECT_GE(same, kCount - 5);
}

TEST(StateToState, EndsAreMetWithinTheLimitsInEveryDuration) {
  States states(12);
  for (int i = 0; i < 3000; ++i) {
    const Task t = states.next();
    StateToState s;
    ASSERT_EQ(s.prepare(t.start, t.end, t.limits), Fault::none);
    const double least = s.next_duration(0);
    for (const double T : {least, s.next_duration(least * 1.01), s.next_duration(2 * least + 1)}) {
      const Ramps r = s.motion(T);
      ASSERT_LE(miss(r, t.end, T), 1e-9) << "state " << i << " of seed 12, T = " << T;
      ASSERT_LE(use(r, t.limits), 1 + 1e-9) << "state " << i << " of seed 12, T = " << T;
      EXPECT_EQ(s.next_duration(T), T);
    }
  }
}

// A start and an end at 1 m/s, 0.1 m apart, with a jerk of 1: far from all limits, the way of a
// time T lies within T -+ T^3 / 32.
TEST(StateToState, MovingStartsHaveBlockedDurations) {
  StateToState s;
  ASSERT_EQ(s.prepare({0, 1, 0, 0}, {0.1, 1, 0, 0}, {50, 50, 1}), Fault::none);
  const auto solve = [](double sign, double low, double high) {
    const auto excess = [&](double T) { return T + sign * T * T * T / 32 - 0.1; };
    const bool is_rising = excess(low) < 0;
    for (int i = 0; i < 80; ++i)
      ((excess((low + high) / 2) < 0) == is_rising ? low : high) = (low + high) / 2;
    return high;
  };
  const double first = solve(1, 0, 1), last = solve(-1, 0, 1), next = solve(-1, 4, 6);
  EXPECT_NEAR(s.next_duration(0), first, 1e-12);
  const double between = (first + last) / 2;
  EXPECT_EQ(s.next_duration(between), between);
  EXPECT_NEAR(s.next_duration(last + 1e-7), next, 1e-9);
  EXPECT_NEAR(s.next_duration(3), next, 1e-9);
  EXPECT_EQ(s.next_duration(7), 7);
}

TEST(StateToState, GoesOnAlongItsOwnWay) {
  States states(13);
  int longer = 0;
  for (int i = 0; i < 2000; ++i) {
    const Task t = states.next();
    StateToState s;
    ASSERT_EQ(s.prepare(t.start, t.end, t.limits), Fault::none);
    const double T = s.next_duration(0);
    const Ramps r = s.motion(T);
    for (int k = 1; k < 10; ++k) {
      Task rest = t;
      rest.start = r.at(T * k / 10);
      const double left = shortest(rest);
      ASSERT_GE(left, T * (10 - k) / 10 - 1e-6);
      if (left > T * (10 - k) / 10 + 1e-6) ++longer;
    }
  }
  EXPECT_LE(longer, 2);
}

TEST(StateToState, StartsOutsideTheLimitsComeBackFirst) {
  States states(14);
  for (int i = 0; i < 2000; ++i) {
    Task t = states.next();
    t.start.v = states.uniform(-2, 2) * t.limits.v;
    t.start.a = states.uniform(-2, 2) * t.limits.a;
    StateToState s;
    ASSERT_EQ(s.prepare(t.start, t.end, t.limits), Fault::none);
    const double T = s.next_duration(0);
    if (T > 200) continue;  // a jerk too small for this start
    const Ramps r = s.motion(T);
    ASSERT_LE(miss(r, t.end, T), 1e-9) << "state " << i << " of seed 14";
    // Once inside it stays inside, and jerk is kept all along.
    double inside = T;
    for (int k = 2000; k >= 0; --k) {
      const Motion1 m = r.at(T * k / 2000);
      ASSERT_LE(std::fabs(m.j), t.limits.j * (1 + 1e-12));
      if (std::fabs(m.v) > t.limits.v * (1 + 1e-9) || std::fabs(m.a) > t.limits.a * (1 + 1e-9))
        break;
      inside = T * k / 2000;
    }
    EXPECT_LT(inside, T) << "state " << i << " of seed 14";
  }
  // 3 m/s with a limit of 1: jerk to -A, on until 1 m/s is met.
  const Task t{{0, 3, 0, 0}, {20, 1, 0, 0}, {1, 2, 4}};
  StateToState s;
  ASSERT_EQ(s.prepare(t.start, t.end, t.limits), Fault::none);
  const Ramps r = s.motion(s.next_duration(0));
  EXPECT_NEAR(r.at(0.5 + 0.75).v, 1, 1e-12);
  EXPECT_NEAR(r.at(0.5 + 0.75).a, -2, 1e-12);
}

TEST(StateToState, EndsOutsideTheLimitsAreFaults) {
  StateToState s;
  const StateLimits l{1, 2, 4};
  EXPECT_EQ(s.prepare({}, {1, 1.1, 0, 0}, l), Fault::end_velocity);
  EXPECT_EQ(s.prepare({}, {1, 0, -2.1, 0}, l), Fault::end_acceleration);
  // 0.9 m/s falling by 2 m/s^2: it was 1.4 m/s when the acceleration was 0.
  EXPECT_EQ(s.prepare({}, {1, 0.9, -2, 0}, l), Fault::end_passed);
  EXPECT_EQ(s.prepare({}, {1, 0.5, -2, 0}, l), Fault::none);
}

}  // namespace
}  // namespace robomosp::spatial
