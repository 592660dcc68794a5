// SPDX-License-Identifier: Apache-2.0
// Conformance suite of robomosp.segment/2 (layer: contract helper for tests, GoogleTest,
// header-only): rates are derivatives, times outside are held. Include it in one file of a test
// program and instantiate SegmentConformance with SegmentCase values.
#pragma once

#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <robomosp/sdk/conformance/allocations.h>
#include <robomosp/sdk/conformance/models.h>
#include <robomosp/sdk/conformance/provider.h>
#include <robomosp/sdk/conformance/threads.h>
#include <robomosp/sdk/trajectory.h>

namespace robomosp::conformance {

struct SegmentCase {
  std::string file, provider, name;
  std::vector<Pose> points;
  std::vector<std::pair<std::string, double>> params;
  double constant_speed = 0;      ///< expected |velocity| all along [m/s]; 0 = not constant
  bool passes_all_points = true;  ///< every control point lies on the path
  bool ends_at_last_point = true;
  bool is_made_by_points = true;  ///< false: its parameters alone move it
  /// How it is made; none = by the provider of robomosp.segment/2 in `file`.
  std::function<Result<std::shared_ptr<const Segment>>(const SegmentCase&)> make{};
};
inline void PrintTo(const SegmentCase& c, std::ostream* os) { *os << c.provider << " " << c.name; }
inline std::string segment_case_name(const testing::TestParamInfo<SegmentCase>& info) {
  return info.param.provider + "_" + info.param.name;
}

class SegmentConformance : public testing::TestWithParam<SegmentCase> {
 protected:
  void SetUp() override {
    auto made = GetParam().make ? GetParam().make(GetParam()) : by_provider(GetParam());
    ASSERT_TRUE(made.ok()) << made.error().sentence();
    segment_ = std::move(made).value();
  }
  PathSample at(double t) const {
    PathSample s[1];
    const double time[] = {t};
    EXPECT_TRUE(segment_->sample(time, s).ok());
    return s[0];
  }
  static double size(const Vec3& v) { return std::hypot(v[0], v[1], v[2]); }
  static Result<std::shared_ptr<const Segment>> by_provider(const SegmentCase& c) {
    RMP_TRY_ASSIGN(const rmp_provider* provider, find_provider<SegmentFactory>(c.file, c.provider));
    TableParams params(*provider);
    for (const auto& [name, value] : c.params) params.set(name, value);
    RMP_TRY_ASSIGN(auto made, create<SegmentFactory>(*provider)->make(c.points, params));
    return std::shared_ptr<const Segment>(std::move(made));
  }
  std::shared_ptr<const Segment> segment_;
};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(SegmentConformance);

TEST_P(SegmentConformance, VelocitiesAndAccelerationsAreDerivatives) {
  const double T = segment_->duration(), h = T * 3e-5;
  ASSERT_GT(T, 0);
  for (int i = 1; i < 20; ++i) {
    const double t = T * i / 20;
    const PathSample a = at(t - h), s = at(t), b = at(t + h);
    // Differences of order two: their error is about h^2 times the third derivative.
    const double scale =
        1e-6 * (1 + size(s.velocity) + size(s.acceleration) + size(s.angular_velocity));
    double D[9] = {};
    for (std::size_t r = 0; r < 3; ++r)
      for (std::size_t c = 0; c < 3; ++c)
        for (std::size_t k = 0; k < 3; ++k)
          D[3 * r + c] += b.pose.R[3 * r + k] * a.pose.R[3 * c + k];
    const Vec3 turn{(D[7] - D[5]) / 2, (D[2] - D[6]) / 2, (D[3] - D[1]) / 2};
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(s.velocity[k], (b.pose.p[k] - a.pose.p[k]) / (2 * h), scale);
      EXPECT_NEAR(s.acceleration[k], (b.velocity[k] - a.velocity[k]) / (2 * h), scale);
      EXPECT_NEAR(s.angular_velocity[k], turn[k] / (2 * h), scale);
      EXPECT_NEAR(s.angular_acceleration[k],
                  (b.angular_velocity[k] - a.angular_velocity[k]) / (2 * h), scale);
    }
  }
}

TEST_P(SegmentConformance, LengthIsTheIntegralOfSpeed) {
  constexpr int kSteps = 2000;
  double length = 0;
  for (int i = 0; i < kSteps; ++i)
    length += size(at(segment_->duration() * (i + 0.5) / kSteps).velocity);
  EXPECT_NEAR(length * segment_->duration() / kSteps, segment_->length(),
              1e-6 * (1 + segment_->length()));
}

TEST_P(SegmentConformance, SpeedIsAsAsked) {
  if (GetParam().constant_speed <= 0) GTEST_SKIP() << "its speed is not constant";
  for (int i = 0; i <= 50; ++i)
    EXPECT_NEAR(size(at(segment_->duration() * i / 50).velocity), GetParam().constant_speed, 1e-12);
}

TEST_P(SegmentConformance, StartsAtTheFirstPointAndEndsWhereItShould) {
  const auto& points = GetParam().points;
  EXPECT_LE(position_gap(at(0).pose, points.front()), 1e-12);
  EXPECT_LE(rotation_gap(at(0).pose, points.front()), 1e-9);
  EXPECT_LE(rotation_gap(at(segment_->duration()).pose, points.back()), 1e-9);
  if (GetParam().ends_at_last_point) {
    EXPECT_LE(position_gap(at(segment_->duration()).pose, points.back()), 1e-12);
  }
}

