// SPDX-License-Identifier: Apache-2.0
// Opening a stranger's robot runs no program that its file names.
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>

#include "support/lua_program.h"

namespace robomosp::lua {
namespace {

namespace fs = std::filesystem;

class CompiledDynamics : public test::LuaProgramTest {
 protected:
  void SetUp() override {
    LuaProgramTest::SetUp();
    folder_ = fs::path(testing::TempDir()) / "robomosp_compiled_dynamics";
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    std::ofstream(folder_ / "compiler") << "#!/bin/sh\ntouch '" << mark().string() << "'\nexit 1\n";
    fs::permissions(folder_ / "compiler", fs::perms::owner_all);
    setenv("XDG_CACHE_HOME", folder_.c_str(), 1);  // nothing is found compiled
  }
  void TearDown() override {
    unsetenv("ROBOMOSP_CC");
    unsetenv("XDG_CACHE_HOME");
    fs::remove_all(folder_);
    LuaProgramTest::TearDown();
  }
  [[nodiscard]] fs::path mark() const { return folder_ / "was_run"; }
  [[nodiscard]] std::string compiler() const { return (folder_ / "compiler").string(); }

  fs::path folder_;
};

TEST_F(CompiledDynamics, OfAFileRunNoProgramThatTheFileNames) {
  std::ofstream(folder_ / "stranger.rbt")
      << "robomosp robot 1\nname stranger\nconvention dh\n"
         "link rod {\n  row { a 1  alpha 0  d 0  theta 0 }\n  given { mass 1 }\n}\n"
         "inverse_dynamics compiled { compiler \""
      << compiler() << "\" }\n";
  const std::string said = eval("r = robot.load{file = '" + (folder_ / "stranger.rbt").string() +
                                "'}\nreturn r:inverse_dynamics{q = {0}}");
  EXPECT_FALSE(fs::exists(mark()));
  EXPECT_NE(said.find("compiler"), std::string::npos) << said;
}

TEST_F(CompiledDynamics, AreCompiledByTheCompilerOfTheUser) {
  run("r = robot.create{name = 'rod', links = {{name = 'rod', a = 1, mass = 1}}}\n"
      "r:set{inverse_dynamics = 'compiled'}");
  setenv("ROBOMOSP_CC", compiler().c_str(), 1);
  const std::string said = eval("return r:inverse_dynamics{q = {0}}");
  EXPECT_TRUE(fs::exists(mark()));
  EXPECT_NE(said.find(compiler()), std::string::npos) << said;
  EXPECT_NE(said.find("ROBOMOSP_CC"), std::string::npos) << said;
}

}  // namespace
}  // namespace robomosp::lua
