// SPDX-License-Identifier: Apache-2.0
// Vectors of the instruction sets, joint constants and division among threads.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numbers>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include <robomosp/sdk/conformance/models.h>

#include "lanes_probe.h"
#include "spatial/instruction_limit.h"
#include "spatial/instruction_set.h"
#include "spatial/joint_constants.h"
#include "spatial/parallel.h"
#include "spatial/pose.h"

namespace robomosp::test {
namespace {

using spatial::InstructionSet;

constexpr double kRight = std::numbers::pi / 2;

std::vector<const LanesProbe*> probes() {
  ::unsetenv("ROBOMOSP_SIMD");  // all that the processor has
  std::vector<const LanesProbe*> all{&baseline::probe()};
#if defined(__x86_64__)
  const InstructionSet widest = spatial::widest_instruction_set();
  if (widest >= InstructionSet::avx2) all.push_back(&avx2::probe());
#if defined(RMP_HAS_AVX512)
  if (widest >= InstructionSet::avx512) all.push_back(&avx512::probe());
#endif
#endif
  return all;
}

// Distance from the exact value, by the C library's long double, in units of the last place.
double ulps(double got, long double exact) {
  const double near = std::fabs(static_cast<double>(exact));
  const double unit = std::nextafter(near, std::numeric_limits<double>::infinity()) - near;
  return static_cast<double>(std::fabs(static_cast<long double>(got) - exact)) / unit;
}

TEST(InstructionSets, AreLimitedByTheEnvironmentAndWrongLimitsAreTold) {
  ::unsetenv("ROBOMOSP_SIMD");
  const InstructionSet widest = spatial::widest_instruction_set();
  EXPECT_EQ(spatial::instruction_set_complaint(), "");
  EXPECT_EQ(spatial::instruction_set_up_to("auto"), widest);
  const std::pair<const char*, InstructionSet> kSets[] = {{"baseline", InstructionSet::baseline},
                                                          {"avx2", InstructionSet::avx2},
                                                          {"avx512", InstructionSet::avx512}};
  for (const auto& [name, set] : kSets) {
    ::setenv("ROBOMOSP_SIMD", name, 1);
    EXPECT_EQ(spatial::instruction_set_limit(), set);
    EXPECT_EQ(spatial::widest_instruction_set(), std::min(set, widest));
    EXPECT_EQ(spatial::instruction_set_complaint(), "") << name;
    for (const auto& [other, narrower] : kSets)
      EXPECT_EQ(spatial::instruction_set_up_to(other), std::min({set, narrower, widest}));
  }
  for (const char* wrong : {"AVX2", "sse", "avx512 "}) {
    ::setenv("ROBOMOSP_SIMD", wrong, 1);
    EXPECT_EQ(spatial::widest_instruction_set(), widest);
    EXPECT_EQ(
        spatial::instruction_set_complaint(),
        "ROBOMOSP_SIMD is \"" + std::string(wrong) +
            "\", which is not an instruction set: the widest of this processor is used. Set it "
            "to baseline, avx2 or avx512, or unset it.");
  }
  ::setenv("ROBOMOSP_SIMD", "", 1);
  EXPECT_EQ(spatial::instruction_set_complaint(), "");
  ::unsetenv("ROBOMOSP_SIMD");
}

TEST(Lanes, SineAndCosineAreWithinOneUlpAlsoNearRightAnglesAndFarOut) {
  conformance::Random random(7);
  std::vector<double> x(4096), s(x.size()), c(x.size());
  for (const double range : {0.1, 4.0, 300.0, 9999.0, 1e15})
    for (const bool near_right : {false, true}) {
      x = random.vector(x.size(), -range, range);
      if (near_right)
        for (std::size_t i = 0; i < x.size(); ++i) {
          x[i] = std::nearbyint(x[i] / kRight) * kRight;
          if (i % 3) x[i] = std::nextafter(x[i], i % 3 == 1 ? -1e300 : 1e300);
        }
      for (const LanesProbe* p : probes()) {
        p->sines(x.data(), x.size(), false, s.data(), c.data());
        double worst = 0;
        for (std::size_t i = 0; i < x.size(); ++i)
          worst = std::max({worst, ulps(s[i], std::sin(static_cast<long double>(x[i]))),
                            ulps(c[i], std::cos(static_cast<long double>(x[i])))});
        EXPECT_LT(worst, 1) << "range " << range << ", near right angles: " << near_right;
      }
    }
}

TEST(Lanes, RightAnglesAreExactWhereAskedFor) {
  std::vector<double> x, s(64), c(64);
  for (int k = -32; k < 32; ++k) x.push_back(k * kRight);
  for (const LanesProbe* p : probes()) {
    p->sines(x.data(), x.size(), true, s.data(), c.data());
    for (std::size_t i = 0; i < x.size(); ++i) {
      const spatial::SinCos expected = spatial::sin_cos(x[i]);
      EXPECT_EQ(s[i], expected.sin) << x[i];
      EXPECT_EQ(c[i], expected.cos) << x[i];
    }
  }
}

TEST(Lanes, WhatIsNotFiniteGivesNotANumberAndLeavesItsNeighboursAlone) {
  const double x[8] = {0.5,   std::numeric_limits<double>::infinity(),  1.5, 1e300,
                       -0.25, std::numeric_limits<double>::quiet_NaN(), 2.5, 3.5};
  double s[8], c[8];
  for (const LanesProbe* p : probes()) {
    p->sines(x, 8, true, s, c);
    for (const std::size_t i : {1U, 5U}) EXPECT_TRUE(std::isnan(s[i]) && std::isnan(c[i]));
    for (const std::size_t i : {0U, 2U, 3U, 4U, 6U, 7U}) {
      EXPECT_NEAR(s[i], std::sin(x[i]), 2e-16) << x[i];
      EXPECT_NEAR(c[i], std::cos(x[i]), 2e-16) << x[i];
    }
  }
}

TEST(Lanes, SamplesOfAnyWidthAndNumberAreReadAndWrittenAndNothingBesides) {
  conformance::Random random(3);
  for (const LanesProbe* p : probes())
    for (const std::size_t width : {1U, 2U, 3U, 6U, 7U, 8U, 9U, 13U, 36U, 64U})
      for (const std::size_t samples : {1U, 2U, 3U, 5U, 7U, 8U, 9U, 17U}) {
        // As long as it may be: a sanitizer sees what is read beyond the end.
        const std::vector<double> from = random.vector(width * samples, -1, 1);
        std::vector<double> to(width * samples + 16, -7);
        p->there_and_back(from.data(), width, samples, to.data());
        for (std::size_t i = 0; i < to.size(); ++i)
          EXPECT_EQ(to[i], i < from.size() ? from[i] + static_cast<double>(i % width) : -7)
              << width << " x " << samples << ", number " << i;
      }
}

TEST(JointConstants, GiveThePlacementBack) {
  conformance::Random random(5);
  for (const RobotModel& m : {conformance::puma560(), conformance::panda(), conformance::tree()})
    for (const JointModel& j : m.joints) {
      const spatial::JointConstants c = spatial::joint_constants(j);
      Pose t;
      std::copy_n(c.p, 3, t.p.begin());
      if (c.turn == spatial::Turn::general) std::copy_n(c.R, 9, t.R.begin());
      else
        t.R = spatial::compose(
                  {{1, 0, 0, 0, c.cos_twist, -c.sin_twist, 0, c.sin_twist, c.cos_twist}, {}},
                  spatial::rotation_z(c.angle))
                  .R;
      for (std::size_t k = 0; k < 9; ++k)
        EXPECT_NEAR(t.R[k], j.placement.R[k], 1e-15) << m.name << ", " << j.name;
    }
}

TEST(JointConstants, KnowRightTwistsOfDhRows) {
  const RobotModel m = conformance::puma560();
  const spatial::Turn expected[] = {spatial::Turn::none,    spatial::Turn::quarter,
                                    spatial::Turn::none,    spatial::Turn::minus_quarter,
                                    spatial::Turn::quarter, spatial::Turn::minus_quarter};
  for (std::size_t i = 0; i < 6; ++i)
    EXPECT_EQ(spatial::joint_constants(m.joints[i]).turn, expected[i]) << i + 1;
}

TEST(Parallel, EverySampleIsVisitedOnceAndRangesBeginAtGrains) {
  for (const std::size_t samples : {0U, 1U, 255U, 256U, 257U, 5000U})
    for (const std::size_t threads : {1U, 2U, 3U, 16U}) {
      std::vector<std::atomic<int>> seen(samples);
      std::atomic<int> misplaced{0};
      spatial::in_parallel(samples, 256, threads,
                           [&](std::size_t first, std::size_t last, std::size_t thread) {
                             if ((first < last && first % 256 != 0) || thread >= threads)
                               ++misplaced;
                             for (std::size_t i = first; i < last; ++i) ++seen[i];
                           });
      EXPECT_EQ(misplaced, 0);
      for (const auto& s : seen) EXPECT_EQ(s, 1);
    }
}

}  // namespace
}  // namespace robomosp::test
