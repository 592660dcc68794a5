// SPDX-License-Identifier: Apache-2.0
// Joint motions "ptp", "joint_spline", "time_optimal": the SDK's suite, and closed forms.
#include <numbers>

#include <robomosp/sdk/conformance/joint_segment_suite.h>

namespace robomosp::conformance {
namespace {

std::string file() { return std::string(ROBOMOSP_PLUGIN_DIR) + "/joint_motion.so"; }

INSTANTIATE_TEST_SUITE_P(
    JointMotion, JointSegmentConformance,
    testing::Values(
        JointSegmentCase{file(), "ptp", {}, false, false, false, true},
        JointSegmentCase{file(), "ptp", {{"joints_arrive", "each"}, {"profile", "s_curve"}}},
        JointSegmentCase{file(), "ptp", {{"profile", "s_curve"}}},
        JointSegmentCase{file(), "ptp", {{"profile", "quintic"}}},
        JointSegmentCase{file(), "joint_spline", {}, true, false, true, true},
        JointSegmentCase{file(), "joint_spline", {{"degree", "5"}}, true, false, true, true},
        JointSegmentCase{file(), "time_optimal", {}, true, true, true, true}));

/// Makes and samples one kind of motion.
class Motion {
 public:
  explicit Motion(const std::string& provider,
                  std::vector<std::pair<std::string, std::string>> params = {}) {
    const auto found = find_provider<JointSegmentFactory>(file(), provider);
    maker_ = create<JointSegmentFactory>(**found);
    params_ = TableParams(**found);
    for (const auto& [name, text] : params) params_.set(name, text);
  }
  Result<std::unique_ptr<JointSegment>> make(const JointMotionTask& t) const {
    return maker_->make(t.dof, t.points, t.limits(), t.ends(), params_);
  }
  double duration(const JointMotionTask& t) const {
    const auto made = make(t);
    EXPECT_TRUE(made.ok()) << made.error().sentence();
    return made.ok() ? (*made)->duration() : NAN;
  }
  std::string refusal(const JointMotionTask& t) const {
    const auto made = make(t);
    return made.ok() ? std::string() : made.error().sentence();
  }

