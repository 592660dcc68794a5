// SPDX-License-Identifier: Apache-2.0
// Inverse kinematics in closed form: time a target, single and in batches, and the greatest error
// of all its solutions. Targets of shared/design/performance.md: 6R, all eight solutions, 0.8 us
// single and 0.15 us a sample in batches, error 1e-12.
#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include <robomosp/sdk/conformance/arms.h>
#include <robomosp/sdk/conformance/provider.h>
#include <robomosp/sdk/ik.h>

namespace robomosp::conformance {
namespace {

constexpr std::size_t kPool = 1024;

enum class Answers { nearest, all };

struct Case {
  RobotModel model;
  const char* plugin;
  const char* provider;
};
Case puma() { return {puma560(), "ik_spherical_wrist", "spherical_wrist"}; }
Case ur() { return {within_one_turn(ur5()), "ik_spherical_wrist", "spherical_wrist"}; }
Case skew() { return {skew_arm(), "ik_spherical_wrist", "spherical_wrist"}; }
Case iiwa() { return {iiwa14(), "ik_srs", "srs"}; }

// Reachable targets, or the same 1 m farther out; one call solves `samples` of them.
void closed_form(benchmark::State& state, const Case& c, Answers answers, std::size_t samples,
                 bool reachable = true, bool path = false) {
  const std::string file = std::string(ROBOMOSP_PLUGIN_DIR) + "/" + c.plugin + ".so";
  const auto found = find_provider<IkSolver>(file, c.provider);
  if (!found.ok()) return state.SkipWithError("the plugin is missing");
  const auto solver = create<IkSolver>(**found);
  TableParams params(**found);
  params.set("turns", "false");
  if (!solver->prepare(c.model, params).ok()) return state.SkipWithError("refused");
  Random random(2);
  const std::size_t n = c.model.dof();
  std::vector<Pose> targets;
  std::vector<double> seeds, at = random.configuration(c.model);
  for (std::size_t i = 0; i < kPool; ++i) {
    // A path is a slow motion from one configuration to another.
    if (path)
      for (std::size_t j = 0; j < n; ++j) at[j] += 1e-4 * (at[j] < 0 ? 1 : -1);
    else at = random.configuration(c.model);
    targets.push_back(tip_pose(c.model, at.data()));
    if (!reachable) targets.back().p[0] += targets.back().p[0] < 0 ? -2 : 2;
    const auto seed = path ? at : random.configuration(c.model);
    seeds.insert(seeds.end(), seed.begin(), seed.end());
  }
  std::vector<IkResult> results(samples);
  NoProgress none;
  IkBatch batch;
  batch.all_solutions = answers == Answers::all;
  batch.continuous = path;
  std::size_t i = 0;
  for (auto _ : state) {
    batch.targets = {&targets[i], samples};
    batch.seeds = {&seeds[i * n], samples * n};
    if (!solver->solve(batch, results, none).ok()) return state.SkipWithError("solve failed");
    benchmark::DoNotOptimize(results.data());
    i = (i + samples) % kPool;
  }
  double worst = 0;
  std::size_t solved = 0, solutions = 0;
  batch.targets = targets;
  batch.seeds = seeds;
  results.resize(kPool);
  if (!solver->solve(batch, results, none).ok()) return state.SkipWithError("solve failed");
  for (std::size_t t = 0; t < kPool; ++t) {
    if (results[t].status != IkStatus::solved) continue;
    ++solved;
    for (std::size_t k = 0; k < results[t].q.size() / n; ++k, ++solutions) {
      const Pose tip = tip_pose(c.model, &results[t].q[k * n]);
      worst = std::max({worst, position_gap(tip, targets[t]), rotation_gap(tip, targets[t])});
    }
  }
  state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations() * samples));
  state.counters["ns_per_target"] =
      benchmark::Counter(static_cast<double>(state.iterations() * samples) * 1e-9,
                         benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
  state.counters["solved_percent"] = 100.0 * static_cast<double>(solved) / kPool;
  state.counters["solutions"] =
      solved ? static_cast<double>(solutions) / static_cast<double>(solved) : 0;
  state.counters["worst_error"] = worst;
}
BENCHMARK_CAPTURE(closed_form, puma_all_single, puma(), Answers::all, 1);
BENCHMARK_CAPTURE(closed_form, puma_all_batch, puma(), Answers::all, kPool);
BENCHMARK_CAPTURE(closed_form, puma_nearest_single, puma(), Answers::nearest, 1);
BENCHMARK_CAPTURE(closed_form, puma_nearest_batch, puma(), Answers::nearest, kPool);
BENCHMARK_CAPTURE(closed_form, puma_path, puma(), Answers::nearest, kPool, true, true);
BENCHMARK_CAPTURE(closed_form, puma_unreachable, puma(), Answers::nearest, 1, false);
BENCHMARK_CAPTURE(closed_form, ur5_all_single, ur(), Answers::all, 1);
BENCHMARK_CAPTURE(closed_form, ur5_all_batch, ur(), Answers::all, kPool);
BENCHMARK_CAPTURE(closed_form, skew_all_single, skew(), Answers::all, 1);
BENCHMARK_CAPTURE(closed_form, iiwa_nearest_single, iiwa(), Answers::nearest, 1);
BENCHMARK_CAPTURE(closed_form, iiwa_all_single, iiwa(), Answers::all, 1);
BENCHMARK_CAPTURE(closed_form, iiwa_path, iiwa(), Answers::nearest, kPool, true, true);
BENCHMARK_CAPTURE(closed_form, iiwa_unreachable, iiwa(), Answers::nearest, 1, false);

}  // namespace
}  // namespace robomosp::conformance
