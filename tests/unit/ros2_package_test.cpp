// SPDX-License-Identifier: Apache-2.0
// Robots as packages of ROS 2: files that agree with each other and with their formats
// (tests/unit/ros2_check.py, written apart), kinematics that come back, pairs that hold, names.
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>

#include <gtest/gtest.h>

#include "kernel/process.h"
#include "lua/lua_state.h"
#include "support/program.h"

namespace robomosp {
namespace {

namespace fs = std::filesystem;

class Ros2Package : public test::ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    folder_ = fs::temp_directory_path() / ("robomosp-ros2-" + std::to_string(::getpid()));
    fs::create_directories(folder_);
    lua::LuaOptions options;
    options.print = [](std::string_view) {};
    state_ = std::make_unique<lua::LuaState>(app(), session_, options);
    run("folder = '" + folder_.string() + "'");
  }
  void TearDown() override {
    state_.reset();
    fs::remove_all(folder_);
  }
  void run(const std::string& code) {
    const auto r = state_->run_string(code, "test.lua");
    EXPECT_TRUE(r.ok()) << code << "\n" << (r.ok() ? "" : r.error().sentence());
  }
  std::string eval(const std::string& code) {
    const auto r = state_->eval(code);
    return r.ok() ? *r : "error: " + r.error().sentence();
  }
  void refused(const std::string& code, const std::string& part) {
    const std::string said = eval(code);
    EXPECT_NE(said.find("error: "), std::string::npos) << code << " gave " << said;
    EXPECT_NE(said.find(part), std::string::npos) << code << " gave " << said;
  }
  std::string text(const std::string& file) const {
    std::ifstream in(folder_ / file, std::ios::binary);
    EXPECT_TRUE(in) << file;
    return {std::istreambuf_iterator<char>(in), {}};
  }
  /// The checker's sentences; empty = the package is sound.
  std::string check(const std::string& package) const {
    ProcessSpec spec;
    spec.program = "/usr/bin/python3";
    spec.arguments = {std::string(ROBOMOSP_SOURCE_DIR) + "/tests/unit/ros2_check.py",
                      (folder_ / package).string()};
    std::string said;
    spec.line = [&](std::string_view line) { said += std::string(line) + "\n"; };
    NoProgress progress;
    const auto done = run_process(spec, progress);
    return done.ok() ? said : said + done.error().sentence();
  }
  fs::path folder_;
  ioci::Session session_{"test"};
  std::unique_ptr<lua::LuaState> state_;
};

TEST_F(Ros2Package, OfLibraryRobotsAreSoundAndComeBack) {
  if (!fs::exists("/usr/bin/python3")) GTEST_SKIP() << "there is no Python";
  for (const char* name : {"puma560", "panda", "cobra600", "gripper", "dual_arm", "planar2rods"}) {
    SCOPED_TRACE(name);
    run("arm = robot '" + std::string(name) + "'");
    run("done = arm:export_ros2{folder = folder, samples = 300, overwrite = true}");
    const std::string package = std::string(name) + "_description";
    EXPECT_EQ(check(package), "");
    EXPECT_EQ(eval("return done.package"), package);
    run(R"lua(
      for _, file in ipairs(done.files) do assert(io.open(file), file) end
      back = import{file = done.folder .. "/urdf/" .. done.package .. ".urdf", name = "back"}[1]
      worst = 0
      for k = 1, 5 do
        local q = {}
        for i = 1, arm:dof() do q[i] = 0.1 * math.sin(3.7 * k + 1.3 * i) end
        local a, b = arm:fk{q = q}, back:fk{q = q}
        for i = 1, 3 do worst = math.max(worst, math.abs(a.position[i] - b.position[i])) end
      end)lua");
    EXPECT_EQ(eval("return worst < 1e-12"), "true") << eval("return worst");
    app().document.clear();
  }
}

