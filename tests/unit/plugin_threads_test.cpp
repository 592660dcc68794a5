// SPDX-License-Identifier: Apache-2.0
// Plugins that divide their work take the threads of the program: those of the whole process are
// counted while several jobs run batches of such plugins at once.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <iterator>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include <robomosp/sdk/collision.h>
#include <robomosp/sdk/conformance/mechanisms.h>
#include <robomosp/sdk/conformance/models.h>
#include <robomosp/sdk/dynamics.h>

#include "kernel/executor.h"
#include "kernel/jobs.h"
#include "kernel/plugin_loader.h"
#include "kernel/registry.h"
#include "kernel/schema.h"

namespace robomosp {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

/// Threads of this process.
std::size_t thread_count() {
  const fs::directory_iterator all("/proc/self/task");
  return static_cast<std::size_t>(std::distance(begin(all), end(all)));
}

TEST(PluginThreads, BatchesOfSeveralJobsShareTheThreadsOfTheProgram) {
  constexpr std::size_t kJobs = 4, kSamples = 4000, kLong = 300, kArm = 7;
  Registry registry;
  PluginLoader loader(registry);
  loader.set_search_path({ROBOMOSP_PLUGIN_DIR});
  loader.load_all();
  // Each of these would start eight threads a call, or one for each core.
  const auto params =
      make_params({{"threads", 8}, {"instructions", "auto"}, {"inertia_method", "composite"}});
  const auto engine = registry.create<CollisionEngine>("fcl");
  const auto halves = registry.create<ForwardDynamics>("divide_and_conquer");
  const auto inverse = registry.create<InverseDynamics>("newton_euler");
  ASSERT_TRUE(engine.ok() && halves.ok() && inverse.ok());
  NoProgress none;
  Shape ball;
  ball.kind = ShapeKind::sphere;
  ball.sizes = {0.1, 0, 0};
  const std::vector<ShapedBody> balls{{{ball}}, {{ball}}};
  const auto scene = (*engine)->build(balls, *params, none);
  ASSERT_TRUE(scene.ok()) << scene.error().sentence();
  const RobotModel chain = conformance::long_chain(static_cast<int>(kLong)),
                   arm = conformance::pa10();
  ASSERT_TRUE((*halves)->prepare(chain, *params).ok());
  ASSERT_TRUE((*inverse)->prepare(arm, *params).ok());

  const std::vector<double> still(std::max(kSamples * kArm, kLong), 0.1);
  std::vector<Pose> poses(2 * kSamples);
  for (std::size_t i = 0; i < kSamples; ++i) poses[2 * i].p = {1 + 1e-3 * static_cast<double>(i)};
  const std::vector<CollisionPair> pair{{0, 1}};
  std::atomic<bool> is_over{false};
  std::atomic<int> rounds{0};
  const auto work = [&](Progress& progress) -> Result<Value> {
    std::vector<PairDistance> apart(kSamples);
    std::vector<double> accelerations(kLong), torques(kSamples * kArm),
        of_halves((*halves)->scratch_size()), of_inverse((*inverse)->scratch_size());
    do {
      RMP_TRY((*scene)->distances(poses, pair, 100, apart, progress));
      for (std::size_t i = 0; i < kSamples; ++i)
        if (std::abs(apart[i].distance - (poses[2 * i].p[0] - 0.2)) > 1e-12)
          return error(ErrorCode::internal, "distance " + std::to_string(i) + " is wrong");
      DynamicsBatch batch;
      batch.count = 1;
      batch.q = {still.data(), kLong};
      batch.scratch = of_halves;
      RMP_TRY((*halves)->accelerations(batch, accelerations, progress));
      batch.count = kSamples;
      batch.q = {still.data(), kSamples * kArm};
      batch.scratch = of_inverse;
      RMP_TRY((*inverse)->torques(batch, torques, progress));
      for (std::size_t i = kArm; i < torques.size(); ++i)
        if (std::abs(torques[i] - torques[i - kArm]) > 1e-9)
          return error(ErrorCode::internal, "equal samples have other torques");
      ++rounds;
    } while (!is_over);
    return Value(true);
  };
  Jobs jobs(kJobs);
  const std::size_t before = thread_count();
  std::vector<std::uint64_t> all;
  for (std::size_t i = 0; i < kJobs; ++i) all.push_back(jobs.submit("batches", work));
  std::size_t most = 0;
  while (rounds < 50) {
    most = std::max(most, thread_count());
    std::this_thread::sleep_for(200us);
  }
  is_over = true;
  for (const std::uint64_t job : all) {
    const auto done = jobs.wait(job);
    EXPECT_TRUE(done.ok()) << done.error().sentence();
  }
  EXPECT_GT(most, before) << "the jobs were seen at work";
  EXPECT_LE(most, before + kJobs + Executor::of_process().cores() - 1)
      << "one thread a job, and helpers that all share";
}

}  // namespace
}  // namespace robomosp
