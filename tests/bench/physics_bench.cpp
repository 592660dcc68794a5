// SPDX-License-Identifier: Apache-2.0
// Steps of contact physics: boxes in stacks that rest on one floor. Nothing but the floor joins the
// stacks, so that the time grows with their number.
#include <benchmark/benchmark.h>

#include <robomosp/sdk/conformance/physics_suite.h>

namespace robomosp {
namespace {

/// Boxes of 0.1 m in stacks of three, 0.1 mm into each other, after they have come to rest.
void StackedBoxes(benchmark::State& state) {
  const auto found = conformance::find_provider<PhysicsEngine>(
      std::string(ROBOMOSP_PLUGIN_DIR) + "/physics_ode.so", "ode");
  if (!found.ok()) return state.SkipWithError(found.error().sentence().c_str());
  const auto engine = conformance::create<PhysicsEngine>(**found);
  const conformance::TableParams params(**found);
  constexpr double kSide = 0.1, kDent = 1e-4;
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
    b.pose.p = {0.2 * static_cast<double>(i / 3 % 12), 0.2 * static_cast<double>(i / 36),
                kSide / 2 + (kSide - kDent) * static_cast<double>(i % 3)};
  }
  auto made = engine->create(bodies, {}, {0, 0, -9.81}, params);
  if (!made.ok()) return state.SkipWithError(made.error().sentence().c_str());
  NoProgress none;
  if (auto r = (*made)->step(1e-3, 200, {}, none); !r.ok())
    return state.SkipWithError(r.error().sentence().c_str());
  for (auto _ : state)
    if (auto r = (*made)->step(1e-3, 1, {}, none); !r.ok())
      return state.SkipWithError(r.error().sentence().c_str());
  std::vector<PhysicsContact> contacts;
  (*made)->contacts(contacts);
  state.counters["contacts"] = static_cast<double>(contacts.size());
}
BENCHMARK(StackedBoxes)->Arg(60)->Arg(400)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace robomosp
