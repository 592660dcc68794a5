// SPDX-License-Identifier: Apache-2.0
// Providers in a process of their own beside the same in the program: the time that passes for a
// batch of 1,000 and for a single call, the two in turns, medians. `ratio` of the batches should be
// 1.2 at most.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>
#include <robomosp/sdk/conformance/models.h>
#include <robomosp/sdk/conformance/provider.h>
#include <robomosp/sdk/dynamics.h>
#include <robomosp/sdk/ik.h>

#include "kernel/plugin_loader.h"
#include "kernel/plugin_run.h"

namespace {

using namespace robomosp;

template <class I>
std::shared_ptr<I> bound(const std::string& plugin, const std::string& name, bool in_process,
                         const RobotModel& model) {
  static std::vector<std::unique_ptr<Registry>> registries;
  static std::vector<std::unique_ptr<PluginLoader>> loaders;
  Registry& registry = *registries.emplace_back(std::make_unique<Registry>());
  PluginLoader& loader = *loaders.emplace_back(std::make_unique<PluginLoader>(registry));
  const PluginRunScope scope(PluginRun{in_process, {}});
  if (const auto& r = loader.load(std::string(ROBOMOSP_PLUGIN_DIR) + "/" + plugin + ".so");
      r.refusal) {
    std::fprintf(stderr, "%s\n", r.refusal->sentence().c_str());
    std::abort();
  }
  auto made = registry.create<I>(name);
  const auto info = registry.find(I::kInterfaceId, name);
  const auto params = make_params(*check(info->schema, {}));
  if (!made.ok() || !(*made)->prepare(model, *params).ok()) std::abort();
  return *made;
}

double seconds(const std::function<void()>& work) {
  const auto begin = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}
double median(std::vector<double> all) {
  std::nth_element(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2),
                   all.end());
  return all[all.size() / 2];
}
/// In turns, as long as the benchmark runs.
void compare(benchmark::State& state, const std::function<void()>& inside,
             const std::function<void()>& outside) {
  std::vector<double> in, out;
  inside();
  outside();
  for (auto _ : state) {
    in.push_back(seconds(inside));
    out.push_back(seconds(outside));
  }
  state.counters["in_us"] = 1e6 * median(in);
  state.counters["out_us"] = 1e6 * median(out);
  state.counters["ratio"] = median(out) / median(in);
}

const RobotModel& puma() {
  static const RobotModel m = conformance::puma560();
  return m;
}

void dynamics(benchmark::State& state) {
  const auto count = static_cast<std::size_t>(state.range(0));
  std::mt19937 random(1);
  std::uniform_real_distribution<double> any(-1, 1);
  std::vector<double> q(6 * count), qd(q), qdd(q), tau(q);
  for (auto* all : {&q, &qd, &qdd})
    for (double& x : *all) x = any(random);
  const auto call = [&](const std::shared_ptr<InverseDynamics>& s) {
    return [&, s, scratch = std::make_shared<std::vector<double>>(s->scratch_size())] {
      DynamicsBatch b;
      b.count = count;
      b.q = q;
      b.qd = qd;
      b.qdd = qdd;
      b.scratch = *scratch;
      NoProgress none;
      if (!s->torques(b, tau, none).ok()) std::abort();
    };
  };
  compare(state,
          call(bound<InverseDynamics>("dynamics_newton_euler", "newton_euler", true, puma())),
          call(bound<InverseDynamics>("dynamics_newton_euler", "newton_euler", false, puma())));
}
BENCHMARK(dynamics)->Name("inverse dynamics")->Arg(1000)->Arg(1)->Unit(benchmark::kMicrosecond);

void ik(benchmark::State& state, const char* plugin, const char* name) {
  const auto count = static_cast<std::size_t>(state.range(0));
  std::mt19937 random(2);
  std::uniform_real_distribution<double> any(-1, 1);
  std::vector<Pose> targets;
  std::vector<double> seeds;
  for (std::size_t i = 0; i < count; ++i) {
    const double a = any(random), c = std::cos(a), s = std::sin(a);
    Pose p;
    p.R = {c, -s, 0, s, c, 0, 0, 0, 1};
    p.p = {0.4 + 0.1 * any(random), 0.2 + 0.1 * any(random), 0.2 * any(random)};
    targets.push_back(p);
  }
  seeds.assign(6, 0.3);
  std::vector<IkResult> results(count);
  const auto call = [&](const std::shared_ptr<IkSolver>& s) {
    return [&, s] {
      IkBatch b;
      b.targets = targets;
      b.seeds = seeds;
      NoProgress none;
      if (!s->solve(b, results, none).ok()) std::abort();
    };
  };
  compare(state, call(bound<IkSolver>(plugin, name, true, puma())),
          call(bound<IkSolver>(plugin, name, false, puma())));
}
BENCHMARK_CAPTURE(ik, numeric, "ik_numeric", "numeric")
    ->Arg(1000)
    ->Arg(1)
    ->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(ik, closed form, "ik_spherical_wrist", "spherical_wrist")
    ->Arg(1000)
    ->Arg(1)
    ->Unit(benchmark::kMicrosecond);

}  // namespace