 private:
  std::shared_ptr<JointSegmentFactory> maker_;
  TableParams params_;
};

/// One joint from 0 by `way`.
JointMotionTask one(double way, double v, double a, double j) {
  JointMotionTask t;
  t.dof = 1;
  t.points = {0, way};
  t.velocity = {v}, t.acceleration = {a}, t.jerk = {j};
  return t;
}
struct Row {
  double q, qd, qdd, qddd;
};
Row at(const JointSegment& s, std::size_t dof, std::size_t joint, double t) {
  std::vector<double> q(dof), qd(dof), qdd(dof), qddd(dof);
  EXPECT_TRUE(s.sample({&t, 1}, {q, qd, qdd, qddd}).ok());
  return {q[joint], qd[joint], qdd[joint], qddd[joint]};
}

// L. Biagiotti, C. Melchiorri, Trajectory Planning for Automatic Machines and Robots, Springer
// 2008: section 3.2 (trapezoid), 3.4 (double S, its four cases), 2.1.5 (fifth degree).
TEST(Ptp, TakesTheTimesOfTheTextbook) {
  const Motion trapezoid("ptp"), s_curve("ptp", {{"profile", "s_curve"}}),
      quintic("ptp", {{"profile", "quintic"}});
  EXPECT_NEAR(trapezoid.duration(one(3, 1.5, 2, 1)), 3 / 1.5 + 1.5 / 2, 1e-9);
  EXPECT_NEAR(trapezoid.duration(one(-0.5, 1.5, 2, 1)), 2 * std::sqrt(0.5 / 2), 1e-9);
  EXPECT_NEAR(s_curve.duration(one(-3, 1.5, 2, 8)), 3 / 1.5 + 1.5 / 2 + 2.0 / 8, 1e-9);
  EXPECT_NEAR(s_curve.duration(one(3, 1.5, 9, 8)), 3 / 1.5 + 2 * std::sqrt(1.5 / 8), 1e-9);
  EXPECT_NEAR(s_curve.duration(one(0.1, 9, 9, 8)), 4 * std::cbrt(0.1 / 16), 1e-9);
  EXPECT_NEAR(quintic.duration(one(3, 1.5, 90, 900)), 1.875 * 3 / 1.5, 1e-9);
  EXPECT_NEAR(quintic.duration(one(3, 15, 2, 900)), std::sqrt(10 / std::sqrt(3.0) * 3 / 2), 1e-9);
  EXPECT_NEAR(quintic.duration(one(3, 15, 20, 2)), std::cbrt(60 * 3 / 2.0), 1e-9);
}

TEST(Ptp, TogetherIsAStraightWayAndEachIsNot) {
  JointMotionTask t;
  t.dof = 2;
  t.points = {0, 0, 1, -2, 1.5, -2};
  t.velocity = {1, 1}, t.acceleration = {2, 2}, t.jerk = {50, 50};
  const auto together = Motion("ptp").make(t),
             each = Motion("ptp", {{"joints_arrive", "each"}}).make(t);
  ASSERT_TRUE(together.ok() && each.ok());
  EXPECT_NEAR((*together)->duration(), (2 + 0.5) + 2 * std::sqrt(0.5 / 2), 1e-9);
  EXPECT_NEAR((*each)->duration(), (*together)->duration(), 1e-9);
  for (double x = 0; x < 2.5; x += 0.01)
    ASSERT_NEAR(at(**together, 2, 1, x).q, -2 * at(**together, 2, 0, x).q, 1e-12);
  EXPECT_NEAR(at(**each, 2, 0, 1.5).q, 1, 1e-9) << "the shorter way takes 1 + 0.5 s";
  EXPECT_LT(at(**each, 2, 0, 1.4).q, 1);
  for (const auto* s : {&together, &each}) {
    EXPECT_NEAR(at(***s, 2, 1, 2.5).qd, 0, 1e-9) << "rest in every vector";
    EXPECT_NEAR(at(***s, 2, 1, 2.5).q, -2, 1e-9);
  }
  const auto slow = Motion("ptp", {{"duration", "7"}}).make(t);
  ASSERT_TRUE(slow.ok()) << slow.error().sentence();
  EXPECT_NEAR((*slow)->duration(), 7, 1e-9);
  EXPECT_NEAR(Motion("ptp", {{"speed_share", "0.5"}}).duration(t),
              (2 / 0.5 + 0.5 / 2) + (0.5 / 0.5 + 0.5 / 2), 1e-9);
  EXPECT_NE(Motion("ptp", {{"duration", "2"}}).refusal(t).find("The shortest is 3.5 s"),
            std::string::npos)
      << Motion("ptp", {{"duration", "2"}}).refusal(t);
  t.jerk.clear();
  EXPECT_NE(Motion("ptp", {{"profile", "s_curve"}}).refusal(t).find("joint 1 has no jerk limit"),
            std::string::npos);
  t.jerk.clear();
  EXPECT_TRUE(Motion("ptp", {{"profile", "s_curve"}, {"jerk", "{30}"}}).make(t).ok());
}

// Polynomials of the spline's degree are reproduced, whatever the knots.
TEST(JointSpline, ReproducesPolynomials) {
  const auto p = [](double t) { return 0.3 - t + 0.5 * t * t + 0.25 * t * t * t; };
  const auto v = [](double t) { return -1 + t + 0.75 * t * t; };
  const auto p5 = [p](double t) { return p(t) - 0.2 * std::pow(t, 4) + 0.05 * std::pow(t, 5); };
  const auto v5 = [v](double t) { return v(t) - 0.8 * std::pow(t, 3) + 0.25 * std::pow(t, 4); };
  const auto a5 = [](double t) { return 1 + 1.5 * t - 2.4 * t * t + std::pow(t, 3); };
  const std::vector<double> times{0, 0.4, 1.1, 1.5, 2.2};
  JointMotionTask cubic, quintic;
  cubic.dof = quintic.dof = 1;
  for (const double t : times) cubic.points.push_back(p(t)), quintic.points.push_back(p5(t));
  cubic.v0 = {v(0)}, cubic.v1 = {v(2.2)};
  quintic.v0 = {v5(0)}, quintic.v1 = {v5(2.2)}, quintic.a0 = {a5(0)}, quintic.a1 = {a5(2.2)};
  const std::string at_times = "{0, 0.4, 1.1, 1.5, 2.2}";
  const auto s3 = Motion("joint_spline", {{"times", at_times}}).make(cubic);
  const auto s5 = Motion("joint_spline", {{"times", at_times}, {"degree", "5"}}).make(quintic);
  ASSERT_TRUE(s3.ok()) << s3.error().sentence();
  ASSERT_TRUE(s5.ok()) << s5.error().sentence();
  EXPECT_NEAR((*s3)->duration(), 2.2, 1e-12);
  for (double t = 0; t <= 2.2; t += 0.01) {
    ASSERT_NEAR(at(**s3, 1, 0, t).q, p(t), 1e-11);
    ASSERT_NEAR(at(**s3, 1, 0, t).qd, v(t), 1e-11);
    ASSERT_NEAR(at(**s5, 1, 0, t).q, p5(t), 1e-10);
    ASSERT_NEAR(at(**s5, 1, 0, t).qdd, a5(t), 1e-9);
  }
}

// At given times two vectors may be the same: a clamped cubic through 0, 0, 1 at 0, 1, 2 s has the
// moments -1.5, 3, -4.5 (by hand, from 2 M0 + M1 = 0, M0 + 4 M1 + M2 = 6, M1 + 2 M2 = -6). Without
// times they are a mistake. The rate at the end may be a parameter.
TEST(JointSpline, TimesAllowAPlaceTwiceAndAParameterTellsTheRateAtTheEnd) {
  JointMotionTask t = one(0, 9, 9, 99);
  t.points = {0, 0, 1};
  const auto s = Motion("joint_spline", {{"times", "{0, 1, 2}"}}).make(t);
  ASSERT_TRUE(s.ok()) << s.error().sentence();
  EXPECT_NEAR(at(**s, 1, 0, 1).q, 0, 1e-12);
  EXPECT_NEAR(at(**s, 1, 0, 1).qd, 0.75, 1e-12);
  EXPECT_NEAR(at(**s, 1, 0, 1).qdd, 3, 1e-9);
  EXPECT_NE(Motion("joint_spline").refusal(t).find("are the same"), std::string::npos);
  for (const char* shape : {"joint_spline", "time_optimal"}) {
    const auto m = Motion(shape, {{"end_velocity", "{0.5}"}}).make(one(1, 9, 9, 99));
    ASSERT_TRUE(m.ok()) << m.error().sentence();
    EXPECT_NEAR(at(**m, 1, 0, (*m)->duration()).qd, 0.5, 1e-9) << shape;
  }
  EXPECT_NE(Motion("time_optimal", {{"end_velocity", "{0.5, 1}"}}).refusal(one(1, 9, 9, 99)), "");
}

TEST(JointSpline, NaturalEndsOfTwoVectorsAreStraight) {
  for (const char* degree : {"3", "5"})
    for (const double way : {0.0, 1.5}) {
      JointMotionTask t;
      t.dof = 1;
      t.points = {0.25, 0.25 + way};
      const auto s =
          Motion("joint_spline", {{"times", "{0, 2}"}, {"ends", "natural"}, {"degree", degree}})
              .make(t);
      ASSERT_TRUE(s.ok()) << s.error().sentence();
      for (double x = 0; x <= 2; x += 0.25)
        EXPECT_NEAR(at(**s, 1, 0, x).q, 0.25 + way * x / 2, 1e-14) << degree;
    }
}

// Natural cubic through 0, 1, 0 at 0, 1, 2 s: the moments are 0, -3, 0 (by hand, from
// M0 + 4 M1 + M2 = 6 (y0 - 2 y1 + y2)), q = 1.5 t - 0.5 t^3 in the first second.
TEST(JointSpline, NaturalEndsAreFree) {
  JointMotionTask t;
  t.dof = 1;
  t.points = {0, 1, 0};
  const auto s = Motion("joint_spline", {{"times", "{0, 1, 2}"}, {"ends", "natural"}}).make(t);
  ASSERT_TRUE(s.ok()) << s.error().sentence();
  for (double x = 0; x <= 1; x += 0.125) {
    EXPECT_NEAR(at(**s, 1, 0, x).q, 1.5 * x - 0.5 * x * x * x, 1e-12);
    EXPECT_NEAR(at(**s, 1, 0, 2 - x).qd, -1.5 + 1.5 * x * x, 1e-12);
  }
  // Fifth degree: third and fourth derivatives are continuous, and zero at the ends.
  t.points = {0, 1, 0.3, -0.4, 2};
  const auto q =
      Motion("joint_spline", {{"times", "{0, 1, 1.5, 3, 4}"}, {"ends", "natural"}, {"degree", "5"}})
          .make(t);
  ASSERT_TRUE(q.ok()) << q.error().sentence();
  const double h = 1e-4;
  const auto jerk = [&](double x) { return at(**q, 1, 0, x).qddd; };
  for (const double k : {1.0, 1.5, 3.0}) {
    EXPECT_NEAR(jerk(k - 1e-12), jerk(k), 1e-8);
    EXPECT_NEAR((jerk(k) - jerk(k - h)) / h, (jerk(k + h) - jerk(k)) / h, 1);
    EXPECT_NEAR((2 * jerk(k - h / 2) - jerk(k - h) - jerk(k)) / (h * h / -4),
                (4 * jerk(k - h / 2) - 2 * jerk(k - h) - 2 * jerk(k)) / (h * h / -2), 1);
  }
  EXPECT_NEAR(jerk(0), 0, 1e-9);
  EXPECT_NEAR(jerk(4), 0, 1e-8);
  EXPECT_NEAR((jerk(h) - jerk(0)) / h, 0, 0.1);
}

/// A spline by its definition: all coefficients of all pieces from one full system of equations,
/// with the end conditions as they are written in textbooks.
class FullSystem {
 public:
  FullSystem(int degree, std::vector<double> times, const std::vector<double>& values,
             const std::string& ends)
      : p_(degree), times_(std::move(times)) {
    const int n = pieces();
    for (int i = 0; i < n; ++i) {
      add({{i, 0, 0.0L, 1}}, values[static_cast<std::size_t>(i)]);
      add({{i, 0, length(i), 1}}, values[static_cast<std::size_t>(i) + 1]);
      for (int k = 1; i + 1 < n && k < p_; ++k)
        add({{i, k, length(i), 1}, {i + 1, k, 0.0L, -1}}, 0);
    }
    if (ends == "periodic")
      for (int k = 1; k < p_; ++k) add({{n - 1, k, length(n - 1), 1}, {0, k, 0.0L, -1}}, 0);
    for (int i = 0; ends == "not_a_knot" && i < (p_ - 1) / 2; ++i) {
      add({{i, p_, length(i), 1}, {i + 1, p_, 0.0L, -1}}, 0);
      add({{n - 2 - i, p_, length(n - 2 - i), 1}, {n - 1 - i, p_, 0.0L, -1}}, 0);
    }
    solve();
  }
  [[nodiscard]] double at(double t, int order) const {
    int i = 0;
    while (i + 1 < pieces() && t >= times_[static_cast<std::size_t>(i) + 1]) ++i;
    long double sum = 0;
    for (int k = 0; k <= p_; ++k)
      sum += rows_[static_cast<std::size_t>(i * (p_ + 1) + k)].back() *
             basis(k, order, t - times_[static_cast<std::size_t>(i)]);
    return static_cast<double>(sum);
  }