TEST_F(Ros2Package, PairsThatAreDisabledDoNotTouchInOtherConfigurations) {
  run(R"lua(
    arm = robot "ur5"
    done = arm:export_ros2{folder = folder, samples = 5000, seed = 4}
    srdf = io.open(done.folder .. "/config/" .. done.package .. ".srdf"):read("a")
    reason = {}
    for a, b, why in srdf:gmatch('link1="([%w_]+)" link2="([%w_]+)" reason="(%a+)"') do
      assert(not reason[a .. " " .. b] and not reason[b .. " " .. a])
      reason[a .. " " .. b] = why
      reason[b .. " " .. a] = why
    end
    -- Whatever touches at random has a pair that is checked, and what touches "Always" always does.
    touched, never = 0, 0
    for k = 1, 300 do
      local q = {}
      for i, j in ipairs(arm:joints()) do q[i] = j.lower + (j.upper - j.lower) * math.abs(math.sin(k * 7.31 + i * 2.77)) end
      for _, pair in ipairs(arm:self_collisions{q = q}) do
        touched = touched + 1
        if reason[pair.a .. " " .. pair.b] == "Never" then never = never + 1 end
      end
    end
    checked = #arm:checked_pairs()
    adjacent, found = 0, 0
    for _, why in pairs(reason) do
      if why == "Adjacent" then adjacent = adjacent + 1 else found = found + 1 end
    end)lua");
  EXPECT_EQ(eval("return touched > 0, never, adjacent > 0"), "true\n0\ntrue");
  EXPECT_EQ(eval("return found / 2 == #arm:find_allowed_pairs{samples = 5000, seed = 4}"), "true");
  // With the rules in the robot they are the user's.
  run("again = arm:export_ros2{folder = folder, samples = 10, overwrite = true}");
  EXPECT_EQ(eval("return again.disabled_pairs >= done.disabled_pairs"), "true");
  EXPECT_NE(text("ur5_description/config/ur5_description.srdf").find("reason=\"User\""),
            std::string::npos);
}

TEST_F(Ros2Package, SaysLimitsPosesAndFollowers) {
  run(R"lua(robot "gripper":export_ros2{folder = folder, package = "hand", bodies = false, command = "effort",
    hardware = "my_driver/MyHardware", group = "fingers", samples = 0, email = "a@b.c", maintainer = "A & B"})lua");
  const std::string urdf = text("hand/urdf/hand.urdf"), srdf = text("hand/config/hand.srdf");
  EXPECT_NE(urdf.find("<plugin>my_driver/MyHardware</plugin>"), std::string::npos);
  EXPECT_NE(urdf.find("<command_interface name=\"effort\">"), std::string::npos);
  EXPECT_NE(urdf.find("<param name=\"mimic\">"), std::string::npos);
  EXPECT_NE(srdf.find("<group_state name=\"closed\" group=\"fingers\">"), std::string::npos);
  EXPECT_NE(srdf.find("<passive_joint"), std::string::npos);
  EXPECT_EQ(srdf.find("disable_collisions"), std::string::npos);
  EXPECT_NE(text("hand/package.xml").find("A &amp; B"), std::string::npos);
  EXPECT_FALSE(fs::exists(folder_ / "hand/meshes"));
  if (fs::exists("/usr/bin/python3")) {
    EXPECT_EQ(check("hand"), "");
  }
}

TEST_F(Ros2Package, NothingIsReplacedUnasked) {
  run(R"lua(arm = robot "planar2rods" arm:export_ros2{folder = folder, samples = 0})lua");
  const std::string before = text("planar2rods_description/package.xml");
  refused("arm:export_ros2{folder = folder, samples = 0, licence = 'MIT'}", "are already present");
  EXPECT_EQ(text("planar2rods_description/package.xml"), before);
  run("arm:export_ros2{folder = folder, samples = 0, licence = 'MIT', overwrite = true}");
  EXPECT_NE(text("planar2rods_description/package.xml"), before);
}

TEST_F(Ros2Package, NamesThatRosDoesNotTakeAreRefused) {
  run(R"lua(arm = robot "planar2rods")lua");
  for (const char* name : {"Arm", "a", "2arm", "my-arm", "my__arm", "arm_", "m y", "../x"})
    refused(std::string("arm:export_ros2{folder = folder, samples = 0, package = '") + name + "'}",
            "package");
  refused("arm:export_ros2{folder = folder, samples = 0, group = 'a b'}", "group");
  refused("arm:export_ros2{folder = folder, samples = 0, email = 'nobody'}", "e-mail");
  refused("arm:export_ros2{folder = folder, samples = 0, version = '1.0'}", "version");
  refused("arm:export_ros2{folder = folder, samples = 0, hardware = 'x'}", "ros2_control plugin");
  run("odd = robot.create{name = 'odd', convention = 'dh', links = {{name = 'first link', a = 1, "
      "mass = 1}}}");
  refused("odd:export_ros2{folder = folder, samples = 0}", "first link");
  run("two = robot.create{name = 'two', convention = 'dh', links = {{name = 'world', a = 1, mass = "
      "1}}}");
  refused("two:export_ros2{folder = folder, samples = 0}", "world");
  EXPECT_TRUE(fs::is_empty(folder_));
  refused("export{what = arm, file = folder .. '/other.xml'}", "package.xml");
}

}  // namespace
}  // namespace robomosp
