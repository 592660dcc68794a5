// SPDX-License-Identifier: Apache-2.0
// The engine for triangle meshes: imported and faceted solids, where the exact engine is slow.
#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>

#include <robomosp/sdk/csg.h>

#include "kernel/plugin_loader.h"

namespace robomosp {
namespace {

std::shared_ptr<CsgEngine> engine() {
  static Registry registry;
  static PluginLoader loader(registry);
  static const std::shared_ptr<CsgEngine> one = [] {
    (void)loader.load(std::string(ROBOMOSP_PLUGIN_DIR) + "/csg_cgal.so").loaded;
    auto made = registry.create<CsgEngine>("cgal");
    return made.ok() ? *made : nullptr;
  }();
  return one;
}

/// A ball of 2 columns (rows - 1) triangles.
std::shared_ptr<const CsgGeometry> ball(int rows, int columns, double radius) {
  auto g = std::make_shared<CsgGeometry>();
  g->form = CsgGeometry::Form::mesh;
  const auto at = [&](int i, int j) {
    if (i == 0) return 0U;
    if (i == rows) return static_cast<std::uint32_t>((rows - 1) * columns + 1);
    return static_cast<std::uint32_t>(1 + (i - 1) * columns + j % columns);
  };
  g->points.resize(3 * (at(rows, 0) + std::size_t{1}));
  for (int i = 0; i <= rows; ++i)
    for (int j = 0; j < columns; ++j) {
      const double polar = std::numbers::pi * i / rows, around = 2 * std::numbers::pi * j / columns;
      double* p = g->points.data() + 3 * std::size_t{at(i, j)};
      p[0] = radius * std::sin(polar) * std::cos(around);
      p[1] = radius * std::sin(polar) * std::sin(around);
      p[2] = radius * std::cos(polar);
    }
  g->triangles.reserve(static_cast<std::size_t>(6 * columns * rows));
  const auto put = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    for (const std::uint32_t v : {a, b, c}) g->triangles.push_back(v);
  };
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < columns; ++j) {
      if (i > 0) put(at(i, j), at(i + 1, j), at(i, j + 1));
      if (i + 1 < rows) put(at(i, j + 1), at(i + 1, j), at(i + 1, j + 1));
    }
  return g;
}

CsgNode node(CsgKind kind, std::int32_t parent, std::array<double, 6> sizes, const Pose& at = {}) {
  CsgNode n;
  n.kind = kind;
  n.parent = parent;
  n.sizes = sizes;
  n.placement = at;
  return n;
}
CsgNode scan(std::shared_ptr<const CsgGeometry> g, Vec3 at = {}) {
  CsgNode n = node(CsgKind::imported, 0, {1});
  n.geometry = std::move(g);
  n.placement.p = at;
  return n;
}

/// The tree with copies of its meshes, which the engine has not seen before: it keeps those it has.
CsgTree unseen(CsgTree tree) {
  for (CsgNode& n : tree.nodes)
    if (n.geometry) n.geometry = std::make_shared<const CsgGeometry>(*n.geometry);
  return tree;
}

void run(benchmark::State& state, const CsgTree& given) {
  NoProgress progress;
  const auto csg = engine();
  if (!csg) return state.SkipWithError("csg_cgal is not built");
  std::size_t triangles = 0;
  for (auto _ : state) {
    state.PauseTiming();
    const CsgTree tree = unseen(given);
    state.ResumeTiming();
    const auto shape = csg->evaluate(tree, progress);
    if (!shape.ok()) return state.SkipWithError(shape.error().sentence().c_str());
    const auto mesh = csg->mesh(**shape, {}, progress);
    if (!mesh.ok()) return state.SkipWithError(mesh.error().sentence().c_str());
    triangles = mesh->triangle_count();
  }
  state.counters["triangles"] = static_cast<double>(triangles);
}

void faceted_sphere_minus_itself_moved(benchmark::State& state) {
  const auto g = ball(32, 64, 0.05);  // 3968 triangles
  CsgTree tree;
  tree.nodes = {node(CsgKind::difference, -1, {}), scan(g), scan(g, {0.001, 0.002, 0.003})};
  run(state, tree);
}
BENCHMARK(faceted_sphere_minus_itself_moved)->Unit(benchmark::kMillisecond);

