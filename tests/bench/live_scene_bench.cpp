// SPDX-License-Identifier: Apache-2.0
// How long the scene of a world takes to follow an edit. `rebuild_ratio` is a whole rebuild in the
// same run by the update, so that figures of loaded machines can be compared.
#include <chrono>
#include <string>

#include <benchmark/benchmark.h>

#include "scene/flat_scene.h"
#include "scene/scene_model.h"
#include "support/allocations.h"
#include "support/workbench.h"

namespace robomosp::scene {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

/// A world of so many objects, each placing a record of its own where `has_records`.
struct Filled {
  Filled(std::int64_t count, bool has_records) {
    auto tx = bench.document.begin("fill");
    model::Solid s;
    s.nodes.push_back({CsgKind::box, "block", -1, {}, {0.1, 0.1, 0.1}});
    const auto block = *tx->add("block", s);
    model::World w;
    for (std::int64_t i = 0; i < count; ++i) {
      const std::string n = std::to_string(i);
      AnyId what(block);
      if (has_records) {
        model::Object o;
        o.parts = {{"lower", block, {}, {}}, {"upper", block, {.position = {0, 0, 0.1}}, {}}};
        what = AnyId(*tx->add("object " + n, o));
      }
      w.objects.push_back({"o" + n, what, {.position = {0.2 * static_cast<double>(i), 0, 0}}});
    }
    w.frames.push_back({"bench", {}});
    cell = *tx->add("cell", w);
    (void)tx->commit().ok();
  }
  void drag(std::size_t i, double x) {
    auto tx = bench.document.begin("drag");
    (void)
        tx->edit(AnyId(cell), [&](model::Record& r) -> Result<void> {
            std::get<model::World>(r.body).objects[i].placement.position[0] = x;
            return {};
          }).ok();
    (void)tx->commit().ok();
  }
  test::Workbench bench;
  NoProgress progress;
  WorldId cell;
};

double rebuild_time(Filled& f, const Extras& extras) {
  const auto begin = Clock::now();
  SceneModel anew(f.bench.derived, f.bench.registry, f.cell);
  (void)anew.update({f.bench.document.now(), extras, nullptr}, Detail::exact, f.progress).ok();
  return seconds_since(begin);
}

void drag_one(benchmark::State& state) {
  Filled f(state.range(0), false);
  SceneModel model(f.bench.derived, f.bench.registry, f.cell);
  (void)model.update({f.bench.document.now(), {}, nullptr}, Detail::exact, f.progress).ok();
  double x = 0, sum = 0;
  for (auto _ : state) {
    f.drag(static_cast<std::size_t>(state.range(0) / 2), x += 0.001);
    const Wanted wanted{f.bench.document.now(), {}, nullptr};
    const auto begin = Clock::now();
    const auto frame = model.update(wanted, Detail::exact, f.progress);
    const double took = seconds_since(begin);
    if (!frame.ok() || (*frame)->since.moved.size() != 1) state.SkipWithError("not one moved");
    state.SetIterationTime(took);
    sum += took;
  }
  state.counters["rebuild_ratio"] =
      rebuild_time(f, {}) / (sum / static_cast<double>(state.iterations()));
}
BENCHMARK(drag_one)->Arg(100)->Arg(10'000)->UseManualTime()->Unit(benchmark::kMicrosecond);

/// The lists for renderers after a drag: made whole, or those of two frames before changed.
void lists_of_drag(benchmark::State& state) {
  Filled f(state.range(0), false);
  const bool is_whole = state.range(1) != 0;
  SceneModel model(f.bench.derived, f.bench.registry, f.cell);
  FlatScene lists[3];
  double x = 0;
  std::size_t number = 0, bytes = 0;
  const auto drag = [&] {
    f.drag(static_cast<std::size_t>(state.range(0) / 2), x += 0.001);
    return *model.update({f.bench.document.now(), {}, nullptr}, Detail::exact, f.progress);
  };
  for (FlatScene& l : lists) l.show(drag());
  for (auto _ : state) {
    const FramePtr frame = drag();
    const std::size_t before = test::allocated_bytes;
    const auto begin = Clock::now();
    if (is_whole) {
      const render::Scene scene = to_scene(*frame);
      benchmark::DoNotOptimize(scene.items.data());
    } else {
      lists[number++ % 3].show(frame);
    }
    state.SetIterationTime(seconds_since(begin));
    bytes += test::allocated_bytes - before;
  }
  state.counters["bytes"] = static_cast<double>(bytes) / static_cast<double>(state.iterations());
}
BENCHMARK(lists_of_drag)
    ->ArgsProduct({{100, 10'000}, {0, 1}})
    ->UseManualTime()
    ->Unit(benchmark::kMicrosecond);

/// Memory of the frame after a drag.
void memory_of_drag(benchmark::State& state) {
  Filled f(state.range(0), false);
  SceneModel model(f.bench.derived, f.bench.registry, f.cell);
  double x = 0;
  std::size_t bytes = 0;
  for (auto _ : state) {
    f.drag(static_cast<std::size_t>(state.range(0) / 2), x += 0.001);
    const std::size_t before = test::allocated_bytes;
    (void)model.update({f.bench.document.now(), {}, nullptr}, Detail::exact, f.progress).ok();
    bytes += test::allocated_bytes - before;
  }
  state.counters["bytes"] = static_cast<double>(bytes) / static_cast<double>(state.iterations());
}
BENCHMARK(memory_of_drag)->Arg(100)->Arg(10'000);

/// The overlay of frames turned on, each object with two parts; with a record of its own, or not.
void frames_overlay(benchmark::State& state) {
  Filled f(state.range(0), true);
  SceneModel model(f.bench.derived, f.bench.registry, f.cell);
  Extras with;
  with.frames = true;
  (void)model.update({f.bench.document.now(), {}, nullptr}, Detail::exact, f.progress).ok();
  double sum = 0;
  for (auto _ : state) {
    const auto begin = Clock::now();
    const auto frame =
        model.update({f.bench.document.now(), with, nullptr}, Detail::exact, f.progress);
    const double took = seconds_since(begin);
    if (!frame.ok() || (*frame)->since.added.size() != 2 * static_cast<std::size_t>(state.range(0)))
      state.SkipWithError("not all frames were added");
    state.SetIterationTime(took);
    sum += took;
    (void)model.update({f.bench.document.now(), {}, nullptr}, Detail::exact, f.progress).ok();
  }
  state.counters["rebuild_ratio"] =
      rebuild_time(f, with) / (sum / static_cast<double>(state.iterations()));
}
BENCHMARK(frames_overlay)
    ->Arg(100)
    ->Arg(1000)
    ->Arg(10'000)
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond);

/// Everything built anew, with and without frames: must grow with the number of objects.
void rebuild(benchmark::State& state) {
  Filled f(state.range(0), true);
  Extras extras;
  extras.frames = state.range(1) != 0;
  (void)rebuild_time(f, extras);
  for (auto _ : state) state.SetIterationTime(rebuild_time(f, extras));
}
BENCHMARK(rebuild)
    ->ArgsProduct({{1000, 10'000}, {0, 1}})
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace robomosp::scene
