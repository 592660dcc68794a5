// SPDX-License-Identifier: Apache-2.0
// Worlds of 10, 100 and 1000 bodies: the least distance and what touches, with the trees of boxes
// and with every pair asked for, a configuration a call on one thread.
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <string>

#include <benchmark/benchmark.h>

#include "collision/collision.h"
#include "document/document.h"
#include "evaluation/derived.h"
#include "kernel/plugin_loader.h"
#include "kernel/registry.h"

namespace robomosp {
namespace {

constexpr int kLinks = 6;
constexpr std::size_t kConfigurations = 16;

struct World {
  Registry registry;
  PluginLoader loader{registry};
  document::Document document;
  evaluation::Derived derived{registry};
  std::shared_ptr<const collision::CollisionModel> model;
  std::vector<double> q;  ///< of kConfigurations
};

SolidId solid(document::Transaction& t, const char* name, CsgKind kind, std::array<double, 6> sizes,
              Vec3 at) {
  model::Solid s;
  model::SolidNode n;
  n.kind = kind;
  n.name = name;
  n.parent = -1;
  n.sizes = sizes;
  n.placement.position = at;
  s.nodes = {n};
  return *t.add(name, std::move(s));
}

/// One arm among objects, or arms side by side, in a hall that grows with their number.
std::unique_ptr<World> make(int bodies, bool of_arms) {
  auto w = std::make_unique<World>();
  w->loader.set_search_path({ROBOMOSP_PLUGIN_DIR});
  w->loader.load_all();
  auto t = w->document.begin("world");
  const SolidId rod = solid(*t, "rod", CsgKind::box, {0.25, 0.08, 0.08}, {-0.15, 0, -0.04});
  const SolidId crate = solid(*t, "crate", CsgKind::box, {0.3, 0.3, 0.3}, {});
  const SolidId ball = solid(*t, "ball", CsgKind::sphere, {0.15}, {});
  model::Robot arm;
  for (int i = 0; i < kLinks; ++i) {
    model::Link l;
    l.name = "l" + std::to_string(i);
    l.parent = i - 1;
    l.row.a = 0.3;
    l.row.alpha = i % 2 ? 1.5 : 0;
    l.lower = -2.5;
    l.upper = 2.5;
    l.parts.push_back({rod, {}});
    arm.links.push_back(std::move(l));
  }
  const RobotId robot = *t->add("arm", std::move(arm));
  std::mt19937_64 random(1);
  const auto uniform = [&](double a, double b) {
    return std::uniform_real_distribution<double>(a, b)(random);
  };
  model::World world;
  const int arms = of_arms ? std::max(2, bodies / kLinks) : 1;
  const int side = static_cast<int>(std::ceil(std::sqrt(arms)));
  for (int i = 0; i < arms; ++i) {
    model::PlacedRobot r{"arm" + std::to_string(i), robot, {}, std::vector<double>(kLinks)};
    r.placement.position = {2.0 * (i % side), 2.0 * (i / side), 0};
    world.robots.push_back(r);
  }
  const double half = std::cbrt(static_cast<double>(bodies)) / 2;
  for (int i = 0; !of_arms && i < bodies - kLinks; ++i) {
    model::PlacedObject o{"o" + std::to_string(i), i % 2 ? ball : crate, {}};
    o.placement.position = {uniform(-half, half), uniform(-half, half), uniform(-half, half)};
    world.objects.push_back(o);
  }
  const WorldId id = *t->add("hall", std::move(world));
  if (!t->commit().ok()) return nullptr;
  NoProgress none;
  auto made =
      collision::CollisionModel::of_world({w->registry, w->derived, *w->document.now()}, id, none);
  if (!made.ok()) return nullptr;
  w->model = *made;
  for (std::size_t i = 0; i < kConfigurations * w->model->coordinate_count(); ++i)
    w->q.push_back(uniform(-2, 2));
  return w;
}

template <class Call>
void each_configuration(benchmark::State& state, Call&& call) {
  const auto w = make(static_cast<int>(state.range(0)), state.range(1) != 0);
  if (!w) return state.SkipWithError("no world");
  const std::size_t n = w->model->coordinate_count();
  for (auto _ : state)
    for (std::size_t i = 0; i < kConfigurations; ++i)
      if (!call(*w->model, std::span<const double>(w->q).subspan(i * n, n)))
        state.SkipWithError("failed");
  state.SetLabel(std::to_string(w->model->bodies().size()) + " bodies, " +
                 std::to_string(w->model->pairs().size()) + " pairs, " +
                 (state.range(1) ? "arms" : "one arm"));
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(kConfigurations));
}

constexpr double kInf = std::numeric_limits<double>::infinity();

void least_by_trees(benchmark::State& state) {
  each_configuration(state, [](const collision::CollisionModel& m, std::span<const double> q) {
    NoProgress none;
    return m.clearance(q, none).ok();
  });
}
void least_of_all_pairs(benchmark::State& state) {
  each_configuration(state, [](const collision::CollisionModel& m, std::span<const double> q) {
    NoProgress none;
    const auto all = m.distances(q, kInf, none);
    if (!all.ok()) return false;
    double least = kInf;
    for (const auto& d : *all) least = std::min(least, d.distance);
    benchmark::DoNotOptimize(least);
    return true;
  });
}
void touching_by_trees(benchmark::State& state) {
  each_configuration(state, [](const collision::CollisionModel& m, std::span<const double> q) {
    NoProgress none;
    return m.collisions(q, none).ok();
  });
}
/// The engine leaves out pairs whose own boxes do not meet.
void touching_of_all_pairs(benchmark::State& state) {
  each_configuration(state, [](const collision::CollisionModel& m, std::span<const double> q) {
    NoProgress none;
    return m.distances(q, 0, none).ok();
  });
}

void worlds(benchmark::internal::Benchmark* b) {
  for (const int arms : {0, 1})
    for (const int bodies : {10, 100, 1000}) b->Args({bodies, arms});
  b->Unit(benchmark::kMillisecond);
}
BENCHMARK(least_by_trees)->Apply(worlds);
BENCHMARK(least_of_all_pairs)->Apply(worlds);
BENCHMARK(touching_by_trees)->Apply(worlds);
BENCHMARK(touching_of_all_pairs)->Apply(worlds);

}  // namespace
}  // namespace robomosp
