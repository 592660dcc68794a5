// SPDX-License-Identifier: Apache-2.0
// A seven-joint arm along a trajectory of ten segments at 100,000 samples: sampling the path,
// inverse kinematics with its checks, joint rates and torques (target: 100 ms in all), and the same
// as a recording, with limits and the parts of the torques.
#include <cmath>
#include <memory>

#include <benchmark/benchmark.h>

#include "bench/ten_segments.h"
#include "model/placement.h"
#include "motion/cartesian_path.h"
#include "robotics/home.h"
#include "sim/robot_motion.h"
#include "sim/simulate.h"
#include "spatial/pose.h"
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
/// Joints, their rates and the torques alone: no columns, no parts of the torques, no notes.
void arm_path_tables(benchmark::State& state, const char* robot) {
  Cell cell(robot);
  const auto snapshot = cell.bench.document.now();
  const model::World& world = *snapshot->get(cell.world);
  const model::Robot& record = *snapshot->get(world.robots.front().robot);
  const auto model = test::unwrap(cell.bench.derived.robot_model(
      *snapshot, world.robots.front().robot, world.gravity, cell.progress));
  const auto dynamics = sim::bind_inverse_dynamics(cell.bench.registry, model, {});
  sim::RobotMotionTask task;
  task.model = model;
  task.ik = record.ik;
  task.start = robotics::home_joint_values(record);
  task.trajectory = snapshot->get(world.trajectories.front().trajectory);
  task.name = "ten";
  task.base_T_trajectory = spatial::compose(spatial::inverse(model->base),
                                            model::pose(world.trajectories.front().placement));
  task.step = cell.step;
  for (auto _ : state) {
    const auto motion = sim::robot_motion(cell.bench.registry, task, cell.progress);
    if (!motion.ok()) {
      state.SkipWithError(motion.error().sentence().c_str());
      return;
    }
    DynamicsBatch batch;
    batch.count = motion->times.size();
    batch.q = motion->q, batch.qd = motion->qd, batch.qdd = motion->qdd;
    benchmark::DoNotOptimize(sim::torques(*dynamics, batch, cell.progress));
  }
}
BENCHMARK_CAPTURE(arm_path_tables, pa10, "pa10")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(arm_path, pa10_kinematics, "pa10", false)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(arm_path, pa10, "pa10", true)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(arm_path, panda, "panda", true)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace robomosp
