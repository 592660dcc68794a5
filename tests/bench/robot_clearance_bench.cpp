// SPDX-License-Identifier: Apache-2.0
// The library's robots: the first clearance with and without the geometry that a run before kept,
// and one configuration after the other, within a tolerance, exactly, and by every pair.
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include "collision/collision.h"
#include "collision/random.h"
#include "document/document.h"
#include "evaluation/derived.h"
#include "io/native.h"
#include "kernel/file_cache.h"
#include "kernel/plugin_loader.h"
#include "kernel/registry.h"

namespace robomosp {
namespace {

namespace fs = std::filesystem;

constexpr const char* kRobots[] = {"pa10", "puma560", "panda", "ur10e", "irb140", "delta"};
constexpr std::size_t kConfigurations = 64;

struct Robot {
  explicit Robot(const char* name) {
    loader.set_search_path({ROBOMOSP_PLUGIN_DIR});
    loader.load_all();
    auto t = document.begin("robot");
    const fs::path library = fs::path(ROBOMOSP_SOURCE_DIR) / "scripts/library";
    id = RobotId{
        io::load(*t, library / "robots" / (std::string(name) + ".rbt"), {library})->id.number};
    (void)t->commit();
  }
  std::shared_ptr<const collision::CollisionModel> model(evaluation::Derived& derived) {
    const auto now = document.now();
    return *collision::CollisionModel::of_robot({registry, derived, *now}, id, none);
  }
  Registry registry;
  PluginLoader loader{registry};
  document::Document document;
  RobotId id;
  NoProgress none;
};

struct Folder {
  fs::path path;
  Folder() {
    std::string name = (fs::temp_directory_path() / "robomosp-bench-XXXXXX").string();
    path = ::mkdtemp(name.data());
  }
  ~Folder() { fs::remove_all(path); }
};

/// Solids, shapes, the collision model and one clearance; 1 = with what a run before has kept.
void first_clearance(benchmark::State& state) {
  Robot robot(kRobots[state.range(0)]);
  const Folder folder;
  const auto run = [&](bool is_kept) {
    evaluation::Derived derived(robot.registry);
    if (is_kept)
      derived.keep_in(std::make_shared<FileCache>(FileCache::Options{.folder = folder.path}));
    const auto model = robot.model(derived);
    benchmark::DoNotOptimize(model->clearance(model->shown(), 0.002, robot.none));
  };
  const bool is_kept = state.range(1) != 0;
  if (is_kept) run(true);
  for (auto _ : state) run(is_kept);
  state.SetLabel(std::string(kRobots[state.range(0)]) + (is_kept ? ", kept" : ", computed"));
}
BENCHMARK(first_clearance)
    ->ArgsProduct({{0, 1, 2, 3, 4, 5}, {0, 1}})
    ->Unit(benchmark::kMillisecond);

/// 0 = within 2 mm, 1 = exactly, 2 = the least of every pair's distance.
void clearance(benchmark::State& state) {
  static std::unique_ptr<Robot> robot;
  static std::unique_ptr<evaluation::Derived> derived;
  static std::shared_ptr<const collision::CollisionModel> model;
  static std::int64_t which = -1;
  if (which != state.range(0)) {
    which = state.range(0);
    model.reset();
    derived.reset();
    robot = std::make_unique<Robot>(kRobots[which]);
    derived = std::make_unique<evaluation::Derived>(robot->registry);
    model = robot->model(*derived);
  }
  collision::Random random(1);
  const std::size_t n = model->coordinate_count();
  std::vector<double> q(kConfigurations * n);
  for (std::size_t i = 0; i < kConfigurations; ++i)
    collision::random_configuration(*model->robots()[0].model, random, &q[i * n]);
  const char* const words[] = {", within 2 mm", ", exactly", ", every pair"};
  const auto one = [&](std::size_t i) {
    const auto at = std::span(q).subspan(i * n, n);
    if (state.range(1) == 2)
      benchmark::DoNotOptimize(
          model->distances(at, std::numeric_limits<double>::infinity(), robot->none));
    else
      benchmark::DoNotOptimize(
          model->clearance(at, state.range(1) == 0 ? 0.002 : 0.0, robot->none));
  };
  one(0);  // FCL's trees are made with the first exact distance
  std::size_t i = 0;
  for (auto _ : state) one(i++ % kConfigurations);
  state.SetLabel(kRobots[which] + std::string(words[state.range(1)]));
}
BENCHMARK(clearance)->ArgsProduct({{0, 1, 2, 3, 4, 5}, {0, 1, 2}})->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace robomosp
