// SPDX-License-Identifier: Apache-2.0
// Conformance suite of robomosp.integrator/1 (layer: contract helper for tests, GoogleTest,
// header-only). Every expectation is a closed form: oscillator, Kepler's orbit, a bouncing ball, a
// turning body. Include it in one file of a test program and instantiate IntegratorConformance with
// IntegratorCase values.
#pragma once

#include <array>
#include <cctype>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <robomosp/sdk/conformance/allocations.h>
#include <robomosp/sdk/conformance/provider.h>
#include <robomosp/sdk/conformance/threads.h>
#include <robomosp/sdk/integrator.h>

namespace robomosp::conformance {

struct IntegratorCase {
  std::string file, provider;
  int order = 4;  ///< of convergence, for problems with forces that depend on positions
  std::vector<std::pair<std::string, std::string>> params;
  bool is_adaptive = false;
  std::string longest_step;  ///< parameter of an adaptive method that bounds its step
  bool is_symplectic = false;
};
inline void PrintTo(const IntegratorCase& c, std::ostream* os) { *os << c.provider; }
inline std::string integrator_case_name(const testing::TestParamInfo<IntegratorCase>& info) {
  std::string s = info.param.provider;
  for (const auto& [name, text] : info.param.params) s += "_" + text;
  for (char& c : s)
    if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
  return s;
}

/// A system given by functions.
class TestSystem final : public OdeSystem {
 public:
  using Rate = std::function<void(double, std::span<const double>, std::span<double>)>;
  using Event = std::function<double(double, std::span<const double>)>;
  using Happen = std::function<bool(double, std::size_t, std::span<double>)>;

  TestSystem(std::size_t size, Rate rate, std::size_t positions = static_cast<std::size_t>(-1))
      : size_(size),
        positions_(positions == static_cast<std::size_t>(-1) ? size / 2 : positions),
        rate_(std::move(rate)) {}
  TestSystem& on(Event event) {
    events_.push_back(std::move(event));
    return *this;
  }
  TestSystem& then(Happen happen) {
    happen_ = std::move(happen);
    return *this;
  }
  TestSystem& projected(std::function<void(std::span<double>)> project) {
    project_ = std::move(project);
    return *this;
  }
  std::size_t size() const override { return size_; }
  std::size_t positions() const override { return positions_; }
  Result<void> rate(double t, std::span<const double> x, std::span<double> dx) override {
    if (t >= fails_from) return error(ErrorCode::invalid_argument, "the force gave up");
    rate_(t, x, dx);
    return {};
  }
  void project(std::span<double> x) override {
    if (project_) project_(x);
  }
  std::size_t events() const override { return events_.size(); }
  void event_values(double t, std::span<const double> x, std::span<double> g) override {
    for (std::size_t i = 0; i < g.size(); ++i) g[i] = events_[i](t, x);
  }
  bool at_event(double t, std::size_t index, std::span<double> x) override {
    happened.push_back({t, index});
    return happen_ ? happen_(t, index, x) : true;
  }
  std::vector<std::pair<double, std::size_t>> happened;
  double fails_from = std::numeric_limits<double>::infinity();

