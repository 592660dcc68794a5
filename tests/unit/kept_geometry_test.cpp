// SPDX-License-Identifier: Apache-2.0
// Geometry that is kept from run to run: what the next run finds is what it would have computed, in
// every bit, and nothing that was damaged is ever taken for it.
#include <stdlib.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "evaluation/kept.h"
#include "kernel/file_cache.h"
#include "support/seed.h"
#include "support/workbench.h"

namespace robomosp {
namespace {

namespace fs = std::filesystem;
using evaluation::to_bytes;
using test::Workbench;

/// The library's robots with bodies of several kinds of solids.
const std::vector<std::string> kRobots{"pa10", "puma560", "panda", "ur10e", "delta", "cobra600"};

/// Everything of a robot that is kept, as bytes by its name.
std::map<std::string, std::string> geometry_of(Workbench& bench, RobotId robot) {
  NoProgress progress;
  std::map<std::string, std::string> out;
  const auto& now = *bench.document.now();
  const auto bodies = test::unwrap(bench.derived.robot_bodies(now, robot, progress));
  for (std::size_t b = 0; b < bodies.bodies.size(); ++b)
    for (std::size_t k = 0; k < bodies.bodies[b].size(); ++k)
      out["mesh " + std::to_string(b) + "." + std::to_string(k)] =
          to_bytes(*bodies.bodies[b][k].mesh);
  const auto shapes = test::unwrap(bench.derived.robot_shapes(now, robot, progress));
  for (std::size_t b = 0; b < shapes.size(); ++b)
    out["shapes " + std::to_string(b)] = to_bytes(shapes[b]);
  for (const AnyId id : now.list()) {
    if (id.kind != Kind::solid) continue;
    const SolidId solid{id.number};
    const std::string name = now.describe(id);
    if (auto m = bench.derived.moments(now, solid, progress); m.ok())
      out["moments of " + name] = to_bytes(*m);
    if (auto f = bench.derived.features(now, solid, progress); f.ok())
      out["features of " + name] = to_bytes(**f);
    if (auto box = bench.derived.bounds(now, id, progress); box.ok())
      out["bounds of " + name] = to_bytes(evaluation::SolidFacts{*box, {}});
  }
  return out;
}

class KeptGeometry : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "robomosp-kept-XXXXXX").string();
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    folder_ = name;
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::shared_ptr<FileCache> files() {
    return std::make_shared<FileCache>(FileCache::Options{
        .folder = folder_, .note = [this](const std::string& s) { notes_.push_back(s); }});
  }
  /// A run of the program, as far as geometry goes.
  std::map<std::string, std::string> run(const std::string& robot,
                                         const std::shared_ptr<FileCache>& kept) {
    Workbench bench;
    bench.derived.keep_in(kept);
    return geometry_of(bench, RobotId{bench.load("robots/" + robot + ".rbt").number});
  }
  fs::path folder_;
  std::vector<std::string> notes_;
};

TEST_F(KeptGeometry, TheNextRunFindsWhatItWouldHaveComputed) {
  for (const std::string& robot : kRobots) {
    SCOPED_TRACE(robot);
    const auto computed = run(robot, nullptr);
    const auto first = files(), second = files();
    EXPECT_EQ(run(robot, first), computed);
    EXPECT_GT(first->state().written, 0U);
    const auto found = run(robot, second);
    ASSERT_EQ(found.size(), computed.size());
    for (const auto& [what, bytes] : computed) EXPECT_EQ(found.at(what), bytes) << what;
    EXPECT_GT(second->state().hits, 0U);
    EXPECT_EQ(second->state().misses, 0U);
    EXPECT_EQ(second->state().written, 0U);
  }
  EXPECT_TRUE(notes_.empty());
}

