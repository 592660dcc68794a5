// SPDX-License-Identifier: Apache-2.0
// Steps of contact physics and how their time grows with the number of boxes: in stacks and
// scattered on one floor, which nothing but the floor joins, in towers and in walls, whose boxes
// all touch: as piles, by the engine's own exact solver, and by sweeps.
#include <cmath>
#include <string>

#include <benchmark/benchmark.h>

#include <robomosp/sdk/conformance/physics_suite.h>

namespace robomosp {
namespace {

constexpr double kSide = 0.1, kDent = 1e-4;

enum class Layout {
  stacks,     ///< of three, 0.1 mm into each other
  scattered,  ///< each on the floor, apart
  wall,       ///< rows of ten, each box on two of the row below
  tower       ///< one on the other
};

Vec3 place_of(Layout layout, std::int64_t i, std::int64_t count) {
  const auto at = [](std::int64_t k) { return static_cast<double>(k); };
  const double level = kSide - kDent;
  const auto across = static_cast<std::int64_t>(std::ceil(std::sqrt(static_cast<double>(count))));
  switch (layout) {
    case Layout::stacks: {
      const std::int64_t stack = i / 3, wide = (across + 1) / 2;
      return {0.2 * at(stack % wide), 0.2 * at(stack / wide), kSide / 2 + level * at(i % 3)};
    }
    case Layout::scattered: return {0.2 * at(i % across), 0.2 * at(i / across), kSide / 2 - kDent};
    case Layout::wall: {
      const std::int64_t row = i / 10;
      return {1.02 * kSide * at(i % 10) + (row % 2 ? 0.03 : 0.0), 0, kSide / 2 + level * at(row)};
    }
    case Layout::tower: break;
  }
  return {0, 0, kSide / 2 + level * at(i)};
}

/// A step after they have come to rest; arguments are the number of boxes.
void boxes(benchmark::State& state, Layout layout, const char* solver = "exact",
           const char* piles_from = "17") {
  const auto found = conformance::find_provider<PhysicsEngine>(
      std::string(ROBOMOSP_PLUGIN_DIR) + "/physics_ode.so", "ode");
  if (!found.ok()) return state.SkipWithError(found.error().sentence().c_str());
  const auto engine = conformance::create<PhysicsEngine>(**found);
  conformance::TableParams params(**found);
  params.set("solver", std::string(solver)).set("piles_from", std::string(piles_from));
  std::vector<PhysicsBody> bodies(1);
  Shape box;
  box.kind = ShapeKind::box;
  box.sizes = {40, 40, 0.2};
  bodies[0].shape.shapes = {box};
  bodies[0].pose.p = {0, 0, -0.1};
  box.sizes = {kSide, kSide, kSide};
  for (std::int64_t i = 0; i < state.range(0); ++i) {
    PhysicsBody& b = bodies.emplace_back();
    b.shape.shapes = {box};
    b.mass = {0.6, {}, {1e-3, 1e-3, 1e-3, 0, 0, 0}};
    b.pose.p = place_of(layout, i, state.range(0));
  }
  auto made = engine->create(bodies, {}, {0, 0, -9.81}, params);
  if (!made.ok()) return state.SkipWithError(made.error().sentence().c_str());
  NoProgress none;
  if (auto r = (*made)->step(1e-3, 100, {}, none); !r.ok())
    return state.SkipWithError(r.error().sentence().c_str());
  for (auto _ : state)
    if (auto r = (*made)->step(1e-3, 1, {}, none); !r.ok())
      return state.SkipWithError(r.error().sentence().c_str());
  std::vector<PhysicsContact> contacts;
  (*made)->contacts(contacts);
  state.counters["contacts"] = static_cast<double>(contacts.size());
}
#define ROBOMOSP_BOXES(name, layout, ...)                                   \
  BENCHMARK_CAPTURE(boxes, name, Layout::layout __VA_OPT__(, ) __VA_ARGS__) \
      ->Unit(benchmark::kMillisecond)
ROBOMOSP_BOXES(scattered, scattered)->Arg(10)->Arg(100)->Arg(1000);
ROBOMOSP_BOXES(stacks, stacks)->Arg(10)->Arg(60)->Arg(100)->Arg(400)->Arg(1000);
ROBOMOSP_BOXES(tower, tower)->Arg(10)->Arg(20)->Arg(60)->Arg(200);
ROBOMOSP_BOXES(wall, wall)->Arg(10)->Arg(20)->Arg(60)->Arg(100)->Arg(400);
ROBOMOSP_BOXES(tower_by_the_engine, tower, "exact", "1000000")->Arg(10)->Arg(20)->Arg(60);
ROBOMOSP_BOXES(wall_by_the_engine, wall, "exact", "1000000")->Arg(10)->Arg(20)->Arg(60);
ROBOMOSP_BOXES(wall_by_sweeps, wall, "sweeps")->Arg(10)->Arg(100)->Arg(1000);

}  // namespace
}  // namespace robomosp