 private:
  struct Term {
    int piece, order;
    long double at;
    int sign;
  };
  [[nodiscard]] int pieces() const { return static_cast<int>(times_.size()) - 1; }
  [[nodiscard]] long double length(int i) const {
    return times_[static_cast<std::size_t>(i) + 1] - times_[static_cast<std::size_t>(i)];
  }
  static long double basis(int k, int order, long double t) {
    if (order > k) return 0;
    long double x = 1;
    for (int i = 0; i < order; ++i) x *= k - i;
    return x * std::pow(t, static_cast<long double>(k - order));
  }
  void add(const std::vector<Term>& terms, double side) {
    std::vector<long double> row(static_cast<std::size_t>(pieces() * (p_ + 1)) + 1, 0);
    for (const Term& term : terms)
      for (int k = 0; k <= p_; ++k)
        row[static_cast<std::size_t>(term.piece * (p_ + 1) + k)] +=
            term.sign * basis(k, term.order, term.at);
    row.back() = side;
    rows_.push_back(std::move(row));
  }
  void solve() {
    const std::size_t n = rows_.size();
    ASSERT_EQ(n + 1, rows_[0].size());
    for (std::size_t k = 0; k < n; ++k) {
      std::size_t best = k;
      for (std::size_t i = k; i < n; ++i)
        if (std::fabs(rows_[i][k]) > std::fabs(rows_[best][k])) best = i;
      std::swap(rows_[k], rows_[best]);
      const long double pivot = rows_[k][k];
      for (long double& x : rows_[k]) x /= pivot;
      for (std::size_t i = 0; i < n; ++i) {
        const long double f = rows_[i][k];
        for (std::size_t c = k; i != k && f != 0 && c <= n; ++c) rows_[i][c] -= f * rows_[k][c];
      }
    }
  }

