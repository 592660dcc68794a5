// SPDX-License-Identifier: Apache-2.0
// Conformance suite of robomosp.joint_segment/2 (layer: contract helper for tests, GoogleTest,
// header-only): ends met, limits kept, derivatives true. Include it in one file of a test program
// and instantiate JointSegmentConformance with JointSegmentCase values.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <robomosp/sdk/conformance/allocations.h>
#include <robomosp/sdk/conformance/provider.h>
#include <robomosp/sdk/conformance/threads.h>
#include <robomosp/sdk/joint_segment.h>

namespace robomosp::conformance {

struct JointSegmentCase {
  std::string file, provider;
  std::vector<std::pair<std::string, std::string>> params;
  bool takes_rates = false;          ///< velocities at the ends
  bool takes_accelerations = false;  ///< accelerations at the ends
  bool has_smooth_velocity = true;   ///< no jumps of the acceleration
  bool rests_at_ends = true;         ///< without JointEnds
};
inline void PrintTo(const JointSegmentCase& c, std::ostream* os) { *os << c.provider; }

/// Joint vectors, limits and ends with their storage.
struct JointMotionTask {
  std::size_t dof = 0;
  std::vector<double> points, lower, upper, velocity, acceleration, jerk, v0, v1, a0, a1;

  [[nodiscard]] JointLimits limits() const {
    return {sizeof(JointLimits), lower, upper, velocity, acceleration, jerk};
  }
  [[nodiscard]] JointEnds ends() const { return {sizeof(JointEnds), v0, v1, a0, a1}; }
  /// Two random vectors away from the limits.
  static JointMotionTask random(std::mt19937& generator, std::size_t dof) {
    const auto uniform = [&](double low, double high) {
      return std::uniform_real_distribution<double>(low, high)(generator);
    };
    JointMotionTask t;
    t.dof = dof;
    for (std::size_t i = 0; i < 2 * dof; ++i) t.points.push_back(uniform(-2, 2));
    for (std::size_t j = 0; j < dof; ++j) {
      t.lower.push_back(-50), t.upper.push_back(50);
      t.velocity.push_back(uniform(0.5, 3));
      t.acceleration.push_back(uniform(1, 10));
      t.jerk.push_back(uniform(5, 100));
    }
    return t;
  }
  /// Rates at the ends that can be kept and left again.
  void add_rates(std::mt19937& generator, bool with_accelerations) {
    std::uniform_real_distribution<double> uniform(-0.5, 0.5);
    for (std::size_t j = 0; j < dof; ++j)
      for (auto [v, a] : {std::pair{&v0, &a0}, std::pair{&v1, &a1}}) {
        v->push_back(uniform(generator) * velocity[j]);
        if (with_accelerations)
          a->push_back(uniform(generator) *
                       std::min(acceleration[j], std::sqrt(velocity[j] * jerk[j])));
      }
  }
};

class JointSegmentConformance : public testing::TestWithParam<JointSegmentCase> {
 protected:
  static constexpr unsigned kSeed = 20061;