 private:
  std::size_t size_, positions_;
  Rate rate_;
  std::vector<Event> events_;
  Happen happen_;
  std::function<void(std::span<double>)> project_;
};

class KeptSamples final : public OdeSink {
 public:
  bool sample(double t, std::span<const double> x) override {
    times.push_back(t);
    states.emplace_back(x.begin(), x.end());
    return times.size() < most;
  }
  std::vector<double> times;
  std::vector<std::vector<double>> states;
  std::size_t most = static_cast<std::size_t>(-1);
};

class CancelledRun final : public Progress {
 public:
  void report(double, std::string_view) override {}
  bool cancelled() const override { return true; }
};

inline TestSystem oscillator() {
  return TestSystem(2, [](double, std::span<const double> x, std::span<double> dx) {
    dx[0] = x[1];
    dx[1] = -x[0];
  });
}
/// Plane orbit about a centre of strength 1: x, y, then their rates.
inline TestSystem kepler() {
  return TestSystem(4, [](double, std::span<const double> x, std::span<double> dx) {
    const double r = std::hypot(x[0], x[1]), r3 = r * r * r;
    dx[0] = x[2], dx[1] = x[3];
    dx[2] = -x[0] / r3, dx[3] = -x[1] / r3;
  });
}

class IntegratorConformance : public testing::TestWithParam<IntegratorCase> {
 protected:
  std::unique_ptr<Integrator> make(const std::string& name = {}, double value = 0) {
    auto found = find_provider<Integrator>(GetParam().file, GetParam().provider);
    if (!found.ok()) {
      ADD_FAILURE() << found.error().sentence();
      return nullptr;
    }
    auto made = conformance::create<Integrator>(**found);
    TableParams params(**found);
    for (const auto& [key, text] : GetParam().params) params.set(key, text);
    if (!name.empty()) params.set(name, value);
    const auto ready = made->prepare(params);
    EXPECT_TRUE(ready.ok()) << (ready.ok() ? "" : ready.error().sentence());
    return made;
  }
  /// Runs to `end` at full accuracy (adaptive) or with the step.
  Result<OdeStatistics> go(OdeSystem& system, const std::vector<double>& x0, double end,
                           double step, KeptSamples& kept, std::vector<double> times = {}) {
    OdeRun run;
    run.end = end, run.x0 = x0, run.step = step;
    if (times.empty()) times = {end};
    run.sample_times = times;
    run.relative_tolerance = 1e-11, run.absolute_tolerance = 1e-12;
    NoProgress none;
    return make()->run(system, run, kept, none);
  }
  std::vector<double> last(OdeSystem& system, const std::vector<double>& x0, double end,
                           double step) {
    KeptSamples kept;
    const auto done = go(system, x0, end, step, kept);
    EXPECT_TRUE(done.ok()) << (done.ok() ? "" : done.error().sentence());
    if (kept.states.empty()) {
      ADD_FAILURE() << "no sample";
      return std::vector<double>(x0.size());
    }
    return kept.states.back();
  }
  /// What a run with this step may miss by, from the order.
  double allowed(double step) const {
    return GetParam().is_adaptive ? 1e-8 : 40 * std::pow(step, GetParam().order);
  }
  /// Greatest error after one turn of the oscillator with steps of exactly h.
  double error_with(double h) {
    auto system = oscillator();
    const std::vector<double> x0{1, 0}, times{3};
    OdeRun run;
    run.end = 3, run.x0 = x0, run.sample_times = times, run.step = h;
    if (GetParam().is_adaptive) run.relative_tolerance = run.absolute_tolerance = 1e6;
    KeptSamples kept;
    NoProgress none;
    const auto method = GetParam().is_adaptive ? make(GetParam().longest_step, h) : make();
    const auto done = method->run(system, run, kept, none);
    EXPECT_TRUE(done.ok()) << (done.ok() ? "" : done.error().sentence());
    return std::hypot(kept.states.at(0)[0] - std::cos(3), kept.states.at(0)[1] + std::sin(3));
  }
};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(IntegratorConformance);

TEST_P(IntegratorConformance, ErrorsFallWithTheStepAsTheOrderSays) {
  if (GetParam().is_adaptive && GetParam().longest_step.empty())
    GTEST_SKIP() << "its step cannot be set";
  const double coarse = error_with(0.1), fine = error_with(0.05);
  EXPECT_GT(coarse, 0);
  EXPECT_NEAR(std::log2(coarse / fine), GetParam().order, 0.25);
}

TEST_P(IntegratorConformance, AnAdaptiveMethodKeepsItsTolerance) {
  if (!GetParam().is_adaptive) GTEST_SKIP() << "it has a fixed step";
  double before = std::numeric_limits<double>::infinity();
  std::int64_t steps = 0;
  for (const double tolerance : {1e-4, 1e-6, 1e-8, 1e-10}) {
    auto system = kepler();
    const double e = 0.5;
    const std::vector<double> x0{1 - e, 0, 0, std::sqrt((1 + e) / (1 - e))};
    const double turn = 2 * std::acos(-1.0);
    const std::vector<double> times{turn};
    OdeRun run;
    run.end = turn, run.x0 = x0, run.sample_times = times;
    run.relative_tolerance = run.absolute_tolerance = tolerance;
    KeptSamples kept;
    NoProgress none;
    const auto done = make()->run(system, run, kept, none);
    ASSERT_TRUE(done.ok()) << done.error().sentence();
    double miss = 0;
    for (std::size_t i = 0; i < 4; ++i)
      miss = std::max(miss, std::fabs(kept.states.at(0)[i] - x0[i]));
    EXPECT_LT(miss, 300 * tolerance);
    EXPECT_LT(miss, before);
    EXPECT_GT(done->steps, steps);
    EXPECT_GE(done->rates, done->steps);
    before = miss, steps = done->steps;
  }
}

TEST_P(IntegratorConformance, TheOscillatorFollowsItsClosedFormAtEverySample) {
  auto system = oscillator();
  KeptSamples kept;
  const std::vector<double> times{0, 0.001, 0.01, 0.333, 0.5, 1, 1, 1.7, 2};
  const double h = 2e-3;
  const auto done = go(system, {1, 0.5}, 2, h, kept, times);
  ASSERT_TRUE(done.ok()) << done.error().sentence();
  EXPECT_EQ(kept.times, times);
  EXPECT_EQ(done->end, 2);
  EXPECT_EQ(done->events, 0);
  for (std::size_t i = 0; i < times.size(); ++i) {
    EXPECT_NEAR(kept.states[i][0], std::cos(times[i]) + 0.5 * std::sin(times[i]), allowed(h));
    EXPECT_NEAR(kept.states[i][1], 0.5 * std::cos(times[i]) - std::sin(times[i]), allowed(h));
  }
}

TEST_P(IntegratorConformance, KeplersOrbitCloses) {
  auto system = kepler();
  const double e = 0.3, h = 1e-3;
  const std::vector<double> x0{1 - e, 0, 0, std::sqrt((1 + e) / (1 - e))};
  const auto x = last(system, x0, 2 * std::acos(-1.0), h);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(x[i], x0[i], 20 * allowed(h)) << i;
}

TEST_P(IntegratorConformance, ForcesThatDependOnTimeAreAskedAtTheRightTime) {
  // x'' = cos t from (0, 0): x = 1 - cos t.
  TestSystem system(2, [](double t, std::span<const double> x, std::span<double> dx) {
    dx[0] = x[1];
    dx[1] = std::cos(t);
  });
  const double h = 1e-3;
  const auto x = last(system, {0, 0}, 2, h);
  EXPECT_NEAR(x[0], 1 - std::cos(2), allowed(h));
  EXPECT_NEAR(x[1], std::sin(2), allowed(h));
}

TEST_P(IntegratorConformance, DampingFollowsItsClosedForm) {
  // x'' = -2 d x' - x; the acceleration depends on the velocity.
  const double d = 0.3, w = std::sqrt(1 - d * d), h = 1e-3;
  TestSystem system(2, [d](double, std::span<const double> x, std::span<double> dx) {
    dx[0] = x[1];
    dx[1] = -2 * d * x[1] - x[0];
  });
  const auto x = last(system, {1, -d}, 3, h);
  EXPECT_NEAR(x[0], std::exp(-3 * d) * std::cos(3 * w), allowed(h));
}

TEST_P(IntegratorConformance, EventsAreFoundAtTheirTimes) {
  // Zeros of cos t and of t - 1.25 along the oscillator.
  auto system = oscillator();
  system.on([](double, std::span<const double> x) { return x[0]; });
  system.on([](double t, std::span<const double>) { return t - 1.25; });
  KeptSamples kept;
  const double h = 1e-3, pi = std::acos(-1.0);
  const auto done = go(system, {1, 0}, 5, h, kept);
  ASSERT_TRUE(done.ok()) << done.error().sentence();
  ASSERT_EQ(system.happened.size(), 3U);
  EXPECT_EQ(done->events, 3);
  EXPECT_NEAR(system.happened[0].first, 1.25, 1e-14);
  EXPECT_EQ(system.happened[0].second, 1U);
  EXPECT_NEAR(system.happened[1].first, pi / 2, allowed(h));
  EXPECT_NEAR(system.happened[2].first, 3 * pi / 2, allowed(h));
  for (std::size_t i = 1; i < kept.times.size(); ++i) EXPECT_LE(kept.times[i - 1], kept.times[i]);
}

TEST_P(IntegratorConformance, ABallBouncesAtItsTimes) {
  // Dropped from 1 m: it lands after sqrt(2 / g) and then bounces for e times as long each.
  const double g = 9.81, e = 0.8, fall = std::sqrt(2 / g);
  TestSystem system(2, [g](double, std::span<const double> x, std::span<double> dx) {
    dx[0] = x[1];
    dx[1] = -g;
  });
  system.on([](double, std::span<const double> x) { return x[0]; });
  system.then([e](double, std::size_t, std::span<double> x) {
    x[0] = 0;
    x[1] *= -e;
    return true;
  });
  KeptSamples kept;
  const double h = 1e-4;
  const auto done = go(system, {1, 0}, 2.5, h, kept);
  ASSERT_TRUE(done.ok()) << done.error().sentence();
  double expected = fall, hop = 2 * fall * e;
  ASSERT_GE(system.happened.size(), 4U);
  for (const auto& [t, index] : system.happened) {
    EXPECT_NEAR(t, expected, GetParam().order == 1 ? 10 * h : 1e-10);
    expected += hop;
    hop *= e;
  }
  EXPECT_GT(expected, 2.5) << "a bounce is missing";
}

TEST_P(IntegratorConformance, EventsAtOneInstantAllHappenAndAnEndingOneEnds) {
  auto system = oscillator();
  system.on([](double t, std::span<const double>) { return 0.5 - t; });
  system.on([](double t, std::span<const double>) { return 2 * t - 1; });
  system.on([](double t, std::span<const double>) { return t - 0.8; });
  system.then([](double, std::size_t index, std::span<double>) { return index != 2; });
  KeptSamples kept;
  const auto done = go(system, {1, 0}, 2, 1e-2, kept);
  ASSERT_TRUE(done.ok()) << done.error().sentence();
  ASSERT_EQ(system.happened.size(), 3U);
  EXPECT_NEAR(system.happened[0].first, 0.5, 1e-14);
  EXPECT_NEAR(system.happened[1].first, 0.5, 1e-14);
  EXPECT_NEAR(done->end, 0.8, 1e-14);
  EXPECT_NEAR(kept.times.back(), 0.8, 1e-14);
}

TEST_P(IntegratorConformance, EventsWithoutTimeBetweenThemAreAnError) {
  // Either event puts the other one 1e-14 s ahead, without end.
  auto system = oscillator();
  double due[2] = {0.5, 0.7};
  system.on([&due](double t, std::span<const double>) { return due[0] - t; });
  system.on([&due](double t, std::span<const double>) { return due[1] - t; });
  system.then([&due](double t, std::size_t index, std::span<double>) {
    due[1 - index] = t + 1e-14;
    return true;
  });
  KeptSamples kept;
  const auto done = go(system, {1, 0}, 1, 1e-2, kept);
  ASSERT_FALSE(done.ok()) << done->events << " events, up to " << done->end << " s";
  EXPECT_NE(done.error().sentence().find("t = 0.5"), std::string::npos) << done.error().sentence();
}

TEST_P(IntegratorConformance, AProjectedStateStaysWhereItBelongs) {
  // A body that turns at 2 rad/s about (0.6, 0, 0.8): quaternion, then the three velocities.
  TestSystem system(
      7,
      [](double, std::span<const double> x, std::span<double> dx) {
        dx[0] = -0.5 * (x[1] * x[4] + x[2] * x[5] + x[3] * x[6]);
        dx[1] = 0.5 * (x[0] * x[4] + x[2] * x[6] - x[3] * x[5]);
        dx[2] = 0.5 * (x[0] * x[5] + x[3] * x[4] - x[1] * x[6]);
        dx[3] = 0.5 * (x[0] * x[6] + x[1] * x[5] - x[2] * x[4]);
        dx[4] = dx[5] = dx[6] = 0;
      },
      4);
  system.projected([](std::span<double> x) {
    const double n = std::sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2] + x[3] * x[3]);
    for (std::size_t i = 0; i < 4; ++i) x[i] /= n;
  });
  KeptSamples kept;
  const double h = 1e-3;
  std::vector<double> times;
  for (int i = 0; i <= 20; ++i) times.push_back(0.1 * i);
  const auto done = go(system, {1, 0, 0, 0, 1.2, 0, 1.6}, 2, h, kept, times);
  ASSERT_TRUE(done.ok()) << done.error().sentence();
  for (std::size_t i = 0; i < kept.times.size(); ++i) {
    const auto& x = kept.states[i];
    EXPECT_NEAR(x[0] * x[0] + x[1] * x[1] + x[2] * x[2] + x[3] * x[3], 1, 4e-16 * 4);
    EXPECT_NEAR(x[0], std::cos(kept.times[i]), allowed(h));
    EXPECT_NEAR(x[3], 0.8 * std::sin(kept.times[i]), allowed(h));
  }
}

