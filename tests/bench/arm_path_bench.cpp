// SPDX-License-Identifier: Apache-2.0
// A seven-joint arm along a trajectory of ten segments at 100,000 samples: sampling the path,
// inverse kinematics, joint rates, torques, limits and the recording. Target: 100 ms in all.
#include <cmath>
#include <memory>

#include <benchmark/benchmark.h>

#include "bench/ten_segments.h"
#include "motion/path.h"
#include "sim/simulate.h"
#include "support/workbench.h"

namespace robomosp {
namespace {

constexpr double kSamples = 100'000;

/// An arm of the library on the ten segments in front of it, the tool down.
struct Cell {
  test::Workbench bench;
  NoProgress progress;
  WorldId world;
  double step = 0;

  explicit Cell(const char* robot) {
    const AnyId arm = bench.load(std::string("robots/") + robot + ".rbt");
    const model::Trajectory ten = bench::ten_mixed_segments(0.2);
    const auto path = test::unwrap(motion::Path::build(bench.registry, "ten", ten));
    step = path->duration() / (kSamples - 1);
    auto begun = bench.document.begin("cell");
    document::Transaction& t = *begun;
    const TrajectoryId id = test::unwrap(t.add("ten", ten));
    model::World w;
    w.robots.push_back({"arm", RobotId{arm.number}, {}, {}});
    w.trajectories.push_back({"ten", id, {.position = {0.45, -0.18, 0.4}, .angles = {M_PI, 0, 0}}});
    world = test::unwrap(t.add("cell", std::move(w)));
    if (auto done = t.commit(); !done.ok()) ADD_FAILURE() << done.error().sentence();
  }
};

void arm_path(benchmark::State& state, const char* robot, bool has_torques) {
  Cell cell(robot);
  const auto snapshot = cell.bench.document.now();
  const sim::Simulator simulator{cell.bench.registry, cell.bench.derived, *snapshot};
  const sim::Run run{
      .world = cell.world, .robot = "arm", .trajectory = "ten", .sample_time = cell.step};
  std::size_t rows = 0;
  for (auto _ : state) {
    auto r = has_torques ? simulator.inverse_dynamics(run, cell.progress)
                         : simulator.inverse_kinematics(run, cell.progress);
    if (!r.ok()) {
      state.SkipWithError(r.error().sentence().c_str());
      return;
    }
    rows = (*r)->rows();
  }
  state.counters["samples"] = static_cast<double>(rows);
}
BENCHMARK_CAPTURE(arm_path, pa10_kinematics, "pa10", false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(arm_path, pa10, "pa10", true)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(arm_path, panda, "panda", true)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace robomosp
