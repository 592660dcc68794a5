// SPDX-License-Identifier: Apache-2.0
// Jerk-limited, time-optimal motion of seven joints from random states to random states: prepared,
// timed together, and the pieces of every joint. The same task (states and limits drawn from the
// distributions of its own benchmark) took Ruckig 6.3 us on the reference machine.
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include <benchmark/benchmark.h>

#include "spatial/state_to_state.h"

namespace {

using namespace robomosp::spatial;

constexpr std::size_t kDof = 7;

struct Task {
  std::array<Motion1, kDof> start, end;
  std::array<StateLimits, kDof> limits;
};

std::vector<Task> tasks() {
  std::mt19937 random(42);
  std::normal_distribution<double> place(0, 4), rate(0, 0.8);
  std::uniform_real_distribution<double> limit(0.1, 12);
  std::vector<Task> out(4096);
  for (Task& t : out)
    for (std::size_t j = 0; j < kDof; ++j) {
      Motion1& s = t.start[j] = {place(random), rate(random), rate(random), 0};
      Motion1& e = t.end[j] = {place(random), rate(random), rate(random), 0};
      s.j = e.j = 0;
      StateLimits& l = t.limits[j];
      l = {limit(random) + std::fabs(e.v), limit(random) + std::fabs(e.a), limit(random)};
      while (std::fabs(e.v) + e.a * e.a / 2 / l.j > l.v) e.v *= 0.8, e.a *= 0.8;
    }
  return out;
}

void state_to_state(benchmark::State& state) {
  const std::vector<Task> all = tasks();
  std::array<StateToState, kDof> work;
  std::array<Ramps, kDof> motion;
  std::size_t k = 0;
  for (auto _ : state) {
    const Task& t = all[k++ % all.size()];
    for (std::size_t j = 0; j < kDof; ++j)
      if (work[j].prepare(t.start[j], t.end[j], t.limits[j]) != StateToState::Fault::none)
        state.SkipWithError("a state is refused");
    const double T = common_duration(work);
    for (std::size_t j = 0; j < kDof; ++j) motion[j] = work[j].motion(T);
    benchmark::DoNotOptimize(motion);
  }
}
BENCHMARK(state_to_state)->Unit(benchmark::kMicrosecond);

}  // namespace