TEST_P(IntegratorConformance, EnergyOfALongFreeMotionStaysInBoundsWhereItIsPromised) {
  if (!GetParam().is_symplectic) GTEST_SKIP() << "it promises no such thing";
  auto system = oscillator();
  const double h = 0.05;
  const auto energy = [&](double end) {
    const auto x = last(system, {1, 0}, end, h);
    return 0.5 * (x[0] * x[0] + x[1] * x[1]);
  };
  EXPECT_NEAR(energy(20), 0.5, h * h + (GetParam().order == 1 ? h : 0));
  EXPECT_NEAR(energy(2000), 0.5, h * h + (GetParam().order == 1 ? h : 0));
}

TEST_P(IntegratorConformance, AStiffProblemIsRefusedWithItsTimeInsteadOfAnsweredWrongly) {
  TestSystem system(2, [](double, std::span<const double> x, std::span<double> dx) {
    dx[0] = x[1];
    dx[1] = -1e9 * (x[1] - std::cos(x[0])) - x[0];
  });
  KeptSamples kept;
  const auto done = go(system, {1, 0}, 10, 1e-3, kept);
  ASSERT_FALSE(done.ok());
  EXPECT_NE(done.error().sentence().find("t = "), std::string::npos) << done.error().sentence();
}

TEST_P(IntegratorConformance, RatesThatFailOrAreNotFiniteAreErrorsWithTheirTime) {
  TestSystem nan(2, [](double t, std::span<const double> x, std::span<double> dx) {
    dx[0] = x[1];
    dx[1] = t < 0.4 ? 1 : std::nan("");
  });
  KeptSamples kept;
  const auto first = go(nan, {0, 0}, 1, 1e-2, kept);
  ASSERT_FALSE(first.ok());
  EXPECT_NE(first.error().sentence().find("t = 0."), std::string::npos) << first.error().sentence();
  auto failing = oscillator();
  failing.fails_from = 0.4;
  const auto second = go(failing, {1, 0}, 1, 1e-2, kept);
  ASSERT_FALSE(second.ok());
  EXPECT_NE(second.error().sentence().find("the force gave up"), std::string::npos);
}

