// SPDX-License-Identifier: Apache-2.0
// Conformance suite of robomosp.curve/2 (layer: contract helper for tests, GoogleTest,
// header-only): derivatives are derivatives, control points are where the curve says. Include it in
// one file of a test program and instantiate CurveConformance with CurveCase values.
#pragma once

#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <robomosp/sdk/conformance/allocations.h>
#include <robomosp/sdk/conformance/provider.h>
#include <robomosp/sdk/conformance/threads.h>
#include <robomosp/sdk/curve.h>

namespace robomosp::conformance {

struct CurveCase {
  std::string file, provider, name;
  std::vector<Pose> points;
  std::vector<std::pair<std::string, std::string>>
      params{};                   ///< as in files, SI: {"axis", "{0, 1, 0}"}
  bool passes_all_points = true;  ///< at their knots
};
inline void PrintTo(const CurveCase& c, std::ostream* os) { *os << c.provider << " " << c.name; }
inline std::string curve_case_name(const testing::TestParamInfo<CurveCase>& info) {
  return info.param.provider + "_" + info.param.name;
}

class CurveConformance : public testing::TestWithParam<CurveCase> {
 protected:
  static Result<std::unique_ptr<Curve>> make(const CurveCase& c) {
    RMP_TRY_ASSIGN(const rmp_provider* provider, find_provider<CurveFactory>(c.file, c.provider));
    TableParams params(*provider);
    for (const auto& [name, value] : c.params) params.set(name, value);
    return create<CurveFactory>(*provider)->make(c.points, params);
  }
  void SetUp() override {
    auto made = make(GetParam());
    ASSERT_TRUE(made.ok()) << made.error().sentence();
    curve_ = std::move(made).value();
  }
  CurveSample at(double u) const {
    CurveSample s[1];
    const double places[] = {u};
    EXPECT_TRUE(curve_->evaluate(places, s).ok());
    return s[0];
  }
  static double size(const Vec3& v) { return std::hypot(v[0], v[1], v[2]); }
  std::unique_ptr<Curve> curve_;
};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(CurveConformance);

TEST_P(CurveConformance, DerivativesAreDerivatives) {
  const double end = curve_->end(), h = end * 3e-5;
  ASSERT_GT(end, 0);
  for (int i = 1; i < 20; ++i) {
    const double u = end * (i + 0.013) / 20;
    const CurveSample a = at(u - h), s = at(u), b = at(u + h);
    const double scale = 1e-6 * (1 + size(s.d1) + size(s.d2) + size(s.d3));
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(s.d1[k], (b.p[k] - a.p[k]) / (2 * h), scale) << "at " << u;
      EXPECT_NEAR(s.d2[k], (b.d1[k] - a.d1[k]) / (2 * h), scale) << "at " << u;
      EXPECT_NEAR(s.d3[k], (b.d2[k] - a.d2[k]) / (2 * h), 10 * scale) << "at " << u;
    }
  }
}

TEST_P(CurveConformance, ManyPlacesAtOnceAreTheSameAsOneByOne) {
  std::vector<double> u;
  for (int i = 0; i <= 200; ++i) u.push_back(curve_->end() * ((i * 37) % 201) / 200);
  std::vector<CurveSample> out(u.size());
  ASSERT_TRUE(curve_->evaluate(u, out).ok());
  for (std::size_t i = 0; i < u.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(out[i].p[k], at(u[i]).p[k]);
}

TEST_P(CurveConformance, EvenCurvesHaveSpeedsOfOneSize) {
  if (!curve_->is_even()) GTEST_SKIP();
  const double speed = size(at(0).d1);
  for (int i = 1; i <= 50; ++i)
    EXPECT_NEAR(size(at(curve_->end() * i / 50).d1), speed, 1e-12 * (1 + speed));
}

TEST_P(CurveConformance, KnotsRiseOneForEachPoint) {
  const std::vector<double> knots = curve_->knots();
  ASSERT_EQ(knots.size(), GetParam().points.size());
  for (std::size_t i = 0; i < knots.size(); ++i) {
    EXPECT_GE(knots[i], i ? knots[i - 1] : 0);
    EXPECT_LE(knots[i], curve_->end() * (1 + 1e-12));
    if (!GetParam().passes_all_points) continue;
    const Vec3 p = at(knots[i]).p, &point = GetParam().points[i].p;
    EXPECT_LE(std::hypot(p[0] - point[0], p[1] - point[1], p[2] - point[2]), 1e-9)
        << "point " << i + 1;
  }
}

TEST_P(CurveConformance, SeveralThreadsGetTheSameSamplesAtOnce) {
  std::vector<double> in;
  for (int i = 0; i <= 200; ++i) in.push_back(curve_->end() * i / 200);
  std::vector<CurveSample> alone(in.size());
  ASSERT_TRUE(curve_->evaluate(in, alone).ok());
  std::array<std::vector<CurveSample>, 4> together;
  at_once(together.size(), [&](std::size_t thread) {
    together[thread].resize(in.size());
    EXPECT_TRUE(curve_->evaluate(in, together[thread]).ok());
  });
  for (const auto& out : together)
    for (std::size_t i = 0; i < in.size(); ++i) {
      EXPECT_EQ(out[i].p, alone[i].p);
      EXPECT_EQ(out[i].d1, alone[i].d1);
      EXPECT_EQ(out[i].d2, alone[i].d2);
    }
}

TEST_P(CurveConformance, NothingIsAllocatedForASample) {
  RMP_NEEDS_ALLOCATION_COUNTS();
  std::vector<double> in;
  for (int i = 0; i <= 200; ++i) in.push_back(curve_->end() * i / 200);
  std::vector<CurveSample> alone(in.size());
  const auto of = [&](std::size_t n) {
    return allocations_in([&] {
      (void)curve_->evaluate(std::span<const double>(in).first(n), std::span(alone).first(n));
    });
  };
  (void)of(in.size());  // what is made once
  EXPECT_LE(of(in.size()), of(1)) << "more samples, more allocations";
}

TEST_P(CurveConformance, BrokenInputIsRefused) {
  CurveCase broken = GetParam();
  broken.points.clear();
  EXPECT_FALSE(make(broken).ok()) << "no points";
  broken.points = GetParam().points;
  broken.points[0].p[0] = std::nan("");
  EXPECT_FALSE(make(broken).ok()) << "a point that is not a number";
}

}  // namespace robomosp::conformance
