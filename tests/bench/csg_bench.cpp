// SPDX-License-Identifier: Apache-2.0
// Times of the CSG engine csg_occt on the parts that the performance targets name.
#include <cmath>
#include <cstdlib>
#include <memory>
#include <numbers>
#include <vector>

#include <benchmark/benchmark.h>

#include <robomosp/sdk/conformance/csg_suite.h>

#include "support/plugin_door.h"

namespace robomosp::conformance {
namespace {

std::unique_ptr<CsgEngine> make_engine() {
  return test::make_provider<CsgEngine>(ROBOMOSP_PLUGIN_DIR "/csg_occt.so", "occt");
}

constexpr MeshQuality kQuality{1e-4, 0.5};

/// Two hubs, a bar, two bores, twelve bolt holes; the last hole is moved by `shift`.
Csg link(double shift) {
  std::vector<Csg> parts{unite({cylinder(0.060, 0.080), cylinder(0.045, 0.080).at(0.300, 0, 0),
                                box(0.300, 0.060, 0.050).at(0.150, 0, 0.015)}),
                         cylinder(0.025, 0.100).at(0, 0, -0.010),
                         cylinder(0.018, 0.100).at(0.300, 0, -0.010)};
  for (int k = 0; k < 6; ++k) {
    const double t = k * std::numbers::pi / 3;
    parts.push_back(cylinder(0.004, 0.030).at(0.045 * std::cos(t), 0.045 * std::sin(t), 0.060));
    parts.push_back(
        cylinder(0.004, 0.030).at(0.300 + 0.032 * std::cos(t), 0.032 * std::sin(t), 0.060));
  }
  parts.back().node.placement.p[0] += shift;
  return subtract(std::move(parts));
}

Csg plate(int holes) {
  std::vector<Csg> parts{box(0.020 * holes, 0.020 * holes, 0.020)};
  for (int i = 0; i < holes; ++i)
    for (int j = 0; j < holes; ++j)
      parts.push_back(
          cylinder(0.006, 0.030)
              .at(0.020 * (i - 0.5 * (holes - 1)), 0.020 * (j - 0.5 * (holes - 1)), -0.005));
  return subtract(std::move(parts));
}

std::shared_ptr<const CsgShape> evaluate(const CsgEngine& engine, const CsgTree& tree) {
  NoProgress progress;
  return std::move(engine.evaluate(tree, progress)).value();
}

void mesh_and_moments(const CsgEngine& engine, const CsgShape& shape) {
  NoProgress progress;
  benchmark::DoNotOptimize(engine.mesh(shape, kQuality, progress).value());
  benchmark::DoNotOptimize(engine.moments(shape, progress).value());
}

// From scratch: a fresh engine has nothing in its cache.
void from_scratch(benchmark::State& state, const CsgTree& tree, bool with_mesh) {
  for (auto step : state) {
    (void)step;
    const auto engine = make_engine();
    const auto shape = evaluate(*engine, tree);
    if (with_mesh) mesh_and_moments(*engine, *shape);
  }
}
void LinkSolid(benchmark::State& state) { from_scratch(state, link(0).tree(), false); }
void LinkSolidMeshMoments(benchmark::State& state) { from_scratch(state, link(0).tree(), true); }
void Plate100Solid(benchmark::State& state) { from_scratch(state, plate(10).tree(), false); }
void Plate100SolidMeshMoments(benchmark::State& state) {
  from_scratch(state, plate(10).tree(), true);
}

// A drag: every step moves the last hole a little further.
void LinkDragOneHole(benchmark::State& state) {
  const auto engine = make_engine();
  mesh_and_moments(*engine, *evaluate(*engine, link(0).tree()));
  mesh_and_moments(*engine, *evaluate(*engine, link(1e-6).tree()));
  double shift = 1e-6;
  for (auto step : state) {
    (void)step;
    shift += 1e-6;
    mesh_and_moments(*engine, *evaluate(*engine, link(shift).tree()));
  }
}

void LinkUndo(benchmark::State& state) {
  const auto engine = make_engine();
  const CsgTree tree = link(0).tree();
  evaluate(*engine, tree);
  for (auto step : state) {
    (void)step;
    benchmark::DoNotOptimize(evaluate(*engine, tree));
  }
}

void UnionOf200Apart(benchmark::State& state) {
  std::vector<Csg> parts;
  for (int i = 0; i < 200; ++i)
    parts.push_back(cylinder(0.010, 0.030).at(0.030 * (i % 20), 0.030 * (i / 20), 0));
  from_scratch(state, unite(std::move(parts)).tree(), false);
}

void PaperMass(benchmark::State& state) {
  Pose on_top;
  on_top.p = {0, 0.05, 0.05};
  const CsgTree plate_tree = box(0.20, 0.20, 0.05).tree(),
                column_tree = cylinder(0.05, 0.20).tree();
  NoProgress progress;
  for (auto step : state) {
    (void)step;
    const auto engine = make_engine();
    const std::vector<PlacedShape> parts{{evaluate(*engine, plate_tree), {}},
                                         {evaluate(*engine, column_tree), on_top}};
    benchmark::DoNotOptimize(engine->partition(parts, progress).value());
  }
}

BENCHMARK(LinkSolid)->Unit(benchmark::kMillisecond);
BENCHMARK(LinkSolidMeshMoments)->Unit(benchmark::kMillisecond);
BENCHMARK(LinkDragOneHole)->Unit(benchmark::kMillisecond);
BENCHMARK(LinkUndo)->Unit(benchmark::kMillisecond);
BENCHMARK(Plate100Solid)->Unit(benchmark::kMillisecond);
BENCHMARK(Plate100SolidMeshMoments)->Unit(benchmark::kMillisecond);
BENCHMARK(UnionOf200Apart)->Unit(benchmark::kMillisecond);
BENCHMARK(PaperMass)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace robomosp::conformance
