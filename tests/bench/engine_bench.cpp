// SPDX-License-Identifier: Apache-2.0
// Kinematics, dynamics and inverse kinematics: time a call and a sample. States are a pool of 1024
// random ones, cycled, so that branch prediction does not learn them.
#include <benchmark/benchmark.h>

#include <robomosp/sdk/conformance/mechanisms.h>
#include <robomosp/sdk/conformance/provider.h>
#include <robomosp/sdk/dynamics.h>
#include <robomosp/sdk/ik.h>

#include "robotics/kinematics.h"

namespace robomosp {
namespace {

using namespace conformance;

constexpr std::size_t kPool = 1024;
const std::string kPlugins = ROBOMOSP_PLUGIN_DIR;

struct States {
  explicit States(const RobotModel& m) {
    Random random(1);
    for (std::size_t i = 0; i < kPool; ++i)
      for (const double x : random.configuration(m)) q.push_back(x);
    qd = random.vector(q.size(), -1, 1);
    u = random.vector(q.size(), -2, 2);
  }
  std::vector<double> q, qd, u;
};

RobotModel puma_links_only() {
  RobotModel m = puma560();
  for (JointModel& j : m.joints) j.armature = 0, j.friction = {};
  return m;
}

template <class Interface>
std::unique_ptr<Interface> provider(const char* file, const char* name, const RobotModel& m) {
  auto found = find_provider<Interface>(kPlugins + file, name);
  if (!found.ok()) return nullptr;
  auto made = create<Interface>(**found);
  return made->prepare(m, TableParams(**found)).ok() ? std::move(made) : nullptr;
}

void forward_kinematics_single(benchmark::State& state) {
  const RobotModel m = puma560();
  const States s(m);
  std::vector<Pose> frames(m.joints.size());
  std::size_t i = 0;
  for (auto _ : state) {
    robotics::forward_kinematics(m, {s.q.data() + i * m.dof(), m.dof()}, frames);
    benchmark::DoNotOptimize(robotics::tip_pose(m, 0, frames));
    i = (i + 1) % kPool;
  }
}
BENCHMARK(forward_kinematics_single);

void jacobian_with_pose(benchmark::State& state) {
  const RobotModel m = puma560();
  const States s(m);
  std::vector<Pose> frames(m.joints.size());
  std::vector<double> J(6 * m.dof());
  std::size_t i = 0;
  for (auto _ : state) {
    robotics::forward_kinematics(m, {s.q.data() + i * m.dof(), m.dof()}, frames);
    robotics::geometric_jacobian(m, 0, frames, robotics::JacobianFrame::base, J);
    benchmark::DoNotOptimize(J.data());
    i = (i + 1) % kPool;
  }
}
BENCHMARK(jacobian_with_pose);

enum class What { torques, inertia, accelerations };

// `samples` states a call, over the pool.
void dynamics(benchmark::State& state, const RobotModel& m, What what, std::size_t samples) {
  const auto inverse = provider<InverseDynamics>("/dynamics_newton_euler.so", "newton_euler", m);
  const auto forward = provider<ForwardDynamics>("/dynamics_newton_euler.so", "inertia_matrix", m);
  if (!inverse || !forward) return state.SkipWithError("the plugin is missing");
  const States s(m);
  const std::size_t n = m.dof();
  std::vector<double> scratch(std::max(inverse->scratch_size(), forward->scratch_size())),
      out(samples * n * n);
  NoProgress none;
  std::size_t i = 0;
  for (auto _ : state) {
    DynamicsBatch b;
    b.count = samples;
    b.q = {s.q.data() + i * n, samples * n};
    b.qd = {s.qd.data() + i * n, samples * n};
    b.scratch = scratch;
    Result<void> r;
    if (what == What::torques) {
      b.qdd = {s.u.data() + i * n, samples * n};
      r = inverse->torques(b, {out.data(), samples * n}, none);
    } else if (what == What::inertia) {
      r = inverse->inertia(b, {out.data(), samples * n * n}, none);
    } else {
      b.tau = {s.u.data() + i * n, samples * n};
      r = forward->accelerations(b, {out.data(), samples * n}, none);
    }
    if (!r.ok()) return state.SkipWithError(r.error().sentence().c_str());
    benchmark::DoNotOptimize(out.data());
    i = (i + samples) % kPool;
  }
  state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations() * samples));
}
BENCHMARK_CAPTURE(dynamics, inverse_puma_single, puma_links_only(), What::torques, 1);
BENCHMARK_CAPTURE(dynamics, inverse_puma_batch, puma_links_only(), What::torques, kPool);
BENCHMARK_CAPTURE(dynamics, inertia_puma_single, puma_links_only(), What::inertia, 1);
BENCHMARK_CAPTURE(dynamics, forward_puma_single, puma_links_only(), What::accelerations, 1);
BENCHMARK_CAPTURE(dynamics, inverse_chain100, long_chain(100), What::torques, 1);
BENCHMARK_CAPTURE(dynamics, inertia_chain100, long_chain(100), What::inertia, 1);
BENCHMARK_CAPTURE(dynamics, forward_chain100, long_chain(100), What::accelerations, 1);

// Targets are poses of random configurations within the limits, seeds are other random ones;
// counters: share solved [%] and iterations a target.
void inverse_kinematics(benchmark::State& state, const RobotModel& m, double tolerance) {
  const auto solver = provider<IkSolver>("/ik_numeric.so", "numeric", m);
  if (!solver) return state.SkipWithError("the plugin is missing");
  Random random(2);
  std::vector<Pose> targets;
  std::vector<double> seeds;
  for (std::size_t i = 0; i < kPool; ++i) {
    targets.push_back(conformance::tip_pose(m, random.configuration(m).data()));
    for (const double x : random.configuration(m)) seeds.push_back(x);
  }
  std::vector<IkResult> results(1);
  NoProgress none;
  std::size_t i = 0, solved = 0, steps = 0;
  for (auto _ : state) {
    IkBatch b;
    b.targets = {&targets[i], 1};
    b.seeds = {seeds.data() + i * m.dof(), m.dof()};
    b.tolerance = {tolerance, tolerance};
    if (!solver->solve(b, results, none).ok()) return state.SkipWithError("solve failed");
    solved += results[0].status == IkStatus::solved ? 1 : 0;
    steps += static_cast<std::size_t>(results[0].iterations);
    i = (i + 1) % kPool;
  }
  const auto calls = static_cast<double>(state.iterations());
  state.counters["solved_percent"] = 100 * static_cast<double>(solved) / calls;
  state.counters["iterations"] = static_cast<double>(steps) / calls;
}
BENCHMARK_CAPTURE(inverse_kinematics, puma_1e6, puma560(), 1e-6)->Iterations(10240);
BENCHMARK_CAPTURE(inverse_kinematics, panda_1e6, panda(), 1e-6)->Iterations(10240);
BENCHMARK_CAPTURE(inverse_kinematics, pa10_1e6, pa10(), 1e-6)->Iterations(10240);
BENCHMARK_CAPTURE(inverse_kinematics, pa10_1e9, pa10(), 1e-9)->Iterations(10240);

}  // namespace
}  // namespace robomosp
