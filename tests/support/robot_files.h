// SPDX-License-Identifier: Apache-2.0
// RobotFiles: robot files of other programs, from text to records in a document and to the model.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "robot_files/read.h"
#include "robotics/kinematics.h"
#include "support/workbench.h"

namespace robomosp::test {

struct RobotFiles : testing::Test {
  /// The records of a text, loaded; meshes are left out.
  AnyId load(std::string_view text) {
    robot_files::Options options;
    options.source = "test";
    options.folder = folder;
    auto made = robot_files::read_robot(text, options);
    if (!made.ok()) {
      ADD_FAILURE() << made.error().sentence();
      return {};
    }
    notes.clear();
    for (const std::string& n : made->notes) notes += n + "\n";
    io::MemoryFiles files;
    for (ImportedGeometry& g : made->geometries)
      files.geometries.emplace(g.name, unwrap(io::make_geometry(std::move(g.geometry))));
    for (ImportedFile& f : made->records) files.texts.emplace(f.name, f.text);
    auto tx = bench.document.begin("import");
    auto loaded = io::load_memory(*tx, files, made->records.back().name, "test", {}, {});
    if (!loaded.ok()) {
      ADD_FAILURE() << loaded.error().sentence() << "\n" << made->records.back().text;
      return {};
    }
    const auto commit = tx->commit();
    EXPECT_TRUE(commit.ok()) << (commit.ok() ? "" : commit.error().sentence());
    return loaded->id;
  }
  RobotModel model_of(AnyId id) {
    NoProgress progress;
    const auto m = unwrap(bench.derived.robot_model(*bench.document.now(), RobotId{id.number},
                                                    {0, 0, -9.81}, progress));
    return m ? *m : RobotModel{};
  }
  const model::Robot& robot(AnyId id) { return *bench.document.now()->get(RobotId{id.number}); }
  static Pose tip(const RobotModel& m, std::vector<double> q, std::size_t which = 0) {
    std::vector<Pose> frames(m.joints.size());
    robotics::forward_kinematics(m, q, frames);
    return robotics::tip_pose(m, which, frames);
  }
  std::string fault(std::string_view text) const {
    robot_files::Options options;
    options.folder = folder;
    const auto made = robot_files::read_robot(text, options);
    return made.ok() ? "" : made.error().sentence();
  }

  Workbench bench;
  std::filesystem::path folder;  ///< where included files are looked for
  std::string notes;
};

}  // namespace robomosp::test