TEST_P(SegmentConformance, ControlPointsLieOnThePathInTheirOrder) {
  if (!GetParam().passes_all_points) GTEST_SKIP();
  constexpr int kSteps = 20000;
  double last = -1;
  for (const Pose& p : GetParam().points) {
    double best = 1e9, when = 0;
    for (int i = 0; i <= kSteps; ++i) {
      const double t = segment_->duration() * i / kSteps, d = position_gap(at(t).pose, p);
      if (d < best - 1e-9) best = d, when = t;
    }
    EXPECT_LE(best, segment_->length() / kSteps);
    EXPECT_GT(when, last) << "the points are passed in the order given";
    last = when;
  }
}

TEST_P(SegmentConformance, TimesOutsideAreHeldAtTheEndsAtRest) {
  const double T = segment_->duration();
  const PathSample before = at(-1), after = at(T + 1);
  EXPECT_LE(position_gap(before.pose, at(0).pose), 1e-15);
  EXPECT_LE(position_gap(after.pose, at(T).pose), 1e-15);
  for (const PathSample& s : {before, after}) {
    EXPECT_EQ(size(s.velocity) + size(s.acceleration), 0);
    EXPECT_EQ(size(s.angular_velocity) + size(s.angular_acceleration), 0);
  }
}

TEST_P(SegmentConformance, OrientationsStayRotations) {
  for (int i = 0; i <= 20; ++i) {
    const Pose p = at(segment_->duration() * i / 20).pose;
    for (std::size_t r = 0; r < 3; ++r)
      for (std::size_t c = 0; c < 3; ++c) {
        double dot = 0;
        for (std::size_t k = 0; k < 3; ++k) dot += p.R[3 * r + k] * p.R[3 * c + k];
        EXPECT_NEAR(dot, r == c ? 1 : 0, 1e-13);
      }
  }
}

TEST_P(SegmentConformance, SeveralThreadsGetTheSameSamplesAtOnce) {
  std::vector<double> in;
  for (int i = 0; i <= 200; ++i) in.push_back(segment_->duration() * i / 200);
  std::vector<PathSample> alone(in.size());
  ASSERT_TRUE(segment_->sample(in, alone).ok());
  std::array<std::vector<PathSample>, 4> together;
  at_once(together.size(), [&](std::size_t thread) {
    together[thread].resize(in.size());
    EXPECT_TRUE(segment_->sample(in, together[thread]).ok());
  });
  for (const auto& out : together)
    for (std::size_t i = 0; i < in.size(); ++i) {
      EXPECT_EQ(out[i].pose.p, alone[i].pose.p);
      EXPECT_EQ(out[i].velocity, alone[i].velocity);
      EXPECT_EQ(out[i].acceleration, alone[i].acceleration);
    }
}

TEST_P(SegmentConformance, NothingIsAllocatedForASample) {
  RMP_NEEDS_ALLOCATION_COUNTS();
  std::vector<double> in;
  for (int i = 0; i <= 200; ++i) in.push_back(segment_->duration() * i / 200);
  std::vector<PathSample> alone(in.size());
  const auto of = [&](std::size_t n) {
    return allocations_in([&] {
      (void)segment_->sample(std::span<const double>(in).first(n), std::span(alone).first(n));
    });
  };
  (void)of(in.size());  // what is made once
  // A part of the work may have its own memory.
  EXPECT_LT(of(in.size()) - of(1), static_cast<long long>(in.size() / 20));
}

TEST_P(SegmentConformance, BrokenInputIsRefused) {
  SegmentCase broken = GetParam();
  const auto is_made = [&broken] { return (broken.make ? broken.make : by_provider)(broken).ok(); };
  broken.points.clear();
  EXPECT_FALSE(is_made()) << "no points";
  broken.points = GetParam().points;
  broken.points[0].p[0] = std::nan("");
  EXPECT_FALSE(is_made()) << "a point that is not a number";
}

// A segment to where it is may be refused; one that is made rests there, in whatever time it takes.
TEST_P(SegmentConformance, PointsInOnePlaceAreRefusedOrRest) {
  if (!GetParam().is_made_by_points) GTEST_SKIP() << "its parameters alone move it";
  SegmentCase still = GetParam();
  still.points.assign(GetParam().points.size(), GetParam().points[0]);
  auto made = still.make ? still.make(still) : by_provider(still);
  if (!made.ok()) {
    EXPECT_FALSE(made.error().sentence().empty());
    return;
  }
  const Segment& segment = **made;
  ASSERT_TRUE(std::isfinite(segment.duration()));
  EXPECT_GE(segment.duration(), 0);
  EXPECT_NEAR(segment.length(), 0, 1e-12);
  for (int i = 0; i <= 10; ++i) {
    const double t = segment.duration() * i / 10;
    PathSample s;
    ASSERT_TRUE(segment.sample({&t, 1}, {&s, 1}).ok()) << "t = " << t;
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(s.pose.p[k], still.points[0].p[k], 1e-12);
      EXPECT_NEAR(s.velocity[k], 0, 1e-12);
      EXPECT_NEAR(s.acceleration[k], 0, 1e-12);
    }
  }
}

}  // namespace robomosp::conformance
