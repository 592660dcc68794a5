// SPDX-License-Identifier: Apache-2.0
// Conformance suite of robomosp.motion_law/2 (layer: contract helper for tests, GoogleTest,
// header-only): the share runs from 0 to 1 and never back, rates are its derivatives, limits hold.
// Include it in one file of a test program and instantiate MotionLawConformance with LawCase
// values.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <robomosp/sdk/conformance/allocations.h>
#include <robomosp/sdk/conformance/provider.h>
#include <robomosp/sdk/conformance/threads.h>
#include <robomosp/sdk/motion_law.h>

namespace robomosp::conformance {

struct LawCase {
  std::string file, provider, name;
  LawTask task;
  std::vector<std::pair<std::string, std::string>> params{};  ///< as in files, SI
  /// What the law must keep [1/s, 1/s^2, 1/s^3]; infinity = it promises nothing.
  double rate = std::numeric_limits<double>::infinity();
  double acceleration = std::numeric_limits<double>::infinity();
  double jerk = std::numeric_limits<double>::infinity();
  double duration = 0;                  ///< expected [s]; 0 = the law's affair
  double start_rate = 0, end_rate = 0;  ///< expected [1/s]; below 0 = the law's affair
  bool is_accelerating_at_ends = true;  ///< false: it starts and ends without acceleration
};
inline void PrintTo(const LawCase& c, std::ostream* os) { *os << c.provider << " " << c.name; }
inline std::string law_case_name(const testing::TestParamInfo<LawCase>& info) {
  return info.param.provider + "_" + info.param.name;
}

class MotionLawConformance : public testing::TestWithParam<LawCase> {
 protected:
  static Result<std::unique_ptr<MotionLaw>> make(const LawCase& c) {
    RMP_TRY_ASSIGN(const rmp_provider* provider,
                   find_provider<MotionLawFactory>(c.file, c.provider));
    TableParams params(*provider);
    for (const auto& [name, value] : c.params) params.set(name, value);
    return create<MotionLawFactory>(*provider)->make(c.task, params);
  }
  void SetUp() override {
    auto made = make(GetParam());
    ASSERT_TRUE(made.ok()) << made.error().sentence();
    law_ = std::move(made).value();
    ASSERT_GT(law_->duration(), 0);
    ASSERT_TRUE(std::isfinite(law_->duration()));
  }
  LawSample at(double t) const {
    LawSample s[1];
    const double times[] = {t};
    EXPECT_TRUE(law_->sample(times, s).ok());
    return s[0];
  }
  std::unique_ptr<MotionLaw> law_;
};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(MotionLawConformance);

TEST_P(MotionLawConformance, RunsFromStartToEndAndNeverBack) {
  const double T = law_->duration();
  EXPECT_NEAR(at(0).share, 0, 1e-12);
  EXPECT_NEAR(at(T).share, 1, 1e-12);
  double before = 0;
  for (int i = 0; i <= 1000; ++i) {
    const LawSample s = at(T * i / 1000);
    EXPECT_GE(s.share, before - 1e-12) << "at " << T * i / 1000 << " s";
    EXPECT_GE(s.rate, -1e-9 / T) << "at " << T * i / 1000 << " s";
    before = s.share;
  }
  if (GetParam().duration > 0) {
    EXPECT_NEAR(T, GetParam().duration, 1e-9 * GetParam().duration);
  }
}

// Rates are integrals of what comes after them: right also where that jumps.
TEST_P(MotionLawConformance, RatesAreDerivatives) {
  const double T = law_->duration();
  constexpr int kSteps = 20000;
  double share = at(0).share, rate = at(0).rate, most = 0;
  for (int i = 0; i < kSteps; ++i)
    most = std::max(most, std::fabs(at(T * (i + 0.5) / kSteps).acceleration));
  const double h = T / kSteps;
  for (int i = 0; i < kSteps; ++i) {
    const LawSample middle = at(T * (i + 0.5) / kSteps);
    share += h * middle.rate;
    rate += h * middle.acceleration;
    if (i % 1000 != 999) continue;
    const LawSample s = at(T * (i + 1) / kSteps);
    EXPECT_NEAR(s.share, share, 1e-6) << "share at " << T * (i + 1) / kSteps << " s";
    // A jump of the acceleration within a step of the sum is off by half a step.
    EXPECT_NEAR(s.rate, rate, 8 * h * most + 1e-9 / T) << "rate at " << T * (i + 1) / kSteps;
  }
  // The jerk where it is smooth: between places with equal differences.
  for (int i = 1; i < 40; ++i) {
    const double t = T * (i + 0.137) / 41, d = T * 2e-5;
    const double back = (at(t).acceleration - at(t - d).acceleration) / d,
                 ahead = (at(t + d).acceleration - at(t).acceleration) / d;
    if (std::fabs(ahead - back) > 1e-2 * (std::fabs(ahead) + std::fabs(back)) + 1e-3) continue;
    EXPECT_NEAR(at(t).jerk, (ahead + back) / 2, 1e-3 * (std::fabs(ahead) + most / T) + 1e-6)
        << "jerk at " << t << " s";
  }
}

TEST_P(MotionLawConformance, KeepsTheLimits) {
  const double T = law_->duration();
  const LawCase& c = GetParam();
  for (int i = 0; i <= 5000; ++i) {
    const LawSample s = at(T * i / 5000);
    EXPECT_LE(s.rate, c.rate * (1 + 1e-6));
    EXPECT_LE(std::fabs(s.acceleration), c.acceleration * (1 + 1e-6));
    EXPECT_LE(std::fabs(s.jerk), c.jerk * (1 + 1e-6));
  }
}

TEST_P(MotionLawConformance, StartsAndEndsAsAsked) {
  const double T = law_->duration();
  const LawCase& c = GetParam();
  if (c.start_rate >= 0) {
    EXPECT_NEAR(at(0).rate, c.start_rate, 1e-9 * (1 + c.start_rate));
  }
  if (c.end_rate >= 0) {
    EXPECT_NEAR(at(T).rate, c.end_rate, 1e-9 * (1 + c.end_rate));
  }
  if (!c.is_accelerating_at_ends) {
    EXPECT_NEAR(at(0).acceleration, 0, 1e-9 / (T * T));
    EXPECT_NEAR(at(T).acceleration, 0, 1e-9 / (T * T));
  }
}

TEST_P(MotionLawConformance, TimesOutsideAreHeldAtTheEndsAtRest) {
  for (const auto& [t, share] : {std::pair{-1.0, 0.0}, std::pair{law_->duration() + 1, 1.0}}) {
    const LawSample s = at(t);
    EXPECT_NEAR(s.share, share, 1e-12);
    EXPECT_EQ(s.rate, 0);
    EXPECT_EQ(s.acceleration, 0);
    EXPECT_EQ(s.jerk, 0);
  }
}

TEST_P(MotionLawConformance, SeveralThreadsGetTheSameSamplesAtOnce) {
  std::vector<double> in;
  for (int i = 0; i <= 200; ++i) in.push_back(law_->duration() * i / 200);
  std::vector<LawSample> alone(in.size());
  ASSERT_TRUE(law_->sample(in, alone).ok());
  std::array<std::vector<LawSample>, 4> together;
  at_once(together.size(), [&](std::size_t thread) {
    together[thread].resize(in.size());
    EXPECT_TRUE(law_->sample(in, together[thread]).ok());
  });
  for (const auto& out : together)
    for (std::size_t i = 0; i < in.size(); ++i) {
      EXPECT_EQ(out[i].share, alone[i].share);
      EXPECT_EQ(out[i].rate, alone[i].rate);
      EXPECT_EQ(out[i].acceleration, alone[i].acceleration);
    }
}

TEST_P(MotionLawConformance, NothingIsAllocatedForASample) {
  RMP_NEEDS_ALLOCATION_COUNTS();
  std::vector<double> in;
  for (int i = 0; i <= 200; ++i) in.push_back(law_->duration() * i / 200);
  std::vector<LawSample> alone(in.size());
  const auto of = [&](std::size_t n) {
    return allocations_in([&] {
      (void)law_->sample(std::span<const double>(in).first(n), std::span(alone).first(n));
    });
  };
  (void)of(in.size());  // what is made once
  EXPECT_LE(of(in.size()), of(1)) << "more samples, more allocations";
}

TEST_P(MotionLawConformance, ManyTimesAtOnceAreTheSameAsOneByOne) {
  std::vector<double> times;
  for (int i = 0; i <= 200; ++i) times.push_back(law_->duration() * ((i * 37) % 201) / 200);
  std::vector<LawSample> out(times.size());
  ASSERT_TRUE(law_->sample(times, out).ok());
  for (std::size_t i = 0; i < times.size(); ++i) EXPECT_EQ(out[i].share, at(times[i]).share);
}

}  // namespace robomosp::conformance
