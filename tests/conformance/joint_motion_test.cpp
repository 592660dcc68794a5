// SPDX-License-Identifier: Apache-2.0
// Joint motions "ptp", "joint_spline", "time_optimal": the SDK's suite, and closed forms.
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
  EXPECT_NE(spline.refusal(t).find("swings out"), std::string::npos) << spline.refusal(t);
}

}  // namespace
}  // namespace robomosp::conformance
