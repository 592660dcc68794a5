// SPDX-License-Identifier: Apache-2.0
// Every script of scripts/examples and scripts/demos runs in the program as a user runs it, and the
// Lua library does what its comments say.
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <iterator>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace robomosp {
namespace {

namespace fs = std::filesystem;

struct Outcome {
  int status = -1;
  std::string said;
};

Outcome run(const std::string& arguments) {
  Outcome o;
  const std::string command = ROBOMOSP_BUILD_DIR "/bin/robomosp " + arguments + " 2>&1";
  if (std::FILE* pipe = popen(command.c_str(), "r")) {
    std::array<char, 512> line{};
    while (std::fgets(line.data(), static_cast<int>(line.size()), pipe)) o.said += line.data();
    const int status = pclose(pipe);
    o.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128;
  }
  return o;
}

std::vector<std::string> scripts() {
  std::vector<std::string> all;
  for (const char* folder : {"examples", "demos"})
    for (const auto& entry :
         fs::directory_iterator(fs::path(ROBOMOSP_SOURCE_DIR) / "scripts" / folder))
      if (entry.path().extension() == ".lua")
        all.push_back(std::string(folder) + "/" + entry.path().filename().string());
  std::sort(all.begin(), all.end());
  return all;
}

class Script : public ::testing::TestWithParam<std::string> {};

TEST_P(Script, Runs) {
  const fs::path folder =
      fs::temp_directory_path() / ("robomosp-script-" + std::to_string(::getpid()));
  fs::create_directories(folder);
  fs::current_path(folder);
  fs::create_directories(folder / "named");
  const bool is_demo = GetParam().starts_with("demos/");
  const auto o =
      run("run " ROBOMOSP_SOURCE_DIR "/scripts/" + GetParam() + (is_demo ? " named" : ""));
  EXPECT_EQ(o.status, 0) << o.said;
  EXPECT_FALSE(o.said.empty());
  // What a demo writes is in the folder that it was given.
  if (is_demo) {
    EXPECT_EQ(std::distance(fs::directory_iterator(folder), fs::directory_iterator()), 1);
    EXPECT_FALSE(fs::is_empty(folder / "named"));
  }
  fs::current_path(fs::temp_directory_path());
  fs::remove_all(folder);
}

INSTANTIATE_TEST_SUITE_P(All, Script, ::testing::ValuesIn(scripts()), [](const auto& param) {
  std::string name;
  for (const char c : param.param)
    name += (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') ? c : '_';
  return name;
});

/// Programs of scripts/programs in their cells, as docs/user/irl/checking.md says.
std::vector<std::string> programs() {
  std::vector<std::string> all;
  for (const auto& entry :
       fs::directory_iterator(fs::path(ROBOMOSP_SOURCE_DIR) / "scripts/programs"))
    if (entry.path().extension() == ".irl") all.push_back(entry.path().stem().string());
  std::sort(all.begin(), all.end());
  return all;
}
class ShippedProgram : public ::testing::TestWithParam<std::string> {};

TEST_P(ShippedProgram, IsPostedBehindACheckWithoutErrors) {
  const std::string at = ROBOMOSP_SOURCE_DIR "/scripts/programs/" + GetParam();
  const auto o = run("post " + at + ".irl --world " + at + ".lua --run-check --check --target krl");
  // A program of a controller moves one robot.
  const bool is_of_two = GetParam() == "two_robots";
  EXPECT_EQ(o.status, is_of_two ? 1 : 0) << o.said;
  EXPECT_EQ(o.said.find(":49:5: error: a program of KUKA KRL moves one robot") != std::string::npos,
            is_of_two)
      << o.said;
  if (!is_of_two) {
    EXPECT_EQ(o.said.find(": error: "), std::string::npos) << o.said;
  }
  EXPECT_NE(o.said.find("not checked: "), std::string::npos) << o.said;
  // What remains is explained in the page, and no more.
  const auto has = [&](const char* words) { return o.said.find(words) != std::string::npos; };
  EXPECT_EQ(has("less than the 5 mm required"), GetParam() == "arc_weld") << o.said;
  EXPECT_EQ(has("ends with STATUS 0"), GetParam() == "pick_and_place") << o.said;
  for (const char* never : {"touch,", "singular configuration", "does not reach", "nobody gives",
                            "nothing is within", "run out of time"})
    EXPECT_FALSE(has(never)) << never << "\n" << o.said;
}
INSTANTIATE_TEST_SUITE_P(All, ShippedProgram, ::testing::ValuesIn(programs()),
                         [](const auto& param) { return param.param; });

TEST(LuaLibrary, DoesWhatItsCommentsSay) {
  const auto o = run(R"(eval "local rm = require 'robomosp'
    local v = rm.linspace(0, 1, 5)
    assert(#v == 5 and v[2] == 0.25 and v[5] == 1)
    assert(rm.map({1, 2}, function(x) return 2 * x end)[2] == 4)
    assert(rm.max_difference({1, 2, 3}, {1, 2.5, 2}) == 1)
    assert(rm.in_degrees(math.pi / 2) == '90 deg')
    local steel = material.create { name = 'trial', density = 1000 }
    local inside = rm.try_out(function() steel:set { density = 2000 } return steel:describe().density end)
    assert(inside == 2000 and steel:describe().density == 1000)
    print 'as said'")");
  EXPECT_EQ(o.said, "as said\n");
  EXPECT_EQ(o.status, 0);
}

TEST(Help, IsTheSameAsAWordAndAsAnOptionAndNamesWhatIsNoSubcommand) {
  EXPECT_NE(run("help").said.find("rpc"), std::string::npos) << run("help").said;
  EXPECT_NE(run("help run").said.find("FILE"), std::string::npos) << run("help run").said;
  const auto bogus = run("plugin bogus");
  EXPECT_EQ(bogus.status, 2) << bogus.said;
  EXPECT_NE(bogus.said.find("bogus"), std::string::npos) << bogus.said;
}

TEST(Print, ShowsTablesReadablyAndCyclesAsSuch) {
  EXPECT_EQ(run("eval 'print({1, 2})'").said.find("table:"), std::string::npos);
  EXPECT_NE(run("eval 'local t = {} t.t = t print(t)'").said.find("<cycle>"), std::string::npos);
}

TEST(ClassicLines, RunInTurnInOneProgram) {
  const auto o = run(R"(classic "Worlds Open worlds/pa10_circle.wld" "PRobot pa10 GetDOF")");
  EXPECT_EQ(o.status, 0) << o.said;
  EXPECT_NE(o.said.find("7"), std::string::npos) << o.said;
  const auto unknown = run(R"(classic "PRobt pa10 GetDOF")");
  EXPECT_EQ(unknown.status, 3) << unknown.said;
  EXPECT_NE(unknown.said.find("PRobot"), std::string::npos) << unknown.said;
}

}  // namespace
}  // namespace robomosp
