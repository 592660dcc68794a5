// SPDX-License-Identifier: Apache-2.0
// Splines and Bezier curves: the SDK's suite of segments, published and exact values, and the error
// sentences.
#include <robomosp/sdk/conformance/curve_suite.h>

#include "support/segments.h"

namespace robomosp::conformance {
namespace {

using Record = model::TrajectorySegment;
using Numbers = std::vector<double>;

const Registry& registry() {
  static const Registry& r = registry_with({"path_splines", "path_analytic"});
  return r;
}

const std::vector<Pose>& zigzag() {
  static const std::vector<Pose> points{shift(0, 0, 0), multiply(shift(0.3, 0.2, 0.1), turn_z(0.7)),
                                        multiply(shift(0.5, -0.1, 0.2), turn_x(0.4)),
                                        multiply(shift(0.9, 0.3, 0), turn_y(1))};
  return points;
}

std::vector<SegmentCase> cases() {
  std::vector<SegmentCase> all;
  const auto add = [&](const std::string& shape, const std::string& name, auto&& fill,
                       double speed = 0, bool passes = true) {
    all.push_back(record_case(registry(), shape, name, zigzag(), fill));
    all.back().constant_speed = speed;
    all.back().passes_all_points = passes;
    all.back().is_made_by_points = name != "clamped" && name != "timed";
  };
  for (const char* shape : {"cubic_spline", "quartic_spline", "quintic_spline"}) {
    add(
        shape, "by_length",
        [](Record& r) {
          r.orientation.name = "squad";
          r.shape.params = {{"speed", 0.2}, {"angular_speed", 50.0}};
        },
        0.2);
    add(shape, "timed", [](Record& r) {
      r.orientation.name = "squad";
      r.shape.params = {{"times", Numbers{0, 1.03, 1.57, 3}}};
    });
    add(shape, "clamped", [](Record& r) {
      r.orientation.name = "squad";
      r.shape.params = {{"times", Numbers{1, 2.03, 3.52, 4}},
                        {"ends", std::string("clamped")},
                        {"start_velocity", Numbers{0.1, 0, 0}},
                        {"end_velocity", Numbers{0, 0, 0.2}}};
    });
    add(shape, "s_curve", [](Record& r) {
      r.law.name = "s_curve";
      r.shape.params = {{"spacing", std::string("centripetal")}};
    });
  }
  add(
      "b_spline", "by_length",
      [](Record& r) {
        r.shape.params = {{"speed", 0.2}, {"angular_speed", 50.0}};
      },
      0.2, false);
  add(
      "bezier", "by_length",
      [](Record& r) {
        r.shape.params = {{"speed", 0.2}, {"angular_speed", 50.0}};
      },
      0.2, false);
  add(
      "bezier", "timed",
      [](Record& r) {
        r.shape.params = {{"duration", 2.5},
                          {"start_velocity", Numbers{0.1, 0, 0.3}},
                          {"end_velocity", Numbers{0, 0.2, 0}}};
      },
      0, false);
  add(
      "teach_points", "rounded",
      [](Record& r) {
        r.shape.params = {{"rounding", 0.1}, {"speed", 0.2}, {"angular_speed", 50.0}};
      },
      0.2, false);
  return all;
}
INSTANTIATE_TEST_SUITE_P(Splines, SegmentConformance, testing::ValuesIn(cases()),
                         segment_case_name);

// The curves by themselves.
std::vector<CurveCase> curve_cases() {
  const std::string file = std::string(ROBOMOSP_PLUGIN_DIR) + "/path_splines.so";
  std::vector<CurveCase> all;
  for (const char* shape : {"cubic_spline", "quartic_spline", "quintic_spline"}) {
    all.push_back({file, shape, "chord", zigzag()});
    all.push_back({file, shape, "centripetal", zigzag(), {{"spacing", "centripetal"}}});
    all.push_back({file,
                   shape,
                   "timed",
                   zigzag(),
                   {{"times", "{0, 1.03, 1.57, 3}"},
                    {"ends", "clamped"},
                    {"start_velocity", "{0.1, 0, 0}"},
                    {"end_velocity", "{0, 0, 0.2}"}}});
  }
  all.push_back({file, "b_spline", "cubic", zigzag(), {}, false});
  all.push_back({file, "b_spline", "quadratic", zigzag(), {{"degree", "2"}}, false});
  all.push_back({file, "bezier", "cubic", zigzag(), {}, false});
  all.push_back({file,
                 "bezier",
                 "timed",
                 zigzag(),
                 {{"duration", "2.5"}, {"start_velocity", "{0.1, 0, 0.3}"}},
                 false});
  all.push_back({file, "teach_points", "rounded", zigzag(), {{"rounding", "0.1"}}, false});
  return all;
}
INSTANTIATE_TEST_SUITE_P(Splines, CurveConformance, testing::ValuesIn(curve_cases()),
                         curve_case_name);

Result<std::shared_ptr<const Segment>> make(const Record& r) {
  return motion::make_segment(registry(), r, "it");
}

// R. L. Burden, J. D. Faires, Numerical Analysis, 9th ed., section 3.5, example 2: the natural
// cubic spline through (0, 1), (1, e), (2, e^2), (3, e^3).
TEST(CubicSpline, IsThatOfBurdenAndFaires) {
  const double e = std::exp(1.0);
  Record r = record_of(
      "cubic_spline", {shift(0, 1, 0), shift(0, e, 0), shift(0, e * e, 0), shift(0, e * e * e, 0)});
  r.shape.params = {{"times", Numbers{0, 1, 2, 3}}};
  const auto made = make(r);
  ASSERT_TRUE(made.ok()) << made.error().sentence();
  const double pieces[3][4] = {{1, 1.46600, 0, 0.25228},
                               {2.71828, 2.22285, 0.75685, 1.69107},
                               {7.38906, 8.80977, 5.83007, -1.94336}};
  // Printed to five digits there; exactly, with m the second derivatives at the inner knots:
  // 4 m1 + m2 = 6 (e - 1)^2, m1 + 4 m2 = 6 e (e - 1)^2.
  const double y[4] = {1, e, e * e, e * e * e},
               m[4] = {0, 6 * (e - 1) * (e - 1) * (4 - e) / 15,
                       6 * (e - 1) * (e - 1) * (4 * e - 1) / 15, 0};
  for (int k = 0; k < 3; ++k)
    for (const double x : {0.1, 0.5, 0.9}) {
      const double* c = pieces[k];
      const PathSample s = sample_at(**made, k + x);
      EXPECT_NEAR(s.pose.p[1], c[0] + x * (c[1] + x * (c[2] + x * c[3])), 2e-5);
      EXPECT_NEAR(s.velocity[1], c[1] + x * (2 * c[2] + x * 3 * c[3]), 5e-5);
      EXPECT_NEAR(s.acceleration[1], 2 * c[2] + 6 * x * c[3], 8e-5);
      const double slope = y[k + 1] - y[k] - (2 * m[k] + m[k + 1]) / 6;
      EXPECT_NEAR(s.pose.p[1], y[k] + x * (slope + x * (m[k] / 2 + x * (m[k + 1] - m[k]) / 6)),
                  1e-12);
      EXPECT_NEAR(s.acceleration[1], m[k] + x * (m[k + 1] - m[k]), 1e-11);
    }
}

// A spline of degree n through points of a polynomial of degree n, with its derivatives at the
// ends, is that polynomial.
TEST(Splines, ReproducePolynomialsOfTheirDegree) {
  const Numbers times{0, 0.4, 1.1, 1.5, 2.3};
  const auto f = [](int degree, double t, int order) {
    const double c[6] = {0.2, -0.1, 0.7, -0.5, 0.3, 0.11};
    double sum = 0;
    for (int k = order; k <= degree; ++k) {
      double term = c[k];
      for (int i = 0; i < order; ++i) term *= k - i;
      sum += term * std::pow(t, k - order);
    }
    return sum;
  };
  const std::pair<const char*, int> shapes[] = {
      {"cubic_spline", 3}, {"quartic_spline", 4}, {"quintic_spline", 5}};
  for (const auto& [shape, degree] : shapes) {
    SCOPED_TRACE(shape);
    // Quartic splines start without acceleration: their polynomial has none there.
    const auto g = [&, n = degree](double t, int order) {
      return f(n, t, order) - (n == 4 ? 0.7 * (order == 0 ? t * t : order == 1 ? 2 * t : 2) : 0);
    };
    std::vector<Pose> points;
    for (const double t : times) points.push_back(shift(g(t, 0), 1 - 2 * g(t, 0), t));
    Record r = record_of(shape, points);
    r.shape.params = {{"times", times},
                      {"ends", std::string("clamped")},
                      {"start_velocity", Numbers{g(0, 1), -2 * g(0, 1), 1}},
                      {"end_velocity", Numbers{g(2.3, 1), -2 * g(2.3, 1), 1}}};
    if (degree == 5) {
      r.shape.params["start_acceleration"] = Numbers{g(0, 2), -2 * g(0, 2), 0};
      r.shape.params["end_acceleration"] = Numbers{g(2.3, 2), -2 * g(2.3, 2), 0};
    }
    const auto made = make(r);
    ASSERT_TRUE(made.ok()) << made.error().sentence();
    EXPECT_NEAR((*made)->duration(), 2.3, 1e-12);
    for (double t = 0; t <= 2.3; t += 0.07) {
      const PathSample s = sample_at(**made, t);
      EXPECT_NEAR(s.pose.p[0], g(t, 0), 1e-9);
      EXPECT_NEAR(s.pose.p[1], 1 - 2 * g(t, 0), 1e-9);
      EXPECT_NEAR(s.velocity[0], g(t, 1), 1e-9);
      EXPECT_NEAR(s.acceleration[0], g(t, 2), 1e-8);
    }
  }
}

// B(t) = (1-t)^3 p0 + 3 (1-t)^2 t p1 + 3 (1-t) t^2 p2 + t^3 p3, with the time T t.
TEST(Bezier, OfThirdDegreeIsTheBernsteinSum) {
  Record r = record_of("bezier", zigzag());
  r.shape.params = {{"duration", 4.0}};
  const auto made = make(r);
  ASSERT_TRUE(made.ok()) << made.error().sentence();
  for (int i = 0; i <= 10; ++i) {
    const double t = 0.1 * i, u = 1 - t;
    const PathSample s = sample_at(**made, 4 * t);
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_NEAR(s.pose.p[k],
                  u * u * u * zigzag()[0].p[k] + 3 * u * u * t * zigzag()[1].p[k] +
                      3 * u * t * t * zigzag()[2].p[k] + t * t * t * zigzag()[3].p[k],
                  1e-14);
  }
  r.shape.params["start_velocity"] = Numbers{0.1, 0.2, 0.3};
  r.shape.params["end_velocity"] = Numbers{-0.1, 0, 0.4};
  const auto moving = make(r);
  ASSERT_TRUE(moving.ok()) << moving.error().sentence();
  EXPECT_NEAR(sample_at(**moving, 0).velocity[2], 0.3, 1e-12);
  EXPECT_NEAR(sample_at(**moving, 4).velocity[0], -0.1, 1e-12);
  // Of degree 5 then, with p0 + v0 T / 5 and p3 - v1 T / 5 beside the ends.
  const double binomial[6] = {1, 5, 10, 10, 5, 1}, v0[3] = {0.1, 0.2, 0.3}, v1[3] = {-0.1, 0, 0.4};
  for (int i = 0; i <= 10; ++i) {
    const double t = 0.1 * i;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto p = [&](std::size_t n) { return zigzag()[n].p[k]; };
      const double control[6] = {p(0), p(0) + v0[k] * 4 / 5, p(1),
                                 p(2), p(3) - v1[k] * 4 / 5, p(3)};
      double sum = 0;
      for (int n = 0; n < 6; ++n)
        sum += binomial[n] * std::pow(1 - t, 5 - n) * std::pow(t, n) * control[n];
      EXPECT_NEAR(sample_at(**moving, 4 * t).pose.p[k], sum, 1e-12);
    }
  }
}

// Natural splines of three points by hand: the second derivative in the middle is
// 3 (slope2 - slope1) / (h1 + h2), none at the ends.
TEST(CubicSpline, OfThreePointsHasItsClosedForm) {
  const double h1 = 0.7, h2 = 1.9, y0 = 0.3, y1 = -0.4, y2 = 0.9;
  Record r = record_of("cubic_spline", {shift(y0, 0, 0), shift(y1, 1, 0), shift(y2, 2, 0)});
  r.shape.params = {{"times", Numbers{0, h1, h1 + h2}}};
  const auto made = make(r);
  ASSERT_TRUE(made.ok()) << made.error().sentence();
  const double m = 3 * ((y2 - y1) / h2 - (y1 - y0) / h1) / (h1 + h2);
  for (int i = 0; i <= 20; ++i) {
    const double b = i / 20.0, a = 1 - b;
    EXPECT_NEAR(sample_at(**made, b * h1).pose.p[0],
                a * y0 + b * y1 + (b * b * b - b) * m * h1 * h1 / 6, 1e-12);
    EXPECT_NEAR(sample_at(**made, h1 + b * h2).pose.p[0],
                a * y1 + b * y2 + (a * a * a - a) * m * h2 * h2 / 6, 1e-12);
  }
}

// The corner of a right angle cut at d: the path keeps to the straight parts outside, stays within
// the corner's triangle, and its curvature starts from none.
TEST(TeachPoints, KeepToTheLinesOutsideTheirCorners) {
  Record r = record_of("teach_points", {shift(0, 0, 0), shift(1, 0, 0), shift(1, 1, 0)});
  r.shape.params = {{"rounding", 0.2}, {"speed", 0.1}};
  const auto made = make(r);
  ASSERT_TRUE(made.ok()) << made.error().sentence();
  const double T = (*made)->duration();
  EXPECT_LT((*made)->length(), 2);
  EXPECT_GT((*made)->length(), 1.6 + 0.2 * std::sqrt(2.0));
  for (int i = 0; i <= 400; ++i) {
    const Vec3 p = sample_at(**made, T * i / 400).pose.p;
    EXPECT_NEAR(p[0] < 0.8 ? p[1] : 0, 0, 1e-12);
    EXPECT_NEAR(p[1] > 0.2 ? p[0] : 1, 1, 1e-12);
    EXPECT_LE(p[0], 1 + 1e-12);
    if (p[0] > 0.8 && p[1] < 0.2) {
      EXPECT_LE(p[1], p[0] - 0.8 + 1e-12);
    }
  }
}

// What is given at an end holds without a word about ends; the other end stays free.
TEST(Splines, AreClampedWhereSomethingIsGiven) {
  for (const char* shape : {"cubic_spline", "quartic_spline", "quintic_spline"})
    for (const bool at_start : {true, false}) {
      SCOPED_TRACE(std::string(shape) + (at_start ? " at the start" : " at the end"));
      Record r = record_of(shape, zigzag());
      r.shape.params = {{"times", Numbers{0, 1, 2.5, 4}},
                        {at_start ? "start_velocity" : "end_velocity", Numbers{0.3, -0.2, 0.7}}};
      const auto made = make(r);
      ASSERT_TRUE(made.ok()) << made.error().sentence();
      const auto here = sample_at(**made, at_start ? 0 : 4);
      const Vec3 v{0.3, -0.2, 0.7};
      for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(here.velocity[k], v[k], 1e-12) << k;
      // Of degree 3 and 4 a free end has no acceleration.
      if (shape == std::string("quintic_spline")) continue;
      const auto there = sample_at(**made, at_start ? 4 : 0);
      for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(there.acceleration[k], 0, 1e-11) << k;
    }
  Record r = record_of("quintic_spline", zigzag());
  r.shape.params = {{"times", Numbers{0, 1, 2.5, 4}}, {"end_acceleration", Numbers{1, 2, 3}}};
  const auto made = make(r);
  ASSERT_TRUE(made.ok()) << made.error().sentence();
  for (std::size_t k = 0; k < 3; ++k)
    EXPECT_NEAR(sample_at(**made, 4).acceleration[k], static_cast<double>(k) + 1, 1e-11);
}

// Points of a polynomial of the spline's degree give that polynomial where nothing says otherwise.
TEST(Splines, NotAKnotGivesThePolynomialThatThePointsAreOf) {
  const Numbers times{0, 0.4, 1.1, 1.5, 2.3, 3, 3.2};
  int degree = 3;
  for (const char* shape : {"cubic_spline", "quartic_spline", "quintic_spline"}) {
    SCOPED_TRACE(shape);
    const auto polynomial = [&](double t) {
      double x = 0;
      for (int k = degree; k >= 0; --k) x = x * t + (k % 2 ? 0.3 : -0.2) * (k + 1);
      return x;
    };
    std::vector<Pose> points;
    for (const double t : times) points.push_back(shift(polynomial(t), t, 0));
    Record r = record_of(shape, points);
    r.shape.params = {{"times", times}, {"ends", std::string("not_a_knot")}};
    const auto made = make(r);
    ASSERT_TRUE(made.ok()) << made.error().sentence();
    for (int i = 0; i <= 64; ++i) {
      const double t = 0.05 * i;
      EXPECT_NEAR(sample_at(**made, t).pose.p[0], polynomial(t),
                  1e-11 * (1 + std::fabs(polynomial(t))))
          << t;
    }
    ++degree;
  }
}

// Closed through points of a circle: the same velocity and curvature at both ends, wherever the
// circle is begun.
TEST(Splines, PeriodicOnesCloseWithoutAJumpAndHaveNoFirstPoint) {
  for (const char* shape : {"cubic_spline", "quintic_spline"})
    for (const int count : {3, 4, 7, 12}) {
      SCOPED_TRACE(std::string(shape) + " of " + std::to_string(count));
      const auto closed = [&](int first) {
        std::vector<Pose> points;
        Numbers times;
        for (int i = 0; i <= count; ++i) {
          const double a = 2 * kPi * (i + first) / count;
          points.push_back(shift(std::cos(a), std::sin(a), 0));
          times.push_back(0.5 * i);
        }
        points.back() = points.front();
        Record r = record_of(shape, points);
        r.shape.params = {{"times", times}, {"ends", std::string("periodic")}};
        return r;
      };
      const auto made = make(closed(0)), turned = make(closed(1));
      ASSERT_TRUE(made.ok()) << made.error().sentence();
      ASSERT_TRUE(turned.ok()) << turned.error().sentence();
      const double T = 0.5 * count;
      const auto a = sample_at(**made, 0), b = sample_at(**made, T);
      for (std::size_t k = 0; k < 3; ++k) {
        EXPECT_NEAR(a.velocity[k], b.velocity[k], 1e-11);
        EXPECT_NEAR(a.acceleration[k], b.acceleration[k], 1e-10);
      }
      for (int i = 0; i <= 40; ++i) {
        const double t = T * i / 40, later = t + 0.5 > T ? t + 0.5 - T : t + 0.5;
        const Vec3 p = sample_at(**turned, t).pose.p, q = sample_at(**made, later).pose.p;
        for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(p[k], q[k], 1e-11) << t;
      }
    }
}

// Two points leave a free spline straight, and one place twice a wait there.
TEST(Splines, OfTwoPointsAreStraightAndOfOnePlaceTwiceAWait) {
  for (const char* shape : {"cubic_spline", "quartic_spline", "quintic_spline"})
    for (const double way : {0.0, 0.6}) {
      SCOPED_TRACE(std::string(shape) + " over " + std::to_string(way));
      Record r = record_of(shape, {shift(0.1, 0.2, 0.3), shift(0.1 + way, 0.2, 0.3)});
      r.shape.params = {{"times", Numbers{0, 2}}};
      const auto made = make(r);
      ASSERT_TRUE(made.ok()) << made.error().sentence();
      EXPECT_NEAR((*made)->duration(), 2, 1e-15);
      for (int i = 0; i <= 10; ++i) {
        const auto s = sample_at(**made, 0.2 * i);
        EXPECT_NEAR(s.pose.p[0], 0.1 + way * i / 10, 1e-14);
        EXPECT_NEAR(s.pose.p[1], 0.2, 1e-15);
        EXPECT_NEAR(s.velocity[0], way / 2, 1e-13);
      }
    }
}

TEST(Splines, RefuseEndsThatContradictWhatIsGiven) {
  const auto sentence = [](const Record& r) {
    const auto made = make(r);
    return made.ok() ? std::string("no error") : made.error().sentence();
  };
  Record r = record_of("cubic_spline", zigzag());
  r.shape.params = {{"times", Numbers{0, 1, 2, 3}},
                    {"ends", std::string("natural")},
                    {"end_velocity", Numbers{0, 0, 1}}};
  EXPECT_EQ(sentence(r),
            "it: ends = \"natural\" leaves the spline no freedom for the velocity that is given at "
            "its end. Leave ends out or use \"clamped\", or leave out the values given there.");
  r.shape.params["ends"] = std::string("not_a_knot");
  EXPECT_NE(sentence(r).find("no freedom for the velocity"), std::string::npos) << sentence(r);
  r.shape.params["ends"] = std::string("periodic");
  EXPECT_NE(sentence(r).find("no freedom for the velocity"), std::string::npos) << sentence(r);
  r.shape.params.erase("end_velocity");
  EXPECT_NE(sentence(r).find("ends = \"periodic\" closes the spline, and its last point is"),
            std::string::npos)
      << sentence(r);
  r.shape.name = "quartic_spline";
  EXPECT_NE(sentence(r).find("periodic"), std::string::npos) << sentence(r);
  r = record_of("quintic_spline", zigzag());
  r.shape.params = {{"ends", std::string("not_a_knot")}};
  EXPECT_EQ(sentence(r),
            "it: a quintic spline with ends = \"not_a_knot\" needs 6 points or more, 4 were given. "
            "Add points.");
}

TEST(Splines, TellWhatIsWrongInSentences) {
  const auto sentence = [](const Record& r) {
    const auto made = make(r);
    return made.ok() ? std::string("no error") : made.error().sentence();
  };
  Record r = record_of("cubic_spline", {shift(0, 0, 0), shift(1, 0, 0), shift(1, 0, 0)});
  EXPECT_EQ(sentence(r),
            "it: points 2 and 3 are at the same position. Remove one of them, or give times.");
  r.shape.params = {{"times", Numbers{0, 2, 1}}};
  EXPECT_EQ(sentence(r), "it: the time of point 3 is 1 s, not after 2 s. Times must increase.");
  r.shape.params = {{"times", Numbers{0, 2}}};
  EXPECT_EQ(sentence(r), "it: 2 times are given for 3 points. Give one per point.");
  r = record_of("cubic_spline", {shift(0, 0, 0), shift(1, 0, 0)});
  r.shape.params = {{"ends", std::string("clamped")}};
  EXPECT_EQ(sentence(r),
            "it: start_velocity is zero: without times the tool cannot stop at an end. Give its "
            "direction there, or times.");
  r = record_of("b_spline", {shift(0, 0, 0), shift(1, 0, 0)});
  EXPECT_EQ(sentence(r),
            "it: a B-spline of degree 3 needs 4 points or more, 2 were given. Add points.");
  r = record_of("bezier", {shift(0, 0, 0), shift(0, 0, 0), shift(1, 0, 0)});
  EXPECT_EQ(sentence(r),
            "it: the curve has no direction at 0 % of its parameter. Coincident control points "
            "stop it there; move them apart, or give times.");
  r = record_of("teach_points", {shift(0, 0, 0), shift(1, 0, 0), shift(0, 0, 0)});
  EXPECT_EQ(sentence(r), "it: the path turns back on itself at point 2. Make a line of each part.");
}

}  // namespace
}  // namespace robomosp::conformance