void sphere_minus_three_cylinders(benchmark::State& state) {
  Pose x, y, z;
  z.p = {0, 0, -0.1};
  x.R = {0, 0, 1, 0, 1, 0, -1, 0, 0};
  x.p = {-0.1, 0, 0};
  y.R = {1, 0, 0, 0, 0, -1, 0, 1, 0};
  y.p = {0, 0.1, 0};
  CsgTree tree;
  tree.nodes = {node(CsgKind::difference, -1, {}), node(CsgKind::sphere, 0, {0.05}),
                node(CsgKind::cylinder, 0, {0.02, 0.2}, x),
                node(CsgKind::cylinder, 0, {0.02, 0.2}, y),
                node(CsgKind::cylinder, 0, {0.02, 0.2}, z)};
  run(state, tree);
}
BENCHMARK(sphere_minus_three_cylinders)->Unit(benchmark::kMillisecond);

void scan_of_20000_triangles_cut_by_a_box(benchmark::State& state) {
  CsgTree tree;
  Pose low;
  low.p = {0, 0, -1.01};
  tree.nodes = {node(CsgKind::difference, -1, {}), scan(ball(101, 100, 0.05)),
                node(CsgKind::box, 0, {1, 1, 1}, low)};
  run(state, tree);
}
BENCHMARK(scan_of_20000_triangles_cut_by_a_box)->Unit(benchmark::kMillisecond);

/// Figures of Manifold 3.5.1 on the reference machine, time that passed [ms].
constexpr double kManifoldAnew100k = 125, kManifold20k = 50, kManifold100k = 210,
                 kManifold1M = 2500;

/// Evaluates, meshes and weighs; the number of triangles, or 0 with an error in `state`.
std::size_t whole_work(benchmark::State& state, const CsgEngine& csg, const CsgTree& tree) {
  NoProgress progress;
  const auto shape = csg.evaluate(tree, progress);
  if (!shape.ok()) return state.SkipWithError(shape.error().sentence().c_str()), 0;
  const auto mesh = csg.mesh(**shape, {}, progress);
  if (!mesh.ok()) return state.SkipWithError(mesh.error().sentence().c_str()), 0;
  const auto moments = csg.moments(**shape, progress);
  if (!moments.ok()) return state.SkipWithError(moments.error().sentence().c_str()), 0;
  benchmark::DoNotOptimize(moments->volume);
  return mesh->triangle_count();
}

/// Times `work` as this program's time on all its threads and as time that passed, and how often
/// Manifold's figure they are.
class Clock {
 public:
  template <class Work>
  void time(Work&& work) {
    const double wall = wall_now(), cpu = cpu_now();
    work();
    walls_.push_back(wall_now() - wall);
    cpus_.push_back(cpu_now() - cpu);
  }
  void report(benchmark::State& state, double manifold) {
    if (walls_.empty()) return;
    state.counters["cpu_ms"] = median(cpus_);
    state.counters["times_Manifold"] = median(walls_) / manifold;
    state.counters["cpu_times_Manifold"] = median(cpus_) / manifold;
  }

 private:
  static double read(clockid_t which) {
    timespec t{};
    clock_gettime(which, &t);
    return static_cast<double>(t.tv_sec) * 1e3 + static_cast<double>(t.tv_nsec) * 1e-6;
  }
  static double wall_now() { return read(CLOCK_MONOTONIC); }
  static double cpu_now() { return read(CLOCK_PROCESS_CPUTIME_ID); }
  static double median(std::vector<double> all) {
    const auto middle = all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2);
    std::nth_element(all.begin(), middle, all.end());
    return *middle;
  }
  std::vector<double> walls_, cpus_;
};