TEST_P(IntegratorConformance, SeveralThreadsGetTheSameRunsAtOnce) {
  const auto shared = make();
  ASSERT_NE(shared, nullptr);
  const std::vector<double> x0{1, 0, 0, 1.1}, times{1, 2, 3};
  const auto run_it = [&](KeptSamples& kept) {
    TestSystem system = kepler();
    OdeRun run;
    run.end = 3, run.x0 = x0, run.step = 1e-2, run.sample_times = times;
    NoProgress none;
    EXPECT_TRUE(shared->run(system, run, kept, none).ok());
  };
  KeptSamples alone;
  run_it(alone);
  std::array<KeptSamples, 4> together;
  at_once(together.size(), [&](std::size_t thread) { run_it(together[thread]); });
  for (const KeptSamples& kept : together) EXPECT_EQ(kept.states, alone.states);
}

TEST_P(IntegratorConformance, NothingIsAllocatedForAStep) {
  RMP_NEEDS_ALLOCATION_COUNTS();
  const auto shared = make();
  ASSERT_NE(shared, nullptr);
  class Nowhere final : public OdeSink {
   public:
    bool sample(double, std::span<const double>) override { return true; }
  } nowhere;
  const std::vector<double> x0{1, 0, 0, 1.1};
  TestSystem system = kepler();
  const auto until = [&](double end) {
    const std::vector<double> times{end};
    OdeRun run;
    run.end = end, run.x0 = x0, run.step = 1e-2, run.sample_times = times;
    NoProgress none;
    return allocations_in([&] { (void)shared->run(system, run, nowhere, none); });
  };
  (void)until(1);  // what is made once
  EXPECT_LE(until(20), until(1)) << "more steps, more allocations";
}

