// SPDX-License-Identifier: Apache-2.0
// From a program that is not running to a world that is ready: start, plugins, files, solids.
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string>

#include <benchmark/benchmark.h>

#include "document/world_index.h"
#include "ioci/core/application.h"

namespace robomosp {
namespace {

ioci::ApplicationOptions options() {
  return {.plugin_path = {ROBOMOSP_PLUGIN_DIR},
          .library = {std::filesystem::path(ROBOMOSP_SOURCE_DIR) / "scripts/library"}};
}

/// The whole program as a child: start, plugins, Lua, one expression, end.
void start_to_first_answer(benchmark::State& state) {
  const std::string program = std::string(ROBOMOSP_BUILD_DIR) + "/bin/robomosp";
  for (auto _ : state) {
    const pid_t child = fork();
    if (child == 0) {
      if (!std::freopen("/dev/null", "w", stdout)) _exit(126);
      execl(program.c_str(), program.c_str(), "eval", "1", static_cast<char*>(nullptr));
      _exit(127);
    }
    int status = 0;
    waitpid(child, &status, 0);
    if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
      state.SkipWithError("robomosp eval 1 failed");
  }
}
BENCHMARK(start_to_first_answer)->Unit(benchmark::kMillisecond)->UseRealTime();

/// Files read and every solid of the PA-10 world meshed and weighed, nothing cached.
void load_pa10_world_cold(benchmark::State& state) {
  for (auto _ : state) {
    state.PauseTiming();
    auto app = ioci::Application::create(options());
    ioci::Session session("bench");
    state.ResumeTiming();
    auto world = (*app)->dispatch(session, "world.get", Map{{"name", "pa10_circle"}});
    if (!world.ok()) {
      state.SkipWithError(world.error().sentence().c_str());
      break;
    }
    auto done = (*app)->dispatch(session, "world.evaluate", Map{{"id", *world}});
    if (!done.ok()) state.SkipWithError(done.error().sentence().c_str());
    state.PauseTiming();
    app->reset();
    state.ResumeTiming();
  }
}
BENCHMARK(load_pa10_world_cold)->Unit(benchmark::kMillisecond)->UseRealTime();

/// The paper's circle, 629 samples: inverse kinematics, rates, torques and their parts.
void simulate_pa10_circle(benchmark::State& state) {
  auto app = ioci::Application::create(options());
  ioci::Session session("bench");
  auto world = (*app)->dispatch(session, "world.get", Map{{"name", "pa10_circle"}});
  for (auto _ : state) {
    auto r = (*app)->dispatch(session, "world.inverse_dynamics",
                              Map{{"id", *world}, {"robot", "pa10"}, {"trajectory", "circle"}});
    if (!r.ok()) state.SkipWithError(r.error().sentence().c_str());
  }
}
BENCHMARK(simulate_pa10_circle)->Unit(benchmark::kMillisecond)->UseRealTime();

/// A world with `count` objects and a robot after them.
struct LargeWorld {
  explicit LargeWorld(std::size_t count) {
    auto tx = document.begin("large");
    model::Solid ball;
    ball.nodes.push_back({CsgKind::sphere, "ball", -1, {}, {0.1}});
    const AnyId what = *tx->add("ball", ball);
    model::World world;
    for (std::size_t i = 0; i < count; ++i)
      world.objects.push_back({"crate_" + std::to_string(i), what, {}});
    id = WorldId{tx->add("hall", std::move(world))->number};
    if (!tx->commit().ok()) std::abort();
    last = "crate_" + std::to_string(count - 1);
  }
  document::Document document;
  WorldId id;
  std::string last;
};

/// One member by its name, through the index of the world that stands already.
void find_in_world(benchmark::State& state) {
  const LargeWorld large(static_cast<std::size_t>(state.range(0)));
  const auto now = large.document.now();
  for (auto _ : state)
    benchmark::DoNotOptimize(
        document::world_index(*now, large.id)->find(document::MemberList::objects, large.last));
}
BENCHMARK(find_in_world)->Arg(100)->Arg(10'000);

/// The same by comparing one name after the other.
void scan_world(benchmark::State& state) {
  const LargeWorld large(static_cast<std::size_t>(state.range(0)));
  const auto now = large.document.now();
  const auto& objects = now->get(large.id)->objects;
  for (auto _ : state)
    benchmark::DoNotOptimize(std::find_if(objects.begin(), objects.end(),
                                          [&](const auto& o) { return o.name == large.last; }));
}
BENCHMARK(scan_world)->Arg(100)->Arg(10'000);

/// Building the index, which is done once for each version of a world.
void index_world(benchmark::State& state) {
  const LargeWorld large(static_cast<std::size_t>(state.range(0)));
  const auto now = large.document.now();
  for (auto _ : state) benchmark::DoNotOptimize(document::WorldIndex(*now->get(large.id)));
}
BENCHMARK(index_world)->Arg(10'000)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace robomosp
