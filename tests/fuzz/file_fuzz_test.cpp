// SPDX-License-Identifier: Apache-2.0
// Seeded mutation of the files that are neither native nor of CAD: robots as URDF, MJCF and SDF,
// recordings as CSV and in the program's own format, journals of unsaved work, shapes of imported
// solids, programs and profiles of controllers. What is refused is refused in a sentence and leaves
// the document as it was; what is read can be used.
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "io/recovery_journal.h"
#include "support/mutator.h"
#include "support/program.h"
#include "support/seed.h"

namespace robomosp {
namespace {

namespace fs = std::filesystem;

constexpr const char* kUrdf = R"(<?xml version="1.0"?>
<robot name="arm">
  <material name="grey"><color rgba="0.5 0.5 0.5 1"/></material>
  <link name="base"/>
  <link name="upper">
    <inertial><origin xyz="0 0 0.1" rpy="0 0 0"/><mass value="2"/>
      <inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.01"/></inertial>
    <visual><origin xyz="0 0 0.1"/><geometry><cylinder radius="0.03" length="0.2"/></geometry>
      <material name="grey"/></visual>
    <collision><geometry><box size="0.1 0.1 0.2"/></geometry></collision>
  </link>
  <link name="fore"><inertial><mass value="1"/><inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0"
    izz="0.01"/></inertial><visual><geometry><sphere radius="0.05"/></geometry></visual></link>
  <link name="hand"/>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
    <origin xyz="0 0 0.3" rpy="0 1.57 0"/><axis xyz="0 0 1"/>
    <limit lower="-2" upper="2" effort="50" velocity="3"/><dynamics damping="0.1" friction="0.2"/></joint>
  <joint name="elbow" type="continuous"><parent link="upper"/><child link="fore"/>
    <origin xyz="0.4 0 0"/><axis xyz="0 1 0"/></joint>
  <joint name="slide" type="prismatic"><parent link="fore"/><child link="hand"/>
    <axis xyz="1 0 0"/><limit lower="0" upper="0.1" effort="1" velocity="1"/>
    <mimic joint="elbow" multiplier="0.1" offset="0"/></joint>
</robot>
)";

constexpr const char* kMjcf = R"(<mujoco model="arm">
  <compiler angle="degree" autolimits="true"/>
  <default><joint damping="0.1"/><default class="small"><geom size="0.02"/></default></default>
  <asset><material name="red" rgba="1 0 0 1"/></asset>
  <worldbody>
    <geom type="plane" size="1 1 0.1"/>
    <body name="upper" pos="0 0 0.3" euler="0 90 0">
      <joint name="shoulder" type="hinge" axis="0 0 1" range="-120 120" armature="0.1"/>
      <geom type="capsule" fromto="0 0 0 0.4 0 0" size="0.03" density="500" material="red"/>
      <body name="fore" pos="0.4 0 0" quat="1 0 0 0">
        <inertial pos="0.1 0 0" mass="1" diaginertia="0.01 0.01 0.01"/>
        <joint name="elbow" type="hinge" axis="0 1 0"/>
        <geom class="small" type="sphere"/>
        <site name="tip" pos="0.3 0 0"/>
        <body name="hand"><joint name="slide" type="slide" axis="1 0 0" range="0 0.1"/>
          <geom type="box" size="0.02 0.02 0.02" mass="0.1"/></body>
      </body>
    </body>
  </worldbody>
  <equality><joint joint1="slide" joint2="elbow" polycoef="0 0.1 0 0 0"/></equality>
  <actuator><motor joint="shoulder" gear="100" ctrlrange="-1 1"/></actuator>
</mujoco>
)";

constexpr const char* kSdf = R"(<?xml version="1.0"?>
<sdf version="1.7"><model name="arm">
  <link name="base"><inertial><mass>5</mass></inertial></link>
  <link name="upper"><pose relative_to="base">0 0 0.3 0 0 0</pose>
    <inertial><pose>0 0 0.1 0 0 0</pose><mass>2</mass><inertia><ixx>0.02</ixx><iyy>0.02</iyy>
      <izz>0.01</izz><ixy>0</ixy><ixz>0</ixz><iyz>0</iyz></inertia></inertial>
    <visual name="v"><geometry><cylinder><radius>0.03</radius><length>0.2</length></cylinder></geometry>
    </visual></link>
  <link name="fore"><pose relative_to="upper">0.4 0 0 0 0 0</pose>
    <collision name="c"><geometry><box><size>0.1 0.1 0.1</size></box></geometry></collision></link>
  <frame name="tip" attached_to="fore"><pose>0.3 0 0 0 0 0</pose></frame>
  <joint name="fix" type="fixed"><parent>world</parent><child>base</child></joint>
  <joint name="shoulder" type="revolute"><parent>base</parent><child>upper</child>
    <axis><xyz>0 0 1</xyz><limit><lower>-2</lower><upper>2</upper><effort>50</effort></limit>
      <dynamics><damping>0.1</damping></dynamics></axis></joint>
  <joint name="slide" type="prismatic"><parent>upper</parent><child>fore</child>
    <axis><xyz expressed_in="__model__">1 0 0</xyz></axis></joint>