/// A user drags a bore through a scan: every position is evaluated, drawn and weighed. `turned`:
/// the scan lies at an angle, so that none of its corners is a double.
void drag_a_hole(benchmark::State& state, bool turned) {
  const auto csg = engine();
  if (!csg) return state.SkipWithError("csg_cgal is not built");
  CsgTree tree;
  Pose at;
  at.p = {0.1, 0.05, -1};
  tree.nodes = {node(CsgKind::difference, -1, {}), scan(ball(224, 224, 0.5)),
                node(CsgKind::cylinder, 0, {0.03, 2}, at)};
  if (turned) {
    const double c = std::cos(0.3), s = std::sin(0.3);
    tree.nodes[1].placement.R = {c, -s, 0, s, c, 0, 0, 0, 1};
  }
  std::size_t triangles = whole_work(state, *csg, tree);  // the scan is imported once
  Clock clock;
  for (auto _ : state) {
    double& x = tree.nodes[2].placement.p[0];
    x = x < 0.3 ? x + 0.0013 : 0.1;
    clock.time([&] { triangles = whole_work(state, *csg, tree); });
    if (triangles == 0) return;
  }
  clock.report(state, kManifoldAnew100k);
  state.counters["triangles"] = static_cast<double>(triangles);
}
void drag_a_hole_in_a_scan_of_100000_triangles(benchmark::State& state) {
  drag_a_hole(state, false);
}
BENCHMARK(drag_a_hole_in_a_scan_of_100000_triangles)->Unit(benchmark::kMillisecond)->UseRealTime();
void drag_a_hole_in_a_turned_scan_of_100000_triangles(benchmark::State& state) {
  drag_a_hole(state, true);
}
BENCHMARK(drag_a_hole_in_a_turned_scan_of_100000_triangles)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

/// Neither scan has been seen before; both are checked, repaired where needed, cut, drawn, weighed.
void difference_of_two_scans(benchmark::State& state) {
  const auto csg = engine();
  if (!csg) return state.SkipWithError("csg_cgal is not built");
  const auto rows = static_cast<int>(state.range(0));
  const double manifold = rows < 150 ? kManifold20k : rows < 500 ? kManifold100k : kManifold1M;
  CsgTree given;
  given.nodes = {node(CsgKind::difference, -1, {}), scan(ball(rows, rows, 0.5)),
                 scan(ball(rows + 1, rows + 2, 0.5), {0.01, 0.02, 0.03})};
  std::size_t triangles = 0;
  Clock clock;
  for (auto _ : state) {
    state.PauseTiming();
    const CsgTree tree = unseen(given);
    state.ResumeTiming();
    clock.time([&] { triangles = whole_work(state, *csg, tree); });
    if (triangles == 0) return;
  }
  clock.report(state, manifold);
  state.counters["triangles"] = static_cast<double>(triangles);
}
BENCHMARK(difference_of_two_scans)
    ->Arg(101)
    ->Arg(224)
    ->Arg(708)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

/// As it comes from an STL file: every triangle has corners of its own.
void mass_of_980000_triangles(benchmark::State& state) {
  const auto shared = ball(700, 701, 0.5);
  auto soup = std::make_shared<CsgGeometry>();
  soup->form = CsgGeometry::Form::mesh;
  for (const std::uint32_t v : shared->triangles) {
    soup->triangles.push_back(static_cast<std::uint32_t>(soup->triangles.size()));
    for (std::size_t k = 0; k < 3; ++k)
      soup->points.push_back(static_cast<double>(static_cast<float>(shared->points[3 * v + k])));
  }
  NoProgress progress;
  const auto csg = engine();
  if (!csg) return state.SkipWithError("csg_cgal is not built");
  CsgTree tree;
  tree.nodes = {scan(soup)};
  tree.nodes[0].parent = -1;
  for (auto _ : state) {
    state.PauseTiming();
    const CsgTree fresh = unseen(tree);
    state.ResumeTiming();
    const auto shape = csg->evaluate(fresh, progress);
    if (!shape.ok()) return state.SkipWithError(shape.error().sentence().c_str());
    const auto moments = csg->moments(**shape, progress);
    if (!moments.ok()) return state.SkipWithError(moments.error().sentence().c_str());
    benchmark::DoNotOptimize(moments->volume);
  }
}
BENCHMARK(mass_of_980000_triangles)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace robomosp