TEST_P(IntegratorConformance, WrongRunsAreRefusedAndCancelAndFullSinksEndIt) {
  auto system = oscillator();
  KeptSamples kept;
  EXPECT_FALSE(go(system, {1}, 1, 1e-3, kept).ok()) << "a state of one number";
  EXPECT_FALSE(go(system, {1, 0}, -1, 1e-3, kept).ok()) << "an end before the start";
  EXPECT_FALSE(go(system, {1, std::nan("")}, 1, 1e-3, kept).ok()) << "no number";
  EXPECT_FALSE(go(system, {1, 0}, 1, 0, kept).ok()) << "no step";
  EXPECT_FALSE(go(system, {1, 0}, 1, 1e-3, kept, {0.5, 0.2}).ok()) << "times that fall";
  EXPECT_FALSE(go(system, {1, 0}, 1, 1e-3, kept, {2}).ok()) << "a time beyond the end";
  KeptSamples full;
  full.most = 2;
  const auto ended = go(system, {1, 0}, 1, 1e-3, full, {0.1, 0.2, 0.3});
  ASSERT_TRUE(ended.ok());
  EXPECT_EQ(full.times.size(), 2U);
  const std::vector<double> x0{1, 0};
  OdeRun run;
  run.x0 = x0;
  CancelledRun stop;
  const auto stopped = make()->run(system, run, kept, stop);
  ASSERT_FALSE(stopped.ok());
  EXPECT_EQ(stopped.error().code, ErrorCode::cancelled);
}

}  // namespace robomosp::conformance
