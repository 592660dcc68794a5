// SPDX-License-Identifier: Apache-2.0
// Trajectories of ten segments: building them, and their poses, velocities and accelerations at
// 100,000 times.
#include <numbers>
#include <vector>

#include <benchmark/benchmark.h>

#include "bench/ten_segments.h"
#include "kernel/plugin_loader.h"
#include "kernel/registry.h"
#include "motion/cartesian_path.h"

namespace {

using namespace robomosp;
using model::Placement;
using model::Trajectory;
using model::TrajectorySegment;

const Registry& registry() {
  static const Registry* made = [] {
    auto* r = new Registry;
    auto* loader = new PluginLoader(*r);
    for (const char* name : {"path_analytic", "path_splines"})
      loader->load(std::string(ROBOMOSP_PLUGIN_DIR) + "/" + name + ".so");
    return r;
  }();
  return *made;
}

Placement place(double x, double y, double z, double roll, double yaw) {
  return {{x, y, z}, {roll, 0, yaw}, {}};
}

/// The same ways as ten straight lines.
Trajectory lines() {
  Trajectory t;
  for (int i = 0; i < 10; ++i) {
    TrajectorySegment s;
    s.shape.name = "line";
    for (int k = i; k < i + 2; ++k)
      s.points.push_back(place(0.3 * k, k % 2 ? 0.4 : 0, 0, 0.1 * k, 0));
    s.law.name = "s_curve";
    t.segments.push_back(std::move(s));
  }
  return t;
}

Trajectory mixed() { return bench::ten_mixed_segments(); }

void build(benchmark::State& state, Trajectory (*make)()) {
  const Trajectory t = make();
  for (auto _ : state) {
    auto path = motion::Path::build(registry(), "bench", t);
    if (!path.ok()) state.SkipWithError(path.error().sentence().c_str());
    benchmark::DoNotOptimize(path);
  }
}

void sample(benchmark::State& state, Trajectory (*make)()) {
  const auto path = motion::Path::build(registry(), "bench", make());
  if (!path.ok()) {
    state.SkipWithError(path.error().sentence().c_str());
    return;
  }
  constexpr std::size_t kCount = 100'000;
  std::vector<double> times(kCount);
  for (std::size_t i = 0; i < kCount; ++i)
    times[i] = (*path)->duration() * static_cast<double>(i) / (kCount - 1);
  std::vector<PathSample> out(kCount);
  for (auto _ : state) {
    (void)(*path)->sample(times, out);
    benchmark::DoNotOptimize(out.data());
  }
  state.counters["ns_a_sample"] = benchmark::Counter(
      kCount * 1e-9, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

BENCHMARK_CAPTURE(build, ten_mixed_segments, mixed)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(sample, ten_mixed_segments_100000, mixed)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(sample, ten_lines_100000, lines)->Unit(benchmark::kMillisecond);

}  // namespace
