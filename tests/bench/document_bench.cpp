// SPDX-License-Identifier: Apache-2.0
// How long edits of a document with 10,000 records take: each must stay well below a millisecond.
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include "document/document.h"

namespace robomosp {
namespace {

using document::Document;

/// A tenth materials, the rest solids of one box, spread over them.
struct Filled {
  explicit Filled(std::int64_t records) {
    auto tx = document.begin("fill");
    for (std::int64_t i = 0; i < records / 10; ++i)
      materials.push_back(*tx->add("material" + std::to_string(i), model::Material{}));
    for (std::int64_t i = records / 10; i < records; ++i) {
      model::Solid s;
      s.material = materials[static_cast<std::size_t>(i) % materials.size()];
      s.nodes.push_back({CsgKind::box, "block", -1, {}, {1, 1, 1}});
      solids.push_back(*tx->add("solid" + std::to_string(i), std::move(s)));
    }
    (void)tx->commit().ok();
  }
  Document document;
  std::vector<MaterialId> materials;
  std::vector<SolidId> solids;
};

void edit_one(benchmark::State& state) {
  Filled f(state.range(0));
  double size = 1;
  for (auto _ : state) {
    auto tx = f.document.begin("size");
    (void)
        tx->edit(f.solids[f.solids.size() / 2], [&](model::Record& r) -> Result<void> {
            std::get<model::Solid>(r.body).nodes[0].sizes[0] = (size += 1);
            return {};
          }).ok();
    if (!tx->commit().ok()) state.SkipWithError("commit failed");
  }
}
BENCHMARK(edit_one)->Arg(100)->Arg(10'000)->Arg(100'000)->Unit(benchmark::kMicrosecond);

void edit_material_of_nine(benchmark::State& state) {
  Filled f(state.range(0));
  double density = 1;
  for (auto _ : state) {
    auto tx = f.document.begin("density");
    (void)
        tx->edit(f.materials[3], [&](model::Record& r) -> Result<void> {
            std::get<model::Material>(r.body).density = (density += 1);
            return {};
          }).ok();
    if (!tx->commit().ok()) state.SkipWithError("commit failed");
  }
}
BENCHMARK(edit_material_of_nine)->Arg(10'000)->Unit(benchmark::kMicrosecond);

void add_and_undo(benchmark::State& state) {
  Filled f(state.range(0));
  for (auto _ : state) {
    auto tx = f.document.begin("add");
    (void)tx->add("new", model::Material{}).ok();
    if (!tx->commit().ok() || !f.document.undo().ok()) state.SkipWithError("commit or undo failed");
  }
}
BENCHMARK(add_and_undo)->Arg(10'000)->Unit(benchmark::kMicrosecond);

void rename_one(benchmark::State& state) {
  Filled f(state.range(0));
  bool is_even = false;
  for (auto _ : state) {
    auto tx = f.document.begin("rename");
    is_even = !is_even;
    (void)
        tx->edit(f.solids[100], [&](model::Record& r) -> Result<void> {
            r.name = is_even ? "even" : "odd";
            return {};
          }).ok();
    if (!tx->commit().ok()) state.SkipWithError("commit failed");
  }
}
BENCHMARK(rename_one)->Arg(10'000)->Unit(benchmark::kMicrosecond);

void undo_and_redo(benchmark::State& state) {
  Filled f(state.range(0));
  auto tx = f.document.begin("add");
  (void)tx->add("new", model::Material{}).ok();
  (void)tx->commit().ok();
  for (auto _ : state)
    if (!f.document.undo().ok() || !f.document.redo().ok())
      state.SkipWithError("undo or redo failed");
}
BENCHMARK(undo_and_redo)->Arg(10'000)->Unit(benchmark::kMicrosecond);

void find_by_name(benchmark::State& state) {
  Filled f(state.range(0));
  const auto now = f.document.now();
  for (auto _ : state) benchmark::DoNotOptimize(now->find(Kind::solid, "solid5000"));
}
BENCHMARK(find_by_name)->Arg(10'000)->Unit(benchmark::kNanosecond);

void fill(benchmark::State& state) {
  for (auto _ : state) Filled f(state.range(0));
}
BENCHMARK(fill)->Arg(10'000)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace robomosp