TEST_F(KeptGeometry, WhatWasNotKeptIsMadeFromASolidThatWas) {
  NoProgress progress;
  const auto load = [&](Workbench& bench) {
    return RobotId{bench.load("robots/puma560.rbt").number};
  };
  {
    Workbench bench;
    bench.derived.keep_in(files());
    (void)test::unwrap(bench.derived.robot_shapes(*bench.document.now(), load(bench), progress));
  }
  // Sections, edges and exact geometry are not kept, and meshes of another fineness were not made.
  const auto more = [&](const std::shared_ptr<FileCache>& kept) {
    Workbench bench;
    bench.derived.keep_in(kept);
    (void)load(bench);
    const auto& now = *bench.document.now();
    std::vector<std::string> out;
    for (const AnyId id : now.list()) {
      if (id.kind != Kind::solid || out.size() >= 12) continue;
      const SolidId solid{id.number};
      const auto geometry = test::unwrap(bench.derived.geometry(now, solid, progress));
      out.push_back(std::to_string(geometry->digest[0]));
      out.push_back(to_bytes(*test::unwrap(bench.derived.mesh(now, solid, 0.002, progress))));
      const auto cut = bench.derived.section(now, solid, {}, 1e-4, progress);
      out.push_back(cut.ok() ? std::to_string((*cut)->loops.size()) : cut.error().sentence());
      const auto edges = test::unwrap(bench.derived.edges(now, solid, 1e-4, progress));
      EXPECT_FALSE(edges->empty());
      out.push_back(std::to_string(edges->size()));
    }
    EXPECT_EQ(out.size(), 12U);
    return out;
  };
  EXPECT_EQ(more(files()), more(nullptr));
}

TEST_F(KeptGeometry, DamagedFilesAreNotedAndReplaced) {
  const std::string robot = "planar2rods";
  const auto computed = run(robot, nullptr);
  (void)run(robot, files());
  std::vector<fs::path> all;
  for (const auto& e : fs::recursive_directory_iterator(folder_))
    if (e.is_regular_file()) all.push_back(e.path());
  ASSERT_GT(all.size(), 2U);
  std::mt19937 random(test::seed());
  for (int round = 0; round < 4; ++round) {
    for (const fs::path& file : all) {
      std::fstream io(file, std::ios::binary | std::ios::in | std::ios::out);
      const auto size = static_cast<long>(fs::file_size(file));
      io.seekg(static_cast<long>(random() % static_cast<unsigned long>(size)));
      const auto at = io.tellg();
      const int byte = io.get();
      io.seekp(at);
      io.put(static_cast<char>(byte ^ (1 << random() % 8)));
    }
    notes_.clear();
    const auto repaired = files();
    EXPECT_EQ(run(robot, repaired), computed);
    EXPECT_GT(repaired->state().refused, 0U);
    EXPECT_EQ(notes_.size(), repaired->state().refused);
    const auto again = files();
    EXPECT_EQ(run(robot, again), computed);
    EXPECT_EQ(again->state().refused, 0U);
    EXPECT_EQ(again->state().misses, 0U);
  }
}

TEST_F(KeptGeometry, NothingIsReadOrWrittenWhileCachingIsOff) {
  (void)run("planar2rods", files());
  const auto off = files();
  Workbench bench;
  bench.derived.keep_in(off);
  bench.derived.set_enabled(false);
  (void)geometry_of(bench, RobotId{bench.load("robots/planar2rods.rbt").number});
  EXPECT_EQ(off->state().hits + off->state().misses + off->state().written, 0U);
}

TEST_F(KeptGeometry, EveryToleranceIsPartOfTheKey) {
  NoProgress progress;
  const auto mesh = [&](double chord, const std::shared_ptr<FileCache>& kept) {
    Workbench bench;
    bench.derived.keep_in(kept);
    (void)bench.load("robots/puma560.rbt");
    const auto& now = *bench.document.now();
    for (const AnyId id : now.list())
      if (id.kind == Kind::solid)
        return to_bytes(
            *test::unwrap(bench.derived.mesh(now, SolidId{id.number}, chord, progress)));
    return std::string();
  };
  const std::string fine = mesh(1e-4, files()), coarse = mesh(5e-3, files());
  EXPECT_NE(fine, coarse);
  EXPECT_EQ(mesh(1e-4, files()), fine);
  EXPECT_EQ(mesh(5e-3, files()), coarse);
}

}  // namespace
}  // namespace robomosp