  int p_;
  std::vector<double> times_;
  std::vector<std::vector<long double>> rows_;
};

TEST(JointSpline, NotAKnotAndPeriodicEndsAreTheSplinesOfTheirDefinitions) {
  const std::vector<double> times{0, 0.4, 1.1, 1.5, 2.2, 2.9, 3.1, 4};
  const std::vector<double> a{0.2, 1, -0.4, 0.3, 0.9, 1.4, -0.2, 0.2},
      b{-1, 0.4, 0.8, 0.1, -0.7, 0.2, 0.6, -1};
  JointMotionTask t;
  t.dof = 2;
  for (std::size_t i = 0; i < a.size(); ++i) t.points.insert(t.points.end(), {a[i], b[i]});
  for (const std::string ends : {"not_a_knot", "periodic"})
    for (const std::string degree : {"3", "5"}) {
      const auto s = Motion("joint_spline", {{"times", "{0, 0.4, 1.1, 1.5, 2.2, 2.9, 3.1, 4}"},
                                             {"ends", ends},
                                             {"degree", degree}})
                         .make(t);
      ASSERT_TRUE(s.ok()) << s.error().sentence();
      for (std::size_t j = 0; j < 2; ++j) {
        const FullSystem expected(degree == "3" ? 3 : 5, times, j == 0 ? a : b, ends);
        for (double x = 0; x < 4; x += 0.03) {
          const Row row = at(**s, 2, j, x);
          ASSERT_NEAR(row.q, expected.at(x, 0), 1e-10) << ends << degree << " at " << x;
          ASSERT_NEAR(row.qd, expected.at(x, 1), 1e-9) << ends << degree << " at " << x;
          ASSERT_NEAR(row.qdd, expected.at(x, 2), 1e-8) << ends << degree << " at " << x;
          ASSERT_NEAR(row.qddd, expected.at(x, 3), 1e-6) << ends << degree << " at " << x;
        }
        if (ends != "periodic") continue;
        const Row first = at(**s, 2, j, 0), last = at(**s, 2, j, 4);
        EXPECT_NEAR(first.qd, last.qd, 1e-10);
        EXPECT_NEAR(first.qdd, last.qdd, 1e-9);
        EXPECT_GT(std::fabs(first.qd), 0.1) << "it goes on as it began";
      }
    }
}

// A polynomial of the spline's degree is its own not-a-knot spline, and a turn of a circle is met
// the better the more joint vectors there are.
TEST(JointSpline, NotAKnotReproducesPolynomialsAndPeriodicFollowsACircle) {
  const auto p = [](double t) { return 0.3 - t + 0.5 * t * t + 0.25 * t * t * t; };
  const auto p5 = [p](double t) { return p(t) - 0.2 * std::pow(t, 4) + 0.05 * std::pow(t, 5); };
  JointMotionTask cubic, quintic;
  cubic.dof = quintic.dof = 1;
  const std::vector<double> times{0, 0.3, 0.7, 1.2, 1.6, 2};
  for (const double t : times) quintic.points.push_back(p5(t));
  for (std::size_t i = 0; i < 4; ++i) cubic.points.push_back(p(times[i]));
  const auto s3 =
      Motion("joint_spline", {{"times", "{0, 0.3, 0.7, 1.2}"}, {"ends", "not_a_knot"}}).make(cubic);
  const auto s5 =
      Motion("joint_spline",
             {{"times", "{0, 0.3, 0.7, 1.2, 1.6, 2}"}, {"ends", "not_a_knot"}, {"degree", "5"}})
          .make(quintic);
  ASSERT_TRUE(s3.ok()) << s3.error().sentence();
  ASSERT_TRUE(s5.ok()) << s5.error().sentence();
  for (double x = 0; x <= 1.2; x += 0.01) ASSERT_NEAR(at(**s3, 1, 0, x).q, p(x), 1e-12);
  for (double x = 0; x <= 2; x += 0.01) ASSERT_NEAR(at(**s5, 1, 0, x).q, p5(x), 1e-11);
  double before = 1;
  for (const int n : {8, 16, 32}) {
    JointMotionTask t;
    t.dof = 1;
    std::string at_times = "{";
    for (int i = 0; i <= n; ++i) {
      t.points.push_back(i == n ? 0.0 : std::sin(2 * std::numbers::pi * i / n));
      at_times += (i ? ", " : "") + std::to_string(i);
    }
    const auto s =
        Motion("joint_spline", {{"times", at_times + "}"}, {"ends", "periodic"}}).make(t);
    ASSERT_TRUE(s.ok()) << s.error().sentence();
    double worst = 0;
    for (double x = 0; x <= n; x += 0.05)
      worst =
          std::max(worst, std::fabs(at(**s, 1, 0, x).q - std::sin(2 * std::numbers::pi * x / n)));
    EXPECT_LT(worst, before / 10) << n;  // by 16 for cubics
    before = worst;
  }
}

TEST(JointSpline, EndsThatContradictWhatIsGivenAreRefused) {
  JointMotionTask t;
  t.dof = 1;
  t.points = {0, 1, 0.5, 2};
  t.velocity = {9}, t.acceleration = {99}, t.jerk = {999};
  const auto refusal = [&](std::vector<std::pair<std::string, std::string>> params) {
    return Motion("joint_spline", std::move(params)).refusal(t);
  };
  const auto has = [](const std::string& text, const char* part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  has(refusal({{"ends", "periodic"}}), "joint 1 ends 2 away from its start");
  has(refusal({{"ends", "not_a_knot"}, {"degree", "5"}}),
      "needs 6 joint vectors of a quintic spline, but there are 4");
  for (const char* ends : {"natural", "not_a_knot"})
    has(refusal({{"ends", ends}, {"end_velocity", "{1}"}}),
        "determines the rates there, but joint 1 has one");
  t.v0 = {0.5};
  has(refusal({{"ends", "not_a_knot"}}), "determines the rates there");
  t.v0 = {};
  t.points = {0, 1};
  has(refusal({{"ends", "periodic"}}), "needs 3 joint vectors");
  // As fast as the limits allow, and no faster.
  t.points = {0, 1, 0.5, 0};
  for (const char* ends : {"not_a_knot", "periodic"}) {
    const auto s = Motion("joint_spline", {{"ends", ends}}).make(t);
    ASSERT_TRUE(s.ok()) << s.error().sentence();
    double v = 0, a = 0, j = 0;
    for (double x = 0; x <= (*s)->duration(); x += 1e-3) {
      const Row r = at(**s, 1, 0, x);
      v = std::max(v, std::fabs(r.qd) / 9), a = std::max(a, std::fabs(r.qdd) / 99);
      j = std::max(j, std::fabs(r.qddd) / 999);
    }
    EXPECT_LE(std::max({v, a, j}), 1 + 1e-6) << ends;
    EXPECT_GT(std::max({v, a, j}), 0.99) << ends;
  }
}

// A cubic from rest to rest needs 1.5 d / T, 6 d / T^2, 12 d / T^3.
TEST(JointSpline, FastestTimesUseTheLimitsToTheFull) {
  const Motion spline("joint_spline");
  EXPECT_NEAR(spline.duration(one(2, 1, 90, 900)), 3, 1e-9);
  EXPECT_NEAR(spline.duration(one(2, 10, 3, 900)), 2, 1e-9);
  EXPECT_NEAR(spline.duration(one(2, 10, 90, 3)), 2, 1e-9);
  std::mt19937 random(3);
  JointMotionTask t = JointMotionTask::random(random, 4);
  for (int i = 0; i < 3; ++i) {
    const auto more = JointMotionTask::random(random, 4);
    t.points.insert(t.points.end(), more.points.begin(), more.points.end());
  }
  // Slower than the fastest with times in proportion to the distances, at the same limits.
  std::string even = "{0";
  double at_time = 0, used = 0;
  for (std::size_t i = 1; i < t.points.size() / 4; ++i) {
    double longest = 0;
    for (std::size_t j = 0; j < 4; ++j)
      longest = std::max(longest,
                         std::fabs(t.points[4 * i + j] - t.points[4 * i - 4 + j]) / t.velocity[j]);
    at_time += longest;
    even += ", " + std::to_string(at_time);
  }
  JointMotionTask free = t;
  free.velocity.clear(), free.acceleration.clear(), free.jerk.clear();
  const auto plain = Motion("joint_spline", {{"times", even + "}"}}).make(free);
  const auto fastest = spline.make(t);
  ASSERT_TRUE(plain.ok() && fastest.ok());
  double stretch = 0;
  for (const auto* s : {&plain, &fastest})
    for (int i = 0; i <= 4000; ++i)
      for (std::size_t j = 0; j < 4; ++j) {
        const Row r = at(***s, 4, j, (**s)->duration() * i / 4000);
        const double v = std::fabs(r.qd) / t.velocity[j], a = std::fabs(r.qdd) / t.acceleration[j],
                     k = std::fabs(r.qddd) / t.jerk[j];
        if (s == &plain) stretch = std::max({stretch, v, std::sqrt(a), std::cbrt(k)});
        else used = std::max({used, v, a, k});
      }
  EXPECT_LE(used, 1 + 1e-9);
  EXPECT_GE(used, 0.99);
  EXPECT_LT((*fastest)->duration(), 0.97 * stretch * (*plain)->duration());
  const std::string slow = Motion("joint_spline", {{"times", even + "}"}}).refusal(t);
  EXPECT_NE(slow.find("limit"), std::string::npos) << slow;
  t.upper.assign(4, 2), t.lower.assign(4, -2);
  EXPECT_NE(spline.refusal(t).find("overshoots"), std::string::npos) << spline.refusal(t);
}

}  // namespace
}  // namespace robomosp::conformance
