// SPDX-License-Identifier: Apache-2.0
// Times of the CSG engine csg_occt on the parts that the performance targets name.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include <robomosp/sdk/conformance/csg_suite.h>

#include "support/plugin_door.h"

namespace robomosp::conformance {
namespace {

const char* const kPlugin = ROBOMOSP_PLUGIN_DIR "/csg_occt.so";

/// With `shortcut` "off" everything goes the general way (see csg_occt/evaluate.h).
std::unique_ptr<CsgEngine> make_engine(const char* shortcut = "on") {
  ::setenv("ROBOMOSP_CSG_PRISMATIC", shortcut, 1);
  return test::make_provider<CsgEngine>(kPlugin, "occt");
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

void mesh(const CsgEngine& engine, const CsgShape& shape, MeshQuality quality = kQuality) {
  NoProgress progress;
  benchmark::DoNotOptimize(engine.mesh(shape, quality, progress).value());
}
void mesh_and_moments(const CsgEngine& engine, const CsgShape& shape) {
  mesh(engine, shape);
  NoProgress progress;
  benchmark::DoNotOptimize(engine.moments(shape, progress).value());
}

// From scratch: a fresh engine has nothing in its cache. Evaluation includes verification.
enum class Work { solid, mesh, mesh_and_moments };
void from_scratch(benchmark::State& state, const CsgTree& tree, Work work,
                  const char* shortcut = "on") {
  for (auto step : state) {
    (void)step;
    const auto engine = make_engine(shortcut);
    const auto shape = evaluate(*engine, tree);
    if (work == Work::mesh) mesh(*engine, *shape);
    if (work == Work::mesh_and_moments) mesh_and_moments(*engine, *shape);
  }
}
void Plate100SolidMesh(benchmark::State& state) {
  from_scratch(state, plate(10).tree(), Work::mesh);
}
void Plate100GenericSolidMesh(benchmark::State& state) {
  from_scratch(state, plate(10).tree(), Work::mesh, "off");
}
void Plate100SolidMeshMoments(benchmark::State& state) {
  from_scratch(state, plate(10).tree(), Work::mesh_and_moments);
}
void Plate1600SolidMesh(benchmark::State& state) {
  from_scratch(state, plate(40).tree(), Work::mesh);
}
void LinkSolidMesh(benchmark::State& state) { from_scratch(state, link(0).tree(), Work::mesh); }
void LinkSolidMeshMoments(benchmark::State& state) {
  from_scratch(state, link(0).tree(), Work::mesh_and_moments);
}
void LinkGenericSolidMesh(benchmark::State& state) {
  from_scratch(state, link(0).tree(), Work::mesh, "off");
}

Pose about(const Vec3& axis, const Vec3& p) { return turned(axis, std::numbers::pi / 2, p); }

void SphereMinusThreeCylindersSolidMesh(benchmark::State& state) {
  const Csg bore = cylinder(0.020, 0.120);
  from_scratch(
      state,
      subtract({sphere(0.050), bore.at(0, 0, -0.060), bore.at(about({0, 1, 0}, {-0.060, 0, 0})),
                bore.at(about({1, 0, 0}, {0, 0.060, 0}))})
          .tree(),
      Work::mesh);
}
void SphereMinusMovedSphereSolidMesh(benchmark::State& state) {
  from_scratch(state, subtract({sphere(0.050), sphere(0.050).at(0.001, 0.002, 0.003)}).tree(),
               Work::mesh);
}

void SphereMeshHalfAMillion(benchmark::State& state) {
  const auto engine = make_engine();
  for (auto step : state) {
    (void)step;
    // A fresh solid: triangles stay with the one they were made for.
    mesh(*engine, *evaluate(*engine, sphere(0.050).tree()), {1e-6, 0.35});
  }
}

// A drag: every step moves the last hole a little further.
class Drag {
 public:
  explicit Drag(const char* shortcut) : engine_(make_engine(shortcut)) {
    for (int k = 0; k < 3; ++k) step();
  }
  void step() {
    mesh_and_moments(*engine_, *evaluate(*engine_, link(shift_).tree()));
    shift_ += 1e-6;
  }
  /// The time that 95 of 100 steps do not exceed [s].
  double slow_step() {
    std::vector<double> times;
    for (int k = 0; k < 100; ++k) {
      const auto before = std::chrono::steady_clock::now();
      step();
      times.push_back(
          std::chrono::duration<double>(std::chrono::steady_clock::now() - before).count());
    }
    std::sort(times.begin(), times.end());
    return times[94];
  }

 private:
  std::unique_ptr<CsgEngine> engine_;
  double shift_ = 0;
};
void drag(benchmark::State& state, const char* shortcut) {
  Drag drag(shortcut);
  for (auto step : state) {
    (void)step;
    drag.step();
  }
}
void drag_p95(benchmark::State& state, const char* shortcut) {
  Drag drag(shortcut);
  for (auto step : state) {
    (void)step;
    state.SetIterationTime(drag.slow_step());
  }
}
void LinkDragOneHole(benchmark::State& state) { drag(state, "on"); }
void LinkDragOneHoleP95(benchmark::State& state) { drag_p95(state, "on"); }
void LinkGenericDragOneHole(benchmark::State& state) { drag(state, "off"); }
void LinkGenericDragOneHoleP95(benchmark::State& state) { drag_p95(state, "off"); }

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
  from_scratch(state, unite(std::move(parts)).tree(), Work::solid);
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

void partition(benchmark::State& state, const std::vector<PlacedShape>& parts,
               const CsgEngine& engine) {
  NoProgress progress;
  for (auto step : state) {
    (void)step;
    benchmark::DoNotOptimize(engine.partition(parts, progress).value());
  }
}
void PartitionOfThree(benchmark::State& state) {
  const auto engine = make_engine();
  Pose low, aside;
  low.p = {0, 0, -0.02};
  aside.p = {0.05, 0.02, 0.05};
  partition(state,
            {{evaluate(*engine, box(0.2, 0.2, 0.05).tree()), {}},
             {evaluate(*engine, cylinder(0.05, 0.2).tree()), low},
             {evaluate(*engine, sphere(0.06).tree()), aside}},
            *engine);
}
void PartitionOf200Apart(benchmark::State& state) {
  const auto engine = make_engine();
  const auto one = evaluate(*engine, cylinder(0.010, 0.030).tree());
  std::vector<PlacedShape> parts;
  for (int i = 0; i < 200; ++i) {
    Pose pose;
    pose.p = {0.030 * (i % 20), 0.030 * (i / 20), 0};
    parts.push_back({one, pose});
  }
  partition(state, parts, *engine);
}

// In a process of its own: a plugin is never unloaded.
constexpr const char* kLoadOnly = "ROBOMOSP_BENCH_LOAD_ONLY";
int load_and_report() {
  const auto before = std::chrono::steady_clock::now();
  const auto engine = make_engine();
  std::printf("%.9f\n",
              std::chrono::duration<double>(std::chrono::steady_clock::now() - before).count());
  return engine ? 0 : 1;
}
void PluginLoad(benchmark::State& state) {
  ::setenv(kLoadOnly, "1", 1);
  const std::string self = std::filesystem::read_symlink("/proc/self/exe").string();
  for (auto step : state) {
    (void)step;
    double seconds = 0;
    std::FILE* child = popen(("'" + self + "'").c_str(), "r");
    const bool is_read = child && std::fscanf(child, "%lf", &seconds) == 1;
    if (child) pclose(child);
    if (!is_read) state.SkipWithError("the child process did not load the plugin");
    state.SetIterationTime(seconds);
  }
  ::unsetenv(kLoadOnly);
}

#define CSG_BENCH(name) BENCHMARK(name)->Unit(benchmark::kMillisecond)
CSG_BENCH(Plate100SolidMesh);
CSG_BENCH(Plate100SolidMeshMoments);
CSG_BENCH(Plate100GenericSolidMesh);
CSG_BENCH(Plate1600SolidMesh);
CSG_BENCH(LinkSolidMesh);
CSG_BENCH(LinkSolidMeshMoments);
CSG_BENCH(LinkGenericSolidMesh);
CSG_BENCH(LinkDragOneHole);
CSG_BENCH(LinkDragOneHoleP95)->UseManualTime()->Iterations(1);
CSG_BENCH(LinkGenericDragOneHole);
CSG_BENCH(LinkGenericDragOneHoleP95)->UseManualTime()->Iterations(1);
CSG_BENCH(SphereMinusThreeCylindersSolidMesh);
CSG_BENCH(SphereMinusMovedSphereSolidMesh);
CSG_BENCH(LinkUndo);
CSG_BENCH(UnionOf200Apart);
CSG_BENCH(SphereMeshHalfAMillion)->Iterations(1);
CSG_BENCH(PaperMass);
CSG_BENCH(PartitionOfThree);
CSG_BENCH(PartitionOf200Apart);
CSG_BENCH(PluginLoad)->UseManualTime()->Iterations(5);

}  // namespace
}  // namespace robomosp::conformance

int main(int argc, char** argv) {
  if (std::getenv(robomosp::conformance::kLoadOnly))
    return robomosp::conformance::load_and_report();
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