</model></sdf>
)";

constexpr const char* kTokens[] = {"1e308",
                                   "-1e308",
                                   "1e-320",
                                   "nan",
                                   "inf",
                                   "0",
                                   "-1",
                                   "9223372036854775808",
                                   "<link name=\"x\">",
                                   "</link>",
                                   "<body>",
                                   "</body>",
                                   "<joint/>",
                                   "<include>",
                                   "base",
                                   "upper",
                                   "world",
                                   "&amp;",
                                   "&#x0;",
                                   "<!--",
                                   "]]>",
                                   "\"",
                                   "'",
                                   "/>",
                                   ",",
                                   "\n",
                                   "\xFF",
                                   " [m]",
                                   "entry 99999999999 0\n",
                                   "whole\n",
                                   "drop 1\n",
                                   "put 1 a.mtr 0 3\n"};

class FileFuzz : public test::CommandTest {
 protected:
  void SetUp() override {
    CommandTest::SetUp();
    std::string pattern = (fs::temp_directory_path() / "robomosp_files_XXXXXX").string();
    folder_ = ::mkdtemp(pattern.data());
  }
  void TearDown() override {
    std::error_code ec;
    fs::remove_all(folder_, ec);
  }
  static std::string get(const fs::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  void put(const fs::path& file, const std::string& text) const {
    fs::remove(file);
    std::ofstream(file, std::ios::binary) << text;
  }
  /// Runs a command that may refuse; tells whether it did not.
  bool may(std::string_view name, const Map& args, const std::string& text) {
    const std::string before = app().document.content_digest();
    const auto r = app().dispatch(session_, name, args);
    if (r.ok()) return true;
    EXPECT_FALSE(r.error().message.empty()) << text;
    EXPECT_LT(r.error().sentence().size(), 8000U) << r.error().sentence().substr(0, 500);
    EXPECT_NE(r.error().code, ErrorCode::internal) << r.error().sentence() << "\n" << text;
    EXPECT_EQ(app().document.content_digest(), before) << text;
    return false;
  }
  /// Changes samples as long as the budget allows; `read` tells whether a file was accepted.
  void change(std::vector<std::string> names, double share,
              const std::function<bool(const fs::path&, const std::string&)>& read) {
    std::vector<std::string> texts;
    for (const std::string& name : names) {
      texts.push_back(get(folder_ / name));
      ASSERT_TRUE(read(folder_ / name, texts.back())) << name;
    }
    std::mt19937 random(test::seed());
    test::Mutator mutator(random, texts, kTokens);
    const test::FuzzBudget budget(3000, share);
    std::map<std::string, std::pair<std::size_t, std::size_t>> tally;
    for (std::size_t n = 0; budget.allows(n) && !HasFailure(); ++n) {
      const std::size_t k = random() % names.size();
      const std::string text = mutator.mutate(texts[k]);
      const fs::path file = folder_ / names[k];
      put(file, text);
      const bool accepted = read(file, text);
      auto& [runs, good] = tally[names[k]];
      ++runs;
      good += accepted ? 1U : 0U;
      put(file, texts[k]);
      if (HasFailure()) std::cout << names[k] << ":\n" << text << "\n";
    }
    for (const auto& [name, count] : tally)
      std::cout << name << ": " << count.first << " files, " << count.second << " accepted\n";
  }

  fs::path folder_;
};

TEST_F(FileFuzz, RobotsAreReadOrRefusedInASentence) {
  put(folder_ / "arm.urdf", kUrdf);
  put(folder_ / "arm.xml", kMjcf);
  put(folder_ / "arm.sdf", kSdf);
  change({"arm.urdf", "arm.xml", "arm.sdf"}, 0.3,
         [&](const fs::path& file, const std::string& text) {
           app().document.clear();
           if (!may("import", {{"file", file.string()}}, text)) return false;
           for (const AnyId id : app().document.now()->list(Kind::robot)) {
             const Value robot = ioci::Application::handle(id);
             const Map of{{"id", robot}};
             // What is read can be asked, whatever it answers.
             (void)may("robot.describe", of, text);
             (void)may("robot.mass", of, text);
             (void)may("robot.fk", {{"id", robot}, {"q", "zero"}}, text);
             (void)may("robot.text", of, text);
           }
           return true;
         });
}

TEST_F(FileFuzz, RecordingsAreReadOrRefusedInASentence) {
  put(folder_ / "run.csv",
      "time [s],q1 [rad],\"q2, second\",f\n0,0,1,0\n0.1,0.5,2,1e-3\n0.2,1,3,nan\n");
  const Value read = call("recording.load", {{"file", (folder_ / "run.csv").string()}});
  for (const char* name : {"run.rec", "again.csv"})
    call("recording.save", {{"id", read}, {"file", (folder_ / name).string()}});
  change(
      {"run.csv", "run.rec", "again.csv"}, 0.3, [&](const fs::path& file, const std::string& text) {
        const auto loaded = app().dispatch(session_, "recording.load", {{"file", file.string()}});
        if (!loaded.ok()) {
          EXPECT_FALSE(loaded.error().message.empty()) << text;
          EXPECT_NE(loaded.error().code, ErrorCode::internal) << loaded.error().sentence();
          EXPECT_LT(loaded.error().sentence().size(), 8000U);
          return false;
        }
        call("recording.save", {{"id", *loaded}, {"file", (folder_ / "copy.npz").string()}});
        call("recording.remove", {{"id", *loaded}});
        return true;
      });
}

TEST_F(FileFuzz, JournalsGiveBackWhatIsWhole) {
  document::Document d;
  {
    io::RecoveryJournal journal(
        d, {.folder = folder_ / "made", .interval = std::chrono::milliseconds(1)});
    for (int i = 0; i < 5; ++i) {
      auto tx = d.begin("make");
      model::Material m;
      m.density = 1000 + i;
      ASSERT_TRUE(tx->add("m" + std::to_string(i), m).ok());
      ASSERT_TRUE(tx->commit().ok());
      const std::uintmax_t before = journal.file().empty() ? 0 : fs::file_size(journal.file());
      journal.changed();
      for (int wait = 0; wait < 2000; ++wait) {
        if (!journal.file().empty() && fs::file_size(journal.file()) > before) break;
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    put(folder_ / "work.journal", get(journal.file()));
  }
  change({"work.journal"}, 0.2, [&](const fs::path& file, const std::string& text) {
    auto claimed = io::ClaimedJournal::claim(file);
    EXPECT_TRUE(claimed.ok());
    if (!claimed.ok()) return false;
    document::Document into;
    auto tx = into.begin("restore");
    std::vector<std::string> notes;
    const auto restored = claimed->restore(*tx, {}, notes);
    for (const std::string& n : notes) EXPECT_LT(n.size(), 8000U) << text.size();
    if (!restored.ok()) {
      EXPECT_FALSE(restored.error().message.empty());
      return false;
    }
    const auto done = tx->commit();
    EXPECT_TRUE(done.ok()) << done.error().sentence() << "\n" << text;
    (void)claimed->unsaved({});
    return !restored->empty();
  });
}

TEST_F(FileFuzz, ShapesOfImportedSolidsAreReadOrRefusedInASentence) {
  call("solid.create",
       {{"name", "wedge"},
        {"root",
         Map{{"kind", "imported"},
             {"geometry",
              Map{{"points", Value(NumericArray({0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}, 4, 3))},
                  {"triangles",
                   Value(NumericArray({1, 3, 2, 1, 2, 4, 2, 3, 4, 3, 1, 4}, 4, 3))}}}}}});
  call("solid.save", {{"id", "wedge"}, {"file", (folder_ / "wedge.csg").string()}});
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder_))
    names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  ASSERT_EQ(names.size(), 2U);
  change(names, 0.2, [&](const fs::path&, const std::string& text) {
    app().document.clear();
    if (!may("solid.load", {{"file", (folder_ / "wedge.csg").string()}}, text)) return false;
    for (const AnyId id : app().document.now()->list(Kind::solid)) {
      const Map of{{"id", ioci::Application::handle(id)}};
      (void)may("solid.volume", of, text);
      (void)may("solid.text", of, text);
    }
    return true;
  });
}

TEST_F(FileFuzz, ProgramsAndControllersAreReadOrRefusedInASentence) {
  const Value lift =
      call("program.create",
           {{"name", "lift"},
            {"source",
             "PROGRAM lift;\nSIGNAL INPUT BOOL: here AT 1; OUTPUT BOOL: grip AT 2;\nVAR POSE: p := "
             "POSE(POSITION(500.0, 0.0, 120.0), ORIZYX(0.0, 180.0, 0.0));\nBEGIN\n  WAIT FOR "
             "here;\n  MOVE "
             "LIN p SPEED := 80.0;\n  grip := TRUE;\nENDPROGRAM;\n"}});
  call("program.save", {{"id", lift}, {"file", (folder_ / "lift.prg").string()}});
  const fs::path library = fs::path(ROBOMOSP_SOURCE_DIR) / "scripts/library/controllers";
  std::vector<std::string> names{"lift.prg"};
  for (const char* name : {"kuka_krc.ctl", "fanuc_r30ib.ctl", "melfa_cr800.ctl", "linuxcnc_abc.ctl",
                           "yaskawa_dx200.ctl"}) {
    put(folder_ / name, get(library / name));
    names.emplace_back(name);
  }
  const std::string source = *call("program.source", {{"id", lift}}).as_string();
  change(names, 0.2, [&](const fs::path& file, const std::string& text) {
    app().document.clear();
    if (!may("file.load", {{"file", file.string()}}, text)) return false;
    app().document.clear();
    const Value loaded = call("file.load", {{"file", file.string()}});
    if (file.extension() == ".prg") {
      (void)may("program.check", {{"id", loaded}}, text);
      (void)may("program.code", {{"id", loaded}}, text);
      return true;
    }
    const Value program = call("program.create", {{"name", "lift"}, {"source", source}});
    (void)may("program.post", {{"id", program}, {"profile", loaded}}, text);
    return true;
  });
}

}  // namespace
}  // namespace robomosp
