// SPDX-License-Identifier: Apache-2.0
// Numeric inverse kinematics: 10,000 targets a robot, poses of random configurations within the
// limits, each from a random seed within the limits, to 1e-6 m and rad, one thread. Every answer is
// checked by a forward kinematics of the bench's own. Counters: share of targets solved [%], mean,
// median and 99 % time of a single call [us], time of a target in one batch [us].
#include <algorithm>
#include <chrono>

#include <benchmark/benchmark.h>

#include <robomosp/sdk/conformance/arms.h>
#include <robomosp/sdk/conformance/provider.h>
#include <robomosp/sdk/ik.h>

namespace robomosp {
namespace {

using namespace conformance;
using Clock = std::chrono::steady_clock;

constexpr std::size_t kTargets = 10000;

double microseconds(Clock::duration d) {
  return std::chrono::duration<double, std::micro>(d).count();
}

void numeric_ik(benchmark::State& state, const RobotModel& m) {
  const auto found =
      find_provider<IkSolver>(std::string(ROBOMOSP_PLUGIN_DIR) + "/ik_numeric.so", "numeric");
  if (!found.ok()) return state.SkipWithError("ik_numeric is not there");
  const auto solver = create<IkSolver>(**found);
  if (!solver->prepare(m, TableParams(**found)).ok()) return state.SkipWithError("prepare");
  Random random(4);
  std::vector<Pose> targets;
  std::vector<double> seeds;
  for (std::size_t i = 0; i < kTargets; ++i) {
    targets.push_back(tip_pose(m, random.configuration(m).data()));
    for (const double x : random.configuration(m)) seeds.push_back(x);
  }
  IkBatch batch;
  batch.tolerance = {1e-6, 1e-6};
  NoProgress none;
  const auto good = [&](const Pose& target, const IkResult& r) {
    if (r.status != IkStatus::solved) return false;
    for (std::size_t j = 0; j < m.dof(); ++j)
      if (!(r.q[j] >= m.joints[j].lower && r.q[j] <= m.joints[j].upper)) return false;
    const Pose at = tip_pose(m, r.q.data());
    return position_gap(at, target) <= 1e-6 && rotation_gap(at, target) <= 1e-6;
  };
  std::vector<double> took;
  double whole = 0;
  std::size_t solved = 0;
  for (auto _ : state) {
    took.clear(), solved = 0;
    for (std::size_t i = 0; i < kTargets; ++i) {
      std::vector<IkResult> result(1);
      batch.targets = {&targets[i], 1};
      batch.seeds = {seeds.data() + i * m.dof(), m.dof()};
      const auto start = Clock::now();
      (void)solver->solve(batch, result, none);
      took.push_back(microseconds(Clock::now() - start));
      solved += good(targets[i], result[0]);
    }
    std::vector<IkResult> results(kTargets);
    batch.targets = targets;
    batch.seeds = seeds;
    const auto start = Clock::now();
    (void)solver->solve(batch, results, none);
    whole = microseconds(Clock::now() - start);
  }
  double sum = 0;
  for (const double t : took) sum += t;
  std::sort(took.begin(), took.end());
  state.counters["solved_%"] = 100.0 * static_cast<double>(solved) / kTargets;
  state.counters["mean_us"] = sum / kTargets;
  state.counters["median_us"] = took[kTargets / 2];
  state.counters["p99_us"] = took[kTargets * 99 / 100];
  state.counters["batch_us"] = whole / kTargets;
}
BENCHMARK_CAPTURE(numeric_ik, puma560, puma560())->Unit(benchmark::kMillisecond)->Iterations(1);
BENCHMARK_CAPTURE(numeric_ik, panda, panda())->Unit(benchmark::kMillisecond)->Iterations(1);
BENCHMARK_CAPTURE(numeric_ik, iiwa14, iiwa14())->Unit(benchmark::kMillisecond)->Iterations(1);

}  // namespace
}  // namespace robomosp