  void SetUp() override {
    auto found = find_provider<JointSegmentFactory>(GetParam().file, GetParam().provider);
    ASSERT_TRUE(found.ok()) << found.error().sentence();
    maker_ = create<JointSegmentFactory>(**found);
    params_ = TableParams(**found);
    for (const auto& [name, text] : GetParam().params) params_.set(name, text);
  }
  Result<std::unique_ptr<JointSegment>> make(const JointMotionTask& t) {
    return maker_->make(t.dof, t.points, t.limits(), t.ends(), params_);
  }
  struct Rows {
    std::vector<double> q, qd, qdd, qddd;
  };
  static Rows rows(const JointSegment& s, const std::vector<double>& times, std::size_t dof) {
    Rows r;
    for (auto* table : {&r.q, &r.qd, &r.qdd, &r.qddd}) table->assign(times.size() * dof, NAN);
    EXPECT_TRUE(s.sample(times, {r.q, r.qd, r.qdd, r.qddd}).ok());
    return r;
  }
  static std::vector<double> even(double from, double to, std::size_t steps) {
    std::vector<double> out;
    for (std::size_t i = 0; i <= steps; ++i)
      out.push_back(from + (to - from) * static_cast<double>(i) / static_cast<double>(steps));
    return out;
  }
  /// Tasks of the kinds that the provider takes.
  std::vector<JointMotionTask> tasks(int count, bool only_moving = false) const {
    std::mt19937 generator(kSeed);
    std::vector<JointMotionTask> out;
    for (int i = 0; i < count; ++i) {
      auto t = JointMotionTask::random(generator, 1 + static_cast<std::size_t>(i) % 7);
      if (GetParam().takes_rates && (only_moving || i % 2))
        t.add_rates(generator, GetParam().takes_accelerations);
      out.push_back(std::move(t));
    }
    return out;
  }
  std::shared_ptr<JointSegmentFactory> maker_;
  TableParams params_;
};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(JointSegmentConformance);

TEST_P(JointSegmentConformance, BeginsAndEndsAsAsked) {
  for (const JointMotionTask& t : tasks(40)) {
    auto made = make(t);
    ASSERT_TRUE(made.ok()) << made.error().sentence();
    const JointSegment& s = **made;
    ASSERT_GT(s.duration(), 0);
    ASSERT_TRUE(std::isfinite(s.duration()));
    const Rows r = rows(s, {0, s.duration(), -1, s.duration() + 1}, t.dof);
    for (std::size_t j = 0; j < t.dof; ++j) {
      const auto wanted = [&](const std::vector<double>& v) { return v.empty() ? 0 : v[j]; };
      EXPECT_NEAR(r.q[j], t.points[j], 1e-9);
      EXPECT_NEAR(r.q[t.dof + j], t.points[t.dof + j], 1e-9);
      if (GetParam().rests_at_ends) {
        EXPECT_NEAR(r.qd[j], wanted(t.v0), 1e-9);
        EXPECT_NEAR(r.qd[t.dof + j], wanted(t.v1), 1e-9);
      }
      if (GetParam().takes_accelerations) {
        EXPECT_NEAR(r.qdd[j], wanted(t.a0), 1e-9);
        EXPECT_NEAR(r.qdd[t.dof + j], wanted(t.a1), 1e-9);
      }
      // Held outside.
      for (const std::size_t row : {2U, 3U}) {
        EXPECT_EQ(r.q[row * t.dof + j], r.q[(row - 2) * t.dof + j]);
        for (const auto* rate : {&r.qd, &r.qdd, &r.qddd}) EXPECT_EQ((*rate)[row * t.dof + j], 0);
      }
    }
  }
}

TEST_P(JointSegmentConformance, LimitsAreKeptEverywhere) {
  for (const JointMotionTask& t : tasks(40)) {
    auto made = make(t);
    ASSERT_TRUE(made.ok()) << made.error().sentence();
    const Rows r = rows(**made, even(0, (*made)->duration(), 2000), t.dof);
    for (std::size_t k = 0; k < r.q.size(); ++k) {
      const std::size_t j = k % t.dof;
      ASSERT_LE(std::fabs(r.qd[k]), t.velocity[j] * (1 + 1e-9)) << "joint " << j + 1;
      ASSERT_LE(std::fabs(r.qdd[k]), t.acceleration[j] * (1 + 1e-9)) << "joint " << j + 1;
      if (GetParam().has_smooth_velocity) {
        ASSERT_LE(std::fabs(r.qddd[k]), t.jerk[j] * (1 + 1e-9)) << "joint " << j + 1;
      }
    }
  }
}

// Every derivative, integrated by Simpson's rule over short steps, is the change of the one before:
// but where it jumps, by no more than a step's share.
TEST_P(JointSegmentConformance, DerivativesAreTrue) {
  for (const JointMotionTask& t : tasks(10)) {
    auto made = make(t);
    ASSERT_TRUE(made.ok()) << made.error().sentence();
    constexpr std::size_t kSteps = 2000;
    const double T = (*made)->duration(), h = T / kSteps;
    const Rows r = rows(**made, even(0, T, 2 * kSteps), t.dof);
    for (std::size_t j = 0; j < t.dof; ++j) {
      const auto gap = [&](const std::vector<double>& rate, const std::vector<double>& of,
                           std::size_t i) {
        const auto at = [&](const std::vector<double>& x, std::size_t k) {
          return x[k * t.dof + j];
        };
        return std::fabs(at(of, 2 * i + 2) - at(of, 2 * i) -
                         h / 6 * (at(rate, 2 * i) + 4 * at(rate, 2 * i + 1) + at(rate, 2 * i + 2)));
      };
      std::size_t jumps = 0;
      for (std::size_t i = 0; i < kSteps; ++i) {
        const double a = t.acceleration[j], J = t.jerk[j];
        ASSERT_LE(gap(r.qd, r.q, i), 1e-12 + 4 * a * h * h) << "at step " << i;
        ASSERT_LE(gap(r.qdd, r.qd, i), 1e-12 + 4 * a * h) << "at step " << i;
        if (gap(r.qd, r.q, i) > 1e-10 + 1e-3 * a * h * h ||
            gap(r.qdd, r.qd, i) > 1e-10 + 1e-3 * a * h)
          ++jumps;
        if (GetParam().has_smooth_velocity) {
          ASSERT_LE(gap(r.qddd, r.qdd, i), 1e-12 + 4 * J * h) << "at step " << i;
        }
      }
      EXPECT_LE(jumps, 40U);
    }
  }
}

TEST_P(JointSegmentConformance, OnlyWhatIsWantedIsFilled) {
  const JointMotionTask t = tasks(5).back();
  auto made = make(t);
  ASSERT_TRUE(made.ok()) << made.error().sentence();
  const auto times = even(0, (*made)->duration(), 10);
  const Rows all = rows(**made, times, t.dof);
  std::vector<double> q(times.size() * t.dof), qdd(q);
  ASSERT_TRUE((*made)->sample(times, {q, {}, {}, {}}).ok());
  EXPECT_EQ(q, all.q);
  ASSERT_TRUE((*made)->sample(times, {q, {}, qdd, {}}).ok());
  EXPECT_EQ(qdd, all.qdd);
}

TEST_P(JointSegmentConformance, SeveralThreadsMakeAndSampleTheSameAtOnce) {
  const JointMotionTask t = tasks(4).back();
  const auto run = [&](Rows& out) {
    auto made = make(t);
    ASSERT_TRUE(made.ok()) << made.error().sentence();
    out = rows(**made, even(0, (*made)->duration(), 200), t.dof);
  };
  Rows alone;
  run(alone);
  std::array<Rows, 4> together;
  at_once(together.size(), [&](std::size_t thread) { run(together[thread]); });
  for (const Rows& r : together) {
    EXPECT_EQ(r.q, alone.q);
    EXPECT_EQ(r.qd, alone.qd);
    EXPECT_EQ(r.qdd, alone.qdd);
  }
}

TEST_P(JointSegmentConformance, NothingIsAllocatedForASample) {
  RMP_NEEDS_ALLOCATION_COUNTS();
  const JointMotionTask t = tasks(4).back();
  auto made = make(t);
  ASSERT_TRUE(made.ok()) << made.error().sentence();
  const auto times = even(0, (*made)->duration(), 200);
  std::vector<double> q(times.size() * t.dof), qd = q, qdd = q, qddd = q;
  const auto of = [&](std::size_t n) {
    const auto first = [&](std::vector<double>& v) { return std::span(v).first(n * t.dof); };
    return allocations_in([&] {
      (void)(*made)->sample(std::span<const double>(times).first(n),
                            {first(q), first(qd), first(qdd), first(qddd)});
    });
  };
  (void)of(times.size());  // what is made once
  EXPECT_LE(of(times.size()), of(1)) << "more samples, more allocations";
}

TEST_P(JointSegmentConformance, HigherLimitsAreNeverSlower) {
  for (JointMotionTask t : tasks(10)) {
    t.v0.clear(), t.v1.clear(), t.a0.clear(), t.a1.clear();
    auto slow = make(t);
    for (double& v : t.velocity) v *= 2;
    for (double& a : t.acceleration) a *= 4;
    for (double& j : t.jerk) j *= 8;
    auto fast = make(t);
    ASSERT_TRUE(slow.ok() && fast.ok());
    // From rest to rest everything scales with time.
    EXPECT_NEAR((*fast)->duration(), (*slow)->duration() / 2, 1e-6 * (*slow)->duration());
  }
}

TEST_P(JointSegmentConformance, BrokenInputIsRefusedInASentence) {
  std::mt19937 generator(kSeed);
  const JointMotionTask good = JointMotionTask::random(generator, 3);
  ASSERT_TRUE(make(good).ok());
  const auto sentence = [&](const JointMotionTask& t) {
    const auto made = make(t);
    return made.ok() ? std::string() : made.error().sentence();
  };
  JointMotionTask t = good;
  t.points[4] = 60;
  EXPECT_NE(sentence(t).find("joint 2"), std::string::npos) << "outside: " << sentence(t);
  t = good;
  t.points[2] = NAN;
  EXPECT_NE(sentence(t).find("joint 3"), std::string::npos) << "not finite: " << sentence(t);
  t = good;
  t.points.pop_back();
  EXPECT_NE(sentence(t), "") << "half a vector";
  t = good;
  t.points.resize(3);
  EXPECT_NE(sentence(t), "") << "one vector";
  t = good;
  std::copy_n(t.points.begin(), 3, t.points.begin() + 3);
  EXPECT_NE(sentence(t), "") << "vectors that coincide";
  t = good;
  t.velocity[1] = 0;
  EXPECT_NE(sentence(t).find("joint 2"), std::string::npos) << "no speed: " << sentence(t);
  t = good;
  t.v1 = {0, 0, 10};
  EXPECT_NE(sentence(t).find("joint 3"), std::string::npos) << "too fast: " << sentence(t);
  t = good;
  t.v1 = {0, 0.1};
  EXPECT_NE(sentence(t), "") << "a rate for each joint but one";
}

}  // namespace robomosp::conformance
